//! Anisotropic specular maps whose mips keep the highlight's shape.
//!
//! ```
//! use std::sync::Arc;
//! use kinran_bake::aniso::*;
//! use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, untold};
//! use kinran_scene::Wrap;
//!
//! // A bump left and right of each texel, on metal of roughness 0.3: from afar it is rough along x alone.
//! let texels = (0..16 * 16).flat_map(|i| if i % 2 == 0 { [96, 128, 251] } else { [160, 128, 251] });
//! let normal = Arc::new(Image::new(16, 16, Channels::Rgb, Pixels::U8(texels.collect()))?);
//! let maps = SurfaceMaps {
//!     normal: NormalMap::new(normal, false),
//!     roughness: RoughnessMaps::Isotropic(ScalarMap { image: None, factor: 0.3 }),
//!     wrap: [Wrap::Repeat; 2],
//!     weights: None,
//! };
//! let encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
//! let aniso = SheetRequest { sheet: Sheet::Aniso, encoding, packed_with: None };
//! let options = SurfaceOptions { filter: Filter::Linear, kernel: Kernel::Box };
//! let baked = bake_surface(&maps, options, &[aniso], &untold)?;
//! let [along_x, _, along_y, _] = baked.textures[0].decode_level(1)?[0];
//! assert!(along_x > 2.0 * along_y);
//! # Ok::<(), kinran_image::Error>(())
//! ```

mod bake;
mod dpd;
mod footprint;
pub(crate) mod lanes;
mod levels;
pub(crate) mod maps;
mod microfacets;
mod ml;
mod moments;
mod ndf_error;
mod param;
pub(crate) mod reflectance;
mod sheet;
mod weights;

pub use bake::{
    BakedSurface, LevelError, SheetRequest, SurfaceOptions, bake_surface, bake_surface_and_metal,
};
pub use footprint::{Kernel, Taps, footprints, reduction};
pub use levels::{Band, Filter, coarser_levels, filter_levels};
pub use maps::{DirectionMap, NormalMap, NormalZ, RoughnessMaps, ScalarMap, SurfaceMaps, TexelSpan};
pub use microfacets::MAX_TEXELS;
pub use ndf_error::ndf_error;
pub use reflectance::{ColorMap, Dielectric, Reflectance, ReflectanceMaps};
pub use sheet::{Sheet, decode_aniso, decode_khr};
pub use weights::Weights;

//! Anisotropic specular maps whose mips keep the highlight's shape.

mod bake;
mod dpd;
mod footprint;
pub(crate) mod lanes;
mod levels;
mod maps;
mod microfacets;
mod ml;
mod moments;
mod ndf_error;
mod param;
mod sheet;

pub use bake::{BakedSurface, LevelError, SheetRequest, SurfaceOptions, bake_surface};
pub use footprint::{Kernel, Taps, footprints, reduction};
pub use levels::{Band, Filter, coarser_levels, filter_levels};
pub use maps::{DirectionMap, NormalMap, NormalZ, RoughnessMaps, ScalarMap, SurfaceMaps, TexelSpan};
pub use microfacets::MAX_TEXELS;
pub use ndf_error::ndf_error;
pub use sheet::{Sheet, decode_aniso, decode_khr};

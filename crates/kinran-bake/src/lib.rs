//! Filters and solvers that turn authored maps into runtime textures.
//!
//! | module | what it makes |
//! | --- | --- |
//! | [`folder`], [`manifest`] | an understanding of what artists wrote |
//! | [`aniso`] | mips of normals and roughness that keep the highlight's shape |
//! | [`metal`] | mips of base colour and metalness that keep what is scattered and what is reflected |
//! | [`detail`] | maps that tiled layers turn into an authored target |
//! | [`curvature`], [`skin_lut`] | curvature of meshes and tables, for skin |
//! | [`fuzz_fit`] | coefficients of fibres |
//! | [`cache`], [`stamps`] | what need not be made again |
//!
//! Colours and masks need no filter of their own:
//!
//! ```
//! use kinran_bake::{aniso::Kernel, plain_levels};
//! use kinran_image::{Channels, Image, Pixels, Transfer, untold};
//! use kinran_scene::Wrap;
//!
//! // Black and white average to half the light, which is code 188.
//! let chequer = Image::new(2, 2, Channels::R, Pixels::U8(vec![0, 255, 255, 0]))?;
//! let levels = plain_levels(&chequer, (2, 2), Transfer::Srgb, Kernel::Box, [Wrap::Repeat; 2], &untold)?;
//! assert_eq!(levels[1].rgba8, [188, 188, 188, 255]);
//! # Ok::<(), kinran_image::Error>(())
//! ```

pub mod aniso;
pub mod cache;
mod channels;
mod coverage;
pub mod curvature;
pub mod detail;
pub mod folder;
pub mod fuzz_fit;
pub mod manifest;
mod material;
pub mod metal;
mod mips;
mod patterns;
mod pieces;
mod simd;
pub mod skin_lut;
pub mod stamps;

pub use coverage::{bake_cutout, keep_coverage};
pub use kinran_image::srgb::{linear_from_srgb, srgb_from_linear};
pub use material::{MaterialSurface, NoSurface, material_reflectance, material_surface};
pub use mips::{BAND_ROWS, Rgba8Level, bake_plain, compress_levels, pack_channels, plain_levels};

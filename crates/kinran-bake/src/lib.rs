//! Filters and solvers that turn authored maps into runtime textures.

pub mod aniso;
pub mod cache;
mod channels;
pub mod curvature;
pub mod detail;
pub mod folder;
pub mod fuzz_fit;
pub mod manifest;
mod material;
mod mips;
mod patterns;
pub mod skin_lut;
pub mod stamps;

pub use kinran_image::srgb::{linear_from_srgb, srgb_from_linear};
pub use material::{MaterialSurface, NoSurface, material_surface};
pub use mips::{BAND_ROWS, Rgba8Level, bake_plain, pack_channels, plain_levels};

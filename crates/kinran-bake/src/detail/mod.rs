//! Detail maps, solved by inversion: given an authored target and the tiled layers that will lie over it, find the map
//! `s` with `s ⊗ detail = target` (slides: Detail Maps).
//!
//! ```no_run
//! # use kinran_bake::detail::*;
//! # use kinran_image::{Encoder, Encoding, Format, Preset, read_image, untold};
//! # fn main() -> Result<(), kinran_image::Error> {
//! let bc1 = Encoding { format: Format::Bc1, encoder: Encoder::Portable, preset: Preset::Normal };
//! let tile = Tile::new(&read_image("steel.png".as_ref())?, TileOptions::new(MapKind::Color, bc1))?;
//! let target = Target::new(&read_image("helmet.png".as_ref())?, MapKind::Color, false)?;
//! let mut layer = Layer::new(&tile);
//! layer.transform.scale = glam::Vec2::splat(4.0);
//! let solved = solve(&target, &[layer], &DetailOptions::new(bc1), &untold)?;
//! println!("RMSE {}", solved.levels[0].error);
//! # Ok(())
//! # }
//! ```
//!
//! The solver does at every texel what the runtime will do there (`kinran_shading::detail`): fetch each layer with its
//! transform and level of detail, shift its colour or turn its direction, mix the layers by their masks; then it inverts
//! the blend. Levels of `s` are solved one by one against the layers' own levels as the GPU decodes them, so that `s`
//! takes back what the tile's compression did; only the finest level, which is magnified against many levels of the
//! tile, is solved against the tile before compression, as in the talk.

mod choose;
mod compare;
mod layer;
mod map;
mod opacity;
mod operator;
mod paint;
mod pictures;
mod sample;
mod solve;

pub use compare::{
    Comparison, LevelComparison, LowestResolution, MagnifiedComparison, Resolution, compare,
    lowest_resolution,
};
pub use kinran_scene::LayerTransform;
pub use layer::{Layer, MAX_LAYERS, Mask, Tile, TileOptions, texture_bytes};
pub use map::{MapKind, Planes};
pub use opacity::{FADE_TRIALS, bearable_opacity};
pub use operator::Blend;
pub use paint::{Paint, PaintGuides};
pub use pictures::{ERROR_GAIN, LevelPictures, level_pictures};
pub use solve::{DetailOptions, LevelError, Solved, Target, blend_level, solve, synthesize};

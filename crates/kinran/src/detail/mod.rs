//! Detail maps: a target, as an artist painted it over tiled materials, is split into those tiles and a map that turns them
//! into it.
//!
//! ```
//! use kinran::detail::{SolveOptions, TiledLayer, solve};
//! use kinran::options::Format;
//! use kinran::{Memory, Task};
//! # use kinran_image::{Channels, Image, Pixels, encode_png};
//! # let png = |side: u32, texel: &dyn Fn(u32) -> u8| {
//! #     let texels = (0..side * side).flat_map(|i| [texel(i), 120, 90]).collect();
//! #     encode_png(&Image::new(side, side, Channels::Rgb, Pixels::U8(texels))?)
//! # };
//!
//! let files = Memory::from([
//!     ("wall_color.png", png(32, &|i| 100 + (i % 32) as u8)?),
//!     ("brick.png", png(16, &|i| 110 + (i % 4) as u8)?),
//! ]);
//! let mut layer = TiledLayer::new("brick.png");
//! layer.scale = glam::Vec2::splat(4.0);
//! let (mut how, out) = (SolveOptions::new(vec![layer]), Memory::new());
//! how.format = Some(Format::Rgba8);
//! let report = solve(&files, "wall_color.png".as_ref(), &how, &out, Task::QUIET)?;
//! assert_eq!(report.files, ["wall_color_synthesized.ktx2", "brick.ktx2"]);
//! assert!(report.levels[0].error < 1.0, "in steps of 8 bits");
//! # Ok::<(), kinran::Error>(())
//! ```

mod carrier;
mod options;
mod solve;
mod study;

use std::path::Path;

use kinran_bake::folder::{Green, Role, named_role};
use kinran_image::{Encoder, Encoding, Format, Preset};

pub use kinran_bake::detail::MapKind;
pub use options::{ALPHA, Carrier, SolveOptions, TiledLayer, exr_layer_of};
pub use solve::{KindSource, SolveReport, solve, solve_space};
pub use study::{Against, PICTURES, StudyMean, StudyOptions, StudyReport, StudyRow, picture_file, study};

/// How a map of a role is solved, where it is one that is.
pub fn kind_of_role(role: Role) -> Option<MapKind> {
    match role {
        Role::Color => Some(MapKind::Color),
        Role::Normal => Some(MapKind::Normal),
        Role::Roughness | Role::Gloss | Role::Occlusion | Role::Metallic | Role::Specular => {
            Some(MapKind::Data)
        }
        role if role.is_packed() => Some(MapKind::Data),
        Role::Aniso => Some(MapKind::Aniso),
        _ => None,
    }
}

/// What a file's name says that it holds.
pub fn kind_of_file(path: &Path) -> Option<MapKind> {
    kind_of_role(named_role(path)?.0)
}

/// The format of a kind of map where nothing is said: BC7, and BC5 for normals.
pub fn default_format(kind: MapKind) -> Format {
    if kind == MapKind::Normal { Format::Bc5 } else { Format::Bc7 }
}

/// A format with the encoder that serves it best in a second a megapixel: ISPC for BC7 where it is built in, else the portable
/// one.
pub fn encoding(format: Format) -> Encoding {
    let (encoder, preset) = match format {
        Format::Bc7 => return kinran_image::Role::Color.encoding(),
        Format::Bc1 => (Encoder::Portable, Preset::Normal),
        _ => (Encoder::Portable, Preset::Fast),
    };
    Encoding { format, encoder, preset }
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// Whether a file is a texture that was baked before.
fn is_baked(path: &Path) -> bool {
    has_extension(path, "ktx2") || has_extension(path, "dds")
}

/// Whether an authored normal map's green grows downwards by its name; baked ones are turned already.
fn green_by_name(file: &Path) -> bool {
    !is_baked(file) && named_role(file).and_then(|(_, green)| green) == Some(Green::Down)
}

//! `kinran detail`: detail maps, solved by inversion.

mod layer_flag;
mod library;
mod model;
mod page;
mod solve;

use std::path::Path;

use clap::{Subcommand, ValueEnum};
use kinran_bake::detail::MapKind;
use kinran_bake::folder::{Role, named_role};
use kinran_image::{Encoder, Encoding, Format, Preset};
use schemars::JsonSchema;
use serde::Serialize;

use crate::{Console, Error};

pub use layer_flag::LayerFlag;
pub use library::{LibraryArgs, LibraryReport, report_library};
pub(crate) use solve::space;
pub use solve::{SolveArgs, SolveReport, solve_target};

/// Splits a map into tiled layers and a map that turns them into it
///
/// `solve` takes a target, as an artist painted it over tiled materials, and those tiles, and writes the synthesized map
/// that a shader lays over the tiles to get the target back. `report` tries a whole folder of materials: it paints
/// targets over every one, solves them, and writes the table of errors with pictures.
#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Solve(Box<SolveArgs>),
    Report(LibraryArgs),
}

/// Runs the command.
///
/// # Errors
/// Whatever is wrong with the input, the flags or the output folder; nothing half-written stays.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    match &args.command {
        Command::Solve(args) => solve::run(args, console).map_err(|e| e.about(&args.target)),
        Command::Report(args) => library::run(args, console).map_err(|e| e.about(&args.folder)),
    }
}

/// What a map holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KindName {
    /// sRGB colour
    Color,
    /// Roughness, gloss, specular, occlusion, metallic, or several of them
    Data,
    /// Tangent-space normals
    Normal,
    /// Aniso texels
    Aniso,
}

impl KindName {
    /// The name in flags and manifests.
    pub(crate) fn name(self) -> &'static str {
        match self {
            KindName::Color => "color",
            KindName::Data => "data",
            KindName::Normal => "normal",
            KindName::Aniso => "aniso",
        }
    }

    /// How a map of a role is solved, where it is one that is.
    pub(crate) fn of_role(role: Role) -> Option<Self> {
        match role {
            Role::Color => Some(KindName::Color),
            Role::Normal => Some(KindName::Normal),
            Role::Roughness | Role::Gloss | Role::Occlusion | Role::Metallic | Role::Specular => {
                Some(KindName::Data)
            }
            role if role.is_packed() => Some(KindName::Data),
            Role::Aniso => Some(KindName::Aniso),
            _ => None,
        }
    }

    /// What a file's name says.
    pub(crate) fn of_file(path: &Path) -> Option<Self> {
        KindName::of_role(named_role(path)?.0)
    }
}

/// Where the kind of a target was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KindSource {
    /// `--kind`.
    Flag,
    /// The target's name.
    Name,
    /// Nothing says it: it is taken for colour.
    Assumed,
}

impl From<KindName> for MapKind {
    fn from(name: KindName) -> Self {
        match name {
            KindName::Color => MapKind::Color,
            KindName::Data => MapKind::Data,
            KindName::Normal => MapKind::Normal,
            KindName::Aniso => MapKind::Aniso,
        }
    }
}

/// Formats of synthesized maps and tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs, reason = "the names are the formats'")]
pub enum BlockFormat {
    Bc1,
    Bc4,
    Bc5,
    Bc7,
    Rgba8,
}

impl BlockFormat {
    /// The format with the encoder that serves it best in a second a megapixel: ISPC for BC7 where it is built in, else
    /// the portable one.
    pub(crate) fn encoding(self) -> Encoding {
        let (format, encoder, preset) = match self {
            BlockFormat::Bc1 => (Format::Bc1, Encoder::Portable, Preset::Normal),
            BlockFormat::Bc4 => (Format::Bc4, Encoder::Portable, Preset::Fast),
            BlockFormat::Bc5 => (Format::Bc5, Encoder::Portable, Preset::Fast),
            BlockFormat::Bc7 => return kinran_image::Role::Color.encoding(),
            BlockFormat::Rgba8 => (Format::Rgba8, Encoder::Portable, Preset::Fast),
        };
        Encoding { format, encoder, preset }
    }
}

/// The format of a kind of map where nothing is said: BC7, and BC5 for normals.
pub(crate) fn default_format(kind: MapKind) -> BlockFormat {
    if kind == MapKind::Normal { BlockFormat::Bc5 } else { BlockFormat::Bc7 }
}

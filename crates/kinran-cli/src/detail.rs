//! `kinran detail`: detail maps, solved by inversion.

mod layer_flag;
mod library;
mod page;
mod solve;

use clap::Subcommand;
use kinran::detail::MapKind;
use kinran::options::Format;

use crate::values::Choices;
use crate::{Console, Error};

pub use library::LibraryArgs;
pub use solve::{SolveArgs, solve_target};

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
pub(crate) const KINDS: &Choices<MapKind> = &[
    (MapKind::Color, "color", "sRGB colour"),
    (MapKind::Data, "data", "Roughness, gloss, specular, occlusion, metallic, or several of them"),
    (MapKind::Normal, "normal", "Tangent-space normals"),
    (MapKind::Aniso, "aniso", "Aniso texels"),
];

/// Formats of synthesized maps and tiles.
pub(crate) const BLOCK_FORMATS: &Choices<Format> = &[
    (Format::Bc1, "bc1", ""),
    (Format::Bc4, "bc4", ""),
    (Format::Bc5, "bc5", ""),
    (Format::Bc7, "bc7", ""),
    (Format::Rgba8, "rgba8", ""),
];

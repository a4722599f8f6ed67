//! `kinran inspect`: what is inside a texture, a model, an image or a report.

mod image;
mod model;
mod report;
mod statistics;
mod texture;

use std::path::{Path, PathBuf};

use kinran::content::Content;
use kinran::{Disk, Finding};
use kinran_image::{IMAGE_EXTENSIONS, has_image_extension};
use schemars::JsonSchema;
use serde::Serialize;

use crate::model::ModelArgs;
use crate::view::file_name;
use crate::{Console, Error, outputs};

/// Tells what is in a texture, a model, an image or a report
///
/// .ktx2 and .dds: format, transfer function, size, key/values, and statistics of every level that suit
/// what the map holds. .glb, .gltf and .obj: geometry, materials, what `kinran bake` would do with them,
/// extensions, warnings. .png, .jpg, .tga, .bmp, .webp, .tif, .hdr and .exr: size, channels, ranges, and whether what
/// looks like a normal map is one. .json: what a report of `kinran` says, and whether the files that it names are as
/// they were written.
///
/// With --check, whether a baked texture, a model with baked textures or a report keeps the rules for what `kinran` writes:
/// levels, formats, keys, extensions, references; a line for each rule that is broken, and exit code 2.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran inspect brushed_aniso.ktx2
  kinran inspect brushed_normal.dds --role normal
  kinran inspect lamp.glb --json
  kinran inspect baked/lamp.kinran.json
  kinran inspect --check baked/lamp.glb")]
pub struct Args {
    /// The file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// What a texture holds; by default what its key KinranMap says, or else what its format suggests:
    /// BC5 normals, sRGB colour, anything else data
    #[arg(long, value_name = "MAP", value_parser = crate::values::content())]
    pub role: Option<Content>,

    /// Of an EXR file, the layer to look at
    #[arg(long, value_name = "LAYER")]
    pub exr_layer: Option<String>,

    /// Only tells what breaks the rules for files that kinran writes
    #[arg(long, conflicts_with_all = ["role", "exr_layer", "allow_outside"])]
    pub check: bool,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub model: ModelArgs,
}

/// What is in a file; `kind` says which of these.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum Report {
    Texture(texture::Report),
    Model(model::Report),
    Image(image::Report),
    Written(report::Report),
    Check(CheckReport),
}

/// What breaks the rules.
#[derive(Serialize, JsonSchema)]
pub(crate) struct CheckReport {
    file: String,
    kind: &'static str,
    /// Nothing where all is well.
    findings: Vec<Finding>,
}

fn check(path: &Path, console: &Console) -> Result<(), Error> {
    let findings = kinran::check(&Disk, path)?;
    let text = match findings.as_slice() {
        [] => format!("{}: all is well", file_name(path)),
        findings => findings.iter().map(|f| format!("{}: {}\n", f.place, f.problem)).collect(),
    };
    let count = findings.len();
    console.result(&Report::Check(CheckReport { file: file_name(path), kind: "check", findings }), &text)?;
    if count > 0 { Err(Error::Findings { path: path.to_path_buf(), count }) } else { Ok(()) }
}

/// The command.
///
/// # Errors
/// One that names the file: it cannot be read, it is damaged, it is of another kind.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let _busy = console.progress().busy(format!("looking at {}", file_name(&args.file)));
    if args.check {
        return check(&args.file, console);
    }
    let is = |extensions: &[&str]| extensions.iter().any(|e| outputs::has_extension(&args.file, e));
    if is(&["ktx2", "dds"]) {
        return texture::inspect(&args.file, args.role, console);
    }
    if args.file.is_dir() {
        return Err(Error::file_error(&args.file, "is a folder; name a file in it"));
    }
    if let Some(role) = args.role {
        let reason = "only textures have a role; leave the flag out";
        return Err(Error::flag_error_of(&args.file, format!("--role {}", role.name()), reason));
    }
    if let Some(layer) = args.exr_layer.as_ref().filter(|_| !is(&["exr"])) {
        let reason = "only EXR files have layers; leave the flag out";
        return Err(Error::flag_error_of(&args.file, format!("--exr-layer {layer}"), reason));
    }
    if kinran_scene::is_gltf(&args.file) || is(&["obj"]) {
        model::inspect(&args.file, &args.model, console)
    } else if has_image_extension(&args.file) {
        image::inspect(&args.file, args.exr_layer.as_deref(), console)
    } else if is(&["json"]) {
        report::inspect(&args.file, console)
    } else {
        let reason = format!(
            "this kind of file is not known; give a .glb, .gltf, .obj, a report of kinran (.json), a texture or an image \
             (.{})",
            IMAGE_EXTENSIONS.join(", .")
        );
        Err(Error::file_error(&args.file, reason))
    }
}

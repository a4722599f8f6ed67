//! `kinran inspect`: what is inside a texture, a model, an image or a report.

mod words;

use std::path::{Path, PathBuf};

use kinran::content::Content;
use kinran::inspect::{InspectOptions, Inspected, inspect};
use kinran::{Checked, Disk, Finding};
use schemars::JsonSchema;
use serde::Serialize;

use crate::model::ModelArgs;
use crate::progress::Bars;
use crate::view::file_name;
use crate::{Console, Error};

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

/// What is in a file, or whether it is sound; `kind` says which.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
pub(crate) enum Report {
    Inside(Inspected),
    Check(CheckReport),
}

/// What breaks the rules.
#[derive(Serialize, JsonSchema)]
pub(crate) struct CheckReport {
    file: String,
    kind: &'static str,
    /// How many of the things that have rules are in it; a model that was never baked has none.
    looked_at: usize,
    /// Nothing where all is well.
    findings: Vec<Finding>,
}

fn check(path: &Path, console: &Console) -> Result<(), Error> {
    let Checked { looked_at, findings } = kinran::check(&Disk, path)?;
    let text = match findings.as_slice() {
        [] if looked_at == 0 => {
            format!(
                "{}: holds nothing that `kinran bake` writes, so that no rule was looked at",
                file_name(path)
            )
        }
        [] => format!("{}: all is well", file_name(path)),
        findings => findings.iter().map(|f| format!("{}: {}\n", f.place, f.problem)).collect(),
    };
    let count = findings.len();
    let report = CheckReport { file: file_name(path), kind: "check", looked_at, findings };
    console.result(&Report::Check(report), &text)?;
    if count > 0 { Err(Error::Findings { path: path.to_path_buf(), count }) } else { Ok(()) }
}

/// What to say of a folder: which file in it, or which command, tells what was asked for.
fn in_folder(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(|path| path.is_file()).collect();
    files.sort();
    let ends = |file: &&PathBuf, end: &str| file.to_string_lossy().to_ascii_lowercase().ends_with(end);
    let is_model = |file: &&PathBuf| kinran_scene::is_gltf(file) || ends(file, ".obj");
    let known = (files.iter().find(|file| ends(file, ".kinran.json")))
        .or_else(|| files.iter().find(is_model))
        .or_else(|| files.iter().find(|file| ends(file, ".ktx2") || ends(file, ".dds")));
    match known {
        Some(file) => format!("is a folder; name a file in it, such as `kinran inspect {}`", file.display()),
        None if files.iter().any(|file| kinran_image::has_image_extension(file)) => {
            let bake = format!("`kinran bake {} --dry-run`", folder.display());
            format!("is a folder; {bake} tells what its maps are taken for, or name one image")
        }
        None => {
            "is a folder without anything to look at; name a texture, a model, an image or a report".into()
        }
    }
}

/// The command.
///
/// # Errors
/// One that names the file: it cannot be read, it is damaged, it is of another kind.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    if args.file.is_dir() {
        return Err(Error::file_error(&args.file, in_folder(&args.file)));
    }
    let _busy = console.progress().busy(format!("looking at {}", file_name(&args.file)));
    if args.check {
        return check(&args.file, console);
    }
    let mut how = InspectOptions::default();
    (how.role, how.exr_layer) = (args.role, args.exr_layer.clone());
    how.allow_outside = args.model.allowed()?.to_vec();
    let bars = Bars::new(console.progress());
    let inspected = inspect(&Disk, &args.file, &how, bars.task())?;
    let text = match &inspected {
        Inspected::Texture(report) => words::texture(report),
        Inspected::Model(report) => words::model(report),
        Inspected::Image(report) => words::image(report),
        Inspected::Written(report) => words::written(report),
        other => format!("{other:?}"),
    };
    console.result(&Report::Inside(inspected), &text)
}

//! The sidecar: how textures were made and what was lost.

use std::path::{Path, PathBuf};

use kinran_bake::aniso::LevelError;
use kinran_bake::folder::Row;
use kinran_image::{Format, Texture, Transfer, write_atomically};
use schemars::JsonSchema;
use serde::Serialize;

use crate::Error;
use crate::content::Content;
use crate::outputs::{WrittenFile, kept_files, kept_remark, way};
use crate::values::counted;

/// A file that went in.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Input {
    /// Its name.
    pub file: String,
    /// What it holds.
    pub role: String,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// BLAKE3 of the file's bytes.
    pub blake3: String,
    /// What was chosen when it was read: the layer, how colour is encoded.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

/// A file that came out.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Output {
    /// Its name, beside the report.
    pub file: String,
    /// What it holds.
    pub map: Content,
    /// Its texel format.
    pub format: String,
    /// `linear` or `srgb`.
    pub transfer: &'static str,
    /// Texels in a row of level 0.
    pub width: u32,
    /// Rows of level 0.
    pub height: u32,
    /// Mip levels.
    pub levels: usize,
    /// Size of the file.
    pub bytes: usize,
    /// BLAKE3 of the file's bytes.
    pub blake3: String,
}

/// What reports and flags call a texel format.
pub(crate) fn format_name(format: Format) -> &'static str {
    match format {
        Format::Bc1 => "bc1",
        Format::Bc4 => "bc4",
        Format::Bc5 => "bc5",
        Format::Bc7 => "bc7",
        Format::Rgba8 => "rgba8",
        Format::Rgba16F => "rgba16f",
    }
}

impl Output {
    pub(super) fn new(file: String, map: Content, texture: &Texture, bytes: &[u8]) -> Self {
        Output {
            file,
            map,
            format: format_name(texture.format).into(),
            transfer: if texture.transfer == Transfer::Srgb { "srgb" } else { "linear" },
            width: texture.levels[0].width,
            height: texture.levels[0].height,
            levels: texture.levels.len(),
            bytes: bytes.len(),
            blake3: blake3::hash(bytes).to_hex().to_string(),
        }
    }
}

/// One surface's textures.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SurfaceReport {
    /// The material, or the first one that uses the surface.
    pub name: String,
    /// What went in.
    pub inputs: Vec<Input>,
    /// What came out.
    pub outputs: Vec<Output>,
    /// Errors of normals and lobe, level by level; empty where the material has neither.
    pub levels: Vec<LevelError>,
}

impl SurfaceReport {
    /// A surface of which nothing is known yet.
    pub(super) fn new(name: String) -> Self {
        SurfaceReport { name, inputs: Vec::new(), outputs: Vec::new(), levels: Vec::new() }
    }
}

/// What one run baked.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Report {
    /// Kinran's version.
    pub kinran: &'static str,
    /// The folder or model that was baked, from the report's folder, `/`-separated; none in a library.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The filter's name.
    pub filter: &'static str,
    /// The footprint's shape.
    pub kernel: String,
    /// The surfaces.
    pub surfaces: Vec<SurfaceReport>,
    /// Curvature of meshes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub curvature: Vec<super::CurvatureReport>,
    /// What was left out or assumed, a sentence each.
    pub warnings: Vec<String>,
    /// Every file that was written beside this report: a later run writes these again, and no others, without a question.
    pub written: Vec<WrittenFile>,
    /// What earlier runs wrote beside this report, under other flags, and is there as they left it; nothing refers to it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<WrittenFile>,
}

impl Report {
    pub(super) fn new(args: &super::Args) -> Self {
        Report {
            kinran: env!("CARGO_PKG_VERSION"),
            source: None,
            filter: args.filter.name(),
            kernel: format!("{:?}", args.kernel).to_lowercase(),
            surfaces: Vec::new(),
            curvature: Vec::new(),
            warnings: Vec::new(),
            written: Vec::new(),
            kept: Vec::new(),
        }
    }

    /// Writes the report as `file`; `others` are the files that were written besides the textures.
    pub(super) fn write(
        &mut self,
        args: &super::Args,
        file: &str,
        others: Vec<WrittenFile>,
    ) -> Result<(), Error> {
        self.source = way(args.output(), &args.input).filter(|_| !args.is_copy);
        let textures = self.surfaces.iter().flat_map(|s| &s.outputs);
        let textures =
            textures.map(|o| WrittenFile { file: o.file.clone(), bytes: o.bytes, blake3: o.blake3.clone() });
        self.written = textures.chain(others).collect();
        self.kept = kept_files(args.output(), file, &self.written);
        let mut text = serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))?;
        text.push('\n');
        Ok(write_atomically(&args.output().join(file), text.as_bytes())?)
    }

    /// A few lines for people: each file with its format and size, and the filter's error.
    pub(super) fn text(&self, folder: &Path) -> String {
        let mut text = String::new();
        let files = || self.surfaces.iter().flat_map(|s| &s.outputs);
        let width = files().map(|o| o.file.chars().count()).max().unwrap_or(0);
        for o in files() {
            text += &format!(
                "{:width$}  {:7} {:6} {:>11}  {:2} levels  {:>9.1} KiB\n",
                o.file,
                o.format,
                o.transfer,
                format!("{}x{}", o.width, o.height),
                o.levels,
                o.bytes as f64 / 1024.0,
            );
        }
        text.extend(self.curvature.iter().map(super::CurvatureReport::text));
        let bytes: u64 = self.written.iter().map(|file| file.bytes as u64).sum();
        let files = counted(self.written.len(), "file", "files");
        text += &format!("{files}, {:.1} KiB, in {}\n", bytes as f64 / 1024.0, folder.display());
        text + &kept_remark(&self.kept)
    }
}

/// What `kinran bake` made of a folder or a model, or with `--dry-run` would make.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct BakeReport {
    /// Kinran's version.
    pub(super) kinran: &'static str,
    /// Where the files are.
    pub(super) output: PathBuf,
    /// Nothing was baked: surfaces have neither outputs nor levels.
    pub(super) dry_run: bool,
    /// The filter's name.
    pub(super) filter: &'static str,
    /// The footprint's shape.
    pub(super) kernel: String,
    /// Of a folder: every file, and what was understood of it; "-" where something is assumed.
    pub(super) files: Vec<Row>,
    /// The surfaces.
    pub(super) surfaces: Vec<SurfaceReport>,
    /// Curvature of meshes.
    pub(super) curvature: Vec<super::CurvatureReport>,
    /// Files of earlier runs, under other flags, that stay beside these; nothing refers to them.
    pub(super) kept: Vec<WrittenFile>,
    /// What was left out or assumed, a sentence each.
    pub(super) warnings: Vec<String>,
}

impl BakeReport {
    pub(super) fn new(args: &super::Args, files: Vec<Row>, reports: Vec<Report>) -> Self {
        let Report { kinran, filter, kernel, .. } = Report::new(args);
        let output = args.output().to_path_buf();
        let (surfaces, curvature) = (Vec::new(), Vec::new());
        let (kept, warnings) = (Vec::new(), Vec::new());
        let dry_run = args.dry_run;
        let mut all = BakeReport {
            kinran,
            output,
            dry_run,
            filter,
            kernel,
            files,
            surfaces,
            curvature,
            kept,
            warnings,
        };
        for report in reports {
            all.surfaces.extend(report.surfaces);
            all.curvature.extend(report.curvature);
            all.kept.extend(report.kept);
            all.warnings.extend(report.warnings);
        }
        all
    }
}

/// Hash of a file as hexadecimal digits.
pub(super) fn hash_file(path: &Path) -> Result<String, Error> {
    let mut hasher = blake3::Hasher::new();
    let mut file = std::fs::File::open(path).map_err(|e| kinran_image::Error::io(path, e))?;
    hasher.update_reader(&mut file).map_err(|e| kinran_image::Error::io(path, e))?;
    Ok(hasher.finalize().to_hex().to_string())
}

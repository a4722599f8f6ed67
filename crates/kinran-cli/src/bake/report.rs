//! What a bake tells people and programs.

use std::path::{Path, PathBuf};

use kinran::report::{MeshCurvature, Report, SurfaceReport, WrittenFile};
use kinran_bake::folder::Row;
use schemars::JsonSchema;
use serde::Serialize;

use super::curvature;
use crate::outputs::kept_remark;
use crate::values::counted;

/// A few lines for people: each file with its format and size, and the filter's error.
pub(super) fn text(report: &Report, folder: &Path) -> String {
    let mut text = String::new();
    let files = || report.surfaces.iter().flat_map(|s| &s.outputs);
    let width = files().map(|o| o.file.chars().count()).max().unwrap_or(0);
    for o in files() {
        text += &format!(
            "{:width$}  {:7} {:6} {:>11}  {:>9}  {:>9.1} KiB\n",
            o.file,
            o.format,
            o.transfer,
            format!("{}x{}", o.width, o.height),
            counted(o.levels, "level", "levels"),
            o.bytes as f64 / 1024.0,
        );
    }
    text.extend(report.curvature.iter().map(curvature::text));
    let others: Vec<&str> = (report.written.iter().map(|file| file.file.as_str()))
        .filter(|file| files().all(|output| output.file != *file))
        .collect();
    text += &beside(&others);
    let bytes: u64 = report.written.iter().map(|file| file.bytes as u64).sum();
    let files = counted(report.written.len(), "file", "files");
    text += &format!("{files}, {:.1} KiB, in {}\n", bytes as f64 / 1024.0, folder.display());
    text + &kept_remark(&report.kept)
}

/// Files that a line names.
const NAMED: usize = 6;

/// A line on files without mips: what other viewers show, the model, the report.
fn beside(files: &[&str]) -> String {
    let named = files[..files.len().min(NAMED)].join(", ");
    match files.len() {
        0 => String::new(),
        count if count > NAMED => format!("and {named} and {} more\n", count - NAMED),
        _ => format!("and {named}\n"),
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
    pub(super) curvature: Vec<MeshCurvature>,
    /// Files of earlier runs, under other flags, that stay beside these; nothing refers to them.
    pub(super) kept: Vec<WrittenFile>,
    /// What was left out or assumed, a sentence each.
    pub(super) warnings: Vec<String>,
}

impl BakeReport {
    pub(super) fn new(args: &super::Args, files: Vec<Row>, reports: Vec<Report>) -> Self {
        let Report { kinran, filter, kernel, .. } = Report::new(&args.textures());
        let mut all = BakeReport {
            kinran,
            output: args.output().to_path_buf(),
            dry_run: args.dry_run,
            filter,
            kernel,
            files,
            surfaces: Vec::new(),
            curvature: Vec::new(),
            kept: Vec::new(),
            warnings: Vec::new(),
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

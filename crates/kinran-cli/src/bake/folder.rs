//! `kinran bake` of a folder of authored maps.

use kinran::options::AlphaCoverage;
use kinran::report::{Report, SurfaceReport};
use kinran::{Disk, Sink, bake};
use kinran_bake::folder::{CUT_OUT, Folder, Role as MapRole, Row};

use super::Args;
use super::report::{BakeReport, text};
use crate::outputs::{Output, file_name};
use crate::progress::Bars;
use crate::{Console, Error};

/// Bakes a folder and tells what came of it.
pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut folder = understand(args)?;
    let mut reports = bake_folder(args, &folder, console)?;
    for surface in reports.iter().flat_map(|report| &report.surfaces) {
        for input in &surface.inputs {
            add_remarks(&mut folder.rows, &surface.name, &input.file, &input.notes);
        }
    }
    let idle = idle(args, &folder.rows);
    if let Some(first) = reports.first_mut() {
        first.warnings.extend(idle);
    }
    reports.iter().flat_map(|report| &report.warnings).for_each(|warning| console.warn(warning));
    let files: String = reports.iter().map(|report| text(report, args.output())).collect();
    let text = format!("{}\n{files}", folder.table());
    console.result(&BakeReport::new(args, folder.rows, reports), &text)
}

/// What there is to bake in a folder.
fn understand(args: &Args) -> Result<Folder, Error> {
    Ok(bake::understand(&Disk, &args.input, &args.folder_options())?)
}

/// Bakes every material found in a folder.
fn bake_folder(args: &Args, folder: &Folder, console: &Console) -> Result<Vec<Report>, Error> {
    let (how, bars) = (args.folder_options(), Bars::new(console.progress()));
    let out = Output::new(args.output(), &args.input, args.force, console);
    Ok(bake::folder(&Disk, &args.input, folder, &how, &out, bars.task())?)
}

/// A sentence for each flag that had nothing to act on.
fn idle(args: &Args, rows: &[Row]) -> Vec<String> {
    use MapRole::{Color, Direction, DirectionAngle, Normal, Roughness};
    let is_used = |row: &&Row| row.channels != "-";
    let has = |roles: &[MapRole]| {
        rows.iter().filter(is_used).any(|row| row.role.is_some_and(|role| roles.contains(&role)))
    };
    let has_packed = rows.iter().filter(is_used).any(|row| row.role.is_some_and(MapRole::is_packed));
    let has_note = |words: &str| rows.iter().any(|row| row.note.contains(words));
    let missing = |what: &str| format!("there is no {what} map");
    let flags = [
        ("y-up", args.y_up && !has(&[Normal]), missing("normal")),
        ("y-down", args.y_down && !has(&[Normal]), missing("normal")),
        ("normal-blue", args.normal_blue && !has(&[Normal]), missing("normal")),
        ("force-normal", args.force_normal && !has(&[Normal]), missing("normal")),
        (
            "force-normal",
            args.force_normal && has(&[Normal]) && !has_note("by --force-normal"),
            "every normal map looks like one".into(),
        ),
        (
            "direction-span",
            args.direction_span.is_some() && !has(&[Direction, DirectionAngle]),
            missing("direction"),
        ),
        (
            "roughness",
            args.roughness.is_some() && !has_note("by --roughness"),
            "maps give the roughness; leave these out with --ignore FILE".into(),
        ),
        (
            "roughness-is-gloss",
            args.roughness_is_gloss && !has_packed && !has(&[Roughness]),
            missing("roughness"),
        ),
        ("color-space", args.color_space.is_some() && !has(&[Color]), missing("colour")),
        ("color-format", args.color_format.is_some() && !has(&[Color]), missing("colour")),
        ("alpha-coverage", args.alpha_coverage != AlphaCoverage::Masked && !has(&[Color]), missing("colour")),
        (
            "alpha-coverage",
            args.alpha_coverage != AlphaCoverage::Masked && has(&[Color]) && !has_note(CUT_OUT),
            "every colour map is opaque".into(),
        ),
    ];
    let given = flags.into_iter().filter(|(_, is_idle, _)| *is_idle);
    given.map(|(flag, _, why)| format!("--{flag} has nothing to act on: {why}")).collect()
}

/// Adds what was chosen when a file was read to its row.
fn add_remarks(rows: &mut [Row], material: &str, file: &str, remarks: &[String]) {
    let is_it = |row: &&mut Row| row.material == material && row.file.rsplit('/').next() == Some(file);
    if let Some(row) = rows.iter_mut().find(is_it) {
        let notes = std::iter::once(row.note.as_str()).chain(remarks.iter().map(String::as_str));
        row.note = notes.filter(|note| !note.is_empty()).collect::<Vec<_>>().join("; ");
    }
}

/// Tells what a bake would make of a folder: its maps are read and judged, nothing is filtered or written.
pub(super) fn dry_run(args: &Args, console: &Console) -> Result<(), Error> {
    let mut folder = understand(args)?;
    let mut report = Report::new(&args.textures());
    let stage = console.progress().stage("reading", folder.materials.len() as u64);
    for material in &folder.materials {
        let loaded = material.load()?;
        for map in &loaded.images {
            add_remarks(&mut folder.rows, &loaded.name, &file_name(&map.path), &map.remarks);
        }
        report.surfaces.push(SurfaceReport::new(loaded.name));
        report.warnings.extend(loaded.notes);
        stage.add(1);
    }
    drop(stage);
    let (names, space) = bake::folder_plan(&Disk, &args.input, &folder, &args.folder_options())?;
    Output::new(args.output(), &args.input, args.force, console).expect(&names, space)?;
    report.warnings.extend(idle(args, &folder.rows));
    report.warnings.iter().for_each(|warning| console.warn(warning));
    console.result(&BakeReport::new(args, folder.rows.clone(), vec![report]), &folder.table())
}

//! The layout of comparison pictures.

use crate::budget::Budget;
use crate::compare::{Comparison, Difference, Finding, MethodReport, Noise, Ranking, Series, footnote};
use crate::picture::{Color, INK, PAPER, Picture, text_width, wrapped};
use crate::values::counted;

/// All colours and lengths are chosen by eye.
const FAINT: Color = [170, 172, 180];
const BEST: Color = [126, 211, 138];

/// Pixels between pictures, around them, and from a picture to the words under it.
const GAP: u32 = 16;

/// The narrowest column that holds the words under a picture.
const COLUMN: u32 = 300;

/// Heights of letters, and other lengths that grow with them: a sheet of larger pictures has larger words, so that both can be
/// seen when it is scaled down.
struct Scale(f32);

impl Scale {
    fn of(width: u32) -> Self {
        Scale(width.max(COLUMN) as f32 / COLUMN as f32)
    }

    fn title(&self) -> f32 {
        30.0 * self.0
    }

    fn name(&self) -> f32 {
        24.0 * self.0
    }

    fn note(&self) -> f32 {
        18.0 * self.0
    }

    /// So many pixels of a sheet of the smallest columns.
    fn length(&self, pixels: u32) -> u32 {
        (pixels as f32 * self.0) as u32
    }
}

/// So many times as large as fills a column best, each pixel a square.
fn enlarged(width: u32, height: u32) -> (u32, u32) {
    let times = ((COLUMN + width / 2) / width).max(1);
    (times * width, times * height)
}

/// What a method is, in a few words.
fn description(name: &str) -> &'static str {
    match name {
        "truth" => "ground truth",
        "ml" => "most likely GGX",
        "dpd" => "GGX of least divergence",
        "linear" => "mean of SGGX matrices",
        "param" => "SGGX parameters",
        "lean" => "LEAN mapping",
        apart if apart.ends_with("-apart") => "the same, maps one by one",
        separate if separate.ends_with("-separate") => "the same, specular colour too",
        _ => "maps averaged as colours",
    }
}

/// Ground truth and the filters side by side, their numbers, below the maps of the FLIP error, and what all of it shows.
pub(crate) fn comparison_sheet(comparison: &Comparison) -> Picture {
    let report = &comparison.report;
    let finding = &report.findings[0];
    let first = &comparison.series[0].pictures[0];
    let (width, height) = enlarged(first.width, first.height);
    let scale = Scale::of(width);
    let column = width.max(COLUMN) + GAP;
    let count = comparison.series.len() as u32;
    let sheet_width = GAP + count * column;
    let budgets = report.methods.iter().filter_map(|method| method.budget.first());
    let words = Words::new(&scale, sheet_width, &report.findings[..1], budgets);
    let top = scale.length(118);
    let captions = top + height;
    let maps = captions + scale.length(70);
    let end = maps + height.max(scale.length(130));
    let mut sheet = Picture::new(sheet_width, end + words.height(&scale), PAPER);

    let title_end = sheet.text((GAP, scale.length(40)), scale.title(), INK, &report.title);
    let samples = format!(
        "{}, ground truth {}",
        counted(finding.samples_per_pixel as usize, "sample", "samples"),
        finding.truth_samples_per_pixel
    );
    sheet.text((title_end + 2 * GAP, scale.length(40)), scale.note(), FAINT, &samples);

    let range = error_range(&comparison.series[1..]);
    for (i, series) in comparison.series.iter().enumerate() {
        let x = GAP + i as u32 * column;
        sheet.text((x, top - scale.length(38)), scale.name(), INK, series.name);
        sheet.text((x, top - scale.length(12)), scale.note(), FAINT, description(series.name));
        sheet.draw(x, top, &series.pictures[0].scaled(width, height));
        let numbers_at = (x, captions + scale.length(26));
        match i.checked_sub(1) {
            None => {
                noise(&mut sheet, &scale, numbers_at, finding);
                legend(&mut sheet, &scale, (x, maps), width.max(COLUMN), range);
            }
            Some(method) => {
                numbers(&mut sheet, &scale, numbers_at, &report.methods[method], 0, finding);
                let map = error_map(series, (first.width, first.height), range);
                sheet.draw(x, maps, &map.scaled(width, height));
            }
        }
    }
    words.draw(&mut sheet, &scale, end);
    sheet
}

/// A row for each method, a column for each distance, and what each distance shows.
pub(crate) fn distance_sheet(comparison: &Comparison) -> Picture {
    let report = &comparison.report;
    let nearest = comparison.series[0].pictures.iter().max_by_key(|p| p.width).expect("there is a distance");
    let (width, height) = enlarged(nearest.width, nearest.height);
    let scale = Scale::of(width);
    let (column, row) = (width.max(COLUMN) + GAP, height + scale.length(66));
    let names = comparison.series.iter().map(|series| text_width(scale.name(), series.name));
    let (top, margin) = (scale.length(100), names.max().unwrap_or(0) + 2 * GAP);
    let distances = &report.methods[0].distances;
    let rows = comparison.series.len() as u32;
    let sheet_width = margin + distances.len() as u32 * column;
    let words = Words::new(&scale, sheet_width, &report.findings, &report.methods[0].budget);
    let mut sheet = Picture::new(sheet_width, top + rows * row + words.height(&scale), PAPER);

    sheet.text((GAP, scale.length(40)), scale.title(), INK, &report.title);
    for (j, difference) in distances.iter().enumerate() {
        let Difference { distance, width, height, .. } = difference;
        let heading = format!("distance {distance}");
        let x = margin + j as u32 * column;
        let end = sheet.text((x, top - scale.length(14)), scale.name(), INK, &heading);
        let pixels = format!("{width}x{height}");
        sheet.text((end + GAP, top - scale.length(14)), scale.note(), FAINT, &pixels);
    }
    for (i, series) in comparison.series.iter().enumerate() {
        let y = top + i as u32 * row;
        sheet.text((GAP, y + scale.length(24)), scale.name(), INK, series.name);
        for (j, picture) in series.pictures.iter().enumerate() {
            let x = margin + j as u32 * column;
            sheet.draw(x, y, &picture.scaled(width, height));
            let at = (x, y + height + scale.length(24));
            match i.checked_sub(1) {
                None => noise(&mut sheet, &scale, at, &report.findings[j]),
                Some(method) => {
                    numbers(&mut sheet, &scale, at, &report.methods[method], j, &report.findings[j]);
                }
            }
        }
    }
    words.draw(&mut sheet, &scale, top + rows * row);
    sheet
}

/// The lines under a sheet: what its numbers show.
struct Words(Vec<String>);

impl Words {
    fn new<'a>(
        scale: &Scale,
        sheet_width: u32,
        findings: &[Finding],
        budgets: impl IntoIterator<Item = &'a Budget>,
    ) -> Self {
        let says = findings.iter().map(|finding| finding.says.as_str());
        let made_of = budgets.into_iter().map(|budget| budget.says.as_str());
        let texts = says.chain(made_of).chain([footnote(findings)]);
        Words(texts.flat_map(|text| wrapped(scale.note(), sheet_width - 2 * GAP, text)).collect())
    }

    fn line(scale: &Scale) -> u32 {
        scale.length(26)
    }

    fn height(&self, scale: &Scale) -> u32 {
        2 * GAP + self.0.len() as u32 * Self::line(scale)
    }

    fn draw(&self, sheet: &mut Picture, scale: &Scale, top: u32) {
        for (i, text) in (1..).zip(&self.0) {
            sheet.text((GAP, top + GAP / 2 + i * Self::line(scale)), scale.note(), INK, text);
        }
    }
}

/// The numbers of one method at one distance, green where it is known to be the nearest.
fn numbers(
    sheet: &mut Picture,
    scale: &Scale,
    at: (u32, u32),
    method: &MethodReport,
    distance: usize,
    finding: &Finding,
) {
    let this = &method.distances[distance];
    let color = |ranking: &Ranking| if ranking.best == Some(method.filter) { BEST } else { INK };
    let rmse = format!("RMSE {:.4}", this.rmse);
    let end = sheet.text(at, scale.note(), color(&finding.rmse), &rmse);
    sheet.text((end + GAP, at.1), scale.note(), color(&finding.flip), &format!("FLIP {:.4}", this.flip));
    let below = (at.0, at.1 + scale.length(26));
    sheet.text(below, scale.note(), color(&finding.l2), &format!("L2   {:.4}", this.l2));
}

/// What noise alone comes to.
fn noise(sheet: &mut Picture, scale: &Scale, at: (u32, u32), finding: &Finding) {
    let Noise { rmse, l2, flip } = finding.noise;
    sheet.text(at, scale.note(), FAINT, &format!("noise: RMSE {rmse:.4} FLIP {flip:.4}"));
    let below = (at.0, at.1 + scale.length(26));
    sheet.text(below, scale.note(), FAINT, &format!("L2 {l2:.4}"));
}

/// The FLIP error at which all maps of a sheet are brightest: the roundest one that 99 of 100 pixels of all maps stay below.
fn error_range(methods: &[Series]) -> f32 {
    let mut errors: Vec<f32> = methods.iter().flat_map(|series| series.errors[0].iter().copied()).collect();
    errors.sort_by(f32::total_cmp);
    let most = errors.get(errors.len() * 99 / 100).copied().unwrap_or(1.0);
    [0.01, 0.02, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.7]
        .into_iter()
        .find(|range| most <= *range)
        .unwrap_or(1.0)
}

/// What the colours of the maps mean.
fn legend(sheet: &mut Picture, scale: &Scale, (x, y): (u32, u32), width: u32, range: f32) {
    let bar = Picture { width: 256, height: 1, pixels: magma() }.scaled(width, scale.length(16));
    sheet.text((x, y + scale.length(20)), scale.name(), INK, "FLIP error");
    sheet.draw(x, y + scale.length(34), &bar);
    let below = y + scale.length(70);
    sheet.text((x, below), scale.note(), FAINT, "0");
    let last = if range < 1.0 { format!("{range} or more") } else { "1".into() };
    let length = text_width(scale.note(), &last);
    sheet.text((x + width.saturating_sub(length), below), scale.note(), FAINT, &last);
    for (i, line) in (1..).zip(["0 looks the same, 1 is as", "far apart as can be"]) {
        sheet.text((x, below + i * scale.length(24)), scale.note(), FAINT, line);
    }
}

fn error_map(series: &Series, (width, height): (u32, u32), range: f32) -> Picture {
    let colors = magma();
    let color = |error: f32| colors[((error / range).clamp(0.0, 1.0) * 255.0 + 0.5) as usize];
    Picture { width, height, pixels: series.errors[0].iter().map(|e| color(*e)).collect() }
}

/// The 256 colours in which FLIP's authors show errors.
fn magma() -> Vec<Color> {
    nv_flip::magma_lut().to_vec().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect()
}

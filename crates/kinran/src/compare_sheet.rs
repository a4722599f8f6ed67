//! The layout of comparison pictures.

use crate::compare::{Comparison, Difference, Series};
use crate::picture::{Color, INK, PAPER, Picture};

/// All colours and lengths are chosen by eye.
const FAINT: Color = [150, 153, 162];
const BEST: Color = [126, 211, 138];

/// Pixels between pictures, around them, and from a picture to the words under it.
const GAP: u32 = 16;

/// Heights of text in pixels.
const TITLE: f32 = 26.0;
const NAME: f32 = 20.0;
const NOTE: f32 = 15.0;

/// The narrowest column that holds the words under a picture.
const COLUMN: u32 = 300;

/// Width of the rows' names in the distance sheet.
const MARGIN: u32 = 130;

/// What a method is, in a few words.
fn description(name: &str) -> &'static str {
    match name {
        "truth" => "ground truth, level 0 alone",
        "ml" => "maximum-likelihood GGX",
        "linear" => "average of SGGX matrices",
        "param" => "SGGX parameter estimation",
        "lean" => "LEAN mapping",
        _ => "average, renormalise",
    }
}

/// Ground truth and the filters side by side, their numbers, and below the maps of the FLIP error.
pub(crate) fn comparison_sheet(comparison: &Comparison) -> Picture {
    let report = &comparison.report;
    let (width, height) = (comparison.series[0].pictures[0].width, comparison.series[0].pictures[0].height);
    let column = width.max(COLUMN) + GAP;
    let top = 112;
    let captions = top + height;
    let maps = captions + 62;
    let count = comparison.series.len() as u32;
    let mut sheet = Picture::new(GAP + count * column, maps + height + GAP, PAPER);

    let title_end = sheet.text((GAP, 38), TITLE, INK, &report.title);
    let samples = format!(
        "{} samples a pixel, ground truth {}",
        report.samples_per_pixel, report.truth_samples_per_pixel
    );
    sheet.text((title_end + 2 * GAP, 38), NOTE, FAINT, &samples);

    let differences: Vec<Difference> = report.methods.iter().map(|m| m.distances[0]).collect();
    let range = error_range(&comparison.series[1..]);
    for (i, series) in comparison.series.iter().enumerate() {
        let x = GAP + i as u32 * column;
        sheet.text((x, top - 36), NAME, INK, series.name);
        sheet.text((x, top - 14), NOTE, FAINT, description(series.name));
        sheet.draw(x, top, &series.pictures[0]);
        match i.checked_sub(1) {
            None => legend(&mut sheet, (x, maps), width, range),
            Some(method) => {
                numbers(&mut sheet, (x, captions + 24), &differences, method);
                sheet.draw(x, maps, &error_map(series, (width, height), range));
            }
        }
    }
    sheet
}

/// A row for each method, a column for each distance.
pub(crate) fn distance_sheet(comparison: &Comparison) -> Picture {
    let report = &comparison.report;
    let nearest = comparison.series[0].pictures.iter().max_by_key(|p| p.width).expect("there is a distance");
    let (width, height) = (nearest.width, nearest.height);
    let (column, row) = (width.max(COLUMN) + GAP, height + 40);
    let top = 100;
    let distances = &report.methods[0].distances;
    let rows = comparison.series.len() as u32;
    let mut sheet = Picture::new(MARGIN + distances.len() as u32 * column, top + rows * row, PAPER);

    sheet.text((GAP, 38), TITLE, INK, &report.title);
    for (j, difference) in distances.iter().enumerate() {
        let Difference { distance, width, height, .. } = difference;
        let heading = format!("distance x{distance}");
        let x = MARGIN + j as u32 * column;
        let end = sheet.text((x, top - 14), NAME, INK, &heading);
        sheet.text((end + GAP, top - 14), NOTE, FAINT, &format!("{width}x{height}"));
    }
    for (i, series) in comparison.series.iter().enumerate() {
        let y = top + i as u32 * row;
        sheet.text((GAP, y + 22), NAME, INK, series.name);
        for (j, picture) in series.pictures.iter().enumerate() {
            let x = MARGIN + j as u32 * column;
            sheet.draw(x, y, &picture.scaled(width, height));
            if let Some(method) = i.checked_sub(1) {
                let differences: Vec<Difference> = report.methods.iter().map(|m| m.distances[j]).collect();
                numbers(&mut sheet, (x, y + height + 20), &differences, method);
            }
        }
    }
    sheet
}

/// The numbers of one method, those green that are the best of all methods.
fn numbers(sheet: &mut Picture, at: (u32, u32), all: &[Difference], method: usize) {
    let this = &all[method];
    let color = |best: bool| if best { BEST } else { INK };
    // As printed: what looks equal is equally good.
    let printed = |x: f64| (x * 1e4).round();
    let rmse = all.iter().all(|d| printed(this.rmse) <= printed(d.rmse));
    let flip = all.iter().all(|d| printed(this.flip.into()) <= printed(d.flip.into()));
    let end = sheet.text(at, NOTE, color(rmse), &format!("RMSE {:.4}", this.rmse));
    sheet.text((end + GAP, at.1), NOTE, color(flip), &format!("FLIP {:.4}", this.flip));
}

/// The largest FLIP error that the maps' colours tell apart: the roundest one that all but a few pixels of
/// all maps stay below.
fn error_range(methods: &[Series]) -> f32 {
    let mut errors: Vec<f32> = methods.iter().flat_map(|series| series.errors[0].iter().copied()).collect();
    errors.sort_by(f32::total_cmp);
    let most = errors.get(errors.len() * 998 / 1000).copied().unwrap_or(1.0);
    [0.1, 0.2, 0.5].into_iter().find(|range| most <= *range).unwrap_or(1.0)
}

/// What the colours of the maps mean.
fn legend(sheet: &mut Picture, (x, y): (u32, u32), width: u32, range: f32) {
    let bar = Picture { width: 256, height: 1, pixels: magma() }.scaled(width, 14);
    sheet.text((x, y + 18), NAME, INK, "FLIP error");
    sheet.draw(x, y + 32, &bar);
    sheet.text((x, y + 66), NOTE, FAINT, "0");
    let last = if range < 1.0 { format!("{range} or more") } else { "1".into() };
    let mut measure = Picture::new(0, 0, PAPER);
    let length = measure.text((0, 0), NOTE, FAINT, &last);
    sheet.text((x + width.saturating_sub(length), y + 66), NOTE, FAINT, &last);
    sheet.text((x, y + 98), NOTE, FAINT, "0 looks the same, 1 is as far");
    sheet.text((x, y + 118), NOTE, FAINT, "apart as colours can be");
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

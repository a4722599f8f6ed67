//! Pictures put together from pictures and words.

use std::path::Path;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use glam::{Vec2, vec2};
use kinran_image::{Channels, Image, Pixels, encode_png};

use crate::Error;
use crate::render::write_rgb8;

/// Display-encoded sRGB.
pub type Color = [u8; 3];

/// What words and pictures stand on, and what words are written in; chosen by eye.
pub(crate) const PAPER: Color = [22, 23, 26];
pub(crate) const INK: Color = [234, 234, 236];

/// An 8-bit sRGB picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height` pixels, row by row from the top.
    pub pixels: Vec<Color>,
}

/// A row of pictures of one size under their labels.
pub(crate) struct Row {
    /// What stands over the row, from its left edge on; may be empty.
    pub(crate) name: String,
    /// Labels, which may be empty, and pictures.
    pub(crate) cells: Vec<(String, Picture)>,
}

/// Pixels between pictures; chosen by eye.
const GAP: u32 = 10;

/// Heights of letters: a sheet that is scaled to a page of 1000 pixels has letters of 14 pixels, if labels fit over their
/// pictures; none is lower than 15, for which columns grow.
const LETTERS_IN_A_SHEET: f32 = 70.0;
const LOWEST_LETTER: f32 = 15.0;

/// Rows of pictures on one sheet, all pictures of the same size; a row without any is its name alone.
pub(crate) fn grid(rows: &[Row]) -> Picture {
    let cells = || rows.iter().flat_map(|row| &row.cells);
    let Some((_, first)) = cells().next() else { return Picture::new(0, 0, PAPER) };
    let columns = rows.iter().map(|row| row.cells.len()).max().unwrap_or(0) as u32;
    let longest = |size: f32| cells().map(|(label, _)| text_width(size, label)).max().unwrap_or(0);
    let step = GAP + first.width.max(longest(LOWEST_LETTER));
    let sheet_width = GAP + columns * step;
    // All letters of the font are equally wide.
    let fitting = LOWEST_LETTER * (step - GAP) as f32 / longest(LOWEST_LETTER).max(1) as f32;
    let letter = (sheet_width as f32 / LETTERS_IN_A_SHEET).min(fitting).max(LOWEST_LETTER).floor();
    let line = (1.7 * letter) as u32;

    let lines = |row: &Row| {
        let labelled = row.cells.iter().any(|(label, _)| !label.is_empty());
        (wrapped(letter, sheet_width - 2 * GAP, &row.name), labelled)
    };
    let height_of = |row: &Row| {
        let (name, labelled) = lines(row);
        let pictures = if row.cells.is_empty() { 0 } else { first.height };
        (name.len() as u32 + u32::from(labelled)) * line + pictures + GAP
    };
    let mut sheet = Picture::new(sheet_width, rows.iter().map(height_of).sum(), PAPER);
    let mut top = 0;
    for row in rows {
        let (name, labelled) = lines(row);
        let base = |lines: u32| top + lines * line + (1.25 * letter) as u32;
        for (i, text) in (0..).zip(&name) {
            sheet.text((GAP, base(i)), letter, INK, text);
        }
        let below = name.len() as u32;
        let pictures = top + (below + u32::from(labelled)) * line;
        for (i, (label, picture)) in (0..).zip(&row.cells) {
            sheet.text((GAP + i * step, base(below)), letter, INK, label);
            sheet.draw(GAP + i * step, pictures, picture);
        }
        top += height_of(row);
    }
    sheet
}

/// Columns that a line of text takes.
pub(crate) fn text_width(size: f32, text: &str) -> u32 {
    let font = FONT.as_scaled(PxScale::from(size));
    text.chars().map(|c| font.h_advance(font.glyph_id(c))).sum::<f32>().ceil() as u32
}

/// Text cut between words into lines of at most so many columns; a word that is longer has a line of its own.
pub(crate) fn wrapped(size: f32, columns: u32, text: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if text_width(size, &format!("{line} {word}")) <= columns => {
                *line += &format!(" {word}")
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

static FONT: LazyLock<FontRef> = LazyLock::new(|| {
    FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR).expect("the font that is built in is sound")
});

impl Picture {
    /// One colour.
    pub fn new(width: u32, height: u32, color: Color) -> Self {
        Picture { width, height, pixels: vec![color; width as usize * height as usize] }
    }

    /// Puts `other` with its top left corner at (`x`, `y`); what lies outside is cut off.
    pub fn draw(&mut self, x: u32, y: u32, other: &Picture) {
        let columns = other.width.min(self.width.saturating_sub(x)) as usize;
        let rows = other.pixels.chunks_exact(other.width as usize);
        for (row, pixels) in (y..self.height).zip(rows) {
            let start = row as usize * self.width as usize + x as usize;
            self.pixels[start..start + columns].copy_from_slice(&pixels[..columns]);
        }
    }

    /// A rectangle of it, smaller where it reaches over the edge.
    pub fn part(&self, left: u32, top: u32, width: u32, height: u32) -> Picture {
        let (width, height) =
            (width.min(self.width.saturating_sub(left)), height.min(self.height.saturating_sub(top)));
        let row = |y: u32| {
            let start = (top + y) as usize * self.width as usize + left as usize;
            &self.pixels[start..start + width as usize]
        };
        Picture { width, height, pixels: (0..height).flat_map(|y| row(y).iter().copied()).collect() }
    }

    /// Writes one line of text of height `size` in pixels, its baseline beginning at (`x`, `y`); returns the
    /// column where it ends.
    pub fn text(&mut self, (x, y): (u32, u32), size: f32, color: Color, text: &str) -> u32 {
        let font = FONT.as_scaled(PxScale::from(size));
        let mut pen = x as f32;
        for glyph in text.chars().map(|c| font.glyph_id(c)) {
            let placed = glyph.with_scale_and_position(size, point(pen, y as f32));
            pen += font.h_advance(glyph);
            let Some(outline) = FONT.outline_glyph(placed) else { continue };
            let corner = outline.px_bounds().min;
            outline.draw(|dx, dy, coverage| {
                let (px, py) = (corner.x as i64 + i64::from(dx), corner.y as i64 + i64::from(dy));
                if (0..i64::from(self.width)).contains(&px) && (0..i64::from(self.height)).contains(&py) {
                    let pixel = &mut self.pixels[py as usize * self.width as usize + px as usize];
                    for (channel, ink) in pixel.iter_mut().zip(color) {
                        let (paper, ink) = (f32::from(*channel), f32::from(ink));
                        *channel = (paper + (ink - paper) * coverage.min(1.0) + 0.5) as u8;
                    }
                }
            });
        }
        pen.ceil() as u32
    }

    /// A line of two pixels' width, its ends round; what lies outside is cut off.
    pub fn line(&mut self, a: Vec2, b: Vec2, color: Color) {
        let (low, high) = (a.min(b) - 2.0, a.max(b) + 2.0);
        let columns = (low.x.max(0.0) as u32)..(high.x.max(0.0).min(self.width as f32) as u32);
        for y in (low.y.max(0.0) as u32)..(high.y.max(0.0).min(self.height as f32) as u32) {
            for x in columns.clone() {
                let p = vec2(x as f32 + 0.5, y as f32 + 0.5);
                let along = ((p - a).dot(b - a) / (b - a).length_squared().max(1e-6)).clamp(0.0, 1.0);
                let coverage = (1.5 - p.distance(a + along * (b - a))).clamp(0.0, 1.0);
                let pixel = &mut self.pixels[y as usize * self.width as usize + x as usize];
                for (channel, ink) in pixel.iter_mut().zip(color) {
                    let (paper, ink) = (f32::from(*channel), f32::from(ink));
                    *channel = (paper + (ink - paper) * coverage + 0.5) as u8;
                }
            }
        }
    }

    /// Scaled to `width` by `height` without interpolation, so that each pixel can be seen.
    pub fn scaled(&self, width: u32, height: u32) -> Picture {
        let from = |i: u32, to: u32, len: u32| (u64::from(i) * u64::from(len) / u64::from(to)) as usize;
        let row = |y: u32| from(y, height, self.height) * self.width as usize;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = pixels.map(|(x, y)| self.pixels[row(y) + from(x, width, self.width)]).collect();
        Picture { width, height, pixels }
    }

    /// The bytes of a PNG.
    ///
    /// # Errors
    /// Those of [`kinran_image::encode_png`].
    pub fn encode(&self) -> Result<Vec<u8>, kinran_image::Error> {
        let pixels = Pixels::U8(self.pixels.as_flattened().to_vec());
        encode_png(&Image::new(self.width, self.height, Channels::Rgb, pixels)?)
    }

    /// Writes a PNG, whole or not at all.
    ///
    /// # Errors
    /// Those of [`kinran_image::write_png`].
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        write_rgb8(path, self.width, self.height, self.pixels.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drawing_over_the_edge_is_cut_off() {
        let mut paper = Picture::new(4, 3, [0; 3]);
        paper.draw(2, 2, &Picture::new(5, 5, [9; 3]));
        paper.draw(7, 7, &Picture::new(5, 5, [9; 3]));
        let lit: Vec<usize> = (0..12).filter(|&i| paper.pixels[i] == [9; 3]).collect();
        assert_eq!(lit, [10, 11]);
        paper.text((1, 200), 20.0, [255; 3], "below");
        paper.text((300, 2), 20.0, [255; 3], "right");
    }

    #[test]
    fn a_line_covers_what_lies_within_its_width() {
        let mut paper = Picture::new(20, 10, [0; 3]);
        paper.line(vec2(3.0, 5.0), vec2(15.0, 5.0), [200; 3]);
        let inked = |x: usize, y: usize| paper.pixels[y * 20 + x][0];
        assert_eq!((inked(9, 4), inked(9, 5)), (200, 200));
        assert_eq!((inked(9, 2), inked(9, 7), inked(0, 5), inked(18, 5)), (0, 0, 0, 0));
        paper.line(vec2(-50.0, -9.0), vec2(400.0, 90.0), [9; 3]);
    }

    #[test]
    fn words_leave_ink_between_their_ends() {
        let mut paper = Picture::new(200, 40, [0; 3]);
        let end = paper.text((10, 30), 20.0, [255; 3], "FLIP 0.1");
        let columns: Vec<u32> =
            (0..200).filter(|x| (0..40).any(|y| paper.pixels[y * 200 + *x as usize] != [0; 3])).collect();
        assert!(
            columns.first() >= Some(&10) && columns.last() <= Some(&end),
            "ink at {columns:?}, end {end}"
        );
        assert!(columns.len() > 40, "only {} columns of ink", columns.len());
    }

    #[test]
    fn lines_end_between_words_and_hold_all_of_them() {
        let text = "no difference that  256 samples can show extraordinarily";
        let lines = wrapped(20.0, 160, text);
        assert!(lines.iter().all(|l| text_width(20.0, l) <= 160 || !l.contains(' ')), "{lines:?}");
        assert_eq!(lines.join(" "), text.split_whitespace().collect::<Vec<_>>().join(" "));
        assert!(lines.len() > 3 && wrapped(20.0, 160, "").is_empty(), "{lines:?}");
    }

    /// Labels must not run into their neighbours', and must be large enough on a sheet that is scaled to a page.
    #[test]
    fn labels_fit_over_their_pictures_and_are_legible_in_wide_sheets() {
        for (width, columns) in [(60, 6), (512, 6), (512, 2), (1000, 3)] {
            let cells =
                (0..columns).map(|_| ("WWWWWWWWWWWW".to_owned(), Picture::new(width, 8, PAPER))).collect();
            let sheet = grid(&[Row { name: String::new(), cells }]);
            let inked: Vec<bool> = (0..sheet.width)
                .map(|x| (0..sheet.height).any(|y| sheet.pixels[(y * sheet.width + x) as usize] != PAPER))
                .collect();
            let step = (sheet.width - GAP) / columns;
            assert!(
                (1..=columns).all(|i| !inked[(i * step) as usize + 3]),
                "{width} x {columns}: labels touch"
            );
            let rows = (0..sheet.height)
                .filter(|y| (0..sheet.width).any(|x| sheet.pixels[(y * sheet.width + x) as usize] != PAPER));
            // Capitals are three quarters as high as the font.
            let scaled = rows.count() as f32 * (1000.0 / sheet.width as f32).min(1.0);
            assert!(scaled >= 7.0, "{width} x {columns}: letters of {scaled} pixels on a page");
        }
    }

    #[test]
    fn every_pixel_is_enlarged_to_the_same_square() {
        let two = Picture { width: 2, height: 1, pixels: vec![[1; 3], [2; 3]] };
        let four = two.scaled(4, 2);
        assert_eq!(four.pixels, [[1; 3], [1; 3], [2; 3], [2; 3], [1; 3], [1; 3], [2; 3], [2; 3]]);
    }
}

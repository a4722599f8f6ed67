//! Pictures put together from pictures and words.

use std::path::Path;
use std::sync::LazyLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};

use crate::Error;
use crate::render::write_rgb8;

/// Display-encoded sRGB.
pub type Color = [u8; 3];

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

    /// Scaled to `width` by `height` without interpolation, so that each pixel can be seen.
    pub fn scaled(&self, width: u32, height: u32) -> Picture {
        let from = |i: u32, to: u32, len: u32| (u64::from(i) * u64::from(len) / u64::from(to)) as usize;
        let row = |y: u32| from(y, height, self.height) * self.width as usize;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let pixels = pixels.map(|(x, y)| self.pixels[row(y) + from(x, width, self.width)]).collect();
        Picture { width, height, pixels }
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
    fn every_pixel_is_enlarged_to_the_same_square() {
        let two = Picture { width: 2, height: 1, pixels: vec![[1; 3], [2; 3]] };
        let four = two.scaled(4, 2);
        assert_eq!(four.pixels, [[1; 3], [1; 3], [2; 3], [2; 3], [1; 3], [1; 3], [2; 3], [2; 3]]);
    }
}

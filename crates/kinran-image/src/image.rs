use crate::{Error, Transfer};

/// The longest side of an image or a texture, in texels: twice the largest any GPU samples (16384).
pub const MAX_SIDE: u32 = 32768;

/// The most bytes an image may decode to: 16384² RGBA in 32-bit floats.
pub const MAX_IMAGE_BYTES: u64 = 16384 * 16384 * 16;

/// How many channels a texel has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Channels {
    /// Grey.
    R = 1,
    /// Grey and alpha.
    Rg = 2,
    /// Colour or a vector.
    Rgb = 3,
    /// Colour or a vector, and alpha.
    Rgba = 4,
}

impl Channels {
    /// The number of samples in a texel, 1 to 4.
    pub fn count(self) -> usize {
        self as usize
    }
}

/// The samples of an [`Image`], row by row from the top, channels interleaved: integers are unsigned normalised, floats
/// are unbounded. Nothing has been linearised, nothing is multiplied by alpha.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// 8 bits a channel, 255 is one.
    U8(Vec<u8>),
    /// 16 bits a channel, 65535 is one.
    U16(Vec<u16>),
    /// 32-bit floats; finite, the readers refuse NaN and infinities.
    F32(Vec<f32>),
}

impl Pixels {
    /// The number of samples.
    pub fn len(&self) -> usize {
        match self {
            Pixels::U8(v) => v.len(),
            Pixels::U16(v) => v.len(),
            Pixels::F32(v) => v.len(),
        }
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// One authored image, as its file holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Channels of `pixels`.
    pub channels: Channels,
    /// `width * height * channels` samples.
    pub pixels: Pixels,
    /// How its red, green and blue are encoded if they are colour. Integers leave it open unless their file says it, and
    /// colour is sRGB then; floats are linear unless their file says otherwise.
    pub transfer: Transfer,
    /// What was chosen or left out when the file was read, a part of a sentence each, for people.
    pub notes: Vec<String>,
}

impl Image {
    /// An image of these samples.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where a side is 0 or above [`MAX_SIDE`], the number of samples is not
    /// `width * height * channels`, or a float is NaN or infinite.
    pub fn new(width: u32, height: u32, channels: Channels, pixels: Pixels) -> Result<Self, Error> {
        check_sides(width, height).map_err(Error::Unsupported)?;
        let wanted = width as usize * height as usize * channels.count();
        if pixels.len() != wanted {
            return Err(Error::Unsupported(format!(
                "{width}x{height} with {} channels needs {wanted} samples, got {}",
                channels.count(),
                pixels.len()
            )));
        }
        if let Pixels::F32(samples) = &pixels {
            check_finite(width, channels, samples).map_err(Error::Unsupported)?;
        }
        Ok(Image::of(width, height, channels, pixels))
    }

    /// An image of samples that were checked.
    pub(crate) fn of(width: u32, height: u32, channels: Channels, pixels: Pixels) -> Image {
        let transfer = match pixels {
            Pixels::U8(_) | Pixels::U16(_) => Transfer::Unsaid,
            Pixels::F32(_) => Transfer::Linear,
        };
        Image { width, height, channels, pixels, transfer, notes: Vec::new() }
    }

    /// The texel at `(x, y)` as RGBA: integers divided by their maximum, grey replicated to R, G and B,
    /// alpha 1 where the image has none.
    ///
    /// # Panics
    /// Where `(x, y)` lies outside the image.
    pub fn texel(&self, x: u32, y: u32) -> [f32; 4] {
        assert!(x < self.width && y < self.height, "texel ({x}, {y}) of {}x{}", self.width, self.height);
        let n = self.channels.count();
        let i = (y as usize * self.width as usize + x as usize) * n;
        match &self.pixels {
            Pixels::U8(v) => to_rgba(&v[i..i + n], unorm8),
            Pixels::U16(v) => to_rgba(&v[i..i + n], unorm16),
            Pixels::F32(v) => to_rgba(&v[i..i + n], |s| s),
        }
    }

    /// Replaces `out` by row `y`, each texel as [`Image::texel`] gives it.
    ///
    /// # Panics
    /// Where `y` lies outside the image.
    pub fn row_rgba_f32(&self, y: u32, out: &mut Vec<[f32; 4]>) {
        assert!(y < self.height, "row {y} of {}", self.height);
        let n = self.channels.count();
        let stride = self.width as usize * n;
        let row = y as usize * stride..(y as usize + 1) * stride;
        out.clear();
        match &self.pixels {
            Pixels::U8(v) => out.extend(v[row].chunks_exact(n).map(|t| to_rgba(t, unorm8))),
            Pixels::U16(v) => out.extend(v[row].chunks_exact(n).map(|t| to_rgba(t, unorm16))),
            Pixels::F32(v) => out.extend(v[row].chunks_exact(n).map(|t| to_rgba(t, |s| s))),
        }
    }
}

fn unorm8(s: u8) -> f32 {
    f32::from(s) / 255.0
}

fn unorm16(s: u16) -> f32 {
    f32::from(s) / 65535.0
}

/// One texel of 1 to 4 samples as RGBA.
#[inline]
fn to_rgba<S: Copy>(t: &[S], convert: impl Fn(S) -> f32) -> [f32; 4] {
    match *t {
        [g] => [convert(g), convert(g), convert(g), 1.0],
        [g, a] => [convert(g), convert(g), convert(g), convert(a)],
        [r, g, b] => [convert(r), convert(g), convert(b), 1.0],
        [r, g, b, a] => [convert(r), convert(g), convert(b), convert(a)],
        _ => unreachable!("a texel has 1 to 4 channels"),
    }
}

/// Why an image or texture cannot have these sides, if it cannot.
pub(crate) fn check_sides(width: u32, height: u32) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err(format!("the image has no texels ({width}x{height})"));
    }
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("{width}x{height} is too large, the longest side allowed is {MAX_SIDE}"));
    }
    Ok(())
}

/// The first NaN or infinity among an image's samples, if there is one, as a sentence.
pub(crate) fn check_finite(width: u32, channels: Channels, samples: &[f32]) -> Result<(), String> {
    let Some(i) = samples.iter().position(|s| !s.is_finite()) else { return Ok(()) };
    let (texel, channel) = (i / channels.count(), i % channels.count());
    let name = match channels {
        Channels::R | Channels::Rg => ["grey", "alpha", "", ""],
        Channels::Rgb | Channels::Rgba => ["red", "green", "blue", "alpha"],
    }[channel];
    Err(format!(
        "texel ({}, {}) is {} in channel {name}; only finite numbers can be used, repair the file where it \
         was made",
        texel % width as usize,
        texel / width as usize,
        samples[i],
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_channels_are_filled_as_a_person_expects() {
        let cases: [(Channels, Vec<u8>, [f32; 4]); 4] = [
            (Channels::R, vec![51], [0.2, 0.2, 0.2, 1.0]),
            (Channels::Rg, vec![51, 102], [0.2, 0.2, 0.2, 0.4]),
            (Channels::Rgb, vec![51, 102, 153], [0.2, 0.4, 0.6, 1.0]),
            (Channels::Rgba, vec![51, 102, 153, 204], [0.2, 0.4, 0.6, 0.8]),
        ];
        for (channels, samples, wanted) in cases {
            let eight = Image::new(1, 1, channels, Pixels::U8(samples.clone())).unwrap();
            let wide = samples.iter().map(|&s| u16::from(s) * 257).collect();
            let sixteen = Image::new(1, 1, channels, Pixels::U16(wide)).unwrap();
            let mut row = Vec::new();
            for image in [eight, sixteen] {
                image.row_rgba_f32(0, &mut row);
                assert_eq!(row, [wanted], "{image:?}");
                assert_eq!(image.texel(0, 0), wanted, "{image:?}");
            }
        }
    }

    #[test]
    fn a_wrong_number_of_samples_is_refused() {
        let error = Image::new(2, 3, Channels::Rgb, Pixels::U8(vec![0; 17])).unwrap_err();
        assert_eq!(error.to_string(), "2x3 with 3 channels needs 18 samples, got 17");
    }

    #[test]
    fn absurd_sides_are_refused() {
        for (width, height) in [(0, 1), (1, 0), (MAX_SIDE + 1, 1), (1, u32::MAX)] {
            assert!(Image::new(width, height, Channels::R, Pixels::U8(vec![])).is_err(), "{width}x{height}");
        }
    }

    #[test]
    fn nan_and_infinity_are_named_by_texel_and_channel() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut samples = vec![0.0; 2 * 3 * 3];
            samples[(2 * 2 + 1) * 3 + 2] = bad;
            let error = Image::new(2, 3, Channels::Rgb, Pixels::F32(samples)).unwrap_err().to_string();
            assert!(error.starts_with(&format!("texel (1, 2) is {bad} in channel blue")), "{error}");
        }
    }
}

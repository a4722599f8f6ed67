use std::collections::BTreeMap;

use crate::image::{MAX_IMAGE_BYTES, check_sides};
use crate::{Channels, Error, Format, Image, Pixels, Transfer, decode};

/// One mip level in a [`Texture`]'s format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Level {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Tightly packed rows (of blocks, for block formats).
    pub data: Vec<u8>,
}

/// A runtime texture: a 2D mip chain and what is known about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// The bytes' layout.
    pub format: Format,
    /// The meaning of the colour channels.
    pub transfer: Transfer,
    /// Level 0 first; each level is half the one before, rounded down, at least 1.
    pub levels: Vec<Level>,
    /// Key/value pairs stored in the container (KTX2 key/value data), values as text. DDS has no place for
    /// them.
    pub metadata: BTreeMap<String, String>,
}

/// The size of level `level` below a level 0 of `size` texels along one axis: half at each step, rounded
/// down, at least 1 (Vulkan 1.3, section 12.3).
pub fn level_size(size: u32, level: usize) -> u32 {
    size.checked_shr(level as u32).unwrap_or(0).max(1)
}

/// The number of levels down to 1x1.
pub fn full_level_count(width: u32, height: u32) -> usize {
    width.max(height).max(1).ilog2() as usize + 1
}

impl Texture {
    /// Refuses a texture that no container or GPU can hold as it is.
    ///
    /// # Errors
    /// [`Error::Unsupported`] where there is no level or more than [`full_level_count`], a side is 0 or
    /// above [`MAX_SIDE`](crate::MAX_SIDE), a level is not half the one before, its data are not
    /// [`Format::level_bytes`] long, or the format has no sRGB form and [`Transfer::Srgb`] is asked for.
    pub fn check(&self) -> Result<(), Error> {
        let fail = |reason: String| Err(Error::Unsupported(reason));
        let Some(first) = self.levels.first() else { return fail("the texture has no levels".into()) };
        check_sides(first.width, first.height).map_err(Error::Unsupported)?;
        let most = full_level_count(first.width, first.height);
        if self.levels.len() > most {
            let (w, h, n) = (first.width, first.height, self.levels.len());
            return fail(format!("a {w}x{h} texture has at most {most} levels, not {n}"));
        }
        if self.transfer == Transfer::Srgb && !self.format.has_srgb() {
            let name = self.format.name();
            return fail(format!("{name} has no sRGB form; use linear, or bc1, bc7, uastc or rgba8"));
        }
        for (i, level) in self.levels.iter().enumerate() {
            let wanted = (level_size(first.width, i), level_size(first.height, i));
            if (level.width, level.height) != wanted {
                let (w, h) = wanted;
                return fail(format!("level {i} must be {w}x{h}, got {}x{}", level.width, level.height));
            }
            let bytes = self.format.level_bytes(level.width, level.height);
            if level.data.len() != bytes {
                let (w, h, format, got) = (level.width, level.height, self.format, level.data.len());
                return fail(format!("level {i}, {w}x{h} in {format:?}, takes {bytes} bytes, got {got}"));
            }
        }
        Ok(())
    }

    /// Refuses a texture of which nobody said what its numbers mean, before it is written.
    pub(crate) fn check_transfer(&self) -> Result<(), Error> {
        if self.transfer == Transfer::Unsaid {
            return Err(Error::Unsupported(
                "nothing says whether the texture is sRGB; set its transfer, by Transfer::of_content".into(),
            ));
        }
        Ok(())
    }

    /// The texels of a level as a sampler without filtering reads them, but for the sRGB decoding, which
    /// is left to the caller. See [`decode`].
    ///
    /// # Errors
    /// [`Error::Unsupported`] where there is no such level or its data have another length than its size
    /// demands.
    pub fn decode_level(&self, level: usize) -> Result<Vec<[f32; 4]>, Error> {
        let Some(l) = self.levels.get(level) else {
            return Err(Error::Unsupported(format!("there is no level {level}, only {}", self.levels.len())));
        };
        decode(self.format, &l.data, l.width, l.height)
    }

    /// The largest level as an image: 8 bits for the formats that decode to them, else floats. BC5 holds normals and gets
    /// its z back.
    ///
    /// # Errors
    /// Those of [`Texture::check`] and [`Texture::decode_level`].
    pub fn to_image(&self) -> Result<Image, Error> {
        self.check()?;
        let Level { width, height, .. } = self.levels[0];
        if u64::from(width) * u64::from(height) * 16 > MAX_IMAGE_BYTES {
            return Err(Error::Unsupported(format!(
                "{width}x{height} texels are too many for an image of floats"
            )));
        }
        let texels = self.decode_level(0)?;
        let (channels, pixels) = match self.format {
            Format::Bc1 | Format::Bc7 | Format::Uastc | Format::Rgba8 => {
                // Exact: these decode to multiples of 1/255.
                let bytes = texels.as_flattened().iter().map(|&x| (x * 255.0 + 0.5) as u8);
                (Channels::Rgba, Pixels::U8(bytes.collect()))
            }
            Format::Bc4 => (Channels::R, Pixels::F32(texels.iter().map(|texel| texel[0]).collect())),
            Format::Bc5 => {
                let normals = texels.iter().flat_map(|&[r, g, ..]| {
                    let (x, y) = (2.0 * r - 1.0, 2.0 * g - 1.0);
                    [r, g, 0.5 + 0.5 * (1.0 - x * x - y * y).max(0.0).sqrt()]
                });
                (Channels::Rgb, Pixels::F32(normals.collect()))
            }
            Format::Rgba16F => (Channels::Rgba, Pixels::F32(texels.as_flattened().to_vec())),
        };
        let image = Image::new(width, height, channels, pixels)?;
        Ok(Image { transfer: self.transfer, ..image })
    }
}

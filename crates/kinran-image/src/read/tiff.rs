//! TIFF: grey or RGB, the first page.

use std::io::{Read, Seek};

use tiff::decoder::DecodingResult;
use tiff::tags::Tag;

use super::{check_claims, finite_image, unassociate};
use crate::image::MAX_IMAGE_BYTES;
use crate::{Channels, Image, Pixels};

/// `ExtraSamples` of colours that are multiplied by alpha (TIFF 6.0, section 18).
const ASSOCIATED: u32 = 1;

pub(super) fn decode(file: impl Read + Seek, stored: u64) -> Result<Image, String> {
    let damaged = |e: tiff::TiffError| match e {
        tiff::TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            crate::error::TRUNCATED.into()
        }
        tiff::TiffError::UnsupportedError(e) => format!("{e}; save it as an 8- or 16-bit PNG"),
        e => format!("{e}; the file is damaged"),
    };
    let mut limits = tiff::decoder::Limits::default();
    limits.decoding_buffer_size = MAX_IMAGE_BYTES as usize;
    // One strip may be the whole image.
    limits.intermediate_buffer_size = MAX_IMAGE_BYTES as usize;
    let mut decoder = tiff::decoder::Decoder::new(file).map_err(damaged)?.with_limits(limits);

    let (width, height) = decoder.dimensions().map_err(damaged)?;
    let color = decoder.colortype().map_err(damaged)?;
    let extra = decoder.find_tag_unsigned_vec::<u32>(Tag::ExtraSamples).map_err(damaged)?.unwrap_or_default();
    let orientation = decoder.find_tag_unsigned::<u32>(Tag::Orientation).map_err(damaged)?.unwrap_or(1);
    let (channels, bits) = match color {
        tiff::ColorType::Gray(bits) => (Channels::R, bits),
        // The decoder's word for grey and alpha.
        tiff::ColorType::GrayA(bits) | tiff::ColorType::Multiband { bit_depth: bits, num_samples: 2 } => {
            (Channels::Rg, bits)
        }
        tiff::ColorType::RGB(bits) => (Channels::Rgb, bits),
        tiff::ColorType::RGBA(bits) => (Channels::Rgba, bits),
        other => return Err(format!("its colours are {other:?}; convert it to grey or RGB")),
    };
    let unsupported = || format!("{bits}-bit samples of this kind are not read; save 8, 16 or 32-bit float");
    if ![8, 16, 32].contains(&bits) {
        return Err(unsupported());
    }
    check_claims(width, height, channels.count() as u64 * u64::from(bits / 8), stored)?;
    let layout = decoder.image_buffer_layout().map_err(damaged)?;
    if layout.planes > 1 {
        return Err("its channels are stored in separate planes; save it with interleaved channels".into());
    }
    let pixels = match decoder.read_image().map_err(damaged)? {
        DecodingResult::U8(v) => Pixels::U8(v),
        DecodingResult::U16(v) => Pixels::U16(v),
        DecodingResult::F32(v) => Pixels::F32(v),
        DecodingResult::F16(v) => Pixels::F32(v.into_iter().map(|h| h.to_f32()).collect()),
        _ => return Err(unsupported()),
    };
    let texels = width as usize * height as usize;
    if pixels.len() != texels * channels.count() {
        return Err(format!(
            "it holds {} samples, {texels} texels of {} channels have {}; save it without further channels",
            pixels.len(),
            channels.count(),
            texels * channels.count()
        ));
    }
    let mut image = finite_image(width, height, channels, pixels)?;
    if extra.first() == Some(&ASSOCIATED) {
        image = unassociate(image);
    }
    Ok(turned(image, orientation))
}

/// An image with its visual top in row 0 and its visual left in column 0 (TIFF 6.0, `Orientation`); unknown values are 1.
fn turned(image: Image, orientation: u32) -> Image {
    if !(2..=8).contains(&orientation) {
        return image;
    }
    let (w, h) = (image.width as usize, image.height as usize);
    let (width, height) = if orientation > 4 { (h, w) } else { (w, h) };
    // Which stored texel is seen at (x, y).
    let stored = |x: usize, y: usize| match orientation {
        2 => (w - 1 - x, y),
        3 => (w - 1 - x, h - 1 - y),
        4 => (x, h - 1 - y),
        5 => (y, x),
        6 => (y, h - 1 - x),
        7 => (w - 1 - y, h - 1 - x),
        _ => (w - 1 - y, x),
    };
    let n = image.channels.count();
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let starts = texels.map(|(x, y)| stored(x, y)).map(|(x, y)| (y * w + x) * n);
    fn gather<T: Copy>(samples: &[T], starts: impl Iterator<Item = usize>, n: usize) -> Vec<T> {
        starts.flat_map(|start| samples[start..start + n].iter().copied()).collect()
    }
    let pixels = match &image.pixels {
        Pixels::U8(v) => Pixels::U8(gather(v, starts, n)),
        Pixels::U16(v) => Pixels::U16(gather(v, starts, n)),
        Pixels::F32(v) => Pixels::F32(gather(v, starts, n)),
    };
    Image { width: width as u32, height: height as u32, pixels, ..image }
}

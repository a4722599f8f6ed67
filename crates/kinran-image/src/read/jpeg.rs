//! JPEG: baseline and progressive, 8 bits.

use std::io::Read;

use image::metadata::Orientation;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};

use super::{check_claims, turn_note};
use crate::image::MAX_SIDE;
use crate::{Channels, Image, Pixels};

pub(super) fn decode(mut file: impl Read, stored: u64) -> Result<Image, String> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|e| e.to_string())?;

    // The decoder fills what a truncated file lacks with grey, so the end marker is looked for here. The
    // entropy-coded data cannot contain a marker, and an embedded thumbnail lies before the last scan.
    let last = |marker: u8| bytes.windows(2).rposition(|w| w == [0xff, marker]);
    let (start_of_scan, end_of_image) = (last(0xda), last(0xd9));
    if start_of_scan.is_none() || end_of_image < start_of_scan {
        return Err(crate::error::TRUNCATED.into());
    }

    // The decoder takes every image with Adobe's transform 0 for CMYK. It is told of YCbCr instead, and hands out the
    // three components as they are stored where they are RGB.
    let color = three_colors(&bytes);
    if let Some(Colors { transform: Some(at), .. }) = color {
        bytes[at] = 1;
    }

    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(&bytes), options);
    let damaged = |e| format!("{e}; the file is damaged or of a rare kind, save it again as PNG");
    decoder.decode_headers().map_err(damaged)?;
    let (Some(info), Some(space)) = (decoder.info(), decoder.input_colorspace()) else {
        return Err("the file has no header".into());
    };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let (channels, out) = match space {
        ColorSpace::Luma => (Channels::R, ColorSpace::Luma),
        ColorSpace::YCbCr if color.is_some_and(|color| color.rgb) => (Channels::Rgb, ColorSpace::YCbCr),
        ColorSpace::YCbCr | ColorSpace::RGB => (Channels::Rgb, ColorSpace::RGB),
        other => return Err(format!("its colours are {other:?}, for print; convert it to RGB")),
    };
    check_claims(width, height, channels.count() as u64, stored)?;
    decoder.set_options(options.jpeg_set_out_colorspace(out));
    let mut samples = vec![0u8; width as usize * height as usize * channels.count()];
    decoder.decode_into(&mut samples).map_err(damaged)?;
    let mut image = Image::of(width, height, channels, Pixels::U8(samples));
    let orientation = decoder.exif().and_then(|exif| Orientation::from_exif_chunk(exif));
    image.notes.extend(turn_note(orientation));
    Ok(image)
}

/// What the three components of an image are.
#[derive(Clone, Copy)]
struct Colors {
    /// RGB, not YCbCr.
    rgb: bool,
    /// Where Adobe's transform stands.
    transform: Option<usize>,
}

/// The colours of an image of three components, by libjpeg's rules (`default_decompress_parms`): JFIF is YCbCr; else
/// Adobe's transform says it, 0 for RGB; else components that are called R, G and B are that.
fn three_colors(bytes: &[u8]) -> Option<Colors> {
    let (mut jfif, mut adobe, mut ids) = (false, None, None);
    let mut at = 2;
    loop {
        let (0xff, marker) = (*bytes.get(at)?, *bytes.get(at + 1)?) else { return None };
        match marker {
            // Filling.
            0xff => {
                at += 1;
                continue;
            }
            // Markers without a segment.
            0x01 | 0xd0..=0xd8 => {
                at += 2;
                continue;
            }
            _ => {}
        }
        let length = usize::from(u16::from_be_bytes([*bytes.get(at + 2)?, *bytes.get(at + 3)?]));
        let segment = bytes.get(at + 4..at + 2 + length)?;
        match marker {
            0xe0 => jfif |= segment.starts_with(b"JFIF\0"),
            0xee if segment.starts_with(b"Adobe") && segment.len() >= 12 => adobe = Some(at + 4 + 11),
            // Start of frame: precision, height, width, count, and three bytes for each component.
            0xc0..=0xcf if ![0xc4, 0xc8, 0xcc].contains(&marker) => {
                ids = match segment {
                    [_, _, _, _, _, 3, a, _, _, b, _, _, c, ..] => Some([*a, *b, *c]),
                    _ => None,
                };
            }
            0xda => break,
            _ => {}
        }
        at += 2 + length;
    }
    let ids = ids?;
    let rgb = match adobe.map(|at| bytes[at]) {
        _ if jfif => false,
        Some(transform) => transform == 0,
        None => ids == *b"RGB",
    };
    Some(Colors { rgb, transform: adobe })
}

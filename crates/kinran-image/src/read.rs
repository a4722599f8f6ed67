//! Image files in: PNG, JPEG, TGA, TIFF, Radiance HDR and OpenEXR, samples exactly as stored.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use exr::prelude::{FlatSamples, MetaData, ReadChannels, ReadLayers};
use image::codecs::{hdr::HdrDecoder, png::PngDecoder, tga::TgaDecoder};
use image::{ColorType, ImageDecoder, ImageError, Limits};
use tiff::decoder::DecodingResult;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};

use crate::image::{MAX_IMAGE_BYTES, MAX_SIDE, check_finite, check_sides};
use crate::{Channels, Error, Image, Pixels};

/// The most texels' bytes that one stored byte can honestly stand for. Deflate reaches 1032; a 1-bit
/// palette expands each of those bytes to 8 RGBA texels, 33024 in all. A header that claims more lies.
const MAX_EXPANSION: u64 = 65536;

/// Reads an image file. The format is told by the content; TGA, which cannot be told, by the extension.
///
/// 8- and 16-bit samples stay as they are (smaller ones and palettes are expanded to 8 bits), floats and
/// half floats become `f32`. Nothing is linearised, premultiplied or rotated.
///
/// | format | read | refused, by name |
/// |---|---|---|
/// | PNG | all of it; the first frame of an animation | |
/// | JPEG | 8-bit grey and colour, baseline and progressive | CMYK, 12-bit, arithmetic-coded |
/// | TGA | grey, colour, palette, run lengths | |
/// | TIFF | grey or RGB, with or without alpha, 8 or 16 bits, half or float; the first page | CMYK, palette, Lab, separate planes |
/// | HDR | RGBE | |
/// | EXR | the first flat layer's Y, or R, G, B, with or without A | deep data, subsampled channels, DWA compression |
///
/// # Errors
/// [`Error::Io`] where the file cannot be opened, [`Error::Malformed`] where its content is not a whole
/// image, has a side above [`MAX_SIDE`] or more than [`MAX_IMAGE_BYTES`], or holds NaN or an infinity.
pub fn read_image(path: &Path) -> Result<Image, Error> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    if file.metadata().map_err(|e| Error::io(path, e))?.is_dir() {
        return Err(Error::io(path, std::io::ErrorKind::IsADirectory.into()));
    }
    decode(path, BufReader::with_capacity(1 << 16, file))
}

/// Decodes an image file that is in memory already; `name` stands for it in errors, and its extension
/// tells a TGA. See [`read_image`].
///
/// # Errors
/// As [`read_image`].
pub fn decode_image(name: &Path, bytes: &[u8]) -> Result<Image, Error> {
    decode(name, Cursor::new(bytes))
}

fn decode<R: BufRead + Seek + Send>(name: &Path, mut file: R) -> Result<Image, Error> {
    let size = file.seek(SeekFrom::End(0)).map_err(|e| Error::io(name, e))?;
    file.rewind().map_err(|e| Error::io(name, e))?;
    let mut magic = Vec::new();
    file.by_ref().take(16).read_to_end(&mut magic).map_err(|e| Error::io(name, e))?;
    file.rewind().map_err(|e| Error::io(name, e))?;

    if magic.is_empty() {
        return Err(Error::malformed(name, "the file is empty"));
    }
    let image = match magic.as_slice() {
        [0x89, b'P', b'N', b'G', ..] => {
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some(MAX_IMAGE_BYTES);
            PngDecoder::with_limits(file, limits)
                .map_err(|e| image_error(&e))
                .and_then(|decoder| decode_samples(decoder, size))
                .map_err(|e| ("PNG", e))
        }
        [0xff, 0xd8, 0xff, ..] => decode_jpeg(file, size).map_err(|e| ("JPEG", e)),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => {
            decode_tiff(file, size).map_err(|e| ("TIFF", e))
        }
        [b'#', b'?', ..] => HdrDecoder::new_nonstrict(file)
            .map_err(|e| image_error(&e))
            .and_then(|decoder| decode_samples(decoder, size))
            .map_err(|e| ("HDR", e)),
        [0x76, 0x2f, 0x31, 0x01, ..] => decode_exr(file, size).map_err(|e| ("EXR", e)),
        _ if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga")) => TgaDecoder::new(file)
            .map_err(|e| image_error(&e))
            .and_then(|decoder| decode_samples(decoder, size))
            .map_err(|e| ("TGA", e)),
        _ => return Err(Error::malformed(name, unknown_format(&magic))),
    };
    image.map_err(|(format, reason)| Error::malformed(name, format!("{format}: {reason}")))
}

/// What to say of a file that is none of our formats.
fn unknown_format(magic: &[u8]) -> String {
    let other = match magic {
        [0xab, b'K', b'T', b'X', ..] | [b'D', b'D', b'S', b' ', ..] => "an engine texture (KTX or DDS)",
        [b'R', b'I', b'F', b'F', ..] => "WebP",
        [b'B', b'M', ..] => "BMP",
        [b'G', b'I', b'F', b'8', ..] => "GIF",
        [b'8', b'B', b'P', b'S', ..] => "a Photoshop document",
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => "AVIF or HEIF",
        _ => "of no format known here",
    };
    format!("the file is {other}; images are read from PNG, JPEG, TGA, TIFF, HDR and EXR, save it as one")
}

/// Refuses a header's claims before memory is spent on them.
fn check_claims(width: u32, height: u32, texel_bytes: u64, stored: u64) -> Result<(), String> {
    check_sides(width, height)?;
    let bytes = u64::from(width) * u64::from(height) * texel_bytes;
    if bytes > MAX_IMAGE_BYTES {
        return Err(format!(
            "{width}x{height} at {texel_bytes} bytes a texel is too large, at most {} MiB are read",
            MAX_IMAGE_BYTES >> 20
        ));
    }
    if bytes > stored.saturating_mul(MAX_EXPANSION) {
        return Err(format!("the header claims {width}x{height} texels, which {stored} bytes cannot hold"));
    }
    Ok(())
}

fn image_error(error: &ImageError) -> String {
    match error {
        ImageError::Unsupported(e) => format!("{e}; save it as an 8- or 16-bit PNG"),
        ImageError::Limits(e) => format!("{e}; it is too large, the longest side allowed is {MAX_SIDE}"),
        ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the file ends too early, it is truncated".into()
        }
        e => format!("{}; the file is damaged or truncated", plain(&e.to_string())),
    }
}

/// A decoder's message without what it says in Rust: of `ChunkType { type: IHDR, critical: true, … }` the name, and of
/// a stream that cannot be inflated nothing about the state of the decoder.
fn plain(message: &str) -> String {
    const CHUNK: &str = "ChunkType { type: ";
    let mut plain = String::new();
    let mut rest = message;
    while let Some((before, chunk)) = rest.split_once(CHUNK) {
        let (fields, after) = chunk.split_once('}').unwrap_or((chunk, ""));
        plain += before;
        plain += fields.split(',').next().unwrap_or("");
        rest = after;
    }
    plain += rest;
    match plain.split_once("Corrupt deflate stream") {
        Some((before, _)) => format!("{before}a stream in it cannot be inflated"),
        None => plain,
    }
}

/// Decodes straight into the vector that the image keeps.
fn decode_samples(decoder: impl ImageDecoder, stored: u64) -> Result<Image, String> {
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    check_claims(width, height, u64::from(color.bytes_per_pixel()), stored)?;
    let channels = match color.channel_count() {
        1 => Channels::R,
        2 => Channels::Rg,
        3 => Channels::Rgb,
        _ => Channels::Rgba,
    };
    let samples = width as usize * height as usize * channels.count();
    let pixels = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            let mut v = vec![0u8; samples];
            decoder.read_image(&mut v).map(|()| Pixels::U8(v))
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let mut v = vec![0u16; samples];
            decoder.read_image(bytemuck::cast_slice_mut(&mut v)).map(|()| Pixels::U16(v))
        }
        ColorType::Rgb32F | ColorType::Rgba32F => {
            let mut v = vec![0f32; samples];
            decoder.read_image(bytemuck::cast_slice_mut(&mut v)).map(|()| Pixels::F32(v))
        }
        other => {
            return Err(format!("samples of type {other:?} are not read; save it as an 8- or 16-bit PNG"));
        }
    };
    finite_image(width, height, channels, pixels.map_err(|e| image_error(&e))?)
}

/// The decoders' last check, without [`Image::new`]'s checks of what is already known.
fn finite_image(width: u32, height: u32, channels: Channels, pixels: Pixels) -> Result<Image, String> {
    if let Pixels::F32(samples) = &pixels {
        check_finite(width, channels, samples)?;
    }
    Ok(Image { width, height, channels, pixels })
}

fn decode_jpeg(mut file: impl Read, stored: u64) -> Result<Image, String> {
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(|e| e.to_string())?;

    // The decoder fills what a truncated file lacks with grey, so the end marker is looked for here. The
    // entropy-coded data cannot contain a marker, and an embedded thumbnail lies before the last scan.
    let last = |marker: u8| bytes.windows(2).rposition(|w| w == [0xff, marker]);
    let (start_of_scan, end_of_image) = (last(0xda), last(0xd9));
    if start_of_scan.is_none() || end_of_image < start_of_scan {
        return Err("the file ends too early, it is truncated".into());
    }

    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(MAX_SIDE as usize)
        .set_max_height(MAX_SIDE as usize);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(ZCursor::new(&bytes), options);
    let damaged = |e| format!("{e}; the file is damaged or of a rare kind, save it again as PNG");
    decoder.decode_headers().map_err(damaged)?;
    let (Some(info), Some(color)) = (decoder.info(), decoder.input_colorspace()) else {
        return Err("the file has no header".into());
    };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let (channels, out) = match color {
        ColorSpace::Luma => (Channels::R, ColorSpace::Luma),
        ColorSpace::YCbCr | ColorSpace::RGB => (Channels::Rgb, ColorSpace::RGB),
        other => return Err(format!("its colours are {other:?}, for print; convert it to RGB")),
    };
    check_claims(width, height, channels.count() as u64, stored)?;
    decoder.set_options(options.jpeg_set_out_colorspace(out));
    let mut samples = vec![0u8; width as usize * height as usize * channels.count()];
    decoder.decode_into(&mut samples).map_err(damaged)?;
    Ok(Image { width, height, channels, pixels: Pixels::U8(samples) })
}

fn decode_tiff(file: impl Read + Seek, stored: u64) -> Result<Image, String> {
    let damaged = |e: tiff::TiffError| match e {
        tiff::TiffError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => {
            "the file ends too early, it is truncated".into()
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
    let (channels, bits) = match color {
        tiff::ColorType::Gray(bits) => (Channels::R, bits),
        tiff::ColorType::GrayA(bits) => (Channels::Rg, bits),
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
    if pixels.len() != width as usize * height as usize * channels.count() {
        return Err("it holds another number of samples than its header says".into());
    }
    finite_image(width, height, channels, pixels)
}

fn decode_exr(mut file: impl Read + Seek + Send, stored: u64) -> Result<Image, String> {
    let damaged = |e: exr::error::Error| match e {
        exr::error::Error::NotSupported(e) => {
            format!("{e} is not supported; save it flat, with ZIP compression")
        }
        e => format!("{e}; the file is damaged or truncated"),
    };
    let meta = MetaData::read_from_buffered(&mut file, false).map_err(damaged)?;
    let Some(header) = meta.headers.iter().find(|h| !h.deep) else {
        return Err("it holds deep data only; flatten it".into());
    };
    let side = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let (width, height) = (side(header.layer_size.width()), side(header.layer_size.height()));
    let texel_bytes: usize = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    check_claims(width, height, texel_bytes as u64, stored)?;
    if header.channels.list.iter().any(|c| (c.sampling.x(), c.sampling.y()) != (1, 1)) {
        return Err("it has subsampled channels; save it as RGB".into());
    }
    let window = header.shared_attributes.display_window;
    if (window.position, window.size) != (header.own_attributes.layer_position, header.layer_size) {
        return Err("its data window is not its display window; crop or extend it to the picture".into());
    }

    file.rewind().map_err(|e| e.to_string())?;
    let layer = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)
        .map_err(damaged)?
        .layer_data;
    let (width, height) = (side(layer.size.width()), side(layer.size.height()));
    check_sides(width, height)?;

    // Pick the planes by the names they have in the wild: "R", "layer.R", "Y"; one alone may have any.
    let list = &layer.channel_data.list;
    let plane = |wanted: &str| {
        list.iter().find(|c| {
            let name = c.name.to_string();
            name.rsplit('.').next().is_some_and(|last| last.eq_ignore_ascii_case(wanted))
        })
    };
    let names = || list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>().join(", ");
    let mut planes = match (plane("R"), plane("G"), plane("B"), plane("Y")) {
        (Some(r), Some(g), Some(b), _) => vec![r, g, b],
        (None, None, None, Some(y)) => vec![y],
        _ if list.len() == 1 => vec![&list[0]],
        _ => return Err(format!("its channels are {}; wanted are R, G, B or Y, and A", names())),
    };
    planes.extend(plane("A").filter(|_| list.len() > 1));
    let channels = [Channels::R, Channels::Rg, Channels::Rgb, Channels::Rgba][planes.len() - 1];

    let n = planes.len();
    let mut samples = vec![0f32; width as usize * height as usize * n];
    for (c, plane) in planes.into_iter().enumerate() {
        let texels = samples.iter_mut().skip(c).step_by(n);
        match &plane.sample_data {
            FlatSamples::F16(v) => texels.zip(v).for_each(|(s, h)| *s = h.to_f32()),
            FlatSamples::F32(v) => texels.zip(v).for_each(|(s, f)| *s = *f),
            FlatSamples::U32(_) => return Err(format!("channel {} holds integers, not floats", plane.name)),
        }
    }
    finite_image(width, height, channels, Pixels::F32(samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_decoder_says_of_a_damaged_png_is_no_rust() {
        let whole = crate::encode_png(&Image::new(8, 8, Channels::R, Pixels::U8((0..64).collect())).unwrap())
            .unwrap();
        let mut kinds = std::collections::BTreeSet::new();
        for at in 8..whole.len() {
            for bit in [1, 128] {
                let mut bytes = whole.clone();
                bytes[at] ^= bit;
                let Err(error) = decode_image(Path::new("a.png"), &bytes) else { continue };
                let said = error.to_string();
                assert!(
                    !said.contains(['{', '}']) && !said.contains("Debug") && !said.contains("::"),
                    "byte {at}: {said}"
                );
                kinds.insert(said);
            }
        }
        assert!(kinds.iter().any(|said| said.contains("IDAT")), "{kinds:?}");
        assert_eq!(
            plain(
                "a ChunkType { type: tRNS, critical: false, private: false } b ChunkType { type: PLTE, c: true }"
            ),
            "a tRNS b PLTE"
        );
    }
}

//! Image files in: PNG, JPEG, TGA, BMP, WebP, TIFF, Radiance HDR, OpenEXR, and the largest level of KTX2 and DDS.

mod exr;
mod hdr;
mod jpeg;
mod tiff;

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use image::codecs::{bmp::BmpDecoder, png::PngDecoder, tga::TgaDecoder, webp::WebPDecoder};
use image::metadata::Orientation;
use image::{ColorType, ImageDecoder, ImageError, Limits};

use crate::error::TRUNCATED;
use crate::image::{MAX_IMAGE_BYTES, MAX_SIDE, check_finite, check_sides};
use crate::{Channels, Error, Image, Pixels, decode_texture};

/// Extensions of the files that [`read_image`] reads, in lower case.
pub const IMAGE_EXTENSIONS: [&str; 14] =
    ["png", "jpg", "jpeg", "jpe", "jfif", "tga", "bmp", "webp", "tif", "tiff", "hdr", "exr", "ktx2", "dds"];

/// Whether a file's name ends in one of [`IMAGE_EXTENSIONS`], in upper or lower case.
pub fn has_image_extension(path: &Path) -> bool {
    path.extension().is_some_and(|own| IMAGE_EXTENSIONS.iter().any(|known| own.eq_ignore_ascii_case(known)))
}

/// The most texels' bytes that one stored byte can honestly stand for. Deflate reaches 1032; a 1-bit
/// palette expands each of those bytes to 8 RGBA texels, 33024 in all. A header that claims more lies.
const MAX_EXPANSION: u64 = 65536;

/// Reads an image file. The format is told by the content; TGA, which cannot be told, by the extension.
///
/// 8- and 16-bit samples stay as they are (smaller ones and palettes are expanded to 8 bits), floats and
/// half floats become `f32`. Nothing is linearised, nor turned for display, but TIFF's `Orientation`, which says how it is
/// stored, is heeded; how colour is encoded stands in [`Image::transfer`].
/// Colours that a file holds multiplied by their alpha (EXR always, TIFF where it says so) are divided by it again,
/// 8 bits becoming 16; where alpha is 0 they stay.
///
/// | format | read | refused, by name |
/// |---|---|---|
/// | PNG | all of it; the first frame of an animation | |
/// | JPEG | 8-bit grey and colour, baseline and progressive | CMYK, 12-bit, arithmetic-coded |
/// | TGA | grey, colour, palette, run lengths | |
/// | BMP | all that Windows writes | |
/// | WebP | lossy and lossless; the first frame of an animation | |
/// | TIFF | grey or RGB, with or without alpha, 8 or 16 bits, half or float; the first page | CMYK, palette, Lab, separate planes |
/// | HDR | RGBE, rows from the top | XYZE, other orientations |
/// | EXR | R, G, B, or X, Y, Z, or Y or a single channel, with or without A, of one layer; all compressions, DWA too | deep data, subsampled channels, several layers of which none is meant more than another |
/// | KTX2, DDS | the largest level of what [`decode_texture`] reads; of two channels, which are normals, the third is rebuilt | |
///
/// # Errors
/// [`Error::Io`] where the file cannot be opened, [`Error::Malformed`] where its content is not a whole
/// image, has a side above [`MAX_SIDE`] or more than [`MAX_IMAGE_BYTES`], or holds NaN or an infinity.
pub fn read_image(path: &Path) -> Result<Image, Error> {
    read_layer(path, None)
}

/// Reads an image file, of an EXR the layer that is called so, as [`read_image`]'s errors and notes call it.
///
/// # Errors
/// As [`read_image`]; and where `layer` is given, that the file has no such layer or is of a format without layers.
pub fn read_layer(path: &Path, layer: Option<&str>) -> Result<Image, Error> {
    let file = File::open(path).map_err(|e| Error::io(path, e))?;
    if file.metadata().map_err(|e| Error::io(path, e))?.is_dir() {
        return Err(Error::io(path, std::io::ErrorKind::IsADirectory.into()));
    }
    decode(path, BufReader::with_capacity(1 << 16, file), layer, NAME_LAYER)
}

/// What a person does about a file of several layers who can name one.
const NAME_LAYER: &str = "say which is meant with --exr-layer, or save that one alone";

/// As [`read_layer`], of a file that is in memory already; `name` stands for it in errors, and its extension tells a TGA.
///
/// # Errors
/// As [`read_layer`].
pub fn decode_layer(name: &Path, bytes: &[u8], layer: Option<&str>) -> Result<Image, Error> {
    decode(name, Cursor::new(bytes), layer, NAME_LAYER)
}

/// Decodes an image file that is in memory already; `name` stands for it in errors, and its extension
/// tells a TGA. Of several layers nobody can name one. See [`read_image`].
///
/// # Errors
/// As [`read_image`].
pub fn decode_image(name: &Path, bytes: &[u8]) -> Result<Image, Error> {
    decode(name, Cursor::new(bytes), None, "save the one that is meant alone")
}

/// `advice` is for files with several layers.
fn decode<R: BufRead + Seek + Send>(
    name: &Path,
    mut file: R,
    layer: Option<&str>,
    advice: &str,
) -> Result<Image, Error> {
    let size = file.seek(SeekFrom::End(0)).map_err(|e| Error::io(name, e))?;
    file.rewind().map_err(|e| Error::io(name, e))?;
    let mut magic = Vec::new();
    file.by_ref().take(16).read_to_end(&mut magic).map_err(|e| Error::io(name, e))?;
    file.rewind().map_err(|e| Error::io(name, e))?;

    let is_exr = magic.starts_with(&[0x76, 0x2f, 0x31, 0x01]);
    if let Some(layer) = layer.filter(|_| !is_exr) {
        return Err(Error::malformed(
            name,
            format!("only EXR has layers, so there is no \"{layer}\"; leave --exr-layer out"),
        ));
    }
    let image = match magic.as_slice() {
        [] => return Err(Error::malformed(name, "the file is empty; save it again, or leave it out")),
        [0x89, b'P', b'N', b'G', ..] => {
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some(MAX_IMAGE_BYTES);
            ("PNG", decode_with(PngDecoder::with_limits(file, limits), size))
        }
        [0xff, 0xd8, 0xff, ..] => ("JPEG", jpeg::decode(file, size)),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => ("TIFF", tiff::decode(file, size)),
        [b'#', b'?', ..] => ("HDR", hdr::decode(file, size)),
        _ if is_exr => ("EXR", exr::decode(file, size, layer, advice)),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => {
            // No bound by the file's bytes: a picture of one colour takes none for its texels, of any size. The longest
            // side is 16384, so no header asks for more than 1 GiB.
            ("WebP", check_riff(&magic, size).and_then(|()| decode_with(WebPDecoder::new(file), u64::MAX)))
        }
        [b'D', b'D', b'S', b' ', ..] | [0xab, b'K', b'T', b'X', b' ', b'2', b'0', ..] => {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map_err(|e| Error::io(name, e))?;
            return decode_texture(name, &bytes)?.to_image();
        }
        _ if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga")) => {
            ("TGA", decode_with(TgaDecoder::new(file), size))
        }
        [b'B', b'M', ..] => ("BMP", decode_with(BmpDecoder::new(file), size)),
        _ => return Err(Error::malformed(name, unknown_format(&magic))),
    };
    let (format, image) = image;
    image.map_err(|reason| Error::malformed(name, format!("{format}: {reason}")))
}

/// What to say of a file that is none of our formats.
fn unknown_format(magic: &[u8]) -> String {
    let other = match magic {
        [0xab, b'K', b'T', b'X', ..] => "a texture in KTX 1",
        [b'G', b'I', b'F', b'8', ..] => "GIF",
        [b'8', b'B', b'P', b'S', ..] => "a Photoshop document",
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => "AVIF or HEIF",
        [0xff, 0x0a, ..] | [0, 0, 0, 12, b'J', b'X', b'L', ..] => "JPEG XL",
        [0, 0, 0, 12, b'j', b'P', ..] => "JPEG 2000",
        _ => "of no format known here",
    };
    format!(
        "the file is {other}; images are read from PNG, JPEG, TGA, BMP, WebP, TIFF, HDR, EXR, KTX2 and DDS, save it as one"
    )
}

/// Refuses a WebP file that is shorter than its first chunk says: the decoder fills what a truncated one lacks.
fn check_riff(magic: &[u8], stored: u64) -> Result<(), String> {
    let length = magic.get(4..8).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    if stored < u64::from(length) + 8 {
        return Err(TRUNCATED.into());
    }
    Ok(())
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
        ImageError::IoError(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => TRUNCATED.into(),
        e => format!("{}; the file is damaged or truncated, save it again", plain(&e.to_string())),
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

fn decode_with<D: ImageDecoder>(decoder: Result<D, ImageError>, stored: u64) -> Result<Image, String> {
    decoder.map_err(|e| image_error(&e)).and_then(|decoder| decode_samples(decoder, stored))
}

/// Decodes straight into the vector that the image keeps.
fn decode_samples(mut decoder: impl ImageDecoder, stored: u64) -> Result<Image, String> {
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    check_claims(width, height, u64::from(color.bytes_per_pixel()), stored)?;
    let channels = match color.channel_count() {
        1 => Channels::R,
        2 => Channels::Rg,
        3 => Channels::Rgb,
        _ => Channels::Rgba,
    };
    let note = turn_note(decoder.orientation().ok());
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
    let mut image = finite_image(width, height, channels, pixels.map_err(|e| image_error(&e))?)?;
    image.notes.extend(note);
    Ok(image)
}

/// What is said of an image that is to be turned when it is shown: engines and glTF do not, so maps are not.
fn turn_note(orientation: Option<Orientation>) -> Option<String> {
    let turned = orientation.is_some_and(|orientation| orientation != Orientation::NoTransforms);
    turned.then(|| "its EXIF data ask to turn it for display; it is taken as stored".into())
}

/// The decoders' last check, without [`Image::new`]'s checks of what is already known.
fn finite_image(width: u32, height: u32, channels: Channels, pixels: Pixels) -> Result<Image, String> {
    if let Pixels::F32(samples) = &pixels {
        check_finite(width, channels, samples)?;
    }
    Ok(Image::of(width, height, channels, pixels))
}

/// Divides colours by their alpha, where that is neither 0 nor 1; 8 bits become 16.
fn unassociate(image: Image) -> Image {
    fn divided(samples: &[u16], channels: usize) -> Vec<u16> {
        let texel = |texel: &[u16]| {
            let alpha = u64::from(texel[channels - 1]);
            let color = |c: u16| {
                let quotient = (u64::from(c) * 65535 + alpha / 2).checked_div(alpha);
                quotient.map_or(c, |quotient| quotient.min(65535) as u16)
            };
            let mut out = [0; 4];
            for (o, c) in out.iter_mut().zip(&texel[..channels - 1]) {
                *o = color(*c);
            }
            out[channels - 1] = texel[channels - 1];
            out
        };
        samples.chunks_exact(channels).flat_map(|t| texel(t).into_iter().take(channels)).collect()
    }
    let n = image.channels.count();
    let pixels = match image.pixels {
        _ if n % 2 == 1 => image.pixels,
        Pixels::U8(v) => {
            Pixels::U16(divided(&v.into_iter().map(|s| u16::from(s) * 257).collect::<Vec<_>>(), n))
        }
        Pixels::U16(v) => Pixels::U16(divided(&v, n)),
        Pixels::F32(mut v) => {
            for texel in v.chunks_exact_mut(n) {
                let alpha = texel[n - 1];
                if alpha > 0.0 {
                    for c in &mut texel[..n - 1] {
                        // Over an alpha near 0 a quotient may be beyond all floats.
                        *c = Some(*c / alpha).filter(|c| c.is_finite()).unwrap_or(*c);
                    }
                }
            }
            Pixels::F32(v)
        }
    };
    Image { pixels, ..image }
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

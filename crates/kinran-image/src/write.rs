//! Image files out, and files that appear whole or not at all.

use std::fs::File;
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder,
    WritableImage,
};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};

use crate::{Channels, Error, Image, Pixels};

/// Writes a file by a temporary one in the same folder, flushed to disk and renamed: whatever happens,
/// `path` holds its old content or all of the new, and no temporary file stays behind.
///
/// # Errors
/// [`Error::Io`] naming `path`: the folder is missing or read-only, the disk is full.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// As [`write_atomically`], with content that `write` produces piece by piece.
///
/// # Errors
/// As [`write_atomically`], and whatever `write` returns.
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), Error> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    write_by_rename(folder, path, write)
}

/// As [`write_atomically`], with the temporary file in `scratch`, a folder of the same file system: if the
/// process is killed, nothing strange stays in the folder of `path`.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_atomically_in(scratch: &Path, path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_by_rename(scratch, path, |file| file.write_all(bytes))
}

fn write_by_rename(
    folder: &Path,
    path: &Path,
    write: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
) -> Result<(), Error> {
    let fail = |e| Error::io(path, e);
    if path.is_dir() {
        return Err(fail(io::ErrorKind::IsADirectory.into()));
    }
    let mut builder = tempfile::Builder::new();
    builder.prefix(".kinran-");
    // The default is a private file; this one is meant to be seen, as far as the umask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut temporary = builder.tempfile_in(folder).map_err(|e| {
        // tempfile's own message would name the temporary file.
        fail(e.kind().into())
    })?;

    let mut buffered = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    write(&mut buffered).and_then(|()| buffered.flush()).map_err(fail)?;
    drop(buffered);
    temporary.as_file().sync_all().map_err(fail)?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// Writes an 8- or 16-bit image as PNG, compressed for speed. Appears whole or not at all.
///
/// # Errors
/// [`Error::Unsupported`] for float samples, [`Error::Io`] as [`write_atomically`].
pub fn write_png(path: &Path, image: &Image) -> Result<(), Error> {
    png_color(image)?;
    write_atomically_with(path, |file| encode_png_to(image, file))
}

/// The bytes of an 8- or 16-bit image as PNG, compressed for speed.
///
/// # Errors
/// [`Error::Unsupported`] for float samples.
pub fn encode_png(image: &Image) -> Result<Vec<u8>, Error> {
    png_color(image)?;
    let mut bytes = Vec::new();
    encode_png_to(image, &mut bytes).map_err(|e| Error::Unsupported(e.to_string()))?;
    Ok(bytes)
}

fn png_color(image: &Image) -> Result<ExtendedColorType, Error> {
    Ok(match (&image.pixels, image.channels) {
        (Pixels::U8(_), Channels::R) => ExtendedColorType::L8,
        (Pixels::U8(_), Channels::Rg) => ExtendedColorType::La8,
        (Pixels::U8(_), Channels::Rgb) => ExtendedColorType::Rgb8,
        (Pixels::U8(_), Channels::Rgba) => ExtendedColorType::Rgba8,
        (Pixels::U16(_), Channels::R) => ExtendedColorType::L16,
        (Pixels::U16(_), Channels::Rg) => ExtendedColorType::La16,
        (Pixels::U16(_), Channels::Rgb) => ExtendedColorType::Rgb16,
        (Pixels::U16(_), Channels::Rgba) => ExtendedColorType::Rgba16,
        (Pixels::F32(_), _) => {
            return Err(Error::Unsupported("PNG holds 8- or 16-bit integers, not floats; write EXR".into()));
        }
    })
}

fn encode_png_to(image: &Image, out: &mut impl Write) -> io::Result<()> {
    let color = png_color(image).map_err(io::Error::other)?;
    let samples: &[u8] = match &image.pixels {
        Pixels::U8(v) => v,
        Pixels::U16(v) => bytemuck::cast_slice(v),
        Pixels::F32(v) => bytemuck::cast_slice(v),
    };
    PngEncoder::new_with_quality(out, CompressionType::Fast, FilterType::Adaptive)
        .write_image(samples, image.width, image.height, color)
        .map_err(|e| match e {
            ImageError::IoError(e) => e,
            e => io::Error::other(e),
        })
}

/// Writes a float image as EXR: 32-bit floats, ZIP compression, channels Y, YA, RGB or RGBA. Appears whole
/// or not at all.
///
/// # Errors
/// [`Error::Unsupported`] for integer samples, [`Error::Io`] as [`write_atomically`].
pub fn write_exr(path: &Path, image: &Image) -> Result<(), Error> {
    let Pixels::F32(samples) = &image.pixels else {
        return Err(Error::Unsupported("EXR is written from float samples; write PNG".into()));
    };
    let mut bytes = Cursor::new(Vec::new());
    encode_exr_to(image, samples, &mut bytes).map_err(|e| Error::io(path, e))?;
    write_atomically(path, bytes.get_ref())
}

fn encode_exr_to(image: &Image, samples: &[f32], out: &mut (impl Write + Seek)) -> io::Result<()> {
    let names: &[&str] = match image.channels {
        Channels::R => &["Y"],
        Channels::Rg => &["Y", "A"],
        Channels::Rgb => &["R", "G", "B"],
        Channels::Rgba => &["R", "G", "B", "A"],
    };
    let planes = names.iter().enumerate().map(|(c, &name)| {
        let plane = samples.iter().skip(c).step_by(names.len()).copied().collect();
        AnyChannel::new(name, FlatSamples::F32(plane))
    });
    // Increasing order, or the file would depend on which thread compresses first.
    let encoding = Encoding {
        compression: Compression::ZIP16,
        line_order: LineOrder::Increasing,
        ..Encoding::SMALL_LOSSLESS
    };
    let layer = Layer::new(
        (image.width as usize, image.height as usize),
        LayerAttributes::default(),
        encoding,
        AnyChannels::sort(planes.collect()),
    );
    let result = exr::prelude::Image::from_layer(layer).write().to_buffered(out);
    result.map_err(|e| match e {
        exr::error::Error::Io(e) => e,
        e => io::Error::other(e.to_string()),
    })
}

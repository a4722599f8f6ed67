//! Image files out, and files that appear whole or not at all.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder, Text,
    WritableImage,
};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};
use tempfile::{NamedTempFile, TempDir};

use crate::{Channels, Error, Image, Pixels, Unfinished, make_folder};

/// Writes a file by a temporary one in the same folder, flushed to disk and renamed: whatever happens,
/// `path` holds its old content or all of the new. No temporary file stays behind, but where the process is killed:
/// then the next one that writes into the folder removes it.
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
    // tempfile's own message would name the temporary file.
    let (_unfinished, mut temporary) =
        Unfinished::make(|| temporary_file(folder)).map_err(|e| fail(e.kind().into()))?;

    let mut buffered = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    write(&mut buffered).and_then(|()| buffered.flush()).map_err(fail)?;
    drop(buffered);
    temporary.as_file().sync_all().map_err(fail)?;
    temporary.persist(path).map_err(|e| fail(e.error))?;
    Ok(())
}

/// What the names of temporary files begin and end with, and how many letters and digits are between.
const TEMPORARY: (&str, usize, &str) = (".kinran-", 16, ".part");

/// Whether a file's name is one that [`write_atomically`] gives its temporary files.
pub fn is_temporary(name: &str) -> bool {
    let (prefix, length, suffix) = TEMPORARY;
    let random = name.strip_prefix(prefix).and_then(|name| name.strip_suffix(suffix));
    random.is_some_and(|r| r.len() == length && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// A temporary file that is locked as long as it is open, so that others know that somebody is at work on it.
fn temporary_file(folder: &Path) -> io::Result<NamedTempFile> {
    remove_abandoned(folder);
    let (prefix, length, suffix) = TEMPORARY;
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix).rand_bytes(length).suffix(suffix);
    // The default is a private file; this one is meant to be seen, as far as the umask allows.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        let file = builder.tempfile_in(folder)?;
        // A file system without locks: nobody removes the file there, since nobody can tell.
        let _ = file.as_file().lock();
        // Before it was locked somebody may have taken it for abandoned.
        if file.path().exists() {
            return Ok(file);
        }
    }
}

/// Folders that were looked through for abandoned files.
static LOOKED_THROUGH: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Removes temporary files and folders that nobody is at work on any more; of every folder once.
fn remove_abandoned(folder: &Path) {
    let mut looked_through = LOOKED_THROUGH.lock().unwrap_or_else(PoisonError::into_inner);
    if !looked_through.insert(folder.to_path_buf()) {
        return;
    }
    // What cannot be looked at or removed is none of the caller's troubles.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !entry.file_name().to_str().is_some_and(is_temporary) {
            continue;
        }
        let (path, kind) = (entry.path(), entry.file_type());
        let is_free =
            |lock: &Path| File::options().write(true).open(lock).is_ok_and(|file| file.try_lock().is_ok());
        match kind {
            Ok(kind) if kind.is_file() && is_free(&path) => drop(fs::remove_file(path)),
            Ok(kind) if kind.is_dir() && is_free(&path.join(LOCK)) => drop(fs::remove_dir_all(path)),
            _ => {}
        }
    }
}

/// The file in a [`Staging`] that is locked as long as somebody is at work there.
const LOCK: &str = "lock";

/// Files of one piece of work, which appear when all of them are there: until [`Staging::publish`] they lie in a folder of
/// their own, which goes with this value. If the process is killed, the next one that writes into the folder removes it.
#[derive(Debug)]
pub struct Staging {
    folder: PathBuf,
    /// Paths from the folder, in the order in which the files came.
    files: Vec<PathBuf>,
    _lock: File,
    work: TempDir,
    _unfinished: Unfinished,
}

impl Staging {
    /// Begins a piece of work whose files go to a folder, which is made.
    ///
    /// # Errors
    /// [`Error::Io`] naming the folder.
    pub fn new(folder: &Path) -> Result<Staging, Error> {
        let fail = |e: io::Error| Error::io(folder, e.kind().into());
        make_folder(folder)?;
        remove_abandoned(folder);
        let (prefix, length, suffix) = TEMPORARY;
        let make =
            || tempfile::Builder::new().prefix(prefix).rand_bytes(length).suffix(suffix).tempdir_in(folder);
        loop {
            let (unfinished, work) = Unfinished::make(make).map_err(fail)?;
            let lock = File::create(work.path().join(LOCK)).map_err(fail)?;
            let _ = lock.lock();
            // Before it was locked somebody may have taken it for abandoned.
            if work.path().join(LOCK).exists() {
                let folder = folder.to_path_buf();
                return Ok(Staging { folder, files: Vec::new(), _lock: lock, work, _unfinished: unfinished });
            }
        }
    }

    /// Takes a file, flushed to disk; `name` is its path from the folder, without `..`. One of that name is replaced.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file as it will be: there is a folder in its place, the disk is full.
    pub fn put(&mut self, name: &Path, bytes: &[u8]) -> Result<(), Error> {
        let path = self.folder.join(name);
        let fail = |e| Error::io(&path, e);
        if path.is_dir() {
            return Err(fail(io::ErrorKind::IsADirectory.into()));
        }
        let staged = self.place(name);
        fs::create_dir_all(staged.parent().unwrap_or(&self.folder)).map_err(fail)?;
        let mut file = File::create(&staged).map_err(fail)?;
        file.write_all(bytes).and_then(|()| file.sync_all()).map_err(fail)?;
        self.files.retain(|known| known != name);
        self.files.push(name.to_path_buf());
        Ok(())
    }

    /// Where a file lies that was taken; `None` of others.
    pub fn find(&self, name: &Path) -> Option<PathBuf> {
        self.files.iter().any(|known| known == name).then(|| self.place(name))
    }

    fn place(&self, name: &Path) -> PathBuf {
        self.work.path().join("files").join(name)
    }

    /// Moves the files to where they belong, in the order in which they came, each by a rename.
    ///
    /// # Errors
    /// [`Error::Io`] naming a file that cannot be moved; those before it are.
    pub fn publish(self) -> Result<(), Error> {
        for name in &self.files {
            let path = self.folder.join(name);
            make_folder(path.parent().unwrap_or(&self.folder))?;
            fs::rename(self.place(name), &path).map_err(|e| Error::io(&path, e))?;
        }
        Ok(())
    }
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

/// Writes a float image as EXR: 32-bit floats, ZIP compression, channels Y, YA, RGB or RGBA, colours multiplied by their
/// alpha as EXR has them. Appears whole or not at all.
///
/// # Errors
/// [`Error::Unsupported`] for integer samples, [`Error::Io`] as [`write_atomically`].
pub fn write_exr(path: &Path, image: &Image) -> Result<(), Error> {
    let Pixels::F32(samples) = &image.pixels else {
        return Err(Error::Unsupported("EXR is written from float samples; write PNG".into()));
    };
    let names: &[&str] = match image.channels {
        Channels::R => &["Y"],
        Channels::Rg => &["Y", "A"],
        Channels::Rgb => &["R", "G", "B"],
        Channels::Rgba => &["R", "G", "B", "A"],
    };
    let n = names.len();
    let plane = |c: usize| {
        let associated =
            |texel: &[f32]| if n.is_multiple_of(2) && c < n - 1 { texel[c] * texel[n - 1] } else { texel[c] };
        samples.chunks_exact(n).map(associated).collect()
    };
    let planes = names.iter().enumerate().map(|(c, &name)| (name, plane(c))).collect();
    write_exr_planes(path, (image.width, image.height), planes)
}

/// Writes channels of any names as EXR, as [`write_exr`] does; each of `width * height` floats.
///
/// # Errors
/// [`Error::Io`] as [`write_atomically`].
pub fn write_exr_planes(path: &Path, size: (u32, u32), planes: Vec<(&str, Vec<f32>)>) -> Result<(), Error> {
    let mut bytes = Cursor::new(Vec::new());
    encode_exr_to(size, planes, &mut bytes).map_err(|e| Error::io(path, e))?;
    write_atomically(path, bytes.get_ref())
}

/// The bytes that [`write_exr_planes`] writes.
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses.
pub fn encode_exr_planes(size: (u32, u32), planes: Vec<(&str, Vec<f32>)>) -> Result<Vec<u8>, Error> {
    let mut bytes = Cursor::new(Vec::new());
    encode_exr_to(size, planes, &mut bytes).map_err(|e| Error::Unsupported(format!("EXR: {e}")))?;
    Ok(bytes.into_inner())
}

fn encode_exr_to(
    size: (u32, u32),
    planes: Vec<(&str, Vec<f32>)>,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    let planes = planes.into_iter().map(|(name, plane)| AnyChannel::new(name, FlatSamples::F32(plane)));
    // Increasing order, or the file would depend on which thread compresses first.
    let encoding = Encoding {
        compression: Compression::ZIP16,
        line_order: LineOrder::Increasing,
        ..Encoding::SMALL_LOSSLESS
    };
    let layer = Layer::new(
        (size.0 as usize, size.1 as usize),
        LayerAttributes { software_name: Text::new_or_none("Kinran"), ..LayerAttributes::default() },
        encoding,
        AnyChannels::sort(planes.collect()),
    );
    let result = exr::prelude::Image::from_layer(layer).write().to_buffered(out);
    result.map_err(|e| match e {
        exr::error::Error::Io(e) => e,
        e => io::Error::other(e.to_string()),
    })
}

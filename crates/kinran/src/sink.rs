//! Where files go: a folder on a disk, or memory.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use kinran_bake::cache::relative;
use kinran_image::{Format, Memory, Staging, full_level_count, level_size};
use schemars::JsonSchema;
use serde::Serialize;

use crate::Error;
use crate::options::Container;

/// Takes the files of a task. Names are relative and `/`-separated.
pub trait Sink: Sync {
    /// Is asked once, before long work, with every name that may be written and the space that it may take: the place to
    /// refuse. Nothing is refused by default.
    ///
    /// # Errors
    /// Whatever the destination has against it, as [`Error::Refused`].
    fn expect(&self, names: &[String], space: Space) -> Result<(), Error> {
        let _ = (names, space);
        Ok(())
    }

    /// Takes a file, whole or not at all; one of that name is replaced, at the latest by [`Sink::finish`].
    ///
    /// # Errors
    /// Where it cannot be written.
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), Error>;

    /// Hears that the files so far are all of a piece of work, a report and what it names: of what is stopped before, or fails,
    /// a destination may show nothing. Whoever puts files calls it.
    ///
    /// # Errors
    /// Where they cannot be written.
    fn finish(&self) -> Result<(), Error> {
        Ok(())
    }

    /// The file of a name, where there is one: what was put, or what an earlier run wrote. Asked at any time, also before
    /// [`Sink::expect`].
    fn get(&self, name: &str) -> Option<Vec<u8>>;

    /// Where a name is, in the words of [`Files::place`](crate::Files::place); `None` where nothing that is read can be
    /// there.
    fn place(&self, name: &str) -> Option<PathBuf>;

    /// Whether it is a folder of the system's disk: what lies beside a model there need not be written again.
    fn is_on_disk(&self) -> bool;
}

/// A folder on a disk. It is made when the first file comes. The files of a piece of work lie aside until
/// [`Sink::finish`], and appear one after the other, by rename; those of a piece that never finishes go with this value.
#[derive(Debug)]
#[non_exhaustive]
pub struct OutputFolder {
    /// Its path.
    pub path: PathBuf,
    staging: Mutex<Option<Staging>>,
}

impl OutputFolder {
    /// The folder at a path.
    pub fn new(path: impl AsRef<Path>) -> Self {
        OutputFolder { path: path.as_ref().to_path_buf(), staging: Mutex::new(None) }
    }

    fn staging(&self) -> MutexGuard<'_, Option<Staging>> {
        self.staging.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The place of a name, if something is there.
pub(crate) fn place_in(out: &dyn Sink, name: &str) -> Option<PathBuf> {
    let place = out.place(name)?;
    Some(place.canonicalize().unwrap_or(place))
}

impl Sink for OutputFolder {
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        let Some(name) = relative(name) else {
            let reason =
                format!("{name}: leads out of the folder {}; write it elsewhere", self.path.display());
            return Err(kinran_image::Error::Unsupported(reason).into());
        };
        let mut staging = self.staging();
        let staging = match &mut *staging {
            Some(staging) => staging,
            none => none.insert(Staging::new(&self.path)?),
        };
        Ok(staging.put(&name, bytes)?)
    }

    fn finish(&self) -> Result<(), Error> {
        match self.staging().take() {
            Some(staging) => Ok(staging.publish()?),
            None => Ok(()),
        }
    }

    fn get(&self, name: &str) -> Option<Vec<u8>> {
        let name = relative(name)?;
        let staged = self.staging().as_ref().and_then(|staging| staging.find(&name));
        let path = staged.unwrap_or_else(|| self.path.join(name));
        path.is_file().then(|| std::fs::read(path).ok())?
    }

    fn place(&self, name: &str) -> Option<PathBuf> {
        Some(self.path.join(name))
    }

    fn is_on_disk(&self) -> bool {
        true
    }
}

impl Sink for Memory {
    fn put(&self, name: &str, bytes: &[u8]) -> Result<(), Error> {
        self.insert(name, bytes);
        Ok(())
    }

    fn get(&self, name: &str) -> Option<Vec<u8>> {
        Memory::get(self, name).map(|bytes| bytes.to_vec())
    }

    fn place(&self, name: &str) -> Option<PathBuf> {
        Some(self.place_of(Path::new(name)))
    }

    fn is_on_disk(&self) -> bool {
        false
    }
}

/// Bytes that files will take, as far as that can be told before they are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Space {
    /// They take no less.
    pub least: u64,
    /// They take no more, but for small files such as reports.
    pub most: u64,
}

/// What Zstandard leaves of a mip chain at least, as one over this; chosen by eye: BC7 of smooth maps keeps an eighth.
const ZSTD_LEAST: u64 = 16;

impl Space {
    /// That of files whose size is known.
    pub fn exact(bytes: u64) -> Self {
        Space { least: bytes, most: bytes }
    }

    /// That of a texture with all its mips; `zstd` is the level of KTX2 files, 0 for none.
    pub fn of_texture(container: Container, zstd: i32, format: Format, (width, height): (u32, u32)) -> Self {
        let levels = 0..full_level_count(width, height);
        let chain =
            levels.map(|level| format.level_bytes(level_size(width, level), level_size(height, level)));
        let chain = chain.sum::<usize>() as u64;
        let mut space = Space::default();
        for extension in container.extensions() {
            let shrinks = *extension == "ktx2" && zstd > 0;
            space.add(Space { least: if shrinks { chain / ZSTD_LEAST } else { chain }, most: chain });
        }
        space
    }

    /// What is needed where files of so many bytes make room.
    pub fn beyond(self, replaced: u64) -> Self {
        Space { least: self.least.saturating_sub(replaced), most: self.most.saturating_sub(replaced) }
    }

    /// Adds that of other files.
    pub fn add(&mut self, other: Space) {
        self.least += other.least;
        self.most += other.most;
    }
}

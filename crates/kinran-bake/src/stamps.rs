//! Hashes of files, remembered for as long as the files look the same.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use kinran_image::{Error, write_atomically};
use serde::{Deserialize, Serialize};

use crate::cache::hash_file;

/// Coarsest clock of a file system in use (FAT: 2 s). A file that was changed so shortly before it was hashed may
/// be changed again without looking so.
const CLOCK_STEP: Duration = Duration::from_secs(2);

/// What a file looks like from outside.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    bytes: u64,
    /// Nanoseconds since 1970; 0 where the system does not tell.
    modified: u64,
    /// 0 where the system has none.
    inode: u64,
}

impl Stamp {
    /// The stamp of a regular file; nothing where there is none.
    pub fn of(path: &Path) -> Option<Stamp> {
        let metadata = fs::metadata(path).ok()?;
        metadata.is_file().then(|| Stamp::from(&metadata))
    }

    /// Whether the file was changed so shortly before `now` that it may change again without looking so.
    fn is_fresh(&self, now: SystemTime) -> bool {
        let modified = UNIX_EPOCH + Duration::from_nanos(self.modified);
        now.duration_since(modified).map_or(true, |age| age < CLOCK_STEP)
    }
}

impl From<&Metadata> for Stamp {
    fn from(metadata: &Metadata) -> Stamp {
        #[cfg(unix)]
        let inode = std::os::unix::fs::MetadataExt::ino(metadata);
        #[cfg(not(unix))]
        let inode = 0;
        let modified = metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let modified = modified.map_or(0, |time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
        Stamp { bytes: metadata.len(), modified, inode }
    }
}

/// A file's hash, the stamp it had then, and the files that it refers to.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Seen {
    stamp: Stamp,
    blake3: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    refers_to: Option<Vec<PathBuf>>,
}

/// Hashes by path; shared by threads.
#[derive(Debug, Default)]
pub struct Stamps {
    seen: Mutex<BTreeMap<PathBuf, Seen>>,
}

impl Stamps {
    /// What was saved at `path`; nothing where there is no such file or it is damaged, which costs time only.
    pub fn load(path: &Path) -> Stamps {
        let seen = fs::read(path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        Stamps { seen: Mutex::new(seen.unwrap_or_default()) }
    }

    /// Saves what is known.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        let json = serde_json::to_vec(&*self.lock()).map_err(|e| Error::io(path, e.into()))?;
        write_atomically(path, &json)
    }

    /// BLAKE3 of a file as hexadecimal digits; it is read only if it looks other than when it was last read.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn hash(&self, path: &Path) -> Result<String, Error> {
        let stamp = Stamp::of(path);
        let known = self.lock().get(path).filter(|seen| Some(&seen.stamp) == stamp.as_ref()).cloned();
        if let Some(seen) = known {
            return Ok(seen.blake3);
        }
        let now = SystemTime::now();
        let (_, blake3) = hash_file(path)?;
        if let Some(stamp) = stamp.filter(|stamp| !stamp.is_fresh(now)) {
            self.lock().insert(path.into(), Seen { stamp, blake3: blake3.clone(), refers_to: None });
        }
        Ok(blake3)
    }

    /// The files that a file refers to, as `read` finds them; `read` is asked only if the file looks other than
    /// when it was last asked.
    ///
    /// # Errors
    /// Whatever `read` returns, and [`Error::Io`] as an `E`.
    pub fn refers_to<E: From<Error>>(
        &self,
        path: &Path,
        read: impl FnOnce() -> Result<Vec<PathBuf>, E>,
    ) -> Result<Vec<PathBuf>, E> {
        let blake3 = self.hash(path)?;
        let known =
            self.lock().get(path).filter(|seen| seen.blake3 == blake3).and_then(|s| s.refers_to.clone());
        if let Some(files) = known {
            return Ok(files);
        }
        let files = read()?;
        if let Some(seen) = self.lock().get_mut(path).filter(|seen| seen.blake3 == blake3) {
            seen.refers_to = Some(files.clone());
        }
        Ok(files)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<PathBuf, Seen>> {
        self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

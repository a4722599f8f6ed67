//! Hashes of files, remembered for as long as the files look the same.
//!
//! ```
//! use kinran_bake::stamps::Stamps;
//!
//! let folder = tempfile::tempdir()?;
//! let file = folder.path().join("map.png");
//! std::fs::write(&file, "texels")?;
//! let stamps = Stamps::default();
//! assert_eq!(stamps.hash(&file)?, stamps.hash(&file)?, "the second time by the file's date and size");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use std::collections::BTreeMap;
use std::fs::{self, File, Metadata};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use kinran_image::{Error, write_atomically};
use serde::{Deserialize, Serialize};

use crate::cache::hash_open;

/// Coarsest clock of a file system in use (FAT: 2 s). A file that was changed so shortly before it was hashed may
/// be changed again without looking so.
const CLOCK_STEP: Duration = Duration::from_secs(2);

/// What a file looks like from outside.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Stamp {
    bytes: u64,
    /// Nanoseconds since 1970; 0 where the system does not tell.
    modified: u64,
    /// Nanoseconds since 1970 at which the content or what is known of the file changed last, which nobody can set back; 0
    /// where the system does not tell.
    #[serde(default)]
    changed: u64,
    /// 0 where the system has none.
    inode: u64,
}

impl Stamp {
    /// The stamp of a regular file; nothing where there is none.
    pub fn of(path: &Path) -> Option<Stamp> {
        let metadata = fs::metadata(path).ok()?;
        metadata.is_file().then(|| Stamp::from(&metadata))
    }

    /// Whether the content looks as it did; the file may have been renamed meanwhile.
    pub fn has_content_of(&self, other: &Stamp) -> bool {
        (self.bytes, self.modified) == (other.bytes, other.modified)
    }

    /// Whether the file was changed so shortly before `now` that it may change again without looking so.
    fn is_fresh(&self, now: SystemTime) -> bool {
        // One that was copied here with its old time was changed when it came.
        let latest = UNIX_EPOCH + Duration::from_nanos(self.modified.max(self.changed));
        now.duration_since(latest).map_or(true, |age| age < CLOCK_STEP)
    }
}

impl From<&Metadata> for Stamp {
    fn from(metadata: &Metadata) -> Stamp {
        #[cfg(unix)]
        let (inode, changed) = {
            use std::os::unix::fs::MetadataExt;
            let nanoseconds =
                i128::from(metadata.ctime()) * 1_000_000_000 + i128::from(metadata.ctime_nsec());
            (metadata.ino(), u64::try_from(nanoseconds).unwrap_or(0))
        };
        #[cfg(not(unix))]
        let (inode, changed) = (0, 0);
        let modified = metadata.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        let modified = modified.map_or(0, |time| u64::try_from(time.as_nanos()).unwrap_or(u64::MAX));
        Stamp { bytes: metadata.len(), modified, changed, inode }
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
    is_news: AtomicBool,
}

impl Stamps {
    /// What was saved at `path`; nothing where there is no such file or it is damaged, which costs time only.
    pub fn load(path: &Path) -> Stamps {
        let seen = fs::read(path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
        Stamps { seen: Mutex::new(seen.unwrap_or_default()), is_news: AtomicBool::new(false) }
    }

    /// Saves what is known, if that is more than what was loaded or saved last.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<(), Error> {
        if !self.is_news.swap(false, Ordering::Relaxed) {
            return Ok(());
        }
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
        let fail = |e| Error::io(path, e);
        let now = SystemTime::now();
        let mut file = File::open(path).map_err(fail)?;
        let before = Stamp::from(&file.metadata().map_err(fail)?);
        let (_, blake3) = hash_open(&mut file).map_err(fail)?;
        // What is remembered of a path must be what was read, though others may save or rename files meanwhile.
        let stayed = file.metadata().is_ok_and(|after| Stamp::from(&after) == before);
        if stayed && Stamp::of(path).as_ref() == Some(&before) && !before.is_fresh(now) {
            self.remember(path, Seen { stamp: before, blake3: blake3.clone(), refers_to: None });
        }
        Ok(blake3)
    }

    /// The files that a file refers to, as `read` finds them in its bytes; `read` is asked only if the file looks other
    /// than when it was last asked.
    ///
    /// # Errors
    /// Whatever `read` returns, and [`Error::Io`] as an `E`.
    pub fn refers_to<E: From<Error>>(
        &self,
        path: &Path,
        read: impl FnOnce(&[u8]) -> Result<Vec<PathBuf>, E>,
    ) -> Result<Vec<PathBuf>, E> {
        let hash = self.hash(path)?;
        let known = self.lock().get(path).filter(|seen| seen.blake3 == hash).cloned();
        if let Some(files) = known.as_ref().and_then(|seen| seen.refers_to.clone()) {
            return Ok(files);
        }
        let bytes = fs::read(path).map_err(|e| Error::io(path, e))?;
        let files = read(&bytes)?;
        if let Some(seen) = known.filter(|seen| seen.blake3 == blake3::hash(&bytes).to_hex().as_str()) {
            self.remember(path, Seen { refers_to: Some(files.clone()), ..seen });
        }
        Ok(files)
    }

    fn remember(&self, path: &Path, seen: Seen) {
        self.lock().insert(path.into(), seen);
        self.is_news.store(true, Ordering::Relaxed);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, BTreeMap<PathBuf, Seen>> {
        self.seen.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

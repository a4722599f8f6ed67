//! Files and folders that are not finished yet, known to the whole process, so that one that is interrupted takes them
//! away.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// As long as it lives, its file or folder counts as unfinished.
#[derive(Debug)]
pub struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes a file or folder that is unfinished from its first moment on. Keep the first of the two for longer than the
    /// second.
    ///
    /// # Errors
    /// What `make` returns.
    pub fn make<T: AsRef<Path>>(make: impl FnOnce() -> io::Result<T>) -> io::Result<(Unfinished, T)> {
        let mut unfinished = lock();
        let made = make()?;
        unfinished.insert(made.as_ref().to_path_buf());
        let guard = Unfinished(made.as_ref().to_path_buf());
        Ok((guard, made))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        lock().remove(&self.0);
    }
}

/// Removes all that is unfinished. From then on whoever begins or ends something new waits for ever: nothing but the end
/// of the process may follow.
pub fn remove_unfinished() {
    let unfinished = lock();
    for path in unfinished.iter() {
        // Who writes into a folder at this moment may be faster once or twice.
        for _ in 0..5 {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            if removed.is_ok() || !path.exists() {
                break;
            }
        }
    }
    std::mem::forget(unfinished);
}

fn lock() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

//! Files and folders that are not finished yet, known to the whole process, so that one that is interrupted takes them
//! away.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::Error;

static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Folders that [`make_folder`] made, those above others first.
static MADE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

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
        let mut unfinished = lock(&UNFINISHED);
        let made = make()?;
        unfinished.insert(made.as_ref().to_path_buf());
        let guard = Unfinished(made.as_ref().to_path_buf());
        Ok((guard, made))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        lock(&UNFINISHED).remove(&self.0);
    }
}

/// Makes a folder, and those above it that are not there.
///
/// # Errors
/// [`Error::Io`] where that cannot be.
pub fn make_folder(path: impl AsRef<Path>) -> Result<(), Error> {
    let path = path.as_ref();
    let mut made = lock(&MADE);
    let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
    let missing: Vec<&Path> = path.ancestors().take_while(is_missing).collect();
    let result = fs::create_dir_all(path).map_err(|e| Error::io(path, e));
    made.extend(missing.into_iter().rev().map(Path::to_path_buf));
    result
}

/// Removes those of the folders that [`make_folder`] made in which nothing stands: work that failed leaves none behind.
pub fn remove_empty_folders() {
    remove_empty(&lock(&MADE));
}

fn remove_empty(made: &[PathBuf]) {
    for folder in made.iter().rev() {
        // One that holds something is refused by the system.
        let _ = fs::remove_dir(folder);
    }
}

/// Removes all that is unfinished, and folders that are still empty. From then on whoever begins or ends something new
/// waits for ever: nothing but the end of the process may follow.
pub fn remove_unfinished() {
    let (unfinished, made) = (lock(&UNFINISHED), lock(&MADE));
    for path in unfinished.iter() {
        // Who writes into a folder at this moment may be faster once or twice.
        for _ in 0..5 {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            if removed.is_ok() || !path.exists() {
                break;
            }
        }
    }
    remove_empty(&made);
    std::mem::forget((unfinished, made));
}

fn lock<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

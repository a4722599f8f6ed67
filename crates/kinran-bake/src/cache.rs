//! Finished work, kept by what it was made from: a key is the hash of inputs, options and version.
//!
//! ```text
//! CACHE/entries/<key>/entry.json     what the entry holds, written before the folder gets its name
//! CACHE/entries/<key>/files/…        the files
//! CACHE/work/<random>/               folders of work that is not finished, each with a locked file beside it
//! ```
//!
//! An entry appears by one rename of its folder, whole, and goes by one; nothing is ever changed in place.
//! So any number of processes may share a cache, and one that dies at any moment leaves at most a work folder,
//! which the next to come removes: the lock tells that its owner is gone. Files are hashed again as they are
//! taken out; a damaged entry counts as none.

use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use kinran_image::{Error, write_atomically};
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

/// What an entry is found by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key(blake3::Hash);

impl Key {
    /// The key of work that is determined by these parts; their lengths are hashed too, so that no two lists of
    /// parts run together.
    pub fn new<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> Key {
        let mut hasher = blake3::Hasher::new();
        for part in parts {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        Key(hasher.finalize())
    }

    /// 64 hexadecimal digits.
    pub fn hex(&self) -> String {
        self.0.to_hex().to_string()
    }
}

/// A file of an entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredFile {
    /// Relative to the entry's folder, `/`-separated.
    pub name: String,
    /// Its size.
    pub bytes: u64,
    /// BLAKE3 of its bytes.
    pub blake3: String,
}

/// Finished work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// For people: what it was made from.
    pub name: String,
    /// The files, by name.
    pub files: Vec<StoredFile>,
    /// What the work reported.
    pub report: serde_json::Value,
}

/// An entry as [`Cache::list`] sees it.
#[derive(Clone, Debug, Serialize)]
pub struct Listed {
    /// Its key's digits.
    pub key: String,
    /// What it was made from.
    pub name: String,
    /// Files.
    pub files: usize,
    /// Bytes of its files.
    pub bytes: u64,
    /// Seconds since it was last used.
    pub idle_seconds: u64,
    #[serde(skip)]
    used: Option<SystemTime>,
}

/// A folder of finished work.
#[derive(Clone, Debug)]
pub struct Cache {
    root: PathBuf,
}

const ENTRY: &str = "entry.json";
const FILES: &str = "files";

impl Cache {
    /// The cache in a folder, which is made when there is something to keep.
    pub fn new(root: &Path) -> Cache {
        Cache { root: root.to_path_buf() }
    }

    /// Its folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// A folder for work that is to become an entry.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn work_folder(&self) -> Result<WorkFolder, Error> {
        let entries = self.root.join("entries");
        fs::create_dir_all(&entries).map_err(|e| Error::io(&entries, e))?;
        let work = WorkFolder::new(&self.root)?;
        let files = work.path().join(FILES);
        fs::create_dir(&files).map_err(|e| Error::io(&files, e))?;
        Ok(work)
    }

    /// Makes the files in [`files_of`] a work folder an entry. Where another process was faster its entry stays,
    /// which holds the same.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn publish(
        &self,
        key: &Key,
        work: WorkFolder,
        name: &str,
        report: serde_json::Value,
    ) -> Result<Entry, Error> {
        let mut files = Vec::new();
        list_files(&files_of(&work), "", &mut files)?;
        files.sort_by(|a, b| a.name.cmp(&b.name));
        let entry = Entry { name: name.into(), files, report };
        let json = serde_json::to_vec(&entry).map_err(|e| Error::io(&self.root, e.into()))?;
        write_atomically(&work.path().join(ENTRY), &json)?;
        let home = self.home(key);
        match fs::rename(work.path(), &home) {
            Err(_) if home.join(ENTRY).is_file() => {}
            other => other.map_err(|e| Error::io(&home, e))?,
        }
        Ok(entry)
    }

    /// The entry of a key, marked as used now.
    pub fn get(&self, key: &Key) -> Option<Entry> {
        let path = self.home(key).join(ENTRY);
        let entry = serde_json::from_slice(&fs::read(&path).ok()?).ok()?;
        // Where this fails the entry is evicted earlier than it need be.
        let _ =
            File::options().append(true).open(&path).and_then(|file| file.set_modified(SystemTime::now()));
        Some(entry)
    }

    /// A file of an entry; nothing where it is gone or damaged.
    pub fn read(&self, key: &Key, file: &StoredFile) -> Option<Vec<u8>> {
        let bytes = fs::read(self.home(key).join(FILES).join(relative(&file.name)?)).ok()?;
        (blake3::hash(&bytes).to_hex().as_str() == file.blake3).then_some(bytes)
    }

    /// Removes the entry of a key, if there is one.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn remove(&self, key: &Key) -> Result<(), Error> {
        self.remove_folder(&self.home(key))
    }

    /// All entries, the one used last first.
    ///
    /// # Errors
    /// [`Error::Io`] where the folder cannot be read.
    pub fn list(&self) -> Result<Vec<Listed>, Error> {
        let folder = self.root.join("entries");
        let mut all = Vec::new();
        let homes = match fs::read_dir(&folder) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(all),
            other => other.map_err(|e| Error::io(&folder, e))?,
        };
        for home in homes {
            let home = home.map_err(|e| Error::io(&folder, e))?.path();
            let path = home.join(ENTRY);
            let entry: Option<Entry> = fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok());
            let used = fs::metadata(&path).and_then(|m| m.modified()).ok();
            let idle = used.and_then(|used| SystemTime::now().duration_since(used).ok()).unwrap_or_default();
            all.push(Listed {
                key: home.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default(),
                name: entry.as_ref().map_or("damaged".into(), |entry| entry.name.clone()),
                files: entry.as_ref().map_or(0, |entry| entry.files.len()),
                bytes: entry.as_ref().map_or(0, |entry| entry.files.iter().map(|f| f.bytes).sum()),
                idle_seconds: idle.as_secs(),
                used,
            });
        }
        all.sort_by(|a, b| b.used.cmp(&a.used).then(a.key.cmp(&b.key)));
        Ok(all)
    }

    /// Removes the entries that were not used for longest until the rest fit into `limit` bytes; tells how many
    /// went and their bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn evict(&self, limit: u64) -> Result<(usize, u64), Error> {
        let mut kept = 0;
        let (mut count, mut bytes) = (0, 0);
        for entry in self.list()? {
            if entry.files > 0 && kept + entry.bytes <= limit {
                kept += entry.bytes;
                continue;
            }
            self.remove_folder(&self.root.join("entries").join(&entry.key))?;
            count += 1;
            bytes += entry.bytes;
        }
        Ok((count, bytes))
    }

    fn home(&self, key: &Key) -> PathBuf {
        self.root.join("entries").join(key.hex())
    }

    /// Takes an entry's name away first, so that nobody finds half of it.
    fn remove_folder(&self, home: &Path) -> Result<(), Error> {
        if !home.exists() {
            return Ok(());
        }
        let trash = WorkFolder::new(&self.root)?;
        match fs::rename(home, trash.path().join("entry")) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other.map_err(|e| Error::io(home, e)),
        }
    }
}

/// Where the files of an entry that is being made go.
pub fn files_of(work: &WorkFolder) -> PathBuf {
    work.path().join(FILES)
}

/// A folder for files that are not finished, `ROOT/work/<random>`. It goes when this is dropped; if the process
/// dies, when the next one makes its own.
#[derive(Debug)]
pub struct WorkFolder {
    folder: TempDir,
    lock_path: PathBuf,
    _lock: File,
}

impl WorkFolder {
    /// Makes a folder under `root`, and removes those whose owners are gone.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(root: &Path) -> Result<WorkFolder, Error> {
        let work = root.join("work");
        let fail = |e| Error::io(&work, e);
        fs::create_dir_all(&work).map_err(fail)?;
        // Between making a folder's lock and locking it nobody may look for abandoned ones.
        let gate = File::create(work.join("gate")).map_err(fail)?;
        gate.lock().map_err(fail)?;
        remove_abandoned(&work).map_err(fail)?;
        let folder = TempDir::new_in(&work).map_err(fail)?;
        let lock_path = folder.path().with_extension("lock");
        let lock = File::create(&lock_path).map_err(fail)?;
        lock.lock().map_err(fail)?;
        Ok(WorkFolder { folder, lock_path, _lock: lock })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for WorkFolder {
    fn drop(&mut self) {
        // What cannot be removed now is removed as abandoned.
        let _ = fs::remove_dir_all(self.folder.path());
        let _ = fs::remove_file(&self.lock_path);
    }
}

/// Removes folders and locks whose owner is gone. A process may die with either of the two alone: its folder has become
/// an entry, or is removed first.
fn remove_abandoned(work: &Path) -> io::Result<()> {
    for entry in fs::read_dir(work)? {
        let path = entry?.path();
        let (folder, lock_path) = if path.is_dir() {
            (path.clone(), path.with_extension("lock"))
        } else if path.extension().is_some_and(|extension| extension == "lock") {
            (path.with_extension(""), path)
        } else {
            continue;
        };
        let owned = match File::options().write(true).open(&lock_path) {
            Ok(lock) => lock.try_lock().is_err(),
            Err(_) => false,
        };
        if !owned {
            // Another process may be removing it too.
            let _ = fs::remove_dir_all(&folder);
            let _ = fs::remove_file(&lock_path);
        }
    }
    Ok(())
}

/// The files under a folder, with their names relative to it.
fn list_files(folder: &Path, prefix: &str, files: &mut Vec<StoredFile>) -> Result<(), Error> {
    for entry in fs::read_dir(folder).map_err(|e| Error::io(folder, e))? {
        let entry = entry.map_err(|e| Error::io(folder, e))?;
        let path = entry.path();
        let Some(name) = entry.file_name().to_str().map(|name| format!("{prefix}{name}")) else {
            let reason = io::Error::other("a file's name is not UTF-8; rename it");
            return Err(Error::io(&path, reason));
        };
        if path.is_dir() {
            list_files(&path, &format!("{name}/"), files)?;
        } else {
            let (bytes, blake3) = hash_file(&path)?;
            files.push(StoredFile { name, bytes, blake3 });
        }
    }
    Ok(())
}

/// Size of a file and BLAKE3 of its bytes as hexadecimal digits.
///
/// # Errors
/// [`Error::Io`].
pub fn hash_file(path: &Path) -> Result<(u64, String), Error> {
    let fail = |e| Error::io(path, e);
    let mut hasher = blake3::Hasher::new();
    let mut file = File::open(path).map_err(fail)?;
    hasher.update_reader(&mut file).map_err(fail)?;
    Ok((hasher.count(), hasher.finalize().to_hex().to_string()))
}

/// The path that a stored name means, if it stays where it belongs.
pub fn relative(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(name);
    path.components().all(|c| matches!(c, Component::Normal(_))).then_some(path)
}

//! Finished work, kept by what it was made from: a key is the hash of inputs, options and version.
//!
//! ```text
//! CACHE/CACHEDIR.TAG                 says whose folder it is
//! CACHE/entries/<key>/entry.json     what the entry holds, written before the folder gets its name
//! CACHE/entries/<key>/files/…        the files
//! CACHE/work/kinran-<random>/        folders of work that is not finished, each with a locked file beside it
//! ```
//!
//! An entry appears by one rename of its folder, whole, and goes by one; nothing is ever changed in place.
//! So any number of processes may share a cache, and one that dies at any moment leaves at most a work folder,
//! which the next to come removes: the lock tells that its owner is gone. Files are hashed again as they are
//! taken out; a damaged entry counts as none.
//!
//! Nothing but such entries and work folders is ever removed, whatever else somebody puts beside them, and no link is
//! followed. A folder that holds something else and no tag is no cache.

use std::fs::{self, File};
use std::io;
use std::path::{Component, Path, PathBuf};
use std::time::SystemTime;

use kinran_image::{Error, Unfinished, is_temporary, write_atomically};
use schemars::JsonSchema;
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
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Debug, Serialize, JsonSchema)]
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
const ENTRIES: &str = "entries";
const WORK: &str = "work";
const GATE: &str = "gate";
const TAG: &str = "CACHEDIR.TAG";

/// The line of the tag that is ours; the line before it is everybody's (Cache Directory Tagging Specification,
/// <https://bford.info/cachedir/>), and tells backups to leave the folder out.
const OURS: &str = "# Kinran keeps finished work in this folder; all of it can be made again.";
const SIGNATURE: &str = "Signature: 8a477f597d28d172789f06886806bc55";

impl Cache {
    /// The cache in a folder, which is made when there is something to keep.
    ///
    /// # Errors
    /// [`Error::Malformed`] for a folder that holds other things.
    pub fn open(root: &Path) -> Result<Cache, Error> {
        if Cache::is_cache(root) || holds_nothing_else(root) {
            return Ok(Cache { root: root.to_path_buf() });
        }
        Err(Error::malformed(
            root,
            "is neither empty nor a cache of kinran; name another folder for the cache",
        ))
    }

    /// Whether a folder is a cache that was used.
    pub fn is_cache(root: &Path) -> bool {
        let tag = fs::read_to_string(root.join(TAG)).unwrap_or_default();
        let tagged = tag.starts_with(SIGNATURE) && tag.lines().any(|line| line == OURS);
        // Earlier versions wrote no tag.
        tagged || (root.join(WORK).join(GATE).is_file() && holds_nothing_else(root))
    }

    /// Its folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Makes the folder, and finds out whether it can be written to.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn prepare(&self) -> Result<(), Error> {
        fs::create_dir_all(&self.root).map_err(|e| Error::io(&self.root, e))?;
        let tag = self.root.join(TAG);
        if !tag.exists() {
            write_atomically(&tag, format!("{SIGNATURE}\n{OURS}\n").as_bytes())?;
        }
        real_folder(&self.root.join(ENTRIES))?;
        WorkFolder::new(&self.root).map(drop)
    }

    /// Keeps the files of a folder under a key. Where another process was faster its entry stays, which holds the
    /// same.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn publish(&self, key: &Key, files: &Path, entry: &Entry) -> Result<(), Error> {
        let work = WorkFolder::new(&self.root)?;
        for file in &entry.files {
            let Some(name) = relative(&file.name) else { continue };
            let copy = work.path().join(FILES).join(&name);
            let copied = copy.parent().map_or(Ok(()), fs::create_dir_all);
            // A copy that is lost with the power is found damaged, so that nobody need wait for the disk.
            copied.and_then(|()| fs::copy(files.join(&name), &copy)).map_err(|e| Error::io(&copy, e))?;
        }
        let json = serde_json::to_vec(entry).map_err(|e| Error::io(&self.root, e.into()))?;
        write_atomically(&work.path().join(ENTRY), &json)?;
        let home = self.home(key);
        match fs::rename(work.path(), &home) {
            Err(_) if is_entry(&home) => Ok(()),
            other => other.map_err(|e| Error::io(&home, e)),
        }
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
        let folder = self.root.join(ENTRIES);
        let mut all = Vec::new();
        if !is_real_folder(&folder) {
            return Ok(all);
        }
        for home in fs::read_dir(&folder).map_err(|e| Error::io(&folder, e))? {
            let home = home.map_err(|e| Error::io(&folder, e))?.path();
            if !is_entry(&home) {
                continue;
            }
            let path = home.join(ENTRY);
            let entry: Option<Entry> = fs::read(&path).ok().and_then(|b| serde_json::from_slice(&b).ok());
            let used = fs::metadata(&path).and_then(|m| m.modified()).ok();
            let idle = used.and_then(|used| SystemTime::now().duration_since(used).ok()).unwrap_or_default();
            all.push(Listed {
                key: name_of(&home).into(),
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
            self.remove_folder(&self.root.join(ENTRIES).join(&entry.key))?;
            count += 1;
            bytes += entry.bytes;
        }
        Ok((count, bytes))
    }

    fn home(&self, key: &Key) -> PathBuf {
        self.root.join(ENTRIES).join(key.hex())
    }

    /// Takes an entry's name away first, so that nobody finds half of it.
    fn remove_folder(&self, home: &Path) -> Result<(), Error> {
        if !is_entry(home) {
            return Ok(());
        }
        let trash = WorkFolder::new(&self.root)?;
        match fs::rename(home, trash.path().join("entry")) {
            Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(()),
            other => other.map_err(|e| Error::io(home, e)),
        }
    }
}

impl Entry {
    /// The entry that the files of a folder make.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn of(folder: &Path, name: &str, report: serde_json::Value) -> Result<Entry, Error> {
        let mut files = Vec::new();
        list_files(folder, "", &mut files)?;
        files.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(Entry { name: name.into(), files, report })
    }
}

/// The last part of a path; empty where it is not UTF-8.
fn name_of(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

/// A folder itself, not a link to one.
fn is_real_folder(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_dir())
}

/// Makes a folder, and refuses a link in its place.
fn real_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(|e| Error::io(path, e))?;
    if is_real_folder(path) {
        return Ok(());
    }
    Err(Error::malformed(path, "is a link; a cache has a folder of its own there, remove the link"))
}

/// Whether a path is an entry: named by a key, and with an `entry.json` in it.
fn is_entry(home: &Path) -> bool {
    let name = name_of(home);
    let is_key = name.len() == 64 && name.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'));
    is_key
        && is_real_folder(home)
        && fs::symlink_metadata(home.join(ENTRY)).is_ok_and(|metadata| metadata.is_file())
}

/// Whether a folder is missing or empty, or holds but what a cache holds.
fn holds_nothing_else(root: &Path) -> bool {
    let children = match fs::read_dir(root) {
        // Of a folder that cannot be looked into nothing can be removed either.
        Err(e) => return e.kind() != io::ErrorKind::NotADirectory,
        Ok(children) => children,
    };
    let all = |folder: &Path, ours: &dyn Fn(&Path) -> bool| {
        is_real_folder(folder)
            && fs::read_dir(folder).is_ok_and(|mut all| all.all(|entry| entry.is_ok_and(|e| ours(&e.path()))))
    };
    children.flatten().map(|child| child.path()).all(|child| match name_of(&child) {
        ENTRIES => all(&child, &is_entry),
        WORK => all(&child, &|path| name_of(path) == GATE || is_work(path)),
        // Another process is just writing the tag.
        name => is_temporary(name),
    })
}

/// Whether a path is called as work folders and their locks are; earlier versions began the names with `.tmp`.
fn is_work(path: &Path) -> bool {
    let name = name_of(path);
    let name = name.strip_suffix(".lock").unwrap_or(name);
    let random = name.strip_prefix(WORK_PREFIX).or_else(|| name.strip_prefix(".tmp"));
    random.is_some_and(|r| r.len() == 6 && r.bytes().all(|b| b.is_ascii_alphanumeric()))
}

const WORK_PREFIX: &str = "kinran-";

/// A folder for files that are not finished, `ROOT/work/kinran-<random>`. It goes when this is dropped or the process is
/// interrupted; if the process dies, when the next one makes its own.
#[derive(Debug)]
pub struct WorkFolder {
    folder: TempDir,
    lock_path: PathBuf,
    _lock: File,
    _unfinished: Unfinished,
}

impl WorkFolder {
    /// Makes a folder under `root`, and removes those whose owners are gone.
    ///
    /// # Errors
    /// [`Error::Io`], and [`Error::Malformed`] where `ROOT/work` is a link.
    pub fn new(root: &Path) -> Result<WorkFolder, Error> {
        let work = root.join(WORK);
        let fail = |e| Error::io(&work, e);
        real_folder(&work)?;
        // Between making a folder's lock and locking it nobody may look for abandoned ones.
        let gate = File::create(work.join(GATE)).map_err(fail)?;
        gate.lock().map_err(fail)?;
        remove_abandoned(&work).map_err(fail)?;
        let make = || tempfile::Builder::new().prefix(WORK_PREFIX).rand_bytes(6).tempdir_in(&work);
        let (unfinished, folder) = Unfinished::make(make).map_err(fail)?;
        let lock_path = folder.path().with_extension("lock");
        let lock = File::create(&lock_path).map_err(fail)?;
        lock.lock().map_err(fail)?;
        Ok(WorkFolder { folder, lock_path, _lock: lock, _unfinished: unfinished })
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
        if !is_work(&path) {
            continue;
        }
        let (folder, lock_path) = if is_real_folder(&path) {
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
            // Another process may be removing it too. Of a link only the link goes.
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
    let mut file = File::open(path).map_err(fail)?;
    hash_open(&mut file).map_err(fail)
}

/// As [`hash_file`], of a file that is open.
pub(crate) fn hash_open(file: &mut File) -> io::Result<(u64, String)> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file)?;
    Ok((hasher.count(), hasher.finalize().to_hex().to_string()))
}

/// The path that a stored name means, if it stays where it belongs.
pub fn relative(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(name);
    path.components().all(|c| matches!(c, Component::Normal(_))).then_some(path)
}

//! Where files are read from: a disk, or memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Debug;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::{image_size, image_size_of};

/// Files by path, for whoever reads them.
pub trait Files: Debug + Send + Sync {
    /// All bytes of a file.
    ///
    /// # Errors
    /// Where there is no such file, or what is there is none: reading a device or a pipe may never end.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;

    /// What lies directly in a folder, by name.
    ///
    /// # Errors
    /// Where there is no such folder; [`ErrorKind::NotADirectory`] where it is a file.
    fn list(&self, folder: &Path) -> io::Result<Vec<Entry>>;

    /// Where a file or folder really lies: without `.` and `..`, and behind links. Two paths lead to the same file where
    /// this is the same.
    ///
    /// # Errors
    /// Where nothing is there.
    fn canonical(&self, path: &Path) -> io::Result<PathBuf>;

    /// Whether there is a file.
    fn is_file(&self, path: &Path) -> bool;

    /// Bytes of a file; `None` where there is none.
    fn size(&self, path: &Path) -> Option<u64>;

    /// What tells a file from all others, wherever they are: on a disk its canonical path, in memory one that no disk has.
    /// What is written to this place replaces it. `None` for what is not there.
    fn place(&self, path: &Path) -> Option<PathBuf>;

    /// The same files, for who keeps them.
    fn share(&self) -> Arc<dyn Files>;

    /// Width and height of an image or a texture, by its header where that is all that has to be read. See [`image_size`].
    fn image_size(&self, path: &Path) -> Option<(u32, u32)> {
        image_size_of(&self.read(path).ok()?)
    }
}

/// A file or folder in a folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Its path, which begins with that of the folder as it was asked for.
    pub path: PathBuf,
    /// Whether it is a folder.
    pub is_folder: bool,
}

/// The files of the system, by paths as it has them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl Files for Disk {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let metadata = std::fs::metadata(path)?;
        if metadata.is_dir() {
            return Err(ErrorKind::IsADirectory.into());
        }
        if !metadata.is_file() {
            return Err(io::Error::other("is not a regular file"));
        }
        std::fs::read(path)
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<Entry>> {
        let mut entries = Vec::new();
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            entries.push(Entry { is_folder: path.is_dir(), path });
        }
        entries.sort();
        Ok(entries)
    }

    fn canonical(&self, path: &Path) -> io::Result<PathBuf> {
        path.canonicalize()
    }

    fn is_file(&self, path: &Path) -> bool {
        path.is_file()
    }

    fn size(&self, path: &Path) -> Option<u64> {
        Some(std::fs::metadata(path).ok()?.len())
    }

    fn place(&self, path: &Path) -> Option<PathBuf> {
        path.canonicalize().ok()
    }

    fn share(&self) -> Arc<dyn Files> {
        Arc::new(Disk)
    }

    fn image_size(&self, path: &Path) -> Option<(u32, u32)> {
        image_size(path)
    }
}

/// Files in memory, by relative paths; clones share them. A folder is there where a file lies in it.
///
/// ```
/// use kinran_image::{Files, Memory};
///
/// let files = Memory::from([("cloth/normal.png", vec![1, 2, 3])]);
/// assert_eq!(files.read("cloth/./normal.png".as_ref())?, [1, 2, 3]);
/// assert_eq!(files.list("cloth".as_ref())?[0].path.to_str(), Some("cloth/normal.png"));
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Clone, Default)]
pub struct Memory(Arc<Mutex<BTreeMap<PathBuf, Arc<[u8]>>>>);

impl Memory {
    /// Without files.
    pub fn new() -> Self {
        Memory::default()
    }

    /// Adds a file, or replaces it.
    pub fn insert(&self, path: impl AsRef<Path>, bytes: impl Into<Arc<[u8]>>) {
        self.lock().insert(plain(path.as_ref()), bytes.into());
    }

    /// A file's bytes.
    pub fn get(&self, path: impl AsRef<Path>) -> Option<Arc<[u8]>> {
        self.lock().get(&plain(path.as_ref())).cloned()
    }

    /// All files, by path.
    pub fn files(&self) -> Vec<(PathBuf, Arc<[u8]>)> {
        self.lock().iter().map(|(path, bytes)| (path.clone(), bytes.clone())).collect()
    }

    /// The [`Files::place`] of a path, whether something is there or not.
    pub fn place_of(&self, path: &Path) -> PathBuf {
        Path::new(&format!("memory:{:p}", Arc::as_ptr(&self.0))).join(plain(path))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<PathBuf, Arc<[u8]>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<P: AsRef<Path>, B: Into<Arc<[u8]>>, const N: usize> From<[(P, B); N]> for Memory {
    fn from(files: [(P, B); N]) -> Self {
        files.into_iter().collect()
    }
}

impl<P: AsRef<Path>, B: Into<Arc<[u8]>>> FromIterator<(P, B)> for Memory {
    fn from_iter<I: IntoIterator<Item = (P, B)>>(files: I) -> Self {
        let memory = Memory::new();
        files.into_iter().for_each(|(path, bytes)| memory.insert(path, bytes));
        memory
    }
}

impl Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_set().entries(self.lock().keys()).finish()
    }
}

impl Files for Memory {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.get(path).map(|bytes| bytes.to_vec()).ok_or_else(|| ErrorKind::NotFound.into())
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<Entry>> {
        let root = plain(folder);
        let files = self.lock();
        if files.contains_key(&root) {
            return Err(ErrorKind::NotADirectory.into());
        }
        let mut entries = BTreeSet::new();
        for file in files.keys() {
            let below = if root == Path::new(".") { Ok(file.as_path()) } else { file.strip_prefix(&root) };
            let mut names = below.iter().flat_map(|below| below.components());
            if let Some(name) = names.next() {
                entries.insert(Entry { path: folder.join(name), is_folder: names.next().is_some() });
            }
        }
        if entries.is_empty() && root != Path::new(".") {
            return Err(ErrorKind::NotFound.into());
        }
        Ok(entries.into_iter().collect())
    }

    fn canonical(&self, path: &Path) -> io::Result<PathBuf> {
        let root = plain(path);
        let is_there = root == Path::new(".") || self.lock().keys().any(|file| file.starts_with(&root));
        // "." is the beginning of every path that is relative.
        let real = if root == Path::new(".") { PathBuf::new() } else { root };
        is_there.then_some(real).ok_or_else(|| ErrorKind::NotFound.into())
    }

    fn is_file(&self, path: &Path) -> bool {
        self.lock().contains_key(&plain(path))
    }

    fn size(&self, path: &Path) -> Option<u64> {
        Some(self.get(path)?.len() as u64)
    }

    fn place(&self, path: &Path) -> Option<PathBuf> {
        self.canonical(path).ok().map(|path| self.place_of(&path))
    }

    fn share(&self) -> Arc<dyn Files> {
        Arc::new(self.clone())
    }
}

/// A path without `.`, and without `..` but in front.
pub fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if matches!(plain.components().next_back(), Some(Component::Normal(_))) => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    if plain.as_os_str().is_empty() { PathBuf::from(".") } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_hide_where_a_path_leads() {
        for (path, wanted) in [
            ("a/../b.png", "b.png"),
            ("a/../../b.png", "../b.png"),
            ("./a/./b", "a/b"),
            ("../../a/..", "../.."),
            ("a/..", "."),
            ("/../a", "/../a"),
        ] {
            assert_eq!(plain(path.as_ref()), Path::new(wanted), "{path}");
        }
    }

    #[test]
    fn files_in_memory_are_found_elsewhere_than_on_a_disk() {
        let names = ["a/b/c.png", "a/d.png", "e.png"];
        let folder = tempfile::tempdir().unwrap();
        for name in names {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, name).unwrap();
        }
        let memory: Memory = names.into_iter().map(|name| (name, name.as_bytes())).collect();
        for asked in ["", "a", "a/b", "./a/../a", "x", "e.png", "a/b/c.png", "../y"] {
            let of = |files: &dyn Files, root: &Path| {
                let path = root.join(asked);
                let relative = |path: &Path| plain(path.strip_prefix(root).unwrap_or(path));
                let list = files.list(&path).map_err(|e| e.kind()).map(|entries| {
                    entries.into_iter().map(|e| (relative(&e.path), e.is_folder)).collect::<Vec<_>>()
                });
                let kind = |e: io::Error| match e.kind() {
                    // In memory there are no folders but by their files.
                    ErrorKind::IsADirectory => ErrorKind::NotFound,
                    kind => kind,
                };
                (list, files.read(&path).map_err(kind), files.is_file(&path), files.canonical(&path).is_ok())
            };
            assert_eq!(of(&memory, Path::new("")), of(&Disk, folder.path()), "{asked:?}");
        }
        assert_eq!(memory.canonical("a/./b/../d.png".as_ref()).unwrap(), Path::new("a/d.png"));
        assert!(memory.canonical("a".as_ref()).unwrap().starts_with(memory.canonical("".as_ref()).unwrap()));
    }
}

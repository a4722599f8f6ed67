//! What a manifest's patterns never match: results, finished work, and what is known of them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use kinran_bake::cache::Cache;

/// The folder in the output with what is known of it.
pub const STATE: &str = ".kinran";

/// The folders and files that belong to the program.
pub(super) struct Ours {
    /// Folder of the manifest.
    manifest: PathBuf,
    /// The output and the cache.
    folders: Vec<PathBuf>,
    /// Files that were written into an output that holds the manifest too, so that it cannot be left out as a whole.
    written: BTreeSet<PathBuf>,
}

impl Ours {
    /// Those of a library; `written` are files that earlier runs wrote.
    pub(super) fn new(
        manifest: &Path,
        output: &Path,
        cache: Option<&Path>,
        written: impl Iterator<Item = PathBuf>,
    ) -> Ours {
        let folder = manifest.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let manifest = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
        let folders: Vec<PathBuf> =
            [Some(output), cache].into_iter().flatten().filter_map(|f| f.canonicalize().ok()).collect();
        let within = folders.first().is_some_and(|output| manifest.starts_with(output));
        let written = written.filter(|_| within).filter_map(|file| file.canonicalize().ok()).collect();
        Ours { manifest, folders, written }
    }

    /// Whether a path is ours, or a folder all of whose content is: an output, also of another manifest, or a cache.
    pub(super) fn is(&self, path: &Path) -> bool {
        if path.file_name().is_some_and(|name| name == STATE) {
            return true;
        }
        if path.is_dir() {
            return self.is_folder(path);
        }
        !self.written.is_empty() && path.canonicalize().is_ok_and(|path| self.written.contains(&path))
    }

    fn is_folder(&self, folder: &Path) -> bool {
        let Ok(full) = folder.canonicalize() else { return false };
        // A manifest in its own output, or in another's, still finds what is beside it.
        if self.manifest.starts_with(&full) {
            return false;
        }
        self.folders.contains(&full)
            || full.join(STATE).join("standing.json").is_file()
            || Cache::is_cache(&full)
    }
}

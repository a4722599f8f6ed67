//! Paths by pattern: `*` and `?` within a name, `**` for folders, `[abc]`.

use std::path::{Path, PathBuf};

use glob::{MatchOptions, Pattern};
use walkdir::WalkDir;

/// A pattern, relative to a folder or absolute.
#[derive(Clone, Debug)]
pub(crate) struct PathPattern {
    /// Where to look.
    root: PathBuf,
    /// What is looked for, relative to `root`.
    wild: Pattern,
    /// How many folders below `root` that is; nothing where it may be any number.
    depth: Option<usize>,
    /// It names hidden files.
    hidden: bool,
}

impl PathPattern {
    /// Whether a path is meant to be a pattern.
    pub(crate) fn is_one(text: &str) -> bool {
        text.contains(['*', '?', '['])
    }

    /// The pattern `text` as seen from `folder`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn new(folder: &Path, text: &str) -> Result<PathPattern, String> {
        let text = if cfg!(windows) { text.replace('\\', "/") } else { text.into() };
        let parts: Vec<&str> = text.trim_end_matches('/').split('/').collect();
        let literal = parts.iter().position(|part| PathPattern::is_one(part)).unwrap_or(parts.len() - 1);
        let (before, after) = parts.split_at(literal);
        let wild = Pattern::new(&after.join("/")).map_err(|e| e.msg.to_owned())?;
        let before = match before {
            [""] => "/".into(),
            before => before.join("/"),
        };
        Ok(PathPattern {
            root: if before.is_empty() { folder.to_path_buf() } else { folder.join(before) },
            wild,
            depth: (!after.contains(&"**")).then_some(after.len()),
            hidden: after.iter().any(|part| part.starts_with('.')),
        })
    }

    /// The folder under which all matches are.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Existing files and folders that match, by name, without those that `skip` takes out with all that is in them. Links
    /// are followed, but not back to a folder that was come through.
    ///
    /// # Errors
    /// A folder that cannot be looked into.
    pub(crate) fn matches(&self, skip: &dyn Fn(&Path) -> bool) -> Result<Vec<PathBuf>, String> {
        let options = MatchOptions {
            case_sensitive: true,
            require_literal_separator: true,
            require_literal_leading_dot: true,
        };
        let full = self.root.canonicalize().unwrap_or_else(|_| self.root.clone());
        if full.ancestors().any(skip) {
            return Ok(Vec::new());
        }
        let is_hidden = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with('.');
        let walk = WalkDir::new(&self.root)
            .follow_links(true)
            .max_depth(self.depth.unwrap_or(usize::MAX))
            .into_iter()
            .filter_entry(|entry| {
                entry.depth() == 0 || ((self.hidden || !is_hidden(entry.file_name())) && !skip(entry.path()))
            });
        let mut found = Vec::new();
        for entry in walk {
            let entry = match entry {
                Ok(entry) => entry,
                // A link that leads back, or to nothing.
                Err(e) if e.loop_ancestor().is_some() => continue,
                Err(e) if e.io_error().is_some_and(|e| e.kind() == std::io::ErrorKind::NotFound) => continue,
                Err(e) => return Err(e.to_string()),
            };
            let relative = entry.path().strip_prefix(&self.root).unwrap_or(entry.path());
            if entry.depth() > 0 && self.wild.matches_path_with(relative, options) {
                found.push(entry.into_path());
            }
        }
        found.sort();
        Ok(found)
    }
}

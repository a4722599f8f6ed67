//! Finding out that output cannot be written before long work, not after it.

use std::path::{Path, PathBuf};

use crate::Error;

/// Whether a path ends in `.extension`, in any case.
pub(crate) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// Refuses a file whose extension is not among `extensions`, that is a folder, or that cannot appear in its
/// folder.
pub(crate) fn check_file(path: &Path, extensions: &[&str]) -> Result<(), Error> {
    if !extensions.iter().any(|e| has_extension(path, e)) {
        let wanted = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
        return Err(Error::Usage(format!("{}: the name must end in {wanted}; rename it", path.display())));
    }
    if path.is_dir() {
        return Err(Error::Usage(format!("{}: is a folder; name a file", path.display())));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return Err(Error::Usage(format!(
            "{}: there is no folder {}; make it first",
            path.display(),
            folder.display()
        )));
    }
    check_writable(folder)
}

/// Refuses a folder that neither exists nor can be made, or that cannot be written to.
pub(crate) fn check_folder(path: &Path) -> Result<(), Error> {
    let full = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let existing: PathBuf = full.ancestors().find(|p| p.exists()).unwrap_or(&full).to_path_buf();
    if !existing.is_dir() {
        return Err(Error::Usage(format!("{}: is a file; name a folder", existing.display())));
    }
    check_writable(&existing)
}

fn check_writable(folder: &Path) -> Result<(), Error> {
    // A file without a name: a process that is killed here leaves nothing behind.
    tempfile::tempfile_in(folder)
        .map(drop)
        // The error itself would name the temporary file.
        .map_err(|e| kinran_image::Error::io(folder, e.kind().into()).into())
}

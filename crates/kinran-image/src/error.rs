use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::Cancelled;

/// What to say of a file whose end is missing.
pub(crate) const TRUNCATED: &str = "the file ends too early, it is truncated; save it again";

/// Why an image or a texture could not be read, written, encoded or decoded.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read or write the file.
    #[error("{}: {}", path.display(), io_reason(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// The file's content is not what its format demands.
    #[error("{}: {reason}", path.display())]
    Malformed {
        /// The file, or the name its bytes came under.
        path: PathBuf,
        /// What is wrong, and what would be right.
        reason: String,
    },
    /// The request cannot be served: a format, size or option outside what the function can do.
    #[error("{0}")]
    Unsupported(String),
    /// A [`Tick`](crate::Tick) stopped the work.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Error {
    /// What kind of error it is, in a word that stays the same: `io` the system refused; `malformed` a damaged file;
    /// `unsupported` a sound one with something that is not known; `cancelled`.
    pub fn code(&self) -> &'static str {
        match self {
            Error::Io { .. } => "io",
            Error::Malformed { .. } => "malformed",
            Error::Unsupported(_) => "unsupported",
            Error::Cancelled(_) => "cancelled",
        }
    }

    /// The file that it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Error::Io { path, .. } | Error::Malformed { path, .. } => Some(path),
            Error::Unsupported(_) | Error::Cancelled(_) => None,
        }
    }

    /// An [`Error::Malformed`] about `path`.
    pub fn malformed(path: impl AsRef<Path>, reason: impl Into<String>) -> Self {
        Error::Malformed { path: path.as_ref().to_path_buf(), reason: reason.into() }
    }

    /// An [`Error::Io`] about `path`.
    pub fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io { path: path.as_ref().to_path_buf(), source }
    }
}

/// What the operating system says of a file, in words without its numbers, and what a person can do about it.
pub fn io_reason(error: &std::io::Error) -> String {
    let words = match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder",
        ErrorKind::AlreadyExists => "a file of this name is in the way; move it away, or name another place",
        ErrorKind::NotADirectory => "a part of this path is a file and no folder; name another place",
        ErrorKind::IsADirectory => "is a folder; name a file in it",
        ErrorKind::InvalidFilename => "no file can have this name, or it is too long; name another",
        ErrorKind::PermissionDenied => {
            "permission denied; change the permissions of the file and its folder, or choose another"
        }
        ErrorKind::ReadOnlyFilesystem => "the disk is read-only; choose a folder on a writable disk",
        ErrorKind::StorageFull => "the disk is full; free some space or choose another disk",
        ErrorKind::QuotaExceeded => "the quota is used up; free some space or choose another disk",
        _ => {
            let said = error.to_string();
            return said.split_once(" (os error ").map_or(said.clone(), |(words, _)| words.to_owned());
        }
    };
    words.into()
}

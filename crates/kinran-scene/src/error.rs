use std::path::{Path, PathBuf};

/// Why a scene, a document or an environment could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The operating system refused to read or write the file.
    #[error("{}: {}", path.display(), kinran_image::io_reason(source))]
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
        /// The place in the file, what is wrong there, and what would be right.
        reason: String,
    },
    /// The file is sound but needs something that is not implemented.
    #[error("{}: {reason}", path.display())]
    Unsupported {
        /// The file, or the name its bytes came under.
        path: PathBuf,
        /// What it needs, and what to do about it.
        reason: String,
    },
    /// A file that a document names is not there, or the operating system refused to read it.
    #[error(
        "{}: {what}: the file \"{file}\" it names cannot be read: {}{}",
        path.display(), kinran_image::io_reason(source), also(others)
    )]
    Unreadable {
        /// The document.
        path: PathBuf,
        /// The place in it.
        what: String,
        /// The path that stands there.
        file: String,
        /// Other files that it names and that cannot be read.
        others: Vec<String>,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A document names a file outside of its own folder, and nobody has allowed that.
    #[error(
        "{}: {what}: the file \"{file}\" lies outside of the model's folder; put it there, or, if you trust the \
         model, allow the folder with --allow-outside {}",
        path.display(), folder.display()
    )]
    Outside {
        /// The document.
        path: PathBuf,
        /// The place in it.
        what: String,
        /// The path that stands there.
        file: String,
        /// The folder that the file is in.
        folder: PathBuf,
    },
    /// An image could not be read; the message names it.
    #[error(transparent)]
    Image(#[from] kinran_image::Error),
    /// A [`Tick`](kinran_image::Tick) stopped the work.
    #[error(transparent)]
    Cancelled(#[from] kinran_image::Cancelled),
}

/// Files that a sentence names.
const NAMED: usize = 4;

/// What of several files that cannot be read stands behind the first, and what to do.
fn also(others: &[String]) -> String {
    let named: Vec<String> = others.iter().take(NAMED).map(|file| format!("\"{file}\"")).collect();
    let more = match others.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    match named.len() {
        0 => "; put it beside the model, or export the model again".into(),
        _ => {
            format!(
                ", nor can {}{more}; put them beside the model, or export the model again",
                named.join(", ")
            )
        }
    }
}

impl Error {
    /// What kind of error it is, in the words of [`kinran_image::Error::code`]; `input` for a file in the wrong place.
    pub fn code(&self) -> &'static str {
        match self {
            Error::Io { .. } | Error::Unreadable { .. } => "io",
            Error::Malformed { .. } => "malformed",
            Error::Unsupported { .. } => "unsupported",
            Error::Outside { .. } => "input",
            Error::Image(error) => error.code(),
            Error::Cancelled(_) => "cancelled",
        }
    }

    /// The file that it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Error::Io { path, .. }
            | Error::Malformed { path, .. }
            | Error::Unsupported { path, .. }
            | Error::Unreadable { path, .. }
            | Error::Outside { path, .. } => Some(path),
            Error::Image(error) => error.file(),
            Error::Cancelled(_) => None,
        }
    }

    pub(crate) fn io(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Error::Io { path: path.as_ref().to_path_buf(), source }
    }

    pub(crate) fn malformed(path: impl AsRef<Path>, reason: impl Into<String>) -> Self {
        Error::Malformed { path: path.as_ref().to_path_buf(), reason: reason.into() }
    }

    /// What is wrong, without the document, where it is what that holds or names.
    pub(crate) fn reason(&self) -> String {
        let said = self.to_string();
        let (Error::Malformed { path, .. }
        | Error::Unsupported { path, .. }
        | Error::Unreadable { path, .. }) = self
        else {
            return said;
        };
        said.strip_prefix(&format!("{}: ", path.display())).map_or(said.clone(), str::to_owned)
    }

    pub(crate) fn unsupported(path: impl AsRef<Path>, reason: impl Into<String>) -> Self {
        Error::Unsupported { path: path.as_ref().to_path_buf(), reason: reason.into() }
    }
}

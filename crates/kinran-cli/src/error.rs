use std::path::{Path, PathBuf};

use kinran_image::Cancelled;

use crate::values::counted;

/// Why a command failed. The message is one line: what is wrong where, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Words that cannot be served, and about no one flag or file.
    #[error("{0}")]
    Usage(String),
    /// A flag cannot be served, alone or together with others.
    #[error("{message}")]
    Flag {
        /// The flag, or the argument that is missing, as help names it: `--size`, `<FILE>`.
        flag: String,
        /// The file or folder that it does not suit.
        file: Option<PathBuf>,
        /// What is wrong, and what to do about it.
        message: String,
    },
    /// A file or folder is not what a command takes.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong, and what to do about it.
        reason: String,
    },
    /// An image or a texture could not be read or written.
    #[error(transparent)]
    Image(#[from] kinran_image::Error),
    /// A scene or an environment could not be read.
    #[error(transparent)]
    Scene(#[from] kinran_scene::Error),
    /// A folder of maps could not be understood.
    #[error(transparent)]
    Folder(#[from] kinran_bake::folder::FolderError),
    /// A manifest says what no manifest says.
    #[error(transparent)]
    Manifest(#[from] kinran_bake::manifest::ManifestError),
    /// Entries of a manifest failed; each has told why.
    #[error("{failed} of {} failed{}", counted(*of, "entry", "entries"), if *done && failed < of { "; the others are done" } else { "" })]
    Entries {
        /// How many.
        failed: usize,
        /// Of how many.
        of: usize,
        /// Whether anything was done at all, and not only planned.
        done: bool,
    },
    /// A file breaks rules; each has been told.
    #[error("{}: {}", path.display(), counted(*count, "rule is broken", "rules are broken"))]
    Findings {
        /// The file.
        path: PathBuf,
        /// How many.
        count: usize,
    },
    /// A picture could not be rendered.
    #[error(transparent)]
    Render(#[from] kinran_render::Error),
    /// What went wrong with a file or folder, where the error itself does not name it.
    #[error("{}: {error}", path.display())]
    About {
        /// The file or folder.
        path: PathBuf,
        /// What went wrong.
        error: Box<Error>,
    },
    /// Standard output could not be written.
    #[error("standard output: {}; send it elsewhere", kinran_image::io_reason(.0))]
    Stdout(#[from] std::io::Error),
    /// The work was stopped.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A defect of the program.
    #[error("{0}; this is a defect of kinran, please report it")]
    Internal(String),
}

impl From<kinran_bake::manifest::ReadError> for Error {
    fn from(error: kinran_bake::manifest::ReadError) -> Self {
        match error {
            kinran_bake::manifest::ReadError::Image(error) => error.into(),
            kinran_bake::manifest::ReadError::Manifest(error) => error.into(),
        }
    }
}

impl From<kinran::Error> for Error {
    /// The same in the words of the command line: options are flags here.
    fn from(error: kinran::Error) -> Self {
        use kinran::Error as Task;
        match error {
            Task::Image(error) => error.into(),
            Task::Scene(error) => error.into(),
            Task::Folder(error) => error.into(),
            Task::Option { option, given, file, reason } => {
                let given = format!("--{option} {given}");
                match file {
                    Some(file) => Error::flag_error_of(file, given.trim_end(), reason),
                    None => Error::flag_error(given.trim_end(), reason),
                }
            }
            Task::Manifest(error) => error.into(),
            Task::Input { path, fault } => Error::file_error(path, fault.to_string()),
            Task::UnknownContent { file, name } => {
                let reason =
                    format!("key KinranMap: \"{name}\" is no map that is known; say --role what it is");
                kinran_image::Error::malformed(file, reason).into()
            }
            Task::OverInput { input } => Error::file_error(
                input,
                "the baked model would overwrite it; name another folder with --output",
            ),
            Task::OverMap { file } => Error::file_error(
                file,
                "is a map of what is baked and would be overwritten; name another folder with --output",
            ),
            Task::SameName { input, what, name, fix } => {
                Error::file_error(input, format!("two {what} would both be written to {name}; {fix}"))
            }
            Task::NoMesh { input } => Error::file_error(
                input,
                "no mesh to measure curvature of has triangles; export the mesh with its faces",
            ),
            Task::Flat { input, mesh, primitive } => Error::file_error(
                input,
                format!(
                    "{mesh}: primitive {primitive} has no NORMAL, which glTF draws flat, and curvature needs smooth \
                     normals; export them, or add --estimate-normals"
                ),
            ),
            Task::Mesh { input, mesh, error } => Error::file_error(input, format!("{mesh}: {error}")),
            Task::Unturned { input, error } => {
                Error::file_error(input, format!("its normal map cannot be turned as --y-down says: {error}"))
            }
            Task::Refused(error) => match error.downcast() {
                Ok(error) => *error,
                Err(error) => Error::Usage(error.to_string()),
            },
            Task::Cancelled => Cancelled.into(),
            Task::Internal(reason) => Error::Internal(reason),
            error => Error::Usage(error.to_string()),
        }
    }
}

impl Error {
    /// What to show below the message: the place in a manifest.
    pub fn snippet(&self) -> Option<&str> {
        match self {
            Error::Manifest(error) => Some(&error.snippet),
            Error::About { error, .. } => error.snippet(),
            _ => None,
        }
    }

    /// An [`Error::Flag`]; `given` is the flag with what was given to it, if anything was.
    pub fn flag_error(given: impl Into<String>, reason: impl std::fmt::Display) -> Self {
        let given = given.into();
        Error::Flag { message: format!("{given}: {reason}"), flag: flag_of(&given), file: None }
    }

    /// The same of a flag that does not suit a file.
    pub fn flag_error_of(
        path: impl AsRef<Path>,
        given: impl Into<String>,
        reason: impl std::fmt::Display,
    ) -> Self {
        let (path, given) = (path.as_ref(), given.into());
        let message = format!("{}: {given}: {reason}", path.display());
        Error::Flag { message, flag: flag_of(&given), file: Some(path.to_path_buf()) }
    }

    /// The error with the file or folder that it is about, where it names none itself.
    pub fn about(self, path: impl AsRef<Path>) -> Self {
        use kinran_render::Error as RenderError;
        let may_lack_one = matches!(
            self,
            Error::Usage(_)
                | Error::Folder(_)
                | Error::Image(_)
                | Error::Scene(_)
                | Error::Render(RenderError::Scene(_))
        );
        if may_lack_one && self.file().is_none() && self.flag().is_none() {
            return Error::About { path: path.as_ref().to_path_buf(), error: Box::new(self) };
        }
        self
    }

    /// An [`Error::File`] about `path`.
    pub fn file_error(path: impl AsRef<Path>, reason: impl Into<String>) -> Self {
        Error::File { path: path.as_ref().to_path_buf(), reason: reason.into() }
    }

    /// What kind of error it is, in a word that stays the same: `usage` flags; `input` a file of the wrong kind or in
    /// the wrong place; `io` the system refused; `malformed` a damaged file; `unsupported` a sound one with something
    /// that is not known; `maps` a folder of maps that cannot be understood; `manifest`; `entries` of a manifest failed; `findings` of `inspect --check`;
    /// `render`; `gpu`; `shader`; `cancelled` work that was stopped; `internal` a defect of the program.
    pub fn code(&self) -> &'static str {
        use kinran_render::Error as RenderError;
        match self {
            Error::About { error, .. } => error.code(),
            Error::Usage(_) | Error::Flag { .. } | Error::Render(RenderError::Setting { .. }) => "usage",
            Error::File { .. } => "input",
            Error::Image(error) => error.code(),
            Error::Scene(error) => error.code(),
            Error::Folder(error) if error.code() == "option" => "usage",
            Error::Folder(error) => error.code(),
            Error::Cancelled(_) | Error::Render(RenderError::Cancelled(_)) => "cancelled",
            Error::Stdout(_) => "io",
            Error::Manifest(_) => "manifest",
            Error::Entries { .. } => "entries",
            Error::Findings { .. } => "findings",
            Error::Render(RenderError::Gpu(_)) => "gpu",
            Error::Render(RenderError::Shader(_)) => "shader",
            Error::Render(RenderError::Scene(_)) => "render",
            Error::Render(RenderError::SizeMismatch { .. }) | Error::Internal(_) => "internal",
        }
    }

    /// The file or folder that it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Error::File { path, .. } | Error::About { path, .. } | Error::Findings { path, .. } => Some(path),
            Error::Flag { file, .. } => file.as_deref(),
            Error::Image(error) => error.file(),
            Error::Scene(error) => error.file(),
            Error::Folder(error) => error.file(),
            Error::Manifest(error) => Some(&error.path),
            _ => None,
        }
    }

    /// The flag that it is about, without what was given to it, or the argument that is missing.
    pub fn flag(&self) -> Option<String> {
        use kinran_bake::folder::FolderError;
        match self {
            Error::Flag { flag, .. } => Some(flag.clone()),
            Error::Folder(FolderError::Flag { flag, .. }) => Some(flag_of(flag)),
            Error::About { error, .. } => error.flag(),
            _ => None,
        }
    }

    /// The place in a manifest, from 1.
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        match self {
            Error::About { error, .. } => error.line_and_column(),
            Error::Manifest(error) => Some((error.line, error.column)),
            _ => None,
        }
    }

    /// 2 where the input or the flags are to blame, 1 where the program is, 130 where the work was stopped, as by Ctrl-C.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::About { error, .. } => error.exit_code(),
            Error::Internal(_) | Error::Render(kinran_render::Error::SizeMismatch { .. }) => 1,
            _ if self.code() == "cancelled" => 130,
            _ => 2,
        }
    }
}

/// The flag at the beginning of what was given.
fn flag_of(given: &str) -> String {
    given.split([' ', '=']).next().unwrap_or(given).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Who stopped the work would look for a mistake in the input.
    #[test]
    fn stopped_work_is_told_as_a_failure() {
        let of_image = || kinran_image::Error::from(Cancelled);
        let errors: [Error; 7] = [
            Cancelled.into(),
            of_image().into(),
            kinran_bake::folder::FolderError::Image(of_image()).into(),
            kinran_scene::Error::from(Cancelled).into(),
            kinran_scene::Error::from(of_image()).into(),
            kinran_render::Error::from(Cancelled).into(),
            Error::from(of_image()).about("model.glb"),
        ];
        for error in errors {
            assert_eq!((error.code(), error.exit_code()), ("cancelled", 130), "{error:?}");
        }
    }
}

/// Why a command failed. The message is one line: what is wrong where, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A flag or a combination of flags cannot be served.
    #[error("{0}")]
    Usage(String),
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
    #[error("{failed} of {of} entries failed; the others are done")]
    Entries {
        /// How many.
        failed: usize,
        /// Of how many.
        of: usize,
    },
    /// A picture could not be rendered.
    #[error(transparent)]
    Render(#[from] kinran_render::Error),
    /// Standard output could not be written.
    #[error("standard output: {0}; send it elsewhere")]
    Stdout(#[from] std::io::Error),
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

impl Error {
    /// What to show below the message: the place in a manifest.
    pub fn snippet(&self) -> Option<&str> {
        match self {
            Error::Manifest(error) => Some(&error.snippet),
            _ => None,
        }
    }

    /// 2 where the input or the flags are to blame, 1 where the program is.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Internal(_) | Error::Render(kinran_render::Error::SizeMismatch { .. }) => 1,
            _ => 2,
        }
    }
}

use std::path::{Path, PathBuf};

use kinran_bake::curvature::CurvatureError;
use kinran_bake::folder::FolderError;
use kinran_image::Cancelled;
use kinran_shading::skin::profile::ProfileError;

/// Why a task failed. The message is one line: what is wrong where, and what to do about it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An image or a texture could not be read or written.
    #[error(transparent)]
    Image(kinran_image::Error),
    /// A scene could not be read.
    #[error(transparent)]
    Scene(kinran_scene::Error),
    /// A folder of maps could not be understood.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// An option cannot be served, alone or with others, or does not suit a file.
    #[error("{}{option} {given}: {reason}", of_file(file.as_deref()))]
    Option {
        /// Its name, as the command line has it behind its dashes.
        option: &'static str,
        /// What was given.
        given: String,
        /// The file that it does not suit.
        file: Option<PathBuf>,
        /// What is wrong, and what to do about it.
        reason: String,
    },
    /// The baked model would overwrite what it is made from.
    #[error("{}: the baked model would overwrite it; give another destination", input.display())]
    OverInput {
        /// The model.
        input: PathBuf,
    },
    /// A texture would overwrite a map that it is made from.
    #[error("{}: is a map of what is baked and would be overwritten; give another destination", file.display())]
    OverMap {
        /// The map.
        file: PathBuf,
    },
    /// Two results have the same name.
    #[error("{}: two {what} would both be written to {name}; {fix}", input.display())]
    SameName {
        /// What is baked.
        input: PathBuf,
        /// What they are: "materials".
        what: &'static str,
        /// The name of both.
        name: String,
        /// What to do about it.
        fix: &'static str,
    },
    /// No mesh can be measured, though that was asked for.
    #[error("{}: no mesh to measure curvature of has triangles; export the mesh with its faces", input.display())]
    NoMesh {
        /// The model.
        input: PathBuf,
    },
    /// A mesh has no normals, so that its curvature cannot be measured unless they are estimated.
    #[error(
        "{}: {mesh}: primitive {primitive} has no NORMAL, which glTF draws flat, and curvature needs smooth normals; \
         export them, or have them estimated",
        input.display()
    )]
    Flat {
        /// The model.
        input: PathBuf,
        /// The mesh.
        mesh: String,
        /// The primitive in it.
        primitive: usize,
    },
    /// A mesh cannot be measured.
    #[error("{}: {mesh}: {error}", input.display())]
    Mesh {
        /// The model.
        input: PathBuf,
        /// The mesh.
        mesh: String,
        /// Why.
        error: CurvatureError,
    },
    /// A diffusion profile cannot be one.
    #[error("the profile: {0}")]
    Profile(ProfileError),
    /// A normal map that should be turned over cannot be read.
    #[error("{}: its normal map cannot be turned over: {error}", input.display())]
    Unturned {
        /// The model.
        input: PathBuf,
        /// Why.
        error: kinran_image::Error,
    },
    /// The destination does not want the files.
    #[error(transparent)]
    Refused(Box<dyn std::error::Error + Send + Sync>),
    /// It was stopped.
    #[error("cancelled")]
    Cancelled,
    /// A defect of the program.
    #[error("{0}; this is a defect of kinran, please report it")]
    Internal(String),
}

impl From<Cancelled> for Error {
    fn from(_: Cancelled) -> Self {
        Error::Cancelled
    }
}

impl From<kinran_image::Error> for Error {
    fn from(error: kinran_image::Error) -> Self {
        match error {
            kinran_image::Error::Cancelled(stopped) => stopped.into(),
            error => Error::Image(error),
        }
    }
}

impl From<kinran_scene::Error> for Error {
    fn from(error: kinran_scene::Error) -> Self {
        match error {
            kinran_scene::Error::Cancelled(stopped) => stopped.into(),
            error => Error::Scene(error),
        }
    }
}

fn of_file(file: Option<&Path>) -> String {
    file.map_or_else(String::new, |file| format!("{}: ", file.display()))
}

impl Error {
    /// What kind of error it is, in a word that stays the same: `option`; `input` a file of the wrong kind or in the wrong
    /// place; `io` the system refused; `malformed` a damaged file; `unsupported` a sound one with something that is not
    /// known; `maps` a folder of maps that cannot be understood; `mesh` one that cannot be measured; `refused` by the
    /// destination; `cancelled`; `internal` a defect of the program.
    pub fn code(&self) -> &'static str {
        fn of_image(error: &kinran_image::Error) -> &'static str {
            match error {
                kinran_image::Error::Io { .. } => "io",
                kinran_image::Error::Malformed { .. } => "malformed",
                kinran_image::Error::Unsupported(_) => "unsupported",
                kinran_image::Error::Cancelled(_) => "cancelled",
            }
        }
        match self {
            Error::Image(error)
            | Error::Folder(FolderError::Image(error))
            | Error::Scene(kinran_scene::Error::Image(error))
            | Error::Unturned { error, .. } => of_image(error),
            Error::Scene(kinran_scene::Error::Io { .. } | kinran_scene::Error::Unreadable { .. }) => "io",
            Error::Scene(kinran_scene::Error::Malformed { .. }) => "malformed",
            Error::Scene(kinran_scene::Error::Unsupported { .. }) => "unsupported",
            Error::Scene(kinran_scene::Error::Outside { .. }) => "input",
            Error::Option { .. } | Error::Profile(_) | Error::Folder(FolderError::Flag { .. }) => "option",
            Error::Folder(FolderError::NotAFolder(_)) => "input",
            Error::Folder(_) => "maps",
            Error::OverInput { .. } | Error::OverMap { .. } | Error::SameName { .. } => "input",
            Error::NoMesh { .. } | Error::Flat { .. } | Error::Mesh { .. } => "mesh",
            Error::Refused(_) => "refused",
            Error::Cancelled | Error::Scene(kinran_scene::Error::Cancelled(_)) => "cancelled",
            Error::Internal(_) => "internal",
        }
    }

    /// Whether the program is to blame, and not the input or the options.
    pub fn is_defect(&self) -> bool {
        matches!(self, Error::Internal(_))
    }
}

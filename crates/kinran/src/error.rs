use std::path::{Path, PathBuf};

use kinran_bake::curvature::CurvatureError;
use kinran_bake::folder::FolderError;
use kinran_bake::manifest::ManifestError;
use kinran_image::{Cancelled, IMAGE_EXTENSIONS};
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
    /// A manifest says what no manifest says.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
    /// A file or folder is not what the task takes.
    #[error("{}: {fault}", path.display())]
    Input {
        /// The file or folder.
        path: PathBuf,
        /// What it is instead.
        fault: InputFault,
    },
    /// A texture's key says that it holds what nobody knows.
    #[error("{}: key KinranMap: \"{name}\" is no map that is known; say what its role is", file.display())]
    UnknownContent {
        /// The texture.
        file: PathBuf,
        /// What the key says.
        name: String,
    },
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

/// Why a file or folder is not what a task takes.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputFault {
    /// It is a folder.
    #[error("is a folder; name a file in it")]
    Folder,
    /// It is a model without materials where one is to get maps.
    #[error("it has no material to put the maps into; give it one, or write a --board")]
    NoMaterial,
    /// It has no materials to try detail maps on.
    #[error(
        "there is no folder with maps in it; give a folder of folders with maps named as color, normal, roughness, ao or \
         metallic"
    )]
    NoMaterials,
    /// Its name ends as that of nothing that is known.
    #[error(
        "this kind of file is not known; give a .glb, .gltf, .obj, a report of kinran (.json), a texture or an image (.{})",
        IMAGE_EXTENSIONS.join(", .")
    )]
    UnknownKind,
    /// It is much larger than any profile.
    #[error("is larger than 1 MiB, so no profile; name a .csv or .json of one")]
    LargeProfile,
    /// Its name ends as that of no profile.
    #[error("a profile's file ends in .csv or .json; rename it")]
    NoProfile,
    /// It is no JSON of Gaussians.
    #[error("{0}; write {{ \"gaussians\": [ {{ \"variance\": 1, \"weight\": [1, 1, 1] }} ] }}")]
    NoGaussians(String),
    /// A line of a table is no row of a profile.
    #[error("line {line}: \"{text}\" is no row; write distance in mm, red, green, blue")]
    NoRow {
        /// From 1.
        line: usize,
        /// What stands there.
        text: String,
    },
    /// Its numbers are no profile.
    #[error(transparent)]
    Profile(ProfileError),
    /// It lies where the output goes.
    #[error("lies among the inputs and would be overwritten; choose another `output`")]
    AmongInputs,
    /// A file where one is to be written, which no earlier run put there.
    #[error("kinran did not write this file; move it away, or name another output")]
    Foreign,
    /// It is called JSON and is none.
    #[error("is no JSON: {0}; make it again")]
    NoJson(String),
    /// It is JSON of somebody else.
    #[error("is no JSON that kinran writes; give a report such as NAME.kinran.json")]
    ForeignJson,
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
    /// known; `maps` a folder of maps that cannot be understood; `mesh` one that cannot be measured; `manifest`; `refused` by the
    /// destination; `cancelled`; `internal` a defect of the program.
    pub fn code(&self) -> &'static str {
        match self {
            Error::Image(error) | Error::Unturned { error, .. } => error.code(),
            Error::Scene(error) => error.code(),
            Error::Folder(error) => error.code(),
            Error::Manifest(_) => "manifest",
            Error::Option { .. } | Error::Profile(_) => "option",
            Error::Input { .. } | Error::OverInput { .. } | Error::OverMap { .. } => "input",
            Error::SameName { .. } => "input",
            Error::UnknownContent { .. } => "malformed",
            Error::NoMesh { .. } | Error::Flat { .. } | Error::Mesh { .. } => "mesh",
            Error::Refused(_) => "refused",
            Error::Cancelled => "cancelled",
            Error::Internal(_) => "internal",
        }
    }

    /// The file or folder that it is about.
    pub fn file(&self) -> Option<&Path> {
        match self {
            Error::Image(error) => error.file(),
            Error::Scene(error) => error.file(),
            Error::Folder(error) => error.file(),
            Error::Manifest(error) => Some(&error.path),
            Error::Option { file, .. } => file.as_deref(),
            Error::Input { path: file, .. }
            | Error::UnknownContent { file, .. }
            | Error::OverMap { file }
            | Error::OverInput { input: file }
            | Error::SameName { input: file, .. }
            | Error::NoMesh { input: file }
            | Error::Flat { input: file, .. }
            | Error::Mesh { input: file, .. }
            | Error::Unturned { input: file, .. } => Some(file),
            Error::Profile(_) | Error::Refused(_) | Error::Cancelled | Error::Internal(_) => None,
        }
    }

    /// Whether the program is to blame, and not the input or the options.
    pub fn is_defect(&self) -> bool {
        matches!(self, Error::Internal(_))
    }
}

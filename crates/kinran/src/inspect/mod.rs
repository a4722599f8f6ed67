//! What is inside a texture, a model, an image or a report.
//!
//! ```
//! use kinran::inspect::{InspectOptions, Inspected, inspect};
//! use kinran::{Memory, Task};
//! # use kinran_image::{Channels, Image, Pixels, encode_png};
//! # let png = encode_png(&Image::new(1, 1, Channels::R, Pixels::U8(vec![255]))?)?;
//!
//! let files = Memory::from([("mask.png", png)]);
//! match inspect(&files, "mask.png".as_ref(), &InspectOptions::default(), Task::QUIET)? {
//!     Inspected::Image(image) => assert_eq!(image.channels[0].range.mean, 1.0),
//!     other => println!("{other:?}"),
//! }
//! # Ok::<(), kinran::Error>(())
//! ```

mod image;
mod model;
mod statistics;
mod texture;
mod written;

use std::path::{Path, PathBuf};

use kinran_image::{Files, has_image_extension};
use kinran_scene::is_gltf;
use schemars::JsonSchema;
use serde::Serialize;

use crate::content::Content;
use crate::error::InputFault;
use crate::names::{counted, file_name};
use crate::{Error, Task};

pub use image::{ChannelReport, ImageReport, LENGTH_TOLERANCE, NormalReport};
pub use model::{
    CameraReport, Factors, MapReport, MaterialReport, ModelReport, PrimitiveReport, RuntimeReport,
};
pub use statistics::{Range, Statistics};
pub use texture::{LevelReport, TextureReport};
pub use written::{Member, NamedFile, State, WrittenReport};

/// How a file is looked at.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct InspectOptions {
    /// What a texture holds; else what its key says, or what its format suggests.
    pub role: Option<Content>,
    /// Of an EXR file, the layer to look at.
    pub exr_layer: Option<String>,
    /// Folders outside of a model's own whose files it may name.
    pub allow_outside: Vec<PathBuf>,
}

/// What is in a file; the member `kind` says which of these.
#[derive(Clone, Debug, Serialize, JsonSchema)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Inspected {
    /// A `.ktx2` or `.dds`.
    Texture(TextureReport),
    /// A `.glb`, `.gltf` or `.obj`.
    Model(ModelReport),
    /// An image that a person made.
    Image(ImageReport),
    /// A `.json` that Kinran wrote.
    Written(WrittenReport),
}

/// Looks into a file, as its name says what it is.
///
/// # Errors
/// One that names the file: it cannot be read, it is damaged, it is of another kind; [`Error::Option`] for an option that is
/// about other kinds.
pub fn inspect(
    files: &dyn Files,
    path: &Path,
    how: &InspectOptions,
    task: Task<'_>,
) -> Result<Inspected, Error> {
    let is = |extensions: &[&str]| {
        path.extension().is_some_and(|own| extensions.iter().any(|e| own.eq_ignore_ascii_case(e)))
    };
    if is(&["ktx2", "dds"]) {
        return texture::inspect(files, path, how.role).map(Inspected::Texture);
    }
    let fault = |fault| Err(Error::Input { path: path.into(), fault });
    if !files.is_file(path) && files.list(path).is_ok() {
        return fault(InputFault::Folder);
    }
    let of_others = |option, given: &str, reason: &str| {
        Err(Error::Option { option, given: given.into(), file: Some(path.into()), reason: reason.into() })
    };
    if let Some(role) = how.role {
        return of_others("role", role.name(), "only textures have a role; leave it out");
    }
    if let Some(layer) = how.exr_layer.as_ref().filter(|_| !is(&["exr"])) {
        return of_others("exr-layer", layer, "only EXR files have layers; leave it out");
    }
    if is_gltf(path) || is(&["obj"]) {
        model::inspect(files, path, &how.allow_outside, task).map(Inspected::Model)
    } else if has_image_extension(path) {
        image::inspect(files, path, how.exr_layer.as_deref()).map(Inspected::Image)
    } else if is(&["json"]) {
        written::inspect(files, path).map(Inspected::Written)
    } else {
        fault(InputFault::UnknownKind)
    }
}

/// All of a file.
fn read(files: &dyn Files, path: &Path) -> Result<Vec<u8>, Error> {
    Ok(files.read(path).map_err(|e| kinran_image::Error::io(path, e))?)
}

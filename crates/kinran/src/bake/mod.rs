//! Bakes: a folder of maps or a glTF file becomes textures whose every level is right.

mod curvature;
mod folder;
mod gltf;
mod gltf_options;
mod together;

use kinran_image::{Format, Texture, full_level_count, level_size};

use crate::content::Content;
use crate::names::file_name;
use crate::options::TextureOptions;
use crate::report::Output;
use crate::{Error, Sink, Space, textures};

pub use kinran_bake::curvature::{BLUR, Method};
pub use kinran_bake::folder::{Folder, FolderError, Green, Hints, Role, Row};

pub use curvature::{Joined, measured, meshes, pose_scale, triangles_of, unit};
pub use folder::{FolderOptions, folder, folder_plan, understand};
pub use gltf::{Understood, gltf, gltf_space, texel_remarks, understand_gltf};
pub use gltf_options::{CurvatureOptions, Dump, GltfOptions, Target, Which};
pub use together::{Together, together, why_apart};

impl TextureOptions {
    /// The space of a texture's files.
    fn space(&self, format: Format, size: (u32, u32)) -> Space {
        Space::of_texture(self.container.unwrap_or_default(), self.zstd, format, size)
    }
}

/// Texels of all levels.
pub(crate) fn mip_texels((width, height): (u32, u32)) -> u64 {
    let levels = 0..full_level_count(width, height);
    levels.map(|level| u64::from(level_size(width, level)) * u64::from(level_size(height, level))).sum()
}

/// Writes a baked texture in the containers asked for; gives the reports of the files.
pub(crate) fn put_texture(
    how: &TextureOptions,
    name: &str,
    map: Content,
    mut texture: Texture,
    out: &dyn Sink,
) -> Result<Vec<Output>, Error> {
    texture.metadata.insert("KinranFilter".into(), how.filter.name().into());
    textures::put_texture(how.container.unwrap_or_default(), how.zstd, name, map, texture, out)
}

/// A name that is a file's on every system: what is not a letter, digit, dash, dot or underscore becomes `_`.
pub fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-._".contains(c) { c } else { '_' }).collect();
    let stem = stem.trim_start_matches('.');
    if stem.is_empty() { "material".into() } else { stem.into() }
}

//! Bakes: a folder of maps or a glTF file becomes textures whose every level is right.

mod curvature;
mod folder;
mod gltf;
mod gltf_options;
mod together;

use std::path::Path;

use kinran_image::{Format, Texture, encode_dds, encode_ktx2, full_level_count, level_size};

use crate::content::Content;
use crate::options::TextureOptions;
use crate::report::Output;
use crate::{Error, Sink, Space};

pub use kinran_bake::curvature::{BLUR, Method};
pub use kinran_bake::folder::{Folder, FolderError, Green, Hints, Role, Row};

pub use curvature::{Joined, measured, meshes, pose_scale, triangles_of, unit};
pub use folder::{FolderOptions, folder, folder_plan, understand};
pub use gltf::{Understood, gltf, gltf_space, texel_remarks, understand_gltf};
pub use gltf_options::{CurvatureOptions, Dump, GltfOptions, Which};

impl TextureOptions {
    /// The space of a texture's files.
    fn space(&self, format: Format, size: (u32, u32)) -> Space {
        Space::of_texture(self.container, self.zstd, format, size)
    }
}

/// Texels of all levels.
pub(crate) fn mip_texels((width, height): (u32, u32)) -> u64 {
    let levels = 0..full_level_count(width, height);
    levels.map(|level| u64::from(level_size(width, level)) * u64::from(level_size(height, level))).sum()
}

/// Writes a texture in the containers asked for; gives the reports of the files.
pub(crate) fn put_texture(
    how: &TextureOptions,
    name: &str,
    map: Content,
    mut texture: Texture,
    out: &dyn Sink,
) -> Result<Vec<Output>, Error> {
    map.mark(&mut texture);
    texture.metadata.insert("KinranFilter".into(), how.filter.name().into());
    how.container
        .extensions()
        .iter()
        .map(|extension| {
            let file = format!("{name}.{extension}");
            let bytes = match *extension {
                "dds" => encode_dds(&texture)?,
                _ => encode_ktx2(&texture, (how.zstd > 0).then_some(how.zstd))?,
            };
            out.put(&file, &bytes)?;
            Ok(Output::new(file, map, &texture, &bytes))
        })
        .collect()
}

/// A name that is a file's on every system: what is not a letter, digit, dash, dot or underscore becomes `_`.
pub fn file_stem(name: &str) -> String {
    let stem: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-._".contains(c) { c } else { '_' }).collect();
    let stem = stem.trim_start_matches('.');
    if stem.is_empty() { "material".into() } else { stem.into() }
}

/// The last component of a path, as text.
pub(crate) fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

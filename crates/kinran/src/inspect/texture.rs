//! What is inside a KTX2 or DDS file.

use std::collections::BTreeMap;
use std::path::Path;

use kinran_image::{Files, Texture, decode_texture};
use schemars::JsonSchema;
use serde::Serialize;

use super::statistics::Statistics;
use super::{file_name, read};
use crate::Error;
use crate::content::Content;

/// What is in a texture.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct TextureReport {
    /// The file's name.
    pub file: String,
    /// `texture`.
    pub kind: &'static str,
    /// Its texel format, in capitals.
    pub format: String,
    /// `linear`, `srgb` or `unsaid`.
    pub transfer: String,
    /// Texels in a row of level 0.
    pub width: u32,
    /// Rows of level 0.
    pub height: u32,
    /// Size of the file.
    pub file_bytes: u64,
    /// Size of all levels on a device.
    pub texture_bytes: u64,
    /// What it holds.
    pub role: Content,
    /// Its keys and their values.
    pub metadata: BTreeMap<String, String>,
    /// Its levels, the largest first.
    pub levels: Vec<LevelReport>,
}

/// A level of a texture.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LevelReport {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Size on a device.
    pub bytes: u64,
    /// Of its texels.
    #[serde(flatten)]
    pub statistics: Statistics,
}

pub(super) fn inspect(files: &dyn Files, path: &Path, role: Option<Content>) -> Result<TextureReport, Error> {
    let bytes = read(files, path)?;
    let texture = decode_texture(path, &bytes)?;
    let role = match role {
        Some(role) => role,
        None => stored_role(path, &texture)?,
    };
    let texels = texels(role, &texture);
    let levels = texture.levels.iter().enumerate().map(|(i, level)| -> Result<LevelReport, Error> {
        let statistics = Statistics::new(texels, &texture.decode_level(i)?)
            .ok_or_else(|| Error::Internal(format!("{}: level {i} has no texels", path.display())))?;
        let bytes = level.data.len() as u64;
        Ok(LevelReport { width: level.width, height: level.height, bytes, statistics })
    });
    let levels: Vec<LevelReport> = levels.collect::<Result<_, _>>()?;
    Ok(TextureReport {
        file: file_name(path),
        kind: "texture",
        format: format!("{:?}", texture.format).to_uppercase(),
        transfer: format!("{:?}", texture.transfer).to_lowercase(),
        width: texture.levels[0].width,
        height: texture.levels[0].height,
        file_bytes: bytes.len() as u64,
        texture_bytes: levels.iter().map(|level| level.bytes).sum(),
        role,
        metadata: texture.metadata,
        levels,
    })
}

/// What the texture's own key says it holds, else what its format suggests.
fn stored_role(path: &Path, texture: &Texture) -> Result<Content, Error> {
    let Some(name) = texture.metadata.get(Content::KEY) else { return Ok(Content::suggested(texture)) };
    Content::named(name).ok_or_else(|| Error::UnknownContent { file: path.to_path_buf(), name: name.clone() })
}

/// As what texels are read: tiles and what lies over them hold what their format suggests.
fn texels(role: Content, texture: &Texture) -> Content {
    match role {
        Content::Synthesized | Content::Detail => Content::suggested(texture),
        other => other,
    }
}

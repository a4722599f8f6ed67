//! What a texture holds, as its key and its sidecar name it: one list for those who write, inspect and draw.

use std::borrow::Cow;

use kinran_bake::aniso::Sheet;
use kinran_image::{Format, Texture, Transfer};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

/// What a texture that Kinran writes holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Tangent-space normals, RG.
    Normal,
    /// Kinran's aniso map.
    Aniso,
    /// Perceptual roughness in G.
    Roughness,
    /// `KHR_materials_anisotropy`: RG direction, B strength.
    Anisotropy,
    /// Occlusion, roughness, metalness.
    Orm,
    /// Colour.
    Color,
    /// `KHR_materials_specular`: colour of what reflects that is not metal.
    SpecularColor,
    /// Masks.
    Data,
    /// The map that turns tiles into their target.
    Synthesized,
    /// A tile of a detail map.
    Detail,
    /// Where a tile lies.
    Mask,
    /// What part of a punctual light leaves skin.
    SkinPunctual,
    /// What remains of ambient light's harmonics.
    SkinAmbient,
    /// Light that scatters into shadows.
    SkinPenumbra,
}

impl Content {
    /// The KTX2 key whose value is a [`Content::name`].
    pub const KEY: &str = "KinranMap";

    /// All of them.
    pub const ALL: [Content; 14] = [
        Content::Normal,
        Content::Aniso,
        Content::Roughness,
        Content::Anisotropy,
        Content::Orm,
        Content::Color,
        Content::SpecularColor,
        Content::Data,
        Content::Synthesized,
        Content::Detail,
        Content::Mask,
        Content::SkinPunctual,
        Content::SkinAmbient,
        Content::SkinPenumbra,
    ];

    /// The name in file names, keys, sidecars and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Content::Normal => "normal",
            Content::Aniso => "aniso",
            Content::Roughness => "roughness",
            Content::Anisotropy => "anisotropy",
            Content::Orm => "orm",
            Content::Color => "color",
            Content::SpecularColor => "specular-color",
            Content::Data => "data",
            Content::Synthesized => "synthesized",
            Content::Detail => "detail",
            Content::Mask => "mask",
            Content::SkinPunctual => "skin-punctual",
            Content::SkinAmbient => "skin-ambient",
            Content::SkinPenumbra => "skin-penumbra",
        }
    }

    /// The content of this name.
    pub fn named(name: &str) -> Option<Content> {
        Content::ALL.into_iter().find(|content| content.name() == name)
    }

    /// What a texture's format suggests where nothing says more: BC5 normals, sRGB colour, anything else data.
    pub fn suggested(texture: &Texture) -> Content {
        match (texture.format, texture.transfer) {
            (Format::Bc5, _) => Content::Normal,
            (_, Transfer::Srgb) => Content::Color,
            _ => Content::Data,
        }
    }

    /// Writes the key.
    pub fn mark(self, texture: &mut Texture) {
        texture.metadata.insert(Content::KEY.into(), self.name().into());
    }
}

impl From<Sheet> for Content {
    fn from(sheet: Sheet) -> Content {
        match sheet {
            Sheet::Normal => Content::Normal,
            Sheet::Aniso => Content::Aniso,
            Sheet::Roughness | Sheet::IsotropicRoughness => Content::Roughness,
            Sheet::KhrAnisotropy => Content::Anisotropy,
        }
    }
}

impl JsonSchema for Content {
    fn schema_name() -> Cow<'static, str> {
        "Content".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "enum": Content::ALL.map(Content::name) })
    }
}

impl Serialize for Content {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::Content;

    #[test]
    fn a_name_is_another_contents() {
        for content in Content::ALL {
            assert_eq!(Content::named(content.name()), Some(content));
        }
        assert_eq!(Content::named("velvet"), None);
    }
}

//! `KINRAN_materials_detail`: maps that are blended from tiles and a synthesized map.

use std::f32::consts::TAU;

use glam::{Mat2, Vec2, Vec3, vec2, vec3};
use serde_json::{Map, Value, json};

use crate::TextureRef;
use crate::fuzz::{entry, number};

/// The extension's name.
pub const DETAIL_EXTENSION: &str = "KINRAN_materials_detail";

/// The most layers of a material.
pub const DETAIL_LAYERS_MAX: usize = 3;

/// A map that may be blended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DetailMap {
    /// Base colour, by overlay.
    BaseColor,
    /// Tangent-space normals, by reoriented normal mapping.
    Normal,
    /// Occlusion, roughness and metallic in channels, by overlay.
    Data,
    /// Aniso texels, by "over".
    Aniso,
}

impl DetailMap {
    /// All, in the order of [`Detail::maps`].
    pub const ALL: [DetailMap; 4] =
        [DetailMap::BaseColor, DetailMap::Normal, DetailMap::Data, DetailMap::Aniso];

    /// The property that holds its texture, in the extension and in a layer.
    pub fn property(self) -> &'static str {
        ["baseColorTexture", "normalTexture", "dataTexture", "anisoTexture"][self as usize]
    }
}

/// Where a layer's tile lies: `KHR_texture_transform`'s `uv' = translation * rotation * scale * uv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerTransform {
    /// How often the tile repeats over the unit square, along u and v.
    pub scale: Vec2,
    /// Radians.
    pub rotation: f32,
    /// In tiles.
    pub offset: Vec2,
    /// Every other tile is mirrored.
    pub mirror: bool,
}

impl Default for LayerTransform {
    fn default() -> Self {
        LayerTransform { scale: Vec2::ONE, rotation: 0.0, offset: Vec2::ZERO, mirror: false }
    }
}

impl LayerTransform {
    /// The matrix that `detail_uv` takes.
    pub fn matrix(&self) -> Mat2 {
        let r = self.cos_sin();
        Mat2::from_cols(vec2(r.x, -r.y) * self.scale.x, vec2(r.y, r.x) * self.scale.y)
    }

    /// Cosine and sine of the rotation, which `detail_turn_normal` takes; quarter turns are exact.
    pub fn cos_sin(&self) -> Vec2 {
        let quarters = self.rotation / (0.25 * TAU);
        if (quarters - quarters.round()).abs() < 1e-6 {
            return [vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(-1.0, 0.0), vec2(0.0, -1.0)]
                [(quarters.round() as i64).rem_euclid(4) as usize];
        }
        vec2(libm::cosf(self.rotation), libm::sinf(self.rotation))
    }
}

/// Where a layer is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct DetailMask {
    /// Linear, in the place of the synthesized map, repeating.
    pub texture: TextureRef,
    /// 0 red to 3 alpha.
    pub channel: usize,
    /// 1 leaves the mask as it is.
    pub contrast: f32,
}

/// A tiled layer of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct DetailLayer {
    /// Where its tiles lie, in the coordinates of the synthesized map.
    pub transform: LayerTransform,
    /// Of base colour: hue in turns, factors of saturation and value.
    pub hsv: Vec3,
    /// How much of it is seen over the layers before; the first layer has none.
    pub mask: Option<DetailMask>,
    /// Multiplies the mask, 0 to 1.
    pub opacity: f32,
    /// In the order of [`DetailMap::ALL`]. Where one is missing, that map stays as the layers before left it.
    pub tiles: [Option<TextureRef>; 4],
}

impl Default for DetailLayer {
    /// Once over the unit square, without tiles.
    fn default() -> Self {
        DetailLayer {
            transform: LayerTransform::default(),
            hsv: vec3(0.0, 1.0, 1.0),
            mask: None,
            opacity: 1.0,
            tiles: [const { None }; 4],
        }
    }
}

/// Maps that take the place of the material's own.
#[derive(Clone, Debug, PartialEq)]
pub struct Detail {
    /// Overlay as it is, instead of the smooth one.
    pub plain_overlay: bool,
    /// The synthesized maps, in the order of [`DetailMap::ALL`].
    pub maps: [Option<TextureRef>; 4],
    /// Which channel of the data map is occlusion, roughness, metallic.
    pub channels: [Option<usize>; 3],
    /// Opacity of the layers over an aniso map, 0 to 1.
    pub aniso_alpha: f32,
    /// From the bottom up, at most [`DETAIL_LAYERS_MAX`].
    pub layers: Vec<DetailLayer>,
}

impl Default for Detail {
    /// Nothing is blended.
    fn default() -> Self {
        Detail {
            plain_overlay: false,
            maps: [const { None }; 4],
            channels: [Some(0), Some(1), Some(2)],
            aniso_alpha: 0.5,
            layers: Vec::new(),
        }
    }
}

/// Properties of [`Detail::channels`].
pub(crate) const CHANNEL_PROPERTIES: [&str; 3] = ["occlusionChannel", "roughnessChannel", "metallicChannel"];

/// Names of channels in files.
pub(crate) const CHANNELS: [(&str, usize); 4] = [("r", 0), ("g", 1), ("b", 2), ("a", 3)];

impl Detail {
    /// Every texture of it.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let layers = self.layers.iter().flat_map(|layer| {
            layer.tiles.iter().flatten().chain(layer.mask.as_ref().map(|mask| &mask.texture))
        });
        self.maps.iter().flatten().chain(layers)
    }

    /// Writes the extension into a glTF material, as a whole. `texture` gives the index of the texture that
    /// [`TextureRef::image`] stands for. The document must list the extension as used.
    pub fn write(&self, material: &mut Map<String, Value>, texture: impl Fn(usize) -> usize) {
        let info = |place: &TextureRef| {
            let mut info = json!({ "index": texture(place.image) });
            if place.uv_set != 0 {
                info["texCoord"] = place.uv_set.into();
            }
            info
        };
        let mut detail = Map::new();
        if self.plain_overlay {
            detail.insert("blend".into(), "plain".into());
        }
        for (map, place) in DetailMap::ALL.iter().zip(&self.maps) {
            if let Some(place) = place {
                detail.insert(map.property().into(), info(place));
            }
        }
        if self.maps[DetailMap::Data as usize].is_some() {
            for (property, channel) in CHANNEL_PROPERTIES.iter().zip(self.channels) {
                let name = channel.map_or("none", |channel| CHANNELS[channel].0);
                detail.insert((*property).into(), name.into());
            }
        }
        if self.maps[DetailMap::Aniso as usize].is_some() {
            detail.insert("anisoAlpha".into(), number(self.aniso_alpha));
        }
        let layers = self.layers.iter().map(|layer| {
            let LayerTransform { scale, rotation, offset, mirror } = layer.transform;
            let mut object = json!({ "scale": scale.to_array().map(number) });
            let mut set = |key: &str, value: Value, default: Value| {
                if value != default {
                    object[key] = value;
                }
            };
            set("rotation", number(rotation), number(0.0));
            set("offset", json!(offset.to_array().map(number)), json!([0.0, 0.0]));
            set("mirror", json!(mirror), json!(false));
            set("hue", number(layer.hsv.x), number(0.0));
            set("saturation", number(layer.hsv.y), number(1.0));
            set("value", number(layer.hsv.z), number(1.0));
            set("opacity", number(layer.opacity), number(1.0));
            if let Some(mask) = &layer.mask {
                set("maskTexture", info(&mask.texture), Value::Null);
                set("maskChannel", json!(CHANNELS[mask.channel].0), json!("r"));
                set("maskContrast", number(mask.contrast), number(1.0));
            }
            for (map, tile) in DetailMap::ALL.iter().zip(&layer.tiles) {
                if let Some(tile) = tile {
                    set(map.property(), json!({ "index": texture(tile.image) }), Value::Null);
                }
            }
            object
        });
        detail.insert("layers".into(), layers.collect());
        entry(material, "extensions").insert(DETAIL_EXTENSION.into(), detail.into());
    }
}

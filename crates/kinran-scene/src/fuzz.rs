//! `KINRAN_materials_fuzz`, and `KHR_materials_sheen` read as fuzz and written for others.

use glam::Vec3;
use kinran_shading::fuzz::fuzz_g;
use serde_json::{Map, Value, json};

use crate::TextureRef;

/// The extension's name.
pub const FUZZ_EXTENSION: &str = "KINRAN_materials_fuzz";

/// How fibres scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FuzzPhase {
    /// SGGX fibres.
    #[default]
    Fibre,
    /// Schlick's phase about the fibre.
    Velvet,
}

/// What a layer of fibres leaves of the base.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FuzzAttenuation {
    /// What reaches it unscattered or scattered down.
    #[default]
    Full,
    /// What reaches it unscattered: the talk's P_s = 0.
    Unscattered,
    /// One minus the layer's directional albedo, as `KHR_materials_sheen` has it.
    Albedo,
    /// All of it.
    None,
}

/// How a direction texture holds fibres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FuzzDirection {
    /// A tangent-space vector, encoded as a normal map is, +Y up.
    #[default]
    Vector,
    /// Tilt from the normal over π/2 in R, azimuth from the tangent over 2π in G. Renderers turn them into vectors before
    /// anything is averaged.
    Angles,
}

/// A layer of fibres over the base.
#[derive(Clone, Debug, PartialEq)]
pub struct FuzzLayer {
    /// How fibres scatter.
    pub phase: FuzzPhase,
    /// Thickness over mean free path, 0 to 2, multiplied with the red channel of its texture.
    pub density: f32,
    /// Linear.
    pub density_texture: Option<TextureRef>,
    /// How far fibres spread about their direction, 0 (combed) to 1 (in all directions).
    pub spread: f32,
    /// Albedo of the fibres, linear, 0 to 1, multiplied with its texture.
    pub color: Vec3,
    /// sRGB.
    pub color_texture: Option<TextureRef>,
    /// Radians from the normal, 0 to π/2.
    pub tilt: f32,
    /// Radians, counter-clockwise from the tangent.
    pub azimuth: f32,
    /// The fibres' direction; it takes the place of tilt and azimuth. Linear.
    pub direction_texture: Option<TextureRef>,
    /// How the texture holds it.
    pub direction_encoding: FuzzDirection,
    /// 0 shades the layer with the base's normal, 1 with the mesh's.
    pub normal_smoothness: f32,
    /// What is left of the base.
    pub attenuation: FuzzAttenuation,
}

impl Default for FuzzLayer {
    /// White upright fibres of the talk's density and spread.
    fn default() -> Self {
        FuzzLayer {
            phase: FuzzPhase::Fibre,
            density: 0.2,
            density_texture: None,
            spread: 0.2,
            color: Vec3::ONE,
            color_texture: None,
            tilt: 0.0,
            azimuth: 0.0,
            direction_texture: None,
            direction_encoding: FuzzDirection::Vector,
            normal_smoothness: 0.0,
            attenuation: FuzzAttenuation::Full,
        }
    }
}

/// Fuzz on a material.
#[derive(Clone, Debug, PartialEq)]
pub enum Fuzz {
    /// A layer with its own parameters.
    Layer(FuzzLayer),
    /// The talk's form for seven bits of a G-buffer: fixed upright fibres blended with the diffuse base.
    Simple {
        /// 0 to 1, multiplied with the red channel of its texture.
        fuzziness: f32,
        /// Linear.
        texture: Option<TextureRef>,
    },
}

/// Sheen roughness, and density, spread and albedo of the upright fibres that look most like it.
///
/// Least squares of BRDF times cosine over all lights and views, against Khronos' sheen (Charlie's distribution
/// with the fitted shadowing of Estevez and Kulla 2017), for densities up to 1.5 and albedos up to 1. Relative
/// error 0.85, 0.77, 0.62, 0.43, 0.23, 0.17, 0.16 in order: below a roughness of 0.6 sheen is brighter at
/// grazing than any single scattering. `kinran-bake`'s tests repeat the match.
pub const SHEEN_MATCH: [[f32; 4]; 7] = [
    [0.1, 0.670, 0.048, 1.0],
    [0.25, 1.013, 0.193, 1.0],
    [0.4, 1.274, 0.329, 1.0],
    [0.55, 1.481, 0.432, 1.0],
    [0.7, 1.5, 0.492, 1.0],
    [0.85, 1.5, 0.565, 0.880],
    [1.0, 1.5, 0.665, 0.773],
];

/// A row of [`SHEEN_MATCH`] where its column `key` is `value`, interpolated; the column must grow.
fn match_at(key: usize, value: f32) -> [f32; 4] {
    let last = SHEEN_MATCH.len() - 1;
    let after = SHEEN_MATCH.iter().position(|row| row[key] >= value).unwrap_or(last).max(1);
    let (low, high) = (SHEEN_MATCH[after - 1], SHEEN_MATCH[after]);
    let f = ((value - low[key]) / (high[key] - low[key])).clamp(0.0, 1.0);
    std::array::from_fn(|i| low[i] + (high[i] - low[i]) * f)
}

impl FuzzLayer {
    /// Upright fibres for a sheen of linear `color` and `roughness`, 0 to 1: see [`SHEEN_MATCH`]. The base is attenuated as
    /// the sheen extension attenuates it.
    pub fn from_sheen(color: Vec3, roughness: f32) -> Self {
        let [_, density, spread, albedo] = match_at(0, roughness);
        FuzzLayer {
            density,
            spread,
            color: color * albedo,
            attenuation: FuzzAttenuation::Albedo,
            ..FuzzLayer::default()
        }
    }

    /// Colour and roughness of the sheen that looks most like this layer: the roughness by the spread, by
    /// [`SHEEN_MATCH`], and the colour by the ratio of both layers' G at a view of 60°. Tilt and direction are lost.
    pub fn to_sheen(&self) -> (Vec3, f32) {
        let [roughness, density, _, albedo] = match_at(2, self.spread);
        let brightness = |density: f32| if density > 0.0 { fuzz_g(density, 0.5) } else { 0.0 };
        let color = self.color * (brightness(self.density) / (brightness(density) * albedo));
        (color.min(Vec3::ONE), roughness)
    }
}

impl Fuzz {
    /// Every texture of it.
    pub fn textures(&self) -> impl Iterator<Item = &TextureRef> {
        let slots = match self {
            Fuzz::Layer(layer) => [&layer.direction_texture, &layer.color_texture, &layer.density_texture],
            Fuzz::Simple { texture, .. } => [texture, &None, &None],
        };
        slots.into_iter().flatten()
    }

    /// Writes the parameters into a glTF material, leaving texture entries of the extension as they are, and the sheen
    /// that others show instead. The document must list both extensions as used.
    pub fn write(&self, material: &mut Map<String, Value>) {
        let extensions = entry(material, "extensions");
        let fuzz = entry(extensions, FUZZ_EXTENSION);
        let mut set = |key: &str, value: Value, default: Value| {
            if value == default {
                fuzz.remove(key);
            } else {
                fuzz.insert(key.to_owned(), value);
            }
        };
        match self {
            Fuzz::Simple { fuzziness, .. } => set("fuzziness", number(*fuzziness), Value::Null),
            Fuzz::Layer(layer) => {
                let default = FuzzLayer::default();
                set("fuzziness", Value::Null, Value::Null);
                set("phase", json!(layer.phase.name()), json!(default.phase.name()));
                set("density", number(layer.density), number(default.density));
                set("spread", number(layer.spread), number(default.spread));
                set("fiberColorFactor", color(layer.color), color(default.color));
                set("tilt", number(layer.tilt), number(default.tilt));
                set("azimuth", number(layer.azimuth), number(default.azimuth));
                set(
                    "directionEncoding",
                    json!(layer.direction_encoding.name()),
                    json!(default.direction_encoding.name()),
                );
                set("normalSmoothness", number(layer.normal_smoothness), number(default.normal_smoothness));
                set("attenuation", json!(layer.attenuation.name()), json!(default.attenuation.name()));
            }
        }
        let (sheen_color, roughness) = match self {
            Fuzz::Layer(layer) => layer.to_sheen(),
            // A faint grey halo; the simple form's colour is the base's, which sheen does not know.
            Fuzz::Simple { fuzziness, .. } => (Vec3::splat(0.5 * fuzziness), 0.9),
        };
        let texture = match self {
            Fuzz::Layer(_) => entry(extensions, FUZZ_EXTENSION).get("fiberColorTexture").cloned(),
            Fuzz::Simple { .. } => None,
        };
        let sheen = entry(extensions, "KHR_materials_sheen");
        sheen.insert("sheenColorFactor".to_owned(), color(sheen_color));
        sheen.insert("sheenRoughnessFactor".to_owned(), number(roughness));
        if let Some(texture) = texture {
            sheen.insert("sheenColorTexture".to_owned(), texture);
        }
    }
}

/// The object under a key, made where there is none.
pub(crate) fn entry<'a>(object: &'a mut Map<String, Value>, key: &str) -> &'a mut Map<String, Value> {
    let value = object.entry(key).or_insert_with(|| json!({}));
    if !value.is_object() {
        *value = json!({});
    }
    value.as_object_mut().expect("an object was just put there")
}

/// The shortest decimal that reads as this number in single precision.
pub(crate) fn number(x: f32) -> Value {
    x.to_string().parse::<f64>().map_or(Value::Null, |x| json!(x))
}

fn color(c: Vec3) -> Value {
    Value::Array(c.to_array().map(number).to_vec())
}

impl FuzzPhase {
    /// All, under the names that files have.
    pub const NAMES: [(&'static str, FuzzPhase); 2] =
        [("fiber", FuzzPhase::Fibre), ("velvet", FuzzPhase::Velvet)];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, phase)| *phase == self).map_or("", |(name, _)| name)
    }
}

impl FuzzDirection {
    /// All, under the names that files have.
    pub const NAMES: [(&'static str, FuzzDirection); 2] =
        [("vector", FuzzDirection::Vector), ("angles", FuzzDirection::Angles)];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, encoding)| *encoding == self).map_or("", |(name, _)| name)
    }
}

impl FuzzAttenuation {
    /// All, under the names that files have.
    pub const NAMES: [(&'static str, FuzzAttenuation); 4] = [
        ("full", FuzzAttenuation::Full),
        ("unscattered", FuzzAttenuation::Unscattered),
        ("albedo", FuzzAttenuation::Albedo),
        ("none", FuzzAttenuation::None),
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, attenuation)| *attenuation == self).map_or("", |(name, _)| name)
    }
}

//! What the window's controls say; what is saved and loaded.

use std::path::Path;

use glam::Vec3;
use kinran_bake::aniso::Filter;
use kinran_image::write_atomically;
use kinran_render::realtime::{Adjustment, Channel};
use kinran_render::reference::{RenderMaterial, RenderSkin, SkinCurvature, Translucency};
use kinran_render::tonemap::Tonemap;
use kinran_scene::{AlphaMode, Light, LightKind};
use kinran_shading::ALPHA_MIN;
use serde::{Deserialize, Serialize};

use super::detail::DetailParameters;
use super::fuzz::FuzzParameters;
use super::orbit::Orbit;
use crate::Error;
use crate::surfaces::{Colors, Method, Mips};
use crate::view::{Curve, EnvironmentChoice, ViewArgs};

/// Names and meanings of what can be shown of a surface.
pub(super) const CHANNELS: [(&str, Channel); 8] = [
    ("lit", Channel::Lit),
    ("normal", Channel::Normal),
    ("alpha_t", Channel::AlphaT),
    ("alpha_b", Channel::AlphaB),
    ("direction", Channel::Direction),
    ("mip level", Channel::Mip),
    ("base colour", Channel::BaseColor),
    ("curvature", Channel::Curvature),
];

/// Names and meanings of the curvatures that skin can be lit with.
pub(super) const CURVATURES: [(&str, SkinCurvature); 4] = [
    ("zero", SkinCurvature::Zero),
    ("mean", SkinCurvature::Mean),
    ("directional", SkinCurvature::Directional),
    ("normalised", SkinCurvature::Normalized),
];

const fn filtered(filter: Filter) -> Mips {
    let colors = if matches!(filter, Filter::Naive) { Colors::Apart } else { Colors::Together };
    Mips::Filtered(Method { filter, colors })
}

/// Names and meanings of the ways to filter. New ones come last: saved parameters hold places in this list.
pub(super) const METHODS: [(&str, Mips); 7] = [
    ("ml", filtered(Filter::Ml)),
    ("linear", filtered(Filter::Linear)),
    ("lean", filtered(Filter::Lean)),
    ("naive", filtered(Filter::Naive)),
    ("ground truth", Mips::Level0),
    ("as baked", Mips::Baked),
    ("dpd", filtered(Filter::Dpd)),
];

/// A material as the sliders have it; factors multiply its textures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct MaterialParameters {
    pub(super) base_color: [f32; 3],
    pub(super) metallic: f32,
    /// Perceptual roughness; multiplies what is baked where there are maps.
    pub(super) roughness: f32,
    /// Exponent of the ratio of both alphas.
    pub(super) anisotropy: f32,
    /// Degrees.
    pub(super) rotation: f32,
    pub(super) normal_scale: f32,
    /// Colour of what is emitted, and its strength.
    pub(super) emissive: [f32; 3],
    pub(super) emission: f32,
    pub(super) occlusion: f32,
    #[serde(default)]
    pub(super) fuzz: FuzzParameters,
    /// Alpha, which matters to materials that are masked or blended.
    pub(super) opacity: f32,
    /// Alpha below it is a hole in a masked material.
    pub(super) alpha_cutoff: f32,
    /// Share of the scattered light that comes out on the other side, and its colour.
    pub(super) translucency: f32,
    pub(super) translucent_color: [f32; 3],
    /// Where the material is skin.
    #[serde(default)]
    pub(super) skin: Option<SkinParameters>,
    /// Where maps are blended from tiles.
    #[serde(default)]
    pub(super) detail: Option<DetailParameters>,
}

/// A material's skin as the sliders have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SkinParameters {
    /// Index into [`CURVATURES`].
    pub(super) curvature: usize,
    /// How far the diffuse normals of red, green and blue turn to the mesh's.
    pub(super) normal_blur: [f32; 3],
    /// Millimetres over which shadows are filtered, and in which light scatters.
    #[serde(default)]
    pub(super) penumbra: f32,
    /// Weight of the second lobe of gloss.
    pub(super) second_share: f32,
    /// Its perceptual roughness.
    pub(super) second_roughness: f32,
}

impl SkinParameters {
    pub(super) fn of(skin: &RenderSkin) -> Self {
        Self {
            curvature: CURVATURES.iter().position(|(_, c)| *c == skin.curvature).unwrap_or(0),
            normal_blur: skin.normal_blur.to_array(),
            penumbra: skin.penumbra,
            second_share: skin.second_share,
            second_roughness: skin.second_alpha.sqrt(),
        }
    }

    pub(super) fn apply(&self, skin: &mut RenderSkin) {
        skin.curvature = CURVATURES[self.curvature.min(CURVATURES.len() - 1)].1;
        skin.normal_blur = Vec3::from(self.normal_blur);
        skin.penumbra = self.penumbra;
        skin.second_share = self.second_share;
        skin.second_alpha = (self.second_roughness * self.second_roughness).max(ALPHA_MIN);
    }
}

impl MaterialParameters {
    /// What a material says before anything is turned.
    pub(super) fn authored(m: &RenderMaterial) -> Self {
        let emission = m.emissive_factor.max_element();
        let translucency = m.translucency.as_ref();
        Self {
            base_color: m.base_color_factor.truncate().to_array(),
            metallic: m.metallic_factor,
            roughness: m.roughness_factor,
            anisotropy: 1.0,
            rotation: 0.0,
            normal_scale: 1.0,
            emissive: if emission > 0.0 { (m.emissive_factor / emission).to_array() } else { [1.0; 3] },
            emission,
            occlusion: m.occlusion_strength,
            fuzz: FuzzParameters::from(&m.fuzz),
            skin: m.skin.as_ref().map(SkinParameters::of),
            detail: m.detail.as_ref().map(DetailParameters::from),
            opacity: m.base_color_factor.w,
            alpha_cutoff: match m.alpha_mode {
                AlphaMode::Mask { cutoff } => cutoff,
                _ => 0.5,
            },
            translucency: translucency.map_or(0.0, |t| t.factor),
            translucent_color: translucency
                .map_or(m.base_color_factor.truncate(), |t| t.color_factor)
                .to_array(),
        }
    }

    /// Writes the factors into a material; its textures stay.
    pub(super) fn apply(&self, m: &mut RenderMaterial) {
        m.base_color_factor = Vec3::from(self.base_color).extend(self.opacity);
        m.metallic_factor = self.metallic;
        m.roughness_factor = self.roughness;
        m.emissive_factor = self.emission * Vec3::from(self.emissive);
        m.occlusion_strength = self.occlusion;
        if let AlphaMode::Mask { cutoff } = &mut m.alpha_mode {
            *cutoff = self.alpha_cutoff;
        }
        if m.translucency.is_some() || self.translucency > 0.0 {
            let (map, color) = m.translucency.take().map_or((None, None), |t| (t.map, t.color));
            let color_factor = Vec3::from(self.translucent_color);
            m.translucency = Some(Translucency { factor: self.translucency, map, color_factor, color });
        }
    }

    pub(super) fn adjustment(&self, mapped: bool) -> Adjustment {
        // The factor of an unmapped material is its roughness itself; alpha goes with the square.
        let roughness = if mapped { self.roughness * self.roughness } else { 1.0 };
        Adjustment {
            roughness,
            anisotropy: self.anisotropy,
            rotation: self.rotation.to_radians(),
            normal_scale: self.normal_scale,
        }
    }
}

/// A directional light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Sun {
    pub(super) on: bool,
    /// Degrees about +y from +z.
    pub(super) azimuth: f32,
    /// Degrees above the horizon.
    pub(super) elevation: f32,
    /// Lux.
    pub(super) lux: f32,
}

impl Sun {
    pub(super) fn light(&self) -> Light {
        let (sin, cos) = self.elevation.to_radians().sin_cos();
        let azimuth = self.azimuth.to_radians();
        Light {
            kind: LightKind::Directional,
            color: Vec3::splat(self.lux),
            position: Vec3::ZERO,
            direction: -Vec3::new(azimuth.sin() * cos, sin, azimuth.cos() * cos),
            range: f32::INFINITY,
        }
    }
}

/// Both sides.
fn both() -> [bool; 2] {
    [true; 2]
}

/// Everything that a control sets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Parameters {
    /// Index into [`METHODS`]: what is left of the split line, and right of it.
    pub(super) methods: [usize; 2],
    /// Whether they filter colour, metalness and lobe together.
    #[serde(default = "both")]
    pub(super) correlated: [bool; 2],
    /// Whether there is a split line.
    pub(super) split: bool,
    /// Share of the picture left of it.
    pub(super) split_at: f32,
    /// Index into [`CHANNELS`].
    pub(super) channel: usize,
    /// Stops.
    pub(super) exposure: f32,
    /// `aces`, `agx` or `none`.
    pub(super) tonemap: String,
    /// A file, `studio` or `none`.
    pub(super) environment: String,
    /// Degrees.
    pub(super) environment_rotation: f32,
    /// The environment is seen behind the model.
    pub(super) background: bool,
    /// The file's own lights shine.
    pub(super) own_lights: bool,
    /// Their intensities, candela or lux; empty until a model is loaded.
    pub(super) intensities: Vec<f32>,
    pub(super) sun: Sun,
    pub(super) shadows: bool,
    pub(super) all_deferred: bool,
    /// `None` until a model is framed.
    pub(super) orbit: Option<Orbit>,
    /// As many as the model has; empty until one is loaded.
    pub(super) materials: Vec<MaterialParameters>,
}

impl Parameters {
    /// What the flags of the command line say.
    pub(super) fn from_args(view: &ViewArgs) -> Self {
        let towards = view.light.first().copied().unwrap_or(Vec3::new(-0.5, 0.7, 0.6)).normalize();
        Self {
            methods: [0, 3],
            correlated: both(),
            split: false,
            split_at: 0.5,
            channel: 0,
            exposure: view.exposure,
            tonemap: match view.tonemap {
                Curve::Aces => "aces",
                Curve::Agx => "agx",
                Curve::None => "none",
            }
            .into(),
            environment: match view.environment() {
                EnvironmentChoice::Studio => "studio".into(),
                EnvironmentChoice::None => "none".into(),
                EnvironmentChoice::File(path) => path.to_string_lossy().into_owned(),
            },
            environment_rotation: view.env_rotation,
            background: matches!(view.env, Some(EnvironmentChoice::File(_))),
            own_lights: view.light.is_empty(),
            intensities: Vec::new(),
            sun: Sun {
                on: !view.light.is_empty() || view.environment() == EnvironmentChoice::None,
                azimuth: towards.x.atan2(towards.z).to_degrees(),
                elevation: towards.y.asin().to_degrees(),
                lux: std::f32::consts::PI,
            },
            shadows: !view.no_shadows,
            all_deferred: false,
            orbit: None,
            materials: Vec::new(),
        }
    }

    /// What to draw with, left and right of the line.
    pub(super) fn mips(&self) -> [Mips; 2] {
        [0, 1].map(|side| METHODS[self.methods[side]].1.correlated(self.correlated[side]))
    }

    /// The tone curve named.
    pub(super) fn curve(&self) -> Tonemap {
        match self.tonemap.as_str() {
            "none" => Tonemap::None,
            "agx" => Tonemap::AgX,
            _ => Tonemap::Aces,
        }
    }

    /// Reads what [`Parameters::save`] wrote.
    ///
    /// # Errors
    /// One with the file and what is wrong in it.
    pub(super) fn load(path: &Path) -> Result<Self, Error> {
        let complain = |reason: String| Error::file_error(path, reason);
        let text = std::fs::read_to_string(path).map_err(|e| kinran_image::Error::io(path, e))?;
        let parameters: Self = serde_json::from_str(&text)
            .map_err(|e| complain(format!("{e}; save the parameters again in the window")))?;
        let checks = [
            ("methods", parameters.methods.iter().all(|&m| m < METHODS.len()), "two numbers from 0 to 6"),
            ("channel", parameters.channel < CHANNELS.len(), "a number from 0 to 6"),
            ("split_at", (0.0..=1.0).contains(&parameters.split_at), "a number from 0 to 1"),
            ("tonemap", ["aces", "agx", "none"].contains(&parameters.tonemap.as_str()), "aces, agx or none"),
        ];
        for (field, good, want) in checks {
            if !good {
                return Err(complain(format!("{field} must be {want}")));
            }
        }
        Ok(parameters)
    }

    /// Writes everything as JSON, whole or not at all.
    ///
    /// # Errors
    /// Those of [`write_atomically`].
    pub(super) fn save(&self, path: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(write_atomically(path, (text + "\n").as_bytes())?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saved_parameters_come_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let mut parameters = Parameters::from_args(&ViewArgs::default());
        parameters.sun.azimuth = 12.5;
        parameters.split = true;
        parameters.correlated = [true, false];
        parameters.save(&path).unwrap();
        assert_eq!(Parameters::load(&path).unwrap(), parameters);
        // As they were saved before there was the switch.
        let saved = std::fs::read_to_string(&path).unwrap();
        let mut older: serde_json::Value = serde_json::from_str(&saved).unwrap();
        older.as_object_mut().unwrap().remove("correlated").unwrap();
        std::fs::write(&path, older.to_string()).unwrap();
        assert_eq!(Parameters::load(&path).unwrap(), Parameters { correlated: [true; 2], ..parameters });
    }

    #[test]
    fn a_switch_acts_on_its_side_and_not_on_what_it_cannot_change() {
        let off = |method: usize| {
            let parameters = Parameters::from_args(&ViewArgs::default());
            Parameters { methods: [method; 2], correlated: [true, false], ..parameters }.mips()
        };
        for (method, (name, mips)) in METHODS.iter().enumerate() {
            let [left, right] = off(method);
            assert_eq!(left, *mips, "{name}");
            let changes = !matches!(*name, "naive" | "ground truth" | "as baked");
            assert_eq!(right != left, changes, "{name}");
        }
    }

    #[test]
    fn a_number_out_of_range_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let parameters = Parameters { channel: 99, ..Parameters::from_args(&ViewArgs::default()) };
        parameters.save(&path).unwrap();
        let error = Parameters::load(&path).unwrap_err().to_string();
        assert!(error.contains("a.json") && error.contains("channel"), "{error}");
    }

    #[test]
    fn the_sun_stands_where_its_angles_say() {
        let sun = Sun { on: true, azimuth: 90.0, elevation: 30.0, lux: 1.0 };
        let want = -Vec3::new(0.75_f32.sqrt(), 0.5, 0.0);
        let got = sun.light().direction;
        assert!((want - got).length() < 1e-6, "wanted {want}, got {got}");
    }
}

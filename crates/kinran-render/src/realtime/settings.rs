//! What a frame shows, and what it leaves out.

use kinran_scene::{Light, LightKind};

use crate::reference::{Background, RenderScene};
use crate::tonemap::Tonemap;

/// Lights that a frame may have.
pub const MAX_LIGHTS: usize = 16;

/// What is shown of surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Channel {
    /// The lit picture.
    #[default]
    Lit,
    /// World-space normal, from [-1, 1] to [0, 1].
    Normal,
    /// The larger roughness.
    AlphaT,
    /// The smaller roughness.
    AlphaB,
    /// Direction of the larger roughness as hue, anisotropy as brightness.
    Direction,
    /// Level of detail of the normal map over ten.
    Mip,
    /// Base colour.
    BaseColor,
    /// Mean curvature of skin in false colour, black to white.
    Curvature,
}

/// How to draw a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The first directional light casts shadows.
    pub shadows: bool,
    /// The environment is reflected; otherwise it only lights what scatters.
    pub reflections: bool,
    /// Behind everything. The environment is shown sharp: `blur` is not followed.
    pub background: Background,
    /// What is shown.
    pub channel: Channel,
    /// Stops, for [`Realtime::show`](super::Realtime::show).
    pub exposure: f32,
    /// Tone curve, for [`Realtime::show`](super::Realtime::show).
    pub tonemap: Tonemap,
    /// Every opaque material takes the deferred path, its roughness made round.
    pub all_deferred: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            shadows: true,
            reflections: true,
            background: Background::Environment { blur: 0.0 },
            channel: Channel::Lit,
            exposure: 0.0,
            tonemap: Tonemap::Aces,
            all_deferred: false,
        }
    }
}

/// The light whose shadows are drawn.
pub(super) fn sun(scene: &RenderScene) -> Option<&Light> {
    scene.lights.iter().take(MAX_LIGHTS).find(|light| light.kind == LightKind::Directional)
}

pub(super) fn has_sun(scene: &RenderScene, settings: &Settings) -> bool {
    settings.shadows && sun(scene).is_some()
}

/// What this renderer leaves out of a scene that the reference draws, a sentence each.
pub fn left_out(scene: &RenderScene, settings: &Settings) -> Vec<String> {
    let lights = scene.lights.len();
    let mut sentences = Vec::new();
    if lights > MAX_LIGHTS {
        sentences.push(format!("only the first {MAX_LIGHTS} of {lights} lights shine"));
    }
    let shadowless = lights.min(MAX_LIGHTS) - usize::from(sun(scene).is_some());
    if settings.shadows && shadowless > 0 {
        sentences.push(format!(
            "{shadowless} of {lights} lights cast no shadows: the first directional light alone has a shadow map"
        ));
    }
    if matches!(settings.background, Background::Environment { blur } if blur > 0.0) {
        sentences.push("the environment is seen sharp, not blurred".into());
    }
    sentences
}

//! Light from punctual sources (`KHR_lights_punctual`).

use glam::Vec3;
use kinran_scene::{Light, LightKind};

/// What arrives at a point from a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Incident {
    /// Unit direction towards the light.
    pub(crate) direction: Vec3,
    /// Distance to the light; infinite for directional ones.
    pub(crate) distance: f32,
    /// Irradiance on a surface that faces the light: lux times colour.
    pub(crate) irradiance: Vec3,
}

/// Light arriving at `position`; `None` out of range, outside the cone, or at the light itself.
pub(crate) fn incident(light: &Light, position: Vec3) -> Option<Incident> {
    let LightKind::Directional = light.kind else {
        let to_light = light.position - position;
        let distance = to_light.length();
        if distance == 0.0 {
            return None;
        }
        let direction = to_light / distance;
        let falloff = match light.kind {
            LightKind::Spot { inner_cone_angle, outer_cone_angle } => {
                cone(-direction.dot(light.direction), inner_cone_angle, outer_cone_angle)
            }
            _ => 1.0,
        };
        let window = (1.0 - (distance / light.range).powi(4)).clamp(0.0, 1.0);
        let irradiance = light.color * (falloff * window / (distance * distance));
        return (irradiance != Vec3::ZERO).then_some(Incident { direction, distance, irradiance });
    };
    Some(Incident { direction: -light.direction, distance: f32::INFINITY, irradiance: light.color })
}

/// The extension's recommended cone: the square of a linear ramp in the cosine of the angle from the axis.
fn cone(cosine: f32, inner: f32, outer: f32) -> f32 {
    let (inner, outer) = (libm::cosf(inner), libm::cosf(outer));
    let ramp = (cosine - outer) / (inner - outer).max(1e-3);
    ramp.clamp(0.0, 1.0).powi(2)
}

//! The lobe under the specular one.

use glam::Vec3;
use std::f32::consts::FRAC_1_PI;

/// What a surface of this albedo scatters of a light that comes in at right angles, per steradian, without the cosine:
/// Lambert's lobe, the same in all directions. So it is also what is scattered of an irradiance.
#[inline]
pub(super) fn diffuse_lobe(albedo: Vec3) -> Vec3 {
    albedo * FRAC_1_PI
}

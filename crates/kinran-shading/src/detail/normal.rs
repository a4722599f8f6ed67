//! Normals laid over each other.

use crate::sqrt::sqrt;
use glam::{Vec3, vec3};

/// Reoriented normal mapping: the unit normal `detail` in the frame of the unit normal `base`, both with z ≥ 0;
/// equals `m_n(base) * detail` (slide: Detail Maps; Barré-Brisebois and Hill. Blending in Detail. 2012).
#[inline(always)]
pub fn rnm(base: Vec3, detail: Vec3) -> Vec3 {
    let t = vec3(base.x, base.y, base.z + 1.0);
    let u = vec3(-detail.x, -detail.y, detail.z);
    t * (t.dot(u) / t.z) - u
}

/// The base with `rnm(base, detail) = target`, all unit normals with z ≥ 0. The talk does not say which of the two
/// the synthesized normal is; read as `s ⊗ d`, it is the base.
///
/// With `w = (target.xy - detail.xy, target.z + detail.z)` the base is z mirrored at w, `2 w w.z / |w|² - z`: exact.
/// It would lie under the horizon where `|w.xy| > w.z`, which takes target and detail more than 90° apart
/// on both sides of z; then the base on the horizon in the same direction is the answer.
#[inline(always)]
pub fn rnm_inverse(target: Vec3, detail: Vec3) -> Vec3 {
    let w = vec3(target.x - detail.x, target.y - detail.y, target.z + detail.z);
    let flat = w.x * w.x + w.y * w.y;
    let z_squared = w.z * w.z;
    if flat < z_squared {
        let scale = 2.0 * w.z / (flat + z_squared);
        vec3(w.x * scale, w.y * scale, (z_squared - flat) / (flat + z_squared))
    } else if flat > 1e-12 {
        let scale = sqrt(flat).recip();
        vec3(w.x * scale, w.y * scale, 0.0)
    } else {
        // Both on the horizon and opposite.
        target
    }
}

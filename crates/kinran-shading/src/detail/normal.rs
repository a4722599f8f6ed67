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

/// The base, a unit normal with z ≥ 0, whose `rnm(base, detail)` is the target or nearest to it; target and detail are
/// such normals too. The talk does not say which of the two the synthesized normal is; read as `s ⊗ d`, it is the base.
///
/// With `w = (target.xy - detail.xy, target.z + detail.z)` the base is z mirrored at w, `2 w w.z / |w|² - z`: exact.
/// It would lie under the horizon where `|w.xy| > w.z`, which takes target and detail more than 90° apart
/// on both sides of z; then the best base lies on the horizon, up to 1.5° nearer than the one in the same direction.
#[inline(always)]
pub fn rnm_inverse(target: Vec3, detail: Vec3) -> Vec3 {
    let w = vec3(target.x - detail.x, target.y - detail.y, target.z + detail.z);
    let flat = w.x * w.x + w.y * w.y;
    let z_squared = w.z * w.z;
    if flat < z_squared {
        let scale = 2.0 * w.z / (flat + z_squared);
        vec3(w.x * scale, w.y * scale, (z_squared - flat) / (flat + z_squared))
    } else {
        rnm_inverse_on_horizon(target, detail)
    }
}

/// Directions to start from: the cosine below has two peaks at most, which may be as high as each other, and each is
/// within 22.5° of one.
const COMPASS: [[f32; 2]; 8] = {
    const R: f32 = core::f32::consts::FRAC_1_SQRT_2;
    [[1.0, 0.0], [R, R], [0.0, 1.0], [-R, R], [-1.0, 0.0], [-R, -R], [0.0, -1.0], [R, -R]]
};

/// The base `(c, s, 0)` on the horizon with the smallest angle between `rnm(base, detail)` and `target`: the largest
/// `s² tx dx + c² ty dy - c s (tx dy + ty dx) + c (tx dz - tz dx) + s (ty dz - tz dy)`, by Newton's steps.
#[cold]
fn rnm_inverse_on_horizon(t: Vec3, d: Vec3) -> Vec3 {
    let (along, across) = (t.x * d.x - t.y * d.y, t.x * d.y + t.y * d.x);
    let (first, second) = (t.x * d.z - t.z * d.x, t.y * d.z - t.z * d.y);
    // But for a constant.
    let cosine = |[c, s]: [f32; 2]| s * s * along - c * s * across + c * first + s * second;
    let peak = |start: [f32; 2]| {
        let mut at = start;
        for _ in 0..5 {
            let [c, s] = at;
            let slope = 2.0 * c * s * along - (c * c - s * s) * across - s * first + c * second;
            let bend = 2.0 * (c * c - s * s) * along + 4.0 * c * s * across - c * first - s * second;
            // Towards the peak, also where the curve bends the other way, and no farther than to the next start.
            let turn = (slope / bend.abs().max(1e-6)).clamp(-0.4, 0.4);
            let (x, y) = (c - s * turn, s + c * turn);
            let scale = sqrt(x * x + y * y).recip();
            at = [x * scale, y * scale];
        }
        at
    };
    let higher = |a: [f32; 2], b: [f32; 2]| if cosine(b) > cosine(a) { b } else { a };
    let [x, y] = COMPASS.map(peak).into_iter().reduce(higher).unwrap_or(COMPASS[0]);
    vec3(x, y, 0.0)
}

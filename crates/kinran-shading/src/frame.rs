//! The frame in which an anisotropic texel lives.

use glam::{Mat3, Vec3, vec3};

/// The shortest-arc rotation that takes z = (0, 0, 1) to the unit vector `n` (slide: Our Algorithm, step 1).
///
/// Its first two columns are the tangent and bitangent of every aniso texel in Kinran; a Gram–Schmidt
/// tangent differs from them by 0.44° at a tilt of 10° and 18° at 60° (azimuth 45°), so decode with these.
///
/// For n.z ≥ 0, all that a normal map can hold, the columns are orthonormal to 3e-7. The rotation is not
/// unique at n = −z, and single precision loses it on the way (1.2e-6 at n.z = −0.9, 5e-6 at −0.99, 0.05
/// at −0.999999); where `1 + n.z` is below 1e-6 the half turn about x is returned, whose third column is −z.
#[inline(always)]
pub fn m_n(n: Vec3) -> Mat3 {
    let d = 1.0 + n.z;
    if d < 1e-6 {
        return Mat3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z);
    }
    let a = d.recip();
    let xy = -n.x * n.y * a;
    Mat3::from_cols(vec3(n.z + n.y * n.y * a, xy, -n.x), vec3(xy, n.z + n.x * n.x * a, -n.y), n)
}

/// A unit normal from the xy of a normal map, each in [−1, 1]. Where x² + y² exceeds one, as compression
/// and filtering make it do, the normal lies on the horizon in the same direction.
#[inline(always)]
pub fn normal_from_xy(x: f32, y: f32) -> Vec3 {
    let xy_squared = x * x + y * y;
    let scale = crate::sqrt::sqrt(xy_squared.max(1.0)).recip();
    vec3(x * scale, y * scale, crate::sqrt::sqrt((1.0 - xy_squared).max(0.0)))
}

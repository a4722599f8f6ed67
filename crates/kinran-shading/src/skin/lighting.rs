//! Light on skin: where to look into the tables, ambient light, gloss, and normals by channel.
//!
//! ```
//! use glam::vec2;
//! use kinran_shading::skin::lighting::skin_lut_uv;
//!
//! // At the terminator, for half the table's largest curvature of 0.5 per millimetre.
//! assert_eq!(skin_lut_uv(0.0, 0.25, 1.0 / 0.5), vec2(0.5, 0.5));
//! ```

use crate::sh::{COSINE_LOBE, Sh9, sh_basis};
use crate::{ggx_d, smith_v};
use glam::{Vec2, Vec3, vec2};

/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light in the four widest of the
/// [six Gaussians](super::profile::SKIN), which leave farther than a pore is wide.
pub const SKIN_NORMAL_BLUR: Vec3 = Vec3::new(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
pub fn skin_lut_uv(n_u: f32, curvature: f32, inverse_range: f32) -> Vec2 {
    vec2(0.5 * n_u + 0.5, curvature * inverse_range)
}

/// Irradiance of skin under ambient light: [`sh_irradiance`](crate::sh::sh_irradiance) with bands 1 and 2 multiplied, for
/// each channel, by what the profile leaves of them at the mean curvature. Clamp what rings below zero.
pub fn skin_irradiance(radiance: &Sh9, normal: Vec3, h_one: Vec3, h_two: Vec3) -> Vec3 {
    let basis = sh_basis(normal);
    let band = |range: core::ops::Range<usize>| range.fold(Vec3::ZERO, |sum, i| sum + radiance[i] * basis[i]);
    COSINE_LOBE[0] * band(0..1) + COSINE_LOBE[1] * h_one * band(1..4) + COSINE_LOBE[2] * h_two * band(4..9)
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
pub fn skin_specular(n_h: f32, n_u: f32, n_v: f32, alpha_one: f32, alpha_two: f32, share: f32) -> f32 {
    let one = ggx_d(n_h, alpha_one) * smith_v(n_u, n_v, alpha_one);
    let two = ggx_d(n_h, alpha_two) * smith_v(n_u, n_v, alpha_two);
    one + share * (two - one)
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// ([`SKIN_NORMAL_BLUR`]). Gloss keeps `n`.
pub fn skin_normal(n: Vec3, n_mesh: Vec3, blur: f32) -> Vec3 {
    (n + blur * (n_mesh - n)).normalize()
}

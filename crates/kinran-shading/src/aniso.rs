//! The aniso texel: squared roughness as three numbers that survive 8 bits, filtering and BC7.
//!
//! A texel holds `[sqrt(Sxx), rho/2 + 1/2, sqrt(Syy)]` with `rho = Sxy / sqrt(Sxx Syy)` (slide: Our
//! Algorithm, step 4). S is `alpha²` as a symmetric matrix in the frame of [`m_n`]. Every average of
//! texels decodes to a positive semi-definite matrix, since |rho| ≤ 1 always.
//!
//! In 8 bits alpha_t is off by at most 0.0038 and the axis by 0.5° where alpha_t exceeds 0.5 and twice
//! alpha_b. The worst case is alpha_b beside a much larger alpha_t, at 45°: (0.87, 0.1) comes out with 0.092
//! to 0.107, (0.87, 0.04) with 0.0325 to 0.0548, and a ratio below 0.0443 with zero. rho = 0 is not
//! representable; the nearest, 0.0039, stretches a round lobe by 0.4 %.

use crate::{Sym2, m_n, sqrt::sqrt};
use glam::{Vec2, Vec3, vec2, vec3};

/// Smallest GGX roughness anything in Kinran shades with: one step of an 8-bit aniso channel.
pub const ALPHA_MIN: f32 = 1.0 / 255.0;

/// GGX alpha of a gloss in [0, 1]: `(1 - gloss)²`, at least [`ALPHA_MIN`].
pub fn alpha_from_gloss(gloss: f32) -> f32 {
    alpha_from_roughness(1.0 - gloss)
}

/// GGX alpha of a perceptual roughness in [0, 1]: its square, at least [`ALPHA_MIN`].
#[inline(always)]
pub fn alpha_from_roughness(roughness: f32) -> f32 {
    (roughness * roughness).max(ALPHA_MIN)
}

/// What a shader needs of an aniso texel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnisoDecoded {
    /// Roughness along `tangent`, the larger one.
    pub alpha_t: f32,
    /// Roughness along `bitangent`, the smaller one.
    pub alpha_b: f32,
    /// Unit vector of the larger roughness.
    pub tangent: Vec3,
    /// Unit vector of the smaller roughness.
    pub bitangent: Vec3,
}

/// Texel of a squared roughness matrix; each component in [0, 1]. rho is 0 where Sxx or Syy is 0.
#[inline(always)]
pub fn aniso_encode(s: Sym2) -> Vec3 {
    let product = s.xx * s.yy;
    let rho = if product > 0.0 { (s.xy / sqrt(product)).clamp(-1.0, 1.0) } else { 0.0 };
    vec3(sqrt(s.xx.clamp(0.0, 1.0)), 0.5 * rho + 0.5, sqrt(s.yy.clamp(0.0, 1.0)))
}

/// Squared roughness matrix of a texel: positive semi-definite for every texel in [0, 1]³.
///
/// With [`ggx_matrix_d`](crate::ggx_matrix_d) and [`smith_matrix_v`](crate::smith_matrix_v) this is all the
/// decoding a light needs. Add [`clamp_eigen`](Sym2::clamp_eigen) where a determinant of zero would divide.
#[inline(always)]
pub fn aniso_decode_matrix(texel: Vec3) -> Sym2 {
    Sym2 { xx: texel.x * texel.x, xy: texel.x * (texel.y * 2.0 - 1.0) * texel.z, yy: texel.z * texel.z }
}

/// Principal roughnesses and directions of a texel (slide: Our Algorithm, `DecodeSggx`), in the frame of
/// the two unit vectors given, which are the first two columns of [`m_n`] brought to world space.
///
/// Differs from the slide in two points. alpha_b² comes from `det / alpha_t²`, where the slide's half
/// difference cancels. And the sign of Sxy counts zero as positive: with HLSL's `sign`, which is zero
/// there, the tangent vanishes on every texel aligned with the bitangent.
pub fn aniso_decode(texel: Vec3, tangent: Vec3, bitangent: Vec3) -> AnisoDecoded {
    let (alpha_t_sqr, alpha_b_sqr, axis) = aniso_decode_matrix(texel).eigen();
    AnisoDecoded {
        alpha_t: sqrt(alpha_t_sqr).clamp(ALPHA_MIN, 1.0),
        alpha_b: sqrt(alpha_b_sqr).clamp(ALPHA_MIN, 1.0),
        tangent: tangent * axis.x + bitangent * axis.y,
        bitangent: bitangent * axis.x - tangent * axis.y,
    }
}

/// Squared roughness matrix with `alpha_t` along the unit vector `axis` of the [`m_n`] frame, `alpha_b`
/// across.
#[inline(always)]
pub fn aniso_from_alphas(alpha_t: f32, alpha_b: f32, axis: Vec2) -> Sym2 {
    Sym2::from_eigen(alpha_t * alpha_t, alpha_b * alpha_b, axis)
}

/// Direction in the [`m_n`] frame of a direction painted in the mesh's tangent plane.
///
/// A renderer lays `direction` into the normal-mapped surface by Gram–Schmidt, `d - (d·n) n`; this is the
/// same vector in our frame. Both are unit vectors; a painted direction along the normal's own tilt of 90°
/// has no projection and stays as it is.
#[inline(always)]
pub fn axis_from_direction(direction: Vec2, n: Vec3) -> Vec2 {
    // The columns of M_n are orthogonal to n, so the Gram–Schmidt term drops out of both products.
    let m = m_n(n);
    let d = direction.extend(0.0);
    let axis = vec2(m.x_axis.dot(d), m.y_axis.dot(d));
    let length_squared = axis.length_squared();
    if length_squared > 1e-12 { axis / sqrt(length_squared) } else { direction }
}

/// The inverse of [`axis_from_direction`]: the unit direction in the mesh's tangent plane that Gram–Schmidt
/// against `n` turns into `axis` of the [`m_n`] frame.
#[inline(always)]
pub fn direction_from_axis(axis: Vec2, n: Vec3) -> Vec2 {
    let m = m_n(n);
    let t = m.x_axis * axis.x + m.y_axis * axis.y;
    // In the plane of t and n, the vector without a z component; times n.z to survive the horizon.
    let d = vec2(t.x * n.z - t.z * n.x, t.y * n.z - t.z * n.y);
    let length_squared = d.length_squared();
    if length_squared > 1e-12 { d / sqrt(length_squared) } else { axis }
}

/// Principal alphas of `KHR_materials_anisotropy`: `alpha_b = roughness²`,
/// `alpha_t = mix(alpha_b, 1, strength²)`. Returns `(alpha_t, alpha_b)`.
#[inline(always)]
pub fn alphas_from_khr_anisotropy(roughness: f32, strength: f32) -> (f32, f32) {
    let alpha_b = alpha_from_roughness(roughness);
    (alpha_b + (1.0 - alpha_b) * strength * strength, alpha_b)
}

/// Perceptual roughness and anisotropy strength of `KHR_materials_anisotropy` for `alpha_t ≥ alpha_b`; the
/// inverse of [`alphas_from_khr_anisotropy`]. Any such pair is representable.
#[inline(always)]
pub fn khr_anisotropy_from_alphas(alpha_t: f32, alpha_b: f32) -> (f32, f32) {
    let rest = 1.0 - alpha_b;
    let strength = if rest > 0.0 { sqrt(((alpha_t - alpha_b) / rest).clamp(0.0, 1.0)) } else { 0.0 };
    (sqrt(alpha_b), strength)
}

//! The GGX microfacet lobe, isotropic and anisotropic.
//!
//! All directions are unit vectors in the shading frame: z is the normal, x the tangent along which the
//! roughness is `alpha_t`, y the bitangent along which it is `alpha_b`. `alpha` is GGX roughness, the square
//! of perceptual roughness, from [`ALPHA_MIN`](crate::ALPHA_MIN) to 1.
//!
//! - Walter, Marschner, Li, Torrance. Microfacet Models for Refraction through Rough Surfaces. EGSR 2007.
//! - Heitz. Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs. JCGT 2014.
//! - Dupuy, Benyoub. Sampling Visible GGX Normals with Spherical Caps. HPG 2023.
//! - Schlick. An Inexpensive BRDF Model for Physically-based Rendering. 1994.

use crate::{Sym2, sqrt::sqrt};
use core::f32::consts::PI;
use glam::{Vec2, Vec3, vec3};

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33).
///
/// One ulp of `n_h` moves the peak by `2.4e-7 / alpha²`, 1.6 % at [`ALPHA_MIN`](crate::ALPHA_MIN); where that
/// matters, [`ggx_aniso_d`] has all the digits.
pub fn ggx_d(n_h: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    // 1 - n_h² as a product, which does not round before it cancels.
    let q = (1.0 - n_h) * (1.0 + n_h) + a2 * n_h * n_h;
    a2 / (PI * q * q)
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
pub fn ggx_aniso_d(h: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    let alpha_tb = alpha_t * alpha_b;
    let v = vec3(h.x * alpha_b, h.y * alpha_t, h.z * alpha_tb);
    let q = v.length_squared();
    alpha_tb * alpha_tb * alpha_tb / (PI * q * q)
}

/// [`ggx_aniso_d`] from the squared roughness matrix, with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
pub fn ggx_matrix_d(h: Vec3, a: Sym2) -> f32 {
    let det = a.det();
    let q = a.yy * h.x * h.x - 2.0 * a.xy * h.x * h.y + a.xx * h.y * h.y + det * h.z * h.z;
    det * sqrt(det) / (PI * q * q)
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
pub fn smith_v(n_u: f32, n_v: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let v = n_u * sqrt(n_v * n_v * (1.0 - a2) + a2);
    let u = n_v * sqrt(n_u * n_u * (1.0 - a2) + a2);
    smith_v_of_terms(u, v)
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of
/// section 5.3). `u` and `v` lie in the upper hemisphere.
pub fn smith_aniso_v(u: Vec3, v: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    let stretch = vec3(alpha_t, alpha_b, 1.0);
    smith_v_of_terms(v.z * (u * stretch).length(), u.z * (v * stretch).length())
}

/// [`smith_aniso_v`] from the squared roughness matrix, with no eigen decode.
pub fn smith_matrix_v(u: Vec3, v: Vec3, a: Sym2) -> f32 {
    let stretched = |w: Vec3| sqrt(a.quadratic(w.truncate()) + w.z * w.z);
    smith_v_of_terms(v.z * stretched(u), u.z * stretched(v))
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze: their sum is 8e-9 where
/// both cosines are 1e-6 and alpha is [`ALPHA_MIN`](crate::ALPHA_MIN). The bound keeps the product with the sharpest peak
/// finite too.
#[inline(always)]
fn smith_v_of_terms(u: f32, v: f32) -> f32 {
    0.5 / (u + v).max(1e-12)
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
pub fn smith_aniso_g1(v: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    2.0 * v.z / (v.z + (v * vec3(alpha_t, alpha_b, 1.0)).length())
}

/// Reflectance of a dielectric at normal incidence where nothing else is said: an index of refraction of 1.5
/// (glTF 2.0, appendix B).
pub const DIELECTRIC_F0: f32 = 0.04;

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
pub fn schlick_f(f0: Vec3, v_h: f32) -> Vec3 {
    let m = (1.0 - v_h).clamp(0.0, 1.0);
    let m2 = m * m;
    f0 + (Vec3::ONE - f0) * (m2 * m2 * m)
}

/// A microfacet normal distributed as [`ggx_vndf_pdf`] for the view direction `v`, from two uniform
/// numbers in [0, 1) (Dupuy 2023, listing 3).
pub fn ggx_vndf_sample(v: Vec3, alpha_t: f32, alpha_b: f32, xi: Vec2) -> Vec3 {
    let stretch = vec3(alpha_t, alpha_b, 1.0);
    let v_std = (v * stretch).normalize();

    // Sample the spherical cap that reflects to the upper hemisphere.
    let phi = 2.0 * PI * xi.x;
    let z = (1.0 - xi.y) * (1.0 + v_std.z) - v_std.z;
    let sin_theta = sqrt((1.0 - z * z).max(0.0));
    let cap = vec3(sin_theta * libm::cosf(phi), sin_theta * libm::sinf(phi), z);

    // The rim of the cap is opposite to `v_std` in one point, where the sum may round to nothing.
    ((cap + v_std) * stretch).normalize_or(Vec3::Z)
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v`
/// (Heitz 2014, eq. 16). Divide by `4 v·h` for the density of the reflected direction.
pub fn ggx_vndf_pdf(v: Vec3, h: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    if h.z <= 0.0 {
        return 0.0;
    }
    let g1_over_n_v = 2.0 / (v.z + (v * vec3(alpha_t, alpha_b, 1.0)).length());
    g1_over_n_v * v.dot(h).max(0.0) * ggx_aniso_d(h, alpha_t, alpha_b)
}

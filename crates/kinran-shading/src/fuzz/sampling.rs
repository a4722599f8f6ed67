//! Light directions for a view, where the layer and its base scatter from.

use super::phase::fibre_phase;
use crate::{ggx_vndf_pdf, ggx_vndf_sample, sqrt::sqrt};
use core::f32::consts::{FRAC_1_PI, PI};
use glam::{Vec2, Vec3, vec2, vec3};

/// A light direction distributed as [`fuzz_pdf`] for the view `v`, from two uniform numbers in [0, 1): `v`
/// reflected on a visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer
/// receives nothing: the density covers the sphere.
///
/// The normal is `L m` with `L = I - (1-α) t tᵀ` and m cosine-distributed about `L v`; a frame is not needed.
pub fn fuzz_sample(v: Vec3, t: Vec3, alpha: f32, xi: Vec2) -> Vec3 {
    let squeeze = |w: Vec3| w - t * ((1.0 - alpha) * t.dot(w));
    let phi = 2.0 * PI * xi.x;
    let z = 1.0 - 2.0 * xi.y;
    let r = sqrt((1.0 - z * z).max(0.0));
    let point = vec3(r * libm::cosf(phi), r * libm::sinf(phi), z);
    let axis = squeeze(v).normalize();
    // The point opposite to the axis is no direction.
    let sum = point + axis;
    let m = if sum.length_squared() > 1e-12 { sum.normalize() } else { axis };
    let h = squeeze(m).normalize();
    h * (2.0 * v.dot(h)) - v
}

/// Density per steradian of [`fuzz_sample`]: `D_F(h) / (4 σ_F(v))`. The lobe's weight, `f (u·n) / pdf`, is at
/// most σ(v)/σ(u), 1/α.
pub fn fuzz_pdf(u: Vec3, v: Vec3, t: Vec3, alpha: f32) -> f32 {
    fibre_phase(u.dot(v), t.dot(v), t.dot(u), alpha)
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the
/// light that each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
pub fn fuzz_over_base_shares(fuzz: f32, specular: f32, diffuse: f32) -> Vec3 {
    let floor = 0.05 * fuzz.max(specular.max(diffuse)).max(1e-6);
    let shares = vec3(fuzz.max(floor), specular.max(floor), diffuse.max(floor));
    shares / (shares.x + shares.y + shares.z)
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as [`fuzz_over_base_pdf`]; vectors in
/// the frame of the alphas, z along the normal, `shares` as [`fuzz_over_base_shares`] gives them.
pub fn fuzz_over_base_sample(
    v: Vec3,
    t: Vec3,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: Vec3,
    xi: Vec2,
) -> Vec3 {
    if xi.x < shares.x {
        return fuzz_sample(v, t, alpha, vec2(xi.x / shares.x, xi.y));
    }
    let rest = xi.x - shares.x;
    if rest < shares.y {
        let h = ggx_vndf_sample(v, alpha_t, alpha_b, vec2(rest / shares.y, xi.y));
        return h * (2.0 * v.dot(h)) - v;
    }
    // Rounding may take the last number to one.
    let x = ((rest - shares.y) / shares.z).clamp(0.0, 1.0);
    let phi = 2.0 * PI * xi.y;
    let r = sqrt(x);
    vec3(r * libm::cosf(phi), r * libm::sinf(phi), sqrt(1.0 - x))
}

/// Density per steradian of [`fuzz_over_base_sample`], over the sphere.
pub fn fuzz_over_base_pdf(
    u: Vec3,
    v: Vec3,
    t: Vec3,
    alpha: f32,
    alpha_t: f32,
    alpha_b: f32,
    shares: Vec3,
) -> f32 {
    let sum = u + v;
    let h = if sum.length_squared() > 1e-12 { sum.normalize() } else { t };
    let specular = ggx_vndf_pdf(v, h, alpha_t, alpha_b) / (4.0 * v.dot(h)).max(1e-12);
    shares.x * fuzz_pdf(u, v, t, alpha) + shares.y * specular + shares.z * (u.z.max(0.0) * FRAC_1_PI)
}

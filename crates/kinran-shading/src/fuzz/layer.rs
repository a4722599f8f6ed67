//! The layer of fibres: what it scatters to the viewer and what it leaves of the base.

use super::phase::{fibre_d, fibre_phase, fibre_projected_area, velvet_phase};
use crate::sqrt::sqrt;
use core::f32::consts::{LOG2_E, PI};
use glam::Vec3;

/// Cosines below this one, of light or view and normal, count as it: a layer of density 1e-4 lets nothing pass there,
/// and quotients stay finite at the horizon.
pub const FUZZ_COSINE_MIN: f32 = 1e-6;

/// Share of light that passes the layer along a direction at cosine `n_w` ≥ 0 to the normal without meeting a
/// fibre: `e^(-d / n_w)`. Towards the light it is the talk's `P_p`, towards the viewer `P_e`.
pub fn fuzz_passage(density: f32, n_w: f32) -> f32 {
    libm::exp2f(-LOG2_E * density / n_w.max(FUZZ_COSINE_MIN))
}

/// The layer's BRDF for a fibre albedo of one (slide: New Model): `p (1 - passed) / (n_u + n_v)`, where
/// `passed` is [`fuzz_passage`] along the light times that along the view, and `phase` the phase function.
/// For cosines ≥ 0; where both vanish the BRDF is infinite, and this is its value at [`FUZZ_COSINE_MIN`]. Single
/// precision leaves a relative error of 6e-8 / density.
pub fn fuzz_layer(phase: f32, passed: f32, n_u: f32, n_v: f32) -> f32 {
    phase * (1.0 - passed) / (n_u + n_v).max(FUZZ_COSINE_MIN)
}

/// BRDF of a layer of SGGX fibres for an albedo of one, per steradian, zero below the horizon; `u` light, `v` view and
/// `t` fibre direction are unit vectors in a frame with z along the normal.
///
/// Not reciprocal: `f(u, v) σ(u) = f(v, u) σ(v)`, because the layer is equally dense for every direction
/// while its fibres are not. [`fuzz_reciprocal_brdf`] is.
pub fn fuzz_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, alpha: f32) -> f32 {
    if u.z <= 0.0 || v.z <= 0.0 {
        return 0.0;
    }
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    fuzz_layer(fibre_phase(u.dot(v), t.dot(u), t.dot(v), alpha), passed, u.z, v.z)
}

/// [`fuzz_brdf`] with the velvet phase of asymmetry `k`; reciprocal.
pub fn fuzz_velvet_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, k: f32) -> f32 {
    if u.z <= 0.0 || v.z <= 0.0 {
        return 0.0;
    }
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    fuzz_layer(velvet_phase(u.dot(v), t.dot(u), t.dot(v), k), passed, u.z, v.z)
}

/// BRDF of a layer whose extinction follows the fibres' projected area, as in a true microflake volume:
/// `D/4 (1 - e^(-d (σ_u/n_u + σ_v/n_v))) / (σ_v n_u + σ_u n_v)`. Reciprocal. Light along the fibres meets
/// fewer of them, so upright fibres show more of the base than with [`fuzz_brdf`]. No deviation in cost of
/// note; no fits of the base's shadowing come with it, for P_p and P_e then depend on the fibres too.
pub fn fuzz_reciprocal_brdf(u: Vec3, v: Vec3, t: Vec3, density: f32, alpha: f32) -> f32 {
    if u.z <= 0.0 || v.z <= 0.0 {
        return 0.0;
    }
    let h = (u + v).normalize();
    let (su, sv) = (fibre_projected_area(t.dot(u), alpha), fibre_projected_area(t.dot(v), alpha));
    let passed = fuzz_passage(density * su, u.z) * fuzz_passage(density * sv, v.z);
    0.25 * fibre_d(t.dot(h), alpha) * (1.0 - passed) / (sv * u.z + su * v.z)
}

/// What the layer's lobe needs of a view, once a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuzzView {
    /// Cosine of view and normal, at least [`FUZZ_COSINE_MIN`].
    pub n_v: f32,
    /// Cosine of view and fibre.
    pub t_v: f32,
    /// `P_e`: the share of the base's light that reaches the viewer.
    pub escaped: f32,
    /// `-d log2(e)`, below zero also for a density of zero.
    pub exponent: f32,
    /// `(1-α²) / 2α²`.
    pub squeeze: f32,
    /// `(4π α)²`.
    pub root: f32,
    /// `(4π α)² (1-α²)`.
    pub root_along: f32,
}

/// What the layer makes of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FuzzLight {
    /// The BRDF for a fibre albedo of one, per steradian.
    pub lobe: f32,
    /// `P_p`: the share of the light that reaches the base unscattered.
    pub penetrated: f32,
}

/// Prepares [`fuzz_light`] for a view at cosine `n_v` ≥ 0 to the normal and `t_v` to the fibres.
pub fn fuzz_view(n_v: f32, t_v: f32, density: f32, alpha: f32) -> FuzzView {
    // Over a light's cosine of zero it is infinite and the power zero; a zero would be none over it.
    let exponent = -LOG2_E * density.max(1e-20);
    let n_v = n_v.max(FUZZ_COSINE_MIN);
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let root = 16.0 * PI * PI * alpha_sqr;
    FuzzView {
        n_v,
        t_v,
        escaped: libm::exp2f(exponent / n_v),
        exponent,
        squeeze: 0.5 * k / alpha_sqr,
        root,
        root_along: root * k,
    }
}

/// Lobe and penetration for a light at cosines `n_u` ≥ 0 to the normal, `t_u` to the fibres and `u_v` to the
/// view: [`fuzz_brdf`] with one exponential for both and all that is known of the view drawn together. The cosines
/// are the same in every frame.
pub fn fuzz_light(view: FuzzView, n_u: f32, t_u: f32, u_v: f32) -> FuzzLight {
    let penetrated = libm::exp2f(view.exponent / n_u);
    let scattered = 1.0 - penetrated * view.escaped;
    // The phase is `(w/m)² / (4π α sqrt(1 - k t_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000_001 + u_v;
    let s = t_u + view.t_v;
    let m = s * s * view.squeeze + w;
    let area = sqrt(view.root - t_u * t_u * view.root_along);
    FuzzLight { lobe: w * w * scattered / (m * m * (n_u + view.n_v) * area), penetrated }
}

/// Factor on the base's BRDF (slide: Base Layer, `c_atten`): `(P_p + c_f (1 - P_p) P_s) P_e`, for the share
/// `penetrated` that reaches the base, `escaped` that leaves it towards the viewer, and `downward` of the
/// scattered light that goes down. With `downward` = 0 it is the talk's cheaper variant.
pub fn fuzz_attenuation(penetrated: f32, escaped: f32, downward: f32, fibre_color: Vec3) -> Vec3 {
    // `escaped` goes with what a shader's compiler can keep for all lights.
    let scattered = downward - penetrated * downward;
    penetrated * escaped + fibre_color * escaped * scattered
}

/// The normal for the layer, between the normal-mapped `n` and the mesh's `vertex_normal` (slide: Deferred):
/// `smoothness` 0 keeps `n`, 1 takes the mesh's. They are less than 180° apart.
pub fn fuzz_smooth_normal(n: Vec3, vertex_normal: Vec3, smoothness: f32) -> Vec3 {
    (n + (vertex_normal - n) * smoothness).normalize()
}

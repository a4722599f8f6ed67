// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_layer.wesl, by ./x shaders. Needs: fuzz_phase

// The layer of fibres: what it scatters to the viewer and what it leaves of the base.
//
// Koenderink, Pont. The Secret of Velvety Skin. Machine Vision and Applications 2003.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Cosines below this one, of light or view and normal, count as it: a layer of density 1e-4 lets nothing pass there, and
/// quotients stay finite at the horizon.
const FUZZ_COSINE_MIN: f32 = 1e-6;

/// Share of light that passes the layer along a direction at cosine `n_w` ≥ 0 to the normal without meeting a fibre:
/// `e^(-d / n_w)`. Towards the light it is the talk's `P_p`, towards the viewer `P_e`.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
fn fuzz_passage(density: f32, n_w: f32) -> f32 {
    return exp2(-1.44269504 * density / max(n_w, FUZZ_COSINE_MIN));
}

/// The layer's BRDF for a fibre albedo of one (slide: New Model): `p (1 - passed) / (n_u + n_v)`, where `passed` is
/// `fuzz_passage` along the light times that along the view, and `phase` the phase function; for cosines ≥ 0. Where both
/// vanish the BRDF is infinite, and this is its value at FUZZ_COSINE_MIN.
///
/// Cost on GCN: 6 instructions (1 at a quarter of the rate).
fn fuzz_layer(phase: f32, passed: f32, n_u: f32, n_v: f32) -> f32 {
    return phase * (1.0 - passed) / max(n_u + n_v, FUZZ_COSINE_MIN);
}

/// BRDF of a layer of SGGX fibres for an albedo of one, per steradian, zero below the horizon; `u` light, `v` view and
/// `t` fibre direction are unit vectors in a frame with z along the normal. Not reciprocal: `f(u, v) σ(u) = f(v, u)
/// σ(v)`.
///
/// Cost on GCN: 44 instructions (6 at a quarter of the rate).
fn fuzz_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, alpha: f32) -> f32 {
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    let value = fuzz_layer(fibre_phase(dot(u, v), dot(t, u), dot(t, v), alpha), passed, u.z, v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// `fuzz_brdf` with the velvet phase of asymmetry `k`; reciprocal.
///
/// Cost on GCN: 45 instructions (9 at a quarter of the rate).
fn fuzz_velvet_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, k: f32) -> f32 {
    let passed = fuzz_passage(density, u.z) * fuzz_passage(density, v.z);
    let value = fuzz_layer(velvet_phase(dot(u, v), dot(t, u), dot(t, v), k), passed, u.z, v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// BRDF of a layer whose extinction follows the fibres' projected area, as in a true microflake volume:
/// `D/4 (1 - e^(-d (σ_u/n_u + σ_v/n_v))) / (σ_v n_u + σ_u n_v)`. Reciprocal.
///
/// Cost on GCN: 54 instructions (8 at a quarter of the rate).
fn fuzz_reciprocal_brdf(u: vec3f, v: vec3f, t: vec3f, density: f32, alpha: f32) -> f32 {
    let h = normalize(u + v);
    let area_u = fibre_projected_area(dot(t, u), alpha);
    let area_v = fibre_projected_area(dot(t, v), alpha);
    let passed = fuzz_passage(density * area_u, u.z) * fuzz_passage(density * area_v, v.z);
    let value = 0.25 * fibre_d(dot(t, h), alpha) * (1.0 - passed) / (area_v * u.z + area_u * v.z);
    return select(0.0, value, min(u.z, v.z) > 0.0);
}

/// What the layer's lobe needs of a view, once a pixel.
struct FuzzView {
    /// Cosine of view and normal, at least FUZZ_COSINE_MIN.
    n_v: f32,
    /// Cosine of view and fibre.
    t_v: f32,
    /// `P_e`: the share of the base's light that reaches the viewer.
    escaped: f32,
    /// `-d log2(e)`, below zero also for a density of zero.
    exponent: f32,
    /// `(1-α²) / 2α²`.
    squeeze: f32,
    /// `(4π α)²`.
    root: f32,
    /// `(4π α)² (1-α²)`.
    root_along: f32,
}

/// What the layer makes of a light.
struct FuzzLight {
    /// The BRDF for a fibre albedo of one, per steradian.
    lobe: f32,
    /// `P_p`: the share of the light that reaches the base unscattered.
    penetrated: f32,
}

/// Prepares `fuzz_light` for a view at cosine `n_v` ≥ 0 to the normal and `t_v` to the fibres.
///
/// Cost on GCN: 13 instructions (3 at a quarter of the rate).
fn fuzz_view(n_v: f32, t_v: f32, density: f32, alpha: f32) -> FuzzView {
    // Over a light's cosine of zero it is infinite and the power zero; a zero would be none over it.
    let exponent = -1.44269504 * max(density, 1e-20);
    let n = max(n_v, FUZZ_COSINE_MIN);
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let root = 157.91367 * alpha_sqr;
    return FuzzView(n, t_v, exp2(exponent / n), exponent, 0.5 * k / alpha_sqr, root, root * k);
}

/// Lobe and penetration for a light at cosines `n_u` ≥ 0 to the normal, `t_u` to the fibres and `u_v` to the view:
/// `fuzz_brdf` with one exponential for both and all that is known of the view drawn together. The cosines are the same
/// in every frame.
///
/// Cost on GCN: 19 instructions (4 at a quarter of the rate).
fn fuzz_light(view: FuzzView, n_u: f32, t_u: f32, u_v: f32) -> FuzzLight {
    let penetrated = exp2(view.exponent / n_u);
    let scattered = 1.0 - penetrated * view.escaped;
    // The phase is `(w/m)² / (4π α sqrt(1 - k t_u²))` with half of |u + v|² for w, kept above zero where v = -u.
    let w = 1.000001 + u_v;
    let s = t_u + view.t_v;
    let m = s * s * view.squeeze + w;
    let over_area = inverseSqrt(view.root - t_u * t_u * view.root_along);
    return FuzzLight(w * w * scattered * over_area / (m * m * (n_u + view.n_v)), penetrated);
}

/// Factor on the base's BRDF (slide: Base Layer, `c_atten`): `(P_p + c_f (1 - P_p) P_s) P_e`, for the share `penetrated`
/// that reaches the base, `escaped` that leaves it towards the viewer, and `downward` (P_s) of the scattered light that
/// goes down. With `downward` = 0 it is the talk's cheaper variant.
///
/// Cost on GCN: 8 instructions.
fn fuzz_attenuation(penetrated: f32, escaped: f32, downward: f32, fibre_color: vec3f) -> vec3f {
    // `escaped` goes with what the compiler can keep for all lights.
    let scattered = downward - penetrated * downward;
    return penetrated * escaped + fibre_color * escaped * scattered;
}

/// The normal for the layer, between the normal-mapped `n` and the mesh's `vertex_normal` (slide: Deferred):
/// `smoothness` 0 keeps `n`, 1 takes the mesh's. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn fuzz_smooth_normal(n: vec3f, vertex_normal: vec3f, smoothness: f32) -> vec3f {
    return normalize(n + (vertex_normal - n) * smoothness);
}

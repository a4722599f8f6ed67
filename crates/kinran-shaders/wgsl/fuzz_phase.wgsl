// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_phase.wesl, by ./x shaders. Needs: nothing else

// How a fibre scatters: the SGGX phase function of specular fibres, and Schlick's for velvet.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

/// Smallest roughness of fibres to shade with.
const FUZZ_ALPHA_MIN: f32 = 0.1;

/// Roughness of fibres from their spread, 0 (combed) to 1 (in all directions): its root, at least FUZZ_ALPHA_MIN.
///
/// Cost on GCN: 2 instructions (1 at a quarter of the rate).
fn fuzz_alpha(spread: f32) -> f32 {
    return sqrt(max(spread, FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN));
}

/// Schlick's k of the velvet phase from the fibres' spread: `1 - spread`, at most 0.99.
///
/// Cost on GCN: 2 instructions.
fn velvet_k(spread: f32) -> f32 {
    return 1.0 - max(spread, FUZZ_ALPHA_MIN * FUZZ_ALPHA_MIN);
}

/// Direction of fibres in a frame with z along the normal: `tilt` away from the normal (0 upright, π/2 lying),
/// `azimuth` counter-clockwise from x, both in radians.
///
/// Cost on GCN: 10 instructions (4 at a quarter of the rate).
fn fibre_direction(tilt: f32, azimuth: f32) -> vec3f {
    let sine = sin(tilt);
    return vec3f(sine * cos(azimuth), sine * sin(azimuth), cos(tilt));
}

/// Distribution of the fibres' microflake normals at cosine `t_h` to their direction, per steradian over the sphere
/// (slide: Phase Function, `D_F`): `α³ / (π (t_h² (1 - α²) + α²)²)`.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
fn fibre_d(t_h: f32, alpha: f32) -> f32 {
    let alpha_sqr = alpha * alpha;
    let q = t_h * t_h * (1.0 - alpha_sqr) + alpha_sqr;
    return alpha_sqr * alpha / (3.14159265 * q * q);
}

/// Projected area of the fibres' microflakes along a direction at cosine `t_w` to them (slide: Phase Function, `σ_F`):
/// `sqrt(1 - t_w² (1 - α²))`.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
fn fibre_projected_area(t_w: f32, alpha: f32) -> f32 {
    return sqrt(1.0 - t_w * t_w * (1.0 - alpha * alpha));
}

/// The fibres' phase function per steradian (slide: Phase Function, `p_F`): `D_F(h) / (4 σ_F(u))` for light from `u`
/// and a view along `v`, from `u_v = u·v`, `t_u = t·u` and `t_v = t·v`. Not symmetric.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
fn fibre_phase(u_v: f32, t_u: f32, t_v: f32, alpha: f32) -> f32 {
    // |u + v|², kept above zero where v = -u.
    let w = 2.000002 + 2.0 * u_v;
    let s = t_u + t_v;
    let alpha_sqr = alpha * alpha;
    let k = 1.0 - alpha_sqr;
    let m = s * s * k + alpha_sqr * w;
    return alpha_sqr * alpha * w * w * inverseSqrt(1.0 - t_u * t_u * k) / (12.5663706 * m * m);
}

/// Normalisation r(k) of the velvet phase: `sqrt(1-k) / (1 + (2 sqrt(2) - 1) k)`, for k in [0, 0.99]. With it the phase
/// scatters at most what arrives, and 0.88 of it at least for light across the fibres.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
fn velvet_normalization(k: f32) -> f32 {
    return sqrt(1.0 - k) / (1.0 + 1.82842712 * k);
}

/// The velvet phase per steradian (slide: Velvet Scattering, `p_V`): `r(k) (1-k²) / (4π (1 - k sin(t, h))²)`, arguments
/// as in `fibre_phase`, k in [0, 0.99] as `velvet_k` gives it. The slide's k has the other sign, which scatters forward.
///
/// Cost on GCN: 19 instructions (5 at a quarter of the rate).
fn velvet_phase(u_v: f32, t_u: f32, t_v: f32, k: f32) -> f32 {
    let w = 2.000002 + 2.0 * u_v;
    let s = t_u + t_v;
    let q = 1.0 - k * sqrt(max(1.0 - s * s / w, 0.0));
    return velvet_normalization(k) * (1.0 - k * k) / (12.5663706 * q * q);
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_phase.wesl, by ./x shaders. Needs: nothing else

// How a fibre scatters: the SGGX phase function of specular fibres, and Schlick's for velvet.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.
// Schlick. An Inexpensive BRDF Model for Physically-based Rendering. Eurographics 1994.
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_PHASE_GLSL
#define KINRAN_FUZZ_PHASE_GLSL

/// Smallest roughness of fibres to shade with.
const float FUZZ_ALPHA_MIN = 0.1;

/// Roughness of fibres from their spread, 0 (combed) to 1 (in all directions): its root, at least FUZZ_ALPHA_MIN.
///
/// Cost on GCN: 2 instructions (1 at a quarter of the rate).
float fuzz_alpha(float spread) {
    return sqrt(max(spread, 0.010000001));
}

/// Schlick's k of the velvet phase from the fibres' spread: `1 - spread`, at most 0.99.
///
/// Cost on GCN: 2 instructions.
float velvet_k(float spread) {
    return 1.0 - max(spread, 0.010000001);
}

/// Direction of fibres in a frame with z along the normal: `tilt` away from the normal (0 upright, π/2 lying),
/// `azimuth` counter-clockwise from x, both in radians.
///
/// Cost on GCN: 10 instructions (4 at a quarter of the rate).
vec3 fibre_direction(float tilt, float azimuth) {
    float sine = sin(tilt);
    return vec3((sine * cos(azimuth)), (sine * sin(azimuth)), cos(tilt));
}

/// Distribution of the fibres' microflake normals at cosine `t_h` to their direction, per steradian over the sphere
/// (slide: Phase Function, `D_F`): `α³ / (π (t_h² (1 - α²) + α²)²)`.
///
/// Cost on GCN: 9 instructions (1 at a quarter of the rate).
float fibre_d(float t_h, float alpha) {
    float alpha_sqr = alpha * alpha;
    float q = ((t_h * t_h) * (1.0 - alpha_sqr)) + alpha_sqr;
    return (alpha_sqr * alpha) / ((3.1415927 * q) * q);
}

/// Projected area of the fibres' microflakes along a direction at cosine `t_w` to them (slide: Phase Function, `σ_F`):
/// `sqrt(1 - t_w² (1 - α²))`.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
float fibre_projected_area(float t_w, float alpha) {
    return sqrt((1.0 - ((t_w * t_w) * (1.0 - (alpha * alpha)))));
}

/// The fibres' phase function per steradian (slide: Phase Function, `p_F`): `D_F(h) / (4 σ_F(u))` for light from `u`
/// and a view along `v`, from `u_v = u·v`, `t_u = t·u` and `t_v = t·v`. Not symmetric.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
float fibre_phase(float u_v, float t_u, float t_v, float alpha) {
    float w = 2.000002 + (2.0 * u_v);
    float s = t_u + t_v;
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float m = ((s * s) * k) + (alpha_sqr * w);
    return ((((alpha_sqr * alpha) * w) * w) * inversesqrt((1.0 - ((t_u * t_u) * k)))) / ((12.566371 * m) * m);
}

/// Normalisation r(k) of the velvet phase: `sqrt(1-k) / (1 + (2 sqrt(2) - 1) k)`, for k in [0, 0.99]. With it the phase
/// scatters at most what arrives, and 0.88 of it at least for light across the fibres.
///
/// Cost on GCN: 5 instructions (2 at a quarter of the rate).
float velvet_normalization(float k) {
    return sqrt((1.0 - k)) / (1.0 + (1.8284271 * k));
}

/// The velvet phase per steradian (slide: Velvet Scattering, `p_V`): `r(k) (1-k²) / (4π (1 - k sin(t, h))²)`, arguments
/// as in `fibre_phase`, k in [0, 0.99] as `velvet_k` gives it. The slide's k has the other sign, which scatters forward.
///
/// Cost on GCN: 19 instructions (5 at a quarter of the rate).
float velvet_phase(float u_v, float t_u, float t_v, float k) {
    float w = 2.000002 + (2.0 * u_v);
    float s = t_u + t_v;
    float q = 1.0 - (k * sqrt(max((1.0 - ((s * s) / w)), 0.0)));
    float _e19 = velvet_normalization(k);
    return (_e19 * (1.0 - (k * k))) / ((12.566371 * q) * q);
}

#endif

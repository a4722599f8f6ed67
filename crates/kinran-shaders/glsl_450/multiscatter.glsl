// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/multiscatter.wesl, by ./x shaders. Needs: nothing else

// Energy that microfacet models lose between the facets, given back.
//
// Turquin. Practical multiple scattering compensation for microfacet models. 2019.

#ifndef KINRAN_MULTISCATTER_GLSL
#define KINRAN_MULTISCATTER_GLSL

/// Directional albedo of the single-scattering GGX lobe with height-correlated Smith masking and F = 1, for a view at
/// cosine `n_v` (0 to 1): the share of a white furnace that comes back, 0.307 (= 1 − ln 2) to 1. A rational fit,
/// within 0.011 of quadrature (0.004 RMS) for alpha and n_v in [0.005, 1]; it takes the place of a lookup table.
///
/// Cost on GCN: 27 instructions (1 at a quarter of the rate).
float ggx_directional_albedo(float n_v, float alpha) {
    float m_sqr = n_v * n_v;
    float a_sqr = alpha * alpha;
    float p = (((0.00023917 + (0.004272 * alpha)) + (0.014007 * a_sqr)) + (((0.1302 - (0.075028 * alpha)) + (3.2169 * a_sqr)) * n_v)) + (((-0.03449 - (0.18897 * alpha)) + (0.089879 * a_sqr)) * m_sqr);
    float q = (((-1.9263e-5 + (0.0054598 * alpha)) + (1.0288 * a_sqr)) + (((0.0019317 - (1.1331 * alpha)) + (5.3123 * a_sqr)) * n_v)) + (((1.0 - (1.3516 * alpha)) - (0.3803 * a_sqr)) * m_sqr);
    return clamp((1.0 - ((alpha * p) / q)), 0.3, 1.0);
}

/// Roughness of the isotropic lobe whose albedo stands for that of an anisotropic one, for the unit view `v` in the frame
/// of the alphas: squared, the mean of `alpha_t²` and `alpha_b²` from above; the flatter the view, the more that across it
/// counts, towards which facets send most light: `(alpha_t² + alpha_b² + 0.8 (alpha_t² - alpha_b²) (v.y⁴ - v.x⁴)) / 2`.
/// RMS error of the albedo 0.019 over random pairs in [0.05, 1] and all views, worst 0.32 at a flat view across the pair
/// (1, 0.05).
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
float ggx_albedo_alpha(vec3 v, float alpha_t, float alpha_b) {
    float t = alpha_t * alpha_t;
    float b = alpha_b * alpha_b;
    float x = v.x * v.x;
    float y = v.y * v.y;
    return sqrt(((0.5 * (t + b)) + ((0.4 * (t - b)) * ((y * y) - (x * x)))));
}

/// Factor on the single-scattering lobe that restores the energy of all further bounces, `1 + f0 (1/E - 1)` (Turquin
/// 2019, eq. 16), per pixel, for the unit view `v` in the frame of the alphas, z along the normal. The factor depends on
/// the view alone, so the compensated lobe is not reciprocal. An anisotropic lobe uses the isotropic albedo at
/// `ggx_albedo_alpha`.
///
/// Cost on GCN: 44 instructions (3 at a quarter of the rate).
vec3 multiscatter_compensation(vec3 f0_, vec3 v, float alpha_t, float alpha_b) {
    float _e6 = ggx_albedo_alpha(v, alpha_t, alpha_b);
    float _e7 = ggx_directional_albedo(clamp(v.z, 0.0, 1.0), _e6);
    return vec3(1.0) + (f0_ * ((1.0 / _e7) - 1.0));
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_p_s.wesl, by ./x shaders. Needs: nothing else

// P_s: the share of scattered light that a fibre sends down to the base.
//
// Patry. Samurai Shading in Ghost of Tsushima. SIGGRAPH 2020.

#ifndef KINRAN_FUZZ_P_S_GLSL
#define KINRAN_FUZZ_P_S_GLSL

/// A step of Laguerre's iteration for the largest root of `l³ + square l² + linear l + constant`, whose roots are all
/// real.
///
/// Cost on GCN: 18 instructions (2 at a quarter of the rate).
float fibre_p_s_step(float l, float constant, float linear, float square) {
    float value = ((((l + square) * l) + linear) * l) + constant;
    float slope = (((3.0 * l) + (2.0 * square)) * l) + linear;
    float bend = (6.0 * l) + (2.0 * square);
    float root = sqrt(max((((4.0 * slope) * slope) - ((6.0 * value) * bend)), 0.0));
    return l - ((3.0 * value) / max((slope + root), 1e-20));
}

/// P_s of SGGX fibres, exactly (slide: Base Layer, "no analytical expression"): one minus the integral of
/// `fibre_phase(u, v)` over the `v` above the horizon, for a light at cosines `n_u` ≥ 0 to the normal and `t_u` to the
/// fibres, whose own cosine to the normal is `t_n`. It is the form factor of an elliptic cone: with the positive root λ
/// of `χ = λ³ + (α² c + 2 k t_u t_n) λ² - (α² + k (1 - t_u² - t_n²)) λ - α² c`, `c = n_u`, `k = 1 - α²`,
/// `1 - P_s = λ sqrt((λ + c) (λ + α² c/σ²)) / χ'(λ)`. Laguerre's iteration from 1 falls on λ.
///
/// Cost on GCN: 92 instructions (11 at a quarter of the rate).
float fibre_p_s(float n_u, float t_u, float t_n, float alpha) {
    float alpha_sqr = alpha * alpha;
    float k = 1.0 - alpha_sqr;
    float constant = -(alpha_sqr) * n_u;
    float linear = -((alpha_sqr + (k * ((1.0 - (t_u * t_u)) - (t_n * t_n)))));
    float square = (alpha_sqr * n_u) + (((2.0 * k) * t_u) * t_n);
    float _e24 = fibre_p_s_step(1.0, constant, linear, square);
    float _e25 = fibre_p_s_step(_e24, constant, linear, square);
    float _e26 = fibre_p_s_step(_e25, constant, linear, square);
    float _e27 = fibre_p_s_step(_e26, constant, linear, square);
    float slope = (((3.0 * _e27) + (2.0 * square)) * _e27) + linear;
    float area_sqr = 1.0 - ((k * t_u) * t_u);
    float upward = (_e27 * sqrt(max(((_e27 + n_u) * (_e27 + ((alpha_sqr * n_u) / area_sqr))), 0.0))) / max(slope, 1e-20);
    return clamp((1.0 - upward), 0.0, 1.0);
}

/// P_s by the talk's six coefficients (slide: Base Layer), fitted for one tilt and one spread: `c_0 + c_1 n_u + c_2 t_u +
/// c_3 n_u² + c_4 n_u t_u + c_5 t_u²`, clamped to [0, 1]. `kinran fit fuzz` prints them with their error.
///
/// Cost on GCN: 5 instructions.
float fuzz_p_s(float coefficients[6], float n_u, float t_u) {
    float across = n_u * ((coefficients[1] + (coefficients[3] * n_u)) + (coefficients[4] * t_u));
    return clamp(((coefficients[0] + across) + (t_u * (coefficients[2] + (coefficients[5] * t_u)))), 0.0, 1.0);
}

#endif

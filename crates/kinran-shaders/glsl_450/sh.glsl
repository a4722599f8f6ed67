// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sh.wesl, by ./x shaders. Needs: nothing else

// Order-2 spherical harmonics: distant light by nine coefficients.
//
// Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001.
//
// Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is orthonormal
// over the sphere, its polar axis is z, without the Condon-Shortley phase.

#ifndef KINRAN_SH_GLSL
#define KINRAN_SH_GLSL

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
float[9] sh_basis(vec3 direction) {
    float x = direction.x;
    float y = direction.y;
    float z = direction.z;
    return float[9](0.2820948, (0.48860252 * y), (0.48860252 * z), (0.48860252 * x), ((1.0925484 * x) * y), ((1.0925484 * y) * z), (0.31539157 * (((3.0 * z) * z) - 1.0)), ((1.0925484 * x) * z), (0.5462742 * ((x * x) - (y * y))));
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
vec3 sh_evaluate(vec3 coefficients[9], vec3 direction) {
    float _e2[9] = sh_basis(direction);
    return ((((((((coefficients[0] * _e2[0]) + (coefficients[1] * _e2[1])) + (coefficients[2] * _e2[2])) + (coefficients[3] * _e2[3])) + (coefficients[4] * _e2[4])) + (coefficients[5] * _e2[5])) + (coefficients[6] * _e2[6])) + (coefficients[7] * _e2[7])) + (coefficients[8] * _e2[8]);
}

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
vec3[9] sh_convolve_cosine(vec3 radiance[9]) {
    return vec3[9]((radiance[0] * 3.1415927), (radiance[1] * 2.0943952), (radiance[2] * 2.0943952), (radiance[3] * 2.0943952), (radiance[4] * 0.7853982), (radiance[5] * 0.7853982), (radiance[6] * 0.7853982), (radiance[7] * 0.7853982), (radiance[8] * 0.7853982));
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
vec3 sh_irradiance(vec3 radiance[9], vec3 normal) {
    vec3 _e2[9] = sh_convolve_cosine(radiance);
    vec3 _e3 = sh_evaluate(_e2, normal);
    return _e3;
}

#endif

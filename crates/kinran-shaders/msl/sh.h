// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sh.wesl, by ./x shaders. Needs: nothing else

// Order-2 spherical harmonics: distant light by nine coefficients.
//
// Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001.
//
// Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is orthonormal
// over the sphere, its polar axis is z, without the Condon-Shortley phase.

#ifndef KINRAN_SH_METAL
#define KINRAN_SH_METAL

#include <metal_stdlib>

#ifndef KINRAN_FLOAT3X9ARRAY_METAL
#define KINRAN_FLOAT3X9ARRAY_METAL
struct Float3x9Array {
    metal::float3 inner[9];
};
#endif

#ifndef KINRAN_FLOAT9ARRAY_METAL
#define KINRAN_FLOAT9ARRAY_METAL
struct Float9Array {
    float inner[9];
};
#endif

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
inline Float9Array sh_basis(
    metal::float3 direction
) {
    float x = direction.x;
    float y = direction.y;
    float z = direction.z;
    return Float9Array {{0.2820948, 0.48860252 * y, 0.48860252 * z, 0.48860252 * x, (1.0925484 * x) * y, (1.0925484 * y) * z, 0.31539157 * (((3.0 * z) * z) - 1.0), (1.0925484 * x) * z, 0.5462742 * ((x * x) - (y * y))}};
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
inline metal::float3 sh_evaluate(
    Float3x9Array coefficients,
    metal::float3 direction
) {
    Float9Array _e2 = sh_basis(direction);
    return ((((((((coefficients.inner[0] * _e2.inner[0]) + (coefficients.inner[1] * _e2.inner[1])) + (coefficients.inner[2] * _e2.inner[2])) + (coefficients.inner[3] * _e2.inner[3])) + (coefficients.inner[4] * _e2.inner[4])) + (coefficients.inner[5] * _e2.inner[5])) + (coefficients.inner[6] * _e2.inner[6])) + (coefficients.inner[7] * _e2.inner[7])) + (coefficients.inner[8] * _e2.inner[8]);
}

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
inline Float3x9Array sh_convolve_cosine(
    Float3x9Array radiance
) {
    return Float3x9Array {{radiance.inner[0] * 3.1415927, radiance.inner[1] * 2.0943952, radiance.inner[2] * 2.0943952, radiance.inner[3] * 2.0943952, radiance.inner[4] * 0.7853982, radiance.inner[5] * 0.7853982, radiance.inner[6] * 0.7853982, radiance.inner[7] * 0.7853982, radiance.inner[8] * 0.7853982}};
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
inline metal::float3 sh_irradiance(
    Float3x9Array radiance,
    metal::float3 normal
) {
    Float3x9Array _e2 = sh_convolve_cosine(radiance);
    metal::float3 _e3 = sh_evaluate(_e2, normal);
    return _e3;
}

#endif

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/sh.wesl, by ./x shaders. Needs: nothing else

// Order-2 spherical harmonics: distant light by nine coefficients.
//
// Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps. SIGGRAPH 2001.
//
// Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is orthonormal
// over the sphere, its polar axis is z, without the Condon-Shortley phase.

/// The basis functions at a unit direction.
///
/// Cost on GCN: 14 instructions.
fn sh_basis(direction: vec3f) -> array<f32, 9> {
    let x = direction.x;
    let y = direction.y;
    let z = direction.z;
    return array<f32, 9>(
        0.2820948,
        0.48860252 * y,
        0.48860252 * z,
        0.48860252 * x,
        1.0925484 * x * y,
        1.0925484 * y * z,
        0.31539157 * (3.0 * z * z - 1.0),
        1.0925484 * x * z,
        0.5462742 * (x * x - y * y),
    );
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
///
/// Cost on GCN: 41 instructions.
fn sh_evaluate(coefficients: array<vec3f, 9>, direction: vec3f) -> vec3f {
    let basis = sh_basis(direction);
    return coefficients[0] * basis[0] + coefficients[1] * basis[1] + coefficients[2] * basis[2]
        + coefficients[3] * basis[3] + coefficients[4] * basis[4] + coefficients[5] * basis[5]
        + coefficients[6] * basis[6] + coefficients[7] * basis[7] + coefficients[8] * basis[8];
}

/// Coefficients of irradiance from those of radiance (eq. 7), once per environment; `sh_evaluate` of the result is
/// `sh_irradiance`, three multiplications a coefficient cheaper.
///
/// Cost on GCN: 27 instructions.
fn sh_convolve_cosine(radiance: array<vec3f, 9>) -> array<vec3f, 9> {
    // sqrt(4 pi / (2l + 1)) times the clamped cosine's own coefficient: π, 2π/3, π/4.
    let band_zero = 3.14159265;
    let band_one = 2.09439510;
    let band_two = 0.78539816;
    return array<vec3f, 9>(
        radiance[0] * band_zero,
        radiance[1] * band_one,
        radiance[2] * band_one,
        radiance[3] * band_one,
        radiance[4] * band_two,
        radiance[5] * band_two,
        radiance[6] * band_two,
        radiance[7] * band_two,
        radiance[8] * band_two,
    );
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light from one small
/// spot can make it slightly negative on the far side; clamp where that matters.
///
/// Cost on GCN: 65 instructions.
fn sh_irradiance(radiance: array<vec3f, 9>, normal: vec3f) -> vec3f {
    return sh_evaluate(sh_convolve_cosine(radiance), normal);
}

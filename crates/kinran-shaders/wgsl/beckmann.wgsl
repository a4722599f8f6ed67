// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/beckmann.wesl, by ./x shaders. Needs: nothing else

// The Beckmann distribution and LEAN mapping, to compare with.
//
// Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
// Olano, Baker. LEAN Mapping. I3D 2010.

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
///
/// Cost on GCN: 1 instruction.
fn sigma_from_alpha(alpha: f32) -> f32 {
    return alpha * 0.70710678;
}

/// The inverse of `sigma_from_alpha`.
///
/// Cost on GCN: 1 instruction.
fn alpha_from_sigma(sigma: f32) -> f32 {
    return sigma * 1.41421356;
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and y
/// (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
///
/// Cost on GCN: 20 instructions (5 at a quarter of the rate).
fn beckmann_aniso_d(h: vec3f, sigma_t: f32, sigma_b: f32) -> f32 {
    // z⁴ underflows long after the exponential has: at z = 1e-6 it is exp(-5e11 / sigma²).
    if h.z <= 1e-6 {
        return 0.0;
    }
    let z_sqr = h.z * h.z;
    let x = h.x / sigma_t;
    let y = h.y / sigma_b;
    return exp(-0.5 * (x * x + y * y) / z_sqr) / (6.2831853 * sigma_t * sigma_b * z_sqr * z_sqr);
}

/// Slope towards which a unit normal with z ≥ 0 leans: `n.xy / n.z`, a million at most.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
fn slope_from_normal(n: vec3f) -> vec2f {
    return n.xy / max(n.z, 1e-6);
}

/// Unit normal of a slope.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
fn normal_from_slope(slope: vec2f) -> vec3f {
    return vec3f(slope, 1.0) * inverseSqrt(1.0 + dot(slope, slope));
}

// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/beckmann.wesl, by ./x shaders. Needs: nothing else

// The Beckmann distribution and LEAN mapping, to compare with.
//
// Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
// Olano, Baker. LEAN Mapping. I3D 2010.

#ifndef KINRAN_BECKMANN_HLSL
#define KINRAN_BECKMANN_HLSL

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
///
/// Cost on GCN: 1 instruction.
float sigma_from_alpha(float alpha)
{
    return alpha * 0.70710677;
}

/// The inverse of `sigma_from_alpha`.
///
/// Cost on GCN: 1 instruction.
float alpha_from_sigma(float sigma)
{
    return sigma * 1.4142135;
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and y
/// (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
///
/// Cost on GCN: 20 instructions (5 at a quarter of the rate).
float beckmann_aniso_d(float3 h, float sigma_t, float sigma_b)
{
    if (h.z <= 1e-6) {
        return 0.0;
    }
    float z_sqr = h.z * h.z;
    float x = h.x / sigma_t;
    float y = h.y / sigma_b;
    return exp(((-0.5 * ((x * x) + (y * y))) / z_sqr)) / ((((6.2831855 * sigma_t) * sigma_b) * z_sqr) * z_sqr);
}

/// Slope towards which a unit normal with z ≥ 0 leans: `n.xy / n.z`, a million at most.
///
/// Cost on GCN: 4 instructions (1 at a quarter of the rate).
float2 slope_from_normal(float3 n)
{
    return n.xy / (max(n.z, 1e-6)).xx;
}

/// Unit normal of a slope.
///
/// Cost on GCN: 5 instructions (1 at a quarter of the rate).
float3 normal_from_slope(float2 slope)
{
    return float3(slope, 1.0) * rsqrt((1.0 + dot(slope, slope)));
}

#endif

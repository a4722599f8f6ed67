// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_sampling.wesl, by ./x shaders. Needs: fuzz_phase, ggx

// Light directions for a view, where a layer of fibres and its base scatter from.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

#ifndef KINRAN_FUZZ_SAMPLING_HLSL
#define KINRAN_FUZZ_SAMPLING_HLSL

#include "fuzz_phase.hlsl"
#include "ggx.hlsl"

/// A light direction distributed as `fuzz_pdf` for the view `v`, from two uniform numbers in [0, 1): `v` reflected on a
/// visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer receives nothing:
/// the density covers the sphere.
///
/// Cost on GCN: 58 instructions (6 at a quarter of the rate).
float3 fuzz_sample(float3 v, float3 t, float alpha, float2 xi)
{
    float3 squeezed_v = v - (t * ((1.0 - alpha) * dot(t, v)));
    float phi = 6.2831855 * xi.x;
    float z = 1.0 - (2.0 * xi.y);
    float r = sqrt(max((1.0 - (z * z)), 0.0));
    float3 axis = normalize(squeezed_v);
    float3 sum = float3((r * cos(phi)), (r * sin(phi)), z) + axis;
    float3 m = normalize(((dot(sum, sum) > 1e-12) ? sum : axis));
    float3 h = normalize((m - (t * ((1.0 - alpha) * dot(t, m)))));
    return (h * (2.0 * dot(v, h))) - v;
}

/// Density per steradian of `fuzz_sample`: `D_F(h) / (4 σ_F(v))`.
///
/// Cost on GCN: 27 instructions (2 at a quarter of the rate).
float fuzz_pdf(float3 u, float3 v, float3 t, float alpha)
{
    const float _e7 = fibre_phase(dot(u, v), dot(t, v), dot(t, u), alpha);
    return _e7;
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the light that
/// each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
float3 fuzz_over_base_shares(float fuzz, float specular, float diffuse)
{
    float least = 0.05 * max(max(fuzz, max(specular, diffuse)), 1e-6);
    float3 shares = max(float3(fuzz, specular, diffuse), (least).xxx);
    return shares / (((shares.x + shares.y) + shares.z)).xxx;
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as `fuzz_over_base_pdf`; vectors in the
/// frame of the alphas, z along the normal, `shares` as `fuzz_over_base_shares` gives them.
///
/// Cost on GCN: 118 instructions (18 at a quarter of the rate).
float3 fuzz_over_base_sample(float3 v, float3 t, float alpha, float alpha_t, float alpha_b, float3 shares, float2 xi)
{
    if (xi.x < shares.x) {
        const float3 _e15 = fuzz_sample(v, t, alpha, float2((xi.x / shares.x), xi.y));
        return _e15;
    }
    float rest = xi.x - shares.x;
    if (rest < shares.y) {
        const float3 _e25 = ggx_vndf_sample(v, alpha_t, alpha_b, float2((rest / shares.y), xi.y));
        return (_e25 * (2.0 * dot(v, _e25))) - v;
    }
    float x = saturate(((rest - shares.y) / shares.z));
    float phi = 6.2831855 * xi.y;
    float r = sqrt(x);
    return float3((r * cos(phi)), (r * sin(phi)), sqrt((1.0 - x)));
}

/// Density per steradian of `fuzz_over_base_sample`, over the sphere.
///
/// Cost on GCN: 84 instructions (7 at a quarter of the rate).
float fuzz_over_base_pdf(float3 u, float3 v, float3 t, float alpha, float alpha_t, float alpha_b, float3 shares)
{
    float3 sum = u + v;
    float3 h = normalize(((dot(sum, sum) > 1e-12) ? sum : t));
    const float _e13 = ggx_vndf_pdf(v, h, alpha_t, alpha_b);
    float specular = _e13 / max((4.0 * dot(v, h)), 1e-12);
    float diffuse = max(u.z, 0.0) * 0.31830987;
    const float _e26 = fuzz_pdf(u, v, t, alpha);
    return ((shares.x * _e26) + (shares.y * specular)) + (shares.z * diffuse);
}

#endif

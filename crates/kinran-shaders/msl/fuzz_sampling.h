// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/fuzz_sampling.wesl, by ./x shaders. Needs: fuzz_phase, ggx

// Light directions for a view, where a layer of fibres and its base scatter from.
//
// Heitz, Dupuy, Crassin, Dachsbacher. The SGGX Microflake Distribution. SIGGRAPH 2015.

#ifndef KINRAN_FUZZ_SAMPLING_METAL
#define KINRAN_FUZZ_SAMPLING_METAL

#include <metal_stdlib>

#include "fuzz_phase.h"
#include "ggx.h"

/// A light direction distributed as `fuzz_pdf` for the view `v`, from two uniform numbers in [0, 1): `v` reflected on a
/// visible normal of the fibres (Heitz 2015, section 4). It may lie below the horizon, where the layer receives nothing:
/// the density covers the sphere.
///
/// Cost on GCN: 58 instructions (6 at a quarter of the rate).
inline metal::float3 fuzz_sample(
    metal::float3 v,
    metal::float3 t,
    float alpha,
    metal::float2 xi
) {
    metal::float3 squeezed_v = v - (t * ((1.0 - alpha) * metal::dot(t, v)));
    float phi = 6.2831855 * xi.x;
    float z = 1.0 - (2.0 * xi.y);
    float r = metal::sqrt(metal::max(1.0 - (z * z), 0.0));
    metal::float3 axis = metal::normalize(squeezed_v);
    metal::float3 sum = metal::float3(r * metal::cos(phi), r * metal::sin(phi), z) + axis;
    metal::float3 m = metal::normalize((metal::dot(sum, sum) > 0.000000000001) ? sum : axis);
    metal::float3 h = metal::normalize(m - (t * ((1.0 - alpha) * metal::dot(t, m))));
    return (h * (2.0 * metal::dot(v, h))) - v;
}

/// Density per steradian of `fuzz_sample`: `D_F(h) / (4 σ_F(v))`.
///
/// Cost on GCN: 27 instructions (2 at a quarter of the rate).
inline float fuzz_pdf(
    metal::float3 u,
    metal::float3 v,
    metal::float3 t,
    float alpha
) {
    float _e7 = fibre_phase(metal::dot(u, v), metal::dot(t, v), metal::dot(t, u), alpha);
    return _e7;
}

/// Probabilities of sampling the layer, the base's specular lobe and its diffuse one, in proportion to the light that
/// each is expected to send; each at least 5 % of the largest, so that a wrong guess only adds noise.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
inline metal::float3 fuzz_over_base_shares(
    float fuzz,
    float specular,
    float diffuse
) {
    float least = 0.05 * metal::max(metal::max(fuzz, metal::max(specular, diffuse)), 0.000001);
    metal::float3 shares = metal::max(metal::float3(fuzz, specular, diffuse), metal::float3(least));
    return shares / metal::float3((shares.x + shares.y) + shares.z);
}

/// A light direction for a layer of fibres over GGX and Lambert, distributed as `fuzz_over_base_pdf`; vectors in the
/// frame of the alphas, z along the normal, `shares` as `fuzz_over_base_shares` gives them.
///
/// Cost on GCN: 118 instructions (18 at a quarter of the rate).
inline metal::float3 fuzz_over_base_sample(
    metal::float3 v,
    metal::float3 t,
    float alpha,
    float alpha_t,
    float alpha_b,
    metal::float3 shares,
    metal::float2 xi
) {
    if (xi.x < shares.x) {
        metal::float3 _e15 = fuzz_sample(v, t, alpha, metal::float2(xi.x / shares.x, xi.y));
        return _e15;
    }
    float rest = xi.x - shares.x;
    if (rest < shares.y) {
        metal::float3 _e25 = ggx_vndf_sample(v, alpha_t, alpha_b, metal::float2(rest / shares.y, xi.y));
        return (_e25 * (2.0 * metal::dot(v, _e25))) - v;
    }
    float x = metal::saturate((rest - shares.y) / shares.z);
    float phi = 6.2831855 * xi.y;
    float r = metal::sqrt(x);
    return metal::float3(r * metal::cos(phi), r * metal::sin(phi), metal::sqrt(1.0 - x));
}

/// Density per steradian of `fuzz_over_base_sample`, over the sphere.
///
/// Cost on GCN: 84 instructions (7 at a quarter of the rate).
inline float fuzz_over_base_pdf(
    metal::float3 u,
    metal::float3 v,
    metal::float3 t,
    float alpha,
    float alpha_t,
    float alpha_b,
    metal::float3 shares
) {
    metal::float3 sum = u + v;
    metal::float3 h = metal::normalize((metal::dot(sum, sum) > 0.000000000001) ? sum : t);
    float _e13 = ggx_vndf_pdf(v, h, alpha_t, alpha_b);
    float specular = _e13 / metal::max(4.0 * metal::dot(v, h), 0.000000000001);
    float diffuse = metal::max(u.z, 0.0) * 0.31830987;
    float _e26 = fuzz_pdf(u, v, t, alpha);
    return ((shares.x * _e26) + (shares.y * specular)) + (shares.z * diffuse);
}

#endif

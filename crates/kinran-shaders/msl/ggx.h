// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/ggx.wesl, by ./x shaders. Needs: sym

// The GGX microfacet lobe, isotropic and anisotropic.
//
// All directions are unit vectors in the shading frame: z is the normal, x the tangent along which the roughness is
// `alpha_t`, y the bitangent along which it is `alpha_b`. `alpha` is GGX roughness, the square of perceptual
// roughness, from ALPHA_MIN to 1.
//
// A lobe of a light is D V F n·u times the light's irradiance. What depends on the view alone (the stretched v of the
// visibility, products of alphas) is the same for every light, and compilers keep it out of an unrolled loop.

#ifndef KINRAN_GGX_METAL
#define KINRAN_GGX_METAL

#include <metal_stdlib>

#include "sym.h"

/// 1 / π.
constant float FRAC_1_PI = 0.31830987;

/// Isotropic distribution of microfacet normals per steradian, `n_h = n·h` (Walter 2007, eq. 33). One ulp of `n_h`
/// moves the peak by `2.4e-7 / alpha²`; where that matters, `ggx_aniso_d` has all the digits.
///
/// Cost on GCN: 10 instructions (1 at a quarter of the rate).
inline float ggx_d(
    float n_h,
    float alpha
) {
    float a_sqr = alpha * alpha;
    float q = ((1.0 - n_h) * (1.0 + n_h)) + ((a_sqr * n_h) * n_h);
    return (a_sqr * FRAC_1_PI) / (q * q);
}

/// Anisotropic distribution of microfacet normals per steradian (slide: Our Algorithm, the form with
/// `(alpha_t alpha_b)^3`), for `h` in the upper hemisphere. Its integral against n·h over there is one.
///
/// Cost on GCN: 12 instructions (1 at a quarter of the rate).
inline float ggx_aniso_d(
    metal::float3 h,
    float alpha_t,
    float alpha_b
) {
    float alpha_tb = alpha_t * alpha_b;
    metal::float3 v = metal::float3(h.x * alpha_b, h.y * alpha_t, h.z * alpha_tb);
    float w = alpha_tb / metal::dot(v, v);
    return ((alpha_tb * FRAC_1_PI) * w) * w;
}

/// `ggx_aniso_d` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode:
/// `|A|^(3/2) / (π (h.xy^T adj(A) h.xy + |A| h.z²)²)`. `|A|` must be positive.
///
/// Cost on GCN: 17 instructions (2 at a quarter of the rate).
inline float ggx_matrix_d(
    metal::float3 h,
    metal::float3 a
) {
    float _e2 = sym2_det(a);
    float _e9 = sym2_quadratic(metal::float3(a.z, -(a.y), a.x), h.xy);
    float w = _e2 / (_e9 + ((_e2 * h.z) * h.z));
    return ((metal::rsqrt(_e2) * FRAC_1_PI) * w) * w;
}

/// Visibility from the two terms of `2 n·u n·v (1 + Λ(u) + Λ(v))`: `n·v |u'|` and `n·u |v'|`, where the prime
/// stretches a direction by the roughness. Finite, and meaningless, where both directions graze: their sum is 8e-9 where
/// both cosines are 1e-6 and alpha is ALPHA_MIN. The bound keeps the product with the sharpest peak finite too.
///
/// Cost on GCN: 3 instructions (1 at a quarter of the rate).
inline float smith_v_of_terms(
    float u,
    float v
) {
    return 0.5 / metal::max(u + v, 0.000000000001);
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, isotropic (Heitz 2014, eq. 99).
///
/// Cost on GCN: 12 instructions (3 at a quarter of the rate).
inline float smith_v(
    float n_u,
    float n_v,
    float alpha
) {
    float a_sqr = alpha * alpha;
    float v = n_u * metal::sqrt(((n_v * n_v) * (1.0 - a_sqr)) + a_sqr);
    float u = n_v * metal::sqrt(((n_u * n_u) * (1.0 - a_sqr)) + a_sqr);
    float _e18 = smith_v_of_terms(u, v);
    return _e18;
}

/// Height-correlated Smith visibility `G2 / (4 n·u n·v)`, anisotropic (Heitz 2014, eq. 99 with the lambda of section
/// 5.3). `u` and `v` lie in the upper hemisphere.
///
/// Cost on GCN: 16 instructions (3 at a quarter of the rate).
inline float smith_aniso_v(
    metal::float3 u,
    metal::float3 v,
    float alpha_t,
    float alpha_b
) {
    metal::float3 stretch = metal::float3(alpha_t, alpha_b, 1.0);
    float _e14 = smith_v_of_terms(v.z * metal::length(u * stretch), u.z * metal::length(v * stretch));
    return _e14;
}

/// `smith_aniso_v` from the squared roughness matrix `a` (xx, xy, yy), with no eigen decode.
///
/// Cost on GCN: 21 instructions (3 at a quarter of the rate).
inline float smith_matrix_v(
    metal::float3 u,
    metal::float3 v,
    metal::float3 a
) {
    float _e4 = sym2_quadratic(a, u.xy);
    float stretched_u = metal::sqrt(_e4 + (u.z * u.z));
    float _e11 = sym2_quadratic(a, v.xy);
    float stretched_v = metal::sqrt(_e11 + (v.z * v.z));
    float _e21 = smith_v_of_terms(v.z * stretched_u, u.z * stretched_v);
    return _e21;
}

/// Smith masking of `v` alone, 0 to 1 (Heitz 2014, eq. 43).
///
/// Cost on GCN: 10 instructions (2 at a quarter of the rate).
inline float smith_aniso_g1(
    metal::float3 v,
    float alpha_t,
    float alpha_b
) {
    return (2.0 * v.z) / (v.z + metal::length(v * metal::float3(alpha_t, alpha_b, 1.0)));
}

/// Fresnel reflectance by Schlick's approximation (1994) from `f0` at normal incidence to one at grazing.
///
/// Cost on GCN: 10 instructions.
inline metal::float3 schlick_f(
    metal::float3 f0_1,
    float v_h
) {
    float m = metal::saturate(1.0 - v_h);
    float m_sqr = m * m;
    return f0_1 + ((metal::float3(1.0) - f0_1) * ((m_sqr * m_sqr) * m));
}

/// A microfacet normal distributed as `ggx_vndf_pdf` for the view direction `v`, from two uniform numbers in [0, 1)
/// (Dupuy, Benyoub 2023, listing 3).
///
/// Cost on GCN: 32 instructions (5 at a quarter of the rate).
inline metal::float3 ggx_vndf_sample(
    metal::float3 v,
    float alpha_t,
    float alpha_b,
    metal::float2 xi
) {
    metal::float3 stretch = metal::float3(alpha_t, alpha_b, 1.0);
    metal::float3 v_std = metal::normalize(v * stretch);
    float phi = 6.2831855 * xi.x;
    float z = ((1.0 - xi.y) * (1.0 + v_std.z)) - v_std.z;
    float sin_theta = metal::sqrt(metal::max(1.0 - (z * z), 0.0));
    metal::float3 cap = metal::float3(sin_theta * metal::cos(phi), sin_theta * metal::sin(phi), z);
    metal::float3 h = (cap + v_std) * stretch;
    float length_squared = metal::dot(h, h);
    return (length_squared > 0.0) ? (h * metal::rsqrt(length_squared)) : metal::float3(0.0, 0.0, 1.0);
}

/// Density per steradian of microfacet normals visible from `v`: `G1(v) max(v·h, 0) D(h) / n·v` (Heitz 2014, eq. 16).
/// Divide by `4 v·h` for the density of the reflected direction.
///
/// Cost on GCN: 29 instructions (3 at a quarter of the rate).
inline float ggx_vndf_pdf(
    metal::float3 v,
    metal::float3 h,
    float alpha_t,
    float alpha_b
) {
    if (h.z <= 0.0) {
        return 0.0;
    }
    float g_over_n_v = 2.0 / (v.z + metal::length(v * metal::float3(alpha_t, alpha_b, 1.0)));
    float _e20 = ggx_aniso_d(h, alpha_t, alpha_b);
    return (g_over_n_v * metal::max(metal::dot(v, h), 0.0)) * _e20;
}

#endif

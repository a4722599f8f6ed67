// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/skin_lighting.wesl, by ./x shaders. Needs: ggx, sh

// Light on skin: where to look into the tables, ambient light, gloss, and normals by channel.
//
// - Penner, Borshukov. Pre-Integrated Skin Shading. GPU Pro 2, 2011.
//
// A punctual light: `color += base / π * irradiance * table(skin_lut_uv(n·u, curvature, 1 / range)).rgb`, where n·u is
// not clamped, irradiance is the light's at normal incidence, and curvature is `curvature_from_light` of the light's
// tangent and bitangent components. Translucency is yours to add there: a term for light from behind belongs to this sum
// and needs nothing else from these functions.

#ifndef KINRAN_SKIN_LIGHTING_HLSL
#define KINRAN_SKIN_LIGHTING_HLSL

#include "ggx.hlsl"
#include "sh.hlsl"

/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light that leaves farther than a pore is wide.
static const float3 SKIN_NORMAL_BLUR = float3(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
///
/// Cost on GCN: 2 instructions.
float2 skin_lut_uv(float n_u, float curvature, float inverse_range)
{
    return float2(((0.5 * n_u) + 0.5), (curvature * inverse_range));
}

/// Irradiance of skin under ambient light: `sh_irradiance` with bands 1 and 2 multiplied, for each channel, by what the
/// profile leaves of them at the mean curvature. Clamp what rings below zero.
///
/// Cost on GCN: 53 instructions.
float3 skin_irradiance(float3 radiance[9], float3 normal, float3 h_one, float3 h_two)
{
    const float _e4[9] = sh_basis(normal);
    float3 one = ((radiance[1] * _e4[1]) + (radiance[2] * _e4[2])) + (radiance[3] * _e4[3]);
    float3 two = ((((radiance[4] * _e4[4]) + (radiance[5] * _e4[5])) + (radiance[6] * _e4[6])) + (radiance[7] * _e4[7])) + (radiance[8] * _e4[8]);
    return (((3.1415927 * _e4[0]) * radiance[0]) + ((2.0943952 * h_one) * one)) + ((0.7853982 * h_two) * two);
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
///
/// Cost on GCN: 40 instructions (8 at a quarter of the rate).
float skin_specular(float n_h, float n_u, float n_v, float alpha_one, float alpha_two, float share)
{
    const float _e6 = ggx_d(n_h, alpha_one);
    const float _e7 = smith_v(n_u, n_v, alpha_one);
    float one = _e6 * _e7;
    const float _e9 = ggx_d(n_h, alpha_two);
    const float _e10 = smith_v(n_u, n_v, alpha_two);
    float two = _e9 * _e10;
    return one + (share * (two - one));
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// (SKIN_NORMAL_BLUR). Gloss keeps `n`. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
float3 skin_normal(float3 n, float3 n_mesh, float blur)
{
    return normalize((n + (blur * (n_mesh - n))));
}

#endif

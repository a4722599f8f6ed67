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

#ifndef KINRAN_SKIN_LIGHTING_METAL
#define KINRAN_SKIN_LIGHTING_METAL

#include <metal_stdlib>

#include "ggx.h"
#include "sh.h"

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

/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light that leaves farther than a pore is wide.
constant metal::float3 SKIN_NORMAL_BLUR = metal::float3(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
///
/// Cost on GCN: 2 instructions.
inline metal::float2 skin_lut_uv(
    float n_u,
    float curvature,
    float inverse_range
) {
    return metal::float2((0.5 * n_u) + 0.5, curvature * inverse_range);
}

/// Irradiance of skin under ambient light: `sh_irradiance` with bands 1 and 2 multiplied, for each channel, by what the
/// profile leaves of them at the mean curvature. Clamp what rings below zero.
///
/// Cost on GCN: 53 instructions.
inline metal::float3 skin_irradiance(
    Float3x9Array radiance,
    metal::float3 normal,
    metal::float3 h_one,
    metal::float3 h_two
) {
    Float9Array _e4 = sh_basis(normal);
    metal::float3 one = ((radiance.inner[1] * _e4.inner[1]) + (radiance.inner[2] * _e4.inner[2])) + (radiance.inner[3] * _e4.inner[3]);
    metal::float3 two = ((((radiance.inner[4] * _e4.inner[4]) + (radiance.inner[5] * _e4.inner[5])) + (radiance.inner[6] * _e4.inner[6])) + (radiance.inner[7] * _e4.inner[7])) + (radiance.inner[8] * _e4.inner[8]);
    return (((3.1415927 * _e4.inner[0]) * radiance.inner[0]) + ((2.0943952 * h_one) * one)) + ((0.7853982 * h_two) * two);
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
///
/// Cost on GCN: 40 instructions (8 at a quarter of the rate).
inline float skin_specular(
    float n_h,
    float n_u,
    float n_v,
    float alpha_one,
    float alpha_two,
    float share
) {
    float _e6 = ggx_d(n_h, alpha_one);
    float _e7 = smith_v(n_u, n_v, alpha_one);
    float one = _e6 * _e7;
    float _e9 = ggx_d(n_h, alpha_two);
    float _e10 = smith_v(n_u, n_v, alpha_two);
    float two = _e9 * _e10;
    return one + (share * (two - one));
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// (SKIN_NORMAL_BLUR). Gloss keeps `n`. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
inline metal::float3 skin_normal(
    metal::float3 n,
    metal::float3 n_mesh,
    float blur
) {
    return metal::normalize(n + (blur * (n_mesh - n)));
}

#endif

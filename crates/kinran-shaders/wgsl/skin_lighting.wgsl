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

/// How far the normals of red, green and blue turn from the normal map's towards the mesh's (Penner 2011, section 1.4,
/// who leaves the numbers to the eye): the share of each channel's light that leaves farther than a pore is wide.
const SKIN_NORMAL_BLUR: vec3f = vec3f(0.667, 0.209, 0.007);

/// Where the table of punctual light has its value for `n_u`, the unclamped cosine between normal and light, and a
/// curvature: x from the dark to the lit side, y from flat to `1 / inverse_range`. Sample with linear filtering and
/// clamped edges.
///
/// Cost on GCN: 2 instructions.
fn skin_lut_uv(n_u: f32, curvature: f32, inverse_range: f32) -> vec2f {
    return vec2f(0.5 * n_u + 0.5, curvature * inverse_range);
}

/// Irradiance of skin under ambient light: `sh_irradiance` with bands 1 and 2 multiplied, for each channel, by what the
/// profile leaves of them at the mean curvature. Clamp what rings below zero.
///
/// Cost on GCN: 53 instructions.
fn skin_irradiance(radiance: array<vec3f, 9>, normal: vec3f, h_one: vec3f, h_two: vec3f) -> vec3f {
    let basis = sh_basis(normal);
    let one = radiance[1] * basis[1] + radiance[2] * basis[2] + radiance[3] * basis[3];
    let two = radiance[4] * basis[4] + radiance[5] * basis[5] + radiance[6] * basis[6] + radiance[7] * basis[7]
        + radiance[8] * basis[8];
    return 3.14159265 * basis[0] * radiance[0] + 2.09439510 * h_one * one + 0.78539816 * h_two * two;
}

/// The gloss of skin, without Fresnel's term: distribution times visibility of two GGX lobes, `alpha_one` with the weight
/// `1 - share` and `alpha_two` with `share`. One lobe is too tight at its foot or too wide at its top.
///
/// Cost on GCN: 40 instructions (8 at a quarter of the rate).
fn skin_specular(n_h: f32, n_u: f32, n_v: f32, alpha_one: f32, alpha_two: f32, share: f32) -> f32 {
    let one = ggx_d(n_h, alpha_one) * smith_v(n_u, n_v, alpha_one);
    let two = ggx_d(n_h, alpha_two) * smith_v(n_u, n_v, alpha_two);
    return one + share * (two - one);
}

/// The normal of one channel: from the normal map's `n` towards the mesh's `n_mesh` by `blur`, 0 to 1
/// (SKIN_NORMAL_BLUR). Gloss keeps `n`. They are less than 180° apart.
///
/// Cost on GCN: 13 instructions (1 at a quarter of the rate).
fn skin_normal(n: vec3f, n_mesh: vec3f, blur: f32) -> vec3f {
    return normalize(n + blur * (n_mesh - n));
}

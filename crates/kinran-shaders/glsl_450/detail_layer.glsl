// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_layer.wesl, by ./x shaders. Needs: aniso

// What a tiled layer's texels go through before they are blended: place, colour, direction, mask. Between `detail_uv`
// and the rest stands the texture fetch, with the hardware's filter and its repeating or mirroring address mode.

#ifndef KINRAN_DETAIL_LAYER_GLSL
#define KINRAN_DETAIL_LAYER_GLSL

#include "aniso.glsl"

/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
///
/// Cost on GCN: 6 instructions.
vec3 detail_from_texel(vec3 texel) {
    return clamp(((texel * 1.003937) - vec3(0.003937008)), vec3(0.0), vec3(1.0));
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
///
/// Cost on GCN: 4 instructions.
vec2 detail_uv(vec2 uv, mat2 matrix, vec2 offset) {
    return (matrix * uv) + offset;
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
///
/// Cost on GCN: 6 instructions.
vec2 detail_mirror(vec2 uv) {
    return vec2(1.0) - (4.0 * fract((0.5 * floor(uv))));
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
///
/// Cost on GCN: 2 instructions.
float detail_mask(float mask, float contrast) {
    return clamp((((mask - 0.5) * contrast) + 0.5), 0.0, 1.0);
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// `detail_mirror` says, or ones. A change of scale leaves slopes as they are.
///
/// Cost on GCN: 6 instructions.
vec3 detail_turn_normal(vec3 n, vec2 rotation, vec2 mirror) {
    vec2 xy = n.xy * mirror;
    return vec3(((rotation.x * xy.x) + (rotation.y * xy.y)), ((rotation.x * xy.y) - (rotation.y * xy.x)), n.z);
}

/// A tile's aniso texel in the mesh's tangent space; as `detail_turn_normal`.
///
/// Cost on GCN: 32 instructions (3 at a quarter of the rate).
vec3 detail_turn_aniso(vec3 texel, vec2 rotation, vec2 mirror) {
    vec3 _e3 = aniso_decode_matrix(texel);
    float xy = (_e3.y * mirror.x) * mirror.y;
    float c = rotation.x;
    float s = rotation.y;
    float across = ((2.0 * c) * s) * xy;
    vec3 _e42 = aniso_encode(vec3(((((c * c) * _e3.x) + across) + ((s * s) * _e3.z)), (((c * s) * (_e3.z - _e3.x)) + (((c * c) - (s * s)) * xy)), ((((s * s) * _e3.x) - across) + ((c * c) * _e3.z))));
    return _e42;
}

#endif

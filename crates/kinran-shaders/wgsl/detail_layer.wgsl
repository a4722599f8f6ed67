// Kinran shader library. SPDX-License-Identifier: MIT OR Apache-2.0
// Copyright (c) the Kinran authors. Paste what you need; keep these two lines.
// Made from src/detail_layer.wesl, by ./x shaders. Needs: aniso

// What a tiled layer's texels go through before they are blended: place, colour, direction, mask. Between `detail_uv`
// and the rest stands the texture fetch, with the hardware's filter and its repeating or mirroring address mode.

/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
///
/// Cost on GCN: 6 instructions.
fn detail_from_texel(texel: vec3f) -> vec3f {
    return saturate(texel * 1.003937007874016 - 0.003937007874016);
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
///
/// Cost on GCN: 4 instructions.
fn detail_uv(uv: vec2f, matrix: mat2x2f, offset: vec2f) -> vec2f {
    return matrix * uv + offset;
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
///
/// Cost on GCN: 6 instructions.
fn detail_mirror(uv: vec2f) -> vec2f {
    return 1.0 - 4.0 * fract(0.5 * floor(uv));
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
///
/// Cost on GCN: 2 instructions.
fn detail_mask(mask: f32, contrast: f32) -> f32 {
    return saturate((mask - 0.5) * contrast + 0.5);
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// `detail_mirror` says, or ones. A change of scale leaves slopes as they are.
///
/// Cost on GCN: 6 instructions.
fn detail_turn_normal(n: vec3f, rotation: vec2f, mirror: vec2f) -> vec3f {
    let xy = n.xy * mirror;
    return vec3f(rotation.x * xy.x + rotation.y * xy.y, rotation.x * xy.y - rotation.y * xy.x, n.z);
}

/// A tile's aniso texel in the mesh's tangent space; as `detail_turn_normal`.
///
/// Cost on GCN: 32 instructions (3 at a quarter of the rate).
fn detail_turn_aniso(texel: vec3f, rotation: vec2f, mirror: vec2f) -> vec3f {
    let a = aniso_decode_matrix(texel);
    let xy = a.y * mirror.x * mirror.y;
    let c = rotation.x;
    let s = rotation.y;
    let across = 2.0 * c * s * xy;
    return aniso_encode(vec3f(
        c * c * a.x + across + s * s * a.z,
        c * s * (a.z - a.x) + (c * c - s * s) * xy,
        s * s * a.x - across + c * c * a.z,
    ));
}

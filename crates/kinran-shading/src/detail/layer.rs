//! What a tiled layer's texels go through before they are blended.

use crate::{Sym2, aniso_decode_matrix, aniso_encode};
use glam::{Mat2, Vec2, Vec3, vec2, vec3};

/// The synthesized value of a texel in [0, 1]: byte 128 is 1/2, 1 and 0 are 0, 255 is 1. Without this mapping 8 bits do
/// not hold the neutral 1/2, and a detail equal to its target would come out 0.4 % off.
#[inline(always)]
pub fn detail_from_texel(texel: Vec3) -> Vec3 {
    (texel * (255.0 / 254.0) - 1.0 / 254.0).clamp(Vec3::ZERO, Vec3::ONE)
}

/// Place in the tile: the mesh's `uv` scaled and rotated by `matrix`, then moved. The matrix is
/// `KHR_texture_transform`'s, with columns `(cos sx, -sin sx)` and `(sin sy, cos sy)`.
#[inline(always)]
pub fn detail_uv(uv: Vec2, matrix: Mat2, offset: Vec2) -> Vec2 {
    matrix * uv + offset
}

/// Signs that mirrored tiling gives the directions in a tile at `uv`: −1 along an axis in every other tile.
#[inline(always)]
pub fn detail_mirror(uv: Vec2) -> Vec2 {
    let odd = |x: f32| {
        let half = 0.5 * libm::floorf(x);
        1.0 - 4.0 * (half - libm::floorf(half))
    };
    vec2(odd(uv.x), odd(uv.y))
}

/// Opacity of a layer: the mask's contrast raised around 1/2. `contrast` 1 leaves it as it is, 0 makes it 1/2.
#[inline(always)]
pub fn detail_mask(mask: f32, contrast: f32) -> f32 {
    ((mask - 0.5) * contrast + 0.5).clamp(0.0, 1.0)
}

/// A tile's normal in the mesh's tangent space. `rotation` is the cosine and sine of the layer's rotation, `mirror` what
/// [`detail_mirror`] says, or ones. A change of scale leaves slopes as they are.
///
/// With y up in normals and v down in textures, the gradient's transposed matrix is the rotation itself.
#[inline(always)]
pub fn detail_turn_normal(n: Vec3, rotation: Vec2, mirror: Vec2) -> Vec3 {
    let (x, y) = (n.x * mirror.x, n.y * mirror.y);
    vec3(rotation.x * x + rotation.y * y, rotation.x * y - rotation.y * x, n.z)
}

/// A tile's aniso texel in the mesh's tangent space; as [`detail_turn_normal`].
#[inline(always)]
pub fn detail_turn_aniso(texel: Vec3, rotation: Vec2, mirror: Vec2) -> Vec3 {
    let a = aniso_decode_matrix(texel);
    let xy = a.xy * mirror.x * mirror.y;
    let (c, s) = (rotation.x, rotation.y);
    aniso_encode(Sym2 {
        xx: c * c * a.xx + 2.0 * c * s * xy + s * s * a.yy,
        xy: c * s * (a.yy - a.xx) + (c * c - s * s) * xy,
        yy: s * s * a.xx - 2.0 * c * s * xy + c * c * a.yy,
    })
}

//! Which image a material wears, and where it lies.

use glam::Mat3;

/// How a texture repeats outside the unit square.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// Tiles.
    Repeat,
    /// Continues its border texel.
    Clamp,
    /// Tiles, every other tile mirrored.
    Mirror,
}

/// One use of a texture by a material.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`Scene::images`](crate::Scene::images).
    pub image: usize,
    /// Index into [`Scene::textures`](crate::Scene::textures), where the document has a KTX2 or DDS file beside or in place of the image.
    pub runtime: Option<usize>,
    /// Which of a primitive's UV sets: 0 or 1.
    pub uv_set: usize,
    /// Maps the primitive's UV to the texture's (`KHR_texture_transform`; identity when absent).
    pub transform: Mat3,
    /// Repetition along u and v.
    pub wrap: [Wrap; 2],
}

/// What the elements of two transforms may differ by and be the same, for the largest of them: the rounding of decimals
/// and of a rotation written as 2π. Over UVs up to 16 it moves a texel of 4096² by a fifteenth of its side.
const TRANSFORM_ROUNDING: f32 = 1e-6;

impl TextureRef {
    /// Whether both lie on the mesh in the same way: UV set, wrapping and, up to rounding, the transform.
    pub fn lies_as(&self, other: &TextureRef) -> bool {
        let elements = self.transform.to_cols_array();
        let largest = elements.into_iter().fold(1.0_f32, |largest, x| largest.max(x.abs()));
        (self.uv_set, self.wrap) == (other.uv_set, other.wrap)
            && self.transform.abs_diff_eq(other.transform, TRANSFORM_ROUNDING * largest)
    }
}

//! A texture as a material wears it.

use super::{
    geometry::SurfacePoint,
    texture::{MipTexture, TextureFiltering},
};
use glam::{Mat3, Vec2, Vec4};
use kinran_scene::TextureRef;
use std::sync::Arc;

/// A texture in its place on a mesh.
#[derive(Clone, Debug)]
pub struct BoundTexture {
    /// The texels.
    pub texture: Arc<MipTexture>,
    /// Which of the mesh's UV sets: 0 or 1.
    pub uv_set: usize,
    /// Maps the mesh's UV to the texture's.
    pub transform: Mat3,
}

impl BoundTexture {
    /// A texture that is `texel` everywhere.
    pub fn constant(texel: [f32; 4]) -> Self {
        BoundTexture { texture: Arc::new(MipTexture::constant(texel)), uv_set: 0, transform: Mat3::IDENTITY }
    }

    /// A texture in the place of a glTF texture.
    pub fn new(texture: Arc<MipTexture>, place: &TextureRef) -> Self {
        BoundTexture { texture, uv_set: place.uv_set, transform: place.transform }
    }

    /// The texture's coordinates from the mesh's.
    #[inline]
    pub fn uv(&self, uv: [Vec2; 2]) -> Vec2 {
        self.transform.transform_point2(uv[self.uv_set])
    }

    /// The texture's coordinates' change from the mesh's.
    #[inline]
    pub fn uv_change(&self, change: [Vec2; 2]) -> Vec2 {
        self.transform.transform_vector2(change[self.uv_set])
    }
}

/// A texture at a point as `filtering` says; white where there is none.
#[inline]
pub(crate) fn sample(
    texture: &Option<BoundTexture>,
    point: &SurfacePoint,
    filtering: TextureFiltering,
) -> Vec4 {
    texture.as_ref().map_or(Vec4::ONE, |t| sample_bound(t, point, filtering))
}

#[inline]
pub(crate) fn sample_bound(t: &BoundTexture, point: &SurfacePoint, filtering: TextureFiltering) -> Vec4 {
    let uv = t.uv(point.uv);
    match filtering {
        TextureFiltering::Level0 => t.texture.sample_level(uv, 0),
        TextureFiltering::Mips { max_anisotropy } => {
            let (dx, dy) = (t.uv_change(point.uv_dx), t.uv_change(point.uv_dy));
            t.texture.sample_grad(uv, dx, dy, max_anisotropy)
        }
    }
}

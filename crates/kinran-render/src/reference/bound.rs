//! A texture as a material wears it.

use super::{
    geometry::SurfacePoint,
    sampler::sample_2d,
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
    texture: Option<&BoundTexture>,
    point: &SurfacePoint,
    filtering: TextureFiltering,
) -> Vec4 {
    texture.map_or(Vec4::ONE, |t| sample_bound(t, point, filtering))
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
        TextureFiltering::Texels { max_anisotropy, lobes_only: true, .. } => {
            sample_bound(t, point, TextureFiltering::Mips { max_anisotropy })
        }
        TextureFiltering::Texels { max_anisotropy, lobes_only: false, sample } => {
            sample_texel(t, point, max_anisotropy, sample)
        }
    }
}

/// Level 0 at a place of the footprint, see [`TextureFiltering::Texels`].
fn sample_texel(t: &BoundTexture, point: &SurfacePoint, max_anisotropy: u32, sample: [u32; 2]) -> Vec4 {
    let change = (t.uv_change(point.uv_dx), t.uv_change(point.uv_dy));
    t.texture.sample_level(t.texture.texel(t.uv(point.uv), change, max_anisotropy, sample), 0)
}

/// Of how many texels one is chosen by what it counts; chosen by eye.
const CANDIDATES: u32 = 8;

/// The pair of the sample sequence by which it is.
const CHOICE: u32 = 8;

/// Textures of normals and of lobes at a point.
#[inline]
pub(crate) fn sample_lobe(
    [normal, aniso]: [&BoundTexture; 2],
    point: &SurfacePoint,
    filtering: TextureFiltering,
) -> [Vec4; 2] {
    let TextureFiltering::Texels { max_anisotropy, lobes_only: true, sample: [index, seed] } = filtering
    else {
        return [normal, aniso].map(|t| sample_bound(t, point, filtering));
    };
    // Resampled importance sampling (Talbot, Cline, Egbert. Importance Resampling for Global Illumination. EGSR 2005).
    let (mut chosen, mut sum) = (index * CANDIDATES, 0.0);
    for candidate in index * CANDIDATES..(index + 1) * CANDIDATES {
        let counts = sample_texel(normal, point, max_anisotropy, [candidate, seed]).w;
        sum += counts;
        if sample_2d(candidate, CHOICE, seed).x * sum < counts {
            chosen = candidate;
        }
    }
    [normal, aniso].map(|t| sample_texel(t, point, max_anisotropy, [chosen, seed]))
}

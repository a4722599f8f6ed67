//! Maps that are blended from tiles and a synthesized map, at a point.

use std::sync::Arc;

use glam::{Mat2, Vec2, Vec3, Vec4, Vec4Swizzles};
use kinran_scene::{Detail, DetailLayer, DetailMap};
use kinran_shading::detail::{
    detail_from_texel, detail_mask, detail_mirror, detail_over, detail_turn_aniso, detail_turn_normal,
    detail_uv, hsv_shift, overlay_color, rnm, smooth_overlay_color,
};
use kinran_shading::normal_from_xy;

use super::bound::{BoundTexture, sample_bound};
use super::geometry::SurfacePoint;
use super::texture::{MipTexture, TextureFiltering};

/// What of a blended map is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DetailShown {
    /// Tiles and synthesized map, blended.
    #[default]
    Blended,
    /// The tiles alone.
    Detail,
    /// The synthesized map alone.
    Synthesized,
    /// The material's own maps: what was to be reproduced.
    Target,
}

/// Blended maps with their textures.
#[derive(Clone, Debug)]
pub struct RenderDetail {
    /// What the material says; its texture references are not looked at.
    pub detail: Detail,
    /// The synthesized maps, in the order of [`DetailMap::ALL`]; their place is also the masks'.
    pub maps: [Option<BoundTexture>; 4],
    /// As many as `detail` has.
    pub layers: Vec<RenderDetailLayer>,
    /// What is shown.
    pub shown: DetailShown,
    /// Multiplies the scale of all layers.
    pub tile_scale: f32,
}

/// The textures of a layer.
#[derive(Clone, Debug)]
pub struct RenderDetailLayer {
    /// In the order of [`DetailMap::ALL`].
    pub tiles: [Option<Arc<MipTexture>>; 4],
    /// Where it is seen.
    pub mask: Option<BoundTexture>,
    /// It is seen at all.
    pub on: bool,
    matrix: Mat2,
    rotation: Vec2,
}

impl RenderDetailLayer {
    pub(crate) fn new(
        layer: &DetailLayer,
        tiles: [Option<Arc<MipTexture>>; 4],
        mask: Option<BoundTexture>,
    ) -> Self {
        RenderDetailLayer {
            tiles,
            mask,
            on: true,
            matrix: layer.transform.matrix(),
            rotation: layer.transform.cos_sin(),
        }
    }
}

impl RenderDetail {
    pub(crate) fn new(
        detail: Detail,
        maps: [Option<BoundTexture>; 4],
        layers: Vec<RenderDetailLayer>,
    ) -> Self {
        RenderDetail { detail, maps, layers, shown: DetailShown::Blended, tile_scale: 1.0 }
    }

    /// The layer's matrix and its rotation's cosine and sine, as `detail_uv` and `detail_turn_normal` take them.
    #[cfg(feature = "gpu")]
    pub(crate) fn place(&self, layer: usize) -> (Mat2, Vec2) {
        (self.layers[layer].matrix * self.tile_scale, self.layers[layer].rotation)
    }

    /// A map at a point: linear colour or data, a unit normal in tangent space, or an aniso texel, with the synthesized
    /// map's alpha. `None` where the material's own map is to be taken.
    #[inline]
    pub(crate) fn at(
        &self,
        map: DetailMap,
        point: &SurfacePoint,
        filtering: TextureFiltering,
    ) -> Option<Vec4> {
        if self.shown == DetailShown::Target {
            return None;
        }
        let place = self.maps[map as usize].as_ref()?;
        let texel = sample_bound(place, point, filtering);
        let s = detail_from_texel(texel.xyz());
        let base = s * 2.0 - 1.0;
        let base = normal_from_xy(base.x, base.y);
        let neutral = match map {
            DetailMap::BaseColor | DetailMap::Data => Vec3::splat(0.5),
            DetailMap::Normal => Vec3::Z,
            DetailMap::Aniso => texel.xyz(),
        };
        let d = self.layered(map, place, neutral, point, filtering);
        let value = match (self.shown, map) {
            (DetailShown::Detail, _) => d,
            (DetailShown::Synthesized, DetailMap::Normal) => base,
            (DetailShown::Synthesized, DetailMap::Aniso) => texel.xyz(),
            (DetailShown::Synthesized, _) => s,
            (_, DetailMap::Normal) => rnm(base, d),
            (_, DetailMap::Aniso) => detail_over(texel.xyz(), d, self.detail.aniso_alpha),
            _ if self.detail.plain_overlay => overlay_color(s, d),
            _ => smooth_overlay_color(s, d),
        };
        Some(value.extend(texel.w))
    }

    /// The layers over each other, over what asks for nothing.
    fn layered(
        &self,
        map: DetailMap,
        place: &BoundTexture,
        neutral: Vec3,
        point: &SurfacePoint,
        filtering: TextureFiltering,
    ) -> Vec3 {
        let uv = place.uv(point.uv);
        let (dx, dy) = (place.uv_change(point.uv_dx), place.uv_change(point.uv_dy));
        let mut d = neutral;
        for (layer, said) in self.layers.iter().zip(&self.detail.layers) {
            let Some(tile) = layer.tiles[map as usize].as_ref().filter(|_| layer.on) else { continue };
            let matrix = layer.matrix * self.tile_scale;
            let at = detail_uv(uv, matrix, said.transform.offset);
            let texel = match filtering.max_anisotropy() {
                None => tile.sample_level(at, 0),
                Some(most) => tile.sample_grad(at, matrix * dx, matrix * dy, most),
            };
            let mirror = if said.transform.mirror { detail_mirror(at) } else { Vec2::ONE };
            let value = match map {
                DetailMap::BaseColor => hsv_shift(texel.xyz(), said.hsv),
                DetailMap::Data => texel.xyz(),
                DetailMap::Normal => {
                    let n = normal_from_xy(texel.x * 2.0 - 1.0, texel.y * 2.0 - 1.0);
                    detail_turn_normal(n, layer.rotation, mirror)
                }
                DetailMap::Aniso => detail_turn_aniso(texel.xyz(), layer.rotation, mirror),
            };
            let alpha = match (&layer.mask, &said.mask) {
                (Some(mask), Some(said)) => {
                    // Masks lie where the synthesized map of the same kind lies.
                    let mask = BoundTexture { texture: mask.texture.clone(), ..place.clone() };
                    detail_mask(sample_bound(&mask, point, filtering)[said.channel], said.contrast)
                }
                _ => 1.0,
            };
            d = d.lerp(value, alpha * said.opacity);
        }
        if map == DetailMap::Normal { d.normalize_or(Vec3::Z) } else { d }
    }
}

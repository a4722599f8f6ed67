//! The uniform and textures of maps that are blended from tiles.

use std::sync::Arc;

use encase::ShaderType;
use glam::{Mat2, Vec2};
use kinran_scene::{DETAIL_LAYERS_MAX, DetailMap, Wrap};

use super::layouts::{DETAIL_SAMPLERS, DETAIL_TEXTURES};
use super::uniform::{Vec4f, Vec4u, transforms};
use crate::reference::{BoundTexture, DetailShown, MipTexture, RenderDetail};

/// The textures, `white` where there is none.
pub(super) fn textures<'a>(
    detail: &'a RenderDetail,
    white: &'a Arc<MipTexture>,
) -> [&'a Arc<MipTexture>; DETAIL_TEXTURES] {
    let map = |slot: &'a Option<BoundTexture>| slot.as_ref().map_or(white, |bound| &bound.texture);
    std::array::from_fn(|i| match i {
        0..4 => map(&detail.maps[i]),
        4..16 => {
            detail.layers.get((i - 4) / 4).and_then(|layer| layer.tiles[i % 4].as_ref()).unwrap_or(white)
        }
        _ => detail.layers.get(i - 15).map_or(white, |layer| map(&layer.mask)),
    })
}

/// How the maps and each layer repeat.
pub(super) fn wraps(detail: &RenderDetail) -> [Wrap; DETAIL_SAMPLERS] {
    std::array::from_fn(|i| {
        let layer = i.checked_sub(1).and_then(|i| detail.detail.layers.get(i));
        if layer.is_some_and(|layer| layer.transform.mirror) { Wrap::Mirror } else { Wrap::Repeat }
    })
}

/// Whether the G-buffer cannot hold what is blended.
pub(super) fn is_forward(detail: &Option<RenderDetail>) -> bool {
    detail.as_ref().is_some_and(|detail| detail.maps[DetailMap::Aniso as usize].is_some())
}

#[derive(Clone, Copy, Default, ShaderType)]
pub(super) struct DetailLayer {
    matrix: Vec4f,
    place: Vec4f,
    hsv: Vec4f,
    mask: Vec4f,
    tiles: Vec4f,
}

#[derive(ShaderType)]
pub(super) struct DetailMaterial {
    flags: Vec4u,
    maps: Vec4u,
    channels: Vec4u,
    factors: Vec4f,
    transforms: [Vec4f; 8],
    layers: [DetailLayer; DETAIL_LAYERS_MAX],
}

/// The uniform that detail.wgsl declares.
pub(super) fn uniform(detail: &RenderDetail) -> DetailMaterial {
    let shown = match detail.shown {
        DetailShown::Blended => 0,
        DetailShown::Detail => 1,
        DetailShown::Synthesized => 2,
        DetailShown::Target => 3,
    };
    let channel = |i: usize| detail.detail.channels[i].map_or(3, |c| c as u32);
    let nowhere = BoundTexture::constant([1.0; 4]);
    let maps = detail.maps.each_ref().map(|map| map.as_ref().unwrap_or(&nowhere));
    DetailMaterial {
        flags: [shown, u32::from(detail.detail.plain_overlay), 0, 0].into(),
        maps: detail.maps.each_ref().map(|map| u32::from(map.is_some())).into(),
        channels: [channel(0), channel(1), channel(2), 3].into(),
        factors: [detail.detail.aniso_alpha, 0.0, 0.0, 0.0].into(),
        transforms: transforms(&maps),
        layers: std::array::from_fn(|i| layer(detail, i).unwrap_or_default()),
    }
}

fn layer(detail: &RenderDetail, i: usize) -> Option<DetailLayer> {
    let (layer, said) = (detail.layers.get(i)?, detail.detail.layers.get(i)?);
    let (matrix, rotation): (Mat2, Vec2) = detail.place(i);
    let is = |b: bool| f32::from(u8::from(b));
    let (channel, contrast) = said.mask.as_ref().map_or((0, 1.0), |mask| (mask.channel, mask.contrast));
    let offset = said.transform.offset;
    Some(DetailLayer {
        matrix: matrix.to_cols_array().into(),
        place: [offset.x, offset.y, rotation.x, rotation.y].into(),
        hsv: said.hsv.extend(is(said.transform.mirror)).into(),
        mask: [channel as f32, contrast, is(layer.mask.is_some()), said.opacity].into(),
        tiles: layer.tiles.each_ref().map(|tile| is(tile.is_some() && layer.on)).into(),
    })
}

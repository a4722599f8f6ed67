//! The uniform and textures of maps that are blended from tiles.

use std::sync::Arc;

use glam::{Mat2, Mat3, Vec2};
use kinran_scene::{DETAIL_LAYERS_MAX, DetailMap, Wrap};

use crate::reference::{BoundTexture, DetailShown, MipTexture, RenderDetail};

/// Textures that detail.wgsl declares: four synthesized maps, four tiles a layer, two masks.
pub(super) const TEXTURES: usize = 4 + 4 * DETAIL_LAYERS_MAX + 2;

/// Samplers that it declares: of maps and masks, and of each layer.
pub(super) const SAMPLERS: usize = 1 + DETAIL_LAYERS_MAX;

/// The textures, `white` where there is none.
pub(super) fn textures<'a>(
    detail: &'a RenderDetail,
    white: &'a Arc<MipTexture>,
) -> [&'a Arc<MipTexture>; TEXTURES] {
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
pub(super) fn wraps(detail: &RenderDetail) -> [Wrap; SAMPLERS] {
    std::array::from_fn(|i| {
        let layer = i.checked_sub(1).and_then(|i| detail.detail.layers.get(i));
        if layer.is_some_and(|layer| layer.transform.mirror) { Wrap::Mirror } else { Wrap::Repeat }
    })
}

/// Whether the G-buffer cannot hold what is blended.
pub(super) fn is_forward(detail: &Option<RenderDetail>) -> bool {
    detail.as_ref().is_some_and(|detail| detail.maps[DetailMap::Aniso as usize].is_some())
}

/// The uniform that detail.wgsl declares.
pub(super) fn floats(detail: &RenderDetail) -> Vec<f32> {
    let shown = match detail.shown {
        DetailShown::Blended => 0,
        DetailShown::Detail => 1,
        DetailShown::Synthesized => 2,
        DetailShown::Target => 3,
    };
    let channel = |i: usize| detail.detail.channels[i].map_or(3, |c| c as u32);
    let flags = [shown, u32::from(detail.detail.plain_overlay), 0, 0];
    let maps = detail.maps.each_ref().map(|map| u32::from(map.is_some()));
    let channels = [channel(0), channel(1), channel(2), 3];
    let mut floats: Vec<f32> =
        [flags, maps, channels].as_flattened().iter().map(|&x| f32::from_bits(x)).collect();
    floats.extend([detail.detail.aniso_alpha, 0.0, 0.0, 0.0]);
    let nowhere = BoundTexture::constant([1.0; 4]);
    for map in &detail.maps {
        let map = map.as_ref().unwrap_or(&nowhere);
        let Mat3 { x_axis, y_axis, z_axis } = map.transform;
        floats.extend([x_axis.x, y_axis.x, z_axis.x, map.uv_set as f32]);
        floats.extend([x_axis.y, y_axis.y, z_axis.y, 0.0]);
    }
    for i in 0..DETAIL_LAYERS_MAX {
        let (Some(layer), Some(said)) = (detail.layers.get(i), detail.detail.layers.get(i)) else {
            floats.extend([0.0; 20]);
            continue;
        };
        let (matrix, rotation): (Mat2, Vec2) = detail.place(i);
        let is = |b: bool| f32::from(u8::from(b));
        floats.extend(matrix.to_cols_array());
        floats.extend(said.transform.offset.to_array());
        floats.extend(rotation.to_array());
        floats.extend(said.hsv.extend(is(said.transform.mirror)).to_array());
        let (channel, contrast) = said.mask.as_ref().map_or((0, 1.0), |mask| (mask.channel, mask.contrast));
        floats.extend([channel as f32, contrast, is(layer.mask.is_some()), said.opacity]);
        floats.extend(layer.tiles.each_ref().map(|tile| is(tile.is_some() && layer.on)));
    }
    floats
}

//! Reading `KINRAN_materials_detail`.

use glam::{Vec2, vec3};
use serde::Deserialize;

use super::Loader;
use crate::detail::{CHANNEL_PROPERTIES, CHANNELS};
use crate::json;
use crate::{
    DETAIL_EXTENSION, DETAIL_LAYERS_MAX, Detail, DetailLayer, DetailMap, DetailMask, Error, LayerTransform,
    TextureRef, Wrap,
};

/// The extension as JSON.
#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
struct DetailJson {
    blend: Option<String>,
    base_color_texture: Option<json::TextureInfo>,
    normal_texture: Option<json::TextureInfo>,
    data_texture: Option<json::TextureInfo>,
    aniso_texture: Option<json::TextureInfo>,
    occlusion_channel: Option<String>,
    roughness_channel: Option<String>,
    metallic_channel: Option<String>,
    aniso_alpha: Option<f32>,
    layers: Vec<LayerJson>,
    #[serde(rename = "extensions")]
    _extensions: serde::de::IgnoredAny,
    #[serde(rename = "extras")]
    _extras: serde::de::IgnoredAny,
}

#[derive(Deserialize, Default)]
#[serde(rename_all = "camelCase", default, deny_unknown_fields)]
struct LayerJson {
    scale: Option<[f32; 2]>,
    rotation: f32,
    offset: [f32; 2],
    mirror: bool,
    hue: f32,
    saturation: Option<f32>,
    value: Option<f32>,
    opacity: Option<f32>,
    mask_texture: Option<json::TextureInfo>,
    mask_channel: Option<String>,
    mask_contrast: Option<f32>,
    base_color_texture: Option<json::TextureInfo>,
    normal_texture: Option<json::TextureInfo>,
    data_texture: Option<json::TextureInfo>,
    aniso_texture: Option<json::TextureInfo>,
    #[serde(rename = "extensions")]
    _extensions: serde::de::IgnoredAny,
    #[serde(rename = "extras")]
    _extras: serde::de::IgnoredAny,
}

impl Loader<'_> {
    /// `KINRAN_materials_detail`.
    pub(super) fn detail(
        &mut self,
        extensions: &json::Extensions,
        what: &str,
    ) -> Result<Option<Detail>, Error> {
        let Some(detail) = self.extension::<DetailJson>(extensions, DETAIL_EXTENSION, what)? else {
            return Ok(None);
        };
        let what = format!("{what}: {DETAIL_EXTENSION}");
        let plain_overlay =
            self.named(&detail.blend, &[("smooth", false), ("plain", true)], &what, "blend")?;
        let maps = self.detail_maps(
            [&detail.base_color_texture, &detail.normal_texture, &detail.data_texture, &detail.aniso_texture],
            Wrap::Repeat,
            &what,
        )?;
        if maps.iter().all(Option::is_none) {
            return Err(self.error(format!(
                "{what}: there is no synthesized map; give one of {}",
                DetailMap::ALL.map(DetailMap::property).join(", ")
            )));
        }
        let mut channels = [None; 3];
        let named = [&detail.occlusion_channel, &detail.roughness_channel, &detail.metallic_channel];
        for (i, (name, property)) in named.into_iter().zip(CHANNEL_PROPERTIES).enumerate() {
            let known = [("none", None)]
                .into_iter()
                .chain(CHANNELS[..3].iter().map(|&(name, c)| (name, Some(c))))
                .collect::<Vec<_>>();
            channels[i] = match name {
                None => Some(i),
                Some(_) => self.named(name, &known, &what, property)?,
            };
        }
        let aniso_alpha = self.within(detail.aniso_alpha.unwrap_or(0.5), 0.0..=1.0, &what, "anisoAlpha")?;
        if detail.layers.is_empty() || detail.layers.len() > DETAIL_LAYERS_MAX {
            return Err(self.error(format!(
                "{what}: layers has {} entries; there must be 1 to {DETAIL_LAYERS_MAX}",
                detail.layers.len()
            )));
        }
        let layers = detail.layers.iter().enumerate();
        let layers = layers.map(|(i, layer)| self.detail_layer(layer, i, &format!("{what}: layers[{i}]")));
        Ok(Some(Detail {
            plain_overlay,
            maps,
            channels,
            aniso_alpha,
            layers: layers.collect::<Result<_, _>>()?,
        }))
    }

    fn detail_maps(
        &mut self,
        infos: [&Option<json::TextureInfo>; 4],
        wrap: Wrap,
        what: &str,
    ) -> Result<[Option<TextureRef>; 4], Error> {
        let mut maps = [const { None }; 4];
        for ((map, info), name) in maps.iter_mut().zip(infos).zip(DetailMap::ALL) {
            let place = self.texture(info, &format!("{what}: {}", name.property()))?;
            *map = place.map(|place| TextureRef { wrap: [wrap; 2], ..place });
        }
        Ok(maps)
    }

    fn detail_layer(&mut self, layer: &LayerJson, index: usize, what: &str) -> Result<DetailLayer, Error> {
        let scale = self.finite(layer.scale.unwrap_or([1.0; 2]), &format!("{what}: scale"))?;
        if scale.contains(&0.0) {
            return Err(self.error(format!("{what}: scale is {scale:?}; neither may be zero")));
        }
        let [rotation] = self.finite([layer.rotation], &format!("{what}: rotation"))?;
        let offset = self.finite(layer.offset, &format!("{what}: offset"))?;
        let [hue] = self.finite([layer.hue], &format!("{what}: hue"))?;
        let saturation = self.within(layer.saturation.unwrap_or(1.0), 0.0..=f32::MAX, what, "saturation")?;
        let value = self.within(layer.value.unwrap_or(1.0), 0.0..=f32::MAX, what, "value")?;
        let opacity = self.within(layer.opacity.unwrap_or(1.0), 0.0..=1.0, what, "opacity")?;
        let mask = self.texture(&layer.mask_texture, &format!("{what}: maskTexture"))?;
        match (&mask, index) {
            (Some(_), 0) => {
                return Err(
                    self.error(format!("{what}: the bottom layer takes no maskTexture; leave it out"))
                );
            }
            (None, 1..) => {
                return Err(self.error(format!(
                    "{what}: there is no maskTexture, and the layer would hide those below; give it one"
                )));
            }
            _ => {}
        }
        let contrast =
            self.within(layer.mask_contrast.unwrap_or(1.0), 0.0..=f32::MAX, what, "maskContrast")?;
        let channel = self.named(&layer.mask_channel, &CHANNELS, what, "maskChannel")?;
        let wrap = if layer.mirror { Wrap::Mirror } else { Wrap::Repeat };
        Ok(DetailLayer {
            transform: LayerTransform {
                scale: Vec2::from(scale),
                rotation,
                offset: Vec2::from(offset),
                mirror: layer.mirror,
            },
            hsv: vec3(hue, saturation, value),
            mask: mask.map(|texture| DetailMask {
                texture: TextureRef { wrap: [Wrap::Repeat; 2], ..texture },
                channel,
                contrast,
            }),
            opacity,
            tiles: self.detail_maps(
                [&layer.base_color_texture, &layer.normal_texture, &layer.data_texture, &layer.aniso_texture],
                wrap,
                what,
            )?,
        })
    }
}

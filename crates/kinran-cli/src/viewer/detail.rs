//! Switches of maps that are blended from tiles.

use eframe::egui::{Slider, Ui};
use kinran_render::reference::{DetailShown, RenderDetail};
use serde::{Deserialize, Serialize};

/// Names and meanings of what can be shown.
const SHOWN: [(&str, DetailShown); 4] = [
    ("only detail", DetailShown::Detail),
    ("synthesized", DetailShown::Synthesized),
    ("blended", DetailShown::Blended),
    ("target", DetailShown::Target),
];

/// Detail as the controls have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DetailParameters {
    /// Index into [`SHOWN`].
    shown: usize,
    /// Multiplies the scale of all layers.
    tile_scale: f32,
    /// Which layers are seen.
    layers: Vec<bool>,
}

impl From<&RenderDetail> for DetailParameters {
    fn from(detail: &RenderDetail) -> Self {
        Self {
            shown: SHOWN.iter().position(|(_, shown)| *shown == detail.shown).unwrap_or(0),
            tile_scale: detail.tile_scale,
            layers: detail.layers.iter().map(|layer| layer.on).collect(),
        }
    }
}

impl DetailParameters {
    pub(super) fn apply(&self, detail: &mut RenderDetail) {
        detail.shown = SHOWN[self.shown.min(SHOWN.len() - 1)].1;
        detail.tile_scale = self.tile_scale;
        for (layer, on) in detail.layers.iter_mut().zip(&self.layers) {
            layer.on = *on;
        }
    }

    pub(super) fn controls(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.label("detail");
            for (i, (name, _)) in SHOWN.iter().enumerate() {
                ui.selectable_value(&mut self.shown, i, *name);
            }
        });
        ui.add(Slider::new(&mut self.tile_scale, 0.125..=8.0).logarithmic(true).text("tile scale, ×"));
        ui.horizontal(|ui| {
            for (i, on) in self.layers.iter_mut().enumerate() {
                ui.checkbox(on, format!("layer {}", i + 1));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_switched_is_what_is_drawn() {
        let json = r#"{"asset":{"version":"2.0"},"materials":[{"extensions":{"KINRAN_materials_detail":{
            "baseColorTexture":{"index":0},"layers":[{"baseColorTexture":{"index":0}},
            {"baseColorTexture":{"index":0},"maskTexture":{"index":0}}]}}}],
            "textures":[{"source":0}],"images":[{"uri":"a.png"}]}"#;
        let image = kinran_image::Image::new(
            1,
            1,
            kinran_image::Channels::Rgb,
            kinran_image::Pixels::U8(vec![9, 9, 9]),
        );
        let png = kinran_image::encode_png(&image.unwrap()).unwrap();
        let scene = kinran_scene::Scene::from_bytes("a.gltf".as_ref(), json.as_bytes(), &|_| Ok(png.clone()))
            .unwrap();
        let prepared = kinran_render::reference::RenderScene::new(&scene, vec![None], None).unwrap();
        let mut detail = prepared.materials[0].detail.clone().unwrap();
        let authored = DetailParameters::from(&detail);
        assert_eq!((SHOWN[authored.shown].0, authored.layers.len()), ("blended", 2));
        let turned = DetailParameters { shown: 1, tile_scale: 3.0, layers: vec![false, true] };
        turned.apply(&mut detail);
        assert_eq!(detail.shown, DetailShown::Synthesized);
        assert_eq!((detail.tile_scale, detail.layers[0].on, detail.layers[1].on), (3.0, false, true));
        assert_eq!(DetailParameters::from(&detail), turned);
    }
}

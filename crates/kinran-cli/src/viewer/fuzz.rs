//! Sliders of a material's fuzz.

use eframe::egui::{self, Slider, Ui};
use glam::Vec3;
use kinran_render::reference::RenderFuzz;
use kinran_scene::{Fuzz, FuzzAttenuation, FuzzLayer, FuzzPhase};
use serde::{Deserialize, Serialize};

use crate::Progress;
use crate::surfaces::fuzz_fits;

/// What [`FuzzParameters::kind`] counts.
const KINDS: [&str; 3] = ["none", "layer", "simple"];

/// Fuzz as the sliders have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct FuzzParameters {
    /// Index into [`KINDS`].
    kind: usize,
    velvet: bool,
    density: f32,
    spread: f32,
    /// Degrees.
    tilt: f32,
    /// Degrees.
    azimuth: f32,
    color: [f32; 3],
    normal_smoothness: f32,
    /// Index into [`FuzzAttenuation::NAMES`].
    attenuation: usize,
    fuzziness: f32,
    talk_ambient: bool,
}

impl Default for FuzzParameters {
    fn default() -> Self {
        Self::from(&None)
    }
}

impl From<&Option<RenderFuzz>> for FuzzParameters {
    fn from(fuzz: &Option<RenderFuzz>) -> Self {
        let (kind, layer, fuzziness) = match fuzz.as_ref().map(|f| &f.fuzz) {
            None => (0, FuzzLayer::default(), 0.5),
            Some(Fuzz::Layer(layer)) => (1, layer.clone(), 0.5),
            Some(Fuzz::Simple { fuzziness, .. }) => (2, FuzzLayer::default(), *fuzziness),
        };
        let attenuation = FuzzAttenuation::NAMES.iter().position(|(_, a)| *a == layer.attenuation);
        Self {
            kind,
            velvet: layer.phase == FuzzPhase::Velvet,
            density: layer.density,
            spread: layer.spread,
            tilt: layer.tilt.to_degrees(),
            azimuth: layer.azimuth.to_degrees(),
            color: layer.color.to_array(),
            normal_smoothness: layer.normal_smoothness,
            attenuation: attenuation.unwrap_or(0),
            fuzziness,
            talk_ambient: fuzz.as_ref().is_some_and(|f| f.talk_ambient),
        }
    }
}

impl FuzzParameters {
    /// What is drawn, with the textures of `loaded`.
    pub(super) fn fuzz(&self, loaded: &Option<RenderFuzz>) -> Option<RenderFuzz> {
        let phase = if self.velvet { FuzzPhase::Velvet } else { FuzzPhase::Fibre };
        let fuzz = match self.kind {
            1 => Fuzz::Layer(FuzzLayer {
                phase,
                density: self.density,
                spread: self.spread,
                tilt: self.tilt.to_radians(),
                azimuth: self.azimuth.to_radians(),
                color: Vec3::from(self.color),
                normal_smoothness: self.normal_smoothness,
                attenuation: FuzzAttenuation::NAMES
                    .get(self.attenuation)
                    .map_or_else(Default::default, |n| n.1),
                ..FuzzLayer::default()
            }),
            2 => Fuzz::Simple { fuzziness: self.fuzziness, texture: None },
            _ => return None,
        };
        // Nobody stops it.
        let fits = (self.kind == 1).then(|| fuzz_fits(phase, self.spread, &Progress::default()));
        let fits = fits.and_then(Result::ok);
        let texture = |of: fn(&RenderFuzz) -> &Option<kinran_render::reference::BoundTexture>| {
            loaded.as_ref().and_then(|loaded| of(loaded).clone())
        };
        Some(RenderFuzz {
            fuzz,
            direction: texture(|f| &f.direction),
            color: texture(|f| &f.color),
            amount: texture(|f| &f.amount),
            fits,
            talk_ambient: self.talk_ambient,
        })
    }

    pub(super) fn sliders(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            ui.label("fuzz");
            for (i, name) in KINDS.iter().enumerate() {
                ui.selectable_value(&mut self.kind, i, *name);
            }
        });
        if self.kind == 2 {
            ui.add(Slider::new(&mut self.fuzziness, 0.0..=1.0).text("fuzziness"));
        }
        if self.kind != 1 {
            return;
        }
        ui.add(Slider::new(&mut self.density, 0.0..=1.0).text("density"));
        ui.add(Slider::new(&mut self.spread, 0.0..=1.0).text("spread"));
        ui.add(Slider::new(&mut self.tilt, 0.0..=90.0).text("tilt").suffix("°"));
        ui.add(Slider::new(&mut self.azimuth, -180.0..=180.0).text("azimuth").suffix("°"));
        ui.horizontal(|ui| {
            ui.color_edit_button_rgb(&mut self.color);
            ui.label("fibre albedo (linear)");
        });
        ui.add(Slider::new(&mut self.normal_smoothness, 0.0..=1.0).text("normal smoothness"));
        let name = FuzzAttenuation::NAMES.get(self.attenuation).map_or("", |n| n.0);
        egui::ComboBox::from_label("base attenuation").selected_text(name).show_ui(ui, |ui| {
            for (i, (name, _)) in FuzzAttenuation::NAMES.iter().enumerate() {
                ui.selectable_value(&mut self.attenuation, i, *name);
            }
        });
        ui.horizontal(|ui| {
            ui.checkbox(&mut self.velvet, "velvet phase");
            ui.checkbox(&mut self.talk_ambient, "the talk's ambient light");
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sliders_that_nobody_moved_draw_what_was_loaded() {
        let layer =
            FuzzLayer { density: 0.4, tilt: 0.5, attenuation: FuzzAttenuation::None, ..FuzzLayer::default() };
        for fuzz in [Fuzz::Layer(layer), Fuzz::Simple { fuzziness: 0.25, texture: None }] {
            let loaded = Some(RenderFuzz {
                fuzz: fuzz.clone(),
                direction: None,
                color: None,
                amount: None,
                fits: None,
                talk_ambient: true,
            });
            let drawn = FuzzParameters::from(&loaded).fuzz(&loaded).unwrap();
            match (&drawn.fuzz, &fuzz) {
                (Fuzz::Layer(got), Fuzz::Layer(want)) => {
                    assert!((got.tilt - want.tilt).abs() < 1e-6 && got.density == want.density);
                    assert!(got.attenuation == want.attenuation && drawn.fits.is_some());
                }
                (got, want) => assert_eq!(got, want),
            }
            assert!(drawn.talk_ambient);
        }
        assert!(FuzzParameters::from(&None).fuzz(&None).is_none());
    }
}

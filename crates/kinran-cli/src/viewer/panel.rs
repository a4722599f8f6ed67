//! The controls at the side of the window.

use std::time::Duration;

use eframe::egui::{self, Slider, Ui};
use kinran_scene::{AlphaMode, Light, LightKind};

use kinran_shading::skin::lighting::SKIN_NORMAL_BLUR;

use super::parameters::{CHANNELS, CURVATURES, METHODS, Parameters};
use crate::surfaces::Mips;

/// What a control asks for beyond a changed parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Wishes {
    pub(super) frame_model: bool,
    pub(super) save_picture: bool,
    pub(super) save_parameters: bool,
    pub(super) reset_material: bool,
    /// The environment or its rotation was changed for good: not while a slider moves.
    pub(super) light: bool,
}

/// What the panel has to know of the model.
pub(super) struct Shown<'a> {
    pub(super) name: &'a str,
    pub(super) material_names: &'a [String],
    /// Whether each material has baked normals and roughness.
    pub(super) mapped: &'a [bool],
    /// What alpha does in each material.
    pub(super) alpha_modes: &'a [AlphaMode],
    /// The file's lights.
    pub(super) lights: &'a [Light],
    /// Methods that are baked.
    pub(super) baked: &'a [Mips],
    pub(super) frames: u32,
    pub(super) frames_wanted: u32,
    pub(super) first_picture: Option<Duration>,
}

/// The method of one side, and its switch where that changes anything.
fn method(ui: &mut Ui, label: &str, p: &mut Parameters, side: usize, baked: &[Mips]) {
    let (chosen, correlated) = (&mut p.methods[side], &mut p.correlated[side]);
    ui.horizontal(|ui| {
        egui::ComboBox::from_label(label).selected_text(METHODS[*chosen].0).show_ui(ui, |ui| {
            for (i, (name, mips)) in METHODS.iter().enumerate() {
                let is_baked = baked.contains(&mips.correlated(*correlated));
                let note = if is_baked { "" } else { "  (not baked yet)" };
                ui.selectable_value(chosen, i, format!("{name}{note}"));
            }
        });
        let mips = METHODS[*chosen].1;
        ui.add_enabled_ui(mips.correlated(false) != mips, |ui| {
            ui.checkbox(correlated, "with colour")
                .on_hover_text("filters colour, metalness and lobe together; off: each by itself");
        });
    });
}

/// Draws all controls; `selected` is the material whose sliders are shown.
pub(super) fn panel(ui: &mut Ui, p: &mut Parameters, selected: &mut usize, shown: &Shown) -> Wishes {
    let mut wishes = Wishes::default();
    ui.heading(std::path::Path::new(shown.name).file_name().unwrap_or_default().to_string_lossy());
    let opened = shown
        .first_picture
        .map_or_else(String::new, |time| format!(", the first {:.1} s after reading", time.as_secs_f32()));
    ui.weak(format!("{} of {} frames{opened}", shown.frames, shown.frames_wanted));
    ui.horizontal(|ui| {
        wishes.frame_model = ui.button("Frame").on_hover_text("F").clicked();
        wishes.save_picture = ui.button("Save picture").on_hover_text("P").clicked();
        wishes.save_parameters = ui.button("Save parameters").on_hover_text("Ctrl+S").clicked();
    });

    egui::CollapsingHeader::new("Compare").default_open(true).show(ui, |ui| {
        ui.checkbox(&mut p.split, "split line").on_hover_text("C; drag the line");
        method(ui, if p.split { "left" } else { "filter" }, p, 0, shown.baked);
        if p.split {
            method(ui, "right", p, 1, shown.baked);
        }
        ui.horizontal_wrapped(|ui| {
            for (i, (name, _)) in CHANNELS.iter().enumerate() {
                ui.selectable_value(&mut p.channel, i, *name).on_hover_text(format!("{}", i + 1));
            }
        });
        ui.checkbox(&mut p.all_deferred, "deferred, isotropic")
            .on_hover_text("every material through the G-buffer");
    });

    egui::CollapsingHeader::new("Display").default_open(true).show(ui, |ui| {
        ui.add(Slider::new(&mut p.exposure, -8.0..=8.0).text("exposure").suffix(" EV"));
        ui.horizontal(|ui| {
            for (name, label) in [("aces", "ACES"), ("agx", "AgX"), ("none", "none")] {
                ui.selectable_value(&mut p.tonemap, name.to_owned(), label);
            }
            ui.label("tone curve");
        });
        if let Some(orbit) = &mut p.orbit {
            let mut degrees = orbit.yfov.to_degrees();
            if ui.add(Slider::new(&mut degrees, 5.0..=120.0).text("field of view").suffix("°")).changed() {
                // The model keeps its size.
                let before = (0.5 * orbit.yfov).tan();
                orbit.yfov = degrees.to_radians();
                orbit.distance *= before / (0.5 * orbit.yfov).tan();
            }
        }
    });

    egui::CollapsingHeader::new("Light").default_open(true).show(ui, |ui| {
        ui.horizontal(|ui| {
            let typed = ui.add(egui::TextEdit::singleline(&mut p.environment).desired_width(150.0));
            wishes.light |= typed.lost_focus();
            for name in ["studio", "none"] {
                if ui.button(name).clicked() {
                    p.environment = name.to_owned();
                    wishes.light = true;
                }
            }
        });
        ui.weak("environment: a .hdr or .exr file, studio or none");
        let turned =
            ui.add(Slider::new(&mut p.environment_rotation, -180.0..=180.0).text("rotation").suffix("°"));
        wishes.light |= turned.drag_stopped() || turned.lost_focus();
        ui.checkbox(&mut p.background, "environment behind the model");
        if !shown.lights.is_empty() {
            ui.checkbox(&mut p.own_lights, "the file's lights");
            ui.add_enabled_ui(p.own_lights, |ui| {
                for (i, (light, intensity)) in shown.lights.iter().zip(&mut p.intensities).enumerate() {
                    let (kind, unit) = match light.kind {
                        LightKind::Directional => ("directional", " lx"),
                        LightKind::Point => ("point", " cd"),
                        LightKind::Spot { .. } => ("spot", " cd"),
                    };
                    let most = (10.0 * light.color.max_element()).max(1.0);
                    let slider = Slider::new(intensity, 0.0..=most).logarithmic(true).suffix(unit);
                    ui.add(slider.text(format!("{i}: {kind}")));
                }
            });
        }
        ui.checkbox(&mut p.sun.on, "directional light");
        ui.add_enabled_ui(p.sun.on, |ui| {
            ui.add(Slider::new(&mut p.sun.azimuth, -180.0..=180.0).text("azimuth").suffix("°"));
            ui.add(Slider::new(&mut p.sun.elevation, -90.0..=90.0).text("elevation").suffix("°"));
            ui.add(
                Slider::new(&mut p.sun.lux, 0.0..=100.0).text("illuminance").suffix(" lx").logarithmic(true),
            );
        });
        ui.checkbox(&mut p.shadows, "shadows of the first directional light");
    });

    egui::CollapsingHeader::new("Material").default_open(true).show(ui, |ui| {
        if p.materials.is_empty() {
            ui.weak("no model");
            return;
        }
        *selected = (*selected).min(p.materials.len() - 1);
        let name = |i: usize| match shown.material_names.get(i) {
            Some(name) if !name.is_empty() => format!("{i}: {name}"),
            _ => format!("{i}"),
        };
        egui::ComboBox::from_id_salt("material").selected_text(name(*selected)).show_ui(ui, |ui| {
            for i in 0..p.materials.len() {
                ui.selectable_value(selected, i, name(i));
            }
        });
        let mapped = shown.mapped.get(*selected).copied().unwrap_or(false);
        let m = &mut p.materials[*selected];
        ui.horizontal(|ui| {
            ui.color_edit_button_rgb(&mut m.base_color);
            ui.label("base colour (linear, multiplies the map)");
        });
        ui.add(Slider::new(&mut m.metallic, 0.0..=1.0).text("metallic"));
        let (range, text) =
            if mapped { (0.0..=4.0, "roughness, × the map") } else { (0.0..=1.0, "perceptual roughness") };
        ui.add(Slider::new(&mut m.roughness, range).text(text));
        ui.add(Slider::new(&mut m.anisotropy, 0.0..=3.0).text("anisotropy, exponent of αt/αb"));
        ui.add(Slider::new(&mut m.rotation, -90.0..=90.0).text("rotation").suffix("°"));
        ui.add(Slider::new(&mut m.normal_scale, 0.0..=4.0).text("normal scale, ×"));
        ui.add(Slider::new(&mut m.occlusion, 0.0..=1.0).text("occlusion strength"));
        match shown.alpha_modes.get(*selected) {
            Some(AlphaMode::Mask { .. }) => {
                ui.add(Slider::new(&mut m.opacity, 0.0..=1.0).text("alpha, × the map"));
                ui.add(Slider::new(&mut m.alpha_cutoff, 0.0..=1.0).text("alpha cutoff"));
            }
            Some(AlphaMode::Blend) => {
                ui.add(Slider::new(&mut m.opacity, 0.0..=1.0).text("opacity, × the map"));
            }
            _ => {}
        }
        if let Some(detail) = &mut m.detail {
            detail.controls(ui);
        }
        m.fuzz.sliders(ui);
        ui.horizontal(|ui| {
            ui.color_edit_button_rgb(&mut m.emissive);
            ui.add(Slider::new(&mut m.emission, 0.0..=100.0).logarithmic(true).text("emitted radiance"));
        });
        ui.horizontal(|ui| {
            ui.color_edit_button_rgb(&mut m.translucent_color);
            ui.add(Slider::new(&mut m.translucency, 0.0..=1.0).text("scattered through"));
        });
        if let Some(skin) = &mut m.skin {
            ui.horizontal(|ui| {
                for (i, (name, _)) in CURVATURES.iter().enumerate() {
                    ui.selectable_value(&mut skin.curvature, i, *name);
                }
                ui.label("curvature");
            });
            for (channel, name) in skin.normal_blur.iter_mut().zip(["red", "green", "blue"]) {
                ui.add(Slider::new(channel, 0.0..=1.0).text(format!("{name} normal, map to mesh")));
            }
            if ui.button("Normals by the profile").clicked() {
                skin.normal_blur = SKIN_NORMAL_BLUR.to_array();
            }
            ui.add(
                Slider::new(&mut skin.penumbra, 0.0..=20.0)
                    .text("penumbra, light scatters in it")
                    .suffix(" mm"),
            );
            ui.add(Slider::new(&mut skin.second_share, 0.0..=1.0).text("second lobe of gloss"));
            ui.add(Slider::new(&mut skin.second_roughness, 0.0..=1.0).text("its roughness"));
        }
        wishes.reset_material = ui.button("As authored").clicked();
    });
    wishes
}

/// Keys and what they do, for the help and nowhere else.
pub(super) const KEYS: [(&str, &str); 14] = [
    ("drag", "turn"),
    ("right drag", "move"),
    ("wheel", "nearer, farther"),
    ("F", "frame the model"),
    ("C", "split line"),
    ("X", "swap both sides of the line"),
    ("1 … 8", "lit, normal, alpha_t, alpha_b, direction, mip level, base colour, curvature"),
    ("+ −", "exposure by a third of a stop"),
    ("P", "save a picture beside the model"),
    ("Ctrl+S", "save all parameters beside the model"),
    ("R", "read the shaders again"),
    ("Esc", "close messages and this help"),
    ("Ctrl+Q", "close the window"),
    ("?", "these keys"),
];

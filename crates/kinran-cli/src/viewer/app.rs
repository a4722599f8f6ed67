//! The window: what happens in a frame.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, RwLock};
use std::time::{Duration, Instant, SystemTime};

use eframe::egui::{self, Color32, Key, Rect, Sense, pos2, vec2};
use glam::Vec3;
use kinran_render::realtime::{Gpu, GpuScene, Realtime, Settings, ShaderSource, Target, left_out};
use kinran_render::reference::{Background, Film};
use kinran_render::tonemap::to_srgb8;
use kinran_scene::Light;

use super::loader::{self, Event, Job, Loader, Opened};
use super::orbit::Orbit;
use super::panel::{KEYS, Shown, Wishes, panel};
use super::parameters::{CHANNELS, METHODS, MaterialParameters, Parameters};
use crate::Error;
use crate::outputs::has_extension;
use crate::render::write_rgb8;
use crate::surfaces::Mips;
use crate::view::{EnvironmentChoice, ViewArgs, file_name};

/// How often the shader folder is looked at.
const SHADER_INTERVAL: Duration = Duration::from_millis(300);

/// How often the progress of a bake is shown.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(200);

/// Points; the longest label fits.
const PANEL_WIDTH: f32 = 370.0;

/// Points from the lower edge to a message: the progress of a bake fits under it.
const MESSAGE_HEIGHT: f32 = 64.0;

/// Radiance behind models; as pictures of `kinran render` have it.
const BACKDROP: Vec3 = Vec3::new(0.085, 0.087, 0.092);

/// What a window starts with.
pub(super) struct Start {
    pub(super) file: Option<PathBuf>,
    pub(super) view: ViewArgs,
    pub(super) parameters: Parameters,
    pub(super) shaders: Option<PathBuf>,
    pub(super) screenshot: Option<PathBuf>,
    /// Frames after which a still picture is smooth.
    pub(super) spp: u32,
}

/// One side of the split line.
struct Side {
    target: Target,
    view: wgpu::TextureView,
    id: egui::TextureId,
    /// What was drawn last.
    mips: Option<Mips>,
}

/// The model that is shown.
struct Model {
    opened: Opened,
    /// As authored, for the sliders' reset.
    authored: Vec<MaterialParameters>,
    scenes: HashMap<Mips, GpuScene>,
    asked: HashSet<Mips>,
    mapped: Vec<bool>,
    /// From the file's being read to the first picture of it.
    first_picture: Option<Duration>,
}

/// The window.
pub(super) struct App {
    gpu: Gpu,
    display: eframe::egui_wgpu::RenderState,
    renderer: Arc<RwLock<Realtime>>,
    loader: Loader,
    args: ViewArgs,
    parameters: Parameters,
    /// What the scenes were last told.
    applied: Option<Parameters>,
    material: usize,
    model: Option<Model>,
    sides: [Option<Side>; 2],
    busy: String,
    message: String,
    shader_error: String,
    shaders: ShaderSource,
    shader_stamp: Option<SystemTime>,
    shader_check: Instant,
    title: String,
    help: bool,
    screenshot: Option<PathBuf>,
    /// The window is open for a screenshot alone.
    posing: bool,
    spp: u32,
    closing: Arc<Mutex<bool>>,
    outcome: Arc<Mutex<Outcome>>,
}

/// What the command has to tell when the window is closed.
#[derive(Default)]
pub(super) struct Outcome {
    /// What went wrong inside.
    pub(super) failure: Option<Error>,
    /// Of the last model, from its being read to its first picture.
    pub(super) first_picture: Option<Duration>,
    /// What the picture that the command line asks for does not show; nothing may lie over the model in it.
    pub(super) warnings: Vec<String>,
}

impl App {
    /// A window on the device that egui draws with.
    pub(super) fn new(
        context: &eframe::CreationContext,
        start: Start,
        outcome: Arc<Mutex<Outcome>>,
    ) -> Result<Self, Error> {
        let display = context.wgpu_render_state.clone();
        let display = display.ok_or_else(|| Error::Usage("the window has no GPU to draw with".into()))?;
        let gpu = Gpu { device: display.device.clone(), queue: display.queue.clone() };
        let shaders = ShaderSource { folder: start.shaders };
        let format = wgpu::TextureFormat::Rgba8Unorm;
        let mut shader_error = String::new();
        // A folder may hold a mistake from the start; the built-in shaders draw until it is mended.
        let renderer = match Realtime::new(&gpu, &shaders, format) {
            Ok(renderer) => renderer,
            Err(error) => {
                shader_error = error.to_string();
                Realtime::new(&gpu, &ShaderSource::default(), format)?
            }
        };
        let renderer = Arc::new(RwLock::new(renderer));
        let wake = context.egui_ctx.clone();
        let loader = Loader::start(renderer.clone(), move || wake.request_repaint());
        if let Some(file) = start.file {
            loader.ask(Job::Open(file, args_with_light(&start.view, &start.parameters)));
        }
        Ok(Self {
            gpu,
            display,
            renderer,
            loader,
            args: start.view,
            parameters: start.parameters,
            applied: None,
            material: 0,
            model: None,
            sides: [None, None],
            busy: String::new(),
            message: String::new(),
            shader_error,
            shader_stamp: newest(&shaders),
            shaders,
            shader_check: Instant::now(),
            title: String::new(),
            help: false,
            posing: start.screenshot.is_some(),
            screenshot: start.screenshot,
            spp: start.spp,
            closing: Arc::default(),
            outcome,
        })
    }

    /// Takes what the loader has.
    fn receive(&mut self) {
        while let Some(event) = self.loader.event() {
            match event {
                Event::Busy(what) => self.busy = what,
                Event::Failed(error) => {
                    self.message = error.to_string();
                    // A picture that cannot be taken any more must not keep a program waiting.
                    if self.screenshot.is_some() {
                        self.outcome.lock().expect("no thread panics").failure = Some(error);
                        *self.closing.lock().expect("no thread panics") = true;
                    }
                }
                Event::Opened(opened) => self.open(*opened),
                Event::LightChanged => {
                    if let Some(model) = &mut self.model {
                        model.asked.clear();
                    }
                }
                Event::Baked(mips, scene) => {
                    if let Some(model) = &mut self.model {
                        model.mapped = scene.scene().materials.iter().map(|m| m.surface.is_some()).collect();
                        model.scenes.insert(mips, *scene);
                        self.applied = None;
                        self.sides.iter_mut().flatten().for_each(|side| side.mips = None);
                    }
                }
            }
        }
    }

    fn open(&mut self, opened: Opened) {
        let authored: Vec<_> = opened.scene.materials.iter().map(MaterialParameters::authored).collect();
        // Saved parameters belong to a model with as many materials.
        let saved = self.parameters.materials.len();
        let strangers = (self.model.is_none() && saved != 0 && saved != authored.len()).then(|| {
            format!("the parameters are of a model with {saved} materials; this one's are as authored")
        });
        if self.model.is_some() || self.parameters.materials.len() != authored.len() {
            self.parameters.materials.clone_from(&authored);
            self.parameters.orbit = None;
            self.parameters.intensities.clear();
            let own = METHODS.iter().position(|(_, mips)| *mips == opened.mips);
            self.parameters.methods[0] = own.unwrap_or_default();
        }
        if self.parameters.intensities.len() != opened.view.lights.len() {
            self.parameters.intensities = opened.view.lights.iter().map(|l| l.color.max_element()).collect();
        }
        // That point lights cast no shadows stands at the switch.
        let mut messages = opened.warnings.clone();
        messages.extend(left_out(&opened.scene, &Settings { shadows: false, ..self.settings() }));
        messages.extend(strangers);
        if self.screenshot.is_some() {
            self.outcome.lock().expect("no thread panics").warnings = messages;
        } else {
            self.message = messages.join("\n");
        }
        self.model = Some(Model {
            first_picture: None,
            mapped: vec![false; authored.len()],
            opened,
            authored,
            scenes: HashMap::new(),
            asked: HashSet::new(),
        });
        self.applied = None;
    }

    /// The methods to show, left and right, and asks for those that are not baked. Something is shown until they are.
    fn methods(&mut self) -> [Option<Mips>; 2] {
        let wanted = self.parameters.mips();
        let Some(model) = &mut self.model else { return [None, None] };
        // Level 0 needs no filter: it is there first, and no bake takes the processor from the first picture.
        let mut ask = vec![Mips::Level0];
        if model.first_picture.is_some() {
            ask.push(wanted[0]);
            if self.parameters.split {
                ask.push(wanted[1]);
            }
        }
        for mips in ask {
            if model.asked.insert(mips) {
                self.loader.ask(Job::Bake(mips));
            }
        }
        let there = |mips| if model.scenes.contains_key(&mips) { Some(mips) } else { None };
        wanted.map(|mips| there(mips).or_else(|| there(Mips::Level0)))
    }

    /// Whether all that was asked for is shown, smoothly.
    fn settled(&self) -> bool {
        let wanted = self.parameters.mips();
        let sides = if self.parameters.split { 2 } else { 1 };
        self.busy.is_empty()
            && self.loader.baking().is_none()
            && (0..sides).all(|i| {
                self.sides[i]
                    .as_ref()
                    .is_some_and(|s| s.mips == Some(wanted[i]) && s.target.frames >= self.spp)
            })
    }

    /// Tells the scenes what changed, and starts the pictures anew.
    fn apply(&mut self) {
        if self.applied.as_ref().is_some_and(|applied| same_picture(applied, &self.parameters)) {
            return;
        }
        let p = &self.parameters;
        if let Some(model) = &mut self.model {
            let mut lights: Vec<Light> = Vec::new();
            if p.sun.on {
                lights.push(p.sun.light());
            }
            if p.own_lights {
                lights.extend(model.opened.view.lights.iter().zip(&p.intensities).map(
                    |(light, &intensity)| {
                        let hue = light.color / light.color.max_element().max(f32::MIN_POSITIVE);
                        Light { color: intensity * hue, ..*light }
                    },
                ));
            }
            for scene in model.scenes.values_mut() {
                scene.set_lights(lights.clone());
                for (i, m) in p.materials.iter().enumerate() {
                    let mut material = scene.scene().materials[i].clone();
                    let mapped = material.surface.is_some();
                    m.apply(&mut material);
                    material.fuzz = m.fuzz.fuzz(&model.opened.scene.materials[i].fuzz);
                    if let (Some(skin), Some(parameters)) = (&mut material.skin, &m.skin) {
                        parameters.apply(skin);
                    }
                    if let (Some(detail), Some(parameters)) = (&mut material.detail, &m.detail) {
                        parameters.apply(detail);
                    }
                    let authored = model.authored[i].roughness.max(1e-3);
                    let relative = MaterialParameters { roughness: m.roughness / authored, ..m.clone() };
                    scene.set_material(&self.gpu, i, &material, relative.adjustment(mapped));
                }
            }
        }
        self.applied = Some(p.clone());
        self.clear();
    }

    fn clear(&mut self) {
        let Ok(renderer) = self.renderer.read() else { return };
        self.sides.iter_mut().flatten().for_each(|side| side.target.clear(&renderer));
    }

    fn settings(&self) -> Settings {
        Settings {
            shadows: self.parameters.shadows,
            reflections: true,
            background: if self.parameters.background {
                Background::Environment { blur: 0.0 }
            } else {
                Background::Color(BACKDROP)
            },
            channel: CHANNELS[self.parameters.channel].1,
            exposure: self.parameters.exposure,
            tonemap: self.parameters.curve(),
            all_deferred: self.parameters.all_deferred,
        }
    }

    /// Draws a frame of one side, unless it has enough of them.
    fn draw(&mut self, index: usize, mips: Option<Mips>, size: (u32, u32)) {
        let settings = self.settings();
        let Ok(renderer) = self.renderer.read() else { return };
        if self.sides[index].as_ref().is_none_or(|side| side.target.size != size) {
            let texture = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture"),
                size: wgpu::Extent3d { width: size.0, height: size.1, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba8Unorm,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            let mut display = self.display.renderer.write();
            if let Some(old) = self.sides[index].take() {
                display.free_texture(&old.id);
            }
            let id = display.register_native_texture(&self.gpu.device, &view, wgpu::FilterMode::Nearest);
            self.sides[index] = Some(Side { target: Target::new(&renderer, size), view, id, mips: None });
        }
        let (Some(side), Some(orbit)) = (&mut self.sides[index], &self.parameters.orbit) else { return };
        let scene = mips.zip(self.model.as_ref()).and_then(|(mips, model)| model.scenes.get(&mips));
        let Some(scene) = scene else { return };
        if side.mips != mips {
            side.target.clear(&renderer);
            side.mips = mips;
        }
        if side.target.frames < self.spp {
            renderer.draw(scene, &orbit.camera(), &settings, &mut side.target);
            renderer.show(&side.target, &side.view, scene);
            if let Some(model) = self.model.as_mut().filter(|model| model.first_picture.is_none()) {
                // Said once the picture is there, not once it is ordered.
                let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
                model.first_picture = Some(model.opened.at.elapsed());
                self.outcome.lock().expect("no thread panics").first_picture = model.first_picture;
            }
        }
    }

    /// Compiles the shaders again when a file in their folder was saved, or when asked to.
    fn reload(&mut self, asked: bool) {
        if !asked && self.shader_check.elapsed() < SHADER_INTERVAL {
            return;
        }
        self.shader_check = Instant::now();
        let stamp = newest(&self.shaders);
        if !asked && stamp == self.shader_stamp {
            return;
        }
        // While the loader works the renderer is its; the next look comes soon.
        let Ok(mut renderer) = self.renderer.try_write() else { return };
        self.shader_stamp = stamp;
        match renderer.reload_shaders(&self.shaders) {
            Ok(()) => self.shader_error.clear(),
            Err(error) => self.shader_error = error.to_string(),
        }
        drop(renderer);
        self.clear();
    }

    fn keys(&mut self, ctx: &egui::Context) -> Wishes {
        let mut wishes = Wishes::default();
        // Letters that are typed into a field are not keys.
        if ctx.egui_wants_keyboard_input() {
            return wishes;
        }
        // Event by event: a slow frame may hold several presses of a key, and the release of the one held with it.
        let presses: Vec<_> = ctx.input(|input| {
            let press = |event: &egui::Event| match *event {
                egui::Event::Key { key, pressed: true, repeat, modifiers, .. } => {
                    Some((key, repeat, modifiers))
                }
                _ => None,
            };
            input.events.iter().filter_map(press).collect()
        });
        let (mut reload, p) = (false, &mut self.parameters);
        for (key, repeat, modifiers) in presses {
            match key {
                // These may be held down.
                Key::Plus | Key::Equals => p.exposure = stepped(p.exposure, 1.0),
                Key::Minus => p.exposure = stepped(p.exposure, -1.0),
                // Its release comes as that of the key without shift, so that its next press is taken for a repetition.
                Key::Questionmark => self.help = !self.help,
                _ if repeat => {}
                Key::S if modifiers.command => wishes.save_parameters = true,
                Key::Q if modifiers.command => ctx.send_viewport_cmd(egui::ViewportCommand::Close),
                _ if modifiers.command => {}
                Key::F => wishes.frame_model = true,
                Key::P => wishes.save_picture = true,
                Key::C => p.split = !p.split,
                Key::X => {
                    p.methods.swap(0, 1);
                    p.correlated.swap(0, 1);
                }
                Key::R => reload = true,
                Key::Escape => {
                    self.help = false;
                    self.message.clear();
                }
                _ => {
                    let digits = [
                        Key::Num1,
                        Key::Num2,
                        Key::Num3,
                        Key::Num4,
                        Key::Num5,
                        Key::Num6,
                        Key::Num7,
                        Key::Num8,
                    ];
                    if let Some(channel) = digits.iter().position(|&digit| digit == key) {
                        p.channel = channel;
                    }
                }
            }
        }
        if reload {
            self.reload(true);
        }
        wishes
    }

    fn grant(&mut self, wishes: Wishes) {
        if let Some(model) = &self.model {
            if wishes.frame_model {
                self.parameters.orbit = None;
            }
            if wishes.reset_material
                && let Some(material) = self.parameters.materials.get_mut(self.material)
            {
                material.clone_from(&model.authored[self.material]);
            }
        }
        if wishes.light {
            match self.parameters.environment.parse() {
                Ok(choice) => {
                    let layer = self.args.layer_of(&choice);
                    self.loader.ask(Job::Light(choice, layer, self.parameters.environment_rotation));
                }
                Err(error) => self.message = format!("environment: {error}"),
            }
        }
        let beside = |extension: &str| {
            let name = self.model.as_ref().map_or("kinran", |model| model.opened.name.as_str());
            Path::new(name).with_extension(extension)
        };
        let saved = if wishes.save_picture {
            let path = beside("view.png");
            Some((self.save_picture(&path), path))
        } else if wishes.save_parameters {
            let path = beside("view.json");
            Some((self.parameters.save(&path), path))
        } else {
            None
        };
        if let Some((result, path)) = saved {
            self.message = match result {
                Ok(()) => format!("saved {}", path.display()),
                Err(error) => error.to_string(),
            };
        }
    }

    /// A model, or an environment, which is seen behind it too.
    fn dropped(&mut self, path: &Path) {
        if ["hdr", "exr"].iter().any(|extension| has_extension(path, extension)) {
            self.parameters.environment = path.to_string_lossy().into_owned();
            self.parameters.background = true;
            self.grant(Wishes { light: true, ..Wishes::default() });
            return;
        }
        self.loader.ask(Job::Open(path.into(), args_with_light(&self.args, &self.parameters)));
    }

    /// The picture without the controls, both sides of the line.
    fn save_picture(&self, path: &Path) -> Result<(), Error> {
        let display = |film: &Film| to_srgb8(&film.pixels, self.parameters.exposure, self.parameters.curve());
        let Some(left) = &self.sides[0] else { return Err(Error::Usage("there is no picture yet".into())) };
        let film = left.target.film(&self.gpu)?;
        let mut pixels = display(&film);
        if let (true, Some(right)) = (self.parameters.split, &self.sides[1]) {
            let right = display(&right.target.film(&self.gpu)?);
            let column = (self.parameters.split_at * film.width as f32) as usize;
            for (row, from) in pixels.chunks_mut(film.width as usize).zip(right.chunks(film.width as usize)) {
                row[column..].copy_from_slice(&from[column..]);
            }
        }
        write_rgb8(path, film.width, film.height, pixels)
    }

    /// The picture, and what a pointer does to it.
    fn picture(&mut self, ui: &mut egui::Ui) {
        let rect = ui.max_rect();
        let scale = ui.ctx().pixels_per_point();
        let limit = self.gpu.device.limits().max_texture_dimension_2d as f32;
        let pixels = |points: f32| (points * scale).round().clamp(1.0, limit) as u32;
        let size = (pixels(rect.width()), pixels(rect.height()));

        let response = ui.allocate_rect(rect, Sense::click_and_drag());
        let line = rect.left() + self.parameters.split_at * rect.width();
        if self.parameters.split {
            let handle = Rect::from_x_y_ranges(line - 6.0..=line + 6.0, rect.y_range());
            let drag = ui.interact(handle, ui.scope_id().with("split"), Sense::drag());
            if drag.hovered() || drag.dragged() {
                ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
            }
            let moved = dragged(ui, &drag, egui::PointerButton::Primary).x;
            self.parameters.split_at = ((line + moved - rect.left()) / rect.width()).clamp(0.0, 1.0);
        }
        // Without an orbit the model is framed: its camera sees all of it in a square.
        if let Some(model) = &self.model {
            self.parameters.orbit.get_or_insert_with(|| {
                let mut orbit = Orbit::new(&model.opened.view.camera, loader::middle(&model.opened.scene));
                orbit.distance *= (rect.height() / rect.width()).max(1.0);
                orbit
            });
        }
        if let Some(orbit) = &mut self.parameters.orbit {
            let turned = dragged(ui, &response, egui::PointerButton::Primary);
            orbit.turn(turned.x, turned.y);
            for button in [egui::PointerButton::Secondary, egui::PointerButton::Middle] {
                let moved = dragged(ui, &response, button) / rect.height();
                orbit.pan(moved.x, moved.y);
            }
            if response.hovered() {
                // Fifty points are a notch of most wheels.
                let scroll = ui.input(|input| input.smooth_scroll_delta().y);
                if scroll != 0.0 {
                    orbit.approach(scroll / 50.0);
                }
            }
        }

        self.apply();
        let methods = self.methods();
        self.draw(0, methods[0], size);
        if self.parameters.split {
            self.draw(1, methods[1], size);
        }

        // Left of the line one picture, right of it the other.
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, Color32::from_gray(40));
        let at = if self.parameters.split { self.parameters.split_at } else { 1.0 };
        let half = |side: &Option<Side>, from: f32, to: f32| {
            let Some(side) = side.as_ref().filter(|side| side.target.frames > 0) else { return };
            let x = |share: f32| rect.left() + share * rect.width();
            let part = Rect::from_min_max(pos2(x(from), rect.top()), pos2(x(to), rect.bottom()));
            painter.image(side.id, part, Rect::from_min_max(pos2(from, 0.0), pos2(to, 1.0)), Color32::WHITE);
        };
        half(&self.sides[0], 0.0, at);
        if self.parameters.split {
            half(&self.sides[1], at, 1.0);
            let white = egui::Stroke::new(1.5, Color32::WHITE);
            painter.vline(line, rect.y_range(), white);
            let label = |x: f32, align, i: usize| {
                let (name, mips) = METHODS[self.parameters.methods[i]];
                let apart = if self.parameters.mips()[i] == mips { "" } else { ", maps one by one" };
                let font = egui::FontId::proportional(16.0);
                painter.text(
                    pos2(x, rect.top() + 10.0),
                    align,
                    format!("{name}{apart}"),
                    font,
                    Color32::WHITE,
                );
            };
            label(line - 10.0, egui::Align2::RIGHT_TOP, 0);
            label(line + 10.0, egui::Align2::LEFT_TOP, 1);
        }
        if self.model.is_none() && self.busy.is_empty() {
            let font = egui::FontId::proportional(20.0);
            let text = "drop a .glb or .gltf file here, or a baked folder";
            painter.text(rect.center(), egui::Align2::CENTER_CENTER, text, font, Color32::GRAY);
        }
    }

    /// Words over the picture: what is being done, what went wrong, the keys.
    fn words(&mut self, ctx: &egui::Context) {
        let baking = self.loader.baking();
        if !self.busy.is_empty() || baking.is_some() {
            egui::Area::new(egui::Id::unique("busy"))
                .interactable(false)
                .anchor(egui::Align2::LEFT_BOTTOM, vec2(12.0, -12.0))
                .show(ctx, |ui| {
                    egui::Frame::popup(ui.style()).show(ui, |ui| {
                        if !self.busy.is_empty() {
                            ui.label(&self.busy);
                        }
                        if let Some((what, share)) = baking {
                            ui.add(egui::ProgressBar::new(share).desired_width(220.0).text(what));
                        }
                    });
                });
            // The bar moves while the picture stands still.
            ctx.request_repaint_after(PROGRESS_INTERVAL);
        }
        // In the corner, since the model is in the middle, and above what is being done. The pointer goes through it: whoever
        // turns the model need not look for a place where nothing stands.
        if !self.message.is_empty() {
            egui::Window::new("Message (Esc closes it)")
                .collapsible(false)
                .interactable(false)
                .anchor(egui::Align2::LEFT_BOTTOM, vec2(12.0, -MESSAGE_HEIGHT))
                .show(ctx, |ui| ui.add(egui::Label::new(&self.message).selectable(false)));
        }
        if !self.shader_error.is_empty() && !self.posing {
            egui::Window::new("Shader").anchor(egui::Align2::LEFT_TOP, vec2(12.0, 12.0)).show(ctx, |ui| {
                ui.set_max_width(560.0);
                ui.label("This does not compile; the last shaders that did are drawing.");
                ui.colored_label(
                    Color32::from_rgb(255, 140, 120),
                    egui::RichText::new(&self.shader_error).monospace(),
                );
            });
        }
        egui::Window::new("Keys").open(&mut self.help).collapsible(false).show(ctx, |ui| {
            egui::Grid::new("keys").striped(true).show(ui, |ui| {
                for (key, what) in KEYS {
                    ui.strong(key);
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
    }

    /// Takes the picture of the window that the command line asks for, and closes it afterwards.
    fn take_screenshot(&mut self, ctx: &egui::Context) {
        if *self.closing.lock().expect("no thread panics") {
            ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        if !(self.settled()
            || self.shader_error.contains(':') && self.sides[0].as_ref().is_some_and(|s| s.target.frames > 0))
        {
            return;
        }
        let Some(path) = self.screenshot.take() else { return };
        if !self.shader_error.is_empty() {
            let what = format!("the last shaders that compiled are drawing; {}", self.shader_error);
            self.outcome.lock().expect("no thread panics").warnings.push(what);
        }
        let (closing, outcome, wake) = (self.closing.clone(), self.outcome.clone(), ctx.clone());
        ctx.request_screenshot(move |image| {
            let pixels = image.pixels.iter().map(|p| [p.r(), p.g(), p.b()]).collect();
            if let Err(error) = write_rgb8(&path, image.size[0] as u32, image.size[1] as u32, pixels) {
                outcome.lock().expect("no thread panics").failure = Some(error);
            }
            *closing.lock().expect("no thread panics") = true;
            wake.request_repaint();
        });
    }
}

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _: &mut eframe::Frame) {
        let ctx = ui.ctx().clone();
        self.receive();
        self.reload(false);
        let dropped = ctx.input(|input| input.raw.dropped_files.first().map(|file| file.path().to_owned()));
        if let Some(path) = dropped {
            self.dropped(&path);
        }
        let mut wishes = self.keys(&ctx);

        // The controls count the frames before this one, so that the last one needs another.
        let was_unsettled = self.model.is_some() && !self.settled();
        let shown = Shown {
            name: self.model.as_ref().map_or("no model", |m| &m.opened.name),
            material_names: self.model.as_ref().map_or(&[], |m| &m.opened.material_names),
            mapped: self.model.as_ref().map_or(&[], |m| &m.mapped),
            alpha_modes: &self.model.as_ref().map_or_else(Vec::new, |m| {
                m.opened.scene.materials.iter().map(|material| material.alpha_mode).collect()
            }),
            lights: self.model.as_ref().map_or(&[], |m| &m.opened.view.lights),
            baked: &self
                .model
                .as_ref()
                .map_or_else(Vec::new, |m| m.scenes.keys().copied().collect::<Vec<_>>()),
            frames: self.sides[0].as_ref().map_or(0, |side| side.target.frames),
            frames_wanted: self.spp,
            first_picture: self.model.as_ref().and_then(|model| model.first_picture),
        };
        let (parameters, material) = (&mut self.parameters, &mut self.material);
        egui::Panel::right("controls").exact_size(PANEL_WIDTH).show(ui, |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                let asked = panel(ui, parameters, material, &shown);
                wishes = Wishes {
                    frame_model: wishes.frame_model | asked.frame_model,
                    save_picture: wishes.save_picture | asked.save_picture,
                    save_parameters: wishes.save_parameters | asked.save_parameters,
                    ..asked
                };
            });
        });
        egui::CentralPanel::no_frame().show(ui, |ui| self.picture(ui));
        self.grant(wishes);
        if wishes != Wishes::default() {
            // What was granted is seen in the next frame.
            ctx.request_repaint();
        }
        self.words(&ctx);
        self.take_screenshot(&ctx);

        // The title names the model, with dots until its picture is smooth.
        let unsettled = was_unsettled || self.model.is_some() && !self.settled();
        let dots = if unsettled || !self.busy.is_empty() { " …" } else { "" };
        let title = match &self.model {
            Some(model) => format!("{}{dots} - Kinran", file_name(Path::new(&model.opened.name))),
            None => format!("Kinran{dots}"),
        };
        if title != self.title {
            ctx.send_viewport_cmd(egui::ViewportCommand::Title(title.clone()));
            self.title = title;
        }

        // Until the picture is smooth there is a next frame; after that, only the shader folder is looked at.
        if unsettled {
            ctx.request_repaint();
        } else if self.shaders.folder.is_some() {
            ctx.request_repaint_after(SHADER_INTERVAL);
        }
    }

    /// A software device that still draws while the process ends crashes it.
    fn on_exit(&mut self) {
        self.loader.close();
        // A device that is lost draws nothing any more either.
        let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
    }
}

/// How far a button has dragged a part of the window since the last frame, in points; also in the frame that sees its release.
fn dragged(ui: &egui::Ui, part: &egui::Response, button: egui::PointerButton) -> egui::Vec2 {
    if part.dragged_by(button) {
        return ui.input(|input| input.pointer.delta());
    }
    if !part.drag_stopped_by(button) {
        return egui::Vec2::ZERO;
    }
    // Where the pointer went after the release is no part of it.
    ui.input(|input| {
        let released = input.events.iter().find_map(|event| match *event {
            egui::Event::PointerButton { pos, button: which, pressed: false, .. } if which == button => {
                Some(pos)
            }
            _ => None,
        });
        let before = input.pointer.latest_pos().map(|now| now - input.pointer.delta());
        released.zip(before).map_or(egui::Vec2::ZERO, |(to, from)| to - from)
    })
}

/// An exposure so many thirds of a stop away, rounded so that three steps there and back lead to where they began.
fn stepped(exposure: f32, thirds: f32) -> f32 {
    // Plus zero: no -0 is shown.
    ((exposure + thirds / 3.0) * 1e3).round() / 1e3 + 0.0
}

/// Whether two sets of parameters give the same two pictures: the split line may have moved.
fn same_picture(a: &Parameters, b: &Parameters) -> bool {
    let picture = |p: &Parameters| Parameters {
        split: false,
        split_at: 0.0,
        environment: String::new(),
        environment_rotation: 0.0,
        ..p.clone()
    };
    picture(a) == picture(b)
}

/// The view's flags with the environment that the parameters name.
fn args_with_light(args: &ViewArgs, parameters: &Parameters) -> ViewArgs {
    let env: EnvironmentChoice = parameters.environment.parse().unwrap_or(EnvironmentChoice::Studio);
    let exr_layer = args.layer_of(&env);
    ViewArgs { env: Some(env), exr_layer, env_rotation: parameters.environment_rotation, ..args.clone() }
}

/// When a file of the shader folder was last saved.
fn newest(shaders: &ShaderSource) -> Option<SystemTime> {
    let entries = std::fs::read_dir(shaders.folder.as_ref()?).ok()?;
    entries.filter_map(|entry| entry.ok()?.metadata().ok()?.modified().ok()).max()
}

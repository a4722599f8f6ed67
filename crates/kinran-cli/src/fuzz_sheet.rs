//! `kinran fuzz`: a model with fibres on it, parameter by parameter, as the talk shows its velvety horse.

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueEnum;
use glam::{Vec2, Vec3, vec2, vec3};
use kinran_bake::aniso::Filter;
use kinran_image::{Channels, Image, Pixels, Transfer};
use kinran_render::metrics::flip;
use kinran_render::reference::{
    Background, BoundTexture, MipTexture, RenderFuzz, RenderScene, Surroundings, TextureFiltering,
};
use kinran_scene::{Environment, Fuzz, FuzzAttenuation, FuzzLayer, Light, LightKind, Wrap};
use kinran_shading::fuzz::{FUZZ_DEFERRED_ALBEDO, fibre_direction};
use kinran_shading::sh::sh_evaluate;
use schemars::JsonSchema;
use serde::Serialize;

use crate::backend::{Backend, Painter};
use crate::demo::noise::noise;
use crate::model::Model;
use crate::picture::{Picture, Row, grid};
use crate::surfaces::{Method, Mips, fuzz_fits, scene_surfaces};
use crate::values::{counted, number, vector};
use crate::view::{EnvironmentChoice, View, ViewArgs, file_name, samples_of};
use crate::{Console, Error, Progress, outputs, sheet_flags};

/// Draws a model with fuzz, a sheet of pictures for each parameter
///
/// Sheets: attenuation (no fuzz, base not attenuated, P_s = 0, full), density, spread, tilt, value and
/// saturation of the fibres' colour, light (one light moving round; harmonics alone; the environment alone), probe (the
/// environment in a smooth metal base, attenuated or not), simple (the form for seven bits of a G-buffer, off and on), and,
/// where it is named, realtime (both renderers' pictures and FLIP, their mean difference, in direct light and in that of
/// the environment, the layer lit along its lobe or as the talk has it). Every material gets the same fibres, over a dark base.
///
/// Without --light, an --env of a file or lights in the model, parameters are seen in three lights that show the fibres best and
/// have no noise: from the front left, and from behind on both sides.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran fuzz horse.gltf -o horse_fuzz/
  kinran fuzz sofa.gltf -o sofa_fuzz/ --base own --color 0.9,0.85,0.8
  kinran fuzz curtain.gltf -o crushed/ --direction swirl \\
      --spread 0.1 --tilt 50 --color 0.5,0.05,0.1 --sheet light
  kinran fuzz sofa.gltf -o felt/ --sheet simple --backend gpu
  kinran fuzz horse.gltf -o both/ --sheet realtime --spp 256 --size 128x128")]
pub struct Args {
    /// The .glb, .gltf or .obj file, or a folder that holds one, or the textures that `kinran bake` wrote
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for the sheets [default: NAME.fuzz beside the input]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Draws these sheets; all but realtime by default
    #[arg(long, value_enum, value_delimiter = ',', value_name = "NAMES")]
    pub sheet: Vec<Sheet>,

    /// Thickness of the layer over mean free path
    #[arg(long, value_name = "D", default_value = "0.2", value_parser = |t: &str| number(t, 0.0..=2.0))]
    pub density: f32,

    /// How far fibres spread: 0 combed, 1 in all directions
    #[arg(long, value_name = "S", default_value = "0.2", value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub spread: f32,

    /// Degrees between fibres and normal
    #[arg(long, value_name = "DEG", default_value = "23", value_parser = |t: &str| number(t, 0.0..=90.0))]
    pub tilt: f32,

    /// Linear albedo of the fibres, each 0 to 1
    #[arg(long, value_name = "R,G,B", default_value = COLOR, value_parser = vector)]
    pub color: Vec3,

    /// Linear colour of the base under the fibres: velvet shows on a dark one. `own` leaves colour and roughness as the file
    /// has them
    #[arg(long, value_name = "R,G,B|own", default_value = DARK)]
    pub base: Base,

    /// Roughness of the base, which is no metal then [default: 0.8, the file's for --base own]
    #[arg(long, value_name = "R", value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub roughness: Option<f32>,

    /// Where fibres lean: as they do in the tangent frame, in noise, or in swirls
    #[arg(long, value_enum, default_value_t = Direction::Even)]
    pub direction: Direction,

    /// What draws: the reference renderer on the CPU, or a GPU by Vulkan
    #[arg(long, value_enum, default_value_t = Backend::Cpu)]
    pub backend: Backend,

    /// Samples in a pixel
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

impl Args {
    /// Flags that some sheets have no use for.
    fn given(&self) -> Vec<&'static str> {
        let own = [
            ("density", self.density != 0.2),
            ("spread", self.spread != 0.2),
            ("tilt", self.tilt != 23.0),
            ("color", COLOR.parse().is_ok_and(|color: Base| color != Base::Color(self.color))),
            ("roughness", self.roughness.is_some()),
            ("direction", self.direction != Direction::Even),
            ("backend", self.backend != Backend::Cpu),
        ];
        let own = own.into_iter().filter(|(_, given)| *given).map(|(name, _)| name);
        own.chain(sheet_flags::given(&self.view)).collect()
    }

    /// Whether a flag of [`Args::given`] shows on a sheet; `plain` where parameters are seen in lights of their own.
    fn obeys(&self, flag: &str, sheet: Sheet, plain: bool) -> bool {
        let surrounded = matches!(sheet, Sheet::Light | Sheet::Probe | Sheet::Realtime) || !plain;
        match (flag, sheet) {
            ("density", Sheet::Density) | ("spread", Sheet::Spread) | ("tilt", Sheet::Tilt) => false,
            ("density" | "spread" | "tilt" | "direction", Sheet::Simple) => false,
            ("color", Sheet::Simple) => self.is_on_dark(),
            ("roughness" | "light" | "shadows" | "no-shadows", Sheet::Probe) | ("light", Sheet::Light) => {
                false
            }
            ("env", Sheet::Probe) => self.view.environment() != EnvironmentChoice::None,
            ("backend", Sheet::Realtime) => false,
            ("env-rotation" | "env-samples", _) => surrounded,
            ("background", _) if matches!(self.view.background, Some(Background::Environment { .. })) => {
                surrounded
            }
            _ => true,
        }
    }

    /// Whether the base is the default one.
    fn is_on_dark(&self) -> bool {
        DARK.parse().is_ok_and(|dark: Base| dark == self.base)
    }

    /// Whether any sheet is drawn on a GPU.
    pub(crate) fn draws_on_a_gpu(&self) -> bool {
        self.backend == Backend::Gpu || self.sheet.contains(&Sheet::Realtime)
    }
}

/// What a sheet varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Sheet {
    Attenuation,
    Density,
    Spread,
    Tilt,
    Value,
    Saturation,
    Light,
    Probe,
    Simple,
    Realtime,
}

/// What lies under the fibres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Base {
    /// The model's materials as they are.
    Own,
    /// A linear colour.
    Color(Vec3),
}

impl std::str::FromStr for Base {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "own" => Ok(Base::Own),
            color => vector(color).map(Base::Color).map_err(|e| format!("write own or R,G,B; {e}")),
        }
    }
}

/// A direction map made here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Direction {
    /// One direction
    Even,
    /// Tilt and azimuth vary from spot to spot
    Noise,
    /// Azimuth turns in large swirls, as where velvet was crushed
    Swirl,
}

/// The default colour of the fibres; chosen by eye.
const COLOR: &str = "0.95,0.35,0.42";

/// The default colour of the base; chosen by eye.
const DARK: &str = "0.03,0.006,0.01";

/// Roughness of a base whose colour is given; chosen by eye.
const BASE_ROUGHNESS: f32 = 0.8;

/// Lights that parameters are seen in: directions in the camera's frame (right, up, back); chosen by eye.
const LIGHTS: [Vec3; 3] = [vec3(-0.6, 0.6, 0.7), vec3(0.9, 0.5, -0.6), vec3(-0.8, 0.2, -0.8)];

/// How many times as bright as the lights of flags each of them is, for dark cloth; chosen by eye.
const BRIGHTNESS: f32 = 4.0;

#[derive(Serialize, JsonSchema)]
pub(crate) struct Summary {
    files: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    flip: Vec<Difference>,
    warnings: Vec<String>,
}

/// A real-time picture against the reference.
#[derive(Serialize, JsonSchema)]
struct Difference {
    light: &'static str,
    flip: f32,
}

/// The command.
///
/// # Errors
/// One that names the flag or the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let output = args.output.clone().unwrap_or_else(|| outputs::named_after(&args.file, ".fuzz"));
    outputs::check_folder(&output)?;
    let (base, roughness) = match args.base {
        Base::Own => (None, args.roughness),
        Base::Color(color) => (Some(color), Some(args.roughness.unwrap_or(BASE_ROUGHNESS))),
    };
    for (flag, color) in [("--color", Some(args.color)), ("--base", base)] {
        if let Some(Vec3 { x, y, z }) = color.filter(|c| c.min_element() < 0.0 || c.max_element() > 1.0) {
            return Err(Error::flag_error(format!("{flag} {x},{y},{z}"), "each must lie in 0 to 1"));
        }
    }
    // A probe of nothing is black.
    let is_shown = |sheet: &Sheet| {
        let surrounded = args.view.environment() != EnvironmentChoice::None;
        *sheet != Sheet::Realtime && (surrounded || *sheet != Sheet::Probe)
    };
    let sheets: Vec<Sheet> = match args.sheet.as_slice() {
        [] => Sheet::value_variants().iter().copied().filter(is_shown).collect(),
        named => named.to_vec(),
    };
    let pictures = sheets.iter().map(|&sheet| output.join(sheet_file(sheet)));
    args.view.refuse_inputs(&args.file, pictures)?;
    let painter = args.backend.open(None, &console.progress())?;
    let realtime = match sheets.contains(&Sheet::Realtime) {
        true => Some(Backend::Gpu.open(None, &console.progress())?),
        false => None,
    };
    let progress = console.progress();
    let Model { path, mut scene, only_baked } = Model::open(&args.file, &args.view.model, &progress)?;
    for material in &mut scene.materials {
        if let Some(base) = base {
            material.base_color_factor = base.extend(material.base_color_factor.w);
            material.base_color = None;
        }
        if let Some(roughness) = roughness {
            (material.metallic_factor, material.roughness_factor) = (0.0, roughness);
            material.metallic_roughness = None;
        }
    }
    let plain = args.view.light.is_empty() && scene.lights.is_empty() && args.view.env.is_none();
    sheet_flags::refuse_idle(&args.given(), &sheets, |flag, sheet| args.obeys(flag, sheet, plain))?;
    args.view.refuse_idle(&scene, &path.to_string_lossy())?;
    let view = View::new(&scene, &path.to_string_lossy(), &args.view)?;
    let mips = if only_baked { Mips::Baked } else { Mips::Filtered(Method::new(Filter::Linear, true)) };
    let (surfaces, apart) = scene_surfaces(&scene, mips, &progress)?;
    let prepared = view.scene(&scene, surfaces, &progress)?;
    let left_out = painter.left_out(&view, &prepared);
    let told = scene.warnings.iter().chain(view.environment_notes()).cloned();
    let bare = (args.density == 0.0).then(|| "--density 0: there are no fibres to see".to_owned());
    let warnings: Vec<String> = told.chain(apart).chain(left_out).chain(bare).collect();
    warnings.iter().for_each(|w| console.warn(w));
    let parameters = if plain {
        let lights = LIGHTS.map(|direction| light(&view, direction, BRIGHTNESS));
        View { lights: lights.into(), environment: None, ..view.clone() }
    } else {
        view.clone()
    };
    let all = progress.busy("sheets");
    let progress = progress.overall(&all);
    let studio = Studio { args, prepared, view, parameters, painter, progress: &progress };
    let pictures: usize = sheets.iter().map(|&sheet| studio.count(sheet)).sum();
    all.expect(pictures as u64 * samples_of(args.view.size, args.spp));

    kinran_image::make_folder(&output)?;
    let mut text = String::new();
    let (mut files, mut flip) = (Vec::new(), Vec::new());
    for sheet in sheets {
        let name = sheet_file(sheet);
        let picture = match &realtime {
            Some(gpu) if sheet == Sheet::Realtime => {
                let picture;
                (picture, flip) = studio.both(gpu)?;
                picture
            }
            _ => studio.sheet(sheet)?,
        };
        picture.write(&output.join(&name))?;
        files.push(name);
    }
    drop(all);
    for Difference { light, flip } in &flip {
        writeln!(text, "FLIP {flip:.4}: {light}").expect("strings grow");
    }
    let sheets = counted(files.len(), "sheet of", "sheets of");
    write!(text, "{sheets} {}: in {}", file_name(&args.file), output.display()).expect("strings grow");
    console.result(&Summary { files, flip, warnings }, &text)?;
    outputs::tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

/// The name of a sheet's picture.
fn sheet_file(sheet: Sheet) -> String {
    format!("{}.png", sheet.to_possible_value().expect("no sheet is hidden").get_name())
}

/// What a picture shows.
struct Shot {
    name: String,
    fuzz: Option<Fuzz>,
    view: View,
    /// A smooth metal takes the place of the base.
    gloss: bool,
    /// The base's colour, where the sheet has one of its own.
    base: Option<Vec3>,
    talk_ambient: bool,
}

struct Studio<'a> {
    args: &'a Args,
    prepared: RenderScene,
    view: View,
    /// What parameters are seen in.
    parameters: View,
    painter: Painter,
    progress: &'a Progress,
}

impl Studio<'_> {
    fn layer(&self) -> FuzzLayer {
        FuzzLayer {
            density: self.args.density,
            spread: self.args.spread,
            tilt: self.args.tilt.to_radians(),
            color: self.args.color,
            ..FuzzLayer::default()
        }
    }

    fn shot(&self, name: impl Into<String>, fuzz: Option<Fuzz>) -> Shot {
        Shot {
            name: name.into(),
            fuzz,
            view: self.parameters.clone(),
            gloss: false,
            base: None,
            talk_ambient: false,
        }
    }

    fn shots(&self, sheet: Sheet) -> Vec<Shot> {
        let base = self.layer();
        let vary = |name: &str, values: [f32; 6], change: &dyn Fn(f32) -> FuzzLayer| -> Vec<_> {
            let unit = if sheet == Sheet::Tilt { "°" } else { "" };
            let shot = |x| self.shot(format!("{name} {x}{unit}"), Some(Fuzz::Layer(change(x))));
            values.into_iter().map(shot).collect()
        };
        let attenuations = || -> Vec<_> {
            let attenuated = |name, attenuation| {
                self.shot(name, Some(Fuzz::Layer(FuzzLayer { attenuation, ..base.clone() })))
            };
            vec![
                self.shot("no fuzz", None),
                attenuated("no attenuation", FuzzAttenuation::None),
                attenuated("P_s = 0", FuzzAttenuation::Unscattered),
                attenuated("full", FuzzAttenuation::Full),
            ]
        };
        match sheet {
            Sheet::Attenuation => attenuations(),
            Sheet::Density => vary("density", [0.0, 0.05, 0.12, 0.3, 0.7, 1.5], &|density| FuzzLayer {
                density,
                ..base.clone()
            }),
            Sheet::Spread => {
                vary("spread", [0.0, 0.1, 0.2, 0.4, 0.7, 1.0], &|spread| FuzzLayer { spread, ..base.clone() })
            }
            Sheet::Tilt => vary("tilt", [0.0, 30.0, 45.0, 60.0, 75.0, 90.0], &|tilt: f32| FuzzLayer {
                tilt: tilt.to_radians(),
                ..base.clone()
            }),
            Sheet::Value => vary("value", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], &|value| {
                let color = base.color / base.color.max_element().max(1e-6) * value;
                FuzzLayer { color, ..base.clone() }
            }),
            Sheet::Saturation => vary("saturation", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], &|saturation| {
                // Red of the base's value.
                let value = base.color.max_element();
                let color = value * Vec3::ONE.lerp(vec3(1.0, 0.05, 0.02), saturation);
                FuzzLayer { color, ..base.clone() }
            }),
            Sheet::Light => {
                let lit = |(name, view)| Shot { view, ..self.shot(name, Some(Fuzz::Layer(base.clone()))) };
                self.lights().into_iter().map(lit).collect()
            }
            Sheet::Probe => {
                let view = View { lights: Vec::new(), ..self.view.clone() };
                let alone = |shot| Shot { view: view.clone(), gloss: true, ..shot };
                attenuations().into_iter().map(alone).collect()
            }
            Sheet::Simple => {
                let simple = |fuzziness| Some(Fuzz::Simple { fuzziness, texture: None });
                // Fibres of this form have their colour from the base: they get the one that --color says.
                let base = self.args.is_on_dark().then(|| self.args.color / FUZZ_DEFERRED_ALBEDO);
                let shot = |f| Shot { base, ..self.shot(format!("fuzziness {f}"), simple(f)) };
                [0.0, 0.5, 1.0].into_iter().map(shot).collect()
            }
            Sheet::Realtime => Vec::new(),
        }
    }

    /// How many pictures a sheet has drawn for it.
    fn count(&self, sheet: Sheet) -> usize {
        match sheet {
            // Two of the reference, and three in real time.
            Sheet::Realtime => 5,
            other => self.shots(other).len(),
        }
    }

    fn sheet(&self, sheet: Sheet) -> Result<Picture, Error> {
        let draw = |shot: Shot| Ok((shot.name.clone(), self.draw(&self.painter, &shot)?));
        let pictures: Result<Vec<_>, Error> = self.shots(sheet).into_iter().map(draw).collect();
        Ok(grid(&[Row { name: String::new(), cells: pictures? }]))
    }

    /// Both renderers: in direct light; in that of the environment, the layer lit along its lobe or as the talk has it.
    fn both(&self, gpu: &Painter) -> Result<(Picture, Vec<Difference>), Error> {
        let (width, height) = self.view.size;
        let fuzz = || Some(Fuzz::Layer(self.layer()));
        let direct = View { environment: None, ..self.view.clone() };
        let around = View { lights: Vec::new(), ..self.view.clone() };
        let (mut pictures, mut differences) = (Vec::new(), Vec::new());
        let rows = [
            ("direct light", direct, &["real time"][..]),
            ("environment", around, &["along the lobe", "the talk's"]),
        ];
        for (light, view, drawn) in rows {
            if view.lights.is_empty() && view.environment.is_none() {
                continue;
            }
            let shot = Shot { view, ..self.shot(light, fuzz()) };
            let reference = self.draw(&Painter::Cpu, &shot)?;
            for name in drawn {
                let talk_ambient = *name == "the talk's";
                let shot = Shot { view: shot.view.clone(), talk_ambient, ..self.shot(*name, fuzz()) };
                let picture = self.draw(gpu, &shot)?;
                let flip = flip(&reference.pixels, &picture.pixels, width, height)?.mean;
                let light = match (light, talk_ambient) {
                    ("environment", false) => "environment, ours",
                    ("environment", true) => "environment, the talk's",
                    _ => light,
                };
                differences.push(Difference { light, flip });
                pictures.push((format!("{name}: FLIP {flip:.4}"), picture));
            }
            let at = pictures.len() - drawn.len();
            pictures.insert(at, (format!("{light}, reference"), reference));
        }
        if differences.is_empty() {
            let reason = "no light to compare in; leave --env none out, or give --light X,Y,Z";
            return Err(Error::flag_error("--sheet realtime", reason));
        }
        Ok((grid(&[Row { name: String::new(), cells: pictures }]), differences))
    }

    fn draw(&self, painter: &Painter, shot: &Shot) -> Result<Picture, Error> {
        let mut scene = self.prepared.clone();
        let direction = match &shot.fuzz {
            Some(Fuzz::Layer(layer)) => direction_map(self.args.direction, layer.tilt),
            _ => None,
        };
        let fuzz = shot.fuzz.clone().map(|fuzz| RenderFuzz {
            fuzz,
            direction,
            color: None,
            amount: None,
            fits: None,
            talk_ambient: shot.talk_ambient,
        });
        for material in &mut scene.materials {
            material.fuzz.clone_from(&fuzz);
            if let Some(base) = shot.base {
                material.base_color_factor = base.extend(material.base_color_factor.w);
            }
            if shot.gloss {
                // As smooth as shows a window's frame; chosen by eye.
                (material.metallic_factor, material.roughness_factor) = (1.0, 0.2);
                (material.metallic_roughness, material.surface) = (None, None);
            }
        }
        scene.fit_fuzz(|phase, spread| fuzz_fits(phase, spread, self.progress))?;
        scene.lights.clone_from(&shot.view.lights);
        scene.surroundings = shot.view.environment.clone().map(|e| Arc::new(Surroundings::new(e)));
        let filtering = TextureFiltering::Mips { max_anisotropy: 16 };
        let (spp, progress) = (self.args.spp, self.progress);
        let film = painter.film(&shot.view, &scene, &shot.name, spp, filtering, progress)?;
        Ok(Picture { width: film.width, height: film.height, pixels: shot.view.display(&film) })
    }

    /// One light from four sides, then none but the environment: its harmonics, and itself.
    fn lights(&self) -> Vec<(String, View)> {
        let mut views: Vec<(String, View)> = [-60.0f32, -20.0, 20.0, 60.0]
            .into_iter()
            .map(|degrees| {
                let a = degrees.to_radians();
                let light = light(&self.view, vec3(a.sin(), 0.5, a.cos()), BRIGHTNESS);
                let side = if degrees < 0.0 { "left" } else { "right" };
                (
                    format!("light {}° {side}", degrees.abs()),
                    View { lights: vec![light], environment: None, ..self.view.clone() },
                )
            })
            .collect();
        if let Some(environment) = &self.view.environment {
            let harmonics = environment.spherical_harmonics();
            let smooth = Environment::from_fn(32, |d| sh_evaluate(&harmonics, d).max(Vec3::ZERO));
            for (name, environment) in [("harmonics", smooth), ("environment", environment.clone())] {
                let view = View { lights: Vec::new(), environment: Some(environment), ..self.view.clone() };
                views.push((name.to_owned(), view));
            }
        }
        views
    }
}

/// A light from a direction in the camera's frame, so many times as bright as those of flags.
fn light(view: &View, direction: Vec3, brightness: f32) -> Light {
    Light {
        kind: LightKind::Directional,
        color: Vec3::splat(brightness * std::f32::consts::PI),
        position: Vec3::ZERO,
        direction: -view.camera.transform.transform_vector3(direction).normalize(),
        range: f32::INFINITY,
    }
}

/// Directions in tangent space that repeat with the texture; tilts are about `tilt` radians.
fn direction_map(direction: Direction, tilt: f32) -> Option<BoundTexture> {
    const SIZE: u32 = 512;
    let turn = std::f32::consts::TAU;
    let fibre = |p: Vec2| match direction {
        Direction::Even => fibre_direction(tilt, 0.0),
        Direction::Noise => {
            let at = |cells: i32, seed| noise(p * cells as f32, [cells; 2], seed);
            fibre_direction(tilt * (1.0 + 0.5 * at(256, 1)), turn * (0.03 * at(16, 2) + 0.3 * at(256, 3)))
        }
        Direction::Swirl => {
            let at = |cells: i32, seed| noise(p * cells as f32, [cells; 2], seed);
            fibre_direction(tilt * (1.0 + 0.3 * at(24, 1)), turn * (0.8 * at(10, 2) + 0.4 * at(24, 3)))
        }
    };
    if direction == Direction::Even {
        return None;
    }
    let texels = (0..SIZE * SIZE).flat_map(|i| {
        let t = fibre(vec2((i % SIZE) as f32, (i / SIZE) as f32) / SIZE as f32);
        (t * 0.5 + 0.5).to_array()
    });
    let image = Image::new(SIZE, SIZE, Channels::Rgb, Pixels::F32(texels.collect()))
        .expect("finite directions, three for each texel");
    let texture = MipTexture::from_image(&image, Transfer::Linear, [Wrap::Repeat; 2]);
    Some(BoundTexture { texture: Arc::new(texture), ..BoundTexture::constant([0.5, 0.5, 1.0, 1.0]) })
}

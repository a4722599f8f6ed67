//! `kinran fuzz`: a model with fibres on it, parameter by parameter, as the talk shows its velvety horse.

use std::path::PathBuf;
use std::sync::Arc;

use clap::ValueEnum;
use glam::{Vec2, Vec3, vec2, vec3};
use kinran_image::{Channels, Image, Pixels, Transfer};
use kinran_render::reference::{
    BoundTexture, MipTexture, RenderFuzz, RenderScene, Surroundings, TextureFiltering,
};
use kinran_scene::{Environment, Fuzz, FuzzAttenuation, FuzzLayer, Light, LightKind, Scene, Wrap};
use kinran_shading::fuzz::fibre_direction;
use kinran_shading::sh::sh_evaluate;
use serde::Serialize;

use crate::demo::noise::noise;
use crate::picture::{INK, PAPER, Picture};
use crate::surfaces::{Mips, fuzz_coefficients, scene_surfaces};
use crate::values::{number, vector};
use crate::view::{View, ViewArgs, file_name};
use crate::{Console, Error, Progress, outputs};

/// Draws a model with fuzz, a sheet of pictures for each parameter
///
/// Sheets: attenuation (no fuzz, base not attenuated, P_s = 0, full), density, spread, tilt, value and
/// saturation of the fibres' colour, light (one light moving round; harmonics alone; the environment alone), simple
/// (the form for seven bits of a G-buffer, off and on). Every material gets the same fibres.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran fuzz horse.gltf -o horse_fuzz/ --base 0.05,0.04,0.035
  kinran fuzz curtain.gltf -o crushed/ --direction swirl --spread 0.1 --tilt 50 --color 0.5,0.05,0.1 --sheet light
  kinran fuzz sofa.gltf -o felt/ --sheet simple")]
pub struct Args {
    /// The .glb or .gltf file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for the sheets
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,

    /// Draws these sheets; all by default
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
    #[arg(long, value_name = "R,G,B", default_value = "0.8,0.75,0.7", value_parser = vector)]
    pub color: Vec3,

    /// Linear colour of the base under the fibres, in the place of the file's: velvet shows on a dark one
    #[arg(long, value_name = "R,G,B", value_parser = vector)]
    pub base: Option<Vec3>,

    /// Where fibres lean: as they do in the tangent frame, in noise, or in swirls
    #[arg(long, value_enum, default_value_t = Direction::Noise)]
    pub direction: Direction,

    /// Samples in a pixel
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1 << 20))]
    pub spp: u32,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
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
    Simple,
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

/// Pixels between pictures and for a line of words; chosen by eye.
const GAP: u32 = 10;
const LABEL: u32 = 26;

#[derive(Serialize)]
struct Summary {
    files: Vec<String>,
    warnings: Vec<String>,
}

/// The command.
///
/// # Errors
/// One that names the flag or the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    outputs::check_folder(&args.output)?;
    for (flag, color) in [("--color", Some(args.color)), ("--base", args.base)] {
        if let Some(Vec3 { x, y, z }) = color.filter(|c| c.min_element() < 0.0 || c.max_element() > 1.0) {
            return Err(Error::Usage(format!("{flag} {x},{y},{z}: each must lie in 0 to 1")));
        }
    }
    let scene = Scene::load(&args.file)?;
    let view = View::new(&scene, &args.file.to_string_lossy(), &args.view)?;
    let progress = console.progress();
    let (surfaces, apart) =
        scene_surfaces(&scene, Mips::Filtered(kinran_bake::aniso::Filter::Linear), &progress)?;
    let warnings: Vec<String> = scene.warnings.iter().cloned().chain(apart).collect();
    warnings.iter().for_each(|w| console.warn(w));
    let studio = Studio { args, prepared: view.scene(&scene, surfaces)?, view, progress: &progress };

    std::fs::create_dir_all(&args.output).map_err(|e| kinran_image::Error::io(&args.output, e))?;
    let all = Sheet::value_variants();
    let mut files = Vec::new();
    for &sheet in if args.sheet.is_empty() { all } else { &args.sheet } {
        let name = format!("{}.png", sheet.to_possible_value().expect("no sheet is hidden").get_name());
        studio.sheet(sheet)?.write(&args.output.join(&name))?;
        files.push(name);
    }
    let text =
        format!("{} sheets of {} are in {}", files.len(), file_name(&args.file), args.output.display());
    console.result(&Summary { files, warnings }, &text)
}

struct Studio<'a> {
    args: &'a Args,
    prepared: RenderScene,
    view: View,
    progress: &'a Progress,
}

impl Studio<'_> {
    /// Pictures under their labels, side by side.
    fn sheet(&self, sheet: Sheet) -> Result<Picture, Error> {
        let base = FuzzLayer {
            density: self.args.density,
            spread: self.args.spread,
            tilt: self.args.tilt.to_radians(),
            color: self.args.color,
            ..FuzzLayer::default()
        };
        let layer = |layer: FuzzLayer| Some(Fuzz::Layer(layer));
        let vary = |name: &str, values: [f32; 6], change: &dyn Fn(f32) -> FuzzLayer| -> Vec<_> {
            values.into_iter().map(|x| (format!("{name} {x}"), layer(change(x)), self.view.clone())).collect()
        };
        let attenuated = |name: &str, attenuation| {
            (name.to_owned(), layer(FuzzLayer { attenuation, ..base.clone() }), self.view.clone())
        };
        let pictures = match sheet {
            Sheet::Attenuation => vec![
                ("no fuzz".to_owned(), None, self.view.clone()),
                attenuated("base not attenuated", FuzzAttenuation::None),
                attenuated("P_s = 0", FuzzAttenuation::Unscattered),
                attenuated("P_s", FuzzAttenuation::Full),
            ],
            Sheet::Density => vary("density", [0.0, 0.1, 0.2, 0.3, 0.4, 0.5], &|density| FuzzLayer {
                density,
                ..base.clone()
            }),
            Sheet::Spread => {
                vary("spread", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], &|spread| FuzzLayer { spread, ..base.clone() })
            }
            Sheet::Tilt => vary("tilt", [0.0, 18.0, 36.0, 54.0, 72.0, 90.0], &|tilt: f32| FuzzLayer {
                tilt: tilt.to_radians(),
                ..base.clone()
            }),
            Sheet::Value => vary("fibre value", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], &|value| {
                let color = base.color / base.color.max_element().max(1e-6) * value;
                FuzzLayer { color, ..base.clone() }
            }),
            Sheet::Saturation => vary("fibre saturation", [0.0, 0.2, 0.4, 0.6, 0.8, 1.0], &|saturation| {
                // Red of the base's value.
                let value = base.color.max_element();
                let color = value * Vec3::ONE.lerp(vec3(1.0, 0.05, 0.02), saturation);
                FuzzLayer { color, ..base.clone() }
            }),
            Sheet::Light => {
                self.lights().into_iter().map(|(name, view)| (name, layer(base.clone()), view)).collect()
            }
            Sheet::Simple => [0.0, 0.5, 1.0]
                .into_iter()
                .map(|fuzziness| {
                    let simple = Fuzz::Simple { fuzziness, texture: None };
                    (format!("fuzziness {fuzziness}"), Some(simple), self.view.clone())
                })
                .collect(),
        };
        let (width, height) = self.view.size;
        let mut picture =
            Picture::new(GAP + (width + GAP) * pictures.len() as u32, LABEL + height + GAP, PAPER);
        for (i, (name, fuzz, view)) in pictures.into_iter().enumerate() {
            let x = GAP + (width + GAP) * i as u32;
            picture.text((x, 18), 15.0, INK, &name);
            picture.draw(x, LABEL, &self.draw(&name, fuzz, &view)?);
        }
        Ok(picture)
    }

    fn draw(&self, name: &str, fuzz: Option<Fuzz>, view: &View) -> Result<Picture, Error> {
        let mut scene = self.prepared.clone();
        let direction = match &fuzz {
            Some(Fuzz::Layer(layer)) => direction_map(self.args.direction, layer.tilt),
            _ => None,
        };
        let fuzz = fuzz.map(|fuzz| RenderFuzz {
            fuzz,
            direction,
            color: None,
            amount: None,
            coefficients: None,
            talk_ambient: false,
        });
        for material in &mut scene.materials {
            material.fuzz.clone_from(&fuzz);
            if let Some(base) = self.args.base {
                material.base_color_factor = base.extend(material.base_color_factor.w);
                material.base_color = None;
            }
        }
        scene.fit_fuzz(fuzz_coefficients);
        scene.lights.clone_from(&view.lights);
        scene.surroundings = view.environment.clone().map(|e| Arc::new(Surroundings::new(e)));
        let film = view.render(
            &scene,
            name,
            self.args.spp,
            TextureFiltering::Mips { max_anisotropy: 16 },
            self.progress,
        )?;
        Ok(Picture { width: film.width, height: film.height, pixels: view.display(&film) })
    }

    /// One light from four sides, then none but the environment: its harmonics, and itself.
    fn lights(&self) -> Vec<(String, View)> {
        let mut views: Vec<(String, View)> = [-60.0f32, -20.0, 20.0, 60.0]
            .into_iter()
            .map(|degrees| {
                let a = degrees.to_radians();
                let camera = self.view.camera.transform;
                let to_light = camera.transform_vector3(vec3(a.sin(), 0.5, a.cos())).normalize();
                let light = Light {
                    kind: LightKind::Directional,
                    color: Vec3::splat(std::f32::consts::PI),
                    position: Vec3::ZERO,
                    direction: -to_light,
                    range: f32::INFINITY,
                };
                (
                    format!("light at {degrees}°"),
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

/// Directions in tangent space that repeat with the texture; tilts are about `tilt` radians.
fn direction_map(direction: Direction, tilt: f32) -> Option<BoundTexture> {
    const SIZE: u32 = 256;
    let turn = std::f32::consts::TAU;
    let fibre = |p: Vec2| match direction {
        Direction::Even => fibre_direction(tilt, 0.0),
        Direction::Noise => {
            let at = |cells: i32, seed| noise(p * cells as f32, [cells; 2], seed);
            fibre_direction(tilt * (1.0 + 0.5 * at(64, 1)), turn * 0.25 * (at(16, 2) + at(64, 3)))
        }
        Direction::Swirl => {
            let at = |cells: i32, seed| noise(p * cells as f32, [cells; 2], seed);
            fibre_direction(tilt * (1.0 + 0.3 * at(8, 1)), turn * (at(4, 2) + 0.3 * at(8, 3)))
        }
    };
    if direction == Direction::Even {
        return None;
    }
    let texels = (0..SIZE * SIZE).flat_map(|i| {
        let t = fibre(vec2((i % SIZE) as f32, (i / SIZE) as f32) / SIZE as f32);
        (t * 0.5 + 0.5).to_array()
    });
    let image =
        Image { width: SIZE, height: SIZE, channels: Channels::Rgb, pixels: Pixels::F32(texels.collect()) };
    let texture = MipTexture::from_image(&image, Transfer::Linear, [Wrap::Repeat; 2]);
    Some(BoundTexture { texture: Arc::new(texture), ..BoundTexture::constant([0.5, 0.5, 1.0, 1.0]) })
}

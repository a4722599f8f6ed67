//! What a picture shows and in which light.

use std::path::{Path, PathBuf};

use clap::{Args, Parser, ValueEnum};
use glam::{Affine3A, Mat3, Vec3};
use kinran_render::reference::{
    Background, DetailShown, Film, RenderScene, Settings, ShadingRate, SurfaceTextures, TextureFiltering,
    look_at, render,
};
use kinran_render::tonemap::{Tonemap, to_srgb8};
use kinran_scene::{Camera, Document, Environment, Light, LightKind, Scene};

use crate::model::{ModelArgs, Place};
use crate::outputs::{refuse_input, refuse_other_picture};
use crate::skin::{SkinArgs, SkinCurvatureName, attach_skin};
use crate::surfaces::fuzz_fits;
use crate::values::{direction, number, size, vector};
use crate::{Error, Progress};

pub(crate) use crate::outputs::file_name;

/// Flags for camera, light and display that commands share.
#[derive(Args, Clone, Debug)]
pub struct ViewArgs {
    /// Pixels, WIDTHxHEIGHT, or one number for a square
    #[arg(long, help_heading = "Picture", value_name = "WxH", default_value = "512x512", value_parser = size)]
    pub size: (u32, u32),

    /// Light from all around: an equirectangular .hdr or .exr file, `studio` (built in), or `none` [default: studio, and
    /// none for sheets of skin]
    #[arg(long, help_heading = "Light", value_name = "FILE|studio|none")]
    pub env: Option<EnvironmentChoice>,

    /// Turns the environment about the vertical, degrees, counter-clockwise seen from above
    #[arg(long, help_heading = "Light", value_name = "DEG", default_value = "0", allow_negative_numbers = true,
        value_parser = |t: &str| number(t, -36000.0..=36000.0))]
    pub env_rotation: f32,

    /// Which layer of the environment's EXR file is meant
    #[arg(long, help_heading = "Light", value_name = "LAYER")]
    pub exr_layer: Option<String>,

    /// Samples of the environment's reflection for each sample of a pixel
    #[arg(long, help_heading = "Light", value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(0..=1024))]
    pub env_samples: u32,

    /// A directional light of pi lux from this direction; may be given several times. Without any, the
    /// file's own lights shine, and if it has none and --env is none, one from the upper left
    #[arg(long, help_heading = "Light", value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = direction)]
    pub light: Vec<Vec3>,

    /// Punctual lights cast hard shadows (the default)
    #[arg(long, help_heading = "Light", overrides_with = "no_shadows")]
    pub shadows: bool,

    /// Punctual lights shine through everything
    #[arg(long, help_heading = "Light", overrides_with = "shadows")]
    pub no_shadows: bool,

    /// Behind everything: `env`, `env:DEG` blurred by that half angle, or a linear colour R,G,B. The
    /// default is dark grey, and env where an environment's file is given
    #[arg(long, help_heading = "Picture", value_name = "env|R,G,B", allow_hyphen_values = true, value_parser = background)]
    pub background: Option<Background>,

    /// The file's own camera N, from 0. By default the whole model is framed
    #[arg(long, help_heading = "Camera", value_name = "N", conflicts_with_all = ["from", "fov"])]
    pub camera: Option<usize>,

    /// The direction from the model to the camera, +Y up
    #[arg(long, help_heading = "Camera", value_name = "X,Y,Z", default_value = "0.35,0.3,1", allow_hyphen_values = true,
        value_parser = direction)]
    pub from: Vec3,

    /// Vertical field of view, degrees
    #[arg(long, help_heading = "Camera", value_name = "DEG", default_value = "30", value_parser = |t: &str| number(t, 0.1..=170.0))]
    pub fov: f32,

    /// Moves the camera away from the model's middle by this factor
    #[arg(long, help_heading = "Camera", value_name = "FACTOR", default_value = "1", value_parser = |t: &str| number(t, 0.01..=10000.0))]
    pub distance: f32,

    /// Exposure in stops
    #[arg(long, help_heading = "Picture", value_name = "EV", default_value = "0", allow_negative_numbers = true,
        value_parser = |t: &str| number(t, -32.0..=32.0))]
    pub exposure: f32,

    /// The tone curve of pictures for displays; EXR files are linear and not exposed
    #[arg(long, help_heading = "Picture", value_enum, default_value_t = Curve::Aces)]
    pub tonemap: Curve,

    /// Overwrites pictures that kinran did not draw
    #[arg(long, help_heading = "Picture")]
    pub force: bool,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub model: ModelArgs,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub skin: SkinArgs,

    /// What is shown of maps that are blended from tiles
    #[arg(long, help_heading = "Picture", value_enum, default_value_t)]
    pub detail: DetailName,
}

impl ViewArgs {
    /// The layer of an environment's file that the flag names: that of the command line's file.
    #[cfg(feature = "view")]
    pub(crate) fn layer_of(&self, choice: &EnvironmentChoice) -> Option<String> {
        self.exr_layer.clone().filter(|_| *choice == self.environment())
    }

    /// Where light from all around comes from.
    pub(crate) fn environment(&self) -> EnvironmentChoice {
        self.env.clone().unwrap_or(EnvironmentChoice::Studio)
    }

    /// Refuses flags about what a scene does not have, or a picture of it does not show.
    ///
    /// # Errors
    /// [`Error::Flag`] that names the first.
    pub(crate) fn refuse_idle(&self, scene: &Scene, file: &str) -> Result<(), Error> {
        let surrounded = self.environment() != EnvironmentChoice::None;
        let has_skin = scene.materials.iter().any(|material| material.skin.is_some());
        let has_detail = scene.materials.iter().any(|material| material.detail.is_some());
        let shows_environment = matches!(self.background, Some(Background::Environment { .. }));
        let (nothing_around, no_skin) =
            ("there is no light from all around; name some with --env", "no material is skin");
        let flags = [
            ("--env-rotation", self.env_rotation != 0.0, surrounded, nothing_around),
            ("--env-samples", self.env_samples != 1, surrounded, nothing_around),
            ("--background env", shows_environment, surrounded, nothing_around),
            ("--skin-curvature", self.skin.skin_curvature != SkinCurvatureName::default(), has_skin, no_skin),
            ("--skin-penumbra", self.skin.skin_penumbra.is_some(), has_skin, no_skin),
            ("--skin-normals", self.skin.skin_normals.is_some(), has_skin, no_skin),
            (
                "--detail",
                self.detail != DetailName::default(),
                has_detail,
                "no material is blended from tiles",
            ),
        ];
        match flags.into_iter().find(|(_, given, acts, _)| *given && !acts) {
            Some((flag, _, _, why)) => {
                Err(Error::flag_error_of(file, flag, format!("{why}; leave the flag out")))
            }
            None => Ok(()),
        }
    }

    /// Refuses pictures that would overwrite the model, a file that it names, the environment, or a picture that kinran did
    /// not draw; its own are drawn again without a question.
    ///
    /// # Errors
    /// [`Error::File`] that names the picture.
    pub(crate) fn refuse_inputs(
        &self,
        model: &Path,
        outputs: impl IntoIterator<Item = PathBuf>,
    ) -> Result<(), Error> {
        let mut inputs = vec![model.to_path_buf()];
        if let Some(EnvironmentChoice::File(path)) = &self.env {
            inputs.push(path.clone());
        }
        if let Ok(Place::File(file)) = Place::of(model) {
            // What is no glTF names no files, or is refused later.
            inputs.extend(Document::open(&file).map(|document| document.files()).unwrap_or_default());
            inputs.push(file);
        }
        outputs.into_iter().try_for_each(|output| {
            refuse_input(&output, inputs.iter().map(PathBuf::as_path))?;
            if self.force { Ok(()) } else { refuse_other_picture(&output) }
        })
    }
}

/// What is shown of maps that are blended from tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum DetailName {
    /// Tiles and synthesized map together
    #[default]
    Blended,
    /// The tiles alone
    Detail,
    /// The synthesized map alone
    Synthesized,
    /// The material's own maps, which were to be reproduced
    Target,
}

impl From<DetailName> for DetailShown {
    fn from(name: DetailName) -> Self {
        match name {
            DetailName::Blended => DetailShown::Blended,
            DetailName::Detail => DetailShown::Detail,
            DetailName::Synthesized => DetailShown::Synthesized,
            DetailName::Target => DetailShown::Target,
        }
    }
}

/// Where light from all around comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EnvironmentChoice {
    /// [`Environment::studio`].
    Studio,
    /// Darkness.
    None,
    /// A file.
    File(PathBuf),
}

/// A tone curve's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Curve {
    /// ACES filmic
    Aces,
    /// AgX, base look
    Agx,
    /// Clamped
    None,
}

/// A prepared camera and light.
#[derive(Clone)]
pub struct View {
    /// Pixels.
    pub size: (u32, u32),
    /// Where the picture is taken from.
    pub camera: Camera,
    /// The model's middle, which zooming out moves away from.
    pub middle: Vec3,
    /// Light from all around.
    pub environment: Option<Environment>,
    /// Punctual lights.
    pub lights: Vec<Light>,
    /// Whether they cast shadows.
    pub shadows: bool,
    /// See [`Settings::env_samples`].
    pub env_samples: u32,
    /// Behind everything.
    pub background: Background,
    /// Stops.
    pub exposure: f32,
    /// Tone curve.
    pub tonemap: Tonemap,
    /// How skin is lit.
    pub skin: SkinArgs,
    /// What is shown of maps that are blended from tiles.
    pub detail: DetailShown,
}

/// Which samples of a pixel a picture is made of, and where they are shaded: [`Settings::first_sample`],
/// [`Settings::samples_per_pixel`], [`Settings::seed`], [`Settings::shading`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Samples {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) seed: u32,
    pub(crate) shading: ShadingRate,
}

/// Radiance behind models where no environment's file is given; chosen by eye.
const BACKDROP: Vec3 = Vec3::new(0.085, 0.087, 0.092);

/// The default light's direction in the camera's frame (right, up, back); chosen by eye.
const KEY_LIGHT: Vec3 = Vec3::new(-0.5, 0.7, 0.6);

impl std::str::FromStr for EnvironmentChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "studio" => EnvironmentChoice::Studio,
            "none" => EnvironmentChoice::None,
            "" => return Err("name a .hdr or .exr file, studio or none".into()),
            file => EnvironmentChoice::File(file.into()),
        })
    }
}

fn background(text: &str) -> Result<Background, String> {
    match text.split_once(':').unwrap_or((text, "0")) {
        ("env", blur) => Ok(Background::Environment { blur: number(blur, 0.0..=180.0)?.to_radians() }),
        _ => vector(text).map(Background::Color).map_err(|e| format!("write env, env:DEG or R,G,B; {e}")),
    }
}

impl Default for ViewArgs {
    /// What the command line gives without flags.
    fn default() -> Self {
        #[derive(Parser)]
        struct Flags {
            #[command(flatten)]
            view: ViewArgs,
        }
        Flags::parse_from(["kinran"]).view
    }
}

impl View {
    /// The view of `scene` that `args` ask for; `file` names the scene in errors.
    ///
    /// # Errors
    /// [`Error::File`] where the scene has no triangles, [`Error::Flag`] where it has not that camera, and those of the
    /// environment's file.
    pub fn new(scene: &Scene, file: &str, args: &ViewArgs) -> Result<View, Error> {
        let (framed, middle) = frame(scene, args)
            .ok_or_else(|| Error::file_error(file, "no triangles; give a file with a mesh in its scene"))?;
        let camera = match args.camera {
            None => framed,
            Some(n) => *scene.cameras.get(n).ok_or_else(|| {
                let count = scene.cameras.len();
                let fix = if count == 0 {
                    "leave --camera out".into()
                } else {
                    format!("choose 0 to {}", count - 1)
                };
                let reason = format!("the file has {count} cameras; {fix}");
                Error::flag_error_of(file, format!("--camera {n}"), reason)
            })?,
        };
        let choice = args.environment();
        let environment = environment(&choice, args.exr_layer.as_deref(), args.env_rotation)?;
        let from_file = matches!(choice, EnvironmentChoice::File(_));
        let default_background =
            if from_file { Background::Environment { blur: 0.0 } } else { Background::Color(BACKDROP) };
        let view = View {
            size: args.size,
            camera,
            middle,
            lights: lights(scene, args, &camera),
            environment,
            shadows: !args.no_shadows,
            env_samples: args.env_samples,
            background: args.background.unwrap_or(default_background),
            exposure: args.exposure,
            tonemap: match args.tonemap {
                Curve::Aces => Tonemap::Aces,
                Curve::Agx => Tonemap::AgX,
                Curve::None => Tonemap::None,
            },
            skin: args.skin.clone(),
            detail: args.detail.into(),
        };
        Ok(View { camera: view.camera_at(args.distance), ..view })
    }

    /// What is to be said of the environment's file.
    pub fn environment_notes(&self) -> impl Iterator<Item = &String> {
        self.environment.iter().flat_map(|environment| &environment.notes)
    }

    /// The camera, moved away from the model's middle by `factor`.
    pub fn camera_at(&self, factor: f32) -> Camera {
        let position = Vec3::from(self.camera.transform.translation);
        let moved = self.middle + factor * (position - self.middle);
        Camera {
            transform: Affine3A { translation: moved.into(), ..self.camera.transform },
            yfov: self.camera.yfov,
        }
    }

    /// The view from `factor` times the distance, cut down to what the whole picture showed: a pixel covers
    /// the same angle, so that the model is drawn with about `1 / factor²` of the pixels.
    pub fn zoomed_out(&self, factor: f32) -> View {
        let shrink = |side: u32| ((side as f32 / factor).round() as u32).max(1);
        let size = (shrink(self.size.0), shrink(self.size.1));
        let tangent = (0.5 * self.camera.yfov).tan() * size.1 as f32 / self.size.1 as f32;
        let camera = Camera { yfov: 2.0 * tangent.atan(), ..self.camera_at(factor) };
        View { size, camera, ..self.clone() }
    }

    /// `scene` with `surfaces` in this view's light.
    ///
    /// # Errors
    /// Those of [`RenderScene::new`].
    pub fn scene(
        &self,
        scene: &Scene,
        surfaces: Vec<Option<SurfaceTextures>>,
        progress: &Progress,
    ) -> Result<RenderScene, Error> {
        let preparing = progress.busy("preparing the scene");
        let mut prepared = RenderScene::new(scene, surfaces, self.environment.clone())?;
        drop(preparing);
        prepared.fit_fuzz(|phase, spread| fuzz_fits(phase, spread, progress))?;
        prepared.lights.clone_from(&self.lights);
        attach_skin(scene, &mut prepared, &self.skin, progress)?;
        prepared.materials.iter_mut().filter_map(|m| m.detail.as_mut()).for_each(|d| d.shown = self.detail);
        Ok(prepared)
    }

    /// Renders.
    ///
    /// # Errors
    /// Those of [`render`].
    pub fn render(
        &self,
        scene: &RenderScene,
        name: &str,
        samples_per_pixel: u32,
        filtering: TextureFiltering,
        progress: &Progress,
    ) -> Result<Film, Error> {
        let shading = ShadingRate::Sample;
        let samples = Samples { first: 0, count: samples_per_pixel, seed: 0, shading };
        self.render_samples(scene, name, samples, filtering, progress)
    }

    /// Renders some of a pixel's samples.
    ///
    /// # Errors
    /// Those of [`render`].
    pub(crate) fn render_samples(
        &self,
        scene: &RenderScene,
        name: &str,
        samples: Samples,
        filtering: TextureFiltering,
        progress: &Progress,
    ) -> Result<Film, Error> {
        let settings = Settings {
            width: self.size.0,
            height: self.size.1,
            samples_per_pixel: samples.count,
            first_sample: samples.first,
            seed: samples.seed,
            filtering,
            shading: samples.shading,
            env_samples: self.env_samples,
            shadows: self.shadows,
            background: self.background,
        };
        let stage = progress.stage(name, samples_of(self.size, 1));
        Ok(render(scene, &self.camera, &settings, &|pixels| {
            progress.drawn(pixels * u64::from(samples.count));
            stage.tick(pixels)
        })?)
    }

    /// A film as a display shows it.
    pub fn display(&self, film: &Film) -> Vec<[u8; 3]> {
        to_srgb8(&film.pixels, self.exposure, self.tonemap)
    }
}

/// Samples of a picture with so many for each pixel.
pub(crate) fn samples_of((width, height): (u32, u32), for_each: u32) -> u64 {
    u64::from(width) * u64::from(height) * u64::from(for_each)
}

/// The camera that sees all triangles from the direction asked for, as near as they allow, and the middle
/// of what it sees; `None` without triangles.
fn frame(scene: &Scene, args: &ViewArgs) -> Option<(Camera, Vec3)> {
    let yfov = args.fov.to_radians();
    let up = if args.from.y.abs() > 0.999 { Vec3::NEG_Z * args.from.y.signum() } else { Vec3::Y };
    let basis = Mat3::from(look_at(args.from, Vec3::ZERO, up, yfov).transform.matrix3);
    let corners = || {
        scene.instances.iter().flat_map(|instance| {
            let primitive = &scene.primitives[instance.primitive];
            let corners = primitive.triangles.iter().flatten().map(|&i| primitive.positions[i as usize]);
            corners.map(|p| basis.transpose() * instance.transform.transform_point3(p))
        })
    };
    let (min, max) = corners().map(|p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))?;
    let middle = 0.5 * (min + max);

    // A corner at offset p from the middle stands inside the frustum when the camera's distance is at least
    // p.z + |p.axis| / tan(half angle), for both axes.
    let tangent = (0.5 * yfov).tan();
    let aspect = args.size.0 as f32 / args.size.1 as f32;
    let distances =
        corners().map(|p| p - middle).map(|p| p.z + (p.x.abs() / aspect).max(p.y.abs()) / tangent);
    let distance = distances.fold(0.0, f32::max);
    // Five percent of air, chosen by eye; a single point is seen from one metre.
    let distance = if distance > 0.0 { 1.05 * distance } else { 1.0 };
    let middle = basis * middle;
    Some((look_at(middle + distance * args.from, middle, up, yfov), middle))
}

fn lights(scene: &Scene, args: &ViewArgs, camera: &Camera) -> Vec<Light> {
    // A white Lambertian surface that faces a light of pi lux has radiance 1.
    let key = |towards: Vec3| Light {
        kind: LightKind::Directional,
        color: Vec3::splat(std::f32::consts::PI),
        position: Vec3::ZERO,
        direction: -towards,
        range: f32::INFINITY,
    };
    if !args.light.is_empty() {
        args.light.iter().copied().map(key).collect()
    } else if scene.lights.is_empty() && args.environment() == EnvironmentChoice::None {
        vec![key((Mat3::from(camera.transform.matrix3) * KEY_LIGHT).normalize())]
    } else {
        scene.lights.clone()
    }
}

/// The environment chosen, of an EXR the layer that is called so, turned by so many degrees.
///
/// # Errors
/// Those of [`Environment::load_layer`], and a layer of what is no file.
pub(crate) fn environment(
    choice: &EnvironmentChoice,
    layer: Option<&str>,
    rotation: f32,
) -> Result<Option<Environment>, Error> {
    refuse_layer(choice, layer)?;
    let environment = match choice {
        EnvironmentChoice::Studio => Some(Environment::studio()),
        EnvironmentChoice::None => None,
        EnvironmentChoice::File(path) => Some(Environment::load_layer(path, layer)?),
    };
    Ok(environment.map(|e| turned(e, rotation)))
}

/// Refuses a layer of what is no file.
pub(crate) fn refuse_layer(choice: &EnvironmentChoice, layer: Option<&str>) -> Result<(), Error> {
    match (choice, layer) {
        (EnvironmentChoice::File(_), _) | (_, None) => Ok(()),
        (EnvironmentChoice::Studio | EnvironmentChoice::None, Some(layer)) => {
            let reason =
                "only the .exr file of an environment has layers; name it with --env, or leave the flag out";
            Err(Error::flag_error(format!("--exr-layer {layer}"), reason))
        }
    }
}

fn turned(environment: Environment, degrees: f32) -> Environment {
    if degrees == 0.0 {
        return environment;
    }
    let back = Mat3::from_rotation_y(-degrees.to_radians());
    let mut turned =
        Environment::from_fn(environment.height(), |direction| environment.radiance(back * direction));
    turned.notes = environment.notes;
    turned
}

//! `kinran demo`: paints three materials, bakes, renders and compares them, and shows all of it on a page.

mod brocade;
mod brushed_disc;
pub(crate) mod glb;
mod maps;
mod mesh;
pub(crate) mod noise;
mod page;
mod scenes;
mod twill;

use std::path::{Path, PathBuf};

use clap::Parser;
use kinran_bake::aniso::Filter;
use kinran_image::write_atomically;
use kinran_render::reference::{ShadingRate, TextureFiltering};
use kinran_scene::Scene;
use schemars::JsonSchema;
use serde::Serialize;

use crate::compare::{self, Finding, MethodReport, compare};
use crate::picture::Picture;
use crate::surfaces::{Colors, Method, Mips, scene_surfaces};
use crate::view::{View, ViewArgs, file_name, samples_of};
use crate::{Console, Error, Progress, bake, outputs};
use scenes::Subject;

/// Makes three materials itself, bakes, renders and compares them
///
/// A spun steel disc, a twill of shot silk and a gold brocade: their maps are painted, baked to KTX2 as
/// `kinran bake` does, put on a model, rendered, and compared with ground truth. The folder then holds
/// index.html, a page with all pictures and numbers and the commands that make them, and next to it
/// everything that it shows. Needs no other file, and no graphics card.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran demo
  kinran demo -o /tmp/demo --quick")]
pub struct Args {
    /// The folder for everything; made if it is not there
    #[arg(long, short, value_name = "DIR", default_value = "out")]
    pub output: PathBuf,

    /// Small pictures of few samples, in a few seconds
    #[arg(long)]
    pub quick: bool,
}

/// How large and how careful everything is. Chosen so that the whole demo takes less than two minutes on two
/// cores, and that a person waits gladly for the quick one.
struct Scale {
    /// Texels of a map's side.
    texels: u32,
    /// Factor of the number of vertices along each side of a cloth.
    detail: f32,
    /// Pixels and samples of the large pictures.
    hero: (u32, u32),
    hero_samples: u32,
    /// Pixels and samples of the comparisons.
    compared: (u32, u32),
    samples: u32,
    truth_samples: u32,
    distances: &'static [f32],
}

const FULL: Scale = Scale {
    texels: 1024,
    detail: 1.0,
    hero: (1280, 720),
    hero_samples: 8,
    compared: (160, 120),
    samples: 16,
    truth_samples: 256,
    distances: &[1.0, 2.0, 4.0],
};

const QUICK: Scale = Scale {
    texels: 256,
    detail: 0.25,
    hero: (192, 108),
    hero_samples: 4,
    compared: (64, 48),
    samples: 16,
    truth_samples: 64,
    distances: &[1.0, 2.0],
};

impl Scale {
    /// How long making takes, in samples of pixels: 2.3 s for 1024² texels, where a million samples took 1.7 s.
    fn making(&self) -> u64 {
        u64::from(self.texels) * u64::from(self.texels) * 4 / 3
    }

    /// Samples of a comparison's pictures.
    fn comparing(&self) -> u64 {
        let truth_and_filters = self.truth_samples + METHODS.len() as u32 * self.samples;
        // From farther away there are fewer pixels and more samples in each.
        let share: f32 = self.distances.iter().map(|distance| 1.0 / distance).sum();
        (samples_of(self.compared, truth_and_filters) as f32 * share) as u64
    }

    /// Samples of a large picture.
    fn drawing(&self) -> u64 {
        samples_of(self.hero, self.hero_samples)
    }
}

/// What is compared; the second is drawn where it differs from the first.
const METHODS: [Method; 5] = [
    Method { filter: Filter::Ml, colors: Colors::Together },
    Method { filter: Filter::Ml, colors: Colors::Apart },
    Method { filter: Filter::Linear, colors: Colors::Together },
    Method { filter: Filter::Lean, colors: Colors::Together },
    Method { filter: Filter::Naive, colors: Colors::Apart },
];

/// What the demo made of one material. Paths are relative to the output folder.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Shown {
    #[serde(skip)]
    subject: Subject,
    /// The material.
    material: &'static str,
    /// The large picture.
    picture: String,
    /// The model.
    model: String,
    /// The painted maps.
    maps: Vec<String>,
    /// The baked textures.
    textures: Vec<String>,
    /// The comparison's pictures: side by side, and over distance.
    comparison: String,
    distance: String,
    /// The numbers.
    methods: Vec<MethodReport>,
    /// What they show, for each distance.
    findings: Vec<Finding>,
    /// The commands that make these files from the maps and the model.
    commands: Vec<String>,
}

#[derive(Serialize, JsonSchema)]
pub(crate) struct Summary {
    page: String,
    materials: Vec<Shown>,
}

/// The command.
///
/// # Errors
/// One that names the file that could not be written.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    outputs::check_folder(&args.output)?;
    outputs::refuse_other_page(&args.output.join("index.html"))?;
    let scale = if args.quick { &QUICK } else { &FULL };
    let progress = console.progress();
    let of_each = scale.making() + scale.drawing() + scale.comparing();
    let all = progress.stage("demo", Subject::ALL.len() as u64 * of_each);
    let progress = progress.overall(&all);
    for subject in Subject::ALL {
        make(subject, scale, &args.output, console)?;
        all.add(scale.making());
    }
    for subject in Subject::ALL {
        take_picture(subject, scale, &args.output, &progress)?;
    }
    let mut materials = Vec::new();
    for subject in Subject::ALL {
        materials.push(show(subject, scale, &args.output, &progress)?);
    }
    drop(all);
    let page = args.output.join("index.html");
    write_atomically(&page, page::page(&materials).as_bytes())?;

    let mut text = String::new();
    for shown in &materials {
        let error = |m: &MethodReport| format!("{} {:.4}", m.filter, m.distances[0].rmse);
        let numbers = shown.methods.iter().map(error).collect::<Vec<_>>().join(", ");
        text += &format!("{}: {}\n", shown.subject.title(), args.output.join(&shown.picture).display());
        text += &format!("    comparison: {}\n", args.output.join(&shown.comparison).display());
        text += &format!("    root mean square error: {numbers}\n    {}\n", shown.findings[0].says);
    }
    text += &format!("Maps, baked textures, models and all pictures are on {}", page.display());
    console.result(&Summary { page: "index.html".into(), materials }, &text)
}

fn maps_folder(subject: Subject) -> String {
    format!("materials/{}", subject.name())
}

fn baked_folder(subject: Subject) -> String {
    format!("baked/{}", subject.name())
}

fn model(subject: Subject) -> String {
    format!("{}.glb", subject.name())
}

fn picture(subject: Subject) -> String {
    format!("{}.png", subject.name())
}

/// Maps, textures and model.
fn make(subject: Subject, scale: &Scale, folder: &Path, console: &Console) -> Result<(), Error> {
    let painting = console.progress().busy(format!("painting {}", subject.name()));
    let maps = subject.maps(scale.texels)?;
    let maps_folder = folder.join(maps_folder(subject));
    maps.write(&maps_folder, subject.name())?;
    drop(painting);
    bake_textures(&maps_folder, &folder.join(baked_folder(subject)), console)?;
    let _busy = console.progress().busy(format!("modelling {}", subject.name()));
    subject.write(&folder.join(model(subject)), &maps, scale.detail)
}

/// The large picture.
fn take_picture(subject: Subject, scale: &Scale, folder: &Path, progress: &Progress) -> Result<(), Error> {
    let scene = Scene::load(folder.join(model(subject)))?;
    let (surfaces, _) = scene_surfaces(&scene, Mips::DEFAULT, progress)?;
    let view = view(&scene, subject, scale.hero)?;
    let filtering = TextureFiltering::Mips { max_anisotropy: 16 };
    let prepared = view.scene(&scene, surfaces, progress)?;
    let film = view.render(&prepared, subject.title(), scale.hero_samples, filtering, progress)?;
    let hero = Picture { width: film.width, height: film.height, pixels: view.display(&film) };
    hero.write(&folder.join(picture(subject)))
}

/// The comparison, and a list of everything that was made.
fn show(subject: Subject, scale: &Scale, folder: &Path, progress: &Progress) -> Result<Shown, Error> {
    let name = subject.name();
    let compare_folder = format!("compare/{name}");
    let scene = Scene::load(folder.join(model(subject)))?;
    let options = compare::Options {
        methods: METHODS.to_vec(),
        shading: ShadingRate::Pixel,
        samples_per_pixel: scale.samples,
        truth_samples_per_pixel: scale.truth_samples,
        most_truth_samples: scale.truth_samples,
        max_anisotropy: 16,
        distances: scale.distances.to_vec(),
        budget: true,
        view: view(&scene, subject, scale.compared)?,
    };
    let comparison = compare(&scene, subject.title(), &options, progress)?;
    comparison.write(&folder.join(&compare_folder))?;

    let all = |place: &str, extension: &str| -> Result<Vec<String>, Error> {
        let found = files(&folder.join(place), extension)?;
        Ok(found.iter().map(|path| format!("{place}/{}", file_name(path))).collect())
    };
    Ok(Shown {
        subject,
        material: name,
        commands: commands(subject, scale),
        picture: picture(subject),
        model: model(subject),
        maps: all(&maps_folder(subject), "png")?,
        textures: all(&baked_folder(subject), "ktx2")?,
        comparison: format!("{compare_folder}/compare.png"),
        distance: format!("{compare_folder}/distance.png"),
        methods: comparison.report.methods,
        findings: comparison.report.findings,
    })
}

/// `kinran bake` on a folder of maps.
fn bake_textures(maps: &Path, output: &Path, console: &Console) -> Result<(), Error> {
    #[derive(Parser)]
    struct Flags {
        #[command(flatten)]
        bake: bake::Args,
    }
    let words = [Path::new("bake"), maps, Path::new("--output"), output].map(Path::as_os_str);
    let flags = Flags::try_parse_from(words).map_err(|e| Error::Internal(e.to_string()))?;
    // Everything in the demo's folder is the demo's.
    let bake = bake::Args { force: true, ..flags.bake };
    bake::run(&bake, &Console { quiet: true, bars: console.bars.clone(), ..Console::default() })
}

/// The model's own camera and lights; of the built-in studio only the diffuse light, which has no noise.
fn view(scene: &Scene, subject: Subject, size: (u32, u32)) -> Result<View, Error> {
    let args = ViewArgs { size, camera: Some(0), env_samples: 0, ..ViewArgs::default() };
    let view = View::new(scene, &model(subject), &args)?;
    // Zooming out goes straight back, so that what is in the middle of the picture stays there.
    let camera = view.camera.transform;
    let back = camera.matrix3.z_axis;
    let depth = (glam::Vec3A::from(view.middle) - camera.translation).dot(back);
    Ok(View { middle: (camera.translation + depth * back).into(), ..view })
}

/// What to type, in the output folder, to make the files again one by one.
fn commands(subject: Subject, scale: &Scale) -> Vec<String> {
    let name = subject.name();
    let size = |(width, height): (u32, u32)| format!("{width}x{height}");
    let view = "--camera 0 --env-samples 0";
    let methods = METHODS.map(Method::name).join(",");
    let distances = scale.distances.iter().map(f32::to_string).collect::<Vec<_>>().join(",");
    vec![
        format!("kinran bake materials/{name} -o baked/{name}"),
        format!(
            "kinran render {name}.glb -o {name}.png --size {} --spp {} {view}",
            size(scale.hero),
            scale.hero_samples
        ),
        format!(
            "kinran compare {name}.glb -o compare/{name} --filters {methods} --budget --size {} --spp {} --truth-spp {} \
             --most-truth-spp {} --distances {distances} {view}",
            size(scale.compared),
            scale.samples,
            scale.truth_samples,
            scale.truth_samples
        ),
    ]
}

/// The files of a folder with this extension, by name.
fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, Error> {
    let fail = |e| kinran_image::Error::io(folder, e);
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if outputs::has_extension(&path, extension) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

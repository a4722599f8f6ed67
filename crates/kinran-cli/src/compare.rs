//! `kinran compare`: one model, several filters, ground truth, and the distance between them in numbers.

use std::path::{Path, PathBuf};

use clap::builder::{PossibleValuesParser, TypedValueParser};
use kinran_bake::aniso::Filter;
use kinran_image::write_atomically;
use kinran_render::metrics::{flip, relative_l2, rmse_linear, rmse_srgb8};
use kinran_render::reference::{Film, RenderScene, ShadingRate, SurfaceTextures, TextureFiltering};
use kinran_scene::{Needs, Scene};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::budget::{Budget, Shares};
use crate::compare_sheet::{comparison_sheet, distance_sheet};
use crate::model::{model_at, read_scene};
use crate::picture::Picture;
use crate::ranking::{Errors, FLIP_BEND, Order, order};
use crate::render::MAX_ANISOTROPY;
use crate::surfaces::{Colors, Method, Mips, has_mixed, scene_surfaces};
use crate::table::table;
use crate::values::{Choices, SWITCH, choice, counted, number};
use crate::view::{Samples, View, ViewArgs, file_name, samples_of};
use crate::{Console, Error, Progress, outputs};

/// Compares filters with ground truth, in pictures and numbers
///
/// Draws the model with the mips of each filter, as a GPU would sample them after block compression, and
/// with many samples of level 0 alone, which is ground truth; nearby and from farther and farther away.
/// Under each picture stand the root mean square error (display-encoded, white being 1), the mean FLIP error
/// (Andersson et al. 2020, 67 pixels per degree) and L2, the relative error in linear light; the tables have
/// each of them also of both pictures shrunk to a quarter. All pictures have noise: a filter is marked as the
/// nearest where it leads by more than noise explains, and a sentence for each distance says what is known.
///
/// The folder then holds compare.png (side by side, with maps of the FLIP error), distance.png (a row
/// for each filter, a column for each distance, enlarged), every picture alone, and compare.json.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran compare lamp.glb -o comparison/
  kinran compare lamp.glb -o comparison/ --filters ml,ml-apart,naive \\
      --budget --truth-spp 1024 --distances 1,4,16
  kinran compare cloth.glb -o comparison/ --env none \\
      --light 1,1,1 --size 640x480 --json")]
pub struct Args {
    /// The .glb, .gltf or .obj file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for pictures and numbers [default: NAME.compare beside the input]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Filters, in the order of the columns; ml-apart is ml with colour, metalness and lobe filtered each by itself, ml-separate
    /// is ml with a specular colour too, as bakes have it with --separate-specular, and so on
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_value = "ml,linear,lean,naive",
        value_parser = method())]
    pub filters: Vec<Method>,

    /// Where filters' pictures are shaded; with pixel at its centre, samples telling what covers it
    #[arg(long, value_name = "WHERE", default_value = "pixel", value_parser = choice(SHADING))]
    pub shading: ShadingRate,

    /// Samples in a pixel of the filters' pictures at distance 1; farther away they have as many times more
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    pub spp: u32,

    /// Samples in a pixel of ground truth at distance 1; the same holds for it
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    pub truth_spp: u32,

    /// Where noise hides which filter is nearest and more samples may tell, all samples are doubled, those of ground truth up to
    /// so many
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1 << 18))]
    pub most_truth_spp: u32,

    /// The most places along a slanted pixel's footprint at which a texture is read; 1 is trilinear
    #[arg(long, value_name = "N", default_value_t = MAX_ANISOTROPY, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub max_anisotropy: u32,

    /// Distances, as factors, 1 to 64; 1 is what the main picture shows
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_value = "1,2,4,8",
        value_parser = |t: &str| number(t, 1.0..=64.0))]
    pub distances: Vec<f32>,

    /// Filters colour, metalness and lobe together, so that what reflects and what scatters stays from afar; off averages each
    /// by itself
    #[arg(long, value_name = "WHETHER", action = clap::ArgAction::Set, default_value = "on", value_parser = choice(SWITCH))]
    pub correlated: bool,

    /// Tells what each filter's error is made of: the sampler's kernel, colour apart from lobe, the lobe, compression, noise
    #[arg(long)]
    pub budget: bool,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

/// Where a pixel is shaded.
const SHADING: &Choices<ShadingRate> = &[
    (ShadingRate::Pixel, "pixel", "Once for a pixel, as games do it with multisampling"),
    (ShadingRate::Sample, "sample", "At every sample, which blurs textures a second time"),
];

/// Takes a filter by its name, or by that with `-apart` or `-separate`.
fn method() -> impl TypedValueParser<Value = Method> {
    let all = || {
        let colors = [Colors::Together, Colors::Apart, Colors::Separate].into_iter();
        colors.flat_map(|colors| Filter::ALL.map(|filter| Method::of(filter, colors)))
    };
    let names = distinct(&all().map(Method::name).collect::<Vec<_>>());
    PossibleValuesParser::new(names)
        .map(move |name| all().find(|method| method.name() == name).expect("only names pass"))
}

/// What is compared, and how carefully.
#[derive(Clone)]
pub struct Options {
    /// The filters, in the order of the columns. Where no material's maps can be filtered together, a filter that comes with and
    /// without that is drawn once.
    pub methods: Vec<Method>,
    /// Where the filters' pictures are shaded; ground truth is shaded at every sample.
    pub shading: ShadingRate,
    /// Samples in a pixel of the filters' pictures at distance 1; farther away as many times more.
    pub samples_per_pixel: u32,
    /// The same for ground truth.
    pub truth_samples_per_pixel: u32,
    /// Where noise hides which filter is nearest, samples of ground truth are doubled up to so many at distance 1, and those of
    /// the filters with them.
    pub most_truth_samples: u32,
    /// 1 to 16.
    pub max_anisotropy: u32,
    /// Factors of distance besides 1, each 1 or more.
    pub distances: Vec<f32>,
    /// Whether errors are split into what they are made of; takes about as long again.
    pub budget: bool,
    /// Camera and light at distance 1.
    pub view: View,
}

impl Options {
    /// How textures of filters are read.
    fn filtering(&self) -> TextureFiltering {
        TextureFiltering::Mips { max_anisotropy: self.max_anisotropy }
    }
}

/// How far a picture is from ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Difference {
    /// Factor of distance.
    pub distance: f32,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Of display-encoded values, white being 1.
    pub rmse: f64,
    /// Of linear radiance.
    pub rmse_linear: f64,
    /// The same relative to ground truth's root mean square.
    pub l2: f64,
    /// Mean LDR-FLIP.
    pub flip: f32,
    /// Errors of both pictures shrunk: of what does not hang on single pixels.
    pub shrunk: Shrunk,
}

/// How far a picture is from ground truth where both are shrunk to a quarter of their width and height, in linear light.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Shrunk {
    /// As [`Difference::rmse`].
    pub rmse: f64,
    /// As [`Difference::l2`].
    pub l2: f64,
    /// As [`Difference::flip`].
    pub flip: f32,
}

/// How far pictures are shrunk for [`Shrunk`]: chosen by eye, several times the width of the sampler's kernel.
const SHRINK: u32 = 4;

/// The numbers of one filter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MethodReport {
    /// The filter's name.
    pub filter: &'static str,
    /// For each distance, in the order of the options.
    pub distances: Vec<Difference>,
    /// What the errors are made of, for each distance; empty where that was not asked for.
    pub budget: Vec<Budget>,
}

/// How far two ground truths of other random numbers are apart, each of half the samples. The noise of the one that filters
/// are compared with is half of this RMSE: one of two noisy pictures has 1/sqrt(2) of their difference, and twice the samples
/// take another 1/sqrt(2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Noise {
    /// As [`Difference::rmse`].
    pub rmse: f64,
    /// As [`Difference::l2`].
    pub l2: f64,
    /// As [`Difference::flip`].
    pub flip: f32,
}

/// Who is nearest to ground truth by one measure of error.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Ranking {
    /// The filter that is nearer than all others by more than noise explains and as printed, if one is.
    pub best: Option<&'static str>,
    /// The nearest and all that noise does not allow to tell from it, in the order of the filters.
    pub nearest: Vec<&'static str>,
    /// The smallest lead over any other that would have shown, in the measure's unit.
    pub told: f64,
    /// About how many samples of ground truth, and as many times more of the filters, might tell the nearest apart; `None`
    /// where they are apart, or where it takes more than a million.
    pub samples_needed: Option<u64>,
}

/// What one distance shows.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Finding {
    /// Factor of distance.
    pub distance: f32,
    /// Samples in a pixel that the filters' pictures were drawn with.
    pub samples_per_pixel: u32,
    /// Samples in a pixel that ground truth was drawn with.
    pub truth_samples_per_pixel: u32,
    /// Filters that were compared.
    pub filters: usize,
    /// Two ground truths compared.
    pub noise: Noise,
    /// By root mean square error of display-encoded values.
    pub rmse: Ranking,
    /// By root mean square error in linear light.
    pub l2: Ranking,
    /// By mean FLIP.
    pub flip: Ranking,
    /// Whether noise explains how far every filter is from ground truth, by root mean square.
    pub only_noise: bool,
    /// All of this in a sentence.
    pub says: String,
}

/// All numbers of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Report {
    /// What was compared.
    pub title: String,
    /// Pixels in a row at distance 1.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples in a pixel of the filters' pictures at distance 1, as asked for; [`Finding`] has those that were taken.
    pub samples_per_pixel: u32,
    /// Samples in a pixel of ground truth at distance 1, as asked for.
    pub truth_samples_per_pixel: u32,
    /// One for each filter.
    pub methods: Vec<MethodReport>,
    /// One for each distance.
    pub findings: Vec<Finding>,
    /// What was left out or mended in the model.
    pub warnings: Vec<String>,
}

/// The pictures of one method.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The filter's name, or `truth`.
    pub name: &'static str,
    /// One for each distance.
    pub pictures: Vec<Picture>,
    /// The FLIP error of each pixel of each picture; empty for ground truth.
    pub errors: Vec<Vec<f32>>,
}

/// A finished comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The numbers.
    pub report: Report,
    /// Ground truth, then the filters.
    pub series: Vec<Series>,
}

impl Args {
    /// What the flags name, each once.
    fn methods(&self) -> Vec<Method> {
        let switched = |method: &Method| {
            Method::of(method.filter, if self.correlated { method.colors } else { Colors::Apart })
        };
        distinct(&self.filters.iter().map(switched).collect::<Vec<_>>())
    }
}

/// The command.
///
/// # Errors
/// One that names the file: input that cannot be read, output that cannot be written, flags that do not fit
/// the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let output = args.output.clone().unwrap_or_else(|| outputs::named_after(&args.file, ".compare"));
    outputs::check_folder(&output)?;
    let methods = args.methods();
    let series = std::iter::once("truth").chain(methods.iter().map(|method| method.name()));
    let pictures =
        series.flat_map(|name| args.distances.iter().map(move |distance| picture_file(name, *distance)));
    let pictures = pictures.chain(["compare.png".into(), "distance.png".into()]);
    let numbers = output.join("compare.json");
    if !args.view.force && std::fs::read(&numbers).is_ok_and(|text| !is_comparison(&text)) {
        let reason =
            "kinran did not write this file; name another folder with --output, or overwrite it with --force";
        return Err(Error::file_error(&numbers, reason));
    }
    args.view.refuse_inputs(&args.file, pictures.map(|picture| output.join(picture)))?;
    if let Some(method) = repeated(&args.filters) {
        let reason = format!("names {} twice; name each once", method.name());
        return Err(Error::flag_error("--filters", reason));
    }
    if let Some(distance) = repeated(&args.distances) {
        return Err(Error::flag_error("--distances", format!("has {distance} twice; name each once")));
    }
    let file = model_at(&args.file)?;
    let scene = read_scene(&file, &args.view.model, &Needs::ALL, &console.progress())?;
    args.view.refuse_idle(&scene, &file.to_string_lossy())?;
    if Mips::of(&scene) == Mips::Baked {
        console.note("the model is baked already: ground truth is level 0 of its own textures, and filters begin there");
    }
    let view = View::new(&scene, &file.to_string_lossy(), &args.view)?;
    let options = Options {
        methods,
        shading: args.shading,
        samples_per_pixel: args.spp,
        truth_samples_per_pixel: args.truth_spp,
        most_truth_samples: args.most_truth_spp,
        max_anisotropy: args.max_anisotropy,
        distances: distinct(&args.distances),
        budget: args.budget,
        view,
    };
    let comparison = compare(&scene, &file_name(&file), &options, &console.progress())?;
    comparison.report.warnings.iter().for_each(|w| console.warn(w));
    comparison.write(&output)?;
    let text = format!("{}\nPictures and numbers are in {}", comparison.table(), output.display());
    console.result(&comparison.report, &text)?;
    outputs::tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

/// What there is to say of a model that looks the same with every filter.
const NO_MAPS: &str = "no material has a normal, roughness or anisotropy map: there is nothing to filter, and all filters draw \
                       the same";

/// The name of a picture of a filter or of ground truth.
pub(crate) fn picture_file(series: &str, distance: f32) -> String {
    format!("{series}_x{distance}.png")
}

/// Whether a text is the numbers of a comparison.
fn is_comparison(text: &[u8]) -> bool {
    let json: Option<serde_json::Value> = serde_json::from_slice(text).ok();
    json.is_some_and(|json| ["methods", "findings"].iter().all(|member| json.get(member).is_some()))
}

/// The first value that stands there again.
fn repeated<T: PartialEq>(values: &[T]) -> Option<&T> {
    values.iter().enumerate().find(|(i, value)| values[..*i].contains(value)).map(|(_, value)| value)
}

/// The values without repetitions, in their order.
fn distinct<T: PartialEq + Clone>(values: &[T]) -> Vec<T> {
    let mut kept = Vec::new();
    for value in values {
        if !kept.contains(value) {
            kept.push(value.clone());
        }
    }
    kept
}

/// Renders `scene` with each filter and as ground truth, at every distance, and measures. `title` names the
/// scene in the pictures. Every picture is drawn in two halves of independent samples, which tell what noise is worth; where
/// it hides which filter is nearest, samples are doubled, as far as [`Options::most_truth_samples`] allows.
///
/// # Errors
/// [`Error::Usage`] where there is no filter or no distance; those of the baker and of the renderer.
pub fn compare(
    scene: &Scene,
    title: &str,
    options: &Options,
    progress: &Progress,
) -> Result<Comparison, Error> {
    if options.methods.is_empty() || options.distances.is_empty() {
        return Err(Error::Usage(format!("{title}: nothing to compare; give a filter and a distance")));
    }
    let methods = different(scene, &options.methods);
    let distances = &options.distances;
    let views: Vec<View> = distances.iter().map(|&d| options.view.zoomed_out(d)).collect();
    // A pixel far away covers more of the model and needs more samples.
    let half = |samples: u32, distance: f32| ((samples as f32 * distance) as u32).div_ceil(2);
    // Samples of a half that are drawn next: as many as there are, or the first.
    let next = |taken: &[Taken], samples: u32, i: usize| {
        taken.get(i).map_or_else(|| half(samples, distances[i]), |taken| taken.of_half)
    };
    let all = (!progress.has_overall()).then(|| progress.busy("comparing"));
    let progress = &all.as_ref().map_or_else(|| progress.clone(), |all| progress.overall(all));
    // All the pictures of one method that are still wanted.
    let draw = |taken: &mut Vec<Taken>, prepared: &RenderScene, mips: Mips, open: &[usize]| {
        let (samples, shading, filtering) = match mips {
            Mips::Level0 => (options.truth_samples_per_pixel, ShadingRate::Sample, TextureFiltering::Level0),
            _ => (options.samples_per_pixel, options.shading, options.filtering()),
        };
        for &i in open {
            let name = format!("{}, distance {}", mips.name(), distances[i]);
            let first = taken.get(i).map_or(0, |taken| taken.of_half);
            let samples = Samples { first, count: next(taken, samples, i), seed: 0, shading };
            let more = Taken::new(&views[i], prepared, &name, samples, filtering, progress)?;
            match taken.get_mut(i) {
                Some(taken) => taken.add(&more),
                None => taken.push(more),
            }
        }
        Ok::<(), Error>(())
    };

    let (surfaces, apart) = scene_surfaces(scene, Mips::Level0, progress)?;
    let told = scene.warnings.iter().chain(options.view.environment_notes()).cloned();
    let bare = surfaces.iter().all(Option::is_none).then(|| NO_MAPS.to_owned());
    let mut warnings: Vec<String> = told.chain(apart).chain(bare).collect();
    let mut prepared = options.view.scene(scene, surfaces, progress)?;
    let mut truth = Vec::new();
    let mut drawn: Vec<Vec<Taken>> = vec![Vec::new(); methods.len()];
    let mut measured: Vec<Vec<Measured>> = drawn.iter().map(|_| Vec::new()).collect();
    let mut findings: Vec<Finding> = Vec::new();
    let mut open: Vec<usize> = (0..distances.len()).collect();
    while !open.is_empty() {
        let samples = |i: usize| {
            let samples = |taken: &[Taken], first| samples_of(views[i].size, 2 * next(taken, first, i));
            let of_filter = |drawn: &Vec<Taken>| samples(drawn, options.samples_per_pixel);
            let of_truth = samples(&truth, options.truth_samples_per_pixel);
            of_truth + drawn.iter().map(of_filter).sum::<u64>()
        };
        if let Some(all) = &all {
            all.expect(open.iter().map(|&i| samples(i)).sum());
        }
        if !findings.is_empty() {
            set_surfaces(&mut prepared, scene_surfaces(scene, Mips::Level0, progress)?.0);
        }
        draw(&mut truth, &prepared, Mips::Level0, &open)?;
        for (method, mips) in methods.iter().copied().map(Mips::Filtered).enumerate() {
            let (surfaces, apart) = scene_surfaces(scene, mips, progress)?;
            warnings.extend(apart);
            set_surfaces(&mut prepared, surfaces);
            draw(&mut drawn[method], &prepared, mips, &open)?;
            for &i in &open {
                let distance = distances[i];
                put(
                    &mut measured[method],
                    i,
                    measure(&options.view, distance, &truth[i], &drawn[method][i])?,
                );
            }
        }
        for &i in &open {
            let errors: Vec<&Measured> = measured.iter().map(|of| &of[i]).collect();
            put(&mut findings, i, find(options, &methods, &truth[i], &drawn[0][i], &errors)?);
        }
        // Samples are doubled where that may be enough.
        open.retain(|&i| {
            let most = f64::from(options.most_truth_samples) * f64::from(distances[i]);
            let taken = f64::from(findings[i].truth_samples_per_pixel);
            let Finding { rmse, l2, flip, .. } = &findings[i];
            let wanted = [rmse, l2, flip].map(Ranking::wanted_samples);
            2.0 * taken <= most && wanted.into_iter().flatten().any(|samples| samples as f64 <= most)
        });
    }

    let mut budgets = vec![Vec::new(); methods.len()];
    if options.budget {
        let steps = Steps { scene, options, methods: &methods, views: &views, progress };
        budgets = steps.budgets(&mut prepared, &truth, &drawn, &measured)?;
    }

    let pictures = |taken: &[Taken]| -> Vec<Picture> {
        taken.iter().map(|taken| picture(&options.view, &taken.whole())).collect()
    };
    let mut series =
        vec![Series { name: Mips::Level0.name(), pictures: pictures(&truth), errors: Vec::new() }];
    let mut reports = Vec::new();
    for (((method, taken), measured), budget) in methods.iter().zip(&drawn).zip(measured).zip(budgets) {
        let (differences, errors) = measured.into_iter().map(|m| (m.difference, m.map)).unzip();
        reports.push(MethodReport { filter: method.name(), distances: differences, budget });
        series.push(Series { name: method.name(), pictures: pictures(taken), errors });
    }
    let report = Report {
        title: title.into(),
        width: options.view.size.0,
        height: options.view.size.1,
        samples_per_pixel: options.samples_per_pixel,
        truth_samples_per_pixel: options.truth_samples_per_pixel,
        methods: reports,
        findings,
        warnings: distinct(&warnings),
    };
    Ok(Comparison { report, series })
}

/// The methods that draw different pictures: where no material's maps are filtered together, with and without that is the same.
fn different(scene: &Scene, methods: &[Method]) -> Vec<Method> {
    if has_mixed(scene) {
        return methods.to_vec();
    }
    distinct(&methods.iter().map(|method| Method::new(method.filter, true)).collect::<Vec<_>>())
}

/// What stands under tables.
pub(crate) fn footnote<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> &'static str {
    match findings.into_iter().any(|finding| finding.rankings().iter().any(|ranking| ranking.best.is_some()))
    {
        true => {
            "The nearest to ground truth is marked where it leads by more than noise explains. \
             \"Noise\" is two ground truths of half the samples compared."
        }
        false => "\"Noise\" is two ground truths of half the samples compared.",
    }
}

/// The value at `index`, which is one that is there or the next.
fn put<T>(values: &mut Vec<T>, index: usize, value: T) {
    match values.get_mut(index) {
        Some(old) => *old = value,
        None => values.push(value),
    }
}

fn set_surfaces(prepared: &mut RenderScene, surfaces: Vec<Option<SurfaceTextures>>) {
    for (material, surface) in prepared.materials.iter_mut().zip(surfaces) {
        material.surface = surface;
    }
}

/// A picture in two halves of independent samples.
#[derive(Clone)]
struct Taken {
    halves: [Film; 2],
    /// Samples of a pixel in each.
    of_half: u32,
}

impl Taken {
    /// Both halves, each of so many samples; of other seeds.
    fn new(
        view: &View,
        prepared: &RenderScene,
        name: &str,
        samples: Samples,
        filtering: TextureFiltering,
        progress: &Progress,
    ) -> Result<Self, Error> {
        let half =
            |seed| view.render_samples(prepared, name, Samples { seed, ..samples }, filtering, progress);
        Ok(Taken { halves: [half(1)?, half(2)?], of_half: samples.first + samples.count })
    }

    /// As many samples more.
    fn add(&mut self, more: &Taken) {
        for (film, more) in self.halves.iter_mut().zip(&more.halves) {
            *film = mean(film, more);
        }
        self.of_half = more.of_half;
    }

    /// The picture of all samples.
    fn whole(&self) -> Film {
        mean(&self.halves[0], &self.halves[1])
    }
}

fn mean(a: &Film, b: &Film) -> Film {
    let pixels = a.pixels.iter().zip(&b.pixels);
    Film { pixels: pixels.map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))).collect(), ..*a }
}

fn picture(view: &View, film: &Film) -> Picture {
    Picture { width: film.width, height: film.height, pixels: view.display(film) }
}

/// What is known of one filter's picture.
struct Measured {
    difference: Difference,
    /// FLIP, pixel by pixel.
    map: Vec<f32>,
    /// Squares of display-encoded differences, squares in linear light, and FLIP.
    squares: Errors,
    linear: Errors,
    flip: Errors,
    /// Mean square of ground truth in linear light.
    truth: f64,
}

fn measure(view: &View, distance: f32, truth: &Taken, taken: &Taken) -> Result<Measured, Error> {
    let (truth_film, film) = (truth.whole(), taken.whole());
    let (width, height) = (film.width, film.height);
    let pairs =
        [(&truth.halves[0], &taken.halves[0]), (&truth.halves[1], &taken.halves[1]), (&truth_film, &film)];
    let errors = pairs.into_par_iter().map(|(truth, film)| {
        let (wanted, got) = (view.display(truth), view.display(film));
        let linear = squares(&truth.pixels, &film.pixels, |c| c);
        let display = squares(&wanted, &got, |c| f32::from(c) / 255.0);
        Ok((display, flip(&wanted, &got, width, height)?, linear))
    });
    let [a, b, whole] = <[_; 3]>::try_from(errors.collect::<Result<Vec<_>, Error>>()?).expect("three pairs");
    let rmse = (whole.0.iter().map(|&e| f64::from(e)).sum::<f64>() / whole.0.len() as f64).sqrt();
    let [small_truth, small] = [&truth_film, &film].map(|film| film.shrunk(SHRINK));
    let [wanted, got] = [&small_truth, &small].map(|film| view.display(film));
    let black = vec![[0.0; 3]; truth_film.pixels.len()];
    Ok(Measured {
        difference: Difference {
            distance,
            width,
            height,
            rmse,
            rmse_linear: rmse_linear(&truth_film.pixels, &film.pixels)?,
            l2: relative_l2(&truth_film.pixels, &film.pixels)?,
            flip: whole.1.mean,
            shrunk: Shrunk {
                rmse: rmse_srgb8(&wanted, &got)?,
                l2: relative_l2(&small_truth.pixels, &small.pixels)?,
                flip: flip(&wanted, &got, small.width, small.height)?.mean,
            },
        },
        truth: rmse_linear(&truth_film.pixels, &black)?.powi(2),
        linear: Errors::new(width as usize, [&a.2, &b.2], &whole.2),
        squares: Errors::new(width as usize, [&a.0, &b.0], &whole.0),
        flip: Errors::new(width as usize, [&a.1.map, &b.1.map], &whole.1.map),
        map: whole.1.map,
    })
}

/// What pictures lose one after the other, see [`crate::budget`].
struct Steps<'a> {
    scene: &'a Scene,
    options: &'a Options,
    methods: &'a [Method],
    /// One for each distance.
    views: &'a [View],
    progress: &'a Progress,
}

impl Steps<'_> {
    /// What the errors of each method are made of, at each distance.
    fn budgets(
        &self,
        prepared: &mut RenderScene,
        truth: &[Taken],
        drawn: &[Vec<Taken>],
        measured: &[Vec<Measured>],
    ) -> Result<Vec<Vec<Budget>>, Error> {
        let texels = |lobes_only| TextureFiltering::Texels {
            max_anisotropy: self.options.max_anisotropy,
            lobes_only,
            sample: [0; 2],
        };
        // Noise is taken off: fewer samples than those of ground truth will do.
        let few: Vec<u32> = truth.iter().map(|taken| taken.of_half.div_ceil(8)).collect();
        let kernel = self.errors(prepared, Mips::Level0, texels(false), &few, truth)?;
        let mut colors: Vec<(Colors, Vec<[f64; 2]>)> = Vec::new();
        let mut budgets = Vec::new();
        for (method, (drawn, measured)) in self.methods.iter().zip(drawn.iter().zip(measured)) {
            if colors.iter().all(|(of, _)| *of != method.colors) {
                let mips = Mips::Colors(method.colors);
                colors.push((method.colors, self.errors(prepared, mips, texels(true), &few, truth)?));
            }
            let colors = colors.iter().find(|(of, _)| *of == method.colors).map(|(_, errors)| errors);
            let samples: Vec<u32> = drawn.iter().map(|taken| taken.of_half).collect();
            let mips = Mips::Uncompressed(*method);
            let float = self.errors(prepared, mips, self.options.filtering(), &samples, truth)?;
            let budget = measured.iter().enumerate().map(|(i, measured)| {
                let shares = |by: usize, errors: &Errors| {
                    let steps = [kernel[i][by], colors.map_or(0.0, |colors| colors[i][by]), float[i][by]];
                    let [kernel, color, float] = steps;
                    Shares::new([kernel, color, float, errors.quiet_mean()], errors.mean())
                };
                let (rmse, l2) = (shares(0, &measured.squares), shares(1, &measured.linear));
                Budget::new(method.name(), measured.difference.distance, rmse, l2)
            });
            budgets.push(budget.collect());
        }
        Ok(budgets)
    }

    /// Mean squared errors of other pictures, without noise: display-encoded and in linear light, for each distance.
    fn errors(
        &self,
        prepared: &mut RenderScene,
        mips: Mips,
        filtering: TextureFiltering,
        samples: &[u32],
        truth: &[Taken],
    ) -> Result<Vec<[f64; 2]>, Error> {
        set_surfaces(prepared, scene_surfaces(self.scene, mips, self.progress)?.0);
        let places = self.views.iter().zip(samples).zip(truth);
        let errors = places.map(|((view, &count), truth)| {
            let samples = Samples { first: 0, count, seed: 0, shading: self.options.shading };
            let taken = Taken::new(view, prepared, "budget", samples, filtering, self.progress)?;
            let Measured { squares, linear, .. } = measure(view, 0.0, truth, &taken)?;
            Ok([squares.quiet_mean(), linear.quiet_mean()])
        });
        errors.collect()
    }
}

/// The mean square difference over the channels of each pixel, in the unit of `value`.
fn squares<T: Copy>(a: &[[T; 3]], b: &[[T; 3]], value: impl Fn(T) -> f32) -> Vec<f32> {
    let square = |a: T, b: T| (value(a) - value(b)).powi(2);
    let pixels = a.iter().zip(b);
    pixels.map(|(a, b)| (0..3).map(|c| square(a[c], b[c])).sum::<f32>() / 3.0).collect()
}

/// What one distance shows; `errors` are of each filter, `truth` and `drawn` of ground truth and any filter.
fn find(
    options: &Options,
    methods: &[Method],
    truth: &Taken,
    drawn: &Taken,
    errors: &[&Measured],
) -> Result<Finding, Error> {
    let [a, b] = [0, 1].map(|half| options.view.display(&truth.halves[half]));
    let Difference { distance, width, height, .. } = errors[0].difference;
    let [film_a, film_b] = &truth.halves;
    let noise = Noise {
        rmse: rmse_srgb8(&a, &b)?,
        l2: relative_l2(&film_a.pixels, &film_b.pixels)?,
        flip: flip(&a, &b, width, height)?.mean,
    };
    let squares: Vec<&Errors> = errors.iter().map(|m| &m.squares).collect();
    let only_noise = squares.iter().all(|errors| errors.is_noise());
    let ranking = |order: Order, printed: Vec<f64>, unit: &dyn Fn(f64) -> f64| {
        // What looks equal is equally good.
        let digits = |x: f64| (x * 1e4).round();
        let is_near = |&i: &usize| {
            i == order.first || order.alike.contains(&i) || digits(printed[i]) <= digits(printed[order.first])
        };
        let nearest: Vec<&str> = (0..printed.len()).filter(is_near).map(|i| methods[i].name()).collect();
        let needed = order.samples * f64::from(2 * truth.of_half);
        Ranking {
            best: (nearest.len() == 1 && printed.len() > 1).then(|| nearest[0]),
            told: unit(order.told),
            samples_needed: (!order.alike.is_empty() && needed <= MOST_SAMPLES).then_some(needed as u64),
            nearest,
        }
    };
    let flips: Vec<&Errors> = errors.iter().map(|m| &m.flip).collect();
    let by_squares = order(&squares, 0.0);
    let first = errors[by_squares.first].difference.rmse;
    let root = |square: f64| (first * first + square).sqrt() - first;
    let linear: Vec<&Errors> = errors.iter().map(|m| &m.linear).collect();
    let by_linear = order(&linear, 0.0);
    let (first_l2, truth_square) =
        (errors[by_linear.first].difference.l2, errors[0].truth.max(f64::MIN_POSITIVE));
    let relative = |square: f64| (first_l2 * first_l2 + square / truth_square).sqrt() - first_l2;
    let mut finding = Finding {
        distance,
        samples_per_pixel: 2 * drawn.of_half,
        truth_samples_per_pixel: 2 * truth.of_half,
        filters: errors.len(),
        noise,
        rmse: ranking(by_squares, errors.iter().map(|m| m.difference.rmse).collect(), &root),
        l2: ranking(by_linear, errors.iter().map(|m| m.difference.l2).collect(), &relative),
        flip: ranking(
            order(&flips, FLIP_BEND),
            errors.iter().map(|m| m.difference.flip.into()).collect(),
            &|flip| flip,
        ),
        only_noise,
        says: String::new(),
    };
    finding.says = finding.sentence();
    Ok(finding)
}

/// The most samples of a pixel that are drawn; more are of no use to name.
const MOST_SAMPLES: f64 = 1_048_576.0;

/// Leads below this are not worth more samples: an eighth of a step of 8 bits.
const NEGLIGIBLE: f64 = 5e-4;

impl Ranking {
    /// The samples that would tell which filter is nearest, where that is not known, is worth knowing, and can be.
    fn wanted_samples(&self) -> Option<u64> {
        self.samples_needed.filter(|_| self.told > NEGLIGIBLE)
    }

    /// What it says, of so many filters.
    fn phrase(&self, filters: usize) -> String {
        let who = match self.nearest.as_slice() {
            [one] => return format!("{one} is nearest"),
            all if all.len() == filters && filters > 2 => "all filters are alike".into(),
            [rest @ .., last] => {
                let nearer = if rest.len() + 1 == filters { "alike" } else { "nearest and alike" };
                format!("{} and {last} are {nearer}", rest.join(", "))
            }
            [] => unreachable!("one is nearest"),
        };
        let needed = match self.samples_needed {
            Some(samples) => format!(", about {} samples might tell", rounded(samples)),
            None => String::new(),
        };
        format!("{who} (a lead of {:.4} would show{needed})", self.told)
    }
}

impl Finding {
    /// In the order of the table's columns.
    pub(crate) fn rankings(&self) -> [&Ranking; 3] {
        [&self.rmse, &self.l2, &self.flip]
    }

    /// What the numbers of this distance show, in a sentence.
    fn sentence(&self) -> String {
        let filters = self.filters;
        let samples = self.truth_samples_per_pixel;
        let head = format!(
            "Distance {}, {} of ground truth:",
            self.distance,
            counted(samples as usize, "sample", "samples")
        );
        let [rmse, l2, flip] = self.rankings().map(|ranking| ranking.phrase(filters));
        match (filters, self.only_noise) {
            (1, true) => format!("{head} {} is off by noise alone.", self.rmse.nearest[0]),
            (1, false) => format!("{head} {} is off by more than noise.", self.rmse.nearest[0]),
            (_, true) if self.l2.best.is_none() && self.flip.best.is_none() => {
                format!(
                    "{head} no difference from it, nor between filters, that so many can show; errors are noise."
                )
            }
            _ if self.rmse.best.is_some() && rmse == l2 && l2 == flip => {
                format!("{head} by RMSE, L2 and FLIP {rmse}.")
            }
            _ => format!("{head} by RMSE {rmse}; by L2 {l2}; by FLIP {flip}."),
        }
    }
}

/// Two digits, as an estimate deserves.
fn rounded(number: u64) -> u64 {
    let step = 10u64.pow(number.max(1).ilog10().saturating_sub(1));
    number.div_ceil(step) * step
}

impl Comparison {
    /// Ground truth and the filters side by side at the first distance, with numbers and maps of the error.
    pub fn sheet(&self) -> Picture {
        comparison_sheet(self)
    }

    /// A row for each method, a column for each distance, all enlarged to the size of the nearest.
    pub fn distance_sheet(&self) -> Picture {
        distance_sheet(self)
    }

    /// The numbers as tables, one for each distance: the errors of each filter, those of the nearest with a star where noise
    /// allows to say so, and of pictures shrunk four times; then a sentence for each distance.
    pub fn table(&self) -> String {
        let findings = &self.report.findings;
        let mut text = String::new();
        for (i, finding) in findings.iter().enumerate() {
            let heading = format!("distance {}", finding.distance);
            let columns = ["RMSE", "L2", "FLIP", "1/4: RMSE", "L2", "FLIP"].map(str::to_owned);
            let mut rows = vec![std::iter::once(heading).chain(columns).collect::<Vec<_>>()];
            for method in &self.report.methods {
                let d = &method.distances[i];
                let errors = [d.rmse, d.l2, d.flip.into()].into_iter().zip(finding.rankings());
                let starred = errors.map(|(error, ranking)| {
                    let star = if ranking.best == Some(method.filter) { "*" } else { "" };
                    format!("{star}{error:.4}")
                });
                let shrunk = [d.shrunk.rmse, d.shrunk.l2, d.shrunk.flip.into()];
                let shrunk = shrunk.map(|error| format!("{error:.4}"));
                rows.push(std::iter::once(method.filter.to_owned()).chain(starred).chain(shrunk).collect());
            }
            let Noise { rmse, l2, flip } = finding.noise;
            let noise = [rmse, l2, flip.into()].map(|noise| format!("{noise:.4}"));
            rows.push(std::iter::once("noise".to_owned()).chain(noise).collect());
            text += &format!("{}\n", table(&rows));
        }
        let says: String = findings.iter().map(|finding| format!("{}\n", finding.says)).collect();
        let budgets = self.report.methods.iter().flat_map(|method| &method.budget);
        let budgets: String = budgets.map(|budget| format!("{}\n", budget.says)).collect();
        format!("{text}{says}{budgets}{}\n", footnote(findings))
    }

    /// Writes `compare.png`, `distance.png`, every picture alone and `compare.json` to `folder`, which
    /// is made if it does not exist. Each file appears whole or not at all.
    ///
    /// # Errors
    /// [`Error::Image`] where the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        kinran_image::make_folder(folder)?;
        for series in &self.series {
            for (picture, difference) in series.pictures.iter().zip(&self.report.methods[0].distances) {
                picture.write(&folder.join(picture_file(series.name, difference.distance)))?;
            }
        }
        self.sheet().write(&folder.join("compare.png"))?;
        self.distance_sheet().write(&folder.join("distance.png"))?;
        let json = serde_json::to_string_pretty(&self.report).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(write_atomically(&folder.join("compare.json"), format!("{json}\n").as_bytes())?)
    }
}

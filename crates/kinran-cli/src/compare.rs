//! `kinran compare`: one model, several filters, ground truth, and the distance between them in numbers.

use std::path::{Path, PathBuf};

use kinran_bake::aniso::Filter;
use kinran_image::write_atomically;
use kinran_render::metrics::{flip, rmse_linear, rmse_srgb8};
use kinran_render::reference::{Film, RenderScene, SurfaceTextures, TextureFiltering};
use kinran_scene::{Needs, Scene};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use crate::compare_sheet::{comparison_sheet, distance_sheet};
use crate::model::{model_at, read_scene};
use crate::picture::Picture;
use crate::ranking::{Errors, FLIP_BEND, Order, order};
use crate::surfaces::{Mips, scene_surfaces};
use crate::table::table;
use crate::values::{counted, filter, number};
use crate::view::{Samples, View, ViewArgs, file_name, samples_of};
use crate::{Console, Error, Progress, outputs};

/// Compares filters with ground truth, in pictures and numbers
///
/// Draws the model with the mips of each filter, as a GPU would sample them after block compression, and
/// with many samples of level 0 alone, which is ground truth; nearby and from farther and farther away.
/// Under each picture stand the root mean square error (display-encoded, white being 1) and the mean FLIP
/// error (Andersson et al. 2020, 67 pixels per degree). All pictures have noise: a filter is marked as the
/// nearest where it leads by more than noise explains, and a sentence for each distance says what is known.
///
/// The folder then holds compare.png (side by side, with maps of the FLIP error), distance.png (a row
/// for each filter, a column for each distance, enlarged), every picture alone, and compare.json.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran compare lamp.glb -o comparison/
  kinran compare lamp.glb -o comparison/ --filters ml,naive \\
      --truth-spp 1024 --distances 1,4,16
  kinran compare cloth.glb -o comparison/ --env none \\
      --light 1,1,1 --size 640x480 --json")]
pub struct Args {
    /// The .glb, .gltf or .obj file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for pictures and numbers [default: NAME.compare beside the input]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Filters, in the order of the columns
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_value = "ml,linear,lean,naive",
        value_parser = filter())]
    pub filters: Vec<Filter>,

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
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=16))]
    pub max_anisotropy: u32,

    /// Distances, as factors, 1 to 64; 1 is what the main picture shows
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_value = "1,2,4,8",
        value_parser = |t: &str| number(t, 1.0..=64.0))]
    pub distances: Vec<f32>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub view: ViewArgs,
}

/// What is compared, and how carefully.
#[derive(Clone)]
pub struct Options {
    /// The filters, in the order of the columns.
    pub filters: Vec<Filter>,
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
    /// Camera and light at distance 1.
    pub view: View,
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
    /// Mean LDR-FLIP.
    pub flip: f32,
}

/// The numbers of one filter.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct MethodReport {
    /// The filter's name.
    pub filter: &'static str,
    /// For each distance, in the order of the options.
    pub distances: Vec<Difference>,
}

/// How far two ground truths of other random numbers are apart, each of half the samples. The noise of the one that filters
/// are compared with is half of this RMSE: one of two noisy pictures has 1/sqrt(2) of their difference, and twice the samples
/// take another 1/sqrt(2).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Noise {
    /// As [`Difference::rmse`].
    pub rmse: f64,
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

/// The command.
///
/// # Errors
/// One that names the file: input that cannot be read, output that cannot be written, flags that do not fit
/// the file.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let output = args.output.clone().unwrap_or_else(|| outputs::named_after(&args.file, ".compare"));
    outputs::check_folder(&output)?;
    let series = std::iter::once("truth").chain(args.filters.iter().map(|filter| filter.name()));
    let pictures =
        series.flat_map(|name| args.distances.iter().map(move |distance| picture_file(name, *distance)));
    let pictures = pictures.chain(["compare.png".into(), "distance.png".into()]);
    args.view.refuse_inputs(&args.file, pictures.map(|picture| output.join(picture)))?;
    let file = model_at(&args.file)?;
    let scene = read_scene(&file, &args.view.model, &Needs::ALL, &console.progress())?;
    let view = View::new(&scene, &file.to_string_lossy(), &args.view)?;
    let options = Options {
        filters: distinct(&args.filters),
        samples_per_pixel: args.spp,
        truth_samples_per_pixel: args.truth_spp,
        most_truth_samples: args.most_truth_spp,
        max_anisotropy: args.max_anisotropy,
        distances: distinct(&args.distances),
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
fn picture_file(series: &str, distance: f32) -> String {
    format!("{series}_x{distance}.png")
}

/// The values without repetitions, in their order.
fn distinct<T: PartialEq + Copy>(values: &[T]) -> Vec<T> {
    let mut kept = Vec::new();
    for value in values {
        if !kept.contains(value) {
            kept.push(*value);
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
    if options.filters.is_empty() || options.distances.is_empty() {
        return Err(Error::Usage(format!("{title}: nothing to compare; give a filter and a distance")));
    }
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
        let (samples, filtering) = match mips {
            Mips::Level0 => (options.truth_samples_per_pixel, TextureFiltering::Level0),
            _ => {
                (options.samples_per_pixel, TextureFiltering::Mips { max_anisotropy: options.max_anisotropy })
            }
        };
        for &i in open {
            let name = format!("{}, distance {}", mips.name(), distances[i]);
            let first = taken.get(i).map_or(0, |taken| taken.of_half);
            let count = next(taken, samples, i);
            let half = |seed| {
                let samples = Samples { first, count, seed };
                views[i].render_samples(prepared, &name, samples, filtering, progress)
            };
            let more = Taken { halves: [half(1)?, half(2)?], of_half: first + count };
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
    let warnings = told.chain(apart).chain(bare).collect();
    let mut prepared = options.view.scene(scene, surfaces, progress)?;
    let mut truth = Vec::new();
    let mut drawn: Vec<Vec<Taken>> = vec![Vec::new(); options.filters.len()];
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
        for (method, &filter) in options.filters.iter().enumerate() {
            let mips = Mips::Filtered(filter);
            set_surfaces(&mut prepared, scene_surfaces(scene, mips, progress)?.0);
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
            put(&mut findings, i, find(options, &truth[i], &drawn[0][i], &errors)?);
        }
        // Samples are doubled where that may be enough.
        open.retain(|&i| {
            let most = f64::from(options.most_truth_samples) * f64::from(distances[i]);
            let taken = f64::from(findings[i].truth_samples_per_pixel);
            let wanted = [&findings[i].rmse, &findings[i].flip].map(Ranking::wanted_samples);
            2.0 * taken <= most && wanted.into_iter().flatten().any(|samples| samples as f64 <= most)
        });
    }

    let pictures = |taken: &[Taken]| -> Vec<Picture> {
        taken.iter().map(|taken| picture(&options.view, &taken.whole())).collect()
    };
    let mut series =
        vec![Series { name: Mips::Level0.name(), pictures: pictures(&truth), errors: Vec::new() }];
    let mut methods = Vec::new();
    for ((filter, taken), measured) in options.filters.iter().zip(&drawn).zip(measured) {
        let (differences, errors) = measured.into_iter().map(|m| (m.difference, m.map)).unzip();
        methods.push(MethodReport { filter: filter.name(), distances: differences });
        series.push(Series { name: filter.name(), pictures: pictures(taken), errors });
    }
    let report = Report {
        title: title.into(),
        width: options.view.size.0,
        height: options.view.size.1,
        samples_per_pixel: options.samples_per_pixel,
        truth_samples_per_pixel: options.truth_samples_per_pixel,
        methods,
        findings,
        warnings,
    };
    Ok(Comparison { report, series })
}

/// What stands under tables.
pub(crate) fn footnote<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> &'static str {
    match findings.into_iter().any(|finding| finding.rmse.best.or(finding.flip.best).is_some()) {
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
    /// Squares of display-encoded differences, and FLIP.
    squares: Errors,
    flip: Errors,
}

fn measure(view: &View, distance: f32, truth: &Taken, taken: &Taken) -> Result<Measured, Error> {
    let (truth_film, film) = (truth.whole(), taken.whole());
    let (width, height) = (film.width, film.height);
    let pairs =
        [(&truth.halves[0], &taken.halves[0]), (&truth.halves[1], &taken.halves[1]), (&truth_film, &film)];
    let errors = pairs.into_par_iter().map(|(truth, film)| {
        let (wanted, got) = (view.display(truth), view.display(film));
        Ok((squares(&wanted, &got), flip(&wanted, &got, width, height)?))
    });
    let [a, b, whole] = <[_; 3]>::try_from(errors.collect::<Result<Vec<_>, Error>>()?).expect("three pairs");
    let rmse = (whole.0.iter().map(|&e| f64::from(e)).sum::<f64>() / whole.0.len() as f64).sqrt();
    Ok(Measured {
        difference: Difference {
            distance,
            width,
            height,
            rmse,
            rmse_linear: rmse_linear(&truth_film.pixels, &film.pixels)?,
            flip: whole.1.mean,
        },
        squares: Errors::new(width as usize, [&a.0, &b.0], &whole.0),
        flip: Errors::new(width as usize, [&a.1.map, &b.1.map], &whole.1.map),
        map: whole.1.map,
    })
}

/// The mean square over the channels of each pixel, black to white being 1.
fn squares(a: &[[u8; 3]], b: &[[u8; 3]]) -> Vec<f32> {
    let square = |a: u8, b: u8| ((f32::from(a) - f32::from(b)) / 255.0).powi(2);
    let pixels = a.iter().zip(b);
    pixels.map(|(a, b)| (0..3).map(|c| square(a[c], b[c])).sum::<f32>() / 3.0).collect()
}

/// What one distance shows; `errors` are of each filter, `truth` and `drawn` of ground truth and any filter.
fn find(options: &Options, truth: &Taken, drawn: &Taken, errors: &[&Measured]) -> Result<Finding, Error> {
    let [a, b] = [0, 1].map(|half| options.view.display(&truth.halves[half]));
    let Difference { distance, width, height, .. } = errors[0].difference;
    let noise = Noise { rmse: rmse_srgb8(&a, &b)?, flip: flip(&a, &b, width, height)?.mean };
    let squares: Vec<&Errors> = errors.iter().map(|m| &m.squares).collect();
    let only_noise = squares.iter().all(|errors| errors.is_noise());
    let ranking = |order: Order, printed: Vec<f64>, unit: &dyn Fn(f64) -> f64| {
        // What looks equal is equally good.
        let digits = |x: f64| (x * 1e4).round();
        let is_near = |&i: &usize| {
            i == order.first || order.alike.contains(&i) || digits(printed[i]) <= digits(printed[order.first])
        };
        let nearest: Vec<&str> =
            (0..printed.len()).filter(is_near).map(|i| options.filters[i].name()).collect();
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
    let mut finding = Finding {
        distance,
        samples_per_pixel: 2 * drawn.of_half,
        truth_samples_per_pixel: 2 * truth.of_half,
        filters: errors.len(),
        noise,
        rmse: ranking(by_squares, errors.iter().map(|m| m.difference.rmse).collect(), &root),
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
    /// What the numbers of this distance show, in a sentence.
    fn sentence(&self) -> String {
        let filters = self.filters;
        let samples = self.truth_samples_per_pixel;
        let head = format!(
            "Distance {}, {} of ground truth:",
            self.distance,
            counted(samples as usize, "sample", "samples")
        );
        let [rmse, flip] = [&self.rmse, &self.flip].map(|ranking| ranking.phrase(filters));
        match (filters, self.only_noise) {
            (1, true) => format!("{head} {} is off by noise alone.", self.rmse.nearest[0]),
            (1, false) => format!("{head} {} is off by more than noise.", self.rmse.nearest[0]),
            (_, true) if self.flip.best.is_none() => {
                format!(
                    "{head} no difference from it, nor between filters, that so many can show; errors are noise."
                )
            }
            _ if self.rmse.best.is_some() && rmse == flip => format!("{head} by RMSE and FLIP {rmse}."),
            _ => format!("{head} by RMSE {rmse}; by FLIP {flip}."),
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

    /// The numbers as a table: RMSE and FLIP for each filter and distance, those of the nearest filter with a star where noise
    /// allows to say so, and a sentence for each distance.
    pub fn table(&self) -> String {
        let findings = &self.report.findings;
        let mut rows = vec![vec!["filter".into()]];
        for finding in findings {
            rows[0].push(format!("RMSE x{}", finding.distance));
            rows[0].push(format!("FLIP x{}", finding.distance));
        }
        for method in &self.report.methods {
            let mut row = vec![method.filter.to_owned()];
            for (d, finding) in method.distances.iter().zip(findings) {
                for (error, ranking) in [(d.rmse, &finding.rmse), (d.flip.into(), &finding.flip)] {
                    let star = if ranking.best == Some(method.filter) { "*" } else { "" };
                    row.push(format!("{star}{error:.4}"));
                }
            }
            rows.push(row);
        }
        let noise = |f: &Finding| [format!("{:.4}", f.noise.rmse), format!("{:.4}", f.noise.flip)];
        rows.push(std::iter::once("noise".to_owned()).chain(findings.iter().flat_map(noise)).collect());
        let says: String = findings.iter().map(|finding| format!("{}\n", finding.says)).collect();
        format!("{}\n{says}{}\n", table(&rows), footnote(findings))
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

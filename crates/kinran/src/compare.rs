//! `kinran compare`: one model, several filters, ground truth, and the distance between them in numbers.

use std::path::{Path, PathBuf};

use kinran_bake::aniso::Filter;
use kinran_image::write_atomically;
use kinran_render::metrics::{flip, rmse_linear, rmse_srgb8};
use kinran_render::reference::{Film, RenderScene, TextureFiltering};
use kinran_scene::Scene;
use serde::Serialize;

use crate::compare_sheet::{comparison_sheet, distance_sheet};
use crate::picture::Picture;
use crate::surfaces::{Mips, scene_surfaces};
use crate::table::table;
use crate::values::{filter, number};
use crate::view::{View, ViewArgs, file_name};
use crate::{Console, Error, Progress, outputs};

/// Compares filters with ground truth, in pictures and numbers
///
/// Draws the model with the mips of each filter, as a GPU would sample them after block compression, and
/// with many samples of level 0 alone, which is ground truth; nearby and from farther and farther away.
/// Under each picture stand the root mean square error (display-encoded, white being 1) and the mean FLIP
/// error (Andersson et al. 2020, 67 pixels per degree).
///
/// The folder then holds compare.png (side by side, with maps of the FLIP error), distance.png (a row
/// for each filter, a column for each distance, enlarged), every picture alone, and compare.json.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran compare lamp.glb -o comparison/
  kinran compare lamp.glb -o comparison/ --filters ml,naive --truth-spp 1024 --distances 1,4,16
  kinran compare cloth.glb -o comparison/ --env none --light 1,1,1 --size 640x480 --json")]
pub struct Args {
    /// The .glb or .gltf file
    #[arg(value_name = "FILE")]
    pub file: PathBuf,

    /// The folder for pictures and numbers
    #[arg(long, short, value_name = "DIR")]
    pub output: PathBuf,

    /// Filters, in the order of the columns: ml, linear, param, lean, naive
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', default_value = "ml,linear,lean,naive",
        value_parser = filter)]
    pub filters: Vec<Filter>,

    /// Samples in a pixel of the filters' pictures at distance 1; farther away they have as many times more
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    pub spp: u32,

    /// Samples in a pixel of ground truth at distance 1; the same holds for it
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    pub truth_spp: u32,

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
    /// 1 to 16.
    pub max_anisotropy: u32,
    /// Factors of distance besides 1, each 1 or more.
    pub distances: Vec<f32>,
    /// Camera and light at distance 1.
    pub view: View,
}

/// How far a picture is from ground truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MethodReport {
    /// The filter's name.
    pub filter: &'static str,
    /// For each distance, in the order of the options.
    pub distances: Vec<Difference>,
}

/// All numbers of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// What was compared.
    pub title: String,
    /// Pixels in a row at distance 1.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples in a pixel of the filters' pictures at distance 1.
    pub samples_per_pixel: u32,
    /// Samples in a pixel of ground truth at distance 1.
    pub truth_samples_per_pixel: u32,
    /// One for each filter.
    pub methods: Vec<MethodReport>,
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
    outputs::check_folder(&args.output)?;
    let scene = Scene::load(&args.file)?;
    let view = View::new(&scene, &args.file.to_string_lossy(), &args.view)?;
    let options = Options {
        filters: distinct(&args.filters),
        samples_per_pixel: args.spp,
        truth_samples_per_pixel: args.truth_spp,
        max_anisotropy: args.max_anisotropy,
        distances: distinct(&args.distances),
        view,
    };
    let comparison = compare(&scene, &file_name(&args.file), &options, &console.progress())?;
    comparison.report.warnings.iter().for_each(|w| console.warn(w));
    comparison.write(&args.output)?;
    let text = format!("{}\nPictures and numbers are in {}", comparison.table(), args.output.display());
    console.result(&comparison.report, &text)
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
/// scene in the pictures. The surfaces are baked once for each filter, ground truth is rendered once for each
/// distance.
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
    let views: Vec<View> = options.distances.iter().map(|&d| options.view.zoomed_out(d)).collect();
    let films = |prepared: &RenderScene, name: &str, samples: u32, filtering| {
        let films = views.iter().zip(&options.distances).map(|(view, &distance)| {
            let name = format!("{name}, distance {distance}");
            // A pixel far away covers more of the model and needs more samples.
            let samples = (samples as f32 * distance) as u32;
            view.render(prepared, &name, samples, filtering, progress)
        });
        films.collect::<Result<Vec<Film>, Error>>()
    };
    let pictures = |films: &[Film]| -> Vec<Picture> {
        let display = |film: &Film| Picture {
            width: film.width,
            height: film.height,
            pixels: options.view.display(film),
        };
        films.iter().map(display).collect()
    };

    // Ground truth.
    let (surfaces, apart) = scene_surfaces(scene, Mips::Level0, progress)?;
    let warnings = scene.warnings.iter().cloned().chain(apart).collect();
    let mut prepared = options.view.scene(scene, surfaces)?;
    let truth = films(&prepared, "truth", options.truth_samples_per_pixel, TextureFiltering::Level0)?;
    let truth_pictures = pictures(&truth);

    // The filters.
    let mut methods = Vec::new();
    let mut series = Vec::new();
    for &filter in &options.filters {
        let (surfaces, _) = scene_surfaces(scene, Mips::Filtered(filter), progress)?;
        for (material, surface) in prepared.materials.iter_mut().zip(surfaces) {
            material.surface = surface;
        }
        let filtering = TextureFiltering::Mips { max_anisotropy: options.max_anisotropy };
        let films = films(&prepared, filter.name(), options.samples_per_pixel, filtering)?;
        let pictures = pictures(&films);
        let mut differences = Vec::new();
        let mut errors = Vec::new();
        for (i, &distance) in options.distances.iter().enumerate() {
            let (width, height) = (films[i].width, films[i].height);
            let (wanted, got) = (&truth_pictures[i].pixels, &pictures[i].pixels);
            let flip = flip(wanted, got, width, height)?;
            differences.push(Difference {
                distance,
                width,
                height,
                rmse: rmse_srgb8(wanted, got)?,
                rmse_linear: rmse_linear(&truth[i].pixels, &films[i].pixels)?,
                flip: flip.mean,
            });
            errors.push(flip.map);
        }
        methods.push(MethodReport { filter: filter.name(), distances: differences });
        series.push(Series { name: filter.name(), pictures, errors });
    }
    series.insert(0, Series { name: Mips::Level0.name(), pictures: truth_pictures, errors: Vec::new() });

    let report = Report {
        title: title.into(),
        width: options.view.size.0,
        height: options.view.size.1,
        samples_per_pixel: options.samples_per_pixel,
        truth_samples_per_pixel: options.truth_samples_per_pixel,
        methods,
        warnings,
    };
    Ok(Comparison { report, series })
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

    /// The numbers as a table: RMSE and FLIP for each filter and distance.
    pub fn table(&self) -> String {
        let mut rows = vec![vec!["filter".into()]];
        for difference in &self.report.methods[0].distances {
            rows[0].push(format!("RMSE x{}", difference.distance));
            rows[0].push(format!("FLIP x{}", difference.distance));
        }
        rows.extend(self.report.methods.iter().map(|method| {
            let numbers =
                method.distances.iter().flat_map(|d| [format!("{:.4}", d.rmse), format!("{:.4}", d.flip)]);
            std::iter::once(method.filter.to_owned()).chain(numbers).collect()
        }));
        table(&rows)
    }

    /// Writes `compare.png`, `distance.png`, every picture alone and `compare.json` to `folder`, which
    /// is made if it does not exist. Each file appears whole or not at all.
    ///
    /// # Errors
    /// [`Error::Image`] where the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        std::fs::create_dir_all(folder).map_err(|e| kinran_image::Error::io(folder, e))?;
        for series in &self.series {
            for (picture, difference) in series.pictures.iter().zip(&self.report.methods[0].distances) {
                picture.write(&folder.join(format!("{}_x{}.png", series.name, difference.distance)))?;
            }
        }
        self.sheet().write(&folder.join("compare.png"))?;
        self.distance_sheet().write(&folder.join("distance.png"))?;
        let json = serde_json::to_string_pretty(&self.report).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(write_atomically(&folder.join("compare.json"), format!("{json}\n").as_bytes())?)
    }
}

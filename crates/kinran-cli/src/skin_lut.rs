//! `kinran skin-lut`: the tables of pre-integrated skin.

pub(crate) mod plot;

use std::path::{Path, PathBuf};

use kinran::Disk;
use kinran::options::Container;
use kinran::skin::{ProfileSource, TableOptions, Tables, tables};
use kinran_bake::skin_lut::TableFormat;

use crate::outputs::{Output, beside, check_folder, kept_remark, tell_place};
use crate::progress::Bars;
use crate::values::{CONTAINERS, Choices, choice, number, size};
use crate::{Console, Error};

/// Makes the tables that skin is lit with
///
/// NAME_punctual: what part of a punctual light leaves skin; across, n·u from -1 to 1; down, curvature from 0 to
/// --range. NAME_ambient: what remains of bands 1 (upper row) and 2 (lower row) of ambient light's spherical
/// harmonics; across, mean curvature from 0 to --range. With --penumbra, NAME_penumbra: light that scatters into
/// shadows; across, the filtered shadow from 0 to 1; down, one over the penumbra's width from 0 to 1/mm. NAME.png is a
/// plot of the first two with their axes, NAME.kinran.json says how they were made and what was lost.
///
/// Values stand in the middle of texels: sample with linear filtering and clamped edges, without mips.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran skin-lut -o tables/
  kinran skin-lut -o tables/ --size 128x64 --format srgb8 --container dds
  kinran skin-lut -o tables/ --burley 0.9,0.4,0.2
  kinran skin-lut -o tables/ --mean-free-path 1.2,0.6,0.3 --albedo 0.8,0.6,0.5
  kinran skin-lut -o tables/ --profile measured.csv

A .csv has rows of distance in mm and density for red, green and blue; a .json has

  { \"gaussians\": [ { \"variance\": 0.187, \"weight\": [0.118, 0.198, 0] } ] }

with variances in mm². Both are the radial profile, light per area against the distance from a point.")]
pub struct Args {
    /// Where the files go; made if it is not there [default: baked, beside --profile if there is one]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// What the files' names begin with
    #[arg(long, default_value = "skin")]
    pub name: String,

    /// A measured or fitted profile, .csv or .json; without any, human skin as six Gaussians
    #[arg(long, value_name = "FILE", conflicts_with_all = ["burley", "mean_free_path"])]
    pub profile: Option<PathBuf>,

    /// Burley's normalised diffusion: d of red, green and blue, mm
    #[arg(long, value_name = "R,G,B", value_parser = triple,
        conflicts_with_all = ["mean_free_path", "albedo"])]
    pub burley: Option<[f64; 3]>,

    /// Burley's normalised diffusion by mean free path, mm
    #[arg(long, value_name = "R,G,B", value_parser = triple, requires = "albedo")]
    pub mean_free_path: Option<[f64; 3]>,

    /// Diffuse albedo, 0 to 1, for --mean-free-path
    #[arg(long, value_name = "R,G,B", value_parser = triple, requires = "mean_free_path")]
    pub albedo: Option<[f64; 3]>,

    /// Multiplies all lengths of the profile
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = |t: &str| number(t, 0.001..=1000.0))]
    pub scale: f32,

    /// Texels of the punctual table
    #[arg(long, value_name = "WxH", default_value = "512x512", value_parser = table_size)]
    pub size: (u32, u32),

    /// Largest curvature, 1/mm; that of the bake's --curvature-range
    #[arg(long, value_name = "1/MM", default_value_t = 0.5, value_parser = |t: &str| number(t, 0.001..=100.0))]
    pub range: f32,

    /// Texels and their encoding
    #[arg(long, default_value = "rgba16f", value_parser = choice(TABLE_FORMATS))]
    pub format: TableFormat,

    /// File format of the tables
    #[arg(long, default_value = "ktx2", value_parser = choice(CONTAINERS))]
    pub container: Container,

    /// Also the table of light that scatters into penumbras
    #[arg(long)]
    pub penumbra: bool,

    /// Overwrites files that kinran did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// Texels and their encoding.
const TABLE_FORMATS: &Choices<TableFormat> = &[
    (TableFormat::Rgba16F, "rgba16f", "Half floats"),
    (TableFormat::Srgb8, "srgb8", "Bytes, sRGB: the sampler decodes, small values get most codes"),
    (TableFormat::Linear8, "rgba8", "Bytes, as they are"),
];

impl Args {
    /// Where the files go.
    fn output(&self) -> PathBuf {
        let nowhere = || self.profile.as_ref().map_or_else(|| "baked".into(), |file| beside(file, "baked"));
        self.output.clone().unwrap_or_else(nowhere)
    }

    /// What the flags say.
    pub(crate) fn options(&self) -> TableOptions {
        let mut how = TableOptions::default();
        how.name.clone_from(&self.name);
        how.profile = match (&self.profile, self.burley, self.mean_free_path, self.albedo) {
            (_, Some(d), ..) => ProfileSource::Burley(d),
            (_, _, Some(path), Some(albedo)) => ProfileSource::MeanFreePath { path, albedo },
            (Some(file), ..) => ProfileSource::File(file.clone()),
            _ => ProfileSource::HumanSkin,
        };
        (how.size, how.range, how.scale, how.penumbra) = (self.size, self.range, self.scale, self.penumbra);
        (how.format, how.container) = (self.format, self.container);
        how
    }
}

fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[r, g, b]) if [r, g, b].iter().all(|x| x.is_finite()) => Ok([r, g, b]),
        _ => Err("write three numbers, such as 0.9,0.4,0.2".into()),
    }
}

fn table_size(text: &str) -> Result<(u32, u32), String> {
    match size(text) {
        Ok((w, h)) if (2..=4096).contains(&w) && (2..=4096).contains(&h) => Ok((w, h)),
        _ => Err("write WIDTHxHEIGHT, such as 512x512, each 2 to 4096".into()),
    }
}

/// Draws tables as a PNG.
///
/// # Errors
/// Those of the encoder.
pub fn draw(tables: &Tables) -> Result<Vec<u8>, kinran::Error> {
    let title = format!("{}, {}", tables.name, tables.profile);
    Ok(plot::plot(&title, &tables.punctual, &tables.ambient, tables.range).encode()?)
}

/// Runs the command.
///
/// # Errors
/// Whatever is wrong with the profile, the flags or the output folder.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let (output, how) = (args.output(), args.options());
    how.check()?;
    how.profile.read(&Disk)?;
    check_folder(&output)?;
    let input = args.profile.as_deref().unwrap_or(Path::new(""));
    let out = Output::new(&output, input, args.force, console);
    let bars = Bars::new(console.progress());
    let report = tables(&Disk, &how, Some(&draw), &out, bars.task())?;

    let mut lines = String::new();
    for table in &report.tables {
        let between = table
            .interpolation_error
            .map_or_else(String::new, |e| format!(", at most {e:.1e} off between texels"));
        lines += &format!(
            "{}  {}x{} {}  at most {:.1e} off in texels{between}\n",
            table.files.join(" "),
            table.width,
            table.height,
            table.format,
            table.encoding_error
        );
    }
    lines += &format!("{}\n", output.join(how.plot()).display());
    lines += &kept_remark(&report.kept);
    console.result(&report, &lines)?;
    tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

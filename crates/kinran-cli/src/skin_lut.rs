//! `kinran skin-lut`: the tables of pre-integrated skin.

pub(crate) mod plot;
mod profile_file;

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use kinran::content::Content;
use kinran::options::Container;
use kinran::report::{WrittenFile, kept_files};
use kinran::{OutputFolder, Space};
use kinran_bake::skin_lut::{
    INTERPOLATION_GRID, Profile, Table, TableFormat, ambient_table, penumbra_table,
    punctual_interpolation_error, punctual_table,
};
use kinran_image::{Texture, encode_dds, encode_ktx2, write_atomically};
use kinran_shading::skin::profile::{Gaussian, ProfileError};
use schemars::JsonSchema;
use serde::Serialize;

use crate::outputs::{
    beside, check_folder, check_space, kept_remark, refuse_foreign, refuse_input, replaced_bytes, tell_place,
    written_file,
};
use crate::values::{CONTAINERS, choice, number, size};
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
    #[arg(long, value_enum, default_value_t)]
    pub format: FormatName,

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
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FormatName {
    /// Half floats
    #[default]
    Rgba16f,
    /// Bytes, sRGB: the sampler decodes, small values get most codes
    Srgb8,
    /// Bytes, as they are
    Rgba8,
}

impl Args {
    /// Where the files go.
    fn output(&self) -> PathBuf {
        let nowhere = || self.profile.as_ref().map_or_else(|| "baked".into(), |file| beside(file, "baked"));
        self.output.clone().unwrap_or_else(nowhere)
    }
}

/// Texels along the sides of the table of penumbras, at most; chosen by eye.
const PENUMBRA: u64 = 64;

fn triple(text: &str) -> Result<[f64; 3], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[r, g, b]) if [r, g, b].iter().all(|x| x.is_finite()) => Ok([r, g, b]),
        _ => Err("write three numbers, such as 0.9,0.4,0.2".into()),
    }
}

fn table_size(text: &str) -> Result<(u32, u32), String> {
    match size(text)? {
        (w, h) if (2..=4096).contains(&w) && (2..=4096).contains(&h) => Ok((w, h)),
        _ => Err("a table has 2 to 4096 texels along a side".into()),
    }
}

/// What was made.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Report {
    kinran: &'static str,
    profile: String,
    scale: f32,
    /// 1/mm at the lower edge of the punctual table and the right edge of the ambient one.
    range: f32,
    tables: Vec<TableReport>,
    /// Every file that was written beside this report.
    written: Vec<WrittenFile>,
    /// What earlier runs wrote beside it, under other flags, and is there as they left it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    kept: Vec<WrittenFile>,
}

/// A table.
#[derive(Debug, Serialize, JsonSchema)]
struct TableReport {
    files: Vec<String>,
    width: usize,
    height: usize,
    format: &'static str,
    across: &'static str,
    down: &'static str,
    /// Largest error of a texel after encoding.
    encoding_error: f32,
    /// Largest error between texels, before encoding.
    interpolation_error: Option<f32>,
}

/// Bytes that the tables will take.
pub(crate) fn space(args: &Args) -> Space {
    let texel = if args.format == FormatName::Rgba16f { 8 } else { 4 };
    let (width, height) = (u64::from(args.size.0), u64::from(args.size.1));
    let penumbra = if args.penumbra { width.min(PENUMBRA) * height.min(PENUMBRA) } else { 0 };
    let texels = width * height + 2 * width + penumbra;
    Space::exact(texels * texel * args.container.extensions().len() as u64)
}

/// Runs the command.
///
/// # Errors
/// Whatever is wrong with the profile, the flags or the output folder.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    if args.name.is_empty() || args.name.contains(['/', '\\']) {
        return Err(Error::flag_error(
            format!("--name {}", args.name),
            "must be the beginning of a file's name",
        ));
    }
    let (profile, described) = profile(args)?;
    let refuse = |error: ProfileError| match &args.profile {
        Some(file) => Error::file_error(file, error.to_string()),
        None => Error::flag_error(profile_flag(args), error),
    };
    let radial = profile.radial().map_err(refuse)?;
    check_folder(&args.output())?;
    let mut files: Vec<String> = Vec::new();
    let penumbra = args.penumbra.then_some(Content::SkinPenumbra);
    for content in [Content::SkinPunctual, Content::SkinAmbient].into_iter().chain(penumbra) {
        files.extend(args.container.extensions().iter().map(|e| table_file(args, content, e)));
    }
    files.push(format!("{}.png", args.name));
    let sidecar = format!("{}.kinran.json", args.name);
    let all: Vec<String> = files.iter().chain([&sidecar]).cloned().collect();
    for file in &all {
        refuse_input(&args.output().join(file), args.profile.as_deref())?;
    }
    refuse_foreign(&args.output(), &all, args.force)?;
    let needed = space(args).beyond(replaced_bytes(&args.output(), &all));
    if let Some(warning) = check_space(&args.output(), needed)? {
        console.warn(warning);
    }
    std::fs::create_dir_all(args.output()).map_err(|e| kinran_image::Error::io(args.output(), e))?;

    let (width, height) = (args.size.0 as usize, args.size.1 as usize);
    let range = f64::from(args.range);
    let points = width * height * (1 + INTERPOLATION_GRID * INTERPOLATION_GRID);
    let stage = console.progress().stage("integrating tables", points as u64);
    let tick = |points| stage.tick(points);
    let punctual = punctual_table(radial, width, height, range, &tick)?;
    let ambient = ambient_table(radial, width, range);
    let error = punctual_interpolation_error(radial, &punctual, range, &tick)?;

    let mut report = Report {
        kinran: env!("CARGO_PKG_VERSION"),
        profile: described,
        scale: args.scale,
        range: args.range,
        tables: Vec::new(),
        written: Vec::new(),
        kept: Vec::new(),
    };
    let mut add = |content, table: &Table, across, down, interpolation_error| -> Result<(), Error> {
        report.tables.push(write_table(args, content, table, across, down, interpolation_error)?);
        Ok(())
    };
    add(Content::SkinPunctual, &punctual, "n·u from -1 to 1", "curvature from 0 to range", Some(error))?;
    add(Content::SkinAmbient, &ambient, "mean curvature from 0 to range", "band 1, band 2", None)?;
    if args.penumbra {
        let table = penumbra_table(radial, width.min(PENUMBRA as usize), height.min(PENUMBRA as usize), 1.0);
        let down = "one over the penumbra's width from 0 to 1/mm";
        add(Content::SkinPenumbra, &table, "filtered shadow from 0 to 1", down, None)?;
    }
    let title = format!("{}, {}", args.name, report.profile);
    plot::plot(&title, &punctual, &ambient, args.range)
        .write(&args.output().join(format!("{}.png", args.name)))?;
    report.written = files.iter().map(|file| written_file(&args.output(), file)).collect::<Result<_, _>>()?;
    report.kept = kept_files(&OutputFolder::new(args.output()), &sidecar, &report.written);
    let mut text = serde_json::to_string_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?;
    text.push('\n');
    write_atomically(&args.output().join(sidecar), text.as_bytes())?;

    drop(stage);
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
    lines += &format!("{}\n", args.output().join(format!("{}.png", args.name)).display());
    lines += &kept_remark(&report.kept);
    console.result(&report, &lines)?;
    tell_place(console, args.output.as_deref(), &args.output());
    Ok(())
}

/// The flag that decides about a profile that no file gives.
fn profile_flag(args: &Args) -> &'static str {
    match (args.burley, args.mean_free_path) {
        (Some(_), _) => "--burley",
        (_, Some(_)) => "--mean-free-path",
        _ => "--scale",
    }
}

/// The profile that the flags name, and what it is called.
fn profile(args: &Args) -> Result<(Profile, String), Error> {
    let k = f64::from(args.scale);
    let scaled = |d: [f64; 3]| d.map(|d| d * k);
    let list = |d: [f64; 3]| format!("{}, {}, {}", d[0], d[1], d[2]);
    if let Some(d) = args.burley {
        return Ok((Profile::Burley(scaled(d)), format!("Burley, d = {} mm", list(d))));
    }
    if let (Some(path), Some(albedo)) = (args.mean_free_path, args.albedo) {
        let described = format!("Burley, mean free path {} mm, albedo {}", list(path), list(albedo));
        return Ok((Profile::MeanFreePath { path: scaled(path), albedo }, described));
    }
    let (profile, described) = match &args.profile {
        Some(file) => (profile_file::read(file)?, file_name(file)),
        None => (Profile::default(), "human skin, six Gaussians".to_owned()),
    };
    // Densities are normalised later: only lengths matter.
    let profile = match profile {
        Profile::Gaussians(sum) => Profile::Gaussians(
            sum.into_iter().map(|g| Gaussian { variance: g.variance * k * k, ..g }).collect(),
        ),
        Profile::Table(rows) => Profile::Table(rows.into_iter().map(|(r, d)| (r * k, d)).collect()),
        other => other,
    };
    Ok((profile, described))
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// The name of a table's file: `skin_punctual.ktx2` where `--name` is `skin`.
fn table_file(args: &Args, content: Content, extension: &str) -> String {
    format!("{}_{}.{extension}", args.name, content.name().trim_start_matches("skin-"))
}

fn write_table(
    args: &Args,
    content: Content,
    table: &Table,
    across: &'static str,
    down: &'static str,
    interpolation_error: Option<f32>,
) -> Result<TableReport, Error> {
    let (format, label) = match args.format {
        FormatName::Rgba16f => (TableFormat::Rgba16F, "rgba16f"),
        FormatName::Srgb8 => (TableFormat::Srgb8, "srgb8"),
        FormatName::Rgba8 => (TableFormat::Linear8, "rgba8"),
    };
    let mut texture: Texture = table.texture(format)?;
    content.mark(&mut texture);
    texture.metadata.insert("KinranRange".into(), args.range.to_string());
    let mut files = Vec::new();
    for extension in args.container.extensions() {
        let file = table_file(args, content, extension);
        let bytes = match *extension {
            "dds" => encode_dds(&texture)?,
            _ => encode_ktx2(&texture, None)?,
        };
        write_atomically(&args.output().join(&file), &bytes)?;
        files.push(file);
    }
    Ok(TableReport {
        files,
        width: table.width,
        height: table.height,
        format: label,
        across,
        down,
        encoding_error: table.texture_error(&texture)?,
        interpolation_error,
    })
}

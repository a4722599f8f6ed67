//! `kinran detail solve`: one target against its layers.

use std::path::{Path, PathBuf};

use kinran::Disk;
use kinran::bake::Green;
use kinran::detail::{ALPHA, Carrier, KindSource, MapKind, SolveOptions, SolveReport, TiledLayer, solve};
use kinran::options::{Container, Format};
use kinran_image::Preset;

use super::layer_flag::layer_flag;
use super::{BLOCK_FORMATS, KINDS};
use crate::model::ModelArgs;
use crate::outputs::{Output, beside, bytes_text, check_folder, kept_remark, tell_place};
use crate::progress::Bars;
use crate::table::table;
use crate::values::{CONTAINERS, PRESETS, choice, exr_layer, number};
use crate::{Console, Error};

/// Solves one target: writes NAME_synthesized, its tiles as they were compressed, and NAME.detail.json
///
/// The synthesized map `s` is found texel by texel so that the blend of `s` and the tiles is the target: smooth overlay
/// for colour and data, reoriented normal mapping for normals, "over" for aniso texels. It is solved against the tiles as
/// the GPU decodes them, level by level.
///
/// A layer is FILE,NAME=VALUE,...: scale (4 or 4x2), rotation (degrees), offset, mirror, hue (degrees), saturation and
/// value (factors), opacity, mask, channel (r, g, b, a) and contrast of the mask, y-down. The first layer lies at the bottom;
/// each of the others needs a mask. FILE is an image, or a tile that was baked before (.ktx2, .dds).
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran detail solve helmet_color.png --layer steel.png,scale=4 -o baked/
  kinran detail solve wall.png --layer brick.png,scale=6 \\
      --layer moss.png,scale=9,mask=masks.png,channel=g -o baked/
  kinran detail solve wall_normal.png --kind normal \\
      --layer brick_normal.png,scale=6 -o baked/
  kinran detail solve wall.png --layer brick.png,scale=6 \\
      --max-error 4 -o baked/ --pictures
  kinran detail solve wall.png --layer brick.png,scale=6 -o baked/ --board && \\
      kinran view baked/wall.glb
  kinran detail solve helmet.png --layer steel.png,scale=9 -o baked/ \\
      --model helmet.glb --material shell")]
pub struct SolveArgs {
    /// The map to reproduce: an image of 8 or 16 bits or floats
    #[arg(value_name = "TARGET")]
    pub target: PathBuf,

    /// A tiled layer, FILE[,NAME=VALUE]..., from the bottom up; up to three
    #[arg(long, value_name = "LAYER", required = true, value_parser = layer_flag)]
    pub layer: Vec<TiledLayer>,

    /// Where the files go; made if it is not there [default: baked beside the target]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// What the target and its tiles hold [default: what the target's name says, else color]
    #[arg(long, value_parser = choice(KINDS))]
    pub kind: Option<MapKind>,

    /// Format of the synthesized map [default: bc7, for normals bc5]
    #[arg(long, value_parser = choice(BLOCK_FORMATS))]
    pub format: Option<Format>,

    /// Format of tiles that come as images [default: as --format]
    #[arg(long, value_parser = choice(BLOCK_FORMATS))]
    pub tile_format: Option<Format>,

    /// Time spent on a block of the synthesized map
    #[arg(long, value_parser = choice(PRESETS))]
    pub preset: Option<Preset>,

    /// Opacity of the detail over an aniso target: the shader's parameter
    #[arg(long, value_name = "0..1", default_value_t = ALPHA, value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub alpha: f32,

    /// Green of a normal target grows downwards (DirectX); where no flag says it, the name does
    #[arg(long, conflicts_with = "y_up")]
    pub y_down: bool,

    /// Green of a normal target grows upwards (OpenGL, glTF), whatever its name says
    #[arg(long)]
    pub y_up: bool,

    /// Which layer of an EXR file holds the target, a tile or a mask; may be given again
    #[arg(long, value_name = "FILE=LAYER", value_parser = exr_layer)]
    pub exr_layer: Vec<(PathBuf, String)>,

    /// Overlay as it is, instead of the smooth one
    #[arg(long)]
    pub plain_overlay: bool,

    /// Solve against the tiles as authored, not as the GPU decodes them
    #[arg(long)]
    pub no_compensation: bool,

    /// How much of what the tiles' compression did the finest level takes back: 0 as in the talk, 1 as all other levels.
    /// What it gains at its own size it loses where it is magnified
    #[arg(long, value_name = "0..1", default_value_t = 0.5, value_parser = |t: &str| number(t, 0.0..=1.0))]
    pub finest_compensation: f32,

    /// Keep the encoder's blocks, whatever they are blended to, and solve the finest level as in the talk
    #[arg(long)]
    pub no_choice: bool,

    /// Centre the histogram of the tiles; write the tiles again wherever they are used
    #[arg(long)]
    pub center: bool,

    /// Fade the layers until the blended error is no higher than that of the target, compressed by itself: for tiles that have
    /// little to do with it. The opacity stands in the report, for the shader
    #[arg(long)]
    pub fade: bool,

    /// The synthesized map gets the lowest resolution whose error, at the target's resolution, is not above this: RMSE in
    /// steps of 8 bits, degrees for normals
    #[arg(long, value_name = "ERROR", value_parser = |t: &str| number(t, 0.0..=255.0))]
    pub max_error: Option<f32>,

    /// Also measure what each part of the method is worth (four more solutions)
    #[arg(long)]
    pub compare: bool,

    /// Also write pictures: detail, synthesized, blended, target, errors
    #[arg(long)]
    pub pictures: bool,

    /// Also write NAME.glb, a board that carries the result, for kinran view and kinran render
    #[arg(long, conflicts_with = "model")]
    pub board: bool,

    /// Also write this .glb or .gltf file with the result in a material; the target becomes the map that other viewers show
    #[arg(long, value_name = "FILE")]
    pub model: Option<PathBuf>,

    #[command(flatten)]
    #[allow(missing_docs)]
    pub trust: ModelArgs,

    /// The material of --model; needed where it has several
    #[arg(long, value_name = "NAME", requires = "model")]
    pub material: Option<String>,

    /// What the channels of a data target are, for --board and --model: o occlusion, r roughness, m metallic, - none
    /// [default: orm, of grey maps r]
    #[arg(long, value_name = "LETTERS", value_parser = channels_flag)]
    pub channels: Option<String>,

    /// Overwrites files that kinran did not write, or that were changed since
    #[arg(long)]
    pub force: bool,

    /// File format of the textures
    #[arg(long, default_value = "ktx2", value_parser = choice(CONTAINERS))]
    pub container: Container,

    /// Zstandard level of KTX2 files, 0 for none
    #[arg(long, value_name = "LEVEL", default_value_t = 3, value_parser = clap::value_parser!(i32).range(0..=22))]
    pub zstd: i32,
}

impl SolveArgs {
    /// Where the files go.
    fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| beside(&self.target, "baked"))
    }

    /// What the flags say.
    pub(crate) fn options(&self) -> SolveOptions {
        let mut how = SolveOptions::new(self.layer.clone());
        (how.kind, how.format, how.tile_format, how.preset) =
            (self.kind, self.format, self.tile_format, self.preset);
        (how.alpha, how.exr_layer, how.plain_overlay) =
            (self.alpha, self.exr_layer.clone(), self.plain_overlay);
        how.green = match (self.y_up, self.y_down) {
            (true, _) => Some(Green::Up),
            (_, true) => Some(Green::Down),
            _ => None,
        };
        (how.compensate, how.finest_compensation, how.choose) =
            (!self.no_compensation, self.finest_compensation, !self.no_choice);
        (how.center, how.fade, how.max_error, how.compare, how.pictures) =
            (self.center, self.fade, self.max_error, self.compare, self.pictures);
        how.carrier = match &self.model {
            Some(path) => Some(Carrier::Model {
                path: path.clone(),
                material: self.material.clone(),
                allow_outside: self.trust.allow_outside.clone(),
            }),
            None => self.board.then_some(Carrier::Board),
        };
        (how.channels, how.container, how.zstd) = (self.channels.clone(), self.container, self.zstd);
        how
    }
}

/// What each channel of a data target is, from `--channels`.
fn channels_flag(text: &str) -> Result<String, String> {
    let mut how = SolveOptions::new(Vec::new());
    how.channels = Some(text.into());
    match how.check() {
        Err(kinran::Error::Option { reason, .. }) => Err(reason),
        _ => Ok(text.into()),
    }
}

pub(super) fn run(args: &SolveArgs, console: &Console) -> Result<(), Error> {
    check_folder(&args.output())?;
    let report = solve_target(args, console)?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    console.result(&report, &text(&report, &args.output()))?;
    tell_place(console, args.output.as_deref(), &args.output());
    Ok(())
}

/// Reads, solves and writes.
///
/// # Errors
/// Whatever is wrong with a file or a flag; each names the file.
pub fn solve_target(args: &SolveArgs, console: &Console) -> Result<SolveReport, Error> {
    args.trust.allowed()?;
    let (how, bars, output) = (args.options(), Bars::new(console.progress()), args.output());
    let out = Output::new(&output, &args.target, args.force, console);
    Ok(solve(&Disk, &args.target, &how, &out, bars.task())?)
}

/// The report for people.
fn text(report: &SolveReport, folder: &Path) -> String {
    let mut rows = vec![["level", "size", "blended error", "not reached"].map(String::from).to_vec()];
    if report.comparison.is_some() {
        rows[0].extend(["target alone", "the talk's", "plain overlay", "uncompensated"].map(String::from));
    }
    for (i, level) in report.levels.iter().enumerate() {
        let mut row = vec![
            i.to_string(),
            format!("{}x{}", level.width, level.height),
            format!("{:.3}", level.error),
            format!("{:.2} %", 100.0 * level.unreached),
        ];
        if let Some(comparison) = &report.comparison {
            let c = &comparison.levels[i];
            row.extend([c.target, c.talk, c.plain_overlay, c.uncompensated].map(|e| format!("{e:.3}")));
        }
        rows.push(row);
    }
    let source = match report.kind_source {
        KindSource::Flag => "by --kind",
        KindSource::Name => "by the target's name",
        KindSource::Assumed => "assumed, since the target's name says nothing; --kind says otherwise",
    };
    let mut text = format!("kind {}, {source}\n{}", report.kind.name(), table(&rows));
    if let Some(c) = &report.comparison {
        text += &format!(
            "synthesized {} bytes, shared tiles {}; the target alone {}, a unique map as fine as the tiles {}\n",
            c.synthesized_bytes, c.shared_bytes, c.target_bytes, c.unique_bytes
        );
    }
    for r in &report.resolutions {
        text += &format!(
            "at {}x{}: error {:.3} at the target's resolution, {}\n",
            r.width,
            r.height,
            r.error,
            bytes_text(r.bytes)
        );
    }
    text += "blended error: root mean square against the target, in steps of 8 bits, of normals in degrees; not reached: texels that no \
             synthesized map turns into the target\n";
    if let Some(opacity) = report.opacity {
        text += &format!("opacity of the layers: x {opacity}\n");
    }
    let json = format!(
        "{}.detail.json",
        Path::new(&report.target).file_stem().unwrap_or_default().to_string_lossy()
    );
    text += &format!("wrote {} and {json}, in {}\n", report.files.join(", "), folder.display());
    text + &kept_remark(&report.kept)
}

//! `kinran detail solve`: one target against its layers.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::vec3;
use kinran::content::Content;
use kinran::options::Container;
use kinran::report::{WrittenFile, kept_files};
use kinran::{OutputFolder, Space};
use kinran_bake::detail::{
    Comparison, DetailOptions, FADE_TRIALS, Layer, LayerTransform, LevelError, MapKind, Mask, Resolution,
    Solved, Target, Tile, TileOptions, bearable_opacity, compare, level_pictures, lowest_resolution, solve,
};
use kinran_bake::folder::{Green, guess_green, not_normals};
use kinran_image::{
    Image, Preset, encode_dds, encode_ktx2, encode_png, image_size, read_layer, read_texture,
    write_atomically,
};
use schemars::JsonSchema;
use serde::Serialize;

use super::layer_flag::{green_by_name, layer_flag};
use super::model::{self, Written, channels_flag};
use super::{BlockFormat, KindName, KindSource, LayerFlag, default_format};
use crate::model::ModelArgs;
use crate::outputs::{
    beside, bytes_text, changed_files, check_folder, check_space, has_extension, kept_remark, refuse_foreign,
    refuse_input, replaced_bytes, tell_place, written_file,
};
use crate::table::table;
use crate::values::{CONTAINERS, PRESETS, choice, exr_layer, exr_layer_of, number};
use crate::{Console, Error, Stage};

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
    pub layer: Vec<LayerFlag>,

    /// Where the files go; made if it is not there [default: baked beside the target]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// What the target and its tiles hold [default: what the target's name says, else color]
    #[arg(long, value_enum)]
    pub kind: Option<KindName>,

    /// Format of the synthesized map [default: bc7, for normals bc5]
    #[arg(long, value_enum)]
    pub format: Option<BlockFormat>,

    /// Format of tiles that come as images [default: as --format]
    #[arg(long, value_enum)]
    pub tile_format: Option<BlockFormat>,

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
    /// Whether green of a normal target grows downwards.
    fn target_down(&self) -> bool {
        self.y_down || (!self.y_up && green_by_name(&self.target))
    }

    /// Where the files go.
    pub(super) fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| beside(&self.target, "baked"))
    }

    /// What the target holds, and what says so.
    fn named_kind(&self) -> (KindName, KindSource) {
        let by_flag = self.kind.map(|kind| (kind, KindSource::Flag));
        by_flag
            .or_else(|| Some((KindName::of_file(&self.target)?, KindSource::Name)))
            .unwrap_or((KindName::Color, KindSource::Assumed))
    }

    /// The files that are read: the target, tiles and masks.
    pub(crate) fn images(&self) -> impl Iterator<Item = &PathBuf> {
        let of_layers = self.layer.iter().flat_map(|layer| [Some(&layer.tile), layer.mask.as_ref()]);
        std::iter::once(&self.target).chain(of_layers.flatten())
    }

    /// Reads an image, of an EXR the layer that `--exr-layer` names.
    fn read(&self, file: &Path) -> Result<Image, kinran_image::Error> {
        read_layer(file, exr_layer_of(&self.exr_layer, file, Path::new("")))
    }

    /// What the target holds: by flag, else by its name, else colour.
    pub(crate) fn kind(&self) -> MapKind {
        self.named_kind().0.into()
    }
}

/// The shader's default for the opacity of the detail over an aniso target; chosen by eye.
const ALPHA: f32 = 0.5;

/// What was solved and how well.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SolveReport {
    /// File name of the target.
    pub target: String,
    /// What it holds.
    pub kind: KindName,
    /// What says so.
    pub kind_source: KindSource,
    /// Files written.
    pub files: Vec<String>,
    /// The same with their hashes: a later run writes these again, and no others, without a question.
    pub written: Vec<WrittenFile>,
    /// What earlier runs wrote beside this report, under other flags, and is there as they left it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kept: Vec<WrittenFile>,
    /// Width and height of the target and of `s`.
    pub target_size: [u32; 2],
    /// Width and height of `s`.
    pub size: [u32; 2],
    /// For `--fade`: the factor on the layers' opacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f32>,
    /// Errors, level by level.
    pub levels: Vec<LevelError>,
    /// For `--max-error`: what each resolution would have cost.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub resolutions: Vec<Resolution>,
    /// For `--compare`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
    /// What is doubtful about the target and its layers, a sentence each.
    pub warnings: Vec<String>,
}

pub(super) fn run(args: &SolveArgs, console: &Console) -> Result<(), Error> {
    check_folder(&args.output())?;
    let report = solve_target(args, console)?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    console.result(&report, &text(&report, &args.output()))?;
    tell_place(console, args.output.as_deref(), &args.output());
    Ok(())
}

/// A tile or mask: its file, whether its green grows downwards, and whether it is a mask.
type TileKey = (PathBuf, bool, bool);

/// Tiles and masks, each read and compressed once.
type Tiles = BTreeMap<TileKey, Tile>;

fn tile_keys(args: &SolveArgs) -> BTreeSet<TileKey> {
    let keys = args.layer.iter().flat_map(|flag| {
        let mask = flag.mask.iter().map(|mask| (mask.clone(), false, true));
        mask.chain([(flag.tile.clone(), flag.y_down, false)])
    });
    keys.collect()
}

/// Bytes that the files will take, by the headers of the images alone.
pub(crate) fn space(args: &SolveArgs) -> Space {
    let format = args.format.unwrap_or_else(|| default_format(args.kind()));
    let texture = |format: BlockFormat, file: &Path| {
        let size = image_size(file)?;
        Some(Space::of_texture(args.container, args.zstd, format.encoding().format, size))
    };
    let mut space = texture(format, &args.target).unwrap_or_default();
    if args.max_error.is_some() {
        // Any lower resolution may do.
        space.least = 0;
    }
    for key in tile_keys(args).iter().filter(|key| writes_tile(args, key)) {
        let format = if key.2 { BlockFormat::Bc7 } else { args.tile_format.unwrap_or(format) };
        space.add(texture(format, &key.0).unwrap_or_default());
    }
    let pictures = if args.pictures { PICTURES.len() as u64 } else { 0 };
    let authored = u64::from(args.board || args.model.is_some());
    // What PNG does not shrink.
    let plain = image_size(&args.target).map_or(0, |(w, h)| 3 * u64::from(w) * u64::from(h));
    space.most += (pictures + authored) * plain;
    space
}

/// Refuses what cannot be written, before anything is read.
fn check(args: &SolveArgs, console: &Console) -> Result<(), Error> {
    let packed = model::check(args)?;
    for flag in &args.exr_layer {
        let acts = |file: &PathBuf| exr_layer_of(std::slice::from_ref(flag), file, Path::new("")).is_some();
        if !args.images().any(acts) {
            let name = format!("--exr-layer {}={}", flag.0.display(), flag.1);
            let reason = "neither the target nor a tile or mask is such a file";
            return Err(Error::flag_error_of(&args.target, name, reason));
        }
    }
    let keys = tile_keys(args);
    let stem = file_stem(&args.target);
    let mut files = texture_files(args, &format!("{stem}_synthesized"));
    for key in keys.iter().filter(|key| writes_tile(args, key)) {
        files.extend(texture_files(args, &tile_name(key, || keys.iter())));
    }
    if args.board || args.model.is_some() {
        files.push(format!("{stem}_authored.png"));
    }
    if args.board {
        files.push(format!("{stem}.glb"));
    }
    files.extend(packed.iter().flat_map(|packed| changed_files(&args.output(), packed)));
    if args.pictures {
        files.extend(PICTURES.map(|picture| format!("{stem}_{picture}.png")));
    }
    for file in &files {
        let inputs = std::iter::once(&args.target).chain(keys.iter().map(|key| &key.0));
        refuse_input(&args.output().join(file), inputs.map(PathBuf::as_path))?;
    }
    files.push(format!("{stem}.detail.json"));
    refuse_foreign(&args.output(), &files, args.force)?;
    let needed = space(args).beyond(replaced_bytes(&args.output(), &files));
    if let Some(warning) = check_space(&args.output(), needed)? {
        console.warn(warning);
    }
    Ok(())
}

/// Whether a tile is written: a model finds its tiles beside it, also those that were baked before.
fn writes_tile(args: &SolveArgs, key: &TileKey) -> bool {
    let baked = has_extension(&key.0, "ktx2") || has_extension(&key.0, "dds");
    !baked || args.board || args.model.is_some()
}

/// What `--pictures` shows.
const PICTURES: [&str; 7] =
    ["detail", "synthesized", "blended", "target", "compressed_target", "error", "target_error"];

/// Reads, solves and writes.
///
/// # Errors
/// Whatever is wrong with a file or a flag; each names the file.
pub fn solve_target(args: &SolveArgs, console: &Console) -> Result<SolveReport, Error> {
    check(args, console)?;
    let (kind_name, kind_source) = args.named_kind();
    let kind = MapKind::from(kind_name);
    let format = args.format.unwrap_or_else(|| default_format(kind));
    let mut options = DetailOptions::new(format.encoding());
    if let Some(preset) = args.preset {
        options.encoding.preset = preset;
    }
    options.aniso_alpha = args.alpha;
    options.compensate = !args.no_compensation;
    options.finest_compensation = args.finest_compensation;
    options.choose = !args.no_choice;
    if args.plain_overlay {
        options.blend = kinran_bake::detail::Blend::Plain;
    }

    // First, since compressing tiles takes a while.
    let image = args.read(&args.target)?;
    if kind_source == KindSource::Assumed && not_normals(&image).is_none() {
        let reason = "nothing says what the target holds, and its texels look like normals; give --kind normal, or --kind \
                      color where they are none";
        return Err(Error::flag_error_of(&args.target, "--kind", reason));
    }
    let mut warnings = layer_kinds(args, kind_name);
    let idle = [
        ("--alpha", args.alpha != ALPHA && kind != MapKind::Aniso, "the target is no aniso map"),
        (
            "--channels",
            args.channels.is_some() && !args.board && args.model.is_none(),
            "neither --board nor --model is asked for",
        ),
    ];
    let idle = idle.into_iter().filter(|(_, is_idle, _)| *is_idle);
    warnings.extend(idle.map(|(flag, _, why)| format!("{flag} has nothing to act on: {why}")));
    if kind == MapKind::Normal {
        warnings.extend(green_doubt(&args.target, &image, args.target_down(), ["--y-down", "--y-up"]));
    }
    let target = named(&args.target, Target::new(&image, kind, args.target_down()))?;
    drop(image);
    let tiles = read_tiles(args, kind, args.tile_format.unwrap_or(format), console, &mut warnings)?;
    let tile = |file: &Path, y_down: bool, is_mask: bool| &tiles[&(file.to_path_buf(), y_down, is_mask)];
    let mut layers: Vec<Layer> = args
        .layer
        .iter()
        .map(|flag| Layer {
            tile: tile(&flag.tile, flag.y_down, false),
            transform: LayerTransform {
                scale: flag.scale,
                rotation: flag.rotation.to_radians(),
                offset: flag.offset,
                mirror: flag.mirror,
            },
            hsv: vec3(flag.hue / 360.0, flag.saturation, flag.value),
            opacity: flag.opacity,
            mask: flag.mask.as_ref().map(|file| Mask {
                map: tile(file, false, true),
                channel: flag.channel,
                contrast: flag.contrast,
            }),
        })
        .collect();
    let size = (target.levels[0].width, target.levels[0].height);
    let texels = u64::from(size.0) * u64::from(size.1);

    let mut opacity = None;
    if args.fade {
        // Two levels at a time.
        let stage = console.progress().stage("fading the layers", FADE_TRIALS * texels * 5 / 4);
        let found = bearable_opacity(&target, &layers, &options, &|n| stage.tick(n))?.ok_or_else(|| {
            Error::flag_error_of(
                &args.target,
                "--fade",
                "even without the layers the error is above that of the compressed target; take a finer --format",
            )
        })?;
        layers.iter_mut().for_each(|layer| layer.opacity *= found);
        opacity = Some(found);
    }
    let mut resolutions = Vec::new();
    if let Some(bound) = args.max_error {
        // All resolutions together are a third more than the first, and so are the mips of each.
        let stage = console.progress().stage("trying resolutions", texels * 16 / 9);
        let found = lowest_resolution(&target, &layers, &options, bound, &|n| stage.tick(n))?;
        resolutions = found.resolutions;
        let Some(level) = found.level else {
            let reason = format!(
                "even at the target's own resolution the error is {:.2}; allow more, or take another format or tile",
                resolutions[0].error
            );
            return Err(Error::flag_error_of(&args.target, format!("--max-error {bound}"), reason));
        };
        options.first_level = level;
    }
    let finest = &target.levels[options.first_level];
    let all = u64::from(finest.width) * u64::from(finest.height) * 4 / 3;
    let (solved, comparison) = if args.compare {
        let stage = console.progress().stage("solving and comparing", 5 * all);
        let (comparison, solved) = compare(&target, &layers, &options, &|n| stage.tick(n))?;
        (solved, Some(comparison))
    } else {
        let stage = console.progress().stage("solving", all);
        (solve(&target, &layers, &options, &|n| stage.tick(n))?, None)
    };

    let stem = file_stem(&args.target);
    let written = 1 + tiles.keys().filter(|key| writes_tile(args, key)).count();
    let textures = (written * args.container.extensions().len()) as u64;
    let pictures = if args.pictures { PICTURES.len() as u64 } else { 0 };
    let writing = console.progress().stage("writing", textures + pictures);
    let mut files = write_textures(args, &stem, &solved, &tiles, &writing)?;
    if args.board || args.model.is_some() {
        let texture = |file: &Path, y_down: bool, is_mask: bool| {
            texture_files(args, &tile_name(&(file.to_path_buf(), y_down, is_mask), || tiles.keys()))
        };
        let written = Written {
            synthesized: &texture_files(args, &format!("{stem}_synthesized")),
            tile: &|layer| texture(&layer.tile, layer.y_down, false),
            mask: &|layer| layer.mask.as_ref().map(|mask| texture(mask, false, true)),
            opacity: opacity.unwrap_or(1.0),
        };
        files.extend(model::write(args, &stem, &target, &written)?);
    }
    if args.pictures {
        let pictures = level_pictures(&target, &layers, &options, &solved, 0)?;
        let images: [&Image; 7] = [
            &pictures.detail,
            &pictures.synthesized,
            &pictures.blended,
            &pictures.target,
            &pictures.compressed_target,
            &pictures.error,
            &pictures.target_error,
        ];
        for (name, image) in PICTURES.into_iter().zip(images) {
            let file = format!("{stem}_{name}.png");
            write_atomically(&args.output().join(&file), &encode_png(image)?)?;
            files.push(file);
            writing.add(1);
        }
    }
    let first = &solved.texture.levels[0];
    let written =
        files.iter().map(|file| written_file(&args.output(), file)).collect::<Result<Vec<_>, _>>()?;
    let report_file = format!("{stem}.detail.json");
    let kept = kept_files(&OutputFolder::new(args.output()), &report_file, &written);
    let report = SolveReport {
        target: file_name(&args.target),
        kind: kind_name,
        kind_source,
        files,
        written,
        kept,
        target_size: [size.0, size.1],
        size: [first.width, first.height],
        opacity,
        levels: solved.levels,
        resolutions,
        comparison,
        warnings,
    };
    let json = serde_json::to_vec_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?;
    write_atomically(&args.output().join(report_file), &json)?;
    Ok(report)
}

fn read_tiles(
    args: &SolveArgs,
    kind: MapKind,
    format: BlockFormat,
    console: &Console,
    warnings: &mut Vec<String>,
) -> Result<Tiles, Error> {
    let mut tiles = Tiles::new();
    for flag in &args.layer {
        let mut read = |file: &Path, kind: MapKind, y_down: bool, is_mask: bool| -> Result<(), Error> {
            let key = (file.to_path_buf(), y_down, is_mask);
            if tiles.contains_key(&key) {
                return Ok(());
            }
            let baked = has_extension(file, "ktx2") || has_extension(file, "dds");
            let tile = if baked {
                read_texture(file).and_then(|texture| Tile::from_texture(texture, kind))
            } else {
                let encoding = if is_mask { BlockFormat::Bc7.encoding() } else { format.encoding() };
                let options = TileOptions {
                    y_down,
                    center: args.center && !is_mask,
                    ..TileOptions::new(kind, encoding)
                };
                args.read(file).and_then(|image| {
                    if kind == MapKind::Normal {
                        warnings.extend(green_doubt(
                            file,
                            &image,
                            y_down,
                            ["y-down of the layer", "y-up of the layer"],
                        ));
                    }
                    let texels = u64::from(image.width) * u64::from(image.height) * 4 / 3;
                    let stage = console.progress().stage(format!("compressing {}", file_name(file)), texels);
                    Tile::bake(&image, options, &|n| stage.tick(n))
                })
            };
            tiles.insert(key, named(file, tile)?);
            Ok(())
        };
        read(&flag.tile, kind, flag.y_down, false)?;
        if let Some(mask) = &flag.mask {
            read(mask, MapKind::Data, false, true)?;
        }
    }
    Ok(tiles)
}

/// A sentence for each layer whose name says another kind than the target's.
fn layer_kinds(args: &SolveArgs, kind: KindName) -> Vec<String> {
    let tiles: BTreeSet<&PathBuf> = args.layer.iter().map(|layer| &layer.tile).collect();
    let others = tiles.into_iter().filter_map(|tile| Some((tile, KindName::of_file(tile)?)));
    let doubts = others.filter(|(_, own)| *own != kind).map(|(tile, own)| {
        format!(
            "{}: its name says {}, and it is laid under a target of kind {}; take the tile's {} map, or say --kind",
            tile.display(),
            own.name(),
            kind.name(),
            kind.name()
        )
    });
    doubts.collect()
}

/// A sentence on normals whose slopes clearly say that green points the other way than a flag or their name does; `flags`
/// say that it points down and up.
fn green_doubt(file: &Path, image: &Image, y_down: bool, flags: [&str; 2]) -> Option<String> {
    let said = if y_down { Green::Down } else { Green::Up };
    let (way, fix) = match said {
        Green::Up => ("down (DirectX)", format!("give {}", flags[0])),
        Green::Down if green_by_name(file) => ("up (OpenGL)", format!("give {}", flags[1])),
        Green::Down => ("up (OpenGL)", format!("leave out {}", flags[0])),
    };
    guess_green(image)
        .contradicts(said)
        .then(|| format!("{}: its slopes say that green points {way}; then {fix}", file.display()))
}

/// An error that lacks a file's name gets it.
fn named<T>(file: &Path, result: Result<T, kinran_image::Error>) -> Result<T, Error> {
    result.map_err(|e| match e {
        kinran_image::Error::Unsupported(reason) => kinran_image::Error::malformed(file, reason).into(),
        other => other.into(),
    })
}

fn write_textures(
    args: &SolveArgs,
    stem: &str,
    solved: &Solved,
    tiles: &Tiles,
    writing: &Stage,
) -> Result<Vec<String>, Error> {
    kinran_image::make_folder(args.output())?;
    let mut files = Vec::new();
    let mut write = |name: String, texture: &kinran_image::Texture, map: Content| -> Result<(), Error> {
        let mut texture = texture.clone();
        map.mark(&mut texture);
        for extension in args.container.extensions() {
            let file = format!("{name}.{extension}");
            let bytes = match *extension {
                "dds" => encode_dds(&texture)?,
                _ => encode_ktx2(&texture, (args.zstd > 0).then_some(args.zstd))?,
            };
            write_atomically(&args.output().join(&file), &bytes)?;
            files.push(file);
            writing.add(1);
        }
        Ok(())
    };
    write(format!("{stem}_synthesized"), &solved.texture, Content::Synthesized)?;
    for (key, tile) in tiles {
        if writes_tile(args, key) {
            write(
                tile_name(key, || tiles.keys()),
                &tile.texture,
                if key.2 { Content::Mask } else { Content::Detail },
            )?;
        }
    }
    Ok(files)
}

/// The files of a texture.
fn texture_files(args: &SolveArgs, name: &str) -> Vec<String> {
    args.container.extensions().iter().map(|extension| format!("{name}.{extension}")).collect()
}

/// Name of a tile's or mask's texture: the image's, after its folder's where others are called so too.
fn tile_name<'a, K: Iterator<Item = &'a TileKey>>(key: &TileKey, all: impl Fn() -> K) -> String {
    let name = |(file, y_down, is_mask): &TileKey| {
        file_stem(file) + if *y_down { "_y_down" } else { "" } + if *is_mask { "_mask" } else { "" }
    };
    let mine = name(key);
    let alone = all().filter(|other| name(other) == mine).count() == 1;
    match key.0.parent().and_then(Path::file_name) {
        Some(folder) if !alone => format!("{}_{mine}", folder.to_string_lossy()),
        _ => mine,
    }
}

fn file_stem(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
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
    let json = format!("{}.detail.json", file_stem(Path::new(&report.target)));
    text += &format!("wrote {} and {json}, in {}\n", report.files.join(", "), folder.display());
    text + &kept_remark(&report.kept)
}

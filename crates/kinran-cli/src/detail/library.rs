//! `kinran detail report`: a whole library of materials, in the manner of the talk's table.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec2;
use kinran_bake::aniso::{
    Filter, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps, SurfaceOptions,
    bake_surface,
};
use kinran_bake::detail::{
    Comparison, DetailOptions, FADE_TRIALS, Layer, LayerTransform, MapKind, Mask, Paint, PaintGuides, Target,
    Tile, TileOptions, bearable_opacity, compare, level_pictures,
};
use kinran_bake::folder::{Green, Role, named_maps};
use kinran_image::{
    Channels, Encoding, Image, Level, Pixels, Tick, encode_png, read_layer, untold, write_atomically,
};
use kinran_scene::Wrap;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::{BlockFormat, KindName, page};
use crate::outputs::{check_folder, named_after, refuse_other_page, tell_place};
use crate::table::table;
use crate::values::{exr_layer, exr_layer_of, list};
use crate::{Console, Error};

/// Paints a target over every material of a folder, solves each and reports the errors: report.json and index.html
///
/// FOLDER holds a folder for each material, with maps named as exporters name them. Every target is painted (grime by
/// occlusion and in cavities, rubbed edges, large-scale colour) over its material and a second one in patches, tiled at
/// twice the target's density, and solved three times: "own" against the tiles it was painted over, as in the talk;
/// "other" against the one tile of all other materials that is nearest in its colours, which has nothing to do with the
/// target; "faded" against the same at the largest opacity with which the result is no worse than the compressed target.
/// Numbers are those at half size, as in the talk, and as authored. Aniso maps are made of normals and roughness
/// where a material has none.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran detail report materials/ -o report/
  kinran detail report materials/ -o report/ \\
      --format bc1 --kind color --size 512")]
pub struct LibraryArgs {
    /// A folder of folders of maps
    #[arg(value_name = "FOLDER")]
    pub folder: PathBuf,

    /// Where the report goes; made if it is not there [default: NAME.report beside the folder]
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Formats of colour, packed data and aniso maps; may be given again [default: bc1 and bc7]. Normals are BC5, grey
    /// maps BC4
    #[arg(long, value_enum)]
    pub format: Vec<BlockFormat>,

    /// Kinds of maps; may be given again [default: all that are there]
    #[arg(long, value_enum)]
    pub kind: Vec<KindName>,

    /// Side of the targets in texels
    #[arg(long, value_name = "TEXELS", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(16..=8192))]
    pub size: u32,

    /// Which layer of an EXR file holds the map, by its path in FOLDER or its name; may be given again
    #[arg(long, value_name = "FILE=LAYER", value_parser = exr_layer)]
    pub exr_layer: Vec<(PathBuf, String)>,

    /// Centre the histograms of the tiles
    #[arg(long)]
    pub center: bool,

    /// No third solution, against the other tile faded until the result is no worse than the compressed target
    #[arg(long)]
    pub no_fade: bool,

    /// No pictures, numbers only
    #[arg(long)]
    pub no_pictures: bool,
}

impl LibraryArgs {
    /// Where the report goes.
    fn output(&self) -> PathBuf {
        self.output.clone().unwrap_or_else(|| named_after(&self.folder, ".report"))
    }

    fn wants(&self, kind: MapKind) -> bool {
        self.kind.is_empty() || self.kind.iter().any(|&name| MapKind::from(name) == kind)
    }
}

/// A map of a material.
#[derive(Clone, Debug)]
struct MapFile {
    role: Role,
    kind: MapKind,
    y_down: bool,
    image: Image,
}

impl MapFile {
    /// Heights are only painted by, and so is occlusion where no data is asked for.
    fn is_target(&self, args: &LibraryArgs) -> bool {
        self.role != Role::Height && args.wants(self.kind)
    }
}

struct Material {
    name: String,
    maps: Vec<MapFile>,
}

impl Material {
    fn map(&self, role: Role) -> Option<&MapFile> {
        self.maps.iter().find(|map| map.role == role)
    }
}

/// Which tiles a target was solved against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Against {
    /// Those it was painted over.
    Own,
    /// The nearest of another material.
    Other,
    /// The same, at the largest opacity with which the result is no worse than the compressed target.
    Faded,
}

impl Against {
    /// As it is called in tables and file names.
    pub(super) fn name(self) -> &'static str {
        match self {
            Against::Own => "own",
            Against::Other => "other",
            Against::Faded => "faded",
        }
    }
}

/// One target solved in one way.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LibraryRow {
    /// The material that the target was painted over.
    pub material: String,
    /// Which of its maps.
    pub map: String,
    /// Format of the synthesized map and its tiles.
    pub format: String,
    /// The materials whose tiles it was solved against.
    pub tiles: Vec<String>,
    /// Which tiles these are.
    pub against: Against,
    /// Their opacity.
    pub opacity: f32,
    /// The numbers.
    pub comparison: Comparison,
}

/// Means of one kind of rows at one level.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LibraryMean {
    /// Which maps.
    pub map: String,
    /// Their format.
    pub format: String,
    /// Which tiles.
    pub against: Against,
    /// Mean opacity of the tiles.
    pub opacity: f32,
    /// 0 the finest.
    pub level: usize,
    /// How many.
    pub count: usize,
    /// Mean error of the compressed targets.
    pub target: f32,
    /// With everything.
    pub blended: f32,
    /// By the talk's method.
    pub talk: f32,
    /// The talk's with plain overlay.
    pub plain_overlay: f32,
    /// The talk's without compensation.
    pub uncompensated: f32,
    /// How many of the blended are no worse than the compressed target.
    pub no_worse: usize,
    /// Of the finest level: with everything and by the talk's method where it is magnified twice, see
    /// [`MagnifiedComparison`](kinran_bake::detail::MagnifiedComparison).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub magnified: Option<[f32; 2]>,
}

/// The whole report.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LibraryReport {
    /// Side of the targets.
    pub size: u32,
    /// Means, in the manner of the talk's table.
    pub means: Vec<LibraryMean>,
    /// Every target.
    pub rows: Vec<LibraryRow>,
    /// What was left out, a sentence each.
    pub warnings: Vec<String>,
}

pub(super) fn run(args: &LibraryArgs, console: &Console) -> Result<(), Error> {
    let output = args.output();
    check_folder(&output)?;
    refuse_other_page(&output.join("index.html"))?;
    let report = report_library(args, console)?;
    report.warnings.iter().for_each(|warning| console.warn(warning));
    let pages = ["index.html", "report.json"].map(|file| output.join(file).display().to_string());
    console.result(&report, &format!("{}wrote {}\n", text(&report), pages.join(", ")))?;
    tell_place(console, args.output.as_deref(), &output);
    Ok(())
}

/// Paints, solves, measures and writes the report.
///
/// # Errors
/// The folder has no materials with maps of the kinds asked for, a map cannot be read, or the output cannot be written.
pub fn report_library(args: &LibraryArgs, console: &Console) -> Result<LibraryReport, Error> {
    let (materials, warnings) = read_materials(args, console)?;
    let formats =
        if args.format.is_empty() { vec![BlockFormat::Bc1, BlockFormat::Bc7] } else { args.format.clone() };
    let output = args.output();
    let pictures = output.join("pictures");
    let folder = if args.no_pictures { &output } else { &pictures };
    kinran_image::make_folder(folder)?;
    let of_map = |map: &MapFile| formats_of(map, &formats).len() as u64 * texels(args, map);
    let targets = materials.iter().flat_map(|m| m.maps.iter().filter(|map| map.is_target(args)));
    let stage = console.progress().stage("painting and solving", targets.map(of_map).sum());
    let mut report = LibraryReport { size: args.size, means: Vec::new(), rows: Vec::new(), warnings };
    for (i, material) in materials.iter().enumerate() {
        for map in material.maps.iter().filter(|map| map.is_target(args)) {
            for (n, format) in formats_of(map, &formats).iter().enumerate() {
                let shown = (!args.no_pictures && n == 0).then_some(pictures.as_path());
                let done = AtomicU64::new(0);
                let tick = |texels| {
                    done.fetch_add(texels, Ordering::Relaxed);
                    stage.tick(texels)
                };
                report.rows.extend(solve_map(args, &materials, i, map, *format, shown, &tick)?);
                // What turned out not to be needed.
                stage.add(texels(args, map).saturating_sub(done.into_inner()));
            }
        }
    }
    drop(stage);
    report.means = means(&report.rows);
    let json = serde_json::to_vec_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?;
    write_atomically(&output.join("report.json"), &json)?;
    write_atomically(&output.join("index.html"), page::page(&report, !args.no_pictures).as_bytes())?;
    Ok(report)
}

/// The formats that a map is solved in, of those asked for.
fn formats_of<'a>(map: &MapFile, formats: &'a [BlockFormat]) -> &'a [BlockFormat] {
    match map.kind {
        MapKind::Normal => &[BlockFormat::Bc5],
        MapKind::Data if matches!(map.image.channels, Channels::R | Channels::Rg) => &[BlockFormat::Bc4],
        _ => formats,
    }
}

/// Texels that are solved for a map in one format, at most: three comparisons of five solutions with their mips, and the
/// trials of an opacity at two levels.
fn texels(args: &LibraryArgs, map: &MapFile) -> u64 {
    let level = u64::from(args.size) * u64::from(args.size);
    match args.no_fade || map.kind == MapKind::Aniso {
        true => 2 * 5 * level * 4 / 3,
        false => 3 * 5 * level * 4 / 3 + FADE_TRIALS * level * 5 / 4,
    }
}

/// Paints one target and solves it against its own tiles and against another's.
fn solve_map(
    args: &LibraryArgs,
    materials: &[Material],
    index: usize,
    map: &MapFile,
    format: BlockFormat,
    pictures: Option<&Path>,
    tick: &Tick<'_>,
) -> Result<Vec<LibraryRow>, Error> {
    let material = &materials[index];
    let encoding = format.encoding();
    let tile_of = |map: &MapFile, encoding: Encoding, center: bool| {
        let options = TileOptions { y_down: map.y_down, center, ..TileOptions::new(map.kind, encoding) };
        Tile::new(&map.image, options)
    };
    let others: Vec<usize> = (1..materials.len())
        .map(|step| (index + step) % materials.len())
        .filter(|&i| materials[i].map(map.role).is_some())
        .collect();

    // Paint over the material, and over another in patches.
    let rgba8 = BlockFormat::Rgba8.encoding();
    let guide = |role: Role| {
        material
            .map(role)
            .map(|map| tile_of(&MapFile { kind: MapKind::Data, ..map.clone() }, rgba8, false))
            .transpose()
    };
    let (height, occlusion) = (guide(Role::Height)?, guide(Role::Occlusion)?);
    let base = tile_of(map, encoding, args.center)?;
    let second = others
        .get(others.len() / 3)
        .map(|&i| tile_of(materials[i].map(map.role).expect("it was looked for"), encoding, args.center))
        .transpose()?;
    let seed = index as u32 * 97 + 13;
    let mask = Tile::new(
        &patches(args.size / 2, seed)?,
        TileOptions::new(MapKind::Data, BlockFormat::Bc4.encoding()),
    )?;
    let mut own = vec![layer_of(&base, args.size)];
    if let Some(second) = &second {
        own.push(Layer {
            mask: Some(Mask { map: &mask, channel: 0, contrast: 2.0 }),
            ..layer_of(second, args.size)
        });
    }
    let guides = PaintGuides { height: height.as_ref(), occlusion: occlusion.as_ref() };
    let paint = Paint::new(guides, &layer_of(&base, args.size), (args.size, args.size), seed)?;
    // Paint goes over what was scanned; only the solver sees centred tiles.
    let plain = [
        tile_of(map, rgba8, false)?,
        match others.get(others.len() / 3) {
            Some(&i) => tile_of(materials[i].map(map.role).expect("it was looked for"), rgba8, false)?,
            None => tile_of(map, rgba8, false)?,
        },
    ];
    let under: Vec<Layer> = own.iter().zip(&plain).map(|(layer, tile)| Layer { tile, ..*layer }).collect();
    let grey = matches!(map.image.channels, Channels::R | Channels::Rg);
    let image = paint.target(&under, map.kind, map.kind == MapKind::Data && grey)?;
    let target = Target::new(&image, map.kind, false)?;

    let options = DetailOptions::new(encoding);
    let mut rows = Vec::new();
    let mut solve = |layers: &[Layer], tiles: Vec<String>, against: Against| -> Result<(), Error> {
        let (comparison, solved) = compare(&target, layers, &options, tick)?;
        if let Some(folder) = pictures {
            let shown = level_pictures(&target, layers, &options, &solved, 1)?;
            let side = 256.min(args.size / 2);
            for (name, picture) in page::PICTURES.into_iter().zip([
                &shown.detail,
                &shown.synthesized,
                &shown.blended,
                &shown.target,
                &shown.error,
                &shown.target_error,
            ]) {
                let file = page::picture_file(&material.name, map.role.name(), against.name(), name);
                write_atomically(&folder.join(file), &encode_png(&crop(picture, side)?)?)?;
            }
        }
        rows.push(LibraryRow {
            material: material.name.clone(),
            map: map.role.name().into(),
            format: format!("{:?}", encoding.format).to_uppercase(),
            tiles,
            against,
            opacity: layers[0].opacity,
            comparison,
        });
        Ok(())
    };
    let second_name = others.get(others.len() / 3).map(|&i| materials[i].name.clone());
    solve(&own, std::iter::once(material.name.clone()).chain(second_name).collect(), Against::Own)?;
    let near = others.iter().copied().min_by(|&a, &b| {
        let distance =
            |i: usize| distance(&image, &materials[i].map(map.role).expect("it was looked for").image);
        distance(a).total_cmp(&distance(b))
    });
    if let Some(near) = near {
        let tile = tile_of(materials[near].map(map.role).expect("it was looked for"), encoding, args.center)?;
        let (layer, name) = (layer_of(&tile, args.size), vec![materials[near].name.clone()]);
        solve(&[layer], name.clone(), Against::Other)?;
        // An aniso map has an opacity of its own.
        if !args.no_fade
            && map.kind != MapKind::Aniso
            && let Some(opacity) = bearable_opacity(&target, &[layer], &options, tick)?
        {
            solve(&[Layer { opacity, ..layer }], name, Against::Faded)?;
        }
    }
    Ok(rows)
}

/// A tile at twice the target's density.
fn layer_of(tile: &Tile, size: u32) -> Layer<'_> {
    let (width, height) = tile.size();
    let repeats = |side: u32| (2.0 * size as f32 / side as f32).round().max(1.0);
    let scale = Vec2::new(repeats(width), repeats(height));
    Layer { transform: LayerTransform { scale, ..LayerTransform::default() }, ..Layer::new(tile) }
}

/// A mask of soft patches.
fn patches(side: u32, seed: u32) -> Result<Image, Error> {
    let bytes = (0..side * side)
        .map(|i| {
            let (x, y) = ((i % side) as f32 / side as f32, (i / side) as f32 / side as f32);
            let phase = seed as f32;
            let wave = libm::sinf(7.0 * x + 3.0 * libm::sinf(5.0 * y + phase) + phase)
                + libm::sinf(6.0 * y + 2.0 * libm::sinf(9.0 * x - phase));
            ((0.35 + 0.35 * wave).clamp(0.0, 1.0) * 255.0 + 0.5) as u8
        })
        .collect();
    Ok(Image::new(side, side, Channels::R, Pixels::U8(bytes))?)
}

/// How far two images are apart in the mean and the spread of their samples.
fn distance(a: &Image, b: &Image) -> f64 {
    let [a, b] = [a, b].map(moments);
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// Mean and standard deviation of red, green and blue, over every eighth texel of every eighth row.
fn moments(image: &Image) -> [f64; 6] {
    let (mut sums, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for y in (0..image.height).step_by(8) {
        for x in (0..image.width).step_by(8) {
            let texel = image.texel(x, y);
            for c in 0..3 {
                sums[c] += f64::from(texel[c]);
                squares[c] += f64::from(texel[c]) * f64::from(texel[c]);
            }
            count += 1.0;
        }
    }
    std::array::from_fn(|i| {
        let mean = sums[i % 3] / count;
        if i < 3 { mean } else { (squares[i % 3] / count - mean * mean).max(0.0).sqrt() }
    })
}

/// The middle of a picture.
fn crop(image: &Image, side: u32) -> Result<Image, Error> {
    let Pixels::U8(bytes) = &image.pixels else { return Ok(image.clone()) };
    let (w, h) = (side.min(image.width), side.min(image.height));
    let (x0, y0) = ((image.width - w) / 2, (image.height - h) / 2);
    let n = image.channels.count();
    let rows = (y0..y0 + h).flat_map(|y| {
        let start = (y as usize * image.width as usize + x0 as usize) * n;
        bytes[start..start + w as usize * n].iter().copied()
    });
    Ok(Image::new(w, h, image.channels, Pixels::U8(rows.collect()))?)
}

/// The materials of a folder that have a map to paint over, in the order of their names, and a sentence on folders that have
/// none.
fn read_materials(args: &LibraryArgs, console: &Console) -> Result<(Vec<Material>, Vec<String>), Error> {
    let io = |e| kinran_image::Error::io(&args.folder, e);
    let mut folders: Vec<PathBuf> = std::fs::read_dir(&args.folder)
        .map_err(io)?
        .map(|entry| entry.map(|entry| entry.path()).map_err(io))
        .collect::<Result<_, _>>()?;
    folders.retain(|folder| folder.is_dir());
    folders.sort();
    let stage = console.progress().stage("reading maps", folders.len() as u64);
    let materials: Vec<Material> = folders
        .par_iter()
        .map(|folder| {
            let maps = read_maps(folder, args);
            stage.add(1);
            let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
            Ok(Material { name, maps: maps? })
        })
        .collect::<Result<_, Error>>()?;
    drop(stage);
    let (materials, others): (Vec<_>, Vec<_>) =
        materials.into_iter().partition(|material| material.maps.iter().any(|map| map.is_target(args)));
    if materials.is_empty() {
        return Err(Error::file_error(
            &args.folder,
            "there is no folder with maps in it; give a folder of folders with maps named as color, normal, roughness, \
             ao or metallic",
        ));
    }
    let left_out = (!others.is_empty()).then(|| {
        let names: Vec<String> = others.into_iter().map(|material| material.name).collect();
        format!("left out, for no map in them is named as one that is asked for: {}", list(&names))
    });
    Ok((materials, left_out.into_iter().collect()))
}

/// The maps of a material that are painted over or painted by.
fn read_maps(folder: &Path, args: &LibraryArgs) -> Result<Vec<MapFile>, Error> {
    let mut maps: Vec<MapFile> = Vec::new();
    for (file, role, green) in named_maps(folder)? {
        let kind = match KindName::of_role(role) {
            // Several quantities of one file would be painted by a guide of one.
            Some(kind) if !role.is_packed() => kind.into(),
            None if role == Role::Height => MapKind::Data,
            _ => continue,
        };
        let guide = matches!(role, Role::Height | Role::Occlusion);
        // An aniso map is made from these, where there is none.
        let source = args.wants(MapKind::Aniso) && matches!(role, Role::Normal | Role::Roughness);
        if maps.iter().any(|map| map.role == role) || !(guide || source || args.wants(kind)) {
            continue;
        }
        let y_down = green == Some(Green::Down);
        let image = read_layer(&file, exr_layer_of(&args.exr_layer, &file, &args.folder))?;
        maps.push(MapFile { role, kind, y_down, image });
    }
    if args.wants(MapKind::Aniso) && !maps.iter().any(|map| map.role == Role::Aniso) {
        maps.extend(aniso_map(&maps)?);
    }
    Ok(maps)
}

/// An aniso map of half the size, filtered from normals and roughness: where normals lie along grooves or threads, four
/// of them together are anisotropic.
fn aniso_map(maps: &[MapFile]) -> Result<Option<MapFile>, Error> {
    let map = |role: Role| maps.iter().find(|map| map.role == role);
    let (Some(normal), Some(roughness)) = (map(Role::Normal), map(Role::Roughness)) else { return Ok(None) };
    let surface = SurfaceMaps {
        normal: NormalMap::new(Arc::new(normal.image.clone()), normal.y_down),
        roughness: RoughnessMaps::Isotropic(ScalarMap::channel(Arc::new(roughness.image.clone()), 0)),
        wrap: [Wrap::Repeat; 2],
        weights: None,
    };
    let request =
        SheetRequest { sheet: Sheet::Aniso, encoding: BlockFormat::Rgba8.encoding(), packed_with: None };
    let options = SurfaceOptions { filter: Filter::Linear, ..SurfaceOptions::default() };
    let baked = bake_surface(&surface, options, &[request], &untold)?;
    let Some(Level { width, height, data }) = baked.textures[0].levels.get(1) else { return Ok(None) };
    let image = Image::new(*width, *height, Channels::Rgba, Pixels::U8(data.clone()))?;
    Ok(Some(MapFile { role: Role::Aniso, kind: MapKind::Aniso, y_down: false, image }))
}

fn means(rows: &[LibraryRow]) -> Vec<LibraryMean> {
    let mut groups: std::collections::BTreeMap<(String, String, Against, usize), Vec<&LibraryRow>> =
        Default::default();
    for row in rows {
        for level in [1, 0] {
            if row.comparison.levels.len() > level {
                groups
                    .entry((row.map.clone(), row.format.clone(), row.against, 1 - level))
                    .or_default()
                    .push(row);
            }
        }
    }
    groups
        .into_iter()
        .map(|((map, format, against, level), rows)| {
            let level = 1 - level;
            let mean = |of: &dyn Fn(&kinran_bake::detail::LevelComparison) -> f32| {
                rows.iter().map(|row| of(&row.comparison.levels[level])).sum::<f32>() / rows.len() as f32
            };
            let no_worse = rows.iter().filter(|row| {
                let errors = &row.comparison.levels[level];
                errors.blended <= errors.target
            });
            LibraryMean {
                map,
                format,
                against,
                opacity: rows.iter().map(|row| row.opacity).sum::<f32>() / rows.len() as f32,
                level,
                count: rows.len(),
                target: mean(&|e| e.target),
                blended: mean(&|e| e.blended),
                talk: mean(&|e| e.talk),
                plain_overlay: mean(&|e| e.plain_overlay),
                uncompensated: mean(&|e| e.uncompensated),
                no_worse: no_worse.count(),
                magnified: (level == 0).then(|| {
                    let mean = |of: &dyn Fn(&Comparison) -> f32| {
                        rows.iter().map(|row| of(&row.comparison)).sum::<f32>() / rows.len() as f32
                    };
                    [mean(&|c| c.magnified.blended), mean(&|c| c.magnified.talk)]
                }),
            }
        })
        .collect()
}

fn text(report: &LibraryReport) -> String {
    let mut rows = vec![
        [
            "map",
            "format",
            "tiles",
            "opacity",
            "level",
            "count",
            "target",
            "blended",
            "talk",
            "plain overlay",
            "uncompensated",
            "no worse",
            "magnified (talk)",
        ]
        .map(String::from)
        .to_vec(),
    ];
    for mean in &report.means {
        rows.push(page::cells(mean).to_vec());
    }
    table(&rows)
}

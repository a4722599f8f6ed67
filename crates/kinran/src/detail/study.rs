//! A whole library of materials, in the manner of the talk's table.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use glam::Vec2;
use kinran_bake::aniso::{
    Filter, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps, SurfaceOptions,
    bake_surface,
};
use kinran_bake::detail::{
    Comparison, DetailOptions, FADE_TRIALS, Layer, LayerTransform, Mask, Paint, PaintGuides, Target, Tile,
    TileOptions, bearable_opacity, compare, level_pictures,
};
use kinran_bake::folder::{Green, Role, named_maps_in};
use kinran_image::{
    Channels, Encoding, Files, Format, Image, Level, Pixels, Tick, decode_layer, encode_png, untold,
};
use kinran_scene::Wrap;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::{MapKind, encoding as encoding_of, exr_layer_of, kind_of_role};
use crate::error::InputFault;
use crate::names::file_name;
use crate::{Error, Sink, Stage, Task};

/// How a library of materials is tried.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct StudyOptions {
    /// Formats of colour, packed data and aniso maps; where there is none, BC1 and BC7. Normals are BC5, grey maps BC4.
    pub formats: Vec<Format>,
    /// Kinds of maps; where there is none, all.
    pub kinds: Vec<MapKind>,
    /// Side of the targets in texels, 16 to 8192; 1024 by default.
    pub size: u32,
    /// Which layer of an EXR file holds the map, by its path from the folder or its name.
    pub exr_layer: Vec<(PathBuf, String)>,
    /// Whether the histograms of the tiles are centred.
    pub center: bool,
    /// Whether there is a third solution, against the other tile faded until the result is no worse than the compressed
    /// target; there is by default.
    pub fade: bool,
    /// Whether pictures are written; they are by default.
    pub pictures: bool,
}

impl Default for StudyOptions {
    fn default() -> Self {
        StudyOptions {
            formats: Vec::new(),
            kinds: Vec::new(),
            size: 1024,
            exr_layer: Vec::new(),
            center: false,
            fade: true,
            pictures: true,
        }
    }
}

impl StudyOptions {
    fn wants(&self, kind: MapKind) -> bool {
        self.kinds.is_empty() || self.kinds.contains(&kind)
    }
}

/// Pictures of a target that a study writes, in order.
pub const PICTURES: [&str; 6] = ["detail", "synthesized", "blended", "target", "error", "target-error"];

/// Name of a picture, in the folder `pictures`.
pub fn picture_file(material: &str, map: &str, which: &str, picture: &str) -> String {
    format!("{material}_{map}_{which}_{picture}.png")
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
    fn is_target(&self, how: &StudyOptions) -> bool {
        self.role != Role::Height && how.wants(self.kind)
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
    pub fn name(self) -> &'static str {
        match self {
            Against::Own => "own",
            Against::Other => "other",
            Against::Faded => "faded",
        }
    }
}

/// One target solved in one way.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StudyRow {
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
pub struct StudyMean {
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
pub struct StudyReport {
    /// Side of the targets.
    pub size: u32,
    /// Means, in the manner of the talk's table.
    pub means: Vec<StudyMean>,
    /// Every target.
    pub rows: Vec<StudyRow>,
    /// What was left out, a sentence each.
    pub warnings: Vec<String>,
}

/// Paints a target over every material of a folder, solves each and reports the errors, in report.json; pictures go to the
/// folder `pictures`.
///
/// The folder holds a folder for each material, with maps named as exporters name them. Every target is painted over its
/// material and a second one in patches, tiled at twice the target's density, and solved against the tiles it was painted
/// over, against the nearest tile of another material, and against that one faded.
///
/// The destination is not told that all is finished: who makes a page of the report puts it beside.
///
/// # Errors
/// [`Error::Option`] for a size out of its range; the folder has no materials with maps of the kinds asked for, a map cannot be
/// read, or the output cannot be written.
pub fn study(
    files: &dyn Files,
    folder: &Path,
    how: &StudyOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<StudyReport, Error> {
    if !(16..=8192).contains(&how.size) {
        let (given, reason) = (how.size.to_string(), "give 16 to 8192".into());
        return Err(Error::Option { option: "size", given, file: None, reason });
    }
    let (materials, warnings) = read_materials(files, folder, how, task)?;
    let formats = if how.formats.is_empty() { vec![Format::Bc1, Format::Bc7] } else { how.formats.clone() };
    let of_map = |map: &MapFile| formats_of(map, &formats).len() as u64 * texels(how, map);
    let targets = materials.iter().flat_map(|m| m.maps.iter().filter(|map| map.is_target(how)));
    let work = task.begin(Stage::Studying, "", targets.map(of_map).sum())?;
    let mut report = StudyReport { size: how.size, means: Vec::new(), rows: Vec::new(), warnings };
    for (i, material) in materials.iter().enumerate() {
        for map in material.maps.iter().filter(|map| map.is_target(how)) {
            for (n, format) in formats_of(map, &formats).iter().enumerate() {
                let shown = (how.pictures && n == 0).then_some(out);
                let done = AtomicU64::new(0);
                let tick = |texels| {
                    done.fetch_add(texels, Ordering::Relaxed);
                    work.tick(texels)
                };
                report.rows.extend(solve_map(how, &materials, i, map, *format, shown, &tick)?);
                // What turned out not to be needed.
                work.tick(texels(how, map).saturating_sub(done.into_inner()))?;
            }
        }
    }
    drop(work);
    report.means = means(&report.rows);
    let json = serde_json::to_vec_pretty(&report).map_err(|e| Error::Internal(e.to_string()))?;
    out.put("report.json", &json)?;
    Ok(report)
}

/// The formats that a map is solved in, of those asked for.
fn formats_of<'a>(map: &MapFile, formats: &'a [Format]) -> &'a [Format] {
    match map.kind {
        MapKind::Normal => &[Format::Bc5],
        MapKind::Data if matches!(map.image.channels, Channels::R | Channels::Rg) => &[Format::Bc4],
        _ => formats,
    }
}

/// Texels that are solved for a map in one format, at most: three comparisons of five solutions with their mips, and the
/// trials of an opacity at two levels.
fn texels(how: &StudyOptions, map: &MapFile) -> u64 {
    let level = u64::from(how.size) * u64::from(how.size);
    match !how.fade || map.kind == MapKind::Aniso {
        true => 2 * 5 * level * 4 / 3,
        false => 3 * 5 * level * 4 / 3 + FADE_TRIALS * level * 5 / 4,
    }
}

/// Paints one target and solves it against its own tiles and against another's.
fn solve_map(
    how: &StudyOptions,
    materials: &[Material],
    index: usize,
    map: &MapFile,
    format: Format,
    pictures: Option<&dyn Sink>,
    tick: &Tick<'_>,
) -> Result<Vec<StudyRow>, Error> {
    let material = &materials[index];
    let encoding = encoding_of(format);
    let tile_of = |map: &MapFile, encoding: Encoding, center: bool| {
        let options = TileOptions { y_down: map.y_down, center, ..TileOptions::new(map.kind, encoding) };
        Tile::new(&map.image, options)
    };
    let others: Vec<usize> = (1..materials.len())
        .map(|step| (index + step) % materials.len())
        .filter(|&i| materials[i].map(map.role).is_some())
        .collect();

    // Paint over the material, and over another in patches.
    let rgba8 = encoding_of(Format::Rgba8);
    let guide = |role: Role| {
        material
            .map(role)
            .map(|map| tile_of(&MapFile { kind: MapKind::Data, ..map.clone() }, rgba8, false))
            .transpose()
    };
    let (height, occlusion) = (guide(Role::Height)?, guide(Role::Occlusion)?);
    let base = tile_of(map, encoding, how.center)?;
    let second = others
        .get(others.len() / 3)
        .map(|&i| tile_of(materials[i].map(map.role).expect("it was looked for"), encoding, how.center))
        .transpose()?;
    let seed = index as u32 * 97 + 13;
    let mask =
        Tile::new(&patches(how.size / 2, seed)?, TileOptions::new(MapKind::Data, encoding_of(Format::Bc4)))?;
    let mut own = vec![layer_of(&base, how.size)];
    if let Some(second) = &second {
        own.push(Layer {
            mask: Some(Mask { map: &mask, channel: 0, contrast: 2.0 }),
            ..layer_of(second, how.size)
        });
    }
    let guides = PaintGuides { height: height.as_ref(), occlusion: occlusion.as_ref() };
    let paint = Paint::new(guides, &layer_of(&base, how.size), (how.size, how.size), seed)?;
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
        if let Some(out) = pictures {
            let shown = level_pictures(&target, layers, &options, &solved, 1)?;
            let side = 256.min(how.size / 2);
            for (name, picture) in PICTURES.into_iter().zip([
                &shown.detail,
                &shown.synthesized,
                &shown.blended,
                &shown.target,
                &shown.error,
                &shown.target_error,
            ]) {
                let file = picture_file(&material.name, map.role.name(), against.name(), name);
                out.put(&format!("pictures/{file}"), &encode_png(&crop(picture, side)?)?)?;
            }
        }
        rows.push(StudyRow {
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
        let tile = tile_of(materials[near].map(map.role).expect("it was looked for"), encoding, how.center)?;
        let (layer, name) = (layer_of(&tile, how.size), vec![materials[near].name.clone()]);
        solve(&[layer], name.clone(), Against::Other)?;
        // An aniso map has an opacity of its own.
        if how.fade
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
fn read_materials(
    files: &dyn Files,
    folder: &Path,
    how: &StudyOptions,
    task: Task<'_>,
) -> Result<(Vec<Material>, Vec<String>), Error> {
    let entries = files.list(folder).map_err(|e| kinran_image::Error::io(folder, e))?;
    let folders: Vec<PathBuf> =
        entries.into_iter().filter(|entry| entry.is_folder).map(|entry| entry.path).collect();
    let reading = task.begin(Stage::Reading, "maps", folders.len() as u64)?;
    let read = |inner: &PathBuf| {
        let maps = read_maps(files, folder, inner, how)?;
        reading.tick(1)?;
        Ok(Material { name: file_name(inner), maps })
    };
    let materials = folders.par_iter().map(read).collect::<Result<Vec<Material>, Error>>()?;
    let (materials, others): (Vec<_>, Vec<_>) =
        materials.into_iter().partition(|material| material.maps.iter().any(|map| map.is_target(how)));
    if materials.is_empty() {
        return Err(Error::Input { path: folder.into(), fault: InputFault::NoMaterials });
    }
    let left_out = (!others.is_empty()).then(|| {
        let names: Vec<String> = others.into_iter().map(|material| material.name).collect();
        format!("left out, for no map in them is named as one that is asked for: {}", names.join(", "))
    });
    Ok((materials, left_out.into_iter().collect()))
}

/// The maps of a material that are painted over or painted by.
fn read_maps(
    files: &dyn Files,
    root: &Path,
    folder: &Path,
    how: &StudyOptions,
) -> Result<Vec<MapFile>, Error> {
    let mut maps: Vec<MapFile> = Vec::new();
    for (file, role, green) in named_maps_in(files, folder)? {
        let kind = match kind_of_role(role) {
            // Several quantities of one file would be painted by a guide of one.
            Some(kind) if !role.is_packed() => kind,
            None if role == Role::Height => MapKind::Data,
            _ => continue,
        };
        let guide = matches!(role, Role::Height | Role::Occlusion);
        // An aniso map is made from these, where there is none.
        let source = how.wants(MapKind::Aniso) && matches!(role, Role::Normal | Role::Roughness);
        if maps.iter().any(|map| map.role == role) || !(guide || source || how.wants(kind)) {
            continue;
        }
        let y_down = green == Some(Green::Down);
        let bytes = files.read(&file).map_err(|e| kinran_image::Error::io(&file, e))?;
        let image = decode_layer(&file, &bytes, exr_layer_of(&how.exr_layer, &file, root))?;
        maps.push(MapFile { role, kind, y_down, image });
    }
    if how.wants(MapKind::Aniso) && !maps.iter().any(|map| map.role == Role::Aniso) {
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
        SheetRequest { sheet: Sheet::Aniso, encoding: encoding_of(Format::Rgba8), packed_with: None };
    let options = SurfaceOptions { filter: Filter::Linear, ..SurfaceOptions::default() };
    let baked = bake_surface(&surface, options, &[request], &untold)?;
    let Some(Level { width, height, data }) = baked.textures[0].levels.get(1) else { return Ok(None) };
    let image = Image::new(*width, *height, Channels::Rgba, Pixels::U8(data.clone()))?;
    Ok(Some(MapFile { role: Role::Aniso, kind: MapKind::Aniso, y_down: false, image }))
}

fn means(rows: &[StudyRow]) -> Vec<StudyMean> {
    let mut groups: BTreeMap<(String, String, Against, usize), Vec<&StudyRow>> = Default::default();
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
            StudyMean {
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

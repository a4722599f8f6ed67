use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use kinran_bake::detail::{
    Blend, Comparison, DetailOptions, FADE_TRIALS, Layer, LevelError, Mask, Resolution, Solved, Target, Tile,
    TileOptions, bearable_opacity, compare, level_pictures, lowest_resolution,
};
use kinran_bake::folder::{Green, guess_green, not_normals};
use kinran_image::{Files, Format, Image, decode_layer, decode_texture, encode_png};
use schemars::JsonSchema;
use serde::Serialize;

use super::carrier::{Job, Textures};
use super::{
    ALPHA, MapKind, SolveOptions, TiledLayer, encoding, exr_layer_of, green_by_name, is_baked, kind_of_file,
};
use crate::content::Content;
use crate::names::file_name;
use crate::report::{WrittenFile, kept_files};
use crate::sink::place_in;
use crate::task::Work;
use crate::textures::put_texture;
use crate::{Error, Sink, Space, Stage, Task};

/// Where the kind of a target was taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum KindSource {
    /// It was said.
    Flag,
    /// The target's name.
    Name,
    /// Nothing says it: it is taken for colour.
    Assumed,
}

/// What was solved and how well.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct SolveReport {
    /// File name of the target.
    pub target: String,
    /// What it holds.
    pub kind: MapKind,
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
    /// Where layers were faded: the factor on the layers' opacity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub opacity: Option<f32>,
    /// Errors, level by level.
    pub levels: Vec<LevelError>,
    /// Where an error was allowed: what each resolution would have cost.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub resolutions: Vec<Resolution>,
    /// Where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<Comparison>,
    /// What is doubtful about the target and its layers, a sentence each.
    pub warnings: Vec<String>,
}

/// A tile or mask: its file, whether its green grows downwards, and whether it is a mask.
type TileKey = (PathBuf, bool, bool);

/// Tiles and masks, each read and compressed once.
type Tiles = BTreeMap<TileKey, Tile>;

/// A target on its way.
struct Solving<'a> {
    files: &'a dyn Files,
    target: &'a Path,
    how: &'a SolveOptions,
    out: &'a dyn Sink,
    task: Task<'a>,
    /// What its files' names begin with.
    stem: String,
}

/// What pictures show.
const PICTURES: [&str; 7] =
    ["detail", "synthesized", "blended", "target", "compressed_target", "error", "target_error"];

/// The bytes that the files of [`solve`] will take, by the headers of the images alone.
pub fn solve_space(files: &dyn Files, target: &Path, how: &SolveOptions) -> Space {
    let out = kinran_image::Memory::new();
    Solving { files, target, how, out: &out, task: Task::QUIET, stem: file_stem(target) }.space()
}

/// Solves a target against its layers, and writes NAME_synthesized, its tiles as they were compressed, and NAME.detail.json,
/// and what else is asked for.
///
/// The synthesized map is found texel by texel so that the blend of it and the tiles is the target: smooth overlay for colour
/// and data, reoriented normal mapping for normals, "over" for aniso texels; against the tiles as the GPU decodes them, level
/// by level.
///
/// # Errors
/// Whatever is wrong with a file, an option or the destination; each names the file.
pub fn solve(
    files: &dyn Files,
    target: &Path,
    how: &SolveOptions,
    out: &dyn Sink,
    task: Task<'_>,
) -> Result<SolveReport, Error> {
    how.check()?;
    Solving { files, target, how, out, task, stem: file_stem(target) }.solve()
}

impl Solving<'_> {
    fn refused<T>(&self, option: &'static str, given: &str, reason: impl Into<String>) -> Result<T, Error> {
        let file = Some(self.target.to_path_buf());
        Err(Error::Option { option, given: given.into(), file, reason: reason.into() })
    }

    fn kind(&self) -> MapKind {
        self.how.kind_of(self.target)
    }

    fn tile_keys(&self) -> BTreeSet<TileKey> {
        let keys = self.how.layers.iter().flat_map(|layer| {
            let mask = layer.mask.iter().map(|mask| (mask.clone(), false, true));
            mask.chain([(layer.tile.clone(), layer.y_down, false)])
        });
        keys.collect()
    }

    /// Whether a tile is written: a model finds its tiles beside it, also those that were baked before.
    fn writes_tile(&self, key: &TileKey) -> bool {
        !is_baked(&key.0) || self.how.carrier.is_some()
    }

    /// The files of a texture.
    fn texture_files(&self, name: &str) -> Vec<String> {
        let extensions = self.how.container.extensions();
        extensions.iter().map(|extension| format!("{name}.{extension}")).collect()
    }

    fn carried(&self) -> Option<Job<'_>> {
        let carrier = self.how.carrier.as_ref()?;
        Some(Job { how: self.how, carrier, kind: self.kind(), stem: &self.stem })
    }

    fn report_file(&self) -> String {
        format!("{}.detail.json", self.stem)
    }

    /// The files that will be written, the report last.
    fn names(&self) -> Result<Vec<String>, Error> {
        let carried = self.carried();
        let of_carrier = carried.as_ref().map(|job| job.check(self.files, self.out)).transpose()?;
        let keys = self.tile_keys();
        let mut names = self.texture_files(&format!("{}_synthesized", self.stem));
        for key in keys.iter().filter(|key| self.writes_tile(key)) {
            names.extend(self.texture_files(&tile_name(key, || keys.iter())));
        }
        names.extend(carried.as_ref().map(Job::authored));
        names.extend(of_carrier.into_iter().flatten());
        if self.how.pictures {
            names.extend(PICTURES.map(|picture| format!("{}_{picture}.png", self.stem)));
        }
        names.push(self.report_file());
        Ok(names)
    }

    fn space(&self) -> Space {
        let how = self.how;
        let format = how.format_of(self.target);
        let size = |file: &Path| self.files.image_size(file);
        let texture =
            |format, file: &Path| Some(Space::of_texture(how.container, how.zstd, format, size(file)?));
        let mut space = texture(format, self.target).unwrap_or_default();
        if how.max_error.is_some() {
            // Any lower resolution may do.
            space.least = 0;
        }
        for key in self.tile_keys().iter().filter(|key| self.writes_tile(key)) {
            let format = if key.2 { Format::Bc7 } else { how.tile_format.unwrap_or(format) };
            space.add(texture(format, &key.0).unwrap_or_default());
        }
        let pictures = if how.pictures { PICTURES.len() as u64 } else { 0 };
        let authored = u64::from(how.carrier.is_some());
        // What PNG does not shrink.
        let plain = size(self.target).map_or(0, |(w, h)| 3 * u64::from(w) * u64::from(h));
        space.most += (pictures + authored) * plain;
        space
    }

    /// Refuses what cannot be written, before anything is read.
    fn check(&self) -> Result<(), Error> {
        let names = self.names()?;
        let images = || std::iter::once(self.target).chain(self.how.images().map(PathBuf::as_path));
        for layer in &self.how.exr_layer {
            let acts = |file: &Path| exr_layer_of(std::slice::from_ref(layer), file, Path::new("")).is_some();
            if !images().any(acts) {
                let given = format!("{}={}", layer.0.display(), layer.1);
                let reason = "neither the target nor a tile or mask is such a file";
                return self.refused("exr-layer", &given, reason);
            }
        }
        let places: Vec<_> = images().filter_map(|image| self.files.place(image)).collect();
        let is_read = |name: &&String| place_in(self.out, name).is_some_and(|place| places.contains(&place));
        // A report is none of them, and it is told below whose it is.
        if let Some(name) = names[..names.len() - 1].iter().find(is_read) {
            let file = self.out.place(name).filter(|_| self.out.is_on_disk()).unwrap_or_else(|| name.into());
            return Err(Error::OverMap { file });
        }
        self.out.expect(&names, self.space())
    }

    /// Reads an image, of an EXR the layer that is named for it.
    fn read(&self, file: &Path) -> Result<Image, kinran_image::Error> {
        let bytes = self.files.read(file).map_err(|e| kinran_image::Error::io(file, e))?;
        decode_layer(file, &bytes, exr_layer_of(&self.how.exr_layer, file, Path::new("")))
    }

    fn solve(&self) -> Result<SolveReport, Error> {
        self.check()?;
        let (how, kind, task) = (self.how, self.kind(), self.task);
        let kind_source = match (how.kind, kind_of_file(self.target)) {
            (Some(_), _) => KindSource::Flag,
            (None, Some(_)) => KindSource::Name,
            (None, None) => KindSource::Assumed,
        };
        let format = how.format_of(self.target);
        let mut options = DetailOptions::new(encoding(format));
        options.encoding.preset = how.preset.unwrap_or(options.encoding.preset);
        options.aniso_alpha = how.alpha;
        options.compensate = how.compensate;
        options.finest_compensation = how.finest_compensation;
        options.choose = how.choose;
        if how.plain_overlay {
            options.blend = Blend::Plain;
        }

        // First, since compressing tiles takes a while.
        let image = self.read(self.target)?;
        if kind_source == KindSource::Assumed && not_normals(&image).is_none() {
            let reason = "nothing says what the target holds, and its texels look like normals; give --kind normal, or --kind \
                          color where they are none";
            return self.refused("kind", "", reason);
        }
        let mut warnings = layer_kinds(how, kind);
        let idle = [
            ("--alpha", how.alpha != ALPHA && kind != MapKind::Aniso, "the target is no aniso map"),
            (
                "--channels",
                how.channels.is_some() && how.carrier.is_none(),
                "neither --board nor --model is asked for",
            ),
        ];
        let idle = idle.into_iter().filter(|(_, is_idle, _)| *is_idle);
        warnings.extend(idle.map(|(flag, _, why)| format!("{flag} has nothing to act on: {why}")));
        let is_down = how.is_down(self.target);
        if kind == MapKind::Normal {
            warnings.extend(green_doubt(self.target, &image, is_down, ["--y-down", "--y-up"]));
        }
        let target = named(self.target, Target::new(&image, kind, is_down))?;
        drop(image);
        let tiles = self.read_tiles(kind, how.tile_format.unwrap_or(format), &mut warnings)?;
        let tile = |file: &Path, y_down: bool, is_mask: bool| &tiles[&(file.to_path_buf(), y_down, is_mask)];
        let layers = how.layers.iter().map(|layer| Layer {
            tile: tile(&layer.tile, layer.y_down, false),
            transform: layer.transform(),
            hsv: layer.hsv(),
            opacity: layer.opacity,
            mask: layer.mask.as_ref().map(|file| Mask {
                map: tile(file, false, true),
                channel: layer.channel,
                contrast: layer.contrast,
            }),
        });
        let mut layers: Vec<Layer<'_>> = layers.collect();
        let size = (target.levels[0].width, target.levels[0].height);
        let texels = u64::from(size.0) * u64::from(size.1);

        let mut opacity = None;
        if how.fade {
            // Two levels at a time.
            let work = task.begin(Stage::Fading, "", FADE_TRIALS * texels * 5 / 4)?;
            let found = bearable_opacity(&target, &layers, &options, &|n| work.tick(n))?;
            let Some(found) = found else {
                let reason = "even without the layers the error is above that of the compressed target; take a finer --format";
                return self.refused("fade", "", reason);
            };
            layers.iter_mut().for_each(|layer| layer.opacity *= found);
            opacity = Some(found);
        }
        let mut resolutions = Vec::new();
        if let Some(bound) = how.max_error {
            // All resolutions together are a third more than the first, and so are the mips of each.
            let work = task.begin(Stage::Resolutions, "", texels * 16 / 9)?;
            let found = lowest_resolution(&target, &layers, &options, bound, &|n| work.tick(n))?;
            resolutions = found.resolutions;
            let Some(level) = found.level else {
                let reason = format!(
                    "even at the target's own resolution the error is {:.2}; allow more, or take another format or tile",
                    resolutions[0].error
                );
                return self.refused("max-error", &bound.to_string(), reason);
            };
            options.first_level = level;
        }
        let finest = &target.levels[options.first_level];
        let all = u64::from(finest.width) * u64::from(finest.height) * 4 / 3;
        let (solved, comparison) = if how.compare {
            let work = task.begin(Stage::Comparing, "", 5 * all)?;
            let (comparison, solved) = compare(&target, &layers, &options, &|n| work.tick(n))?;
            (solved, Some(comparison))
        } else {
            let work = task.begin(Stage::Solving, "", all)?;
            (kinran_bake::detail::solve(&target, &layers, &options, &|n| work.tick(n))?, None)
        };

        let textures = 1 + tiles.keys().filter(|key| self.writes_tile(key)).count();
        let pictures = if how.pictures { PICTURES.len() } else { 0 };
        let count = textures * how.container.extensions().len() + pictures;
        let writing = task.begin(Stage::Writing, "", count as u64)?;
        let mut written = self.write_textures(&solved, &tiles, &writing)?;
        if let Some(job) = self.carried() {
            let files = |file: &Path, y_down: bool, is_mask: bool| {
                self.texture_files(&tile_name(&(file.to_path_buf(), y_down, is_mask), || tiles.keys()))
            };
            let textures = Textures {
                synthesized: &self.texture_files(&format!("{}_synthesized", self.stem)),
                tile: &|layer: &TiledLayer| files(&layer.tile, layer.y_down, false),
                mask: &|layer: &TiledLayer| layer.mask.as_ref().map(|mask| files(mask, false, true)),
                opacity: opacity.unwrap_or(1.0),
            };
            written.extend(job.write(self.files, &target, &textures, self.out)?);
        }
        if how.pictures {
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
                let (file, bytes) = (format!("{}_{name}.png", self.stem), encode_png(image)?);
                self.out.put(&file, &bytes)?;
                written.push(WrittenFile::new(file, &bytes));
                writing.tick(1)?;
            }
        }
        let first = &solved.texture.levels[0];
        let kept = kept_files(self.out, &self.report_file(), &written);
        let report = SolveReport {
            target: file_name(self.target),
            kind,
            kind_source,
            files: written.iter().map(|file| file.file.clone()).collect(),
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
        self.out.put(&self.report_file(), &json)?;
        self.out.finish()?;
        Ok(report)
    }

    fn read_tiles(&self, kind: MapKind, format: Format, warnings: &mut Vec<String>) -> Result<Tiles, Error> {
        let mut tiles = Tiles::new();
        for layer in &self.how.layers {
            let mut read = |file: &Path, kind: MapKind, y_down: bool, is_mask: bool| -> Result<(), Error> {
                let key = (file.to_path_buf(), y_down, is_mask);
                if tiles.contains_key(&key) {
                    return Ok(());
                }
                if is_baked(file) {
                    let bytes = self.files.read(file).map_err(|e| kinran_image::Error::io(file, e))?;
                    let texture = decode_texture(file, &bytes);
                    let tile = texture.and_then(|texture| Tile::from_texture(texture, kind));
                    tiles.insert(key, named(file, tile)?);
                    return Ok(());
                }
                let encoding = encoding(if is_mask { Format::Bc7 } else { format });
                let center = self.how.center && !is_mask;
                let options = TileOptions { y_down, center, ..TileOptions::new(kind, encoding) };
                let image = named(file, self.read(file))?;
                if kind == MapKind::Normal {
                    let flags = ["y-down of the layer", "y-up of the layer"];
                    warnings.extend(green_doubt(file, &image, y_down, flags));
                }
                let texels = u64::from(image.width) * u64::from(image.height) * 4 / 3;
                let work = self.task.begin(Stage::Compressing, file_name(file), texels)?;
                tiles.insert(key, named(file, Tile::bake(&image, options, &|n| work.tick(n)))?);
                Ok(())
            };
            read(&layer.tile, kind, layer.y_down, false)?;
            if let Some(mask) = &layer.mask {
                read(mask, MapKind::Data, false, true)?;
            }
        }
        Ok(tiles)
    }

    fn write_textures(
        &self,
        solved: &Solved,
        tiles: &Tiles,
        writing: &Work<'_>,
    ) -> Result<Vec<WrittenFile>, Error> {
        let mut written = Vec::new();
        let mut write = |name: &str, texture: &kinran_image::Texture, map: Content| -> Result<(), Error> {
            let (container, zstd) = (self.how.container, self.how.zstd);
            let put = put_texture(container, zstd, name, map, texture.clone(), self.out)?;
            writing.tick(put.len() as u64)?;
            written.extend(put.into_iter().map(WrittenFile::from));
            Ok(())
        };
        write(&format!("{}_synthesized", self.stem), &solved.texture, Content::Synthesized)?;
        for (key, tile) in tiles.iter().filter(|(key, _)| self.writes_tile(key)) {
            let map = if key.2 { Content::Mask } else { Content::Detail };
            write(&tile_name(key, || tiles.keys()), &tile.texture, map)?;
        }
        Ok(written)
    }
}

/// A sentence for each layer whose name says another kind than the target's.
fn layer_kinds(how: &SolveOptions, kind: MapKind) -> Vec<String> {
    let tiles: BTreeSet<&PathBuf> = how.layers.iter().map(|layer| &layer.tile).collect();
    let others = tiles.into_iter().filter_map(|tile| Some((tile, kind_of_file(tile)?)));
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

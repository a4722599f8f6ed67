//! What each part of the method is worth: the talk's table, for one target.

use glam::{Mat2, Vec2, Vec3};
use kinran_image::{Cancelled, Encoding, Error, Format, Texture, Tick};
use kinran_scene::Wrap;
use kinran_shading::normal_from_xy;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::layer::{DetailRows, Layer, RowRoom, Seen, texture_bytes};
use super::map::{MapKind, Planes, compress, decoded_level, synthesized_level};
use super::operator::Blend;
use super::sample::Fetch;
use super::solve::{DetailOptions, Solved, Sums, Target, blend, solve, solve_levels, squared_error};
use crate::mips::BAND_ROWS;

/// Errors of one level by method, each as [`LevelError::error`](super::LevelError::error).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct LevelComparison {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The target itself, compressed; no detail.
    pub target: f32,
    /// Everything: smooth overlay, compensation, blocks chosen by the blended result.
    pub blended: f32,
    /// The talk's method: the blocks are those of the encoder.
    pub talk: f32,
    /// The talk's, with plain overlay.
    pub plain_overlay: f32,
    /// The talk's, solved against the tiles as authored.
    pub uncompensated: f32,
}

/// Errors of the finest level where it is magnified twice, and the tiles are seen twice as fine: against the exact
/// solution, not compressed and magnified likewise, over the tiles as authored; the compressed target against the target
/// magnified likewise. In the unit of [`LevelError::error`](super::LevelError::error), over every fourth row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct MagnifiedComparison {
    /// The target itself, compressed; no detail.
    pub target: f32,
    /// Everything.
    pub blended: f32,
    /// The talk's method.
    pub talk: f32,
}

/// A target with and without its tiles, and what they cost.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Comparison {
    /// Finest level first.
    pub levels: Vec<LevelComparison>,
    /// The finest level magnified.
    pub magnified: MagnifiedComparison,
    /// Bytes of `s` with its mips.
    pub synthesized_bytes: u64,
    /// Bytes of the tiles and masks, which other targets share.
    pub shared_bytes: u64,
    /// Bytes of the compressed target of the same resolution.
    pub target_bytes: u64,
    /// Bytes of a unique map as fine as the finest layer.
    pub unique_bytes: u64,
}

/// Measures a target with `options` (their `blend`, `compensate` and `choose` are varied here). `tick` is told of
/// their texels five times: of four solutions and of the compressed target.
///
/// # Errors
/// As [`solve`].
pub fn compare(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    tick: &Tick<'_>,
) -> Result<(Comparison, Solved), Error> {
    let everything =
        DetailOptions { blend: Blend::Smooth, compensate: true, choose: true, measure_all: true, ..*options };
    let talk = DetailOptions { choose: false, finest_compensation: 0.0, ..everything };
    let plain = DetailOptions { blend: Blend::Plain, ..talk };
    let uncompensated = DetailOptions { compensate: false, ..talk };
    let solved = solve(target, layers, &everything, tick)?;
    let errors = |options: &DetailOptions| -> Result<Vec<f32>, Error> {
        Ok(solve(target, layers, options, tick)?.levels.iter().map(|level| level.error).collect())
    };
    let talk_solved = solve(target, layers, &talk, tick)?;
    let talk: Vec<f32> = talk_solved.levels.iter().map(|level| level.error).collect();
    let (plain, uncompensated) = (errors(&plain)?, errors(&uncompensated)?);
    let alone = compress(&target.levels[options.first_level..], target.kind, options.encoding, tick)?;
    let alone_errors = compressed_errors(target, &alone, options.first_level, tick)?;
    let levels = solved
        .levels
        .iter()
        .enumerate()
        .map(|(i, level)| LevelComparison {
            width: level.width,
            height: level.height,
            target: alone_errors[i],
            blended: level.error,
            talk: talk[i],
            plain_overlay: plain[i],
            uncompensated: uncompensated[i],
        })
        .collect();
    let textures = [&alone, &solved.texture, &talk_solved.texture];
    let comparison = Comparison {
        levels,
        magnified: magnified(target, layers, &everything, textures, tick)?,
        synthesized_bytes: texture_bytes(&solved.texture),
        shared_bytes: layers.iter().map(shared_bytes).sum(),
        target_bytes: texture_bytes(&alone),
        unique_bytes: unique_bytes(target, layers, options.encoding),
    };
    Ok((comparison, solved))
}

fn shared_bytes(layer: &Layer) -> u64 {
    layer.tile.bytes() + layer.mask.map_or(0, |mask| mask.map.bytes())
}

/// Bytes of a full mip chain with the texel density of the finest layer, at least the target's.
fn unique_bytes(target: &Target, layers: &[Layer], encoding: Encoding) -> u64 {
    let size = layers.iter().fold((target.levels[0].width, target.levels[0].height), |(w, h), layer| {
        let (tile, matrix) = (layer.tile.size(), layer.transform.matrix());
        let texels = |axis: Vec2| (axis * Vec2::new(tile.0 as f32, tile.1 as f32)).length().ceil() as u32;
        (w.max(texels(matrix.x_axis)), h.max(texels(matrix.y_axis)))
    });
    (0..kinran_image::full_level_count(size.0, size.1))
        .map(|level| {
            let side = |size| kinran_image::level_size(size, level);
            encoding.format.level_bytes(side(size.0), side(size.1)) as u64
        })
        .sum()
}

/// Blended errors of some levels of `s`, of which no level but these is solved.
pub(crate) fn solved_errors(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    levels: std::ops::Range<usize>,
    tick: &Tick<'_>,
) -> Result<Vec<f32>, Error> {
    let solved = solve_levels(target, layers, options, levels, tick)?;
    Ok(solved.levels.iter().map(|level| level.error).collect())
}

/// Errors of a compressed target, level by level. `tick` is told of no units.
pub(crate) fn compressed_errors(
    target: &Target,
    texture: &Texture,
    first: usize,
    tick: &Tick<'_>,
) -> Result<Vec<f32>, Error> {
    (0..texture.levels.len())
        .map(|level| {
            let decoded = decoded_level(texture, level, target.kind)?;
            let wanted = &target.levels[first + level];
            let measured = row_errors(target, wanted.height, 1, tick, |y, sums, _| {
                for x in 0..wanted.width as usize {
                    let texel = vector(&decoded, target.kind, x, y);
                    sums.sum += squared_error(texel, vector(wanted, MapKind::Data, x, y), target);
                }
                sums.texels += u64::from(wanted.width);
            });
            Ok(measured?)
        })
        .collect()
}

fn vector(planes: &Planes, kind: MapKind, x: usize, y: usize) -> Vec3 {
    let v = Vec3::from(std::array::from_fn(|c| planes.row(c, y)[x]));
    if kind == MapKind::Normal { normal_from_xy(v.x, v.y) } else { v }
}

/// What `s` at a lower resolution would cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Resolution {
    /// Texels in a row of its finest level.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Error at the target's resolution, where `s` is magnified and the tiles are not; in the unit of
    /// [`LevelError::error`](super::LevelError::error).
    pub error: f32,
    /// Bytes of `s` with its mips.
    pub bytes: u64,
}

/// The answer of [`lowest_resolution`].
#[derive(Clone, Debug)]
pub struct LowestResolution {
    /// The level of the target that is the finest of `s`, to be put into [`DetailOptions::first_level`]; `None` where
    /// none is good enough.
    pub level: Option<usize>,
    /// Every resolution tried, the target's own first, down to the first that is not good enough.
    pub resolutions: Vec<Resolution>,
}

/// Finds the lowest resolution of `s` with an error of at most `bound` at the target's resolution. `tick` is told of
/// texels as in [`solve`]; each resolution has a quarter of those of the one before.
///
/// # Errors
/// As [`solve`].
pub fn lowest_resolution(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    bound: f32,
    tick: &Tick<'_>,
) -> Result<LowestResolution, Error> {
    let mut found = LowestResolution { level: None, resolutions: Vec::new() };
    for first_level in 0..target.levels.len() {
        let options = DetailOptions { first_level, ..*options };
        let solved = solve(target, layers, &options, tick)?;
        let error = magnified_error(target, layers, &options, &solved, tick)?;
        let (width, height) = (solved.levels[0].width, solved.levels[0].height);
        found.resolutions.push(Resolution { width, height, error, bytes: texture_bytes(&solved.texture) });
        if error > bound {
            break;
        }
        found.level = Some(first_level);
    }
    Ok(found)
}

/// Error at the target's resolution of an `s` whose finest level may be coarser.
fn magnified_error(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    solved: &Solved,
    tick: &Tick<'_>,
) -> Result<f32, Error> {
    let wanted = &target.levels[0];
    let finest = synthesized_level(&solved.texture, 0)?;
    let size = (wanted.width, wanted.height);
    let blended = Magnified::new(std::slice::from_ref(&finest), layers, target.kind, size, Seen::Decoded);
    let error = row_errors(target, size.1, 1, tick, |y, sums, room| {
        let row = blended.row(y, options, target.kind, room);
        for (x, texel) in row.into_iter().enumerate() {
            sums.sum += squared_error(texel, vector(wanted, MapKind::Data, x, y), target);
        }
        sums.texels += u64::from(size.0);
    });
    Ok(error?)
}

/// Rows of `s`, or of a map without layers, magnified to `size` texels and blended.
struct Magnified<'a> {
    fetch: Fetch<'a>,
    detail: Option<DetailRows<'a>>,
    size: (u32, u32),
}

impl<'a> Magnified<'a> {
    fn new(finest: &'a [Planes], layers: &'a [Layer], kind: MapKind, size: (u32, u32), seen: Seen) -> Self {
        // Normals too are filtered before they are decoded.
        let fetch = Fetch::new(finest, size, Mat2::IDENTITY, Vec2::ZERO, Wrap::Clamp);
        let detail = (!layers.is_empty()).then(|| DetailRows::new(layers, kind, size, seen));
        Magnified { fetch, detail, size }
    }

    fn row(&self, y: usize, options: &DetailOptions, kind: MapKind, room: &mut RowRoom) -> Vec<Vec3> {
        let width = self.size.0 as usize;
        let mut s: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; width]);
        self.fetch.row(y, &mut s.each_mut().map(Vec::as_mut_slice));
        let texel = |row: &[Vec<f32>; 3], x: usize| Vec3::from(row.each_ref().map(|plane| plane[x]));
        let Some(detail) = &self.detail else { return (0..width).map(|x| texel(&s, x)).collect() };
        let mut row = <[Vec<f32>; 3]>::default();
        detail.row(y, room, &mut row);
        (0..width).map(|x| blend(texel(&s, x), texel(&row, x), kind, options)).collect()
    }
}

/// How many rows there are to one that is measured where the finest level is magnified.
const MAGNIFIED_STEP: usize = 4;

/// The compressed target, `s` and another `s`, magnified twice.
fn magnified(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    [alone, blended, talk]: [&Texture; 3],
    tick: &Tick<'_>,
) -> Result<MagnifiedComparison, Error> {
    let first = options.first_level;
    let exact = DetailOptions {
        encoding: Encoding { format: Format::Rgba8, ..options.encoding },
        finest_compensation: 0.0,
        ..*options
    };
    let exact = solve_levels(target, layers, &exact, first..first + 1, &|_| tick(0))?.texture;
    let wanted = &target.levels[first];
    let size = (wanted.width * 2, wanted.height * 2);
    let kind = target.kind;
    let error = |map: &[Planes], layers: &[Layer], wanted: (&[Planes], Seen)| {
        let map = Magnified::new(map, layers, kind, size, Seen::Decoded);
        let wanted = Magnified::new(wanted.0, layers, kind, size, wanted.1);
        row_errors(target, size.1, MAGNIFIED_STEP, tick, |y, sums, room| {
            let (a, b) = (map.row(y, options, kind, room), wanted.row(y, options, kind, room));
            for (a, b) in a.into_iter().zip(b) {
                let a = if kind == MapKind::Normal { normal_from_xy(a.x, a.y) } else { a };
                sums.sum += squared_error(a, b, target);
            }
            sums.texels += u64::from(size.0);
        })
    };
    let exact = [synthesized_level(&exact, 0)?];
    let over_tiles = |texture: &Texture| -> Result<f32, Error> {
        Ok(error(&[synthesized_level(texture, 0)?], layers, (&exact, Seen::Authored))?)
    };
    Ok(MagnifiedComparison {
        target: error(
            &[decoded_level(alone, 0, kind)?],
            &[],
            (std::slice::from_ref(wanted), Seen::Authored),
        )?,
        blended: over_tiles(blended)?,
        talk: over_tiles(talk)?,
    })
}

/// Root mean square of what `measure` adds up over every `step`th row. `tick` is told of no units.
fn row_errors(
    target: &Target,
    rows: u32,
    step: usize,
    tick: &Tick<'_>,
    measure: impl Fn(usize, &mut Sums, &mut RowRoom) + Sync,
) -> Result<f32, Cancelled> {
    let rows = (0..rows as usize)
        .into_par_iter()
        .step_by(step)
        .map_init(RowRoom::default, |room, y| {
            let mut sums = Sums::default();
            measure(y, &mut sums, room);
            if (y / step).is_multiple_of(BAND_ROWS as usize) {
                tick(0)?;
            }
            Ok(sums)
        })
        .collect::<Result<Vec<Sums>, Cancelled>>()?;
    let mut all = Sums::default();
    rows.iter().for_each(|sums| all.add(sums));
    Ok(all.error(target))
}

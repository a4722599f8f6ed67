//! What each part of the method is worth: the talk's table, for one target.

use glam::{Mat2, Vec2, Vec3};
use kinran_image::{Encoding, Error, Texture};
use kinran_scene::Wrap;
use kinran_shading::normal_from_xy;
use rayon::prelude::*;
use serde::Serialize;

use super::layer::{DetailRows, Layer, RowRoom, Seen, texture_bytes};
use super::map::{MapKind, Planes, compress, decoded_level, synthesized_level};
use super::sample::Fetch;
use super::solve::{Blend, DetailOptions, Solved, Sums, Target, blend, solve, solve_levels, squared_error};

/// Errors of one level by method, each as [`LevelError::error`](super::LevelError::error).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
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

/// A target with and without its tiles, and what they cost.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Finest level first.
    pub levels: Vec<LevelComparison>,
    /// Bytes of `s` with its mips.
    pub synthesized_bytes: u64,
    /// Bytes of the tiles and masks, which other targets share.
    pub shared_bytes: u64,
    /// Bytes of the compressed target of the same resolution.
    pub target_bytes: u64,
    /// Bytes of a unique map as fine as the finest layer.
    pub unique_bytes: u64,
}

/// Measures a target with `options` (their `blend`, `compensate` and `choose` are varied here).
///
/// # Errors
/// As [`solve`].
pub fn compare(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    progress: &(impl Fn(u64) + Sync),
) -> Result<(Comparison, Solved), Error> {
    let everything =
        DetailOptions { blend: Blend::Smooth, compensate: true, choose: true, measure_all: true, ..*options };
    let talk = DetailOptions { choose: false, ..everything };
    let plain = DetailOptions { blend: Blend::Plain, ..talk };
    let uncompensated = DetailOptions { compensate: false, ..talk };
    let solved = solve(target, layers, &everything, progress)?;
    let errors = |options: &DetailOptions| -> Result<Vec<f32>, Error> {
        Ok(solve(target, layers, options, progress)?.levels.iter().map(|level| level.error).collect())
    };
    let (talk, plain, uncompensated) = (errors(&talk)?, errors(&plain)?, errors(&uncompensated)?);
    let alone = compress(&target.levels[options.first_level..], target.kind, options.encoding)?;
    let alone_errors = compressed_errors(target, &alone, options.first_level)?;
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
    let comparison = Comparison {
        levels,
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
) -> Result<Vec<f32>, Error> {
    let solved = solve_levels(target, layers, options, levels, &|_| {})?;
    Ok(solved.levels.iter().map(|level| level.error).collect())
}

/// Errors of a compressed target, level by level.
pub(crate) fn compressed_errors(target: &Target, texture: &Texture, first: usize) -> Result<Vec<f32>, Error> {
    (0..texture.levels.len())
        .map(|level| {
            let decoded = decoded_level(texture, level, target.kind)?;
            let wanted = &target.levels[first + level];
            let rows: Vec<Sums> = (0..wanted.height as usize)
                .into_par_iter()
                .map(|y| {
                    let mut sums = Sums { texels: u64::from(wanted.width), ..Sums::default() };
                    for x in 0..wanted.width as usize {
                        let texel = vector(&decoded, target.kind, x, y);
                        sums.sum += squared_error(texel, vector(wanted, MapKind::Data, x, y), target);
                    }
                    sums
                })
                .collect();
            let mut all = Sums::default();
            rows.iter().for_each(|sums| all.add(sums));
            Ok(all.error(target))
        })
        .collect()
}

fn vector(planes: &Planes, kind: MapKind, x: usize, y: usize) -> Vec3 {
    let v = Vec3::from(std::array::from_fn(|c| planes.row(c, y)[x]));
    if kind == MapKind::Normal { normal_from_xy(v.x, v.y) } else { v }
}

/// What `s` at a lower resolution would cost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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

/// Finds the lowest resolution of `s` with an error of at most `bound` at the target's resolution.
///
/// # Errors
/// As [`solve`].
pub fn lowest_resolution(
    target: &Target,
    layers: &[Layer],
    options: &DetailOptions,
    bound: f32,
) -> Result<LowestResolution, Error> {
    let mut found = LowestResolution { level: None, resolutions: Vec::new() };
    for first_level in 0..target.levels.len() {
        let options = DetailOptions { first_level, ..*options };
        let solved = solve(target, layers, &options, &|_| {})?;
        let error = magnified_error(target, layers, &options, &solved)?;
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
) -> Result<f32, Error> {
    // Normals too are filtered before they are decoded.
    let finest = [synthesized_level(&solved.texture, 0)?];
    let wanted = &target.levels[0];
    let size = (wanted.width, wanted.height);
    let fetch = Fetch::new(&finest, size, Mat2::IDENTITY, Vec2::ZERO, Wrap::Clamp);
    let detail = DetailRows::new(layers, target.kind, size, Seen::Decoded);
    let rows: Vec<Sums> = (0..wanted.height as usize)
        .into_par_iter()
        .map_init(RowRoom::default, |room, y| {
            let mut row = <[Vec<f32>; 3]>::default();
            detail.row(y, room, &mut row);
            let mut s: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; size.0 as usize]);
            fetch.row(y, &mut s.each_mut().map(Vec::as_mut_slice));
            let mut sums = Sums { texels: u64::from(size.0), ..Sums::default() };
            for x in 0..size.0 as usize {
                let texel = Vec3::from(std::array::from_fn(|c| s[c][x]));
                let d = Vec3::from(std::array::from_fn(|c| row[c][x]));
                let blended = blend(texel, d, target.kind, options);
                sums.sum += squared_error(blended, vector(wanted, MapKind::Data, x, y), target);
            }
            sums
        })
        .collect();
    let mut all = Sums::default();
    rows.iter().for_each(|sums| all.add(sums));
    Ok(all.error(target))
}

//! A tile's texels at the places of a level's texels, as a trilinear sampler fetches them.

use glam::{DMat2, DVec2, Mat2, Vec2};
use kinran_scene::Wrap;

use super::map::Planes;
use crate::channels::wrapped;

/// Positions nearer to a texel's centre than this, in texels, lie on it: what rounding leaves of a whole number.
const ON_CENTRE: f64 = 1e-6;

/// A tile under an affine map, seen by every texel of a level of `size` texels.
pub(crate) struct Fetch<'a> {
    /// One level of the tile, or two with their weights.
    levels: Vec<LevelFetch<'a>>,
    size: (u32, u32),
    matrix: DMat2,
    offset: DVec2,
    wrap: Wrap,
}

struct LevelFetch<'a> {
    planes: &'a Planes,
    weight: f32,
    /// Places along each axis, where the map does not rotate.
    axes: Option<[Vec<Tap>; 2]>,
    /// The columns as runs of texels next to each other, where all lie on texels and no other level is mixed in: as when
    /// a level of the tile is as fine as the map.
    runs: Option<Vec<std::ops::Range<usize>>>,
}

/// Two neighbouring texels and how far from the first to the second.
#[derive(Clone, Copy)]
struct Tap {
    first: u32,
    second: u32,
    by: f32,
}

impl Tap {
    /// The texels around `at`, in texels from the border.
    fn new(at: f64, len: u32, wrap: Wrap) -> Self {
        let center = at - 0.5;
        let nearest = center.round();
        let (lower, by) = if (center - nearest).abs() < ON_CENTRE {
            (nearest, 0.0)
        } else {
            (center.floor(), (center - center.floor()) as f32)
        };
        let lower = lower as i64;
        Tap { first: wrapped(lower, len, wrap), second: wrapped(lower + 1, len, wrap), by }
    }
}

impl<'a> Fetch<'a> {
    /// The level of detail is Vulkan's for square pixels that coincide with the texels: log2 of the longer side of a
    /// texel's footprint in the tile, clamped to the levels there are.
    pub(crate) fn new(
        levels: &'a [Planes],
        size: (u32, u32),
        matrix: Mat2,
        offset: Vec2,
        wrap: Wrap,
    ) -> Self {
        let (matrix, offset) = (matrix.as_dmat2(), offset.as_dvec2());
        let tile = DVec2::new(f64::from(levels[0].width), f64::from(levels[0].height));
        let along_x = (matrix.x_axis * tile).length() / f64::from(size.0);
        let along_y = (matrix.y_axis * tile).length() / f64::from(size.1);
        let lod = libm::log2(along_x.max(along_y)).clamp(0.0, (levels.len() - 1) as f64);
        let nearest = lod.round();
        let lod = if (lod - nearest).abs() < ON_CENTRE { nearest } else { lod };
        let (finer, by) = (lod.floor() as usize, (lod - lod.floor()) as f32);

        let straight = matrix.x_axis.y == 0.0 && matrix.y_axis.x == 0.0;
        let level = |level: usize, weight: f32| {
            let planes = &levels[level];
            let axis = |count: u32, scale: f64, offset: f64, len: u32| -> Vec<Tap> {
                let step = scale / f64::from(count);
                (0..count)
                    .map(|i| Tap::new(((f64::from(i) + 0.5) * step + offset) * f64::from(len), len, wrap))
                    .collect()
            };
            let axes = straight.then(|| {
                [
                    axis(size.0, matrix.x_axis.x, offset.x, planes.width),
                    axis(size.1, matrix.y_axis.y, offset.y, planes.height),
                ]
            });
            let runs = axes.as_ref().and_then(|[columns, _]| runs(columns)).filter(|_| weight == 1.0);
            LevelFetch { planes, weight, axes, runs }
        };
        let levels = if by == 0.0 {
            vec![level(finer, 1.0)]
        } else {
            vec![level(finer, 1.0 - by), level(finer + 1, by)]
        };
        Fetch { levels, size, matrix, offset, wrap }
    }

    /// Sets `out` to one row of the first `out.len()` planes.
    #[inline(always)]
    pub(crate) fn row(&self, y: usize, out: &mut [&mut [f32]]) {
        for (i, level) in self.levels.iter().enumerate() {
            match &level.axes {
                Some([columns, rows]) => {
                    let row = rows[y];
                    for (channel, out) in out.iter_mut().enumerate() {
                        let upper = level.planes.row(channel, row.first as usize);
                        let lower = level.planes.row(channel, row.second as usize);
                        match &level.runs {
                            Some(runs) if row.by == 0.0 => copy_runs(runs, upper, out),
                            _ => straight_row(columns, upper, lower, row.by, level.weight, i == 0, out),
                        }
                    }
                }
                None => self.rotated_row(level, y, i == 0, out),
            }
        }
    }

    fn rotated_row(&self, level: &LevelFetch, y: usize, first: bool, out: &mut [&mut [f32]]) {
        let Planes { width, height, .. } = *level.planes;
        let scale = DVec2::new(f64::from(width), f64::from(height));
        let v = (y as f64 + 0.5) / f64::from(self.size.1);
        for x in 0..self.size.0 as usize {
            let u = (x as f64 + 0.5) / f64::from(self.size.0);
            let at = (self.matrix * DVec2::new(u, v) + self.offset) * scale;
            let (column, row) = (Tap::new(at.x, width, self.wrap), Tap::new(at.y, height, self.wrap));
            for (channel, out) in out.iter_mut().enumerate() {
                let (upper, lower) = (
                    level.planes.row(channel, row.first as usize),
                    level.planes.row(channel, row.second as usize),
                );
                let mix = |row: &[f32]| {
                    let (a, b) = (row[column.first as usize], row[column.second as usize]);
                    a + (b - a) * column.by
                };
                let (a, b) = (mix(upper), mix(lower));
                let sample = (a + (b - a) * row.by) * level.weight;
                out[x] = if first { sample } else { out[x] + sample };
            }
        }
    }
}

/// Columns as runs of texels next to each other; `None` where one lies between texels.
fn runs(columns: &[Tap]) -> Option<Vec<std::ops::Range<usize>>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for tap in columns {
        let first = tap.first as usize;
        match runs.last_mut() {
            _ if tap.by != 0.0 => return None,
            Some(run) if run.end == first => run.end += 1,
            _ => runs.push(first..first + 1),
        }
    }
    Some(runs)
}

fn copy_runs(runs: &[std::ops::Range<usize>], row: &[f32], mut out: &mut [f32]) {
    for run in runs {
        let (part, rest) = out.split_at_mut(run.len());
        part.copy_from_slice(&row[run.clone()]);
        out = rest;
    }
}

/// A row of a map that does not rotate.
#[inline(always)]
fn straight_row(
    columns: &[Tap],
    upper: &[f32],
    lower: &[f32],
    by: f32,
    weight: f32,
    first: bool,
    out: &mut [f32],
) {
    for (out, tap) in out.iter_mut().zip(columns) {
        let mix = |row: &[f32]| {
            let (a, b) = (row[tap.first as usize], row[tap.second as usize]);
            a + (b - a) * tap.by
        };
        let a = mix(upper);
        let sample = (a + (mix(lower) - a) * by) * weight;
        *out = if first { sample } else { *out + sample };
    }
}

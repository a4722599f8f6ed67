//! The mip chain of a surface, level by level, band by band.

use std::marker::PhantomData;

use glam::{Vec3, vec3};
use rayon::prelude::*;

use kinran_image::{full_level_count, level_size};
use kinran_shading::Sym2;

use super::footprint::{Kernel, Taps, footprints};
use super::maps::{SurfaceMaps, TexelSpan, clamp_roughness};
use super::moments::{LeanFilter, LinearFilter, MOMENTS, MomentFilter, NaiveFilter};
use super::weights::{self, Weights};
use super::{dpd, ml, param};
use crate::mips::{BAND_ROWS, PlaneBand, PlaneRows, TILE, reduce_levels};
use crate::simd::dispatch;

/// How a footprint of level 0 becomes one texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Filter {
    /// Maximum-likelihood GGX: the single lobe under which the footprint's microfacets are most probable.
    #[default]
    Ml,
    /// The GGX lobe of least density power divergence from the footprint's microfacets, β = 1/4.
    Dpd,
    /// Average of SGGX matrices (the talk).
    Linear,
    /// SGGX parameter estimation (Heitz et al. 2015, section 4).
    Param,
    /// LEAN mapping, brought to GGX by `sigma = alpha / sqrt(2)`.
    Lean,
    /// Averages maps as if they were colours and renormalises normals: what engines do today.
    Naive,
}

impl Filter {
    /// All filters, best first.
    pub const ALL: [Filter; 6] =
        [Filter::Dpd, Filter::Ml, Filter::Linear, Filter::Param, Filter::Lean, Filter::Naive];

    /// The name on the command line and in metadata.
    pub fn name(self) -> &'static str {
        match self {
            Filter::Dpd => "dpd",
            Filter::Ml => "ml",
            Filter::Linear => "linear",
            Filter::Param => "param",
            Filter::Lean => "lean",
            Filter::Naive => "naive",
        }
    }
}

/// Some whole rows of one level.
#[derive(Clone, Debug)]
pub struct Band {
    /// Level, 0 is the finest.
    pub level: usize,
    /// The level's width.
    pub width: u32,
    /// First row.
    pub y0: u32,
    /// Rows, [`BAND_ROWS`] except at the level's end.
    pub rows: u32,
    /// `width * rows` texels.
    pub texels: TexelSpan,
}

impl Band {
    /// What decoding and every filter promise of their texels: unit normals, and roughness between nothing and one in every
    /// direction, but for rounding.
    fn is_sound(&self) -> bool {
        let sound = |(n, a): (Vec3, Sym2)| {
            let (most, least, _) = a.eigen();
            n.is_normalized() && least >= -1e-4 && most <= 1.0 + 1e-4
        };
        self.texels.len() == (self.width * self.rows) as usize
            && (0..self.texels.len()).all(|i| sound(self.texels.texel(i)))
    }
}

/// Filters `maps` to a full mip chain and hands every band of every level to `consume`, in parallel; returns
/// what it returned, in order, per level. Level 0 is passed as authored. The result does not depend on the
/// number of threads. `naive` takes no weights: no mip generator does.
///
/// # Errors
/// The first one that `consume` gives; no band is begun after it.
///
/// # Panics
/// When the maps' weights are not of the size of level 0.
pub fn filter_levels<T: Send, E: Send>(
    maps: &SurfaceMaps,
    filter: Filter,
    kernel: Kernel,
    consume: impl Fn(&Band) -> Result<T, E> + Sync,
) -> Result<Vec<Vec<T>>, E> {
    let size = maps.size();
    let finest = in_bands(size, 0, |band| {
        maps.decode_rows(size, band.y0, band.rows, &mut band.texels);
        debug_assert!(band.is_sound(), "level 0, rows from {}", band.y0);
        consume(band)
    })?;
    let coarser = coarser_levels(maps, filter, kernel, &consume)?;
    Ok(std::iter::once(finest).chain(coarser).collect())
}

/// [`filter_levels`] without level 0.
///
/// # Errors
/// As [`filter_levels`].
///
/// # Panics
/// When the maps' weights are not of the size of level 0.
pub fn coarser_levels<T: Send, E: Send>(
    maps: &SurfaceMaps,
    filter: Filter,
    kernel: Kernel,
    consume: impl Fn(&Band) -> Result<T, E> + Sync,
) -> Result<Vec<Vec<T>>, E> {
    let weights = maps.checked_weights();
    match filter {
        Filter::Linear => match weights {
            Some(weights) => weighted_levels::<LinearFilter, T, E>(maps, weights, kernel, &consume),
            None => moment_levels::<LinearFilter, T, E>(maps, kernel, &consume),
        },
        Filter::Lean => match weights {
            Some(weights) => weighted_levels::<LeanFilter, T, E>(maps, weights, kernel, &consume),
            None => moment_levels::<LeanFilter, T, E>(maps, kernel, &consume),
        },
        Filter::Naive => moment_levels::<NaiveFilter, T, E>(maps, kernel, &consume),
        Filter::Dpd => footprint_levels(maps, kernel, dpd::fit_band, &consume),
        Filter::Ml => footprint_levels(maps, kernel, ml::fit_band, &consume),
        Filter::Param => footprint_levels(maps, kernel, param::fit_band, &consume),
    }
}

/// Runs `make` over a level in bands, in parallel; it sets the band's texels. Their memory goes from band to band, since
/// fresh pages cost more than what is computed into them.
fn in_bands<T: Send, E: Send>(
    size: (u32, u32),
    level: usize,
    make: impl Fn(&mut Band) -> Result<T, E> + Sync,
) -> Result<Vec<T>, E> {
    let (width, height) = (level_size(size.0, level), level_size(size.1, level));
    (0..height.div_ceil(BAND_ROWS))
        .into_par_iter()
        .map_init(TexelSpan::default, |texels, i| {
            let y0 = i * BAND_ROWS;
            let rows = BAND_ROWS.min(height - y0);
            let mut band = Band { level, width, y0, rows, texels: std::mem::take(texels) };
            let made = make(&mut band);
            *texels = band.texels;
            made
        })
        .collect()
}

/// Level 0 as the averages of a filter.
struct MomentRows<'a, F> {
    maps: &'a SurfaceMaps,
    size: (u32, u32),
    filter: PhantomData<F>,
}

impl<F: MomentFilter> PlaneRows for MomentRows<'_, F> {
    const PLANES: usize = MOMENTS;
    type Scratch = [TexelSpan; 2];

    #[inline(always)]
    fn sum_rows(
        &self,
        rows: &Taps,
        x0: usize,
        len: usize,
        [upper, lower]: &mut [TexelSpan; 2],
        sums: &mut [[f32; TILE]],
    ) {
        let decode = |y, span: &mut TexelSpan| self.maps.decode_span(self.size, y, x0 as u32, len, span);
        // Two rows, all there are where a size is even, are summed before anything is stored.
        if let [(y0, weight0), (y1, weight1)] = rows[..] {
            decode(y0, upper);
            decode(y1, lower);
            set_moments::<F>([(upper, weight0), (lower, weight1)], sums);
            return;
        }
        sums.fill([0.0; TILE]);
        for &(y, weight) in rows {
            decode(y, upper);
            add_moments::<F>(upper, weight, sums);
        }
    }
}

/// Levels by averages.
fn moment_levels<F: MomentFilter, T: Send, E: Send>(
    maps: &SurfaceMaps,
    kernel: Kernel,
    consume: &(impl Fn(&Band) -> Result<T, E> + Sync),
) -> Result<Vec<Vec<T>>, E> {
    let source = MomentRows::<F> { maps, size: maps.size(), filter: PhantomData };
    reduce_levels(&source, source.size, kernel, maps.wrap, |planes, texels: &mut TexelSpan| {
        consume_averages::<F, T, E>(&planes, texels, consume)
    })
}

/// Hands a band of averages on as texels.
fn consume_averages<F: MomentFilter, T: Send, E: Send>(
    planes: &PlaneBand,
    texels: &mut TexelSpan,
    consume: &(impl Fn(&Band) -> Result<T, E> + Sync),
) -> Result<T, E> {
    texels.clear();
    dispatch(ExtractBand::<F> { planes, texels, filter: PhantomData });
    let band = Band {
        level: planes.level,
        width: planes.width as u32,
        y0: planes.y0 as u32,
        rows: planes.rows as u32,
        texels: std::mem::take(texels),
    };
    debug_assert!(band.is_sound(), "level {}, rows from {}", band.level, band.y0);
    let made = consume(&band);
    *texels = band.texels;
    made
}

/// Level 0 as the averages of a filter, each times the texel's weight, and the weight.
struct WeightedRows<'a, F> {
    maps: &'a SurfaceMaps,
    weights: &'a Weights,
    filter: PhantomData<F>,
}

impl<F: MomentFilter> PlaneRows for WeightedRows<'_, F> {
    const PLANES: usize = MOMENTS + 1;
    type Scratch = TexelSpan;

    #[inline(always)]
    fn sum_rows(&self, rows: &Taps, x0: usize, len: usize, span: &mut TexelSpan, sums: &mut [[f32; TILE]]) {
        sums.fill([0.0; TILE]);
        for &(y, weight) in rows {
            self.maps.decode_span(self.weights.size(), y, x0 as u32, len, span);
            add_weighted::<F>(span, self.weights.row(y, x0 as u32, len), weight, sums);
        }
    }
}

/// Levels by averages in which texels count by their weight.
fn weighted_levels<F: MomentFilter, T: Send, E: Send>(
    maps: &SurfaceMaps,
    weights: &Weights,
    kernel: Kernel,
    consume: &(impl Fn(&Band) -> Result<T, E> + Sync),
) -> Result<Vec<Vec<T>>, E> {
    let source = WeightedRows::<F> { maps, weights, filter: PhantomData };
    let consume = |planes: PlaneBand, (samples, texels): &mut (Vec<f32>, TexelSpan)| {
        let width = planes.width;
        samples.clear();
        for row in planes.samples.chunks_exact(width * (MOMENTS + 1)) {
            let (moments, weights) = row.split_at(width * MOMENTS);
            for plane in moments.chunks_exact(width) {
                samples.extend(plane.iter().zip(weights).map(|(moment, weight)| moment / weight));
            }
        }
        consume_averages::<F, T, E>(&PlaneBand { samples, ..planes }, texels, consume)
    };
    reduce_levels(&source, weights.size(), kernel, maps.wrap, consume)
}

/// Turns the averages of a band into its texels.
struct ExtractBand<'a, F> {
    planes: &'a PlaneBand<'a>,
    texels: &'a mut TexelSpan,
    filter: PhantomData<F>,
}

impl<F: MomentFilter> pulp::WithSimd for ExtractBand<'_, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let width = self.planes.width;
        // Behind the end of a row stand averages that every filter has a quick answer to.
        let mut padded = [[1.0; TILE]; MOMENTS];
        let mut tile = [[0.0; TILE]; 6];
        for row in self.planes.samples.chunks_exact(width * MOMENTS) {
            for x0 in (0..width).step_by(TILE) {
                let len = TILE.min(width - x0);
                let mut averages = [&[0.0; TILE]; MOMENTS];
                for ((average, padded), plane) in
                    averages.iter_mut().zip(&mut padded).zip(row.chunks_exact(width))
                {
                    let plane = &plane[x0..x0 + len];
                    *average = plane.try_into().unwrap_or_else(|_| {
                        padded[..len].copy_from_slice(plane);
                        &*padded
                    });
                }
                F::surfaces(averages, &mut tile);
                let [nx, ny, nz, axx, axy, ayy] = &mut tile;
                clamp_roughness(&mut axx[..len], &mut axy[..len], &mut ayy[..len]);
                self.texels.extend([nx, ny, nz, axx, axy, ayy].map(|plane| &plane[..len]));
            }
        }
    }
}

/// Sets the sums of columns to the moments of two decoded spans, each times its weight.
#[inline(always)]
fn set_moments<F: MomentFilter>(rows: [(&TexelSpan, f32); 2], sums: &mut [[f32; TILE]]) {
    let Ok(sums): Result<&mut [[f32; TILE]; MOMENTS], _> = sums.try_into() else { return };
    let [(upper, upper_weight), (lower, lower_weight)] = rows;
    let len = upper.len().min(TILE);
    let (upper, lower) = (planes(upper, len), planes(lower, len));
    for i in 0..len {
        let (m0, m1) = (moments::<F>(&upper, i), moments::<F>(&lower, i));
        for ((sums, m0), m1) in sums.iter_mut().zip(m0).zip(m1) {
            sums[i] = m0 * upper_weight + m1 * lower_weight;
        }
    }
}

/// Adds the moments of a decoded span, times its weight, to the sums of their columns.
#[inline(always)]
fn add_moments<F: MomentFilter>(span: &TexelSpan, weight: f32, sums: &mut [[f32; TILE]]) {
    let Ok(sums): Result<&mut [[f32; TILE]; MOMENTS], _> = sums.try_into() else { return };
    let len = span.len().min(TILE);
    let span = planes(span, len);
    for i in 0..len {
        for (sums, m) in sums.iter_mut().zip(moments::<F>(&span, i)) {
            sums[i] += m * weight;
        }
    }
}

/// Adds the moments of a decoded span, times the weight of texel and row, and these weights to the sums of their columns.
#[inline(always)]
fn add_weighted<F: MomentFilter>(
    span: &TexelSpan,
    texel_weights: &[u16],
    row_weight: f32,
    sums: &mut [[f32; TILE]],
) {
    let Ok(sums): Result<&mut [[f32; TILE]; MOMENTS + 1], _> = sums.try_into() else { return };
    let len = span.len().min(TILE);
    let (span, texel_weights) = (planes(span, len), &texel_weights[..len]);
    for i in 0..len {
        let weight = row_weight * weights::share(texel_weights[i]);
        for (sums, m) in sums.iter_mut().zip(moments::<F>(&span, i)) {
            sums[i] += m * weight;
        }
        sums[MOMENTS][i] += weight;
    }
}

/// Slices of one length, with which loops are vectorised.
#[inline(always)]
fn planes(span: &TexelSpan, len: usize) -> [&[f32]; 6] {
    let TexelSpan { nx, ny, nz, axx, axy, ayy, .. } = span;
    [&nx[..len], &ny[..len], &nz[..len], &axx[..len], &axy[..len], &ayy[..len]]
}

#[inline(always)]
fn moments<F: MomentFilter>([nx, ny, nz, axx, axy, ayy]: &[&[f32]; 6], i: usize) -> [f32; MOMENTS] {
    F::moments(vec3(nx[i], ny[i], nz[i]), Sym2 { xx: axx[i], xy: axy[i], yy: ayy[i] })
}

/// Levels fitted footprint by footprint from level 0.
fn footprint_levels<T: Send, E: Send>(
    maps: &SurfaceMaps,
    kernel: Kernel,
    fit_band: impl Fn(&SurfaceMaps, &[Taps], &[Taps], &mut TexelSpan) + Sync,
    consume: &(impl Fn(&Band) -> Result<T, E> + Sync),
) -> Result<Vec<Vec<T>>, E> {
    let size = maps.size();
    let levels = full_level_count(size.0, size.1);
    let columns = footprints(size.0, levels, kernel, maps.wrap[0]);
    let rows = footprints(size.1, levels, kernel, maps.wrap[1]);
    (1..levels)
        .map(|level| {
            let (columns, rows) = (&columns[level - 1], &rows[level - 1]);
            in_bands(size, level, |band| {
                let rows = &rows[band.y0 as usize..][..band.rows as usize];
                fit_band(maps, columns, rows, &mut band.texels);
                debug_assert!(band.is_sound(), "level {level}, rows from {}", band.y0);
                consume(band)
            })
        })
        .collect()
}

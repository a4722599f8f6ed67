//! Plain averages: the mip chains of colours and masks, and the averages that filters are made of.

use std::collections::BTreeMap;

use rayon::prelude::*;

use kinran_image::srgb::{linear_from_srgb, srgb_from_linear};
use kinran_image::{
    Cancelled, Channels, Encoding, Error, Image, Level, Pixels, Texture, Tick, Transfer, encode,
    full_level_count, level_size,
};
use kinran_scene::Wrap;

use crate::aniso::{Kernel, Taps, reduction};
use crate::channels::{Place, read_channel};
use crate::simd::dispatch;

/// Rows in a band: the unit of parallel work, a multiple of the four rows of a block.
pub const BAND_ROWS: u32 = 16;

/// Some whole rows of one level of several planes.
pub(crate) struct PlaneBand<'a> {
    /// Level, 1 is the finest made.
    pub(crate) level: usize,
    /// Texels in a row.
    pub(crate) width: usize,
    /// First row.
    pub(crate) y0: usize,
    /// Rows.
    pub(crate) rows: usize,
    /// `[row][plane][column]`.
    pub(crate) samples: &'a [f32],
}

/// Columns worked on at a time: the planes of a tile stay in the first-level cache, and loops over arrays of
/// a known length are what compilers vectorise.
pub(crate) const TILE: usize = 256;

/// Level 0 as rows of planes.
pub(crate) trait PlaneRows: Sync {
    /// How many planes there are.
    const PLANES: usize;
    /// Memory kept from call to call.
    type Scratch: Default;
    /// Sets columns `x0 .. x0 + len` of every plane's tile to the weighted sum of `rows`; `len` ≤ [`TILE`].
    fn sum_rows(
        &self,
        rows: &Taps,
        x0: usize,
        len: usize,
        scratch: &mut Self::Scratch,
        sums: &mut [[f32; TILE]],
    );
}

/// Levels made in one pass over the level before: the finer ones of them are never stored whole.
const PASS_LEVELS: usize = 3;

/// Averages level 0 down to 1×1 and hands every band of levels 1 and up to `consume`, in parallel; returns
/// what it returned, in order, per level. Every level is an average of level 0 alone, in floats, whatever
/// the number of threads. `consume` may keep memory from one band to the next; no band is begun after its first error,
/// which is given back.
pub(crate) fn reduce_levels<R: PlaneRows, T: Send, E: Send, M: Default>(
    source: &R,
    size: (u32, u32),
    kernel: Kernel,
    wrap: [Wrap; 2],
    consume: impl Fn(PlaneBand, &mut M) -> Result<T, E> + Sync,
) -> Result<Vec<Vec<T>>, E> {
    let steps: Vec<Step> =
        (1..full_level_count(size.0, size.1)).map(|level| Step::new(size, level, kernel, wrap)).collect();
    let mut results: Vec<Vec<T>> = steps.iter().map(|_| Vec::new()).collect();
    let mut finer: Vec<f32> = Vec::new();
    let mut first = 0;
    while first < steps.len() {
        let rest = &steps[first..];
        let more = rest[1..].iter().take(PASS_LEVELS - 1).take_while(|step| step.rows_halve).count();
        let pass = Pass {
            source: if first == 0 { Finer::Source(source) } else { Finer::Samples(&finer) },
            steps: &rest[..=more],
            consume: &consume,
        };
        let last = &rest[more];
        let band_len = BAND_ROWS as usize * last.row_len::<R>();
        let mut coarse = vec![0.0; last.rows.len() * last.row_len::<R>()];
        let room: usize = rest[..more].iter().map(|step| BAND_ROWS as usize * step.row_len::<R>()).sum();
        let bands: Vec<Vec<Vec<T>>> = coarse
            .par_chunks_mut(band_len)
            .enumerate()
            .map_init(
                || (vec![0.0; room], M::default()),
                |(room, memory), (i, samples)| {
                    let mut made: Vec<Vec<T>> = pass.steps.iter().map(|_| Vec::new()).collect();
                    pass.make_band(more, i, samples, room, memory, &mut made)?;
                    Ok(made)
                },
            )
            .collect::<Result<_, E>>()?;
        for (level, made) in bands.into_iter().flat_map(|made| made.into_iter().enumerate()) {
            results[first + level].extend(made);
        }
        finer = coarse;
        first += more + 1;
    }
    Ok(results)
}

/// How a level follows from the one before.
struct Step {
    level: usize,
    fine_width: usize,
    columns: Vec<Taps>,
    rows: Vec<Taps>,
    columns_halve: bool,
    rows_halve: bool,
}

impl Step {
    fn new(size: (u32, u32), level: usize, kernel: Kernel, wrap: [Wrap; 2]) -> Self {
        let halve = |taps: &[Taps], fine: u32| {
            fine as usize == 2 * taps.len()
                && (0..).zip(taps).all(|(x, taps)| taps[..] == [(2 * x, 0.5), (2 * x + 1, 0.5)])
        };
        let columns = reduction(size.0, level, kernel, wrap[0]);
        let rows = reduction(size.1, level, kernel, wrap[1]);
        let fine_width = level_size(size.0, level - 1);
        Step {
            level,
            fine_width: fine_width as usize,
            columns_halve: halve(&columns, fine_width),
            rows_halve: halve(&rows, level_size(size.1, level - 1)),
            columns,
            rows,
        }
    }

    /// Samples in a row of all planes.
    fn row_len<R: PlaneRows>(&self) -> usize {
        self.columns.len() * R::PLANES
    }
}

/// Where a level is averaged from: level 0, or rows of another.
enum Finer<'a, R> {
    Source(&'a R),
    Samples(&'a [f32]),
}

impl<R> Clone for Finer<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for Finer<'_, R> {}

/// Some levels made together. All but the first halve the rows of the one before, so that a band of theirs
/// needs two bands of that and no others.
struct Pass<'a, R, C> {
    source: Finer<'a, R>,
    steps: &'a [Step],
    consume: &'a C,
}

impl<R: PlaneRows, C> Pass<'_, R, C> {
    /// Makes and hands on band `i` of level `depth` of the pass, after the bands under it; `room` is for one
    /// band of each of their levels.
    fn make_band<T, E, M>(
        &self,
        depth: usize,
        i: usize,
        samples: &mut [f32],
        room: &mut [f32],
        memory: &mut M,
        made: &mut [Vec<T>],
    ) -> Result<(), E>
    where
        C: Fn(PlaneBand, &mut M) -> Result<T, E>,
    {
        let step = &self.steps[depth];
        let (y0, row_len) = (i * BAND_ROWS as usize, step.row_len::<R>());
        let rows = &step.rows[y0..y0 + samples.len() / row_len];
        if depth == 0 {
            dispatch(ReduceBand { source: self.source, first_row: 0, step, rows, coarse: samples });
        } else {
            let finer = &self.steps[depth - 1];
            let finer_len = finer.row_len::<R>();
            let (band, room) = room.split_at_mut(BAND_ROWS as usize * finer_len);
            let half = BAND_ROWS as usize / 2;
            for (j, (rows, coarse)) in
                (2 * i..).zip(rows.chunks(half).zip(samples.chunks_mut(half * row_len)))
            {
                let band = &mut band[..2 * rows.len() * finer_len];
                self.make_band(depth - 1, j, band, room, memory, made)?;
                let source = Finer::<R>::Samples(band);
                let first_row = j * BAND_ROWS as usize;
                dispatch(ReduceBand { source, first_row, step, rows, coarse });
            }
        }
        let band = PlaneBand { level: step.level, width: step.columns.len(), y0, rows: rows.len(), samples };
        made[depth].push((self.consume)(band, memory)?);
        Ok(())
    }
}

/// One band of one level, as a unit that is compiled once for each instruction set.
struct ReduceBand<'a, R> {
    source: Finer<'a, R>,
    /// The row that the samples begin with.
    first_row: usize,
    step: &'a Step,
    rows: &'a [Taps],
    coarse: &'a mut [f32],
}

impl<R: PlaneRows> pulp::WithSimd for ReduceBand<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Step { fine_width, ref columns, columns_halve, .. } = *self.step;
        let width = columns.len();
        debug_assert_eq!(self.coarse.len(), self.rows.len() * width * R::PLANES, "a row for all taps");
        let mut scratch = R::Scratch::default();
        let mut tile = vec![[0.0; TILE]; R::PLANES];
        let mut fine = vec![0.0; if columns_halve { 0 } else { fine_width * R::PLANES }];
        for (taps, coarse) in self.rows.iter().zip(self.coarse.chunks_exact_mut(width * R::PLANES)) {
            for x0 in (0..fine_width).step_by(TILE) {
                let len = TILE.min(fine_width - x0);
                match self.source {
                    Finer::Source(source) => source.sum_rows(taps, x0, len, &mut scratch, &mut tile),
                    Finer::Samples(samples) => {
                        for (plane, sums) in tile.iter_mut().enumerate() {
                            sum_samples(samples, taps, &mut sums[..len], |row| {
                                ((row as usize - self.first_row) * R::PLANES + plane) * fine_width + x0
                            });
                        }
                    }
                }
                for (plane, sums) in tile.iter().enumerate() {
                    if columns_halve {
                        halve(&sums[..len], &mut coarse[plane * width + x0 / 2..][..len / 2]);
                    } else {
                        fine[plane * fine_width + x0..][..len].copy_from_slice(&sums[..len]);
                    }
                }
            }
            for (fine, coarse) in fine.chunks_exact(fine_width).zip(coarse.chunks_exact_mut(width)) {
                for (c, taps) in coarse.iter_mut().zip(columns) {
                    *c = taps.iter().map(|&(i, weight)| fine[i as usize] * weight).sum();
                }
            }
        }
    }
}

/// Sets `sums` to the weighted sum of the runs of samples that begin at `start` of each row.
#[inline(always)]
fn sum_samples(samples: &[f32], rows: &Taps, sums: &mut [f32], start: impl Fn(u32) -> usize) {
    if let [(row0, weight0), (row1, weight1)] = rows[..] {
        let pairs = samples[start(row0)..].iter().zip(&samples[start(row1)..]);
        for (sum, (v0, v1)) in sums.iter_mut().zip(pairs) {
            *sum = v0 * weight0 + v1 * weight1;
        }
        return;
    }
    sums.fill(0.0);
    for &(row, weight) in rows {
        for (sum, v) in sums.iter_mut().zip(&samples[start(row)..]) {
            *sum += v * weight;
        }
    }
}

/// Averages of pairs.
#[inline(always)]
fn halve(fine: &[f32], coarse: &mut [f32]) {
    for (c, [a, b]) in coarse.iter_mut().zip(fine.as_chunks().0) {
        *c = 0.5 * (a + b);
    }
}

/// An image's four channels as planes, colour linearised.
struct ImagePlanes<'a> {
    image: &'a Image,
    transfer: Transfer,
    size: (u32, u32),
    wrap: [Wrap; 2],
}

impl ImagePlanes<'_> {
    /// Row `y` from column `x0` on, as four planes.
    #[inline(always)]
    fn row<'p>(&self, y: u32, x0: u32, planes: impl Iterator<Item = &'p mut [f32]>) {
        let at = Place { size: self.size, y, x0, wrap: self.wrap };
        for (channel, plane) in planes.enumerate() {
            read_channel(self.image, channel, at, plane);
            if self.transfer == Transfer::Srgb && self.image.transfer != Transfer::Linear && channel < 3 {
                for v in plane {
                    *v = linear_from_srgb(*v);
                }
            }
        }
    }
}

impl PlaneRows for ImagePlanes<'_> {
    const PLANES: usize = 4;
    type Scratch = Vec<[f32; TILE]>;

    #[inline(always)]
    fn sum_rows(
        &self,
        rows: &Taps,
        x0: usize,
        len: usize,
        scratch: &mut Self::Scratch,
        sums: &mut [[f32; TILE]],
    ) {
        scratch.resize(Self::PLANES, [0.0; TILE]);
        sums.fill([0.0; TILE]);
        for &(y, weight) in rows {
            self.row(y, x0 as u32, scratch.iter_mut().map(|plane| &mut plane[..len]));
            for (sums, plane) in sums.iter_mut().zip(&*scratch) {
                for (sum, v) in sums.iter_mut().zip(plane) {
                    *sum += v * weight;
                }
            }
        }
    }
}

/// One level of 8-bit RGBA texels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8Level {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba8: Vec<u8>,
}

/// The mip chain of an image that needs no filter of its own, at level-0 size `size` (enlarged bilinearly
/// where the image is smaller). Averages are taken in linear light and rounded once, from floats. `transfer` is that of
/// the levels; with [`Transfer::Srgb`] the image is colour, encoded as it says itself ([`Image::transfer`]). `tick` is told
/// of texels of all levels.
///
/// # Errors
/// Where `tick` stops the work.
pub fn plain_levels(
    image: &Image,
    size: (u32, u32),
    transfer: Transfer,
    kernel: Kernel,
    wrap: [Wrap; 2],
    tick: &Tick<'_>,
) -> Result<Vec<Rgba8Level>, Cancelled> {
    let source = ImagePlanes { image, transfer, size, wrap };
    let finest = finest(&source, tick)?;
    let bands = reduce_levels(&source, size, kernel, wrap, |band, (): &mut ()| {
        let mut bytes = vec![0; band.width * band.rows * 4];
        for (row, out) in
            band.samples.chunks_exact(band.width * 4).zip(bytes.chunks_exact_mut(band.width * 4))
        {
            quantise_row(row, transfer, out);
        }
        tick(bytes.len() as u64 / 4)?;
        Ok::<_, Cancelled>(bytes)
    })?;
    let coarser = bands.into_iter().map(|bands| bands.concat());
    let levels = std::iter::once(finest).chain(coarser).enumerate().map(|(level, rgba8)| Rgba8Level {
        width: level_size(size.0, level),
        height: level_size(size.1, level),
        rgba8,
    });
    Ok(levels.collect())
}

/// Level 0 of [`plain_levels`].
///
/// # Errors
/// Where `tick` stops it.
pub(crate) fn finest_level(
    image: &Image,
    size: (u32, u32),
    transfer: Transfer,
    wrap: [Wrap; 2],
    tick: &Tick<'_>,
) -> Result<Rgba8Level, Cancelled> {
    let rgba8 = finest(&ImagePlanes { image, transfer, size, wrap }, tick)?;
    Ok(Rgba8Level { width: size.0, height: size.1, rgba8 })
}

fn finest(source: &ImagePlanes, tick: &Tick<'_>) -> Result<Vec<u8>, Cancelled> {
    let width = source.size.0 as usize;
    let mut finest = vec![0; width * source.size.1 as usize * 4];
    finest.par_chunks_mut(BAND_ROWS as usize * width * 4).enumerate().try_for_each(|(i, band)| {
        let mut planes = vec![0.0; width * 4];
        for (row, y) in band.chunks_exact_mut(width * 4).zip(i as u32 * BAND_ROWS..) {
            source.row(y, 0, planes.chunks_exact_mut(width));
            quantise_row(&planes, source.transfer, row);
        }
        tick(band.len() as u64 / 4)
    })?;
    Ok(finest)
}

/// One 8-bit image out of channels of others, enlarged to `size` bilinearly where they are smaller; `otherwise`
/// where there is none.
pub fn pack_channels(
    channels: [Option<(&Image, usize)>; 4],
    otherwise: [u8; 4],
    size: (u32, u32),
    wrap: [Wrap; 2],
) -> Result<Image, Error> {
    let width = size.0 as usize;
    let mut bytes = otherwise.repeat(width * size.1 as usize);
    bytes.par_chunks_mut(width * 4).enumerate().for_each(|(y, row)| {
        let at = Place { size, y: y as u32, x0: 0, wrap };
        let mut plane = vec![0.0; width];
        for (channel, source) in channels.iter().enumerate() {
            let Some((image, of)) = source else { continue };
            read_channel(image, *of, at, &mut plane);
            for (texel, v) in row.chunks_exact_mut(4).zip(&plane) {
                texel[channel] = unorm8(*v);
            }
        }
    });
    Image::new(size.0, size.1, Channels::Rgba, Pixels::U8(bytes))
}

/// The mip chain of an image that needs no filter of its own, compressed. `transfer` as for [`plain_levels`]; `tick` is
/// told of texels of all levels that are compressed.
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses, [`Error::Cancelled`] where `tick` does.
pub fn bake_plain(
    image: &Image,
    transfer: Transfer,
    encoding: Encoding,
    kernel: Kernel,
    wrap: [Wrap; 2],
    tick: &Tick<'_>,
) -> Result<Texture, Error> {
    let levels = plain_levels(image, (image.width, image.height), transfer, kernel, wrap, &|_| tick(0))?;
    compress_levels(&levels, transfer, encoding, tick)
}

/// Levels as a compressed texture; `tick` as for [`bake_plain`].
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses, [`Error::Cancelled`] where `tick` says so.
pub fn compress_levels(
    levels: &[Rgba8Level],
    transfer: Transfer,
    encoding: Encoding,
    tick: &Tick<'_>,
) -> Result<Texture, Error> {
    let levels = levels
        .iter()
        .map(|level| {
            let row = 4 * level.width as usize;
            let bands = level.rgba8.par_chunks(BAND_ROWS as usize * row).map(|band| {
                let blocks = encode(encoding, band, level.width, (band.len() / row) as u32)?;
                tick(band.len() as u64 / 4)?;
                Ok(blocks)
            });
            let data = bands.collect::<Result<Vec<_>, Error>>()?.concat();
            Ok(Level { width: level.width, height: level.height, data })
        })
        .collect::<Result<_, Error>>()?;
    Ok(Texture { format: encoding.format, transfer, levels, metadata: BTreeMap::new() })
}

/// Four planes of one row to interleaved bytes.
fn quantise_row(planes: &[f32], transfer: Transfer, out: &mut [u8]) {
    let width = planes.len() / 4;
    for (x, texel) in out.chunks_exact_mut(4).enumerate() {
        for (channel, byte) in texel.iter_mut().enumerate() {
            let v = planes[channel * width + x];
            let v = if transfer == Transfer::Srgb && channel < 3 { srgb_from_linear(v) } else { v };
            *byte = unorm8(v);
        }
    }
}

/// The byte nearest to a value, which is brought to [0, 1] first; halves are rounded up.
///
/// A cast would saturate, which compilers do element by element. The sum with 2^23 has the rounded number in its lowest
/// bits; 1e-5, about the last digit of 255, takes halves up, which would otherwise go to the even number.
#[inline(always)]
pub(crate) fn unorm8(v: f32) -> u8 {
    ((v.clamp(0.0, 1.0) * 255.0 + 1e-5) + 8_388_608.0).to_bits() as u8
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Bands are cut where it suits the caches; wherever that is, rows are the same.
        #[test]
        fn rows_depend_on_the_band_they_are_averaged_in(
            size in (1_u32..90, 2_u32..70),
            tent in any::<bool>(),
            band in 1_usize..40,
            samples in prop::collection::vec(any::<u8>(), 64),
        ) {
            let count = (size.0 * size.1) as usize;
            let samples = samples.iter().cycle().take(count).copied().collect();
            let image = Image::new(size.0, size.1, Channels::R, Pixels::U8(samples)).unwrap();
            let (kernel, wrap) = (if tent { Kernel::Tent } else { Kernel::Box }, [Wrap::Repeat; 2]);
            let source = ImagePlanes { image: &image, size, transfer: Transfer::Srgb, wrap };
            let step = Step::new(size, 1, kernel, wrap);
            let reduce = |rows: &[Taps]| {
                let mut coarse = vec![0.0; rows.len() * step.row_len::<ImagePlanes>()];
                let finer = Finer::Source(&source);
                dispatch(ReduceBand { source: finer, first_row: 0, step: &step, rows, coarse: &mut coarse });
                coarse
            };
            let banded: Vec<f32> = step.rows.chunks(band).flat_map(reduce).collect();
            prop_assert_eq!(banded, reduce(&step.rows));
        }
    }

    #[test]
    fn a_value_is_not_rounded_to_the_nearest_byte() {
        for i in 0..=255_u16 {
            let byte = |v| u16::from(unorm8(v));
            assert_eq!(byte(f32::from(i) / 255.0), i, "its own value");
            let half = (f32::from(i) + 0.5) / 255.0;
            assert_eq!(byte(half), (i + 1).min(255), "half a step above {i}");
            assert_eq!(byte(half - 1e-6), i, "a little less than half a step above {i}");
        }
        for (v, wanted) in [(-1.0, 0), (-0.0, 0), (2.0, 255), (f32::INFINITY, 255), (f32::NAN, 0)] {
            assert_eq!(unorm8(v), wanted, "{v}");
        }
    }
}

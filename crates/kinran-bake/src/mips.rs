//! Plain averages: the mip chains of colours and masks, and the averages that filters are made of.

use std::collections::BTreeMap;

use rayon::prelude::*;

use kinran_image::{
    Channels, Encoding, Error, Image, Level, Pixels, Texture, Transfer, encode_parallel, full_level_count,
    level_size,
};
use kinran_scene::Wrap;

use crate::aniso::{Kernel, Taps, reduction};
use crate::channels::{Place, read_channel};

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

/// Level 0 as rows of planes.
pub(crate) trait PlaneRows: Sync {
    /// How many planes there are.
    const PLANES: usize;
    /// Adds `weight` times row `y` to `sums`, `PLANES` runs of the level's width.
    fn add_row(&self, y: u32, weight: f32, sums: &mut [f32]);
}

/// Averages level 0 down to 1×1 and hands every band of levels 1 and up to `consume`, in parallel; returns
/// what it returned, in order, per level. Every level is an average of level 0 alone, in floats, whatever
/// the number of threads.
pub(crate) fn reduce_levels<R: PlaneRows, T: Send>(
    source: &R,
    size: (u32, u32),
    kernel: Kernel,
    wrap: [Wrap; 2],
    consume: impl Fn(PlaneBand) -> T + Sync,
) -> Vec<Vec<T>> {
    let mut finer: Vec<f32> = Vec::new();
    (1..full_level_count(size.0, size.1))
        .map(|level| {
            let columns = reduction(size.0, level, kernel, wrap[0]);
            let rows = reduction(size.1, level, kernel, wrap[1]);
            let fine_width = level_size(size.0, level - 1) as usize;
            let width = columns.len();
            let row_len = width * R::PLANES;
            let mut coarse = vec![0.0; rows.len() * row_len];
            let results = coarse
                .par_chunks_mut(BAND_ROWS as usize * row_len)
                .zip(rows.par_chunks(BAND_ROWS as usize))
                .enumerate()
                .map(|(i, (samples, rows))| {
                    let source = if level == 1 { Finer::Source(source) } else { Finer::Samples(&finer) };
                    pulp::Arch::new().dispatch(ReduceBand {
                        source,
                        fine_width,
                        columns: &columns,
                        rows,
                        coarse: samples,
                    });
                    let y0 = i * BAND_ROWS as usize;
                    consume(PlaneBand { level, width, y0, rows: rows.len(), samples })
                })
                .collect();
            finer = coarse;
            results
        })
        .collect()
}

/// Where a level is averaged from.
enum Finer<'a, R> {
    Source(&'a R),
    Samples(&'a [f32]),
}

/// One band of one level, as a unit that is compiled once for each instruction set.
struct ReduceBand<'a, R> {
    source: Finer<'a, R>,
    fine_width: usize,
    columns: &'a [Taps],
    rows: &'a [Taps],
    coarse: &'a mut [f32],
}

impl<R: PlaneRows> pulp::WithSimd for ReduceBand<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let (fine_width, width) = (self.fine_width, self.columns.len());
        let fine_row = fine_width * R::PLANES;
        let halved = fine_width == 2 * width && self.columns.iter().all(|taps| taps.len() == 2);
        let mut sums = vec![0.0; fine_row];
        for (taps, coarse) in self.rows.iter().zip(self.coarse.chunks_exact_mut(width * R::PLANES)) {
            sums.fill(0.0);
            for &(row, weight) in taps {
                match self.source {
                    Finer::Source(source) => source.add_row(row, weight, &mut sums),
                    Finer::Samples(samples) => {
                        let start = row as usize * fine_row;
                        for (sum, v) in sums.iter_mut().zip(&samples[start..start + fine_row]) {
                            *sum += v * weight;
                        }
                    }
                }
            }
            for (fine, coarse) in sums.chunks_exact(fine_width).zip(coarse.chunks_exact_mut(width)) {
                if halved {
                    for (c, pair) in coarse.iter_mut().zip(fine.chunks_exact(2)) {
                        *c = 0.5 * (pair[0] + pair[1]);
                    }
                } else {
                    for (c, taps) in coarse.iter_mut().zip(self.columns) {
                        *c = taps.iter().map(|&(i, weight)| fine[i as usize] * weight).sum();
                    }
                }
            }
        }
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
    /// Row `y` as four runs.
    #[inline(always)]
    fn row(&self, y: u32, out: &mut [f32]) {
        let width = self.size.0 as usize;
        let at = Place { size: self.size, y, x0: 0, wrap: self.wrap };
        for (channel, plane) in out.chunks_exact_mut(width).enumerate() {
            read_channel(self.image, channel, at, plane);
            if self.transfer == Transfer::Srgb && channel < 3 {
                for v in plane {
                    *v = linear_from_srgb(*v);
                }
            }
        }
    }
}

impl PlaneRows for ImagePlanes<'_> {
    const PLANES: usize = 4;

    #[inline(always)]
    fn add_row(&self, y: u32, weight: f32, sums: &mut [f32]) {
        let mut row = vec![0.0; sums.len()];
        self.row(y, &mut row);
        for (sum, v) in sums.iter_mut().zip(&row) {
            *sum += v * weight;
        }
    }
}

/// One level of 8-bit RGBA texels.
pub struct Rgba8Level {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width * height * 4` bytes.
    pub rgba8: Vec<u8>,
}

/// The mip chain of an image that needs no filter of its own, at level-0 size `size` (enlarged bilinearly
/// where the image is smaller). Averages are taken in linear light and rounded once, from floats.
pub fn plain_levels(
    image: &Image,
    size: (u32, u32),
    transfer: Transfer,
    kernel: Kernel,
    wrap: [Wrap; 2],
) -> Vec<Rgba8Level> {
    let source = ImagePlanes { image, transfer, size, wrap };
    let width = size.0 as usize;
    let mut finest = vec![0; width * size.1 as usize * 4];
    finest.par_chunks_mut(width * 4).enumerate().for_each(|(y, row)| {
        let mut planes = vec![0.0; width * 4];
        source.row(y as u32, &mut planes);
        quantise_row(&planes, transfer, row);
    });
    let bands = reduce_levels(&source, size, kernel, wrap, |band| {
        let mut bytes = vec![0; band.width * band.rows * 4];
        for (row, out) in
            band.samples.chunks_exact(band.width * 4).zip(bytes.chunks_exact_mut(band.width * 4))
        {
            quantise_row(row, transfer, out);
        }
        bytes
    });
    let coarser = bands.into_iter().map(|bands| bands.concat());
    std::iter::once(finest)
        .chain(coarser)
        .enumerate()
        .map(|(level, rgba8)| Rgba8Level {
            width: level_size(size.0, level),
            height: level_size(size.1, level),
            rgba8,
        })
        .collect()
}

/// One 8-bit image out of channels of others, enlarged to `size` bilinearly where they are smaller; 255 where
/// there is none.
pub fn pack_channels(
    channels: [Option<(&Image, usize)>; 4],
    size: (u32, u32),
    wrap: [Wrap; 2],
) -> Result<Image, Error> {
    let width = size.0 as usize;
    let mut bytes = vec![255; width * size.1 as usize * 4];
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

/// The mip chain of an image that needs no filter of its own, compressed.
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses.
pub fn bake_plain(
    image: &Image,
    transfer: Transfer,
    encoding: Encoding,
    kernel: Kernel,
    wrap: [Wrap; 2],
) -> Result<Texture, Error> {
    let levels = plain_levels(image, (image.width, image.height), transfer, kernel, wrap)
        .into_iter()
        .map(|level| {
            let data = encode_parallel(encoding, &level.rgba8, level.width, level.height)?;
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

/// The byte nearest to a value in [0, 1].
#[inline(always)]
pub(crate) fn unorm8(v: f32) -> u8 {
    (v * 255.0 + 0.5) as u8
}

/// IEC 61966-2-1, sRGB to linear.
pub fn linear_from_srgb(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// IEC 61966-2-1, linear to sRGB.
pub fn srgb_from_linear(v: f32) -> f32 {
    if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

//! Alpha of cut-out materials, whose leaves and hairs keep their area from afar.
//!
//! What is thinner than a texel has a mean alpha under the cutoff: averages make leaves, meshes and hair thin out and vanish
//! with distance. So the alpha of each level is multiplied until as much of it lies at or above the cutoff as of level 0
//! (Castaño 2010, Computing Alpha Mipmaps). There the factor is searched for; here it is read from the distribution of a level's
//! alpha, sampled bilinearly 8 × 8 times a texel, as a renderer's magnified texels are cut, and read again where alphas of one
//! bound it.

use kinran_image::{Cancelled, Encoding, Error, Image, Texture, Tick, Transfer};
use kinran_scene::Wrap;
use rayon::prelude::*;

use crate::aniso::{Kernel, Taps};
use crate::channels::{Place, read_channel, wrapped};
use crate::mips::{PlaneRows, Rgba8Level, TILE, compress_levels, plain_levels, reduce_levels, unorm8};

/// Samples along each side of a texel. Half as many miss the area of thin leaves by up to a sixth.
const SIDE: usize = 8;

/// Times that a factor is read again, most of what ones take away being made up for by the first; chosen by eye.
const ROUNDS: usize = 4;

/// Steps of alpha that are told apart.
const STEPS: f32 = 65535.0;

/// Alpha of an image as one plane.
struct Alpha<'a> {
    image: &'a Image,
    size: (u32, u32),
    wrap: [Wrap; 2],
}

impl PlaneRows for Alpha<'_> {
    const PLANES: usize = 1;
    type Scratch = Vec<f32>;

    #[inline(always)]
    fn sum_rows(
        &self,
        rows: &Taps,
        x0: usize,
        len: usize,
        plane: &mut Self::Scratch,
        sums: &mut [[f32; TILE]],
    ) {
        plane.resize(len, 0.0);
        sums.fill([0.0; TILE]);
        for &(y, weight) in rows {
            read_channel(self.image, 3, Place { size: self.size, y, x0: x0 as u32, wrap: self.wrap }, plane);
            sums[0].iter_mut().zip(&*plane).for_each(|(sum, v)| *sum += v * weight);
        }
    }
}

/// Gives levels of `image`, finest first and of its size, an alpha by which as much of each level is at or above `cutoff`,
/// 0 to 1, as of level 0, which stays as it is. Where no factor gives that share, as in a level of one texel, it is the nearest.
/// An image without alpha, or all of whose texels are on one side, is left alone. `tick` is told nothing.
///
/// # Errors
/// Where `tick` stops the work.
pub fn keep_coverage(
    image: &Image,
    cutoff: f32,
    kernel: Kernel,
    wrap: [Wrap; 2],
    levels: &mut [Rgba8Level],
    tick: &Tick<'_>,
) -> Result<(), Cancelled> {
    let size = (image.width, image.height);
    let source = Alpha { image, size, wrap };
    let mut finest = vec![0.0; size.0 as usize * size.1 as usize];
    finest.par_chunks_mut(size.0 as usize).enumerate().for_each(|(y, row)| {
        read_channel(image, 3, Place { size, y: y as u32, x0: 0, wrap }, row);
    });
    let wanted = Distribution::new(&finest, size.0 as usize, wrap, tick)?.share(cutoff);
    drop(finest);
    if wanted == 0.0 || wanted == 1.0 {
        return Ok(());
    }
    let bands = reduce_levels(&source, size, kernel, wrap, |band, (): &mut ()| {
        tick(0)?;
        Ok::<_, Cancelled>(band.samples.to_vec())
    })?;
    for (level, bands) in levels.iter_mut().skip(1).zip(bands) {
        let alpha = bands.concat();
        let width = level.width as usize;
        let mut factor = Distribution::new(&alpha, width, wrap, tick)?.factor(cutoff, wanted);
        for _ in 0..ROUNDS {
            let bounded: Vec<f32> = alpha.iter().map(|alpha| (alpha * factor).min(1.0)).collect();
            let again = Distribution::new(&bounded, width, wrap, tick)?.factor(cutoff, wanted);
            if again == 1.0 {
                break;
            }
            factor *= again;
        }
        for (texel, alpha) in level.rgba8.chunks_exact_mut(4).zip(alpha) {
            texel[3] = unorm8(alpha * factor);
        }
    }
    Ok(())
}

/// The mip chain of a colour that is cut out at `cutoff`, compressed; `tick` as for [`bake_plain`](crate::bake_plain).
///
/// # Errors
/// [`Error::Unsupported`] where the encoder refuses, [`Error::Cancelled`] where `tick` does.
pub fn bake_cutout(
    image: &Image,
    cutoff: f32,
    encoding: Encoding,
    kernel: Kernel,
    wrap: [Wrap; 2],
    tick: &Tick<'_>,
) -> Result<Texture, Error> {
    let silent = |_| tick(0);
    let mut levels = plain_levels(image, (image.width, image.height), Transfer::Srgb, kernel, wrap, &silent)?;
    keep_coverage(image, cutoff, kernel, wrap, &mut levels, &silent)?;
    compress_levels(&levels, Transfer::Srgb, encoding, tick)
}

/// How much of a level has which alpha.
struct Distribution {
    /// Samples of each step.
    counts: Vec<u64>,
    all: u64,
}

impl Distribution {
    fn new(alpha: &[f32], width: usize, wrap: [Wrap; 2], tick: &Tick<'_>) -> Result<Self, Cancelled> {
        let height = alpha.len() / width;
        let none = || vec![0; STEPS as usize + 1];
        let counts = (0..height)
            .into_par_iter()
            .with_min_len(16)
            .try_fold(
                || (none(), vec![0.0; width]),
                |(mut counts, mut blend), y| {
                    tick(0)?;
                    let row = |y: usize| &alpha[y * width..][..width];
                    let own = row(y);
                    let rows = [-1.0, 1.0].map(|side| row(beside(y, side, height, wrap[1])));
                    let columns = |x: usize| [-1.0, 1.0].map(|side| beside(x, side, width, wrap[0]));
                    // Most of a leaf and of what is beside it is of one alpha.
                    let is_even = |x: usize| {
                        let is = |x: usize| [own, rows[0], rows[1]].iter().all(|row| row[x] == own[x]);
                        let [left, right] = columns(x);
                        own[left] == own[x] && own[right] == own[x] && [left, x, right].into_iter().all(is)
                    };
                    let (even, mixed): (Vec<usize>, Vec<usize>) = (0..width).partition(|x| is_even(*x));
                    even.into_iter().for_each(|x| counts[step(own[x])] += (SIDE * SIDE) as u64);
                    for offset in offsets().into_iter().filter(|_| !mixed.is_empty()) {
                        let other = rows[usize::from(offset > 0.0)];
                        for (blend, (own, other)) in blend.iter_mut().zip(own.iter().zip(other)) {
                            *blend = own + (other - own) * offset.abs();
                        }
                        for &x in &mixed {
                            let columns = columns(x);
                            for offset in offsets() {
                                let other = blend[columns[usize::from(offset > 0.0)]];
                                let v = blend[x] + (other - blend[x]) * offset.abs();
                                counts[step(v)] += 1;
                            }
                        }
                    }
                    Ok((counts, blend))
                },
            )
            .map(|folded: Result<(Vec<u64>, Vec<f32>), Cancelled>| folded.map(|(counts, _)| counts))
            .try_reduce(none, |mut a, b| {
                a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
                Ok(a)
            })?;
        Ok(Distribution { counts, all: (alpha.len() * SIDE * SIDE) as u64 })
    }

    /// The share at or above an alpha.
    fn share(&self, alpha: f32) -> f64 {
        self.counts[step(alpha)..].iter().sum::<u64>() as f64 / self.all as f64
    }

    /// What alpha is to be multiplied with, so that the share at or above `cutoff` is nearest to `wanted`.
    fn factor(&self, cutoff: f32, wanted: f64) -> f32 {
        let (mut above, mut nearest, mut at) = (0, wanted, self.counts.len());
        for (step, count) in self.counts.iter().enumerate().rev().filter(|(_, count)| **count > 0) {
            above += count;
            let apart = (above as f64 / self.all as f64 - wanted).abs();
            // Alpha under half a code of 8 bits is none, whatever it is multiplied with.
            if apart < nearest && step as f32 > STEPS / 510.0 {
                (nearest, at) = (apart, step);
            }
        }
        if (self.share(cutoff) - wanted).abs() <= nearest {
            return 1.0;
        }
        let largest = self.counts.iter().rposition(|count| *count > 0).unwrap_or(0);
        // Half a step beside the sample, on the side that leaves it where it belongs.
        let threshold = at.min(largest + 1) as f32 - 0.5;
        cutoff * STEPS / threshold
    }
}

fn step(alpha: f32) -> usize {
    (alpha.clamp(0.0, 1.0) * STEPS + 0.5) as usize
}

/// Where samples lie in a texel, from its middle.
fn offsets() -> [f32; SIDE] {
    std::array::from_fn(|i| (i as f32 + 0.5) / SIDE as f32 - 0.5)
}

/// The texel before (`side` below zero) or behind number `i`.
fn beside(i: usize, side: f32, count: usize, wrap: Wrap) -> usize {
    let other = if side < 0.0 { i as i64 - 1 } else { i as i64 + 1 };
    wrapped(other, count as u32, wrap) as usize
}

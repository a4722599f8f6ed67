//! What the texels of a normal map tell about it: whether it is one, and which way its green points.

use std::ops::Range;

use kinran_image::{Channels, Image, Pixels};
use rayon::prelude::*;

use super::Green;

/// Least share of the slopes' curl that must speak for one handedness before [`guess_green`] answers: the
/// correlation at which the curl of the right one has 0.6 of the wrong one's energy.
///
/// Of 22 normal maps whose green is known to point up (16 agree with the height map beside them, 6 are named
/// so or belong to glTF files) 18 have 0.28 to 0.88, two 0.08 and 0.09, and two that are no height field's (woven
/// cloth, an atlas) 0.00 ± 0.03; none is clearly negative. A map with green turned over has the opposite
/// number. 0.25 stands between, chosen by eye.
pub const GREEN_CONFIDENCE: f64 = 0.25;

/// Texels looked at in one image, about: shares and correlations of half a million texels have a standard error of
/// 0.0014 at most, a hundredth of what the decisions below turn on.
const MAX_LOOKED_AT: usize = 1 << 19;

/// Which way green points in a normal map, by its texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GreenGuess {
    /// +Y.
    Up,
    /// −Y.
    Down,
    /// The slopes do not tell.
    Unsure,
}

/// Which way green points, judged by [`green_correlation`] against [`GREEN_CONFIDENCE`].
pub fn guess_green(image: &Image) -> GreenGuess {
    guess_by_correlation(green_correlation(image))
}

/// The answer that a [`green_correlation`] gives.
pub(super) fn guess_by_correlation(correlation: f64) -> GreenGuess {
    if correlation >= GREEN_CONFIDENCE {
        GreenGuess::Up
    } else if correlation <= -GREEN_CONFIDENCE {
        GreenGuess::Down
    } else {
        GreenGuess::Unsure
    }
}

impl GreenGuess {
    /// Whether the texels say the opposite of `green`.
    pub fn contradicts(self, green: Green) -> bool {
        matches!((self, green), (GreenGuess::Up, Green::Down) | (GreenGuess::Down, Green::Up))
    }
}

/// How strongly the slopes of a normal map speak for green up (towards 1) or down (towards −1).
///
/// Normals of a height field h have slopes `h_x = -n_x/n_z` and, with y up and rows v counted downwards,
/// `h_v = n_y/n_z`. A gradient has no curl: `∂h_x/∂v = ∂h_v/∂x`. With green turned over, the second changes
/// its sign. So of a = ∂h_x/∂v and b = ∂h_v/∂x, by central differences, the result is 2 Σab / Σ(a² + b²), the
/// curl's energies being Σ(a ∓ b)². 0 where the map is flat or a side has fewer than 3 texels.
pub fn green_correlation(image: &Image) -> f64 {
    let (width, height) = (image.width as usize, image.height as usize);
    if width < 3 || height < 3 {
        return 0.0;
    }
    let signed = is_signed(image);
    let slopes = |texel: &[f32; 4]| {
        let (x, y) = (component(texel[0], signed), component(texel[1], signed));
        // No steeper than 78.5°, beyond which 8 bits hold no z.
        let z = (1.0 - x * x - y * y).max(0.04).sqrt();
        (-x / z, y / z)
    };
    let row_slopes = |y: u32| -> Vec<(f64, f64)> {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        row.iter().map(slopes).collect()
    };
    let sums = in_rows(image, 1..image.height - 1, |y| {
        let rows = [y - 1, y, y + 1].map(&row_slopes);
        let (mut ab, mut aabb) = (0.0, 0.0);
        for x in 1..width - 1 {
            let a = rows[2][x].0 - rows[0][x].0;
            let b = rows[1][x + 1].1 - rows[1][x - 1].1;
            ab += a * b;
            aabb += a * a + b * b;
        }
        (ab, aabb)
    });
    let (ab, aabb) = sums.iter().fold((0.0, 0.0), |sum, row| (sum.0 + row.0, sum.1 + row.1));
    if aabb > 0.0 { 2.0 * ab / aabb } else { 0.0 }
}

/// Why an image cannot be a tangent-space normal map, if it cannot.
///
/// It is none if it is grey; if more than 30 % of its vectors are longer than 1.25 or shorter than 0.75 (47
/// real maps: at most 0.5 %); if blue is below 0.5 on average (real: 0.91 and more), or red or green outside
/// 0.35 to 0.65 (real: 0.47 to 0.54). Of 134 colour, roughness, height, specular, occlusion, metallic, flow
/// and mask images all are refused.
pub fn not_normals(image: &Image) -> Option<String> {
    if image.channels < Channels::Rgb {
        return Some("it is grey, a normal map has red and green".into());
    }
    let signed = is_signed(image);
    let rows = in_rows(image, 0..image.height, |y| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        let (mut wrong, mut sum) = (0usize, [0.0f64; 3]);
        for texel in &row {
            let v = [0, 1, 2].map(|i| component(texel[i], signed));
            let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
            wrong += usize::from((length - 1.0).abs() > 0.25);
            for (s, c) in sum.iter_mut().zip(v) {
                *s += c * 0.5 + 0.5;
            }
        }
        (wrong, sum)
    });
    let count = rows.len() * image.width as usize;
    let wrong: usize = rows.iter().map(|row| row.0).sum();
    let [red, green, blue] = [0, 1, 2].map(|i| rows.iter().map(|row| row.1[i]).sum::<f64>() / count as f64);
    let share = wrong as f64 / count as f64;
    if share > 0.3 {
        return Some(format!(
            "{:.0} % of its vectors are not near length 1 (a normal map has almost none, 30 % is too many)",
            share * 100.0
        ));
    }
    if blue < 0.5 {
        return Some(format!("its blue is {blue:.2} on average (a normal map's is above 0.5)"));
    }
    let tilted = |mean: f64| !(0.35..=0.65).contains(&mean);
    if tilted(red) || tilted(green) {
        return Some(format!(
            "its red and green are {red:.2} and {green:.2} on average (a normal map's are near 0.5)"
        ));
    }
    None
}

/// What part of a normal map's vectors may be off unit length and pass for noise: JPEG's ringing stays below it in the
/// 47 maps of [`not_normals`], which have at most 0.5 % that are off by more. Chosen by eye.
const LENGTHS_SHARE: f64 = 0.01;

/// A sentence's part on the vectors of a normal map, where more than a hundredth of them are shorter than 0.9 or longer
/// than 1.1; of texels looked at. `None` for images without blue.
pub fn odd_lengths(image: &Image) -> Option<String> {
    if image.channels < Channels::Rgb {
        return None;
    }
    let signed = is_signed(image);
    let rows = in_rows(image, 0..image.height, |y| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        let lengths = row.iter().map(|texel| {
            let v = [0, 1, 2].map(|i| component(texel[i], signed));
            v.iter().map(|c| c * c).sum::<f64>().sqrt()
        });
        lengths.fold((0usize, f64::INFINITY, 0.0f64), |(odd, least, most), length| {
            (odd + usize::from(!(0.9..=1.1).contains(&length)), least.min(length), most.max(length))
        })
    });
    let count = rows.len() * image.width as usize;
    let share = rows.iter().map(|row| row.0).sum::<usize>() as f64 / count as f64;
    let (least, most) = rows.iter().fold((f64::INFINITY, 0.0f64), |(a, b), row| (a.min(row.1), b.max(row.2)));
    (share > LENGTHS_SHARE).then(|| {
        format!(
            "{:.0} % of its vectors are not of unit length, by more than 0.1 ({least:.2} to {most:.2})",
            share * 100.0
        )
    })
}

/// How far below the surface a vector is not there by rounding: three steps of 8 bits, as JPEG moves samples.
const BELOW: f64 = 3.0 * 2.0 / 255.0;

/// A sentence's part on the vectors of a normal map that point below the surface, blue under 0.5, which no vector in tangent
/// space does: how many, and their share. `None` where there is none, and for images without blue.
pub fn below_surface(image: &Image) -> Option<String> {
    if image.channels < Channels::Rgb {
        return None;
    }
    let signed = is_signed(image);
    let below = count(image, |texel| component(texel[2], signed) < -BELOW);
    (below > 0).then(|| {
        let (all, are) = (share_of(below, image), if below == 1 { "vector points" } else { "vectors point" });
        format!("{below} {are} below the surface, their blue is under 0.5 ({all} of the map)")
    })
}

/// How far outside of 0 to 1 a number is not there by rounding: half a step of 8 bits.
const OUTSIDE: f32 = 0.5 / 255.0;

/// A sentence's part on texels of which one of `channels` (0 to 3) is below 0 or above 1, as floats may be: their share and
/// the numbers found. `None` where there is none.
pub fn outside_unit(image: &Image, channels: &[usize]) -> Option<String> {
    if !matches!(image.pixels, Pixels::F32(_)) {
        return None;
    }
    let values = |texel: &[f32; 4]| channels.iter().map(|&c| texel[c]).collect::<Vec<f32>>();
    let is_outside = |v: &f32| !(-OUTSIDE..=1.0 + OUTSIDE).contains(v);
    let outside = count(image, |texel| channels.iter().any(|&c| is_outside(&texel[c])));
    let row_range = |y: u32| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        let values = row.iter().flat_map(values);
        values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)))
    };
    (outside > 0).then(|| {
        let ranges = (0..image.height).map(row_range);
        let (least, most) =
            ranges.fold((f32::INFINITY, f32::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let share = share_of(outside, image);
        format!("{share} of its texels are outside of 0 to 1 ({least:.2} to {most:.2}) and are clamped")
    })
}

/// How far the channels of a texel of a grey map may be apart: JPEG leaves at most 7 steps of 8 bits at any quality of what
/// was grey within 2, and none of what was grey; of 54 roughness, occlusion and metalness maps none has more than 0.
const GREY: f32 = 8.0 / 255.0;

/// A sentence's part on a map that is taken for grey and is not: in more than 1 % of its texels red, green and blue are more
/// than eight steps of 8 bits apart. `None` where it is grey.
pub fn colored(image: &Image) -> Option<String> {
    let apart = |[r, g, b, _]: &[f32; 4]| r.max(*g).max(*b) - r.min(*g).min(*b);
    let colored = count(image, |texel| apart(texel) > GREY + 1e-6);
    (colored * 100 > image.width as usize * image.height as usize)
        .then(|| format!("red, green and blue differ in {} of its texels", share_of(colored, image)))
}

/// Whether an image has an alpha that is not 1 everywhere.
pub(super) fn has_alpha(image: &Image) -> bool {
    let has_channel = matches!(image.channels, Channels::Rg | Channels::Rgba);
    has_channel && count(image, |texel| texel[3] < 1.0 - OUTSIDE) > 0
}

/// How many of all texels `is_one` holds for.
fn count(image: &Image, is_one: impl Fn(&[f32; 4]) -> bool + Sync) -> usize {
    let of_row = |y: u32| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        row.iter().filter(|texel| is_one(texel)).count()
    };
    (0..image.height).into_par_iter().map(of_row).sum()
}

/// So many of an image's texels in percent, with two digits that count.
fn share_of(texels: usize, image: &Image) -> String {
    let percent = 100.0 * texels as f64 / (f64::from(image.width) * f64::from(image.height));
    let digits = (1.0 - percent.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{percent:.digits$} %")
}

/// Texels along the side of the squares whose means are compared: JPEG that halves colour leaves them, and little of single
/// texels of normal maps.
const SQUARE: usize = 8;

/// How far two images are apart, root mean squares over means of squares and channels.
pub(super) struct Apart {
    /// From the other, or from one minus it.
    pub(super) plain: f64,
    /// From the other with green turned over; of normal maps.
    pub(super) turned: f64,
    /// Standard deviation of the first.
    spread: f64,
}

impl Apart {
    /// Whether a distance is more than saving as JPEG makes: 2/255, and 0.15 of what there is to see. Of 40 normal maps and
    /// their mirror images, saved with colour halved at qualities of 95, 85, 75 and 50, three of the last are farther apart;
    /// of 636 pairs of different maps, 17 are not, of which one is next to flat.
    pub(super) fn is_far(&self, distance: f64) -> bool {
        distance > 2.0 / 255.0 + 0.15 * self.spread
    }
}

/// How many texels along a side of `large` one of `small` stands for, where that is a whole number and the same for both
/// sides.
fn ratio(small: &Image, large: &Image) -> Option<u32> {
    let ratio = large.width / small.width;
    (ratio > 0 && (small.width * ratio, small.height * ratio) == (large.width, large.height)).then_some(ratio)
}

/// Compares two images in their first channels, or with none the x and y of normal maps, halved; one may be a whole number
/// of times as large as the other, `None` where their sizes differ otherwise. With `is_opposite` the second is turned over.
pub(super) fn apart(a: &Image, b: &Image, channels: usize, is_opposite: bool) -> Option<Apart> {
    // Squares of the larger one, and what they are in the other.
    let squares = |ratio: u32| (SQUARE / ratio as usize).max(1);
    let sides = match (ratio(b, a), ratio(a, b)) {
        (Some(larger), _) => [larger as usize * squares(larger), squares(larger)],
        (_, Some(larger)) => [squares(larger), larger as usize * squares(larger)],
        (None, None) => return None,
    };
    let is_normal = channels == 0;
    let signed = [a, b].map(is_signed);
    let value = |sample: f32, signed: bool| match is_normal {
        true => 0.5 * component(sample, signed),
        false => f64::from(sample),
    };
    let used = if is_normal { 2 } else { channels };
    let columns = (a.width as usize).div_ceil(sides[0]);
    let rows = in_rows(a, 0..a.height.div_ceil(sides[0] as u32), |band| {
        let mut means = vec![[[0.0f64; 3]; 2]; columns];
        let mut texels = Vec::new();
        for (which, image) in [a, b].into_iter().enumerate() {
            let side = sides[which] as u32;
            let band = band * side..image.height.min((band + 1) * side);
            for y in band.clone() {
                image.row_rgba_f32(y, &mut texels);
                for (square, mean) in texels.chunks(sides[which]).zip(&mut means) {
                    let weight = 1.0 / (square.len() * band.len()) as f64;
                    for texel in square {
                        for (mean, sample) in mean[which].iter_mut().zip(texel).take(used) {
                            *mean += weight * value(*sample, signed[which]);
                        }
                    }
                }
            }
        }
        let mut row = Sums::default();
        for [of_a, of_b] in means {
            for (c, (x, y)) in of_a.into_iter().zip(of_b).take(used).enumerate() {
                let y = if is_opposite { 1.0 - y } else { y };
                row.add(c, x, y, if is_normal && c == 1 { -y } else { y });
            }
        }
        row
    });
    let texels = (rows.len() * columns).max(1) as f64;
    let sum = rows.iter().fold(Sums::default(), |sum, row| sum.and(row));
    let mean_square = |squares: f64| (squares / (texels * used as f64)).sqrt();
    let variances = sum.first.iter().zip(&sum.squares).take(used);
    let variance = variances.map(|(first, square)| square / texels - (first / texels).powi(2)).sum::<f64>();
    Some(Apart {
        plain: mean_square(sum.plain),
        turned: mean_square(sum.turned),
        spread: (variance / used as f64).max(0.0).sqrt(),
    })
}

/// Sums over the squares of two images.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Squares of differences, and with green turned over.
    plain: f64,
    turned: f64,
    /// Of the first image, by channel, and its squares.
    first: [f64; 3],
    squares: [f64; 3],
}

impl Sums {
    fn add(&mut self, channel: usize, x: f64, y: f64, turned: f64) {
        self.plain += (x - y).powi(2);
        self.turned += (x - turned).powi(2);
        self.first[channel] += x;
        self.squares[channel] += x * x;
    }

    fn and(self, other: &Sums) -> Sums {
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        Sums {
            plain: self.plain + other.plain,
            turned: self.turned + other.turned,
            first: add(self.first, other.first),
            squares: add(self.squares, other.squares),
        }
    }
}

/// Whether an image shows no colour: one channel, or three that differ by no more than what JPEG does to
/// grey (2/255) in 99 % of the texels.
pub(super) fn is_grey(image: &Image) -> bool {
    if image.channels < Channels::Rgb {
        return true;
    }
    let is_colored = |[r, g, b, _]: &&[f32; 4]| r.max(*g).max(*b) - r.min(*g).min(*b) > 2.5 / 255.0;
    let rows = in_rows(image, 0..image.height, |y| {
        let mut row = Vec::new();
        image.row_rgba_f32(y, &mut row);
        row.iter().filter(is_colored).count()
    });
    rows.iter().sum::<usize>() * 100 <= rows.len() * image.width as usize
}

/// Whether an image holds numbers below 0, as floats may: its components are from −1 to 1.
pub(super) fn is_signed(image: &Image) -> bool {
    matches!(&image.pixels, Pixels::F32(data) if data.iter().any(|v| *v < 0.0))
}

fn component(sample: f32, signed: bool) -> f64 {
    let sample = f64::from(sample);
    if signed { sample } else { sample * 2.0 - 1.0 }
}

/// What `look` says of the rows looked at, in parallel and in order.
fn in_rows<T: Send>(image: &Image, rows: Range<u32>, look: impl Fn(u32) -> T + Sync + Send) -> Vec<T> {
    // An odd step meets every phase of a weave whose period is a power of two.
    let step = (image.width as usize * image.height as usize).div_ceil(MAX_LOOKED_AT) | 1;
    let rows: Vec<u32> = rows.step_by(step).collect();
    rows.into_par_iter().map(look).collect()
}

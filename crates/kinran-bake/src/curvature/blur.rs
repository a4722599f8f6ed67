//! The blur of curvature over the surface (slide: Skin Shading | Curvature: an equal blend of two Gaussians).
//!
//! - Sharp, Soliman, Crane. The Vector Heat Method. ACM TOG 38(3), 2019.
//! - Pinkall, Polthier. Computing Discrete Minimal Surfaces and Their Conjugates. 1993.
//! - Hammond, Vandergheynst, Gribonval. Wavelets on Graphs via Spectral Graph Theory. 2011.
//!
//! A Gaussian of deviation σ is what heat is after the time σ²/2, so the blur is `½ exp(-t₁L) + ½ exp(-t₂L)` of the surface's
//! Laplacian L, with cotangent weights and Voronoi areas. Heat flows along the surface only: it crosses seams, for
//! those are welded, and not the gap between lips, fingers or eyelids, however narrow. Each edge turns the tensor of
//! its far end by the shortest arc between the two normals, which is parallel transport along it; a tensor's trace
//! needs no turning and its deviator, two numbers, turns by twice the angle.
//!
//! Both exponentials come from one Chebyshev series of one operator Y, an average over neighbours whose weights are
//! not negative and sum to one. So constants stay exactly what they are, and spheres and cylinders keep their curvature.

use super::faces::{frame, point_areas};
use super::surface::{Fans, Welded, others};
use glam::Vec3;
use kinran_shading::Sym2;
use rayon::prelude::*;

/// Points of one piece of work.
const BAND: usize = 4096;

/// What of the blur's weight the series may lose.
const TAIL: f64 = 1e-4;

/// Rates of exchange above those of this share of the points are lowered to theirs, by giving the point more area: the
/// smallest of all triangles would set the number of terms for the whole mesh. Chosen by the clock.
const RATE_QUANTILE: f64 = 0.98;

/// Largest product of time and rate, which takes some 600 terms: points closer than a 70th of the wider Gaussian. Beyond
/// it the blur of the finest places gets narrower.
const EXPONENT_MAX: f64 = 20_000.0;

/// One neighbour in a point's average.
#[derive(Clone, Copy, Default)]
struct Link {
    point: u32,
    weight: f32,
    /// Weight times cosine and sine of twice the angle that transport turns by.
    turn: [f32; 2],
}

/// The averaging operator Y.
struct Average {
    starts: Vec<u32>,
    links: Vec<Link>,
    /// What a point keeps of itself.
    keep: Vec<f32>,
    /// Rate of exchange that Y's links stand for, 1 over the mesh's unit squared.
    rate: f64,
}

/// Blurs tensors in place by the mean of Gaussians of these deviations, in the mesh's unit.
pub(crate) fn blur(
    surface: &Welded,
    fans: &Fans,
    normals: &[Vec3],
    tensors: &mut [Sym2],
    deviations: &[f64],
) {
    let longest = deviations.iter().copied().fold(0.0, f64::max);
    if longest <= 0.0 {
        return;
    }
    let average = Average::new(surface, fans, normals, 0.5 * longest * longest);
    if average.rate <= 0.0 {
        return;
    }
    let series = coefficients(deviations, average.rate);

    // Trace half, and the deviator as a complex number.
    let start: Vec<[f32; 3]> =
        tensors.iter().map(|t| [0.5 * (t.xx + t.yy), 0.5 * (t.xx - t.yy), t.xy]).collect();
    let mut sum: Vec<[f32; 3]> = start.iter().map(|s| s.map(|x| series[0] * x)).collect();
    let mut before = start;
    let mut now = vec![[0.0f32; 3]; before.len()];
    average.step(&before, &mut now, &mut sum, series.get(1).copied().unwrap_or(0.0));
    for &coefficient in &series[2.min(series.len())..] {
        // T(k+1) = 2 Y T(k) - T(k-1), written over T(k-1).
        average.step_over(&now, &mut before, &mut sum, coefficient);
        std::mem::swap(&mut before, &mut now);
    }
    for (tensor, [half, real, imaginary]) in tensors.iter_mut().zip(sum) {
        *tensor = Sym2 { xx: half + real, xy: imaginary, yy: half - real };
    }
}

impl Average {
    fn new(surface: &Welded, fans: &Fans, normals: &[Vec3], time: f64) -> Self {
        let points = surface.positions.len();
        let areas = point_areas(surface);

        // Neighbours in the order in which they are met around the point, with cotangent weights.
        let bands: Vec<(Vec<u32>, Vec<Link>)> = (0..points.div_ceil(BAND))
            .into_par_iter()
            .map(|band| {
                let mut counts = Vec::with_capacity(BAND);
                let mut links: Vec<Link> = Vec::with_capacity(7 * BAND);
                for point in band * BAND..points.min((band + 1) * BAND) {
                    let first = links.len();
                    gather(surface, fans, normals, point, &mut links);
                    counts.push((links.len() - first) as u32);
                }
                (counts, links)
            })
            .collect();
        let mut starts = Vec::with_capacity(points + 1);
        let mut links = Vec::with_capacity(bands.iter().map(|(_, links)| links.len()).sum());
        starts.push(0u32);
        for (counts, band) in bands {
            for count in counts {
                starts.push(starts[starts.len() - 1] + count);
            }
            links.extend(band);
        }

        // Rates, the largest of them lowered.
        let rate_of = |point: usize| -> f64 {
            let links = &links[starts[point] as usize..starts[point + 1] as usize];
            let sum: f64 = links.iter().map(|l| f64::from(l.weight)).sum();
            if sum > 0.0 { sum / f64::from(areas[point]).max(f64::MIN_POSITIVE) } else { 0.0 }
        };
        let rates: Vec<f64> = (0..points).map(rate_of).collect();
        let mut sorted: Vec<f64> = rates.iter().copied().filter(|&r| r > 0.0).collect();
        let rate = if sorted.is_empty() {
            0.0
        } else {
            let rank = ((sorted.len() - 1) as f64 * RATE_QUANTILE) as usize;
            *sorted.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        let rate = rate.min(EXPONENT_MAX / time);

        // Y = 1 - L / rate.
        let mut keep = Vec::with_capacity(points);
        for point in 0..points {
            let links = &mut links[starts[point] as usize..starts[point + 1] as usize];
            let total: f64 = links.iter().map(|l| f64::from(l.weight)).sum();
            let given = if rate > 0.0 { (rates[point] / rate).min(1.0) } else { 0.0 };
            let scale = if total > 0.0 { (given / total) as f32 } else { 0.0 };
            for link in links.iter_mut() {
                link.weight *= scale;
                link.turn = link.turn.map(|x| x * link.weight);
            }
            keep.push(1.0 - links.iter().map(|l| l.weight).sum::<f32>());
        }
        Self { starts, links, keep, rate }
    }

    /// The average at a point.
    #[inline(always)]
    fn at(&self, point: usize, from: &[[f32; 3]]) -> [f32; 3] {
        let own = from[point];
        let keep = self.keep[point];
        let mut sum = own.map(|x| keep * x);
        for link in &self.links[self.starts[point] as usize..self.starts[point + 1] as usize] {
            let [half, real, imaginary] = from[link.point as usize];
            let [cos, sin] = link.turn;
            sum[0] += link.weight * half;
            sum[1] += cos * real - sin * imaginary;
            sum[2] += sin * real + cos * imaginary;
        }
        sum
    }

    /// `to = Y from`, and its part of the sum.
    fn step(&self, from: &[[f32; 3]], to: &mut [[f32; 3]], sum: &mut [[f32; 3]], coefficient: f32) {
        (to.par_chunks_mut(BAND).zip(sum.par_chunks_mut(BAND)).enumerate()).for_each(|(band, (to, sum))| {
            for (i, (to, sum)) in to.iter_mut().zip(sum).enumerate() {
                *to = self.at(band * BAND + i, from);
                (0..3).for_each(|c| sum[c] += coefficient * to[c]);
            }
        });
    }

    /// `over = 2 Y from - over`, and its part of the sum.
    fn step_over(&self, from: &[[f32; 3]], over: &mut [[f32; 3]], sum: &mut [[f32; 3]], coefficient: f32) {
        (over.par_chunks_mut(BAND).zip(sum.par_chunks_mut(BAND)).enumerate()).for_each(
            |(band, (over, sum))| {
                for (i, (over, sum)) in over.iter_mut().zip(sum).enumerate() {
                    let average = self.at(band * BAND + i, from);
                    for c in [0, 1, 2] {
                        over[c] = 2.0 * average[c] - over[c];
                        sum[c] += coefficient * over[c];
                    }
                }
            },
        );
    }
}

/// A point's neighbours: half the sum of cotangents opposite to each edge, negative sums as zero, and the turn, not yet
/// multiplied with the weight.
fn gather(surface: &Welded, fans: &Fans, normals: &[Vec3], point: usize, links: &mut Vec<Link>) {
    let first = links.len();
    let here = surface.positions[point].as_dvec3();
    for &triangle in fans.around(point) {
        let (a, b) = others(surface.triangles[triangle as usize], point as u32);
        let (pa, pb) = (surface.positions[a as usize].as_dvec3(), surface.positions[b as usize].as_dvec3());
        let (to_a, to_b, across) = (pa - here, pb - here, pb - pa);
        let double_area = to_a.cross(to_b).length();
        if a == b || a as usize == point || b as usize == point || double_area <= 0.0 {
            continue;
        }
        // Opposite to the edge to a lies b, and the other way round.
        let halves = [(a, to_b.dot(across) / double_area), (b, -to_a.dot(across) / double_area)];
        for (other, cotangent) in halves {
            let half = 0.5 * cotangent as f32;
            match links[first..].iter_mut().find(|link| link.point == other) {
                Some(link) => link.weight += half,
                None => links.push(Link { point: other, weight: half, turn: [1.0, 0.0] }),
            }
        }
    }
    let n = normals[point];
    let (t, b) = frame(n);
    for link in &mut links[first..] {
        let other = normals[link.point as usize];
        let one_plus = 1.0 + n.dot(other);
        // A fold back onto itself has no shortest arc, a point without a normal no frame.
        if link.weight.is_nan()
            || link.weight <= 0.0
            || one_plus < 1e-3
            || n == Vec3::ZERO
            || other == Vec3::ZERO
        {
            link.weight = 0.0;
            continue;
        }
        let (tangent, _) = frame(other);
        let turned = tangent - (n + other) * (n.dot(tangent) / one_plus);
        let (cos, sin) = (turned.dot(t), turned.dot(b));
        let inverse = (cos * cos + sin * sin).recip();
        link.turn = [(cos * cos - sin * sin) * inverse, 2.0 * cos * sin * inverse];
    }
}

/// Coefficients of the Chebyshev series of the mean of `exp(-z (1 - y))`, `z = rate σ²/2`: `exp(-z) I0(z)`, then
/// `2 exp(-z) Ik(z)`. By Miller's backward recurrence, which their sum, one, normalises. The tail that is left out is
/// given back to the rest.
fn coefficients(deviations: &[f64], rate: f64) -> Vec<f32> {
    let mut series: Vec<f64> = Vec::new();
    for &deviation in deviations {
        let z = 0.5 * rate * deviation * deviation;
        // Ik falls off like exp(-k² / 2z).
        let last = (8.0 * libm::sqrt(z) + 20.0) as usize;
        let mut bessel = vec![0.0; last + 2];
        bessel[last] = 1e-280;
        for k in (1..=last).rev() {
            let next = if z > 0.0 { 2.0 * k as f64 / z * bessel[k] + bessel[k + 1] } else { 0.0 };
            bessel[k - 1] = next;
            if next > 1e200 {
                bessel[k - 1..].iter_mut().for_each(|b| *b *= 1e-250);
            }
        }
        if z <= 0.0 {
            bessel.fill(0.0);
            bessel[0] = 1.0;
        }
        let sum: f64 = bessel[0] + 2.0 * bessel[1..].iter().sum::<f64>();
        series.resize(series.len().max(bessel.len()), 0.0);
        for (k, b) in bessel.iter().enumerate() {
            let twice = if k == 0 { 1.0 } else { 2.0 };
            series[k] += twice * b / sum / deviations.len() as f64;
        }
    }
    let mut tail = 0.0;
    while series.len() > 1 && tail + series[series.len() - 1] < TAIL {
        tail += series.pop().unwrap_or(0.0);
    }
    let kept: f64 = series.iter().sum();
    series.iter().map(|c| (c / kept) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the ends of the operator's spectrum and inside it.
    #[test]
    fn series_is_the_mean_of_exponentials() {
        for (deviations, rate) in
            [(vec![8.0, 2.3], 20.0), (vec![1.0], 0.5), (vec![0.1, 0.1], 1e-3), (vec![0.0, 3.0], 7.0)]
        {
            let series = coefficients(&deviations, rate);
            for y in [-1.0f64, -0.3, 0.0, 0.7, 0.99, 1.0] {
                let angle = y.acos();
                let got: f64 =
                    series.iter().enumerate().map(|(k, &c)| f64::from(c) * (k as f64 * angle).cos()).sum();
                let want: f64 =
                    deviations.iter().map(|s| (-0.5 * rate * s * s * (1.0 - y)).exp()).sum::<f64>()
                        / deviations.len() as f64;
                assert!(
                    (want - got).abs() < 3e-4,
                    "{deviations:?}, rate {rate}, y {y}: wanted {want}, got {got}"
                );
            }
        }
    }
}

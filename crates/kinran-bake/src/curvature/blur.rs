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

use super::faces::{Corners, frame_tangents, turn};
use super::surface::{Fans, Welded};
use crate::aniso::lanes::{F8, LANES, V8};
use crate::pieces::Pieces;
use crate::simd::dispatch;
use glam::{Vec3, Vec4, Vec4Swizzles, vec4};
use kinran_image::{Cancelled, Tick};
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

/// One neighbour in a point's average: its weight, the weight times cosine and sine of twice the angle that transport turns
/// by, and the bits of its point's index; four numbers that are loaded at once.
#[derive(Clone, Copy, Default)]
#[repr(align(16))]
struct Link([f32; 4]);

impl Link {
    #[inline(always)]
    fn point(&self) -> u32 {
        self.0[3].to_bits()
    }
}

/// The links of [`BAND`] points.
struct Band {
    /// Where each point's links end.
    ends: Vec<u32>,
    links: Vec<Link>,
    /// What each point keeps of itself.
    keep: Vec<f32>,
}

/// The averaging operator Y.
struct Average {
    bands: Vec<Band>,
    /// Rate of exchange that Y's links stand for, 1 over the unit squared.
    rate: f64,
}

/// Blurs tensors in place by the mean of Gaussians of these deviations, in the mesh's unit. `tick` is told of so many `units`;
/// where it stops the work, the tensors are what they were.
pub(crate) fn blur(
    surface: &Welded,
    fans: &Fans,
    normals: &[Vec3],
    tensors: &mut [Sym2],
    deviations: &[f64],
    units: u64,
    tick: &Tick<'_>,
) -> Result<(), Cancelled> {
    // Lengths in the unit in which the model is about one large.
    let scale = surface.unit_scale();
    let deviations: Vec<f64> = deviations.iter().map(|d| d * f64::from(scale)).collect();
    let longest = deviations.iter().copied().fold(0.0, f64::max);
    if longest <= 0.0 {
        return tick(units);
    }
    let average = Average::new(surface, fans, normals, scale, 0.5 * longest * longest);
    if average.rate <= 0.0 {
        return tick(units);
    }
    let series = coefficients(&deviations, average.rate);
    let pieces = Pieces::new(tick, units, series.len().max(2));
    pieces.done()?;

    // Trace half, and the deviator as a complex number.
    let start: Vec<Vec4> =
        tensors.iter().map(|t| vec4(0.5 * (t.xx + t.yy), 0.5 * (t.xx - t.yy), t.xy, 0.0)).collect();
    let mut sum: Vec<Vec4> = start.iter().map(|&s| series[0] * s).collect();
    let mut before = start;
    let mut now = vec![Vec4::ZERO; before.len()];
    average.step(&before, &mut now, &mut sum, series.get(1).copied().unwrap_or(0.0));
    pieces.done()?;
    for &coefficient in series.iter().skip(2) {
        // T(k+1) = 2 Y T(k) - T(k-1), written over T(k-1).
        average.step_over(&now, &mut before, &mut sum, coefficient);
        std::mem::swap(&mut before, &mut now);
        pieces.done()?;
    }
    for (tensor, sum) in tensors.iter_mut().zip(sum) {
        *tensor = Sym2 { xx: sum.x + sum.y, xy: sum.z, yy: sum.x - sum.y };
    }
    Ok(())
}

impl Average {
    fn new(surface: &Welded, fans: &Fans, normals: &[Vec3], scale: f32, time: f64) -> Self {
        let points = surface.positions.len();
        let mut areas = vec![0.0f32; points];
        let mut cotangents = vec![[0.0f32; 3]; surface.triangles.len()];
        dispatch(Cotangents { surface, scale, cotangents: &mut cotangents, areas: &mut areas });

        // Neighbours in the order in which they are met around the point, with cotangent weights, and rates.
        let gathered: Vec<(Band, Vec<f64>)> = (0..points.div_ceil(BAND))
            .into_par_iter()
            .map(|band| {
                let range = band * BAND..points.min((band + 1) * BAND);
                let mut links: Vec<Link> = Vec::with_capacity(7 * range.len());
                let mut owners: Vec<u32> = Vec::with_capacity(7 * range.len());
                let mut ends = Vec::with_capacity(range.len());
                for point in range.clone() {
                    gather(surface, fans, &cotangents, point as u32, &mut links);
                    owners.resize(links.len(), point as u32);
                    ends.push(links.len() as u32);
                }
                dispatch(Transport { normals, owners: &owners, links: &mut links });
                links.shrink_to_fit();
                let band = Band { ends, links, keep: Vec::new() };
                let rates = (range.zip(band.by_point())).map(|(point, links)| {
                    let sum: f64 = links.iter().map(|l| f64::from(l.0[0])).sum();
                    if sum > 0.0 { sum / f64::from(areas[point]).max(f64::MIN_POSITIVE) } else { 0.0 }
                });
                let rates = rates.collect();
                (band, rates)
            })
            .collect();

        // The largest of the rates are lowered.
        let mut sorted: Vec<f64> =
            gathered.iter().flat_map(|(_, rates)| rates).copied().filter(|&r| r > 0.0).collect();
        let rate = if sorted.is_empty() {
            0.0
        } else {
            let rank = ((sorted.len() - 1) as f64 * RATE_QUANTILE) as usize;
            *sorted.select_nth_unstable_by(rank, f64::total_cmp).1
        };
        let rate = rate.min(EXPONENT_MAX / time);

        // Y = 1 - L / rate.
        let weigh = |(mut band, rates): (Band, Vec<f64>)| {
            let mut first = 0;
            band.keep.reserve_exact(rates.len());
            for (own, &end) in rates.into_iter().zip(&band.ends) {
                let links = &mut band.links[first..end as usize];
                first = end as usize;
                let total: f64 = links.iter().map(|l| f64::from(l.0[0])).sum();
                let given = if rate > 0.0 { (own / rate).min(1.0) } else { 0.0 };
                let scale = if total > 0.0 { (given / total) as f32 } else { 0.0 };
                for Link([weight, cos, sin, _]) in links.iter_mut() {
                    *weight *= scale;
                    (*cos, *sin) = (*cos * *weight, *sin * *weight);
                }
                band.keep.push(1.0 - links.iter().map(|l| l.0[0]).sum::<f32>());
            }
            band
        };
        Self { bands: gathered.into_par_iter().map(weigh).collect(), rate }
    }

    /// `to = Y from`, and its part of the sum.
    fn step(&self, from: &[Vec4], to: &mut [Vec4], sum: &mut [Vec4], coefficient: f32) {
        self.each(from, to, sum, |average, to, sum| {
            *to = average;
            *sum += coefficient * average;
        });
    }

    /// `over = 2 Y from - over`, and its part of the sum.
    fn step_over(&self, from: &[Vec4], over: &mut [Vec4], sum: &mut [Vec4], coefficient: f32) {
        self.each(from, over, sum, |average, over, sum| {
            *over = 2.0 * average - *over;
            *sum += coefficient * *over;
        });
    }

    /// Hands the average at each point to `f`, beside the point's places in `to` and `sum`.
    fn each(
        &self,
        from: &[Vec4],
        to: &mut [Vec4],
        sum: &mut [Vec4],
        f: impl Fn(Vec4, &mut Vec4, &mut Vec4) + Sync,
    ) {
        let places = to.par_chunks_mut(BAND).zip(sum.par_chunks_mut(BAND)).zip(from.par_chunks(BAND));
        places.zip(&self.bands).for_each(|(((to, sum), own), band)| {
            let places = to.iter_mut().zip(sum).zip(own);
            for (((to, sum), &own), (links, &keep)) in places.zip(band.by_point().zip(&band.keep)) {
                f(average(from, own, links, keep), to, sum);
            }
        });
    }
}

impl Band {
    /// The links of each point.
    fn by_point(&self) -> impl Iterator<Item = &[Link]> {
        let mut first = 0;
        self.ends.iter().map(move |&end| {
            let links = &self.links[first..end as usize];
            first = end as usize;
            links
        })
    }
}

/// The average at a point that holds `own`: traces by weight, deviators turned on the way.
#[inline(always)]
fn average(from: &[Vec4], own: Vec4, links: &[Link], keep: f32) -> Vec4 {
    let (mut along, mut across) = (keep * own, Vec4::ZERO);
    for link in links {
        let (link, other) = (Vec4::from_array(link.0), from[link.point() as usize]);
        along += link.xyyx() * other;
        across += link.zzzz() * other;
    }
    along + across.wzyw() * vec4(0.0, -1.0, 1.0, 0.0)
}

/// Halves of the cotangents at the corners of triangles, and the Voronoi areas of points.
struct Cotangents<'a> {
    surface: &'a Welded,
    scale: f32,
    cotangents: &'a mut [[f32; 3]],
    areas: &'a mut [f32],
}

impl pulp::WithSimd for Cotangents<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { surface, scale, cotangents, areas } = self;
        for (triangles, out) in surface.triangles.chunks(LANES).zip(cotangents.chunks_mut(LANES)) {
            let corners = Corners::gather(&surface.positions, triangles, scale);
            let (halves, parts) = (corners.half_cotangents(), corners.areas());
            for (l, (triangle, out)) in triangles.iter().zip(out).enumerate() {
                if !corners.has_area(l) {
                    continue;
                }
                for c in 0..3 {
                    out[c] = halves[c].0[l];
                    areas[triangle[c] as usize] += parts[c].0[l];
                }
            }
        }
    }
}

/// A point's neighbours: half the sum of cotangents opposite to each edge.
fn gather(surface: &Welded, fans: &Fans, cotangents: &[[f32; 3]], point: u32, links: &mut Vec<Link>) {
    let first = links.len();
    for &triangle in fans.around(point as usize) {
        let (corners, halves) = (surface.triangles[triangle as usize], cotangents[triangle as usize]);
        let Some(at) = corners.iter().position(|&c| c == point) else { continue };
        let (next, last) = ((at + 1) % 3, (at + 2) % 3);
        if corners[next] == corners[last] || corners[next] == point || corners[last] == point {
            continue;
        }
        // Opposite to the edge to one of the others lies the other one.
        for (other, half) in [(corners[next], halves[last]), (corners[last], halves[next])] {
            match links[first..].iter_mut().find(|link| link.point() == other) {
                Some(link) => link.0[0] += half,
                None => links.push(Link([half, 1.0, 0.0, f32::from_bits(other)])),
            }
        }
    }
}

/// How far each link turns, not yet multiplied with its weight; weights of links that cannot be are made zero: negative
/// sums of cotangents, folds of a surface back onto itself, which no shortest arc opens, and points without a normal.
struct Transport<'a> {
    normals: &'a [Vec3],
    /// The point that each link belongs to.
    owners: &'a [u32],
    links: &'a mut [Link],
}

impl pulp::WithSimd for Transport<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for (owners, links) in self.owners.chunks(LANES).zip(self.links.chunks_mut(LANES)) {
            let (mut here, mut there) = (V8::default(), V8::default());
            for (l, (&owner, link)) in owners.iter().zip(&*links).enumerate() {
                let (n, o) = (self.normals[owner as usize], self.normals[link.point() as usize]);
                (here.x.0[l], here.y.0[l], here.z.0[l]) = (n.x, n.y, n.z);
                (there.x.0[l], there.y.0[l], there.z.0[l]) = (o.x, o.y, o.z);
            }
            let tangent = frame_tangents(here);
            let (cos, sin) = turn(there, frame_tangents(there), here, tangent, here.cross(tangent));
            let inverse = (cos * cos + sin * sin).recip();
            let double = [(cos * cos - sin * sin) * inverse, (cos * sin + cos * sin) * inverse];
            let one_plus = F8::splat(1.0) + here.dot(there);
            let lengths = here.dot(here).min_of(there.dot(there));
            for (l, link) in links.iter_mut().enumerate() {
                let fits = link.0[0] > 0.0 && one_plus.0[l] >= 1e-3 && lengths.0[l] > 0.0;
                let numbers = if fits { [link.0[0], double[0].0[l], double[1].0[l]] } else { [0.0; 3] };
                link.0[..3].copy_from_slice(&numbers);
            }
        }
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

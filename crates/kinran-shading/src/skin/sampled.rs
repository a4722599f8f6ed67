//! A tabulated linear profile with its integrals, and the ring of it: what takes time in proportion to a table's
//! rows is done once, and a ring reads differences of integrals in place of densities.
//!
//! ```
//! use kinran_shading::skin::profile::RadialProfile;
//! use kinran_shading::skin::sampled::Sample;
//!
//! let rows = [(0.0, [1.0; 3]), (1.0, [0.5, 0.3, 0.2]), (4.0, [0.0; 3])];
//! let table = RadialProfile::table(&rows).unwrap().to_linear();
//! let mut samples = [Sample::default(); 4096];
//! let fast = table.sampled(&mut samples);
//! assert!((fast.density(0.7)[0] - table.density(0.7)[0]).abs() < 1e-4);
//! ```

use super::profile::{LinearProfile, Shape};
use super::row::{Half, Integrals, Ring};
pub use super::samples::Sample;
use super::samples::cubic;
use libm::{ceil, sqrt};

/// The density of every so many samples is the table's; those between lie on cubics through four such.
const EXACT_EVERY: usize = 4;

/// Longest piece of a ring, in sine less cosine of half the angle. Where the profile's bend and that of the weight, a quarter
/// of its square about angle zero and a tenth where the profile ends as a root on the ring's far side, meet in
/// one piece, it is 4e-6 of what that piece holds.
const PIECE: f64 = 1.0 / 256.0;

impl<'a> LinearProfile<'a> {
    /// Rows of the table it is made of, 0 where its density is closed.
    pub fn rows(&self) -> usize {
        match self.0 {
            Shape::Table(rows) => rows.len(),
            _ => 0,
        }
    }

    /// A copy that is read from `samples`, which this fills: a table's density takes time in proportion to its rows, and
    /// a ring asks hundreds of times. With 4096 samples more than rows, rings are the same to 3e-6. Other profiles come back
    /// as they are, and so does a table of which there are not three rows fewer than samples.
    pub fn sampled(self, samples: &'a mut [Sample]) -> LinearProfile<'a> {
        let Shape::Table(rows) = self.0 else { return self };
        let reach = rows[rows.len() - 1].0;
        let Some(spare) = samples.len().checked_sub(rows.len() + 2).filter(|&spare| spare > 0) else {
            return self;
        };

        // From row to row, in parts that are even over the root of the distance: the profile's peak is in its middle.
        samples[0] = Sample { density: self.density(0.0), ..Sample::default() };
        let mut filled = 0;
        for &(distance, _) in rows.iter().filter(|row| row.0 > 0.0) {
            let before = samples[filled].distance;
            let parts = ((sqrt(distance / reach) - sqrt(before / reach)) * spare as f64) as usize;
            let parts =
                if parts < 3 * EXACT_EVERY { parts.max(1) } else { parts / EXACT_EVERY * EXACT_EVERY };
            self.sample_between(distance, &mut samples[filled..=filled + parts]);
            filled += parts;
        }

        let samples = &mut samples[..=filled];
        for i in 0..filled {
            let next = samples[i + 1];
            (samples[i + 1].mass, samples[i + 1].moment) = samples[i].integrals(&next, next.distance);
        }
        LinearProfile(Shape::Sampled(samples))
    }

    /// Densities after a row of the table, the first sample, up to the next row at the distance `to`. Below a row the density
    /// may be a root, or the third power of one: distances that grow dense towards it as a square make it a polynomial.
    fn sample_between(&self, to: f64, samples: &mut [Sample]) {
        let (from, parts) = (samples[0].distance, samples.len() - 1);
        let exact_every = if parts < 3 * EXACT_EVERY { 1 } else { EXACT_EVERY };
        for (i, sample) in samples.iter_mut().enumerate().skip(1) {
            let t = i as f64 / parts as f64;
            sample.distance = if i == parts { to } else { from + (to - from) * t * (2.0 - t) };
            if i % exact_every == 0 {
                sample.density = self.density(sample.distance);
            }
        }
        for i in (1..parts).filter(|i| i % exact_every != 0) {
            let first = (i / EXACT_EVERY).saturating_sub(1).min(parts / EXACT_EVERY - 3);
            let weights = cubic(i as f64 / EXACT_EVERY as f64 - first as f64);
            let corners: [_; 4] =
                core::array::from_fn(|corner| samples[EXACT_EVERY * (first + corner)].density);
            samples[i].density =
                core::array::from_fn(|c| weights.iter().zip(&corners).map(|(w, corner)| w * corner[c]).sum());
        }
    }
}

/// The ring of a sampled profile, for a radius `r` in millimetres.
///
/// Along the chord x = 2 r s, where s is the sine of half the angle, `∫ R sin θ dθ` is the moment over r² exactly. The weight
/// of `∫ R cos θ dθ` depends on s alone: on each piece it is a straight line with the weight's own mean and its slope in the
/// middle, under which the profile's mass and moment are all that is needed. The same holds for `∫ R dθ`.
pub(super) struct SampledRing<'a> {
    samples: &'a [Sample],
    r: f64,
    /// Sine and cosine of half the angle.
    half: (f64, f64),
    /// The sample that the chord has passed.
    passed: usize,
    /// The density over the chord, and times the chord.
    mass: [f64; 3],
    moment: [f64; 3],
    /// The density over the angle, and times its cosine.
    one: [f64; 3],
    cos: [f64; 3],
}

impl Ring for SampledRing<'_> {
    fn advance(&mut self, sine: f64, half: Half) -> f64 {
        let cos = sqrt(1.0 - sine * sine);
        // Of half the angle, the smaller of sine and cosine from the product: near zero no digits are lost.
        let large = sqrt(0.5 * (1.0 + cos));
        let small = 0.5 * sine / large;
        self.go_on(match half {
            Half::Near => (small, large),
            Half::Far => (large, small),
        });
        cos
    }

    fn integrals(&self) -> Integrals {
        let square = self.r * self.r;
        Integrals { one: self.one, cos: self.cos, sin: self.moment.map(|moment| moment / square) }
    }
}

impl<'a> SampledRing<'a> {
    pub(super) fn new(samples: &'a [Sample], r: f64) -> Self {
        debug_assert!(samples.is_sorted_by(|a, b| a.distance < b.distance), "distances grow");
        debug_assert!(r > 0.0, "a radius of {r}");
        let nothing = [0.0; 3];
        let (mass, moment, one, cos) = (nothing, nothing, nothing, nothing);
        SampledRing { samples, r, half: (0.0, 1.0), passed: 0, mass, moment, one, cos }
    }

    /// Goes on to the angle whose half has this sine and cosine.
    fn go_on(&mut self, to: (f64, f64)) {
        let end = {
            let sine = 0.5 * self.samples[self.samples.len() - 1].distance / self.r;
            if to.0 < sine { to } else { (sine, sqrt(1.0 - sine * sine)) }
        };
        if self.half.0 < end.0 {
            let (start, stop) = (self.half.0 - self.half.1, end.0 - end.1);
            let pieces = ceil((stop - start) / PIECE);
            for piece in 1..pieces as usize {
                let difference = start + (stop - start) * piece as f64 / pieces;
                // The larger of the two from the difference, the other from the product.
                let (product, large) = (
                    0.5 * (1.0 - difference * difference),
                    0.5 * (sqrt(2.0 - difference * difference) + difference.abs()),
                );
                let small = product / large;
                self.piece(if difference < 0.0 { (small, large) } else { (large, small) });
            }
            self.piece(end);
        }
        self.half = to;
    }

    /// Finds the last sample but the very last before a distance, in steps that double from where the last one was.
    fn pass(&mut self, distance: f64) {
        let until = self.samples.len() - 2;
        let mut step = 1;
        while self.passed + step <= until && self.samples[self.passed + step].distance <= distance {
            self.passed += step;
            step *= 2;
        }
        let rest = &self.samples[self.passed + 1..=until.min(self.passed + step)];
        self.passed += rest.partition_point(|sample| sample.distance <= distance);
    }

    fn piece(&mut self, to: (f64, f64)) {
        let distance = 2.0 * self.r * to.0;
        self.pass(distance);
        let (mass, moment) = self.samples[self.passed].integrals(&self.samples[self.passed + 1], distance);

        let ((sin_a, cos_a), (sin_b, cos_b)) = (self.half, to);
        // Twice the arc sine of a number below a hundredth.
        let half = sin_b * cos_a - sin_a * cos_b;
        let angle = 2.0 * half * (1.0 + half * half * (1.0 / 6.0 + half * half * (3.0 / 40.0)));
        let sine = 2.0 * (sin_b * cos_b - sin_a * cos_a);
        let (middle, chord) = (0.5 * (sin_a + sin_b), 2.0 * self.r * (sin_b - sin_a));
        // Over the chord 2 r s, dθ is 1 / (r sqrt(1 - s²)) and cos θ dθ is (1 - 2 s²) of it; these are their slopes.
        let rest = 1.0 - middle * middle;
        let slope = middle / (2.0 * self.r * self.r * rest * sqrt(rest));
        let cos_slope = slope * (2.0 * middle * middle - 3.0);
        for c in [0, 1, 2] {
            let dm = mass[c] - self.mass[c];
            let tilt = moment[c] - self.moment[c] - 2.0 * self.r * middle * dm;
            self.one[c] += dm * angle / chord + tilt * slope;
            self.cos[c] += dm * sine / chord + tilt * cos_slope;
        }
        (self.mass, self.moment, self.half) = (mass, moment, to);
    }
}

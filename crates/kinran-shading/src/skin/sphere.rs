//! Ambient light: spherical harmonics of radiance blurred over a sphere (slide: Skin Shading, "radial profile with
//! spherical integration").
//!
//! On a sphere of radius r the area between two chords is the planar one, `dA = 2π c dc`, and `cos θ = 1 - c² / 2r²`. A
//! blur that depends on the angle alone multiplies band l of the harmonics by the mean of the Legendre polynomial
//! P_l(cos θ) under the profile (Funk–Hecke). Band 0 keeps its light.
//!
//! ```
//! use kinran_shading::skin::profile::RadialProfile;
//!
//! // On a small sphere light from all around is blurred, detail before direction.
//! let factors = RadialProfile::skin().band_factors(0.5);
//! assert!(factors.h_two[0] < factors.h_one[0] && factors.h_one[0] < 1.0);
//! ```

use super::profile::{RadialProfile, Shape};
use libm::{exp, expm1};

/// What a profile does to bands 1 and 2 on a sphere, RGB each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandFactors {
    /// Of band 1, 0 to 1.
    pub h_one: [f64; 3],
    /// Of band 2, 0 to 1.
    pub h_two: [f64; 3],
}

impl RadialProfile<'_> {
    /// The factors on a sphere of `curvature` (1/mm, below zero counts as zero): its mean curvature at a point of skin.
    ///
    /// Gaussians have closed forms: kernels of von Mises and Fisher with `κ = r²/v`, whose mean cosine is
    /// `coth κ - 1/κ`. So have Burley's profile and tables: truncated moments of exponentials and of polynomials.
    pub fn band_factors(&self, curvature: f64) -> BandFactors {
        if curvature <= 1e-6 {
            return BandFactors { h_one: [1.0; 3], h_two: [1.0; 3] };
        }
        let r = curvature.recip();
        let mut factors = BandFactors { h_one: [0.0; 3], h_two: [0.0; 3] };
        match self.0 {
            Shape::Gaussians(sum) => {
                let mut mass = [0.0; 3];
                for g in sum {
                    let kappa = r * r / g.variance;
                    let (one, two) = mean_legendre(kappa);
                    let inside = -expm1(-2.0 * kappa);
                    for c in [0, 1, 2] {
                        let m = g.weight[c] * inside;
                        mass[c] += m;
                        factors.h_one[c] += m * one;
                        factors.h_two[c] += m * two;
                    }
                }
                for c in [0, 1, 2] {
                    factors.h_one[c] /= mass[c];
                    factors.h_two[c] /= mass[c];
                }
            }
            Shape::Burley(d) => {
                for c in [0, 1, 2] {
                    // The mass within a chord has density (exp(-c/d) + exp(-c/3d)) / 4d.
                    let (near, far) = (d[c], 3.0 * d[c]);
                    let moment =
                        |n| exponential_moment(n, near, 2.0 * r) + 3.0 * exponential_moment(n, far, 2.0 * r);
                    let (h_one, h_two) = from_moments(r, moment(0), moment(2), moment(4));
                    (factors.h_one[c], factors.h_two[c]) = (h_one, h_two);
                }
            }
            Shape::Sampled(_) => {}
            Shape::Table(rows) => {
                // c^k / k for k from 2 to 7: antiderivatives of (a + b c) c^(n+1) for n = 0, 2, 4.
                let powers = |c: f64| {
                    let mut power = c;
                    core::array::from_fn::<_, 6, _>(|i| {
                        power *= c;
                        power / (i + 2) as f64
                    })
                };
                let mut moments = [[0.0; 3]; 3];
                let (mut before, mut below) = ((0.0, rows[0].1), [0.0; 6]);
                for &row in rows.iter().filter(|row| row.0 > 0.0) {
                    if before.0 >= 2.0 * r {
                        break;
                    }
                    let above = powers(row.0.min(2.0 * r));
                    for (c, moments) in moments.iter_mut().enumerate() {
                        let slope = (row.1[c] - before.1[c]) / (row.0 - before.0);
                        let constant = before.1[c] - slope * before.0;
                        for (n, moment) in moments.iter_mut().enumerate() {
                            *moment += constant * (above[2 * n] - below[2 * n])
                                + slope * (above[2 * n + 1] - below[2 * n + 1]);
                        }
                    }
                    (before, below) = (row, above);
                }
                for c in [0, 1, 2] {
                    let [zero, second, fourth] = moments[c];
                    (factors.h_one[c], factors.h_two[c]) = from_moments(r, zero, second, fourth);
                }
            }
        }
        factors
    }
}

/// Means of P1 and P2 of the cosine under von Mises and Fisher's distribution.
fn mean_legendre(kappa: f64) -> (f64, f64) {
    if kappa < 0.05 {
        // coth κ - 1/κ and what follows from it cancel here; the next terms are κ^5 and κ^6.
        let k2 = kappa * kappa;
        return (kappa / 3.0 * (1.0 - k2 / 15.0), k2 / 15.0 * (1.0 - 2.0 * k2 / 21.0));
    }
    let e = exp(-2.0 * kappa);
    let one = (1.0 + e) / (1.0 - e) - kappa.recip();
    (one, 1.0 - 3.0 * one / kappa)
}

/// `∫ c^n exp(-c/d) / d dc` from 0 to `end`, by parts.
fn exponential_moment(n: u32, d: f64, end: f64) -> f64 {
    if end < d {
        // By parts all digits cancel where the end is near; the power series has no such trouble.
        let x = end / d;
        let (mut sum, mut term) = (0.0, libm::pow(end, f64::from(n)) * x);
        for k in 0..30u32 {
            sum += term / f64::from(n + k + 1);
            term *= -x / f64::from(k + 1);
        }
        return sum;
    }
    let edge = exp(-end / d);
    let (mut moment, mut power) = (-expm1(-end / d), 1.0);
    for k in 1..=n {
        power *= end;
        moment = f64::from(k) * d * moment - power * edge;
    }
    moment
}

/// Means of P1 and P2 of `1 - c² / 2r²` from the moments of the chord's mass.
fn from_moments(r: f64, m0: f64, m2: f64, m4: f64) -> (f64, f64) {
    if m0 <= 0.0 {
        return (1.0, 1.0);
    }
    let (second, fourth) = (m2 / m0 / (2.0 * r * r), m4 / m0 / (4.0 * r * r * r * r));
    let one = 1.0 - second;
    (one, 1.5 * (1.0 - 2.0 * second + fourth) - 0.5)
}

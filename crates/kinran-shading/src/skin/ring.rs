//! Punctual light: the clamped cosine blurred around a cylinder (slide: Skin Shading | Curvature).
//!
//! `D(r, cos θ_l) = ∫ max(0, cos(θ_l - θ)) R(2 r sin(θ/2)) dθ / ∫ R(2 r sin(θ/2)) dθ`; the slide leaves the clamp
//! out, without which D is a multiple of the cosine. R is the linear profile and its argument the chord: on a cylinder
//! chord² plus the squared distance along the axis is the squared straight distance, so this is the exact integral
//! of the radial profile over the cylinder.
//!
//! With p the normalised density of the angle and s = sin θ_l the integral is `cos θ_l A + sin θ_l B`, where A and B
//! are those of `p cos` and `p sin` over the half circle that the light sees.
//!
//! ```
//! use kinran_shading::skin::profile::RadialProfile;
//! use kinran_shading::skin::ring::column_n_u;
//!
//! // Where nothing bends, light falls as the clamped cosine.
//! let mut row = [[0.0; 3]; 8];
//! RadialProfile::skin().to_linear().ring_row(0.0, &mut row);
//! assert_eq!(row[6], [column_n_u(6, 8); 3]);
//! ```

use super::bessel::{scaled_i0, scaled_i1};
use super::profile::{Gaussian, LinearProfile, Shape};
pub use super::row::column_n_u;
use super::row::{Half, Integrals, Ring, walk};
use super::sampled::SampledRing;
use core::f64::consts::PI;
use libm::{asin, cos, exp, sin, sqrt};

/// Nodes and weights of the Gauss–Legendre rule of four points on [-1, 1].
const GAUSS_LEGENDRE: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// The rule of two points, for pieces so short that its error, a 4320th of their length to the fifth times the fourth
/// derivative, is below 1e-8 of their mass.
const GAUSS_LEGENDRE_SHORT: [(f64, f64); 2] =
    [(-0.577_350_269_189_625_8, 1.0), (0.577_350_269_189_625_8, 1.0)];

/// Up to which angle the ring is integrated over the sine of half of it, radians.
const SINE_UNTIL: f64 = 2.0 * PI / 3.0;

/// Below this curvature (1/mm; a radius of a kilometre) a surface is flat.
const FLAT: f64 = 1e-6;

impl LinearProfile<'_> {
    /// Fills a row of the table of punctual light: at [`column_n_u`] of each entry, what part of the light's
    /// irradiance at normal incidence leaves again, RGB, on a cylinder of `curvature` (1/mm, below zero counts as zero)
    /// lit across its axis; 1e-6 absolute, 3e-6 where the profile is sampled. A table with steps that is not sampled is off by
    /// 5e-5 at radii where the ring's far side meets one.
    pub fn ring_row(&self, curvature: f64, row: &mut [[f64; 3]]) {
        let columns = row.len();
        if curvature <= FLAT {
            for (i, d) in row.iter_mut().enumerate() {
                *d = [column_n_u(i, columns).max(0.0); 3];
            }
            return;
        }
        row.fill([0.0; 3]);
        match self.0 {
            Shape::Gaussians(sum) => gaussian_row(sum, curvature.recip(), row),
            Shape::Sampled(samples) => walk(&mut SampledRing::new(samples, curvature.recip()), row),
            Shape::Burley(_) | Shape::Table(_) => {
                walk(&mut QuadratureRing::new(self, curvature.recip()), row)
            }
        }
    }
}

/// The ring of any density, by quadrature.
struct QuadratureRing<'a, 'b> {
    profile: &'a LinearProfile<'b>,
    r: f64,
    at: f64,
    integrals: Integrals,
}

impl Ring for QuadratureRing<'_, '_> {
    fn advance(&mut self, sine: f64, half: Half) -> f64 {
        let angle = asin(sine);
        self.go_on(match half {
            Half::Near => angle,
            Half::Far => PI - angle,
        });
        cos(angle)
    }

    fn integrals(&self) -> Integrals {
        self.integrals
    }
}

impl<'a, 'b> QuadratureRing<'a, 'b> {
    fn new(profile: &'a LinearProfile<'b>, r: f64) -> Self {
        QuadratureRing { profile, r, at: 0.0, integrals: Integrals::default() }
    }

    /// Goes on to an angle in radians.
    fn go_on(&mut self, to: f64) {
        let shortest = self.profile.shortest() / self.r;
        let end = {
            // Chords beyond the reach, the whole circle where the reach goes round it.
            let half = 0.5 * self.profile.reach() / self.r;
            if half >= 1.0 { PI } else { 2.0 * asin(half) }
        };
        // What is left out at the pole of Burley's density: 1e-9 ln 1e9 of its mass.
        if self.at == 0.0 {
            self.at = (1e-9 * shortest.min(PI)).min(to);
        }
        // Pieces double in length away from the pole and stay within what four points resolve.
        while self.at < to && self.at < end {
            let next = to.min(2.0 * self.at).min(self.at + shortest.min(0.1));
            if next - self.at < 0.125 * shortest.min(0.1).min(self.at) {
                self.piece(self.at, next, &GAUSS_LEGENDRE_SHORT);
            } else {
                self.piece(self.at, next, &GAUSS_LEGENDRE);
            }
            self.at = next;
        }
        self.at = self.at.max(to);
    }

    /// Adds what lies between two angles. Up to 120° over the sine of half the angle, half the chord over the radius, whose
    /// nodes need no trigonometry; beyond, where that sine hardly changes any more, over the angle.
    fn piece(&mut self, a: f64, b: f64, rule: &[(f64, f64)]) {
        if b > SINE_UNTIL {
            let (half, middle) = (0.5 * (b - a), 0.5 * (a + b));
            for (node, weight) in rule {
                self.add(sin(0.5 * (middle + half * node)), half * weight);
            }
            return;
        }
        let (from, to) = (sin(0.5 * a), sin(0.5 * b));
        let (half, middle) = (0.5 * (to - from), 0.5 * (to + from));
        for (node, weight) in rule {
            let s = middle + half * node;
            // dθ = 2 ds / cos(θ/2).
            self.add(s, 2.0 * half * weight / sqrt(1.0 - s * s));
        }
    }

    /// Adds the density over `angle` radians about the angle whose half has the sine `s`.
    fn add(&mut self, s: f64, angle: f64) {
        let density = self.profile.density(2.0 * self.r * s);
        let (sin, cos) = (2.0 * s * sqrt(1.0 - s * s), 1.0 - 2.0 * s * s);
        for (c, density) in density.into_iter().enumerate() {
            let mass = angle * density;
            self.integrals.one[c] += mass;
            self.integrals.cos[c] += mass * cos;
            self.integrals.sin[c] += mass * sin;
        }
    }
}

/// The sum of von Mises kernels that Gaussians of the chord are, for `κ = r²/v`.
///
/// `B = sinh(κ s) / (π κ I0)` and `A = I1 / 2 I0 + ∫ cosh(κ sqrt(1 - x²)) dx / (π I0)` from 0 to n·u: the sine that the
/// change of variable brings is the one that the derivative of A has. The integrand is smooth, so Simpson's rule on
/// the grid of the columns does.
fn gaussian_row(sum: &[Gaussian], r: f64, row: &mut [[f64; 3]]) {
    let columns = row.len();
    let mut mass = [0.0; 3];
    for g in sum {
        let kappa = r * r / g.variance;
        let (i0, i1) = (scaled_i0(kappa), scaled_i1(kappa));
        let rho = i1 / i0;
        let share = g.weight.map(|w| w * i0 / sqrt(g.variance));
        for c in [0, 1, 2] {
            mass[c] += share[c];
        }

        // exp(-κ) cosh(κ s) and exp(-κ) sinh(κ s), doubled; both from one exponential.
        let both = exp(-2.0 * kappa);
        let doubled = |s: f64| {
            let grown = exp(-kappa * (1.0 - s));
            let other = if both > 0.0 { both / grown } else { 0.0 };
            (grown + other, grown - other)
        };
        let norm = 0.5 / (PI * i0);

        // Panels of Simpson's rule that resolve a width of 1 / sqrt(κ).
        let step = 2.0 / columns as f64;
        let panels = libm::ceil(2.0 * step * sqrt(kappa)).max(1.0);
        // Beyond, the integrand is below 1e-17 of its height.
        let end = if kappa > 40.0 { sqrt(1.0 - (1.0 - 40.0 / kappa) * (1.0 - 40.0 / kappa)) } else { 1.0 };
        let (mut at, mut integral) = (0.0, 0.0);
        let (mut cosh_at, mut sinh_at) = doubled(1.0);
        for i in columns / 2..columns {
            let x = column_n_u(i, columns).max(0.0);
            let s = sqrt(1.0 - x * x);
            if at < end {
                let width = (x - at) / panels;
                for panel in 1..=panels as usize {
                    let b = if panel == panels as usize { x } else { at + width };
                    let middle = 0.5 * (at + b);
                    let before = cosh_at;
                    (cosh_at, sinh_at) = doubled(sqrt(1.0 - b * b));
                    let (cosh_middle, _) = doubled(sqrt(1.0 - middle * middle));
                    integral += (b - at) / 6.0 * (before + 4.0 * cosh_middle + cosh_at);
                    at = b;
                }
            } else {
                sinh_at = 0.0;
            }
            // The hyperbolic sine over a small κ keeps no digits.
            let sinh_over_kappa = if kappa < 1e-4 { 2.0 * s } else { sinh_at / kappa };
            let d = x * (0.5 * rho + norm * integral) + s * norm * sinh_over_kappa;
            for c in [0, 1, 2] {
                row[i][c] += share[c] * d;
            }
            if columns - 1 - i != i {
                for c in [0, 1, 2] {
                    row[columns - 1 - i][c] += share[c] * (d - x * rho);
                }
            }
        }
    }
    for d in row {
        for c in [0, 1, 2] {
            // Rounding can leave -1e-17 in the dark.
            d[c] = (d[c] / mass[c]).max(0.0);
        }
    }
}

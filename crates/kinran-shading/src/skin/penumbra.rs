//! Light that scatters from a lit place into a shadow's penumbra.
//!
//! Penner, Borshukov. Pre-Integrated Skin Shading. GPU Pro 2, 2011, section 1.5 (Shadow Scattering).
//!
//! A filtered shadow says how much of the light passes, 0 to 1, and so where in the penumbra a point lies. The shadow
//! is drawn again, half as wide and in the lit half of that penumbra, and blurred by the linear profile, for a
//! shadow's edge is a line; what leaks past its new edge has the dark half to show in. The filter is taken to be a box,
//! under which light grows along a straight line.
//!
//! ```
//! use kinran_shading::skin::profile::RadialProfile;
//!
//! let [red, _, blue] = RadialProfile::skin().to_linear().penumbra(0.3, 4.0);
//! assert!(red > blue, "light that leaks into a shadow is red");
//! ```

use super::profile::{LinearProfile, Shape};
use core::f64::consts::PI;
use libm::{erf, exp, sqrt};

impl LinearProfile<'_> {
    /// What part of the light a point gets, RGB: `shadow` is the filtered shadow, 0 dark to 1 lit, `width` that of the
    /// penumbra across the skin in millimetres; 1e-6 absolute. At width 0 the shadow is returned as it is.
    pub fn penumbra(&self, shadow: f64, width: f64) -> [f64; 3] {
        if width <= 1e-6 {
            return [shadow; 3];
        }
        let at = shadow * width;
        match self.0 {
            // The ramp is a difference of two clamped lines, whose blur by a Gaussian is closed.
            Shape::Gaussians(sum) => {
                let (mut light, mut mass) = ([0.0; 3], [0.0; 3]);
                for g in sum {
                    let sigma = sqrt(g.variance);
                    let rise = blurred_line(at - 0.5 * width, sigma) - blurred_line(at - width, sigma);
                    for c in [0, 1, 2] {
                        light[c] += g.weight[c] * rise * 2.0 / width;
                        mass[c] += g.weight[c];
                    }
                }
                core::array::from_fn(|c| light[c] / mass[c])
            }
            Shape::Burley(d) => d.map(|d| burley_penumbra(at, width, d)),
            _ => self.penumbra_by_quadrature(at, width),
        }
    }

    pub(crate) fn penumbra_by_quadrature(&self, at: f64, width: f64) -> [f64; 3] {
        // Both sides of the line together, in pieces that grow away from a pole; a midpoint rule of nine points.
        let ramp = |x: f64| (2.0 * x / width - 1.0).clamp(0.0, 1.0);
        let (shortest, reach) = (self.shortest().min(width), self.reach());
        let (mut light, mut mass) = ([0.0; 3], [0.0; 3]);
        let mut a = 1e-9 * shortest;
        while a < reach {
            let b = (1.5 * a).min(a + 0.25 * shortest).min(reach);
            for i in 0..9 {
                let x = a + (b - a) * (f64::from(i) + 0.5) / 9.0;
                let density = self.density(x);
                let lit = ramp(at - x) + ramp(at + x);
                for c in [0, 1, 2] {
                    light[c] += (b - a) * density[c] * lit;
                    mass[c] += (b - a) * density[c] * 2.0;
                }
            }
            a = b;
        }
        core::array::from_fn(|c| light[c] / mass[c])
    }
}

/// Light in a penumbra for one length of Burley's profile, as a mixture of Gaussians: `exp(-r/d) / (2 π d r)` is the mean of those
/// of variance `2 t d²` by the density `exp(-t) / sqrt(π t)` of t. The trapezoid rule over ln t, whose error is e^-19 at this
/// step, from where Gaussians are too narrow to blur anything up to where their weight is below 1e-12.
fn burley_penumbra(at: f64, width: f64, d: f64) -> f64 {
    const STEP: f64 = 0.5;
    let mut light = 0.0;
    // A quarter of the light leaves by the shorter length, the rest by one three times as long.
    for (share, length) in [(0.25, d), (0.75, 3.0 * d)] {
        let mut blurred = 0.0;
        for i in -24..=6 {
            let t = exp(STEP * f64::from(i));
            let weight = STEP * sqrt(t / PI) * exp(-t);
            let sigma = length * sqrt(2.0 * t);
            let rise = blurred_line(at - 0.5 * width, sigma) - blurred_line(at - width, sigma);
            light += share * weight * rise * 2.0 / width;
            blurred += weight;
        }
        light += share * (1.0 - blurred) * (2.0 * at / width - 1.0).clamp(0.0, 1.0);
    }
    light
}

/// `∫ max(0, z + t) g(t) dt` for a Gaussian g of deviation `sigma`.
fn blurred_line(z: f64, sigma: f64) -> f64 {
    let u = z / sigma;
    0.5 * z * (1.0 + erf(u * core::f64::consts::FRAC_1_SQRT_2)) + sigma * exp(-0.5 * u * u) / sqrt(2.0 * PI)
}

#[cfg(test)]
mod tests {
    use crate::skin::profile::RadialProfile;

    #[test]
    fn the_mixture_for_burley_meets_quadrature() {
        let linear = RadialProfile::burley([0.9, 0.4, 0.1]).unwrap().to_linear();
        for width in [1.0, 4.0, 20.0] {
            for shadow in [0.0, 0.1, 0.45, 0.5, 0.55, 0.8, 1.0] {
                let (want, got) =
                    (linear.penumbra_by_quadrature(shadow * width, width), linear.penumbra(shadow, width));
                for c in 0..3 {
                    assert!(
                        (want[c] - got[c]).abs() < 1e-5,
                        "width {width}, shadow {shadow}: wanted {want:?}, got {got:?}"
                    );
                }
            }
        }
    }
}

//! Diffusion profiles: where light that enters skin at one point leaves it.
//!
//! - d'Eon, Luebke. Advanced Techniques for Realistic Real-Time Skin Rendering. GPU Gems 3, 2007, chapter 14.
//! - Jimenez, Gutierrez. Screen-Space Subsurface Scattering. GPU Pro, 2010.
//! - Burley. Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering. SIGGRAPH 2015.
//! - Christensen, Burley. Approximate Reflectance Profiles for Efficient Subsurface Scattering. Pixar technical
//!   memo 15-04, 2015.
//!
//! Profiles are normalised where they are used, so a colour of their own has no effect: what remains is how far
//! red, green and blue spread.
//!
//! ```
//! use kinran_shading::skin::profile::{ProfileError, RadialProfile};
//!
//! let [red, green, _] = RadialProfile::skin().density(2.0);
//! assert!(red > 10.0 * green, "two millimetres away red light leaves");
//! assert_eq!(RadialProfile::burley([1.0, 0.0, 1.0]), Err(ProfileError::OutOfRange));
//! ```

use super::bessel::k0;
use super::samples::{self, Sample};
use core::f64::consts::PI;
use libm::{exp, log, pow, sqrt};

/// One Gaussian of a sum, RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Square millimetres, along one axis; the same in the radial and in the linear form.
    pub variance: f64,
    /// Share of the light, RGB.
    pub weight: [f64; 3],
}

/// Skin as a sum of six Gaussians (d'Eon 2007, section 14.4.1, the fit to Jensen's three-layer measurements; Jimenez 2010
/// uses the same). Weights of each channel sum to one.
pub const SKIN: [Gaussian; 6] = [
    Gaussian { variance: 0.0064, weight: [0.233, 0.455, 0.649] },
    Gaussian { variance: 0.0484, weight: [0.100, 0.336, 0.344] },
    Gaussian { variance: 0.187, weight: [0.118, 0.198, 0.000] },
    Gaussian { variance: 0.567, weight: [0.113, 0.007, 0.007] },
    Gaussian { variance: 1.99, weight: [0.358, 0.004, 0.000] },
    Gaussian { variance: 7.41, weight: [0.078, 0.000, 0.000] },
];

/// Why a profile cannot be one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProfileError {
    /// There is nothing in it.
    Empty,
    /// A number is not finite, a length or a variance is not above zero, a weight is below it, or all weights of
    /// a channel are zero.
    OutOfRange,
    /// Distances of a table do not grow.
    Unsorted,
}

impl core::fmt::Display for ProfileError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            ProfileError::Empty => "a diffusion profile needs at least one Gaussian, or two rows of a table",
            ProfileError::OutOfRange => {
                "a diffusion profile needs finite numbers, lengths and variances above zero, and for each of red, \
                 green and blue no weight below zero and one above it"
            }
            ProfileError::Unsorted => "distances in a diffusion profile's table must grow from row to row",
        })
    }
}

impl core::error::Error for ProfileError {}

/// What both forms are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape<'a> {
    Gaussians(&'a [Gaussian]),
    Burley([f64; 3]),
    Table(&'a [(f64, [f64; 3])]),
    /// Of a linear profile alone.
    Sampled(&'a [Sample]),
}

/// A profile per square millimetre against the distance from the point where light enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadialProfile<'a>(pub(crate) Shape<'a>);

/// A profile per millimetre against the distance from the line along which light enters: the radial one
/// integrated along that line. It is made from a radial one only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearProfile<'a>(pub(crate) Shape<'a>);

fn positive(x: f64) -> bool {
    x.is_finite() && x > 0.0
}

fn each(f: impl Fn(usize) -> f64) -> [f64; 3] {
    core::array::from_fn(f)
}

impl<'a> RadialProfile<'a> {
    /// A sum of two-dimensional Gaussians.
    ///
    /// # Errors
    /// [`ProfileError`] where the numbers are no profile.
    pub fn gaussians(sum: &'a [Gaussian]) -> Result<Self, ProfileError> {
        if sum.is_empty() {
            return Err(ProfileError::Empty);
        }
        let fine = |g: &Gaussian| positive(g.variance) && g.weight.iter().all(|&w| w.is_finite() && w >= 0.0);
        let lit = (0..3).all(|c| sum.iter().any(|g| g.weight[c] > 0.0));
        if sum.iter().all(fine) && lit {
            Ok(Self(Shape::Gaussians(sum)))
        } else {
            Err(ProfileError::OutOfRange)
        }
    }

    /// The six Gaussians of human skin, [`SKIN`].
    pub fn skin() -> RadialProfile<'static> {
        RadialProfile(Shape::Gaussians(&SKIN))
    }

    /// Burley's normalised diffusion, `R(r) = (exp(-r/d) + exp(-r/3d)) / (8 π d r)` (Burley 2015, eq. 2), for `d` in
    /// millimetres of each channel.
    ///
    /// # Errors
    /// [`ProfileError::OutOfRange`] where a length is not above zero.
    pub fn burley(d: [f64; 3]) -> Result<RadialProfile<'static>, ProfileError> {
        if d.iter().all(|&d| positive(d)) {
            Ok(RadialProfile(Shape::Burley(d)))
        } else {
            Err(ProfileError::OutOfRange)
        }
    }

    /// Burley's normalised diffusion for skin of a mean free path in millimetres and a diffuse albedo, each by
    /// channel: `d = path / s`, `s = 1.9 - A + 3.5 (A - 0.8)²` (Christensen 2015, eq. 6: light that enters
    /// diffusely; albedo is the reflectance one sees, not that of a single scattering).
    ///
    /// # Errors
    /// [`ProfileError::OutOfRange`] where a path is not above zero or an albedo is outside 0 to 1.
    pub fn from_mean_free_path(
        path: [f64; 3],
        albedo: [f64; 3],
    ) -> Result<RadialProfile<'static>, ProfileError> {
        if !albedo.iter().all(|a| (0.0..=1.0).contains(a)) {
            return Err(ProfileError::OutOfRange);
        }
        let s = |a: f64| 1.9 - a + 3.5 * pow(a - 0.8, 2.0);
        Self::burley(each(|c| path[c] / s(albedo[c])))
    }

    /// Rows of distance in millimetres and density, RGB; straight lines between them, nothing beyond the last. Where
    /// the first distance is above zero, the density is constant below it.
    ///
    /// # Errors
    /// [`ProfileError`] where the numbers are no profile.
    pub fn table(rows: &'a [(f64, [f64; 3])]) -> Result<Self, ProfileError> {
        if rows.len() < 2 {
            return Err(ProfileError::Empty);
        }
        if !rows.windows(2).all(|pair| pair[0].0 < pair[1].0) {
            return Err(ProfileError::Unsorted);
        }
        let fine = |(r, density): &(f64, [f64; 3])| {
            r.is_finite() && *r >= 0.0 && density.iter().all(|&x| x.is_finite() && x >= 0.0)
        };
        let lit = (0..3).all(|c| rows.iter().any(|(_, density)| density[c] > 0.0));
        if rows.iter().all(fine) && lit {
            Ok(Self(Shape::Table(rows)))
        } else {
            Err(ProfileError::OutOfRange)
        }
    }

    /// d of each channel in millimetres, where the profile is Burley's: all such profiles are one, stretched.
    pub fn burley_lengths(&self) -> Option<[f64; 3]> {
        match self.0 {
            Shape::Burley(d) => Some(d),
            _ => None,
        }
    }

    /// The same profile against the distance from a line.
    pub fn to_linear(self) -> LinearProfile<'a> {
        LinearProfile(self.0)
    }

    /// Density per square millimetre at a distance `r` ≥ 0 in millimetres; infinite at zero for Burley's.
    pub fn density(&self, r: f64) -> [f64; 3] {
        match self.0 {
            Shape::Gaussians(sum) => {
                let mut density = [0.0; 3];
                for g in sum {
                    let value = exp(-r * r / (2.0 * g.variance)) / (2.0 * PI * g.variance);
                    for (d, w) in density.iter_mut().zip(g.weight) {
                        *d += w * value;
                    }
                }
                density
            }
            Shape::Burley(d) => each(|c| (exp(-r / d[c]) + exp(-r / (3.0 * d[c]))) / (8.0 * PI * d[c] * r)),
            Shape::Table(rows) => {
                let next = rows.partition_point(|row| row.0 < r);
                match (next.checked_sub(1).map(|i| rows[i]), rows.get(next)) {
                    (None, Some(first)) => first.1,
                    (Some(a), Some(b)) => {
                        let t = (r - a.0) / (b.0 - a.0);
                        each(|c| a.1[c] + t * (b.1[c] - a.1[c]))
                    }
                    (_, None) => [0.0; 3],
                }
            }
            // `sampled` makes linear profiles only.
            Shape::Sampled(_) => [0.0; 3],
        }
    }
}

impl<'a> LinearProfile<'a> {
    /// Density per millimetre at a distance `x` ≥ 0 in millimetres; infinite at zero for Burley's, whose closed
    /// form is `(K0(x/d) + K0(x/3d)) / (4 π d)`.
    pub fn density(&self, x: f64) -> [f64; 3] {
        match self.0 {
            Shape::Gaussians(sum) => {
                let mut density = [0.0; 3];
                for g in sum {
                    let value = exp(-x * x / (2.0 * g.variance)) / sqrt(2.0 * PI * g.variance);
                    for (d, w) in density.iter_mut().zip(g.weight) {
                        *d += w * value;
                    }
                }
                density
            }
            Shape::Burley(d) => each(|c| (k0(x / d[c]) + k0(x / (3.0 * d[c]))) / (4.0 * PI * d[c])),
            Shape::Table(rows) => {
                // Along the line each piece is a + b r with r² = x² + y²; both have antiderivatives in y.
                let along = |r: f64| sqrt((r * r - x * x).max(0.0));
                let integral_of_r = |r: f64, y: f64| {
                    let curved = if x > 0.0 { x * x * log((r + y) / x) } else { 0.0 };
                    0.5 * (y * r + curved)
                };
                let mut sum = [0.0; 3];
                // Each piece begins where the last one ended.
                let (mut y0, mut before) = (0.0, integral_of_r(x, 0.0));
                let mut add = |r1: f64, a: [f64; 3], b: [f64; 3]| {
                    let r1 = r1.max(x);
                    let y1 = along(r1);
                    let after = integral_of_r(r1, y1);
                    for c in [0, 1, 2] {
                        sum[c] += 2.0 * (a[c] * (y1 - y0) + b[c] * (after - before));
                    }
                    (y0, before) = (y1, after);
                };
                add(rows[0].0, rows[0].1, [0.0; 3]);
                for pair in rows.windows(2).filter(|pair| pair[1].0 > x) {
                    let ((r0, d0), (r1, d1)) = (pair[0], pair[1]);
                    let b = each(|c| (d1[c] - d0[c]) / (r1 - r0));
                    add(r1, each(|c| d0[c] - b[c] * r0), b);
                }
                sum
            }
            Shape::Sampled(samples) => samples::density(samples, x),
        }
    }

    /// The shortest length over which the density changes much, millimetres.
    pub(crate) fn shortest(&self) -> f64 {
        match self.0 {
            Shape::Gaussians(sum) => sum.iter().map(|g| sqrt(g.variance)).fold(f64::INFINITY, f64::min),
            Shape::Burley(d) => d.into_iter().fold(f64::INFINITY, f64::min),
            // Rows may stand as close as they like near zero, where pieces are short anyway.
            Shape::Table(_) | Shape::Sampled(_) => self.reach() / 200.0,
        }
    }

    /// The distance beyond which less than 1e-9 of the light leaves, millimetres.
    pub(crate) fn reach(&self) -> f64 {
        match self.0 {
            Shape::Gaussians(sum) => 6.5 * sum.iter().map(|g| sqrt(g.variance)).fold(0.0, f64::max),
            Shape::Burley(d) => 63.0 * d.into_iter().fold(0.0, f64::max),
            Shape::Table(rows) => rows[rows.len() - 1].0,
            Shape::Sampled(samples) => samples[samples.len() - 1].distance,
        }
    }
}

//! The Beckmann distribution and LEAN mapping, to compare with.
//!
//! - Beckmann, Spizzichino. The Scattering of Electromagnetic Waves from Rough Surfaces. 1963.
//! - Olano, Baker. LEAN Mapping. I3D 2010.

use crate::{Sym2, sqrt::sqrt};
use core::f32::consts::{FRAC_1_SQRT_2, PI, SQRT_2};
use glam::{Vec2, Vec3, vec2};

/// Beckmann's sigma, the standard deviation of slopes, that stands for a GGX alpha (slide: LEAN Mapping):
/// `alpha / sqrt(2)`.
pub fn sigma_from_alpha(alpha: f32) -> f32 {
    alpha * FRAC_1_SQRT_2
}

/// The inverse of [`sigma_from_alpha`].
pub fn alpha_from_sigma(sigma: f32) -> f32 {
    sigma * SQRT_2
}

/// Distribution of microfacet normals per steradian with slope deviations `sigma_t`, `sigma_b` along x and
/// y (Beckmann 1963): `exp(-(x²/σt² + y²/σb²) / (2 z²)) / (2π σt σb z⁴)`, zero below the horizon.
pub fn beckmann_aniso_d(h: Vec3, sigma_t: f32, sigma_b: f32) -> f32 {
    // z⁴ underflows long after the exponential has: at z = 1e-6 it is exp(-5e11 / sigma²).
    if h.z <= 1e-6 {
        return 0.0;
    }
    let z2 = h.z * h.z;
    let x = h.x / sigma_t;
    let y = h.y / sigma_b;
    libm::expf(-0.5 * (x * x + y * y) / z2) / (2.0 * PI * sigma_t * sigma_b * z2 * z2)
}

/// The five moments of slopes that LEAN mapping filters (Olano 2010, section 3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LeanMoments {
    /// First moments, `B`: the mean slope.
    pub mean: Vec2,
    /// Second moments, `M`, the base roughness included.
    pub second: Sym2,
}

impl LeanMoments {
    /// Moments of one Gaussian of slopes: centre `mean`, covariance `covariance`.
    pub fn from_gaussian(mean: Vec2, covariance: Sym2) -> Self {
        LeanMoments { mean, second: covariance + Sym2::outer(mean) }
    }

    /// Covariance of slopes, `M - B B^T` (Olano 2010, eq. 5).
    pub fn covariance(self) -> Sym2 {
        self.second + Sym2::outer(self.mean) * -1.0
    }
}

/// Slope towards which a unit normal with z ≥ 0 leans: `n.xy / n.z`, a million at most.
pub fn slope_from_normal(n: Vec3) -> Vec2 {
    vec2(n.x, n.y) / n.z.max(1e-6)
}

/// Unit normal of a slope.
pub fn normal_from_slope(slope: Vec2) -> Vec3 {
    let scale = sqrt(1.0 + slope.length_squared()).recip();
    slope.extend(1.0) * scale
}

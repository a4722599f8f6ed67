//! Order-2 spherical harmonics: distant light by nine coefficients.
//!
//! Ramamoorthi and Hanrahan. An Efficient Representation for Irradiance Environment Maps.
//! SIGGRAPH 2001.
//!
//! Coefficients stand in the order (l, m) = (0,0), (1,-1), (1,0), (1,1), (2,-2) .. (2,2). The basis is
//! orthonormal over the sphere, its polar axis is z, without the Condon-Shortley phase.
//!
//! ```
//! use glam::{Vec3, vec3};
//! use kinran_shading::sh::{Sh9, sh_basis, sh_irradiance};
//!
//! // A light far above, as narrow as nine coefficients can be.
//! let radiance: Sh9 = sh_basis(Vec3::Y).map(Vec3::splat);
//! assert!(sh_irradiance(&radiance, Vec3::Y).x > sh_irradiance(&radiance, vec3(0.6, 0.8, 0.0)).x);
//! ```

use core::f32::consts::PI;

use glam::Vec3;

/// Radiance from every direction, RGB, by nine coefficients.
pub type Sh9 = [Vec3; 9];

/// sqrt(1 / (4 pi)).
const Y0: f32 = 0.282_094_8;
/// sqrt(3 / (4 pi)).
const Y1: f32 = 0.488_602_52;
/// sqrt(15 / (4 pi)).
const Y2: f32 = 1.092_548_4;
/// sqrt(5 / (16 pi)).
const Y20: f32 = 0.315_391_57;
/// sqrt(15 / (16 pi)).
const Y22: f32 = 0.546_274_2;

/// What the clamped cosine does to band l: sqrt(4 pi / (2l + 1)) times its own coefficient (\[1\] eq. 8).
/// Band 3 is zero and the ones beyond carry under 1 % of its energy, which is why order 2 suffices.
pub const COSINE_LOBE: [f32; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// Band of each coefficient.
const BAND: [usize; 9] = [0, 1, 1, 1, 2, 2, 2, 2, 2];

/// The basis functions at a unit direction.
pub fn sh_basis(direction: Vec3) -> [f32; 9] {
    let Vec3 { x, y, z } = direction;
    [
        Y0,
        Y1 * y,
        Y1 * z,
        Y1 * x,
        Y2 * x * y,
        Y2 * y * z,
        Y20 * (3.0 * z * z - 1.0),
        Y2 * x * z,
        Y22 * (x * x - y * y),
    ]
}

/// The function that the coefficients stand for, at a unit direction; negative where it rings.
pub fn sh_evaluate(coefficients: &Sh9, direction: Vec3) -> Vec3 {
    let basis = sh_basis(direction);
    (0..9).fold(Vec3::ZERO, |sum, i| sum + coefficients[i] * basis[i])
}

/// Coefficients of irradiance from those of radiance (\[1\] eq. 7); [`sh_evaluate`] of the result is
/// [`sh_irradiance`], three multiplications a coefficient cheaper.
pub fn sh_convolve_cosine(radiance: &Sh9) -> Sh9 {
    core::array::from_fn(|i| radiance[i] * COSINE_LOBE[BAND[i]])
}

/// Irradiance on a surface with unit `normal`, the integral of radiance times the clamped cosine. Light
/// from one small spot can make it slightly negative on the far side; clamp where that matters.
pub fn sh_irradiance(radiance: &Sh9, normal: Vec3) -> Vec3 {
    sh_evaluate(&sh_convolve_cosine(radiance), normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions of equal solid angle: the spherical Fibonacci lattice, whose quadrature error for
    /// polynomials of low degree is of the order 1 / n.
    fn directions(n: usize) -> impl Iterator<Item = Vec3> {
        (0..n).map(move |i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let phi = i as f64 * core::f64::consts::PI * (3.0 - 5f64.sqrt());
            let r = (1.0 - z * z).sqrt();
            Vec3::new((r * phi.cos()) as f32, (r * phi.sin()) as f32, z as f32)
        })
    }

    fn project(radiance: impl Fn(Vec3) -> f32) -> Sh9 {
        const N: usize = 200_000;
        let mut sums = [0f64; 9];
        for d in directions(N) {
            for (sum, y) in sums.iter_mut().zip(sh_basis(d)) {
                *sum += f64::from(radiance(d) * y);
            }
        }
        sums.map(|sum| Vec3::splat((sum * 4.0 * core::f64::consts::PI / N as f64) as f32))
    }

    /// Irradiance by quadrature.
    fn irradiance(radiance: impl Fn(Vec3) -> f32, n: Vec3) -> f32 {
        const N: usize = 200_000;
        let sum: f64 = directions(N).map(|d| f64::from(radiance(d) * d.dot(n).max(0.0))).sum();
        (sum * 4.0 * core::f64::consts::PI / N as f64) as f32
    }

    fn close(what: &str, want: f32, got: f32, tolerance: f32) {
        assert!((want - got).abs() <= tolerance, "{what}: wanted {want}, got {got}, tolerance {tolerance}");
    }

    const NORMALS: [Vec3; 4] = [Vec3::X, Vec3::NEG_Y, Vec3::new(0.48, 0.6, 0.64), Vec3::new(-0.6, 0.0, -0.8)];

    #[test]
    fn basis_is_orthonormal() {
        for i in 0..9 {
            let row = project(|d| sh_basis(d)[i]);
            for (j, got) in row.iter().enumerate() {
                close(&format!("<Y{i}, Y{j}>"), f32::from(u8::from(i == j)), got.x, 2e-5);
            }
        }
    }

    #[test]
    fn constant_light_gives_pi() {
        let light = project(|_| 1.0);
        close("L00", 1.0 / Y0, light[0].x, 1e-4);
        for n in NORMALS {
            close(&format!("irradiance at {n}"), PI, sh_irradiance(&light, n).x, 1e-4);
        }
    }

    /// A linear gradient a + b.d has irradiance pi a + (2 pi / 3) b.n, within the span of the basis.
    #[test]
    fn gradient_is_exact_and_not_mirrored() {
        let slope = Vec3::new(0.3, -0.5, 0.2);
        let light = project(|d| 1.0 + slope.dot(d));
        for n in NORMALS {
            let want = PI + 2.0 * PI / 3.0 * slope.dot(n);
            close(&format!("irradiance at {n}"), want, sh_irradiance(&light, n).x, 2e-4);
        }
    }

    /// The clamped cosine about z has coefficients sqrt(pi)/2, sqrt(pi/3), sqrt(5 pi)/8 (\[1\] eq. 8).
    #[test]
    fn cosine_lobe_has_its_closed_form() {
        let light = project(|d| d.z.max(0.0));
        let zonal = [(0, PI.sqrt() / 2.0), (2, (PI / 3.0).sqrt()), (6, (5.0 * PI).sqrt() / 8.0)];
        for (i, want) in zonal {
            close(&format!("coefficient {i}"), want, light[i].x, 2e-5);
        }
        for i in [1, 3, 4, 5, 7, 8] {
            close(&format!("coefficient {i}"), 0.0, light[i].x, 2e-5);
        }
        for (l, i) in [(0, 0), (1, 2), (2, 6)] {
            let want = (4.0 * PI / (2 * l + 1) as f32).sqrt() * light[i].x;
            close(&format!("COSINE_LOBE[{l}]"), want, COSINE_LOBE[l], 1e-4);
        }
    }

    /// A sky of two soft lights, band-limited only in part. Ramamoorthi and Hanrahan give 1 % average error for real skies;
    /// the worst normal here is within 3 % of the largest irradiance.
    #[test]
    fn irradiance_of_a_sky_meets_quadrature() {
        let (sun, window) = (Vec3::new(0.6, 0.64, 0.48), Vec3::new(-0.8, 0.0, 0.6));
        let sky = |d: Vec3| 0.2 + 4.0 * d.dot(sun).max(0.0).powi(8) + d.dot(window).max(0.0).powi(4);
        let light = project(sky);
        let largest = directions(64).map(|n| irradiance(sky, n)).fold(0.0, f32::max);
        for n in directions(64) {
            let want = irradiance(sky, n);
            close(&format!("irradiance at {n}"), want, sh_irradiance(&light, n).x, 0.03 * largest);
        }
    }
}

//! Surfaces to filter, and the truth to hold filters against.
#![allow(dead_code, unreachable_pub, missing_docs, reason = "a module of tests, each of which uses its part")]

pub mod colored;
pub mod exact;

use std::convert::Infallible;
use std::f32::consts::PI;
use std::sync::Arc;

use glam::{Vec3, vec2, vec3};
use kinran_bake::aniso::{Filter, Kernel, NormalMap, RoughnessMaps, SurfaceMaps, filter_levels};
use kinran_image::{Channels, Image, Pixels};
use kinran_scene::Wrap;
use kinran_shading::{Sym2, aniso_encode, aniso_from_alphas, ggx_matrix_d, m_n, smith_matrix_v};

/// A texel: normal and squared roughness.
pub type Surface = (Vec3, Sym2);

/// PCG32, so that footprints are the same everywhere.
#[derive(Debug)]
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(2).wrapping_add(1_442_695_040_888_963_407));
        random.bits();
        random
    }

    fn bits(&mut self) -> u32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let shifted = (((state >> 18) ^ state) >> 27) as u32;
        shifted.rotate_right((state >> 59) as u32)
    }

    /// Uniform in [lo, hi).
    pub fn uniform(&mut self, lo: f32, hi: f32) -> f32 {
        lo + (hi - lo) * (self.bits() >> 8) as f32 / 16_777_216.0
    }

    /// Normal deviate.
    pub fn gauss(&mut self) -> f32 {
        let r = (-2.0 * (1.0 - self.uniform(0.0, 1.0)).ln()).sqrt();
        r * self.uniform(0.0, 2.0 * PI).cos()
    }

    /// A texel with slopes of deviation `slope`, alphas in the range and any direction.
    pub fn texel(&mut self, alpha: (f32, f32), slope: f32) -> Surface {
        let n = vec3(self.gauss() * slope, self.gauss() * slope, 1.0).normalize();
        let (a, b) = (self.uniform(alpha.0, alpha.1), self.uniform(alpha.0, alpha.1));
        let angle = self.uniform(0.0, PI);
        (n, aniso_from_alphas(a.max(b), a.min(b), vec2(angle.cos(), angle.sin())))
    }
}

/// Maps of float texels, `width * height` of them.
pub fn maps_of(texels: &[Surface], width: u32, wrap: Wrap) -> SurfaceMaps {
    let height = texels.len() as u32 / width;
    let image = |samples| Arc::new(Image::new(width, height, Channels::Rgb, Pixels::F32(samples)).unwrap());
    let normal = NormalMap {
        image: Some(image(texels.iter().flat_map(|t| t.0.to_array()).collect())),
        signed: true,
        ..NormalMap::flat()
    };
    let aniso = image(texels.iter().flat_map(|t| aniso_encode(t.1).to_array()).collect());
    SurfaceMaps { normal, roughness: RoughnessMaps::Encoded(aniso), wrap: [wrap; 2], weights: None }
}

/// All texels of all levels.
pub fn levels_of(maps: &SurfaceMaps, filter: Filter, kernel: Kernel) -> Vec<Vec<Surface>> {
    let Ok(bands) = filter_levels(maps, filter, kernel, |band| {
        Ok::<Vec<_>, Infallible>((0..band.texels.len()).map(|i| band.texels.texel(i)).collect())
    });
    bands.into_iter().map(|bands| bands.concat()).collect()
}

/// The one texel a whole footprint is filtered to.
pub fn filtered(texels: &[Surface], width: u32, filter: Filter) -> Surface {
    levels_of(&maps_of(texels, width, Wrap::Repeat), filter, Kernel::Box).last().unwrap()[0]
}

/// Reflected radiance of a texel: GGX with height-correlated Smith, F = 1, times the cosine of the light.
pub fn lobe((n, a): Surface, u: Vec3, v: Vec3) -> f32 {
    let m = m_n(n);
    let local = |w: Vec3| vec3(m.x_axis.dot(w), m.y_axis.dot(w), n.dot(w));
    let (u, v) = (local(u), local(v));
    if u.z <= 0.0 || v.z <= 0.0 {
        return 0.0;
    }
    let h = (u + v).normalize();
    let a = a + Sym2::scalar(1e-9);
    ggx_matrix_d(h, a) * smith_matrix_v(u, v, a) * u.z
}

/// Relative errors of the shaded lobe against the mean of the footprint's, over six views and all lights.
#[derive(Clone, Copy, Debug, Default)]
pub struct ShadedError {
    pub l2: f32,
    pub l1: f32,
}

/// Relative L2 error of the shaded lobe, see [`shaded_errors`].
pub fn shaded_l2(footprint: &[Surface], fit: Surface) -> f32 {
    shaded_errors(footprint, &[fit], 64)[0].l2
}

/// Errors of some fits, by half vectors on so many rings and twice as many sectors.
pub fn shaded_errors(footprint: &[Surface], fits: &[Surface], rings: usize) -> Vec<ShadedError> {
    let sectors = 2 * rings;
    let mut sums = vec![[0.0_f64; 2]; fits.len()];
    let mut norms = [0.0_f64; 2];
    for (theta, phi) in [(0.0, 0.0), (30.0, 0.0), (30.0, 120.0), (30.0, 240.0), (60.0, 45.0), (60.0, 225.0)] {
        let (theta, phi) = (f32::to_radians(theta), f32::to_radians(phi));
        let v = vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        // Half vectors on rings of slopes r = tan θ that crowd where lobes are narrow; each carries the solid
        // angle of its light direction.
        for ring in 0..rings {
            let t = (ring as f32 + 0.5) / rings as f32;
            let slope = 0.25 * t / (1.0 - t);
            let slope_step = 0.25 / ((1.0 - t) * (1.0 - t)) / rings as f32;
            for sector in 0..sectors {
                let phi = 2.0 * PI * (sector as f32 + 0.5) / sectors as f32;
                let h = vec3(slope * phi.cos(), slope * phi.sin(), 1.0).normalize();
                let v_h = v.dot(h);
                let u = h * (2.0 * v_h) - v;
                if u.z <= 0.0 || v_h <= 0.0 {
                    continue;
                }
                // dω_h = z³ r dr dφ, dω_u = 4 v·h dω_h.
                let solid_angle = 4.0 * v_h * h.z.powi(3) * slope * slope_step * 2.0 * PI / sectors as f32;
                let truth = footprint.iter().map(|t| lobe(*t, u, v)).sum::<f32>() / footprint.len() as f32;
                let add = |sums: &mut [f64; 2], radiance: f32| {
                    sums[0] += f64::from(radiance * radiance * solid_angle);
                    sums[1] += f64::from(radiance.abs() * solid_angle);
                };
                add(&mut norms, truth);
                sums.iter_mut().zip(fits).for_each(|(sums, fit)| add(sums, lobe(*fit, u, v) - truth));
            }
        }
    }
    let relative = |sums: [f64; 2]| ShadedError {
        l2: (sums[0] / norms[0]).sqrt() as f32,
        l1: (sums[1] / norms[1]) as f32,
    };
    sums.into_iter().map(relative).collect()
}

/// Half the integral of the absolute difference between the visible microfacets of the footprint and of some fits: 0 where
/// they agree, 1 where they share none.
pub fn total_variations(footprint: &[Surface], fits: &[Surface]) -> Vec<f32> {
    const RINGS: usize = 128;
    const SECTORS: usize = 256;
    let density = |(n, a): Surface, h: Vec3| {
        let m = m_n(n);
        let local = vec3(m.x_axis.dot(h), m.y_axis.dot(h), n.dot(h));
        if local.z > 0.0 { ggx_matrix_d(local, a + Sym2::scalar(1e-9)) } else { 0.0 }
    };
    let mut sums = vec![0.0_f64; fits.len()];
    for ring in 0..RINGS {
        let t = (ring as f32 + 0.5) / RINGS as f32;
        let slope = 0.25 * t / (1.0 - t);
        let step = 0.25 / ((1.0 - t) * (1.0 - t)) / RINGS as f32;
        for sector in 0..SECTORS {
            let phi = 2.0 * PI * (sector as f32 + 0.5) / SECTORS as f32;
            let h = vec3(slope * phi.cos(), slope * phi.sin(), 1.0).normalize();
            // Projected solid angle, z⁴ r dr dφ.
            let area = h.z.powi(4) * slope * step * 2.0 * PI / SECTORS as f32;
            let truth = footprint.iter().map(|t| density(*t, h)).sum::<f32>() / footprint.len() as f32;
            for (sum, fit) in sums.iter_mut().zip(fits) {
                *sum += f64::from(0.5 * (density(*fit, h) - truth).abs() * area);
            }
        }
    }
    sums.into_iter().map(|sum| sum as f32).collect()
}

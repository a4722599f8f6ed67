//! Footprints of surfaces with a colour: what a person sees of them, by an integral over lights that no filter knows.

use glam::{Vec3, vec3};

use super::{Surface, lobe};

/// A texel as a renderer takes it.
#[derive(Clone, Copy, Debug)]
pub struct Colored {
    pub surface: Surface,
    /// Linear.
    pub base: Vec3,
    pub metallic: f32,
    /// F0 of what is not metal; 0.04 without `KHR_materials_specular`.
    pub specular: Vec3,
}

impl Colored {
    /// Radiance times the cosine of a light along `u`, seen along `v`: Lambert, and GGX with Schlick's Fresnel term.
    pub fn shade(&self, u: Vec3, v: Vec3) -> Vec3 {
        let (n, m) = (self.surface.0, self.metallic);
        let f0 = self.specular * (1.0 - m) + self.base * m;
        let h = (u + v).normalize();
        let grazing = (1.0 - v.dot(h).clamp(0.0, 1.0)).powi(5);
        let fresnel = f0 + (Vec3::ONE - f0) * grazing;
        // What is not metal scatters what it does not reflect, here relative to 0.96.
        let inside = (1.0 - self.specular.max_element()) / 0.96;
        let diffuse = self.base * ((1.0 - m) * inside) / std::f32::consts::PI * n.dot(u).max(0.0);
        diffuse + fresnel * lobe(self.surface, u, v)
    }
}

/// Root mean squares over six views and all lights.
#[derive(Clone, Copy, Debug, Default)]
pub struct SeenError {
    /// Of linear radiance, relative to that of the footprint.
    pub l2: f64,
    /// Of sRGB values under a light of π lux, what is above white being white.
    pub display: f64,
}

fn display(radiance: Vec3) -> Vec3 {
    let code = |v: f32| kinran_image::srgb::srgb_from_linear((v * std::f32::consts::PI).clamp(0.0, 1.0));
    vec3(code(radiance.x), code(radiance.y), code(radiance.z))
}

/// Errors of some texels that stand for a footprint. Lights come from half vectors on rings of slopes that crowd where lobes are
/// narrow, `rings` of them and twice as many sectors; each counts by its solid angle.
pub fn seen_errors(footprint: &[Colored], fits: &[Colored], rings: usize) -> Vec<SeenError> {
    let sectors = 2 * rings;
    let mut sums = vec![[0.0_f64; 2]; fits.len()];
    let (mut norm, mut total) = (0.0_f64, 0.0_f64);
    for (theta, phi) in [(0.0, 0.0), (30.0, 0.0), (30.0, 120.0), (30.0, 240.0), (60.0, 45.0), (60.0, 225.0)] {
        let (theta, phi) = (f32::to_radians(theta), f32::to_radians(phi));
        let v = vec3(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        for ring in 0..rings {
            let t = (ring as f32 + 0.5) / rings as f32;
            let slope = 0.25 * t / (1.0 - t);
            let slope_step = 0.25 / ((1.0 - t) * (1.0 - t)) / rings as f32;
            for sector in 0..sectors {
                let phi = 2.0 * std::f32::consts::PI * (sector as f32 + 0.5) / sectors as f32;
                let h = vec3(slope * phi.cos(), slope * phi.sin(), 1.0).normalize();
                let v_h = v.dot(h);
                let u = h * (2.0 * v_h) - v;
                if u.z <= 0.0 || v_h <= 0.0 {
                    continue;
                }
                // dω_h = z³ r dr dφ, dω_u = 4 v·h dω_h.
                let solid_angle = f64::from(
                    4.0 * v_h * h.z.powi(3) * slope * slope_step * 2.0 * std::f32::consts::PI
                        / sectors as f32,
                );
                let truth = footprint.iter().map(|t| t.shade(u, v)).sum::<Vec3>() / footprint.len() as f32;
                norm += f64::from(truth.length_squared()) * solid_angle;
                total += solid_angle;
                for (sums, fit) in sums.iter_mut().zip(fits) {
                    let seen = fit.shade(u, v);
                    sums[0] += f64::from((seen - truth).length_squared()) * solid_angle;
                    sums[1] +=
                        f64::from((display(seen) - display(truth)).length_squared()) * solid_angle / 3.0;
                }
            }
        }
    }
    let finish =
        |[l2, display]: [f64; 2]| SeenError { l2: (l2 / norm).sqrt(), display: (display / total).sqrt() };
    sums.into_iter().map(finish).collect()
}

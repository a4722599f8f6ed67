//! The specular probe: an environment in GGX lobes of six roughnesses.

use glam::{Mat3, Vec2, Vec3, vec2};
use kinran_scene::Environment;
use kinran_shading::{alpha_from_roughness, ggx_aniso_d, ggx_vndf_pdf, ggx_vndf_sample, m_n, smith_aniso_v};
use rayon::prelude::*;
use std::f32::consts::{PI, TAU};

use crate::reference::sampler::sample_2d;

/// Levels; level l holds perceptual roughness `l / (LEVELS - 1)`.
pub(super) const LEVELS: usize = 6;

/// Rows of level 0, half its columns. At 512, level 1, alpha 0.04, is 0.7 degrees a texel; what is coarser itself is not
/// filtered finer, down to half of that.
pub(super) fn height(environment: &Environment) -> usize {
    environment.height().clamp(256, 512)
}

/// Samples of the lobe for a texel of each level, and as many of the environment: the narrower the fewer.
const SAMPLES: [u32; LEVELS] = [0, 24, 48, 64, 64, 64];

/// Radiance of every texel of every level, level 0 first, row by row from the top, as an equirectangular image in the
/// sense of [`Environment`]. Normal and view are taken to be the lobe's middle (Karis 2013).
pub(super) fn prefilter(environment: &Environment) -> Vec<Vec<Vec3>> {
    let rows = height(environment);
    (0..LEVELS)
        .map(|level| {
            let (width, height) = ((2 * rows) >> level, rows >> level);
            let alpha = alpha_from_roughness(level as f32 / (LEVELS - 1) as f32);
            let texel = |i: usize| {
                let place = vec2((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
                let direction = direction(place / vec2(width as f32, height as f32));
                if level == 0 {
                    environment.radiance(direction)
                } else {
                    filtered(environment, direction, alpha, SAMPLES[level])
                }
            };
            (0..width * height).into_par_iter().map(texel).collect()
        })
        .collect()
}

/// The direction of texture coordinates.
fn direction(uv: Vec2) -> Vec3 {
    let (sin_theta, cos_theta) = libm::sincosf(PI * uv.y);
    let (sin_phi, cos_phi) = libm::sincosf(TAU * (uv.x - 0.5));
    Vec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi)
}

/// The mean radiance in the lobe about `axis`, by visible normals and by the environment's own distribution, combined by
/// the balance heuristic. Numerator and denominator share their samples.
fn filtered(environment: &Environment, axis: Vec3, alpha: f32, samples: u32) -> Vec3 {
    // m_n is worst at -z; a frame for the opposite hemisphere is its mirror image.
    let to_world =
        if axis.z >= 0.0 { m_n(axis) } else { m_n(-axis) * Mat3::from_diagonal(Vec3::new(1.0, -1.0, -1.0)) };
    let to_lobe = to_world.transpose();
    let v = Vec3::Z;
    let mut radiance = Vec3::ZERO;
    let mut weights = 0.0;
    let mut add = |u: Vec3, world: Vec3, environment_pdf: f32| {
        if u.z <= 0.0 {
            return;
        }
        let h = (u + v).normalize();
        let lobe_pdf = ggx_vndf_pdf(v, h, alpha, alpha) / (4.0 * v.dot(h));
        let lobe = ggx_aniso_d(h, alpha, alpha) * smith_aniso_v(u, v, alpha, alpha) * u.z;
        let weight = lobe / (lobe_pdf + environment_pdf);
        radiance += weight * environment.radiance(world);
        weights += weight;
    };
    for i in 0..samples {
        let h = ggx_vndf_sample(v, alpha, alpha, sample_2d(i, 0, 0));
        let u = 2.0 * v.dot(h) * h - v;
        let world = to_world * u;
        add(u, world, environment.pdf(world));
        let (world, pdf) = environment.sample(sample_2d(i, 1, 0));
        add(to_lobe * world, world, pdf);
    }
    radiance / weights.max(f32::MIN_POSITIVE)
}

//! How much a dielectric's surface reflects before its inside sees any light.

use super::sampler::sample_2d;
use glam::{Vec2, Vec3, vec2, vec3};
use kinran_shading::{
    ALPHA_MIN, ggx_albedo_alpha, ggx_directional_albedo, ggx_vndf_sample, multiscatter_compensation,
    smith_aniso_g1, smith_aniso_v,
};
use std::sync::LazyLock;

/// Nodes along the square root of n·v and along that of alpha.
pub(crate) const SIZE: usize = 32;

/// Samples for a cell; their error of the mean is under 0.002.
const SAMPLES: u32 = 256;

/// The part of the lobe's albedo that Schlick's `(1 - v·h)^5` carries, at every node, n·v fastest.
pub(crate) static GRAZING: LazyLock<Vec<f32>> = LazyLock::new(|| {
    let at = |i: usize| i as f32 / (SIZE - 1) as f32;
    (0..SIZE * SIZE).map(|i| grazing_albedo(at(i % SIZE).powi(2), at(i / SIZE).powi(2), SAMPLES)).collect()
});

/// Directional albedo of the specular lobe of a surface with reflectance `f0` at normal incidence, Schlick's
/// Fresnel and multiscatter compensation, for the view `v` in the frame of the alphas. What it leaves, 1 minus it, is what
/// the diffuse part may have: together they pass the white furnace. Anisotropic lobes use the isotropic albedo at
/// [`ggx_albedo_alpha`], as [`multiscatter_compensation`] does.
pub(crate) fn specular_albedo(f0: f32, v: Vec3, alpha_t: f32, alpha_b: f32) -> f32 {
    let (n_v, alpha) = (v.z, ggx_albedo_alpha(v, alpha_t, alpha_b));
    let white = ggx_directional_albedo(n_v, alpha);

    // Bilinear between the nodes.
    let place =
        vec2(n_v, alpha).max(Vec2::ZERO).map(f32::sqrt).clamp(Vec2::ZERO, Vec2::ONE) * (SIZE - 1) as f32;
    let cell = place.floor().min(Vec2::splat((SIZE - 2) as f32));
    let f = place - cell;
    let i = cell.y as usize * SIZE + cell.x as usize;
    let row = |i: usize| GRAZING[i] + (GRAZING[i + 1] - GRAZING[i]) * f.x;
    let grazing = row(i) + (row(i + SIZE) - row(i)) * f.y;

    let single = f0 * (white - grazing) + grazing;
    let compensation = multiscatter_compensation(Vec3::splat(f0), v, alpha_t, alpha_b).x;
    (single * compensation).min(1.0)
}

/// The part of the single-scattering lobe's albedo that Schlick's `(1 - v·h)^5` carries, by visible normals.
fn grazing_albedo(n_v: f32, alpha: f32, samples: u32) -> f32 {
    let (n_v, alpha) = (n_v.max(1e-3), alpha.max(ALPHA_MIN));
    let v = vec3((1.0 - n_v * n_v).sqrt(), 0.0, n_v);
    let weight = |i| {
        let h = ggx_vndf_sample(v, alpha, alpha, sample_2d(i, 0, 0));
        let v_h = v.dot(h);
        let u = 2.0 * v_h * h - v;
        if u.z <= 0.0 {
            return 0.0;
        }
        let g2_over_g1 =
            4.0 * u.z * v.z * smith_aniso_v(u, v, alpha, alpha) / smith_aniso_g1(v, alpha, alpha);
        (1.0 - v_h).max(0.0).powi(5) * g2_over_g1
    };
    (0..samples).map(weight).sum::<f32>() / samples as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(n_v: f32) -> Vec3 {
        vec3((1.0 - n_v * n_v).sqrt(), 0.0, n_v)
    }

    #[test]
    fn the_table_agrees_with_many_samples_between_its_nodes() {
        for alpha in [0.004, 0.013, 0.09, 0.31, 0.77, 1.0] {
            for n_v in [0.011f32, 0.05, 0.27, 0.6, 0.98] {
                let wanted = grazing_albedo(n_v, alpha, 1 << 14);
                let white = ggx_directional_albedo(n_v, alpha);
                // At f0 = 0 the compensation is one and the albedo is the tabulated part alone.
                let got = specular_albedo(0.0, view(n_v), alpha, alpha);
                // (1 - x²)^5 of the square root x is interpolated over cells of 1/31: 10 / (8 · 31²). The rest is
                // the corner where n·v and alpha are both near 0.01 and masking sets in within one cell.
                assert!((wanted - got).abs() < 1e-2, "n_v {n_v} alpha {alpha}: wanted {wanted}, got {got}");
                assert!(got <= white + 1e-2, "n_v {n_v} alpha {alpha}: {got} of {white}");
            }
        }
    }

    #[test]
    fn a_white_mirror_leaves_nothing_and_a_smooth_dielectric_follows_fresnel() {
        assert!((specular_albedo(1.0, view(0.7), 0.5, 0.5) - 1.0).abs() < 2e-3);
        let fresnel = 0.04 + 0.96 * 0.3f32.powi(5);
        let got = specular_albedo(0.04, view(0.7), ALPHA_MIN, ALPHA_MIN);
        assert!((got - fresnel).abs() < 3e-3, "wanted {fresnel}, got {got}");
    }
}

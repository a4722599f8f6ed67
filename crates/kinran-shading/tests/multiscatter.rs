//! Energy compensation against white furnaces integrated in double precision.

mod common;

use common::{Ggx, cases, view, visible_normals};
use glam::Vec3;
use kinran_shading::{
    ggx_aniso_d, ggx_directional_albedo, multiscatter_compensation, smith_aniso_g1, smith_aniso_v,
};
use std::f64::consts::{LN_2, TAU};

#[test]
fn quadrature_reaches_the_closed_form_of_the_roughest_lobe_seen_from_above() {
    let got = Ggx { alpha_t: 1.0, alpha_b: 1.0 }.albedo(view(1.0, 0.0), 256);
    let wanted = 1.0 - LN_2;
    assert!((got - wanted).abs() < 2e-6, "E(1, 1): wanted 1 - ln 2 = {wanted}, got {got}");
}

#[test]
fn directional_albedo_keeps_its_stated_error() {
    let steps = 48;
    let (mut worst, mut sum) = (0.0_f64, 0.0);
    for i in 0..=steps {
        for j in 0..=steps {
            let alpha = 0.005 + 0.995 * f64::from(i) / f64::from(steps);
            let n_v = (0.005 + 0.995 * f64::from(j) / f64::from(steps)).min(1.0);
            let wanted = Ggx { alpha_t: alpha, alpha_b: alpha }.albedo(view(n_v, 0.0), 64);
            let got = ggx_directional_albedo(n_v as f32, alpha as f32);
            let error = f64::from(got) - wanted;
            assert!(error.abs() < 0.011, "wanted {wanted}, got {got} at n·v {n_v}, alpha {alpha}");
            worst = worst.max(error.abs());
            sum += error * error;
        }
    }
    let rms = (sum / f64::from((steps + 1) * (steps + 1))).sqrt();
    assert!(rms < 0.004, "RMS error: wanted below 0.004, got {rms} (worst {worst})");
}

#[test]
fn the_albedo_stays_within_its_range_outside_the_fit() {
    for n_v in [0.0, 1e-6, 0.002, 1.0] {
        for alpha in [0.0, 1e-3, 0.004, 1.0] {
            let e = ggx_directional_albedo(n_v, alpha);
            assert!((0.3..=1.0).contains(&e), "wanted 0.3 <= E <= 1, got {e} at n·v {n_v}, alpha {alpha}");
        }
    }
}

#[test]
fn white_isotropic_facets_pass_the_furnace() {
    for alpha in [0.005_f32, 0.05, 0.2, 0.5, 0.8, 1.0] {
        for n_v in [0.01, 0.1, 0.3, 0.6, 1.0] {
            let v = view(n_v, 0.0);
            // The very functions of the crate, over half vectors: dω_u = 4 v·h dω_h.
            let single = visible_normals(v, alpha.into(), alpha.into(), 96)
                .into_iter()
                .map(|(h, solid_angle)| {
                    let u = (2.0 * v.dot(h) * h - v).as_vec3();
                    if u.z <= 0.0 {
                        return 0.0;
                    }
                    let f =
                        ggx_aniso_d(h.as_vec3(), alpha, alpha) * smith_aniso_v(u, v.as_vec3(), alpha, alpha);
                    f64::from(f * u.z) * 4.0 * v.dot(h) * solid_angle
                })
                .sum::<f64>();
            let factor = multiscatter_compensation(Vec3::ONE, v.as_vec3(), alpha, alpha).x;
            let got = single * f64::from(factor);
            // 0.011 of E, over the smallest E there is.
            assert!(
                (got - 1.0).abs() < 0.011 / (1.0 - LN_2),
                "wanted 1, got {got} ({single} before compensation) at n·v {n_v}, alpha {alpha}"
            );
            assert!(single <= 1.0 + 1e-4, "single scattering makes energy: {single} at {n_v}, {alpha}");
        }
    }
}

#[test]
fn anisotropic_compensation_keeps_its_stated_error() {
    let count = 2000;
    let (mut worst, mut sum) = ((0.0_f64, String::new()), 0.0);
    for mut rng in cases(1, count) {
        let ggx = Ggx { alpha_t: rng.range(0.05, 1.0), alpha_b: rng.range(0.05, 1.0) };
        let (n_v, phi) = (rng.range(0.005, 1.0), rng.range(0.0, TAU));
        let v = view(n_v, phi);
        let wanted = ggx.albedo(v, 64);
        let factor =
            multiscatter_compensation(Vec3::ONE, v.as_vec3(), ggx.alpha_t as f32, ggx.alpha_b as f32).x;
        let error = f64::from(factor.recip()) - wanted;
        sum += error * error;
        if error.abs() > worst.0 {
            worst = (error.abs(), format!("wanted {wanted}, error {error} at n·v {n_v}, phi {phi}, {ggx:?}"));
        }
    }
    let rms = (sum / count as f64).sqrt();
    assert!(rms < 0.020, "RMS error of E: wanted below 0.020, got {rms}");
    assert!(worst.0 < 0.33, "worst error of E: {}", worst.1);
}

/// The pair and view with the largest error there is, which random ones may miss; the mean of both squares has 0.352.
#[test]
fn the_worst_error_of_anisotropic_compensation_is_not_the_stated_one() {
    let ggx = Ggx { alpha_t: 1.0, alpha_b: 0.05 };
    let mut worst = 0.0_f64;
    for n_v in [0.02, 0.05, 0.1, 0.2] {
        for step in 0..=8 {
            let v = view(n_v, f64::from(step) / 32.0 * TAU);
            let factor = multiscatter_compensation(Vec3::ONE, v.as_vec3(), 1.0, 0.05).x;
            worst = worst.max((f64::from(factor.recip()) - ggx.albedo(v, 96)).abs());
        }
    }
    assert!((0.31..0.33).contains(&worst), "wanted 0.32, got {worst}");
}

#[test]
fn compensation_leaves_black_facets_black_and_never_darkens() {
    for n_v in [0.0, 0.01, 0.5, 1.0] {
        for alphas in [(0.004, 0.004), (1.0, 0.004), (1.0, 1.0)] {
            let v = view(n_v, 1.0).as_vec3();
            let factor = multiscatter_compensation(Vec3::new(0.0, 0.5, 1.0), v, alphas.0, alphas.1);
            assert_eq!(factor.x, 1.0, "f0 = 0 at n·v {n_v}, alphas {alphas:?}");
            assert!(
                1.0 <= factor.y && factor.y <= factor.z && factor.z <= 1.0 / 0.3,
                "got {factor} at n·v {n_v}, alphas {alphas:?}"
            );
        }
    }
}

#[test]
fn the_share_that_leaves_at_once_is_what_masking_lets_pass() {
    // E is the mean of G2/G1 over visible normals, so never above one: a check of the reference itself.
    for alpha in [0.1, 0.5, 1.0] {
        for n_v in [0.05, 0.5, 1.0] {
            let ggx = Ggx { alpha_t: alpha, alpha_b: alpha };
            let v = view(n_v, 0.0);
            let e = ggx.albedo(v, 96);
            let g1 = f64::from(smith_aniso_g1(v.as_vec3(), alpha as f32, alpha as f32));
            assert!((ggx.g1(v) - g1).abs() < 1e-6 && e <= 1.0, "E = {e}, G1 = {g1} at {n_v}, {alpha}");
        }
    }
}

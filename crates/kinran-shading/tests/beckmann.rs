//! Beckmann's distribution and LEAN's moments against integrals and closed forms.

mod common;

use common::{cases, visible_normals};
use glam::{DVec2, DVec3, Vec2, vec2, vec3};
use kinran_shading::{
    LeanMoments, Sym2, alpha_from_sigma, beckmann_aniso_d, normal_from_slope, sigma_from_alpha,
    slope_from_normal,
};

#[test]
fn d_covers_the_unit_area_it_projects_to() {
    for (sigma_t, sigma_b) in [(0.7, 0.7), (0.2, 0.2), (0.003, 0.003), (0.6, 0.05), (0.05, 0.6), (0.7, 0.003)]
    {
        // The nodes of a GGX lobe of the same width reach further than a Gaussian does.
        let got = visible_normals(DVec3::Z, sigma_t, sigma_b, 128)
            .into_iter()
            .map(|(h, solid_angle)| {
                f64::from(beckmann_aniso_d(h.as_vec3(), sigma_t as f32, sigma_b as f32)) * h.z * solid_angle
            })
            .sum::<f64>();
        assert!((got - 1.0).abs() < 2e-6, "∫ D n·h: wanted 1, got {got} for sigmas {sigma_t}, {sigma_b}");
    }
}

#[test]
fn slopes_have_the_stated_deviations() {
    let (sigma_t, sigma_b) = (0.4, 0.1);
    let (mut t, mut b) = (0.0, 0.0);
    for (h, solid_angle) in visible_normals(DVec3::Z, sigma_t, sigma_b, 128) {
        let weight =
            f64::from(beckmann_aniso_d(h.as_vec3(), sigma_t as f32, sigma_b as f32)) * h.z * solid_angle;
        t += (h.x / h.z).powi(2) * weight;
        b += (h.y / h.z).powi(2) * weight;
    }
    let (t, b) = (t.sqrt(), b.sqrt());
    assert!((t / sigma_t - 1.0).abs() < 1e-5, "along x: wanted {sigma_t}, got {t}");
    assert!((b / sigma_b - 1.0).abs() < 1e-5, "along y: wanted {sigma_b}, got {b}");
}

#[test]
fn d_vanishes_at_the_horizon_without_dividing_zero_by_zero() {
    for z in [1e-2, 1e-4, 1e-6, 1e-8, 1e-12, 1e-20, f32::MIN_POSITIVE, 0.0, -1e-6, -1.0] {
        for sigma in [0.003, 0.1, 0.71] {
            let h = vec3((1.0 - z * z).max(0.0).sqrt(), 0.0, z);
            let d = beckmann_aniso_d(h, sigma, sigma);
            assert_eq!(d, 0.0, "at n·h = {z:e}, sigma {sigma}");
        }
    }
}

#[test]
fn sigma_and_alpha_are_inverses_and_differ_by_root_two() {
    for alpha in [0.0, 0.004, 0.3, 1.0] {
        let sigma = sigma_from_alpha(alpha);
        assert!(
            (f64::from(sigma) * std::f64::consts::SQRT_2 - f64::from(alpha)).abs() < 1e-7,
            "alpha {alpha}"
        );
        assert!((alpha_from_sigma(sigma) - alpha).abs() < 1.2e-7, "alpha {alpha}");
    }
}

#[test]
fn averaged_moments_are_those_of_the_mixture() {
    for mut rng in cases(1, 2000) {
        // Two Gaussians of slopes with weights w and 1 - w.
        let w = rng.unit();
        let mut one = || {
            let mean = rng.axis() * rng.range(0.0, 0.8);
            let axis = rng.axis();
            let (l1, l2) = (rng.range(0.001, 0.5), rng.range(0.001, 0.5));
            let covariance = Sym2::from_eigen(l1.max(l2) as f32, l1.min(l2) as f32, axis.as_vec2());
            (mean, covariance)
        };
        let ((m1, c1), (m2, c2)) = (one(), one());
        let p = LeanMoments::from_gaussian(m1.as_vec2(), c1);
        let q = LeanMoments::from_gaussian(m2.as_vec2(), c2);
        let w32 = w as f32;
        let mixed = LeanMoments {
            mean: p.mean * w32 + q.mean * (1.0 - w32),
            second: p.second * w32 + q.second * (1.0 - w32),
        };

        // Law of total variance: the mean of covariances plus the covariance of means.
        let d = m1 - m2;
        let wanted =
            |a: f32, b: f32, dd: f64| w * f64::from(a) + (1.0 - w) * f64::from(b) + w * (1.0 - w) * dd;
        let (xx, xy, yy) = (
            wanted(c1.xx, c2.xx, d.x * d.x),
            wanted(c1.xy, c2.xy, d.x * d.y),
            wanted(c1.yy, c2.yy, d.y * d.y),
        );
        let got = mixed.covariance();
        let error = (f64::from(got.xx) - xx)
            .abs()
            .max((f64::from(got.xy) - xy).abs())
            .max((f64::from(got.yy) - yy).abs());
        assert!(error < 4e-7, "wanted {xx} {xy} {yy}, got {got:?} for w {w}, {m1} {c1:?}, {m2} {c2:?}");
        let mean: DVec2 = m1 * w + m2 * (1.0 - w);
        assert!((mixed.mean.as_dvec2() - mean).length() < 2e-7, "wanted {mean}, got {}", mixed.mean);
    }
}

#[test]
fn slope_and_normal_are_inverses() {
    for mut rng in cases(2, 10_000) {
        let slope = (rng.axis() * 10_f64.powf(rng.range(-4.0, 2.0))).as_vec2();
        let n = normal_from_slope(slope);
        assert!(n.is_normalized() && n.z > 0.0, "got {n} for {slope}");
        let back = slope_from_normal(n);
        assert!((back - slope).length() < 4e-7 * slope.length(), "wanted {slope}, got {back}");
    }
    assert_eq!(slope_from_normal(normal_from_slope(Vec2::ZERO)), Vec2::ZERO, "flat stays flat");
    assert!(normal_from_slope(vec2(1.0, 0.0)).x > 0.0, "a slope leans to where its normal does");
}

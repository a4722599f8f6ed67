//! The GGX lobe against its textbook form in double precision, quadrature and statistics.

mod common;

use common::chi_squared::chi_squared_test;
use common::{Ggx, Rng, cases, gauss_legendre, reflect, sphere, view, visible_normals};
use glam::{DMat2, DMat3, DVec2, DVec3, Vec2, Vec3, dvec2, dvec3};
use kinran_shading::{
    ALPHA_MIN, Sym2, aniso_from_alphas, ggx_aniso_d, ggx_d, ggx_matrix_d, ggx_vndf_pdf, ggx_vndf_sample,
    schlick_f, smith_aniso_g1, smith_aniso_v, smith_matrix_v, smith_v,
};
use std::f64::consts::{PI, TAU};

/// Pairs of alphas from mirror to chalk, round and stretched.
const ALPHAS: [(f32, f32); 10] = [
    (1.0, 1.0),
    (0.5, 0.5),
    (0.1, 0.1),
    (0.02, 0.02),
    (ALPHA_MIN, ALPHA_MIN),
    (0.9, 0.3),
    (0.29, 0.04),
    (0.87, 0.04),
    (0.04, 0.87),
    (1.0, ALPHA_MIN),
];

/// Cosines of views from the normal to grazing, where the last is 0.06° above the horizon.
const VIEW_COSINES: [f64; 5] = [1.0, 0.8, 0.3, 0.05, 0.001];

fn lobe((alpha_t, alpha_b): (f32, f32)) -> Ggx {
    Ggx { alpha_t: alpha_t.into(), alpha_b: alpha_b.into() }
}

/// A microfacet normal the lobe makes often: uniform in its own hemisphere, stretched.
fn microfacet(rng: &mut Rng, ggx: Ggx) -> Vec3 {
    let std = rng.direction(0.01, 1.0);
    dvec3(std.x * ggx.alpha_t, std.y * ggx.alpha_b, std.z).normalize().as_vec3()
}

fn assert_close(what: &str, got: f32, wanted: f64, relative: f64, input: impl std::fmt::Debug) {
    let error = (f64::from(got) / wanted - 1.0).abs();
    assert!(
        error <= relative,
        "{what}: wanted {wanted:e}, got {got:e}, relative error {error:.1e} for {input:?}"
    );
}

#[test]
fn d_has_the_textbook_value_down_to_the_smallest_alpha() {
    for alphas in ALPHAS {
        let ggx = lobe(alphas);
        for mut rng in cases(1, 2000) {
            let h = microfacet(&mut rng, ggx);
            let wanted = ggx.d(h.as_dvec3());
            assert_close("ggx_aniso_d", ggx_aniso_d(h, alphas.0, alphas.1), wanted, 2e-6, (h, alphas));

            // The SGGX form, 1 / (π sqrt|S| (h^T S^-1 h)²).
            let s = DMat3::from_diagonal(dvec3(ggx.alpha_t.powi(2), ggx.alpha_b.powi(2), 1.0));
            let q = h.as_dvec3().dot(s.inverse() * h.as_dvec3());
            let sggx = 1.0 / (PI * s.determinant().sqrt() * q * q);
            assert_close("SGGX form", ggx_aniso_d(h, alphas.0, alphas.1), sggx, 2e-6, (h, alphas));
        }
    }
}

#[test]
fn isotropic_d_does_not_cancel_near_the_normal() {
    for alpha in [1.0, 0.3, 0.05, ALPHA_MIN] {
        for mut rng in cases(2, 2000) {
            // The truth for this very n_h; no vector has it exactly.
            let n_h = (1.0 - rng.range(0.0, 4.0) * f64::from(alpha * alpha)).clamp(0.0, 1.0) as f32;
            let (c, a2) = (f64::from(n_h), f64::from(alpha).powi(2));
            let wanted = a2 / (PI * (c * c * (a2 - 1.0) + 1.0).powi(2));
            assert_close("ggx_d", ggx_d(n_h, alpha), wanted, 1e-6, (n_h, alpha));
        }
    }
}

/// How many digits the determinant of a stretched matrix costs: `xx yy / |A|`.
fn cancellation(a: Sym2) -> f64 {
    f64::from(a.xx) * f64::from(a.yy) / dense2(a).determinant()
}

fn dense2(a: Sym2) -> DMat2 {
    DMat2::from_cols(dvec2(a.xx.into(), a.xy.into()), dvec2(a.xy.into(), a.yy.into()))
}

#[test]
fn matrix_forms_agree_with_the_same_matrix_in_double_precision() {
    for alphas in ALPHAS {
        for mut rng in cases(3, 2000) {
            let axis = rng.axis();
            let a = aniso_from_alphas(alphas.0, alphas.1, axis.as_vec2());
            let local = microfacet(&mut rng, lobe(alphas)).as_dvec3();
            let h = axis.rotate(local.truncate()).extend(local.z).as_vec3();
            let tolerance = 1e-6 * cancellation(a);

            let slope = h.as_dvec3().truncate();
            let q = slope.dot(dense2(a).inverse() * slope) + f64::from(h.z).powi(2);
            let wanted = 1.0 / (PI * dense2(a).determinant().sqrt() * q * q);
            assert_close("ggx_matrix_d", ggx_matrix_d(h, a), wanted, tolerance, (h, a));
        }
    }
}

#[test]
fn matrix_forms_agree_with_the_eigen_forms() {
    for alphas in ALPHAS {
        let ggx = lobe(alphas);
        for mut rng in cases(4, 2000) {
            let axis = rng.axis();
            let a = aniso_from_alphas(alphas.0, alphas.1, axis.as_vec2());
            let turn = |local: DVec3| axis.rotate(local.truncate()).extend(local.z).as_vec3();
            let h = microfacet(&mut rng, ggx).as_dvec3();
            // Rounding of A is relative to its larger eigenvalue.
            let tolerance = 4e-7 * f64::from(alphas.0.max(alphas.1) / alphas.0.min(alphas.1)).powi(2) + 2e-6;
            assert_close("D", ggx_matrix_d(turn(h), a), ggx.d(h), tolerance, (h, a));

            let (u, v) = (rng.direction(1e-3, 1.0), rng.direction(1e-3, 1.0));
            let wanted = ggx.g2(u, v) / (4.0 * u.z * v.z);
            assert_close("V", smith_matrix_v(turn(u), turn(v), a), wanted, 2e-5, (u, v, a));
        }
    }
}

#[test]
fn d_covers_the_unit_area_it_projects_to() {
    for alphas in ALPHAS {
        let got = visible_normals(DVec3::Z, alphas.0.into(), alphas.1.into(), 64)
            .into_iter()
            .map(|(h, solid_angle)| {
                f64::from(ggx_aniso_d(h.as_vec3(), alphas.0, alphas.1)) * h.z * solid_angle
            })
            .sum::<f64>();
        assert!((got - 1.0).abs() < 1e-6, "∫ D n·h: wanted 1, got {got} for alphas {alphas:?}");
    }
}

#[test]
fn smith_v_is_g2_over_four_cosines_up_to_grazing() {
    for alphas in ALPHAS {
        let ggx = lobe(alphas);
        for mut rng in cases(5, 2000) {
            let n_u = 10_f64.powf(rng.range(-4.0, 0.0));
            let n_v = 10_f64.powf(rng.range(-4.0, 0.0));
            let (u, v) = (view(n_u, rng.range(0.0, TAU)), view(n_v, rng.range(0.0, TAU)));
            let (u, v) = (u.as_vec3(), v.as_vec3());
            let wanted = ggx.g2(u.into(), v.into()) / (4.0 * f64::from(u.z) * f64::from(v.z));
            assert_close(
                "smith_aniso_v",
                smith_aniso_v(u, v, alphas.0, alphas.1),
                wanted,
                2e-6,
                (u, v, alphas),
            );
            let wanted = ggx.g1(v.into());
            assert_close("smith_aniso_g1", smith_aniso_g1(v, alphas.0, alphas.1), wanted, 2e-6, (v, alphas));

            if alphas.0 == alphas.1 {
                // The isotropic form knows the cosines alone: take the directions from them.
                let (u, v) = (view(u.z.into(), 0.0), view(v.z.into(), 0.0));
                let wanted = ggx.g2(u, v) / (4.0 * u.z * v.z);
                let got = smith_v(u.z as f32, v.z as f32, alphas.0);
                assert_close("smith_v", got, wanted, 2e-6, (u.z, v.z, alphas.0));
            }
        }
    }
}

#[test]
fn masking_leaves_exactly_the_visible_area() {
    for alphas in ALPHAS {
        for n_v in VIEW_COSINES {
            for phi in [0.0, 0.7, 1.57] {
                let v = view(n_v, phi);
                let (mut area, mut furnace) = (0.0, 0.0);
                for (h, solid_angle) in visible_normals(v, alphas.0.into(), alphas.1.into(), 96) {
                    let d = ggx_aniso_d(h.as_vec3(), alphas.0, alphas.1);
                    area += f64::from(d) * v.dot(h) * solid_angle;
                    let pdf = ggx_vndf_pdf(v.as_vec3(), h.as_vec3(), alphas.0, alphas.1);
                    furnace += f64::from(pdf) * solid_angle;
                }
                let wanted = n_v / f64::from(smith_aniso_g1(v.as_vec3(), alphas.0, alphas.1));
                assert!(
                    (area / wanted - 1.0).abs() < 1e-6,
                    "∫ D v·h: wanted n·v / G1 = {wanted}, got {area} for n·v {n_v}, phi {phi}, alphas {alphas:?}"
                );
                assert!(
                    (furnace - 1.0).abs() < 5e-6,
                    "∫ VNDF: wanted 1, got {furnace} for n·v {n_v}, phi {phi}, alphas {alphas:?}"
                );
            }
        }
    }
}

#[test]
fn the_lobe_is_reciprocal() {
    for alphas in ALPHAS {
        for mut rng in cases(6, 2000) {
            let (u, v) = (rng.direction(0.001, 1.0).as_vec3(), rng.direction(0.001, 1.0).as_vec3());
            let a = aniso_from_alphas(alphas.0, alphas.1, rng.axis().as_vec2());
            let f0 = Vec3::new(0.04, 0.5, 1.0);
            let value = |u: Vec3, v: Vec3| {
                let h = (u + v).normalize();
                let aniso = ggx_aniso_d(h, alphas.0, alphas.1) * smith_aniso_v(u, v, alphas.0, alphas.1);
                let matrix = ggx_matrix_d(h, a) * smith_matrix_v(u, v, a);
                let round = ggx_d(h.z, alphas.0) * smith_v(u.z, v.z, alphas.0);
                [aniso, matrix, round].map(|f| schlick_f(f0, v.dot(h)) * f)
            };
            for (name, (there, back)) in
                ["aniso", "matrix", "isotropic"].into_iter().zip(value(u, v).into_iter().zip(value(v, u)))
            {
                // V sums the same two terms in the other order; F sees v·h for u·h.
                let worst = ((there - back).abs() / there).max_element();
                assert!(worst < 2e-5, "{name}: f(u, v) = {there}, f(v, u) = {back} for {u}, {v}, {alphas:?}");
            }
        }
    }
}

/// A cell of the chi-squared test: cosine and azimuth of the microfacet normal after the stretch is undone,
/// where every lobe fills the hemisphere.
const COSINES: usize = 16;
const AZIMUTHS: usize = 32;

fn cell_of(h: Vec3, ggx: Ggx) -> usize {
    let h = h.as_dvec3();
    let std = dvec3(h.x / ggx.alpha_t, h.y / ggx.alpha_b, h.z).normalize();
    let row = (std.z * COSINES as f64) as usize;
    let column = ((std.y.atan2(std.x) / TAU).rem_euclid(1.0) * AZIMUTHS as f64) as usize;
    row.min(COSINES - 1) * AZIMUTHS + column.min(AZIMUTHS - 1)
}

/// Integrals of `pdf` over the cells.
fn cell_integrals(ggx: Ggx, pdf: impl Fn(Vec3) -> f32) -> Vec<f64> {
    let mut cells = Vec::with_capacity(COSINES * AZIMUTHS);
    for row in 0..COSINES {
        let cosines = gauss_legendre(12, row as f64 / COSINES as f64, (row + 1) as f64 / COSINES as f64);
        for column in 0..AZIMUTHS {
            let step = TAU / AZIMUTHS as f64;
            let azimuths = gauss_legendre(12, column as f64 * step, (column + 1) as f64 * step);
            let mut sum = 0.0;
            for &(z, dz) in &cosines {
                for &(phi, dphi) in &azimuths {
                    let slope = DVec2::from_angle(phi) * (1.0 - z * z).sqrt() / z;
                    let h = dvec3(ggx.alpha_t * slope.x, ggx.alpha_b * slope.y, 1.0).normalize();
                    let stretch = ggx.alpha_t * ggx.alpha_b * (h.z / z).powi(3);
                    sum += f64::from(pdf(h.as_vec3())) * stretch * dz * dphi;
                }
            }
            cells.push(sum);
        }
    }
    cells
}

#[test]
fn vndf_samples_follow_their_density() {
    let samples = 1 << 17;
    let family = (ALPHAS.len() * VIEW_COSINES.len()) as u32;
    let mut failures = String::new();
    for (i, alphas) in ALPHAS.into_iter().enumerate() {
        let ggx = lobe(alphas);
        for (j, n_v) in VIEW_COSINES.into_iter().enumerate() {
            let v = view(n_v, 0.6).as_vec3();
            let mut rng = Rng::new((i * VIEW_COSINES.len() + j) as u64);
            let mut observed = vec![0; COSINES * AZIMUTHS];
            for _ in 0..samples {
                let xi = Vec2::new(rng.unit_f32(), rng.unit_f32());
                observed[cell_of(ggx_vndf_sample(v, alphas.0, alphas.1, xi), ggx)] += 1;
            }
            let mut expected = cell_integrals(ggx, |h| ggx_vndf_pdf(v, h, alphas.0, alphas.1));
            expected.iter_mut().for_each(|e| *e *= f64::from(samples));
            if let Err(report) = chi_squared_test(&observed, &expected, family) {
                failures += &format!("alphas {alphas:?}, n·v {n_v}: {report}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn the_chi_squared_test_notices_an_alpha_that_is_off_by_two_percent() {
    let ggx = lobe((0.5, 0.2));
    let v = view(0.4, 0.6).as_vec3();
    let mut rng = Rng::new(7);
    let mut observed = vec![0; COSINES * AZIMUTHS];
    let samples = 1 << 19;
    for _ in 0..samples {
        let xi = Vec2::new(rng.unit_f32(), rng.unit_f32());
        observed[cell_of(ggx_vndf_sample(v, 0.51, 0.2, xi), ggx)] += 1;
    }
    let mut expected = cell_integrals(ggx, |h| ggx_vndf_pdf(v, h, 0.5, 0.2));
    expected.iter_mut().for_each(|e| *e *= f64::from(samples));
    let report = chi_squared_test(&observed, &expected, 50).expect_err("the sampler has another alpha");
    assert!(report.contains("expected"), "the report has a table: {report}");
}

#[test]
fn vndf_sampler_survives_the_rim_of_its_cap() {
    let last = 1.0 - f32::EPSILON / 2.0;
    for alphas in ALPHAS {
        for n_v in VIEW_COSINES {
            let v = view(n_v, 0.6).as_vec3();
            for k in 0..4096 {
                for xi_y in [0.0, 0.5, last] {
                    let xi = Vec2::new(k as f32 / 4096.0, xi_y);
                    let h = ggx_vndf_sample(v, alphas.0, alphas.1, xi);
                    assert!(
                        h.is_normalized() && h.z >= 0.0,
                        "wanted a unit vector of the upper hemisphere, got {h} for {v}, {alphas:?}, {xi}"
                    );
                }
            }
        }
    }
}

#[test]
fn reflected_samples_lose_only_what_goes_below_the_horizon() {
    for alphas in [(1.0, 1.0), (0.5, 0.5), (0.9, 0.3), (0.3, 0.9)] {
        for n_v in [1.0, 0.6, 0.15] {
            let v = view(n_v, 0.6);
            // Over lights of the upper hemisphere.
            let over_lights = sphere(DVec3::Z, 128)
                .into_iter()
                .filter(|(u, _)| u.z > 0.0)
                .map(|(u, solid_angle)| {
                    let h = (u + v).normalize();
                    let pdf = ggx_vndf_pdf(v.as_vec3(), h.as_vec3(), alphas.0, alphas.1);
                    f64::from(pdf) / (4.0 * v.dot(h)) * solid_angle
                })
                .sum::<f64>();
            // Over microfacets whose reflection is there.
            let ggx = lobe(alphas);
            let over_facets = visible_normals(v, ggx.alpha_t, ggx.alpha_b, 256)
                .into_iter()
                .filter(|&(h, _)| reflect(v, h).z > 0.0)
                .map(|(h, solid_angle)| ggx.d(h) * v.dot(h) * ggx.g1(v) / v.z * solid_angle)
                .sum::<f64>();
            assert!(
                over_lights <= 1.0 + 1e-4 && (over_lights - over_facets).abs() < 2e-3,
                "wanted {over_facets} and at most 1, got {over_lights} for n·v {n_v}, alphas {alphas:?}"
            );
        }
    }
}

#[test]
fn schlick_runs_from_f0_to_one_and_never_leaves_them() {
    let f0 = Vec3::new(0.0, 0.04, 1.0);
    assert_eq!(schlick_f(f0, 1.0), f0, "at normal incidence");
    assert_eq!(schlick_f(f0, 0.0), Vec3::ONE, "at grazing");
    let mut previous = Vec3::ONE;
    for k in 0..=1000 {
        // A little outside [0, 1], as dot products are.
        let v_h = -1e-6 + k as f32 * (1.0 + 2e-6) / 1000.0;
        let f = schlick_f(f0, v_h);
        assert!(
            f.cmple(previous).all() && f.cmpge(f0).all(),
            "wanted {f0} <= F <= {previous}, got {f} at {v_h}"
        );
        let wanted = 0.04 + 0.96 * (1.0 - f64::from(v_h.clamp(0.0, 1.0))).powi(5);
        assert!((f64::from(f.y) - wanted).abs() < 4e-7, "wanted {wanted}, got {} at {v_h}", f.y);
        previous = f;
    }
}

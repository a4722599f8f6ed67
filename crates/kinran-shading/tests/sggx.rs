//! SGGX matrices: construction, projected area, slopes, and the way back to a normal and its roughness.

mod common;

use common::{Ggx, MATERIALS, Material, Rng, cases, degrees_between, dense, jacobi_eigen, sphere, view};
use glam::{DMat2, DMat3, DQuat, DVec2, DVec3, Vec2, Vec3, dvec2, dvec3};
use kinran_shading::{
    Sym2, Sym3, UNIT_SLOPES, aniso_from_alphas, ggx_aniso_d, ggx_from_sggx, ggx_from_sggx_unclamped, m_n,
    microfacet_basis, sggx_d, sggx_from_ggx, sggx_from_slopes, sggx_power_iteration, sggx_principal_axis,
    sggx_projected_area, slopes_from_sggx,
};
use std::f64::consts::{PI, TAU};

/// `M A M^T` with a rotation that owes nothing to the code under test.
fn exact_sggx(n: Vec3, a: Sym2) -> DMat3 {
    let m = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, n.as_dvec3().normalize()));
    let (xx, xy, yy) = (f64::from(a.xx), f64::from(a.xy), f64::from(a.yy));
    let a = DMat3::from_cols(dvec3(xx, xy, 0.0), dvec3(xy, yy, 0.0), DVec3::Z);
    m * a * m.transpose()
}

fn max_abs(m: DMat3) -> f64 {
    m.to_cols_array().into_iter().fold(0.0, |worst, e| worst.max(e.abs()))
}

/// The single-precision matrix nearest to a double-precision one.
fn rounded(m: DMat3) -> Sym3 {
    let (x, y, z) = (m.x_axis.as_vec3(), m.y_axis.as_vec3(), m.z_axis.as_vec3());
    Sym3 { xx: x.x, xy: x.y, xz: x.z, yy: y.y, yz: y.z, zz: z.z }
}

/// A random surface: tilt below `max_tilt`, both alphas in [lo, hi].
fn surface(rng: &mut Rng, max_tilt: f64, lo: f64, hi: f64) -> (Vec3, Sym2, [f64; 2]) {
    let n = rng.direction(max_tilt.to_radians().cos(), 1.0).as_vec3();
    let (a, b) = (rng.range(lo, hi), rng.range(lo, hi));
    (n, aniso_from_alphas(a.max(b) as f32, a.min(b) as f32, rng.axis().as_vec2()), [a.max(b), a.min(b)])
}

/// Principal alphas, larger first, in double precision.
fn alphas(a: Sym2) -> [f64; 2] {
    let (xx, xy, yy) = (f64::from(a.xx), f64::from(a.xy), f64::from(a.yy));
    let radius = f64::hypot(0.5 * (xx - yy), xy);
    [0.5 * (xx + yy) + radius, 0.5 * (xx + yy) - radius].map(|l| l.max(0.0).sqrt())
}

#[test]
fn construction_is_the_rotated_matrix() {
    for mut rng in cases(1, 20_000) {
        let (n, a, _) = surface(&mut rng, 90.0, 0.004, 1.0);
        let error = max_abs(dense(sggx_from_ggx(n, a)) - exact_sggx(n, a));
        assert!(error < 4e-7, "error {error:.1e} for n {n}, A {a:?}");
    }
}

#[test]
fn microflakes_project_to_the_stated_area() {
    for mut rng in cases(2, 12) {
        let (n, a, _) = surface(&mut rng, 60.0, 0.3, 1.0);
        let s = sggx_from_ggx(n, a);
        let w = rng.direction(-1.0, 1.0);
        let got = sphere(w, 96)
            .into_iter()
            .map(|(h, solid_angle)| f64::from(sggx_d(s, h.as_vec3())) * w.dot(h).max(0.0) * solid_angle)
            .sum::<f64>();
        let wanted = f64::from(sggx_projected_area(s, w.as_vec3()));
        assert!((wanted - w.dot(dense(s) * w).sqrt()).abs() < 1e-6, "sqrt(w^T S w) for {w}, {s:?}");
        assert!((got - wanted).abs() < 1e-4, "∫ max(w·h, 0) D: wanted {wanted}, got {got} for {w}, {s:?}");
    }
}

#[test]
fn a_tilted_matrix_has_the_ggx_lobe_of_its_surface() {
    for mut rng in cases(3, 20_000) {
        let (n, a, [alpha_t, alpha_b]) = surface(&mut rng, 80.0, 0.02, 1.0);
        let s = sggx_from_ggx(n, a);
        // A normal the lobe makes often, in the frame of the surface and then in space.
        let std = rng.direction(0.1, 1.0);
        let slope = a.sqrt();
        let local = Vec3::new(
            slope.xx * std.x as f32 + slope.xy * std.y as f32,
            slope.xy * std.x as f32 + slope.yy * std.y as f32,
            std.z as f32,
        )
        .normalize();
        let h = (m_n(n) * local).normalize();
        let (_, _, axis) = a.eigen();
        let along = Vec2::new(axis.dot(local.truncate()), axis.perp_dot(local.truncate())).extend(local.z);
        let wanted = Ggx { alpha_t, alpha_b }.d(along.as_dvec3());
        let got = f64::from(sggx_d(s, h));
        let tolerance = 1e-5 / (alpha_b * alpha_b);
        assert!(
            (got / wanted - 1.0).abs() < tolerance,
            "wanted {wanted}, got {got} for n {n}, A {a:?}, h {h}"
        );
    }
}

#[test]
fn an_upright_matrix_is_the_ggx_lobe() {
    for mut rng in cases(4, 20_000) {
        let (a, b) = (rng.range(0.1, 1.0) as f32, rng.range(0.1, 1.0) as f32);
        let s = Sym3 { xx: a * a, yy: b * b, zz: 1.0, ..Sym3::default() };
        let h = rng.direction(0.0, 1.0).as_vec3();
        let (wanted, got) = (ggx_aniso_d(h, a, b), sggx_d(s, h));
        assert!((got / wanted - 1.0).abs() < 3e-6, "wanted {wanted}, got {got} for alphas {a} {b}, h {h}");
    }
}

#[test]
fn slopes_and_matrix_are_inverses() {
    for mut rng in cases(5, 20_000) {
        let m = (rng.axis() * rng.range(0.0, 2.0)).as_vec2();
        let a =
            aniso_from_alphas(rng.range(0.05, 1.0) as f32, rng.range(0.05, 1.0) as f32, rng.axis().as_vec2());
        // Any scale: it drops out.
        let (got_m, got_a) = slopes_from_sggx(sggx_from_slopes(m, a) * rng.range(0.1, 10.0) as f32);
        let error = [got_a.xx - a.xx, got_a.xy - a.xy, got_a.yy - a.yy]
            .into_iter()
            .fold(0.0, |w: f32, e| w.max(e.abs()));
        assert!((got_m - m).length() < 1e-6 && error < 3e-6, "wanted {m} {a:?}, got {got_m} {got_a:?}");
    }
}

#[test]
fn slopes_of_an_sggx_lobe_are_student_t_with_two_degrees_of_freedom() {
    for mut rng in cases(6, 20_000) {
        let (n, a, _) = surface(&mut rng, 40.0, 0.2, 1.0);
        let s = sggx_from_ggx(n, a);
        // The claim, in double precision.
        let (m, a) = slopes_from_sggx(s);
        let a = DMat2::from_cols(dvec2(a.xx.into(), a.xy.into()), dvec2(a.xy.into(), a.yy.into()));
        let slope = m.as_dvec2() + rng.axis() * rng.range(0.0, 3.0);
        let offset = slope - m.as_dvec2();
        let q = offset.dot(a.inverse() * offset);
        let wanted = 1.0 / (PI * a.determinant().sqrt() * (1.0 + q).powi(2));
        // D n·h dω in slopes, of which dω = (n·h)³ ds. The share that faces up projects to sqrt(S_zz).
        let h = slope.extend(1.0).normalize();
        let got = f64::from(sggx_d(s, h.as_vec3())) * h.z.powi(4) / f64::from(s.zz).sqrt();
        assert!((got / wanted - 1.0).abs() < 3e-4, "wanted {wanted}, got {got} at {slope} for {s:?}");
    }
}

#[test]
fn unit_slopes_are_quantiles_of_the_unit_lobe() {
    let (mut mean, mut fixed_point) = (DVec2::ZERO, DMat2::ZERO);
    for (i, slope) in UNIT_SLOPES.into_iter().enumerate() {
        let slope = slope.as_dvec2();
        let r2 = slope.length_squared();
        // Share of the lobe within the radius: ∫ 2r / (1 + r²)² dr.
        let wanted = ((i / 4) as f64 + 0.5) / 4.0;
        assert!(
            (r2 / (1.0 + r2) - wanted).abs() < 1e-7,
            "point {i}: wanted {wanted}, got {}",
            r2 / (1.0 + r2)
        );
        mean += slope / 16.0;
        // Kent and Tyler's equation of the maximum-likelihood scatter: A = 4 mean(s s^T / (1 + q)).
        fixed_point += DMat2::from_cols(slope * slope.x, slope * slope.y) * (4.0 / (16.0 * (1.0 + r2)));
    }
    assert!(mean.length() < 1e-7, "mean slope: wanted 0, got {mean}");
    let error =
        (fixed_point - DMat2::IDENTITY).to_cols_array().into_iter().fold(0.0, |w: f64, e| w.max(e.abs()));
    assert!(error < 2e-7, "the fit to a constant footprint: wanted the identity, got {fixed_point}");
}

#[test]
fn microfacet_basis_is_a_root_of_the_matrix() {
    for mut rng in cases(7, 20_000) {
        let (n, a, _) = surface(&mut rng, 90.0, 0.004, 1.0);
        let sum = microfacet_basis(n, a).into_iter().fold(Sym3::default(), |sum, v| sum + Sym3::outer(v));
        let error = max_abs(dense(sum) - exact_sggx(n, a));
        assert!(error < 6e-7, "X X^T + Y Y^T + n n^T: error {error:.1e} for n {n}, A {a:?}");
    }
}

#[test]
fn extraction_gives_back_what_went_in() {
    for (lo, hi) in [(0.02, 0.95), (0.9, 0.95), (0.004, 0.02)] {
        for mut rng in cases(8, 10_000) {
            let (n, a, wanted) = surface(&mut rng, 80.0, lo, hi);
            let s = sggx_from_ggx(n, a);
            // From the normal itself, and from a mean normal 20° off.
            let side = n.any_orthonormal_vector();
            for start in [n, n * 0.94 + side * 0.342] {
                let (got_n, got_a) = ggx_from_sggx(s, start);
                // Rounding of S, 1e-7, turns n by itself over the gap of eigenvalues.
                let error = degrees_between(got_n.into(), n.into());
                let limit = f64::to_degrees(3e-7 / (1.0 - wanted[0] * wanted[0]));
                assert!(error < limit, "n: wanted {n}, got {got_n}, {error:.1e}° for {a:?} from {start}");
                for (got, wanted) in alphas(got_a).into_iter().zip(wanted) {
                    let error = got * got - wanted * wanted;
                    assert!(
                        error.abs() < 8e-7,
                        "alpha: wanted {wanted}, got {got} for {n}, {a:?} from {start}"
                    );
                }
            }
        }
    }
}

#[test]
fn extraction_from_s_z_works_up_to_the_stated_tilt() {
    for alpha in [0.5_f32, 0.7, 0.95] {
        let limit = f64::from(alpha * alpha).recip().atan();
        for (factor, works) in [(0.5, true), (0.99, true), (1.01, false)] {
            let n = view((limit * factor).cos(), 0.3).as_vec3();
            let s = sggx_from_ggx(n, Sym2::scalar(alpha * alpha));
            let (got, _) = ggx_from_sggx(s, Vec3::new(s.xz, s.yz, s.zz).normalize());
            let error = degrees_between(got.into(), n.into());
            assert_eq!(
                error < 0.01,
                works,
                "{error}° off at {factor} of the limit {limit} rad, alpha {alpha}"
            );
        }
    }
}

#[test]
fn extraction_holds_tiny_alphas_to_the_rounding_of_the_matrix() {
    // alpha² = 1e-6 beside entries near one: 4e-7 of rounding is 20 % of alpha, and no more.
    for mut rng in cases(9, 10_000) {
        let n = rng.direction(0.2, 1.0).as_vec3();
        let (_, a) = ggx_from_sggx(sggx_from_ggx(n, Sym2::scalar(1e-6)), n);
        let [alpha_t, alpha_b] = alphas(a);
        assert!(
            (7e-4..1.3e-3).contains(&alpha_t) && (5e-4..1.3e-3).contains(&alpha_b),
            "wanted 1e-3, got {alpha_t:e} and {alpha_b:e} for {n}"
        );
    }
}

#[test]
fn a_rough_tilted_texel_survives_where_power_iteration_leaves_nine_degrees() {
    let tilt = f64::to_radians(20.0);
    let n = Vec3::new(tilt.sin() as f32, 0.0, tilt.cos() as f32);
    let a = aniso_from_alphas(0.95, 0.3, Vec2::X);
    let s = sggx_from_ggx(n, a);
    let left = degrees_between(sggx_power_iteration(s, Vec3::Z, 8).into(), n.into());
    assert!((left - 9.1).abs() < 0.05, "power iteration: wanted 9.1°, got {left}°");
    let (got, got_a) = ggx_from_sggx(s, Vec3::Z);
    let error = degrees_between(got.into(), n.into());
    assert!(error < 2e-4, "wanted {n}, got {got}, {error}° off");
    assert!((got_a.xx - a.xx).abs() < 1e-6 && (got_a.yy - a.yy).abs() < 1e-6, "wanted {a:?}, got {got_a:?}");
}

#[test]
fn power_iteration_takes_the_stated_number_of_steps() {
    for (ratio, steps) in [(0.25, 4), (0.5, 8), (0.75, 19), (0.9, 51), (0.95, 105), (0.99, 532)] {
        let s = Sym3 { xx: ratio, yy: 0.1, zz: 1.0, ..Sym3::default() };
        let start = view(f64::to_radians(20.0).cos(), 0.0).as_vec3();
        let error = |steps| degrees_between(sggx_power_iteration(s, start, steps).into(), DVec3::Z);
        assert!(
            error(steps) < 0.101 && error(steps - 1) > 0.099,
            "λ2/λ1 = {ratio}: wanted 0.1° first after {steps} steps, got {}° and {}° one earlier",
            error(steps),
            error(steps - 1)
        );
    }
}

#[test]
fn power_iteration_converges_as_the_ratio_of_eigenvalues_tells() {
    for material in MATERIALS {
        for mut rng in cases(10, 400) {
            let (s, _) = material.footprint(&mut rng);
            let [(l1, v1), (l2, _), _] = jacobi_eigen(dense(s));
            let tan = |n: Vec3| v1.cross(n.as_dvec3()).length() / v1.dot(n.as_dvec3()).abs();
            for steps in [4, 8, 16, 32] {
                let got = tan(sggx_power_iteration(s, Vec3::Z, steps));
                let limit = tan(Vec3::Z) * (l2 / l1).powi(steps as i32);
                assert!(
                    got < 1.001 * limit + 1e-6,
                    "{}: wanted {limit}, got {got}, {steps} steps",
                    material.name
                );
            }
        }
    }
}

/// A V groove: facets tilted by ±`degrees` along x, the right one with the given weight.
fn groove(degrees: f64, weight: f32, alpha: f32) -> (Sym3, Vec3) {
    let (sin, cos) = (degrees.to_radians().sin() as f32, degrees.to_radians().cos() as f32);
    let (right, left) = (Vec3::new(sin, 0.0, cos), Vec3::new(-sin, 0.0, cos));
    let a = Sym2::scalar(alpha * alpha);
    let s = sggx_from_ggx(right, a) * weight + sggx_from_ggx(left, a) * (1.0 - weight);
    (s, (right * weight + left * (1.0 - weight)).normalize())
}

#[test]
fn a_groove_steeper_than_45_degrees_keeps_an_upright_normal_and_alpha_one() {
    let (s, mean) = groove(46.0, 0.52, 0.1);

    // The traps: the largest eigenvalue lies across the groove, and a few power steps hide it.
    let [(l1, top), ..] = jacobi_eigen(dense(s));
    assert!(degrees_between(top * top.x.signum(), dvec3(0.91, 0.0, 0.41)) < 0.5, "top eigenvector: {top}");
    let hidden = sggx_power_iteration(s, Vec3::Z, 8).as_dvec3();
    assert!(degrees_between(hidden, dvec3(0.37, 0.0, 0.93)) < 0.5, "8 power steps: {hidden}");

    let (n, a) = ggx_from_sggx(s, mean);
    assert!(degrees_between(n.into(), dvec3(-0.41, 0.0, 0.91)) < 0.5, "wanted (-0.41, 0, 0.91), got {n}");
    let (_, raw) = ggx_from_sggx_unclamped(s, mean);
    let wanted = l1 / n.as_dvec3().dot(dense(s) * n.as_dvec3());
    assert!((alphas(raw)[0].powi(2) - wanted).abs() < 1e-5, "before the clamp: wanted {wanted}, got {raw:?}");
    let [alpha_t, alpha_b] = alphas(a);
    assert!((alpha_t - 1.0).abs() < 1e-6, "wanted alpha 1 across the groove, got {alpha_t}");
    assert!((alpha_b - alphas(raw)[1]).abs() < 1e-6, "the other alpha stays: {alpha_b}");
}

#[test]
fn an_even_groove_stands_upright_at_any_angle() {
    for degrees in [5.0, 44.9, 45.1, 60.0, 80.0] {
        let (s, mean) = groove(degrees, 0.5, 0.2);
        let (n, a) = ggx_from_sggx(s, mean);
        assert!(degrees_between(n.into(), DVec3::Z) < 1e-3, "{degrees}°: wanted z, got {n}");
        assert!(alphas(a)[0] <= 1.0 + 1e-6, "{degrees}°: wanted alpha of at most 1, got {a:?}");
    }
}

#[test]
fn footprints_of_textures_get_their_true_eigenvector() {
    for material in MATERIALS {
        let mut worst = 0.0_f64;
        for mut rng in cases(11, 5000) {
            let (s, mean) = material.footprint(&mut rng);
            let start = mean.as_dvec3();
            let wanted = jacobi_eigen(dense(s))
                .into_iter()
                .map(|(_, v)| v * v.dot(start).signum())
                .max_by(|l, r| l.dot(start).total_cmp(&r.dot(start)))
                .expect("three eigenvectors");
            let got = sggx_principal_axis(s, mean);
            let error = degrees_between(got.into(), wanted);
            worst = worst.max(error);
            assert!(error < 2e-5, "{}: wanted {wanted}, got {got}, {error:.1e}° off", material.name);
        }
        assert!(worst > 0.0, "a comparison with itself?");
    }
}

/// Residual `|S n - (n^T S n) n|` over the trace, and by how much another eigenvector overlaps more with
/// `start`. Eigenvectors whose values differ by less than a thousandth of the trace count as one space.
fn extraction_errors(s: Sym3, start: Vec3) -> (f64, f64) {
    let n = sggx_principal_axis(s, start).as_dvec3();
    let (s, start) = (dense(s), start.as_dvec3());
    let pairs = jacobi_eigen(s);
    let trace = pairs.iter().map(|p| p.0).sum::<f64>();
    let best = pairs.iter().map(|p| p.1.dot(start).abs()).fold(0.0, f64::max);
    let close = pairs[0].0 - pairs[1].0 < 1e-3 * trace || pairs[1].0 - pairs[2].0 < 1e-3 * trace;
    let missing = if close { 0.0 } else { best - n.dot(start) };
    ((s * n - n * n.dot(s * n)).length() / trace, missing)
}

#[test]
fn the_largest_overlap_is_found_however_steep_the_normals_are() {
    for slope_deviation in [0.5, 1.0, 2.0, 4.0] {
        for texels in [2, 4, 16] {
            for alpha in [(0.001, 0.02), (0.1, 1.0), (0.8, 1.0)] {
                let material = Material { name: "steep", alpha, slope_deviation };
                for mut rng in cases(12, 1000) {
                    let (mut s, mut sum) = (Sym3::default(), Vec3::ZERO);
                    for _ in 0..texels {
                        let (n, a) = material.texel(&mut rng);
                        s = s + sggx_from_ggx(n, a) * (1.0 / texels as f32);
                        sum += n;
                    }
                    let start = sum.normalize();
                    let (residual, missing) = extraction_errors(s, start);
                    assert!(
                        residual < 5e-4 && missing < 3e-4,
                        "residual {residual:.1e}, overlap short of {missing:.1e} for {s:?} from {start}, {material:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn the_largest_overlap_is_found_for_any_matrix_and_any_start() {
    for mut rng in cases(13, 50_000) {
        let eigenvalues = dvec3(rng.unit(), rng.unit(), rng.unit());
        let turn = DMat3::from_quat(DQuat::from_axis_angle(rng.direction(-1.0, 1.0), rng.range(0.0, TAU)));
        let s = rounded(turn * DMat3::from_diagonal(eigenvalues) * turn.transpose());
        let start = rng.direction(-1.0, 1.0).as_vec3();
        let (residual, missing) = extraction_errors(s, start);
        assert!(
            residual < 5e-4 && missing < 1e-3,
            "residual {residual:.1e}, overlap short of {missing:.1e} for {s:?} from {start}"
        );
        let n = sggx_principal_axis(s, start);
        assert!(n.is_normalized() && n.dot(start) >= 0.0, "got {n} from {start}");
    }
}

#[test]
fn equal_eigenvalues_give_the_projection_of_the_start() {
    for mut rng in cases(14, 10_000) {
        // Two equal eigenvalues, larger or smaller than the third.
        let (pair, single) = (rng.range(0.1, 1.0), rng.range(0.1, 1.0));
        if (pair - single).abs() < 0.1 {
            continue;
        }
        let axis = rng.direction(-1.0, 1.0);
        let outer = DMat3::from_cols(axis * axis.x, axis * axis.y, axis * axis.z);
        let s = rounded(DMat3::IDENTITY * pair + outer * (single - pair));
        let start = rng.direction(-1.0, 1.0).as_vec3();
        let along = axis.dot(start.into());
        // Only where the decision is not a matter of rounding.
        if (along * along - 0.5).abs() < 1e-3 {
            continue;
        }
        let wanted = if along * along > 0.5 { axis * along } else { start.as_dvec3() - axis * along };
        let got = sggx_principal_axis(s, start);
        let error = degrees_between(got.into(), wanted);
        // Of the spread, 0.1 % counts as equal: that much of a radian.
        assert!(error < 0.06, "wanted {}, got {got}, {error}° off for {s:?}", wanted.normalize());
    }
}

#[test]
fn a_matrix_that_says_nothing_leaves_the_start() {
    for mut rng in cases(15, 1000) {
        let start = rng.direction(-1.0, 1.0).as_vec3();
        for scale in [0.0, 1e-30, 0.3, 1.0, 1e30] {
            assert_eq!(sggx_principal_axis(Sym3::scalar(scale), start), start, "scale {scale}");
        }
        // alpha = 1: S is the identity up to rounding, the normal is the texel's.
        let n = rng.direction(0.0, 1.0).as_vec3();
        let (got, a) = ggx_from_sggx(sggx_from_ggx(n, Sym2::scalar(1.0)), n);
        assert_eq!(got, n);
        assert!(
            (a.xx - 1.0).abs() < 5e-7 && a.xy.abs() < 5e-7 && (a.yy - 1.0).abs() < 5e-7,
            "got {a:?} for {n}"
        );
    }
}

#[test]
fn the_scale_of_the_matrix_drops_out() {
    for mut rng in cases(16, 2000) {
        let (s, mean) = MATERIALS[2].footprint(&mut rng);
        let (wanted_n, wanted_a) = ggx_from_sggx(s, mean);
        for power in [-60, -10, 10, 60] {
            let got = ggx_from_sggx(s * 2_f32.powi(power), mean);
            assert_eq!(got, (wanted_n, wanted_a), "times 2^{power}: {s:?} from {mean}");
        }
        let (n, a) = ggx_from_sggx(s * 0.3, mean);
        assert!(
            (n - wanted_n).length() < 1e-6 && (a.xx - wanted_a.xx).abs() < 1e-6,
            "times 0.3: wanted {wanted_n} {wanted_a:?}, got {n} {a:?}"
        );
    }
}

#[test]
fn extraction_never_flips_below_the_horizon() {
    for slope_deviation in [0.2, 1.0, 4.0, 20.0] {
        for texels in [1, 2, 4, 16] {
            let material = Material { name: "steep", alpha: (0.01, 1.0), slope_deviation };
            for mut rng in cases(17, 5000) {
                let (mut s, mut sum) = (Sym3::default(), Vec3::ZERO);
                for _ in 0..texels {
                    let (n, a) = material.texel(&mut rng);
                    s = s + sggx_from_ggx(n, a) * (1.0 / texels as f32);
                    sum += n;
                }
                let (n, a) = ggx_from_sggx(s, sum.normalize());
                assert!(n.z >= 0.0, "wanted z >= 0, got {n} for {s:?} from the mean {sum}");
                let (l1, l2, _) = a.eigen();
                assert!(
                    l1 <= 1.0 + 1e-6 && l2 >= 0.0 && a.det() > -1e-6,
                    "A outside [0, 1]: {a:?} for {s:?}"
                );
            }
        }
    }
}

//! Symmetric matrices against their definitions in double precision.

mod common;

use common::{Rng, cases, dense, jacobi_eigen};
use glam::{DMat2, DMat3, Mat3, Vec2, dvec2, vec2};
use kinran_shading::{Sym2, Sym3, aniso_from_alphas, m_n};

/// A random positive semi-definite matrix: eigenvalues from 1e-5 to 1, any axis.
fn positive(rng: &mut Rng) -> Sym2 {
    let (l1, l2) = (10_f64.powf(rng.range(-5.0, 0.0)) as f32, 10_f64.powf(rng.range(-5.0, 0.0)) as f32);
    Sym2::from_eigen(l1.max(l2), l1.min(l2), rng.axis().as_vec2())
}

fn dense2(a: Sym2) -> DMat2 {
    DMat2::from_cols(dvec2(a.xx.into(), a.xy.into()), dvec2(a.xy.into(), a.yy.into()))
}

fn max_abs2(m: DMat2) -> f64 {
    m.to_cols_array().into_iter().fold(0.0, |worst, e| worst.max(e.abs()))
}

fn any3(rng: &mut Rng) -> Sym3 {
    let mut e = || rng.range(-1.0, 1.0) as f32;
    Sym3 { xx: e(), xy: e(), xz: e(), yy: e(), yz: e(), zz: e() }
}

#[test]
fn eigenvalues_agree_with_double_precision() {
    for mut rng in cases(1, 50_000) {
        let a = positive(&mut rng);
        let (xx, xy, yy) = (f64::from(a.xx), f64::from(a.xy), f64::from(a.yy));
        let radius = f64::hypot(0.5 * (xx - yy), xy);
        let wanted = [0.5 * (xx + yy) + radius, 0.5 * (xx + yy) - radius];
        let (l1, l2, axis) = a.eigen();
        // The determinant loses 1e-7 of xx yy; no form that is given single-precision entries does better.
        let loss = 2e-7 * xx * yy / wanted[0];
        assert!(
            (f64::from(l1) / wanted[0] - 1.0).abs() < 3e-7,
            "l1: wanted {}, got {l1} for {a:?}",
            wanted[0]
        );
        assert!(
            (f64::from(l2) - wanted[1]).abs() < loss + 3e-7 * wanted[1].abs(),
            "l2: wanted {}, got {l2} for {a:?}",
            wanted[1]
        );
        assert!(
            axis.is_normalized() && axis.x >= 0.0,
            "wanted a unit vector with x >= 0, got {axis} for {a:?}"
        );

        // A v = l1 v, to the rounding of A.
        let v = axis.as_dvec2();
        let residual = (dense2(a) * v - v * wanted[0]).length();
        assert!(residual < 4e-7 * wanted[0], "residual {residual:.1e} of {axis} for {a:?}");
    }
}

#[test]
fn the_eigenvector_stays_unit_length_on_all_axes_and_signs_of_zero() {
    for (a, wanted) in [
        (Sym2 { xx: 0.5, xy: 0.0, yy: 0.1 }, Vec2::X),
        (Sym2 { xx: 0.5, xy: -0.0, yy: 0.1 }, Vec2::X),
        (Sym2 { xx: 0.1, xy: 0.0, yy: 0.5 }, Vec2::Y),
        (Sym2 { xx: 0.1, xy: -0.0, yy: 0.5 }, Vec2::Y),
        (Sym2 { xx: 0.3, xy: 0.1, yy: 0.3 }, vec2(1.0, 1.0).normalize()),
        (Sym2 { xx: 0.3, xy: -0.1, yy: 0.3 }, vec2(1.0, -1.0).normalize()),
        (Sym2 { xx: 0.3, xy: 0.0, yy: 0.3 }, Vec2::X),
        (Sym2 { xx: 0.0, xy: 0.0, yy: 0.0 }, Vec2::X),
    ] {
        let (_, _, axis) = a.eigen();
        assert!((axis - wanted).length() < 1e-7, "wanted {wanted}, got {axis} for {a:?}");
    }
    // A hint of a correlation in a round matrix: its square underflows.
    for xy in [1e-20, -1e-22, 1e-30, f32::MIN_POSITIVE] {
        for size in [1.0, 0.3, 1e-5] {
            let (l1, l2, axis) = Sym2 { xx: size, xy, yy: size }.eigen();
            assert!(axis.is_normalized() && l1 == size && l2 <= l1, "got {l1} {l2} {axis} for xy = {xy:e}");
        }
    }
    // And off the diagonal.
    for xy in [f32::MIN_POSITIVE, -f32::MIN_POSITIVE, 1e-12, -1e-12] {
        let (_, _, axis) = Sym2 { xx: 0.1, xy, yy: 0.5 }.eigen();
        assert!((axis - Vec2::Y * xy.signum()).length() < 1e-6, "got {axis} for xy = {xy:e}");
    }
}

#[test]
fn eigen_decomposition_puts_the_matrix_together_again() {
    for mut rng in cases(2, 50_000) {
        let a = positive(&mut rng);
        let (l1, l2, axis) = a.eigen();
        let error = max_abs2(dense2(Sym2::from_eigen(l1, l2, axis)) - dense2(a));
        assert!(error < 4e-7 * f64::from(l1), "error {error:.1e} for {a:?}");
    }
}

#[test]
fn the_root_squares_to_the_matrix() {
    for mut rng in cases(3, 50_000) {
        let a = positive(&mut rng);
        let root = dense2(a.sqrt());
        let error = max_abs2(root * root - dense2(a));
        assert!(error < 4e-7 * f64::from(a.trace()), "error {error:.1e} of the root of {a:?}");
    }
    assert_eq!(Sym2::default().sqrt(), Sym2::default(), "zero");
    let rank_one = Sym2::outer(vec2(0.6, 0.8));
    let error = max_abs2(dense2(rank_one.sqrt()) - dense2(rank_one));
    assert!(error < 1e-3, "a projector is its own root: {:?}", rank_one.sqrt());
}

#[test]
fn clamping_keeps_what_is_inside_and_cuts_what_is_not() {
    for mut rng in cases(4, 50_000) {
        let a = positive(&mut rng);
        let (lo, hi) = (1e-3, 0.3);
        let clamped = a.clamp_eigen(lo, hi);
        let (l1, l2, axis) = a.eigen();
        if l1 <= hi && l2 > lo {
            assert_eq!(clamped, a, "inside the range nothing changes");
            continue;
        }
        let (c1, c2, _) = clamped.eigen();
        assert!((c1 - l1.clamp(lo, hi)).abs() < 1e-6, "wanted {}, got {c1} for {a:?}", l1.clamp(lo, hi));
        // The loss of a determinant, as above.
        assert!((c2 - l2.clamp(lo, hi)).abs() < 1e-6, "wanted {}, got {c2} for {a:?}", l2.clamp(lo, hi));
        let error =
            max_abs2(dense2(clamped) - dense2(Sym2::from_eigen(l1.clamp(lo, hi), l2.clamp(lo, hi), axis)));
        assert!(error < 1e-7, "the axes turned: {clamped:?} for {a:?}");
    }
}

#[test]
fn clamping_repairs_what_rounding_made_indefinite() {
    for a in [
        Sym2 { xx: -1e-8, xy: 0.0, yy: 0.5 },
        Sym2 { xx: -1e-8, xy: 1e-8, yy: -2e-8 },
        Sym2 { xx: 0.25, xy: 0.250_000_03, yy: 0.25 },
        Sym2 { xx: 0.0, xy: 1e-9, yy: 0.0 },
    ] {
        for lo in [0.0, 1e-5] {
            let c = a.clamp_eigen(lo, 1.0);
            assert!(c.xx >= 0.0 && c.yy >= 0.0, "got {c:?} for {a:?}");
            let det = f64::from(c.xx) * f64::from(c.yy) - f64::from(c.xy).powi(2);
            assert!(det >= -1e-7 * f64::from(c.xx * c.yy), "det {det:e} of {c:?} for {a:?}");
            let root = c.sqrt();
            assert!(
                root.xx.is_finite() && root.xy.is_finite() && root.yy.is_finite(),
                "root {root:?} of {c:?}"
            );
        }
    }
}

#[test]
fn small_products_are_what_they_say() {
    for mut rng in cases(5, 10_000) {
        let a = positive(&mut rng);
        let v = (rng.axis() * rng.range(0.0, 2.0)).as_vec2();
        let wanted = v.as_dvec2().dot(dense2(a) * v.as_dvec2());
        assert!(
            (f64::from(a.quadratic(v)) - wanted).abs() < 4e-7 * f64::from(a.trace() * v.length_squared())
        );
        let sum = a + Sym2::outer(v) * 2.0;
        let wanted =
            dense2(a) + DMat2::from_cols(v.as_dvec2() * f64::from(v.x), v.as_dvec2() * f64::from(v.y)) * 2.0;
        assert!(max_abs2(dense2(sum) - wanted) < 2e-6, "wanted {wanted}, got {sum:?}");

        let s = any3(&mut rng);
        let w = rng.direction(-1.0, 1.0).as_vec3();
        let wanted = dense(s) * w.as_dvec3();
        assert!((s.mul_vec3(w).as_dvec3() - wanted).length() < 4e-7, "S w of {s:?}, {w}");
        assert!((f64::from(s.quadratic(w)) - w.as_dvec3().dot(wanted)).abs() < 6e-7, "w^T S w of {s:?}, {w}");
    }
}

#[test]
fn adjugate_and_determinant_agree_with_the_inverse() {
    for mut rng in cases(6, 20_000) {
        let s = any3(&mut rng);
        let product = dense(s) * dense(s.adjugate());
        let det = dense(s).determinant();
        let error = (product - DMat3::IDENTITY * det)
            .to_cols_array()
            .into_iter()
            .fold(0.0, |w: f64, e| w.max(e.abs()));
        assert!(error < 2e-6, "S adj(S) - |S| I: {error:.1e} for {s:?}");
        assert!((f64::from(s.det()) - det).abs() < 1e-6, "wanted {det}, got {} for {s:?}", s.det());
    }
    // A singular matrix has an adjugate where it has no inverse.
    let v = glam::vec3(0.6, 0.0, 0.8);
    assert!(Sym3::outer(v).det().abs() < 1e-7 && Sym3::outer(v).adjugate().trace().abs() < 1e-7);
}

#[test]
fn a_turned_matrix_keeps_its_eigenvalues_and_turns_back() {
    for mut rng in cases(7, 5000) {
        let s = any3(&mut rng);
        let m: Mat3 = m_n(rng.direction(-0.5, 1.0).as_vec3());
        let turned = s.in_frame(m);
        for ((got, _), (wanted, _)) in jacobi_eigen(dense(turned)).into_iter().zip(jacobi_eigen(dense(s))) {
            assert!((got - wanted).abs() < 2e-6, "wanted {wanted}, got {got} for {s:?}");
        }
        let wanted = m.as_dmat3().transpose() * dense(s) * m.as_dmat3();
        let error =
            (dense(turned) - wanted).to_cols_array().into_iter().fold(0.0, |w: f64, e| w.max(e.abs()));
        assert!(error < 1e-6, "M^T S M: {error:.1e} for {s:?}");
    }
}

#[test]
fn alphas_make_the_matrix_they_are_read_from() {
    for mut rng in cases(8, 20_000) {
        let (a, b) = (rng.range(0.05, 1.0) as f32, rng.range(0.05, 1.0) as f32);
        let axis = rng.axis().as_vec2();
        let (l1, l2, got) = aniso_from_alphas(a.max(b), a.min(b), axis).eigen();
        assert!((l1.sqrt() - a.max(b)).abs() < 1e-6, "wanted {}, got {}", a.max(b), l1.sqrt());
        assert!((l2.sqrt() - a.min(b)).abs() < 1e-5, "wanted {}, got {}", a.min(b), l2.sqrt());
        if (a - b).abs() > 0.01 {
            assert!(got.dot(axis).abs() > 1.0 - 1e-6, "wanted ±{axis}, got {got} for {a}, {b}");
        }
    }
}

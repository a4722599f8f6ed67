//! The shortest-arc frame, its loss of orthogonality, and what a Gram–Schmidt frame would be instead.

mod common;

use common::{Rng, cases, degrees_between, view};
use glam::{DMat3, DQuat, DVec3, Mat3, Vec3, vec3};
use kinran_shading::{m_n, normal_from_xy};

/// Largest entry of `M^T M - I`.
fn orthogonality_error(m: Mat3) -> f64 {
    let m = m.as_dmat3();
    let error = m.transpose() * m - DMat3::IDENTITY;
    error.to_cols_array().into_iter().fold(0.0, |worst, e| worst.max(e.abs()))
}

#[test]
fn columns_are_orthonormal_for_every_normal_a_map_can_hold() {
    for mut rng in cases(1, 200_000) {
        // A normal as a texture gives it: z from x and y.
        let n = rng.direction(0.0, 1.0);
        let n = normal_from_xy(n.x as f32, n.y as f32);
        let error = orthogonality_error(m_n(n));
        assert!(error <= 3e-7, "wanted 3e-7, got {error:.1e} for {n}");
    }
}

#[test]
fn z_goes_to_the_normal_exactly() {
    for mut rng in cases(2, 10_000) {
        let n = rng.direction(-0.99, 1.0).as_vec3();
        assert_eq!(m_n(n).z_axis, n);
    }
    assert_eq!(m_n(Vec3::Z), Mat3::IDENTITY, "flat stays flat");
}

#[test]
fn the_rotation_is_the_shortest_arc() {
    for mut rng in cases(3, 10_000) {
        let n = rng.direction(-0.9, 1.0).as_vec3();
        let wanted = DMat3::from_quat(DQuat::from_rotation_arc(DVec3::Z, n.as_dvec3().normalize()));
        let got = m_n(n).as_dmat3();
        let error = (got - wanted).to_cols_array().into_iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
        assert!(error < 2e-6, "wanted {wanted}, got {got} for {n}");
    }
}

#[test]
fn orthogonality_is_lost_towards_minus_z_as_stated() {
    for (z, stated) in [(-0.9, 1.2e-6), (-0.99, 5e-6), (-0.999_999, 0.053)] {
        let mut rng = Rng::new(4);
        let worst = (0..2000)
            .map(|_| orthogonality_error(m_n(view(z, rng.range(0.0, std::f64::consts::TAU)).as_vec3())))
            .fold(0.0, f64::max);
        assert!(worst < stated, "at n.z = {z}: wanted at most {stated:e}, got {worst:e}");
        assert!(worst > 0.5 * stated, "at n.z = {z}: the stated {stated:e} is too cautious, got {worst:e}");
    }
}

#[test]
fn minus_z_is_a_half_turn_and_its_surroundings_are_finite() {
    let m = m_n(Vec3::NEG_Z);
    assert_eq!(m, Mat3::from_cols(Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z));
    assert_eq!(m.determinant(), 1.0, "a rotation, not a mirror image");
    for mut rng in cases(5, 10_000) {
        let tilt = 10_f64.powf(rng.range(-12.0, -1.0));
        let n = view(-(1.0 - tilt * tilt).sqrt(), rng.range(0.0, std::f64::consts::TAU)).as_vec3();
        let m = m_n(n);
        assert!(m.is_finite() && (m.z_axis - n).length() < 1.5e-3, "got {m} for {n}");
    }
}

#[test]
fn a_gram_schmidt_tangent_is_off_by_the_stated_angles() {
    for (tilt, stated) in [(10.0, 0.44), (20.0, 1.8), (30.0, 4.1), (45.0, 9.7), (60.0, 18.4)] {
        let n = view(f64::to_radians(tilt).cos(), f64::to_radians(45.0));
        let gram_schmidt = DVec3::X - n * n.x;
        let got = degrees_between(gram_schmidt, m_n(n.as_vec3()).x_axis.as_dvec3());
        assert!((got / stated - 1.0).abs() < 0.02, "tilt {tilt}°: wanted {stated}°, got {got}°");
    }
}

#[test]
fn normals_from_xy_are_unit_length_inside_the_circle_and_on_the_horizon_outside() {
    for mut rng in cases(6, 10_000) {
        let (x, y) = (rng.range(-1.0, 1.0) as f32, rng.range(-1.0, 1.0) as f32);
        let n = normal_from_xy(x, y);
        assert!(n.is_normalized() && n.z >= 0.0, "got {n} for ({x}, {y})");
        if x * x + y * y < 1.0 {
            assert_eq!((n.x, n.y), (x, y), "the stored components stay as they are");
        } else {
            assert_eq!(n.z, 0.0, "beyond the circle lies the horizon: {n} for ({x}, {y})");
            assert!(
                n.x * x >= 0.0 && n.y * y >= 0.0 && (n.x * y - n.y * x).abs() < 2e-7,
                "{n} for ({x}, {y})"
            );
        }
    }
    assert_eq!(normal_from_xy(0.0, 0.0), Vec3::Z);
    assert_eq!(normal_from_xy(-1.0, 0.0), vec3(-1.0, 0.0, 0.0));
}

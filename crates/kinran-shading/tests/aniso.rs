//! The aniso texel: round trips, rounding to 8 bits, interpolation, and the frames it is used in.

mod common;

use common::{Rng, cases, degrees_between};
use glam::{DVec2, DVec3, Vec2, Vec3, vec2, vec3};
use kinran_shading::{
    ALPHA_MIN, Sym2, alpha_from_gloss, alpha_from_roughness, alphas_from_khr_anisotropy, aniso_decode,
    aniso_decode_matrix, aniso_encode, aniso_from_alphas, axis_from_direction, direction_from_axis,
    ggx_matrix_d, khr_anisotropy_from_alphas, m_n,
};

/// Texel of alphas with the larger one at `degrees` from x.
fn texel(alpha_t: f64, alpha_b: f64, degrees: f64) -> Vec3 {
    let axis = DVec2::from_angle(degrees.to_radians()).as_vec2();
    aniso_encode(aniso_from_alphas(alpha_t as f32, alpha_b as f32, axis))
}

/// What is left of a texel in an 8-bit texture.
fn quantized(texel: Vec3) -> Vec3 {
    (texel * 255.0).round() / 255.0
}

/// Principal alphas of a texel, and the larger one's direction in degrees within [-90°, 90°).
fn decoded(texel: Vec3) -> (f64, f64, f64) {
    let d = aniso_decode(texel, Vec3::X, Vec3::Y);
    let degrees = f64::from(d.tangent.y).atan2(d.tangent.x.into()).to_degrees();
    (d.alpha_t.into(), d.alpha_b.into(), (degrees + 90.0).rem_euclid(180.0) - 90.0)
}

/// Determinant of what a texel decodes to, with no rounding: `a² b² (1 - rho²)`.
fn exact_det(texel: Vec3) -> f64 {
    let [a, y, b] = texel.as_dvec3().to_array();
    let rho = 2.0 * y - 1.0;
    (a * b).powi(2) * (1.0 - rho * rho)
}

#[test]
fn a_texel_gives_back_its_matrix() {
    for mut rng in cases(1, 50_000) {
        let (a, b) = (rng.range(0.004, 1.0), rng.range(0.004, 1.0));
        let s = aniso_from_alphas(a.max(b) as f32, a.min(b) as f32, rng.axis().as_vec2());
        let t = aniso_encode(s);
        assert!(t.cmpge(Vec3::ZERO).all() && t.cmple(Vec3::ONE).all(), "wanted [0, 1]³, got {t} for {s:?}");
        let got = aniso_decode_matrix(t);
        let error = (got.xx - s.xx).abs().max((got.xy - s.xy).abs()).max((got.yy - s.yy).abs());
        assert!(error < 3e-7 * s.trace(), "wanted {s:?}, got {got:?}");
    }
}

#[test]
fn a_texel_gives_back_its_alphas_and_axis() {
    for mut rng in cases(2, 50_000) {
        let (a, b) = (rng.range(0.004, 1.0), rng.range(0.004, 1.0));
        let (alpha_t, alpha_b) = (a.max(b), a.min(b));
        let degrees = rng.range(-90.0, 90.0);
        let (got_t, got_b, got_degrees) = decoded(texel(alpha_t, alpha_b, degrees));
        assert!((got_t - alpha_t).abs() < 4e-7, "alpha_t: wanted {alpha_t}, got {got_t}");
        // rho is rounded to 1e-7 and det to as much of a² b²: over alpha_t, twice alpha_b.
        let loss = 3e-7 * alpha_t * alpha_t / alpha_b;
        assert!(
            (got_b - alpha_b).abs() < loss,
            "alpha_b: wanted {alpha_b}, got {got_b} beside {alpha_t}, {degrees}°"
        );
        let spread = alpha_t * alpha_t - alpha_b * alpha_b;
        if spread > 1e-3 {
            let error = (got_degrees - degrees + 90.0).rem_euclid(180.0) - 90.0;
            assert!(error.abs() < 2e-5 * alpha_t * alpha_t / spread, "wanted {degrees}°, got {got_degrees}°");
        }
    }
}

#[test]
fn every_8_bit_texel_decodes_to_a_positive_matrix() {
    for x in (0..=255).step_by(5) {
        for y in 0..=255 {
            for z in (0..=255).step_by(5) {
                let t = vec3(x as f32, y as f32, z as f32) / 255.0;
                assert_positive(t);
            }
        }
    }
}

#[test]
fn every_mixture_of_texels_decodes_to_a_positive_matrix() {
    for mut rng in cases(3, 200_000) {
        // Corners as often as anything else: black, white, rho = ±1.
        let mut corner = || match rng.bits() % 4 {
            0 => 0.0,
            1 => 1.0,
            _ => rng.unit_f32(),
        };
        let texels = [(); 4].map(|()| vec3(corner(), corner(), corner()));
        let (s, t) = (rng.unit_f32(), rng.unit_f32());
        assert_positive(texels[0].lerp(texels[1], s).lerp(texels[2].lerp(texels[3], s), t));
    }
}

fn assert_positive(t: Vec3) {
    assert!(exact_det(t) >= 0.0, "det {} of {t}", exact_det(t));
    let a = aniso_decode_matrix(t);
    // In single precision the determinant of a singular matrix is rounding.
    let det = f64::from(a.xx) * f64::from(a.yy) - f64::from(a.xy).powi(2);
    assert!(
        a.xx >= 0.0 && a.yy >= 0.0 && det >= -3e-7 * f64::from(a.xx * a.yy),
        "det {det:e} of {a:?} from {t}"
    );

    let d = aniso_decode(t, Vec3::X, Vec3::Y);
    assert!(
        ALPHA_MIN <= d.alpha_b && d.alpha_b <= d.alpha_t && d.alpha_t <= 1.0,
        "wanted ALPHA_MIN <= alpha_b <= alpha_t <= 1, got {d:?} from {t}"
    );
    assert!(
        d.tangent.is_normalized() && d.bitangent.is_normalized(),
        "wanted unit vectors, got {d:?} from {t}"
    );
    let clamped = a.clamp_eigen(ALPHA_MIN * ALPHA_MIN, 1.0);
    let peak = ggx_matrix_d(Vec3::Z, clamped);
    assert!(peak.is_finite() && peak > 0.0, "D of the clamped matrix: {peak} from {t}");
}

#[test]
fn a_texel_aligned_with_the_bitangent_keeps_a_unit_tangent() {
    let (t, b) = (vec3(0.6, 0.0, 0.8), Vec3::Y);
    for rho in [0.5_f32, 0.5 + f32::EPSILON, 0.5 - f32::EPSILON] {
        // The alphas are those of the bitangent, exactly: Sxy = 0, or -0, and Syy > Sxx.
        let d = aniso_decode(vec3(0.1, rho, 0.5), t, b);
        assert!((d.alpha_t - 0.5).abs() < 1e-6 && (d.alpha_b - 0.1).abs() < 1e-6, "got {d:?} at {rho}");
        let along = d.tangent.dot(b).abs();
        assert!(d.tangent.is_normalized() && along > 1.0 - 1e-6, "wanted ±{b}, got {d:?} at {rho}");
    }
    let d = aniso_decode(vec3(0.1, 0.5, 0.5), t, b);
    assert_eq!((d.tangent, d.bitangent), (b, -t), "rho = 0 counts as positive");
}

#[test]
fn decoded_axes_are_a_turned_frame_of_the_same_handedness() {
    for mut rng in cases(4, 20_000) {
        let m = m_n(rng.direction(0.0, 1.0).as_vec3());
        let t = vec3(rng.unit_f32(), rng.unit_f32(), rng.unit_f32());
        let d = aniso_decode(t, m.x_axis, m.y_axis);
        assert!((d.tangent.cross(d.bitangent) - m.z_axis).length() < 1e-6, "got {d:?} from {t} in {m}");
        // A v = alpha_t² v in that frame.
        let a = aniso_decode_matrix(t);
        let along = vec2(d.tangent.dot(m.x_axis), d.tangent.dot(m.y_axis));
        // Texels may stand for more than alpha = 1, which the decode clamps, as it does the dark end.
        let (got, wanted) = (a.quadratic(along).sqrt().clamp(ALPHA_MIN, 1.0), d.alpha_t);
        assert!((got - wanted).abs() < 1e-6, "wanted {wanted}, got {got} from {t}");
    }
}

#[test]
fn eight_bits_keep_the_larger_alpha_and_the_axis() {
    let (mut worst_alpha, mut worst_axis) = (0.0_f64, 0.0_f64);
    for mut rng in cases(5, 200_000) {
        let alpha_t = rng.range(0.02, 1.0);
        let alpha_b = alpha_t * rng.range(0.0, 1.0);
        let degrees = rng.range(-90.0, 90.0);
        let (got_t, _, got_degrees) = decoded(quantized(texel(alpha_t, alpha_b, degrees)));
        worst_alpha = worst_alpha.max((got_t - alpha_t).abs());
        if alpha_t > 0.5 && alpha_b < 0.5 * alpha_t {
            let error = (got_degrees - degrees + 90.0).rem_euclid(180.0) - 90.0;
            worst_axis = worst_axis.max(error.abs());
        }
    }
    assert!(worst_alpha < 0.0038, "alpha_t: wanted an error of at most 0.0038, got {worst_alpha}");
    assert!(worst_axis < 0.5, "axis where clearly anisotropic: wanted at most 0.5°, got {worst_axis}°");

    // Weak anisotropy has a weak axis.
    let worst = (0..1800)
        .map(|k| {
            let degrees = f64::from(k) * 0.1 - 90.0;
            let (_, _, got) = decoded(quantized(texel(0.9, 0.8, degrees)));
            ((got - degrees + 90.0).rem_euclid(180.0) - 90.0).abs()
        })
        .fold(0.0, f64::max);
    assert!(worst < 1.35, "axis of (0.9, 0.8): wanted at most 1.3°, got {worst}°");
}

#[test]
fn eight_bits_keep_the_smaller_alpha_as_stated() {
    for (alpha_t, alpha_b, lo, hi) in
        [(0.87, 0.04, 0.0325, 0.0548), (0.87, 0.1, 0.092, 0.107), (0.29, 0.04, 0.0379, 0.042)]
    {
        let (mut least, mut most) = (1.0_f64, 0.0_f64);
        for k in 0..18_000 {
            let (_, got, _) = decoded(quantized(texel(alpha_t, alpha_b, f64::from(k) * 0.01)));
            (least, most) = (least.min(got), most.max(got));
        }
        assert!(
            lo <= least && most <= hi,
            "alpha_b of ({alpha_t}, {alpha_b}): wanted [{lo}, {hi}], got [{least}, {most}]"
        );
    }
}

#[test]
fn eight_bits_hold_these_ratios_at_45_degrees() {
    // There rho = (1 - r²) / (1 + r²) for r = alpha_b / alpha_t, in steps of 2/255 from one.
    for (step, wanted) in [(1, 0.0627), (2, 0.0889)] {
        let (alpha_t, alpha_b, _) = decoded(vec3(0.5, (255 - step) as f32 / 255.0, 0.5));
        let ratio = alpha_b / alpha_t;
        assert!((ratio - wanted).abs() < 1e-4, "step {step}: wanted {wanted}, got {ratio}");
    }
    for (ratio, code) in [(0.0442, 255.0), (0.0444, 254.0)] {
        let y = quantized(texel(0.9, 0.9 * ratio, 45.0)).y * 255.0;
        assert_eq!(y, code, "rho of the ratio {ratio}");
    }
}

#[test]
fn eight_bits_cannot_say_uncorrelated_but_nearly() {
    let y = quantized(texel(0.5, 0.5, 0.0)).y;
    let rho = 2.0 * y - 1.0;
    assert!(rho != 0.0 && rho.abs() < 0.004, "wanted ±0.0039, got {rho}");
    let (alpha_t, alpha_b, _) = decoded(vec3(0.5, y, 0.5));
    assert!((alpha_t / alpha_b - 1.0).abs() < 0.004, "the lobe stays round: {alpha_t}, {alpha_b}");
}

#[test]
fn interpolated_texels_change_shape_as_stated() {
    for (angles, encoded, in_s) in
        [((20.0, 70.0), (0.452, 0.134), (0.455, 0.230)), ((0.0, 90.0), (0.300, 0.300), (0.361, 0.361))]
    {
        let (p, q) = (texel(0.5, 0.1, angles.0), texel(0.5, 0.1, angles.1));
        let (alpha_t, alpha_b, _) = decoded(p.lerp(q, 0.5));
        assert!(
            (alpha_t - encoded.0).abs() < 6e-4 && (alpha_b - encoded.1).abs() < 6e-4,
            "texels at {angles:?}: wanted {encoded:?}, got ({alpha_t}, {alpha_b})"
        );
        let s = (aniso_decode_matrix(p) + aniso_decode_matrix(q)) * 0.5;
        let (l1, l2, _) = s.eigen();
        assert!(
            (l1.sqrt() - in_s.0).abs() < 6e-4 && (l2.sqrt() - in_s.1).abs() < 6e-4,
            "matrices at {angles:?}: wanted {in_s:?}, got ({}, {})",
            l1.sqrt(),
            l2.sqrt()
        );
    }
}

#[test]
fn alphas_of_one_stay_one() {
    for degrees in [0.0, 17.0, 45.0, 90.0] {
        let t = texel(1.0, 1.0, degrees);
        assert!(t.x <= 1.0 && t.z <= 1.0 && (t.y - 0.5).abs() < 1e-6, "got {t}");
        let (alpha_t, alpha_b, _) = decoded(t);
        assert!(alpha_t <= 1.0 && alpha_t > 1.0 - 1e-6 && alpha_b > 1.0 - 1e-6, "got {alpha_t}, {alpha_b}");
        let (alpha_t, alpha_b, _) = decoded(texel(1.0, ALPHA_MIN.into(), degrees));
        assert!(alpha_t <= 1.0 && alpha_t > 1.0 - 1e-6, "got {alpha_t} at {degrees}°");
        assert!((alpha_b - f64::from(ALPHA_MIN)).abs() < 1e-4, "got {alpha_b} at {degrees}°");
    }
    // A filter may hand over a little more than one.
    let t = aniso_encode(Sym2 { xx: 1.0001, xy: 0.0, yy: 1.5 });
    assert_eq!(t, vec3(1.0, 0.5, 1.0));
}

#[test]
fn degenerate_matrices_encode_to_texels() {
    for s in [
        Sym2::default(),
        Sym2 { xx: 0.5, xy: 0.0, yy: 0.0 },
        Sym2 { xx: 0.0, xy: 0.1, yy: 0.5 },
        Sym2 { xx: -1e-9, xy: 1e-9, yy: 0.5 },
        Sym2 { xx: 0.25, xy: 0.250_01, yy: 0.25 },
        Sym2 { xx: 1e-30, xy: -1e-30, yy: 1e-30 },
    ] {
        let t = aniso_encode(s);
        assert!(t.cmpge(Vec3::ZERO).all() && t.cmple(Vec3::ONE).all(), "wanted [0, 1]³, got {t} for {s:?}");
    }
}

/// A direction painted in the mesh's tangent plane, laid into the surface as renderers do.
fn gram_schmidt(direction: DVec2, n: DVec3) -> DVec3 {
    let d = direction.extend(0.0);
    (d - n * d.dot(n)).normalize()
}

#[test]
fn painted_directions_become_what_gram_schmidt_makes_of_them() {
    for mut rng in cases(6, 50_000) {
        let n = rng.direction(0.02, 1.0).as_vec3();
        let direction = rng.axis();
        let axis = axis_from_direction(direction.as_vec2(), n);
        assert!(axis.is_normalized(), "wanted a unit vector, got {axis} for {direction}, {n}");
        let m = m_n(n);
        let got = m.x_axis * axis.x + m.y_axis * axis.y;
        let wanted = gram_schmidt(direction, n.as_dvec3());
        // A direction along the tilt keeps n.z of its length.
        let error = degrees_between(got.into(), wanted);
        assert!(
            error < 3e-5 / f64::from(n.z),
            "wanted {wanted}, got {got}, {error}° off for {direction}, {n}"
        );
    }
}

#[test]
fn painted_directions_and_axes_are_inverses() {
    for mut rng in cases(7, 50_000) {
        let n = rng.direction(0.05, 1.0).as_vec3();
        let wanted = rng.axis().as_vec2();
        let limit = 4e-6 / n.z;
        let got = direction_from_axis(axis_from_direction(wanted, n), n);
        assert!((got - wanted).length() < limit, "direction: wanted {wanted}, got {got} for {n}");
        let got = axis_from_direction(direction_from_axis(wanted, n), n);
        assert!((got - wanted).length() < limit, "axis: wanted {wanted}, got {got} for {n}");
    }
}

#[test]
fn painted_directions_survive_flat_normals_and_the_horizon() {
    for mut rng in cases(8, 1000) {
        let d = rng.axis().as_vec2();
        assert_eq!(axis_from_direction(d, Vec3::Z), d / d.length(), "flat");
        assert_eq!(direction_from_axis(d, Vec3::Z), d / d.length(), "flat");
        // On the horizon everything projects to one line or nothing.
        let n = rng.axis().as_vec2().extend(0.0);
        for (got, what) in [
            (axis_from_direction(d, n), "axis"),
            (direction_from_axis(d, n), "direction"),
            (axis_from_direction(n.truncate(), n), "axis along the tilt"),
            (direction_from_axis(n.truncate(), n), "direction along the tilt"),
        ] {
            assert!(
                (got.length() - 1.0).abs() < 1e-6,
                "{what}: wanted a unit vector, got {got} for {d}, {n}"
            );
        }
    }
}

#[test]
fn khr_anisotropy_follows_its_specification_and_inverts() {
    for mut rng in cases(9, 50_000) {
        let (roughness, strength) = (rng.unit(), rng.unit());
        let (alpha_t, alpha_b) = alphas_from_khr_anisotropy(roughness as f32, strength as f32);
        // KHR_materials_anisotropy: αt = mix(α, 1, strength²), αb = α = roughness².
        let alpha = (roughness * roughness).max(ALPHA_MIN.into());
        let wanted = alpha + (1.0 - alpha) * strength * strength;
        assert!((f64::from(alpha_t) - wanted).abs() < 2e-7, "alpha_t: wanted {wanted}, got {alpha_t}");
        assert!((f64::from(alpha_b) - alpha).abs() < 2e-7, "alpha_b: wanted {alpha}, got {alpha_b}");
        assert!(ALPHA_MIN <= alpha_b && alpha_b <= alpha_t && alpha_t <= 1.0, "got {alpha_t}, {alpha_b}");

        let (got_roughness, got_strength) = khr_anisotropy_from_alphas(alpha_t, alpha_b);
        assert!((got_roughness - roughness.max(f64::from(ALPHA_MIN).sqrt()) as f32).abs() < 1e-6);
        // A small strength is a root of a small difference.
        let rest = 1.0 - alpha;
        if rest > 1e-3 {
            let limit = 1e-6 / (rest * strength.max(1e-3));
            assert!(
                (f64::from(got_strength) - strength).abs() < limit,
                "strength: wanted {strength}, got {got_strength} at roughness {roughness}"
            );
        }
    }
}

#[test]
fn every_pair_of_alphas_is_a_khr_anisotropy() {
    for mut rng in cases(10, 50_000) {
        let (a, b) = (rng.range(ALPHA_MIN.into(), 1.0) as f32, rng.range(ALPHA_MIN.into(), 1.0) as f32);
        let (roughness, strength) = khr_anisotropy_from_alphas(a.max(b), a.min(b));
        assert!(
            (0.0..=1.0).contains(&roughness) && (0.0..=1.0).contains(&strength),
            "{roughness}, {strength}"
        );
        let (alpha_t, alpha_b) = alphas_from_khr_anisotropy(roughness, strength);
        assert!(
            (alpha_t - a.max(b)).abs() < 5e-7 && (alpha_b - a.min(b)).abs() < 5e-7,
            "wanted {} {}, got {alpha_t} {alpha_b}",
            a.max(b),
            a.min(b)
        );
    }
    assert_eq!(khr_anisotropy_from_alphas(1.0, 1.0), (1.0, 0.0), "chalk has no direction");
    assert_eq!(khr_anisotropy_from_alphas(0.25, 0.25), (0.5, 0.0));
}

#[test]
fn gloss_and_roughness_become_alpha_by_their_square() {
    for k in 0..=255 {
        let r = k as f32 / 255.0;
        let wanted = f64::from(r).powi(2).max(1.0 / 255.0);
        assert!((f64::from(alpha_from_roughness(r)) - wanted).abs() < 1e-7, "roughness {r}");
        assert!((f64::from(alpha_from_gloss(1.0 - r)) - wanted).abs() < 3e-7, "gloss {}", 1.0 - r);
    }
    assert_eq!(alpha_from_roughness(0.0), ALPHA_MIN);
    assert_eq!(alpha_from_gloss(1.0), ALPHA_MIN);
    assert_eq!(alpha_from_gloss(0.0), 1.0);
}

#[test]
fn the_texel_of_a_random_surface_lies_in_its_unit_cube() {
    let mut rng = Rng::new(11);
    for _ in 0..50_000 {
        // Rounding makes rho a little more than one where a matrix is singular.
        let t = aniso_encode(Sym2::outer(vec2(rng.unit_f32(), rng.unit_f32() - 0.5)));
        assert!(t.cmpge(Vec3::ZERO).all() && t.cmple(Vec3::ONE).all(), "got {t}");
        let s = aniso_decode_matrix(t);
        assert!(s.xx.is_finite() && s.xy.is_finite() && s.yy.is_finite(), "got {s:?} from {t}");
    }
    assert_eq!(aniso_encode(Sym2::outer(Vec2::ZERO)), vec3(0.0, 0.5, 0.0));
}

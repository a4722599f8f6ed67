//! Detail operators against their definitions in double precision, bisection, and height fields.

use glam::{DVec3, Mat2, Vec2, Vec3, dvec3, vec2, vec3};
use kinran_shading::detail::{
    detail_from_texel, detail_mask, detail_mirror, detail_over, detail_over_inverse, detail_turn_aniso,
    detail_turn_normal, detail_uv, hsv_shift, overlay, overlay_inverse, overlay_slope, rnm, rnm_inverse,
    smooth_overlay, smooth_overlay_inverse, smooth_overlay_slope,
};
use kinran_shading::{aniso_decode_matrix, aniso_encode, aniso_from_alphas, m_n};
use proptest::prelude::*;

/// The slide, read word by word.
fn overlay_of_the_slide(s: f64, d: f64) -> f64 {
    if s < 0.5 { 2.0 * s * d } else { 1.0 - 2.0 * (1.0 - s) * (1.0 - d) }
}

/// The slide, read word by word.
fn smooth_overlay_of_the_slide(s: f64, d: f64) -> f64 {
    if s < 0.5 {
        2.0 * s * d
    } else if d >= 0.5 {
        1.0 - 2.0 * (1.0 - s) * (1.0 - d)
    } else {
        let by = (2.0 * s - 1.0).powi(2);
        2.0 * s * d * (1.0 - by) + s * by
    }
}

/// Values where branches meet, where digits are lost, and an even grid.
fn values() -> Vec<f32> {
    let edges = [0.0, 1e-7, 1e-4, 1.0 / 255.0, 0.125, 0.499_999_97, 0.5, 0.500_000_06, 0.999_999, 1.0];
    edges.into_iter().chain((0..=255).map(|i| i as f32 / 255.0)).collect()
}

type Operator = fn(f32, f32) -> f32;
type Exact = fn(f64, f64) -> f64;

const OPERATORS: [(&str, Exact, Operator, Operator, Operator); 2] = [
    ("overlay", overlay_of_the_slide, overlay, overlay_inverse, overlay_slope),
    (
        "smooth_overlay",
        smooth_overlay_of_the_slide,
        smooth_overlay,
        smooth_overlay_inverse,
        smooth_overlay_slope,
    ),
];

#[test]
fn operators_are_those_of_the_slides() {
    for (name, exact, operator, ..) in OPERATORS {
        for s in values() {
            for d in values() {
                let (want, got) = (exact(f64::from(s), f64::from(d)), operator(s, d));
                assert!(
                    (want - f64::from(got)).abs() < 2e-7,
                    "{name}({s}, {d}): wanted {want:e}, got {got:e}"
                );
            }
        }
    }
}

#[test]
fn every_target_is_reached_to_single_precision() {
    for (name, exact, _, inverse, _) in OPERATORS {
        let mut worst = 0.0_f64;
        for d in values() {
            for t in values() {
                let s = inverse(t, d);
                assert!((0.0..=1.0).contains(&s), "{name}: s = {s} for t = {t}, d = {d}");
                // An s next to one cannot say more than its own last digit.
                let rounding = f64::from(f32::EPSILON) * f64::from(smooth_overlay_slope(s, d)).max(1.0);
                let error = (exact(f64::from(s), f64::from(d)) - f64::from(t)).abs();
                worst = worst.max(error);
                assert!(error < 3e-7_f64.max(rounding), "{name}: t = {t}, d = {d}: s = {s} is {error:e} off");
            }
        }
        assert!(worst < 3e-7, "{name}: {worst:e}");
    }
}

#[test]
fn solutions_are_those_of_bisection_where_the_slope_tells_them() {
    for (name, exact, _, inverse, slope) in OPERATORS {
        for d in values() {
            for t in values() {
                let (mut low, mut high) = (0.0_f64, 1.0_f64);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    *(if exact(middle, f64::from(d)) < f64::from(t) { &mut low } else { &mut high }) = middle;
                }
                let got = inverse(t, d);
                let steepness = f64::from(slope(got, d)).min(f64::from(slope(low as f32, d)));
                if steepness < 1e-3 {
                    continue;
                }
                let error = (f64::from(got) - low).abs();
                let allowed = 4e-7 / steepness + 1e-6;
                assert!(error < allowed, "{name}: t = {t}, d = {d}: wanted {low}, got {got}");
            }
        }
    }
}

/// Down to 1e-7 the root of the cubic keeps its digits, where solving in s loses the detail to 2e-4.
#[test]
fn dark_targets_over_black_keep_their_digits() {
    for d in [0.0, 1e-8, 1e-6, 1e-4, 1e-3] {
        for e in [1e-9_f32, 1e-7, 1e-5, 1e-3] {
            let t = d + e;
            let x = f64::from(smooth_overlay_inverse(t, d)) * 2.0 - 1.0;
            let (a, d) = (1.0 - 2.0 * f64::from(d), f64::from(d));
            let rest = d * x + 0.5 * a * x * x * (1.0 + x) - (f64::from(t) - d);
            // x comes out of s, which is next to 1/2.
            let rounding = 1.2e-7 * (d + a * x * (1.0 + 1.5 * x)) + 1e-13;
            assert!(rest.abs() < rounding, "d = {d:e}, e = {e:e}: {rest:e} > {rounding:e}");
        }
    }
}

#[test]
fn a_target_equal_to_the_detail_asks_for_exactly_one_half() {
    for d in values() {
        for (name, _, _, inverse, _) in OPERATORS {
            assert_eq!(inverse(d, d), 0.5, "{name} at {d}");
        }
    }
    // The plateaus, from the sides that rounding may leave.
    assert_eq!(smooth_overlay_inverse(0.0, 0.0), 0.5);
    assert_eq!(smooth_overlay_inverse(1.0, 1.0), 0.5);
}

#[test]
fn black_and_white_tiles_reach_every_target() {
    for d in [0.0, 1.0] {
        for t in values() {
            for (name, exact, _, inverse, _) in OPERATORS {
                let got = exact(f64::from(inverse(t, d)), f64::from(d));
                assert!((got - f64::from(t)).abs() < 3e-7, "{name}: d = {d}, wanted {t}, got {got}");
            }
        }
    }
}

#[test]
fn slopes_are_difference_quotients() {
    for (name, exact, _, _, slope) in OPERATORS {
        for d in values() {
            for s in values() {
                let (s, d) = (f64::from(s), f64::from(d));
                // From above, where the slope is defined to be at kinks.
                let h = 1e-6;
                if s + h > 1.0 || (s < 0.5 && s + h > 0.5) {
                    continue;
                }
                let want = (exact(s + h, d) - exact(s, d)) / h;
                let got = f64::from(slope(s as f32, d as f32));
                assert!((want - got).abs() < 2e-5, "{name} at s = {s}, d = {d}: wanted {want}, got {got}");
            }
        }
    }
}

/// Largest error of a target whose s is rounded to 8 bits: the price of smoothness is 2.4 steps over black.
#[test]
fn eight_bits_cost_one_step_in_overlay_and_two_and_a_half_in_smooth_overlay() {
    for ((name, exact, _, inverse, _), want) in OPERATORS.into_iter().zip([1.0, 2.42]) {
        let mut worst = 0.0_f64;
        for i in 0..=1000 {
            for j in 0..=1000 {
                let (t, d) = (i as f32 / 1000.0, j as f32 / 1000.0);
                let s = f64::from((inverse(t, d) * 255.0).round()) / 255.0;
                worst = worst.max((exact(s, f64::from(d)) - f64::from(t)).abs() * 255.0);
            }
        }
        assert!((worst - want).abs() < 0.03, "{name}: wanted {want} steps, got {worst}");
    }
}

/// The byte of a synthesized value and back: the neutral one and both ends are exact.
#[test]
fn stored_values_hold_the_neutral_one() {
    for (byte, want) in [(0.0, 0.0), (1.0, 0.0), (128.0, 0.5), (255.0, 1.0)] {
        let got = detail_from_texel(Vec3::splat(byte / 255.0)).x;
        assert!((got - want).abs() < 1e-7, "byte {byte}: wanted {want}, got {got}");
    }
}

fn hemisphere() -> impl Strategy<Value = Vec3> {
    (0.0..1.0_f32, 0.0..std::f32::consts::TAU)
        .prop_map(|(z, phi)| (Vec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z).normalize())
}

/// A normal within 45° of z.
fn normal() -> impl Strategy<Value = Vec3> {
    hemisphere().prop_filter_map("steeper than 45°", |n| (n.z > 0.7072).then_some(n))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn rnm_is_the_shortest_arc_rotation(base in hemisphere(), detail in hemisphere()) {
        let (want, got) = (m_n(base) * detail, rnm(base, detail));
        prop_assert!(want.distance(got) < 1e-6, "{base} over {detail}: wanted {want}, got {got}");
    }

    #[test]
    fn normals_within_45_degrees_are_found_exactly(target in normal(), detail in normal()) {
        let s = rnm_inverse(target, detail);
        prop_assert!(s.z >= 0.0 && (s.length() - 1.0).abs() < 1e-6, "{s}");
        let got = rnm(s, detail);
        prop_assert!(got.distance(target) < 2e-6, "{target} from {detail}: s = {s} gives {got}");
    }

    /// Whatever the pair, s is a normal that a map can hold, and exact above the horizon.
    #[test]
    fn normals_below_the_horizon_stop_on_it(target in hemisphere(), detail in hemisphere()) {
        let s = rnm_inverse(target, detail);
        prop_assert!(s.z >= 0.0 && (s.length() - 1.0).abs() < 1e-6, "{target} from {detail}: {s}");
        let apart = (target - detail).truncate().length();
        if apart < (target.z + detail.z) * 0.999 {
            let got = rnm(s, detail);
            prop_assert!(got.distance(target) < 4e-6, "{target} from {detail}: s = {s} gives {got}");
        } else if apart > (target.z + detail.z) * 1.001 {
            prop_assert!(s.z == 0.0, "{s}");
        }
    }

    /// Beside all bases of a fine grid on the horizon, through the rotation itself.
    #[test]
    fn another_base_on_the_horizon_is_nearer(target in hemisphere(), detail in hemisphere()) {
        prop_assume!((target - detail).truncate().length() > target.z + detail.z);
        let angle = |base: Vec3| {
            let got = (m_n(base) * detail).as_dvec3();
            got.cross(target.as_dvec3()).length().atan2(got.dot(target.as_dvec3())).to_degrees()
        };
        let s = rnm_inverse(target, detail);
        let grid = (0..3600).map(|i| Vec2::from_angle((0.1 * i as f32).to_radians()).extend(0.0));
        let best = grid.min_by(|a, b| angle(*a).total_cmp(&angle(*b))).unwrap();
        let (want, got) = (angle(best), angle(s));
        prop_assert!(got <= want + 1e-3, "{target} from {detail}: {s} is {got}° off, {best} {want}°");
    }

    #[test]
    fn over_finds_what_lies_in_reach(
        s in prop::array::uniform3(0.0..=1.0_f32),
        d in prop::array::uniform3(0.0..=1.0_f32),
        alpha in 0.0..0.95_f32,
    ) {
        let (s, d) = (Vec3::from(s), Vec3::from(d));
        let target = detail_over(s, d, alpha);
        let found = detail_over_inverse(target, d, alpha);
        prop_assert!(detail_over(found, d, alpha).distance(target) < 1e-6, "{found}");
        prop_assert!(found.distance(s) < 1e-6 / (1.0 - alpha), "wanted {s}, got {found}");
    }

    /// A hexcone, written from its definition instead of as trapezoids.
    #[test]
    fn hsv_turns_through_the_hexcone(
        rgb in prop::array::uniform3(0.0..=1.0_f64), shift in prop::array::uniform3(0.0..2.0_f64)
    ) {
        let want = shift_by_sectors(rgb.into(), shift.into());
        let got = hsv_shift(DVec3::from(rgb).as_vec3(), DVec3::from(shift).as_vec3()).as_dvec3();
        prop_assert!(want.distance(got) < 1e-5, "{rgb:?} by {shift:?}: wanted {want}, got {got}");
    }

    #[test]
    fn turned_lobes_keep_their_alphas(
        alphas in prop::array::uniform2(0.02..1.0_f32), phi in 0.0..3.1_f32, turn in 0.0..6.2_f32
    ) {
        let a = aniso_from_alphas(alphas[0], alphas[1], Vec2::from_angle(phi));
        let rotation = Vec2::from_angle(turn);
        let got = aniso_decode_matrix(detail_turn_aniso(aniso_encode(a), rotation, Vec2::ONE));
        // As the normals turn.
        let axis = detail_turn_normal(Vec2::from_angle(phi).extend(0.0), rotation, Vec2::ONE).truncate();
        let want = aniso_from_alphas(alphas[0], alphas[1], axis);
        for (want, got) in [(want.xx, got.xx), (want.xy, got.xy), (want.yy, got.yy)] {
            prop_assert!((want - got).abs() < 1e-5, "wanted {want}, got {got}");
        }
    }
}

fn shift_by_sectors(rgb: DVec3, shift: DVec3) -> DVec3 {
    let (value, chroma) = (rgb.max_element(), rgb.max_element() - rgb.min_element());
    let hue = if chroma == 0.0 {
        0.0
    } else if value == rgb.x {
        ((rgb.y - rgb.z) / chroma).rem_euclid(6.0)
    } else if value == rgb.y {
        (rgb.z - rgb.x) / chroma + 2.0
    } else {
        (rgb.x - rgb.y) / chroma + 4.0
    };
    let hue = (hue + 6.0 * shift.x).rem_euclid(6.0);
    let saturation = if value == 0.0 { 0.0 } else { (chroma / value * shift.y).min(1.0) };
    let value = (value * shift.z).min(1.0);
    let chroma = value * saturation;
    let x = chroma * (1.0 - (hue.rem_euclid(2.0) - 1.0).abs());
    let rgb = match hue as u32 {
        0 => dvec3(chroma, x, 0.0),
        1 => dvec3(x, chroma, 0.0),
        2 => dvec3(0.0, chroma, x),
        3 => dvec3(0.0, x, chroma),
        4 => dvec3(x, 0.0, chroma),
        _ => dvec3(chroma, 0.0, x),
    };
    rgb + (value - chroma)
}

#[test]
fn hsv_leaves_alone_what_is_not_shifted() {
    for color in [vec3(0.0, 0.0, 0.0), vec3(1.0, 1.0, 1.0), vec3(0.3, 0.2, 0.7), vec3(0.5, 0.5, 0.1)] {
        let got = hsv_shift(color, vec3(0.0, 1.0, 1.0));
        assert!(got.distance(color) < 1e-6, "wanted {color}, got {got}");
    }
}

/// A bumpy surface seen through a layer's transform: the normal of the transformed heights is the turned normal.
#[test]
fn turned_normals_are_those_of_turned_heights() {
    let height = |p: Vec2| 0.1 * (3.0 * p.x + 0.5).sin() + 0.07 * (2.0 * p.y - 4.0 * p.x).cos();
    // y up in normals, v down in textures.
    let normal = |height: &dyn Fn(Vec2) -> f32, p: Vec2| {
        let h = 1e-2;
        let slope = |step: Vec2| (height(p + step) - height(p - step)) / (2.0 * h);
        vec3(-slope(vec2(h, 0.0)), slope(vec2(0.0, h)), 1.0).normalize()
    };
    let mirrored = |p: Vec2| {
        let fold = |x: f32| 1.0 - ((0.5 * x).rem_euclid(1.0) * 2.0 - 1.0).abs();
        vec2(fold(p.x), fold(p.y))
    };
    for angle in [0.0_f32, 0.4, 1.57, 3.0, -2.0] {
        let (sin, cos) = angle.sin_cos();
        let matrix = Mat2::from_cols(vec2(cos, -sin), vec2(sin, cos));
        let offset = vec2(0.3, 0.7);
        for p in [vec2(0.2, 0.4), vec2(1.3, 0.4), vec2(-0.8, 2.3), vec2(1.6, -1.4)] {
            let in_tile = detail_uv(p, matrix, offset);
            let want = normal(&|p| height(mirrored(detail_uv(p, matrix, offset))), p);
            let in_tile_normal = normal(&height, mirrored(in_tile));
            let got = detail_turn_normal(in_tile_normal, vec2(cos, sin), detail_mirror(in_tile));
            assert!(got.distance(want) < 2e-3, "{angle} at {p}: wanted {want}, got {got}");
        }
    }
}

#[test]
fn contrast_of_a_mask_turns_around_one_half() {
    for (mask, contrast, want) in
        [(0.3, 1.0, 0.3), (0.3, 0.0, 0.5), (0.6, 4.0, 0.9), (0.1, 4.0, 0.0), (0.9, 10.0, 1.0)]
    {
        let got = detail_mask(mask, contrast);
        assert!((got - want).abs() < 1e-6, "{mask} at {contrast}: wanted {want}, got {got}");
    }
}

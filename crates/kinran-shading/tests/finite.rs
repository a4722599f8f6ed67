//! No NaN, no infinity and nothing out of range, at the ends of every documented range.

use glam::{Vec2, Vec3, vec2};
use kinran_shading::{
    ALPHA_MIN, Sym2, Sym3, alphas_from_khr_anisotropy, aniso_decode, aniso_decode_matrix, aniso_encode,
    aniso_from_alphas, axis_from_direction, beckmann_aniso_d, direction_from_axis, ggx_aniso_d, ggx_d,
    ggx_directional_albedo, ggx_from_sggx, ggx_matrix_d, ggx_vndf_pdf, ggx_vndf_sample,
    khr_anisotropy_from_alphas, m_n, microfacet_basis, multiscatter_compensation, normal_from_xy, schlick_f,
    sggx_from_ggx, sggx_power_iteration, sggx_principal_axis, sggx_projected_area, sigma_from_alpha,
    slopes_from_sggx, smith_aniso_g1, smith_aniso_v, smith_matrix_v, smith_v,
};
use proptest::prelude::*;

/// Evenly spread numbers and both ends, and what lies next to them.
fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => 0.0_f32..=1.0,
        1 => Just(0.0),
        1 => Just(1.0),
        1 => (-30.0_f32..0.0).prop_map(f32::exp2),
        1 => (-24.0_f32..0.0).prop_map(|x| 1.0 - x.exp2()),
    ]
}

fn alpha() -> impl Strategy<Value = f32> {
    prop_oneof![unit(), Just(0.0)].prop_map(|x| ALPHA_MIN + (1.0 - ALPHA_MIN) * x)
}

fn axis() -> impl Strategy<Value = Vec2> {
    prop_oneof![
        4 => (0.0_f32..std::f32::consts::TAU).prop_map(Vec2::from_angle),
        1 => Just(Vec2::X),
        1 => Just(Vec2::Y),
        1 => Just(Vec2::NEG_X),
        1 => Just(Vec2::splat(std::f32::consts::FRAC_1_SQRT_2)),
    ]
}

/// Unit vectors of the closed upper hemisphere, the normal and the horizon among them.
fn upper() -> impl Strategy<Value = Vec3> {
    (axis(), unit()).prop_map(|(a, z)| (a * (1.0 - z * z).max(0.0).sqrt()).extend(z).normalize())
}

/// The same without the horizon itself, where a view sees nothing: down to 6e-5 of a degree.
fn view() -> impl Strategy<Value = Vec3> {
    (axis(), unit()).prop_map(|(a, z)| (a * (1.0 - z * z).max(0.0).sqrt()).extend(z.max(1e-6)).normalize())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn lobes(u in view(), v in view(), alphas in (alpha(), alpha()), turn in axis()) {
        let (t, b) = alphas;
        let h = (u + v).normalize_or(Vec3::Z);
        let a = aniso_from_alphas(t.max(b), t.min(b), turn).clamp_eigen(ALPHA_MIN * ALPHA_MIN, 1.0);
        for (name, d) in [("aniso", ggx_aniso_d(h, t, b)), ("round", ggx_d(h.z, t)), ("matrix", ggx_matrix_d(h, a))] {
            // The peak of the sharpest lobe is 1 / (π alpha²); a tenth more for the rounding of a determinant.
            let peak = 1.1 / (std::f32::consts::PI * ALPHA_MIN * ALPHA_MIN);
            prop_assert!((0.0..=peak).contains(&d), "D {name}: {d}");
        }
        for (name, g) in [
            ("aniso", smith_aniso_v(u, v, t, b)),
            ("round", smith_v(u.z, v.z, t)),
            ("matrix", smith_matrix_v(u, v, a)),
        ] {
            // G2 <= 1, so V <= 1 / (4 n·u n·v).
            prop_assert!(g > 0.0 && g <= 1.0001 / (4.0 * u.z * v.z), "V {name}: {g}");
        }
        let g1 = smith_aniso_g1(v, t, b);
        prop_assert!((0.0..=1.000_001).contains(&g1), "G1: {g1}");
        let f = schlick_f(Vec3::new(0.0, 0.04, 1.0), v.dot(h));
        prop_assert!(f.cmpge(Vec3::ZERO).all() && f.cmple(Vec3::ONE).all(), "F: {f}");
        let factor = multiscatter_compensation(Vec3::ONE, v, t, b).x;
        prop_assert!((1.0..=1.0 / 0.3 + 1e-6).contains(&factor), "compensation: {factor}");
        let e = ggx_directional_albedo(v.z, t);
        prop_assert!((0.3..=1.0).contains(&e), "E: {e}");
        let d = beckmann_aniso_d(h, sigma_from_alpha(t), sigma_from_alpha(b));
        prop_assert!(d >= 0.0 && d.is_finite(), "Beckmann: {d}");
    }

    #[test]
    fn samples(v in upper(), alphas in (alpha(), alpha()), xi in (unit(), unit())) {
        let (t, b) = alphas;
        let below_one = 1.0 - f32::EPSILON / 2.0;
        let h = ggx_vndf_sample(v, t, b, vec2(xi.0.min(below_one), xi.1.min(below_one)));
        prop_assert!(h.is_normalized() && h.z >= 0.0, "h: {h}");
        let pdf = ggx_vndf_pdf(v, h, t, b);
        prop_assert!(pdf >= 0.0 && pdf.is_finite(), "pdf: {pdf}");
    }

    #[test]
    fn matrices(
        n in upper(), other in upper(), start in upper(), alphas in (alpha(), alpha()), turn in axis(), w in unit(),
        scale in -40.0_f32..40.0,
    ) {
        let (t, b) = alphas;
        let a = aniso_from_alphas(t.max(b), t.min(b), turn);
        let s = sggx_from_ggx(n, a) * w + sggx_from_ggx(other, a) * (1.0 - w);
        for scale in [1.0, scale.exp2()] {
            for start in [start, n, other, Vec3::Z] {
                let (n, a) = ggx_from_sggx(s * scale, start);
                prop_assert!(n.is_normalized() && n.z >= 0.0, "n: {n}");
                prop_assert!(a.xx >= 0.0 && a.yy >= 0.0 && a.xx <= 1.000_001 && a.yy <= 1.000_001, "A: {a:?}");
                let texel = aniso_encode(a);
                prop_assert!(texel.cmpge(Vec3::ZERO).all() && texel.cmple(Vec3::ONE).all(), "texel: {texel}");
                prop_assert!(microfacet_basis(n, a).iter().all(|v| v.is_finite()), "basis of {n}, {a:?}");
                prop_assert!(sggx_principal_axis(s * scale, start).is_normalized());
                prop_assert!(sggx_power_iteration(s * scale, start, 8).is_normalized());
            }
        }
        let area = sggx_projected_area(s, start);
        prop_assert!((0.0..=1.000_001).contains(&area), "projected area: {area}");
        let (m, slopes) = slopes_from_sggx(s);
        prop_assert!(m.is_finite() && (slopes.xx + slopes.xy + slopes.yy).is_finite(), "slopes: {m} {slopes:?}");
    }

    #[test]
    fn frames(x in -1.0_f32..=1.0, y in -1.0_f32..=1.0, d in axis()) {
        let n = normal_from_xy(x, y);
        prop_assert!(n.is_normalized() && n.z >= 0.0, "n: {n}");
        prop_assert!(m_n(n).is_finite() && m_n(-n).is_finite(), "M of ±{n}");
        for axis in [axis_from_direction(d, n), direction_from_axis(d, n)] {
            prop_assert!((axis.length() - 1.0).abs() < 1e-6, "axis: {axis}");
        }
    }

    #[test]
    fn texels(x in unit(), y in unit(), z in unit(), roughness in unit(), strength in unit()) {
        let d = aniso_decode(Vec3::new(x, y, z), Vec3::X, Vec3::Y);
        prop_assert!(ALPHA_MIN <= d.alpha_b && d.alpha_b <= d.alpha_t && d.alpha_t <= 1.0, "{d:?}");
        prop_assert!(d.tangent.is_normalized() && d.bitangent.is_normalized(), "{d:?}");
        let a = aniso_decode_matrix(Vec3::new(x, y, z)).clamp_eigen(ALPHA_MIN * ALPHA_MIN, 1.0);
        let (l1, l2, _) = a.eigen();
        prop_assert!(l2 > 0.0 && l1 <= 1.000_001, "{a:?}");

        let (t, b) = alphas_from_khr_anisotropy(roughness, strength);
        prop_assert!(ALPHA_MIN <= b && b <= t && t <= 1.0, "{t} {b}");
        let (roughness, strength) = khr_anisotropy_from_alphas(t, b);
        prop_assert!((0.0..=1.0).contains(&roughness) && (0.0..=1.0).contains(&strength), "{roughness} {strength}");
    }

    #[test]
    fn symmetric_matrices(l1 in unit(), l2 in unit(), v in axis()) {
        let a = Sym2::from_eigen(l1.max(l2), l1.min(l2), v);
        let (e1, e2, axis) = a.eigen();
        prop_assert!(e1 >= e2 && e2 >= 0.0 && axis.is_normalized(), "{e1} {e2} {axis} of {a:?}");
        let root = a.sqrt();
        prop_assert!((root.xx + root.xy + root.yy).is_finite(), "{root:?} of {a:?}");
        let s = Sym3 { xx: a.xx, xy: a.xy, yy: a.yy, zz: l1, ..Sym3::default() };
        prop_assert!(s.det().is_finite() && s.adjugate().trace().is_finite());
    }
}

//! The layer of fibres against double precision, quadrature, statistics and a simulated layer.

#![allow(clippy::print_stdout, reason = "a test tells how much light returns")]

mod common;

use common::chi_squared::chi_squared_test;
use common::{Rng, cases, gauss_legendre, sphere};
use glam::{DMat3, DVec2, DVec3, Vec2, Vec3, dvec3};
use kinran_shading::fuzz::*;
use kinran_shading::{ggx_vndf_pdf, m_n};
use std::f64::consts::{PI, TAU};

/// From combed to all directions: spreads of 0.01, 0.09, 0.2, 0.49, 0.9 and 1.
const ALPHAS: [f32; 6] = [0.1, 0.3, 0.447, 0.7, 0.949, 1.0];

fn direction(polar: f64, azimuth: f64) -> DVec3 {
    (DVec2::from_angle(azimuth) * polar.sin()).extend(polar.cos())
}

/// SGGX fibres as Heitz 2015 writes them, by their matrix, in double precision.
#[derive(Clone, Copy, Debug)]
struct Fibres {
    t: DVec3,
    alpha: f64,
}

impl Fibres {
    fn new(tilt: f64, alpha: f32) -> Self {
        Fibres { t: direction(tilt.to_radians(), 0.3), alpha: alpha.into() }
    }

    fn s(self) -> DMat3 {
        let k = 1.0 - self.alpha * self.alpha;
        DMat3::IDENTITY - DMat3::from_cols(self.t * self.t.x, self.t * self.t.y, self.t * self.t.z) * k
    }

    fn d(self, h: DVec3) -> f64 {
        let q = h.dot(self.s().inverse() * h);
        1.0 / (PI * self.s().determinant().sqrt() * q * q)
    }

    fn area(self, w: DVec3) -> f64 {
        w.dot(self.s() * w).sqrt()
    }

    fn phase(self, u: DVec3, v: DVec3) -> f64 {
        self.d((u + v).normalize()) / (4.0 * self.area(u))
    }

    /// The layer's BRDF, for any phase.
    fn layer(phase: f64, u: DVec3, v: DVec3, density: f64) -> f64 {
        -phase * f64::exp_m1(-density * (u.z + v.z) / (u.z * v.z)) / (u.z + v.z)
    }

    fn f(self, u: DVec3, v: DVec3, density: f64) -> f64 {
        Self::layer(self.phase(u, v), u, v, density)
    }

    /// A reflection of `u` on a visible normal, by the sampler of Heitz 2015, listing 3: a Cholesky factor
    /// in a frame along `u`.
    fn scatter(self, u: DVec3, rng: &mut Rng) -> DVec3 {
        let (wk, wj) = u.any_orthonormal_pair();
        let s = self.s();
        let form = |a: DVec3, b: DVec3| a.dot(s * b);
        let (skk, sjj, sii) = (form(wk, wk), form(wj, wj), form(u, u));
        let (skj, ski, sji) = (form(wk, wj), form(wk, u), form(wj, u));
        let det =
            skk * sjj * sii - skj * skj * sii - ski * ski * sjj - sji * sji * skk + 2.0 * skj * ski * sji;
        let (inv, tmp) = (1.0 / sii.sqrt(), (sjj * sii - sji * sji).sqrt());
        let mk = dvec3(det.sqrt() / tmp, 0.0, 0.0);
        let mj = dvec3(-inv * (ski * sji - skj * sii) / tmp, inv * tmp, 0.0);
        let mi = dvec3(inv * ski, inv * sji, inv * sii);
        let (r, phi) = (rng.unit().sqrt(), TAU * rng.unit());
        let m = mk * (r * phi.cos()) + mj * (r * phi.sin()) + mi * (1.0 - r * r).sqrt();
        let h = (wk * m.x + wj * m.y + u * m.z).normalize();
        h * (2.0 * u.dot(h)) - u
    }
}

/// The integral of a function of the upper hemisphere, `2n²` nodes with rows dense at the horizon.
fn over_hemisphere(n: usize, mut f: impl FnMut(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for (x, weight) in gauss_legendre(n, 0.0, 1.0) {
        // z = x²
        let (z, weight) = (x * x, weight * 2.0 * x);
        for column in 0..2 * n {
            let e = DVec2::from_angle(TAU * (column as f64 + 0.5) / (2 * n) as f64) * (1.0 - z * z).sqrt();
            sum += f(e.extend(z)) * weight * TAU / (2 * n) as f64;
        }
    }
    sum
}

fn close(what: &str, got: f64, wanted: f64, tolerance: f64, input: impl std::fmt::Debug) {
    assert!(
        (got - wanted).abs() <= tolerance,
        "{what}: wanted {wanted}, got {got}, tolerance {tolerance:.1e}, for {input:?}"
    );
}

#[test]
fn the_fibres_are_sggx_with_one_small_eigenvalue() {
    for alpha in ALPHAS {
        for mut rng in cases(1, 500) {
            let fibres = Fibres { t: rng.direction(-1.0, 1.0), alpha: alpha.into() };
            let (u, v) = (rng.direction(-1.0, 1.0), rng.direction(-1.0, 1.0));
            let (u32, v32, t32) = (u.as_vec3(), v.as_vec3(), fibres.t.as_vec3());
            let d = f64::from(fibre_d(t32.dot(u32), alpha));
            close("fibre_d", d / fibres.d(u), 1.0, 2e-5 / f64::from(alpha), (u, fibres));
            let area = f64::from(fibre_projected_area(t32.dot(u32), alpha));
            close("fibre_projected_area", area / fibres.area(u), 1.0, 3e-5, (u, fibres));
            if u.dot(v) > -0.98 {
                let p = f64::from(fibre_phase(u32.dot(v32), t32.dot(u32), t32.dot(v32), alpha));
                close("fibre_phase", p / fibres.phase(u, v), 1.0, 2e-4, (u, v, fibres));
            }
        }
    }
}

#[test]
fn what_a_fibre_scatters_is_what_it_meets() {
    for alpha in ALPHAS {
        let fibres = Fibres::new(23.0, alpha);
        for mut rng in cases(2, 4) {
            let u = rng.direction(-1.0, 1.0);
            // dv = 4 u·h dh
            let over_normals: f64 = (sphere(fibres.t, 160).into_iter())
                .map(|(h, solid_angle)| {
                    let v = h * (2.0 * u.dot(h)) - u;
                    let p =
                        fibre_phase(u.dot(v) as f32, fibres.t.dot(u) as f32, fibres.t.dot(v) as f32, alpha);
                    f64::from(p) * 4.0 * u.dot(h).max(0.0) * solid_angle
                })
                .sum();
            close("∫ p_F dv", over_normals, 1.0, 5e-4, (u, fibres));
        }
    }
}

#[test]
fn swapping_light_and_view_changes_fibres_by_their_area_and_velvet_not_at_all() {
    for alpha in ALPHAS {
        for mut rng in cases(3, 300) {
            let fibres = Fibres { t: rng.direction(0.0, 1.0), alpha: alpha.into() };
            let (u, v) = (rng.direction(0.02, 1.0), rng.direction(0.02, 1.0));
            let (u32, v32, t32) = (u.as_vec3(), v.as_vec3(), fibres.t.as_vec3());
            let ratio = fuzz_brdf(u32, v32, t32, 0.2, alpha) / fuzz_brdf(v32, u32, t32, 0.2, alpha);
            close("fibres", f64::from(ratio) * fibres.area(u) / fibres.area(v), 1.0, 1e-4, (u, v, fibres));
            let ratio = fuzz_reciprocal_brdf(u32, v32, t32, 0.2, alpha)
                / fuzz_reciprocal_brdf(v32, u32, t32, 0.2, alpha);
            close("reciprocal", ratio.into(), 1.0, 1e-5, (u, v, fibres));
            let k = velvet_k(alpha * alpha);
            let ratio = fuzz_velvet_brdf(u32, v32, t32, 0.2, k) / fuzz_velvet_brdf(v32, u32, t32, 0.2, k);
            close("velvet", ratio.into(), 1.0, 1e-5, (u, v, fibres));
        }
    }
}

#[test]
fn the_brdf_has_the_value_of_the_corrected_slide_in_double_precision() {
    for alpha in ALPHAS {
        for mut rng in cases(4, 500) {
            let fibres = Fibres { t: rng.direction(-1.0, 1.0), alpha: alpha.into() };
            let (u, v) = (rng.direction(0.01, 1.0), rng.direction(0.01, 1.0));
            let density = rng.range(0.01, 1.0);
            // The half vector cancels where light and view are opposite.
            if u.dot(v) < -0.95 {
                continue;
            }
            let (u32, v32, t32, d32) = (u.as_vec3(), v.as_vec3(), fibres.t.as_vec3(), density as f32);
            let wanted = fibres.f(u, v, density);
            let got = f64::from(fuzz_brdf(u32, v32, t32, d32, alpha));
            close("fuzz_brdf", got / wanted, 1.0, 3e-4, (u, v, fibres, density));
            let view = fuzz_view(v32.z, t32.dot(v32), d32, alpha);
            let light = fuzz_light(view, u32.z, t32.dot(u32), u32.dot(v32));
            close("fuzz_light", f64::from(light.lobe) / wanted, 1.0, 3e-4, (u, v, fibres, density));
            close("P_p", light.penetrated.into(), (-density / u.z).exp(), 1e-5, (u, density));
            close("P_e", view.escaped.into(), (-density / v.z).exp(), 1e-5, (v, density));
        }
    }
    assert_eq!(fuzz_brdf(Vec3::new(0.8, 0.0, -0.6), Vec3::Z, Vec3::X, 0.2, 0.5), 0.0, "light from below");
    // Isotropic, d = 0.1, u along the normal, v at 60°: 1/4π (1 - e^-0.3) / 1.5.
    let v = Vec3::new(0.75f32.sqrt(), 0.0, 0.5);
    let wanted = (1.0 - f64::exp(-0.3)) / (1.5 * 4.0 * PI);
    close("isotropic", fuzz_brdf(Vec3::Z, v, Vec3::Z, 0.1, 1.0).into(), wanted, 1e-7, ());
}

/// The integral of Schlick's velvet phase without r(k), for light at cosine `c` to the fibre.
fn velvet_integral(k: f64, c: f64) -> f64 {
    let u = dvec3((1.0 - c * c).sqrt(), 0.0, c);
    // Over half vectors, dense where they lie across the fibre: z = x³.
    let mut sum = 0.0;
    for (x, weight) in gauss_legendre(300, -1.0, 0.0).into_iter().chain(gauss_legendre(300, 0.0, 1.0)) {
        let (z, weight) = (x.powi(3), 3.0 * x * x * weight);
        let r = (1.0 - z * z).sqrt();
        let p = (1.0 - k * k) / (4.0 * PI * (1.0 - k * r).powi(2));
        for column in 0..400 {
            let phi = TAU * (f64::from(column) + 0.5) / 400.0;
            let h = dvec3(r * phi.cos(), r * phi.sin(), z);
            sum += p * 4.0 * u.dot(h).max(0.0) * weight * TAU / 400.0;
        }
    }
    sum
}

#[test]
fn velvet_never_scatters_more_than_arrives() {
    for (k, wanted) in [(0.1, 1.1834), (0.5, 2.3881), (0.8, 5.0358), (0.9, 7.8995), (0.99, 27.85)] {
        close("N(k) across the fibres", velvet_integral(k, 0.0) / wanted, 1.0, 1e-3, k);
        for c in [0.0, 0.3, 0.7, 1.0] {
            let scattered = velvet_integral(k, c) * f64::from(velvet_normalization(k as f32));
            assert!(scattered <= 1.0 + 1e-4, "k {k}, t·u {c}: {scattered} of 1 is scattered");
            assert!(c > 0.0 || scattered >= 0.88, "k {k}: only {scattered} is scattered across the fibres");
        }
    }
    // Upright fibres of the slide's sign would scatter forward; velvet scatters back.
    let back = velvet_phase(1.0, 0.2, 0.2, 0.8);
    let forward = velvet_phase(-0.92, 0.2, 0.2, 0.8);
    assert!(back > 2.0 * forward, "wanted more back scattering, got {back} back and {forward} forward");
}

#[test]
fn velvet_and_fibres_of_one_spread_agree_on_where_half_vectors_shine() {
    // The perpendicular over the parallel: alpha^-4 of D_F, (1-k)^-2 of Schlick's.
    for spread in [0.2f32, 0.5, 0.9] {
        let ratio = fibre_d(0.0, fuzz_alpha(spread)) / fibre_d(1.0, fuzz_alpha(spread));
        // u = v = h along the fibre and across it.
        let velvet =
            velvet_phase(1.0, 0.0, 0.0, velvet_k(spread)) / velvet_phase(1.0, 1.0, 1.0, velvet_k(spread));
        close("ratio", (velvet / ratio).into(), 1.0, 2e-3, spread);
    }
    close("the talk's alpha", fuzz_alpha(0.9).into(), 0.95, 0.002, 0.9);
    close("the talk's k", velvet_k(0.9).into(), 0.1, 1e-6, 0.9);
    assert_eq!(fuzz_alpha(0.0), FUZZ_ALPHA_MIN);
}

#[test]
fn the_closed_form_of_p_s_is_what_goes_below_the_horizon() {
    for alpha in ALPHAS {
        for mut rng in cases(5, 24) {
            let fibres = Fibres { t: rng.direction(-1.0, 1.0), alpha: alpha.into() };
            let u = rng.direction(0.0, 1.0);
            let n = if alpha < 0.2 { 240 } else { 96 };
            let wanted = 1.0 - over_hemisphere(n, |v| fibres.phase(u, v));
            let p_s = |t: DVec3| f64::from(fibre_p_s(u.z as f32, t.dot(u) as f32, t.z as f32, alpha));
            close("P_s", p_s(fibres.t), wanted, 3e-4, (u, fibres));
            close("P_s of the fibre turned round", p_s(-fibres.t), p_s(fibres.t), 1e-5, (u, fibres));
        }
    }
    close("isotropic", fibre_p_s(0.4, 0.3, 0.5, 1.0).into(), 0.5, 1e-6, ());
}

#[test]
fn p_s_holds_at_the_edges_of_its_arguments() {
    for alpha in ALPHAS {
        for (n_u, t_u, t_n) in
            [(0.0, 0.0, 1.0), (1.0, 1.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1e-6, 0.0, 1.0)]
        {
            let p_s = fibre_p_s(n_u, t_u, t_n, alpha);
            assert!((0.0..=1.0).contains(&p_s), "P_s is {p_s} at {n_u}, {t_u}, {t_n}, alpha {alpha}");
        }
    }
}

/// Values of another implementation, by quadrature of the phase function.
#[test]
fn the_mean_of_p_s_over_uniform_irradiance_is_as_published() {
    let table = [
        (0.0, [0.9869, 0.9504, 0.8972, 0.8044, 0.7069, 0.5932, 0.5214]),
        (15.0, [0.9429, 0.9085, 0.8590, 0.7741, 0.6859, 0.5837, 0.5193]),
        (45.0, [0.6591, 0.6405, 0.6177, 0.5848, 0.5551, 0.5239, 0.5054]),
        (75.0, [0.3786, 0.3833, 0.3922, 0.4104, 0.4334, 0.4664, 0.4916]),
        (90.0, [0.3370, 0.3464, 0.3601, 0.3854, 0.4156, 0.4577, 0.4895]),
    ];
    for (tilt, row) in table {
        for (alpha, wanted) in [0.1f32, 0.2, 0.3, 0.447, 0.6, 0.8, 0.95].into_iter().zip(row) {
            let t = direction(f64::to_radians(tilt), 0.0);
            let r = over_hemisphere(64, |u| {
                f64::from(fibre_p_s(u.z as f32, t.dot(u) as f32, t.z as f32, alpha)) * u.z / PI
            });
            close("R", r, wanted, 3e-4, (tilt, alpha));
        }
    }
}

#[test]
fn six_coefficients_of_the_talk_are_as_far_off_as_stated() {
    // Tilt 30°, alpha 0.447.
    let coefficients = [0.5034, -0.1933, 0.6330, 0.1224, -0.2204, -0.0299];
    let t = direction(30f64.to_radians(), 0.0);
    let (mut worst, mut square) = (0.0f64, 0.0);
    over_hemisphere(48, |u| {
        let (n_u, t_u) = (u.z as f32, t.dot(u) as f32);
        let error = f64::from(fuzz_p_s(coefficients, n_u, t_u) - fibre_p_s(n_u, t_u, t.z as f32, 0.447));
        worst = worst.max(error.abs());
        square += error * error / (48.0 * 96.0);
        0.0
    });
    assert!((0.030..0.036).contains(&worst) && square.sqrt() < 0.012, "max {worst}, RMS {}", square.sqrt());
}

/// Exponential integral E1 for x > 0 (Abramowitz and Stegun 5.1.11; 5.1.22 as a continued fraction).
fn e1(x: f64) -> f64 {
    if x <= 1.0 {
        let mut sum = -0.577_215_664_901_532_9 - x.ln();
        let mut term = -1.0;
        for k in 1..40 {
            term *= -x / f64::from(k);
            sum += term / f64::from(k);
        }
        return sum;
    }
    let tail = (1..400).rev().fold(0.0, |tail, k| f64::from(k) / (1.0 + f64::from(k) / (x + tail)));
    (-x).exp() / (x + tail)
}

/// `(1/2π) ∫ g du` in closed form.
fn g_exact(d: f64, x: f64) -> f64 {
    let e2 = (-d).exp() - d * e1(d);
    1.0 - x * (1.0 + 1.0 / x).ln() - (-d / x).exp() * (e2 - x * e1(d)) - x * e1(d * (1.0 + 1.0 / x))
}

#[test]
fn g_follows_its_closed_form_to_grazing_and_for_any_density() {
    let mut range = (f64::INFINITY, 0.0f64);
    for density in [0.002, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.8, 1.2, 2.0, 3.0] {
        for k in 0..=60 {
            let x = 0.002f64.powf(f64::from(k) / 60.0);
            let wanted = g_exact(density, x);
            let g = |mu: f64| -f64::exp_m1(-density * (1.0 / mu + 1.0 / x)) * mu / (mu + x);
            if k % 12 == 0 {
                let by_quadrature: f64 = (gauss_legendre(400, 0.0, 1.0).into_iter())
                    .map(|(y, w)| g(y.powi(3)) * 3.0 * y * y * w)
                    .sum();
                close("closed form of G", wanted, by_quadrature, 1e-8, (density, x));
            }
            let ratio = f64::from(fuzz_g(density as f32, x as f32)) / wanted;
            range = (range.0.min(ratio), range.1.max(ratio));
        }
    }
    assert!(range.0 > 0.963 && range.1 < 1.049, "fuzz_g over the closed form is {range:?}");
}

#[test]
fn the_talks_g_and_q_are_as_far_off_as_stated() {
    // Fitted for n_v in [0.1, 1], densities of 0.01 to 0.5, in relative error.
    let coefficients = [-0.6763, 0.0807, 0.8184, -0.4401];
    let (mut worst, mut relative) = (0.0f64, 0.0f64);
    for i in 0..50 {
        for j in 0..=90 {
            let (d, x) = (0.01 + 0.01 * f64::from(i), 0.1 + 0.01 * f64::from(j));
            let error = f64::from(fuzz_g_talk(coefficients, d as f32, x as f32)) - g_exact(d, x);
            worst = worst.max(error.abs());
            relative = relative.max((error / g_exact(d, x)).abs());
        }
    }
    assert!(worst < 0.046 && relative < 0.11, "G~: {worst}, relative {relative}");

    let e3 = |d: f64| 0.5 * ((-d).exp() - d * ((-d).exp() - d * e1(d)));
    for k in 1..=300 {
        let d = 0.01 * f64::from(k);
        close("Q", fuzz_q(d as f32).into(), 2.0 * e3(d), 4.4e-4, d);
        if d <= 0.5 {
            close("the talk's Q", fuzz_q_talk([-1.7303, 1.2734], d as f32).into(), 2.0 * e3(d), 0.0101, d);
        }
    }
    close("no layer", fuzz_q(0.0).into(), 1.0, 1e-7, 0.0);
}

/// Light in a furnace that a layer over a white Lambert base returns: for a view `v` of everything around,
/// and of what one light along `v` brings.
fn returned(fibres: Fibres, density: f64, v: DVec3, n: usize) -> (f64, f64) {
    let (t, alpha) = (fibres.t, fibres.alpha as f32);
    let passage = |w: DVec3| f64::from(fuzz_passage(density as f32, w.z as f32));
    let p_s = |u: DVec3| f64::from(fibre_p_s(u.z as f32, t.dot(u) as f32, t.z as f32, alpha));
    let base = |u: DVec3, v: DVec3| {
        let p = passage(u) as f32;
        f64::from(fuzz_attenuation(p, passage(v) as f32, p_s(u) as f32, Vec3::ONE).x) / PI
    };
    let value = |u: DVec3, v: DVec3| {
        f64::from(fuzz_brdf(u.as_vec3(), v.as_vec3(), t.as_vec3(), density as f32, alpha)) + base(u, v)
    };
    (over_hemisphere(n, |u| value(u, v) * u.z), over_hemisphere(n, |u| value(v, u) * u.z))
}

#[test]
fn white_fibres_over_a_white_base_pass_the_furnace_everywhere() {
    let (mut seen, mut sent) = (0.0f64, 0.0f64);
    for alpha in [0.1, 0.2, 0.447, 0.7, 1.0f32] {
        for tilt in [0.0, 30.0, 60.0, 90.0] {
            for density in [0.01, 0.05, 0.2, 0.5, 1.0, 3.0] {
                for (polar, azimuth) in
                    [(0.0, 0.0), (40.0, 0.3), (70.0, 2.0), (84.0, 0.3), (84.0, 3.44), (89.0, 1.6)]
                {
                    let fibres = Fibres::new(tilt, alpha);
                    let n = if alpha < 0.3 { 48 } else { 24 };
                    let v = direction(f64::to_radians(polar), azimuth);
                    let (of_view, of_light) = returned(fibres, density, v, n);
                    assert!(
                        of_light <= 1.0,
                        "{of_light} of a light's power returns: {fibres:?}, density {density}, polar {polar}"
                    );
                    seen = seen.max(of_view);
                    sent = sent.max(of_light);
                }
            }
        }
    }
    println!("largest share of a light that returns: {sent}; of a furnace that a view sees: {seen}");
}

/// The layer as it is: one light's photons meet fibres at random depths, scatter once by a sampler of
/// another make and leave or do not. `reciprocal`: fibres are met as often as they are wide in that direction.
fn simulate(fibres: Fibres, density: f64, u: DVec3, reciprocal: bool, samples: u64, seed: u64) -> Vec<u64> {
    let mut rng = Rng::new(seed);
    let mut counts = vec![0; ROWS * COLUMNS + 1];
    let extinction = |w: DVec3| if reciprocal { density * fibres.area(w) } else { density };
    for _ in 0..samples {
        // Depth in units of the layer's thickness.
        let depth = -(1.0 - rng.unit()).ln() * u.z / extinction(u);
        let v = fibres.scatter(u, &mut rng);
        let leaves = depth < 1.0 && v.z > 0.0 && rng.unit() < (-extinction(v) * depth / v.z).exp();
        counts[if leaves { cell(v) } else { ROWS * COLUMNS }] += 1;
    }
    counts
}

const ROWS: usize = 12;
const COLUMNS: usize = 24;

/// A cell of the upper hemisphere.
fn cell(v: DVec3) -> usize {
    let row = ((v.z * ROWS as f64) as usize).min(ROWS - 1);
    let column = ((v.y.atan2(v.x) / TAU).rem_euclid(1.0) * COLUMNS as f64) as usize;
    row * COLUMNS + column.min(COLUMNS - 1)
}

/// Integrals of a function of direction over cells of `z` in [lo, 1].
fn integrals(lo: f64, rows: usize, n: usize, f: impl Fn(DVec3) -> f64) -> Vec<f64> {
    let height = (1.0 - lo) / rows as f64;
    let mut cells = Vec::with_capacity(rows * COLUMNS);
    for row in 0..rows {
        let z_rule = gauss_legendre(n, lo + row as f64 * height, lo + (row + 1) as f64 * height);
        for column in 0..COLUMNS {
            let step = TAU / COLUMNS as f64;
            let phi_rule = gauss_legendre(n, column as f64 * step, (column + 1) as f64 * step);
            let mut sum = 0.0;
            for &(z, dz) in &z_rule {
                for &(phi, dphi) in &phi_rule {
                    sum += f((DVec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z)) * dz * dphi;
                }
            }
            cells.push(sum);
        }
    }
    cells
}

#[test]
fn a_simulated_layer_scatters_as_the_brdf_says() {
    let samples = 1 << 19;
    let mut failures = String::new();
    let layers =
        [(0.0, 0.447, 0.2), (23.0, 0.447, 0.2), (23.0, 0.15, 0.5), (70.0, 0.95, 0.05), (90.0, 0.3, 1.0)];
    for (i, (tilt, alpha, density)) in layers.into_iter().enumerate() {
        let fibres = Fibres::new(tilt, alpha);
        for (j, u) in [direction(0.3, 1.0), direction(1.2, 2.5)].into_iter().enumerate() {
            for reciprocal in [false, true] {
                let f = |v: DVec3| {
                    let (u, v, t) = (u.as_vec3(), v.as_vec3(), fibres.t.as_vec3());
                    let d = density as f32;
                    let brdf = if reciprocal { fuzz_reciprocal_brdf } else { fuzz_brdf };
                    f64::from(brdf(u, v, t, d, alpha) * v.z)
                };
                let mut expected = integrals(0.0, ROWS, 20, f);
                expected.push(1.0 - expected.iter().sum::<f64>());
                expected.iter_mut().for_each(|e| *e *= samples as f64);
                let observed = simulate(fibres, density, u, reciprocal, samples, (4 * i + 2 * j) as u64);
                if let Err(report) = chi_squared_test(&observed, &expected, 20) {
                    failures +=
                        &format!("{fibres:?}, density {density}, u {u}, reciprocal {reciprocal}: {report}\n");
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn the_simulation_notices_a_density_that_is_off_by_ten_percent() {
    let (fibres, u, samples) = (Fibres::new(23.0, 0.447), direction(0.3, 1.0), 1 << 20);
    let mut expected = integrals(0.0, ROWS, 12, |v| fibres.f(u, v, 0.22) * v.z);
    expected.push(1.0 - expected.iter().sum::<f64>());
    expected.iter_mut().for_each(|e| *e *= samples as f64);
    chi_squared_test(&simulate(fibres, 0.2, u, false, samples, 9), &expected, 20)
        .expect_err("the layer has another density");
}

/// A cell of the whole sphere.
fn cell_of_sphere(u: DVec3) -> usize {
    let row = (((u.z + 1.0) * ROWS as f64) as usize).min(2 * ROWS - 1);
    let column = ((u.y.atan2(u.x) / TAU).rem_euclid(1.0) * COLUMNS as f64) as usize;
    row * COLUMNS + column.min(COLUMNS - 1)
}

fn chi_squared_of(
    sample: impl Fn(Vec2) -> Vec3,
    pdf: impl Fn(Vec3) -> f32,
    nodes: usize,
    seed: u64,
    family: u32,
) -> Result<f64, String> {
    let samples = 1 << 17;
    let mut rng = Rng::new(seed);
    let mut observed = vec![0; 2 * ROWS * COLUMNS];
    for _ in 0..samples {
        let u = sample(Vec2::new(rng.unit_f32(), rng.unit_f32())).as_dvec3();
        assert!((u.length() - 1.0).abs() < 1e-5, "a direction of length {}", u.length());
        observed[cell_of_sphere(u)] += 1;
    }
    let mut expected = integrals(-1.0, 2 * ROWS, nodes, |u| pdf(u.as_vec3()).into());
    expected.iter_mut().for_each(|e| *e *= f64::from(samples));
    chi_squared_test(&observed, &expected, family)
}

#[test]
fn samples_of_the_layer_follow_their_density() {
    let mut failures = String::new();
    for (i, alpha) in [0.1, 0.3, 0.447, 1.0f32].into_iter().enumerate() {
        for (j, tilt) in [0.0, 23.0, 90.0].into_iter().enumerate() {
            let t = Fibres::new(tilt, alpha).t.as_vec3();
            for (k, v) in [direction(0.2, 0.3), direction(1.3, 2.0)].into_iter().enumerate() {
                let v = v.as_vec3();
                let nodes = if alpha < 0.2 { 24 } else { 10 };
                let seed = (100 * i + 10 * j + k) as u64;
                let result = chi_squared_of(
                    |xi| fuzz_sample(v, t, alpha, xi),
                    |u| fuzz_pdf(u, v, t, alpha),
                    nodes,
                    seed,
                    24,
                );
                if let Err(report) = result {
                    failures += &format!("alpha {alpha}, tilt {tilt}, view {v}: {report}\n");
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

#[test]
fn samples_of_the_layer_and_its_base_follow_their_density() {
    let mut failures = String::new();
    let bases = [(0.5, 0.5), (0.6, 0.25)];
    for (i, (alpha, tilt)) in [(0.3f32, 23.0), (0.95, 60.0)].into_iter().enumerate() {
        for (j, (alpha_t, alpha_b)) in bases.into_iter().enumerate() {
            let t = Fibres::new(tilt, alpha).t.as_vec3();
            let v = direction(0.9, 2.0).as_vec3();
            let shares = fuzz_over_base_shares(0.3, 0.5, 0.4);
            assert!((shares.element_sum() - 1.0).abs() < 1e-6, "shares {shares}");
            let result = chi_squared_of(
                |xi| fuzz_over_base_sample(v, t, alpha, alpha_t, alpha_b, shares, xi),
                |u| fuzz_over_base_pdf(u, v, t, alpha, alpha_t, alpha_b, shares),
                16,
                (10 * i + j) as u64,
                4,
            );
            if let Err(report) = result {
                failures += &format!("fibres {alpha} at {tilt}°, base {alpha_t} {alpha_b}: {report}\n");
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
    let (u, v) = (direction(0.5, 0.1).as_vec3(), direction(0.7, 3.0).as_vec3());
    let only_base = fuzz_over_base_pdf(u, v, Vec3::Z, 0.5, 0.4, 0.2, Vec3::Y);
    let h = (u + v).normalize();
    let wanted = ggx_vndf_pdf(v, h, 0.4, 0.2) / (4.0 * v.dot(h));
    close("the base's part", (only_base / wanted).into(), 1.0, 1e-5, ());
}

#[test]
fn the_chi_squared_test_notices_a_spread_that_is_off_by_six_percent() {
    let (t, v) = (Fibres::new(23.0, 0.447).t.as_vec3(), direction(0.8, 2.0).as_vec3());
    chi_squared_of(|xi| fuzz_sample(v, t, 0.447, xi), |u| fuzz_pdf(u, v, t, 0.475), 10, 3, 24)
        .expect_err("the sampler has another alpha");
}

#[test]
fn sampling_survives_the_point_opposite_to_its_axis() {
    let v = direction(0.4, 1.0).as_vec3();
    for alpha in [0.1, 1.0] {
        let axis = {
            let t = Vec3::Z;
            (v - t * ((1.0 - alpha) * t.dot(v))).normalize()
        };
        let xi = Vec2::new(
            (axis.y.atan2(axis.x) / std::f32::consts::TAU + 0.5).rem_euclid(1.0),
            0.5 + 0.5 * axis.z,
        );
        let u = fuzz_sample(v, Vec3::Z, alpha, xi);
        assert!((u.length() - 1.0).abs() < 1e-4, "alpha {alpha}: {u}");
    }
}

#[test]
fn a_lobe_over_its_density_stays_below_one_over_alpha() {
    for alpha in ALPHAS {
        for mut rng in cases(8, 200) {
            let t = rng.direction(-1.0, 1.0).as_vec3();
            let v = rng.direction(0.01, 1.0).as_vec3();
            let u = fuzz_sample(v, t, alpha, Vec2::new(rng.unit_f32(), rng.unit_f32()));
            let weight = fuzz_brdf(u, v, t, 3.0, alpha) * u.z / fuzz_pdf(u, v, t, alpha);
            assert!(weight <= 1.001 / alpha, "weight {weight} at alpha {alpha}, u {u}, v {v}, t {t}");
        }
    }
}

#[test]
fn directions_of_fibres_are_tilted_from_the_normal() {
    for (tilt, azimuth) in [(0.0f32, 0.0f32), (0.4, 1.0), (1.57, -2.0)] {
        let t = fibre_direction(tilt, azimuth);
        let wanted = direction(tilt.into(), azimuth.into()).as_vec3();
        assert!(t.abs_diff_eq(wanted, 1e-6), "wanted {wanted}, got {t}");
    }
    let (n, vertex) = (m_n(direction(0.5, 0.0).as_vec3()).z_axis, Vec3::Z);
    assert!(fuzz_smooth_normal(n, vertex, 0.0).abs_diff_eq(n, 1e-6));
    assert!(fuzz_smooth_normal(n, vertex, 1.0).abs_diff_eq(vertex, 1e-6));
}

#[test]
fn ambient_light_of_one_colour_is_that_colour_and_a_linear_one_is_exact() {
    let mut radiance = [Vec3::ZERO; 9];
    radiance[0] = Vec3::new(1.0, 0.5, 0.25) / 0.282_094_8;
    let direction = Vec3::new(0.1, -0.2, 0.5);
    let got = fuzz_ambient_radiance(&radiance, direction);
    assert!(got.abs_diff_eq(Vec3::new(1.0, 0.5, 0.25), 1e-6), "{got}");
    // L = 1 + u·s: its mean over a lobe of mean direction m is 1 + m·s.
    let slope = Vec3::new(0.3, -0.4, 0.6);
    radiance[0] = Vec3::splat(1.0 / 0.282_094_8);
    for (i, component) in [(1, slope.y), (2, slope.z), (3, slope.x)] {
        radiance[i] = Vec3::splat(component / 0.488_602_52);
    }
    let got = fuzz_ambient_radiance(&radiance, direction).x;
    close("linear light", got.into(), (1.0 + direction.dot(slope)).into(), 1e-6, ());
    let mean = over_hemisphere(32, |u| 1.0 + u.dot(slope.as_dvec3())) / TAU;
    close("mean of the hemisphere", fuzz_ambient_mean(&radiance, Vec3::Z).x.into(), mean, 1e-6, ());
}

#[test]
fn base_light_under_the_layer_is_exact_for_uniform_light_and_fibres_in_all_directions() {
    for density in [0.05f64, 0.2, 0.5, 1.5] {
        let d = density as f32;
        let wanted = over_hemisphere(64, |u| {
            let passed = fuzz_passage(d, u.z as f32);
            f64::from(fuzz_attenuation(passed, 0.7, 0.5, Vec3::ONE).x) * u.z / PI
        });
        let got = fuzz_ambient_attenuation(0.7, fuzz_q(d), 0.5, Vec3::ONE);
        close("c_atten", got.x.into(), wanted, 4e-4, density);
    }
}

#[test]
fn places_of_the_ambient_table_run_with_the_azimuth() {
    for tilt in [10.0f64, 45.0, 90.0] {
        let t = direction(tilt.to_radians(), 0.0);
        for polar in [0.2f64, 0.8, 1.4] {
            for (azimuth, wanted) in [(0.0, 1.0), (PI / 2.0, 0.5), (PI, 0.0)] {
                let v = direction(polar, azimuth);
                let place = fuzz_ambient_place(v.z as f32, t.dot(v) as f32, t.z as f32);
                // The outer nodes lie at the middles of the outer texels.
                let node = |at: f64| (at * f64::from(FUZZ_TABLE_SIZE - 1) + 0.5) / f64::from(FUZZ_TABLE_SIZE);
                close("y", place.y.into(), node(wanted), 2e-5, (tilt, polar, azimuth));
                close("x", place.x.into(), node(v.z), 1e-6, v);
            }
        }
    }
    assert!(fuzz_ambient_place(1.0, 1.0, 1.0).is_finite(), "upright");
}

#[test]
fn wrapped_light_is_as_much_as_unwrapped() {
    let total: f64 =
        (gauss_legendre(64, -0.2, 1.0).into_iter()).map(|(c, w)| f64::from(fuzz_wrap(c as f32)) * w).sum();
    close("∫ wrap", total * TAU, PI, 1e-5, ());
    close("towards the light", fuzz_wrap(1.0).into(), 1.25, 1e-6, ());
    close("at the terminator", fuzz_wrap(0.0).into(), 0.034_722, 1e-6, ());
    assert!(fuzz_wrap(-0.3) < 1e-7, "light from behind");
}

#[test]
fn the_deferred_layer_is_the_layer_of_its_constants_under_wrapped_light() {
    for (theta_u, theta_v, phi) in [(0.3f64, 0.8, 1.0), (1.2, 0.1, 2.5), (1.7, 1.4, 0.2), (0.0, 1.5, 3.1)] {
        let (u, v) = (direction(theta_u, 0.0), direction(theta_v, phi));
        let (n_u, n_v, u_v) = (u.z as f32, v.z as f32, u.dot(v) as f32);
        let wrapped = fuzz_wrap(n_u);
        let passed = fuzz_passage(FUZZ_DEFERRED_DENSITY, wrapped) * fuzz_deferred_escape(n_v);
        let phase = fibre_phase(u_v, n_u, n_v, FUZZ_DEFERRED_ALPHA);
        let wanted = f64::from(fuzz_layer(phase, passed, wrapped, n_v) * wrapped);
        let got = f64::from(fuzz_deferred(n_u, n_v, u_v, fuzz_deferred_escape(n_v)));
        close("fuzz_deferred", got / wanted, 1.0, 1e-5, (u, v));
    }
}

/// What the deferred layer returns to a view in a white furnace at a fibre albedo of one.
fn deferred_albedo(n_v: f64) -> f64 {
    let v = direction(n_v.acos(), 0.0);
    let escaped = fuzz_deferred_escape(n_v as f32);
    let mut sum = 0.0;
    for (z, weight) in gauss_legendre(96, -0.2, 1.0) {
        for column in 0..64 {
            let phi = PI * (f64::from(column) + 0.5) / 64.0;
            let u = (DVec2::from_angle(phi) * (1.0 - z * z).sqrt()).extend(z);
            sum += f64::from(fuzz_deferred(z as f32, n_v as f32, u.dot(v) as f32, escaped)) * weight * TAU
                / 64.0;
        }
    }
    sum
}

#[test]
fn the_deferred_layer_is_the_talks_and_its_safe_form_never_exceeds_one() {
    let mut talk = 0.0f64;
    for k in 0..=100 {
        let n_v = (f64::from(k) / 100.0).max(0.002);
        let albedo = deferred_albedo(n_v);
        for base in [0.1f32, 0.3, 0.5, 1.0] {
            let safe = albedo * f64::from(fuzz_deferred_color(Vec3::splat(base), n_v as f32).x);
            assert!(safe <= 1.0, "a base of {base} returns {safe} at n·v {n_v}");
            if base <= 0.3 {
                close("untouched", safe, 5.0 * f64::from(base) * albedo, 1e-6, n_v);
            }
        }
        talk = talk.max(5.0 * albedo);
    }
    assert!(talk > 2.5, "the talk's form of a white base returns {talk}, no more than 2.5");
    // Unwrapped values: 0.107, 0.182, 0.373, 0.459 at 1, 0.5, 0.1, 0.02; wrapping changes them by up to 8 %.
    for (n_v, unwrapped) in [(1.0, 0.107), (0.5, 0.182), (0.1, 0.373), (0.02, 0.459)] {
        close("albedo", deferred_albedo(n_v) / unwrapped, 1.0, 0.09, n_v);
    }
}

#[test]
fn seven_bits_hold_fuzziness_to_half_a_step_and_leave_the_flag_alone() {
    for flag in [0.0, 1.0] {
        for k in 0..=1000 {
            let fuzziness = k as f32 / 1000.0;
            let code = fuzziness_code(fuzziness, flag);
            assert!(code.fract() == 0.0 && (code >= 128.0) == (flag == 1.0) && code < 256.0, "code {code}");
            let error = (fuzziness_from_code(code) - fuzziness).abs();
            assert!(error <= 0.5 / 127.0 + 1e-6, "{fuzziness} came back {error} off");
        }
        assert_eq!(fuzziness_from_code(fuzziness_code(1.0, flag)), 1.0);
        assert_eq!(fuzziness_from_code(fuzziness_code(0.0, flag)), 0.0);
    }
}

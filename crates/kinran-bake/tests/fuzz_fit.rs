//! Fits of fuzz against quadrature, closed forms and published errors.

#![allow(clippy::print_stdout, reason = "the tests tell how near their bounds are")]

use glam::{DVec3, dvec3};
use kinran_bake::fuzz_fit::*;
use kinran_shading::fuzz::*;
use kinran_shading::sh::sh_basis;
use std::f64::consts::{PI, TAU};

const TILTS: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0];

fn spread_of(alpha: f64) -> f64 {
    alpha * alpha
}

fn view(x: f64, azimuth: f64) -> DVec3 {
    let r = (1.0 - x * x).sqrt();
    dvec3(r * azimuth.cos(), r * azimuth.sin(), x)
}

/// Light above the horizon: directions, by the midpoint rule in the cube root of the height and in azimuth.
fn lights(rows: u32, columns: u32) -> Vec<(DVec3, f64)> {
    let mut nodes = Vec::new();
    for i in 0..rows {
        let y = (f64::from(i) + 0.5) / f64::from(rows);
        for j in 0..columns {
            let azimuth = TAU * (f64::from(j) + 0.5) / f64::from(columns);
            let weight = 2.0 * y / f64::from(rows) * TAU / f64::from(columns);
            nodes.push((view(y * y, azimuth), weight));
        }
    }
    nodes
}

/// The layer's BRDF times cosine, by the single-precision formulas.
fn lobe(phase: Phase, u: DVec3, v: DVec3, t: DVec3, density: f64, fit: &FuzzFit) -> f64 {
    let (u32, v32, t32) = (u.as_vec3(), v.as_vec3(), t.as_vec3());
    let brdf = match phase {
        Phase::Fibre => fuzz_brdf(u32, v32, t32, density as f32, fit.alpha),
        Phase::Velvet => fuzz_velvet_brdf(u32, v32, t32, density as f32, fit.k),
    };
    f64::from(brdf) * u.z
}

#[test]
fn integrals_agree_with_another_rule_and_another_form_of_the_brdf() {
    for (phase, tilt, alpha) in [
        (Phase::Fibre, 23.0f64, 0.447),
        (Phase::Fibre, 80.0, 0.3),
        (Phase::Velvet, 40.0, 0.447),
        (Phase::Fibre, 45.0, 0.1),
    ] {
        let t = view(tilt.to_radians().cos(), 0.0);
        let fit = fuzz_fit(phase, tilt.to_radians(), spread_of(alpha));
        for v in [view(0.15, 2.0), view(0.8, 0.5)] {
            let exact = gathered(phase, v, t, alpha, &[0.2]);
            let mut wanted = (0.0, DVec3::ZERO);
            for (u, weight) in lights(240, 480) {
                let value = lobe(phase, u, v, t, 0.2, &fit) * weight;
                wanted = (wanted.0 + value, wanted.1 + u * value);
            }
            let (light, moment) = exact.layers[0];
            assert!(
                (light / wanted.0 - 1.0).abs() < 3e-3,
                "{phase:?} {tilt} {alpha} {v}: {light}, wanted {}",
                wanted.0
            );
            assert!(
                moment.distance(wanted.1) < 3e-3 * light,
                "{phase:?} {tilt} {alpha} {v}: {moment}, wanted {}",
                wanted.1
            );
        }
    }
}

/// Largest and root mean squared error of the talk's six terms for P_s, from a least-squares fit of another make.
#[test]
fn p_s_is_as_well_fitted_as_six_terms_can_be() {
    let published = [
        (0.0, [(0.174, 0.044), (0.031, 0.011), (0.006, 0.002), (0.001, 0.001)]),
        (30.0, [(0.099, 0.049), (0.055, 0.019), (0.033, 0.010), (0.005, 0.002)]),
        (60.0, [(0.151, 0.049), (0.087, 0.023), (0.044, 0.012), (0.006, 0.002)]),
        (90.0, [(0.050, 0.013), (0.032, 0.008), (0.021, 0.005), (0.004, 0.001)]),
    ];
    for (tilt, row) in published {
        for (alpha, (max, rms)) in [0.1, 0.3, 0.447, 0.8].into_iter().zip(row) {
            let fit = fuzz_fit(Phase::Fibre, f64::to_radians(tilt), spread_of(alpha));
            assert!(
                fit.p_s.max_error < 1.15 * max + 2e-3 && (fit.p_s.rms_error - rms).abs() < 0.1 * rms + 2e-3,
                "tilt {tilt}, alpha {alpha}: wanted max {max}, RMS {rms}, got {:?}",
                fit.p_s
            );
        }
    }
    // A published fit of one of them.
    let fit = fuzz_fit(Phase::Fibre, 30f64.to_radians(), spread_of(0.447));
    for (got, wanted) in
        fit.p_s.coefficients.into_iter().zip([0.5034, -0.1933, 0.6330, 0.1224, -0.2204, -0.0299])
    {
        assert!((got - wanted).abs() < 0.02, "wanted {wanted}, got {:?}", fit.p_s.coefficients);
    }
    for (tilt, wanted) in [(0.0, 0.8044), (45.0, 0.5848), (90.0, 0.3854)] {
        let r = fuzz_fit(Phase::Fibre, f64::to_radians(tilt), spread_of(0.447)).r.coefficients[0];
        assert!((r - wanted).abs() < 1e-3, "R at {tilt}: wanted {wanted}, got {r}");
    }
}

/// The smallest and largest ambient light over the exact one, under uniform light of radiance one.
fn uniform_light(alpha: f64, approximation: impl Fn(&FuzzFit, f64, f64, f64) -> f64) -> (f64, f64) {
    let mut range = (f64::INFINITY, 0.0f64);
    for tilt in [0.0, 10.0, 23.0, 37.0, 45.0, 52.0, 60.0, 67.0, 80.0, 90.0] {
        let tilt = f64::to_radians(tilt);
        let t = view(tilt.cos(), 0.0);
        let fit = fuzz_fit(Phase::Fibre, tilt, spread_of(alpha));
        for x in [0.1, 0.15, 0.3, 0.6, 0.95, 1.0] {
            for azimuth in 0..10 {
                let v = view(x, PI * f64::from(azimuth) / 9.0);
                let exact = gathered(Phase::Fibre, v, t, alpha, &[0.05, 0.14, 0.28, 0.5]);
                for (&density, (light, _)) in [0.05, 0.14, 0.28, 0.5].iter().zip(exact.layers) {
                    let ratio = approximation(&fit, density, x, t.dot(v)) / light;
                    range = (range.0.min(ratio), range.1.max(ratio));
                }
            }
        }
    }
    range
}

#[test]
fn ambient_fuzz_under_uniform_light_stays_within_its_bounds() {
    let ours = |fit: &FuzzFit, density: f64, x: f64, c: f64| {
        let factor = fuzz_ambient_factor(fit.ambient.coefficients, x as f32, c as f32);
        f64::from(fuzz_g(density as f32, x as f32) * factor)
    };
    let talk = |fit: &FuzzFit, density: f64, x: f64, c: f64| {
        let upward = 1.0 - fuzz_p_s(fit.p_s.coefficients, x as f32, c as f32);
        f64::from(fuzz_g_talk(fit.g.coefficients, density as f32, x as f32) * upward)
    };
    for (alpha, bound) in [(0.3, 0.2), (0.447, 0.1), (0.7, 0.05), (0.95, 0.05)] {
        let (low, high) = uniform_light(alpha, ours);
        let of_talk = uniform_light(alpha, talk);
        println!(
            "alpha {alpha}: ours {low:.3} to {high:.3}, the talk's {:.3} to {:.3}",
            of_talk.0, of_talk.1
        );
        assert!(low > 1.0 - bound && high < 1.0 + bound, "alpha {alpha}: {low} to {high}");
        assert!(high - low < of_talk.1 - of_talk.0, "alpha {alpha}: no better than the talk's {of_talk:?}");
    }
}

#[test]
fn the_table_follows_combed_fibres_where_the_polynomial_cannot() {
    for (spread, bound) in [(0.01, 0.12), (0.04, 0.05)] {
        for tilt in [0.0f64, 30.0, 60.0] {
            let table = ambient_table(Phase::Fibre, tilt.to_radians(), spread);
            let fit = fuzz_fit(Phase::Fibre, tilt.to_radians(), spread);
            println!(
                "spread {spread}, tilt {tilt}: table {:?}, polynomial {:?}",
                table.ratio, fit.ambient.ratio
            );
            assert!(
                table.ratio[0] > 1.0 - bound && table.ratio[1] < 1.0 + bound,
                "spread {spread}, tilt {tilt}: {:?}",
                table.ratio
            );
            let width = |[low, high]: [f32; 2]| high - low;
            assert!(
                width(table.ratio) < 0.7 * width(fit.ambient.ratio),
                "spread {spread}, tilt {tilt}: {:?}, polynomial {:?}",
                table.ratio,
                fit.ambient.ratio
            );
        }
    }
}

/// A sun on a grey sky in windowed order-2 harmonics, the exact answer by quadrature; ratio of approximation
/// to exact, sorted.
fn sun_and_sky(
    alpha: f64,
    approximation: impl Fn(&FuzzFit, f64, DVec3, DVec3, &[glam::Vec3; 9]) -> f64,
) -> Vec<f64> {
    // Cosine window of order 2.
    const WINDOW: [f32; 9] = [1.0, 0.75, 0.75, 0.75, 0.25, 0.25, 0.25, 0.25, 0.25];
    let mut ratios = Vec::new();
    let density = 0.2;
    for tilt in [0.0f64, 23.0, 45.0, 90.0] {
        let t = view(tilt.to_radians().cos(), 0.0);
        let fit = fuzz_fit(Phase::Fibre, tilt.to_radians(), spread_of(alpha));
        for x in [0.1, 0.2, 0.35, 0.5, 0.7, 0.9] {
            for azimuth in 0..8 {
                let v = view(x, TAU * (f64::from(azimuth) + 0.5) / 8.0);
                // What the lobe makes of each basis function.
                let mut transfer = [0.0; 9];
                for (u, weight) in lights(48, 64) {
                    let value = lobe(Phase::Fibre, u, v, t, density, &fit) * weight;
                    for (sum, basis) in transfer.iter_mut().zip(sh_basis(u.as_vec3())) {
                        *sum += value * f64::from(basis);
                    }
                }
                for elevation in [15.0f64, 35.0, 55.0, 75.0] {
                    for turn in 0..6 {
                        let sun = view(elevation.to_radians().sin(), TAU * f64::from(turn) / 6.0 + 0.2);
                        let mut radiance = [glam::Vec3::ZERO; 9];
                        for ((r, basis), window) in
                            radiance.iter_mut().zip(sh_basis(sun.as_vec3())).zip(WINDOW)
                        {
                            *r = glam::Vec3::splat(basis * window);
                        }
                        radiance[0] += glam::Vec3::splat(0.1 / 0.282_094_8);
                        let exact: f64 =
                            transfer.iter().zip(&radiance).map(|(t, r)| t * f64::from(r.x)).sum();
                        ratios.push(approximation(&fit, density, v, t, &radiance) / exact);
                    }
                }
            }
        }
    }
    ratios.sort_by(f64::total_cmp);
    ratios
}

#[test]
fn light_along_the_lobe_is_nearer_to_a_sun_and_sky_than_the_hemispheres_mean() {
    for alpha in [0.3, 0.447, 0.7] {
        let ours = sun_and_sky(alpha, |fit, density, v, t, radiance| {
            let (v32, t32) = (v.as_vec3(), t.as_vec3());
            let factor = fuzz_ambient_factor(fit.ambient.coefficients, v32.z, t32.dot(v32));
            let towards = fuzz_ambient_direction(fit.direction.coefficients, glam::Vec3::Z, v32, t32);
            f64::from(fuzz_g(density as f32, v32.z) * factor * fuzz_ambient_radiance(radiance, towards).x)
        });
        let talk = sun_and_sky(alpha, |fit, density, v, t, radiance| {
            let upward = 1.0 - fuzz_p_s(fit.p_s.coefficients, v.z as f32, t.dot(v) as f32);
            let g = fuzz_g_talk(fit.g.coefficients, density as f32, v.z as f32);
            f64::from(g * upward * fuzz_ambient_mean(radiance, glam::Vec3::Z).x)
        });
        let at = |ratios: &[f64], share: f64| ratios[((ratios.len() - 1) as f64 * share) as usize];
        for (name, ratios) in [("ours", &ours), ("talk", &talk)] {
            println!(
                "alpha {alpha}, {name}: median {:.3}, 5 % {:.3}, 95 % {:.3}, max {:.3}",
                at(ratios, 0.5),
                at(ratios, 0.05),
                at(ratios, 0.95),
                at(ratios, 1.0)
            );
        }
        let spread = |ratios: &[f64]| (at(ratios, 0.95) / at(ratios, 0.05)).ln();
        assert!((at(&ours, 0.5) - 1.0).abs() < 0.05, "alpha {alpha}: median {}", at(&ours, 0.5));
        assert!(spread(&ours) < 0.7 * spread(&talk), "alpha {alpha}: {} of {}", spread(&ours), spread(&talk));
    }
}

#[test]
fn ambient_light_of_the_base_is_within_a_tenth() {
    // Talk: E_s = (1 - Q) R.
    let mut worst = 0.0f64;
    for alpha in [0.1, 0.3, 0.447, 0.95] {
        for tilt in TILTS {
            let t = view(tilt.to_radians().cos(), 0.0);
            let fit = fuzz_fit(Phase::Fibre, tilt.to_radians(), spread_of(alpha));
            for density in [0.05, 0.2, 0.5] {
                let exact: f64 = (lights(96, 96).into_iter())
                    .map(|(u, weight)| {
                        let passed = (-density / u.z).exp();
                        (1.0 - passed) * p_s_exact(Phase::Fibre, u, t, alpha) * u.z / PI * weight
                    })
                    .sum();
                let got = f64::from(1.0 - fuzz_q(density as f32)) * f64::from(fit.r.coefficients[0]);
                worst = worst.max((got / exact - 1.0).abs());
            }
        }
    }
    assert!(worst < 0.11, "E_s is off by {worst}");
}

/// Velvet has no closed form of P_s; what is fitted is what goes down, and never more than what arrives.
#[test]
fn velvets_p_s_is_the_light_that_goes_down() {
    for alpha in [0.3, 0.447, 0.95] {
        for tilt in TILTS {
            let fit = fuzz_fit(Phase::Velvet, tilt.to_radians(), spread_of(alpha));
            let t = view(tilt.to_radians().cos(), 0.0);
            assert!(fit.p_s.max_error < 0.12 && fit.p_s.rms_error < 0.03, "{alpha} {tilt}: {:?}", fit.p_s);
            for u in [view(0.2, 0.4), view(0.9, 2.0)] {
                let down = p_s_exact(Phase::Velvet, u, t, alpha);
                let up = gathered(Phase::Velvet, u, t, alpha, &[]).phase;
                assert!(down > 0.0 && down + up <= 1.0 + 1e-6, "{alpha} {tilt} {u}: {down} down, {up} up");
                let got = f64::from(fuzz_p_s(fit.p_s.coefficients, u.z as f32, t.dot(u) as f32));
                assert!(
                    (got - down).abs() <= f64::from(fit.p_s.max_error) + 0.01,
                    "wanted {down}, got {got}"
                );
            }
        }
    }
}

#[test]
fn exponential_integrals_have_their_tabulated_values() {
    // Abramowitz and Stegun, table 5.1.
    for (x, wanted) in
        [(0.1, 1.822_923_958_4), (0.5, 0.559_773_594_8), (1.0, 0.219_383_934_4), (2.0, 0.048_900_510_7)]
    {
        let got = exponential_integral(x);
        assert!((got - wanted).abs() < 5e-7, "E1({x}): wanted {wanted}, got {got}");
    }
    assert!((exponential_integral(10.0) - 4.156_968_929_685e-6).abs() < 1e-15);
    assert!((q_exact(0.5) - 0.443_210_2).abs() < 1e-5, "2 E3(0.5) is {}", q_exact(0.5));
}

#[test]
fn the_same_fit_comes_out_of_any_thread() {
    let here = fuzz_fit(Phase::Fibre, 0.4, 0.2);
    let there = std::thread::spawn(|| fuzz_fit(Phase::Fibre, 0.4, 0.2)).join().unwrap();
    assert_eq!(here, there);
}

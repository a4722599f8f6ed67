//! Skin's tables against closed forms, quadrature over surfaces, and numbers computed independently.

mod common;

use common::gauss_legendre;
use glam::{Vec3, vec2};
use kinran_shading::sh::{Sh9, sh_basis, sh_irradiance};
use kinran_shading::skin::curvature::{
    curvature_decode, curvature_encode, curvature_from_light, curvature_from_light_normalized,
};
use kinran_shading::skin::lighting::{skin_irradiance, skin_lut_uv, skin_normal, skin_specular};
use kinran_shading::skin::profile::{Gaussian, ProfileError, RadialProfile, SKIN};
use kinran_shading::skin::ring::column_n_u;
use kinran_shading::skin::sampled::Sample;
use kinran_shading::{Sym2, ggx_d, smith_v};
use std::f64::consts::{FRAC_PI_2, PI};

/// A row's value at any n·u; a row is so fine here that a straight line between its columns is exact to 1e-6 away
/// from the kink of a flat surface.
fn ring(profile: RadialProfile, curvature: f64, n_u: f64) -> [f64; 3] {
    const N: usize = 20_000;
    let mut row = vec![[0.0; 3]; N];
    profile.to_linear().ring_row(curvature, &mut row);
    let at = 0.5 * ((n_u + 1.0) * N as f64 - 1.0);
    let i = (at.floor() as usize).min(N - 2);
    let t = at - i as f64;
    std::array::from_fn(|c| row[i][c] + t * (row[i + 1][c] - row[i][c]))
}

/// Computed in double precision by another program from the definition, R G B.
#[test]
fn ring_of_skin_meets_published_numbers() {
    let n_u = [-0.5, -0.2, 0.0, 0.2, 0.5, 1.0];
    let rows: [(f64, [[f64; 3]; 6]); 5] = [
        (
            0.05,
            [
                [0.0, 0.0, 0.0],
                [0.00035, 0.0, 0.0],
                [0.01783, 0.00413, 0.00265],
                [0.20000, 0.19998, 0.19999],
                [0.49913, 0.49996, 0.49998],
                [0.99827, 0.99991, 0.99997],
            ],
        ),
        (
            0.1,
            [
                [0.00026, 0.0, 0.0],
                [0.00472, 0.00002, 0.0],
                [0.03561, 0.00825, 0.00530],
                [0.20332, 0.19995, 0.19998],
                [0.49675, 0.49983, 0.49994],
                [0.99298, 0.99966, 0.99988],
            ],
        ),
        (
            0.2,
            [
                [0.00618, 0.00002, 0.0],
                [0.02607, 0.00027, 0.00005],
                [0.07076, 0.01650, 0.01060],
                [0.22009, 0.19999, 0.19995],
                [0.49124, 0.49933, 0.49975],
                [0.97052, 0.99863, 0.99950],
            ],
        ),
        (
            0.5,
            [
                [0.06497, 0.00073, 0.00012],
                [0.10525, 0.00600, 0.00103],
                [0.15467, 0.04115, 0.02648],
                [0.26781, 0.20421, 0.20040],
                [0.47138, 0.49626, 0.49855],
                [0.84159, 0.99120, 0.99687],
            ],
        ),
        (
            1.0,
            [
                [0.13538, 0.00799, 0.00125],
                [0.16749, 0.02891, 0.00925],
                [0.20639, 0.08090, 0.05277],
                [0.28637, 0.22177, 0.20661],
                [0.43258, 0.49014, 0.49465],
                [0.69578, 0.96562, 0.98715],
            ],
        ),
    ];
    for (curvature, wanted) in rows {
        for (n_u, want) in n_u.into_iter().zip(wanted) {
            let got = ring(RadialProfile::skin(), curvature, n_u);
            for c in [0, 1, 2] {
                assert!(
                    (want[c] - got[c]).abs() <= 6e-6,
                    "curvature {curvature}, n·u {n_u}, channel {c}: wanted {}, got {}",
                    want[c],
                    got[c]
                );
            }
        }
    }
}

/// `exp(-x) Ik(x)` for k up to `last`, by Miller's backward recurrence.
fn bessel_i(last: usize, x: f64) -> Vec<f64> {
    let start = last + 60;
    let mut values = vec![0.0; start + 2];
    values[start] = 1e-280;
    for k in (1..=start).rev() {
        values[k - 1] = values[k + 1] + 2.0 * k as f64 / x * values[k];
        if values[k - 1] > 1e200 {
            values[k - 1..].iter_mut().for_each(|v| *v *= 1e-250);
        }
    }
    let sum = values[0] + 2.0 * values[1..].iter().sum::<f64>();
    values[..=last].iter().map(|v| v / sum).collect()
}

/// `D = Σ W_i [1/π + cos θ I1/2I0 + (2/π) Σ (-1)^(k+1) cos 2kθ I2k/I0 / (4k² - 1)] / Σ W_i`, another closed form of the same
/// integral.
#[test]
fn ring_row_is_within_1e_5_of_its_fourier_series() {
    for curvature in [0.05, 0.2, 1.0, 4.0, 100.0] {
        let kappas = SKIN.map(|g| 1.0 / (curvature * curvature * g.variance));
        // Beyond the last, I2k/I0 < exp(-2 k² / κ).
        let series = kappas.map(|kappa| bessel_i(2 * ((kappa * 12.0).sqrt() as usize + 12), kappa));
        let mut row = vec![[0.0; 3]; 64];
        RadialProfile::skin().to_linear().ring_row(curvature, &mut row);
        for (i, got) in row.iter().enumerate() {
            let theta = column_n_u(i, row.len()).acos();
            let (mut sum, mut mass) = ([0.0; 3], [0.0; 3]);
            for (gaussian, series) in SKIN.iter().zip(&series) {
                let mut d = series[0] / PI + 0.5 * theta.cos() * series[1];
                for k in 1..series.len().div_ceil(2) {
                    let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
                    let angle = 2.0 * k as f64;
                    d += 2.0 / PI * sign * (angle * theta).cos() / (angle * angle - 1.0) * series[2 * k];
                }
                for c in [0, 1, 2] {
                    let weight = gaussian.weight[c] * gaussian.variance.powf(-0.5);
                    sum[c] += weight * d;
                    mass[c] += weight * series[0];
                }
            }
            for c in [0, 1, 2] {
                let (want, got) = (sum[c] / mass[c], got[c]);
                assert!(
                    (want - got).abs() < 1e-5,
                    "curvature {curvature}, column {i}, channel {c}: wanted {want}, got {got}"
                );
            }
        }
    }
}

/// The talk's own formula by brute force, in its linear and in its wrong radial reading, and along the arc.
#[test]
fn the_right_profile_is_the_linear_one_over_the_chord() {
    let (r, linear) = (5.0, RadialProfile::skin().to_linear());
    let ring_at_terminator = |density: &dyn Fn(f64) -> [f64; 3], distance: &dyn Fn(f64) -> f64| {
        let (mut sum, mut mass) = ([0.0; 3], [0.0; 3]);
        // Two halves, for the integrand has a kink at 0; geometric pieces for narrow profiles.
        for piece in 0..40 {
            let (a, b) = (PI * 0.5f64.powi(piece + 1), PI * 0.5f64.powi(piece));
            for (t, w) in gauss_legendre(24, a, b) {
                let density = density(distance(t));
                for c in [0, 1, 2] {
                    // cos(π/2 - θ), clamped: the other half is dark.
                    sum[c] += w * density[c] * t.sin();
                    mass[c] += w * density[c] * 2.0;
                }
            }
        }
        [0, 1, 2].map(|c| sum[c] / mass[c])
    };
    let chord = |t: f64| 2.0 * r * (0.5 * t).sin();
    let right = ring_at_terminator(&|x| linear.density(x), &chord);
    let wrong = ring_at_terminator(&|x| RadialProfile::skin().density(x), &chord);
    let arc = ring_at_terminator(&|x| linear.density(x), &|t| r * t);
    for (name, want, got) in [
        ("linear", [0.07076, 0.01650, 0.01060], right),
        ("radial", [0.01957, 0.01038, 0.00824], wrong),
        ("ours", [0.07076, 0.01650, 0.01060], ring(RadialProfile::skin(), 0.2, 0.0)),
    ] {
        for c in [0, 1, 2] {
            assert!(
                (want[c] - got[c]).abs() < 8e-6,
                "{name}, channel {c}: wanted {}, got {}",
                want[c],
                got[c]
            );
        }
    }
    assert!((arc[0] - 0.06865).abs() < 8e-6, "along the arc: wanted 0.06865, got {}", arc[0]);
}

#[test]
fn quadrature_of_any_profile_meets_the_closed_form_of_gaussians() {
    // A table of the six Gaussians, fine enough for a straight line to be exact to 1e-6.
    let radial = RadialProfile::skin();
    let rows: Vec<(f64, [f64; 3])> = (0..700)
        .map(|i| {
            let r = 19.0 * (i as f64 / 699.0).powi(3);
            (r, radial.density(r))
        })
        .collect();
    let table = RadialProfile::table(&rows).unwrap();
    let mut samples = vec![Sample::default(); rows.len() + 4096];
    let sampled = table.to_linear().sampled(&mut samples);
    for curvature in [0.05, 0.4] {
        let (mut exact, mut got) = (vec![[0.0; 3]; 33], vec![[0.0; 3]; 33]);
        radial.to_linear().ring_row(curvature, &mut exact);
        sampled.ring_row(curvature, &mut got);
        for i in 0..33 {
            for c in [0, 1, 2] {
                let (want, got) = (exact[i][c], got[i][c]);
                assert!(
                    (want - got).abs() < 1e-5,
                    "curvature {curvature}, column {i}: wanted {want}, got {got}"
                );
            }
        }
        let (want, got) = (radial.band_factors(curvature), table.band_factors(curvature));
        for c in [0, 1, 2] {
            assert!((want.h_one[c] - got.h_one[c]).abs() < 1e-5, "h1: {want:?} {got:?}");
            assert!((want.h_two[c] - got.h_two[c]).abs() < 1e-5, "h2: {want:?} {got:?}");
        }
    }
}

/// The ring at every column by the midpoint rule between a table's rows, whose nodes crowd at both ends.
fn brute_force_ring(rows: &[(f64, [f64; 3])], curvature: f64, columns: usize) -> Vec<[f64; 3]> {
    let linear = RadialProfile::table(rows).unwrap().to_linear();
    let angle = |chord: f64| 2.0 * (0.5 * chord * curvature).min(1.0).asin();
    let mut knots: Vec<f64> = [0.0].into_iter().chain(rows.iter().map(|row| angle(row.0))).collect();
    knots.dedup();
    let nodes = 24.max(8000 / knots.len());
    let (mut ring, mut one) = (vec![[0.0; 3]; columns], [0.0; 3]);
    for ends in knots.windows(2) {
        for node in 0..nodes {
            let t = (node as f64 + 0.5) / nodes as f64;
            let angle = ends[0] + (ends[1] - ends[0]) * t * t * (3.0 - 2.0 * t);
            let weight = (ends[1] - ends[0]) * 6.0 * t * (1.0 - t);
            let mass = linear.density(2.0 / curvature * (0.5 * angle).sin()).map(|x| x * weight);
            (0..3).for_each(|c| one[c] += 2.0 * mass[c]);
            for (i, d) in ring.iter_mut().enumerate() {
                let light = column_n_u(i, columns).acos();
                let seen = (light - angle).cos().max(0.0) + (light + angle).cos().max(0.0);
                (0..3).for_each(|c| d[c] += mass[c] * seen);
            }
        }
    }
    ring.iter().map(|d| std::array::from_fn(|c| d[c] / one[c])).collect()
}

/// Rings that the profile goes round or hardly leaves its place on; at 0.25 and 1 a root lies on the far side of the ring.
#[test]
fn a_sampled_table_s_ring_keeps_steps_corners_and_spikes() {
    let cone = vec![(0.0, [1.0, 0.5, 2.0]), (3.0, [0.0; 3])];
    let disc =
        vec![(0.0, [1.0; 3]), (2.0, [1.0, 0.3, 1.0]), (2.001, [0.0, 0.3, 0.0]), (8.0, [0.0, 0.3, 1e-4])];
    let spike = vec![(0.0, [100.0, 1.0, 0.0]), (0.05, [1.0, 0.01, 1.0]), (6.0, [0.0, 0.02, 0.0])];
    let skin = RadialProfile::skin();
    let fine = (0..400).map(|i| 19.0 * f64::from(i) / 399.0).map(|r| (r, skin.density(r))).collect();
    for (name, rows) in [("cone", cone), ("disc", disc), ("spike", spike), ("skin", fine)] {
        let linear = RadialProfile::table(&rows).unwrap().to_linear();
        let mut samples = vec![Sample::default(); rows.len() + 4096];
        let sampled = linear.sampled(&mut samples);
        for (curvature, columns) in
            [(1e-3, 32), (0.02, 33), (0.1, 7), (0.25, 32), (0.5, 64), (0.67, 33), (1.0, 64), (4.0, 33)]
        {
            let exact = brute_force_ring(&rows, curvature, columns);
            let mut got = vec![[0.0; 3]; columns];
            sampled.ring_row(curvature, &mut got);
            for i in 0..columns {
                for c in [0, 1, 2] {
                    let (want, got) = (exact[i][c], got[i][c]);
                    assert!(
                        (want - got).abs() < 3e-6,
                        "{name}, curvature {curvature}, column {i} of {columns}, channel {c}: wanted {want}, got {got}"
                    );
                }
            }
        }
    }
}

#[test]
fn burley_meets_published_numbers() {
    let burley = RadialProfile::burley([0.5; 3]).unwrap();
    for (n_u, want) in [(-0.2, 0.03107), (0.0, 0.07844), (0.2, 0.22319)] {
        let got = ring(burley, 0.2, n_u)[0];
        assert!((want - got).abs() < 1e-5, "n·u {n_u}: wanted {want}, got {got}");
    }
    let factors = burley.band_factors(0.2);
    assert!((factors.h_one[0] - 0.93250).abs() < 6e-6, "h1: wanted 0.93250, got {}", factors.h_one[0]);
    assert!((factors.h_two[0] - 0.84121).abs() < 6e-6, "h2: wanted 0.84121, got {}", factors.h_two[0]);
}

#[test]
fn band_factors_of_skin_meet_published_numbers() {
    let wanted = [
        (0.05, [0.99654, 0.99983, 0.99994], [0.98974, 0.99949, 0.99981]),
        (0.2, [0.94489, 0.99727, 0.99901], [0.86150, 0.99195, 0.99704]),
        (0.5, [0.76467, 0.98315, 0.99381], [0.59144, 0.95358, 0.98200]),
    ];
    for (curvature, h_one, h_two) in wanted {
        let got = RadialProfile::skin().band_factors(curvature);
        for c in [0, 1, 2] {
            assert!((h_one[c] - got.h_one[c]).abs() < 6e-6, "{curvature} h1: wanted {h_one:?}, got {got:?}");
            assert!((h_two[c] - got.h_two[c]).abs() < 6e-6, "{curvature} h2: wanted {h_two:?}, got {got:?}");
        }
    }
}

/// `∫ P_l(cos θ) R(2 r sin(θ/2)) sin θ dθ` over the sphere.
#[test]
fn band_factors_meet_quadrature_over_the_sphere() {
    let gaussian = [Gaussian { variance: 3.0, weight: [1.0; 3] }];
    let rows = [(0.5, [2.0, 1.0, 0.5]), (1.0, [1.0, 1.0, 1.0]), (4.0, [0.5, 0.1, 0.0])];
    for profile in [
        RadialProfile::skin(),
        RadialProfile::gaussians(&gaussian).unwrap(),
        RadialProfile::burley([0.3, 0.6, 2.0]).unwrap(),
        RadialProfile::table(&rows).unwrap(),
    ] {
        for curvature in [0.01, 0.2, 1.0, 3.0, 30.0] {
            let r = 1.0 / curvature;
            let (mut mass, mut one, mut two) = ([0.0; 3], [0.0; 3], [0.0; 3]);
            // Chords, dA = 2 π c dc; pieces end at the table's rows.
            let mut ends: Vec<f64> =
                (0..60).map(|i| 2.0 * r * 0.6f64.powi(i)).chain([0.5, 1.0, 4.0]).collect();
            ends.retain(|&e| e <= 2.0 * r);
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                for (chord, w) in gauss_legendre(24, pair[0], pair[1]) {
                    let cos = 1.0 - chord * chord / (2.0 * r * r);
                    let density = profile.density(chord);
                    for c in [0, 1, 2] {
                        let m = w * density[c] * chord;
                        mass[c] += m;
                        one[c] += m * cos;
                        two[c] += m * (1.5 * cos * cos - 0.5);
                    }
                }
            }
            let got = profile.band_factors(curvature);
            for c in [0, 1, 2] {
                let (want_one, want_two) = (one[c] / mass[c], two[c] / mass[c]);
                assert!((want_one - got.h_one[c]).abs() < 1e-6, "{curvature}: {want_one} {got:?}");
                assert!((want_two - got.h_two[c]).abs() < 1e-6, "{curvature}: {want_two} {got:?}");
            }
        }
    }
}

/// A line's density is the radial one summed along the line.
#[test]
fn linear_density_is_the_radial_one_along_a_line() {
    let rows = [(0.2, [2.0, 1.0, 0.5]), (1.0, [1.0, 1.0, 1.0]), (4.0, [0.5, 0.1, 0.0])];
    for profile in [
        RadialProfile::skin(),
        RadialProfile::burley([0.3, 0.6, 2.0]).unwrap(),
        RadialProfile::table(&rows).unwrap(),
    ] {
        for x in [0.05, 0.5, 2.0] {
            let mut want = [0.0; 3];
            // Ends of pieces where the distance passes a row of the table.
            let mut ends: Vec<f64> = rows.iter().map(|row| (row.0 * row.0 - x * x).max(0.0).sqrt()).collect();
            ends.extend((0..=40).map(|i| 1e-3 * 1.4f64.powi(i)).chain([0.0]));
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                for (y, w) in gauss_legendre(16, pair[0], pair[1]) {
                    let density = profile.density((x * x + y * y).sqrt());
                    (0..3).for_each(|c| want[c] += 2.0 * w * density[c]);
                }
            }
            let got = profile.to_linear().density(x);
            for c in [0, 1, 2] {
                assert!(
                    (want[c] - got[c]).abs() < 2e-6 * (1.0 + want[c]),
                    "x {x}: wanted {want:?}, got {got:?}"
                );
            }
        }
    }
}

/// Per unit length over a line, per unit area over the plane: both hold all of the light.
#[test]
fn skin_keeps_all_of_the_light() {
    for profile in [RadialProfile::skin(), RadialProfile::burley([0.3, 0.6, 1.0]).unwrap()] {
        let (mut area, mut line) = ([0.0; 3], [0.0; 3]);
        for i in -60..14 {
            for (r, w) in gauss_legendre(24, 1.5f64.powi(i), 1.5f64.powi(i + 1)) {
                let (radial, linear) = (profile.density(r), profile.to_linear().density(r));
                for c in [0, 1, 2] {
                    area[c] += w * 2.0 * PI * r * radial[c];
                    line[c] += w * 2.0 * linear[c];
                }
            }
        }
        for c in [0, 1, 2] {
            assert!((area[c] - 1.0).abs() < 1e-5, "over the plane: {area:?}");
            assert!((line[c] - 1.0).abs() < 1e-5, "over the line: {line:?}");
        }
    }
}

#[test]
fn penumbra_meets_quadrature() {
    let skin = RadialProfile::skin().to_linear();
    for width in [0.5, 3.0, 20.0] {
        for shadow in [0.0, 0.3, 0.5, 0.8, 1.0] {
            let (mut light, mut mass) = ([0.0; 3], [0.0; 3]);
            // From the point to both sides in pieces that end at the ramp's ends.
            let mut ends: Vec<f64> = (-60..=60).map(|i| f64::from(i) * 0.3).collect();
            ends.extend((-40..0).flat_map(|i| [1.3f64.powi(i), -1.3f64.powi(i)]));
            ends.extend([(shadow - 0.5) * width, (shadow - 1.0) * width]);
            ends.sort_by(f64::total_cmp);
            for pair in ends.windows(2) {
                for (t, w) in gauss_legendre(12, pair[0], pair[1]) {
                    let density = skin.density(t.abs());
                    let ramp = (2.0 * (shadow - t / width) - 1.0).clamp(0.0, 1.0);
                    for c in [0, 1, 2] {
                        light[c] += w * density[c] * ramp;
                        mass[c] += w * density[c];
                    }
                }
            }
            let got = skin.penumbra(shadow, width);
            for c in [0, 1, 2] {
                let want = light[c] / mass[c];
                assert!(
                    (want - got[c]).abs() < 2e-6,
                    "width {width}, shadow {shadow}: wanted {want}, got {got:?}"
                );
            }
        }
    }
    assert_eq!(skin.penumbra(0.4, 0.0), [0.4; 3], "without a penumbra");
}

#[test]
fn penumbra_of_a_narrow_burley_meets_the_ramp() {
    // Wide penumbra, narrow profile: what remains is the ramp in the lit half.
    let burley = RadialProfile::burley([0.01; 3]).unwrap().to_linear();
    for (shadow, want) in [(0.25, 0.0), (0.75, 0.5), (0.9, 0.8)] {
        let got = burley.penumbra(shadow, 10.0)[0];
        assert!((want - got).abs() < 1e-4, "shadow {shadow}: wanted {want}, got {got}");
    }
}

#[test]
fn what_is_no_profile_is_refused() {
    let g = |variance, weight| Gaussian { variance, weight };
    assert_eq!(RadialProfile::gaussians(&[]).unwrap_err(), ProfileError::Empty);
    for bad in [g(0.0, [1.0; 3]), g(f64::NAN, [1.0; 3]), g(1.0, [-1.0, 1.0, 1.0]), g(1.0, [1.0, 0.0, 1.0])] {
        assert_eq!(RadialProfile::gaussians(&[bad]).unwrap_err(), ProfileError::OutOfRange, "{bad:?}");
    }
    assert_eq!(RadialProfile::burley([1.0, 0.0, 1.0]).unwrap_err(), ProfileError::OutOfRange);
    assert_eq!(
        RadialProfile::from_mean_free_path([1.0; 3], [0.5, 1.1, 0.5]).unwrap_err(),
        ProfileError::OutOfRange
    );
    let rows = [(1.0, [1.0; 3]), (1.0, [0.5; 3])];
    assert_eq!(RadialProfile::table(&rows).unwrap_err(), ProfileError::Unsorted);
    assert_eq!(RadialProfile::table(&rows[..1]).unwrap_err(), ProfileError::Empty);
    assert_eq!(
        RadialProfile::table(&[(0.0, [0.0; 3]), (1.0, [0.0; 3])]).unwrap_err(),
        ProfileError::OutOfRange
    );
}

/// Christensen's scaling at albedo 0.8 is 1.9 - 0.8.
#[test]
fn a_mean_free_path_scales_with_albedo() {
    let got = RadialProfile::from_mean_free_path([1.1, 2.2, 3.3], [0.8; 3]).unwrap();
    let want = RadialProfile::burley([1.0, 2.0, 3.0]).unwrap();
    for c in [0, 1, 2] {
        let (want, got) = (want.density(0.7)[c], got.density(0.7)[c]);
        assert!((want - got).abs() < 1e-12, "channel {c}: wanted {want}, got {got}");
    }
}

/// Largest error of a byte a channel over all tensors up to the range, directions all around.
#[test]
fn four_bytes_hold_a_tensor_to_their_stated_error() {
    let mut rng = common::Rng::new(5);
    let (mut worst, mut worst_small, mut squares, mut count) = (0.0f32, 0.0f32, 0.0f64, 0.0f64);
    for _ in 0..200_000 {
        let (k1, k2) = (0.5 * rng.unit_f32(), 0.5 * rng.unit_f32());
        let axis = rng.axis().as_vec2();
        let tensor = Sym2::from_eigen(k1, k2, axis);
        let code = curvature_encode(tensor, 0.5 * (k1 + k2), 0.5);
        let bytes = (code * 255.0).round() / 255.0;
        let (decoded, mean) = curvature_decode(bytes, 0.5);
        assert!(decoded.det() >= -1e-7, "{tensor:?} decodes to {decoded:?}");
        let direction = rng.axis().as_vec2();
        let error = (decoded.quadratic(direction) - tensor.quadratic(direction)).abs();
        worst = worst.max(error);
        if k1.max(k2) < 0.05 {
            worst_small = worst_small.max(error);
        }
        squares += f64::from(error * error);
        count += 1.0;
        assert!((mean - 0.5 * (k1 + k2)).abs() < 0.0021, "mean of {tensor:?}: {mean}");
    }
    let rms = (squares / count).sqrt();
    assert!(worst < 0.0035 && worst > 0.001, "largest error {worst}");
    assert!(worst_small < 0.0012, "largest error below 0.05: {worst_small}");
    assert!(rms < 0.0009 && rms > 0.0002, "RMS {rms}");
}

/// What rasterisation does between vertices must not give a direction of negative curvature.
#[test]
fn any_mean_of_codes_is_positive_semi_definite() {
    for mut rng in common::cases(9, 20_000) {
        let mut code = || {
            let tensor = Sym2::from_eigen(0.5 * rng.unit_f32(), 0.5 * rng.unit_f32(), rng.axis().as_vec2());
            (curvature_encode(tensor, 0.1, 0.5) * 255.0).round() / 255.0
        };
        let (a, b) = (code(), code());
        let (tensor, _) = curvature_decode(a.lerp(b, 0.37), 0.5);
        let (_, small, axis) = tensor.eigen();
        let least = tensor.quadratic(vec2(-axis.y, axis.x));
        assert!(small >= 0.0 && least >= -1e-7, "{tensor:?}: {least}");
    }
}

#[test]
fn zero_and_round_tensors_come_back_exactly_round() {
    let (zero, mean) = curvature_decode(curvature_encode(Sym2::default(), 0.0, 0.5), 0.5);
    assert_eq!((zero, mean), (Sym2::default(), 0.0));
    let byte = |k: f32| (curvature_encode(Sym2::scalar(k), k, 0.5) * 255.0).round() / 255.0;
    let (round, mean) = curvature_decode(byte(0.2), 0.5);
    assert!(round.xy.abs() < 1e-7 && round.xx == round.yy && round.xx == mean, "{round:?}, {mean}");
}

#[test]
fn curvature_along_a_cylinder_is_zero_and_across_it_is_its_own() {
    let cylinder = Sym2 { xx: 0.2, xy: 0.0, yy: 0.0 };
    let u = |elevation: f64, azimuth: f64| {
        let (s, a) = (elevation.cos() as f32, azimuth);
        vec2(s * a.cos() as f32, s * a.sin() as f32)
    };
    assert!(curvature_from_light(cylinder, u(0.0, FRAC_PI_2)).abs() < 1e-9);
    assert!((curvature_from_light(cylinder, u(0.0, 0.0)) - 0.2).abs() < 1e-7);
    // At 60 degrees above the horizon the talk's form has a quarter of it, the normalised one all.
    let high = u(PI / 3.0, 0.0);
    assert!((curvature_from_light(cylinder, high) - 0.05).abs() < 1e-7);
    assert!((curvature_from_light_normalized(cylinder, high) - 0.2).abs() < 2e-6);
    let none = curvature_from_light_normalized(cylinder, vec2(0.0, 0.0));
    assert!((none - 0.1).abs() < 1e-6, "no direction at all: wanted the mean, got {none}");
}

/// The talk's claim that leaving out the normalisation does not show, in numbers.
#[test]
fn leaving_out_the_normalisation_costs_what_the_docs_say() {
    let error = |curvature: f64| {
        (0..=20)
            .map(|i| {
                let n_u = f64::from(i) * 0.05;
                let right = ring(RadialProfile::skin(), curvature, n_u);
                let talk = ring(RadialProfile::skin(), curvature * (1.0 - n_u * n_u), n_u);
                (0..3).map(|c| (right[c] - talk[c]).abs()).fold(0.0, f64::max)
            })
            .fold(0.0, f64::max)
    };
    assert!(error(0.05) <= 0.0018, "at 0.05: {}", error(0.05));
    assert!((0.02..0.03).contains(&error(0.2)), "at 0.2: {}", error(0.2));
}

#[test]
fn ambient_light_without_scattering_is_plain_irradiance() {
    let light: Sh9 = std::array::from_fn(|i| Vec3::new(1.0, 0.5, -0.2) * (1.0 + i as f32));
    let n = Vec3::new(0.48, -0.6, 0.64);
    let (want, got) = (sh_irradiance(&light, n), skin_irradiance(&light, n, Vec3::ONE, Vec3::ONE));
    assert!((want - got).abs().max_element() < 1e-5, "wanted {want}, got {got}");
    let flat = skin_irradiance(&light, n, Vec3::ZERO, Vec3::ZERO);
    let want = std::f32::consts::PI * light[0] * sh_basis(n)[0];
    assert!((want - flat).abs().max_element() < 1e-5, "wanted {want}, got {flat}");
}

#[test]
fn gloss_lies_between_its_two_lobes() {
    let lobe = |alpha| ggx_d(0.97, alpha) * smith_v(0.7, 0.6, alpha);
    let got = |share| skin_specular(0.97, 0.7, 0.6, 0.2, 0.4, share);
    assert!((got(0.0) - lobe(0.2)).abs() < 1e-6 && (got(1.0) - lobe(0.4)).abs() < 1e-6);
    assert!((got(0.25) - (0.75 * lobe(0.2) + 0.25 * lobe(0.4))).abs() < 1e-6);
}

#[test]
fn normals_by_channel_reach_both_ends() {
    let (n, mesh) = (Vec3::new(0.6, 0.0, 0.8), Vec3::Z);
    assert!((skin_normal(n, mesh, 0.0) - n).length() < 1e-7);
    assert!((skin_normal(n, mesh, 1.0) - mesh).length() < 1e-7);
    let half = skin_normal(n, mesh, 0.5);
    assert!((half.length() - 1.0).abs() < 1e-6 && half.x < n.x && half.x > 0.0, "{half}");
    assert_eq!(skin_lut_uv(-1.0, 0.0, 2.0), vec2(0.0, 0.0));
    assert_eq!(skin_lut_uv(1.0, 0.5, 2.0), vec2(1.0, 1.0));
}

//! Light from all around: orientation, harmonics, sampling.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};
use kinran_scene::Environment;
use kinran_shading::sh::{sh_evaluate, sh_irradiance};

/// The first points of a two-dimensional low-discrepancy sequence (R2, by the plastic number).
fn points(count: usize) -> impl Iterator<Item = Vec2> {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    (0..count).map(|i| {
        let at = |a: f64| (0.5 + a * i as f64).fract() as f32;
        Vec2::new(at(1.0 / PLASTIC), at(1.0 / (PLASTIC * PLASTIC)))
    })
}

/// Dim everywhere, with a small sun near the horizon and a soft window; it spans 5 orders of magnitude.
fn sky() -> Environment {
    let (sun, window) = (Vec3::new(0.8, 0.2, 0.566).normalize(), Vec3::new(-0.5, 0.6, -0.6).normalize());
    Environment::from_fn(64, |d| {
        let blob = |axis: Vec3, sharpness: f32| (sharpness * (d.dot(axis) - 1.0)).exp();
        Vec3::new(0.1, 0.2, 0.4) + Vec3::new(2000., 1500., 800.) * blob(sun, 800.) + 3.0 * blob(window, 20.)
    })
}

#[test]
fn centre_is_minus_z_and_plus_x_lies_right_of_it() {
    let environment = Environment::from_fn(64, |d| d.max(Vec3::ZERO));
    let (width, height) = (environment.width(), environment.height());
    let texel = |u: f32, v: f32| environment.texel((u * width as f32) as usize, (v * height as f32) as usize);
    for (what, uv, want) in [
        ("-z at the centre", (0.5, 0.5), Vec3::ZERO),
        ("+x on the right", (0.75, 0.5), Vec3::X),
        ("-x on the left", (0.25, 0.5), Vec3::ZERO),
        ("+z at the edge", (0.999, 0.5), Vec3::Z),
        ("+y on top", (0.3, 0.0), Vec3::Y),
    ] {
        let got = texel(uv.0, uv.1);
        assert!(want.distance(got) < 0.1, "{what}: wanted {want}, got {got}");
    }
    // A lookup returns what stands at the direction; 0.03 is half a texel's angle.
    for d in [Vec3::X, Vec3::Z, Vec3::Y, Vec3::NEG_X, Vec3::new(0.6, 0.64, 0.48), Vec3::new(-0.1, 0.0, 0.995)]
    {
        let (want, got) = (d.max(Vec3::ZERO), environment.radiance(d.normalize()));
        assert!(want.distance(got) < 0.03, "radiance from {d}: wanted {want}, got {got}");
    }
}

#[test]
fn lookup_has_no_seam_and_no_hole_at_the_poles() {
    let environment = Environment::from_fn(16, |d| Vec3::splat(2.0 + d.x + 0.5 * d.y));
    for eps in [0.0, 1e-6, 1e-3] {
        let (left, right) = (Vec3::new(eps, 0., 1.).normalize(), Vec3::new(-eps, 0., 1.).normalize());
        let step = (environment.radiance(left) - environment.radiance(right)).abs().max_element();
        assert!(step <= 0.01, "a step of {step} at the seam");
        let top = environment.radiance(Vec3::new(eps, 1., 0.).normalize()).x;
        assert!((top - 2.5).abs() < 0.15, "{top} at the zenith");
    }
}

#[test]
fn harmonics_of_a_constant_and_of_a_gradient() {
    let constant = Environment::from_fn(32, |_| Vec3::new(1.0, 2.0, 3.0)).spherical_harmonics();
    let slope = Vec3::new(0.3, -0.5, 0.2);
    let gradient = Environment::from_fn(128, |d| Vec3::splat(1.0 + slope.dot(d))).spherical_harmonics();
    for n in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::new(0.48, 0.6, -0.64)] {
        let (want, got) = (Vec3::new(1.0, 2.0, 3.0) * PI, sh_irradiance(&constant, n));
        assert!(want.distance(got) < 1e-2, "constant at {n}: wanted {want}, got {got}");
        let (want, got) = (PI + 2.0 * PI / 3.0 * slope.dot(n), sh_irradiance(&gradient, n).x);
        assert!((want - got).abs() < 2e-3, "gradient at {n}: wanted {want}, got {got}");
        let (want, got) = (1.0 + slope.dot(n), sh_evaluate(&gradient, n).x);
        assert!((want - got).abs() < 2e-3, "radiance at {n}: wanted {want}, got {got}");
    }
}

/// Importance sampling and harmonics are two ways to the same irradiance. For a point light order 2 gives
/// 1/4 + c/2 + (5/32)(3c^2 - 1) for max(c, 0): worst at c = 0, 9.4 % of the peak. Over this sun's three
/// channels, 1 : 0.75 : 0.4, that is 12.3 % of the largest.
#[test]
fn irradiance_by_harmonics_meets_importance_sampling() {
    let environment = sky();
    let light = environment.spherical_harmonics();
    let estimate = |n: Vec3| {
        const N: usize = 20_000;
        let sum: Vec3 = points(N)
            .map(|u| {
                let (d, pdf) = environment.sample(u);
                environment.radiance(d) * d.dot(n).max(0.0) / pdf
            })
            .sum();
        sum / N as f32
    };
    let normals: Vec<Vec3> = points(24)
        .map(|u| {
            let (z, phi) = (2.0 * u.x - 1.0, 2.0 * PI * u.y);
            Vec3::new((1.0 - z * z).sqrt() * phi.cos(), z, (1.0 - z * z).sqrt() * phi.sin())
        })
        .collect();
    let largest = normals.iter().map(|&n| estimate(n).max_element()).fold(0.0, f32::max);
    for n in normals {
        let (want, got) = (estimate(n), sh_irradiance(&light, n));
        assert!(
            want.distance(got) < 0.13 * largest,
            "irradiance at {n}: wanted {want}, got {got}, largest {largest}"
        );
    }
}

#[test]
fn density_integrates_to_one_and_sample_agrees_with_pdf() {
    for (name, environment) in [
        ("sky", sky()),
        ("studio", Environment::studio()),
        ("black", Environment::from_fn(8, |_| Vec3::ZERO)),
    ] {
        const N: usize = 400_000;
        let integral = points(N)
            .map(|u| {
                let (y, phi) = (1.0 - 2.0 * u.x, 2.0 * PI * u.y);
                let r = (1.0 - y * y).max(0.0).sqrt();
                f64::from(environment.pdf(Vec3::new(r * phi.sin(), y, -r * phi.cos())))
            })
            .sum::<f64>()
            * 4.0
            * std::f64::consts::PI
            / N as f64;
        assert!((integral - 1.0).abs() < 0.01, "{name}: the density integrates to {integral}");
        let mut differ = 0;
        for u in points(10_000) {
            let (d, pdf) = environment.sample(u);
            assert!(
                (d.length() - 1.0).abs() < 1e-5 && pdf > 0.0,
                "{name}: sample({u}) is {d} with density {pdf}"
            );
            differ += usize::from((environment.pdf(d) - pdf).abs() > 1e-3 * pdf);
        }
        // A direction on a texel's border may round into its neighbour.
        assert!(differ < 20, "{name}: {differ} of 10000 samples have another density than their direction");
        for u in [Vec2::ZERO, Vec2::ONE, Vec2::new(0.0, 1.0), Vec2::splat(1.0 - f32::EPSILON / 2.0)] {
            let (d, pdf) = environment.sample(u);
            assert!(d.is_finite() && pdf > 0.0, "{name}: sample({u}) is {d} with density {pdf}");
        }
    }
}

/// Chi-squared test of the sampler against its density, over a 32 by 16 grid of cells, each of 4 by 4 texels, with at least 5
/// expected samples each, the rest pooled.
#[test]
fn samples_follow_luminance() {
    const N: usize = 100_000;
    const CELLS: (usize, usize) = (32, 16);
    let environment = sky();
    let cell = |d: Vec3| {
        let (u, v) = (0.5 + d.x.atan2(-d.z) / (2.0 * PI), d.y.clamp(-1.0, 1.0).acos() / PI);
        let x = ((u * CELLS.0 as f32) as usize).min(CELLS.0 - 1);
        let y = ((v * CELLS.1 as f32) as usize).min(CELLS.1 - 1);
        y * CELLS.0 + x
    };

    // Pseudorandom numbers: splitmix64. A low-discrepancy sequence would fit too well.
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut observed = vec![0.0; CELLS.0 * CELLS.1];
    for _ in 0..N {
        observed[cell(environment.sample(Vec2::new(random(), random())).0)] += 1.0;
    }

    // What the luminance itself demands, integrated over every cell by its lookups, not by the sampler.
    let mut expected = vec![0.0; CELLS.0 * CELLS.1];
    for u in points(2_000_000) {
        let (y, phi) = (1.0 - 2.0 * u.x, 2.0 * PI * u.y);
        let r = (1.0 - y * y).max(0.0).sqrt();
        let d = Vec3::new(r * phi.sin(), y, -r * phi.cos());
        expected[cell(d)] += f64::from(environment.radiance(d).dot(Vec3::new(0.2126, 0.7152, 0.0722)));
    }
    let total: f64 = expected.iter().sum();
    let (mut statistic, mut degrees, mut rest) = (0.0, -1.0, (0.0, 0.0));
    for (&o, e) in observed.iter().zip(expected.iter().map(|e| e / total * N as f64)) {
        if e < 5.0 {
            rest = (rest.0 + o, rest.1 + e);
        } else {
            statistic += (o - e) * (o - e) / e;
            degrees += 1.0;
        }
    }
    if rest.1 >= 5.0 {
        statistic += (rest.0 - rest.1) * (rest.0 - rest.1) / rest.1;
        degrees += 1.0;
    }
    // Wilson and Hilferty: the cube root of chi-squared over its degrees of freedom is nearly normal; 4
    // standard deviations leave a chance of 3 in 100 000.
    let bound: f64 = degrees * (1.0 - 2.0 / (9.0 * degrees) + 4.0 * f64::sqrt(2.0 / (9.0 * degrees))).powi(3);
    assert!(statistic < bound, "chi-squared {statistic} with {degrees} degrees of freedom, bound {bound}");
}

#[test]
fn images_that_are_no_environments_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let image = |width, height, pixels| {
        kinran_image::Image::new(width, height, kinran_image::Channels::Rgb, pixels).unwrap()
    };
    let square = folder.path().join("square.exr");
    let floats = kinran_image::Pixels::F32(vec![1.0; 4 * 4 * 3]);
    kinran_image::write_exr(&square, &image(4, 4, floats)).unwrap();
    let error = Environment::load(&square).unwrap_err().to_string();
    assert!(error.contains("square.exr") && error.contains("twice the height"), "{error}");

    let eight_bit = folder.path().join("sky.png");
    let bytes = kinran_image::Pixels::U8(vec![1; 4 * 2 * 3]);
    kinran_image::write_png(&eight_bit, &image(4, 2, bytes)).unwrap();
    let error = Environment::load(&eight_bit).unwrap_err().to_string();
    assert!(error.contains("sky.png") && error.contains("HDR or EXR"), "{error}");
    assert!(Environment::load(folder.path()).is_err(), "a folder is no environment");

    let good = folder.path().join("good.exr");
    let floats = kinran_image::Pixels::F32((0..4 * 2 * 3).map(|i| i as f32 - 3.0).collect());
    kinran_image::write_exr(&good, &image(4, 2, floats)).unwrap();
    let environment = Environment::load(&good).unwrap();
    assert_eq!(environment.texel(0, 0), Vec3::ZERO, "negative radiance counts as none");
    assert_eq!(environment.texel(1, 1), Vec3::new(12., 13., 14.));
}

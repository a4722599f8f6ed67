//! The maximum-likelihood filter against its fixed point over all texels × 16 microfacets, in f64.
#![allow(clippy::print_stdout, reason = "the measured errors are quoted in the docs")]

mod common;

use std::f32::consts::PI;

use common::exact::{
    Exact, M3, V3, alphas, box_weights, degrees, dot, eigen2, exact, extract, from_eigen2, m_n, mul, sggx,
    transposed, unit,
};
use common::{Random, Surface, filtered, levels_of, maps_of, shaded_l2};
use glam::{Vec3, vec2, vec3};
use kinran_bake::aniso::{Filter, Kernel};
use kinran_scene::Wrap;
use kinran_shading::{Sym2, aniso_from_alphas};

/// `M_n (A^(1/2) s, 1)` for sixteen slopes s: four radii `sqrt(u / (1 - u))`, `u = (k + 1/2) / 4`, on four
/// directions each, every other radius turned by 45°, and all by a share of 90° in steps of 1/64: the fractional part of
/// `x / p + y / p²`, where (x, y) is the texel's place in its footprint and p the plastic number.
fn microfacets((n, a): Exact, place: [usize; 2]) -> Vec<V3> {
    let m = m_n(n);
    let (l1, l2, angle) = eigen2(a);
    let root = from_eigen2(l1.max(0.0).sqrt(), l2.max(0.0).sqrt(), angle);
    let plastic = 1.324_717_957_244_746_f64;
    let turn = place[0] as f64 / plastic + place[1] as f64 / (plastic * plastic);
    let turn = (turn.fract() * 64.0).floor() / 64.0;
    (0..16)
        .map(|i| {
            let u = (f64::from(i / 4) + 0.5) / 4.0;
            let phi = (f64::from(i % 4) + turn + if i / 4 % 2 == 1 { 0.5 } else { 0.0 })
                * std::f64::consts::FRAC_PI_2;
            let (x, y) = ((u / (1.0 - u)).sqrt() * phi.cos(), (u / (1.0 - u)).sqrt() * phi.sin());
            let slope = [root[0] * x + root[1] * y, root[1] * x + root[2] * y, 1.0];
            std::array::from_fn(|k| dot(m[k], slope))
        })
        .collect()
}

/// A texel of a footprint: what it is, its weight, and its column and row from the footprint's first texel on.
struct Part {
    texel: Exact,
    weight: f64,
    place: [usize; 2],
}

/// The fixed point, iterated until nothing moves; the step of expectation maximisation, `A = 4 Σ u (s-m)(s-m)^T
/// / Σ W`, which is slower than the filter's and has the same optimum.
fn fixed_point(texels: &[Part]) -> Exact {
    let mut s: M3 = [[0.0; 3]; 3];
    for Part { texel, weight, .. } in texels {
        let one = sggx(*texel);
        (0..9).for_each(|k| s[k / 3][k % 3] += weight * one[k / 3][k % 3]);
    }
    let n0 = extract(s, unit([s[0][2], s[1][2], s[2][2]])).0;
    let frame = m_n(n0);
    let points: Vec<(f64, f64, f64)> = texels
        .iter()
        .flat_map(|part| microfacets(part.texel, part.place).into_iter().map(move |h| (h, part.weight)))
        .map(|(h, weight)| {
            let [x, y, z]: V3 = std::array::from_fn(|k| (0..3).map(|i| frame[i][k] * h[i]).sum());
            if z > 0.0 { (x / z, y / z, z * weight) } else { (0.0, 0.0, 0.0) }
        })
        .collect();
    let total: f64 = points.iter().map(|p| p.2).sum();
    let linear = slopes(s, frame);

    let (mut m, mut a) = ([0.0; 2], [0.1, 0.0, 0.1]);
    for _ in 0..500 {
        let det = a[0] * a[2] - a[1] * a[1];
        let mut sums = [0.0; 6];
        for (x, y, w) in &points {
            let (dx, dy) = (x - m[0], y - m[1]);
            let u = w / (1.0 + (a[2] * dx * dx - 2.0 * a[1] * dx * dy + a[0] * dy * dy) / det);
            let terms = [u, u * x, u * y, u * dx * dx, u * dx * dy, u * dy * dy];
            sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        let mean = [sums[1] / sums[0], sums[2] / sums[0]];
        let (dx, dy) = (mean[0] - m[0], mean[1] - m[1]);
        let next = [
            4.0 * (sums[3] - sums[0] * dx * dx) / total,
            4.0 * (sums[4] - sums[0] * dx * dy) / total,
            4.0 * (sums[5] - sums[0] * dy * dy) / total,
        ];
        let moved = (0..3).map(|k| (next[k] - a[k]).abs()).fold(0.0, f64::max) / (next[0] + next[2]);
        (m, a) = (mean, next);
        if moved < 1e-5 {
            break;
        }
    }

    // Towards the linear result where one of both is rough.
    let rough = 0.5 * (linear[0] + linear[2]).max(a[0] + a[2]);
    let gap = (1.0 - rough).max(0.0);
    let kept = gap / (gap + (rough / 0.4).powi(5));
    let a: V3 = std::array::from_fn(|k| linear[k] + kept * (a[k] - linear[k]));
    let m = m.map(|m| m * kept);

    let local = [
        [a[0] + m[0] * m[0], a[1] + m[0] * m[1], m[0]],
        [a[1] + m[0] * m[1], a[2] + m[1] * m[1], m[1]],
        [m[0], m[1], 1.0],
    ];
    extract(mul(mul(frame, local), transposed(frame)), n0)
}

/// Squared roughness `[xx, xy, yy]` of an SGGX matrix seen as slopes in a frame (columns).
fn slopes(s: M3, frame: M3) -> V3 {
    let local = mul(mul(transposed(frame), s), frame);
    let c = local[2][2];
    let (x, y) = (local[0][2] / c, local[1][2] / c);
    [local[0][0] / c - x * x, local[0][1] / c - x * y, local[1][1] / c - y * y]
}

/// Errors of one level: relative error of both alphas and angle between normals in degrees, sorted.
struct Errors {
    alpha: Vec<f64>,
    normal: Vec<f64>,
}

fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * q) as usize]
}

/// Errors of levels 1 and up of a square of `size`; of large levels an even choice of texels.
fn errors(texels: &[Surface], size: usize) -> Vec<Errors> {
    let levels = levels_of(&maps_of(texels, size as u32, Wrap::Repeat), Filter::Ml, Kernel::Box);
    let finest: Vec<Exact> = levels[0].iter().map(|t| exact(*t)).collect();
    let weights = box_weights(size);
    let mut all = Vec::new();
    for (level, got) in levels.iter().enumerate().skip(1) {
        let width = weights[level].len();
        let mut errors = Errors { alpha: vec![], normal: vec![] };
        // 61 is prime to all widths.
        let step = if got.len() > 256 { 61 } else { 1 };
        for (i, texel) in got.iter().enumerate().step_by(step) {
            let first = |weights: &[f64]| weights.iter().position(|w| *w > 0.0).unwrap_or(0);
            let (columns, rows) = (&weights[level][i % width], &weights[level][i / width]);
            let (x0, y0) = (first(columns), first(rows));
            let footprint: Vec<Part> = (0..size * size)
                .filter_map(|j| {
                    let (x, y) = (j % size, j / size);
                    let weight = columns[x] * rows[y];
                    (weight > 0.0).then(|| Part { texel: finest[j], weight, place: [x - x0, y - y0] })
                })
                .collect();
            let (wanted, got) = (fixed_point(&footprint), exact(*texel));
            let (a, b) = (alphas(wanted.1), alphas(got.1));
            errors.alpha.extend([(b[0] / a[0] - 1.0).abs(), (b[1] / a[1] - 1.0).abs()]);
            errors.normal.push(degrees(wanted.0, got.0));
        }
        errors.alpha.sort_by(f64::total_cmp);
        errors.normal.sort_by(f64::total_cmp);
        all.push(errors);
    }
    all
}

/// Metal whose every texel is its own.
fn random(size: usize) -> Vec<Surface> {
    let mut random = Random::new(11);
    (0..size * size).map(|_| random.texel((0.05, 0.4), 0.15)).collect()
}

/// A plain weave: warp and weft two texels wide, each with its own direction, tilted along its thread.
fn woven(size: usize, period: usize) -> Vec<Surface> {
    let mut random = Random::new(12);
    (0..size * size)
        .map(|i| {
            let (x, y) = (i % size, i / size);
            let warp = (2 * x / period + 2 * y / period).is_multiple_of(2);
            let along = if warp { y } else { x };
            let tilt = 0.4 * (2.0 * PI * (along as f32 + 0.5) / period as f32).sin() + 0.05 * random.gauss();
            let n = if warp { vec3(0.0, tilt, 1.0) } else { vec3(tilt, 0.0, 1.0) }.normalize();
            let across = if warp { vec2(1.0, 0.0) } else { vec2(0.0, 1.0) };
            (n, aniso_from_alphas(if warp { 0.6 } else { 0.45 }, if warp { 0.15 } else { 0.25 }, across))
        })
        .collect()
}

/// Scratches along x, each row another.
fn brushed(size: usize) -> Vec<Surface> {
    let mut random = Random::new(13);
    let rows: Vec<(f32, f32)> =
        (0..size).map(|_| (0.12 * random.gauss(), random.uniform(0.1, 0.4))).collect();
    (0..size * size)
        .map(|i| {
            let (slope, alpha) = rows[i / size];
            let n = vec3(0.02 * random.gauss(), slope + 0.03 * random.gauss(), 1.0).normalize();
            (n, aniso_from_alphas(alpha, 0.05, vec2(0.0, 1.0)))
        })
        .collect()
}

/// Isotropic stripes of two alphas, one texel wide.
fn stripes(size: usize, across_x: bool, period: usize) -> Vec<Surface> {
    (0..size * size)
        .map(|i| {
            let at = if across_x { i % size } else { i / size };
            (Vec3::Z, Sym2::scalar(if at % period < period / 2 { 0.01 } else { 0.16 }))
        })
        .collect()
}

fn report(name: &str, texels: &[Surface], size: usize, bounds: impl Fn(usize) -> (f64, f64, f64)) {
    println!("{name} {size}x{size}");
    for (i, e) in errors(texels, size).iter().enumerate() {
        let level = i + 1;
        let (median, largest, normal) =
            (quantile(&e.alpha, 0.5), quantile(&e.alpha, 1.0), quantile(&e.normal, 1.0));
        println!(
            "    level {level}: alpha median {median:.4} largest {largest:.4}, normal largest {normal:.3} degrees"
        );
        let (median_bound, largest_bound, normal_bound) = bounds(level);
        assert!(
            median <= median_bound && largest <= largest_bound && normal <= normal_bound,
            "{name}, level {level}: wanted at most {median_bound}, {largest_bound} and {normal_bound} degrees"
        );
    }
}

/// Levels 1 and 2 use all microfacets: what is left there is the iteration's early end. Levels 3 and 4 use a half,
/// further ones some 2000 a footprint.
fn without_period(level: usize) -> (f64, f64, f64) {
    match level {
        1 | 2 => (0.001, 0.005, 0.1),
        3 | 4 => (0.015, 0.05, 0.9),
        _ => (0.02, 0.09, 3.0),
    }
}

#[test]
fn fewer_microfacets_a_texel_change_the_lobe() {
    report("random", &random(64), 64, without_period);
    report("random", &random(128), 128, without_period);
    report("brushed", &brushed(64), 64, without_period);
    report("brushed", &brushed(128), 128, without_period);
}

/// Which microfacets a texel gives must not depend on its place in a weave, whose period is often a power of two.
#[test]
fn microfacets_line_up_with_threads() {
    let woven_bounds = |level| if level <= 4 { without_period(level) } else { (0.1, 0.1, 3.0) };
    report("woven, period 8", &woven(64, 8), 64, woven_bounds);
    report("woven, period 8", &woven(128, 8), 128, woven_bounds);
    report("woven, period 4", &woven(128, 4), 128, woven_bounds);
    for period in [2, 4, 8] {
        for (name, across_x) in [("x", true), ("y", false)] {
            let texels = stripes(64, across_x, period);
            report(&format!("stripes across {name}, period {period}"), &texels, 64, woven_bounds);
        }
    }
}

/// The likelihood's optimum for equal parts of two isotropic alphas is their geometric mean, exactly, which counts as far as
/// the mean of their squares, the linear result, is smooth; sixteen points stand for a lobe within 2 %.
#[test]
fn a_mix_of_two_roughnesses_is_not_their_geometric_mean() {
    for (a, b) in [(0.1, 0.3), (0.2, 0.25), (0.1, 0.2), (0.2, 0.6), (0.3, 0.9), (0.05, 0.6_f32)] {
        let texels: Vec<Surface> = (0..16)
            .map(|i| (Vec3::Z, Sym2::scalar(if (i % 4 + i / 4) % 2 == 0 { a * a } else { b * b })))
            .collect();
        let (n, s) = filtered(&texels, 4, Filter::Ml);
        let (l1, l2, _) = s.eigen();
        let linear = 0.5 * (a * a + b * b);
        let kept = (1.0 - linear) / (1.0 - linear + (linear / 0.4).powi(5));
        let wanted = (linear + kept * (a * b - linear)).sqrt();
        println!("{a} and {b}: wanted {wanted}, got {} and {}", l1.sqrt(), l2.sqrt());
        let off = (l1.sqrt() / wanted - 1.0).abs().max((l2.sqrt() / wanted - 1.0).abs());
        assert!(off < 0.02, "{a} and {b}: wanted {wanted}, got {} and {}", l1.sqrt(), l2.sqrt());
        assert!(n.distance(Vec3::Z) < 1e-6, "{a} and {b}: normal {n}");
    }
}

/// The fully specified cases of a study of twenty footprints: relative L2 error of the shaded lobe. Its views are
/// six others, so the numbers agree within 0.06.
#[test]
fn the_lobe_of_known_footprints_is_further_off_than_it_was() {
    let (s, c) = 10.0_f32.to_radians().sin_cos();
    let groove: Vec<Surface> =
        (0..16).map(|i| (vec3(if i % 2 == 0 { s } else { -s }, 0.0, c), Sym2::scalar(0.01))).collect();
    let turned = |alphas: (f32, f32), angles: [f32; 2]| -> Vec<Surface> {
        (0..16)
            .map(|i| {
                let angle = angles[i % 2].to_radians();
                (Vec3::Z, aniso_from_alphas(alphas.0, alphas.1, vec2(angle.cos(), angle.sin())))
            })
            .collect()
    };
    let iso = |a: f32, b: f32| -> Vec<Surface> {
        (0..16).map(|i| (Vec3::Z, Sym2::scalar(if i % 2 == 0 { a * a } else { b * b }))).collect()
    };
    for (name, texels, linear, ml) in [
        ("V groove of 10 degrees, alpha 0.1", groove, 0.817, 0.698),
        ("0 and 90 degrees, (0.29, 0.04)", turned((0.29, 0.04), [0.0, 90.0]), 0.632, 0.565),
        ("0 and 90 degrees, (0.87, 0.04)", turned((0.87, 0.04), [0.0, 90.0]), 0.895, 0.869),
        ("alpha 0.1 and 0.3", iso(0.1, 0.3), 0.482, 0.271),
        ("alpha 0.05 and 0.6", iso(0.05, 0.6), 0.950, 0.749),
    ] {
        let error = |filter| f64::from(shaded_l2(&texels, filtered(&texels, 4, filter)));
        let (got_linear, got_ml) = (error(Filter::Linear), error(Filter::Ml));
        println!("{name}: linear {got_linear:.3} ({linear}), ml {got_ml:.3} ({ml})");
        assert!((got_linear - linear).abs() < 0.06, "{name}: linear wanted {linear}, got {got_linear}");
        assert!((got_ml - ml).abs() < 0.06, "{name}: ml wanted {ml}, got {got_ml}");
    }
}

/// On the horizon two roughnesses along the tilt differ in nothing but the z of their microfacets.
#[test]
fn texels_on_the_horizon_are_taken_for_one() {
    let texel = |alpha: f32| (Vec3::X, Sym2 { xx: alpha * alpha, xy: 0.0, yy: 0.04 });
    let texels: Vec<Surface> = (0..16).map(|i| texel(if i % 2 == 0 { 0.2 } else { 0.4 })).collect();
    let (_, a) = filtered(&texels, 4, Filter::Ml);
    let alpha = a.xx.sqrt();
    assert!(alpha > 0.22 && alpha < 0.38, "wanted an alpha between 0.2 and 0.4, got {alpha}");
}

/// Whatever the texel, a footprint of nothing else comes out as it went in.
#[test]
fn constant_footprints_come_out_rounded() {
    let mut random = Random::new(3);
    for _ in 0..20 {
        let texels = vec![random.texel((0.01, 0.95), 0.5); 40 * 40];
        let levels = levels_of(&maps_of(&texels, 40, Wrap::Repeat), Filter::Ml, Kernel::Box);
        let wanted = levels[0][0];
        for (level, got) in levels.iter().enumerate() {
            assert!(got.iter().all(|t| *t == wanted), "level {level}: wanted {wanted:?}, got {:?}", got[0]);
        }
    }
}

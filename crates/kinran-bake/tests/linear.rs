//! The linear filter against the average of SGGX matrices in f64 with Jacobi's eigenvectors.
#![allow(clippy::print_stdout, reason = "the measured errors are quoted in the docs")]

mod common;

use common::exact::{
    Exact, M3, V3, alphas, beyond, box_weights, degrees, exact, extract, identity, sggx, unit,
};
use common::{Random, Surface, levels_of, maps_of};
use glam::vec3;
use kinran_bake::aniso::{Filter, Kernel};
use kinran_scene::Wrap;
use kinran_shading::Sym2;

fn texels(seed: u64, width: usize, height: usize) -> Vec<Surface> {
    let mut random = Random::new(seed);
    (0..width * height).map(|i| random.texel((0.02, if i % 3 == 0 { 0.9 } else { 0.3 }), 0.3)).collect()
}

/// What a footprint with these weights along both axes is filtered to.
fn average(finest: &[Exact], width: usize, columns: &[f64], rows: &[f64]) -> Exact {
    let mut s: M3 = [[0.0; 3]; 3];
    let mut mean: V3 = [0.0; 3];
    for (y, wy) in rows.iter().enumerate() {
        for (x, wx) in columns.iter().enumerate() {
            let texel = finest[y * width + x];
            let one = sggx(texel);
            for i in 0..3 {
                mean[i] += wx * wy * texel.0[i];
                for j in 0..3 {
                    s[i][j] += wx * wy * one[i][j];
                }
            }
        }
    }
    extract(s, unit(mean))
}

/// Largest errors of normals (degrees) and of both alphas over all levels of which `weights` speaks.
fn largest_errors(
    (width, height): (usize, usize),
    kernel: Kernel,
    wrap: Wrap,
    weights: impl Fn(usize) -> Vec<Vec<Vec<f64>>>,
) -> (f64, f64) {
    let levels = levels_of(
        &maps_of(&texels((width * 1000 + height) as u64, width, height), width as u32, wrap),
        Filter::Linear,
        kernel,
    );
    let finest: Vec<Exact> = levels[0].iter().map(|t| exact(*t)).collect();
    let (columns, rows) = (weights(width), weights(height));
    let (mut angle, mut alpha) = (0.0_f64, 0.0_f64);
    for (level, got) in levels.iter().enumerate().skip(1).take(columns.len().max(rows.len()) - 1) {
        let (columns, rows) = (&columns[level], &rows[level]);
        assert_eq!(got.len(), columns.len() * rows.len(), "{width}x{height}: size of level {level}");
        for (i, texel) in got.iter().enumerate() {
            let (x, y) = (i % columns.len(), i / columns.len());
            let wanted = average(&finest, width, &columns[x], &rows[y]);
            let got = exact(*texel);
            let (n_error, (a, b)) = (degrees(wanted.0, got.0), (alphas(wanted.1), alphas(got.1)));
            let a_error = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            assert!(
                n_error < 1e-4 && a_error < 1e-6,
                "{width}x{height} {kernel:?} {wrap:?} level {level} ({x}, {y}): wanted {wanted:?}, got {got:?}"
            );
            (angle, alpha) = (angle.max(n_error), alpha.max(a_error));
        }
    }
    (angle, alpha)
}

/// Normals within 1e-4°, alphas within 1e-6; measured 6e-6° and 9e-8.
#[test]
fn odd_sizes_lose_or_double_texels() {
    for size in [(61, 35), (32, 32), (64, 16), (1, 5), (5, 1), (3, 3), (9, 9), (2, 7), (1, 1)] {
        let (angle, alpha) = largest_errors(size, Kernel::Box, Wrap::Repeat, box_weights);
        println!("{size:?}: normals within {angle:.1e} degrees, alphas within {alpha:.1e}");
    }
}

/// `[1 3 3 1] / 8` twice, straight from the formula, on sizes that halve evenly.
fn tent_weights(size: usize, wrap: Wrap) -> Vec<Vec<Vec<f64>>> {
    let mut levels = vec![identity(size)];
    for _ in 0..2 {
        let finer = levels.last().expect("begins with one");
        let level = (0..finer.len() / 2)
            .map(|x| {
                let mut weights = vec![0.0; size];
                for (offset, tap) in [(-1, 0.125), (0, 0.375), (1, 0.375), (2, 0.125)] {
                    let from = beyond(2 * x as i64 + offset, finer.len() as i64, wrap);
                    for (w, f) in weights.iter_mut().zip(&finer[from]) {
                        *w += tap * f;
                    }
                }
                weights
            })
            .collect();
        levels.push(level);
    }
    levels
}

#[test]
fn the_tent_reaches_over_the_border_to_the_wrong_texel() {
    for wrap in [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror] {
        for size in [(16, 8), (8, 32), (4, 4)] {
            largest_errors(size, Kernel::Tent, wrap, |size| tent_weights(size, wrap));
        }
    }
}

/// The same footprint, whichever border: a box never reaches over it.
#[test]
fn the_box_reaches_over_the_border() {
    let texels = texels(5, 13, 10);
    let levels = |wrap| levels_of(&maps_of(&texels, 13, wrap), Filter::Linear, Kernel::Box);
    assert_eq!(levels(Wrap::Repeat), levels(Wrap::Clamp));
    assert_eq!(levels(Wrap::Repeat), levels(Wrap::Mirror));
}

/// Walls steeper than 45° have the largest eigenvalue of the footprint; its top is the one nearest to the mean.
/// In the plane across the groove that is less than 45° away, and nearly that at 46°, where top and wall have
/// the same eigenvalue.
#[test]
fn steep_v_grooves_flip_the_normal_into_a_wall() {
    for (degrees, lowest) in [(30.0_f32, 0.99), (46.0, 0.7), (60.0, 0.98), (75.0, 0.98)] {
        // 13 texels of one wall against 12 of the other.
        let (s, c) = degrees.to_radians().sin_cos();
        let texels: Vec<Surface> =
            (0..25).map(|i| (vec3(if i % 2 == 0 { s } else { -s }, 0.0, c), Sym2::scalar(0.01))).collect();
        for filter in Filter::ALL {
            let (n, a) = common::filtered(&texels, 25, filter);
            let (l1, l2, _) = a.eigen();
            println!(
                "walls of {degrees} degrees, {}: normal {n}, squared roughness {l1} and {l2}",
                filter.name()
            );
            assert!(n.z > lowest, "{filter:?}: walls of {degrees} degrees gave the normal {n}");
            assert!(l1 <= 1.0 && l2 >= 0.0, "{filter:?}: walls of {degrees} degrees gave {a:?}");
        }
    }
}

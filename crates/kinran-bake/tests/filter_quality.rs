//! Which filter keeps the highlight's shape, on footprints no constant was tuned on.
#![allow(clippy::print_stdout, reason = "the measured numbers are quoted in the docs")]

mod common;

use std::iter::zip;

use common::{Random, Surface, filtered, shaded_errors, total_variations};
use glam::{Vec2, Vec3};
use kinran_bake::aniso::Filter;
use kinran_shading::aniso_from_alphas;

/// Thirty footprints of 16 texels: metal, cloth, strong normals and mixes of two materials.
fn footprints(seed: u64) -> Vec<Vec<Surface>> {
    let mut random = Random::new(seed);
    (0..30)
        .map(|i| {
            let materials: [((f32, f32), f32); 2] = match i % 5 {
                0 => [((0.05, 0.3), 0.1); 2],
                1 => [((0.3, 0.6), 0.15); 2],
                2 => [((0.1, 0.5), 0.3); 2],
                3 => [((0.05, 0.15), 0.05), ((0.3, 0.6), 0.15)],
                _ => [((0.04, 0.87), 0.02); 2],
            };
            (0..16).map(|t| random.texel(materials[t % 2].0, materials[t % 2].1)).collect()
        })
        .collect()
}

/// Means over footprints, for each filter.
struct Means {
    l2: f32,
    l1: f32,
    variation: f32,
    each: Vec<f32>,
}

/// By every filter, in the order of [`Filter::ALL`].
fn means(footprints: &[Vec<Surface>]) -> Vec<(Filter, Means)> {
    let of: Vec<_> = footprints
        .iter()
        .map(|texels| {
            let fits = Filter::ALL.map(|filter| filtered(texels, 4, filter));
            zip(shaded_errors(texels, &fits, 64), total_variations(texels, &fits)).collect::<Vec<_>>()
        })
        .collect();
    let mean = |value: &dyn Fn(usize) -> f32| (0..of.len()).map(value).sum::<f32>() / of.len() as f32;
    zip(Filter::ALL, 0..)
        .map(|(filter, f)| {
            let means = Means {
                l2: mean(&|i| of[i][f].0.l2),
                l1: mean(&|i| of[i][f].0.l1),
                variation: mean(&|i| of[i][f].1),
                each: of.iter().map(|footprint| footprint[f].0.l2).collect(),
            };
            (filter, means)
        })
        .collect()
}

/// The maximum-likelihood filter was measured elsewhere to take 26 %, 25 % and 16 % off the talk's error on
/// three sets like these; here it must take 23 % off each set (it takes 25 or 26) and be better on nearly every footprint.
/// The density power divergence must take another 7 % off that (it takes 10), without more error in L1 or in the
/// microfacets.
#[test]
fn the_fits_lose_their_lead_over_the_talks_filter() {
    let mut measured = Filter::ALL.map(|filter| (filter, Vec::new()));
    for seed in [77, 5150, 90210] {
        let means = means(&footprints(seed));
        println!("seed {seed}");
        for ((filter, means), (_, measured)) in zip(&means, &mut measured) {
            let Means { l2, l1, variation, .. } = means;
            println!("    {:<6} L2 {l2:.3} L1 {l1:.3} microfacets {variation:.4}", filter.name());
            measured.push(*l2);
        }
        let of = |filter| &means.iter().find(|(f, _)| *f == filter).unwrap().1;
        let (linear, ml, dpd) = (of(Filter::Linear), of(Filter::Ml), of(Filter::Dpd));
        let better = zip(&ml.each, &linear.each).filter(|(m, l)| m <= l).count();
        assert!(ml.l2 <= 0.77 * linear.l2, "seed {seed}: ml {}, linear {}", ml.l2, linear.l2);
        assert!(better >= 27, "seed {seed}: ml better on {better} of 30 footprints only");

        let no_worse = zip(&dpd.each, &ml.each).filter(|(d, m)| **d <= **m * 1.001).count();
        println!("    dpd {:.3} of ml, no worse on {no_worse} of 30", dpd.l2 / ml.l2);
        assert!(dpd.l2 <= 0.93 * ml.l2, "seed {seed}: dpd {}, ml {}", dpd.l2, ml.l2);
        assert!(dpd.l1 <= ml.l1, "seed {seed}: L1 of dpd {}, of ml {}", dpd.l1, ml.l1);
        let (d, m) = (dpd.variation, ml.variation);
        assert!(d <= 1.01 * m, "seed {seed}: total variation of dpd {d}, of ml {m}");
        assert!(no_worse >= 27, "seed {seed}: dpd no worse on {no_worse} of 30 footprints only");
    }
    // What the pages print: the same, and what was measured here to the last digit but one.
    let (readme, aniso) = (include_str!("../../../README.md"), include_str!("../../../docs/aniso.md"));
    for (filter, errors) in &measured {
        let name = filter.name();
        let printed = printed_errors(readme, name);
        assert_eq!(
            printed,
            printed_errors(aniso, name),
            "README.md and aniso.md print two things for {name}"
        );
        let near = zip(&printed, errors).all(|(printed, error)| (printed - error).abs() < 0.003);
        assert!(printed.len() == 3 && near, "{name}: printed {printed:?}, measured {errors:.3?}");
    }
}

/// Kinds of surfaces: what texels of a footprint have in common.
const CLASSES: [&str; 11] = [
    "metal",
    "cloth",
    "strong normals",
    "two materials",
    "crossing threads",
    "half rough",
    "rough",
    "rough bumps",
    "rough and tilted",
    "mirror",
    "groove",
];

fn class_footprint(class: &str, width: usize, height: usize, random: &mut Random) -> Vec<Surface> {
    let turn = random.uniform(0.0, std::f32::consts::PI);
    (0..width * height)
        .map(|i| {
            let odd = (i % width + i / width) % 2 == 1;
            match class {
                "metal" => random.texel((0.05, 0.3), 0.1),
                "cloth" => {
                    let over = (i % width / 2 + i / width / 2) % 2 == 1;
                    let angle = if over { turn } else { turn + std::f32::consts::FRAC_PI_2 };
                    let (n, _) = random.texel((0.1, 0.2), 0.05);
                    let (along, across) = (random.uniform(0.4, 0.6), random.uniform(0.1, 0.2));
                    (n, aniso_from_alphas(along, across, Vec2::from_angle(angle)))
                }
                "strong normals" => random.texel((0.1, 0.5), 0.3),
                "two materials" if odd => random.texel((0.3, 0.6), 0.15),
                "two materials" => random.texel((0.05, 0.15), 0.05),
                "crossing threads" => random.texel((0.04, 0.87), 0.02),
                "half rough" => random.texel((0.6, 0.7), 0.3),
                "rough" => random.texel((0.95, 1.0), 0.3),
                "rough bumps" => random.texel((0.6, 0.7), 0.1),
                "rough and tilted" => {
                    let (n, a) = random.texel((0.95, 1.0), 0.1);
                    ((n + Vec3::X * 0.577).normalize(), a)
                }
                "mirror" => random.texel((0.02, 0.05), 0.1),
                _ => {
                    let (n, a) = random.texel((0.2, 0.3), 0.05);
                    let wall = Vec2::from_angle(turn) * if odd { 0.6 } else { -0.6 };
                    ((n + wall.extend(0.0)).normalize(), a)
                }
            }
        })
        .collect()
}

/// Footprints of all sizes and shapes: on no kind of surface may a fit be worse than the talk's filter by more than 2 %.
#[test]
fn on_some_surfaces_the_fits_are_worse_than_the_talks_filter() {
    let sizes =
        [(2, 2, 12), (4, 4, 8), (8, 8, 6), (16, 16, 3), (32, 32, 2), (64, 64, 1), (64, 1, 4), (1, 64, 4)];
    let filters = [Filter::Linear, Filter::Ml, Filter::Dpd];
    let mut wrong = Vec::new();
    for class in CLASSES {
        let mut random = Random::new(4242);
        let mut ratios = [0.0, 0.0];
        let mut line = String::new();
        for (width, height, count) in sizes {
            let mut sums = [0.0; 3];
            for _ in 0..count {
                let texels = class_footprint(class, width, height, &mut random);
                let fits = filters.map(|filter| filtered(&texels, width as u32, filter));
                let errors = shaded_errors(&texels, &fits, 32);
                zip(&mut sums, errors).for_each(|(sum, error)| *sum += error.l2 / count as f32);
            }
            let [linear, ml, dpd] = sums;
            line += &format!("  {width}x{height} {linear:.3} {:.3} {:.3}", ml / linear, dpd / linear);
            ratios = [ratios[0] + ml / linear, ratios[1] + dpd / linear];
        }
        let [ml, dpd] = ratios.map(|sum| sum / sizes.len() as f32);
        println!("{class:<16} ml {ml:.3} dpd {dpd:.3} |{line}");
        if ml > 1.02 || dpd > 1.02 {
            wrong.push(format!("{class}: ml {ml:.3} and dpd {dpd:.3} times the error of linear"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// The numbers of the row of a page's table that is about a filter and has three of them.
fn printed_errors(page: &str, filter: &str) -> Vec<f32> {
    let start = format!("| `{filter}`");
    let numbers = |row: &str| -> Vec<f32> {
        row.split('|').filter_map(|cell| cell.trim().trim_matches('*').parse().ok()).collect()
    };
    page.lines()
        .filter(|line| line.starts_with(&start))
        .map(numbers)
        .find(|n| n.len() == 3)
        .unwrap_or_default()
}

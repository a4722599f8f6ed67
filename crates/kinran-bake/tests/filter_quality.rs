//! Which filter keeps the highlight's shape, on footprints no constant was tuned on.
#![allow(clippy::print_stdout, reason = "the measured numbers are quoted in the docs")]

mod common;

use std::iter::zip;

use common::{Random, Surface, filtered, shaded_l2};
use kinran_bake::aniso::Filter;

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

fn mean_shaded_l2(footprints: &[Vec<Surface>], filter: Filter) -> (f32, Vec<f32>) {
    let errors: Vec<f32> =
        footprints.iter().map(|texels| shaded_l2(texels, filtered(texels, 4, filter))).collect();
    (errors.iter().sum::<f32>() / errors.len() as f32, errors)
}

/// The maximum-likelihood filter was measured elsewhere to take 26 %, 25 % and 16 % off the talk's error on
/// three sets like these; here it must take 23 % off each set (it takes 25 or 26) and be better on nearly every footprint.
#[test]
fn ml_loses_its_lead_over_the_talks_filter() {
    let mut measured = Filter::ALL.map(|filter| (filter, Vec::new()));
    for seed in [77, 5150, 90210] {
        let footprints = footprints(seed);
        let (linear, per_linear) = mean_shaded_l2(&footprints, Filter::Linear);
        let (ml, per_ml) = mean_shaded_l2(&footprints, Filter::Ml);
        let better = per_ml.iter().zip(&per_linear).filter(|(m, l)| m <= l).count();
        println!(
            "seed {seed}: linear {linear:.3} ml {ml:.3} ({:.0} %), better in {better} of 30",
            100.0 * (ml / linear - 1.0)
        );
        for (filter, errors) in &mut measured {
            let error = mean_shaded_l2(&footprints, *filter).0;
            println!("    {} {error:.3}", filter.name());
            errors.push(error);
        }
        assert!(ml <= 0.77 * linear, "seed {seed}: ml {ml}, linear {linear}");
        assert!(better >= 27, "seed {seed}: ml better on {better} of 30 footprints only");
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

//! Texels that reflect more count more.

mod common;

use std::sync::Arc;

use common::exact::{alphas, degrees, exact, extract, sggx};
use common::{Random, Surface, levels_of, maps_of};
use glam::{Vec3, vec3};
use kinran_bake::aniso::{
    ColorMap, Dielectric, Filter, Kernel, Reflectance, ReflectanceMaps, ScalarMap, SurfaceMaps, Weights,
};
use kinran_image::{Channels, Image, Pixels};
use kinran_scene::Wrap;

/// Filters that weigh their texels.
fn weighing() -> impl Iterator<Item = Filter> {
    Filter::ALL.into_iter().filter(|filter| *filter != Filter::Naive)
}

fn weighted(texels: &[Surface], width: u32, weights: &[u16]) -> SurfaceMaps {
    let size = (width, texels.len() as u32 / width);
    let weights = Weights::new(size, weights.to_vec()).map(Arc::new);
    SurfaceMaps { weights, ..maps_of(texels, width, Wrap::Repeat) }
}

/// The average of matrices in double precision.
#[test]
fn weights_of_the_linear_filter_are_not_those_of_an_average() {
    let mut random = Random::new(3);
    for footprint in 0..50 {
        let texels: Vec<Surface> = (0..16).map(|_| random.texel((0.05, 0.6), 0.3)).collect();
        let weights: Vec<u16> = (0..16).map(|_| random.uniform(1.0, 65535.0) as u16).collect();
        let levels = levels_of(&weighted(&texels, 4, &weights), Filter::Linear, Kernel::Box);
        let (got_n, got_a) = exact(levels[2][0]);

        let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let (mut s, mut mean) = ([[0.0; 3]; 3], [0.0; 3]);
        for (texel, weight) in texels.iter().zip(&weights) {
            let (share, of) = (f64::from(*weight) / total, exact(*texel));
            let own = sggx(of);
            for i in 0..3 {
                mean[i] += share * of.0[i];
                (0..3).for_each(|j| s[i][j] += share * own[i][j]);
            }
        }
        let (n, a) = extract(s, mean);
        let off = degrees(n, got_n);
        let [t, b] = alphas(a);
        let [got_t, got_b] = alphas(got_a);
        assert!(off < 0.01, "footprint {footprint}: wanted {n:?}, got {got_n:?}, {off}° off");
        assert!((t - got_t).abs() < 1e-3 && (b - got_b).abs() < 1e-3, "{t} {b}, got {got_t} {got_b}");
    }
}

/// A column of gold beside three of what reflects nothing, which are rough and lie on their side.
#[test]
fn texels_that_reflect_nothing_turn_the_lobe() {
    let mut random = Random::new(8);
    for side in [4, 16, 64] {
        let gold: Vec<Surface> = (0..side * side / 4).map(|_| random.texel((0.1, 0.3), 0.15)).collect();
        let dark = |random: &mut Random| {
            let (n, a) = random.texel((0.7, 0.9), 0.1);
            ((n + vec3(0.5, 0.0, 0.0)).normalize(), a)
        };
        let (mut all, mut weights) = (Vec::new(), Vec::new());
        for row in gold.chunks((side / 4) as usize) {
            for texel in row {
                all.push(*texel);
                all.extend((0..3).map(|_| dark(&mut random)));
                weights.extend([65535, 0, 0, 0]);
            }
        }
        for filter in weighing() {
            let last = |maps: &SurfaceMaps| levels_of(maps, filter, Kernel::Box).last().unwrap()[0];
            let got = last(&weighted(&all, side, &weights));
            let wanted = last(&maps_of(&gold, side / 4, Wrap::Repeat));
            let plain = last(&maps_of(&all, side, Wrap::Repeat));
            let off = |to: Surface| degrees(exact(to).0, exact(wanted).0);
            let alpha = |of: Surface| alphas(exact(of).1)[0];
            // Fits look at other microfacets of gold where there are other texels beside it.
            let (angle, ratio) =
                if filter == Filter::Ml || filter == Filter::Dpd { (2.5, 0.12) } else { (0.1, 0.01) };
            assert!(off(got) < angle, "{side} {filter:?}: gold {wanted:?}, beside dark {got:?}");
            assert!(
                (alpha(got) / alpha(wanted) - 1.0).abs() < ratio,
                "{side} {filter:?}: {wanted:?}, {got:?}"
            );
            assert!(off(plain) > 4.0 * angle, "{side} {filter:?}: {plain:?} without weights is as good");
        }
    }
}

fn noise(random: &mut Random, (width, height): (u32, u32), channels: Channels) -> Arc<Image> {
    let count = width * height * channels.count() as u32;
    let samples = (0..count).map(|_| random.uniform(0.0, 256.0) as u8).collect();
    Arc::new(Image::new(width, height, channels, Pixels::U8(samples)).unwrap())
}

/// The linear light of 8-bit sRGB, by its definition.
fn linear(code: u8) -> f64 {
    let v = f64::from(code) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// Maps of one size, by the formula; and of twice the surface's, averaged.
#[test]
fn a_weight_is_not_what_its_texel_reflects() {
    let mut random = Random::new(21);
    for (maps_side, extension) in [(8, false), (8, true), (16, false)] {
        let size = (maps_side, maps_side);
        let [base, strength, tint] =
            [Channels::Rgb, Channels::Rgba, Channels::Rgb].map(|c| noise(&mut random, size, c));
        let metallic = noise(&mut random, size, Channels::R);
        let (base_factor, metal_factor) = (vec3(0.9, 0.5, 1.0), 0.8);
        let dielectric = match extension {
            false => Dielectric::default(),
            true => Dielectric {
                f0: 0.1,
                strength: ScalarMap { image: Some((strength.clone(), 3)), factor: 0.7 },
                color: ColorMap { image: Some(tint.clone()), factor: vec3(1.0, 0.6, 30.0) },
            },
        };
        let reflectance = Reflectance {
            maps: ReflectanceMaps::Metallic {
                base: ColorMap { image: Some(base.clone()), factor: base_factor },
                metallic: ScalarMap { image: Some((metallic.clone(), 0)), factor: metal_factor },
                dielectric,
            },
            wrap: [Wrap::Repeat; 2],
        };
        let f0 = |x: u32, y: u32| -> f64 {
            let bytes = |image: &Image| {
                let Pixels::U8(samples) = &image.pixels else { panic!("8 bits") };
                let count = image.channels.count();
                samples[(y * maps_side + x) as usize * count..][..count].to_vec()
            };
            let m = f64::from(bytes(&metallic)[0]) / 255.0 * f64::from(metal_factor);
            let specular = |c: usize| match extension {
                false => 0.04,
                true => {
                    let tint = linear(bytes(&tint)[c]) * [1.0, 0.6, 30.0][c];
                    (0.1 * tint).min(1.0) * 0.7 * f64::from(bytes(&strength)[3]) / 255.0
                }
            };
            let base = |c: usize| linear(bytes(&base)[c]) * f64::from(base_factor[c]);
            (0..3).map(|c| (specular(c) * (1.0 - m) + base(c) * m) / 3.0).sum()
        };
        let (surface, by) = (8, maps_side / 8);
        let wanted: Vec<u16> = (0..surface * surface)
            .map(|i| {
                let (x0, y0) = (i % surface * by, i / surface * by);
                let texels = (0..by * by).map(|j| f0(x0 + j % by, y0 + j / by));
                (texels.sum::<f64>() / f64::from(by * by) * 65535.0).round() as u16
            })
            .collect();
        let wanted = Weights::new((surface, surface), wanted).unwrap();
        let got = reflectance.weights((surface, surface)).unwrap();
        for (x, y) in (0..surface * surface).map(|i| (i % surface, i / surface)) {
            let (wanted, got) = (wanted.at(x, y), got.at(x, y));
            let what = format!("maps of {maps_side}², extension {extension}, texel {x}, {y}");
            assert!(wanted.abs_diff(got) <= 1, "{what}: wanted {wanted}, got {got}");
        }
    }
}

/// They take no other way through the filters, so that not a bit differs.
#[test]
fn weights_that_are_all_the_same_are_kept() {
    let mut random = Random::new(4);
    let image = noise(&mut random, (16, 16), Channels::Rgb);
    let of = |base: Option<Arc<Image>>, metallic: ScalarMap| Reflectance {
        maps: ReflectanceMaps::Metallic {
            base: ColorMap { image: base, factor: Vec3::splat(0.7) },
            metallic,
            dielectric: Dielectric::default(),
        },
        wrap: [Wrap::Repeat; 2],
    };
    let grey = |v: u8| Arc::new(Image::new(16, 16, Channels::R, Pixels::U8(vec![v; 256])).unwrap());
    let cases = [
        ("cloth", of(Some(image.clone()), ScalarMap::constant(0.0))),
        ("cloth with a metalness of zero", of(Some(image.clone()), ScalarMap::channel(grey(0), 0))),
        ("metal of one colour", of(None, ScalarMap::channel(grey(255), 0))),
        ("a metalness times zero", of(Some(image), ScalarMap { image: Some((grey(9), 0)), factor: 0.0 })),
    ];
    for (name, reflectance) in cases {
        assert_eq!(reflectance.weights((16, 16)), None, "{name}");
    }
    assert_eq!(Weights::new((2, 1), vec![0, 1]), None, "zero counts as one");
}

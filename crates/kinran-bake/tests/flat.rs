//! What is flat stays flat, to the byte, and no texel however wrong breaks a filter.
#![allow(clippy::print_stdout, reason = "the measured errors are quoted in the docs")]

mod common;

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use common::{Random, levels_of};
use kinran_bake::aniso::{
    DirectionMap, Filter, Kernel, NormalMap, RoughnessMaps, ScalarMap, Sheet, SheetRequest, SurfaceMaps,
    SurfaceOptions, bake_surface,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, decode, untold};
use kinran_scene::Wrap;
use proptest::prelude::*;

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Clamp, Wrap::Mirror];
const KERNELS: [Kernel; 2] = [Kernel::Box, Kernel::Tent];

/// An 8-bit image of one colour.
fn plain(width: u32, height: u32, rgb: [u8; 3]) -> Arc<Image> {
    let samples = rgb.repeat((width * height) as usize);
    Arc::new(Image::new(width, height, Channels::Rgb, Pixels::U8(samples)).expect("a sound image"))
}

/// Every kind of roughness, all of one value.
fn roughnesses(width: u32, height: u32) -> Vec<(&'static str, RoughnessMaps)> {
    let image = |rgb| plain(width, height, rgb);
    let channel = |rgb| ScalarMap::channel(image(rgb), 1);
    let angle = |code: u8| DirectionMap::Angle { map: channel([0, code, 0]), span: TAU };
    vec![
        ("smooth", RoughnessMaps::Isotropic(ScalarMap::constant(0.0))),
        ("half rough", RoughnessMaps::Isotropic(channel([0, 128, 0]))),
        ("rough", RoughnessMaps::Isotropic(ScalarMap::constant(1.0))),
        (
            "gloss along an angle",
            RoughnessMaps::Gloss {
                u: channel([0, 60, 0]),
                v: channel([0, 200, 0]),
                direction: Some(angle(25)),
            },
        ),
        (
            "gloss along a vector",
            RoughnessMaps::Gloss {
                u: ScalarMap::constant(0.88),
                v: ScalarMap::constant(0.3),
                direction: Some(DirectionMap::Vector(image([200, 30, 0]))),
            },
        ),
        (
            "KHR",
            RoughnessMaps::Khr {
                roughness: channel([0, 90, 0]),
                strength: 0.8,
                rotation: 0.7,
                texture: Some(image([220, 60, 200])),
            },
        ),
        ("encoded", RoughnessMaps::Encoded(image([130, 190, 60]))),
        ("encoded, singular", RoughnessMaps::Encoded(image([130, 255, 60]))),
    ]
}

/// The texel of level 0 on all levels, after compression and decompression, to the byte. BC5 and BC7 hold a
/// block of one colour exactly.
#[test]
fn constant_maps_change_from_level_to_level() {
    let sheets =
        [Sheet::Normal, Sheet::Aniso, Sheet::Roughness, Sheet::IsotropicRoughness, Sheet::KhrAnisotropy];
    let mut wrong = Vec::new();
    for (width, height) in [(16, 16), (13, 7)] {
        for code in [[128, 128, 255], [127, 127, 255], [128, 127, 255], [190, 90, 220], [240, 160, 140]] {
            for (name, roughness) in roughnesses(width, height) {
                for (kernel, wrap) in KERNELS.into_iter().zip(WRAPS) {
                    let maps = SurfaceMaps {
                        normal: NormalMap::new(plain(width, height, code), false),
                        roughness: roughness.clone(),
                        wrap: [wrap; 2],
                        weights: None,
                    };
                    for filter in Filter::ALL {
                        let requests = sheets.map(|sheet| SheetRequest {
                            sheet,
                            encoding: Encoding {
                                format: match (width, sheet) {
                                    (13, _) => Format::Rgba8,
                                    (_, Sheet::Normal) => Format::Bc5,
                                    _ => Format::Bc7,
                                },
                                encoder: Encoder::Portable,
                                preset: Preset::Fast,
                            },
                            packed_with: None,
                        });
                        let options = SurfaceOptions { filter, kernel };
                        let baked = bake_surface(&maps, options, &requests, &untold).expect("it bakes");
                        for (sheet, texture) in sheets.iter().zip(&baked.textures) {
                            texture.check().expect("a sound texture");
                            let bytes = |level: usize| -> Vec<[u8; 4]> {
                                let texels = texture.decode_level(level).expect("it decodes");
                                texels.iter().map(|t| t.map(|v| (v * 255.0).round() as u8)).collect()
                            };
                            let wanted = bytes(0)[0];
                            if *sheet == Sheet::Normal {
                                assert_eq!(wanted[..2], code[..2], "level 0 is not as authored");
                            }
                            for level in 0..texture.levels.len() {
                                // The average of SGGX matrices of alpha 1 is a sphere, which has no normal.
                                let sphere =
                                    name == "rough" && matches!(filter, Filter::Linear | Filter::Lean);
                                if sphere && *sheet == Sheet::Normal {
                                    continue;
                                }
                                if let Some(got) = bytes(level).iter().find(|got| **got != wanted) {
                                    wrong.push(format!(
                                        "{width}x{height} {code:?} {name} {kernel:?} {wrap:?} {} {}: \
                                         level {level} wanted {wanted:?}, got {got:?}",
                                        filter.name(),
                                        sheet.name()
                                    ));
                                    break;
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    wrong.iter().for_each(|line| println!("{line}"));
    assert!(wrong.is_empty(), "{} levels are not flat", wrong.len());
}

/// Without a normal map and with constants there is one texel, and it is what was asked for.
#[test]
fn constants_alone_have_no_size() {
    let maps = SurfaceMaps {
        normal: NormalMap::flat(),
        roughness: RoughnessMaps::Isotropic(ScalarMap::constant(0.5)),
        wrap: [Wrap::Repeat; 2],
        weights: None,
    };
    for filter in Filter::ALL {
        let levels = levels_of(&maps, filter, Kernel::Box);
        assert_eq!(levels.len(), 1);
        let (n, a) = levels[0][0];
        assert_eq!((n.x, n.y, n.z, a.xx, a.xy, a.yy), (0.0, 0.0, 1.0, 0.0625, 0.0, 0.0625), "{filter:?}");
    }
}

/// 8-bit samples, half of them the worst ones.
fn samples(random: &mut Random, count: usize) -> Vec<u8> {
    (0..count)
        .map(|_| {
            let v = random.uniform(0.0, 512.0) as usize;
            if v < 256 { v as u8 } else { [0, 255, 127, 128][v % 4] }
        })
        .collect()
}

fn any_maps(seed: u64, width: u32, height: u32, kind: u32, wrap: Wrap) -> SurfaceMaps {
    let mut random = Random::new(seed);
    let mut image = || {
        let samples = samples(&mut random, (width * height * 4) as usize);
        Arc::new(Image::new(width, height, Channels::Rgba, Pixels::U8(samples)).expect("a sound image"))
    };
    let mut normal = NormalMap::new(image(), seed.is_multiple_of(2));
    normal.scale = [1.0, 1.0, 0.0, -3.0][(seed / 2 % 4) as usize];
    let roughness = match kind {
        0 => RoughnessMaps::Isotropic(ScalarMap::channel(image(), 3)),
        1 => RoughnessMaps::Gloss {
            u: ScalarMap::channel(image(), 0),
            v: ScalarMap { image: Some((image(), 1)), factor: 2.0 },
            direction: Some(DirectionMap::Vector(image())),
        },
        2 => RoughnessMaps::Gloss {
            u: ScalarMap::channel(image(), 0),
            v: ScalarMap::constant(1.0),
            direction: Some(DirectionMap::Angle { map: ScalarMap::channel(image(), 2), span: PI }),
        },
        3 => RoughnessMaps::Khr {
            roughness: ScalarMap::channel(image(), 1),
            strength: 5.0,
            rotation: -40.0,
            texture: Some(image()),
        },
        _ => RoughnessMaps::Encoded(image()),
    };
    SurfaceMaps { normal, roughness, wrap: [wrap, Wrap::Repeat], weights: None }
}

/// All filters' levels hold unit normals with z >= 0 and roughness with eigenvalues in [0, 1].
fn all_levels_are_sound(maps: &SurfaceMaps, kernel: Kernel) -> Result<(), TestCaseError> {
    for filter in Filter::ALL {
        for (level, texels) in levels_of(maps, filter, kernel).iter().enumerate() {
            for (n, a) in texels {
                let sound = (n.length() - 1.0).abs() < 1e-5 && n.z >= 0.0;
                prop_assert!(sound, "{} level {level}: normal {n}", filter.name());
                // NaN fails every comparison.
                let (half, radius) = (0.5 * a.trace(), (0.5 * (a.xx - a.yy)).hypot(a.xy));
                let sound = half - radius >= -1e-6 && half + radius <= 1.0 + 1e-5;
                prop_assert!(sound, "{} level {level}: {a:?}", filter.name());
            }
        }
    }
    Ok(())
}

/// Smooth texels with normals on the horizon, one in 20 000 of those tried: the likelihood is highest at a single
/// microfacet.
#[test]
fn one_microfacet_outweighs_a_footprint() {
    for (seed, width, height, kind) in [(15968610990201710833, 1, 10, 3), (1087827168487019936, 6, 6, 2)] {
        let maps = any_maps(seed, width, height, kind, Wrap::Repeat);
        all_levels_are_sound(&maps, Kernel::Box).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_wrong_texel_breaks_a_filter(
        seed: u64,
        (width, height) in (1_u32..=19, 1_u32..=19),
        kind in 0_u32..5,
        wrap in 0_usize..3,
        tent: bool,
    ) {
        let maps = any_maps(seed, width, height, kind, WRAPS[wrap]);
        let kernel = KERNELS[usize::from(tent)];
        all_levels_are_sound(&maps, kernel)?;
        let requests = [Sheet::Normal, Sheet::Aniso].map(|sheet| SheetRequest {
            sheet,
            encoding: Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast },
            packed_with: None,
        });
        let options = SurfaceOptions { filter: Filter::Ml, kernel };
        let baked = bake_surface(&maps, options, &requests, &untold).unwrap();
        for level in &baked.levels {
            let numbers = [level.ndf_l2, level.normal_rms_degrees, level.alpha_t_rms, level.alpha_b_rms];
            prop_assert!(numbers.iter().all(|v| v.is_finite()), "{level:?}");
        }
    }
}

/// Sizes along a row for which a footprint has 9, 11, 13 or 15 texels, and neighbours.
#[test]
fn odd_footprints_are_probed_beyond_their_end() {
    for width in 1..=70 {
        let maps = SurfaceMaps {
            normal: NormalMap::new(plain(width, 2, [128, 128, 255]), false),
            roughness: RoughnessMaps::Isotropic(ScalarMap::constant(0.3)),
            wrap: [Wrap::Repeat; 2],
            weights: None,
        };
        let request = SheetRequest {
            sheet: Sheet::Normal,
            encoding: Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast },
            packed_with: None,
        };
        let baked = bake_surface(&maps, SurfaceOptions::default(), &[request], &untold).expect("it bakes");
        for level in &baked.levels {
            assert!(level.ndf_l2 < 1e-3, "width {width}: {level:?}");
        }
        let last = baked.textures[0].levels.last().expect("a level");
        let texel = decode(Format::Rgba8, &last.data, 1, 1).expect("it decodes")[0];
        assert_eq!(texel.map(|v| (v * 255.0).round() as u8), [128, 128, 255, 255], "width {width}");
    }
}

/// Rough surfaces keep the tilt of their normals over distance, which diffuse light shows as well. At alpha 1 the
/// lobe itself has no direction: the mean normal stands for it.
#[test]
fn rough_surfaces_are_flattened() {
    use glam::vec3;
    use kinran_shading::Sym2;
    let alphas = [0.5, 0.8, 0.9, 0.95, 0.99, 1.0];
    for (alpha, seed) in alphas.into_iter().flat_map(|alpha| (5..11).map(move |seed| (alpha, seed))) {
        let mut random = Random::new(seed);
        let texels: Vec<common::Surface> = (0..16 * 16)
            .map(|_| {
                let n = vec3(0.4 + 0.1 * random.gauss(), 0.1 * random.gauss(), 1.0).normalize();
                (n, Sym2::scalar(alpha * alpha))
            })
            .collect();
        for filter in Filter::ALL {
            let (n, _) = common::filtered(&texels, 16, filter);
            let tilt = n.x / n.z / 0.4;
            println!("alpha {alpha}, seed {seed}, {}: {tilt:.2} of the tilt", filter.name());
            assert!(
                tilt > 0.9 && tilt < 1.3,
                "alpha {alpha}, seed {seed}, {}: normal {n} keeps {tilt} of the tilt, wanted 0.9 to 1.3",
                filter.name()
            );
        }
    }
}

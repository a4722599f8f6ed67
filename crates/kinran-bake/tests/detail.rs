//! The detail solver: what it must reach, refuse and leave alone.

use glam::{Vec2, vec2, vec3};
use kinran_bake::detail::{
    Blend, DetailOptions, Layer, LayerTransform, MapKind, Mask, Target, Tile, TileOptions, compare, solve,
    synthesize,
};
use kinran_image::{Channels, Encoder, Encoding, Format, Image, Pixels, Preset, untold};

const RGBA8: Encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
const BC1: Encoding = Encoding { format: Format::Bc1, encoder: Encoder::Portable, preset: Preset::Normal };

/// Numbers that look random and are the same everywhere.
fn noise(seed: u32, i: usize) -> u8 {
    let mut h = seed.wrapping_mul(0x9e37_79b1) ^ (i as u32).wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    (h ^ (h >> 15)) as u8
}

fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> Image {
    let bytes = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).flat_map(|(x, y)| texel(x, y));
    Image::new(width, height, Channels::Rgb, Pixels::U8(bytes.collect())).unwrap()
}

/// Texture-like: slow colours with grain on them.
fn scan(width: u32, height: u32, seed: u32) -> Image {
    image(width, height, |x, y| {
        let i = (y * width + x) as usize;
        std::array::from_fn(|c| {
            let slow =
                110.0 + 60.0 * ((x as f32 * 0.11 + c as f32 + seed as f32).sin() + (y as f32 * 0.07).cos());
            (slow * 0.6 + f32::from(noise(seed, i)) * 0.25 + 20.0).clamp(0.0, 255.0) as u8
        })
    })
}

fn normals(width: u32, height: u32, seed: u32) -> Image {
    image(width, height, |x, y| {
        let i = (y * width + x) as usize;
        let n =
            vec3(f32::from(noise(seed, i)) / 255.0 - 0.5, f32::from(noise(seed + 9, i)) / 255.0 - 0.5, 1.0);
        (n.normalize() * 127.5 + 127.5).to_array().map(|v| v.round() as u8)
    })
}

fn aniso(width: u32, height: u32, seed: u32) -> Image {
    image(width, height, |x, y| {
        std::array::from_fn(|c| 60 + noise(seed + c as u32, (y * width + x) as usize) / 2)
    })
}

fn map(kind: MapKind, width: u32, height: u32, seed: u32) -> Image {
    match kind {
        MapKind::Color | MapKind::Data => scan(width, height, seed),
        MapKind::Normal => normals(width, height, seed),
        MapKind::Aniso => aniso(width, height, seed),
    }
}

const KINDS: [MapKind; 4] = [MapKind::Color, MapKind::Data, MapKind::Normal, MapKind::Aniso];

fn tile(image: &Image, kind: MapKind, encoding: Encoding) -> Tile {
    Tile::new(image, TileOptions::new(kind, encoding)).unwrap()
}

fn target(image: &Image, kind: MapKind) -> Target {
    Target::new(image, kind, false).unwrap()
}

fn options(encoding: Encoding) -> DetailOptions {
    DetailOptions::new(encoding)
}

#[test]
fn a_target_equal_to_its_tile_asks_for_nothing() {
    for kind in [MapKind::Color, MapKind::Data, MapKind::Normal] {
        let picture = map(kind, 64, 32, 5);
        let tile = tile(&picture, kind, RGBA8);
        let target = target(&picture, kind);
        for blend in [Blend::Smooth, Blend::Plain] {
            let options = DetailOptions { blend, ..options(RGBA8) };
            // Against the tile as authored every level is the target's own.
            let uncompensated = DetailOptions { compensate: false, ..options };
            let solved = solve(&target, &[Layer::new(&tile)], &uncompensated, &untold).unwrap();
            for (level, data) in solved.texture.levels.iter().enumerate() {
                for texel in data.data.chunks_exact(4) {
                    let wanted = if kind == MapKind::Normal { [128, 128] } else { [128; 2] };
                    assert_eq!(texel[..2], wanted, "{kind:?}, {blend:?}, level {level}");
                }
            }
            assert!(solved.levels[0].error < 0.5, "{kind:?}: {:?}", solved.levels[0]);
        }
    }
}

#[test]
fn black_and_white_tiles_round_trip() {
    for kind in [MapKind::Color, MapKind::Data] {
        let wanted = map(kind, 48, 48, 7);
        for grey in [0, 255] {
            let tile = tile(&image(16, 16, |_, _| [grey; 3]), kind, RGBA8);
            let solved =
                solve(&target(&wanted, kind), &[Layer::new(&tile)], &options(RGBA8), &untold).unwrap();
            // Over black the smooth overlay has up to 2.4 steps of error, see kinran-shading; over sRGB's dark end more.
            assert!(solved.levels[0].error < 1.6, "{kind:?} over {grey}: {:?}", solved.levels[0]);
        }
    }
}

/// The blended result of an uncompressed s is the target but for its own 8 bits, wherever the tile lies.
#[test]
fn every_kind_is_reached_under_every_transform() {
    let transforms = [
        LayerTransform::default(),
        LayerTransform { scale: Vec2::splat(4.0), ..LayerTransform::default() },
        LayerTransform { scale: vec2(2.5, 3.7), offset: vec2(0.2, -0.4), ..LayerTransform::default() },
        LayerTransform { scale: Vec2::splat(3.0), rotation: 0.7, offset: vec2(0.1, 0.9), mirror: true },
        LayerTransform { scale: vec2(-2.0, 1.5), rotation: -2.0, mirror: true, ..LayerTransform::default() },
    ];
    for kind in KINDS {
        // Sizes that do not divide each other, nor 4.
        let (picture, detail) = (map(kind, 75, 53, 1), map(kind, 30, 42, 2));
        let tile = tile(&detail, kind, BC7);
        for transform in transforms {
            let layer = Layer { transform, ..Layer::new(&tile) };
            let options = DetailOptions { aniso_alpha: 0.3, ..options(RGBA8) };
            let solved = solve(&target(&picture, kind), &[layer], &options, &untold).unwrap();
            assert_eq!(solved.texture.levels.len(), 7);
            for level in &solved.levels[1..] {
                let limit = if kind == MapKind::Normal { 0.5 } else { 1.3 };
                if level.unreached == 0.0 {
                    assert!(level.error < limit, "{kind:?} under {transform:?}: {level:?}");
                }
            }
        }
    }
}

const BC7: Encoding = Encoding { format: Format::Bc7, encoder: Encoder::Portable, preset: Preset::Fast };

#[test]
fn three_layers_with_masks_and_shifts_are_one_detail() {
    let kind = MapKind::Color;
    let tiles: Vec<Tile> = (0..3).map(|seed| tile(&scan(32, 32, seed), kind, BC1)).collect();
    let mask = tile(&scan(20, 24, 9), MapKind::Data, RGBA8);
    let layer = |i: usize| Layer {
        transform: LayerTransform { scale: Vec2::splat(2.0 + i as f32), ..LayerTransform::default() },
        hsv: vec3(0.1 * i as f32, 0.8, 1.1),
        mask: i.checked_sub(1).map(|channel| Mask { map: &mask, channel, contrast: 3.0 }),
        ..Layer::new(&tiles[i])
    };
    let layers = [layer(0), layer(1), layer(2)];
    let solved = solve(&target(&scan(64, 64, 4), kind), &layers, &options(RGBA8), &untold).unwrap();
    assert!(solved.levels[1].error < 1.0, "{:?}", solved.levels[1]);
    // The order counts.
    let other = [
        Layer { mask: None, ..layers[2] },
        Layer { mask: layers[1].mask, ..layers[1] },
        Layer { mask: layers[2].mask, ..layers[0] },
    ];
    let swapped = solve(&target(&scan(64, 64, 4), kind), &other, &options(RGBA8), &untold).unwrap();
    assert_ne!(solved.texture.levels[0].data, swapped.texture.levels[0].data);
}

#[test]
fn sixteen_bits_say_what_eight_say() {
    let eight = scan(40, 40, 3);
    let Pixels::U8(bytes) = &eight.pixels else { unreachable!() };
    let wide = bytes.iter().map(|&b| u16::from(b) * 257).collect();
    let sixteen = Image::new(40, 40, Channels::Rgb, Pixels::U16(wide)).unwrap();
    let tile = tile(&scan(16, 16, 8), MapKind::Color, BC1);
    let solved = [eight, sixteen].map(|image| {
        solve(&target(&image, MapKind::Color), &[Layer::new(&tile)], &options(RGBA8), &untold)
            .unwrap()
            .texture
    });
    for (a, b) in solved[0].levels.iter().zip(&solved[1].levels) {
        let differ = a.data.iter().zip(&b.data).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        assert_eq!(differ, 0, "bytes that differ by more than rounding, of {}", a.data.len());
    }
}

#[test]
fn alpha_passes_through() {
    let bytes = (0..32 * 32 * 4).map(|i| noise(1, i)).collect();
    let picture = Image::new(32, 32, Channels::Rgba, Pixels::U8(bytes)).unwrap();
    let tile = tile(&scan(16, 16, 2), MapKind::Color, BC1);
    let target = target(&picture, MapKind::Color);
    let solved = solve(&target, &[Layer::new(&tile)], &options(RGBA8), &untold).unwrap();
    let Pixels::U8(wanted) = &picture.pixels else { unreachable!() };
    for (s, t) in solved.texture.levels[0].data.chunks_exact(4).zip(wanted.chunks_exact(4)) {
        assert_eq!(s[3], t[3]);
    }
    let error = solve(&target, &[Layer::new(&tile)], &options(BC1), &untold).unwrap_err().to_string();
    assert!(error.contains("alpha") && error.contains("bc7"), "{error}");
}

#[test]
fn compensation_and_choice_lower_the_blended_error() {
    let (picture, detail) = (scan(128, 128, 3), scan(64, 64, 11));
    let tile = tile(&detail, MapKind::Color, BC1);
    let layer = Layer {
        transform: LayerTransform { scale: Vec2::splat(2.0), ..LayerTransform::default() },
        ..Layer::new(&tile)
    };
    let target = target(&picture, MapKind::Color);
    let error = |compensate: bool, choose: bool| {
        let options = DetailOptions { compensate, choose, ..options(BC1) };
        solve(&target, &[layer], &options, &untold).unwrap().levels[1].error
    };
    let (neither, compensated, both) = (error(false, false), error(true, false), error(true, true));
    assert!(compensated < neither, "wanted less than {neither}, got {compensated}");
    assert!(both < compensated * 0.99, "wanted less than {compensated}, got {both}");
}

/// The finest level is better at its own size and no worse, but for a hundredth, where it is magnified.
#[test]
fn the_finest_level_takes_back_half_of_what_the_tiles_lost() {
    let tile = tile(&scan(64, 64, 11), MapKind::Color, BC1);
    let layer = Layer {
        transform: LayerTransform { scale: Vec2::splat(4.0), ..LayerTransform::default() },
        ..Layer::new(&tile)
    };
    let target = target(&scan(128, 128, 3), MapKind::Color);
    let [none, half] = [0.0, 0.5].map(|finest_compensation| {
        let options = DetailOptions { finest_compensation, ..options(BC1) };
        compare(&target, &[layer], &options, &untold).unwrap().0
    });
    let at = |c: &kinran_bake::detail::Comparison| (c.levels[0].blended, c.magnified.blended);
    let ((own_none, magnified_none), (own_half, magnified_half)) = (at(&none), at(&half));
    assert!(own_half < own_none * 0.95, "at its own size: without {own_none}, with {own_half}");
    assert!(
        magnified_half < magnified_none * 1.01,
        "magnified: without {magnified_none}, with {magnified_half}"
    );
    // What the talk would do, and all levels below, are the same.
    assert_eq!(half.levels[0].talk, none.levels[0].talk);
    assert_eq!(half.levels[1], none.levels[1]);
}

#[test]
fn mips_are_solved_and_not_averaged() {
    let tile = tile(&scan(64, 64, 11), MapKind::Color, BC1);
    let target = target(&scan(64, 64, 3), MapKind::Color);
    let solved = solve(&target, &[Layer::new(&tile)], &options(RGBA8), &untold).unwrap();
    let averaged = |x: usize, y: usize| {
        let fine = &solved.texture.levels[0].data;
        [0, 1, 64, 65].map(|o| u32::from(fine[(y * 2 * 64 + x * 2 + o) * 4])).iter().sum::<u32>() / 4
    };
    let level = &solved.texture.levels[1].data;
    let differ =
        (0..32 * 32).filter(|i| averaged(i % 32, i / 32).abs_diff(u32::from(level[i * 4])) > 2).count();
    assert!(differ > 100, "{differ} of 1024 texels differ from an average");
    assert!(solved.levels[1..].iter().all(|level| level.error < 1.0), "{:?}", solved.levels);
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let tile = tile(&scan(33, 47, 11), MapKind::Color, BC1);
    let target = target(&scan(130, 70, 3), MapKind::Color);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&target, &[Layer::new(&tile)], &options(BC1), &untold).unwrap())
    };
    let (one, four) = (run(1), run(4));
    assert_eq!(one.texture, four.texture);
    assert_eq!(one.levels, four.levels);
}

#[test]
fn one_level_by_itself_is_the_solvers_own() {
    let tile = tile(&scan(32, 32, 11), MapKind::Color, BC1);
    let target = target(&scan(64, 64, 3), MapKind::Color);
    let options = options(RGBA8);
    let solved = solve(&target, &[Layer::new(&tile)], &options, &untold).unwrap();
    let mut level = Vec::new();
    synthesize(&target, &[Layer::new(&tile)], &options, 1, &mut level).unwrap();
    assert_eq!(level, solved.texture.levels[1].data);
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let color = tile(&scan(16, 16, 1), MapKind::Color, BC1);
    let data = tile(&scan(16, 16, 1), MapKind::Data, BC1);
    let target_color = target(&scan(32, 32, 2), MapKind::Color);
    let mask = Mask { map: &data, channel: 0, contrast: 1.0 };
    let base = Layer::new(&color);
    let cases: [(&str, Vec<Layer>); 7] = [
        ("1 to 3 layers, got 0", vec![]),
        ("1 to 3 layers, got 4", vec![base; 4]),
        ("layer 2 has no mask", vec![base, base]),
        ("layer 1 lies at the bottom", vec![Layer { mask: Some(mask), ..base }]),
        ("layer 1 holds data, but the target is color", vec![Layer::new(&data)]),
        ("a mask is one channel", vec![base, Layer { mask: Some(Mask { map: &color, ..mask }), ..base }]),
        (
            "scale must be finite and not zero",
            vec![Layer { transform: LayerTransform { scale: vec2(0.0, 1.0), ..base.transform }, ..base }],
        ),
    ];
    for (wanted, layers) in cases {
        let error = solve(&target_color, &layers, &options(BC1), &untold).unwrap_err().to_string();
        assert!(error.contains(wanted), "wanted {wanted}, got {error}");
    }
    let grey = Image::new(4, 4, Channels::R, Pixels::U8(vec![7; 16])).unwrap();
    for kind in [MapKind::Normal, MapKind::Aniso] {
        let error = Target::new(&grey, kind, false).unwrap_err().to_string();
        assert!(error.contains("grey"), "{error}");
    }
    let bright = Image::new(1, 2, Channels::R, Pixels::F32(vec![0.5, 1.5])).unwrap();
    let error = Target::new(&bright, MapKind::Color, false).unwrap_err().to_string();
    assert!(error.contains("texel (0, 1) is 1.5"), "{error}");
    let layers = [Layer::new(&color)];
    let too_far = DetailOptions { first_level: 6, ..options(BC1) };
    assert!(solve(&target_color, &layers, &too_far, &untold).unwrap_err().to_string().contains("6 levels"));
}

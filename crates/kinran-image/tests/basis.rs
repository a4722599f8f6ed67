//! UASTC in KTX2, as `KHR_texture_basisu` wants it, and files of Basis Universal by other writers.
#![cfg(feature = "uastc")]

use std::path::Path;

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use kinran_image::{
    Encoder, Encoding, Format, Level, Preset, Texture, Transfer, decode_texture, encode, encode_dds,
    encode_ktx2, full_level_count, level_size,
};

/// RGBA of one texel of a level: the level's number in red, its place in green and blue.
type Painted = fn(usize, f32, f32) -> [f32; 4];

/// Tangent-space normals of ripples, in three channels.
fn normals(level: usize, u: f32, v: f32) -> [f32; 4] {
    let slope = [0.4 * (11.0 * u + 3.0 * v).sin(), 0.3 * (17.0 * v + level as f32).cos()];
    let length = (slope[0] * slope[0] + slope[1] * slope[1] + 1.0).sqrt();
    [slope[0] / length, slope[1] / length, 1.0 / length, 1.0].map(|x| x * 0.5 + 0.5)
}

/// Roughness in green, metalness in blue, as glTF packs them.
fn roughness(level: usize, u: f32, v: f32) -> [f32; 4] {
    [1.0, 0.5 + 0.3 * (9.0 * u * v + level as f32).sin(), if u + v > 1.0 { 1.0 } else { 0.0 }, 1.0]
}

/// Colour that is cut out.
fn leaves(_: usize, u: f32, v: f32) -> [f32; 4] {
    let alpha = if (14.0 * u).sin() * (9.0 * v).cos() > 0.0 { 1.0 } else { 0.0 };
    [0.2 + 0.1 * u, 0.5 + 0.2 * v, 0.1, alpha]
}

fn painted(paint: Painted, width: u32, height: u32) -> Vec<Vec<u8>> {
    (0..full_level_count(width, height))
        .map(|level| {
            let (width, height) = (level_size(width, level), level_size(height, level));
            let uv = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
            (0..height)
                .flat_map(|y| (0..width).map(move |x| (x, y)))
                .flat_map(|(x, y)| paint(level, uv(x, width), uv(y, height)))
                .map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8)
                .collect()
        })
        .collect()
}

fn texture(levels: &[Vec<u8>], transfer: Transfer, width: u32, height: u32, preset: Preset) -> Texture {
    let encoding = Encoding { format: Format::Uastc, encoder: Encoder::Portable, preset };
    let levels = levels.iter().enumerate().map(|(i, rgba8)| {
        let (width, height) = (level_size(width, i), level_size(height, i));
        Level { width, height, data: encode(encoding, rgba8, width, height).unwrap() }
    });
    Texture { format: Format::Uastc, transfer, levels: levels.collect(), metadata: [].into() }
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

/// Decibels of the channels in `channels`.
fn psnr(wanted: &[u8], got: &[u8], channels: &[usize]) -> f64 {
    let pairs = wanted.chunks_exact(4).zip(got.chunks_exact(4));
    let squares =
        pairs.flat_map(|(w, g)| channels.iter().map(|&c| (f64::from(w[c]) - f64::from(g[c])).powi(2)));
    let mean = squares.sum::<f64>() / (wanted.len() / 4 * channels.len()) as f64;
    -10.0 * (mean / (255.0 * 255.0)).log10()
}

/// A level made from level 0, as an encoder would: the mean of the texels that it covers.
fn averaged(rgba8: &[u8], (width, height): (u32, u32), (w, h): (u32, u32)) -> Vec<u8> {
    let texel = |x: u32, y: u32, c: u32| f64::from(rgba8[(4 * (y * width + x) + c) as usize]);
    let span = |i: u32, to: u32, from: u32| i * from / to..(i + 1) * from / to;
    let mean = |x: u32, y: u32, c: u32| {
        let places = || span(y, h, height).flat_map(move |y| span(x, w, width).map(move |x| (x, y)));
        (places().map(|(x, y)| texel(x, y, c)).sum::<f64>() / places().count() as f64).round() as u8
    };
    (0..h).flat_map(|y| (0..w).flat_map(move |x| (0..4).map(move |c| mean(x, y, c)))).collect()
}

/// Every level is read from the file by the crate `basisu`, whose decoder is held byte for byte to Binomial's.
#[test]
fn levels_are_made_by_the_encoder_instead_of_taken_from_us() {
    // Floors of level 0 and of those below; measured 37.9 and 34.1, 43.4 and 25.3, and exact.
    let cases: [(&str, Painted, &[usize], [f64; 2]); 3] = [
        ("normals", normals, &[0, 1], [36.0, 33.0]),
        ("roughness", roughness, &[1], [42.0, 24.0]),
        ("leaves", leaves, &[3], [60.0, 60.0]),
    ];
    for (name, paint, channels, floors) in cases {
        for (width, height) in [(64, 64), (36, 20)] {
            let levels = painted(paint, width, height);
            let texture = texture(&levels, Transfer::Linear, width, height, Preset::Normal);
            let file = encode_ktx2(&texture, None).unwrap();
            let transcoder = Transcoder::new(&file).unwrap();
            assert_eq!(transcoder.source_format(), SourceFormat::UastcLdr, "{name}");
            assert_eq!(transcoder.base_dimensions(), (width, height), "{name}");
            assert_eq!(transcoder.level_count() as usize, levels.len(), "{name}: levels");
            assert_eq!(transcoder.has_alpha(), name == "leaves", "{name}: alpha");
            for (i, wanted) in levels.iter().enumerate() {
                let got = transcoder.transcode(i as u32, TargetFormat::Rgba32, DecodeFlags::NONE).unwrap();
                let db = psnr(wanted, &got, channels);
                // Ripples come closer to the size of texels level by level.
                let floor = floors[usize::from(i > 0)];
                assert!(db > floor, "{name} {width}x{height}, level {i}: {db:.1} dB, wanted {floor}");
                if i > 0 {
                    let size = (level_size(width, i), level_size(height, i));
                    let made = psnr(wanted, &averaged(&levels[0], (width, height), size), channels);
                    assert!(
                        db > made + 8.0,
                        "{name} {width}x{height}, level {i}: {db:.1} dB, made from level 0 {made:.1}"
                    );
                }
                let ours = texture.decode_level(i).unwrap();
                let ours: Vec<u8> = ours.as_flattened().iter().map(|x| (x * 255.0).round() as u8).collect();
                assert_eq!(ours, got, "{name} {width}x{height}, level {i}: our reading of it");
            }
        }
    }
}

/// KTX 2.0.4, sections 3.1 and 3.10.2; Khronos Data Format 1.4, section 5; `KHR_texture_basisu`, "KTX v2 Images with Basis
/// Universal Supercompression": no Vulkan format, colour model 166, primaries of BT.709 for sRGB and unspecified for linear,
/// channel RGB or RGBA.
#[test]
fn headers_say_what_khr_texture_basisu_does_not_allow() {
    for (paint, transfer, model, channel) in [
        (normals as Painted, Transfer::Linear, 166 | 1 << 16, 0),
        (leaves, Transfer::Srgb, 166 | 1 << 8 | 2 << 16, 3),
    ] {
        let texture = texture(&painted(paint, 32, 16), transfer, 32, 16, Preset::Fast);
        for zstd in [None, Some(3)] {
            let what = format!("{transfer:?} {zstd:?}");
            let file = encode_ktx2(&texture, zstd).unwrap();
            let header: Vec<u32> = (12..48).step_by(4).map(|at| u32_at(&file, at)).collect();
            let scheme = if zstd.is_some() { 2 } else { 0 };
            assert_eq!(header, [0, 1, 32, 16, 0, 0, 1, 6, scheme], "{what}: header");
            let dfd = u32_at(&file, 48) as usize;
            let got: Vec<u32> = (0..11).map(|i| u32_at(&file, dfd + 4 * i)).collect();
            let wanted =
                [44, 0, 2 | 40 << 16, model, 0x0303, 16, 0, 127 << 16 | channel << 24, 0, 0, u32::MAX];
            assert_eq!(got, wanted, "{what}: wanted {wanted:08x?} got {got:08x?}");
            for level in 0..6 {
                let unpacked = u32_at(&file, 80 + 24 * level + 16) as usize;
                assert_eq!(unpacked, texture.levels[level].data.len(), "{what}: level {level}");
                if zstd.is_none() {
                    assert_eq!(u32_at(&file, 80 + 24 * level) % 16, 0, "{what}: alignment of level {level}");
                }
            }
            let back = decode_texture(Path::new("t.ktx2"), &file).unwrap();
            assert_eq!(
                (back.format, back.transfer, &back.levels),
                (Format::Uastc, transfer, &texture.levels)
            );
        }
    }
}

#[test]
fn dds_holds_blocks_that_it_has_no_number_for() {
    let texture = texture(&painted(normals, 8, 8), Transfer::Linear, 8, 8, Preset::Fast);
    assert!(encode_dds(&texture).unwrap_err().to_string().contains("UASTC"));
}

/// `tests/data/basis/etc1s.ktx2` is by Binomial's basisu 1.16: `basisu -ktx2 -mipmap` of a ramp from red to blue, 32 × 16.
#[test]
fn basis_lz_of_other_writers_is_read_level_by_level() {
    let file =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/basis/etc1s.ktx2")).unwrap();
    let texture = decode_texture(Path::new("etc1s.ktx2"), &file).unwrap();
    assert_eq!((texture.format, texture.transfer, texture.levels.len()), (Format::Rgba8, Transfer::Srgb, 6));
    // A block of ETC1S has one colour, lighter and darker: the ends differ as far as they lie in two blocks.
    for (i, level) in texture.levels.iter().enumerate().take(3) {
        let texels = texture.decode_level(i).unwrap();
        let [first, .., last] = &texels[..level.width as usize] else {
            panic!("level {i} is one texel wide")
        };
        assert!(first[0] > first[2] + 0.3 && last[2] > last[0] + 0.3, "level {i}: {first:?} to {last:?}");
    }
    for (j, texel) in texture.decode_level(0).unwrap().iter().enumerate() {
        let u = (j % 32) as f32 / 31.0;
        let off = (texel[0] - (1.0 - u)).abs().max((texel[2] - u).abs());
        assert!(off < 0.2, "texel {j}: {texel:?}, wanted red {} and blue {u}", 1.0 - u);
    }
}

#[test]
fn damaged_files_of_basis_universal_panic_or_are_read() {
    let uastc = texture(&painted(leaves, 16, 8), Transfer::Srgb, 16, 8, Preset::Fast);
    let etc1s =
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/basis/etc1s.ktx2")).unwrap();
    for good in [encode_ktx2(&uastc, None).unwrap(), encode_ktx2(&uastc, Some(3)).unwrap(), etc1s] {
        for length in 0..good.len() {
            let cut = decode_texture(Path::new("t"), &good[..length]);
            assert!(cut.is_err(), "{length} of {} bytes are read", good.len());
        }
        for at in 12..good.len() {
            for value in [0, 0x7f, 0xff] {
                let mut bad = good.clone();
                bad[at] = value;
                if let Ok(read) = decode_texture(Path::new("t"), &bad) {
                    read.check().unwrap();
                    (0..read.levels.len()).for_each(|level| drop(read.decode_level(level).unwrap()));
                }
            }
        }
    }
}

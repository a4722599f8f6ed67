//! Block encoding: exactness of flat input, independence of cuts, agreement with the decoder.

use kinran_image::{Encoder, Encoding, Format, Preset, Role, decode, encode, encode_half, encode_parallel};
use proptest::prelude::*;

const PRESETS: [Preset; 3] = [Preset::Fast, Preset::Normal, Preset::Best];
const BLOCK_FORMATS: [Format; 5] = [Format::Bc1, Format::Bc4, Format::Bc5, Format::Bc7, Format::Uastc];

fn encoders() -> Vec<Encoder> {
    if cfg!(feature = "ispc") { vec![Encoder::Ispc, Encoder::Portable] } else { vec![Encoder::Portable] }
}

fn encoders_of(format: Format) -> Vec<Encoder> {
    match format {
        // It has one, whatever it is called.
        Format::Uastc if cfg!(feature = "uastc") => vec![Encoder::Portable],
        Format::Uastc => Vec::new(),
        _ => encoders(),
    }
}

fn all_encodings() -> Vec<Encoding> {
    let mut all = Vec::new();
    for format in BLOCK_FORMATS {
        for encoder in encoders_of(format) {
            all.extend(PRESETS.map(|preset| Encoding { format, encoder, preset }));
        }
    }
    all
}

/// Smooth waves with some grain, alpha varying too where `opaque` is false.
fn waves(width: u32, height: u32, opaque: bool) -> Vec<u8> {
    let mut seed = 0x9e37_79b9_u32;
    let mut texels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (u, v, grain) = (x as f32 / 9.0, y as f32 / 7.0, (seed >> 24) as f32 / 32.0);
            let wave = |w: f32| (127.0 + 100.0 * w.sin() + grain).clamp(0.0, 255.0) as u8;
            texels.extend([wave(u + v), wave(u - v), wave(u * 0.3), if opaque { 255 } else { wave(v) }]);
        }
    }
    texels
}

fn as_bytes(texels: &[[f32; 4]]) -> Vec<[u8; 4]> {
    texels.iter().map(|t| t.map(|s| (s * 255.0).round() as u8)).collect()
}

fn used_channels(format: Format) -> usize {
    match format {
        Format::Bc4 => 1,
        Format::Bc5 => 2,
        Format::Bc1 => 3,
        Format::Bc7 | Format::Uastc | Format::Rgba8 | Format::Rgba16F => 4,
    }
}

fn psnr(format: Format, wanted: &[u8], got: &[[f32; 4]]) -> f64 {
    let n = used_channels(format);
    let mut sum = 0.0;
    for (w, g) in wanted.chunks_exact(4).zip(got) {
        sum += (0..n).map(|c| (f64::from(w[c]) - 255.0 * f64::from(g[c])).powi(2)).sum::<f64>();
    }
    -10.0 * (sum / (got.len() * n) as f64 / (255.0 * 255.0)).log10()
}

/// Each of the 4096 blocks has its own random opaque colour, and 256 greys: all flat, none alike.
#[test]
fn flat_blocks_decode_to_exactly_their_colour() {
    let mut seed = 1_u64;
    let colours: Vec<[u8; 4]> = (0..4096_u32)
        .map(|i| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let [r, g, b, a, ..] = (seed >> 24).to_le_bytes();
            match i {
                0..256 => [i as u8; 4],
                256..2048 => [r, g, b, a],
                _ => [r, g, b, 255],
            }
        })
        .collect();
    let side = 256;
    let mut texels = Vec::new();
    for y in 0..side {
        for x in 0..side {
            texels.extend(colours[y / 4 * 64 + x / 4]);
        }
    }
    for encoding in all_encodings().into_iter().filter(|e| e.format != Format::Bc1) {
        let data = encode(encoding, &texels, side as u32, side as u32).unwrap();
        let decoded = as_bytes(&decode(encoding.format, &data, side as u32, side as u32).unwrap());
        let n = used_channels(encoding.format);
        for (i, (got, wanted)) in decoded.iter().zip(texels.chunks_exact(4)).enumerate() {
            assert_eq!(got[..n], wanted[..n], "{encoding:?} texel {i}, wanted {wanted:?} got {got:?}");
        }
    }
}

#[test]
fn a_flat_channel_stays_exact_in_bc5_beside_one_that_varies() {
    let mut texels = waves(64, 64, true);
    texels.chunks_exact_mut(4).for_each(|t| t[0] = 128);
    for encoder in encoders() {
        let encoding = Encoding { format: Format::Bc5, encoder, preset: Preset::Fast };
        let data = encode(encoding, &texels, 64, 64).unwrap();
        let decoded = as_bytes(&decode(Format::Bc5, &data, 64, 64).unwrap());
        assert!(decoded.iter().all(|t| t[0] == 128), "{encoder:?}");
    }
}

#[test]
fn cutting_the_image_anywhere_gives_the_same_bytes() {
    let (width, height) = (52, 90);
    // Opaque above, transparent below, so that the choice of BC7 modes changes inside.
    let mut texels = waves(width, height, false);
    texels[..(width * 40 * 4) as usize].chunks_exact_mut(4).for_each(|t| t[3] = 255);
    let row = width as usize * 4;
    for encoding in all_encodings() {
        let whole = encode(encoding, &texels, width, height).unwrap();
        for strip_height in [4, 12, 28, 64] {
            let mut parts = Vec::new();
            for strip in texels.chunks(row * strip_height) {
                let rows = (strip.len() / row) as u32;
                parts.extend(encode(encoding, strip, width, rows).unwrap());
            }
            assert!(parts == whole, "{encoding:?} in strips of {strip_height} rows");
        }
    }
}

#[test]
fn one_thread_and_many_give_the_same_bytes() {
    let (width, height) = (150, 203);
    let texels = waves(width, height, false);
    for encoding in all_encodings().into_iter().filter(|e| e.preset != Preset::Best) {
        let one = encode(encoding, &texels, width, height).unwrap();
        for threads in [1, 2, 5] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let many = pool.install(|| encode_parallel(encoding, &texels, width, height)).unwrap();
            assert!(many == one, "{encoding:?} on {threads} threads");
        }
    }
}

/// An encoder that reads rows or channels wrongly, or a decoder that does, falls far below this.
#[test]
fn decoded_texels_are_close_to_the_encoded_ones_at_any_size() {
    for (width, height) in [(64, 64), (61, 35), (5, 3), (1, 1), (2, 9), (4, 1)] {
        for opaque in [true, false] {
            let texels = waves(width, height, opaque);
            for encoding in all_encodings() {
                let data = encode(encoding, &texels, width, height).unwrap();
                let decoded = decode(encoding.format, &data, width, height).unwrap();
                assert_eq!(decoded.len(), (width * height) as usize);
                // Five-bit end points and two-bit indices against three smooth unrelated channels.
                let floor = if encoding.format == Format::Bc1 { 23.0 } else { 28.0 };
                let db = psnr(encoding.format, &texels, &decoded);
                assert!(db > floor, "{encoding:?} {width}x{height} opaque {opaque}: {db:.2} dB");
            }
        }
    }
}

/// Cloth as in benches/block.rs: hard edges, grain and flat parts.
fn cloth(side: u32) -> Vec<u8> {
    let mut seed = 7_u32;
    let mut texels = Vec::new();
    for y in 0..side {
        for x in 0..side {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let grain = (seed >> 24) as f32 / 255.0 * 12.0;
            let thread = (x / 6 + y / 6) % 4 < 2;
            let base = if thread { [140.0, 50.0, 40.0] } else { [50.0, 80.0, 128.0] };
            let stain = 0.8 + 0.2 * (x as f32 * 0.07).sin() * (y as f32 * 0.05).cos();
            texels.extend(base.map(|c| (c * stain + grain) as u8));
            texels.push(255);
        }
    }
    texels
}

/// Mode 6 shares the lowest bit of an end point among colour and alpha, so that even colours take 254 for opaque.
#[test]
fn opaque_texels_of_bc7_lose_alpha() {
    let side = 128;
    let with_alpha = |alpha: &dyn Fn(usize, usize) -> u8| {
        let mut texels = cloth(side);
        for (i, texel) in texels.chunks_exact_mut(4).enumerate() {
            texel[3] = alpha(i % side as usize, i / side as usize);
        }
        texels
    };
    // Whole blocks with alpha among opaque ones, and the ragged edges of a mask.
    let waves_of_alpha = waves(side, side, false);
    let mixed = with_alpha(&|x, y| match (x / 8 + y / 12) % 3 {
        0 => waves_of_alpha[(y * side as usize + x) * 4 + 3],
        _ => 255,
    });
    let mask =
        with_alpha(&|x, y| if (x as f32 / 7.0).sin() * (y as f32 / 9.0).cos() > 0.0 { 255 } else { 0 });
    // Soft edges: what is opaque stands beside what is nearly so.
    let soft = with_alpha(&|x, y| {
        let wave = 0.65 + 0.65 * ((x as f32 - 1.7 * y as f32) / 13.0).cos();
        (255.0 * wave.min(1.0)).round() as u8
    });
    let waves = waves(side, side, true);
    for (name, texels) in
        [("waves", waves), ("cloth", cloth(side)), ("mixed", mixed), ("mask", mask), ("soft", soft)]
    {
        for encoding in all_encodings().into_iter().filter(|e| e.format == Format::Bc7) {
            let data = encode(encoding, &texels, side, side).unwrap();
            let decoded = decode(Format::Bc7, &data, side, side).unwrap();
            let lost: Vec<usize> =
                (0..decoded.len()).filter(|&i| texels[i * 4 + 3] == 255 && decoded[i][3] != 1.0).collect();
            assert_eq!(lost, [0; 0], "{name}, {encoding:?}: texels whose alpha is not 255");
            // Each preset of each encoder has more of the waves, whose blocks are the hardest.
            let db = psnr(Format::Bc7, &texels, &decoded);
            assert!(db > 32.0, "{name}, {encoding:?}: {db:.2} dB");
        }
    }
}

/// The encoders' own blocks, whose alpha was 254 in up to half of the texels, had these numbers of dB over red, green and
/// blue, on waves and on cloth.
#[test]
fn opaque_blocks_of_bc7_pay_with_their_colour() {
    for encoder in encoders() {
        for (preset, own) in PRESETS.into_iter().zip(match encoder {
            Encoder::Ispc => [[32.12, 42.07], [37.61, 49.34], [38.65, 49.36]],
            Encoder::Portable => [[38.44, 43.82], [38.60, 48.74], [38.97, 49.76]],
        }) {
            for (texels, own) in [waves(128, 128, true), cloth(128)].iter().zip(own) {
                let encoding = Encoding { format: Format::Bc7, encoder, preset };
                let data = encode(encoding, texels, 128, 128).unwrap();
                let decoded = decode(Format::Bc7, &data, 128, 128).unwrap();
                let mut sum = 0.0;
                for (w, g) in texels.chunks_exact(4).zip(&decoded) {
                    sum += (0..3).map(|c| (f64::from(w[c]) - 255.0 * f64::from(g[c])).powi(2)).sum::<f64>();
                }
                let db = -10.0 * (sum / (128.0 * 128.0 * 3.0) / (255.0 * 255.0)).log10();
                assert!(db > own - 0.2, "{encoding:?}: {db:.2} dB, the encoder's own blocks have {own}");
            }
        }
    }
}

#[test]
fn better_presets_are_not_worse() {
    let texels = waves(128, 128, true);
    for format in BLOCK_FORMATS {
        for encoder in encoders_of(format) {
            let db = PRESETS.map(|preset| {
                let data = encode(Encoding { format, encoder, preset }, &texels, 128, 128).unwrap();
                psnr(format, &texels, &decode(format, &data, 128, 128).unwrap())
            });
            assert!(db[0] <= db[1] + 0.01 && db[1] <= db[2] + 0.01, "{format:?} {encoder:?}: {db:?} dB");
        }
    }
}

/// Readers are told BC1 has alpha; the transparent index would show as holes.
#[test]
fn bc1_has_no_holes_even_where_alpha_is_zero() {
    let mut texels = waves(64, 64, false);
    texels[..64 * 32 * 4].chunks_exact_mut(4).for_each(|t| t.copy_from_slice(&[3, 2, 1, 0]));
    for encoding in all_encodings().into_iter().filter(|e| e.format == Format::Bc1) {
        let data = encode(encoding, &texels, 64, 64).unwrap();
        let decoded = decode(Format::Bc1, &data, 64, 64).unwrap();
        assert!(decoded.iter().all(|t| t[3] == 1.0), "{encoding:?}");
    }
}

#[test]
fn the_default_of_every_role_can_be_encoded() {
    for role in [Role::Color, Role::Normal, Role::Aniso, Role::Data] {
        encode(role.encoding(), &waves(8, 8, true), 8, 8).unwrap();
    }
}

#[test]
fn plain_formats_come_back_exactly() {
    let texels = waves(7, 5, false);
    let encoding = Encoding { format: Format::Rgba8, encoder: Encoder::Portable, preset: Preset::Fast };
    let data = encode(encoding, &texels, 7, 5).unwrap();
    assert_eq!(as_bytes(&decode(Format::Rgba8, &data, 7, 5).unwrap()).as_flattened(), texels);

    let floats = [[0.0, 1.0, -2.5, 65504.0], [6.103_515_6e-5, 0.333_251_95, -0.0, 1024.0]];
    let data = encode_half(&floats).unwrap();
    assert_eq!(decode(Format::Rgba16F, &data, 2, 1).unwrap(), floats);
}

#[test]
fn numbers_beyond_half_floats_are_refused_by_texel() {
    for bad in [65520.0, f32::NAN, f32::INFINITY, -1e9] {
        let error = encode_half(&[[0.0; 4], [0.0, 0.0, bad, 1.0]]).unwrap_err().to_string();
        assert!(error.starts_with(&format!("texel 1 is {bad} in channel 2")), "{error}");
    }
}

#[test]
fn wrong_sizes_are_refused() {
    let encoding = Role::Color.encoding();
    for (length, width, height) in [(15, 2, 2), (0, 0, 0), (16, 2, 0), (16, u32::MAX, u32::MAX), (17, 2, 2)] {
        assert!(encode(encoding, &vec![0; length], width, height).is_err(), "{length} for {width}x{height}");
        assert!(
            decode(Format::Bc7, &vec![0; length], width, height).is_err(),
            "{length} for {width}x{height}"
        );
    }
    let half = Encoding { format: Format::Rgba16F, ..encoding };
    assert!(encode(half, &[0; 16], 2, 2).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_block_of_bytes_is_beyond_the_decoder(data: [u8; 16]) {
        for format in BLOCK_FORMATS {
            let texels = decode(format, &data[..format.block_bytes()], 4, 4);
            // Some blocks are none of UASTC, which its decoder tells.
            prop_assert!(texels.is_ok() || format == Format::Uastc, "{:?}: {:?}", format, texels);
            for t in texels.into_iter().flatten() {
                prop_assert!(t.iter().all(|s| (0.0..=1.0).contains(s)), "{:?}: {:?}", format, t);
            }
        }
    }
}

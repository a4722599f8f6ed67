//! KTX2 and DDS: round trips, the bytes the specifications demand, damaged and hostile files.

use std::collections::BTreeMap;
use std::path::Path;

use kinran_image::{
    Channels, Error, Format, Level, MAX_SIDE, Texture, Transfer, decode_texture, encode_dds, encode_ktx2,
    full_level_count, image_size, level_size, read_image, read_texture, write_texture,
};
use proptest::prelude::*;

const FORMATS: [Format; 6] =
    [Format::Bc1, Format::Bc4, Format::Bc5, Format::Bc7, Format::Rgba8, Format::Rgba16F];

/// A full mip chain of arbitrary bytes.
fn texture(format: Format, transfer: Transfer, width: u32, height: u32) -> Texture {
    let mut seed = width * 31 + height;
    let levels = (0..full_level_count(width, height)).map(|i| {
        let (width, height) = (level_size(width, i), level_size(height, i));
        let data = (0..format.level_bytes(width, height)).map(|_| {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 24) as u8
        });
        Level { width, height, data: data.collect() }
    });
    let metadata = [("KinranFilter", "ml"), ("Ünïcode key", "välue"), ("A", "")];
    Texture {
        format,
        transfer,
        levels: levels.collect(),
        metadata: metadata.map(|(k, v)| (k.to_string(), v.to_string())).into(),
    }
}

fn textures() -> Vec<Texture> {
    let mut all = Vec::new();
    for (width, height) in [(16, 16), (13, 7), (1, 1), (5, 64)] {
        for format in FORMATS {
            all.push(texture(format, Transfer::Linear, width, height));
            if format.has_srgb() {
                all.push(texture(format, Transfer::Srgb, width, height));
            }
        }
    }
    all
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

#[test]
fn ktx2_comes_back_exactly_with_its_metadata() {
    for t in textures() {
        for zstd in [None, Some(1), Some(19)] {
            let bytes = encode_ktx2(&t, zstd).unwrap();
            assert!(bytes == encode_ktx2(&t, zstd).unwrap(), "the same texture, other bytes");
            let mut back = decode_texture(Path::new("t.ktx2"), &bytes).unwrap();
            assert_eq!(back.metadata.remove("KTXorientation").as_deref(), Some("rd"));
            assert!(back.metadata.remove("KTXwriter").unwrap().starts_with("Kinran "));
            assert_eq!(back, t, "zstd {zstd:?}");
        }
    }
}

#[test]
fn dds_comes_back_exactly_without_metadata() {
    for mut t in textures() {
        let bytes = encode_dds(&t).unwrap();
        t.metadata.clear();
        assert_eq!(decode_texture(Path::new("t.dds"), &bytes).unwrap(), t);
    }
}

/// KTX 2.0.4, sections 3 (file structure), 3.8 (padding) and 3.11 (metadata).
#[test]
fn ktx2_sections_lie_where_the_specification_wants_them() {
    for t in textures() {
        for zstd in [None, Some(3)] {
            let bytes = encode_ktx2(&t, zstd).unwrap();
            let what = format!("{:?} {:?} zstd {zstd:?}", t.format, t.transfer);
            let n = t.levels.len();
            assert_eq!(u32_at(&bytes, 40), n as u32, "{what}: level count");
            assert_eq!(u32_at(&bytes, 44), if zstd.is_some() { 2 } else { 0 }, "{what}: scheme");
            assert_eq!(u32_at(&bytes, 28), 0, "{what}: depth of a 2D texture");
            assert_eq!(u32_at(&bytes, 32), 0, "{what}: layers of what is no array");
            assert_eq!(u32_at(&bytes, 36), 1, "{what}: faces");
            let (dfd, dfd_length) = (u32_at(&bytes, 48) as usize, u32_at(&bytes, 52) as usize);
            let (kvd, kvd_length) = (u32_at(&bytes, 56) as usize, u32_at(&bytes, 60) as usize);
            assert_eq!(dfd, 80 + 24 * n, "{what}: the descriptor follows the level index");
            assert_eq!(u32_at(&bytes, dfd) as usize, dfd_length, "{what}: its length, twice");
            assert_eq!(kvd, dfd + dfd_length, "{what}: key/values follow");
            assert_eq!(kvd % 4, 0, "{what}: key/values are aligned");

            // Smallest level first, each aligned and with zeros only between.
            let mut end = kvd + kvd_length;
            for i in (0..n).rev() {
                let entry = 80 + 24 * i;
                let (offset, length) = (u64_at(&bytes, entry) as usize, u64_at(&bytes, entry + 8) as usize);
                let alignment = if zstd.is_some() { 1 } else { t.format.block_bytes().max(4) };
                assert_eq!(offset % alignment, 0, "{what}: alignment of level {i}");
                assert!(
                    offset >= end && offset - end < alignment,
                    "{what}: level {i} at {offset}, {end} free"
                );
                assert!(bytes[end..offset].iter().all(|&b| b == 0), "{what}: padding before level {i}");
                assert_eq!(u64_at(&bytes, entry + 16) as usize, t.levels[i].data.len(), "{what}: level {i}");
                end = offset + length;
            }
            assert_eq!(end, bytes.len(), "{what}: nothing after level 0");

            // Keys sorted by code point, NULs at both ends, padding of zeros.
            let (mut at, mut last) = (kvd, String::new());
            while at < kvd + kvd_length {
                let length = u32_at(&bytes, at) as usize;
                let entry = &bytes[at + 4..at + 4 + length];
                assert_eq!(entry.iter().filter(|&&b| b == 0).count(), 2, "{what}: {entry:?}");
                assert_eq!(entry.last(), Some(&0), "{what}: {entry:?}");
                let key = String::from_utf8(entry.split(|&b| b == 0).next().unwrap().to_vec()).unwrap();
                assert!(key > last, "{what}: {key} after {last}");
                last = key;
                at += 4 + length.next_multiple_of(4);
            }
            assert_eq!(at, kvd + kvd_length, "{what}: end of key/values");
        }
    }
}

/// Khronos Data Format 1.4, section 5, written out by hand; the numbers of a descriptor's words.
#[test]
fn ktx2_descriptors_are_those_of_the_data_format_specification() {
    let (linear, srgb) = (1, 2);
    // Only colour has primaries, those of BT.709.
    let block = |model: u32, transfer: u32| model | u32::from(transfer == srgb) << 8 | transfer << 16;
    let (four_by_four, single) = (0x0303, 0);
    // VkFormat, type size, model word, texel block, bytes of a block, samples as (word 0, lower, upper).
    let bc = |channel: u32, offset: u32, bits: u32| (channel << 24 | (bits - 1) << 16 | offset, 0, u32::MAX);
    let rgba8 = |alpha_linear: u32| {
        [(0, 0), (1, 0), (2, 0), (15, alpha_linear)]
            .iter()
            .enumerate()
            .map(|(i, &(channel, qualifier))| {
                ((qualifier << 4 | channel) << 24 | 7 << 16 | (8 * i as u32), 0, 255)
            })
            .collect::<Vec<_>>()
    };
    let half = [0, 1, 2, 15].iter().enumerate().map(|(i, &channel): (usize, &u32)| {
        // Float and signed; bounds are -1 and 1 as floats.
        ((0b1100 << 4 | channel) << 24 | 15 << 16 | (16 * i as u32), 0xbf80_0000, 0x3f80_0000)
    });
    let cases = [
        (Format::Bc1, Transfer::Linear, 133, 1, block(128, linear), four_by_four, 8, vec![bc(1, 0, 64)]),
        (Format::Bc1, Transfer::Srgb, 134, 1, block(128, srgb), four_by_four, 8, vec![bc(1, 0, 64)]),
        (Format::Bc4, Transfer::Linear, 139, 1, block(131, linear), four_by_four, 8, vec![bc(0, 0, 64)]),
        (
            Format::Bc5,
            Transfer::Linear,
            141,
            1,
            block(132, linear),
            four_by_four,
            16,
            vec![bc(0, 0, 64), bc(1, 64, 64)],
        ),
        (Format::Bc7, Transfer::Linear, 145, 1, block(134, linear), four_by_four, 16, vec![bc(0, 0, 128)]),
        (Format::Bc7, Transfer::Srgb, 146, 1, block(134, srgb), four_by_four, 16, vec![bc(0, 0, 128)]),
        (Format::Rgba8, Transfer::Linear, 37, 1, block(1, linear), single, 4, rgba8(0)),
        (Format::Rgba8, Transfer::Srgb, 43, 1, block(1, srgb), single, 4, rgba8(1)),
        (Format::Rgba16F, Transfer::Linear, 97, 2, block(1, linear), single, 8, half.collect()),
    ];
    for (format, transfer, vk, type_size, model, texels, bytes_plane, samples) in cases {
        let what = format!("{format:?} {transfer:?}");
        let file = encode_ktx2(&texture(format, transfer, 4, 4), None).unwrap();
        assert_eq!(u32_at(&file, 12), vk, "{what}: VkFormat");
        assert_eq!(u32_at(&file, 16), type_size, "{what}: type size");
        let dfd = u32_at(&file, 48) as usize + 4;
        let length = 24 + 16 * samples.len() as u32;
        let mut wanted = vec![0, 2 | length << 16, model, texels, bytes_plane, 0];
        for (word, lower, upper) in samples {
            wanted.extend([word, 0, lower, upper]);
        }
        let got: Vec<u32> = (0..wanted.len()).map(|i| u32_at(&file, dfd + 4 * i)).collect();
        assert_eq!(got, wanted, "{what}: wanted {wanted:08x?} got {got:08x?}");
    }
}

#[test]
fn the_extension_chooses_the_container_and_the_content_the_reader() {
    let folder = tempfile::tempdir().unwrap();
    let t = texture(Format::Bc7, Transfer::Srgb, 12, 12);
    for (name, magic) in [("a.ktx2", 0xab), ("b.KTX2", 0xab), ("c.dds", b'D'), ("d.DDS", b'D')] {
        let path = folder.path().join(name);
        write_texture(&path, &t, Some(3)).unwrap();
        assert_eq!(std::fs::read(&path).unwrap()[0], magic, "{name}");
        assert_eq!(read_texture(&path).unwrap().levels, t.levels, "{name}");
    }
    for name in ["e.png", "f"] {
        let error = write_texture(&folder.path().join(name), &t, None).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(".ktx2 or .dds"), "{error}");
    }
    let missing = folder.path().join("missing.dds");
    assert!(matches!(read_texture(&missing), Err(Error::Io { .. })));
}

#[test]
fn textures_that_no_gpu_could_hold_are_refused() {
    let good = texture(Format::Bc7, Transfer::Linear, 16, 8);
    type Damage = fn(&mut Texture);
    let breaks: [(&str, Damage); 8] = [
        ("no levels", |t| t.levels.clear()),
        ("at most 5 levels", |t| t.levels.push(t.levels[4].clone())),
        ("level 1 must be 8x4", |t| t.levels[1].width = 9),
        ("level 2, 4x2", |t| t.levels[2].data.push(0)),
        ("no texels", |t| t.levels[0].height = 0),
        ("too large", |t| t.levels[0].width = MAX_SIDE + 1),
        ("no sRGB form", |t| (t.format, t.transfer) = (Format::Bc5, Transfer::Srgb)),
        ("level 0, 16x8 in Rgba8", |t| t.format = Format::Rgba8),
    ];
    for (reason, make_bad) in breaks {
        let mut bad = good.clone();
        make_bad(&mut bad);
        for result in [bad.check(), encode_ktx2(&bad, None).map(drop), encode_dds(&bad).map(drop)] {
            let error = result.unwrap_err().to_string();
            assert!(error.contains(reason), "wanted {reason:?}, got {error:?}");
        }
    }
    let mut nul = good.clone();
    nul.metadata = BTreeMap::from([("a\0b".to_string(), String::new())]);
    assert!(encode_ktx2(&nul, None).is_err());
    assert!(encode_ktx2(&good, Some(99)).is_err());
    assert!(good.decode_level(5).is_err());
}

fn valid_files() -> Vec<Vec<u8>> {
    let mut files = Vec::new();
    for t in textures().into_iter().filter(|t| t.levels[0].width < 16) {
        files.extend([encode_ktx2(&t, None), encode_ktx2(&t, Some(3)), encode_dds(&t)].map(Result::unwrap));
    }
    files
}

#[test]
fn truncated_files_are_errors() {
    for file in valid_files() {
        let step = (file.len() / 1500).max(1);
        for length in (0..file.len()).step_by(step).chain(file.len().saturating_sub(64)..file.len()) {
            let result = decode_texture(Path::new("t"), &file[..length]);
            assert!(result.is_err(), "{length} of {} bytes are read", file.len());
        }
    }
}

#[test]
fn hostile_counts_sizes_and_offsets_are_errors() {
    let t = texture(Format::Bc7, Transfer::Linear, 16, 16);
    for zstd in [None, Some(3)] {
        let good = encode_ktx2(&t, zstd).unwrap();
        // Header words: width, height, depth, layers, faces, levels, scheme; key/values' offset and length.
        for at in (20..48).step_by(4).chain([56, 60]) {
            for value in [77, 0x7fff_ffff, u32::MAX] {
                let mut bad = good.clone();
                bad[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
                let back = decode_texture(Path::new("t"), &bad);
                // Key/values may lie anywhere in the file.
                let harmless = value == 77 && at >= 56;
                assert!(harmless || back.is_err(), "KTX2 word at {at} = {value:#x} is accepted");
            }
        }
        for at in (80..80 + 24 * t.levels.len()).step_by(8) {
            for value in [7, u64::MAX / 2, u64::MAX] {
                let mut bad = good.clone();
                bad[at..at + 8].copy_from_slice(&u64::to_le_bytes(value));
                let back = decode_texture(Path::new("t"), &bad);
                // A level may lie anywhere in the file, even on another section.
                let harmless = value == 7 && (at - 80) % 24 == 0 && zstd.is_none();
                assert!(harmless || back.is_err(), "KTX2 level index at {at} = {value:#x} is accepted");
            }
        }
    }
    // DDS words: height, width, mip levels; DX10: format, dimension, flags, array size.
    let good = encode_dds(&t).unwrap();
    for at in [12, 16, 28, 128, 132, 140] {
        for value in [77, u32::MAX] {
            let mut bad = good.clone();
            bad[at..at + 4].copy_from_slice(&u32::to_le_bytes(value));
            assert!(
                decode_texture(Path::new("t"), &bad).is_err(),
                "DDS word at {at} = {value:#x} is accepted"
            );
        }
    }
}

/// A level that unpacks to a gigabyte where 16 bytes are wanted.
#[test]
fn a_zstandard_bomb_is_an_error_and_costs_no_memory() {
    let t = texture(Format::Bc7, Transfer::Linear, 1, 1);
    let mut file = encode_ktx2(&t, Some(3)).unwrap();
    let bomb = zstd::bulk::compress(&vec![0; 1 << 30], 1).unwrap();
    let start = file.len();
    file.extend(&bomb);
    file[80..88].copy_from_slice(&(start as u64).to_le_bytes());
    file[88..96].copy_from_slice(&(bomb.len() as u64).to_le_bytes());
    let error = decode_texture(Path::new("bomb.ktx2"), &file).unwrap_err().to_string();
    assert!(error.contains("bomb.ktx2") && error.contains("must hold 16 bytes"), "{error}");
}

#[test]
fn upside_down_and_unknown_textures_are_refused_with_the_reason() {
    let t = texture(Format::Bc7, Transfer::Linear, 4, 4);
    let good = encode_ktx2(&t, None).unwrap();
    let rd = good.windows(3).position(|w| w == b"rd\0").unwrap();
    let mut upside_down = good.clone();
    upside_down[rd + 1] = b'u';
    let mut bc6h = good.clone();
    bc6h[12] = 143;
    let mut universal = good;
    universal[12] = 0;
    for (file, word) in [
        (upside_down, "orientation"),
        (bc6h, "BC6H"),
        (universal, "Basis"),
        (b"hello".to_vec(), "neither KTX2 nor DDS"),
        (vec![], "empty"),
    ] {
        let error = decode_texture(Path::new("x.ktx2"), &file).unwrap_err().to_string();
        assert!(error.contains("x.ktx2") && error.contains(word), "{error}");
    }
}

/// A DDS header from before DirectX 10: `pixels` are flags, FourCC, bits and the four masks.
fn old_dds(pixels: (u32, &[u8; 4], u32, [u32; 4]), width: u32, height: u32, levels: u32) -> Vec<u8> {
    let (flags, code, bits, masks) = pixels;
    let mut words = vec![124, 0x1007 | 0x2_0000, height, width, 0, 0, levels];
    words.extend([0; 11]);
    words.extend([32, flags, u32::from_le_bytes(*code), bits]);
    words.extend(masks);
    words.extend([0x1000, 0, 0, 0, 0]);
    assert_eq!(words.len() * 4, 124);
    let mut bytes = b"DDS ".to_vec();
    bytes.extend(words.into_iter().flat_map(u32::to_le_bytes));
    bytes
}

/// A BC4 block of one value.
fn bc4(value: u8) -> Vec<u8> {
    vec![value, value, 0, 0, 0, 0, 0, 0]
}

#[test]
fn dds_files_of_old_writers_are_read() {
    let (red, green) = (200.0 / 255.0, 60.0 / 255.0);
    let two = [bc4(200), bc4(60)].concat();
    // 565: 0x8410 is 16, 32, 16.
    let one = [0x10, 0x84, 0x10, 0x84, 0, 0, 0, 0].to_vec();
    let grey = [132.0 / 255.0, 130.0 / 255.0, 132.0 / 255.0, 1.0];
    let four = |code| (4, code, 0, [0; 4]);
    let bgra = [0xff_0000, 0xff00, 0xff, 0xff00_0000];
    let rgba = [0xff, 0xff00, 0xff_0000, 0xff00_0000];
    let masked = |flags, masks| (flags, b"\0\0\0\0", 32, masks);
    let plain = |flags, bits, masks| (flags, b"\0\0\0\0", bits, masks);
    let [bgr, l, la] = [[0xff_0000, 0xff00, 0xff, 0], [0xff, 0, 0, 0], [0xff, 0, 0, 0xff00]];
    let texel = vec![51, 102, 153, 204];
    for (name, pixels, block, format, transfer, wanted) in [
        ("ATI2", four(b"ATI2"), &two, Format::Bc5, Transfer::Linear, [red, green, 0.0, 1.0]),
        ("BC5U", four(b"BC5U"), &two, Format::Bc5, Transfer::Linear, [red, green, 0.0, 1.0]),
        ("ATI1", four(b"ATI1"), &bc4(200), Format::Bc4, Transfer::Linear, [red, 0.0, 0.0, 1.0]),
        ("BC4U", four(b"BC4U"), &bc4(200), Format::Bc4, Transfer::Linear, [red, 0.0, 0.0, 1.0]),
        ("DXT1", four(b"DXT1"), &one, Format::Bc1, Transfer::Unsaid, grey),
        ("BGRA", masked(0x41, bgra), &texel, Format::Rgba8, Transfer::Unsaid, [0.6, 0.4, 0.2, 0.8]),
        ("BGRX", masked(0x40, bgra), &texel, Format::Rgba8, Transfer::Unsaid, [0.6, 0.4, 0.2, 1.0]),
        ("RGBA", masked(0x41, rgba), &texel, Format::Rgba8, Transfer::Unsaid, [0.2, 0.4, 0.6, 0.8]),
        (
            "BGR",
            plain(0x40, 24, bgr),
            &texel[..3].to_vec(),
            Format::Rgba8,
            Transfer::Unsaid,
            [0.6, 0.4, 0.2, 1.0],
        ),
        ("L", plain(0x2_0000, 8, l), &vec![51], Format::Rgba8, Transfer::Unsaid, [0.2, 0.2, 0.2, 1.0]),
        (
            "LA",
            plain(0x2_0001, 16, la),
            &vec![51, 204],
            Format::Rgba8,
            Transfer::Unsaid,
            [0.2, 0.2, 0.2, 0.8],
        ),
    ] {
        let (width, height) = (8, 4);
        let mut bytes = old_dds(pixels, width, height, 2);
        // Blocks, or texels of as many bytes.
        let texels = |w: u32, h: u32| (w * h) as usize;
        let blocks = |w, h| {
            if format == Format::Rgba8 { texels(w, h) } else { format.level_bytes(w, h) / block.len() }
        };
        let count: usize = blocks(8, 4) + blocks(4, 2);
        bytes.extend(block.repeat(count));
        let texture = decode_texture(Path::new(name), &bytes).unwrap();
        assert_eq!((texture.format, texture.transfer, texture.levels.len()), (format, transfer, 2), "{name}");
        for (got, wanted) in texture.decode_level(1).unwrap()[5].iter().zip(wanted) {
            assert!((got - wanted).abs() < 1e-6, "{name}: wanted {wanted:?}, got {got}");
        }
        // Nobody said what it is, so it is not written as one or the other.
        assert_eq!(encode_dds(&texture).is_err(), transfer == Transfer::Unsaid, "{name}");
        assert_eq!(encode_ktx2(&texture, None).is_err(), transfer == Transfer::Unsaid, "{name}");
        assert_eq!(
            texture.transfer.of_content(true) == Transfer::Srgb,
            transfer == Transfer::Unsaid,
            "{name}"
        );
        assert_eq!(texture.transfer.of_content(false), Transfer::Linear, "{name}");
        assert!(decode_texture(Path::new(name), &bytes[..bytes.len() - 1]).is_err(), "{name}, truncated");
    }
    for (pixels, word) in [
        (four(b"DXT5"), "\"DXT5\""),
        (four(&[116, 0, 0, 0]), "116"),
        (plain(0x41, 24, [0xff_0000, 0xff00, 0xff, 0xff00_0000]), "24 bits"),
        (plain(0x40, 16, [0xf800, 0x7e0, 0x1f, 0]), "16 bits"),
        (masked(0x40, [0x3ff, 0xf_fc00, 0x3ff0_0000, 0]), "32 bits"),
    ] {
        let error = decode_texture(Path::new("x.dds"), &old_dds(pixels, 4, 4, 1)).unwrap_err().to_string();
        assert!(error.contains("x.dds") && error.contains(word) && error.contains("convert"), "{error}");
    }
}

#[test]
fn typeless_dds_files_leave_colour_to_the_role() {
    for (format, code, wanted) in [
        (Format::Bc1, 70, Transfer::Unsaid),
        (Format::Bc4, 79, Transfer::Linear),
        (Format::Bc5, 82, Transfer::Linear),
        (Format::Bc7, 97, Transfer::Unsaid),
        (Format::Rgba8, 27, Transfer::Unsaid),
    ] {
        let before = texture(format, Transfer::Linear, 8, 8);
        let mut bytes = encode_dds(&before).unwrap();
        bytes[128..132].copy_from_slice(&u32::to_le_bytes(code));
        let read = decode_texture(Path::new("x.dds"), &bytes).unwrap();
        assert_eq!((read.transfer, read.levels), (wanted, before.levels), "{format:?}");
    }
}

/// The data format descriptor's first word after its head: model, primaries, transfer, flags (Khronos Data Format 1.4,
/// section 5).
#[test]
fn linear_ktx2_has_no_primaries_and_colour_has_those_of_rec_709() {
    for format in FORMATS {
        for transfer in [Transfer::Linear, Transfer::Srgb] {
            if transfer == Transfer::Srgb && !format.has_srgb() {
                continue;
            }
            let file = encode_ktx2(&texture(format, transfer, 8, 8), None).unwrap();
            let descriptor = u32::from_le_bytes(file[48..52].try_into().unwrap()) as usize;
            let (primaries, curve) = (file[descriptor + 13], file[descriptor + 14]);
            let wanted = if transfer == Transfer::Srgb { (1, 2) } else { (0, 1) };
            assert_eq!((primaries, curve), wanted, "{format:?} {transfer:?}");
        }
    }
}

#[test]
fn textures_are_read_as_images_by_their_largest_level() {
    let folder = tempfile::tempdir().unwrap();
    for (format, channels) in [
        (Format::Bc1, Channels::Rgba),
        (Format::Bc4, Channels::R),
        (Format::Bc5, Channels::Rgb),
        (Format::Bc7, Channels::Rgba),
        (Format::Rgba8, Channels::Rgba),
    ] {
        let transfer = if format.has_srgb() { Transfer::Srgb } else { Transfer::Linear };
        let texture = texture(format, transfer, 13, 7);
        for name in ["x.ktx2", "x.dds"] {
            let path = folder.path().join(name);
            write_texture(&path, &texture, None).unwrap();
            assert_eq!(image_size(&path), Some((13, 7)), "{format:?} {name}");
            let image = read_image(&path).unwrap();
            assert_eq!((image.width, image.height), (13, 7), "{format:?} {name}");
            assert_eq!((image.channels, image.transfer), (channels, transfer), "{format:?} {name}");
            let texels = texture.decode_level(0).unwrap();
            for (i, wanted) in texels.into_iter().enumerate() {
                let got = image.texel(i as u32 % 13, i as u32 / 13);
                let wanted = match format {
                    Format::Bc4 => [wanted[0], wanted[0], wanted[0], 1.0],
                    Format::Bc5 => {
                        let n = [got[0], got[1], got[2]].map(|c| 2.0 * c - 1.0);
                        let length = n.iter().map(|c| c * c).sum::<f32>();
                        assert!(n[2] == 0.0 || (length - 1.0).abs() < 1e-5, "{n:?} has length {length}");
                        [wanted[0], wanted[1], got[2], 1.0]
                    }
                    _ => wanted,
                };
                assert_eq!(got, wanted, "{format:?} {name}, texel {i}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_are_never_a_panic_and_never_a_broken_texture(
        file in prop::sample::select(valid_files()),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), any::<bool>()), 1..8),
    ) {
        let mut bytes = file;
        for (index, value, near_the_start) in flips {
            let i = index.index(if near_the_start { bytes.len().min(300) } else { bytes.len() });
            bytes[i] = value;
        }
        if let Ok(t) = decode_texture(Path::new("t"), &bytes) {
            prop_assert!(t.check().is_ok());
        }
    }
}

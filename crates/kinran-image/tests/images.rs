//! Image files in and out, against files of other writers (tests/data/make.py), damaged and hostile ones.

#![allow(clippy::print_stderr, reason = "a skipped test says so")]

#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::io::Write;
use std::path::{Path, PathBuf};

use kinran_image::{
    Channels, Error, Image, MAX_SIDE, Pixels, decode_image, encode_png, read_image, write_atomically,
    write_atomically_with, write_exr, write_png,
};
use proptest::prelude::*;
use sample_assets::sample_assets;

const CHANNELS: [Channels; 4] = [Channels::R, Channels::Rg, Channels::Rgb, Channels::Rgba];

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// The files of tests/data, sorted by name.
fn samples() -> Vec<(PathBuf, Vec<u8>)> {
    let mut files: Vec<_> = std::fs::read_dir(data("")).unwrap().map(|f| f.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e != "py"));
    files.sort();
    assert!(files.len() > 30, "{files:?}");
    files.into_iter().map(|f| (f.clone(), std::fs::read(f).unwrap())).collect()
}

/// What make.py paints.
fn painted(x: u32, y: u32) -> [u32; 4] {
    [x * 12 + y, y * 17, 255 - x * 12 - y, 128 + x + y * 7]
}

fn gradient(width: u32, height: u32, channels: Channels) -> Vec<u32> {
    let n = channels.count() as u32;
    (0..width * height * n).map(|i| i.wrapping_mul(2_654_435_761) >> 16).collect()
}

fn integer_images() -> Vec<Image> {
    let mut images = Vec::new();
    for channels in CHANNELS {
        for (width, height) in [(1, 1), (7, 5), (64, 3)] {
            let values = gradient(width, height, channels);
            let eight = Pixels::U8(values.iter().map(|&v| v as u8).collect());
            let sixteen = Pixels::U16(values.iter().map(|&v| v as u16).collect());
            images.extend([eight, sixteen].map(|p| Image::new(width, height, channels, p).unwrap()));
        }
    }
    images
}

fn float_images() -> Vec<Image> {
    CHANNELS
        .map(|channels| {
            let floats = gradient(9, 6, channels).iter().map(|&v| (v as f32 - 30000.0) * 1.7e-3).collect();
            Image::new(9, 6, channels, Pixels::F32(floats)).unwrap()
        })
        .to_vec()
}

#[test]
fn files_of_other_writers_have_the_texels_they_were_painted_with() {
    // Name, channels, bytes of a sample, tolerance in units of 1/255.
    let cases = [
        ("grey.png", 1, 1, 0.0),
        ("grey_alpha.png", 2, 1, 0.0),
        ("rgb.png", 3, 1, 0.0),
        ("rgba.png", 4, 1, 0.0),
        ("palette.png", 3, 1, 0.0),
        ("grey_16.png", 1, 2, 0.0),
        ("rgba_16.png", 4, 2, 0.0),
        ("grey.tga", 1, 1, 0.0),
        ("rgb.tga", 3, 1, 0.0),
        ("rgba.tga", 4, 1, 0.0),
        ("grey_plain.tga", 1, 1, 0.0),
        ("rgb_plain.tga", 3, 1, 0.0),
        ("rgba_plain.tga", 4, 1, 0.0),
        ("grey_alpha.tga", 2, 1, 0.0),
        ("grey_alpha_plain.tga", 2, 1, 0.0),
        ("grey_lzw.tif", 1, 1, 0.0),
        ("grey_deflate.tif", 1, 1, 0.0),
        ("rgb_lzw.tif", 3, 1, 0.0),
        ("rgb_deflate.tif", 3, 1, 0.0),
        ("rgba_lzw.tif", 4, 1, 0.0),
        ("rgba_deflate.tif", 4, 1, 0.0),
        ("grey_16.tif", 1, 2, 0.0),
        ("grey_float.tif", 1, 4, 0.0),
        ("flat.hdr", 3, 4, 0.0),
        ("y_half.exr", 1, 4, 0.0),
        ("rgb_float.exr", 3, 4, 0.0),
        ("rgba_half.exr", 4, 4, 0.0),
        // Quality 95 without chroma subsampling: the quantisation step of the gradients' frequencies.
        ("baseline.jpg", 3, 1, 6.0),
        ("progressive.jpg", 3, 1, 6.0),
        ("grey.jpg", 1, 1, 6.0),
    ];
    for (name, channels, sample_bytes, tolerance) in cases {
        let image = read_image(&data(name)).unwrap();
        assert_eq!((image.width, image.height), (13, 11), "{name}");
        assert_eq!(image.channels.count(), channels, "{name}");
        let (bytes, scale) = match &image.pixels {
            Pixels::U8(_) => (1, 255.0),
            Pixels::U16(_) => (2, 255.0),
            Pixels::F32(_) => (4, 1.0),
        };
        assert_eq!(bytes, sample_bytes, "{name}");
        for (x, y) in (0..11).flat_map(|y| (0..13).map(move |x| (x, y))) {
            let p = painted(x, y).map(|v| v as f32);
            let opaque = if image.channels.count() == 3 || bytes == 4 { 1.0 } else { 255.0 };
            let wanted = match channels {
                1 => [p[0], p[0], p[0], opaque],
                2 => [p[0], p[0], p[0], p[1]],
                3 => [p[0], p[1], p[2], opaque],
                _ => p,
            };
            let got = image.texel(x, y).map(|v| v * scale);
            for c in 0..if channels % 2 == 1 { 3 } else { 4 } {
                let error = (got[c] - wanted[c]).abs();
                assert!(error <= tolerance + 1e-4, "{name} ({x}, {y}): wanted {wanted:?} got {got:?}");
            }
        }
    }
    let one_bit = read_image(&data("one_bit.png")).unwrap();
    for (x, y) in (0..11).flat_map(|y| (0..13).map(move |x| (x, y))) {
        assert_eq!(one_bit.texel(x, y)[0], f32::from(u8::from(painted(x, y)[0] > 80)), "({x}, {y})");
    }
}

#[test]
fn print_colours_are_refused_by_name() {
    for name in ["cmyk.jpg", "cmyk.tif"] {
        let error = read_image(&data(name)).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("CMYK") && error.contains("RGB"), "{error}");
    }
}

#[test]
fn png_comes_back_exactly() {
    for image in integer_images() {
        let bytes = encode_png(&image).unwrap();
        assert!(bytes == encode_png(&image).unwrap(), "the same image, other bytes");
        assert_eq!(decode_image(Path::new("x.png"), &bytes).unwrap(), image);
    }
}

#[test]
fn exr_comes_back_exactly_and_with_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let tall = {
        let floats = gradient(40, 300, Channels::Rgb).iter().map(|&v| v as f32).collect();
        Image::new(40, 300, Channels::Rgb, Pixels::F32(floats)).unwrap()
    };
    for image in float_images().into_iter().chain([tall]) {
        write_exr(&path, &image).unwrap();
        assert_eq!(read_image(&path).unwrap(), image);
        let first = std::fs::read(&path).unwrap();
        for _ in 0..5 {
            write_exr(&path, &image).unwrap();
            assert!(std::fs::read(&path).unwrap() == first, "the same image, other bytes");
        }
    }
}

#[test]
fn floats_into_png_and_integers_into_exr_are_refused_before_a_file_appears() {
    let folder = tempfile::tempdir().unwrap();
    assert!(write_png(&folder.path().join("x.png"), &float_images()[0]).is_err());
    assert!(write_exr(&folder.path().join("x.exr"), &integer_images()[0]).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn nan_and_infinity_in_a_file_are_refused_by_texel_and_channel() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    for bad in [f32::NAN, f32::INFINITY] {
        let mut image = float_images().swap_remove(3);
        let Pixels::F32(samples) = &mut image.pixels else { unreachable!() };
        samples[(2 * 9 + 4) * 4 + 1] = bad;
        write_exr(&path, &image).unwrap();
        let error = read_image(&path).unwrap_err().to_string();
        assert!(error.contains("x.exr") && error.contains("texel (4, 2)"), "{error}");
        assert!(error.contains("channel green"), "{error}");
    }
}

/// A prefix may hold all texels and lack a trailer only; it must never give other texels.
#[test]
fn truncated_files_are_errors_never_wrong_texels() {
    for (path, bytes) in samples() {
        let whole = decode_image(&path, &bytes);
        for length in 0..bytes.len() {
            if let Ok(image) = decode_image(&path, &bytes[..length]) {
                let name = path.display();
                let whole = whole.as_ref().expect("a file that fails whole fails truncated");
                assert!(image == *whole, "{name}: {length} of {} bytes give other texels", bytes.len());
            }
        }
    }
}

/// A PNG of no texels whose header claims `width` x `height`.
fn lying_png(width: u32, height: u32) -> Vec<u8> {
    let mut header = b"IHDR".to_vec();
    header.extend(width.to_be_bytes());
    header.extend(height.to_be_bytes());
    header.extend([8, 6, 0, 0, 0]);
    let mut crc = !0_u32;
    for &byte in &header {
        crc ^= u32::from(byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 * (crc & 1));
        }
    }
    let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\x0d".to_vec();
    png.extend(header);
    png.extend((!crc).to_be_bytes());
    png.extend(b"\0\0\0\x0dIDAT\x78\x9c");
    png.extend([0; 64]);
    png
}

#[test]
fn headers_that_claim_absurd_sizes_are_refused() {
    for (width, height, reason) in [
        (MAX_SIDE + 1, 1, "too large"),
        (1, MAX_SIDE + 1, "too large"),
        (30000, 30000, "cannot hold"),
        (i32::MAX as u32, i32::MAX as u32, "too large"),
    ] {
        let error = decode_image(Path::new("lie.png"), &lying_png(width, height)).unwrap_err().to_string();
        assert!(error.contains("lie.png") && error.contains(reason), "{width}x{height}: {error}");
    }
}

#[test]
fn files_of_no_known_format_are_refused_with_the_list_of_formats() {
    for (bytes, word) in [
        (&b""[..], "empty"),
        (b"hello", "PNG, JPEG, TGA, TIFF, HDR and EXR"),
        (b"RIFF\0\0\0\0WEBP", "WebP"),
        (b"DDS ", "texture"),
    ] {
        let error = decode_image(Path::new("a/b.dat"), bytes).unwrap_err().to_string();
        assert!(error.contains("b.dat") && error.contains(word), "{error}");
    }
}

#[test]
fn the_content_decides_not_the_extension() {
    let png = std::fs::read(data("rgb.png")).unwrap();
    for name in ["x.jpg", "x.tga", "x"] {
        assert_eq!(decode_image(Path::new(name), &png).unwrap().width, 13, "{name}");
    }
}

#[test]
fn a_missing_file_and_a_folder_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("nothing.png"), folder.path().to_path_buf()] {
        let error = read_image(&path).unwrap_err();
        assert!(matches!(error, Error::Io { .. }), "{error}");
        assert!(error.to_string().contains(&path.display().to_string()), "{error}");
    }
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("kept.txt");
    write_atomically(&path, b"old").unwrap();
    let error = write_atomically_with(&path, |file| {
        file.write_all(&[0; 1 << 22])?;
        Err(std::io::ErrorKind::StorageFull.into())
    })
    .unwrap_err()
    .to_string();
    assert!(error.contains("kept.txt") && error.contains("free some space"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);

    write_atomically(&path, b"new").unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), b"new");
}

#[test]
fn writing_where_nothing_can_be_written_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("no/such/folder/x.png");
    let error = write_png(&missing, &integer_images()[0]).unwrap_err().to_string();
    assert!(error.contains("no/such/folder/x.png") && error.contains("exists"), "{error}");
    let error = write_png(folder.path(), &integer_images()[0]).unwrap_err().to_string();
    assert!(error.contains("name a file in it"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_is_named_with_the_fix() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    std::fs::set_permissions(folder.path(), PermissionsExt::from_mode(0o555)).unwrap();
    if std::fs::write(folder.path().join("probe"), b"").is_ok() {
        eprintln!("skipped: this user may write into read-only folders");
        return;
    }
    let error = write_atomically(&folder.path().join("x.bin"), b"x").unwrap_err().to_string();
    assert!(error.contains("x.bin") && error.contains("permissions"), "{error}");
}

#[cfg(unix)]
#[test]
fn written_files_are_as_readable_as_any_other() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let mode = |name: &str| std::fs::metadata(folder.path().join(name)).unwrap().permissions().mode();
    std::fs::write(folder.path().join("plain"), b"").unwrap();
    write_atomically(&folder.path().join("ours"), b"").unwrap();
    assert_eq!(mode("ours"), mode("plain"));
}

#[test]
fn sample_assets_hold_images_that_are_not_read() {
    let Some(assets) = sample_assets() else { return };
    let (mut folders, mut read) = (vec![assets], 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
            if path.is_dir() {
                folders.push(path);
            } else if ["png", "jpg", "hdr", "exr", "tga", "tif"].contains(&&*extension) {
                let image = read_image(&path).unwrap_or_else(|e| panic!("{e}"));
                assert_eq!(image.pixels.len() as u64, {
                    u64::from(image.width) * u64::from(image.height) * image.channels.count() as u64
                });
                read += 1;
            }
        }
    }
    assert!(read > 0, "the asset folder has no images");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn flipped_bytes_are_never_a_panic(
        file in 0..samples().len(),
        flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
    ) {
        let (path, mut bytes) = samples().swap_remove(file);
        for (index, value) in flips {
            let i = index.index(bytes.len());
            bytes[i] = value;
        }
        if let Ok(image) = decode_image(&path, &bytes) {
            let wanted = image.width as usize * image.height as usize * image.channels.count();
            prop_assert_eq!(image.pixels.len(), wanted);
        }
    }
}

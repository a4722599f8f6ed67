//! Image files in and out, against files of other writers (tests/data/make.py), damaged and hostile ones.

#![allow(clippy::print_stderr, reason = "a skipped test says so")]

#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::io::Write;
use std::path::{Path, PathBuf};

use kinran_image::{
    Channels, Error, IMAGE_EXTENSIONS, Image, MAX_SIDE, Pixels, Transfer, decode_image, encode_png,
    has_image_extension, read_image, read_layer, write_atomically, write_atomically_with, write_exr,
    write_png,
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

/// Their alpha is a power of two, so that it can be multiplied and divided by exactly.
fn float_images() -> Vec<Image> {
    CHANNELS
        .map(|channels| {
            let n = channels.count();
            let mut floats: Vec<f32> =
                gradient(9, 6, channels).iter().map(|&v| (v as f32 - 30000.0) * 1.7e-3).collect();
            if n % 2 == 0 {
                floats.iter_mut().skip(n - 1).step_by(n).enumerate().for_each(|(i, a)| {
                    *a = [1.0, 0.5, 0.25, 2.0][i % 4];
                });
            }
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
        ("xyz.exr", 3, 4, 0.0),
        ("only_layer.exr", 3, 4, 0.0),
        ("grey_alpha.tif", 2, 1, 0.0),
        // Quality 95 without chroma subsampling: the quantisation step of the gradients' frequencies.
        ("baseline.jpg", 3, 1, 6.0),
        ("progressive.jpg", 3, 1, 6.0),
        ("grey.jpg", 1, 1, 6.0),
        ("adobe_0.jpg", 3, 1, 6.0),
        ("adobe_0_jfif.jpg", 3, 1, 6.0),
        ("rgb.bmp", 3, 1, 0.0),
        ("rgba.bmp", 3, 1, 0.0),
        ("rgb.webp", 3, 1, 0.0),
        ("rgba.webp", 4, 1, 0.0),
        // Quality 100 and a matrix of its own: whites and blacks within the range of video.
        ("lossy.webp", 3, 1, 12.0),
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
    // A palette of greys.
    let grey = read_image(&data("grey.bmp")).unwrap();
    assert_painted(&grey, "grey.bmp", 0.0, |p| [p[0], p[0], p[0]]);
    let one_bit = read_image(&data("one_bit.png")).unwrap();
    for (x, y) in (0..11).flat_map(|y| (0..13).map(move |x| (x, y))) {
        assert_eq!(one_bit.texel(x, y)[0], f32::from(u8::from(painted(x, y)[0] > 80)), "({x}, {y})");
    }
}

/// Texels of an image as make.py paints them.
fn assert_painted(image: &Image, name: &str, tolerance: f32, wanted: impl Fn([f32; 4]) -> [f32; 3]) {
    let scale = if matches!(image.pixels, Pixels::F32(_)) { 1.0 } else { 255.0 };
    for (x, y) in (0..11).flat_map(|y| (0..13).map(move |x| (x, y))) {
        let wanted = wanted(painted(x, y).map(|v| v as f32));
        let got = image.texel(x, y).map(|v| v * scale);
        for c in 0..3 {
            let error = (got[c] - wanted[c]).abs();
            assert!(error <= tolerance, "{name} ({x}, {y}): wanted {wanted:?} got {got:?}");
        }
    }
}

#[test]
fn colours_that_are_multiplied_by_alpha_are_divided_by_it() {
    // The writer stored the painted floats as they are, which EXR takes for multiplied ones.
    let image = read_image(&data("rgba_half.exr")).unwrap();
    assert_painted(&image, "rgba_half.exr", 1e-4, |p| [p[0] / p[3], p[1] / p[3], p[2] / p[3]]);
    assert_eq!(image.texel(3, 2)[3], painted(3, 2)[3] as f32);
    // Alpha of 128 and more and half a step of rounding leave one step of colour.
    let image = read_image(&data("associated.tif")).unwrap();
    assert_painted(&image, "associated.tif", 1.0, |p| [p[0], p[1], p[2]]);
    assert!(matches!(image.pixels, Pixels::U16(_)), "8 bits would round once more");
    assert!((image.texel(3, 2)[3] * 255.0 - painted(3, 2)[3] as f32).abs() < 1e-4);
    // Where alpha is 0 there is nothing to divide by.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let planes = ["R", "G", "B", "A"].map(|name| (name, vec![if name == "A" { 0.0 } else { 0.25 }]));
    kinran_image::write_exr_planes(&path, (1, 1), planes.to_vec()).unwrap();
    assert_eq!(read_image(&path).unwrap().texel(0, 0), [0.25, 0.25, 0.25, 0.0]);
}

/// What is written multiplied by alpha is read back as it was, whatever reads it: the file holds the product.
#[test]
fn exr_files_hold_colours_multiplied_by_alpha() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.exr");
    let image = Image::new(1, 1, Channels::Rgba, Pixels::F32(vec![0.5, 1.0, 2.0, 0.25])).unwrap();
    write_exr(&path, &image).unwrap();
    let bytes = exr::prelude::read_first_rgba_layer_from_file(
        &path,
        |_, _| [0.0f32; 4],
        |texel: &mut [f32; 4], _, (r, g, b, a): (f32, f32, f32, f32)| *texel = [r, g, b, a],
    )
    .unwrap();
    assert_eq!(bytes.layer_data.channel_data.pixels, [0.125, 0.25, 0.5, 0.25]);
    assert_eq!(read_image(&path).unwrap(), image);
}

#[test]
fn tiff_is_read_from_its_visual_top_left_and_exif_only_told() {
    for orientation in 2..=8 {
        let name = format!("orientation_{orientation}.tif");
        let image = read_image(&data(&name)).unwrap();
        assert_eq!((image.width, image.height), (13, 11), "{name}");
        assert_painted(&image, &name, 0.0, |p| [p[0], p[1], p[2]]);
    }
    let image = read_image(&data("exif_turned.jpg")).unwrap();
    assert_painted(&image, "exif_turned.jpg", 6.0, |p| [p[0], p[1], p[2]]);
    assert_eq!(image.notes, ["its EXIF data ask to turn it for display; it is taken as stored"]);
}

#[test]
fn channels_of_an_exr_come_from_one_layer() {
    // The unnamed layer, though diffuse.B stands before R in the file and Z is there too.
    let image = read_image(&data("layers.exr")).unwrap();
    assert_painted(&image, "layers.exr", 0.0, |p| [p[0], p[1], p[2]]);
    assert_eq!(image.notes, ["the layer without a name; left out: diffuse, Z"]);
    let other = |p: [f32; 4]| [255.0 - p[0], 255.0 - p[1], 255.0 - p[2]];
    let image = read_layer(&data("layers.exr"), Some("Diffuse")).unwrap();
    assert_painted(&image, "layers.exr diffuse", 0.0, other);
    assert_eq!(image.notes, ["layer \"diffuse\"; left out: one without a name (B, G, R, Z)"]);

    let image = read_layer(&data("blender.exr"), Some("View.Normal")).unwrap();
    assert_painted(&image, "blender.exr", 0.0, other);
    assert_eq!(
        image.notes,
        ["layer \"View.Normal\"; X, Y, Z as red, green, blue; left out: View.Combined, View.Depth"]
    );
    let image = read_layer(&data("parts.exr"), Some("normal")).unwrap();
    assert_painted(&image, "parts.exr", 0.0, other);
    assert_eq!(image.notes, ["layer \"normal\"; X, Y, Z as red, green, blue; left out: color"]);
    assert_eq!(read_image(&data("xyz.exr")).unwrap().notes, ["X, Y, Z as red, green, blue"]);
    assert_eq!(read_image(&data("only_layer.exr")).unwrap().notes, ["layer \"normal\""]);
    assert_eq!(read_image(&data("rgb_float.exr")).unwrap().notes, [""; 0]);
}

#[test]
fn layers_that_cannot_be_told_apart_are_refused_with_their_names_and_the_flag() {
    for (name, parts) in [
        ("blender.exr", ["View.Combined", "View.Normal", "View.Depth", "--exr-layer"]),
        ("parts.exr", ["color", "normal", "several", "--exr-layer"]),
    ] {
        let error = read_image(&data(name)).unwrap_err().to_string();
        assert!(error.contains(name) && parts.iter().all(|part| error.contains(part)), "{error}");
    }
    for (name, layer, part) in [
        ("blender.exr", "Specular", "View.Combined, View.Depth, View.Normal"),
        ("rgb.png", "x", "only EXR has layers"),
    ] {
        let error = read_layer(&data(name), Some(layer)).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains(layer) && error.contains(part), "{error}");
    }
}

#[test]
fn floats_are_linear_unless_their_file_says_otherwise() {
    for (name, wanted) in [
        ("rgb.png", Transfer::Unsaid),
        ("baseline.jpg", Transfer::Unsaid),
        ("grey_16.tif", Transfer::Unsaid),
        ("grey_float.tif", Transfer::Linear),
        ("flat.hdr", Transfer::Linear),
        ("rgb_float.exr", Transfer::Linear),
        ("acescg.exr", Transfer::Linear),
        ("srgb.exr", Transfer::Srgb),
    ] {
        assert_eq!(read_image(&data(name)).unwrap().transfer, wanted, "{name}");
    }
    let notes = read_image(&data("acescg.exr")).unwrap().notes;
    assert_eq!(notes, ["its colours are said to be \"lin_ap1_scene\"; they are taken as if of Rec. 709"]);
}

#[test]
fn headers_of_hdr_files_are_refused_with_the_right_advice() {
    let flat = std::fs::read(data("flat.hdr")).unwrap();
    let text = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 11 +X 13\n";
    assert!(flat.starts_with(text));
    let with = |header: &str| {
        let bytes = [header.as_bytes(), &flat[text.len()..]].concat();
        decode_image(Path::new("sky.hdr"), &bytes)
    };
    for (header, parts) in [
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+Y 11 +X 13\n", ["+Y 11 +X 13", "turn it round"]),
        ("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+X 13 -Y 11\n", ["+X 13 -Y 11", "turn it round"]),
        ("#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n-Y 11 +X 13\r\n", ["CR LF", "binary mode"]),
        ("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 11 +X 13\n", ["XYZ", "save it as RGB"]),
    ] {
        let error = with(header).unwrap_err().to_string();
        assert!(error.contains("sky.hdr") && parts.iter().all(|part| error.contains(part)), "{error}");
    }
    let image =
        with("#?RADIANCE\nEXPOSURE=2.0\nFORMAT=32-bit_rle_rgbe\nEXPOSURE= 4\n\n-Y 11 +X 13\n").unwrap();
    assert_painted(&image, "exposure", 0.0, |p| [p[0], p[1], p[2]]);
    assert!(image.notes.len() == 1 && image.notes[0].contains("EXPOSURE 8"), "{:?}", image.notes);
}

#[test]
fn every_extension_in_the_list_is_one_that_is_read() {
    for extension in IMAGE_EXTENSIONS {
        let upper = format!("a.b.{}", extension.to_uppercase());
        assert!(has_image_extension(Path::new(&upper)), "{upper}");
    }
    for name in ["png", "a.psd", "a.png.txt", "a", ""] {
        assert!(!has_image_extension(Path::new(name)), "{name}");
    }
    let jpeg = std::fs::read(data("baseline.jpg")).unwrap();
    for name in ["x.jpe", "x.JFIF"] {
        assert_eq!(decode_image(Path::new(name), &jpeg).unwrap().width, 13, "{name}");
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
        (b"hello", "PNG, JPEG, TGA, BMP, WebP, TIFF, HDR, EXR, KTX2 and DDS"),
        (b"GIF89a", "GIF"),
        (b"\0\0\0\x20ftypavif", "AVIF"),
        (b"\xff\x0a\0\0", "JPEG XL"),
        (b"DDS ", "truncated"),
        (b"RIFF\x20\0\0\0WEBPVP8 ", "truncated"),
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
    assert!(error.contains("no/such/folder/x.png") && error.contains("no such file or folder"), "{error}");
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

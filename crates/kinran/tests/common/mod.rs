//! Maps and a model, as names and bytes.

use kinran_image::{Channels, Image, Pixels, encode_png};

/// A picture in which every texel differs.
pub(crate) fn png(channels: Channels, seed: u32) -> Vec<u8> {
    let (width, height) = (32, 16);
    let count = width * height * channels.count() as u32;
    let texel = |i: u32| (128 + (i.wrapping_mul(2_654_435_761) ^ seed.wrapping_mul(40_503)) % 61) as u8;
    let image = Image::new(width, height, channels, Pixels::U8((0..count).map(texel).collect()));
    encode_png(&image.unwrap()).unwrap()
}

/// Bumps, every one of them another.
pub(crate) fn bumps(seed: u32) -> Vec<u8> {
    let code = |x: f32| (127.5 * (x + 1.0)).round() as u8;
    let texel = |i: u32| {
        let slope = |k: u32| (i.wrapping_mul(k) ^ seed.wrapping_mul(40_503)) as f32 / u32::MAX as f32 - 0.5;
        let (x, y) = (slope(2_654_435_761), slope(2_246_822_519));
        [code(x), code(y), code((1.0 - x * x - y * y).sqrt())]
    };
    let image = Image::new(32, 16, Channels::Rgb, Pixels::U8((0..512).flat_map(texel).collect()));
    encode_png(&image.unwrap()).unwrap()
}

/// Maps of two materials.
pub(crate) fn maps() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("cloth/silk_normal.png", bumps(1)),
        ("cloth/silk_roughness.png", png(Channels::R, 2)),
        ("cloth/silk_basecolor.png", png(Channels::Rgb, 3)),
        ("cloth/silk_metallic.png", png(Channels::R, 4)),
        ("cloth/felt_roughness.png", png(Channels::R, 5)),
    ]
}

/// A model whose buffer and images are files beside it.
pub(crate) fn model() -> Vec<(&'static str, Vec<u8>)> {
    let corners: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.2], [0.0, 1.0, 0.0]];
    let mut buffer: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    buffer.extend(corners.iter().flat_map(|c| [c[0], c[1]]).flat_map(f32::to_le_bytes));
    buffer.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    let json = r#"{
      "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
      "meshes": [{ "name": "sheet", "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1 }, "indices": 2, "material": 0 }] }],
      "accessors": [
        { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0.2] },
        { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" },
        { "bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR" }],
      "bufferViews": [{ "buffer": 0, "byteLength": 48 }, { "buffer": 0, "byteOffset": 48, "byteLength": 32 },
        { "buffer": 0, "byteOffset": 80, "byteLength": 12 }],
      "buffers": [{ "byteLength": 92, "uri": "parts/sheet.bin" }],
      "materials": [{ "name": "skin of a drum", "normalTexture": { "index": 0, "scale": 0.5 },
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 2 }, "metallicRoughnessTexture": { "index": 1 } } }],
      "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }],
      "images": [{ "uri": "maps/bumps.png" }, { "uri": "maps/rough.png" }, { "uri": "maps/color.png" }]
    }"#;
    vec![
        ("models/drum.gltf", json.as_bytes().to_vec()),
        ("models/parts/sheet.bin", buffer),
        ("models/maps/bumps.png", bumps(6)),
        ("models/maps/rough.png", png(Channels::Rgb, 7)),
        ("models/maps/color.png", png(Channels::Rgb, 8)),
    ]
}

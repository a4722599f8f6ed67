//! Small inputs, and the program run on them.

use std::f32::consts::TAU;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use kinran_image::{Channels, Image, Pixels, encode_png};
use serde_json::{Value, json};

/// What the program said.
pub(crate) struct Said {
    /// Exit code.
    pub(crate) code: Option<i32>,
    /// Standard output.
    pub(crate) out: String,
    /// Standard error.
    pub(crate) err: String,
}

/// Runs `kinran` with `args`.
pub(crate) fn kinran(args: &[&str]) -> Said {
    let Output { status, stdout, stderr } =
        Command::new(env!("CARGO_BIN_EXE_kinran")).args(args).output().expect("kinran does not start");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("kinran printed no UTF-8");
    Said { code: status.code(), out: text(stdout), err: text(stderr) }
}

/// Runs `kinran`, which must succeed, and reads its JSON.
pub(crate) fn kinran_json(args: &[&str]) -> Value {
    let said = kinran(&[args, &["--json"]].concat());
    assert_eq!(said.code, Some(0), "{args:?} failed: {}", said.err);
    serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{args:?} printed no JSON ({e}): {}", said.out))
}

/// Asserts that `args` are refused with exit code 2 and one error that has `parts` in it.
pub(crate) fn refused(args: &[&str], parts: &[&str]) {
    let said = kinran(args);
    assert_eq!(said.code, Some(2), "{args:?}: wanted exit code 2, got {:?}: {}", said.code, said.err);
    assert!(said.out.is_empty(), "{args:?} printed a result: {}", said.out);
    assert!(!said.err.contains("panicked"), "{args:?} panicked: {}", said.err);
    assert_eq!(said.err.matches("error: ").count(), 1, "{args:?}: wanted one error, got: {}", said.err);
    let one_line = said.err.trim_end().lines().count() == 1;
    assert!(one_line || said.err.contains("try '--help'"), "{args:?}: wanted one line, got: {}", said.err);
    for part in parts {
        assert!(said.err.contains(part), "{args:?}: wanted {part:?} in: {}", said.err);
    }
}

/// Names of the files in a folder, sorted.
pub(crate) fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("no such folder");
    let mut names: Vec<String> =
        entries.map(|e| e.expect("unreadable folder").file_name().into_string().expect("no UTF-8")).collect();
    names.sort();
    names
}

/// A 32 x 32 normal map of two waves of bumps.
pub(crate) fn bumps() -> Image {
    let wave = |i: u32| 0.6 * (TAU * i as f32 / 8.0).sin();
    let texel = |x: u32, y: u32| {
        let (nx, ny) = (wave(x), 0.4 * wave(y));
        let length = (nx * nx + ny * ny + 1.0).sqrt();
        [nx, ny, 1.0].map(|n| ((n / length * 0.5 + 0.5) * 255.0 + 0.5) as u8)
    };
    let samples = (0..32).flat_map(|y| (0..32).flat_map(move |x| texel(x, y))).collect();
    Image::new(32, 32, Channels::Rgb, Pixels::U8(samples)).expect("the image is sound")
}

/// The bytes of a .glb: a square of side 2 in the plane z = 0 that faces +z, metallic, with a normal map.
pub(crate) fn glb() -> Vec<u8> {
    glb_with(&bumps())
}

/// The same with another normal map.
pub(crate) fn glb_with(map: &Image) -> Vec<u8> {
    let corners = [[-1.0_f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    let normals = corners.iter().flat_map(|_| [0.0, 0.0, 1.0]);
    let uvs = corners.iter().flat_map(|[x, y]| [(x + 1.0) * 2.0, (1.0 - y) * 2.0]);
    let floats = positions.chain(normals).chain(uvs);
    let mut bin: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    bin.extend([0_u16, 1, 2, 0, 2, 3].into_iter().flat_map(u16::to_le_bytes));
    let png = encode_png(map).expect("the image is sound");
    let (image_start, image_length) = (bin.len(), png.len());
    bin.extend(png);
    while !bin.len().is_multiple_of(4) {
        bin.push(0);
    }

    let json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
        }] }],
        "materials": [{
            "name": "hammered",
            "pbrMetallicRoughness": { "metallicFactor": 1.0, "roughnessFactor": 0.4 },
            "normalTexture": { "index": 0 }
        }],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": 4, "mimeType": "image/png" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
              "min": [-1.0, -1.0, 0.0], "max": [1.0, 1.0, 0.0] },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" }
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 128, "byteLength": 12 },
            { "buffer": 0, "byteOffset": image_start, "byteLength": image_length }
        ],
        "buffers": [{ "byteLength": bin.len() }]
    });
    let mut json = json.to_string().into_bytes();
    while !json.len().is_multiple_of(4) {
        json.push(b' ');
    }
    let mut glb = b"glTF".to_vec();
    let word = |n: usize| u32::try_from(n).expect("a small file").to_le_bytes();
    glb.extend(word(2));
    glb.extend(word(12 + 8 + json.len() + 8 + bin.len()));
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        glb.extend(word(chunk.len()));
        glb.extend(kind);
        glb.extend(chunk);
    }
    glb
}

/// A folder with `square.glb` in it, and the path of that.
pub(crate) fn square() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("no temporary folder");
    let path = folder.path().join("square.glb");
    std::fs::write(&path, glb()).expect("the temporary folder is not writable");
    (folder, path)
}

/// A path as the command line takes it.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().expect("no UTF-8")
}

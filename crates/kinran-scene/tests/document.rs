//! Documents that are read, changed and written, judged by Khronos' validator and by our reader.

#![allow(clippy::print_stderr, reason = "a skipped check says so")]

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::{DOCUMENTS, sample_assets};
use kinran_image::{Channels, Format, Image, Level, Pixels, Texture, Transfer};
use kinran_scene::{Document, Scene, Slot, TextureExtension};
use serde_json::{Value, json};

/// Asserts that gltf-validator finds no more errors in each second file than in the first; says so where
/// node or npm are not to be had.
fn assert_as_valid(pairs: &[(PathBuf, PathBuf)]) {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tools/check_gltf/validate.sh");
    let files = pairs.iter().flat_map(|(before, after)| [before, after]);
    let output = match Command::new(script).args(files).output() {
        Ok(output) if output.status.code() != Some(2) && output.status.code() != Some(127) => output,
        _ => return eprintln!("SKIPPED: gltf-validator cannot be run here"),
    };
    let report = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors: Vec<usize> = (report.lines())
        .filter_map(|line| line.split(" errors,").next()?.rsplit(' ').next()?.parse().ok())
        .collect();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        errors.len(),
        2 * pairs.len(),
        "a verdict is missing ({}):\n{report}{complaint}",
        output.status
    );
    for ((before, after), errors) in pairs.iter().zip(errors.chunks(2)) {
        let (before, after) = (before.display(), after.display());
        assert!(errors[1] <= errors[0], "{before}: {} errors, {after}: {}\n{report}", errors[0], errors[1]);
    }
}

/// A flat texture, whole chain, in the format that its role would have.
fn flat_texture(format: Format, transfer: Transfer) -> Texture {
    let level =
        |side: u32| Level { width: side, height: side, data: vec![0; format.level_bytes(side, side)] };
    Texture { format, transfer, levels: [8, 4, 2, 1].map(level).to_vec(), metadata: Default::default() }
}

/// Replaces the textures of every material by baked ones, as a baker would.
fn bake(document: &mut Document, folder: &Path, alternatives: &[TextureExtension]) -> usize {
    let fallback = Image::new(8, 8, Channels::Rgb, Pixels::U8(vec![128; 8 * 8 * 3])).unwrap();
    let mut replaced = 0;
    for material in 0..document.material_count() {
        for (slot, format, transfer) in [
            (Slot::Normal, Format::Bc5, Transfer::Linear),
            (Slot::MetallicRoughness, Format::Bc7, Transfer::Linear),
            (Slot::Anisotropy, Format::Bc7, Transfer::Linear),
            (Slot::BaseColor, Format::Bc7, Transfer::Srgb),
        ] {
            let Some(old) = document.texture(material, slot) else { continue };
            let stem = format!("{material} {slot:?}");
            let texture = flat_texture(format, transfer);
            let mut files = Vec::new();
            for &extension in alternatives {
                let (suffix, bytes) = match extension {
                    TextureExtension::Ktx2 => ("ktx2", kinran_image::encode_ktx2(&texture, None).unwrap()),
                    TextureExtension::Dds => ("dds", kinran_image::encode_dds(&texture).unwrap()),
                };
                let name = format!("{stem}.{suffix}");
                std::fs::write(folder.join(&name), bytes).unwrap();
                files.push((extension, document.add_image_file(&name)));
            }
            let name = format!("{stem}.png");
            kinran_image::write_png(&folder.join(&name), &fallback).unwrap();
            let source = document.add_image_file(&name);
            let new = document.add_texture(Some(old), Some(source), &files);
            document.set_texture(material, slot, new);
            replaced += 1;
        }
    }
    replaced
}

#[test]
fn a_round_trip_of_sample_assets_loses_json_geometry_or_validity() {
    let Some(assets) = sample_assets() else { return };
    let (mut pairs, mut folders) = (Vec::new(), Vec::new());
    for (file, _, placed, _) in DOCUMENTS {
        let original = assets.join("meshes").join(file);
        for extension in ["glb", "gltf"] {
            let folder = tempfile::tempdir().unwrap();
            let written = folder.path().join("out").with_extension(extension);
            let document = Document::open(&original).unwrap();
            assert_eq!(document.write(&written).unwrap(), Vec::<String>::new(), "{file} as {extension}");

            let again = Document::open(&written).unwrap();
            for (key, value) in document.json() {
                if key != "buffers" && key != "images" {
                    assert_eq!(
                        Some(value),
                        again.json().get(key),
                        "{file} as {extension}: \"{key}\" has changed"
                    );
                }
            }
            for image in 0..document.json().get("images").map_or(0, |images| images.as_array().unwrap().len())
            {
                assert!(
                    document.image_bytes(image).unwrap() == again.image_bytes(image).unwrap(),
                    "{file} as {extension}: image {image} has changed"
                );
            }
            let (a, b) = (Scene::load(&original).unwrap(), Scene::load(&written).unwrap());
            assert_eq!(a.primitives, b.primitives, "{file} as {extension}");
            assert_eq!(placed, b.triangle_count(), "{file} as {extension}");
            pairs.push((original.clone(), written));
            folders.push(folder);
        }
    }
    assert_as_valid(&pairs);
}

#[test]
fn replaced_textures_of_sample_assets_are_invalid_or_leave_their_bytes() {
    let Some(assets) = sample_assets() else { return };
    let (mut pairs, mut folders) = (Vec::new(), Vec::new());
    for (file, _, placed, _) in DOCUMENTS {
        let original = assets.join("meshes").join(file);
        for (extension, alternatives) in [
            ("glb", &[TextureExtension::Ktx2][..]),
            ("gltf", &[TextureExtension::Dds]),
            ("gltf", &[TextureExtension::Ktx2, TextureExtension::Dds]),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let mut document = Document::open(&original).unwrap();
            let replaced = bake(&mut document, folder.path(), alternatives);
            let written = folder.path().join("baked").with_extension(extension);
            assert_eq!(document.write(&written).unwrap(), Vec::<String>::new(), "{file} as {extension}");

            let scene = Scene::load(&written).unwrap();
            assert_eq!(placed, scene.triangle_count(), "{file} as {extension}");
            // Documents whose images were all embedded and replaced must not carry them on.
            if replaced > 0 && file.contains("disc") {
                let (old, new) = (std::fs::metadata(&original).unwrap().len(), total_size(&written));
                assert!(new < old / 2, "{file} as {extension}: {old} bytes before, {new} after");
            }
            let used: usize = scene.images.iter().flatten().count();
            assert!(used >= replaced.min(1), "{file}: {used} images in use, {replaced} replaced");
            pairs.push((original.clone(), written));
            folders.push(folder);
        }
    }
    assert_as_valid(&pairs);
}

/// The document and its buffer.
fn total_size(document: &Path) -> u64 {
    let bin = document.with_extension("bin");
    std::fs::metadata(document).unwrap().len() + std::fs::metadata(bin).map_or(0, |m| m.len())
}

/// A document with three embedded images of marked bytes between views that must survive, one of them
/// overlapping a replaced image.
fn embedded() -> (Value, Vec<u8>) {
    let bin: Vec<u8> = (0..100).collect();
    let json = json!({
        "asset": { "version": "2.0", "extras": { "kept": [1, 2.5, null] } },
        "extensionsUsed": [],
        "x-unknown": { "z": 1, "a": 2 },
        "buffers": [{ "byteLength": 100 }],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 12, "byteLength": 21, "name": "image 0" },
            { "buffer": 0, "byteOffset": 36, "byteLength": 12 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 30, "name": "image 1" },
            { "buffer": 0, "byteOffset": 72, "byteLength": 28, "name": "image 2, overlaps image 1" },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 1, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 1, "type": "VEC3" },
        ],
        "images": [
            { "bufferView": 1, "mimeType": "image/png" },
            { "bufferView": 3, "mimeType": "image/png" },
            { "bufferView": 4, "mimeType": "image/png" },
        ],
        "textures": [{ "source": 0 }, { "source": 1, "sampler": 0 }, { "source": 2 }],
        "samplers": [{ "wrapS": 33071 }],
        "materials": [{
            "normalTexture": { "index": 1, "scale": 0.5, "texCoord": 1 },
            "emissiveTexture": { "index": 0 },
            "occlusionTexture": { "index": 2 },
        }],
    });
    (json, bin)
}

fn glb(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut json = serde_json::to_vec(json).unwrap();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = b"glTF".to_vec();
    for n in [2, (12 + 8 + json.len() + 8 + bin.len().next_multiple_of(4)) as u32, json.len() as u32] {
        out.extend(n.to_le_bytes());
    }
    out.extend(b"JSON");
    out.extend(json);
    out.extend((bin.len().next_multiple_of(4) as u32).to_le_bytes());
    out.extend(b"BIN\0");
    out.extend(bin);
    out.resize(out.len().next_multiple_of(4), 0);
    out
}

fn open(folder: &Path, json: &Value, bin: &[u8]) -> Document {
    let path = folder.join("in.glb");
    std::fs::write(&path, glb(json, bin)).unwrap();
    Document::open(path).unwrap()
}

fn view(json: &Value, bin: &[u8], view: usize) -> Vec<u8> {
    let view = &json["bufferViews"][view];
    let offset = view["byteOffset"].as_u64().unwrap_or(0) as usize;
    bin[offset..offset + view["byteLength"].as_u64().unwrap() as usize].to_vec()
}

#[test]
fn replacing_embedded_images_repacks_the_buffer_and_renumbers() {
    let folder = tempfile::tempdir().unwrap();
    let (json, bin) = embedded();
    let mut document = open(folder.path(), &json, &bin);
    assert_eq!(document.texture(0, Slot::Normal), Some(1));
    assert_eq!(document.image_bytes(0).unwrap(), &bin[12..33]);
    for slot in [Slot::Normal, Slot::Emissive] {
        let old = document.texture(0, slot);
        let ktx2 = document.add_image_file("näher #1.ktx2");
        let png = document.add_image_file("n.png");
        let new = document.add_texture(old, Some(png), &[(TextureExtension::Ktx2, ktx2)]);
        document.set_texture(0, slot, new);
    }
    let written = folder.path().join("out.gltf");
    assert_eq!(document.write(&written).unwrap(), Vec::<String>::new());

    let out: Value = serde_json::from_slice(&std::fs::read(&written).unwrap()).unwrap();
    let kept = std::fs::read(folder.path().join("out.bin")).unwrap();
    // Cut: bytes 12..32 (of 12..33) and 48..72 (48..78 without the part that image 2 shares).
    let want: Vec<u8> = (0..12).chain(32..48).chain(72..100).collect();
    assert_eq!(want, kept, "buffer");
    assert_eq!(out["buffers"], json!([{ "byteLength": 56, "uri": "out.bin" }]));
    assert_eq!(out["bufferViews"].as_array().unwrap().len(), 3);
    assert_eq!(view(&out, &kept, 0), (0..12).collect::<Vec<u8>>());
    assert_eq!(view(&out, &kept, 1), (36..48).collect::<Vec<u8>>());
    assert_eq!(view(&out, &kept, 2), (72..100).collect::<Vec<u8>>());
    assert_eq!(out["accessors"][1]["bufferView"], 1);
    assert_eq!(
        out["images"],
        json!([
            { "bufferView": 2, "mimeType": "image/png" },
            { "uri": "n%C3%A4her%20%231.ktx2" },
            { "uri": "n.png" },
        ])
    );
    let extensions = json!({ "KHR_texture_basisu": { "source": 1 } });
    assert_eq!(
        out["textures"],
        json!([
            { "source": 0 },
            { "sampler": 0, "source": 2, "extensions": extensions },
            { "source": 2, "extensions": extensions },
        ])
    );
    assert_eq!(
        out["materials"],
        json!([{
            "normalTexture": { "index": 1, "scale": 0.5, "texCoord": 1 },
            "emissiveTexture": { "index": 2 },
            "occlusionTexture": { "index": 0 },
        }])
    );
    assert_eq!(out["extensionsUsed"], json!(["KHR_texture_basisu"]));
    assert_eq!(out["asset"], json["asset"]);
    assert_eq!(serde_json::to_string(&out["x-unknown"]).unwrap(), r#"{"z":1,"a":2}"#, "member order");
}

#[test]
fn unknown_extensions_forbid_renumbering() {
    let folder = tempfile::tempdir().unwrap();
    let (mut json, bin) = embedded();
    json["extensionsUsed"] = json!(["ACME_hologram"]);
    json["extensions"] = json!({ "ACME_hologram": { "image": 1, "bufferView": 3 } });
    let mut document = open(folder.path(), &json, &bin);
    let png = document.add_image_file("n.png");
    let new = document.add_texture(None, Some(png), &[]);
    document.set_texture(0, Slot::Normal, new);
    let written = folder.path().join("out.glb");
    let warnings = document.write(&written).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("ACME_hologram"), "{warnings:?}");
    let again = Document::open(&written).unwrap();
    assert_eq!(again.json()["extensions"], json["extensions"]);
    assert_eq!(again.image_bytes(1).unwrap(), &bin[48..78]);
    assert_eq!(again.json()["images"].as_array().unwrap().len(), 4);
}

/// Compressed buffer views hold offsets of their own, which cutting would break.
#[test]
fn meshopt_buffers_are_not_repacked() {
    let folder = tempfile::tempdir().unwrap();
    let (mut json, bin) = embedded();
    json["extensionsUsed"] = json!(["EXT_meshopt_compression"]);
    let meshopt = json!({ "EXT_meshopt_compression": { "buffer": 0, "byteOffset": 78, "byteLength": 9, "byteStride": 12, "count": 1, "mode": "ATTRIBUTES" } });
    json["bufferViews"][0]["extensions"] = meshopt.clone();
    let mut document = open(folder.path(), &json, &bin);
    let png = document.add_image_file("n.png");
    let new = document.add_texture(None, Some(png), &[]);
    document.set_texture(0, Slot::Normal, new);
    let written = folder.path().join("out.gltf");
    let warnings = document.write(&written).unwrap();
    assert!(warnings.len() == 1 && warnings[0].contains("stay in the buffers"), "{warnings:?}");
    assert_eq!(std::fs::read(folder.path().join("out.bin")).unwrap(), bin);
    let again = Document::open(&written).unwrap();
    assert_eq!(again.json()["bufferViews"][0]["extensions"], meshopt);
    assert_eq!(
        again.json()["images"].as_array().unwrap().len(),
        3,
        "the replaced image is dropped, one is new"
    );
}

/// Everything that `writes` to must be refused with a message that holds `reason`.
#[test]
fn nothing_of_the_original_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let (json, bin) = embedded();
    let document = open(folder.path(), &json, &bin);
    let refuse = |document: &Document, path: PathBuf, reason: &str| {
        let error = document.write(&path).expect_err(reason).to_string();
        assert!(
            error.contains(reason) && error.contains(path.file_name().unwrap().to_str().unwrap()),
            "{error}"
        );
    };
    refuse(&document, folder.path().join("in.glb"), "is the document that was read");
    refuse(&document, folder.path().join("out.obj"), "must end in .glb, .vrm or .gltf");
    refuse(&document, folder.path().join("missing/out.glb"), "out.glb");
    assert_eq!(std::fs::read(folder.path().join("in.glb")).unwrap(), glb(&json, &bin));
}

#[test]
fn files_outside_the_folder_are_copied_into_it_and_several_buffers_become_one() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["shared", "model", "out"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    std::fs::write(folder.path().join("shared/wood grain.png"), b"wood").unwrap();
    std::fs::write(folder.path().join("model/a.bin"), [1, 2, 3, 4, 5]).unwrap();
    let json = json!({
        "asset": { "version": "2.0" },
        "buffers": [{ "uri": "a.bin", "byteLength": 5 }, { "uri": "data:;base64,BgcI", "byteLength": 3 }],
        "bufferViews": [{ "buffer": 0, "byteLength": 5 }, { "buffer": 1, "byteOffset": 1, "byteLength": 2 }],
        "images": [{ "uri": "../shared/wood%20grain.png" }],
        "textures": [{ "source": 0 }],
    });
    let path = folder.path().join("model/m.gltf");
    std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
    let written = folder.path().join("out/m.glb");
    let refused = Document::open(&path).unwrap().write(&written).unwrap_err().to_string();
    assert!(refused.contains("outside of the model's folder"), "{refused}");
    Document::open_allowing(&path, &[folder.path().join("shared")]).unwrap().write(&written).unwrap();

    let again = Document::open(&written).unwrap();
    assert_eq!(again.json()["buffers"], json!([{ "byteLength": 11 }]));
    assert_eq!(again.json()["bufferViews"][1], json!({ "buffer": 0, "byteOffset": 9, "byteLength": 2 }));
    let bytes = std::fs::read(&written).unwrap();
    assert_eq!(&bytes[bytes.len() - 12..], [1, 2, 3, 4, 5, 0, 0, 0, 6, 7, 8, 0]);
    assert_eq!(again.json()["images"], json!([{ "uri": "wood%20grain.png" }]));
    assert_eq!(std::fs::read(folder.path().join("out/wood grain.png")).unwrap(), b"wood");
}

/// Files of other folders lose those folders, and what has the same name there must not lose its content.
#[test]
fn files_of_one_name_in_two_folders_become_one() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a", "b", "c", "model", "out"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    for (file, content) in [("a/n.png", "a"), ("b/n.png", "b"), ("c/n.png", "a"), ("model/N_2.png", "own")] {
        std::fs::write(folder.path().join(file), content).unwrap();
    }
    let uris = ["../a/n.png", "../b/n.png", "../c/n.png", "N_2.png"];
    let textures: Vec<Value> = (0..uris.len()).map(|image| json!({ "source": image })).collect();
    let json = json!({
        "asset": { "version": "2.0" },
        "images": uris.map(|uri| json!({ "uri": uri })),
        "textures": textures,
    });
    let path = folder.path().join("model/m.gltf");
    std::fs::write(&path, serde_json::to_vec(&json).unwrap()).unwrap();
    let written = folder.path().join("out/m.gltf");
    let allowed = ["a", "b", "c"].map(|name| folder.path().join(name));
    Document::open_allowing(&path, &allowed).unwrap().write(&written).unwrap();
    let again = Document::open(&written).unwrap();
    let mut names = Vec::new();
    for (i, uri) in uris.iter().enumerate() {
        let wanted = std::fs::read(folder.path().join("model").join(uri)).unwrap();
        assert_eq!(*again.image_bytes(i).unwrap(), *wanted, "{uri}");
        names.push(again.json()["images"][i]["uri"].as_str().unwrap().to_lowercase());
    }
    // The same content is one file.
    assert_eq!(names[0], names[2]);
    assert!(names[0] != names[1] && names[1] != names[3], "{names:?}");
}

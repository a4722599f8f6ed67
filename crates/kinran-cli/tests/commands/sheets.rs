//! Flags of the commands that draw sheets of pictures.

use std::collections::BTreeMap;
use std::f32::consts::{FRAC_1_SQRT_2 as HALF, TAU};
use std::path::Path;

use kinran_image::encode_png;
use serde_json::json;

use crate::common::{bumps, kinran, refused, text};

/// Two links of a chain, tori of 12 and 4 mm with a normal map: each casts shadows on the other.
fn links() -> Vec<u8> {
    const COLUMNS: u32 = 32;
    const ROWS: u32 = 16;
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (j, i) in (0..=ROWS).flat_map(|j| (0..=COLUMNS).map(move |i| (j, i))) {
        // Both sides of a seam stand at the same place, bit by bit.
        let around = TAU * (i % COLUMNS) as f32 / COLUMNS as f32;
        let tube = TAU * (j % ROWS) as f32 / ROWS as f32;
        let n = [around.sin() * tube.cos(), around.cos() * tube.cos(), tube.sin()];
        positions.extend([
            0.012 * around.sin() + 0.004 * n[0],
            0.012 * around.cos() + 0.004 * n[1],
            0.004 * n[2],
        ]);
        normals.extend(n);
        uvs.extend([4.0 * i as f32 / COLUMNS as f32, 2.0 * j as f32 / ROWS as f32]);
        if i < COLUMNS && j < ROWS {
            let (a, b) = (j * (COLUMNS + 1) + i, (j + 1) * (COLUMNS + 1) + i);
            indices.extend([a, b, b + 1, a, b + 1, a + 1]);
        }
    }
    let floats = |floats: &[f32]| floats.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let mut parts = vec![floats(&positions), floats(&normals), floats(&uvs)];
    parts.push(indices.iter().flat_map(|i| i.to_le_bytes()).collect());
    parts.push(encode_png(&bumps()).unwrap());
    let (mut bin, mut views) = (Vec::new(), Vec::new());
    for part in parts {
        views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": part.len() }));
        bin.extend(part);
        bin.resize(bin.len().next_multiple_of(4), 0);
    }
    let vertices = positions.len() / 3;
    let mut json = json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0, 1] }],
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [0.012, 0, 0], "rotation": [HALF, 0, 0, HALF] }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
        }] }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.0 }, "normalTexture": { "index": 0 } }],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": 4, "mimeType": "image/png" }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3",
              "min": [-0.016, -0.016, -0.004], "max": [0.016, 0.016, 0.004] },
            { "bufferView": 1, "componentType": 5126, "count": vertices, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": vertices, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5125, "count": indices.len(), "type": "SCALAR" }
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len() }]
    })
    .to_string()
    .into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let words = [2, 12 + 8 + json.len() + 8 + bin.len(), json.len()];
    let words = words.iter().flat_map(|&n| (n as u32).to_le_bytes());
    let head: Vec<u8> = b"glTF".iter().copied().chain(words).chain(*b"JSON").collect();
    [&head[..], &json, &(bin.len() as u32).to_le_bytes(), b"BIN\0", &bin].concat()
}

/// Flags that frame no picture and change none, or whose values make no other one here.
const OTHERS: [&str; 12] = [
    "output",
    "sheet",
    "allow-outside",
    "camera",
    // Held beside the reference elsewhere.
    "backend",
    // On a torus both ways to find curvature agree.
    "curvature-method",
    // Of every command.
    "threads",
    "quiet",
    "verbose",
    "json",
    "force",
    "help",
];

/// A value that is not the default.
fn value(flag: &clap::Arg) -> Option<&'static str> {
    let values = BTreeMap::from([
        ("size", "32x32"),
        ("spp", "2"),
        ("env", "none"),
        ("env-rotation", "90"),
        ("exr-layer", "left"),
        ("env-samples", "4"),
        ("light", "1,0.4,0.2"),
        ("background", "0.5,0,0"),
        ("from", "1,0.4,0.6"),
        ("fov", "60"),
        ("distance", "2"),
        ("exposure", "1"),
        ("tonemap", "none"),
        ("detail", "target"),
        ("skin-curvature", "zero"),
        ("skin-penumbra", "4"),
        ("skin-normals", "1,1,1"),
        ("base", "0.2,0.5,0.2"),
        ("unit-mm", "300"),
        ("crop", "0,0,0.5,0.5"),
        ("curvature-blur", "none"),
        ("density", "0.6"),
        ("spread", "0.6"),
        ("tilt", "60"),
        ("color", "0.1,0.5,0.1"),
        ("roughness", "0.2"),
        ("direction", "swirl"),
    ]);
    let name = flag.get_long().unwrap();
    match flag.get_action().takes_values() {
        true => Some(values.get(name).unwrap_or_else(|| panic!("no value for --{name}"))),
        false => None,
    }
}

/// On each sheet alone every flag makes another picture, or is refused by its name.
fn walk(command: &str, sheets: &[&str], env: &str) {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("links.glb");
    std::fs::write(&model, links()).unwrap();
    let draw = |out: &Path, sheets: &str, flags: &[String]| {
        let fixed = [command, text(&model), "-o", text(out), "--sheet", sheets];
        let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
        let given = |name: &str| flags.iter().any(|flag| flag.starts_with(name));
        let size: &[&str] = if given("--size") { &[] } else { &["--size", "40x32"] };
        // Tensors have no samples, and are refused with any.
        let samples: &[&str] = if given("--spp") || sheets == "tensors" { &[] } else { &["--spp", "1"] };
        kinran(&[&fixed[..], size, samples, &flags].concat())
    };
    let drawn = |out: &Path, sheet: &str| std::fs::read(out.join(format!("{sheet}.png"))).unwrap();
    let plain = folder.path().join("plain");
    let said = draw(&plain, &sheets.join(","), &[]);
    assert_eq!(said.code, Some(0), "{}", said.err);

    let program = kinran_cli::cli::command();
    let arguments = program.find_subcommand(command).unwrap().get_arguments();
    let mut tried = 0;
    for flag in arguments.filter(|flag| flag.get_long().is_some_and(|name| !OTHERS.contains(&name))) {
        let name = flag.get_long().unwrap();
        // What is so anyway.
        if name == "shadows" {
            continue;
        }
        let word = match value(flag) {
            Some("none") if name == "env" => format!("--env={env}"),
            Some(value) => format!("--{name}={value}"),
            None => format!("--{name}"),
        };
        let out = folder.path().join(name);
        let all = draw(&out, &sheets.join(","), std::slice::from_ref(&word));
        let is_drawn = match all.code {
            Some(0) => true,
            code => {
                assert!(code == Some(2) && all.err.contains(&format!("--{name}")), "{word}: {}", all.err);
                false
            }
        };
        for sheet in sheets {
            if is_drawn && drawn(&out, sheet) != drawn(&plain, sheet) {
                continue;
            }
            let alone = draw(&out, sheet, std::slice::from_ref(&word));
            assert!(
                alone.code == Some(2) && alone.err.contains(&format!("--{name}")),
                "{command}: {word} shows nothing on {sheet} and is taken in silence: {}",
                alone.err
            );
        }
        tried += 1;
    }
    assert!(tried > 15, "only {tried} flags");
}

#[test]
fn a_flag_shows_nothing_on_a_sheet_of_skin_and_is_taken_in_silence() {
    walk("skin", &["turn", "curvature", "profiles", "shadows", "normals", "tensors"], "studio");
}

#[test]
fn a_flag_shows_nothing_on_a_sheet_of_fuzz_and_is_taken_in_silence() {
    // Fits for combed fibres take seconds: the sheet of spreads is as those of density and tilt.
    walk("fuzz", &["attenuation", "density", "tilt", "value", "light", "probe", "simple"], "none");
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("links.glb");
    std::fs::write(&model, links()).unwrap();
    refused(&["fuzz", text(&model), "--sheet", "spread", "--spread", "0.6"], &["--spread", "density"]);
}

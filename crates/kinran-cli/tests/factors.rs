//! A material means the same whether a map is there or not: every factor alone beside the same factor with a map of one
//! texel that changes nothing, in both renderers.

use std::path::Path;
use std::process::Command;

use glam::Vec3;
use kinran_image::{Channels, Image, Pixels, encode_png, read_image};
use serde_json::{Value, json};

/// Texels of one: white, the flat normal, glTF's default anisotropy, and a fibre of tilt 0.7 and azimuth 0.4.
fn neutral(name: &str) -> [f32; 3] {
    match name {
        "white" => [1.0; 3],
        "flat" => [0.5, 0.5, 1.0],
        "along" => [1.0, 0.5, 1.0],
        "fibre" => {
            let (tilt, azimuth) = (0.7_f32, 0.4_f32);
            let fibre = Vec3::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
            (0.5 * fibre + 0.5).to_array()
        }
        other => panic!("no texel {other}"),
    }
}

const TEXELS: [&str; 4] = ["white", "flat", "along", "fibre"];

/// A use of a texel as glTF has it.
fn map(name: &str) -> Value {
    json!({ "index": TEXELS.iter().position(|texel| *texel == name).unwrap() })
}

/// Puts `value` at a path of keys.
fn put(material: &mut Value, path: &str, value: Value) {
    let mut place = material;
    for key in path.split('/') {
        place = &mut place[key];
    }
    *place = value;
}

/// What is tried: a name, a material, and the maps that must not change it, each by its place and its texel.
type Case = (&'static str, Value, Vec<(&'static str, &'static str)>);

fn cases() -> Vec<Case> {
    const ANISOTROPY: &str = "extensions/KHR_materials_anisotropy/anisotropyTexture";
    const ROUGHNESS: &str = "pbrMetallicRoughness/metallicRoughnessTexture";
    let anisotropy = |rotation: f64| {
        json!({ "extensions": { "KHR_materials_anisotropy":
            { "anisotropyStrength": 0.9, "anisotropyRotation": rotation } } })
    };
    let fuzz = |fuzz: Value| json!({ "extensions": { "KINRAN_materials_fuzz": fuzz } });
    let sheen = json!({ "extensions": { "KHR_materials_sheen":
        { "sheenColorFactor": [0.9, 0.5, 0.3], "sheenRoughnessFactor": 0.6 } } });
    let transmission = json!({ "extensions": { "KHR_materials_diffuse_transmission":
        { "diffuseTransmissionFactor": 0.4, "diffuseTransmissionColorFactor": [0.2, 0.9, 0.4] } } });
    let glow = json!({ "emissiveFactor": [0.3, 0.2, 0.1],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 1.5 } } });
    let skin = json!({ "extensions": { "KINRAN_materials_skin":
        { "secondLobe": { "share": 0.4, "roughness": 0.2 }, "normalBlur": [0.9, 0.6, 0.2] } } });
    let dielectric = json!({ "extensions": { "KHR_materials_ior": { "ior": 1.9 },
        "KHR_materials_specular": { "specularFactor": 0.8, "specularColorFactor": [0.4, 1.0, 3.0] } } });
    let normal = ("normalTexture", "flat");
    vec![
        ("base colour", json!({}), vec![("pbrMetallicRoughness/baseColorTexture", "white")]),
        ("roughness and metallic", json!({}), vec![(ROUGHNESS, "white")]),
        ("a flat normal map", json!({}), vec![normal]),
        ("a flat normal map and roughness", json!({}), vec![normal, (ROUGHNESS, "white")]),
        ("anisotropy", anisotropy(0.0), vec![(ANISOTROPY, "along")]),
        ("anisotropy, turned", anisotropy(0.8), vec![(ANISOTROPY, "along")]),
        ("anisotropy beside a normal map", anisotropy(0.8), vec![normal]),
        ("anisotropy beside roughness", anisotropy(0.8), vec![(ROUGHNESS, "white")]),
        ("anisotropy beside all", anisotropy(0.8), vec![normal, (ROUGHNESS, "white"), (ANISOTROPY, "along")]),
        (
            "anisotropy beside base colour",
            anisotropy(0.8),
            vec![("pbrMetallicRoughness/baseColorTexture", "white")],
        ),
        ("emission", glow, vec![("emissiveTexture", "white")]),
        ("occlusion", json!({}), vec![("occlusionTexture", "white")]),
        (
            "diffuse transmission",
            transmission,
            vec![
                ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionTexture", "white"),
                ("extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorTexture", "white"),
            ],
        ),
        (
            "no transmission",
            json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 0 } } }),
            vec![normal],
        ),
        ("sheen", sheen.clone(), vec![("extensions/KHR_materials_sheen/sheenColorTexture", "white")]),
        ("sheen beside a normal map", sheen, vec![normal]),
        (
            "fuzz",
            fuzz(json!({ "density": 0.8, "tilt": 0.7, "azimuth": 0.4, "fiberColorFactor": [0.9, 0.6, 0.3] })),
            vec![
                ("extensions/KINRAN_materials_fuzz/densityTexture", "white"),
                ("extensions/KINRAN_materials_fuzz/fiberColorTexture", "white"),
            ],
        ),
        (
            "direction of fuzz",
            fuzz(json!({ "density": 0.8, "tilt": 0.7, "azimuth": 0.4 })),
            vec![("extensions/KINRAN_materials_fuzz/directionTexture", "fibre")],
        ),
        ("fuzz beside a normal map", fuzz(json!({ "density": 0.8, "tilt": 0.7 })), vec![normal]),
        (
            "fuzziness",
            fuzz(json!({ "fuzziness": 0.7 })),
            vec![("extensions/KINRAN_materials_fuzz/fuzzinessTexture", "white")],
        ),
        ("skin beside a normal map", skin, vec![normal]),
        (
            "a dielectric",
            dielectric.clone(),
            vec![
                ("extensions/KHR_materials_specular/specularTexture", "white"),
                ("extensions/KHR_materials_specular/specularColorTexture", "white"),
            ],
        ),
        ("a dielectric beside a normal map", dielectric, vec![normal]),
        (
            "a dielectric as it is by default",
            json!({ "extensions": { "KHR_materials_ior": {} } }),
            vec![normal],
        ),
    ]
}

const COLUMNS: usize = 6;

/// Spheres of radius 0.45 in cells of one metre; their files go to `folder`.
fn model(folder: &Path, materials: Vec<Value>) -> Vec<u8> {
    let (around, along) = (24, 16);
    let (mut positions, mut normals, mut uvs, mut indices) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for j in 0..=along {
        for i in 0..=around {
            let (theta, phi) = (
                j as f32 / along as f32 * std::f32::consts::PI,
                i as f32 / around as f32 * std::f32::consts::TAU,
            );
            let n = Vec3::new(theta.sin() * phi.cos(), theta.cos(), -theta.sin() * phi.sin());
            normals.extend(n.to_array());
            positions.extend((0.45 * n).to_array());
            uvs.extend([i as f32 / around as f32, j as f32 / along as f32]);
            if i < around && j < along {
                let a = (j * (around + 1) + i) as u32;
                let below = a + around as u32 + 1;
                indices.extend([a, below, a + 1, a + 1, below, below + 1]);
            }
        }
    }
    let count = positions.len() / 3;
    let mut bin: Vec<u8> = Vec::new();
    let mut views = Vec::new();
    for part in [&positions, &normals, &uvs] {
        views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": part.len() * 4 }));
        bin.extend(part.iter().flat_map(|x| x.to_le_bytes()));
    }
    views.push(json!({ "buffer": 0, "byteOffset": bin.len(), "byteLength": indices.len() * 4 }));
    bin.extend(indices.iter().flat_map(|i: &u32| i.to_le_bytes()));

    for name in TEXELS {
        let texel = neutral(name).map(|x| (x * 65535.0).round() as u16);
        let image = Image::new(1, 1, Channels::Rgb, Pixels::U16(texel.to_vec())).unwrap();
        std::fs::write(folder.join(format!("{name}.png")), encode_png(&image).unwrap()).unwrap();
    }
    std::fs::write(folder.join("spheres.bin"), &bin).unwrap();
    let places: Vec<Value> = (0..materials.len())
        .map(|i| json!({ "mesh": i, "translation": [i % COLUMNS, -((i / COLUMNS) as f32), 0] }))
        .collect();
    let meshes: Vec<Value> = (0..materials.len())
        .map(|i| {
            json!({ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": i }] })
        })
        .collect();
    let used = [
        "KHR_materials_anisotropy",
        "KHR_materials_diffuse_transmission",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_sheen",
        "KHR_materials_transmission",
        "KINRAN_materials_fuzz",
        "KINRAN_materials_skin",
    ];
    let accessor =
        |view, kind| json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
    let document = json!({
        "asset": { "version": "2.0" },
        "extensionsUsed": used,
        "scenes": [{ "nodes": (0..materials.len()).collect::<Vec<_>>() }],
        "nodes": places,
        "meshes": meshes,
        "materials": materials,
        "textures": (0..TEXELS.len()).map(|i| json!({ "source": i })).collect::<Vec<_>>(),
        "images": TEXELS.map(|name| json!({ "uri": format!("{name}.png") })),
        "accessors": [accessor(0, "VEC3"), accessor(1, "VEC3"), accessor(2, "VEC2"),
            { "bufferView": 3, "componentType": 5125, "count": indices.len(), "type": "SCALAR" }],
        "bufferViews": views,
        "buffers": [{ "byteLength": bin.len(), "uri": "spheres.bin" }],
    });
    serde_json::to_vec(&document).unwrap()
}

/// Linear pixels of a model, 32 for each metre, in direct light or in the studio.
fn picture(model: &Path, backend: &str, size: (usize, usize), env: &str) -> Vec<[f32; 3]> {
    let output = model.with_extension(format!("{backend}.exr"));
    let size = format!("{}x{}", size.0, size.1);
    let run = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["--quiet", "render", model.to_str().unwrap(), "-o", output.to_str().unwrap()])
        .args(["--backend", backend, "--size", &size, "--spp", "4", "--env", env])
        .args(["--env-samples", "4"].into_iter().filter(|_| env != "none"))
        .args(["--light", "0.5,0.6,0.6", "--light", "-0.7,-0.2,0.4", "--no-shadows", "--from", "0,0,1"])
        .args(["--fov", "10", "--filter", "ml"])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let Pixels::F32(samples) = read_image(&output).unwrap().pixels else { panic!("{}", output.display()) };
    samples.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

fn differences(backend: &str) {
    let cases = cases();
    let base = |material: &Value| {
        let mut material = material.clone();
        material["pbrMetallicRoughness"] =
            json!({ "baseColorFactor": [0.8, 0.5, 0.2, 1], "metallicFactor": 0.3, "roughnessFactor": 0.35 });
        material
    };
    let bare: Vec<Value> = cases.iter().map(|(_, material, _)| base(material)).collect();
    let mapped: Vec<Value> = cases
        .iter()
        .map(|(_, material, maps)| {
            let mut material = base(material);
            maps.iter().for_each(|(path, texel)| put(&mut material, path, map(texel)));
            material
        })
        .collect();
    let folder = tempfile::tempdir().unwrap();
    let rows = cases.len().div_ceil(COLUMNS);
    let size = (32 * COLUMNS, 32 * rows);
    let models = [("bare", bare), ("mapped", mapped)].map(|(name, materials)| {
        let path = folder.path().join(format!("{name}.gltf"));
        std::fs::write(&path, model(folder.path(), materials)).unwrap();
        path
    });
    let shot = |env: &str| models.each_ref().map(|path| picture(path, backend, size, env));
    let ([bare, mapped], [bare_in_studio, mapped_in_studio]) = (shot("none"), shot("studio"));
    assert!(bare.iter().flatten().any(|&x| x > 0.5), "{backend}: the picture is dark");
    // The whole grid fills the picture but for a margin, so that a cell is found by its share.
    for (i, (name, ..)) in cases.iter().enumerate() {
        let mut worst = (0.0_f32, [0.0; 3], [0.0; 3]);
        let mut brightest = 0.0_f32;
        let mut sums = [Vec3::ZERO; 2];
        for y in size.1 * (i / COLUMNS) / rows..size.1 * (i / COLUMNS + 1) / rows {
            for x in size.0 * (i % COLUMNS) / COLUMNS..size.0 * (i % COLUMNS + 1) / COLUMNS {
                let at = y * size.0 + x;
                let (a, b) = (bare[at], mapped[at]);
                sums[0] += Vec3::from(bare_in_studio[at]);
                sums[1] += Vec3::from(mapped_in_studio[at]);
                brightest = a.iter().fold(brightest, |m, &x| m.max(x));
                let apart = Vec3::from(a).distance(b.into());
                if apart > worst.0 {
                    worst = (apart, a, b);
                }
            }
        }
        // Half floats and texels of sixteen bits hold a factor to a part in two thousand; lobes are steeper than that.
        assert!(
            worst.0 <= 0.02 * brightest,
            "{backend}: {name}: without maps {:?}, with maps that change nothing {:?}, brightest {brightest}",
            worst.1,
            worst.2
        );
        // A normal map turns the frame in which the studio's light is sampled, so single pixels have other noise; 2 % is
        // twice what it leaves of a sphere's mean.
        let [bare, mapped] = sums;
        assert!(
            (bare - mapped).abs().max_element() <= 0.02 * bare.max_element(),
            "{backend}: {name}, in the studio: without maps {bare}, with maps that change nothing {mapped}"
        );
    }
}

#[test]
fn a_map_that_changes_nothing_changes_the_reference_picture() {
    differences("cpu");
}

#[test]
#[cfg(feature = "gpu")]
fn a_map_that_changes_nothing_changes_the_realtime_picture() {
    differences("gpu");
}

//! `kinran bake`, run as people run it on tiny folders and models.
#![allow(
    clippy::print_stdout,
    clippy::needless_range_loop,
    reason = "measured numbers; several arrays by one index"
)]

#[allow(dead_code, reason = "shared with the other commands' tests")]
#[path = "commands/common.rs"]
mod common;
#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{bumps, files, glb, glb_with, kinran, kinran_json, refused, square, text};
use kinran_image::{
    Channels, Format, Image, Pixels, Texture, Transfer, decode_image, encode_png, read_image, read_texture,
};
use sample_assets::sample_assets;
use serde_json::{Value, json};

fn write(folder: &Path, name: &str, image: &Image) {
    std::fs::write(folder.join(name), encode_png(image).unwrap()).unwrap();
}

/// An image of `side`² texels from a formula.
fn image(side: u32, channels: Channels, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
    let samples = (0..side)
        .flat_map(|y| (0..side).map(move |x| (x, y)))
        .flat_map(|(x, y)| texel(x, y)[..channels.count()].to_vec())
        .collect();
    Image::new(side, side, channels, Pixels::U8(samples)).unwrap()
}

/// A folder of maps as Poly Haven names them.
fn cloth(side: u32) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let scaled = bumps();
    let bump = |x: u32, y: u32| scaled.texel(x % 32, y % 32).map(|v| (v * 255.0).round() as u8);
    write(folder.path(), "cloth_nor_gl.png", &image(side, Channels::Rgb, bump));
    let arm = |x: u32, y: u32| [(x * 7 % 256) as u8, (60 + (x * y) % 120) as u8, (y * 5 % 256) as u8, 255];
    write(folder.path(), "cloth_arm.png", &image(side, Channels::Rgb, arm));
    let diff = |x: u32, y: u32| [(x * 3 % 256) as u8, 90, (y * 3 % 256) as u8, 255];
    write(folder.path(), "cloth_diff.png", &image(side, Channels::Rgb, diff));
    folder
}

fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    files(folder).into_iter().map(|f| (f.clone(), std::fs::read(folder.join(&f)).unwrap())).collect()
}

fn hash(path: &Path) -> String {
    blake3::hash(&std::fs::read(path).unwrap()).to_hex().to_string()
}

#[test]
fn a_folder_gives_files_that_do_not_decode() {
    let input = cloth(32);
    let out = tempfile::tempdir().unwrap();
    let args = ["bake", text(input.path()), "-o", text(out.path()), "--form", "both", "--container", "both"];
    kinran_json(&args);
    let wanted = ["aniso", "anisotropy", "color", "normal", "orm"];
    let wanted: Vec<String> = std::iter::once("cloth.kinran.json".to_owned())
        .chain(wanted.iter().flat_map(|map| ["dds", "ktx2"].map(|e| format!("cloth_{map}.{e}"))))
        .collect();
    assert_eq!(files(out.path()), wanted);

    for (map, format, transfer) in [
        ("normal", Format::Bc5, Transfer::Linear),
        ("aniso", Format::Bc7, Transfer::Linear),
        ("orm", Format::Bc7, Transfer::Linear),
        ("anisotropy", Format::Bc7, Transfer::Linear),
        ("color", Format::Bc7, Transfer::Srgb),
    ] {
        let read = |e: &str| -> Texture {
            let texture = read_texture(&out.path().join(format!("cloth_{map}.{e}"))).unwrap();
            texture.check().unwrap();
            texture
        };
        let (ktx2, dds) = (read("ktx2"), read("dds"));
        assert_eq!((ktx2.format, ktx2.transfer, ktx2.levels.len()), (format, transfer, 6), "{map}");
        assert_eq!((ktx2.levels[0].width, ktx2.levels[0].height), (32, 32), "{map}");
        assert_eq!(ktx2.metadata.get("KinranMap").map(String::as_str), Some(map));
        assert_eq!(ktx2.metadata.get("KinranFilter").map(String::as_str), Some("ml"));
        assert!(ktx2.levels == dds.levels && ktx2.format == dds.format, "{map}: DDS holds something else");
    }

    let report: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("cloth.kinran.json")).unwrap()).unwrap();
    assert_eq!((&report["filter"], &report["kernel"]), (&json!("ml"), &json!("box")));
    assert_eq!(report["kinran"], env!("CARGO_PKG_VERSION"));
    let surface = &report["surfaces"][0];
    assert_eq!(surface["name"], "cloth");
    let inputs = surface["inputs"].as_array().unwrap();
    assert_eq!(inputs.len(), 3, "{inputs:?}");
    for input_file in inputs {
        let path = input.path().join(input_file["file"].as_str().unwrap());
        assert_eq!(input_file["blake3"], hash(&path), "{input_file}");
        assert_eq!((&input_file["width"], &input_file["height"]), (&json!(32), &json!(32)));
    }
    let outputs = surface["outputs"].as_array().unwrap();
    assert_eq!(outputs.len(), 10);
    for output in outputs {
        let path = out.path().join(output["file"].as_str().unwrap());
        assert_eq!(output["blake3"], hash(&path), "{output}");
        assert_eq!(output["bytes"], std::fs::metadata(&path).unwrap().len(), "{output}");
        assert_eq!(output["levels"], 6, "{output}");
    }
    let levels = surface["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 6);
    for level in levels {
        for key in ["ndf_l2", "normal_rms_degrees", "normal_max_degrees", "alpha_t_rms", "alpha_b_rms"] {
            assert!(level[key].as_f64().is_some_and(|v| v >= 0.0), "{key} in {level}");
        }
    }
    assert!(!report.to_string().contains(text(input.path())), "the report holds a path: {report}");
}

#[test]
fn two_runs_give_other_bytes() {
    let input = cloth(64);
    let (_folder, model) = square();
    for source in [input.path(), &model] {
        let run = |threads: &str| {
            let out = tempfile::tempdir().unwrap();
            let args = ["bake", text(source), "-o", text(out.path()), "--form", "both", "--threads", threads];
            let said = kinran(&args);
            assert_eq!(said.code, Some(0), "{}", said.err);
            contents(out.path())
        };
        let first = run("1");
        assert!(first.len() > 3);
        for threads in ["1", "2", "8"] {
            let again = run(threads);
            assert_eq!(first.keys().collect::<Vec<_>>(), again.keys().collect::<Vec<_>>());
            for (name, bytes) in &first {
                assert!(*bytes == again[name], "{name} differs with {threads} threads");
            }
        }
    }
}

/// The square of [`glb`] as a .gltf beside its buffer, with every material feature that must survive.
fn anisotropic_model(folder: &Path) -> PathBuf {
    let glb = glb();
    let json_length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let mut document: Value = serde_json::from_slice(&glb[20..20 + json_length]).unwrap();
    std::fs::write(folder.join("square.bin"), &glb[20 + json_length + 8..]).unwrap();
    document["buffers"][0]["uri"] = json!("square.bin");
    document["images"] =
        json!([{ "uri": "bumps.png" }, { "uri": "orm.png", "extras": { "from": "painter" } }]);
    document["bufferViews"].as_array_mut().unwrap().truncate(4);
    document["samplers"] = json!([{ "wrapS": 33071, "wrapT": 33648 }]);
    document["textures"] =
        json!([{ "source": 0, "sampler": 0 }, { "source": 1, "sampler": 0, "name": "orm" }]);
    document["materials"] = json!([{
        "name": "hammered",
        "pbrMetallicRoughness": {
            "metallicFactor": 0.9, "roughnessFactor": 0.8, "metallicRoughnessTexture": { "index": 1 }
        },
        "normalTexture": { "index": 0, "scale": 0.5 },
        "occlusionTexture": { "index": 1, "strength": 0.7 },
        "extensions": {
            "KHR_materials_anisotropy": { "anisotropyStrength": 0.6, "anisotropyRotation": 0.5 },
            "KHR_materials_clearcoat": { "clearcoatFactor": 0.25 },
            "EXT_made_up": { "depth": [1, 2, { "three": true }] }
        },
        "extras": { "kept": "yes" }
    }]);
    document["extensionsUsed"] =
        json!(["KHR_materials_anisotropy", "KHR_materials_clearcoat", "EXT_made_up"]);
    document["extras"] = json!({ "author": "me" });
    write(folder, "bumps.png", &bumps());
    let orm = |x: u32, y: u32| [(x * 7) as u8, (100 + x + 2 * y) as u8, (255 - y * 7) as u8, 255];
    write(folder, "orm.png", &image(32, Channels::Rgb, orm));
    let path = folder.join("square.gltf");
    std::fs::write(&path, serde_json::to_vec(&document).unwrap()).unwrap();
    path
}

#[test]
fn a_baked_model_means_something_else() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path()), "--container", "both"]);

    let document: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("square.gltf")).unwrap()).unwrap();
    let material = &document["materials"][0];
    let pbr = &material["pbrMetallicRoughness"];
    // What is in the textures now is no factor any more; the rest stays.
    assert!(pbr.get("roughnessFactor").is_none_or(|v| *v == json!(1.0)), "{pbr}");
    assert_eq!(pbr["metallicFactor"], 0.9);
    assert!(material["normalTexture"].get("scale").is_none_or(|v| *v == json!(1.0)), "{material}");
    let anisotropy = &material["extensions"]["KHR_materials_anisotropy"];
    assert_eq!(anisotropy["anisotropyStrength"], json!(1.0));
    assert!(anisotropy.get("anisotropyRotation").is_none_or(|v| *v == json!(0.0)), "{anisotropy}");
    assert_eq!(material["extensions"]["KHR_materials_clearcoat"], json!({ "clearcoatFactor": 0.25 }));
    assert_eq!(material["extensions"]["EXT_made_up"], json!({ "depth": [1, 2, { "three": true }] }));
    assert_eq!(
        (&material["extras"], &document["extras"]),
        (&json!({ "kept": "yes" }), &json!({ "author": "me" }))
    );
    // Packed it was and packed it stays.
    assert_eq!(material["occlusionTexture"]["index"], pbr["metallicRoughnessTexture"]["index"]);
    assert_eq!(material["occlusionTexture"]["strength"], 0.7);

    // Each texture has a PNG for viewers without extensions and both containers, all of which exist.
    let uri = |index: &Value| {
        let uri = document["images"][index.as_u64().unwrap() as usize]["uri"].as_str().unwrap();
        out.path().join(uri)
    };
    let texture = |info: &Value| {
        let texture = &document["textures"][info["index"].as_u64().unwrap() as usize];
        assert_eq!(document["samplers"][texture["sampler"].as_u64().unwrap() as usize]["wrapS"], 33071);
        let extension = |name: &str| uri(&texture["extensions"][name]["source"]);
        let ktx2 = texture["extensions"].as_object().unwrap().keys().find(|k| !k.contains("dds")).unwrap();
        let (ktx2, dds) =
            (read_texture(&extension(ktx2)).unwrap(), read_texture(&extension("MSFT_texture_dds")).unwrap());
        assert!(ktx2.levels == dds.levels);
        (ktx2, read_image(&uri(&texture["source"])).unwrap())
    };
    let (normal, normal_png) = texture(&material["normalTexture"]);
    let (orm, orm_png) = texture(&pbr["metallicRoughnessTexture"]);
    let (lobe, lobe_png) = texture(&anisotropy["anisotropyTexture"]);

    // Level 0 and the fallbacks, texel by texel, against the factors applied here.
    let (authored, packed) = (bumps(), read_image(&folder.path().join("orm.png")).unwrap());
    let levels = [normal, orm, lobe].map(|t| t.decode_level(0).unwrap());
    let (mut worst_normal, mut sums) = (0.0_f32, [0.0_f32; 3]);
    for i in 0..32 * 32 {
        let (x, y) = (i as u32 % 32, i as u32 / 32);
        let near = |name: &str, got: f32, wanted: f32| {
            assert!((got - wanted).abs() <= 0.51 / 255.0, "{name} of ({x}, {y}): wanted {wanted}, got {got}");
        };
        let [nx, ny, ..] = authored.texel(x, y).map(|v| v * 2.0 - 1.0);
        let nz = (1.0 - nx * nx - ny * ny).sqrt();
        let length = (0.25 * (nx * nx + ny * ny) + nz * nz).sqrt();
        let n = [0.5 * nx / length, 0.5 * ny / length];
        let png = normal_png.texel(x, y);
        for c in 0..2 {
            near("normal.png", png[c], n[c] * 0.5 + 0.5);
            worst_normal = worst_normal.max((levels[0][i][c] - (n[c] * 0.5 + 0.5)).abs());
        }
        let wanted = packed.texel(x, y);
        let png = orm_png.texel(x, y);
        near("occlusion in orm.png", png[0], wanted[0]);
        near("roughness in orm.png", png[1], wanted[1] * 0.8);
        near("metalness in orm.png", png[2], wanted[2]);
        for c in 0..3 {
            sums[c] += (levels[1][i][c] - png[c]).powi(2) / 1024.0;
        }
        // A normal of no tilt turns nothing; others turn the direction by less than 2° here.
        let png = lobe_png.texel(x, y);
        near("strength in anisotropy.png", png[2], 0.6);
        let angle = (png[1] * 2.0 - 1.0).atan2(png[0] * 2.0 - 1.0);
        assert!((angle - 0.5).abs() < 0.01, "direction of ({x}, {y}): wanted 0.5, got {angle}");
    }
    // BC5 and BC7.
    assert!(worst_normal < 0.03, "BC5 normals are {worst_normal} off");
    assert!(sums.iter().all(|s| s.sqrt() < 0.03), "BC7 channels are off by the squares {sums:?}");

    // The program reads its own output.
    let said = kinran(&["inspect", text(&out.path().join("square.gltf")), "--json"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
}

/// Half bright metal, half dull paint, texel by texel, from so far away that a pixel shows many of both: the file with a
/// specular colour, drawn from its own mips, beside the authored maps in many samples.
#[test]
fn a_specular_colour_is_not_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let mut document: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    document["materials"] = json!([{ "normalTexture": { "index": 0, "scale": 0.2 },
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 2 }, "metallicRoughnessTexture": { "index": 1 } } }]);
    document["textures"].as_array_mut().unwrap().push(json!({ "source": 2, "sampler": 0 }));
    document["images"].as_array_mut().unwrap().push(json!({ "uri": "paint.png" }));
    document["extensionsUsed"] = json!([]);
    std::fs::write(&model, document.to_string()).unwrap();
    let is_metal = |x: u32, y: u32| (x / 2 + y / 2).is_multiple_of(2);
    let orm = |x: u32, y: u32| [255, 150, if is_metal(x, y) { 255 } else { 0 }, 255];
    write(folder.path(), "orm.png", &image(32, Channels::Rgb, orm));
    let paint = |x: u32, y: u32| if is_metal(x, y) { [215, 214, 210, 255] } else { [170, 30, 20, 255] };
    write(folder.path(), "paint.png", &image(32, Channels::Rgb, paint));

    let picture = |model: &Path, name: &str, more: &[&str]| -> Vec<f32> {
        let output = folder.path().join(name).with_extension("exr");
        let words = ["--quiet", "render", text(model), "-o", text(&output), "--size", "8x8", "--env", "none"];
        let said = kinran(&[&words[..], &["--light", "0.3,0.2,1", "--light", "-1,0.5,0.4"], more].concat());
        assert_eq!(said.code, Some(0), "{more:?}: {}", said.err);
        let Pixels::F32(samples) = read_image(&output).unwrap().pixels else { panic!("an EXR of floats") };
        samples
    };
    let truth = picture(&model, "truth", &["--filter", "none", "--spp", "1024"]);
    let norm: f32 = truth.iter().map(|v| v * v).sum();
    let mut errors = Vec::new();
    for (name, flag) in
        [("apart", "--correlated=off"), ("pair", "--force"), ("separate", "--separate-specular")]
    {
        let out = folder.path().join(name);
        let said = kinran(&["bake", text(&model), "-o", text(&out), "--all-textures", flag]);
        assert_eq!(said.code, Some(0), "{flag}: {}", said.err);
        let baked = out.join("square.gltf");
        for backend in ["cpu", "gpu"] {
            let more = ["--backend", backend, "--spp", "64", "--no-shadows"];
            let drawn = picture(&baked, &format!("{name}_{backend}"), &more);
            let square: f32 = truth.iter().zip(&drawn).map(|(a, b)| (a - b) * (a - b)).sum();
            println!("{name}, {backend}: relative L2 {:.4}", (square / norm).sqrt());
            errors.push((square / norm).sqrt());
        }
    }
    let [_, _, pair_cpu, pair_gpu, separate_cpu, separate_gpu] = errors[..] else { panic!("six pictures") };
    assert!(separate_cpu < 0.8 * pair_cpu && separate_gpu < 0.8 * pair_gpu, "{errors:?}");
}

#[test]
fn a_binary_model_loses_its_mesh() {
    let (_folder, model) = square();
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path())]);
    let names = files(out.path());
    assert!(
        names.contains(&"square.glb".into()) && names.contains(&"square.kinran.json".into()),
        "{names:?}"
    );
    for name in names.iter().filter(|n| n.ends_with(".ktx2")) {
        read_texture(&out.path().join(name)).unwrap().check().unwrap();
    }
    let said = kinran_json(&["inspect", text(&out.path().join("square.glb"))]);
    assert!(said.to_string().contains("hammered"), "{said}");
}

#[test]
fn a_dry_run_writes() {
    let input = cloth(32);
    let (_folder, model) = square();
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    for source in [input.path(), &model] {
        let said = kinran(&["bake", text(source), "-o", text(&out), "--dry-run"]);
        assert_eq!(said.code, Some(0), "{}", said.err);
        assert!(!said.out.is_empty());
        assert!(files(parent.path()).is_empty(), "written: {:?}", files(parent.path()));
    }
}

/// The checksum of PNG chunks.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
    })
}

#[test]
fn bad_folders_are_not_named() {
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    let case = |name: &str, files: &[(&str, Vec<u8>)]| -> PathBuf {
        let folder = parent.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        for (file, bytes) in files {
            std::fs::write(folder.join(file), bytes).unwrap();
        }
        folder
    };
    let png = encode_png(&bumps()).unwrap();
    let photo =
        encode_png(&image(32, Channels::Rgb, |x, y| [(x * 8) as u8, (y * 8) as u8, 20, 255])).unwrap();
    // A sound header, as far as it goes, of 2 billion × 2 billion texels.
    let mut absurd = png.clone();
    absurd[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let crc = crc32(&absurd[12..29]);
    absurd[29..33].copy_from_slice(&crc.to_be_bytes());
    let bake = |folder: &Path, parts: &[&str]| refused(&["bake", text(folder), "-o", text(&out)], parts);
    bake(&parent.path().join("missing"), &["missing"]);
    bake(&case("empty", &[]), &["empty"]);
    bake(&case("photo", &[("a_normal_gl.png", photo)]), &["a_normal_gl.png"]);
    bake(&case("truncated", &[("a_normal_gl.png", png[..png.len() / 2].to_vec())]), &["a_normal_gl.png"]);
    bake(&case("absurd", &[("a_normal_gl.png", absurd)]), &["a_normal_gl.png"]);
    bake(&case("nothing", &[("a_normal_gl.png", vec![])]), &["a_normal_gl.png"]);
    assert!(!out.exists() || files(&out).is_empty(), "written: {:?}", files(&out));
}

#[test]
fn bad_models_are_not_named() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    let whole = glb();
    for (name, bytes) in [
        ("truncated.glb", whole[..whole.len() / 2].to_vec()),
        ("head.glb", whole[..11].to_vec()),
        ("nothing.glb", vec![]),
        ("noise.gltf", vec![0x9f; 100]),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        refused(&["bake", text(&path), "-o", text(&out)], &[name]);
        std::fs::remove_file(path).unwrap();
    }
    refused(&["bake", text(&folder.path().join("gone.glb")), "-o", text(&out)], &["gone.glb"]);
    // Over the input, and into what is no folder.
    refused(&["bake", text(&model), "-o", text(folder.path())], &["square.glb"]);
    refused(&["bake", text(&model), "-o", text(&model)], &["square.glb", "is a file"]);
    refused(&["bake", text(&model), "-o", text(&model.join("deeper"))], &["square.glb"]);
    assert_eq!(std::fs::read(&model).unwrap(), whole, "the input has changed");
    let left: Vec<String> = files(folder.path()).into_iter().filter(|f| f != "out").collect();
    assert_eq!(left, ["square.glb"]);
    assert!(!out.exists() || files(&out).is_empty(), "written: {:?}", files(&out));
}

/// The fallback of a baked normal map is called as the authored map here: written into the authored map's
/// folder it would destroy it.
#[test]
fn a_fallback_overwrites_an_authored_map() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let textures = folder.path().join("textures");
    std::fs::create_dir(&textures).unwrap();
    let authored = textures.join("square_hammered_normal.png");
    std::fs::rename(folder.path().join("bumps.png"), &authored).unwrap();
    let document = std::fs::read_to_string(&model).unwrap();
    std::fs::write(&model, document.replace("bumps.png", "textures/square_hammered_normal.png")).unwrap();
    let before = std::fs::read(&authored).unwrap();
    refused(&["bake", text(&model), "-o", text(&textures)], &["square_hammered_normal.png"]);
    assert!(std::fs::read(&authored).unwrap() == before, "the authored map was overwritten");
}

/// Without a normal map the anisotropy map's coordinates and borders are those of the new roughness map.
#[test]
fn a_new_map_lies_on_the_wrong_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let mut document: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    let transform = json!({ "KHR_texture_transform": { "scale": [3.0, 2.0] } });
    document["materials"] = json!([{
        "pbrMetallicRoughness": { "roughnessFactor": 0.4 },
        "extensions": { "KHR_materials_anisotropy": {
            "anisotropyStrength": 0.6, "anisotropyTexture": { "index": 0, "extensions": transform }
        } }
    }]);
    document["extensionsUsed"] = json!(["KHR_materials_anisotropy", "KHR_texture_transform"]);
    std::fs::write(&model, serde_json::to_vec(&document).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path())]);
    let document: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("square.gltf")).unwrap()).unwrap();
    let info = &document["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"];
    assert_eq!(info["extensions"], transform, "{info}");
    let texture = &document["textures"][info["index"].as_u64().unwrap() as usize];
    assert_eq!(
        document["samplers"][texture["sampler"].as_u64().unwrap() as usize]["wrapT"],
        33648,
        "{texture}"
    );
}

#[test]
fn flags_that_make_no_sense_are_accepted() {
    let input = cloth(32);
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    for (flag, value) in [
        ("--filter", "best"),
        ("--kernel", "gauss"),
        ("--edges", "black"),
        ("--form", "gloss"),
        ("--container", "png"),
        ("--zstd", "23"),
        ("--zstd", "-1"),
        ("--normal-format", "bc4"),
        ("--aniso-format", "bc5"),
        ("--color-format", "rgba16f"),
        ("--normal-format", "bc6h"),
        ("--encoder", "fast"),
        ("--preset", "slowest"),
        ("--roughness", "1.5"),
        ("--roughness", "nan"),
        ("--anisotropy", "-0.1"),
        ("--direction-span", "0"),
        ("--map", "normal"),
        ("--map", "shine=cloth_arm.png"),
        ("--map", "gloss-u=gone.png"),
        ("--ignore", "gone.png"),
    ] {
        refused(&["bake", text(input.path()), "-o", text(&out), &format!("{flag}={value}")], &[flag]);
    }
    refused(&["bake", text(input.path()), "-o", text(&out), "--y-up", "--y-down"], &["--y-up"]);
    assert!(files(parent.path()).is_empty(), "written: {:?}", files(parent.path()));
}

/// What a glTF file says itself is nothing that a flag can say.
#[test]
fn flags_about_folders_are_swallowed_by_models() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    for flags in [
        &["--edges", "clamp"][..],
        &["--direction-span", "180"],
        &["--map", "normal=nothing.png"],
        &["--ignore", "nothing.png"],
        &["--roughness", "0.1"],
        &["--anisotropy", "0.9"],
        &["--roughness-is-gloss"],
        &["--force-normal"],
        &["--normal-blue"],
    ] {
        refused(&[&["bake", text(&model), "-o", text(&out)], flags].concat(), &[flags[0], "square.glb"]);
        assert!(!out.exists(), "{flags:?} wrote something");
        // In a library they are a mistake of the entry, and nothing where they are everyone's default.
        let key = flags[0].trim_start_matches("--");
        let value = flags.get(1).map_or("true".into(), |value| format!("\"{value}\""));
        let manifest = folder.path().join("kinran.toml");
        let entry = |own: &str, default: &str| {
            format!("output = \"lib\"\n[defaults]\n{default}\n[[mesh]]\ninput = \"square.glb\"\n{own}\n")
        };
        let setting = format!("{key} = {value}");
        std::fs::write(&manifest, entry(&setting, "")).unwrap();
        let said = kinran(&["bake", text(&manifest), "--dry-run"]);
        assert_eq!(said.code, Some(2), "{key} of an entry: {}", said.err);
        assert!(said.err.contains(key) && said.err.contains("glTF"), "{key} of an entry: {}", said.err);
        std::fs::write(&manifest, entry("", &setting)).unwrap();
        let said = kinran(&["bake", text(&manifest), "--dry-run"]);
        assert_eq!(said.code, Some(0), "{key} as a default: {}", said.err);
    }
}

/// Baked into the folder of its maps, a material is not made from its own textures the next time.
#[test]
fn a_folder_is_baked_from_what_was_baked_into_it() {
    let input = cloth(32);
    let bake = || {
        let flags = ["--container", "both"];
        kinran_json(&[&["bake", text(input.path()), "-o", text(input.path())], &flags[..]].concat())
    };
    let (first, second) = (bake(), bake());
    assert_eq!(first["surfaces"], second["surfaces"]);
    let note = |file: &str| {
        let rows = second["files"].as_array().unwrap();
        rows.iter().find(|row| row["file"] == file).unwrap()["note"].as_str().unwrap().to_owned()
    };
    for file in ["cloth_normal.ktx2", "cloth_aniso.dds", "cloth_color.ktx2"] {
        assert_eq!(note(file), "not used: baked by kinran", "{file}");
    }
}

/// Two folders, and two models, with a material of one name and one place for what is baked.
#[test]
fn a_material_of_another_folder_takes_the_place_of_one() {
    let parent = tempfile::tempdir().unwrap();
    let at = |name: &str| parent.path().join(name);
    let (maps, (_folder, model)) = (cloth(32), square());
    for name in ["a", "b"] {
        std::fs::create_dir(at(name)).unwrap();
        let sources = files(maps.path()).into_iter().map(|file| maps.path().join(file));
        for source in sources.chain([model.clone()]) {
            std::fs::copy(&source, at(name).join(source.file_name().unwrap())).unwrap();
        }
    }
    let model = model.file_name().unwrap();
    for (first, second, file) in [
        (at("a"), at("b"), "cloth.kinran.json"),
        (at("a").join(model), at("b").join(model), "square.kinran.json"),
    ] {
        let out = if first.is_dir() { at("baked") } else { at("models") };
        let bake = |source: &Path, flags: &[&str]| {
            let said = kinran(&[&["bake", text(source), "-o", text(&out)], flags].concat());
            assert_eq!(said.code, Some(0), "{}", said.err);
        };
        bake(&first, &[]);
        let before = contents(&out);
        refused(
            &["bake", text(&second), "-o", text(&out)],
            &[file, text(&first), text(&second), "--output", "--force"],
        );
        assert!(contents(&out) == before, "{} was changed", out.display());

        // The same folder again, with another map in the old one's place.
        if first.is_dir() {
            write(&first, "cloth_diff.png", &image(32, Channels::Rgb, |_, _| [9, 9, 9, 255]));
        }
        bake(&first, &[]);
        bake(&second, &["--force"]);
        bake(&second, &[]);
    }
}

/// What is about meshes and materials is nothing that can be done to a folder of maps.
#[test]
fn flags_about_models_are_swallowed_by_folders() {
    let input = cloth(32);
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    let name = input.path().file_name().unwrap().to_str().unwrap();
    for flags in [
        &["--skin", "all"][..],
        &["--curvature", "all"],
        &["--curvature-method", "fit"],
        &["--curvature-range", "1"],
        &["--curvature-blur", "none"],
        &["--unit-mm", "5"],
        &["--estimate-normals"],
        &["--curvature-dump", "json"],
        &["--all-textures"],
        &["--allow-outside", "."],
    ] {
        refused(&[&["bake", text(input.path()), "-o", text(&out)], flags].concat(), &[flags[0], name]);
        assert!(!out.exists(), "{flags:?} wrote something");
        let key = flags[0].trim_start_matches("--");
        let value = flags.get(1).map_or("true".into(), |value| format!("\"{value}\""));
        let manifest = parent.path().join("kinran.toml");
        let entry = |own: &str, default: &str| {
            let input = text(input.path());
            format!("output = \"lib\"\n[defaults]\n{default}\n[[aniso]]\ninput = \"{input}\"\n{own}\n")
        };
        let setting = format!("{key} = {value}");
        std::fs::write(&manifest, entry(&setting, "")).unwrap();
        let said = kinran(&["bake", text(&manifest), "--dry-run"]);
        assert_eq!(said.code, Some(2), "{key} of an entry: {}", said.err);
        assert!(said.err.contains(key) && said.err.contains("folder"), "{key} of an entry: {}", said.err);
        std::fs::write(&manifest, entry("", &setting)).unwrap();
        let said = kinran(&["bake", text(&manifest), "--dry-run"]);
        assert_eq!(said.code, Some(0), "{key} as a default: {}", said.err);
    }
}

/// Flags about curvature that find no mesh to measure.
#[test]
fn flags_about_curvature_are_swallowed_where_nothing_is_measured() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    for flags in [&["--curvature-method", "fit"][..], &["--unit-mm", "5"], &["--curvature-dump", "json"]] {
        for dry in [&["--dry-run"][..], &[]] {
            let bake = [&["bake", text(&model), "-o", text(&out)], flags, dry];
            let warnings = kinran_json(&bake.concat())["warnings"].to_string();
            assert!(warnings.contains(flags[0]), "{flags:?}: {warnings}");
            let warnings =
                kinran_json(&[&bake.concat()[..], &["--skin", "all"]].concat())["warnings"].to_string();
            assert!(!warnings.contains(flags[0]), "{flags:?}: {warnings}");
        }
    }
}

/// The document of a baked model.
fn baked(out: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(out.join("square.gltf")).unwrap()).unwrap()
}

/// The name of the PNG that a use of a texture has.
fn png(document: &Value, info: &Value) -> String {
    let texture = &document["textures"][info["index"].as_u64().unwrap() as usize];
    document["images"][texture["source"].as_u64().unwrap() as usize]["uri"].as_str().unwrap().into()
}

/// [`anisotropic_model`], changed.
fn changed_model(folder: &Path, change: impl Fn(&mut Value)) -> PathBuf {
    let model = anisotropic_model(folder);
    let mut document: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    document["materials"][0]["extensions"].as_object_mut().unwrap().remove("EXT_made_up");
    document["extensionsUsed"] = json!(["KHR_materials_anisotropy", "KHR_materials_clearcoat"]);
    change(&mut document);
    std::fs::write(&model, serde_json::to_vec(&document).unwrap()).unwrap();
    model
}

/// Normal maps that are not filtered have a green too: those of a clearcoat, and one that lies apart from roughness.
#[test]
fn green_down_stays_down_where_no_filter_comes_by() {
    let folder = tempfile::tempdir().unwrap();
    let authored = bumps();
    let turned = |file: &Path| {
        let image = read_image(file).unwrap();
        (0..32 * 32).all(|i| {
            let (x, y) = (i % 32, i / 32);
            let (wanted, got) = (authored.texel(x, y), image.texel(x, y));
            let wanted = [wanted[0], 1.0 - wanted[1], wanted[2]];
            (0..3).all(|c| (got[c] - wanted[c]).abs() < 1e-3)
        })
    };
    let model = changed_model(folder.path(), |document| {
        document["materials"][0]["extensions"]["KHR_materials_clearcoat"] =
            json!({ "clearcoatFactor": 0.25, "clearcoatNormalTexture": { "index": 0, "scale": 0.5 } });
    });
    for (flag, wanted) in [("--y-down", true), ("--y-up", false)] {
        let out = tempfile::tempdir().unwrap();
        kinran_json(&["bake", text(&model), "-o", text(out.path()), flag]);
        let document = baked(out.path());
        let info =
            &document["materials"][0]["extensions"]["KHR_materials_clearcoat"]["clearcoatNormalTexture"];
        assert_eq!(info["scale"], 0.5, "{info}");
        assert_eq!(turned(&out.path().join(png(&document, info))), wanted, "{flag}");
    }
    let model = changed_model(folder.path(), |document| {
        document["materials"][0]["normalTexture"]["extensions"] =
            json!({ "KHR_texture_transform": { "scale": [3.0, 2.0] } });
    });
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path()), "--y-down"]);
    let document = baked(out.path());
    assert!(turned(&out.path().join(png(&document, &document["materials"][0]["normalTexture"]))));
}

/// A roughness map is filtered as it is under a normal map that is flat.
#[test]
fn roughness_is_filtered_only_where_a_normal_map_happens_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let model = |name: &str, with_normal: bool| {
        let inner = folder.path().join(name);
        std::fs::create_dir(&inner).unwrap();
        let model = changed_model(&inner, |document| {
            let mut material = json!({ "name": "plain", "pbrMetallicRoughness": {
                "metallicFactor": 1.0, "metallicRoughnessTexture": { "index": 1 } } });
            if with_normal {
                material["normalTexture"] = json!({ "index": 0 });
            }
            document["materials"] = json!([material]);
        });
        write(&inner, "bumps.png", &image(1, Channels::Rgb, |_, _| [128, 128, 255, 255]));
        // Perceptual roughness of 51/255 and 204/255, texel by texel.
        let mixed = |x: u32, y: u32| [0, if (x + y).is_multiple_of(2) { 51 } else { 204 }, 255, 255];
        write(&inner, "orm.png", &image(32, Channels::Rgb, mixed));
        model
    };
    let models = [model("bare", false), model("flat", true)];
    let levels = models.each_ref().map(|model| {
        let out = tempfile::tempdir().unwrap();
        let flags = ["--aniso-format", "rgba8", "--filter", "linear"];
        kinran_json(&[&["bake", text(model), "-o", text(out.path())][..], &flags].concat());
        let texture = read_texture(&out.path().join("square_plain_roughness.ktx2")).unwrap();
        (0..texture.levels.len()).map(|level| texture.decode_level(level).unwrap()).collect::<Vec<_>>()
    });
    // Means of squared roughness, of alpha = r² that is r⁴.
    let wanted = ((0.2f32.powi(4) + 0.8f32.powi(4)) / 2.0).powf(0.25);
    for texel in levels[0][1..].iter().flatten() {
        assert!((texel[1] - wanted).abs() < 1.0 / 255.0, "wanted {wanted}, got {texel:?}");
    }
    // A flat texel of 8 bits is not quite flat.
    for (bare, flat) in levels[0].iter().flatten().zip(levels[1].iter().flatten()) {
        assert!((0..4).all(|c| (bare[c] - flat[c]).abs() < 1.5 / 255.0), "without {bare:?}, with {flat:?}");
    }
    // And so it is drawn, from so far that a texel is a pixel's hundredth.
    let pictures = models.each_ref().map(|model| {
        let picture = model.with_extension("png");
        let flags = ["--size", "12x12", "--spp", "16", "--env", "none", "--light", "0.3,0.2,1"];
        let flags = [&flags[..], &["--filter", "linear", "--from", "0,0,1"]].concat();
        let said = kinran(&[&["render", text(model), "-o", text(&picture)], &flags[..]].concat());
        assert_eq!(said.code, Some(0), "{}", said.err);
        read_image(&picture).unwrap()
    });
    let mut brightest = 0.0f32;
    for i in 0..144 {
        let [bare, flat] = pictures.each_ref().map(|picture| picture.texel(i % 12, i / 12));
        brightest = brightest.max(bare[0]);
        assert!((bare[0] - flat[0]).abs() < 4.0 / 255.0, "pixel {i}: without {bare:?}, with {flat:?}");
    }
    assert!(brightest > 0.1, "the picture is dark");
}

#[test]
fn maps_that_lie_apart_are_said_not_to_be_there() {
    let folder = tempfile::tempdir().unwrap();
    let transform =
        |scale: f64| json!({ "KHR_texture_transform": { "rotation": 0.7, "scale": [scale, 2.0] } });
    let model = |roughness: f64| {
        changed_model(folder.path(), |document| {
            let material = &mut document["materials"][0];
            material["extensions"].as_object_mut().unwrap().remove("KHR_materials_anisotropy");
            material["normalTexture"]["extensions"] = transform(3.1);
            material["pbrMetallicRoughness"]["metallicRoughnessTexture"]["extensions"] = transform(roughness);
        })
    };
    let out = tempfile::tempdir().unwrap();
    let bake = |model: &Path| kinran_json(&["bake", text(model), "-o", text(out.path()), "--dry-run"]);
    let apart = bake(&model(3.0));
    let warnings = apart["warnings"].to_string();
    assert!(warnings.contains("another way") && !warnings.contains("no material has"), "{warnings}");
    assert_eq!(apart["surfaces"], json!([]));
    // As one program and another round it.
    for rounded in [3.1 * (1.0 + 1e-7), f64::from(3.1f32)] {
        let same = bake(&model(rounded));
        assert!(!same["warnings"].to_string().contains("another way"), "{rounded}: {}", same["warnings"]);
        assert_eq!(same["surfaces"].as_array().unwrap().len(), 1, "{rounded}");
    }
}

#[test]
fn an_extension_that_a_bake_took_away_is_still_listed() {
    let folder = tempfile::tempdir().unwrap();
    let model = changed_model(folder.path(), |document| {
        document["textures"][0]["extensions"] = json!({ "EXT_texture_webp": { "source": 0 } });
        let used =
            json!(["KHR_materials_anisotropy", "KHR_materials_clearcoat", "EXT_texture_webp", "KHR_xmp"]);
        document["extensionsUsed"] = used;
        document["extensionsRequired"] = json!(["EXT_texture_webp"]);
    });
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path())]);
    let document = baked(out.path());
    let used = document["extensionsUsed"].as_array().unwrap();
    assert!(!used.contains(&json!("EXT_texture_webp")), "{used:?}");
    // What stood in the list alone is not ours to judge.
    for kept in ["KHR_materials_anisotropy", "KHR_materials_clearcoat", "KHR_texture_basisu", "KHR_xmp"] {
        assert!(used.contains(&json!(kept)), "no {kept} in {used:?}");
    }
    assert_eq!(document.get("extensionsRequired"), None);
}

/// The commonest fault of authored glTF: green that points down.
#[test]
fn green_down_in_a_model_is_not_noticed_or_not_turned() {
    // Waves along the diagonal: with z = cos(x + v) the slopes along x and v are the same, and y points against v.
    let waves = |green_up: bool| {
        image(32, Channels::Rgb, move |x, y| {
            let slope = 0.6 * (std::f32::consts::TAU * (x + y) as f32 / 8.0).sin();
            let length = (2.0 * slope * slope + 1.0).sqrt();
            let code = |n: f32| ((n / length * 0.5 + 0.5) * 255.0 + 0.5) as u8;
            let green = code(-slope);
            [code(slope), if green_up { green } else { 255 - green }, code(1.0), 255]
        })
    };
    let folder = tempfile::tempdir().unwrap();
    let [model, wrong] = [("right", true), ("wrong", false)].map(|(name, green_up)| {
        let path = folder.path().join(format!("{name}.glb"));
        std::fs::write(&path, glb_with(&waves(green_up))).unwrap();
        path
    });
    let bake = |model: &Path, flags: &[&str]| {
        let out = folder.path().join("out");
        let report = kinran_json(
            &[&["bake", text(model), "-o", text(&out), "--normal-format", "rgba8"], flags].concat(),
        );
        let stem = model.file_stem().unwrap().to_str().unwrap();
        let texture = read_texture(&out.join(format!("{stem}_hammered_normal.ktx2"))).unwrap();
        (
            report["warnings"].to_string(),
            texture.decode_level(0).unwrap(),
            out.join(format!("{stem}_hammered_normal.png")),
        )
    };
    let (said, wanted, _) = bake(&model, &[]);
    assert!(!said.contains("green"), "{said}");
    let (said, as_it_is, _) = bake(&wrong, &[]);
    assert!(said.contains("--y-down") && said.contains("hammered"), "{said}");
    let (said, by_flag, _) = bake(&wrong, &["--y-up"]);
    assert!(said.contains("--y-up"), "{said}");
    assert!(as_it_is == by_flag, "a flag that agrees with glTF changes texels");
    let (said, got, fallback) = bake(&wrong, &["--y-down"]);
    assert!(!said.contains("green"), "{said}");
    let fallback = read_image(&fallback).unwrap();
    for (i, (got, wanted)) in got.iter().zip(&wanted).enumerate() {
        let png = fallback.texel(i as u32 % 32, i as u32 / 32);
        for c in 0..3 {
            // 255 - g is no exact mirror: half a step about the middle, and one of rounding.
            assert!((got[c] - wanted[c]).abs() < 2.1 / 255.0, "texel {i}: wanted {wanted:?}, got {got:?}");
            assert!(
                (got[c] - png[c]).abs() < 0.5 / 255.0,
                "texel {i}: {got:?}, and the fallback has {png:?}"
            );
        }
    }
    let said = kinran(&["inspect", text(&wrong)]);
    assert!(said.code == Some(0) && said.out.contains("--y-down"), "{}{}", said.out, said.err);
}

#[test]
fn texels_of_a_model_that_cannot_be_are_changed_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let mut map = bumps();
    let Pixels::U8(samples) = &mut map.pixels else { panic!("8 bits") };
    for texel in samples.chunks_exact_mut(3).step_by(100) {
        texel[2] = 100;
    }
    let below = folder.path().join("below.glb");
    std::fs::write(&below, glb_with(&map)).unwrap();
    let off: Vec<f32> = (0..16).map(|i| if i < 4 { 1.5 } else { 0.5 }).collect();
    let planes = vec![("B", vec![0.0; 16]), ("G", off), ("R", vec![9.0; 16])];
    kinran_image::write_exr_planes(&folder.path().join("rough.exr"), (4, 4), planes).unwrap();
    let rough = changed_model(folder.path(), |document| {
        document["images"].as_array_mut().unwrap().push(json!({ "uri": "rough.exr" }));
        let images = document["images"].as_array().unwrap().len();
        document["textures"].as_array_mut().unwrap().push(json!({ "source": images - 1, "sampler": 0 }));
        let textures = document["textures"].as_array().unwrap().len();
        document["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] =
            json!({ "index": textures - 1 });
    });
    // 1024 texels, each hundredth.
    let normal = "\"image 0\": 11 vectors point below the surface, their blue is under 0.5 (1.1 % of the map); they are \
                  laid on the surface";
    let number =
        "its roughness in \"rough\": 25 % of its texels are outside of 0 to 1 (0.50 to 1.50) and are clamped";
    // A height map in the place of normals.
    let samples = (0..256).map(|i| (i * 5 % 251) as u8).collect();
    let heights = Image::new(16, 16, Channels::R, Pixels::U8(samples)).unwrap();
    let grey = folder.path().join("grey.glb");
    std::fs::write(&grey, glb_with(&heights)).unwrap();
    let none = "\"image 0\" does not look like one: it is grey";
    for (model, wanted) in [(&below, normal), (&rough, number), (&grey, none)] {
        let out = folder.path().join("out");
        for words in [&["bake", text(model), "-o", text(&out), "--force"][..], &["inspect", text(model)]] {
            let report = kinran_json(words);
            let warnings = report["warnings"].as_array().unwrap();
            let told = warnings.iter().filter(|w| w.as_str().unwrap().contains(wanted)).count();
            assert_eq!(told, 1, "{words:?}: wanted {wanted:?} once in {warnings:#?}");
        }
    }
    // Red of this texture is nothing.
    let report = kinran_json(&["inspect", text(&rough)]);
    assert!(!report["warnings"].to_string().contains("9.00"), "{}", report["warnings"]);
}

/// Textures of slots that a bake does not touch, geometry that it does not read.
#[test]
fn what_a_bake_does_not_need_stops_it() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let mut document: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    document["images"]
        .as_array_mut()
        .unwrap()
        .extend([json!({ "uri": "gone.png" }), json!({ "uri": "cut.png" })]);
    std::fs::write(folder.path().join("cut.png"), &encode_png(&bumps()).unwrap()[..60]).unwrap();
    document["textures"].as_array_mut().unwrap().extend([
        json!({ "source": 2 }),
        json!({ "source": 3 }),
        json!({ "extensions": { "EXT_texture_avif": { "source": 3 } } }),
    ]);
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": 2 });
    document["materials"][0]["emissiveTexture"] = json!({ "index": 3 });
    document["materials"][0]["extensions"]["KHR_materials_sheen"] =
        json!({ "sheenColorFactor": [1, 1, 1], "sheenColorTexture": { "index": 4 } });
    document["accessors"][0]["componentType"] = json!(1);
    document["extensionsRequired"] = json!(["EXT_texture_avif"]);
    std::fs::write(&model, serde_json::to_vec(&document).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let report = kinran_json(&["bake", text(&model), "-o", text(out.path())]);
    let warnings = report["warnings"].to_string();
    for part in ["gone.png", "sheenColorTexture"] {
        assert!(warnings.contains(part), "no {part} in {warnings}");
    }
    let written: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("square.gltf")).unwrap()).unwrap();
    let uri = |info: &Value| {
        let texture = &written["textures"][info["index"].as_u64().unwrap() as usize];
        written["images"][texture["source"].as_u64().unwrap() as usize]["uri"].clone()
    };
    assert_eq!(uri(&written["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]), "gone.png");
    assert_eq!(uri(&written["materials"][0]["emissiveTexture"]), "cut.png");
    assert!(out.path().join("cut.png").exists(), "a file that is not read is still copied");
    // Asked for, they are.
    refused(&["bake", text(&model), "-o", text(out.path()), "--all-textures"], &["square.gltf"]);
}

/// Half the light in an EXR is code 188, half of sRGB's range 128; said in the table, the sidecar and a dry run.
#[test]
fn linear_colour_is_told_and_a_flag_or_a_manifest_overrides_it() {
    let folder = tempfile::tempdir().unwrap();
    let material = folder.path().join("paint");
    std::fs::create_dir(&material).unwrap();
    let grey = Image::new(4, 4, Channels::Rgb, Pixels::F32(vec![0.5; 48])).unwrap();
    kinran_image::write_exr(&material.join("paint_color.exr"), &grey).unwrap();
    let out = tempfile::tempdir().unwrap();
    let texel = |out: &Path| {
        let texture = read_texture(&out.join("paint_color.ktx2")).unwrap();
        assert_eq!(texture.transfer, Transfer::Srgb);
        texture.levels[0].data[0]
    };
    let words = ["bake", text(&material), "-o", text(out.path()), "--color-format", "rgba8"];
    for (flags, wanted, said) in [
        (&[][..], 188, "taken as linear; say --color-space srgb if it is not"),
        (&["--color-space", "srgb"], 128, "sRGB, by --color-space"),
        (&["--color-space", "linear"], 188, "linear, by --color-space"),
    ] {
        let dry = kinran_json(&[&words[..], flags, &["--dry-run"]].concat());
        let report = kinran_json(&[&words[..], flags].concat());
        for report in [&dry, &report] {
            assert_eq!(report["files"][0]["note"], said, "{flags:?}");
        }
        assert_eq!(report["surfaces"][0]["inputs"][0]["notes"], json!([said]), "{flags:?}");
        assert!(
            texel(out.path()).abs_diff(wanted) <= 1,
            "{flags:?}: wanted {wanted}, got {}",
            texel(out.path())
        );
    }
    refused(&[&words[..], &["--color-space", "rec2020"]].concat(), &["--color-space", "linear, srgb"]);

    let manifest = folder.path().join("kinran.toml");
    let entry = "[[aniso]]\ninput = \"paint\"\ncolor-space = \"srgb\"\ncolor-format = \"rgba8\"\n";
    std::fs::write(&manifest, entry).unwrap();
    let cache = folder.path().join("cache");
    kinran_json(&["bake", text(&manifest), "--cache", text(&cache)]);
    let baked = folder.path().join("baked/paint");
    assert!(texel(&baked).abs_diff(128) <= 1, "by manifest: got {}", texel(&baked));
}

/// A render's layers as files of other programs have them: one is asked for, by a flag and in a manifest.
#[test]
fn layers_of_an_exr_are_named_by_a_flag_or_a_manifest() {
    let folder = tempfile::tempdir().unwrap();
    let material = folder.path().join("paint");
    std::fs::create_dir(&material).unwrap();
    let plane = |v: f32| vec![v; 16];
    let planes = vec![
        ("View.Color.R", plane(0.5)),
        ("View.Color.G", plane(0.125)),
        ("View.Color.B", plane(1.0)),
        ("View.Normal.X", plane(0.0)),
        ("View.Normal.Y", plane(0.0)),
        ("View.Normal.Z", plane(1.0)),
    ];
    kinran_image::write_exr_planes(&material.join("paint_color.exr"), (4, 4), planes).unwrap();
    let out = tempfile::tempdir().unwrap();
    let words = ["bake", text(&material), "-o", text(out.path()), "--color-format", "rgba8"];
    refused(&words, &["paint_color.exr", "View.Color, View.Normal", "--exr-layer"]);
    refused(&[&words[..], &["--dry-run"]].concat(), &["paint_color.exr", "--exr-layer"]);
    let layer = ["--exr-layer", "paint_color.exr=View.Color"];
    let report = kinran_json(&[&words[..], &layer].concat());
    let note = report["files"][0]["note"].as_str().unwrap();
    assert!(note.starts_with("layer \"View.Color\"; left out: View.Normal; taken as linear"), "{note}");
    let texel =
        |out: &Path| read_texture(&out.join("paint_color.ktx2")).unwrap().levels[0].data[..3].to_vec();
    assert_eq!(texel(out.path()), [188, 99, 255]);
    refused(
        &[&words[..], &["--exr-layer", "paint_color.exr=Depth"]].concat(),
        &["no layer \"Depth\"", "View.Color"],
    );
    refused(&[&words[..], &["--exr-layer", "x.exr=Depth"]].concat(), &["--exr-layer x.exr=Depth"]);
    refused(&[&words[..], &["--exr-layer", "Depth"]].concat(), &["FILE=LAYER"]);

    let manifest = folder.path().join("kinran.toml");
    let entry = "[[aniso]]\ninput = \"paint\"\nexr-layer = \"paint_color.exr=View.Color\"\ncolor-format = \"rgba8\"\n";
    std::fs::write(&manifest, entry).unwrap();
    kinran_json(&["bake", text(&manifest), "--cache", text(&folder.path().join("cache"))]);
    assert_eq!(texel(&folder.path().join("baked/paint")), [188, 99, 255]);
    // Inspect asks for one in the same way.
    let file = material.join("paint_color.exr");
    refused(&["inspect", text(&file)], &["View.Color, View.Normal", "--exr-layer"]);
    let report = kinran_json(&["inspect", text(&file), "--exr-layer", "View.Normal"]);
    assert_eq!(
        report["notes"],
        json!(["layer \"View.Normal\"; X, Y, Z as red, green, blue; left out: View.Color"])
    );
    assert_eq!(report["transfer"], "linear");
}

/// A WebP without a PNG beside it stays what its texture names by the extension; `source` would not be glTF.
#[test]
fn webp_textures_of_a_model_are_baked_and_kept_where_they_stand() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let webp = include_bytes!("../../kinran-image/tests/data/rgb.webp");
    std::fs::write(folder.path().join("paint.webp"), webp).unwrap();
    let mut document: Value = serde_json::from_slice(&std::fs::read(&model).unwrap()).unwrap();
    let (images, textures) =
        (document["images"].as_array().unwrap().len(), document["textures"].as_array().unwrap().len());
    document["images"].as_array_mut().unwrap().push(json!({ "uri": "paint.webp", "mimeType": "image/webp" }));
    document["textures"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "extensions": { "EXT_texture_webp": { "source": images } } }));
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": textures });
    document["extensionsUsed"].as_array_mut().unwrap().push(json!("EXT_texture_webp"));
    document["extensionsRequired"] = json!(["EXT_texture_webp"]);
    std::fs::write(&model, serde_json::to_vec(&document).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let bake = ["bake", text(&model), "-o", text(out.path()), "--all-textures", "--color-format", "rgba8"];
    let report = kinran_json(&bake);
    let written: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("square.gltf")).unwrap()).unwrap();
    let info = &written["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    let texture = &written["textures"][info["index"].as_u64().unwrap() as usize];
    assert!(texture.get("source").is_none(), "{texture}");
    let uri = |extension: &str| {
        let image = texture["extensions"][extension]["source"].as_u64().unwrap();
        written["images"][image as usize]["uri"].as_str().unwrap().to_owned()
    };
    assert_eq!(uri("EXT_texture_webp"), "paint.webp");
    let baked = read_texture(&out.path().join(uri("KHR_texture_basisu"))).unwrap();
    // Texel (3, 2) as it was painted: 3 * 12 + 2, 2 * 17, 255 - 3 * 12 - 2.
    assert_eq!(baked.levels[0].data[(2 * 13 + 3) * 4..][..3], [38, 34, 217], "{}", report["warnings"]);
}

/// Every format that is asked for is what the files hold.
#[test]
fn formats_on_request_are_others() {
    let input = cloth(16);
    for (name, format) in
        [("bc1", Format::Bc1), ("bc7", Format::Bc7), ("rgba8", Format::Rgba8), ("rgba16f", Format::Rgba16F)]
    {
        let out = tempfile::tempdir().unwrap();
        kinran_json(&[
            "bake",
            text(input.path()),
            "-o",
            text(out.path()),
            "--normal-format",
            name,
            "--aniso-format",
            name,
        ]);
        for map in ["normal", "aniso", "orm"] {
            let texture = read_texture(&out.path().join(format!("cloth_{map}.ktx2"))).unwrap();
            assert_eq!(texture.format, format, "{map}");
            texture.check().unwrap();
        }
        // Occlusion and metalness are not lost with any of them.
        let orm = read_texture(&out.path().join("cloth_orm.ktx2")).unwrap().decode_level(0).unwrap();
        let authored = read_image(&input.path().join("cloth_arm.png")).unwrap();
        for c in [0, 2] {
            let error: f32 = (0..256)
                .map(|i| (orm[i][c] - authored.texel(i as u32 % 16, i as u32 / 16)[c]).abs() / 256.0)
                .sum();
            assert!(error < 0.05, "{name}: channel {c} is {error} off on average");
        }
    }
}

/// Killed at any moment, a run leaves files that are whole, and its temporary ones under names that say so.
#[test]
fn a_killed_run_leaves_half_a_file() {
    let input = cloth(1024);
    for delay in [100, 600, 1500, 3000] {
        let out = tempfile::tempdir().unwrap();
        let mut child = Command::new(env!("CARGO_BIN_EXE_kinran"))
            .args([
                "bake",
                text(input.path()),
                "-o",
                text(out.path()),
                "--container",
                "both",
                "--form",
                "both",
            ])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(delay) && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        for name in files(out.path()).into_iter().filter(|name| !name.starts_with(".kinran-")) {
            let path = out.path().join(&name);
            if name.ends_with(".json") {
                serde_json::from_slice::<Value>(&std::fs::read(&path).unwrap()).unwrap();
            } else {
                read_texture(&path).unwrap().check().unwrap();
            }
        }
    }
}

/// Authored by others; presets and filter are the fastest, the maps are large.
#[test]
fn sample_assets_do_not_bake() {
    let Some(assets) = sample_assets() else { return };
    for name in [
        "meshes/anisotropy_barn_lamp",
        "meshes/anisotropy_disc_test",
        "meshes/horse_statue_01",
        "materials/acg_metal009",
        "materials/3dt_fabric_knitted_006",
    ] {
        let mut source = assets.join(name);
        if name.starts_with("meshes") {
            let model = files(&source).into_iter().find(|f| f.ends_with(".glb") || f.ends_with(".gltf"));
            source = source.join(model.unwrap_or_else(|| panic!("{name} has no model")));
        }
        let out = tempfile::tempdir().unwrap();
        let fast = ["--filter", "linear", "--preset", "fast", "--zstd", "0"];
        let said = kinran(&[&["bake", text(&source), "-o", text(out.path())], &fast[..]].concat());
        assert_eq!(said.code, Some(0), "{name}: {}", said.err);
        let baked: Vec<String> = files(out.path()).into_iter().filter(|f| f.ends_with(".ktx2")).collect();
        assert!(baked.len() >= 2, "{name}: {baked:?}");
        for file in &baked {
            read_texture(&out.path().join(file)).unwrap().check().unwrap();
        }
        for file in files(out.path()).iter().filter(|f| f.ends_with(".png")) {
            let path = out.path().join(file);
            decode_image(&path, &std::fs::read(&path).unwrap()).unwrap();
        }
    }
}

/// Format and channels of the texture in a slot, and whether a PNG stands beside it.
fn stored(folder: &Path, document: &Value, info: &Value) -> (Vec<(String, Format)>, bool) {
    let texture = &document["textures"][info["index"].as_u64().unwrap() as usize];
    let uri = |index: &Value| document["images"][index.as_u64().unwrap() as usize]["uri"].as_str().unwrap();
    let with_levels = texture["extensions"].as_object().into_iter().flatten().map(|(name, extension)| {
        let texture = read_texture(&folder.join(uri(&extension["source"]))).unwrap();
        assert_eq!(texture.levels.len(), 6, "{name}");
        (name.clone(), texture.format)
    });
    let png = texture.get("source").is_some_and(|source| folder.join(uri(source)).is_file());
    (with_levels.collect(), png)
}

#[test]
fn a_target_stores_what_its_readers_do_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let (basisu, dds) = ("KHR_texture_basisu".to_owned(), "MSFT_texture_dds".to_owned());
    for (flags, normal, others) in [
        (&["--target", "web"][..], vec![(&basisu, Format::Uastc)], vec![(&basisu, Format::Uastc)]),
        (&["--target", "desktop"], vec![(&basisu, Format::Bc5)], vec![(&basisu, Format::Bc7)]),
        (&["--target", "engine"], vec![(&dds, Format::Bc5)], vec![(&dds, Format::Bc7)]),
        (&["--target", "plain"], vec![], vec![]),
        (
            &["--target", "engine", "--container", "both", "--normal-format", "bc7"],
            vec![(&basisu, Format::Bc7), (&dds, Format::Bc7)],
            vec![(&basisu, Format::Bc7), (&dds, Format::Bc7)],
        ),
        // Who asks for a container or a format that not every viewer reads means who reads it.
        (&["--container", "dds"], vec![(&dds, Format::Bc5)], vec![(&dds, Format::Bc7)]),
        (&["--normal-format", "rgba16f"], vec![(&basisu, Format::Rgba16F)], vec![(&basisu, Format::Bc7)]),
        (&["--encoder", "ispc"], vec![(&basisu, Format::Bc5)], vec![(&basisu, Format::Bc7)]),
    ] {
        let out = tempfile::tempdir().unwrap();
        kinran_json(&[&["bake", text(&model), "-o", text(out.path())], flags].concat());
        let document: Value =
            serde_json::from_slice(&std::fs::read(out.path().join("square.gltf")).unwrap()).unwrap();
        let material = &document["materials"][0];
        let anisotropy = &material["extensions"]["KHR_materials_anisotropy"]["anisotropyTexture"];
        for (slot, wanted) in [
            (&material["normalTexture"], &normal),
            (&material["pbrMetallicRoughness"]["metallicRoughnessTexture"], &others),
            (anisotropy, &others),
        ] {
            let (mut got, png) = stored(out.path(), &document, slot);
            got.sort_by_key(|(name, _)| name.clone());
            let wanted: Vec<_> = wanted.iter().map(|(name, format)| ((*name).clone(), *format)).collect();
            assert_eq!(got, wanted, "{flags:?}");
            assert!(png, "{flags:?}: there is no PNG for viewers that know no extension");
        }
        assert_eq!(document.get("extensionsRequired"), None, "{flags:?}");
        let used = document["extensionsUsed"].as_array().unwrap();
        for name in [&basisu, &dds] {
            let is_there = normal.iter().any(|(there, _)| *there == name);
            assert_eq!(used.contains(&json!(name)), is_there, "{flags:?}: {name} in {used:?}");
        }
    }
}

/// Viewers take x, y and z as they come.
#[test]
fn normals_for_the_web_lose_their_z() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&model), "-o", text(out.path()), "--target", "web"]);
    let [normal] =
        &files(out.path()).into_iter().filter(|f| f.ends_with("normal.ktx2")).collect::<Vec<_>>()[..]
    else {
        panic!("{:?}", files(out.path()));
    };
    let texture = read_texture(&out.path().join(normal)).unwrap();
    let png = read_image(&out.path().join(normal.replace("ktx2", "png"))).unwrap();
    for (i, texel) in texture.decode_level(0).unwrap().iter().enumerate() {
        let wanted = png.texel(i as u32 % 32, i as u32 / 32);
        let off = (0..3).map(|c| (texel[c] - wanted[c]).abs()).fold(0.0, f32::max);
        assert!(off < 0.03, "texel {i}: wanted {wanted:?} as in the PNG, got {texel:?}");
    }
}

#[test]
fn flags_that_contradict_a_target_are_swallowed() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let out = folder.path().join("out");
    for (target, flags) in [
        ("web", &["--container", "dds"][..]),
        ("web", &["--container", "both"]),
        ("web", &["--normal-format", "bc5"]),
        ("web", &["--aniso-format", "rgba16f"]),
        ("web", &["--color-format", "bc1"]),
        ("web", &["--encoder", "ispc"]),
        ("desktop", &["--container", "dds"]),
        ("engine", &["--container", "ktx2"]),
        ("engine", &["--normal-format", "uastc"]),
        ("plain", &["--container", "ktx2"]),
        ("plain", &["--aniso-format", "bc7"]),
        ("plain", &["--form", "aniso"]),
        ("plain", &["--form", "both"]),
        ("plain", &["--all-textures"]),
    ] {
        let args = [&["bake", text(&model), "-o", text(&out), "--target", target], flags].concat();
        refused(&args, &[flags[0]]);
        refused(&[&args[..], &["--dry-run"]].concat(), &[flags[0]]);
        let manifest = folder.path().join("kinran.toml");
        let value = flags.get(1).map_or("true".into(), |value| format!("\"{value}\""));
        let entry = format!(
            "output = \"lib\"\n[[mesh]]\ninput = \"square.gltf\"\ntarget = \"{target}\"\n{} = {value}\n",
            flags[0].trim_start_matches('-')
        );
        std::fs::write(&manifest, entry).unwrap();
        let said = kinran(&["bake", text(&manifest), "--dry-run"]);
        let is_told = said.err.contains("kinran.toml:3") && said.err.contains(flags[0]);
        assert!(said.code == Some(2) && is_told, "{target} {flags:?} in a manifest: {}", said.err);
        std::fs::remove_file(&manifest).unwrap();
    }
    assert!(!out.exists(), "written: {:?}", files(&out));
    let maps = cloth(32);
    refused(&["bake", text(maps.path()), "-o", text(&out), "--target", "web"], &["--target", "glTF"]);
}

/// 30 × 18 texels: `KHR_texture_basisu` forbids them, and WebGL shows them black.
#[test]
fn maps_without_whole_blocks_become_textures_that_are_black() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let bumps = bumps();
    let samples = (0..18)
        .flat_map(|y| (0..30).map(move |x| (x, y)))
        .flat_map(|(x, y)| bumps.texel(x, y).map(|v| (v * 255.0).round() as u8)[..3].to_vec());
    let cut = Image::new(30, 18, Channels::Rgb, Pixels::U8(samples.collect())).unwrap();
    write(folder.path(), "bumps.png", &cut);
    write(folder.path(), "orm.png", &cut);
    for target in ["web", "desktop", "engine"] {
        let out = tempfile::tempdir().unwrap();
        let args = ["bake", text(&model), "-o", text(out.path()), "--target", target, "--all-textures"];
        let said = kinran(&args);
        assert_eq!(said.code, Some(0), "{}", said.err);
        let with_levels =
            files(out.path()).iter().filter(|f| f.ends_with(".ktx2") || f.ends_with(".dds")).count();
        assert_eq!(with_levels, if target == "engine" { 3 } else { 0 }, "{target}: {:?}", files(out.path()));
        let is_told = said.err.contains("30x18") && said.err.contains("32x20");
        assert_eq!(is_told, target != "engine", "{target}: {}", said.err);
        assert!(out.path().join("square_hammered_normal.png").is_file(), "{target}: {:?}", files(out.path()));
        let said = kinran(&["inspect", text(&out.path().join("square.gltf")), "--json"]);
        assert_eq!(said.code, Some(0), "{}", said.err);
    }
}

/// A file whose textures are Basis Universal's alone, as optimisers leave it.
#[test]
fn a_model_that_was_optimised_first_leaves_plain_viewers_without_textures() {
    let folder = tempfile::tempdir().unwrap();
    let model = anisotropic_model(folder.path());
    let web = folder.path().join("web");
    kinran_json(&["bake", text(&model), "-o", text(&web), "--target", "web", "--all-textures"]);
    let path = web.join("square.gltf");
    let mut document: Value = serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    for texture in document["textures"].as_array_mut().unwrap() {
        if texture.get("extensions").is_some() {
            texture.as_object_mut().unwrap().remove("source");
        }
    }
    document["extensionsRequired"] = json!(["KHR_texture_basisu"]);
    // What is not known may refer to images, which stay then.
    document["extensionsUsed"].as_array_mut().unwrap().retain(|name| name != "EXT_made_up");
    document["materials"][0]["extensions"].as_object_mut().unwrap().remove("EXT_made_up");
    let path = web.join("optimised.gltf");
    std::fs::write(&path, serde_json::to_vec(&document).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    kinran_json(&["bake", text(&path), "-o", text(out.path()), "--target", "web", "--all-textures"]);
    let document: Value =
        serde_json::from_slice(&std::fs::read(out.path().join("optimised.gltf")).unwrap()).unwrap();
    let normal = &document["materials"][0]["normalTexture"];
    assert_eq!(
        stored(out.path(), &document, normal),
        (vec![("KHR_texture_basisu".into(), Format::Uastc)], true)
    );
    assert_eq!(document.get("extensionsRequired"), None, "all textures have a PNG");
    for image in document["images"].as_array().unwrap() {
        let uri = image["uri"].as_str().unwrap();
        assert!(out.path().join(uri).is_file(), "{uri}");
    }
}

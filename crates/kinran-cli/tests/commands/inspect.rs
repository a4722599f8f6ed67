//! `kinran inspect` on every kind of file.

use std::collections::BTreeMap;

use crate::common::{bumps, kinran, kinran_json, square, text};
use glam::Vec2;
use kinran_image::{
    Channels, Format, Image, Level, Pixels, Role, Texture, Transfer, encode, write_png, write_texture,
};
use kinran_shading::{aniso_encode, aniso_from_alphas};

/// 8 x 8 texels of one colour and their mips.
fn texture(role: Role, rgb: [f32; 3], metadata: &[(&str, &str)]) -> Texture {
    let [r, g, b] = rgb.map(|v| (v * 255.0 + 0.5) as u8);
    let encoding = role.encoding();
    let levels = [8_u32, 4, 2, 1].map(|side| {
        let texels = [r, g, b, 255].repeat((side * side) as usize);
        Level { width: side, height: side, data: encode(encoding, &texels, side, side).unwrap() }
    });
    Texture {
        format: encoding.format,
        transfer: Transfer::Linear,
        levels: levels.to_vec(),
        metadata: metadata.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect(),
    }
}

#[test]
fn an_aniso_map_says_its_roughness_on_every_level() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ktx2");
    let texel = aniso_encode(aniso_from_alphas(0.5, 0.2, Vec2::from_angle(0.5)));
    write_texture(&path, &texture(Role::Aniso, texel.to_array(), &[("KinranMap", "aniso")]), Some(3))
        .unwrap();
    let report = kinran_json(&["inspect", text(&path)]);
    assert_eq!((report["format"].as_str(), report["role"].as_str()), (Some("BC7"), Some("aniso")));
    assert_eq!(report["metadata"]["KinranMap"], "aniso");
    let levels = report["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 4);
    for level in levels {
        for (what, wanted) in [("alpha_t", 0.5), ("alpha_b", 0.2)] {
            let got = level[what]["mean"].as_f64().unwrap();
            // Half a step of 8 bits in each of three channels.
            assert!((got - wanted).abs() < 0.01, "{what}: wanted {wanted}, got {got} in {level}");
        }
        assert!(level["direction_spread_degrees"].as_f64().unwrap() < 0.1, "{level}");
    }
    let said = kinran(&["inspect", text(&path)]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(said.out.contains("alpha_t min") && said.out.contains("8x8, 4 levels"), "{}", said.out);
}

#[test]
fn bc5_without_metadata_is_a_normal_map_and_the_flag_overrides() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("n.dds");
    write_texture(&path, &texture(Role::Normal, [0.75, 0.5, 0.0], &[]), None).unwrap();
    let report = kinran_json(&["inspect", text(&path)]);
    assert_eq!((report["format"].as_str(), report["role"].as_str()), (Some("BC5"), Some("normal")));
    let tilt = report["levels"][0]["tilt_degrees"]["mean"].as_f64().unwrap();
    // x = 0.5: asin(0.5), within a step of 8 bits.
    assert!((tilt - 30.0).abs() < 0.4, "tilt {tilt}");
    let report = kinran_json(&["inspect", text(&path), "--role", "data"]);
    assert!((report["levels"][0]["red"]["mean"].as_f64().unwrap() - 0.75).abs() < 0.003, "{report}");
}

#[test]
fn a_model_says_what_baking_would_do() {
    let (_folder, model) = square();
    let report = kinran_json(&["inspect", text(&model)]);
    assert_eq!((report["triangles"].as_u64(), report["instances"].as_u64()), (Some(2), Some(1)));
    let material = &report["materials"][0];
    assert_eq!(material["name"], "hammered");
    assert_eq!(
        (material["maps"][0]["slot"].as_str(), material["maps"][0]["width"].as_u64()),
        (Some("normal"), Some(32))
    );
    assert_eq!(material["bake"], "normal and roughness, 32x32, 6 levels");
    let said = kinran(&["inspect", text(&model)]);
    assert!(said.code == Some(0) && said.out.contains("hammered"), "{}{}", said.out, said.err);
}

#[test]
fn an_image_that_only_looks_like_a_normal_map_is_told_from_one() {
    let folder = tempfile::tempdir().unwrap();
    let inspect = |name: &str, image: &Image| {
        let path = folder.path().join(name);
        write_png(&path, image).unwrap();
        kinran_json(&["inspect", text(&path)])
    };
    let good = inspect("good.png", &bumps());
    assert_eq!((good["width"].as_u64(), good["bits"].as_u64()), (Some(32), Some(8)));
    assert_eq!(good["normal_map"]["not_unit_share"].as_f64(), Some(0.0), "{good}");

    // Every other texel 5 % too short.
    let samples = (0..16).flat_map(|i| if i % 2 == 0 { [128, 128, 255] } else { [128, 128, 249] }).collect();
    let short = inspect("short.png", &Image::new(4, 4, Channels::Rgb, Pixels::U8(samples)).unwrap());
    assert_eq!(short["normal_map"]["not_unit_share"].as_f64(), Some(0.5), "{short}");

    let grey = Image::new(2, 1, Channels::R, Pixels::U8(vec![0, 255])).unwrap();
    let grey = inspect("grey.png", &grey);
    assert!(grey["normal_map"].is_null(), "{grey}");
    let range = &grey["channels"][0];
    let numbers = ["min", "mean", "max"].map(|key| range[key].as_f64().unwrap());
    assert_eq!(numbers, [0.0, 0.5, 1.0]);
}

#[test]
fn an_unknown_map_name_in_the_file_is_not_guessed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.ktx2");
    let level = Level { width: 1, height: 1, data: vec![0; 4] };
    let texture = Texture {
        format: Format::Rgba8,
        transfer: Transfer::Linear,
        levels: vec![level],
        metadata: BTreeMap::from([("KinranMap".into(), "velvet".into())]),
    };
    write_texture(&path, &texture, None).unwrap();
    crate::common::refused(&["inspect", text(&path)], &["x.ktx2", "KinranMap", "velvet", "--role"]);
    assert_eq!(kinran_json(&["inspect", text(&path), "--role", "data"])["role"], "data");
}

/// Every file that the commands write, inspected; none is refused.
#[test]
fn a_file_that_kinran_writes_is_refused_by_inspect() {
    let (folder, model) = square();
    let maps = tempfile::tempdir().unwrap();
    let grey = Image::new(32, 32, Channels::R, Pixels::U8(vec![90; 1024])).unwrap();
    for (name, image) in
        [("a_nor_gl", &bumps()), ("a_rough", &grey), ("a_ao", &grey), ("a_color", &bumps()), ("mask", &grey)]
    {
        std::fs::write(maps.path().join(format!("{name}.png")), kinran_image::encode_png(image).unwrap())
            .unwrap();
    }
    let file = |name: &str| text(&maps.path().join(name)).to_owned();
    let lower = format!("--layer={},scale=2", file("a_rough.png"));
    let upper = format!("--layer={},scale=3,mask={}", file("a_ao.png"), file("mask.png"));
    let normals = format!("--layer={},scale=2", file("a_nor_gl.png"));
    let table = text(&folder.path().join("combed.exr")).to_owned();
    // Metal beside other material.
    let mixed = folder.path().join("mixed.gltf");
    let document = serde_json::json!({
        "asset": { "version": "2.0" },
        "materials": [{ "name": "paint", "normalTexture": { "index": 0 }, "pbrMetallicRoughness":
            { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }],
        "images": [{ "uri": "mixed.png" }]
    });
    std::fs::write(&mixed, document.to_string()).unwrap();
    std::fs::write(folder.path().join("mixed.png"), kinran_image::encode_png(&bumps()).unwrap()).unwrap();
    let runs: [&[&str]; 9] = [
        &["bake", text(maps.path()), "--form", "both", "--container", "both", "--ignore", "mask.png"],
        &["bake", text(&model), "--all-textures", "--curvature", "all", "--curvature-dump", "json"],
        &["bake", text(&model), "--form", "aniso", "--curvature", "all", "--curvature-dump", "exr"],
        &["bake", text(&mixed), "--all-textures", "--separate-specular"],
        &["skin-lut", "--penumbra", "--size", "8x8", "--container", "both"],
        &["detail", "solve", &file("a_color.png"), &lower, &upper, "--board", "--pictures"],
        &["detail", "solve", &file("a_nor_gl.png"), "--kind", "normal", &normals],
        &["compare", text(&model), "--size", "8x8", "--spp", "1", "--truth-spp", "1", "--distances", "1"],
        &["fit", "fuzz", "--tilt", "30", "--spread", "0.05", "--table", &table],
    ];
    let mut roles = std::collections::BTreeSet::new();
    for words in runs {
        let out = tempfile::tempdir().unwrap();
        let fit = words[0] == "fit";
        let more = ["-o", text(out.path())];
        let said = kinran_json(&[words, if fit { &[] } else { &more[..] }].concat());
        if fit {
            std::fs::copy(&table, out.path().join("combed.exr")).unwrap();
            std::fs::write(out.path().join("fit.json"), said.to_string()).unwrap();
        }
        let written = crate::common::files(out.path());
        assert!(!written.is_empty(), "{words:?} wrote nothing");
        for name in written {
            let path = out.path().join(&name);
            let report = kinran_json(&["inspect", text(&path)]);
            assert!(!kinran(&["inspect", text(&path)]).out.is_empty(), "{name}: nothing for people");
            if let Some(role) = report["role"].as_str().filter(|_| name.ends_with(".ktx2")) {
                assert!(
                    name.contains(role.trim_start_matches("skin-")) || ["detail", "data"].contains(&role),
                    "{name} is called {role}"
                );
                roles.insert(role.to_owned());
            }
            for file in report["written"].as_array().into_iter().flatten() {
                assert_eq!(file["state"], "as-written", "{name}: {file}");
            }
        }
    }
    let all: std::collections::BTreeSet<String> =
        kinran::content::Content::ALL.into_iter().map(|content| content.name().to_owned()).collect();
    let missing: Vec<&String> = all.difference(&roles).filter(|role| *role != "data").collect();
    assert!(missing.is_empty(), "no run wrote {missing:?}");
}

#[test]
fn a_report_hides_that_its_files_have_changed() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    kinran_json(&["bake", text(&model), "-o", text(&out)]);
    std::fs::write(out.join("square.glb"), "edited").unwrap();
    std::fs::remove_file(out.join("square_hammered_normal.ktx2")).unwrap();
    let report = out.join("square.kinran.json");
    let state = |report: &serde_json::Value, name: &str| {
        let files = report["written"].as_array().unwrap();
        files.iter().find(|f| f["file"] == name).unwrap_or_else(|| panic!("{name} is not listed: {report}"))["state"]
            .clone()
    };
    let said = kinran_json(&["inspect", text(&report)]);
    assert_eq!(state(&said, "square.glb"), "changed");
    assert_eq!(state(&said, "square_hammered_normal.ktx2"), "missing");
    assert_eq!(state(&said, "square_hammered_roughness.ktx2"), "as-written");
    assert_eq!(said.get("kept"), None);
    kinran_json(&["bake", text(&model), "-o", text(&out), "--container", "dds", "--force"]);
    let said = kinran_json(&["inspect", text(&report)]);
    let kept = said["kept"].as_array().unwrap();
    assert!(kept.iter().any(|f| f["file"] == "square_hammered_roughness.ktx2"), "{said}");
    let other = folder.path().join("other.json");
    std::fs::write(&other, "{ \"a\": 1 }").unwrap();
    crate::common::refused(&["inspect", text(&other)], &["other.json", "no JSON that kinran writes"]);
}

#[test]
fn a_baked_texture_that_was_cut_passes_the_check() {
    let (folder, model) = square();
    let baked = folder.path().join("baked");
    assert_eq!(kinran(&["bake", text(&model), "-o", text(&baked)]).code, Some(0));
    let files: Vec<String> = crate::common::files(&baked);
    for file in &files {
        let path = baked.join(file);
        if ["ktx2", "glb", "json"].iter().any(|end| file.ends_with(end)) {
            let said = kinran(&["inspect", "--check", text(&path)]);
            assert_eq!((said.code, said.out), (Some(0), format!("{file}: all is well\n")), "{}", said.err);
        }
    }
    let texture = baked.join(files.iter().find(|file| file.ends_with(".ktx2")).unwrap());
    let bytes = std::fs::read(&texture).unwrap();
    std::fs::write(&texture, &bytes[..bytes.len() / 2]).unwrap();
    let said = kinran(&["inspect", "--check", "--json", text(&texture)]);
    assert_eq!(said.code, Some(2), "{}", said.err);
    let report: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(
        (&report["kind"], report["findings"].as_array().map(Vec::len)),
        (&"check".into(), Some(1)),
        "{report}"
    );
    let other = baked.join("notes.txt");
    std::fs::write(&other, "").unwrap();
    crate::common::refused(&["inspect", "--check", text(&other)], &["notes.txt", "nothing that is checked"]);
}

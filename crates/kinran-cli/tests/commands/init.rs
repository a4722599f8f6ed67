//! `kinran init`, and `kinran bake` as somebody meets it who has read nothing.

use std::path::Path;

use crate::common::{bumps, files, glb, kinran, kinran_json, refused, text};
use kinran_image::{Channels, Image, Pixels, write_png};

fn grey(path: &Path) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let samples = (0..32 * 32 * 3).map(|i| (i * 7 % 200) as u8).collect();
    write_png(path, &Image::new(32, 32, Channels::Rgb, Pixels::U8(samples)).unwrap()).unwrap();
}

fn material(folder: &Path, name: &str) {
    std::fs::create_dir_all(folder).unwrap();
    write_png(&folder.join(format!("{name}_normal.png")), &bumps()).unwrap();
    let flat = Image::new(32, 32, Channels::R, Pixels::U8(vec![128; 32 * 32])).unwrap();
    write_png(&folder.join(format!("{name}_roughness.png")), &flat).unwrap();
}

/// Bakes a manifest; gives what its entries came to, by name.
fn bake(manifest: &Path, cache: &Path) -> Vec<(String, String, String)> {
    let report = kinran_json(&["bake", text(manifest), "--cache", text(cache)]);
    let word = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    let entries = report["entries"].as_array().unwrap();
    entries.iter().map(|e| (word(&e["name"]), word(&e["folder"]), word(&e["status"]))).collect()
}

#[test]
fn what_init_writes_is_baked_as_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("library");
    for name in ["tin", "lead", "zinc [old]", "brass, 'worn'"] {
        material(&root.join("materials").join(name), name);
    }
    // One that cannot be told, an old output, a hidden folder, and one that is none.
    material(&root.join("materials/odd"), "odd");
    material(&root.join("materials/odd"), "odd_2_NormalGL");
    grey(&root.join("materials/odd/odd_Normal-ogl.png"));
    // One whose normals are none: its texels say so.
    std::fs::create_dir_all(root.join("materials/plain")).unwrap();
    grey(&root.join("materials/plain/plain_normal.png"));
    assert_eq!(
        kinran(&["bake", text(&root.join("materials/tin")), "-o", text(&root.join("done"))]).code,
        Some(0)
    );
    // One that was baked where it lies.
    let lead = root.join("materials/lead");
    assert_eq!(kinran(&["bake", text(&lead), "-o", text(&lead)]).code, Some(0));
    material(&root.join(".hidden"), "hidden");
    std::fs::create_dir_all(root.join("notes")).unwrap();
    std::fs::write(root.join("notes/readme.txt"), "nothing").unwrap();
    // Nothing at all, and pictures that are no maps.
    std::fs::create_dir_all(root.join("later")).unwrap();
    grey(&root.join("photos/left.png"));
    grey(&root.join("photos/right.png"));
    // Two models, one with its map beside it, and one that is torn.
    std::fs::create_dir_all(root.join("props")).unwrap();
    std::fs::write(root.join("props/lamp.glb"), glb()).unwrap();
    std::fs::write(root.join("props/tin.glb"), glb()).unwrap();
    std::fs::write(root.join("props/torn.glb"), &glb()[..100]).unwrap();
    let bare = r#"{"asset":{"version":"2.0"},"images":[{"uri":"gone.png"},{"uri":"lost.png"}]}"#;
    std::fs::write(root.join("props/bare.gltf"), bare).unwrap();
    std::fs::write(root.join("props/cow.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    // Targets: one whose tile is told by its name, one whose is not.
    for tile in ["steel", "rust"] {
        grey(&root.join("tiles").join(format!("{tile}_color.png")));
    }
    grey(&root.join("targets/steel_helmet_color.png"));
    grey(&root.join("targets/boot_color.png"));
    write_png(&root.join("tiles/steel_normal.png"), &bumps()).unwrap();
    write_png(&root.join("targets/boot_normal.png"), &bumps()).unwrap();

    let manifest = root.join("kinran.toml");
    let dry = kinran(&["init", text(&root), "--dry-run"]);
    assert_eq!(dry.code, Some(0), "{}", dry.err);
    assert!(!manifest.exists(), "--dry-run wrote it");
    let report = kinran_json(&["init", text(&root)]);
    let written = std::fs::read_to_string(&manifest).unwrap();
    assert_eq!(dry.out.trim_end(), written.trim_end());
    let counts = ["folders", "models", "targets"].map(|what| report[what].as_u64().unwrap());
    assert_eq!(counts, [4, 2, 2], "{written}");
    let left_out: Vec<&str> =
        report["left_out"].as_array().unwrap().iter().map(|left| left["path"].as_str().unwrap()).collect();
    for path in [
        "materials/odd",
        "materials/plain",
        "props/torn.glb",
        "props/bare.gltf",
        "props/cow.obj",
        "targets/boot_color.png",
        "later",
        "photos",
    ] {
        assert!(left_out.contains(&path) && written.contains(&format!("# {path}: ")), "{path}: {written}");
    }
    assert!(!written.contains("hidden") && !written.contains("done"), "{written}");
    assert!(written.contains("input = \"materials/*\""), "many are a pattern: {written}");

    let cache = folder.path().join("cache");
    let entries = bake(&manifest, &cache);
    let mut names: Vec<&str> = entries.iter().map(|(name, ..)| name.as_str()).collect();
    names.sort_unstable();
    let wanted = [
        "materials/brass, 'worn'",
        "materials/lead",
        "materials/tin",
        "materials/zinc [old]",
        "props/lamp.glb",
        "props/tin.glb",
        "targets/boot_normal.png",
        "targets/steel_helmet_color.png",
    ];
    assert_eq!(names, wanted);
    assert!(entries.iter().all(|(.., status)| status == "baked"), "{entries:?}");
    // Twice the name "tin" in two places.
    let folders: std::collections::BTreeSet<_> = entries.iter().map(|(_, folder, _)| folder).collect();
    assert_eq!(folders.len(), entries.len(), "{entries:?}");
    assert!(
        bake(&manifest, &cache).iter().all(|(.., status)| status == "up-to-date"),
        "the second bake is none"
    );

    refused(&["init", text(&root)], &["kinran.toml", "there already"]);
    assert_eq!(std::fs::read_to_string(&manifest).unwrap(), written, "it was overwritten");
}

#[test]
fn maps_of_a_model_are_no_material() {
    let folder = tempfile::tempdir().unwrap();
    let lamp = folder.path().join("lamp");
    material(&lamp, "lamp");
    let json =
        br#"{"asset":{"version":"2.0"},"images":[{"uri":"lamp_normal.png"},{"uri":"lamp_roughness.png"}]}"#;
    std::fs::write(lamp.join("lamp.gltf"), json).unwrap();
    let report = kinran_json(&["init", text(folder.path()), "--dry-run"]);
    assert_eq!((report["folders"].as_u64(), report["models"].as_u64()), (Some(0), Some(1)), "{report}");
}

#[test]
fn a_folder_of_folders_is_told_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("materials");
    for name in ["tin", "lead"] {
        material(&root.join(name), name);
    }
    refused(
        &["bake", text(&root)],
        &["materials: ", "2 folders with maps; ", "`kinran init ", "kinran.toml"],
    );
    assert_eq!(kinran(&["init", text(&root)]).code, Some(0));
    refused(&["bake", text(&root)], &["materials: ", "`kinran bake ", "kinran.toml`"]);
    // Folders that cannot be baked are counted and named, also where there is nothing else.
    std::fs::remove_file(root.join("kinran.toml")).unwrap();
    std::fs::create_dir(root.join("wood")).unwrap();
    grey(&root.join("wood/wood_normal.png"));
    let failing = ["1 that cannot be baked (wood: ", "not a tangent-space normal map"];
    refused(&["bake", text(&root)], &[&["2 folders with maps, and "], &failing[..]].concat());
    for name in ["tin", "lead"] {
        std::fs::remove_dir_all(root.join(name)).unwrap();
    }
    refused(&["bake", text(&root)], &["what is below it cannot be baked: wood: ", failing[1]]);
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    refused(&["bake", text(&folder.path().join("empty"))], &["no maps found"]);
    refused(&["init", text(&folder.path().join("empty"))], &["empty: ", "name another folder"]);
    refused(&["init", text(&folder.path().join("gone"))], &["gone: "]);
    refused(&["init", text(&root.join("tin/tin_normal.png"))], &["tin_normal.png"]);
}

#[test]
fn without_an_output_files_go_beside_the_input() {
    let folder = tempfile::tempdir().unwrap();
    material(&folder.path().join("tin"), "tin");
    std::fs::write(folder.path().join("lamp.glb"), glb()).unwrap();
    for (input, wanted) in [("tin", "tin_aniso.ktx2"), ("lamp.glb", "lamp.glb")] {
        let said = kinran(&["bake", text(&folder.path().join(input))]);
        assert_eq!(said.code, Some(0), "{}", said.err);
        let baked = folder.path().join("baked");
        assert!(said.err.contains(&format!("went to {}", baked.display())), "{}", said.err);
        assert!(files(&baked).contains(&wanted.to_owned()), "{:?}", files(&baked));
        let quiet = kinran(&["bake", text(&folder.path().join(input)), "--quiet"]);
        assert!(quiet.err.is_empty(), "{}", quiet.err);
    }
}

#[test]
fn an_obj_is_taken_or_told_the_way() {
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("cow.obj");
    std::fs::write(&obj, "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n").unwrap();
    let (obj, out) = (text(&obj), folder.path().join("out"));
    let picture = folder.path().join("p.png");
    let small = ["--size", "16", "--spp", "1"];
    for args in [
        &["render", obj, "-o", text(&picture)][..],
        &["compare", obj, "-o", text(&out), "--truth-spp", "1", "--distances", "1"],
        &["fuzz", obj, "-o", text(&out), "--sheet", "simple"],
        &["skin", obj, "-o", text(&out), "--sheet", "shadows"],
    ] {
        let said = kinran(&[args, &small[..]].concat());
        assert_eq!(said.code, Some(0), "{args:?}: {}", said.err);
    }
    assert_eq!(kinran_json(&["inspect", obj])["triangles"], 1);
    refused(&["bake", obj], &["cow.obj", ".glb"]);
    let folder = text(folder.path());
    assert_eq!(kinran(&["render", folder, "-o", text(&picture), "--size", "16", "--spp", "1"]).code, Some(0));
}

#[test]
fn flags_that_people_try_work_or_are_told() {
    for (args, told) in [
        (&["bake", "x", "--out", "y"][..], "--output"),
        (&["bake", "x", "--dryrun"], "--dry-run"),
        (&["render", "x", "-o", "y.png", "--sise", "3"], "--size"),
        (&["rendr", "x"], "render"),
        (&["bake", "x", "--verbose", "--quiet"], "--quiet"),
    ] {
        let said = kinran(args);
        assert!(said.code == Some(2) && said.err.contains(told), "{args:?}: {}", said.err);
    }
    for args in [&["--version"][..], &["-V"], &["bake", "--version"], &["detail", "solve", "-V"]] {
        let said = kinran(args);
        assert!(
            said.code == Some(0) && said.out.contains(env!("CARGO_PKG_VERSION")),
            "{args:?}: {}",
            said.err
        );
    }
}

//! What inputs are trusted with, and what is refused before anything is written.

use std::path::{Path, PathBuf};

use kinran_image::{Channels, Image, Pixels, encode_png, read_texture, write_png};
use serde_json::{Value, json};

use crate::common::{bumps, files, glb, kinran, kinran_json, refused, square, text};

/// The JSON and the binary chunk of a .glb.
fn parts(glb: &[u8]) -> (Value, Vec<u8>) {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    (serde_json::from_slice(&glb[20..20 + length]).unwrap(), glb[28 + length..].to_vec())
}

/// A folder with `model/m.gltf`, whose buffer and whose normal map lie where the URIs say, and files to refer to.
struct Models(tempfile::TempDir);

impl Models {
    fn new() -> Self {
        let models = Models(tempfile::tempdir().unwrap());
        for folder in ["model/textures", "shared", "out"] {
            std::fs::create_dir_all(models.path(folder)).unwrap();
        }
        let (_, bin) = parts(&glb());
        for file in ["model/m.bin", "shared/m.bin", "shared/passwd", "model/notes.toml"] {
            std::fs::write(models.path(file), &bin).unwrap();
        }
        let png = encode_png(&bumps()).unwrap();
        for file in ["model/n.png", "model/textures/n.png", "shared/n.png", "shared/wood"] {
            std::fs::write(models.path(file), &png).unwrap();
        }
        std::fs::write(models.path("shared/key"), "-----BEGIN KEY-----").unwrap();
        models
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        text(&self.path(name)).into()
    }

    /// Writes the model.
    fn set(&self, buffer: &str, image: &str) {
        let (mut json, _) = parts(&glb());
        json["buffers"][0]["uri"] = buffer.into();
        json["images"] = json!([{ "uri": image }]);
        std::fs::write(self.path("model/m.gltf"), serde_json::to_vec(&json).unwrap()).unwrap();
    }

    /// What every command that opens a model says of it.
    fn commands(&self) -> Vec<Vec<String>> {
        let (model, out) = (self.text("model/m.gltf"), self.text("out"));
        let picture = self.text("out/p.png");
        let few = ["--size", "8x8", "--spp", "1"];
        let target = self.text("shared/n.png");
        let layer = format!("{target},scale=2");
        let words: [&[&str]; 7] = [
            &["inspect", &model],
            &["bake", &model, "-o", &out],
            &["render", &model, "-o", &picture],
            &["compare", &model, "-o", &out],
            &["skin", &model, "-o", &out],
            &["fuzz", &model, "-o", &out],
            &[
                "detail", "solve", &target, "--kind", "color", "--layer", &layer, "-o", &out, "--model",
                &model,
            ],
        ];
        let drawn = ["render", "skin", "fuzz"];
        let words = words.map(|words| {
            let more: &[&str] = if drawn.contains(&words[0]) { &few } else { &[] };
            words.iter().chain(more).map(|word| (*word).to_owned()).collect()
        });
        words.into()
    }

    fn refused(&self, words: &[String], more: &[&str], parts: &[&str]) {
        let words: Vec<&str> = words.iter().map(String::as_str).chain(more.iter().copied()).collect();
        refused(&words, parts);
        assert!(files(&self.path("out")).is_empty(), "{words:?} wrote {:?}", files(&self.path("out")));
    }
}

#[test]
fn a_model_reads_files_that_are_not_its_own() {
    let models = Models::new();
    let absolute = models.text("shared/m.bin");
    let file = format!("file://{absolute}");
    let commands = models.commands();
    for (uri, part) in [
        ("../shared/m.bin", "outside of the model's folder"),
        ("%2e%2e/shared/m.bin", "outside of the model's folder"),
        ("..%2Fshared/m.bin", "outside of the model's folder"),
        ("..\\shared\\m.bin", "outside of the model's folder"),
        ("..%5Cshared%5Cm.bin", "outside of the model's folder"),
        ("textures/../../shared/m.bin", "outside of the model's folder"),
        ("../not/there.bin", "outside of the model's folder"),
        (absolute.as_str(), "not a relative path"),
        (file.as_str(), "is not relative"),
        ("C:\\shared\\m.bin", "is not relative"),
        ("http://localhost/m.bin", "is not relative"),
    ] {
        models.set(uri, "n.png");
        for words in &commands[..3] {
            models.refused(words, &[], &["m.gltf", "buffer 0", part]);
        }
    }
    // The others, once.
    models.set("m.bin", "../shared/n.png");
    for words in &commands {
        models.refused(words, &[], &["m.gltf", "image 0", "outside", "--allow-outside"]);
    }
    // Inside, whatever the way there.
    for (buffer, image) in
        [("m.bin", "textures/n.png"), ("textures/../m.bin", "textures\\n.png"), ("./m.bin", "../model/n.png")]
    {
        models.set(buffer, image);
        kinran_json(&["inspect", &models.text("model/m.gltf")]);
    }
}

#[test]
#[cfg(unix)]
fn a_link_leads_out_of_the_model_s_folder() {
    let models = Models::new();
    models.set("m.bin", "textures/link.png");
    std::os::unix::fs::symlink(models.path("shared/n.png"), models.path("model/textures/link.png")).unwrap();
    let words = &models.commands()[1];
    models.refused(words, &[], &["textures/link.png", "outside"]);
    std::fs::remove_file(models.path("model/textures/link.png")).unwrap();
    std::os::unix::fs::symlink("../n.png", models.path("model/textures/link.png")).unwrap();
    kinran_json(&["inspect", &models.text("model/m.gltf")]);
    // The whole folder may be reached by a link.
    std::os::unix::fs::symlink(models.path("model"), models.path("linked")).unwrap();
    kinran_json(&["inspect", &models.text("linked/m.gltf")]);
}

#[test]
fn a_folder_that_is_allowed_is_refused() {
    let models = Models::new();
    models.set("../shared/m.bin", "../shared/n.png");
    let allow = format!("--allow-outside={}", models.text("shared"));
    for (i, words) in models.commands().iter().enumerate() {
        // The sheets of skin and fuzz and comparisons are slow.
        if [0, 1, 2, 6].contains(&i) {
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            kinran_json(&[&words, &[allow.as_str()][..]].concat());
        }
    }
    let other = format!("--allow-outside={}", models.text("model/textures"));
    std::fs::remove_dir_all(models.path("out")).unwrap();
    std::fs::create_dir(models.path("out")).unwrap();
    let words = &models.commands()[1];
    models.refused(
        words,
        &[&other],
        &["buffer 0", "outside", &format!("--allow-outside {}", models.text("shared"))],
    );
    models.refused(words, &["--allow-outside=nowhere"], &["--allow-outside nowhere", "no such folder"]);

    // In a manifest, from where it lies.
    let manifest = models.text("kinran.toml");
    let entry = "cache = \"kept\"\n[[mesh]]\ninput = \"model/m.gltf\"\n";
    std::fs::write(&manifest, entry).unwrap();
    let said = kinran(&["bake", &manifest]);
    assert!(said.code == Some(2) && said.err.contains("outside of the model's folder"), "{}", said.err);
    std::fs::write(&manifest, format!("{entry}allow-outside = \"shared\"\n")).unwrap();
    kinran_json(&["bake", &manifest]);
}

#[test]
fn what_is_no_buffer_and_no_image_gets_into_the_output() {
    let models = Models::new();
    let allow = format!("--allow-outside={}", models.text("shared"));
    let commands = models.commands();
    for (buffer, image, part) in [
        ("../shared/passwd", "n.png", "is no buffer by its name"),
        ("notes.toml", "n.png", "is no buffer by its name"),
        ("n.png", "n.png", "is no buffer by its name"),
        ("m.bin", "../shared/key", "is no image"),
    ] {
        models.set(buffer, image);
        for words in &commands[..3] {
            models.refused(words, &[&allow], &[part]);
        }
    }
    // A PNG is one, whatever it is called.
    models.set("m.bin", "../shared/wood");
    kinran_json(&["inspect", &models.text("model/m.gltf"), &allow]);
}

#[test]
fn a_sidecar_names_files_that_lie_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let sidecar =
        json!({ "surfaces": [{ "name": "a", "outputs": [{ "file": "../a.ktx2", "map": "normal" }] }] });
    std::fs::write(folder.path().join("a.kinran.json"), sidecar.to_string()).unwrap();
    let picture = folder.path().join("p.png");
    refused(&["render", text(folder.path()), "-o", text(&picture)], &["../a.ktx2", "does not lie beside it"]);
}

/// A folder of a normal, a roughness and an occlusion map.
fn maps() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let grey = |value: u8| Image::new(32, 32, Channels::R, Pixels::U8(vec![value; 1024])).unwrap();
    for (name, image) in [("a_nor_gl", bumps()), ("a_rough", grey(90)), ("a_ao", grey(200))] {
        std::fs::write(folder.path().join(format!("{name}.png")), encode_png(&image).unwrap()).unwrap();
    }
    folder
}

#[test]
fn what_is_wrong_with_a_mesh_is_told_after_the_textures_are_baked() {
    let folder = tempfile::tempdir().unwrap();
    let (mut json, bin) = parts(&glb());
    json["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    json["buffers"][0]["uri"] = "m.bin".into();
    std::fs::write(folder.path().join("m.bin"), &bin).unwrap();
    let model = folder.path().join("m.gltf");
    std::fs::write(&model, json.to_string()).unwrap();
    let out = folder.path().join("out");
    refused(
        &["bake", text(&model), "-o", text(&out), "--curvature", "all"],
        &["NORMAL", "--estimate-normals"],
    );
    assert!(!out.exists(), "written: {:?}", files(&out));
}

#[test]
fn a_broken_map_is_told_after_the_materials_before_it() {
    let folder = maps();
    std::fs::write(folder.path().join("b_nor_gl.png"), b"\x89PNG\r\n\x1a\n, cut off").unwrap();
    let out = folder.path().join("out");
    refused(&["bake", text(folder.path()), "-o", text(&out)], &["b_nor_gl.png"]);
    assert!(!out.exists(), "written: {:?}", files(&out));
}

/// Everything in a folder.
fn contents(folder: &Path) -> Vec<(String, Vec<u8>)> {
    files(folder).into_iter().map(|f| (f.clone(), std::fs::read(folder.join(f)).unwrap())).collect()
}

#[test]
fn a_file_that_kinran_did_not_write_is_lost() {
    let (folder, model) = square();
    let maps = maps();
    let profile = folder.path().join("p.csv");
    std::fs::write(&profile, "0,1,1,1\n1,0.5,0.5,0.5\n2,0,0,0\n").unwrap();
    let wall = maps.path().join("a_ao.png");
    let layer = format!("{},scale=2", text(&maps.path().join("a_rough.png")));
    let cases: [(&[&str], &str); 5] = [
        (&["bake", text(maps.path()), "--container", "both"], "a_normal.ktx2"),
        (&["bake", text(&model), "--form", "both"], "square.glb"),
        (
            &["bake", text(&model), "--curvature", "all", "--curvature-dump", "json"],
            "square_hammered_roughness.png",
        ),
        (&["skin-lut", "--profile", text(&profile), "--size", "8x8"], "skin.png"),
        (&["detail", "solve", text(&wall), "--kind", "data", "--layer", &layer, "--board"], "a_ao.glb"),
    ];
    for (words, file) in cases {
        let out = tempfile::tempdir().unwrap();
        let out = out.path();
        let words = [words, &["-o", text(out)]].concat();
        // There before the first run.
        std::fs::write(out.join(file), "mine").unwrap();
        refused(&words, &[file, "did not write", "--force"]);
        assert_eq!(contents(out), [(file.to_owned(), b"mine".to_vec())], "{words:?}");
        kinran_json(&[&words[..], &["--force"]].concat());
        // The same again, without a question and to the same bytes.
        let first = contents(out);
        kinran_json(&words);
        assert_eq!(contents(out), first, "{words:?}");
        // Edited since: each file, the report too.
        for (name, bytes) in &first {
            std::fs::write(out.join(name), "edited").unwrap();
            refused(&words, &[name, "--force"]);
            assert_eq!(std::fs::read(out.join(name)).unwrap(), b"edited", "{words:?}");
            std::fs::write(out.join(name), bytes).unwrap();
        }
        kinran_json(&words);
    }
}

/// Who bakes for one engine, then for another, then for the first again has both sets, and knows which are in use.
#[test]
fn files_of_an_earlier_container_are_forgotten() {
    let (_folder, model) = square();
    let (maps, out) = (maps(), tempfile::tempdir().unwrap());
    let wall = maps.path().join("a_ao.png");
    let layer = format!("{},scale=2", text(&maps.path().join("a_rough.png")));
    let cases: [&[&str]; 4] = [
        &["bake", text(maps.path())],
        &["bake", text(&model)],
        &["skin-lut", "--size", "8x8"],
        &["detail", "solve", text(&wall), "--kind", "data", "--layer", &layer],
    ];
    for (i, words) in cases.into_iter().enumerate() {
        let out = out.path().join(i.to_string());
        let run = |container: &str| kinran(&[words, &["-o", text(&out), "--container", container]].concat());
        let named = |extension: &str| -> Vec<String> {
            files(&out).into_iter().filter(|f| f.ends_with(extension)).collect()
        };
        let first = run("ktx2");
        assert_eq!(
            (first.code, first.out.contains("earlier run")),
            (Some(0), false),
            "{words:?}: {}",
            first.err
        );
        let kept = named(".ktx2");
        for (container, stays) in [("dds", kept.clone()), ("ktx2", Vec::new())] {
            let stays = if stays.is_empty() { named(".dds") } else { stays };
            let said = run(container);
            assert_eq!(said.code, Some(0), "{words:?} as {container}: {}", said.err);
            let line = said.out.lines().find(|line| line.contains("earlier run")).unwrap_or_default();
            let wanted = &stays[0];
            assert!(line.contains(wanted), "{words:?} as {container}: wanted {wanted}, got {}", said.out);
        }
        assert_eq!(named(".ktx2"), kept, "{words:?}");
        // What somebody edits in the meantime is no longer Kinran's.
        std::fs::write(out.join(&kept[0]), "mine").unwrap();
        assert_eq!(run("dds").code, Some(0), "{words:?}");
        refused(&[words, &["-o", text(&out)]].concat(), &[&kept[0], "--force"]);
    }
}

#[test]
fn shaders_and_pages_of_others_are_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path());
    let words = ["shaders", "--lang", "wgsl", "-o", out];
    std::fs::write(folder.path().join("README.md"), "my project").unwrap();
    refused(&words, &["README.md", "--force"]);
    assert_eq!(files(folder.path()), ["README.md"]);
    kinran_json(&[&words[..], &["--force"]].concat());
    kinran_json(&words);
    std::fs::write(folder.path().join("index.html"), "<title>My page</title>").unwrap();
    refused(&["demo", "--quick", "-o", out], &["index.html", "did not write"]);
    refused(&["detail", "report", out, "-o", out], &["index.html", "did not write"]);
}

#[test]
fn a_picture_takes_the_place_of_an_input() {
    let models = Models::new();
    models.set("m.bin", "n.png");
    let (model, picture) = (models.text("model/m.gltf"), models.text("model/n.png"));
    refused(&["render", &model, "-o", &picture], &["n.png", "would be overwritten"]);
    refused(&["render", &models.text("model"), "-o", &picture], &["n.png", "would be overwritten"]);
    std::fs::rename(models.path("model/n.png"), models.path("model/density.png")).unwrap();
    models.set("m.bin", "density.png");
    refused(&["fuzz", &model, "-o", &models.text("model")], &["density.png", "would be overwritten"]);
    std::fs::rename(models.path("model/density.png"), models.path("model/turn.png")).unwrap();
    models.set("m.bin", "turn.png");
    refused(&["skin", &model, "-o", &models.text("model")], &["turn.png", "would be overwritten"]);
    std::fs::rename(models.path("model/turn.png"), models.path("model/truth_x1.png")).unwrap();
    models.set("m.bin", "truth_x1.png");
    refused(&["compare", &model, "-o", &models.text("model")], &["truth_x1.png", "would be overwritten"]);
    // One's own earlier picture is nothing to ask about.
    let picture = models.text("out/p.png");
    for _ in 0..2 {
        kinran_json(&["render", &model, "-o", &picture, "--size", "8x8", "--spp", "1"]);
    }
}

#[test]
fn two_materials_share_a_file() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a+b_nor_gl.png", "a=b_nor_gl.png"] {
        std::fs::write(folder.path().join(name), encode_png(&bumps()).unwrap()).unwrap();
    }
    let out = folder.path().join("out");
    refused(&["bake", text(folder.path()), "-o", text(&out)], &["a_b.kinran.json", "two materials"]);
}

#[test]
fn what_no_map_gives_is_metal_and_rough_in_silence() {
    let folder = maps();
    let out = tempfile::tempdir().unwrap();
    let bake = |more: &[&str]| {
        let words = ["bake", text(folder.path()), "-o", text(out.path()), "--aniso-format", "rgba8"];
        kinran_json(&[&words[..], more].concat())
    };
    let orm = || read_texture(&out.path().join("a_orm.ktx2")).unwrap().decode_level(0).unwrap()[0];
    let reports = bake(&[]);
    assert_eq!(reports["warnings"], json!([]), "nothing is open");
    let [_, _, metal, _] = orm();
    assert_eq!(metal, 0.0, "without a map of it there is no metal");

    // No roughness: 0.5 is assumed, and told in the table, in the report and on standard error.
    std::fs::remove_file(folder.path().join("a_rough.png")).unwrap();
    let assumed = "a: no roughness map, 0.5 is assumed";
    let reports = bake(&[]);
    assert!(reports["warnings"][0].as_str().unwrap().starts_with(assumed), "{}", reports["warnings"]);
    let said = kinran(&["bake", text(folder.path()), "-o", text(out.path())]);
    assert!(said.err.contains(assumed), "{}", said.err);
    assert!(said.out.contains("warning: no map, 0.5 is assumed"), "{}", said.out);
    // Nor where there is nothing but occlusion to pack it with.
    std::fs::remove_file(folder.path().join("a_nor_gl.png")).unwrap();
    assert!(bake(&[])["warnings"][0].as_str().unwrap().starts_with(assumed));
    let [occlusion, roughness, metal, _] = orm().map(|v| (v * 255.0).round());
    assert_eq!([occlusion, roughness, metal], [200.0, 128.0, 0.0]);
    assert_eq!(bake(&["--roughness", "0.2"])["warnings"], json!([]));
    assert_eq!((orm()[1] * 255.0).round(), 51.0);
}

#[test]
fn output_that_nobody_named_a_place_for_is_not_told() {
    let (folder, model) = square();
    let place = |name: &str| folder.path().join(name);
    let maps = place("maps");
    std::fs::create_dir(&maps).unwrap();
    for name in ["a_nor_gl.png", "a_color.png"] {
        std::fs::write(maps.join(name), encode_png(&bumps()).unwrap()).unwrap();
    }
    let profile = place("p.csv");
    std::fs::write(&profile, "0,1,1,1\n1,0.5,0.5,0.5\n2,0,0,0\n").unwrap();
    let (color, layer) = (maps.join("a_color.png"), format!("--layer={}", text(&maps.join("a_color.png"))));
    let report = place("library");
    std::fs::create_dir(&report).unwrap();
    std::fs::create_dir(report.join("tin")).unwrap();
    std::fs::copy(&color, report.join("tin/tin_color.png")).unwrap();
    let (model, few) = (text(&model), ["--size", "8x8", "--spp", "1"]);
    let cases: [(&[&str], &[&str], &str); 9] = [
        (&["bake", model], &[], "baked/square.glb"),
        (&["bake", text(&maps)], &[], "baked/a_normal.ktx2"),
        (&["render", model], &few, "square.render.png"),
        (&["compare", model, "--truth-spp", "1", "--distances", "1"], &few, "square.compare/compare.png"),
        (&["fuzz", model, "--sheet", "density"], &few, "square.fuzz/density.png"),
        (&["skin", model, "--sheet", "shadows"], &few, "square.skin/shadows.png"),
        (&["skin-lut", "--profile", text(&profile), "--size", "8x8"], &[], "baked/skin.png"),
        (&["detail", "solve", text(&color), &layer], &[], "maps/baked/a_color.detail.json"),
        (
            &["detail", "report", text(&report), "--size", "16", "--format", "bc1"],
            &[],
            "library.report/index.html",
        ),
    ];
    for (words, more, file) in cases {
        let said = kinran(&[words, more].concat());
        assert_eq!(said.code, Some(0), "{words:?}: {}", said.err);
        assert!(place(file).is_file(), "{words:?}: no {file}; {}", said.err);
        let top = place(file.strip_suffix("/compare.png").unwrap_or(file));
        let told =
            text(if top.is_file() && !file.ends_with(".render.png") { top.parent().unwrap() } else { &top });
        assert!(
            said.err.contains("no --output was given") && said.err.contains(told),
            "{words:?}: {}",
            said.err
        );
        // Who is quiet, or named a place, hears nothing of it.
        let quiet = kinran(&[words, more, &["--quiet"]].concat());
        assert_eq!((quiet.code, quiet.err.as_str()), (Some(0), ""), "{words:?}");
    }
}

/// The bytes that a library's files are said to take, and those that they take.
#[test]
fn a_library_does_not_know_what_it_will_take() {
    let (folder, _) = square();
    let place = |name: &str| folder.path().join(name);
    std::fs::create_dir_all(place("maps/a")).unwrap();
    for (name, image) in [("a_nor_gl", bumps()), ("a_color", bumps())] {
        std::fs::write(place("maps/a").join(format!("{name}.png")), encode_png(&image).unwrap()).unwrap();
    }
    std::fs::write(place("maps/tile.png"), encode_png(&bumps()).unwrap()).unwrap();
    let entries = [
        "[[aniso]]\ninput = \"maps/a\"\nform = \"both\"\ncontainer = \"both\"\n",
        "[[mesh]]\ninput = \"square.glb\"\nall-textures = true\n",
        "[[detail]]\ninput = \"maps/tile.png\"\nkind = \"color\"\nlayer = [\"maps/a/a_color.png\"]\npictures = true\n",
        "[[skin]]\nsize = \"64x64\"\npenumbra = true\n",
    ];
    let manifest = place("kinran.toml");
    let (cache, out) = (place("cache"), place("baked"));
    let args = ["bake", text(&manifest), "--cache", text(&cache)];
    for entry in entries {
        std::fs::write(&manifest, entry).unwrap();
        let dry = kinran_json(&[&args[..], &["--dry-run"]].concat());
        let wet = kinran_json(&args);
        assert_eq!(dry["space"], wet["space"], "{entry}");
        let [least, most] = ["least", "most"].map(|key| wet["space"][key].as_u64().unwrap());
        let files = wet["entries"][0]["files"].as_array().unwrap();
        let bytes: u64 = files.iter().map(|file| file["bytes"].as_u64().unwrap()).sum();
        // Reports and plots are small.
        let small: u64 = files
            .iter()
            .filter(|file| file["name"].as_str().unwrap().ends_with(".json") || file["name"] == "skin.png")
            .map(|file| file["bytes"].as_u64().unwrap())
            .sum();
        assert!(0 < least && least <= bytes, "{entry}: {least} bytes at least, {bytes} written: {files:#?}");
        // A small texture is its header; a PNG of noise is larger than its texels.
        let headers = 700 * files.len() as u64;
        assert!(
            bytes <= most + small + headers,
            "{entry}: {most} bytes at most, {bytes} written: {files:#?}"
        );

        // What stands is replaced, and what is kept is known to the byte.
        let nothing = serde_json::json!({ "least": 0, "most": 0 });
        assert_eq!(kinran_json(&args)["space"], nothing, "{entry}");
        std::fs::remove_dir_all(&out).unwrap();
        let kept = kinran_json(&[&args[..], &["--dry-run"]].concat());
        assert_eq!(kept["space"], serde_json::json!({ "least": bytes, "most": bytes }), "{entry}");
        let said = kinran(&[&args[..], &["--dry-run"]].concat());
        assert!(said.out.contains("the files will take"), "{}", said.out);
    }
}

/// The beginning of a PNG of so many texels along a side: enough to know its size.
fn png_header(side: u32) -> Vec<u8> {
    let size = [side.to_be_bytes(), side.to_be_bytes()].concat();
    let header = png_chunk(b"IHDR", &[&size[..], &[8, 2, 0, 0, 0]].concat());
    [&b"\x89PNG\r\n\x1a\n"[..], &header, &png_chunk(b"IDAT", &[])].concat()
}

fn png_chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let chunk = [name, data].concat();
    // CRC-32 as PNG has it.
    let crc = chunk.iter().fold(u32::MAX, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & 0_u32.wrapping_sub(crc & 1)))
    });
    let length = u32::try_from(data.len()).unwrap().to_be_bytes();
    [&length[..], &chunk, &(!crc).to_be_bytes()].concat()
}

#[test]
fn a_library_fills_the_disk_before_it_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let add = |from: u64, to: u64| {
        for i in from..to {
            std::fs::create_dir_all(place(&format!("maps/m{i}"))).unwrap();
            std::fs::write(place(&format!("maps/m{i}/m_nor_gl.png")), png_header(16384)).unwrap();
        }
    };
    let manifest = place("kinran.toml");
    let flags =
        "container = \"dds\"\nform = \"both\"\nnormal-format = \"rgba16f\"\naniso-format = \"rgba16f\"\n";
    std::fs::write(&manifest, format!("[defaults]\n{flags}[[aniso]]\ninput = \"maps/*\"\n")).unwrap();
    let (cache, out) = (place("cache"), place("baked"));
    let args = ["bake", text(&manifest), "--cache", text(&cache)];
    add(0, 1);
    let one = kinran_json(&[&args[..], &["--dry-run"]].concat())["space"]["least"].as_u64().unwrap();
    // Four textures of eight bytes a texel, and a third for their mips.
    assert!(one > 4 * 8 * 16384 * 16384, "{one} bytes");
    let free = fs4::available_space(folder.path()).unwrap();
    let count = free / one + 2;
    if count > 5000 {
        return;
    }
    add(1, count);
    refused(&args, &["baked", "take at least", "free some space"]);
    assert!(files(folder.path()).iter().all(|name| name != "cache"), "something was kept");
    let written = if out.exists() { files(&out) } else { Vec::new() };
    assert!(written.iter().all(|name| name == ".kinran"), "{written:?}");
}

/// A report speaks for its own files: what another model brought along is not overwritten under the same name.
#[test]
fn a_texture_of_another_model_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let path = |name: &str| folder.path().join(name);
    let model = |name: &str, value: u8| {
        std::fs::create_dir(path(name)).unwrap();
        let grey = Image::new(4, 4, Channels::R, Pixels::U8(vec![value; 16])).unwrap();
        write_png(&path(name).join("base.png"), &grey).unwrap();
        let json = r#"{"asset":{"version":"2.0"},"images":[{"uri":"base.png"}],"textures":[{"source":0}],
            "materials":[{"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}}]}"#;
        let file = path(name).join(format!("{name}.gltf"));
        std::fs::write(&file, json).unwrap();
        file
    };
    let (lamp, chair) = (model("lamp", 20), model("chair", 200));
    kinran_json(&["bake", text(&lamp), "-o", text(&out)]);
    let before = std::fs::read(out.join("base.png")).unwrap();
    refused(&["bake", text(&chair), "-o", text(&out)], &["base.png", "did not write this file"]);
    assert_eq!(std::fs::read(out.join("base.png")).unwrap(), before);
    // Its own it writes again, and a file that is the same is shared.
    kinran_json(&["bake", text(&lamp), "-o", text(&out)]);
    std::fs::copy(path("lamp/base.png"), path("chair/base.png")).unwrap();
    kinran_json(&["bake", text(&chair), "-o", text(&out)]);
}

#[test]
fn a_file_in_the_way_of_a_library_a_comparison_or_a_page_is_lost() {
    let maps = maps();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let manifest = path("kinran.toml");
    std::fs::write(&manifest, format!("[[aniso]]\ninput = '{}'\n", text(maps.path()))).unwrap();
    let cache = path("cache");
    let bake = ["bake", text(&manifest), "--cache", text(&cache), "--json"];
    let report = kinran_json(&bake[..4]);
    let entry = path("baked").join(report["entries"][0]["folder"].as_str().unwrap());
    let name = report["entries"][0]["files"][0]["name"].as_str().unwrap();
    // As somebody has it who put a file there before, with a cache and without.
    for keep_cache in [true, false] {
        std::fs::remove_dir_all(path("baked")).unwrap();
        if !keep_cache {
            std::fs::remove_dir_all(&cache).unwrap();
        }
        std::fs::create_dir_all(&entry).unwrap();
        std::fs::write(entry.join(name), "mine").unwrap();
        let said = kinran(&bake);
        assert!(
            said.code == Some(2) && said.out.contains("did not write this file"),
            "{}{}",
            said.out,
            said.err
        );
        assert_eq!(std::fs::read(entry.join(name)).unwrap(), b"mine");
    }

    let models = Models::new();
    models.set("m.bin", "n.png");
    let out = path("numbers");
    std::fs::create_dir(&out).unwrap();
    std::fs::write(out.join("compare.json"), "{}").unwrap();
    refused(&["compare", &models.text("model/m.gltf"), "-o", text(&out)], &["compare.json", "--force"]);
    std::fs::write(out.join("kinran.1"), "mine").unwrap();
    refused(&["man", "-o", text(&out)], &["kinran.1", "did not write"]);
}

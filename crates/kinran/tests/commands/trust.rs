//! What inputs are trusted with, and what is refused before anything is written.

use std::path::{Path, PathBuf};

use kinran_image::{Channels, Image, Pixels, encode_png, read_texture};
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
            &["detail", "solve", &target, "--layer", &layer, "-o", &out, "--model", &model],
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

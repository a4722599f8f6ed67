//! What is wrong is said once, in one line, and nothing is written.

use std::process::{Command, Stdio};

use crate::common::{files, glb, kinran, refused, square, text};

#[test]
fn models_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let inputs = folder.path().join("in");
    let outputs = folder.path().join("out");
    std::fs::create_dir(&inputs).unwrap();
    std::fs::create_dir(&outputs).unwrap();
    let glb = glb();
    std::fs::write(inputs.join("truncated.glb"), &glb[..glb.len() / 2]).unwrap();
    std::fs::write(inputs.join("empty.glb"), []).unwrap();
    std::fs::write(inputs.join("noise.gltf"), [0x9f; 300]).unwrap();
    std::fs::write(inputs.join("no_mesh.gltf"), br#"{"asset":{"version":"2.0"}}"#).unwrap();
    std::fs::create_dir(inputs.join("folder.glb")).unwrap();

    let (picture, comparison) = (outputs.join("p.png"), outputs.join("c"));
    for name in ["missing.glb", "truncated.glb", "empty.glb", "noise.gltf", "no_mesh.gltf", "folder.glb"] {
        let path = inputs.join(name);
        refused(&["render", text(&path), "-o", text(&picture)], &[name]);
        refused(&["compare", text(&path), "-o", text(&comparison)], &[name]);
        if name != "no_mesh.gltf" {
            refused(&["inspect", text(&path)], &[name]);
        }
    }
    assert!(files(&outputs).is_empty(), "written: {:?}", files(&outputs));
}

#[test]
fn textures_and_images_that_cannot_be_read_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.ktx2", "a.dds", "a.png", "a.jpg", "a.tga", "a.tif", "a.hdr", "a.exr"] {
        let path = folder.path().join(name);
        refused(&["inspect", text(&path)], &[name]);
        std::fs::write(&path, [7; 40]).unwrap();
        refused(&["inspect", text(&path)], &[name]);
    }
    let path = folder.path().join("notes.txt");
    std::fs::write(&path, "hello").unwrap();
    refused(&["inspect", text(&path)], &["notes.txt", ".ktx2"]);
    refused(&["inspect", text(folder.path())], &["is a folder"]);
    refused(
        &["inspect", text(&folder.path().join("a.png")), "--role", "normal"],
        &["a.png", "--role normal"],
    );
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_any_work() {
    let (folder, model) = square();
    let render = |out: &str, parts: &[&str]| refused(&["render", text(&model), "-o", out], parts);
    render(text(&folder.path().join("p.jpg")), &["p.jpg", ".png or .exr"]);
    render(text(&folder.path().join("p")), &["must end in"]);
    std::fs::create_dir(folder.path().join("p.png")).unwrap();
    render(text(&folder.path().join("p.png")), &["p.png", "is a folder"]);
    refused(&["compare", text(&model), "-o", text(&model)], &["square.glb", "is a file"]);
    render(text(&model.join("p.png")), &["square.glb", "is a file; name a folder"]);
    assert_eq!(files(folder.path()), ["p.png", "square.glb"]);
    // A folder where not even root can write.
    if cfg!(target_os = "linux") {
        render("/proc/p.png", &["/proc"]);
        refused(&["compare", text(&model), "-o", "/proc/kinran/c"], &["/proc"]);
    }
}

/// A picture of a model that has no folder yet, and one whose making fails.
#[test]
fn a_folder_must_be_made_by_hand_or_stays_behind_empty() {
    let (folder, model) = square();
    let place = |name: &str| folder.path().join(name);
    let small = ["--size", "8", "--spp", "1"];
    for name in ["a/b/p.png", "c/p.exr"] {
        let said = kinran(&[&["render", text(&model), "-o", text(&place(name))], &small[..]].concat());
        assert!(said.code == Some(0) && place(name).is_file(), "{name}: {}", said.err);
    }
    let (table, plots) = (place("d/table.exr"), place("e/plots.svg"));
    let fit = ["fit", "fuzz", "--tilt", "30", "--spread", "0.2", "--table", text(&table), "--plots"];
    let said = kinran(&[&fit[..], &[text(&plots)]].concat());
    assert!(said.code == Some(0) && table.is_file() && plots.is_file(), "{}", said.err);

    // A folder in the place of a picture, of which nobody knows before it is written.
    let none = place("f/g");
    refused(&["render", text(&place("gone.glb")), "-o", text(&none.join("p.png"))], &["gone.glb"]);
    refused(&["detail", "report", text(folder.path()), "-o", text(&none)], &["no folder with maps"]);
    assert!(!place("f").exists(), "an empty folder stayed behind");
}

#[test]
fn flags_that_make_no_sense_are_named() {
    let (folder, model) = square();
    let out = folder.path().join("p.png");
    for (flag, value) in [
        ("--size", "0x10"),
        ("--size", "huge"),
        ("--spp", "0"),
        ("--filter", "best"),
        ("--tonemap", "film"),
        ("--from", "0,0,0"),
        ("--from", "nan,0,1"),
        ("--fov", "180"),
        ("--distance", "0"),
        ("--distance", "inf"),
        ("--exposure", "nan"),
        ("--light", "up"),
        ("--background", "env:400"),
        ("--max-anisotropy", "17"),
        ("--env-samples", "-1"),
        ("--threads", "0"),
        ("--sharpness", "3"),
    ] {
        refused(&["render", text(&model), "-o", text(&out), &format!("{flag}={value}")], &[flag]);
    }
    refused(&["render", text(&model), "-o", text(&out), "--camera", "0"], &["square.glb", "--camera 0"]);
    refused(&["render", text(&model), "-o", text(&out), "--env", "gone.hdr"], &["gone.hdr"]);
    refused(&["render", text(&model), "-o", text(&out), "--env", text(&model)], &["square.glb"]);
    refused(&["compare", text(&model), "-o", text(&out), "--filters", "ml,,naive"], &["--filters"]);
    refused(&["compare", text(&model), "-o", text(&out), "--distances", "0.5"], &["--distances"]);
    refused(&["render"], &["<FILE>"]);
    refused(&["bak", text(&model)], &["bak"]);
    assert_eq!(files(folder.path()), ["square.glb"]);
}

#[test]
fn a_reader_that_hangs_up_is_no_error() {
    let (_folder, model) = square();
    let mut child = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["inspect", text(&model), "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let err = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && err.is_empty(), "{:?}: {err}", output.status);
}

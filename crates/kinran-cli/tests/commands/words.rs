//! Words that people read: of files that are not there, of what cannot be read, of one and of several.

use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};

use kinran_image::{Channels, Image, Pixels, write_png};

use crate::common::{bumps, glb, kinran, refused, square, text};

#[test]
fn a_missing_file_is_told_in_a_way_of_each_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| text(&folder.path().join(name)).to_owned();
    let (image, model) = (path("nope.png"), path("nope.glb"));
    let (home, manifest) = (path("nope"), path("nope.toml"));
    let told = |name: &str| format!("{name}: there is no such file or folder");
    for (words, missing) in [
        (vec!["render", &model, "-o", &image], &model),
        (vec!["bake", &model], &model),
        (vec!["bake", &home], &home),
        (vec!["bake", &manifest], &manifest),
        (vec!["compare", &model], &model),
        (vec!["skin", &model], &model),
        (vec!["fuzz", &model], &model),
        (vec!["inspect", &image], &image),
        (vec!["inspect", &model], &model),
        (vec!["init", &home], &home),
        (vec!["detail", "solve", &image, "--layer", &image], &image),
        (vec!["detail", "report", &home], &home),
    ] {
        refused(&words, &[&told(missing)]);
    }
}

#[test]
fn what_is_no_model_is_called_broken() {
    let folder = tempfile::tempdir().unwrap();
    for (command, name) in [("skin", "ball.stl"), ("render", "x.png"), ("compare", "x.fbx")] {
        let path = folder.path().join(name);
        std::fs::write(&path, "solid ball").unwrap();
        let (_, extension) = name.split_once('.').unwrap();
        let wanted = format!("{name}: `.{extension}` is not read; give .glb, .gltf or .obj");
        refused(&[command, text(&path)], &[&wanted]);
    }
}

#[test]
fn a_model_that_was_written_is_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bare.glb");
    // A name of the same length that means nothing.
    let bytes = glb();
    let at = bytes.windows(13).position(|word| word == b"normalTexture").unwrap();
    let bare = [&bytes[..at], b"anormalThings", &bytes[at + 13..]].concat();
    std::fs::write(&path, bare).unwrap();
    let said = kinran(&["bake", text(&path), "-o", text(&folder.path().join("out"))]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(said.out.contains("1 file, ") && !said.out.contains("0.0 KiB"), "{}", said.out);
}

#[test]
fn one_is_told_as_many_and_what_is_not_marked_as_marked() {
    let (folder, model) = square();
    let picture = folder.path().join("a.png");
    let said = kinran(&["render", text(&model), "-o", text(&picture), "--size", "8", "--spp", "1"]);
    assert!(said.out.contains(" 1 sample a pixel, 2 triangles"), "{}{}", said.out, said.err);

    let few = ["render", text(&model), "-o", text(&picture), "--spp", "0"];
    refused(&few, &["--spp", "0 is not from 1 to 1048576"]);

    let out = folder.path().join("out");
    let few = ["--size", "8", "--distances", "1", "--filters", "ml"];
    let said = kinran(&[&["compare", text(&model), "-o", text(&out)], &few[..]].concat());
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(!said.out.contains("is marked") && said.out.contains("\"Noise\""), "{}", said.out);
}

#[test]
fn a_folder_with_one_model_is_drawn_but_not_compared() {
    let (folder, _model) = square();
    let out = folder.path().join("out");
    let few = ["--size", "8", "--distances", "1", "--filters", "linear", "--truth-spp", "8", "--spp", "8"];
    let said = kinran(&[&["compare", text(folder.path()), "-o", text(&out)], &few[..]].concat());
    assert_eq!(said.code, Some(0), "{}", said.err);
}

#[test]
fn a_model_hides_the_files_that_its_mips_are_in() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    let baked = out.join("square.glb");
    assert_eq!(kinran(&["bake", text(&model), "-o", text(&out), "--filter", "linear"]).code, Some(0));
    let said = kinran(&["inspect", text(&baked)]);
    assert!(
        said.out.contains("square_hammered_normal.ktx2: bc5") && said.out.contains("filter linear"),
        "{}",
        said.out
    );
    assert!(!kinran(&["inspect", text(&model)]).out.contains("mips in"));
}

#[test]
fn a_dry_run_finds_less_than_the_bake() {
    let folder = tempfile::tempdir().unwrap();
    let photo = Image::new(8, 8, Channels::Rgb, Pixels::U8((0..192).map(|i| (i * 37 % 251) as u8).collect()))
        .unwrap();
    write_png(&folder.path().join("tin_normal.png"), &photo).unwrap();
    let out = folder.path().join("out");
    for more in ["--quiet", "--dry-run"] {
        let words = ["bake", text(folder.path()), "-o", text(&out), "--roughness", "0.5", more];
        refused(&words, &["tin_normal.png", "normal"]);
    }
}

#[test]
fn a_flag_for_colours_that_are_not_baked_is_swallowed() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    for flags in [["--alpha-coverage", "0.5"], ["--alpha-coverage", "off"], ["--color-format", "rgba8"]] {
        let wanted = format!("{} has nothing to act on", flags[0]);
        for more in ["--filter=linear", "--dry-run"] {
            let words = [&["bake", text(&model), "-o", text(&out)], &flags[..], &[more]].concat();
            let said = kinran(&words);
            let is_told = said.err.contains(&wanted) && said.err.contains("--all-textures");
            assert!(said.code == Some(0) && is_told, "{words:?}: wanted {wanted}: {}", said.err);
            let said = kinran(&[&words[..], &["--all-textures"]].concat());
            assert!(!said.err.contains("nothing to act on"), "{words:?} --all-textures: {}", said.err);
        }
    }
    for wrong in ["1.5", "-0.1", "nan", "half"] {
        let given = format!("--alpha-coverage={wrong}");
        refused(&["bake", text(&model), "-o", text(&out), &given], &["--alpha-coverage", "0 to 1"]);
    }
}

#[test]
fn a_flag_for_maps_that_are_not_there_is_swallowed() {
    let folder = tempfile::tempdir().unwrap();
    let grey = Image::new(4, 4, Channels::R, Pixels::U8(vec![90; 16])).unwrap();
    write_png(&folder.path().join("tin_roughness.png"), &grey).unwrap();
    let out = folder.path().join("out");
    let cases: [&[&str]; 9] = [
        &["--roughness", "0.3"],
        &["--y-down"],
        &["--y-up"],
        &["--normal-blue"],
        &["--force-normal"],
        &["--direction-span", "180"],
        &["--color-space", "linear"],
        &["--color-format", "rgba8"],
        &["--alpha-coverage", "0.5"],
    ];
    for flags in cases {
        for more in [&["-v"][..], &["--dry-run"]] {
            let words = [&["bake", text(folder.path()), "-o", text(&out)], flags, more].concat();
            let said = kinran(&words);
            let wanted = format!("{} has nothing to act on", flags[0]);
            assert!(
                said.code == Some(0) && said.err.contains(&wanted),
                "{words:?}: wanted {wanted}: {}",
                said.err
            );
        }
    }
    let said = kinran(&["bake", text(folder.path()), "-o", text(&out)]);
    assert!(!said.err.contains("nothing to act on"), "{}", said.err);
    let model = folder.path().join("a.glb");
    let words = ["render", text(&model), "--shaders", text(folder.path())];
    refused(&words, &["--shaders", "needs --backend gpu"]);
    let gone = folder.path().join("gone");
    let words = ["render", text(&model), "--backend", "gpu", "--shaders", text(&gone)];
    refused(&words, &["gone", "no such folder"]);
}

#[test]
fn a_report_lies_nobody_knows_where() {
    let folder = tempfile::tempdir().unwrap();
    let (library, out) = (folder.path().join("library"), folder.path().join("out"));
    std::fs::create_dir_all(library.join("tin")).unwrap();
    write_png(&library.join("tin/tin_color.png"), &bumps()).unwrap();
    let few = ["--size", "16", "--format", "bc1", "--no-pictures"];
    let said = kinran(&[&["detail", "report", text(&library), "-o", text(&out)], &few[..]].concat());
    let wanted = format!("wrote {}, ", out.join("index.html").display());
    assert!(said.out.contains(&wanted), "wanted {wanted} in {}{}", said.out, said.err);
}

/// Whoever reads a log knows after a few seconds what is being done, and how far it is.
#[test]
fn a_pipe_hears_nothing_of_long_work_or_sees_bars() {
    let (folder, model) = square();
    let picture = folder.path().join("p.png");
    let mut child = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(["render", text(&model), "-o", text(&picture), "--size", "512", "--spp", "1000000"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Before it is drawn it is read and baked, which a busy machine may tell of too.
    let lines = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    let told = lines.take(10).find(|line| line.contains("render: "));
    child.kill().unwrap();
    child.wait().unwrap();
    let line = told.expect("no line");
    assert!(line.contains(" %, ") && !line.contains('\u{1b}'), "{line:?}");
}

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
    for more in ["--filter=linear", "--dry-run"] {
        let words = ["bake", text(&model), "-o", text(&out), "--separate-specular", more];
        let said = kinran(&words);
        let wanted = "--separate-specular has nothing to act on: no colour is baked; --all-textures";
        assert!(said.code == Some(0) && said.err.matches(wanted).count() == 1, "{words:?}: {}", said.err);
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

#[test]
fn a_flag_that_changes_no_picture_is_swallowed() {
    let (folder, model) = square();
    let baked = folder.path().join("baked");
    assert_eq!(kinran(&["bake", text(&model), "-o", text(&baked)]).code, Some(0));
    let baked = baked.join("square.glb");
    let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    for (model, picture, flags) in [
        (&model, &png, &["--filter", "none", "--max-anisotropy", "4"][..]),
        (&model, &png, &["--filter", "none", "--correlated", "off"]),
        (&baked, &png, &["--correlated", "off"]),
        (&model, &png, &["--skin-penumbra", "2"]),
    ] {
        let flag = if flags[0] == "--filter" { flags[2] } else { flags[0] };
        let words = [&["render", text(model), "-o", text(picture)], flags].concat();
        refused(&words, &[flag, "leave the flag out"]);
    }
    for flags in [["--exposure", "1"], ["--tonemap", "agx"]] {
        let few = ["--size", "8", "--spp", "1"];
        let said = kinran(&[&["render", text(&model), "-o", text(&exr)], &flags[..], &few].concat());
        assert!(said.err.contains(&format!("{} has nothing to act on", flags[0])), "{}", said.err);
    }
    for (flags, said) in [
        (&["--skin-penumbra", "2"][..], "no material is skin"),
        (&["--env", "none", "--env-rotation", "20"], "no light from all around"),
        (&["--filters", "ml,naive,ml"], "names ml twice"),
        (&["--distances", "1,2,1"], "has 1 twice"),
    ] {
        refused(&[&["compare", text(&model)], flags].concat(), &[said]);
    }
    let out = folder.path().join("out");
    let words = ["bake", text(&model), "-o", text(&out), "--container", "dds", "--zstd", "9"];
    refused(&words, &["--zstd 9", "DDS files are not compressed"]);
    let said = kinran(&["bake", text(&model), "-o", text(&out), "--estimate-normals"]);
    assert!(said.err.contains("--estimate-normals has nothing to act on"), "{}", said.err);
}

#[test]
fn a_flag_for_maps_that_are_as_they_should_be_is_swallowed() {
    let folder = tempfile::tempdir().unwrap();
    let color = |alpha: u8| {
        let samples = (0..64).flat_map(|i| [200, 40, 30, if i % 2 == 0 { alpha } else { 255 }]).collect();
        Image::new(8, 8, Channels::Rgba, Pixels::U8(samples)).unwrap()
    };
    write_png(&folder.path().join("tin_normal.png"), &bumps()).unwrap();
    write_png(&folder.path().join("tin_color.png"), &color(255)).unwrap();
    let out = folder.path().join("out");
    let bake =
        |flags: &[&str]| kinran(&[&["bake", text(folder.path()), "-o", text(&out)], flags].concat()).err;
    for flags in [&["--force-normal"][..], &["--alpha-coverage", "0.5"]] {
        let wanted = format!("{} has nothing to act on", flags[0]);
        let said = bake(flags);
        assert!(said.contains(&wanted), "{flags:?}: wanted {wanted}: {said}");
        let said = bake(&[flags, &["--dry-run"]].concat());
        assert!(said.contains(&wanted), "{flags:?} --dry-run: wanted {wanted}: {said}");
    }
    write_png(&folder.path().join("tin_color.png"), &color(0)).unwrap();
    let said = bake(&["--alpha-coverage", "0.5"]);
    assert!(!said.contains("nothing to act on"), "{said}");
}

#[test]
fn a_picture_that_somebody_else_drew_is_lost() {
    let (folder, model) = square();
    let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    write_png(&png, &bumps()).unwrap();
    std::fs::write(&exr, b"v/1\x01 of another program").unwrap();
    let few = ["--size", "8", "--spp", "1"];
    for picture in [&png, &exr] {
        let before = std::fs::read(picture).unwrap();
        let words = [&["render", text(&model), "-o", text(picture)], &few[..]].concat();
        refused(&words, &["did not draw this picture", "--force"]);
        assert_eq!(std::fs::read(picture).unwrap(), before);
        // Its own it draws again, also where the first time was by force.
        for more in [&["--force"][..], &[]] {
            let said = kinran(&[&words[..], more].concat());
            assert_eq!(said.code, Some(0), "{}", said.err);
        }
    }
    let out = folder.path().join("out");
    std::fs::create_dir(&out).unwrap();
    for (command, file) in [("compare", "compare.png"), ("skin", "turn.png"), ("fuzz", "density.png")] {
        write_png(&out.join(file), &bumps()).unwrap();
        refused(&[command, text(&model), "-o", text(&out)], &[file, "did not draw this picture"]);
    }
}

#[test]
fn what_is_no_folder_of_maps_is_told_no_way() {
    let folder = tempfile::tempdir().unwrap();
    for (name, way) in [
        ("brick.zip", "unpack it"),
        ("brick.sbsar", "export its maps"),
        ("brick.fbx", "save it as .glb"),
        ("brick_normal.png", "put the maps of a material into a folder"),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, "any").unwrap();
        refused(&["bake", text(&path)], &[name, way]);
    }
    refused(&["inspect", text(folder.path())], &["is a folder", "--dry-run"]);
    let baked = folder.path().join("baked");
    std::fs::create_dir(&baked).unwrap();
    std::fs::write(baked.join("lamp.glb"), glb()).unwrap();
    refused(&["inspect", text(&baked)], &["is a folder", "lamp.glb"]);
    let said = kinran(&["inspect", "--check", text(&baked.join("lamp.glb"))]);
    assert!(said.code == Some(0) && said.out.contains("no rule was looked at"), "{}{}", said.out, said.err);
}

#[test]
fn a_model_with_torn_images_cannot_be_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let json = r#"{"asset":{"version":"2.0"},
        "images":[{"uri":"gone.png"},{"uri":"lost.png"},{"uri":"torn.png"}],
        "textures":[{"source":0},{"source":1},{"source":2}],
        "materials":[{"name":"m","alphaMode":"MASK","doubleSided":true,"normalTexture":{"index":0},
        "occlusionTexture":{"index":1},"pbrMetallicRoughness":{"metallicFactor":0.25,"baseColorTexture":{"index":2}}}]}"#;
    std::fs::write(&path, json).unwrap();
    std::fs::write(folder.path().join("torn.png"), b"\x89PNG\r\n").unwrap();
    let said = kinran(&["inspect", text(&path)]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    for wanted in [
        "gone.png",
        "lost.png",
        "torn.png",
        "save it again",
        "metalness 0.25",
        "mask below 0.5, double-sided",
        "one of its images cannot be read",
    ] {
        assert!(said.out.contains(wanted), "wanted {wanted} in {}", said.out);
    }
    let out = folder.path().join("out");
    let wanted = ["\"gone.png\"", "nor can \"lost.png\"", "put them beside the model"];
    refused(&["bake", text(&path), "-o", text(&out), "--all-textures"], &wanted);
}

/// What lies on no texture coordinates shows one texel; what is baked for it is for nothing.
#[test]
fn a_mesh_without_texture_coordinates_is_baked_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("square.glb");
    let bytes = glb();
    let at = bytes.windows(10).position(|word| word == b"TEXCOORD_0").unwrap();
    std::fs::write(&path, [&bytes[..at], b"_EXCOORD_0", &bytes[at + 10..]].concat()).unwrap();
    for more in ["--quiet", "--dry-run"] {
        let said = kinran(&["bake", text(&path), "-o", text(&folder.path().join("out")), more, "--json"]);
        assert!(said.out.contains("has no TEXCOORD_0"), "{}{}", said.out, said.err);
    }
}

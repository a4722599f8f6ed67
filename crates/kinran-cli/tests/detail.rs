//! `kinran detail` as a person calls it: targets solved, models that carry them, a library's report, bad input.

#![allow(clippy::print_stdout, reason = "the tests tell how near their bounds are, and what is skipped")]

#[allow(dead_code, reason = "shared with the other commands' tests")]
#[path = "commands/common.rs"]
mod common;
#[path = "../../sample_assets.rs"]
mod sample_assets;

use std::path::{Path, PathBuf};

use common::{files, kinran, kinran_json, refused, text};
use kinran_image::{Channels, Format, Image, Pixels, read_image, read_texture, write_png};
use kinran_scene::{DetailMap, Scene};
use sample_assets::sample_assets;
use serde_json::Value;

/// Slow colours with grain, the same everywhere.
fn scan(side: u32, seed: u32) -> Image {
    let mut state = seed;
    let bytes = (0..side * side).flat_map(|i| {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let (x, y, grain) = ((i % side) as f32, (i / side) as f32, (state >> 24) as f32 * 0.2);
        [0.0, 1.0, 2.0].map(|c| {
            (80.0 + 45.0 * ((x * 0.1 + c + seed as f32).sin() + (y * 0.13).cos()) * 0.7 + grain) as u8
        })
    });
    Image::new(side, side, Channels::Rgb, Pixels::U8(bytes.collect())).unwrap()
}

struct Folder(tempfile::TempDir);

impl Folder {
    /// A target, two tiles and a mask.
    fn new() -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        for (name, side, seed) in [("wall", 64, 1), ("brick", 32, 2), ("moss", 32, 3), ("mask", 32, 4)] {
            write_png(&folder.path(&format!("{name}.png")), &scan(side, seed)).unwrap();
        }
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        text(&self.path(name)).into()
    }

    /// The words of a solution with two layers.
    fn solve(&self, more: &[&str]) -> Vec<String> {
        let layers = [
            format!("{},scale=2", self.text("brick.png")),
            format!(
                "{},scale=3,rotation=30,mirror,mask={},channel=g",
                self.text("moss.png"),
                self.text("mask.png")
            ),
        ];
        let mut words: Vec<String> = ["detail", "solve"].map(String::from).to_vec();
        words.push(self.text("wall.png"));
        words.extend(layers.map(|layer| format!("--layer={layer}")));
        words.extend(["-o".to_owned(), self.text("out")]);
        words.extend(more.iter().map(|word| (*word).to_owned()));
        words
    }
}

fn run(words: &[String]) -> Value {
    kinran_json(&words.iter().map(String::as_str).collect::<Vec<_>>())
}

/// The error about an EXR of several layers names a flag, which each of these commands must have.
#[test]
fn layers_of_an_exr_are_asked_for_by_a_flag_that_is_not_there() {
    let folder = Folder::new();
    let layers = |file: &str, size: (u32, u32)| {
        let planes = ["Light", "Paint"].iter().flat_map(|layer| {
            let value = if *layer == "Light" { 0.9 } else { 0.25 };
            ["R", "G", "B"].map(|c| (format!("{layer}.{c}"), vec![value; (size.0 * size.1) as usize]))
        });
        let planes: Vec<(String, Vec<f32>)> = planes.collect();
        let planes = planes.iter().map(|(name, plane)| (name.as_str(), plane.clone())).collect();
        kinran_image::write_exr_planes(&folder.path(file), size, planes).unwrap();
    };
    for file in ["wall.exr", "brick.exr", "mask.exr"] {
        layers(file, (64, 64));
    }
    let (wall, out) = (folder.text("wall.exr"), folder.text("out"));
    let brick = format!("--layer={}", folder.text("brick.exr"));
    let moss = format!("--layer={},mask={}", folder.text("moss.png"), folder.text("mask.exr"));
    let solve =
        ["detail", "solve", &wall, &brick, &moss, "-o", &out, "--format", "rgba8", "--tile-format", "rgba8"];
    let flags = [format!("{wall}=Paint"), "brick.exr=Paint".into(), "mask.exr=Light".into()];
    let mut words = solve.to_vec();
    for (flag, file) in flags.iter().zip(["wall.exr", "brick.exr", "mask.exr"]) {
        refused(&words, &[file, "Light, Paint", "--exr-layer"]);
        words.extend(["--exr-layer", flag]);
    }
    kinran_json(&words);
    refused(
        &[&words[..], &["--exr-layer", "moss.exr=Paint"]].concat(),
        &["--exr-layer moss.exr=Paint", "wall.exr"],
    );
    // Linear 0.25 is 137 in sRGB.
    let tile = read_texture(&folder.path("out/brick.ktx2")).unwrap();
    assert_eq!(tile.levels[0].data[..3], [137; 3]);

    let manifest = folder.path("kinran.toml");
    let entry = "[[detail]]\ninput = \"wall.exr\"\nlayer = \"brick.exr\"\nformat = \"rgba8\"\n\
                 exr-layer = [\"wall.exr=Paint\", \"brick.exr=Paint\"]\n";
    std::fs::write(&manifest, entry).unwrap();
    kinran_json(&["bake", text(&manifest), "--cache", &folder.text("cache")]);

    std::fs::create_dir_all(folder.path("all/paint")).unwrap();
    std::fs::rename(folder.path("wall.exr"), folder.path("all/paint/paint_color.exr")).unwrap();
    let (all, page) = (folder.text("all"), folder.text("page"));
    let report = [
        "detail",
        "report",
        &all,
        "-o",
        &page,
        "--size",
        "16",
        "--format",
        "bc1",
        "--no-pictures",
        "--no-fade",
    ];
    refused(&report, &["paint_color.exr", "Light, Paint", "--exr-layer"]);
    kinran_json(&[&report[..], &["--exr-layer", "paint/paint_color.exr=Paint"]].concat());

    layers("sky.exr", (64, 32));
    let (sky, picture) = (folder.text("sky.exr"), folder.text("out.exr"));
    let model = folder.text("square.glb");
    std::fs::write(&model, common::glb()).unwrap();
    let render =
        ["render", &model, "-o", &picture, "--size", "8x8", "--spp", "1", "--fov", "1", "--distance", "100"];
    refused(&[&render[..], &["--env", &sky]].concat(), &["sky.exr", "Light, Paint", "--exr-layer"]);
    refused(&[&render[..], &["--exr-layer", "Light"]].concat(), &["--exr-layer Light", "--env"]);
    kinran_json(&[&render[..], &["--env", &sky, "--exr-layer", "Paint"]].concat());
    let corner = read_image(Path::new(&picture)).unwrap().texel(0, 0);
    assert!((corner[0] - 0.25).abs() < 1e-3, "wanted the layer's 0.25 behind the model, got {corner:?}");
}

#[test]
fn a_target_is_solved_into_textures_a_report_and_pictures() {
    let folder = Folder::new();
    let report = run(&folder.solve(&["--format", "bc1", "--compare", "--pictures"]));
    let listed: Vec<&str> = report["files"].as_array().unwrap().iter().map(|f| f.as_str().unwrap()).collect();
    let mut wanted: Vec<String> = listed.iter().map(|f| (*f).to_owned()).collect();
    wanted.push("wall.detail.json".into());
    wanted.sort();
    assert_eq!(files(&folder.path("out")), wanted);
    for name in ["wall_synthesized.ktx2", "brick.ktx2", "moss.ktx2", "mask_mask.ktx2", "wall_blended.png"] {
        assert!(listed.contains(&name), "no {name} among {listed:?}");
    }
    let texture = read_texture(&folder.path("out/wall_synthesized.ktx2")).unwrap();
    assert_eq!((texture.levels[0].width, texture.levels.len()), (64, 7));

    // The pictures show what the numbers say: the first level's error, measured again here.
    let [blended, target] =
        ["blended", "target"].map(|n| read_image(&folder.path(&format!("out/wall_{n}.png"))).unwrap());
    let (Pixels::U8(blended), Pixels::U8(target)) = (&blended.pixels, &target.pixels) else {
        panic!("bytes")
    };
    let squares: f64 = blended.iter().zip(target).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    let (got, said) =
        ((squares / target.len() as f64).sqrt(), report["levels"][0]["error"].as_f64().unwrap());
    assert!((got - said).abs() < 0.05 + 0.02 * said, "pictures are {got} apart, the report says {said}");

    let comparison = &report["comparison"]["levels"][1];
    let [blended, talk] = ["blended", "talk"].map(|key| comparison[key].as_f64().unwrap());
    assert!(blended > 0.0 && blended < talk, "everything {blended}, the talk's {talk}");
    let bytes = |key: &str| report["comparison"][key].as_u64().unwrap();
    assert!(
        bytes("synthesized_bytes") == bytes("target_bytes") && bytes("unique_bytes") >= bytes("target_bytes")
    );
}

/// Normals of slanted waves, green up, or down as DirectX has it.
fn waves(y_down: bool) -> Image {
    let texel = |x: u32, y: u32| {
        // Of the height sin(0.4 x + 0.3 v), v counted downwards.
        let slope = (0.4 * x as f32 + 0.3 * y as f32).cos();
        let (x, y) = (-0.4 * slope, 0.3 * slope * if y_down { -1.0 } else { 1.0 });
        let length = (x * x + y * y + 1.0).sqrt();
        [x, y, 1.0].map(|n| ((n / length * 0.5 + 0.5) * 255.0 + 0.5) as u8)
    };
    let bytes = (0..64).flat_map(|y| (0..64).flat_map(move |x| texel(x, y)));
    Image::new(64, 64, Channels::Rgb, Pixels::U8(bytes.collect())).unwrap()
}

#[test]
fn normals_are_solved_as_colours_whatever_their_name_says() {
    let folder = Folder::new();
    for (name, y_down) in
        [("Fabric_Normal", false), ("Dark_Normal", true), ("tile_normal", false), ("cloth", false)]
    {
        write_png(&folder.path(&format!("{name}.png")), &waves(y_down)).unwrap();
    }
    write_png(&folder.path("tile_color.png"), &scan(64, 5)).unwrap();
    let words = |target: &str, tile: &str, more: &[&str]| -> Vec<String> {
        let layer = format!("--layer={}", folder.text(tile));
        let first = ["detail".into(), "solve".into(), folder.text(target), layer];
        let rest = ["-o".into(), folder.text("out"), "--force".into()];
        first.into_iter().chain(rest).chain(more.iter().map(|&word| word.into())).collect()
    };
    let warnings = |report: &Value| report["warnings"].to_string();

    let report = run(&words("Fabric_Normal.png", "tile_normal.png", &[]));
    assert_eq!((&report["kind"], &report["kind_source"]), (&"normal".into(), &"name".into()), "{report}");
    assert_eq!(warnings(&report), "[]");
    let texture = read_texture(&folder.path("out/Fabric_Normal_synthesized.ktx2")).unwrap();
    assert_eq!(texture.format, Format::Bc5, "normals were written as colours");
    let all = words("Fabric_Normal.png", "tile_normal.png", &[]);
    let said = kinran(&all.iter().map(String::as_str).collect::<Vec<_>>()).out;
    for part in [
        "kind normal, by the target's name".to_owned(),
        "\nblended error: root mean square".into(),
        format!("and Fabric_Normal.detail.json, in {}", folder.text("out")),
    ] {
        assert!(said.contains(&part), "wanted {part:?} in {said}");
    }

    let all = words("cloth.png", "tile_normal.png", &[]);
    refused(
        &all.iter().map(String::as_str).collect::<Vec<_>>(),
        &["cloth.png", "look like normals", "--kind normal"],
    );
    let report = run(&words("cloth.png", "tile_normal.png", &["--kind", "normal"]));
    assert_eq!(report["kind_source"], "flag", "{report}");
    let report = run(&words("wall.png", "brick.png", &[]));
    assert_eq!((&report["kind"], &report["kind_source"]), (&"color".into(), &"assumed".into()), "{report}");

    for (flags, wanted) in [
        (["--alpha", "0.3"], "--alpha has nothing to act on: the target is no aniso map"),
        (["--channels", "orm"], "--channels has nothing to act on: neither --board nor --model is asked for"),
    ] {
        let told = warnings(&run(&words("Fabric_Normal.png", "tile_normal.png", &flags)));
        assert!(told.contains(wanted), "wanted {wanted} in {told}");
    }
    let told = warnings(&run(&words("Fabric_Normal.png", "tile_color.png", &[])));
    assert!(told.contains("tile_color.png: its name says color"), "{told}");
    let told = warnings(&run(&words("Dark_Normal.png", "tile_normal.png", &[])));
    assert!(told.contains("Dark_Normal.png: its slopes say that green points down"), "{told}");
    assert_eq!(warnings(&run(&words("Dark_Normal.png", "tile_normal.png", &["--y-down"]))), "[]");
    // DirectX by its name, and by its name only.
    for (name, y_down) in [("Wall_Normal_DirectX", true), ("Sky_Normal_DirectX", false)] {
        write_png(&folder.path(&format!("{name}.png")), &waves(y_down)).unwrap();
    }
    assert_eq!(warnings(&run(&words("Wall_Normal_DirectX.png", "tile_normal.png", &[]))), "[]");
    let told = warnings(&run(&words("Sky_Normal_DirectX.png", "tile_normal.png", &[])));
    assert!(told.contains("its slopes say that green points up (OpenGL); then give --y-up"), "{told}");
    assert_eq!(warnings(&run(&words("Sky_Normal_DirectX.png", "tile_normal.png", &["--y-up"]))), "[]");
}

#[test]
fn a_bound_on_the_error_lowers_the_resolution_and_what_cannot_be_reached_is_refused() {
    let folder = Folder::new();
    let report = run(&folder.solve(&["--format", "rgba8", "--max-error", "30"]));
    let size = |key: &str| report[key][0].as_u64().unwrap();
    assert!(size("size") < size("target_size"), "{report}");
    let tried = report["resolutions"].as_array().unwrap();
    let error = |i: usize| tried[i]["error"].as_f64().unwrap();
    assert!(error(tried.len() - 2) <= 30.0 && error(tried.len() - 1) > 30.0, "{tried:?}");

    let words = folder.solve(&["--format", "bc1", "--max-error", "0.01"]);
    refused(&words.iter().map(String::as_str).collect::<Vec<_>>(), &["--max-error 0.01", "allow more"]);
}

#[test]
fn strange_tiles_are_faded_until_they_do_no_harm() {
    let folder = Folder::new();
    let report = run(&folder.solve(&["--format", "bc1", "--fade", "--compare", "--board"]));
    let opacity = report["opacity"].as_f64().unwrap();
    assert!(
        (0.0..1.0).contains(&opacity),
        "noise that has nothing to do with the target was borne: {opacity}"
    );
    for level in &report["comparison"]["levels"].as_array().unwrap()[..2] {
        let [blended, target] = ["blended", "target"].map(|key| level[key].as_f64().unwrap());
        assert!(blended <= target, "blended {blended}, target alone {target}");
    }
    let scene = Scene::load(folder.path("out/wall.glb")).unwrap();
    let layers = &scene.materials[0].detail.as_ref().unwrap().layers;
    assert!(layers.iter().all(|layer| f64::from(layer.opacity) == opacity), "{layers:?}");
}

/// A board shows the target again: what is drawn blended is near to what is drawn of the target itself.
#[test]
fn a_board_carries_what_was_solved() {
    let folder = Folder::new();
    run(&folder.solve(&["--format", "bc7", "--board"]));
    let scene = Scene::load(folder.path("out/wall.glb")).unwrap();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let detail = scene.materials[0].detail.as_ref().expect("KINRAN_materials_detail");
    assert_eq!(detail.layers.len(), 2);
    let map = detail.maps[DetailMap::BaseColor as usize].as_ref().unwrap();
    assert_eq!(scene.textures[map.image].as_ref().unwrap().levels.len(), 7);
    let layer = &detail.layers[1];
    assert!(layer.transform.mirror && (layer.transform.rotation.to_degrees() - 30.0).abs() < 1e-4);
    assert_eq!(layer.mask.as_ref().unwrap().channel, 1);

    let draw = |shown: &str| {
        let file = folder.text(&format!("{shown}.png"));
        let said = kinran(&[
            "render",
            &folder.text("out/wall.glb"),
            "-o",
            &file,
            "--detail",
            shown,
            "--size",
            "48x48",
            "--spp",
            "8",
            "--from",
            "0,0,1",
            "--env",
            "none",
            "--light",
            "0,0,1",
            "--tonemap",
            "none",
        ]);
        assert_eq!(said.code, Some(0), "{}", said.err);
        let Pixels::U8(bytes) = read_image(Path::new(&file)).unwrap().pixels else { panic!("bytes") };
        bytes
    };
    let [blended, target, tiles, alone] = ["blended", "target", "detail", "synthesized"].map(draw);
    let apart = |a: &[u8], b: &[u8]| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    };
    println!(
        "blended {:.2}, tiles {:.2}, synthesized {:.2} from the target",
        apart(&blended, &target),
        apart(&tiles, &target),
        apart(&alone, &target)
    );
    assert!(apart(&blended, &target) < 2.5, "blended is {} from the target", apart(&blended, &target));
    assert!(apart(&tiles, &target) > 8.0 && apart(&alone, &target) > 8.0);
}

#[test]
fn every_kind_of_map_finds_its_place_in_a_model() {
    let folder = Folder::new();
    let solved = |more: &[&str]| {
        let mut words: Vec<String> = ["detail", "solve"].map(String::from).to_vec();
        words.extend([folder.text("wall.png"), format!("--layer={},scale=2", folder.text("brick.png"))]);
        words.extend(["-o".to_owned(), folder.text("out")]);
        words.extend(more.iter().map(|word| (*word).to_owned()));
        run(&words)
    };
    // A model with two materials and its own maps.
    let model = folder.text("model.gltf");
    std::fs::write(
        &model,
        r#"{"asset":{"version":"2.0"},"materials":[{"name":"steel"},{"name":"wall","normalTexture":{"index":0,
        "texCoord":1,"extensions":{"KHR_texture_transform":{"scale":[2,2]}}}}],
        "textures":[{"source":0}],"images":[{"uri":"brick.png"}],"extensionsUsed":["KHR_texture_transform"]}"#,
    )
    .unwrap();
    for (kind, map, own) in [
        ("color", DetailMap::BaseColor, true),
        ("normal", DetailMap::Normal, true),
        ("data", DetailMap::Data, true),
        ("aniso", DetailMap::Aniso, false),
    ] {
        solved(&["--kind", kind, "--model", &model, "--material", "wall"]);
        let scene = Scene::load(folder.path("out/model.gltf")).unwrap();
        let m = &scene.materials[1];
        let detail = m.detail.as_ref().unwrap();
        let there: Vec<bool> = detail.maps.iter().map(Option::is_some).collect();
        assert_eq!(there, DetailMap::ALL.map(|other| other == map), "{kind}");
        let core = match map {
            DetailMap::BaseColor => m.base_color.is_some(),
            DetailMap::Normal => m.normal.is_some(),
            DetailMap::Data => m.metallic_roughness.is_some() && m.occlusion.is_some(),
            DetailMap::Aniso => false,
        };
        assert_eq!(core, own, "{kind}: the target for viewers that do not blend");
        if map == DetailMap::Normal {
            let place = detail.maps[map as usize].as_ref().unwrap();
            assert_eq!(
                (place.uv_set, place.transform.x_axis.x),
                (1, 2.0),
                "it lies where the normal map lay"
            );
        }
        assert!(scene.materials[0].detail.is_none());
    }
}

#[test]
fn a_report_covers_a_folder_of_materials() {
    let folder = Folder::new();
    for (material, seed) in [("brick", 2), ("moss", 3), ("plaster", 5)] {
        let path = folder.path(&format!("materials/{material}"));
        std::fs::create_dir_all(&path).unwrap();
        write_png(&path.join(format!("{material}_color.png")), &scan(32, seed)).unwrap();
    }
    // What is called as no map is told of.
    std::fs::create_dir_all(folder.path("materials/misc")).unwrap();
    write_png(&folder.path("materials/misc/photo.png"), &scan(32, 7)).unwrap();
    let report = kinran_json(&[
        "detail",
        "report",
        &folder.text("materials"),
        "-o",
        &folder.text("report"),
        "--size",
        "64",
        "--format",
        "bc1",
    ]);
    let rows = report["rows"].as_array().unwrap();
    let of = |against: &str| rows.iter().filter(|row| row["against"] == against).count();
    assert_eq!((of("own"), of("other"), of("faded")), (3, 3, 3));
    let warnings = report["warnings"].as_array().unwrap();
    assert!(warnings.len() == 1 && warnings[0].as_str().unwrap().ends_with(": misc"), "{warnings:?}");
    // Two mips of three ways.
    assert_eq!(report["means"].as_array().unwrap().len(), 6);
    let faded = report["means"].as_array().unwrap().iter().filter(|mean| mean["against"] == "faded");
    for mean in faded {
        assert_eq!(mean["no_worse"], mean["count"], "{mean}");
    }
    let page = std::fs::read_to_string(folder.path("report/index.html")).unwrap();
    for name in ["plaster, color", "faded", "pictures/brick_color_own_blended.png"] {
        assert!(page.contains(name), "no {name} in the page");
    }
    let pictures = files(&folder.path("report/pictures"));
    assert_eq!(pictures.len(), 3 * 3 * 6, "{pictures:?}");
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let folder = Folder::new();
    let (wall, out) = (folder.text("wall.png"), folder.text("out"));
    let brick = folder.text("brick.png");
    let solve = |more: &[&str], parts: &[&str]| {
        refused(&[&["detail", "solve", &wall, "-o", &out][..], more].concat(), parts);
    };
    let layer = |more: &str| format!("--layer={brick}{more}");
    solve(&["--layer", "missing.png"], &["missing.png"]);
    solve(&[&layer(",scal=2")], &["scal=2", "scale, rotation"]);
    solve(&[&layer(""), &layer("")], &["layer 2 has no mask"]);
    solve(&[&layer(",mask=nowhere.png")], &["nowhere.png"]);
    solve(&[&layer(""), "--format", "bc5"], &["bc5", "color"]);
    solve(&[&layer(""), "--alpha", "2"], &["--alpha", "0 to 1"]);
    solve(&[&layer(",opacity=0.5"), "--kind", "aniso"], &["aniso", "alpha"]);
    solve(&[&layer(""), "--material", "x"], &["--model"]);
    solve(&[&layer(""), "--channels", "rgb", "--board"], &["o occlusion"]);

    let model = folder.text("model.gltf");
    std::fs::write(&model, r#"{"asset":{"version":"2.0"},"materials":[{"name":"a"},{"name":"b"}]}"#).unwrap();
    solve(&[&layer(""), "--model", &model], &["several materials", "--material", "a, b"]);
    solve(&[&layer(""), "--model", &model, "--material", "c"], &["none of that name", "a, b"]);
    refused(
        &["detail", "solve", &wall, "-o", &folder.text(""), &layer(""), "--model", &model, "--material", "a"],
        &["would be overwritten"],
    );
    assert!(!folder.path("out").exists(), "a refused solution left {:?}", files(&folder.path("out")));

    // A damaged target, and one with values that are no colours.
    std::fs::write(folder.path("wall.png"), b"no png").unwrap();
    solve(&[&layer("")], &["wall.png"]);
    let bright = Image::new(1, 1, Channels::Rgb, Pixels::F32(vec![0.5, 2.0, 0.5])).unwrap();
    let exr = folder.text("bright.exr");
    kinran_image::write_exr(Path::new(&exr), &bright).unwrap();
    refused(&["detail", "solve", &exr, "-o", &out, &layer("")], &["bright.exr", "0 to 1"]);
    refused(&["detail", "report", &folder.text("mask.png"), "-o", &out], &["mask.png"]);
    refused(&["detail", "report", &folder.text(""), "-o", &out], &["folder of folders"]);
}

/// Scanned materials, small: every one against its own tiles and another's.
#[test]
fn sample_assets_are_solved_better_than_by_the_talk() {
    let Some(assets) = sample_assets() else { return };
    let wanted = ["acg_metal007", "acg_rock023", "ph_plank_flooring"];
    let folder = Folder::new();
    let materials = folder.path("materials");
    for name in wanted {
        // Every fourth texel of a row and a column, so that a test takes a second.
        let from = assets.join("materials").join(name);
        std::fs::create_dir_all(materials.join(name)).unwrap();
        for entry in std::fs::read_dir(&from).unwrap() {
            let path = entry.unwrap().path();
            let Ok(image) = read_image(&path) else { continue };
            let (width, height) = (image.width / 4, image.height / 4);
            let n = image.channels.count();
            let bytes = (0..width * height).flat_map(|i| {
                image.texel(4 * (i % width), 4 * (i / width)).map(|v| (v * 255.0 + 0.5) as u8)[..n].to_vec()
            });
            let small = Image::new(width, height, image.channels, Pixels::U8(bytes.collect())).unwrap();
            let stem = path.file_stem().unwrap().to_string_lossy().into_owned();
            write_png(&materials.join(name).join(format!("{stem}.png")), &small).unwrap();
        }
    }
    let report = kinran_json(&[
        "detail",
        "report",
        text(&materials),
        "-o",
        &folder.text("report"),
        "--size",
        "128",
        "--format",
        "bc1",
        "--no-pictures",
    ]);
    let means = report["means"].as_array().unwrap();
    let kinds: Vec<&str> = means.iter().map(|mean| mean["map"].as_str().unwrap()).collect();
    // The aniso maps are made of normals and roughness.
    for kind in ["color", "normal", "roughness", "aniso"] {
        assert!(kinds.contains(&kind), "no {kind} in {kinds:?}");
    }
    for mean in means {
        let [blended, talk, target] = ["blended", "talk", "target"].map(|key| mean[key].as_f64().unwrap());
        println!(
            "{} {} mip {}: target {target:.3}, blended {blended:.3}, talk {talk:.3}",
            mean["map"], mean["against"], mean["level"]
        );
        assert!(blended <= talk, "{mean}");
        // On the second mip, as the talk measures, and better than its +2.5 %; and on the first.
        if mean["map"] == "color" && mean["against"] == "own" {
            assert!(blended < target, "{mean}");
        }
    }
}

//! `kinran render` and `kinran compare` on a small model.

use crate::common::{bumps, files, kinran, kinran_json, refused, square, text};
use kinran_image::{Channels, Image, Pixels, encode_png, read_image};
use kinran_render::metrics::{flip, rmse_srgb8};
use serde_json::json;
use std::path::Path;

fn pixels(image: &Image) -> Vec<[u8; 3]> {
    let Pixels::U8(samples) = &image.pixels else { panic!("no 8-bit picture") };
    samples.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect()
}

#[test]
fn the_model_is_in_the_picture_and_shrinks_with_the_square_of_distance() {
    let (folder, model) = square();
    let out = folder.path().join("out.png");
    let covered = |distance: &str| {
        let said = kinran(&[
            "render",
            text(&model),
            "-o",
            text(&out),
            "--size",
            "96x64",
            "--spp",
            "4",
            "--from",
            "0,0,1",
            "--fov",
            "10",
            "--background",
            "0,0,0",
            "--distance",
            distance,
        ]);
        assert_eq!(said.code, Some(0), "{}", said.err);
        assert!(said.out.contains("96x64"), "no summary: {}", said.out);
        let image = read_image(&out).unwrap();
        assert_eq!((image.width, image.height), (96, 64));
        pixels(&image).iter().filter(|p| **p != [0; 3]).count() as f32
    };
    let (near, far) = (covered("1"), covered("2"));
    // 5 % of air around a square in a picture 64 pixels high; a border of a pixel may count or not.
    assert!((near.sqrt() - 64.0 / 1.05).abs() < 3.0, "the square covers {near} pixels");
    assert!(
        (near.sqrt() / far.sqrt() - 2.0).abs() < 0.15,
        "{near} pixels become {far} at twice the distance"
    );
}

#[test]
fn same_bytes_for_one_and_for_three_threads() {
    let (folder, model) = square();
    let picture = |threads: &str| {
        let out = folder.path().join(format!("{threads}.exr"));
        let said = kinran(&[
            "render",
            text(&model),
            "-o",
            text(&out),
            "--size",
            "40x30",
            "--spp",
            "4",
            "--threads",
            threads,
            "--quiet",
        ]);
        assert_eq!((said.code, said.out.as_str(), said.err.as_str()), (Some(0), "", ""));
        std::fs::read(out).unwrap()
    };
    assert!(picture("1") == picture("3"), "the pictures differ");
}

#[test]
fn one_stop_of_exposure_doubles_light_and_leaves_exr_alone() {
    let (folder, model) = square();
    let picture = |exposure: &str, name: &str| {
        let out = folder.path().join(name);
        let args = [
            "render",
            text(&model),
            "-o",
            text(&out),
            "--size",
            "24",
            "--spp",
            "4",
            "--tonemap",
            "none",
            "--env",
            "none",
            "--light",
            "0,0,1",
            "--from",
            "0,0,1",
            "--exposure",
            exposure,
        ];
        let summary = kinran_json(&args);
        assert_eq!((summary["width"].as_u64(), summary["triangles"].as_u64()), (Some(24), Some(2)));
        read_image(&out).unwrap()
    };
    let (Pixels::F32(radiance), Pixels::F32(exposed)) =
        (picture("0", "a.exr").pixels, picture("1", "b.exr").pixels)
    else {
        panic!("EXR without floats")
    };
    assert!(radiance == exposed, "exposure has changed radiance");
    assert!(radiance.iter().all(|v| v.is_finite()) && radiance.iter().any(|v| *v > 0.05), "no light");
    let png = pixels(&picture("1", "c.png"));
    for (i, (radiance, got)) in radiance.chunks_exact(3).zip(&png).enumerate() {
        // The sRGB encoding of IEC 61966-2-1.
        let x = (2.0 * radiance[0]).clamp(0.0, 1.0);
        let wanted = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        let off = wanted * 255.0 - f32::from(got[0]);
        assert!(
            off.abs() <= 0.51,
            "pixel {i}: radiance {}, wanted {}, got {}",
            radiance[0],
            wanted * 255.0,
            got[0]
        );
    }
}

#[test]
fn the_numbers_are_those_of_the_pictures() {
    let (folder, model) = square();
    let out = folder.path().join("deep").join("comparison");
    let report = kinran_json(&[
        "compare",
        text(&model),
        "-o",
        text(&out),
        "--size",
        "48",
        "--spp",
        "4",
        "--truth-spp",
        "8",
        "--filters",
        "ml,naive",
        "--distances",
        "1,3",
    ]);
    let wanted = [
        "compare.json",
        "compare.png",
        "distance.png",
        "ml_x1.png",
        "ml_x3.png",
        "naive_x1.png",
        "naive_x3.png",
        "truth_x1.png",
        "truth_x3.png",
    ];
    assert_eq!(files(&out), wanted);
    let stored: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.join("compare.json")).unwrap()).unwrap();
    assert_eq!(stored, report);

    let load = |name: String| read_image(&out.join(name)).unwrap();
    for method in report["methods"].as_array().unwrap() {
        let filter = method["filter"].as_str().unwrap();
        for (number, side) in method["distances"].as_array().unwrap().iter().zip([48, 16]) {
            let distance = number["distance"].as_f64().unwrap();
            let (truth, picture) =
                (load(format!("truth_x{distance}.png")), load(format!("{filter}_x{distance}.png")));
            assert_eq!((picture.width, picture.height), (side, side), "{filter} x{distance}");
            let (truth, picture) = (pixels(&truth), pixels(&picture));
            let rmse = rmse_srgb8(&truth, &picture).unwrap();
            let flip = f64::from(flip(&truth, &picture, side, side).unwrap().mean);
            for (what, wanted) in [("rmse", rmse), ("flip", flip)] {
                let got = number[what].as_f64().unwrap();
                assert!(
                    (got - wanted).abs() < 1e-6,
                    "{filter} x{distance} {what}: wanted {wanted}, got {got}"
                );
            }
        }
    }
}

#[test]
fn from_afar_naive_mips_are_farther_from_the_truth_than_fitted_ones() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    let report = kinran_json(&[
        "compare",
        text(&model),
        "-o",
        text(&out),
        "--size",
        "64",
        "--spp",
        "64",
        "--truth-spp",
        "256",
        "--filters",
        "ml,naive",
        "--distances",
        "4",
        "--from",
        "0,0,1",
    ]);
    let error = |i: usize| report["methods"][i]["distances"][0]["rmse"].as_f64().unwrap();
    assert!(error(0) < 0.5 * error(1), "ml is off by {}, naive by {}", error(0), error(1));
    let finding = &report["findings"][0];
    assert_eq!(finding["rmse"]["best"], "ml", "{finding}");
    assert_eq!(finding["only_noise"], false, "{finding}");
    assert!(finding["says"].as_str().unwrap().contains("ml is nearest"), "{finding}");
}

/// A folder with `gilded.gltf`: a square of smooth gold leaves scattered over rough blue satin whose fibres lie askew, all in
/// maps of 64 x 64 texels that repeat twice.
fn gilded() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let corners = [[-1.0_f32, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    let normals = corners.iter().flat_map(|_| [0.0, 0.0, 1.0]);
    let floats = positions.chain(normals).chain(corners.iter().flat_map(|[x, y]| [x + 1.0, 1.0 - y]));
    let mut bin: Vec<u8> = floats.flat_map(f32::to_le_bytes).collect();
    bin.extend([0_u16, 1, 2, 0, 2, 3].into_iter().flat_map(u16::to_le_bytes));
    std::fs::write(folder.path().join("square.bin"), &bin).unwrap();
    // Of four texels each way: finer ones are mixed where a sampler blends neighbours of level 0.
    let is_gold = |i: u32| {
        let leaf = (i / 64 / 4 * 16 + i % 64 / 4).wrapping_mul(2_654_435_761);
        (leaf ^ leaf >> 15).wrapping_mul(2_246_822_519) >> 24 < 90
    };
    let image = |file: &str, gold: [u8; 3], satin: [u8; 3]| {
        let texels = (0..64 * 64).flat_map(|i| if is_gold(i) { gold } else { satin }).collect();
        let image = Image::new(64, 64, Channels::Rgb, Pixels::U8(texels)).unwrap();
        std::fs::write(folder.path().join(file), encode_png(&image).unwrap()).unwrap();
    };
    image("normal.png", [128, 128, 255], [168, 100, 245]);
    image("color.png", [250, 200, 90], [20, 40, 120]);
    image("rough.png", [0, 70, 255], [0, 220, 0]);
    let view =
        |offset: usize, length: usize| json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
    let accessor = |view: usize, kind: &str| json!({ "bufferView": view, "componentType": 5126, "count": 4, "type": kind });
    let mut first = accessor(0, "VEC3");
    (first["min"], first["max"]) = (json!([-1.0, -1.0, 0.0]), json!([1.0, 1.0, 0.0]));
    let document = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 }, "indices": 3, "material": 0
        }] }],
        "materials": [{
            "name": "gilded", "normalTexture": { "index": 0 },
            "pbrMetallicRoughness": { "baseColorTexture": { "index": 1 }, "metallicRoughnessTexture": { "index": 2 } }
        }],
        "textures": [{ "source": 0 }, { "source": 1 }, { "source": 2 }],
        "images": [{ "uri": "normal.png" }, { "uri": "color.png" }, { "uri": "rough.png" }],
        "accessors": [first, accessor(1, "VEC3"), accessor(2, "VEC2"),
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" }],
        "bufferViews": [view(0, 48), view(48, 48), view(96, 32), view(128, 12)],
        "buffers": [{ "uri": "square.bin", "byteLength": bin.len() }]
    });
    let path = folder.path().join("gilded.gltf");
    std::fs::write(&path, document.to_string()).unwrap();
    (folder, path)
}

/// Pictures of authored maps and of their bake would show two filters.
#[test]
fn authored_maps_are_drawn_with_another_filter_than_a_bake_s() {
    let (folder, model) = gilded();
    let at = |name: &str| folder.path().join(name);
    let picture = |model: &Path, flags: &[&str]| {
        let out = at("out.png");
        let shared =
            ["render", text(model), "-o", text(&out), "--size", "32", "--spp", "16", "--env", "none"];
        let said = kinran(&[&shared[..], &["--distance", "4", "--from", "0,0,1"], flags].concat());
        assert_eq!(said.code, Some(0), "{}", said.err);
        pixels(&read_image(&out).unwrap())
    };
    let [on, off] = ["on", "off"].map(|correlated| {
        let out = at(correlated);
        let flags = ["--all-textures", "--form", "both", "--encoder", "portable", "--correlated", correlated];
        let said = kinran(&[&["bake", text(&model), "-o", text(&out)], &flags[..]].concat());
        assert_eq!(said.code, Some(0), "{}", said.err);
        let baked = picture(&out.join("gilded.gltf"), &[]);
        let drawn = picture(&model, &["--correlated", correlated]);
        let apart = rmse_srgb8(&baked, &drawn).unwrap();
        // Colours are compressed in one alone.
        assert!(apart < 0.01, "--correlated {correlated}: authored and baked are {apart} apart");
        drawn
    });
    let apart = rmse_srgb8(&on, &off).unwrap();
    assert!(apart > 0.03, "together and one by one are {apart} apart");
}

/// What `kinran compare` says of metal in maps.
#[test]
fn colours_that_are_filtered_apart_are_as_near_to_the_truth_or_their_share_is_not_told() {
    let (folder, model) = gilded();
    let out = folder.path().join("out");
    let shared =
        ["compare", text(&model), "-o", text(&out), "--size", "96", "--spp", "16", "--truth-spp", "64"];
    let flags = ["--distances", "4", "--from", "0,0,1", "--env", "none", "--filters", "ml,ml-apart,naive"];
    let args = [&shared[..], &flags, &["--budget"]].concat();
    let report = kinran_json(&args);
    let methods = report["methods"].as_array().unwrap();
    let names: Vec<&str> = methods.iter().map(|method| method["filter"].as_str().unwrap()).collect();
    assert_eq!(names, ["ml", "ml-apart", "naive"]);
    assert!(files(&out).contains(&"ml-apart_x4.png".to_owned()), "{:?}", files(&out));
    let number = |i: usize, what: &str| methods[i]["distances"][0][what].as_f64().unwrap();
    for what in ["rmse", "l2"] {
        let (on, off) = (number(0, what), number(1, what));
        assert!(on < 0.9 * off, "{what}: {on} together, {off} one by one");
    }
    for method in methods {
        let (budget, name) = (&method["budget"][0], &method["filter"]);
        for measure in ["rmse", "l2"] {
            let shares: Vec<f64> =
                budget[measure].as_object().unwrap().values().filter_map(|v| v.as_f64()).collect();
            let sum: f64 = shares.iter().sum();
            assert!(shares.len() == 5 && (sum - 1.0).abs() < 1e-9, "{name}, {measure}: {budget}");
        }
    }
    let colour = |i: usize| {
        let share = methods[i]["budget"][0]["l2"]["colour_apart"].as_f64().unwrap();
        share * number(i, "l2").powi(2)
    };
    let (on, off) = (colour(0), colour(1));
    assert!(on < 0.6 * off, "squared error of colour apart: {on} together, {off} one by one");
    let said = kinran(&args).out;
    assert!(said.contains("ml-apart x4, its squared error: RMSE") && said.contains("1/4: RMSE"), "{said}");

    // Metal of one colour has nothing that could be apart.
    let (_square, plain) = square();
    let args = ["compare", text(&plain), "-o", text(&out), "--size", "16", "--spp", "1", "--truth-spp", "2"];
    let flags = ["--distances", "1", "--most-truth-spp", "2", "--filters"];
    for named in [&["ml,ml-apart"][..], &["ml,ml-apart", "--correlated", "off"], &["ml-apart"]] {
        let report = kinran_json(&[&args[..], &flags, named].concat());
        let methods = report["methods"].as_array().unwrap();
        assert!(methods.len() == 1 && methods[0]["filter"] == "ml", "{named:?}: {methods:?}");
    }
}

/// A pixel that is shaded at every sample sees each texture through two pixels' widths.
#[test]
fn shading_at_every_sample_is_as_sharp_as_once_for_a_pixel() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    let shared =
        ["compare", text(&model), "-o", text(&out), "--size", "64", "--spp", "16", "--truth-spp", "64"];
    let flags = ["--distances", "1", "--from", "0,0,1", "--env", "none", "--filters", "ml", "--shading"];
    let [pixel, sample] = ["pixel", "sample"].map(|shading| {
        let report = kinran_json(&[&shared[..], &flags, &[shading]].concat());
        report["methods"][0]["distances"][0]["rmse"].as_f64().unwrap()
    });
    assert!(pixel < 0.95 * sample, "once for a pixel {pixel}, at every sample {sample}");
}

/// Where no texture is seen from afar all filters draw the same, but for noise: the texture is magnified, and the
/// environment's samples are few.
#[test]
fn filters_that_draw_the_same_get_no_mark_whatever_the_noise() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    for filters in ["ml,linear,lean,naive", "naive,ml"] {
        let shared =
            ["compare", text(&model), "-o", text(&out), "--size", "64", "--spp", "2", "--truth-spp", "4"];
        let near = ["--distances", "1", "--fov", "2", "--distance", "0.3", "--filters", filters];
        let args = [&shared[..], &near].concat();
        let report = kinran_json(&args);
        let finding = &report["findings"][0];
        let noise = finding["noise"]["rmse"].as_f64().unwrap();
        assert!(noise > 0.002, "there is no noise to be taken for an error: {finding}");
        for measure in ["rmse", "l2", "flip"] {
            assert!(finding[measure]["best"].is_null(), "{measure} marks one of {filters}: {finding}");
        }
        let said = kinran(&args);
        assert!(said.out.contains("noise") && !said.out.contains('*'), "{}", said.out);
        let told = finding["says"].as_str().unwrap();
        assert!(told.contains("alike") || told.contains("no difference"), "{told}");
    }
}

/// Samples are doubled where that may tell filters apart, up to the limit and no further, and the report has how many were taken.
#[test]
fn samples_are_doubled_up_to_the_limit_where_noise_hides_the_nearest() {
    let (folder, model) = square();
    let out = folder.path().join("out");
    let shared =
        ["compare", text(&model), "-o", text(&out), "--size", "32", "--spp", "2", "--truth-spp", "4"];
    let taken = |most: &str| {
        let flags = ["--distances", "1,2", "--filters", "ml,linear", "--most-truth-spp", most];
        let report = kinran_json(&[&shared[..], &flags].concat());
        let samples = |i: usize, what: &str| report["findings"][i][what].as_u64().unwrap();
        [0, 1].map(|i| (samples(i, "samples_per_pixel"), samples(i, "truth_samples_per_pixel")))
    };
    assert_eq!(taken("4"), [(2, 4), (4, 8)]);
    let more = taken("64");
    for (i, (filters, truth)) in more.into_iter().enumerate() {
        let first = 4 << i;
        assert!(truth % first == 0 && (first..=64 << i).contains(&truth) && filters * 2 == truth, "{more:?}");
    }
}

/// A picture of a model or a folder from far away, where mips matter.
fn far(model: &Path, flags: &[&str], out: &Path) -> Vec<[u8; 3]> {
    let args = ["render", text(model), "-o", text(out), "--size", "64x64", "--spp", "64", "--distance", "3"];
    let said = kinran(&[&args[..], &["--max-anisotropy", "1"], flags].concat());
    assert_eq!(said.code, Some(0), "{}: {}", model.display(), said.err);
    pixels(&read_image(out).unwrap())
}

#[test]
fn a_baked_model_is_drawn_with_its_own_levels() {
    let (folder, model) = square();
    let out = folder.path().join("out.png");
    // What is isotropic has no map of a direction in Khronos' form, so that its levels are round there.
    for (form, near) in [("khr", 0.03), ("both", 0.01)] {
        let baked = |filter: &str| {
            let name = folder.path().join(format!("{form} {filter}"));
            let args = ["bake", text(&model), "-o", text(&name), "--filter", filter, "--form", form];
            assert_eq!(kinran(&args).code, Some(0));
            name
        };
        let (linear, naive) = (baked("linear"), baked("naive"));
        let own = far(&linear, &[], &out);
        let again = rmse_srgb8(&own, &far(&model, &["--filter", "linear"], &out)).unwrap();
        let other = rmse_srgb8(&own, &far(&naive, &[], &out)).unwrap();
        let rebaked = far(&linear, &["--filter", "naive"], &out);
        let by_hand = rmse_srgb8(&rebaked, &far(&model, &["--filter", "naive"], &out)).unwrap();
        assert!(again < near, "form {form}: RMSE {again} beside the same in memory, {other} beside naive");
        assert!(
            other > 1.5 * again,
            "form {form}: RMSE {other} beside naive levels, {again} beside the same"
        );
        assert!(by_hand < 1e-6, "form {form}: --filter bakes the authored maps again: {by_hand}");
    }
    refused(&["render", text(&model), "-o", text(&out), "--filter", "baked"], &["--filter baked", "leave"]);
}

#[test]
fn a_folder_of_baked_textures_is_laid_on_a_board() {
    let folder = tempfile::tempdir().unwrap();
    let (maps, baked) = (folder.path().join("maps"), folder.path().join("baked"));
    std::fs::create_dir(&maps).unwrap();
    std::fs::write(maps.join("tin_normal.png"), encode_png(&bumps()).unwrap()).unwrap();
    let red = Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![200, 10, 10])).unwrap();
    std::fs::write(maps.join("tin_baseColor.png"), encode_png(&red).unwrap()).unwrap();
    assert_eq!(kinran(&["bake", text(&maps), "-o", text(&baked), "--roughness", "0.6"]).code, Some(0));
    let out = folder.path().join("out.png");
    let middle = far(&baked, &["--from", "0,0,1"], &out)[32 * 64 + 32];
    assert!(middle[0] > 80 && middle[0] > 2 * middle[1], "a red board, got {middle:?}");

    refused(&["render", text(&baked), "-o", text(&out), "--filter", "ml"], &["no maps to bake"]);
    for command in ["compare", "skin"] {
        refused(
            &[command, text(&baked), "-o", text(&folder.path().join("new"))],
            &["no model", "kinran render"],
        );
    }
    std::fs::remove_file(baked.join("tin_normal.ktx2")).unwrap();
    refused(&["render", text(&baked), "-o", text(&out)], &["tin_normal.ktx2"]);
    refused(&["render", text(&maps), "-o", text(&out)], &["no .glb", "bake one"]);
}

/// Fibres that are lit from all sides of a dark base.
#[test]
fn the_simple_form_of_fuzz_changes_nothing_at_its_defaults() {
    let (folder, model) = square();
    let out = folder.path().join("fuzz");
    let words = ["fuzz", text(&model), "-o", text(&out), "--sheet", "simple", "--size", "160", "--spp", "1"];
    assert_eq!(kinran(&words).code, Some(0));
    let sheet = read_image(&out.join("simple.png")).unwrap();
    let (all, width) = (pixels(&sheet), sheet.width as usize);
    // Pictures of 160 pixels and gaps of 10, under a line of labels; the last 100 rows have none.
    let cell = |i: usize| {
        let rows =
            (sheet.height as usize - 120..sheet.height as usize - 20).map(move |y| y * width + 10 + 170 * i);
        rows.flat_map(|at| all[at + 20..at + 140].to_vec()).collect::<Vec<_>>()
    };
    let [off, on] = [cell(0), cell(2)];
    let apart =
        off.iter().zip(&on).map(|(a, b)| f32::from(a[0].abs_diff(b[0]))).sum::<f32>() / off.len() as f32;
    assert!(apart > 8.0, "a mean difference of {apart} steps of red between off and on");
}

#[test]
fn a_folder_of_baked_colour_alone_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (maps, baked) = (folder.path().join("maps"), folder.path().join("baked"));
    std::fs::create_dir(&maps).unwrap();
    let red = Image::new(1, 1, Channels::Rgb, Pixels::U8(vec![200, 10, 10])).unwrap();
    std::fs::write(maps.join("tin_baseColor.png"), encode_png(&red).unwrap()).unwrap();
    assert_eq!(kinran(&["bake", text(&maps), "-o", text(&baked)]).code, Some(0));
    let middle = far(&baked, &["--from", "0,0,1"], &folder.path().join("out.png"))[32 * 64 + 32];
    assert!(middle[0] > 40 && middle[0] > 2 * middle[1], "a red board, got {middle:?}");
}

/// A clearcoat that no picture shows is told, once for all materials that have one.
#[test]
fn what_is_not_drawn_is_left_out_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("lacquer.gltf");
    let lacquer = json!({ "KHR_materials_clearcoat": { "clearcoatFactor": 1 } });
    let document = json!({
        "asset": { "version": "2.0" }, "extensionsUsed": ["KHR_materials_clearcoat"],
        "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "materials": [{ "name": "red", "extensions": lacquer }, { "name": "black", "extensions": lacquer }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
        "accessors": [{
            "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0],
        }],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{
            "byteLength": 36,
            "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA",
        }],
    });
    std::fs::write(&model, document.to_string()).unwrap();
    let out = folder.path().join("a.png");
    let said = kinran(&["render", text(&model), "-o", text(&out), "--size", "16x16", "--spp", "1"]);
    let wanted = "material \"red\" and 1 more: KHR_materials_clearcoat is not drawn";
    assert!(said.err.contains(wanted), "wanted {wanted:?}, got {:?}", said.err);
}

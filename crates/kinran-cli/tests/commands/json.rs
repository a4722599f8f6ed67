//! What `--json` prints is what its schema says, with and without `--dry-run`, and errors too.

use std::path::Path;

use serde_json::Value;

use crate::common::{bumps, kinran, kinran_json, square, text};
use crate::shape::valid;
use kinran_image::{Channels, Image, Pixels, write_png};

/// A folder with a material in each of two folders.
fn materials() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, grey) in [("tin", 90), ("lead", 170)] {
        let maps = folder.path().join(name);
        std::fs::create_dir(&maps).unwrap();
        write_png(&maps.join(format!("{name}_normal.png")), &bumps()).unwrap();
        let flat = |channels: Channels, samples: &[u8]| {
            Image::new(32, 32, channels, Pixels::U8(samples.repeat(32 * 32))).unwrap()
        };
        write_png(&maps.join(format!("{name}_roughness.png")), &flat(Channels::R, &[grey])).unwrap();
        write_png(&maps.join(format!("{name}_color.png")), &flat(Channels::Rgb, &[grey, 120, 60])).unwrap();
    }
    folder
}

/// `KINRAN_WRITE_SCHEMAS=1 cargo test --release -p kinran-cli --all-features --test commands schemas` writes them.
#[test]
fn schemas_in_docs_are_those_of_the_reports() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema/json");
    for (name, schema) in kinran_cli::schemas() {
        let path = folder.join(format!("{name}.schema.json"));
        let wanted = serde_json::to_string_pretty(&schema).unwrap() + "\n";
        if std::env::var_os("KINRAN_WRITE_SCHEMAS").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &wanted).unwrap();
        }
        let got = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(got == wanted, "{}: is no longer what the report is; write it anew", path.display());
    }
}

#[test]
fn a_bake_has_one_shape_with_and_without_a_dry_run() {
    let (folder, model) = square();
    let library = materials();
    let out = folder.path().join("out");
    for input in [library.path().join("tin"), model.clone()] {
        let args = ["bake", text(&input), "-o", text(&out)];
        let (dry, wet) = (kinran_json(&[&args[..], &["--dry-run"]].concat()), kinran_json(&args));
        valid("bake", &dry);
        valid("bake", &wet);
        let keys = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        assert_eq!(keys(&dry), keys(&wet), "{}", input.display());
        assert_eq!((dry["dry_run"].as_bool(), wet["dry_run"].as_bool()), (Some(true), Some(false)));
        assert_eq!(dry["files"], wet["files"]);
        let names = |value: &Value| -> Vec<Value> {
            value["surfaces"].as_array().unwrap().iter().map(|surface| surface["name"].clone()).collect()
        };
        assert!(!names(&dry).is_empty() && names(&dry) == names(&wet), "{dry:#} {wet:#}");
        assert!(wet["surfaces"][0]["outputs"].as_array().is_some_and(|files| files.len() > 1), "{wet:#}");
    }

    let dry = kinran_json(&["init", text(library.path()), "--dry-run"]);
    let wet = kinran_json(&["init", text(library.path())]);
    valid("init", &dry);
    valid("init", &wet);
    assert_eq!((&dry["text"], dry["folders"].as_u64()), (&wet["text"], Some(2)));
    let (manifest, cache) = (library.path().join("kinran.toml"), folder.path().join("cache"));
    let args = ["bake", text(&manifest), "--cache", text(&cache)];
    valid("bake-manifest", &kinran_json(&[&args[..], &["--dry-run"]].concat()));
    valid("bake-manifest", &kinran_json(&args));
    valid("cache", &kinran_json(&["cache", "--cache", text(&cache)]));
    let baked = library.path().join("baked/tin/tin_aniso.ktx2");
    valid("inspect", &kinran_json(&["inspect", text(&baked)]));
}

#[test]
fn every_result_is_what_its_schema_says() {
    let (folder, model) = square();
    let library = materials();
    let place = |name: &str| folder.path().join(name);
    let (compared, solved, reported) = (place("c"), place("d"), place("r"));
    let tiny = ["--size", "16", "--spp", "1"];
    let with_tiny = |args: &[&str]| kinran_json(&[args, &tiny[..]].concat());
    let model = text(&model);

    valid("render", &with_tiny(&["render", model, "-o", text(&place("p.png"))]));
    let compare = ["compare", model, "-o", text(&compared), "--truth-spp", "1", "--distances", "1"];
    valid("compare", &with_tiny(&compare));
    valid("fuzz", &with_tiny(&["fuzz", model, "-o", text(&place("f")), "--sheet", "simple"]));
    valid("skin", &with_tiny(&["skin", model, "-o", text(&place("s")), "--sheet", "shadows"]));
    let (target, tile) =
        (library.path().join("tin/tin_color.png"), library.path().join("lead/lead_color.png"));
    let solve = ["detail", "solve", text(&target), "--layer", text(&tile), "-o", text(&solved), "--compare"];
    valid("detail-solve", &kinran_json(&solve));
    let report = ["detail", "report", text(library.path()), "-o", text(&reported), "--size", "32"];
    valid("detail-report", &kinran_json(&[&report[..], &["--kind", "color", "--format", "bc1"]].concat()));
    valid("inspect", &kinran_json(&["inspect", model]));
    valid("inspect", &kinran_json(&["inspect", text(&target)]));
    valid("fit-fuzz", &kinran_json(&["fit", "fuzz", "--tilt", "30", "--spread", "0.2"]));
    valid("shaders", &kinran_json(&["shaders", "--list"]));
    valid("shaders", &kinran_json(&["shaders", "--lang", "hlsl", "--module", "ggx"]));
    valid("shaders", &kinran_json(&["shaders", "--lang", "hlsl", "-o", text(&place("h"))]));
    valid("skin-lut", &kinran_json(&["skin-lut", "-o", text(&place("t")), "--size", "8", "--penumbra"]));
    valid("completions", &kinran_json(&["completions", "bash"]));
    valid("completions", &kinran_json(&["man"]));
    valid("completions", &kinran_json(&["man", "-o", text(&place("m"))]));
}

#[test]
fn an_error_is_one_document_whoever_finds_it() {
    let (folder, model) = square();
    let (gone, out) = (folder.path().join("gone.glb"), folder.path().join("out"));
    let manifest = folder.path().join("kinran.toml");
    std::fs::write(&manifest, "[[aniso]]\ninput = \"*\"\nsharpness = 3\n").unwrap();
    std::fs::write(folder.path().join("torn.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    let (torn, empty) = (folder.path().join("torn.png"), folder.path().join("empty"));
    std::fs::create_dir(&empty).unwrap();
    let cases: [(&[&str], &str, Option<&Path>); 12] = [
        (&["bake", text(&gone), "-o", text(&out)], "io", Some(&gone)),
        (&["bake", text(&empty), "-o", text(&out)], "maps", Some(&empty)),
        (&["bake", text(&manifest)], "manifest", Some(&manifest)),
        (&["render", text(&gone), "-o", "p.png"], "input", Some(&gone)),
        (&["render", text(&model), "-o", "p.jpg"], "input", Some(Path::new("p.jpg"))),
        (&["compare", text(&gone), "-o", text(&out)], "io", Some(&gone)),
        (&["inspect", text(&torn)], "malformed", Some(&torn)),
        (&["init", text(&empty)], "input", Some(&empty)),
        // What is wrong with words is found before a command runs.
        (&["render"], "usage", None),
        (&["bake", "x", "--sharpness", "3"], "usage", None),
        (&["bak"], "usage", None),
        (&["render", text(&model), "-o", "p.png", "--size", "huge"], "usage", None),
    ];
    for (args, code, file) in cases {
        let said = kinran(&[args, &["--json"]].concat());
        assert_eq!(said.code, Some(2), "{args:?}: {}{}", said.out, said.err);
        let document: Value =
            serde_json::from_str(&said.out).unwrap_or_else(|e| panic!("{args:?}: {e}: {}", said.out));
        valid("error", &document);
        let error = &document["error"];
        assert_eq!(
            (error["code"].as_str(), error["exit_code"].as_u64()),
            (Some(code), Some(2)),
            "{args:?}: {error}"
        );
        assert_eq!(error["file"].as_str().map(Path::new), file, "{args:?}: {error}");
        // People read the same on standard error.
        let message = error["message"].as_str().unwrap();
        assert_eq!(said.err.lines().next(), Some(format!("error: {message}").as_str()), "{args:?}");
    }
    let said = kinran(&["bake", text(&manifest), "--json"]);
    let document: Value = serde_json::from_str(&said.out).unwrap();
    assert_eq!(
        (document["error"]["line"].as_u64(), document["error"]["column"].as_u64()),
        (Some(3), Some(1))
    );

    // Entries that fail stand in the report, which stays one document.
    std::fs::write(&manifest, "[[mesh]]\ninput = \"gone.glb\"\n").unwrap();
    let said = kinran(&["bake", text(&manifest), "--json"]);
    assert_eq!(said.code, Some(2), "{}", said.err);
    let report: Value = serde_json::from_str(&said.out).unwrap();
    valid("bake-manifest", &report);
    assert_eq!(report["entries"][0]["status"], "failed", "{report}");
}

/// The words that lead to each command that does something, and the command.
fn commands<'a>(
    command: &'a clap::Command,
    path: &[String],
    all: &mut Vec<(Vec<String>, &'a clap::Command)>,
) {
    if !command.has_subcommands() {
        all.push((path.to_vec(), command));
    }
    for inner in command.get_subcommands() {
        commands(inner, &[path, &[inner.get_name().to_owned()]].concat(), all);
    }
}

/// Runs a command that must fail; gives its error, which has the shape of its schema and exit code 2.
fn error_of(folder: &Path, args: &[&str]) -> Value {
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(args)
        .arg("--json")
        .current_dir(folder)
        .env_remove("KINRAN_CACHE")
        .output()
        .unwrap();
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert_eq!(output.status.code(), Some(2), "{args:?}: {out}{err}");
    assert!(!err.contains("panicked"), "{args:?}: {err}");
    let document: Value = serde_json::from_str(&out).unwrap_or_else(|e| panic!("{args:?}: {e}: {out}{err}"));
    valid("error", &document);
    assert_eq!(document["error"]["exit_code"], 2, "{args:?}: {document}");
    document["error"].clone()
}

/// Every flag of every command that takes a value other than a path, with one that is none.
#[test]
fn a_value_that_is_none_is_told_without_its_flag() {
    let folder = tempfile::tempdir().unwrap();
    let program = kinran_cli::cli::command();
    let mut all = Vec::new();
    commands(&program, &[], &mut all);
    let is_path = |flag: &clap::Arg| {
        flag.get_value_parser().type_id() == clap::value_parser!(std::path::PathBuf).type_id()
    };
    let mut tried = 0;
    for (path, command) in &all {
        let path: Vec<&str> = path.iter().map(String::as_str).collect();
        if path == ["view"] && !cfg!(feature = "view") {
            continue;
        }
        let unknown = error_of(folder.path(), &[&path[..], &["--sharpness"]].concat());
        assert_eq!(
            (&unknown["code"], &unknown["flag"]),
            (&"usage".into(), &"--sharpness".into()),
            "{path:?}"
        );
        for flag in command.get_arguments().filter(|flag| flag.get_action().takes_values() && !is_path(flag))
        {
            let Some(long) = flag.get_long().map(|long| format!("--{long}")) else { continue };
            let word = format!("{long}=no/such=value");
            let error = error_of(folder.path(), &[&path[..], &[&word]].concat());
            if error["file"] == "no/such=value" {
                continue;
            }
            assert_eq!(error["code"], "usage", "{path:?} {word}: {error}");
            // Where any word may be a name, it is taken, and something else is missing.
            let missing = error["message"].as_str().is_some_and(|text| text.contains("were not provided"));
            assert!(error["flag"] == long || missing, "{path:?} {word}: {error}");
            tried += usize::from(!missing);
        }
        // A positional argument that must be there.
        if let Some(first) = command.get_positionals().find(|argument| argument.is_required_set()) {
            let name = format!("<{}>", first.get_value_names().unwrap()[0]);
            let error = error_of(folder.path(), &path);
            assert!(
                error["flag"] == name || error["flag"].as_str().unwrap().starts_with("--"),
                "{path:?}: {error}"
            );
        }
    }
    assert!(tried > 150, "only {tried} flags");
    assert!(crate::common::files(folder.path()).is_empty(), "{:?}", crate::common::files(folder.path()));
}

/// A file of every command that is missing, a folder, damaged, or in the way, and a flag that does not suit it.
#[test]
fn a_file_or_flag_is_told_in_words_alone() {
    let (folder, model) = square();
    let library = materials();
    let place = |name: &str| folder.path().join(name);
    std::fs::write(place("torn.glb"), b"glTF\x02\0\0\0 and no more").unwrap();
    std::fs::write(place("torn.png"), b"\x89PNG\r\n\x1a\nnothing").unwrap();
    for name in ["torn.ktx2", "torn.json", "torn.csv", "torn.exr", "notes.txt", "index.html"] {
        std::fs::write(place(name), "nothing,at all").unwrap();
    }
    std::fs::create_dir(place("empty")).unwrap();
    std::fs::create_dir(place("shaders")).unwrap();
    std::fs::write(place("shaders/forwards.wgsl"), "").unwrap();
    std::fs::write(place("twice.toml"), "[[aniso]]\ninput = 3\n").unwrap();
    let maps = library.path().join("tin");
    let (maps, tin) = (text(&maps), text(library.path()));
    let (model, gone) = (text(&model), "gone.glb");
    let color = format!("{maps}/tin_color.png");
    let layer = format!("--layer={color}");
    // Words, and the file and the flag that the error must name.
    let cases: Vec<(Vec<&str>, &str, &str)> = vec![
        (vec!["bake", gone], gone, ""),
        (vec!["bake", "torn.glb"], "torn.glb", ""),
        (vec!["bake", "notes.txt"], "notes.txt", ""),
        (vec!["bake", "empty"], "empty", ""),
        (vec!["bake", model, "-o", "notes.txt"], "notes.txt", ""),
        (vec!["bake", model, "--edges", "clamp"], model, "--edges"),
        (vec!["bake", model, "--watch"], model, "--watch"),
        (vec!["bake", model, "--skin", "leather"], model, "--skin"),
        (vec!["bake", model, "--allow-outside", "gone"], "", "--allow-outside"),
        (vec!["bake", maps, "--normal-format", "bc4"], "", "--normal-format"),
        (vec!["bake", maps, "--map", "normal=gone.png"], "", "--map"),
        (vec!["bake", maps, "--ignore", "gone.png"], "", "--ignore"),
        (vec!["bake", "twice.toml"], "twice.toml", ""),
        (vec!["bake", "gone.toml"], "gone.toml", ""),
        (vec!["bake", "twice.toml", "--force"], "twice.toml", "--force"),
        (vec!["init", "empty"], "empty", ""),
        (vec!["init", "gone"], "gone", ""),
        (vec!["cache", "--cache", "empty"], "empty", ""),
        (vec!["render", gone], gone, ""),
        (vec!["render", "torn.glb"], "torn.glb", ""),
        (vec!["render", model, "-o", "p.gif"], "p.gif", ""),
        (vec!["render", model, "-o", "notes.txt/p.png"], "notes.txt", ""),
        (vec!["render", model, "--env", "gone.hdr"], "gone.hdr", ""),
        (vec!["render", model, "--env", "torn.exr"], "torn.exr", ""),
        (vec!["render", model, "--camera", "3"], model, "--camera"),
        (vec!["render", model, "--filter", "baked"], model, "--filter"),
        (vec!["render", "empty"], "empty", ""),
        (vec!["compare", gone], gone, ""),
        (vec!["compare", "torn.glb"], "torn.glb", ""),
        (vec!["compare", model, "-o", "notes.txt"], "notes.txt", ""),
        (vec!["detail", "solve", "gone.png", &layer], "gone.png", ""),
        (vec!["detail", "solve", "torn.png", &layer], "torn.png", ""),
        (vec!["detail", "solve", &color, "--layer=gone.png"], "gone.png", ""),
        (vec!["detail", "solve", &color, &layer, "--model", gone], gone, ""),
        (vec!["detail", "solve", &color, &layer, "--model", model, "--material", "tin"], model, "--material"),
        (vec!["detail", "solve", &color, &layer, "--max-error", "0"], &color, "--max-error"),
        (vec!["detail", "report", "empty"], "empty", ""),
        (vec!["detail", "report", "gone"], "gone", ""),
        (vec!["detail", "report", tin, "-o", "."], "./index.html", ""),
        (vec!["inspect", "gone.png"], "gone.png", ""),
        (vec!["inspect", "torn.ktx2"], "torn.ktx2", ""),
        (vec!["inspect", "torn.json"], "torn.json", ""),
        (vec!["inspect", "notes.txt"], "notes.txt", ""),
        (vec!["inspect", &color, "--role", "normal"], &color, "--role"),
        (vec!["fit", "fuzz", "--tilt", "30", "--spread", "0.2", "--plots", "p.png"], "p.png", ""),
        (vec!["fuzz", gone], gone, ""),
        (vec!["fuzz", model, "-o", "notes.txt"], "notes.txt", ""),
        (vec!["fuzz", model, "--color", "2,0,0"], "", "--color"),
        (vec!["skin", gone], gone, ""),
        (vec!["skin", "torn.glb"], "torn.glb", ""),
        (vec!["skin", model, "--base", "0,0,7"], "", "--base"),
        (vec!["skin-lut", "--profile", "gone.csv"], "gone.csv", ""),
        (vec!["skin-lut", "--profile", "torn.csv"], "torn.csv", ""),
        (vec!["skin-lut", "--profile", "torn.json"], "torn.json", ""),
        (vec!["skin-lut", "--burley", "0,0,0"], "", "--burley"),
        (vec!["skin-lut", "--albedo", "1,1,1"], "", "--mean-free-path"),
        (vec!["skin-lut", "-o", "notes.txt"], "notes.txt", ""),
        (vec!["shaders", "--lang", "wgsl", "--module", "velvet"], "", "--module"),
        (vec!["shaders", "--lang", "spirv"], "", "--lang"),
        (vec!["shaders", "--lang", "wgsl", "-o", "notes.txt"], "notes.txt", ""),
        (vec!["demo", "--quick", "-o", "notes.txt"], "notes.txt", ""),
        (vec!["demo", "--quick", "-o", "."], "./index.html", ""),
        (vec!["man", "-o", "notes.txt"], "notes.txt", ""),
        (vec!["completions", "cmd"], "", "<SHELL>"),
    ];
    let views = [
        (vec!["view", gone], gone, ""),
        (vec!["view", model, "--parameters", "gone.json"], "gone.json", ""),
        (vec!["view", model, "--parameters", "torn.json"], "torn.json", ""),
        (vec!["view", model, "--screenshot", "p.gif"], "p.gif", ""),
    ];
    let named = cases.into_iter().chain(views.into_iter().filter(|_| cfg!(feature = "view")));
    let mut commands_tried = std::collections::BTreeSet::new();
    for (args, file, flag) in named {
        commands_tried.insert(args[0].to_owned());
        let error = error_of(folder.path(), &args);
        let [got_file, got_flag] = ["file", "flag"].map(|key| error[key].as_str().unwrap_or(""));
        assert_eq!((got_file, got_flag), (file, flag), "{args:?}: {error}");
    }
    for command in kinran_cli::cli::command().get_subcommands() {
        let name = command.get_name();
        assert!(commands_tried.contains(name) || name == "view", "no error of {name} was tried");
    }
    let before = ["empty", "index.html", "notes.txt", "shaders", "square.glb"];
    let left: Vec<String> = crate::common::files(folder.path());
    let others: Vec<&String> =
        left.iter().filter(|name| !before.contains(&name.as_str()) && !name.contains("torn")).collect();
    assert_eq!(others, ["twice.toml"], "something was written");
}

/// What an entry of a library fails by has the shape of any error.
#[test]
fn an_entry_s_error_is_told_in_words_alone() {
    let (folder, _) = square();
    let library = materials();
    let color = library.path().join("tin/tin_color.png");
    std::fs::write(library.path().join("lead/lead_normal.png"), "torn").unwrap();
    let manifest = library.path().join("kinran.toml");
    let entries = format!(
        "cache = \"{}\"\n[[aniso]]\ninput = \"*\"\n[[detail]]\ninput = \"{}\"\nmax-error = 0\nlayer = [\"{}\"]\n",
        text(&folder.path().join("cache")),
        text(&color),
        text(&color)
    );
    std::fs::write(&manifest, entries).unwrap();
    let said = kinran(&["bake", text(&manifest), "--json"]);
    assert_eq!(said.code, Some(2), "{}{}", said.out, said.err);
    let report: Value = serde_json::from_str(&said.out).unwrap();
    valid("bake-manifest", &report);
    let errors: Vec<&Value> = report["entries"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entry| &entry["error"])
        .filter(|error| !error.is_null())
        .collect();
    let torn = library.path().join("lead/lead_normal.png");
    let wanted = [(text(&torn), Value::Null), (text(&color), "--max-error".into())];
    assert_eq!(errors.len(), wanted.len(), "{report:#}");
    for (error, (file, flag)) in errors.iter().zip(&wanted) {
        assert_eq!((error["file"].as_str(), &error["flag"]), (Some(*file), flag), "{error}");
    }
}

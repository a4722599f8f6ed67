//! What `--json` prints is what its schema says, with and without `--dry-run`, and errors too.

use std::path::Path;

use serde_json::Value;

use crate::common::{bumps, kinran, kinran_json, square, text};
use kinran_image::{Channels, Image, Pixels, write_png};

/// The members that a schema knows, those of what it refers to too; `None` where any may be there.
fn members<'a>(schema: &'a Value, root: &'a Value) -> Option<Vec<&'a String>> {
    let rules = schema.as_object()?;
    if rules.contains_key("additionalProperties") {
        return None;
    }
    let mut known: Vec<&String> = Vec::new();
    known.extend(
        rules.get("properties").and_then(Value::as_object).into_iter().flat_map(|object| object.keys()),
    );
    for rule in ["anyOf", "oneOf", "allOf"] {
        for schema in rules.get(rule).and_then(Value::as_array).into_iter().flatten() {
            known.extend(members(schema, root)?);
        }
    }
    if let Some(target) = rules.get("$ref") {
        known.extend(members(definition(target, root), root)?);
    }
    Some(known)
}

fn definition<'a>(target: &Value, root: &'a Value) -> &'a Value {
    let place = target.as_str().unwrap().trim_start_matches('#');
    root.pointer(place).unwrap_or_else(|| panic!("{target} is nowhere"))
}

/// What of `value` is not as `schema` says, or stands nowhere in it.
fn wrong(schema: &Value, root: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    if let (Some(known), Some(object)) = (members(schema, root), value.as_object()) {
        let unknown = object.keys().filter(|name| !known.contains(name));
        found.extend(unknown.map(|name| format!("{place}.{name}: stands in no schema")));
    }
    broken(schema, root, value, place, found);
}

/// The rules of `schema` that `value` breaks, those rules that the committed schemas have; any other is an error here.
/// `root` has the definitions.
fn broken(schema: &Value, root: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    let ok = |schema: &Value| {
        let mut found = Vec::new();
        broken(schema, root, value, place, &mut found);
        found.is_empty()
    };
    let Some(rules) = schema.as_object() else {
        if schema == &Value::Bool(false) {
            found.push(format!("{place}: must not be there"));
        }
        return;
    };
    let no_items = Vec::new();
    for (rule, wanted) in rules {
        let list = wanted.as_array().unwrap_or(&no_items);
        let holds = match rule.as_str() {
            "title" | "description" | "$schema" | "$defs" | "format" | "default" => true,
            "type" => {
                let is = |name: &Value| match name.as_str().unwrap() {
                    "null" => value.is_null(),
                    "boolean" => value.is_boolean(),
                    "string" => value.is_string(),
                    "array" => value.is_array(),
                    "object" => value.is_object(),
                    "number" => value.is_number(),
                    "integer" => value.is_i64() || value.is_u64(),
                    other => panic!("{place}: type {other}"),
                };
                if wanted.is_array() { list.iter().any(is) } else { is(wanted) }
            }
            "minimum" => value.as_f64().is_none_or(|value| value >= wanted.as_f64().unwrap()),
            "maximum" => value.as_f64().is_none_or(|value| value <= wanted.as_f64().unwrap()),
            "minItems" => value.as_array().is_none_or(|items| items.len() as u64 >= wanted.as_u64().unwrap()),
            "maxItems" => value.as_array().is_none_or(|items| items.len() as u64 <= wanted.as_u64().unwrap()),
            "const" => value == wanted,
            "enum" => list.contains(value),
            "anyOf" => list.iter().any(ok),
            "oneOf" => list.iter().filter(|schema| ok(schema)).count() == 1,
            "allOf" => list.iter().all(ok),
            "required" => list.iter().all(|name| value.get(name.as_str().unwrap()).is_some()),
            "$ref" => {
                broken(definition(wanted, root), root, value, place, found);
                true
            }
            "items" => {
                for (i, item) in value.as_array().into_iter().flatten().enumerate() {
                    wrong(wanted, root, item, &format!("{place}[{i}]"), found);
                }
                true
            }
            "properties" => {
                for (name, schema) in wanted.as_object().unwrap() {
                    if let Some(value) = value.get(name) {
                        wrong(schema, root, value, &format!("{place}.{name}"), found);
                    }
                }
                true
            }
            "additionalProperties" => {
                for (name, value) in value.as_object().into_iter().flatten() {
                    if rules.get("properties").is_none_or(|known| known.get(name).is_none()) {
                        wrong(wanted, root, value, &format!("{place}.{name}"), found);
                    }
                }
                true
            }
            other => panic!("{place}: the schemas have come to use {other}"),
        };
        if !holds {
            found.push(format!("{place}: {rule} {wanted}"));
        }
    }
}

/// Asserts that a document has the shape that docs/schema/json/NAME.schema.json says.
fn valid(name: &str, document: &Value) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema/json");
    let schema = std::fs::read_to_string(folder.join(format!("{name}.schema.json"))).unwrap();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    let against = |document: &Value| {
        let mut found = Vec::new();
        wrong(&schema, &schema, document, "$", &mut found);
        found
    };
    let found = against(document);
    assert!(found.is_empty(), "{name}: {found:#?} in {document:#}");
    assert!(!against(&Value::Null).is_empty(), "{name} takes anything");
    assert!(!against(&serde_json::json!({ "velvet": 1 })).is_empty(), "{name} takes any member");
}

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

/// `KINRAN_WRITE_SCHEMAS=1 cargo test --release -p kinran --all-features --test commands schemas` writes them.
#[test]
fn schemas_in_docs_are_those_of_the_reports() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/schema/json");
    for (name, schema) in kinran::schemas() {
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
        (&["render", text(&model)], "usage", None),
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

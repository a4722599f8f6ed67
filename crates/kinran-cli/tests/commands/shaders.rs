//! `kinran shaders`: the shader library as files.

use crate::common::{files, kinran, kinran_json, refused, text};

const MODULES: [&str; 21] = [
    "aniso",
    "beckmann",
    "detail_hsv",
    "detail_layer",
    "detail_normal",
    "detail_over",
    "detail_overlay",
    "frame",
    "fuzz_ambient",
    "fuzz_deferred",
    "fuzz_layer",
    "fuzz_p_s",
    "fuzz_phase",
    "fuzz_sampling",
    "ggx",
    "multiscatter",
    "sggx",
    "sh",
    "skin_curvature",
    "skin_lighting",
    "sym",
];

#[test]
fn every_language_comes_as_a_folder_that_says_what_the_crate_says() {
    let folder = tempfile::tempdir().unwrap();
    for (language, extension, whole) in [
        ("wgsl", "wgsl", Some(kinran_shaders::wgsl::ALL)),
        ("glsl-450", "glsl", Some(kinran_shaders::glsl_450::ALL)),
        ("glsl-es-300", "glsl", Some(kinran_shaders::glsl_es_300::ALL)),
        ("hlsl", "hlsl", Some(kinran_shaders::hlsl::ALL)),
        ("msl", "h", Some(kinran_shaders::msl::ALL)),
        ("wesl", "wesl", None),
    ] {
        let out = folder.path().join(language);
        let report = kinran_json(&["shaders", "--lang", language, "-o", text(&out)]);
        assert_eq!(report["language"], language);
        let mut wanted: Vec<String> = MODULES.iter().map(|module| format!("{module}.{extension}")).collect();
        wanted.push("README.md".into());
        if let Some(whole) = whole {
            let name = format!("kinran.{extension}");
            assert_eq!(std::fs::read_to_string(out.join(&name)).unwrap(), whole, "{language}");
            wanted.push(name);
        }
        wanted.sort();
        assert_eq!(files(&out), wanted, "{language}");
    }
    let out = folder.path().join("spirv");
    assert_eq!(kinran(&["shaders", "--lang", "spirv", "-o", text(&out)]).code, Some(0));
    assert_eq!(files(&out), ["README.md", "kinran.spv"]);
    assert_eq!(std::fs::read(out.join("kinran.spv")).unwrap(), kinran_shaders::SPIRV);
}

#[test]
fn a_module_brings_what_it_needs_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let said = kinran(&["shaders", "--lang", "hlsl", "--module", "ggx", "-o", text(&out)]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert_eq!(files(&out), ["README.md", "ggx.hlsl", "sym.hlsl"]);

    // Printed, it stands alone: declared before used, and no file to include. Also when quiet.
    let said = kinran(&["shaders", "--lang", "hlsl", "--module", "ggx", "--quiet"]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    assert!(!said.out.contains("#include"), "{}", said.out);
    let at = |what: &str| said.out.find(what).unwrap_or_else(|| panic!("{what} is not there: {}", said.out));
    assert!(at("float sym2_det(") < at("float ggx_matrix_d("));
    assert!(!said.out.contains("aniso_decode("), "{}", said.out);

    // A group's name is that of all its modules.
    let out = folder.path().join("fuzz");
    let said = kinran(&["shaders", "--lang", "wgsl", "--module", "fuzz", "-o", text(&out)]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    let of_fuzz: Vec<String> =
        MODULES.iter().filter(|name| name.starts_with("fuzz_")).map(|name| format!("{name}.wgsl")).collect();
    let written = files(&out);
    assert!(of_fuzz.len() > 3 && of_fuzz.iter().all(|name| written.contains(name)), "{written:?}");
    assert!(
        !written.iter().any(|name| name.starts_with("skin") || name.starts_with("detail")),
        "{written:?}"
    );
    let said = kinran(&["shaders", "--lang", "glsl-450", "--module", "skin"]);
    assert!(said.code == Some(0) && said.out.contains("curvature_decode("), "{}", said.err);
    refused(&["shaders", "--lang", "wesl", "--module", "fuzz"], &["several modules", "--output"]);

    // WESL has imports for what it needs.
    let said = kinran(&["shaders", "--lang", "wesl", "--module", "ggx"]);
    assert!(said.out.contains("import package::sym") && !said.out.contains("fn sym2_det"), "{}", said.out);
}

#[test]
fn the_list_names_modules_and_functions() {
    let modules = kinran_json(&["shaders", "--list"]);
    let names: Vec<_> =
        modules["modules"].as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    let mut sorted = names.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, MODULES);
    let ggx = modules["modules"].as_array().unwrap().iter().find(|m| m["name"] == "ggx").unwrap();
    assert_eq!(ggx["needs"], serde_json::json!(["sym"]));
    assert!(ggx["functions"].as_array().unwrap().iter().any(|f| f == "ggx_aniso_d"), "{ggx}");
    let said = kinran(&["shaders", "--list"]);
    assert!(said.code == Some(0) && said.out.contains("aniso_decode"), "{}{}", said.out, said.err);
}

#[test]
fn what_cannot_be_served_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    refused(&["shaders", "--lang", "glsl"], &["glsl", "glsl-450"]);
    refused(&["shaders", "-o", "out"], &["--lang"]);
    refused(&["shaders", "--lang", "wgsl", "--module", "velvet"], &["velvet", "ggx", "sym"]);
    refused(&["shaders", "--lang", "spirv"], &["spirv", "binary", "--output"]);
    refused(&["shaders", "--lang", "spirv", "--module", "ggx"], &["ggx", "one module"]);
    refused(&["shaders", "--lang", "wesl"], &["wesl", "--output"]);
    refused(&["shaders", "--list", "--lang", "wgsl"], &["--list"]);
    refused(&["shaders", "--lang", "wgsl", "-o", text(&file)], &["file", "name a folder"]);
}

//! What is shipped: every function in every language, with its comment, and texts that stand alone.

use kinran_shaders::{Module, glsl_450, glsl_es_300, hlsl, msl, wesl, wgsl, with_needs};

const TRANSLATED: [(&str, &[Module], &str); 4] = [
    ("GLSL 4.50", glsl_450::MODULES, glsl_450::ALL),
    ("GLSL ES 3.00", glsl_es_300::MODULES, glsl_es_300::ALL),
    ("HLSL", hlsl::MODULES, hlsl::ALL),
    ("MSL", msl::MODULES, msl::ALL),
];

/// The functions of a WESL text, each with the comment lines above it.
fn functions(wesl: &str) -> Vec<(&str, Vec<&str>)> {
    let mut functions = Vec::new();
    let mut comment = Vec::new();
    for line in wesl.lines() {
        if line.starts_with("///") {
            comment.push(line);
        } else {
            let comment = std::mem::take(&mut comment);
            if let Some(rest) = line.strip_prefix("fn ") {
                functions.push((rest.split('(').next().unwrap(), comment));
            }
        }
    }
    functions
}

/// The line that defines a function, and the comment lines above it.
fn definition<'a>(text: &'a str, name: &str) -> Option<(&'a str, Vec<&'a str>)> {
    let lines: Vec<&str> = text.lines().collect();
    let call = format!("{name}(");
    let is_definition = |line: &&str| {
        let before = line.split(&call).next().unwrap();
        line.contains(&call) && !line.starts_with([' ', '/', '#']) && before.ends_with(' ')
    };
    let at = lines.iter().position(is_definition)?;
    let start = lines[..at].iter().rposition(|line| !line.starts_with("///")).map_or(0, |i| i + 1);
    Some((lines[at], lines[start..at].to_vec()))
}

#[test]
fn every_function_keeps_its_name_and_its_comment_in_every_language() {
    let mut count = 0;
    for module in wesl::MODULES {
        for (name, comment) in functions(module.text) {
            count += 1;
            let languages = TRANSLATED.into_iter().chain([("WGSL", wgsl::MODULES, wgsl::ALL)]);
            for (language, modules, all) in languages {
                let translated = modules.iter().find(|m| m.name == module.name).unwrap();
                assert_eq!(translated.needs, module.needs, "{language}, {}", module.name);
                for text in [translated.text, all] {
                    let (_, header) =
                        definition(text, name).unwrap_or_else(|| panic!("{language} lost {name}"));
                    assert!(header.starts_with(&comment), "{language}, {name}: {header:#?}");
                    let cost = header.last().unwrap();
                    assert!(
                        cost.starts_with("/// Cost on GCN: "),
                        "{language}, {name}: no cost; run ./x cost"
                    );
                }
            }
        }
    }
    assert!(count > 50, "only {count} functions were found");
}

#[test]
fn every_text_has_its_licence_on_top() {
    let licence: Vec<&str> = wesl::SYM.lines().take(2).collect();
    assert!(licence[0].contains("SPDX-License-Identifier: MIT OR Apache-2.0"), "{licence:?}");
    for (language, modules, all) in TRANSLATED.into_iter().chain([("WGSL", wgsl::MODULES, wgsl::ALL)]) {
        for text in modules.iter().map(|m| m.text).chain([all]) {
            assert_eq!(text.lines().take(2).collect::<Vec<_>>(), licence, "{language}");
        }
    }
}

/// No compiler for Metal runs here, so the text is read.
#[test]
fn braces_close_and_guards_end() {
    for (language, modules, all) in TRANSLATED {
        for text in modules.iter().map(|m| m.text).chain([all]) {
            let code: Vec<&str> = text.lines().filter(|line| !line.starts_with("//")).collect();
            for (open, close) in [("{", "}"), ("(", ")"), ("[", "]"), ("#ifndef ", "#endif")] {
                let count = |what: &str| code.iter().map(|line| line.matches(what).count()).sum::<usize>();
                assert_eq!(count(open), count(close), "{language}: {open} {close}");
            }
            // naga's way to say that it has renamed something, or guards a loop or an index.
            for trace in ["naga_", "loop_bound", "metal::min(unsigned"] {
                assert!(!code.iter().any(|line| line.contains(trace)), "{language} has {trace}");
            }
        }
    }
}

#[test]
fn metal_functions_may_be_included_twice() {
    for (name, _) in wesl::MODULES.iter().flat_map(|m| functions(m.text)) {
        let (line, _) = definition(msl::ALL, name).unwrap();
        assert!(line.starts_with("inline "), "{line}");
    }
}

#[test]
fn wgsl_modules_with_what_they_need_are_valid() {
    for module in wgsl::MODULES {
        let text = with_needs(wgsl::MODULES, &[module.name]);
        let parsed = naga::front::wgsl::parse_str(&text);
        assert!(parsed.is_ok(), "{}: {}", module.name, parsed.unwrap_err().emit_to_string(&text));
    }
}

#[test]
fn needs_come_once_and_first() {
    // Both need frame and sym.
    for names in [["sggx", "aniso"], ["aniso", "sggx"]] {
        let text = with_needs(hlsl::MODULES, &names);
        let at = |name: &str| {
            let guard = format!("#define KINRAN_{name}_HLSL\n");
            assert_eq!(text.matches(&guard).count(), 1, "{name}");
            text.find(&guard).unwrap()
        };
        assert!(at("SYM") < at("SGGX") && at("FRAME") < at("SGGX") && at("SYM") < at("ANISO"));
        assert!(!text.contains("#include") && !text.contains("KINRAN_GGX_HLSL"), "{text}");
    }
    assert_eq!(with_needs(wgsl::MODULES, &[]), "");
}

#[test]
#[should_panic(expected = "no module velvet")]
fn an_unknown_module_is_named() {
    with_needs(wgsl::MODULES, &["velvet"]);
}

//! What `--help` says, of every command.

use std::process::Command;

/// The words that lead to each command, the program itself first.
fn paths(command: &clap::Command, path: &[String], all: &mut Vec<Vec<String>>) {
    all.push(path.to_vec());
    for inner in command.get_subcommands() {
        paths(inner, &[path, &[inner.get_name().to_owned()]].concat(), all);
    }
}

/// A command's help as a terminal of this width shows it.
fn help(path: &[String], flag: &str, width: usize) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_kinran"))
        .args(path)
        .arg(flag)
        .env("COLUMNS", width.to_string())
        .output()
        .unwrap();
    assert!(output.status.success(), "{path:?} {flag}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn help_can_be_read_at_any_width() {
    let mut all = Vec::new();
    paths(&kinran_cli::cli::command(), &[], &mut all);
    assert!(all.len() > 15, "only {} commands", all.len());
    // Without the window there is no help about it.
    all.retain(|path| cfg!(feature = "view") || path != &["view"]);
    for (path, flag) in all.iter().flat_map(|path| [(path, "-h"), (path, "--help")]) {
        for width in [80, 100] {
            let text = help(path, flag, width);
            for line in text.lines() {
                let length = line.chars().count();
                assert!(length <= width, "{path:?} {flag}: {length} characters, {width} fit: {line}");
            }
            for broken in ["[`", "`]", "](", "ChunkType", "Some(", "::", "{ ."] {
                assert!(!text.contains(broken), "{path:?} {flag}: {broken:?} stands in\n{text}");
            }
        }
    }
}

#[test]
fn examples_stand_in_help_line_by_line() {
    fn walk(command: &clap::Command, path: &[String]) {
        if let Some(after) = command.get_after_help() {
            let shown = help(path, "--help", 80);
            for line in after.to_string().lines().filter(|line| line.starts_with("  ")) {
                assert!(shown.lines().any(|l| l == line.trim_end()), "{path:?}: broken: {line}\n{shown}");
            }
        }
        command.get_subcommands().for_each(|c| walk(c, &[path, &[c.get_name().to_owned()]].concat()));
    }
    walk(&kinran_cli::cli::command(), &[]);
}

#[test]
fn flags_stand_under_the_heading_that_they_belong_to() {
    let sections = |path: &[&str]| -> Vec<(String, String)> {
        let path: Vec<String> = path.iter().map(|&word| word.into()).collect();
        let (mut heading, mut found) = (String::new(), Vec::new());
        for line in help(&path, "--help", 100).lines() {
            match line.strip_suffix(':').filter(|l| !l.starts_with(' ')) {
                Some(name) => name.clone_into(&mut heading),
                None => {
                    let flag = line.split_whitespace().find(|word| word.starts_with("--"));
                    let is_flag = line.trim_start().starts_with('-');
                    found.extend(flag.filter(|_| is_flag).map(|flag| (heading.clone(), flag.to_owned())));
                }
            }
        }
        found
    };
    for path in [&["bake"][..], &["render"], &["compare"], &["fuzz"], &["skin"]] {
        let found = sections(path);
        for (heading, flag) in &found {
            let of_skin = ["--skin", "--curvature", "--unit-mm", "--estimate-normals"];
            let wanted = of_skin.iter().any(|begin| flag.starts_with(begin));
            if heading.starts_with("Skin") {
                assert!(wanted, "{path:?}: {flag} stands under {heading}");
            }
            let everywhere = ["--threads", "--quiet", "--verbose", "--json"].contains(&flag.as_str());
            assert_eq!(everywhere, heading == "Of every command", "{path:?}: {flag} stands under {heading}");
        }
        assert!(found.iter().any(|(heading, _)| heading.starts_with("Skin")), "{path:?}: {found:?}");
    }
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("man");
    let said = crate::common::kinran(&["man", "-o", crate::common::text(&out)]);
    assert_eq!(said.code, Some(0), "{}", said.err);
    let pages = crate::common::files(&out);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = crate::common::kinran(&["completions", shell]);
        assert_eq!(script.code, Some(0), "{}", script.err);
        for command in kinran_cli::cli::command().get_subcommands() {
            let name = command.get_name();
            assert!(script.out.contains(name), "{shell}: {name} is missing");
            assert!(pages.contains(&format!("kinran-{name}.1")), "{name}: {pages:?}");
        }
        assert!(script.out.contains("dry-run"), "{shell}: no flags");
        // The others complete no values.
        let has_values = ["bash", "zsh", "fish"].contains(&shell);
        for filter in kinran_bake::aniso::Filter::ALL.into_iter().filter(|_| has_values) {
            let name = filter.name();
            assert!(script.out.contains(name), "{shell}: --filter has no {name}");
        }
    }
    let page = std::fs::read_to_string(out.join("kinran-detail-solve.1")).unwrap();
    assert!(page.contains("layer") && page.contains("kinran detail solve"), "{page}");
}

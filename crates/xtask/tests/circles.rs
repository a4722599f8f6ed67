//! No circle of files: of two files of a crate that name each other, neither can be read, tested or moved alone.
//!
//! A file names another by `use` or by a path that begins with `crate`, `super` or the name of a module beside it. Names that a
//! module passes on (`pub use`) count for the file they are defined in, and a module and the files in its folder count as one
//! another's own: between them there is no circle.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

type Module = Vec<String>;

/// Crates whose files are looked at.
const CRATES: [&str; 10] = [
    "kinran",
    "kinran-bake",
    "kinran-cli",
    "kinran-image",
    "kinran-render",
    "kinran-scene",
    "kinran-shaders",
    "kinran-shading",
    "kinran-uastc",
    "xtask",
];

/// A comparison and its sheet, which are still to be parted: the only name that is not looked at.
const STILL_THERE: (&str, [&str; 2]) = ("kinran-cli", ["compare", "compare_sheet"]);

#[test]
fn files_name_each_other_in_a_circle() {
    let crates = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    for name in CRATES {
        let mut files = BTreeMap::new();
        read_modules(&crates.join(name).join("src"), &[], &mut files);
        assert!(!files.is_empty(), "{name} has no files");
        let mut graph = names(&files);
        if name == STILL_THERE.0 {
            let [from, to] = STILL_THERE.1.map(module_of);
            assert!(
                graph.get_mut(&from).is_some_and(|named| named.remove(&to)),
                "it is parted; look at all names"
            );
        }
        let circle = circle(&graph);
        assert!(circle.is_empty(), "{name}: a circle of files: {}", circle.join(" -> "));
    }
}

#[test]
fn a_circle_is_overlooked() {
    let circle_of = |texts: &[(&str, &str)]| {
        let files = texts.iter().map(|(name, text)| (module_of(name), code_of(text))).collect();
        circle(&names(&files))
    };
    let plain = [
        ("", "mod a; mod b; pub use a::A;"),
        ("a", "pub struct A;"),
        ("b", "use crate::A; fn f() -> super::a::A { A }"),
    ];
    assert_eq!(circle_of(&plain), Vec::<String>::new());
    let passed_on = [
        ("", "mod a; mod b; pub use b::{B, other as O};"),
        ("a", "use crate::{\n    B,\n};"),
        ("b", "use crate::a::{self, A}; // crate::B"),
    ];
    assert_eq!(circle_of(&passed_on), ["a", "b", "a"]);
    let in_text =
        [("", "mod a; mod b;"), ("a", "fn f() { crate::b::g() }"), ("b", "fn g() { super::a::f() }")];
    assert_eq!(circle_of(&in_text), ["a", "b", "a"]);
    let by_child = [
        ("", "mod a; mod b;"),
        ("a", "mod c; use c::C;"),
        ("a/c", "use super::X; use crate::b::B;"),
        ("b", "use crate::a::c::C;"),
    ];
    assert_eq!(circle_of(&by_child), ["a/c", "b", "a/c"]);
}

fn module_of(path: &str) -> Module {
    path.split('/').filter(|part| !part.is_empty()).map(String::from).collect()
}

/// Code by module.
fn read_modules(folder: &Path, within: &[String], files: &mut BTreeMap<Module, String>) {
    for entry in fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
        let mut module = within.to_vec();
        if path.is_dir() {
            module.push(stem);
            read_modules(&path, &module, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") && stem != "main" {
            if stem != "lib" && stem != "mod" {
                module.push(stem);
            }
            files.insert(module, code_of(&fs::read_to_string(&path).unwrap()));
        }
    }
}

/// Without comments, texts in quotes and tests, which end a file.
fn code_of(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod ").next().unwrap();
    let mut kept = String::new();
    for line in text.lines() {
        let code = line.split("//").next().unwrap();
        // Every other piece stands in quotes.
        kept.extend(code.split('"').step_by(2));
        kept.push('\n');
    }
    kept
}

/// For each module the other ones that it names.
fn names(files: &BTreeMap<Module, String>) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut passed_on = BTreeMap::new();
    let mut named: Vec<(Module, Module)> = Vec::new();
    for (module, text) in files {
        let mut rest = String::new();
        for statement in text.split_inclusive(';') {
            let is_use = |before: &str| before.is_empty() || before.ends_with([' ', '\n', '{']);
            let Some((before, tree)) = statement.split_once("use ").filter(|(before, _)| is_use(before))
            else {
                rest.push_str(statement);
                continue;
            };
            rest.push_str(before);
            for (path, called) in paths(tree.trim_end_matches(';')) {
                let Some(path) = from_root(module, &path, files) else { continue };
                let name = [&module[..], &[called]].concat();
                if name != path {
                    passed_on.insert(name, path.clone());
                }
                named.push((module.clone(), path));
            }
        }
        for word in rest.split(|c: char| !(c.is_alphanumeric() || c == '_' || c == ':')) {
            let path: Module = word.split("::").map(String::from).collect();
            if path.len() > 1
                && let Some(path) = from_root(module, &path, files)
            {
                named.push((module.clone(), path));
            }
        }
    }

    let mut graph: BTreeMap<Module, BTreeSet<Module>> = BTreeMap::new();
    for (module, path) in named {
        let home = home(&path, files, &passed_on);
        if !home.starts_with(&module) && !module.starts_with(&home) {
            graph.entry(module).or_default().insert(home);
        }
    }
    graph
}

/// The paths of a `use`, each with the name it has from then on.
fn paths(tree: &str) -> Vec<(Module, String)> {
    let tree = tree.trim();
    let Some((stem, list)) = tree.split_once('{') else {
        let (path, called) = tree.split_once(" as ").unwrap_or((tree, ""));
        let mut path: Module = path.split("::").map(|part| part.trim().to_owned()).collect();
        if path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let last = path.last().cloned().unwrap_or_default();
        return vec![(path, if called.is_empty() { last } else { called.trim().to_owned() })];
    };
    let list = list.trim_end().strip_suffix('}').unwrap_or(list);
    let (mut depth, mut start, mut all) = (0, 0, Vec::new());
    for (i, c) in list.char_indices().chain([(list.len(), ',')]) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let item = list[start..i].trim();
                if !item.is_empty() {
                    all.extend(paths(&format!("{stem}{item}")));
                }
                start = i + 1;
            }
            _ => {}
        }
    }
    all
}

/// A path from the crate's root; `None` where it leads out of the crate.
fn from_root(module: &[String], path: &[String], files: &BTreeMap<Module, String>) -> Option<Module> {
    let up = path.iter().take_while(|part| *part == "super").count();
    let (base, rest) = match path.first()?.as_str() {
        "crate" => (&[][..], &path[1..]),
        "self" => (module, &path[1..]),
        "super" => (&module[..module.len().checked_sub(up)?], &path[up..]),
        first => {
            let beside = [module, &[first.to_owned()]].concat();
            files.contains_key(&beside).then_some((module, path))?
        }
    };
    Some([base, rest].concat())
}

/// The file in which a name is defined.
fn home(path: &[String], files: &BTreeMap<Module, String>, passed_on: &BTreeMap<Module, Module>) -> Module {
    let mut path = path.to_vec();
    // Names that are passed on without end do not compile.
    for _ in 0..16 {
        if files.contains_key(&path) {
            return path;
        }
        let deepest = (0..path.len()).rev().find(|&n| files.contains_key(&path[..n])).unwrap_or(0);
        match passed_on.get(&path[..=deepest]) {
            Some(to) => path = [to, &path[deepest + 1..]].concat(),
            None => return path[..deepest].to_vec(),
        }
    }
    panic!("{path:?} is passed on without end");
}

/// One circle, its first file again at its end; empty where there is none.
fn circle(graph: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<String> {
    let mut done = BTreeSet::new();
    graph.keys().find_map(|module| walk(module, graph, &mut Vec::new(), &mut done)).unwrap_or_default()
}

fn walk<'a>(
    at: &'a Module,
    graph: &'a BTreeMap<Module, BTreeSet<Module>>,
    way: &mut Vec<&'a Module>,
    done: &mut BTreeSet<&'a Module>,
) -> Option<Vec<String>> {
    if let Some(start) = way.iter().position(|module| *module == at) {
        return Some(way[start..].iter().copied().chain([at]).map(|module| module.join("/")).collect());
    }
    if !done.insert(at) {
        return None;
    }
    way.push(at);
    let found = graph.get(at).into_iter().flatten().find_map(|to| walk(to, graph, way, done));
    way.pop();
    found
}

//! The WESL modules, taken apart into declarations with their comments.

use std::path::Path;

use crate::Error;

/// A module of the library.
pub(crate) struct Module {
    /// Its name, the file's.
    pub(crate) name: String,
    /// The whole text.
    pub(crate) text: String,
    /// The licence: the first block of comments, with its slashes.
    pub(crate) licence: String,
    /// What the module is about: the comments after the licence, with their slashes.
    pub(crate) about: String,
    /// Modules whose declarations it uses, in the order of its imports.
    pub(crate) needs: Vec<String>,
    /// Functions, constants and structs, in order.
    pub(crate) declarations: Vec<Declaration>,
}

/// A function, constant or struct.
pub(crate) struct Declaration {
    /// Its name, the same in every language.
    pub(crate) name: String,
    /// Its comment, with slashes, each line ended.
    pub(crate) doc: String,
    /// The declaration itself, each line ended.
    pub(crate) text: String,
}

/// Reads all modules of a folder, each after those it needs, else by name.
pub(crate) fn read_modules(folder: &Path) -> Result<Vec<Module>, Error> {
    let mut waiting = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "wesl") {
            let name = path.file_stem().and_then(|stem| stem.to_str()).ok_or("a file name is no UTF-8")?;
            let module = parse(name, &std::fs::read_to_string(&path)?);
            waiting.push(module.map_err(|e| format!("{}: {e}", path.display()))?);
        }
    }
    waiting.sort_by(|a, b| a.name.cmp(&b.name));

    let mut sorted: Vec<Module> = Vec::new();
    while !waiting.is_empty() {
        let is_ready = |m: &Module| m.needs.iter().all(|need| sorted.iter().any(|s| s.name == *need));
        let Some(ready) = waiting.iter().position(is_ready) else {
            let names: Vec<_> = waiting.iter().map(|m| m.name.as_str()).collect();
            return Err(
                format!("modules need each other, or one that is not there: {}", names.join(", ")).into()
            );
        };
        sorted.push(waiting.remove(ready));
    }
    check_names(&sorted)?;
    Ok(sorted)
}

/// Names must live side by side in one scope.
fn check_names(modules: &[Module]) -> Result<(), Error> {
    let mut seen = std::collections::BTreeSet::new();
    match modules.iter().flat_map(|m| &m.declarations).find(|d| !seen.insert(&d.name)) {
        Some(twice) => Err(format!("{} is declared twice", twice.name).into()),
        None => Ok(()),
    }
}

/// The name that a declaration's first line gives, and what ends the declaration.
fn declared(line: &str) -> Option<(&str, &'static str)> {
    let (keyword, rest) = line.split_once(' ')?;
    let end = match keyword {
        "fn" | "struct" => "\n}\n",
        "const" => ";\n",
        _ => return None,
    };
    Some((words(rest).next()?, end))
}

fn parse(name: &str, text: &str) -> Result<Module, Error> {
    let (licence, rest) = text.split_once("\n\n").ok_or("there is nothing after the licence")?;
    if !licence.lines().all(|line| line.starts_with("//")) || !licence.contains("SPDX-License-Identifier: ") {
        return Err("there is no licence on top".into());
    }
    let mut module = Module {
        name: name.to_owned(),
        text: text.to_owned(),
        licence: format!("{licence}\n"),
        about: String::new(),
        needs: Vec::new(),
        declarations: Vec::new(),
    };
    let mut imported = Vec::new();
    let mut doc = String::new();
    let mut lines = rest.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("///") {
            doc += &format!("{line}\n");
        } else if let Some((declaration, end)) = declared(line) {
            if doc.is_empty() {
                return Err(format!("{declaration} has no comment above it").into());
            }
            let mut body = format!("{line}\n");
            while !body.ends_with(end) {
                let line = lines.next().ok_or_else(|| format!("{declaration} has no end"))?;
                body += &format!("{line}\n");
            }
            let doc = std::mem::take(&mut doc);
            module.declarations.push(Declaration { name: declaration.to_owned(), doc, text: body });
        } else if !doc.is_empty() {
            return Err(format!("a comment belongs to no declaration: {doc}").into());
        } else if let Some(import) = line.strip_prefix("import package::") {
            let mut import = import.to_owned();
            while !import.ends_with(';') {
                import += lines.next().ok_or("an import has no end")?.trim();
            }
            let (from, items) =
                import.trim_end_matches(';').split_once("::").ok_or("an import names no item")?;
            if !module.needs.iter().any(|need| need == from) {
                module.needs.push(from.to_owned());
            }
            imported.extend(words(items).map(str::to_owned));
        } else if line.starts_with("//") {
            module.about += &format!("{line}\n");
        } else if !line.is_empty() {
            return Err(format!("this line is no comment, import or declaration: {line}").into());
        }
    }
    for item in &imported {
        if !module.declarations.iter().any(|d| words(&d.text).any(|word| word == item)) {
            return Err(format!("{item} is imported and not used").into());
        }
    }
    Ok(module)
}

/// The identifiers and numbers of a text.
pub(crate) fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

//! The WESL modules, taken apart into declarations with their comments.

use std::path::Path;

use crate::Error;

/// A module of the library.
pub struct Module {
    /// Its name, the file's.
    pub name: String,
    /// The whole text.
    pub text: String,
    /// The licence: the first block of comments, with its slashes.
    pub licence: String,
    /// What the module is about: the comments after the licence, with their slashes.
    pub about: String,
    /// Modules whose declarations it uses, in the order of its imports.
    pub needs: Vec<String>,
    /// Functions, constants and structs, in order.
    pub declarations: Vec<Declaration>,
}

/// A function, constant or struct.
pub struct Declaration {
    /// Its keyword.
    pub kind: Kind,
    /// Its name, the same in every language.
    pub name: String,
    /// Its comment, with slashes, each line ended.
    pub doc: String,
    /// The declaration itself, each line ended.
    pub text: String,
}

/// What is declared.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `fn`
    Function,
    /// `const`
    Constant,
    /// `struct`
    Struct,
}

/// Reads all modules of a folder, each after those it needs, else by name.
pub fn read_modules(folder: &Path) -> Result<Vec<Module>, Error> {
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
            return Err(format!("modules need each other, or one that is not there: {}", names.join(", ")).into());
        };
        sorted.push(waiting.remove(ready));
    }
    check_names(&sorted)?;
    Ok(sorted)
}

/// Public names must live side by side in one scope, and survive naga, which appends `_` to a final digit.
fn check_names(modules: &[Module]) -> Result<(), Error> {
    let mut seen = std::collections::BTreeSet::new();
    for declaration in modules.iter().flat_map(|m| &m.declarations) {
        if !seen.insert(&declaration.name) {
            return Err(format!("{} is declared twice", declaration.name).into());
        }
        if declaration.name.ends_with(|c: char| c.is_ascii_digit()) {
            return Err(format!("{} ends in a digit, which would change it in GLSL and HLSL", declaration.name).into());
        }
    }
    Ok(())
}

/// The name that a declaration's first line gives, and what it declares.
fn declared(line: &str) -> Option<(Kind, &str)> {
    let (keyword, rest) = line.split_once(' ')?;
    let kind = match keyword {
        "fn" => Kind::Function,
        "const" => Kind::Constant,
        "struct" => Kind::Struct,
        _ => return None,
    };
    Some((kind, rest.split(|c: char| !c.is_alphanumeric() && c != '_').next()?))
}

fn parse(name: &str, text: &str) -> Result<Module, Error> {
    let mut module = Module {
        name: name.to_owned(),
        text: text.to_owned(),
        licence: String::new(),
        about: String::new(),
        needs: Vec::new(),
        declarations: Vec::new(),
    };
    let mut imported = Vec::new();
    let mut doc = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.is_empty() {
            // A blank line ends the licence; between paragraphs about the module it stays one.
            module.licence.is_empty().then_some(()).map_or(Ok(()), |()| Err("no licence on top"))?;
            if !doc.is_empty() {
                return Err(format!("a comment belongs to no declaration: {doc}").into());
            }
        } else if line.starts_with("///") {
            doc += &format!("{line}\n");
        } else if line.starts_with("//") {
            let licence_goes_on = module.about.is_empty() && !text.split("\n\n").next().is_some_and(|first| {
                module.licence.lines().count() >= first.lines().count()
            });
            if licence_goes_on {
                module.licence += &format!("{line}\n");
            } else {
                module.about += &format!("{line}\n");
            }
        } else if let Some(import) = line.strip_prefix("import package::") {
            let mut import = import.to_owned();
            while !import.ends_with(';') {
                import += lines.next().ok_or("an import has no end")?.trim();
            }
            let (from, items) = import.trim_end_matches(';').split_once("::").ok_or("an import names no item")?;
            if !module.needs.iter().any(|need| need == from) {
                module.needs.push(from.to_owned());
            }
            let items = items.trim_start_matches('{').trim_end_matches('}');
            imported.extend(items.split(',').map(|item| item.trim().to_owned()).filter(|item| !item.is_empty()));
        } else if let Some((kind, declaration)) = declared(line) {
            let end = if kind == Kind::Constant { ";" } else { "}" };
            let mut body = format!("{line}\n");
            while !body.trim_end().ends_with(end) || (kind != Kind::Constant && !body.ends_with("\n}\n")) {
                body += &format!("{}\n", lines.next().ok_or(format!("{declaration} has no end"))?);
            }
            if doc.is_empty() {
                return Err(format!("{declaration} has no comment above it").into());
            }
            let doc = std::mem::take(&mut doc);
            module.declarations.push(Declaration { kind, name: declaration.to_owned(), doc, text: body });
        } else {
            return Err(format!("what is this line? {line}").into());
        }
    }
    if module.licence.is_empty() || !module.licence.contains("SPDX-License-Identifier: ") {
        return Err("there is no licence on top".into());
    }
    for item in &imported {
        if !module.declarations.iter().any(|d| words(&d.text).any(|word| word == item)) {
            return Err(format!("{item} is imported and not used").into());
        }
    }
    Ok(module)
}

/// The identifiers and numbers of a text.
pub fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

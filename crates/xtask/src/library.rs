//! The WESL sources: modules, what they need, and the comment of each declaration.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use wesl::{CompileResult, Wesl};

use crate::shaders::Error;

/// A module of the library.
pub struct Module {
    /// Its name, which is its file's.
    pub name: String,
    /// Its text without imports: plain WGSL.
    pub text: String,
    /// Licence lines and what the module is about: comments on top of the file.
    pub header: String,
    /// The modules it imports from, sorted.
    pub needs: Vec<String>,
    /// The doc comment of each declaration, by name; lines without their slashes.
    pub docs: BTreeMap<String, Vec<String>>,
}

/// The name that a line declares at the top level: a function, constant or structure.
fn declared(line: &str) -> Option<&str> {
    let rest = ["fn ", "const ", "struct "].iter().find_map(|keyword| line.strip_prefix(keyword))?;
    rest.split(|c: char| !(c.is_alphanumeric() || c == '_')).next()
}

impl Module {
    fn parse(name: &str, source: &str) -> Self {
        let mut module = Self {
            name: name.to_owned(),
            text: String::new(),
            header: source.lines().take_while(|line| line.starts_with("//") || line.is_empty()).collect::<Vec<_>>().join("\n"),
            needs: Vec::new(),
            docs: BTreeMap::new(),
        };
        // The header ends where the first declaration's own comment begins.
        if let Some(end) = module.header.find("\n///") {
            module.header.truncate(end);
        }
        module.header = module.header.trim_end().to_owned();

        let mut doc = Vec::new();
        for line in source.lines() {
            if let Some(path) = line.strip_prefix("import package::") {
                module.needs.extend(path.split("::").next().map(str::to_owned));
                continue;
            }
            match line.strip_prefix("///") {
                Some(rest) => doc.push(rest.strip_prefix(' ').unwrap_or(rest).to_owned()),
                None => {
                    if let Some(name) = declared(line) {
                        module.docs.insert(name.to_owned(), std::mem::take(&mut doc));
                    }
                    doc.clear();
                }
            }
            module.text += line;
            module.text.push('\n');
        }
        module.needs.sort();
        module.needs.dedup();
        // The imports leave a gap of two empty lines.
        while module.text.contains("\n\n\n") {
            module.text = module.text.replace("\n\n\n", "\n\n");
        }
        module
    }
}

/// All modules in a folder, each after those it needs, otherwise by name.
pub fn read(folder: &Path) -> Result<Vec<Module>, Error> {
    let mut waiting = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(|e| Error::Read(folder.into(), e))? {
        let path = entry.map_err(|e| Error::Read(folder.into(), e))?.path();
        if path.extension().is_some_and(|extension| extension == "wesl") {
            let source = std::fs::read_to_string(&path).map_err(|e| Error::Read(path.clone(), e))?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            waiting.insert(name.clone(), Module::parse(&name, &source));
        }
    }
    let mut modules: Vec<Module> = Vec::new();
    while !waiting.is_empty() {
        let there: BTreeSet<&str> = modules.iter().map(|m| m.name.as_str()).collect();
        let ready = |m: &&Module| m.needs.iter().all(|need| there.contains(need.as_str()));
        let next = waiting.values().find(ready).map(|m| m.name.clone());
        let next = next.ok_or_else(|| Error::Circle(waiting.keys().cloned().collect()))?;
        modules.extend(waiting.remove(&next));
    }
    check_imports(folder, &modules)?;
    Ok(modules)
}

/// Has the WESL compiler resolve every module by itself: each name that a module uses must be its own or imported,
/// and each import must exist.
fn check_imports(folder: &Path, modules: &[Module]) -> Result<(), Error> {
    let mut compiler = Wesl::new(folder);
    compiler.use_stripping(false).set_mangler(wesl::ManglerKind::None);
    for module in modules {
        let path = format!("package::{}", module.name).parse().map_err(|e| Error::Wesl(format!("{e}")))?;
        let compiled: CompileResult = compiler.compile(&path).map_err(|e| Error::Wesl(e.to_string()))?;
        let text = compiled.to_string();
        naga::front::wgsl::parse_str(&text).map_err(|e| Error::Naga(e.emit_to_string(&text)))?;
    }
    Ok(())
}

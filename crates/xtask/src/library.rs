//! The files of the library: a folder per language, and the crate's constants.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use kinran_image::write_atomically;

use crate::languages::{LANGUAGES, Language};
use crate::source::{Declaration, Module, read_modules, words};
use crate::split::{Chunk, split, unnumber};
use crate::{Error, flat, spirv};

/// Files and what shall be in them.
pub(crate) struct Files {
    root: PathBuf,
    /// Folders that hold no other files, except README.md.
    folders: Vec<PathBuf>,
    contents: BTreeMap<PathBuf, Vec<u8>>,
}

/// Makes everything that is derived from crates/kinran-shaders/src/*.wesl.
pub(crate) fn make(root: &Path) -> Result<Files, Error> {
    let home = PathBuf::from("crates/kinran-shaders");
    let modules = read_modules(&root.join(&home).join("src"))?;
    let flat = flat::flatten(&modules)?;
    let (naga_module, info) = flat::validate(&flat)?;
    let costs = Costs::read(&root.join("tools/shader_cost/budget.json"))?;

    let mut folders = vec![home.join("wgsl"), home.join("spirv")];
    let mut contents = BTreeMap::new();
    put_language(&mut contents, &home.join("wgsl"), "wgsl", &modules, |m| wgsl_text(m, &costs))?;
    for language in &LANGUAGES {
        let translated = restore_names(&modules, (language.translate)(&flat)?)?;
        let mut chunks = split(&translated)?;
        unnumber(&mut chunks);
        check_names(language, &modules, &chunks)?;
        folders.push(home.join(language.folder));
        put_language(&mut contents, &home.join(language.folder), language.extension, &modules, |module| {
            translated_text(language, &modules, module, &chunks, &costs)
        })?;
    }
    contents.insert(home.join("spirv/kinran.spv"), spirv::write(&naga_module, &info)?);
    contents.insert(home.join("src/texts.rs"), texts_rs(&modules).into_bytes());

    // What is shipped must stand by itself, not only what it was made of.
    flat::validate(std::str::from_utf8(&contents[&home.join("wgsl/kinran.wgsl")])?)?;
    Ok(Files { root: root.to_path_buf(), folders, contents })
}

impl Files {
    /// Writes what differs, and removes what is left over.
    pub(crate) fn write(&self) -> Result<String, Error> {
        let (differing, left_over) = self.differences()?;
        for path in &differing {
            std::fs::create_dir_all(self.root.join(path).parent().ok_or("a file without a folder")?)?;
            write_atomically(&self.root.join(path), &self.contents[*path])?;
        }
        for path in &left_over {
            std::fs::remove_file(self.root.join(path))?;
        }
        let (all, written, removed) = (self.contents.len(), differing.len(), left_over.len());
        Ok(format!("{all} files of the shader library: {written} written, {removed} removed"))
    }

    /// Fails where a file is not as it would be written.
    pub(crate) fn check(&self) -> Result<String, Error> {
        let (differing, left_over) = self.differences()?;
        let names: Vec<_> =
            differing.into_iter().chain(&left_over).map(|path| path.display().to_string()).collect();
        if names.is_empty() {
            return Ok(format!(
                "{} files of the shader library are as their sources say",
                self.contents.len()
            ));
        }
        Err(format!("not what its source says (run ./x shaders and commit): {}", names.join(", ")).into())
    }

    fn differences(&self) -> Result<(Vec<&PathBuf>, Vec<PathBuf>), Error> {
        let is_as_wanted = |path: &PathBuf, bytes: &Vec<u8>| {
            std::fs::read(self.root.join(path)).is_ok_and(|committed| committed == *bytes)
        };
        let differing = self.contents.iter().filter(|(p, b)| !is_as_wanted(p, b)).map(|(p, _)| p).collect();
        let mut left_over = Vec::new();
        for folder in self.folders.iter().filter(|folder| self.root.join(folder).is_dir()) {
            for entry in std::fs::read_dir(self.root.join(folder))? {
                let path = folder.join(entry?.file_name());
                if !path.ends_with("README.md") && !self.contents.contains_key(&path) {
                    left_over.push(path);
                }
            }
        }
        left_over.sort();
        Ok((differing, left_over))
    }
}

/// What functions cost, as last measured.
struct Costs(BTreeMap<String, String>);

impl Costs {
    fn read(path: &Path) -> Result<Self, Error> {
        if !path.exists() {
            return Ok(Costs(BTreeMap::new()));
        }
        let budget: serde_json::Value = serde_json::from_slice(&std::fs::read(path)?)?;
        let functions = budget["functions"].as_object().ok_or("the budget has no functions")?;
        let line = |cost: &serde_json::Value| {
            let (all, slow) = (&cost["instructions"], &cost["quarter_rate"]);
            let slow = if slow == 0 { String::new() } else { format!(" ({slow} at a quarter of the rate)") };
            let instructions = if all == 1 { "instruction" } else { "instructions" };
            let one_round = if cost["loops"] == true { ", one round of its loop" } else { "" };
            format!("/// Cost on GCN: {all} {instructions}{slow}{one_round}.\n")
        };
        Ok(Costs(functions.iter().map(|(name, cost)| (name.clone(), line(cost))).collect()))
    }

    /// The comment above a declaration: the source's, and what was measured.
    fn header(&self, declaration: &Declaration) -> String {
        let cost = self.0.get(&declaration.name).map(String::as_str).unwrap_or_default();
        let gap = if cost.is_empty() { "" } else { "///\n" };
        format!("{}{gap}{cost}", declaration.doc)
    }
}

/// A file per module, and one of all.
fn put_language(
    contents: &mut BTreeMap<PathBuf, Vec<u8>>,
    folder: &Path,
    extension: &str,
    modules: &[Module],
    text_of: impl Fn(&Module) -> Result<String, Error>,
) -> Result<(), Error> {
    let mut all = String::new();
    for module in modules {
        let text = text_of(module)?;
        all += text
            .lines()
            .filter(|line| !line.starts_with("#include \""))
            .map(|line| format!("{line}\n"))
            .collect::<String>()
            .as_str();
        all += "\n";
        contents.insert(folder.join(format!("{}.{extension}", module.name)), text.into_bytes());
    }
    all.pop();
    contents.insert(folder.join(format!("kinran.{extension}")), all.into_bytes());
    Ok(())
}

/// The comments on top of a file.
fn head(module: &Module) -> String {
    let Module { name, licence, about, needs, .. } = module;
    let needs = if needs.is_empty() { "nothing else".to_owned() } else { needs.join(", ") };
    format!("{licence}// Made from src/{name}.wesl, by ./x shaders. Needs: {needs}\n\n{about}")
}

fn wgsl_text(module: &Module, costs: &Costs) -> Result<String, Error> {
    let mut text = head(module);
    for declaration in &module.declarations {
        text += &format!("\n{}{}", costs.header(declaration), declaration.text);
    }
    Ok(text)
}

fn translated_text(
    language: &Language,
    modules: &[Module],
    module: &Module,
    chunks: &[Chunk],
    costs: &Costs,
) -> Result<String, Error> {
    let extension = language.extension;
    let guard = |name: &str| {
        format!("KINRAN_{}_{}", name.trim_end_matches('_').to_uppercase(), language.guard_suffix)
    };
    let mut text = head(module);
    text += &format!("\n#ifndef {0}\n#define {0}\n", guard(&module.name));
    if !language.preamble.is_empty() {
        text += &format!("\n{}", language.preamble);
    }
    if language.includes && !module.needs.is_empty() {
        text += "\n";
        text.extend(module.needs.iter().map(|need| format!("#include \"{need}.{extension}\"\n")));
    }
    let helpers = helpers(modules, module, chunks);
    for chunk in chunks {
        let is_function = chunk.text.lines().any(|line| line.starts_with(')') || line.ends_with(") {"));
        let body =
            if is_function { format!("{}{}", language.linkage, chunk.text) } else { chunk.text.clone() };
        if let Some(declaration) = module.declarations.iter().find(|d| d.name == chunk.name) {
            text += &format!("\n{}{body}", costs.header(declaration));
        } else if helpers.contains(chunk.name.as_str()) {
            // Another module may need it too.
            text += &format!("\n#ifndef {0}\n#define {0}\n{body}#endif\n", guard(&chunk.name));
        }
    }
    text += "\n#endif\n";
    Ok(text)
}

/// Declarations that naga added for what the module declares: constructors, array types.
fn helpers<'a>(modules: &[Module], module: &Module, chunks: &'a [Chunk]) -> BTreeSet<&'a str> {
    let mut wanted: BTreeSet<&str> = module.declarations.iter().map(|d| d.name.as_str()).collect();
    let is_ours = |name: &str| modules.iter().flat_map(|m| &m.declarations).any(|d| d.name == name);
    let mut helpers = BTreeSet::new();
    // Uses come after what they use.
    for chunk in chunks.iter().rev() {
        if !wanted.contains(chunk.name.as_str()) {
            continue;
        }
        wanted.extend(words(&chunk.text).filter(|word| !is_ours(word)));
        if !is_ours(&chunk.name) {
            helpers.insert(chunk.name.as_str());
        }
    }
    helpers
}

/// naga appends `_` to a name that ends in a digit, to number others of that name; there are none.
fn restore_names(modules: &[Module], mut translated: String) -> Result<String, Error> {
    for Declaration { name, .. } in modules.iter().flat_map(|m| &m.declarations) {
        if name.ends_with(|c: char| c.is_ascii_digit()) {
            if words(&translated).any(|word| word == name) {
                return Err(format!("{name} is taken").into());
            }
            let renamed = format!("{name}_(");
            translated = translated.replace(&renamed, &format!("{name}("));
        }
    }
    Ok(translated)
}

/// Every declaration must be there under its own name.
fn check_names(language: &Language, modules: &[Module], chunks: &[Chunk]) -> Result<(), Error> {
    for declaration in modules.iter().flat_map(|m| &m.declarations) {
        if !chunks.iter().any(|chunk| chunk.name == declaration.name) {
            return Err(
                format!("{} is not there in {} under its name", declaration.name, language.name).into()
            );
        }
    }
    Ok(())
}

/// The crate's constants: a Rust module per language.
fn texts_rs(modules: &[Module]) -> String {
    let mut text = "//! The texts. Written by ./x shaders.\n".to_owned();
    let wgsl = [("wesl", "WESL, the sources", "src", "wesl"), ("wgsl", "WGSL", "wgsl", "wgsl")];
    let others = LANGUAGES.iter().map(|l| (l.folder, l.name, l.folder, l.extension));
    for (language, name, folder, extension) in wgsl.into_iter().chain(others) {
        text += &format!("\n/// {name}.\npub mod {language} {{\n    use crate::Module;\n");
        text += &format!(
            "\n    /// How to include it.\n    pub const README: &str = include_str!(\"../{folder}/README.md\");\n"
        );
        for module in modules {
            let (lower, upper) = (&module.name, module.name.to_uppercase());
            text += &format!(
                "\n    /// The module `{lower}`.\n    pub const {upper}: &str = include_str!(\"../{folder}/{lower}.{extension}\");\n"
            );
        }
        if language != "wesl" {
            text += &format!(
                "\n    /// All modules in one text.\n    pub const ALL: &str = include_str!(\"../{folder}/kinran.{extension}\");\n"
            );
        }
        text += "\n    /// The modules, each after those it needs.\n    pub const MODULES: &[Module] = &[\n";
        for module in modules {
            let needs: Vec<_> = module.needs.iter().map(|need| format!("\"{need}\"")).collect();
            text += &format!(
                "        Module {{ name: \"{}\", text: {}, needs: &[{}] }},\n",
                module.name,
                module.name.to_uppercase(),
                needs.join(", ")
            );
        }
        text += "    ];\n}\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two runs, since a resolver that hashes would give each its own order.
    #[test]
    fn committed_translations_are_what_their_sources_say() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for _ in 0..2 {
            make(&root).and_then(|files| files.check()).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

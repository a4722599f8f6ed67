//! `kinran shaders`: the shader library as files.

use std::path::{Path, PathBuf};

use clap::ValueEnum;
use kinran_image::write_atomically;
use kinran_shaders::{Module, SPIRV, glsl_450, glsl_es_300, hlsl, msl, wesl, wgsl, with_needs};
use schemars::JsonSchema;
use serde::Serialize;

use crate::table::list;
use crate::values::counted;
use crate::{Console, Error, outputs};

/// Writes the shader library in a language, or prints a module of it
///
/// The formulas as functions that need no bindings: GGX, SGGX, the aniso texel and its decode, LEAN, spherical
/// harmonics. Every file has its licence (MIT or Apache-2.0) on top, every function its source, its range and
/// its cost above it.
///
/// The folder then holds a file for each module, kinran.* with all of them in one, and README.md, which tells
/// how to include them in which engine.
#[derive(Debug, clap::Args)]
#[command(
    arg_required_else_help = true,
    after_help = "Examples:
  kinran shaders --list
  kinran shaders --lang hlsl -o shaders/
  kinran shaders --lang glsl-es-300 --module aniso > aniso.glsl"
)]
pub struct Args {
    /// The language
    #[arg(long, value_enum, value_name = "LANGUAGE", required_unless_present = "list")]
    pub lang: Option<Language>,

    /// The folder for the files
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Overwrites files whose content is another: that of another version, or what somebody wrote
    #[arg(long)]
    pub force: bool,

    /// This module, or those of this name's group such as fuzz or skin, and those they need, and no others; without
    /// --output they are printed
    #[arg(long, value_name = "NAME")]
    pub module: Option<String>,

    /// Tells the modules, what each needs, and its functions
    #[arg(long, conflicts_with_all = ["lang", "output", "module"])]
    pub list: bool,
}

/// A language that the library comes in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Language {
    /// WebGPU.
    Wgsl,
    /// OpenGL 4.5 and Vulkan.
    #[value(name = "glsl-450")]
    #[serde(rename = "glsl-450")]
    Glsl450,
    /// OpenGL ES 3 and WebGL 2.
    #[value(name = "glsl-es-300", aliases = ["glsl-es", "essl"])]
    #[serde(rename = "glsl-es-300")]
    GlslEs300,
    /// Direct3D, Unity, Unreal.
    Hlsl,
    /// Metal.
    Msl,
    /// One module to link; its functions are exported by name.
    Spirv,
    /// The sources: WGSL with imports.
    Wesl,
}

impl Language {
    /// Its modules, the text of all in one, the page about it, and its extension; SPIR-V has no texts.
    fn texts(self) -> (&'static [Module], Option<&'static str>, &'static str, &'static str) {
        match self {
            Language::Wgsl => (wgsl::MODULES, Some(wgsl::ALL), wgsl::README, "wgsl"),
            Language::Glsl450 => (glsl_450::MODULES, Some(glsl_450::ALL), glsl_450::README, "glsl"),
            Language::GlslEs300 => {
                (glsl_es_300::MODULES, Some(glsl_es_300::ALL), glsl_es_300::README, "glsl")
            }
            Language::Hlsl => (hlsl::MODULES, Some(hlsl::ALL), hlsl::README, "hlsl"),
            Language::Msl => (msl::MODULES, Some(msl::ALL), msl::README, "h"),
            Language::Spirv => (&[], None, kinran_shaders::SPIRV_README, "spv"),
            Language::Wesl => (wesl::MODULES, None, wesl::README, "wesl"),
        }
    }
}

/// A module, for programs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct ModuleReport {
    /// Its name.
    pub name: &'static str,
    /// Modules that it uses directly.
    pub needs: &'static [&'static str],
    /// Its functions.
    pub functions: Vec<&'static str>,
}

/// What was written, or is to be printed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Report {
    /// In which language; `null` of a list.
    pub language: Option<Language>,
    /// Files in the folder.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub files: Vec<String>,
    /// The text, where there is no folder.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// The modules, where a list was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub modules: Vec<ModuleReport>,
}

/// The command.
///
/// # Errors
/// One that names the flag or the file: a module that is not there, SPIR-V without a folder, a folder that cannot be
/// written.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let Some(language) = args.lang else {
        let modules = modules();
        let cells = |m: &ModuleReport| vec![m.name.to_owned(), m.needs.join(", "), m.functions.join(", ")];
        let header = ["module", "needs", "functions"].map(str::to_owned).to_vec();
        let rows: Vec<_> = std::iter::once(header).chain(modules.iter().map(cells)).collect();
        let report = Report { language: None, files: Vec::new(), text: None, modules };
        return console.result(&report, &list(&rows));
    };
    let chosen = chosen(language, args.module.as_deref())?;
    let Some(folder) = &args.output else {
        let text = text(language, args.module.as_deref(), &chosen)?;
        let report = Report {
            language: Some(language),
            files: Vec::new(),
            text: Some(text.clone()),
            modules: Vec::new(),
        };
        // The text is what was asked for, not a summary of it.
        return Console { quiet: false, ..console.clone() }.result(&report, &text);
    };
    outputs::check_folder(folder)?;
    let files = write(language, args.module.is_none(), &chosen, folder, args.force)?;
    let summary = format!("{} in {}", counted(files.len(), "file", "files"), folder.display());
    console.result(&Report { language: Some(language), files, text: None, modules: Vec::new() }, &summary)
}

/// The modules of the library.
pub fn modules() -> Vec<ModuleReport> {
    let functions = |text: &'static str| {
        text.lines().filter_map(|line| line.strip_prefix("fn ")?.split('(').next()).collect()
    };
    let report = |m: &Module| ModuleReport { name: m.name, needs: m.needs, functions: functions(m.text) };
    wgsl::MODULES.iter().map(report).collect()
}

/// The modules asked for, each after those it needs.
fn chosen(language: Language, name: Option<&str>) -> Result<Vec<Module>, Error> {
    let (modules, ..) = language.texts();
    let Some(name) = name else { return Ok(modules.to_vec()) };
    if language == Language::Spirv {
        return Err(Error::flag_error(
            format!("--module {name}"),
            "SPIR-V comes as one module; leave the flag out",
        ));
    }
    let mut wanted = named(modules, name);
    if wanted.is_empty() {
        let names: Vec<_> = modules.iter().map(|module| module.name).collect();
        return Err(Error::flag_error(
            format!("--module {name}"),
            format!("choose one of {}", names.join(", ")),
        ));
    }
    for module in modules.iter().rev() {
        if wanted.contains(&module.name) {
            wanted.extend(module.needs);
        }
    }
    Ok(modules.iter().filter(|module| wanted.contains(&module.name)).copied().collect())
}

/// The text of the library in a language by its name, or of a module with what it needs, for programs that print nothing.
///
/// # Errors
/// [`Error::Flag`] for a language or a module that is not there, and a language that comes as files alone.
pub fn text_of(language: &str, module: Option<&str>) -> Result<String, Error> {
    let known = Language::from_str(language, true).map_err(|_| {
        let all = Language::value_variants().iter().filter_map(ValueEnum::to_possible_value);
        let names: Vec<String> = all.map(|value| value.get_name().to_owned()).collect();
        Error::flag_error(format!("--lang {language}"), format!("choose one of {}", names.join(", ")))
    })?;
    text(known, module, &chosen(known, module)?)
}

/// The module of a name, or all whose names begin with it and an underscore.
fn named(modules: &[Module], name: &str) -> Vec<&'static str> {
    let all = || modules.iter().map(|module| module.name);
    match all().find(|module| *module == name) {
        Some(module) => vec![module],
        None => all()
            .filter(|module| module.strip_prefix(name).is_some_and(|rest| rest.starts_with('_')))
            .collect(),
    }
}

/// The text of the modules in one, as far as the language has that.
fn text(language: Language, name: Option<&str>, chosen: &[Module]) -> Result<String, Error> {
    match (language, name) {
        (Language::Spirv, _) => {
            Err(Error::flag_error("--lang spirv", "is binary; give a folder by --output"))
        }
        // Imports are WESL's way to say what a module needs.
        (Language::Wesl, Some(name)) => {
            let module = chosen.iter().find(|module| module.name == name);
            module.map(|module| module.text.to_owned()).ok_or_else(|| {
                let reason =
                    "names several modules, which are files; give a folder by --output, or name one of them";
                Error::flag_error(format!("--module {name}"), reason)
            })
        }
        (Language::Wesl, None) => Err(Error::flag_error(
            "--lang wesl",
            "modules are files; give a folder by --output, or a --module",
        )),
        _ => {
            let names: Vec<_> = chosen.iter().map(|module| module.name).collect();
            Ok(with_needs(chosen, &names))
        }
    }
}

/// Writes the files, and tells their names.
fn write(
    language: Language,
    whole: bool,
    chosen: &[Module],
    folder: &Path,
    force: bool,
) -> Result<Vec<String>, Error> {
    let (_, all, readme, extension) = language.texts();
    let mut files: Vec<(String, &[u8])> = vec![("README.md".to_owned(), readme.as_bytes())];
    files.extend(chosen.iter().map(|m| (format!("{}.{extension}", m.name), m.text.as_bytes())));
    if language == Language::Spirv {
        files.push(("kinran.spv".to_owned(), SPIRV));
    } else if let (true, Some(all)) = (whole, all) {
        files.push((format!("kinran.{extension}"), all.as_bytes()));
    }
    let other = |(name, bytes): &&(String, &[u8])| {
        std::fs::read(folder.join(name)).is_ok_and(|there| there != *bytes)
    };
    if let Some((name, _)) = files.iter().find(other).filter(|_| !force) {
        let reason = "is there with another content; give each language a folder of its own with --output, or overwrite it with --force";
        return Err(Error::file_error(folder.join(name), reason));
    }
    kinran_image::make_folder(folder)?;
    for (name, bytes) in &files {
        write_atomically(&folder.join(name), bytes)?;
    }
    Ok(files.into_iter().map(|(name, _)| name).collect())
}

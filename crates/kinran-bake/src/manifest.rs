//! `kinran.toml`: one file that describes a library of materials and models to bake.
//!
//! ```toml
//! output = "baked"               # paths are relative to this file
//!
//! [defaults]                     # any flag of `kinran bake`, by its name
//! filter = "ml"
//!
//! [[aniso]]                      # folders of maps
//! input = "materials/*"
//! exclude = "materials/wip*"
//!
//! [[mesh]]                       # .glb and .gltf files
//! input = ["models/*.glb", "props/**/*.gltf"]
//! output = "models"
//! all-textures = true
//!
//! [tile.steel]                   # a tile that layers call by its name
//! file = "tiles/steel_color.png"
//! scale = 4
//!
//! [[detail]]                     # targets, solved against their layers: flags of `kinran detail solve`
//! input = "targets/helmet_color.png"
//! layer = [{ tile = "steel" }, { tile = "tiles/rust.png", scale = 9, mask = "masks.png", channel = "g" }]
//! ```
//!
//! Every input becomes a [`Job`] with a folder of its own, `output` of the file, `output` of the entry and the
//! input's name, so that no two write the same file. What the flags mean is for whoever runs the jobs to say:
//! here they are names and values with their places, for [`Manifest::error`].

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use kinran_image::has_image_extension;
use kinran_scene::is_gltf;
use schemars::JsonSchema;
use serde::Serialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::patterns::PathPattern;

/// Bytes of the manifest's text.
pub type Place = Range<usize>;

/// The name of `known` that a person who wrote `name` most likely meant; `None` where none is near. By the measure and the
/// bound that clap has for flags: Jaro similarity above 0.7.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = name.trim_start_matches('-').replace('_', "-").to_lowercase();
    let alike = known.into_iter().map(|known| (strsim::jaro(&plain, known), known));
    alike.filter(|(likeness, _)| *likeness > 0.7).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, known)| known)
}

/// What is wrong in a manifest, and where. Prints as `FILE:LINE:COLUMN: what, and what was expected`.
#[derive(Clone, Debug, thiserror::Error)]
#[error("{}:{line}:{column}: {message}", path.display())]
pub struct ManifestError {
    /// The manifest.
    pub path: PathBuf,
    /// From 1.
    pub line: usize,
    /// From 1, in characters.
    pub column: usize,
    /// What is wrong, and what was expected.
    pub message: String,
    /// The line, with marks under the characters in question; no newline at its end.
    pub snippet: String,
}

/// What an entry's inputs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Folders of maps.
    Aniso,
    /// glTF files.
    Mesh,
    /// Targets of detail maps.
    Detail,
    /// Diffusion profiles, for the tables of skin; without an input human skin.
    Skin,
}

impl Kind {
    const ALL: [Kind; 4] = [Kind::Aniso, Kind::Mesh, Kind::Detail, Kind::Skin];

    /// The name of its entries: `[[name]]`.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Aniso => "aniso",
            Kind::Mesh => "mesh",
            Kind::Detail => "detail",
            Kind::Skin => "skin",
        }
    }

    /// What its inputs are, for messages.
    fn inputs(self) -> &'static str {
        match self {
            Kind::Aniso => "a folder of maps",
            Kind::Mesh => "a .glb or .gltf file",
            Kind::Detail => "an image",
            Kind::Skin => "a profile, .csv or .json",
        }
    }

    fn accepts(self, path: &Path) -> bool {
        let is = |extension: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension));
        match self {
            Kind::Aniso => path.is_dir(),
            Kind::Mesh => path.is_file() && is_gltf(path),
            Kind::Detail => path.is_file() && has_image_extension(path),
            Kind::Skin => path.is_file() && (is("csv") || is("json")),
        }
    }
}

/// A flag as the manifest gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The flag's name, without its dashes.
    pub name: String,
    /// Where the name stands.
    pub place: Place,
    /// Its value.
    pub value: SettingValue,
    /// It stands in `[defaults]`, whose flags go to the entries that know them.
    pub is_default: bool,
}

/// The value of a flag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SettingValue {
    /// `true` or `false`.
    Switch(bool),
    /// A string or a number as text; several for a flag that may be given again.
    Texts(Vec<(String, Place)>),
}

/// One thing to bake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// What the input is.
    pub kind: Kind,
    /// The input as a person would name it: relative to the manifest where it is under it, `/`-separated.
    pub name: String,
    /// The input; empty for human skin.
    pub input: PathBuf,
    /// The folder of its files, relative to the library's output.
    pub folder: PathBuf,
    /// Its flags, those of `[defaults]` among them, by name.
    pub settings: Vec<Setting>,
    /// The input in the manifest.
    pub place: Place,
}

#[derive(Clone, Debug)]
struct Entry {
    kind: Kind,
    place: Place,
    inputs: Vec<(String, Place)>,
    exclude: Vec<(String, Place)>,
    folder: Option<(String, Place)>,
    settings: Vec<Setting>,
}

/// A manifest understood.
#[derive(Clone, Debug)]
pub struct Manifest {
    path: PathBuf,
    text: String,
    /// Where the files go.
    pub output: PathBuf,
    /// Where finished work is kept, where the manifest says it.
    pub cache: Option<PathBuf>,
    /// Bytes that the cache may hold, where the manifest says it.
    pub cache_limit: Option<u64>,
    /// By name: the file, and what a layer of it says unless it says otherwise.
    tiles: BTreeMap<String, (String, Parts)>,
    entries: Vec<Entry>,
}

/// Names and values of a layer.
type Parts = Vec<(String, String)>;

impl Manifest {
    /// Reads a manifest.
    ///
    /// # Errors
    /// [`kinran_image::Error::Io`] where it cannot be read, and [`ManifestError`] where it is no TOML or says
    /// something that no manifest says.
    pub fn read(path: &Path) -> Result<Manifest, ReadError> {
        let text = std::fs::read_to_string(path).map_err(|e| kinran_image::Error::io(path, e))?;
        Ok(Manifest::parse(path, text)?)
    }

    /// Understands the text of the manifest `path`.
    ///
    /// # Errors
    /// [`ManifestError`].
    pub fn parse(path: &Path, text: String) -> Result<Manifest, ManifestError> {
        let mut manifest = Manifest {
            path: path.to_path_buf(),
            text,
            output: beside(path).join("baked"),
            cache: None,
            cache_limit: None,
            tiles: BTreeMap::new(),
            entries: Vec::new(),
        };
        let text = manifest.text.clone();
        let table = DeTable::parse(&text).map_err(|e| {
            let expected = e.message().trim().replace('\n', ", ");
            manifest.error(&e.span().unwrap_or(0..0), format!("this is not TOML: {expected}"))
        })?;

        // Layers call tiles by name, wherever those stand.
        if let Some((_, value)) = table.get_ref().iter().find(|(key, _)| key.get_ref() == "tile") {
            for (key, value) in manifest.table(value)? {
                let mut tile = manifest.parts(value)?;
                let Some(file) = tile.iter().position(|(name, _)| name == "file") else {
                    return Err(manifest.error(&key.span(), "this tile has no `file`".into()));
                };
                let file = tile.remove(file).1;
                manifest.tiles.insert(key.get_ref().to_string(), (file, tile));
            }
        }
        let mut defaults = Vec::new();
        for (key, value) in table.get_ref() {
            match key.get_ref().as_ref() {
                "output" => manifest.output = manifest.beside(manifest.text(value)?),
                "cache" => manifest.cache = Some(manifest.beside(manifest.text(value)?)),
                "cache-limit" => {
                    let limit = size(&manifest.text(value)?).map_err(|e| manifest.error(&value.span(), e))?;
                    manifest.cache_limit = Some(limit);
                }
                "defaults" => {
                    for (key, value) in manifest.table(value)? {
                        defaults.push(Setting { is_default: true, ..manifest.setting(key, value)? });
                    }
                }
                "tile" => {}
                name => {
                    let Some(kind) = Kind::ALL.into_iter().find(|kind| kind.name() == name) else {
                        let kinds = Kind::ALL.map(Kind::name);
                        let known =
                            ["output", "cache", "cache-limit", "defaults", "tile"].into_iter().chain(kinds);
                        let meant = nearest(name, known)
                            .map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
                        let kinds = kinds.map(|kind| format!("[[{kind}]]")).join(", ");
                        return Err(manifest.error(
                            &key.span(),
                            format!(
                                "unknown key `{name}`; {meant}expected output, cache, cache-limit, [defaults], \
                                 [tile.NAME], {kinds}"
                            ),
                        ));
                    };
                    for value in manifest.tables(kind, value)? {
                        let entry = manifest.entry(kind, value)?;
                        manifest.entries.push(entry);
                    }
                }
            }
        }
        for entry in &mut manifest.entries {
            merge_defaults(&defaults, &mut entry.settings);
        }
        manifest.entries.sort_by_key(|entry| entry.place.start);
        if manifest.entries.is_empty() {
            return Err(manifest.error(
                &(0..0),
                "nothing to bake; expected [[aniso]] with input = \"FOLDER\" or [[mesh]] with input = \"FILE\""
                    .into(),
            ));
        }
        Ok(manifest)
    }

    /// The manifest's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// An error about a place in the manifest.
    pub fn error(&self, place: &Place, message: String) -> ManifestError {
        let start = place.start.min(self.text.len());
        let line_start = self.text[..start].rfind('\n').map_or(0, |i| i + 1);
        let line_text = self.text[line_start..].lines().next().unwrap_or("");
        let line = self.text[..start].matches('\n').count() + 1;
        let column = self.text[line_start..start].chars().count();
        let marked = self.text[start..place.end.clamp(start, line_start + line_text.len())].chars().count();
        let number = line.to_string();
        let margin = " ".repeat(number.len());
        let shown: String = line_text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        ManifestError {
            path: self.path.clone(),
            line,
            column: column + 1,
            message,
            snippet: format!(
                "{margin} |\n{number} | {shown}\n{margin} | {}{}",
                " ".repeat(column),
                "^".repeat(marked.max(1))
            ),
        }
    }

    /// What there is to bake, in the order of the file and of names; for an input that is not there an error
    /// in its place, so that others can go on. Patterns leave out what `skip` names, with all that is in it.
    pub fn jobs(&self, skip: &dyn Fn(&Path) -> bool) -> Vec<Result<Job, ManifestError>> {
        let mut jobs: Vec<Result<Job, ManifestError>> = Vec::new();
        for entry in &self.entries {
            let excluded = self.excluded(entry, skip);
            if entry.inputs.is_empty() {
                let job = self.job(entry, &entry.place, PathBuf::new(), &jobs);
                jobs.push(job);
            }
            for (pattern, place) in &entry.inputs {
                match self.matches(entry.kind, pattern, place, skip) {
                    Err(error) => jobs.push(Err(error)),
                    Ok(paths) => {
                        for input in paths.into_iter().filter(|path| !excluded.contains(path)) {
                            let job = self.job(entry, place, input, &jobs);
                            jobs.push(job);
                        }
                    }
                }
            }
        }
        jobs
    }

    fn job(
        &self,
        entry: &Entry,
        place: &Place,
        input: PathBuf,
        known: &[Result<Job, ManifestError>],
    ) -> Result<Job, ManifestError> {
        let name = match entry.kind {
            Kind::Aniso => input.file_name(),
            Kind::Mesh | Kind::Detail => input.file_stem(),
            Kind::Skin => input.file_stem().or(Some("skin".as_ref())),
        };
        let Some(name) = name.map(PathBuf::from) else {
            return Err(
                self.error(place, "the input has no name; write its path so that it ends in one".into())
            );
        };
        let folder = entry.folder.as_ref().map_or(name.clone(), |(folder, _)| Path::new(folder).join(name));
        let same = |other: &&Job| lowercase(&other.folder) == lowercase(&folder);
        if let Some(other) = known.iter().flatten().find(same) {
            let line = self.error(&other.place, String::new()).line;
            return Err(self.error(
                place,
                format!(
                    "{} and {} of line {line} would both be baked to {}; give one entry another `output`",
                    if input.as_os_str().is_empty() { "skin".into() } else { self.name(&input) },
                    other.name,
                    folder.display()
                ),
            ));
        }
        let (kind, settings) = (entry.kind, entry.settings.clone());
        let name = if input.as_os_str().is_empty() { "skin".into() } else { self.name(&input) };
        Ok(Job { kind, name, input, folder, settings, place: place.clone() })
    }

    /// The path as it would stand in the manifest.
    fn name(&self, path: &Path) -> String {
        let name = path.strip_prefix(beside(&self.path)).unwrap_or(path).to_string_lossy();
        name.replace(std::path::MAIN_SEPARATOR, "/")
    }

    /// The inputs that a pattern stands for, by name; one without wildcards stands for itself.
    fn matches(
        &self,
        kind: Kind,
        pattern: &str,
        place: &Place,
        skip: &dyn Fn(&Path) -> bool,
    ) -> Result<Vec<PathBuf>, ManifestError> {
        let path = self.beside(pattern);
        if !PathPattern::is_one(pattern) {
            return match kind.accepts(&path) {
                true => Ok(vec![path]),
                false if path.exists() => {
                    Err(self.error(place, format!("{pattern} is not {}", kind.inputs())))
                }
                false => {
                    Err(self.error(place, format!("{pattern} does not exist; expected {}", kind.inputs())))
                }
            };
        }
        let mut found = self
            .pattern(pattern, place)?
            .matches(skip)
            .map_err(|e| self.error(place, format!("{pattern}: {e}")))?;
        found.retain(|path| kind.accepts(path));
        match found.is_empty() {
            true => Err(self.error(place, format!("{pattern} matches nothing; expected {}", kind.inputs()))),
            false => Ok(found),
        }
    }

    fn excluded(&self, entry: &Entry, skip: &dyn Fn(&Path) -> bool) -> BTreeSet<PathBuf> {
        // Patterns were checked when the entry was read.
        let patterns = entry.exclude.iter().filter_map(|(text, place)| self.pattern(text, place).ok());
        patterns.flat_map(|pattern| pattern.matches(skip).unwrap_or_default()).collect()
    }

    fn pattern(&self, text: &str, place: &Place) -> Result<PathPattern, ManifestError> {
        PathPattern::new(beside(&self.path), text)
            .map_err(|e| self.error(place, format!("{text} is no pattern: {e}")))
    }

    /// Folders in which inputs are or may appear, and whether that is anywhere below them.
    pub fn input_folders(&self) -> BTreeMap<PathBuf, bool> {
        let mut folders = BTreeMap::new();
        for (kind, (text, place)) in self.entries.iter().flat_map(|e| e.inputs.iter().map(|i| (e.kind, i))) {
            let (folder, deep) = match self.pattern(text, place) {
                Ok(pattern) if PathPattern::is_one(text) => (pattern.root().to_path_buf(), true),
                _ if kind == Kind::Aniso => (self.beside(text), false),
                _ => (beside(&self.beside(text)).to_path_buf(), false),
            };
            *folders.entry(folder).or_default() |= deep;
        }
        folders
    }

    /// A path that starts from the manifest's folder.
    pub fn beside(&self, path: impl AsRef<Path>) -> PathBuf {
        beside(&self.path).join(path)
    }

    fn text(&self, value: &Spanned<DeValue>) -> Result<String, ManifestError> {
        match value.get_ref() {
            DeValue::String(text) if !text.trim().is_empty() => Ok(text.to_string()),
            DeValue::String(_) => Err(self.error(&value.span(), "this is empty; expected a path".into())),
            other => Err(self.error(&value.span(), format!("expected a string, found {}", kind_of(other)))),
        }
    }

    /// A string or several.
    fn texts(&self, value: &Spanned<DeValue>) -> Result<Vec<(String, Place)>, ManifestError> {
        match value.get_ref() {
            DeValue::Array(values) => {
                values.iter().map(|value| Ok((self.text(value)?, value.span()))).collect()
            }
            DeValue::String(_) => Ok(vec![(self.text(value)?, value.span())]),
            other => Err(self.error(
                &value.span(),
                format!("expected a string or an array of strings, found {}", kind_of(other)),
            )),
        }
    }

    fn table<'a, 'i>(&self, value: &'a Spanned<DeValue<'i>>) -> Result<&'a DeTable<'i>, ManifestError> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(table),
            other => Err(self.error(&value.span(), format!("expected a table, found {}", kind_of(other)))),
        }
    }

    /// The tables of `[[kind]]`.
    fn tables<'a, 'i>(
        &self,
        kind: Kind,
        value: &'a Spanned<DeValue<'i>>,
    ) -> Result<Vec<&'a Spanned<DeValue<'i>>>, ManifestError> {
        let name = kind.name();
        match value.get_ref() {
            DeValue::Array(values) => Ok(values.iter().collect()),
            DeValue::Table(_) => Err(self.error(
                &value.span(),
                format!("expected [[{name}]] with two brackets, since there may be several"),
            )),
            other => {
                Err(self
                    .error(&value.span(), format!("expected [[{name}]] entries, found {}", kind_of(other))))
            }
        }
    }

    fn entry(&self, kind: Kind, value: &Spanned<DeValue>) -> Result<Entry, ManifestError> {
        let mut entry = Entry {
            kind,
            place: value.span(),
            inputs: Vec::new(),
            exclude: Vec::new(),
            folder: None,
            settings: Vec::new(),
        };
        for (key, value) in self.table(value)? {
            match key.get_ref().as_ref() {
                "input" => entry.inputs = self.texts(value)?,
                "exclude" => {
                    entry.exclude = self.texts(value)?;
                    for (pattern, place) in &entry.exclude {
                        self.pattern(pattern, place)?;
                    }
                }
                "output" => {
                    let folder = self.text(value)?;
                    let inside = |c| matches!(c, std::path::Component::Normal(_));
                    if !Path::new(&folder).components().all(inside) {
                        return Err(self.error(
                            &value.span(),
                            format!("{folder} leads out of the library's output; expected a folder in it"),
                        ));
                    }
                    entry.folder = Some((folder, value.span()));
                }
                _ => entry.settings.push(self.setting(key, value)?),
            }
        }
        if entry.inputs.is_empty() && kind != Kind::Skin {
            return Err(self.error(
                &entry.place,
                format!("this entry has no `input`; expected {} or a pattern of several", kind.inputs()),
            ));
        }
        Ok(entry)
    }

    fn setting(&self, key: &Spanned<Cow<str>>, value: &Spanned<DeValue>) -> Result<Setting, ManifestError> {
        let text = |value: &Spanned<DeValue>| match value.get_ref() {
            DeValue::String(text) if key.get_ref() == "layer" => {
                let (tile, rest) = text.split_once(',').unwrap_or((text, ""));
                let rest = rest.split(',').map(str::trim).filter(|part| !part.is_empty());
                let parts = rest.map(|part| part.split_once('=').unwrap_or((part, "")));
                let parts = parts.map(|(name, value)| (name.trim().to_owned(), value.trim().to_owned()));
                Ok((self.layer_of(value, tile.trim(), parts.collect())?, value.span()))
            }
            DeValue::String(text) => Ok((text.to_string(), value.span())),
            DeValue::Integer(number) => Ok((number.to_string(), value.span())),
            DeValue::Float(number) => Ok((number.to_string(), value.span())),
            DeValue::Table(_) if key.get_ref() == "layer" => Ok((self.layer(value)?, value.span())),
            other => Err(self.error(
                &value.span(),
                format!("expected a string, a number, true, false or an array, found {}", kind_of(other)),
            )),
        };
        let value = match value.get_ref() {
            DeValue::Boolean(on) => SettingValue::Switch(*on),
            DeValue::Array(values) => SettingValue::Texts(values.iter().map(text).collect::<Result<_, _>>()?),
            _ => SettingValue::Texts(vec![text(value)?]),
        };
        Ok(Setting { name: key.get_ref().to_string(), place: key.span(), value, is_default: false })
    }

    /// A layer's table as the flag: `FILE,NAME=VALUE,...`.
    fn layer(&self, value: &Spanned<DeValue>) -> Result<String, ManifestError> {
        let mut parts = self.parts(value)?;
        let Some(tile) = parts.iter().position(|(name, _)| name == "tile") else {
            let expected = "this layer has no `tile`; expected a file or the name of a [tile.NAME]";
            return Err(self.error(&value.span(), expected.into()));
        };
        let tile = parts.remove(tile).1;
        self.layer_of(value, &tile, parts)
    }

    /// The flag of a layer whose tile is a file, or called by its name.
    fn layer_of(
        &self,
        value: &Spanned<DeValue>,
        tile: &str,
        mut parts: Parts,
    ) -> Result<String, ManifestError> {
        let mut file = tile.to_owned();
        if let Some((of, defaults)) = self.tiles.get(tile) {
            file.clone_from(of);
            let own: BTreeSet<String> = parts.iter().map(|(name, _)| name.clone()).collect();
            parts.extend(defaults.iter().filter(|(name, _)| !own.contains(name)).cloned());
        } else if !has_image_extension(Path::new(tile)) {
            let known: Vec<String> = self.tiles.keys().map(|name| format!("[tile.{name}]")).collect();
            let known = if known.is_empty() { "none".into() } else { known.join(", ") };
            let message = format!(
                "\"{tile}\" is neither the file of an image nor the name of a tile; add [tile.{tile}] with its \
                 `file`, or name one that is there: {known}"
            );
            return Err(self.error(&value.span(), message));
        }
        let parts = parts.into_iter().map(|(name, value)| match value.as_str() {
            "" => format!(",{name}"),
            value => format!(",{name}={value}"),
        });
        Ok(file + &parts.collect::<String>())
    }

    /// The names and values of a table; of a switch that is on, no value.
    fn parts(&self, value: &Spanned<DeValue>) -> Result<Parts, ManifestError> {
        let mut parts = Parts::new();
        for (key, value) in self.table(value)? {
            let text = match value.get_ref() {
                DeValue::String(text) if text.contains(',') => {
                    return Err(
                        self.error(&value.span(), "a comma cannot stand here; rename the file".into())
                    );
                }
                DeValue::String(text) => text.to_string(),
                DeValue::Integer(number) => number.to_string(),
                DeValue::Float(number) => number.to_string(),
                DeValue::Boolean(true) => String::new(),
                DeValue::Boolean(false) => continue,
                other => {
                    return Err(self.error(
                        &value.span(),
                        format!("expected a string, a number, true or false, found {}", kind_of(other)),
                    ));
                }
            };
            parts.push((key.get_ref().to_string(), text));
        }
        Ok(parts)
    }
}

/// Why a manifest could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file.
    #[error(transparent)]
    Image(#[from] kinran_image::Error),
    /// What it says.
    #[error(transparent)]
    Manifest(#[from] ManifestError),
}

/// The folder that paths in a manifest start from.
fn beside(manifest: &Path) -> &Path {
    manifest.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Adds the defaults that an entry does not set itself.
fn merge_defaults(defaults: &[Setting], settings: &mut Vec<Setting>) {
    let own: BTreeSet<String> = settings.iter().map(|setting| setting.name.clone()).collect();
    settings.extend(defaults.iter().filter(|setting| !own.contains(&setting.name)).cloned());
    settings.sort_by(|a, b| a.name.cmp(&b.name));
}

fn lowercase(path: &Path) -> String {
    path.to_string_lossy().to_lowercase()
}

/// What a value is, for messages.
fn kind_of(value: &DeValue) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// Bytes of `10 GiB`, `500MB` and the like; a number alone is refused, since it may be meant in any unit.
///
/// # Errors
/// A sentence that says how to write it.
pub fn size(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let unit = match text[end..].trim().to_ascii_lowercase().as_str() {
        "b" => Some(1.0),
        "kb" => Some(1e3),
        "mb" => Some(1e6),
        "gb" => Some(1e9),
        "tb" => Some(1e12),
        "kib" => Some(1024.0),
        "mib" => Some(1024.0 * 1024.0),
        "gib" => Some(1024.0 * 1024.0 * 1024.0),
        "tib" => Some(1024.0 * 1024.0 * 1024.0 * 1024.0),
        _ => None,
    };
    match (text[..end].parse::<f64>(), unit) {
        (Ok(number), Some(unit)) if (number * unit).is_finite() => Ok((number * unit) as u64),
        _ => Err(format!("{text} is no size; write a number and a unit, such as 10 GiB or 500 MB")),
    }
}

//! `kinran init`: a manifest for what is there.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::{Path, PathBuf};

use kinran_bake::folder::{Hints, Role, inner_folder, named_maps, scan};
use kinran_bake::manifest::Manifest;
use kinran_image::{has_image_extension, write_atomically};
use kinran_scene::Document;
use schemars::JsonSchema;
use serde::Serialize;

use crate::outputs::{has_extension, written_in};
use crate::values::counted;
use crate::{Console, Error, Progress, Stage};
use kinran::detail::{MapKind, kind_of_role};
use kinran::library::STATE;

/// Writes a kinran.toml that lists what a folder holds, for `kinran bake kinran.toml`
///
/// Folders of maps become `[[aniso]]` entries, .glb and .gltf files `[[mesh]]` entries, and images in a folder called targets
/// `[[detail]]` entries, where a folder called tiles stands beside it and a target's name tells its tile. What was baked
/// before, maps of the models and hidden folders are left out; what cannot be baked as it is stands in the file as a
/// comment that says why. A kinran.toml that is there already stays as it is.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  kinran init
  kinran init library/ --dry-run
  kinran init library/ && kinran bake library/kinran.toml")]
pub struct Args {
    /// The folder to look through
    #[arg(value_name = "DIR", default_value = ".")]
    pub folder: PathBuf,

    /// Only shows what would be written
    #[arg(long)]
    pub dry_run: bool,
}

/// The manifest's name.
pub const MANIFEST: &str = "kinran.toml";

/// How often a tile repeats over a target where nobody has said it; chosen by eye.
const TILE_SCALE: u32 = 4;

/// As many entries of one folder are a pattern.
const PATTERN: usize = 3;

/// What was found, and what was written of it.
#[derive(Debug, Serialize, JsonSchema)]
pub(crate) struct Report {
    /// The manifest.
    manifest: PathBuf,
    /// Nothing was written.
    dry_run: bool,
    /// Folders of maps.
    folders: usize,
    /// Models.
    models: usize,
    /// Targets of detail maps.
    targets: usize,
    /// What looks like an input and is none.
    left_out: Vec<LeftOut>,
    /// The manifest's text.
    text: String,
}

/// What looks like an input and cannot be baked as it is.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub(crate) struct LeftOut {
    /// Below the folder.
    path: String,
    /// Why, and what to do about it.
    reason: String,
}

/// What a folder holds that can be baked. Paths are below it.
#[derive(Debug)]
pub(crate) struct Survey {
    root: PathBuf,
    folders: Vec<PathBuf>,
    models: Vec<PathBuf>,
    details: Vec<Detail>,
    left_out: Vec<LeftOut>,
}

/// A target and the tile that lies under it.
#[derive(Debug)]
struct Detail {
    target: PathBuf,
    tile: PathBuf,
    kind: &'static str,
}

/// The command.
///
/// # Errors
/// Where there is nothing to bake, or a manifest already.
pub fn run(args: &Args, console: &Console) -> Result<(), Error> {
    if args.folder.is_file() {
        return Err(Error::file_error(&args.folder, "is a file; name the folder that it is in"));
    }
    let manifest = args.folder.join(MANIFEST);
    if manifest.exists() && !args.dry_run {
        let again = format!("kinran init {} --dry-run", args.folder.display());
        let reason = format!("is there already and stays as it is; `{again}` shows what a new one would say");
        return Err(Error::file_error(&manifest, reason));
    }
    let survey = Survey::of(&args.folder, &console.progress())?;
    if survey.is_empty() {
        let seen = survey.left_out.first();
        let seen = seen
            .map_or_else(String::new, |left| format!(" that can be baked ({}: {})", left.path, left.reason));
        let reason =
            format!("there is no folder with maps, no .glb and no .gltf in it{seen}; name another folder");
        return Err(Error::file_error(&args.folder, reason));
    }
    let text = survey.manifest()?;
    survey.check(&manifest, &text)?;
    let summary = match args.dry_run {
        true => text.clone(),
        false => {
            write_atomically(&manifest, text.as_bytes())?;
            let path = manifest.display();
            format!("{path}: {}; `kinran bake {path}` bakes them", survey.counts())
        }
    };
    for left in &survey.left_out {
        console.warn(format!("{} is left out: {}", left.path, left.reason));
    }
    let report = Report {
        manifest,
        dry_run: args.dry_run,
        folders: survey.folders.len(),
        models: survey.models.len(),
        targets: survey.details.len(),
        left_out: survey.left_out,
        text,
    };
    // What a manifest would say was asked for: it comes when quiet too.
    Console { quiet: console.quiet && !args.dry_run, ..console.clone() }.result(&report, &summary)
}

impl Survey {
    /// Looks through a folder and those below it.
    ///
    /// # Errors
    /// Where `root` cannot be read; what cannot be read below it is left out.
    pub(crate) fn of(root: &Path, progress: &Progress) -> Result<Self, Error> {
        let stage = progress.busy("looking through folders");
        let mut found = Found::default();
        found.visit(root, Path::new(""))?;
        Ok(found.judge(root, &stage))
    }

    /// Whether there is nothing to bake.
    pub(crate) fn is_empty(&self) -> bool {
        self.folders.is_empty() && self.models.is_empty() && self.details.is_empty()
    }

    /// The model, where there is nothing else.
    pub(crate) fn only_model(&self) -> Option<&Path> {
        let [model] = self.models.as_slice() else { return None };
        (self.folders.is_empty() && self.details.is_empty()).then_some(model)
    }

    /// "61 folders with maps and 2 models".
    pub(crate) fn counts(&self) -> String {
        let count = |n: usize, one, many| (n > 0).then(|| counted(n, one, many));
        let parts = [
            count(self.folders.len(), "folder with maps", "folders with maps"),
            count(self.models.len(), "model", "models"),
            count(self.details.len(), "target with its tile", "targets with their tiles"),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(" and ")
    }

    /// ", and 2 that cannot be baked (wood: no …; and 1 more)"; empty where there is nothing else.
    pub(crate) fn others(&self) -> String {
        let count = self.left_out.len();
        self.failing()
            .map_or_else(String::new, |failing| format!(", and {count} that cannot be baked ({failing})"))
    }

    /// What cannot be baked, and why, where there is any: the first, and how many more.
    pub(crate) fn failing(&self) -> Option<String> {
        let LeftOut { path, reason } = self.left_out.first()?;
        let more = match self.left_out.len() - 1 {
            0 => String::new(),
            more => format!("; and {more} more"),
        };
        Some(format!("{path}: {reason}{more}"))
    }

    /// The manifest's text.
    fn manifest(&self) -> Result<String, Error> {
        let mut text = String::from(
            "# Written by `kinran init`; docs/manifest.md tells what else can stand here.\noutput = \"baked\"\n",
        );
        // Two inputs of one name would be baked into one folder: then those of each place have one of their own.
        let targets = self.details.iter().map(|detail| &detail.target);
        let stems = self.models.iter().chain(targets).map(|path| path.file_stem());
        let names = self.folders.iter().map(|path| path.file_name()).chain(stems);
        let mut known = BTreeSet::new();
        let apart = names.flatten().any(|name| !known.insert(name.to_string_lossy().to_lowercase()));
        let output = |kind: &str, place: &Path| apart.then(|| Path::new(kind).join(place));

        for (parent, folders) in by_parent(&self.folders) {
            entry(&mut text, "aniso", &self.patterns(&parent, &folders, None)?, output("maps", &parent), "");
        }
        for extension in ["glb", "vrm", "gltf"] {
            let models = self.models.iter().filter(|path| has_extension(path, extension));
            for (parent, models) in by_parent(models) {
                let patterns = self.patterns(&parent, &models, Some(extension))?;
                entry(&mut text, "mesh", &patterns, output(extension, &parent), "");
            }
        }
        if !self.details.is_empty() {
            text += &format!(
                "\n# scale, how often a tile repeats, is yours to say: {TILE_SCALE} is only a beginning.\n"
            );
        }
        let tiles: BTreeSet<(&PathBuf, &str)> = self.details.iter().map(|d| (&d.tile, d.kind)).collect();
        for (tile, kind) in tiles {
            let targets =
                self.details.iter().filter(|d| d.tile == *tile && d.kind == kind).map(|d| &d.target);
            for (parent, targets) in by_parent(targets) {
                let inputs = (listed(targets), Vec::new());
                let layer = format!("{{ tile = {}, scale = {TILE_SCALE} }}", quoted(&slashes(tile)));
                let flags = format!("kind = {}\nlayer = [{layer}]\n", quoted(kind));
                entry(&mut text, "detail", &inputs, output("detail", &parent.join(kind)), &flags);
            }
        }
        if !self.left_out.is_empty() {
            text += "\n# Left out:\n";
        }
        for left in &self.left_out {
            let reason = left.reason.split_whitespace().collect::<Vec<_>>().join(" ");
            text += &format!("# {}: {reason}\n", left.path.replace(char::is_control, " "));
        }
        Ok(text)
    }

    /// The inputs of an entry and what it excludes: many of one folder as a pattern, so that what comes later belongs to
    /// them. Inputs are folders, or files with an extension.
    fn patterns(
        &self,
        parent: &Path,
        chosen: &[&PathBuf],
        extension: Option<&str>,
    ) -> Result<(Vec<String>, Vec<String>), Error> {
        let pattern = extension.map_or_else(|| "*".to_owned(), |extension| format!("*.{extension}"));
        let dotted = |extension| format!(".{extension}");
        let fits = |path: &Path| match extension.map(dotted) {
            None => self.root.join(path).is_dir(),
            Some(ending) => path.to_string_lossy().ends_with(&ending),
        };
        let mut others = children(&self.root, parent)?;
        others.retain(|path| fits(path) && !chosen.contains(&path));
        if chosen.len() < PATTERN || others.len() >= chosen.len() || !chosen.iter().all(|path| fits(path)) {
            return Ok((listed(chosen.iter().copied()), Vec::new()));
        }
        let mut excluded = listed(&others);
        if extension.is_none() && parent == Path::new("") && !excluded.iter().any(|path| path == "baked") {
            excluded.push("baked".into());
        }
        let parent = escaped(&slashes(parent));
        let pattern = if parent.is_empty() { pattern } else { format!("{parent}/{pattern}") };
        Ok((vec![pattern], excluded))
    }

    /// What is written must be what was found.
    fn check(&self, path: &Path, text: &str) -> Result<(), Error> {
        let manifest = Manifest::parse(path, text.to_owned())?;
        let jobs = manifest.jobs(&|_| false).into_iter().collect::<Result<Vec<_>, _>>()?;
        if jobs.len() != self.folders.len() + self.models.len() + self.details.len() {
            let (path, found) = (path.display(), self.counts());
            return Err(Error::Internal(format!("{path}: {} entries for {found}", jobs.len())));
        }
        Ok(())
    }
}

/// What may be an input. Paths are below the root.
#[derive(Default)]
struct Found {
    folders: Vec<PathBuf>,
    /// Folders of images whose names tell no map.
    nameless: Vec<PathBuf>,
    models: Vec<PathBuf>,
    /// Folders of targets, and those of tiles beside them.
    targets: Vec<(PathBuf, PathBuf)>,
    left_out: Vec<LeftOut>,
    /// Where we have been: links may lead in circles.
    seen: HashSet<PathBuf>,
}

impl Found {
    fn leave_out(&mut self, path: &Path, reason: impl Into<String>) {
        let path = if path == Path::new("") { ".".into() } else { slashes(path) };
        self.left_out.push(LeftOut { path, reason: reason.into() });
    }

    fn visit(&mut self, root: &Path, folder: &Path) -> Result<(), Error> {
        let full = root.join(folder);
        if !self.seen.insert(full.canonicalize().unwrap_or_else(|_| full.clone())) {
            return Ok(());
        }
        let children = match children(root, folder) {
            Err(error) if folder != Path::new("") => {
                self.leave_out(folder, error.to_string());
                return Ok(());
            }
            children => children?,
        };
        if full.join(STATE).is_dir() && folder != Path::new("") {
            return Ok(());
        }
        // What an earlier bake wrote; in a folder that was baked in place the maps are there still.
        let ours = written_in(&full);
        let is_output = !ours.is_empty();
        let children: Vec<PathBuf> =
            children.into_iter().filter(|path| !ours.contains(&root.join(path))).collect();
        if children.is_empty() && is_output {
            return Ok(());
        }
        if children.is_empty() && folder != Path::new("") {
            self.leave_out(folder, "is empty; put maps or a model into it, or remove it");
        }
        let (folders, files): (Vec<PathBuf>, Vec<PathBuf>) =
            children.into_iter().partition(|path| root.join(path).is_dir());
        let has_images = files.iter().any(|path| has_image_extension(path));
        for path in files {
            if kinran_scene::is_gltf(&path) {
                self.models.push(path);
            } else if has_extension(&path, "obj") {
                let way = "save it as .glb (Blender does) to bake it; `kinran render` and `kinran skin` take it as it is";
                self.leave_out(&path, format!("an OBJ brings no materials with maps; {way}"));
            }
        }
        // Maps in a folder called textures are those of the folder, but for the one that is looked through.
        let inner = inner_folder(&full);
        let apart = folder == Path::new("") && inner.is_some();
        let maps = named_maps(&full).unwrap_or_default();
        if !apart && maps.iter().any(|(path, ..)| !ours.contains(path)) {
            self.folders.push(folder.to_path_buf());
        } else if !is_output && folder != Path::new("") && inner.is_none() && has_images {
            self.nameless.push(folder.to_path_buf());
        }
        let called = |name: &str| {
            let is = |path: &&PathBuf| path.file_name().is_some_and(|n| n.eq_ignore_ascii_case(name));
            folders.iter().find(is).cloned()
        };
        let pair = called("targets").zip(called("tiles"));
        for path in folders {
            if !apart && inner.as_ref().is_some_and(|inner| *inner == root.join(&path)) {
                continue;
            }
            if pair.as_ref().is_none_or(|(targets, tiles)| path != *targets && path != *tiles) {
                self.visit(root, &path)?;
            }
        }
        self.targets.extend(pair);
        Ok(())
    }

    /// Keeps what can be baked as it is.
    fn judge(mut self, root: &Path, stage: &Stage) -> Survey {
        stage.expect((self.models.len() + self.folders.len()) as u64);
        let mut of_models: HashSet<PathBuf> = HashSet::new();
        for model in std::mem::take(&mut self.models) {
            stage.add(1);
            match Document::open(root.join(&model)) {
                Ok(document) => {
                    let missing: Vec<PathBuf> =
                        document.files().into_iter().filter(|file| !file.is_file()).collect();
                    if let Some(first) = missing.first() {
                        let more = match missing.len() {
                            1 => String::new(),
                            count => format!(" and {} more", count - 1),
                        };
                        let name = crate::outputs::file_name(first);
                        self.leave_out(
                            &model,
                            format!("it names {name}{more}, which is not there; put it there"),
                        );
                    }
                    of_models.extend(document.files().iter().filter_map(|file| file.canonicalize().ok()));
                    if missing.is_empty() {
                        self.models.push(model);
                    }
                }
                Err(error) => self.leave_out(&model, without(&error, &root.join(&model))),
            }
        }
        for folder in std::mem::take(&mut self.folders) {
            stage.add(1);
            let full = root.join(&folder);
            let maps = named_maps(&full).unwrap_or_default();
            let of_model = |path: &PathBuf| path.canonicalize().is_ok_and(|path| of_models.contains(&path));
            if maps.iter().all(|(path, ..)| of_model(path)) {
                continue;
            }
            let understood = scan(&full, &Hints::default())
                .and_then(|found| found.materials.iter().try_for_each(|material| material.load().map(drop)));
            match understood {
                Ok(_) if folder == Path::new("") => {
                    let bake = format!("kinran bake {}", root.display());
                    self.leave_out(&folder, format!("the folder itself holds maps; `{bake}` bakes them"));
                }
                Ok(_) => self.folders.push(folder),
                Err(error) => self.leave_out(&folder, without(&error, &full)),
            }
        }
        for folder in std::mem::take(&mut self.nameless) {
            let full = root.join(&folder);
            let images = children(root, &folder).unwrap_or_default();
            let of_model =
                |path: &PathBuf| root.join(path).canonicalize().is_ok_and(|path| of_models.contains(&path));
            if images.iter().filter(|path| has_image_extension(path)).all(of_model) {
                continue;
            }
            if let Err(error) = scan(&full, &Hints::default()) {
                self.leave_out(&folder, without(&error, &full));
            }
        }
        let details = self.details(root);
        Survey {
            root: root.to_path_buf(),
            folders: self.folders,
            models: self.models,
            details,
            left_out: self.left_out,
        }
    }

    /// Targets with the one tile that holds the same kind of map and whose name stands in theirs, or that is the only
    /// one.
    fn details(&mut self, root: &Path) -> Vec<Detail> {
        let mut details = Vec::new();
        for (targets, tiles) in std::mem::take(&mut self.targets) {
            let maps = |folder: &Path| -> Vec<(PathBuf, Role)> {
                let maps = named_maps(&root.join(folder)).unwrap_or_default();
                maps.into_iter()
                    .filter_map(|(path, role, _)| Some((path.strip_prefix(root).ok()?.to_path_buf(), role)))
                    .collect()
            };
            let all_tiles = maps(&tiles);
            for (target, role) in maps(&targets) {
                // What is packed is solved only where somebody says so.
                let kind = kind_of_role(role).filter(|_| !role.is_packed()).map(MapKind::name);
                let Some(kind) = kind else { continue };
                let stem =
                    |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase();
                let own = stem(&target);
                let same: Vec<&PathBuf> =
                    all_tiles.iter().filter(|(_, r)| *r == role).map(|(path, _)| path).collect();
                let named = same.iter().copied().filter(|tile| {
                    let tile = stem(tile);
                    own.contains(
                        tile.rsplit_once(['_', '-', '.', ' ']).map_or(tile.as_str(), |(name, _)| name),
                    )
                });
                let tile = match (named.collect::<Vec<_>>().as_slice(), same.as_slice()) {
                    ([tile], _) | ([], [tile]) => *tile,
                    _ => {
                        let way = "begin its name with its tile's, or write a [[detail]] entry";
                        self.leave_out(
                            &target,
                            format!("which of {} tiles lies under it cannot be told; {way}", same.len()),
                        );
                        continue;
                    }
                };
                if tile.to_string_lossy().contains(',') {
                    self.leave_out(
                        &target,
                        format!("its tile {} has a comma in its name; rename it", slashes(tile)),
                    );
                    continue;
                }
                details.push(Detail { target, tile: tile.clone(), kind });
            }
        }
        details
    }
}

/// What is in a folder, by name, hidden files left out; paths are below the root.
fn children(root: &Path, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    // Without the slash that joining nothing adds.
    let full: PathBuf = root.join(folder).components().collect();
    let io = |e| kinran_image::Error::io(&full, e);
    let mut names = Vec::new();
    for entry in std::fs::read_dir(&full).map_err(io)? {
        let name = entry.map_err(io)?.file_name();
        // A manifest is UTF-8.
        if name.to_str().is_some_and(|name| !name.starts_with('.')) {
            names.push(folder.join(name));
        }
    }
    names.sort();
    Ok(names)
}

/// Paths by the folder that they are in, both in their order.
fn by_parent<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> BTreeMap<PathBuf, Vec<&'a PathBuf>> {
    let mut groups: BTreeMap<PathBuf, Vec<&PathBuf>> = BTreeMap::new();
    for path in paths {
        groups.entry(path.parent().unwrap_or(Path::new("")).to_path_buf()).or_default().push(path);
    }
    groups
}

/// An entry of the manifest; `patterns` are its inputs and what it excludes.
fn entry(
    text: &mut String,
    kind: &str,
    (inputs, excluded): &(Vec<String>, Vec<String>),
    output: Option<PathBuf>,
    flags: &str,
) {
    let list = |names: &[String]| match names {
        [name] => quoted(name),
        names => format!(
            "[\n    {},\n]",
            names.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(",\n    ")
        ),
    };
    *text += &format!("\n[[{kind}]]\ninput = {}\n", list(inputs));
    if !excluded.is_empty() {
        *text += &format!("exclude = {}\n", list(excluded));
    }
    if let Some(output) = output {
        *text += &format!("output = {}\n", quoted(&slashes(&output)));
    }
    *text += flags;
}

/// A path as manifests have it on every system.
fn slashes(path: &Path) -> String {
    path.to_string_lossy().replace(std::path::MAIN_SEPARATOR, "/")
}

/// Paths as patterns that stand for them alone.
fn listed<'a>(paths: impl IntoIterator<Item = &'a PathBuf>) -> Vec<String> {
    paths.into_iter().map(|path| escaped(&slashes(path))).collect()
}

/// A pattern that stands for this path alone.
fn escaped(path: &str) -> String {
    path.chars().map(|c| if "*?[]".contains(c) { format!("[{c}]") } else { c.into() }).collect()
}

/// A string of TOML, whose escapes are those of JSON but for one.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007F")
}

/// What an error says of a file after its name.
fn without(error: &dyn std::fmt::Display, path: &Path) -> String {
    let text = error.to_string();
    let rest = text.strip_prefix(&format!("{}: ", path.display()));
    rest.map_or_else(|| text.clone(), str::to_owned)
}

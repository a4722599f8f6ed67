//! A library: what a `kinran.toml` lists, baked in parallel, each thing once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use kinran_bake::cache::{Cache, Entry, Key, StoredFile, WorkFolder, files_of, hash_file, relative};
use kinran_bake::folder::scan;
use kinran_bake::manifest::{Job, Kind, Manifest, ManifestError, SettingValue};
use kinran_bake::stamps::{Stamp, Stamps};
use kinran_image::{write_atomically, write_atomically_in};
use kinran_scene::Document;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::settings::{self, Flags};
use super::{Args, Report, bake_folder, bake_gltf, file_name};
use crate::detail::{SolveArgs, solve_target};
use crate::skin_lut;
use crate::table::list;
use crate::{Console, Error, Progress};

/// Bytes that a cache may hold where nothing says otherwise; chosen by eye: a few hundred 4096² materials.
pub const CACHE_LIMIT: u64 = 20 << 30;

/// How often `--watch` looks.
const WATCH_STEP: Duration = Duration::from_millis(300);

/// How often what is known of the output is saved while baking.
const SAVE_STEP: Duration = Duration::from_secs(2);

/// Flags that only a manifest takes.
#[derive(Clone, Debug, Default, PartialEq, clap::Args)]
#[command(next_help_heading = "Of a kinran.toml")]
pub struct LibraryArgs {
    /// Bakes again whenever an input or the manifest is saved, until interrupted
    #[arg(long)]
    pub watch: bool,

    /// Entries baked at the same time [default: one for each worker thread]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: Option<u16>,

    /// Removes the files of entries that are gone from the manifest, those that nobody has changed
    #[arg(long)]
    pub prune: bool,

    /// Where finished work is kept [default: KINRAN_CACHE, else what the manifest says, else the user's
    /// cache folder]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// What became of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// Its files were there already.
    UpToDate,
    /// Its files came from the cache.
    Restored,
    /// It was baked.
    Baked,
    /// It was not baked because `--dry-run` was given.
    WouldBake,
    /// It would have come from the cache.
    WouldRestore,
    /// It could not be baked.
    Failed,
}

impl Status {
    fn name(self) -> &'static str {
        match self {
            Status::UpToDate => "up to date",
            Status::Restored => "from cache",
            Status::Baked => "baked",
            Status::WouldBake => "to be baked",
            Status::WouldRestore => "in the cache",
            Status::Failed => "failed",
        }
    }
}

/// One entry of the manifest.
#[derive(Clone, Debug, Serialize)]
pub struct EntryReport {
    /// The input.
    pub name: String,
    /// What it is.
    pub kind: Option<Kind>,
    /// The folder of its files, below the output.
    pub folder: PathBuf,
    /// What became of it.
    pub status: Status,
    /// Its files.
    pub files: Vec<StoredFile>,
    /// What was assumed or left out while it was baked.
    pub warnings: Vec<String>,
    /// Why it failed.
    pub error: Option<String>,
}

/// What a run over a manifest did.
#[derive(Clone, Debug, Serialize)]
pub struct LibraryReport {
    /// Where the files are.
    pub output: PathBuf,
    /// The entries, in the manifest's order.
    pub entries: Vec<EntryReport>,
    /// Entries that the cache let go, to stay below its limit.
    pub evicted: usize,
    /// Folders, below the output, of entries that are gone from the manifest and whose files stand there still.
    pub left_over: Vec<PathBuf>,
    /// Those that `--prune` removed, or with `--dry-run` would remove.
    pub pruned: Vec<PathBuf>,
}

impl LibraryReport {
    fn count(&self, status: Status) -> usize {
        self.entries.iter().filter(|entry| entry.status == status).count()
    }

    /// A row for each entry that was not up to date, and the counts.
    fn text(&self) -> String {
        let changed: Vec<&EntryReport> =
            self.entries.iter().filter(|entry| entry.status != Status::UpToDate).collect();
        let rows = changed.iter().map(|entry| {
            let bytes: u64 = entry.files.iter().map(|file| file.bytes).sum();
            let size = match entry.files.len() {
                0 => String::new(),
                count => format!("{count} files, {:.1} KiB", bytes as f64 / 1024.0),
            };
            vec![entry.name.clone(), entry.status.name().into(), entry.folder.display().to_string(), size]
        });
        let mut text = list(&rows.collect::<Vec<_>>());
        let statuses = [
            Status::Baked,
            Status::Restored,
            Status::WouldBake,
            Status::WouldRestore,
            Status::UpToDate,
            Status::Failed,
        ];
        let counts: Vec<String> = statuses
            .into_iter()
            .filter(|&status| self.count(status) > 0)
            .map(|status| format!("{} {}", self.count(status), status.name()))
            .collect();
        text += &format!("{}; in {}\n", counts.join(", "), self.output.display());
        let named = |folders: &[PathBuf]| {
            let names: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
            names.join(", ")
        };
        if !self.left_over.is_empty() {
            text += &format!("gone from the manifest, --prune removes them: {}\n", named(&self.left_over));
        }
        if !self.pruned.is_empty() {
            text += &format!("removed: {}\n", named(&self.pruned));
        }
        text
    }
}

/// What is known of the files that stand in the output: by entry folder.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Standing {
    key: String,
    files: Vec<(StoredFile, Stamp)>,
}

/// A library on its way.
struct Library {
    output: PathBuf,
    cache: Cache,
    stamps: Stamps,
    standing: Mutex<BTreeMap<PathBuf, Standing>>,
    saved: Mutex<Instant>,
}

/// Bakes what a manifest lists; with `--watch` again and again.
///
/// # Errors
/// [`Error::Manifest`] where it cannot be understood, and [`Error::Entries`] where an entry failed, after all
/// others are done.
pub fn bake_library(args: &Args, console: &Console) -> Result<(), Error> {
    settings::refuse_others(args)?;
    let mut failed = Failures::new();
    if !args.library.watch {
        return build(args, console, &mut failed)?.finish(console);
    }
    let mut last = String::new();
    loop {
        let result = build(args, console, &mut failed);
        let said = match &result {
            Ok(built) => serde_json::to_string(&built.report).unwrap_or_default(),
            Err(error) => error.to_string(),
        };
        let news = !matches!(&result, Ok(built) if !built.is_news());
        if news && said != last {
            match result {
                Ok(built) => console.result(&built.report, &built.report.text())?,
                Err(error) => console.failure(&error),
            }
        }
        last = said;
        std::thread::sleep(WATCH_STEP);
    }
}

/// Entries that cannot be baked as they are now, by folder: their keys, where they have one, and why.
type Failures = BTreeMap<PathBuf, (Option<Key>, String)>;

struct Built {
    report: LibraryReport,
}

impl Built {
    /// Whether anything was done or failed.
    fn is_news(&self) -> bool {
        self.report.count(Status::UpToDate) < self.report.entries.len()
    }

    fn finish(self, console: &Console) -> Result<(), Error> {
        console.result(&self.report, &self.report.text())?;
        match self.report.count(Status::Failed) {
            0 => Ok(()),
            failed => Err(Error::Entries { failed, of: self.report.entries.len() }),
        }
    }
}

fn build(args: &Args, console: &Console, failures: &mut Failures) -> Result<Built, Error> {
    let manifest = Manifest::read(&args.input)?;
    let mut entries: Vec<EntryReport> = Vec::new();
    let mut work: Vec<(usize, Job, Flags)> = Vec::new();
    let output = args.output.clone().unwrap_or_else(|| manifest.output.clone());
    if !args.dry_run {
        crate::outputs::check_folder(&output)?;
    }
    for job in manifest.jobs() {
        match job {
            Ok(job) => {
                let flags = settings::flags(&manifest, &job)?;
                entries.push(EntryReport::new(&job));
                work.push((entries.len() - 1, job, flags));
            }
            Err(error) => entries.push(EntryReport::missing(&error)),
        }
    }
    let cache_path = cache_folder(&args.library, manifest.cache.as_deref(), &output);
    let library = Library::new(output, &cache_path);

    // Look at everything first: what is up to date costs no more than that.
    let stage = console.progress().stage("checking", work.len() as u64);
    let keys: Vec<Result<Key, Error>> = (work.par_iter())
        .map(|(_, job, flags)| {
            let key = library.key(job, flags);
            stage.add(1);
            key
        })
        .collect();
    drop(stage);
    let mut todo: Vec<(usize, Key, Job, Flags)> = Vec::new();
    for ((at, job, flags), key) in work.into_iter().zip(keys) {
        match key {
            Err(error) => entries[at].fail(error.to_string()),
            Ok(key) => match library.standing_files(&job, &key) {
                Some(files) => (entries[at].files, entries[at].status) = (files, Status::UpToDate),
                None => match failures.get(&job.folder) {
                    Some((Some(known), why)) if *known == key => entries[at].fail(why.clone()),
                    _ => todo.push((at, key, job, flags)),
                },
            },
        }
    }
    if args.dry_run {
        for (at, key, ..) in &todo {
            let cached = library.cache.get(key).is_some();
            entries[*at].status = if cached { Status::WouldRestore } else { Status::WouldBake };
        }
        let gone = library.gone(&entries);
        let (left_over, pruned) = if args.library.prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
        let report = LibraryReport { output: library.output, entries, evicted: 0, left_over, pruned };
        return Ok(Built { report });
    }

    // Bake the rest, some at a time. Threads of their own and not tasks of the pool: a thread of the pool that
    // waits for a part of one entry would begin another one meanwhile, and hold both in memory.
    let bars = console.progress().grouped();
    let stage = bars.stage("baking", todo.len() as u64);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, EntryReport)>> = Mutex::new(Vec::new());
    let threads = args.library.jobs.map_or_else(rayon::current_num_threads, usize::from).min(todo.len());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((at, key, job, flags)) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let mut entry = EntryReport::new(job);
                    match library.make(job, key, flags, &bars, &mut entry) {
                        Ok(status) => entry.status = status,
                        Err(error) => entry.fail(error.to_string()),
                    }
                    lock(&done).push((*at, entry));
                    stage.add(1);
                }
            });
        }
    });
    drop(stage);
    for (at, entry) in done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        entries[at] = entry;
    }
    let gone = library.gone(&entries);
    let (left_over, pruned) = if args.library.prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
    library.prune(&pruned, console)?;
    library.save()?;
    let limit = manifest.cache_limit.unwrap_or(CACHE_LIMIT);
    let evicted = if todo.is_empty() { 0 } else { library.cache.evict(limit)?.0 };

    // Tell what went wrong once.
    failures.retain(|folder, _| entries.iter().any(|e| e.folder == *folder && e.status == Status::Failed));
    for entry in &entries {
        for warning in &entry.warnings {
            console.warn(format!("{}: {warning}", entry.name));
        }
        let Some(error) = &entry.error else { continue };
        let key = todo.iter().find(|(_, _, job, _)| job.folder == entry.folder).map(|(_, key, ..)| *key);
        let known = failures.get(&entry.folder).is_some_and(|(_, why)| why == error);
        if !known {
            console.error(format!("{}: {error}", entry.name));
            failures.insert(entry.folder.clone(), (key, error.clone()));
        }
    }
    Ok(Built { report: LibraryReport { output: library.output, entries, evicted, left_over, pruned } })
}

impl EntryReport {
    fn new(job: &Job) -> Self {
        EntryReport {
            name: job.name.clone(),
            kind: Some(job.kind),
            folder: job.folder.clone(),
            status: Status::UpToDate,
            files: Vec::new(),
            warnings: Vec::new(),
            error: None,
        }
    }

    /// An input that is not there.
    fn missing(error: &ManifestError) -> Self {
        let name = format!("{}:{}:{}", file_name(&error.path), error.line, error.column);
        EntryReport {
            folder: PathBuf::from(&name),
            name,
            kind: None,
            status: Status::Failed,
            files: Vec::new(),
            warnings: Vec::new(),
            error: Some(error.message.clone()),
        }
    }

    fn fail(&mut self, error: String) {
        self.status = Status::Failed;
        self.error = Some(error);
    }
}

/// `--cache`, `KINRAN_CACHE`, the manifest's, or the user's folder for such things; beside the output where
/// there is no user.
pub fn cache_folder(args: &LibraryArgs, manifest: Option<&Path>, output: &Path) -> PathBuf {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    (args.cache.clone())
        .or_else(|| variable("KINRAN_CACHE"))
        .or_else(|| manifest.map(Path::to_path_buf))
        .or_else(|| Some(variable("XDG_CACHE_HOME")?.join("kinran")))
        .or_else(|| Some(variable("LOCALAPPDATA")?.join("kinran").join("cache")))
        .or_else(|| Some(variable("HOME")?.join(".cache").join("kinran")))
        .unwrap_or_else(|| output.join(STATE).join("cache"))
}

/// The folder in the output with what is known of it.
const STATE: &str = ".kinran";

impl Library {
    fn new(output: PathBuf, cache: &Path) -> Self {
        let state = output.join(STATE);
        let standing = std::fs::read(state.join("standing.json")).ok();
        let standing = standing.and_then(|bytes| serde_json::from_slice(&bytes).ok()).unwrap_or_default();
        Library {
            cache: Cache::new(cache),
            stamps: Stamps::load(&state.join("inputs.json")),
            standing: Mutex::new(standing),
            saved: Mutex::new(Instant::now()),
            output,
        }
    }

    /// Hash of all that an entry's files depend on.
    fn key(&self, job: &Job, flags: &Flags) -> Result<Key, Error> {
        let mut parts: Vec<String> = vec![env!("CARGO_PKG_VERSION").into(), self.program()?, processor()];
        parts.push(job.kind.name().into());
        parts.extend(job.settings.iter().map(|setting| match &setting.value {
            SettingValue::Switch(on) => format!("{} {on}", setting.name),
            SettingValue::Texts(texts) => {
                let texts: Vec<&str> = texts.iter().map(|(text, _)| text.as_str()).collect();
                format!("{} {texts:?}", setting.name)
            }
        }));
        match (job.kind, flags) {
            (Kind::Aniso, Flags::Bake(flags)) => {
                let folder = scan(&job.input, &flags.hints())?;
                parts.push(serde_json::to_string(&folder.rows).map_err(|e| Error::Internal(e.to_string()))?);
                for (role, path) in folder.materials.iter().flat_map(|material| &material.files) {
                    parts.push(format!("{} {} {}", role.name(), file_name(path), self.stamps.hash(path)?));
                }
            }
            (_, Flags::Detail(flags)) => {
                let layers = flags.layer.iter().flat_map(|layer| [Some(&layer.tile), layer.mask.as_ref()]);
                let model = flags.model.as_ref().map(|model| self.model_files(model)).transpose()?;
                let model = model.unwrap_or_default();
                for path in std::iter::once(&job.input).chain(layers.flatten()).chain(&model) {
                    parts.push(format!("{} {}", file_name(path), self.stamps.hash(path)?));
                }
            }
            (_, Flags::Skin(flags)) => {
                if let Some(path) = &flags.profile {
                    parts.push(format!("{} {}", file_name(path), self.stamps.hash(path)?));
                }
            }
            (_, Flags::Bake(_)) => {
                for path in self.model_files(&job.input)? {
                    parts.push(format!("{} {}", file_name(&path), self.stamps.hash(&path)?));
                }
            }
        }
        Ok(Key::new(parts.iter().map(String::as_bytes)))
    }

    /// A model and the files that it refers to.
    fn model_files(&self, model: &Path) -> Result<Vec<PathBuf>, Error> {
        let files =
            self.stamps.refers_to(model, || -> Result<_, Error> { Ok(Document::open(model)?.files()) })?;
        Ok(std::iter::once(model.to_path_buf()).chain(files).collect())
    }

    /// The program itself: another build may bake other bytes under the same version.
    fn program(&self) -> Result<String, Error> {
        match std::env::current_exe() {
            Ok(path) => Ok(self.stamps.hash(&path)?),
            Err(_) => Ok(String::new()),
        }
    }

    /// The files of an entry, if they stand in the output as they were written.
    fn standing_files(&self, job: &Job, key: &Key) -> Option<Vec<StoredFile>> {
        let standing = lock(&self.standing).get(&job.folder).cloned()?;
        let folder = self.output.join(&job.folder);
        let stands =
            |(file, stamp): &(StoredFile, Stamp)| Stamp::of(&folder.join(&file.name)).as_ref() == Some(stamp);
        let whole = standing.key == key.hex() && standing.files.iter().all(stands);
        whole.then(|| standing.files.into_iter().map(|(file, _)| file).collect())
    }

    /// Brings an entry's files to the output, from the cache or by baking them into it first.
    fn make(
        &self,
        job: &Job,
        key: &Key,
        flags: &Flags,
        bars: &Progress,
        report: &mut EntryReport,
    ) -> Result<Status, Error> {
        if let Some(entry) = self.cache.get(key)
            && let Some(copied) = self.place(job, key, &entry, report)?
        {
            return Ok(if copied == 0 { Status::UpToDate } else { Status::Restored });
        }
        // What is damaged is in the way.
        self.cache.remove(key)?;
        let work = self.cache.work_folder()?;
        let output = files_of(&work);
        let silent = Console { quiet: true, bars: Some(bars.of(&job.name)), ..Console::default() };
        let reports = match flags {
            Flags::Bake(flags) => {
                let flags = Args { input: job.input.clone(), output: Some(output), ..(**flags).clone() };
                match job.kind {
                    Kind::Mesh => vec![bake_gltf(&flags, &silent)?],
                    _ => bake_folder(&flags, &silent)?,
                }
            }
            Flags::Detail(flags) => {
                let flags = SolveArgs { target: job.input.clone(), output, ..(**flags).clone() };
                solve_target(&flags, &silent)?;
                Vec::new()
            }
            Flags::Skin(flags) => {
                skin_lut::run(&skin_lut::Args { output, ..(**flags).clone() }, &silent)?;
                Vec::new()
            }
        };
        let warnings: Vec<&str> =
            reports.iter().flat_map(|r: &Report| &r.warnings).map(String::as_str).collect();
        let entry = self.cache.publish(key, work, &job.name, serde_json::json!(warnings))?;
        if self.place(job, key, &entry, report)?.is_none() {
            let reason = std::io::Error::other("its files vanished while they were copied out; try again");
            return Err(kinran_image::Error::io(self.cache.root(), reason).into());
        }
        Ok(Status::Baked)
    }

    /// Copies an entry's files to the output, those that are not there yet, and tells how many those were; nothing
    /// where the cache has lost one.
    fn place(
        &self,
        job: &Job,
        key: &Key,
        entry: &Entry,
        report: &mut EntryReport,
    ) -> Result<Option<usize>, Error> {
        let folder = self.output.join(&job.folder);
        let scratch = WorkFolder::new(&self.output.join(STATE))?;
        let (mut files, mut copied) = (Vec::new(), 0);
        for file in &entry.files {
            let Some(name) = relative(&file.name) else { return Ok(None) };
            let path = folder.join(name);
            if !is_already(&path, file) {
                let Some(bytes) = self.cache.read(key, file) else { return Ok(None) };
                refuse_input(job, &path)?;
                if let Some(parent) = path.parent() {
                    std::fs::create_dir_all(parent).map_err(|e| kinran_image::Error::io(parent, e))?;
                }
                write_atomically_in(scratch.path(), &path, &bytes)?;
                copied += 1;
            }
            if let Some(stamp) = Stamp::of(&path) {
                files.push((file.clone(), stamp));
            }
        }
        report.files.clone_from(&entry.files);
        report.warnings = serde_json::from_value(entry.report.clone()).unwrap_or_default();

        // What an earlier run left there under other names is of no use.
        let standing = Standing { key: key.hex(), files };
        let old = lock(&self.standing).insert(job.folder.clone(), standing);
        for (file, stamp) in old.into_iter().flat_map(|old| old.files) {
            let path = folder.join(&file.name);
            let kept = entry.files.iter().any(|new| new.name == file.name);
            if !kept && Stamp::of(&path).as_ref() == Some(&stamp) {
                std::fs::remove_file(&path).map_err(|e| kinran_image::Error::io(&path, e))?;
            }
        }
        if lock(&self.saved).elapsed() > SAVE_STEP {
            self.save()?;
        }
        Ok(Some(copied))
    }

    /// Folders of entries that no input stands for any more. While an input is missing nothing is said: its folder has
    /// a name that nobody knows.
    fn gone(&self, entries: &[EntryReport]) -> Vec<PathBuf> {
        if entries.iter().any(|entry| entry.kind.is_none()) {
            return Vec::new();
        }
        let standing = lock(&self.standing);
        let known = |folder: &&PathBuf| entries.iter().any(|entry| entry.folder == **folder);
        standing.keys().filter(|folder| !known(folder)).cloned().collect()
    }

    /// Removes the files that this program put into these folders, and the folders where nothing is left; files that
    /// somebody has changed since stay and are told.
    fn prune(&self, folders: &[PathBuf], console: &Console) -> Result<(), Error> {
        for folder in folders {
            let path = self.output.join(folder);
            let known = lock(&self.standing).remove(folder).unwrap_or_default();
            for (file, stamp) in known.files {
                let Some(file) = relative(&file.name).map(|name| path.join(name)) else { continue };
                match Stamp::of(&file) {
                    None => {}
                    Some(now) if now == stamp => {
                        std::fs::remove_file(&file).map_err(|e| kinran_image::Error::io(&file, e))?;
                    }
                    Some(_) => console.warn(format!("{}: was changed and stays", file.display())),
                }
            }
            let inside = path.ancestors().take_while(|inside| *inside != self.output);
            inside.take_while(|inside| std::fs::remove_dir(inside).is_ok()).for_each(drop);
        }
        Ok(())
    }

    /// Saves what is known of inputs and output, so that the next run need not look at their bytes.
    fn save(&self) -> Result<(), Error> {
        let state = self.output.join(STATE);
        std::fs::create_dir_all(&state).map_err(|e| kinran_image::Error::io(&state, e))?;
        *lock(&self.saved) = Instant::now();
        self.stamps.save(&state.join("inputs.json"))?;
        let json = serde_json::to_vec(&*lock(&self.standing)).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(write_atomically(&state.join("standing.json"), &json)?)
    }
}

/// The instruction sets that Intel's block encoder chooses among; its bytes differ.
fn processor() -> String {
    #[cfg(target_arch = "x86_64")]
    let sets = [
        std::arch::is_x86_feature_detected!("sse4.1"),
        std::arch::is_x86_feature_detected!("avx"),
        std::arch::is_x86_feature_detected!("avx2"),
        std::arch::is_x86_feature_detected!("avx512f"),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let sets = [(); 0];
    format!("{} {sets:?}", std::env::consts::ARCH)
}

fn is_already(path: &Path, file: &StoredFile) -> bool {
    let size = std::fs::metadata(path).map(|m| if m.is_file() { m.len() } else { u64::MAX });
    size.is_ok_and(|size| size == file.bytes) && hash_file(path).is_ok_and(|(_, hash)| hash == file.blake3)
}

/// Refuses to write over what the entry was made from.
fn refuse_input(job: &Job, path: &Path) -> Result<(), Error> {
    let Ok(existing) = path.canonicalize() else { return Ok(()) };
    let beside = match job.kind {
        Kind::Aniso => Some(job.input.as_path()),
        Kind::Mesh | Kind::Detail | Kind::Skin => job.input.parent(),
    };
    let home = beside.and_then(|folder| folder.canonicalize().ok());
    if home.is_some_and(|home| existing.parent() == Some(&home)) {
        return Err(Error::Usage(format!(
            "{}: lies among the inputs and would be overwritten; choose another `output`",
            path.display()
        )));
    }
    Ok(())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

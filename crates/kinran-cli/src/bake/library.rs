//! A library: what a `kinran.toml` lists, baked in parallel, each thing once.

mod inputs;
mod ours;
mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};
use std::time::{Duration, Instant};

use kinran::Space;
use kinran::report::Report;
use kinran_bake::cache::{Cache, Entry, Key, StoredFile, WorkFolder, hash_file, relative};
use kinran_bake::manifest::{Job, Kind, Manifest, ManifestError};
use kinran_bake::stamps::{Stamp, Stamps};
use kinran_image::{write_atomically, write_atomically_in};
use kinran_scene::Document;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::inputs::{Snapshot, Sources};
use self::ours::Ours;
use super::settings::{self, Flags};
use super::{Args, file_name, folder, gltf};
use crate::detail::{self, SolveArgs, solve_target};
use crate::outputs::{check_space, space_text};
use crate::skin_lut;
use crate::table::list;
use crate::values::counted;
use crate::{Console, Error, Failure, Progress};

/// Bytes that a cache may hold where nothing says otherwise; chosen by eye: a few hundred 4096² materials.
pub const CACHE_LIMIT: u64 = 20 << 30;

/// How often an entry is begun anew because its inputs are saved while it is baked.
const ATTEMPTS: usize = 3;

/// How long an entry waits for files that were not there a moment ago.
const RETRY_STEP: Duration = Duration::from_millis(100);

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
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
#[derive(Clone, Debug, Serialize, JsonSchema)]
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
    pub error: Option<Failure>,
}

/// What a run over a manifest did.
#[derive(Clone, Debug, Default, Serialize, JsonSchema)]
pub struct LibraryReport {
    /// Where the files are.
    pub output: PathBuf,
    /// Nothing was baked or removed, and no texel read.
    pub dry_run: bool,
    /// The entries, in the manifest's order.
    pub entries: Vec<EntryReport>,
    /// Entries that the cache let go, to stay below its limit.
    pub evicted: usize,
    /// Folders, below the output, of entries that are gone from the manifest and whose files stand there still.
    pub left_over: Vec<PathBuf>,
    /// Those that `--prune` removed, or with `--dry-run` would remove.
    pub pruned: Vec<PathBuf>,
    /// Bytes that the files of entries that were not up to date take beyond those that they replace, as it is known before
    /// they are baked.
    pub space: Space,
    /// What is wrong beside the entries: with the cache, or with room on the disk.
    pub warnings: Vec<String>,
}

impl LibraryReport {
    fn count(&self, status: Status) -> usize {
        self.entries.iter().filter(|entry| entry.status == status).count()
    }

    /// The counts; before them a row for each entry that would be done, with `names_done` each that was, with `verbose` all.
    /// Entries that failed are told after it.
    fn text(&self, verbose: bool, names_done: bool) -> String {
        let planned = |entry: &EntryReport| matches!(entry.status, Status::WouldBake | Status::WouldRestore);
        let done = |entry: &EntryReport| matches!(entry.status, Status::Baked | Status::Restored);
        let shown = |entry: &&EntryReport| {
            planned(entry) || (names_done && done(entry)) || (verbose && entry.status != Status::Failed)
        };
        let rows = self.entries.iter().filter(shown).map(|entry| {
            let bytes: u64 = entry.files.iter().map(|file| file.bytes).sum();
            let size = match entry.files.len() {
                0 => String::new(),
                count => format!("{}, {:.1} KiB", counted(count, "file", "files"), bytes as f64 / 1024.0),
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
        if self.entries.iter().any(planned) {
            text += &format!("the files will take {}\n", space_text(self.space));
            text += "no texel was read: what maps say against their names is told when they are baked\n";
        }
        let named = |folders: &[PathBuf]| {
            let names: Vec<String> = folders.iter().map(|folder| folder.display().to_string()).collect();
            names.join(", ")
        };
        if !self.left_over.is_empty() {
            text += &format!("gone from the manifest, --prune removes them: {}\n", named(&self.left_over));
        }
        if !self.pruned.is_empty() {
            let what = if self.dry_run { "would be removed" } else { "removed" };
            text += &format!("{what}: {}\n", named(&self.pruned));
        }
        text
    }
}

/// What is known of the files that stand in the output: by entry folder.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Standing {
    key: String,
    files: Vec<(StoredFile, Stamp)>,
    /// What was doubtful when they were baked.
    #[serde(default)]
    warnings: Vec<String>,
}

/// A library on its way.
struct Library {
    output: PathBuf,
    cache: Option<Cache>,
    /// Why nothing can be kept in the cache; told once.
    trouble: OnceLock<String>,
    stamps: Stamps,
    standing: Mutex<BTreeMap<PathBuf, Standing>>,
    /// `standing` is not saved yet.
    is_news: AtomicBool,
    saved: Mutex<Instant>,
    /// Folders of files that entries are made from.
    folders: Mutex<BTreeSet<PathBuf>>,
}

/// Bakes what a manifest lists; with `--watch` again and again.
///
/// # Errors
/// [`Error::Manifest`] where it cannot be understood, and [`Error::Entries`] where an entry failed, after all
/// others are done.
pub fn bake_library(args: &Args, console: &Console) -> Result<(), Error> {
    settings::refuse_others(args)?;
    if args.library.watch {
        return watch::watch(args, console);
    }
    let built = build(args, console, &mut Failures::new())?;
    built.tell(console, true)?;
    match built.report.count(Status::Failed) {
        0 => Ok(()),
        failed => Err(Error::Entries { failed, of: built.report.entries.len(), done: !args.dry_run }),
    }
}

/// Entries that cannot be baked as they are now, by folder: their keys, where they have one, and why.
type Failures = BTreeMap<PathBuf, (Option<Key>, Failure)>;

struct Built {
    report: LibraryReport,
    /// Entries that failed, and why, where that was not told before.
    failed: Vec<String>,
    /// Where inputs are, or were.
    folders: BTreeSet<PathBuf>,
}

impl Built {
    /// Whether anything was done or failed.
    fn is_news(&self) -> bool {
        self.report.count(Status::UpToDate) < self.report.entries.len()
    }

    /// Tells what was done, what is doubtful, where `again` also of entries that were up to date, and last what failed. What
    /// a later look baked is named: it is what somebody saved a moment ago.
    fn tell(&self, console: &Console, again: bool) -> Result<(), Error> {
        let told = |entry: &&EntryReport| again || entry.status != Status::UpToDate;
        for entry in self.report.entries.iter().filter(told) {
            for warning in &entry.warnings {
                console.warn(format!("{}: {warning}", entry.name));
            }
        }
        self.report.warnings.iter().for_each(|warning| console.warn(warning));
        console.result(&self.report, &self.report.text(console.verbose, !again))?;
        self.failed.iter().for_each(|failure| console.error(failure));
        Ok(())
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
    let cache = cache_folder(&args.library, manifest.cache.as_deref());
    let library = Library::new(output, cache.as_deref())?;
    let ours = Ours::new(&args.input, &library.output, cache.as_deref(), library.written().into_iter());
    for job in manifest.jobs(&|path| ours.is(path)) {
        match job {
            Ok(job) => {
                let flags = settings::flags(&manifest, &job)?;
                entries.push(EntryReport::new(&job));
                work.push((entries.len() - 1, job, flags));
            }
            Err(error) => entries.push(EntryReport::missing(&error)),
        }
    }

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
            Err(error) => entries[at].fail(failure(&job, &error)),
            Ok(key) => match library.standing(&job, &key) {
                Some((files, warnings)) => {
                    entries[at] = EntryReport { files, warnings, ..EntryReport::new(&job) };
                }
                None => match failures.get(&job.folder) {
                    Some((Some(known), why)) if *known == key => entries[at].fail(why.clone()),
                    _ => todo.push((at, key, job, flags)),
                },
            },
        }
    }
    let (spaces, units): (Vec<Space>, Vec<u64>) = library.plan(&todo).into_iter().unzip();
    let mut space = Space::default();
    spaces.into_iter().for_each(|of_entry| space.add(of_entry));
    if args.dry_run {
        for (at, key, ..) in &todo {
            let cached = library.cache.as_ref().is_some_and(|cache| cache.get(key).is_some());
            entries[*at].status = if cached { Status::WouldRestore } else { Status::WouldBake };
        }
        let gone = library.gone(&entries);
        let (left_over, pruned) = if args.library.prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
        let report =
            LibraryReport { dry_run: true, entries, left_over, pruned, space, ..LibraryReport::default() };
        let why = |entry: &EntryReport| Some(format!("{}: {}", entry.name, entry.error.as_ref()?.message));
        let failed = report.entries.iter().filter_map(why).collect();
        return Ok(library.built(report, failed));
    }
    let tight = check_space(&library.output, space)?;
    if !todo.is_empty() {
        library.prepare_cache();
    }

    // Bake the rest, some at a time. Threads of their own and not tasks of the pool: a thread of the pool that
    // waits for a part of one entry would begin another one meanwhile, and hold both in memory.
    let bars = console.progress();
    let stage = bars.stage("baking", units.iter().sum());
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, EntryReport, Key)>> = Mutex::new(Vec::new());
    let threads = args.library.jobs.map_or_else(rayon::current_num_threads, usize::from).min(todo.len());
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let turn = next.fetch_add(1, Ordering::Relaxed);
                    let Some((at, key, job, flags)) = todo.get(turn) else { break };
                    let (mut entry, mut key) = (EntryReport::new(job), *key);
                    match library.make(job, &mut key, flags, &bars, &mut entry) {
                        Ok(status) => entry.status = status,
                        Err(error) => entry.fail(failure(job, &error)),
                    }
                    lock(&done).push((*at, entry, key));
                    stage.add(units[turn]);
                }
            });
        }
    });
    drop(stage);
    let mut keys: BTreeMap<PathBuf, Key> = BTreeMap::new();
    for (at, entry, key) in done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        keys.insert(entry.folder.clone(), key);
        entries[at] = entry;
    }
    let gone = library.gone(&entries);
    let (left_over, pruned) = if args.library.prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
    library.prune(&pruned, console)?;
    library.save()?;
    let limit = manifest.cache_limit.unwrap_or(CACHE_LIMIT);
    let evicted = if todo.is_empty() { 0 } else { library.evict(limit) };

    // Tell what went wrong once.
    failures.retain(|folder, _| entries.iter().any(|e| e.folder == *folder && e.status == Status::Failed));
    let mut failed = Vec::new();
    for entry in &entries {
        let Some(error) = &entry.error else { continue };
        if failures.get(&entry.folder).is_none_or(|(_, why)| why.message != error.message) {
            failed.push(format!("{}: {}", entry.name, error.message));
        }
        // Without a key it is looked at again and again, until it has one.
        let key = keys.get(&entry.folder).or_else(|| failures.get(&entry.folder)?.0.as_ref()).copied();
        failures.insert(entry.folder.clone(), (key, error.clone()));
    }
    let warnings = tight.into_iter().collect();
    let report =
        LibraryReport { entries, evicted, left_over, pruned, space, warnings, ..LibraryReport::default() };
    Ok(library.built(report, failed))
}

/// Why a job failed, with the keys of the manifest beside the flags that it is told of.
fn failure(job: &Job, error: &Error) -> Failure {
    let failure = Failure::of(error);
    Failure { message: settings::with_keys(job.kind, &failure.message), ..failure }
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
            error: Some(Failure {
                code: "manifest",
                message: error.message.clone(),
                file: Some(error.path.clone()),
                flag: None,
                line: Some(error.line),
                column: Some(error.column),
                exit_code: 2,
            }),
        }
    }

    fn fail(&mut self, error: Failure) {
        self.status = Status::Failed;
        self.error = Some(error);
    }
}

/// `--cache`, `KINRAN_CACHE`, the manifest's, or the user's folder for such things; nothing where there is no user.
pub fn cache_folder(args: &LibraryArgs, manifest: Option<&Path>) -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    (args.cache.clone())
        .or_else(|| variable("KINRAN_CACHE"))
        .or_else(|| manifest.map(Path::to_path_buf))
        .or_else(|| Some(variable("XDG_CACHE_HOME")?.join("kinran")))
        .or_else(|| Some(variable("LOCALAPPDATA")?.join("kinran").join("cache")))
        .or_else(|| Some(variable("HOME")?.join(".cache").join("kinran")))
}

/// The folder in the output with what is known of it.
const STATE: &str = ".kinran";

/// Where an entry's files are.
enum Source<'a> {
    Cache(&'a Cache, &'a Key),
    /// A folder of work, which they may leave.
    Work(&'a Path),
}

impl Library {
    fn new(output: PathBuf, cache: Option<&Path>) -> Result<Self, Error> {
        let state = output.join(STATE);
        let standing = std::fs::read(state.join("standing.json")).ok();
        let standing = standing.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let mut standing: BTreeMap<PathBuf, Standing> = standing.unwrap_or_default();
        // Files are removed by what stands there: none outside of the output.
        standing.retain(|folder, standing| {
            let names = standing.files.iter().map(|(file, _)| file.name.as_str());
            folder.to_str().into_iter().chain(names).all(|name| relative(name).is_some())
        });
        Ok(Library {
            cache: cache.map(Cache::open).transpose()?,
            trouble: OnceLock::new(),
            stamps: Stamps::load(&state.join("inputs.json")),
            standing: Mutex::new(standing),
            is_news: AtomicBool::new(false),
            saved: Mutex::new(Instant::now()),
            folders: Mutex::default(),
            output,
        })
    }

    fn state(&self) -> PathBuf {
        self.output.join(STATE)
    }

    /// What a run over it did: the report but for what is known here.
    fn built(self, mut report: LibraryReport, failed: Vec<String>) -> Built {
        report.warnings.extend(self.trouble.into_inner());
        report.output = self.output;
        let folders = self.folders.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        Built { report, failed, folders }
    }

    /// The files that earlier runs wrote.
    fn written(&self) -> Vec<PathBuf> {
        let standing = lock(&self.standing);
        let files = |(folder, standing): (&PathBuf, &Standing)| {
            let folder = self.output.join(folder);
            standing.files.iter().map(|(file, _)| folder.join(&file.name)).collect::<Vec<_>>()
        };
        standing.iter().flat_map(files).collect()
    }

    /// Hash of all that an entry's files depend on, as they are now.
    fn key(&self, job: &Job, flags: &Flags) -> Result<Key, Error> {
        let sources = Sources::of(job, flags, &|model| {
            self.stamps.refers_to(model, |bytes| -> Result<_, Error> {
                Ok(Document::from_bytes(model, bytes)?.files())
            })
        })?;
        let folders = sources.files.iter().filter_map(|(_, file)| file.parent()).map(Path::to_path_buf);
        lock(&self.folders).extend(folders);
        sources.key(&|path| Ok(self.stamps.hash(path)?))
    }

    /// Finds out before anything is baked whether it can be kept.
    fn prepare_cache(&self) {
        match &self.cache {
            Some(cache) => self.complain(cache.prepare().err()),
            None => drop(self.trouble.set(
                "there is no HOME to keep finished work in, so that nothing is kept; name a folder with --cache".into(),
            )),
        }
    }

    /// A cache that fails is no reason not to bake.
    fn complain(&self, error: Option<kinran_image::Error>) {
        if let Some(error) = error {
            // The first complaint is enough.
            let _ = self
                .trouble
                .set(format!("what is baked is not kept, since the cache cannot be used: {error}"));
        }
    }

    /// Makes room in the cache; tells how many entries went.
    fn evict(&self, limit: u64) -> usize {
        match self.cache.as_ref().filter(|_| self.trouble.get().is_none()).map(|cache| cache.evict(limit)) {
            None => 0,
            Some(Ok((count, _))) => count,
            Some(Err(error)) => {
                self.complain(Some(error));
                0
            }
        }
    }

    /// Of each entry the bytes that its files will take beyond those that they replace, and its share of the work: what it
    /// writes, and next to nothing where that is kept. Of an entry that cannot be read nothing, since its error is told when
    /// its turn comes.
    fn plan(&self, todo: &[(usize, Key, Job, Flags)]) -> Vec<(Space, u64)> {
        let of_entry = |(_, key, job, flags): &(usize, Key, Job, Flags)| {
            let cached = self.cache.as_ref().and_then(|cache| cache.get(key));
            let input = || job.input.clone();
            let kept = cached.is_some();
            let needed = match (cached, flags) {
                (Some(entry), _) => Space::exact(entry.files.iter().map(|file| file.bytes).sum()),
                (None, Flags::Bake(flags)) => {
                    let args = Args { input: input(), ..(**flags).clone() };
                    let space = if job.kind == Kind::Mesh { gltf::space } else { folder::space };
                    space(&args).unwrap_or_default()
                }
                (None, Flags::Detail(flags)) => {
                    detail::space(&SolveArgs { target: input(), ..(**flags).clone() })
                }
                (None, Flags::Skin(flags)) => skin_lut::space(flags),
            };
            let standing = lock(&self.standing).get(&job.folder).cloned().unwrap_or_default();
            let units = if kept { 1 } else { needed.most.max(1) };
            (needed.beyond(standing.files.iter().map(|(file, _)| file.bytes).sum()), units)
        };
        todo.par_iter().map(of_entry).collect()
    }

    /// The files of an entry, if they stand in the output as they were written, and what was doubtful about them.
    fn standing(&self, job: &Job, key: &Key) -> Option<(Vec<StoredFile>, Vec<String>)> {
        let standing = lock(&self.standing).get(&job.folder).cloned()?;
        let folder = self.output.join(&job.folder);
        let stands =
            |(file, stamp): &(StoredFile, Stamp)| Stamp::of(&folder.join(&file.name)).as_ref() == Some(stamp);
        let whole = standing.key == key.hex() && standing.files.iter().all(stands);
        whole.then(|| (standing.files.into_iter().map(|(file, _)| file).collect(), standing.warnings))
    }

    /// Brings an entry's files to the output, from the cache or by baking them. `key` becomes that of what was baked, where
    /// the inputs have changed meanwhile.
    fn make(
        &self,
        job: &Job,
        key: &mut Key,
        flags: &Flags,
        bars: &Progress,
        report: &mut EntryReport,
    ) -> Result<Status, Error> {
        if let Some(status) = self.restore(job, key, report)? {
            return Ok(status);
        }
        for attempt in 1.. {
            let is_last = attempt == ATTEMPTS;
            let snapshot = match Snapshot::take(&self.state(), job, flags) {
                Err(error) if is_last => return Err(error),
                Err(_) => {
                    std::thread::sleep(RETRY_STEP);
                    continue;
                }
                Ok(snapshot) => snapshot,
            };
            if std::mem::replace(key, snapshot.key) != snapshot.key
                && let Some(status) = self.restore(job, key, report)?
            {
                return Ok(status);
            }
            match self.bake(job, &snapshot, bars, report) {
                // What cannot be baked may have been a file half saved.
                Err(_) if !is_last && self.key(job, flags).ok() != Some(*key) => {}
                result => return result,
            }
        }
        unreachable!("the last attempt returns")
    }

    /// Copies an entry's files from the cache, if it has them.
    fn restore(&self, job: &Job, key: &Key, report: &mut EntryReport) -> Result<Option<Status>, Error> {
        let Some(cache) = &self.cache else { return Ok(None) };
        let Some(entry) = cache.get(key) else { return Ok(None) };
        match self.place(job, key, &entry, Source::Cache(cache, key), report)? {
            Some(0) => Ok(Some(Status::UpToDate)),
            Some(_) => Ok(Some(Status::Restored)),
            None => {
                // What is damaged is in the way.
                self.complain(cache.remove(key).err());
                Ok(None)
            }
        }
    }

    /// Bakes an entry, keeps it, and moves its files to the output.
    fn bake(
        &self,
        job: &Job,
        snapshot: &Snapshot,
        bars: &Progress,
        report: &mut EntryReport,
    ) -> Result<Status, Error> {
        let work = WorkFolder::new(&self.state())?;
        let warnings = bake_into(work.path(), job, snapshot, bars)?;
        let entry = Entry::of(work.path(), &job.name, serde_json::json!(warnings))?;
        if let Some(cache) = self.cache.as_ref().filter(|_| self.trouble.get().is_none()) {
            self.complain(cache.publish(&snapshot.key, work.path(), &entry).err());
        }
        self.place(job, &snapshot.key, &entry, Source::Work(work.path()), report)?;
        Ok(Status::Baked)
    }

    /// Brings an entry's files to the output, those that are not there yet, and tells how many those were; nothing
    /// where the cache has lost one.
    fn place(
        &self,
        job: &Job,
        key: &Key,
        entry: &Entry,
        source: Source,
        report: &mut EntryReport,
    ) -> Result<Option<usize>, Error> {
        let folder = self.output.join(&job.folder);
        let scratch = WorkFolder::new(&self.state())?;
        let (mut files, mut copied) = (Vec::new(), 0);
        for file in &entry.files {
            let Some(name) = relative(&file.name) else { return Ok(None) };
            let path = folder.join(&name);
            if !is_already(&path, file) {
                let bytes = match source {
                    Source::Cache(cache, key) => match cache.read(key, file) {
                        Some(bytes) => Some(bytes),
                        None => return Ok(None),
                    },
                    Source::Work(_) => None,
                };
                refuse_input(job, &path)?;
                if let Some(parent) = path.parent() {
                    kinran_image::make_folder(parent)?;
                }
                match (&source, bytes) {
                    (Source::Work(work), _) => move_file(&work.join(&name), &path)?,
                    (_, Some(bytes)) => write_over(scratch.path(), &path, &bytes)?,
                    (_, None) => return Ok(None),
                }
                copied += 1;
            }
            if let Some(stamp) = Stamp::of(&path) {
                files.push((file.clone(), stamp));
            }
        }
        report.files.clone_from(&entry.files);
        report.warnings = serde_json::from_value(entry.report.clone()).unwrap_or_default();

        // What an earlier run left there under other names is of no use.
        let standing = Standing { key: key.hex(), files, warnings: report.warnings.clone() };
        let old = lock(&self.standing).insert(job.folder.clone(), standing);
        self.is_news.store(true, Ordering::Relaxed);
        for (file, stamp) in old.into_iter().flat_map(|old| old.files) {
            let path = folder.join(&file.name);
            let kept = entry.files.iter().any(|new| new.name == file.name);
            if !kept && self.is_mine(&path, &file, &stamp) {
                std::fs::remove_file(&path).map_err(|e| kinran_image::Error::io(&path, e))?;
            }
        }
        if lock(&self.saved).elapsed() > SAVE_STEP {
            self.save()?;
        }
        Ok(Some(copied))
    }

    /// Whether a file is the one that this program wrote there: it is no link, no link leads to it, and it looks as it did
    /// or holds what it held.
    fn is_mine(&self, path: &Path, file: &StoredFile, stamp: &Stamp) -> bool {
        let mut way = path.ancestors().take_while(|part| *part != self.output);
        let no_link = way.all(|part| !part.is_symlink());
        no_link && (Stamp::of(path).as_ref() == Some(stamp) || is_already(path, file))
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
                let written = path.join(&file.name);
                if self.is_mine(&written, &file, &stamp) {
                    std::fs::remove_file(&written).map_err(|e| kinran_image::Error::io(&written, e))?;
                } else if written.exists() {
                    console.warn(format!("{}: was changed and stays", written.display()));
                }
            }
            self.is_news.store(true, Ordering::Relaxed);
            let inside = path.ancestors().take_while(|inside| *inside != self.output);
            // A folder that holds anything stays.
            inside.take_while(|inside| std::fs::remove_dir(inside).is_ok()).for_each(drop);
            if path.exists() {
                console.warn(format!("{}: holds what kinran did not write, and stays", path.display()));
            }
        }
        Ok(())
    }

    /// Saves what is known of inputs and output, so that the next run need not look at their bytes.
    fn save(&self) -> Result<(), Error> {
        let state = self.state();
        kinran_image::make_folder(&state)?;
        *lock(&self.saved) = Instant::now();
        self.stamps.save(&state.join("inputs.json"))?;
        if self.is_news.swap(false, Ordering::Relaxed) {
            let json =
                serde_json::to_vec(&*lock(&self.standing)).map_err(|e| Error::Internal(e.to_string()))?;
            write_atomically(&state.join("standing.json"), &json)?;
        }
        Ok(())
    }
}

/// Bakes a copy into a folder; gives the warnings. Errors and warnings are about the originals.
fn bake_into(output: &Path, job: &Job, snapshot: &Snapshot, bars: &Progress) -> Result<Vec<String>, Error> {
    let silent = Console { quiet: true, bars: Some(bars.of(&job.name)), ..Console::default() };
    let (input, output) = (snapshot.job.input.clone(), output.to_path_buf());
    let of = |reports: Vec<Report>| reports.into_iter().flat_map(|report| report.warnings).collect();
    let warnings: Result<Vec<String>, Error> = match &snapshot.flags {
        Flags::Bake(flags) => {
            let flags = Args { input, output: Some(output), is_copy: true, ..(**flags).clone() };
            match job.kind {
                Kind::Mesh => gltf::bake_gltf(&flags, &silent).map(|report| of(vec![report])),
                _ => folder::understand(&flags)
                    .and_then(|understood| folder::bake_folder(&flags, &understood, &silent))
                    .map(of),
            }
        }
        Flags::Detail(flags) => {
            let flags = SolveArgs { target: input, output: Some(output), ..(**flags).clone() };
            solve_target(&flags, &silent).map(|report| report.warnings)
        }
        Flags::Skin(flags) => {
            skin_lut::run(&skin_lut::Args { output: Some(output), ..(**flags).clone() }, &silent)
                .map(|()| Vec::new())
        }
    };
    let warnings = warnings.map_err(|e| snapshot.as_about_originals(e.about(&snapshot.job.input)))?;
    let told = |warning: &String| settings::with_keys(job.kind, &snapshot.original_names(warning));
    Ok(warnings.iter().map(told).collect())
}

/// Moves a finished file, also to another disk.
fn move_file(from: &Path, to: &Path) -> Result<(), Error> {
    match std::fs::rename(from, to) {
        Err(e) if e.kind() == ErrorKind::CrossesDevices => {
            let bytes = std::fs::read(from).map_err(|e| kinran_image::Error::io(from, e))?;
            Ok(write_atomically(to, &bytes)?)
        }
        moved => Ok(moved.map_err(|e| kinran_image::Error::io(to, e))?),
    }
}

/// Writes a file by way of a scratch folder, also to another disk.
fn write_over(scratch: &Path, path: &Path, bytes: &[u8]) -> Result<(), Error> {
    match write_atomically_in(scratch, path, bytes) {
        Err(kinran_image::Error::Io { source, .. }) if source.kind() == ErrorKind::CrossesDevices => {
            Ok(write_atomically(path, bytes)?)
        }
        written => Ok(written?),
    }
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
        let reason = "lies among the inputs and would be overwritten; choose another `output`";
        return Err(Error::file_error(path, reason));
    }
    Ok(())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

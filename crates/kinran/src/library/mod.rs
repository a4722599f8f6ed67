//! A library on a disk: what a `kinran.toml` lists, baked in parallel, each thing once.
//!
//! What has not changed is not looked at twice: finished work is kept in a cache, by the hash of what it was made from. A
//! [`Library`] says which entries there are, who calls says how each is baked (a [`Plan`]), and [`Library::look`] finds out what
//! there is to do before anything is done. A worker elsewhere makes one entry by [`Plan::bake`].
//!
//! ```
//! use kinran::bake::FolderOptions;
//! use kinran::library::{BakeOptions, JobOptions, Library, Manifest, Plan, Status};
//! use kinran::Task;
//! # use kinran_image::{Channels, Image, Pixels, encode_png};
//! # let home = tempfile::tempdir()?;
//! # let texels = (0..16 * 16).flat_map(|i| [100 + (i % 16) as u8, 128, 250]).collect();
//! # let png = encode_png(&Image::new(16, 16, Channels::Rgb, Pixels::U8(texels))?)?;
//! # std::fs::create_dir_all(home.path().join("materials/brass"))?;
//! # std::fs::write(home.path().join("materials/brass/brass_normal.png"), png)?;
//!
//! let text = "[[aniso]]\ninput = \"materials/*\"\n";
//! let manifest = Manifest::parse(&home.path().join("kinran.toml"), text.into())?;
//! let bake = || -> Result<_, Box<dyn std::error::Error>> {
//!     let library = Library::open(&manifest.output, None)?;
//!     let jobs = library.jobs(&manifest);
//!     let plan = |job| Plan::new(job, JobOptions::Folder(FolderOptions::default()));
//!     let plans = jobs.into_iter().map(|job| job.map(plan)).collect();
//!     Ok(library.look(plans, &|_, _| false, Task::QUIET)?.bake(&BakeOptions::default(), Task::QUIET)?)
//! };
//! assert_eq!(bake()?.entries[0].status, Status::Baked);
//! assert_eq!(bake()?.entries[0].status, Status::UpToDate);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod inputs;
mod ours;
mod output;
mod plan;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use self::inputs::Snapshot;
use crate::skin::Plot;
use crate::{Error, Progress, Space, Stage, Task};

pub use kinran_bake::cache::{Cache, Key, StoredFile};
pub use kinran_bake::manifest::{Job, Kind, Manifest, ManifestError, Setting, SettingValue};
pub use ours::STATE;
pub use output::Library;
pub use plan::{JobOptions, Plan};

/// Bytes that a cache may hold where nothing says otherwise; chosen by eye: a few hundred 4096² materials.
pub const CACHE_LIMIT: u64 = 20 << 30;

/// How often an entry is begun anew because its inputs are saved while it is baked.
const ATTEMPTS: usize = 3;

/// How long an entry waits for files that were not there a moment ago.
const RETRY_STEP: Duration = Duration::from_millis(100);

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
    /// It is not up to date, and would be baked.
    WouldBake,
    /// It is not up to date, and would come from the cache.
    WouldRestore,
    /// It could not be baked.
    Failed,
}

/// One entry of a manifest.
#[derive(Debug)]
#[non_exhaustive]
pub struct EntryReport {
    /// The input, as a person would name it.
    pub name: String,
    /// Where the input is.
    pub input: PathBuf,
    /// What it is; none of one that is not there.
    pub kind: Option<Kind>,
    /// The folder of its files, below the output.
    pub folder: PathBuf,
    /// What became of it.
    pub status: Status,
    /// What its files were made from, where that is known.
    pub key: Option<Key>,
    /// Its files.
    pub files: Vec<StoredFile>,
    /// What was assumed or left out while it was baked.
    pub warnings: Vec<String>,
    /// Why it failed; also none where the caller knows it already.
    pub error: Option<Error>,
}

/// What a run over a manifest did.
#[derive(Debug)]
#[non_exhaustive]
pub struct LibraryReport {
    /// Where the files are.
    pub output: PathBuf,
    /// The entries, in the manifest's order.
    pub entries: Vec<EntryReport>,
    /// Entries that the cache let go, to stay below its limit.
    pub evicted: usize,
    /// Folders, below the output, of entries that are gone from the manifest and whose files stand there still.
    pub left_over: Vec<PathBuf>,
    /// Those that were removed, or would be.
    pub pruned: Vec<PathBuf>,
    /// Bytes that the files of entries that were not up to date take beyond those that they replace, as it is known before
    /// they are baked.
    pub space: Space,
    /// What is wrong beside the entries, such as with the cache.
    pub warnings: Vec<String>,
    /// Folders of the files that entries are made from.
    pub folders: BTreeSet<PathBuf>,
}

/// How a library is baked.
#[derive(Clone, Copy, Default)]
#[non_exhaustive]
pub struct BakeOptions<'a> {
    /// Entries that are baked at the same time; one for each thread of the pool by default.
    pub jobs: Option<usize>,
    /// Whether files of entries that are gone from the manifest are removed, those that nobody has changed.
    pub prune: bool,
    /// Bytes that the cache may hold; [`CACHE_LIMIT`] by default.
    pub cache_limit: Option<u64>,
    /// Draws tables of skin.
    pub plot: Option<Plot<'a>>,
}

impl std::fmt::Debug for BakeOptions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let BakeOptions { jobs, prune, cache_limit, plot } = self;
        f.debug_struct("BakeOptions")
            .field("jobs", jobs)
            .field("prune", prune)
            .field("cache_limit", cache_limit)
            .field("plot", &plot.is_some())
            .finish()
    }
}

/// What there is to do in a library, before anything is done.
#[derive(Debug)]
#[non_exhaustive]
pub struct Looked {
    library: Library,
    /// All entries; those that are to be baked are not told of yet.
    entries: Vec<EntryReport>,
    todo: Vec<Todo>,
    /// Bytes that the files of what is to be baked take beyond those that they replace; of an entry that cannot be read
    /// nothing, since its error is told when its turn comes.
    pub space: Space,
}

/// An entry that is not up to date.
#[derive(Debug)]
struct Todo {
    /// Which of the entries.
    at: usize,
    key: Key,
    plan: Plan,
    /// Its share of the work, as [`Stage::Baking`] counts it.
    units: u64,
}

impl Library {
    /// Finds out which entries are up to date. One that `is_known` is told to have failed with the key that it has now is not
    /// tried again, and fails without a reason.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn look(
        self,
        plans: Vec<Result<Plan, ManifestError>>,
        is_known: &dyn Fn(&Path, &Key) -> bool,
        task: Task<'_>,
    ) -> Result<Looked, Error> {
        let mut entries = Vec::new();
        let mut work: Vec<(usize, Plan)> = Vec::new();
        for plan in plans {
            match plan {
                Ok(plan) => {
                    entries.push(EntryReport::new(&plan.job));
                    work.push((entries.len() - 1, plan));
                }
                Err(error) => entries.push(EntryReport::missing(error)),
            }
        }
        let checking = task.begin(Stage::Checking, "", work.len() as u64)?;
        let keys = work.par_iter().map(|(_, plan)| {
            let key = self.key(plan);
            checking.tick(1)?;
            Ok(key)
        });
        let keys: Vec<Result<Key, Error>> = keys.collect::<Result<_, Error>>()?;
        drop(checking);
        let mut todo: Vec<Todo> = Vec::new();
        for ((at, plan), key) in work.into_iter().zip(keys) {
            let entry = &mut entries[at];
            match key {
                Err(error) => entry.fail(Some(error)),
                Ok(key) => {
                    entry.key = Some(key);
                    match self.standing(&plan.job, &key) {
                        Some((files, warnings)) => (entry.files, entry.warnings) = (files, warnings),
                        None if is_known(&plan.job.folder, &key) => entry.fail(None),
                        None => todo.push(Todo { at, key, plan, units: 0 }),
                    }
                }
            }
        }
        let found: Vec<(Space, u64)> =
            todo.par_iter().map(|todo: &Todo| self.plan(&todo.plan, &todo.key)).collect();
        let mut space = Space::default();
        for (todo, (of_entry, units)) in todo.iter_mut().zip(found) {
            space.add(of_entry);
            todo.units = units;
        }
        Ok(Looked { library: self, entries, todo, space })
    }
}

impl Looked {
    /// Where the files go.
    pub fn output(&self) -> &Path {
        self.library.output()
    }

    /// What would be done; `prune` as in [`BakeOptions`].
    pub fn planned(mut self, prune: bool) -> LibraryReport {
        for Todo { at, key, .. } in &self.todo {
            let is_kept = self.library.keeps(key);
            self.entries[*at].status = if is_kept { Status::WouldRestore } else { Status::WouldBake };
        }
        let gone = self.library.gone(&self.entries);
        let (left_over, pruned) = if prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
        self.library.report(self.entries, self.space, left_over, pruned)
    }

    /// Bakes what is not up to date.
    ///
    /// # Errors
    /// Where the output cannot be written, or [`Error::Cancelled`]: what is finished by then is whole, kept and known to the
    /// next run. Errors of entries are in the report.
    pub fn bake(self, how: &BakeOptions<'_>, task: Task<'_>) -> Result<LibraryReport, Error> {
        let Looked { library, mut entries, todo, space } = self;
        if !todo.is_empty() {
            library.prepare_cache();
        }
        // Threads of their own and not tasks of the pool: a thread of the pool that waits for a part of one entry would begin
        // another one meanwhile, and hold both in memory.
        let baking = task.begin(Stage::Baking, "", todo.iter().map(|todo| todo.units).sum())?;
        let next = AtomicUsize::new(0);
        let done: Mutex<Vec<(usize, EntryReport)>> = Mutex::new(Vec::new());
        let threads = how.jobs.unwrap_or_else(rayon::current_num_threads).min(todo.len());
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    while let Some(Todo { at, key, plan, units }) =
                        todo.get(next.fetch_add(1, Ordering::Relaxed))
                    {
                        let mut entry = EntryReport { key: Some(*key), ..EntryReport::new(&plan.job) };
                        match library.make(plan, how.plot, task, &mut entry) {
                            Ok(status) => entry.status = status,
                            Err(error) => entry.fail(Some(error)),
                        }
                        lock(&done).push((*at, entry));
                        if baking.tick(*units).is_err() {
                            break;
                        }
                    }
                });
            }
        });
        drop(baking);
        if task.cancel.is_cancelled() {
            library.save()?;
            return Err(Error::Cancelled);
        }
        for (at, entry) in done.into_inner().unwrap_or_else(PoisonError::into_inner) {
            entries[at] = entry;
        }
        let gone = library.gone(&entries);
        let (left_over, pruned) = if how.prune { (Vec::new(), gone) } else { (gone, Vec::new()) };
        let stayed = library.prune(&pruned)?;
        library.save()?;
        let limit = how.cache_limit.unwrap_or(CACHE_LIMIT);
        let evicted = if todo.is_empty() { 0 } else { library.evict(limit) };
        let mut report = library.report(entries, space, left_over, pruned);
        report.warnings.splice(0..0, stayed);
        report.evicted = evicted;
        Ok(report)
    }
}

impl Library {
    /// Brings an entry's files to the output, from the cache or by baking them. The key becomes that of what was baked, where
    /// the inputs have changed meanwhile.
    fn make(
        &self,
        plan: &Plan,
        plot: Option<Plot<'_>>,
        task: Task<'_>,
        entry: &mut EntryReport,
    ) -> Result<Status, Error> {
        if let Some(status) = self.restore(&plan.job, entry)? {
            return Ok(status);
        }
        for attempt in 1.. {
            let is_last = attempt == ATTEMPTS;
            let (snapshot, key) = match Snapshot::take(&self.state(), plan) {
                Err(error) if is_last => return Err(error),
                Err(_) => {
                    std::thread::sleep(RETRY_STEP);
                    continue;
                }
                Ok(taken) => taken,
            };
            if entry.key.replace(key) != Some(key)
                && let Some(status) = self.restore(&plan.job, entry)?
            {
                return Ok(status);
            }
            // Who watches hears which entry it is.
            let tell = |told: Progress<'_>| (task.tell)(Progress { entry: &plan.job.name, ..told });
            let of_entry = Task { tell: &tell, cancel: task.cancel };
            match self.bake(plan, &snapshot, key, plot, of_entry, entry) {
                Err(Error::Cancelled) => return Err(Error::Cancelled),
                // What cannot be baked may have been a file half saved.
                Err(_) if !is_last && self.key(plan).ok() != Some(key) => {}
                result => return result.map(|()| Status::Baked),
            }
        }
        unreachable!("the last attempt returns")
    }
}

impl EntryReport {
    fn new(job: &Job) -> Self {
        EntryReport {
            name: job.name.clone(),
            input: job.input.clone(),
            kind: Some(job.kind),
            folder: job.folder.clone(),
            status: Status::UpToDate,
            key: None,
            files: Vec::new(),
            warnings: Vec::new(),
            error: None,
        }
    }

    /// An input that is not there.
    fn missing(error: ManifestError) -> Self {
        let name = format!("{}:{}:{}", crate::names::file_name(&error.path), error.line, error.column);
        EntryReport {
            folder: PathBuf::from(&name),
            name,
            input: error.path.clone(),
            kind: None,
            status: Status::Failed,
            key: None,
            files: Vec::new(),
            warnings: Vec::new(),
            error: Some(error.into()),
        }
    }

    fn fail(&mut self, error: Option<Error>) {
        self.status = Status::Failed;
        self.error = error;
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

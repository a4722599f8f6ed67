//! A library: what a `kinran.toml` lists, baked in parallel, each thing once.

mod watch;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use kinran::library::{
    BakeOptions, Job, Key, Kind, Library, Manifest, ManifestError, Plan, Status, StoredFile,
};
use kinran::{Space, Task};
use schemars::JsonSchema;
use serde::Serialize;

use super::{Args, settings};
use crate::outputs::{check_folder, check_space, space_text};
use crate::progress::Bars;
use crate::skin_lut;
use crate::table::list;
use crate::values::counted;
use crate::{Console, Error, Failure};

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

/// A status in words.
fn name(status: Status) -> &'static str {
    match status {
        Status::UpToDate => "up to date",
        Status::Restored => "from cache",
        Status::Baked => "baked",
        Status::WouldBake => "to be baked",
        Status::WouldRestore => "in the cache",
        Status::Failed => "failed",
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
#[derive(Clone, Debug, Serialize, JsonSchema)]
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
            vec![entry.name.clone(), name(entry.status).into(), entry.folder.display().to_string(), size]
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
            .map(|status| format!("{} {}", self.count(status), name(status)))
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
    let bars = Bars::new(console.progress());
    let built = build(args, bars.task(), &mut Failures::new())?;
    drop(bars);
    built.tell(console, true)?;
    match built.report.count(Status::Failed) {
        0 => Ok(()),
        failed => Err(Error::Entries { failed, of: built.report.entries.len(), done: !args.dry_run }),
    }
}

/// Bakes what a manifest lists and gives the report, for programs that print nothing; `words` are flags of `kinran bake` that
/// say what a run does, such as `--dry-run`.
///
/// # Errors
/// Those of [`bake_library`], but for entries that failed, which the report tells.
pub fn library_report(manifest: &Path, words: &[String], task: Task<'_>) -> Result<LibraryReport, Error> {
    let args = settings::args_of_run(manifest, words)?;
    Ok(build(&args, task, &mut Failures::new())?.report)
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

fn build(args: &Args, task: Task<'_>, failures: &mut Failures) -> Result<Built, Error> {
    let manifest = Manifest::read(&args.input)?;
    let output = args.output.clone().unwrap_or_else(|| manifest.output.clone());
    if !args.dry_run {
        check_folder(&output)?;
    }
    let cache = cache_folder(&args.library, manifest.cache.as_deref());
    let library = Library::open(output, cache.as_deref())?;
    let plan = |job: Job| -> Result<Plan, ManifestError> {
        let how = settings::options(&manifest, &job)?;
        Ok(Plan::new(job, how))
    };
    let mut plans = Vec::new();
    for job in library.jobs(&manifest) {
        // An input that is not there stops nobody else; what is wrong with flags is wrong with the manifest.
        plans.push(match job {
            Ok(job) => Ok(plan(job)?),
            Err(error) => Err(error),
        });
    }

    let is_known =
        |folder: &Path, key: &Key| matches!(failures.get(folder), Some((Some(known), _)) if known == key);
    let looked = library.look(plans, &is_known, task)?;
    let mut tight = None;
    let done = if args.dry_run {
        looked.planned(args.library.prune)
    } else {
        tight = check_space(looked.output(), looked.space)?;
        let mut how = BakeOptions::default();
        (how.jobs, how.prune) = (args.library.jobs.map(usize::from), args.library.prune);
        how.cache_limit = manifest.cache_limit;
        how.plot = Some(&skin_lut::draw);
        looked.bake(&how, task)?
    };

    // Tell what went wrong once.
    let mut failed = Vec::new();
    let mut before = std::mem::take(failures);
    let mut entries = Vec::new();
    for entry in done.entries {
        let known = before.remove(&entry.folder);
        let told = |warning: String| match entry.kind {
            Some(kind) => settings::with_keys(kind, &warning),
            None => warning,
        };
        let error = match entry.error {
            Some(error) => {
                let failure = Failure::of(&Error::from(error).about(&entry.input));
                Some(Failure { message: told(failure.message), ..failure })
            }
            None => known.as_ref().map(|(_, why)| why.clone()).filter(|_| entry.status == Status::Failed),
        };
        if let Some(error) = &error {
            let is_news = known.as_ref().is_none_or(|(_, why)| why.message != error.message);
            if is_news || args.dry_run {
                // What is wrong in the manifest names its place itself.
                failed.push(match entry.kind {
                    Some(_) => format!("{}: {}", entry.name, error.message),
                    None => error.message.clone(),
                });
            }
            // Without a key it is looked at again and again, until it has one.
            let key = entry.key.or(known.and_then(|(key, _)| key));
            failures.insert(entry.folder.clone(), (key, error.clone()));
        }
        entries.push(EntryReport {
            name: entry.name,
            kind: entry.kind,
            folder: entry.folder,
            status: entry.status,
            files: entry.files,
            warnings: entry.warnings.into_iter().map(told).collect(),
            error,
        });
    }
    let report = LibraryReport {
        output: done.output,
        dry_run: args.dry_run,
        entries,
        evicted: done.evicted,
        left_over: done.left_over,
        pruned: done.pruned,
        space: done.space,
        warnings: tight.into_iter().chain(done.warnings).collect(),
    };
    Ok(Built { report, failed, folders: done.folders })
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

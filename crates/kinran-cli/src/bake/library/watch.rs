//! `--watch`: waits for the system to tell that something was saved, and bakes again.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use kinran::library::{Manifest, STATE};
use notify::event::{AccessKind, AccessMode, EventKind};
use notify::{Event, RecommendedWatcher, RecursiveMode, Watcher};

use super::{Failures, build, cache_folder};
use crate::bake::Args;
use crate::progress::Bars;
use crate::{Console, Error};

/// Quiet after a change before it is baked: programs save in several steps, and several files. Chosen by eye.
const QUIET: Duration = Duration::from_millis(150);

/// Longest wait for quiet, where something is saved without a pause.
const PATIENCE: Duration = Duration::from_secs(2);

/// Where the system tells nothing: shortest time between two looks, and what share of the time a look may take.
const LOOK_STEP: Duration = Duration::from_secs(1);
const LOOK_SHARE: u32 = 20;

/// Bakes a library, then whatever of it is saved, until the process is interrupted.
pub(super) fn watch(args: &Args, console: &Console) -> Result<(), Error> {
    let (tell, changes) = channel();
    let mut failures = Failures::new();
    let (mut last, mut announced) = (String::new(), String::new());
    let mut inputs = BTreeSet::new();
    loop {
        // New watches are there before the old ones go and before anything is read: no change is missed.
        let folders = folders(args, &inputs);
        let watches = Watches::new(&folders, &ours(args), &tell);
        let note = watches.describe(&args.input, &folders);
        let started = Instant::now();
        let bars = Bars::new(console.progress());
        let result = build(args, bars.task(), &mut failures);
        drop(bars);
        let took = started.elapsed();
        let said = match &result {
            Ok(built) => serde_json::to_string(&built.report).unwrap_or_default(),
            Err(error) => error.to_string(),
        };
        let quiet = matches!(&result, Ok(built) if !built.is_news());
        if !quiet && said != last {
            match &result {
                Ok(built) => built.tell(console, last.is_empty())?,
                Err(error) => console.failure(error),
            }
        }
        last = said;
        if note != announced {
            console.note(&note);
            announced = note;
        }
        let seen = std::mem::replace(&mut inputs, result.map(|built| built.folders).unwrap_or_default());
        // A build tells which other folders matter, such as those of a model's textures; they are watched from now on.
        if inputs.is_subset(&seen) || folders.covers(&inputs) {
            watches.wait(&changes, took);
        }
    }
}

struct Folders {
    /// Folders to watch, absolute, and whether what is below them matters too.
    watched: BTreeMap<PathBuf, bool>,
    /// Of folders that are watched for the sake of something in them alone, what that is.
    ways: BTreeMap<PathBuf, BTreeSet<PathBuf>>,
}

impl Folders {
    fn covers(&self, others: &BTreeSet<PathBuf>) -> bool {
        others.iter().all(|folder| {
            let full = absolute(folder);
            let deep = |above: &Path| self.watched.get(above) == Some(&true);
            let is_way = self.ways.contains_key(&full);
            (self.watched.contains_key(&full) && !is_way) || full.ancestors().any(deep)
        })
    }
}

fn absolute(path: &Path) -> PathBuf {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_path_buf())
}

/// Where the manifest, its inputs and the files that these need are or may appear.
fn folders(args: &Args, inputs: &BTreeSet<PathBuf>) -> Folders {
    let mut wanted: BTreeMap<PathBuf, bool> = inputs.iter().map(|folder| (folder.clone(), false)).collect();
    wanted.entry(args.input.parent().map(Path::to_path_buf).unwrap_or_default()).or_default();
    if let Ok(manifest) = Manifest::read(&args.input) {
        wanted.extend(manifest.input_folders());
    }

    let mut folders: BTreeMap<PathBuf, bool> = BTreeMap::new();
    let mut ways: BTreeMap<PathBuf, BTreeSet<PathBuf>> = BTreeMap::new();
    let wanted_fully: BTreeSet<PathBuf> = wanted.keys().map(|folder| absolute(folder)).collect();
    for (folder, deep) in wanted {
        let full = absolute(&folder);
        if full.is_dir() {
            *folders.entry(full.clone()).or_default() |= deep;
        }
        // In case that it is removed, renamed, or made.
        let mut steps = full.ancestors().zip(full.ancestors().skip(1));
        if let Some((way, above)) = steps.find(|(_, above)| above.is_dir()) {
            folders.entry(above.to_path_buf()).or_default();
            ways.entry(above.to_path_buf()).or_default().insert(way.to_path_buf());
        }
    }
    ways.retain(|above, _| !wanted_fully.contains(above));
    // What is watched with all that is below need not be watched again.
    let deep: BTreeSet<PathBuf> = folders.iter().filter(|(_, deep)| **deep).map(|(f, _)| f.clone()).collect();
    folders.retain(|folder, _| !folder.ancestors().skip(1).any(|above| deep.contains(above)));
    ways.retain(|above, _| folders.contains_key(above));
    Folders { watched: folders, ways }
}

/// The output and the cache, in which the program itself writes.
fn ours(args: &Args) -> Arc<Vec<PathBuf>> {
    let manifest = Manifest::read(&args.input).ok();
    let output = args.output.clone().or_else(|| manifest.as_ref().map(|manifest| manifest.output.clone()));
    let cache = cache_folder(&args.library, manifest.as_ref().and_then(|m| m.cache.as_deref()));
    let home = absolute(args.input.parent().unwrap_or(Path::new("")));
    // An output that holds the manifest holds inputs too: there every change is looked at.
    let all = output.into_iter().chain(cache).map(|folder| absolute(&folder));
    Arc::new(all.filter(|folder| !home.starts_with(folder)).collect())
}

/// What tells of changes.
struct Watches {
    /// Nothing where the system does not tell, and why.
    watcher: Result<RecommendedWatcher, String>,
}

impl Watches {
    fn new(folders: &Folders, ours: &Arc<Vec<PathBuf>>, tell: &Sender<()>) -> Watches {
        let (ours, tell, ways) = (ours.clone(), tell.clone(), folders.ways.clone());
        let handler = move |event: notify::Result<Event>| {
            if event.as_ref().map_or(true, |event| matters(event, &ours, &ways)) {
                // Nobody is left to tell at the very end.
                let _ = tell.send(());
            }
        };
        let watcher = notify::recommended_watcher(handler).and_then(|mut watcher| {
            for (folder, deep) in &folders.watched {
                let mode = if *deep { RecursiveMode::Recursive } else { RecursiveMode::NonRecursive };
                match watcher.watch(folder, mode) {
                    // Gone since it was listed: its parent tells when it comes back.
                    Err(_) if !folder.exists() => {}
                    other => other?,
                }
            }
            Ok(watcher)
        });
        Watches { watcher: watcher.map_err(|e| e.to_string()) }
    }

    /// Waits for a change and then for a moment's quiet; `look` is how long a look at everything takes.
    fn wait(&self, changes: &Receiver<()>, look: Duration) {
        if self.watcher.is_err() {
            std::thread::sleep(LOOK_STEP.max(look * LOOK_SHARE));
            return;
        }
        if changes.recv().is_err() {
            return;
        }
        let first = Instant::now();
        while first.elapsed() < PATIENCE && changes.recv_timeout(QUIET) != Err(RecvTimeoutError::Timeout) {}
    }

    fn describe(&self, manifest: &Path, folders: &Folders) -> String {
        let here = absolute(Path::new(""));
        let names: Vec<String> = (folders.watched.iter())
            .map(|(folder, deep)| {
                let short = folder.strip_prefix(&here).unwrap_or(folder);
                let name =
                    if short.as_os_str().is_empty() { ".".into() } else { short.display().to_string() };
                if *deep { format!("{name}/**") } else { name }
            })
            .collect();
        let shown = names.iter().take(8).cloned().collect::<Vec<_>>().join(", ");
        let more = names.len().saturating_sub(8);
        let more = if more > 0 { format!(" and {more} more folders") } else { String::new() };
        let how = match &self.watcher {
            Ok(_) => String::new(),
            Err(reason) => {
                format!("; looking now and then, since the system does not tell of changes here ({reason})")
            }
        };
        format!("watching {} and {shown}{more}{how}; Ctrl-C ends it", manifest.display())
    }
}

/// Whether an event may change what is baked.
fn matters(event: &Event, ours: &[PathBuf], ways: &BTreeMap<PathBuf, BTreeSet<PathBuf>>) -> bool {
    let is_read = match event.kind {
        EventKind::Access(AccessKind::Close(AccessMode::Write)) => false,
        EventKind::Access(_) => true,
        _ => false,
    };
    let is_ours = |path: &PathBuf| {
        ours.iter().any(|folder| path.starts_with(folder))
            || path.components().any(|c| c.as_os_str() == STATE)
    };
    // A neighbour of what matters.
    let is_beside = |path: &PathBuf| {
        path.parent().and_then(|above| ways.get(above)).is_some_and(|ways| !ways.contains(path))
    };
    // An event without paths says that some were lost.
    !is_read && (event.paths.is_empty() || !event.paths.iter().all(|path| is_ours(path) || is_beside(path)))
}

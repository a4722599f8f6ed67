//! What stands in the output, and what the cache keeps.

use std::collections::{BTreeMap, BTreeSet};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use kinran_bake::cache::{Cache, Entry, Key, StoredFile, WorkFolder, hash_file, relative};
use kinran_bake::manifest::{Job, Kind, Manifest, ManifestError};
use kinran_bake::stamps::{Stamp, Stamps};
use kinran_image::{Disk, make_folder, write_atomically, write_atomically_in};
use kinran_scene::Document;
use serde::{Deserialize, Serialize};

use super::inputs::{Snapshot, Sources};
use super::ours::{Ours, STATE};
use super::plan::Plan;
use super::{EntryReport, LibraryReport, Status, lock};
use crate::error::InputFault;
use crate::skin::Plot;
use crate::{Error, OutputFolder, Space, Task};

/// How often what is known of the output is saved while baking.
const SAVE_STEP: Duration = Duration::from_secs(2);

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
#[derive(Debug)]
pub struct Library {
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

/// Where an entry's files are.
enum Source<'a> {
    Cache(&'a Cache, &'a Key),
    /// A folder of work, which they may leave.
    Work(&'a Path),
}

impl Library {
    /// The library whose files go to `output`, with the cache in a folder if there is one; nothing is made yet.
    ///
    /// # Errors
    /// A folder that holds other things than a cache.
    pub fn open(output: impl AsRef<Path>, cache: Option<&Path>) -> Result<Self, Error> {
        let output = output.as_ref().to_path_buf();
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

    /// Where the files go.
    pub fn output(&self) -> &Path {
        &self.output
    }

    /// The folder in the output with what is known of it, and with work that is not finished.
    pub(super) fn state(&self) -> PathBuf {
        self.output.join(STATE)
    }

    /// What a manifest lists; its patterns leave out results, finished work and what is known of them.
    pub fn jobs(&self, manifest: &Manifest) -> Vec<Result<Job, ManifestError>> {
        let cache = self.cache.as_ref().map(Cache::root);
        let ours = Ours::new(manifest.path(), &self.output, cache, self.written().into_iter());
        manifest.jobs(&|path| ours.is(path))
    }

    /// What a run over it did.
    pub(super) fn report(
        self,
        entries: Vec<EntryReport>,
        space: Space,
        left_over: Vec<PathBuf>,
        pruned: Vec<PathBuf>,
    ) -> LibraryReport {
        LibraryReport {
            output: self.output,
            entries,
            evicted: 0,
            left_over,
            pruned,
            space,
            warnings: self.trouble.into_inner().into_iter().collect(),
            folders: self.folders.into_inner().unwrap_or_else(PoisonError::into_inner),
        }
    }

    /// Whether the cache has an entry.
    pub(super) fn keeps(&self, key: &Key) -> bool {
        self.cache.as_ref().is_some_and(|cache| cache.get(key).is_some())
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
    pub(super) fn key(&self, plan: &Plan) -> Result<Key, Error> {
        let sources = Sources::of(plan, &Disk, &|model| {
            self.stamps.refers_to(model, |bytes| -> Result<_, Error> {
                Ok(Document::from_bytes(model, bytes)?.files())
            })
        })?;
        let folders = sources.files.iter().filter_map(|(_, file)| file.parent()).map(Path::to_path_buf);
        lock(&self.folders).extend(folders);
        sources.key(&|path| Ok(self.stamps.hash(path)?))
    }

    /// Finds out before anything is baked whether it can be kept.
    pub(super) fn prepare_cache(&self) {
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
    pub(super) fn evict(&self, limit: u64) -> usize {
        match self.cache.as_ref().filter(|_| self.trouble.get().is_none()).map(|cache| cache.evict(limit)) {
            None => 0,
            Some(Ok((count, _))) => count,
            Some(Err(error)) => {
                self.complain(Some(error));
                0
            }
        }
    }

    /// Bytes that the files of an entry will take beyond those that they replace, and its share of the work: what it writes,
    /// and next to nothing where that is kept. Of one that cannot be read nothing.
    pub(super) fn plan(&self, plan: &Plan, key: &Key) -> (Space, u64) {
        let (needed, units) = match self.cache.as_ref().and_then(|cache| cache.get(key)) {
            Some(entry) => (Space::exact(entry.files.iter().map(|file| file.bytes).sum()), 1),
            None => {
                let space = plan.space().unwrap_or_default();
                (space, space.most.max(1))
            }
        };
        let standing = lock(&self.standing).get(&plan.job.folder).cloned().unwrap_or_default();
        (needed.beyond(standing.files.iter().map(|(file, _)| file.bytes).sum()), units)
    }

    /// The files of an entry, if they stand in the output as they were written, and what was doubtful about them.
    pub(super) fn standing(&self, job: &Job, key: &Key) -> Option<(Vec<StoredFile>, Vec<String>)> {
        let standing = lock(&self.standing).get(&job.folder).cloned()?;
        let folder = self.output.join(&job.folder);
        let stands =
            |(file, stamp): &(StoredFile, Stamp)| Stamp::of(&folder.join(&file.name)).as_ref() == Some(stamp);
        let whole = standing.key == key.hex() && standing.files.iter().all(stands);
        whole.then(|| (standing.files.into_iter().map(|(file, _)| file).collect(), standing.warnings))
    }

    /// Copies an entry's files from the cache, if it has them.
    pub(super) fn restore(&self, job: &Job, report: &mut EntryReport) -> Result<Option<Status>, Error> {
        let (Some(cache), Some(key)) = (&self.cache, report.key) else { return Ok(None) };
        let Some(entry) = cache.get(&key) else { return Ok(None) };
        match self.place(job, &key, &entry, Source::Cache(cache, &key), report)? {
            Some(0) => Ok(Some(Status::UpToDate)),
            Some(_) => Ok(Some(Status::Restored)),
            None => {
                // What is damaged is in the way.
                self.complain(cache.remove(&key).err());
                Ok(None)
            }
        }
    }

    /// Bakes an entry, keeps it, and moves its files to the output.
    pub(super) fn bake(
        &self,
        plan: &Plan,
        snapshot: &Snapshot,
        key: Key,
        plot: Option<Plot<'_>>,
        task: Task<'_>,
        report: &mut EntryReport,
    ) -> Result<(), Error> {
        let work = WorkFolder::new(&self.state())?;
        let warnings = plan.bake(snapshot, plot, &OutputFolder::new(work.path()), task)?;
        let entry = Entry::of(work.path(), &plan.job.name, serde_json::json!(warnings))?;
        if let Some(cache) = self.cache.as_ref().filter(|_| self.trouble.get().is_none()) {
            self.complain(cache.publish(&key, work.path(), &entry).err());
        }
        self.place(&plan.job, &key, &entry, Source::Work(work.path()), report)?;
        Ok(())
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
        let known = lock(&self.standing).get(&job.folder).cloned().unwrap_or_default();
        for file in &entry.files {
            let path = folder.join(&file.name);
            let is_ours = known.files.iter().any(|(known, _)| known.name == file.name);
            if !is_ours && path.exists() && !is_already(&path, file) {
                refuse_input(job, &path)?;
                return Err(Error::Input { path, fault: InputFault::Foreign });
            }
        }
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
                    make_folder(parent)?;
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
    pub(super) fn gone(&self, entries: &[EntryReport]) -> Vec<PathBuf> {
        if entries.iter().any(|entry| entry.kind.is_none()) {
            return Vec::new();
        }
        let standing = lock(&self.standing);
        let known = |folder: &&PathBuf| entries.iter().any(|entry| entry.folder == **folder);
        standing.keys().filter(|folder| !known(folder)).cloned().collect()
    }

    /// Removes the files that this program put into these folders, and the folders where nothing is left; files that
    /// somebody has changed since stay and are told.
    pub(super) fn prune(&self, folders: &[PathBuf]) -> Result<Vec<String>, Error> {
        let mut stayed = Vec::new();
        for folder in folders {
            let path = self.output.join(folder);
            let known = lock(&self.standing).remove(folder).unwrap_or_default();
            for (file, stamp) in known.files {
                let written = path.join(&file.name);
                if self.is_mine(&written, &file, &stamp) {
                    std::fs::remove_file(&written).map_err(|e| kinran_image::Error::io(&written, e))?;
                } else if written.exists() {
                    stayed.push(format!("{}: was changed and stays", written.display()));
                }
            }
            self.is_news.store(true, Ordering::Relaxed);
            let inside = path.ancestors().take_while(|inside| *inside != self.output);
            // A folder that holds anything stays.
            inside.take_while(|inside| std::fs::remove_dir(inside).is_ok()).for_each(drop);
            if path.exists() {
                stayed.push(format!("{}: holds what kinran did not write, and stays", path.display()));
            }
        }
        Ok(stayed)
    }

    /// Saves what is known of inputs and output, so that the next run need not look at their bytes.
    pub(super) fn save(&self) -> Result<(), Error> {
        let state = self.state();
        make_folder(&state)?;
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
        return Err(Error::Input { path: path.into(), fault: InputFault::AmongInputs });
    }
    Ok(())
}

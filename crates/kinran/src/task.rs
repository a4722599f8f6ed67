//! What a caller hears of long work, and how it stops it.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use kinran_bake::aniso::Filter;
use kinran_image::Cancelled;

use crate::content::Content;

/// Stops work from another thread: bands that are being worked on are finished, what was written whole stays, and the task
/// returns [`Error::Cancelled`](crate::Error::Cancelled).
#[derive(Debug, Default)]
pub struct Cancel(AtomicBool);

impl Cancel {
    /// Nothing is stopped yet.
    pub const fn new() -> Self {
        Cancel(AtomicBool::new(false))
    }

    /// Stops whatever was given this.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was stopped.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// How a task is watched and stopped.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    /// Is told what is being done; from any thread, for each piece of work at its beginning, then often, and at its end.
    pub tell: &'a (dyn Fn(Progress<'_>) + Sync),
    /// Stops it.
    pub cancel: &'a Cancel,
}

impl fmt::Debug for Task<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Task").field("cancel", self.cancel).finish_non_exhaustive()
    }
}

/// A kind of work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Files are read and decoded.
    Reading,
    /// A surface is filtered and compressed; units are texels of all levels.
    Filtering(Filter),
    /// A map that needs no filter of its own is averaged and compressed; units are texels of all levels.
    Averaging(Content),
    /// The base colour, emission and occlusion of a glTF file; units are texels of all levels.
    Colors,
    /// Normals of meshes without any are estimated; units are triangles.
    Normals,
    /// Meshes are measured; units are triangles.
    Curvature,
    /// Tables of skin are integrated; units are points.
    Tables,
    /// A tile is compressed; units are texels of all levels.
    Compressing,
    /// An opacity of layers is looked for; units are texels of all trials.
    Fading,
    /// Resolutions of a map are tried; units are texels of all trials.
    Resolutions,
    /// A map is solved; units are texels of all levels.
    Solving,
    /// The same, and each part of the method is measured.
    Comparing,
    /// Targets are painted and solved; units are texels of all solutions.
    Studying,
    /// It is found out which entries of a library are up to date; units are entries.
    Checking,
    /// Entries of a library are baked; units are about the bytes of their files.
    Baking,
    /// Files are written.
    Writing,
}

/// How far a piece of work is.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress<'a> {
    /// What is being done.
    pub stage: Stage,
    /// With which material, file or mesh; empty where it is all.
    pub of: &'a str,
    /// Of which entry of a library; empty elsewhere.
    pub entry: &'a str,
    /// Units that are done.
    pub done: u64,
    /// Units in all; 0 while nobody knows.
    pub total: u64,
    /// Whether it has come to its end, also by an error.
    pub is_over: bool,
}

impl fmt::Display for Progress<'_> {
    /// In a few words: "writing brocade", of an entry "materials/brocade: writing brocade".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.entry.is_empty() {
            write!(f, "{}: ", self.entry)?;
        }
        match self.stage {
            Stage::Reading => write!(f, "reading")?,
            Stage::Filtering(filter) => write!(f, "{}", filter.name())?,
            Stage::Averaging(content) => write!(f, "{}", content.name())?,
            Stage::Colors => write!(f, "colour, emission, occlusion")?,
            Stage::Normals => write!(f, "normals")?,
            Stage::Curvature => write!(f, "curvature")?,
            Stage::Tables => write!(f, "integrating tables")?,
            Stage::Compressing => write!(f, "compressing")?,
            Stage::Fading => write!(f, "fading the layers")?,
            Stage::Resolutions => write!(f, "trying resolutions")?,
            Stage::Solving => write!(f, "solving")?,
            Stage::Comparing => write!(f, "solving and comparing")?,
            Stage::Studying => write!(f, "painting and solving")?,
            Stage::Checking => write!(f, "checking")?,
            Stage::Baking => write!(f, "baking")?,
            Stage::Writing => write!(f, "writing")?,
        }
        if self.of.is_empty() { Ok(()) } else { write!(f, " {}", self.of) }
    }
}

impl Task<'static> {
    /// Tells nobody and is never stopped.
    pub const QUIET: Task<'static> = {
        static NEVER: Cancel = Cancel::new();
        Task { tell: &|_| {}, cancel: &NEVER }
    };
}

impl<'a> Task<'a> {
    /// Begins a piece of work of `total` units, 0 where nobody knows yet.
    pub(crate) fn begin(
        self,
        stage: Stage,
        of: impl Into<String>,
        total: u64,
    ) -> Result<Work<'a>, Cancelled> {
        let work = Work { task: self, stage, of: of.into(), done: 0.into(), total: total.into() };
        work.tick(0).map(|()| work)
    }
}

/// A piece of work on its way; it is over when this is dropped.
pub(crate) struct Work<'a> {
    task: Task<'a>,
    stage: Stage,
    of: String,
    done: AtomicU64,
    total: AtomicU64,
}

impl Work<'_> {
    /// Counts so many units more that are to be done; from any thread.
    pub(crate) fn expect(&self, units: u64) {
        self.total.fetch_add(units, Ordering::Relaxed);
    }

    /// Counts `units` more as done, from any thread, and says whether to go on.
    pub(crate) fn tick(&self, units: u64) -> Result<(), Cancelled> {
        self.done.fetch_add(units, Ordering::Relaxed);
        self.tell(false);
        if self.task.cancel.is_cancelled() { Err(Cancelled) } else { Ok(()) }
    }

    fn tell(&self, is_over: bool) {
        let [done, total] = [&self.done, &self.total].map(|count| count.load(Ordering::Relaxed));
        (self.task.tell)(Progress { stage: self.stage, of: &self.of, entry: "", done, total, is_over });
    }
}

impl Drop for Work<'_> {
    fn drop(&mut self) {
        self.tell(true);
    }
}

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Is told what is being done, and which share of it is.
type Watch = Arc<dyn Fn(&str, f32) + Send + Sync>;

/// Makes the progress bars of a command.
#[derive(Clone, Default)]
pub struct Progress {
    visible: bool,
    watch: Option<Watch>,
    /// Bars of work that is done at the same time stand under each other.
    group: Option<MultiProgress>,
    /// What the work is a part of.
    of: Option<String>,
}

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Progress")
            .field("visible", &self.visible)
            .field("of", &self.of)
            .finish_non_exhaustive()
    }
}

/// One bar on standard error, gone when dropped.
pub struct Stage {
    bar: ProgressBar,
    started: Instant,
    hidden: AtomicBool,
    total: u64,
    done: AtomicU64,
    watch: Option<Watch>,
    group: Option<MultiProgress>,
}

impl Progress {
    /// Bars that show on a terminal, or never.
    pub fn new(visible: bool) -> Self {
        Progress { visible, ..Progress::default() }
    }

    /// No bars; `watch` is told instead, from any thread and often.
    pub fn watched(watch: impl Fn(&str, f32) + Send + Sync + 'static) -> Self {
        Progress { watch: Some(Arc::new(watch)), ..Progress::default() }
    }

    /// Bars that stand under each other.
    pub fn grouped(&self) -> Self {
        Progress { group: Some(MultiProgress::new()), ..self.clone() }
    }

    /// Bars of work that is a part of `of`.
    pub fn of(&self, of: &str) -> Self {
        Progress { of: Some(of.to_owned()), ..self.clone() }
    }

    /// A bar for `total` units of work called `name`, which shows once it has taken longer than a second.
    pub fn stage(&self, name: impl Into<String>, total: u64) -> Stage {
        let style = ProgressStyle::with_template("{msg:28} {bar:40} {percent:>3} %  {eta}")
            .expect("the template is well formed");
        let name = match &self.of {
            Some(of) => format!("{of}: {}", name.into()),
            None => name.into(),
        };
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden())
            .with_style(style)
            .with_message(name);
        Stage {
            bar,
            started: Instant::now(),
            hidden: AtomicBool::new(self.visible),
            total: total.max(1),
            done: AtomicU64::new(0),
            watch: self.watch.clone(),
            group: self.group.clone(),
        }
    }
}

impl Stage {
    /// Counts `units` more as done; from any thread.
    pub fn add(&self, units: u64) {
        if self.started.elapsed() > PATIENCE && self.hidden.swap(false, Ordering::Relaxed) {
            match &self.group {
                // Adding a bar gives it the group's place to be drawn.
                Some(group) => drop(group.add(self.bar.clone())),
                None => self.bar.set_draw_target(ProgressDrawTarget::stderr()),
            }
        }
        self.bar.inc(units);
        let done = self.done.fetch_add(units, Ordering::Relaxed) + units;
        if let Some(watch) = &self.watch {
            watch(&self.bar.message(), done as f32 / self.total as f32);
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

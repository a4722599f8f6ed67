use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Makes the progress bars of a command.
#[derive(Clone, Copy, Debug, Default)]
pub struct Progress {
    visible: bool,
}

/// One bar on standard error, gone when dropped.
pub struct Stage {
    bar: ProgressBar,
    started: Instant,
    hidden: AtomicBool,
}

impl Progress {
    /// Bars that show on a terminal, or never.
    pub fn new(visible: bool) -> Self {
        Progress { visible }
    }

    /// A bar for `total` units of work called `name`, which shows once it has taken longer than a second.
    pub fn stage(&self, name: impl Into<String>, total: u64) -> Stage {
        let style = ProgressStyle::with_template("{msg:28} {bar:40} {percent:>3} %  {eta}")
            .expect("the template is well formed");
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::hidden())
            .with_style(style)
            .with_message(name.into());
        Stage { bar, started: Instant::now(), hidden: AtomicBool::new(self.visible) }
    }
}

impl Stage {
    /// Counts `units` more as done; from any thread.
    pub fn add(&self, units: u64) {
        if self.started.elapsed() > PATIENCE && self.hidden.swap(false, Ordering::Relaxed) {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.inc(units);
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

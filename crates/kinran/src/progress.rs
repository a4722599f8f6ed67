use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// A command shorter than this shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// How often bars are drawn; what is done within two of them shows no bar.
const FRAME: Duration = Duration::from_millis(100);

/// How often a line is written where standard error is no terminal; chosen by eye.
const LINE_STEP: Duration = Duration::from_secs(3);

/// Works that such a line names.
const NAMED: usize = 3;

/// Is told what is being done, and which share of it is.
type Watch = Arc<dyn Fn(&str, f32) + Send + Sync>;

/// Makes the progress bars of a command.
#[derive(Clone, Default)]
pub struct Progress {
    board: Option<Arc<Board>>,
    watch: Option<Watch>,
    /// What the work is a part of.
    of: Option<String>,
}

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Progress")
            .field("visible", &self.board.is_some())
            .field("of", &self.of)
            .finish_non_exhaustive()
    }
}

/// Work on its way; its bar is gone when it is dropped.
pub struct Stage {
    work: Arc<Work>,
    board: Option<Arc<Board>>,
    watch: Option<Watch>,
}

struct Work {
    name: String,
    started: Instant,
    /// 0 where nobody knows.
    total: u64,
    done: AtomicU64,
    bar: Mutex<Option<ProgressBar>>,
}

/// All that is being done, drawn from a thread of its own: what takes long before its first tick shows too.
struct Board {
    started: Instant,
    running: Mutex<Vec<Arc<Work>>>,
    bars: MultiProgress,
    /// When the last line was written; `None` on a terminal, which has bars.
    last_line: Option<Mutex<Instant>>,
}

impl Progress {
    /// Bars on standard error where that is a terminal, else a line every few seconds; or nothing.
    pub fn new(visible: bool) -> Self {
        let board = visible.then(|| {
            let now = Instant::now();
            let board = Arc::new(Board {
                started: now,
                running: Mutex::default(),
                bars: MultiProgress::new(),
                last_line: (!stderr().is_terminal()).then(|| Mutex::new(now)),
            });
            let drawn = Arc::downgrade(&board);
            std::thread::spawn(move || draw(&drawn));
            board
        });
        Progress { board, ..Progress::default() }
    }

    /// No bars; `watch` is told instead, from any thread and often.
    pub fn watched(watch: impl Fn(&str, f32) + Send + Sync + 'static) -> Self {
        Progress { watch: Some(Arc::new(watch)), ..Progress::default() }
    }

    /// Bars of work that is a part of `of`.
    pub fn of(&self, of: &str) -> Self {
        Progress { of: Some(of.to_owned()), ..self.clone() }
    }

    /// A bar for `total` units of work called `name`, with an estimate of the time that is left; one unit has none.
    pub fn stage(&self, name: impl Into<String>, total: u64) -> Stage {
        self.start(name.into(), if total > 1 { total } else { 0 })
    }

    /// Work of which nobody knows how much there is: its name and the time that it has taken.
    pub fn busy(&self, name: impl Into<String>) -> Stage {
        self.start(name.into(), 0)
    }

    fn start(&self, name: String, total: u64) -> Stage {
        let name = match &self.of {
            Some(of) => format!("{of}: {name}"),
            None => name,
        };
        let work =
            Work { name, started: Instant::now(), total, done: AtomicU64::new(0), bar: Mutex::default() };
        let work = Arc::new(work);
        if let Some(board) = &self.board {
            lock(&board.running).push(work.clone());
        }
        Stage { work, board: self.board.clone(), watch: self.watch.clone() }
    }

    /// Writes to standard error while no bar stands there.
    pub(crate) fn suspend(&self, write: impl FnOnce()) {
        match &self.board {
            Some(board) => board.bars.suspend(write),
            None => write(),
        }
    }
}

impl Stage {
    /// Counts `units` more as done; from any thread.
    pub fn add(&self, units: u64) {
        let done = self.work.done.fetch_add(units, Ordering::Relaxed) + units;
        if let Some(watch) = &self.watch {
            watch(&self.work.name, done as f32 / self.work.total.max(1) as f32);
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        let Some(board) = &self.board else { return };
        let mut running = lock(&board.running);
        running.retain(|work| !Arc::ptr_eq(work, &self.work));
        if let Some(bar) = lock(&self.work.bar).take() {
            bar.finish_and_clear();
            board.bars.remove(&bar);
        }
    }
}

impl Work {
    /// How much is done, of 1; `None` where nobody knows.
    fn share(&self) -> Option<f32> {
        let done = self.done.load(Ordering::Relaxed);
        (self.total > 0).then(|| (done as f32 / self.total as f32).min(1.0))
    }

    /// The time that is left if the rest goes as what is done did; else the time that it has taken.
    fn time(&self) -> String {
        let taken = self.started.elapsed().as_secs_f32();
        match self.share() {
            Some(share) if share > 0.0 => format!("{} left", duration(taken * (1.0 - share) / share)),
            _ => duration(taken),
        }
    }

    fn line(&self) -> String {
        match self.share() {
            Some(share) => format!("{}: {:.0} %, {}", self.name, 100.0 * share, self.time()),
            None => format!("{}: {}", self.name, self.time()),
        }
    }

    fn draw(&self, bars: &MultiProgress) {
        let mut bar = lock(&self.bar);
        let bar = bar.get_or_insert_with(|| {
            let template = match self.total {
                0 => "{msg:28} {spinner} {prefix}",
                _ => "{msg:28} {bar:40} {percent:>3} %  {prefix}",
            };
            let style = ProgressStyle::with_template(template).expect("the template is well formed");
            bars.add(ProgressBar::new(self.total.max(1)).with_style(style).with_message(self.name.clone()))
        });
        bar.set_prefix(self.time());
        bar.set_position(self.done.load(Ordering::Relaxed));
        bar.tick();
    }
}

impl Board {
    fn draw(&self) {
        if self.started.elapsed() < PATIENCE {
            return;
        }
        let running = lock(&self.running);
        let shown: Vec<_> = running.iter().filter(|work| work.started.elapsed() > 2 * FRAME).collect();
        let Some(last_line) = &self.last_line else {
            shown.iter().for_each(|work| work.draw(&self.bars));
            return;
        };
        let mut last_line = lock(last_line);
        if !shown.is_empty() && last_line.elapsed() >= LINE_STEP {
            *last_line = Instant::now();
            // Nobody is left to tell that standard error is closed.
            let _ = writeln!(stderr(), "{}", line(&shown.iter().map(|work| work.line()).collect::<Vec<_>>()));
        }
    }
}

/// Draws until nobody does any work any more.
fn draw(board: &Weak<Board>) {
    while let Some(board) = board.upgrade() {
        board.draw();
        drop(board);
        std::thread::sleep(FRAME);
    }
}

/// What is being done at the same time, in a line.
fn line(works: &[String]) -> String {
    let more = match works.len().saturating_sub(NAMED) {
        0 => String::new(),
        more => format!("; and {more} more"),
    };
    works[..works.len().min(NAMED)].join("; ") + &more
}

/// Seconds as people say them.
fn duration(seconds: f32) -> String {
    match seconds.round() as u64 {
        seconds @ 0..100 => format!("{seconds} s"),
        seconds @ 100..6000 => format!("{} min", (seconds + 30) / 60),
        seconds => format!("{} h", (seconds + 1800) / 3600),
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn work(total: u64, done: u64) -> Work {
        Work {
            name: "baking lamp".into(),
            started: Instant::now() - Duration::from_secs(8),
            total,
            done: AtomicU64::new(done),
            bar: Mutex::default(),
        }
    }

    #[test]
    fn what_is_left_goes_as_what_is_done_did() {
        assert_eq!(work(10, 4).line(), "baking lamp: 40 %, 12 s left");
        assert_eq!(work(10, 0).line(), "baking lamp: 0 %, 8 s");
        assert_eq!(work(0, 0).line(), "baking lamp: 8 s");
        // Whoever counts more than was announced is done.
        assert_eq!(work(10, 20).line(), "baking lamp: 100 %, 0 s left");
        let of = |seconds| duration(seconds);
        assert_eq!([of(99.4), of(100.0), of(5999.0), of(6000.0)], ["99 s", "2 min", "100 min", "2 h"]);
    }

    #[test]
    fn a_line_does_not_grow_with_what_is_done_at_once() {
        let works: Vec<String> = (0..5).map(|i| i.to_string()).collect();
        assert_eq!(line(&works), "0; 1; 2; and 2 more");
        assert_eq!(line(&works[..1]), "0");
    }
}

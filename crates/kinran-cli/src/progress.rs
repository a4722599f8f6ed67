use std::collections::BTreeMap;
use std::io::{IsTerminal, Write, stderr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use kinran::{Cancel, Task};
use kinran_image::Cancelled;

/// A command shorter than this shows nothing.
const PATIENCE: Duration = Duration::from_secs(1);

/// How often bars are drawn; what is done within two of them shows no bar.
const FRAME: Duration = Duration::from_millis(100);

/// How often a line is written where standard error is no terminal; chosen by eye.
const LINE_STEP: Duration = Duration::from_secs(3);

/// Works that such a line names.
const NAMED: usize = 3;

/// Is told what is being done, and which share of it is; says whether to go on.
type Watch = Arc<dyn Fn(&str, f32) -> Result<(), Cancelled> + Send + Sync>;

/// Makes the progress bars of a command.
#[derive(Clone, Default)]
pub struct Progress {
    board: Option<Arc<Board>>,
    watch: Option<Watch>,
    /// What the work is a part of.
    of: Option<String>,
    /// Work that is measured in samples of pixels, all that are drawn.
    overall: Option<Arc<Work>>,
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
    /// 0 while nobody knows.
    total: AtomicU64,
    done: AtomicU64,
    pace: Mutex<Pace>,
    bar: Mutex<Option<ProgressBar>>,
}

/// When more was last seen to be done, how much, and by which step.
#[derive(Clone, Copy, Default)]
struct Pace {
    /// Since the work began.
    after: Duration,
    done: u64,
    step: u64,
}

/// All that is being done, drawn from a thread of its own: what takes long before its first tick shows too.
struct Board {
    started: Instant,
    running: Mutex<Running>,
    bars: MultiProgress,
    /// When the last line was written; `None` on a terminal, which has bars.
    last_line: Option<Mutex<Instant>>,
}

#[derive(Default)]
struct Running {
    works: Vec<Arc<Work>>,
    /// Whether the thread is there; where nothing is done, none is awake.
    is_drawn: bool,
}

impl Progress {
    /// Bars on standard error where that is a terminal, else a line every few seconds; or nothing.
    pub fn new(visible: bool) -> Self {
        let board = visible.then(|| {
            let now = Instant::now();
            Arc::new(Board {
                started: now,
                running: Mutex::default(),
                bars: MultiProgress::new(),
                last_line: (!stderr().is_terminal()).then(|| Mutex::new(now)),
            })
        });
        Progress { board, ..Progress::default() }
    }

    /// No bars; `watch` is told instead, from any thread and often, and stops the work by an error.
    pub fn watched(watch: impl Fn(&str, f32) -> Result<(), Cancelled> + Send + Sync + 'static) -> Self {
        Progress { watch: Some(Arc::new(watch)), ..Progress::default() }
    }

    /// Bars of work that is a part of `of`.
    pub fn of(&self, of: &str) -> Self {
        Progress { of: Some(of.to_owned()), ..self.clone() }
    }

    /// Bars of work that is a part of a stage whose units are samples of pixels: those that are drawn count there too.
    pub fn overall(&self, stage: &Stage) -> Self {
        Progress { overall: Some(stage.work.clone()), ..self.clone() }
    }

    /// Whether samples of pixels count in a stage of the whole.
    pub fn has_overall(&self) -> bool {
        self.overall.is_some()
    }

    /// Counts samples of pixels that were drawn, for the stage of the whole, where there is one; from any thread.
    pub fn drawn(&self, samples: u64) {
        if let Some(work) = &self.overall {
            work.done.fetch_add(samples, Ordering::Relaxed);
        }
    }

    /// A bar for `total` units of work called `name`, with an estimate of the time that is left; one unit has none.
    pub fn stage(&self, name: impl Into<String>, total: u64) -> Stage {
        self.start(name.into(), if total > 1 { total } else { 0 })
    }

    /// Work of which nobody knows yet how much there is: its name and the time that it has taken, and a bar as soon as
    /// [`Stage::expect`] has told.
    pub fn busy(&self, name: impl Into<String>) -> Stage {
        self.start(name.into(), 0)
    }

    fn start(&self, name: String, total: u64) -> Stage {
        let name = match &self.of {
            Some(of) => format!("{of}: {name}"),
            None => name,
        };
        let work = Work {
            name,
            started: Instant::now(),
            total: total.into(),
            done: 0.into(),
            pace: Mutex::default(),
            bar: Mutex::default(),
        };
        let work = Arc::new(work);
        if let Some(board) = &self.board {
            let mut running = lock(&board.running);
            running.works.push(work.clone());
            if !std::mem::replace(&mut running.is_drawn, true) {
                let board = Arc::downgrade(board);
                std::thread::spawn(move || draw(&board));
            }
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

/// Bars of a task of the library.
pub(crate) struct Bars {
    tell: Box<dyn Fn(kinran::Progress<'_>) + Send + Sync>,
    cancel: Arc<Cancel>,
}

impl Bars {
    pub(crate) fn new(progress: Progress) -> Self {
        let running: Mutex<BTreeMap<String, Stage>> = Mutex::default();
        let cancel = Arc::new(Cancel::new());
        let stop = cancel.clone();
        let tell = move |told: kinran::Progress<'_>| {
            let name = told.to_string();
            let mut running = lock(&running);
            if told.is_over {
                running.remove(&name);
                return;
            }
            let stage = running.entry(name.clone()).or_insert_with(|| progress.stage(name, told.total));
            if stage.set(told.done, told.total).is_err() {
                stop.cancel();
            }
        };
        Bars { tell: Box::new(tell), cancel }
    }

    pub(crate) fn task(&self) -> Task<'_> {
        Task { tell: &*self.tell, cancel: &self.cancel }
    }
}

impl Stage {
    /// Tells of so many units more that are to be done; from any thread.
    pub fn expect(&self, units: u64) {
        self.work.total.fetch_add(units, Ordering::Relaxed);
    }

    /// Counts `units` more as done, of work that can be stopped; from any thread.
    ///
    /// # Errors
    /// Where who watches the work stops it.
    pub fn tick(&self, units: u64) -> Result<(), Cancelled> {
        let done = self.work.done.fetch_add(units, Ordering::Relaxed) + units;
        let Some(watch) = &self.watch else { return Ok(()) };
        let total = self.work.total.load(Ordering::Relaxed).max(1);
        watch(&self.work.name, done as f32 / total as f32)
    }

    /// Counts `units` more as done, of work that goes on to its end; from any thread.
    pub fn add(&self, units: u64) {
        let _ = self.tick(units);
    }

    /// So many units of so many are done; none is ever taken back, and one in all is no extent.
    fn set(&self, done: u64, total: u64) -> Result<(), Cancelled> {
        self.work.total.fetch_max(if total > 1 { total } else { 0 }, Ordering::Relaxed);
        self.work.done.fetch_max(done, Ordering::Relaxed);
        self.tick(0)
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        let Some(board) = &self.board else { return };
        let mut running = lock(&board.running);
        running.works.retain(|work| !Arc::ptr_eq(work, &self.work));
        if let Some(bar) = lock(&self.work.bar).take() {
            bar.finish_and_clear();
            board.bars.remove(&bar);
        }
    }
}

impl Work {
    /// How much is done, of 1; `None` where nobody knows.
    fn share(&self) -> Option<f32> {
        let [done, total] = [&self.done, &self.total].map(|count| count.load(Ordering::Relaxed));
        (total > 0).then(|| (done as f32 / total as f32).min(1.0))
    }

    /// The time that is left if the rest goes as what is done did, where that can be told; else the time that it has taken.
    fn time(&self) -> String {
        let taken = self.started.elapsed();
        match self.left(taken) {
            Some(left) if left.as_secs_f32() >= 0.5 => format!("{} left", duration(left)),
            _ => duration(taken),
        }
    }

    /// The time that is left. It passes between two units, however long the one takes that is being done, down to what those
    /// take that come after it.
    fn left(&self, taken: Duration) -> Option<Duration> {
        let [done, total] = [&self.done, &self.total].map(|count| count.load(Ordering::Relaxed));
        let mut pace = lock(&self.pace);
        if done != pace.done {
            *pace = Pace { after: taken, done, step: done - pace.done };
        }
        if pace.done == 0 || total == 0 {
            return None;
        }
        let of_units = |units: u64| pace.after.mul_f64(units as f64 / pace.done as f64);
        let rest = total.saturating_sub(done);
        Some(
            (pace.after + of_units(rest)).saturating_sub(taken).max(of_units(rest.saturating_sub(pace.step))),
        )
    }

    fn line(&self) -> String {
        match self.share() {
            Some(share) => format!("{}: {:.0} %, {}", self.name, 100.0 * share, self.time()),
            None => format!("{}: {}", self.name, self.time()),
        }
    }

    fn draw(&self, bars: &MultiProgress, columns: usize) {
        let mut bar = lock(&self.bar);
        let total = self.total.load(Ordering::Relaxed);
        let bar = bar.get_or_insert_with(|| bars.add(ProgressBar::new(0).with_message(self.name.clone())));
        bar.set_style(style(total > 0, self.name.chars().count(), columns));
        bar.set_length(total);
        bar.set_prefix(self.time());
        bar.set_position(self.done.load(Ordering::Relaxed));
        bar.tick();
    }
}

impl Board {
    /// Draws, a due line to `lines`, and tells whether there was anything to draw.
    fn draw(&self, lines: &mut dyn Write) -> bool {
        let mut running = lock(&self.running);
        running.is_drawn = !running.works.is_empty();
        if !running.is_drawn || self.started.elapsed() < PATIENCE {
            return running.is_drawn;
        }
        let shown: Vec<_> = running.works.iter().filter(|work| work.started.elapsed() > 2 * FRAME).collect();
        let Some(last_line) = &self.last_line else {
            // One column is left, for a terminal that wraps what ends at its edge.
            let columns = usize::from(console::Term::stderr().size().1).saturating_sub(1);
            shown.iter().for_each(|work| work.draw(&self.bars, columns));
            return true;
        };
        let mut last_line = lock(last_line);
        if !shown.is_empty() && last_line.elapsed() >= LINE_STEP {
            *last_line = Instant::now();
            // Nobody is left to tell that standard error is closed.
            let _ = writeln!(lines, "{}", line(&shown.iter().map(|work| work.line()).collect::<Vec<_>>()));
        }
        true
    }
}

/// Columns of a name, of a bar, and of the shortest bar that is drawn; chosen by eye.
const NAME: usize = 28;
const BAR: usize = 40;
const SHORTEST: usize = 10;

/// Columns behind a bar: a share and "100 min left".
const BEHIND: usize = " 100 %  ".len() + "100 min left".len();

/// A bar's line: on a terminal too narrow for name, bar and time it goes without the bar, then with part of the name.
fn style(has_share: bool, name: usize, columns: usize) -> ProgressStyle {
    let bar = columns.saturating_sub(name.max(NAME) + " ".len() + BEHIND).min(BAR);
    let template = match has_share {
        true if bar >= SHORTEST => format!("{{msg:{NAME}}} {{bar:{bar}}} {{percent:>3}} %  {{prefix}}"),
        true if columns >= BEHIND => "{wide_msg} {percent:>3} %  {prefix}".into(),
        false if columns >= name.max(NAME) + BEHIND => format!("{{msg:{NAME}}} {{spinner}} {{prefix}}"),
        false if columns >= BEHIND => "{wide_msg} {spinner} {prefix}".into(),
        _ => "{wide_msg}".into(),
    };
    ProgressStyle::with_template(&template).expect("the template is well formed")
}

/// Draws as long as anything is done.
fn draw(board: &Weak<Board>) {
    while board.upgrade().is_some_and(|board| board.draw(&mut stderr())) {
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

/// Time as people say it.
fn duration(time: Duration) -> String {
    match time.as_secs_f64().round() as u64 {
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
    use indicatif::{ProgressDrawTarget, TermLike};

    use super::*;

    fn work(total: u64, done: u64) -> Work {
        Work {
            name: "baking lamp".into(),
            started: Instant::now() - Duration::from_secs(8),
            total: total.into(),
            done: done.into(),
            pace: Mutex::default(),
            bar: Mutex::default(),
        }
    }

    #[test]
    fn work_whose_extent_comes_later_shows_no_share() {
        let progress = Progress::new(false);
        let reading = progress.busy("reading lamp");
        assert_eq!(reading.work.share(), None);
        reading.expect(30);
        reading.add(12);
        reading.expect(10);
        assert_eq!(reading.work.share(), Some(0.3));
    }

    #[test]
    fn samples_of_parts_do_not_count_in_the_whole() {
        let progress = Progress::new(false);
        let all = progress.stage("demo", 100);
        assert!(!progress.has_overall());
        let part = progress.overall(&all);
        assert!(part.has_overall());
        part.of("brocade").drawn(25);
        progress.drawn(50);
        assert_eq!(all.work.share(), Some(0.25));
    }

    #[test]
    fn nobody_draws_when_work_begins_again() {
        let progress = Progress::new(true);
        let is_drawn = || lock(&progress.board.as_ref().unwrap().running).is_drawn;
        for _ in 0..2 {
            let stage = progress.stage("baking", 2);
            assert!(is_drawn());
            drop(stage);
            let started = Instant::now();
            while is_drawn() {
                assert!(started.elapsed() < Duration::from_secs(30), "the thread stays awake");
                std::thread::sleep(FRAME);
            }
        }
    }

    #[test]
    fn a_pipe_stays_silent_or_is_flooded() {
        let ago = |seconds| Instant::now() - Duration::from_secs(seconds);
        let board = |started, last_line| Board {
            started,
            running: Mutex::new(Running { works: vec![Arc::new(work(10, 4))], is_drawn: true }),
            bars: MultiProgress::new(),
            last_line: Some(Mutex::new(last_line)),
        };
        let written = |board: &Board| {
            let mut lines = Vec::new();
            assert!(board.draw(&mut lines));
            String::from_utf8(lines).unwrap()
        };
        let long = board(ago(8), ago(4));
        assert_eq!(written(&long), "baking lamp: 40 %, 12 s left\n");
        assert_eq!(written(&long), "", "a second line right after the first");
        assert_eq!(written(&board(ago(0), ago(4))), "", "a line about what takes no time");
    }

    #[test]
    fn what_is_left_goes_as_what_is_done_did() {
        assert_eq!(work(10, 4).line(), "baking lamp: 40 %, 12 s left");
        assert_eq!(work(10, 0).line(), "baking lamp: 0 %, 8 s");
        assert_eq!(work(0, 0).line(), "baking lamp: 8 s");
        // Whoever counts more than was announced is done.
        assert_eq!(work(10, 20).line(), "baking lamp: 100 %, 8 s");
        let of = |seconds| duration(Duration::from_secs_f64(seconds));
        assert_eq!([of(99.4), of(100.0), of(5999.0), of(6000.0)], ["99 s", "2 min", "100 min", "2 h"]);
    }

    #[test]
    fn what_is_left_grows_while_a_unit_takes_long() {
        let left = |work: &Work, taken| work.left(Duration::from_secs(taken)).map(|left| left.as_secs());
        let uneven = work(10, 0);
        assert_eq!(left(&uneven, 9), None);
        // Four units in eight seconds; then one that takes as long as eight others.
        uneven.done.store(4, Ordering::Relaxed);
        let told: Vec<_> = [8, 9, 10, 11, 16, 24].map(|taken| left(&uneven, taken)).into();
        assert_eq!(told, [12, 11, 10, 9, 4, 4].map(Some), "what is behind a step of four units takes 4 s");
        uneven.done.store(5, Ordering::Relaxed);
        assert_eq!([24, 28, 40, 60].map(|taken| left(&uneven, taken)), [24, 20, 19, 19].map(Some));
        // The last one: nobody knows.
        uneven.done.store(9, Ordering::Relaxed);
        assert_eq!([54, 90].map(|taken| left(&uneven, taken)), [6, 0].map(Some));
    }

    /// A terminal that keeps the widest line written to it.
    #[derive(Debug)]
    struct Narrow(u16, Arc<AtomicU64>);

    impl TermLike for Narrow {
        fn width(&self) -> u16 {
            self.0
        }
        fn move_cursor_up(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_down(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_right(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn move_cursor_left(&self, _: usize) -> std::io::Result<()> {
            Ok(())
        }
        fn write_line(&self, line: &str) -> std::io::Result<()> {
            self.write_str(line)
        }
        fn write_str(&self, text: &str) -> std::io::Result<()> {
            let plain = console::strip_ansi_codes(text);
            let width = plain.lines().map(console::measure_text_width).max().unwrap_or(0);
            self.1.fetch_max(width as u64, Ordering::Relaxed);
            Ok(())
        }
        fn clear_line(&self) -> std::io::Result<()> {
            Ok(())
        }
        fn flush(&self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn bars_wrap_on_narrow_terminals() {
        for columns in [8, 19, 20, 30, 39, 48, 60, 61, 80, 100, 200] {
            for (name, total) in [("lamp", 10), ("lamp", 0), (&*"a long name ".repeat(6), 10), ("x", 1 << 40)]
            {
                let widest = Arc::new(AtomicU64::new(0));
                let term = Narrow(columns, widest.clone());
                let target = ProgressDrawTarget::term_like(Box::new(term));
                let bars = MultiProgress::with_draw_target(target);
                let work = Work { name: name.into(), ..work(total, total / 7) };
                work.draw(&bars, usize::from(columns) - 1);
                let widest = widest.load(Ordering::Relaxed);
                assert!(widest > 0 && widest <= columns.into(), "{name}: {widest} of {columns} columns");
            }
        }
    }

    #[test]
    fn a_line_does_not_grow_with_what_is_done_at_once() {
        let works: Vec<String> = (0..5).map(|i| i.to_string()).collect();
        assert_eq!(line(&works), "0; 1; 2; and 2 more");
        assert_eq!(line(&works[..1]), "0");
    }
}

//! How far long work is, on a terminal: nothing for the first second, then a line with the time that is left.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
use std::time::{Duration, Instant};

/// How long work may take before its progress is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// The progress of one piece of work. All threads may report it; a thread of its own shows that work goes on where
/// nothing is reported for long.
pub struct Progress {
    line: Arc<Line>,
}

/// The line on the terminal.
struct Line {
    bar: OnceLock<ProgressBar>,
    what: Mutex<String>,
    /// The effect of Ctrl-C.
    at_end: &'static str,
    all: Option<u64>,
    done: AtomicU64,
    begin: Instant,
    wanted: bool,
    cleared: AtomicBool,
}

impl Progress {
    /// Of work with so many steps, where that is known; `quiet` or without a terminal nothing is shown.
    pub fn new(what: impl Into<String>, all: Option<u64>, quiet: bool) -> Self {
        Self::ended_by(what, all, quiet, "Ctrl-C keeps what is done")
    }

    /// Progress of a job whose intermediate results are useless.
    pub fn of_whole(what: impl Into<String>, quiet: bool) -> Self {
        Self::ended_by(what, None, quiet, "Ctrl-C ends it")
    }

    fn ended_by(what: impl Into<String>, all: Option<u64>, quiet: bool, at_end: &'static str) -> Self {
        let wanted = !quiet && std::io::stderr().is_terminal();
        let line = Arc::new(Line {
            bar: OnceLock::new(),
            what: Mutex::new(what.into()),
            at_end,
            all,
            done: AtomicU64::new(0),
            begin: Instant::now(),
            wanted,
            cleared: AtomicBool::new(false),
        });
        if wanted {
            let watched = Arc::downgrade(&line);
            // Without the thread the line appears with the next report.
            let _ = std::thread::Builder::new().spawn(move || keep_alive(&watched));
        }
        Self { line }
    }

    /// This progress with `already` steps done.
    pub fn with_done(self, already: u64) -> Self {
        self.line.done.store(already, Ordering::Relaxed);
        self
    }

    /// So many steps are done.
    pub fn set(&self, done: u64) {
        self.line.done.store(done, Ordering::Relaxed);
        if let Some(bar) = self.line.bar() {
            bar.set_position(done);
        }
    }

    /// So many more steps are done.
    pub fn add(&self, steps: u64) {
        let done = self.line.done.fetch_add(steps, Ordering::Relaxed) + steps;
        if let Some(bar) = self.line.bar() {
            bar.set_position(done);
        }
    }

    /// Still at work, with this to report.
    pub fn tell(&self, what: impl FnOnce() -> String) {
        if self.line.wanted {
            let what = what();
            if let Some(bar) = self.line.bar() {
                bar.set_message(what.clone());
            }
            *self.line.what.lock().unwrap_or_else(PoisonError::into_inner) = what;
        }
    }

    /// Takes the line away.
    pub fn clear(&self) {
        self.line.cleared.store(true, Ordering::Relaxed);
        if let Some(bar) = self.line.bar.get() {
            bar.finish_and_clear();
        }
    }
}

/// Shows the line after a while, as long as the work goes on.
fn keep_alive(line: &Weak<Line>) {
    while let Some(line) = line.upgrade() {
        if line.cleared.load(Ordering::Relaxed) || line.bar().is_some() {
            return;
        }
        drop(line);
        std::thread::sleep(PATIENCE / 10);
    }
}

impl Line {
    fn bar(&self) -> Option<&ProgressBar> {
        if !self.wanted || self.begin.elapsed() < PATIENCE || self.cleared.load(Ordering::Relaxed) {
            return None;
        }
        Some(self.bar.get_or_init(|| {
            let (bar, form) = match self.all {
                Some(all) => {
                    (ProgressBar::new(all), "{msg} {wide_bar} {human_pos} of {human_len}, {rate}, {eta} left".into())
                }
                None => (ProgressBar::new_spinner(), format!("{{spinner}} {{msg}}, {{elapsed}}; {}", self.at_end)),
            };
            let rate = |state: &ProgressState, out: &mut dyn Write| {
                let _ = write!(out, "{}/s", taut::number::significant(state.per_sec(), 3));
            };
            let style = ProgressStyle::with_template(&form).unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style.with_key("rate", rate));
            bar.set_message(self.what.lock().unwrap_or_else(PoisonError::into_inner).clone());
            bar.set_position(self.done.load(Ordering::Relaxed));
            bar.enable_steady_tick(PATIENCE / 5);
            bar
        }))
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}

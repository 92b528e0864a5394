//! How far long work is, on a terminal: nothing for the first second, then a line with the time that is left.

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How long work may take before its progress is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// The progress of one piece of work. All threads may tell it.
pub struct Progress {
    bar: OnceLock<ProgressBar>,
    what: String,
    all: Option<u64>,
    done: AtomicU64,
    begin: Instant,
    wanted: bool,
}

impl Progress {
    /// Of work with so many steps, where that is known; `quiet` or without a terminal nothing is shown.
    pub fn new(what: impl Into<String>, all: Option<u64>, quiet: bool) -> Self {
        let wanted = !quiet && std::io::stderr().is_terminal();
        Self { bar: OnceLock::new(), what: what.into(), all, done: AtomicU64::new(0), begin: Instant::now(), wanted }
    }

    /// The same where so many steps were done before.
    pub fn with_done(self, already: u64) -> Self {
        self.done.store(already, Ordering::Relaxed);
        self
    }

    /// So many steps are done.
    pub fn set(&self, done: u64) {
        self.done.store(done, Ordering::Relaxed);
        if let Some(bar) = self.bar() {
            bar.set_position(done);
        }
    }

    /// So many more steps are done.
    pub fn add(&self, steps: u64) {
        let done = self.done.fetch_add(steps, Ordering::Relaxed) + steps;
        if let Some(bar) = self.bar() {
            bar.set_position(done);
        }
    }

    /// Still at work, with this to tell.
    pub fn tell(&self, what: impl FnOnce() -> String) {
        if let Some(bar) = self.bar() {
            bar.set_message(what());
            bar.tick();
        }
    }

    /// Still at work.
    pub fn tick(&self) {
        if let Some(bar) = self.bar() {
            bar.tick();
        }
    }

    /// Takes the line away.
    pub fn clear(&self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }

    fn bar(&self) -> Option<&ProgressBar> {
        if !self.wanted || self.begin.elapsed() < PATIENCE {
            return None;
        }
        Some(self.bar.get_or_init(|| {
            let (bar, form) = match self.all {
                Some(all) => (ProgressBar::new(all), "{msg} {wide_bar} {human_pos} of {human_len}, {rate}, {eta} left"),
                None => (ProgressBar::new_spinner(), "{spinner} {msg}, {elapsed}; Ctrl-C keeps what is done"),
            };
            let rate = |state: &ProgressState, out: &mut dyn Write| {
                let _ = write!(out, "{}/s", taut::number::significant(state.per_sec(), 3));
            };
            let style = ProgressStyle::with_template(form).unwrap_or_else(|_| ProgressStyle::default_bar());
            bar.set_style(style.with_key("rate", rate));
            bar.set_message(self.what.clone());
            bar.set_position(self.done.load(Ordering::Relaxed));
            bar
        }))
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.clear();
    }
}

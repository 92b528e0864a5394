//! How far a sweep is, on a terminal.

use super::Work;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;

/// A bar with the time that is left; nothing where nobody looks.
pub struct Progress(Option<ProgressBar>);

impl Progress {
    /// Begins with what is done already.
    pub fn new(work: &Work, done: u64) -> Self {
        if work.args.quiet || !std::io::stderr().is_terminal() {
            return Self(None);
        }
        let bar = ProgressBar::new(work.sweep.runs()).with_position(done);
        bar.reset_eta();
        let form = "{wide_bar} {human_pos} of {human_len} runs, {per_sec}, {eta} left; Ctrl-C keeps what is done";
        Self(Some(bar.with_style(ProgressStyle::with_template(form).unwrap_or_else(|_| ProgressStyle::default_bar()))))
    }

    /// So many more.
    pub fn add(&self, runs: u64) {
        if let Some(bar) = &self.0 {
            bar.inc(runs);
        }
    }

    /// Takes it away.
    pub fn clear(&self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}

//! Acts that a page can ask for: each is a row of [`ACTS`] and a function from a request to a reply.

mod case;
mod closed;
mod curves;
mod friction;
mod gallery;
mod logs;
mod modes;
mod open;
mod report;
mod rows;
mod run;
mod save;
mod scene;
mod section;
mod shape;
mod sweep;
mod toml;
pub mod upload;

use crate::message::{Reply, Request};
use crate::state::State;
use serde_json::Value;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use taut::error::{Error, Result};
use taut::solve::Flow;

/// How long a work takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// Milliseconds: one at a time for each page, the newest wins.
    Quick,
    /// Seconds and more: on a thread of its own, with progress; `cancel` stops it.
    Long,
}

type Act = (&'static str, Pace, fn(&Request, &Context) -> Result<Reply>);

/// All acts.
const ACTS: &[Act] = &[
    ("open", Pace::Quick, open::open),
    ("run", Pace::Quick, run::run),
    ("section", Pace::Quick, section::section),
    ("modes", Pace::Quick, modes::modes),
    ("gallery", Pace::Quick, gallery::gallery),
    ("save", Pace::Quick, save::save),
    ("report", Pace::Quick, report::report),
    ("columns", Pace::Quick, logs::columns),
    ("check", Pace::Long, logs::check),
    ("fit", Pace::Long, logs::fit),
    ("controllers", Pace::Quick, closed::controllers),
    ("loop", Pace::Quick, closed::closed),
    ("tune", Pace::Long, closed::tuned),
    ("shape", Pace::Long, shape::shape),
    ("sweep", Pace::Long, sweep::sweep),
    ("traces", Pace::Quick, sweep::traces),
];

/// A quick work is stopped after this time: a picture that takes longer is none to drag.
const DEADLINE: Duration = Duration::from_secs(10);

/// Surroundings of a work beside its request.
pub struct Context<'a> {
    /// The state that all pages share.
    pub state: &'a State,
    /// Set when nobody wants the answer any more.
    stop: &'a AtomicBool,
    /// Tells the page how far a long work is; false where it is behind, and misses this step.
    pub progress: &'a (dyn Fn(Value) -> bool + Sync),
    begun: Instant,
}

impl<'a> Context<'a> {
    /// That of a work that begins now.
    pub fn new(state: &'a State, stop: &'a AtomicBool, progress: &'a (dyn Fn(Value) -> bool + Sync)) -> Self {
        Self { state, stop, progress, begun: Instant::now() }
    }

    /// Whether a quick work is to go on.
    pub fn flow(&self) -> Flow {
        if self.is_stopped() || self.begun.elapsed() > DEADLINE { Flow::Stop } else { Flow::Continue }
    }

    /// Whether nobody wants the answer any more.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// The pace of an act; none where there is no such act.
pub fn pace(act: &str) -> Option<Pace> {
    ACTS.iter().find(|(name, _, _)| *name == act).map(|(_, pace, _)| *pace)
}

/// The names of all acts, for messages.
pub fn names() -> String {
    let names: Vec<&str> = ACTS.iter().map(|(name, _, _)| *name).collect();
    format!("{}, cancel", names.join(", "))
}

/// Does what is asked for.
pub fn answer(request: &Request, context: &Context) -> Reply {
    let Some((_, _, act)) = ACTS.iter().find(|(name, _, _)| *name == request.act) else { return Reply::default() };
    // A defect of the library ends one answer, not the server.
    match catch_unwind(AssertUnwindSafe(|| act(request, context))) {
        Ok(Ok(reply)) => reply,
        Ok(Err(error)) => Reply::error(&error),
        Err(_) => Reply::error(
            &Error::new("this is a defect of taut: the computation broke off").next("keep the case, and report it"),
        ),
    }
}

//! Acts that a page can ask for: each is a row of `ACTS` and a function from a request to a reply.
//!
//! They need no server: a [`Host`] provides what depends on the surroundings of the page, such as saving a file.

mod case;
mod closed;
mod curves;
mod friction;
mod gallery;
mod logs;
mod message;
mod modes;
mod open;
mod report;
mod rows;
mod run;
mod save;
mod schema;
mod section;
pub mod sent;
mod shape;
mod sweep;
mod toml;

pub use message::{Reply, Request};

use serde_json::Value;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use taut::error::{Error, Result};
use taut::solve::Flow;

/// The name of a case that is no file.
pub const NAME: &str = "studio.toml";

/// The surroundings of a page: a server, or a browser without one.
pub trait Host: Sync {
    /// A monotonic clock, s.
    fn seconds(&self) -> f64;

    /// Threads available to one act.
    fn threads(&self) -> usize;

    /// The name that a case of the page has: it decides where relative paths in its text lead.
    fn name(&self) -> &Path;

    /// The case that can be saved: where it is, and its text as last read or saved.
    fn opened(&self) -> Option<(&Path, String)>;

    /// Saves that case; errors: what is in the way. Returns where it is.
    fn save(&self, text: &str) -> Result<PathBuf>;

    /// The file that a page sent under this path; any other path is an error.
    fn sent(&self, path: &str) -> Result<PathBuf>;
}

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
    ("schema", Pace::Quick, schema::schema),
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

/// A quick work is stopped after this time, s: a picture that takes longer is none to drag.
const DEADLINE: f64 = 10.0;

/// Context of a job.
pub struct Context<'a> {
    /// The surroundings of the page.
    pub(crate) host: &'a dyn Host,
    /// True if nobody wants the answer any more.
    stop: &'a (dyn Fn() -> bool + Sync),
    /// Tells the page how far a long work is; false where it is behind, and misses this step.
    pub(crate) progress: &'a (dyn Fn(Value) -> bool + Sync),
    begun: f64,
}

impl<'a> Context<'a> {
    /// Context of a job that begins now.
    pub fn new(
        host: &'a dyn Host,
        stop: &'a (dyn Fn() -> bool + Sync),
        progress: &'a (dyn Fn(Value) -> bool + Sync),
    ) -> Self {
        Self { host, stop, progress, begun: host.seconds() }
    }

    /// Time since the work began, s.
    fn elapsed(&self) -> f64 {
        self.host.seconds() - self.begun
    }

    /// Tells a quick job to continue or to stop.
    fn flow(&self) -> Flow {
        if self.is_stopped() || self.elapsed() > DEADLINE { Flow::Stop } else { Flow::Continue }
    }

    /// True if nobody wants the answer any more.
    fn is_stopped(&self) -> bool {
        (self.stop)()
    }
}

/// The pace of an act; none where there is no such act.
pub fn pace(act: &str) -> Option<Pace> {
    ACTS.iter().find(|(name, _, _)| *name == act).map(|(_, pace, _)| *pace)
}

/// The names of all acts of this pace.
pub fn names(pace: Pace) -> impl Iterator<Item = &'static str> {
    ACTS.iter().filter(move |(_, own, _)| *own == pace).map(|(name, _, _)| *name)
}

/// The answer to an unknown act.
pub fn unknown(act: &str) -> Reply {
    let names: Vec<&str> = ACTS.iter().map(|(name, _, _)| *name).collect();
    let error = Error::new(format!("there is nothing called \"{act}\" to do"));
    Reply::error(&error.allowed(format!("{}, cancel", names.join(", "))))
}

/// Does what is asked for.
pub fn answer(request: &Request, context: &Context) -> Reply {
    let Some((_, _, act)) = ACTS.iter().find(|(name, _, _)| *name == request.act) else { return unknown(&request.act) };
    // A defect of the library ends one answer, not the server.
    match catch_unwind(AssertUnwindSafe(|| act(request, context))) {
        Ok(Ok(reply)) => reply,
        Ok(Err(error)) => Reply::error(&error),
        Err(_) => defect(),
    }
}

/// The answer to a computation that panicked.
pub fn defect() -> Reply {
    let error = Error::new("this is a defect of taut: the computation broke off");
    Reply::error(&error.next("keep the case, and report it"))
}

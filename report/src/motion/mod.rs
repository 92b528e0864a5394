//! Moves in closed loop as a person sees them.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::Curves;
pub use rows::{controller, length, lines};

use taut::case::{Case, Move};
use taut::control::{MoveRun, Worst};
use taut::design::Design;
use taut::json::Moved;
use taut::machine::Machine;
use taut::reach::feasible::Shortfall;
use taut::tune::trouble::Trouble;

/// A move after it ran.
pub struct Done<'a> {
    /// The move as the case has it.
    pub motion: &'a Move,
    /// Its run.
    pub run: MoveRun,
    /// Its curves, where plots are wanted.
    pub curves: Option<Curves>,
    /// With parameters wrong by a share: the largest cart error (m), and how many of how many settle.
    pub worst: Option<Worst>,
    /// The trouble of its loop, where it has one.
    pub trouble: Option<Trouble>,
    /// The limits that its reference exceeds.
    pub shortfalls: Vec<Shortfall>,
    /// Its files, as paths within the folder.
    pub files: Vec<String>,
}

impl Done<'_> {
    /// The entry of the summary.
    pub fn told<'a>(&'a self, machine: &'a Machine) -> Moved<'a> {
        Moved {
            machine,
            motion: self.motion,
            run: &self.run,
            worst: self.worst.as_ref(),
            trouble: self.trouble.as_ref(),
            shortfalls: &self.shortfalls,
            files: &self.files,
        }
    }
}

/// A case with what came of its moves.
pub struct Tried<'a> {
    /// The case.
    pub case: &'a Case,
    /// Its controller.
    pub design: &'a Design,
    /// Its moves.
    pub done: Vec<Done<'a>>,
}

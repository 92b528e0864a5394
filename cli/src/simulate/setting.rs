//! Settings that all runs of a command share.

use crate::args::Simulate;
use crate::folder::Folder;
use crate::interrupt::Interrupt;
use taut::case::Case;
use taut::machine::Machine;
use taut::solve::Solver;

/// Settings that all runs of a command share.
pub struct RunSettings<'a> {
    pub args: &'a Simulate,
    pub case: &'a Case,
    pub solver: Solver,
    pub folder: Option<&'a Folder>,
    pub interrupt: &'a Interrupt,
    /// Machines drawn from a posterior.
    pub machines: &'a [Machine],
}

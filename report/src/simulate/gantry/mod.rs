//! The same for a gantry.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::{curves, figures, way};
pub use rows::{early_end, lines, machine};

use super::{Curves, Way};
use std::time::Duration;
use taut::case::Experiment;
use taut::json::GantrySimulated;
use taut::metrics::GantryMetrics;
use taut::solve;

/// An experiment after it ran.
pub struct Run<'a> {
    /// The experiment as the case has it.
    pub experiment: &'a Experiment,
    /// Its events, how it ended, what it cost.
    pub outcome: solve::Outcome,
    /// Its key figures.
    pub metrics: GantryMetrics,
    /// Its curves, and the way of the cart, where plots are wanted.
    pub curves: Option<(Curves, Way)>,
    /// Its files, as paths within the folder.
    pub files: Vec<String>,
    /// How long solving and writing took.
    pub took: Duration,
}

impl Run<'_> {
    /// The entry of the summary.
    pub fn told(&self) -> GantrySimulated<'_> {
        let Run { experiment, outcome, metrics, files, .. } = self;
        GantrySimulated { experiment, outcome, metrics, files }
    }
}

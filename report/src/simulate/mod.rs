//! Runs of experiments as a person sees them: rows of figures, plots, a page.

mod band;
mod curves;
mod in_plane;
mod live;
mod marks;
mod page;
mod plots;
pub(crate) mod rows;

pub use band::Band;
pub(crate) use curves::ColumnPair;
pub use curves::{Curves, Samples, decimator};
pub use live::scene;
pub(crate) use page::figures_table;
pub use page::report;
pub use plots::{Named, named};
pub use rows::{
    accuracy, cost, early_end, ended_early, events, hidden, lines, machine, plain, solver_words, speed, time, travel,
    value, yawed,
};

use std::time::Duration;
use taut::case::Experiment;
use taut::fit::LogFit;
use taut::json::{self, Simulated};
use taut::metrics::Metrics;
use taut::reduction::Reduction;
use taut::solve;

/// An experiment after it ran.
pub struct SimulatedExperiment<'a> {
    /// The experiment as the case has it.
    pub experiment: &'a Experiment,
    /// Its events, how it ended, what it cost.
    pub outcome: solve::Outcome,
    /// Its key figures.
    pub metrics: Metrics,
    /// Its curves, where plots are wanted.
    pub curves: Option<Curves>,
    /// Its samples, where they and plots are wanted.
    pub samples: Option<Samples>,
    /// The band of the machines of --draws.
    pub band: Option<Band>,
    /// The run beside the log of its experiment, where it has one.
    pub log: Option<LogFit>,
    /// How far its model is from the elastic one, where it is a reduced one.
    pub reduction: Option<Reduction>,
    /// Its files, as paths within the folder.
    pub files: Vec<String>,
    /// How long solving and writing took.
    pub took: Duration,
}

impl SimulatedExperiment<'_> {
    /// The entry of the summary.
    pub fn told(&self) -> Simulated<'_> {
        Simulated {
            experiment: self.experiment,
            outcome: &self.outcome,
            metrics: &self.metrics,
            reduction: self.reduction,
            band: self.band.as_ref().map(|band| json::Band {
                machines: band.machines,
                machines_left_out: band.failed,
                final_drive_angle_rad: band.end(0),
                final_cart_position_m: band.end(1),
                final_drive_travel_minus_cart_m: band.end(2),
            }),
            log: self.log.as_ref(),
            files: &self.files,
        }
    }
}

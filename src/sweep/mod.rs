//! Many runs with parameters varied.
//!
//! A [`Sweep`] is made of a case, of an axis or a gantry, that says what is varied ([`crate::case::Sweeping`]). Each of
//! its runs is one machine, with every experiment and move of the case: row `i` follows from the case and `i` alone,
//! bit for bit, so that rows can be computed in any order, in pieces, by any number of threads and machines. The kernel
//! does no I/O and starts no thread.
//!
//! ```
//! use taut::case::{Case, TEMPLATE};
//! use taut::sweep::Sweep;
//! let changes = [
//!     "sweep.runs=1000",
//!     "sweep.vary.\"cart.mass\"=20 %",
//!     "sweep.vary.\"motor.resistance\"=normal(0.7 ohm, 0.02 ohm)",
//! ];
//! let case = Case::from_text_with("axis.toml", TEMPLATE, &changes)?;
//! let sweep = Sweep::new(&case)?;
//! let table = sweep.rows(990, 10, &|| false).expect("not stopped");
//! assert_eq!(table.columns[1].heading(), "cart.mass_kg");
//! // The same machines, met one by one.
//! let alone = sweep.rows(995, 1, &|| false).expect("not stopped");
//! assert_eq!(alone.columns[1].values[0].to_bits(), table.columns[1].values[5].to_bits());
//! # Ok::<(), taut::Error>(())
//! ```

mod chance;
mod distribution;
mod indices;
mod measures;
mod plan;
mod points;
mod sobol;
mod statistics;
mod subject;
mod summary;

pub use distribution::Distribution;
pub use indices::{Estimate, Index, indices};
pub use measures::{Figure, Measure, of_move};
pub use sobol::{DIMENSIONS, Sobol};
pub use statistics::{Ranked, SHARES, Spread};
use subject::{Subject, Worker};
pub use summary::{Drawn, LostShare, Measured, Shown, Summary};

use crate::case::Sampling;
use crate::error::Result;
use crate::machine::Machine;
use crate::parameter::{self, Free};
use crate::solve::{Ending, Flow, Outcome, PositionError};
use crate::trajectory::{Column, Trajectory};
use points::Points;
use std::sync::Arc;

/// How a run ended, as the number in a column `status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Status {
    /// At the end of the experiment.
    Complete,
    /// The cart, or the bridge, left its travel.
    LeftTravel,
    /// More events than the bound allows.
    TooManyEvents,
    /// A state became infinite or not a number.
    Diverged,
    /// These numbers are no machine: friction below what a model needs, say.
    Refused,
    /// Something changes so fast that the run would not have ended in time.
    TooStiff,
    /// Errors of rounding grow to as much as the motion: numbers of 64 bits do not determine the run.
    NotDetermined,
}

impl Status {
    /// All of them, by number.
    pub const ALL: [Status; 7] = [
        Status::Complete,
        Status::LeftTravel,
        Status::TooManyEvents,
        Status::Diverged,
        Status::Refused,
        Status::TooStiff,
        Status::NotDetermined,
    ];

    /// Its number.
    pub fn code(self) -> f64 {
        f64::from(self as u8)
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Status::Complete => "complete",
            Status::LeftTravel => "left the travel",
            Status::TooManyEvents => "too many events",
            Status::Diverged => "diverged",
            Status::Refused => "no machine",
            Status::TooStiff => "too stiff",
            Status::NotDetermined => "not determined",
        }
    }
}

/// A number of the machine that varies, and the distribution of its values.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// The free number.
    pub free: Free,
    /// The distribution of its values.
    pub distribution: Distribution,
}

/// The draws of a posterior.
#[derive(Debug, Clone)]
struct Draws {
    free: Vec<Free>,
    /// By parameter and draw.
    columns: Vec<Vec<f64>>,
}

/// Something that each machine does, and what is told of it.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Group {
    /// Its name.
    pub name: String,
    /// Its name as that of a file, with which those of its columns begin.
    pub file: String,
    /// True if it is a move in closed loop, and no experiment. The controller takes every machine for the one of the
    /// case.
    pub is_move: bool,
    /// Its figures, whose columns stand behind that of its status.
    pub figures: Vec<Figure>,
}

/// Many runs of a case.
#[derive(Debug, Clone)]
pub struct Sweep {
    subject: Subject,
    groups: Vec<Group>,
    parameters: Vec<Parameter>,
    draws: Option<Arc<Draws>>,
    points: Points,
    sampling: Sampling,
    indices: bool,
    runs: u64,
    headings: Vec<Column>,
}

impl Sweep {
    /// How many runs there are.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// The parameters that are varied by themselves; those of a posterior come besides.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// How the machines are chosen.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// True if the runs are blocks of k + 2 for Sobol' indices: the machine of a sample A, that of a sample B, and
    /// those of A with one parameter after the other from B.
    pub fn indices(&self) -> bool {
        self.indices
    }

    /// The experiments, then the moves of each machine, in the order of the columns.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The columns of [`Sweep::rows`], without rows: `run`, the parameters, then a status and the figures of each
    /// experiment, whose names begin with that of its files and a point: `5-v-pulse.peak_current`.
    pub fn columns(&self) -> &[Column] {
        &self.headings
    }

    /// Number of columns before the first experiment's: `run` and the parameters.
    pub fn inputs(&self) -> usize {
        1 + self.draws.as_ref().map_or(0, |draws| draws.free.len()) + self.parameters.len()
    }

    /// The parameters of `count` runs from run `first` on: the first columns of [`Sweep::rows`]. Runs beyond the last
    /// are left out.
    pub fn values(&self, first: u64, count: usize) -> Trajectory {
        let mut table = Trajectory::with_capacity(&self.headings[..self.inputs()], count);
        let mut values = Vec::with_capacity(self.inputs());
        for run in self.range(first, count) {
            self.put_values(run, &mut values);
            push(&mut table, &values);
        }
        table
    }

    /// The machine of a run.
    pub fn machine(&self, run: u64) -> Machine {
        let mut machine = self.subject.machine.clone();
        let mut values = Vec::with_capacity(self.inputs());
        self.put_values(run, &mut values);
        self.set(&mut machine, run, &values);
        machine
    }

    /// Runs `count` machines from run `first` on: a row for each, with its parameters, and of each experiment how it
    /// ended and its figures, which are NaN where it did not reach its end. None where `stop` said so, which is asked
    /// before each run.
    pub fn rows(&self, first: u64, count: usize, stop: &dyn Fn() -> bool) -> Option<Trajectory> {
        let mut table = Trajectory::with_capacity(&self.headings, count);
        let mut values = Vec::with_capacity(self.headings.len());
        let mut worker = Worker::new(&self.subject);
        let runs = self.range(first, count);
        let drawn: Vec<Vec<f64>> = runs.clone().map(|run| self.drawn(run)).collect();
        let set = |machine: &mut Machine, run: u64| self.set(machine, run, &drawn[(run - runs.start) as usize]);
        let beside = worker.run_beside(runs.clone(), set, stop)?;
        for (run, drawn) in runs.clone().zip(&drawn) {
            if stop() {
                return None;
            }
            values.clone_from(drawn);
            if !worker.put(run, &beside, &mut values) {
                set(worker.reset(), run);
                worker.run(run, &beside, &mut values);
            }
            push(&mut table, &values);
        }
        Some(table)
    }

    /// Runs one experiment of a machine, the number of its group, and hands every quantity over time to `sink` in
    /// blocks. Errors: a machine that cannot be run.
    pub fn stream(&self, run: u64, experiment: usize, sink: &mut dyn FnMut(&Trajectory) -> Flow) -> Result<Outcome> {
        let machine = self.machine(run);
        self.subject.stream(&machine, experiment, sink)
    }

    fn range(&self, first: u64, count: usize) -> std::ops::Range<u64> {
        first.min(self.runs)..first.saturating_add(count as u64).min(self.runs)
    }

    /// The number of a run and its parameters.
    fn drawn(&self, run: u64) -> Vec<f64> {
        let mut values = Vec::with_capacity(self.inputs());
        self.put_values(run, &mut values);
        values
    }

    /// The number of a run and its parameters, into `values`.
    fn put_values(&self, run: u64, values: &mut Vec<f64>) {
        values.clear();
        values.push(run as f64);
        if let Some(draws) = &self.draws {
            let count = draws.columns.first().map_or(0, Vec::len) as u64;
            let draw = self.points.draw(run, count);
            values.extend(draws.columns.iter().map(|column| column[draw]));
        }
        self.points.put(run, &self.parameters, values);
    }

    /// Sets everything to its value in this run.
    fn set(&self, machine: &mut Machine, run: u64, values: &[f64]) {
        let drawn = self.draws.iter().flat_map(|draws| &draws.free);
        let varied = self.parameters.iter().enumerate();
        let free = drawn
            .map(|free| (free, true))
            .chain(varied.map(|(place, parameter)| (&parameter.free, self.points.varies(run, place))));
        let set = free.zip(&values[1..]).filter(|((_, set), _)| *set);
        parameter::set(machine, set.map(|((free, _), value)| (free, *value)));
    }
}

/// Adds how a run ended, and its figures by these; NaN where it has not reached its end, or is not determined.
fn put_figures<T, M>(told: Result<(Status, T)>, measures: &[M], of: impl Fn(&M, &T) -> f64, values: &mut Vec<f64>) {
    let status = told.as_ref().map_or(Status::Refused, |(status, _)| *status);
    values.push(status.code());
    match told {
        Ok((_, run)) if status == Status::Complete => values.extend(measures.iter().map(|measure| of(measure, &run))),
        _ => values.extend(measures.iter().map(|_| f64::NAN)),
    }
}

fn push(table: &mut Trajectory, values: &[f64]) {
    for (column, value) in table.columns.iter_mut().zip(values) {
        column.values.push(*value);
    }
}

fn status(outcome: &Outcome) -> Status {
    match outcome.ending {
        Ending::Complete if outcome.error.is_some_and(PositionError::hides_motion) => Status::NotDetermined,
        Ending::Complete | Ending::Interrupted { .. } => Status::Complete,
        Ending::LeftTravel { .. } => Status::LeftTravel,
        Ending::TooManyEvents { .. } => Status::TooManyEvents,
        Ending::Diverged { .. } => Status::Diverged,
        Ending::TooStiff { .. } => Status::TooStiff,
    }
}

/// The columns that a sweep of these has.
fn headings(draws: Option<&Draws>, parameters: &[Parameter], groups: &[Group]) -> Vec<Column> {
    let free = draws.iter().flat_map(|draws| &draws.free).chain(parameters.iter().map(|parameter| &parameter.free));
    let mut columns = vec![Column::new("run", "")];
    columns.extend(free.map(|free| Column::new(free.name.clone(), free.unit)));
    for Group { file, figures, .. } in groups {
        columns.push(Column::new(format!("{file}.status"), ""));
        columns.extend(figures.iter().map(|figure| Column::new(format!("{file}.{}", figure.name), figure.unit)));
    }
    columns
}

//! Many runs with parameters varied.
//!
//! A [`Sweep`] is made of a case that says what is varied ([`crate::case::Sweeping`]). Each of its runs is one machine, with every
//! experiment and move of the case: row `i` follows from the case and `i` alone, bit for bit, so that rows can be computed in any order, in pieces,
//! by any number of threads and machines. The kernel does no I/O and starts no thread.
//!
//! ```
//! use taut::case::{Case, TEMPLATE};
//! use taut::sweep::Sweep;
//! let changes = ["sweep.runs=1000", "sweep.vary.\"cart.mass\"=20 %", "sweep.vary.\"motor.resistance\"=normal(0.7 ohm, 0.02 ohm)"];
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

pub use distribution::Distribution;
pub use indices::{Estimate, Index, indices};
pub use measures::{Measure, OF_EXPERIMENT, OF_MOVE};
pub use sobol::{DIMENSIONS, Sobol};
pub use statistics::{SHARES, Spread, rank_correlation};

use crate::case::{Experiment, Move, Sampling};
use crate::control::{self, MoveRun, Setup};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::metrics::{Held, Meter};
use crate::parameter::{self, Free};
use crate::solve::{self, Bench, Ending, Flow, Solver};
use crate::stage::Stage;
use crate::trajectory::{Column, Trajectory};
use points::Points;
use std::sync::Arc;

/// How a run ended, as the number in a column `status`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// At the end of the experiment.
    Complete,
    /// The cart left its travel.
    LeftTravel,
    /// More events than the bound allows.
    TooManyEvents,
    /// A state became infinite or not a number.
    Diverged,
    /// These numbers are no machine: friction below what a model needs, say.
    Refused,
    /// Something changes so fast that the run would not have ended in time.
    TooStiff,
}

impl Status {
    /// All of them, by number.
    pub const ALL: [Status; 6] = [
        Status::Complete,
        Status::LeftTravel,
        Status::TooManyEvents,
        Status::Diverged,
        Status::Refused,
        Status::TooStiff,
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
        }
    }
}

/// What varies: a number of the machine, and what its value is made from.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// What is free.
    pub free: Free,
    /// What values it takes.
    pub distribution: Distribution,
}

/// The draws of a posterior.
#[derive(Debug, Clone)]
struct Draws {
    free: Vec<Free>,
    /// By parameter and draw.
    columns: Vec<Vec<f64>>,
}

/// Many runs of a case.
#[derive(Debug, Clone)]
pub struct Sweep {
    stage: Stage,
    experiments: Vec<Experiment>,
    moves: Vec<Move>,
    controller: Option<Design>,
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

    /// What is varied by itself; the parameters of a posterior come besides.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// How the machines are chosen.
    pub fn sampling(&self) -> Sampling {
        self.sampling
    }

    /// Whether the runs are blocks of k + 2 for Sobol' indices: the machine of a sample A, that of a sample B, and those of A with one
    /// parameter after the other from B.
    pub fn indices(&self) -> bool {
        self.indices
    }

    /// The experiments that each machine does.
    pub fn experiments(&self) -> &[Experiment] {
        &self.experiments
    }

    /// The moves in closed loop that each machine does; the controller takes every machine for the one of the case.
    pub fn moves(&self) -> &[Move] {
        &self.moves
    }

    /// The machine as the case has it.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The columns of [`Sweep::rows`], without rows: `run`, the parameters, then a status and the figures of each experiment, whose
    /// names begin with that of its files and a point: `5-v-pulse.peak_current`.
    pub fn columns(&self) -> &[Column] {
        &self.headings
    }

    /// Number of columns before the first experiment's: `run` and the parameters.
    pub fn inputs(&self) -> usize {
        1 + self.draws.as_ref().map_or(0, |draws| draws.free.len()) + self.parameters.len()
    }

    /// The parameters of `count` runs from run `first` on: the first columns of [`Sweep::rows`]. Runs beyond the last are left out.
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
    pub fn machine(&self, run: u64) -> Stage {
        let mut values = Vec::with_capacity(self.inputs());
        self.put_values(run, &mut values);
        let mut stage = self.stage.clone();
        self.set(&mut stage, run, &values);
        stage
    }

    /// Runs `count` machines from run `first` on: a row for each, with its parameters, and of each experiment how it ended and its
    /// figures, which are NaN where it did not reach its end. None where `stop` said so, which is asked before each run.
    pub fn rows(&self, first: u64, count: usize, stop: &dyn Fn() -> bool) -> Option<Trajectory> {
        let mut table = Trajectory::with_capacity(&self.headings, count);
        let mut values = Vec::with_capacity(self.headings.len());
        let mut stage = self.stage.clone();
        let mut bench = Bench::default();
        let held: Vec<Option<Held>> = self.experiments.iter().map(Held::last).collect();
        for run in self.range(first, count) {
            if stop() {
                return None;
            }
            self.put_values(run, &mut values);
            stage.clone_from(&self.stage);
            self.set(&mut stage, run, &values);
            let machine = bench.mount(&stage);
            for (experiment, held) in self.experiments.iter().zip(&held) {
                let mut meter = Meter::with(&stage, *held);
                let outcome = machine.clone().and_then(|()| bench.observe(experiment, &mut meter));
                let told = outcome.map(|outcome| (outcome.ending, meter.finish(&outcome.events)));
                put_measures(told, OF_EXPERIMENT, &mut values);
            }
            for motion in &self.moves {
                let told =
                    machine.clone().and_then(|()| self.close(&stage, motion)).map(|run| (run.outcome.ending, run));
                put_measures(told, OF_MOVE, &mut values);
            }
            push(&mut table, &values);
        }
        Some(table)
    }

    /// A move in closed loop.
    fn close(&self, stage: &Stage, motion: &Move) -> Result<MoveRun> {
        let Some(design) = &self.controller else { return Err(Error::new("there is no controller")) };
        let setup = Setup {
            stage,
            model: &self.stage,
            design,
            profile: &motion.profile,
            until: motion.until,
            window: motion.window,
            solver: Solver::of(stage),
        };
        control::closed_loop(&setup)
    }

    fn range(&self, first: u64, count: usize) -> std::ops::Range<u64> {
        first.min(self.runs)..first.saturating_add(count as u64).min(self.runs)
    }

    /// The number of a run and its parameters.
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
    fn set(&self, stage: &mut Stage, run: u64, values: &[f64]) {
        let drawn = self.draws.iter().flat_map(|draws| &draws.free);
        let varied = self.parameters.iter().enumerate();
        let free = drawn
            .map(|free| (free, true))
            .chain(varied.map(|(place, parameter)| (&parameter.free, self.points.varies(run, place))));
        let set = free.zip(&values[1..]).filter(|((_, set), _)| *set);
        parameter::set(stage, set.map(|((free, _), value)| (free, *value)));
    }

    /// Refuses a case whose own machine cannot be run.
    fn check(&self) -> Result<()> {
        for experiment in &self.experiments {
            solve::stream(&self.stage, experiment, Solver::of(&self.stage), &mut |_| Flow::Stop)?;
        }
        for motion in &self.moves {
            self.close(&self.stage, motion)?;
        }
        Ok(())
    }
}

/// How a run ended, and its figures; NaN where it has not reached its end.
fn put_measures<T>(told: Result<(Ending, T)>, measures: &[Measure<T>], values: &mut Vec<f64>) {
    let status = told.as_ref().map_or(Status::Refused, |(ending, _)| status(*ending));
    values.push(status.code());
    match told {
        Ok((_, run)) if status == Status::Complete => values.extend(measures.iter().map(|measure| (measure.of)(&run))),
        _ => values.extend(measures.iter().map(|_| f64::NAN)),
    }
}

fn push(table: &mut Trajectory, values: &[f64]) {
    for (column, value) in table.columns.iter_mut().zip(values) {
        column.values.push(*value);
    }
}

fn status(ending: Ending) -> Status {
    match ending {
        Ending::Complete | Ending::Interrupted { .. } => Status::Complete,
        Ending::LeftTravel { .. } => Status::LeftTravel,
        Ending::TooManyEvents { .. } => Status::TooManyEvents,
        Ending::Diverged { .. } => Status::Diverged,
        Ending::TooStiff { .. } => Status::TooStiff,
    }
}

/// The columns that a sweep of these has.
fn headings(
    draws: Option<&Draws>,
    parameters: &[Parameter],
    experiments: &[Experiment],
    moves: &[Move],
) -> Vec<Column> {
    let free = draws.iter().flat_map(|draws| &draws.free).chain(parameters.iter().map(|parameter| &parameter.free));
    let mut columns = vec![Column::new("run", "")];
    columns.extend(free.map(|free| Column::new(free.name.clone(), free.unit)));
    for experiment in experiments {
        put_headings(&experiment.file_name(), OF_EXPERIMENT, &mut columns);
    }
    for motion in moves {
        put_headings(&motion.file_name(), OF_MOVE, &mut columns);
    }
    columns
}

fn put_headings<T>(name: &str, measures: &[Measure<T>], columns: &mut Vec<Column>) {
    columns.push(Column::new(format!("{name}.status"), ""));
    columns.extend(measures.iter().map(|measure| Column::new(format!("{name}.{}", measure.name), measure.unit)));
}

//! Sweeps of a gantry: its experiments.

use super::measures::{OfPart, of_gantry};
use super::{Group, Status, put_figures, status};
use crate::case::{Case, Experiment, Sweeping};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::metrics::{GantryMeter, GantryMetrics};
use crate::parameter;
use crate::solve::{self, Course, Detail, Flow, Outcome, Solver, stream_mechanism};
use crate::trajectory::Trajectory;

/// A gantry, and what each of its machines does.
#[derive(Debug, Clone)]
pub(super) struct Gantry {
    pub machine: Machine,
    experiments: Vec<Experiment>,
    figures: Vec<OfPart>,
}

impl Gantry {
    /// That of a case, as planned.
    pub fn of(case: &Case, plan: &Sweeping) -> Self {
        let mut experiments = case.experiments.clone();
        for experiment in &mut experiments {
            experiment.every = plan.interval.unwrap_or(experiment.every);
        }
        let mut figures = of_gantry(&case.machine.mechanism());
        figures.retain(|of_part| plan.tells(&of_part.figure.name));
        Self { machine: case.machine.clone(), experiments, figures }
    }

    /// The experiments of each machine, and their figures.
    pub fn groups(&self) -> Vec<Group> {
        let group = |experiment: &Experiment| Group {
            name: experiment.name.clone(),
            file: experiment.file_name(),
            is_move: false,
            figures: self.figures.iter().map(|of_part| of_part.figure.clone()).collect(),
        };
        self.experiments.iter().map(group).collect()
    }

    /// Refuses a case whose own machine cannot be run.
    pub fn check(&self) -> Result<()> {
        check(&self.machine)?;
        (0..self.experiments.len())
            .try_for_each(|experiment| self.stream(&self.machine, experiment, &mut |_| Flow::Stop).map(|_| ()))
    }

    /// Runs one experiment of a machine, for its rows.
    pub fn stream(
        &self,
        gantry: &Machine,
        experiment: usize,
        sink: &mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Outcome> {
        let experiment = self.experiments.get(experiment).ok_or_else(|| Error::new("there is no such experiment"))?;
        check(gantry)?;
        solve::stream(gantry, experiment, Solver::of(gantry), sink)
    }

    /// Adds status and figures of all that a machine does.
    pub fn run(&self, gantry: &Machine, values: &mut Vec<f64>) {
        let machine = check(gantry).map(|()| gantry.mechanism());
        for experiment in &self.experiments {
            let run = |mechanism: &_| -> Result<(Status, GantryMetrics)> {
                let mut meter = GantryMeter::of(gantry, mechanism);
                let (course, solver) = (Course::of(mechanism, experiment), Solver::of_mechanism(mechanism));
                let observed = (Detail::None, Some(&mut meter as _));
                let outcome = stream_mechanism(mechanism, &course, solver, observed, &mut |_| Flow::Continue)?;
                Ok((status(&outcome), meter.finish(&outcome.events)))
            };
            let told = machine.as_ref().map_err(Error::clone).and_then(run);
            put_figures(told, &self.figures, OfPart::value, values);
        }
    }
}

/// Refuses numbers that are no machine.
fn check(gantry: &Machine) -> Result<()> {
    parameter::check(gantry)?;
    gantry.check_gantry()
}

//! Sweeps of an axis: its experiments and its moves in closed loop.

use super::measures::{Figure, Measure, OF_EXPERIMENT, OF_MOVE};
use super::{Group, put_figures, status};
use crate::case::{Case, Experiment, Move, Sweeping};
use crate::control::{self, MoveRun, Setup};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::metrics::{Held, Meter, Metrics, Sought};
use crate::solve::{self, Bench, Flow, Outcome, Solver};
use crate::trajectory::Trajectory;

/// An axis, and what each of its machines does.
#[derive(Debug, Clone)]
pub(super) struct Axis {
    pub machine: Machine,
    experiments: Vec<Experiment>,
    moves: Vec<Move>,
    controller: Option<Design>,
    /// The figures that are told of experiments and of moves, and what experiments are followed for.
    of_experiment: Vec<&'static Measure<Metrics>>,
    of_move: Vec<&'static Measure<MoveRun>>,
    sought: Vec<Sought>,
}

impl Axis {
    /// That of a case, as planned.
    pub fn of(case: &Case, plan: &Sweeping) -> Self {
        let mut experiments = case.experiments.clone();
        for experiment in &mut experiments {
            // What was measured does not count here.
            experiment.log = None;
            experiment.every = plan.interval.unwrap_or(experiment.every);
        }
        let (machine, moves, controller) = (case.machine.clone(), case.moves.clone(), case.controller.clone());
        let of_experiment: Vec<_> = OF_EXPERIMENT.iter().filter(|measure| plan.tells(measure.name)).collect();
        let of_move = OF_MOVE.iter().filter(|measure| plan.tells(measure.name)).collect();
        let sought = of_experiment.iter().flat_map(|measure| measure.seeks).copied().collect();
        Self { machine, experiments, moves, controller, of_experiment, of_move, sought }
    }

    /// The experiments and moves of each machine, and their figures.
    pub fn groups(&self) -> Vec<Group> {
        let experiments = self.experiments.iter().map(|experiment| Group {
            name: experiment.name.clone(),
            file: experiment.file_name(),
            is_move: false,
            figures: self.of_experiment.iter().copied().map(Figure::of).collect(),
        });
        let moves = self.moves.iter().map(|motion| Group {
            name: motion.name.clone(),
            file: motion.file_name(),
            is_move: true,
            figures: self.of_move.iter().copied().map(Figure::of).collect(),
        });
        experiments.chain(moves).collect()
    }

    /// Refuses a case whose own machine cannot be run.
    pub fn check(&self) -> Result<()> {
        for experiment in &self.experiments {
            solve::stream(&self.machine, experiment, Solver::of(&self.machine), &mut |_| Flow::Stop)?;
        }
        for motion in &self.moves {
            self.close(&self.machine, motion)?;
        }
        Ok(())
    }

    /// Runs one experiment of a machine, for its rows.
    pub fn stream(
        &self,
        machine: &Machine,
        experiment: usize,
        sink: &mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Outcome> {
        let experiment = self.experiments.get(experiment).ok_or_else(|| Error::new("there is no such experiment"))?;
        solve::stream(machine, experiment, Solver::of(machine), sink)
    }

    /// A move in closed loop; the controller takes every machine for the one of the case.
    fn close(&self, machine: &Machine, motion: &Move) -> Result<MoveRun> {
        let Some(design) = &self.controller else { return Err(Error::new("there is no controller")) };
        let setup = Setup {
            machine,
            model: &self.machine,
            design,
            profile: &motion.profile,
            until: motion.until,
            window: motion.window,
            solver: Solver::of(machine),
        };
        control::closed_loop(&setup)
    }
}

/// Runs one machine after another, and keeps what can be used again.
pub(super) struct Worker<'a> {
    axis: &'a Axis,
    pub machine: Machine,
    bench: Bench,
    held: Vec<Option<Held>>,
}

impl<'a> Worker<'a> {
    pub fn new(axis: &'a Axis) -> Self {
        let held = axis.experiments.iter().map(Held::last).collect();
        Self { axis, machine: axis.machine.clone(), bench: Bench::default(), held }
    }

    /// The machine as the case has it.
    pub fn reset(&mut self) -> &mut Machine {
        self.machine.clone_from(&self.axis.machine);
        &mut self.machine
    }

    /// Adds status and figures of all that the machine does.
    pub fn run(&mut self, values: &mut Vec<f64>) {
        let Self { axis, machine, bench, held } = self;
        let mounted = bench.mount(machine);
        for (experiment, held) in axis.experiments.iter().zip(held) {
            let mut meter = Meter::with(machine, *held).seeking(&axis.sought);
            let outcome = mounted.clone().and_then(|()| bench.observe(experiment, &mut meter));
            let told = outcome.map(|outcome| (status(&outcome), meter.finish(&outcome.events)));
            put_figures(told, &axis.of_experiment, |measure, metrics| (measure.of)(metrics), values);
        }
        for motion in &axis.moves {
            let told =
                mounted.clone().and_then(|()| axis.close(machine, motion)).map(|run| (status(&run.outcome), run));
            put_figures(told, &axis.of_move, |measure, run| (measure.of)(run), values);
        }
    }
}

//! The subject of a sweep: a machine, its experiments, and its moves in closed loop.

use super::measures::{self, Figure, Measure};
use super::{Group, put_figures, status};
use crate::case::{Case, Experiment, Move, Sweeping};
use crate::control::{self, MoveRun, Setup};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::metrics::{self, Held, Meter, Sought};
use crate::solve::{self, Bench, Flow, Outcome, Solver};
use crate::trajectory::Trajectory;

/// A machine as the case has it, and what each of those that are made of it does.
#[derive(Debug, Clone)]
pub(super) struct Subject {
    pub machine: Machine,
    experiments: Vec<Experiment>,
    moves: Vec<Move>,
    controller: Option<Design>,
    /// The figures that are told of experiments and of moves, and what experiments are followed for.
    of_experiment: Vec<metrics::Figure>,
    of_move: Vec<Measure>,
    sought: Sought,
}

impl Subject {
    /// That of a case, as planned.
    pub fn of(case: &Case, plan: &Sweeping) -> Self {
        let mut experiments = case.experiments.clone();
        for experiment in &mut experiments {
            // What was measured does not count here.
            experiment.log = None;
            experiment.every = plan.interval.unwrap_or(experiment.every);
        }
        let (machine, moves, controller) = (case.machine.clone(), case.moves.clone(), case.controller.clone());
        let mut of_experiment = metrics::figures(machine.kind, machine.stepper().is_some());
        of_experiment.retain(|figure| !(case.is_axis() && figure.row.again_on_an_axis) && plan.tells(&figure.name));
        let mut of_move = measures::of_move(machine.kind);
        of_move.retain(|measure| plan.tells(&measure.name));
        let seeks: Vec<_> = of_experiment.iter().filter_map(metrics::Figure::seek).collect();
        let sought = Sought::of(&machine, &machine.mechanism(), &seeks);
        Self { machine, experiments, moves, controller, of_experiment, of_move, sought }
    }

    /// The experiments and moves of each machine, and their figures.
    pub fn groups(&self) -> Vec<Group> {
        let experiments = self.experiments.iter().map(|experiment| Group {
            name: experiment.name.clone(),
            file: experiment.file_name(),
            is_move: false,
            figures: self.of_experiment.iter().map(Figure::of_experiment).collect(),
        });
        let moves = self.moves.iter().map(|motion| Group {
            name: motion.name.clone(),
            file: motion.file_name(),
            is_move: true,
            figures: self.of_move.iter().map(Figure::of_move).collect(),
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
            profiles: &motion.profiles,
            until: motion.until,
            window: motion.window,
            solver: Solver::of(machine),
        };
        control::closed_loop(&setup)
    }
}

/// Runs one machine after another, and keeps what can be used again.
pub(super) struct Worker<'a> {
    subject: &'a Subject,
    pub machine: Machine,
    bench: Bench,
    held: Vec<Option<Held>>,
}

impl<'a> Worker<'a> {
    pub fn new(subject: &'a Subject) -> Self {
        let held = subject.experiments.iter().map(Held::last).collect();
        Self { subject, machine: subject.machine.clone(), bench: Bench::default(), held }
    }

    /// The machine as the case has it.
    pub fn reset(&mut self) -> &mut Machine {
        self.machine.clone_from(&self.subject.machine);
        &mut self.machine
    }

    /// Adds status and figures of all that the machine does.
    pub fn run(&mut self, values: &mut Vec<f64>) {
        let Self { subject, machine, bench, held } = self;
        let mounted = bench.mount(machine);
        for (experiment, held) in subject.experiments.iter().zip(held) {
            let mut meter = Meter::with(machine, &subject.sought, *held, &experiment.inputs);
            let outcome = mounted.clone().and_then(|()| bench.observe(experiment, &mut meter));
            let told = outcome.map(|outcome| (status(&outcome), meter.finish(&outcome.events)));
            put_figures(told, &subject.of_experiment, |figure, metrics| figure.of(metrics).number(), values);
        }
        for motion in &subject.moves {
            let told =
                mounted.clone().and_then(|()| subject.close(machine, motion)).map(|run| (status(&run.outcome), run));
            put_figures(told, &subject.of_move, |measure, run| measure.of(run), values);
        }
    }
}

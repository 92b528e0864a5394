//! The subject of a sweep: a machine, its experiments, and its moves in closed loop.

use super::measures::{self, Figure, Measure};
use super::{Group, put_figures, status};
use crate::case::{Case, Experiment, Move, Running, Sweeping};
use crate::control::{self, MoveRun, Setup};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::metrics::{self, Extras, Held, Meter, Sought};
use crate::solve::{self, Bench, Flow, Job, Outcome, Solver};
use crate::trajectory::Trajectory;
use std::ops::Range;

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
    /// True if machines are run side by side.
    beside: bool,
}

impl Subject {
    /// That of a case, as planned.
    pub fn new(case: &Case, plan: &Sweeping) -> Self {
        let mut experiments = case.experiments.clone();
        for experiment in &mut experiments {
            // What was measured does not count here.
            experiment.log = None;
            experiment.every = plan.interval.unwrap_or(experiment.every);
        }
        let (machine, moves, controller) = (case.machine.clone(), case.moves.clone(), case.controller.clone());
        let mut of_experiment = metrics::figures(machine.kind, Extras::new(&machine));
        of_experiment.retain(|figure| !(case.is_axis() && figure.row.again_on_an_axis) && plan.tells(&figure.name));
        let mut of_move = measures::of_move(machine.kind, machine.stepper().is_some());
        of_move.retain(|measure| plan.tells(&measure.name));
        let seeks: Vec<_> = of_experiment.iter().filter_map(metrics::Figure::seek).collect();
        let sought = Sought::new(&machine, &machine.mechanism(), &seeks);
        let beside = plan.solver == Running::Beside && solve::runs_beside(&machine.mechanism(), &experiments);
        Self { machine, experiments, moves, controller, of_experiment, of_move, sought, beside }
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
            solve::stream(&self.machine, experiment, Solver::for_machine(&self.machine), &mut |_| Flow::Stop)?;
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
        solve::stream(machine, experiment, Solver::for_machine(machine), sink)
    }

    /// Adds status and figures of an experiment.
    fn tell(&self, run: Result<(Outcome, Meter)>, values: &mut Vec<f64>) {
        let told = run.map(|(outcome, meter)| (status(&outcome), meter.finish(&outcome.events)));
        put_figures(told, &self.of_experiment, |figure, metrics| figure.value(metrics).number(), values);
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
            solver: Solver::for_machine(machine),
        };
        control::closed_loop(&setup)
    }
}

/// Status and figures of experiments that were run side by side.
pub(super) struct Beside {
    first: u64,
    experiments: usize,
    /// By machine and experiment; none for a run that is left to the exact solver.
    told: Vec<Option<Vec<f64>>>,
}

impl Beside {
    /// Adds those of an experiment of a run, if they are there.
    fn put(&self, run: u64, experiment: usize, values: &mut Vec<f64>) -> bool {
        let place = (run - self.first) as usize * self.experiments + experiment;
        let told = self.told.get(place).and_then(Option::as_ref);
        values.extend(told.into_iter().flatten());
        told.is_some()
    }

    /// Adds those of all experiments of a run, if all are there.
    fn put_all(&self, run: u64, values: &mut Vec<f64>) -> bool {
        let place = (run - self.first) as usize * self.experiments;
        let all = self.told.get(place..place + self.experiments).filter(|all| all.iter().all(Option::is_some));
        values.extend(all.into_iter().flatten().flatten().flatten());
        all.is_some()
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

    /// Runs the machines with these numbers side by side, as `set` makes them; none if `stop` says so.
    pub fn run_beside(
        &mut self,
        runs: Range<u64>,
        set: impl Fn(&mut Machine, u64),
        stop: &dyn Fn() -> bool,
    ) -> Option<Beside> {
        let Self { subject, machine, held, .. } = self;
        let mut rows = Beside { first: runs.start, experiments: subject.experiments.len(), told: Vec::new() };
        if !subject.beside {
            return Some(rows);
        }
        rows.told.resize(rows.experiments * (runs.end - runs.start) as usize, None);
        let mut stopped = false;
        let first = runs.start;
        let going_on = runs.take_while(|_| {
            stopped |= stop();
            !stopped
        });
        let mut jobs = going_on.filter_map(|run| {
            machine.clone_from(&subject.machine);
            set(machine, run);
            // A machine that cannot be run is refused when its turn comes.
            let mechanism = solve::mechanism_for(machine, &subject.experiments).ok()?;
            let meter = |(experiment, held): (&'a Experiment, &Option<Held>)| {
                (experiment, Meter::with(machine, &subject.sought, *held, &experiment.inputs))
            };
            let runs = subject.experiments.iter().zip(&*held).map(meter).collect();
            Some(Job { number: (run - first) as usize, mechanism, runs })
        });
        let receive = &mut |number: usize, run: usize, told: Option<(Outcome, Meter)>| {
            rows.told[number * rows.experiments + run] = told.map(|(outcome, meter)| {
                let mut values = Vec::with_capacity(subject.of_experiment.len() + 1);
                subject.tell(Ok((outcome, meter)), &mut values);
                values
            });
        };
        solve::run_beside(&subject.machine.mechanism(), &subject.experiments, &mut jobs, receive);
        (!stopped).then_some(rows)
    }

    /// Adds status and figures of all that the machine of a run does, if all of it was run side by side.
    pub fn put(&self, run: u64, beside: &Beside, values: &mut Vec<f64>) -> bool {
        self.subject.moves.is_empty() && beside.put_all(run, values)
    }

    /// Adds status and figures of all that the machine does, but for runs that are told already.
    pub fn run(&mut self, run: u64, beside: &Beside, values: &mut Vec<f64>) {
        let Self { subject, machine, bench, held } = self;
        let mounted = bench.mount(machine);
        for (number, (experiment, held)) in subject.experiments.iter().zip(held).enumerate() {
            if beside.put(run, number, values) {
                continue;
            }
            let mut meter = Meter::with(machine, &subject.sought, *held, &experiment.inputs);
            let outcome = mounted.clone().and_then(|()| bench.observe(experiment, &mut meter));
            subject.tell(outcome.map(|outcome| (outcome, meter)), values);
        }
        for motion in &subject.moves {
            let told =
                mounted.clone().and_then(|()| subject.close(machine, motion)).map(|run| (status(&run.outcome), run));
            put_figures(told, &subject.of_move, |measure, run| measure.value(run), values);
        }
    }
}

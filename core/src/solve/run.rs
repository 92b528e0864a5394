//! Runs: a machine and a recorder, stepped by the provider of its inputs.

use super::exact::{self, Make};
use super::inputs::Pieces;
use super::known::Known;
use super::observe::{Observe, Output};
use super::running::{Running, Start};
use super::{Detail, Flow, Outcome, Solver, check, general};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::mechanism::{Mechanism, State};
use crate::plan::Experiment;
use crate::signal::Signal;
use crate::trajectory::Trajectory;
use std::sync::Arc;

/// The course of one run of a mechanism.
#[derive(Debug, Clone)]
pub struct Course {
    /// The input of each drive's amplifier.
    pub inputs: Vec<Signal>,
    /// The state at time zero.
    pub start: State,
    /// End of the run, s.
    pub until: f64,
    /// Output interval, s.
    pub every: f64,
}

impl Course {
    /// The course of this mechanism in an experiment.
    pub fn new(mechanism: &Mechanism, experiment: &Experiment) -> Self {
        let &Experiment { ref inputs, until, every, ref initial, .. } = experiment;
        Self { inputs: inputs.clone(), start: mechanism.begun(initial), until, every }
    }
}

/// Makes a run of the exact solver.
struct OfExact<'m, 'a> {
    mechanism: &'m Arc<Mechanism>,
    space: exact::Space,
    start: &'m Start,
    known: Known,
    output: Output<'a>,
}

impl<'a> Make for OfExact<'_, 'a> {
    type Made = Box<dyn Running + 'a>;

    fn make<const N: usize>(self) -> Self::Made {
        let Self { mechanism, space, start, known, output } = self;
        Box::new(exact::ExactRun::<N>::new(mechanism, space, start, known, output))
    }
}

/// A run whose inputs are set from outside, by a sampled controller or anything else that responds to the motion.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{Detail, Ending, Flow, Run, Solver};
/// use taut::machine::axis::CART;
///
/// // Full voltage until the cart has gone far enough, looked at every millisecond.
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let experiment = &case.experiments[0];
/// let mut last = 0.0;
/// let mut sink = |rows: &taut::trajectory::Trajectory| {
///     last = rows.get("cart_position").unwrap().last().copied().unwrap();
///     Flow::Continue
/// };
/// let mut run = Run::new(&case.machine, experiment, Solver::Exact, Detail::Full, None, &mut sink)?;
/// for k in 1..=1000 {
///     let voltage = if run.state().position[CART] < 0.05 { 10.0 } else { 0.0 };
///     if !run.hold(&[voltage], 1e-3 * f64::from(k)) {
///         break;
///     }
/// }
/// let outcome = run.finish();
/// assert!(outcome.ending == Ending::Complete && last > 0.05 && last < 0.08);
/// # Ok::<(), taut::Error>(())
/// ```
pub struct Run<'a> {
    running: Box<dyn Running + 'a>,
    /// Present time and end, s.
    time: f64,
    end: f64,
}

impl<'a> Run<'a> {
    /// A run of `experiment` on a machine; the experiment's own input is ignored, unless it is
    /// [followed](Self::follow). Rows go to `sink` in blocks, everything between rows to `observer`. Not for the
    /// paper's Table 3.
    pub fn new(
        machine: &Machine,
        experiment: &Experiment,
        solver: Solver,
        detail: Detail,
        observer: Option<&'a mut dyn Observe>,
        sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Self> {
        Self::reading((machine, machine.mechanism()), experiment, solver, detail, observer, sink)
    }

    /// Run of a machine whose mechanism has its own readings for the observer.
    pub fn reading(
        (machine, mechanism): (&Machine, Mechanism),
        experiment: &Experiment,
        solver: Solver,
        detail: Detail,
        observer: Option<&'a mut dyn Observe>,
        sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Self> {
        check::machine(machine)?;
        let mechanism = Arc::new(mechanism);
        check::experiment(&mechanism, experiment)?;
        let start = experiment.start(&mechanism);
        Self::from_mechanism(&mechanism, &start, (solver, 0), Known::default(), Output { detail, sink, observer })
    }

    /// Run of a checked mechanism, with inputs of at most this degree.
    pub(super) fn from_mechanism(
        mechanism: &Arc<Mechanism>,
        start: &Start,
        (solver, degree): (Solver, usize),
        known: Known,
        output: Output<'a>,
    ) -> Result<Self> {
        let end = start.until;
        let running: Box<dyn Running + 'a> = match solver {
            Solver::Exact => {
                check::piecewise_linear(mechanism)?;
                let space = exact::Space::new(mechanism, degree);
                exact::in_kernel(space.size(), OfExact { mechanism, space, start, known, output: output.within() })
            }
            Solver::General { tolerance } => {
                let fastest = check::fastest_rate(mechanism);
                general::check(fastest, start.until, tolerance)?;
                Box::new(general::GeneralRun::new(mechanism, start, (tolerance, fastest), output.within()))
            }
            Solver::Table3 { .. } => {
                return Err(Error::new("the paper's Table 3 has a fixed step and no sampled input")
                    .next("take the exact solver, or the general one"));
            }
        };
        Ok(Self { running, time: 0.0, end })
    }

    /// A run of any mechanism. Errors: a mechanism that the solver does not support.
    pub fn of_mechanism(
        mechanism: &Mechanism,
        course: &Course,
        solver: Solver,
        (detail, observer): (Detail, Option<&'a mut dyn Observe>),
        sink: &'a mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Self> {
        check::course(mechanism, course)?;
        let start = Start { state: course.start, until: course.until, every: course.every, noise: 0.0 };
        let degree = course.inputs.iter().map(Signal::degree).max().unwrap_or(0);
        let output = Output { detail, sink, observer };
        Self::from_mechanism(&Arc::new(mechanism.clone()), &start, (solver, degree), Known::default(), output)
    }

    /// Holds these inputs, one for each drive, from now until `until`, s, or to the end of the run; false if the run
    /// ended early.
    pub fn hold(&mut self, inputs: &[f64], until: f64) -> bool {
        self.running.set_input(&Pieces::held(inputs, self.time, until));
        self.advance(until)
    }

    /// Follows these inputs, one for each drive, with a constant added to each, from now until `until`, s, or to the
    /// end of the run; false if the run ended early.
    pub fn hold_added(&mut self, inputs: &[Signal], added: &[f64], until: f64) -> bool {
        loop {
            let end = self.running.set_signals(inputs, added, self.time).min(until);
            if !self.advance(end) {
                return false;
            }
            if self.time >= until.min(self.end) {
                return true;
            }
        }
    }

    /// Advances to `until`, s, or to the end of the run; false if the run ended early.
    fn advance(&mut self, until: f64) -> bool {
        let goes_on = self.time >= self.end || self.running.advance(until);
        if goes_on {
            self.time = self.time.max(until.min(self.end));
        }
        goes_on
    }

    /// Present time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The state now, in angles and positions.
    pub fn state(&self) -> State {
        self.running.state()
    }

    /// The current of a drive's motor now, A.
    pub fn current(&self, drive: usize) -> f64 {
        self.running.current(drive)
    }

    /// Ends the run: complete, with its last row, if it has reached its end, otherwise interrupted.
    pub fn finish(mut self) -> Outcome {
        self.running.finish(self.time >= self.end)
    }

    /// Runs to the end along these inputs, one for each drive, and ends the run.
    pub fn follow(self, inputs: &[Signal]) -> Outcome {
        self.along(inputs).0
    }

    /// Runs to the end along these signals.
    pub(super) fn along(mut self, signals: &[Signal]) -> (Outcome, Known) {
        loop {
            let until = self.running.set_signals(signals, &[], self.time);
            if self.time >= self.end || !self.advance(until) {
                break;
            }
        }
        (self.running.finish(self.time >= self.end), self.running.known())
    }
}

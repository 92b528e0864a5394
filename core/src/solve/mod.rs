//! Runs an experiment on a machine: choice of solver, events, ending and cost.

mod check;
mod choice;
mod coordinates;
mod derivatives;
mod engine;
mod estimate;
mod exact;
mod followed;
mod general;
mod inputs;
mod known;
mod observe;
mod pace;
mod polynomial;
mod propagator;
mod record;
mod roots;
mod rounding;
mod rules;
mod run;
mod running;
mod saved;
mod sensitivity;
mod simulator;
mod table3;
mod widest;

pub use crate::trajectory::Grid;
pub use choice::{Choice, SolverKind};
pub use estimate::ErrorEstimate;
pub use exact::{Job, Receive};
pub use general::{Dynamics, Quantity};
pub(crate) use inputs::applied;
pub(crate) use observe::NEWS;
use observe::Output;
pub use observe::{Closer, Curve, Extremes, Gap, Gaps, Observe, QUANTITIES, Reading, Stretch, reading};
pub use polynomial::{Polynomial, TERMS, integral, integral_of_product};
pub use run::{Course, Run};
pub use sensitivity::{Begun, Differentiated, Sensitivities, Variable};
pub use simulator::Simulator;

pub use check::machine as check_stage;
pub use check::{Jump, first_jump};

use crate::error::{Error, Result};
use crate::friction::Motion;
use crate::machine::Machine;
use crate::mechanism::{Mechanism, Part, Status, What};
use crate::plan::Experiment;
use crate::trajectory::Trajectory;
use std::fmt;
use std::sync::Arc;

/// Solver of the equations.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Solver {
    /// Modes and matrix exponentials: exact to rounding.
    #[default]
    Exact,
    /// Collocation with error-controlled steps between located events: any friction law, spans that follow the cart.
    General {
        /// Approximate error of positions at the belt, m.
        tolerance: f64,
    },
    /// The paper's Table 3 with a fixed step: a reproduction, not a recommendation.
    Table3 {
        /// Step, s; shortened so that steps fill the output interval.
        step: f64,
        /// Formula.
        method: Method,
    },
}

impl Solver {
    /// The general solver with the default tolerance, a nanometre; [`ErrorEstimate`] estimates the error of a run.
    pub const GENERAL: Self = Self::General { tolerance: 1e-9 };

    /// The solver for this machine: the exact one if possible.
    pub fn for_machine(machine: &Machine) -> Self {
        if machine.is_piecewise_linear() { Self::Exact } else { Self::GENERAL }
    }

    /// Solver of a mechanism.
    pub fn of_mechanism(mechanism: &Mechanism) -> Self {
        if mechanism.is_piecewise_linear() { Self::Exact } else { Self::GENERAL }
    }
}

/// A fixed-step formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// The classical formula of order four (Simulink's ode4).
    #[default]
    RungeKutta4,
    /// Order five (Simulink's ode5).
    DormandPrince5,
}

/// A change of mode: a body that starts to slide, stops or reverses, or another part that changes its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// The part.
    pub part: Part,
    /// The state before.
    pub from: Status,
    /// The state after.
    pub to: Status,
    /// Force (N) or torque (N m) on a body at that instant without friction; 0 for other parts.
    pub load: f64,
    /// True if rounding decided its time: a stop of a body whose speed decays asymptotically and would never reach zero
    /// exactly.
    pub by_rounding: bool,
}

impl Event {
    /// The number of the body, if it is one.
    pub fn body(&self) -> Option<usize> {
        match self.part.what {
            What::Body(body) => Some(body),
            _ => None,
        }
    }

    /// Adds it to `events`, unless the visible state is unchanged. A transient state of a part other than a body is
    /// skipped.
    fn note(mut self, events: &mut Vec<Event>) {
        // A body that returns to its state at once has not changed; one that stops and starts at once has reversed.
        let at_once = |e: &Event| self.time - e.time <= 4.0 * f64::EPSILON * self.time;
        let last = events.iter().rposition(|e| e.part == self.part).filter(|&last| at_once(&events[last]));
        if let Some(last) = last.filter(|&last| self.body().is_some() && events[last].from.code() == self.to.code()) {
            events.remove(last);
            return;
        }
        if let Some(last) = last.filter(|&last| self.body().is_some() && events[last].to.code() == self.from.code())
            && events[last].to == Motion::Stuck
        {
            self.from = events.remove(last).from;
        }
        let passed = |e: &Event| e.part == self.part && e.body().is_none();
        let now = events.iter().rev().take_while(|e| e.time == self.time);
        if let Some(back) = now.into_iter().position(passed) {
            self.from = events.remove(events.len() - 1 - back).from;
        }
        if !self.from.shows_as(self.to) {
            events.push(self);
        }
    }
}

/// A decision within rounding: a body at rest whose load equals its breakaway, or a body that rounding reverses
/// repeatedly. Parameters that differ in their last bit may lead to the other decision.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Tie {
    /// Time, s.
    pub time: f64,
    /// The body.
    pub part: Part,
}

impl Tie {
    /// Maximum number of stored ties.
    const MOST: usize = 1000;

    /// Adds it to `ties`, unless the same body is at rest since an earlier one.
    fn note(self, ties: &mut Vec<Tie>, events: &[Event]) {
        let is_new = match ties.iter().rfind(|tie| tie.part == self.part) {
            Some(tie) => events.iter().rev().any(|e| e.part == self.part && e.time > tie.time && e.time <= self.time),
            None => true,
        };
        if is_new && ties.len() < Self::MOST {
            ties.push(self);
        }
    }
}

/// Ending of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ending {
    /// At the end of the experiment.
    Complete,
    /// More events than the bound allows.
    TooManyEvents {
        /// Time reached, s.
        time: f64,
    },
    /// The cart left its travel, which has no end stops.
    LeftTravel {
        /// Time reached, s.
        time: f64,
    },
    /// A state became infinite or not a number; with a fixed step, already one beyond 1e9 m, rad, m/s, rad/s or A.
    Diverged {
        /// Time reached, s.
        time: f64,
    },
    /// The run would need more than 1e10 steps at its present rate.
    TooStiff {
        /// Time reached, s.
        time: f64,
        /// Steps forecast for the whole run.
        steps: f64,
    },
    /// The receiver of the results stopped the run.
    Interrupted {
        /// Time reached, s.
        time: f64,
    },
}

impl Ending {
    /// The time reached, s; none at the end of the experiment.
    pub fn time(&self) -> Option<f64> {
        match *self {
            Ending::Complete => None,
            Ending::TooManyEvents { time }
            | Ending::LeftTravel { time }
            | Ending::Diverged { time }
            | Ending::TooStiff { time, .. }
            | Ending::Interrupted { time } => Some(time),
        }
    }
}

impl fmt::Display for Ending {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Ending::Complete => write!(f, "the run is complete"),
            Ending::TooManyEvents { time } => write!(f, "too many events at {time} s: they accumulate there"),
            Ending::LeftTravel { time } => write!(f, "the cart left its travel at {time} s"),
            Ending::Diverged { time } => write!(f, "a state became infinite, or no number, at {time} s"),
            Ending::TooStiff { time, steps } => write!(
                f,
                "too stiff at {time} s: the run would need some {steps:.0e} steps, and {:.0e} are allowed",
                pace::MOST_STEPS
            ),
            Ending::Interrupted { time } => write!(f, "the run was interrupted at {time} s"),
        }
    }
}

/// The error of [`Simulator::advance`] and [`Dynamics::settle`] if they cannot continue.
impl std::error::Error for Ending {}

/// Cost of a run in operations, not seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Number of rows.
    pub samples: u64,
    /// Pieces of the input.
    pub pieces: u64,
    /// Modes for which equations were set up.
    pub modes: u64,
    /// Propagator matrices computed.
    pub propagators: u64,
    /// Steps taken: products of a propagator and a state, or steps of a fixed-step method.
    pub steps: u64,
    /// Intervals examined for an event.
    pub looks: u64,
    /// Taylor series of the state expanded.
    pub series: u64,
    /// Evaluations of the equations of motion (all but the exact solver).
    pub evaluations: u64,
}

/// Everything about a run except its rows.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Every stick, slip and reversal, in order.
    pub events: Vec<Event>,
    /// The first decisions within rounding that the exact solver detected.
    pub ties: Vec<Tie>,
    /// Its ending.
    pub ending: Ending,
    /// Its cost.
    pub cost: Cost,
    /// Bound of the position error: by rounding for the exact solver with given inputs, by [`ErrorEstimate`] for the
    /// general solver. `None` for Table 3, and for a run without rows of a machine in which errors can grow.
    pub error: Option<PositionError>,
    /// Number of events of the general solver whose condition (a speed of zero, a load at its breakaway, a limit at its
    /// level) does not hold at their time, since they were found too late. A run with any of these is unreliable.
    pub unmet: u64,
}

/// Bound of the error of positions at the belt (r φ₁, x, r φ₃).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionError {
    /// Bound of the error, m.
    pub value: f64,
    /// Largest distance from the start, m.
    pub way: f64,
}

impl PositionError {
    /// Largest error of a result that is called exact, m.
    pub(crate) const EXACT: f64 = 1e-9;

    /// True if it is small enough for the result to be called exact.
    pub fn is_exact(self) -> bool {
        self.value <= Self::EXACT
    }

    /// True if it exceeds a thousandth of the motion, so that the result is unreliable.
    pub fn hides_motion(self) -> bool {
        !self.is_exact() && self.value > 1e-3 * self.way
    }

    /// True if it is as large as the motion, which 64-bit numbers then do not determine.
    pub fn is_undetermined(self) -> bool {
        self.hides_motion() && self.value >= self.way
    }
}

/// A complete run in memory.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The columns of every quantity.
    pub trajectory: Trajectory,
    /// Events, ending and cost.
    pub outcome: Outcome,
}

/// The answer of the receiver of a block of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// More.
    Continue,
    /// Stop the run.
    Stop,
}

/// Columns of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Detail {
    /// All of them.
    #[default]
    Full,
    /// Position, speeds, voltage, current, forces and states, without friction, encoder and columns of optional parts.
    Lean,
    /// No rows at all: for an observer.
    None,
}

/// Runs experiments on one or several machines and reuses matrices: the same bits as [`stream`] in less time.
#[derive(Default)]
pub struct Bench {
    mounted: Option<(Machine, Arc<Mechanism>)>,
    known: known::Known,
    steps: u64,
}

impl Bench {
    /// Steps of all its runs so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Mounts a machine, unless it is mounted already. Errors: an invalid machine.
    pub fn mount(&mut self, machine: &Machine) -> Result<()> {
        if self.mounted.as_ref().is_some_and(|(mounted, _)| mounted == machine) {
            return Ok(());
        }
        self.known.clear();
        self.mounted = None;
        check::machine(machine)?;
        self.mounted = Some((machine.clone(), Arc::new(machine.mechanism())));
        Ok(())
    }

    /// Runs an experiment on it with the solver for that machine.
    pub fn run(
        &mut self,
        experiment: &Experiment,
        detail: Detail,
        sink: &mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Outcome> {
        self.go(experiment, Output { detail, sink, observer: None })
    }

    /// Simulates for an observer only, without rows.
    pub fn observe(&mut self, experiment: &Experiment, observer: &mut dyn Observe) -> Result<Outcome> {
        let sink = &mut |_: &Trajectory| Flow::Continue;
        self.go(experiment, Output { detail: Detail::None, sink, observer: Some(observer) })
    }

    fn go(&mut self, experiment: &Experiment, output: Output) -> Result<Outcome> {
        let Some((machine, mechanism)) = &self.mounted else { return Err(nothing_mounted()) };
        check::experiment(mechanism, experiment)?;
        let known = std::mem::take(&mut self.known);
        let (outcome, known) = go(mechanism, experiment, Solver::for_machine(machine), known, output)?;
        self.known = known;
        self.steps += outcome.cost.steps;
        Ok(outcome)
    }
}

/// True if machines of this mechanism can run side by side with these inputs: see [`run_beside`].
pub fn runs_beside(mechanism: &Mechanism, experiments: &[Experiment]) -> bool {
    exact::takes(mechanism, degree(experiments))
}

/// The highest power of time in the inputs.
fn degree(experiments: &[Experiment]) -> usize {
    experiments.iter().flat_map(|experiment| &experiment.inputs).map(|input| input.degree()).max().unwrap_or(0)
}

/// The mechanism of a machine for [`run_beside`]. Errors: an invalid machine, an experiment that it cannot run.
pub fn mechanism_for(machine: &Machine, experiments: &[Experiment]) -> Result<Arc<Mechanism>> {
    check::machine(machine)?;
    let mechanism = machine.mechanism();
    experiments.iter().try_for_each(|experiment| check::experiment(&mechanism, experiment))?;
    Ok(Arc::new(mechanism))
}

/// Runs machines of the structure of `mechanism` side by side, in lanes of vectors, each through its experiments, and
/// passes every run to `receive`.
///
/// Events and peaks are those of single runs, positions to 1e-12 m; the bits of a run depend on its machine and its
/// experiment alone. Runs that are better left to the exact solver come back without a result.
pub fn run_beside<'a, 'j, E: Extremes>(
    mechanism: &Mechanism,
    experiments: &[Experiment],
    jobs: &mut dyn Iterator<Item = Job<'a, E>>,
    receive: &'j mut Receive<'j, E>,
) {
    exact::run_beside(mechanism, degree(experiments), jobs, receive);
}

fn nothing_mounted() -> Error {
    Error::new("there is no stage to run").next("take one up with Bench::mount")
}

/// Runs `experiment` on `machine` and keeps everything in memory.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{Ending, Solver, simulate};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let solution = simulate(&case.machine, &case.experiments[0], Solver::Exact)?;
/// assert_eq!(solution.outcome.ending, Ending::Complete);
/// let positions = solution.trajectory.get("cart_position").unwrap();
/// assert_eq!(positions.len() as u64, case.experiments[0].samples());
/// # Ok::<(), taut::Error>(())
/// ```
pub fn simulate(machine: &Machine, experiment: &Experiment, solver: Solver) -> Result<Solution> {
    // Longer runs allocate more rows as needed.
    let rows = Grid::new(experiment.every, experiment.until).intervals().min(1 << 20) as usize + 1;
    let mut trajectory = Trajectory::default();
    let outcome = stream(machine, experiment, solver, &mut |block| {
        if trajectory.is_empty() {
            trajectory = Trajectory::with_capacity(&block.columns, rows);
        }
        trajectory.append(block);
        Flow::Continue
    })?;
    Ok(Solution { trajectory, outcome })
}

/// Runs `experiment` on a machine and passes its rows to `sink` in blocks, so that memory stays bounded.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{Ending, Flow, Solver, stream};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// // How far does the cart get?
/// let mut farthest: f64 = 0.0;
/// let outcome = stream(&case.machine, &case.experiments[0], Solver::Exact, &mut |rows| {
///     for &x in rows.get("cart_position").unwrap() {
///         farthest = farthest.max(x);
///     }
///     Flow::Continue
/// })?;
/// assert!(farthest > 0.05 && outcome.ending == Ending::Complete);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn stream(
    machine: &Machine,
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    run(machine, experiment, solver, Output { detail: Detail::Full, sink, observer: None })
}

/// Streams a run to a sink and to an observer of the motion between the rows: a [`crate::metrics::Meter`], or a
/// user-defined one.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::metrics::Meter;
/// use taut::solve::{Flow, Solver, stream_observed};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let experiment = &case.experiments[0];
/// let mut meter = Meter::new(&case.machine, experiment);
/// let outcome = stream_observed(&case.machine, experiment, Solver::Exact, &mut meter, &mut |_| Flow::Continue)?;
/// assert!(meter.finish(&outcome.events).drive().peak_current.value > 1.0);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn stream_observed(
    machine: &Machine,
    experiment: &Experiment,
    solver: Solver,
    observer: &mut dyn Observe,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    run(machine, experiment, solver, Output { detail: Detail::Full, sink, observer: Some(observer) })
}

fn run(machine: &Machine, experiment: &Experiment, solver: Solver, output: Output) -> Result<Outcome> {
    check::machine(machine)?;
    let mechanism = Arc::new(machine.mechanism());
    check::experiment(&mechanism, experiment)?;
    if let Solver::Table3 { step, method } = solver {
        check::piecewise_linear(&mechanism)?;
        return table3::run(machine, &mechanism, experiment, step, method, output);
    }
    Ok(go(&mechanism, experiment, solver, known::Known::default(), output)?.0)
}

/// Runs a mechanism along its inputs, and passes rows to `sink` and the motion between them to `observer`:
/// [`stream_observed`] for any mechanism.
pub fn stream_mechanism(
    mechanism: &Mechanism,
    course: &Course,
    solver: Solver,
    (detail, observer): (Detail, Option<&mut dyn Observe>),
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let observer = observer.map(|observer| -> &mut dyn Observe { observer });
    let run = Run::of_mechanism(mechanism, course, solver, (detail, observer), sink)?;
    Ok(run.along(&course.inputs).0)
}

/// Runs an experiment that was checked along its own input.
fn go(
    mechanism: &Arc<Mechanism>,
    experiment: &Experiment,
    solver: Solver,
    known: known::Known,
    output: Output,
) -> Result<(Outcome, known::Known)> {
    // Smooth inputs have their derivatives in the state.
    let degree = experiment.inputs.iter().map(|input| input.degree()).max().unwrap_or(0);
    let start = experiment.start(mechanism);
    let run = Run::from_mechanism(mechanism, &start, (solver, degree), known, output)?;
    Ok(run.along(&experiment.inputs))
}

impl Experiment {
    fn start(&self, mechanism: &Mechanism) -> running::Start {
        running::Start { state: mechanism.begun(&self.initial), until: self.until, every: self.every, noise: 0.0 }
    }
}

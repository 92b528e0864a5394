//! Runs an experiment on a stage: the choice of solver, the events, how it ended and what it cost.

mod check;
mod choice;
mod coordinates;
mod estimate;
mod exact;
mod general;
mod law;
mod observe;
mod pace;
mod propagator;
mod record;
mod roots;
mod rounding;
mod table3;

pub use crate::trajectory::Grid;
pub use choice::{Choice, Kind};
pub use estimate::ErrorEstimate;
use observe::Output;
pub use observe::{Curve, Gap, Observe, Polynomial, QUANTITIES, Reading, TERMS, reading};

use crate::case::Experiment;
use crate::error::{Error, Result};
use crate::plant::{Body, Part, Plant, State, Status};
use crate::signal::{DEGREE, Piece, Signal};
use crate::stage::Stage;
use crate::trajectory::Trajectory;

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Solver {
    /// Modes and matrix exponentials: exact to rounding.
    #[default]
    Exact,
    /// An adaptive formula between located events: any friction law, spans that follow the cart.
    General {
        /// Error allowed in each step: relative, and absolute for what is smaller than 1 rad, rad/s or A, or r and r/s.
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
    /// The general solver with the default tolerance: 3e-12 m on the paper's machine; [`ErrorEstimate`] says it for any run.
    pub const GENERAL: Self = Self::General { tolerance: 1e-9 };

    /// The solver for this stage: the exact one where it can be.
    pub fn of(stage: &Stage) -> Self {
        if stage.is_piecewise_linear() { Self::Exact } else { Self::GENERAL }
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

/// A body that starts to slide, stops, or turns back, or another part that begins to do something else.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// When, s.
    pub time: f64,
    /// Which part.
    pub part: Part,
    /// What it did before.
    pub from: Status,
    /// What it does after.
    pub to: Status,
    /// The force (N) or torque (N m) on a body at that moment, friction apart; 0 for other parts.
    pub load: f64,
    /// Whether rounding decided when it happened: a stop of a body whose speed tends to zero and in exact numbers never gets there.
    pub by_rounding: bool,
}

impl Event {
    /// The body, if it is one.
    pub fn body(&self) -> Option<Body> {
        match self.part {
            Part::Body(body) => Some(body),
            _ => None,
        }
    }

    /// Adds it to `events`, unless nothing that shows has changed. A part other than a body that passes through a state without
    /// staying there goes straight.
    fn note(mut self, events: &mut Vec<Event>) {
        let passed = |e: &Event| e.part == self.part && e.body().is_none();
        let now = events.iter().rev().take_while(|e| e.time == self.time);
        if let Some(back) = now.into_iter().position(passed) {
            self.from = events.remove(events.len() - 1 - back).from;
        }
        if self.from.code() != self.to.code() {
            events.push(self);
        }
    }
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ending {
    /// At the end of the experiment.
    Complete,
    /// More events than the bound allows.
    TooManyEvents {
        /// Time reached, s.
        time: f64,
    },
    /// The cart left its travel, and nothing stands there to stop it.
    LeftTravel {
        /// Time reached, s.
        time: f64,
    },
    /// A state became infinite or not a number; with a fixed step, already one beyond 1e9 m, rad, m/s, rad/s or A.
    Diverged {
        /// Time reached, s.
        time: f64,
    },
    /// Something in it changes so fast that at the pace so far it would need more than 1e10 steps.
    TooStiff {
        /// Time reached, s.
        time: f64,
        /// Steps forecast for the whole run.
        steps: f64,
    },
    /// The receiver of the results asked to stop.
    Interrupted {
        /// Time reached, s.
        time: f64,
    },
}

impl Ending {
    /// The time reached, s, where it was not the end of the experiment.
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

/// What a run cost, in pieces of work rather than seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Rows put out.
    pub samples: u64,
    /// Pieces of the input.
    pub pieces: u64,
    /// Modes for which equations were set up.
    pub modes: u64,
    /// Propagator matrices computed.
    pub propagators: u64,
    /// Steps taken: products of a propagator and a state, or steps of a fixed-step method.
    pub steps: u64,
    /// Intervals looked at for an event.
    pub looks: u64,
    /// Taylor series of the state expanded.
    pub series: u64,
    /// Evaluations of the equations of motion (all but the exact solver).
    pub evaluations: u64,
}

/// Everything about a run but its rows.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Every stick, slip and reversal, in order.
    pub events: Vec<Event>,
    /// How it ended.
    pub ending: Ending,
    /// What it cost.
    pub cost: Cost,
    /// By how much positions may be off: of the exact solver a bound of what rounding does; the general solver's is estimated by
    /// [`ErrorEstimate`], Table 3 with a fixed step has none.
    pub error: Option<PositionError>,
}

/// By how much positions at the belt (r φ₁, x, r φ₃) may be off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionError {
    /// That much, m.
    pub value: f64,
    /// How far the axis went at most from where it began, m.
    pub way: f64,
}

impl PositionError {
    /// Up to here a result is called exact, m.
    pub const EXACT: f64 = 1e-9;

    /// Whether it is small enough for the result to be called exact.
    pub fn is_exact(self) -> bool {
        self.value <= Self::EXACT
    }

    /// Whether it is more than a thousandth of the motion, so that the result is not to be relied on.
    pub fn hides_motion(self) -> bool {
        !self.is_exact() && self.value > 1e-3 * self.way
    }
}

/// A whole run in memory.
#[derive(Debug, Clone)]
pub struct Solution {
    /// What every quantity did.
    pub trajectory: Trajectory,
    /// Events, ending and cost.
    pub outcome: Outcome,
}

/// What the receiver of a block of rows wants next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// More.
    Continue,
    /// No more.
    Stop,
}

/// Decides the input while a run goes on: a sampled controller, or anything else that answers the motion.
pub trait Decide {
    /// The input from `time` (s) on, and until when it is held (s, after `time`), told the state and the motor current (A) just
    /// before. It is asked first at time zero, then whenever what it said has ended.
    fn decide(&mut self, time: f64, state: &State, current: f64) -> (f64, f64);
}

/// Which columns a run puts out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detail {
    /// All of them.
    #[default]
    Full,
    /// Position, speeds, voltage, current, forces and states, without friction, encoder and what the stage adds.
    Lean,
    /// No rows at all: for an observer.
    None,
}

/// Runs one experiment after another on one stage after another, and keeps what can be used again: bit for bit what [`stream`] gives,
/// sooner.
#[derive(Default)]
pub struct Bench {
    plant: Option<Plant>,
    laws: exact::Laws,
}

impl Bench {
    /// Takes up a stage, unless it is there already. Errors: what makes no sense as a machine.
    pub fn mount(&mut self, stage: &Stage) -> Result<()> {
        if self.plant.as_ref().is_some_and(|plant| plant.stage() == stage) {
            return Ok(());
        }
        self.laws.clear();
        self.plant = None;
        check::stage(stage)?;
        self.plant = Some(Plant::new(stage));
        Ok(())
    }

    /// Runs an experiment on it by the solver for that stage.
    pub fn run(
        &mut self,
        experiment: &Experiment,
        detail: Detail,
        sink: &mut dyn FnMut(&Trajectory) -> Flow,
    ) -> Result<Outcome> {
        let Some(plant) = &self.plant else { return Err(nothing_mounted()) };
        check::experiment(plant, experiment)?;
        let output = Output { detail, sink, observer: None };
        let source = Source::Signal(&experiment.input);
        run_with(plant, experiment, source, Solver::of(plant.stage()), &mut self.laws, output)
    }

    /// The same for an observer alone: no rows are made.
    pub fn observe(&mut self, experiment: &Experiment, observer: &mut dyn Observe) -> Result<Outcome> {
        let Some(plant) = &self.plant else { return Err(nothing_mounted()) };
        check::experiment(plant, experiment)?;
        let output = Output { detail: Detail::None, sink: &mut |_| Flow::Continue, observer: Some(observer) };
        let source = Source::Signal(&experiment.input);
        run_with(plant, experiment, source, Solver::of(plant.stage()), &mut self.laws, output)
    }
}

fn nothing_mounted() -> Error {
    Error::new("there is no stage to run").next("take one up with Bench::mount")
}

/// Where the input comes from.
enum Source<'a> {
    Signal(&'a Signal),
    Decided(&'a mut dyn Decide),
}

impl Source<'_> {
    /// The highest power of time in any piece.
    fn degree(&self) -> usize {
        match self {
            Source::Signal(signal) => signal.degree(),
            Source::Decided(_) => 0,
        }
    }
}

/// A piece on which the input is held; one that would not end after it begins has no end.
fn held(value: f64, start: f64, end: f64) -> Piece {
    let mut coefficients = [0.0; DEGREE + 1];
    coefficients[0] = value;
    Piece { start, end: if end > start { end } else { f64::INFINITY }, coefficients }
}

/// Runs `experiment` on `stage` and keeps everything in memory.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{Ending, Solver, simulate};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let solution = simulate(&case.stage, &case.experiments[0], Solver::Exact)?;
/// assert_eq!(solution.outcome.ending, Ending::Complete);
/// let positions = solution.trajectory.get("cart_position").unwrap();
/// assert_eq!(positions.len() as u64, case.experiments[0].samples());
/// # Ok::<(), taut::Error>(())
/// ```
pub fn simulate(stage: &Stage, experiment: &Experiment, solver: Solver) -> Result<Solution> {
    // What does not fit at once is asked for as it comes.
    let rows = Grid::new(experiment.every, experiment.until).intervals().min(1 << 20) as usize + 1;
    let mut trajectory = Trajectory::default();
    let outcome = stream(stage, experiment, solver, &mut |block| {
        if trajectory.is_empty() {
            trajectory = Trajectory::with_capacity(&block.columns, rows);
        }
        trajectory.append(block);
        Flow::Continue
    })?;
    Ok(Solution { trajectory, outcome })
}

/// Runs `experiment` on `stage` and hands its rows to `sink` in blocks, so that memory stays bounded however long it is.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{Ending, Flow, Solver, stream};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// // How far does the cart get?
/// let mut farthest: f64 = 0.0;
/// let outcome = stream(&case.stage, &case.experiments[0], Solver::Exact, &mut |rows| {
///     for &x in rows.get("cart_position").unwrap() {
///         farthest = farthest.max(x);
///     }
///     Flow::Continue
/// })?;
/// assert!(farthest > 0.05 && outcome.ending == Ending::Complete);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn stream(
    stage: &Stage,
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let plant = checked(stage, experiment, solver)?;
    run(&plant, experiment, Source::Signal(&experiment.input), solver, Detail::Full, None, sink)
}

/// The same, with an observer that sees what is between the rows, too: a [`crate::metrics::Meter`], or one's own.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::metrics::Meter;
/// use taut::solve::{Flow, Solver, stream_observed};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let experiment = &case.experiments[0];
/// let mut meter = Meter::new(&case.stage, experiment);
/// let outcome = stream_observed(&case.stage, experiment, Solver::Exact, &mut meter, &mut |_| Flow::Continue)?;
/// assert!(meter.finish(&outcome.events).peak_current.value > 1.0);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn stream_observed(
    stage: &Stage,
    experiment: &Experiment,
    solver: Solver,
    observer: &mut dyn Observe,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let plant = checked(stage, experiment, solver)?;
    run(&plant, experiment, Source::Signal(&experiment.input), solver, Detail::Full, Some(observer), sink)
}

/// The same with an input that is decided as the run goes on; that of `experiment` counts for nothing.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::plant::{State, place};
/// use taut::solve::{Decide, Ending, Flow, Solver, stream_decided};
///
/// /// Full voltage until the cart has gone far enough, looked at every millisecond.
/// struct Switch;
/// impl Decide for Switch {
///     fn decide(&mut self, time: f64, state: &State, _: f64) -> (f64, f64) {
///         (if state[place::CART_POSITION] < 0.05 { 10.0 } else { 0.0 }, time + 1e-3)
///     }
/// }
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let mut last = 0.0;
/// let outcome = stream_decided(&case.stage, &case.experiments[0], &mut Switch, Solver::Exact, &mut |rows| {
///     last = rows.get("cart_position").unwrap().last().copied().unwrap();
///     Flow::Continue
/// })?;
/// assert!(outcome.ending == Ending::Complete && last > 0.05 && last < 0.08);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn stream_decided(
    stage: &Stage,
    experiment: &Experiment,
    decide: &mut dyn Decide,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let plant = checked(stage, experiment, solver)?;
    run(&plant, experiment, Source::Decided(decide), solver, Detail::Full, None, sink)
}

/// The same with an observer, and columns as `detail` has them.
pub fn stream_decided_observed(
    stage: &Stage,
    experiment: &Experiment,
    decide: &mut dyn Decide,
    solver: Solver,
    detail: Detail,
    observer: &mut dyn Observe,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let plant = checked(stage, experiment, solver)?;
    run(&plant, experiment, Source::Decided(decide), solver, detail, Some(observer), sink)
}

/// The equations of what makes sense as a run.
fn checked(stage: &Stage, experiment: &Experiment, solver: Solver) -> Result<Plant> {
    check::stage(stage)?;
    let plant = Plant::new(stage);
    check::experiment(&plant, experiment)?;
    if !matches!(solver, Solver::General { .. }) {
        check::piecewise_linear(stage)?;
    }
    Ok(plant)
}

fn run(
    plant: &Plant,
    experiment: &Experiment,
    source: Source,
    solver: Solver,
    detail: Detail,
    observer: Option<&mut dyn Observe>,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    let output = match observer {
        Some(observer) => Output { detail, sink, observer: Some(observer) },
        None => Output { detail, sink, observer: None },
    };
    run_with(plant, experiment, source, solver, &mut exact::Laws::default(), output)
}

fn run_with(
    plant: &Plant,
    experiment: &Experiment,
    source: Source,
    solver: Solver,
    laws: &mut exact::Laws,
    output: Output,
) -> Result<Outcome> {
    match (solver, source) {
        (Solver::General { tolerance }, source) => general::run(plant, experiment, source, tolerance, output),
        (Solver::Exact, source) => Ok(exact::run(plant, experiment, source, laws, output)),
        (Solver::Table3 { step, method }, Source::Signal(_)) => table3::run(plant, experiment, step, method, output),
        (Solver::Table3 { .. }, Source::Decided(_)) => {
            Err(Error::new("the paper's Table 3 has a fixed step and no sampled input")
                .next("take the exact solver, or the general one"))
        }
    }
}

//! The error of a run of the general solver, by a second run with another tolerance, other steps and coarser rounding.

use super::known::Known;
use super::observe::Output;
use super::run::Run;
use super::running::Start;
use super::{Course, Detail, Ending, Flow, Outcome, PositionError, Solver, general};
use crate::error::Result;
use crate::machine::Machine;
use crate::mechanism::{Mechanism, Shown};
use crate::plan::Experiment;
use crate::signal::Signal;
use crate::trajectory::Trajectory;
use std::sync::Arc;

/// Rows that are compared, at most.
const MOST_ROWS: u64 = 1000;

/// The tolerance of the second run, as a multiple of the first one's.
const FACTOR: f64 = 100.0;

/// Candidates for the rows of the second run per compared row. Steps are halves and doubles of a run's output interval:
/// if the intervals differ by a power of two, both runs take the same steps.
const ROWS: [u64; 3] = [3, 2, 5];

/// The estimate as a multiple of the difference of the two runs, and its least value relative to the tolerance: if the
/// tolerance limits the steps of neither run (corners of a friction curve, or of a line along the travel), both have
/// about the same error.
const SAFETY: f64 = 10.0;
const LEAST: f64 = 0.1;

/// Relative change of the start in the second run, since its last digits can decide the motion if a force line feeds
/// it.
const OF_START: f64 = 4.0 * f64::EPSILON;

/// Relative changes of speeds by which the second run shows the growth of rounding errors: 64 times their rounding.
const NOISE: f64 = 64.0 * f64::EPSILON;

/// Receiver of rows.
type Sink<'a> = dyn FnMut(&Trajectory) -> Flow + 'a;

/// Error estimate of a run, by comparison of some of its rows with a second run.
///
/// The error of a step is about proportional to the tolerance, so the second run, with a hundred times the tolerance,
/// has a far larger error than the first: ten times their difference is a safe estimate, and it is never below a tenth
/// of the tolerance. Steps and rows of the second run differ, so that no event is located in the same step of both.
/// Inertias, forces and force lines of its machine are perturbed by a few roundings, and its speeds at random by 64
/// times their rounding. If the motion amplifies rounding (flanks that rattle, loads just at a breakaway), the two runs
/// show by how much.
///
/// The estimate is at least the whole motion if an event was located at which its condition does not hold
/// ([`Outcome::unmet`]), or if the second run ends differently.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{ErrorEstimate, Flow, Solver, stream};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let (stage, experiment) = (&case.machine, &case.experiments[0]);
/// let mut estimate = ErrorEstimate::new(stage, experiment);
/// let outcome = stream(stage, experiment, Solver::GENERAL, &mut |rows| {
///     estimate.take(rows);
///     Flow::Continue
/// })?;
/// let error = estimate.finish(stage, experiment, 1e-9, &outcome, &mut || Flow::Continue)?.unwrap();
/// assert!(error.value < 1e-9 && error.way > 0.05);
/// # Ok::<(), taut::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct ErrorEstimate {
    /// Columns of the compared positions, each with the factor that converts it to a length at the belt.
    ways: Vec<(String, f64)>,
    every: f64,
    until: f64,
    stride: u64,
    rows: u64,
    /// Time of each row kept.
    times: Vec<f64>,
    /// Its positions at the belt, row after row.
    kept: Vec<f64>,
}

impl ErrorEstimate {
    /// The solver of the second run. A sampled controller answers to the counts of an encoder, which a coarser run
    /// would read differently far more often than the first one: its second run has a hundredth of the tolerance.
    pub fn second(first: Solver, is_sampled: bool) -> Solver {
        match first {
            Solver::General { tolerance } if is_sampled => {
                Solver::General { tolerance: f64::max(tolerance / FACTOR, *general::TOLERANCES.start()) }
            }
            Solver::General { tolerance } if FACTOR * tolerance <= 1e-2 => {
                Solver::General { tolerance: FACTOR * tolerance }
            }
            Solver::General { tolerance } => Solver::General { tolerance: tolerance / FACTOR },
            other => other,
        }
    }

    /// Basis of the error of a run, in words: a bound for the exact solver with given inputs, else a second run.
    pub fn basis(first: Solver, is_sampled: bool) -> &'static str {
        match first {
            Solver::General { .. } if is_sampled => "a second run with a hundredth of the tolerance",
            Solver::General { .. } => "a second run with a hundred times the tolerance",
            _ if is_sampled => "a second run with other roundings",
            _ => "bound of rounding",
        }
    }

    /// For a run of this experiment on this machine.
    pub fn new(machine: &Machine, experiment: &Experiment) -> Self {
        let mechanism = machine.mechanism();
        Self::of_mechanism(&mechanism, &Course::new(&mechanism, experiment))
    }

    /// For a run of any mechanism: positions of all bodies except rotors.
    pub fn of_mechanism(mechanism: &Mechanism, course: &Course) -> Self {
        let way = |heading: &crate::mechanism::Heading| match heading.shown {
            Shown::Position(body, 1.0) if heading.lean && !mechanism.bodies[body].is_rotor => {
                Some((heading.name.to_string(), mechanism.bodies[body].kind.lever()))
            }
            _ => None,
        };
        let ways = mechanism.columns.iter().filter_map(way).collect();
        let (every, until) = (course.every, course.until);
        let intervals = (until / every).clamp(1.0, 1e15) as u64;
        let stride = intervals.div_ceil(MOST_ROWS).max(1);
        Self { ways, every, until, stride, rows: 0, times: Vec::new(), kept: Vec::new() }
    }

    /// Takes the next rows of the run.
    pub fn take(&mut self, block: &Trajectory) {
        let columns = columns(&self.ways, block);
        for (row, &time) in block.get("time").unwrap_or(&[]).iter().enumerate() {
            if (self.rows + row as u64).is_multiple_of(self.stride) {
                self.times.push(time);
                self.kept.extend(columns.iter().map(|way| way.at(row)));
            }
        }
        self.rows += block.len() as u64;
    }

    /// Repeats the run with another tolerance and compares. Calls `flow` from time to time; returns `None` if that
    /// stops the run.
    pub fn finish(
        self,
        machine: &Machine,
        experiment: &Experiment,
        tolerance: f64,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let mechanism = machine.mechanism();
        let course = Course::new(&mechanism, experiment);
        self.finish_mechanism(&mechanism, &course, tolerance, outcome, flow)
    }

    /// Finishes the estimate for a run of a mechanism.
    pub fn finish_mechanism(
        self,
        mechanism: &Mechanism,
        course: &Course,
        tolerance: f64,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let first = Solver::General { tolerance };
        let solvers = [first, Self::second(first, false)];
        self.finish_driven(mechanism, course, solvers, (outcome, flow), &mut |run| run.follow(&course.inputs))
    }

    /// Finishes the estimate for a run whose inputs are set from outside, or are those of the course. `solvers` are
    /// those of the first and of the second run; `drive` runs the second one to its end.
    pub fn finish_driven(
        self,
        mechanism: &Mechanism,
        course: &Course,
        [first, second]: [Solver; 2],
        (outcome, flow): (&Outcome, &mut dyn FnMut() -> Flow),
        drive: &mut dyn FnMut(Run) -> Outcome,
    ) -> Result<Option<PositionError>> {
        let every = course.every * self.stride as f64 / rows_between(self.stride) as f64;
        let mut start = Start { state: course.start, until: course.until, every, noise: NOISE };
        let state = &mut start.state;
        let values = state.position.iter_mut().chain(&mut state.speed).chain(&mut state.current);
        values.for_each(|value| *value *= 1.0 + OF_START);
        let degree = course.inputs.iter().map(Signal::degree).max().unwrap_or(0);
        let mechanism = Arc::new(mechanism.nudged());
        let tolerance = if let Solver::General { tolerance } = first { tolerance } else { 0.0 };
        self.compare((outcome, tolerance), flow, &mut |sink| {
            let output = Output { detail: Detail::Lean, sink, observer: None };
            Ok(drive(Run::from_mechanism(&mechanism, &start, (second, degree), Known::default(), output)?))
        })
    }

    fn compare(
        self,
        (outcome, tolerance): (&Outcome, f64),
        flow: &mut dyn FnMut() -> Flow,
        again: &mut dyn FnMut(&mut Sink) -> Result<Outcome>,
    ) -> Result<Option<PositionError>> {
        // A run that ended early is compared up to its end.
        let until = outcome.ending.time().unwrap_or(self.until);
        let (mut apart, mut way, mut largest): (f64, f64, f64) = (0.0, 0.0, 0.0);
        let width = self.ways.len();
        for row in self.kept.chunks(width.max(1)) {
            for (value, start) in row.iter().zip(&self.kept) {
                (way, largest) = (way.max((value - start).abs()), largest.max(value.abs()));
            }
        }
        let (mut row, mut interrupted) = (0, false);
        let second = again(&mut |block| {
            let columns = columns(&self.ways, block);
            for (j, &time) in block.get("time").unwrap_or(&[]).iter().enumerate() {
                // The last row of the two may be at different times.
                let near = 1e-9 * self.every;
                while self.times.get(row).is_some_and(|t| *t < time - near) {
                    row += 1;
                }
                let Some(&t) = self.times.get(row) else { break };
                if t > time + near || t > until {
                    continue;
                }
                for (first, way) in self.kept[row * width..].iter().zip(&columns) {
                    let difference = (first - way.at(j)).abs();
                    apart = if difference.is_nan() { f64::INFINITY } else { apart.max(difference) };
                }
            }
            interrupted |= flow() == Flow::Stop;
            if interrupted { Flow::Stop } else { Flow::Continue }
        })?;
        // Output far from the origin is rounded.
        let mut value = (SAFETY * apart + 2.0 * f64::EPSILON * largest).max(LEAST * tolerance);
        if outcome.unmet > 0 || second.unmet > 0 || !ends_alike(outcome.ending, second.ending) {
            value = value.max(way);
        }
        Ok((!interrupted).then_some(PositionError { value, way }))
    }
}

/// Rows of the second run per compared row, if the first run has `stride`: log₂ of the ratio of the two numbers is as
/// far as possible from an integer.
fn rows_between(stride: u64) -> u64 {
    let off = |rows: &u64| ((stride as f64 / *rows as f64).log2().rem_euclid(1.0) - 0.5).abs();
    ROWS.into_iter().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(ROWS[0])
}

/// True if two runs end alike, or one of them was interrupted.
fn ends_alike(first: Ending, second: Ending) -> bool {
    let is_stopped = |ending| matches!(ending, Ending::Interrupted { .. });
    is_stopped(first) || is_stopped(second) || std::mem::discriminant(&first) == std::mem::discriminant(&second)
}

/// A column of positions, and its lever.
struct PositionColumn<'a> {
    values: &'a [f64],
    lever: f64,
}

impl PositionColumn<'_> {
    /// At the belt, m; NaN for a missing row.
    fn at(&self, row: usize) -> f64 {
        self.values.get(row).map_or(f64::NAN, |value| self.lever * value)
    }
}

/// The columns of these positions.
fn columns<'a>(ways: &[(String, f64)], block: &'a Trajectory) -> Vec<PositionColumn<'a>> {
    ways.iter().map(|(name, lever)| PositionColumn { values: block.get(name).unwrap_or(&[]), lever: *lever }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{Friction, Law, Shape, Side};
    use crate::machine::{Amplifier, AmplifierMode, Belt, BeltModel, DriveUnit, MachineKind, Motor, Pulley, Slide};
    use crate::mechanism::State;
    use crate::solve::simulate;

    /// Bristles under the drive pulley, Stribeck curves under cart and idler pulley, a rigid belt.
    fn curved() -> Machine {
        let side = |viscous: f64, coulomb: f64, breakaway: f64| Side { viscous, coulomb, breakaway };
        let drive = Friction::sided(side(0.0, 0.015554, 0.027304), side(0.0035936, 0.020009, 0.025303));
        let cart = Friction::sided(side(3.9442, 0.0, 0.0), side(7.1134, 0.059874, 0.087597));
        let idler = Friction::sided(side(0.0023166, 0.0, 0.0), side(0.0029288, 0.0071805, 0.010469));
        let bristles = Law::LuGre { velocity: 4.2645, stiffness: 6.9088, damping: 1.5886e-4 };
        let gaussian = Law::Stribeck { velocity: 0.0066354, shape: Shape::Gaussian };
        let exponential = Law::Stribeck { velocity: 20.283, shape: Shape::Exponential };
        let motor = Motor { inductance: 8.375e-4, ..Motor::brushed(0.045934, 1.0683) };
        let mut belt = Belt::given([2062.0, 4735.0, 157_335.0], [0.0; 3]);
        belt.model = BeltModel::Rigid;
        let mut slide = Slide::new(0.65359, cart.following(gaussian));
        slide.load = -0.1463;
        Machine {
            kind: MachineKind::Axis,
            drives: vec![DriveUnit { motor, amplifier: Amplifier::ideal(AmplifierMode::Voltage, 1.1517) }],
            pulley_radius: 0.021866,
            drive_pulley: Pulley { inertia: 1.0467e-5, friction: drive.following(bristles) },
            idler_pulley: Pulley { inertia: 2.2482e-5, friction: idler.following(exponential) },
            bridge: None,
            yaw: None,
            cart: slide,
            belt,
            encoder: None,
            scale: None,
        }
    }

    /// With every third row compared, both runs had the same steps: a random machine like this one had an error of 13
    /// nm with 2200 rows, and of 840 nm with 100 rows, where 11 nm were stated.
    #[test]
    fn an_estimate_did_not_depend_on_the_number_of_rows() {
        let points = vec![[0.034068, -7.7184], [0.071573, 11.963], [0.13486, 9.8118], [0.23144, 3.7546]];
        let machine = curved();
        let ran = |rows: u32, tolerance: f64| {
            let experiment = Experiment {
                name: "run".into(),
                inputs: vec![Signal::Table { points: points.clone() }],
                until: 0.2,
                every: 0.2 / f64::from(rows),
                initial: State::default(),
                log: None,
            };
            let run = simulate(&machine, &experiment, Solver::General { tolerance }).unwrap();
            let mut estimate = ErrorEstimate::new(&machine, &experiment);
            estimate.take(&run.trajectory);
            let flow = &mut || Flow::Continue;
            let error = estimate.finish(&machine, &experiment, tolerance, &run.outcome, flow).unwrap().unwrap();
            (run.trajectory.get("cart_position").unwrap().to_vec(), error.value)
        };
        let (best, left) = ran(100, 1e-13);
        for times in [10, 15, 21, 22, 25, 29] {
            let (fine, stated) = ran(100 * times, 1e-7);
            let off = fine.iter().step_by(times as usize).zip(&best).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            println!("{times}: {off:e} m, {stated:e} m stated");
            assert!(off <= stated + left, "{times}: {off:e} m, {stated:e} m stated");
        }
    }

    /// With every third row compared, both runs once had the same interval, steps and errors.
    #[test]
    fn the_second_run_never_had_the_steps_of_the_first() {
        assert_eq!(rows_between(1), 3);
        for stride in 1..10_000 {
            let ratio = stride as f64 / rows_between(stride) as f64;
            let nearest = ratio.log2().round().exp2();
            assert!((ratio / nearest).log2().abs() > 0.25, "{ratio} at every {stride}th row");
        }
    }
}

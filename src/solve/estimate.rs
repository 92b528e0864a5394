//! The error of a run of the general solver, by a second run with another tolerance.

use super::{Course, Detail, Flow, Outcome, PositionError, Solver, stream, stream_mechanism};
use crate::case::Experiment;
use crate::error::Result;
use crate::mechanism::{Mechanism, Shown};
use crate::stage::Stage;
use crate::trajectory::Trajectory;

/// Rows that are compared, at most.
const MOST_ROWS: u64 = 1000;

/// The tolerance of the second run, as a multiple of the first one's.
const FACTOR: f64 = 100.0;

/// Where rows go.
type Sink<'a> = dyn FnMut(&Trajectory) -> Flow + 'a;

/// Keeps some of a run's rows, and compares them with those of a second run.
///
/// The error of a step is about in proportion to the tolerance, so the second run, with a hundred times the tolerance, is
/// off by far more than the first: twice their difference is an estimate on the safe side. Steps are halves and doubles
/// of one length, so that with ten times the tolerance many were the same. Where the motion is
/// sensitive to its last digits (flanks that rattle, loads just at a breakaway) both differ by what that makes of them.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::solve::{ErrorEstimate, Flow, Solver, stream};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let (stage, experiment) = (&case.stage, &case.experiments[0]);
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
    /// Columns of the ways that are compared, and what makes lengths at the belt of them.
    ways: Vec<(String, f64)>,
    every: f64,
    until: f64,
    stride: u64,
    rows: u64,
    /// Time of each row kept.
    times: Vec<f64>,
    /// Its ways at the belt, one row after the other.
    kept: Vec<f64>,
}

impl ErrorEstimate {
    /// For a run of this experiment on this stage.
    pub fn new(stage: &Stage, experiment: &Experiment) -> Self {
        let r = stage.pulley_radius;
        let ways = [("drive_angle", r), ("cart_position", 1.0), ("idler_angle", r)];
        Self::along(ways.map(|(name, lever)| (name.to_string(), lever)).to_vec(), experiment.every, experiment.until)
    }

    /// For a run of a mechanism that is no stage of an axis: of every body whose way is a column.
    pub fn of_mechanism(mechanism: &Mechanism, course: &Course) -> Self {
        let way = |heading: &crate::mechanism::Heading| match heading.shown {
            Shown::Position(body, 1.0) => Some((heading.name.to_string(), mechanism.bodies[body].kind.lever())),
            _ => None,
        };
        Self::along(mechanism.columns.iter().filter_map(way).collect(), course.every, course.until)
    }

    fn along(ways: Vec<(String, f64)>, every: f64, until: f64) -> Self {
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
                self.kept.extend(columns.iter().map(|(values, lever)| lever * values[row]));
            }
        }
        self.rows += block.len() as u64;
    }

    /// Runs it again with another tolerance and compares; `flow` is asked now and then whether to go on. None where it
    /// said no.
    pub fn finish(
        self,
        stage: &Stage,
        experiment: &Experiment,
        tolerance: f64,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let second = Experiment { every: experiment.every * self.stride as f64, ..experiment.clone() };
        self.compare(outcome, flow, &mut |sink| stream(stage, &second, coarser(tolerance), sink).map(|_| ()))
    }

    /// The same of a run of a mechanism.
    pub fn finish_mechanism(
        self,
        mechanism: &Mechanism,
        course: &Course,
        tolerance: f64,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let second = Course { every: course.every * self.stride as f64, ..course.clone() };
        self.compare(outcome, flow, &mut |sink| {
            stream_mechanism(mechanism, &second, coarser(tolerance), (Detail::Lean, None), sink).map(|_| ())
        })
    }

    fn compare(
        self,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
        again: &mut dyn FnMut(&mut Sink) -> Result<()>,
    ) -> Result<Option<PositionError>> {
        // An early end is compared as far as it came.
        let until = outcome.ending.time().unwrap_or(self.until);
        let (mut value, mut way): (f64, f64) = (0.0, 0.0);
        let (mut row, mut interrupted) = (0, false);
        let width = self.ways.len();
        again(&mut |block| {
            let columns = columns(&self.ways, block);
            for (j, &time) in block.get("time").unwrap_or(&[]).iter().enumerate() {
                let Some(&t) = self.times.get(row) else { return Flow::Stop };
                let first = &self.kept[row * width..(row + 1) * width];
                row += 1;
                // The last row of the two may be at different times.
                if (t - time).abs() > 1e-9 * self.every || t > until {
                    continue;
                }
                for ((first, (values, lever)), start) in first.iter().zip(&columns).zip(&self.kept) {
                    value = value.max((first - lever * values[j]).abs());
                    way = way.max((first - start).abs());
                }
            }
            interrupted |= flow() == Flow::Stop;
            if interrupted { Flow::Stop } else { Flow::Continue }
        })?;
        // Twice the difference: events add to it what no tolerance is in proportion to.
        Ok((!interrupted).then_some(PositionError { value: 2.0 * value, way }))
    }
}

/// The columns of these ways, each with its lever.
fn columns<'a>(ways: &[(String, f64)], block: &'a Trajectory) -> Vec<(&'a [f64], f64)> {
    ways.iter().map(|(name, lever)| (block.get(name).unwrap_or(&[]), *lever)).collect()
}

fn coarser(tolerance: f64) -> Solver {
    let coarse = if FACTOR * tolerance <= 1e-2 { FACTOR * tolerance } else { tolerance / FACTOR };
    Solver::General { tolerance: coarse }
}

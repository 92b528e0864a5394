//! The error of a run of the general solver, by a second run with another tolerance.

use super::{Flow, Outcome, PositionError, Solver, stream};
use crate::case::Experiment;
use crate::error::Result;
use crate::stage::Stage;
use crate::trajectory::Trajectory;

/// Rows that are compared, at most.
const MOST_ROWS: u64 = 1000;

/// The tolerance of the second run, as a multiple of the first one's.
const FACTOR: f64 = 10.0;

/// Keeps some of a run's rows, and compares them with those of a second run.
///
/// The error of a step is about in proportion to the tolerance, so the second run, with ten times the tolerance, is off by about ten
/// times as much as the first: their difference is an estimate on the safe side. Where the motion is sensitive to its last digits
/// (flanks that rattle, loads just at a breakaway) both differ by what that makes of them.
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
    radius: f64,
    stride: u64,
    rows: u64,
    /// Time, r φ₁, x and r φ₃ of each row kept.
    kept: Vec<[f64; 4]>,
}

impl ErrorEstimate {
    /// For a run of this experiment on this stage.
    pub fn new(stage: &Stage, experiment: &Experiment) -> Self {
        let intervals = (experiment.until / experiment.every).clamp(1.0, 1e15) as u64;
        Self { radius: stage.pulley_radius, stride: intervals.div_ceil(MOST_ROWS).max(1), rows: 0, kept: Vec::new() }
    }

    /// Takes the next rows of the run.
    pub fn take(&mut self, block: &Trajectory) {
        let column = |name: &str| block.get(name).unwrap_or(&[]);
        let [time, drive, cart, idler] = ["time", "drive_angle", "cart_position", "idler_angle"].map(column);
        for (row, &time) in time.iter().enumerate() {
            if (self.rows + row as u64).is_multiple_of(self.stride) {
                self.kept.push([time, self.radius * drive[row], cart[row], self.radius * idler[row]]);
            }
        }
        self.rows += block.len() as u64;
    }

    /// Runs it again with another tolerance and compares; `flow` is asked now and then whether to go on. None where it said no.
    pub fn finish(
        self,
        stage: &Stage,
        experiment: &Experiment,
        tolerance: f64,
        outcome: &Outcome,
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let second = Experiment { every: experiment.every * self.stride as f64, ..experiment.clone() };
        // An early end is compared as far as it came.
        let until = outcome.ending.time().unwrap_or(experiment.until);
        let coarse = if FACTOR * tolerance <= 1e-2 { FACTOR * tolerance } else { tolerance / FACTOR };
        let (mut value, mut way): (f64, f64) = (0.0, 0.0);
        let (mut row, mut interrupted) = (0, false);
        stream(stage, &second, Solver::General { tolerance: coarse }, &mut |block| {
            let column = |name: &str| block.get(name).unwrap_or(&[]);
            let [time, drive, cart, idler] = ["time", "drive_angle", "cart_position", "idler_angle"].map(column);
            for (j, &time) in time.iter().enumerate() {
                let Some(&[t, p1, x, p3]) = self.kept.get(row) else { return Flow::Stop };
                row += 1;
                // The last row of the two may be at different times.
                if (t - time).abs() > 1e-9 * experiment.every || t > until {
                    continue;
                }
                let there = [self.radius * drive[j], cart[j], self.radius * idler[j]];
                for ((first, second), start) in [p1, x, p3].into_iter().zip(there).zip(&self.kept[0][1..]) {
                    value = value.max((first - second).abs());
                    way = way.max((first - start).abs());
                }
            }
            interrupted |= flow() == Flow::Stop;
            if interrupted { Flow::Stop } else { Flow::Continue }
        })?;
        Ok((!interrupted).then_some(PositionError { value, way }))
    }
}

//! The interface of a run to its solver.

use super::Outcome;
use super::inputs::Pieces;
use super::known::Known;
use crate::mechanism::State;
use crate::signal::Signal;

/// Initial state, end and output interval of a run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    pub(super) state: State,
    pub(super) until: f64,
    pub(super) every: f64,
    /// Relative changes of speeds after each step of the general solver, at random; zero in any run but the second one
    /// of an [`super::ErrorEstimate`].
    pub(super) noise: f64,
}

/// A run of one of the solvers.
pub(super) trait Running {
    /// Sets new inputs now.
    fn set_input(&mut self, pieces: &Pieces);

    /// The inputs as drives apply them: rounded to microsteps for a stepper.
    fn told(&self, pieces: Pieces) -> Pieces {
        pieces
    }

    /// Sets the pieces of these signals, with a constant added to each, from the present `time` on, and returns their
    /// end.
    fn set_signals(&mut self, signals: &[Signal], added: &[f64], time: f64) -> f64 {
        let pieces = self.told(Pieces::new(signals, time).plus(added));
        self.set_input(&pieces);
        pieces.end
    }

    /// Advances to `until`, or to the end of the run; false if it ends before.
    fn advance(&mut self, until: f64) -> bool;

    fn state(&self) -> State;

    fn current(&self, drive: usize) -> f64;

    /// Ends the run: at its end, with the last row, or before.
    fn finish(&mut self, is_at_end: bool) -> Outcome;

    /// The modes that it has prepared.
    fn known(&mut self) -> Known {
        Known::default()
    }
}

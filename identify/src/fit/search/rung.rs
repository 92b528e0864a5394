//! A strategy of a search, as a rung of its ladder.

use super::point::{Ending, Point, Strategy};
use crate::fit::asked::residuals::Residuals;
use crate::solve::Flow;

/// Receives the best point and its cost after each step, and may end the search.
pub(crate) type Watch<'a> = dyn FnMut(&[f64], f64) -> Flow + 'a;

/// End of a rung.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Climb {
    /// At a minimum.
    Converged,
    /// The rung cannot continue, but the cost is lower or its pieces are known: the previous rung continues from here.
    Lowered,
    /// The rung does not lower the cost: the next one is tried.
    Passed,
    /// Ends the search: it was stopped, its iterations are used up, or there is no Jacobian.
    Ended(Ending),
}

/// A strategy that lowers the cost from a point.
pub(crate) trait Rung {
    /// Its name in results.
    fn strategy(&self) -> Strategy;

    /// True if it can do anything at this point.
    fn applies(&self, at: &Point) -> bool;

    /// Continues from `at` as long as that helps.
    fn climb(&mut self, at: &mut Point, problem: &mut dyn Residuals, watch: &mut Watch) -> Climb;
}

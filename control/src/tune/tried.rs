//! Designs run by a search by moves, and their weights.

use super::objective::AtWorst;
use crate::case::Cost;
use crate::design::Design;

/// A design that was run.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub design: Design,
    pub worst: Vec<AtWorst>,
    /// The finalist that it was made from, and its powers.
    pub layout: usize,
    pub powers: Vec<f64>,
}

/// Weights of a design in a search by moves.
pub(super) struct Weighed<'a> {
    pub cost: Cost,
    /// Bars that no figure may exceed.
    pub bars: Option<Bars<'a>>,
}

/// Figures before, and the penalty slopes of ln J.
#[derive(Clone, Copy)]
pub(super) struct Bars<'a> {
    pub figures: &'a [AtWorst],
    pub steep: f64,
}

//! Designs that a search by moves has run, and by what it weighs them.

use super::objective::AtWorst;
use crate::case::Cost;
use crate::design::Design;

/// A design that was run.
#[derive(Debug, Clone)]
pub(super) struct Tried {
    pub design: Design,
    pub worst: Vec<AtWorst>,
    /// The finalist that it was made from, and the powers that lead to it.
    pub layout: usize,
    pub powers: Vec<f64>,
}

/// By what a search by moves weighs a design.
pub(super) struct Weighed<'a> {
    pub cost: Cost,
    /// Figures that none may be worse than.
    pub bars: Option<Bars<'a>>,
}

/// Figures before, and how steeply ln J grows with what a figure is worse.
#[derive(Clone, Copy)]
pub(super) struct Bars<'a> {
    pub figures: &'a [AtWorst],
    pub steep: f64,
}

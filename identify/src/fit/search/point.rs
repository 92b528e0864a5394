//! A point of a search: how far to go, and where it ended.

use nalgebra::DMatrix;

/// How far to go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Standard errors that the last step may promise.
    pub tolerance: f64,
    /// Most Jacobians.
    pub iterations: usize,
    /// Beyond this many units a residual counts linearly (Huber 1964); infinite for squares.
    pub huber: f64,
    /// One-sided differences until the last few steps.
    pub frugal: bool,
    /// How often an evolution strategy may go on where derivatives do not help.
    pub evolutions: usize,
    /// Residuals as small as this are taken for rounding, and not for what tells how good a step has to be.
    pub rounding: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { tolerance: 1e-3, iterations: 100, huber: f64::INFINITY, frugal: true, evolutions: 2, rounding: 0.0 }
    }
}

/// How a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The projected gradient is zero to within the tolerance.
    Converged,
    /// No step lowers the cost, but the projected gradient is not zero: a kink.
    Stalled,
    /// The iterations were used up.
    OutOfIterations,
    /// It was asked to stop.
    Interrupted,
    /// The residuals could not be computed where it started.
    Failed,
}

impl Ending {
    /// For files.
    pub fn word(self) -> &'static str {
        match self {
            Ending::Converged => "converged",
            Ending::Stalled => "stalled",
            Ending::OutOfIterations => "out_of_iterations",
            Ending::Interrupted => "interrupted",
            Ending::Failed => "failed",
        }
    }
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// The variables.
    pub x: Vec<f64>,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// ½ Σ ρ(r).
    pub cost: f64,
    /// The Jacobian there, by central differences where the search converged.
    pub jacobian: DMatrix<f64>,
    /// The gain that the next step promised, in standard errors.
    pub decrement: f64,
    /// Variables held at a bound.
    pub at_bound: Vec<bool>,
    /// How it ended.
    pub ending: Ending,
    /// Steps of the derivatives, in standard errors, where the cost has kinks; 0 where it is smooth.
    pub coarse: f64,
    /// How many gradients around balance there; more than one at a kink.
    pub pieces: usize,
    /// How often an evolution strategy went on where derivatives did not help.
    pub evolved: usize,
    /// Jacobians computed.
    pub iterations: usize,
    /// Trial points.
    pub evaluations: usize,
}

/// ½ Σ ρ(r), ρ = r² up to the threshold and 2 k |r| − k² beyond.
pub(crate) fn cost_of(r: &[f64], k: f64) -> f64 {
    r.iter().map(|&r| if r.abs() <= k { 0.5 * r * r } else { k * r.abs() - 0.5 * k * k }).sum()
}

//! Options, points and results of a search.

use super::linear::Linear;
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::SHOWS;
use nalgebra::{DMatrix, DVector};

/// Options of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Largest predicted gain of the last step, in standard errors.
    pub tolerance: f64,
    /// Maximum number of Jacobians.
    pub iterations: usize,
    /// Beyond this many units a residual counts linearly (Huber 1964); infinite for squares.
    pub huber: f64,
    /// One-sided differences until the last few steps.
    pub frugal: bool,
    /// True if differences become central in the last few steps.
    pub sharp: bool,
    /// Largest number of uses of an evolution strategy.
    pub evolutions: usize,
    /// Residuals up to this size count as rounding, and do not determine the accuracy of a step.
    pub rounding: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 1e-3,
            iterations: 100,
            huber: f64::INFINITY,
            frugal: true,
            sharp: true,
            evolutions: 2,
            rounding: 0.0,
        }
    }
}

/// End of a search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The projected gradient is zero to within the tolerance.
    Converged,
    /// No step lowers the cost, but the projected gradient is not zero: a kink.
    Stalled,
    /// The maximum number of iterations was reached.
    OutOfIterations,
    /// It was stopped.
    Interrupted,
    /// The residuals could not be computed at its start.
    Failed,
}

impl Ending {
    /// Its name in files.
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

/// A strategy of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Strategy {
    /// Damped steps by the derivatives at the point.
    Damped,
    /// A bundle of gradients around a kink.
    Bundle,
    /// An evolution strategy, which needs no derivatives.
    Evolution,
}

/// Result of a search.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Minimum {
    /// The variables.
    pub x: Vec<f64>,
    /// The residuals there.
    pub residuals: Vec<f64>,
    /// ½ Σ ρ(r).
    pub cost: f64,
    /// The Jacobian there, by central differences if the search converged.
    pub jacobian: DMatrix<f64>,
    /// Predicted gain of the next step, in standard errors.
    pub decrement: f64,
    /// Variables held at a bound.
    pub at_bound: Vec<bool>,
    /// Its end.
    pub ending: Ending,
    /// Its last strategy; `None` without a search.
    pub strategy: Option<Strategy>,
    /// Number of gradients that balance there; more than one at a kink.
    pub pieces: usize,
    /// Number of uses of an evolution strategy.
    pub evolved: usize,
    /// Jacobians computed.
    pub iterations: usize,
    /// Trial points.
    pub evaluations: usize,
}

impl Minimum {
    /// A start within the bounds, whose residuals are not known yet.
    fn unknown(start: &[f64], rows: usize, bounds: &Bounds) -> Self {
        let n = start.len();
        Self {
            x: start.iter().enumerate().map(|(j, x)| x.clamp(bounds.low[j], bounds.high[j])).collect(),
            residuals: vec![0.0; rows],
            cost: f64::INFINITY,
            jacobian: DMatrix::zeros(rows, n),
            decrement: f64::INFINITY,
            at_bound: vec![false; n],
            ending: Ending::Failed,
            strategy: None,
            pieces: 1,
            evolved: 0,
            iterations: 0,
            evaluations: 1,
        }
    }

    /// A start with its residuals and derivatives, in one run where these are exact; `None` if they cannot be computed.
    pub(crate) fn linearised(problem: &mut dyn Residuals, start: &[f64], bounds: &Bounds) -> Option<Self> {
        let mut own = Self::unknown(start, problem.rows(), bounds);
        own.jacobian = problem.linearised(&own.x, &mut own.residuals, bounds, &Differences::Forward)?;
        own.cost = cost_of(&own.residuals, f64::INFINITY);
        own.cost.is_finite().then_some(own)
    }

    /// The decrease of the cost that the linear model predicts for the whole step from here.
    pub(crate) fn promise(&self) -> f64 {
        let model = Linear::new(&self.jacobian, &self.residuals, f64::INFINITY);
        let scale = DVector::from_fn(self.x.len(), |j, _| model.norm(j));
        model.promise(&model.step(&self.at_bound, &scale, 0.0))
    }
}

/// ½ Σ ρ(r), ρ = r² up to the threshold and 2 k |r| − k² beyond.
pub(crate) fn cost_of(r: &[f64], k: f64) -> f64 {
    r.iter().map(|&r| if r.abs() <= k { 0.5 * r * r } else { k * r.abs() - 0.5 * k * k }).sum()
}

/// A point of a search, with the linear model of the residuals at its last Jacobian.
#[derive(Debug, Clone)]
pub(crate) struct Point<'a> {
    /// The best point so far, with its effort.
    pub best: Minimum,
    pub bounds: &'a Bounds,
    pub options: &'a Options,
    /// J and r.
    pub model: Linear,
    /// D: greatest norms of the columns of J so far.
    pub scale: DVector<f64>,
    /// Standard deviation of the residuals, as if they were independent.
    pub deviation: f64,
    /// True if the Jacobian is exact.
    pub is_exact: bool,
    /// True if the Gauss-Newton step is within rounding.
    is_still: bool,
}

impl<'a> Point<'a> {
    /// The start of a search, moved within the bounds. Returns an error if the residuals cannot be computed there.
    pub fn new(
        problem: &mut dyn Residuals,
        start: &[f64],
        bounds: &'a Bounds,
        options: &'a Options,
    ) -> Result<Self, Box<Minimum>> {
        let mut best = Minimum::unknown(start, problem.rows(), bounds);
        if !problem.evaluate(&best.x, &mut best.residuals) || !best.residuals.iter().all(|r| r.is_finite()) {
            return Err(Box::new(best));
        }
        best.cost = cost_of(&best.residuals, options.huber);
        Ok(Self::at(best, bounds, options))
    }

    /// A point whose residuals are known.
    pub fn at(best: Minimum, bounds: &'a Bounds, options: &'a Options) -> Self {
        let n = best.x.len();
        let (model, scale) = (Linear::none(n), DVector::zeros(n));
        Self { best, bounds, options, model, scale, deviation: 0.0, is_exact: false, is_still: false }
    }

    /// Measures the Jacobian by `how`, unless it is in `ahead`, and updates the linear model; false without a Jacobian.
    pub fn linearise(&mut self, problem: &mut dyn Residuals, how: &Differences, ahead: Option<DMatrix<f64>>) -> bool {
        let (bounds, best) = (self.bounds, &mut self.best);
        let own = ahead.or_else(|| problem.jacobian(&best.x, &best.residuals, bounds, how));
        let Some(jacobian) = own else { return false };
        best.iterations += 1;
        best.jacobian = jacobian;
        self.is_exact = problem.is_exact();
        let n = best.x.len();
        let model = Linear::new(&best.jacobian, &best.residuals, self.options.huber);
        for j in 0..n {
            self.scale[j] = f64::max(self.scale[j], model.norm(j));
        }
        let gradient = model.gradient();
        // At a bound and pushed outwards: not free.
        let is_held = |j: usize| {
            (best.x[j] <= bounds.low[j] && gradient[j] >= 0.0) || (best.x[j] >= bounds.high[j] && gradient[j] <= 0.0)
        };
        best.at_bound = (0..n).map(is_held).collect();
        let newton = model.step(&best.at_bound, &self.scale, 0.0);
        let freedom = (best.residuals.len().saturating_sub(n)).max(1) as f64;
        let spread = (2.0 * best.cost / freedom).sqrt();
        // Residuals of simulated logs are rounding errors.
        let rounding = self.options.rounding;
        let is_rounding = spread <= rounding;
        self.deviation = if is_rounding { rounding } else { spread * inflation(&best.residuals, n) };
        best.decrement = model.reach(&newton) / self.deviation.max(f64::MIN_POSITIVE);
        self.is_still = (0..n).all(|j| newton[j].abs() <= 1e-11 * best.x[j].abs().max(1.0));
        self.model = model;
        true
    }

    /// True if the projected gradient is zero to within the tolerance: the one test of convergence on a smooth piece.
    pub fn is_at_minimum(&self) -> bool {
        self.best.decrement <= self.options.tolerance || self.is_still
    }

    /// Variables that are not held at a bound and have an effect.
    pub fn free(&self) -> Vec<usize> {
        (0..self.best.x.len()).filter(|&j| !self.best.at_bound[j] && self.model.norm(j) > 0.0).collect()
    }

    /// Differences over this fraction of each variable's own standard error.
    pub fn differences_over(&self, part: f64) -> Differences {
        let errors = self.model.errors(&self.best.at_bound, self.deviation);
        Differences::Coarse(errors.iter().map(|error| part * error).collect())
    }

    /// Least significant gain in cost.
    pub fn shows(&self) -> f64 {
        0.5 * (SHOWS * self.deviation).powi(2)
    }
}

/// Approximate factor of standard errors relative to independent residuals: √((1 + ρ)/(1 − ρ)) with the correlation ρ
/// of neighbours, limited to at least ten independent residuals per variable.
fn inflation(residuals: &[f64], variables: usize) -> f64 {
    let own: f64 = residuals.iter().map(|r| r * r).sum();
    let next: f64 = residuals.windows(2).map(|pair| pair[0] * pair[1]).sum();
    let rho = if own > 0.0 { (next / own).clamp(0.0, 0.999_999) } else { 0.0 };
    let most = residuals.len() as f64 / (10.0 * variables.max(1) as f64);
    ((1.0 + rho) / (1.0 - rho)).min(most.max(1.0)).sqrt()
}

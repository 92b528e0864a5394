//! Damped steps: Levenberg and Marquardt's method with an active set for the bounds.
//!
//! λ follows the ratio of actual and predicted gain (Nielsen 1999). Derivatives are cheap far from a minimum, then over
//! a fraction of a standard error, and central near it.

use super::linear::Linear;
use super::point::{Ending, Options, Point, Strategy, cost_of};
use super::rung::{Climb, Rung, Watch};
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::{KINK, NEAR, PAST_KINKS, SHARP, SHOWS};
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};

/// Damped steps while they lower the cost.
pub(crate) struct Damped {
    /// Kind of the last derivatives.
    how: Differences,
    /// λ; `None` before the first step.
    lambda: Option<f64>,
    /// Factor by which λ grows when a step is refused.
    growth: f64,
    /// The Jacobian at the accepted trial point, if it came with the residuals.
    ahead: Option<DMatrix<f64>>,
    /// True if the last trial point was accepted.
    is_likely: bool,
    /// Number of successive steps with an insignificant gain.
    slow: usize,
    trial: Vec<f64>,
}

impl Damped {
    /// Begins with cheap derivatives, if requested, or with those that are known at the start.
    pub fn new(options: &Options, known: Option<DMatrix<f64>>) -> Self {
        let how = if options.frugal { Differences::Forward } else { Differences::Central };
        Self { how, lambda: None, growth: 2.0, ahead: known, is_likely: true, slow: 0, trial: Vec::new() }
    }

    /// Descends from `at`, beginning with the last kind of derivatives.
    fn descend(&mut self, at: &mut Point, problem: &mut dyn Residuals, watch: &mut Watch) -> Climb {
        let mut how = self.how.clone();
        (self.lambda, self.growth) = (None, 2.0);
        let end = loop {
            if watch(&at.best.x, at.best.cost) == Flow::Stop {
                break Climb::Ended(Ending::Interrupted);
            }
            if !at.linearise(problem, &how, self.ahead.take()) {
                break Climb::Ended(Ending::Stalled);
            }
            let is_sharp = how == Differences::Central || at.is_exact || !at.options.sharp;
            if at.is_at_minimum() {
                if is_sharp {
                    break Climb::Converged;
                }
                how = Differences::Central;
                continue;
            }
            if at.options.sharp {
                sharpen(&mut how, at);
            }
            if at.best.iterations >= at.options.iterations {
                break Climb::Ended(Ending::OutOfIterations);
            }
            if self.step(at, problem, &how) {
                continue;
            }
            (self.slow, self.ahead) = (0, None);
            if !is_sharp {
                // Cheap derivatives may be the cause.
                (how, self.lambda) = (Differences::Central, None);
                continue;
            }
            break if at.best.decrement <= KINK { Climb::Converged } else { Climb::Passed };
        };
        self.how = how;
        end
    }

    /// Takes a step that lowers the cost, with as much damping as needed; returns true if it succeeded with a
    /// sufficient gain.
    fn step(&mut self, at: &mut Point, problem: &mut dyn Residuals, how: &Differences) -> bool {
        let (n, shows, bounds) = (at.best.x.len(), at.shows(), at.bounds);
        let best = &mut at.best;
        self.trial.resize(best.residuals.len(), 0.0);
        let mut damping = self.lambda.unwrap_or(1e-3);
        let mut accepted = false;
        for _ in 0..30 {
            let step = within(&at.model, &best.x, bounds, &best.at_bound, &at.scale, damping);
            let x: Vec<f64> = (0..n).map(|j| (best.x[j] + step[j]).clamp(bounds.low[j], bounds.high[j])).collect();
            let promised = at.model.promise(&step);
            if promised <= 0.0 || x == best.x {
                damping = (damping * self.growth).max(1e-12);
                self.growth *= 2.0;
                if x == best.x {
                    break;
                }
                continue;
            }
            best.evaluations += 1;
            // Exact derivatives come with the residuals, for little more than these.
            let mut with = None;
            let good = if at.is_exact && self.is_likely {
                with = problem.linearised(&x, &mut self.trial, bounds, how);
                with.is_some()
            } else {
                problem.evaluate(&x, &mut self.trial)
            };
            let cost = if good { cost_of(&self.trial, at.options.huber) } else { f64::INFINITY };
            let gain = (best.cost - cost) / promised;
            self.is_likely = cost < best.cost && gain > 1e-4;
            if self.is_likely {
                self.ahead = with.filter(|_| problem.is_exact());
                // λ decreases with the accuracy of the linear model (Nielsen 1999).
                damping *= f64::max(1.0 / 5.0, 1.0 - (2.0 * gain - 1.0).powi(3));
                self.growth = 2.0;
                // An insignificant gain, far below the prediction, indicates a kink.
                let is_slow = best.cost - cost < shows && (gain < 0.25 || best.decrement > 2.0 * SHOWS);
                self.slow = if is_slow { self.slow + 1 } else { 0 };
                best.x = x;
                best.cost = cost;
                std::mem::swap(&mut best.residuals, &mut self.trial);
                accepted = self.slow < 2;
                break;
            }
            damping *= self.growth;
            self.growth *= 2.0;
            if damping > 1e16 {
                break;
            }
        }
        self.lambda = Some(damping.clamp(1e-12, 1e8));
        self.growth = self.growth.min(8.0);
        accepted
    }
}

impl Rung for Damped {
    fn strategy(&self) -> Strategy {
        Strategy::Damped
    }

    fn applies(&self, _: &Point) -> bool {
        true
    }

    fn climb(&mut self, at: &mut Point, problem: &mut dyn Residuals, watch: &mut Watch) -> Climb {
        self.descend(at, problem, watch)
    }
}

/// Derivatives for the next Jacobian: better ones near a minimum.
fn sharpen(how: &mut Differences, at: &Point) {
    if at.best.decrement < NEAR && *how == Differences::Forward && !at.is_exact {
        *how = at.differences_over(PAST_KINKS);
    } else if at.best.decrement < SHARP {
        *how = Differences::Central;
    }
}

/// Step within the box: variables that would leave it are set to its edge, and the others solved again.
fn within(
    model: &Linear,
    x: &[f64],
    bounds: &Bounds,
    held: &[bool],
    scale: &DVector<f64>,
    damping: f64,
) -> DVector<f64> {
    let n = x.len();
    let mut fixed: Vec<Option<f64>> = held.iter().map(|&held| held.then_some(0.0)).collect();
    loop {
        let step = model.step_with(&fixed, scale, damping);
        let mut left = false;
        for j in 0..n {
            if fixed[j].is_none() {
                let to = x[j] + step[j];
                if to < bounds.low[j] || to > bounds.high[j] {
                    fixed[j] = Some(to.clamp(bounds.low[j], bounds.high[j]) - x[j]);
                    left = true;
                }
            }
        }
        if !left {
            return step;
        }
    }
}

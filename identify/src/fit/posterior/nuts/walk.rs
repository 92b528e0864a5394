//! Random walk for densities with kinks or without useful gradients: N. Metropolis and others (1953), with the
//! covariance and the length of its steps adapted before draws are kept (H. Haario, E. Saksman, J. Tamminen 2001).
//!
//! With Σ = L Lᵀ an estimate of the covariance and n variables
//!
//! ```text
//! q′ = q + s L ξ,   ξ standard normal          taken with the probability min(1, π(q′)/π(q))
//! s = 2.38/√n to begin with                    (A. Gelman, G. O. Roberts, W. R. Gilks 1996)
//! ```
//!
//! A step is worth 0.33/n of an independent draw, so a draw consists of [`WALK_STEPS`] n steps.

use super::adaptation::{Windows, factor};
use super::{Drawn, Job, Plain};
use crate::chance::{normal, uniform};
use crate::error::{Error, Result};
use crate::fit::limits::{WALK_LENGTH, WALK_STEPS, WALK_TAKEN, WALK_TAKEN_OF_ONE};
use libm::{exp, log, pow, sqrt};
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg64;

/// A walk at its present draw.
struct Walk<'a> {
    density: &'a Plain<'a>,
    random: Pcg64,
    /// L
    factor: DMatrix<f64>,
    /// ln s
    length: f64,
    /// q
    position: DVector<f64>,
    /// ln π(q)
    log: f64,
    evaluations: u64,
}

impl Walk<'_> {
    /// Advances to the next draw, and returns the share of accepted steps; `None` once `goes_on` returns false.
    fn draw(&mut self, goes_on: &dyn Fn() -> bool) -> Option<f64> {
        let n = self.position.len();
        let steps = WALK_STEPS * n;
        let mut taken = 0;
        for _ in 0..steps {
            if !goes_on() {
                return None;
            }
            let xi = DVector::from_fn(n, |_, _| normal(&mut self.random));
            let to = &self.position + &self.factor * xi * exp(self.length);
            let log_to = if to.iter().all(|q| q.is_finite()) { (self.density)(to.as_slice()) } else { None };
            self.evaluations += 1;
            let by = log_to.filter(|log| log.is_finite()).map_or(f64::NEG_INFINITY, |log| log - self.log);
            // 1 − u is never zero.
            if log(1.0 - uniform(&mut self.random)) < by {
                (self.position, self.log) = (to, self.log + by);
                taken += 1;
            }
        }
        Some(f64::from(taken) / steps as f64)
    }

    /// Adapts step length and covariance; false if interrupted.
    fn tune(&mut self, job: &Job) -> bool {
        let n = self.position.len() as f64;
        let wanted = WALK_TAKEN + WALK_TAKEN_OF_ONE / n;
        let Windows { begin, ends } = Windows::new(job.effort.tune);
        let (mut window, mut since) = (Vec::new(), 0.0);
        for k in 1..=job.effort.tune {
            let Some(taken) = self.draw(&|| job.goes_on()) else { return false };
            job.count();
            // Robbins and Monro (1951): ln s moves less and less.
            since += 1.0;
            self.length += (taken - wanted) * 2.0 / pow(since, 0.6);
            if k > begin {
                window.push(self.position.as_slice().to_vec());
            }
            if ends.contains(&k) {
                if let Some(factor) = factor(&window) {
                    (self.factor, self.length, since) = (factor, log(WALK_LENGTH / sqrt(n)), 0.0);
                }
                window.clear();
            }
        }
        true
    }
}

/// A chain of a walk from `start`.
pub(super) fn chain(job: &Job, density: &Plain, start: &[f64], random: Pcg64) -> Result<Drawn> {
    let n = start.len();
    let log_start = density(start).filter(|log| log.is_finite());
    let mut walk = Walk {
        density,
        random,
        factor: DMatrix::identity(n, n),
        length: log(WALK_LENGTH / sqrt(n as f64)),
        position: DVector::from_column_slice(start),
        log: log_start.ok_or_else(nowhere)?,
        evaluations: 1,
    };
    let mut drawn = Drawn::default();
    if walk.tune(job) {
        drawn = job.keep(&mut || {
            walk.draw(&|| job.goes_on())?;
            Some((walk.position.as_slice().to_vec(), false))
        });
    }
    drawn.evaluations = walk.evaluations;
    Ok(drawn)
}

/// A chain cannot begin where the density is zero.
pub(super) fn nowhere() -> Error {
    Error::new("the density is zero where a chain would start").next("start from a fit that has converged")
}

#[cfg(test)]
mod tests {
    use crate::fit::posterior::nuts::{Effort, walk};

    /// |x| + |y − x|/3 instead of a bowl: no gradient points to its middle. Laplace's distribution has the variance 2,
    /// and y that of x and 18 more.
    #[test]
    fn a_density_of_kinks_has_its_moments() {
        let density = |q: &[f64]| Some(-q[0].abs() - (q[1] - q[0]).abs() / 3.0);
        let starts: Vec<Vec<f64>> = (0..4).map(|k| vec![f64::from(k) - 1.5; 2]).collect();
        let effort = Effort { draws: 4000, ..Effort::default() };
        let draws = walk(&density, &starts, effort, &|_| true).unwrap();
        for (j, variance) in [2.0f64, 20.0].into_iter().enumerate() {
            let (found, effective) = (draws.deviation(j), draws.effective(j));
            assert!(draws.r_hat(j) < 1.01 && effective > 3000.0, "{} {effective}", draws.r_hat(j));
            assert!((found / variance.sqrt() - 1.0).abs() < 0.1, "{found}");
            assert!(draws.mean(j).abs() < 5.0 * (variance / effective).sqrt(), "{}", draws.mean(j));
        }
        assert_eq!(draws, walk(&density, &starts, effort, &|_| true).unwrap());
    }

    #[test]
    fn a_walk_that_is_interrupted_keeps_what_it_has() {
        let effort = Effort { chains: 1, tune: 20, draws: 1000, seed: 1 };
        let draws = walk(&|q| Some(-q[0].abs()), &[vec![0.0]], effort, &|made| made < 500).unwrap();
        assert!(draws.interrupted && draws.chains[0].len() == 480, "{}", draws.chains[0].len());
        let told = walk(&|_| None, &[vec![0.0]], effort, &|_| true).unwrap_err().to_string();
        assert_eq!(told, "the density is zero where a chain would start\n  next: start from a fit that has converged");
    }

    /// A step is worth a third of a draw of one variable: nine steps for a draw of three variables, and not a third of
    /// that or three times as many.
    #[test]
    fn draws_of_a_walk_are_nearly_independent() {
        let density = |q: &[f64]| Some(-0.5 * q.iter().map(|q| q * q).sum::<f64>());
        let effort = Effort { draws: 2000, ..Effort::default() };
        let draws = walk(&density, &[vec![0.1; 3]], effort, &|_| true).unwrap();
        for j in 0..3 {
            let share = draws.effective(j) / 8000.0;
            assert!((0.55..0.95).contains(&share), "{share}");
        }
    }
}

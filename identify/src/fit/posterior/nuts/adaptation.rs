//! Adaptation of a chain before its draws count: the step, by dual averaging, and the covariance, in windows.

use crate::fit::limits::ACCEPTANCE;
use libm::{exp, log, pow, sqrt};
use nalgebra::DMatrix;

/// Step size by dual averaging (Hoffman & Gelman 2014, section 3.2, with their constants).
pub struct Steps {
    /// ln of ten times the initial step, towards which it is shrunk.
    mu: f64,
    /// H̄: mean deficit of the acceptance.
    lack: f64,
    /// ln ε̄
    mean: f64,
    /// m
    count: f64,
}

impl Steps {
    /// From this step on.
    pub fn new(step: f64) -> Self {
        Self { mu: log(10.0 * step), lack: 0.0, mean: log(step), count: 0.0 }
    }

    /// The next step to try, after a path of this acceptance.
    pub fn next(&mut self, acceptance: f64) -> f64 {
        const GAMMA: f64 = 0.05;
        const T0: f64 = 10.0;
        const KAPPA: f64 = 0.75;
        self.count += 1.0;
        let m = self.count;
        // H̄ = (1 − 1/(m + t₀)) H̄ + (δ − α)/(m + t₀); ln ε = μ − √m/γ H̄; ln ε̄ = m^−κ ln ε + (1 − m^−κ) ln ε̄ (6)
        self.lack += (ACCEPTANCE - acceptance - self.lack) / (m + T0);
        let next = self.mu - sqrt(m) / GAMMA * self.lack;
        let eta = pow(m, -KAPPA);
        self.mean = eta * next + (1.0 - eta) * self.mean;
        exp(next)
    }

    /// ε̄: the final step.
    pub fn last(&self) -> f64 {
        exp(self.mean)
    }
}

/// Windows after which the covariance is estimated from their draws, as in Stan (Stan Reference Manual, "Automatic
/// parameter tuning"): a start without estimates, windows that double in length, and an end for the step alone.
pub struct Windows {
    /// Number of first draws that are not used.
    pub begin: usize,
    /// Ends of the windows.
    pub ends: Vec<usize>,
}

impl Windows {
    /// Adaptation over `tune` draws.
    pub fn new(tune: usize) -> Self {
        let (begin, last, mut length) =
            if tune >= 150 { (75, 50, 25) } else { (tune * 15 / 100, tune / 10, tune - tune * 15 / 100 - tune / 10) };
        let until = tune - last;
        let (mut ends, mut end) = (Vec::new(), begin);
        if tune < 20 {
            return Self { begin: tune, ends };
        }
        while end < until {
            end += length;
            length *= 2;
            // A remainder shorter than the next window belongs to this one.
            if end + length > until {
                end = until;
            }
            ends.push(end);
        }
        Self { begin, ends }
    }
}

/// Cholesky factor L of the covariance of these draws, with correlations shrunk to compensate for few draws of many
/// variables; `None` if a variable did not move.
pub fn factor(draws: &[Vec<f64>]) -> Option<DMatrix<f64>> {
    let n = draws.first()?.len();
    let count = draws.len() as f64;
    let mean: Vec<f64> = (0..n).map(|i| draws.iter().map(|draw| draw[i]).sum::<f64>() / count).collect();
    let off = DMatrix::from_fn(n, draws.len(), |i, k| draws[k][i] - mean[i]);
    let covariance = &off * off.transpose() / (count - 1.0);
    let share = count / (count + n as f64 + 5.0);
    DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * if i == j { 1.0 } else { share })
        .cholesky()
        .map(|found| found.l())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_stans() {
        let ends = |tune| Windows::new(tune).ends;
        assert_eq!(ends(1000), [100, 150, 250, 450, 950]);
        assert_eq!(ends(400), [100, 150, 350]);
        assert_eq!(ends(100), [90]);
        assert!(ends(19).is_empty());
        assert!(ends(0).is_empty());
        for tune in 20..2000 {
            let ends = ends(tune);
            assert!(ends.is_sorted() && *ends.last().unwrap() == tune - if tune >= 150 { 50 } else { tune / 10 });
        }
    }

    /// Acceptance that falls with the step as 1/(1 + ε): 0.8 is at ε = 0.25.
    #[test]
    fn steps_find_the_acceptance_that_is_wanted() {
        let mut steps = Steps::new(1.0);
        let mut step = 1.0;
        for _ in 0..2000 {
            step = steps.next(1.0 / (1.0 + step));
        }
        assert!((steps.last() - 0.25).abs() < 0.02, "{}", steps.last());
    }
}

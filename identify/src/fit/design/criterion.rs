//! Criterion: the expected accuracy of a fit, in one number.

use super::Criterion;
use crate::fit::asked::problem::Problem;
use crate::fit::trust::directions::Directions;
use crate::fit::trust::identify::Identifiability;
use nalgebra::{Cholesky, DMatrix};

/// Derivatives of a problem, and the resulting information.
pub(super) struct Information {
    pub problem: Problem<'static>,
    pub x: Vec<f64>,
    pub known: Identifiability,
    /// Covariance of the relative changes of the parameters in the criterion, including the prior.
    covariance: DMatrix<f64>,
    whole: Vec<f64>,
}

impl Information {
    /// The criterion from derivatives at `x`; `None` if numbers fail.
    pub fn new(problem: Problem<'static>, jacobian: DMatrix<f64>, x: Vec<f64>, wanted: &[usize]) -> Option<Self> {
        let all: Vec<usize> = (0..problem.globals()).collect();
        let Directions { v, singular, whole, .. } = Directions::new(&problem, &jacobian, &x, &all)?;
        let known = Identifiability::new(&problem, &jacobian, &x, 1.0)?;
        // C = V (S² + I)⁻¹ Vᵀ
        let k = wanted.len();
        let covariance = DMatrix::from_fn(k, k, |a, b| {
            let (a, b) = (wanted[a], wanted[b]);
            singular.iter().enumerate().map(|(i, s)| v[(a, i)] * v[(b, i)] / (s * s + 1.0)).sum()
        });
        Some(Self { problem, x, known, covariance, whole })
    }

    /// Mean relative error by a criterion: 1 without information.
    pub fn score(&self, criterion: Criterion) -> f64 {
        let k = self.covariance.nrows() as f64;
        match criterion {
            // det C^(1/2k)
            Criterion::D => Cholesky::new(self.covariance.clone()).map_or(f64::INFINITY, |root| {
                (root.l_dirty().diagonal().iter().map(|l| l.ln()).sum::<f64>() / k).exp()
            }),
            Criterion::A => (self.covariance.trace() / k).sqrt(),
        }
    }

    /// The size in SI units to which the relative error of parameter `j` refers: its value, or a typical one if the
    /// value may be zero.
    pub fn size(&self, j: usize) -> f64 {
        let value = self.problem.value(j, self.x[j]);
        self.whole[j] * self.problem.slope(j, value).abs()
    }

    /// Approximate standard error of variable `j`.
    pub fn step(&self, j: usize) -> f64 {
        let own = self.known.error.get(j).map_or(0.0, |error| error * self.whole[j]);
        if own.is_finite() { own.min(0.3) } else { 0.1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::asked::residuals::{Differences, Residuals};

    /// With derivatives J of one parameter, the error is 1/√(1 + s²) by both criteria: 1 without information.
    #[test]
    fn the_error_falls_from_one_in_proportion_to_the_information() {
        let (case, plan) = case(false);
        let (case, plan) = (Box::leak(Box::new(case)), Box::leak(Box::new(plan)));
        let mut problem = Problem::new(case, plan).unwrap();
        let (x, bounds) = (problem.start(), problem.bounds());
        let mut residuals = vec![0.0; problem.rows()];
        let jacobian = problem.linearised(&x, &mut residuals, &bounds, &Differences::Central).unwrap();
        let scores = [1e-9, 1.0, 1e3, 1e6].map(|factor| {
            let found = Information::new(problem.clone(), &jacobian * factor, x.clone(), &[0]).unwrap();
            let [one, other] = [Criterion::D, Criterion::A].map(|criterion| found.score(criterion));
            assert!((one / other - 1.0).abs() < 1e-12, "{one} {other}");
            one
        });
        assert!((scores[0] - 1.0).abs() < 1e-6 && scores[1] < 1.0, "{scores:?}");
        assert!((scores[2] / scores[3] - 1e3).abs() < 1.0, "{scores:?}");
    }
}

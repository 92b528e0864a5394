//! Directions in parameter space, ordered by their effect on the outputs.

use crate::fit::asked::problem::Problem;
use crate::fit::limits::{MOST_SWEEPS, SHARE_LOST, SINGULAR_ROUNDING, UNDETERMINED};
use crate::fit::search::triangle::shortened;
use nalgebra::{DMatrix, SVD};

/// Directions in parameter space, ordered by their effect on the outputs.
pub(crate) struct Directions {
    /// Each a column, in relative changes.
    pub v: DMatrix<f64>,
    /// Singular values in the weights of the problem, falling.
    pub singular: Vec<f64>,
    /// Norm of each parameter's own column.
    pub norms: Vec<f64>,
    /// Number of directions above rounding.
    pub alive: usize,
    /// A change by 100 %, in the variable of each.
    pub whole: Vec<f64>,
    /// Number of counted values.
    pub rows: f64,
}

impl Directions {
    /// The directions of a Jacobian of `problem` at `x` for these of the shared variables, with the others held; `None`
    /// if numbers fail.
    pub fn new(problem: &Problem, jacobian: &DMatrix<f64>, x: &[f64], which: &[usize]) -> Option<Self> {
        let globals = problem.globals();
        if which.is_empty() {
            return None;
        }
        let columns: Vec<usize> = which.iter().copied().chain(globals..jacobian.ncols()).collect();
        let mut own = projected(&jacobian.select_columns(&columns), which.len())?;
        let machine = problem.stage_at(x);
        let whole: Vec<f64> = (0..globals).map(|j| problem.whole(&machine, j, x[j])).collect();
        for (column, &j) in which.iter().enumerate() {
            own.column_mut(column).scale_mut(whole[j]);
        }
        // A simulation that ended early has no numbers, and the decomposition would panic.
        if own.iter().any(|entry| !entry.is_finite()) {
            return None;
        }
        let mut norms = vec![0.0; globals];
        for (column, &j) in which.iter().enumerate() {
            norms[j] = own.column(column).norm();
        }
        let svd = SVD::try_new(own, false, true, 1e-15, MOST_SWEEPS)?;
        let order = svd.v_t.as_ref()?.transpose();
        let mut singular: Vec<f64> = svd.singular_values.iter().copied().collect();
        let mut v = DMatrix::zeros(globals, which.len());
        for (row, &j) in which.iter().enumerate() {
            for i in 0..order.ncols() {
                v[(j, i)] = order[(row, i)];
            }
        }
        singular.resize(which.len(), 0.0);
        let most = singular.iter().copied().fold(0.0, f64::max);
        let alive = singular.iter().filter(|s| **s > SINGULAR_ROUNDING * most).count();
        Some(Self { v, singular, norms, alive, whole, rows: problem.counted().max(1) as f64 })
    }
}

impl Directions {
    /// RMS change of the values by 100 % along the strongest of the lost directions of these members, if noise alone
    /// would leave all of them determined.
    pub fn told_by_noise(&self, lost: &[usize], members: &[usize], off: &[f64]) -> Option<f64> {
        let goes = |i: &&usize| members.iter().map(|&j| self.v[(j, **i)].powi(2)).sum::<f64>() > SHARE_LOST;
        let own: Vec<usize> = lost.iter().filter(goes).copied().collect();
        let is_told = |&i: &usize| i < self.alive && off[i] <= UNDETERMINED;
        let strongest = own.iter().map(|&i| self.singular[i]).fold(0.0, f64::max);
        (!own.is_empty() && own.iter().all(is_told)).then(|| strongest / self.rows.sqrt())
    }
}

/// Columns of the first `n` variables, with those of the others projected out.
fn projected(jacobian: &DMatrix<f64>, n: usize) -> Option<DMatrix<f64>> {
    let all = jacobian.ncols();
    if all == n {
        let rows = jacobian.nrows();
        return if rows > n { Some(shortened(jacobian).qr().unpack_r()) } else { Some(jacobian.clone()) };
    }
    // Others first: the last block of R is the projected rest.
    let order: Vec<usize> = (n..all).chain(0..n).collect();
    let ordered = jacobian.select_columns(&order);
    if ordered.nrows() < all {
        return None;
    }
    let r = shortened(&ordered).qr().unpack_r();
    Some(r.view((all - n, all - n), (n, n)).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::asked::residuals::Residuals;

    /// Differences are good to about 1e-9 of the largest column: what is smaller than ten times that is rounding.
    #[test]
    fn a_direction_within_rounding_is_none() {
        let (case, mut plan) = case(false);
        plan.free.push("cart.mass".into());
        let problem = Problem::new(&case, &plan).unwrap();
        let x = problem.start();
        let machine = problem.stage_at(&x);
        let whole: Vec<f64> = (0..2).map(|j| problem.whole(&machine, j, x[j])).collect();
        let alive = |share: f64| {
            let column = |j: usize, k: usize| if k == j { [1.0, share][j] / whole[j] } else { 0.0 };
            let jacobian = DMatrix::from_fn(problem.rows(), 2, |k, j| column(j, k));
            Directions::new(&problem, &jacobian, &x, &[0, 1]).unwrap().alive
        };
        assert_eq!([1e-7, 2e-8, 5e-9, 0.0].map(alive), [2, 2, 1, 1]);
    }

    /// Of forty parameters, more than most fits have.
    #[test]
    fn a_decomposition_takes_a_hundredth_of_the_iterations_that_it_may() {
        let columns = DMatrix::from_fn(40, 40, |i, j| ((i * i + 3 * j * j + i * j) as f64).sin());
        assert!(SVD::try_new(columns, false, true, 1e-15, MOST_SWEEPS / 100).is_some());
    }
}

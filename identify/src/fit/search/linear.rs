//! The linear model of residuals around a point, and its steps.

use super::triangle::shortened;
use nalgebra::{DMatrix, DVector};

/// J and r by their QR decomposition: J = Q R, Qᵀ r.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    pub r: DMatrix<f64>,
    qtr: DVector<f64>,
}

impl Linear {
    /// A problem without rows.
    pub fn none(n: usize) -> Self {
        Self { r: DMatrix::zeros(0, n), qtr: DVector::zeros(0) }
    }

    /// The problem of this Jacobian and these residuals, which count linearly beyond `huber`.
    pub fn new(jacobian: &DMatrix<f64>, residuals: &[f64], huber: f64) -> Self {
        let n = jacobian.ncols();
        let mut jacobian = jacobian.clone();
        let mut residual = DVector::from_column_slice(residuals);
        if huber.is_finite() {
            // ρ′(r) = ψ: rows of weight √(k/|r|) have the same gradient.
            for i in 0..residual.len() {
                let size = residual[i].abs();
                if size > huber {
                    let weight = (huber / size).sqrt();
                    residual[i] *= weight;
                    jacobian.row_mut(i).scale_mut(weight);
                }
            }
        }
        if jacobian.nrows() < n {
            return Self { r: jacobian, qtr: residual };
        }
        let mut beside = jacobian.insert_column(n, 0.0);
        beside.set_column(n, &residual);
        let short = shortened(&beside);
        let mut residual = short.column(n).into_owned();
        let qr = short.remove_column(n).qr();
        qr.q_tr_mul(&mut residual);
        Self { r: qr.unpack_r(), qtr: residual.rows(0, n).into_owned() }
    }

    /// Norm of a column of J.
    pub fn norm(&self, j: usize) -> f64 {
        self.r.column(j).norm()
    }

    /// Jᵀ r
    pub fn gradient(&self) -> DVector<f64> {
        self.r.tr_mul(&self.qtr)
    }

    /// min ‖R d + Qᵀ r‖² + λ ‖D d‖² over the variables that are not fixed.
    pub fn step_with(&self, fixed: &[Option<f64>], scale: &DVector<f64>, damping: f64) -> DVector<f64> {
        let n = fixed.len();
        let free: Vec<usize> = (0..n).filter(|&j| fixed[j].is_none()).collect();
        let mut step = DVector::from_iterator(n, fixed.iter().map(|fixed| fixed.unwrap_or(0.0)));
        if free.is_empty() {
            return step;
        }
        let rows = self.r.nrows();
        let right = -(&self.qtr + &self.r * &step);
        let mut matrix = DMatrix::zeros(rows + free.len(), free.len());
        let mut wanted = DVector::zeros(rows + free.len());
        wanted.rows_mut(0, rows).copy_from(&right);
        for (column, &j) in free.iter().enumerate() {
            // In units of D the columns have similar norms. A little damping keeps undetermined variables at rest.
            let unit = if scale[j] > 0.0 { 1.0 / scale[j] } else { 1.0 };
            matrix.view_mut((0, column), (rows, 1)).copy_from(&(self.r.column(j) * unit));
            matrix[(rows + column, column)] = f64::max(damping.sqrt(), 1e-11);
        }
        let qr = matrix.qr();
        qr.q_tr_mul(&mut wanted);
        let solved = qr.unpack_r().solve_upper_triangular(&wanted.rows(0, free.len()).into_owned());
        if let Some(solved) = solved {
            for (column, &j) in free.iter().enumerate() {
                step[j] = solved[column] / if scale[j] > 0.0 { scale[j] } else { 1.0 };
            }
        }
        step
    }

    /// Step with variables that are held at a bound.
    pub fn step(&self, held: &[bool], scale: &DVector<f64>, damping: f64) -> DVector<f64> {
        let fixed: Vec<Option<f64>> = held.iter().map(|&held| held.then_some(0.0)).collect();
        self.step_with(&fixed, scale, damping)
    }

    /// ‖J d‖.
    pub fn reach(&self, step: &DVector<f64>) -> f64 {
        (&self.r * step).norm()
    }

    /// Predicted decrease of the cost by the linear model.
    pub fn promise(&self, step: &DVector<f64>) -> f64 {
        let moved = &self.r * step;
        -(moved.dot(&self.qtr) + 0.5 * moved.norm_squared())
    }

    /// Standard errors of the free variables for residuals of this deviation; each alone if they are not jointly
    /// determined.
    pub fn errors(&self, held: &[bool], deviation: f64) -> Vec<f64> {
        (0..held.len()).map(|j| if held[j] || self.norm(j) == 0.0 { 0.0 } else { deviation / self.norm(j) }).collect()
    }
}

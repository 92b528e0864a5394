//! How far the truth may be from an estimate: covariance, with what the residuals of a log remember taken into account.
//!
//! For white residuals the covariance is s² (JᵀJ)⁻¹. Residuals that are alike from sample to sample tell less than their
//! number says; then it is (JᵀJ)⁻¹ S (JᵀJ)⁻¹ with Newey and West's (1987) S = Σ_l w_l Σ_t g_t g_{t+l}ᵀ over the products
//! g_t = J_tᵀ r_t, Bartlett weights and Andrews' (1991) bandwidth. Of both variances the greater one holds.

use super::problem::Problem;
use nalgebra::{DMatrix, DVector};

/// Covariance of the variables that are free, in their order; none if they are not determined.
pub struct Covariance {
    /// Variables that are free.
    pub free: Vec<usize>,
    /// Their covariance.
    pub matrix: DMatrix<f64>,
    /// Standard deviation of the weighted residuals.
    pub deviation: f64,
    /// Independent values minus variables.
    pub freedom: usize,
    /// How many standard errors a 95 % interval reaches to each side.
    pub reach: f64,
}

impl Covariance {
    /// At a minimum with these residuals and this Jacobian, its variables at bounds left out.
    pub fn new(problem: &Problem, residuals: &[f64], jacobian: &DMatrix<f64>, at_bound: &[bool]) -> Option<Self> {
        let free: Vec<usize> = (0..at_bound.len()).filter(|&j| !at_bound[j]).collect();
        let counted = problem.independent();
        let freedom = (counted - free.len() as f64).max(1.0);
        let squares: f64 = residuals.iter().map(|r| r * r).sum();
        let deviation = (squares / freedom).sqrt();
        let columns = jacobian.select_columns(&free);
        let inverse = inverse_of_square(&columns)?;
        let white = &inverse * (deviation * deviation);

        let mut sum = DMatrix::zeros(free.len(), free.len());
        let mut coloured = false;
        let (mut lagged, mut counting) = (0.0, 0.0);
        let mut first = 0;
        for run in &problem.runs {
            let n = run.time.len();
            for output in 0..run.seen.len() {
                let rows: Vec<usize> =
                    (0..n).filter(|&k| run.seen[output].weights[k] > 0.0).map(|k| first + output * n + k).collect();
                let memory = memory_of(residuals, &rows);
                let own = run.independent(output);
                let lags = bandwidth(memory, own as usize);
                coloured |= lags > 0;
                lagged += lags as f64;
                counting += own;
                add_products(&mut sum, &columns, residuals, &rows, lags);
            }
            first += run.rows();
        }
        let matrix = if coloured {
            let grown = counted / freedom;
            let robust = &inverse * sum * &inverse * grown;
            // Correlations as with white residuals, variances the greater ones.
            let factor: Vec<f64> = (0..free.len()).map(|j| (robust[(j, j)] / white[(j, j)]).max(1.0).sqrt()).collect();
            DMatrix::from_fn(free.len(), free.len(), |i, j| white[(i, j)] * factor[i] * factor[j])
        } else {
            white
        };
        // How far an interval reaches with a covariance summed over the share b of the lags (Kiefer and Vogelsang 2005, for
        // Bartlett weights), instead of 1.96.
        let b: f64 = if counting > 0.0 { lagged / counting } else { 0.0 };
        let wider = (1.96 + 2.9694 * b + 0.416 * b.powi(2) - 0.5324 * b.powi(3)) / 1.96;
        let reach = student(freedom.round() as usize) * wider;
        Some(Self { free, matrix, deviation, freedom: freedom.round() as usize, reach })
    }

    /// Standard deviation of variable `j`; none for one at a bound.
    pub fn error(&self, j: usize) -> Option<f64> {
        let place = self.free.iter().position(|&free| free == j)?;
        Some(self.matrix[(place, place)].max(0.0).sqrt())
    }

    /// Correlation of two variables.
    pub fn correlation(&self, i: usize, j: usize) -> Option<f64> {
        let place = |j: usize| self.free.iter().position(|&free| free == j);
        let (a, b) = (place(i)?, place(j)?);
        let own = (self.matrix[(a, a)] * self.matrix[(b, b)]).sqrt();
        if own > 0.0 { Some((self.matrix[(a, b)] / own).clamp(-1.0, 1.0)) } else { None }
    }
}

/// (JᵀJ)⁻¹ by QR of J with columns of unit length; none where a column depends on the others to within rounding.
pub fn inverse_of_square(jacobian: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = jacobian.ncols();
    let norms: Vec<f64> = (0..n).map(|j| jacobian.column(j).norm()).collect();
    if jacobian.nrows() < n || norms.iter().any(|norm| *norm == 0.0 || !norm.is_finite()) {
        return None;
    }
    let mut scaled = jacobian.clone();
    for (j, norm) in norms.iter().enumerate() {
        scaled.column_mut(j).scale_mut(1.0 / norm);
    }
    let r = scaled.qr().unpack_r();
    if (0..n).any(|j| r[(j, j)].abs() < 1e-10) {
        return None;
    }
    let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n))?;
    let product = &inverse * inverse.transpose();
    Some(DMatrix::from_fn(n, n, |i, j| product[(i, j)] / (norms[i] * norms[j])))
}

/// Correlation of neighbouring residuals.
pub fn memory_of(residuals: &[f64], rows: &[usize]) -> f64 {
    let (mut own, mut next) = (0.0, 0.0);
    for pair in rows.windows(2) {
        next += residuals[pair[0]] * residuals[pair[1]];
    }
    for &row in rows {
        own += residuals[row] * residuals[row];
    }
    if own > 0.0 { next / own } else { 0.0 }
}

/// Lags to sum over for residuals with this correlation of neighbours; none where it may be chance.
fn bandwidth(memory: f64, n: usize) -> usize {
    if n < 4 || memory.abs() < 2.0 / (n as f64).sqrt() {
        return 0;
    }
    let rho = memory.clamp(-0.99, 0.99);
    // α(1) = 4 ρ² / ((1 − ρ)² (1 + ρ)²), bandwidth 1.1447 (α n)^{1/3}
    let alpha = 4.0 * rho * rho / ((1.0 - rho).powi(2) * (1.0 + rho).powi(2));
    let width = 1.1447 * (alpha * n as f64).cbrt();
    (width.ceil() as usize).clamp(1, n / 3)
}

/// Adds Σ_l w_l Σ_t (g_t g_{t+l}ᵀ + its transpose).
fn add_products(sum: &mut DMatrix<f64>, jacobian: &DMatrix<f64>, residuals: &[f64], rows: &[usize], lags: usize) {
    let p = jacobian.ncols();
    let mut products = DMatrix::zeros(p, rows.len());
    for (t, &row) in rows.iter().enumerate() {
        for j in 0..p {
            products[(j, t)] = jacobian[(row, j)] * residuals[row];
        }
    }
    // Only variables that this run moves.
    let moved: Vec<usize> = (0..p).filter(|&j| products.row(j).iter().any(|v| *v != 0.0)).collect();
    // Bartlett-weighted sums by Σ_l w_l γ_l = (1/(L+1)) Σ over windows of (window sum)², the same thing in one pass.
    let width = lags + 1;
    let mut window = DVector::<f64>::zeros(moved.len());
    for end in 0..rows.len() + width - 1 {
        for (i, &j) in moved.iter().enumerate() {
            if end < rows.len() {
                window[i] += products[(j, end)];
            }
            if end >= width {
                window[i] -= products[(j, end - width)];
            }
        }
        for (a, &i) in moved.iter().enumerate() {
            for (b, &j) in moved.iter().enumerate() {
                sum[(i, j)] += window[a] * window[b] / width as f64;
            }
        }
    }
}

/// The value below which Student's t stays with 97.5 %, for so many degrees of freedom (Hill's expansion, to 1e-3 from 3 on).
pub fn student(freedom: usize) -> f64 {
    let (z, n) = (1.959_963_985, freedom.max(1) as f64);
    match freedom {
        0 | 1 => 12.706,
        2 => 4.303,
        _ => {
            let (z3, z5, z7) = (f64::powi(z, 3), f64::powi(z, 5), f64::powi(z, 7));
            z + (z3 + z) / (4.0 * n)
                + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
                + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n * n * n)
        }
    }
}

//! How far the truth may be from an estimate: the covariance, for the noise that the residuals show.
//!
//! For white residuals it is s² (JᵀJ)⁻¹. Residuals that are alike from sample to sample tell less than their number says: with the
//! covariance Σ of the noise it is (JᵀJ)⁻¹ Jᵀ Σ J (JᵀJ)⁻¹, for every Σ that the residuals allow ([`super::noise`]).

use super::noise;
use super::problem::Problem;
use nalgebra::DMatrix;

/// Standard deviations that 95 % of a normal distribution keep to.
const NORMAL: f64 = 1.959_963_985;

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
    /// How many standard errors a 95 % interval reaches to each side; few degrees of freedom are in the standard errors.
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

        // Globals by the noise that the residuals show; what belongs to one run is wider by as much as they are on the whole.
        let globals = free.iter().filter(|&&j| j < problem.globals()).count();
        let spreads = noise::spreads(problem, residuals, jacobian, &free, &inverse);
        let mut own = DMatrix::zeros(globals, globals);
        for spread in &spreads {
            own += &spread.covariance;
        }
        let half: Vec<f64> = (0..globals)
            .map(|j| spreads.iter().map(|spread| spread.half_width(j).powi(2)).sum::<f64>().sqrt())
            .collect();
        let factor: Vec<f64> =
            (0..globals).map(|j| (half[j] / NORMAL / white[(j, j)].sqrt()).max(f64::MIN_POSITIVE)).collect();
        let rest = factor.iter().map(|f| f * f).sum::<f64>() / globals.max(1) as f64;
        let rest = if spreads.is_empty() || globals == 0 { 1.0 } else { rest.sqrt() };
        let matrix = DMatrix::from_fn(free.len(), free.len(), |i, j| {
            if i < globals && j < globals && !spreads.is_empty() {
                let correlation = own[(i, j)] / (own[(i, i)] * own[(j, j)]).sqrt();
                (half[i] / NORMAL) * (half[j] / NORMAL) * correlation
            } else {
                let of = |j: usize| if j < globals && !spreads.is_empty() { factor[j] } else { rest };
                white[(i, j)] * of(i) * of(j)
            }
        });
        Some(Self { free, matrix, deviation, freedom: freedom.round() as usize, reach: NORMAL })
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

/// The share of Student's t beyond ± `t`: by the normal distribution of a t that is made normal (D. L. Wallace 1959), to about 1e-3
/// of itself from three degrees of freedom on.
pub(super) fn student_share(t: f64, freedom: f64) -> f64 {
    let n = freedom.max(1.0);
    let z = (8.0 * n + 1.0) / (8.0 * n + 3.0) * (n * (t * t / n).ln_1p()).sqrt();
    libm::erfc(z / std::f64::consts::SQRT_2)
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

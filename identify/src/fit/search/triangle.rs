//! Reduction of tall matrices to the number of rows needed for the same products of columns.
//!
//! A Jacobian has a row for each value of each log, and a log's own variables affect its rows alone. QR of successive
//! blocks of rows, with their nonzero columns, leaves a triangle of each: M = Q M′ with QᵀQ = I, so that MᵀM = M′ᵀM′
//! without squaring.

use crate::fit::limits::STRETCH;
use nalgebra::DMatrix;

/// A matrix with at most as many rows that differs only by an orthogonal transformation of its rows.
pub(crate) fn shortened(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, columns) = matrix.shape();
    if rows <= 2 * STRETCH.max(columns) {
        return matrix.clone();
    }
    let mut triangles = Vec::new();
    for first in (0..rows).step_by(STRETCH) {
        let stretch = matrix.rows(first, STRETCH.min(rows - first));
        let moved: Vec<usize> = (0..columns).filter(|&j| stretch.column(j).iter().any(|entry| *entry != 0.0)).collect();
        triangles.push((stretch.select_columns(&moved).qr().unpack_r(), moved));
    }
    let height: usize = triangles.iter().map(|(triangle, _)| triangle.nrows()).sum();
    let mut short = DMatrix::zeros(height.max(columns), columns);
    let mut first = 0;
    for (triangle, moved) in triangles {
        for (from, &to) in moved.iter().enumerate() {
            short.view_mut((first, to), (triangle.nrows(), 1)).copy_from(&triangle.column(from));
        }
        first += triangle.nrows();
    }
    short
}

/// (JᵀJ)⁻¹ by QR of J with columns of unit length; `None` if a column depends on the others to within rounding.
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
    let r = shortened(&scaled).qr().unpack_r();
    if (0..n).any(|j| r[(j, j)].abs() < 1e-10) {
        return None;
    }
    let inverse = r.solve_upper_triangular(&DMatrix::identity(n, n))?;
    let product = &inverse * inverse.transpose();
    Some(DMatrix::from_fn(n, n, |i, j| product[(i, j)] / (norms[i] * norms[j])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five logs of 700 rows with two shared variables and one each: products of columns are kept with few rows.
    #[test]
    fn products_of_columns_stay() {
        let mut number = 0.37_f64;
        let mut next = || {
            number = (997.0 * number).fract();
            number - 0.5
        };
        let mut tall = DMatrix::zeros(3500, 8);
        for row in 0..3500 {
            for column in [0, 1, 2 + row / 700, 7] {
                tall[(row, column)] = next();
            }
        }
        let short = shortened(&tall);
        assert!(short.nrows() < 100, "{}", short.nrows());
        let (known, own) = (tall.tr_mul(&tall), short.tr_mul(&short));
        assert!((&known - &own).abs().max() < 1e-12 * known.abs().max(), "{known} {own}");
        // A short matrix stays unchanged.
        let few = tall.rows(0, 100).into_owned();
        assert_eq!(shortened(&few), few);
    }
}

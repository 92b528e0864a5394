//! Eigenvalues of small, badly scaled real matrices.
//!
//! A matrix is first deflated by single rows or columns, then balanced, then reduced to real Schur form by a bounded
//! iteration; finally each eigenvalue is refined by its left and right eigenvector.

use crate::error::{Error, Result};
use nalgebra::linalg::Schur;
use nalgebra::{Complex, DMatrix, DVector};

/// Maximum number of steps of the Schur iteration.
const MOST_STEPS: usize = 10_000;

/// Maximum number of rotated copies of a matrix that are tried if the iteration does not converge.
const MOST_TURNS: u32 = 8;

/// Eigenvalues below this fraction of the matrix norm are zero within rounding.
const NOTHING: f64 = 1e-13;

/// Diagonal D of powers of two for which rows and columns of D⁻¹ A D have similar norms (Osborne 1960, Parlett and
/// Reinsch 1969); scaling by powers of two is exact.
pub(crate) fn balance(matrix: &DMatrix<f64>) -> DVector<f64> {
    let n = matrix.nrows();
    let mut a = matrix.clone();
    let mut scale = DVector::from_element(n, 1.0);
    // It terminates by itself; the bound is for NaN entries.
    for _ in 0..100 {
        let mut done = true;
        for i in 0..n {
            let others = || (0..n).filter(|&j| j != i);
            let column: f64 = others().map(|j| a[(j, i)].abs()).sum();
            let row: f64 = others().map(|j| a[(i, j)].abs()).sum();
            if column == 0.0 || row == 0.0 || !(column + row).is_finite() {
                continue;
            }
            // The power of two for which c f and r/f are closest.
            let factor = (0.5 * (row / column).log2()).round().clamp(-300.0, 300.0).exp2();
            if column * factor + row / factor < 0.95 * (column + row) {
                done = false;
                scale[i] *= factor;
                a.column_mut(i).scale_mut(factor);
                a.row_mut(i).scale_mut(1.0 / factor);
            }
        }
        if done {
            break;
        }
    }
    scale
}

/// D⁻¹ A D.
pub(crate) fn scaled(matrix: &DMatrix<f64>, scale: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[j] / scale[i])
}

/// The largest sum of absolute values in a row.
pub(crate) fn norm(matrix: &DMatrix<f64>) -> f64 {
    matrix.row_iter().map(|row| row.iter().map(|v| v.abs()).sum()).fold(0.0, f64::max)
}

/// Eigenvalues in order of absolute value, conjugates side by side, the one with positive imaginary part first.
///
/// Fails only if the matrix contains NaN, or the iteration does not converge for any of its rotated copies.
pub(crate) fn eigenvalues(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let (mut values, rest) = taken_apart(matrix);
    if rest.nrows() > 0 {
        let balanced = scaled(&rest, &balance(&rest));
        values.extend(polished(&balanced, balanced.nrows(), &schur(&balanced)?, norm(&balanced)));
    }
    sort(&mut values);
    Ok(values)
}

/// Eigenvalues from the Schur form alone: each within a few roundings of the largest.
pub(crate) fn rough(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let (mut values, rest) = taken_apart(matrix);
    if rest.nrows() > 0 {
        values.extend(schur(&scaled(&rest, &balance(&rest)))?);
    }
    Ok(values)
}

/// By absolute value, then conjugates together.
pub(crate) fn sort(values: &mut [Complex<f64>]) {
    values.sort_by(|p, q| p.norm().total_cmp(&q.norm()).then(q.im.total_cmp(&p.im)));
}

/// Distance to the nearest other eigenvalue.
fn distance(values: &[Complex<f64>], of: usize) -> f64 {
    let others = values.iter().enumerate().filter(|(j, _)| *j != of);
    others.map(|(_, other)| (other - values[of]).norm()).fold(f64::INFINITY, f64::min)
}

/// Deflation: eigenvalues on the diagonal whose row or column is otherwise zero, and the matrix without these rows and
/// columns.
fn taken_apart(matrix: &DMatrix<f64>) -> (Vec<Complex<f64>>, DMatrix<f64>) {
    let (mut values, mut rest) = (Vec::new(), matrix.clone());
    loop {
        let n = rest.nrows();
        let alone = (0..n).find(|&i| {
            let others = || (0..n).filter(|&j| j != i);
            others().all(|j| rest[(i, j)] == 0.0) || others().all(|j| rest[(j, i)] == 0.0)
        });
        let Some(i) = alone else { return (values, rest) };
        values.push(Complex::new(rest[(i, i)], 0.0));
        rest = rest.remove_row(i).remove_column(i);
    }
}

/// Eigenvalues from the real Schur form.
fn schur(matrix: &DMatrix<f64>) -> Result<Vec<Complex<f64>>> {
    let n = matrix.nrows();
    let size = norm(matrix);
    if !size.is_finite() {
        return Err(Error::new("the linearised equations hold a number that is too large to compute with")
            .next("check the units of stiffness, inertia and inductance"));
    }
    for turn in 0..MOST_TURNS {
        let mut copy = matrix.clone();
        if turn > 0 && n > 1 {
            // A rotated copy has the same eigenvalues, and breaks a cycle of the iteration.
            let (s, c) = (0.1 + 0.37 * f64::from(turn)).sin_cos();
            let mut rotation = DMatrix::identity(n, n);
            let (i, j) = (turn as usize % n, (turn as usize + 1) % n);
            (rotation[(i, i)], rotation[(i, j)], rotation[(j, i)], rotation[(j, j)]) = (c, s, -s, c);
            copy = &rotation * copy * rotation.transpose();
        }
        if let Some(form) = Schur::try_new(copy, f64::EPSILON, MOST_STEPS) {
            return Ok(form.complex_eigenvalues().iter().copied().collect());
        }
    }
    Err(Error::new("the eigenvalues of the linearised equations cannot be found: the iteration does not settle")
        .next("change a value of the case a little"))
}

/// Refines the approximate eigenvalues of M − s E, conjugates side by side; E is the unit matrix in its first `count`
/// rows and zero in the others. Values that are zero within rounding of `size` become zero.
pub(crate) fn polished(matrix: &DMatrix<f64>, count: usize, rough: &[Complex<f64>], size: f64) -> Vec<Complex<f64>> {
    let mut values = Vec::with_capacity(rough.len());
    for (i, &value) in rough.iter().enumerate().filter(|(_, value)| value.im >= 0.0) {
        let better = refined(matrix, count, value, distance(rough, i));
        let better = if better.norm() <= NOTHING * size { Complex::new(0.0, 0.0) } else { better };
        values.push(better);
        if value.im > 0.0 {
            values.push(better.conj());
        }
    }
    values
}

/// Refines one of them, s.
///
/// By its right and left vectors: (M − s E) x ≈ 0, yᴴ (M − s E) ≈ 0, s ← s + yᴴ (M − s E) x / yᴴ E x. `apart` is the
/// distance to the next one: a correction above a tenth of it is rejected.
fn refined(matrix: &DMatrix<f64>, count: usize, s: Complex<f64>, apart: f64) -> Complex<f64> {
    let whole = matrix.map(|v| Complex::new(v, 0.0));
    let n = whole.nrows();
    let shifted = |s: Complex<f64>| {
        let mut shifted = whole.clone();
        for i in 0..count {
            shifted[(i, i)] -= s;
        }
        shifted
    };
    let kept =
        |v: &DVector<Complex<f64>>| DVector::from_fn(n, |i, _| if i < count { v[i] } else { Complex::new(0.0, 0.0) });
    let size = norm(matrix);
    let start = DVector::from_fn(n, |i, _| Complex::new(1.0 + 0.1 * i as f64, 0.3));
    let mut best = s;
    for _ in 0..2 {
        let at = shifted(best);
        let (right, left) = (at.clone().lu(), at.adjoint().lu());
        let (mut x, mut y) = (start.clone(), start.clone());
        for _ in 0..3 {
            let (Some(next_x), Some(next_y)) = (right.solve(&kept(&x)), left.solve(&kept(&y))) else { return best };
            (x, y) = (next_x.unscale(next_x.norm()), next_y.unscale(next_y.norm()));
        }
        let change = y.dotc(&(&at * &x)) / y.dotc(&kept(&x));
        if !(change.norm() <= 0.1 * apart && change.norm() <= 1e-3 * best.norm() + 1e-8 * size) {
            return best;
        }
        best += change;
        if s.im == 0.0 {
            best.im = 0.0;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balancing_is_exact_and_evens_out() {
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 1e8, 1e-6, 2.0]);
        let b = scaled(&a, &balance(&a));
        assert_eq!((b[(0, 0)], b[(1, 1)]), (1.0, 2.0));
        assert_eq!(b[(0, 1)] * b[(1, 0)], 1e8 * 1e-6);
        assert!(norm(&b) < 20.0, "{b}");
    }

    /// A companion matrix of (s + 1e-3)(s + 1)(s² + 2 s + 1e10): eleven decades between its eigenvalues.
    #[test]
    fn slow_eigenvalues_beside_fast_ones() {
        let slow = [1e-3, 1.0 + 1e-3, 1.0];
        let fast = [1e10, 2.0, 1.0];
        let mut p = [0.0; 5];
        for (i, a) in slow.iter().enumerate() {
            for (j, b) in fast.iter().enumerate() {
                p[i + j] += a * b;
            }
        }
        let a = DMatrix::from_fn(4, 4, |i, j| if i < 3 { f64::from(u8::from(j == i + 1)) } else { -p[j] });
        let values = eigenvalues(&a).unwrap();
        assert!((values[0].re + 1e-3).abs() < 1e-12 && (values[1].re + 1.0).abs() < 1e-10, "{values:?}");
        assert!((values[2].norm() - 1e5).abs() < 1e-7 && values[2].im > 0.0, "{values:?}");
    }

    /// The cyclic permutation of four coordinates, on which unshifted iterations cycle for ever.
    #[test]
    fn a_circle_of_four() {
        let a = DMatrix::from_fn(4, 4, |i, j| f64::from(u8::from(j == (i + 1) % 4)));
        let values = eigenvalues(&a).unwrap();
        assert!(values.iter().all(|v| (v.norm() - 1.0).abs() < 1e-14), "{values:?}");
    }
}

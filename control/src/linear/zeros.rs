//! Invariant zeros of a system with one input and one output.
//!
//! The reduction of A. Emami-Naeini, P. Van Dooren, "Computation of zeros of linear multivariable systems", Automatica
//! 18 (1982), which for one input and one output is: hold the output at zero, which removes one state, and check if the
//! input determines the remaining output; otherwise repeat.

use super::eigen::{balance, norm, polished, rough, scaled, sort};
use crate::error::Result;
use nalgebra::{Complex, DMatrix, DVector};

/// Markov parameters below this fraction of their largest terms are zero.
const CANCELLED: f64 = 1e-11;

/// The zeros of an output, and its gain.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Zeros {
    /// Zeros, at which the output stays zero although the state moves, rad/s (for a discrete-time system, 1);
    /// conjugates side by side.
    pub values: Vec<Complex<f64>>,
    /// Gain k in G(s) = k ∏ (s − z) / ∏ (s − p); zero if the input does not affect the output.
    pub gain: f64,
}

/// Relative degree of y = c x + d u, and the first Markov parameter d, c b, c A b, … that is not zero; none if all are.
///
/// Most reliable for a system whose coefficients are single numbers, not differences, so that zeros are exact.
pub(crate) fn relative_degree(a: &DMatrix<f64>, b: &DVector<f64>, c: &DVector<f64>, d: f64) -> Option<(usize, f64)> {
    if d != 0.0 {
        return Some((0, d));
    }
    let (absolute, c_absolute) = (a.abs(), c.abs());
    let (mut power, mut size) = (b.clone(), b.abs());
    for degree in 1..=a.nrows() {
        let parameter = c.dot(&power);
        if parameter.abs() > CANCELLED * c_absolute.dot(&size) {
            return Some((degree, parameter));
        }
        (power, size) = (a * power, &absolute * size);
    }
    None
}

/// Zeros of ẋ = A x + b u, y = c x + d u, whose relative degree and gain are known.
pub(crate) fn zeros(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    c: &DVector<f64>,
    d: f64,
    degree: Option<(usize, f64)>,
) -> Result<Zeros> {
    let Some((degree, gain)) = degree else { return Ok(Zeros { values: Vec::new(), gain: 0.0 }) };
    let (mut values, a, b, c) = seen(a.clone(), b.clone(), c.clone());
    let n = a.nrows();
    let scale = balance(&a);
    let a = scaled(&a, &scale);
    let mut b = b.component_div(&scale);
    let mut c = c.component_mul(&scale);
    // Input and output in units that scale the entries of b and c to those of A.
    let size = norm(&a).max(f64::MIN_POSITIVE);
    let [unit_b, unit_c] = [b.amax(), c.amax()].map(|m| if m > 0.0 { (m / size).log2().round().exp2() } else { 1.0 });
    b.unscale_mut(unit_b);
    c.unscale_mut(unit_c);
    let mut d = d / (unit_b * unit_c);
    let whole = bordered(&a, &b, &c, d);
    let mut a = a;
    for _ in 0..degree {
        let n = a.nrows();
        let single = |v: &DVector<f64>| v.iter().filter(|v| **v != 0.0).count() == 1;
        if single(&b) && !single(&c) {
            // The transposed system has the same zeros, with input and output exchanged.
            a = a.transpose();
            std::mem::swap(&mut b, &mut c);
        }
        // With y = γ x_n = 0 the remaining output is ẋ_n. An output that is a single state only has to be moved to the
        // end, without rounding.
        if single(&c) {
            let place = c.iamax();
            a.swap_rows(place, n - 1);
            a.swap_columns(place, n - 1);
            b.swap_rows(place, n - 1);
        } else {
            // A reflection that maps c to (0, …, 0, γ)
            let mut v = c.clone();
            v[n - 1] += c.norm().copysign(c[n - 1]);
            let reflect = DMatrix::identity(n, n) - &v * v.transpose() * (2.0 / v.norm_squared());
            a = &reflect * a * &reflect;
            b = &reflect * b;
        }
        c = a.row(n - 1).columns(0, n - 1).transpose();
        d = b[n - 1];
        b = b.rows(0, n - 1).into_owned();
        a = a.view((0, 0), (n - 1, n - 1)).into_owned();
    }
    // u = −c x/d holds it at zero.
    let rough = rough(&(&a - &b * c.transpose() / d))?;
    values.extend(polished(&whole, n, &rough, size));
    sort(&mut values);
    Ok(Zeros { values, gain })
}

/// A system without unobservable and uncontrollable states on which nothing else depends; each of them is a zero that
/// cancels a pole.
fn seen(
    mut a: DMatrix<f64>,
    mut b: DVector<f64>,
    mut c: DVector<f64>,
) -> (Vec<Complex<f64>>, DMatrix<f64>, DVector<f64>, DVector<f64>) {
    let mut values = Vec::new();
    loop {
        let n = a.nrows();
        let alone = (0..n).find(|&i| {
            let others = || (0..n).filter(|&j| j != i);
            c[i] == 0.0 && others().all(|j| a[(j, i)] == 0.0) || b[i] == 0.0 && others().all(|j| a[(i, j)] == 0.0)
        });
        let Some(i) = alone else { return (values, a, b, c) };
        values.push(Complex::new(a[(i, i)], 0.0));
        (a, b, c) = (a.remove_row(i).remove_column(i), b.remove_row(i), c.remove_row(i));
    }
}

/// The matrix of the system, [A b; c d].
fn bordered(a: &DMatrix<f64>, b: &DVector<f64>, c: &DVector<f64>, d: f64) -> DMatrix<f64> {
    let n = a.nrows();
    let mut whole = DMatrix::zeros(n + 1, n + 1);
    whole.view_mut((0, 0), (n, n)).copy_from(a);
    whole.view_mut((0, n), (n, 1)).copy_from(b);
    whole.view_mut((n, 0), (1, n)).copy_from(&c.transpose());
    whole[(n, n)] = d;
    whole
}

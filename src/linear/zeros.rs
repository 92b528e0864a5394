//! Invariant zeros of a system with one input and one output.
//!
//! The reduction of A. Emami-Naeini, P. Van Dooren, "Computation of zeros of linear multivariable systems", Automatica 18 (1982), which for
//! one input and one output is: hold the output at zero, which costs one state, and look whether the input now decides what
//! is left of the output; if not, again.

use super::eigen::{balance, distance, eigenvalues, norm, polished, scaled, sort};
use crate::error::Result;
use nalgebra::{Complex, DMatrix, DVector};

/// What is smaller than this share of the system's norm is nothing but rounding.
const ROUNDING: f64 = 1e-13;

/// The zeros of an output, and its gain.
#[derive(Debug, Clone, PartialEq)]
pub struct Zeros {
    /// Where the output stays at zero though the state moves, rad/s (for a discrete-time system, 1); conjugates side by side.
    pub values: Vec<Complex<f64>>,
    /// Gain k in G(s) = k ∏ (s − z) / ∏ (s − p); zero where the input does not reach the output.
    pub gain: f64,
}

/// Zeros and gain of ẋ = A x + b u, y = c x + d u.
pub(crate) fn zeros(a: &DMatrix<f64>, b: &DVector<f64>, c: &DVector<f64>, d: f64) -> Result<Zeros> {
    let n = a.nrows();
    let scale = balance(a);
    let a = scaled(a, &scale);
    let mut b = b.component_div(&scale);
    let mut c = c.component_mul(&scale);
    // Input and output in units that make the entries of b and c as large as those of A.
    let size = norm(&a).max(f64::MIN_POSITIVE);
    let [unit_b, unit_c] = [b.amax(), c.amax()].map(|m| if m > 0.0 { (m / size).log2().round().exp2() } else { 1.0 });
    b.unscale_mut(unit_b);
    c.unscale_mut(unit_c);
    let unit = unit_b * unit_c;
    let whole = bordered(&a, &b, &c, d / unit);
    let (mut a, mut d, mut gain) = (a, d / unit, 1.0);
    loop {
        let n = a.nrows();
        if d.abs() > ROUNDING * c.norm().max(b.norm()) {
            break;
        }
        let length = c.norm();
        if n == 0 || length <= ROUNDING * size {
            return Ok(Zeros { values: Vec::new(), gain: 0.0 });
        }
        // A reflection that turns c into (0, …, 0, γ): with y = γ x_n = 0, what is left of the output is ẋ_n.
        let gamma = if c[n - 1] > 0.0 { -length } else { length };
        let gamma = if c.iter().take(n - 1).all(|v| *v == 0.0) { c[n - 1] } else { gamma };
        let mut v = c.clone();
        v[n - 1] -= gamma;
        let square = v.norm_squared();
        if square > 0.0 {
            let reflect = DMatrix::identity(n, n) - &v * v.transpose() * (2.0 / square);
            a = &reflect * a * &reflect;
            b = &reflect * b;
        }
        gain *= gamma;
        c = a.row(n - 1).columns(0, n - 1).transpose();
        d = b[n - 1];
        b = b.rows(0, n - 1).into_owned();
        a = a.view((0, 0), (n - 1, n - 1)).into_owned();
    }
    // u = −c x/d holds it at zero.
    let rough = eigenvalues(&(&a - &b * c.transpose() / d))?;
    let mut values = Vec::with_capacity(rough.len());
    for (i, &value) in rough.iter().enumerate() {
        if value.im < 0.0 || value.norm() == 0.0 {
            values.extend((value.im == 0.0).then_some(value));
            continue;
        }
        let value = polished(&whole, n, value, distance(&rough, i));
        values.push(value);
        if value.im > 0.0 {
            values.push(value.conj());
        }
    }
    sort(&mut values);
    Ok(Zeros { values, gain: gain * d * unit })
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

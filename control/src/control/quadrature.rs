//! Integrals and peaks over parts of a curve.

use crate::metrics::Peak;
use crate::signal;
use crate::solve::{Curve, Polynomial, TERMS, integral, integral_of_product};

/// Time derivative of a quantity on a curve of this length, s.
pub(super) fn slope(quantity: &Polynomial, length: f64) -> Polynomial {
    let term = |k: usize| if k + 1 < TERMS { (k + 1) as f64 * quantity.0[k + 1] / length } else { 0.0 };
    Polynomial(std::array::from_fn(term))
}

/// The integral of the square of a polynomial over a part of 0..1.
pub(super) fn square(quantity: &Polynomial, part: (f64, f64)) -> f64 {
    match part {
        (0.0, 1.0) => {
            let values = quantity.at_nodes();
            integral_of_product(&values, &values)
        }
        _ => integral(part, |s| quantity.at(s).powi(2)),
    }
}

/// Σ c_k τᵏ, τ = (s − `from`) · `length`, in powers of s.
pub(super) fn shifted(coefficients: &[f64; 5], from: f64, length: f64) -> Polynomial {
    let mut power = 1.0;
    let scaled = coefficients.map(|coefficient| {
        let term = coefficient * power;
        power *= length;
        term
    });
    let mut terms = [0.0; TERMS];
    // In powers of s instead of s − from.
    terms[..5].copy_from_slice(&signal::shifted(&scaled, -from));
    Polynomial(terms)
}

/// Updates a peak by the largest magnitude on a part of a curve.
pub(super) fn larger(peak: &mut Peak, quantity: &Polynomial, part: (f64, f64), curve: &Curve) {
    if quantity.may_exceed(peak.value.abs()) {
        let (s, value) = quantity.largest(part.0, part.1);
        if value.abs() > peak.value.abs() {
            *peak = Peak { value, time: curve.begin + s * curve.length };
        }
    }
}

//! Integrals and peaks of piecewise polynomials.

use crate::metrics::Peak;
use crate::signal;
use crate::solve::{Curve, Polynomial, TERMS};

/// Time derivative of a quantity on a curve of this length, s.
pub(super) fn slope(quantity: &Polynomial, length: f64) -> Polynomial {
    let term = |k: usize| if k + 1 < TERMS { (k + 1) as f64 * quantity.0[k + 1] / length } else { 0.0 };
    Polynomial(std::array::from_fn(term))
}

/// The integral of the square of a polynomial over a part of 0..1.
pub(super) fn square(quantity: &Polynomial, part: (f64, f64)) -> f64 {
    match part {
        (0.0, 1.0) => {
            let values = at_places(quantity);
            product(&values, &values)
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
    if quantity.bound() > peak.value.abs() {
        let (s, value) = quantity.largest(part.0, part.1);
        if value.abs() > peak.value.abs() {
            *peak = Peak { value, time: curve.begin + s * curve.length };
        }
    }
}

/// Nodes and weights of the Gauss-Legendre rule with eight nodes on −1..1, one half of them: exact to degree 15, while
/// products of two [`Polynomial`]s have degree 14.
const GAUSS: [(f64, f64); 4] = [
    (0.183_434_642_495_649_8, 0.362_683_783_378_362),
    (0.525_532_409_916_329, 0.313_706_645_877_887_3),
    (0.796_666_477_413_626_7, 0.222_381_034_453_374_48),
    (0.960_289_856_497_536_3, 0.101_228_536_290_376_26),
];

/// Powers of the nodes of that rule on 0..1, by power and node; and the weights.
const POWERS: [[f64; PLACES]; TERMS] = {
    let (mut powers, mut k) = ([[1.0; PLACES]; TERMS], 1);
    while k < TERMS {
        let mut j = 0;
        while j < PLACES {
            let (x, _) = GAUSS[j / 2];
            let place = if j % 2 == 0 { 0.5 - 0.5 * x } else { 0.5 + 0.5 * x };
            powers[k][j] = powers[k - 1][j] * place;
            j += 1;
        }
        k += 1;
    }
    powers
};

const PLACES: usize = 2 * GAUSS.len();

/// Values of a polynomial at the nodes on 0..1.
pub(super) fn at_places(polynomial: &Polynomial) -> [f64; PLACES] {
    let mut values = [0.0; PLACES];
    for (c, powers) in polynomial.0.iter().zip(&POWERS) {
        values.iter_mut().zip(powers).for_each(|(value, power)| *value += c * power);
    }
    values
}

/// Integral over 0..1 of the product of two polynomials with these values.
pub(super) fn product(a: &[f64; PLACES], b: &[f64; PLACES]) -> f64 {
    let weighted = |(j, (_, w)): (usize, &(f64, f64))| w * (a[2 * j] * b[2 * j] + a[2 * j + 1] * b[2 * j + 1]);
    0.5 * GAUSS.iter().enumerate().map(weighted).sum::<f64>()
}

/// The integral over s on a part of 0..1.
pub(super) fn integral((from, to): (f64, f64), value: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    GAUSS.iter().map(|(x, w)| w * (value(middle - half * x) + value(middle + half * x))).sum::<f64>() * half
}

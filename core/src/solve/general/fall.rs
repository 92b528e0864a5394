//! The first fall of a guard that is a series over a step.

use super::radau::{POINTS, TERMS};
use crate::solve::propagator::SERIES_TERMS;
use crate::solve::roots;
use crate::solve::widest::widest;

/// True if a function with these values at the points of a step can become negative within. A quartic leaves the range
/// of its values at the points by at most their spread; an oscillation by up to four radians within the step adds to
/// that.
pub(super) fn may_fall(values: &[f64; POINTS]) -> bool {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    // NaN counts as a possible fall.
    !(low > 5.0 * (high - low) || (low == high && low >= 0.0))
}

/// 2⁻ᵏ.
const HALVES: [f64; TERMS] = {
    let (mut table, mut k) = ([1.0; TERMS], 1);
    while k < TERMS {
        table[k] = 0.5 * table[k - 1];
        k += 1;
    }
    table
};

/// ((1 + s)/2)ᵏ by powers of s: `[k][power]`.
static SECOND: [[f64; SERIES_TERMS]; TERMS] = {
    let (mut table, mut k) = ([[0.0; SERIES_TERMS]; TERMS], 1);
    table[0][0] = 1.0;
    while k < TERMS {
        let mut j = 0;
        while j < SERIES_TERMS {
            table[k][j] = 0.5 * (table[k - 1][j] + if j > 0 { table[k - 1][j - 1] } else { 0.0 });
            j += 1;
        }
        k += 1;
    }
    table
};

widest! {
    /// The coefficients on the second half of a step, from those on the whole.
    fn second_half(c: &[f64]) -> [f64; SERIES_TERMS] = second_half_by_any, second_half_by_avx2;
}

#[inline(always)]
fn second_half_by_any(c: &[f64]) -> [f64; SERIES_TERMS] {
    let mut second = [0.0; SERIES_TERMS];
    // The smallest first.
    for (c, row) in c.iter().zip(&SECOND).rev() {
        second.iter_mut().zip(row).for_each(|(sum, weight)| *sum += c * weight);
    }
    second
}

/// The first s in (0, 1] at which Σ c_k sᵏ, with highest power `order`, becomes negative.
pub(super) fn first_fall(c: &[f64; TERMS], order: usize) -> Option<f64> {
    // Zero at the beginning: the first nonzero power decides if it falls at once.
    if c[0] == 0.0 && c[1..=order].iter().find(|c| **c != 0.0).is_some_and(|c| *c < 0.0) {
        return Some(0.0);
    }
    if order < SERIES_TERMS {
        return roots::first_fall(&c[..=order]);
    }
    let c = &c[..=order];
    if c[1..].iter().fold(c[0], |sum, &c| sum + if c < 0.0 { c } else { 0.0 }) >= 0.0 {
        return None;
    }
    // Higher powers are negligible over half the step.
    let mut first = [0.0; SERIES_TERMS];
    first.iter_mut().zip(c).zip(&HALVES).for_each(|((first, c), half)| *first = c * half);
    if let Some(s) = roots::first_fall(&first) {
        return Some(0.5 * s);
    }
    let mut second = second_half(c);
    if second[0] <= 0.0 {
        // Zero between the halves: the first nonzero power decides about the second half.
        second[0] = 0.0;
        if second[1..].iter().find(|c| **c != 0.0).is_some_and(|c| *c < 0.0) {
            return Some(0.5);
        }
    }
    roots::first_fall(&second).map(|s| 0.5 + 0.5 * s)
}

/// The place near `s` where Σ c_k sᵏ is zero, by Newton's method; no farther than the reach of the series.
pub(super) fn zero_near(c: &[f64; TERMS], order: usize, mut s: f64) -> f64 {
    for _ in 0..8 {
        let (mut value, mut slope) = (0.0, 0.0);
        for c in c[..=order].iter().rev() {
            slope = slope * s + value;
            value = value * s + c;
        }
        let next = (s - value / slope).clamp(0.0, 1.05);
        // A contact with zero has no slope for Newton's method.
        if slope >= 0.0 || !next.is_finite() || (next - s).abs() > 0.25 {
            return s;
        }
        let done = (next - s).abs() <= f64::EPSILON * s;
        s = next;
        if done {
            break;
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn coefficients(list: &[f64]) -> [f64; TERMS] {
        std::array::from_fn(|k| list.get(k).copied().unwrap_or(0.0))
    }

    #[test]
    fn a_touch_between_the_ends_is_seen() {
        // Below zero only from 0.50 to 0.52; positive at all points.
        let c = coefficients(&[0.5 * 0.52, -1.02, 1.0]);
        for order in [2, TERMS - 1] {
            let s = first_fall(&c, order).unwrap();
            assert!((s - 0.5).abs() < 1e-12, "{s}");
        }
        let values = super::super::radau::PLACES.map(|s| (s - 0.50) * (s - 0.52));
        assert!(values.iter().all(|&v| v > 0.0) && may_fall(&values));
    }

    /// A load that passed a breakaway of zero at once and came back within the step was not detected: −s² + 4 s³.
    #[test]
    fn what_falls_from_zero_falls_at_once() {
        for order in [3, 20, TERMS - 1] {
            assert_eq!(first_fall(&coefficients(&[0.0, 0.0, -1.0, 4.0]), order), Some(0.0));
            assert_eq!(first_fall(&coefficients(&[0.0, 0.0, 1.0, -0.5]), order), None);
        }
    }

    /// cos 4 s falls at π/8; e^{−4 s} − e^{−3} only in the second half, at 3/4.
    #[test]
    fn long_series_are_searched_by_halves() {
        let mut term = 1.0;
        let cosine: [f64; TERMS] = std::array::from_fn(|k| {
            let now = if k % 2 == 0 { term } else { 0.0 };
            if k % 2 == 1 {
                term *= -16.0 / (k as f64 * (k as f64 + 1.0));
            }
            now
        });
        let s = first_fall(&cosine, TERMS - 1).unwrap();
        assert!((s - std::f64::consts::PI / 8.0).abs() < 1e-14, "{s}");
        assert!((zero_near(&cosine, TERMS - 1, 0.4) - s).abs() < 1e-14);
        let mut term = 1.0;
        let mut decay: [f64; TERMS] = std::array::from_fn(|k| {
            let now = term;
            term *= -4.0 / (k + 1) as f64;
            now
        });
        decay[0] -= (-3.0_f64).exp();
        let s = first_fall(&decay, TERMS - 1).unwrap();
        assert!((s - 0.75).abs() < 1e-12, "{s}");
    }
}

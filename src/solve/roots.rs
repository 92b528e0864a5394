//! The first place in (0, 1] where a polynomial becomes negative.

use super::propagator::SERIES_ORDER;

/// Value and derivative of Σ c_k sᵏ.
fn value_and_slope(c: &[f64], s: f64) -> (f64, f64) {
    c.iter().rev().fold((0.0, 0.0), |(p, slope), c| (p * s + c, slope * s + p))
}

/// The first s in (0, 1] at which Σ c_k sᵏ, not negative at 0, turns negative; `None` if it stays.
pub(crate) fn first_fall(c: &[f64]) -> Option<f64> {
    let (&c0, rest) = c.split_first()?;
    if c0 < 0.0 {
        return Some(0.0);
    }
    if c0 >= rest.iter().map(|c| c.abs()).sum() {
        return None;
    }
    // Bernstein coefficients, b_i = Σ_{k ≤ i} C(i,k)/C(n,k) c_k: the polynomial lies within their hull.
    let mut b = [0.0; MOST];
    let n = c.len() - 1;
    for (i, (b, ratios)) in b.iter_mut().zip(&RATIOS[n]).enumerate().take(n + 1) {
        for (c, ratio) in c.iter().zip(ratios).take(i + 1) {
            *b += ratio * c;
        }
    }
    search(c, &b[..=n], 0.0, 1.0)
}

/// Room for the coefficients of a Taylor series.
const MOST: usize = SERIES_ORDER + 1;

/// C(i,k)/C(n,k), by n, i and k; zero for k above i.
static RATIOS: [[[f64; MOST]; MOST]; MOST] = {
    let mut table = [[[0.0; MOST]; MOST]; MOST];
    let mut n = 0;
    while n < MOST {
        let mut i = 0;
        while i <= n {
            let (mut ratio, mut k) = (1.0, 0);
            while k <= i {
                table[n][i][k] = ratio;
                ratio *= (i - k) as f64 / if n > k { (n - k) as f64 } else { 1.0 };
                k += 1;
            }
            i += 1;
        }
        n += 1;
    }
    table
};

/// Halvings after which a touch is as good as a point: 2⁻⁴⁰ of an interval that is itself a fraction of a swing.
const NARROWEST: f64 = 1e-12;

/// The first fall within [low, high], on which the Bernstein coefficients are `b`.
fn search(c: &[f64], b: &[f64], low: f64, high: f64) -> Option<f64> {
    // Descartes: no more zeros than changes of sign, and one if there is one change.
    let mut changes = 0;
    let mut before = 0.0;
    for &b in b.iter().filter(|b| **b != 0.0) {
        changes += u32::from(before * b < 0.0);
        before = b.signum();
    }
    let ends_below = b.last().is_some_and(|&b| b < 0.0);
    if changes == 0 && !ends_below {
        return None;
    }
    if changes <= 1 || high - low < NARROWEST {
        // What only touches within a point is told by the sign at the end.
        return ends_below.then(|| polish(c, low, high));
    }
    // de Casteljau: the coefficients of both halves
    let n = b.len();
    let (mut left, mut right) = ([0.0; MOST], [0.0; MOST]);
    right[..n].copy_from_slice(b);
    for (i, left) in left.iter_mut().enumerate().take(n) {
        *left = right[0];
        for j in 0..n - 1 - i {
            right[j] = 0.5 * (right[j] + right[j + 1]);
        }
    }
    let middle = 0.5 * (low + high);
    // What is left in `right` runs from the middle outwards, the other way round.
    search(c, &left[..n], low, middle).or_else(|| search(c, &right[..n], middle, high))
}

/// Newton's method kept within a bracket whose upper end is negative; halving where it would leave it.
fn polish(c: &[f64], mut low: f64, mut high: f64) -> f64 {
    let mut s = 0.5 * (low + high);
    for _ in 0..100 {
        let (p, slope) = value_and_slope(c, s);
        if p < 0.0 {
            high = s;
        } else {
            low = s;
        }
        let newton = s - p / slope;
        if (newton - s).abs() <= f64::EPSILON * s {
            return newton.clamp(0.0, 1.0);
        }
        s = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_first_of_two() {
        // (s − 0.3)(s − 0.31) falls at 0.3
        let root = first_fall(&[0.3 * 0.31, -0.61, 1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-14, "{root}");
    }

    #[test]
    fn a_touch_from_above_is_no_crossing() {
        // (s − 0.5)² + 1e-12
        assert_eq!(first_fall(&[0.25 + 1e-12, -1.0, 1.0]), None);
        assert_eq!(first_fall(&[1.0, 0.0, 0.0]), None);
        assert_eq!(first_fall(&[0.0, 0.0, 1.0]), None);
        assert_eq!(first_fall(&[0.0; 13]), None);
    }

    #[test]
    fn flat_crossings_are_found_quickly() {
        // −(s − 0.3)³ and −(s − 0.3)⁵, whose roots are as flat as rounding
        let root = first_fall(&[0.027, -0.27, 0.9, -1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-5, "{root}");
        let root = first_fall(&[0.00243, -0.0405, 0.27, -0.9, 1.5, -1.0]).unwrap();
        assert!((root - 0.3).abs() < 1e-3, "{root}");
    }
}

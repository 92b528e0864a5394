//! Where a polynomial on 0 to 1 first turns negative.

use crate::double::Double;
use crate::terms::ORDER;

/// Coefficients by rising powers.
pub type Polynomial = [Double; ORDER + 1];

/// Halvings after which a touch is as good as a point.
const DEEPEST: u32 = 70;

/// The first s in (0, 1] at which Σ c_k sᵏ turns negative; `None` if it stays.
pub fn first_fall(c: &Polynomial) -> Option<Double> {
    search(c, 0)
}

/// The value at s.
pub fn value(c: &Polynomial, s: Double) -> Double {
    c.iter().rev().fold(Double::ZERO, |sum, &c| sum * s + c)
}

fn slope(c: &Polynomial, s: Double) -> Double {
    let terms = c.iter().enumerate().skip(1).rev();
    terms.fold(Double::ZERO, |sum, (k, &c)| sum * s + c * k as f64)
}

fn search(c: &Polynomial, depth: u32) -> Option<Double> {
    if c[0] < Double::ZERO {
        return Some(Double::ZERO);
    }
    let size = |k: usize| c[k].high.abs();
    let rest: f64 = (1..=ORDER).map(size).sum();
    if c[0].high > rest * (1.0 + 1e-12) || rest == 0.0 {
        return None;
    }
    let end = value(c, Double::ONE);
    // Σ k |c_k| for k ≥ 2 is the most that the slope c₁ can change.
    let bend: f64 = (2..=ORDER).map(|k| k as f64 * size(k)).sum();
    if size(1) > bend * (1.0 + 1e-12) || depth == DEEPEST {
        return (end < Double::ZERO).then(|| polish(c));
    }
    let mut left = *c;
    let mut power = 1.0;
    for c in &mut left {
        *c = *c * power;
        power *= 0.5;
    }
    let half = Double::from(0.5);
    if let Some(s) = search(&left, depth + 1) {
        return Some(s * half);
    }
    // Powers of s − 1 instead of s.
    let mut right = left;
    for i in 0..ORDER {
        for j in (i..ORDER).rev() {
            right[j] += right[j + 1];
        }
    }
    search(&right, depth + 1).map(|s| (s + Double::ONE) * half)
}

/// Newton's method in a bracket whose lower end is not negative and whose upper end is.
fn polish(c: &Polynomial) -> Double {
    let (mut low, mut high) = (Double::ZERO, Double::ONE);
    let mut s = Double::from(0.5);
    for _ in 0..250 {
        let p = value(c, s);
        if p < Double::ZERO {
            high = s;
        } else {
            low = s;
        }
        let newton = s - p / slope(c, s);
        if (newton - s).high.abs() <= 1e-31 * s.high || (high - low).high <= 1e-32 {
            break;
        }
        s = if newton > low && newton < high { newton } else { (low + high) * 0.5 };
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polynomial(c: &[f64]) -> Polynomial {
        let mut polynomial = [Double::ZERO; ORDER + 1];
        polynomial.iter_mut().zip(c).for_each(|(p, &c)| *p = Double::from(c));
        polynomial
    }

    #[test]
    fn the_first_of_two_falls() {
        // (s − 3/4)(s − 25/32) falls at 3/4
        let root = first_fall(&polynomial(&[75.0 / 128.0, -49.0 / 32.0, 1.0])).unwrap();
        assert!((root - Double::from(0.75)).high.abs() < 1e-30, "{root:?}");
    }

    #[test]
    fn a_touch_from_above_is_no_fall() {
        assert_eq!(first_fall(&polynomial(&[0.25 + 1e-13, -1.0, 1.0])), None);
        assert_eq!(first_fall(&polynomial(&[0.25, -1.0, 1.0])), None);
        assert_eq!(first_fall(&polynomial(&[1.0])), None);
        assert_eq!(first_fall(&polynomial(&[0.0])), None);
        assert_eq!(first_fall(&polynomial(&[0.0, 0.0, 1.0])), None);
    }

    #[test]
    fn a_short_dip_is_seen() {
        // (s − 1/2)² − 2⁻⁶⁰ is negative for 2⁻²⁹ alone
        let root = first_fall(&polynomial(&[0.25 - 0.5_f64.powi(54), -1.0, 1.0])).unwrap();
        assert!((root.high - 0.5).abs() < 1e-7 && root.high < 0.5, "{root:?}");
    }
}

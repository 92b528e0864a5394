//! The first place in (0, 1] where a polynomial becomes negative.

/// Value of Σ c_k sᵏ.
pub(crate) fn value(c: &[f64], s: f64) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * s + c)
}

fn slope(c: &[f64], s: f64) -> f64 {
    c.iter().enumerate().skip(1).rev().fold(0.0, |sum, (k, c)| sum * s + k as f64 * c)
}

/// The first s in (0, 1] at which Σ c_k sᵏ, not negative at 0, turns negative; `None` if it stays.
pub(crate) fn first_fall(c: &[f64]) -> Option<f64> {
    if c.first().is_some_and(|&c0| c0 < 0.0) {
        return Some(0.0);
    }
    // |p′| ≤ Σ k |c_k| and |p″| ≤ Σ k (k−1) |c_k| on [0, 1]
    let (mut steepest, mut most_curved) = (0.0, 0.0);
    for (k, c) in c.iter().enumerate().skip(1) {
        let k = k as f64;
        steepest += k * c.abs();
        most_curved += k * (k - 1.0) * c.abs();
    }
    if c.first().is_none_or(|&c0| c0 > steepest) {
        return None;
    }
    search(c, 0.0, 1.0, steepest, most_curved, 0)
}

fn search(c: &[f64], low: f64, high: f64, steepest: f64, most_curved: f64, depth: u32) -> Option<f64> {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    if value(c, middle) > steepest * half {
        return None;
    }
    let tilt = slope(c, middle);
    let monotone = tilt.abs() > most_curved * half;
    if monotone || depth == 40 {
        // One crossing at most; where it is too flat to tell (a touch), the sign at the end decides.
        if value(c, high) >= 0.0 {
            return None;
        }
        return Some(polish(c, low, high));
    }
    search(c, low, middle, steepest, most_curved, depth + 1)
        .or_else(|| search(c, middle, high, steepest, most_curved, depth + 1))
}

/// Newton's method kept within a bracket whose upper end is negative.
fn polish(c: &[f64], mut low: f64, mut high: f64) -> f64 {
    let mut s = 0.5 * (low + high);
    for _ in 0..100 {
        let p = value(c, s);
        if p < 0.0 {
            high = s;
        } else {
            low = s;
        }
        let newton = s - p / slope(c, s);
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if next == s || next <= low || next >= high {
            return high;
        }
        s = next;
    }
    high
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
    }
}

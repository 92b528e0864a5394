//! Where a quantity that is known at eight places of a step first turns negative.

use crate::solve::roots;

/// Places within a step, its ends among them: as many as a polynomial of degree 7, the step's dense output, is told by.
pub(super) const NODES: usize = 8;

/// From values at k/7 to the coefficients of the polynomial through them: rows of the inverse of V_{kj} = (k/7)ʲ.
const COEFFICIENTS: [[f64; NODES]; NODES] = inverse();

/// Gauss-Jordan elimination with exchange of rows.
const fn inverse() -> [[f64; NODES]; NODES] {
    let mut v = [[0.0; NODES]; NODES];
    let mut w = [[0.0; NODES]; NODES];
    let mut k = 0;
    while k < NODES {
        let mut power = 1.0;
        let mut j = 0;
        while j < NODES {
            v[k][j] = power;
            power *= k as f64 / (NODES - 1) as f64;
            j += 1;
        }
        w[k][k] = 1.0;
        k += 1;
    }
    let mut column = 0;
    while column < NODES {
        let (mut best, mut row) = (column, column);
        while row < NODES {
            if v[row][column].abs() > v[best][column].abs() {
                best = row;
            }
            row += 1;
        }
        (v[column], v[best]) = (v[best], v[column]);
        (w[column], w[best]) = (w[best], w[column]);
        let pivot = v[column][column];
        let mut j = 0;
        while j < NODES {
            v[column][j] /= pivot;
            w[column][j] /= pivot;
            j += 1;
        }
        row = 0;
        while row < NODES {
            let factor = v[row][column];
            if row != column && factor != 0.0 {
                j = 0;
                while j < NODES {
                    v[row][j] -= factor * v[column][j];
                    w[row][j] -= factor * w[column][j];
                    j += 1;
                }
            }
            row += 1;
        }
        column += 1;
    }
    w
}

/// The polynomial through values at k/7.
pub(super) fn through(values: &[f64; NODES]) -> [f64; NODES] {
    COEFFICIENTS.map(|row| row.iter().zip(values).fold(0.0, |sum, (c, v)| sum + c * v))
}

/// The place in [0, 1] where what has these values at k/7 first turns negative, and its slope there.
pub(super) fn first_fall(values: &[f64; NODES]) -> Option<(f64, f64)> {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &v| (l.min(v), h.max(v)));
    // The polynomial leaves the range of its values by at most (Λ − 1)/2 < 5 times their spread, Λ = 10.9 being the
    // Lebesgue constant of eight equally spaced places.
    if low > 5.0 * (high - low) {
        return None;
    }
    let mut c = through(values);
    c[0] = c[0].max(0.0);
    let s = roots::first_fall(&c)?;
    let slope = c.iter().enumerate().skip(1).rev().fold(0.0, |sum, (k, c)| sum * s + k as f64 * c);
    Some((s, slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(f: impl Fn(f64) -> f64) -> [f64; NODES] {
        std::array::from_fn(|k| f(k as f64 / (NODES - 1) as f64))
    }

    #[test]
    fn a_touch_between_the_ends_is_seen() {
        // Below zero only from 0.50 to 0.52; positive at all eight places.
        let values = sampled(|s| (s - 0.50) * (s - 0.52));
        assert!(values.iter().all(|&v| v > 0.0));
        let (s, slope) = first_fall(&values).unwrap();
        assert!((s - 0.5).abs() < 1e-9 && (slope + 0.02).abs() < 1e-9, "{s} {slope}");
    }
}

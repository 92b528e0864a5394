//! Numbers of about 106 bits: a sum of two 64-bit numbers, the second at most half a last place of the first.
//!
//! Sums after Knuth, products after Dekker: no fused multiply-add, so every processor computes the same bits.

use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// A number of about 106 bits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Double {
    /// The nearest 64-bit number.
    pub high: f64,
    /// The lower part: the rest that `high` lacks.
    pub low: f64,
}

/// Relative error that rounding makes of a result: 2⁻¹⁰⁴.
pub const ROUNDING: f64 = 5e-32;

/// π.
pub const PI: Double = Double { high: std::f64::consts::PI, low: 1.2246467991473532e-16 };

/// a + b, rounded, and the error of that (Knuth).
#[inline(always)]
fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// The same where a is the larger one (Dekker).
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> Double {
    let sum = a + b;
    Double { high: sum, low: b - (sum - a) }
}

/// The upper 26 bits of a number and the rest (Veltkamp).
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    let t = 134_217_729.0 * a;
    let high = t - (t - a);
    (high, a - high)
}

/// a b, rounded, and the error of that (Dekker).
#[inline(always)]
fn two_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    (product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
}

impl Double {
    /// 0.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };
    /// 1.
    pub const ONE: Self = Self { high: 1.0, low: 0.0 };

    /// Its absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// Sine and cosine.
    pub fn sin_cos(self) -> (Self, Self) {
        // θ = n π/2 + x with |x| ≤ π/4, and the series of x
        let quarters = (self.high / std::f64::consts::FRAC_PI_2).round();
        let x = self - PI * (0.5 * quarters);
        let mut term = Self::ONE;
        let mut sums = [Self::ZERO; 2];
        for k in 0..30_u32 {
            let sign = if k % 4 < 2 { 1.0 } else { -1.0 };
            sums[(k % 2) as usize] += term * sign;
            term = term * x / Self::from(f64::from(k + 1));
        }
        let [cosine, sine] = sums;
        match quarters.rem_euclid(4.0) as u8 {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }
}

impl From<f64> for Double {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl PartialOrd for Double {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match self.high.partial_cmp(&other.high) {
            Some(Ordering::Equal) => self.low.partial_cmp(&other.low),
            order => order,
        }
    }
}

impl Add for Double {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (sum, error) = two_sum(self.high, other.high);
        let (rest, rest_error) = two_sum(self.low, other.low);
        let first = quick_two_sum(sum, error + rest);
        quick_two_sum(first.high, first.low + rest_error)
    }
}

impl AddAssign for Double {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Neg for Double {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Double {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (product, error) = two_product(self.high, other.high);
        quick_two_sum(product, error + (self.high * other.low + self.low * other.high))
    }
}

impl Mul<f64> for Double {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f64) -> Self {
        let (product, error) = two_product(self.high, other);
        quick_two_sum(product, error + self.low * other)
    }
}

impl Div for Double {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        // Long division in three digits.
        let first = self.high / other.high;
        let rest = self - other * first;
        let second = rest.high / other.high;
        let rest = rest - other * second;
        let third = rest.high / other.high;
        quick_two_sum(first, second) + Self::from(third)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn double(value: f64) -> Double {
        Double::from(value)
    }

    #[test]
    fn quotients_times_divisors_are_dividends() {
        for (a, b) in [(1.0, 3.0), (-7.1, 1e-9), (1e200, 0.3), (2.0, 49.0)] {
            let back = double(a) / double(b) * double(b) - double(a);
            assert!(back.high.abs() <= 2.0 * ROUNDING * a.abs(), "{a} / {b}: {back:?}");
        }
    }

    #[test]
    fn squares_of_sine_and_cosine_add_up_to_one() {
        for angle in [0.0, 0.3, 1.0, -2.5, 3.0, 4.0, 5.5, 700.1] {
            let (sine, cosine) = double(angle).sin_cos();
            assert!((sine.high - angle.sin()).abs() < 1e-15 && (cosine.high - angle.cos()).abs() < 1e-15, "{angle}");
            let rest = sine * sine + cosine * cosine - Double::ONE;
            assert!(rest.high.abs() < 1e-30, "{angle}: {rest:?}");
        }
        // sin(π/6) = 1/2
        let half = (PI / double(6.0)).sin_cos().0 - double(0.5);
        assert!(half.high.abs() < 1e-31, "{half:?}");
    }

    #[test]
    fn small_parts_are_kept() {
        let sum = double(1.0) + double(1e-30);
        assert_eq!((sum - double(1.0)).high, 1e-30);
        assert!(sum > double(1.0));
    }
}

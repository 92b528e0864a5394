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

    /// e to the power of it.
    pub fn exp(self) -> Self {
        if self.high < -700.0 {
            return Self::ZERO;
        }
        // e^x = (e^{r/2^9})^{2^9} 2^n, x = n ln 2 + r
        const LN_2: Double = Double { high: std::f64::consts::LN_2, low: 2.319_046_813_846_299_6e-17 };
        let twos = (self.high / LN_2.high).round().min(1023.0);
        let r = (self - LN_2 * twos) * (1.0 / 512.0);
        let (mut term, mut sum) = (Self::ONE, Self::ZERO);
        // e^r − 1, which squaring keeps the digits of: (1 + s)² − 1 = 2 s + s²
        for k in 1..14_u32 {
            term = term * r / Self::from(f64::from(k));
            sum += term;
        }
        for _ in 0..9 {
            sum = sum * 2.0 + sum * sum;
        }
        (sum + Self::ONE) * 2.0_f64.powi(twos as i32)
    }

    /// Its hyperbolic tangent.
    pub fn tanh(self) -> Self {
        if self.high.abs() > 40.0 {
            return Self::from(self.high.signum());
        }
        // tanh x = (e^{2x} − 1)/(e^{2x} + 1)
        if self.high.abs() < 1e-3 {
            // x − x³/3 + 2x⁵/15 − 17x⁷/315 + 62x⁹/2835 − 1382x¹¹/155925
            let square = self * self;
            let c = [(1.0, 1.0), (-1.0, 3.0), (2.0, 15.0), (-17.0, 315.0), (62.0, 2835.0), (-1382.0, 155_925.0)];
            let sum = c.iter().rev().fold(Self::ZERO, |sum, &(a, b)| sum * square + Self::from(a) / Self::from(b));
            return sum * self;
        }
        let e = (self * 2.0).exp();
        (e - Self::ONE) / (e + Self::ONE)
    }

    /// 1 − tanh² of it, which keeps its digits where tanh rounds to 1.
    pub fn square_of_sech(self) -> Self {
        // 4 e^{−2x}/(1 + e^{−2x})²
        let e = (self.abs() * -2.0).exp();
        let sum = Self::ONE + e;
        e * 4.0 / (sum * sum)
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
    fn powers_of_e_multiply_and_tangents_obey_their_equation() {
        for (a, b) in [(0.3, 1.7), (-5.5, 2.25), (40.0, -39.0), (-300.0, -200.0), (1e-9, 3.0)] {
            let rest = double(a).exp() * double(b).exp() / (double(a) + double(b)).exp() - Double::ONE;
            assert!(rest.high.abs() < 1e-29, "{a} {b}: {rest:?}");
            assert!((double(a).exp().high / a.exp() - 1.0).abs() < 1e-15);
        }
        // tanh 2x = 2 tanh x/(1 + tanh² x)
        for x in [1e-5, 4e-4, 6e-4, 0.1, -1.3, 15.0] {
            let (one, two) = (double(x).tanh(), double(2.0 * x).tanh());
            let rest = two * (Double::ONE + one * one) - one * 2.0;
            assert!(rest.high.abs() < 1e-28 * x.abs().max(1e-3), "{x}: {rest:?}");
            assert!((one.high - x.tanh()).abs() < 1e-15);
        }
        // e = Σ 1/k!
        let (mut e, mut term) = (Double::ZERO, Double::ONE);
        for k in 1..30_u32 {
            e += term;
            term = term / double(f64::from(k));
        }
        assert!((Double::ONE.exp() - e).high.abs() < 1e-30);
    }

    #[test]
    fn small_parts_are_kept() {
        let sum = double(1.0) + double(1e-30);
        assert_eq!((sum - double(1.0)).high, 1e-30);
        assert!(sum > double(1.0));
    }
}

//! Enclosures of complex functions over a short interval of frequencies.

use nalgebra::Complex;
use std::ops::{Add, Mul, Sub};

/// Allowance for rounding, relative to the magnitudes of all terms of an operation.
const ROUNDING: f64 = 4e-15;

/// f(t) = c₀ + c₁ t + c₂ t² + e with |e| ≤ `radius` for all real |t| ≤ 1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet {
    pub c: [Complex<f64>; 3],
    pub radius: f64,
}

/// |z| within two roundings; faster than `norm`, which is left to squares that under- or overflow.
pub(super) fn modulus(z: Complex<f64>) -> f64 {
    let square = z.norm_sqr();
    if square > 1e-250 && square < 1e250 { square.sqrt() } else { z.norm() }
}

impl Jet {
    pub const ZERO: Self = Self { c: [Complex::ZERO; 3], radius: 0.0 };
    pub const ONE: Self = Self { c: [Complex::ONE, Complex::ZERO, Complex::ZERO], radius: 0.0 };

    /// e^{j(a + b t)}
    pub fn turning(a: f64, b: f64) -> Self {
        let center = Complex::new(0.0, a).exp();
        // e^{jbt} = 1 + j b t − b² t²/2, and at most |b|³/6 beyond
        let c = [center, center * Complex::new(0.0, b), center * (-0.5 * b * b)];
        Self { c, radius: b.abs().powi(3) / 6.0 + ROUNDING }
    }

    /// e^{j(a + b t)} − 1, accurate near zero.
    pub fn turning_less_one(a: f64, b: f64) -> Self {
        let half = Complex::new(0.0, 0.5 * a).exp();
        let whole = Self::turning(a, b);
        let center = Complex::new(0.0, 2.0 * half.im) * half;
        Self {
            c: [center, whole.c[1], whole.c[2]],
            radius: b.abs().powi(3) / 6.0 + ROUNDING * (modulus(center) + b.abs()),
        }
    }

    /// (1 − e^{−x})/x at x = j(a + b t): the mean of e^{−x u} over 0 ≤ u ≤ 1.
    pub fn held(a: f64, b: f64) -> Self {
        let x = Complex::new(0.0, a);
        let [value, slope, curvature] = if a.abs() < 0.5 {
            // Σ (−x)ᵏ/(k + 1)! and its derivatives
            let (mut sums, mut term) = ([Complex::ZERO; 3], Complex::ONE);
            for k in 0..20 {
                // term = (−x)ᵏ/k!
                let k = f64::from(k);
                sums[0] += term / (k + 1.0);
                sums[1] -= term / (k + 2.0);
                sums[2] += term / (k + 3.0);
                term *= -x / (k + 1.0);
            }
            sums
        } else {
            let e = (-x).exp();
            [
                (-e + 1.0) / x,
                (e * (x + 1.0) - 1.0) / (x * x),
                (Complex::new(2.0, 0.0) - e * (x * x + x * 2.0 + 2.0)) / (x * x * x),
            ]
        };
        let step = Complex::new(0.0, b);
        // The third derivative is a mean of −u³ e^{−x u}: at most 1/4.
        let c = [value, slope * step, curvature * step * step * 0.5];
        Self { c, radius: b.abs().powi(3) / 24.0 + 10.0 * ROUNDING }
    }

    /// Upper bound of |f|.
    pub fn most(&self) -> f64 {
        self.polynomial() + self.radius
    }

    /// Lower bound of |f|, not below zero.
    pub fn least(&self) -> f64 {
        (modulus(self.c[0]) - modulus(self.c[1]) - modulus(self.c[2]) - self.radius).max(0.0)
    }

    fn polynomial(&self) -> f64 {
        self.c.map(modulus).iter().sum()
    }

    /// The same with a larger radius.
    pub fn within(self, radius: f64) -> Self {
        Self { radius: self.radius + radius, ..self }
    }

    /// 1/f; an infinite radius if f may be zero.
    pub fn inverse(&self) -> Self {
        let first = self.c[0].inv();
        // f = c₀ (1 + q): 1/f = (1 − q + q² − q³/(1 + q))/c₀
        let q = Self { c: [Complex::ZERO, self.c[1] * first, self.c[2] * first], radius: self.radius * modulus(first) };
        let most = q.most();
        if most.is_nan() || most >= 1.0 {
            return Self { radius: f64::INFINITY, ..Self::ZERO };
        }
        let rest = (Self::ONE - q + q * q).within(most.powi(3) / (1.0 - most) + ROUNDING);
        rest * first
    }
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let c = std::array::from_fn(|k| self.c[k] + other.c[k]);
        let radius = self.radius + other.radius + ROUNDING * (self.polynomial() + other.polynomial());
        Self { c, radius }
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul for Jet {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let ([a, b, c], [p, q, r]) = (self.c, other.c);
        let (sizes, other_sizes) = (self.c.map(modulus), other.c.map(modulus));
        let (whole, other_whole): (f64, f64) = (sizes.iter().sum(), other_sizes.iter().sum());
        // Terms in t³ and t⁴ belong to the radius.
        let higher = sizes[1] * other_sizes[2] + sizes[2] * (other_sizes[1] + other_sizes[2]);
        let mixed = self.radius * (other_whole + other.radius) + other.radius * whole;
        Self {
            c: [a * p, a * q + b * p, a * r + b * q + c * p],
            radius: higher + mixed + ROUNDING * whole * other_whole,
        }
    }
}

impl Mul<Complex<f64>> for Jet {
    type Output = Self;

    fn mul(self, factor: Complex<f64>) -> Self {
        Self { c: self.c.map(|c| c * factor), radius: modulus(factor) * (self.radius + ROUNDING * self.polynomial()) }
    }
}

impl Mul<f64> for Jet {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { c: self.c.map(|c| c * factor), radius: factor.abs() * (self.radius + ROUNDING * self.polynomial()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::uniform;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    fn encloses(jet: &Jet, exact: impl Fn(f64) -> Complex<f64>) -> bool {
        (-10..=10).all(|k| {
            let t = f64::from(k) / 10.0;
            let value = jet.c[0] + jet.c[1] * t + jet.c[2] * (t * t);
            (value - exact(t)).norm() <= jet.radius
        })
    }

    #[test]
    fn random_functions_lie_within_their_jets() {
        let mut random = Pcg64::seed_from_u64(5);
        for _ in 0..2000 {
            let mut draw = |most: f64| most * uniform(&mut random);
            let (a, b, c, d) = (draw(3.0), draw(0.3), draw(3.0), draw(0.3));
            let along = |a: f64, b: f64| move |t: f64| Complex::new(0.0, a + b * t);
            let (one, other) = (along(a, b), along(c, d));
            let whole = Jet::turning(a, b) * Jet::held(c, d) + Jet::turning_less_one(c, d);
            let held = |x: Complex<f64>| if x.norm() < 1e-9 { Complex::ONE } else { (-(-x).exp() + 1.0) / x };
            assert!(encloses(&whole, |t| one(t).exp() * held(other(t)) + other(t).exp() - 1.0));
            let inverse = (Jet::turning(a, b) + Jet::ONE * 1.5).inverse();
            assert!(encloses(&inverse, |t| (one(t).exp() + 1.5).inv()));
            // Each by itself, where no other radius covers it.
            assert!(encloses(&Jet::turning(a, b), |t| one(t).exp()));
            assert!(encloses(&Jet::turning_less_one(c, d), |t| other(t).exp() - 1.0));
            assert!(encloses(&Jet::held(c, d), |t| held(other(t))));
            // A cubic is the first function that needs its radius.
            assert!(Jet::turning(a, b).radius < 1.1 * b.powi(3) / 6.0 + 1e-13);
        }
    }

    #[test]
    fn a_modulus_neither_overflows_nor_underflows() {
        for scale in [1.0, 1e-200, 1e200] {
            let found = modulus(Complex::new(-3.0 * scale, 4.0 * scale));
            assert!((found / (5.0 * scale) - 1.0).abs() < 1e-15, "{found}");
        }
    }

    #[test]
    fn an_inverse_of_what_may_be_zero_has_no_bound() {
        assert_eq!(Jet::turning_less_one(0.0, 0.1).inverse().radius, f64::INFINITY);
    }
}

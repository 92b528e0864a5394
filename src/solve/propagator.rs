//! Matrix exponentials: what a linear system does in a given time.
//!
//! A vector holds `R` quantities that move and, behind them, constants, `C` in all. A matrix has `R` rows and `C` columns and
//! is kept by columns, so that its product with a vector is a chain of scaled vector additions that the compiler turns
//! into vector instructions. Products are never fused (no FMA): the same bits on every machine.
//!
//! The long loops are compiled twice, for any processor and for those with AVX2, and the right one is chosen at run time: wider vectors do
//! the same operations in the same order.

/// An `R` × `C` matrix: the rate of change ż = A z, or a change over some time, z(t + h) − z(t) = P z(t).
#[derive(Debug, Clone)]
pub(crate) struct Matrix<const R: usize, const C: usize> {
    column: [[f64; R]; C],
}

/// Largest ‖A‖ h for which the Taylor series below is used; larger steps come from doubling.
pub(crate) const SERIES_REACH: f64 = 0.25;

/// Order of the Taylor series: 0.25¹³ / 13! is 2e-18 of the leading term.
pub(crate) const SERIES_ORDER: usize = 12;

/// 1/k!
const RECIPROCAL_FACTORIAL: [f64; SERIES_ORDER + 1] = {
    let mut table = [1.0; SERIES_ORDER + 1];
    let mut factorial = 1.0;
    let mut k = 1;
    while k <= SERIES_ORDER {
        factorial *= k as f64;
        table[k] = 1.0 / factorial;
        k += 1;
    }
    table
};

impl<const R: usize, const C: usize> Matrix<R, C> {
    pub(crate) fn zero() -> Self {
        Self { column: [[0.0; R]; C] }
    }

    pub(crate) fn set(&mut self, row: usize, column: usize, value: f64) {
        self.column[column][row] = value;
    }

    /// Terms of the Taylor series over `distance` of what moves by this rate: z(s · distance) = Σ term_k sᵏ.
    pub(crate) fn series(&self, z: &[f64; C], distance: f64) -> [[f64; C]; SERIES_ORDER + 1] {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.series_by_avx2(z, distance) };
        }
        self.series_by_any(z, distance)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn series_by_avx2(&self, z: &[f64; C], distance: f64) -> [[f64; C]; SERIES_ORDER + 1] {
        self.series_by_any(z, distance)
    }

    #[inline(always)]
    fn series_by_any(&self, z: &[f64; C], distance: f64) -> [[f64; C]; SERIES_ORDER + 1] {
        let mut terms = [[0.0; C]; SERIES_ORDER + 1];
        terms[0] = *z;
        let mut next = self.times(z);
        for (k, term) in terms.iter_mut().enumerate().skip(1) {
            let factor = distance / k as f64;
            for (term, next) in term.iter_mut().zip(next) {
                *term = next * factor;
            }
            if k < SERIES_ORDER {
                next = self.times_moving(term);
            }
        }
        terms
    }

    /// The product with a vector whose constants are zero.
    #[inline(always)]
    fn times_moving(&self, z: &[f64; C]) -> [f64; R] {
        let mut sum = [0.0; R];
        for (column, &factor) in self.column.iter().zip(z).take(R) {
            for (s, c) in sum.iter_mut().zip(column) {
                *s += c * factor;
            }
        }
        sum
    }

    /// The product with a vector.
    #[inline]
    pub(crate) fn rate(&self, z: &[f64; C]) -> [f64; R] {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.times_by_avx2(z) };
        }
        self.times(z)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn times_by_avx2(&self, z: &[f64; C]) -> [f64; R] {
        self.times(z)
    }

    #[inline(always)]
    fn times(&self, z: &[f64; C]) -> [f64; R] {
        let mut sum = [0.0; R];
        for (column, &factor) in self.column.iter().zip(z) {
            for (s, c) in sum.iter_mut().zip(column) {
                *s += c * factor;
            }
        }
        sum
    }

    /// The product with a vector of which only the first `columns` are not zero.
    #[inline]
    pub(crate) fn times_first(&self, z: &[f64; C], columns: usize) -> [f64; R] {
        let mut sum = [0.0; R];
        for (column, &factor) in self.column.iter().zip(z).take(columns) {
            for (s, c) in sum.iter_mut().zip(column) {
                *s += c * factor;
            }
        }
        sum
    }

    /// z ← z + P z.
    #[inline(always)]
    pub(crate) fn advance(&self, z: &mut [f64; C]) {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.advance_by_avx2(z) };
        }
        self.advance_by_any(z);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn advance_by_avx2(&self, z: &mut [f64; C]) {
        self.advance_by_any(z);
    }

    #[inline(always)]
    fn advance_by_any(&self, z: &mut [f64; C]) {
        let change = self.times(z);
        for (z, change) in z.iter_mut().zip(change) {
            *z += change;
        }
    }

    /// The matrix of the absolute values of its entries.
    pub(crate) fn absolute(&self) -> Self {
        Self { column: self.column.map(|column| column.map(f64::abs)) }
    }

    /// The product of the square part of `self` with `other`.
    #[inline(always)]
    fn product(&self, other: &Self) -> Self {
        let mut out = Self::zero();
        for (to, from) in out.column.iter_mut().zip(&other.column) {
            let mut sum = [0.0; R];
            for (column, &factor) in self.column.iter().zip(from) {
                // What is stuck, and much of A itself, is zero.
                if factor != 0.0 {
                    for (s, c) in sum.iter_mut().zip(column) {
                        *s += c * factor;
                    }
                }
            }
            *to = sum;
        }
        out
    }

    #[inline(always)]
    fn scaled(&self, factor: f64) -> Self {
        let mut out = self.clone();
        out.column.iter_mut().flatten().for_each(|entry| *entry *= factor);
        out
    }

    /// e^{A h} − I for ‖A‖ h ≤ [`SERIES_REACH`], A being `self`.
    pub(crate) fn exponential(&self, h: f64) -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.exponential_by_avx2(h) };
        }
        self.exponential_by_any(h)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn exponential_by_avx2(&self, h: f64) -> Self {
        self.exponential_by_any(h)
    }

    #[inline(always)]
    fn exponential_by_any(&self, h: f64) -> Self {
        // Σ Xᵏ/k!, k = 1…12, gathered by powers of X³: five products (Paterson & Stockmeyer 1973)
        let x = self.scaled(h);
        let x2 = x.product(&x);
        let x3 = x.product(&x2);
        let powers = [&x, &x2, &x3];
        let fourth = Self::gathered(powers, 10, None);
        let third = Self::gathered(powers, 7, Some(&fourth));
        let second = Self::gathered(powers, 4, Some(&third));
        Self::gathered(powers, 1, Some(&second))
    }

    /// X/k! + X²/(k + 1)! + X³/(k + 2)! + X³ · rest, of the powers X, X² and X³.
    #[inline(always)]
    fn gathered([x, x2, x3]: [&Self; 3], k: usize, rest: Option<&Self>) -> Self {
        let mut out = match rest {
            Some(rest) => x3.product(rest),
            None => Self::zero(),
        };
        let [a, b, c] = [RECIPROCAL_FACTORIAL[k], RECIPROCAL_FACTORIAL[k + 1], RECIPROCAL_FACTORIAL[k + 2]];
        for column in 0..C {
            for row in 0..R {
                let [x, x2, x3] = [x, x2, x3].map(|power| power.column[column][row]);
                out.column[column][row] = out.column[column][row] + x3 * c + x2 * b + x * a;
            }
        }
        out
    }

    /// e^{2 A h} − I from e^{A h} − I, keeping the relative accuracy of small changes.
    pub(crate) fn doubled(&self) -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.doubled_by_avx2() };
        }
        self.doubled_by_any()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn doubled_by_avx2(&self) -> Self {
        self.doubled_by_any()
    }

    #[inline(always)]
    fn doubled_by_any(&self) -> Self {
        // P(2h) = 2 P + P²
        let mut out = self.product(self);
        for (o, p) in out.column.iter_mut().flatten().zip(self.column.iter().flatten()) {
            *o += 2.0 * p;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_by_doubling() {
        // ż₀ = ω z₁, ż₁ = −ω z₀ turns by ω t; a constant drives z₂ = t.
        let omega = 3.0;
        let mut a = Matrix::<3, 4>::zero();
        a.set(0, 1, omega);
        a.set(1, 0, -omega);
        a.set(2, 3, 1.0);
        let mut p = a.exponential(1.0 / 16.0);
        for _ in 0..4 {
            p = p.doubled();
        }
        let mut z = [1.0, 0.0, 0.0, 1.0];
        p.advance(&mut z);
        assert!((z[0] - omega.cos()).abs() < 1e-15, "{z:?}");
        assert!((z[1] + omega.sin()).abs() < 1e-15, "{z:?}");
        assert!((z[2] - 1.0).abs() < 1e-15);
    }
}

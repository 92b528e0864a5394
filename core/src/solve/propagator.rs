//! Matrix exponentials: propagators of linear systems.
//!
//! A vector holds `R` states followed by constants, `C` elements in total. A matrix has `R` rows and `C` columns and is
//! kept by columns, so that its product with a vector is a chain of scaled vector additions that the compiler turns
//! into vector instructions. Products are never fused (no FMA): the same bits on every machine.
//!
//! The long loops are compiled twice, for any processor and for those with AVX2, and the right one is chosen at run
//! time: wider vectors do the same operations in the same order.

mod slopes;

pub(crate) use slopes::{Columns, SlopedStep};

use crate::solve::widest::widest;

/// An `R` × `C` matrix: the rate of change ż = A z, or a change over some time, z(t + h) − z(t) = P z(t).
#[derive(Debug, Clone)]
pub(crate) struct Matrix<const R: usize, const C: usize> {
    column: [[f64; R]; C],
}

/// Largest ‖A‖ h for which the matrix exponential is summed as a Taylor series; larger steps come from doubling.
pub(crate) const EXPONENTIAL_REACH: f64 = 0.25;

/// Order of that series: 0.25¹³ / 13! is 2e-18 of the leading term.
const EXPONENTIAL_ORDER: usize = 12;

/// Largest ‖A‖ d for which the state is expanded into a Taylor series over d.
pub(crate) const SERIES_REACH: f64 = SERIES[SERIES.len() - 1].0;

/// Orders of that series, and the largest ‖A‖ d of each: the truncation error is below 3e-17 of the leading term.
const SERIES: [(f64, usize); 4] = [(0.25, 12), (0.55, 15), (1.15, 19), (2.0, 23)];

/// Most terms of it.
pub(crate) const SERIES_TERMS: usize = SERIES[SERIES.len() - 1].1 + 1;

/// The order of the series for ‖A‖ d, at most [`SERIES_REACH`].
pub(crate) fn series_order(reach: f64) -> usize {
    SERIES.iter().find(|(most, _)| reach <= *most).map_or(SERIES_TERMS - 1, |(_, order)| *order)
}

/// z(s · distance) = Σ term_k sᵏ, k up to `order`.
#[derive(Clone)]
pub(crate) struct Series<const C: usize> {
    pub(crate) terms: [[f64; C]; SERIES_TERMS],
    pub(crate) order: usize,
}

impl<const C: usize> Series<C> {
    /// An empty buffer.
    pub(crate) fn room() -> Self {
        Self { terms: [[0.0; C]; SERIES_TERMS], order: 0 }
    }

    /// The sum at `s`, added to `z`.
    pub(crate) fn add_to(&self, z: &mut [f64; C], s: f64) {
        z.iter_mut().zip(self.change(s)).for_each(|(z, change)| *z += change);
    }

    widest! {
        /// z(s · distance) − z(0).
        pub(crate) fn change(&self, s: f64) -> [f64; C] = change_by_any, change_by_avx2;
    }

    #[inline(always)]
    fn change_by_any(&self, s: f64) -> [f64; C] {
        let mut sum = [0.0; C];
        for term in self.terms[1..=self.order].iter().rev() {
            for (sum, term) in sum.iter_mut().zip(term) {
                *sum = (*sum + term) * s;
            }
        }
        sum
    }
}

/// 1/k!
const RECIPROCAL_FACTORIAL: [f64; EXPONENTIAL_ORDER + 1] = {
    let mut table = [1.0; EXPONENTIAL_ORDER + 1];
    let mut factorial = 1.0;
    let mut k = 1;
    while k <= EXPONENTIAL_ORDER {
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

    /// The entry in this row and column.
    pub(crate) fn at(&self, row: usize, column: usize) -> f64 {
        self.column[column][row]
    }

    /// Taylor series over `distance` of ż = A z.
    pub(crate) fn series(&self, z: &[f64; C], distance: f64, order: usize, series: &mut Series<C>) {
        series.order = order;
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { self.series_by_avx2(z, distance, series) };
        }
        self.series_by_any(z, distance, series);
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn series_by_avx2(&self, z: &[f64; C], distance: f64, series: &mut Series<C>) {
        self.series_by_any(z, distance, series);
    }

    #[inline(always)]
    fn series_by_any(&self, z: &[f64; C], distance: f64, series: &mut Series<C>) {
        series.terms[0] = *z;
        let mut now = *z;
        for (k, term) in series.terms[..=series.order].iter_mut().enumerate().skip(1) {
            let factor = distance / k as f64;
            let next = if k == 1 { self.times(&now) } else { self.times_moving(&now) };
            for (now, next) in now.iter_mut().zip(next) {
                *now = next * factor;
            }
            now[R..].fill(0.0);
            *term = now;
        }
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

    widest! {
        /// The product with a vector.
        #[inline]
        pub(crate) fn rate(&self, z: &[f64; C]) -> [f64; R] = times, times_by_avx2;
    }

    /// Product with z, always inlined.
    #[inline(always)]
    pub(crate) fn times(&self, z: &[f64; C]) -> [f64; R] {
        let mut sum = [0.0; R];
        for (column, &factor) in self.column.iter().zip(z) {
            for (s, c) in sum.iter_mut().zip(column) {
                *s += c * factor;
            }
        }
        sum
    }

    /// The product of a row with it.
    pub(crate) fn times_from_left(&self, row: &[f64; R]) -> [f64; C] {
        let product = |column: &[f64; R]| column.iter().zip(row).map(|(entry, weight)| entry * weight).sum();
        self.column.each_ref().map(product)
    }

    widest! {
        /// z ← z + P z.
        #[inline(always)]
        pub(crate) fn advance(&self, z: &mut [f64; C]) = advance_by_any, advance_by_avx2;
    }

    #[inline(always)]
    fn advance_by_any(&self, z: &mut [f64; C]) {
        let change = self.times(z);
        for (z, change) in z.iter_mut().zip(change) {
            *z += change;
        }
    }

    widest! {
        /// z ← z + P z for each of `rows`, which receive z; `largest` receives the largest magnitudes.
        pub(crate) fn advance_rows(&self, z: &mut [f64; C], largest: &mut [f64; C], rows: &mut [[f64; C]])
            = advance_rows_by_any, advance_rows_by_avx2;
    }

    #[inline(always)]
    fn advance_rows_by_any(&self, z: &mut [f64; C], largest: &mut [f64; C], rows: &mut [[f64; C]]) {
        let (mut now, mut most) = (*z, *largest);
        for row in rows {
            self.advance_by_any(&mut now);
            for (most, now) in most.iter_mut().zip(&now) {
                *most = if now.abs() > *most { now.abs() } else { *most };
            }
            *row = now;
        }
        (*z, *largest) = (now, most);
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
                // Rows of stuck bodies, and most entries of A, are zero.
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

    widest! {
        /// e^{A h} − I for ‖A‖ h ≤ [`EXPONENTIAL_REACH`], with A = `self`.
        pub(crate) fn exponential(&self, h: f64) -> Self = exponential_by_any, exponential_by_avx2;
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

    /// X/k! + X²/(k + 1)! + X³/(k + 2)! + X³ · rest, from the powers X, X² and X³.
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

    widest! {
        /// e^{2 A h} − I from e^{A h} − I, keeping the relative accuracy of small changes.
        pub(crate) fn doubled(&self) -> Self = doubled_by_any, doubled_by_avx2;
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

    /// The longest series of each order, of a rotation, against sine and cosine.
    #[test]
    fn a_longer_series_reaches_farther() {
        let mut a = Matrix::<2, 2>::zero();
        a.set(0, 1, 1.0);
        a.set(1, 0, -1.0);
        for (reach, order) in SERIES {
            assert_eq!(series_order(reach), order);
            let mut series = Series::room();
            a.series(&[0.0, 1.0], reach, order, &mut series);
            for s in [0.25, 0.7, 1.0] {
                let (sine, cosine) = (series.change(s)[0], 1.0 + series.change(s)[1]);
                assert!((sine - (s * reach).sin()).abs() < 3e-16, "{reach} {s}: {sine}");
                assert!((cosine - (s * reach).cos()).abs() < 3e-16, "{reach} {s}: {cosine}");
            }
        }
    }

    /// Wider vectors do the same operations in the same order: the same bits on every processor.
    #[cfg(target_arch = "x86_64")]
    #[test]
    fn wider_vectors_give_the_same_bits() {
        if !std::arch::is_x86_feature_detected!("avx2") {
            return;
        }
        let mut number = 0.37_f64;
        let mut next = || {
            number = (997.0 * number).fract();
            number - 0.5
        };
        let mut a = Matrix::<12, 12>::zero();
        (0..12).for_each(|row| (0..12).for_each(|column| a.set(row, column, 0.1 * next())));
        let z: [f64; 12] = std::array::from_fn(|_| next());
        let bits = |list: &[f64]| list.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let (mut wide, mut narrow) = (Series::room(), Series::room());
        a.series(&z, 1.9, 23, &mut wide);
        narrow.order = 23;
        a.series_by_any(&z, 1.9, &mut narrow);
        assert_eq!(bits(wide.terms.as_flattened()), bits(narrow.terms.as_flattened()));
        assert_eq!(bits(&wide.change(0.77)), bits(&wide.change_by_any(0.77)));
        let (p, q) = (a.exponential(0.2).doubled(), a.exponential_by_any(0.2).doubled_by_any());
        assert_eq!(bits(p.column.as_flattened()), bits(q.column.as_flattened()));
        let [mut one, mut other] = [(z, [0.0; 12], [[0.0; 12]; 7]); 2];
        p.advance_rows(&mut one.0, &mut one.1, &mut one.2);
        p.advance_rows_by_any(&mut other.0, &mut other.1, &mut other.2);
        assert_eq!(bits(one.2.as_flattened()), bits(other.2.as_flattened()));
        assert_eq!((bits(&one.0), bits(&one.1)), (bits(&other.0), bits(&other.1)));
    }

    #[test]
    fn rotation_by_doubling() {
        // ż₀ = ω z₁, ż₁ = −ω z₀ rotates by ω t; a constant drives z₂ = t.
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

//! Kalman filter for all columns of a series: innovations of each with slow first-order noises removed.
//!
//! ```text
//! x ← e^{−Δ/τ} x + fresh noise of variance σ² (1 − e^{−2Δ/τ})
//! y = g Σ x + ε      F = g² Σ P + 1      K = g P h/F      v = y − g Σ x
//! ```

use super::Slow;
use super::series::Series;
use crate::fit::limits::{BESIDE, SLOW_NOISES};
use taut_core::widest;

/// For each of these kinds of noise, at most [`BESIDE`] of equally many states: products Σ v vᵀ/F of the innovations of
/// all columns, upper half, and Σ ln F.
pub(super) fn filter(series: &Series, kinds: &[&[Slow]]) -> Vec<(Vec<f64>, f64)> {
    match kinds {
        [one] => filtered(series, &[*one]).into(),
        [one, other] => filtered(series, &[*one, *other]).into(),
        _ => {
            let all: [&[Slow]; BESIDE] = std::array::from_fn(|l| kinds[l.min(kinds.len() - 1)]);
            filtered(series, &all).into_iter().take(kinds.len()).collect()
        }
    }
}

/// A number for each of L kinds of noise, and what is done with it, all at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Numbers<const L: usize>(pub [f64; L]);

impl<const L: usize> Numbers<L> {
    const ZERO: Self = Self([0.0; L]);
    const ONE: Self = Self([1.0; L]);
}

macro_rules! each_at_once {
    ($name:ident, $method:ident, $operator:tt) => {
        impl<const L: usize> std::ops::$name for Numbers<L> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut all = [0.0; L];
                for l in 0..L {
                    all[l] = self.0[l] $operator other.0[l];
                }
                Self(all)
            }
        }

        impl<const L: usize> std::ops::$name<Numbers<L>> for f64 {
            type Output = Numbers<L>;
            #[inline(always)]
            fn $method(self, other: Numbers<L>) -> Numbers<L> {
                Numbers([self; L]).$method(other)
            }
        }
    };
}

each_at_once!(Add, add, +);
each_at_once!(Sub, sub, -);
each_at_once!(Mul, mul, *);
each_at_once!(Div, div, /);

widest! {
    fn filtered[const L: usize](series: &Series, kinds: &[&[Slow]; L]) -> [(Vec<f64>, f64); L]
        = filtered_by_any, filtered_by_avx2;
}

#[inline(always)]
fn filtered_by_any<const L: usize>(series: &Series, kinds: &[&[Slow]; L]) -> [(Vec<f64>, f64); L] {
    let mut sums = Sums::new(series.wide());
    innovations(series, &series.rows, series.wide(), kinds, &mut sums);
    std::array::from_fn(|l| {
        let products = sums.products.iter().map(|all| all.0[l]).collect();
        (products, sums.logs[l] + sums.product.0[l].ln())
    })
}

/// Takes the innovations v of all columns, and their variance F, of a block.
pub(super) trait Take<const L: usize> {
    fn take(&mut self, v: &[Numbers<L>], f: Numbers<L>);
}

impl<F: FnMut(&[Numbers<1>], f64)> Take<1> for F {
    fn take(&mut self, v: &[Numbers<1>], f: Numbers<1>) {
        self(v, f.0[0]);
    }
}

/// Σ v vᵀ/F and Σ ln F: no closure, since those are not compiled for the vectors of the function that they are in.
struct Sums<const L: usize> {
    products: Vec<Numbers<L>>,
    logs: [f64; L],
    /// Π F of the last blocks.
    product: Numbers<L>,
    wide: usize,
}

impl<const L: usize> Sums<L> {
    fn new(wide: usize) -> Self {
        Self { products: vec![Numbers::ZERO; wide * wide], logs: [0.0; L], product: Numbers::ONE, wide }
    }
}

impl<const L: usize> Take<L> for &mut Sums<L> {
    #[inline(always)]
    fn take(&mut self, v: &[Numbers<L>], f: Numbers<L>) {
        let share = 1.0 / f;
        self.product = self.product * f;
        if self.product.0.iter().any(|product| *product > 1e100) {
            let large = |(_, product): &(&mut f64, &mut f64)| **product > 1e100;
            for (logs, product) in self.logs.iter_mut().zip(&mut self.product.0).filter(large) {
                *logs += f64::ln(std::mem::replace(product, 1.0));
            }
        }
        for (i, products) in self.products.chunks_exact_mut(self.wide).enumerate() {
            let factor = v[i] * share;
            for (out, v) in products[i..].iter_mut().zip(&v[i..]) {
                *out = *out + factor * *v;
            }
        }
    }
}

/// Gives `each` the innovations v of the `wide` columns of `rows`, and their variance F, block by block, of each of
/// these kinds of noise, which have equally many states.
#[inline(always)]
pub(super) fn innovations<const L: usize>(
    series: &Series,
    rows: &[f64],
    wide: usize,
    kinds: &[&[Slow]; L],
    each: impl Take<L>,
) {
    match kinds[0] {
        [swing] if swing.frequency > 0.0 => innovations_of_swing(series, rows, wide, kinds, each),
        [] => innovations_of::<0, L>(series, rows, wide, kinds, each),
        [_] => innovations_of::<1, L>(series, rows, wide, kinds, each),
        _ => innovations_of::<SLOW_NOISES, L>(series, rows, wide, kinds, each),
    }
}

/// [`innovations`] of narrow-band noise: an oscillator with x and w = ẋ/ω₀ driven by white noise, of which x is
/// observed.
///
/// ```text
/// γ = 1/τ      ω₀² = ω² + γ²
/// A = e^{−γΔ} [cos ωΔ + γ/ω sin ωΔ, ω₀/ω sin ωΔ; −ω₀/ω sin ωΔ, cos ωΔ − γ/ω sin ωΔ]
/// P ← A P Aᵀ + σ² (I − A Aᵀ)
/// ```
#[inline(always)]
fn innovations_of_swing<const L: usize>(
    series: &Series,
    rows: &[f64],
    wide: usize,
    kinds: &[&[Slow]; L],
    mut each: impl Take<L>,
) {
    let variance = Numbers(kinds.map(|kind| kind[0].variance));
    // P as p₀₀, p₀₁, p₁₁
    let mut p = [variance, Numbers::ZERO, variance];
    let mut x = vec![[Numbers::ZERO; 2]; wide];
    let mut v = vec![Numbers::ZERO; wide];
    let (mut last, mut step, mut turn) = (None, f64::NAN, [Numbers::ZERO; 4]);
    for ((row, &g), &time) in rows.chunks_exact(wide).zip(&series.gain).zip(&series.time) {
        if let Some(last) = last {
            let past: f64 = time - last;
            if (past - step).abs() > 1e-9 * step || step.is_nan() {
                step = past;
                for (l, kind) in kinds.iter().enumerate() {
                    let (omega, gamma) = (kind[0].frequency, 1.0 / kind[0].time);
                    let natural = omega.hypot(gamma);
                    let decay = (-gamma * past).exp();
                    let (sin, cos) = (omega * past).sin_cos();
                    let (damped, stiff) = (gamma / omega * sin, natural / omega * sin);
                    let own = [cos + damped, stiff, -stiff, cos - damped];
                    turn.iter_mut().zip(own).for_each(|(turn, one)| turn.0[l] = decay * one);
                }
            }
            let [a, b, c, d] = turn;
            // P − σ² I, which A rotates, and σ² I, which is constant.
            let q = [p[0] - variance, p[1], p[2] - variance];
            p = [
                a * a * q[0] + 2.0 * a * b * q[1] + b * b * q[2] + variance,
                a * c * q[0] + (a * d + b * c) * q[1] + b * d * q[2],
                c * c * q[0] + 2.0 * c * d * q[1] + d * d * q[2] + variance,
            ];
            for x in &mut x {
                *x = [a * x[0] + b * x[1], c * x[0] + d * x[1]];
            }
        }
        last = Some(time);
        let ph = [g * p[0], g * p[1]];
        let f = 1.0 + g * ph[0];
        let k = [ph[0] / f, ph[1] / f];
        for ((v, x), &y) in v.iter_mut().zip(&mut x).zip(row) {
            *v = y - g * x[0];
            *x = [x[0] + k[0] * *v, x[1] + k[1] * *v];
        }
        p = [p[0] - k[0] * ph[0], p[1] - k[0] * ph[1], p[2] - k[1] * ph[1]];
        each.take(&v, f);
    }
}

/// [`innovations`] with S states.
#[inline(always)]
fn innovations_of<const S: usize, const L: usize>(
    series: &Series,
    rows: &[f64],
    wide: usize,
    kinds: &[&[Slow]; L],
    mut each: impl Take<L>,
) {
    let sum = |all: &[Numbers<L>; S]| all.iter().fold(Numbers::ZERO, |sum, own| sum + *own);
    let mut variance = [Numbers::ZERO; S];
    for (i, variance) in variance.iter_mut().enumerate() {
        variance.0 = kinds.map(|kind| kind[i].variance);
    }
    let mut p = [[Numbers::ZERO; S]; S];
    for i in 0..S {
        p[i][i] = variance[i];
    }
    let mut x = vec![[Numbers::ZERO; S]; wide];
    let mut v = vec![Numbers::ZERO; wide];
    let (mut last, mut step) = (None, f64::NAN);
    let mut decay = [Numbers::ZERO; S];
    for ((row, &g), &time) in rows.chunks_exact(wide).zip(&series.gain).zip(&series.time) {
        if let (Some(last), true) = (last, S > 0) {
            let past: f64 = time - last;
            if (past - step).abs() > 1e-9 * step || step.is_nan() {
                step = past;
                for (i, decay) in decay.iter_mut().enumerate() {
                    decay.0 = kinds.map(|kind| (-step / kind[i].time).exp());
                }
            }
            for i in 0..S {
                for j in 0..S {
                    p[i][j] = p[i][j] * (decay[i] * decay[j]);
                }
                p[i][i] = p[i][i] + variance[i] * (1.0 - decay[i] * decay[i]);
            }
            for x in &mut x {
                for i in 0..S {
                    x[i] = x[i] * decay[i];
                }
            }
        }
        last = Some(time);
        let mut ph = [Numbers::ZERO; S];
        for i in 0..S {
            ph[i] = g * sum(&p[i]);
        }
        let f = 1.0 + g * sum(&ph);
        let mut k = ph;
        for k in &mut k {
            *k = *k / f;
        }
        for ((v, x), &y) in v.iter_mut().zip(&mut x).zip(row) {
            *v = y - g * sum(x);
            for i in 0..S {
                x[i] = x[i] + k[i] * *v;
            }
        }
        for i in 0..S {
            for j in 0..S {
                p[i][j] = p[i][j] - k[i] * ph[j];
            }
        }
        each.take(&v, f);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Rows at uneven times: a column that is not of the Jacobian, and the residual.
    fn uneven() -> Series {
        let time: Vec<f64> = (0..25).map(|k| 0.01 * f64::from(k) + 0.004 * f64::from(k % 3)).collect();
        let rows = (0..25).flat_map(|k| [f64::from(k).sin(), (0.7 * f64::from(k)).cos()]).collect();
        Series {
            moved: Vec::new(),
            own: 0,
            more: 1,
            rows,
            gain: (0..25).map(|k| 1.0 + 0.1 * f64::from(k % 4)).collect(),
            value: time.clone(),
            speed: time.clone(),
            time,
        }
    }

    /// The filter computes yᵀ (I + G R G)⁻¹ y and ln det (I + G R G) with the noise's autocovariance R.
    #[test]
    fn a_filter_agrees_with_the_covariance_of_its_noise() {
        let slow = |variance, time, frequency| Slow { variance, time, frequency };
        let series = uneven();
        for noises in [
            vec![],
            vec![slow(2.0, 0.05, 0.0)],
            vec![slow(2.0, 0.02, 0.0), slow(5.0, 0.3, 0.0)],
            vec![slow(3.0, 0.1, 60.0)],
        ] {
            let covariance = |past: f64| -> f64 {
                let of = |slow: &Slow| {
                    let (turn, gamma) = (slow.frequency * past, 1.0 / slow.time);
                    let swing =
                        if slow.frequency > 0.0 { turn.cos() + gamma / slow.frequency * turn.sin() } else { 1.0 };
                    slow.variance * (-gamma * past).exp() * swing
                };
                noises.iter().map(of).sum()
            };
            let n = series.time.len();
            let whole = DMatrix::from_fn(n, n, |i, j| {
                let past = (series.time[i] - series.time[j]).abs();
                series.gain[i] * series.gain[j] * covariance(past) + if i == j { 1.0 } else { 0.0 }
            });
            let column = |c: usize| DVector::from_fn(n, |k, _| series.rows[2 * k + c]);
            let factor = whole.cholesky().unwrap();
            // Beside others, and alone.
            let others: Vec<Vec<Slow>> = (1..5)
                .map(|k| noises.iter().map(|own| Slow { time: own.time * f64::from(k), ..*own }).collect())
                .collect();
            let kinds: Vec<&[Slow]> = others.iter().map(Vec::as_slice).collect();
            let (products, logs) = filter(&series, &kinds).remove(0);
            assert_eq!(filter(&series, &[&noises]), [(products.clone(), logs)]);
            for (i, j) in [(0, 0), (0, 1), (1, 1)] {
                let expected = column(i).dot(&factor.solve(&column(j)));
                let found = products[2 * i + j];
                assert!((found - expected).abs() < 1e-9, "{noises:?}: {found} for {expected}");
            }
            assert!((logs - factor.determinant().ln()).abs() < 1e-9, "{noises:?}");
        }
    }

    #[test]
    fn columns_that_were_appended_are_taken_back() {
        let mut series = uneven();
        let (rows, columns) = (series.rows.clone(), [vec![1.0; 25], vec![2.0; 25]]);
        series.append(&columns);
        assert_eq!((series.more, series.wide()), (3, 4));
        assert_eq!(series.rows[..4], [rows[0], 1.0, 2.0, rows[1]]);
        series.take_back();
        let residuals: Vec<f64> = rows.chunks(2).map(|row| row[1]).collect();
        assert_eq!((series.more, &series.rows), (0, &residuals));
    }
}

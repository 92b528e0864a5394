//! Kalman filter for all columns of a series: innovations of each with slow first-order noises removed.
//!
//! ```text
//! x ← e^{−Δ/τ} x + fresh noise of variance σ² (1 − e^{−2Δ/τ})
//! y = g Σ x + ε      F = g² Σ P + 1      K = g P h/F      v = y − g Σ x
//! ```

use super::Slow;
use super::series::Series;
use crate::fit::limits::SLOW_NOISES;

/// Products Σ v vᵀ/F of the innovations of all columns, upper half, and Σ ln F.
pub(super) fn filter(series: &Series, slow: &[Slow]) -> (Vec<f64>, f64) {
    let wide = series.wide();
    let mut products = vec![0.0; wide * wide];
    let (mut logs, mut product) = (0.0, 1.0);
    innovations(series, &series.rows, wide, slow, |v, f| {
        product *= f;
        if product > 1e100 {
            logs += f64::ln(product);
            product = 1.0;
        }
        let share = 1.0 / f;
        for (i, products) in products.chunks_mut(wide).enumerate() {
            let factor = v[i] * share;
            for (out, v) in products[i..].iter_mut().zip(&v[i..]) {
                *out += factor * v;
            }
        }
    });
    (products, logs + product.ln())
}

/// Calls `each` with the innovations v of the `wide` columns of `rows`, and their variance F, block by block.
pub(super) fn innovations(
    series: &Series,
    rows: &[f64],
    wide: usize,
    slow: &[Slow],
    each: impl FnMut(&mut [f64], f64),
) {
    if let [swing] = slow
        && swing.frequency > 0.0
    {
        return innovations_of_swing(series, rows, wide, swing, each);
    }
    match slow.len() {
        0 => innovations_of::<0>(series, rows, wide, slow, each),
        1 => innovations_of::<1>(series, rows, wide, slow, each),
        _ => innovations_of::<SLOW_NOISES>(series, rows, wide, slow, each),
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
fn innovations_of_swing(
    series: &Series,
    rows: &[f64],
    wide: usize,
    slow: &Slow,
    mut each: impl FnMut(&mut [f64], f64),
) {
    let (omega, gamma) = (slow.frequency, 1.0 / slow.time);
    let natural = omega.hypot(gamma);
    // P as p₀₀, p₀₁, p₁₁
    let mut p = [slow.variance, 0.0, slow.variance];
    let mut x = vec![[0.0; 2]; wide];
    let mut v = vec![0.0; wide];
    let (mut last, mut step, mut turn) = (None, f64::NAN, [0.0; 4]);
    for ((row, &g), &time) in rows.chunks(wide).zip(&series.gain).zip(&series.time) {
        if let Some(last) = last {
            let past: f64 = time - last;
            if (past - step).abs() > 1e-9 * step || step.is_nan() {
                step = past;
                let decay = (-gamma * past).exp();
                let (sin, cos) = (omega * past).sin_cos();
                let (damped, stiff) = (gamma / omega * sin, natural / omega * sin);
                turn = [cos + damped, stiff, -stiff, cos - damped].map(|one| decay * one);
            }
            let [a, b, c, d] = turn;
            // P − σ² I, which A rotates, and σ² I, which is constant.
            let q = [p[0] - slow.variance, p[1], p[2] - slow.variance];
            p = [
                a * a * q[0] + 2.0 * a * b * q[1] + b * b * q[2] + slow.variance,
                a * c * q[0] + (a * d + b * c) * q[1] + b * d * q[2],
                c * c * q[0] + 2.0 * c * d * q[1] + d * d * q[2] + slow.variance,
            ];
            x.iter_mut().for_each(|x| *x = [a * x[0] + b * x[1], c * x[0] + d * x[1]]);
        }
        last = Some(time);
        let ph = [g * p[0], g * p[1]];
        let f = 1.0 + g * ph[0];
        let k = ph.map(|ph| ph / f);
        for ((v, x), y) in v.iter_mut().zip(&mut x).zip(row) {
            *v = y - g * x[0];
            *x = [x[0] + k[0] * *v, x[1] + k[1] * *v];
        }
        p = [p[0] - k[0] * ph[0], p[1] - k[0] * ph[1], p[2] - k[1] * ph[1]];
        each(&mut v, f);
    }
}

/// [`innovations`] with S states.
fn innovations_of<const S: usize>(
    series: &Series,
    rows: &[f64],
    wide: usize,
    slow: &[Slow],
    mut each: impl FnMut(&mut [f64], f64),
) {
    let mut p = [[0.0; S]; S];
    for i in 0..S {
        p[i][i] = slow[i].variance;
    }
    let mut x = vec![[0.0; S]; wide];
    let mut v = vec![0.0; wide];
    let (mut last, mut step) = (None, f64::NAN);
    let mut decay = [0.0; S];
    for ((row, &g), &time) in rows.chunks(wide).zip(&series.gain).zip(&series.time) {
        if let (Some(last), true) = (last, S > 0) {
            let past: f64 = time - last;
            if (past - step).abs() > 1e-9 * step || step.is_nan() {
                step = past;
                decay = std::array::from_fn(|i| (-step / slow[i].time).exp());
            }
            for i in 0..S {
                for j in 0..S {
                    p[i][j] *= decay[i] * decay[j];
                }
                p[i][i] += slow[i].variance * (1.0 - decay[i] * decay[i]);
            }
            x.iter_mut().for_each(|x| x.iter_mut().zip(&decay).for_each(|(x, decay)| *x *= decay));
        }
        last = Some(time);
        let ph: [f64; S] = std::array::from_fn(|i| g * p[i].iter().sum::<f64>());
        let f = 1.0 + g * ph.iter().sum::<f64>();
        let k: [f64; S] = ph.map(|ph| ph / f);
        for ((v, x), y) in v.iter_mut().zip(&mut x).zip(row) {
            *v = y - g * x.iter().sum::<f64>();
            for i in 0..S {
                x[i] += k[i] * *v;
            }
        }
        for i in 0..S {
            for j in 0..S {
                p[i][j] -= k[i] * ph[j];
            }
        }
        each(&mut v, f);
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
            let (products, logs) = filter(&series, &noises);
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

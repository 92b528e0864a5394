//! A Kalman filter that takes all columns of a series along: what is left of each when slow noises of first order are
//! taken out.
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

/// [`innovations`] of a noise that swings: x turns by ω Δ as it decays, and its first component shows.
fn innovations_of_swing(
    series: &Series,
    rows: &[f64],
    wide: usize,
    slow: &Slow,
    mut each: impl FnMut(&mut [f64], f64),
) {
    // P as p₀₀, p₀₁, p₁₁
    let mut p = [slow.variance, 0.0, slow.variance];
    let mut x = vec![[0.0; 2]; wide];
    let mut v = vec![0.0; wide];
    let mut last = None;
    for ((row, &g), &time) in rows.chunks(wide).zip(&series.gain).zip(&series.time) {
        if let Some(last) = last {
            let past: f64 = time - last;
            let decay = (-past / slow.time).exp();
            let (sin, cos) = (slow.frequency * past).sin_cos();
            let (s, c) = (decay * sin, decay * cos);
            let fresh = slow.variance * (1.0 - decay * decay);
            let [a, b, d] = p;
            // P ← R P Rᵀ + σ² (1 − e^{−2Δ/τ}) I
            p = [
                c * c * a - 2.0 * c * s * b + s * s * d + fresh,
                c * s * (a - d) + (c * c - s * s) * b,
                s * s * a + 2.0 * c * s * b + c * c * d + fresh,
            ];
            x.iter_mut().for_each(|x| *x = [c * x[0] - s * x[1], s * x[0] + c * x[1]]);
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

//! Noise that is alike from sample to sample: how much, over which times, and what it makes of estimates.
//!
//! The residuals of an output are taken for white noise and one or two slow ones,
//!
//! ```text
//! r(t) = J(t) δ + w(t) (x₁(t) + x₂(t)) + s ε(t)
//! cov x(t), x(u) = σ² e^{−|t−u|/τ} cos ω(t−u)
//! ```
//!
//! with the derivatives J of the model, as a fit has moved its residuals along them: what is slow in noise looks like a
//! change of a parameter, and a fit takes it away. So the likelihood is that of what no change of the parameters can
//! make (restricted likelihood, H. D. Patterson and R. Thompson 1971), by a Kalman filter that takes all columns of J
//! along with the residuals.
//!
//! How slow noise is cannot be told well by a short record, so no single answer is taken: over a grid of σ and τ each
//! counts by its likelihood, and an interval holds 95 % of what all of them say together.

use super::problem::Problem;
use super::uncertainty::student_share;
use nalgebra::{DMatrix, DVector};

/// Most blocks of rows into which the values of one quantity are taken together.
const BLOCKS: usize = 700;

/// Ratio of neighbouring time constants of the grid, and of neighbouring powers.
const TIMES: f64 = 2.2;
const POWERS: f64 = 3.0;

/// Least power at low frequencies, as a multiple of that of white noise, and how many are tried.
const LEAST_POWER: f64 = 0.1;
const MOST_POWERS: usize = 14;

/// The share of white noise before anything is seen.
const WHITE: f64 = 0.3;

/// By so much a second slow noise, or one that swings, has to raise the logarithm of the likelihood before it counts.
const SECOND: f64 = 3.0;

/// Most states of the filter.
const STATES: usize = 3;

/// A slow noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slow {
    /// Variance, of the weighted residuals' unit, over that of the white noise.
    pub variance: f64,
    /// Time constant, s.
    pub time: f64,
    /// Angular frequency at which it swings, rad/s; 0 where it does not.
    pub frequency: f64,
}

/// Rows taken together, of one output of one run.
struct Series {
    /// Columns that are not zero here: those of the run alone first.
    moved: Vec<usize>,
    /// How many of them are the run's alone.
    own: usize,
    /// Block by block the moved columns, and the residual behind them.
    rows: Vec<f64>,
    /// The answer of each to a slow noise of one.
    gain: Vec<f64>,
    /// Times, s.
    time: Vec<f64>,
}

/// Noise of a quantity as one of the grid has it.
struct Told {
    /// Logarithm of the likelihood and of what it counted for before.
    weight: f64,
    /// s², the variance of the white noise.
    white: f64,
    slow: Vec<Slow>,
    /// Freedom of s².
    freedom: f64,
}

/// The spread of the parameters from noise of one quantity.
pub(super) struct Spread {
    /// Covariances of the globals with their weights.
    parts: Vec<(f64, DMatrix<f64>)>,
    freedom: f64,
    /// Mean covariance.
    pub covariance: DMatrix<f64>,
    /// The most likely slow noises.
    pub slow: Vec<Slow>,
}

impl Spread {
    /// Half of the 95 % interval of Σ c_j δ_j: what all kinds of noise leave with 5 % together.
    pub fn half_width(&self, combination: &DVector<f64>) -> f64 {
        let variance = |own: &DMatrix<f64>| (own * combination).dot(combination).max(0.0);
        let variances: Vec<(f64, f64)> = self.parts.iter().map(|(weight, own)| (*weight, variance(own))).collect();
        let most = variances.iter().map(|(_, v)| *v).fold(0.0, f64::max).sqrt();
        if most <= 0.0 || !most.is_finite() {
            return most;
        }
        let beyond = |c: f64| -> f64 {
            let outside = |v: f64| if v > 0.0 { student_share(c / v.sqrt(), self.freedom) } else { 0.0 };
            variances.iter().map(|(weight, v)| weight * outside(*v)).sum()
        };
        let (mut low, mut high) = (0.0, 20.0 * most);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if beyond(middle) > 0.05 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }
}

/// Half of the 95 % interval of a combination for the noise of all quantities.
pub(super) fn half_width(spreads: &[Spread], combination: &DVector<f64>) -> f64 {
    spreads.iter().map(|spread| spread.half_width(combination).powi(2)).sum::<f64>().sqrt()
}

/// The spread that the noise of each quantity makes of the first columns of a Jacobian, which concern all runs; the
/// others concern one.
pub(super) fn spreads(
    problem: &Problem,
    residuals: &[f64],
    jacobian: &DMatrix<f64>,
    globals: usize,
    inverse: &DMatrix<f64>,
) -> Vec<Spread> {
    let quantities = problem.quantities();
    let one = |quantity| {
        let series = series(problem, quantity, residuals, jacobian, globals);
        Estimate { series, globals }.spread(inverse)
    };
    quantities.into_iter().filter_map(one).collect()
}

/// The rows of a quantity, taken together: as many as share an error of rounding, and so many that no more than
/// [`BLOCKS`] remain.
fn series(
    problem: &Problem,
    quantity: crate::log::Quantity,
    residuals: &[f64],
    jacobian: &DMatrix<f64>,
    globals: usize,
) -> Vec<Series> {
    let mut all = Vec::new();
    let outputs = || {
        problem.runs.iter().enumerate().flat_map(|(index, run)| {
            let own = run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity == quantity);
            own.map(move |(output, seen)| (index, output, seen))
        })
    };
    let most = outputs().flat_map(|(_, _, seen)| &seen.weights).copied().fold(0.0, f64::max);
    let total: f64 = outputs().map(|(index, output, _)| problem.runs[index].independent(output)).sum();
    let enough = (total / BLOCKS as f64).max(1.0) - 1e-6;
    for (index, output, seen) in outputs() {
        let run = &problem.runs[index];
        let n = run.time.len();
        let first = problem.first_row(index) + output * n;
        let rows: Vec<usize> = (0..n).filter(|&k| seen.weights[k] > 0.0).collect();
        let is_moved = |c: &usize| rows.iter().any(|&k| jacobian[(first + k, *c)] != 0.0);
        let mut moved: Vec<usize> = (globals..jacobian.ncols()).filter(is_moved).collect();
        let own = moved.len();
        moved.extend((0..globals).filter(is_moved));
        let mut series = Series { own, rows: Vec::new(), gain: Vec::new(), time: Vec::new(), moved };
        let wide = series.moved.len() + 1;
        let mut block = vec![0.0; wide];
        let (mut information, mut time, mut count) = (0.0, 0.0, 0.0);
        for (place, &k) in rows.iter().enumerate() {
            let w = seen.weights[k] / most;
            for (sum, &c) in block.iter_mut().zip(&series.moved) {
                *sum += w * jacobian[(first + k, c)];
            }
            block[wide - 1] += w * residuals[first + k];
            information += w * w;
            time += run.time[k];
            count += 1.0;
            if information >= enough || place + 1 == rows.len() {
                let scale = 1.0 / f64::sqrt(information);
                series.rows.extend(block.iter().map(|v| v * scale));
                series.gain.push(f64::sqrt(information));
                series.time.push(time / count);
                block.fill(0.0);
                (information, time, count) = (0.0, 0.0, 0.0);
            }
        }
        all.push(series);
    }
    all
}

/// The noise of one quantity.
struct Estimate {
    series: Vec<Series>,
    globals: usize,
}

impl Estimate {
    fn spread(&self, inverse: &DMatrix<f64>) -> Option<Spread> {
        let blocks: usize = self.series.iter().map(|series| series.time.len()).sum();
        if blocks < 4 {
            return None;
        }
        let told = self.told();
        let best = told.iter().map(|one| one.weight).fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            return None;
        }
        let mut told: Vec<Told> = told.into_iter().filter(|one| one.weight > best - 12.0).collect();
        told.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let influence = self.influence(inverse);
        let total: f64 = told.iter().map(|one| (one.weight - best).exp()).sum();
        let white = inverse.view((0, 0), (self.globals, self.globals)).into_owned();
        let mut known: Vec<(f64, f64, DMatrix<f64>)> = Vec::new();
        let mut covariance = DMatrix::zeros(self.globals, self.globals);
        let mut parts = Vec::new();
        for one in &told {
            let mut own = &white * 1.0;
            for slow in &one.slow {
                let place =
                    known.iter().position(|(time, frequency, _)| (*time, *frequency) == (slow.time, slow.frequency));
                let place = place.unwrap_or_else(|| {
                    known.push((slow.time, slow.frequency, self.slow_part(&influence, slow)));
                    known.len() - 1
                });
                own += &known[place].2 * slow.variance;
            }
            own *= one.white;
            let weight = (one.weight - best).exp() / total;
            covariance += &own * weight;
            if weight > 1e-5 {
                parts.push((weight, own));
            }
        }
        let first = &told[0];
        Some(Spread { parts, freedom: first.freedom, covariance, slow: first.slow.clone() })
    }

    /// All kinds of noise that are tried, with their likelihoods.
    fn told(&self) -> Vec<Told> {
        let longest = self.series.iter().map(|s| s.time.last().unwrap_or(&0.0) - s.time[0]).fold(0.0, f64::max);
        let blocks: usize = self.series.iter().map(|series| series.time.len()).sum();
        let sum: f64 = self.series.iter().map(|s| s.time.last().unwrap_or(&0.0) - s.time[0]).sum();
        let interval = (sum / blocks.max(2) as f64).max(1e-12);
        // Of one block the gain is √m.
        let gain = self.series.iter().flat_map(|s| &s.gain).map(|g| g * g).sum::<f64>() / blocks as f64;
        let mut times = Vec::new();
        let mut time = interval;
        while time < 1.5 * longest {
            times.push(time);
            time *= TIMES;
        }
        // Power at low frequencies over that of white noise: 2 τ σ² g²/Δ
        let powers: Vec<f64> = (0..MOST_POWERS).map(|k| LEAST_POWER * POWERS.powi(k as i32)).collect();
        let variance = |power: f64, time: f64| power * interval / (2.0 * time * gain);
        let share = ((1.0 - WHITE) / (times.len() * powers.len()).max(1) as f64).ln();
        let mut told = Vec::new();
        told.extend(self.likelihood(&[], WHITE.ln()));
        for &time in &times {
            let mut falling = 0;
            let mut before = f64::NEG_INFINITY;
            for &power in &powers {
                let slow = Slow { variance: variance(power, time), time, frequency: 0.0 };
                let Some(one) = self.likelihood(&[slow], share) else { continue };
                falling = if one.weight < before { falling + 1 } else { 0 };
                before = one.weight;
                told.push(one);
                // The likelihood has one peak along the power.
                if falling >= 4 {
                    break;
                }
            }
        }
        let best = |told: &[Told]| {
            told.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).map(|one| (one.weight, one.slow.clone()))
        };
        let Some((top, first)) = best(&told) else { return told };
        // Beside the best of them a second one.
        let mut more = Vec::new();
        if let [first] = first[..] {
            for &time in times.iter().step_by(2).filter(|time| (*time / first.time).ln().abs() > 1.0) {
                for &power in powers.iter().step_by(2) {
                    let slow = Slow { variance: variance(power, time), time, frequency: 0.0 };
                    more.extend(self.likelihood(&[first, slow], share - 1.0));
                }
            }
        }
        if best(&more).is_some_and(|(weight, _)| weight > top + SECOND) {
            told.extend(more);
        }
        told
    }

    /// The restricted likelihood of the residuals with these slow noises.
    fn likelihood(&self, slow: &[Slow], before: f64) -> Option<Told> {
        let g = self.globals;
        let mut sum = DMatrix::<f64>::zeros(g + 1, g + 1);
        let mut determinant = 0.0;
        let mut count = 0;
        let mut own_count = 0;
        for series in &self.series {
            let (products, logs) = filter(series, slow);
            determinant += logs;
            count += series.time.len();
            // Without what the run's own columns can do.
            let wide = series.moved.len() + 1;
            let mut m = products;
            for k in 0..series.own {
                let pivot = m[k * wide + k];
                if pivot <= 1e-300 {
                    continue;
                }
                own_count += 1;
                determinant += pivot.ln();
                for i in k + 1..wide {
                    let factor = m[k * wide + i] / pivot;
                    for j in i..wide {
                        m[i * wide + j] -= factor * m[k * wide + j];
                    }
                }
            }
            let place = |c: usize| if c + 1 == wide { g } else { series.moved[c] };
            for i in series.own..wide {
                for j in i..wide {
                    let (a, b) = (place(i), place(j));
                    sum[(a, b)] += m[i * wide + j];
                    if a != b {
                        sum[(b, a)] += m[i * wide + j];
                    }
                }
            }
        }
        let mut rank = 0;
        for k in 0..g {
            let pivot = sum[(k, k)];
            if pivot <= 1e-300 {
                continue;
            }
            rank += 1;
            determinant += pivot.ln();
            for i in k + 1..=g {
                let factor = sum[(k, i)] / pivot;
                for j in i..=g {
                    sum[(i, j)] -= factor * sum[(k, j)];
                }
            }
        }
        let freedom = count as f64 - (rank + own_count) as f64;
        let squares = sum[(g, g)];
        if freedom < 2.0 || squares <= 0.0 || !squares.is_finite() || !determinant.is_finite() {
            return None;
        }
        Some(Told {
            weight: before - 0.5 * determinant - 0.5 * freedom * squares.ln(),
            white: squares / freedom,
            slow: slow.to_vec(),
            freedom,
        })
    }

    /// By how much each block moves each global, by series.
    fn influence(&self, inverse: &DMatrix<f64>) -> Vec<Vec<f64>> {
        let g = self.globals;
        let of = |series: &Series| {
            let wide = series.moved.len() + 1;
            let mut all = vec![0.0; series.time.len() * g];
            for (row, out) in series.rows.chunks(wide).zip(all.chunks_mut(g.max(1))) {
                for (value, &c) in row.iter().zip(&series.moved) {
                    for (j, out) in out.iter_mut().enumerate() {
                        *out += value * inverse[(c, j)];
                    }
                }
            }
            all
        };
        self.series.iter().map(of).collect()
    }

    /// Σ_tu W(t) g(t) ρ(t−u) g(u) W(u)ᵀ for a slow noise of one: what it makes of the globals.
    fn slow_part(&self, influence: &[Vec<f64>], slow: &Slow) -> DMatrix<f64> {
        let g = self.globals;
        let mut sum = DMatrix::zeros(g, g);
        for (series, rows) in self.series.iter().zip(influence) {
            let (mut real, mut imaginary) = (vec![0.0; g], vec![0.0; g]);
            let mut last = None;
            for ((row, &gain), &time) in rows.chunks(g.max(1)).zip(&series.gain).zip(&series.time) {
                let past = time - last.unwrap_or(time);
                last = Some(time);
                let (decay, angle) = ((-past / slow.time).exp(), slow.frequency * past);
                let (c, s) = (decay * angle.cos(), decay * angle.sin());
                for j in 0..g {
                    (real[j], imaginary[j]) = (c * real[j] - s * imaginary[j], s * real[j] + c * imaginary[j]);
                }
                for i in 0..g {
                    for j in 0..g {
                        sum[(i, j)] += gain * (row[i] * real[j] + row[j] * real[i]) + gain * gain * row[i] * row[j];
                    }
                }
                for j in 0..g {
                    real[j] += gain * row[j];
                }
            }
        }
        sum
    }
}

/// Products Σ v vᵀ/F of the innovations of all columns, upper half, and Σ ln F.
fn filter(series: &Series, slow: &[Slow]) -> (Vec<f64>, f64) {
    // States: one for each slow noise, two for one that swings.
    let states = |one: &Slow| if one.frequency == 0.0 { 1 } else { 2 };
    match slow.iter().map(states).sum() {
        0 => filter_of::<0>(series, slow),
        1 => filter_of::<1>(series, slow),
        2 => filter_of::<2>(series, slow),
        _ => filter_of::<STATES>(series, slow),
    }
}

/// How the S states of slow noises go on: x ← T x + fresh noise.
struct Turning<'s, const S: usize> {
    slow: &'s [Slow],
    /// The noise that a state is of.
    owner: [usize; S],
    /// 1 for the state of each noise that shows, 0 for the other of one that swings.
    shown: [f64; S],
    /// The time that it is for, s.
    step: f64,
    turn: [[f64; S]; S],
    fresh: [f64; S],
}

impl<'s, const S: usize> Turning<'s, S> {
    fn new(slow: &'s [Slow]) -> Self {
        let of =
            slow.iter().enumerate().flat_map(|(k, one)| std::iter::repeat_n(k, 1 + usize::from(one.frequency != 0.0)));
        let (mut owner, mut shown) = ([0; S], [1.0; S]);
        owner.iter_mut().zip(of).for_each(|(owner, of)| *owner = of);
        for i in 1..S {
            shown[i] = if owner[i] == owner[i - 1] { 0.0 } else { 1.0 };
        }
        Self { slow, owner, shown, step: f64::NAN, turn: [[0.0; S]; S], fresh: [0.0; S] }
    }

    /// Over so much time.
    fn over(&mut self, step: f64) {
        if (step - self.step).abs() <= 1e-9 * step {
            return;
        }
        self.step = step;
        self.turn = [[0.0; S]; S];
        for i in 0..S {
            let one = &self.slow[self.owner[i]];
            let decay = (-step / one.time).exp();
            let (sin, cos) = (one.frequency * step).sin_cos();
            self.fresh[i] = one.variance * (1.0 - decay * decay);
            self.turn[i][i] = decay * cos;
            if self.shown[i] == 0.0 {
                (self.turn[i - 1][i], self.turn[i][i - 1]) = (-decay * sin, decay * sin);
            }
        }
    }

    /// T x
    fn times(&self, x: &[f64; S]) -> [f64; S] {
        std::array::from_fn(|i| (0..S).map(|k| self.turn[i][k] * x[k]).sum())
    }

    /// T P Tᵀ + the fresh noise.
    fn spread(&self, p: &[[f64; S]; S]) -> [[f64; S]; S] {
        // P is symmetric: its rows are its columns.
        let half: [[f64; S]; S] = std::array::from_fn(|j| self.times(&p[j]));
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let sum: f64 = (0..S).map(|k| half[k][i] * self.turn[j][k]).sum();
                sum + if i == j { self.fresh[i] } else { 0.0 }
            })
        })
    }

    /// What shows of x.
    fn shown(&self, x: &[f64; S]) -> f64 {
        x.iter().zip(&self.shown).map(|(x, shown)| x * shown).sum()
    }
}

/// [`filter`] with S states.
fn filter_of<const S: usize>(series: &Series, slow: &[Slow]) -> (Vec<f64>, f64) {
    let wide = series.moved.len() + 1;
    let mut products = vec![0.0; wide * wide];
    let (mut logs, mut product) = (0.0, 1.0);
    let mut turning = Turning::<S>::new(slow);
    let mut p = [[0.0; S]; S];
    for i in 0..S {
        p[i][i] = slow[turning.owner[i]].variance;
    }
    let mut a = vec![[0.0; S]; wide];
    let mut v = vec![0.0; wide];
    let mut last = None;
    for ((row, &gain), &time) in series.rows.chunks(wide).zip(&series.gain).zip(&series.time) {
        if let (Some(last), true) = (last, S > 0) {
            turning.over(time - last);
            p = turning.spread(&p);
            a.iter_mut().for_each(|a| *a = turning.times(a));
        }
        last = Some(time);
        // F = g² Σ P + 1, K = g P h/F
        let ph: [f64; S] = std::array::from_fn(|i| gain * turning.shown(&p[i]));
        let f = 1.0 + gain * turning.shown(&ph);
        product *= f;
        if product > 1e100 {
            logs += f64::ln(product);
            product = 1.0;
        }
        let scale = 1.0 / f;
        let k: [f64; S] = ph.map(|ph| ph * scale);
        for ((v, a), value) in v.iter_mut().zip(&mut a).zip(row) {
            *v = value - gain * turning.shown(a);
            for i in 0..S {
                a[i] += k[i] * *v;
            }
        }
        for i in 0..S {
            for j in 0..S {
                p[i][j] -= k[i] * ph[j];
            }
        }
        for (i, products) in products.chunks_mut(wide).enumerate() {
            let factor = v[i] * scale;
            for (out, v) in products[i..].iter_mut().zip(&v[i..]) {
                *out += factor * v;
            }
        }
    }
    (products, logs + product.ln())
}

//! Correlated noise: its variance, its time constants, and its effect on estimates.
//!
//! The residuals of an output are modelled as white noise and one or two slow ones, of constant or varying size
//! ([`scale`]), and errors that repeat with position ([`place`]),
//!
//! ```text
//! r(t) = J(t) δ + d(t) (w(t) (x₁(t) + x₂(t)) + s ε(t)) + Σ a cos κ ŷ(t) + b sin κ ŷ(t)
//! cov x(t), x(u) = σ² e^{−|t−u|/τ}
//! cov x(t), x(u) = σ² e^{−|t−u|/τ} (cos ω|t−u| + sin ω|t−u|/(ωτ))         of one that swings
//! ```
//!
//! with the derivatives J of the model, along which a fit has moved its residuals: slow noise resembles a change of a
//! parameter, and the fit absorbs it. The likelihood is therefore that of the part of the residuals that no change of
//! the parameters can make (restricted likelihood, H. D. Patterson and R. Thompson 1971), by a Kalman filter that
//! processes all columns of J with the residuals.
//!
//! A short record does not determine time constants, so the result is an average: each point of a grid of σ and τ is
//! weighted by its likelihood, and an interval covers 95 % of the mixture.

mod filter;
mod place;
mod scale;
mod series;
pub(crate) mod student;

use crate::fit::asked::problem::Problem;
use crate::fit::limits::{
    BESIDE, LEAST_POWER, MOST_POWERS, NOISE_TURNS, NOTHING, POWER_RATIO, ROUNDED, SWING_AROUND, SWING_BEFOREHAND,
    SWING_DAMPING, SWING_FASTEST, SWING_FINE, SWING_LONGEST, SWING_MOST, SWING_POWERS, SWING_RATIO, SWING_ROUNDS,
    SWING_SHRINKS, SWING_STEPS, SWING_WAYS, SWINGS_IN_LOG, TIME_RATIO, TIMES_APART, TWO_BEFOREHAND, WAVE_CLEAR, WAVES,
    WHITE_BEFOREHAND, WHITE_LIKELY,
};
use crate::log::Quantity;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use series::Series;
use std::f64::consts::TAU;
use student::student_share;

/// A slow noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slow {
    /// Variance, of the weighted residuals' unit, over that of the white noise.
    pub variance: f64,
    /// Time constant, s.
    pub time: f64,
    /// Angular frequency ω, rad/s: zero for noise of first order.
    pub frequency: f64,
}

/// An error that repeats with position.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Wave {
    /// The quantity with the error.
    pub quantity: Quantity,
    /// Wavelength, in the quantity's unit.
    pub length: f64,
    /// Its amplitude, in the same unit.
    pub amplitude: f64,
}

/// Noise of a quantity at one point of the grid.
struct NoiseAtPoint {
    /// Logarithm of likelihood times prior weight.
    weight: f64,
    /// s², the variance of the white noise.
    white: f64,
    slow: Vec<Slow>,
    /// Degrees of freedom of s².
    freedom: f64,
}

/// Normal equations.
struct Normal {
    /// Columns of the globals, the waves and the residuals.
    sum: DMatrix<f64>,
    /// Logarithm of the determinants of the noise and of what was eliminated.
    determinant: f64,
    /// Blocks, and columns of one run.
    count: usize,
    own: usize,
}

/// The spread of the parameters from noise of one quantity.
#[derive(Debug, Clone)]
pub(super) struct Spread {
    /// Weights and covariances of the globals; with those for heteroscedastic noise, if any.
    parts: Vec<(f64, DMatrix<f64>, Option<DMatrix<f64>>)>,
    freedom: f64,
    /// Shift of the globals by errors that repeat with position.
    shift: DVector<f64>,
    /// Mean covariance, with the square of the shift.
    pub covariance: DMatrix<f64>,
    /// Probability that no noise is slow.
    pub white: f64,
    /// The most likely slow noises.
    pub slow: Vec<Slow>,
    /// Errors that repeat with position.
    pub waves: Vec<Wave>,
    /// Ratio of the largest to the smallest noise.
    pub unevenness: f64,
}

impl Spread {
    /// True if slow noise is more probable than white, or if the residuals repeat with position.
    pub fn is_coloured(&self) -> bool {
        self.white < WHITE_LIKELY || !self.waves.is_empty()
    }

    /// Half-width of the 95 % interval of Σ c_j δ_j: exceeded with 5 % over the mixture of all kinds of noise,
    /// including the shift.
    pub fn half_width(&self, combination: &DVector<f64>) -> f64 {
        let variance = |own: &DMatrix<f64>| (own * combination).dot(combination).max(0.0);
        let greater = |even, uneven: &Option<DMatrix<f64>>| uneven.as_ref().map_or(0.0, variance).max(variance(even));
        let parts = self.parts.iter();
        let variances: Vec<(f64, f64)> = parts.map(|(weight, even, uneven)| (*weight, greater(even, uneven))).collect();
        let shift = self.shift.dot(combination).abs();
        let most = variances.iter().map(|(_, v)| *v).fold(0.0, f64::max).sqrt() + shift;
        if most <= 0.0 || !most.is_finite() {
            return most;
        }
        // P(e > c) of noise of this variance.
        let above = |c: f64, variance: f64| {
            let both = if variance > 0.0 { student_share(c.abs() / variance.sqrt(), self.freedom) } else { 0.0 };
            if c >= 0.0 { 0.5 * both } else { 1.0 - 0.5 * both }
        };
        // P(|e + d| > c) − 5 %
        let beyond = |c: f64| -> f64 {
            let both = |v: f64| match shift {
                0.0 => 2.0 * above(c, v),
                _ => above(c - shift, v) + above(c + shift, v),
            };
            variances.iter().map(|(weight, v)| weight * both(*v)).sum::<f64>() - 0.05
        };
        zero(&beyond, 0.0, 20.0 * most)
    }
}

/// Zero of a function between two points with opposite signs, to twelve digits of the larger one (T. R. Chandrupatla
/// 1997: inverse quadratic interpolation if that is known to help, else bisection).
fn zero(of: &dyn Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    let (mut a, mut b) = ((low, of(low)), (high, of(high)));
    let mut part = 0.5;
    for _ in 0..100 {
        let x = a.0 + part * (b.0 - a.0);
        let there = (x, of(x));
        let last = if (there.1 > 0.0) == (a.1 > 0.0) { a } else { std::mem::replace(&mut b, a) };
        a = there;
        let best = if a.1.abs() < b.1.abs() { a } else { b };
        let nearest = 1e-12 * high.abs().max(low.abs()) / (b.0 - a.0).abs();
        if nearest > 0.5 || best.1 == 0.0 {
            return best.0;
        }
        let (xi, phi) = ((a.0 - b.0) / (last.0 - b.0), (a.1 - b.1) / (last.1 - b.1));
        let is_inverse = phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi;
        part = match is_inverse {
            true => {
                a.1 / (b.1 - a.1) * last.1 / (b.1 - last.1)
                    + (last.0 - a.0) / (b.0 - a.0) * a.1 / (last.1 - a.1) * b.1 / (last.1 - b.1)
            }
            false => 0.5,
        };
        part = part.clamp(nearest, 1.0 - nearest);
    }
    0.5 * (a.0 + b.0)
}

/// Half-width of the 95 % interval of a combination for the noise of all quantities.
pub(super) fn half_width(spreads: &[Spread], combination: &DVector<f64>) -> f64 {
    spreads.iter().map(|spread| spread.half_width(combination).powi(2)).sum::<f64>().sqrt()
}

/// Spread by the noise of each quantity of the variables of the first columns of a Jacobian, which concern all runs;
/// the others concern one.
pub(super) fn spreads(
    problem: &Problem,
    residuals: &[f64],
    jacobian: &DMatrix<f64>,
    globals: usize,
    inverse: &DMatrix<f64>,
) -> Vec<Spread> {
    let estimates: Vec<Estimate> = problem
        .quantities()
        .into_iter()
        .map(|quantity| {
            let (series, weight) = series::series(problem, quantity, residuals, jacobian, globals);
            let influence = influence(&series, globals, inverse);
            let seen = problem.runs.iter().flat_map(|run| &run.seen).filter(|seen| seen.quantity == quantity);
            let step = seen.map(|seen| seen.step).fold(0.0, f64::max);
            Estimate { quantity, weight, step, series, globals, influence }
        })
        .filter(|estimate| estimate.blocks() >= 4)
        .collect();
    // (JᵀJ)⁻¹ is the covariance for white noise, including priors and everything outside blocks.
    let mut rest = inverse.view((0, 0), (globals, globals)).into_owned();
    for estimate in &estimates {
        rest -= estimate.white_part(None);
    }
    rest /= estimates.len().max(1) as f64;
    estimates.into_par_iter().filter_map(|estimate| estimate.spread(&rest)).collect()
}

impl Normal {
    /// Adds a series, with these products and logarithms of its innovations.
    fn add(&mut self, series: &Series, globals: usize, (mut m, logs): (Vec<f64>, f64)) {
        self.determinant += logs;
        self.count += series.time.len();
        let wide = series.wide();
        for k in 0..series.own {
            let pivot = m[k * wide + k];
            if pivot <= 1e-300 {
                continue;
            }
            self.own += 1;
            self.determinant += pivot.ln();
            for i in k + 1..wide {
                let factor = m[k * wide + i] / pivot;
                for j in i..wide {
                    m[i * wide + j] -= factor * m[k * wide + j];
                }
            }
        }
        let place = |c: usize| series.moved.get(c).copied().unwrap_or_else(|| globals + c - series.moved.len());
        for i in series.own..wide {
            for j in i..wide {
                let (a, b) = (place(i), place(j));
                self.sum[(a, b)] += m[i * wide + j];
                if a != b {
                    self.sum[(b, a)] += m[i * wide + j];
                }
            }
        }
    }

    /// The restricted likelihood of the residuals with these slow noises.
    fn likelihood(self, slow: Vec<Slow>) -> Option<NoiseAtPoint> {
        let Normal { mut sum, mut determinant, count, own } = self;
        let n = sum.ncols() - 1;
        let mut rank = 0;
        for k in 0..n {
            let pivot = sum[(k, k)];
            if pivot <= 1e-300 {
                continue;
            }
            rank += 1;
            determinant += pivot.ln();
            for i in k + 1..=n {
                let factor = sum[(k, i)] / pivot;
                for j in i..=n {
                    sum[(i, j)] -= factor * sum[(k, j)];
                }
            }
        }
        let freedom = count as f64 - (rank + own) as f64;
        let squares = sum[(n, n)];
        if freedom < 2.0 || squares <= 0.0 || !squares.is_finite() || !determinant.is_finite() {
            return None;
        }
        Some(NoiseAtPoint {
            weight: -0.5 * determinant - 0.5 * freedom * squares.ln(),
            white: squares / freedom,
            slow,
            freedom,
        })
    }
}

/// The noise of one quantity.
struct Estimate {
    quantity: Quantity,
    /// The greatest weight of its values.
    weight: f64,
    /// The greatest step of its converters.
    step: f64,
    series: Vec<Series>,
    globals: usize,
    /// Influence of each block on each global, by series, with the weights of the fit.
    influence: Vec<Vec<f64>>,
}

impl Estimate {
    fn blocks(&self) -> usize {
        self.series.iter().map(|series| series.time.len()).sum()
    }

    /// The spread; `rest` is the covariance by white noise of everything outside blocks.
    fn spread(mut self, rest: &DMatrix<f64>) -> Option<Spread> {
        let mut told = self.told();
        let slow = best(&told)?.slow.clone();
        let scales = scale::scales(&self.series, &slow);
        let all = || scales.iter().flatten().flatten().copied();
        let unevenness =
            if scales.is_some() { all().fold(0.0, f64::max) / all().fold(f64::INFINITY, f64::min) } else { 1.0 };
        let lengths = if self.quantity.is_position() { self.waves_beside(&mut told)? } else { Vec::new() };
        let first = best(&told)?;
        let (top, freedom, slow) = (first.weight, first.freedom, first.slow.clone());
        let (waves, shift, unsure) = self.waves(first, &lengths);
        told.retain(|one| one.weight > top - 12.0);
        told.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        let total: f64 = told.iter().map(|one| (one.weight - top).exp()).sum();
        let white = told.iter().filter(|one| one.slow.is_empty()).map(|one| (one.weight - top).exp() / total).sum();
        let of = |scales: Option<&Vec<Vec<f64>>>| self.parts(&told, scales.map(Vec::as_slice), rest, &unsure);
        let (even, uneven) = (of(None), scales.as_ref().map(|scales| of(Some(scales))));
        let mut covariance = &shift * shift.transpose();
        let mut parts = Vec::new();
        let mut uneven = uneven.into_iter().flatten();
        for (one, own) in told.iter().zip(even) {
            let weight = (one.weight - top).exp() / total;
            covariance += &own * weight;
            parts.push((weight, own, uneven.next()));
        }
        parts.retain(|(weight, ..)| *weight > 1e-5);
        Some(Spread { parts, freedom, shift, covariance, white, slow, waves, unevenness })
    }

    /// Covariances of the globals by these kinds of noise, with these sizes along the series.
    fn parts(
        &self,
        told: &[NoiseAtPoint],
        scales: Option<&[Vec<f64>]>,
        rest: &DMatrix<f64>,
        unsure: &DMatrix<f64>,
    ) -> Vec<DMatrix<f64>> {
        let white = self.white_part(scales) + rest;
        let mut known: Vec<([f64; 2], DMatrix<f64>)> = Vec::new();
        let of = |one: &NoiseAtPoint| {
            let mut own = white.clone();
            for slow in &one.slow {
                let kind = [slow.time, slow.frequency];
                let place = known.iter().position(|(own, _)| *own == kind).unwrap_or_else(|| {
                    known.push((kind, self.slow_part(slow, scales)));
                    known.len() - 1
                });
                own += &known[place].1 * slow.variance;
            }
            own * one.white + unsure
        };
        told.iter().map(of).collect()
    }

    /// All tried kinds of noise, with their likelihoods.
    fn told(&self) -> Vec<NoiseAtPoint> {
        let long = |series: &Series| series.time.last().unwrap_or(&0.0) - series.time.first().unwrap_or(&0.0);
        let longest = self.series.iter().map(long).fold(0.0, f64::max);
        let blocks = self.blocks();
        let sum: f64 = self.series.iter().map(long).sum();
        let interval = (sum / blocks.max(2) as f64).max(1e-12);
        // The gain of one block is √m.
        let gain = self.series.iter().flat_map(|s| &s.gain).map(|g| g * g).sum::<f64>() / blocks as f64;
        let mut times = Vec::new();
        let mut time = interval;
        while time < 1.5 * longest {
            times.push(time);
            time *= TIME_RATIO;
        }
        // Power at low frequencies over that of white noise: 2 τ σ² g²/Δ
        let powers: Vec<f64> = (0..MOST_POWERS).map(|k| LEAST_POWER * POWER_RATIO.powi(k as i32)).collect();
        let variance = |power: f64, time: f64| power * interval / (2.0 * time * gain);
        // Each slow noise alone, or with another of a clearly different time constant.
        let along = |beside: Option<Slow>| {
            let mut told = Vec::new();
            let apart = |time: &&f64| beside.is_none_or(|other| (*time / other.time).ln().abs() > TIMES_APART);
            for &time in times.iter().filter(apart) {
                let mut falling = 0;
                let mut before = f64::NEG_INFINITY;
                let of = |power: &f64| {
                    let slow = Slow { variance: variance(*power, time), time, frequency: 0.0 };
                    std::iter::once(slow).chain(beside).collect()
                };
                let tried = powers.chunks(BESIDE).flat_map(|powers| self.likelihoods(powers.iter().map(of).collect()));
                for one in tried.flatten() {
                    falling = if one.weight < before { falling + 1 } else { 0 };
                    before = one.weight;
                    told.push(one);
                    // The likelihood has one peak along the power.
                    if falling >= 4 {
                        break;
                    }
                }
            }
            told
        };
        let counted = |mut told: Vec<NoiseAtPoint>, before: f64| {
            told.iter_mut().for_each(|one| one.weight += before.ln());
            told
        };
        let mut all = counted(self.likelihoods(vec![Vec::new()]).into_iter().flatten().collect(), WHITE_BEFOREHAND);
        let one = along(None);
        let first = best(&one).map(|one| one.slow[0]);
        all.extend(counted(one, (1.0 - WHITE_BEFOREHAND - TWO_BEFOREHAND) / (times.len() * powers.len()) as f64));
        let Some(mut first) = first else { return all };
        // Two: each beside the best of the other.
        let mut turns: Vec<Vec<NoiseAtPoint>> = Vec::new();
        for _ in 0..NOISE_TURNS {
            let two = along(Some(first));
            let Some(top) = best(&two) else { return all };
            first = top.slow[0];
            turns.push(two);
        }
        // The best of one kind represents all similar ones: Σ e^{L − L*} of them.
        all.extend(self.swinging([interval, longest], gain));
        let (Some(a), Some(b)) = (turns.pop(), turns.pop()) else { return all };
        let top = best(&a).map_or(0.0, |one| one.weight);
        let as_good = |told: &[NoiseAtPoint]| told.iter().map(|one| (one.weight - top).exp()).sum::<f64>();
        let apart = |(i, j): (usize, usize)| (times[j] / times[i]).ln() > TIMES_APART;
        let pairs = (0..times.len()).flat_map(|j| (0..j).map(move |i| (i, j))).filter(|&pair| apart(pair)).count();
        let each = 0.5 * TWO_BEFOREHAND / (pairs * powers.len() * powers.len()).max(1) as f64;
        let (for_a, for_b) = (each * as_good(&b), each * as_good(&a));
        all.extend(counted(a, for_a));
        all.extend(counted(b, for_b));
        all
    }

    /// Narrow-band noises: the most likely one and its neighbours, with their prior weights.
    ///
    /// Frequencies are tried one after the other with a usual damping; from the best, frequency, time constant and
    /// variance are improved alternately by steps that grow while they improve, and are halved where they do not: up to
    /// a pure tone. Its variance is that of its amplitude only where its own noise, σ² 2T/τ in a log of length T, is
    /// below the error with which the log determines it.
    fn swinging(&self, [interval, longest]: [f64; 2], gain: f64) -> Vec<NoiseAtPoint> {
        let of = |all: &[[f64; 3]]| {
            let kind = |at: &[f64; 3]| {
                let [frequency, time, variance] = at.map(f64::exp);
                vec![Slow { variance, time, frequency }]
            };
            self.likelihoods(all.iter().map(kind).collect())
        };
        // Mean square of the blocks, of which noise makes no more than a part by chance.
        let rows = self.series.iter().flat_map(|series| series.rows.chunks(series.wide()));
        let most_noise =
            SWING_MOST * rows.filter_map(|row| row.last()).map(|r| r * r).sum::<f64>() / self.blocks() as f64;
        let is_possible = |told: &&NoiseAtPoint| told.slow[0].variance * gain * told.white <= most_noise;
        let weight = |told: &Option<NoiseAtPoint>| {
            told.as_ref().filter(is_possible).map_or(f64::NEG_INFINITY, |told| told.weight)
        };
        let slowest = SWINGS_IN_LOG * TAU / longest;
        let (mut frequency, mut tried) = (slowest, Vec::new());
        while frequency * interval < SWING_FASTEST {
            let time = 1.0 / (SWING_DAMPING * frequency);
            tried.extend(SWING_POWERS.map(|power| [frequency, time, power / gain].map(f64::ln)));
            frequency *= SWING_RATIO;
        }
        let mut best: Option<([f64; 3], f64)> = None;
        for (at, told) in tried.iter().zip(of(&tried)) {
            let own = weight(&told);
            if best.is_none_or(|(_, most)| own > most) {
                best = Some((*at, own));
            }
        }
        let Some((mut at, mut most)) = best else { return Vec::new() };
        let longest_time = (SWING_LONGEST * longest).ln();
        let mut steps = SWING_STEPS;
        for _ in 0..SWING_ROUNDS {
            for ((step, first), way) in steps.iter_mut().zip(SWING_STEPS).zip(SWING_WAYS) {
                let near = [*step, -*step].map(|step| std::array::from_fn(|j| at[j] + step * way[j]));
                let is_swing = |next: &[f64; 3]| next[0] >= slowest.ln() && next[1] <= longest_time;
                let near: Vec<[f64; 3]> = near.into_iter().filter(is_swing).collect();
                let told = near.iter().zip(of(&near)).map(|(next, told)| (*next, weight(&told)));
                let better = told.into_iter().find(|(_, own)| *own > most);
                match better {
                    Some(next) => ((at, most), *step) = (next, first.min(*step / SWING_SHRINKS)),
                    None => *step *= SWING_SHRINKS,
                }
            }
            if steps.iter().zip(SWING_STEPS).all(|(step, first)| *step < SWING_FINE * first) {
                break;
            }
        }
        // A grid around it, each point with the prior weight of a first one.
        let shares = [-1.0, 0.0, 1.0];
        // The width of its peak is 1/τ, and at least that of a line in the log.
        let width = 1.0 / (at[0].exp() * at[1].exp().min(longest));
        let apart = [width.min(SWING_AROUND[0]), SWING_AROUND[1], SWING_AROUND[2]];
        let places = shares.into_iter().flat_map(|i| shares.map(|j| (i, j)));
        let around = places
            .flat_map(|(i, j)| shares.map(|k| [at[0] + i * apart[0], at[1] + j * apart[1], at[2] + k * apart[2]]));
        let mut all: Vec<NoiseAtPoint> = of(&around.collect::<Vec<_>>()).into_iter().flatten().collect();
        let before = (SWING_BEFOREHAND / tried.len().max(1) as f64 / all.len().max(1) as f64).ln();
        all.iter_mut().for_each(|one| one.weight += before);
        all
    }

    /// The restricted likelihoods of the residuals with each of these slow noises, all of equally many and of one kind.
    fn likelihoods(&self, kinds: Vec<Vec<Slow>>) -> Vec<Option<NoiseAtPoint>> {
        let all = kinds.chunks(BESIDE).flat_map(|kinds| {
            let slow: Vec<&[Slow]> = kinds.iter().map(Vec::as_slice).collect();
            self.normals(&slow)
        });
        let normals: Vec<Normal> = all.collect();
        normals.into_iter().zip(kinds).map(|(normal, slow)| normal.likelihood(slow)).collect()
    }

    /// Normal equations of the globals, the waves and the residuals under each of these slow noises, with the columns of
    /// single runs eliminated.
    fn normals(&self, kinds: &[&[Slow]]) -> Vec<Normal> {
        let g = self.globals;
        let n = g + self.series.first().map_or(0, |series| series.more);
        let none = || Normal { sum: DMatrix::zeros(n + 1, n + 1), determinant: 0.0, count: 0, own: 0 };
        let mut normals: Vec<Normal> = kinds.iter().map(|_| none()).collect();
        for series in &self.series {
            let filtered = filter::filter(series, kinds);
            normals.iter_mut().zip(filtered).for_each(|(normal, own)| normal.add(series, g, own));
        }
        normals
    }

    /// The amplitudes of the waves in the rows under this noise, and their covariance.
    fn amplitudes(&self, noise: &NoiseAtPoint) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let sum = self.normals(&[&noise.slow]).remove(0).sum;
        let n = sum.ncols() - 1;
        let inverse = sum.view((0, 0), (n, n)).into_owned().try_inverse()?;
        let (waves, more) = (self.globals, n - self.globals);
        let amplitudes = (&inverse * sum.view((0, n), (n, 1))).rows(waves, more).column(0).into_owned();
        Some((amplitudes, inverse.view((waves, waves), (more, more)) * noise.white))
    }

    /// Finds errors that repeat with position, and the noise beside them. At a steady speed such an error oscillates
    /// like noise: the likelier of both counts.
    fn waves_beside(&mut self, told: &mut Vec<NoiseAtPoint>) -> Option<Vec<f64>> {
        let top = best(told)?;
        let swings = |one: &NoiseAtPoint| one.slow.iter().any(|slow| slow.frequency > 0.0);
        let (is_swinging, before) = (swings(top), top.weight);
        let plain = told.iter().filter(|one| !swings(one)).max_by(|a, b| a.weight.total_cmp(&b.weight))?;
        let mut lengths = self.find_waves(plain);
        if lengths.is_empty() && !is_swinging {
            return Some(lengths);
        }
        let with = self.told();
        if !is_swinging || !lengths.is_empty() && best(&with).is_some_and(|with| with.weight > before) {
            *told = with;
            return Some(lengths);
        }
        self.series.iter_mut().for_each(Series::take_back);
        lengths = self.find_waves(best(told)?);
        if !lengths.is_empty() {
            *told = self.told();
        }
        Some(lengths)
    }

    /// Finds errors that repeat with position beside this noise, and adds them to the rows; returns their wavelengths.
    fn find_waves(&mut self, noise: &NoiseAtPoint) -> Vec<f64> {
        let mut lengths = Vec::new();
        let mut amplitudes = DVector::zeros(0);
        while lengths.len() < WAVES {
            let found = place::wave(&self.series, amplitudes.as_slice(), &noise.slow, noise.white);
            let Some(place::PeriodicError { kappa, gain, amplitude, travel, tried }) = found else { break };
            let least = (ROUNDED * self.step).max(NOTHING * travel);
            if gain < WAVE_CLEAR + (tried as f64).ln() || amplitude / self.weight < least {
                break;
            }
            let columns: Vec<_> = self.series.iter().map(|series| place::columns(series, kappa)).collect();
            self.series.iter_mut().zip(&columns).for_each(|(series, own)| series.append(own));
            lengths.push(TAU / kappa);
            let Some((with, _)) = self.amplitudes(noise) else { break };
            amplitudes = with;
        }
        lengths
    }

    /// The waves in the rows under this noise, the shift of the globals by them, and its covariance.
    fn waves(&self, noise: &NoiseAtPoint, lengths: &[f64]) -> (Vec<Wave>, DVector<f64>, DMatrix<f64>) {
        let g = self.globals;
        let nothing = (Vec::new(), DVector::zeros(g), DMatrix::zeros(g, g));
        if lengths.is_empty() {
            return nothing;
        }
        let Some((amplitudes, covariance)) = self.amplitudes(noise) else { return nothing };
        // Wᵀ c
        let mut moves = DMatrix::<f64>::zeros(g, amplitudes.len());
        for (series, influence) in self.series.iter().zip(&self.influence) {
            let (wide, more) = (series.wide(), series.more);
            for (k, row) in series.rows.chunks(wide).enumerate() {
                for (i, column) in row[wide - 1 - more..wide - 1].iter().enumerate() {
                    for j in 0..g {
                        moves[(j, i)] += influence[k * g + j] * column;
                    }
                }
            }
        }
        let pairs = lengths.iter().zip(amplitudes.as_slice().chunks(2));
        let wave = |(&length, own): (&f64, &[f64])| {
            let amplitude = f64::hypot(own[0], own[1]) / self.weight;
            Wave { quantity: self.quantity, length, amplitude }
        };
        let waves = pairs.map(wave).collect();
        (waves, &moves * &amplitudes, &moves * covariance * moves.transpose())
    }

    /// Σ W d² Wᵀ: covariance of the globals for white noise of variance one.
    fn white_part(&self, scales: Option<&[Vec<f64>]>) -> DMatrix<f64> {
        let g = self.globals;
        let mut sum = DMatrix::zeros(g, g);
        for (index, rows) in self.influence.iter().enumerate() {
            for (k, row) in rows.chunks(g.max(1)).enumerate() {
                let d = scales.map_or(1.0, |scales| scales[index][k]);
                for i in 0..g {
                    for j in 0..g {
                        sum[(i, j)] += d * d * row[i] * row[j];
                    }
                }
            }
        }
        sum
    }

    /// Σ_tu W(t) d(t) g(t) ρ(t − u) g(u) d(u) W(u)ᵀ for a slow noise of one with the covariance ρ.
    fn slow_part(&self, slow: &Slow, scales: Option<&[Vec<f64>]>) -> DMatrix<f64> {
        let g = self.globals;
        let mut sum = DMatrix::zeros(g, g);
        // 1/(ωτ)
        let phase = if slow.frequency > 0.0 { 1.0 / (slow.frequency * slow.time) } else { 0.0 };
        for (index, (series, rows)) in self.series.iter().zip(&self.influence).enumerate() {
            // Σ e^{(iω − 1/τ)(t − u)} g(u) d(u) W(u), its real part and its imaginary one.
            let (mut state, mut other) = (vec![0.0; g], vec![0.0; g]);
            let mut last = None;
            for (k, row) in rows.chunks(g.max(1)).enumerate() {
                let d = scales.map_or(1.0, |scales| scales[index][k]);
                let (gain, time) = (series.gain[k] * d, series.time[k]);
                let past = time - last.unwrap_or(time);
                let decay = (-past / slow.time).exp();
                last = Some(time);
                let (sin, cos) = (slow.frequency * past).sin_cos();
                for (x, y) in state.iter_mut().zip(&mut other) {
                    (*x, *y) = (decay * (cos * *x - sin * *y), decay * (sin * *x + cos * *y));
                }
                let shown = |j: usize| state[j] + phase * other[j];
                for i in 0..g {
                    for j in 0..g {
                        sum[(i, j)] += gain * (row[i] * shown(j) + row[j] * shown(i)) + gain * gain * row[i] * row[j];
                    }
                }
                for (x, w) in state.iter_mut().zip(row) {
                    *x += gain * w;
                }
            }
        }
        sum
    }
}

/// The most likely noise.
fn best(told: &[NoiseAtPoint]) -> Option<&NoiseAtPoint> {
    told.iter().max_by(|a, b| a.weight.total_cmp(&b.weight)).filter(|one| one.weight.is_finite())
}

/// W = J (JᵀJ)⁻¹: influence of each block on each global, by series.
fn influence(all: &[Series], globals: usize, inverse: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let of = |series: &Series| {
        let mut own = vec![0.0; series.time.len() * globals];
        for (row, out) in series.rows.chunks(series.wide()).zip(own.chunks_mut(globals.max(1))) {
            for (value, &c) in row.iter().zip(&series.moved) {
                for (j, out) in out.iter_mut().enumerate() {
                    *out += value * inverse[(c, j)];
                }
            }
        }
        own
    };
    all.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    #[test]
    fn a_zero_is_found_wherever_it_is() {
        for root in [1e-9, 0.3, 0.5, 1.7, 19.99] {
            let steep = |x: f64| (root / x.max(1e-300)).min(1e3) - 1.0;
            let flat = |x: f64| -(x - root).powi(3);
            let normal = |x: f64| libm::erfc(x) - libm::erfc(root);
            assert!((zero(&steep, 0.0, 20.0) - root).abs() < 1e-9, "{root}");
            assert!((zero(&flat, 0.0, 20.0) - root).abs() < 1e-3, "{root}");
            assert!(root > 5.0 || (zero(&normal, 0.0, 20.0) - root).abs() < 1e-9, "{root}");
        }
    }

    /// Bisection alone would take 40.
    #[test]
    fn a_zero_of_a_smooth_function_takes_few_evaluations() {
        for root in [0.3, 0.5, 1.7] {
            let count = std::cell::Cell::new(0);
            let normal = |x: f64| {
                count.set(count.get() + 1);
                libm::erfc(x) - libm::erfc(root)
            };
            assert!((zero(&normal, 0.0, 20.0) - root).abs() < 1e-9);
            assert!(count.get() < 20, "{root}: {}", count.get());
        }
    }

    fn white(variance: f64, shift: f64) -> Spread {
        let square = DMatrix::from_element(1, 1, variance);
        Spread {
            parts: vec![(1.0, square.clone(), None)],
            freedom: 1e6,
            shift: DVector::from_element(1, shift),
            covariance: square,
            white: 1.0,
            slow: Vec::new(),
            waves: Vec::new(),
            unevenness: 1.0,
        }
    }

    #[test]
    fn an_interval_of_white_noise_is_that_of_the_normal_distribution() {
        let one = DVector::from_element(1, 1.0);
        assert!((white(4.0, 0.0).half_width(&one) - 2.0 * 1.95996).abs() < 1e-3);
        // A shift far beyond the noise is exceeded on one side only: d + 1.645 σ.
        assert!((white(4.0, 30.0).half_width(&one) - (30.0 + 2.0 * 1.64485)).abs() < 1e-3);
        // Independent quantities: √(3² + 4²) = 5
        let both = half_width(&[white(9.0, 0.0), white(16.0, 0.0)], &one);
        assert!((both - 5.0 * 1.95996).abs() < 2e-3, "{both}");
    }

    /// Residuals of a log at intervals of 1 ms as the noise of one quantity.
    fn noise(rows: Vec<f64>) -> Estimate {
        let value = (0..rows.len()).map(|k| 1e-3 * k as f64).collect();
        let influence = vec![Vec::new()];
        let series = vec![Series::residuals(rows, value)];
        Estimate { quantity: Quantity::CartPosition, weight: 1.0, step: 0.0, series, globals: 0, influence }
    }

    /// Rows of white noise of deviation one, and of slow noises.
    fn drawn(seed: u64, rows: usize, slow: &[Slow]) -> Vec<f64> {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut normal = || crate::chance::normal(&mut random);
        let mut states: Vec<[f64; 2]> =
            slow.iter().map(|own| [normal(), normal()].map(|x| x * own.variance.sqrt())).collect();
        let mut row = |_| {
            for (state, own) in states.iter_mut().zip(slow) {
                // (x + iy) e^{(iω − 1/τ)Δ}, and fresh noise of σ² (1 − e^{−2Δ/τ})
                let (sin, cos) = (1e-3 * own.frequency).sin_cos();
                let decay = (-1e-3 / own.time).exp();
                let fresh = (own.variance * (1.0 - decay * decay)).sqrt();
                let [x, y] = *state;
                *state =
                    [decay * (cos * x - sin * y) + fresh * normal(), decay * (sin * x + cos * y) + fresh * normal()];
            }
            normal() + states.iter().map(|state| state[0]).sum::<f64>()
        };
        (0..rows).map(&mut row).collect()
    }

    /// Narrow-band noise of any frequency, width and size is found among those that are tried, by steps from the best.
    #[test]
    fn narrow_band_noise_is_found_wherever_it_is() {
        for (seed, frequency) in [75.0, 160.0, 390.0, 800.0, 1330.0, 2400.0].into_iter().enumerate() {
            for (damping, variance) in [(0.2, 2.0), (0.2, 60.0), (0.02, 2.0), (0.02, 3000.0), (1e-3, 60.0), (1e-4, 3e3)]
            {
                let truth = Slow { variance, time: 1.0 / (damping * frequency), frequency };
                let estimate = noise(drawn(seed as u64, 700, &[truth]));
                let all = estimate.swinging([1e-3, 0.7], 1.0);
                let found = best(&all).unwrap().slow[0];
                let likely = |slow: Slow| estimate.likelihoods(vec![vec![slow]]).remove(0).unwrap().weight;
                assert!(likely(found) > likely(truth) - 0.5, "{truth:?}: {found:?}");
                // What is averaged over stands about a standard error around the best, of its time and of its variance.
                if (damping, variance) == (0.02, 2.0) {
                    let lost = [-3, 3, -1, 1].map(|by| likely(found) - likely(all[(13 + by) as usize].slow[0]));
                    let most = lost.into_iter().fold(0.0, f64::max);
                    assert!((0.3..4.0).contains(&most), "{truth:?}: {lost:?}");
                }
            }
        }
    }

    /// White noise is rarely taken for slow, and noise of half its variance and of a time constant from 3 to 60 samples
    /// always counts.
    #[test]
    fn slow_noise_is_told_from_white() {
        let coloured = |seed: u64, slow: &[Slow]| {
            let estimate = Estimate { quantity: Quantity::CartSpeed, ..noise(drawn(seed, 700, slow)) };
            estimate.spread(&DMatrix::zeros(0, 0)).unwrap().is_coloured()
        };
        let taken = (0..40).filter(|seed| coloured(*seed, &[])).count();
        assert!(taken <= 1, "{taken} of 40");
        for (seed, time) in [3e-3, 1e-2, 6e-2].into_iter().enumerate() {
            let slow = Slow { variance: 0.5, time, frequency: 0.0 };
            assert!(coloured(seed as u64, &[slow]), "{time}");
        }
    }

    /// Two slow noises of different times are found, each beside the other; never two of nearly one time, whose
    /// variances nothing tells apart.
    #[test]
    fn two_slow_noises_are_told_apart() {
        let [fast, slow] = [(4e-3, 6.0), (0.12, 30.0)].map(|(time, variance)| Slow { variance, time, frequency: 0.0 });
        let mut both = 0;
        for seed in 0..6 {
            let told = noise(drawn(seed, 700, &[fast, slow])).told();
            for one in told.iter().filter(|one| one.slow.len() == 2) {
                let ratio = one.slow[0].time / one.slow[1].time;
                assert!(ratio.ln().abs() > 0.9, "{seed}: {:?}", one.slow);
            }
            let mut times: Vec<f64> = best(&told).unwrap().slow.iter().map(|own| own.time).collect();
            times.sort_by(f64::total_cmp);
            both += usize::from(matches!(times[..], [a, b] if (1e-3..1e-2).contains(&a) && (0.04..0.4).contains(&b)));
        }
        assert!(both >= 4, "{both} of 6");
    }

    /// Noise that swings has at least five periods in the log: slower ones are a drift.
    #[test]
    fn a_slow_wave_is_a_drift() {
        for periods in [1.5, 2.5, 3.5] {
            let mut rows = drawn(1, 700, &[]);
            rows.iter_mut().enumerate().for_each(|(k, row)| *row += 3.0 * (periods * TAU * k as f64 / 700.0).sin());
            let told = noise(rows).told();
            let frequency = best(&told).unwrap().slow[0].frequency;
            assert!(frequency == 0.0 || frequency > 4.9 * TAU / 0.7, "{periods}: {frequency}");
        }
    }
}

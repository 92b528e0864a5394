//! Sobol' indices: which share of a figure's variance is whose.
//!
//! Two samples A and B of N machines, and those of A with parameter i from B. First order after A. Saltelli, P. Annoni,
//! I. Azzini, F. Campolongo, M. Ratto, S. Tarantola, "Variance based sensitivity analysis of model output", Comput.
//! Phys. Commun. 181 (2010), their table 2 (b); total order after M. J. W. Jansen, ibid. (f). Intervals by the
//! bootstrap over the N blocks.

use super::chance::mixed;
use crate::chance::quantile;

/// Shares of the bootstrap's replicates that lie below the ends of an interval: 95 %.
const ENDS: [f64; 2] = [0.025, 0.975];

/// The indices of one parameter, each with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Index {
    /// S_i: the share of the variance that this parameter makes by itself.
    pub first: Estimate,
    /// S_Ti: the share that it takes part in, with others or alone.
    pub total: Estimate,
}

/// A number with the interval that holds it 95 % of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// The least and the most.
    pub interval: [f64; 2],
}

/// The indices of `parameters` parameters from a figure of all runs in their order: blocks of f(A), f(B), f(A with 1
/// from B), …
///
/// Blocks in which a run failed are left out. None where fewer than two are left, or nothing varies. `replicates`
/// resamplings, by `seed`, make the intervals.
pub fn indices(figures: &[f64], parameters: usize, replicates: usize, seed: u64) -> Option<Vec<Index>> {
    let whole = |block: &&[f64]| block.iter().all(|figure| figure.is_finite());
    let blocks: Vec<&[f64]> = figures.chunks_exact(parameters + 2).filter(whole).collect();
    if blocks.len() < 2 || parameters == 0 {
        return None;
    }
    // Where the figure is far from zero, its products say little: from its mean they say more, and the indices stay.
    let mean = blocks.iter().map(|block| 0.5 * (block[0] + block[1])).sum::<f64>() / blocks.len() as f64;
    let all = estimate(&blocks, mean, parameters, |place| place)?;
    let mut spread: Vec<Vec<[f64; 2]>> = vec![Vec::with_capacity(replicates); parameters];
    for replicate in 0..replicates {
        let key = mixed(seed ^ mixed(replicate as u64));
        let drawn = |place: usize| {
            // Any of the blocks, each equally likely: the high half of a product of 128 bits.
            ((u128::from(mixed(key ^ place as u64)) * blocks.len() as u128) >> 64) as usize
        };
        for (spread, pair) in spread.iter_mut().zip(estimate(&blocks, mean, parameters, drawn).unwrap_or_default()) {
            spread.push(pair);
        }
    }
    let told = |(value, spread): ([f64; 2], Vec<[f64; 2]>)| {
        let of = |which: usize| {
            let mut sorted: Vec<f64> = spread.iter().map(|pair| pair[which]).collect();
            sorted.sort_by(f64::total_cmp);
            Estimate { value: value[which], interval: ENDS.map(|share| quantile(&sorted, share)) }
        };
        Index { first: of(0), total: of(1) }
    };
    Some(all.into_iter().zip(spread).map(told).collect())
}

/// First and total order of each parameter, from the blocks at these places.
fn estimate(blocks: &[&[f64]], mean: f64, parameters: usize, place: impl Fn(usize) -> usize) -> Option<Vec<[f64; 2]>> {
    let n = blocks.len() as f64;
    let (mut sum, mut squares) = (0.0, 0.0);
    let mut sums = vec![[0.0; 2]; parameters];
    for block in (0..blocks.len()).map(|k| blocks[place(k)]) {
        let (a, b) = (block[0] - mean, block[1] - mean);
        sum += a + b;
        squares += a * a + b * b;
        for ([first, total], mixed) in sums.iter_mut().zip(&block[2..]) {
            let ab = mixed - mean;
            // V_i = 1/N Σ f(B) (f(A_B⁽ⁱ⁾) − f(A))                                (b)
            *first += b * (ab - a);
            // E_i = 1/2N Σ (f(A) − f(A_B⁽ⁱ⁾))²                                   (f)
            *total += 0.5 * (a - ab) * (a - ab);
        }
    }
    let middle = sum / (2.0 * n);
    let variance = squares / (2.0 * n) - middle * middle;
    (variance > 0.0).then(|| sums.iter().map(|pair| pair.map(|sum| sum / n / variance)).collect())
}

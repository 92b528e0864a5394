//! Draws from a density that is known up to a factor, by the No-U-Turn sampler, and what says whether to believe them.
//!
//! Hoffman & Gelman 2014, in the form of the `nuts-rs` library. R̂ and the effective sample size are ours, after Vehtari, Gelman,
//! Simpson, Carpenter, Bürkner, "Rank-normalization, folding, and localization: An improved R̂", Bayesian Analysis 16 (2021).

use crate::chance::{self, normal_quantile};
use crate::error::{Error, Result};
use nuts_rs::{Chain, CpuLogpFunc, CpuMath, CpuMathError, DiagNutsSettings, HasDims, LogpError, Settings};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::collections::HashMap;
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// How many draws, from how many chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Chains, each from its own start.
    pub chains: usize,
    /// Draws of each chain that only tune it.
    pub tune: usize,
    /// Draws of each chain that are kept.
    pub draws: usize,
    /// Seed; the same one gives the same draws.
    pub seed: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { chains: 4, tune: 500, draws: 500, seed: 1 }
    }
}

/// Most chains: each is a thread.
const MOST_CHAINS: usize = 100;

/// Most draws of all chains together: they stay in memory.
const MOST_DRAWS: usize = 10_000_000;

impl Effort {
    /// Refuses what no sampler can do.
    pub fn check(&self) -> Result<()> {
        let &Self { chains, tune, draws, .. } = self;
        if !(1..=MOST_CHAINS).contains(&chains) {
            return Err(Error::new(format!("{chains} chains cannot be")).allowed(format!("from 1 to {MOST_CHAINS}")));
        }
        let most = MOST_DRAWS / chains;
        if !(1..=most).contains(&draws) || tune > most {
            let chains = if chains == 1 { "one chain".into() } else { format!("each of {chains} chains") };
            return Err(Error::new(format!("{draws} draws of {chains} cannot be")).allowed(format!("from 1 to {most}")));
        }
        Ok(())
    }
}

/// What was drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Draws {
    /// Values by chain, draw and parameter.
    pub chains: Vec<Vec<Vec<f64>>>,
    /// Kept draws whose path went wrong: a density too curved for the step. More than a few make the rest doubtful.
    pub divergences: u64,
    /// Evaluations of the density and its gradient.
    pub evaluations: u64,
    /// Whether it was stopped before all draws were made.
    pub interrupted: bool,
}

/// A density that cannot be evaluated where it was asked for: the path ends there.
#[derive(Debug)]
struct Nowhere;

impl fmt::Display for Nowhere {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the density is not defined here")
    }
}

impl std::error::Error for Nowhere {}

impl LogpError for Nowhere {
    fn is_recoverable(&self) -> bool {
        true
    }
}

/// The density as the library wants it.
struct Density<'a> {
    dimension: usize,
    log: &'a LogDensity<'a>,
    evaluations: &'a AtomicU64,
}

/// The logarithm of the density at a point, and its gradient into the second argument; none where the density is zero.
pub type LogDensity<'a> = dyn Fn(&[f64], &mut [f64]) -> Option<f64> + Sync + 'a;

/// Told how many draws all chains have made so far, those for tuning included; says whether to go on.
pub type Watch<'a> = dyn Fn(usize) -> bool + Sync + 'a;

impl fmt::Debug for Density<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a density in {} dimensions", self.dimension)
    }
}

impl HasDims for Density<'_> {
    fn dim_sizes(&self) -> HashMap<String, u64> {
        HashMap::from([("unconstrained_parameter".to_string(), self.dimension as u64)])
    }
}

impl CpuLogpFunc for Density<'_> {
    type LogpError = Nowhere;
    type ExpandedVector = Vec<f64>;
    type FlowParameters = ();

    fn dim(&self) -> usize {
        self.dimension
    }

    fn logp(&mut self, position: &[f64], gradient: &mut [f64]) -> std::result::Result<f64, Nowhere> {
        self.evaluations.fetch_add(1, Ordering::Relaxed);
        (self.log)(position, gradient).filter(|value| value.is_finite()).ok_or(Nowhere)
    }

    fn expand_vector<R: rand::Rng + ?Sized>(
        &mut self,
        _: &mut R,
        position: &[f64],
    ) -> std::result::Result<Vec<f64>, CpuMathError> {
        Ok(position.to_vec())
    }
}

/// Draws from `log`, each chain beginning at one of `starts` in turn; each on a thread of its own. `watch` sees how far it is, and
/// may end it early: then each chain keeps as many draws as the shortest has.
pub fn sample(log: &LogDensity, starts: &[Vec<f64>], effort: Effort, watch: &Watch) -> Result<Draws> {
    effort.check()?;
    let dimension = starts.first().map_or(0, Vec::len);
    if dimension == 0 || starts.iter().any(|start| start.len() != dimension) {
        return Err(Error::new("a sampler needs points of one or more dimensions to start from"));
    }
    let evaluations = AtomicU64::new(0);
    let (made, stopped) = (AtomicUsize::new(0), AtomicBool::new(false));
    let run = |chain: usize| -> Result<(Vec<Vec<f64>>, u64)> {
        let settings = DiagNutsSettings { num_tune: effort.tune as u64, ..DiagNutsSettings::default() };
        // Each chain has a stream of its own.
        let mut random =
            Pcg64::seed_from_u64(effort.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(chain as u64));
        let math = CpuMath::new(Density { dimension, log, evaluations: &evaluations });
        let fail = |error: &dyn fmt::Display| {
            Error::new(format!("the sampler cannot go on: {error}")).next("start from a fit that has converged")
        };
        let mut sampler = settings.new_chain(chain as u64, math, &mut random).map_err(|error| fail(&error))?;
        sampler.set_position(&starts[chain % starts.len()]).map_err(|error| fail(&error))?;
        let (mut draws, mut divergences) = (Vec::with_capacity(effort.draws), 0);
        for k in 0..effort.tune + effort.draws {
            if stopped.load(Ordering::Relaxed) {
                break;
            }
            let (draw, progress) = sampler.draw().map_err(|error| fail(&error))?;
            if k >= effort.tune {
                divergences += u64::from(progress.diverging);
                draws.push(draw.to_vec());
            }
            if !watch(made.fetch_add(1, Ordering::Relaxed) + 1) {
                stopped.store(true, Ordering::Relaxed);
            }
        }
        Ok((draws, divergences))
    };
    let results: Vec<Result<(Vec<Vec<f64>>, u64)>> = std::thread::scope(|scope| {
        let run = &run;
        let threads: Vec<_> = (0..effort.chains).map(|chain| scope.spawn(move || run(chain))).collect();
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|_| Err(Error::new("a chain broke off"))))
            .collect()
    });
    let mut draws = Draws { chains: Vec::new(), divergences: 0, evaluations: 0, interrupted: false };
    for result in results {
        let (chain, divergences) = result?;
        draws.interrupted |= chain.len() < effort.draws;
        draws.chains.push(chain);
        draws.divergences += divergences;
    }
    let shortest = draws.chains.iter().map(Vec::len).min().unwrap_or(0);
    draws.chains.iter_mut().for_each(|chain| chain.truncate(shortest));
    draws.evaluations = evaluations.into_inner();
    Ok(draws)
}

impl Draws {
    /// All draws of one parameter, sorted.
    pub fn sorted(&self, parameter: usize) -> Vec<f64> {
        let mut values: Vec<f64> = self.chains.iter().flatten().map(|draw| draw[parameter]).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// The value below which this share of the draws lies; NaN without draws.
    pub fn quantile(&self, parameter: usize, share: f64) -> f64 {
        chance::quantile(&self.sorted(parameter), share.clamp(0.0, 1.0))
    }

    /// Mean of one parameter.
    pub fn mean(&self, parameter: usize) -> f64 {
        let values = self.sorted(parameter);
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Standard deviation of one parameter.
    pub fn deviation(&self, parameter: usize) -> f64 {
        let (values, mean) = (self.sorted(parameter), self.mean(parameter));
        (values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (values.len() as f64 - 1.0)).sqrt()
    }

    /// Rank-normalised split R̂: 1 if all halves of all chains look alike, and not to be trusted above 1.01.
    pub fn r_hat(&self, parameter: usize) -> f64 {
        let halves = self.halves(parameter);
        // How far the chains are apart in place, and, folded, in width.
        let mut all: Vec<f64> = halves.iter().flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        let Some(&median) = all.get(all.len() / 2) else { return f64::NAN };
        let folded: Vec<Vec<f64>> = halves.iter().map(|h| h.iter().map(|v| (v - median).abs()).collect()).collect();
        f64::max(r_hat(&rank_normalised(&halves)), r_hat(&rank_normalised(&folded)))
    }

    /// Bulk effective sample size: as many independent draws would know the middle of the distribution as well.
    pub fn effective(&self, parameter: usize) -> f64 {
        effective(&rank_normalised(&self.halves(parameter)))
    }

    /// The chains of one parameter, each cut into halves.
    fn halves(&self, parameter: usize) -> Vec<Vec<f64>> {
        let mut halves = Vec::new();
        for chain in &self.chains {
            let half = chain.len() / 2;
            let of = |draws: &[Vec<f64>]| draws.iter().map(|draw| draw[parameter]).collect::<Vec<f64>>();
            halves.push(of(&chain[..half]));
            halves.push(of(&chain[chain.len() - half..]));
        }
        halves
    }
}

/// Ranks of all values together, as quantiles of the normal distribution: z = Φ⁻¹((r − 3/8)/(S + 1/4)).
fn rank_normalised(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let total: usize = chains.iter().map(Vec::len).sum();
    let mut order: Vec<(f64, usize, usize)> = Vec::with_capacity(total);
    for (c, chain) in chains.iter().enumerate() {
        order.extend(chain.iter().enumerate().map(|(k, &value)| (value, c, k)));
    }
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Vec<f64>> = chains.iter().map(|chain| vec![0.0; chain.len()]).collect();
    let mut start = 0;
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        // Equal values share the middle of their ranks.
        let rank = start as f64 + 0.5 * (same.len() as f64 + 1.0);
        for &(_, c, k) in same {
            out[c][k] = normal_quantile((rank - 0.375) / (total as f64 + 0.25));
        }
        start += same.len();
    }
    out
}

/// Mean and variance (of the sample).
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (n - 1.0))
}

/// Within-chain variance W and the marginal variance (n − 1)/n W + B/n.
fn variances(chains: &[Vec<f64>]) -> (f64, f64) {
    let n = chains.first().map_or(0, Vec::len) as f64;
    let each: Vec<(f64, f64)> = chains.iter().map(|chain| moments(chain)).collect();
    let within = each.iter().map(|(_, variance)| variance).sum::<f64>() / each.len() as f64;
    let means: Vec<f64> = each.iter().map(|(mean, _)| *mean).collect();
    let between = if means.len() > 1 { moments(&means).1 } else { 0.0 };
    (within, (n - 1.0) / n * within + between)
}

fn r_hat(chains: &[Vec<f64>]) -> f64 {
    let (within, marginal) = variances(chains);
    (marginal / within).sqrt()
}

/// Geyer's initial monotone sequence of the autocorrelations of all chains together.
fn effective(chains: &[Vec<f64>]) -> f64 {
    let (count, n) = (chains.len(), chains.first().map_or(0, Vec::len));
    if n < 4 {
        return f64::NAN;
    }
    let (within, marginal) = variances(chains);
    let autocovariance = |lag: usize| -> f64 {
        let of = |chain: &Vec<f64>| {
            let (mean, _) = moments(chain);
            chain.iter().zip(&chain[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / n as f64
        };
        chains.iter().map(of).sum::<f64>() / count as f64
    };
    // ρ_t = 1 − (W − mean autocovariance)/var⁺
    let correlation = |lag: usize| 1.0 - (within - autocovariance(lag)) / marginal;
    let (mut sum, mut before) = (0.0, f64::INFINITY);
    for pair in 0..n / 2 {
        let together = if pair == 0 { 1.0 + correlation(1) } else { correlation(2 * pair) + correlation(2 * pair + 1) };
        if together < 0.0 {
            break;
        }
        before = f64::min(before, together);
        sum += before;
    }
    let total = (count * n) as f64;
    let time = f64::max(2.0 * sum - 1.0, 1.0 / total.log10());
    total / time
}

#[cfg(test)]
mod tests {
    use super::*;

    fn draw(log: &LogDensity, dimension: usize, effort: Effort) -> Draws {
        let starts: Vec<Vec<f64>> = (0..4).map(|k| vec![0.5 * f64::from(k) - 0.7; dimension]).collect();
        sample(log, &starts, effort, &|_| true).unwrap()
    }

    /// Two correlated normal variables with known moments.
    #[test]
    fn a_normal_distribution_has_its_moments() {
        let (rho, effort) = (0.8, Effort { draws: 2000, ..Effort::default() });
        // Precision of a unit covariance with correlation ρ; means 3 and −1, the second ten times as wide.
        let log = |x: &[f64], gradient: &mut [f64]| {
            let (u, v) = (x[0] - 3.0, (x[1] + 1.0) / 10.0);
            let scale = 1.0 / (1.0 - rho * rho);
            gradient[0] = -scale * (u - rho * v);
            gradient[1] = -scale * (v - rho * u) / 10.0;
            Some(-0.5 * scale * (u * u - 2.0 * rho * u * v + v * v))
        };
        let draws = draw(&log, 2, effort);
        assert!((draws.mean(0) - 3.0).abs() < 0.1 && (draws.mean(1) + 1.0).abs() < 1.0, "{}", draws.mean(0));
        assert!((draws.deviation(0) - 1.0).abs() < 0.06 && (draws.deviation(1) - 10.0).abs() < 0.6);
        assert!((draws.quantile(0, 0.975) - (3.0 + 1.96)).abs() < 0.2);
        assert!(draws.r_hat(0) < 1.01 && draws.effective(0) > 1000.0, "{} {}", draws.r_hat(0), draws.effective(0));
    }

    /// A half-normal distribution ends at zero: its interval does not.
    #[test]
    fn a_density_that_ends_is_not_left() {
        // In y = ln x, with the change of variables in the density.
        let log = |y: &[f64], gradient: &mut [f64]| {
            let x = y[0].exp();
            gradient[0] = 1.0 - x * x;
            Some(y[0] - 0.5 * x * x)
        };
        let draws = draw(&log, 1, Effort { draws: 2000, ..Effort::default() });
        let median = draws.quantile(0, 0.5).exp();
        assert!((median - 0.6745).abs() < 0.05, "{median}");
    }

    #[test]
    fn chains_apart_are_told() {
        let chain = |middle: f64| (0..400).map(|k| vec![middle + (f64::from(k) * 0.7).sin()]).collect::<Vec<_>>();
        let together =
            Draws { chains: vec![chain(0.0), chain(0.0)], divergences: 0, evaluations: 0, interrupted: false };
        let apart = Draws { chains: vec![chain(0.0), chain(2.0)], ..together.clone() };
        assert!(together.r_hat(0) < 1.02 && apart.r_hat(0) > 1.3, "{} {}", together.r_hat(0), apart.r_hat(0));
    }

    #[test]
    fn independent_values_count_in_full_and_correlated_ones_do_not() {
        let mut random = Pcg64::seed_from_u64(5);
        let white: Vec<f64> = (0..4000).map(|_| normal_quantile(chance::uniform(&mut random).max(1e-300))).collect();
        // x_k = φ x_{k−1} + w: n_eff = n (1 − φ)/(1 + φ)
        let (phi, mut x) = (0.8, 0.0);
        let red: Vec<f64> = white
            .iter()
            .map(|w| {
                x = phi * x + w;
                x
            })
            .collect();
        let of = |values: &[f64]| Draws {
            chains: values.chunks(1000).map(|c| c.iter().map(|v| vec![*v]).collect()).collect(),
            divergences: 0,
            evaluations: 0,
            interrupted: false,
        };
        let (white, red) = (of(&white).effective(0), of(&red).effective(0));
        assert!((3200.0..5200.0).contains(&white), "{white}");
        assert!((red / 4000.0 - (1.0 - phi) / (1.0 + phi)).abs() < 0.05, "{red}");
    }

    /// A chain is a thread and a draw is memory: a million chains ended the process.
    #[test]
    fn an_effort_that_cannot_be_is_refused() {
        let told = |chains, draws| Effort { chains, draws, ..Effort::default() }.check().map_err(|e| e.to_string());
        assert_eq!(told(4, 500), Ok(()));
        assert_eq!(told(100, 100_000), Ok(()));
        assert_eq!(told(0, 500), Err("0 chains cannot be\n  allowed: from 1 to 100".into()));
        assert_eq!(told(1_000_000, 500), Err("1000000 chains cannot be\n  allowed: from 1 to 100".into()));
        assert_eq!(told(4, 0), Err("0 draws of each of 4 chains cannot be\n  allowed: from 1 to 2500000".into()));
        assert_eq!(
            told(1, usize::MAX),
            Err(format!("{} draws of one chain cannot be\n  allowed: from 1 to 10000000", usize::MAX))
        );
    }

    #[test]
    fn the_normal_quantile_is_the_inverse() {
        for (p, z) in [(0.5, 0.0), (0.975, 1.959963984540054), (0.025, -1.959963984540054), (1e-6, -4.753424308822899)]
        {
            assert!((normal_quantile(p) - z).abs() < 1e-12, "{p}: {}", normal_quantile(p));
        }
    }
}

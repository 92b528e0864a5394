//! Convergence of chains: R̂ and the effective sample size
//! of Vehtari, Gelman, Simpson, Carpenter, Bürkner, "Rank-normalization, folding, and localization: An improved R̂",
//! Bayesian Analysis 16 (2021).

use super::Draws;
use crate::chance::{self, normal_quantile};

impl Draws {
    /// All draws of one parameter, sorted.
    pub fn sorted(&self, parameter: usize) -> Vec<f64> {
        let mut values: Vec<f64> = self.chains.iter().flatten().map(|draw| draw[parameter]).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// Quantile of the draws; NaN without draws.
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

    /// Rank-normalised split R̂: 1 if all halves of all chains agree; above 1.01 the chains have not converged.
    pub fn r_hat(&self, parameter: usize) -> f64 {
        let halves = self.halves(parameter);
        // Differences of the chains in location and, folded, in width.
        let mut all: Vec<f64> = halves.iter().flatten().copied().collect();
        all.sort_by(f64::total_cmp);
        let Some(&median) = all.get(all.len() / 2) else { return f64::NAN };
        let folded: Vec<Vec<f64>> = halves.iter().map(|h| h.iter().map(|v| (v - median).abs()).collect()).collect();
        f64::max(r_hat(&rank_normalised(&halves)), r_hat(&rank_normalised(&folded)))
    }

    /// Bulk effective sample size: number of independent draws with the same accuracy of the middle of the
    /// distribution.
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
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng;

    #[test]
    fn mean_and_deviation_are_those_of_all_chains() {
        let chain = |values: [f64; 2]| values.map(|value| vec![value]).to_vec();
        let chains = vec![chain([1.0, 2.0]), chain([4.0, 5.0])];
        let draws = Draws { chains, divergences: 0, evaluations: 0, interrupted: false };
        // (4 + 1 + 1 + 4)/3
        assert_eq!((draws.mean(0), draws.deviation(0)), (3.0, (10.0_f64 / 3.0).sqrt()));
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

    #[test]
    fn the_normal_quantile_is_the_inverse() {
        for (p, z) in [(0.5, 0.0), (0.975, 1.959963984540054), (0.025, -1.959963984540054), (1e-6, -4.753424308822899)]
        {
            assert!((normal_quantile(p) - z).abs() < 1e-12, "{p}: {}", normal_quantile(p));
        }
    }
}

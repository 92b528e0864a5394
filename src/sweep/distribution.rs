//! Distributions by their quantiles: what a share of 1 becomes.

use crate::case::Prior;
use crate::chance::normal_quantile;
use libm::{erfc, exp, log};
use std::f64::consts::FRAC_1_SQRT_2;

/// How one number varies.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Distribution {
    /// One of these, each equally likely.
    Values(Vec<f64>),
    /// By a density, cut off where the number may not go.
    Drawn {
        /// The density.
        prior: Prior,
        /// Shares of it that lie below and up to the end of what is allowed.
        shares: [f64; 2],
        /// The range that is allowed.
        within: [f64; 2],
    },
}

impl Distribution {
    /// A density of which only what lies `within` is drawn; none where next to nothing does.
    pub fn drawn(prior: Prior, within: [f64; 2]) -> Option<Self> {
        let shares = within.map(|end| share_below(prior, end));
        // A tail in which doubles do not tell shares apart any more has no quantiles.
        (shares[1] - shares[0] > 1e-9).then_some(Self::Drawn { prior, shares, within })
    }

    /// The values, where there is a number of them; of a density none.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Values(values) => values,
            Self::Drawn { .. } => &[],
        }
    }

    /// The value of which the share `u` of all draws lies below, `u` being above 0 and below 1.
    pub fn quantile(&self, u: f64) -> f64 {
        match self {
            Self::Values(values) => {
                let place = (u * values.len() as f64) as usize;
                values.get(place).or(values.last()).copied().unwrap_or(f64::NAN)
            }
            Self::Drawn { prior, shares: [low, high], within } => {
                let u = low + u * (high - low);
                let value = match *prior {
                    Prior::Uniform { low, high } => low + u * (high - low),
                    Prior::Normal { mean, deviation } => mean + deviation * normal_quantile(u),
                    Prior::LogNormal { median, deviation } => median * exp(deviation * normal_quantile(u)),
                };
                value.clamp(within[0], within[1])
            }
        }
    }
}

/// The share of a density that lies below `value`.
fn share_below(prior: Prior, value: f64) -> f64 {
    // Φ(z) = erfc(−z/√2)/2
    let below = |z: f64| 0.5 * erfc(-z * FRAC_1_SQRT_2);
    match prior {
        Prior::Uniform { low, high } => ((value - low) / (high - low)).clamp(0.0, 1.0),
        Prior::Normal { mean, deviation } => below((value - mean) / deviation),
        Prior::LogNormal { .. } if value <= 0.0 => 0.0,
        Prior::LogNormal { median, deviation } => below(log(value / median) / deviation),
    }
}

/// Two values that stand for a density where one thing is varied at a time: the ends of a uniform one, of others one
/// deviation to either side.
pub fn ends(prior: Prior) -> [f64; 2] {
    match prior {
        Prior::Uniform { low, high } => [high, low],
        Prior::Normal { mean, deviation } => [mean + deviation, mean - deviation],
        Prior::LogNormal { median, deviation } => [median * exp(deviation), median * exp(-deviation)],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_normal_distribution_undo_its_shares() {
        let normal = Prior::Normal { mean: 0.0, deviation: 1.0 };
        for p in [1e-300, 1e-20, 1e-6, 0.01, 0.0749, 0.075, 0.0751, 0.3, 0.5, 0.7, 0.93, 0.999, 1.0 - 1e-9] {
            let off = share_below(normal, normal_quantile(p)) / p - 1.0;
            assert!(off.abs() < 2e-13 * (1.0 + p.ln().abs()), "{p}: {off}");
        }
    }
}

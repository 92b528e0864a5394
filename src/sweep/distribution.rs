//! Distributions by their quantiles: what a share of 1 becomes.

use crate::case::Prior;
use libm::{erfc, exp, log, sqrt};
use std::f64::consts::FRAC_1_SQRT_2;

/// How one number varies.
#[derive(Debug, Clone, PartialEq)]
pub enum Distribution {
    /// One of these, each equally likely.
    Values(Vec<f64>),
    /// By a density, cut off where the number may not go.
    Drawn {
        /// The density.
        prior: Prior,
        /// Shares of it that lie below and up to the end of what is allowed.
        shares: [f64; 2],
        /// What is allowed.
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

/// The quantile of the standard normal distribution, to about 1e-16 of itself: M. J. Wichura, "Algorithm AS 241: The percentage
/// points of the normal distribution", Appl. Statist. 37 (1988), its PPND16.
pub fn normal_quantile(p: f64) -> f64 {
    let ratio = |above: &[f64; 8], below: &[f64; 8], x: f64| {
        let sum = |factors: &[f64; 8]| factors.iter().rev().fold(0.0, |sum, factor| sum * x + factor);
        sum(above) / sum(below)
    };
    let q = p - 0.5;
    if q.abs() <= 0.425 {
        return q * ratio(&A, &B, 0.180625 - q * q);
    }
    let tail = if q < 0.0 { p } else { 1.0 - p };
    if tail <= 0.0 {
        return if q < 0.0 { f64::NEG_INFINITY } else { f64::INFINITY };
    }
    let r = sqrt(-log(tail));
    let far = if r <= 5.0 { ratio(&C, &D, r - 1.6) } else { ratio(&E, &F, r - 5.0) };
    if q < 0.0 { -far } else { far }
}

#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const A: [f64; 8] = [
    3.387_132_872_796_366_608, 1.331_416_678_917_843_774_5e2, 1.971_590_950_306_551_442_7e3, 1.373_169_376_550_946_112_5e4,
    4.592_195_393_154_987_145_7e4, 6.726_577_092_700_870_085_3e4, 3.343_057_558_358_812_810_5e4, 2.509_080_928_730_122_672_7e3,
];
#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const B: [f64; 8] = [
    1.0, 4.231_333_070_160_091_125_2e1, 6.871_870_074_920_579_083e2, 5.394_196_021_424_751_107_7e3,
    2.121_379_430_158_659_586_7e4, 3.930_789_580_009_271_061e4, 2.872_908_573_572_194_267_4e4, 5.226_495_278_852_854_561e3,
];
#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const C: [f64; 8] = [
    1.423_437_110_749_683_577_34, 4.630_337_846_156_545_295_9, 5.769_497_221_460_691_405_5, 3.647_848_324_763_204_605_04,
    1.270_458_252_452_368_382_58, 2.417_807_251_774_506_117_7e-1, 2.272_384_498_926_918_458_33e-2, 7.745_450_142_783_414_076_4e-4,
];
#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const D: [f64; 8] = [
    1.0, 2.053_191_626_637_758_821_87, 1.676_384_830_183_803_849_4, 6.897_673_349_851_000_045_5e-1,
    1.481_039_764_274_800_745_9e-1, 1.519_866_656_361_645_719_66e-2, 5.475_938_084_995_344_946e-4, 1.050_750_071_644_416_843_24e-9,
];
#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const E: [f64; 8] = [
    6.657_904_643_501_103_777_2, 5.463_784_911_164_114_369_9, 1.784_826_539_917_291_335_8, 2.965_605_718_285_048_912_3e-1,
    2.653_218_952_657_612_309_3e-2, 1.242_660_947_388_078_438_6e-3, 2.711_555_568_743_487_578_15e-5, 2.010_334_399_292_288_132_65e-7,
];
#[rustfmt::skip]
#[allow(clippy::excessive_precision)] // as printed
const F: [f64; 8] = [
    1.0, 5.998_322_065_558_879_376_9e-1, 1.369_298_809_227_358_053_1e-1, 1.487_536_129_085_061_485_25e-2,
    7.868_691_311_456_132_591e-4, 1.846_318_317_510_054_681_8e-5, 1.421_511_758_316_445_888_7e-7, 2.044_263_103_389_939_785_64e-15,
];

/// Two values that stand for a density where one thing is varied at a time: the ends of a uniform one, of others one deviation to
/// either side.
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
        // The published check values of AS 241.
        assert!((normal_quantile(0.25) + 0.674_489_750_196_081_7).abs() < 1e-15);
        assert!((normal_quantile(0.001) + 3.090_232_306_167_813_5).abs() < 1e-15);
        assert!((normal_quantile(1e-20) + 9.262_340_089_798_408).abs() < 1e-14);
    }
}

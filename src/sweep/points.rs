//! Which value each parameter has in which run.

use super::chance::{Uniform, mixed, permuted};
use super::{Parameter, Sobol};
use crate::case::Sampling;

/// The points of a sweep, by the number of the run.
#[derive(Debug, Clone)]
pub(super) struct Points {
    seed: u64,
    /// Number of samples: of runs, or of the blocks that indices are made of.
    samples: u64,
    kind: SamplingScheme,
    /// True if runs come in blocks of k + 2.
    blocks: bool,
}

#[derive(Debug, Clone)]
enum SamplingScheme {
    Random,
    LatinHypercube,
    Sobol(Sobol),
    /// Every value with every other; the last parameter goes fastest.
    Grid,
    /// Run 0 is the case's; behind it, by run, the parameter that is off and its value.
    OneAtATime(Vec<(usize, f64)>),
}

impl Points {
    /// Those of drawn designs, `samples` in all, of so many parameters.
    pub fn new(sampling: Sampling, seed: u64, samples: u64, parameters: usize, blocks: bool) -> Self {
        let kind = match sampling {
            Sampling::Random => SamplingScheme::Random,
            Sampling::LatinHypercube => SamplingScheme::LatinHypercube,
            Sampling::Sobol => {
                SamplingScheme::Sobol(Sobol::new(if blocks { 2 * parameters } else { parameters }, seed))
            }
            Sampling::Grid | Sampling::OneAtATime => SamplingScheme::Grid,
        };
        Self { seed, samples, kind, blocks }
    }

    /// The machine as it is, then these changes.
    pub fn one_at_a_time(seed: u64, changes: Vec<(usize, f64)>) -> Self {
        Self { seed, samples: changes.len() as u64 + 1, kind: SamplingScheme::OneAtATime(changes), blocks: false }
    }

    /// Which draw of `count` a run takes: each as often as any other, in an order of chance.
    pub fn draw(&self, run: u64, count: u64) -> usize {
        let count = count.max(1);
        permuted(run % count, count, mixed(self.seed ^ mixed(run / count))) as usize
    }

    /// Adds the values of the parameters in a run.
    pub fn put(&self, run: u64, parameters: &[Parameter], values: &mut Vec<f64>) {
        let dimensions = parameters.len();
        let (sample, part) = match self.blocks {
            true => (run / (dimensions as u64 + 2), (run % (dimensions as u64 + 2)) as usize),
            false => (run, 0),
        };
        // A, then B, then A with one parameter after the other from B.
        let from_b = |j: usize| part == 1 || part == j + 2;
        let all = if self.blocks { 2 * dimensions } else { dimensions };
        let place = |j: usize| if self.blocks && from_b(j) { dimensions + j } else { j };
        match &self.kind {
            SamplingScheme::Random => {
                let mut uniform = Uniform::of_run(self.seed, sample, all);
                if !self.blocks {
                    values.extend(parameters.iter().map(|parameter| parameter.distribution.quantile(uniform.next())));
                    return;
                }
                let shares: Vec<f64> = (0..all).map(|_| uniform.next()).collect();
                values.extend(parameters.iter().enumerate().map(|(j, p)| p.distribution.quantile(shares[place(j)])));
            }
            SamplingScheme::LatinHypercube => {
                let mut uniform = Uniform::of_run(self.seed, sample, all);
                let shares: Vec<f64> = (0..all).map(|_| uniform.next()).collect();
                for (j, parameter) in parameters.iter().enumerate() {
                    let stratum = permuted(sample, self.samples, mixed(self.seed ^ mixed(place(j) as u64)));
                    let share = (stratum as f64 + shares[place(j)]) / self.samples as f64;
                    // The last stratum ends below 1, whatever rounding does.
                    values.push(parameter.distribution.quantile(share.min(1.0 - 2f64.powi(-53))));
                }
            }
            SamplingScheme::Sobol(sobol) => {
                let share = |j: usize| sobol.coordinate(sample, place(j));
                values.extend(parameters.iter().enumerate().map(|(j, p)| p.distribution.quantile(share(j))));
            }
            SamplingScheme::Grid => {
                let begin = values.len();
                let mut rest = run;
                for parameter in parameters.iter().rev() {
                    let given = parameter.distribution.values();
                    let count = given.len().max(1) as u64;
                    values.push(given.get((rest % count) as usize).copied().unwrap_or(f64::NAN));
                    rest /= count;
                }
                values[begin..].reverse();
            }
            SamplingScheme::OneAtATime(changes) => {
                let begin = values.len();
                values.extend(parameters.iter().map(|parameter| parameter.free.start));
                if let Some((place, value)) = run.checked_sub(1).and_then(|change| changes.get(change as usize)) {
                    values[begin + place] = *value;
                }
            }
        }
    }

    /// True if a run sets parameter `place`; one at a time leaves the others exactly as they are.
    pub fn varies(&self, run: u64, place: usize) -> bool {
        match &self.kind {
            SamplingScheme::OneAtATime(changes) => {
                run.checked_sub(1).and_then(|change| changes.get(change as usize)).is_some_and(|(p, _)| *p == place)
            }
            _ => true,
        }
    }
}

//! The summary of all runs of a sweep: how each figure is spread, and which parameters it depends on.

use super::measures::IN_STEP;
use super::{Index, Spread, Status};
use crate::chance::normal_quantile;
use crate::number::significant;

/// The whole summary.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Parameters as they were drawn: name, unit, spread.
    pub parameters: Vec<Drawn>,
    /// By experiment and move.
    pub groups: Vec<Shown>,
    /// Of how many runs one counts for shares.
    pub every: u64,
}

/// A parameter as it was drawn.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its key, or those of a tie.
    pub name: String,
    /// SI unit.
    pub unit: String,
    /// How its values are spread.
    pub spread: Option<Spread>,
    /// Values for a scatter plot.
    pub points: Vec<f64>,
}

/// The figures of one experiment or move.
#[derive(Debug, Clone)]
pub struct Shown {
    /// Its name.
    pub name: String,
    /// How many runs ended how: counts by status, of those that are looked at.
    pub endings: Vec<(Status, usize)>,
    /// Its figures.
    pub measures: Vec<Measured>,
}

/// How often steppers lose steps.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct LostShare {
    /// Runs out of step.
    pub lost: usize,
    /// All runs.
    pub runs: usize,
    /// Probability of lost steps: its 95 % interval by Wilson (1927).
    pub interval: [f64; 2],
}

impl LostShare {
    fn new(lost: usize, runs: usize) -> Self {
        let (n, z) = (runs as f64, normal_quantile(0.975));
        let share = lost as f64 / n;
        // (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n)
        let middle = share + z * z / (2.0 * n);
        let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        let at = |value: f64| (value / (1.0 + z * z / n)).clamp(0.0, 1.0);
        // Exactly 0 and 1 at the ends, but for rounding.
        let low = if lost == 0 { 0.0 } else { at(middle - half) };
        let high = if lost == runs { 1.0 } else { at(middle + half) };
        Self { lost, runs, interval: [low, high] }
    }

    /// Share of the runs out of step.
    pub fn share(&self) -> f64 {
        self.lost as f64 / self.runs as f64
    }

    /// In a sentence.
    pub fn words(&self) -> String {
        let percent = |share: f64| significant(100.0 * share, 2);
        let [low, high] = self.interval.map(percent);
        let (lost, runs, share) = (self.lost, self.runs, percent(self.share()));
        format!("steps are lost in {lost} of {runs} runs: {share} % (95 %: {low} to {high} %)")
    }
}

impl Shown {
    /// How often steps are lost; none of other motors, or if the figure `in_step` is not kept.
    pub fn lost_steps(&self) -> Option<LostShare> {
        let in_step = self.measures.iter().find(|measured| measured.name == IN_STEP)?.spread.as_ref()?;
        let kept = (in_step.mean * in_step.count as f64).round() as usize;
        Some(LostShare::new(in_step.count - kept.min(in_step.count), in_step.count))
    }
}

/// One figure of one experiment.
#[derive(Debug, Clone)]
pub struct Measured {
    /// Its name in columns.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Its name for people.
    pub words: String,
    /// None where no run has it.
    pub spread: Option<Spread>,
    /// By parameter: Spearman's rank correlation, where machines are drawn.
    pub ranks: Vec<f64>,
    /// By parameter, where the runs are those that indices need.
    pub indices: Option<Vec<Index>>,
    /// One at a time: of the machine as it is.
    pub nominal: f64,
    /// One at a time: by parameter, its values and those of this figure.
    pub tornado: Vec<Vec<(f64, f64)>>,
    /// Values for a scatter plot.
    pub points: Vec<f64>,
}

impl Measured {
    /// True if runs differ in it.
    pub fn varies(&self) -> bool {
        self.spread.as_ref().is_some_and(|spread| spread.quantiles[0] < spread.quantiles[4])
    }

    /// The parameters that matter most: place and how much, in descending order. Total indices where there are any, one
    /// at a time the largest change, else rank correlations.
    pub fn influence(&self) -> Vec<(usize, f64)> {
        let mut all: Vec<(usize, f64)> = match &self.indices {
            Some(indices) => indices.iter().map(|index| index.total.value).enumerate().collect(),
            None if !self.tornado.is_empty() => {
                let off = |(_, value): &(f64, f64)| value - self.nominal;
                let most = |bars: &Vec<(f64, f64)>| {
                    bars.iter()
                        .map(off)
                        .filter(|off| off.is_finite())
                        .fold(0.0, |most: f64, off| if off.abs() > most.abs() { off } else { most })
                };
                self.tornado.iter().map(most).enumerate().collect()
            }
            None => self.ranks.iter().copied().enumerate().collect(),
        };
        all.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        all
    }

    /// The same of those alone that the runs show: chance makes a rank correlation as large as the least of them once
    /// in a thousand, the interval of an index excludes a hundredth, and a change one at a time is a change.
    pub fn shown_influence(&self) -> Vec<(usize, f64)> {
        let is_shown = |(place, much): &(usize, f64)| match &self.indices {
            Some(indices) => indices.get(*place).is_some_and(|index| index.total.interval[0] > 0.01),
            None if !self.tornado.is_empty() => *much != 0.0,
            None => much.abs() > self.chance(),
        };
        self.influence().into_iter().filter(is_shown).collect()
    }

    /// The rank correlation that independent quantities exceed once in a thousand: its deviation is 1/√(n − 1)
    /// (E. S. Pearson, B. B. Snow 1962).
    pub fn chance(&self) -> f64 {
        let count = self.spread.as_ref().map_or(0, |spread| spread.count);
        3.29 / (count.max(2) as f64 - 1.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::LostShare;

    /// The examples of Newcombe (1998), table I.
    #[test]
    fn intervals_of_wilson() {
        for (lost, runs, [low, high]) in [
            (81, 263, [0.2553, 0.3662]),
            (15, 148, [0.0624, 0.1605]),
            (0, 20, [0.0, 0.1611]),
            (1, 29, [0.0061, 0.1718]),
        ] {
            let share = LostShare::new(lost, runs);
            let [a, b] = share.interval;
            assert!((a - low).abs() < 1e-4 && (b - high).abs() < 1e-4, "{share:?}");
        }
    }
}

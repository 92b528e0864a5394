//! The summary of all runs of a sweep: how each figure is spread, and which parameters it depends on.

use super::{Index, Spread, Status};

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

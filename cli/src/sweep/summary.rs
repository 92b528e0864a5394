//! What all runs show: how each figure is spread, and what it depends on.
//!
//! Columns are read back one at a time, so memory does not grow with their number. Shares are exact up to [`MOST_VALUES`] runs; of
//! more runs every second one is taken, every third, and so on. Rank correlations are those of at most [`MOST_RANKED`] runs.

use super::Work;
use super::store::Store;
use rayon::prelude::*;
use taut::Result;
use taut::case::Sampling;
use taut::sweep::{Index, Spread, Status, indices, rank_correlation};

/// Values of a column that shares are computed from.
pub const MOST_VALUES: u64 = 1 << 20;

/// Values that are ranked.
pub const MOST_RANKED: usize = 20_000;

/// Resamplings that make the intervals of sensitivity indices.
pub const REPLICATES: usize = 200;

/// Points of a scatter plot.
const POINTS: usize = 1500;

/// The whole summary.
pub struct Summary {
    /// Parameters as they were drawn: name, unit, spread.
    pub parameters: Vec<Drawn>,
    /// By experiment and move.
    pub groups: Vec<Group>,
    /// Of how many runs one counts for shares.
    pub every: u64,
}

/// A parameter.
pub struct Drawn {
    pub name: String,
    pub unit: String,
    pub spread: Option<Spread>,
    /// Values for a scatter plot.
    pub points: Vec<f64>,
}

/// What one experiment shows.
pub struct Group {
    /// Its name.
    pub name: String,
    /// How many runs ended how: counts by status, of those that are looked at.
    pub endings: Vec<(Status, usize)>,
    /// Its figures.
    pub measures: Vec<Measured>,
}

/// One figure of one experiment.
pub struct Measured {
    pub name: String,
    pub unit: &'static str,
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
    /// Whether runs differ in it.
    pub fn varies(&self) -> bool {
        self.spread.as_ref().is_some_and(|spread| spread.quantiles[0] < spread.quantiles[4])
    }

    /// The parameters that matter most: place and how much, in descending order. Total indices where there are any, one at a time the
    /// largest change, else rank correlations.
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

    /// The same of those alone that the runs show: chance makes a rank correlation as large as the least of them once in a
    /// thousand, the interval of an index excludes a hundredth, and a change one at a time is a change.
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

impl Summary {
    /// Sums up what is in the store.
    pub fn of(work: &Work, store: &Store) -> Result<Self> {
        let sweep = work.sweep;
        let inputs = sweep.inputs();
        let block = if sweep.indices() { sweep.parameters().len() as u64 + 2 } else { 1 };
        let every = sweep.runs().div_ceil(MOST_VALUES);
        let column = |place: usize| -> Result<Vec<f64>> {
            let mut values = store.column(place, block, every)?;
            if sweep.indices() {
                // A, then B: those of A with one from B are drawn for the indices alone.
                values = values.chunks(block as usize).flat_map(|block| block.iter().take(2)).copied().collect();
            }
            Ok(values)
        };
        let thinned = |values: &[f64], most: usize| -> Vec<f64> {
            let step = values.len().div_ceil(most).max(1);
            values.iter().step_by(step).copied().collect()
        };
        let drawn = (1..inputs)
            .into_par_iter()
            .map(|place| {
                let values = column(place)?;
                let heading = &sweep.columns()[place];
                Ok((heading, Spread::of(&values), thinned(&values, MOST_RANKED)))
            })
            .collect::<Result<Vec<_>>>()?;
        let is_drawn = sweep.sampling() != Sampling::OneAtATime;
        let mut groups = Vec::new();
        let mut place = inputs;
        for group in sweep.groups() {
            let statuses = column(place)?;
            let count = |status: &Status| statuses.iter().filter(|code| **code == status.code()).count();
            let endings =
                Status::ALL.iter().map(|status| (*status, count(status))).filter(|(_, count)| *count > 0).collect();
            let first = place + 1;
            place = first + group.figures.len();
            let measured = group.figures.par_iter().enumerate().map(|(number, figure)| {
                let values = column(first + number)?;
                let ranked = thinned(&values, MOST_RANKED);
                let of_drawn = |(_, _, x): &(_, _, Vec<f64>)| rank_correlation(x, &ranked);
                let indices = match sweep.indices() {
                    true => {
                        indices(&store.column(first + number, block, every)?, sweep.parameters().len(), REPLICATES, 1)
                    }
                    false => None,
                };
                Ok(Measured {
                    name: figure.name.clone(),
                    unit: figure.unit,
                    words: figure.words.clone(),
                    spread: Spread::of(&values),
                    ranks: if is_drawn { drawn.iter().map(of_drawn).collect() } else { Vec::new() },
                    indices,
                    nominal: if is_drawn { f64::NAN } else { values.first().copied().unwrap_or(f64::NAN) },
                    tornado: if is_drawn { Vec::new() } else { tornado(work, &values) },
                    points: thinned(&ranked, POINTS),
                })
            });
            groups.push(Group { name: group.name.clone(), endings, measures: measured.collect::<Result<_>>()? });
        }
        let parameters = drawn
            .into_iter()
            .map(|(heading, spread, values)| Drawn {
                name: heading.name.clone(),
                unit: heading.unit.clone(),
                spread,
                points: thinned(&values, POINTS),
            })
            .collect();
        Ok(Self { parameters, groups, every })
    }
}

/// By parameter, its values one at a time and those of a figure, whose column this is.
fn tornado(work: &Work, values: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let mut run = 0;
    let of = |parameter: &taut::sweep::Parameter| {
        let given = parameter.distribution.values();
        let bars = given.iter().map(|value| {
            run += 1;
            (*value, values.get(run).copied().unwrap_or(f64::NAN))
        });
        bars.collect()
    };
    work.sweep.parameters().iter().map(of).collect()
}

//! The summary of all runs: how each figure is spread, and which parameters it depends on.
//!
//! Columns are read back one at a time, so memory does not grow with their number. Shares are exact up to
//! [`MOST_VALUES`] runs; of more runs every second one is taken, every third, and so on. Rank correlations are those of
//! at most [`MOST_RANKED`] runs.

use super::Work;
use super::store::Store;
use rayon::prelude::*;
use taut::Result;
use taut::case::Sampling;
use taut::sweep::{Drawn, Measured, Ranked, Shown, Spread, Status, Summary, indices};

/// Values of a column that shares are computed from.
pub const MOST_VALUES: u64 = 1 << 20;

/// Values that are ranked.
pub const MOST_RANKED: usize = 20_000;

/// Resamplings that make the intervals of sensitivity indices.
pub const REPLICATES: usize = 200;

/// Points of a scatter plot.
const POINTS: usize = 1500;

/// Sums up what is in the store.
pub fn summary(work: &Work, store: &Store) -> Result<Summary> {
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
            let few = thinned(&values, MOST_RANKED);
            let ranked = Ranked::new(&few);
            Ok((heading, Spread::new(&values), few, ranked))
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
            let few = thinned(&values, MOST_RANKED);
            let ranks = match is_drawn {
                true => {
                    let ranked = Ranked::new(&few);
                    drawn.iter().map(|(.., of_drawn)| of_drawn.correlation(&ranked)).collect()
                }
                false => Vec::new(),
            };
            let indices = match sweep.indices() {
                true => indices(&store.column(first + number, block, every)?, sweep.parameters().len(), REPLICATES, 1),
                false => None,
            };
            Ok(Measured {
                name: figure.name.clone(),
                unit: figure.unit,
                words: figure.words.clone(),
                spread: Spread::new(&values),
                ranks,
                indices,
                nominal: if is_drawn { f64::NAN } else { values.first().copied().unwrap_or(f64::NAN) },
                tornado: if is_drawn { Vec::new() } else { tornado(work, &values) },
                points: thinned(&few, POINTS),
            })
        });
        groups.push(Shown { name: group.name.clone(), endings, measures: measured.collect::<Result<_>>()? });
    }
    let parameters = drawn
        .into_iter()
        .map(|(heading, spread, values, _)| Drawn {
            name: heading.name.clone(),
            unit: heading.unit.clone(),
            spread,
            points: thinned(&values, POINTS),
        })
        .collect();
    Ok(Summary { parameters, groups, every })
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

//! Records cut into parts, one of which is held out at a time.

use super::held_out::{met, nothing};
use super::result::known;
use super::scores::together;
use crate::case::{Case, Experiment, Per, Plan, matches};
use crate::error::Result;
use crate::fit::asked::problem::{Problem, Stop};
use crate::fit::limits::{BLOCK_SAMPLES, FEWEST_LOGS, FOLDS, LOG_BLOCKS, START_SHARE};
use crate::fit::search::starts::{Effort, Work, search_as_far};
use crate::log::{Log, Output, Quantity};
use crate::solve::Flow;
use std::fmt::Display;
use std::ops::Range;
use std::sync::Arc;

/// The parts that are fitted, and those that are held out.
pub(crate) struct Fold {
    pub fitted: Vec<Experiment>,
    pub held_out: Vec<Experiment>,
}

/// The records in parts: each is held out once. The flag is true if logs were cut, so that their parts have starts of
/// their own.
pub(crate) struct Parts {
    pub folds: Vec<Fold>,
    pub is_cut: bool,
}

impl Parts {
    /// The parts of the logs of a case that its plan fits.
    pub fn new(case: &Case, plan: &Plan) -> Self {
        let logs = fitted(case, plan);
        match logs.len() >= FEWEST_LOGS {
            true => Self { folds: by_log(&logs), is_cut: false },
            false => Self::blocks(case, plan),
        }
    }

    /// Blocks of each log, however many there are.
    pub fn blocks(case: &Case, plan: &Plan) -> Self {
        Self { folds: by_block(&fitted(case, plan)), is_cut: true }
    }

    /// The parts that are held out, in words.
    pub fn words(&self) -> String {
        match self.is_cut {
            true => format!(
                "{} blocks of the logs, one after the other, each with its start fitted to its first tenth",
                self.folds.len()
            ),
            false => format!("the logs, in {} parts, one after the other", self.folds.len()),
        }
    }
}

/// The experiments whose logs are fitted.
fn fitted<'c>(case: &'c Case, plan: &Plan) -> Vec<&'c Experiment> {
    let is_held = |name: &str| plan.held_out.iter().any(|pattern| matches(name, pattern));
    case.experiments.iter().filter(|e| e.log.is_some() && !is_held(&e.name)).collect()
}

/// Sum of squares and number of values of each quantity.
pub(crate) type Errors = Vec<(Quantity, f64, usize)>;

/// Sums of squares of a part that is not fitted, by quantity, with the number of values; from a fit to the other parts
/// that begins at the machine of `case`. `is_cut`: the parts are blocks of logs, with starts of their own. Values of a
/// campaign predict its blocks.
pub(crate) fn errors(
    case: &Case,
    plan: &Plan,
    fold: &Fold,
    (is_cut, effort): (bool, &Effort),
    stop: Option<Stop>,
) -> Result<(Errors, Work)> {
    let Fold { fitted, held_out } = fold;
    let mut plan = Plan { held_out: Vec::new(), ..plan.clone() };
    let is_known = |experiment: &Experiment| !plan.part(&experiment.name).is_empty();
    if plan.per == Per::Log || !fitted.iter().chain(held_out).all(is_known) {
        plan.separate.clear();
    }
    plan.nuisance.initial_state |= is_cut;
    let own = Case { experiments: fitted.clone(), ..case.clone() };
    let found = search_as_far(&own, &plan, stop, effort, &mut |_, _| Flow::Continue)?;
    let machine = |name: &str| {
        let part = found.problem.part(plan.part(name));
        found.problem.simulated(part.unwrap_or(0), &found.best.x)
    };
    let known = known(&found);
    let held = Case { experiments: held_out.clone(), ..case.clone() };
    let scored = Plan { windows: None, nuisance: plan.nuisance, ..nothing(&plan) };
    let runs = Problem::new(&held, &scored)?.runs;
    let logs: Vec<_> = runs.iter().map(|run| met(run, &machine(&run.name), &known, START_SHARE)).collect();
    let errors = together(&logs, |_| String::new());
    let errors = errors.iter().map(|one| (one.quantity, one.rmse.powi(2) * one.count as f64, one.count));
    Ok((errors.collect(), found.work))
}

/// Interleaved logs, so that the parts are similar.
fn by_log(logs: &[&Experiment]) -> Vec<Fold> {
    let count = FOLDS.min(logs.len());
    let fold = |part: usize| {
        let pick = |held: bool| {
            let own = logs.iter().enumerate().filter(move |(k, _)| (k % count == part) == held);
            own.map(|(_, experiment)| (*experiment).clone()).collect::<Vec<_>>()
        };
        Fold { fitted: pick(false), held_out: pick(true) }
    };
    (0..count).map(fold).collect()
}

/// Blocks of each log; the rest before and after the block is fitted.
fn by_block(logs: &[&Experiment]) -> Vec<Fold> {
    let mut folds = Vec::new();
    for (index, experiment) in logs.iter().enumerate() {
        let Some(log) = &experiment.log else { continue };
        let blocks = LOG_BLOCKS.div_ceil(logs.len()).max(2).min(log.len() / BLOCK_SAMPLES);
        if blocks < 2 {
            continue;
        }
        for block in 0..blocks {
            let edge = |k: usize| k * (log.len() - 1) / blocks;
            let (first, last) = (edge(block), edge(block + 1));
            let mut fitted: Vec<Experiment> =
                logs.iter().enumerate().filter(|(k, _)| *k != index).map(|(_, other)| (*other).clone()).collect();
            fitted.extend(cut(experiment, 0..first + 1));
            fitted.extend(cut(experiment, last..log.len()));
            folds.push(Fold { fitted, held_out: cut(experiment, first..last + 1).into_iter().collect() });
        }
    }
    folds
}

/// The name of a part of a log that begins at this row, or a pattern of all its parts with `*` in its place.
pub(crate) fn of_row(log: &str, row: impl Display) -> String {
    format!("{log} from row {row}")
}

/// Some rows of an experiment's log as an experiment; `None` if they are too few.
fn cut(experiment: &Experiment, rows: Range<usize>) -> Option<Experiment> {
    let log = experiment.log.as_ref()?;
    if rows.len() < BLOCK_SAMPLES / 2 {
        return None;
    }
    let begin = log.time[rows.start];
    let output = |output: &Output| Output { values: output.values[rows.clone()].to_vec(), ..output.clone() };
    let own = Log {
        time: log.time[rows.clone()].iter().map(|t| t - begin).collect(),
        inputs: log.inputs.iter().map(|input| input[rows.clone()].to_vec()).collect(),
        added: log.added.as_ref().map(|added| added[rows.clone()].to_vec()),
        reference: log.reference.as_ref().map(|reference| reference[rows.clone()].to_vec()),
        outputs: log.outputs.iter().map(output).collect(),
        ..(**log).clone()
    };
    let initial = if rows.start == 0 { experiment.initial } else { Default::default() };
    Some(Experiment {
        name: of_row(&experiment.name, rows.start + 1),
        inputs: own.signals(),
        until: own.time.last().copied().unwrap_or_default(),
        every: experiment.every,
        initial,
        log: Some(Arc::new(own)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use crate::solve::{Solver, simulate};

    /// A sensor that slips after a fifth of the block is an error of what is predicted, and does not move the start.
    #[test]
    fn the_start_of_a_block_is_fitted_to_its_first_tenth() {
        let (mut case, plan) = case(false);
        case.experiments[0].every = 1e-3;
        let run = simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap().trajectory;
        let logged = |slip: f64| {
            let mut own = case.experiments[0].clone();
            let log = Arc::make_mut(own.log.as_mut().unwrap());
            let column = |name: &str| run.get(name).unwrap().to_vec();
            (log.time, log.inputs) = (column("time"), vec![column("voltage")]);
            log.outputs.retain(|output| output.quantity == Quantity::CartPosition);
            let seen = |(k, x): (usize, f64)| x + 1e-6 * (2.1 * k as f64).sin() + if k < 100 { 0.0 } else { slip };
            log.outputs[0].values = column("cart_position").into_iter().enumerate().map(seen).collect();
            own
        };
        let fold = Fold { fitted: vec![logged(0.0)], held_out: vec![logged(1e-3)] };
        let (found, _) = errors(&case, &plan, &fold, (true, &Effort::compared(None)), None).unwrap();
        let (_, squares, count) = found[0];
        // 401 values are off by a millimetre.
        assert!(count == 501 && (squares / 401e-6 - 1.0).abs() < 0.02, "{found:?}");
    }
}

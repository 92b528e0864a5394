//! From what a case says to what is run.

use super::distribution::ends;
use super::points::Points;
use super::{DIMENSIONS, Distribution, Draws, Parameter, Sweep, headings};
use crate::case::{Case, Kinds, Origin, Prior, Sampling, Sweeping, Variation};
use crate::error::{Error, Result};
use crate::fit;
use crate::knob::{Breakaways, Knob, all_keys, parameter_of};
use std::path::Path;
use std::sync::Arc;

/// Most runs: numbers of runs stay exact in a column of doubles.
const MOST_RUNS: u64 = 1 << 53;

impl Sweep {
    /// What the case's `[sweep]` says. Errors: nothing to vary, parameters that exclude each other, more of them than Sobol' points have
    /// dimensions, a machine that cannot be run.
    pub fn new(case: &Case) -> Result<Self> {
        let Some(plan) = &case.sweep else {
            return Err(Error::new("this case does not say what is varied")
                .next("give for example --runs 1000 --vary cart.mass=20%, or add a table [sweep]"));
        };
        let stage = case.stage.clone();
        let draws = match &plan.from {
            Some(Origin::Posterior(file)) => Some(Arc::new(draws(case, file)?)),
            _ => None,
        };
        let chosen = chosen(case, plan, draws.as_deref())?;
        let mut parameters = Vec::new();
        let mut changes = Vec::new();
        for (place, (knob, variation)) in chosen.into_iter().enumerate() {
            if plan.design == Sampling::OneAtATime {
                changes.extend(around(&knob, &variation).into_iter().map(|value| (place, value)));
            }
            let distribution = distribution(&knob, &variation, plan.design)?;
            parameters.push(Parameter { knob, distribution });
        }
        let knobs = parameters.iter().map(|p: &Parameter| &p.knob).chain(draws.iter().flat_map(|draws| &draws.knobs));
        let keys: Vec<&str> = knobs.flat_map(|knob| &knob.keys).map(|(key, _)| key.as_str()).collect();
        let breakaways = Breakaways::of(&stage, &keys);
        let dimensions = if plan.indices { 2 * parameters.len() } else { parameters.len() };
        if plan.design == Sampling::Sobol && dimensions > DIMENSIONS {
            return Err(Error::new(format!("{} parameters need {dimensions} dimensions", parameters.len()))
                .allowed(format!("up to {DIMENSIONS} of a Sobol' sequence"))
                .next("vary fewer, or take design = \"latin-hypercube\" or \"random\""));
        }
        let samples = match plan.design {
            Sampling::Grid => parameters
                .iter()
                .try_fold(1u64, |product, parameter| product.checked_mul(parameter.distribution.values().len() as u64)),
            Sampling::OneAtATime => Some(changes.len() as u64 + 1),
            _ => plan.runs,
        };
        let each = if plan.indices { parameters.len() as u64 + 2 } else { 1 };
        let runs = samples.and_then(|samples| samples.checked_mul(each)).filter(|runs| *runs <= MOST_RUNS);
        let (Some(samples), Some(runs)) = (samples, runs) else {
            return Err(Error::new("these are more runs than can be counted")
                .allowed(format!("up to {MOST_RUNS}"))
                .next("take fewer values in the grid, or draw with design = \"sobol\""));
        };
        let points = match plan.design {
            Sampling::OneAtATime => Points::one_at_a_time(plan.seed, changes),
            design => Points::new(design, plan.seed, samples, parameters.len(), plan.indices),
        };
        let mut experiments = case.experiments.clone();
        for experiment in &mut experiments {
            // What was measured does not count here.
            experiment.log = None;
            experiment.every = plan.interval.unwrap_or(experiment.every);
        }
        let headings = headings(draws.as_deref(), &parameters, &experiments, &case.moves);
        let sweep = Self {
            stage,
            experiments,
            moves: case.moves.clone(),
            controller: case.controller.clone(),
            parameters,
            breakaways,
            draws,
            points,
            sampling: plan.design,
            indices: plan.indices,
            runs,
            headings,
        };
        sweep.check()?;
        Ok(sweep)
    }
}

/// What is varied by itself, with its knob.
fn chosen(case: &Case, plan: &Sweeping, draws: Option<&Draws>) -> Result<Vec<(Knob, Variation)>> {
    let stage = &case.stage;
    let named: Vec<&str> = plan.vary.iter().flat_map(|(name, _)| name.split(" = ")).collect();
    let knob = |name: &str| match name.starts_with("total.") {
        true => Knob::lumped(stage, name, &Vec::new()),
        false => Knob::tied(stage, &name.split(" = ").collect::<Vec<_>>(), &named, &Vec::new()),
    };
    let mut chosen: Vec<(Knob, Variation)> = Vec::new();
    for (name, variation) in plan.vary.iter().filter(|(name, _)| name != "all") {
        let knob = knob(name)?;
        let others = chosen.iter().map(|(other, _)| other).chain(draws.iter().flat_map(|draws| &draws.knobs));
        if let Some(other) = others.into_iter().find(|other| other.overlaps(&knob))
            && plan.design != Sampling::OneAtATime
        {
            return Err(Error::new(format!(
                "`{}` and `{}` turn the same number of the machine",
                other.name, knob.name
            ))
            .next("leave one of them out of [sweep.vary]"));
        }
        chosen.push((knob, variation.clone()));
    }
    if plan.from == Some(Origin::Uncertainty) {
        for known in case.known.iter().filter(|known| known.name.contains('.')) {
            let knob = knob(&known.name)?;
            if chosen.iter().any(|(other, _)| other.overlaps(&knob)) {
                continue;
            }
            let Some(deviation) = known.error else {
                return Err(Error::new(format!(
                    "the fit does not determine `{}`: it has no standard error",
                    known.name
                ))
                .next(format!("say in [sweep.vary] how \"{}\" varies", known.name)));
            };
            let prior = Prior::Normal { mean: knob.start, deviation };
            chosen.push((knob, Variation { kind: Kinds::Drawn(prior), within: None }));
        }
    }
    if let Some((_, variation)) = plan.vary.iter().find(|(name, _)| name == "all") {
        for key in all_keys(stage) {
            let knob = knob(&key)?;
            let others = chosen.iter().map(|(other, _)| other).chain(draws.iter().flat_map(|draws| &draws.knobs));
            if !others.into_iter().any(|other| other.overlaps(&knob)) {
                chosen.push((knob, variation.clone()));
            }
        }
    }
    Ok(chosen)
}

/// What a parameter may be: the range in the table of parameters, and what the plan says.
fn allowed(knob: &Knob, variation: &Variation) -> [f64; 2] {
    let row = knob.keys.first().and_then(|(key, _)| parameter_of(key)).filter(|_| !knob.name.starts_with("total."));
    let [low, high] = row.map_or([0.0, f64::MAX], |row| [row.range.low, row.range.high]);
    let [least, most] = variation.within.unwrap_or([low, high]);
    [low.max(least), high.min(most)]
}

fn distribution(knob: &Knob, variation: &Variation, design: Sampling) -> Result<Distribution> {
    let start = knob.start;
    let within = allowed(knob, variation);
    let inside = |values: Vec<f64>| match values.iter().find(|value| !(within[0]..=within[1]).contains(*value)) {
        None => Ok(Distribution::Values(values)),
        Some(value) => Err(Error::new(format!("`{}` cannot become {value} {}", knob.name, knob.unit))
            .allowed(format!("from {} to {} {}", within[0], within[1], knob.unit))),
    };
    let nothing = || {
        Error::new(format!("`{}` is 0, of which a share or a multiple is nothing", knob.name))
            .next("give it values: uniform(least, most), say, or values(a, b)")
    };
    let prior = match &variation.kind {
        // One at a time takes its values from the ends.
        _ if design == Sampling::OneAtATime => return inside(around(knob, variation)),
        Kinds::Values(values) => return inside(values.clone()),
        Kinds::Factors(_) | Kinds::Share(_) if start == 0.0 => return Err(nothing()),
        Kinds::Factors(factors) => return inside(factors.iter().map(|factor| factor * start).collect()),
        Kinds::Share(share) => {
            let (a, b) = (start * (1.0 - share), start * (1.0 + share));
            Prior::Uniform { low: a.min(b), high: a.max(b) }
        }
        Kinds::Drawn(prior) => *prior,
    };
    Distribution::drawn(prior, within).ok_or_else(|| {
        Error::new(format!("next to nothing of what `{}` is drawn from is allowed", knob.name))
            .allowed(format!("from {} to {} {}", within[0], within[1], knob.unit))
    })
}

/// The values that a parameter has one at a time.
fn around(knob: &Knob, variation: &Variation) -> Vec<f64> {
    let start = knob.start;
    match &variation.kind {
        Kinds::Values(values) => values.clone(),
        Kinds::Factors(factors) => factors.iter().map(|factor| factor * start).collect(),
        Kinds::Share(share) => vec![start * (1.0 + share), start * (1.0 - share)],
        Kinds::Drawn(prior) => ends(*prior).to_vec(),
    }
}

fn draws(case: &Case, file: &Path) -> Result<Draws> {
    let Some(fit) = &case.fit else {
        return Err(Error::new("draws of a posterior belong to the parameters of a table [fit], which is missing"));
    };
    let (knobs, columns, breakaways) = fit::drawn(case, fit, file)?;
    Ok(Draws { knobs, columns, breakaways })
}

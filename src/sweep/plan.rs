//! From what a case says to what is run.

use super::distribution::ends;
use super::points::Points;
use super::{DIMENSIONS, Distribution, Draws, Group, Parameter, Subject, Sweep, headings};
use crate::case::{Case, Kinds, Known, Origin, Prior, Sampling, Sweeping, Variation};
use crate::error::{Error, Result};
use crate::fit;
use crate::machine::Machine;
use crate::parameter::{Free, every};
use std::path::Path;
use std::sync::Arc;

/// Most runs: numbers of runs stay exact in a column of doubles.
const MOST_RUNS: u64 = 1 << 53;

impl Sweep {
    /// The sweep that `[sweep]` of an axis's case describes. Errors: nothing to vary, parameters that exclude each
    /// other, more of them than Sobol' points have dimensions, a machine that cannot be run.
    pub fn new(case: &Case) -> Result<Self> {
        case.complete()?;
        let plan = planned(case.sweep.as_ref())?;
        let draws = match &plan.from {
            Some(Origin::Posterior(file)) => Some(Arc::new(draws(case, plan, file)?)),
            _ => None,
        };
        let subject = Subject::new(case, plan);
        Self::planned(subject, plan, draws, &case.known)
    }

    fn planned(subject: Subject, plan: &Sweeping, draws: Option<Arc<Draws>>, known: &[Known]) -> Result<Self> {
        let machine = &subject.machine;
        let chosen = chosen(machine, known, plan, draws.as_deref())?;
        let mut parameters = Vec::new();
        let mut changes = Vec::new();
        for (place, (free, variation)) in chosen.into_iter().enumerate() {
            if plan.design == Sampling::OneAtATime {
                changes.extend(around(&free, &variation).into_iter().map(|value| (place, value)));
            }
            let distribution = distribution(machine, &free, &variation, plan.design)?;
            parameters.push(Parameter { free, distribution });
        }
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
        subject.check()?;
        let groups = subject.groups();
        told(plan, &groups)?;
        let headings = headings(draws.as_deref(), &parameters, &groups);
        let (sampling, indices) = (plan.design, plan.indices);
        Ok(Self { subject, groups, parameters, draws, points, sampling, indices, runs, headings })
    }
}

/// The sweep of a case.
fn planned(plan: Option<&Sweeping>) -> Result<&Sweeping> {
    plan.ok_or_else(|| {
        Error::new("this case has no parameters to vary")
            .next("give for example --runs 1000 --vary cart.mass=20%, or add a table [sweep]")
    })
}

/// Refuses figures that none of these has.
fn told(plan: &Sweeping, groups: &[Group]) -> Result<()> {
    let is_told = |name: &str| groups.iter().flat_map(|group| &group.figures).any(|figure| figure.name == name);
    match plan.figures.iter().flatten().find(|name| !is_told(name)) {
        None => Ok(()),
        Some(name) => Err(Error::new(format!("nothing that is swept has a figure \"{name}\""))
            .next("leave figures out: the columns of the result are named after all there are")),
    }
}

/// The keys that the plan names.
fn keys(plan: &Sweeping) -> impl Iterator<Item = &str> {
    plan.vary.iter().flat_map(|(name, _)| name.split(" = "))
}

/// The numbers that are varied by themselves, and how.
fn chosen(
    machine: &Machine,
    known: &[Known],
    plan: &Sweeping,
    draws: Option<&Draws>,
) -> Result<Vec<(Free, Variation)>> {
    let drawn = draws.iter().flat_map(|draws| &draws.free).flat_map(|free| &free.keys).map(|(key, _)| key.as_str());
    let estimates = known.iter().filter(|_| plan.from == Some(Origin::Uncertainty));
    let all: Vec<&str> = keys(plan).chain(drawn).chain(estimates.flat_map(|known| known.name.split(" = "))).collect();
    let free = |name: &str| Free::new(machine, name, &all, &[]);
    let mut chosen: Vec<(Free, Variation)> = Vec::new();
    for (name, variation) in plan.vary.iter().filter(|(name, _)| name != "all") {
        let free = free(name)?;
        let others = chosen.iter().map(|(other, _)| other).chain(draws.iter().flat_map(|draws| &draws.free));
        if let Some(other) = others.into_iter().find(|other| other.overlaps(&free))
            && plan.design != Sampling::OneAtATime
        {
            return Err(Error::new(format!("`{}` and `{}` set the same number of the machine", other.name, free.name))
                .next("leave one of them out of [sweep.vary]"));
        }
        chosen.push((free, variation.clone()));
    }
    if plan.from == Some(Origin::Uncertainty) {
        for known in known.iter().filter(|known| known.name.contains('.')) {
            let free = free(&known.name)?;
            if chosen.iter().any(|(other, _)| other.overlaps(&free)) {
                continue;
            }
            let Some(deviation) = known.error else {
                return Err(Error::new(format!(
                    "the fit does not determine `{}`: it has no standard error",
                    known.name
                ))
                .next(format!("say in [sweep.vary] how \"{}\" varies", known.name)));
            };
            let prior = Prior::Normal { mean: free.start, deviation };
            chosen.push((free, Variation { kind: Kinds::Drawn(prior), within: None }));
        }
    }
    if let Some((_, variation)) = plan.vary.iter().find(|(name, _)| name == "all") {
        for key in every(machine) {
            let free = free(&key)?;
            let others = chosen.iter().map(|(other, _)| other).chain(draws.iter().flat_map(|draws| &draws.free));
            if !others.into_iter().any(|other| other.overlaps(&free)) {
                chosen.push((free, variation.clone()));
            }
        }
    }
    Ok(chosen)
}

/// The range of a parameter: that in the table of parameters, and that of the plan.
fn allowed(machine: &Machine, free: &Free, variation: &Variation) -> [f64; 2] {
    let row = free.keys.first().and_then(|(key, _)| machine.row(key)).filter(|_| !free.name.starts_with("total."));
    let [low, high] = row.map_or([0.0, f64::MAX], |row| [row.range.low, row.range.high]);
    let [least, most] = variation.within.unwrap_or([low, high]);
    [low.max(least), high.min(most)]
}

fn distribution(machine: &Machine, free: &Free, variation: &Variation, design: Sampling) -> Result<Distribution> {
    let start = free.start;
    let within = allowed(machine, free, variation);
    let inside = |values: Vec<f64>| match values.iter().find(|value| !(within[0]..=within[1]).contains(*value)) {
        None => Ok(Distribution::Values(values)),
        Some(value) => Err(Error::new(format!("`{}` cannot become {value} {}", free.name, free.unit))
            .allowed(format!("from {} to {} {}", within[0], within[1], free.unit))),
    };
    let nothing = || {
        Error::new(format!("`{}` is 0, of which a share or a multiple is nothing", free.name))
            .next("give it values: uniform(least, most), say, or values(a, b)")
    };
    let prior = match &variation.kind {
        // One at a time takes its values from the ends.
        _ if design == Sampling::OneAtATime => return inside(around(free, variation)),
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
        Error::new(format!("almost the whole distribution of `{}` is outside the allowed range", free.name))
            .allowed(format!("from {} to {} {}", within[0], within[1], free.unit))
    })
}

/// The values that a parameter has one at a time.
fn around(free: &Free, variation: &Variation) -> Vec<f64> {
    let start = free.start;
    match &variation.kind {
        Kinds::Values(values) => values.clone(),
        Kinds::Factors(factors) => factors.iter().map(|factor| factor * start).collect(),
        Kinds::Share(share) => vec![start * (1.0 + share), start * (1.0 - share)],
        Kinds::Drawn(prior) => ends(*prior).to_vec(),
    }
}

fn draws(case: &Case, plan: &Sweeping, file: &Path) -> Result<Draws> {
    let Some(fit) = &case.fit else {
        return Err(Error::new("draws of a posterior belong to the parameters of a table [fit], which is missing"));
    };
    let (free, columns) = fit::drawn(case, fit, &keys(plan).collect::<Vec<_>>(), file)?;
    Ok(Draws { free, columns })
}

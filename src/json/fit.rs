//! A fit: `taut fit --json`, `fit.json`.

use super::number;
use crate::case::Case;
use crate::control::belts::Belts;
use crate::fit::{Cause, Combination, Estimate, Finding, Fit, Group, Profile, Score, Size};
use serde_json::{Value, json};

pub(super) fn score(score: Option<Score>) -> Value {
    score.map_or(Value::Null, |score| {
        json!({
            "count": score.count,
            "rmse": number(score.rmse),
            "worst": number(score.worst),
            "fit_percent": number(score.percent),
            "lag_one_correlation": number(score.memory),
        })
    })
}

/// A profile: where the parameter was held, and how much worse the logs were met.
fn profile(profile: &Profile) -> Value {
    json!({
        "name": profile.name,
        "unit": profile.unit,
        "values": profile.values,
        "growth": profile.growth,
        "linear": profile.linear,
    })
}

/// An element that the model lacks.
fn cause(found: &Cause) -> Value {
    let size = |size: &Size| {
        json!({
            "name": size.name, "unit": size.unit, "value": number(size.value), "standard_error": number(size.error),
        })
    };
    json!({
        "key": found.key,
        "words": found.words,
        "explained": number(found.explained),
        "standard_errors": number(found.standard_errors),
        "parameters": found.parameters.iter().map(size).collect::<Vec<_>>(),
        "estimates": found.estimates.iter().flatten().map(size).collect::<Vec<_>>(),
        "add": found.add,
        "parts_better": found.better[0],
        "parts": found.better[1],
    })
}

/// The statement of the looser belt.
pub(super) fn belts(belts: &Belts) -> Value {
    let names = belts.sides.names();
    json!({
        "drives": names,
        "stiffness_ratio": number(belts.ratio),
        "interval_95": belts.interval().map(number),
        "looser": belts.looser().map(|side| names[side]),
        "words": belts.words(),
    })
}

/// A warning or a note on a result.
pub(super) fn finding(finding: &Finding) -> Value {
    json!({ "grade": finding.grade.word(), "code": finding.code, "log": finding.log, "text": finding.text })
}

/// A combination that is determined of parameters that are not.
fn combination(combination: &Combination) -> Value {
    json!({
        "name": combination.name,
        "unit": combination.unit,
        "value": number(combination.value),
        "standard_error": number(combination.error),
        "interval_95": combination.interval.map(number),
    })
}

/// Parameters that the logs do not tell apart, and what to do about them.
pub(super) fn group(group: &Group, estimates: &[Estimate], choices: &[String]) -> Value {
    json!({
        "parameters": group.members.iter().map(|&j| &estimates[j].name).collect::<Vec<_>>(),
        "combinations_determined": group.determined,
        "combinations": group.combinations.iter().map(combination).collect::<Vec<_>>(),
        "words": group.words,
        "choices": choices,
    })
}

/// Estimates and how the logs are met; `profiles` are those that were made and `posterior` is what was drawn, if
/// anything was.
pub fn fit(case: &Case, fit: &Fit, profiles: &[Profile], posterior: Option<Value>) -> Value {
    let parameters: Vec<Value> = fit
        .estimates
        .iter()
        .map(|e| {
            json!({
                "name": e.name,
                "unit": e.unit,
                "value": number(e.value),
                "standard_error": e.error.map_or(Value::Null, number),
                "interval_95": e.interval.map_or(Value::Null, |[low, high]| json!([number(low), number(high)])),
                "determined": e.is_determined(),
                "at_bound": e.at_bound,
                "start": number(e.start),
                "bounds": [number(e.bounds[0]), number(e.bounds[1])],
                "sets": e.sets.iter().map(|(key, value)| json!({ "key": key, "value": number(*value) })).collect::<Vec<_>>(),
            })
        })
        .collect();
    let logs: Vec<Value> = fit
        .logs
        .iter()
        .map(|log| {
            json!({
                "name": log.name,
                "window": log.window,
                "held_out": log.held_out,
                "complete": log.complete,
                "outputs": log.outputs.iter().map(|output| json!({
                    "quantity": output.quantity.name(),
                    "unit": output.quantity.unit(),
                    "fitted": score(output.fitted),
                    "held_out": score(output.held_out),
                })).collect::<Vec<_>>(),
                "fitted_along": log.extras.iter().map(|(what, value, error)| json!({
                    "name": what.name(&fit.machine),
                    "value": number(*value),
                    "standard_error": error.map_or(Value::Null, number),
                })).collect::<Vec<_>>(),
            })
        })
        .collect();
    let correlation: Vec<Vec<Value>> =
        fit.correlation.iter().map(|row| row.iter().map(|v| number(*v)).collect()).collect();
    let not_determined: Vec<Value> = fit
        .identifiability
        .iter()
        .flat_map(|known| {
            known.groups.iter().zip(&fit.choices).map(|(own, choices)| group(own, &fit.estimates, choices))
        })
        .collect();
    json!({
        "schema": super::identity("fit"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "ending": fit.ending_word(),
        "converged": fit.is_converged(),
        "reliable": fit.is_reliable(),
        "findings": fit.findings.iter().map(finding).collect::<Vec<_>>(),
        "last_step_standard_errors": number(fit.decrement),
        "cost": number(fit.cost),
        "kink_gradients": fit.pieces,
        "evolutions": fit.evolved,
        "starts": fit.starts.iter().map(|cost| number(*cost)).collect::<Vec<_>>(),
        "values": fit.values,
        "variables": fit.variables,
        "parameters": parameters,
        "not_determined": not_determined,
        "belts": fit.belts().as_ref().map(belts),
        "disagreement": fit.disagreement.as_ref().map(|found| json!({
            "windows": found.windows,
            "length_s": number(found.length),
            "standard_errors": found.off.iter().map(|off| number(*off)).collect::<Vec<_>>(),
        })),
        "other_law": fit.other_law.as_ref().map(|found| json!({
            "key": found.key,
            "body": found.body,
            "words": found.words,
            "explained": number(found.explained),
            "standard_errors": number(found.standard_errors),
            "moves_standard_errors": found.off.iter().map(|off| number(*off)).collect::<Vec<_>>(),
        })),
        "cause": fit.cause.as_ref().map(cause),
        "correlation": correlation,
        "residual_deviation": fit.noise.iter().map(|(quantity, deviation)| json!({
            "quantity": quantity.name(), "unit": quantity.unit(), "value": number(*deviation),
        })).collect::<Vec<_>>(),
        "logs": logs,
        "profiles": profiles.iter().map(profile).collect::<Vec<_>>(),
        "posterior": posterior,
        "work": {
            "iterations": fit.work.iterations,
            "evaluations": fit.work.evaluations,
            "simulations": fit.work.simulations,
        },
    })
}

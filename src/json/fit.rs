//! A fit: `taut fit --json`, `fit.json`.

use super::number;
use crate::case::Case;
use crate::fit::{Ending, Fit, Profile, Score};
use serde_json::{Value, json};

fn score(score: Option<Score>) -> Value {
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

/// Estimates and how the logs are met; `profiles` are those that were made and `posterior` is what was drawn, if anything was.
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
                "determined": e.error.is_some_and(f64::is_finite),
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
                    "name": what.name(),
                    "value": number(*value),
                    "standard_error": error.map_or(Value::Null, number),
                })).collect::<Vec<_>>(),
            })
        })
        .collect();
    let correlation: Vec<Vec<Value>> =
        fit.correlation.iter().map(|row| row.iter().map(|v| number(*v)).collect()).collect();
    json!({
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "ending": fit.ending.word(),
        "converged": fit.ending == Ending::Converged,
        "last_step_standard_errors": number(fit.decrement),
        "cost": number(fit.cost),
        "starts": fit.starts.iter().map(|cost| number(*cost)).collect::<Vec<_>>(),
        "values": fit.values,
        "variables": fit.variables,
        "parameters": parameters,
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

//! The result as data: what `--json` prints and `fit.json` holds. Everything is in SI units.

use super::Found;
use serde_json::{Value, json};
use taut::case::Case;
use taut::fit::{Posterior, Profile, Score};

/// Numbers that JSON has no word for are null.
fn number(value: f64) -> Value {
    if value.is_finite() { json!(value) } else { Value::Null }
}

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

/// What was drawn.
fn drawn(posterior: &Posterior) -> Value {
    json!({
        "converged": posterior.doubts().is_empty(),
        "doubts": posterior.doubts(),
        "chains": posterior.draws.chains.len(),
        "draws": posterior.count(),
        "divergences": posterior.draws.divergences,
        "evaluations": posterior.draws.evaluations,
        "interrupted": posterior.draws.interrupted,
        "inflation": number(posterior.inflation),
        "fixed_slopes": posterior.fixed_slopes,
        "parameters": posterior.variables.iter().map(|variable| json!({
            "name": variable.name,
            "unit": variable.unit,
            "mean": number(variable.mean),
            "standard_deviation": number(variable.deviation),
            "median": number(variable.median),
            "interval_95": variable.interval.map(number),
            "r_hat": number(variable.r_hat),
            "effective_draws": number(variable.effective),
        })).collect::<Vec<_>>(),
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

/// The text.
pub fn text(case: &Case, found: &Found) -> String {
    let fit = &found.fit;
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
    let value = json!({
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "ending": fit.ending.word(),
        "converged": fit.ending == taut::fit::Ending::Converged,
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
        "profiles": found.profiles.iter().map(profile).collect::<Vec<_>>(),
        "posterior": found.drawn.as_ref().map_or(Value::Null, drawn),
        "work": {
            "iterations": fit.work.iterations,
            "evaluations": fit.work.evaluations,
            "simulations": fit.work.simulations,
        },
    });
    let mut text = serde_json::to_string_pretty(&value).unwrap_or_default();
    text.push('\n');
    text
}

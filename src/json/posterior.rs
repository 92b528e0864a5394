//! The posterior of a fit: part of `taut fit --posterior --json`.

use super::number;
use crate::fit::Posterior;
use serde_json::{Value, json};

/// Draws from the posterior of a fit, and whether to believe them.
pub fn posterior(posterior: &Posterior) -> Value {
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

//! Which single change explains logs: `taut fit --drift --json`, `drift.json`.

use super::number;
use crate::case::Case;
use crate::fit::{Change, Drift, Together};
use serde_json::{Value, json};

fn error(one: &Together) -> Value {
    json!({
        "quantity": one.quantity.name(),
        "unit": one.quantity.unit(),
        "held_out": one.held_out,
        "count": one.count,
        "rmse": number(one.rmse),
    })
}

fn errors(all: &[Together]) -> Vec<Value> {
    all.iter().map(error).collect()
}

fn change(change: &Change) -> Value {
    let estimate = &change.estimate;
    json!({
        "name": estimate.name,
        "unit": estimate.unit,
        "from": number(estimate.start),
        "to": number(estimate.value),
        "standard_error": estimate.error.map_or(Value::Null, number),
        "at_bound": estimate.at_bound,
        "shown": change.is_shown(),
        "left": number(change.left),
        "errors": errors(&change.errors),
    })
}

/// The errors of the machine as it is, and with each single change.
pub fn drift(case: &Case, drift: &Drift) -> Value {
    json!({
        "schema": super::identity("drift"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "changed": drift.is_changed(),
        "unchanged": errors(&drift.unchanged),
        "changes": drift.changes.iter().map(change).collect::<Vec<_>>(),
        "work": {
            "iterations": drift.work.iterations,
            "evaluations": drift.work.evaluations,
            "simulations": drift.work.simulations,
        },
    })
}

//! The information in logs: `taut check --json`.

use super::number;
use crate::case::Case;
use crate::fit::Check;
use serde_json::{Value, json};

/// The findings of each log, how well each parameter would be known, which combinations nothing tells apart.
pub fn check(case: &Case, found: &Check) -> Value {
    let known = found.identifiability.as_ref();
    json!({
        "schema": super::identity("check"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "complete": known.is_some_and(|known| known.complete()),
        "parameters": found.fit.estimates.iter().enumerate().map(|(j, estimate)| json!({
            "name": estimate.name,
            "relative_error": estimate.error.map_or(Value::Null, |error| number((error / estimate.value).abs())),
            "determined": known.is_some_and(|known| known.error[j].is_finite()),
            "at_bound": estimate.at_bound,
            "sensitivity": known.map_or(Value::Null, |known| number(known.sensitivity[j])),
        })).collect::<Vec<_>>(),
        "regression": found.balance.map(|b| json!({
            "inertia_kg_m2": b.inertia,
            "viscous_N_m_s_rad": b.viscous,
            "coulomb_N_m": b.coulomb,
            "load_N_m": -b.load,
            "errors": b.errors,
            "unexplained": b.unexplained,
            "equations": b.equations,
        })),
        "singular_values": known.iter().flat_map(|known| &known.singular).map(|s| number(*s)).collect::<Vec<_>>(),
        "not_determined": known.iter()
            .flat_map(|known| known.groups.iter().zip(&found.choices))
            .map(|(own, choices)| super::fit::group(own, &found.fit.estimates, choices))
            .collect::<Vec<_>>(),
        "findings": found.fit.findings.iter().map(super::fit::finding).collect::<Vec<_>>(),
        "logs": found.logs.iter().map(|log| json!({
            "name": log.log,
            "samples": log.timing.samples,
            "duration_s": log.timing.duration,
            "interval_s": log.timing.interval,
            "notes": log.notes.iter().map(|note| json!({
                "code": note.code,
                "severity": note.severity.word(),
                "column": note.column,
                "text": note.text,
            })).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "experiments": found.experiments.iter().map(|experiment| json!({
            "name": experiment.name,
            "told": experiment.told,
            "determined": experiment.determined,
        })).collect::<Vec<_>>(),
    })
}

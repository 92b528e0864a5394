//! Friction laws and windows beside each other: `taut fit --compare --json`, `compare.json`.

use super::number;
use crate::fit::compare::{Candidate, Comparison};
use serde_json::{Value, json};

fn candidate(candidate: &Candidate) -> Value {
    json!({
        "name": candidate.name(),
        "law": candidate.law.name(),
        "asymmetric": candidate.sided,
        "window_s": candidate.window,
        "parameters": candidate.parameters,
        "training_rmse": number(candidate.training),
        "held_out_rmse": number(candidate.held_out),
        "difference_standard_error": number(candidate.error),
        "part_mean_squares": candidate.squares.iter().map(|square| number(*square)).collect::<Vec<_>>(),
        "failed": candidate.failed,
    })
}

/// The candidates, which is chosen and why, and the fit with it.
pub fn comparison(comparison: &Comparison) -> Value {
    json!({
        "schema": super::identity("compare"),
        "title": comparison.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "body": comparison.body,
        "quantities": comparison.quantities.iter().map(|quantity| json!({
            "quantity": quantity.name(), "unit": quantity.unit(),
        })).collect::<Vec<_>>(),
        "held_out": comparison.held_out,
        "candidates": comparison.candidates.iter().map(candidate).collect::<Vec<_>>(),
        "chosen": comparison.chosen,
        "by_training": comparison.by_training,
        "words": comparison.words(),
        "fit": super::fit(&comparison.case, &comparison.fit, &[], None),
        "work": {
            "iterations": comparison.work.iterations,
            "evaluations": comparison.work.evaluations,
            "simulations": comparison.work.simulations,
        },
    })
}

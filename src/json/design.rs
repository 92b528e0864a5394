//! A designed experiment: `taut design --json`, `design.json`.

use super::number;
use crate::case::Case;
use crate::fit::experiment_design::{Designed, Limits, Verified};
use serde_json::{Value, json};

/// The experiment, what it promises, and what else was looked at.
pub fn design(case: &Case, found: &Designed, verified: &[Verified]) -> Value {
    let Limits { input, current, travel, margin, .. } = &found.limits;
    let limit = |(value, origin): (f64, crate::fit::experiment_design::Origin)| json!({ "value": value, "origin": origin.words() });
    let reached = &found.reached;
    let geometry = case.machine.geometry();
    // Of an axis there is the cart alone, of a gantry the bridge before it.
    let cart = geometry.slides.len() - 1;
    let start = |slide: usize| found.initial.position[geometry.slides[slide].body];
    let bridge = (cart > 0).then(|| {
        json!({
            "start_m": start(0),
            "from_m": reached.positions[0][0],
            "to_m": reached.positions[0][1],
            "travel_m": limit(travel[0]),
        })
    });
    let driven = |driven: &crate::fit::experiment_design::Driven| match driven.name {
        "" => Value::Null,
        name => name.into(),
    };
    json!({
        "schema": super::identity("design"),
        "title": case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "name": found.name,
        "input": found.shape.kind().word(),
        "drive": driven(&found.driven),
        "words": found.driven.words(&found.shape, found.unit),
        "toml": found.toml(&case.machine),
        "duration_s": found.duration,
        "every_s": found.every,
        "start_m": start(cart),
        "bridge": bridge,
        "criterion": found.criterion.word(),
        "mean_relative_error": number(found.score),
        "complete": found.promises.iter().filter(|promise| promise.wanted).all(|promise| promise.is_determined()),
        "interrupted": found.interrupted,
        "tried": found.tried,
        "parameters": found.promises.iter().map(|promise| json!({
            "name": promise.name,
            "unit": promise.unit,
            "value": promise.value,
            "standard_error": number(promise.error),
            "relative_error": number(promise.relative),
            "random_error": number(promise.random),
            "determined": promise.is_determined(),
            "counts": promise.wanted,
        })).collect::<Vec<_>>(),
        "not_determined": found.undetermined.iter().map(|(group, choices)| json!({
            "parameters": group.members.iter()
                .filter_map(|&j| found.promises.get(j).map(|promise| promise.name.clone())).collect::<Vec<_>>(),
            "words": group.words,
            "choices": choices,
        })).collect::<Vec<_>>(),
        "limits": {
            "input": limit(*input),
            "current_A": current.map(limit),
            "travel_m": limit(travel[cart]),
            "margin": margin,
            "doubt": found.doubt,
        },
        "model_error": found.model_error,
        "reached": {
            "input": reached.input,
            "current_A": reached.current,
            "from_m": reached.positions[cart][0],
            "to_m": reached.positions[cart][1],
            "speed_m_per_s": reached.speed,
        },
        "measured": found.measured.iter().map(|channel| json!({
            "quantity": channel.quantity.name(),
            "unit": channel.quantity.unit(),
            "step": channel.step,
            "noise": channel.noise,
        })).collect::<Vec<_>>(),
        "inputs": found.alternatives.iter().map(|one| json!({
            "input": one.shape.kind().word(),
            "drive": driven(&one.driven),
            "words": one.driven.words(&one.shape, found.unit),
            "mean_relative_error": number(one.score),
            "refined": one.refined,
        })).collect::<Vec<_>>(),
        "experiments": found.own.iter().map(|own| json!({
            "name": own.name,
            "duration_s": own.duration,
            "mean_relative_error": number(own.score),
            "determined": own.determined,
        })).collect::<Vec<_>>(),
        "verified": verified.iter().map(|one| json!({
            "name": one.name,
            "error_over_promise": number(one.ratio),
            "bias_over_promise": number(one.bias),
            "coverage_95": one.coverage,
            "fits": one.fits,
        })).collect::<Vec<_>>(),
    })
}

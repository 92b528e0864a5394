//! How a gantry swings: `taut modes --json`, `modes.json`. Frequencies are in Hz where they say so.

use super::{
    modes::{matrix, root_told, transfer, variable},
    number,
};
use crate::linear::{GantryAnalysis, Natural};
use crate::mechanism::Mechanism;
use serde_json::{Map, Value, json};

/// Rigid and elastic modes, and the map of the working area.
pub fn gantry_modes(analysis: &GantryAnalysis) -> Value {
    let gantry = &analysis.case.machine;
    let mechanism = gantry.mechanism();
    let modes = &analysis.modes;
    let spans = gantry.kind.geometry().span_labels().zip(&gantry.belt.stiffness);
    let elastic = modes.elastic.iter().map(|mode| {
        json!({
            "frequency_Hz": mode.hertz(),
            "frequency_rad_s": mode.frequency,
            "damping_ratio": mode.damping().map_or(Value::Null, number),
            "damped": mode.damped.map_or(Value::Null, root_told),
            "shape_at_belt": by_body(&mechanism, modes, &mode.shape, |key, _| key.into()),
            "energy_share": by_body(&mechanism, modes, &mode.energy, |key, _| key.into()),
        })
    });
    let rigid = modes.rigid.iter().map(|mode| {
        json!({
            "body": mechanism.bodies[mode.body].label.key,
            "shape": by_body(&mechanism, modes, &mode.shape, |key, unit| format!("{key}_{unit}")),
        })
    });
    json!({
        "schema": super::identity("gantry-modes"),
        "title": analysis.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "kind": gantry.kind.word(),
        "assumptions": analysis.words,
        "here": {
            "bridge_position_m": 0.0,
            "cart_position_m": 0.0,
            "span_stiffness_newton_per_m": spans.map(|(span, k)| (span.key.to_string(), number(*k))).collect::<Map<_, _>>(),
        },
        "rigid": rigid.collect::<Vec<_>>(),
        "elastic": elastic.collect::<Vec<_>>(),
        "inputs": analysis.by_input.iter().map(|one| json!({
            "name": one.system.input.name,
            "unit": one.system.input.unit,
            "outputs": one.system.outputs.iter().zip(&one.transfers).map(transfer).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "states": analysis.system.states.iter().map(variable).collect::<Vec<_>>(),
        "outputs": analysis.system.outputs.iter().map(variable).collect::<Vec<_>>(),
        "A": matrix(&analysis.system.a),
        "B": matrix(&analysis.system.b),
        "C": matrix(&analysis.system.c),
        "D": matrix(&analysis.system.d),
        "poles": modes.poles.iter().map(|root| root_told(*root)).collect::<Vec<_>>(),
        "stiffness_depends_on_position": analysis.map.is_some(),
        "map": analysis.map.as_ref().map(|map| json!({
            "bridge_position_m": map.bridge,
            "cart_position_m": map.cart,
            "elastic_Hz": map.hertz,
        })),
    })
}

/// Values of the bodies by their keys.
fn by_body(
    mechanism: &Mechanism,
    modes: &Natural,
    values: &[f64],
    name: impl Fn(&str, &str) -> String,
) -> Map<String, Value> {
    let body = |(body, value): (&usize, &f64)| {
        let body = &mechanism.bodies[*body];
        (name(body.label.key, body.kind.units()[0]), number(*value))
    };
    modes.bodies.iter().zip(values).map(body).collect()
}

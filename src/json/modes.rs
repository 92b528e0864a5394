//! A linear analysis: `taut modes --json`, `modes.json`. Frequencies are in Hz where they say so.

use super::number;
use crate::linear::{
    Analysis, ByInput, Discrete, ElasticMode, Natural, ResonancesAt, RigidMode, Root, Transfer, Variable,
};
use crate::mechanism::Mechanism;
use nalgebra::{Complex, DMatrix, DVector};
use serde_json::{Map, Value, json};
use std::f64::consts::PI;

/// Matrices, poles, zeros and modes of any machine; resonances along the travel of an axis, over the area of a gantry.
pub fn modes(analysis: &Analysis) -> Value {
    let (system, operation) = (&analysis.system, analysis.operation);
    let machine = &analysis.case.machine;
    let mechanism = machine.mechanism();
    let bodies = operation.held.iter().zip(machine.geometry().bodies);
    let stuck: Vec<&str> = bodies.filter(|(held, _)| **held).map(|(_, body)| body.label.key).collect();
    let mut told = json!({
        "schema": super::identity("modes"),
        "title": analysis.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "kind": machine.kind.word(),
        "operation": {
            "speed_m_s": operation.speed,
            "position_m": operation.position,
            "bridge_position_m": machine.bridge.as_ref().map(|_| operation.bridge),
            "stuck": stuck,
            "sticks_at_rest": analysis.sticks,
            "assumptions": analysis.words,
        },
        "inputs": analysis.inputs.iter().map(input).collect::<Vec<_>>(),
        "states": system.states.iter().map(variable).collect::<Vec<_>>(),
        "outputs": system.outputs.iter().map(variable).collect::<Vec<_>>(),
        "A": matrix(&system.a),
        "B": matrix(&system.b),
        "C": matrix(&system.c),
        "D": matrix(&system.d),
        "poles": analysis.poles.iter().map(pole).collect::<Vec<_>>(),
        "rigid": analysis.modes.as_ref().map(|modes| rigid(&mechanism, modes)),
        "elastic": analysis.modes.as_ref().map(|modes| elastic(&mechanism, modes)),
        "stiffness_depends_on_position": analysis.travel.is_some() || analysis.map.is_some(),
        "here": place(&analysis.here),
        "travel": analysis.travel.as_ref().map(|travel| travel.iter().map(place).collect::<Vec<_>>()),
        "map": analysis.map.as_ref().map(|map| json!({
            "bridge_position_m": map.bridge,
            "cart_position_m": map.cart,
            "elastic_Hz": map.hertz,
        })),
    });
    // Where there is one input, its keys stand at the top too, as programs that know axes alone expect them.
    if let [one] = &analysis.inputs[..] {
        told["input"] = variable(&one.system.input);
        told["outputs"] = one.system.outputs.iter().zip(&one.transfers).map(transfer).collect();
        told["discrete"] = one.discrete.as_ref().map_or(Value::Null, |model| discrete(model, &one.system.outputs));
    }
    told
}

/// The effect of an input.
fn input(one: &ByInput) -> Value {
    let ByInput { system, transfers, discrete, .. } = one;
    json!({
        "name": system.input.name,
        "unit": system.input.unit,
        "outputs": system.outputs.iter().zip(transfers).map(transfer).collect::<Vec<_>>(),
        "discrete": discrete.as_ref().map(|model| self::discrete(model, &system.outputs)),
    })
}

/// Motions that stretch nothing.
fn rigid(mechanism: &Mechanism, modes: &Natural) -> Vec<Value> {
    let told = |mode: &RigidMode| {
        json!({
            "body": mechanism.bodies[mode.body].label.key,
            "shape": by_body(mechanism, modes, &mode.shape, |key, unit| format!("{key}_{unit}")),
        })
    };
    modes.rigid.iter().map(told).collect()
}

/// Motions that swing.
fn elastic(mechanism: &Mechanism, modes: &Natural) -> Vec<Value> {
    let told = |mode: &ElasticMode| {
        json!({
            "frequency_Hz": mode.hertz(),
            "frequency_rad_s": mode.frequency,
            "damping_ratio": mode.damping().map_or(Value::Null, number),
            "shape_at_belt": by_body(mechanism, modes, &mode.shape, |key, _| key.into()),
            "energy_share": by_body(mechanism, modes, &mode.energy, |key, _| key.into()),
        })
    };
    modes.elastic.iter().map(told).collect()
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

/// The transfer from the input to an output.
fn transfer((output, transfer): (&Variable, &Transfer)) -> Value {
    let (integrators, gain) = transfer.low_frequency();
    json!({
        "name": output.name,
        "unit": output.unit,
        "zeros": transfer.zeros.values.iter().map(root).collect::<Vec<_>>(),
        "gain": number(transfer.zeros.gain),
        "integrators": integrators,
        "low_frequency_gain": number(gain),
    })
}

pub(super) fn variable(variable: &Variable) -> Value {
    json!({ "name": variable.name, "unit": variable.unit })
}

pub(super) fn matrix(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

/// A matrix of one column.
fn column(vector: &DVector<f64>) -> Vec<Vec<f64>> {
    vector.iter().map(|value| vec![*value]).collect()
}

fn root(value: &Complex<f64>) -> Value {
    json!({ "re": value.re, "im": value.im })
}

fn pole(value: &Complex<f64>) -> Value {
    let size = value.norm();
    json!({
        "re": value.re,
        "im": value.im,
        "frequency_rad_s": size,
        "frequency_Hz": size / (2.0 * PI),
        "damped_frequency_Hz": value.im.abs() / (2.0 * PI),
        "damping_ratio": if size > 0.0 { number(-value.re / size) } else { Value::Null },
        "time_constant_s": if value.re == 0.0 { Value::Null } else { number(-1.0 / value.re) },
        "integrator": size == 0.0,
    })
}

fn pair(frequency: f64, damping: f64, root: Root) -> Value {
    json!({
        "frequency_Hz": frequency / (2.0 * PI),
        "damped_frequency_Hz": root.damped_hertz().map_or(Value::Null, number),
        "damping_ratio": damping,
    })
}

fn place(place: &ResonancesAt) -> Value {
    let pairs = |roots: &[Root]| -> Vec<Value> {
        let told = |root: &Root| match *root {
            Root::Pair { frequency, damping } => Some(pair(frequency, damping, *root)),
            _ => None,
        };
        roots.iter().filter_map(told).collect()
    };
    json!({
        "position_m": place.position,
        "bridge_position_m": place.bridge,
        "stiffness_newton_per_m": place.stiffness.iter().map(|k| number(*k)).collect::<Vec<_>>(),
        "resonances": pairs(&place.resonances),
        "antiresonances": pairs(&place.antiresonances),
        "undamped_resonances_Hz": place.undamped_resonances,
        "undamped_antiresonances_Hz": place.undamped_antiresonances,
    })
}

fn discrete(model: &Discrete, outputs: &[Variable]) -> Value {
    let zeros: Vec<Value> = outputs
        .iter()
        .enumerate()
        .filter_map(|(index, output)| {
            let found = model.zeros(index)?.ok()?;
            Some(json!({
                "name": output.name,
                "zeros": found.values.iter().map(root).collect::<Vec<_>>(),
                "gain": number(found.gain),
            }))
        })
        .collect();
    json!({
        "sample_time_s": model.sample_time,
        "hold": model.hold.words(),
        "delay_s": model.delay,
        "states": model.states,
        "outputs": zeros,
        "poles": model.poles().iter().map(root).collect::<Vec<_>>(),
        "A": matrix(&model.a),
        "B": column(&model.b),
        "C": matrix(&model.c),
        "D": column(&model.d),
    })
}

//! A linear analysis: `taut modes --json`, `modes.json`. Frequencies are in Hz where they say so.

use super::number;
use crate::linear::{Analysis, Discrete, Place, Root, Transfer, Variable};
use crate::machine::axis::LABELS;
use nalgebra::{Complex, DMatrix, DVector};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Matrices, poles, zeros, resonances along the travel.
pub fn modes(analysis: &Analysis) -> Value {
    let system = &analysis.system;
    let operation = analysis.operation;
    let outputs: Vec<Value> = system.outputs.iter().zip(&analysis.transfers).map(transfer).collect();
    let stuck: Vec<&str> =
        operation.held.iter().zip(LABELS).filter(|(held, _)| **held).map(|(_, label)| label.key).collect();
    json!({
        "schema": super::identity("modes"),
        "title": analysis.case.title,
        "version": env!("CARGO_PKG_VERSION"),
        "operation": {
            "speed_m_s": operation.speed,
            "position_m": operation.position,
            "stuck": stuck,
            "sticks_at_rest": analysis.sticks,
            "assumptions": analysis.words,
        },
        "input": variable(&system.input),
        "states": system.states.iter().map(variable).collect::<Vec<_>>(),
        "outputs": outputs,
        "A": matrix(&system.a),
        "B": column(&system.b),
        "C": matrix(&system.c),
        "D": column(&system.d),
        "poles": analysis.transfers.first().map_or(Vec::new(), poles),
        "stiffness_depends_on_position": analysis.travel.is_some(),
        "here": place(&analysis.here),
        "travel": analysis.travel.as_ref().map(|travel| travel.iter().map(place).collect::<Vec<_>>()),
        "discrete": analysis.discrete.as_ref().map(|model| discrete(model, &system.outputs)),
    })
}

/// The transfer from the input to an output.
pub(super) fn transfer((output, transfer): (&Variable, &Transfer)) -> Value {
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

fn poles(transfer: &Transfer) -> Vec<Value> {
    let one = |value: &Complex<f64>| {
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
    };
    transfer.poles.iter().map(one).collect()
}

/// A pole, or a pair of them.
pub(super) fn root_told(root: Root) -> Value {
    let time = number(root.time_constant());
    match root {
        Root::Zero => json!({ "integrator": true }),
        Root::Real(s) => json!({ "re": s, "time_constant_s": time }),
        Root::Pair { frequency, damping } => {
            let mut told = pair(frequency, damping, root);
            told["time_constant_s"] = time;
            told
        }
    }
}

fn pair(frequency: f64, damping: f64, root: Root) -> Value {
    json!({
        "frequency_Hz": frequency / (2.0 * PI),
        "damped_frequency_Hz": root.damped_hertz().map_or(Value::Null, number),
        "damping_ratio": damping,
    })
}

fn place(place: &Place) -> Value {
    let pairs = |roots: &[Root]| -> Vec<Value> {
        let told = |root: &Root| match *root {
            Root::Pair { frequency, damping } => Some(pair(frequency, damping, *root)),
            _ => None,
        };
        roots.iter().filter_map(told).collect()
    };
    json!({
        "position_m": place.position,
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

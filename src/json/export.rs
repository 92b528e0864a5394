//! A model as data: `taut export json`; and what the other targets wrote: `taut export --json`.

use super::modes::{matrix, variable};
use super::number;
use crate::case::Case;
use crate::error::Result;
use crate::export::{self, ElementKind, Exported, Row, Tables, Then};
use crate::linear::{Operation, System};
use crate::machine::Machine;
use crate::mechanism::{Mechanism, MotionKind, Over, SpringLaw};
use crate::parameter;
use serde_json::{Value, json};

/// Parameters, parts, equations of every mode and the linear model.
pub fn export(case: &Case) -> Result<Value> {
    let mechanism = export::mechanism(case);
    let (kind, numbers) = (case.machine.kind.word(), &case.machine);
    let equations = match mechanism.is_piecewise_linear() {
        true => Some(equations(&Tables::new(&mechanism)?)),
        false => None,
    };
    let linear = linear(&System::new(&case.machine, Operation::default())?);
    Ok(json!({
        "schema": super::identity("export"),
        "title": case.title.as_str(),
        "version": env!("CARGO_PKG_VERSION"),
        "kind": kind,
        "case": case.text.as_str(),
        "parameters": parameters(numbers),
        "bodies": bodies(&mechanism),
        "springs": springs(&mechanism),
        "equations": equations,
        "linear": linear,
    }))
}

/// Files that were written for a target.
pub fn exported(title: &str, target: &str, exported: &Exported) -> Value {
    let file = |(name, content): &(String, Vec<u8>)| json!({ "name": name, "bytes": content.len() });
    let facts = exported.facts.iter().map(|(name, value)| json!({ "name": name, "value": value }));
    json!({
        "schema": super::identity("exported"),
        "title": title,
        "version": env!("CARGO_PKG_VERSION"),
        "target": target,
        "files": exported.files.iter().map(file).collect::<Vec<_>>(),
        "facts": facts.collect::<Vec<_>>(),
        "notes": exported.notes,
    })
}

fn parameters(machine: &Machine) -> Vec<Value> {
    let one = |(key, value): (String, f64)| {
        let row = parameter::find(&key).or_else(|| parameter::named(&key));
        json!({
            "key": key,
            "value": number(value),
            "unit": row.map_or("", |row| row.unit),
            "symbol": row.map_or("", |row| row.symbol),
            "about": row.map_or("", |row| row.sentence),
        })
    };
    parameter::values(machine).into_iter().map(one).collect()
}

fn bodies(mechanism: &Mechanism) -> Vec<Value> {
    let one = |body: &crate::mechanism::Body| {
        let [way, speed, load] = body.kind.units();
        json!({
            "key": body.label.key,
            "name": body.label.name,
            "inertia": body.inertia,
            "radius_m": match body.kind { MotionKind::Rotary { radius } => json!(radius), MotionKind::Linear => Value::Null },
            "units": { "position": way, "speed": speed, "load": load },
        })
    };
    mechanism.bodies.iter().map(one).collect()
}

fn springs(mechanism: &Mechanism) -> Vec<Value> {
    let one = |spring: &crate::mechanism::Spring| {
        let law = match &spring.law {
            SpringLaw::TwoSided => json!({ "kind": "two-sided" }),
            SpringLaw::Tension { pretension } => json!({ "kind": "tension", "pretension_newton": pretension }),
            SpringLaw::Gap { low, high } => json!({ "kind": "gap", "low": number(*low), "high": number(*high) }),
            SpringLaw::Line { over, line } => {
                json!({ "kind": if *over == Over::Length { "line-over-length" } else { "line-over-rate" }, "points": line.points() })
            }
            SpringLaw::Bounds { low, high } => json!({ "kind": "bounds", "low": number(*low), "high": number(*high) }),
            SpringLaw::Angle { .. } | SpringLaw::None => json!({ "kind": "none" }),
        };
        let arm = |&(body, arm): &(usize, f64)| json!({ "body": mechanism.bodies[body].label.key, "arm": arm });
        json!({
            "key": spring.label.key,
            "name": spring.label.name,
            "stiffness": spring.stiffness,
            "damping": spring.damping,
            "law": law,
            "arms": spring.arms.iter().map(arm).collect::<Vec<_>>(),
        })
    };
    mechanism.springs.iter().map(one).collect()
}

/// The equations of every mode, as tables.
fn equations(tables: &Tables) -> Value {
    let element = |element: &export::Element| {
        let kind = match element.kind {
            ElementKind::Body(_) => "body",
            ElementKind::GearTorque(_) => "gear-torque",
            ElementKind::Voltage(_) => "voltage-limit",
            ElementKind::Current(_) => "current-limit",
            ElementKind::Phase(..) => "phase-limit",
            ElementKind::Span(_) => "span",
            ElementKind::Gap(_) => "gap",
            ElementKind::Line(_) => "line",
        };
        json!({
            "key": element.key,
            "kind": kind,
            "states": element.states.iter().map(|does| does.word()).collect::<Vec<_>>(),
        })
    };
    let guard = |guard: &export::TableGuard| {
        let then = match guard.then {
            Then::Decide(_) => "stop".to_string(),
            Then::Leave => "leave".to_string(),
            Then::Become(code) => {
                let of = guard.of.map(|(element, _)| &tables.elements[element]);
                of.map_or(String::new(), |element| element.states[code].word().to_string())
            }
        };
        json!({
            "element": guard.of.map(|(element, _)| element),
            "in_state": guard.of.map(|(_, state)| state),
            "then": then,
            "value": row(&guard.row),
        })
    };
    let mechanism = &tables.mechanism;
    let drives = mechanism.drives.iter().enumerate().map(|(index, drive)| {
        json!({
            "key": drive.label.key,
            "input_unit": drive.amplifier.mode.unit(),
            "current": row(&tables.currents[index]),
            "voltage": row(&tables.voltages[index]),
        })
    });
    let states = tables
        .states
        .iter()
        .zip(&tables.rates)
        .map(|(state, rate)| json!({ "name": state.name, "unit": state.unit, "rate": row(rate) }));
    json!({
        "modes": tables.modes(),
        "elements": tables.elements.iter().map(element).collect::<Vec<_>>(),
        "at_rest": tables.at_rest(),
        "states": states.collect::<Vec<_>>(),
        "conditions": tables.guards.iter().map(guard).collect::<Vec<_>>(),
        "drives": drives.collect::<Vec<_>>(),
        "spring_forces": tables.forces.iter().map(row).collect::<Vec<_>>(),
    })
}

fn row(row: &Row) -> Value {
    json!({ "depends_on": row.depends, "weights": row.weights })
}

fn linear(system: &System) -> Value {
    json!({
        // Of an axis the only one.
        "input": variable(&system.inputs[0]),
        "inputs": system.inputs.iter().map(variable).collect::<Vec<_>>(),
        "states": system.states.iter().map(variable).collect::<Vec<_>>(),
        "outputs": system.outputs.iter().map(variable).collect::<Vec<_>>(),
        "A": matrix(&system.a),
        "B": matrix(&system.b),
        "C": matrix(&system.c),
        "D": matrix(&system.d),
    })
}

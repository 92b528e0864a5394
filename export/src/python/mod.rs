//! Python: a script on NumPy, SciPy and python-control.

use super::packed::{LEAVE, Packed};
use super::{Exported, Options, STEP, Tables, mechanism};
use crate::case::Case;
use crate::error::Result;
use crate::linear::Variable;
use crate::machine::Machine;
use std::fmt::{Debug, Write};

const SCRIPT: &str = include_str!("model.py");

/// The file `STEM.py`.
pub(super) fn export(case: &Case, stem: &str, options: &Options) -> Result<Exported> {
    let tables = Tables::with_steppers(&mechanism(case))?;
    let packed = Packed::new(&tables);
    let linear = linear(&case.machine)?;
    let mut text = SCRIPT.replace("@tables@", lists(&tables, &packed).trim_end()).replace("@linear@", &linear);
    for (place, part) in [
        ("@title@", plain(case.title.as_str())),
        ("@version@", env!("CARGO_PKG_VERSION").into()),
        ("@step@", format!("{:?}", options.step.unwrap_or(STEP))),
        ("@stem@", plain(stem)),
        ("@leave@", LEAVE.to_string()),
        ("@fastest@", format!("{:?}", tables.fastest)),
        ("@example@", example(&tables).into()),
        ("@about@", about(&tables).into()),
    ] {
        text = text.replace(place, &part);
    }
    let facts = vec![
        ("states".into(), tables.rates.len().to_string()),
        ("modes".into(), tables.modes().to_string()),
        ("needs".into(), "NumPy and SciPy; python-control for linear()".into()),
    ];
    Ok(Exported { files: vec![(format!("{stem}.py"), text.into_bytes())], facts, notes: Vec::new() })
}

/// Commands of an example.
fn example(tables: &Tables) -> &'static str {
    match tables.steppers.is_empty() {
        true => "[(0.0, [5.0] * len(DRIVES)), (0.25, [0.0] * len(DRIVES))]",
        // 1 s at 50 mm/s
        false => "lambda time: [0.05 * min(time, 1.0)] * len(DRIVES)",
    }
}

/// That example in words.
fn about(tables: &Tables) -> &'static str {
    match tables.steppers.is_empty() {
        true => "[(0.0, 5.0), (0.25, 0.0)], until=1.0)     # 5 V for 0.25 s",
        false => "lambda time: 0.05 * time, until=1.0)    # 50 mm/s, a command every ms",
    }
}

/// A text as a string in three quotes can hold it.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() || c == '"' || c == '\\' { ' ' } else { c }).collect()
}

fn lists(tables: &Tables, packed: &Packed) -> String {
    let mut text = String::new();
    let mut put = |name: &str, what: &str, values: &dyn Debug| {
        let _ = writeln!(text, "# {what}\n{name} = {values:?}");
    };
    let mechanism = &tables.mechanism;
    let keys: Vec<&str> = mechanism.bodies.iter().map(|body| body.label.key).collect();
    put("BODIES", "the bodies", &keys);
    let levers: Vec<f64> = mechanism.bodies.iter().map(|body| body.kind.lever()).collect();
    put("LEVERS", "way at the belt per way of each body, m/rad or 1", &levers);
    let drives: Vec<&str> = mechanism.drives.iter().map(|drive| drive.label.key).collect();
    put("DRIVES", "the drives; the command of each is one of", &drives);
    let units: Vec<&str> = mechanism.drives.iter().map(|drive| drive.amplifier.mode.unit()).collect();
    put("COMMAND_UNITS", "these", &units);
    let states: Vec<(&str, &str)> = tables.states.iter().map(|state| (state.name.as_str(), state.unit)).collect();
    put("STATES", "the states", &states);
    put("WEIGHTS", "rows of weights on z = (states, products, commands, 1), each once", &packed.weights);
    put("ENTRY", "for all entries of all tables: which row", &packed.entry);
    put("ENTRY_FIRST", "where the entries of a table begin", &packed.entry_first);
    put("DEPENDS", "the elements that choose among them, the last one changing fastest", &packed.depends);
    put("DEPENDS_FIRST", "where those of a table begin", &packed.depends_first);
    let guards = format!(
        "conditions: table, element, its state, what follows ({LEAVE} leave), rank, conditions on the breakaways that \
         decide (-1 none)"
    );
    put("GUARDS", &guards, &packed.guards);
    put("RESETS", "what a change sets: condition, place", &packed.resets);
    put("RESET_VALUES", "to these values", &packed.reset_values);
    put("RESTING", "gears that lose power: element, table of the torque at rest", &packed.resting);
    put("ELEMENTS", "elements: states, what it does at rest", &packed.elements);
    put("PLACES", "of each body: places of coordinate and speed, element of its motion", &packed.bodies);
    put("LENGTHS", "belt lengths in the places of angles: body, other body (-1 itself), arm", &packed.lengths);
    put("OUTPUTS", "first tables of currents, voltages and forces", &packed.outputs);
    put("OTHERS", "first table of the second currents of steppers", &packed.others);
    put("PRODUCTS", "products behind the states: places of their factors", &packed.products);
    let steppers = "steppers: body of the rotor, place of its sine, electrical angle and angle per command, rad/m, \
                    microstep (0 for none) and farthest jump, m, amplitudes of commanded phases and at rest, most there";
    put("STEPPERS", steppers, &packed.steppers);
    text
}

fn linear(machine: &Machine) -> Result<String> {
    let system = super::linear(machine)?;
    let rows = |m: &nalgebra::DMatrix<f64>| -> Vec<Vec<f64>> {
        m.row_iter().map(|row| row.iter().copied().collect()).collect()
    };
    let names = |all: &[Variable]| -> Vec<String> { all.iter().map(|v| v.name.clone()).collect() };
    let units = |all: &[Variable]| -> Vec<&'static str> { all.iter().map(|v| v.unit).collect() };
    let mut text = String::from("{\n");
    for (key, values) in [
        ("A", format!("{:?}", rows(&system.a))),
        ("B", format!("{:?}", rows(&system.b))),
        ("C", format!("{:?}", rows(&system.c))),
        ("D", format!("{:?}", rows(&system.d))),
        ("states", format!("{:?}", names(&system.states))),
        ("outputs", format!("{:?}", names(&system.outputs))),
        ("output_units", format!("{:?}", units(&system.outputs))),
        ("inputs", format!("{:?}", names(&system.inputs))),
    ] {
        let _ = writeln!(text, "    \"{key}\": {values},");
    }
    Ok(text + "}")
}

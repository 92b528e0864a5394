//! MATLAB and Octave: a function that simulates, a MAT-file with the linear model and the tables, and a MEX function
//! over the C.

mod mat;

use super::packed::{LEAVE, Packed};
use super::{Exported, Options, Part, Real, STEP, Tables, c, identifier, mechanism};
use crate::case::Case;
use crate::error::Result;
use mat::Variable;

const FUNCTION: &str = include_str!("model.m");
const MEX: &str = include_str!("mex.c");

/// The files `NAME.m`, `NAME_data.mat`, `NAME_mex.c`, and the C that belongs to it.
pub(super) fn export(case: &Case, stem: &str, options: &Options) -> Result<Exported> {
    let name = identifier(stem);
    let tables = Tables::with_steppers(&mechanism(case))?;
    let step = options.step.unwrap_or(STEP);
    let example = match tables.steppers.is_empty() {
        true => "[0 5; 0.25 0], 1, 1e-3);      % 5 V for 0.25 s",
        false => "[t, 0.05 * t], 1, 1e-3);      % 50 mm/s with t = (0:1e-3:1)'",
    };
    let plain: String = case.title.as_str().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let fill = |text: &str| {
        text.replace("@title@", &c::plain(&plain))
            .replace("@version@", env!("CARGO_PKG_VERSION"))
            .replace("@name@", &name)
            .replace("@leave@", &LEAVE.to_string())
            .replace("@example@", example)
            .replace("@NAME@", &name.to_uppercase())
    };
    let plant = Options { part: Some(Part::Plant), real: Real::Double, step: Some(step), ..Options::default() };
    let own = format!("{name}_plant");
    let files = c::named(case, Part::Plant, (&own, &own), &plant)?.files;
    let mut all = vec![
        (format!("{name}.m"), fill(FUNCTION).into_bytes()),
        (format!("{name}_data.mat"), mat::file(&variables(case, &tables, step)?)),
        (format!("{name}_mex.c"), fill(MEX).into_bytes()),
    ];
    all.extend(files);
    let facts = vec![
        ("states".into(), tables.rates.len().to_string()),
        ("modes".into(), tables.modes().to_string()),
        ("function".into(), format!("{name}(commands, t_end, every)")),
    ];
    let mut notes = Vec::new();
    if format!("{name}.m") != format!("{stem}.m") {
        notes.push(format!("the function is called {name}, as MATLAB takes names"));
    }
    Ok(Exported { files: all, facts, notes })
}

/// The content of the MAT-file.
fn variables(case: &Case, tables: &Tables, step: f64) -> Result<Vec<(&'static str, Variable)>> {
    let packed = Packed::new(tables);
    let mechanism = &tables.mechanism;
    let whole = |list: &[i64]| Variable::Numbers(list.iter().map(|v| vec![*v as f64]).collect());
    let real = |list: &[f64]| Variable::Numbers(list.iter().map(|v| vec![*v]).collect());
    let rows = |list: Vec<Vec<i64>>| {
        Variable::Numbers(list.iter().map(|row| row.iter().map(|v| *v as f64).collect()).collect())
    };
    let words = |list: Vec<&str>| Variable::Words(list.into_iter().map(str::to_string).collect());
    let levers: Vec<f64> = mechanism.bodies.iter().map(|body| body.kind.lever()).collect();
    let mut all = vec![
        ("bodies", words(mechanism.bodies.iter().map(|body| body.label.key).collect())),
        ("position_units", words(mechanism.bodies.iter().map(|body| body.kind.units()[0]).collect())),
        ("levers", real(&levers)),
        ("drives", words(mechanism.drives.iter().map(|drive| drive.label.key).collect())),
        ("command_units", words(mechanism.drives.iter().map(|drive| drive.amplifier.mode.unit()).collect())),
        ("places", words(tables.states.iter().map(|state| state.name.as_str()).collect())),
        ("place_units", words(tables.states.iter().map(|state| state.unit).collect())),
        ("step", real(&[step])),
        ("fastest", real(&[tables.fastest])),
        ("weights", Variable::Numbers(packed.weights.clone())),
        ("entry", whole(&packed.entry)),
        ("entry_first", whole(&packed.entry_first)),
        ("depends", whole(&packed.depends)),
        ("depends_first", whole(&packed.depends_first)),
        ("guards", rows(packed.guards.iter().map(|row| row.to_vec()).collect())),
        ("elements", rows(packed.elements.iter().map(|row| row.to_vec()).collect())),
        ("resets", rows(packed.resets.iter().map(|row| row.to_vec()).collect())),
        ("reset_values", real(&packed.reset_values)),
        ("resting", rows(packed.resting.iter().map(|row| row.to_vec()).collect())),
        ("body_places", rows(packed.bodies.iter().map(|row| row.to_vec()).collect())),
        ("lengths", Variable::Numbers(packed.lengths.iter().map(|row| row.to_vec()).collect())),
        ("outputs_first", whole(&packed.outputs)),
        ("others_first", whole(&[packed.others])),
        ("products", rows(packed.products.iter().map(|row| row.to_vec()).collect())),
        ("steppers", Variable::Numbers(packed.steppers.iter().map(|row| row.to_vec()).collect())),
    ];
    let system = super::linear(&case.machine)?;
    let matrix =
        |m: &nalgebra::DMatrix<f64>| Variable::Numbers(m.row_iter().map(|row| row.iter().copied().collect()).collect());
    all.extend([
        ("A", matrix(&system.a)),
        ("B", matrix(&system.b)),
        ("C", matrix(&system.c)),
        ("D", matrix(&system.d)),
        ("states", words(system.states.iter().map(|v| v.name.as_str()).collect())),
        ("state_units", words(system.states.iter().map(|v| v.unit).collect())),
        ("outputs", words(system.outputs.iter().map(|v| v.name.as_str()).collect())),
        ("output_units", words(system.outputs.iter().map(|v| v.unit).collect())),
        ("inputs", words(system.inputs.iter().map(|v| v.name.as_str()).collect())),
        ("input_units", words(system.inputs.iter().map(|v| v.unit).collect())),
    ]);
    Ok(all)
}

//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::linear::{Analysis, ByInput, Discrete, Natural, ResonanceMap, ResonancesAt, Root};
use taut::number::{engineering_typed, fixed, typed};
use taut_report::modes::{elastic, gain, pole, rigid, where_it_matters, words, z, zeros};
use taut_report::simulate::machine;

/// Rows of the table of the travel.
const ROWS: usize = 7;

/// Places along either way of the table of the working area.
const PLACES: usize = 5;

/// The text on the terminal.
pub fn text(analysis: &Analysis, is_verbose: bool) -> String {
    let system = &analysis.system;
    let mut text = format!("{}\n", bold(&analysis.case.title));
    let _ = writeln!(text, "{}", machine(&analysis.case.machine));
    let inputs: Vec<String> = system.inputs.iter().map(|input| words(&input.name)).collect();
    let names: Vec<String> = system.states.iter().map(|state| words(&state.name)).collect();
    let _ = writeln!(text, "{}; {} states: {}", inputs.join(", "), names.len(), names.join(", "));
    for note in &analysis.words {
        let _ = writeln!(text, "  {note}");
    }
    let plane = analysis.case.machine.bridge.is_some();
    let heading = if plane { "Over the working area" } else { "Resonance and anti-resonance of the drive angle" };
    let _ = write!(text, "\n{}\n", bold(heading));
    let _ = writeln!(text, "  {}", where_it_matters(analysis));
    match &analysis.map {
        Some(map) => area(&mut text, map),
        None => travel(&mut text, analysis),
    }
    if let Some(modes) = &analysis.modes {
        shapes(&mut text, analysis, modes);
    }
    let _ = write!(text, "\n{}\n", bold("Poles"));
    for root in Root::from_values(&analysis.poles) {
        let (value, more) = pole(root);
        let _ = writeln!(text, "  {value:<36}{more}");
    }
    match is_verbose {
        true => analysis.inputs.iter().for_each(|one| outputs(&mut text, one, analysis.inputs.len() > 1)),
        false => text.push_str("\ngain and zeros of each output: --verbose\n"),
    }
    // The inputs have the same poles.
    if let Some(model) = analysis.inputs.first().and_then(|one| one.discrete.as_ref()) {
        discrete(&mut text, model);
    }
    text.push('\n');
    text
}

/// Mode shapes and energies.
fn shapes(text: &mut String, analysis: &Analysis, modes: &Natural) {
    let mechanism = analysis.case.machine.mechanism();
    if !modes.rigid.is_empty() {
        let _ = write!(text, "\n{}\n", bold("Rigid modes"));
    }
    for mode in &modes.rigid {
        let (name, ways) = rigid(&mechanism, modes, mode);
        let _ = writeln!(text, "  {name:<12}{}", typed(&ways));
    }
    if modes.elastic.is_empty() {
        return;
    }
    let _ = write!(text, "\n{}\n", bold("Elastic modes"));
    for mode in &modes.elastic {
        let [frequency, damping, shape, energy] = elastic(&mechanism, modes, mode);
        let _ = writeln!(text, "  {:<12}{}", typed(&frequency), typed(&damping));
        let _ = writeln!(text, "  {:<12}{}", "", typed(&shape));
        let _ = writeln!(text, "  {:<12}{}", "", typed(&energy));
    }
}

/// Gains and zeros from an input; where there are several, those of angles and positions.
fn outputs(text: &mut String, one: &ByInput, several: bool) {
    let input = &one.system.input;
    let heading = if several { format!("Outputs: {}", words(&input.name)) } else { "Outputs".into() };
    let _ = write!(text, "\n{}\n", bold(&heading));
    let is_shown = |unit: &str| !several || ["rad", "m"].contains(&unit);
    let shown = || one.system.outputs.iter().zip(&one.transfers).filter(|(output, _)| is_shown(output.unit));
    let wide = shown().map(|(output, _)| output.name.len() + 1).fold(18, usize::max);
    for (output, transfer) in shown() {
        let _ = writeln!(text, "  {:<wide$}{}", words(&output.name), gain(transfer, output.unit, input.unit));
        let zeros = zeros(transfer);
        if !zeros.is_empty() {
            let _ = writeln!(text, "  {:<wide$}zeros: {zeros}", "");
        }
    }
    if several {
        let _ = writeln!(text, "  {:<wide$}--out or --json has speeds, forces and currents", "");
    }
}

fn travel(text: &mut String, analysis: &Analysis) {
    let held = if analysis.case.machine.bridge.is_some() { "drives held" } else { "anti-resonance" };
    let _ = writeln!(text, "  {:>12}  {:<28}{held:<28}without damping", "position", "resonance");
    let rows: Vec<&ResonancesAt> = match &analysis.travel {
        Some(travel) => {
            let step = (travel.len() - 1).div_ceil(ROWS - 1).max(1);
            travel.iter().step_by(step).collect()
        }
        None => vec![&analysis.here],
    };
    let list = |values: Vec<f64>| match values.is_empty() {
        true => "none".to_string(),
        false => format!("{} Hz", values.iter().map(|v| engineering_typed(*v, "", 4)).collect::<Vec<_>>().join(", ")),
    };
    let pairs = |roots: &[Root]| list(roots.iter().filter_map(|root| root.hertz()).collect());
    for place in rows {
        let position = if analysis.travel.is_some() {
            typed(&format!("{:.1} mm", place.position * 1e3))
        } else {
            "anywhere".into()
        };
        let _ = writeln!(
            text,
            "  {position:>12}  {:<28}{:<28}{}; {}",
            pairs(&place.resonances),
            pairs(&place.antiresonances),
            list(place.undamped_resonances.clone()),
            list(place.undamped_antiresonances.clone()),
        );
    }
}

/// The frequencies of each mode at a few places.
fn area(text: &mut String, map: &ResonanceMap) {
    let picked = |count: usize| (0..PLACES).map(move |k| k * (count - 1) / (PLACES - 1));
    let place = |metres: f64| typed(&format!("{} mm", fixed(1e3 * metres, 1)));
    for (k, hertz) in map.hertz.iter().enumerate() {
        let [(least, _), (most, _)] = map.range(k);
        let [least, most] = [least, most].map(|hertz| engineering_typed(hertz, "", 4));
        let _ = writeln!(text, "\n  elastic mode {}, Hz: from {least} to {most}", k + 1);
        let columns: Vec<String> = picked(map.cart.len()).map(|j| format!("{:>11}", place(map.cart[j]))).collect();
        let _ = writeln!(text, "  {:>12}{}", "x \\ y", columns.concat());
        for i in picked(map.bridge.len()).collect::<Vec<_>>().into_iter().rev() {
            let row: Vec<String> = picked(map.cart.len()).map(|j| format!("{:>11}", fixed(hertz[i][j], 2))).collect();
            let _ = writeln!(text, "  {:>12}{}", place(map.bridge[i]), row.concat());
        }
    }
}

fn discrete(text: &mut String, model: &Discrete) {
    let _ = write!(text, "\n{}\n", bold("Discrete-time model"));
    let late = match model.delay {
        0.0 => String::new(),
        delay => format!(", input late by {}", engineering_typed(delay, "s", 5)),
    };
    let (time, states) = (engineering_typed(model.sample_time, "s", 5), model.states.len());
    let _ = writeln!(text, "  sample time {time}, {}{late}; {states} states", model.hold.words());
    let poles: Vec<String> = model.poles().iter().filter(|z| z.im >= 0.0).map(z).collect();
    let _ = writeln!(text, "  poles z = {}", poles.join(", "));
}

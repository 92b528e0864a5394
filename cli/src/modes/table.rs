//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::linear::Analysis;
use taut::linear::{Discrete, Place, Root};
use taut::number::{engineering_typed, typed};
use taut_report::modes::{along, gain, pole, poles, words, z, zeros};

/// Rows of the table of the travel.
const ROWS: usize = 7;

/// The text on the terminal.
pub fn text(analysis: &Analysis) -> String {
    let system = &analysis.system;
    let mut text = format!("{}\n", bold(&analysis.case.title));
    let names: Vec<String> = system.states.iter().map(|state| words(&state.name)).collect();
    let _ = writeln!(text, "{}, {} states: {}", words(&system.input.name), names.len(), names.join(", "));
    for note in &analysis.words {
        let _ = writeln!(text, "  {note}");
    }
    let _ = write!(text, "\n{}\n", bold("Poles"));
    for root in poles(analysis) {
        let (value, more) = pole(root);
        let _ = writeln!(text, "  {value:<36}{more}");
    }
    let _ = write!(text, "\n{}\n", bold("Outputs"));
    for (output, transfer) in system.outputs.iter().zip(&analysis.transfers) {
        let _ = writeln!(text, "  {:<16}{}", words(&output.name), gain(transfer, output.unit, system.input.unit));
        let zeros = zeros(transfer);
        if !zeros.is_empty() {
            let _ = writeln!(text, "  {:<16}zeros: {zeros}", "");
        }
    }
    let _ = write!(text, "\n{}\n", bold("Resonance and anti-resonance of the drive angle"));
    let _ = writeln!(text, "  {}", along(analysis));
    travel(&mut text, analysis);
    if let Some(model) = &analysis.discrete {
        discrete(&mut text, model);
    }
    text.push('\n');
    text
}

fn travel(text: &mut String, analysis: &Analysis) {
    let _ = writeln!(text, "  {:>12}  {:<28}{:<28}without damping", "position", "resonance", "anti-resonance");
    let rows: Vec<&Place> = match &analysis.travel {
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

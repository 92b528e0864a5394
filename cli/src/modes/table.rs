//! The result for people on a terminal.

use super::along;
use crate::terminal::bold;
use nalgebra::Complex;
use std::f64::consts::PI;
use std::fmt::Write;
use taut::linear::Analysis;
use taut::linear::{Discrete, Place, Root, Transfer};
use taut::number::{ascii, engineering_ascii};

/// Rows of the table of the travel.
const ROWS: usize = 7;

/// The text on the terminal.
pub fn text(analysis: &Analysis) -> String {
    let system = &analysis.system;
    let mut text = format!("{}\n", bold(&analysis.case.title));
    let names: Vec<String> = system.states.iter().map(|state| words(state.name)).collect();
    let _ = writeln!(text, "{}, {} states: {}", words(system.input.name), names.len(), names.join(", "));
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
        let _ = writeln!(text, "  {:<16}{}", words(output.name), gain(transfer, output.unit, system.input.unit));
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

/// Of each pole or pair, the slowest first.
pub fn poles(analysis: &Analysis) -> Vec<Root> {
    Root::of(analysis.transfers.first().map_or(&[], |transfer| &transfer.poles))
}

/// A name without underscores.
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A root: where it is, and what that means.
pub fn pole(root: Root) -> (String, String) {
    match root {
        Root::Zero => ("0".into(), "integrator".into()),
        Root::Real(s) => (
            format!("{} 1/s", plain(s)),
            format!("{} {}", if s < 0.0 { "time constant" } else { "grows, doubling and more in" }, time(root)),
        ),
        Root::Pair { frequency, damping } => (
            format!("{} Hz ({} rad/s)", plain(frequency / (2.0 * PI)), plain(frequency)),
            format!(
                "damping {}, {} {}, damped frequency {} Hz",
                plain(damping),
                if damping >= 0.0 { "time constant" } else { "grows in" },
                time(root),
                plain(root.damped_hertz().unwrap_or(0.0))
            ),
        ),
    }
}

fn time(root: Root) -> String {
    match root.time_constant() {
        t if t.is_finite() => engineering_ascii(t, "s", 4),
        _ => "infinite".into(),
    }
}

/// Five digits, in ASCII.
fn plain(value: f64) -> String {
    engineering_ascii(value, "", 5)
}

/// What an output does in the long run.
pub fn gain(transfer: &Transfer, unit: &str, input: &str) -> String {
    let (order, gain) = transfer.low_frequency();
    // A unit with a blank or a slash goes in front, so that it cannot be misread.
    let value = |gain: f64, unit: &str| format!("{} per {input}", engineering_ascii(gain, unit, 5));
    match order {
        _ if transfer.zeros.gain == 0.0 => "the input does not reach it".into(),
        0 => format!("DC gain {}", value(gain, unit)),
        1 => format!("integrates: {}", value(gain, &rate(unit))),
        2 => format!("integrates twice: {}", value(gain, &rate(&rate(unit)))),
        n if n < 0 => "DC gain 0: it answers changes alone".into(),
        n => format!("integrates {n} times: {} per s^{n}", value(gain, unit)),
    }
}

fn rate(unit: &str) -> String {
    match unit.strip_suffix("/s") {
        Some(before) => format!("{before}/s^2"),
        None => format!("{unit}/s"),
    }
}

/// The zeros of an output in a line.
pub fn zeros(transfer: &Transfer) -> String {
    let one = |root: Root| match root {
        Root::Zero => "0".into(),
        Root::Real(s) => format!("{} 1/s", plain(s)),
        Root::Pair { frequency, damping } => {
            format!("{} Hz (damping {})", plain(frequency / (2.0 * PI)), engineering_ascii(damping, "", 3))
        }
    };
    Root::of(&transfer.zeros.values).into_iter().map(one).collect::<Vec<_>>().join(", ")
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
        false => format!("{} Hz", values.iter().map(|v| engineering_ascii(*v, "", 4)).collect::<Vec<_>>().join(", ")),
    };
    let pairs = |roots: &[Root]| list(roots.iter().filter_map(|root| root.hertz()).collect());
    for place in rows {
        let position = if analysis.travel.is_some() {
            ascii(&format!("{:.1} mm", place.position * 1e3))
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
        delay => format!(", input late by {}", engineering_ascii(delay, "s", 5)),
    };
    let (time, states) = (engineering_ascii(model.sample_time, "s", 5), model.states.len());
    let _ = writeln!(text, "  sample time {time}, {}{late}; {states} states", model.hold.words());
    let poles: Vec<String> = model.poles().iter().filter(|z| z.im >= 0.0).map(z).collect();
    let _ = writeln!(text, "  poles z = {}", poles.join(", "));
}

/// A point of the z plane; of a pair both.
pub fn z(value: &Complex<f64>) -> String {
    match value.im {
        0.0 => engineering_ascii(value.re, "", 6),
        im => format!("{} ± {}j", engineering_ascii(value.re, "", 6), engineering_ascii(im, "", 6)).replace('±', "+/-"),
    }
}

//! The result for people on a terminal.

use super::super::table::pole;
use super::over_the_area;
use crate::simulate::gantry_machine;
use crate::terminal::bold;
use std::fmt::Write;
use taut::linear::{ElasticMode, GantryAnalysis, ResonanceMap, RigidMode, Root};
use taut::mechanism::Mechanism;
use taut::number::{ascii, engineering_ascii, fixed};

/// Places along either way of the table of the working area.
const PLACES: usize = 5;

/// The text on the terminal.
pub fn text(analysis: &GantryAnalysis) -> String {
    let gantry = &analysis.case.gantry;
    let mechanism = gantry.mechanism();
    let mut text = format!("{}\n{}\n", bold(&analysis.case.title), gantry_machine(gantry));
    for note in &analysis.words {
        let _ = writeln!(text, "  {note}");
    }
    let _ = write!(text, "\n{}\n", bold("Rigid modes"));
    for mode in &analysis.modes.rigid {
        let (name, ways) = rigid(analysis, &mechanism, mode);
        let _ = writeln!(text, "  {name:<12}{}", ascii(&ways));
    }
    for root in slow(analysis) {
        let (value, more) = pole(root);
        let _ = writeln!(text, "  {:<12}{value:<24}{more}", "");
    }
    let _ = write!(text, "\n{}\n", bold("Elastic modes"));
    for mode in &analysis.modes.elastic {
        let [frequency, damping, shape, energy] = elastic(analysis, &mechanism, mode);
        let _ = writeln!(text, "  {:<12}{}", ascii(&frequency), ascii(&damping));
        let _ = writeln!(text, "  {:<12}{}", "", ascii(&shape));
        let _ = writeln!(text, "  {:<12}{}", "", ascii(&energy));
    }
    let _ = write!(text, "\n{}\n", bold("Over the working area"));
    let _ = writeln!(text, "  {}", over_the_area(analysis));
    if let Some(map) = &analysis.map {
        area(&mut text, map);
    }
    text.push('\n');
    text
}

/// What a rigid mode is called, and how the pulleys turn in it.
pub fn rigid(analysis: &GantryAnalysis, mechanism: &Mechanism, mode: &RigidMode) -> (&'static str, String) {
    let ways =
        analysis.modes.bodies.iter().zip(&mode.shape).filter(|(body, _)| **body != mode.body).map(|(body, way)| {
            let body = &mechanism.bodies[*body];
            let unit = body.kind.units()[0];
            match way {
                0.0 => format!("{} 0", body.label.name),
                way => format!("{} {} {unit}", body.label.name, fixed(*way, 2)),
            }
        });
    let body = &mechanism.bodies[mode.body];
    let ways: Vec<String> = ways.collect();
    (body.label.name, format!("per {}: {}", body.kind.units()[0], ways.join(", ")))
}

/// What damps the rigid modes: the poles that do not swing, integrators apart.
pub fn slow(analysis: &GantryAnalysis) -> impl Iterator<Item = Root> {
    analysis.modes.poles.iter().copied().filter(|root| matches!(root, Root::Real(_)))
}

/// Frequency, damping, shape and energy of an elastic mode.
pub fn elastic(analysis: &GantryAnalysis, mechanism: &Mechanism, mode: &ElasticMode) -> [String; 4] {
    let damping = match mode.damped {
        Some(root @ Root::Pair { damping, .. }) => format!(
            "damping {}, time constant {}, damped frequency {} Hz",
            engineering_ascii(damping, "", 4),
            engineering_ascii(root.time_constant(), "s", 4),
            engineering_ascii(root.damped_hertz().unwrap_or(0.0), "", 5)
        ),
        _ => "damped so much that not every mode swings".into(),
    };
    let name = |body: usize| mechanism.bodies[body].label.name;
    let bodies = || analysis.modes.bodies.iter().copied();
    let shape: Vec<String> =
        bodies().zip(&mode.shape).map(|(body, way)| format!("{} {}", name(body), fixed(*way, 3))).collect();
    let mut shares: Vec<(usize, f64)> = bodies().zip(mode.energy.iter().copied()).collect();
    // Alike ones stay in the order of the bodies.
    shares.sort_by(|a, b| (b.1 * 1e6).round().total_cmp(&(a.1 * 1e6).round()));
    let shares = shares.iter().filter(|(_, share)| *share >= 0.005);
    let energy: Vec<String> =
        shares.map(|(body, share)| format!("{} {} %", name(*body), fixed(100.0 * share, 0))).collect();
    [
        format!("{} Hz", engineering_ascii(mode.hertz(), "", 5)),
        damping,
        format!("ways at the belt: {}", shape.join(", ")),
        format!("energy: {}", energy.join(", ")),
    ]
}

/// The frequencies of each mode at a few places.
fn area(text: &mut String, map: &ResonanceMap) {
    let picked = |count: usize| (0..PLACES).map(move |k| k * (count - 1) / (PLACES - 1));
    let place = |metres: f64| ascii(&format!("{} mm", fixed(1e3 * metres, 1)));
    for (k, hertz) in map.hertz.iter().enumerate() {
        let [(least, _), (most, _)] = map.range(k);
        let [least, most] = [least, most].map(|hertz| engineering_ascii(hertz, "", 4));
        let _ = writeln!(text, "\n  elastic mode {}, Hz: from {least} to {most}", k + 1);
        let columns: Vec<String> = picked(map.cart.len()).map(|j| format!("{:>11}", place(map.cart[j]))).collect();
        let _ = writeln!(text, "  {:>12}{}", "x \\ y", columns.concat());
        for i in picked(map.bridge.len()).collect::<Vec<_>>().into_iter().rev() {
            let row: Vec<String> = picked(map.cart.len()).map(|j| format!("{:>11}", fixed(hertz[i][j], 2))).collect();
            let _ = writeln!(text, "  {:>12}{}", place(map.bridge[i]), row.concat());
        }
    }
}

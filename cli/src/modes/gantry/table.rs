//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::linear::{GantryAnalysis, ResonanceMap};
use taut::number::{engineering_typed, fixed, typed};
use taut_report::modes::gantry::{elastic, over_the_area, rigid, slow};
use taut_report::modes::pole;
use taut_report::simulate::machine;

/// Places along either way of the table of the working area.
const PLACES: usize = 5;

/// The text on the terminal.
pub fn text(analysis: &GantryAnalysis) -> String {
    let gantry = &analysis.case.machine;
    let mechanism = gantry.mechanism();
    let mut text = format!("{}\n{}\n", bold(&analysis.case.title), machine(gantry));
    for note in &analysis.words {
        let _ = writeln!(text, "  {note}");
    }
    let _ = write!(text, "\n{}\n", bold("Rigid modes"));
    for mode in &analysis.modes.rigid {
        let (name, ways) = rigid(analysis, &mechanism, mode);
        let _ = writeln!(text, "  {name:<12}{}", typed(&ways));
    }
    for root in slow(analysis) {
        let (value, more) = pole(root);
        let _ = writeln!(text, "  {:<12}{value:<24}{more}", "");
    }
    let _ = write!(text, "\n{}\n", bold("Elastic modes"));
    for mode in &analysis.modes.elastic {
        let [frequency, damping, shape, energy] = elastic(analysis, &mechanism, mode);
        let _ = writeln!(text, "  {:<12}{}", typed(&frequency), typed(&damping));
        let _ = writeln!(text, "  {:<12}{}", "", typed(&shape));
        let _ = writeln!(text, "  {:<12}{}", "", typed(&energy));
    }
    let _ = write!(text, "\n{}\n", bold("Over the working area"));
    let _ = writeln!(text, "  {}", over_the_area(analysis));
    if let Some(map) = &analysis.map {
        area(&mut text, map);
    }
    text.push('\n');
    text
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

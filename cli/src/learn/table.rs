//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::case::{Case, Move};
use taut::learning::Learned;
use taut_report::learn::{head, lines, trials};

/// The text on the terminal.
pub fn text(case: &Case, motion: &Move, found: &Learned) -> String {
    let mut text = format!("{}\n\n{}: {}\n", bold(&case.title), bold(&motion.name), head(found, &case.machine));
    // Names of a gantry say of what.
    let [of_lines, wide] = if case.machine.has_one_coordinate() { [12, 3] } else { [14, 8] };
    for (name, words) in lines(found, &case.machine) {
        let _ = writeln!(text, "  {name:<of_lines$}{words}");
    }
    let _ = writeln!(text, "\n{}", bold("Repetitions to come: the axis of the file, the worst of the family"));
    for [number, rms, peak, worst, worst_peak] in trials(found, &case.machine) {
        let _ = writeln!(text, "  {number:<wide$} {rms} rms, {peak} at most; {worst} rms, {worst_peak} at most");
    }
    text
}

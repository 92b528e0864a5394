//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::case::{Case, Move};
use taut::learning::Learned;
use taut_report::learn::{head, lines, trials};

/// The text on the terminal.
pub fn text(case: &Case, motion: &Move, found: &Learned) -> String {
    let mut text = format!("{}\n\n{}: {}\n", bold(&case.title), bold(&motion.name), head(found));
    for (name, words) in lines(found, case.machine.drives[0].amplifier.mode.unit()) {
        let _ = writeln!(text, "  {name:<12}{words}");
    }
    let _ = writeln!(text, "\n{}", bold("Repetitions to come: the axis of the file, the worst of the family"));
    for [number, rms, peak, worst, worst_peak] in trials(found) {
        let _ = writeln!(text, "  {number:<3} {rms} rms, {peak} at most; {worst} rms, {worst_peak} at most");
    }
    text
}

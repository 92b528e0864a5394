//! The summary on the terminal: a small table for each experiment.

use crate::simulate::table::took;
use crate::terminal::bold;
use std::fmt::Write;
use taut::case::Case;
use taut::solve::Solver;
use taut_report::simulate::gantry::{Run, early_end, lines, machine};
use taut_report::simulate::solver_words;

/// The text on the terminal.
pub fn text(case: &Case, solver: Solver, runs: &[Run]) -> String {
    let gantry = &case.machine;
    let how = solver_words(solver, runs.iter().map(|run| &run.outcome));
    let mut text = format!("{}\n{}\n{how}\n", bold(&case.title), machine(gantry));
    for run in runs {
        let _ = write!(text, "\n{}\n", bold(&run.experiment.name));
        if let Some(told) = early_end(run, gantry) {
            let _ = writeln!(text, "  {:<16}{}", "ended early", told.trim_start_matches("ended "));
        }
        for (name, words) in lines(run, gantry, solver) {
            let _ = writeln!(text, "  {name:<16}{words}");
        }
        let _ = writeln!(text, "  {:<16}{}", "took", took(run.took));
    }
    text.push('\n');
    text
}

//! The summary on the terminal: a small table for each experiment.

use crate::terminal::bold;
use std::fmt::Write;
use std::time::Duration;
use taut::case::Case;
use taut::number;
use taut::solve::Solver;
use taut_report::simulate::{SimulatedExperiment, early_end, lines, machine, solver_words};

/// The text on the terminal.
pub fn text(case: &Case, solver: Solver, runs: &[SimulatedExperiment]) -> String {
    let how = solver_words(solver, runs.iter().map(|run| &run.outcome));
    let mut text = format!("{}\n", bold(&case.title));
    if !case.is_axis() {
        let _ = writeln!(text, "{}", machine(&case.machine));
    }
    let _ = writeln!(text, "{how}");
    for run in runs {
        let _ = write!(text, "\n{}\n", bold(&run.experiment.name));
        if let Some(told) = early_end(run, &case.machine) {
            let _ = writeln!(text, "  {:<16}{}", "ended early", told.trim_start_matches("ended "));
        }
        for (name, words) in lines(run, &case.machine, solver) {
            let _ = writeln!(text, "  {name:<16}{words}");
        }
        let _ = writeln!(text, "  {:<16}{}", "took", took(run.took));
    }
    text.push('\n');
    text
}

/// How long it took.
fn took(duration: Duration) -> String {
    number::engineering(duration.as_secs_f64(), "s", 3).replace('\u{a0}', " ")
}

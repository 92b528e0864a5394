//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::case::Case;
use taut::fit::experiment_design::{Designed, Verified};
use taut_report::design::{heading, inputs, limits, measured, own, promises, verified};

/// The text on the terminal.
pub fn text(case: &Case, found: &Designed, checked: &[Verified]) -> String {
    let mut text = format!("{}\n\n{}\n", bold(&case.title), bold("The experiment"));
    let _ = writeln!(text, "{}\n\n{}", heading(found), found.toml(&case.machine));
    let mut part = |heading: &str, rows: String| {
        let _ = write!(text, "{}\n{rows}\n", bold(heading));
    };
    let promised = format!(
        "Predicted standard errors, all others free, including {} % of the value for the model",
        taut::quantity::rounded(100.0 * found.model_error)
    );
    part(&promised, format!("{}  {}\n", columns(&promises(found)), measured(found)));
    for (group, choices) in &found.undetermined {
        let choices: String = choices.iter().map(|choice| format!("  - {choice}\n")).collect();
        part("Not determined", format!("  {}\n{choices}", group.words));
    }
    if !checked.is_empty() {
        let heading = "Fits of simulated logs: errors relative to those predicted for an exact model (rms, mean), 95 % \
             intervals that contain the truth";
        part(heading, columns(&verified(checked)));
    }
    let heading = format!(
        "Reached value and limit; {:.0} % is kept free, also with a parameter wrong by {:.0} %",
        100.0 * found.limits.margin,
        100.0 * found.doubt
    );
    part(&heading, columns(&limits(found, &case.machine)));
    part(
        &format!("Mean relative error of the best of each input ({})", found.criterion.word()),
        columns(&inputs(found)),
    );
    if !found.own.is_empty() {
        part("The case's own experiments, measured in the same way", columns(&own(found)));
    }
    text
}

/// Rows with their columns below each other.
fn columns<const N: usize>(rows: &[[String; N]]) -> String {
    let wide: Vec<usize> =
        (0..N).map(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or_default()).collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row.iter().zip(&wide).map(|(cell, wide)| format!("{cell:<wide$}")).collect();
        let _ = writeln!(text, "  {}", cells.join("  ").trim_end());
    }
    text
}

//! The result for people on a terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::number::typed;
use taut::overview::Overview;
use taut_report::show::{rows, value};

/// Width of the column of names.
const NAMES: usize = 42;
/// Width of the column of values.
const VALUES: usize = 16;

/// The text on the terminal.
pub fn text(overview: &Overview) -> String {
    let mut text = format!("{}\n", bold(&overview.title));
    for group in &overview.groups {
        let _ = write!(text, "\n{}\n", bold(group.name));
        for row in &group.rows {
            let value = value(row);
            let line = format!("  {:<NAMES$}{value:<VALUES$}{}", row.name, typed(&row.how));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    places(&mut text, overview);
    text.push('\n');
    for note in &overview.notes {
        let _ = writeln!(text, "note: {}", typed(&note.text));
    }
    text
}

/// The figures that change along the travel.
fn places(text: &mut String, overview: &Overview) {
    let is_axis = overview.kind == "axis";
    if !overview.depends_on_place {
        return;
    }
    let _ = write!(text, "\n{}\n", bold(if is_axis { "Along the travel" } else { "Over the working area" }));
    for (k, row) in rows(overview).iter().enumerate() {
        let cells: Vec<String> = row.iter().map(|cell| format!("{cell:>12}")).collect();
        let line = format!("  {}", cells.concat());
        let _ = writeln!(text, "{}", if k == 0 { line.to_lowercase().replace("hz", "Hz") } else { line });
    }
}

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

/// The text on the terminal: the most important rows, or all of them.
pub fn text(overview: &Overview, is_verbose: bool) -> String {
    let mut text = format!("{}\n", bold(&overview.title));
    for group in &overview.groups {
        let mut rows = group.rows.iter().filter(|row| is_verbose || row.is_main()).peekable();
        if rows.peek().is_some() {
            let _ = write!(text, "\n{}\n", bold(group.name));
        }
        for row in rows {
            let value = value(row);
            let line = format!("  {:<NAMES$}{value:<VALUES$}{}", row.name, typed(&row.how));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    if is_verbose {
        places(&mut text, overview);
    }
    text.push('\n');
    for note in &overview.notes {
        let word = if note.is_warning() { "warning" } else { "note" };
        let _ = writeln!(text, "{word}: {}", typed(&note.text));
    }
    let hidden = overview.rows().filter(|row| !row.is_main()).count();
    if !is_verbose && hidden > 0 {
        let places = if overview.depends_on_place { ", and figures along the travel" } else { "" };
        let _ = writeln!(text, "{hidden} more rows{places}: --verbose");
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

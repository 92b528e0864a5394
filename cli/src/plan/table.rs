//! The plans on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::case::Case;
use taut::planning::Plans;
use taut_report::plan::{belt, head, lines};

/// The text on the terminal.
pub fn text(case: &Case, plans: &Plans) -> String {
    let mut text = format!("{}\n{}\n", bold(&case.title), belt(plans));
    for planned in &plans.moves {
        let _ = write!(text, "\n{}: {}\n", bold(&planned.name), head(planned));
        for (name, words) in lines(planned) {
            let _ = writeln!(text, "  {name:<16}{words}");
        }
    }
    text
}

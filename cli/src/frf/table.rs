//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::frf::Measurement;
use taut_report::frf::{lines, quality};

/// The text on the terminal.
pub fn text(title: &str, found: &Measurement) -> String {
    let mut text = format!("{}\n", bold(title));
    let _ = write!(text, "\n{}\n", bold("Fitted to the responses"));
    match &found.fit {
        Ok(fit) => {
            for (name, value, [low, high]) in fit.rows() {
                let _ = writeln!(text, "  {name:<28} {value}  ({low} to {high})");
            }
            let _ = writeln!(text, "  {}", quality(fit));
        }
        Err(error) => {
            let _ = writeln!(text, "  none: {}", error.what);
        }
    }
    for one in &found.responses {
        let _ = write!(text, "\n{}\n", bold(&one.frf.title()));
        for line in lines(&one.frf) {
            let _ = writeln!(text, "  {line}");
        }
        if let Some(margins) = &one.margins {
            let _ = writeln!(text, "  with the case's controller: {}", margins.words());
        }
    }
    text
}

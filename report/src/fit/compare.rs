//! Friction laws and windows by what they predict, in words and as a section of the report.

use crate::{Cell, Page, Table};
use taut::fit::compare::Comparison;

/// Headings of [`rows`].
pub const HEADINGS: [&str; 5] = ["Law and windows", "Parameters", "Held out", "Training", "By training"];

/// The rows of the table: name, parameters, errors.
pub fn rows(compared: &Comparison) -> impl Iterator<Item = [String; 5]> {
    let mut by_training: Vec<usize> = (0..compared.candidates.len()).collect();
    by_training.sort_by(|&a, &b| compared.candidates[a].training.total_cmp(&compared.candidates[b].training));
    compared.candidates.iter().enumerate().map(move |(k, candidate)| {
        let place = by_training.iter().position(|&own| own == k).map_or(0, |place| place + 1);
        [
            candidate.name(),
            candidate.parameters.to_string(),
            compared.shown(candidate.held_out),
            compared.shown(candidate.training),
            if candidate.failed.is_some() { "–".into() } else { place.to_string() },
        ]
    })
}

/// The section of the report.
pub fn section(page: &mut Page, compared: &Comparison) {
    page.section("Laws and windows");
    for line in compared.words() {
        page.prose(format!("{line}."));
    }
    let mut table = Table::new(format!(
        "Root mean square errors, the one that predicts best first. Held out: {}.",
        compared.held_out
    ));
    for heading in HEADINGS {
        table = table.column(heading, "");
    }
    for (k, mut row) in rows(compared).enumerate() {
        if k == compared.chosen {
            row[0].push_str(" (chosen)");
        }
        table.row(row.map(Cell::from));
    }
    page.table(&table);
}

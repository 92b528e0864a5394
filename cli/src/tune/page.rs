//! The report: one HTML file.

use super::Work;
use super::table::{self, Row};
use taut_report::{Callout, Cell, Figure, Page, Table};

/// The page; `text` is the tuned case.
pub fn page(work: &Work, text: &str, figures: &[(String, Figure)]) -> Page {
    let tuned = work.tuned;
    let structure = tuned.after.design.structure.name();
    let mut page = Page::new(work.case.title.clone()).subtitle(format!("Tuned: {structure}. {}.", table::goal(work)));
    let (kind, head) = match tuned.holds {
        true => (Callout::Holds, "The limits hold"),
        false => (Callout::Fails, "The limits do not hold"),
    };
    let worst = tuned.family.words(&tuned.after.corner);
    page.callout(kind, head, format!("Over {}. The worst axis: {worst}.", table::family(work)));
    page.section("Gains");
    page.table(&rows(&table::gains(work)));
    page.section("Margins");
    page.subsection("The axis as the file has it");
    page.table(&rows(&table::margins(&tuned.before.nominal, &tuned.after.nominal)));
    page.subsection("The worst axis");
    page.table(&rows(&table::margins(&tuned.before.worst, &tuned.after.worst)));
    page.prose(format!("Before: {}. After: {worst}.", tuned.family.words(&tuned.before.corner)));
    for (_, figure) in figures.iter().take(2) {
        page.figure(figure);
    }
    if !tuned.after.moves.is_empty() {
        page.section("Moves");
        page.table(&rows(&table::moves(work)));
        for (_, figure) in figures.iter().skip(2) {
            page.figure(figure);
        }
    }
    page.section("Limit cycles at rest");
    page.table(&rows(&[("Hunting".into(), table::hunt(&tuned.before.hunt), table::hunt(&tuned.after.hunt))]));
    page.section("The case");
    page.prose("This text has the tuned gains.");
    page.embed("tuned.toml", text);
    page.footer(format!("taut {}", env!("CARGO_PKG_VERSION")));
    page
}

fn rows(all: &[Row]) -> Table {
    let mut table = Table::new("").column("Quantity", "").column("Before", "").column("After", "");
    for (name, before, after) in all {
        table.row([Cell::from(name.trim().to_string()), Cell::from(before.clone()), Cell::from(after.clone())]);
    }
    table
}

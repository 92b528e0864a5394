//! The report: one HTML file.

use super::Work;
use super::rows::{self as told, Row};
use crate::{Callout, Cell, Figure, Page, Table};
use taut::tune::Judgement;

/// Figures of the loop, which stand before those of the moves.
const LOOPS: usize = 5;

/// The page; `text` is the tuned case.
pub fn page(work: &Work, text: &str, figures: &[(String, Figure)]) -> Page {
    let tuned = work.tuned;
    let structure = tuned.after.design.structure.name();
    let mut page = Page::new(work.case.title.clone()).subtitle(format!("Tuned: {structure}. {}.", told::goal(work)));
    let (kind, head) = match (tuned.holds, tuned.judgement) {
        (false, _) => (Callout::Fails, "The limits do not hold"),
        (true, Judgement::Worse) => (Callout::Fails, "Within the limits the moves are worse than before"),
        (true, Judgement::Better) => (Callout::Holds, "The moves are better, and the limits hold"),
        (true, Judgement::Unchanged) => (Callout::Holds, "The gains of the file stay; the limits hold"),
    };
    page.callout(kind, head, format!("{}. Over {}.", told::summary(work), told::family(work)));
    if let Some(told) = told::given(work) {
        page.prose(told);
    }
    page.section("Gains");
    page.table(&rows(&told::gains(work)));
    let in_drives = told::in_drives(work);
    if !in_drives.is_empty() {
        page.subsection("As drives have them");
        page.table(&rows(&in_drives));
    }
    page.section("Margins");
    page.subsection("The axis as the file has it");
    page.table(&rows(&told::margins(&tuned.before.nominal, &tuned.after.nominal)));
    page.subsection("At worst");
    page.table(&rows(&told::margins(&tuned.before.worst, &tuned.after.worst)));
    let [before, after] = told::limiting(work);
    page.prose(format!("Before on {before}, after on {after}."));
    page.subsection("Certificate");
    for line in told::certificate(work) {
        page.prose(line);
    }
    for (_, figure) in figures.iter().take(LOOPS) {
        page.figure(figure);
    }
    if !tuned.after.moves.is_empty() {
        page.section("Moves");
        page.table(&rows(&told::moves(work)));
        for (_, figure) in figures.iter().skip(LOOPS) {
            page.figure(figure);
        }
    }
    if !tuned.choices.is_empty() {
        page.section("Choices");
        let mut all = told::CHOICES.into_iter().fold(Table::new(""), |table, heading| table.column(heading, ""));
        for row in told::choices(work) {
            all.row(row.into_iter().map(Cell::from));
        }
        page.table(&all);
    }
    page.section("Axes");
    let mut all =
        Table::new("What is off on the axes that are worst in something.").column("Axis", "").column("Off", "");
    for row in told::axes(work) {
        all.row(row.map(Cell::from));
    }
    page.table(&all);
    page.section("Limit cycles at rest");
    page.table(&rows(&[("Hunting".into(), told::hunt(&tuned.before.hunt), told::hunt(&tuned.after.hunt))]));
    page.case("This text has the tuned gains.", "tuned.toml", text);
    page
}

fn rows(all: &[Row]) -> Table {
    let mut table = Table::new("").column("Quantity", "").column("Before", "").column("After", "");
    for (name, before, after) in all {
        table.row([Cell::from(name.trim().to_string()), Cell::from(before.clone()), Cell::from(after.clone())]);
    }
    table
}

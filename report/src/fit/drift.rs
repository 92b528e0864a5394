//! Single changes that explain the logs, in words and as a page.

use super::value::value;
use crate::{Cell, Page, Table};
use taut::case::Case;
use taut::fit::{Change, Drift, Together};

/// The errors of the fitted logs, each with its unit.
pub fn fitted(all: &[Together]) -> Vec<String> {
    all.iter().filter(|one| !one.held_out).map(error).collect()
}

/// An error with its unit.
fn error(one: &Together) -> String {
    if one.rmse.is_finite() { value(one.rmse, one.quantity.unit(), 4) } else { "–".into() }
}

/// The parameter, its old and its new value, and the change in words.
pub fn words(change: &Change) -> [String; 4] {
    let estimate = &change.estimate;
    let shown = |number: f64| value(number, estimate.unit, 4);
    let percent = match estimate.start {
        0.0 => String::new(),
        start => format!("{:+.1} %", 100.0 * (estimate.value / start - 1.0)),
    };
    let bound = if estimate.at_bound { " (at its bound)" } else { "" };
    [estimate.name.clone(), shown(estimate.start), format!("{}{bound}", shown(estimate.value)), percent]
}

/// The changes that leave as little as the best, in a sentence.
pub fn verdict(found: &Drift) -> String {
    let names: Vec<&str> = found.best().map(|change| change.estimate.name.as_str()).collect();
    let Some(best) = found.changes.first() else { return "nothing could be changed".into() };
    let explained = 100.0 * (1.0 - best.left).max(0.0);
    if !found.is_changed() {
        let name = &best.estimate.name;
        return format!(
            "nothing changed beyond what these logs can tell: no single change explains more than noise does; that of \
             {name} explains most, {explained:.1} % of the sum of squares"
        );
    }
    match &names[..] {
        [] => "nothing could be changed".into(),
        [one] => format!("a change of {one} explains most: {explained:.1} % of the sum of squares"),
        [one, others @ ..] => format!(
            "a change of {one} explains {explained:.1} % of the sum of squares; {} act alike in these logs, which do not \
             tell them apart",
            others.join(", ")
        ),
    }
}

/// The page.
pub fn page(case: &Case, found: &Drift) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("Which single change explains the logs.");
    page.section("Single changes");
    page.prose(format!("{}.", verdict(found)));
    let mut rows =
        Table::new("Each change by itself, all else as the case has it; those that act alike and explain most first.");
    for heading in ["Parameter", "From", "To", "Change"] {
        rows = rows.column(heading, "");
    }
    for quantity in found.quantities() {
        rows = rows.column(format!("RMSE of {}", quantity.name().replace('_', " ")), "");
    }
    rows = rows.column("Left of the sum of squares", "");
    let row = |head: [String; 4], errors: Vec<String>, left: String| {
        head.into_iter().chain(errors).chain([left]).map(Cell::from).collect::<Vec<_>>()
    };
    let none = || String::new();
    rows.row(row(["as it is".into(), none(), none(), none()], fitted(&found.unchanged), "100 %".into()));
    for change in &found.changes {
        rows.row(row(words(change), fitted(&change.errors), format!("{:.2} %", 100.0 * change.left)));
    }
    page.table(&rows);
    page.case("", "case.toml", &case.text);
    page
}

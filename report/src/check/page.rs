//! The report: one HTML file.

use super::{shares, shown};
use crate::fit::value as told;
use crate::{Callout, Cell, Page, Table};
use taut::case::Case;
use taut::fit::{Balance, Check};

/// The page.
pub fn page(case: &Case, found: &Check) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("What the logs can tell of the parameters.");
    page.section("What is determined");
    verdict(&mut page, found);
    let mut rows = Table::new("How well each parameter would be known, all others free.");
    rows = rows.column("Parameter", "").column("Standard error", "");
    for (name, error) in shares(found) {
        rows.row([name, error].map(Cell::from));
    }
    page.table(&rows);
    page.prose(format!("{}.", found.noise_words));
    if !found.experiments.is_empty() {
        page.section("What one more experiment would tell");
        let mut rows =
            Table::new("By simulation, the best first.").column("Experiment", "").column("What it tells", "");
        for experiment in &found.experiments {
            rows.row([experiment.name.to_string(), experiment.told.clone()].map(Cell::from));
        }
        page.table(&rows);
    }
    if let Some(found) = &found.balance {
        regression(&mut page, found);
    }
    page.section("What the logs show");
    for log in &found.logs {
        shown(log, true).lines().for_each(|line| page.prose(line.trim()));
    }
    page.case("", "case.toml", &case.text);
    page
}

fn verdict(page: &mut Page, found: &Check) {
    match &found.identifiability {
        Some(known) if known.complete() => {
            page.callout(Callout::Holds, "All of it", "everything that is searched for is determined.");
        }
        Some(_) => {}
        None => page.callout(
            Callout::Fails,
            "At bounds",
            "everything that is searched for ended at a bound: there is no sensitivity to tell.",
        ),
    }
    for (group, choices) in found.groups() {
        page.callout(Callout::Fails, "Not determined", format!("{}.", group.words));
        choices.iter().for_each(|choice| page.prose(choice.to_string()));
    }
}

fn regression(page: &mut Page, found: &Balance) {
    page.section("A rigid axis by regression");
    let mut rows = Table::new("All at the drive pulley; a first guess, not a fit.");
    rows = rows.column("Quantity", "").column("Value", "").column("Standard error", "");
    for (name, unit, value, error) in super::regression(found) {
        rows.row([name.to_string(), told(value, unit, 5), told(error, unit, 2)].map(Cell::from));
    }
    page.table(&rows);
}

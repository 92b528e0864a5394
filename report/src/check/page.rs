//! The report: one HTML file.

use super::{findings, shares, surveys};
use crate::fit::value as told;
use crate::{Callout, Cell, Page, Table};
use taut::case::Case;
use taut::fit::{Balance, Check};

/// The page.
pub fn page(case: &Case, found: &Check) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("Parameters that the logs determine.");
    page.section("What is determined");
    verdict(&mut page, found);
    let mut rows = Table::new("Accuracy of each parameter, all others free.");
    rows = rows.column("Parameter", "").column("Standard error", "");
    for (name, error) in shares(found) {
        rows.row([name, error].map(Cell::from));
    }
    page.table(&rows);
    page.prose(format!("{}.", found.noise_words));
    findings(found).iter().for_each(|finding| page.prose(finding.as_str()));
    if !found.experiments.is_empty() {
        page.section("Most useful next experiments");
        let mut rows = Table::new("By simulation, the best first.").column("Experiment", "").column("Effect", "");
        for experiment in &found.experiments {
            rows.row([experiment.name.to_string(), experiment.told.clone()].map(Cell::from));
        }
        page.table(&rows);
    }
    if let Some(found) = &found.balance {
        regression(&mut page, found);
    }
    page.section("Logs");
    surveys(found).lines().for_each(|line| page.prose(line.trim()));
    page.case("", "case.toml", &case.text);
    page
}

fn verdict(page: &mut Page, found: &Check) {
    if !found.tells() {
        page.callout(Callout::Fails, "Nothing", "these logs determine none of the free parameters.");
    }
    match &found.identifiability {
        Some(known) if known.complete() => {
            page.callout(Callout::Holds, "All of it", "all free parameters are determined.");
        }
        Some(_) => {}
        None => page.callout(
            Callout::Fails,
            "At bounds",
            "all free parameters ended at a bound: their sensitivity is unknown.",
        ),
    }
    for (group, choices) in found.groups() {
        page.callout(Callout::Fails, "Not determined", format!("{}.", group.words));
        choices.iter().for_each(|choice| page.prose(choice.to_string()));
    }
}

fn regression(page: &mut Page, found: &Balance) {
    page.section("A rigid axis by regression");
    let mut rows = Table::new("All at the drive pulley; a first estimate, not a fit.");
    rows = rows.column("Quantity", "").column("Value", "").column("Standard error", "");
    for (name, unit, value, error) in super::regression(found) {
        rows.row([name.to_string(), told(value, unit, 5), told(error, unit, 2)].map(Cell::from));
    }
    page.table(&rows);
}

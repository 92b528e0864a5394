//! The report: one HTML file.

use super::Run;
use super::plots::Named;
use super::rows::{early_end, lines};
use crate::drawing::stage_drawing;
use crate::page::{Callout, Cell, Page, Table};
use taut::case::Case;
use taut::json::load_unit;
use taut::number;
use taut::solve::{Event, Solver};

/// Events shown; the rest is in the events' own file.
const MOST_EVENTS: usize = 200;

/// The page for these runs; `text` is the case that repeats them.
pub fn page(case: &Case, text: &str, solver: Solver, runs: &[Run], figures: &[Vec<Named>]) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle(how(solver));
    page.section("The stage");
    page.drawing(&stage_drawing(&case.machine), "Symbols, values and positive directions.");
    for (run, figures) in runs.iter().zip(figures) {
        experiment(&mut page, run, figures, solver);
    }
    page.case("This text repeats the run.", "case.toml", text);
    page
}

/// How it was solved.
pub fn how(solver: Solver) -> &'static str {
    match solver {
        Solver::Exact => "Solved exactly: modes and matrix exponentials, events located to rounding.",
        Solver::General { .. } => "Solved by collocation, with steps by their error, between located events.",
        Solver::Table3 { .. } => {
            "Solved with the friction function of the paper's Table 3 and a fixed step: a reproduction, not exact."
        }
    }
}

/// The key figures, a row for each.
pub fn figures_table(lines: Vec<(&'static str, String)>) -> Table {
    let mut table = Table::new("").column("Quantity", "").column("Value", "");
    for (name, value) in lines {
        table.row([Cell::from(name), Cell::from(value.replace('-', "−"))]);
    }
    table
}

fn experiment(page: &mut Page, run: &Run, figures: &[Named], solver: Solver) {
    page.section(&run.experiment.name);
    if let Some(told) = early_end(&run.outcome.ending) {
        page.callout(Callout::Fails, "The whole run", format!("This run {told}."));
    }
    page.table(&figures_table(lines(run, solver)));
    for (_, figure) in figures {
        page.figure(figure);
    }
    events(page, &run.outcome.events, &run.experiment.file_name(), load_unit);
}

/// The events of an experiment of this file name; `unit` is that of the load on a body.
pub fn events(page: &mut Page, events: &[Event], file: &str, unit: impl Fn(usize) -> &'static str) {
    if events.is_empty() {
        return;
    }
    page.subsection("Events");
    let mut table = Table::new("").column("Time", "s").column("Part", "").column("From", "").column("To", "");
    table = table.column("Load", "");
    for event in events.iter().take(MOST_EVENTS) {
        table.row([
            Cell::fixed(event.time, 9),
            Cell::from(event.part.name()),
            Cell::from(event.from.word()),
            Cell::from(event.to.word()),
            match event.body() {
                Some(body) => Cell::Number(number::engineering(event.load, unit(body), 4)),
                None => Cell::from(""),
            },
        ]);
    }
    page.table(&table);
    if events.len() > MOST_EVENTS {
        page.prose(format!("{} more are in {file}.events.csv.", events.len() - MOST_EVENTS));
    }
}

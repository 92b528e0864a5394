//! The report: one HTML file.

use super::SimulatedExperiment;
use super::live::live;
use super::plots::{Named, figures, way};
use super::rows::{early_end, lines, machine};
use crate::page::{Callout, Cell, Page, Table};
use crate::{Picture, Plane, drawn};
use taut::case::Case;
use taut::machine::Machine;
use taut::mechanism::Mechanism;
use taut::metrics::{self, Worth};
use taut::number;
use taut::solve::{Event, Solver};

/// Events shown; the rest is in the events' own file.
const MOST_EVENTS: usize = 200;

/// The page for these runs, and its pictures by the names of their files; `text` is the case that repeats them. With
/// `is_live`, the page has the machine in motion for each run.
pub fn report(
    case: &Case,
    text: &str,
    solver: Solver,
    runs: &[SimulatedExperiment],
    is_live: bool,
) -> (Page, Vec<(String, Picture)>) {
    let mechanism = case.machine.mechanism();
    let mut page = Page::new(case.title.clone()).subtitle(how(solver));
    let mut pictures = Vec::new();
    page.section("The machine");
    page.prose(format!("{}.", machine(&case.machine)));
    let drawing = drawn(&mut page, &case.machine);
    if case.machine.bridge.is_some() {
        pictures.push(("machine".to_string(), Picture::Drawing(drawing)));
    }
    for run in runs {
        let name = run.experiment.file_name();
        let (figures, way) = (figures(case, run), way(case, run));
        experiment(&mut page, (case, &mechanism, solver), run, (&figures, way.as_ref()), is_live);
        pictures.extend(way.map(|way| (format!("{name}-path"), way.into())));
        pictures.extend(figures.into_iter().map(|(figure, drawn)| (format!("{name}-{figure}"), drawn.into())));
    }
    page.case("This text repeats the run.", "case.toml", text);
    (page, pictures)
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
pub fn figures_table(lines: Vec<(impl Into<String>, String)>) -> Table {
    let mut table = Table::new("").column("Quantity", "").column("Value", "");
    for (name, value) in lines {
        table.row([Cell::from(name.into()), Cell::from(value.replace('-', "−"))]);
    }
    table
}

fn experiment(
    page: &mut Page,
    (case, mechanism, solver): (&Case, &Mechanism, Solver),
    run: &SimulatedExperiment,
    (figures, way): (&[Named], Option<&Plane>),
    is_live: bool,
) {
    page.section(&run.experiment.name);
    if let Some(told) = early_end(run, &case.machine) {
        page.callout(Callout::Fails, "The whole run", format!("This run {told}."));
    }
    page.table(&figures_table(lines(run, &case.machine, solver)));
    if let Some(json) = run.curves.as_ref().filter(|_| is_live).and_then(|curves| live(case, curves)) {
        let title = format!("{}: the machine in motion", run.experiment.name);
        let caption = "Play, or move the time. Stretch and the error between drive and load are magnified.";
        page.machine(&title, &json, caption);
    }
    for (name, figure) in figures {
        page.figure(figure);
        // The path stands behind the positions that it is made of.
        if let Some(way) = way.filter(|_| *name == "positions") {
            page.plane(way);
        }
    }
    all_figures(page, run, &case.machine);
    events(page, &run.outcome.events, &run.experiment.file_name(), |body| mechanism.bodies[body].kind.units()[2]);
}

/// Every key figure, from the list of them.
fn all_figures(page: &mut Page, run: &SimulatedExperiment, machine: &Machine) {
    page.subsection("Key figures");
    let mut table = Table::new("").column("Figure", "").column("Value", "").column("At", "s");
    for figure in metrics::figures(machine.kind, metrics::Extras::new(machine)) {
        let unit = figure.unit;
        let (value, at) = match figure.value(&run.metrics) {
            Worth::TimeOfPeak(_) => continue,
            Worth::Number(value) if value.is_nan() => (Cell::from("none"), Cell::from("")),
            Worth::Number(value) => (Cell::Number(number::engineering(value, unit, 6)), Cell::from("")),
            Worth::Peak(peak) => (Cell::Number(number::engineering(peak.value, unit, 6)), Cell::fixed(peak.time, 9)),
            Worth::Flag(flag) => (Cell::from(if flag { "yes" } else { "no" }), Cell::from("")),
        };
        table.row([Cell::from(figure.words), value, at]);
    }
    page.table(&table);
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

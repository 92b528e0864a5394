//! The report: one HTML file.

use super::Run;
use super::rows::{early_end, lines, machine};
use crate::gantry::gantry_drawing;
use crate::page::{Callout, Page};
use crate::plane::Plane;
use crate::simulate::page::{events, figures_table, how};
use crate::simulate::plots::Named;
use taut::case::Case;
use taut::mechanism::Mechanism;
use taut::solve::Solver;

/// The page for these runs; `text` is the case that repeats them.
pub fn page(
    case: &Case,
    text: &str,
    solver: Solver,
    runs: &[Run],
    figures: &[Vec<Named>],
    ways: &[Option<Plane>],
) -> Page {
    let mechanism = case.machine.mechanism();
    let mut page = Page::new(case.title.clone()).subtitle(how(solver));
    page.section("The machine");
    page.prose(format!("{}.", machine(&case.machine)));
    page.drawing(
        &gantry_drawing(&case.machine),
        "In plan view with positive directions; lengths are not to scale. In the model the bridge does not yaw, and idlers have \
         neither inertia nor friction.",
    );
    let setting = Setting { case, mechanism: &mechanism, solver };
    for ((run, figures), way) in runs.iter().zip(figures).zip(ways) {
        experiment(&mut page, &setting, run, figures, way.as_ref());
    }
    page.case("This text repeats the run.", "case.toml", text);
    page
}

/// Settings that all runs of a page share.
struct Setting<'a> {
    case: &'a Case,
    mechanism: &'a Mechanism,
    solver: Solver,
}

fn experiment(page: &mut Page, setting: &Setting, run: &Run, figures: &[Named], way: Option<&Plane>) {
    let gantry = &setting.case.machine;
    page.section(&run.experiment.name);
    if let Some(told) = early_end(run, gantry) {
        page.callout(Callout::Fails, "The whole run", format!("This run {told}."));
    }
    page.table(&figures_table(lines(run, gantry, setting.solver)));
    for (name, figure) in figures {
        page.figure(figure);
        // The path stands behind the positions that it is made of.
        if let Some(way) = way.filter(|_| *name == "positions") {
            page.plane(way);
        }
    }
    let unit = |body: usize| setting.mechanism.bodies[body].kind.units()[2];
    events(page, &run.outcome.events, &run.experiment.file_name(), unit);
}

//! The report: one HTML file.

use super::super::page::{events, figures_table, how, repeated};
use super::super::plots::Named;
use super::run::{Run, Setting};
use super::table::{early_end, lines, machine};
use taut_report::{Callout, Page, Plane, gantry_drawing};

/// The page for these runs; `text` is the case that repeats them.
pub fn page(setting: &Setting, text: &str, runs: &[Run], figures: &[Vec<Named>], ways: &[Option<Plane>]) -> Page {
    let case = setting.case;
    let mut page = Page::new(case.title.clone()).subtitle(how(setting.solver));
    page.section("The machine");
    page.prose(format!("{}.", machine(&case.gantry)));
    page.drawing(
        &gantry_drawing(&case.gantry),
        "In plan view with positive directions; lengths are not to scale. In the model the bridge does not yaw, and idlers have \
         neither inertia nor friction.",
    );
    for ((run, figures), way) in runs.iter().zip(figures).zip(ways) {
        experiment(&mut page, setting, run, figures, way.as_ref());
    }
    repeated(&mut page, text);
    page
}

fn experiment(page: &mut Page, setting: &Setting, run: &Run, figures: &[Named], way: Option<&Plane>) {
    let gantry = &setting.case.gantry;
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

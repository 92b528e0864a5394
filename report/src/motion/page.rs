//! The report: one HTML file.

use super::Tried;
use super::rows::{controller, lines};
use crate::drawn;
use crate::page::{Callout, Cell, Page, Table};
use crate::simulate::{Named, ended_early, figures_table};
use taut::control::drives::drive_gains;

/// The page; `text` is the case that repeats the moves.
pub fn page(tried: &Tried, text: &str, figures: &[Vec<Named>]) -> Page {
    let words = controller(tried.design, &tried.case.machine);
    let mut page = Page::new(tried.case.title.clone()).subtitle(format!("Moves in closed loop: {words}."));
    page.section("The stage");
    drawn(&mut page, &tried.case.machine);
    for (done, figures) in tried.done.iter().zip(figures) {
        page.section(&done.motion.name);
        if let Some(told) = ended_early(&done.run.outcome.ending, "cart") {
            page.callout(Callout::Fails, "The whole move", format!("This move {told}."));
        }
        page.table(&figures_table(lines(tried, done)));
        for (_, figure) in figures {
            page.figure(figure);
        }
    }
    page.section("Feed-forward for drives");
    page.prose("Of the axis as one mass going forward, as others name the gains and in their units.");
    let mut rows = Table::new("").column("System", "").column("Gain", "").column("Value", "").column("Unit", "");
    for gain in drive_gains(&tried.case.machine) {
        rows.row([Cell::from(gain.system), gain.name.into(), Cell::number(gain.value, 5), gain.unit.into()]);
    }
    page.table(&rows);
    page.case("This text repeats the moves.", "case.toml", text);
    page
}

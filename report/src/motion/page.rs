//! The report: one HTML file.

use super::Tried;
use super::plots::{figures, path};
use super::rows::{controller, lines};
use crate::drawn;
use crate::page::{Callout, Cell, Page, Table};
use crate::picture::Picture;
use crate::simulate::{ended_early, figures_table};
use taut::control::drives::{DriveGain, drive_gains};

/// The page, and its pictures by the names of their files; `text` is the case that repeats the moves.
pub fn page(tried: &Tried, text: &str) -> (Page, Vec<(String, Picture)>) {
    let machine = &tried.case.machine;
    let mut pictures = Vec::new();
    let words = controller(tried.design, machine);
    let mut page = Page::new(tried.case.title.clone()).subtitle(match tried.design.is_open_loop() {
        true => format!("Moves in {words}."),
        false => format!("Moves in closed loop: {words}."),
    });
    page.section("The machine");
    drawn(&mut page, machine);
    for done in &tried.done {
        let (figures, path) = (figures(machine, done), path(done));
        let file = |name: &str| format!("{}-{name}", done.motion.file_name());
        page.section(&done.motion.name);
        if let Some(told) = ended_early(&done.run.outcome.ending, "cart") {
            page.callout(Callout::Fails, "The whole move", format!("This move {told}."));
        }
        page.table(&figures_table(lines(tried, done)));
        if let Some(path) = &path {
            page.plane(path);
        }
        for (_, figure) in &figures {
            page.figure(figure);
        }
        pictures.extend(path.map(|path| (file("path"), path.into())));
        pictures.extend(figures.into_iter().map(|(name, figure)| (file(name), figure.into())));
    }
    let gains = drive_gains(machine);
    if !gains.is_empty() {
        drives(&mut page, &gains);
    }
    page.case("This text repeats the moves.", "case.toml", text);
    (page, pictures)
}

/// Feed-forward gains in the units of drives.
fn drives(page: &mut Page, gains: &[DriveGain]) {
    page.section("Feed-forward for drives");
    page.prose("Of the axis as one mass going forward, as others name the gains and in their units.");
    let mut rows = Table::new("").column("System", "").column("Gain", "").column("Value", "").column("Unit", "");
    for gain in gains {
        rows.row([Cell::from(gain.system), gain.name.into(), Cell::number(gain.value, 5), gain.unit.into()]);
    }
    page.table(&rows);
}

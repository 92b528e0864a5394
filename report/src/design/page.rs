//! The report: one HTML file.

use super::rows::{heading, inputs, limits, measured, own, promises, verified};
use crate::{Callout, Cell, Figure, Page, Table};
use taut::case::Case;
use taut::fit::experiment_design::{Designed, Verified};

/// The page; `text` is the case with the experiment in it.
pub fn page(case: &Case, found: &Designed, checked: &[Verified], figure: &Figure, text: &str) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("An experiment that determines parameters best.");
    let wanted = || found.promises.iter().filter(|promise| promise.wanted);
    let count = wanted().count();
    match wanted().filter(|promise| promise.is_determined()).count() {
        all if all == count => page.callout(Callout::Holds, "All of it", format!("{}.", heading(found))),
        some => page.callout(Callout::Fails, format!("{some} of {count}"), format!("{}.", heading(found))),
    }
    for (group, choices) in &found.undetermined {
        page.callout(Callout::Fails, "Not determined", format!("{}.", group.words));
        choices.iter().for_each(|choice| page.prose(choice.to_string()));
    }
    page.section("What it promises");
    let caption = format!(
        "Standard errors, all others free, {} % of the value for the model included; those that the design is for stand \
         first.",
        taut::quantity::rounded(100.0 * found.model_error)
    );
    page.table(&table(&caption, ["Parameter", "Value", "Standard error", "Relative"], promises(found)));
    page.prose(format!("{}.", measured(found)));
    if !checked.is_empty() {
        let caption = "What fits of simulated logs found, each of a machine of its own: errors over those of an exact \
                       model, and how many intervals hold.";
        page.table(&table(caption, ["Parameter", "Root mean square", "Mean", "95 % intervals"], verified(checked)));
    }
    page.section("The experiment");
    page.figure(figure);
    let caption = format!(
        "How far it goes; {:.0} % of each limit is left free, also where a free parameter is off by {:.0} %.",
        100.0 * found.limits.margin,
        100.0 * found.doubt
    );
    page.table(&table(&caption, ["", "Reached", "Limit", "Whose"], limits(found, &case.machine)));
    page.embed("As the case file has it", &found.toml(&case.machine));
    page.section("Other inputs");
    let caption = format!("Mean relative error ({}) of the best of each kind.", found.criterion.word());
    page.table(&table(&caption, ["Input", "Error", "Search"], inputs(found)));
    if !found.own.is_empty() {
        let caption = "The case's own experiments, measured in the same way.";
        page.table(&table(caption, ["Experiment", "Error", ""], own(found)));
    }
    page.case("with the experiment", "designed.toml", text);
    page
}

fn table<const N: usize>(caption: &str, columns: [&str; N], rows: Vec<[String; N]>) -> Table {
    let mut table = columns.iter().fold(Table::new(caption), |table, column| table.column(*column, ""));
    rows.into_iter().for_each(|row| table.row(row.map(Cell::from)));
    table
}

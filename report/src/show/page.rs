//! The report: one HTML file.

use super::rows::{rows, value};
use crate::modes::printed;
use crate::simulate::Named;
use crate::{Axis, Callout, Cell, Colour, Figure, Page, Panel, Series, Table, drawn};
use taut::case::Case;
use taut::overview::Overview;

/// Frequencies and stretch along the travel of an axis whose spans follow the cart.
pub fn figures(overview: &Overview) -> Vec<Named> {
    if !overview.depends_on_place || overview.kind != "axis" {
        return Vec::new();
    }
    let x: Vec<f64> = overview.places.iter().map(|place| place.position[0]).collect();
    let modes = overview.places.iter().map(|place| place.modes.len()).min().unwrap_or(0);
    let mut frequencies = Panel::new(Axis::new("Frequency", "Hz").logarithmic()).weight(1.4);
    for k in 0..modes {
        let hertz: Vec<f64> = overview.places.iter().map(|place| place.modes[k].0).collect();
        let series = Series::new(format!("resonance {}", k + 1), x.clone(), hertz);
        frequencies = frequencies.series(series.colour(Colour::CYCLE[k % Colour::CYCLE.len()]));
    }
    let stretch: Vec<f64> = overview.places.iter().map(|place| place.stretch[0]).collect();
    let stretch = Panel::new(Axis::new("Stretch per newton", "m/N").shown_as("µm/N", 1e6)).line("", &x, &stretch);
    let figure = Figure::new("Along the travel", Axis::new("Cart position", "m").shown_as("mm", 1e3))
        .panel(frequencies)
        .panel(stretch)
        .caption(
            "Natural frequencies without damping, and displacement of the cart per force, with the drive pulley held.",
        );
    vec![("travel", figure)]
}

/// The page.
pub fn page(case: &Case, overview: &Overview, figures: &[Named]) -> Page {
    let mut page = Page::new(overview.title.clone()).subtitle("What follows from its numbers");
    page.section("The machine");
    drawn(&mut page, &case.machine);
    for note in &overview.notes {
        page.callout(Callout::Note, "Note", format!("{}.", note.text));
    }
    for group in &overview.groups {
        page.section(group.name);
        let mut rows = Table::new("").column("Quantity", "").column("Value", "").column("How", "");
        for row in &group.rows {
            rows.row([row.name.clone(), printed(&value(row)), printed(&row.how)].map(Cell::from));
        }
        page.table(&rows);
    }
    if overview.depends_on_place {
        page.section(if overview.kind == "axis" { "Along the travel" } else { "Over the working area" });
        let places = rows(overview);
        let (head, rest) = places.split_first().map_or((&[][..], &[][..]), |(head, rest)| (&head[..], rest));
        let mut places = head.iter().fold(Table::new(""), |table, name| table.column(name.clone(), ""));
        rest.iter().for_each(|row| places.row(row.iter().map(|cell| Cell::from(printed(cell)))));
        page.table(&places);
        figures.iter().for_each(|(_, figure)| page.figure(figure));
    }
    page.case("", "case.toml", case.text.as_str());
    page
}

//! The report: one HTML file.

use super::Named;
use super::rows::{elastic, over_the_area, rigid, slow};
use crate::Figure;
use crate::machine_drawing;
use crate::modes::page::printed;
use crate::modes::rows::pole;
use crate::page::{Callout, Cell, Page, Table};
use crate::simulate::machine;
use taut::linear::GantryAnalysis;

/// The page.
pub fn page(analysis: &GantryAnalysis, planes: &[Named], responses: &[(String, Figure)]) -> Page {
    let gantry = &analysis.case.machine;
    let mechanism = gantry.mechanism();
    let mut page = Page::new(analysis.case.title.clone()).subtitle("How it swings");
    page.section("What was linearised");
    page.prose(format!("{}.", machine(gantry)));
    page.callout(Callout::Note, "While it slides", analysis.words.join("; "));
    page.drawing(
        &machine_drawing(gantry),
        "In plan view with positive directions; lengths are not to scale. In the model the bridge does not yaw, and idlers have \
         neither inertia nor friction.",
    );
    page.section("Rigid modes");
    page.prose("Motions that stretch nothing: bridge or cart by themselves, and how the drive pulleys turn with them.");
    let mut rows = Table::new("").column("Moves", "").column("Drive pulleys", "");
    for mode in &analysis.modes.rigid {
        let (name, ways) = rigid(analysis, &mechanism, mode);
        rows.row([Cell::from(name), Cell::from(printed(&ways))]);
    }
    page.table(&rows);
    let mut rows = Table::new("").column("Pole", "").column("What", "");
    for root in slow(analysis) {
        let (value, more) = pole(root);
        rows.row([Cell::from(printed(&value)), Cell::from(printed(&more))]);
    }
    page.table(&rows);
    page.section("Elastic modes");
    page.prose(
        "With bridge and cart at zero: frequency without damping, what damping makes of it, how far each body goes at the belt \
         (r φ of the pulleys; the largest is 1), and the bodies' shares of the energy.",
    );
    let mut rows = Table::new("").column("Frequency", "").column("Damped", "").column("Ways", "").column("Energy", "");
    for mode in &analysis.modes.elastic {
        let cell = |text: &String| Cell::from(printed(text.rsplit(": ").next().unwrap_or(text)));
        let told = elastic(analysis, &mechanism, mode);
        rows.row(told.iter().map(cell).collect::<Vec<_>>());
    }
    page.table(&rows);
    page.section("Over the working area");
    let mut told = over_the_area(analysis).to_string();
    told[..1].make_ascii_uppercase();
    page.prose(told + ".");
    for (_, plane) in planes {
        page.plane(plane);
    }
    page.section("What the drives do");
    page.prose(
        "The frequency responses of each drive's input, the other one being zero, with bridge and cart at zero.",
    );
    for (_, figure) in responses {
        page.figure(figure);
    }
    page.case("", "case.toml", &analysis.case.text);
    page
}

//! The report: one HTML file.

use super::rows::{along, gain, pole, poles, words, z, zeros};
use crate::drawing::stage_drawing;
use crate::page::{Callout, Cell, Page, Table};
use crate::simulate::Named;
use taut::linear::Analysis;
use taut::number::{engineering, engineering_typed};

/// The page.
pub fn page(analysis: &Analysis, figures: &[Named]) -> Page {
    let mut page = Page::new(analysis.case.title.clone()).subtitle("Linear analysis");
    page.section("What was linearised");
    let head = if analysis.sticks { "While it slides" } else { "As it is" };
    page.callout(Callout::Note, head, analysis.words.join("; "));
    page.drawing(&stage_drawing(&analysis.case.machine), "Symbols, values and positive directions.");
    page.section("Poles");
    let mut rows = Table::new("").column("Where", "").column("What", "");
    for root in poles(analysis) {
        let (value, more) = pole(root);
        rows.row([Cell::from(printed(&value)), Cell::from(printed(&more))]);
    }
    page.table(&rows);
    page.section("Outputs");
    page.prose("Zeros are invariant zeros; one at 0 takes the integrator away from an output that does not see where the axis is.");
    let mut rows = Table::new("").column("Output", "").column("In the long run", "").column("Zeros", "");
    for (output, transfer) in analysis.system.outputs.iter().zip(&analysis.transfers) {
        let told = gain(transfer, output.unit, analysis.system.input.unit);
        rows.row([words(&output.name), printed(&told), printed(&zeros(transfer))].map(Cell::from));
    }
    page.table(&rows);
    page.section("Frequency response");
    for (_, figure) in figures.iter().filter(|(name, _)| name.starts_with("bode")) {
        page.figure(figure);
    }
    page.section("Along the travel");
    page.prose(along(analysis));
    for (_, figure) in figures.iter().filter(|(name, _)| *name == "travel") {
        page.figure(figure);
    }
    page.section("Poles and zeros");
    for (_, figure) in figures.iter().filter(|(name, _)| *name == "poles-and-zeros") {
        page.figure(figure);
    }
    if let Some(model) = &analysis.discrete {
        page.section("Discrete-time model");
        let [time, delay] = [model.sample_time, model.delay].map(|value| engineering(value, "s", 5));
        page.prose(format!(
            "Sample time {time}, {}, input late by {delay}. Matrices are in modes.json.",
            model.hold.words()
        ));
        let mut rows = Table::new("").column("Pole z", "").column("|z|", "");
        for value in model.poles().iter().filter(|value| value.im >= 0.0) {
            rows.row([
                Cell::from(printed(&z(value)).replace("+/−", "±")),
                Cell::from(engineering_typed(value.norm(), "", 6)),
            ]);
        }
        page.table(&rows);
    }
    page.case("", "case.toml", &analysis.case.text);
    page
}

/// Text of the terminal with true minus signs.
pub fn printed(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut before = ' ';
    for c in text.chars() {
        // A sign stands before a digit and after no letter: "anti-resonance" and "1e-3" keep their hyphens.
        let sign = c == '-' && !before.is_alphanumeric();
        out.push(if sign { '−' } else { c });
        before = c;
    }
    out
}

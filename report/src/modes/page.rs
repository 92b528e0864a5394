//! The report: one HTML file.

use super::pictures::Pictures;
use super::rows::{elastic, gain, pole, rigid, where_it_matters, words, z, zeros};
use crate::drawn;
use crate::page::{Callout, Cell, Page, Table};
use crate::simulate::machine;
use taut::linear::{Analysis, ByInput, Discrete, Natural, Root};
use taut::number::{engineering, engineering_typed};

/// The page.
pub fn page(analysis: &Analysis, pictures: &Pictures) -> Page {
    let mut page = Page::new(analysis.case.title.clone()).subtitle("Linear analysis");
    page.section("What was linearised");
    page.prose(format!("{}.", machine(&analysis.case.machine)));
    let head = if analysis.sticks { "While it slides" } else { "As it is" };
    page.callout(Callout::Note, head, analysis.words.join("; "));
    drawn(&mut page, &analysis.case.machine);
    page.section("Poles");
    let mut rows = Table::new("").column("Where", "").column("What", "");
    for root in Root::from_values(&analysis.poles) {
        let (value, more) = pole(root);
        rows.row([Cell::from(printed(&value)), Cell::from(printed(&more))]);
    }
    page.table(&rows);
    if let Some(modes) = &analysis.modes {
        shapes(&mut page, analysis, modes);
    }
    for (one, figures) in analysis.inputs.iter().zip(&pictures.bode) {
        outputs(&mut page, one, analysis.inputs.len() > 1);
        page.section("Frequency response");
        for (_, figure) in figures {
            page.figure(figure);
        }
    }
    page.section(if analysis.case.machine.bridge.is_some() { "Over the working area" } else { "Along the travel" });
    let mut place = where_it_matters(analysis).to_string();
    place[..1].make_ascii_uppercase();
    page.prose(place + ".");
    pictures.travel.iter().for_each(|figure| page.figure(figure));
    pictures.maps.iter().for_each(|(_, plane)| page.plane(plane));
    page.section("Poles and zeros");
    pictures.roots.iter().for_each(|(_, figure)| page.figure(figure));
    for model in analysis.inputs.iter().filter_map(|one| one.discrete.as_ref()).take(1) {
        sampled(&mut page, model);
    }
    page.case("", "case.toml", &analysis.case.text);
    page
}

/// Mode shapes and energies.
fn shapes(page: &mut Page, analysis: &Analysis, modes: &Natural) {
    let mechanism = analysis.case.machine.mechanism();
    page.section("Modes");
    if !modes.rigid.is_empty() {
        page.prose("Rigid modes stretch nothing: one part by itself, and how the others go with it.");
        let mut rows = Table::new("").column("Moves", "").column("With it", "");
        for mode in &modes.rigid {
            let (name, ways) = rigid(&mechanism, modes, mode);
            rows.row([Cell::from(name), Cell::from(printed(&ways))]);
        }
        page.table(&rows);
    }
    if modes.elastic.is_empty() {
        return;
    }
    page.prose(
        "Elastic modes: frequency without damping, what damping makes of it, how far each body goes at the belt \
         (r φ of pulleys; the largest is 1), and the bodies' shares of the energy.",
    );
    let mut rows = Table::new("").column("Frequency", "").column("Damped", "").column("Ways", "").column("Energy", "");
    for mode in &modes.elastic {
        let cell = |text: &String| Cell::from(printed(text.rsplit(": ").next().unwrap_or(text)));
        rows.row(elastic(&mechanism, modes, mode).iter().map(cell).collect::<Vec<_>>());
    }
    page.table(&rows);
}

/// Gains and zeros from an input.
fn outputs(page: &mut Page, one: &ByInput, several: bool) {
    let input = &one.system.input;
    page.section(&if several { format!("Outputs: {}", words(&input.name)) } else { "Outputs".into() });
    page.prose("Zeros are invariant zeros; one at 0 takes the integrator away from an output that does not see where the machine is.");
    let mut rows = Table::new("").column("Output", "").column("In the long run", "").column("Zeros", "");
    for (output, transfer) in one.system.outputs.iter().zip(&one.transfers) {
        let told = gain(transfer, output.unit, input.unit);
        rows.row([words(&output.name), printed(&told), printed(&zeros(transfer))].map(Cell::from));
    }
    page.table(&rows);
}

/// The discrete-time model: all inputs have the same poles.
fn sampled(page: &mut Page, model: &Discrete) {
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

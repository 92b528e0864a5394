//! The machine of a case alone, as a case file: what the shared object reads.

use crate::case::{Case, Unread};
use crate::error::{Error, Result};
use toml_edit::{ArrayOfTables, DocumentMut, Item, Table, value};

/// Tables that say nothing of the machine, or of how its controller works.
const OTHERS: [&str; 8] = ["experiment", "move", "fit", "tune", "uncertainty", "sweep", "measurement", "campaign"];

/// The text of a case without its experiments, logs, fits and sweeps: one experiment is left, which says where the
/// machine starts from and how long it runs, its inputs zero. It names no other file.
pub fn resource(case: &Case) -> Result<String> {
    let text = case.text.as_str();
    let mut document: DocumentMut =
        text.parse().map_err(|_| Error::new("the text of this case cannot be taken apart"))?;
    let first = first_experiment(&document);
    OTHERS.iter().for_each(|table| {
        document.remove(table);
    });
    let [until, every] = times(case);
    let mut experiment = Table::new();
    experiment.insert("name", value("as exported"));
    experiment.insert("input", at_rest(case));
    experiment.insert("until", value(until));
    experiment.insert("every", value(every));
    if let Some(initial) = first.and_then(|table| table.get("initial").cloned()) {
        experiment.insert("initial", initial);
    }
    let mut list = ArrayOfTables::new();
    list.push(experiment);
    document.insert("experiment", Item::ArrayOfTables(list));
    if document.get("title").is_none() {
        document.insert("title", value(case.title.as_str()));
        document.key_mut("title").iter_mut().for_each(|key| key.leaf_decor_mut().clear());
    }
    let text = document.to_string();
    // The shared object must be able to read it.
    Case::from_text_with("machine.toml", &text, &[])?;
    Ok(text)
}

/// End and interval of the first experiment, or of a second in milliseconds.
pub(super) fn times(case: &Case) -> [f64; 2] {
    case.first(|one| [one.until, one.every], Unread::span).unwrap_or([1.0, 1e-3])
}

fn first_experiment(document: &DocumentMut) -> Option<Table> {
    match document.get("experiment")? {
        Item::ArrayOfTables(tables) => tables.get(0).cloned(),
        other => other.as_array()?.get(0)?.as_inline_table().map(|table| table.clone().into_table()),
    }
}

/// No input.
fn at_rest(case: &Case) -> Item {
    let step = |unit: &str| {
        let mut table = toml_edit::InlineTable::new();
        table.insert("step", format!("0 {unit}").into());
        table
    };
    if case.is_axis() {
        return value(step(case.machine.drives[0].amplifier.mode.unit()));
    }
    let mut table = toml_edit::InlineTable::new();
    for (side, unit) in case.machine.geometry().sides().zip(&case.machine.drives) {
        table.insert(side, step(unit.amplifier.mode.unit()).into());
    }
    value(table)
}

//! The table as text for the documents.

use super::field::{List, Of};
use super::table::SECTIONS;
use super::{Fallback, Field, Off, Parameter, all};
use crate::quantity::shortest;
use std::fmt::Write;

/// The parameters of a section as a Markdown table.
pub fn markdown(section: &str) -> String {
    let mut text = String::from(
        "| key | symbol | SI unit | default | range | example | meaning |\n|---|---|---|---|---|---|---|\n",
    );
    let rows = SECTIONS.iter().filter(|(name, _)| *name == section).flat_map(|(_, groups)| groups.iter());
    for p in rows.flat_map(|rows| rows.iter()) {
        let key =
            p.key.strip_prefix("input.").or_else(|| p.key.strip_prefix(section).map(|k| &k[1..])).unwrap_or(p.key);
        let default = match p.default {
            Fallback::Required => "required".to_string(),
            Fallback::Value(value) => shortest(value),
            Fallback::Words(words) => words.to_string(),
        };
        let unit = if p.unit.is_empty() { "–" } else { p.unit };
        let symbol = if p.symbol.is_empty() { "–" } else { p.symbol };
        let _ = writeln!(
            text,
            "| `{key}` | {symbol} | {unit} | {default} | {} | {} | {} |",
            p.range.short(),
            p.example,
            p.sentence
        );
    }
    text
}

/// The parameters that can be free, as a Markdown table.
pub fn free_markdown() -> String {
    let mut text =
        String::from("| key | machine | `--vary all` | off together with | goes along with |\n|---|---|---|---|---|\n");
    for row in all() {
        let Some(accessor) = row.field.accessor() else { continue };
        let (machine, list) = match accessor.of {
            Of::Machine | Of::Drive => ("both", List::None),
            Of::Span => ("both", List::Numbers),
            Of::Axis => ("axis", List::None),
            Of::Gantry => ("gantry", List::None),
            Of::Point(_) => ("axis", List::Points),
            Of::Slide => ("gantry", List::Slides),
            Of::SlidePoint(_) => ("gantry", List::SlidePoints(1)),
        };
        let all = match row.off {
            Off::No => "–",
            Off::Alone | Off::With(_) => "yes",
        };
        let kind = match row.off {
            Off::With(kind) if machine != "gantry" => kind,
            Off::With(_) | Off::No | Off::Alone => "–",
        };
        let form = match row.field {
            Field::Form(of, _) => Some(of),
            _ => None,
        };
        let along = match (form, row.follows) {
            (Some(of), _) => format!("is another form of `{}`", last(of)),
            (None, []) => "–".to_string(),
            (None, keys) => keys.iter().map(|key| format!("`{}`", last(key))).collect::<Vec<_>>().join(", "),
        };
        let _ = writeln!(text, "| {} | {machine} | {all} | {kind} | {along} |", keys(row, list));
    }
    text
}

fn last(key: &str) -> &str {
    key.rsplit_once(".friction.").map_or(key, |(_, name)| name)
}

/// A key, and those of its elements.
fn keys(row: &Parameter, list: List) -> String {
    let element = |index| list.key(row.key, index);
    match list {
        List::None | List::Drives(_) => format!("`{}`", row.key),
        List::Numbers => format!("`{}`, `{}` to `.2`", row.key, element(0)),
        List::Points => format!("`{}`, `{}` and so on", row.key, element(0)),
        List::SlidePoints(of_bridge) => format!("`{}`, `{}` and so on", element(0), element(of_bridge)),
        List::Slides => format!("`{}`, `{}`", element(0), element(1)),
    }
}

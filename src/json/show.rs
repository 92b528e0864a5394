//! The overview of a machine: `taut show --json`, `show.json`.

use super::number;
use crate::overview::{FiguresAt, Overview, Row};
use serde_json::{Value, json};

/// The rows by what they are about, the places, and what should be known besides.
pub fn show(overview: &Overview) -> Value {
    let row = |row: &Row| {
        json!({
            "key": row.key,
            "name": row.name,
            "value": number(row.value),
            "unit": row.unit,
            "how": row.how,
        })
    };
    let place = |place: &FiguresAt| {
        json!({
            "position_m": place.position,
            "span_stiffness_newton_per_m": place.stiffness.iter().map(|k| number(*k)).collect::<Vec<_>>(),
            "stretch_m_per_newton": place.stretch.iter().map(|s| number(*s)).collect::<Vec<_>>(),
            "resonances": place.modes.iter().map(|(hertz, ratio)| json!({
                "frequency_Hz": number(*hertz),
                "damping_ratio": ratio.map_or(Value::Null, number),
            })).collect::<Vec<_>>(),
            "held_frequency_Hz": place.held.map_or(Value::Null, number),
        })
    };
    json!({
        "schema": super::identity("show"),
        "title": overview.title,
        "version": env!("CARGO_PKG_VERSION"),
        "kind": overview.kind,
        "groups": overview.groups.iter().map(|group| json!({
            "key": group.key,
            "name": group.name,
            "rows": group.rows.iter().map(row).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "depends_on_place": overview.depends_on_place,
        "places": overview.places.iter().map(place).collect::<Vec<_>>(),
        "notes": overview.notes.iter().map(|note| json!({ "code": note.code, "text": note.text })).collect::<Vec<_>>(),
    })
}

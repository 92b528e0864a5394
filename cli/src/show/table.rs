//! The result for people on a terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::number::{ascii, engineering, fixed};
use taut::overview::{Overview, Place, Row};

/// Width of the column of names.
const NAMES: usize = 42;
/// Width of the column of values.
const VALUES: usize = 16;

/// The text on the terminal.
pub fn text(overview: &Overview) -> String {
    let mut text = format!("{}\n", bold(&overview.title));
    for group in &overview.groups {
        let _ = write!(text, "\n{}\n", bold(group.name));
        for row in &group.rows {
            let value = ascii(&value(row));
            let line = format!("  {:<NAMES$}{value:<VALUES$}{}", row.name, ascii(&row.how));
            let _ = writeln!(text, "{}", line.trim_end());
        }
    }
    places(&mut text, overview);
    text.push('\n');
    for note in &overview.notes {
        let _ = writeln!(text, "note: {}", ascii(&note.text));
    }
    text
}

/// A value as it is read: shares in per cent.
pub fn value(row: &Row) -> String {
    match row.unit {
        "" if row.key.contains("share") => format!("{} %", engineering(100.0 * row.value, "", 3)),
        unit => engineering(row.value, unit, 4),
    }
}

/// What changes along the travel.
fn places(text: &mut String, overview: &Overview) {
    let is_axis = overview.kind == "axis";
    if !overview.depends_on_place {
        return;
    }
    let _ = write!(text, "\n{}\n", bold(if is_axis { "Along the travel" } else { "Over the working area" }));
    for (k, row) in rows(overview).iter().enumerate() {
        let cells: Vec<String> = row.iter().map(|cell| format!("{:>12}", ascii(cell))).collect();
        let line = format!("  {}", cells.concat());
        let _ = writeln!(text, "{}", if k == 0 { line.to_lowercase().replace("hz", "Hz") } else { line });
    }
}

/// Headings, and a row for each place.
pub fn rows(overview: &Overview) -> Vec<Vec<String>> {
    let modes = overview.places.first().map_or(0, |place| place.modes.len());
    let mut head: Vec<String> = match overview.kind {
        "axis" => vec!["Position".into(), "Stretch".into()],
        _ => vec!["Bridge".into(), "Cart".into(), "Stretch x".into(), "Stretch y".into()],
    };
    for k in 1..=modes {
        head.extend([format!("Mode {k}"), format!("Damping {k}")]);
    }
    let has_held = overview.places.iter().any(|place| place.held.is_some());
    head.extend(has_held.then(|| "Drive held".to_string()));
    let row = |place: &Place| {
        let mut row: Vec<String> = place.position.iter().map(|x| format!("{} mm", fixed(1e3 * x, 1))).collect();
        row.extend(place.stretch.iter().map(|stretch| engineering(*stretch, "m/N", 4)));
        for (hertz, ratio) in &place.modes {
            row.push(engineering(*hertz, "Hz", 4));
            row.push(ratio.map_or("-".to_string(), |ratio| engineering(ratio, "", 3)));
        }
        row.extend(place.held.map(|hertz| engineering(hertz, "Hz", 4)));
        row
    };
    std::iter::once(head).chain(overview.places.iter().map(row)).collect()
}

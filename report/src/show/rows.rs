//! The overview of a machine in words.

use taut::number::{engineering_typed, fixed, typed};
use taut::overview::{FiguresAt, Overview, Row};

/// A value as it is read: shares in per cent.
pub fn value(row: &Row) -> String {
    match row.unit {
        "" if row.key.contains("share") => format!("{} %", engineering_typed(100.0 * row.value, "", 3)),
        unit => engineering_typed(row.value, unit, 4),
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
    let row = |place: &FiguresAt| {
        let mut row: Vec<String> = place.position.iter().map(|x| typed(&format!("{} mm", fixed(1e3 * x, 1)))).collect();
        row.extend(place.stretch.iter().map(|stretch| engineering_typed(*stretch, "m/N", 4)));
        for (hertz, ratio) in &place.modes {
            row.push(engineering_typed(*hertz, "Hz", 4));
            row.push(ratio.map_or("-".to_string(), |ratio| engineering_typed(ratio, "", 3)));
        }
        row.extend(place.held.map(|hertz| engineering_typed(hertz, "Hz", 4)));
        row
    };
    std::iter::once(head).chain(overview.places.iter().map(row)).collect()
}

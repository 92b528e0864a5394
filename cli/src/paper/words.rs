//! Numbers as they stand in sentences.

use taut::number::{engineering, significant};

/// A relative change in per cent with its sign: `−49.2 %`.
pub fn percent(change: f64) -> String {
    signed(100.0 * change, 3) + "\u{a0}%"
}

/// A share in per cent without sign: `0.07 %`.
pub fn share(part: f64) -> String {
    significant(100.0 * part.abs(), 2) + "\u{a0}%"
}

/// A number with its sign.
pub fn signed(value: f64, digits: usize) -> String {
    let text = significant(value, digits);
    if value > 0.0 { format!("+{text}") } else { text }
}

/// A quantity with the prefix that suits.
pub fn si(value: f64, unit: &str, digits: usize) -> String {
    engineering(value, unit, digits)
}

/// A position in millimetres, to the tenth of a micrometre.
pub fn mm(position: f64) -> String {
    format!("{}\u{a0}mm", taut::number::fixed(1e3 * position, 4))
}

/// A distance in micrometres.
pub fn um(distance: f64, digits: usize) -> String {
    format!("{}\u{a0}µm", significant(1e6 * distance, digits))
}

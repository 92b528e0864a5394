//! Shapers in words.

use taut::control::shaping::Fitted;

/// A remark.
pub fn remark(fitted: &Fitted) -> &'static str {
    match (fitted.is_candidate, fitted.is_lowest) {
        (false, _) => "not a candidate",
        (true, true) => "the lowest frequency tried",
        (true, false) => "",
    }
}

/// Frequency in Hz, vibration in %, smoothing in mm, acceleration in mm/s² to hundreds.
pub fn words(fitted: &Fitted) -> [String; 4] {
    [
        format!("{:.1}", fitted.shaper.frequency),
        format!("{:.1}", 100.0 * fitted.vibration),
        format!("{:.3}", 1e3 * fitted.smoothing),
        format!("{:.0}", (10.0 * fitted.max_acceleration).round() * 100.0),
    ]
}

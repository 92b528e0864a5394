//! Shapers in words.

use taut::control::pairs::Pair;
use taut::control::recommendation::Left;
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

/// Vibration in %, smoothing in mm, acceleration in mm/s² to hundreds of a pair.
pub fn pair_words(pair: &Pair) -> [String; 3] {
    [
        format!("{:.1}", 100.0 * pair.vibration),
        format!("{:.3}", 1e3 * pair.smoothing),
        format!("{:.0}", (10.0 * pair.max_acceleration).round() * 100.0),
    ]
}

/// A mode along the travel: frequencies in Hz, damping ratios, motion of the cart of that of the strongest, and in %
/// what the recommended shaper and the best pair leave of it at worst.
pub fn mode_words(left: &Left, recommended: usize) -> [String; 5] {
    let span = |[low, high]: [f64; 2], digits: usize| match format!("{low:.digits$}") {
        low if low == format!("{high:.digits$}") => low,
        low => format!("{low} to {high:.digits$}"),
    };
    let part = |value: Option<&f64>| value.map_or(String::new(), |value| format!("{:.1}", 100.0 * value));
    [
        span(left.reach.frequency, 1),
        span(left.reach.damping, 3),
        format!("{:.3}", left.reach.share),
        part(left.shapers.get(recommended)),
        part(left.pairs.first()),
    ]
}

//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::control::recommendation::{Findings, Found};
use taut_report::shape::{remark, words};

/// The text on the terminal.
pub fn text(found: &Findings) -> String {
    let mut text = String::new();
    for one in &found.each {
        let _ = writeln!(text, "{}\n{}", bold(&one.name()), one.told());
        if let Some(told) = one.damping_told() {
            let _ = writeln!(text, "{told}");
        }
        text.push('\n');
        shapers(&mut text, one);
        let best = one.choice.best();
        let recommended = format!("recommended: {} at {:.1} Hz", best.shaper.form.name(), best.shaper.frequency);
        let _ = write!(text, "\n{}\n{}\n\n", bold(&recommended), one.choice.reason);
        for line in one.lines() {
            let _ = writeln!(text, "  {line}");
        }
        text.push('\n');
    }
    if let Some(comparison) = &found.comparison {
        let _ = writeln!(text, "{}", bold("Compared"));
        for sentence in comparison.suggestions() {
            let _ = writeln!(text, "{sentence}");
        }
        text.push('\n');
    }
    text
}

fn shapers(text: &mut String, one: &Found) {
    text.push_str("  shaper    frequency  vibration  smoothing  acceleration up to\n");
    for fitted in &one.choice.fitted {
        let [frequency, vibration, smoothing, acceleration] = words(fitted);
        let name = fitted.shaper.form.name();
        let row = format!(
            "  {name:<8} {frequency:>7} Hz {vibration:>8} % {smoothing:>7} mm {acceleration:>9} mm/s^2  {}",
            remark(fitted)
        );
        let _ = writeln!(text, "{}", row.trim_end());
    }
}

//! The result on the terminal.

use crate::terminal::bold;
use std::fmt::Write;
use taut::control::recommendation::{Findings, ShaperFile};
use taut_report::shape::{mode_words, pair_words, remark, words};

/// The text on the terminal.
pub fn text(found: &Findings) -> String {
    let mut text = String::new();
    for one in &found.each {
        let _ = writeln!(text, "{}\n{}", bold(&one.name()), one.told());
        if let Some(told) = one.damping_told() {
            let _ = writeln!(text, "{told}");
        }
        let best = one.choice.best();
        let recommended = format!("recommended: {} at {:.1} Hz", best.shaper.form.name(), best.shaper.frequency);
        let _ = write!(text, "\n{}\n{}\n\n", bold(&recommended), one.choice.reason);
        for line in one.lines() {
            let _ = writeln!(text, "  {line}");
        }
        text.push('\n');
        shapers(&mut text, one);
        modes(&mut text, one);
        text.push('\n');
        pairs(&mut text, one);
    }
    if let Some(comparison) = &found.comparison {
        let _ = writeln!(text, "{}", bold("Compared"));
        for sentence in comparison.suggestions() {
            let _ = writeln!(text, "{sentence}");
        }
        text.push('\n');
    }
    if let Some(belts) = &found.belts {
        let _ = write!(text, "{}\n{}\n", bold("Belts"), belts.words());
        if let Some(told) = belts.model_words() {
            let _ = writeln!(text, "{told}");
        }
        text.push('\n');
    }
    text
}

fn shapers(text: &mut String, one: &ShaperFile) {
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

/// Modes along the travel and what is left of them at worst.
fn modes(text: &mut String, one: &ShaperFile) {
    let all = one.left();
    if all.is_empty() {
        return;
    }
    let pair = if one.choice.pairs.is_empty() { "" } else { "  best pair leaves" };
    let moves = format!("moves the {}", one.load());
    let _ = writeln!(text, "\n  mode along the travel  damping         {moves:>14}  recommended leaves{pair}");
    for left in &all {
        let [frequency, damping, share, best, paired] = mode_words(left, one.choice.recommended);
        let mut row = format!("  {:<21}  {damping:<14}  {share:>14}  {best:>16} %", format!("{frequency} Hz"));
        if !paired.is_empty() {
            let _ = write!(row, "  {paired:>14} %");
        }
        let _ = writeln!(text, "{row}");
    }
}

fn pairs(text: &mut String, one: &ShaperFile) {
    let Some(told) = one.pair_told() else { return };
    let _ = writeln!(text, "{}\n{told}", bold("Pairs"));
    for pair in &one.choice.pairs {
        let [vibration, smoothing, acceleration] = pair_words(pair);
        let _ = writeln!(text, "  {:<36} {vibration:>6} % {smoothing:>7} mm {acceleration:>9} mm/s^2", pair.name());
    }
    if let (Some(pair), true) = (one.choice.pairs.first(), one.choice.is_pair_better) {
        let _ = writeln!(text, "\n  {}", pair.line());
    }
    text.push('\n');
}

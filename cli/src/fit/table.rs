//! The result on the terminal.

use super::posterior;
use crate::terminal::bold;
use std::fmt::Write;
use std::time::Duration;
use taut::case::Case;
use taut::number;
use taut_report::fit::{FitResults, crooked, ending, findings, past_kinks, scores, value, words};

/// The text on the terminal.
pub fn text(case: &Case, found: &FitResults, took: Duration) -> String {
    let fit = &found.fit;
    let mut text = format!("{}\n", bold(&case.title));
    let _ = writeln!(text, "{}", ending(fit));
    for finding in findings(fit.findings.iter()) {
        let _ = writeln!(text, "{finding}");
    }
    if !fit.estimates.is_empty() {
        let _ = write!(text, "\n{}\n", bold("Parameters"));
    }
    let wide = fit.estimates.iter().map(|e| e.name.chars().count()).max().unwrap_or(0).max(10);
    for estimate in &fit.estimates {
        let [value, error, interval] = words(estimate);
        let _ = writeln!(text, "  {:<wide$}  {value:>14} ± {error:<10} {interval}", estimate.name);
    }
    if !fit.is_complete() {
        let known = fit.identifiability.iter().flat_map(|known| &known.groups).zip(&fit.choices);
        for (group, choices) in known {
            let _ = write!(text, "\n{}\n  {}\n", bold("Not determined"), group.words);
            for combination in &group.combinations {
                let [low, high] = combination.interval.map(|end| value(end, &combination.unit, 5));
                let shown = value(combination.value, &combination.unit, 5);
                let error = value(combination.error, &combination.unit, 2);
                let _ = writeln!(text, "  {} = {shown} ± {error}  95 %: {low} to {high}", combination.name);
            }
            for choice in choices {
                let _ = writeln!(text, "  - {choice}");
            }
        }
        let _ = writeln!(
            text,
            "  among the machines that fit equally well, fitted.toml is the one nearest to the case file"
        );
    }
    if let Some(belts) = fit.belts() {
        let _ = write!(text, "\n{}\n  {}\n", bold("Belts"), belts.words());
    }
    let names = crooked(&found.profiles);
    if !names.is_empty() {
        let _ = writeln!(
            text,
            "  not linear within the intervals: {}; see the profiles in the report, or use `--posterior` for other \
             intervals",
            names.join(", ")
        );
    }
    if let Some(drawn) = &found.drawn {
        text.push_str(&posterior::text(drawn, wide));
    }
    let _ = write!(text, "\n{}\n", bold("Logs"));
    let scores = scores(fit);
    let wide = scores.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).min(40);
    for (word, scores) in scores {
        let _ = writeln!(text, "  {word:<wide$}  {scores}");
    }
    let _ = writeln!(
        text,
        "\n{} values, {} variables; {} steps, {} simulated logs{}\n  took {}",
        fit.values,
        fit.variables,
        fit.work.iterations,
        fit.work.simulations,
        past_kinks(fit),
        number::engineering_typed(took.as_secs_f64(), "s", 3),
    );
    text
}

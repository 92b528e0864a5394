//! The summary for people.

use super::summary::{Group, MOST_VALUES, Measured, Summary};
use super::{Work, shown};
use crate::terminal::{bold, columns};
use std::fmt::Write;
use std::time::Duration;
use taut::number::engineering;
use taut::sweep::Status;

/// A value with four digits in its unit, spaces as on a keyboard; a dash for none.
pub fn number(value: f64, unit: &str) -> String {
    match value.is_finite() {
        true => engineering(value, unit, 4).replace('\u{a0}', " "),
        false => "–".into(),
    }
}

/// The name of a parameter, what is tied to it only counted.
pub fn short(name: &str) -> String {
    match name.split(" = ").collect::<Vec<_>>()[..] {
        [first, _, ..] => format!("{first} and {} tied to it", name.matches(" = ").count()),
        _ => name.to_string(),
    }
}

/// How many runs of what.
pub fn plan(work: &Work) -> String {
    let sweep = work.sweep;
    let count = sweep.inputs() - 1;
    let parameters = if count == 1 { "1 parameter".to_string() } else { format!("{count} parameters") };
    let jobs = sweep.groups().len();
    let each = if jobs == 1 { String::new() } else { format!(" of {jobs} simulations each") };
    let indices = if sweep.indices() { ", for Sobol' indices" } else { "" };
    format!("{} runs{each}: {parameters}, {}{indices}", sweep.runs(), sweep.sampling().word())
}

/// What the influence of a figure is told by.
pub fn influence_heading(work: &Work) -> &'static str {
    match (work.sweep.indices(), work.sweep.sampling()) {
        (true, _) => "depends most on (S_T)",
        (_, taut::case::Sampling::OneAtATime) => "changes most with",
        _ => "depends most on (rank correlation)",
    }
}

/// The parameters that matter most, in words.
pub fn influence(summary: &Summary, measured: &Measured, most: usize) -> String {
    let told = |(place, much): (usize, f64)| {
        let name = short(&summary.parameters[place].name);
        match measured.tornado.is_empty() {
            true => format!("{name} {}", taut::number::fixed(much, 2)),
            false => format!("{name} {}{}", if much > 0.0 { "+" } else { "" }, number(much, measured.unit)),
        }
    };
    match measured.shown_influence() {
        none if none.is_empty() => "nothing that these runs show".into(),
        some => some.into_iter().take(most).map(told).collect::<Vec<_>>().join(", "),
    }
}

/// How runs ended, if not all to the end.
pub fn endings(group: &Group) -> Option<String> {
    let all: usize = group.endings.iter().map(|(_, count)| count).sum();
    let told = group.endings.iter().filter(|(status, _)| *status != Status::Complete);
    let told: Vec<String> = told.map(|(status, count)| format!("{count} of {all} runs: {}", status.words())).collect();
    (!told.is_empty()).then(|| told.join("; "))
}

/// Text on the terminal.
pub fn text(work: &Work, summary: &Summary, took: Duration, run: u64) -> String {
    let mut text = format!("{}\n{}\n", bold(work.case.title()), plan(work));
    for group in &summary.groups {
        let _ = writeln!(text, "\n{}", bold(&group.name));
        if let Some(endings) = endings(group) {
            let _ = writeln!(text, "  {endings}");
        }
        let mut rows =
            vec![["".to_string(), "5 %".into(), "50 %".into(), "95 %".into(), influence_heading(work).into()]];
        // Counts of events are for the report.
        let shown = |measured: &&Measured| measured.varies() && !measured.unit.is_empty();
        let left_out = group.measures.len() - group.measures.iter().filter(shown).count();
        for measured in group.measures.iter().filter(shown) {
            let Some(spread) = &measured.spread else { continue };
            let [_, low, middle, high, _] = spread.quantiles.map(|value| number(value, measured.unit));
            rows.push([measured.words.to_string(), low, middle, high, influence(summary, measured, 3)]);
        }
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        let widths = [0, 1, 2, 3, 4].map(width);
        // Two columns of space before each; where that is too wide, the last column gets lines of its own.
        let is_wide = widths.iter().map(|wide| wide + 2).sum::<usize>() > columns();
        for [name, low, middle, high, most] in &rows {
            let [a, b, c, d, _] = widths;
            let line = format!("  {name:<a$}  {low:>b$}  {middle:>c$}  {high:>d$}");
            let _ = match is_wide {
                true => writeln!(text, "{line}\n      {most}"),
                false => writeln!(text, "{}", format!("{line}  {most}").trim_end()),
            };
        }
        if left_out > 0 {
            let _ = writeln!(text, "  and {left_out} figures that count events, or are the same in all runs: --json");
        }
    }
    if summary.every > 1 {
        let _ = writeln!(text, "\nShares are those of every {}th run: {MOST_VALUES} values at most", summary.every);
    }
    let rate = run as f64 * work.sweep.groups().len() as f64 / took.as_secs_f64().max(1e-9);
    let _ = match run {
        0 => writeln!(text, "\n  took nothing: all runs were done already"),
        _ => writeln!(text, "\n  took {}: {run} runs, {rate:.0} simulations a second", shown(took)),
    };
    text.replace('\u{a0}', " ")
}

//! A sweep in words.

use taut::case::Sampling;
use taut::number::engineering;
use taut::sweep::{Measured, Shown, Status, Summary, Sweep};

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
pub fn plan(sweep: &Sweep) -> String {
    let count = sweep.inputs() - 1;
    let parameters = if count == 1 { "1 parameter".to_string() } else { format!("{count} parameters") };
    let jobs = sweep.groups().len();
    let each = if jobs == 1 { String::new() } else { format!(" of {jobs} simulations each") };
    let indices = if sweep.indices() { ", for Sobol' indices" } else { "" };
    format!("{} runs{each}: {parameters}, {}{indices}", sweep.runs(), sweep.sampling().word())
}

/// The measure of influence that figures are told by.
pub fn influence_heading(sweep: &Sweep) -> &'static str {
    match (sweep.indices(), sweep.sampling()) {
        (true, _) => "depends most on (S_T)",
        (_, Sampling::OneAtATime) => "changes most with",
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
        none if none.is_empty() => "no significant parameter".into(),
        some => some.into_iter().take(most).map(told).collect::<Vec<_>>().join(", "),
    }
}

/// How runs ended, if not all to the end.
pub fn endings(group: &Shown) -> Option<String> {
    let all: usize = group.endings.iter().map(|(_, count)| count).sum();
    let told = group.endings.iter().filter(|(status, _)| *status != Status::Complete);
    let told: Vec<String> = told.map(|(status, count)| format!("{count} of {all} runs: {}", status.words())).collect();
    (!told.is_empty()).then(|| told.join("; "))
}

//! A fit in words.

use super::plots;
use super::value::value;
use std::fmt::Write;
use taut::fit::{Ending, Estimate, Finding, Fit, LogFit, Profile, Score, Together, together};

/// Findings of one kind in so many logs are told of the first.
const MOST_ALIKE: usize = 3;

/// Warnings and notes; of those that many logs share, the first and how many more.
pub fn findings<'a>(all: impl Iterator<Item = &'a Finding> + Clone) -> Vec<String> {
    let mut told: Vec<String> = Vec::new();
    let mut codes: Vec<&str> = Vec::new();
    for finding in all.clone() {
        let alike = all.clone().filter(|other| (other.code, other.grade) == (finding.code, finding.grade)).count();
        if alike <= MOST_ALIKE || finding.log.is_none() {
            told.push(finding.to_string());
        } else if !codes.contains(&finding.code) {
            codes.push(finding.code);
            told.push(format!("{finding}; and the like of {} other logs", alike - 1));
        }
    }
    told
}

/// The search past kinks, where derivatives did not help; empty where there was none.
pub fn past_kinks(fit: &Fit) -> String {
    match fit.evolved {
        0 => String::new(),
        1 => "; where events change their order: an evolution strategy".into(),
        times => format!("; where events change their order: an evolution strategy, {times} times"),
    }
}

/// Parameters whose interval is not to be believed on one side.
pub fn crooked(profiles: &[Profile]) -> Vec<&str> {
    profiles.iter().filter(|profile| profile.is_crooked()).map(|profile| profile.name.as_str()).collect()
}

/// How the search ended, in a sentence.
pub fn ending(fit: &Fit) -> String {
    if fit.estimates.is_empty() && fit.ending == Ending::Converged {
        return "no search: errors of the case as it is".into();
    }
    let mut text = match fit.ending {
        Ending::Converged if !fit.is_converged() => {
            format!(
                "ended where another step would move the estimates by {:.1e} standard errors: {}",
                fit.decrement,
                fit.ending_word().replace('_', " ")
            )
        }
        Ending::Converged if fit.pieces > 1 => format!(
            "converged at a kink, where sticks and slips change their order: another step would move the estimates by {:.1e} \
             standard errors",
            fit.decrement
        ),
        Ending::Converged => {
            format!("converged: another step would move the estimates by {:.1e} standard errors", fit.decrement)
        }
        Ending::Stalled => format!(
            "ended at a kink, where sticks and slips change their order: no step lowers the cost, though its slope promises {:.1} standard errors",
            fit.decrement
        ),
        Ending::OutOfIterations => "not converged: the steps were used up".to_string(),
        Ending::Interrupted => "interrupted: the best so far, not converged".to_string(),
        Ending::Failed => "failed".to_string(),
    };
    if fit.starts.len() > 1 {
        let best = fit.starts.iter().copied().fold(f64::INFINITY, f64::min);
        let same = fit.starts.iter().filter(|cost| **cost <= best * 1.001 + 1e-12).count();
        let _ = write!(text, "; {same} of {} starts led to the same cost", fit.starts.len());
    }
    text
}

/// Value, standard error and interval of an estimate.
pub fn words(estimate: &Estimate) -> [String; 3] {
    let shown = |v: f64, digits| value(v, estimate.unit, digits);
    // Two digits of what separates the ends of the interval.
    let wide = estimate.interval.map_or(f64::INFINITY, |[low, high]| high - low);
    let digits = match (estimate.value / wide).abs().log10().ceil() {
        digits if digits.is_finite() => (digits.clamp(2.0, 12.0) as usize + 2).max(4),
        _ => 4,
    };
    let own = shown(estimate.value, digits.max(5));
    match (estimate.error, estimate.interval) {
        (_, Some([low, high])) if estimate.at_bound => {
            [own, "-".into(), format!("95 %: {} to {}, at its bound", shown(low, digits), shown(high, digits))]
        }
        _ if estimate.at_bound => [own, "-".into(), "at its bound: no interval".into()],
        (Some(error), Some([low, high])) if error.is_finite() => {
            [own, shown(error, 2), format!("95 %: {} to {}", shown(low, digits), shown(high, digits))]
        }
        _ => [own, "∞".into(), "not determined by these logs".into()],
    }
}

/// The unit in which numbers of this size are told in one column, and how many of it the SI unit is.
pub fn unit_for(sizes: impl Iterator<Item = f64>, unit: &str) -> (String, f64) {
    let mut sizes: Vec<f64> = sizes.filter(|size| size.is_finite() && *size > 0.0).collect();
    sizes.sort_by(f64::total_cmp);
    let middle = sizes.get(sizes.len() / 2).copied().unwrap_or(1.0);
    match unit {
        "m" | "s" | "V" | "A" | "rad" | "m/s" | "rad/s" if middle < 0.5e-3 => (format!("µ{unit}"), 1e6),
        "m" | "s" | "V" | "A" | "rad" | "m/s" | "rad/s" if middle < 0.5 => (format!("m{unit}"), 1e3),
        _ => (unit.to_string(), 1.0),
    }
}

/// How experiments of several logs, or logs of several windows, are met; empty where that is no other than each log, or
/// all together.
pub fn by_experiment(fit: &Fit) -> Vec<Together> {
    let all = together(&fit.logs, |log| log.experiment().to_string());
    let mut names: Vec<&str> = all.iter().map(|one| one.name.as_str()).collect();
    names.dedup();
    names.sort_unstable();
    names.dedup();
    if names.len() < 2 || names.len() == fit.logs.len() { Vec::new() } else { all }
}

/// Its name, and which window of it.
pub fn name(log: &LogFit) -> String {
    if log.window == 0 { log.name.clone() } else { format!("{} [{}]", log.name, log.window + 1) }
}

/// Most logs of which each is told.
const MOST_TOLD: usize = 24;

/// How each log is met, of many those that are met worst; each experiment, and all together.
pub fn scores(fit: &Fit) -> Vec<(String, String)> {
    let mut lines = Vec::new();
    let logs: Vec<&LogFit> = match fit.logs.len() > MOST_TOLD {
        true => plots::worst(&fit.logs, &fit.noise),
        false => fit.logs.iter().collect(),
    };
    for log in &logs {
        lines.push((name(log), outputs(log)));
    }
    if logs.len() < fit.logs.len() {
        lines.push((
            format!("and {} more", fit.logs.len() - logs.len()),
            "which are met better; see fit.json or the report".into(),
        ));
    }
    let word = |one: &Together| {
        let rmse = if one.rmse.is_finite() { value(one.rmse, one.quantity.unit(), 4) } else { "–".into() };
        format!("{} {}: RMSE {rmse}", one.quantity.name(), if one.held_out { "held out" } else { "fitted" })
    };
    for one in by_experiment(fit) {
        let logs = if one.logs > 1 { format!(" of {} logs", one.logs) } else { String::new() };
        lines.push((one.name.clone(), format!("{}{logs}", word(&one))));
    }
    if fit.logs.len() > 1 {
        lines.extend(together(&fit.logs, |_| String::new()).iter().map(|one| ("all together".into(), word(one))));
    }
    lines
}

/// How each output of a log is met.
pub fn outputs(log: &LogFit) -> String {
    let mut parts = Vec::new();
    for output in &log.outputs {
        let quantity = output.quantity;
        for (score, held) in [(output.fitted, false), (output.held_out, true)] {
            let Some(score) = score else { continue };
            parts.push(told(quantity.name(), quantity.unit(), &score, held));
        }
    }
    if !log.complete {
        parts.push("the model does not reach its end".into());
    }
    parts.join("; ")
}

fn told(quantity: &str, unit: &str, score: &Score, held: bool) -> String {
    let word = if held { " held out" } else { "" };
    format!("{quantity}{word}: RMSE {}, fit {:.2} %", value(score.rmse, unit, 4), score.percent)
}

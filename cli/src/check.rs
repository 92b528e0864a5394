//! `taut check`: what the logs of a case can tell of its parameters, before any fit.

use crate::args::Check as Args;
use crate::failure::{Outcome, Status};
use crate::fit::table;
use crate::terminal::{self, bold};
use std::fmt::Write;
use taut::case::Case;
use taut::fit::{Check, check};
use taut::json;
use taut::log::{Severity, Survey};

/// So many logs are shown with all that is known of them; of more, what matters.
const MOST_WHOLE: usize = 4;

/// Reads the case, looks, tells.
pub fn run(args: &Args) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    let case = Case::read_with(&args.case, &changes)?;
    let plan = case.fit_plan(&args.case)?;
    let found = check(&case, &plan)?;
    terminal::show(&if args.json { json::text(&json::check(&case, &found)) } else { text(&case, &found) });
    Ok(Status::Done)
}

fn text(case: &Case, found: &Check) -> String {
    let mut text = format!("{}\n", bold(&case.title));
    let _ = write!(text, "\n{}\n", bold("What the logs show"));
    for log in &found.logs {
        text.push_str(&shown(log, found.logs.len() <= MOST_WHOLE));
    }
    if let Some(found) = &found.balance {
        let _ = write!(text, "\n{}\n", bold("A rigid axis by regression, all at the drive pulley"));
        let values = [found.inertia, found.viscous, found.coulomb, found.load];
        let names = [("inertia", "kg m^2"), ("viscous", "N m s/rad"), ("Coulomb", "N m"), ("load", "N m")];
        for ((name, unit), (value, error)) in names.iter().zip(values.iter().zip(found.errors)) {
            let _ = writeln!(text, "  {name:<9}{} ± {}", table::value(*value, unit, 5), table::value(error, unit, 2));
        }
        let left = 100.0 * found.unexplained;
        let _ = writeln!(
            text,
            "  {} equations, of whose torque {left:.1} % is left: {}; a first guess, not a fit",
            found.equations,
            found.words()
        );
    }
    let own = |finding: &&taut::fit::Finding| finding.log.is_none() || finding.code == "unexplained";
    for finding in found.fit.findings.iter().filter(own) {
        let _ = write!(text, "\n{finding}\n");
    }
    let _ = write!(text, "\n{}\n", bold("How well each parameter would be known, all others free"));
    let known = &found.identifiability;
    let wide = known.names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    for (j, name) in known.names.iter().enumerate() {
        // The interval of the fit, and so what `taut fit` says.
        let estimate = &found.fit.estimates[j];
        let error = match estimate.error {
            Some(e) if e.is_finite() && estimate.value != 0.0 => {
                format!("to {:.2} %", 100.0 * (e / estimate.value).abs())
            }
            Some(e) if e.is_finite() => format!("to {}", table::value(e, estimate.unit, 2)),
            None => "at its bound".into(),
            Some(_) => "not at all".into(),
        };
        let _ = writeln!(text, "  {name:<wide$}  {error}");
    }
    let _ = writeln!(
        text,
        "  singular values {}",
        known.singular.iter().map(|s| format!("{s:.2e}")).collect::<Vec<_>>().join(", ")
    );
    let _ = writeln!(text, "  {}", found.noise_words);
    if known.complete() {
        text.push_str("\neverything that is searched for is determined\n");
    }
    for (group, choices) in known.groups.iter().zip(&found.choices) {
        let _ = write!(text, "\n{}\n  {}\n", bold("Not determined"), group.words);
        for combination in &group.combinations {
            let shown = table::value(combination.value, &combination.unit, 5);
            let _ = writeln!(
                text,
                "  {} = {shown} ± {}",
                combination.name,
                table::value(combination.error, &combination.unit, 2)
            );
        }
        for choice in choices {
            let _ = writeln!(text, "  - {choice}");
        }
    }
    if !found.experiments.is_empty() {
        let _ = write!(text, "\n{}\n", bold("What one more experiment would tell, by simulation, the best first"));
        for experiment in &found.experiments {
            let _ = writeln!(text, "  {}: {}", experiment.name, experiment.told);
        }
    }
    text
}

/// What a log shows, indented; not `whole`: in its first line and its warnings.
fn shown(log: &Survey, whole: bool) -> String {
    let mut log = log.clone();
    if !whole {
        log.channels.clear();
        log.notes.retain(|note| note.severity > Severity::Fact);
    }
    log.to_string().lines().fold(String::new(), |text, line| format!("{text}  {line}\n"))
}

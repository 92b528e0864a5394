//! `taut check`: what the logs of a case can tell of its parameters, before any fit.

use crate::args::Check as Args;
use crate::command::{Finished, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use taut::case::{Case, Plan};
use taut::fit::{Check, check_watched};
use taut::json;
use taut::solve::Flow;
use taut_report::check::{findings, page, regression, shares, surveys};
use taut_report::fit::value;

/// Reads the case, looks, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open(&args.case)?;
    let plan = case.fit_plan(&args.case)?;
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), ["check.json", "report.html"])?;
    let found = watched(&case, &plan, common.quiet)?;
    let text = text(&case, &found);
    let json = ("check.json", json::text(&json::check(&case, &found)));
    let mut finished = Finished::new("check", json, text, "add --out DIR for check.json and a report");
    if common.reports() {
        finished.report = Some(Report { page: page(&case, &found), pictures: Vec::new() });
    }
    if !found.tells() {
        finished.status = Status::Incomplete;
    }
    finished.finish(common, folder)
}

/// The check, with progress; what it has come to when a signal comes is no verdict.
fn watched(case: &Case, plan: &Plan, quiet: bool) -> Result<Check, Failure> {
    let interrupt = Interrupt::listen();
    let is_stopped = || interrupt.signal().is_some();
    let (progress, mut steps) = (Progress::of_whole("simulating the logs", quiet), 0);
    let found = check_watched(case, plan, Some(&is_stopped), &mut |_, cost| {
        steps += 1;
        progress.tell(|| format!("step {steps}, cost {cost:.6e}"));
        if is_stopped() { Flow::Stop } else { Flow::Continue }
    });
    progress.clear();
    match interrupt.signal() {
        Some(signal) => Err(interrupted(signal, "interrupted before the check was done; nothing was written")),
        None => Ok(found?),
    }
}

/// Verdict on the logs in a line.
fn verdict(found: &Check) -> String {
    match &found.identifiability {
        _ if !found.tells() => "these logs determine none of the free parameters".into(),
        Some(known) if known.complete() => "all free parameters are determined".into(),
        Some(known) => {
            let members = known.groups.iter().flat_map(|group| &group.members);
            let names: Vec<&str> = members.map(|&member| known.names[member].as_str()).collect();
            format!("not determined by themselves: {}", names.join(", "))
        }
        None => "all free parameters ended at a bound: their sensitivity is unknown".into(),
    }
}

fn text(case: &Case, found: &Check) -> String {
    let mut text = format!("{}\n{}\n", bold(&case.title), verdict(found));
    let _ = write!(text, "\n{}\n", bold("Logs"));
    text.push_str(&surveys(found));
    if let Some(found) = &found.balance {
        let _ = write!(text, "\n{}\n", bold("A rigid axis by regression, all at the drive pulley"));
        for (name, unit, own, error) in regression(found) {
            let _ = writeln!(text, "  {name:<9}{} ± {}", value(own, unit, 5), value(error, unit, 2));
        }
        let left = 100.0 * found.unexplained;
        let _ = writeln!(
            text,
            "  {} equations with a residual torque of {left:.1} %: {}; a first estimate, not a fit",
            found.equations,
            found.words()
        );
    }
    for finding in findings(found) {
        let _ = write!(text, "\n{finding}\n");
    }
    let _ = write!(text, "\n{}\n", bold("Accuracy of each parameter, all others free"));
    let wide = found.fit.estimates.iter().map(|estimate| estimate.name.chars().count()).max().unwrap_or(0);
    for (name, error) in shares(found) {
        let _ = writeln!(text, "  {name:<wide$}  {error}");
    }
    if let Some(known) = &found.identifiability {
        let singular: Vec<String> = known.singular.iter().map(|s| format!("{s:.2e}")).collect();
        let _ = writeln!(text, "  singular values {}", singular.join(", "));
    }
    let _ = writeln!(text, "  {}", found.noise_words);
    for (group, choices) in found.groups() {
        let _ = write!(text, "\n{}\n  {}\n", bold("Not determined"), group.words);
        for combination in &group.combinations {
            let shown = value(combination.value, &combination.unit, 5);
            let _ =
                writeln!(text, "  {} = {shown} ± {}", combination.name, value(combination.error, &combination.unit, 2));
        }
        for choice in choices {
            let _ = writeln!(text, "  - {choice}");
        }
    }
    if !found.experiments.is_empty() {
        let _ = write!(text, "\n{}\n", bold("Most useful next experiments, by simulation"));
        for experiment in &found.experiments {
            let _ = writeln!(text, "  {}: {}", experiment.name, experiment.told);
        }
    }
    text
}

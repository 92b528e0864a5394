//! `taut fit --drift`: which single change of the machine explains the logs.

use super::table::value;
use crate::args::Fit as Args;
use crate::command::{Finished, Report};
use crate::failure::{Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use taut::case::{Case, Plan};
use taut::fit::{Change, Drift, Together, drift};
use taut::json;
use taut::solve::Flow;
use taut_report::{Cell, Page, Table};

/// Changes that the terminal shows.
const SHOWN: usize = 15;

/// One change after the other; a table.
pub fn run(args: &Args, case: &Case, plan: &Plan) -> Outcome {
    let common = &args.common;
    let names = ["drift.json"].into_iter().chain((!common.no_report).then_some("report.html"));
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    let interrupt = Interrupt::listen();
    let is_stopped = || interrupt.signal().is_some();
    let progress = Progress::new("one change after the other", None, common.quiet);
    let found = drift(case, plan, Some(&is_stopped), &mut |name| {
        progress.tell(|| name.to_string());
        if is_stopped() { Flow::Stop } else { Flow::Continue }
    })?;
    progress.clear();
    let json = json::text(&json::drift(case, &found));
    let mut finished =
        Finished::new("fit", ("drift.json", json), text(case, &found), "add --out DIR for drift.json and a report");
    if common.reports() {
        finished.report = Some(Report { page: page(case, &found), pictures: Vec::new() });
    }
    if let Some(signal) = interrupt.signal() {
        finished.status = Status::Interrupted(signal);
    }
    finished.finish(common, folder)
}

/// An error with its unit.
fn error(one: &Together) -> String {
    if one.rmse.is_finite() { value(one.rmse, one.quantity.unit(), 4) } else { "–".into() }
}

/// What is changed, from what to what, in words.
fn words(change: &Change) -> [String; 4] {
    let estimate = &change.estimate;
    let shown = |number: f64| value(number, estimate.unit, 4);
    let percent = match estimate.start {
        0.0 => String::new(),
        start => format!("{:+.1} %", 100.0 * (estimate.value / start - 1.0)),
    };
    let bound = if estimate.at_bound { " (at its bound)" } else { "" };
    [estimate.name.clone(), shown(estimate.start), format!("{}{bound}", shown(estimate.value)), percent]
}

/// The changes that leave as little as the best, in a sentence.
fn verdict(found: &Drift) -> String {
    let names: Vec<&str> = found.best().map(|change| change.estimate.name.as_str()).collect();
    let Some(best) = found.changes.first() else { return "nothing could be changed".into() };
    let explained = 100.0 * (1.0 - best.left).max(0.0);
    match &names[..] {
        [] => "nothing could be changed".into(),
        [one] => format!("a change of {one} explains most: {explained:.1} % of the sum of squares"),
        [one, others @ ..] => format!(
            "a change of {one} explains most: {explained:.1} % of the sum of squares; as well does one of {}, which these logs do not tell from it",
            others.join(", ")
        ),
    }
}

fn text(case: &Case, found: &Drift) -> String {
    let mut text = format!("{}\n{}\n", bold(&case.title), verdict(found));
    let _ = write!(text, "\n{}\n", bold("Single changes, all else as the case has it"));
    let fitted = |all: &[Together]| -> Vec<String> { all.iter().filter(|one| !one.held_out).map(error).collect() };
    let mut rows = vec![[
        "as it is".to_string(),
        String::new(),
        String::new(),
        String::new(),
        fitted(&found.unchanged).join(", "),
    ]];
    for change in found.changes.iter().take(SHOWN) {
        let [name, from, to, percent] = words(change);
        rows.push([name, from, to, percent, fitted(&change.errors).join(", ")]);
    }
    let wide: [usize; 5] = std::array::from_fn(|k| rows.iter().map(|row| row[k].chars().count()).max().unwrap_or(0));
    for [name, from, to, percent, errors] in rows {
        let _ = writeln!(
            text,
            "  {name:<0$}  {from:>1$} {arrow} {to:<2$}  {percent:>3$}  RMSE {errors}",
            wide[0],
            wide[1],
            wide[2],
            wide[3],
            arrow = if to.is_empty() { " " } else { "→" },
        );
    }
    if found.changes.len() > SHOWN {
        let _ = writeln!(text, "  and {} more, which explain less", found.changes.len() - SHOWN);
    }
    let _ = writeln!(text, "\n{} simulated logs", found.work.simulations);
    text
}

fn page(case: &Case, found: &Drift) -> Page {
    let mut page = Page::new(case.title.clone()).subtitle("Which single change explains the logs.");
    page.section("Single changes");
    page.prose(format!("{}.", verdict(found)));
    let mut rows = Table::new("Each change by itself, all else as the case has it, the one that explains most first.");
    for heading in ["Parameter", "From", "To", "Change"] {
        rows = rows.column(heading, "");
    }
    let fitted = |all: &[Together]| -> Vec<String> { all.iter().filter(|one| !one.held_out).map(error).collect() };
    for quantity in found.quantities() {
        rows = rows.column(format!("RMSE of {}", quantity.name().replace('_', " ")), "");
    }
    rows = rows.column("Left of the sum of squares", "");
    let row = |head: [String; 4], errors: Vec<String>, left: String| {
        head.into_iter().chain(errors).chain([left]).map(Cell::from).collect::<Vec<_>>()
    };
    let none = || String::new();
    rows.row(row(["as it is".into(), none(), none(), none()], fitted(&found.unchanged), "100 %".into()));
    for change in &found.changes {
        rows.row(row(words(change), fitted(&change.errors), format!("{:.2} %", 100.0 * change.left)));
    }
    page.table(&rows);
    page.section("The case");
    page.embed("case.toml", &case.text);
    page.footer(format!("taut {}", env!("CARGO_PKG_VERSION")));
    page
}

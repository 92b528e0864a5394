//! `taut fit --drift`: which single change of the machine explains the logs.

use crate::args::Fit as Args;
use crate::command::{Finished, Report};
use crate::failure::{Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::terminal::bold;
use std::fmt::Write;
use taut::case::{Case, Plan};
use taut::fit::{Drift, drift};
use taut::json;
use taut::solve::Flow;
use taut_report::fit::drift::{fitted, page, verdict, words};

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

fn text(case: &Case, found: &Drift) -> String {
    let mut text = format!("{}\n{}\n", bold(&case.title), verdict(found));
    let _ = write!(text, "\n{}\n", bold("Single changes, all else as the case has it"));
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

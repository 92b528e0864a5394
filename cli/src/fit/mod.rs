//! `taut fit`: finds parameters from the logs of a case, and says how well they are known.

mod compare;
mod drift;
mod posterior;
mod table;

use crate::args::Fit as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use std::time::Instant;
use taut::Result;
use taut::case::{Case, Plan};
use taut::fit::{Ending, Fit, Posterior, fit, profiles};
use taut::json;
use taut::solve::Flow;
use taut::trajectory::CsvWriter;
use taut_report::fit::{FitResults, page};

/// Reads the case, fits, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open(&args.case)?;
    let plan = case.fit_plan(&args.case)?;
    if args.compare {
        return compare::run(args, &case, &plan);
    }
    if args.drift {
        return drift::run(args, &case, &plan);
    }
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names(args))?;
    if let Some(folder) = &folder {
        folder::leading(&case.text, &case.files, folder.root())?;
    }
    let interrupt = Interrupt::listen();
    let begin = Instant::now();
    let Some(found) = find(args, &case, &plan, &interrupt)? else {
        let told = "interrupted before the search began; nothing was written";
        return Err(interrupted(interrupt.signal().unwrap_or_default(), told));
    };
    let took = begin.elapsed();
    let fit = &found.fit;
    let json = json::fit(&case, fit, &found.profiles, found.drawn.as_ref().map(json::posterior));
    // A folder that is left here leaves nothing behind.
    let folder = folder.filter(|_| !is_held_back(fit, args));
    let advice = match common.out.is_some() {
        true => "there are warnings; --anyway writes it nevertheless",
        false => "add --out DIR for fitted.toml, fit.json and a report",
    };
    let mut finished = Finished::new("fit", ("fit.json", json::text(&json)), table::text(&case, &found, took), advice);
    if let Some(folder) = &folder {
        let text = led(&fit.case_text(&case, &args.case)?, args, folder)?;
        if let Some(drawn) = &found.drawn {
            write_draws(folder, drawn).map_err(Failure::work)?;
        }
        if common.draws() {
            finished.report = Some(Report { page: page(&case, &found, &text), pictures: Vec::new() });
        }
        finished.files.push(("fitted.toml".into(), text));
        // What other campaigns have for themselves.
        for (part, (name, _)) in fit.parts.iter().enumerate().skip(1) {
            let text = led(&fit.case_text_of(&case, &args.case, part)?, args, folder)?;
            finished.files.push((part_file(name), text));
        }
    }
    if args.posterior && found.drawn.is_none() {
        let told = "interrupted before the first draw: there is no posterior";
        finished.remarks.push(Remark::Error(told.into()));
    }
    finished.status = status(&found, &interrupt);
    finished.finish(common, folder)
}

/// True if a warning keeps the result from being written.
fn is_held_back(fit: &Fit, args: &Args) -> bool {
    fit.warnings().next().is_some() && !args.anyway
}

/// The text of a case with estimates for a folder of results: its paths lead from there to the same files.
fn led(text: &str, args: &Args, folder: &Folder) -> Result<String> {
    folder::leading(text, &folder::files_of(&args.case, text)?, folder.root())
}

/// How it ended.
fn status(found: &FitResults, interrupt: &Interrupt) -> Status {
    match (interrupt.signal(), found.fit.ending) {
        (Some(signal), _) => Status::Interrupted(signal),
        (None, _) if found.drawn.as_ref().is_some_and(|drawn| !drawn.doubts().is_empty()) => Status::Incomplete,
        (None, _) if !found.fit.is_reliable() => Status::Incomplete,
        (None, Ending::Converged | Ending::Stalled) => Status::Done,
        (None, _) => Status::Incomplete,
    }
}

/// The search, then profiles and draws where they are wanted; Ctrl-C leaves out the rest. None where it came before any
/// result.
fn find(args: &Args, case: &Case, plan: &Plan, interrupt: &Interrupt) -> Result<Option<FitResults>> {
    let (common, is_stopped) = (&args.common, || interrupt.signal().is_some());
    let (progress, mut steps) = (Progress::new("simulating the logs", None, common.quiet), 0);
    let fit = fit(case, plan, Some(&is_stopped), &mut |cost| {
        steps += 1;
        progress.tell(|| format!("step {steps}, cost {cost:.6e}"));
        if is_stopped() { Flow::Stop } else { Flow::Continue }
    });
    let fit = match fit {
        // Simulations that were ended early say that the model does not get through the logs.
        Err(_) if is_stopped() => return Ok(None),
        fit => fit?,
    };
    progress.tell(|| "profiles of the parameters".into());
    // What warns holds back the report, and with it the profiles.
    let is_told = common.reports() && (args.anyway || fit.warnings().next().is_none());
    let profiles = match (is_told && !is_stopped()).then(|| profiles(case, plan, &fit, Some(&is_stopped))) {
        Some(Err(_)) if is_stopped() => Vec::new(),
        Some(profiles) => profiles?,
        None => Vec::new(),
    };
    progress.clear();
    let drawn = match args.posterior && !is_stopped() {
        true => match posterior::draw(args, case, plan, &fit, interrupt) {
            Err(_) if is_stopped() => None,
            drawn => Some(drawn?).filter(|drawn| drawn.count() > 0),
        },
        false => None,
    };
    Ok(Some(FitResults { fit, profiles, drawn }))
}

/// The files that will be written.
fn names(args: &Args) -> impl Iterator<Item = &'static str> {
    let report = (!args.common.no_report).then_some("report.html");
    ["fitted.toml", "fit.json"].into_iter().chain(args.posterior.then_some("posterior.csv")).chain(report)
}

/// The file with the values of a campaign.
fn part_file(name: &str) -> String {
    format!("fitted-{}.toml", taut::case::file_name(name))
}

/// Writes the draws.
fn write_draws(folder: &Folder, drawn: &Posterior) -> Result<()> {
    let mut writer = CsvWriter::create(folder.path("posterior.csv"))?;
    writer.write(&drawn.table())?;
    writer.finish()
}

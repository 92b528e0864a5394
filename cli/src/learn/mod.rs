//! `taut learn`: the next feed-forward signal of a repeated move, from its log.

mod table;

use crate::args::Learn as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use std::fmt::Write;
use taut::Error;
use taut::case::{Accepted, Files, Move};
use taut::json;
use taut::learning::{At, Learned, Trial, learn};
use taut::log::read_samples;
use taut_report::learn::{figures, page};

/// Reads the case and the log, learns, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.accepting(&args.case, (Files::Nothing, Accepted::Axis))?;
    let (design, moves) = case.moves_named(&args.case, &args.moves)?;
    let motion: &Move = match &moves[..] {
        [one] => one,
        several => {
            let names: Vec<&str> = several.iter().map(|one| one.name.as_str()).collect();
            let error = Error::new(format!("the case has {} moves, and a log is of one", several.len()));
            return Err(error.in_file("--move").allowed(names.join(", ")).next("name the move of the log").into());
        }
    };
    let others = || std::iter::once(args.log.as_path()).chain(args.added.as_deref());
    let inputs = || folder::inputs_with(&args.case, others(), &case.files);
    let folder = Folder::wanted(common, inputs, ["learn.json", "next.csv", "report.html"])?;
    let (time, position) = read_samples(&args.log, &args.time, args.column())?;
    let position = position.into_iter().map(|value| value * args.unit).collect();
    let at = if args.encoder { At::Encoder } else { At::Cart };
    let trial = Trial { time, position, at };
    let unit = case.machine.drives[0].amplifier.mode.unit();
    let before = args.added.as_deref().map(|file| folder::read_added(file, unit)).transpose()?;
    let interrupt = Interrupt::listen();
    let progress = Progress::new("learning", None, common.quiet);
    let found = learn(&case, motion, &trial, before.as_ref(), &|| interrupt.signal().is_some());
    progress.clear();
    if let Some(signal) = interrupt.signal() {
        return Err(interrupted(signal, "interrupted before anything was learned; nothing was written"));
    }
    let found = found.map_err(|error| Failure::work(error.in_file(&args.log)))?;
    let data = json::text(&json::learned(&case, motion, at, &found));
    let advice = "add --out DIR for the signal as next.csv and a report";
    let mut finished = Finished::new("learn", ("learn.json", data), table::text(&case, motion, &found), advice);
    finished.remarks.extend(beyond(design.limit, unit, &found));
    if found.predicted.first().is_some_and(|next| next.worst.rms >= found.now.rms) {
        let told = "the error is near its limit: it may not be smaller after the next repetition; keep the signal with \
                    which it was smallest";
        finished.remarks.push(Remark::Note(told.into()));
    }
    if finished.remarks.iter().any(|remark| matches!(remark, Remark::Warning(_))) {
        finished.status = Status::Incomplete;
    }
    if common.out.is_some() {
        finished.files.push(("next.csv".into(), csv(&found, unit)));
    }
    if common.reports() {
        let figures = figures(&found, unit);
        let page = page(&case, motion, &found, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into())).collect();
        finished.report = Some(Report { page, pictures });
    }
    finished.finish(common, folder)
}

/// A warning if the signal alone is more than the controller may command.
fn beyond(limit: Option<f64>, unit: &str, found: &Learned) -> Option<Remark> {
    let (limit, largest) = (limit?, found.largest());
    (largest > limit).then(|| {
        Remark::Warning(format!(
            "the signal reaches {} {unit}, and the controller commands {limit} {unit} at most: what is cut off is not \
             learned; plan a slower move (`taut plan`)",
            taut::quantity::rounded(largest)
        ))
    })
}

/// The signal as a table.
fn csv(found: &Learned, unit: &str) -> String {
    let mut text = format!("time_s,added_{unit}\n");
    for (time, value) in found.added().times.iter().zip(&found.next) {
        let _ = writeln!(text, "{time},{}", value + 0.0);
    }
    text
}

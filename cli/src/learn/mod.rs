//! `taut learn`: the next feed-forward signal of a repeated move, from its log, or the force along the travel.

mod map;
mod table;

use crate::args::Learn as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use std::fmt::Write;
use taut::Error;
use taut::case::{Files, Move};
use taut::json;
use taut::learning::{At, Learned, Trial, learn};
use taut::log::read_samples;
use taut::machine::Machine;
use taut_report::learn::{figures, page};

/// Reads the case and the log, learns, writes, tells.
pub fn run(args: &Args) -> Outcome {
    // Without --map there is a log.
    let Some(log) = args.log.as_deref() else { return map::run(args) };
    let common = &args.common;
    let case = common.open_for(&args.case, Files::Nothing)?;
    let (design, moves) = case.moves_named(&args.case, &args.moves)?;
    let motion: &Move = match &moves[..] {
        [one] => one,
        several => {
            let names: Vec<&str> = several.iter().map(|one| one.name.as_str()).collect();
            let error = Error::new(format!("the case has {} moves, and a log is of one", several.len()));
            return Err(error.in_file("--move").allowed(names.join(", ")).next("name the move of the log").into());
        }
    };
    let others = || std::iter::once(log).chain(args.added.as_deref());
    let inputs = || folder::inputs_with(&args.case, others(), &case.files);
    let folder = Folder::wanted(common, inputs, ["learn.json", "next.csv", "report.html"])?;
    let at = if args.encoder { At::Encoder } else { At::Cart };
    let (mut time, mut positions) = (Vec::new(), Vec::new());
    for column in args.columns(&case.machine)? {
        let (times, position) = read_samples(log, &args.time, &column)?;
        time = times;
        positions.push(position.into_iter().map(|value| value * args.unit).collect());
    }
    let trial = Trial { time, positions, at };
    trial.check(&case.machine, motion, design).map_err(|error| error.in_file(log))?;
    let unit = case.machine.drives[0].amplifier.mode.unit();
    let before = args.added.as_deref().map(|file| folder::read_added(file, &case.machine)).transpose()?;
    let interrupt = Interrupt::listen();
    let progress = Progress::new("learning", None, common.quiet);
    let found = learn(&case, motion, &trial, before.as_deref(), &|| interrupt.signal().is_some());
    progress.clear();
    if let Some(signal) = interrupt.signal() {
        return Err(interrupted(signal, "interrupted before anything was learned; nothing was written"));
    }
    let found = found.map_err(|error| Failure::work(error.in_file(&args.case)))?;
    let data = json::text(&json::learned(&case, motion, at, &found));
    let advice = "add --out DIR for the signal as next.csv and a report";
    let mut finished = Finished::new("learn", ("learn.json", data), table::text(&case, motion, &found), advice);
    finished.remarks.extend(beyond(design.limit, unit, &found));
    if found.is_near_its_limit() {
        let told = "the error is near its limit: it may not be smaller after the next repetition; keep the signal with \
                    which it was smallest";
        finished.remarks.push(Remark::Note(told.into()));
    }
    if finished.remarks.iter().any(|remark| matches!(remark, Remark::Warning(_))) {
        finished.status = Status::Incomplete;
    }
    if common.out.is_some() {
        finished.files.push(("next.csv".into(), csv(&found, &case.machine)));
    }
    if common.reports() {
        let figures = figures(&found, &case.machine);
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
fn csv(found: &Learned, machine: &Machine) -> String {
    let mut text = format!("time_s,{}\n", folder::added_columns(machine).collect::<Vec<_>>().join(","));
    let signals = found.added();
    for (row, time) in signals.first().map(|signal| &signal.times).into_iter().flatten().enumerate() {
        let values = signals.iter().map(|signal| format!("{}", signal.values[row] + 0.0)).collect::<Vec<_>>();
        let _ = writeln!(text, "{time},{}", values.join(","));
    }
    text
}

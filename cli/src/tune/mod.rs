//! `taut tune`: gains for the structure that a case names, good for the worst axis.

mod table;

use crate::args::Tune as Args;
use crate::command::{Finished, Remark, Report};
use crate::common;
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Target, files_of};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use taut::Error;
use taut::case::{Case, Files, Tuning};
use taut::files::write_atomically;
use taut::json;
use taut::reach::feasible::sentence;
use taut::tune::{Judgement, evaluate, tune};
use taut_report::tune::{Work, figures, hertz, page};

/// Reads the case, tunes, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_for(&args.case, Files::Nothing)?;
    let tuning = tuning(args, &case);
    let target = target(args, &case)?;
    let (found, signal) = match args.evaluate {
        // One run of each move says nothing before its end: a signal ends it at once.
        true => {
            let progress = Progress::of_whole("the moves are run", common.quiet);
            let found = evaluate(&case, &tuning);
            progress.clear();
            (found, None)
        }
        false => {
            let interrupt = Interrupt::listen();
            let progress = Progress::new("designs are tried", None, common.quiet);
            let found = tune(&case, &tuning, &|| interrupt.signal().is_some());
            progress.clear();
            (found, interrupt.signal())
        }
    };
    let tuned = match (found, signal) {
        (Ok(tuned), _) => tuned,
        // What was looked at so far says nothing about the rest.
        (Err(_), Some(signal)) => {
            return Err(interrupted(signal, "interrupted before any gains were found; nothing was written"));
        }
        (Err(error), None) => return Err(error.in_file(&args.case).into()),
    };
    let work = Work { case: &case, tuning: &tuning, tuned: &tuned };
    let text = tuned.case_text(&case, &args.case)?;
    let advice = if args.evaluate { "" } else { "add --out FILE.toml, --out DIR or --in-place" };
    let data = json::text(&json::tuned(&case, &tuning, &tuned));
    let mut finished = Finished::new("tune", ("tune.json", data), table::text(&work, args.verbose), advice);
    finished.remarks = remarks(&work);
    finished.status = match signal {
        Some(signal) => Status::Interrupted(signal),
        None if tuned.holds && tuned.judgement != Judgement::Worse => Status::Done,
        None => Status::Incomplete,
    };
    if args.in_place && tuned.judgement == Judgement::Worse && !args.anyway {
        let told = "the case file was not changed: the gains that were found make moves worse; --anyway writes them";
        finished.remarks.push(Remark::Error(told.into()));
        return finished.finish(common, None);
    }
    let folder = match target {
        Target::Nowhere => None,
        Target::File(path, _claim) => {
            let text = if args.in_place { text } else { folder::moved(&text, &args.case, &path)? };
            write_atomically(&path, text).map_err(Failure::work)?;
            finished.written.push(path.display().to_string());
            None
        }
        Target::Folder(folder) => {
            let text = folder.bring(&text, &files_of(&args.case, &text)?).map_err(Failure::work)?;
            if common.draws() {
                let figures = figures(&work).map_err(Failure::work)?;
                let page = page(&work, &text, &figures);
                let pictures = figures.into_iter().map(|(name, figure)| (name.to_string(), figure.into()));
                finished.report = Some(Report { page, pictures: pictures.collect() });
            }
            finished.files.push(("tuned.toml".into(), text));
            Some(folder)
        }
    };
    finished.finish(common, folder)
}

/// Warnings about the result.
fn remarks(work: &Work) -> Vec<Remark> {
    let tuned = work.tuned;
    let mut remarks = Vec::new();
    if !tuned.after.nominal.stable {
        let told = "the loop is not stable on the axis as the file has it";
        remarks.push(Remark::Warning(format!("{told}: it oscillates at {}", hertz(tuned.after.nominal.at))));
    }
    let short = work.case.shortfalls();
    remarks.extend(short.iter().map(|(name, short)| Remark::Warning(sentence(name, short))));
    remarks
}

/// The tuning of the file, with the options of the command line.
fn tuning(args: &Args, case: &Case) -> Tuning {
    let mut tuning = case.tune.clone().unwrap_or_default();
    tuning.spread = args.spread.or(tuning.spread);
    tuning.corners = args.corners;
    tuning.draws = args.draws.clone();
    tuning.effort = args.effort;
    tuning
}

/// Where to write; never over a file that is read, unless that is asked for.
fn target(args: &Args, case: &Case) -> std::result::Result<Target, Failure> {
    if args.in_place {
        if common::is_standard_input(&args.case) {
            let error = Error::new("standard input cannot be written to").in_file("--in-place");
            return Err(error.next("name a file: --out FILE.toml").into());
        }
        return Ok(Target::File(args.case.clone(), folder::claim(&args.case)?));
    }
    Target::of_case(
        &args.case,
        case,
        &args.common,
        ["tuned.toml", "tune.json"],
        "; --in-place changes the case file itself",
    )
}

//! `taut plan`: the fastest moves that a machine can make.

mod table;

use crate::args::Plan as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Target, files_of};
use crate::interrupt::{Interrupt, interrupted};
use crate::progress::Progress;
use taut::case::Files;
use taut::files::write_atomically;
use taut::json;
use taut::planning::{Planned, plan};
use taut::reach::quickest::Wanted;
use taut_report::plan::{figures, page};
use taut_report::simulate::time;

/// Reads the case, plans, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_for(&args.case, Files::Nothing)?;
    let (_, moves) = case.moves_named(&args.case, &args.moves)?;
    let places: Vec<usize> =
        (0..case.moves.len()).filter(|&k| moves.iter().any(|m| m.name == case.moves[k].name)).collect();
    let target = Target::of_case(&args.case, &case, common, ["planned.toml", "plan.json"], "")?;
    let wanted = Wanted { speed: args.speed, acceleration: args.acceleration, jerk: args.jerk, reserve: args.reserve };
    let interrupt = Interrupt::listen();
    let progress = Progress::of_whole("moves are planned", common.quiet);
    let plans = plan(&case, &places, &wanted, &|| interrupt.signal().is_some());
    progress.clear();
    if let Some(signal) = interrupt.signal() {
        return Err(interrupted(signal, "interrupted before the moves were planned; nothing was written"));
    }
    let plans = plans.map_err(|error| match error.place.is_some() {
        true => Failure::from(error),
        false => Failure::work(error.in_file(&args.case)),
    })?;
    let text = plans.case_text(&case, &args.case)?;
    let data = json::text(&json::plan(&case, &wanted, &plans));
    let advice = "add --out FILE.toml for the case with these limits, or --out DIR for a report, too";
    let mut finished = Finished::new("plan", ("plan.json", data), table::text(&case, &plans), advice);
    finished.remarks = plans.moves.iter().filter_map(remark).collect();
    let own = plans.moves.iter().filter(|planned| !planned.is_kept && case.moves[planned.place].is_planned);
    finished.remarks.extend(own.map(|planned| {
        let name = &planned.name;
        Remark::Note(format!("the move \"{name}\" keeps the `plan` of the file; without it these limits are written"))
    }));
    finished.status = match finished.remarks.iter().any(|remark| matches!(remark, Remark::Warning(_))) {
        true => Status::Incomplete,
        false => Status::Done,
    };
    let folder = match target {
        Target::Nowhere => None,
        Target::File(path, _claim) => {
            write_atomically(&path, folder::moved(&text, &args.case, &path)?).map_err(Failure::work)?;
            finished.written.push(path.display().to_string());
            None
        }
        Target::Folder(folder) => {
            let text = folder.bring(&text, &files_of(&args.case, &text)?).map_err(Failure::work)?;
            if common.draws() {
                let figures = figures(&plans);
                let page = page(&case, &plans, &text, &figures);
                let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into())).collect();
                finished.report = Some(Report { page, pictures });
            }
            finished.files.push(("planned.toml".into(), text));
            Some(folder)
        }
    };
    finished.finish(common, folder)
}

/// A word about a plan whose cart does not arrive, that saturates, or that arrives later than with the limits of the
/// file.
fn remark(planned: &Planned) -> Option<Remark> {
    let name = &planned.name;
    let arrival = if planned.is_kept { &planned.given } else { &planned.best.arrival };
    if arrival.settled < arrival.axes {
        let of = format!("{} of {} axes", arrival.settled, arrival.axes);
        return Some(Remark::Warning(format!(
            "the cart stays in its window after the move \"{name}\" on {of}: better gains (`taut tune`) or a wider window"
        )));
    }
    if arrival.saturated > 0.0 {
        return Some(Remark::Note(format!(
            "the move \"{name}\" saturates for {}, though its reference needs less: feed-forward or a larger --reserve \
             avoids it",
            time(arrival.saturated)
        )));
    }
    planned.is_kept.then(|| {
        Remark::Note(format!(
            "no plan of the move \"{name}\" arrives sooner than with the limits of the file, which stay"
        ))
    })
}

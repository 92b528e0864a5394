//! The same for a gantry: two drives, a bridge, a cart on it.

mod run;
mod table;

use super::{ADVICE, Ended, names, status};
use crate::args::Simulate;
use crate::command::{Finished, Report};
use crate::failure::{Failure, Outcome};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use run::Setting;
use std::path::Path;
use taut::case::Case;
use taut::json::{self, GantrySimulation};
use taut::{Error, Result};
use taut_report::simulate::gantry::{Run, early_end, figures, page, way};
use taut_report::simulate::named;
use taut_report::{Picture, gantry_drawing};

/// Simulates, measures, reports.
pub fn run(args: &Simulate, path: &Path, case: &Case) -> Outcome {
    refuse(args)?;
    let common = &args.common;
    let mechanism = case.machine.mechanism();
    let solver = args.choice().solver_of(&mechanism)?;
    let experiments = case.experiments_named(path, &args.experiments)?;
    let brought = folder::brought(&case.files).into_values();
    let files = names(args, brought, experiments.iter().map(|one| one.file_name()));
    let folder = Folder::wanted(common, || folder::inputs(path, &case.files), files)?;
    let interrupt = Interrupt::listen();
    let setting = Setting { args, case, mechanism: &mechanism, solver, folder: folder.as_ref(), interrupt: &interrupt };

    let mut runs = Vec::new();
    for experiment in experiments {
        runs.push(setting.run(experiment)?);
        if interrupt.signal().is_some() {
            break;
        }
    }
    let told: Vec<_> = runs.iter().map(Run::told).collect();
    let json = ("summary.json", json::text(&GantrySimulation::new(case, solver, &told)));
    let mut finished = Finished::new("simulate", json, table::text(case, solver, &runs), ADVICE);
    if let Some(folder) = &folder {
        let text = folder.bring(&case.text, &case.files).map_err(Failure::work)?;
        if common.draws() {
            finished.report = Some(report(&setting, &text, &runs));
        }
        finished.files.push(("case.toml".into(), text));
    }
    let ended: Vec<Ended> = runs
        .iter()
        .map(|run| Ended { name: &run.experiment.name, outcome: &run.outcome, early: early_end(run, &case.machine) })
        .collect();
    (finished.status, finished.remarks) = status(&ended, solver, &interrupt);
    finished.finish(common, folder)
}

/// The page and its pictures: the machine, every run over time, and the way of the cart in the plane.
fn report(setting: &Setting, text: &str, runs: &[Run]) -> Report {
    let case = setting.case;
    let figures: Vec<_> = runs.iter().map(|run| figures(case, run)).collect();
    let ways: Vec<_> = runs.iter().map(|run| way(case, run)).collect();
    let page = page(case, text, setting.solver, runs, &figures, &ways);
    let names = || runs.iter().map(|run| run.experiment.file_name());
    let mut pictures = vec![("machine".to_string(), Picture::Drawing(gantry_drawing(&case.machine)))];
    let ways = names().zip(ways).filter_map(|(name, way)| Some((format!("{name}-path"), way?.into())));
    pictures.extend(ways);
    pictures.extend(named(names(), figures));
    Report { page, pictures }
}

/// Refuses what is there for an axis alone.
fn refuse(args: &Simulate) -> Result<()> {
    let (option, next) = if args.as_measured {
        ("--as-measured", "leave it out: the columns hold the encoder's counts, where the case has an [encoder]")
    } else if args.draws.is_some() {
        ("--draws", "leave it out: gantries are not fitted yet, so there are no draws of one")
    } else {
        return Ok(());
    };
    Err(Error::new("this is there for a single axis, and not yet for a gantry").in_file(option).next(next))
}

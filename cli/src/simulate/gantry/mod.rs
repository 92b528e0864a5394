//! The same for a gantry: two drives, a bridge, a cart on it.

mod page;
mod plots;
mod run;
mod table;

pub use table::machine;

use super::{Ended, names, status};
use crate::args::Simulate;
use crate::failure::{Failure, Outcome};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::terminal;
use run::{Run, Setting};
use taut::case::GantryCase;
use taut::files::write_atomically;
use taut::json::{self, GantrySimulation};
use taut::solve::Solver;
use taut::{Error, Result};
use taut_report::{gantry_drawing, png};

/// Simulates, measures, reports.
pub fn run(args: &Simulate, case: &GantryCase) -> Outcome {
    refuse(args)?;
    let mechanism = case.gantry.mechanism();
    let solver = args.choice().solver_of(&mechanism)?;
    let experiments = case.experiments_named(&args.experiments)?;
    let inputs = folder::inputs_of(&args.case, &case.files);
    let brought = folder::brought_of(&case.files).into_values();
    let files = names(args, brought, experiments.iter().map(|one| one.file_name()));
    let folder = args.out.as_deref().map(|root| Folder::create(root, inputs, files)).transpose()?;
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
    let summary = json::text(&GantrySimulation::new(case, solver, &told));
    if let Some(folder) = &folder {
        write(folder, &setting, &summary, &runs).map_err(Failure::work)?;
        folder.place()?;
    }
    if args.json {
        terminal::show(&summary);
    } else if !args.quiet {
        terminal::show(&table::text(case, solver, &runs, folder.as_ref()));
    }
    let ended: Vec<Ended> = runs.iter().map(|run| run.ended(&case.gantry)).collect();
    Ok(status(&ended, solver, &interrupt))
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

/// What belongs to all experiments: summary, case, report and plots.
fn write(folder: &Folder, setting: &Setting, summary: &str, runs: &[Run]) -> Result<()> {
    let case = setting.case;
    write_atomically(folder.path("summary.json"), summary)?;
    let brought = folder.bring(&case.files)?;
    let text = case.text_with(|file| brought.get(&file.path).cloned().unwrap_or_default());
    write_atomically(folder.path("case.toml"), &text)?;
    if setting.args.no_report {
        return Ok(());
    }
    let figures: Vec<_> = runs.iter().map(|run| plots::figures(case, run)).collect();
    let ways: Vec<_> = runs.iter().map(|run| plots::way(case, run)).collect();
    page::page(setting, &text, runs, &figures, &ways).write(folder.path("report.html"))?;
    folder.make("plots")?;
    let places = folder.path("plots");
    let drawing = gantry_drawing(&case.gantry);
    write_atomically(places.join("machine.svg"), &drawing)?;
    write_atomically(places.join("machine.png"), png(&drawing, 2.0)?)?;
    for (run, way) in runs.iter().zip(&ways) {
        let Some(way) = way else { continue };
        way.write_svg(places.join(format!("{}-path.svg", run.experiment.file_name())))?;
        way.write_png(places.join(format!("{}-path.png", run.experiment.file_name())))?;
    }
    let names: Vec<String> = runs.iter().map(|run| run.experiment.file_name()).collect();
    super::plots::write_all(&places, &names, &figures)
}

/// What a solver is called where nothing has to be said of how exact it is.
fn is_general(solver: Solver) -> bool {
    matches!(solver, Solver::General { .. })
}

//! `taut simulate`: runs the experiments of a case, and says what they show.

mod band;
mod curves;
mod gantry;
mod page;
pub mod plots;
mod rows;
mod run;
pub mod table;

pub use gantry::machine as gantry_machine;

use crate::args::{Format, Simulate};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::terminal;
use run::{Run, Setting};
use taut::case::{Case, Opened};
use taut::files::write_atomically;
use taut::json::{self, Simulation};
use taut::solve::{self, Ending, Solver};
use taut::stage::Stage;
use taut::{Error, Result};

/// Reads the case, simulates, measures, reports.
pub fn run(args: &Simulate) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    match Opened::read_with(&args.case, &changes)? {
        Opened::Axis(case) => axis(args, &case),
        Opened::Gantry(case) => gantry::run(args, &case),
    }
}

fn axis(args: &Simulate, case: &Case) -> Outcome {
    let solver = args.solver(&case.stage)?;
    let experiments = case.experiments_named(&args.case, &args.experiments)?;
    if args.as_measured {
        measurable(case, solver, args)?;
    }
    let machines = machines(case, args)?;
    let mut inputs = folder::inputs(&args.case, case);
    args.draws.iter().for_each(|file| inputs.add(file));
    let create = |root| {
        Folder::create(
            root,
            inputs,
            names(args, folder::brought(case).into_values(), experiments.iter().map(|one| one.file_name())),
        )
    };
    let folder = args.out.as_deref().map(create).transpose()?;
    let interrupt = Interrupt::listen();
    let setting = Setting { args, case, solver, folder: folder.as_ref(), interrupt: &interrupt, machines: &machines };

    let mut runs = Vec::new();
    for experiment in experiments {
        runs.push(setting.run(experiment)?);
        if interrupt.signal().is_some() {
            break;
        }
    }
    let told: Vec<_> = runs.iter().map(Run::told).collect();
    let summary = json::text(&Simulation::new(case, solver, &told));
    if let Some(folder) = &folder {
        write(folder, &setting, &summary, &runs).map_err(Failure::work)?;
        folder.place()?;
    }
    if args.json {
        terminal::show(&summary);
    } else if !args.quiet {
        terminal::show(&table::text(case, solver, &runs, folder.as_ref()));
    }
    let ended: Vec<Ended> = runs.iter().map(Run::ended).collect();
    Ok(status(&ended, solver, &interrupt))
}

/// The files that will be written, but for plots: `brought` are those of the case's inputs, `experiments` the names of the runs' own.
fn names(
    args: &Simulate,
    brought: impl Iterator<Item = String>,
    experiments: impl Iterator<Item = String>,
) -> Vec<String> {
    let experiments: Vec<String> = experiments.collect();
    let endings = ["csv", "parquet", "events.csv", "measured.csv", "band.csv"];
    let endings = endings.iter().filter(|ending| match **ending {
        "csv" => args.format.contains(&Format::Csv),
        #[cfg(feature = "parquet")]
        "parquet" => args.format.contains(&Format::Parquet),
        "measured.csv" => args.as_measured,
        "band.csv" => args.draws.is_some(),
        ending => ending == "events.csv",
    });
    let tables = endings.flat_map(|ending| experiments.iter().map(move |one| format!("{one}.{ending}")));
    let report = (!args.no_report).then(|| "report.html".to_string());
    let common = ["summary.json", "case.toml"].map(str::to_string);
    tables.chain(common).chain(report).chain(brought).collect()
}

/// What belongs to all experiments: summary, case, report and plots.
fn write(folder: &Folder, setting: &Setting, summary: &str, runs: &[Run]) -> Result<()> {
    let case = setting.case;
    write_atomically(folder.path("summary.json"), summary)?;
    let text = folder.bring_inputs(case)?;
    write_atomically(folder.path("case.toml"), &text)?;
    if setting.args.no_report {
        return Ok(());
    }
    let figures: Vec<_> = runs.iter().map(|run| plots::figures(case, run)).collect();
    page::page(case, &text, setting.solver, runs, &figures).write(folder.path("report.html"))?;
    folder.make("plots")?;
    plots::write(&folder.path("plots"), runs, &figures)
}

/// The machines of --draws.
fn machines(case: &Case, args: &Simulate) -> Result<Vec<Stage>> {
    let Some(file) = &args.draws else { return Ok(Vec::new()) };
    let plan = case.fit.as_ref().ok_or_else(|| {
        Error::new("this case does not say which parameters were drawn")
            .in_file(&args.case)
            .next("use --draws with the fitted.toml of the same folder, or with the case that was fitted")
    })?;
    Ok(band::chosen(taut::fit::machines(case, plan, file)?, args.machines))
}

/// Refuses to log what nobody measures, and what would not be the run.
fn measurable(case: &Case, solver: Solver, args: &Simulate) -> Result<()> {
    if case.stage.encoder.is_none() && case.measurement.is_none() {
        return Err(Error::new("--as-measured: this case does not say how it is measured").in_file(&args.case).next(
            "add [encoder] with for example at = \"motor\" and lines = 512, \
             or [measurement] with a quantity such as motor_current = { step = \"10 mA\" }",
        ));
    }
    match solver {
        Solver::Exact | Solver::General { .. } => Ok(()),
        Solver::Table3 { .. } => {
            Err(Error::new("the steps of --solver table3 follow the rows, and a log has rows of its own")
                .in_file("--as-measured")
                .next("leave --solver table3 out, or --as-measured"))
        }
    }
}

/// How a run ended.
pub struct Ended<'a> {
    name: &'a str,
    outcome: &'a solve::Outcome,
    /// Where it ended early: what is told of that.
    early: Option<String>,
}

/// How it ended, and a word about every run that did not reach its end.
fn status(runs: &[Ended], solver: Solver, interrupt: &Interrupt) -> Status {
    for Ended { name, outcome, early } in runs {
        if let Some(told) = early {
            let advice = match (outcome.ending, solver) {
                (Ending::Diverged { .. }, Solver::Table3 { .. }) => "; a smaller --step may help",
                (Ending::Diverged { .. }, Solver::General { .. }) => "; a smaller --tolerance may help",
                _ => "",
            };
            terminal::show_error(&format!("the run \"{name}\" {told}{advice}"));
        }
        if let Some(told) = table::hidden(name, outcome) {
            terminal::show_warning(&told);
        }
    }
    let relied = |run: &Ended| run.outcome.ending == Ending::Complete && table::hidden(run.name, run.outcome).is_none();
    match interrupt.signal() {
        Some(signal) => Status::Interrupted(signal),
        None if runs.iter().all(relied) => Status::Done,
        None => Status::Incomplete,
    }
}

//! `taut simulate`: runs the experiments of a case, and says what they show.

mod band;
mod rows;
mod run;
mod setting;
mod table;

use crate::args::{Format, Simulate};
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::terminal;
use setting::RunSettings;
use std::ffi::OsString;
use std::path::Path;
use taut::case::{Case, Files};
use taut::files::Claim;
use taut::json::{self, Simulation};
use taut::machine::Machine;
use taut::reach::pull_out::short_supply;
use taut::solve::{self, Ending, Solver};
use taut::{Error, Result};
use taut_report::simulate::{SimulatedExperiment, early_end, hidden, report, yawed};

/// How to keep the result.
const ADVICE: &str = "add --out DIR for files and a report; `taut studio CASE` shows it in motion";

/// Reads the cases, simulates, measures, reports.
pub fn run(args: &Simulate) -> Outcome {
    let [path] = &args.cases[..] else { return several(args) };
    one(args, path)
}

fn one(args: &Simulate, path: &Path) -> Outcome {
    let files = if args.experiments.is_empty() { Files::All } else { Files::Of(&args.experiments) };
    simulate(args, path, &args.common.open_for(path, files)?)
}

/// One case after the other, each into a folder of its own; the gravest end is that of all.
fn several(args: &Simulate) -> Outcome {
    if args.common.json {
        let error = Error::new("--json prints the summary of one case only").in_file("--json");
        return Err(error.next("name one case; or take --out, which writes a summary for each").into());
    }
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_os_string();
    let mut names: Vec<OsString> = args.cases.iter().map(|path| stem(path)).collect();
    if (1..names.len()).any(|k| names[..k].contains(&names[k])) {
        // The folders that they lie in tell them apart: h-frame-follows, core-xy-follows.
        for (name, path) in names.iter_mut().zip(&args.cases) {
            let mut whole = path.parent().and_then(Path::file_name).unwrap_or_default().to_os_string();
            whole.push("-");
            whole.push(&*name);
            *name = whole;
        }
    }
    if let Some(k) = (1..names.len()).find(|&k| args.common.out.is_some() && names[..k].contains(&names[k])) {
        let error = Error::new("another case has the same name, and would be written into the same folder");
        return Err(error.in_file(&args.cases[k]).next("simulate it by itself, with an --out of its own").into());
    }
    // The folder that has those of all cases, before any of them is run.
    let _claim = args.common.out.as_ref().map(|out| Claim::folder(out, &[])).transpose()?.map(folder::noted);
    let mut all = Status::Done;
    for (k, (path, name)) in args.cases.iter().zip(names).enumerate() {
        if k > 0 && !args.common.quiet {
            terminal::show("\n");
        }
        let mut own = args.clone();
        own.common.out = args.common.out.as_ref().map(|out| out.join(name));
        match one(&own, path)? {
            Status::Done => {}
            Status::Incomplete => all = Status::Incomplete,
            interrupted @ Status::Interrupted(_) => return Ok(interrupted),
        }
    }
    Ok(all)
}

fn simulate(args: &Simulate, path: &Path, case: &Case) -> Outcome {
    refuse(args, case)?;
    let common = &args.common;
    let solver = args.solver(&case.machine)?;
    let experiments = case.experiments_named(path, &args.experiments)?;
    if args.as_measured {
        measurable(case, solver, path)?;
    }
    let machines = machines(case, args, path)?;
    let inputs = || {
        let mut inputs = folder::inputs(path, &case.files);
        args.draws.iter().for_each(|file| inputs.add(file));
        inputs
    };
    let files = names(args, folder::brought(&case.files).into_values(), experiments.iter().map(|one| one.file_name()));
    let folder = Folder::wanted(common, inputs, files)?;
    let interrupt = Interrupt::listen();
    let setting =
        RunSettings { args, case, solver, folder: folder.as_ref(), interrupt: &interrupt, machines: &machines };

    let mut runs = Vec::new();
    for experiment in experiments {
        runs.push(setting.run(experiment)?);
        if interrupt.signal().is_some() {
            break;
        }
    }
    let told: Vec<_> = runs.iter().map(SimulatedExperiment::told).collect();
    let json = ("summary.json", json::text(&Simulation::new(case, solver, &told)));
    let mut finished = Finished::new("simulate", json, table::text(case, solver, &runs), ADVICE);
    if let Some(folder) = &folder {
        let text = folder.bring(&case.text, &case.files).map_err(Failure::work)?;
        if common.draws() {
            let (page, pictures) = report(case, &text, solver, &runs, args.live);
            finished.report = Some(Report { page, pictures });
        }
        finished.files.push(("case.toml".into(), text));
    }
    let ended: Vec<Ended> = runs
        .iter()
        .map(|run| Ended {
            name: &run.experiment.name,
            outcome: &run.outcome,
            early: early_end(run, &case.machine),
            doubt: hidden("run", &run.experiment.name, &case.machine, &run.outcome)
                .or_else(|| yawed(&run.experiment.name, &run.metrics)),
        })
        .collect();
    (finished.status, finished.remarks) = status(&ended, solver, &interrupt);
    finished.remarks.extend(short_supply(&case.machine).map(Remark::Warning));
    finished.finish(common, folder)
}

/// Refuses what is there for an axis alone.
fn refuse(args: &Simulate, case: &Case) -> Result<()> {
    let (option, next) = match case.is_axis() {
        true => return Ok(()),
        false if args.as_measured => {
            ("--as-measured", "leave it out: the columns hold the encoder's counts, where the case has an [encoder]")
        }
        false if args.draws.is_some() => ("--draws", "leave it out: the band is that of the drive and cart of an axis"),
        false => return Ok(()),
    };
    Err(Error::new("this is available for a single axis, not yet for a gantry").in_file(option).next(next))
}

/// The files that will be written, but for plots: `brought` are those of the case's inputs, `experiments` the names of
/// the runs' own.
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
    let report = (!args.common.no_report).then(|| "report.html".to_string());
    let common = ["summary.json", "case.toml"].map(str::to_string);
    tables.chain(common).chain(report).chain(brought).collect()
}

/// The machines of --draws.
fn machines(case: &Case, args: &Simulate, path: &Path) -> Result<Vec<Machine>> {
    let Some(file) = &args.draws else { return Ok(Vec::new()) };
    let plan = case.fit.as_ref().ok_or_else(|| {
        Error::new("this case does not say which parameters were drawn")
            .in_file(path)
            .next("use --draws with the fitted.toml of the same folder, or with the case that was fitted")
    })?;
    Ok(band::chosen(taut::fit::machines(case, plan, file)?, args.machines))
}

/// Rejects --as-measured without a recorder or with table3.
fn measurable(case: &Case, solver: Solver, path: &Path) -> Result<()> {
    if case.machine.encoder.is_none() && case.measurement.is_none() {
        return Err(Error::new("--as-measured: this case does not say how it is measured").in_file(path).next(
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
    /// Why it is not to be relied on.
    doubt: Option<String>,
}

/// How it ended, and a word about every run that did not reach its end.
fn status(runs: &[Ended], solver: Solver, interrupt: &Interrupt) -> (Status, Vec<Remark>) {
    let mut remarks = Vec::new();
    for Ended { name, outcome, early, doubt } in runs {
        if let Some(told) = early {
            let advice = match (outcome.ending, solver) {
                (Ending::Diverged { .. }, Solver::Table3 { .. }) => "; a smaller --step may help",
                (Ending::Diverged { .. }, Solver::General { .. }) => "; a smaller --tolerance may help",
                _ => "",
            };
            remarks.push(Remark::Error(format!("the run \"{name}\" {told}{advice}")));
        }
        remarks.extend(doubt.clone().map(Remark::Warning));
    }
    let relied = |run: &Ended| run.outcome.ending == Ending::Complete && run.doubt.is_none();
    let status = match interrupt.signal() {
        Some(signal) => Status::Interrupted(signal),
        None if runs.iter().all(relied) => Status::Done,
        None => Status::Incomplete,
    };
    (status, remarks)
}

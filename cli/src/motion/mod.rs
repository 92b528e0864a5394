//! `taut move`: runs the moves of a case in closed loop, and says where the cart really is.

mod table;

use crate::args::Move as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use std::fmt::Write;
use std::path::Path;
use taut::case::{Case, Files, Move};
use taut::control::fed::Fed;
use taut::control::{Accuracy, Added, Controller, Loop, MoveRun, Rows, Standard, each, stream, worst};
use taut::design::Design;
use taut::files::write_atomically;
use taut::json::{self, Moved};
use taut::machine::Machine;
use taut::reach::feasible::sentence;
use taut::reach::pull_out::short_supply;
use taut::solve::{Flow, Solver};
use taut::trajectory::{CsvWriter, Trajectory};
use taut::tune::trouble;
use taut::{Error, Result};
use taut_report::motion::{Curves, Done, Tried, page};
use taut_report::simulate::{ended_early, hidden, time};

/// Reads the cases, runs their moves, reports.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let cases: Vec<Case> = args.case.iter().map(|path| common.open_for(path, Files::Nothing)).collect::<Result<_>>()?;
    if cases.len() > 1 && common.out.is_some() {
        return Err(Error::new("--out takes the results of one case")
            .in_file("--out")
            .next("name one case, or leave --out out")
            .into());
    }
    let folder = match (&cases[..], &args.case[..]) {
        ([case], [path]) => {
            let inputs = || folder::inputs_with(path, args.added.as_deref(), &case.files);
            Folder::wanted(common, inputs, names(args, case, path)?)?
        }
        _ => None,
    };
    let added = added(args, &cases)?;
    let interrupt = Interrupt::listen();
    let mut tried = Vec::new();
    for (case, path) in cases.iter().zip(&args.case) {
        let (design, moves) = case.moves_named(path, &args.moves)?;
        let mut done = Vec::new();
        for motion in moves {
            if interrupt.signal().is_some() {
                break;
            }
            done.push(one(case, design, motion, (args, added.as_deref()), folder.as_ref(), &interrupt)?);
        }
        tried.push(Tried { case, design, done });
    }
    let (json, text, advice) = match &tried[..] {
        [one] => {
            let mut text = table::text(one);
            if args.drives {
                text.push_str(&table::drives(&one.case.machine));
            }
            (json::text(&told(one)), text, "add --out DIR for files and a report")
        }
        several => (json::text(&several.iter().map(told).collect::<Vec<_>>()), table::comparison(several), ""),
    };
    let mut finished = Finished::new("move", ("summary.json", json), text, advice);
    if let (Some(folder), [tried]) = (&folder, &tried[..]) {
        let text = folder.bring(&tried.case.text, &tried.case.files).map_err(Failure::work)?;
        if common.draws() {
            let (page, pictures) = page(tried, &text);
            finished.report = Some(Report { page, pictures });
        }
        finished.files.push(("case.toml".into(), text));
    }
    (finished.status, finished.remarks) = status(&tried, &interrupt);
    finished.remarks.extend(cases.iter().filter_map(|case| short_supply(&case.machine)).map(Remark::Warning));
    finished.finish(common, folder)
}

/// The signals of `--added`, one for each drive, which are of one move of one machine.
fn added(args: &Args, cases: &[Case]) -> Result<Option<Vec<Added>>> {
    let Some(file) = &args.added else { return Ok(None) };
    let wrong = |what: String, next: &str| Err(Error::new(what).in_file("--added").next(next));
    let ([case], [path]) = (cases, &args.case[..]) else {
        return wrong(format!("a signal is of one case, and there are {}", cases.len()), "name one case");
    };
    let (_, moves) = case.moves_named(path, &args.moves)?;
    if moves.len() > 1 {
        return wrong(format!("a signal is of one move, and the case has {}", moves.len()), "name one with --move");
    }
    if args.spread.is_some() {
        return wrong("--spread runs without what was learned".into(), "leave --spread or --added out");
    }
    folder::read_added(file, &case.machine).map(Some)
}

/// The files that will be written, but for plots.
fn names(args: &Args, case: &Case, path: &Path) -> Result<Vec<String>> {
    let (_, moves) = case.moves_named(path, &args.moves)?;
    // A stepper in open loop has no samples.
    let tables: &[&str] = match case.controller.as_ref().is_some_and(Design::is_open_loop) {
        true => &["csv", "events.csv"],
        false => &["csv", "events.csv", "samples.csv"],
    };
    let tables = moves.iter().flat_map(|one| tables.iter().map(move |ending| format!("{}.{ending}", one.file_name())));
    let report = (!args.common.no_report).then(|| "report.html".to_string());
    let common = ["summary.json", "case.toml"].map(str::to_string);
    Ok(tables.chain(common).chain(report).chain(folder::brought(&case.files).into_values()).collect())
}

/// A case with its moves as data.
fn told(tried: &Tried) -> impl serde::Serialize + use<> {
    let moved: Vec<Moved> = tried.done.iter().map(|done| done.told(&tried.case.machine)).collect();
    let (design, case) = (tried.design, tried.case);
    json::moves(&case.title, design.structure.name(), &Loop::new(design), &case.machine, &moved)
}

/// Runs one move.
fn one<'a>(
    case: &'a Case,
    design: &'a Design,
    motion: &'a Move,
    (args, added): (&Args, Option<&[Added]>),
    folder: Option<&Folder>,
    interrupt: &Interrupt,
) -> std::result::Result<Done<'a>, Failure> {
    let machine = &case.machine;
    let mut own = match added {
        Some(_) => Standard::of_every_drive(design, machine)?,
        None => Standard::of_drives(design, machine)?,
    };
    let profiles = motion.references(design);
    let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
    let name = motion.file_name();
    let writer = folder.map(|folder| CsvWriter::create(folder.path(format!("{name}.csv")))).transpose();
    let mut writer = writer.map_err(Failure::work)?;
    let mut curves = folder.is_some().then(|| Curves::new(machine)).filter(|_| !args.common.no_report);
    let mut trouble = None;
    let (timing, solver) = (Loop::new(design), Solver::for_machine(machine));
    let mut accuracy = Accuracy::new(machine, &timing, &profiles, &rows, solver);
    let mut take = |block: &Trajectory| {
        accuracy.take(block);
        if let Some(curves) = &mut curves {
            curves.take(block);
        }
        trouble = writer.as_mut().and_then(|writer| writer.write(block).err());
        if trouble.is_some() || interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue }
    };
    let keep = folder.is_some();
    let mut fed: Vec<Fed>;
    let mut controllers: Vec<&mut dyn Controller> = match added {
        Some(added) => {
            fed = own.into_iter().zip(added).map(|(own, added)| Fed::new(own, added)).collect();
            fed.iter_mut().map(|fed| fed as &mut dyn Controller).collect()
        }
        None => each(&mut own),
    };
    let mut run = stream(machine, &mut controllers, &timing, &profiles, &rows, solver, keep, &mut take)?;
    if let Some(trouble) = trouble {
        return Err(Failure::work(trouble));
    }
    let mut go_on = || if interrupt.signal().is_some() { Flow::Stop } else { Flow::Continue };
    run.outcome.error = accuracy.finish(&run, &mut controllers, &mut go_on)?;
    let mut files = Vec::new();
    if let (Some(writer), Some(folder)) = (writer, folder) {
        writer.finish().map_err(Failure::work)?;
        files.push(format!("{name}.csv"));
        files.push(folder.write_events(&name, &run.outcome.events).map_err(Failure::work)?);
        if !design.is_open_loop() {
            files.push(write_samples(folder, &name, case, &run).map_err(Failure::work)?);
        }
    }
    let worst = match args.spread.filter(|_| interrupt.signal().is_none()) {
        Some(share) => worst(&case.machine, design, motion, share, solver, &|| interrupt.signal().is_some())?,
        None => None,
    };
    let trouble = trouble::trouble(machine, design, &run, motion);
    let shortfalls = motion.shortfalls(machine, design);
    Ok(Done { motion, run, curves, worst, trouble, shortfalls, files })
}

/// The controller's samples as CSV.
fn write_samples(folder: &Folder, name: &str, case: &Case, run: &MoveRun) -> Result<String> {
    let unit = case.machine.drives[0].amplifier.mode.unit();
    // One drive is not named.
    let geometry = case.machine.geometry();
    let drives: Vec<String> = match geometry.drives {
        [_] => vec![String::new()],
        several => several.iter().map(|drive| format!("{},", geometry.drive_key(drive))).collect(),
    };
    let name_of_drive = if drives.len() > 1 { "drive," } else { "" };
    let mut text = format!("time_s,{name_of_drive}reference_m,measured_m,asked_{unit},given_{unit}\n");
    for s in &run.kept {
        let [reference, measured, asked, given] = [s.reference, s.measured, s.asked, s.given].map(|value| value + 0.0);
        let _ = writeln!(text, "{},{}{reference},{measured},{asked},{given}", s.time, drives[s.drive]);
    }
    let name = format!("{name}.samples.csv");
    write_atomically(folder.path(&name), text)?;
    Ok(name)
}

/// How it ended, and a word about every move that did not reach its end or whose loop is not to be relied on.
fn status(tried: &[Tried], interrupt: &Interrupt) -> (Status, Vec<Remark>) {
    let early = |done: &Done| {
        let told = ended_early(&done.run.outcome.ending, "cart")?;
        Some(Remark::Error(format!("the move \"{}\" {told}", done.motion.name)))
    };
    let unwell = |done: &Done| {
        let words = &done.trouble.as_ref()?.words;
        Some(Remark::Warning(format!("the move \"{}\" is not to be relied on: {words}", done.motion.name)))
    };
    let beyond = |done: &Done| {
        let name = &done.motion.name;
        if !done.shortfalls.is_empty() {
            return Some(Remark::Warning(sentence(name, &done.shortfalls)));
        }
        let saturated = saturated(done).filter(|_| done.trouble.is_none())?;
        Some(Remark::Warning(format!("the move \"{name}\" saturates, though its reference needs less: {saturated}")))
    };
    let unsure = |machine: &Machine, done: &Done| {
        let plain = done.trouble.is_none() && ended_early(&done.run.outcome.ending, "cart").is_none();
        hidden("move", &done.motion.name, machine, &done.run.outcome).filter(|_| plain).map(Remark::Warning)
    };
    let all = || tried.iter().flat_map(|tried| tried.done.iter().map(|done| (&tried.case.machine, done)));
    let remarks: Vec<Remark> = all()
        .flat_map(|(machine, done)| [early(done), beyond(done), unwell(done), unsure(machine, done)])
        .flatten()
        .collect();
    let status = match interrupt.signal() {
        Some(signal) => Status::Interrupted(signal),
        None if remarks.is_empty() => Status::Done,
        None => Status::Incomplete,
    };
    (status, remarks)
}

/// How long the command or the amplifier stood at its limit, in words; none if neither did.
fn saturated(done: &Done) -> Option<String> {
    let ((samples, limited), amplifier) = (done.run.samples, done.run.figures.amplifier_limited());
    if limited > 0 {
        return Some(format!("{limited} of {samples} samples are at the controller's limit"));
    }
    (amplifier > 0.0).then(|| format!("the amplifier is at its limit for {}", time(amplifier)))
}

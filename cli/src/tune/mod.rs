//! `taut tune`: gains for the structure that a case names, good for the worst axis.

mod figures;
mod json;
mod page;
mod table;

use crate::args::Tune as Args;
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::simulate::plots;
use crate::terminal;
use std::path::{Path, PathBuf};
use taut::case::{Case, Cost, Tuning};
use taut::files::{Inputs, write_atomically};
use taut::tune::{Tuned, tune};
use taut::{Error, Result};

/// Where the results go.
enum Target {
    Nowhere,
    /// The case file alone.
    File(PathBuf),
    /// A folder of case file, summary, report and plots.
    Folder(Folder),
}

/// What was asked for and what came of it.
pub struct Work<'a> {
    pub case: &'a Case,
    pub tuning: &'a Tuning,
    pub tuned: &'a Tuned,
}

/// Reads the case, tunes, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    let case = Case::read_with(&args.case, &changes)?;
    let tuning = tuning(args, &case);
    let target = target(args, &case)?;
    let interrupt = Interrupt::listen();
    let tuned = match (tune(&case, &tuning, &|| interrupt.signal().is_some()), interrupt.signal()) {
        (Ok(tuned), _) => tuned,
        // What was looked at so far says nothing about the rest.
        (Err(_), Some(signal)) => {
            terminal::show_error(&"interrupted before any gains were found; nothing was written");
            return Ok(Status::Interrupted(signal));
        }
        (Err(error), None) => return Err(error.in_file(&args.case).into()),
    };
    let work = Work { case: &case, tuning: &tuning, tuned: &tuned };
    let text = tuned.case_text(&case, &args.case)?;
    let json = json::text(&work);
    let mut written = Vec::new();
    match &target {
        Target::Nowhere => {}
        Target::File(path) => {
            write_atomically(path, moved(&text, args, path)?).map_err(Failure::work)?;
            written.push(path.display().to_string());
        }
        Target::Folder(folder) => {
            written = write(&work, folder, &text, &json, args).map_err(Failure::work)?;
            folder.place()?;
        }
    }
    if args.json {
        terminal::show(&json);
    } else if !args.quiet {
        terminal::show(&table::text(&work, &written));
    }
    Ok(match interrupt.signal() {
        Some(signal) => Status::Interrupted(signal),
        None if tuned.holds => Status::Done,
        None => Status::Incomplete,
    })
}

/// What the file says, with what the command line says.
fn tuning(args: &Args, case: &Case) -> Tuning {
    let mut tuning = case.tune.clone().unwrap_or_default();
    if case.moves.is_empty() && tuning.cost.is_some() {
        tuning.cost = Some(Cost::Bandwidth);
    }
    tuning.spread = args.spread.or(tuning.spread);
    tuning
}

/// Where to write; never over a file that is read, unless that is asked for.
fn target(args: &Args, case: &Case) -> std::result::Result<Target, Failure> {
    if args.in_place {
        return Ok(Target::File(args.case.clone()));
    }
    let Some(out) = &args.out else { return Ok(Target::Nowhere) };
    let inputs = folder::inputs(&args.case, case);
    if !out.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let report = (!args.no_report).then(|| "report.html".to_string());
        let names = ["tuned.toml", "tune.json"].map(str::to_string).into_iter().chain(report);
        let names = names.chain(folder::brought(case).into_values());
        return Folder::create(out, inputs, names).map(Target::Folder);
    }
    let own = Inputs::new([&args.case]);
    own.check(out).map_err(|error| error.next("name another --out, or say --in-place"))?;
    inputs.check(out)?;
    if out.exists() {
        return Err(Error::new(format!("{} is there already", out.display()))
            .in_file("--out")
            .next("name another file, or a folder; --in-place changes the case file itself")
            .into());
    }
    folder::leading(case, parent(out))?;
    Ok(Target::File(out.clone()))
}

/// The folder that a file is in.
fn parent(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The text for a place of its own: paths in it lead from there to the same files.
fn moved(text: &str, args: &Args, path: &Path) -> Result<String> {
    if args.in_place {
        return Ok(text.to_string());
    }
    folder::leading(&Case::from_text(&args.case, text)?, parent(path))
}

fn write(work: &Work, folder: &Folder, text: &str, json: &str, args: &Args) -> Result<Vec<String>> {
    let text = folder.bring_inputs(&Case::from_text(&args.case, text)?)?;
    write_atomically(folder.path("tuned.toml"), &text)?;
    write_atomically(folder.path("tune.json"), json)?;
    let mut names = vec!["tuned.toml".to_string(), "tune.json".to_string()];
    if !args.no_report {
        let figures = figures::all(work)?;
        page::page(work, &text, &figures).write(folder.path("report.html"))?;
        folder.make("plots")?;
        for (name, figure) in &figures {
            plots::write_both(&folder.path("plots").join(name), figure)?;
        }
        names.extend(["report.html".to_string(), "plots/".to_string()]);
    }
    let shown = folder.shown();
    Ok(names.into_iter().map(|name| format!("{shown}/{name}")).collect())
}

//! `taut tune`: gains for the structure that a case names, good for the worst axis.

mod figures;
mod json;
mod page;
mod table;

use crate::args::Tune as Args;
use crate::failure::{Failure, Outcome, Status};
use crate::interrupt::Interrupt;
use crate::terminal;
use std::path::{Path, PathBuf};
use taut::case::{Case, Cost, Tuning};
use taut::files::write_atomically;
use taut::tune::{Tuned, tune};
use taut::{Error, Result};

/// Where the results go.
enum Target {
    Nowhere,
    /// The case file alone.
    File(PathBuf),
    /// A folder of case file, summary, report and plots.
    Folder(PathBuf),
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
    let target = target(args)?;
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

/// Where to write; never over a case file, unless that is asked for.
fn target(args: &Args) -> Result<Target> {
    if args.in_place {
        return Ok(Target::File(args.case.clone()));
    }
    let Some(out) = &args.out else { return Ok(Target::Nowhere) };
    let is_file = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let path = if is_file { out.clone() } else { out.join("tuned.toml") };
    let same = match (std::fs::canonicalize(&path), std::fs::canonicalize(&args.case)) {
        (Ok(path), Ok(case)) => path == case,
        _ => false,
    };
    if same {
        return Err(Error::new("this is the case file itself")
            .in_file("--out")
            .next("name another, or say --in-place"));
    }
    if is_file && path.exists() {
        return Err(Error::new(format!("{} is there already", path.display()))
            .in_file("--out")
            .next("name another file, or a folder; --in-place changes the case file itself"));
    }
    Ok(if is_file { Target::File(path) } else { Target::Folder(out.clone()) })
}

/// The text for a place of its own: paths in it lead from there to the same files.
fn moved(text: &str, args: &Args, path: &Path) -> Result<String> {
    if args.in_place {
        return Ok(text.to_string());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Ok(Case::from_text(&args.case, text)?.text_with(|file| crate::fit::between(folder, &file.path)))
}

fn write(work: &Work, folder: &Path, text: &str, json: &str, args: &Args) -> Result<Vec<String>> {
    let folder = crate::simulate::folder::Folder::create(folder)?;
    let text = folder.bring_inputs(&Case::from_text(&args.case, text)?)?;
    write_atomically(folder.path("tuned.toml"), &text)?;
    write_atomically(folder.path("tune.json"), json)?;
    let mut names = vec!["tuned.toml".to_string(), "tune.json".to_string()];
    if !args.no_report {
        let figures = figures::all(work)?;
        page::page(work, &text, &figures).write(folder.path("report.html"))?;
        folder.make("plots")?;
        for (name, figure) in &figures {
            let path = folder.path("plots").join(name);
            figure.write_svg(format!("{}.svg", path.display()))?;
            figure.write_png(format!("{}.png", path.display()))?;
        }
        names.extend(["report.html".to_string(), "plots/".to_string()]);
    }
    let shown = folder.shown();
    Ok(names.into_iter().map(|name| format!("{shown}/{name}")).collect())
}

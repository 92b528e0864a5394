//! `taut fit`: finds parameters from the logs of a case, and says how well they are known.

mod figures;
mod page;
mod posterior;
pub mod table;

use crate::args::Fit as Args;
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::terminal;
use indicatif::ProgressBar;
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use taut::Result;
use taut::case::Case;
use taut::files::write_atomically;
use taut::fit::{Ending, Fit, Posterior, Profile, fit, profiles};
use taut::json;
use taut::solve::Flow;
use taut::trajectory::CsvWriter;

/// How long a fit may take before its progress is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// What was found, and what is told of it.
pub struct Found {
    pub fit: Fit,
    /// Profiles, where a report is written.
    pub profiles: Vec<Profile>,
    /// The posterior, where one is asked for.
    pub drawn: Option<Posterior>,
}

/// Reads the case, fits, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    let case = Case::read_with(&args.case, &changes)?;
    let plan = case.fit_plan(&args.case)?;
    let folder = match &args.out {
        Some(root) => {
            let folder = Folder::create(root, folder::inputs(&args.case, &case), names(args))?;
            folder::leading(&case, folder.root())?;
            Some(folder)
        }
        None => None,
    };
    let interrupt = Interrupt::listen();
    let begin = Instant::now();
    let mut progress = Progress::new(!args.quiet);
    let is_stopped = || interrupt.signal().is_some();
    let fit = fit(&case, &plan, Some(&is_stopped), &mut |cost| {
        progress.show(cost, begin);
        if is_stopped() { Flow::Stop } else { Flow::Continue }
    });
    let fit = match (fit, interrupt.signal()) {
        // Simulations that were ended early say that the model does not get through the logs.
        (Err(_), Some(signal)) => {
            progress.clear();
            terminal::show_error(&"interrupted before the search began; nothing was written");
            return Ok(Status::Interrupted(signal));
        }
        (fit, _) => fit?,
    };
    let shown = args.out.is_some() && !args.no_report && !is_stopped();
    progress.say("profiles of the parameters; Ctrl-C leaves out the rest", begin);
    let profiles = match shown.then(|| profiles(&case, &plan, &fit, Some(&is_stopped))) {
        Some(Err(_)) if is_stopped() => Vec::new(),
        Some(profiles) => profiles?,
        None => Vec::new(),
    };
    progress.clear();
    let drawn = match args.posterior && !is_stopped() {
        true => match posterior::draw(args, &case, &plan, &fit, &interrupt) {
            Err(_) if is_stopped() => None,
            drawn => Some(drawn?).filter(|drawn| drawn.count() > 0),
        },
        false => None,
    };
    if args.posterior && drawn.is_none() {
        terminal::show_error(&"interrupted before the first draw: there is no posterior");
    }
    let found = Found { fit, profiles, drawn };
    let took = begin.elapsed();
    let json = json::text(&json::fit(&case, &found.fit, &found.profiles, found.drawn.as_ref().map(json::posterior)));
    let mut written = Vec::new();
    let held_back = found.fit.warnings().next().is_some() && !args.anyway;
    if let Some(folder) = folder.as_ref().filter(|_| !held_back) {
        written = write(args, folder, &case, &found, &json).map_err(Failure::work)?;
        folder.place()?;
    }
    if args.json {
        terminal::show(&json);
    } else if !args.quiet {
        terminal::show(&table::text(&case, &found, took, args.out.as_deref(), &written));
    }
    Ok(match (interrupt.signal(), found.fit.ending) {
        (Some(signal), _) => Status::Interrupted(signal),
        (None, _) if found.drawn.is_some_and(|drawn| !drawn.doubts().is_empty()) => Status::Incomplete,
        (None, _) if !found.fit.is_reliable() => Status::Incomplete,
        (None, Ending::Converged | Ending::Stalled) => Status::Done,
        (None, _) => Status::Incomplete,
    })
}

/// The files that will be written.
fn names(args: &Args) -> impl Iterator<Item = &'static str> {
    let report = (!args.no_report).then_some("report.html");
    ["fitted.toml", "fit.json"].into_iter().chain(args.posterior.then_some("posterior.csv")).chain(report)
}

/// Writes the files; returns their names.
fn write(args: &Args, folder: &Folder, case: &Case, found: &Found, json: &str) -> Result<Vec<&'static str>> {
    let text = found.fit.case_text(case, &args.case)?;
    let text = folder::leading(&Case::from_text(&args.case, &text)?, folder.root())?;
    write_atomically(folder.path("fitted.toml"), &text)?;
    write_atomically(folder.path("fit.json"), json)?;
    let mut names = vec!["fitted.toml", "fit.json"];
    if let Some(drawn) = &found.drawn {
        let mut writer = CsvWriter::create(folder.path("posterior.csv"))?;
        writer.write(&drawn.table())?;
        writer.finish()?;
        names.push("posterior.csv");
    }
    if !args.no_report {
        page::page(case, found, &text).write(folder.path("report.html"))?;
        names.push("report.html");
    }
    Ok(names)
}

/// What is shown of a fit that takes longer than one likes to wait.
struct Progress {
    bar: Option<ProgressBar>,
    wanted: bool,
    steps: u64,
}

impl Progress {
    fn new(wanted: bool) -> Self {
        Self { bar: None, wanted: wanted && std::io::stderr().is_terminal(), steps: 0 }
    }

    fn show(&mut self, cost: f64, begin: Instant) {
        self.steps += 1;
        self.say(&format!("step {}, cost {cost:.6e}; Ctrl-C keeps the best so far", self.steps), begin);
    }

    fn say(&mut self, what: &str, begin: Instant) {
        if self.bar.is_none() && self.wanted && begin.elapsed() > PATIENCE {
            self.bar = Some(ProgressBar::new_spinner());
        }
        if let Some(bar) = &self.bar {
            bar.set_message(what.to_string());
            bar.tick();
        }
    }

    fn clear(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

//! `taut design`: an experiment that determines parameters best.

mod table;

use crate::args::Design as Args;
use crate::command::{Finished, Report};
use crate::failure::{Outcome, Status};
use crate::folder::{self, Folder};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::terminal::show_warning;
use taut::case::Case;
use taut::fit::experiment_design::{Designed, Request, Verified, design, verify};
use taut::json;
use taut::number::significant;
use taut::{Error, Result, quantity};
use taut_report::design::{figure, page};

/// Reads the case, designs, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_motors(&args.case)?;
    let request = request(args, &case)?;
    let names = ["designed.toml", "design.json", "report.html"];
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    if let Some(folder) = &folder {
        folder::leading(&case.text, &case.files, folder.root())?;
    }
    let interrupt = Interrupt::listen();
    let stop = || interrupt.signal().is_some();
    let progress = Progress::new("looking at inputs", None, common.quiet);
    let found = design(&case, &request, &stop, &mut |kind| progress.tell(|| kind.to_string()));
    let found = found.map_err(|error| error.in_file(&args.case))?;
    let verified = match args.verify {
        machines if machines > 0 && !stop() => {
            progress.tell(|| "fitting simulated logs".into());
            verify(&case, &request, &found, machines, &stop)?
        }
        _ => Vec::new(),
    };
    progress.clear();
    let whole = found.case_text(&case, &args.case)?;
    let data = json::text(&json::design(&case, &found, &verified));
    let advice = "add --out DIR for the case with the experiment in it, and a report";
    let text = table::text(&case, &found, &verified);
    let mut finished = Finished::new("design", ("design.json", data), text, advice);
    if let Some(folder) = &folder {
        let text = folder::leading(&whole, &folder::files_of(&args.case, &whole)?, folder.root())?;
        if common.reports() {
            let figure = figure(&case, &found)?;
            let page = page(&case, &found, &verified, &figure, &text);
            finished.report = Some(Report { page, pictures: vec![("designed".into(), figure.into())] });
        }
        finished.files.push(("designed.toml".into(), text));
    }
    let broken: Vec<String> = verified.iter().filter_map(|one| broken(one, &found)).collect();
    if !broken.is_empty() {
        show_warning(&format!(
            "fits of simulated logs do not keep the predicted errors ({}): from starts that are 10 % off they end in \
             other minima; use another --input, or fit with starts = 8",
            broken.join(", ")
        ));
    }
    finished.status = status(&found, &broken, &interrupt);
    finished.finish(common, folder)
}

/// A broken promise in words.
fn broken(one: &Verified, found: &Designed) -> Option<String> {
    one.broken(found).map(|times| format!("{} {} times", one.name, significant(times, 2)))
}

fn status(found: &Designed, broken: &[String], interrupt: &Interrupt) -> Status {
    match interrupt.signal() {
        Some(signal) => Status::Interrupted(signal),
        None if !broken.is_empty() => Status::Incomplete,
        None if found.promises.iter().any(|promise| promise.wanted && !promise.is_determined()) => Status::Incomplete,
        None => Status::Done,
    }
}

/// The request, from the command line.
fn request(args: &Args, case: &Case) -> Result<Request> {
    let input = args.amplitude.as_deref().map(|text| {
        let unit = case.machine.drives[0].amplifier.mode.unit();
        let value = match text.trim().parse() {
            Ok(number) => number,
            Err(_) => quantity::read(text, unit).map_err(|error| Error::new(format!("--amplitude: {}", error.what)))?,
        };
        match value > 0.0 && f64::is_finite(value) {
            true => Ok(value),
            false => Err(Error::new(format!("--amplitude {text} is no size")).allowed(format!("above 0 {unit}"))),
        }
    });
    Ok(Request {
        names: args.names.clone(),
        kinds: args.kinds.iter().map(|kind| kind.kind()).collect(),
        driven: args.driven.clone(),
        criterion: args.criterion.criterion(),
        duration: args.duration,
        every: args.every,
        margin: args.margin,
        doubt: args.doubt,
        model_error: args.model_error,
        input: input.transpose()?,
        current: args.current,
        travel: args.travel,
        measured: args.measured.clone(),
        seed: args.seed,
    })
}

//! `taut modes`: linearises the stage of a case, and says how it swings.

mod figures;
mod json;
mod page;
mod table;

use crate::args::{BodyName, HoldName, Modes as Args};
use crate::failure::{Failure, Outcome, Status};
use crate::terminal;
use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;
use taut::case::Case;
use taut::files::write_atomically;
use taut::linear::{
    Discrete, Hold, Operation, Place, Range, Response, StateSpace, Transfer, assumptions, places, sticks, travel,
};
use taut::stage::BeltModel;
use taut::{Error, Result};

/// Places along the travel.
const PLACES: usize = 61;

/// Everything the command tells.
pub struct Analysis<'a> {
    case: &'a Case,
    operation: Operation,
    system: StateSpace,
    transfers: Vec<Transfer>,
    /// What was taken for granted.
    words: Vec<String>,
    /// Whether the stage sticks at rest.
    sticks: bool,
    /// At the place that was asked for.
    here: Place,
    /// Along the travel, where the place makes a difference.
    travel: Option<Vec<Place>>,
    responses: Vec<Response>,
    discrete: Option<Discrete>,
}

/// Reads the case, linearises, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    let case = Case::read_with(&args.case, &changes)?;
    let analysis = Analysis::new(&case, args)?;
    let json = json::text(&analysis);
    let mut written = Vec::new();
    if let Some(folder) = &args.out {
        std::fs::create_dir_all(folder)
            .map_err(|e| Error::new(format!("this folder cannot be made: {e}")).in_file(folder))?;
        written = write(&analysis, args, folder, &json).map_err(Failure::work)?;
    }
    if args.json {
        terminal::show(&json);
    } else if !args.quiet {
        terminal::show(&table::text(&analysis, args.out.as_deref(), &written));
    }
    Ok(Status::Done)
}

impl<'a> Analysis<'a> {
    fn new(case: &'a Case, args: &Args) -> Result<Self> {
        let held = [BodyName::Drive, BodyName::Cart, BodyName::Idler].map(|body| args.stuck.contains(&body));
        let usual = Operation::default();
        let operation =
            Operation { speed: args.speed.unwrap_or(usual.speed), position: args.at.unwrap_or(usual.position), held };
        let stage = &case.stage;
        within(case, args)?;
        let system = StateSpace::of(stage, operation).map_err(|error| error.in_file("--at"))?;
        let transfers = system.transfers()?;
        let frequencies = frequencies(&transfers, args)?;
        let responses = system.responses(&transfers, &frequencies);
        let along = places(stage, PLACES).map(|places| travel(stage, operation, &places)).transpose()?;
        let here = travel(stage, operation, &[operation.position])?.swap_remove(0);
        let hold = match args.hold.unwrap_or_default() {
            HoldName::Zero => Hold::Zero,
            HoldName::First => Hold::First,
            HoldName::Tustin => Hold::Tustin,
        };
        let discrete = args.sample_time.map(|time| system.discrete(time, hold, args.delay.unwrap_or(0.0)));
        let discrete = discrete.transpose().map_err(|error| error.in_file("--sample-time"))?;
        let (words, sticks) = (assumptions(stage, operation), sticks(stage, operation));
        Ok(Self { case, operation, system, transfers, words, sticks, here, travel: along, responses, discrete })
    }

    /// Whether the stiffness or the friction of the stage depends on where the cart is, in words.
    fn along(&self) -> &'static str {
        let stage = &self.case.stage;
        match (&self.travel, stage.belt.make) {
            _ if stage.belt.model == BeltModel::Rigid => {
                "a rigid belt has no spans that could change with the position"
            }
            (Some(_), _) => "spans 1 and 2 follow the cart: k = A E / l with the length that is left",
            (None, Some(_)) => {
                "the same along the travel: this file's stiffness does not depend on the position \
                 (belt.follows_cart = true makes spans 1 and 2 follow the cart)"
            }
            (None, None) => {
                "the same along the travel: this file gives the spans' stiffness as such \
                 (belt.modulus, section, spans and follows_cart = true make them follow the cart)"
            }
        }
    }
}

/// Refuses a place outside the travel.
fn within(case: &Case, args: &Args) -> Result<()> {
    match (args.at, case.stage.travel) {
        (Some(at), Some(travel)) if !(travel.min..=travel.max).contains(&at) => {
            Err(Error::new(format!("{at} m is outside the travel"))
                .in_file("--at")
                .allowed(format!("{} m to {} m", travel.min, travel.max))
                .next("name a place on the travel, or change [travel]"))
        }
        _ => Ok(()),
    }
}

/// The frequencies of the response, rad/s.
fn frequencies(transfers: &[Transfer], args: &Args) -> Result<Vec<f64>> {
    let poles = transfers.first().map_or(&[][..], |transfer| &transfer.poles);
    let zeros: Vec<_> = transfers.iter().map(|transfer| transfer.zeros.clone()).collect();
    let usual = Range::of(poles, &zeros);
    let range = Range {
        from: args.from.map_or(usual.from, |hertz| 2.0 * PI * hertz),
        to: args.to.map_or(usual.to, |hertz| 2.0 * PI * hertz),
        ..usual
    };
    if range.from >= range.to {
        let [from, to] = [range.from, range.to].map(|omega| omega / (2.0 * PI));
        return Err(Error::new(format!("the response would end at {to} Hz, before it begins at {from} Hz"))
            .in_file("--from, --to")
            .next("give --from and --to, the lower one first"));
    }
    let roots: Vec<_> = poles.iter().chain(zeros.iter().flat_map(|zeros| &zeros.values)).copied().collect();
    Ok(range.frequencies(&roots))
}

/// Writes the files; returns their names.
fn write(analysis: &Analysis, args: &Args, folder: &Path, json: &str) -> Result<Vec<&'static str>> {
    write_atomically(folder.join("modes.json"), json)?;
    write_atomically(folder.join("frequency-response.csv"), csv(analysis))?;
    let mut names = vec!["modes.json", "frequency-response.csv"];
    if !args.no_report {
        let figures = figures::all(analysis);
        page::page(analysis, &figures).write(folder.join("report.html"))?;
        let plots = folder.join("plots");
        std::fs::create_dir_all(&plots)
            .map_err(|e| Error::new(format!("this folder cannot be made: {e}")).in_file(&plots))?;
        for (name, figure) in &figures {
            figure.write_svg(plots.join(format!("{name}.svg")))?;
            figure.write_png(plots.join(format!("{name}.png")))?;
        }
        names.extend(["report.html", "plots/"]);
    }
    Ok(names)
}

/// The response of every output: magnitude as it is and in dB, phase in degrees.
fn csv(analysis: &Analysis) -> String {
    let mut text = String::from("frequency_Hz,frequency_rad_s");
    for output in &analysis.system.outputs {
        let _ = write!(text, ",{0}_magnitude,{0}_magnitude_dB,{0}_phase_deg", output.name);
    }
    text.push('\n');
    let columns: Vec<[Vec<f64>; 3]> =
        analysis.responses.iter().map(|r| [r.magnitude(), r.decibels(), r.degrees()]).collect();
    let frequencies = analysis.responses.first().map_or(&[][..], |response| &response.frequency);
    for (k, omega) in frequencies.iter().enumerate() {
        let _ = write!(text, "{},{omega}", omega / (2.0 * PI));
        for column in columns.iter().flatten() {
            let _ = write!(text, ",{}", column[k]);
        }
        text.push('\n');
    }
    text
}

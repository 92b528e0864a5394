//! `taut modes`: linearises the stage of a case, and says how it swings.

mod figures;
mod gantry;
mod page;
mod table;

use crate::args::{BodyName, HoldName, Modes as Args};
use crate::failure::{Failure, Outcome, Status};
use crate::folder::{self, Folder};
use crate::simulate::plots;
use crate::terminal;
use std::f64::consts::PI;
use std::fmt::Write;
use taut::Result;
use taut::case::{Case, Opened};
use taut::files::write_atomically;
use taut::json;
use taut::linear::{Analysis, Hold, Question};
use taut::stage::BeltModel;

/// Reads the case, linearises, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let changes: Vec<&str> = args.changes.iter().map(String::as_str).collect();
    match Opened::read_with(&args.case, &changes)? {
        Opened::Axis(case) => axis(args, &case),
        Opened::Gantry(case) => gantry::run(args, &case),
    }
}

fn axis(args: &Args, case: &Case) -> Outcome {
    let analysis = Analysis::of(case, &question(args))?;
    let json = json::text(&json::modes(&analysis));
    let mut written = Vec::new();
    if let Some(folder) = &args.out {
        let names = ["modes.json", "frequency-response.csv", "report.html"];
        let folder = Folder::create(folder, folder::inputs(&args.case, case), names)?;
        written = write(&analysis, args, &folder, &json).map_err(Failure::work)?;
        folder.place()?;
    }
    if args.json {
        terminal::show(&json);
    } else if !args.quiet {
        terminal::show(&table::text(&analysis, args.out.as_deref(), &written));
    }
    Ok(Status::Done)
}

/// What the command line asks.
fn question(args: &Args) -> Question {
    Question {
        speed: args.speed,
        at: args.at,
        held: [BodyName::Drive, BodyName::Cart, BodyName::Idler].map(|body| args.stuck.contains(&body)),
        sample_time: args.sample_time,
        hold: match args.hold.unwrap_or_default() {
            HoldName::Zero => Hold::Zero,
            HoldName::First => Hold::First,
            HoldName::Tustin => Hold::Tustin,
        },
        delay: args.delay.unwrap_or(0.0),
        from: args.from,
        to: args.to,
    }
}

/// Whether the stiffness or the friction of the stage depends on where the cart is, in words.
pub fn along(analysis: &Analysis) -> &'static str {
    let stage = &analysis.case.stage;
    match (&analysis.travel, stage.belt.make) {
        _ if stage.belt.model == BeltModel::Rigid => "a rigid belt has no spans that could change with the position",
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

/// Writes the files; returns their names.
fn write(analysis: &Analysis, args: &Args, folder: &Folder, json: &str) -> Result<Vec<&'static str>> {
    write_atomically(folder.path("modes.json"), json)?;
    write_atomically(folder.path("frequency-response.csv"), csv(analysis))?;
    let mut names = vec!["modes.json", "frequency-response.csv"];
    if !args.no_report {
        let figures = figures::all(analysis);
        page::page(analysis, &figures).write(folder.path("report.html"))?;
        folder.make("plots")?;
        for (name, figure) in &figures {
            plots::write_both(&folder.path("plots").join(name), figure)?;
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

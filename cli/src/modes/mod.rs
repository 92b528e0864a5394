//! `taut modes`: linearises the stage of a case, and says how it swings.

mod figures;
mod gantry;
mod page;
mod table;

pub use page::printed;

use crate::args::{BodyName, HoldName, Modes as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use std::f64::consts::PI;
use std::fmt::Write;
use taut::case::{Case, Opened};
use taut::json;
use taut::linear::{Analysis, Hold, Question};
use taut::stage::BeltModel;

/// Reads the case, linearises, writes, tells.
pub fn run(args: &Args) -> Outcome {
    match args.common.open(&args.case)? {
        Opened::Axis(case) => axis(args, &case),
        Opened::Gantry(case) => gantry::run(args, &case),
    }
}

fn axis(args: &Args, case: &Case) -> Outcome {
    let common = &args.common;
    let analysis = Analysis::of(case, &question(args))?;
    let names = ["modes.json", "frequency-response.csv", "report.html"];
    let folder = Folder::wanted(common, || folder::inputs(&args.case, case), names)?;
    let advice = "add --out DIR for matrices, frequency response and a report";
    let json = ("modes.json", json::text(&json::modes(&analysis)));
    let mut finished = Finished::new("modes", json, table::text(&analysis), advice);
    if common.out.is_some() {
        finished.files.push(("frequency-response.csv".into(), csv(&analysis)));
    }
    if common.reports() {
        let figures = figures::all(&analysis);
        let page = page::page(&analysis, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name.to_string(), figure.into()));
        finished.report = Some(Report { page, pictures: pictures.collect() });
    }
    finished.finish(common, folder)
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

//! `taut modes`: linearises the stage of a case, and says how it swings.

mod gantry;
mod table;

use crate::args::{BodyName, HoldName, Modes as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use std::f64::consts::PI;
use std::fmt::Write;
use taut::case::{Case, Files};
use taut::json;
use taut::linear::{Analysis, Hold, Question};
use taut_report::modes::{figures, page};

/// Reads the case, linearises, writes, tells.
pub fn run(args: &Args) -> Outcome {
    match args.common.open_for(&args.case, Files::Nothing)? {
        case if case.is_axis() => axis(args, &case),
        case => gantry::run(args, &case),
    }
}

fn axis(args: &Args, case: &Case) -> Outcome {
    let common = &args.common;
    let names = ["modes.json", "frequency-response.csv", "report.html"];
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    let analysis = Analysis::of(case, &question(args))?;
    let advice = "add --out DIR for matrices, frequency response and a report";
    let json = ("modes.json", json::text(&json::modes(&analysis)));
    let mut finished = Finished::new("modes", json, table::text(&analysis), advice);
    if common.out.is_some() {
        finished.files.push(("frequency-response.csv".into(), csv(&analysis)));
    }
    if common.reports() {
        let figures = figures(&analysis);
        let page = page(&analysis, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name.to_string(), figure.into()));
        finished.report = Some(Report { page, pictures: pictures.collect() });
    }
    finished.finish(common, folder)
}

/// The question that the command line asks.
fn question(args: &Args) -> Question {
    Question {
        speed: args.speed,
        at: args.at,
        held: held(args),
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

/// The bodies that are held, by their numbers.
fn held(args: &Args) -> [bool; 6] {
    let mut held = [false; 6];
    for (held, body) in held.iter_mut().zip([BodyName::Drive, BodyName::Cart, BodyName::Idler]) {
        *held = args.stuck.contains(&body);
    }
    held
}

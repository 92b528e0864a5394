//! `taut modes`: linearises the machine of a case, and says how it swings.

mod table;

use crate::args::{HoldName, Modes as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use std::f64::consts::PI;
use std::fmt::Write;
use taut::case::Files;
use taut::json;
use taut::linear::{Analysis, Hold, Question, ResonanceMap};
use taut_report::modes::{page, pictures};

/// Reads the case, linearises, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_for(&args.case, Files::Nothing)?;
    let analysis = Analysis::new(&case, &question(args))?;
    let map = analysis.map.is_some().then_some("map.csv");
    let names = ["modes.json", "frequency-response.csv", "report.html"].into_iter().chain(map);
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    let advice = "add --out DIR for matrices, frequency response and a report";
    let json = ("modes.json", json::text(&json::modes(&analysis)));
    let mut finished = Finished::new("modes", json, table::text(&analysis, args.verbose), advice);
    if common.out.is_some() {
        finished.files.push(("frequency-response.csv".into(), responses(&analysis)));
        finished.files.extend(analysis.map.as_ref().map(|map| ("map.csv".to_string(), places(map))));
    }
    if common.reports() {
        let pictures = pictures(&analysis);
        finished.report = Some(Report { page: page(&analysis, &pictures), pictures: pictures.into_files() });
    }
    finished.finish(common, folder)
}

/// The question that the command line asks.
fn question(args: &Args) -> Question {
    Question {
        speed: args.speed,
        at: args.at,
        bridge: args.bridge,
        held: args.stuck.clone(),
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

/// The response of every output: magnitude as it is and in dB, phase in degrees. Where there are several inputs, each
/// column begins with the name of its own.
fn responses(analysis: &Analysis) -> String {
    let mut text = String::from("frequency_Hz,frequency_rad_s");
    let mut columns: Vec<[Vec<f64>; 3]> = Vec::new();
    for one in &analysis.inputs {
        let of = match analysis.inputs.len() {
            1 => String::new(),
            _ => format!("{}_to_", one.system.input.name),
        };
        for (output, response) in one.system.outputs.iter().zip(&one.responses) {
            let _ = write!(text, ",{of}{0}_magnitude,{of}{0}_magnitude_dB,{of}{0}_phase_deg", output.name);
            columns.push([response.magnitude(), response.decibels(), response.degrees()]);
        }
    }
    text.push('\n');
    let responses = analysis.inputs.first().and_then(|one| one.responses.first());
    for (k, omega) in responses.map_or(&[][..], |response| &response.frequency).iter().enumerate() {
        let _ = write!(text, "{},{omega}", omega / (2.0 * PI));
        for column in columns.iter().flatten() {
            let _ = write!(text, ",{}", column[k]);
        }
        text.push('\n');
    }
    text
}

/// The map, a row for each place.
fn places(map: &ResonanceMap) -> String {
    let mut text = String::from("bridge_position_m,cart_position_m");
    (1..=map.hertz.len()).for_each(|k| {
        let _ = write!(text, ",elastic_{k}_Hz");
    });
    text.push('\n');
    for (i, x) in map.bridge.iter().enumerate() {
        for (j, y) in map.cart.iter().enumerate() {
            let _ = write!(text, "{x},{y}");
            map.hertz.iter().for_each(|mode| {
                let _ = write!(text, ",{}", mode[i][j]);
            });
            text.push('\n');
        }
    }
    text
}

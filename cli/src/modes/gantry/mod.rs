//! The same for a gantry: rigid and elastic modes, and the resonances over the working area.

mod table;

use crate::args::Modes as Args;
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use std::fmt::Write;
use taut::case::Case;
use taut::json;
use taut::linear::{GantryAnalysis, ResonanceMap};
use taut::{Error, Result};
use taut_report::modes::gantry::{page, planes, responses};

/// Finds the modes, writes, tells.
pub fn run(args: &Args, case: &Case) -> Outcome {
    refuse(args)?;
    let common = &args.common;
    let analysis = GantryAnalysis::of(case)?;
    let map = analysis.map.is_some().then_some("map.csv");
    let names = ["modes.json", "report.html"].into_iter().chain(map);
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), names)?;
    let advice = "add --out DIR for the modes as data, the map and a report";
    let json = ("modes.json", json::text(&json::gantry_modes(&analysis)));
    let mut finished = Finished::new("modes", json, table::text(&analysis), advice);
    if common.out.is_some() {
        finished.files.extend(analysis.map.as_ref().map(|map| ("map.csv".to_string(), csv(map))));
    }
    if common.reports() {
        let planes = planes(&analysis);
        let responses = responses(&analysis);
        let page = page(&analysis, &planes, &responses);
        let figures = responses.into_iter().map(|(name, figure)| (name, figure.into()));
        let pictures = planes.into_iter().map(|(name, plane)| (name, plane.into())).chain(figures).collect();
        finished.report = Some(Report { page, pictures });
    }
    finished.finish(common, folder)
}

/// Refuses what is asked of an axis alone.
fn refuse(args: &Args) -> Result<()> {
    let map = "the modes are those with bridge and cart at zero, and the map has every other place: leave it out";
    let slides = "the modes of a gantry are those of everything sliding: leave it out";
    let none =
        "the result has the matrices of the gantry in continuous time, and the responses of each drive: leave it out";
    let asked = [
        ("--at", args.at.is_some(), map),
        ("--speed", args.speed.is_some(), slides),
        ("--stuck", !args.stuck.is_empty(), slides),
        ("--sample-time", args.sample_time.is_some(), none),
        ("--from", args.from.is_some(), none),
        ("--to", args.to.is_some(), none),
    ];
    match asked.into_iter().find(|(_, given, _)| *given) {
        None => Ok(()),
        Some((option, _, next)) => {
            Err(Error::new("this is there for a single axis, and not for a gantry").in_file(option).next(next))
        }
    }
}

/// The map, a row for each place.
fn csv(map: &ResonanceMap) -> String {
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

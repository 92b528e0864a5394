//! `taut shape`: an input shaper from a measured spectrum or from the model, and two spectra compared.

mod table;

use crate::args::{AxisName, MotorName, Shape as Args};
use crate::command::{Finished, Report};
use crate::failure::Outcome;
use crate::folder::Folder;
use std::path::PathBuf;
use taut::control::recommendation::{Question, recommend};
use taut::control::spectrum::Axis;
use taut::files::Inputs;
use taut::json;
use taut::reach::resonance::Drive;
use taut_report::shape::{figures, page};

/// Reads the files, chooses, compares, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let files: Vec<PathBuf> = std::iter::once(&args.spectrum).chain(&args.others).cloned().collect();
    let found = recommend(&question(args), &files)?;
    let common = &args.common;
    let inputs = || Inputs::new(found.each.iter().flat_map(|one| std::iter::once(&one.file).chain(&one.also)));
    let folder = Folder::wanted(common, inputs, ["shape.json", "report.html"])?;
    let advice = "add --out DIR for a report, pictures and shape.json";
    let data = json::text(&json::shape(&found));
    let mut finished = Finished::new("shape", ("shape.json", data), table::text(&found), advice);
    if common.reports() {
        let figures = figures(&found);
        let page = page(&found, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into())).collect();
        finished.report = Some(Report { page, pictures });
    }
    finished.finish(common, folder)
}

/// The question that the command line asks.
fn question(args: &Args) -> Question {
    Question {
        changes: args.common.changes.clone(),
        together: args.together,
        firmware: args.firmware.into(),
        axis: args.axis.map(|axis| match axis {
            AxisName::X => Axis::X,
            AxisName::Y => Axis::Y,
            AxisName::Z => Axis::Z,
        }),
        damping: args.damping,
        max_smoothing: args.max_smoothing,
        max_vibrations: args.max_vibrations,
        corner_speed: args.corner_speed,
        forms: args.shapers.as_ref().map(|shapers| shapers.0.clone()),
        uncertainty: args.uncertainty,
        drive: args.motor.map(|motor| match motor {
            MotorName::Free => Drive::Free,
            MotorName::Held => Drive::Held,
        }),
        pairs: args.pairs,
        belts: args.belts,
    }
}

//! `taut frf`: frequency responses from the logs of a case.

mod table;

use crate::args::Frf as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::{Outcome, Status};
use crate::folder::{self, Folder};
use std::f64::consts::PI;
use std::fmt::Write;
use taut::frf::{Cut, Known, Measurement, measure};
use taut::json;
use taut_report::frf::{figures, page};

/// Reads the case and its logs, measures, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open(&args.case)?;
    let folder =
        Folder::wanted(common, || folder::inputs(&args.case, &case.files), ["frf.json", "frf.csv", "report.html"])?;
    let known = Known::new(&case, args.at, args.bridge, args.delay)?;
    let cut = Cut { segment: args.segment, period: args.period };
    let found = measure(&case, &cut, known).map_err(|error| error.in_file(&args.case))?;
    let data = json::text(&json::frf(&case, &found));
    let advice = "add --out DIR for the responses as a table and a report";
    let mut finished = Finished::new("frf", ("frf.json", data), table::text(&case.title, &found), advice);
    if found.is_astray {
        finished.status = Status::Incomplete;
    }
    finished.remarks.extend(found.warnings.iter().cloned().map(Remark::Warning));
    if common.out.is_some() {
        finished.files.push(("frf.csv".into(), csv(&found)));
    }
    if common.reports() {
        let figures = figures(&found, &case.machine);
        let page = page(&case, &found, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name, figure.into()));
        finished.report = Some(Report { page, pictures: pictures.collect() });
    }
    finished.finish(common, folder)
}

/// One row for each frequency of each response.
fn csv(found: &Measurement) -> String {
    let mut text =
        String::from("log,input,quantity,frequency_Hz,real,imaginary,magnitude,phase_deg,radius,coherence\n");
    for one in &found.responses {
        // A name with a comma in it stands in quotes.
        let name = format!("\"{}\"", one.frf.name.replace('"', "\"\""));
        for point in &one.frf.points {
            let (value, hertz) = (point.value, point.omega / (2.0 * PI));
            let _ = writeln!(
                text,
                "{name},{},{},{hertz},{},{},{},{},{},{}",
                one.frf.input,
                one.frf.quantity.name(),
                value.re,
                value.im,
                value.norm(),
                value.arg().to_degrees(),
                point.radius,
                point.coherence
            );
        }
    }
    text
}

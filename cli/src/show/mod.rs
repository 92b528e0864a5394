//! `taut show`: what follows from the numbers of a case.

mod table;

use crate::args::Show as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use taut::case::Files;
use taut::json;
use taut::overview::Overview;
use taut_report::show::{figures, page};

/// Reads the case, computes, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_for(&args.case, Files::All)?;
    let overview = Overview::new(&case)?;
    let folder = Folder::wanted(common, || folder::inputs(&args.case, &case.files), ["show.json", "report.html"])?;
    let advice = "add --out DIR for the same as data and a report";
    let json = ("show.json", json::text(&json::show(&overview)));
    let mut finished = Finished::new("show", json, table::text(&overview, args.verbose), advice);
    let told = |(name, error): (&str, &taut::Error)| Remark::Note(format!("\"{name}\" is left out: {}", error.what));
    finished.remarks = case.left_out().into_iter().map(told).collect();
    if common.reports() {
        let figures = figures(&overview);
        let page = page(&case, &overview, &figures);
        let pictures = figures.into_iter().map(|(name, figure)| (name.to_string(), figure.into())).collect();
        finished.report = Some(Report { page, pictures });
    }
    finished.finish(common, folder)
}

//! `taut learn --map`: the force along the travel, from logs of slow motion in both directions.

use crate::args::Learn as Args;
use crate::command::{Finished, Remark, Report};
use crate::failure::Outcome;
use crate::folder::{self, Folder};
use crate::terminal::bold;
use std::fmt::Write;
use taut::case::Case;
use taut::fit::map::{ForceMap, map};
use taut::json;
use taut_report::learn::map::{figure, head, lines, notes, page};

/// Reads the logs of the case, maps, writes, tells.
pub fn run(args: &Args) -> Outcome {
    let common = &args.common;
    let case = common.open_motors(&args.case)?;
    let inputs = || folder::inputs(&args.case, &case.files);
    let folder = Folder::wanted(common, inputs, ["map.json", "mapped.toml", "report.html"])?;
    if let Some(folder) = &folder {
        folder::leading(&case.text, &case.files, folder.root())?;
    }
    let found = map(&case).map_err(|error| error.in_file(&args.case))?;
    let advice = match found.is_significant {
        true => "add --out DIR for mapped.toml, map.json and a report",
        false => "add --out DIR for map.json and a report",
    };
    let data = json::text(&json::map(&case, &found));
    let mut finished = Finished::new("learn", ("map.json", data), text(&case, &found), advice);
    finished.remarks.extend(notes(&found).into_iter().map(Remark::Note));
    if let Some(folder) = &folder
        && let Some(text) = found.case_text(&case, &args.case)?
    {
        let text = folder::leading(&text, &folder::files_of(&args.case, &text)?, folder.root())?;
        finished.files.push(("mapped.toml".into(), text));
    }
    if common.reports() {
        let pictures = vec![("map".into(), figure(&found).into())];
        finished.report = Some(Report { page: page(&case, &found), pictures });
    }
    finished.finish(common, folder)
}

fn text(case: &Case, found: &ForceMap) -> String {
    let mut text = format!("{}\n\n{}\n", bold(&case.title), head(found));
    for (name, words) in lines(found) {
        let _ = writeln!(text, "  {name:<12}{words}");
    }
    text
}

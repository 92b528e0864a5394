//! `taut paper`: every table, figure and claim of Sollmann & Jouaneh (2011), computed again.

mod belt;
mod claims;
mod diagrams;
mod figures;
mod findings;
mod laws;
mod linear;
mod make;
mod misprints;
mod model;
mod plots;
mod readings;
mod references;
mod report;
mod statements;
mod studies;
mod tables;
mod words;

use crate::args::Paper;
use crate::command::{Finished, Report};
use crate::common::Common;
use crate::failure::{Failure, Outcome};
use crate::folder::Folder;
use claims::{Claim, ClaimSource, Verdict};
use findings::Findings;
use plots::Plot;
use rayon::prelude::*;
use std::path::Path;
use taut::files::{Inputs, write_atomically};
use taut::{Error, Result};

/// Where the results go unless told otherwise.
const FOLDER: &str = "out/paper";

/// Recomputes the paper, writes report, claims, figures and data, and tells the verdicts on the terminal.
pub fn run(args: &Paper) -> Outcome {
    let common = &args.common;
    if !common.changes.is_empty() {
        let error = Error::new("the paper's machines have the paper's numbers").in_file("--set");
        return Err(error.next("change them in a case: taut simulate CASE --set KEY=VALUE").into());
    }
    let out = common.out.as_deref().unwrap_or(Path::new(FOLDER));
    // It reads no files.
    let folder = Folder::create(out, Inputs::default(), [""; 0])?;
    let findings = Findings::new().map_err(Failure::work)?;
    let claims = claims(&findings);
    let plots = plots(&findings);
    let mut finished = Finished::new("paper", ("claims.json", claims::json(&claims)), table(&claims), "");
    write(&folder, common, &findings, &plots).map_err(Failure::work)?;
    if common.draws() {
        finished.report = Some(Report { page: report::page(&findings, &claims, &plots), pictures: Vec::new() });
    }
    finished.finish(common, Some(folder))
}

/// Every claim: the paper's sentences in its order, then P1 to P10, then independent numbers.
fn claims(findings: &Findings) -> Vec<Claim> {
    let mut all = statements::statements(findings);
    all.extend(readings::readings(findings));
    all.extend(references::references(findings));
    all
}

fn plots(findings: &Findings) -> Vec<Plot> {
    let mut all = vec![laws::toothed(findings), figures::travel(findings), laws::beyond(findings)];
    all.extend(figures::figures(findings));
    all.push(figures::table3(findings));
    all
}

/// The curves as data/*.csv, and figures/*.svg where there is a report, figures/*.png where they are asked for.
fn write(folder: &Folder, common: &Common, findings: &Findings, plots: &[Plot]) -> Result<()> {
    let data = folder.path("data");
    folder.make("data")?;
    plots.iter().try_for_each(|plot| write_atomically(data.join(format!("{}.csv", plot.file)), plot.csv()))?;
    if common.no_report {
        return Ok(());
    }
    let figures = folder.path("figures");
    folder.make("figures")?;
    let machine = &findings.sets.table4.machine;
    let drawings = [
        ("figure-01-02", taut_report::machine_drawing(&findings.sets.table1.machine)),
        ("figure-18", diagrams::drive_pulley(machine)),
        ("figure-19", diagrams::whole(machine)),
    ];
    drawings.par_iter().try_for_each(|(name, svg)| picture(&figures, name, svg, common.png))?;
    plots.par_iter().try_for_each(|plot| picture(&figures, &plot.file, &plot.figure.svg(), common.png))
}

/// An SVG, and the PNG of it where that is wanted.
fn picture(folder: &Path, name: &str, svg: &str, png: bool) -> Result<()> {
    write_atomically(folder.join(format!("{name}.svg")), svg)?;
    match png {
        true => write_atomically(folder.join(format!("{name}.png")), taut_report::png(svg, 2.0)?),
        false => Ok(()),
    }
}

/// The table on the terminal.
fn table(claims: &[Claim]) -> String {
    let mut text =
        String::from("Sollmann & Jouaneh, Dynamic modelling of a single-axis belt-drive system (2011), recomputed\n\n");
    let width = claims.iter().map(|c| c.id.len()).max().unwrap_or(0);
    let groups = [
        (ClaimSource::Statement, "Statements of the paper"),
        (ClaimSource::Print, "Printed equations and values"),
        (ClaimSource::Reading, "Results of a close reading"),
        (ClaimSource::Reference, "Independent solutions"),
    ];
    for (kind, heading) in groups {
        text += &format!("{heading}\n");
        for claim in claims.iter().filter(|c| c.kind == kind) {
            let found = taut::number::typed(&words::found(claim)).replace('×', "x");
            text += &format!("  {:width$}  {:<23}  {found}\n", claim.id, claim.verdict().word());
        }
        text += "\n";
    }
    let count = |v: Verdict| claims.iter().filter(|c| c.verdict() == v).count();
    let counts: Vec<String> = Verdict::ALL.iter().map(|v| format!("{} {}", count(*v), v.word())).collect();
    text + &format!("{} claims: {}\n", claims.len(), counts.join(", "))
}

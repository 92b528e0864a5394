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
use crate::failure::{Failure, Outcome, Status};
use crate::folder::Folder;
use crate::terminal;
use claims::{Claim, Kind, Verdict};
use findings::Findings;
use plots::Plot;
use rayon::prelude::*;
use std::path::Path;
use taut::Result;
use taut::files::{Inputs, write_atomically};

/// Where the results go unless told otherwise.
const FOLDER: &str = "out/paper";

/// Recomputes the paper, writes report, claims, figures and data, and tells the verdicts on the terminal.
pub fn run(args: &Paper) -> Outcome {
    let out = args.out.as_deref().unwrap_or(Path::new(FOLDER));
    // It reads no files.
    let folder = Folder::create(out, Inputs::default(), [""; 0])?;
    let findings = Findings::new().map_err(Failure::work)?;
    let claims = claims(&findings);
    let plots = plots(&findings);
    write(&folder, &findings, &claims, &plots).map_err(Failure::work)?;
    folder.place("paper", args.json)?;
    terminal::show(&if args.json { claims::json(&claims) } else { table(&claims, out) });
    Ok(Status::Done)
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

/// report.html, claims.json, figures/*.svg, figures/*.png, data/*.csv.
fn write(folder: &Folder, findings: &Findings, claims: &[Claim], plots: &[Plot]) -> Result<()> {
    let (figures, data) = (folder.path("figures"), folder.path("data"));
    ["figures", "data"].into_iter().try_for_each(|name| folder.make(name))?;
    let stage = &findings.sets.table4.stage;
    let drawings = [
        ("figure-01-02", taut_report::stage_drawing(&findings.sets.table1.stage)),
        ("figure-18", diagrams::drive_pulley(stage)),
        ("figure-19", diagrams::whole(stage)),
    ];
    let drawn = || {
        drawings.par_iter().try_for_each(|(name, svg)| picture(&figures, name, svg))?;
        plots.par_iter().try_for_each(|plot| {
            write_atomically(data.join(format!("{}.csv", plot.file)), plot.csv())?;
            picture(&figures, &plot.file, &plot.figure.svg())
        })
    };
    let page = || report::page(findings, claims, plots).write(folder.path("report.html"));
    let (drawn, page) = rayon::join(drawn, page);
    drawn?;
    page?;
    write_atomically(folder.path("claims.json"), claims::json(claims))
}

/// An SVG and the PNG of it.
fn picture(folder: &Path, name: &str, svg: &str) -> Result<()> {
    write_atomically(folder.join(format!("{name}.svg")), svg)?;
    write_atomically(folder.join(format!("{name}.png")), taut_report::png(svg, 2.0)?)
}

/// What the terminal shows.
fn table(claims: &[Claim], out: &Path) -> String {
    let mut text =
        String::from("Sollmann & Jouaneh, Dynamic modelling of a single-axis belt-drive system (2011), recomputed\n\n");
    let width = claims.iter().map(|c| c.id.len()).max().unwrap_or(0);
    let groups = [
        (Kind::Statement, "What the paper says"),
        (Kind::Print, "What it prints"),
        (Kind::Reading, "What a close reading adds"),
        (Kind::Reference, "Independent solutions"),
    ];
    for (kind, heading) in groups {
        text += &format!("{heading}\n");
        for claim in claims.iter().filter(|c| c.kind == kind) {
            let found = taut::number::ascii(&words::found(claim)).replace('×', "x");
            text += &format!("  {:width$}  {:<23}  {found}\n", claim.id, claim.verdict().word());
        }
        text += "\n";
    }
    let count = |v: Verdict| claims.iter().filter(|c| c.verdict() == v).count();
    let counts: Vec<String> = Verdict::ALL.iter().map(|v| format!("{} {}", count(*v), v.word())).collect();
    text + &format!("{} claims: {}\nreport: {}\n", claims.len(), counts.join(", "), out.join("report.html").display())
}

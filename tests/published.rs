//! Logs of real machines, fitted by their case files, beside what others have published for them.
//!
//! The table in `docs/fit.md` is made here: `UPDATE_EXPECT=1 cargo test -p taut --test all published::` writes it anew.

use crate::common;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use taut::case::Case;
use taut::fit::{Fit, Score, check, fit};
use taut::solve::Flow;

/// The bar of a fit: the root mean square of the residuals over some logs.
struct Row {
    case: &'static str,
    what: &'static str,
    /// True if a log counts, and whether its part that was fitted does.
    logs: fn(&str) -> bool,
    held_out: bool,
    /// Its unit in the table, and how many of it the SI unit is.
    unit: (&'static str, f64),
    published: &'static str,
    most: f64,
}

const fn any(_: &str) -> bool {
    true
}

const ROWS: [Row; 8] = [
    Row {
        case: "emps/symmetric.toml",
        what: "estimation record, open loop",
        logs: any,
        held_out: false,
        unit: ("mm", 1e3),
        published: "2.47 (output error, same freedom)",
        most: 2.5,
    },
    Row {
        case: "emps/asymmetric.toml",
        what: "estimation record, open loop",
        logs: any,
        held_out: false,
        unit: ("mm", 1e3),
        published: "1.59 (output error, same freedom)",
        most: 1.6,
    },
    Row {
        case: "pendulepi/two-levels.toml",
        what: "the four records fitted",
        logs: any,
        held_out: false,
        unit: ("mm", 1e3),
        published: "–",
        most: 1.0,
    },
    Row {
        case: "pendulepi/two-levels.toml",
        what: "the other 38 records",
        logs: any,
        held_out: true,
        unit: ("mm", 1e3),
        published: "4.2 (four parameters)",
        most: 4.2,
    },
    Row {
        case: "pendulepi/every-second.toml",
        what: "the 22 records fitted",
        logs: any,
        held_out: false,
        unit: ("mm", 1e3),
        published: "1.70 (four parameters)",
        most: 1.7,
    },
    Row {
        case: "pendulepi/every-second.toml",
        what: "the other 20 records",
        logs: any,
        held_out: true,
        unit: ("mm", 1e3),
        published: "2.57 (four parameters)",
        most: 2.6,
    },
    Row {
        case: "ced/uniform.toml",
        what: "low record, last 100 values",
        logs: |name| name == "low",
        held_out: true,
        unit: ("", 1.0),
        published: "0.122 (two masses, 10 parameters); NARX 0.100; RNN 0.096",
        most: 0.12,
    },
    Row {
        case: "ced/uniform.toml",
        what: "high record, last 100 values",
        logs: |name| name == "high",
        held_out: true,
        unit: ("", 1.0),
        published: "0.129 (two masses, 10 parameters); GP-NARX 0.089; NARX 0.141",
        most: 0.13,
    },
];

/// Root mean square over the values of some logs.
fn rmse(found: &Fit, row: &Row) -> f64 {
    let logs = found.logs.iter().filter(|log| (row.logs)(&log.name));
    let scores: Vec<Score> = logs
        .flat_map(|log| log.outputs.iter().filter_map(|o| if row.held_out { o.held_out } else { o.fitted }))
        .collect();
    let squares: f64 = scores.iter().map(|score| score.rmse.powi(2) * score.count as f64).sum();
    (squares / scores.iter().map(|score| score.count as f64).sum::<f64>()).sqrt()
}

#[test]
fn published_problems_are_met() {
    if common::data::data(["emps/estimation.mat", "pendulepi/february.csv", "ced/DATAUNIF.csv"]).is_none() {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut table = String::from("| case file | parameters | on | RMSE | published |\n|---|---|---|---|---|\n");
    let mut found: Option<(&str, Fit)> = None;
    for row in &ROWS {
        if found.as_ref().is_none_or(|(case, _)| *case != row.case) {
            let case = Case::read(root.join("stages").join(row.case)).unwrap_or_else(|error| panic!("{error}"));
            let fit = fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap();
            found = Some((row.case, fit));
        }
        let Some((_, fit)) = &found else { unreachable!() };
        let value = rmse(fit, row) * row.unit.1;
        assert!(value <= row.most, "{}, {}: {value} {}", row.case, row.what, row.unit.0);
        let shown = format!("{value:.*} {}", if row.unit.1 > 1.0 { 2 } else { 3 }, row.unit.0);
        let (case, count) = (row.case, fit.estimates.len());
        let link = format!("[`{case}`](../stages/{case})");
        let _ = writeln!(table, "| {link} | {count} | {} | {} | {} |", row.what, shown.trim(), row.published);
    }
    let file = root.join("docs/fit.md");
    let text = fs::read_to_string(&file).unwrap();
    let (begin, end) = ("<!-- published -->\n", "<!-- end -->");
    let (before, rest) = text.split_once(begin).unwrap();
    let (own, after) = rest.split_once(end).unwrap();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&file, format!("{before}{begin}{table}{end}{after}")).unwrap();
    } else {
        assert_eq!(own, table, "UPDATE_EXPECT=1 writes the table anew");
    }
}

/// The inverse-dynamics regression of EMPS gives what its authors published: mass, viscous and Coulomb friction,
/// offset.
#[test]
fn the_regression_of_emps_is_that_of_its_authors() {
    if common::data::data(["emps/estimation.mat"]).is_none() {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let case = Case::read(root.join("stages/emps/symmetric.toml")).unwrap();
    let found = check(&case, case.fit.as_ref().unwrap()).unwrap().balance.unwrap();
    // The radius is one metre, so that torques are forces.
    for (mine, theirs) in
        [(found.inertia, 95.1089), (found.viscous, 203.5034), (found.coulomb, 20.3935), (found.load, -3.1648)]
    {
        assert!((mine / theirs - 1.0).abs() < 5e-3, "{mine} {theirs}");
    }
}

/// EMPS with its loop closed again: with the reference's speed fed forward the controller of the case was another one
/// than that of the record, and from the position alone the mass did not show. The authors' mass is 95.15 kg, and their
/// friction differs by direction.
#[test]
fn emps_in_closed_loop_has_the_mass_and_friction_of_its_authors() {
    if common::data::data(["emps/estimation.mat"]).is_none() {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let case = Case::read(root.join("stages/emps/closed.toml")).unwrap();
    let found = fit(&case, case.fit.as_ref().unwrap(), None, &mut |_| Flow::Continue).unwrap();
    let published = [(95.1089, 0.01), (166.7061, 0.05), (20.1440, 0.05), (240.4236, 0.05), (20.6277, 0.05)];
    for (estimate, (value, share)) in found.estimates.iter().zip(published) {
        assert!((estimate.value / value - 1.0).abs() < share, "{}: {} for {value}", estimate.name, estimate.value);
    }
    let told = found.findings.iter().find(|finding| finding.code == "controller").unwrap().to_string();
    assert_eq!(told, "note: estimation: the controller of the case reproduces the logged input to 99.3 %");
}

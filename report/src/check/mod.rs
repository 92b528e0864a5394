//! Checks of logs as a person sees them.

mod page;

pub use page::page;

use crate::fit::value;
use taut::fit::{Balance, Check, Estimate, Finding};

/// Each parameter with its standard error in words: that of the fit, and so what `taut fit` says.
pub fn shares(found: &Check) -> impl Iterator<Item = (String, String)> {
    let told = |estimate: &Estimate| {
        let error = match estimate.error {
            Some(e) if e.is_finite() && estimate.value != 0.0 => {
                format!("to {:.2} %", 100.0 * (e / estimate.value).abs())
            }
            Some(e) if e.is_finite() => format!("to {}", value(e, estimate.unit, 2)),
            None => "at its bound".into(),
            Some(_) => "not determined".into(),
        };
        (estimate.name.clone(), error)
    };
    found.fit.estimates.iter().map(told)
}

/// The results of the balance of torques, each with its unit, value and standard error.
pub fn regression(found: &Balance) -> impl Iterator<Item = (&'static str, &'static str, f64, f64)> {
    // As `cart.load` counts it: positive towards larger x, where the motor has less to bring up.
    let values = [found.inertia, found.viscous, found.coulomb, -found.load];
    let names = [("inertia", "kg m^2"), ("viscous", "N m s/rad"), ("Coulomb", "N m"), ("load", "N m")];
    let rows = names.into_iter().zip(values).zip(found.errors);
    rows.map(|(((name, unit), value), error)| (name, unit, value, error))
}

/// Logs up to this number are shown with all that is known of each; of more, notes that many share are told once.
const MOST_WHOLE: usize = 4;

/// The survey of each log, indented: of many logs the first lines.
pub fn surveys(found: &Check) -> String {
    let mut text = String::new();
    for log in &found.logs {
        let mut log = log.clone();
        if found.logs.len() > MOST_WHOLE {
            log.channels.clear();
            log.notes.clear();
        }
        log.to_string().lines().for_each(|line| text += &format!("  {line}\n"));
    }
    text
}

/// Findings beside the surveys: of many logs their notes, too, those that many share once.
pub fn findings(found: &Check) -> Vec<String> {
    let notes_too = found.logs.len() > MOST_WHOLE;
    let is_told = |finding: &&Finding| notes_too || finding.log.is_none() || finding.code == "unexplained";
    crate::fit::findings(found.fit.findings.iter().filter(is_told))
}

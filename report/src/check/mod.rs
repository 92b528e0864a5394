//! Checks of logs as a person sees them.

mod page;

pub use page::page;

use crate::fit::value;
use taut::fit::{Balance, Check, Estimate};
use taut::log::{Severity, Survey};

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

/// The survey of a log, indented; not `whole`: its first line and its warnings.
pub fn shown(log: &Survey, whole: bool) -> String {
    let mut log = log.clone();
    if !whole {
        log.channels.clear();
        log.notes.retain(|note| note.severity > Severity::Fact);
    }
    log.to_string().lines().fold(String::new(), |text, line| format!("{text}  {line}\n"))
}

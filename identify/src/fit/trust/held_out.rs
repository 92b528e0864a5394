//! Held-out logs: only their starts are fitted.

use super::scores::{LogFit, compared};
use crate::case::Plan;
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::{Extra, FittedLog, Nuisance};
use crate::fit::limits::{HELD_OUT_ROWS, REFIT_TOLERANCE};
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Options};
use crate::log::Quantity;
use crate::machine::Machine;
use crate::solve::Flow;

/// Results of the fitted logs other than parameters.
pub(crate) struct Known<'a> {
    /// Deviation of each quantity's residuals.
    pub noise: &'a [(Quantity, f64)],
    /// Mean delays, gains and offsets of single logs.
    pub means: Vec<(Nuisance, f64)>,
    /// Nuisances that all logs share, and their values.
    pub shared: Vec<(Extra, f64)>,
}

/// A log compared with the machine: delay, gain and offsets are those of the fitted logs. Its start is fitted to the
/// first `share` of its rows.
pub(crate) fn met(run: &FittedLog, machine: &Machine, known: &Known, share: f64) -> LogFit {
    let mut alone = run.clone();
    for extra in alone.extras.iter_mut().filter(|extra| !extra.what.is_start()) {
        let mean = known.means.iter().find(|(what, _)| *what == extra.what);
        *extra = held(extra, mean.map_or(extra.start, |(_, mean)| *mean));
    }
    alone.extras.extend(known.shared.iter().map(|(extra, value)| held(extra, *value)));
    alone.share(&[]);
    let rows = alone.time.len();
    alone.fitted_rows = ((rows as f64 * share).ceil() as usize).clamp(HELD_OUT_ROWS.min(rows), rows);
    let mut problem = Problem::alone(machine.clone(), alone);
    problem.weigh_by(known.noise);
    let mut x = problem.start();
    if !x.is_empty() {
        let options =
            Options { iterations: 15, tolerance: REFIT_TOLERANCE, rounding: problem.rounding(), ..Options::default() };
        let bounds = problem.bounds();
        let found = minimise(&mut problem, &x, &bounds, &options, &mut |_, _| Flow::Continue);
        if found.ending != Ending::Failed {
            x = found.x;
        }
    }
    let extras = problem.extras_of(0, &x);
    let alone = &problem.runs[0];
    let own = alone.extras.iter().zip(&extras);
    let told = own.filter(|(extra, _)| extra.what.is_start() && extra.known.is_none()).map(|(e, v)| (e.what, *v, None));
    let told = told.collect();
    let mut shown = alone.clone();
    shown.fitted_rows = run.fitted_rows;
    compared(&shown, machine, &extras, told)
}

/// An extra fixed at this value.
fn held(extra: &Extra, value: f64) -> Extra {
    Extra { start: value, low: value, high: value, known: None, ..*extra }
}

/// The plan with its logs but without free parameters.
pub(crate) fn nothing(plan: &Plan) -> Plan {
    Plan {
        free: Vec::new(),
        tied: Vec::new(),
        lumped: Vec::new(),
        separate: Vec::new(),
        priors: Vec::new(),
        bounds: Vec::new(),
        ..plan.clone()
    }
}

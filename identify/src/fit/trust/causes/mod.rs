//! Missing elements: the model is fitted once more with one additional element.
//!
//! Each [`Extension`] is a row of a table. All of them take a few damped Gauss-Newton steps from the end of the fit,
//! which ranks them; the best are fitted completely. With the costs C of the fit and C′ of the fit with the element, it
//! explains
//!
//! ```text
//! 1 − C′/C
//! ```
//!
//! of the residuals. An element is accepted if its size differs significantly from zero, and if the fit with it to
//! parts of the logs predicts the other parts better. With the distance d of the estimates from those with it,
//! intervals of half-width h become √(h² + 2 (d² + h′²)) ≥ d + h′, h′ that of the fit with the element.

mod bristles;
mod extension;
mod force;
mod gear;
mod stamp;
mod tried;

use super::doubts::{Cause, OtherLaw};
use super::parts::{Parts, errors};
use super::uncertainty::Judged;
use crate::case::{Case, Plan};
use crate::fit::asked::problem::Stop;
use crate::fit::asked::run::Run;
use crate::fit::limits::{
    CAUSE_ERRORS, CAUSE_EXPLAINS, CAUSE_MOST_VALUES, CAUSE_NEAR, CAUSE_STEPS, CAUSES_FITTED, COLOURED, HELD_OUT_SHOWS,
    NORMAL, SAME_MINIMUM, STARTS_FITTED,
};
use crate::fit::search::starts::{Effort, Searched};
use crate::machine::Machine;
use extension::{Extended, Extension, Fitted, Said, Site};
use nalgebra::{DMatrix, DVector};
use tried::Tried;

/// All elements.
const EXTENSIONS: &[Extension] = &[
    row("spring", gear::springs, gear::spring_words, gear::without),
    row("play", gear::plays, gear::play_words, gear::without),
    row("delay", stamp::delays, stamp::words, as_it_is),
    row("drag", force::drags, force::drag_words, force::without),
    row("stribeck", force::falls, force::fall_words, force::without_fall),
    row("lugre", bristles::bend, bristles::words, bristles::without),
    row("load", force::loads, force::load_words, as_it_is),
];

const fn row(
    key: &'static str,
    tries: fn(&Site) -> Vec<Extended>,
    words: fn(&Site, &Extended, &Fitted) -> Said,
    without: fn(&Site, Machine) -> Machine,
) -> Extension {
    Extension { key, tries, words, without }
}

fn as_it_is(_: &Site, machine: Machine) -> Machine {
    machine
}

/// The element that explains most of the residuals; `None` if none is accepted, or if the friction law `law` explains
/// more.
pub(crate) fn cause(
    case: &Case,
    plan: &Plan,
    found: &Searched,
    judged: &Judged,
    law: Option<&OtherLaw>,
) -> Option<Cause> {
    if !is_asked(case, plan, found, judged) {
        return None;
    }
    let site = Site::new(case, plan, found);
    let before = found.best.cost;
    let begun = |row: &'static Extension| {
        let tries = (row.tries)(&site).into_iter();
        let begun = tries.filter_map(|extended| Tried::begun(&site, row, extended, CAUSE_STEPS));
        begun.filter(|tried| tried.cost() < CAUSE_NEAR * before).collect::<Vec<_>>()
    };
    let mut ranked: Vec<Tried> = EXTENSIONS.iter().flat_map(begun).collect();
    ranked.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    // The best start of each kind, and those that lead elsewhere and explain something already; runs of curved friction
    // take long.
    let most = (1.0 - CAUSE_EXPLAINS) * before;
    let mut starts: Vec<(usize, Tried)> = Vec::new();
    for tried in ranked {
        let own = starts.iter().filter(|(_, other)| other.kind() == tried.kind());
        let is_new = own.clone().all(|(_, other)| tried.cost() > (1.0 + SAME_MINIMUM) * other.cost());
        let count = own.count();
        let is_asked = match tried.is_curved() {
            true => count == 0 && tried.cost() < most,
            false => count == 0 || is_new && count < STARTS_FITTED && tried.cost() < most,
        };
        if is_asked {
            starts.push((count, tried));
        }
    }
    starts.sort_by_key(|(count, _)| *count);
    starts.truncate(CAUSES_FITTED);
    let mut whole: Vec<Tried> = starts.into_iter().filter_map(|(_, tried)| tried.fitted(&site)).collect();
    whole.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    for tried in whole {
        let gain = 2.0 * (before - tried.cost());
        let explained = 1.0 - tried.cost() / before;
        if explained < CAUSE_EXPLAINS || law.is_some_and(|law| law.gain > gain) {
            return None;
        }
        let Some(known) = tried.judged() else { continue };
        let standard_errors = tried.standard_errors(&known);
        if standard_errors < CAUSE_ERRORS {
            continue;
        }
        let Some(better) = predicts(&site, &tried, found.problem.stop()) else { continue };
        return tried.told(&site, &known, [explained, standard_errors], better);
    }
    None
}

/// True if missing elements are searched for: the residuals are not white, and the fit supports it.
fn is_asked(case: &Case, plan: &Plan, found: &Searched, judged: &Judged) -> bool {
    let problem = &found.problem;
    judged.inflation >= COLOURED
        && case.machine.has_torque_balance()
        && plan.windows.is_none()
        && plan.until.is_none()
        && plan.separate.is_empty()
        && !plan.huber
        && !problem.is_stopped()
        && !problem.runs.iter().any(Run::is_closed)
        && problem.counted() <= CAUSE_MOST_VALUES
        && problem.machine.is_piecewise_linear()
        && !problem.parameters.is_empty()
}

/// Number of parts of the logs that a fit with an element to the other parts predicts better, and number of parts;
/// `None` if the prediction is not clearly better.
fn predicts(site: &Site, tried: &Tried, stop: Option<Stop>) -> Option<[usize; 2]> {
    let without = Case { machine: site.machine.clone(), ..site.case.clone() };
    let plan = Plan { starts: 1, ..site.plan.clone() };
    let (with, own) = tried.case_and_plan();
    let parts = [Parts::new(&without, &plan), Parts::new(&with, &own)];
    let effort = Effort::of_part();
    let [before, after] = &parts;
    let mut gains = Vec::new();
    for (one, other) in before.folds.iter().zip(&after.folds) {
        let mean = |case: &Case, plan: &Plan, fold| {
            let (found, _) = errors(case, plan, fold, (before.is_cut, &effort), stop).ok()?;
            // Quantities in units of their residuals.
            let own = found.iter().map(|(quantity, squares, count)| {
                let deviation = site.deviation(*quantity);
                (squares / (deviation * deviation), *count)
            });
            let (squares, count) = own.fold((0.0, 0), |(s, n), (squares, count)| (s + squares, n + count));
            Some(squares / count.max(1) as f64)
        };
        let (without, with) = (mean(&without, &plan, one)?, mean(&with, &own, other)?);
        // ln of the ratio, since a part in which a start fails has errors of another magnitude.
        gains.push((without / with).ln());
    }
    if gains.len() < 2 {
        return None;
    }
    let n = gains.len() as f64;
    let mean = gains.iter().sum::<f64>() / n;
    let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
    let better = gains.iter().filter(|gain| **gain > 0.0).count();
    // A part in which a start fails has errors of another magnitude: the others are then compared with what the element
    // explains of the whole, ln C/C′.
    gains.sort_by(f64::total_cmp);
    let median = gains[(gains.len() - 1) / 2];
    let whole = (site.found.best.cost / tried.cost()).ln();
    let is_much = mean > variance.sqrt() || median > HELD_OUT_SHOWS * whole;
    let is_clear = better + 1 >= gains.len() && is_much;
    is_clear.then_some([better, gains.len()])
}

/// Covariance to add so that intervals contain estimates shifted by `shift` with these errors.
fn widened(shift: &[f64], errors: &[f64]) -> DMatrix<f64> {
    let d = DVector::from_column_slice(shift);
    let own = DMatrix::from_diagonal(&DVector::from_iterator(errors.len(), errors.iter().map(|e| e * e)));
    // (|d| + h′)² ≤ 2 (d² + h′²)
    &d * d.transpose() * (2.0 / (NORMAL * NORMAL)) + own * 2.0
}

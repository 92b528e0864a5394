//! Inputs that act late, and samples that are taken later than their stamps.

use super::extension::{Extended, Fitted, Said, Site, Telling, shown};
use crate::case::{Plan, Scope};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::Residuals;
use crate::fit::asked::run::Nuisance;
use crate::fit::limits::{CAUSE_DELAYS, CAUSE_ERRORS, WINDOW_DELAYS};
use crate::fit::search::regression::suspected_delay;

/// Inputs that act late, or samples that are taken later than their stamps.
pub(super) fn delays(site: &Site) -> Vec<Extended> {
    if site.plan.nuisance.delay != Scope::Off || site.plan.nuisance.drive_delay.is_some() {
        return Vec::new();
    }
    let mut plan: Plan = site.plan.clone();
    plan.nuisance.delay = Scope::Shared;
    let interval = site.found.problem.runs[0].interval();
    let suspected = suspected_delay(&site.found.problem);
    let starts = begins(site).iter().map(|share| share * interval).chain(suspected);
    starts.map(|delay| with(site, &plan, None, delay)).collect()
}

/// The input of one of several drives that acts late.
pub(super) fn drive_delays(site: &Site) -> Vec<Extended> {
    if site.plan.nuisance.delay != Scope::Off || site.plan.nuisance.drive_delay.is_some() {
        return Vec::new();
    }
    let interval = site.found.problem.runs[0].interval();
    let of = |drive: usize| {
        let mut plan = site.plan.clone();
        plan.nuisance.drive_delay = Some(drive);
        begins(site).iter().map(move |share| with(site, &plan, Some(drive), share * interval))
    };
    (0..site.machine.drives.len()).flat_map(of).collect()
}

/// Delays that are tried, in intervals between samples.
fn begins(site: &Site) -> &'static [f64] {
    if site.is_anew { &WINDOW_DELAYS } else { &CAUSE_DELAYS }
}

/// The case with this delay of one drive, or of all.
fn with(site: &Site, plan: &Plan, drive: Option<usize>, delay: f64) -> Extended {
    let telling = Telling::Nuisance(Nuisance::Delay(drive), delay);
    Extended::new(site.with(site.begins().clone()), plan.clone(), telling)
}

/// A delay in words; with the width of the interval over which samples scatter, if they do.
pub(super) fn words(_: &Site, _: &Extended, found: &Fitted) -> Said {
    let words = match (found.value < 0.0, found.scatter) {
        (true, None) => format!("samples that are taken {} after their time stamps", shown(-found.value, "s")),
        (true, Some(deviation)) => format!(
            "samples that are taken {} after their time stamps in the mean, and scatter over {}",
            shown(-found.value, "s"),
            // Width of a uniform distribution.
            shown(12f64.sqrt() * deviation, "s")
        ),
        (false, _) => format!("an input that acts {} late", shown(found.value, "s")),
    };
    Said { words, add: "add nuisance = { delay = \"shared\" } to [fit]".into() }
}

/// The delay of one drive in words.
pub(super) fn drive_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let at = &site.machine.geometry().drives[extended.plan.nuisance.drive_delay.unwrap_or_default()];
    let when = if found.value < 0.0 { "early" } else { "late" };
    let words = format!("an input of the {} that acts {} {when}", at.label.name, shown(found.value.abs(), "s"));
    Said { words, add: format!("add nuisance = {{ drive_delay = \"{}\" }} to [fit]", at.side()) }
}

/// The standard deviation of the sampling times of positions, s, and its standard error; `None` if the residuals show
/// no scatter.
///
/// A sample that is late by τ has an error of ẏ τ. With additional noise of variance σ²,
///
/// ```text
/// E e² = σ² + s² ẏ²
/// ```
///
/// a line over ẏ², whose slope has a standard error from its residuals (White 1980).
pub(super) fn scatter(problem: &Problem, residuals: &[f64]) -> Option<[f64; 2]> {
    debug_assert_eq!(residuals.len(), problem.rows());
    let mut pairs = Vec::new();
    for (index, run) in problem.runs.iter().enumerate() {
        let (first, n) = (problem.first_row(index), run.time.len());
        let Some((i, seen)) = run.seen.iter().enumerate().find(|(_, seen)| seen.quantity.is_position()) else {
            continue;
        };
        let errors: Vec<f64> = (0..n).map(|k| residuals[first + i * n + k] / seen.weights[k]).collect();
        // The model's position is the value and its error.
        let model: Vec<f64> = errors.iter().zip(&seen.values).map(|(e, value)| value + e).collect();
        for k in 1..n.saturating_sub(1) {
            let speed = (model[k + 1] - model[k - 1]) / (run.time[k + 1] - run.time[k - 1]);
            let pair = [speed * speed, errors[k] * errors[k]];
            pairs.extend(pair.iter().all(|v| v.is_finite()).then_some(pair));
        }
    }
    let n = pairs.len() as f64;
    let [x, y] = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).sum::<f64>() / n);
    let xx: f64 = pairs.iter().map(|pair| (pair[0] - x).powi(2)).sum();
    let slope = pairs.iter().map(|pair| (pair[0] - x) * pair[1]).sum::<f64>() / xx;
    let off = |pair: &[f64; 2]| (pair[0] - x) * (pair[1] - y - slope * (pair[0] - x));
    let error = pairs.iter().map(|pair| off(pair).powi(2)).sum::<f64>().sqrt() / xx;
    (slope > CAUSE_ERRORS * error && slope.is_finite()).then(|| [slope.sqrt(), 0.5 * error / slope.sqrt()])
}

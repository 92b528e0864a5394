//! Reasons why a model explains little of an output: windows, exchanged or reversed columns and factors, each tried by
//! a fit.

use super::trials::{Mended, alike, mended};
use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::Residuals;
use crate::fit::limits::{
    FACTOR_ALIKE, FACTOR_LEAVES, FACTOR_MOVES, FACTOR_STEPS, FACTORS, FACTORS_FITTED, FACTORS_SIMULATED,
    REFIT_TOLERANCE, TRIAL_FIT_ITERATIONS, UNEXPLAINED_WINDOWS, WINDOW_SAMPLES, WINDOWS_EXPLAIN, WINDOWS_MOST,
};
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Options};
use crate::fit::search::starts::Searched;
use crate::log::{Quantity, Remedy};
use crate::number::engineering_typed;
use crate::quantity::rounded;
use crate::solve::Flow;
use std::cmp::Ordering;

/// A reason, in words with what to do, and the code of its finding.
pub(super) struct Reason {
    pub code: &'static str,
    pub text: String,
}

/// The reason why the model explains little of an output in the logs of these names; `None` if neither windows nor
/// exchanged or reversed columns nor a factor correct it.
pub(super) fn reason(case: &Case, plan: &Plan, found: &Searched, quantity: Quantity, names: &[&str]) -> Option<Reason> {
    if found.problem.is_stopped() {
        return None;
    }
    let told = |code| move |text| Reason { code, text };
    of_columns(case, plan, found, quantity, names)
        .or_else(|| windows(case, plan, found, quantity).map(told("unexplained")))
        .or_else(|| factor(case, plan, found, quantity, names).map(told("unexplained")))
}

/// Windows that the model explains.
fn windows(case: &Case, plan: &Plan, found: &Searched, quantity: Quantity) -> Option<String> {
    let runs = &found.problem.runs;
    if plan.windows.is_some() || plan.closed_loop || plan.until.is_some() || !quantity.is_position() {
        return None;
    }
    let lengths = runs.iter().filter_map(|run| Some((run.time.len(), *run.time.last()?)));
    let (rows, longest) = lengths.max_by(|a, b| a.1.total_cmp(&b.1))?;
    for parts in UNEXPLAINED_WINDOWS {
        // To two digits, as in the file.
        let unit = 10f64.powf((longest / parts).log10().floor() - 1.0);
        let length = (longest / parts / unit).round() * unit;
        if (rows as f64) < parts * WINDOW_SAMPLES {
            break;
        }
        let windowed = Plan { windows: Some(length), starts: 1, ..plan.clone() };
        let mut problem = Problem::new(case, &windowed).ok()?.stopped_by(found.problem.stop());
        problem.swings = found.problem.swings;
        problem.weigh_by(&found.noise);
        let start = problem.start();
        if start.len() * problem.rows() > WINDOWS_MOST {
            break;
        }
        let options = Options {
            iterations: TRIAL_FIT_ITERATIONS,
            tolerance: REFIT_TOLERANCE,
            evolutions: 0,
            rounding: problem.rounding(),
            ..Options::default()
        };
        let bounds = problem.bounds();
        let best = minimise(&mut problem, &start, &bounds, &options, &mut |_, _| Flow::Continue);
        if matches!(best.ending, Ending::Failed | Ending::Interrupted) || best.residuals.len() != problem.rows() {
            return None;
        }
        let share = explained(&problem, &best.residuals, quantity);
        if share >= WINDOWS_EXPLAIN {
            let length = engineering_typed(length, "s", 2);
            return Some(format!(
                "in windows of {length} it explains {:.0} %, beyond a straight line in each: its errors add up along the \
                 log, and units and columns are right; set windows = \"{length}\" in [fit]",
                100.0 * share
            ));
        }
    }
    None
}

/// Explained fraction of a quantity, beyond a straight line in each run.
///
/// 1 − √(Σ e²/Σ l²), e the residuals of the model, and l those of the lines
fn explained(problem: &Problem, residuals: &[f64], quantity: Quantity) -> f64 {
    let (mut ours, mut lines) = (0.0, 0.0);
    for (index, run) in problem.runs.iter().enumerate() {
        let (first, n) = (problem.first_row(index), run.time.len());
        for (output, seen) in run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity == quantity) {
            let counted: Vec<usize> = (0..n).filter(|&k| seen.weights[k] > 0.0 && seen.values[k].is_finite()).collect();
            ours += counted.iter().map(|&k| (residuals[first + output * n + k] / seen.weights[k]).powi(2)).sum::<f64>();
            let m = counted.len().max(1) as f64;
            let mean = |of: &dyn Fn(usize) -> f64| counted.iter().map(|&k| of(k)).sum::<f64>() / m;
            let (t, y) = (mean(&|k| run.time[k]), mean(&|k| seen.values[k]));
            let tt = mean(&|k| (run.time[k] - t).powi(2)).max(f64::MIN_POSITIVE);
            let slope = mean(&|k| (run.time[k] - t) * (seen.values[k] - y)) / tt;
            lines += m * mean(&|k| (seen.values[k] - y - slope * (run.time[k] - t)).powi(2));
        }
    }
    1.0 - (ours / lines.max(f64::MIN_POSITIVE)).sqrt()
}

/// Columns that have changed places, or one with the wrong sign.
pub(super) fn of_columns(
    case: &Case,
    plan: &Plan,
    found: &Searched,
    quantity: Quantity,
    names: &[&str],
) -> Option<Reason> {
    let others = alike(&found.problem, quantity);
    exchange(case, plan, found, (quantity, &others), names)
        .or_else(|| reversal(case, plan, found, (quantity, &others), names))
}

/// The output of several of one kind whose sign is wrong: the encoder of one motor of a gantry. That of the only output
/// is the sign of the input.
fn reversal(
    case: &Case,
    plan: &Plan,
    found: &Searched,
    (quantity, others): (Quantity, &[Quantity]),
    names: &[&str],
) -> Option<Reason> {
    let any = std::iter::once(quantity).chain(others.iter().copied()).filter(|_| !others.is_empty());
    any.into_iter().find_map(|own| {
        let flipped = mended(case, plan, found, names, &Remedy::Flip(own), TRIAL_FIT_ITERATIONS)?;
        let (left, name) = (flipped.corrected(own)?, own.name());
        let text = format!(
            "with the sign of {name} reversed {:.1} % of its squared residuals are left: swapped wires of its encoder, \
             or a sign; set scale = {{ {name} = -1 }}",
            100.0 * left
        );
        Some(Reason { code: "sign", text })
    })
}

/// Another output of the same kind with which it was exchanged: the two motors of a gantry.
fn exchange(
    case: &Case,
    plan: &Plan,
    found: &Searched,
    (quantity, others): (Quantity, &[Quantity]),
    names: &[&str],
) -> Option<Reason> {
    others.iter().copied().find_map(|other| {
        let remedy = Remedy::Exchange(quantity, other);
        let left = mended(case, plan, found, names, &remedy, TRIAL_FIT_ITERATIONS)?.left;
        (left <= FACTOR_LEAVES).then(|| Reason {
            code: "swapped",
            text: format!(
                "with the columns of {} and {} exchanged {:.1} % of the squared residuals are left: exchange them, or \
                 those of their inputs",
                quantity.name(),
                other.name(),
                100.0 * left
            ),
        })
    })
}

/// A factor on one column, and what the fit with it leaves.
struct Factor {
    column: &'static str,
    factor: f64,
    remedy: Remedy,
    mended: Mended,
}

impl Factor {
    /// The model with one factor and other free values may resemble that with another: among factors that leave nearly
    /// nothing, the one with the values nearest to those of the case comes first.
    fn order(&self, other: &Self) -> Ordering {
        let alike = |own: &Self| (own.mended.left / FACTOR_ALIKE).max(1.0).ln().round();
        let key = |own: &Self| [alike(own), own.mended.moved, own.mended.left];
        let pairs = key(self).into_iter().zip(key(other));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
    }
}

/// A factor on the output or on the input with which the model explains the logs.
fn factor(case: &Case, plan: &Plan, found: &Searched, quantity: Quantity, names: &[&str]) -> Option<String> {
    let gear = found.problem.machine.drives[0].motor.gear_ratio;
    let gears = [gear, 1.0 / gear].into_iter().filter(|_| gear != 1.0);
    let factors: Vec<f64> = gears.chain(FACTORS).collect();
    let outputs = factors.iter().map(|&factor| (quantity.name(), factor, Remedy::Scale(quantity, factor)));
    // A factor on all inputs would not show which of several is wrong.
    let drives = found.problem.machine.drives.len();
    let inputs = factors.iter().filter(|_| drives == 1).map(|&factor| ("input", factor, Remedy::Drive(factor)));
    // A few steps rank them; the best are fitted completely.
    let tried = |(column, factor, remedy): (&'static str, f64, Remedy), steps| {
        let mended = mended(case, plan, found, names, &remedy, steps)?;
        Some(Factor { column, factor, remedy, mended })
    };
    let again = |own: Factor, steps| tried((own.column, own.factor, own.remedy), steps);
    let best = |mut all: Vec<Factor>, most| {
        all.sort_by(Factor::order);
        all.truncate(most);
        all
    };
    let all = outputs.chain(inputs);
    let ranked: Vec<Factor> = match found.problem.differences > 0 {
        false => all.filter_map(|own| tried(own, FACTOR_STEPS)).collect(),
        // Derivatives by differences take long: simulations choose the factors that take steps.
        true => {
            let simulated = best(all.filter_map(|own| tried(own, 0)).collect(), FACTORS_SIMULATED);
            simulated.into_iter().filter_map(|own| again(own, FACTOR_STEPS)).collect()
        }
    };
    let fitted = best(ranked, FACTORS_FITTED).into_iter().filter_map(|own| again(own, TRIAL_FIT_ITERATIONS));
    let Factor { column, factor, mended, .. } = fitted.min_by(Factor::order)?;
    if mended.left > FACTOR_LEAVES {
        return None;
    }
    let left = format!("{:.1} % of the squared residuals are left", 100.0 * mended.left);
    // A single free value also takes up what those that are kept are off by.
    if mended.moved > FACTOR_MOVES && found.problem.parameters.len() > 1 {
        return Some(format!(
            "a factor on it or on the input explains that ({left}), but with each that is usual a free value differs \
             from that of the case by more than {FACTOR_MOVES} times: check the units of both and the gear ratio"
        ));
    }
    let what = match factor {
        own if own == gear => ", the gear ratio,".to_string(),
        own if own == 1.0 / gear => ", one over the gear ratio,".to_string(),
        _ => String::new(),
    };
    let factor = rounded(factor);
    Some(format!("with {column} times {factor}{what} {left}: set its unit, or scale = {{ {column} = {factor} }}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::logged;
    use crate::fit::search::starts::tests::at_start;
    use std::sync::Arc;

    /// The cart and its pulley go to and fro, and creep beside that: windows have starts of their own, but no creep.
    #[test]
    fn errors_that_add_up_along_a_log_are_told_from_those_within_windows() {
        let changes = ["belt={ model = \"rigid\" }", "experiment.0.input={ sine = \"5 V\", frequency = \"8 Hz\" }"];
        let (case, plan) = logged(&changes, false);
        let told = |creep: f64| {
            let mut case = case.clone();
            let log = Arc::make_mut(case.experiments[0].log.as_mut().unwrap());
            for (output, arm) in log.outputs.iter_mut().zip([case.machine.pulley_radius, 1.0]) {
                output.values.iter_mut().zip(&log.time).for_each(|(value, t)| *value += creep * t / arm);
            }
            let found = at_start(Problem::new(&case, &plan).unwrap());
            windows(&case, &plan, &found, Quantity::CartPosition)
        };
        assert!(told(2e-3).is_some_and(|text| text.contains("in windows of 0.25 s")), "{:?}", told(2e-3));
        assert_eq!(told(12e-3), None);
    }
}

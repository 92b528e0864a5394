//! Tests of suspicions: the model is fitted once more to the logs corrected by a suspicion; unconfirmed suspicions are
//! not reported.
//!
//! Correlations and regressions are quick, and are wrong where noise is narrow-band, where a belt is elastic or where
//! parameters are far off. A corrected log has to leave clearly smaller residuals.

use super::scores::beside_log;
use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::Residuals;
use crate::fit::asked::run::MeasuredOutput;
use crate::fit::limits::{
    FACTOR_LEAVES, HUBER, JUMP, MENDED, NO_WORSE, OPPOSITE, ROUGH_TOLERANCE, STAND_OUT, TRIAL_FIT_ITERATIONS,
    UNIT_WORSE,
};
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Minimum, Options, cost_of};
use crate::fit::search::regression::suspected_shift;
use crate::fit::search::starts::Searched;
use crate::log::{Log, Note, Quantity, Remedy, Severity, Survey, jumps_text};
use crate::number::engineering_typed;
use crate::solve::{Bench, Flow};
use std::sync::Arc;

/// Surveys of all logs, without suspicions that a fit to the corrected log refutes.
pub(crate) fn surveys(case: &Case, plan: &Plan, found: &Searched) -> Vec<Survey> {
    let logs = case.experiments.iter().filter_map(|experiment| experiment.log.as_ref());
    let tested = |log: &Arc<Log>| {
        let mut survey = Survey::new(log, &case.machine);
        survey.notes.iter_mut().for_each(|note| leave_motion(case, found, log, note));
        survey.notes.retain(|note| match &note.remedy {
            Some(Remedy::Step(_, jumps)) if jumps.is_empty() => false,
            Some(remedy) if note.severity != Severity::Fact => is_borne_out(case, plan, found, &log.name, remedy),
            _ => true,
        });
        survey.notes.splice(0..0, shift(case, plan, found, &log.name));
        survey
    };
    logs.map(tested).collect()
}

/// An input logged earlier or later than it acted, by more than a plausible delay.
fn shift(case: &Case, plan: &Plan, found: &Searched, name: &str) -> Option<Note> {
    if plan.closed_loop || found.problem.is_stopped() {
        return None;
    }
    let rows = suspected_shift(&found.problem, name)?;
    let remedy = Remedy::Shift(rows);
    let run = found.problem.runs.iter().find(|run| run.name == name)?;
    let by = engineering_typed(rows.unsigned_abs() as f64 * run.interval(), "s", 3);
    let early = if rows > 0 { "early" } else { "late" };
    let text = format!(
        "it is logged {by} too {early}: the outputs respond as if it were {} rows {} in the file; record both with one \
         clock, or shift the column",
        rows.unsigned_abs(),
        if rows > 0 { "further down" } else { "further up" }
    );
    is_borne_out(case, plan, found, name, &remedy).then_some(Note {
        code: "shift",
        severity: Severity::Suspicion,
        column: Some("input"),
        text,
        remedy: Some(remedy),
    })
}

/// Removes jumps that are motion from a note: the fitted model has them, too, as an axis that slips between two
/// samples.
fn leave_motion(case: &Case, found: &Searched, log: &Log, note: &mut Note) {
    let Some(Remedy::Step(quantity, jumps)) = &mut note.remedy else { return };
    let Some(experiment) = case.experiments.iter().find(|experiment| experiment.name == log.name) else { return };
    let model = beside_log(&found.problem.stage_at(&found.best.x), experiment);
    let output = model.iter().flat_map(|model| &model.outputs).find(|output| output.quantity == *quantity);
    let Some(output) = output else { return };
    jumps.retain(|jump| {
        let step = |values: &[f64]| values[jump.sample] - values[jump.sample - 1];
        let left = step(&output.seen) - step(&output.model);
        // Values that the model does not reach are not explained.
        left.is_nan() || left * jump.size.signum() > JUMP * jump.size.abs()
    });
    note.text = jumps_text(jumps, quantity.unit());
}

/// True if the fit improves with the log of this name corrected by `remedy`, or if that cannot be determined.
pub(crate) fn is_borne_out(case: &Case, plan: &Plan, found: &Searched, name: &str, remedy: &Remedy) -> bool {
    // An incomplete fit, or a log that was not fitted, does not count.
    if found.problem.is_stopped() || !found.problem.runs.iter().any(|run| run.name == name) {
        return true;
    }
    let most = |before: usize, after: usize| match remedy {
        Remedy::Unit(..) => UNIT_WORSE,
        // C n = C₁ k + s C₁ (n − k), with k kept values
        Remedy::Leave(..) => {
            let (n, kept) = (before.max(1) as f64, after as f64);
            n / (kept + STAND_OUT * (n - kept))
        }
        _ => MENDED,
    };
    let ways = match remedy {
        // Either of the two may be wrong.
        Remedy::Ratio(a, b, ratio) => vec![Remedy::Scale(*a, 1.0 / ratio), Remedy::Scale(*b, *ratio)],
        other => vec![other.clone()],
    };
    let tried: Vec<Mended> =
        ways.iter().filter_map(|way| mended(case, plan, found, &[name], way, TRIAL_FIT_ITERATIONS)).collect();
    let before = found.problem.counted();
    let is_better = |one: &Mended| match remedy {
        Remedy::Unit(..) | Remedy::Leave(..) => one.left < most(before, one.counted),
        _ => one.left < NO_WORSE && one.least() < most(before, one.counted),
    };
    tried.is_empty() || tried.iter().any(is_better)
}

/// True if a log moves opposite to the model at the start, by its first position that is measured from its start.
pub(crate) fn is_opposite(problem: &Problem, name: &str) -> bool {
    opposes(problem, name, |seen| seen.quantity.is_position() && !seen.absolute)
}

/// True if the first such output of a log moves opposite to the model at the start.
fn opposes(problem: &Problem, name: &str, is_meant: impl Fn(&MeasuredOutput) -> bool) -> bool {
    let (x, mut worst) = (problem.start(), None);
    for (index, run) in problem.runs.iter().enumerate().filter(|(_, run)| run.name == name) {
        let Some(seen) = run.seen.iter().find(|seen| is_meant(seen)) else { continue };
        let mut column = vec![Vec::new()];
        let extras = problem.extras_of(index, &x);
        if !run.predict(&mut Bench::default(), &problem.stage_at(&x), &extras, &[seen.quantity], &mut column) {
            continue;
        }
        let far = (run.time.len() / 50).max(1);
        let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
        for k in far..run.time.len() {
            let (a, b) = (column[0][k] - column[0][k - far], seen.values[k] - seen.values[k - far]);
            if b.is_finite() {
                (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
            }
        }
        let correlation = ab / (aa * bb).sqrt();
        if correlation.is_finite() {
            worst = Some(worst.map_or(correlation, |worst: f64| worst.min(correlation)));
        }
    }
    worst.is_some_and(|correlation| correlation < OPPOSITE)
}

/// True if logs move opposite to the model, and it explains them with their signs reversed; or so does one of several
/// outputs of one kind.
pub(crate) fn is_reversed(case: &Case, plan: &Plan, found: &Searched) -> bool {
    let problem = &found.problem;
    let mut all: Vec<&str> = problem.runs.iter().map(|run| run.name.as_str()).collect();
    all.dedup();
    let explains = |remedy: Remedy, is_opposite: &dyn Fn(&str) -> bool| {
        let names: Vec<&str> = all.iter().copied().filter(|name| is_opposite(name)).collect();
        let mended = || mended(case, plan, found, &names, &remedy, TRIAL_FIT_ITERATIONS);
        !names.is_empty() && mended().is_some_and(|mended| mended.left <= FACTOR_LEAVES)
    };
    let mut several = problem.quantities().into_iter().filter(|own| !alike(problem, *own).is_empty());
    explains(Remedy::Reverse, &|name| is_opposite(problem, name))
        || several.any(|own| explains(Remedy::Flip(own), &|name| opposes(problem, name, |seen| seen.quantity == own)))
}

/// The other fitted outputs of the kind of this one.
pub(super) fn alike(problem: &Problem, quantity: Quantity) -> Vec<Quantity> {
    let is_alike = |other: &Quantity| {
        *other != quantity
            && other.unit() == quantity.unit()
            && other.is_position() == quantity.is_position()
            && other.is_linear() == quantity.is_linear()
    };
    problem.quantities().into_iter().filter(is_alike).collect()
}

/// Agreement with corrected logs.
pub(crate) struct Mended {
    /// Cost of a value relative to that with the unchanged logs.
    pub left: f64,
    /// That ratio for each quantity.
    parts: Vec<(Quantity, f64)>,
    /// Number of counted values.
    counted: usize,
    /// Greatest ratio of a free value to that of the case, or the other way round; infinite where one is zero.
    pub moved: f64,
}

impl Mended {
    /// The least ratio of any quantity.
    fn least(&self) -> f64 {
        self.parts.iter().map(|(_, left)| *left).fold(f64::INFINITY, f64::min)
    }

    /// The ratio of this quantity if it is small and the others are no worse.
    pub fn corrected(&self, quantity: Quantity) -> Option<f64> {
        let own = self.parts.iter().find(|(own, _)| *own == quantity).map(|(_, left)| *left);
        own.filter(|left| *left <= FACTOR_LEAVES && self.left < NO_WORSE)
    }
}

/// Mean square of the weighted residuals of each quantity.
fn squares(problem: &Problem, residuals: &[f64]) -> Vec<(Quantity, f64)> {
    let of = |quantity: Quantity| {
        let (mut sum, mut count) = (0.0, 0);
        for (index, run) in problem.runs.iter().enumerate() {
            let (first, n) = (problem.first_row(index), run.time.len());
            for (output, seen) in run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity == quantity) {
                let rows = &residuals[first + output * n..first + (output + 1) * n];
                sum += rows.iter().map(|r| r * r).sum::<f64>();
                count += seen.weights.iter().filter(|weight| **weight > 0.0).count();
            }
        }
        (quantity, sum / f64::max(count as f64, 1.0))
    };
    problem.quantities().into_iter().map(of).collect()
}

/// Agreement with the logs after correction of those with these names, after a limited number of Jacobians, none of
/// which at zero; `None` if no model can simulate them. Where derivatives are differences, only the better of both
/// starts is searched from.
pub(crate) fn mended(
    case: &Case,
    plan: &Plan,
    found: &Searched,
    names: &[&str],
    remedy: &Remedy,
    iterations: usize,
) -> Option<Mended> {
    let is_named = |name: &str| names.contains(&name);
    let mut own = case.clone();
    for experiment in own.experiments.iter_mut().filter(|experiment| is_named(&experiment.name)) {
        let log: &mut Log = Arc::make_mut(experiment.log.as_mut()?);
        remedy.apply(log);
    }
    let mut problem = Problem::new(&own, plan).ok()?.stopped_by(found.problem.stop());
    problem.weigh_by(&found.noise);
    if let Remedy::Scale(quantity, factor) | Remedy::Unit(quantity, factor) = remedy {
        // Residuals in their original unit.
        let runs = problem.runs.iter_mut().filter(|run| is_named(&run.name));
        for seen in runs.flat_map(|run| &mut run.seen).filter(|seen| seen.quantity == *quantity) {
            seen.weights.iter_mut().for_each(|weight| *weight /= factor.abs());
        }
    }
    let before = found.best.cost / found.problem.counted().max(1) as f64;
    let starts = [problem.start(), found.best.x.clone()];
    let end = if found.problem.differences > 0 {
        let simulated =
            starts.into_iter().filter_map(|start| simulated(&mut problem, plan, start)).reduce(End::better)?;
        match iterations {
            0 => simulated,
            _ => descend(&mut problem, plan, &simulated.x, iterations)?,
        }
    } else {
        let ends = starts.iter().filter_map(|start| descend(&mut problem, plan, start, iterations));
        ends.reduce(End::better)?
    };
    let counted = problem.counted();
    let own = squares(&found.problem, &found.best.residuals);
    let part = |(quantity, square): (Quantity, f64)| {
        let (_, own) = own.iter().find(|(other, _)| *other == quantity)?;
        Some((quantity, square / own.max(f64::MIN_POSITIVE)))
    };
    let parts = squares(&problem, &end.residuals).into_iter().filter_map(part).collect();
    let parameters = problem.parameters.iter().enumerate().filter(|(_, parameter)| parameter.start != 0.0);
    let moved = parameters
        .map(|(j, parameter)| (problem.value(j, end.x[j]) / parameter.start).max(0.0))
        .map(|ratio| ratio.max(1.0 / ratio))
        .fold(1.0, f64::max);
    Some(Mended { left: end.cost / counted.max(1) as f64 / before.max(f64::MIN_POSITIVE), parts, counted, moved })
}

/// End of a short search.
struct End {
    x: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
}

impl End {
    /// The one with the lower cost; of equals the first.
    fn better(self, other: Self) -> Self {
        if other.cost < self.cost { other } else { self }
    }
}

/// Threshold of the loss of this plan.
fn huber(plan: &Plan) -> f64 {
    if plan.huber { HUBER } else { f64::INFINITY }
}

/// A point without a search; `None` if the model cannot simulate the logs there.
fn simulated(problem: &mut Problem, plan: &Plan, x: Vec<f64>) -> Option<End> {
    let mut residuals = vec![0.0; problem.rows()];
    let good = x.len() == problem.variables() && problem.evaluate(&x, &mut residuals);
    let cost = cost_of(&residuals, huber(plan));
    (good && cost.is_finite()).then_some(End { x, residuals, cost })
}

/// Result of a short search from `start`.
fn descend(problem: &mut Problem, plan: &Plan, start: &[f64], iterations: usize) -> Option<End> {
    if start.len() != problem.variables() || problem.is_stopped() {
        return None;
    }
    let options = Options {
        iterations,
        tolerance: ROUGH_TOLERANCE,
        huber: huber(plan),
        evolutions: 0,
        rounding: problem.rounding(),
        ..Options::default()
    };
    let bounds = problem.bounds();
    let Minimum { x, residuals, cost, ending, .. } =
        minimise(problem, start, &bounds, &options, &mut |_, _| Flow::Continue);
    let is_good = !matches!(ending, Ending::Failed | Ending::Interrupted) && cost.is_finite();
    is_good.then_some(End { x, residuals, cost })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;

    /// Missing values have no weight and no residual.
    #[test]
    fn mean_squares_are_over_the_rows_with_a_weight() {
        let (case, plan) = case(false);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let n = problem.runs[0].time.len();
        let mut residuals = vec![3.0; problem.rows()];
        for k in (0..n).step_by(3) {
            problem.runs[0].seen[0].weights[k] = 0.0;
            residuals[k] = 0.0;
        }
        for (quantity, mean) in squares(&problem, &residuals) {
            assert!((mean - 9.0).abs() < 1e-12, "{}: {mean}", quantity.name());
        }
    }

    /// A log that moves the wrong way, with mass and friction of the case 30 times too small.
    #[test]
    fn a_fit_to_a_corrected_log_comes_to_its_end() {
        let (mut case, plan) = case(false);
        let free = ["cart.mass", "cart.friction.viscous", "cart.friction.coulomb"].map(String::from).to_vec();
        let plan = Plan { free, ..plan };
        Remedy::Reverse.apply(Arc::make_mut(case.experiments[0].log.as_mut().unwrap()));
        let cart = &mut case.machine.cart;
        cart.mass *= 0.03;
        for side in [&mut cart.friction.forward, &mut cart.friction.backward] {
            [&mut side.viscous, &mut side.coulomb, &mut side.breakaway].into_iter().for_each(|own| *own *= 0.03);
        }
        let found = at_start(Problem::new(&case, &plan).unwrap());
        let names = [found.problem.runs[0].name.as_str()];
        let left = |most: usize| mended(&case, &plan, &found, &names, &Remedy::Reverse, most).unwrap().left;
        let (own, end) = (left(TRIAL_FIT_ITERATIONS), left(100));
        assert!(own < 1.01 * end && end < 1e-4, "{own} {end}");
    }
}

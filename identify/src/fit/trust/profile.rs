//! Profiles: increase of the cost with one parameter held away from its estimate and all others fitted again.
//!
//! For a linear model, the root of the growth of the sum of squares is a straight line on either side, |p − p̂|/error
//! on the scale of the search. A curved profile shows how far the interval is reliable, and on which side it is too
//! short.

use super::found::Fit;
use crate::case::{Case, Plan};
use crate::error::Result;
use crate::fit::asked::problem::{Problem, Stop};
use crate::fit::limits::{
    CROOKED, HUBER, MOST_PROFILED, PROFILE_AT, PROFILE_SIMULATIONS, PROFILE_WORK, REFIT_TOLERANCE,
};
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Options};
use crate::fit::search::triangle::inverse_of_square;
use crate::solve::Flow;

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Profile {
    /// The parameter.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// The held values, ascending, including the estimate.
    pub values: Vec<f64>,
    /// √ of the growth of the sum of squares, in standard errors.
    pub growth: Vec<f64>,
    /// Values for a linear model: distance from the estimate at which it was held, in standard errors.
    pub linear: Vec<f64>,
}

impl Profile {
    /// The growth two standard errors below and above the estimate, relative to that of a linear model; `None` if it
    /// was not held there.
    pub fn bends(&self) -> [Option<f64>; 2] {
        let middle = self.linear.iter().position(|off| *off == 0.0).unwrap_or(0);
        let at = |mut rows: std::ops::Range<usize>| {
            rows.find(|&k| self.linear[k] == 2.0).map(|k| self.growth[k] / self.linear[k])
        };
        [at(0..middle), at(middle..self.linear.len())]
    }

    /// True if an interval that takes the model as linear is far too long or too short on a side.
    pub fn is_crooked(&self) -> bool {
        self.bends().into_iter().flatten().any(|ratio| (ratio - 1.0).abs() > CROOKED)
    }
}

/// Profiles of the estimates of `fit` for the parameters of `plan` and the logs of `case`, as many as `stop` and their
/// cost allow; parameters that are at a bound or not determined have none.
pub fn profiles(case: &Case, plan: &Plan, fit: &Fit, stop: Option<Stop>) -> Result<Vec<Profile>> {
    let mut problem = Problem::new(case, plan)?.stopped_by(stop);
    problem.weigh_by(&fit.noise);
    let most = PROFILE_SIMULATIONS.max(PROFILE_WORK * fit.work.simulations);
    let mut profiles = Vec::new();
    let Some(bottom) = Bottom::new(&mut problem, plan, fit) else { return Ok(profiles) };
    for j in 0..problem.parameters.len().min(MOST_PROFILED) {
        if problem.simulations > most || problem.is_stopped() {
            break;
        }
        profiles.extend(bottom.profile(&mut problem, fit, j));
    }
    Ok(profiles)
}

/// Common start of the profiles.
struct Bottom {
    x: Vec<f64>,
    cost: f64,
    /// Standard error of each variable for residuals of one; `None` at a bound.
    unit: Vec<Option<f64>>,
    options: Options,
}

impl Bottom {
    fn new(problem: &mut Problem, plan: &Plan, fit: &Fit) -> Option<Self> {
        let huber = if plan.huber { HUBER } else { f64::INFINITY };
        let options = Options {
            iterations: 6,
            tolerance: REFIT_TOLERANCE,
            huber,
            rounding: problem.rounding(),
            ..Options::default()
        };
        let bounds = problem.bounds();
        if fit.point.len() != problem.variables() {
            return None;
        }
        let found = minimise(problem, &fit.point, &bounds, &options, &mut |_, _| Flow::Continue);
        if matches!(found.ending, Ending::Failed | Ending::Interrupted) {
            return None;
        }
        let free: Vec<usize> = (0..found.x.len()).filter(|&j| !found.at_bound[j]).collect();
        let inverse = inverse_of_square(&found.jacobian.select_columns(&free))?;
        let mut unit = vec![None; found.x.len()];
        for (place, &j) in free.iter().enumerate() {
            unit[j] = Some(inverse[(place, place)].sqrt());
        }
        Some(Self { x: found.x, cost: found.cost, unit, options })
    }

    fn profile(&self, problem: &mut Problem, fit: &Fit, j: usize) -> Option<Profile> {
        let estimate = fit.estimates.get(j)?;
        let error = estimate.error.filter(|error| error.is_finite() && *error > 0.0)?;
        let unit = self.unit[j]?;
        // On the scale of the search, where the interval is symmetric.
        let off = error / problem.slope(j, estimate.value);
        let mut points = vec![(problem.value(j, self.x[j]), 0.0, 0.0)];
        for side in PROFILE_AT {
            let mut start = self.x.clone();
            for errors in side {
                let mut bounds = problem.bounds();
                let x = self.x[j] + errors * off;
                if x <= bounds.low[j] || x >= bounds.high[j] {
                    break;
                }
                (bounds.low[j], bounds.high[j]) = (x, x);
                start[j] = x;
                let found = minimise(problem, &start, &bounds, &self.options, &mut |_, _| Flow::Continue);
                if matches!(found.ending, Ending::Failed | Ending::Interrupted) || problem.is_stopped() {
                    return None;
                }
                start = found.x;
                // A linear model's cost grows by ½ (Δx/unit)², Δx = errors × off: in errors, independent of the
                // autocorrelation of the residuals.
                let grown = (2.0 * (found.cost - self.cost)).max(0.0).sqrt() * unit / off;
                points.push((problem.value(j, x), grown, errors.abs()));
            }
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Some(Profile {
            name: estimate.name.clone(),
            unit: estimate.unit,
            values: points.iter().map(|point| point.0).collect(),
            growth: points.iter().map(|point| point.1).collect(),
            linear: points.iter().map(|point| point.2).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::result::result;
    use super::*;
    use crate::case::{Experiment, Per};
    use crate::fit::asked::problem::tests::logged;
    use crate::fit::search::starts::tests::at_start;

    /// Fourteen logs, each with a friction of its own: a profile takes some 300 simulations of a log.
    #[test]
    fn profiles_are_as_many_as_their_simulations_allow_and_twelve_at_most() {
        let rows = ["belt={ model = \"rigid\" }", "experiment.0.every=10ms", "experiment.0.until=0.2s"];
        let (mut case, mut plan) = logged(&rows, false);
        let one = case.experiments.remove(0);
        case.experiments = (0..14).map(|k| Experiment { name: format!("log {k}"), ..one.clone() }).collect();
        (plan.separate, plan.per) = (plan.free.clone(), Per::Log);
        let mut fit = result(&at_start(Problem::new(&case, &plan).unwrap()), None);
        fit.estimates.iter_mut().for_each(|own| own.error = Some(0.05 * own.value));
        let mut count = |simulations: u64| {
            fit.work.simulations = simulations;
            profiles(&case, &plan, &fit, None).unwrap().len()
        };
        // 1000 in any case, or four times those of the fit.
        let found = [100, 500, 10_000].map(&mut count);
        assert!((3..6).contains(&found[0]) && (7..11).contains(&found[1]) && found[2] == 12, "{found:?}");
    }
}

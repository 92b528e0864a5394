//! Draws from the posterior distribution of a fit's parameters, given priors and logs.
//!
//! The likelihood is normal, with the deviation of each quantity that the fit found, or Huber's where the fit is
//! robust. Since correlated residuals contain less information than their number suggests, the logarithm of the
//! likelihood is divided by the greatest factor by which they increase the covariance of the fit. With flat priors and
//! a linear model no interval is then narrower than the fit's. `density.rs` defines the sampling.

mod density;
mod marginal;
pub(crate) mod nuts;

use crate::case::{Case, Plan, Prior, file_name};
use crate::error::{Error, Result};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::asked::run::{Extra, FittedLog, Nuisance};
use crate::fit::limits::{DIVERGING, EFFECTIVE, HUBER, NORMAL, R_HAT};
use crate::fit::search::point::Ending;
use crate::fit::search::triangle::inverse_of_square;
use crate::fit::trust::found::{Estimate, Fit};
use crate::fit::trust::uncertainty::Covariance;
use crate::trajectory::{Column, Trajectory};
use density::{Ingredients, Prior as OnVariable, Sampled, draw};
use marginal::Marginal;
use nalgebra::DMatrix;
use nuts::{Draws, Effort, Watch};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Draws with diagnostics.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Posterior {
    /// The variables: parameters, nuisances that all logs share, then those of each log.
    pub variables: Vec<Credible>,
    /// Number of these that are estimates of the fit, in its order.
    pub globals: usize,
    /// The draws, SI.
    pub draws: Draws,
    /// The divisor of the logarithm of the likelihood, for autocorrelated residuals.
    pub inflation: f64,
    /// True if paths used gradients by the Jacobian at the fit; a random walk otherwise.
    pub fixed_slopes: bool,
}

/// The posterior of one number.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Credible {
    /// Its name, preceded by that of its log if it belongs to one.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Mean of the draws.
    pub mean: f64,
    /// Their standard deviation.
    pub deviation: f64,
    /// Their median.
    pub median: f64,
    /// 2.5 % of the draws lie below, and 2.5 % above.
    pub interval: [f64; 2],
    /// Rank-normalised split R̂.
    pub r_hat: f64,
    /// Bulk effective sample size.
    pub effective: f64,
}

/// Draws from the posterior of the parameters of `plan` about `fit`, which was made of the same case and plan.
///
/// `watch` receives the number of draws, and may end the sampling early. Returns an error for an interrupted fit, an
/// undetermined estimate, or priors outside the bounds.
pub fn posterior(case: &Case, plan: &Plan, fit: &Fit, effort: Effort, watch: &Watch) -> Result<Posterior> {
    if matches!(fit.ending, Ending::Interrupted | Ending::Failed) {
        return Err(Error::new("draws start from a fit that has ended, and this one has not").next("fit it again"));
    }
    if !plan.separate.is_empty() {
        return Err(crate::case::draws_are_of_one_machine());
    }
    if fit.estimates.is_empty() {
        return Err(Error::new("there are no free parameters").next("add free = [\"cart.mass\"] to [fit]"));
    }
    refuse_undetermined(fit)?;
    let mut problem = Problem::new(case, plan)?;
    problem.weigh_by(&fit.noise);
    let mut bounds = problem.bounds();
    let at = fit.point.clone();
    let mut residuals = vec![0.0; problem.rows()];
    let failed = || Error::new("the model cannot be run through these logs at the fit");
    if at.len() != problem.variables() || !problem.evaluate(&at, &mut residuals) {
        return Err(failed());
    }
    let jacobian = problem.jacobian(&at, &residuals, &bounds, &Differences::Central).ok_or_else(failed)?;
    let (inflation, variance) = inflation(&problem, &residuals, &jacobian, &at, &bounds);
    let scales = scales(&problem);
    let priors = priors(&scales, plan, &mut bounds)?;
    let huber = if plan.huber { HUBER } else { f64::INFINITY };
    let variance = variance * inflation;
    // Starts and offsets are integrated over, where the loss is a square.
    let known: Vec<bool> = priors.iter().map(|prior| huber.is_finite() || prior.is_some()).collect();
    let deviations = inverse_of_square(&jacobian).map(|inverse| inverse.diagonal().map(|own| (own * variance).sqrt()));
    let deviations = deviations.map_or_else(|| vec![f64::INFINITY; at.len()], |own| own.as_slice().to_vec());
    let marginal = Marginal::new(problem.clone(), (&at, &bounds), variance, &deviations, &|j| known[j]);
    let kept = marginal.kept().to_vec();
    let jacobian =
        marginal.clone().jacobian(&marginal.select(&at), &[], &marginal.bounds_of(&bounds), &Differences::Central);
    let ingredients = Ingredients {
        problem: marginal.clone(),
        at: marginal.select(&at),
        jacobian: jacobian.ok_or_else(failed)?,
        bounds: marginal.bounds_of(&bounds),
        priors: priors.into_iter().enumerate().filter(|(j, _)| kept.contains(j)).map(|(_, prior)| prior).collect(),
        inflation: variance,
        huber,
    };
    let Sampled { mut draws, fixed } = draw(&ingredients, effort, watch)?;
    complete(&mut draws, &marginal, effort, watch);
    for draw in draws.chains.iter_mut().flatten() {
        for (value, scale) in draw.iter_mut().zip(&scales) {
            *value = scale.value(*value);
        }
    }
    let variables = scales
        .iter()
        .enumerate()
        .map(|(j, scale)| Credible {
            name: scale.name.clone(),
            unit: scale.unit,
            mean: draws.mean(j),
            deviation: draws.deviation(j),
            median: draws.quantile(j, 0.5),
            interval: [draws.quantile(j, 0.025), draws.quantile(j, 0.975)],
            r_hat: draws.r_hat(j),
            effective: draws.effective(j),
        })
        .collect();
    Ok(Posterior { variables, globals: problem.globals(), draws, inflation, fixed_slopes: fixed })
}

/// Draws the marginalised shifts for each draw; if that is interrupted, all chains keep the same number.
fn complete(draws: &mut Draws, marginal: &Marginal, effort: Effort, watch: &Watch) {
    let made = effort.chains * (effort.tune + effort.draws);
    // Draws before an interruption are completed, with one simulation each.
    let goes_on = || draws.interrupted || watch(made);
    let one = |number: usize, chain: &[Vec<f64>]| {
        let mut random = Pcg64::seed_from_u64(effort.seed.wrapping_add(number as u64) ^ 0xc0de);
        let mut marginal = marginal.clone();
        let completed = |draw: &Vec<f64>| goes_on().then(|| marginal.completed(draw, &mut random));
        chain.iter().map_while(completed).collect::<Vec<_>>()
    };
    let chains: Vec<Vec<Vec<f64>>> = std::thread::scope(|scope| {
        let one = &one;
        let chains = draws.chains.iter().enumerate();
        let threads: Vec<_> = chains.map(|(number, chain)| scope.spawn(move || one(number, chain))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or_default()).collect()
    });
    let shortest = chains.iter().map(Vec::len).min().unwrap_or(0);
    draws.interrupted |= shortest < draws.chains.first().map_or(0, Vec::len);
    draws.chains = chains;
    draws.chains.iter_mut().for_each(|chain| chain.truncate(shortest));
}

/// Draws of undetermined parameters would wander between their bounds without converging.
fn refuse_undetermined(fit: &Fit) -> Result<()> {
    let undetermined = |estimate: &&Estimate| estimate.error.is_some_and(f64::is_infinite);
    let names: Vec<&str> = fit.estimates.iter().filter(undetermined).map(|estimate| &*estimate.name).collect();
    if names.is_empty() {
        return Ok(());
    }
    let are = if names.len() == 1 { "is" } else { "are" };
    Err(Error::new(format!("no posterior: {} {are} not determined by these logs", names.join(", ")))
        .next("take it out of fit.free, or add a log that determines it; `taut check` proposes some"))
}

impl Posterior {
    /// Reasons why it has not converged; empty if it has.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = Vec::new();
        if self.draws.interrupted {
            doubts.push("it was interrupted".to_string());
        }
        // NaN counts as bad.
        let worst = |of: fn(&Credible) -> f64, bad: fn(f64, f64) -> bool| {
            let number = |c: &Credible| if of(c).is_finite() { of(c) } else { f64::NAN };
            self.variables
                .iter()
                .map(|c| (number(c), &c.name))
                .reduce(|a, b| if a.0.is_nan() || (!b.0.is_nan() && !bad(b.0, a.0)) { a } else { b })
        };
        if let Some((r_hat, name)) = worst(|c| c.r_hat, |new, old| new > old).filter(|(r, _)| r.is_nan() || *r > R_HAT)
        {
            doubts.push(format!("R\u{302} of {name} is {r_hat:.3}, above {R_HAT}"));
        }
        if let Some((count, name)) =
            worst(|c| c.effective, |new, old| new < old).filter(|(n, _)| n.is_nan() || *n < EFFECTIVE)
        {
            doubts.push(format!("{name} has {count:.0} effective draws, fewer than {EFFECTIVE}"));
        }
        let all = self.count() as f64;
        if self.draws.divergences as f64 > DIVERGING * all {
            doubts.push(format!("{} of {all} transitions were divergent", self.draws.divergences));
        }
        doubts
    }

    /// Draws of all chains together.
    pub fn count(&self) -> usize {
        self.draws.chains.iter().map(Vec::len).sum()
    }

    /// The draws as columns: chain, draw, and each variable with its unit.
    pub fn table(&self) -> Trajectory {
        let mut columns = vec![Column::new("chain", ""), Column::new("draw", "")];
        columns.extend(self.variables.iter().map(|variable| Column::new(variable.name.clone(), variable.unit)));
        for (chain, draws) in self.draws.chains.iter().enumerate() {
            for (k, draw) in draws.iter().enumerate() {
                let row = [chain as f64, k as f64].into_iter().chain(draw.iter().copied());
                columns.iter_mut().zip(row).for_each(|(column, value)| column.values.push(value));
            }
        }
        Trajectory { columns }
    }
}

/// Largest factor by which autocorrelated residuals widen the covariance of the fit, and the variance of weighted
/// residuals.
fn inflation(problem: &Problem, residuals: &[f64], jacobian: &DMatrix<f64>, at: &[f64], bounds: &Bounds) -> (f64, f64) {
    let held: Vec<bool> = (0..at.len()).map(|j| at[j] <= bounds.low[j] || at[j] >= bounds.high[j]).collect();
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let white = squares / (problem.independent() - at.len() as f64).max(1.0);
    let Some(found) = Covariance::new(problem, residuals, jacobian, &held) else { return (1.0, white) };
    let variance = found.deviation * found.deviation;
    let Some(inverse) = inverse_of_square(&jacobian.select_columns(&found.free)) else { return (1.0, variance) };
    let own =
        |(k, &j): (usize, &usize)| (j < problem.globals()).then(|| found.matrix[(k, k)] / (inverse[(k, k)] * variance));
    let most = found.free.iter().enumerate().filter_map(own).fold(1.0, f64::max);
    (most * (found.reach / NORMAL).powi(2).max(1.0), variance)
}

/// Conversion of a variable of the search to a number.
struct Scale<'a> {
    name: String,
    unit: &'static str,
    /// Possible names for a prior, all keys of a tie, with their value per unit of this variable.
    known_as: Vec<(String, f64)>,
    value: Box<dyn Fn(f64) -> f64 + Sync + 'a>,
    variable: Box<dyn Fn(f64) -> f64 + Sync + 'a>,
    /// dp/dx at this value.
    slope: Box<dyn Fn(f64) -> f64 + Sync + 'a>,
    /// d ln(dp/dx)/dx
    bend: f64,
}

impl Scale<'_> {
    fn value(&self, x: f64) -> f64 {
        (self.value)(x)
    }

    fn of_extra((name, known_as): (String, String), unit: &'static str, extra: Extra) -> Self {
        Scale {
            name,
            unit,
            known_as: vec![(known_as, 1.0)],
            value: Box::new(move |x| extra.start + extra.unit * x),
            variable: Box::new(move |value| (value - extra.start) / extra.unit),
            slope: Box::new(move |_| extra.unit),
            bend: 0.0,
        }
    }
}

fn scales<'a>(problem: &'a Problem<'a>) -> Vec<Scale<'a>> {
    let machine = &problem.machine;
    let mut scales = Vec::new();
    for (j, parameter) in problem.parameters.iter().enumerate() {
        scales.push(Scale {
            name: parameter.name.clone(),
            unit: parameter.unit,
            known_as: parameter.keys.iter().cloned().chain([(parameter.name.clone(), 1.0)]).collect(),
            value: Box::new(move |x| problem.value(j, x)),
            variable: Box::new(move |value| problem.variable(j, value)),
            slope: Box::new(move |value| problem.slope(j, value)),
            bend: if problem.is_log(j) { 1.0 } else { 0.0 },
        });
    }
    for extra in &problem.shared {
        let name = extra.what.name(machine);
        scales.push(Scale::of_extra((name.clone(), name), extra.what.unit(machine), *extra));
    }
    let of_log = |run: &FittedLog| match run.window {
        0 => file_name(&run.name),
        window => format!("{}-{}", file_name(&run.name), window + 1),
    };
    for (index, run) in problem.runs.iter().enumerate() {
        for (_, extra) in problem.own_variables(index) {
            let (name, unit) = match extra.what {
                Nuisance::Bias(output) => {
                    let quantity = run.seen[output].quantity;
                    (format!("bias_{}", quantity.name()), quantity.unit())
                }
                what => (what.name(machine), what.unit(machine)),
            };
            let known_as = extra.what.name(machine);
            scales.push(Scale::of_extra((format!("{}.{name}", of_log(run)), known_as), unit, extra));
        }
    }
    scales
}

/// The priors on the variables of the search; a uniform one narrows the bounds.
fn priors<'a>(scales: &'a [Scale<'a>], plan: &Plan, bounds: &mut Bounds) -> Result<Vec<Option<OnVariable<'a>>>> {
    let mut all: Vec<Option<OnVariable>> = Vec::new();
    for (j, scale) in scales.iter().enumerate() {
        let meant = |(name, prior): &'_ (String, Prior)| {
            scale.known_as.iter().find(|(own, _)| own == name).map(|(own, factor)| (own.clone(), *factor, *prior))
        };
        let Some((name, factor, prior)) = plan.priors.iter().find_map(meant) else {
            all.push(None);
            continue;
        };
        let (low, high) = match prior {
            Prior::Normal { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Prior::LogNormal { .. } => ((scale.variable)(0.0), f64::INFINITY),
            Prior::Uniform { low, high } => ((scale.variable)(low / factor), (scale.variable)(high / factor)),
        };
        // Zero and negative bounds do not exist on a logarithmic scale.
        bounds.low[j] = bounds.low[j].max(if low.is_nan() { f64::NEG_INFINITY } else { low });
        bounds.high[j] = bounds.high[j].min(high);
        if bounds.low[j] >= bounds.high[j] {
            return Err(Error::new(format!("the prior of {name} leaves nothing of its bounds"))
                .next("widen the prior, or [fit.bounds]"));
        }
        all.push(Some(Box::new(move |x| {
            let p = scale.value(x);
            let slope = (scale.slope)(p);
            // ln π(p) and its derivative; then ln dp/dx
            let (log, derivative) = prior.log(factor * p);
            (log + slope.abs().ln(), derivative * factor * slope + scale.bend)
        })));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The doubts about 2000 draws of variables with these R̂ and effective draws.
    fn doubts_of(all: &[(&str, f64, f64)], divergences: u64) -> Vec<String> {
        let credible = |(name, r_hat, effective): (&str, f64, f64)| Credible {
            name: name.into(),
            unit: "",
            mean: 0.0,
            deviation: 1.0,
            median: 0.0,
            interval: [-2.0, 2.0],
            r_hat,
            effective,
        };
        let chains = vec![vec![vec![0.0; all.len()]; 500]; 4];
        let draws = Draws { chains, divergences, evaluations: 0, interrupted: false };
        let variables = all.iter().copied().map(credible).collect();
        Posterior { variables, globals: all.len(), draws, inflation: 1.0, fixed_slopes: false }.doubts()
    }

    /// Draws that are not told apart from converged ones, but for one variable.
    #[test]
    fn the_worst_variable_is_named() {
        let doubts = |all: &[(&str, f64, f64)]| doubts_of(all, 0);
        assert_eq!(doubts(&[("a", 1.0, 2000.0), ("b", 1.001, 1500.0)]), Vec::<String>::new());
        let bad = [("a", 1.0, 2000.0), ("b", 1.5, 900.0), ("c", 1.2, 3.0), ("d", 1.0, 1000.0)];
        for shift in 0..bad.len() {
            let mut all = bad;
            all.rotate_left(shift);
            let found = doubts(&all);
            assert!(found.len() == 2 && found[0].contains("of b is 1.500"), "{found:?}");
            assert!(found[1].starts_with("c has 3 effective draws"), "{found:?}");
        }
        // A number that cannot be computed is worse than any.
        assert!(doubts(&[("a", 1.5, 2000.0), ("b", f64::NAN, 1500.0)])[0].contains("of b is NaN"));
    }

    /// Chains that differ by half a per cent, or one divergent transition in 200, are as good as any.
    #[test]
    fn a_posterior_is_doubted_from_one_per_cent_on() {
        let doubts = |r_hat: f64, divergences: u64| doubts_of(&[("a", r_hat, 2000.0)], divergences);
        assert_eq!(doubts(1.005, 10), Vec::<String>::new());
        assert_eq!(doubts(1.02, 10), ["R\u{302} of a is 1.020, above 1.01"]);
        assert_eq!(doubts(1.005, 40), ["40 of 2000 transitions were divergent"]);
    }
}

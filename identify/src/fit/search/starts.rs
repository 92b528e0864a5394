//! The search: starts, and weights from the residuals.

use super::least_squares::minimise;
use super::point::{Ending, Minimum, Options};
use super::regression::regression;
use super::rung::Watch;
use super::triangle::inverse_of_square;
use crate::case::{Case, Nuisances, Plan, Scope};
use crate::chance;
use crate::error::{Error, Result};
use crate::fit::asked::problem::{Problem, Stop, extent};
use crate::fit::asked::residuals::Residuals;
use crate::fit::asked::run::{FittedLog, MeasuredOutput};
use crate::fit::limits::{
    FAR_BEYOND_NOISE, FILE_ROUNDING, FIRST_BEGINNING, HUBER, LEAST_ROWS, MORE_THAN_NOISE, MOST_START_WINDOWS,
    ROUGH_TOLERANCE, SAME_MINIMUM, SHORTEST_BEGINNING, START_WINDOWS, STEPS, STEPS_IN_PART, SWINGS_KEEP,
    TRIAL_ITERATIONS, WEIGHT_ROUNDS,
};
use crate::log::Quantity;
use crate::number::engineering;
use crate::reach::resonance::{Drive, resonances};
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::ops::Range;
use std::sync::Arc;

/// The effort of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Work {
    /// Jacobians.
    pub iterations: usize,
    /// Trial points.
    pub evaluations: usize,
    /// Simulated logs.
    pub simulations: u64,
}

impl Work {
    /// Adds further effort.
    pub(crate) fn add(&mut self, other: &Work) {
        self.iterations += other.iterations;
        self.evaluations += other.evaluations;
        self.simulations += other.simulations;
    }
}

/// Result of a search.
pub(crate) struct Searched<'a> {
    pub problem: Problem<'a>,
    pub best: Minimum,
    /// Deviation of each quantity's residuals.
    pub noise: Vec<(Quantity, f64)>,
    pub starts: Vec<f64>,
    pub work: Work,
}

impl Searched<'_> {
    /// Deviations of the residuals relative to the noise of the logs.
    pub fn times_noise(&self) -> impl Iterator<Item = (Quantity, f64)> {
        let noise = self.problem.noise();
        self.noise.iter().map(move |(quantity, deviation)| (*quantity, deviation / noise.deviation(*quantity)))
    }

    /// The delay of inputs, in intervals between samples: the mean of all, zero without any.
    pub fn delay(&self) -> f64 {
        self.problem.delay(&self.best.x)
    }
}

/// Effort of a search.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub options: Options,
    /// True if friction curves are simulated as piecewise linear.
    pub is_straight: bool,
    /// True if it begins near its end: machines without a balance of torques need no search for a start, and a search
    /// by differences whose iterations are used up does not begin again with new weights.
    pub is_short: bool,
    /// The delay of inputs at the start, in intervals between samples; `None`: found by fits that hold it.
    pub delay: Option<f64>,
}

impl Effort {
    /// Effort of a fit for comparison: a further step would change it far less than models differ on held-out records.
    pub fn compared(delay: Option<f64>) -> Self {
        let options = Options { tolerance: ROUGH_TOLERANCE, iterations: STEPS, evolutions: 0, ..Options::default() };
        Self { options, is_straight: true, is_short: false, delay }
    }

    /// Effort of such a fit to a part of the logs, which begins at the result for all of them, and at its delay.
    pub fn of_part(delay: Option<f64>) -> Self {
        let whole = Self::compared(delay);
        Self { options: Options { iterations: STEPS_IN_PART, ..whole.options }, is_short: true, ..whole }
    }
}

/// The search of a fit with this `effort`, to any point along undetermined directions.
pub(crate) fn search_as_far<'a>(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop<'a>>,
    effort: &Effort,
    watch: &mut Watch,
) -> Result<Searched<'a>> {
    let whole = effort.options;
    let mut problem = Problem::new(case, plan)?.stopped_by(stop).straight(effort.is_straight);
    let mut search = Search { watch, work: Work::default() };
    let start = problem.delayed(problem.start(), effort.delay.unwrap_or(0.0));
    let (start, other) = match effort.is_short && !problem.machine.has_torque_balance() {
        // It begins at the result for all logs.
        true => (start, None),
        false => first_guess(case, plan, &mut problem, (start, effort.delay), &mut search)?,
    };
    let stopped = if problem.is_stopped() { stopped_at(&mut problem, &start) } else { None };
    let mut best = stopped.unwrap_or_else(|| search.descend(&mut problem, &start, &whole));
    if let Some(other) = other.filter(|_| times_noise(&problem, &best) > FAR_BEYOND_NOISE) {
        let trial = search.descend(&mut problem, &other, &whole);
        if trial.ending != Ending::Failed && trial.cost < best.cost {
            best = trial;
        }
    }
    if best.ending == Ending::Failed {
        let outrun = |run: &FittedLog| Some((run.name.clone(), run.outrun(&problem.machine)?));
        if let Some((name, [speed, most])) = problem.runs.iter().find_map(outrun) {
            let [speed, most] = [speed, most].map(|speed| engineering(speed, "m/s", 3));
            return Err(Error::new(format!(
                "the command of the log \"{name}\" reaches {speed}, and this stepper has no torque at most of its speeds"
            ))
            .allowed(format!("up to {most}"))
            .next("check the unit and the scale of its input in `log`"));
        }
        return Err(Error::new("the model cannot be run through these logs with the values of the case file")
            .next("run `taut simulate` on the case to see why, or start from other values"));
    }
    let mut starts = vec![best.cost];
    let mut random = Pcg64::seed_from_u64(plan.seed);
    for _ in 1..plan.starts {
        if problem.is_stopped() || best.ending == Ending::Interrupted {
            break;
        }
        let x = elsewhere(&problem, &mut random);
        let trial = search.descend(
            &mut problem,
            &x,
            &Options { iterations: TRIAL_ITERATIONS, tolerance: whole.tolerance.max(ROUGH_TOLERANCE), ..whole },
        );
        let near = trial.cost < 1.2 * best.cost;
        let trial =
            if near && trial.ending != Ending::Failed { search.descend(&mut problem, &trial.x, &whole) } else { trial };
        starts.push(trial.cost);
        if trial.cost < best.cost {
            best = trial;
        }
    }

    // Weights from the residuals, iterated until they are constant.
    let mut noise: Vec<(Quantity, f64)> = Vec::new();
    for round in 0..WEIGHT_ROUNDS {
        if problem.is_stopped() || best.ending == Ending::Interrupted {
            break;
        }
        let fresh = noise_of(&problem, &best, plan.huber);
        let settled = noise.len() == fresh.len()
            && noise.iter().zip(&fresh).all(|((_, old), (_, new))| (new / old - 1.0).abs() < 0.05);
        if settled {
            break;
        }
        let before = first_weight(&problem);
        problem.swings |= swings(&problem, &best);
        problem.weigh_by(&fresh);
        let alike = fresh.len() == 1 && !plan.huber && !told_beforehand(&problem, &fresh) && uniform(&problem);
        noise = fresh;
        let options = Options { huber: if plan.huber { HUBER } else { f64::INFINITY }, ..whole };
        let has_ended = match best.ending {
            Ending::Converged | Ending::Stalled => true,
            Ending::OutOfIterations => effort.is_short && problem.differences > 0,
            Ending::Interrupted | Ending::Failed => false,
        };
        if alike && round == 0 && has_ended {
            // One weight for all: only the unit of the residuals changes.
            if let (Some(now), Some(before)) = (first_weight(&problem), before) {
                rescale(&mut best, now / before);
                break;
            }
        }
        best = search.descend(&mut problem, &best.x.clone(), &options);
    }
    if problem.is_stopped() {
        best.ending = Ending::Interrupted;
    }
    if noise.is_empty() {
        noise = noise_of(&problem, &best, plan.huber);
    }
    let work = Work { simulations: problem.simulations, ..search.work };
    Ok(Searched { problem, best, noise, starts, work })
}

/// The result of a search that was stopped while it looked for a start: the best one so far.
fn stopped_at(problem: &mut Problem, start: &[f64]) -> Option<Minimum> {
    let (mut whole, bounds) = (problem.clone().stopped_by(None), problem.bounds());
    let found = Minimum::linearised(&mut whole, start, &bounds);
    problem.simulations = whole.simulations;
    found.map(|found| Minimum { ending: Ending::Interrupted, ..found })
}

/// The result without a search.
fn as_it_is(problem: &mut Problem) -> Minimum {
    let mut residuals = vec![0.0; problem.rows()];
    let good = problem.evaluate(&[], &mut residuals);
    Minimum {
        x: Vec::new(),
        cost: 0.5 * residuals.iter().map(|r| r * r).sum::<f64>(),
        jacobian: DMatrix::zeros(residuals.len(), 0),
        residuals,
        decrement: 0.0,
        at_bound: Vec::new(),
        ending: if good { Ending::Converged } else { Ending::Failed },
        strategy: None,
        pieces: 1,
        evolved: 0,
        iterations: 0,
        evaluations: 1,
    }
}

/// The first weight of a counted output.
fn first_weight(problem: &Problem) -> Option<f64> {
    problem.runs.iter().flat_map(|run| &run.seen).flat_map(|seen| &seen.weights).copied().find(|w| *w > 0.0)
}

fn rescale(minimum: &mut Minimum, factor: f64) {
    minimum.residuals.iter_mut().for_each(|r| *r *= factor);
    minimum.jacobian *= factor;
    minimum.cost *= factor * factor;
}

/// True if all counted values have the same weight.
fn uniform(problem: &Problem) -> bool {
    let mut weights =
        problem.runs.iter().flat_map(|run| &run.seen).flat_map(|seen| &seen.weights).filter(|w| **w > 0.0);
    let Some(first) = weights.next() else { return true };
    weights.all(|w| (w / first - 1.0).abs() < 1e-3)
}

/// True if the residuals of positions oscillate throughout: they change sign often and never keep it for long, unlike
/// those of a wrong model. They are taken as a fit without priors would leave them, r − J (JᵀJ)⁻¹ Jᵀ r: a first value
/// that is far off, and believed, pulls all others aside.
fn swings(problem: &Problem, at: &Minimum) -> bool {
    let outputs = problem.runs.iter().enumerate().flat_map(|(index, run)| {
        let (first, n) = (problem.first_row(index), run.time.len());
        let own = run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity.is_position());
        own.map(move |(output, _)| first + output * n..first + (output + 1) * n)
    });
    let outputs: Vec<Range<usize>> = outputs.collect();
    let rows: Vec<usize> = outputs.iter().cloned().flatten().collect();
    let free: Vec<usize> = (0..at.jacobian.ncols()).filter(|&j| !at.at_bound[j]).collect();
    let jacobian = at.jacobian.select_rows(&rows).select_columns(&free);
    let residuals = DVector::from_iterator(rows.len(), rows.iter().map(|&row| at.residuals[row]));
    let left = match inverse_of_square(&jacobian) {
        Some(inverse) => &residuals - &jacobian * (inverse * jacobian.tr_mul(&residuals)),
        None => residuals,
    };
    let is_swinging = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        let (mut longest, mut since) = (0, 0);
        for k in 1..values.len() {
            if (values[k] > mean) != (values[k - 1] > mean) {
                since = k;
            }
            longest = longest.max(k - since);
        }
        !values.is_empty() && (longest as f64) < SWINGS_KEEP * values.len() as f64
    };
    let mut rest = left.as_slice();
    !outputs.is_empty()
        && outputs.iter().all(|range| {
            let (own, behind) = rest.split_at(range.len());
            rest = behind;
            is_swinging(own)
        })
}

/// True if the prior of the start may have errors like the residuals, so that it depends on their weight.
fn told_beforehand(problem: &Problem, noise: &[(Quantity, f64)]) -> bool {
    let most = noise.iter().map(|(_, deviation)| *deviation).fold(0.0, f64::max);
    let arm = problem.machine.pulley_radius.min(1.0);
    problem.runs.iter().flat_map(|run| &run.extras).any(|extra| extra.known.is_some_and(|own| own > 0.1 * arm * most))
}

/// Searches from points, watched at each step.
struct Search<'w> {
    watch: &'w mut dyn FnMut(&[f64], f64) -> Flow,
    work: Work,
}

impl Search<'_> {
    fn descend(&mut self, problem: &mut Problem, x: &[f64], options: &Options) -> Minimum {
        if x.is_empty() {
            return as_it_is(problem);
        }
        let options = Options { rounding: problem.rounding(), ..*options };
        let bounds = problem.bounds();
        let minimum = minimise(problem, x, &bounds, &options, self.watch);
        self.work.iterations += minimum.iterations;
        self.work.evaluations += minimum.evaluations;
        minimum
    }

    /// Searches another problem than the one that was asked, which is at `at`; its steps are shown as points of that.
    fn descend_in(
        &mut self,
        other: &mut Problem,
        x: &[f64],
        options: &Options,
        asked: &Problem,
        at: &[f64],
    ) -> Minimum {
        let (globals, mut at) = (asked.globals_in(other), at.to_vec());
        let mut shown = |x: &[f64], cost: f64| {
            globals.iter().for_each(|&(own, theirs)| at[own] = x[theirs]);
            (self.watch)(&at, cost)
        };
        let mut search = Search { watch: &mut shown, work: self.work };
        let found = search.descend(other, x, options);
        self.work = search.work;
        found
    }
}

/// Start values of the case or of a regression, with delays after fits that hold them; for a stepper, of fits to the
/// beginnings of its logs; for several coordinates, of fits in short windows: whichever fits the logs better. Beside
/// those with delays, unless a delay is known, the start without them.
fn first_guess(
    case: &Case,
    plan: &Plan,
    problem: &mut Problem,
    (start, delay): (Vec<f64>, Option<f64>),
    search: &mut Search,
) -> Result<(Vec<f64>, Option<Vec<f64>>)> {
    let guess = match &problem.machine {
        machine if machine.has_torque_balance() => by_regression(problem, &start),
        machine if machine.stepper().is_some() => Some(by_beginnings(case, plan, problem, &start, search)?),
        _ => in_windows(case, plan, problem, &start, search)?,
    };
    let guess = match guess {
        Some(guess) if problem.is_stopped() => guess,
        Some(guess) => better(problem, start, guess),
        None => start,
    };
    match problem.machine.has_torque_balance() && plan.nuisance.delay != Scope::Off && delay.is_none() {
        true => Ok((with_delays(case, plan, problem, guess.clone(), search)?, Some(guess))),
        false => Ok((guess, None)),
    }
}

/// The guess, if it fits the logs better than the start, otherwise that.
fn better(problem: &mut Problem, start: Vec<f64>, guess: Vec<f64>) -> Vec<f64> {
    let mut residuals = vec![0.0; problem.rows()];
    let mut cost = |x: &[f64]| {
        if problem.evaluate(x, &mut residuals) { residuals.iter().map(|r| r * r).sum() } else { f64::INFINITY }
    };
    if cost(&guess) < cost(&start) { guess } else { start }
}

/// Start with delays: parameters are fitted with all inputs late, or early, by half an interval between samples, then
/// by one and a half and so on, as long as that fits the logs better.
///
/// Inputs are held between samples, so that the current of a motor without inductance jumps, and with it the cost
/// wherever a delay passes a whole interval. A search of all together that began with wrong parameters ended there.
fn with_delays(
    case: &Case,
    plan: &Plan,
    problem: &mut Problem,
    start: Vec<f64>,
    search: &mut Search,
) -> Result<Vec<f64>> {
    let undelayed = Plan { nuisance: Nuisances { delay: Scope::Off, ..plan.nuisance }, ..plan.clone() };
    let undelayed = Problem::new(case, &undelayed)?.stopped_by(problem.stop()).straight(problem.is_straight);
    let interval = problem.runs[0].interval();
    let mut fitted = |intervals: f64, problem: &mut Problem, from: &[f64]| {
        let (mut other, mut x) = (undelayed.clone(), from.to_vec());
        other.runs.iter_mut().for_each(|run| run.delay_inputs(intervals * interval));
        improve(other, problem, &mut x, search).map(|cost| (cost, intervals, x))
    };
    let both = [0.5, -0.5].map(|intervals| fitted(intervals, problem, &start));
    let first = both.into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
    let Some(mut best) = first else { return Ok(start) };
    let further = best.1.signum();
    while !problem.is_stopped() {
        match fitted(best.1 + further, problem, &best.2) {
            Some(next) if next.0 < best.0 => best = next,
            _ => break,
        }
    }
    let (_, intervals, x) = best;
    Ok(problem.delayed(x, intervals))
}

/// Start from fits to successively longer beginnings of the logs.
///
/// A rotor oscillates on its field, with the cart on its belt, at a frequency that depends on holding torque and mass:
/// a wrong one is soon out of phase with the log, with a local minimum for each cycle. Within the first cycle there is
/// a single minimum.
fn by_beginnings(
    case: &Case,
    plan: &Plan,
    problem: &mut Problem,
    start: &[f64],
    search: &mut Search,
) -> Result<Vec<f64>> {
    let (plan, mut guess) = (Plan { until: None, ..plan.clone() }, start.to_vec());
    let end = problem.runs.iter().map(FittedLog::length).fold(0.0, f64::max);
    let modes = resonances(&problem.machine, Drive::Held, 0).unwrap_or_default();
    let slowest = modes.iter().map(|mode| mode.frequency).fold(f64::INFINITY, f64::min);
    let first = (FIRST_BEGINNING / slowest).max(end * SHORTEST_BEGINNING);
    for length in std::iter::successors(Some(first), |length| Some(2.0 * length)).take_while(|length| *length < end) {
        let other = Problem::new(&beginning(case, length), &plan)?.stopped_by(problem.stop());
        improve(other, problem, &mut guess, search);
        if problem.is_stopped() {
            break;
        }
    }
    Ok(guess)
}

/// A few steps of a rough search.
fn rough() -> Options {
    Options { iterations: TRIAL_ITERATIONS, tolerance: ROUGH_TOLERANCE, evolutions: 0, ..Options::default() }
}

/// Updates the shared variables of `guess` by a rough search of another problem, which begins at it, and returns the
/// cost; none, without changes, if that fails.
fn improve(mut other: Problem, problem: &mut Problem, guess: &mut [f64], search: &mut Search) -> Option<f64> {
    let mut first = other.start();
    other.take_globals(&mut first, problem, guess);
    let found = search.descend_in(&mut other, &first, &rough(), problem, guess);
    problem.simulations += other.simulations;
    if found.ending == Ending::Failed {
        return None;
    }
    problem.take_globals(guess, &other, &found.x);
    Some(found.cost)
}

/// A case with the first part of its logs, s.
fn beginning(case: &Case, length: f64) -> Case {
    let mut short = case.clone();
    for experiment in &mut short.experiments {
        let Some(log) = &mut experiment.log else { continue };
        let rows = log.time.partition_point(|time| *time <= length).clamp(LEAST_ROWS.min(log.len()), log.len());
        let log = Arc::make_mut(log);
        log.time.truncate(rows);
        let values = log.inputs.iter_mut().chain(&mut log.added).chain(&mut log.reference);
        values.chain(log.outputs.iter_mut().map(|output| &mut output.values)).for_each(|values| values.truncate(rows));
        experiment.until = log.time.last().copied().unwrap_or(experiment.until);
    }
    short
}

/// The start with the totals that a regression finds.
fn by_regression(problem: &Problem, start: &[f64]) -> Option<Vec<f64>> {
    let balance = regression(problem)?;
    let bounds = problem.bounds();
    let mut guess = start.to_vec();
    for (j, value) in balance.guess(problem).into_iter().enumerate() {
        let x = problem.variable(j, value);
        guess[j] = if x.is_finite() { x.clamp(bounds.low[j], bounds.high[j]) } else { start[j] };
    }
    Some(guess)
}

/// The best result of a few steps from the start, and from fits in windows of a few oscillations of the belt, each
/// window with a start of its own; windows become longer until two of them lead to one minimum whose residuals are
/// noise. `None` if the plan has windows or a loop, or no step succeeds.
///
/// With a wrong stiffness the belt oscillates out of phase with the log, which causes local minima that are closer
/// together the longer the log is. In a window of a few oscillations there is one.
fn in_windows(
    case: &Case,
    plan: &Plan,
    problem: &mut Problem,
    start: &[f64],
    search: &mut Search,
) -> Result<Option<Vec<f64>>> {
    let globals = problem.globals();
    if plan.windows.is_some() || plan.closed_loop || globals == 0 {
        return Ok(None);
    }
    let (mut guess, mut best) = (start.to_vec(), None);
    for length in std::iter::once(None).chain(START_WINDOWS.map(Some)) {
        if let Some(length) = length {
            let other = Problem::new(case, &windowed(plan, problem, length))?.stopped_by(problem.stop());
            if improve(other, problem, &mut guess, search).is_none() {
                break;
            }
        }
        let found = search.descend(problem, &guess, &rough());
        // Two starts that lead to one minimum indicate that no other is near.
        let agrees = best.as_ref().is_some_and(|best: &Minimum| (found.cost / best.cost - 1.0).abs() < SAME_MINIMUM);
        let is_better = best.as_ref().is_none_or(|best: &Minimum| found.cost < best.cost);
        if found.ending != Ending::Failed && is_better {
            best = Some(found);
        }
        if problem.is_stopped() || agrees && best.as_ref().is_some_and(|best| is_noise(problem, best)) {
            break;
        }
    }
    Ok(best.map(|best| best.x).or_else(|| problem.is_stopped().then_some(guess)))
}

/// A fit in short windows, each with a start of its own.
pub(crate) struct InWindows<'a> {
    /// The plan with its windows.
    pub plan: Plan,
    pub problem: Problem<'a>,
    pub x: Vec<f64>,
    /// Deviation of each quantity's residuals.
    pub noise: Vec<(Quantity, f64)>,
}

/// The end of a rough search from `start` in the shorter ones of these windows, in which a wrong model stays in step
/// with the logs. `None` if it fails.
pub(crate) fn end_in_windows<'a>(
    case: &Case,
    plan: &Plan,
    problem: &Problem<'a>,
    start: &[f64],
) -> Option<InWindows<'a>> {
    let [short, plan, _] = START_WINDOWS.map(|samples| windowed(plan, problem, samples));
    let (mut guess, globals) = (start.to_vec(), problem.globals());
    let other = Problem::new(case, &short).ok()?.stopped_by(problem.stop());
    let mut search = Search { watch: &mut |_, _| Flow::Continue, work: Work::default() };
    improve(other, &mut problem.clone(), &mut guess, &mut search)?;
    let mut problem = Problem::new(case, &plan).ok()?.stopped_by(problem.stop());
    let mut start = problem.start();
    start[..globals].copy_from_slice(&guess[..globals]);
    let found = search.descend(&mut problem, &start, &rough());
    let noise = noise_of(&problem, &found, false);
    (found.ending != Ending::Failed).then_some(InWindows { plan, problem, x: found.x, noise })
}

/// The plan in windows of so many samples, but no more windows than [`MOST_START_WINDOWS`].
fn windowed(plan: &Plan, problem: &Problem, samples: f64) -> Plan {
    let total: f64 = problem.runs.iter().map(FittedLog::length).sum();
    let rows: usize = problem.runs.iter().map(|run| run.time.len()).sum();
    let length = (samples * total / rows as f64).max(total / MOST_START_WINDOWS);
    Plan { windows: Some(length), ..plan.clone() }
}

/// True if residuals are within the noise of the logs, estimated by third differences, which motion only increases.
pub(crate) fn is_noise(problem: &Problem, at: &Minimum) -> bool {
    times_noise(problem, at) <= MORE_THAN_NOISE
}

/// The residuals of the worst output of any log, as a multiple of that noise.
pub(crate) fn times_noise(problem: &Problem, at: &Minimum) -> f64 {
    let noise = problem.noise();
    let of_run = |(index, run): (usize, &FittedLog)| {
        let (first, n) = (problem.first_row(index), run.time.len());
        let of_output = |(output, seen): (usize, &MeasuredOutput)| {
            let of = |k: usize| at.residuals[first + output * n + k] / seen.weights[k];
            let own: Vec<f64> = (0..n).filter(|&k| seen.weights[k] > 0.0).map(of).collect();
            let mean = own.iter().map(|r| r * r).sum::<f64>() / own.len().max(1) as f64;
            mean.sqrt() / noise.deviation(seen.quantity)
        };
        run.seen.iter().enumerate().map(of_output).fold(0.0, f64::max)
    };
    problem.runs.iter().enumerate().map(of_run).fold(0.0, f64::max)
}

/// A random point within the bounds and near the start: within a factor of ten, or between zero and three times its
/// start for variables that may be zero.
fn elsewhere(problem: &Problem, random: &mut Pcg64) -> Vec<f64> {
    let mut x = problem.start();
    let bounds = problem.bounds();
    for (j, x) in x.iter_mut().enumerate().take(problem.globals()) {
        let share = chance::uniform(random);
        let (low, high) = if j >= problem.parameters.len() {
            (bounds.low[j], bounds.high[j].min(10.0))
        } else if problem.is_log(j) {
            (*x - std::f64::consts::LN_10, *x + std::f64::consts::LN_10)
        } else {
            (*x - 3.0, *x + 3.0)
        };
        let (low, high) = (low.max(bounds.low[j]), high.min(bounds.high[j]));
        *x = low + share * (high - low);
    }
    x
}

/// The deviation of each quantity's residuals: root of their mean square, or for a robust fit from their median.
fn noise_of(problem: &Problem, at: &Minimum, robust: bool) -> Vec<(Quantity, f64)> {
    let quantities = problem.quantities();
    let counted = problem.counted() as f64;
    let freedom = (counted - problem.variables() as f64).max(1.0);
    let mut noise = Vec::new();
    for quantity in quantities {
        let (mut sizes, mut squares, mut weight) = (Vec::new(), 0.0, 0.0);
        let (mut step, mut wide): (f64, f64) = (0.0, 0.0);
        for (index, run) in problem.runs.iter().enumerate() {
            let first = problem.first_row(index);
            let n = run.time.len();
            for (output, seen) in run.seen.iter().enumerate().filter(|(_, seen)| seen.quantity == quantity) {
                step = step.max(seen.step);
                wide = wide.max(extent(&seen.values));
                for k in 0..n {
                    let w = seen.weights[k];
                    if w > 0.0 {
                        let r = at.residuals[first + output * n + k] / w;
                        // Successive equal values count as one, unless the signal dithers.
                        let equal = seen.step > 0.0 && seen.alike[k] <= 1.0;
                        let share = if equal { 1.0 / seen.repeats[k].max(1.0) } else { 1.0 };
                        squares += share * r * r;
                        weight += share;
                        if robust {
                            sizes.push(r.abs());
                        }
                    }
                }
            }
        }
        let mut deviation = (squares / f64::max(weight, 1.0) * counted / freedom).sqrt();
        if robust && !sizes.is_empty() {
            let middle = sizes.len() / 2;
            deviation = 1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1;
        }
        noise.push((
            quantity,
            deviation.max(step / 12f64.sqrt()).max(FILE_ROUNDING * wide).max(f64::MIN_POSITIVE * 1e10),
        ));
    }
    noise
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::case;

    /// A search that ended at the values of the case.
    pub(crate) fn at_start(mut problem: Problem) -> Searched {
        let (start, bounds, noise) = (problem.start(), problem.bounds(), problem.noise().0);
        let best = Minimum::linearised(&mut problem, &start, &bounds).unwrap();
        Searched { problem, best, noise, starts: Vec::new(), work: Work::default() }
    }

    #[test]
    fn efforts_add_up() {
        let mut work = Work { iterations: 1, evaluations: 20, simulations: 300 };
        work.add(&Work { iterations: 4, evaluations: 50, simulations: 600 });
        assert_eq!(work, Work { iterations: 5, evaluations: 70, simulations: 900 });
    }

    /// Residuals of three deviations of the noise in the worst output, whatever its weights.
    #[test]
    fn residuals_are_told_in_deviations_of_the_noise() {
        let (case, plan) = case(false);
        let mut problem = Problem::new(&case, &plan).unwrap();
        let x = problem.start();
        let bounds = problem.bounds();
        let mut at = Minimum::linearised(&mut problem, &x, &bounds).unwrap();
        let noise = problem.noise();
        let (first, n) = (problem.first_row(0), problem.runs[0].time.len());
        for (output, times) in [(0, 1.0), (1, 3.0)] {
            let seen = &problem.runs[0].seen[output];
            let deviation = noise.deviation(seen.quantity);
            for (k, weight) in seen.weights.iter().enumerate() {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                at.residuals[first + output * n + k] = sign * times * deviation * weight;
            }
        }
        assert!((times_noise(&problem, &at) - 3.0).abs() < 1e-9, "{}", times_noise(&problem, &at));
    }

    /// Each sensor is weighed by its residuals, which depend on the weights: the first ones are those of a fit that
    /// believes both sensors alike.
    #[test]
    fn weights_agree_with_the_residuals_that_they_lead_to() {
        let (mut case, plan) = case(false);
        // The position is in a slightly wrong unit, and has less noise than the angle.
        let log = Arc::make_mut(case.experiments[0].log.as_mut().unwrap());
        log.outputs[1].values.iter_mut().for_each(|position| *position *= 1.005);
        let effort = Effort { options: Options::default(), is_straight: false, is_short: false, delay: None };
        let found = search_as_far(&case, &plan, None, &effort, &mut |_, _| Flow::Continue).unwrap();
        let left = noise_of(&found.problem, &found.best, false);
        for ((quantity, weighed), (_, left)) in found.noise.iter().zip(&left) {
            assert!((weighed / left - 1.0).abs() < 0.05, "{}: {weighed} {left}", quantity.name());
        }
    }
}

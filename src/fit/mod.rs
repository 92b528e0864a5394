//! Parameters from logs, and what the logs cannot tell.
//!
//! Output error: the model is put through every log's input, and what it would have shown is compared with what was seen,
//! all logs at once. The recipe is [`fit`]; before it, [`check`] says what the logs can determine.

mod acceleration;
mod check;
mod combinations;
mod density;
mod drawn;
mod findings;
mod identify;
pub mod least_squares;
mod noise;
mod posterior;
mod problem;
mod profile;
mod proposals;
mod regression;
mod run;
mod sub_records;
mod uncertainty;

pub use check::{Check, check};
pub use combinations::Combination;
pub use drawn::{drawn, machines};
pub use findings::{Finding, Grade};
pub use identify::{Group, Identifiability, LIMIT, MODEL, SHOWS};
pub use least_squares::Ending;
pub use posterior::{Credible, EFFECTIVE, Posterior, R_HAT, posterior};
pub use problem::{Problem, Stop};
pub use profile::{Profile, profiles};
pub use proposals::Proposal;
pub use regression::{Balance, regression};
pub use run::{Extra, Nuisance, Run, Seen};
pub use sub_records::Disagreement;
use uncertainty::Judged;
pub use uncertainty::{Covariance, inverse_of_square, student};

use crate::case::{Case, Given, Plan};
use crate::chance;
use crate::error::{Error, Result};
use crate::log::Quantity;
use crate::parameter::{self, Field, Parameter, named, values};
use crate::solve::{Bench, Flow};
use crate::stage::Stage;
use least_squares::{Differences, Minimum, Options, Residuals, minimise};
use nalgebra::DVector;
use problem::{ROUNDING, extent};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::path::Path;

/// Standard deviations beyond which Huber's loss counts linearly: 95 % efficient with Gaussian noise.
const HUBER: f64 = 1.345;

/// Rounds in which weights are estimated anew.
const ROUNDS: usize = 4;

/// Jacobians that a start other than the first may take before the best of them goes on.
const TRIAL_ITERATIONS: usize = 12;

/// What a fit found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The machine with the estimates; what is not determined is what the case says.
    pub stage: Stage,
    /// The estimates: free parameters, then what all logs share.
    pub estimates: Vec<Estimate>,
    /// Correlations of the estimates, row by row; NaN where one is at a bound.
    pub correlation: Vec<Vec<f64>>,
    /// What was taken as the standard deviation of each quantity's residuals.
    pub noise: Vec<(Quantity, f64)>,
    /// How each log is met: those fitted, then those held out.
    pub logs: Vec<LogFit>,
    /// What the logs determine at the estimates.
    pub identifiability: Option<Identifiability>,
    /// What to do about each group of parameters that is not determined.
    pub choices: Vec<Vec<String>>,
    /// Parts of the logs that say otherwise than the whole, by more than noise would make of it.
    pub disagreement: Option<Disagreement>,
    /// What is to be known of logs and search before the estimates are used, warnings first.
    pub findings: Vec<Finding>,
    /// The variables of the search where it ended.
    pub point: Vec<f64>,
    /// How the search ended.
    pub ending: Ending,
    /// What the last step promised, in standard errors.
    pub decrement: f64,
    /// ½ Σ r² of the weighted residuals.
    pub cost: f64,
    /// The cost that each start led to, in the first weights; the first start is that of the case, or what a regression makes
    /// of it if that is nearer.
    pub starts: Vec<f64>,
    /// Values that count.
    pub values: usize,
    /// Variables, what is fitted along included.
    pub variables: usize,
    /// What it took.
    pub work: Work,
}

/// What a fit took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Jacobians.
    pub iterations: usize,
    /// Trial points.
    pub evaluations: usize,
    /// Simulated logs.
    pub simulations: u64,
}

/// One parameter's estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Its key, or those of a tie, or the name of a group.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Where the search started.
    pub start: f64,
    /// The estimate.
    pub value: f64,
    /// Its standard error; infinite where it is not determined, none where it is at a bound.
    pub error: Option<f64>,
    /// 95 % interval; infinite where it is not determined. At a bound it reaches from there to where it would without that
    /// bound; none where even that cannot be said.
    pub interval: Option<[f64; 2]>,
    /// Its bounds.
    pub bounds: [f64; 2],
    /// Whether it ended at one of them.
    pub at_bound: bool,
    /// What it sets in the case file: key and value.
    pub sets: Vec<(String, f64)>,
}

/// How a log is met.
#[derive(Debug, Clone)]
pub struct LogFit {
    /// The experiment.
    pub name: String,
    /// Which window of it.
    pub window: usize,
    /// Whether none of it was fitted.
    pub held_out: bool,
    /// Times, s.
    pub time: Vec<f64>,
    /// First row that was not fitted.
    pub fitted_rows: usize,
    /// Each output.
    pub outputs: Vec<OutputFit>,
    /// What was fitted along: name, value, standard error.
    pub extras: Vec<(Nuisance, f64, Option<f64>)>,
    /// Whether the model reached the end of it.
    pub complete: bool,
}

/// How an output is met.
#[derive(Debug, Clone)]
pub struct OutputFit {
    /// What it is.
    pub quantity: Quantity,
    /// What was seen.
    pub seen: Vec<f64>,
    /// What the model says.
    pub model: Vec<f64>,
    /// Over the rows that were fitted.
    pub fitted: Option<Score>,
    /// Over those that were not.
    pub held_out: Option<Score>,
}

/// How far model and log are apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Values compared.
    pub count: usize,
    /// Root mean square of the residuals.
    pub rmse: f64,
    /// Largest residual.
    pub worst: f64,
    /// 100 (1 − ‖y − ŷ‖/‖y − ȳ‖)
    pub percent: f64,
    /// Correlation of neighbouring residuals.
    pub memory: f64,
}

/// Finds the parameters of `plan` from the logs of `case`.
///
/// `watch` sees the cost after each step; `stop` ends the search, which then gives the best so far.
pub fn fit(case: &Case, plan: &Plan, stop: Option<Stop>, watch: &mut dyn FnMut(f64) -> Flow) -> Result<Fit> {
    let found = search(case, plan, stop, watch)?;
    let judged = found.judged(case, plan);
    Ok(told(case, plan, &found, judged.as_ref()))
}

/// The result, and what is to be known of it.
fn told(case: &Case, plan: &Plan, found: &Searched, judged: Option<&Judged>) -> Fit {
    let mut fit = result(found, judged);
    fit.findings = findings::findings(case, plan, found, &fit);
    fit
}

/// Where a search ended.
struct Searched<'a> {
    problem: Problem<'a>,
    best: Minimum,
    /// Deviation of each quantity's residuals.
    noise: Vec<(Quantity, f64)>,
    starts: Vec<f64>,
    work: Work,
}

impl Searched<'_> {
    /// What the logs tell there, and whether their parts agree; none if numbers fail.
    fn judged(&self, case: &Case, plan: &Plan) -> Option<Judged> {
        let Minimum { residuals, jacobian, x, at_bound, .. } = &self.best;
        let mut judged = Judged::new(&self.problem, residuals, jacobian, x, at_bound)?;
        if let Some(disagreement) = sub_records::disagreement(case, plan, self, &judged) {
            judged.widen(disagreement);
        }
        Some(judged)
    }
}

/// The search of a fit, and of a check.
fn search<'a>(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop<'a>>,
    watch: &mut dyn FnMut(f64) -> Flow,
) -> Result<Searched<'a>> {
    let mut problem = Problem::new(case, plan)?.stopped_by(stop);

    let mut watch = |_: &[f64], cost: f64| watch(cost);
    let mut work = Work::default();
    let mut descend = |problem: &mut Problem, x: &[f64], options: &Options| {
        let options = Options { rounding: problem.rounding(), ..*options };
        let bounds = problem.bounds();
        let minimum = minimise(problem, x, &bounds, &options, &mut watch);
        work.iterations += minimum.iterations;
        work.evaluations += minimum.evaluations;
        minimum
    };
    let whole = Options::default();
    let start = first_guess(&mut problem);
    let mut best = descend(&mut problem, &start, &whole);
    if best.ending == Ending::Failed {
        return Err(Error::new("the model does not get through these logs with the values of the case file")
            .next("run `taut simulate` on the case to see why, or start from other values"));
    }
    let mut starts = vec![best.cost];
    let mut random = Pcg64::seed_from_u64(plan.seed);
    for _ in 1..plan.starts {
        if problem.is_stopped() || best.ending == Ending::Interrupted {
            break;
        }
        let x = elsewhere(&problem, &mut random);
        let trial = descend(&mut problem, &x, &Options { iterations: TRIAL_ITERATIONS, tolerance: 0.1, ..whole });
        let near = trial.cost < 1.2 * best.cost;
        let trial =
            if near && trial.ending != Ending::Failed { descend(&mut problem, &trial.x, &whole) } else { trial };
        starts.push(trial.cost);
        if trial.cost < best.cost {
            best = trial;
        }
    }

    // Weights from what the residuals are, until they stay.
    let mut noise: Vec<(Quantity, f64)> = Vec::new();
    for round in 0..ROUNDS {
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
        for &(quantity, deviation) in &fresh {
            problem.weigh(quantity, deviation, true);
            problem.doubt_starts(quantity, deviation);
        }
        let alike = fresh.len() == 1 && !plan.huber && !told_beforehand(&problem, &fresh) && uniform(&problem);
        noise = fresh;
        let options = Options { huber: if plan.huber { HUBER } else { f64::INFINITY }, ..whole };
        if alike && round == 0 && matches!(best.ending, Ending::Converged | Ending::Stalled) {
            // One weight for all: only the unit of the residuals changes.
            if let (Some(now), Some(before)) = (first_weight(&problem), before) {
                rescale(&mut best, now / before);
                break;
            }
        }
        best = descend(&mut problem, &best.x.clone(), &options);
    }
    if problem.is_stopped() {
        best.ending = Ending::Interrupted;
    }
    if noise.is_empty() {
        noise = noise_of(&problem, &best, plan.huber);
    }
    let options =
        Options { huber: if plan.huber { HUBER } else { f64::INFINITY }, rounding: problem.rounding(), ..whole };
    if best.ending != Ending::Interrupted {
        hold_undetermined(&mut problem, &mut best, &options, &mut watch, &mut work);
    }
    work.simulations = problem.simulations;
    Ok(Searched { problem, best, noise, starts, work })
}

/// Where a direction is not determined, the search ended anywhere along it: it is repeated with the parameter that moves most along it
/// held where the case has it, and the point that this leads to is as good.
fn hold_undetermined(
    problem: &mut Problem,
    best: &mut Minimum,
    options: &Options,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
    work: &mut Work,
) {
    let none = vec![false; best.x.len()];
    let lead = |best: &Minimum, problem: &Problem| {
        Judged::new(problem, &best.residuals, &best.jacobian, &best.x, &none).map(|judged| judged.identifiability.leads)
    };
    let Some(leads) = lead(best, problem).filter(|leads| !leads.is_empty()) else { return };
    let start = problem.start();
    let (open, mut bounds) = (problem.bounds(), problem.bounds());
    let mut x = best.x.clone();
    for &j in &leads {
        (bounds.low[j], bounds.high[j]) = (start[j], start[j]);
        x[j] = start[j];
    }
    // Where the others begin does not matter, as long as the held ones are far from where they were.
    let from = [x, start];
    for from in from {
        let found = minimise(problem, &from, &bounds, options, watch);
        work.iterations += found.iterations;
        work.evaluations += found.evaluations;
        if matches!(found.ending, Ending::Failed | Ending::Interrupted) || found.cost > best.cost * 1.01 + 1e-300 {
            continue;
        }
        let whole = problem.jacobian(&found.x, &found.residuals, &open, &Differences::Central);
        if let Some(jacobian) = whole {
            let mut at_bound = found.at_bound.clone();
            leads.iter().for_each(|&j| at_bound[j] = false);
            *best = Minimum { jacobian, at_bound, ..found };
        }
        return;
    }
}

impl Estimate {
    /// Whether the logs tell it, or it is at a bound.
    pub fn is_determined(&self) -> bool {
        self.at_bound || self.error.is_some_and(f64::is_finite)
    }
}

impl Fit {
    /// Whether all that is searched for is determined and nothing warns.
    pub fn is_reliable(&self) -> bool {
        self.is_complete() && self.warnings().next().is_none()
    }

    /// Whether all that is searched for is determined.
    pub fn is_complete(&self) -> bool {
        self.estimates.iter().all(Estimate::is_determined)
    }

    /// What makes the result not to be relied on.
    pub fn warnings(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.grade == Grade::Warning)
    }

    /// Whether the search ended at a minimum within the bounds, and nothing warns.
    pub fn is_converged(&self) -> bool {
        self.ending == Ending::Converged
            && !self.estimates.iter().any(|estimate| estimate.at_bound)
            && self.is_reliable()
    }

    /// How it ended, for files: `converged` only where it is.
    pub fn ending_word(&self) -> &'static str {
        match self.ending {
            Ending::Converged if self.estimates.iter().any(|estimate| estimate.at_bound) => "at_bound",
            Ending::Converged if !self.is_complete() => "not_determined",
            Ending::Converged if !self.is_reliable() => "doubtful",
            ending => ending.word(),
        }
    }

    /// What is determined of parameters that are not.
    pub fn combinations(&self) -> impl Iterator<Item = &Combination> {
        self.identifiability.iter().flat_map(|found| &found.groups).flat_map(|group| &group.combinations)
    }

    /// What is to be changed in the text so that `key` is `value`.
    fn changes(&self, case: &Case, key: &str, value: f64) -> Vec<String> {
        let Some(row) = named(key) else { return Vec::new() };
        let own: Vec<(String, f64)> = values(&self.stage)
            .into_iter()
            .filter(|(element, _)| named(element).is_some_and(|other| other.key == row.key))
            .collect();
        let is_element = row.key != key;
        let (listed, given) = (own.len() > 1 || is_element, matches!(case.value(row.key), Ok(Given::List(_))));
        match key.starts_with("belt.") {
            // All spans at once, or one of a list that is not there.
            true if listed && !(is_element && given) => {
                let spans: Vec<String> = own.iter().map(|(_, value)| value.to_string()).collect();
                vec![format!("{}=[{}]", row.key, spans.join(", "))]
            }
            _ if listed && !is_element => own.iter().map(|(element, value)| format!("{element}={value}")).collect(),
            _ => vec![format!("{key}={value}")],
        }
    }

    /// The text of the case with the estimates in place of what they were, and a table of how well they are known. Paths in
    /// it are those of `case`; `name` stands in messages.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        let known = |estimate: &&Estimate| estimate.is_determined();
        let sets = || self.estimates.iter().filter(known).flat_map(|estimate| &estimate.sets);
        let text = without_other_forms(&case.text, sets().map(|(key, _)| key.as_str()));
        let mut changes: Vec<String> = sets().flat_map(|(key, value)| self.changes(case, key, *value)).collect();
        let read = |changes: &[String]| {
            let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
            Case::from_text_with(name, &text, &changes)
        };
        let same = |read: &Result<Case>| read.as_ref().is_ok_and(|read| alike(&read.stage, &self.stage));
        let mut fitted = read(&changes);
        if !same(&fitted) {
            // The other direction, or the breakaway, stands in the text and went with what was fitted.
            let is_fitted = |body: &str| sets().any(|(key, _)| key.starts_with(&format!("{body}.friction.")));
            for (key, value) in values(&self.stage) {
                let went_along = named(&key).is_some_and(|row| !row.follows.is_empty());
                if went_along && key.split_once(".friction.").is_some_and(|(body, _)| is_fitted(body)) {
                    changes.push(format!("{key}={value}"));
                }
            }
            fitted = read(&changes);
        }
        let text = fitted?.text;
        let mut document: toml_edit::DocumentMut =
            text.parse().map_err(|_| Error::new("this is not TOML").in_file(name))?;
        let mut table = toml_edit::Table::new();
        let how = format!(
            "\n# How well the fit knows its estimates: SI units, standard errors, 95 % intervals. How it ended: {}.\n",
            self.ending_word()
        );
        table.decor_mut().set_prefix(how);
        for estimate in &self.estimates {
            let mut row = toml_edit::InlineTable::new();
            let mut put = |key: &str, value: f64| {
                row.insert(key, toml_edit::Value::from(value));
            };
            put("value", if estimate.is_determined() { estimate.value } else { estimate.start });
            match (estimate.error, estimate.interval) {
                (Some(error), Some([low, high])) if error.is_finite() => {
                    put("error", error);
                    put("low", low);
                    put("high", high);
                }
                _ => {
                    if let Some([low, high]) = estimate.interval.filter(|ends| ends.iter().all(|end| end.is_finite())) {
                        put("low", low);
                        put("high", high);
                    }
                    let why = if estimate.at_bound { "at its bound" } else { "not determined" };
                    row.insert("known", toml_edit::Value::from(why));
                }
            }
            table.insert(&estimate.name, toml_edit::value(row));
        }
        for combination in self.combinations() {
            let mut row = toml_edit::InlineTable::new();
            let [low, high] = combination.interval;
            for (key, value) in
                [("value", combination.value), ("error", combination.error), ("low", low), ("high", high)]
            {
                row.insert(key, toml_edit::Value::from(value));
            }
            table.insert(&combination.name, toml_edit::value(row));
        }
        document.insert("uncertainty", toml_edit::Item::Table(table));
        Ok(document.to_string())
    }
}

/// The text without what says the same as these keys in another form: teeth and pitch beside a radius that was fitted.
fn without_other_forms<'a>(text: &str, keys: impl Iterator<Item = &'a str>) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_string() };
    let fitted: Vec<&str> = keys.filter_map(|key| Some(named(key)?.key)).collect();
    let says = |row: &Parameter, key: &str| match row.field {
        Field::PartOf(whole) => whole == key && !row.key.starts_with(&format!("{key}.")),
        Field::Form(of, _) => of == key,
        Field::Machine(_) | Field::Elsewhere => false,
    };
    let mut changed = false;
    for key in fitted {
        let same = |row: &&Parameter| says(row, key) || named(key).is_some_and(|own| says(own, row.key));
        for row in parameter::all().filter(same) {
            let Some((path, last)) = row.key.rsplit_once('.') else { continue };
            let mut steps = path.split('.');
            let table = steps.try_fold(document.as_item_mut(), |item, step| item.get_mut(step));
            if let Some(table) = table.and_then(toml_edit::Item::as_table_like_mut) {
                changed |= table.remove(last).is_some();
            }
        }
    }
    if changed { document.to_string() } else { text.to_string() }
}

/// Whether two machines are the same but for rounding in text.
fn alike(a: &Stage, b: &Stage) -> bool {
    let near = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    let (a, b) = (values(a), values(b));
    a.len() == b.len() && a.iter().zip(&b).all(|((key, a), (other, b))| key == other && near(*a, *b))
}

/// The first weight of an output that counts.
fn first_weight(problem: &Problem) -> Option<f64> {
    problem.runs.iter().flat_map(|run| &run.seen).flat_map(|seen| &seen.weights).copied().find(|w| *w > 0.0)
}

fn rescale(minimum: &mut Minimum, factor: f64) {
    minimum.residuals.iter_mut().for_each(|r| *r *= factor);
    minimum.jacobian *= factor;
    minimum.cost *= factor * factor;
}

/// Whether all that counts has the same weight.
fn uniform(problem: &Problem) -> bool {
    let mut weights =
        problem.runs.iter().flat_map(|run| &run.seen).flat_map(|seen| &seen.weights).filter(|w| **w > 0.0);
    let Some(first) = weights.next() else { return true };
    weights.all(|w| (w / first - 1.0).abs() < 1e-3)
}

/// Whether what is known beforehand of the start could be as wrong as the residuals are: then it depends on their weight.
fn told_beforehand(problem: &Problem, noise: &[(Quantity, f64)]) -> bool {
    let most = noise.iter().map(|(_, deviation)| *deviation).fold(0.0, f64::max);
    let arm = problem.stage.pulley_radius.min(1.0);
    problem.runs.iter().flat_map(|run| &run.extras).any(|extra| extra.known.is_some_and(|own| own > 0.1 * arm * most))
}

/// Where the case starts, or with the totals that a regression finds, whichever is nearer to the logs.
fn first_guess(problem: &mut Problem) -> Vec<f64> {
    let start = problem.start();
    let Some(balance) = regression(problem) else { return start };
    let bounds = problem.bounds();
    let mut guess = start.clone();
    for (j, value) in balance.guess(problem).into_iter().enumerate() {
        let x = problem.variable(j, value);
        guess[j] = if x.is_finite() { x.clamp(bounds.low[j], bounds.high[j]) } else { start[j] };
    }
    let mut residuals = vec![0.0; problem.rows()];
    let mut cost = |x: &[f64]| {
        if problem.evaluate(x, &mut residuals) { residuals.iter().map(|r| r * r).sum() } else { f64::INFINITY }
    };
    if cost(&guess) < cost(&start) { guess } else { start }
}

/// A point within the bounds, near enough to the start to be a machine of its kind: within a factor of ten, or for what may
/// be zero, between zero and three times its start.
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
                        // Equal values in a row are one, unless they tremble.
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
        noise.push((quantity, deviation.max(step / 12f64.sqrt()).max(ROUNDING * wide).max(f64::MIN_POSITIVE * 1e10)));
    }
    noise
}

/// Everything that is told of a minimum.
fn result(found: &Searched, judged: Option<&Judged>) -> Fit {
    let Searched { problem, best, noise, starts, work } = found;
    let bounds = problem.bounds();
    let covariance = judged.map(|judged| &judged.covariance);
    let identifiability = judged.map(|judged| judged.identifiability.clone());
    let t = covariance.map_or(student(1), |c| c.reach);
    let determined = |j: usize| identifiability.as_ref().is_some_and(|found| found.error[j].is_finite());
    let error = |j: usize| match covariance {
        Some(covariance) if j >= problem.globals() || determined(j) => covariance.error(j),
        _ if best.at_bound[j] => None,
        _ => Some(f64::INFINITY),
    };
    // All variables without their bounds, where one is at its bound.
    let beyond = if best.at_bound.contains(&true) {
        let free = vec![false; best.at_bound.len()];
        let free = Judged::new(problem, &best.residuals, &best.jacobian, &best.x, &free);
        // d = −(JᵀJ)⁻¹ Jᵀ r
        let step = inverse_of_square(&best.jacobian)
            .map(|inverse| -inverse * best.jacobian.tr_mul(&DVector::from_column_slice(&best.residuals)));
        free.zip(step)
    } else {
        None
    };
    let mut estimates = Vec::new();
    for (j, parameter) in problem.parameters.iter().enumerate() {
        let (x, value) = (best.x[j], problem.value(j, best.x[j]));
        let error = if best.at_bound[j] { None } else { error(j) };
        let end = |x: f64| problem.value(j, x).clamp(parameter.low, parameter.high);
        let interval = match error {
            Some(e) if e.is_finite() => Some([end(x - t * e), end(x + t * e)]),
            Some(_) => Some([f64::NEG_INFINITY, f64::INFINITY]),
            // Where it would be without its bound, but no further off than a standard error.
            None => beyond.as_ref().filter(|(judged, _)| judged.identifiability.error[j].is_finite()).map(
                |(judged, step)| {
                    let e = judged.covariance.error(j).unwrap_or(f64::INFINITY);
                    let x = x + step[j].clamp(-e, e);
                    [end(x - t * e), end(x + t * e)]
                },
            ),
        };
        estimates.push(Estimate {
            name: parameter.name.clone(),
            unit: parameter.unit,
            start: parameter.start,
            value,
            error: error.map(|e| e * problem.slope(j, value)),
            interval,
            bounds: [parameter.low, parameter.high],
            at_bound: best.at_bound[j],
            sets: parameter.keys.iter().map(|(key, factor)| (key.clone(), factor * value)).collect(),
        });
    }
    for (i, extra) in problem.shared.iter().enumerate() {
        let j = problem.parameters.len() + i;
        let value = extra.start + extra.unit * best.x[j];
        let error = if best.at_bound[j] { None } else { error(j).map(|e| e * extra.unit) };
        let unit = match extra.what {
            Nuisance::Delay => "s",
            Nuisance::InputGain => "",
            Nuisance::InputOffset => problem.stage.amplifier.mode.unit(),
            // Each log has its own: they are never shared.
            Nuisance::StartPosition | Nuisance::StartSpeed | Nuisance::Bias(_) => "",
        };
        estimates.push(Estimate {
            name: extra.what.name().to_string(),
            unit,
            start: extra.start,
            value,
            error,
            interval: error.map(|e| [(value - t * e).max(extra.low), (value + t * e).min(extra.high)]),
            bounds: [extra.low, extra.high],
            at_bound: best.at_bound[j] && bounds.low[j] < bounds.high[j],
            sets: Vec::new(),
        });
    }
    let n = problem.globals();
    let correlation = (0..n)
        .map(|i| (0..n).map(|j| covariance.and_then(|c| c.correlation(i, j)).unwrap_or(f64::NAN)).collect())
        .collect();
    let stage = problem.stage_at(&best.x);
    // What is not determined stays what the case says.
    let start = problem.start();
    let undetermined = |j: usize| identifiability.as_ref().is_some_and(|found| found.error[j].is_infinite());
    let kept: Vec<f64> = (0..best.x.len())
        .map(|j| if j < problem.globals() && undetermined(j) { start[j] } else { best.x[j] })
        .collect();
    let written = problem.stage_at(&kept);
    let mut logs = Vec::new();
    let mut sums: Vec<(Nuisance, f64, usize)> = Vec::new();
    for (index, run) in problem.runs.iter().enumerate() {
        let extras = problem.extras_of(index, &best.x);
        let mut told = Vec::new();
        let own = problem.own_variables(index);
        for (extra, &value) in run.extras.iter().zip(&extras) {
            let j = own.iter().find(|(_, other)| other.what == extra.what).map(|(j, _)| *j);
            // What is known beforehand is no result.
            if let (Some(j), None) = (j, extra.known) {
                told.push((extra.what, value, error(j).map(|e| e * extra.unit)));
                match sums.iter_mut().find(|(what, ..)| *what == extra.what) {
                    Some((_, sum, count)) => (*sum, *count) = (*sum + value, *count + 1),
                    None => sums.push((extra.what, value, 1)),
                }
            }
        }
        logs.push(compared(run, &stage, &extras, told));
    }
    let shared = problem.shared_values(&best.x);
    for run in &problem.held_out {
        // Nothing of a log that is held out is fitted: delay, gain and offsets are the mean of the others, and it starts
        // where its first row is.
        let extras: Vec<f64> = run
            .extras
            .iter()
            .map(|extra| match extra.what {
                Nuisance::StartPosition | Nuisance::StartSpeed => extra.start,
                what => sums.iter().find(|(w, ..)| *w == what).map_or(extra.start, |(_, sum, n)| sum / *n as f64),
            })
            .chain(shared.iter().copied())
            .collect();
        logs.push(compared(run, &stage, &extras, Vec::new()));
    }
    Fit {
        stage: written,
        estimates,
        correlation,
        noise: noise.clone(),
        logs,
        choices: identifiability
            .iter()
            .flat_map(|found| found.groups.iter().map(|group| found.choices(problem, group)))
            .collect(),
        identifiability,
        disagreement: judged.and_then(|judged| judged.disagreement.clone()),
        findings: Vec::new(),
        point: best.x.clone(),
        ending: best.ending,
        decrement: best.decrement,
        cost: best.cost,
        starts: starts.clone(),
        values: problem.counted(),
        variables: problem.variables(),
        work: *work,
    }
}

/// Model and log side by side.
fn compared(run: &Run, stage: &Stage, extras: &[f64], told: Vec<(Nuisance, f64, Option<f64>)>) -> LogFit {
    let quantities: Vec<Quantity> = run.seen.iter().map(|seen| seen.quantity).collect();
    let mut columns = vec![Vec::new(); quantities.len()];
    let complete = run.predict(&mut Bench::default(), stage, extras, &quantities, &mut columns);
    let n = run.time.len();
    let outputs = run
        .seen
        .iter()
        .zip(columns)
        .enumerate()
        .map(|(i, (seen, column))| {
            let bias = run.bias(i, extras);
            let mut model: Vec<f64> =
                column.iter().map(|v| if seen.absolute { v.abs() + bias } else { v + bias }).collect();
            model.resize(n, f64::NAN);
            OutputFit {
                quantity: seen.quantity,
                fitted: score(&seen.values, &model, 0..run.fitted_rows.min(n)),
                held_out: score(&seen.values, &model, run.fitted_rows.min(n)..n),
                seen: seen.values.clone(),
                model,
            }
        })
        .collect();
    LogFit {
        name: run.name.clone(),
        window: run.window,
        held_out: run.held_out,
        time: run.time.clone(),
        fitted_rows: run.fitted_rows,
        outputs,
        extras: told,
        complete,
    }
}

fn score(seen: &[f64], model: &[f64], rows: std::ops::Range<usize>) -> Option<Score> {
    let rows: Vec<usize> = rows.filter(|&k| seen[k].is_finite() && model[k].is_finite()).collect();
    if rows.is_empty() {
        return None;
    }
    let n = rows.len() as f64;
    let residuals: Vec<f64> = rows.iter().map(|&k| model[k] - seen[k]).collect();
    let squares: f64 = residuals.iter().map(|r| r * r).sum();
    let mean = rows.iter().map(|&k| seen[k]).sum::<f64>() / n;
    let spread: f64 = rows.iter().map(|&k| (seen[k] - mean).powi(2)).sum();
    let places: Vec<usize> = (0..residuals.len()).collect();
    Some(Score {
        count: rows.len(),
        rmse: (squares / n).sqrt(),
        worst: residuals.iter().fold(0.0, |most: f64, r| most.max(r.abs())),
        percent: 100.0 * (1.0 - (squares / spread.max(f64::MIN_POSITIVE)).sqrt()),
        memory: uncertainty::memory_of(&residuals, &places),
    })
}

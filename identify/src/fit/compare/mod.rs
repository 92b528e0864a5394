//! Comparison of friction laws and windows by cross-validation: the best one predicts held-out records best.
//!
//! A law with more parameters fits its own records better, and others worse once it fits noise. So each candidate is
//! fitted with a part of the records held out, and judged by its error there. With e_cf the squared error of candidate
//! c in part f, the fewest parameters are chosen with which a mean error exceeds that of the best by no more than a
//! standard error of the differences e_cf − e_bf (the rule of one standard error, L. Breiman and others 1984).

pub(crate) mod drift;
mod laws;

pub use laws::FrictionLaw;

use crate::case::{Case, Files, Plan};
use crate::error::{Error, Result};
use crate::fit::asked::problem::{Problem, Stop};
use crate::fit::asked::straight::has_exact_derivatives;
use crate::fit::search::starts::{Effort, Work, search_as_far};
use crate::fit::trust::found::Fit;
use crate::fit::trust::held_out::{met, nothing};
use crate::fit::trust::nearest::search_near;
use crate::fit::trust::parts::{Errors, Parts, errors};
use crate::fit::trust::result::known;
use crate::fit::trust::scores::together;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::solve::Flow;
use rayon::prelude::*;
use std::path::Path;

/// The laws and windows to compare.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparisonOptions {
    /// Friction laws.
    pub laws: Vec<FrictionLaw>,
    /// Lengths of windows, s; `None` for whole logs.
    pub windows: Vec<Option<f64>>,
}

impl ComparisonOptions {
    /// The usual laws; whole logs, and windows of a fifth and of a twentieth of the longest.
    pub fn usual(case: &Case, plan: &Plan) -> Self {
        let ends = case.experiments.iter().filter_map(|experiment| experiment.log.as_ref()?.time.last().copied());
        let long = ends.fold(0.0, f64::max);
        // To two digits.
        let short = |part: f64| {
            let unit = 10f64.powf((long / part).log10().floor() - 1.0);
            Some((long / part / unit).round() * unit)
        };
        let mut windows = vec![None, short(5.0), short(20.0)];
        if plan.closed_loop {
            windows.truncate(1);
        }
        Self { laws: FrictionLaw::USUAL.to_vec(), windows }
    }
}

/// Result of a comparison.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Comparison {
    /// All candidates, the best prediction first.
    pub candidates: Vec<Candidate>,
    /// Index of the chosen one.
    pub chosen: usize,
    /// Index of the one with the least training error.
    pub by_training: usize,
    /// The parts that were held out, in words.
    pub held_out: String,
    /// The body whose friction is compared.
    pub body: &'static str,
    /// The quantities of the errors; with several, errors are relative to the least of each.
    pub quantities: Vec<Quantity>,
    /// The case with the chosen law.
    pub case: Case,
    /// The free parameters.
    pub plan: Plan,
    /// The fit to all logs.
    pub fit: Fit,
    /// The effort.
    pub work: Work,
}

/// A law with a length of windows.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Candidate {
    /// The law.
    pub law: FrictionLaw,
    /// True if each direction has its own values.
    pub sided: bool,
    /// Length of windows, s; `None` for whole logs.
    pub window: Option<f64>,
    /// Number of free parameters of the machine.
    pub parameters: usize,
    /// RMS over the complete fitted logs; NaN without a result.
    pub training: f64,
    /// Error on held-out data; infinite if a simulation or the fit failed.
    pub held_out: f64,
    /// Standard error of the difference of its squared error to that of the best, converted to an error of `held_out`.
    pub error: f64,
    /// Mean square of each held-out part.
    pub squares: Vec<f64>,
    /// Reason for a missing result; `None` with a result.
    pub failed: Option<String>,
}

impl Candidate {
    /// In words.
    pub fn name(&self) -> String {
        let law = match (self.law.is_above(), self.sided) {
            (true, true) => format!("{} above asymmetric", self.law.name()),
            _ => self.law.name().to_string(),
        };
        match self.window {
            Some(window) => format!("{law}, windows of {}", crate::quantity::show(window, "s")),
            None => format!("{law}, whole logs"),
        }
    }
}

/// Compares laws and windows for the logs of `case`, whose file is `name`; `watch` receives the name of each fit.
pub fn compare(
    case: &Case,
    name: &Path,
    plan: &Plan,
    setting: &ComparisonOptions,
    stop: Option<Stop>,
    watch: &mut dyn FnMut(&str) -> Flow,
) -> Result<Comparison> {
    case.complete()?;
    crate::case::needs_motors(&case.machine)?;
    if setting.laws.is_empty() || setting.windows.is_empty() {
        return Err(
            Error::new("there is nothing to compare").next("name a law and a length of windows, or leave both out")
        );
    }
    if let Some(window) = setting.windows.iter().flatten().find(|window| !(**window > 0.0 && window.is_finite())) {
        return Err(Error::new(format!("{window} s is not a length of windows")).allowed("above zero"));
    }
    let parts = Parts::new(case, plan);
    if parts.folds.len() < 2 {
        return Err(
            Error::new("the logs are too short to hold parts of them out").next("log for longer, or more often")
        );
    }
    if plan.closed_loop && parts.is_cut {
        return Err(Error::new(
            "a controller begins with the log, so blocks of a log in closed loop cannot be held out",
        )
        .next("give four logs or more, or leave `loop` out of [fit]"));
    }
    let mut course = Course { case, name, plan, parts, stop, work: Work::default(), tried: Vec::new() };
    let mut from = Beginning { machine: case.machine.clone(), delay: None };
    let mut laws = setting.laws.clone();
    laws.sort_by_key(|law| FrictionLaw::ALL.iter().position(|own| own == law));
    laws.dedup();
    for law in laws {
        let sided = law == FrictionLaw::Asymmetric || (law.is_above() && course.is_sided_better());
        let (own, searched) = laws::with(case, name, plan, law, sided, &from.machine)?;
        let mut start = Beginning { machine: own.machine.clone(), ..from };
        let windows = match course.best_window() {
            Some(window) if !has_exact_derivatives(&own.machine) => vec![window],
            _ => setting.windows.clone(),
        };
        for window in windows {
            let told = Candidate::new(law, sided, window, searched.names().count());
            if watch(&told.name()) == Flow::Stop || stop.is_some_and(|stop| stop()) {
                return Err(Error::new("interrupted before all laws were compared"));
            }
            let found = course.try_one(&own, &searched, told, &start);
            if let Some(end) = found {
                // A law without dry friction makes progress where a cart with it stands still.
                if window == setting.windows[0] && !law.is_above() && law != FrictionLaw::Viscous {
                    from = end.clone();
                }
                start = end;
            }
        }
    }
    course.chosen()
}

/// Where a search begins: a machine, and the delay of inputs, in intervals between samples, if it is known.
#[derive(Clone)]
struct Beginning {
    machine: Machine,
    delay: Option<f64>,
}

/// A comparison in progress.
struct Course<'a> {
    case: &'a Case,
    name: &'a Path,
    plan: &'a Plan,
    parts: Parts,
    stop: Option<Stop<'a>>,
    work: Work,
    /// Candidates with errors of each quantity in each part, the machine, the case and the plan.
    tried: Vec<Tried>,
}

struct Tried {
    candidate: Candidate,
    /// Sum of squares and number of values, by part and quantity.
    errors: Vec<Errors>,
    training: Vec<(Quantity, f64)>,
    case: Case,
    /// The machine of the case's text, where its search did not begin.
    given: Machine,
    plan: Plan,
}

impl Tried {
    /// The sum over all that was held out.
    fn squares(&self) -> f64 {
        self.errors.iter().flatten().map(|(_, squares, _)| squares).sum()
    }
}

impl Course<'_> {
    /// Fits a candidate to all logs and to all but a part; the end of the fit to all.
    fn try_one(&mut self, case: &Case, plan: &Plan, mut candidate: Candidate, start: &Beginning) -> Option<Beginning> {
        let plan = Plan { windows: candidate.window, starts: 1, ..plan.clone() };
        let (given, case) = (case.machine.clone(), Case { machine: start.machine.clone(), ..case.clone() });
        let (mut errors, mut training, mut end) = (Vec::new(), Vec::new(), None);
        match self.whole(&case, &plan, start.delay) {
            Ok((own, met)) => (end, training) = (Some(own), met),
            Err(error) => candidate.failed = Some(error.what),
        }
        if let Some(end) = &end {
            let near = Case { machine: end.machine.clone(), ..case.clone() };
            let fold = |part: usize| self.fold(&near, &plan, part, end.delay);
            let folds: Vec<_> = (0..self.parts.folds.len()).into_par_iter().map(fold).collect();
            for found in folds {
                match found {
                    Ok((found, work)) => {
                        self.work.add(&work);
                        errors.push(found);
                    }
                    Err(error) => {
                        candidate.failed = Some(error.what);
                        break;
                    }
                }
            }
        }
        self.tried.push(Tried { candidate, errors, training, case, given, plan });
        end
    }

    /// The fit to all logs, and its errors over complete logs with fitted starts.
    fn whole(&mut self, case: &Case, plan: &Plan, delay: Option<f64>) -> Result<(Beginning, Vec<(Quantity, f64)>)> {
        let found = search_as_far(case, plan, self.stop, &Effort::compared(delay), &mut |_, _| Flow::Continue)?;
        self.work.add(&found.work);
        let stages = found.problem.stages(&found.best.x);
        let simulated: Vec<Machine> =
            (0..stages.len()).map(|part| found.problem.simulated(part, &found.best.x)).collect();
        let known = known(&found);
        let whole = Plan { windows: None, held_out: plan.held_out.clone(), ..nothing(plan) };
        let logs: Vec<_> =
            Problem::new(case, &whole)?.runs.iter().map(|run| met(run, &simulated[run.part], &known, 1.0)).collect();
        let errors = together(&logs, |_| String::new());
        let end = Beginning { machine: stages[0].clone(), delay: Some(found.delay()) };
        Ok((end, errors.iter().map(|one| (one.quantity, one.rmse)).collect()))
    }

    /// The errors in a part that is not fitted, and the effort.
    fn fold(&self, case: &Case, plan: &Plan, part: usize, delay: Option<f64>) -> Result<(Errors, Work)> {
        let parts = &self.parts;
        errors(case, plan, &parts.folds[part], (parts.is_cut, &Effort::of_part(delay)), self.stop)
    }

    /// The best windows of the piecewise linear laws; `None` if none was tried yet.
    fn best_window(&self) -> Option<Option<f64>> {
        let is_simple = |tried: &&Tried| tried.candidate.failed.is_none() && !tried.candidate.law.is_above();
        let tried = self.tried.iter().filter(is_simple);
        tried.min_by(|a, b| a.squares().total_cmp(&b.squares())).map(|tried| tried.candidate.window)
    }

    /// True if direction-dependent friction predicts better, and both were tried.
    fn is_sided_better(&self) -> bool {
        let of = |law: FrictionLaw| {
            let own = self.tried.iter().filter(|tried| tried.candidate.law == law && tried.candidate.failed.is_none());
            own.map(Tried::squares).min_by(f64::total_cmp)
        };
        match (of(FrictionLaw::Coulomb), of(FrictionLaw::Asymmetric)) {
            (Some(one), Some(each)) => each < one,
            (None, Some(_)) => true,
            (_, None) => false,
        }
    }

    /// Mean square of a candidate by part; with several quantities, each relative to the least of all candidates.
    fn rank(&mut self) -> Vec<Quantity> {
        let mut quantities: Vec<Quantity> = Vec::new();
        for (quantity, ..) in self.tried.iter().flat_map(|tried| tried.errors.iter().flatten()) {
            if !quantities.contains(quantity) {
                quantities.push(*quantity);
            }
        }
        let mean = |errors: &[Errors], quantity: Quantity| {
            let own = errors.iter().flatten().filter(|one| one.0 == quantity);
            let (squares, count) = own.fold((0.0, 0), |(s, n), (_, squares, count)| (s + squares, n + count));
            squares / count.max(1) as f64
        };
        let least = |quantity| {
            let all = self.tried.iter().filter(|tried| tried.candidate.failed.is_none());
            all.map(|tried| mean(&tried.errors, quantity)).fold(f64::INFINITY, f64::min)
        };
        let units: Vec<f64> = match quantities[..] {
            [_] => vec![1.0],
            _ => quantities.iter().map(|quantity| least(*quantity).max(f64::MIN_POSITIVE)).collect(),
        };
        let shares = quantities.len().max(1) as f64;
        for tried in &mut self.tried {
            let value = |one: &[Errors]| {
                quantities.iter().zip(&units).map(|(quantity, unit)| mean(one, *quantity) / unit).sum::<f64>() / shares
            };
            let candidate = &mut tried.candidate;
            candidate.squares = tried.errors.iter().map(|part| value(std::slice::from_ref(part))).collect();
            candidate.held_out = if candidate.failed.is_some() { f64::INFINITY } else { value(&tried.errors).sqrt() };
            let of = |quantity: &Quantity| {
                tried.training.iter().find(|(own, _)| own == quantity).map_or(f64::NAN, |(_, rmse)| *rmse)
            };
            let training =
                quantities.iter().zip(&units).map(|(quantity, unit)| of(quantity).powi(2) / unit).sum::<f64>();
            candidate.training = (training / shares).sqrt();
        }
        self.tried.sort_by(|a, b| a.candidate.held_out.total_cmp(&b.candidate.held_out));
        quantities
    }

    fn chosen(mut self) -> Result<Comparison> {
        let quantities = self.rank();
        let Some(best) = self.tried.first().filter(|tried| tried.candidate.held_out.is_finite()) else {
            let why = self.tried.iter().find_map(|tried| tried.candidate.failed.clone()).unwrap_or_default();
            return Err(Error::new(format!("no friction law can be run through the blocks of these logs: {why}"))
                .next("run `taut fit` with one law to see why"));
        };
        let best = best.candidate.squares.clone();
        for tried in &mut self.tried {
            tried.candidate.error = standard_error(&tried.candidate, &best);
        }
        let top = self.tried[0].candidate.held_out;
        let near = |one: &Candidate| one.held_out.powi(2) - top * top <= one.error;
        let fewest = self.tried.iter().map(|tried| &tried.candidate).filter(|one| one.failed.is_none() && near(one));
        let fewest = fewest.map(|one| one.parameters).min().unwrap_or(usize::MAX);
        // The first with this number of parameters predicts best among them.
        let chosen = self.tried.iter().position(|tried| tried.candidate.parameters == fewest).unwrap_or(0);
        let by_training = (0..self.tried.len())
            .filter(|&k| self.tried[k].candidate.failed.is_none())
            .min_by(|&a, &b| self.tried[a].candidate.training.total_cmp(&self.tried[b].candidate.training))
            .unwrap_or(chosen);
        let own = &self.tried[chosen];
        let plan = Plan { starts: self.plan.starts, ..own.plan.clone() };
        let mut case = own.case.clone();
        if plan.windows != self.plan.windows {
            let change = plan.windows.map(|window| format!("fit.windows={window}"));
            let changes: Vec<&str> = change.iter().map(String::as_str).collect();
            let text = without_windows(&case.text);
            let read = Case::from_text_for(self.name, &text, &changes, Files::Nothing)?;
            case =
                Case { experiments: self.case.experiments.clone(), unread: Vec::new(), machine: case.machine, ..read };
        }
        let settled = search_near(&case, &own.given, &plan, self.stop, &mut |_, _| Flow::Continue)?;
        self.work.add(&settled.searched.work);
        let fit = settled.assessed(&case, &plan).fit;
        Ok(Comparison {
            chosen,
            by_training,
            held_out: self.parts.words(),
            body: laws::body(&self.case.machine, self.plan),
            quantities,
            candidates: self.tried.into_iter().map(|tried| tried.candidate).collect(),
            case,
            plan,
            fit,
            work: self.work,
        })
    }
}

impl Candidate {
    fn new(law: FrictionLaw, sided: bool, window: Option<f64>, parameters: usize) -> Self {
        let (training, held_out, error) = (f64::NAN, f64::INFINITY, 0.0);
        Self { law, sided, window, parameters, training, held_out, error, squares: Vec::new(), failed: None }
    }
}

impl Comparison {
    /// Reason for the choice, and the choice by training errors, in sentences.
    pub fn words(&self) -> Vec<String> {
        let shown = |candidate: &Candidate| {
            let error = |value: f64| self.shown(value);
            format!(
                "{} ({} held out, {} in training)",
                candidate.name(),
                error(candidate.held_out),
                error(candidate.training)
            )
        };
        let (chosen, best, trained) =
            (&self.candidates[self.chosen], &self.candidates[0], &self.candidates[self.by_training]);
        let why = match self.chosen {
            0 => format!("{} predicts best what was held out", shown(chosen)),
            _ => format!(
                "{} predicts best of those with {} parameters, the fewest with which an error is within one standard \
                 error of the least, that of {}",
                shown(chosen),
                chosen.parameters,
                shown(best)
            ),
        };
        let training = match trained.name() == chosen.name() {
            true => "the training error is least for it, too".to_string(),
            false => format!(
                "by its training error {} would have been chosen, which predicts {:.2} times as badly",
                shown(trained),
                trained.held_out / chosen.held_out
            ),
        };
        vec![why, training]
    }

    /// An error with its unit; with several quantities, a multiple of the least.
    pub fn shown(&self, value: f64) -> String {
        match self.quantities[..] {
            [quantity] if value.is_finite() => {
                crate::number::engineering(value, quantity.unit(), 3).replace(['\u{a0}', '\u{202f}'], " ")
            }
            _ if value.is_finite() => format!("{value:.3}"),
            _ => "–".into(),
        }
    }
}

/// Standard error of the mean of the differences between the mean squares of the parts and those of the best.
fn standard_error(candidate: &Candidate, best: &[f64]) -> f64 {
    let differences: Vec<f64> = candidate.squares.iter().zip(best).map(|(own, best)| own - best).collect();
    let n = differences.len() as f64;
    if differences.len() < 2 || differences.len() < best.len() {
        return 0.0;
    }
    let mean = differences.iter().sum::<f64>() / n;
    (differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt()
}

/// The text of a case without windows in its fit.
fn without_windows(text: &str) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_string() };
    if let Some(fit) = document.get_mut("fit").and_then(toml_edit::Item::as_table_like_mut) {
        fit.remove("windows");
    }
    document.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_mean_is_the_deviation_over_the_root_of_the_number() {
        let mut candidate = Candidate {
            law: FrictionLaw::Coulomb,
            sided: false,
            window: None,
            parameters: 2,
            training: 1.0,
            held_out: 1.0,
            error: 0.0,
            squares: vec![2.0, 5.0, 4.0, 9.0],
            failed: None,
        };
        // Differences 1, 3, 1, 3: deviation √(4/3), over √4
        let error = standard_error(&candidate, &[1.0, 2.0, 3.0, 6.0]);
        assert!((error - (1.0f64 / 3.0).sqrt()).abs() < 1e-15, "{error}");
        candidate.squares.pop();
        assert_eq!(standard_error(&candidate, &[1.0, 2.0, 3.0, 6.0]), 0.0);
    }
}

//! A fit with one additional element.

use super::extension::{Extended, Extension, Fitted, Measure, Said, Site, Telling};
use super::{stamp, widened};
use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::Residuals;
use crate::fit::asked::run::{Extra, Nuisance};
use crate::fit::limits::{
    CAUSE_ALIKE, CAUSE_DIFFERENCE, CAUSE_EXPLAINS, CAUSE_MOST_STEPS, CAUSE_REACH, CAUSE_SLOW, CAUSE_SLOW_STEPS,
    CAUSE_STEPS, ROUGH_TOLERANCE, TRIAL_FIT_ITERATIONS,
};
use crate::fit::search::least_squares::{minimise, resume};
use crate::fit::search::point::{Ending, Minimum, Options};
use crate::fit::search::starts::{end_in_windows, is_noise, times_noise};
use crate::fit::trust::doubts::{Cause, Size};
use crate::fit::trust::uncertainty::Judged;
use crate::machine::Machine;
use crate::parameter;
use crate::solve::Flow;
use rayon::prelude::*;
use std::cell::OnceCell;

/// A model with one additional element, and the state of its search.
#[derive(Clone)]
pub(super) struct Tried<'a> {
    row: &'static Extension,
    extended: Extended,
    problem: Problem<'a>,
    best: Minimum,
    /// The fit with fewer free parameters, from whose end this one begins.
    before: Option<Box<Self>>,
    is_whole: bool,
    /// What [`Tried::advanced`] returns, if known already.
    ahead: Option<Option<Box<Self>>>,
    promise: OnceCell<f64>,
    judged: OnceCell<Option<Judged>>,
}

/// A start of an element, ranked by the cost that the linear model predicts there.
pub(super) struct Start {
    row: &'static Extension,
    extended: Extended,
    /// The predicted cost; zero if starts are not ranked.
    pub promised: f64,
}

impl Start {
    /// `None` if the model cannot simulate the logs. `is_ranked`: without, the cost is not predicted.
    pub fn new(site: &Site, row: &'static Extension, extended: Extended, is_ranked: bool) -> Option<Self> {
        if !is_ranked {
            return Some(Self { row, extended, promised: 0.0 });
        }
        let best = match site.is_anew {
            true => in_windows(site, &extended)?.1,
            false => Tried::from(site, row, extended.clone(), (&site.found.problem, &site.found.best.x))?.best,
        };
        Some(Self { row, extended, promised: best.cost - best.promise() })
    }

    /// The row of the table and the part of the machine that has the element.
    pub fn kind(&self) -> (&'static str, bool, &str) {
        self.extended.kind(self.row)
    }
}

/// The logs in windows with an element, and the linear model at the end of the fit without it.
fn in_windows<'a>(site: &Site<'_, 'a>, extended: &Extended) -> Option<(Problem<'a>, Minimum)> {
    let windows = site.windows()?;
    let plan = Plan { windows: windows.plan.windows, ..extended.plan.clone() };
    let mut problem = Problem::new(&extended.case, &plan).ok()?.stopped_by(site.found.problem.stop());
    problem.weigh_by(&windows.noise);
    let mut start = begin(&problem, &extended.telling, (&windows.problem, &windows.x))?;
    for (j, own) in problem.parameters.iter().enumerate() {
        let known = windows.problem.parameters.iter().position(|other| other.name == own.name);
        start[j] = known.map_or(start[j], |known| problem.variable(j, windows.problem.value(known, windows.x[known])));
    }
    let bounds = problem.bounds();
    let best = Minimum::linearised(&mut problem, &start, &bounds)?;
    Some((problem, best))
}

/// The start of a problem with an element: variables of single runs begin at those of another fit to the same logs.
fn begin(problem: &Problem, telling: &Telling, (other, x): (&Problem, &[f64])) -> Option<Vec<f64>> {
    let mut start = problem.start();
    for index in 0..problem.runs.len().min(other.runs.len()) {
        let known = other.own_variables(index);
        for (j, extra) in problem.own_variables(index) {
            let known = known.iter().find(|(_, known)| known.what == extra.what);
            start[j] = known.map_or(start[j], |(known, _)| x[*known]);
        }
    }
    if let Telling::Nuisance(what, value) = telling {
        let place = problem.shared.iter().position(|extra| extra.what == *what)?;
        let Extra { start: zero, unit, .. } = problem.shared[place];
        start[problem.parameters.len() + place] = (value - zero) / unit;
    }
    (start.len() == problem.variables()).then_some(start)
}

impl<'a> Tried<'a> {
    /// The result of the first steps from the end of the fit without the element, or from a search in windows;
    /// `None` if the model cannot simulate the logs. Steps of curved friction, which take long, are not taken where the
    /// linear model at the start shows that they will not fall below `goal`.
    pub fn begun(site: &Site<'_, 'a>, start: Start, goal: f64) -> Option<Self> {
        let Start { row, extended, .. } = start;
        let mut begun = Self::from(site, row, extended, (&site.found.problem, &site.found.best.x))?;
        if site.is_anew {
            let Self { extended: Extended { case, plan, .. }, problem, best, .. } = &mut begun;
            let windows = end_in_windows(case, plan, problem, &best.x)?;
            let (mut start, globals) = (best.x.clone(), problem.globals());
            start[..globals].copy_from_slice(&windows.x[..globals]);
            let bounds = problem.bounds();
            *best = Minimum::linearised(problem, &start, &bounds)?;
        }
        let before = site.found.best.cost;
        let gain = before - (begun.cost() - begun.best.promise());
        if row.is_curved && before - CAUSE_REACH * gain > goal {
            return None;
        }
        begun.best = descend(&mut begun.problem, begun.best, CAUSE_STEPS, f64::INFINITY)?;
        Some(begun)
    }

    /// The start of a fit of the machine of a case with the element; variables of single runs begin at those of
    /// another fit to the same logs. `None` if the model cannot simulate the logs, or not in a reasonable time.
    fn from(
        site: &Site<'_, 'a>,
        row: &'static Extension,
        extended: Extended,
        (other, x): (&Problem, &[f64]),
    ) -> Option<Self> {
        let mut problem = Problem::new(&extended.case, &extended.plan).ok()?.stopped_by(site.found.problem.stop());
        let noise: Vec<_> = problem.quantities().iter().map(|&own| (own, site.deviation(own))).collect();
        problem.swings = site.found.problem.swings;
        problem.weigh_by(&noise);
        let start = begin(&problem, &extended.telling, (other, x))?;
        if problem.is_stopped() {
            return None;
        }
        if row.is_curved {
            problem.steps(&start, CAUSE_MOST_STEPS)?;
        }
        let bounds = problem.bounds();
        let best = Minimum::linearised(&mut problem, &start, &bounds)?;
        Some(Self {
            row,
            extended,
            problem,
            best,
            before: None,
            is_whole: false,
            ahead: None,
            promise: OnceCell::new(),
            judged: OnceCell::new(),
        })
    }

    /// True if what [`Tried::advanced`] returns is known.
    pub fn is_ahead(&self) -> bool {
        self.ahead.is_some()
    }

    /// Continues these fits side by side; each is as it was until [`Tried::advanced`] tells its end.
    pub fn look_ahead(site: &Site<'_, 'a>, all: Vec<&mut Self>) {
        let work: Vec<Self> = all.iter().map(|tried| Self::clone(tried)).collect();
        let ends: Vec<_> = work.into_par_iter().map(|tried| tried.advanced(site).map(Box::new)).collect();
        all.into_iter().zip(ends).for_each(|(tried, end)| tried.ahead = Some(end));
    }

    /// Continues the fit: to convergence, or, where parameters are free later, to the start of the fit with them, and
    /// then to its end. `None` if the model fails.
    pub fn advanced(mut self, site: &Site<'_, 'a>) -> Option<Self> {
        if let Some(end) = self.ahead.take() {
            return end.map(|end| *end);
        }
        // It is continued with the parameters that are free later only if it explains something by then.
        let most = (1.0 - CAUSE_EXPLAINS) * site.found.best.cost;
        let goal = if self.extended.later.is_empty() { f64::INFINITY } else { most };
        self.best = descend(&mut self.problem, self.best, TRIAL_FIT_ITERATIONS, goal)?;
        self.is_whole = true;
        if let Some(before) = self.before.take() {
            return Some(if before.cost() <= self.cost() { *before } else { self });
        }
        let later = std::mem::take(&mut self.extended.later);
        if later.is_empty() || self.cost() > most {
            return Some(self);
        }
        let (case, mut plan) = self.case_and_plan();
        plan.free.extend(later.iter().map(|(key, _)| key.clone()));
        plan.bounds.extend(later);
        let extended = Extended { case, plan, later: Vec::new(), ..self.extended.clone() };
        match Self::from(site, self.row, extended, (&self.problem, &self.best.x)) {
            Some(further) => Some(Self { before: Some(Box::new(self)), ..further }),
            None => Some(self),
        }
    }

    /// True if the fit has ended.
    pub fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// The least cost that the fit may end with: with parameters that are free later, anything.
    pub fn least(&self) -> f64 {
        match self.is_whole {
            true => self.cost(),
            false if self.extended.later.is_empty() => {
                self.cost() - CAUSE_REACH * self.promise.get_or_init(|| self.best.promise())
            }
            false => 0.0,
        }
    }

    /// ½ Σ r²
    pub fn cost(&self) -> f64 {
        self.best.cost
    }

    /// The row of the table, the side on which the sensor is, and the part of the machine, one of several.
    pub fn kind(&self) -> (&'static str, bool, &str) {
        self.extended.kind(self.row)
    }

    /// True if its residuals are no larger than the noise of the logs.
    pub fn is_noise(&self) -> bool {
        is_noise(&self.problem, &self.best)
    }

    /// True if the logs may hardly tell another element of a machine of several coordinates from this one, by the least
    /// that its fit may end with: with n values, of which slow noise leaves n/i², the logarithm of the likelihood is
    /// less by n/i² ln(C′/C)/2.
    pub fn may_be_like(&self, judged: &Judged, other: &Self) -> bool {
        let is_other = !self.problem.machine.has_one_coordinate() && self.kind() != other.kind();
        let n = self.problem.counted() as f64 / (judged.inflation * judged.inflation).max(1.0);
        is_other && are_alike(n, self.cost(), other.least())
    }

    /// Information of the logs on it.
    pub fn judged(&self) -> Option<&Judged> {
        let Minimum { residuals, jacobian, x, at_bound, .. } = &self.best;
        let judged = || Judged::new(&self.problem, residuals, jacobian, x, at_bound);
        self.judged.get_or_init(judged).as_ref()
    }

    /// True if its residuals are noise: no larger than that of the logs, or white.
    pub fn leaves_noise(&self) -> bool {
        self.is_noise() || self.judged().is_some_and(|judged| !judged.is_coloured())
    }

    /// The machine with the element.
    fn machine(&self, x: &[f64]) -> Machine {
        self.problem.stage_at(x)
    }

    /// Index of the variable whose size shows the element.
    fn telling(&self) -> Option<usize> {
        match &self.extended.telling {
            Telling::Parameter(key) | Telling::Differs(key) | Telling::Above(key, _) => {
                self.problem.parameters.iter().position(|own| own.name == *key)
            }
            Telling::Nuisance(what, _) => {
                let place = self.problem.shared.iter().position(|extra| extra.what == *what);
                place.map(|place| self.problem.parameters.len() + place)
            }
            Telling::Apart(_) => None,
        }
    }

    /// The value of that variable, SI.
    fn value(&self, j: usize) -> f64 {
        match self.problem.shared.get(j.wrapping_sub(self.problem.parameters.len())) {
            Some(extra) => extra.start + extra.unit * self.best.x[j],
            None => self.problem.value(j, self.best.x[j]),
        }
    }

    /// The size of the element, and the number that it is above, SI.
    fn size(&self) -> [f64; 2] {
        let value = self.telling().map_or(0.0, |j| self.value(j));
        match &self.extended.telling {
            Telling::Above(_, key) => {
                let least = parameter::value(&self.machine(&self.best.x), key).unwrap_or(0.0);
                [value - least, least]
            }
            _ => [value, 0.0],
        }
    }

    /// Size of the element in standard errors; for a logarithmic variable, the inverse of its error.
    pub fn standard_errors(&self, judged: &Judged) -> f64 {
        if let Telling::Apart(names) = &self.extended.telling {
            return self.apart(judged, names);
        }
        if let Telling::Above(key, other) = &self.extended.telling {
            let above = |x: &[f64]| {
                let machine = self.machine(x);
                Some(parameter::value(&machine, key)? - parameter::value(&machine, other)?)
            };
            let error = self.propagated(judged, &above);
            return if error > 0.0 { self.size()[0] / error } else { 0.0 };
        }
        let Some(j) = self.telling() else { return 0.0 };
        let Some(error) = judged.covariance.error(j).filter(|error| *error > 0.0) else { return 0.0 };
        let differs = matches!(self.extended.telling, Telling::Differs(_));
        match self.problem.shared.get(j.wrapping_sub(self.problem.parameters.len())) {
            // The variable is zero at the value of the case.
            None if self.problem.is_log(j) && !differs => 1.0 / error,
            None => self.best.x[j].abs() / error,
            Some(extra) => self.value(j).abs() / (error * extra.unit),
        }
    }

    /// The largest difference of one of these parameters from the first, in standard errors.
    fn apart(&self, judged: &Judged, names: &[String]) -> f64 {
        let place = |name: &String| self.problem.parameters.iter().position(|own| own.name == *name);
        let Some(places) = names.iter().map(place).collect::<Option<Vec<usize>>>() else { return 0.0 };
        // A parameter that is held is known.
        let error = |j: usize| judged.covariance.error(j).unwrap_or(0.0);
        let of = |j: usize| {
            let first = places[0];
            let (a, b) = (error(j), error(first));
            // σ² = σ_a² + σ_b² − 2 ρ σ_a σ_b
            let variance = a * a + b * b - 2.0 * judged.covariance.correlation(j, first).unwrap_or(0.0) * a * b;
            let apart = (self.best.x[j] - self.best.x[first]).abs();
            if variance > 0.0 { apart / variance.sqrt() } else { 0.0 }
        };
        places[1..].iter().map(|&j| of(j)).fold(0.0, f64::max)
    }

    /// True if logs have values of their own.
    pub fn is_apart(&self) -> bool {
        !self.extended.plan.separate.is_empty()
    }

    /// The case with the element, its fitted machine, and its free parameters.
    pub fn case_and_plan(&self) -> (Case, Plan) {
        let case = Case { machine: self.machine(&self.best.x), ..self.extended.case.clone() };
        (case, self.extended.plan.clone())
    }

    /// The delay of inputs, in intervals between samples: the mean of all, zero without any.
    pub fn delay(&self) -> f64 {
        self.problem.delay(&self.best.x)
    }

    /// The element in words, without its scatter.
    pub fn words(&self, site: &Site) -> String {
        let [value, least] = self.size();
        let fitted = Fitted { machine: self.machine(&self.best.x), sizes: &[], value, least, scatter: None };
        (self.row.words)(site, &self.extended, &fitted).words
    }

    /// The cause with its sizes, and what the logs hardly tell from it; `None` if its sizes are not determined.
    pub fn told(
        &self,
        site: &Site,
        judged: &Judged,
        ([explained, standard_errors], better): ([f64; 2], [usize; 2]),
        others: &[String],
    ) -> Option<Cause> {
        let (x, base) = (&self.best.x, &site.found.problem);
        let error = |j: usize| judged.covariance.error(j);
        let is_new = |name: &str| !base.parameters.iter().any(|other| other.name == name);
        let mut parameters = Vec::new();
        for (j, own) in self.problem.parameters.iter().enumerate().filter(|(_, own)| is_new(&own.name)) {
            let value = self.problem.value(j, x[j]);
            let error = error(j).map_or(f64::INFINITY, |error| error * self.problem.slope(j, value).abs());
            parameters.push(match self.extended.size.filter(|_| self.telling() == Some(j)) {
                None => Size { name: own.name.clone(), unit: own.unit, value, error },
                Some(Measure { name, unit, per }) => {
                    Size { name: name.into(), unit, value: per * value, error: per.abs() * error }
                }
            });
        }
        let mut scatter = None;
        if let (Telling::Nuisance(what, _), Some(j)) = (&self.extended.telling, self.telling()) {
            let own = self.problem.shared[j - self.problem.parameters.len()];
            let error = error(j).map_or(f64::INFINITY, |error| error * own.unit);
            let unit = what.unit(&site.machine);
            parameters.push(Size { name: what.name(&site.machine), unit, value: self.value(j), error });
            let is_delay = matches!(what, Nuisance::Delay(_));
            scatter = is_delay.then(|| stamp::scatter(&self.problem, &self.best.residuals)).flatten();
        }
        if let Some([value, error]) = scatter {
            parameters.push(Size { name: "scatter".into(), unit: "s", value, error });
        }
        let g = base.globals();
        let (mut shift, mut errors) = (vec![0.0; g], vec![0.0; g]);
        let mut estimates = vec![None; g];
        for (j, own) in base.parameters.iter().enumerate() {
            let as_base = |x: &[f64]| own.value_in(&(self.row.without)(site, self.machine(x)));
            let Some(value) = as_base(x).filter(|value| value.is_finite()) else { continue };
            let error = self.propagated(judged, &as_base);
            let slope = base.slope(j, value).abs().max(f64::MIN_POSITIVE);
            let moved = base.variable(j, value) - site.found.best.x[j];
            if !moved.is_finite() || !error.is_finite() {
                continue;
            }
            (shift[j], errors[j]) = (moved, error / slope);
            estimates[j] = Some(Size { name: own.name.clone(), unit: own.unit, value, error });
        }
        let added = widened(&shift, &errors);
        let [value, least] = self.size();
        let fitted = Fitted {
            machine: self.machine(x),
            sizes: &parameters,
            value,
            least,
            scatter: scatter.map(|[deviation, _]| deviation),
        };
        let Said { mut words, add } = (self.row.words)(site, &self.extended, &fitted);
        if !others.is_empty() {
            words = format!("{words}, or {}, which the logs hardly tell apart,", others.join(", or "));
        }
        let belts = judged.identifiability.belts.as_ref().map(|compared| compared.belts.clone());
        let key = self.row.key;
        let times_noise = times_noise(&self.problem, &self.best);
        Some(Cause {
            key,
            words,
            explained,
            standard_errors,
            parameters,
            estimates,
            belts,
            times_noise,
            add,
            better,
            added,
        })
    }

    /// The standard error of a function of the variables: √(gᵀ C g), g its gradient.
    fn propagated(&self, judged: &Judged, value: &dyn Fn(&[f64]) -> Option<f64>) -> f64 {
        let covariance = &judged.covariance;
        let globals = self.problem.globals();
        let places: Vec<(usize, usize)> =
            covariance.free.iter().copied().enumerate().filter(|(_, j)| *j < globals).collect();
        let slope = |j: usize| {
            let h = CAUSE_DIFFERENCE * self.best.x[j].abs().max(1.0);
            let at = |by: f64| {
                let mut moved = self.best.x.clone();
                moved[j] += by;
                value(&moved)
            };
            Some((at(h)? - at(-h)?) / (2.0 * h))
        };
        let gradient: Vec<(usize, f64)> =
            places.iter().map(|&(place, j)| (place, slope(j).unwrap_or(f64::INFINITY))).collect();
        let mut sum = 0.0;
        for (a, ga) in gradient.iter().filter(|(_, g)| *g != 0.0) {
            for (b, gb) in gradient.iter().filter(|(_, g)| *g != 0.0) {
                sum += ga * gb * covariance.matrix[(*a, *b)];
            }
        }
        sum.max(0.0).sqrt()
    }
}

/// True if the likelihoods of `n` values with these costs are hardly less with the other one.
fn are_alike(n: f64, cost: f64, other: f64) -> bool {
    n * (other.max(0.0) / cost).ln() < CAUSE_ALIKE * CAUSE_ALIKE
}

/// True if the last steps of a search, with these costs so far, gained next to nothing.
fn creeps(costs: &[f64]) -> bool {
    let earlier = costs.len().checked_sub(1 + CAUSE_SLOW_STEPS).map(|k| costs[k]);
    earlier.zip(costs.last()).is_some_and(|(earlier, cost)| earlier - cost < CAUSE_SLOW * cost)
}

/// The end of a short search that continues from a point. It ends early where it creeps above the cost `goal`.
fn descend(problem: &mut Problem, from: Minimum, iterations: usize, goal: f64) -> Option<Minimum> {
    let options = Options {
        iterations,
        tolerance: ROUGH_TOLERANCE,
        evolutions: 0,
        rounding: problem.rounding(),
        ..Options::default()
    };
    let bounds = problem.bounds();
    let mut costs = Vec::new();
    let mut watch = |_: &[f64], cost: f64| {
        costs.push(cost);
        if creeps(&costs) && cost > goal { Flow::Stop } else { Flow::Continue }
    };
    let found = match from.ending {
        // Where iterations were used up, its derivatives are those at the point.
        Ending::Failed | Ending::OutOfIterations => resume(problem, from, &bounds, &options, &mut watch),
        Ending::Converged if from.pieces == 1 && from.decrement <= ROUGH_TOLERANCE => return Some(from),
        _ => minimise(problem, &from.x, &bounds, &options, &mut watch),
    };
    let is_there = found.jacobian.nrows() == problem.rows() && found.cost.is_finite();
    let is_stopped = found.ending == Ending::Failed || problem.is_stopped();
    (is_there && !is_stopped).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::super::EXTENSIONS;
    use super::*;
    use crate::case::Experiment;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;

    /// Of 1000 values, a cost that is greater by half a per cent is one of √5 standard errors.
    #[test]
    fn elements_are_alike_up_to_three_standard_errors() {
        assert!(are_alike(1000.0, 70.0, 70.35) && are_alike(1000.0, 70.0, 60.0));
        assert!(!are_alike(1000.0, 70.0, 71.4) && are_alike(200.0, 70.0, 71.4));
    }

    #[test]
    fn a_search_that_gains_half_a_per_cent_in_four_steps_creeps() {
        let falling = |share: f64, steps: i32| (0..=steps).map(|k| (1.0 - share).powi(k)).collect::<Vec<f64>>();
        assert!(creeps(&falling(0.005 / 4.0, 4)) && creeps(&falling(0.005 / 4.0, 9)));
        assert!(!creeps(&falling(0.02 / 4.0, 4)) && !creeps(&falling(0.0, 3)));
    }

    /// Each Jacobian takes several times their steps.
    #[test]
    fn bristles_are_not_tried_on_logs_that_take_too_many_steps() {
        let tried = |logs: usize| {
            let (mut case, plan) = case(false);
            let one = case.experiments.remove(0);
            case.experiments = (0..logs).map(|k| Experiment { name: format!("log {k}"), ..one.clone() }).collect();
            let plan = Plan { free: vec!["cart.friction.coulomb".into()], ..plan };
            let found = at_start(Problem::new(&case, &plan).unwrap());
            let site = Site::new(&case, &plan, &found);
            let row = EXTENSIONS.iter().find(|row| row.key == "lugre").unwrap();
            let extended = (row.tries)(&site).remove(0);
            Tried::from(&site, row, extended, (&found.problem, &found.best.x)).is_some()
        };
        // Some 500 steps for each.
        assert_eq!([20, 60].map(tried), [true, false]);
    }
}

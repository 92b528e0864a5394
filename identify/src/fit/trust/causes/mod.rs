//! Missing elements: the model is fitted once more with one additional element.
//!
//! Each [`Extension`] is a row of a table. All of them take a few damped Gauss-Newton steps from the end of the fit,
//! which ranks them. The best are then fitted completely, the lowest cost first, until one leaves white residuals or no
//! other can end lower. With the costs C of the fit and C′ of the fit with the element, it explains
//!
//! ```text
//! 1 − C′/C
//! ```
//!
//! of the residuals. An element is accepted if its size differs significantly from zero, and if the fit with it to
//! parts of the logs predicts the other parts better. With the distance d of the estimates from those with it,
//! intervals of half-width h become √(h² + 2 (d² + h′²)) ≥ d + h′, h′ that of the fit with the element.
//!
//! On a machine of several coordinates, each drive, sensor or slide may have an element: the linear model predicts the
//! costs of all, and only those with the least take steps. Such a machine swings out of step with a log that a wrong
//! model cannot follow, and its fit ends anywhere. Where it does not end within the noise, elements are ranked in short
//! windows, and begin with the values of the case and a search in windows, as the fit itself did, until one leaves
//! noise.

mod amplifier;
mod apart;
mod bristles;
mod drive;
mod extension;
mod force;
mod gear;
mod sensor;
mod stamp;
mod tried;
mod yaw;

use super::doubts::{Cause, OtherLaw};
use super::parts::{Fold, Parts, errors};
use super::uncertainty::Judged;
use crate::case::{Case, Plan};
use crate::fit::asked::run::FittedLog;
use crate::fit::limits::{
    CAUSE_ERRORS, CAUSE_EXPLAINS, CAUSE_MOST_VALUES, CAUSE_NEAR, CAUSE_RIVAL, CAUSES_FITTED, CAUSES_STEPPED,
    HELD_OUT_SHOWS, NORMAL, SAME_MINIMUM, STARTS_FITTED,
};
use crate::fit::search::starts::{Effort, Searched, is_noise};
use crate::machine::Machine;
use extension::{Extended, Extension, Fitted, On, Said, Site};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use tried::{Start, Tried};

/// All elements.
const EXTENSIONS: &[Extension] = &[
    row("spring", On::Axis, gear::springs, gear::spring_words, gear::without),
    row("play", On::Axis, gear::plays, gear::play_words, gear::without),
    row("sensor_play", On::Any, sensor::plays, sensor::words, as_it_is),
    row("drive", On::Gantry, drive::numbers, drive::words, as_it_is),
    row("sensor_scale", On::Gantry, sensor::scales, sensor::scale_words, as_it_is),
    row("delay", On::Any, stamp::delays, stamp::words, as_it_is),
    row("drive_delay", On::Gantry, stamp::drive_delays, stamp::drive_words, as_it_is),
    row("limit", On::Any, amplifier::limits, amplifier::limit_words, amplifier::without_limit),
    row("inductance", On::Any, amplifier::inductances, amplifier::inductance_words, amplifier::without_inductance),
    row("drag", On::Any, force::drags, force::drag_words, force::without),
    row("stribeck", On::Any, force::falls, force::fall_words, force::without_fall),
    row("breakaway", On::Gantry, force::breakaways, force::breakaway_words, force::without_breakaway),
    Extension { is_curved: true, ..row("lugre", On::Axis, bristles::bend, bristles::words, bristles::without) },
    row("load", On::Any, force::loads, force::load_words, as_it_is),
    row("apart", On::Axis, apart::apart, apart::words, as_it_is),
    Extension { is_curved: true, ..row("yaw", On::Gantry, yaw::bearings, yaw::words, yaw::without) },
];

const fn row(
    key: &'static str,
    on: On,
    tries: fn(&Site) -> Vec<Extended>,
    words: fn(&Site, &Extended, &Fitted) -> Said,
    without: fn(&Site, Machine) -> Machine,
) -> Extension {
    Extension { key, on, is_curved: false, tries, words, without }
}

fn as_it_is(_: &Site, machine: Machine) -> Machine {
    machine
}

/// The element that explains most of the residuals; `None` if none is accepted, or if the friction law `law` explains
/// more.
pub(crate) fn cause(case: &Case, plan: &Plan, found: &Searched, law: Option<&OtherLaw>) -> Option<Cause> {
    let site = Site::new(case, plan, found);
    let before = found.best.cost;
    // The gain of a law is of Σ r², and the cost is half of that.
    let most = ((1.0 - CAUSE_EXPLAINS) * before).min(before - 0.5 * law.map_or(0.0, |law| law.gain));
    let mut folds = Folds::new(&site);
    let mut open = begun(&site, false, most);
    // The cost below which curved friction was looked for.
    let mut curved = f64::NEG_INFINITY;
    loop {
        let whole = open.iter().filter(|tried| tried.is_whole()).map(Tried::cost).fold(most, f64::min);
        open.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        let best = open.iter().find(|tried| tried.is_whole()).filter(|tried| tried.cost() <= most);
        let is_settled = best.is_some_and(Tried::leaves_noise);
        // What explains all but noise needs no rival; otherwise those that may end lower are fitted, too. Runs of
        // curved friction take long, and come last.
        let is_rival = |tried: &Tried| !tried.is_whole() && tried.least() < whole;
        let rival = open.iter().position(is_rival);
        if let Some(k) = rival.filter(|_| !is_settled) {
            if !open[k].is_ahead() {
                // Those whose turn may come next are fitted beside it.
                let beside = open
                    .iter_mut()
                    .filter(|tried| is_rival(tried) && !tried.is_ahead())
                    .take(rayon::current_num_threads());
                Tried::look_ahead(&site, beside.collect());
            }
            let further = open.remove(k).advanced(&site);
            open.extend(further);
            continue;
        }
        if !is_settled && curved < whole {
            let found = begun(&site, true, whole);
            curved = if found.is_empty() { whole } else { f64::INFINITY };
            open.extend(found);
            continue;
        }
        best?;
        let first = open.iter().position(Tried::is_whole)?;
        let tried = open.remove(first);
        let explained = 1.0 - tried.cost() / before;
        let known = tried.judged();
        let standard_errors = known.map_or(0.0, |known| tried.standard_errors(known));
        let better = if standard_errors < CAUSE_ERRORS { None } else { folds.predicts(&tried) };
        if let (Some(known), Some(better)) = (known, better) {
            let rivals = std::mem::take(&mut open).into_iter().filter(|other| tried.may_be_like(known, other));
            let whole = rivals.filter_map(|other| if other.is_whole() { Some(other) } else { other.advanced(&site) });
            let others = whole.filter(|other| tried.may_be_like(known, other)).map(|other| other.words(&site));
            let others: Vec<String> = others.collect();
            return tried.told(&site, known, ([explained, standard_errors], better), &others);
        }
        // Other starts that led to this minimum are refused with it.
        let is_there =
            |other: &Tried| other.kind() == tried.kind() && other.cost() < (1.0 + SAME_MINIMUM) * tried.cost();
        open.retain(|other| !(other.is_whole() && is_there(other)));
    }
}

/// The starts that are fitted completely, after their first steps: the best of each kind, and those that lead elsewhere
/// and explain something already; of those with curved friction the best one if it does. `is_curved`: these, or all
/// others. `goal` is the cost that they have to fall below.
fn begun<'a>(site: &Site<'_, 'a>, is_curved: bool, goal: f64) -> Vec<Tried<'a>> {
    let before = site.found.best.cost;
    let mut ranked: Vec<Tried> = Vec::new();
    let mut noise: Option<f64> = None;
    let mut starts = starts(site, is_curved).into_iter().peekable();
    // Side by side; what follows one that leaves noise may not be needed.
    let beside = if site.is_anew { rayon::current_num_threads() } else { usize::MAX };
    let is_near = |tried: &Tried| tried.cost() < CAUSE_NEAR * before;
    'all: while starts.peek().is_some() {
        let some: Vec<Start> = starts.by_ref().take(beside).collect();
        let step = |start: Start| (start.promised, Tried::begun(site, start, goal).filter(is_near));
        for (promised, tried) in some.into_par_iter().map(step).collect::<Vec<_>>() {
            // Elements that the logs hardly tell from one that leaves noise are fitted, too.
            if noise.is_some_and(|noise| promised > CAUSE_RIVAL * noise) {
                break 'all;
            }
            let Some(tried) = tried else { continue };
            if site.is_anew && tried.is_noise() {
                noise = noise.or(Some(promised));
            }
            ranked.push(tried);
        }
    }
    ranked.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    let most = (1.0 - CAUSE_EXPLAINS) * before;
    let mut starts: Vec<(usize, Tried)> = Vec::new();
    for tried in ranked {
        let own = starts.iter().filter(|(_, other)| other.kind() == tried.kind());
        let is_new = own.clone().all(|(_, other)| tried.cost() > (1.0 + SAME_MINIMUM) * other.cost());
        let count = own.count();
        let is_asked = match is_curved {
            true => count == 0 && tried.cost() < most,
            false => count == 0 || is_new && count < STARTS_FITTED && tried.cost() < most,
        };
        if is_asked {
            starts.push((count, tried));
        }
    }
    starts.sort_by_key(|(count, _)| *count);
    starts.truncate(CAUSES_FITTED);
    starts.into_iter().map(|(_, tried)| tried).collect()
}

/// Starts of all elements, in the order of the table. Machines of several coordinates have many parts that may have an
/// element: of these starts, those with the least predicted costs, the least first, one for each part.
fn starts(site: &Site, is_curved: bool) -> Vec<Start> {
    let is_ranked = !site.machine.has_one_coordinate();
    let rows = EXTENSIONS.iter().filter(|row| row.is_curved == is_curved && row.on.takes(&site.machine));
    let tries = rows.flat_map(|row| (row.tries)(site).into_iter().map(move |extended| (row, extended)));
    let tries: Vec<(&Extension, Extended)> = tries.collect();
    let start = |(row, extended)| Start::new(site, row, extended, is_ranked);
    let mut starts: Vec<Start> = tries.into_par_iter().filter_map(start).collect();
    if is_ranked {
        starts.sort_by(|a, b| a.promised.total_cmp(&b.promised));
        let mut taken: Vec<Start> = Vec::new();
        for start in starts {
            if taken.iter().all(|other| other.kind() != start.kind()) {
                taken.push(start);
            }
        }
        taken.truncate(CAUSES_STEPPED);
        starts = taken;
    }
    starts
}

/// True if missing elements are searched for: the residuals are not white, or, of a machine of several coordinates,
/// above the noise, and the fit supports it.
pub(crate) fn is_asked(case: &Case, plan: &Plan, found: &Searched, judged: &Judged) -> bool {
    let problem = &found.problem;
    // Noise of a narrow band, such as the swing of a belt, may determine parameters as well as white noise does.
    let is_astray = || !case.machine.has_one_coordinate() && !is_noise(problem, &found.best);
    (judged.is_coloured() || is_astray())
        && case.machine.stepper().is_none()
        && plan.windows.is_none()
        && plan.until.is_none()
        && plan.separate.is_empty()
        && !plan.huber
        && !problem.is_stopped()
        && !problem.runs.iter().any(FittedLog::is_closed)
        && problem.counted() <= CAUSE_MOST_VALUES
        && problem.machine.is_piecewise_linear()
        && !problem.parameters.is_empty()
}

/// Parts of the logs that are held out in turn, and what the case without an element makes of them.
struct Folds<'s, 'a> {
    site: &'s Site<'s, 'a>,
    case: Case,
    plan: Plan,
    /// The parts that [`compare`](crate::fit::compare) has, and blocks of every log, which values of single logs need.
    sets: [Without; 2],
}

/// Parts, and the mean squared errors of those without an element, as far as they are known.
struct Without {
    parts: Parts,
    means: Vec<Option<f64>>,
}

impl<'s, 'a> Folds<'s, 'a> {
    fn new(site: &'s Site<'s, 'a>) -> Self {
        let case = Case { machine: site.machine.clone(), ..site.case.clone() };
        let plan = Plan { starts: 1, ..site.plan.clone() };
        let of = |parts| Without { parts, means: Vec::new() };
        let sets = [of(Parts::new(&case, &plan)), of(Parts::blocks(&case, &plan))];
        Self { site, sets, case, plan }
    }

    /// Mean squared error of a part by a fit to the others, in units of the residuals; `None` if it fails.
    fn mean(&self, case: &Case, plan: &Plan, delay: f64, (fold, is_cut): (&Fold, bool)) -> Option<f64> {
        let mut effort = Effort::of_part(Some(delay));
        // Predictions need no exact end.
        effort.options.sharp = false;
        let stop = self.site.found.problem.stop();
        let (found, _) = errors(case, plan, fold, (is_cut, &effort), stop).ok()?;
        let own = found.iter().map(|(quantity, squares, count)| {
            let deviation = self.site.deviation(*quantity);
            (squares / (deviation * deviation), *count)
        });
        let (squares, count) = own.fold((0.0, 0), |(s, n), (squares, count)| (s + squares, n + count));
        Some(squares / count.max(1) as f64)
    }

    /// Number of parts of the logs that a fit with an element to the other parts predicts better, and number of parts;
    /// `None` if the prediction is not clearly better.
    fn predicts(&mut self, tried: &Tried) -> Option<[usize; 2]> {
        let (with, own) = tried.case_and_plan();
        // Few logs are cut into blocks in any case.
        let set = usize::from(tried.is_apart() && !self.sets[0].parts.is_cut);
        let parts = if set == 1 { Parts::blocks(&with, &own) } else { Parts::new(&with, &own) };
        let count = self.sets[set].parts.folds.len().min(parts.folds.len());
        if count < 2 {
            return None;
        }
        let delay = tried.delay();
        let mut gains = Vec::new();
        for k in 0..count {
            let Without { parts: before, means } = &self.sets[set];
            let without = || match means.get(k) {
                Some(known) => *known,
                None => {
                    let fold = (&before.folds[k], before.is_cut);
                    self.mean(&self.case, &self.plan, self.site.found.delay(), fold)
                }
            };
            let with = || self.mean(&with, &own, delay, (&parts.folds[k], parts.is_cut));
            let (without, with) = rayon::join(without, with);
            if means.len() == k {
                self.sets[set].means.push(without);
            }
            let (with, without) = (with?, without?);
            // ln of the ratio, since a part in which a start fails has errors of another magnitude.
            gains.push((without / with).ln());
            if gains.iter().filter(|gain| **gain <= 0.0).count() > 1 {
                return None;
            }
        }
        let n = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / n;
        let variance = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>() / (n - 1.0) / n;
        let better = gains.iter().filter(|gain| **gain > 0.0).count();
        // A part in which a start fails has errors of another magnitude: the others are then compared with what the
        // element explains of the whole, ln C/C′.
        gains.sort_by(f64::total_cmp);
        let median = gains[(gains.len() - 1) / 2];
        let whole = (self.site.found.best.cost / tried.cost()).ln();
        let is_much = mean > variance.sqrt() || median > HELD_OUT_SHOWS * whole;
        let is_clear = better + 1 >= gains.len() && is_much;
        is_clear.then_some([better, gains.len()])
    }
}

/// Covariance to add so that intervals contain estimates shifted by `shift` with these errors.
fn widened(shift: &[f64], errors: &[f64]) -> DMatrix<f64> {
    let d = DVector::from_column_slice(shift);
    let own = DMatrix::from_diagonal(&DVector::from_iterator(errors.len(), errors.iter().map(|e| e * e)));
    // (|d| + h′)² ≤ 2 (d² + h′²)
    &d * d.transpose() * (2.0 / (NORMAL * NORMAL)) + own * 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::Problem;
    use crate::fit::asked::problem::tests::case;
    use crate::fit::search::starts::tests::at_start;

    #[test]
    fn elements_are_looked_for_where_slow_noise_widens_the_errors() {
        let (case, plan) = case(false);
        let found = at_start(Problem::new(&case, &plan).unwrap());
        let best = &found.best;
        let judged = Judged::new(&found.problem, &best.residuals, &best.jacobian, &best.x, &best.at_bound).unwrap();
        let asked = |inflation: f64| is_asked(&case, &plan, &found, &Judged { inflation, ..judged.clone() });
        assert_eq!([1.0, 1.05, 1.2, 5.0].map(asked), [false, false, true, true]);
    }
}

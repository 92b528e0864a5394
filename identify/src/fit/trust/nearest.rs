//! The machine nearest to that of the case among all that fit the logs equally well.
//!
//! A search ends anywhere along an undetermined direction. With its end x₁, the values x₀ of the case, D as 100 % of
//! each variable, the undetermined directions V, and the cost C, the minimum of
//!
//! ```text
//! min C(x) + ½ ρ² ‖Vᵀ D⁻¹ (x − x₀)‖²        ½ ρ² ‖Vᵀ D⁻¹ (x₁ − x₀)‖² = ε C(x₁)
//! ```
//!
//! is the point of the identified set nearest to x₀, if that set is a plane; determined directions are optimised again.
//! The sum is at most that at x₁, so C grows by at most a relative ε, however well the logs determine these directions.
//! A curved set is approached in rounds, each with the directions at its starting point.

use super::findings::findings;
use super::found::Fit;
use super::result::result;
use super::uncertainty::Judged;
use super::{causes, other_laws, sub_records, trials};
use crate::case::{Case, Plan};
use crate::error::Result;
use crate::fit::asked::problem::{Problem, Stop};
use crate::fit::asked::residuals::{Bounds, Differences, Residuals};
use crate::fit::limits::{
    COST_GROWTH, FAR_BEYOND_NOISE, HUBER, NEAREST_ALL, NEAREST_FAR, NEAREST_ITERATIONS, NEAREST_ROUNDS, NEAREST_SETTLED,
};
use crate::fit::search::least_squares::minimise;
use crate::fit::search::point::{Ending, Minimum, Options, cost_of};
use crate::fit::search::starts::{Effort, Searched, Work, search_as_far};
use crate::log::Survey;
use crate::machine::Machine;
use crate::solve::Flow;
use nalgebra::{DMatrix, DVector};

/// A search that has settled on the point nearest to the values of the case.
pub(crate) struct Settled<'a> {
    pub searched: Searched<'a>,
    /// The information of the logs at the best point with all variables, if known already.
    seen: Option<Judged>,
}

/// The result of a search that has settled.
pub(crate) struct Assessed {
    /// The fit with its findings.
    pub fit: Fit,
    /// The surveys of the logs.
    pub surveys: Vec<Survey>,
    /// The information of the logs; `None` if numbers fail.
    pub judged: Option<Judged>,
}

impl Settled<'_> {
    /// The result, with findings of the logs and of the fit.
    pub fn assessed(&self, case: &Case, plan: &Plan) -> Assessed {
        let surveys = trials::surveys(case, plan, &self.searched);
        let judged = self.judged(case, plan, &surveys);
        let mut fit = result(&self.searched, judged.as_ref());
        fit.times_noise = self.searched.times_noise().map(|(_, times)| times).fold(0.0, f64::max);
        fit.findings = findings(case, plan, &self.searched, &fit, &surveys);
        Assessed { fit, surveys, judged }
    }

    /// The information of the logs there, with the tests of their parts and of the friction law, and of missing
    /// elements unless these `surveys` of the logs explain the residuals; `None` if numbers fail.
    fn judged(&self, case: &Case, plan: &Plan, surveys: &[Survey]) -> Option<Judged> {
        let Minimum { residuals, jacobian, x, at_bound, .. } = &self.searched.best;
        let mut judged = match self.seen.as_ref().filter(|_| !at_bound.contains(&true)) {
            Some(seen) => seen.clone(),
            None => Judged::new(&self.searched.problem, residuals, jacobian, x, at_bound)?,
        };
        let disagreement = sub_records::disagreement(case, plan, &self.searched, &judged);
        let other_law = other_laws::other_law(&self.searched, &judged);
        // No element reverses a motion, folds it, or moves an input by more than a delay.
        let found = &self.searched;
        let is_told = |code: &str| surveys.iter().any(|survey| survey.has(code));
        let is_asked = !is_told("magnitude")
            && !is_told("shift")
            && causes::is_asked(case, plan, found, &judged)
            && !trials::is_reversed(case, plan, found);
        let cause = is_asked.then(|| causes::cause(case, plan, found, other_law.as_ref())).flatten();
        let other_law = other_law.filter(|_| cause.is_none());
        judged.widen(disagreement, other_law, cause);
        Some(judged)
    }
}

/// The search of a fit, and of a check.
pub(crate) fn search<'a>(
    case: &Case,
    plan: &Plan,
    stop: Option<Stop<'a>>,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Result<Settled<'a>> {
    search_near(case, &case.machine, plan, stop, watch)
}

/// Searches with undetermined parameters as near to the values of `given` as the logs allow.
pub(crate) fn search_near<'a>(
    case: &Case,
    given: &Machine,
    plan: &Plan,
    stop: Option<Stop<'a>>,
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
) -> Result<Settled<'a>> {
    let whole = Options::default();
    let effort = Effort { options: whole, is_straight: false, is_short: false, delay: None };
    let mut searched = search_as_far(case, plan, stop, &effort, watch)?;
    let is_far = searched.problem.differences > 0 && searched.times_noise().any(|(_, times)| times > FAR_BEYOND_NOISE);
    let Searched { problem, best, work, .. } = &mut searched;
    let huber = if plan.huber { HUBER } else { f64::INFINITY };
    let pull = if is_far { Pull::FAR } else { Pull::WHOLE };
    let iterations = pull.iterations;
    let options = Options { huber, rounding: problem.rounding(), iterations, evolutions: 0, ..whole };
    let mut seen = None;
    if best.ending != Ending::Interrupted {
        let given = problem.point_of(given);
        seen = nearest(problem, best, &given, (&options, pull), watch, work);
    }
    let set = problem.as_set(&best.x);
    if set != best.x {
        (best.x, seen) = (set, None);
    }
    work.simulations = problem.simulations;
    Ok(Settled { searched, seen })
}

/// The effort of moving towards the values of the case.
#[derive(Debug, Clone, Copy)]
struct Pull {
    rounds: usize,
    /// Number of starts of a round.
    tries: usize,
    /// Jacobians of each.
    iterations: usize,
}

impl Pull {
    const WHOLE: Self = Self { rounds: NEAREST_ROUNDS, tries: usize::MAX, iterations: NEAREST_ITERATIONS };
    /// After a search by differences whose residuals are far above the noise.
    const FAR: Self = Self { rounds: 1, tries: 1, iterations: NEAREST_FAR };
}

/// A problem whose variables are pulled towards their start along some directions.
struct Anchored<'p, 'a> {
    problem: &'p mut Problem<'a>,
    /// ρ Vᵀ D⁻¹
    rows: DMatrix<f64>,
    /// ρ Vᵀ D⁻¹ x₀
    at: DVector<f64>,
}

impl Anchored<'_, '_> {
    /// ρ Vᵀ D⁻¹ (x − x₀), into the end of the residuals.
    fn draw(&self, x: &[f64], r: &mut [f64]) {
        let first = r.len() - self.at.len();
        for (k, r) in r[first..].iter_mut().enumerate() {
            *r = self.rows.row(k).iter().zip(x).map(|(row, x)| row * x).sum::<f64>() - self.at[k];
        }
    }

    /// The Jacobian of the problem with the rows of the anchor below.
    fn below(&self, jacobian: DMatrix<f64>, bounds: &Bounds) -> DMatrix<f64> {
        let first = jacobian.nrows();
        let mut whole = jacobian.resize_vertically(first + self.at.len(), 0.0);
        for j in (0..self.rows.ncols()).filter(|&j| !bounds.hold(j)) {
            whole.view_mut((first, j), (self.at.len(), 1)).copy_from(&self.rows.column(j));
        }
        whole
    }

    fn own<'r>(&self, r: &'r mut [f64]) -> &'r mut [f64] {
        let first = r.len() - self.at.len();
        &mut r[..first]
    }
}

impl Residuals for Anchored<'_, '_> {
    fn rows(&self) -> usize {
        self.problem.rows() + self.at.len()
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        self.draw(x, r);
        let own = self.own(r);
        self.problem.evaluate(x, own)
    }

    fn is_exact(&self) -> bool {
        self.problem.is_exact()
    }

    fn jacobian(&mut self, x: &[f64], r: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        let own = &r[..r.len() - self.at.len()];
        let jacobian = self.problem.jacobian(x, own, bounds, how)?;
        Some(self.below(jacobian, bounds))
    }

    fn linearised(&mut self, x: &[f64], r: &mut [f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        self.draw(x, r);
        let own = self.own(r);
        let jacobian = self.problem.linearised(x, own, bounds, how)?;
        Some(self.below(jacobian, bounds))
    }
}

/// Moves a minimum along undetermined directions to the point nearest to `given`, and optimises the rest again. Returns
/// the information of the logs if everything is determined.
fn nearest(
    problem: &mut Problem,
    best: &mut Minimum,
    given: &[f64],
    (options, pull): (&Options, Pull),
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
    work: &mut Work,
) -> Option<Judged> {
    let most = best.cost * (1.0 + NEAREST_ROUNDS as f64 * COST_GROWTH) + f64::MIN_POSITIVE;
    for _ in 0..pull.rounds {
        let none = vec![false; best.x.len()];
        let judged = Judged::new(problem, &best.residuals, &best.jacobian, &best.x, &none)?;
        let lost = judged.identifiability.lost.clone();
        if lost.ncols() == 0 {
            return Some(judged);
        }
        let machine = problem.stage_at(&best.x);
        let whole: Vec<f64> = (0..lost.nrows()).map(|j| problem.whole(&machine, j, best.x[j])).collect();
        let Some(found) = round(problem, best, (given, &whole), &lost, (options, most, pull.tries), watch, work) else {
            break;
        };
        let moved = (0..lost.nrows()).map(|j| ((found.x[j] - best.x[j]) / whole[j]).abs()).fold(0.0, f64::max);
        *best = found;
        if moved < NEAREST_SETTLED {
            break;
        }
    }
    None
}

/// One round with these directions; `None` if its result fits the logs less well.
fn round(
    problem: &mut Problem,
    best: &Minimum,
    (given, whole): (&[f64], &[f64]),
    lost: &DMatrix<f64>,
    (options, most, tried): (&Options, f64, usize),
    watch: &mut dyn FnMut(&[f64], f64) -> Flow,
    work: &mut Work,
) -> Option<Minimum> {
    let (open, globals) = (problem.bounds(), lost.nrows());
    // Vᵀ D⁻¹
    let mut rows = DMatrix::zeros(lost.ncols(), best.x.len());
    for (j, width) in whole.iter().enumerate().take(globals) {
        rows.set_column(j, &(lost.row(j).transpose() / *width));
    }
    let far = &rows * DVector::from_fn(best.x.len(), |j, _| if j < globals { best.x[j] - given[j] } else { 0.0 });
    let distance = far.norm();
    if !distance.is_finite() || distance == 0.0 {
        return None;
    }
    // ½ ρ² ‖Vᵀ D⁻¹ (x₁ − x₀)‖² = ε C(x₁)
    let rho = (2.0 * COST_GROWTH * best.cost).sqrt().max(f64::MIN_POSITIVE) / distance;
    rows *= rho;
    let at = &rows * DVector::from_fn(best.x.len(), |j, _| if j < globals { given[j] } else { 0.0 });

    let hidden: Vec<usize> = (0..globals).filter(|&j| lost.row(j).norm_squared() > NEAREST_ALL).collect();
    let mut held = open.clone();
    let mut kept = best.x.clone();
    for &j in &hidden {
        let value = given[j].clamp(open.low[j], open.high[j]);
        (held.low[j], held.high[j], kept[j]) = (value, value, value);
    }
    // Tries hidden variables as given, then pulled towards their values like the others, then from the start of the
    // case.
    let mut tries = vec![(kept, &held), (best.x.clone(), &open), (given.to_vec(), &open)];
    if hidden.is_empty() {
        tries.remove(0);
    }
    for (from, bounds) in tries.into_iter().take(tried) {
        let mut anchored = Anchored { problem: &mut *problem, rows: rows.clone(), at: at.clone() };
        let found = minimise(&mut anchored, &from, bounds, options, &mut *watch);
        work.iterations += found.iterations;
        work.evaluations += found.evaluations;
        if found.ending == Ending::Interrupted || problem.is_stopped() {
            return None;
        }
        let residuals = found.residuals[..problem.rows()].to_vec();
        let cost = cost_of(&residuals, options.huber);
        if found.ending == Ending::Failed || !cost.is_finite() || cost > most {
            continue;
        }
        let Some(jacobian) = problem.jacobian(&found.x, &residuals, &open, &Differences::Central) else { continue };
        let mut at_bound = found.at_bound;
        hidden.iter().for_each(|&j| at_bound[j] &= !bounds.hold(j));
        return Some(Minimum { x: found.x, residuals, cost, jacobian, at_bound, ..best.clone() });
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::asked::problem::tests::logged;
    use crate::fit::search::starts::tests::at_start;

    /// Of a rigid axis only the total inertia is determined: a search for its parts from `start`, and from its end
    /// towards `given`, with the effort of that.
    fn approached(start: &[f64], given: impl Fn(&Judged, &[f64]) -> Vec<f64>) -> (Searched<'static>, Vec<f64>, Work) {
        let changes = ["belt={ model = \"rigid\" }", "experiment.0.every=10ms", "experiment.0.until=0.5s"];
        let (case, plan) = logged(&changes, false);
        let free = ["cart.mass", "drive_pulley.inertia"].map(String::from).to_vec();
        let mut found = at_start(Problem::new(&case, &Plan { free, ..plan }).unwrap());
        let Searched { problem, best, .. } = &mut found;
        let (bounds, mut x, mut work) = (problem.bounds(), best.x.clone(), Work::default());
        x[..2].copy_from_slice(start);
        let options = Options { rounding: problem.rounding(), ..Options::default() };
        *best = minimise(problem, &x, &bounds, &options, &mut |_, _| Flow::Continue);
        let judged = Judged::new(problem, &best.residuals, &best.jacobian, &best.x, &vec![false; x.len()]).unwrap();
        let given = given(&judged, &best.x);
        let all = nearest(problem, best, &given, (&options, Pull::WHOLE), &mut |_, _| Flow::Continue, &mut work);
        assert!(all.is_none());
        (found, given, work)
    }

    /// Of logarithms a and b with a known sum A eᵃ + B eᵇ, the nearest ones are on its gradient through those given.
    #[test]
    fn a_curved_set_is_approached_in_rounds() {
        let (found, given, _) = approached(&[-1.0, 0.0], |_, x| x.iter().map(|_| -f64::ln(2.0)).collect());
        let (x, machine) = (&found.best.x, found.problem.stage_at(&found.best.x));
        let [way, gradient] = [
            (x[1] - given[1]) / (x[0] - given[0]),
            machine.drive_pulley.inertia / (machine.cart.mass * machine.pulley_radius.powi(2)),
        ];
        // 120 % after the first round, 60 % after the second.
        assert!((way / gradient - 1.0).abs() < 0.3, "{x:?}: {way} {gradient}");
    }

    /// The next one would lead nowhere.
    #[test]
    fn no_round_follows_one_that_hardly_moved() {
        let steps = |far: f64| {
            let beside = |judged: &Judged, x: &[f64]| {
                let lost = judged.identifiability.lost.column(0);
                let moved = |j: usize| if j < 2 { far * lost[j] / lost.amax() } else { 0.0 };
                x.iter().enumerate().map(|(j, x)| x + moved(j)).collect::<Vec<f64>>()
            };
            approached(&[0.0, 0.0], beside).2.iterations
        };
        assert!(steps(1.4e-3) > steps(0.7e-3));
    }
}

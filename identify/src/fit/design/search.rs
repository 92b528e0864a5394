//! The search: points spread over the variables of each kind of input, then an evolution strategy from the best ones.

use super::candidates::{Excitation, SearchLimits, Shape};
use super::criterion::Information;
use super::driven::Driven;
use super::limits::{Limits, Reached};
use super::{Criterion, Task, Undetermined};
use crate::case::parameters;
use crate::case::{Case, Experiment};
use crate::chance::uniform;
use crate::error::{Error, Result};
use crate::fit::asked::residuals::Differences;
use crate::fit::limits::{
    DESIGN_BARREN, FINALISTS, FIRST_POINTS, FIRST_SIGMA, HOPEFUL, MOST_COMPARED, MOST_PERIODS, MOST_ROWS, MOST_VALUES,
    OF_RATE,
};
use crate::fit::search::cmaes;
use crate::machine::{Channel, Machine};
use crate::mechanism::State;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Predicted accuracy of a parameter.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Promise {
    /// Its name.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// The value of the case, for which it is predicted.
    pub value: f64,
    /// Standard error including the error of the model; infinite if not determined.
    pub error: f64,
    /// Standard error relative to the value, or to a typical one if the value is zero.
    pub relative: f64,
    /// Standard error of an exact model, from noise and resolution of the measurement alone.
    pub random: f64,
    /// True if it is in the criterion.
    pub wanted: bool,
}

impl Promise {
    /// True if the experiment determines it.
    pub fn is_determined(&self) -> bool {
        self.error.is_finite()
    }
}

/// The best input of a kind.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Alternative {
    /// The input.
    pub shape: Shape,
    /// The drives that it goes to.
    pub driven: Driven,
    /// The mean relative error.
    pub score: f64,
    /// True if it was searched beyond the first points.
    pub refined: bool,
}

/// An experiment of the case with the same measurement.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Own {
    /// Its name.
    pub name: String,
    /// Length, s.
    pub duration: f64,
    /// The mean relative error.
    pub score: f64,
    /// Number of parameters in the criterion that it determines.
    pub determined: usize,
}

/// The designed experiment.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Designed {
    /// The input.
    pub shape: Shape,
    /// The drives that it goes to.
    pub driven: Driven,
    /// Its name in the case file.
    pub name: String,
    /// The unit of the input.
    pub unit: &'static str,
    /// Length, s.
    pub duration: f64,
    /// Sample interval, s.
    pub every: f64,
    /// Initial state.
    pub initial: State,
    /// Its extremes on the machine of the case.
    pub reached: Reached,
    /// Its limits.
    pub limits: Limits,
    /// Relative error of each free parameter within which the limits hold.
    pub doubt: f64,
    /// Relative error of the model, in every promise.
    pub model_error: f64,
    /// Measured outputs with their noise.
    pub measured: Vec<Channel>,
    /// Its promise for every free parameter.
    pub promises: Vec<Promise>,
    /// The minimised measure.
    pub criterion: Criterion,
    /// Mean relative error by it.
    pub score: f64,
    /// Parameters that it cannot distinguish, with remedies.
    pub undetermined: Undetermined,
    /// The best of each kind, the best first.
    pub alternatives: Vec<Alternative>,
    /// The case's own experiments.
    pub own: Vec<Own>,
    /// Number of inputs tried.
    pub tried: usize,
    /// True if the search was ended early.
    pub interrupted: bool,
}

/// An evaluated input.
struct Judged {
    shape: Shape,
    driven: Driven,
    initial: State,
    reached: Reached,
    information: Information,
    score: f64,
}

/// The best input of these kinds, or of all if the list is empty.
pub(super) fn best(task: &Task, case: &Case, kinds: &[Excitation], watch: &mut dyn FnMut(&str)) -> Result<Designed> {
    let kinds = if kinds.is_empty() { &Excitation::ALL[..] } else { kinds };
    let mut tried = 0;
    let mut found: Vec<(Alternative, Vec<f64>)> = Vec::new();
    for &kind in kinds {
        watch(kind.word());
        let mut best: Option<(Alternative, Vec<f64>)> = None;
        for driven in &task.driven {
            let Some((shape, point, score)) = screened(task, kind, driven, &mut tried) else { continue };
            if best.as_ref().is_none_or(|(best, _)| score < best.score) {
                best = Some((Alternative { shape, driven: driven.clone(), score, refined: false }, point));
            }
        }
        found.extend(best);
        if (task.stop)() && !found.is_empty() {
            break;
        }
    }
    found.sort_by(|a, b| a.0.score.total_cmp(&b.0.score));
    for round in 0..2 {
        let count = if round == 0 { found.len() } else { 1 };
        let least = found.first().map_or(f64::INFINITY, |(best, _)| best.score);
        for (alternative, point) in found.iter_mut().take(count) {
            if (task.stop)() || alternative.score > HOPEFUL * least {
                break;
            }
            let kind = alternative.shape.kind();
            watch(kind.word());
            let from = (&**point, alternative.score);
            if let Some((shape, better, score)) = refined(task, kind, &alternative.driven, from, &mut tried) {
                (alternative.shape, *point, alternative.score) = (shape, better, score);
            }
            alternative.refined = true;
        }
        found.sort_by(|a, b| a.0.score.total_cmp(&b.0.score));
    }
    let doubtful = doubtful(task)?;
    let mut best: Option<Judged> = None;
    for (alternative, _) in found.iter_mut().take(FINALISTS) {
        let Some(judged) = task.finally(alternative.shape, &alternative.driven, &doubtful) else { continue };
        (alternative.shape, alternative.score) = (judged.shape, judged.score);
        if best.as_ref().is_none_or(|best| judged.score < best.score) {
            best = Some(judged);
        }
    }
    let best = best.ok_or_else(|| nothing(task))?;
    found.sort_by(|a, b| a.0.score.total_cmp(&b.0.score));
    let alternatives = found.into_iter().map(|(alternative, _)| alternative).collect();
    Ok(task.told(case, best, alternatives, tried))
}

fn nothing(task: &Task) -> Error {
    let what = match (task.stop)() {
        true => "the search was ended before any input was found",
        false => "no input was found that stays within the limits and moves the cart",
    };
    Error::new(what).next(
        "check with `taut simulate` that the axis moves within its limits; allow more with --travel, \
         --amplitude or --current, or a smaller --margin",
    )
}

fn room(task: &Task) -> SearchLimits {
    let high = (OF_RATE / task.every).min(MOST_PERIODS / task.duration);
    let low = (1.0 / task.duration).min(0.5 * high);
    SearchLimits { input: task.limits.input.0, duration: task.duration, every: task.every, frequencies: [low, high] }
}

/// Value of an input at a point of the unit cube.
fn look(task: &Task, kind: Excitation, driven: &Driven, point: &[f64], tried: &mut usize) -> Option<(Shape, f64)> {
    *tried += 1;
    let (shape, initial, _) = task.fitted(Shape::at(kind, point, &room(task)), driven, &[])?;
    let score = task.information(&driven.inputs(&shape), initial, &Differences::Forward)?.score(task.criterion);
    score.is_finite().then_some((shape, score))
}

/// The best of points spread evenly along each variable, in random order (Latin hypercube).
fn screened(task: &Task, kind: Excitation, driven: &Driven, tried: &mut usize) -> Option<(Shape, Vec<f64>, f64)> {
    let n = kind.numbers();
    let mut random = Pcg64::seed_from_u64(task.seed);
    let orders: Vec<Vec<usize>> = (0..n).map(|_| shuffled(FIRST_POINTS, &mut random)).collect();
    let mut best: Option<(Shape, Vec<f64>, f64)> = None;
    for k in 0..FIRST_POINTS {
        if (task.stop)() {
            break;
        }
        let point: Vec<f64> = orders.iter().map(|order| (order[k] as f64 + 0.5) / FIRST_POINTS as f64).collect();
        if let Some((shape, score)) = look(task, kind, driven, &point, tried)
            && best.as_ref().is_none_or(|(_, _, least)| score < *least)
        {
            best = Some((shape, point, score));
        }
    }
    best
}

fn shuffled(count: usize, random: &mut Pcg64) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        all.swap(i, ((i + 1) as f64 * uniform(random)) as usize);
    }
    all
}

/// The best result of an evolution strategy from a point, if better.
fn refined(
    task: &Task,
    kind: Excitation,
    driven: &Driven,
    (from, score): (&[f64], f64),
    tried: &mut usize,
) -> Option<(Shape, Vec<f64>, f64)> {
    let mut best: Option<(Shape, Vec<f64>, f64)> = None;
    let first = *tried;
    evolved(from, &mut |point| {
        if (task.stop)() || *tried - first >= MOST_VALUES {
            return (f64::INFINITY, false);
        }
        let Some((shape, value)) = look(task, kind, driven, &point, tried) else { return (f64::INFINITY, false) };
        let least = best.as_ref().map_or(score, |(.., least)| *least);
        if value < least {
            best = Some((shape, point, value));
        }
        (value.ln(), value < 0.99 * least)
    });
    best
}

/// Evaluates points of the unit cube by an evolution strategy from one of them.
fn evolved(from: &[f64], evaluate: &mut dyn FnMut(Vec<f64>) -> (f64, bool)) {
    let logit: Vec<f64> = from.iter().map(|share| (share / (1.0 - share)).ln()).collect();
    cmaes::search(from.len(), FIRST_SIGMA, DESIGN_BARREN, &mut |z| {
        evaluate(logit.iter().zip(z.iter()).map(|(a, z)| 1.0 / (1.0 + (-a - z).exp())).collect())
    });
}

/// The machine with each free parameter changed to either side.
fn doubtful(task: &Task) -> Result<Vec<Machine>> {
    if task.doubt == 0.0 {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    for free in parameters(&task.case.machine, &task.plan, &[])? {
        for factor in [1.0 - task.doubt, 1.0 + task.doubt] {
            let mut stage = task.case.machine.clone();
            free.set(&mut stage, (factor * free.start).clamp(free.low, free.high));
            all.push(stage);
        }
    }
    Ok(all)
}

impl Task<'_> {
    /// An input that also keeps the limits on all of these machines, with its information.
    fn finally(&self, shape: Shape, driven: &Driven, doubtful: &[Machine]) -> Option<Judged> {
        let (shape, initial, reached) = self.fitted(shape, driven, doubtful)?;
        // An input that does not break the machine away contains no information.
        if reached.speed == 0.0 {
            return None;
        }
        let information = self.surely(self.information(&driven.inputs(&shape), initial, &Differences::Central)?)?;
        let score = information.score(self.criterion);
        Some(Judged { shape, driven: driven.clone(), initial, reached, information, score })
    }

    fn told(&self, case: &Case, best: Judged, alternatives: Vec<Alternative>, tried: usize) -> Designed {
        let Judged { shape, driven, initial, reached, information, score } = best;
        let known = &information.known;
        let problem = &information.problem;
        let promise = |(j, parameter): (usize, &crate::parameter::Free)| {
            let value = problem.value(j, information.x[j]);
            let random = information.size(j) * known.error[j];
            let whole = if value == 0.0 { information.size(j) } else { value.abs() };
            // √(σ² + ε²) with the error ε of the model
            let error = random.hypot(self.model_error * whole);
            Promise {
                name: parameter.name.clone(),
                unit: parameter.unit,
                value,
                error,
                relative: error / whole,
                random,
                wanted: self.wanted.contains(&j),
            }
        };
        let is_taken = |name: &str| case.experiments.iter().any(|experiment| experiment.name == name);
        let mut name = "designed".to_string();
        for k in 2.. {
            if !is_taken(&name) {
                break;
            }
            name = format!("designed {k}");
        }
        Designed {
            promises: problem.parameters.iter().enumerate().map(promise).collect(),
            undetermined: known.groups.iter().map(|group| (group.clone(), known.choices(problem, group))).collect(),
            name,
            shape,
            driven,
            unit: case.machine.drives[0].amplifier.mode.unit(),
            duration: self.duration,
            every: self.every,
            initial,
            reached,
            limits: self.limits.clone(),
            doubt: self.doubt,
            model_error: self.model_error,
            measured: self.measured.clone(),
            criterion: self.criterion,
            score,
            alternatives,
            own: self.compared(case),
            tried,
            interrupted: (self.stop)(),
        }
    }

    /// Information of the first experiments of the case.
    fn compared(&self, case: &Case) -> Vec<Own> {
        case.experiments.iter().take(MOST_COMPARED).filter_map(|experiment| self.own(experiment)).collect()
    }

    /// Information of an experiment of the case, measured as the design is.
    fn own(&self, experiment: &Experiment) -> Option<Own> {
        if (self.stop)() || experiment.until / self.every > MOST_ROWS || experiment.until < 10.0 * self.every {
            return None;
        }
        let task = Task { duration: experiment.until, ..self.on(self.case.machine.clone()) };
        let information = task.information(&experiment.inputs, experiment.initial, &Differences::Central)?;
        let determined = self.wanted.iter().filter(|&&j| information.known.error[j].is_finite()).count();
        Some(Own {
            name: experiment.name.clone(),
            duration: experiment.until,
            score: information.score(self.criterion),
            determined,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Request;
    use super::*;
    use crate::case::TEMPLATE;

    #[test]
    fn machines_in_doubt_have_each_parameter_on_both_sides() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let names = ["cart.mass", "cart.friction.coulomb"].map(String::from).to_vec();
        let machines = |doubt: f64| {
            let request = Request { names: names.clone(), doubt, ..Request::default() };
            let task = Task::new(&case, &request, &|| false).unwrap();
            (parameters(&task.case.machine, &task.plan, &[]).unwrap().len(), doubtful(&task).unwrap())
        };
        let (count, all) = machines(0.1);
        assert_eq!(all.len(), 2 * count);
        let own = case.machine.cart.mass;
        let masses: Vec<f64> = all.iter().map(|one| one.cart.mass / own).filter(|share| *share != 1.0).collect();
        assert!(masses.len() == 2 && (masses[0] - 0.9).abs() < 1e-12 && (masses[1] - 1.1).abs() < 1e-12, "{masses:?}");
        assert!(machines(0.0).1.is_empty());
    }

    fn request(duration: f64) -> Request {
        Request { names: vec!["cart.mass".into()], duration, ..Request::default() }
    }

    /// A sine has ten samples a period at least, and a long experiment 400 periods at most.
    #[test]
    fn the_highest_frequency_is_one_that_a_log_shows() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let highest = |duration: f64| room(&Task::new(&case, &request(duration), &|| false).unwrap()).frequencies[1];
        let close = |found: f64, known: f64| (found / known - 1.0).abs() < 1e-9;
        assert!(close(highest(1.0), 100.0) && close(highest(20.0), 20.0) && close(highest(100.0), 4.0));
    }

    /// About the middle of its ranges, an input is moved by a sixth of them first: not to their ends, and not only
    /// beside itself.
    #[test]
    fn an_evolution_of_inputs_begins_around_the_best_of_the_first_points() {
        let mut points = Vec::new();
        evolved(&[0.5; 5], &mut |point| {
            points.push(point);
            (f64::INFINITY, false)
        });
        let off = points.concat().iter().map(|share| (share - 0.5).powi(2)).collect::<Vec<f64>>();
        let far = (off.iter().sum::<f64>() / off.len() as f64).sqrt();
        assert!(points.len() > 4 && (0.1..0.25).contains(&far), "{far}");
    }

    #[test]
    fn a_design_is_compared_with_the_first_eight_experiments() {
        let mut case = Case::from_text_with("axis.toml", TEMPLATE, &["experiment.0.until=50ms"]).unwrap();
        case.experiments = vec![case.experiments[0].clone(); 12];
        let own = Task::new(&case, &request(1.0), &|| false).unwrap().compared(&case);
        assert_eq!(own.len(), 8);
    }
}

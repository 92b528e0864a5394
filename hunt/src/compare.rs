//! One stage by taut and by the independent solver: what they differ by, and whether that means something.

use crate::double::Double;
use crate::draw::Random;
use crate::events;
use crate::law::Motion;
use crate::machine::Taken;
use crate::solve::{self, Ending, Event, Numbers, Run};
use std::panic::{AssertUnwindSafe, catch_unwind};
use taut::case::{Case, Experiment};
use taut::solve::{ErrorEstimate, Flow, Solution, Solver, simulate};
use taut::stage::Stage;

/// How far positions of a run may be apart, m, that states nothing of itself; and of one of the general solver at
/// least.
const ALLOWED: f64 = 1e-9;

/// A difference that is none, whatever a run states: a hundredth of an atom's width.
const LEAST: f64 = 1e-12;

/// Tolerance that the general solver is asked for.
const TOLERANCE: f64 = 1e-11;

/// By how much numbers of a case are perturbed, relative to them; of a sine, which taut puts together from polynomials
/// good to
/// 1e-14 of its peak, as much as that.
const PERTURBATION: f64 = 4e-16;
const PERTURBATION_OF_SINES: f64 = 1e-14;

/// Perturbed runs.
const PERTURBED: u64 = 8;

/// So many times what perturbed runs differ by still counts as comparable: a run rounds more often than once.
const COMPARABLE: f64 = 30.0;

/// How far a body may go while the solvers disagree about what it does, as a share of what positions may differ by and
/// of the body's
/// way in the run; and how long a stuck body may be told to slide, as a share of the run.
const AGREEMENT: [f64; 3] = [1e-3, 1e-6, 1e-6];
/// The moments of the general solver are as good as its positions: it may have a body creep that is stuck, as long as
/// that shows in no position.
const AGREEMENT_OF_GENERAL: [f64; 3] = [1.0, 1e-3, f64::INFINITY];

/// Which of taut's solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// The exact one.
    Exact,
    /// The general one.
    General,
}

/// The verdict of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Both say the same.
    Agrees,
    /// They differ as perturbed runs of the independent solver do among themselves.
    IllConditioned(String),
    /// The independent solver gave up: there is nothing to compare with.
    Unknown(String),
    /// They differ.
    Unexplained(String),
}

/// A compared run.
#[derive(Debug, Clone)]
pub struct Compared {
    /// By which solver.
    pub by: By,
    /// Largest difference of positions, m.
    pub difference: f64,
    /// How large it may be, m.
    pub allowed: f64,
    /// Difference of perturbed runs, m, where there were any.
    pub spread: Option<f64>,
    /// Changes of bodies that the independent solver saw.
    pub events: usize,
    /// The verdict.
    pub verdict: Verdict,
}

/// How far positions of a run may be off, m: the bound that the run states of itself; of the general solver its own
/// estimate.
fn allowed(by: By, stage: &Stage, experiment: &Experiment, run: &Solution) -> f64 {
    let stated = match by {
        By::Exact => run.outcome.error,
        By::General => {
            let mut estimate = ErrorEstimate::new(stage, experiment);
            estimate.take(&run.trajectory);
            estimate.finish(stage, experiment, TOLERANCE, &run.outcome, &mut || Flow::Continue).ok().flatten()
        }
    };
    match (by, stated) {
        (By::Exact, stated) => stated.map_or(ALLOWED, |error| error.value.max(LEAST)),
        (By::General, stated) => stated.map_or(ALLOWED, |error| error.value.max(ALLOWED)),
    }
}

/// Compares the first experiment of a case by each of these solvers.
pub fn compare(name: &str, text: &str, solvers: &[By]) -> Vec<Compared> {
    let fault = |by: By, why: String| Compared {
        by,
        difference: 0.0,
        allowed: ALLOWED,
        spread: None,
        events: 0,
        verdict: Verdict::Unexplained(why),
    };
    let case = match catch_unwind(|| Case::from_text(name, text)) {
        Ok(Ok(case)) => case,
        Ok(Err(error)) => return vec![fault(By::Exact, format!("the case is refused: {error}"))],
        Err(_) => return vec![fault(By::Exact, "reading the case panics".into())],
    };
    let experiment = &case.experiments[0];
    let mut independent = None;
    let one = |&by: &By| {
        let solver = match by {
            By::Exact => Solver::Exact,
            By::General => Solver::General { tolerance: TOLERANCE },
        };
        let run = match catch_unwind(AssertUnwindSafe(|| simulate(&case.stage, experiment, solver))) {
            Ok(Ok(run)) => run,
            Ok(Err(error)) => return fault(by, format!("the stage is refused: {error}")),
            Err(_) => return fault(by, "it panics".into()),
        };
        let times = run.trajectory.get("time").unwrap_or(&[]).to_vec();
        let grid = taut::solve::Grid::new(experiment.every, experiment.until);
        let mut all = times.clone();
        // A run that ends early has fewer rows than there are.
        all.extend((times.len() as u64..=grid.intervals()).map(|k| grid.time(k)));
        let known = independent.get_or_insert_with(|| solve::run(&case.stage, experiment, &all));
        match known {
            Ok(known) => {
                let allowed = allowed(by, &case.stage, experiment, &run);
                Pair { stage: &case.stage, experiment, times: &all, by, run: &run, known, allowed }.judged()
            }
            Err(why) => fault(by, why.clone()),
        }
    };
    solvers.iter().map(one).collect()
}

/// Both runs of a stage.
struct Pair<'a> {
    stage: &'a Stage,
    experiment: &'a Experiment,
    times: &'a [f64],
    by: By,
    run: &'a Solution,
    known: &'a Run,
    /// How far positions may be apart, m.
    allowed: f64,
}

/// How far apart the ends of two runs may be, as a part of the run.
const NEAR: f64 = 1e-6;

impl Pair<'_> {
    fn judged(&self) -> Compared {
        let difference = apart(&self.rows(), &self.known.rows);
        let count = self.known.events.len();
        let compared = |spread, verdict| Compared {
            by: self.by,
            difference,
            allowed: self.allowed,
            spread,
            events: count,
            verdict,
        };
        if let Ending::GaveUp(time, why) = &self.known.ending {
            return compared(None, Verdict::Unknown(format!("the independent solver gave up at {time:e} s: {why}")));
        }
        let wrong_end = self.wrong_end(self.known);
        let far = difference > self.allowed;
        let ours = body_events(self.run);
        let events = events::undone(&ours, &self.known.events, self.experiment.until)
            .or_else(|| self.disagreement(&ours, self.known));
        if wrong_end.is_none() && !far && events.is_none() {
            return compared(None, Verdict::Agrees);
        }
        let perturbed = self.perturbed();
        let spread = perturbed.iter().map(|run| apart(&run.rows, &self.known.rows)).fold(0.0, f64::max);
        let too_far = far && difference > COMPARABLE * spread;
        let other_end = || perturbed.iter().any(|run| self.wrong_end(run).is_none());
        let other_events = || {
            // Where positions differ, events do.
            far || perturbed.iter().any(|run| self.disagreement(&run.events, self.known).is_some())
        };
        let explained = !too_far && (wrong_end.is_none() || other_end()) && (events.is_none() || other_events());
        let mut told: Vec<String> = wrong_end.into_iter().collect();
        if far {
            told.push(format!("positions differ by {difference:.1e} m, {:.1e} m allowed", self.allowed));
        }
        told.extend(events);
        told.push(format!("perturbed runs differ by {spread:.1e} m"));
        let told = told.join("; ");
        compared(Some(spread), if explained { Verdict::IllConditioned(told) } else { Verdict::Unexplained(told) })
    }

    /// Where bodies do other things than by the independent solver, and that matters.
    fn disagreement(&self, ours: &[Event], known: &Run) -> Option<String> {
        let end = match known.ending {
            Ending::Complete => self.times.last().copied().unwrap_or(0.0),
            Ending::LeftTravel(time) | Ending::GaveUp(time, _) => time * (1.0 - NEAR),
        };
        let found = events::disagreements(ours, &known.events, end);
        if found.is_empty() {
            return None;
        }
        // Where the bodies are at those moments.
        let mut moments: Vec<f64> = found.iter().flat_map(|one| one.moments()).chain([self.experiment.until]).collect();
        moments.sort_by(f64::total_cmp);
        moments.dedup();
        let at_moments = solve::run(self.stage, self.experiment, &moments).ok()?;
        let place = |body: usize, time: f64| {
            let index = moments.binary_search_by(|moment| moment.total_cmp(&time)).unwrap_or_else(|index| index);
            at_moments.rows.get(index).map_or(Double::ZERO, |row| row[body])
        };
        let farthest = |body: usize| known.rows.iter().map(|row| row[body].high.abs()).fold(0.0, f64::max);
        let way = |body: usize, from: f64, to: f64| (place(body, to) - place(body, from)).high.abs();
        let [share, of_run, moment] = match self.by {
            By::Exact => AGREEMENT,
            By::General => AGREEMENT_OF_GENERAL,
        };
        let matters = |one: &&events::Disagreement| {
            let near = (share * self.allowed).min(of_run * farthest(one.body()));
            one.matters(moment * self.experiment.until, near, way)
        };
        found.iter().find(matters).map(events::Disagreement::told)
    }

    /// r φ₁, x, r φ₃ less the start of the cart.
    fn rows(&self) -> Vec<[Double; 3]> {
        let column = |name| self.run.trajectory.get(name).unwrap_or(&[]);
        let (drive, cart, idler) = (column("drive_angle"), column("cart_position"), column("idler_angle"));
        let r = Double::from(self.stage.pulley_radius);
        let origin = Double::from(self.experiment.initial.cart_position);
        let row = |i: usize| [r * drive[i] - origin, Double::from(cart[i]) - origin, r * idler[i] - origin];
        (0..cart.len()).map(row).collect()
    }

    /// The mistake in how it ended.
    fn wrong_end(&self, known: &Run) -> Option<String> {
        let told = || Some(format!("it ends {:?} instead of {:?}", self.run.outcome.ending, known.ending));
        match (self.run.outcome.ending, &known.ending) {
            (taut::solve::Ending::Complete, Ending::Complete) => None,
            (taut::solve::Ending::LeftTravel { time }, Ending::LeftTravel(other))
                if (time - other).abs() <= NEAR * self.experiment.until =>
            {
                None
            }
            _ => told(),
        }
    }

    /// Runs of the independent solver with numbers that are off by their last bit; half of them keep their state in so
    /// few bits, too.
    fn perturbed(&self) -> Vec<Run> {
        let mut runs = Vec::new();
        for number in 0..PERTURBED {
            let sines = self.experiment.input.degree() > 1;
            let perturb = |seed: u64, size: f64| {
                let mut random = Random::new(seed, number);
                move |value: f64| {
                    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
                    Double::from(value) * (Double::ONE + Double::from(sign * size))
                }
            };
            let mut machine = perturb(1, PERTURBATION);
            let mut input = perturb(2, if sines { PERTURBATION_OF_SINES } else { PERTURBATION });
            let mut kept = perturb(3, PERTURBATION);
            let kept: Option<Taken> = if number % 2 == 1 { Some(&mut kept) } else { None };
            let numbers = Numbers { machine: &mut machine, input: &mut input, kept };
            runs.extend(solve::run_with(self.stage, self.experiment, self.times, numbers));
        }
        runs
    }
}

/// The changes of bodies in a run of taut.
fn body_events(run: &Solution) -> Vec<Event> {
    let motion = |status: taut::mechanism::Status| match status.code() {
        -1 => Motion::Backward,
        0 => Motion::Stuck,
        1 => Motion::Forward,
        _ => Motion::Free,
    };
    let of_bodies = run.outcome.events.iter().filter_map(|event| Some((event, event.body()?)));
    of_bodies
        .map(|(event, body)| Event { time: event.time, body, from: motion(event.from), to: motion(event.to) })
        .collect()
}

/// The largest difference of positions, m.
fn apart(a: &[[Double; 3]], b: &[[Double; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (*a - *b).high.abs()).fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { d.max(most) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A run of a machine one of whose springs is a tenth of a percent stiffer is found out.
    #[test]
    fn a_wrong_answer_is_unexplained() {
        let case = Case::from_text("stage.toml", &crate::draw::stage(1, 0).text).unwrap();
        let experiment = &case.experiments[0];
        let mut wrong = case.stage.clone();
        wrong.belt.stiffness[0] *= 1.001;
        let judged = |stage: &Stage| {
            let run = simulate(stage, experiment, Solver::Exact).unwrap();
            let times = run.trajectory.get("time").unwrap().to_vec();
            let known = solve::run(&case.stage, experiment, &times).unwrap();
            let pair = Pair {
                stage: &case.stage,
                experiment,
                times: &times,
                by: By::Exact,
                run: &run,
                known: &known,
                allowed: ALLOWED,
            };
            pair.judged().verdict
        };
        assert_eq!(judged(&case.stage), Verdict::Agrees);
        assert!(judged(&wrong).is_unexplained());
    }
}

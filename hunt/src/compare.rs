//! One stage by taut and by the independent solver: what they differ by, and whether that means something.

use crate::double::Double;
use crate::draw::Random;
use crate::law::Motion;
use crate::solve::{self, Ending, Event, Run};
use std::panic::{AssertUnwindSafe, catch_unwind};
use taut::case::{Case, Experiment};
use taut::solve::{Solution, Solver, simulate};
use taut::stage::Stage;

/// How far positions may be apart, m.
const ALLOWED: f64 = 1e-9;

/// The same for the general solver at its tolerance here; its steps are not exact.
const ALLOWED_GENERAL: f64 = 1e-7;

/// Tolerance that the general solver is asked for.
const TOLERANCE: f64 = 1e-11;

/// By how much numbers of a case are perturbed, relative to them; of a sine, which taut puts together from polynomials good to
/// 1e-14 of its peak, as much as that.
const PERTURBATION: f64 = 4e-16;
const PERTURBATION_OF_SINES: f64 = 1e-14;

/// Perturbed runs.
const PERTURBED: u64 = 8;

/// So many times what perturbed runs differ by still counts as comparable: a run rounds more often than once.
const COMPARABLE: f64 = 30.0;

/// Which of taut's solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum By {
    /// The exact one.
    Exact,
    /// The general one.
    General,
}

/// What a comparison says.
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
    /// What perturbed runs differ by, m, where there were any.
    pub spread: Option<f64>,
    /// Changes of bodies that the independent solver saw.
    pub events: usize,
    /// What it says.
    pub verdict: Verdict,
}

/// How far positions of a run may be off. The one place to ask a run for a bound of its own.
fn allowed(by: By, _run: &Solution) -> f64 {
    match by {
        By::Exact => ALLOWED,
        By::General => ALLOWED_GENERAL,
    }
}

/// Compares the first experiment of a case by each of these solvers.
pub fn compare(name: &str, text: &str, solvers: &[By]) -> Vec<Compared> {
    let fault = |by: By, why: String| Compared {
        by,
        difference: 0.0,
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
        let known = independent
            .get_or_insert_with(|| solve::run(&case.stage, experiment, &all, &mut Double::from, &mut Double::from));
        match known {
            Ok(known) => Pair { stage: &case.stage, experiment, times: &all, by, run: &run, known }.judged(),
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
}

/// Two times so near that what is undone between them did not happen, and how far moments may be apart: parts of the run.
const MOMENT: f64 = 1e-9;
const NEAR: f64 = 1e-6;

impl Pair<'_> {
    fn judged(&self) -> Compared {
        let ours = self.rows();
        let difference = apart(&ours, &self.known.rows);
        let events = (self.events(&body_events(self.run)), self.events(&self.known.events));
        let mut wrong = Vec::new();
        if let Some(why) = self.wrong_end() {
            wrong.push(why);
        }
        if !(difference <= allowed(self.by, self.run)) {
            wrong.push(format!("positions differ by {difference:.1e} m"));
        }
        if let Some(why) = differ(&events.0, &events.1, NEAR * self.experiment.until) {
            wrong.push(format!("events differ: {why}"));
        }
        let count = self.known.events.len();
        let compared = |spread, verdict| Compared { by: self.by, difference, spread, events: count, verdict };
        if let Ending::GaveUp(time, why) = &self.known.ending {
            return compared(None, Verdict::Unknown(format!("the independent solver gave up at {time:e} s: {why}")));
        }
        if wrong.is_empty() {
            return compared(None, Verdict::Agrees);
        }
        let told = wrong.join("; ");
        let perturbed = self.perturbed();
        let spread = perturbed.iter().map(|run| apart(&run.rows, &self.known.rows)).fold(0.0, f64::max);
        let other_events = perturbed
            .iter()
            .any(|run| differ(&self.events(&run.events), &events.1, NEAR * self.experiment.until).is_some());
        let other_end = perturbed
            .iter()
            .any(|run| std::mem::discriminant(&run.ending) != std::mem::discriminant(&self.known.ending));
        let explained = (self.wrong_end().is_none() || other_end)
            && (difference <= allowed(self.by, self.run) || difference <= COMPARABLE * spread)
            && (differ(&events.0, &events.1, NEAR * self.experiment.until).is_none()
                || other_events
                || difference > ALLOWED);
        let told = format!("{told}; perturbed runs differ by {spread:.1e} m");
        compared(Some(spread), if explained { Verdict::IllConditioned(told) } else { Verdict::Unexplained(told) })
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

    /// What is wrong with how it ended.
    fn wrong_end(&self) -> Option<String> {
        let told = || Some(format!("it ends {:?} instead of {:?}", self.run.outcome.ending, self.known.ending));
        match (self.run.outcome.ending, &self.known.ending) {
            (taut::solve::Ending::Complete, Ending::Complete) => None,
            (taut::solve::Ending::LeftTravel { time }, Ending::LeftTravel(other))
                if (time - other).abs() <= NEAR * self.experiment.until =>
            {
                None
            }
            _ => told(),
        }
    }

    /// Changes of each body, without what was undone at once.
    fn events(&self, events: &[Event]) -> [Vec<Event>; 3] {
        let mut bodies: [Vec<Event>; 3] = Default::default();
        for event in events {
            let list = &mut bodies[event.body];
            match list.last_mut() {
                Some(last) if event.time - last.time <= MOMENT * self.experiment.until => last.to = event.to,
                _ => list.push(*event),
            }
            if list.last().is_some_and(|last| last.from == last.to) {
                list.pop();
            }
        }
        bodies
    }

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
            let mut taken = perturb(1, PERTURBATION);
            let mut of_input = perturb(2, if sines { PERTURBATION_OF_SINES } else { PERTURBATION });
            runs.extend(solve::run(self.stage, self.experiment, self.times, &mut taken, &mut of_input));
        }
        runs
    }
}

/// The changes of bodies in a run of taut.
fn body_events(run: &Solution) -> Vec<Event> {
    let motion = |status: taut::plant::Status| match status.code() {
        -1 => Motion::Backward,
        0 => Motion::Stuck,
        1 => Motion::Forward,
        _ => Motion::Free,
    };
    let of_bodies = run.outcome.events.iter().filter_map(|event| Some((event, event.body()?)));
    of_bodies
        .map(|(event, body)| Event {
            time: event.time,
            body: body.index(),
            from: motion(event.from),
            to: motion(event.to),
        })
        .collect()
}

/// The largest difference of positions, m.
fn apart(a: &[[Double; 3]], b: &[[Double; 3]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.map(|(a, b)| (*a - *b).high.abs()).fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { d.max(most) })
}

/// What the lists of events differ by.
fn differ(ours: &[Vec<Event>; 3], known: &[Vec<Event>; 3], near: f64) -> Option<String> {
    const NAMES: [&str; 3] = ["drive pulley", "cart", "idler pulley"];
    for body in 0..3 {
        let (ours, known) = (&ours[body], &known[body]);
        let told = |i: usize| {
            let say = |event: Option<&Event>| match event {
                Some(e) => format!("{:?} to {:?} at {:e} s", e.from, e.to, e.time),
                None => "nothing".into(),
            };
            Some(format!("{}: {} instead of {}", NAMES[body], say(ours.get(i)), say(known.get(i))))
        };
        let same = |(a, b): (&Event, &Event)| a.from == b.from && a.to == b.to && (a.time - b.time).abs() <= near;
        if let Some(i) = ours.iter().zip(known).position(|pair| !same(pair)) {
            return told(i);
        }
        if ours.len() != known.len() {
            return told(ours.len().min(known.len()));
        }
    }
    None
}

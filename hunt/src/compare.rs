//! One case by taut and by the independent solver: what they differ by, and whether that means something.

use crate::answer::{Answer, End};
use crate::by::{self, By};
use crate::double::Double;
use crate::draw::Random;
use crate::events;
use crate::machine::{BODIES, Taken};
use crate::solve::{Ending, Event, IndependentRun};
use crate::subject::{Numbers, Subject};
use std::panic::catch_unwind;

/// By how much numbers of a case are perturbed, relative to them; of a sine, which taut puts together from polynomials
/// good to 1e-14 of its peak, as much as that.
const PERTURBATION: f64 = 4e-16;
const PERTURBATION_OF_SINES: f64 = 1e-14;
/// The same where an integrator is asked, whose errors are those of its tolerance: that tolerance as a share of the
/// largest position, within these limits. 1e-11 m is as much as 1e-12 of 10 m.
const PERTURBATION_OF_GENERAL: [f64; 2] = [1e-12, 1e-6];
/// By this much, in its SI unit, each condition of an FMU for model exchange falls later (docs/fmu.md).
const DELAY_OF_EXCHANGE: f64 = 1.0 / (1_u64 << 40) as f64;

/// Perturbed runs.
const PERTURBED: u64 = 8;

/// So many times what perturbed runs differ by still counts as comparable: a run rounds more often than once.
const COMPARABLE: f64 = 30.0;

/// How far a body may go while the solvers disagree about what it does, as a share of what positions may differ by and
/// of the body's way in the run; and how long a stuck body may be told to slide, as a share of the run.
const AGREEMENT: [f64; 3] = [1e-3, 1e-6, 1e-6];
/// The moments of the general solver are as good as its positions: it may have a body creep that is stuck, as long as
/// that shows in no position.
const AGREEMENT_OF_GENERAL: [f64; 3] = [1.0, 1e-3, f64::INFINITY];
/// The least error of its positions where events are judged, m.
const GENERAL_EVENTS: f64 = 1e-9;

/// How far apart the ends of two runs may be, as a part of the run.
const NEAR: f64 = 1e-6;

/// The verdict of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Both say the same.
    Agrees,
    /// They differ as perturbed runs of the independent solver do among themselves.
    IllConditioned(String),
    /// Both say the same up to a time at which the independent solver gave up.
    Unknown(String),
    /// They differ.
    Unexplained(String),
}

/// A compared run.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The way of asking.
    pub by: By,
    /// Largest difference of positions, m.
    pub difference: f64,
    /// How large it may be, m.
    pub allowed: f64,
    /// Difference of perturbed runs, m, where there were any.
    pub spread: Option<f64>,
    /// Changes of bodies that the independent solver saw.
    pub events: usize,
    /// True if positions are off by more than a run states that names no decision within rounding.
    pub exceeds: bool,
    /// The verdict.
    pub verdict: Verdict,
}

/// Compares a case by each of these ways; `every` are other intervals between rows, as multiples of the case's, at
/// which solvers are asked again.
pub fn compare(name: &str, text: &str, ways: &[By], every: &[f64]) -> Vec<Compared> {
    let fault = |by: By, why: String| Compared {
        by,
        difference: 0.0,
        allowed: 0.0,
        spread: None,
        events: 0,
        exceeds: false,
        verdict: Verdict::Unexplained(why),
    };
    let first = ways.first().copied().unwrap_or(By::Exact);
    let subject = match catch_unwind(|| Subject::new(name, text)) {
        Ok(Ok(subject)) => subject,
        Ok(Err(error)) => return vec![fault(first, error)],
        Err(_) => return vec![fault(first, "reading the case panics".into())],
    };
    let mut found = Vec::new();
    for &by in ways {
        let is_solver = matches!(by, By::Exact | By::General);
        let others: Vec<f64> = if is_solver { every.to_vec() } else { Vec::new() };
        let mut worst: Option<Compared> = None;
        for factor in std::iter::once(1.0).chain(others) {
            let [_, interval] = subject.times();
            let asked = if factor == 1.0 { subject.clone() } else { subject.clone().with_every(interval * factor) };
            let one = match by::ask(&asked, by) {
                Err(why) => fault(by, why),
                Ok(answer) => {
                    let subject = answer.subject.clone().unwrap_or(asked);
                    match subject.known_as_is(&answer.fed, &answer.times) {
                        Err(why) => fault(by, why),
                        Ok(known) => Pair { subject: &subject, by, answer: &answer, known: &known }.judged(),
                    }
                }
            };
            let worse = worst.as_ref().is_none_or(|worst| one.verdict.rank() > worst.verdict.rank());
            if worse {
                let mut one = one;
                if factor != 1.0 {
                    one.verdict.add(&format!("with `every` {factor} times as long"));
                }
                worst = Some(one);
            }
        }
        found.extend(worst);
    }
    found
}

impl Verdict {
    /// The worse, the larger.
    fn rank(&self) -> u8 {
        match self {
            Verdict::Agrees => 0,
            Verdict::IllConditioned(_) => 1,
            Verdict::Unknown(_) => 2,
            Verdict::Unexplained(_) => 3,
        }
    }

    fn add(&mut self, more: &str) {
        match self {
            Verdict::Agrees => {}
            Verdict::IllConditioned(told) | Verdict::Unknown(told) | Verdict::Unexplained(told) => {
                *told = format!("{told}; {more}");
            }
        }
    }
}

/// Both runs of a case.
struct Pair<'a> {
    subject: &'a Subject,
    by: By,
    answer: &'a Answer,
    known: &'a IndependentRun,
}

impl Pair<'_> {
    fn judged(&self) -> Compared {
        let difference = apart(&self.answer.rows, &self.known.rows);
        let count = self.known.events.len();
        let allowed = self.answer.allowed;
        let exceeds = self.answer.is_stated && difference > allowed && self.answer.ties == 0;
        let compared =
            |spread, verdict| Compared { by: self.by, difference, allowed, spread, events: count, exceeds, verdict };
        // Where it gave up, what came before is known.
        let gave_up = match &self.known.ending {
            Ending::GaveUp(time, why) => Some(format!("the independent solver gave up at {time:e} s: {why}")),
            Ending::Complete | Ending::LeftTravel(_) => None,
        };
        let wrong_end = if gave_up.is_none() { self.wrong_end(self.known) } else { None };
        let far = difference > allowed;
        let [until, _] = self.subject.times();
        let compared_until = if let Ending::GaveUp(time, _) = self.known.ending { time } else { f64::INFINITY };
        let events = self.answer.events.as_ref().and_then(|ours| {
            let ours: Vec<Event> = ours.iter().filter(|event| event.time <= compared_until).copied().collect();
            events::undone(&ours, &self.known.events, until, self.subject.names())
                .or_else(|| self.disagreement(&ours, self.known))
        });
        if wrong_end.is_none() && !far && events.is_none() {
            return compared(None, gave_up.map_or(Verdict::Agrees, Verdict::Unknown));
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
        let mut told: Vec<String> = gave_up.into_iter().chain(wrong_end).collect();
        if far {
            let from = self.first_apart();
            told.push(format!("positions differ by {difference:.1e} m{from}, {allowed:.1e} m allowed"));
        }
        told.extend(events);
        told.push(format!("perturbed runs differ by {spread:.1e} m"));
        let told = told.join("; ");
        compared(Some(spread), if explained { Verdict::IllConditioned(told) } else { Verdict::Unexplained(told) })
    }

    /// Where bodies do other things than by the independent solver, and that matters.
    fn disagreement(&self, ours: &[Event], known: &IndependentRun) -> Option<String> {
        let end = match known.ending {
            Ending::Complete => self.answer.times.last().copied().unwrap_or(0.0),
            Ending::LeftTravel(time) | Ending::GaveUp(time, _) => time * (1.0 - NEAR),
        };
        let found = events::disagreements(ours, &known.events, end);
        if found.is_empty() {
            return None;
        }
        // Where the bodies are at those moments.
        let [until, _] = self.subject.times();
        let mut moments: Vec<f64> = found.iter().flat_map(|one| one.moments()).chain([until]).collect();
        moments.sort_by(f64::total_cmp);
        moments.dedup();
        let at_moments = self.subject.known_as_is(&self.answer.fed, &moments).ok()?;
        let place = |body: usize, time: f64| {
            let index = moments.binary_search_by(|moment| moment.total_cmp(&time)).unwrap_or_else(|index| index);
            at_moments.rows.get(index).map_or(Double::ZERO, |row| row[body])
        };
        let farthest = |body: usize| known.rows.iter().map(|row| row[body].high.abs()).fold(0.0, f64::max);
        let way = |body: usize, from: f64, to: f64| (place(body, to) - place(body, from)).high.abs();
        let is_general = self.by.is_general(self.subject);
        let [share, of_run, moment] = if is_general { AGREEMENT_OF_GENERAL } else { AGREEMENT };
        let allowed = if is_general { self.answer.allowed.max(GENERAL_EVENTS) } else { self.answer.allowed };
        let matters = |one: &&events::Disagreement| {
            let near = (share * allowed).min(of_run * farthest(one.body()));
            one.matters(moment * until, near, way)
        };
        found.iter().find(matters).map(|one| one.told(self.subject.names()))
    }

    /// Where positions first differ by more than is allowed.
    fn first_apart(&self) -> String {
        let rows = self.answer.rows.iter().zip(&self.known.rows).zip(&self.answer.times);
        let far = |(a, b): (&Double, &Double)| (*a - *b).high.abs() > self.answer.allowed;
        let found = rows.filter_map(|((ours, known), time)| {
            let body = ours.iter().zip(known).position(far)?;
            Some(format!(", from the {} at {time:e} s on", self.subject.names().get(body)?))
        });
        found.into_iter().next().unwrap_or_default()
    }

    /// True if no body moves farther in this time before its end than the run states that it may be off.
    fn is_hidden(&self, end: f64, apart: f64) -> bool {
        let moments = [(end - apart).max(0.0), end * (1.0 - NEAR)];
        self.answer.is_stated
            && self.subject.known_as_is(&self.answer.fed, &moments).is_ok_and(|run| match &run.rows[..] {
                [from, to, ..] => from.iter().zip(to).all(|(a, b)| (*b - *a).high.abs() <= self.answer.allowed),
                _ => false,
            })
    }

    /// The mistake in how it ended.
    fn wrong_end(&self, known: &IndependentRun) -> Option<String> {
        let [until, _] = self.subject.times();
        match (&self.answer.end, &known.ending) {
            (End::Complete, Ending::Complete) => None,
            (End::Left(time), Ending::LeftTravel(other)) if time.is_nan() || (time - other).abs() <= NEAR * until => {
                None
            }
            (End::Left(time), Ending::LeftTravel(other)) if self.is_hidden(*other, (time - other).abs()) => None,
            (ours, known) => Some(format!("it ends {ours:?} instead of {known:?}")),
        }
    }

    /// Runs of the independent solver with numbers perturbed by their last bit, or by the tolerance of an integrator;
    /// half of them also keep their state in 64 bits. A controller's clock is off by its last bit. For model exchange,
    /// the conditions of half of them fall later.
    fn perturbed(&self) -> Vec<IndependentRun> {
        let mut runs = Vec::new();
        let (own, of_input) = match (self.by.tolerance(self.subject), self.subject.has_sines()) {
            (Some(tolerance), _) => {
                let farthest = self.known.rows.iter().flatten().map(|x| x.high.abs()).fold(f64::MIN_POSITIVE, f64::max);
                let [least, most] = PERTURBATION_OF_GENERAL;
                let share = (tolerance / farthest).clamp(least, most);
                (share, share)
            }
            (None, true) => (PERTURBATION, PERTURBATION_OF_SINES),
            (None, false) => (PERTURBATION, PERTURBATION),
        };
        for number in 0..PERTURBED {
            let perturb = |seed: u64, size: f64| {
                let mut random = Random::new(seed, number);
                move |value: f64| {
                    let sign = if random.chance(0.5) { 1.0 } else { -1.0 };
                    Double::from(value) * (Double::ONE + Double::from(sign * size))
                }
            };
            let mut machine = perturb(1, own);
            let mut input = perturb(2, of_input);
            let mut kept = perturb(3, PERTURBATION);
            let mut clock = perturb(4, PERTURBATION);
            let kept: Option<Taken> = if number % 2 == 1 { Some(&mut kept) } else { None };
            let is_delayed = self.by == By::ModelExchange && number % 4 < 2;
            let delayed = if is_delayed { DELAY_OF_EXCHANGE } else { 0.0 };
            let clock = &mut clock;
            let numbers = Numbers { machine: &mut machine, input: &mut input, clock, kept, delayed };
            runs.extend(self.subject.known(&self.answer.fed, &self.answer.times, numbers));
        }
        runs
    }
}

/// The largest difference of positions, m; of what an answer does not say, none.
fn apart(a: &[[Double; BODIES]], b: &[[Double; BODIES]]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let said = pairs.filter(|(a, _)| !a.high.is_nan());
    said.map(|(a, b)| (*a - *b).high.abs()).fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { d.max(most) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut::solve::Solver;

    /// A run of a machine one of whose springs is a tenth of a percent stiffer is found out.
    #[test]
    fn a_wrong_answer_is_unexplained() {
        let text = crate::draw::stage(1, 0).text;
        let subject = Subject::new("stage.toml", &text).unwrap();
        let judged = |asked: &Subject| {
            let answer = crate::answer::solved(asked, Solver::Exact).unwrap();
            let known = subject.known_as_is(&answer.fed, &answer.times).unwrap();
            Pair { subject: &subject, by: By::Exact, answer: &answer, known: &known }.judged().verdict
        };
        let mut wrong = subject.clone();
        let Subject::Axis(case) = &mut wrong else { panic!() };
        case.machine.belt.stiffness[0] *= 1.001;
        assert_eq!(judged(&subject), Verdict::Agrees);
        assert!(judged(&wrong).is_unexplained());
    }
}

//! An answer of taut about a case, and that of its solvers.

use crate::double::Double;
use crate::law::Motion;
use crate::machine::{BODIES, Model};
use crate::solve::Event;
use crate::subject::{Fed, Subject};
use taut::control::{self, Accuracy, Controller, Loop, Rows, Standard};
use taut::mechanism::Mechanism;
use taut::solve::{Course, Detail, Ending, ErrorEstimate, Flow, Outcome, Solver, stream, stream_mechanism};
use taut::trajectory::Trajectory;

/// Tolerance that the general solver is asked for.
pub const TOLERANCE: f64 = 1e-11;

/// A difference that is none, whatever a run states: a hundredth of an atom's width.
pub const LEAST: f64 = 1e-12;

/// How a run ended.
#[derive(Debug, Clone, PartialEq)]
pub enum End {
    /// At its end.
    Complete,
    /// A body left its travel.
    Left(f64),
    /// Otherwise.
    Other(String),
}

/// An answer.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The subject that was run, if it is not the case itself.
    pub subject: Option<Subject>,
    /// How its inputs came.
    pub fed: Fed,
    /// s.
    pub times: Vec<f64>,
    /// Positions along the belt from the start at these times, as far as it went; where there are none, NaN.
    pub rows: Vec<[Double; BODIES]>,
    /// Events of the bodies, where they are reported.
    pub events: Option<Vec<Event>>,
    /// How it ended.
    pub end: End,
    /// How far positions may be off, m.
    pub allowed: f64,
    /// True if that is what the run states of itself.
    pub is_stated: bool,
    /// Decisions within rounding that it names.
    pub ties: usize,
}

/// True if the machine of a subject is linear piece by piece.
pub fn is_piecewise_linear(subject: &Subject) -> bool {
    match subject {
        Subject::Axis(case) | Subject::Loop(case) => case.machine.is_piecewise_linear(),
        Subject::Gantry(case) => case.machine.mechanism().is_piecewise_linear(),
    }
}

/// The mechanism of a subject.
pub fn mechanism(subject: &Subject) -> Mechanism {
    match subject {
        Subject::Axis(case) | Subject::Loop(case) => case.machine.mechanism(),
        Subject::Gantry(case) => case.machine.mechanism(),
    }
}

/// By one of taut's solvers.
pub(crate) fn solved(subject: &Subject, solver: Solver) -> Result<Answer, String> {
    let told = |error: taut::Error| format!("the stage is refused: {error}");
    let mut trajectory = Trajectory::default();
    let mut keep = |block: &Trajectory| {
        if trajectory.is_empty() {
            trajectory = Trajectory::with_capacity(&block.columns, 64);
        }
        trajectory.append(block);
        Flow::Continue
    };
    let (outcome, stated): (Outcome, Option<f64>) = match subject {
        Subject::Axis(case) => {
            let (stage, experiment) = (&case.machine, &case.experiments[0]);
            let outcome = stream(stage, experiment, solver, &mut keep).map_err(told)?;
            let stated = estimated(solver, &outcome, &trajectory, ErrorEstimate::new(stage, experiment), |estimate| {
                estimate.finish(stage, experiment, TOLERANCE, &outcome, &mut || Flow::Continue)
            });
            (outcome, stated)
        }
        Subject::Gantry(case) => {
            let mechanism = case.machine.mechanism();
            let course = Course::new(&mechanism, &case.experiments[0]);
            let outcome =
                stream_mechanism(&mechanism, &course, solver, (Detail::Full, None), &mut keep).map_err(told)?;
            let estimate = ErrorEstimate::of_mechanism(&mechanism, &course);
            let stated = estimated(solver, &outcome, &trajectory, estimate, |estimate| {
                estimate.finish_mechanism(&mechanism, &course, TOLERANCE, &outcome, &mut || Flow::Continue)
            });
            (outcome, stated)
        }
        Subject::Loop(case) => {
            let design = case.controller.as_ref().ok_or("the case has no controller")?;
            let motion = &case.moves[0];
            let mut controller = Standard::new(design, &case.machine).map_err(told)?;
            let lead = design.feed_forward.lead.unwrap_or(design.delay + 0.5 * design.every);
            let timing = Loop { every: design.every, delay: design.delay, limit: design.limit, lead };
            let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
            let (machine, profiles) = (&case.machine, motion.references(design));
            let mut accuracy = Accuracy::new(machine, &timing, &profiles, &rows, solver);
            let mut keep = |block: &Trajectory| {
                accuracy.take(block);
                keep(block)
            };
            let controllers: &mut [&mut dyn Controller] = &mut [&mut controller];
            let run = control::stream(machine, controllers, &timing, &profiles, &rows, solver, false, &mut keep);
            let mut run = run.map_err(told)?;
            let error = accuracy.finish(&run, controllers, &mut || Flow::Continue).map_err(told)?;
            run.outcome.error = error;
            let stated = error.map(|error| error.value);
            (run.outcome, stated)
        }
    };
    let machine = subject.machine(&mut Double::from);
    let columns: Vec<&[f64]> = subject.columns().iter().map(|name| trajectory.get(name).unwrap_or(&[])).collect();
    let count = columns.first().map_or(0, |column| column.len());
    let row = |k: usize| {
        let positions: Vec<f64> = columns.iter().map(|column| column[k]).collect();
        subject.along_the_belt(&machine, &positions)
    };
    let [until, every] = subject.times();
    let mut times = trajectory.get("time").unwrap_or(&[]).to_vec();
    let grid = taut::solve::Grid::new(every, until);
    // A run that ends early has fewer rows than there are.
    times.extend((times.len() as u64..=grid.intervals()).map(|k| grid.time(k)));
    Ok(Answer {
        subject: None,
        fed: Fed::AsGiven,
        times,
        rows: (0..count).map(row).collect(),
        events: Some(body_events(&outcome)),
        end: end_of(outcome.ending),
        allowed: stated.unwrap_or(LEAST).max(LEAST),
        is_stated: stated.is_some(),
        ties: outcome.ties.len(),
    })
}

/// The error that a run states: the exact solver's bound, the general one's estimate.
fn estimated(
    solver: Solver,
    outcome: &Outcome,
    trajectory: &Trajectory,
    mut estimate: ErrorEstimate,
    finish: impl FnOnce(ErrorEstimate) -> taut::Result<Option<taut::solve::PositionError>>,
) -> Option<f64> {
    let Solver::General { .. } = solver else { return outcome.error.map(|error| error.value) };
    estimate.take(trajectory);
    finish(estimate).ok().flatten().map(|error| error.value)
}

fn end_of(ending: Ending) -> End {
    match ending {
        Ending::Complete => End::Complete,
        Ending::LeftTravel { time } => End::Left(time),
        other => End::Other(format!("{other:?}")),
    }
}

/// The changes of bodies in a run of taut.
fn body_events(outcome: &Outcome) -> Vec<Event> {
    let motion = |status: taut::mechanism::Status| match status.code() {
        -1 => Motion::Backward,
        0 => Motion::Stuck,
        1 => Motion::Forward,
        _ => Motion::Free,
    };
    let of_bodies = outcome.events.iter().filter_map(|event| Some((event, event.body()?)));
    let of_bodies = of_bodies.filter(|(_, body)| *body < BODIES);
    of_bodies
        .map(|(event, body)| Event { time: event.time, body, from: motion(event.from), to: motion(event.to) })
        .collect()
}

/// Rows of positions in taut's units along a subject's bodies.
pub fn rows(subject: &Subject, machine: &Model, positions: &[Vec<f64>]) -> Vec<[Double; BODIES]> {
    positions.iter().map(|positions| subject.along_the_belt(machine, positions)).collect()
}

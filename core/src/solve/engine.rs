//! The interface of a simulator to its solver, and the value of each column from it.

use super::inputs::Pieces;
use super::record::Extra;
use super::saved::{Pass, Passed};
use super::{Ending, Event, PositionError};
use crate::mechanism::{DRIVES, Form, Mechanism, Mode, Shown, SpringLaw, State, What};

/// The solver of a running machine: a kernel of the exact solver, or the general solver.
pub(super) trait Engine: Send + Sync {
    /// A copy that continues identically.
    fn copy(&self) -> Box<dyn Engine>;

    /// The mechanism, with positions relative to its start.
    fn mechanism(&self) -> &Mechanism;

    /// Present time, s.
    fn time(&self) -> f64;

    /// Highest degree of its inputs.
    fn degree(&self) -> usize;

    /// A solver for inputs of this degree in the same state.
    fn raised(&self, degree: usize) -> Box<dyn Engine>;

    /// Sets new inputs and settles the mode changes that they cause at once.
    fn take_input(&mut self, pieces: &Pieces);

    /// Bounds the rates of the inputs until `until`.
    fn bound_input(&mut self, pieces: &Pieces, until: f64);

    /// Advances to `until` and appends the events to `events`.
    fn go_to(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending>;

    /// The state in angles and positions.
    fn state(&self) -> State;

    /// The states of its parts.
    fn mode(&self) -> &Mode;

    /// The inputs now.
    fn input(&self) -> [f64; DRIVES];

    /// The value of a form now, by the linear equations.
    fn value(&self, form: &Form) -> f64;

    /// The values of a row beyond the linear equations.
    fn extra(&self) -> Extra;

    /// Continues with other parameters of the same mechanism.
    fn replace(&mut self, mechanism: &Mechanism);

    /// Passes the complete state as plain numbers; fails after an early end.
    fn pass(&mut self, pass: &mut Pass) -> Passed;

    /// Bound of the position error, if known.
    fn error(&self) -> Option<PositionError>;
}

/// The value of each column of an engine's mechanism now.
pub(super) fn shown(engine: &dyn Engine, into: &mut [f64]) {
    let (mechanism, mode) = (engine.mechanism(), engine.mode());
    let state = engine.state();
    let value = |form: &Form| engine.value(form);
    let within = |value: f64, limit: Option<f64>| limit.map_or(value, |limit| value.clamp(-limit, limit));
    let input = engine.input();
    for (into, heading) in into.iter_mut().zip(&mechanism.columns) {
        *into = match heading.shown {
            Shown::Time => engine.time(),
            Shown::Input(drive) => input[drive],
            Shown::Voltage(drive) => {
                within(value(&mechanism.voltage(drive, mode)), mechanism.drives[drive].amplifier.voltage_limit)
            }
            Shown::Current(drive) => {
                within(value(&mechanism.current(drive, mode)), mechanism.drives[drive].amplifier.current_limit)
            }
            Shown::SecondPhase(drive) => state.current[mechanism.first_current(drive) + 1],
            Shown::Position(body, factor) => state.position[body] * factor,
            Shown::Speed(body, factor) => state.speed[body] * factor,
            Shown::Stretch(spring) => value(&Form::stretch(spring)),
            Shown::Force(spring, factor) => {
                let extra = engine.extra().force[spring];
                (value(&mechanism.spring_force(spring, mode)) + extra) * factor
            }
            Shown::Friction(body) => friction(engine, body, &state),
            Shown::Motion(body) => f64::from(mode.motion[body].code()),
            Shown::Bristle(body) => engine.extra().bristle[body],
            Shown::Contact(spring) => {
                let what = match mechanism.springs[spring].law {
                    SpringLaw::Tension { .. } => What::Span(spring),
                    _ => What::Gap(spring),
                };
                f64::from(mode.status(what).code())
            }
            Shown::Counts(body, counts) => (state.position[body] * counts).round(),
        } + 0.0;
    }
}

/// Friction on a body now.
fn friction(engine: &dyn Engine, body: usize, state: &State) -> f64 {
    let (mechanism, mode, extra) = (engine.mechanism(), engine.mode(), engine.extra());
    // Friction on a body at rest balances its load, which a lossy gear determines between two limits only.
    let load =
        |positive: bool, forward: bool| engine.value(&mechanism.load(body, forward, &mode.with_torque(positive)));
    let all = [load(true, true), load(true, false), load(false, true), load(false, false)];
    let least = all.iter().fold(f64::INFINITY, |a: f64, b| a.min(*b));
    let most = all.iter().fold(f64::NEG_INFINITY, |a: f64, b| a.max(*b));
    let beyond: f64 = (mechanism.springs.iter().zip(extra.force))
        .flat_map(|(spring, force)| spring.arms.iter().map(move |arm| (arm, force)))
        .filter(|((other, _), _)| mechanism.leader(*other) == body)
        .map(|((other, arm), force)| -mechanism.ratio(*other) * arm * force)
        .sum();
    mechanism.friction_value(body, mode.motion[body], state.speed[body], (least + beyond, most + beyond))
        + extra.friction[body]
}

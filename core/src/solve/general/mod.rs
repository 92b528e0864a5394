//! The general solver: any friction law, spans that follow the cart, steppers, and a bridge that yaws.
//!
//! The modes, their linear equations and their guards are those of the exact solver. Nonlinear forces of friction laws,
//! belts, and the part of a mass matrix that is not diagonal are approximated within a step by quartics of time, which
//! collocation finds ([`step`]). With these the equations are linear, and solved as by the exact solver ([`linear`]): a
//! step is a product of matrices, or a Taylor series along which guards are searched for their first fall, so that two
//! crossings within a step are detected. A step with an event is repeated up to the event.

mod bristles;
mod calm;
mod change;
mod dynamics;
mod fall;
mod field;
mod linear;
mod model;
mod newton;
mod quartic;
mod radau;
mod rows;
mod run;
mod saved;
mod shown;
mod solved;
mod sources;
mod step;
mod stepping;
mod stretch;

use super::coordinates::Coordinates;
use super::engine::Engine;
use super::inputs::Pieces;
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS};
use super::record::Extra;
use super::rules::{self, Rules};
use super::saved::{Pass, Passed};
use super::{Cost, Ending, Event, PositionError};
use crate::error::{Error, Result};
use crate::friction::Law;
use crate::mechanism::{DRIVES, Form, Layout, Mechanism, Mode, MotionKind, State, Transition};
use crate::signal::DEGREE;
pub use dynamics::{Dynamics, Quantity};
use field::Field;
use linear::Set;
use model::{MOST, MOST_GUARDS, Model, Vector};
pub(super) use run::GeneralRun;
use std::ops::RangeInclusive;
use std::sync::Arc;
use step::StepBuffers;
use stretch::Stretch;

/// Most steps of a run, by what is known beforehand of its fastest rate.
const MOST_STEPS: f64 = 1e10;

/// Most modes that are kept ready.
const MOST_KNOWN: usize = 256;

/// Valid tolerances, m.
pub(super) const TOLERANCES: RangeInclusive<f64> = 1e-14..=1e-2;

/// Rejects an invalid tolerance, and a run of too many steps.
pub(super) fn check(fastest: f64, until: f64, tolerance: f64) -> Result<()> {
    if !TOLERANCES.contains(&tolerance) {
        return Err(Error::new(format!("a tolerance of {tolerance:e} is invalid"))
            .allowed("from 1e-14 to 0.01")
            .next("take 1e-9, the default"));
    }
    let steps = fastest * until / radau::REACH;
    if steps > MOST_STEPS {
        return Err(Error::new(format!(
            "the general solver would need some {steps:.0e} steps: something here changes within {:.0e} s",
            1.0 / fastest
        ))
        .allowed(format!("up to {MOST_STEPS:e} steps"))
        .next("leave out the inductance, the damping or the friction that is as fast as that, or shorten the run"));
    }
    Ok(())
}

/// A mode made ready, and steps of it.
#[derive(Clone)]
struct Known {
    field: Arc<Field>,
    /// Sets by length, each with the number of its steps.
    sets: Vec<(Arc<Set>, u32)>,
}

/// A running machine: state, mode, and all data to continue. A clone continues identically.
#[derive(Clone)]
pub(super) struct Core {
    model: Arc<Model>,
    pub(super) coordinates: Coordinates,
    /// Steps are this long, or halves, quarters, doubles of it, and end on multiples of their length, s.
    interval: f64,
    /// The length that the next step may have by the last one's error, s.
    step: f64,
    /// The time in which the fastest of the machine changes, s.
    moment: f64,
    relative: f64,
    absolute: Vector,
    y: Vector,
    pub(super) rules: Rules,
    known: Vec<Known>,
    /// The number of the present mode among them.
    present: usize,
    room: Option<Box<StepBuffers>>,
    stretch: Stretch,
    /// Present time from the beginning of the stretch, s.
    tau: f64,
    /// The largest torque that each gear has carried, N m at the motor's shaft.
    torque: [f64; DRIVES],
    /// Values of the conditions at the last evaluation.
    values: [f64; MOST_GUARDS],
    /// If steps do not detect speeds that pass zero: the value above zero below which a condition counts as fallen.
    outside: Option<f64>,
    pace: Pace,
    end: f64,
    /// Number of modes so far.
    taken: u64,
    /// Number of events whose own condition does not hold at their time.
    unmet: u64,
    noise: Noise,
    pub(super) cost: Cost,
}

/// Random numbers between −`size` and `size`, the same in every run.
#[derive(Clone, Copy, Default)]
struct Noise {
    size: f64,
    state: u64,
}

impl Noise {
    /// Knuth's linear congruential generator.
    fn next(&mut self) -> f64 {
        self.state = self.state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let share = (self.state >> 11) as f64 / (1_u64 << 53) as f64;
        self.size * (2.0 * share - 1.0)
    }
}

/// The valid part of a step: to its end, or to its first event.
struct StepAdvance<'a> {
    stretch: &'a Stretch,
    /// Beginning and end, and the end without an event.
    from: f64,
    until: f64,
    to: f64,
    begin: &'a Vector,
    /// True if nothing moves.
    rests: bool,
    dense: &'a dyn Fn(f64) -> Vector,
}

/// Observer of each step.
trait Witness {
    /// Sees a step.
    fn see(&mut self, core: &mut Core, way: &StepAdvance);

    /// True to continue.
    fn ask(&mut self) -> bool;
}

/// An observer that does nothing and continues.
struct Nobody;

impl Witness for Nobody {
    fn see(&mut self, _: &mut Core, _: &StepAdvance) {}

    fn ask(&mut self) -> bool {
        true
    }
}

/// A guard that fell.
struct Hit {
    tau: f64,
    y: Vector,
    fallen: Transition,
}

impl Core {
    /// Solver of a machine in `start`; `tolerance` is the error allowed in each step, relative and, of small
    /// quantities, absolute; `fastest` is its fastest rate, 1/s, `interval` what its steps fit into, and `end` how far
    /// it is to go.
    pub(super) fn new(
        mechanism: &Mechanism,
        layout: Layout,
        start: &State,
        (tolerance, fastest): (f64, f64),
        (interval, end): (f64, f64),
    ) -> Self {
        let (mut coordinates, inner) = Coordinates::new(&layout, start);
        let seen = Arc::new(mechanism.seen_from(&layout, start));
        let mode = seen.first_mode(start);
        coordinates.hold(&layout, &mode, &inner);
        let model = Model::new(seen, layout);
        let mechanism = &*model.mechanism;
        let y = model.vector(&inner);
        // An angle of 1 rad is as much as r at the belt.
        let turning = mechanism.bodies.iter().filter(|body| matches!(body.kind, MotionKind::Rotary { .. }));
        let r = turning.map(|body| body.kind.lever()).fold(f64::INFINITY, f64::min);
        let r = if r.is_finite() { r } else { 1.0 };
        let mut absolute = [tolerance; MOST];
        for (body, part) in mechanism.bodies.iter().enumerate().filter(|(_, part)| !part.is_rotor) {
            absolute[model.coordinate(body)] *= r;
            if part.kind == MotionKind::Linear {
                absolute[model.speed(body)] *= r;
            }
            let friction = &part.friction;
            if let (Some(place), Law::LuGre { stiffness, .. }) = (model.bristle[body], friction.law) {
                // Bristles bend by F_b/σ₀ at most.
                absolute[place] = tolerance * friction.forward.breakaway.max(friction.backward.breakaway) / stiffness;
            }
        }
        for phased in &model.phased {
            // Currents as shares of what the phases carry.
            phased.currents.into_iter().for_each(|place| absolute[place] *= phased.phases.amplitude);
        }
        let model = Arc::new(model);
        let field = Arc::new(Field::new(&model, &mode));
        Self {
            model,
            coordinates,
            interval,
            step: f64::INFINITY,
            moment: 1.0 / fastest,
            relative: tolerance,
            absolute,
            y,
            rules: Rules::new(mode),
            known: vec![Known { field, sets: Vec::new() }],
            present: 0,
            room: None,
            stretch: Stretch::new(Pieces::held(&[], 0.0, 0.0), f64::INFINITY),
            tau: 0.0,
            torque: [0.0; DRIVES],
            values: [0.0; MOST_GUARDS],
            outside: None,
            pace: Pace::default(),
            end,
            taken: 0,
            unmet: 0,
            noise: Noise::default(),
            cost: Cost { modes: 1, ..Cost::default() },
        }
    }

    pub(super) fn time(&self) -> f64 {
        self.stretch.begin + self.tau
    }

    /// Takes up new inputs.
    fn take_up(&mut self, stretch: Stretch) {
        self.cost.pieces += 1;
        (self.stretch, self.tau) = (stretch, 0.0);
        self.rules.at_edge = true;
        rules::settle(self);
    }

    /// The present mode made ready.
    fn field(&self) -> Arc<Field> {
        Arc::clone(&self.known[self.present].field)
    }

    /// Has the equations of the mode at hand.
    fn make_ready(&mut self) {
        let known = self.known.iter().position(|known| known.field.mode == self.rules.mode);
        if known.is_none() && self.known.len() == MOST_KNOWN {
            // A stepper that has lost its field comes to a new mode with every tooth, and never to those again.
            self.known.clear();
        }
        self.present = known.unwrap_or_else(|| {
            let field = Arc::new(Field::new(&self.model, &self.rules.mode));
            self.known.push(Known { field, sets: Vec::new() });
            self.cost.modes += 1;
            self.known.len() - 1
        });
    }
}

impl Engine for Core {
    fn copy(&self) -> Box<dyn Engine> {
        Box::new(self.clone())
    }

    fn mechanism(&self) -> &Mechanism {
        &self.model.mechanism
    }

    fn time(&self) -> f64 {
        Core::time(self)
    }

    fn degree(&self) -> usize {
        DEGREE
    }

    fn raised(&self, _: usize) -> Box<dyn Engine> {
        self.copy()
    }

    fn take_input(&mut self, pieces: &Pieces) {
        self.take_up(Stretch::new(*pieces, f64::INFINITY));
    }

    /// Steps are as short as the inputs need by themselves.
    fn bound_input(&mut self, _: &Pieces, _: f64) {}

    fn go_to(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending> {
        self.end = until;
        self.pace = Pace::since(self.cost.steps, self.time());
        self.stretch.end = until;
        if self.rules.trouble.is_none() && self.tau < self.stretch.length() {
            self.reach(&mut Nobody);
        }
        self.rules.hand_on(events);
        self.rules.trouble.map_or(Ok(()), Err)
    }

    fn state(&self) -> State {
        self.coordinates.state(&self.model.layout, &self.model.inner(&self.y))
    }

    fn mode(&self) -> &Mode {
        &self.rules.mode
    }

    fn input(&self) -> [f64; DRIVES] {
        self.stretch.input(self.tau)
    }

    fn value(&self, form: &Form) -> f64 {
        self.model.value(form, &self.model.inner(&self.y), &self.input())
    }

    fn extra(&self) -> Extra {
        self.model.extra(&self.rules.mode, &self.y)
    }

    fn replace(&mut self, mechanism: &Mechanism) {
        Core::replace(self, mechanism);
    }

    fn pass(&mut self, pass: &mut Pass) -> Passed {
        Core::pass(self, pass)
    }

    /// Nothing is known of it while it goes; [`super::ErrorEstimate`] has it of a run.
    fn error(&self) -> Option<PositionError> {
        None
    }
}

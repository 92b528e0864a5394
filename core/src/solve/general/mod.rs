//! The general solver: any friction law, and spans that follow the cart.
//!
//! The modes, their linear equations and their guards are those of the exact solver. What laws and belts add to them is
//! told within a step by quartics of time, which collocation finds ([`step`]); with them the equations are linear again,
//! and solved as exactly as the exact solver does ([`linear`]): a step is a product of matrices, or a Taylor series
//! along which guards are searched for their first fall, so that two crossings within a step are seen. A step with an
//! event in it is taken again up to the event.

mod dynamics;
mod fall;
mod field;
mod linear;
mod model;
mod newton;
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
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS, most_events};
use super::record::Extra;
use super::rules::{CHANGES_AT_ONCE, MOMENT, TURNS_AT_ONCE};
use super::saved::{Pass, Passed};
use super::{Cost, Ending, Event, PositionError};
use crate::error::{Error, Result};
use crate::friction::{Law, Motion};
use crate::mechanism::{
    AmplifierMode, Cause, DRIVES, Kind, Layout, Limit, Mechanism, Mode, Part, State, Status, Switch,
};
use crate::mechanism::{Form, What};
use crate::signal::DEGREE;
pub use dynamics::{Dynamics, Quantity};
use field::Field;
use linear::Set;
use model::{MOST, Model, Vector};
pub(super) use run::Run;
use std::sync::Arc;
use step::Room;
use stretch::Stretch;

/// Most steps of a run, by what is known beforehand of its fastest rate.
const MOST_STEPS: f64 = 1e10;

/// Refuses a tolerance that is none, and a run of more steps than anybody waits for.
pub(super) fn check(fastest: f64, until: f64, tolerance: f64) -> Result<()> {
    if !(1e-14..=1e-2).contains(&tolerance) {
        return Err(Error::new(format!("a tolerance of {tolerance:e} is of no use"))
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
    /// By their lengths, with how often each was taken.
    sets: Vec<(Arc<Set>, u32)>,
}

/// A machine under way: its state, its mode, and what is needed to go on. A clone of it goes on in the same way.
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
    pub(super) mode: Mode,
    known: Vec<Known>,
    /// The number of the present mode among them.
    present: usize,
    room: Option<Box<Room>>,
    stretch: Stretch,
    /// Where it stands, counted from the beginning of the stretch, s.
    tau: f64,
    /// By how much the load on a stuck body may pass its limit before it counts, and for a moment after it has changed
    /// what any other part is watched by.
    slack: [f64; Cause::KINDS],
    /// The same for a gear's torque, and the largest torque that it has carried, N m at the motor's shaft.
    torque_slack: [f64; DRIVES],
    torque: [f64; DRIVES],
    changed_at: f64,
    changes: usize,
    pace: Pace,
    end: f64,
    pub(super) events: Vec<Event>,
    /// How many events were handed on before those.
    handed_on: usize,
    /// How many modes have been taken up.
    taken: u64,
    /// Number of events whose own condition does not hold at their time.
    unmet: u64,
    noise: Noise,
    pub(super) cost: Cost,
    pub(super) trouble: Option<Ending>,
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

/// A step that was taken, as far as it counts: to its end, or to the first event in it.
struct Way<'a> {
    stretch: &'a Stretch,
    /// Where it begins and where it ends, and where it would have ended.
    from: f64,
    until: f64,
    to: f64,
    begin: &'a Vector,
    /// Whether nothing moves.
    rests: bool,
    dense: &'a dyn Fn(f64) -> Vector,
}

/// Whoever is told of each step.
trait Witness {
    /// Sees a step.
    fn see(&mut self, core: &mut Core, way: &Way);

    /// Whether to go on.
    fn ask(&mut self) -> bool;
}

/// Nobody looks, and it goes on.
struct Nobody;

impl Witness for Nobody {
    fn see(&mut self, _: &mut Core, _: &Way) {}

    fn ask(&mut self) -> bool {
        true
    }
}

/// A guard that fell.
struct Hit {
    tau: f64,
    y: Vector,
    cause: Cause,
}

impl Core {
    /// That of a machine in `start`; `tolerance` is the error allowed in each step, relative and, of small quantities,
    /// absolute; `fastest` is its fastest rate, 1/s, `interval` what its steps fit into, and `end` how far it is to go.
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
        let mut y = model.vector(&inner);
        for (current, drive) in model.current.iter().zip(&mechanism.drives) {
            if let (Some(place), false) = (current, drive.has_current_state()) {
                y[*place] = 0.0;
            }
        }
        // An angle of 1 rad is as much as r at the belt.
        let turning = mechanism.bodies.iter().filter(|body| matches!(body.kind, Kind::Rotary { .. }));
        let r = turning.map(|body| body.kind.lever()).fold(f64::INFINITY, f64::min);
        let r = if r.is_finite() { r } else { 1.0 };
        let mut absolute = [tolerance; MOST];
        for (body, part) in mechanism.bodies.iter().enumerate().filter(|(_, part)| !part.is_rotor) {
            absolute[model.coordinate(body)] *= r;
            if part.kind == Kind::Linear {
                absolute[model.speed(body)] *= r;
            }
            let friction = &part.friction;
            if let (Some(place), Law::LuGre { stiffness, .. }) = (model.bristle[body], friction.law) {
                // Bristles bend by F_b/σ₀ at most.
                absolute[place] = tolerance * friction.forward.breakaway.max(friction.backward.breakaway) / stiffness;
            }
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
            mode,
            known: vec![Known { field, sets: Vec::new() }],
            present: 0,
            room: None,
            stretch: Stretch::of(Pieces::held(&[], 0.0, 0.0), f64::INFINITY),
            tau: 0.0,
            slack: [0.0; Cause::KINDS],
            torque_slack: [0.0; DRIVES],
            torque: [0.0; DRIVES],
            changed_at: f64::NEG_INFINITY,
            changes: 0,
            pace: Pace::default(),
            end,
            events: Vec::new(),
            handed_on: 0,
            taken: 0,
            unmet: 0,
            noise: Noise::default(),
            cost: Cost { modes: 1, ..Cost::default() },
            trouble: None,
        }
    }

    pub(super) fn time(&self) -> f64 {
        self.stretch.begin + self.tau
    }

    /// Takes up new inputs.
    fn take_up(&mut self, stretch: Stretch) {
        self.cost.pieces += 1;
        (self.stretch, self.tau) = (stretch, 0.0);
        self.resolve();
    }

    /// The present mode made ready.
    fn field(&self) -> Arc<Field> {
        Arc::clone(&self.known[self.present].field)
    }

    /// The motion of a body at zero speed under its present load.
    fn decide(&self, body: usize, input: &[f64; DRIVES]) -> Motion {
        let (model, state) = (&*self.model, &self.y);
        let (mode, noise) = (&self.mode, model.noise(body, &self.mode, state, input));
        let held = model.bristle_force(body, state);
        if model.load(body, true, mode, state, input) - held > model.breakaway(body, true, state) + noise {
            Motion::Forward
        } else if model.load(body, false, mode, state, input) - held < -model.breakaway(body, false, state) - noise {
            Motion::Backward
        } else {
            Motion::Stuck
        }
    }

    /// Goes into the mode that follows when `cause` ends the present one.
    fn change(&mut self, cause: Cause) {
        let time = self.time();
        let at_once = time - self.changed_at <= MOMENT * self.moment + 4.0 * f64::EPSILON * time;
        self.changes = if at_once { self.changes + 1 } else { 0 };
        self.changed_at = time;
        if self.changes > CHANGES_AT_ONCE {
            self.trouble = Some(Ending::TooManyEvents { time });
        }
        let again = self.changes > TURNS_AT_ONCE;
        let input = &self.input();
        let by_rounding = self.is_by_tolerance(cause);
        let (body, to) = match cause {
            Cause::GearTorque(drive) => {
                let positive = &mut self.mode.drive[drive].torque_positive;
                *positive = !*positive;
                // Where rounding calls it negative either way it is zero.
                self.torque_slack[drive] = if again { f64::INFINITY } else { self.relative * self.torque[drive] };
                self.enter();
                return;
            }
            Cause::Switch(switch) => {
                self.switch(switch);
                return;
            }
            Cause::Leave(_) => {
                self.trouble = Some(Ending::LeftTravel { time });
                return;
            }
            Cause::Stop(body) => {
                for follower in self.model.mechanism.followers(body) {
                    self.y[self.model.speed(follower)] = 0.0;
                }
                (body, if again { Motion::Stuck } else { self.decide(body, input) })
            }
            Cause::BreakForward(body) => (body, Motion::Forward),
            Cause::BreakBackward(body) => (body, Motion::Backward),
        };
        let from = self.mode.motion[body];
        let side = if to == Motion::Stuck { from } else { to };
        let forward = side != Motion::Backward;
        let load = self.model.load(body, forward, &self.mode, &self.y, input);
        for (cause, tolerance) in self.tolerances_at_rest(body, input) {
            self.slack[cause.kind()] = if again { 10.0 } else { 1.0 } * tolerance;
        }
        for follower in self.model.mechanism.followers(body) {
            self.mode.motion[follower] = to;
        }
        // That the gear holds a rotor is nobody's stick.
        if !self.model.mechanism.bodies[body].is_rotor {
            let part = Part::of(&self.model.mechanism, What::Body(body));
            let (from, to) = (Status::Motion(from), Status::Motion(to));
            Event { time, part, from, to, load, by_rounding }.note(&mut self.events);
        }
        self.enter();
    }

    /// By how much the load on a body at rest may pass its breakaway on either side before it counts: what rounding may
    /// do to it.
    fn tolerances_at_rest(&self, body: usize, input: &[f64; DRIVES]) -> [(Cause, f64); 2] {
        let noise = 2.0 * self.model.noise(body, &self.mode, &self.y, input);
        [(Cause::BreakForward(body), true), (Cause::BreakBackward(body), false)]
            .map(|(cause, forward)| (cause, noise.max(1e-12 * self.model.breakaway(body, forward, &self.y))))
    }

    /// Whether a body stops where the tolerance decides: what still slows it down is less than the formula may be off
    /// by.
    fn is_by_tolerance(&self, cause: Cause) -> bool {
        let Cause::Stop(body) = cause else { return false };
        let rate = self.field().rate(&self.input(), &self.y);
        let place = self.model.speed(body);
        // Within the time in which the fastest of it changes.
        rate[place].abs() * self.moment <= self.absolute[place]
    }

    /// Lets a part other than a body do something else.
    fn switch(&mut self, switch: Switch) {
        let (time, what) = (self.time(), switch.what());
        let from = self.mode.status(what);
        self.mode.switch(switch);
        let (part, to) = (Part::of(&self.model.mechanism, what), self.mode.status(what));
        Event { time, part, from, to, load: 0.0, by_rounding: false }.note(&mut self.events);
        if let Switch::Current(drive, side) = switch {
            let amplifier = &self.model.mechanism.drives[drive].amplifier;
            if let (Some(place), AmplifierMode::Voltage) = (self.model.current[drive], amplifier.mode)
                && side != Limit::Inside
            {
                // It stands at its limit, to the last bit.
                self.y[place] = side.sign() * amplifier.current_limit.unwrap_or(0.0);
            }
        }
        self.enter();
        // What has just become a condition on this part is zero but for what the integrator may be off by.
        let (field, input) = (self.field(), self.input());
        let guards = field.guards(&input, &self.y);
        for (index, cause) in field.watches.iter().enumerate() {
            if cause.is_of_same_part(Cause::Switch(switch)) {
                let rounding = field.rounding(index, &self.absolute.map(|absolute| absolute / self.relative));
                let error = (self.relative * field.size(index, &input, &self.y)).max(rounding);
                let error = if self.changes > TURNS_AT_ONCE { 10.0 * error } else { error };
                let zero = guards[index].abs() <= 4.0 * error;
                self.slack[cause.kind()] = if zero { f64::max(-guards[index], 0.0) + error } else { 0.0 };
            }
        }
    }

    fn enter(&mut self) {
        self.taken += 1;
        self.coordinates.hold(&self.model.layout, &self.mode, &self.model.inner(&self.y));
        self.make_ready();
    }

    /// Has the equations of the mode at hand.
    fn make_ready(&mut self) {
        let known = self.known.iter().position(|known| known.field.mode == self.mode);
        self.present = known.unwrap_or_else(|| {
            let field = Arc::new(Field::new(&self.model, &self.mode));
            self.known.push(Known { field, sets: Vec::new() });
            self.cost.modes += 1;
            self.known.len() - 1
        });
    }

    /// After an edge of the input too, a load that passes a breakaway by rounding alone does not break it.
    fn forgive_loads(&mut self) {
        let (model, input) = (Arc::clone(&self.model), self.input());
        for body in model.mechanism.leaders().filter(|body| self.mode.motion[*body] == Motion::Stuck) {
            for (cause, tolerance) in self.tolerances_at_rest(body, &input) {
                let own = &mut self.slack[cause.kind()];
                *own = own.max(tolerance);
            }
        }
    }

    /// Changes modes, without time passing, until every load that is held can be.
    fn resolve(&mut self) {
        let time = self.time();
        if self.tau == 0.0 {
            self.forgive_loads();
        }
        for _ in 0..CHANGES_AT_ONCE {
            let field = self.field();
            let guards = field.guards(&self.input(), &self.y);
            let falls = |&(cause, value): &(Cause, f64)| match cause {
                // A speed tells by itself, over the next step.
                Cause::Stop(_) => false,
                Cause::GearTorque(drive) => value < -self.torque_slack[drive],
                cause => value < -self.slack[cause.kind()],
            };
            let fallen = field.watches.iter().copied().zip(guards).filter(falls).min_by_key(|(cause, _)| cause.rank());
            match fallen {
                Some((cause, _)) => {
                    self.change(cause);
                    if self.trouble.is_some() {
                        return;
                    }
                }
                None => {
                    self.check_events();
                    return;
                }
            }
        }
        self.trouble = Some(Ending::TooManyEvents { time });
    }

    /// Ends a run that has had more events than it may have by now.
    fn check_events(&mut self) {
        let time = self.time();
        if (self.handed_on + self.events.len()) as f64 > most_events(time) {
            self.trouble = Some(Ending::TooManyEvents { time });
        }
    }

    /// Hands the events on.
    fn hand_on(&mut self, events: &mut Vec<Event>) {
        self.handed_on += self.events.len();
        events.append(&mut self.events);
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
        self.take_up(Stretch::of(*pieces, f64::INFINITY));
    }

    /// Steps are as short as the inputs need by themselves.
    fn bound_input(&mut self, _: &Pieces, _: f64) {}

    fn go_to(&mut self, until: f64, events: &mut Vec<Event>) -> std::result::Result<(), Ending> {
        self.end = until;
        self.pace = Pace::since(self.cost.steps, self.time());
        self.stretch.end = until;
        if self.trouble.is_none() && self.tau < self.stretch.length() {
            self.reach(&mut Nobody);
        }
        self.hand_on(events);
        self.trouble.map_or(Ok(()), Err)
    }

    fn state(&self) -> State {
        self.coordinates.state(&self.model.layout, &self.model.inner(&self.y))
    }

    fn mode(&self) -> &Mode {
        &self.mode
    }

    fn input(&self) -> [f64; DRIVES] {
        self.stretch.input(self.tau)
    }

    fn value(&self, form: &Form) -> f64 {
        self.model.value(form, &self.model.inner(&self.y), &self.input())
    }

    fn extra(&self) -> Extra {
        self.model.extra(&self.mode, &self.y)
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

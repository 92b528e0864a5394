//! The general solver: any friction law, and spans that follow the cart.
//!
//! Between mode changes and edges of the input the equations are smooth, and an adaptive formula of order eight
//! (Dormand and Prince's DOP853, from a library) integrates them. The modes and their guards are those of the exact
//! solver. Each step's dense output is a polynomial, and so are the guards along it: their first fall is searched for
//! as the exact solver does, so that two crossings within a step are seen; the step is then taken again up to the
//! event.

mod dynamics;
mod fall;
mod model;
mod run;
mod saved;
mod shown;
mod stretch;

use super::coordinates::Coordinates;
use super::inputs::Pieces;
use super::machine::Engine;
use super::pace::{Pace, STEPS_BETWEEN_QUESTIONS};
use super::record::Extra;
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
use fall::NODES;
use ivp::dense::StepInterpolant;
use ivp::methods::{DOP853, Tolerance};
use ivp::prelude::FirstOrderSystem;
use ivp::solout::{ControlFlag, SolOut};
use model::{Field, MOST, Model, Vector};
pub(super) use run::Run;
use std::sync::Arc;
use stretch::Stretch;

/// Events allowed at once, and per simulated second: more is an accumulation, not a machine.
const EVENTS_AT_LEAST: f64 = 1e5;
const EVENTS_PER_SECOND: f64 = 1e7;

/// Mode changes allowed at one instant.
const CHANGES_AT_ONCE: usize = 100;

/// Turns of a body at one instant after which it is taken to rest.
const TURNS_AT_ONCE: usize = 20;

/// Most steps of a run, by what is known beforehand of its fastest rate.
const MOST_STEPS: f64 = 1e10;

/// Refuses a tolerance that is none, and a run of more steps than anybody waits for.
pub(super) fn check(fastest: f64, until: f64, tolerance: f64) -> Result<()> {
    if !(1e-14..=1e-2).contains(&tolerance) {
        return Err(Error::new(format!("a tolerance of {tolerance:e} is of no use"))
            .allowed("from 1e-14 to 0.01")
            .next("take 1e-9, the default"));
    }
    let steps = fastest * until / REACH;
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

/// h·|λ| up to which the formula is stable.
const REACH: f64 = 6.0;

/// h·|λ| of the first step after an event or an edge.
const FIRST: f64 = 0.3;

/// A machine under way: its state, its mode, and what is needed to go on. A clone of it goes on in the same way.
#[derive(Clone)]
pub(super) struct Core {
    model: Arc<Model>,
    pub(super) coordinates: Coordinates,
    solver: DOP853,
    /// The step to begin with after an event or an edge, s.
    first_step: f64,
    relative: f64,
    absolute: Vector,
    y: Vector,
    pub(super) mode: Mode,
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
    modes: Vec<Mode>,
    /// How many modes have been taken up.
    taken: u64,
    pub(super) cost: Cost,
    pub(super) trouble: Option<Ending>,
}

/// Whoever is told of each step: of what is integrated, from where to where, and the states within.
trait Witness {
    /// Sees the way from the state `begin` at `from` to `until`, of a step that went to `to`.
    fn see(&mut self, core: &mut Core, field: &Field, way: (f64, f64, f64), begin: &Vector, at: &dyn Fn(f64) -> Vector);

    /// Whether to go on.
    fn ask(&mut self) -> bool;
}

/// Nobody looks, and it goes on.
struct Nobody;

impl Witness for Nobody {
    fn see(&mut self, _: &mut Core, _: &Field, _: (f64, f64, f64), _: &Vector, _: &dyn Fn(f64) -> Vector) {}

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
    /// absolute; `fastest` is its fastest rate, 1/s, and `end` how far it is to go.
    pub(super) fn new(
        mechanism: &Mechanism,
        layout: Layout,
        start: &State,
        (tolerance, fastest, end): (f64, f64, f64),
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
        let first_step = FIRST / fastest;
        Self {
            model: Arc::new(model),
            coordinates,
            // It is stopped from outside: by its observer.
            solver: DOP853 {
                max_steps: usize::MAX - 1,
                stiff_test: usize::MAX,
                first_step: Some(first_step),
                ..DOP853::default()
            },
            first_step,
            relative: tolerance,
            absolute,
            y,
            mode,
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
            modes: vec![mode],
            taken: 0,
            cost: Cost::default(),
            trouble: None,
        }
    }

    pub(super) fn time(&self) -> f64 {
        self.stretch.begin + self.tau
    }

    /// Takes up a new stretch of the inputs.
    fn take_up(&mut self, stretch: Stretch, continues: bool) {
        self.cost.pieces += stretch.pieces() as u64;
        if !continues {
            self.solver.first_step = Some(self.first_step);
        }
        (self.stretch, self.tau) = (stretch, 0.0);
        self.resolve();
    }

    /// Advances to the end of the stretch, event by event.
    fn reach(&mut self, witness: &mut dyn Witness) {
        while self.tau < self.stretch.length() && self.trouble.is_none() {
            let stretch = self.stretch.clone();
            let Some(hit) = self.integrate(&stretch, witness) else { continue };
            self.y = hit.y;
            self.tau = hit.tau;
            self.solver.first_step = Some(self.first_step);
            self.change(hit.cause);
            self.resolve();
        }
    }

    /// Integrates to the end of the stretch, or to the first guard that falls.
    fn integrate(&mut self, stretch: &Stretch, witness: &mut dyn Witness) -> Option<Hit> {
        let model = Arc::clone(&self.model);
        let field = Field::new(&model, &self.mode, stretch);
        let length = stretch.length();
        if length - self.tau <= 64.0 * f64::EPSILON * length {
            // What is left is no step, but rounding.
            self.tau = length;
            return None;
        }
        let mut solver = DOP853 { max_step: Some(stretch.longest_step()), ..self.solver.clone() };
        // The formula looks at its longest step only from its second one on.
        let longest = stretch.longest_step().min(length - self.tau);
        solver.first_step = solver.first_step.map(|step| step.min(longest));
        let (relative, absolute, y) = (self.relative(), self.absolute(), self.y);
        let (from, size) = (self.tau, self.model.size);
        let mut observer =
            Observer { watches: field.watches(), run: self, field: &field, witness, values: Vec::new(), hit: None };
        let result = solver.solve(&field, from, &y[..size], length, relative, absolute, Some(&mut observer));
        let hit = observer.hit;
        self.cost.evaluations += field.evaluations();
        match result {
            Ok(result) if result.is_ok() && hit.is_none() && self.trouble.is_none() => {
                self.tau = length;
                self.solver.first_step = Some(result.h.abs().max(self.first_step));
            }
            Ok(result) if result.is_ok() => {}
            // Not even the smallest step will do: this is no motion any more.
            _ => self.trouble = Some(Ending::Diverged { time: stretch.begin + self.tau }),
        }
        hit
    }

    fn relative(&self) -> Tolerance {
        Tolerance::Scalar(self.relative)
    }

    fn absolute(&self) -> Tolerance {
        Tolerance::Vector(self.absolute[..self.model.size].to_vec())
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
        let at_once = time - self.changed_at <= 1e-15 + 4.0 * f64::EPSILON * time;
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
        let field = Field::new(&self.model, &self.mode, &self.stretch);
        let mut rate = [0.0; MOST];
        field.derivative(self.tau, &self.y, &mut rate[..self.model.size]);
        let place = self.model.speed(body);
        // Within the time in which the fastest of it changes.
        rate[place].abs() * self.first_step / FIRST <= self.absolute[place]
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
        let field = Field::new(&self.model, &self.mode, &self.stretch);
        let guards = field.guards(self.tau, &self.y);
        for (index, cause) in field.watches().into_iter().enumerate() {
            if cause.is_of_same_part(Cause::Switch(switch)) {
                let error = self.relative * field.size(index, self.tau, &self.y);
                let error = if self.changes > TURNS_AT_ONCE { 10.0 * error } else { error };
                let zero = guards[index].abs() <= 4.0 * error;
                self.slack[cause.kind()] = if zero { f64::max(-guards[index], 0.0) + error } else { 0.0 };
            }
        }
    }

    fn enter(&mut self) {
        self.taken += 1;
        self.coordinates.hold(&self.model.layout, &self.mode, &self.model.inner(&self.y));
        if !self.modes.contains(&self.mode) {
            self.modes.push(self.mode);
        }
    }

    /// Changes modes, without time passing, until every load that is held can be.
    fn resolve(&mut self) {
        let time = self.time();
        if self.tau == 0.0 {
            // After an edge of the input too, a load that passes a breakaway by rounding alone does not break it.
            let (model, input) = (Arc::clone(&self.model), self.input());
            for body in model.mechanism.leaders().filter(|body| self.mode.motion[*body] == Motion::Stuck) {
                for (cause, tolerance) in self.tolerances_at_rest(body, &input) {
                    let own = &mut self.slack[cause.kind()];
                    *own = own.max(tolerance);
                }
            }
        }
        for _ in 0..CHANGES_AT_ONCE {
            let field = Field::new(&self.model, &self.mode, &self.stretch);
            let guards = field.guards(self.tau, &self.y);
            let falls = |&(cause, value): &(Cause, f64)| match cause {
                // A speed tells by itself, over the next step.
                Cause::Stop(_) => false,
                Cause::GearTorque(drive) => value < -self.torque_slack[drive],
                cause => value < -self.slack[cause.kind()],
            };
            let fallen = field.watches().into_iter().zip(guards).filter(falls).min_by_key(|(cause, _)| cause.rank());
            match fallen {
                Some((cause, _)) => {
                    self.change(cause);
                    if self.trouble.is_some() {
                        return;
                    }
                }
                None => {
                    if (self.handed_on + self.events.len()) as f64 > EVENTS_AT_LEAST + EVENTS_PER_SECOND * time {
                        self.trouble = Some(Ending::TooManyEvents { time });
                    }
                    return;
                }
            }
        }
        self.trouble = Some(Ending::TooManyEvents { time });
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
        self.take_up(Stretch::of(*pieces, f64::INFINITY), false);
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
        self.handed_on += self.events.len();
        events.append(&mut self.events);
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

/// Looks at every step: finds the guard that falls first, and shows the way until there.
struct Observer<'r> {
    run: &'r mut Core,
    field: &'r Field<'r>,
    witness: &'r mut dyn Witness,
    watches: Vec<Cause>,
    /// The conditions at the nodes of a step.
    values: Vec<[f64; NODES]>,
    hit: Option<Hit>,
}

impl SolOut for Observer<'_> {
    fn solout(&mut self, from: f64, to: &mut f64, y: &mut [f64], dense: Option<&StepInterpolant<'_>>) -> ControlFlag {
        let (to, Some(dense)) = (*to, dense) else { return ControlFlag::Continue };
        let size = y.len();
        let mut end = [0.0; MOST];
        end[..size].copy_from_slice(y);
        if !end.iter().sum::<f64>().is_finite() {
            self.run.trouble = Some(Ending::Diverged { time: self.field.stretch.begin + from });
            return ControlFlag::Interrupt;
        }
        let run = &mut *self.run;
        run.cost.steps += 1;
        let time = self.field.stretch.begin + to;
        if run.cost.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS) {
            run.trouble = run.pace.too_stiff(run.cost.steps, time, run.end);
        }
        let begin = self.run.y;
        let at = |tau: f64| {
            let mut y = [0.0; MOST];
            dense.interpolate(tau, &mut y[..size]);
            y
        };
        self.hit = self.first_fall(from, to, &begin, &end, &at);
        let until = self.hit.as_ref().map_or(to, |hit| hit.tau);
        self.witness.see(self.run, self.field, (from, until, to), &begin, &at);
        let asks = self.run.cost.steps.is_multiple_of(STEPS_BETWEEN_QUESTIONS);
        if (asks || self.run.trouble.is_some()) && !self.witness.ask() && self.run.trouble.is_none() {
            self.run.trouble = Some(Ending::Interrupted { time });
        }
        self.run.y = end;
        self.run.tau = to;
        if self.hit.is_some() || self.run.trouble.is_some() { ControlFlag::Interrupt } else { ControlFlag::Continue }
    }
}

impl Observer<'_> {
    /// The first guard to fall between `from` and `to`, and the state there.
    fn first_fall(
        &mut self,
        from: f64,
        to: f64,
        begin: &Vector,
        end: &Vector,
        at: &impl Fn(f64) -> Vector,
    ) -> Option<Hit> {
        if self.watches.is_empty() {
            return None;
        }
        self.run.cost.looks += 1;
        let mut values = std::mem::take(&mut self.values);
        values.resize(self.watches.len(), [0.0; NODES]);
        for node in 0..NODES {
            let tau = from + (to - from) * node as f64 / (NODES - 1) as f64;
            let guards = match node {
                0 => self.field.guards(from, begin),
                7 => self.field.guards(to, end),
                _ => self.field.guards(tau, &at(tau)),
            };
            for (values, guard) in values.iter_mut().zip(guards) {
                values[node] = guard;
            }
        }
        for (values, watch) in values.iter().zip(&self.watches) {
            if let Cause::GearTorque(drive) = *watch {
                let run = &mut self.run;
                run.torque[drive] = values.iter().fold(run.torque[drive], |most, value| most.max(value.abs()));
                // What was told by nothing but rounding is told by the step.
                run.torque_slack[drive] = run.relative * run.torque[drive];
            }
        }
        let mut first: Option<(f64, f64, usize, f64)> = None;
        for (index, watch) in self.watches.iter().enumerate() {
            let run = &self.run;
            let slack = match *watch {
                // What the integrator may be off by is no stop, least of all where a body has just begun to slide.
                Cause::Stop(body) => run.absolute[run.model.speed(body)],
                Cause::GearTorque(drive) => run.torque_slack[drive],
                cause => run.slack[cause.kind()],
            };
            if let Some((s, slope)) = fall::first_fall(&values[index].map(|value| value + slack))
                && first.is_none_or(|(earliest, ..)| s < earliest)
            {
                first = Some((s, slope, index, slack));
            }
        }
        if first.is_none() {
            // A part that has clearly left its edge is watched to the last bit again.
            for (index, cause) in self.watches.iter().enumerate() {
                let slack = &mut self.run.slack[cause.kind()];
                if matches!(cause, Cause::Switch(_)) && values[index][NODES - 1] > 10.0 * *slack {
                    *slack = 0.0;
                }
            }
        }
        self.values = values;
        let (s, slope, index, slack) = first?;
        // A speed that has fallen through is looked for where it was zero.
        let slack = if matches!(self.watches[index], Cause::Stop(_)) { 0.0 } else { slack };
        let mut tau = from + s * (to - from);
        let mut y = self.leap(from, begin, tau);
        // Newton's method along the formula itself, which is more accurate than its dense output.
        for _ in 0..3 {
            let value = self.field.guards(tau, &y)[index] + slack;
            let change = -value * (to - from) / slope;
            if !(slope < 0.0 && change.abs() <= 0.01 * (to - from)) || change.abs() <= 1e-15 + f64::EPSILON * tau {
                break;
            }
            tau = (tau + change).clamp(from, to);
            y = self.leap(from, begin, tau);
        }
        Some(Hit { tau, y, cause: self.watches[index] })
    }

    /// One step of the formula to where it is wanted.
    fn leap(&self, from: f64, begin: &Vector, to: f64) -> Vector {
        if to <= from {
            return *begin;
        }
        let solver = DOP853 { first_step: Some(to - from), dense_output: true, ..self.run.solver.clone() };
        let mut arrival = Arrival(*begin);
        let y = &begin[..self.run.model.size];
        let (relative, absolute) = (self.run.relative(), self.run.absolute());
        let _ = solver.solve(self.field, from, y, to, relative, absolute, Some(&mut arrival));
        arrival.0
    }
}

/// Keeps the state at the end of a step.
struct Arrival(Vector);

impl SolOut for Arrival {
    fn solout(&mut self, _: f64, _: &mut f64, y: &mut [f64], _: Option<&StepInterpolant<'_>>) -> ControlFlag {
        self.0[..y.len()].copy_from_slice(y);
        ControlFlag::Continue
    }
}

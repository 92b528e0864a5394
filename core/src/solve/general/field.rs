//! A mode made ready: its linear part, the forces beyond it, and its guards.

use super::calm::Calm;
use super::linear::{Linear, Output, STATES, States};
use super::model::{MOST_GUARDS, Model, Vector};
use super::sources::{Argument, Phasing, SOURCES, Source};
use crate::friction::{Law, Motion};
use crate::mechanism::{
    BODIES, Cause, DRIVES, Equations, Form, Mode, ROUNDING, Ridden, Ride, Riding, Switch, Transition,
};
use std::sync::Arc;

/// A guard as a row.
struct Guard {
    row: States,
    input: [f64; DRIVES],
    constant: f64,
}

/// The equations of one mode: ẏ = A y + g + B u + Σ b_j f_j.
pub(super) struct Field {
    pub(super) model: Arc<Model>,
    pub(super) mode: Mode,
    equations: Equations,
    pub(super) watches: Vec<Transition>,
    guards: Vec<Guard>,
    pub(super) linear: Linear,
    pub(super) sources: Vec<Source>,
    /// Which of the outputs is a guard: the argument that it is, or one behind the arguments.
    pub(super) output: Vec<usize>,
    /// Arguments that errors are measured by: their places in the state, and their weights there.
    pub(super) measured: Vec<(usize, f64)>,
    /// True if guards depend on friction along the travel of a body at rest, or on bent bristles.
    pub(super) shifted: bool,
    /// Inertia that moves with each body, per unit of its leader's position.
    mass: [f64; BODIES],
    /// The bodies that bristles hold, if nothing else moves.
    pub(super) calm: Option<Calm>,
}

impl Field {
    pub(super) fn new(model: &Arc<Model>, mode: &Mode) -> Self {
        let mechanism = &*model.mechanism;
        let equations = mechanism.equations(*mode);
        let states = model.layout.states;
        let size = states.next_multiple_of(4).max(8);
        let (mut columns, mut constant, mut input) =
            (vec![[0.0; STATES]; size], [0.0; STATES], [[0.0; STATES]; DRIVES]);
        let mut put = |place: usize, rate: &Form| {
            let row = model.row(rate);
            columns.iter_mut().zip(row).for_each(|(column, value)| column[place] = value);
            constant[place] = rate.constant;
            input.iter_mut().zip(rate.input).for_each(|(column, value)| column[place] = value);
        };
        let mut mass = [1.0; BODIES];
        for (body, mass) in mass.iter_mut().enumerate().take(mechanism.bodies.len()) {
            *mass = mechanism.mass(mechanism.leader(body), &equations.inertia);
            if mode.motion[body] != Motion::Stuck {
                put(model.speed(body), &equations.acceleration[body]);
            }
            let mut way = model.layout.rate(mechanism, body);
            for (speed, motion) in way.speed.iter_mut().zip(mode.motion) {
                if motion == Motion::Stuck {
                    *speed = 0.0;
                }
            }
            put(model.coordinate(body), &way);
        }
        for (place, rate) in model.current.iter().zip(&equations.current_rate) {
            place.iter().for_each(|&place| put(place, rate));
        }
        let guard = |form: &Form| {
            let mut row = [0.0; STATES];
            row.iter_mut().zip(model.row(form)).for_each(|(own, value)| *own = value);
            Guard { row, input: form.input, constant: form.constant }
        };
        let guards = equations.guards.iter().map(|part| guard(&part.form)).collect();
        let watches = equations.guards.iter().map(|guard| guard.transition).collect();
        let mut field = Self {
            model: Arc::clone(model),
            mode: *mode,
            linear: Linear::new(size, columns, constant, input),
            equations,
            watches,
            guards,
            sources: Vec::new(),
            output: Vec::new(),
            measured: Vec::new(),
            shifted: false,
            mass,
            calm: None,
        };
        field.linear.inputs = mechanism.drives.len();
        field.add_sources();
        field.add_outputs();
        field.calm = Calm::new((model, mode), &field.sources, &field.equations, &field.mass);
        field
    }

    /// The number of the argument that is this row.
    fn argument(&mut self, row: States) -> usize {
        self.argument_of(row, [0.0; DRIVES])
    }

    /// Adds an argument with these weights of the inputs.
    fn argument_of(&mut self, row: States, input: [f64; DRIVES]) -> usize {
        let none = Output { row, input, constant: 0.0, source: Vec::new() };
        let outputs = &mut self.linear.outputs;
        outputs.iter().position(|output| *output == none).unwrap_or_else(|| {
            outputs.push(none);
            outputs.len() - 1
        })
    }

    fn argument_at(&mut self, place: usize) -> usize {
        let mut row = [0.0; STATES];
        row[place] = 1.0;
        self.argument(row)
    }

    /// Rates of the states by a force on a leader.
    fn column(&self, loads: impl Fn(usize) -> f64) -> States {
        let (model, mechanism) = (&self.model, &self.model.mechanism);
        let mut column = [0.0; STATES];
        for body in (0..mechanism.bodies.len()).filter(|&body| self.mode.motion[body] != Motion::Stuck) {
            let (leader, ratio) = mechanism.bodies[body].leader;
            // J φ̈ = what is linear + what the belt adds − what the law adds
            column[model.speed(body)] = ratio * loads(leader) / self.mass[body];
        }
        column
    }

    fn add_sources(&mut self) {
        let model = Arc::clone(&self.model);
        if !model.adds {
            return;
        }
        for (index, curved) in model.curved.iter().enumerate() {
            let motion = self.mode.motion[curved.body];
            let plain = matches!(curved.friction.law, Law::Coulomb | Law::Stribeck { .. });
            if motion == Motion::Stuck || (plain && motion == Motion::Free) {
                continue;
            }
            let speed = self.argument_at(curved.speed);
            let follows = model.mechanism.bodies[curved.body].along.is_some();
            let way = follows.then(|| self.argument_at(model.coordinate(curved.body)));
            self.sources.push(Source::Friction { curved: index, motion, speed, way });
            let column = self.column(|leader| if leader == curved.leader { -curved.ratio } else { 0.0 });
            self.linear.source.push(column);
        }
        for (index, following) in model.following.iter().enumerate() {
            let mut row = [0.0; STATES];
            following.terms.iter().for_each(|&(place, weight)| row[place] += weight);
            let length = self.argument(row);
            let arms = model.mechanism.springs[following.spring].follows.iter().flat_map(|follows| &follows.arms);
            let ways = arms.map(|&(body, _)| (body, self.argument_at(model.coordinate(body)))).collect();
            self.sources.push(Source::spring(&model, index, length, ways));
            // A slack span has no force; its guard is the force that it would have.
            let slack = self.mode.slack[following.spring];
            let arm = |leader: usize| -> f64 {
                following.arms.iter().filter(|(body, _)| *body == leader).map(|(_, arm)| -arm).sum()
            };
            let column = self.column(|leader| if slack { 0.0 } else { arm(leader) });
            self.linear.source.push(column);
        }
        self.add_phases();
        let rates = self.add_ride();
        // Speeds that forces change are what errors are measured by.
        if !self.sources.is_empty() {
            let moved = |place: &usize| self.linear.source.iter().any(|column| column[*place] != 0.0);
            for place in (0..model.layout.states).filter(moved).collect::<Vec<_>>() {
                self.argument_at(place);
            }
        }
        let rows = self.linear.outputs.iter().map(|output| &output.row);
        // One of an input alone is known.
        let first = |row: &States| row.iter().copied().enumerate().find(|(_, weight)| *weight != 0.0);
        self.measured = rows.map(|row| first(row).unwrap_or((0, 1.0))).collect();
        // An error of an acceleration counts by the speed that it changes.
        rates.into_iter().for_each(|argument| self.measured[argument].1 = f64::INFINITY);
        self.linear.arguments = self.linear.outputs.len();
    }

    /// Adds the sources of a cart on a bridge that yaws; returns the arguments that are accelerations.
    fn add_ride(&mut self) -> Vec<usize> {
        let model = Arc::clone(&self.model);
        let Some(ride) = model.mechanism.ride else { return Vec::new() };
        let Ride { bridge, cart, yaw, .. } = ride;
        let moves = |body: usize| self.mode.motion[body] != Motion::Stuck;
        let law = ride.law(&model.mechanism, moves(bridge), moves(cart));
        let place = |body: usize| (model.coordinate(body), model.mechanism.origin[body]);
        let ((cart_place, cart_origin), (yaw_place, yaw_origin)) = (place(cart), place(yaw));
        let of = |number: usize, origin: f64| Argument { number, origin };
        let free = [bridge, cart, yaw].map(|body| self.acceleration(body));
        let arguments = Riding {
            cart: of(self.argument_at(cart_place), cart_origin),
            cart_speed: of(self.argument_at(model.speed(cart)), 0.0),
            yaw: of(self.argument_at(yaw_place), yaw_origin),
            yaw_speed: of(self.argument_at(model.speed(yaw)), 0.0),
            bridge_free: of(free[0], 0.0),
            cart_free: of(free[1], 0.0),
            yaw_free: of(free[2], 0.0),
        };
        for on in Ridden::ALL {
            self.sources.push(Source::Ride { on, law, arguments });
            let body = ride.body(on);
            let column = self.column(|leader| if leader == body { -1.0 } else { 0.0 });
            self.linear.source.push(column);
        }
        free.to_vec()
    }

    /// The acceleration of a body without a ride as an argument: by the state, the inputs, and the forces so far.
    fn acceleration(&mut self, body: usize) -> usize {
        let place = self.model.speed(body);
        let moves = self.mode.motion[body] != Motion::Stuck;
        let form = if moves { self.equations.acceleration[body] } else { Form::ZERO };
        let mut row = [0.0; STATES];
        row.iter_mut().zip(self.model.row(&form)).for_each(|(own, value)| *own = value);
        let source = self.linear.source.iter().map(|column| column[place]).collect();
        self.linear.outputs.push(Output { row, input: form.input, constant: form.constant, source });
        self.linear.outputs.len() - 1
    }

    /// The torque and the two voltages of each stepper.
    fn add_phases(&mut self) {
        let model = Arc::clone(&self.model);
        for (index, phased) in model.phased.iter().enumerate() {
            let mut row = [0.0; STATES];
            phased.terms.iter().for_each(|&(place, weight)| row[place] += weight);
            let mut input = [0.0; DRIVES];
            input[phased.drive] = phased.per_input;
            let arguments = Phasing {
                phased: index,
                angle: self.argument(row),
                speed: self.argument_at(phased.speed),
                currents: phased.currents.map(|place| self.argument_at(place)),
                told: self.argument_of([0.0; STATES], input),
            };
            self.sources.push(Source::Torque(arguments));
            let column = self.column(|leader| if leader == phased.leader { phased.ratio } else { 0.0 });
            self.linear.source.push(column);
            for (phase, place) in phased.currents.into_iter().enumerate() {
                self.sources.push(Source::Phase(phase, arguments));
                let mut column = [0.0; STATES];
                column[place] = 1.0;
                self.linear.source.push(column);
            }
        }
    }

    fn add_outputs(&mut self) {
        let arguments = self.linear.arguments;
        for (index, guard) in self.guards.iter().enumerate() {
            let source = self.on_sources(self.watches[index].cause);
            let output = Output { row: guard.row, input: guard.input, constant: guard.constant, source };
            let plain = output.source.iter().all(|weight| *weight == 0.0)
                && output.constant == 0.0
                && output.input == [0.0; DRIVES];
            let is_this = |argument: &Output| {
                argument.row == output.row && argument.constant == 0.0 && argument.source.iter().all(|by| *by == 0.0)
            };
            let known = self.linear.outputs[..arguments].iter().position(is_this);
            self.output.push(known.filter(|_| plain).unwrap_or(self.linear.outputs.len()));
            if known.filter(|_| plain).is_none() {
                self.linear.outputs.push(output);
            }
        }
        let model = &self.model;
        let stands = |leader: usize| self.mode.motion[leader] == Motion::Stuck;
        self.shifted = model.curved.iter().any(|curved| {
            let along = model.mechanism.bodies[curved.body].along.is_some();
            stands(curved.leader) && (along || curved.bristle.is_some())
        });
        let sources = self.sources.len();
        self.linear.outputs.iter_mut().for_each(|output| output.source.resize(sources, 0.0));
    }

    /// Value that the forces add to a guard at once.
    fn on_sources(&self, cause: Cause) -> Vec<f64> {
        let mechanism = &*self.model.mechanism;
        // Derivatives with respect to the loads on a body, and to its friction.
        let by = |body: usize, load: f64, friction: f64| -> Vec<f64> {
            let of = |source: &Source| match source {
                Source::Friction { curved, .. } => {
                    let curved = &self.model.curved[*curved];
                    if curved.leader == body { friction * curved.ratio } else { 0.0 }
                }
                Source::Spring { following, .. } => {
                    let following = &self.model.following[*following];
                    let slack = self.mode.slack[following.spring];
                    let arm: f64 = following.arms.iter().filter(|(b, _)| *b == body).map(|(_, arm)| -arm).sum();
                    if slack { 0.0 } else { load * arm }
                }
                Source::Torque(phasing) => {
                    let phased = &self.model.phased[phasing.phased];
                    if phased.leader == body { load * phased.ratio } else { 0.0 }
                }
                Source::Phase(..) => 0.0,
                Source::Ride { on, .. } => match mechanism.ride {
                    Some(ride) if ride.body(*on) == body => -load,
                    _ => 0.0,
                },
            };
            self.sources.iter().map(of).collect()
        };
        match cause {
            // a(x) F_b − (load + what the belt adds − what bent bristles hold)
            Cause::BreakForward(body) => by(body, -1.0, 0.0),
            Cause::BreakBackward(body) => by(body, 1.0, 0.0),
            Cause::GearTorque(drive) if !mechanism.drives[drive].has_rotor() => {
                let part = &mechanism.drives[drive];
                if self.mode.motion[part.pulley] == Motion::Stuck {
                    return vec![0.0; self.sources.len()];
                }
                let sign = if self.mode.drive[drive].torque_positive { 1.0 } else { -1.0 };
                let inertia = part.motor.rotor_inertia * part.motor.gear_ratio;
                let change = -sign * inertia * mechanism.ratio(part.pulley) / self.mass[part.pulley];
                by(mechanism.leader(part.pulley), change, -change)
            }
            // A tension that follows the bodies.
            Cause::Switch(Switch::Span(spring, slack)) => {
                let own = |source: &Source| match source {
                    Source::Spring { following, .. } if self.model.following[*following].spring == spring => {
                        if slack {
                            1.0
                        } else {
                            -1.0
                        }
                    }
                    Source::Spring { .. }
                    | Source::Friction { .. }
                    | Source::Torque(_)
                    | Source::Phase(..)
                    | Source::Ride { .. } => 0.0,
                };
                self.sources.iter().map(own).collect()
            }
            // Neither laws nor spans that follow bear on these.
            Cause::Stop(_) | Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => vec![0.0; self.sources.len()],
        }
    }

    /// The forces at one instant.
    pub(super) fn forces(&self, input: &[f64; DRIVES], y: &Vector, forces: &mut [f64]) {
        for (number, source) in self.sources.iter().enumerate() {
            // Each depends on those before it at most.
            let value = |argument: usize| self.linear.outputs[argument].value(y, input, forces);
            let force = source.at_begin(&self.model, &self.mode, (input, y), value);
            forces[number] = force;
        }
    }

    /// ẏ of coordinates, speeds and currents.
    pub(super) fn rate(&self, input: &[f64; DRIVES], y: &Vector) -> States {
        let mut forces = vec![0.0; self.sources.len()];
        self.forces(input, y, &mut forces);
        self.linear.rate(y, input, &forces)
    }

    /// The size of the parts of a guard's value, which bounds the effect of an error of a part.
    pub(super) fn size(&self, index: usize, input: &[f64; DRIVES], y: &[f64]) -> f64 {
        let form = &self.equations.guards[index].form;
        form.noise(&self.model.layout, &self.model.inner(y), input) / ROUNDING
    }

    /// Rounding error of a guard for states as large as `usual`, since a speed at its event is near zero.
    pub(super) fn rounding(&self, index: usize, usual: &Vector) -> f64 {
        let on_state = self.guards[index].row.iter().zip(usual).map(|(weight, usual)| (weight * usual).abs());
        ROUNDING * on_state.sum::<f64>()
    }

    /// Difference of a guard from its output: the load held at rest by friction along the travel and by bent bristles.
    pub(super) fn shift(&self, cause: Cause, y: &[f64]) -> f64 {
        let (body, forward) = match cause {
            Cause::BreakForward(body) => (body, true),
            Cause::BreakBackward(body) => (body, false),
            Cause::Stop(_) | Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => return 0.0,
        };
        let (model, law) = (&self.model, self.model.mechanism.friction(body));
        let held = if forward { 1.0 } else { -1.0 } * model.bristle_force(body, y);
        model.breakaway(body, forward, y) - law.side(forward).breakaway + held
    }

    /// The values that must not become negative, in the order of the guards.
    pub(super) fn guards(&self, input: &[f64; DRIVES], y: &Vector) -> [f64; MOST_GUARDS] {
        let mut values = [0.0; MOST_GUARDS];
        let mut forces = [0.0; SOURCES];
        self.forces(input, y, &mut forces);
        for (index, (value, guard)) in values.iter_mut().zip(&self.guards).enumerate() {
            let on_state = guard.row.iter().zip(y).fold(0.0, |sum, (weight, y)| sum + weight * y);
            *value = guard.input.iter().zip(input).fold(on_state + guard.constant, |sum, (w, u)| sum + w * u);
            if !self.sources.is_empty() {
                let output = &self.linear.outputs[self.output[index]];
                *value = output.source.iter().zip(&forces).fold(*value, |sum, (weight, force)| sum + weight * force);
            }
            if self.shifted {
                *value += self.shift(self.watches[index].cause, y);
            }
        }
        values
    }
}

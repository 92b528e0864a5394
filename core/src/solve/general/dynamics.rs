//! A machine that another program integrates: rates, conditions that must not become negative, changes of mode.

use super::{Core, Event};
use crate::error::Result;
use crate::friction::Motion;
use crate::mechanism::{BODIES, CURRENTS, Cause, DRIVES, Layout, Mechanism, Mode, SpringLaw, State};
use crate::solve::engine::{Engine, shown};
use crate::solve::saved::{Pass, Passed, restored};
use crate::solve::{Ending, check, rules};
use std::sync::Arc;

/// Allowance for rounding and for a stranger's integrator, as a share of a quantity.
const TOLERANCE: f64 = 1e-9;

/// Every condition is shown as larger by this, in its SI unit. FMI counts a condition of zero as fallen: one that is
/// zero where a mode begins, as the speed of a body that breaks away, has to be above zero.
const SHIFT: f64 = 1.0 / (1_u64 << 40) as f64;

/// A quantity that is integrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// The position of a body, rad or m.
    Position(usize),
    /// Its speed.
    Speed(usize),
    /// A current by its number, A.
    Current(usize),
    /// The deflection of the bristles of a body, rad or m.
    Bristle(usize),
}

/// The equations of a machine for an integrator from elsewhere, with its mode. In a mode the rates are smooth; where a
/// condition falls below zero, [`Dynamics::settle`] takes up the mode that follows.
#[derive(Clone)]
pub struct Dynamics {
    core: Core,
    quantities: Vec<Quantity>,
    kinds: Vec<usize>,
}

impl Dynamics {
    /// A machine in `start` at time zero, with zero inputs. Returns an error if the state is invalid.
    pub fn new(mechanism: &Mechanism, start: &State) -> Result<Self> {
        check::state(start)?;
        let errors = (TOLERANCE, check::fastest_rate(mechanism));
        let steps = (f64::INFINITY, f64::INFINITY);
        let mut core = Core::new(mechanism, Layout::new(mechanism), start, errors, steps);
        core.outside = Some(SHIFT);
        let (quantities, kinds) = (quantities(mechanism), kinds(mechanism));
        Ok(Self { core, quantities, kinds })
    }

    /// The quantities to integrate: those of bodies that move by themselves, currents that are states, bristles.
    pub fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// Number of conditions over all modes.
    pub fn conditions(&self) -> usize {
        self.kinds.len()
    }

    /// The mechanism, with positions relative to its start.
    pub fn mechanism(&self) -> &Mechanism {
        &self.core.model.mechanism
    }

    /// The states of its parts.
    pub fn mode(&self) -> &Mode {
        &self.core.rules.mode
    }

    /// Puts time, s, the quantities and the inputs in place.
    pub fn put(&mut self, time: f64, values: &[f64], inputs: &[f64; DRIVES]) {
        let model = Arc::clone(&self.core.model);
        let mechanism = &*model.mechanism;
        let start = *self.core.coordinates.start();
        let mut state = start;
        let mut bristles = [0.0; BODIES];
        for (quantity, &value) in self.quantities.iter().zip(values) {
            match *quantity {
                Quantity::Position(leader) => {
                    for body in mechanism.followers(leader) {
                        let way = value - start.position[leader];
                        state.position[body] = start.position[body] + mechanism.ratio(body) * way;
                    }
                    state.position[leader] = value;
                }
                Quantity::Speed(leader) => {
                    mechanism.followers(leader).for_each(|body| state.speed[body] = mechanism.ratio(body) * value);
                }
                Quantity::Current(number) => state.current[number] = value,
                Quantity::Bristle(body) => bristles[body] = value,
            }
        }
        let mut inner = state;
        for (position, origin) in inner.position.iter_mut().zip(self.core.coordinates.origin()) {
            *position -= origin;
        }
        for replaced in &model.layout.replaced {
            // The elongation in place of a position.
            let others: f64 = replaced.others.iter().map(|&(other, arm)| arm * state.position[other]).sum();
            inner.position[replaced.body] = replaced.own.mul_add(state.position[replaced.body], others);
        }
        self.core.y = model.vector(&inner);
        for (place, value) in model.bristle.iter().zip(bristles) {
            if let Some(place) = place {
                self.core.y[*place] = value;
            }
        }
        self.core.coordinates = self.core.coordinates.at(&state);
        self.core.hold_inputs(inputs, time);
    }

    /// The quantities as they are, in the order of [`Dynamics::quantities`].
    pub fn values(&self, into: &mut [f64]) {
        let (state, model) = (Engine::state(&self.core), &self.core.model);
        for (into, quantity) in into.iter_mut().zip(&self.quantities) {
            *into = match *quantity {
                Quantity::Position(body) => state.position[body],
                Quantity::Speed(body) => state.speed[body],
                Quantity::Current(number) => state.current[number],
                Quantity::Bristle(body) => model.bristle[body].map_or(0.0, |place| self.core.y[place]),
            };
        }
    }

    /// Their rates.
    pub fn rates(&self, into: &mut [f64]) {
        let (core, model) = (&self.core, &self.core.model);
        let rate = core.field().rate(&core.input(), &core.y);
        for (into, quantity) in into.iter_mut().zip(&self.quantities) {
            *into = match *quantity {
                Quantity::Position(body) if core.rules.mode.motion[body] == Motion::Stuck => 0.0,
                Quantity::Position(body) => core.y[model.speed(body)],
                Quantity::Speed(body) => rate[model.speed(body)],
                Quantity::Current(number) => model.current[number].map_or(0.0, |place| rate[place]),
                Quantity::Bristle(body) => model.bristle_rate(body, &core.rules.mode, &core.y),
            } + 0.0;
        }
    }

    /// The conditions as residuals: the speed of a sliding body in its direction of motion, the distance of a body at
    /// rest from its breakaway on either side, the distance of any other part from its limit; each larger by a
    /// tolerance, so that all are positive after [`Dynamics::settle`]. Conditions that the mode does not have are 1.
    pub fn residuals(&self, into: &mut [f64]) {
        into.fill(1.0);
        let mut seen = [false; Cause::KINDS];
        for (cause, value) in self.watched() {
            let Some(place) = self.kinds.iter().position(|kind| *kind == cause.kind()) else { continue };
            let before = seen[cause.kind()].then_some(into[place]);
            into[place] = before.map_or(value, |before| before.min(value));
            seen[cause.kind()] = true;
        }
    }

    /// The conditions of the mode, and by how much each holds, beyond what rounding and the integrator may do: it has
    /// fallen where that is zero or less.
    fn watched(&self) -> impl Iterator<Item = (Cause, f64)> + '_ {
        let core = &self.core;
        let field = core.field();
        let values = field.guards(&core.input(), &core.y);
        let watches: Vec<Cause> = field.watches.iter().map(|watch| watch.cause).collect();
        watches.into_iter().zip(values).map(move |(cause, value)| (cause, value + core.forgiven(cause) + SHIFT))
    }

    /// True if a condition has fallen.
    pub fn is_over(&self) -> bool {
        self.watched().any(|(_, value)| value <= 0.0)
    }

    /// Changes modes, without time passing, until every condition is above zero, and adds the events to `events`. True
    /// if it put quantities elsewhere: a body that stops has no speed.
    pub fn settle(&mut self, events: &mut Vec<Event>) -> std::result::Result<bool, Ending> {
        let before = self.core.y;
        self.core.rules.at_edge = true;
        rules::settle(&mut self.core);
        self.core.rules.hand_on(events);
        self.core.rules.trouble.map_or(Ok(self.core.y != before), Err)
    }

    /// The value of each column of the mechanism now, in SI units; `into` has a place for each.
    pub fn outputs(&self, into: &mut [f64]) {
        shown(&self.core, into);
    }

    /// Continues with other parameters of the same mechanism; see [`crate::solve::Simulator::replace`].
    pub fn replace(&mut self, mechanism: &Mechanism) {
        self.core.replace(mechanism);
    }

    /// The complete state as plain numbers; `None` after an early end.
    pub fn save(&self) -> Option<Vec<u64>> {
        let mut list = Vec::new();
        self.clone().pass(&mut Pass::Out(&mut list))?;
        Some(list)
    }

    /// Continues from the result of [`Dynamics::save`]. Returns `None`, and changes nothing, if `saved` does not belong
    /// to such a machine.
    pub fn restore(&mut self, saved: &[u64]) -> Option<()> {
        *self = restored(self, saved, Self::pass)?;
        Some(())
    }

    fn pass(&mut self, pass: &mut Pass) -> Passed {
        self.core.pass(pass)
    }
}

/// The quantities that are integrated.
fn quantities(mechanism: &Mechanism) -> Vec<Quantity> {
    let mut list: Vec<Quantity> =
        mechanism.leaders().flat_map(|body| [Quantity::Position(body), Quantity::Speed(body)]).collect();
    let currents = (0..CURRENTS).filter(|number| mechanism.drive_of_current(*number).is_some());
    list.extend(currents.map(Quantity::Current));
    let has_bristles =
        |body: &usize| matches!(mechanism.bodies[*body].friction.law, crate::friction::Law::LuGre { .. });
    list.extend((0..mechanism.bodies.len()).filter(has_bristles).map(Quantity::Bristle));
    list
}

/// The kinds of conditions in all modes of a mechanism, for any parameters: friction and losses of the gear that are
/// zero now may be set later.
fn kinds(mechanism: &Mechanism) -> Vec<usize> {
    use crate::mechanism::{Contact, Limit, Switch};
    let mut causes = Vec::new();
    for body in mechanism.leaders() {
        causes.extend([Cause::BreakForward(body), Cause::BreakBackward(body)]);
    }
    for (index, drive) in mechanism.drives.iter().enumerate() {
        if drive.motor.stepper.is_some() {
            causes.extend([0, 2].map(|to| Cause::Switch(Switch::Field(index, to))));
            // The limit of its phases is part of their rates.
            continue;
        }
        if !drive.motor.is_simple {
            causes.push(Cause::GearTorque(index));
        }
        for to in [Limit::Inside, Limit::High, Limit::Low] {
            if drive.amplifier.voltage_limit.is_some() {
                causes.push(Cause::Switch(Switch::Voltage(index, to)));
            }
            if drive.amplifier.current_limit.is_some() {
                causes.push(Cause::Switch(Switch::Current(index, to)));
            }
        }
    }
    for (index, spring) in mechanism.springs.iter().enumerate() {
        match spring.law {
            SpringLaw::Tension { .. } => causes.push(Cause::Switch(Switch::Span(index, true))),
            SpringLaw::Gap { .. } => {
                let sides = [Contact::Apart, Contact::High, Contact::Low];
                causes.extend(sides.map(|to| Cause::Switch(Switch::Gap(index, to))));
            }
            SpringLaw::Line { .. } => causes.extend([0, 1, 2].map(|to| Cause::Switch(Switch::Line(index, to)))),
            SpringLaw::Bounds { .. } => causes.push(Cause::Leave(index)),
            SpringLaw::TwoSided | SpringLaw::Angle { .. } | SpringLaw::None => {}
        }
    }
    causes.into_iter().map(Cause::kind).collect()
}

//! What follows when a mode ends: who does what next, and whether that holds.

use super::Run;
use crate::friction::Motion;
use crate::plant::{Body, Cause, Limit, Mode, Part, Status, Switch, place};
use crate::solve::law::{Law, Watch};
use crate::solve::propagator::SERIES_ORDER;
use crate::solve::{Ending, Event};
use crate::stage::AmplifierMode;
use std::rc::Rc;

/// Events allowed at once, per simulated second, and in all: more is an accumulation, not a machine, or fills the memory.
const EVENTS_AT_LEAST: f64 = 1e5;
const EVENTS_PER_SECOND: f64 = 1e7;
const EVENTS_AT_MOST: f64 = 2e7;

/// The rank of conditions on bodies.
const BODIES: u8 = 3;

/// What counts as one instant, as a share of the reach of the series.
const MOMENT: f64 = 1e-12;

/// Mode changes allowed at one instant.
const CHANGES_AT_ONCE: usize = 100;

/// Turns of a body at one instant after which it is taken to rest.
const TURNS_AT_ONCE: usize = 20;

impl<const R: usize, const C: usize> Run<'_, R, C> {
    /// Load on a body at rest that would go forward, or backward (the same unless the gear loses power); what friction
    /// would then take of it; and what rounding may have done to it.
    fn load(&self, body: Body, forward: bool) -> (f64, f64, f64) {
        let positive = self.value(&self.plant.current(&self.mode)) >= 0.0;
        let mode = Mode { gear_torque_positive: positive, ..self.mode };
        let form = self.plant.load(body, forward, &mode);
        let law = self.plant.friction(body);
        let resistance = if forward { law.forward.coulomb } else { -law.backward.coulomb };
        (self.value(&form), resistance, self.noise(&form))
    }

    /// What a body at zero speed does under its present load.
    fn decide(&self, body: Body) -> Motion {
        let law = self.plant.friction(body);
        let (forward, _, noise) = self.load(body, true);
        if forward > law.forward.breakaway + noise {
            return Motion::Forward;
        }
        let (backward, _, noise) = self.load(body, false);
        if backward < -law.backward.breakaway - noise { Motion::Backward } else { Motion::Stuck }
    }

    /// Goes into the mode that follows when `cause` ends the present one.
    pub(super) fn change(&mut self, cause: Cause) {
        let (row, offset) = self.changed_at;
        let since = (self.row - row) as f64 * self.h + (self.offset - offset);
        self.changes = if since <= MOMENT * self.law.reach() { self.changes + 1 } else { 0 };
        self.changed_at = (self.row, self.offset);
        if self.changes > CHANGES_AT_ONCE {
            self.trouble = Some(Ending::TooManyEvents { time: self.time() });
        }
        let by_rounding = self.is_by_rounding(cause);
        let (body, to) = match cause {
            Cause::GearTorque => {
                self.mode.gear_torque_positive = !self.mode.gear_torque_positive;
                self.enter();
                self.forgive(cause);
                return;
            }
            Cause::Switch(switch) => {
                self.switch(switch);
                return;
            }
            Cause::LeaveTravel => {
                self.trouble = Some(Ending::LeftTravel { time: self.time() });
                return;
            }
            Cause::Stop(body) => {
                for follower in self.plant.followers(body) {
                    self.z[follower.speed_place()] = 0.0;
                }
                // Where rounding turns a body back again and again without a moment passing, it rests.
                (body, if self.changes > TURNS_AT_ONCE { Motion::Stuck } else { self.decide(body) })
            }
            Cause::BreakForward(body) => (body, Motion::Forward),
            Cause::BreakBackward(body) => (body, Motion::Backward),
        };
        // Where it stops, the load is the one on the side it came from.
        let from = self.mode.motion[body.index()];
        let side = if to == Motion::Stuck { from } else { to };
        let (load, resistance, noise) = self.load(body, side != Motion::Backward);
        self.fresh[body.index()] = match (to, cause) {
            (Motion::Stuck | Motion::Free, _) => 0,
            (_, Cause::Stop(_)) => 1,
            // Where breakaway equals Coulomb friction the acceleration starts from zero, but for rounding.
            _ if (load - resistance).abs() <= 2.0 * noise => 2,
            _ => 1,
        };
        for follower in self.plant.followers(body) {
            self.mode.motion[follower.index()] = to;
        }
        let tolerance = if self.changes > TURNS_AT_ONCE { 20.0 } else { 2.0 } * noise;
        for side in [Cause::BreakForward(body), Cause::BreakBackward(body)] {
            self.slack[side.kind()] = tolerance;
        }
        self.note(Part::Body(body), Status::Motion(from), load, by_rounding);
        self.enter();
    }

    /// Whether a body stops where rounding decides: its speed tends to zero for ever, and nothing slows it down any more.
    fn is_by_rounding(&self, cause: Cause) -> bool {
        let Cause::Stop(body) = cause else { return false };
        let place = body.speed_place();
        let slows = self.law.rate(&self.z)[place].abs();
        // Its own speed is known to the rounding of the speeds that it had.
        let mut sizes = self.z;
        sizes[place] = self.rounding.largest_speed(body, self.plant.stage().pulley_radius);
        slows <= 20.0 * self.law.noise_of_rate(&sizes)[place]
    }

    /// Lets a part other than a body do something else.
    fn switch(&mut self, switch: Switch) {
        let before = self.mode.status(switch.part());
        // Let go by the motion and not by an edge of the input, a current leaves its limit with no rate of its own.
        let at_edge = |guard: &Watch<C>| guard.value(&self.z).abs() <= 20.0 * guard.noise(&self.z);
        let gently = self.law.guards.iter().any(|guard| guard.cause == Cause::Switch(switch) && at_edge(guard));
        self.mode.switch(switch);
        self.note(switch.part(), before, 0.0, false);
        self.enter();
        if let (Switch::Current(side), true) = (switch, self.current_stands()) {
            if side != Limit::Inside {
                // It stands at its limit, to the last bit.
                self.z[place::CURRENT] = side.sign() * self.plant.stage().amplifier.current_limit.unwrap_or(0.0);
            }
            self.forgive(Cause::Switch(switch));
            if let (Status::Limit(left), true) = (before, side == Limit::Inside && gently) {
                self.fresh[Cause::Switch(Switch::Current(left)).kind()] = 2;
            }
        } else {
            self.forgive(Cause::Switch(switch));
        }
    }

    /// Whether the current is a state that its limit holds.
    fn current_stands(&self) -> bool {
        self.plant.has_current_state() && self.plant.stage().amplifier.mode == AmplifierMode::Voltage
    }

    /// Notes an event, unless nothing that shows has changed.
    fn note(&mut self, part: Part, from: Status, load: f64, by_rounding: bool) {
        let event = Event { time: self.time(), part, from, to: self.mode.status(part), load, by_rounding };
        event.note(&mut self.events);
    }

    /// Takes what has just become a condition on a part for zero where it is that but for rounding.
    fn forgive(&mut self, cause: Cause) {
        let law = Rc::clone(&self.law);
        for guard in law.guards.iter().filter(|guard| guard.cause.is_of_same_part(cause)) {
            let (now, noise) = (guard.value(&self.z), guard.noise(&self.z));
            let zero = now.abs() <= 20.0 * noise;
            let index = guard.cause.kind();
            (self.slack[index], self.fresh[index]) = match zero {
                // A torque that turns again and again without a moment passing is none.
                false if cause == Cause::GearTorque && self.changes > TURNS_AT_ONCE => (2.0 * now.abs(), 0),
                false => (0.0, 0),
                true if self.changes <= TURNS_AT_ONCE => (f64::max(-now, 0.0), 1),
                // Where rounding moves a part back and forth without a moment passing, it stays where it is.
                true => (40.0 * noise, 0),
            };
        }
    }

    /// Takes up the equations of the present mode.
    fn enter(&mut self) {
        self.rounding.swing(self.law.swing, self.time());
        let (law, is_new) = Law::of(self.laws, self.plant, self.mode, self.h);
        self.law = law;
        let inner = self.inner();
        self.coordinates.hold(&self.mode, &inner);
        self.cost.modes += u64::from(is_new);
    }

    /// A load that passes a breakaway by rounding alone does not break it.
    fn tolerate_loads(&mut self, law: &Law<R, C>) {
        for guard in &law.guards {
            if let Cause::BreakForward(_) | Cause::BreakBackward(_) = guard.cause {
                let tolerance = &mut self.slack[guard.cause.kind()];
                *tolerance = tolerance.max(2.0 * guard.noise(&self.z));
            }
        }
    }

    /// Changes modes, without time passing, until every guard holds.
    pub(super) fn resolve(&mut self) {
        for _ in 0..CHANGES_AT_ONCE {
            let law = Rc::clone(&self.law);
            let falls = |guard: &Watch<C>| {
                let g = self.standing(guard);
                if g != 0.0 || self.fresh_order(guard.cause) > 0 {
                    return g < 0.0;
                }
                // On the edge: the first term of its series that is more than rounding decides.
                let series = law.series(&self.z, law.reach());
                let coefficients: [f64; SERIES_ORDER + 1] = std::array::from_fn(|k| guard.value(&series[k]));
                let first = guard.first_term(&coefficients, &law.sizes(&self.z, law.reach()), 1);
                coefficients.get(first).is_some_and(|&term| term < 0.0)
            };
            let fallen = law.guards.iter().filter(|guard| falls(guard)).min_by_key(|guard| guard.cause.rank());
            // What does not depend on bodies is settled: now their loads are known, and to which rounding.
            if self.at_edge && fallen.is_none_or(|guard| guard.cause.rank() == BODIES) {
                self.at_edge = false;
                self.tolerate_loads(&law);
                if fallen.is_some() {
                    continue;
                }
            }
            match fallen {
                Some(guard) => {
                    self.change(guard.cause);
                    if self.trouble.is_some() {
                        return;
                    }
                }
                None => {
                    // A torque that starts from zero does so whichever way the gear counts as carrying.
                    let torque = law.guards.iter().find(|guard| guard.cause == Cause::GearTorque);
                    if torque.is_some_and(|torque| torque.is_zero(&self.z)) {
                        self.fresh[3] = 1;
                    }
                    if self.events.len() as f64
                        > f64::min(EVENTS_AT_LEAST + EVENTS_PER_SECOND * self.time(), EVENTS_AT_MOST)
                    {
                        self.trouble = Some(Ending::TooManyEvents { time: self.time() });
                    }
                    return;
                }
            }
        }
        self.trouble = Some(Ending::TooManyEvents { time: self.time() });
    }
}

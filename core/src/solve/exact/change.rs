//! The change of a mode: the next state of each part, and whether that holds.

use super::matrices::{Room, Watch};
use super::{Core, ModeMatrices};
use crate::friction::Motion;
use crate::mechanism::{AmplifierMode, Cause, Limit, Mode, Part, ROUNDING, Status, Switch, What};
use crate::solve::pace::most_events;
use crate::solve::{Ending, Event, Tie};
use std::sync::Arc;

/// The rank of conditions on bodies.
const BODIES: u8 = 3;

/// The length of one instant, as a share of the reach of the series.
const MOMENT: f64 = 1e-12;

/// Mode changes allowed at one instant.
const CHANGES_AT_ONCE: usize = 100;

/// Turns of a body at one instant after which it is taken to rest.
const TURNS_AT_ONCE: usize = 20;

impl<const N: usize> Core<N> {
    /// Load on a body at rest that would go forward, or backward (the same unless the gear loses power); what friction
    /// would then take of it; and what rounding may have done to it.
    fn load(&self, body: usize, forward: bool) -> (f64, f64, f64) {
        let law = self.common.mechanism.friction(body);
        let resistance = if forward { law.forward.coulomb } else { -law.backward.coulomb };
        if let Some(row) = self.matrices.load(body) {
            return (row.value(&self.z), resistance, row.noise(&self.z));
        }
        let mut mode = self.common.mode;
        self.settle_torques(&mut mode);
        let form = self.common.mechanism.load(body, forward, &mode);
        (self.value(&form), resistance, self.noise(&form))
    }

    /// Gears that lose power carry as they do at rest; to others it makes no difference.
    fn settle_torques(&self, mode: &mut Mode) {
        let mechanism = &self.common.mechanism;
        for (drive, _) in mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.loses()) {
            let torque = mechanism.torque_at_rest(drive, &self.common.mode);
            mode.drive[drive].torque_positive = self.value(&torque) >= 0.0;
        }
    }

    /// The motion of a body at zero speed under its present load.
    fn decide(&self, body: usize) -> Motion {
        let law = self.common.mechanism.friction(body);
        let (forward, _, noise) = self.load(body, true);
        if forward > law.forward.breakaway + noise {
            return Motion::Forward;
        }
        let (backward, _, noise) = self.load(body, false);
        if backward < -law.backward.breakaway - noise { Motion::Backward } else { Motion::Stuck }
    }

    /// Goes into the mode that follows when `cause` ends the present one.
    pub(super) fn change(&mut self, cause: Cause) {
        self.common.changes =
            if self.common.since_change <= MOMENT * self.matrices.reach() { self.common.changes + 1 } else { 0 };
        self.common.since_change = 0.0;
        if self.common.changes > CHANGES_AT_ONCE {
            self.common.trouble = Some(Ending::TooManyEvents { time: self.time() });
        }
        let by_rounding = self.is_by_rounding(cause);
        let (body, to) = match cause {
            Cause::GearTorque(drive) => {
                let positive = &mut self.common.mode.drive[drive].torque_positive;
                *positive = !*positive;
                self.take_up_mode();
                self.tolerate(cause);
                return;
            }
            Cause::Switch(switch) => {
                self.switch(switch);
                return;
            }
            Cause::Leave(_) => {
                self.common.trouble = Some(Ending::LeftTravel { time: self.time() });
                return;
            }
            Cause::Stop(body) => {
                for follower in self.common.mechanism.followers(body) {
                    self.z[self.common.space.layout.speed[follower]] = 0.0;
                }
                // Where rounding turns a body back again and again without a moment passing, it rests.
                let turns = self.common.changes > TURNS_AT_ONCE;
                if turns {
                    self.note_tie(body);
                }
                (body, if turns { Motion::Stuck } else { self.decide(body) })
            }
            Cause::BreakForward(body) => (body, Motion::Forward),
            Cause::BreakBackward(body) => (body, Motion::Backward),
        };
        // Where it stops, the load is the one on the side it came from.
        let from = self.common.mode.motion[body];
        let side = if to == Motion::Stuck { from } else { to };
        let (load, resistance, noise) = self.load(body, side != Motion::Backward);
        self.common.fresh[body] = match (to, cause) {
            (Motion::Stuck | Motion::Free, _) => 0,
            (_, Cause::Stop(_)) => 1,
            // Where breakaway equals Coulomb friction the acceleration starts from zero, but for rounding.
            _ if (load - resistance).abs() <= 2.0 * noise => 2,
            _ => 1,
        };
        self.common.is_fresh = true;
        for follower in self.common.mechanism.followers(body) {
            self.common.mode.motion[follower] = to;
        }
        let tolerance = if self.common.changes > TURNS_AT_ONCE { 20.0 } else { 2.0 } * noise;
        for side in [Cause::BreakForward(body), Cause::BreakBackward(body)] {
            self.common.tolerance[side.kind()] = tolerance;
        }
        // That the gear holds a rotor is nobody's stick.
        if !self.common.mechanism.bodies[body].is_rotor {
            self.note(What::Body(body), Status::Motion(from), load, by_rounding);
        }
        self.take_up_mode();
    }

    /// Whether a body stops where rounding decides: its speed tends to zero for ever, and nothing slows it down any
    /// more.
    fn is_by_rounding(&mut self, cause: Cause) -> bool {
        let Cause::Stop(body) = cause else { return false };
        self.common.rounding.see(&self.largest);
        let place = self.common.space.layout.speed[body];
        let slows = self.matrices.rate(&self.z)[place].abs();
        // Its own speed is known to the rounding of the speeds that it had.
        let mut sizes = self.z;
        sizes[place] = self.common.rounding.largest_speed(&self.common.mechanism.bodies[body]);
        slows <= 20.0 * self.matrices.noise_of_rate(&sizes)[place]
    }

    /// Lets a part other than a body do something else.
    fn switch(&mut self, switch: Switch) {
        let before = self.common.mode.status(switch.what());
        // Let go by the motion and not by an edge of the input, a current leaves its limit with no rate of its own.
        let at_edge = |guard: &Watch<N>| guard.value(&self.z).abs() <= 20.0 * guard.noise(&self.z);
        let gently = self.matrices.guards.iter().any(|guard| guard.cause == Cause::Switch(switch) && at_edge(guard));
        self.common.mode.switch(switch);
        self.note(switch.what(), before, 0.0, false);
        self.take_up_mode();
        match switch {
            Switch::Current(drive, side) if self.current_stands(drive) => {
                if side != Limit::Inside {
                    // It stands at its limit, to the last bit.
                    let limit = self.common.mechanism.drives[drive].amplifier.current_limit;
                    if let Some(place) = self.common.space.layout.current[drive] {
                        self.z[place] = side.sign() * limit.unwrap_or(0.0);
                    }
                }
                self.tolerate(Cause::Switch(switch));
                if let (Status::Limit(left), true) = (before, side == Limit::Inside && gently) {
                    self.common.fresh[Cause::Switch(Switch::Current(drive, left)).kind()] = 2;
                    self.common.is_fresh = true;
                }
            }
            _ => self.tolerate(Cause::Switch(switch)),
        }
    }

    /// Whether the current of a drive is a state that its limit holds.
    fn current_stands(&self, drive: usize) -> bool {
        let drive = &self.common.mechanism.drives[drive];
        drive.has_current_state() && drive.amplifier.mode == AmplifierMode::Voltage
    }

    /// Notes an event, unless nothing that shows has changed.
    fn note(&mut self, what: What, from: Status, load: f64, by_rounding: bool) {
        let (part, to) = (Part::of(&self.common.mechanism, what), self.common.mode.status(what));
        let event = Event { time: self.time(), part, from, to, load, by_rounding };
        event.note(&mut self.common.events);
    }

    /// Notes that rounding decides what a body does.
    fn note_tie(&mut self, body: usize) {
        let tie = Tie { time: self.time(), part: Part::of(&self.common.mechanism, What::Body(body)) };
        tie.note(&mut self.common.ties, &self.common.events);
    }

    /// Notes bodies at rest whose load is their breakaway but for rounding, where that holds more than they have once
    /// they slide: what sets in gently makes no difference.
    pub(super) fn note_ties(&mut self) {
        let law = Arc::clone(&self.matrices);
        for guard in &law.guards {
            let (body, forward) = match guard.cause {
                Cause::BreakForward(body) => (body, true),
                Cause::BreakBackward(body) => (body, false),
                _ => continue,
            };
            let side = self.common.mechanism.friction(body).side(forward);
            if side.breakaway > side.coulomb && guard.is_zero(&self.z) {
                self.note_tie(body);
            }
        }
    }

    /// Takes what has just become a condition on a part for zero where it is that but for rounding.
    fn tolerate(&mut self, cause: Cause) {
        let law = Arc::clone(&self.matrices);
        let rate = law.rate(&self.z);
        for guard in law.guards.iter().filter(|guard| guard.cause.is_of_same_part(cause)) {
            // The moment at which it fell is known to the rounding of the way there: of a line whose point is at zero
            // the value itself says nothing of it.
            let on_the_way = ROUNDING * law.far() * guard.value(&rate).abs();
            let (now, noise) = (guard.value(&self.z), guard.noise(&self.z).max(on_the_way));
            let zero = now.abs() <= 20.0 * noise;
            let index = guard.cause.kind();
            (self.common.tolerance[index], self.common.fresh[index]) = match zero {
                // A torque that turns again and again without a moment passing is none.
                false if matches!(cause, Cause::GearTorque(_)) && self.common.changes > TURNS_AT_ONCE => {
                    (2.0 * now.abs(), 0)
                }
                false => (0.0, 0),
                true if self.common.changes <= TURNS_AT_ONCE => (f64::max(-now, 0.0), 1),
                // Where rounding moves a part back and forth without a moment passing, it stays where it is.
                true => (40.0 * noise, 0),
            };
            self.common.is_fresh = true;
        }
    }

    /// Takes up the equations of the present mode.
    pub(super) fn take_up_mode(&mut self) {
        self.carry_errors();
        self.common.rounding.swing(self.matrices.swing, self.time());
        let (mechanism, space) = (&self.common.mechanism, &self.common.space);
        let (matrices, is_new) = ModeMatrices::of(&mut self.known, mechanism, space, &self.common.mode, self.common.h);
        self.matrices = matrices;
        self.common.taken += 1;
        let inner = self.inner();
        self.common.coordinates.hold(&self.common.space.layout, &self.common.mode, &inner);
        self.common.cost.modes += u64::from(is_new);
    }

    /// A load that passes a breakaway by rounding alone does not break it.
    fn tolerate_loads(&mut self, law: &ModeMatrices<N>) {
        for guard in &law.guards {
            if let Cause::BreakForward(_) | Cause::BreakBackward(_) = guard.cause {
                let tolerance = &mut self.common.tolerance[guard.cause.kind()];
                *tolerance = tolerance.max(2.0 * guard.noise(&self.z));
            }
        }
    }

    /// The guard that does not hold here; of several, that which is settled first.
    fn fallen<'l>(&mut self, law: &'l ModeMatrices<N>) -> Option<&'l Watch<N>> {
        law.values(&self.z, &mut self.room.value);
        if self.room.value.iter().take(law.guards.len()).all(|&g| g > 0.0) {
            return None;
        }
        self.stand(law);
        let mut fallen: Option<&Watch<N>> = None;
        for (lane, guard) in law.guards.iter().enumerate() {
            let g = self.room.value[lane];
            let falls = match g != 0.0 || self.common.fresh_order(guard.cause) > 0 {
                true => g < 0.0,
                // On the edge: the first term of its series that is more than rounding decides.
                false => self.falls_from_zero(law, guard),
            };
            if falls && fallen.is_none_or(|first| guard.cause.rank() < first.cause.rank()) {
                fallen = Some(guard);
            }
        }
        fallen
    }

    /// Whether a guard that is zero falls.
    fn falls_from_zero(&mut self, law: &ModeMatrices<N>, guard: &Watch<N>) -> bool {
        let Room { series, coefficients, .. } = &mut *self.room;
        law.series(&self.z, law.reach(), series);
        let coefficients = guard.row.along(series, coefficients);
        let first = law.first_term(guard, coefficients, (&self.z, law.reach()), 1);
        coefficients.get(first).is_some_and(|&term| term < 0.0)
    }

    /// Changes modes, without time passing, until every guard holds.
    pub(super) fn resolve(&mut self) {
        for _ in 0..CHANGES_AT_ONCE {
            let law = Arc::clone(&self.matrices);
            let fallen = self.fallen(&law);
            // What does not depend on bodies is settled: now their loads are known, and to which rounding.
            if self.common.at_edge && fallen.is_none_or(|guard| guard.cause.rank() == BODIES) {
                self.common.at_edge = false;
                self.tolerate_loads(&law);
                if fallen.is_some() {
                    continue;
                }
            }
            match fallen {
                Some(guard) => {
                    self.change(guard.cause);
                    if self.common.trouble.is_some() {
                        return;
                    }
                }
                None => {
                    // A torque that starts from zero does so whichever way the gear counts as carrying.
                    let of_gears = law.guards.iter().filter(|guard| matches!(guard.cause, Cause::GearTorque(_)));
                    for torque in of_gears.filter(|torque| law.has_gear_torque && torque.is_zero(&self.z)) {
                        self.common.fresh[torque.cause.kind()] = 1;
                        self.common.is_fresh = true;
                    }
                    if (self.common.handed_on + self.common.events.len()) as f64 > most_events(self.time()) {
                        self.common.trouble = Some(Ending::TooManyEvents { time: self.time() });
                    }
                    return;
                }
            }
        }
        self.common.trouble = Some(Ending::TooManyEvents { time: self.time() });
    }
}

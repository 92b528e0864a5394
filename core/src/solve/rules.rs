//! Rules of events for every solver: the succession of modes at one instant.
//!
//! The mechanism defines the [`Transition`] of each guard. This module defines the order in which conditions are
//! settled, the tolerance for rounding after a change, and the largest number of changes. A solver provides its
//! conditions by [`Between`].

use super::pace::most_events;
use super::saved::{Pass, Passed};
use super::{Ending, Event, Tie};
use crate::friction::Motion;
use crate::mechanism::{After, Cause, Mechanism, Mode, Next, Part, StateQuantity, Status, Then, Transition, What};
use std::sync::Arc;

/// The rank of conditions on bodies.
const BODIES: u8 = 3;

/// Length of one instant relative to the fastest time constant of the machine.
pub(super) const MOMENT: f64 = 1e-12;

/// Mode changes allowed at one instant.
const CHANGES_AT_ONCE: usize = 100;

/// Changes of a part at one instant after which they are attributed to rounding, and the part keeps its state.
const TURNS_AT_ONCE: usize = 20;

/// A value is zero within rounding if it is within this multiple of its noise: when it is evaluated, when its condition
/// has just begun to hold, and as the tolerance below zero of a part that rounding moves back and forth.
pub(super) const NEAR: f64 = 2.0;
pub(super) const BEGUN: f64 = 20.0;
const BACK_AND_FORTH: f64 = 40.0;

/// The present mode, its recent changes, and its tolerances.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    pub(super) mode: Mode,
    /// Number of leading Taylor coefficients of a sliding body's speed that are zero by definition, because it starts
    /// from rest: 1 if it is accelerated, 2 if the load has only just reached its friction. Likewise for all other
    /// guards.
    pub(super) fresh: [u8; Cause::KINDS],
    pub(super) is_fresh: bool,
    /// Tolerance, from rounding of the load, by which the load on a stuck body may exceed its breakaway; without it a
    /// body that comes to rest just at its limit would chatter on the last bit. Likewise for all other guards that are
    /// zero within rounding and would be violated in either state. The last entry stays zero.
    pub(super) tolerance: [f64; Cause::KINDS + 1],
    /// True after a change of the input, when the rounding of loads on stuck bodies has to be evaluated again.
    pub(super) at_edge: bool,
    /// Time of the last mode change, s, and the number of changes at that time.
    pub(super) since_change: f64,
    pub(super) changes: usize,
    pub(super) events: Vec<Event>,
    pub(super) ties: Vec<Tie>,
    /// Number of events that were passed on before these.
    pub(super) handed_on: usize,
    pub(super) trouble: Option<Ending>,
}

/// Value of a guard, and its rounding error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Known {
    pub(super) value: f64,
    pub(super) noise: f64,
}

/// The load without friction on a body at rest, for forward or backward motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Load {
    pub(super) value: f64,
    /// Coulomb friction once the body slides, in the direction of the motion.
    pub(super) sliding: f64,
    /// The breakaway that it must exceed before the body slides.
    pub(super) breakaway: f64,
    pub(super) noise: f64,
}

/// The interface of the rules to a solver, for the present mode and state.
pub(super) trait Between {
    fn rules(&self) -> &Rules;
    fn rules_mut(&mut self) -> &mut Rules;
    fn mechanism(&self) -> &Arc<Mechanism>;
    fn time(&self) -> f64;
    /// The time within which changes count as one instant, s.
    fn instant(&self) -> f64;
    /// Number of conditions of the mode.
    fn conditions(&self) -> usize;
    /// The transition of this condition.
    fn transition(&self, index: usize) -> &Transition;
    /// Its value.
    fn known(&self, index: usize) -> Known;
    /// The rounding error of its value.
    fn noise_of(&self, index: usize) -> f64;
    /// Known terms of a condition at the beginning of a mode, whose time is known to rounding, too.
    fn known_at_begin(&self, index: usize) -> Known;
    /// Further tolerance for a condition that has just begun to hold: zero for a solver whose series show which
    /// conditions rise from zero.
    fn margin(&self, index: usize) -> f64;
    /// Evaluates all conditions; false if each of them certainly holds.
    fn look(&mut self) -> bool;
    /// True if a condition falls here, by the last evaluation.
    fn falls(&mut self, index: usize) -> bool;
    /// The load on a body at rest for forward or backward motion, with the gear torques at rest.
    fn load(&self, body: usize, forward: bool) -> Load;
    /// True if the speed of a body decays asymptotically, so that rounding decides when it reaches zero.
    fn dies_out(&mut self, body: usize) -> bool;
    /// Sets a quantity of the state.
    fn put(&mut self, place: StateQuantity, value: f64);
    /// Switches to the equations of the present mode.
    fn take_up_mode(&mut self);
}

impl Rules {
    /// Rules of a run that begins in this mode.
    pub(super) fn new(mode: Mode) -> Self {
        Self {
            mode,
            fresh: [0; Cause::KINDS],
            is_fresh: false,
            tolerance: [0.0; Cause::KINDS + 1],
            at_edge: true,
            since_change: f64::INFINITY,
            changes: 0,
            events: Vec::new(),
            ties: Vec::new(),
            handed_on: 0,
            trouble: None,
        }
    }

    /// Number of leading Taylor coefficients of a condition's value that are zero by definition.
    pub(super) fn fresh_order(&self, cause: Cause) -> usize {
        match cause {
            Cause::BreakForward(_) | Cause::BreakBackward(_) => 0,
            cause => usize::from(self.fresh[cause.kind()]),
        }
    }

    /// Passes the rules as plain numbers; fails for a run that has ended early.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        pass.mode(&mut self.mode)?;
        for fresh in &mut self.fresh {
            let mut order = usize::from(*fresh);
            pass.count(&mut order)?;
            *fresh = u8::try_from(order).ok()?;
        }
        pass.flag(&mut self.is_fresh)?;
        pass.numbers(&mut self.tolerance)?;
        pass.flag(&mut self.at_edge)?;
        pass.number(&mut self.since_change)?;
        pass.count(&mut self.handed_on)?;
        pass.count(&mut self.changes)?;
        (self.tolerance[Cause::KINDS] == 0.0).then_some(())
    }

    fn start_fresh(&mut self, cause: Cause, order: u8) {
        (self.fresh[cause.kind()], self.is_fresh) = (order, true);
    }

    /// Clears the information on fresh conditions.
    pub(super) fn refreshed(&mut self) {
        if self.is_fresh {
            (self.fresh, self.is_fresh) = ([0; Cause::KINDS], false);
        }
    }

    /// Passes the events on.
    pub(super) fn hand_on(&mut self, events: &mut Vec<Event>) {
        self.handed_on += self.events.len();
        events.append(&mut self.events);
    }

    /// Ends a run with more events than allowed up to `time`.
    pub(super) fn check_events(&mut self, time: f64) {
        if (self.handed_on + self.events.len()) as f64 > most_events(time) {
            self.trouble = Some(Ending::TooManyEvents { time });
        }
    }

    /// True if changes go back and forth at this instant.
    fn is_back_and_forth(&self) -> bool {
        self.changes > TURNS_AT_ONCE
    }
}

/// Changes modes at the present instant until every condition holds.
pub(super) fn settle<B: Between>(solver: &mut B) {
    for _ in 0..CHANGES_AT_ONCE {
        let fallen = fallen(solver);
        // Everything that does not depend on bodies is settled: now their loads and the rounding of these are known.
        if solver.rules().at_edge && fallen.is_none_or(|fallen| fallen.rank == BODIES) {
            solver.rules_mut().at_edge = false;
            widen_all_breakaways(solver);
            if fallen.is_some() {
                continue;
            }
        }
        let Some(fallen) = fallen else {
            start_gears(solver);
            let time = solver.time();
            solver.rules_mut().check_events(time);
            return;
        };
        change(solver, fallen);
        if solver.rules().trouble.is_some() {
            return;
        }
    }
    solver.rules_mut().trouble = Some(Ending::TooManyEvents { time: solver.time() });
}

/// The condition that is violated here; of several, the one that is settled first.
fn fallen<B: Between>(solver: &mut B) -> Option<Transition> {
    if !solver.look() {
        return None;
    }
    let mut fallen: Option<Transition> = None;
    for index in 0..solver.conditions() {
        if solver.falls(index) {
            let next = *solver.transition(index);
            if fallen.is_none_or(|first| next.rank < first.rank) {
                fallen = Some(next);
            }
        }
    }
    fallen
}

/// Enters the mode after a condition has become negative.
pub(super) fn change<B: Between>(solver: &mut B, fallen: Transition) {
    let (time, instant) = (solver.time(), solver.instant());
    let rules = solver.rules_mut();
    rules.changes = if rules.since_change <= instant { rules.changes + 1 } else { 0 };
    rules.since_change = 0.0;
    if rules.changes > CHANGES_AT_ONCE {
        rules.trouble = Some(Ending::TooManyEvents { time });
    }
    match fallen.then {
        Then::Become(Next::Moves(body, to)) => move_on(solver, &fallen, body, Some(to)),
        Then::Decide(body) => move_on(solver, &fallen, body, None),
        Then::Become(next) => switch(solver, &fallen, next),
        Then::Leave => rules.trouble = Some(Ending::LeftTravel { time }),
    }
}

/// Changes the motion of a body; `None` lets its load decide.
fn move_on<B: Between>(solver: &mut B, fallen: &Transition, body: usize, to: Option<Motion>) {
    let mechanism = Arc::clone(solver.mechanism());
    let stops = to.is_none();
    let by_rounding = stops && solver.dies_out(body);
    fallen.resets.each(&mechanism).for_each(|(place, value)| solver.put(place, value));
    let again = solver.rules().is_back_and_forth();
    let to = match to {
        Some(to) => to,
        // A body whose reversals are caused by rounding alone is taken to be at rest.
        None if again => {
            note_tie(solver, body);
            Motion::Stuck
        }
        None => decide(solver, body),
    };
    // When it stops, the load is that of the previous direction.
    let from = solver.rules().mode.motion[body];
    let side = if to == Motion::Stuck { from } else { to };
    let load = solver.load(body, side != Motion::Backward);
    let order = match to {
        Motion::Stuck | Motion::Free => 0,
        _ if stops => 1,
        // If breakaway equals Coulomb friction, the acceleration starts from zero within rounding.
        _ if (load.value - load.sliding).abs() <= NEAR * load.noise => 2,
        _ => 1,
    };
    let time = solver.time();
    let rules = solver.rules_mut();
    rules.start_fresh(Cause::Stop(body), order);
    mechanism.put_next(&mut rules.mode, Next::Moves(body, to));
    if fallen.after == After::BreakawaysWiden {
        for side in [Cause::BreakForward(body), Cause::BreakBackward(body)] {
            rules.tolerance[side.kind()] = if again { BEGUN } else { NEAR } * load.noise;
        }
    }
    if let Some(what) = fallen.told {
        let (part, from, to) = (Part::new(&mechanism, what), Status::Motion(from), Status::Motion(to));
        Event { time, part, from, to, load: load.value, by_rounding }.note(&mut rules.events);
    }
    solver.take_up_mode();
}

/// The motion of a body at zero speed under its present load.
fn decide<B: Between>(solver: &B, body: usize) -> Motion {
    let forward = solver.load(body, true);
    if forward.value > forward.breakaway + forward.noise {
        return Motion::Forward;
    }
    let backward = solver.load(body, false);
    if backward.value < -backward.breakaway - backward.noise { Motion::Backward } else { Motion::Stuck }
}

/// Switches a part other than a body.
fn switch<B: Between>(solver: &mut B, fallen: &Transition, next: Next) {
    let mechanism = Arc::clone(solver.mechanism());
    let time = solver.time();
    let After::PartHolds { gently } = fallen.after else { return };
    // A current released by the motion, not by a jump of the input, leaves its limit with zero rate.
    let begun = |index: &usize| {
        let Known { value, noise } = solver.known(*index);
        solver.transition(*index).cause == fallen.cause && value.abs() <= BEGUN * noise
    };
    let gently = gently.filter(|_| (0..solver.conditions()).any(|index| begun(&index)));
    let rules = solver.rules_mut();
    let from = fallen.told.map(|what| rules.mode.status(what));
    mechanism.put_next(&mut rules.mode, next);
    if let (Some(what), Some(from)) = (fallen.told, from) {
        let (part, to) = (Part::new(&mechanism, what), rules.mode.status(what));
        Event { time, part, from, to, load: 0.0, by_rounding: false }.note(&mut rules.events);
    }
    solver.take_up_mode();
    fallen.resets.each(&mechanism).for_each(|(place, value)| solver.put(place, value));
    hold_part(solver, fallen.cause);
    if let Some(starts) = gently {
        solver.rules_mut().start_fresh(starts, 2);
    }
}

/// Sets a new condition on a part to zero if it is zero within rounding.
fn hold_part<B: Between>(solver: &mut B, cause: Cause) {
    for index in 0..solver.conditions() {
        let own = solver.transition(index).cause;
        if !own.is_of_same_part(cause) {
            continue;
        }
        let (Known { value, noise }, margin) = (solver.known_at_begin(index), solver.margin(index));
        let rules = solver.rules_mut();
        let (tolerance, order) = match (value.abs() <= BEGUN * noise, rules.is_back_and_forth()) {
            // A torque that reverses repeatedly at one instant is zero.
            (false, true) if matches!(cause, Cause::GearTorque(_)) => (NEAR * value.abs(), 0),
            (false, _) => (0.0, 0),
            (true, false) => (f64::max(-value, 0.0) + margin, 1),
            // A part that rounding moves back and forth at one instant keeps its state.
            (true, true) => (BACK_AND_FORTH * noise, 0),
        };
        rules.tolerance[own.kind()] = tolerance;
        rules.start_fresh(own, order);
    }
}

/// A load that exceeds a breakaway by rounding alone does not start motion.
fn widen_all_breakaways<B: Between>(solver: &mut B) {
    for index in 0..solver.conditions() {
        if let cause @ (Cause::BreakForward(_) | Cause::BreakBackward(_)) = solver.transition(index).cause {
            let noise = solver.noise_of(index);
            let tolerance = &mut solver.rules_mut().tolerance[cause.kind()];
            *tolerance = tolerance.max(NEAR * noise);
        }
    }
}

/// A torque that starts from zero does so for either sign of the gear torque.
fn start_gears<B: Between>(solver: &mut B) {
    for index in 0..solver.conditions() {
        if let cause @ Cause::GearTorque(_) = solver.transition(index).cause {
            let Known { value, noise } = solver.known(index);
            if value.abs() <= NEAR * noise {
                solver.rules_mut().start_fresh(cause, 1);
            }
        }
    }
}

/// Records that rounding decides the motion of a body.
pub(super) fn note_tie<B: Between>(solver: &mut B, body: usize) {
    let tie = Tie { time: solver.time(), part: Part::new(solver.mechanism(), What::Body(body)) };
    let rules = solver.rules_mut();
    tie.note(&mut rules.ties, &rules.events);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Events that were passed on count towards the limit of a run.
    #[test]
    fn events_that_were_handed_on_are_counted() {
        let mut rules = Rules::new(Mode::new(std::iter::empty()));
        let event = Event {
            time: 0.0,
            part: Part { what: What::Body(0), label: crate::mechanism::testing::PART },
            from: Status::Motion(Motion::Stuck),
            to: Status::Motion(Motion::Forward),
            load: 0.0,
            by_rounding: false,
        };
        let mut all = Vec::new();
        for count in [2, 3] {
            rules.events.extend(std::iter::repeat_n(event, count));
            rules.hand_on(&mut all);
        }
        assert_eq!((rules.handed_on, all.len(), rules.events.len()), (5, 5, 0));
    }

    #[test]
    fn a_condition_that_has_changed_is_zero_to_its_order_until_it_is_refreshed() {
        let mut rules = Rules::new(Mode::new(std::iter::empty()));
        rules.start_fresh(Cause::Stop(1), 2);
        assert_eq!([Cause::Stop(1), Cause::BreakForward(1), Cause::Stop(0)].map(|c| rules.fresh_order(c)), [2, 0, 0]);
        rules.refreshed();
        assert_eq!(rules.fresh_order(Cause::Stop(1)), 0);
    }
}

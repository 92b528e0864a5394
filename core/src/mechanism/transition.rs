//! Transition rules of events, as data made with their guards.
//!
//! Solvers and exports read them; none decides by itself.

use super::{AmplifierMode, Cause, Drive, Form, Limit, Mechanism, Mode, Switch, What};
use crate::friction::Motion;

/// Transition of a guard that becomes negative.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Transition {
    /// The condition.
    pub cause: Cause,
    /// Rank among simultaneous events; the lowest is settled first.
    pub rank: u8,
    /// The next state.
    pub then: Then,
    /// States that the event sets.
    pub resets: Resets,
    /// Tolerance for rounding after it.
    pub after: After,
    /// The part named in the event; none for gear torque and for a rotor, which only its gear holds.
    pub told: Option<What>,
}

/// The next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Then {
    /// A part switches.
    Become(Next),
    /// A stopped body continues in the direction in which its load exceeds the breakaway; otherwise it sticks.
    Decide(usize),
    /// The run ends.
    Leave,
}

/// The next state of a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Next {
    /// A body, and those that move with it.
    Moves(usize, Motion),
    /// The gear of a drive: whether its torque is positive.
    Torque(usize, bool),
    /// Any other part.
    Switch(Switch),
}

/// States that an event sets.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Resets {
    /// None.
    None,
    /// The speeds of a body and of those that move with it become zero.
    Speeds(usize),
    /// The current of a drive is set to its limit, A.
    Current(usize, f64),
}

/// A quantity of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StateQuantity {
    /// Speed of a body.
    Speed(usize),
    /// Current of a drive, by the number of its winding.
    Current(usize),
}

/// Tolerance for rounding after an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum After {
    /// Nothing.
    Nothing,
    /// Guards of the part that are zero within rounding count as satisfied.
    PartHolds {
        /// The guard that starts from zero with zero slope if the motion, not a jump of the input, has released the
        /// part: for a current that leaves its limit.
        gently: Option<Cause>,
    },
    /// The load on the body may exceed its breakaways by its rounding.
    BreakawaysWiden,
}

impl Resets {
    /// The quantities, and their values.
    pub fn each(self, mechanism: &Mechanism) -> impl Iterator<Item = (StateQuantity, f64)> + '_ {
        let (leader, current) = match self {
            Resets::None => (None, None),
            Resets::Speeds(body) => (Some(body), None),
            Resets::Current(drive, value) => {
                (None, Some((StateQuantity::Current(mechanism.first_current(drive)), value)))
            }
        };
        let speeds = leader.into_iter().flat_map(|body| mechanism.followers(body));
        speeds.map(|body| (StateQuantity::Speed(body), 0.0)).chain(current)
    }
}

impl Mechanism {
    /// Transition for this guard of `mode`.
    pub(super) fn transition(&self, cause: Cause, mode: &Mode) -> Transition {
        let widen = |body, then, resets| (then, resets, After::BreakawaysWiden, self.told(body));
        let breaks = |body, motion| widen(body, Then::Become(Next::Moves(body, motion)), Resets::None);
        let (then, resets, after, told) = match cause {
            Cause::Stop(body) => widen(body, Then::Decide(body), Resets::Speeds(body)),
            Cause::BreakForward(body) => breaks(body, Motion::Forward),
            Cause::BreakBackward(body) => breaks(body, Motion::Backward),
            Cause::GearTorque(drive) => {
                let next = Next::Torque(drive, !mode.drive[drive].torque_positive);
                (Then::Become(next), Resets::None, After::PartHolds { gently: None }, None)
            }
            Cause::Switch(switch) => {
                let (resets, gently) = self.current_at_limit(switch, mode);
                (Then::Become(Next::Switch(switch)), resets, After::PartHolds { gently }, Some(switch.what()))
            }
            Cause::Leave(_) => (Then::Leave, Resets::None, After::Nothing, None),
        };
        Transition { cause, rank: cause.rank(), then, resets, after, told }
    }

    /// The part named in events of a body.
    fn told(&self, body: usize) -> Option<What> {
        (!self.bodies[body].is_rotor).then_some(What::Body(body))
    }

    /// The effect of a switch on a current that is a state and is held at its limit.
    fn current_at_limit(&self, switch: Switch, mode: &Mode) -> (Resets, Option<Cause>) {
        let Switch::Current(drive, side) = switch else { return (Resets::None, None) };
        let part = &self.drives[drive];
        if !part.has_current_state() || part.amplifier.mode != AmplifierMode::Voltage {
            return (Resets::None, None);
        }
        let left = mode.drive[drive].current;
        match side {
            Limit::Inside => (Resets::None, Some(Cause::Switch(Switch::Current(drive, left)))),
            // It is at its limit, to the last bit.
            side => (Resets::Current(drive, side.sign() * part.amplifier.current_limit.unwrap_or(0.0)), None),
        }
    }

    /// Switches a part to its next state.
    pub(crate) fn put_next(&self, mode: &mut Mode, next: Next) {
        match next {
            Next::Moves(body, motion) => self.followers(body).for_each(|body| mode.motion[body] = motion),
            Next::Torque(drive, positive) => mode.drive[drive].torque_positive = positive,
            Next::Switch(switch) => mode.switch(switch),
        }
    }

    /// The mode for loads on bodies at rest: lossy gears have the torque sign that holds at rest. `value` evaluates a
    /// form in the present state.
    pub(crate) fn resting_mode(&self, mode: &Mode, value: impl Fn(&Form) -> f64) -> Mode {
        let mut resting = *mode;
        let losing = |(_, drive): &(usize, &Drive)| drive.loses();
        for (drive, _) in self.drives.iter().enumerate().filter(losing) {
            resting.drive[drive].torque_positive = value(&self.torque_at_rest(drive, mode)) >= 0.0;
        }
        resting
    }
}

//! The general solver's answers to the rules of events: values and errors of its conditions, loads, the equations of a
//! mode.

use super::Core;
use crate::mechanism::{Cause, Mechanism, StateQuantity, Transition};
use crate::solve::rules::{BEGUN, Between, Known, Load, MOMENT, Rules};
use std::sync::Arc;

/// The share of a breakaway that rounding may take of the load on a body at rest, at least.
const OF_BREAKAWAY: f64 = 5e-13;

/// A condition that has just begun to hold is zero within this multiple of the error of the formula.
const ERRORS: f64 = 4.0;

impl Between for Core {
    fn rules(&self) -> &Rules {
        &self.rules
    }

    fn rules_mut(&mut self) -> &mut Rules {
        &mut self.rules
    }

    fn mechanism(&self) -> &Arc<Mechanism> {
        &self.model.mechanism
    }

    fn time(&self) -> f64 {
        Core::time(self)
    }

    fn instant(&self) -> f64 {
        // Sums of times are rounded.
        MOMENT * self.moment + 4.0 * f64::EPSILON * Core::time(self)
    }

    fn conditions(&self) -> usize {
        self.known[self.present].field.watches.len()
    }

    fn transition(&self, index: usize) -> &Transition {
        &self.known[self.present].field.watches[index]
    }

    fn known(&self, index: usize) -> Known {
        let value = self.field().guards(&self.stretch.input(self.tau), &self.y)[index];
        Known { value, noise: self.noise_of(index) }
    }

    fn noise_of(&self, index: usize) -> f64 {
        match self.transition(index).cause {
            Cause::BreakForward(body) => self.load(body, true).noise,
            Cause::BreakBackward(body) => self.load(body, false).noise,
            Cause::Stop(_) | Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => {
                self.error_at(index) * (ERRORS / BEGUN)
            }
        }
    }

    fn known_at_begin(&self, index: usize) -> Known {
        let Known { value, noise } = self.known(index);
        // Smaller torques do not count.
        let least = match self.transition(index).cause {
            Cause::GearTorque(drive) => self.relative * self.torque[drive] / BEGUN,
            _ => 0.0,
        };
        Known { value, noise: noise.max(least) }
    }

    fn margin(&self, index: usize) -> f64 {
        match self.transition(index).cause {
            Cause::Switch(_) => self.error_at(index),
            _ => 0.0,
        }
    }

    fn look(&mut self) -> bool {
        self.values = self.field().guards(&self.stretch.input(self.tau), &self.y);
        true
    }

    fn falls(&mut self, index: usize) -> bool {
        let cause = self.transition(index).cause;
        let value = self.values[index] + self.forgiven(cause);
        match (self.outside, cause) {
            (Some(shift), _) => value + shift <= 0.0,
            // The next step decides about a speed.
            (None, Cause::Stop(_)) => false,
            (None, _) => value < 0.0,
        }
    }

    fn load(&self, body: usize, forward: bool) -> Load {
        let (model, mode, y, input) = (&*self.model, &self.rules.mode, &self.y, &self.stretch.input(self.tau));
        let coulomb = model.mechanism.friction(body).side(forward).coulomb;
        let own = model.breakaway(body, forward, y);
        // Bent bristles hold the body like friction.
        let held = model.bristle_force(body, y);
        let (sliding, breakaway) = if forward { (coulomb, own + held) } else { (-coulomb, own - held) };
        let noise = model.noise(body, mode, y, input).max(OF_BREAKAWAY * own);
        Load { value: model.load(body, forward, mode, y, input), sliding, breakaway, noise }
    }

    fn dies_out(&mut self, body: usize) -> bool {
        // The remaining deceleration is below the error of the formula within the time constant of its fastest change.
        let rate = self.field().rate(&self.stretch.input(self.tau), &self.y);
        let place = self.model.speed(body);
        rate[place].abs() * self.moment <= self.absolute[place]
    }

    fn put(&mut self, place: StateQuantity, value: f64) {
        let place = match place {
            StateQuantity::Speed(body) => Some(self.model.speed(body)),
            StateQuantity::Current(drive) => self.model.current[drive],
        };
        place.iter().for_each(|place| self.y[*place] = value);
    }

    fn take_up_mode(&mut self) {
        self.taken += 1;
        self.coordinates.hold(&self.model.layout, &self.rules.mode, &self.model.inner(&self.y));
        self.make_ready();
    }
}

impl Core {
    /// Tolerance of a condition: for a speed what the laws' error may do, which is no stop, least of all where a body
    /// has just begun to slide.
    pub(super) fn forgiven(&self, cause: Cause) -> f64 {
        match cause {
            Cause::Stop(body) => self.absolute[self.model.speed(body)],
            cause => self.rules.tolerance[cause.kind()],
        }
    }

    /// Error of the formula in a condition.
    fn error_at(&self, index: usize) -> f64 {
        let field = &self.known[self.present].field;
        let rounding = field.rounding(index, &self.absolute.map(|absolute| absolute / self.relative));
        (self.relative * field.size(index, &self.stretch.input(self.tau), &self.y)).max(rounding)
    }
}

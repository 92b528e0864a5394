//! Control laws: their common interface.
//!
//! A law is written once, for any [`Calculator`]. From it follow the running controller ([`super::Standard`]), its
//! linearisation ([`super::feedback`]) and the exported program.

use crate::calculator::{Calculator, Slot, Slots, less};
use crate::reach::compensation::Compensation;
use crate::signal::profile::Reference;

/// Inputs of a law at a sample.
#[derive(Debug, Clone, Copy)]
pub struct LawInputs<'a, N> {
    /// Reference of the cart.
    pub reference: Reference<N>,
    /// Reference of the encoder's side for which the cart is at its reference.
    pub target: Reference<N>,
    /// Measured position, m along the belt.
    pub position: N,
    /// Cart position by an additional scale, m; none without a scale.
    pub scale: Option<N>,
    /// Measured motor current, A.
    pub current: N,
    /// Feed-forward added to a current that the law commands, A, if any.
    pub forward: Option<N>,
    /// Requirements of the reference on pulleys and motor.
    pub compensation: &'a Compensation,
}

/// A structure with its gains, made for an axis.
pub trait Law {
    /// Description for a comment in an exported program.
    fn about(&self) -> &'static str;

    /// True if it has an inner current loop, to which feed-forward is added.
    fn commands_current(&self) -> bool;

    /// True if it is linear except for limits; otherwise it is linearised at rest.
    fn is_linear(&self) -> bool;

    /// The next command without feed-forward.
    fn step<C: Calculator>(&self, c: &mut C, seen: &LawInputs<C::N>) -> C::N;

    /// Receives the change of the command by the limit (`excess`), and the command that the axis gets less dry
    /// friction.
    fn limited<C: Calculator>(&self, c: &mut C, excess: C::N, effective: C::N);
}

/// A number at the previous sample; at the first one, the present number.
#[derive(Debug, Clone, Copy)]
pub(super) struct Last {
    has: Slot,
    value: Slot,
}

impl Last {
    pub fn new(slots: &mut Slots, name: &'static str, about: &'static str) -> Self {
        Self { has: slots.add(format!("has_{name}"), "1 once there is one"), value: slots.add(name, about) }
    }

    /// The previous value; stores the present one.
    pub fn step<C: Calculator>(&self, c: &mut C, now: C::N) -> C::N {
        let (has, was, one) = (c.memory(self.has), c.memory(self.value), c.number(1.0));
        c.keep(self.has, one);
        c.keep(self.value, now);
        let last = c.choose(less(has, 0.5), now, was);
        c.name("before", last)
    }
}

/// Speed from a measured position: differences through a first-order filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Speed {
    every: f64,
    keep: f64,
    last: Last,
    value: Slot,
}

impl Speed {
    /// With a corner at `filter`, Hz.
    pub fn new(slots: &mut Slots, every: f64, filter: f64) -> Self {
        let last = Last::new(slots, "last", "position at the last sample, m");
        let keep = (-2.0 * std::f64::consts::PI * filter * every).exp();
        Self { every, keep, last, value: slots.add("speed", "filtered speed, m/s") }
    }

    pub fn step<C: Calculator>(&self, c: &mut C, position: C::N) -> C::N {
        let difference = (position - self.last.step(c, position)) / self.every;
        let speed = c.memory(self.value) * self.keep + difference * (1.0 - self.keep);
        let speed = c.name("new_speed", speed);
        c.keep(self.value, speed);
        speed
    }
}

//! PID, and cascades of P and PI.
//!
//! With the weight c of the reference's speed: c = 1 differentiates the error, c = 0 the measurement alone.

use super::memory::{Memory, all, last};
use super::sampled::Speed;
use crate::design::{Cascade, Pid};
use crate::signal::profile::Reference;

/// A PID controller: u = K_p e + K_i ∫e dt + K_d (c ẏ* − ẏ).
#[derive(Debug, Clone)]
pub struct PidState {
    gains: Pid,
    every: f64,
    integral: f64,
    slope: f64,
    last: Option<f64>,
}

impl PidState {
    /// Stepped every `every` s.
    pub fn new(gains: &Pid, every: f64) -> Self {
        Self { gains: *gains, every, integral: 0.0, slope: 0.0, last: None }
    }

    /// The next command.
    pub fn step(&mut self, target: &Reference, position: f64) -> f64 {
        let Pid { proportional, integral, derivative, filter, reference_speed: c, .. } = self.gains;
        let error = target.position - position;
        // T_f ḋ + d = c ẏ* − ẏ by backward differences
        let time = 1.0 / (2.0 * std::f64::consts::PI * filter);
        let weighed = c * target.position - position;
        let change = weighed - self.last.unwrap_or(weighed);
        self.slope = (time * self.slope + change) / (time + self.every);
        self.last = Some(weighed);
        self.integral += integral * self.every * error;
        proportional * error + self.integral + derivative * self.slope
    }

    /// Back-calculation: the integral follows what the limit leaves. Without a gain there is none: nothing would ever
    /// empty it again.
    pub fn limited(&mut self, excess: f64) {
        if self.gains.integral != 0.0 {
            self.integral += (self.every / self.gains.tracking).min(1.0) * excess;
        }
    }

    /// Forgets.
    pub fn reset(&mut self) {
        *self = Self::new(&self.gains, self.every);
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        all([&mut self.integral, &mut self.slope], memory)?;
        last(&mut self.last, memory)
    }
}

/// A position loop around a speed loop, around a current loop if there is one.
#[derive(Debug, Clone)]
pub struct CascadeState {
    gains: Cascade,
    every: f64,
    speed: Speed,
    speed_integral: f64,
    current_integral: f64,
}

impl CascadeState {
    /// Stepped every `every` s.
    pub fn new(gains: &Cascade, every: f64) -> Self {
        let speed = Speed::new(every, gains.filter);
        Self { gains: *gains, every, speed, speed_integral: 0.0, current_integral: 0.0 }
    }

    /// The next command, told the position that its speed is of and the one that is to follow the target: with two
    /// sensors that of the motor and that of the cart. `forward` is what feed-forward adds to the speed loop's output
    /// where that is a current.
    pub fn step(&mut self, target: &Reference, [motor, load]: [f64; 2], current: f64, forward: f64) -> f64 {
        let gains = &self.gains;
        let speed = self.speed.step(motor);
        // v* = K_v (y* − y) + c ẏ*
        let wanted = gains.position * (target.position - load) + gains.reference_speed * target.speed;
        let error = wanted - speed;
        self.speed_integral += gains.speed_integral * self.every * error;
        let output = gains.speed * error + self.speed_integral;
        let Some(inner) = gains.current else { return output };
        let asked = output + forward;
        let held = inner.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
        self.push_speed(self.share() * (held - asked));
        let error = held - current;
        self.current_integral += inner.integral * self.every * error;
        inner.proportional * error + self.current_integral
    }

    /// Whether its speed loop asks for a current.
    pub fn commands_current(&self) -> bool {
        self.gains.current.is_some()
    }

    fn share(&self) -> f64 {
        (self.every / self.gains.tracking).min(1.0)
    }

    /// Adds to the speed loop's integral, if it has one: of a gain of zero nothing would ever empty it again.
    fn push_speed(&mut self, change: f64) {
        if self.gains.speed_integral != 0.0 {
            self.speed_integral += change;
        }
    }

    /// Back-calculation in the innermost loop.
    pub fn limited(&mut self, excess: f64) {
        let share = self.share() * excess;
        let Some(inner) = self.gains.current else { return self.push_speed(share) };
        if inner.integral != 0.0 {
            self.current_integral += share;
        }
        if inner.proportional != 0.0 {
            self.push_speed(share / inner.proportional);
        }
    }

    /// Forgets.
    pub fn reset(&mut self) {
        *self = Self::new(&self.gains, self.every);
    }

    /// Shows its memory to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        self.speed.memory(memory)?;
        all([&mut self.speed_integral, &mut self.current_integral], memory)
    }
}

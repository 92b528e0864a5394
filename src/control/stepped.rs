//! A controller stepped from outside: whoever asks gives it the reference, and the machine at its samples.

use super::memory::{Memory, all, flag};
use super::sampled::{Controller, Loop, Observation, Sensor};
use super::standard::Standard;
use crate::design::Design;
use crate::error::Result;
use crate::mechanism::State;
use crate::signal::profile::Reference;
use crate::stage::Stage;
use crate::trajectory::Interval;
use std::collections::VecDeque;

/// A controller with its clock, its delay and its limit, between two of its decisions. A clone of it goes on in the
/// same way.
#[derive(Debug, Clone)]
pub struct Stepped {
    controller: Standard,
    timing: Loop,
    clock: Interval,
    sensor: Sensor,
    /// Next sample, and the place in it: at the sample, or where a delayed command takes over.
    k: u64,
    halfway: bool,
    /// Rest of the delay beyond whole samples, s.
    rest: f64,
    waiting: VecDeque<f64>,
    acting: f64,
}

impl Stepped {
    /// The controller of `design` on `stage`, its first sample at time zero.
    pub fn new(design: &Design, stage: &Stage) -> Result<Self> {
        let timing = Loop::of(design);
        timing.check(timing.every)?;
        let (whole, rest) = timing.samples_late();
        Ok(Self {
            controller: Standard::new(design, stage)?,
            timing,
            clock: Interval::of(timing.every),
            sensor: Sensor::new(stage),
            k: 0,
            halfway: false,
            rest,
            waiting: std::iter::repeat_n(0.0, whole).collect(),
            acting: 0.0,
        })
    }

    /// When it decides next, s.
    pub fn next(&self) -> f64 {
        self.clock.times(self.k) + if self.halfway { self.rest } else { 0.0 }
    }

    /// The command that acts now, V or A.
    pub fn command(&self) -> f64 {
        self.acting
    }

    /// Decides at [`Stepped::next`], told the state, the motor's current, A, and the reference there, from which it
    /// looks ahead as if its acceleration stayed. The command acts until the next decision.
    pub fn decide(&mut self, state: &State, current: f64, reference: &Reference) -> f64 {
        if self.halfway {
            self.halfway = false;
            self.k += 1;
            self.acting = self.waiting.pop_front().unwrap_or(0.0);
            return self.acting;
        }
        let seen = Observation {
            time: self.clock.times(self.k),
            reference: *reference,
            ahead: after(reference, self.timing.lead),
            position: self.sensor.read(state),
            current,
        };
        let asked = self.controller.step(&seen);
        // What is no number asks for nothing.
        let asked = if asked.is_finite() { asked } else { 0.0 };
        let given = self.timing.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
        self.controller.limited(given);
        self.waiting.push_back(given);
        if self.rest > 0.0 {
            self.halfway = true;
        } else {
            self.k += 1;
            self.acting = self.waiting.pop_front().unwrap_or(0.0);
        }
        self.acting
    }
}

impl Stepped {
    /// All that it needs to go on, as plain numbers.
    pub fn save(&self) -> Vec<u64> {
        let mut list = Vec::new();
        let mut out = |number: &mut f64| {
            list.push(number.to_bits());
            Some(())
        };
        // Every number is shown to a function that takes all of them.
        let _ = self.clone().memory(&mut out);
        list.push(self.k);
        list
    }

    /// Goes on from what [`Stepped::save`] gave, bit for bit, of a controller of the same design. None, and nothing has
    /// changed, where `saved` is not of such a one.
    pub fn restore(&mut self, saved: &[u64]) -> Option<()> {
        let (k, numbers) = saved.split_last()?;
        let mut numbers = numbers.iter();
        let mut copy = self.clone();
        copy.memory(&mut |number| {
            *number = f64::from_bits(*numbers.next()?);
            Some(())
        })?;
        if numbers.next().is_some() {
            return None;
        }
        *self = Self { k: *k, ..copy };
        Some(())
    }

    fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        flag(&mut self.halfway, memory)?;
        // Between a sample and where its command takes over, that command waits with the others.
        let (whole, _) = self.timing.samples_late();
        self.waiting.resize(whole + usize::from(self.halfway), 0.0);
        all(self.waiting.iter_mut().chain([&mut self.acting]), memory)?;
        self.controller.memory(memory)
    }
}

/// A reference `lead` later, s, if its highest derivative stays.
fn after(reference: &Reference, lead: f64) -> Reference {
    if lead == 0.0 {
        return *reference;
    }
    let Reference { position, speed, acceleration, jerk, snap } = *reference;
    Reference {
        position: position + lead * (speed + lead * (acceleration / 2.0 + lead * (jerk / 6.0 + lead * snap / 24.0))),
        speed: speed + lead * (acceleration + lead * (jerk / 2.0 + lead * snap / 6.0)),
        acceleration: acceleration + lead * (jerk + lead * snap / 2.0),
        jerk: jerk + lead * snap,
        snap,
    }
}

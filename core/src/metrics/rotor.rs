//! Time at which an independent rotor comes to rest.

use super::NEWS;
use crate::solve::{Curve, Gap};

/// Fraction of its largest speed below which an independent rotor counts as resting.
const RESTING: f64 = 1e-6;

/// An independent rotor: without friction it comes to rest only asymptotically.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rotor {
    /// Index of its speed among the readings.
    reading: usize,
    /// Its largest speed so far, rad/s.
    fastest: f64,
    /// Last time at which it turned faster than [`RESTING`] times that, s.
    pub turned: f64,
    pub rests: bool,
}

impl Rotor {
    pub fn new(reading: usize) -> Self {
        Self { reading, fastest: 0.0, turned: 0.0, rests: false }
    }

    pub fn end(&mut self, speed: f64) {
        self.rests = speed.abs() <= RESTING * self.fastest;
    }

    pub fn pass(&mut self, gap: &Gap) -> bool {
        let (q, end) = (self.reading, gap.begin + gap.length);
        let (from, to) = (gap.from[q].abs(), gap.to[q].abs());
        self.fastest = self.fastest.max(from).max(to);
        let slow = RESTING * self.fastest;
        if to > slow {
            self.turned = self.turned.max(end);
        } else if from > slow {
            self.turned = self.turned.max(gap.begin);
        }
        let bound = gap.bound(q);
        bound > self.fastest * (1.0 + NEWS) || (to <= slow && bound > slow)
    }

    pub fn see(&mut self, curve: &Curve) {
        let speed = curve.polynomial(self.reading);
        self.fastest = self.fastest.max(speed.largest(0.0, 1.0).1.abs());
        let slow = RESTING * self.fastest;
        let shifted = |by: f64| {
            let mut shifted = speed;
            shifted.0[0] += by;
            shifted.zeros(0.0, 1.0).last().copied()
        };
        if let Some(s) = shifted(slow).into_iter().chain(shifted(-slow)).reduce(f64::max) {
            self.turned = self.turned.max(curve.begin + s * curve.length);
        }
    }
}

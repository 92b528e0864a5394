//! A controller with a known signal added to its command, such as one learned for a repeated move.

use super::sampled::{Added, Controller, Observation};
use super::standard::Standard;
use crate::signal::profile::Reference;

/// Controller of a drive with a signal added to the command at each sample, before delay and limit.
#[derive(Debug, Clone)]
pub struct Fed<'a> {
    controller: Standard,
    signal: &'a Added,
    /// Value added at the last sample, V or A.
    last: f64,
}

impl<'a> Fed<'a> {
    /// A controller and the signal, V or A, held between its times.
    pub fn new(controller: Standard, signal: &'a Added) -> Self {
        Self { controller, signal, last: 0.0 }
    }
}

impl Controller for Fed<'_> {
    fn step(&mut self, seen: &Observation) -> f64 {
        // Times of samples are rounded.
        let near = 1e-9 * (1.0 + seen.time);
        self.last = self.signal.at(seen.time + near).0;
        self.controller.step(seen) + self.last
    }

    fn forward(&mut self, slides: &[Reference]) -> f64 {
        self.controller.forward(slides)
    }

    fn target(&self, along: Reference, slides: &[Reference]) -> Reference {
        self.controller.target(along, slides)
    }

    fn limited(&mut self, given: f64) {
        self.controller.limited(given - self.last);
    }

    fn reset(&mut self) {
        self.controller.reset();
        self.last = 0.0;
    }
}

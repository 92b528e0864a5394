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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    /// The signal is added to the command, and what the controller takes for its own limited command is without it.
    #[test]
    fn a_signal_adds_to_the_command_at_its_time() {
        let file = format!("{}/../stages/sollmann-jouaneh/controllers/pid.toml", env!("CARGO_MANIFEST_DIR"));
        let case = Case::read_with(&file, &[]).unwrap();
        let controller = Standard::new(case.controller.as_ref().unwrap(), &case.machine).unwrap();
        let signal = Added::new(1e-3, vec![0.0, 0.7, -0.4]);
        let (mut plain, mut fed) = (controller.clone(), Fed::new(controller, &signal));
        for (k, added) in [0.0, 0.7, -0.4, -0.4].into_iter().enumerate() {
            let seen = Observation { time: 1e-3 * k as f64, position: -1e-4 * k as f64, ..Observation::default() };
            let own = plain.step(&seen);
            let whole = fed.step(&seen);
            assert!((whole - own - added).abs() < 1e-12, "{k}: {whole} {own}");
            // Half of both is cut off.
            plain.limited(0.5 * own);
            fed.limited(0.5 * own + added);
        }
    }
}

//! Perturbed machine: parameters changed by a few roundings, to estimate the sensitivity of a run.

use super::{Mechanism, SpringLaw};

/// Relative perturbation: a few tens of roundings.
const NUDGE: f64 = 16.0 * f64::EPSILON;

impl Mechanism {
    /// This machine with inertias, constant forces and force lines changed by a relative 16 ε, with alternating signs,
    /// so that exact balances are lost.
    pub(crate) fn nudged(&self) -> Self {
        let mut nudged = self.clone();
        for (number, body) in nudged.bodies.iter_mut().enumerate() {
            let up = if number % 2 == 0 { 1.0 + NUDGE } else { 1.0 - NUDGE };
            body.inertia *= up;
            body.force *= 1.0 + NUDGE;
        }
        for spring in &mut nudged.springs {
            if let SpringLaw::Line { line, .. } = &mut spring.law {
                *line = line.scaled(1.0 - NUDGE);
            }
        }
        nudged
    }
}

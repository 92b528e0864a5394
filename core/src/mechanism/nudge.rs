//! The same machine with numbers that are off by a few roundings: what shows how far a run depends on them.

use super::{Mechanism, SpringLaw};

/// Relative changes: what some tens of roundings do to a number.
const NUDGE: f64 = 16.0 * f64::EPSILON;

impl Mechanism {
    /// The same with inertias, constant forces and force lines that are off by 16 ε of themselves, neighbours in
    /// opposite directions, so that forces which balance do so no longer.
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

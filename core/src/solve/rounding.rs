//! Bound of the rounding error of a run of the exact solver.
//!
//! A step z ← z + P z is off by a few units in the last place of its parts, and P, made by doubling, by one such unit
//! for each radian of the fastest mode that it spans. Within a mode errors do not grow in the energy norm, since
//! friction, resistance and damping only remove energy. So after N steps and Φ radians speeds are off by at most about
//! c ε (N + Φ) of the largest, and positions, which are their integrals, by
//!
//! ```text
//! c ε (N + Φ) (v_max T + |x − x₀|_max) + 2 ε |x|_max
//! ```
//!
//! It does not include the effect of an error on a decision (whether a body sticks, which flank touches first): such a
//! decision is equally uncertain for parameters that differ in their last bit.

use super::PositionError;
use super::saved::{Pass, Passed};
use crate::mechanism::{Body, Layout, Mechanism};

/// c: units in the last place of one step. The largest value found by independent solutions of random machines is below
/// one.
const UNITS: f64 = 8.0;

/// Quantities of the run so far that the bound needs.
#[derive(Debug, Clone, Default)]
pub(super) struct Rounding {
    /// Indices of speeds and positions in the solver's state, with their factors at the belt.
    places: Vec<[(usize, f64); 2]>,
    /// Φ, rad, up to `since`.
    phase: f64,
    since: f64,
    /// Largest speed at the belt, m/s.
    speed: f64,
    /// Largest |x − x₀|, m.
    way: f64,
}

impl Rounding {
    /// The bound for a machine.
    pub(super) fn new(layout: &Layout, mechanism: &Mechanism) -> Self {
        let place = |(body, part): (usize, &Body)| {
            // An elongation is a length at the belt already.
            let lever = if layout.is_replaced(body) { 1.0 } else { part.kind.lever() };
            [(layout.speed[body], part.kind.lever()), (layout.coordinate[body], lever)]
        };
        let bodies = mechanism.bodies.iter().enumerate().filter(|(_, part)| !part.is_rotor);
        Self { places: bodies.map(place).collect(), ..Self::default() }
    }

    /// Updates the largest values by a state of the solver, or by the largest magnitudes of its elements.
    pub(super) fn see(&mut self, z: &[f64]) {
        for &[(speed, lever), (way, length)] in &self.places {
            self.speed = self.speed.max(lever * z[speed].abs());
            self.way = self.way.max(length * z[way].abs());
        }
    }

    /// Largest speed that a body can have had in a row so far, m/s or rad/s.
    pub(super) fn largest_speed(&self, body: &Body) -> f64 {
        self.speed / body.kind.lever()
    }

    /// As plain numbers.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        [&mut self.phase, &mut self.since, &mut self.speed, &mut self.way].into_iter().try_for_each(|n| pass.number(n))
    }

    /// The fastest mode had this frequency, rad/s, until `time`.
    pub(super) fn swing(&mut self, swing: f64, time: f64) {
        self.phase += swing * (time - self.since);
        self.since = time;
    }

    /// The bound after `steps` steps, for a machine in which errors have grown to at most `grown`, m.
    pub(super) fn bound(&self, steps: u64, time: f64, (origin, grown): (f64, f64)) -> PositionError {
        let units = UNITS * (steps as f64 + self.phase);
        let steady = f64::EPSILON * units * (self.speed * time + self.way);
        let value = steady.max(grown) + 2.0 * f64::EPSILON * (origin.abs() + self.way);
        PositionError { value: value.min(f64::MAX), way: self.way }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_position_far_from_the_origin_has_the_rounding_of_its_size() {
        let rest = Rounding::default();
        assert_eq!(rest.bound(1000, 1.0, (0.0, 0.0)).value, 0.0);
        assert_eq!(rest.bound(1000, 1.0, (-1e3, 0.0)).value, 2e3 * f64::EPSILON);
        // What has grown is added to that.
        assert_eq!(rest.bound(1000, 1.0, (1e3, 1e-9)).value, 1e-9 + 2e3 * f64::EPSILON);
    }
}

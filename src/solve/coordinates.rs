//! The coordinates of the solvers: stretches in the places of angles, and positions counted from where the run begins.
//!
//! A force of k (r φ₁ − x) computed from positions carries the rounding of those positions times k. With the stretches as states
//! it carries the rounding of the stretch, however far from the origin the axis is:
//!
//! ```text
//! s = (r φ₁ − x, φ̇₁, x − x₀, ẋ, x − r φ₃, φ̇₃, i, φ_r − φ₁, φ̇_r)
//! φ₁ = φ₁₀ + (x − x₀ + d₁ − d₁₀)/r        φ₃ = φ₃₀ + (x − x₀ − d₂ + d₂₀)/r
//! ```

use crate::friction::Motion;
use crate::plant::{Mode, Plant, State, place};

/// Places of the stretches in `s`: each takes the place of an angle.
const SPAN_1: usize = place::DRIVE_ANGLE;
const SPAN_2: usize = place::IDLER_ANGLE;
const TWIST: usize = place::ROTOR_ANGLE;

/// Parts of the last place by which positions at the start may contradict each other and still mean a belt without strain.
const LAST_PLACES: f64 = 4.0;

/// Where a run begins, and the angles of pulleys at rest.
#[derive(Debug, Clone)]
pub(crate) struct Coordinates {
    radius: f64,
    start: State,
    /// d₁ and d₂ at the start, m.
    strain: [f64; 2],
    /// Angles of the pulleys while they are stuck, rad: they keep every bit while the cart moves.
    held: [Option<f64>; 2],
}

impl Coordinates {
    /// Those of a run that begins in `start`, and `start` in them.
    pub(crate) fn new(plant: &Plant, start: &State) -> (Self, State) {
        let r = plant.stage().pulley_radius;
        let x = start[place::CART_POSITION];
        // One rounding; and angles that differ from x/r by the rounding of the numbers given mean no strain.
        let strain = |angle: f64, sign: f64| {
            let strain = sign * r.mul_add(angle, -x);
            let rounding = LAST_PLACES * f64::EPSILON * f64::max((r * angle).abs(), x.abs());
            if strain.abs() <= rounding { 0.0 } else { strain }
        };
        let strain = [strain(start[place::DRIVE_ANGLE], 1.0), strain(start[place::IDLER_ANGLE], -1.0)];
        let mut inner = *start;
        [inner[SPAN_1], inner[SPAN_2]] = strain;
        inner[place::CART_POSITION] = 0.0;
        inner[TWIST] = start[place::ROTOR_ANGLE] - start[place::DRIVE_ANGLE];
        (Self { radius: r, start: *start, strain, held: [None; 2] }, inner)
    }

    /// x₀, m.
    pub(crate) fn origin(&self) -> f64 {
        self.start[place::CART_POSITION]
    }

    /// The state in angles and positions.
    #[inline]
    pub(crate) fn state(&self, inner: &State) -> State {
        let way = inner[place::CART_POSITION];
        let angle = |index: usize, start: usize, change: f64| match self.held[index] {
            Some(angle) => angle,
            None => self.start[start] + (way + change) / self.radius,
        };
        let mut state = *inner;
        state[place::CART_POSITION] = self.origin() + way;
        state[place::DRIVE_ANGLE] = angle(0, place::DRIVE_ANGLE, inner[SPAN_1] - self.strain[0]);
        state[place::IDLER_ANGLE] = angle(1, place::IDLER_ANGLE, self.strain[1] - inner[SPAN_2]);
        state[place::ROTOR_ANGLE] = state[place::DRIVE_ANGLE] + inner[TWIST];
        state
    }

    /// Remembers the angles of pulleys that have come to rest in `mode`, and forgets those of pulleys that move.
    pub(crate) fn hold(&mut self, mode: &Mode, inner: &State) {
        let [drive, _, idler] = mode.motion.map(|motion| motion == Motion::Stuck);
        if drive != self.held[0].is_some() || idler != self.held[1].is_some() {
            let state = self.state(inner);
            let keep = |held: Option<f64>, stuck: bool, angle: f64| stuck.then_some(held.unwrap_or(angle));
            self.held = [
                keep(self.held[0], drive, state[place::DRIVE_ANGLE]),
                keep(self.held[1], idler, state[place::IDLER_ANGLE]),
            ];
        }
    }
}

/// The stretches r φ₁ − x, x − r φ₃, r φ₃ − r φ₁ (m), φ_r − φ₁ (rad), and x − x₀ (m), of a state in these coordinates.
#[inline]
pub(crate) fn stretches(inner: &State) -> [f64; crate::plant::STRETCHES] {
    let (d1, d2) = (inner[SPAN_1], inner[SPAN_2]);
    [d1, d2, -(d1 + d2), inner[TWIST], inner[place::CART_POSITION]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, TEMPLATE};

    fn plant() -> Plant {
        Plant::new(&Case::from_text("axis.toml", TEMPLATE).unwrap().stage)
    }

    #[test]
    fn a_start_that_differs_in_the_last_bit_is_no_strain() {
        let plant = plant();
        let r = plant.stage().pulley_radius;
        for x in [0.07, 1.0, 1000.0, -350.1] {
            let angle = f64::from_bits((x / r).to_bits() + 1);
            let (coordinates, inner) = Coordinates::new(&plant, &[angle, 0.0, x, 0.0, x / r, 0.0, 0.0, angle, 0.0]);
            assert_eq!((inner[SPAN_1], inner[SPAN_2]), (0.0, 0.0), "{x}");
            // The state is the one that was given, to the last bit.
            assert_eq!(coordinates.state(&inner)[..5], [angle, 0.0, x, 0.0, x / r]);
        }
    }

    #[test]
    fn a_strain_that_is_meant_is_kept_far_from_the_origin() {
        let plant = plant();
        let r = plant.stage().pulley_radius;
        let (x, d) = (1000.0, 1e-6);
        let (_, inner) = Coordinates::new(&plant, &[(x + d) / r, 0.0, x, 0.0, x / r, 0.0, 0.0, 0.0, 0.0]);
        assert!((inner[SPAN_1] - d).abs() < 1e-12 && inner[SPAN_2] == 0.0, "{inner:?}");
    }
}

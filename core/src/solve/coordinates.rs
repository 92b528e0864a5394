//! From the solvers' coordinates to angles and positions, with the origin of a run and the angles of stuck pulleys.
//!
//! ```text
//! q_b = q_b0 + (c_b − c_b0 − Σ a_j (q_j − q_j0))/a_b        c_b = Σ a_j q_j, the length in place of q_b
//! ```

use super::saved::{Pass, Passed};
use crate::friction::Motion;
use crate::mechanism::{BODIES, Layout, Mode, Replaced, State};

/// Units in the last place within which positions at the start count as a belt without strain.
const LAST_PLACES: f64 = 4.0;

/// Origin of a run: its start, and the angles of pulleys at rest.
#[derive(Debug, Clone)]
pub(crate) struct Coordinates {
    start: State,
    /// Coordinates of the origin.
    origin: [f64; BODIES],
    /// Elongations at the start, by the bodies whose positions they replace; without those by coordinates that do not
    /// begin at zero.
    strain: [f64; BODIES],
    /// Angles of pulleys while they are stuck, rad: they keep every bit while the rest moves.
    held: [Option<f64>; BODIES],
}

impl Coordinates {
    /// Coordinates of a run that begins in `start`, and `start` in these coordinates.
    pub(crate) fn new(layout: &Layout, start: &State) -> (Self, State) {
        let origin = layout.origin(start);
        let mut inner = *start;
        for (position, origin) in inner.position.iter_mut().zip(origin) {
            *position -= origin;
        }
        let mut strain = [0.0; BODIES];
        for replaced in &layout.replaced {
            // One rounding; and angles that differ from x/r by the rounding of the numbers given mean no strain.
            let own = start.position[replaced.body];
            let (mut others, mut size) = (0.0, (replaced.own * own).abs());
            for &(other, arm) in &replaced.others {
                others += arm * start.position[other];
                size = size.max((arm * start.position[other]).abs());
            }
            let length = replaced.own.mul_add(own, others);
            let length = if length.abs() <= LAST_PLACES * f64::EPSILON * size { 0.0 } else { length };
            let others = replaced.others.iter().filter(|_| !replaced.on_replaced);
            let begun: f64 = others.map(|&(other, arm)| arm * (start.position[other] - origin[other])).sum();
            (inner.position[replaced.body], strain[replaced.body]) = (length, length - begun);
        }
        (Self { start: *start, origin, strain, held: [None; BODIES] }, inner)
    }

    /// These coordinates with the angles of `state` and any lengths.
    pub(crate) fn at(&self, state: &State) -> Self {
        Self { held: state.position.map(Some), ..self.clone() }
    }

    /// As plain numbers.
    pub(super) fn pass(&mut self, pass: &mut Pass) -> Passed {
        pass.state(&mut self.start)?;
        pass.numbers(&mut self.origin)?;
        pass.numbers(&mut self.strain)?;
        self.held.iter_mut().try_for_each(|held| pass.optional(held))
    }

    /// The state in which it begins.
    pub(super) fn start(&self) -> &State {
        &self.start
    }

    /// Coordinates of the origin.
    pub(crate) fn origin(&self) -> &[f64; BODIES] {
        &self.origin
    }

    /// The state in angles and positions.
    #[inline]
    pub(crate) fn state(&self, layout: &Layout, inner: &State) -> State {
        let mut state = *inner;
        for (position, origin) in state.position.iter_mut().zip(&self.origin) {
            *position += origin;
        }
        for replaced in &layout.replaced {
            let body = replaced.body;
            let length = inner.position[body];
            state.position[body] = match self.held[body] {
                Some(angle) => angle,
                // A body on a pulley has the position of the pulley.
                None if replaced.on_replaced => {
                    let others: f64 = replaced.others.iter().map(|&(other, arm)| arm * state.position[other]).sum();
                    (length - others) / replaced.own
                }
                None => {
                    let mut change = length - self.strain[body];
                    for &(other, arm) in &replaced.others {
                        change -= arm * inner.position[other];
                    }
                    self.start.position[body] + change / replaced.own
                }
            };
        }
        state
    }

    /// Position of a body that is not held, as weights on the solvers' coordinates and a constant.
    pub(super) fn way(&self, layout: &Layout, body: usize) -> ([f64; BODIES], f64) {
        let mut weights = [0.0; BODIES];
        let Some(replaced) = layout.replaced.iter().find(|replaced| replaced.body == body) else {
            weights[body] = 1.0;
            return (weights, self.origin[body]);
        };
        weights[body] = 1.0 / replaced.own;
        if replaced.on_replaced {
            let mut constant = 0.0;
            for &(other, arm) in &replaced.others {
                let (theirs, at) = self.way(layout, other);
                weights.iter_mut().zip(theirs).for_each(|(own, their)| *own -= arm * their / replaced.own);
                constant -= arm * at / replaced.own;
            }
            return (weights, constant);
        }
        for &(other, arm) in &replaced.others {
            weights[other] -= arm / replaced.own;
        }
        (weights, self.start.position[body] - self.strain[body] / replaced.own)
    }

    /// Positions, row by row, of a body whose coordinate is an elongation: `own` has that elongation, `others` the
    /// coordinates of other bodies, and the positions of those that are known already.
    #[inline(always)]
    pub(crate) fn place<'v>(&self, replaced: &Replaced, own: &mut [f64], others: impl Fn(usize) -> &'v [f64]) {
        let body = replaced.body;
        if let Some(angle) = self.held[body] {
            own.fill(angle);
            return;
        }
        let begin = if replaced.on_replaced { 0.0 } else { self.strain[body] };
        let start = if replaced.on_replaced { 0.0 } else { self.start.position[body] };
        if let [(other, arm)] = replaced.others[..] {
            let ways = own.iter_mut().zip(others(other));
            ways.for_each(|(own, way)| *own = start + ((*own - begin) - arm * way) / replaced.own);
            return;
        }
        own.iter_mut().for_each(|length| *length -= begin);
        for &(other, arm) in &replaced.others {
            own.iter_mut().zip(others(other)).for_each(|(length, way)| *length -= arm * way);
        }
        own.iter_mut().for_each(|change| *change = start + *change / replaced.own);
    }

    /// Stores the angles of pulleys that have come to rest in `mode`, and drops those of moving pulleys.
    pub(crate) fn hold(&mut self, layout: &Layout, mode: &Mode, inner: &State) {
        let is_stuck = |body: usize| mode.motion[body] == Motion::Stuck;
        if layout.replaced.iter().any(|replaced| is_stuck(replaced.body) != self.held[replaced.body].is_some()) {
            let state = self.state(layout, inner);
            for replaced in &layout.replaced {
                let (body, held) = (replaced.body, self.held[replaced.body]);
                self.held[body] = is_stuck(body).then_some(held.unwrap_or(state.position[body]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::axis::{CART, DRIVE, IDLER};
    use crate::mechanism::testing::{body, spring};
    use crate::mechanism::{Body, Mechanism, MotionKind, Spring};

    /// Two pulleys and a cart on three spans, as the paper's axis.
    fn mechanism() -> (Mechanism, f64) {
        let r = 0.0194;
        let turns = MotionKind::Rotary { radius: r };
        let pulley = |number, inertia| Body { kind: turns, ..body(number, inertia) };
        let bodies = vec![pulley(DRIVE, 6.3e-5), body(CART, 0.362), pulley(IDLER, 3.3e-5)];
        let arms = [[(DRIVE, r), (CART, -1.0)], [(CART, 1.0), (IDLER, -r)], [(IDLER, r), (DRIVE, -r)]];
        (Mechanism::new(bodies, arms.map(|arms| spring(&arms, 1e5)).to_vec(), Vec::new()), r)
    }

    fn at(drive: f64, cart: f64, idler: f64) -> State {
        let mut state = State::default();
        state.position[..3].copy_from_slice(&[drive, cart, idler]);
        state
    }

    #[test]
    fn a_start_that_differs_in_the_last_bit_is_no_strain() {
        let (mechanism, r) = mechanism();
        let layout = Layout::new(&mechanism);
        for x in [0.07, 1.0, 1000.0, -350.1] {
            let angle = f64::from_bits((x / r).to_bits() + 1);
            let start = at(angle, x, x / r);
            let (coordinates, inner) = Coordinates::new(&layout, &start);
            assert_eq!((inner.position[DRIVE], inner.position[IDLER]), (0.0, 0.0), "{x}");
            // The state is the one that was given, to the last bit.
            assert_eq!(coordinates.state(&layout, &inner), start);
        }
    }

    /// Also of a rotor whose gear is a spring on a pulley whose own coordinate is a stretch.
    #[test]
    fn a_position_is_its_weights_on_the_coordinates() {
        let (base, r) = mechanism();
        let (mut bodies, mut springs) = (base.bodies.clone(), base.springs.clone());
        bodies.push(Body { leader: (3, 1.0), ..bodies[DRIVE].clone() });
        springs.push(Spring { arms: vec![(3, 5.0 * r), (DRIVE, -r)], ..springs[0].clone() });
        let mechanism = Mechanism::new(bodies, springs, Vec::new());
        let layout = Layout::new(&mechanism);
        let mut start = at(0.3 / r, 0.3, 0.3 / r);
        start.position[3] = 0.06 / r;
        let (coordinates, mut inner) = Coordinates::new(&layout, &start);
        for (k, own) in inner.position.iter_mut().enumerate().take(4) {
            *own += 1e-3 * (k as f64 + 1.0);
        }
        let state = coordinates.state(&layout, &inner);
        for body in 0..4 {
            let (weights, constant) = coordinates.way(&layout, body);
            let way = weights.iter().zip(&inner.position).map(|(weight, own)| weight * own).sum::<f64>() + constant;
            assert!((way - state.position[body]).abs() < 1e-12, "{body}: {way} for {}", state.position[body]);
        }
    }

    #[test]
    fn a_strain_that_is_meant_is_kept_far_from_the_origin() {
        let (mechanism, r) = mechanism();
        let layout = Layout::new(&mechanism);
        let (x, d) = (1000.0, 1e-6);
        let (_, inner) = Coordinates::new(&layout, &at((x + d) / r, x, x / r));
        assert!((inner.position[DRIVE] - d).abs() < 1e-12 && inner.position[IDLER] == 0.0, "{inner:?}");
        assert_eq!(inner.position[CART], 0.0);
    }
}

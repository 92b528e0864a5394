//! Events of the exact solver: values and rounding of guards, loads, and the equations of a mode for the transition
//! rules.

use super::matrices::GuardBuffers;
use super::{Core, ModeMatrices};
use crate::mechanism::{Mechanism, ROUNDING, StateQuantity, Transition};
use crate::solve::rules::{self, BEGUN, Between, Known, Load, MOMENT, Rules};
use std::sync::Arc;

impl<const N: usize> Between for Core<N> {
    fn rules(&self) -> &Rules {
        &self.common.rules
    }

    fn rules_mut(&mut self) -> &mut Rules {
        &mut self.common.rules
    }

    fn mechanism(&self) -> &Arc<Mechanism> {
        &self.common.mechanism
    }

    fn time(&self) -> f64 {
        Core::time(self)
    }

    fn instant(&self) -> f64 {
        MOMENT * self.matrices.reach()
    }

    fn conditions(&self) -> usize {
        self.matrices.guards.len()
    }

    fn transition(&self, index: usize) -> &Transition {
        &self.matrices.guards[index].transition
    }

    fn known(&self, index: usize) -> Known {
        let guard = &self.matrices.guards[index];
        Known { value: guard.value(&self.z), noise: self.noise_of(index) }
    }

    fn noise_of(&self, index: usize) -> f64 {
        self.matrices.guards[index].noise(&self.z)
    }

    fn known_at_begin(&self, index: usize) -> Known {
        let (law, guard) = (&self.matrices, &self.matrices.guards[index]);
        // The rounding of the path limits the time of the fall: for a force line with a point at zero, the value itself
        // does not show it.
        let on_the_way = ROUNDING * law.far() * guard.value(&law.rate(&self.z)).abs();
        let Known { value, noise } = self.known(index);
        Known { value, noise: noise.max(on_the_way) }
    }

    fn margin(&self, _: usize) -> f64 {
        0.0
    }

    fn look(&mut self) -> bool {
        let law = Arc::clone(&self.matrices);
        law.values(&self.z, &mut self.room.value);
        if self.room.value.iter().take(law.guards.len()).all(|&g| g > 0.0) {
            return false;
        }
        self.stand(&law);
        true
    }

    fn falls(&mut self, index: usize) -> bool {
        let (g, cause) = (self.room.value[index], self.matrices.guards[index].transition.cause);
        match g != 0.0 || self.common.rules.fresh_order(cause) > 0 {
            true => g < 0.0,
            // On the boundary: the first term of its series above rounding decides.
            false => self.falls_from_zero(index),
        }
    }

    fn load(&self, body: usize, forward: bool) -> Load {
        let side = self.common.mechanism.friction(body).side(forward);
        let sliding = if forward { side.coulomb } else { -side.coulomb };
        let load = |value, noise| Load { value, sliding, breakaway: side.breakaway, noise };
        if let Some(row) = self.matrices.load(body) {
            return load(row.value(&self.z), row.noise(&self.z));
        }
        let resting = self.common.mechanism.resting_mode(&self.common.rules.mode, |form| self.value(form));
        let form = self.common.mechanism.load(body, forward, &resting);
        load(self.value(&form), self.noise(&form))
    }

    fn dies_out(&mut self, body: usize) -> bool {
        self.common.rounding.see(&self.largest);
        let place = self.common.space.layout.speed[body];
        let slows = self.matrices.rate(&self.z)[place].abs();
        // Its own speed has the rounding of its earlier speeds.
        let mut sizes = self.z;
        sizes[place] = self.common.rounding.largest_speed(&self.common.mechanism.bodies[body]);
        slows <= BEGUN * self.matrices.noise_of_rate(&sizes)[place]
    }

    fn put(&mut self, place: StateQuantity, value: f64) {
        let layout = &self.common.space.layout;
        let place = match place {
            StateQuantity::Speed(body) => Some(layout.speed[body]),
            StateQuantity::Current(drive) => layout.current[drive],
        };
        place.iter().for_each(|place| self.z[*place] = value);
    }

    fn take_up_mode(&mut self) {
        self.carry_errors();
        self.common.rounding.swing(self.matrices.swing, Core::time(self));
        let (mechanism, space) = (&self.common.mechanism, &self.common.space);
        let (matrices, is_new) =
            ModeMatrices::from_known(&mut self.known, mechanism, space, &self.common.rules.mode, self.common.h);
        self.matrices = matrices;
        self.common.taken += 1;
        let inner = self.inner();
        self.common.coordinates.hold(&self.common.space.layout, &self.common.rules.mode, &inner);
        self.common.cost.modes += u64::from(is_new);
    }
}

impl<const N: usize> Core<N> {
    /// Enters the mode after a guard has become negative.
    pub(super) fn change(&mut self, fallen: Transition) {
        rules::change(self, fallen);
    }

    /// Changes modes at the present instant until every guard holds.
    pub(super) fn resolve(&mut self) {
        rules::settle(self);
    }

    /// True if a guard that is zero falls.
    fn falls_from_zero(&mut self, index: usize) -> bool {
        let law = &*self.matrices;
        let GuardBuffers { series, coefficients, .. } = &mut *self.room;
        law.series(&self.z, law.reach(), series);
        let guard = &law.guards[index];
        let coefficients = guard.row.along(series, coefficients);
        let first = law.first_term(guard, coefficients, (&self.z, law.reach()), 1);
        coefficients.get(first).is_some_and(|&term| term < 0.0)
    }

    /// Records bodies at rest whose load equals their breakaway within rounding, if sliding friction is lower;
    /// otherwise the decision makes no difference.
    pub(super) fn note_ties(&mut self) {
        if self.matrices.breakaways.is_empty() {
            return;
        }
        let law = Arc::clone(&self.matrices);
        for &(index, body) in &law.breakaways {
            if law.guards[index].is_zero(&self.z) {
                rules::note_tie(self, body);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::{Friction, Motion};
    use crate::mechanism::testing::body;
    use crate::mechanism::{Body, State, Status};
    use crate::solve::Event;
    use crate::solve::exact::Space;

    #[test]
    fn a_cart_that_friction_stops_does_not_stop_by_rounding() {
        for sign in [1.0, -1.0] {
            let cart = Body { friction: Friction::symmetric(2.0, 1.0), force: 0.4 * sign, ..body(0, 1.0) };
            let mechanism = Mechanism::new(vec![cart], Vec::new(), Vec::new());
            let mut start = State::default();
            start.speed[0] = 0.3 * sign;
            let space = Arc::new(Space::new(&mechanism, 0));
            let mut core = Core::<16>::new(Arc::new(mechanism), space, &start, (1e-3, f64::INFINITY), Vec::new());
            let mut events = Vec::new();
            core.go_on_to(1.0, &mut events).unwrap();
            assert_eq!(events.len(), 1, "{events:?}");
            let Event { time, to, load, by_rounding, .. } = events[0];
            // v̇ = −2 v − 0.6: v = 0 at ½ ln 2
            assert!((time - 0.5 * 2.0_f64.ln()).abs() < 1e-12 && !by_rounding, "{events:?}");
            assert_eq!(to, Status::Motion(Motion::Stuck));
            assert!((load - 0.4 * sign).abs() < 1e-12, "{load}");
        }
    }
}

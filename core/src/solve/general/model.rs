//! A machine made ready for the general solver: what its laws and its belt add to the linear equations of a mode.

use crate::friction::{Friction, Law, Motion};
use crate::mechanism::{
    BODIES, CURRENTS, DRIVES, Follows, Form, Layout, Mechanism, Mode, Phases, ROUNDING, Ridden, Riding, SPRINGS, State,
};
use crate::solve::record::Extra;
use std::sync::Arc;

/// Most quantities that are integrated: coordinates and speeds, currents, bristles.
pub(super) const MOST: usize = 3 * BODIES + CURRENTS;

/// The integrated quantities: coordinates and speeds in the order of [`Layout`], currents that are states, rotors, then
/// bristles.
pub(super) type Vector = [f64; MOST];

/// Largest number of guards: two for each body, one for each gear, two for each limit and for each spring.
pub(super) const MOST_GUARDS: usize = 2 * BODIES + 5 * DRIVES + 2 * SPRINGS;

/// A spring that follows the bodies.
pub(super) struct Following {
    pub(super) spring: usize,
    /// Its length from the integrated quantities: places and weights.
    pub(super) terms: Vec<(usize, f64)>,
    /// Lever arms of its force on the independent bodies.
    pub(super) arms: Vec<(usize, f64)>,
}

/// The phases of a stepper, with the places of all that they depend on.
pub(super) struct Phased {
    pub(super) drive: usize,
    pub(super) phases: Phases,
    /// The rotor's angle from the integrated quantities, places and weights, and where they are zero, rad.
    pub(super) terms: Vec<(usize, f64)>,
    pub(super) at: f64,
    /// Indices of the rotor's speed and the two currents.
    pub(super) speed: usize,
    pub(super) currents: [usize; 2],
    /// The body that the rotor moves with, and the ratio of their positions.
    pub(super) leader: usize,
    pub(super) ratio: f64,
    /// Commanded angle per unit of the input, rad/m.
    pub(super) per_input: f64,
}

impl Phased {
    /// The rotor's angle, rad.
    #[inline(always)]
    pub(super) fn angle(&self, y: &[f64]) -> f64 {
        self.terms.iter().fold(self.at, |sum, &(place, weight)| sum + weight * y[place])
    }

    /// The torque on the rotor, N m.
    pub(super) fn torque(&self, y: &[f64]) -> f64 {
        self.phases.torque(self.angle(y), self.currents.map(|place| y[place])).0
    }

    fn from_mechanism(
        mechanism: &Mechanism,
        layout: &Layout,
        (place, current): (&[usize; BODIES], &[Option<usize>]),
    ) -> Vec<Self> {
        let phased = |(drive, part): (usize, &crate::mechanism::Drive)| {
            let phases = Phases::new(part)?;
            let (spring, at) = mechanism.angle_of(drive)?;
            let first = mechanism.first_current(drive);
            Some(Self {
                drive,
                phases,
                terms: layout.weights(spring).map(|(body, weight)| (place[body], weight)).collect(),
                at,
                speed: place[part.shaft] + 1,
                currents: [current[first]?, current[first + 1]?],
                leader: mechanism.leader(part.shaft),
                ratio: mechanism.ratio(part.shaft),
                per_input: mechanism.angle_per_input(drive),
            })
        };
        mechanism.drives.iter().enumerate().filter_map(phased).collect()
    }
}

/// A body whose own friction is not that of the linear equations, be it moved by another or not.
pub(super) struct Curved {
    pub(super) body: usize,
    /// The body that it moves with, and the ratio of their positions.
    pub(super) leader: usize,
    pub(super) ratio: f64,
    pub(super) friction: Friction,
    /// Indices of its speed, and of the deflection of its bristles, if any.
    pub(super) speed: usize,
    pub(super) bristle: Option<usize>,
}

/// A law at one speed in one motion: the friction beyond that of the linear equations, how it changes with the speed,
/// and what it does to bristles.
#[derive(Clone, Copy, Default)]
pub(super) struct Sliding {
    /// Beyond what is in the linear equations; of bristles, without what they carry.
    pub(super) beyond: f64,
    /// Its derivative by the speed, and by the factor along the travel.
    pub(super) slope: f64,
    pub(super) by_factor: f64,
    /// σ₀ |v|/g(v), 1/s, and its derivative by the speed.
    pub(super) slip: f64,
    pub(super) slip_slope: f64,
}

impl Curved {
    /// Direction of motion of a body whose law can hold it at rest.
    #[inline(always)]
    pub(super) fn direction(&self, motion: Motion) -> Option<bool> {
        match (self.friction.law, motion) {
            (Law::Coulomb | Law::Stribeck { .. }, Motion::Forward) => Some(true),
            (Law::Coulomb | Law::Stribeck { .. }, Motion::Backward) => Some(false),
            (Law::Coulomb | Law::Stribeck { .. } | Law::Smooth { .. } | Law::LuGre { .. }, _) => None,
        }
    }

    /// The friction of such a law beyond b v ± F_c.
    #[inline(always)]
    pub(super) fn beyond_coulomb<const N: usize>(&self, forward: bool, v: [f64; N]) -> [f64; N] {
        let (sign, coulomb) = (if forward { 1.0 } else { -1.0 }, self.friction.side(forward).coulomb);
        let mut along = v;
        along.iter_mut().for_each(|v| *v *= sign);
        let mut beyond = self.friction.dry_at(forward, along);
        beyond.iter_mut().for_each(|dry| *dry = sign * (*dry - coulomb));
        beyond
    }

    /// Bristles that are the same in both directions, at several speeds side by side: σ₀ |v|/g(v).
    #[inline(always)]
    pub(super) fn bristles<const N: usize>(&self, v: [f64; N]) -> [Sliding; N] {
        let Law::LuGre { stiffness, .. } = self.friction.law else { return [Sliding::default(); N] };
        let speed = v.map(f64::abs);
        let dry = self.friction.dry_at(true, speed);
        std::array::from_fn(|i| Sliding { slip: stiffness * speed[i] / dry[i], ..Sliding::default() })
    }

    /// ż = v − σ₀ |v| z / g(v) of the bristles at this place of the integrated quantities.
    #[inline(always)]
    fn bristle_rate(&self, sliding: &Sliding, place: usize, y: &[f64]) -> f64 {
        y[self.speed] - sliding.slip * y[place]
    }

    /// The law at `v`, with dry friction multiplied by `factor`. The speed is positive in the direction of motion; if a
    /// trial step overshoots, the law continues smoothly.
    #[inline(always)]
    pub(super) fn sliding(&self, motion: Motion, v: f64, factor: f64, slopes: bool) -> Sliding {
        let friction = &self.friction;
        let (forward, speed) = match motion {
            // Held, neither body nor bristles move.
            Motion::Stuck => return Sliding::default(),
            Motion::Forward => (true, v),
            Motion::Backward => (false, -v),
            Motion::Free => (v >= 0.0, v.abs()),
        };
        let sign = if forward { 1.0 } else { -1.0 };
        let side = friction.side(forward);
        // In the equations there is b v of this direction; of a body that is free, b v of the forward one.
        let viscous = match motion {
            Motion::Free => side.viscous - friction.forward.viscous,
            Motion::Forward | Motion::Backward | Motion::Stuck => 0.0,
        };
        let steeper = || friction.slope(v) - side.viscous;
        match friction.law {
            // Nothing but b v.
            Law::Coulomb | Law::Stribeck { .. } if motion == Motion::Free => Sliding::default(),
            // In the equations there is ± F_c, too.
            Law::Coulomb | Law::Stribeck { .. } => {
                let dry = friction.dry(forward, speed);
                let slope = if slopes { factor * steeper() } else { 0.0 };
                let beyond = sign * (factor * dry - side.coulomb);
                Sliding { beyond, slope, by_factor: sign * dry, ..Sliding::default() }
            }
            Law::Smooth { .. } => {
                let dry = friction.dry(forward, speed);
                let slope = if slopes { factor * steeper() + viscous } else { 0.0 };
                let beyond = sign * (factor * dry) + viscous * v;
                Sliding { beyond, slope, by_factor: sign * dry, ..Sliding::default() }
            }
            Law::LuGre { stiffness, .. } => {
                let dry = factor * friction.dry(forward, speed);
                let slip = stiffness * speed / dry;
                let slip_slope = if slopes { sign * (stiffness - slip * factor * steeper()) / dry } else { 0.0 };
                Sliding { beyond: viscous * v, slope: viscous, by_factor: 0.0, slip, slip_slope }
            }
        }
    }
}

/// A machine made ready for the integrator.
pub(super) struct Model {
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) layout: Layout,
    /// Index of each body's coordinate; its speed follows.
    place: [usize; BODIES],
    /// Indices of the currents that are states.
    pub(super) current: [Option<usize>; CURRENTS],
    /// Index of a body's bristle deflection, if any.
    pub(super) bristle: [Option<usize>; BODIES],
    /// True if anything is added to the linear equations at all.
    pub(super) adds: bool,
    pub(super) curved: Vec<Curved>,
    pub(super) following: Vec<Following>,
    pub(super) phased: Vec<Phased>,
}

impl Model {
    /// Model of a mechanism whose coordinates begin at zero.
    pub(super) fn new(mechanism: Arc<Mechanism>, layout: Layout) -> Self {
        let mut size = 0;
        let mut room = |count: usize| {
            size += count;
            size - count
        };
        let (mut place, mut current, mut bristle) = ([0; BODIES], [None; CURRENTS], [None; BODIES]);
        let held = mechanism.held_bodies();
        held.clone().for_each(|body| place[body] = room(2));
        for (number, place) in current.iter_mut().enumerate() {
            *place = mechanism.drive_of_current(number).map(|_| room(1));
        }
        (held.end..mechanism.bodies.len()).for_each(|body| place[body] = room(2));
        for (body, place) in bristle.iter_mut().enumerate().take(mechanism.bodies.len()) {
            *place = matches!(mechanism.bodies[body].friction.law, Law::LuGre { .. }).then(|| room(1));
        }
        let adds = !mechanism.is_piecewise_linear();
        let is_curved = |&b: &usize| {
            let part = &mechanism.bodies[b];
            !part.friction.is_piecewise_linear() || part.along.is_some()
        };
        let curved = (0..mechanism.bodies.len()).filter(is_curved).map(|body| {
            let part = &mechanism.bodies[body];
            let (leader, ratio) = part.leader;
            Curved { body, leader, ratio, friction: part.friction, speed: place[body] + 1, bristle: bristle[body] }
        });
        let curved = curved.collect();
        let follows = |&spring: &usize| mechanism.springs[spring].follows.is_some();
        let following = (0..mechanism.springs.len()).filter(follows).map(|spring| {
            let arms = mechanism.leading_arms(spring).into_iter().enumerate();
            Following {
                spring,
                terms: layout.weights(spring).map(|(body, weight)| (place[body], weight)).collect(),
                arms: arms.filter(|(_, arm)| *arm != 0.0).collect(),
            }
        });
        let following = following.collect();
        let phased = Phased::from_mechanism(&mechanism, &layout, (&place, &current));
        Self { mechanism, layout, place, current, bristle, adds, curved, following, phased }
    }

    /// Coefficients of the integrated quantities in a form.
    pub(super) fn row(&self, form: &Form) -> Vector {
        let mut row = [0.0; MOST];
        let on = self.layout.on_coordinates(form);
        for body in 0..self.mechanism.bodies.len() {
            (row[self.coordinate(body)], row[self.speed(body)]) = (on.position[body], on.speed[body]);
        }
        for (place, current) in self.current.iter().zip(on.current) {
            if let Some(place) = place {
                row[*place] = current;
            }
        }
        row
    }

    /// Place of a body's coordinate.
    pub(super) fn coordinate(&self, body: usize) -> usize {
        self.place[body]
    }

    /// Place of a body's speed.
    pub(super) fn speed(&self, body: usize) -> usize {
        self.place[body] + 1
    }

    /// The integrated quantities of a state in the solver's coordinates.
    pub(super) fn vector(&self, inner: &State) -> Vector {
        let mut y = [0.0; MOST];
        for body in 0..self.mechanism.bodies.len() {
            (y[self.coordinate(body)], y[self.speed(body)]) = (inner.position[body], inner.speed[body]);
        }
        for (place, current) in self.current.iter().zip(inner.current) {
            if let Some(place) = place {
                y[*place] = current;
            }
        }
        y
    }

    /// The state in the solver's coordinates.
    #[inline]
    pub(super) fn inner(&self, y: &[f64]) -> State {
        let mut inner = State::default();
        for body in 0..self.mechanism.bodies.len() {
            (inner.position[body], inner.speed[body]) = (y[self.coordinate(body)], y[self.speed(body)]);
        }
        for (current, place) in inner.current.iter_mut().zip(self.current) {
            *current = place.map_or(0.0, |place| y[place]);
        }
        inner
    }

    /// The value of a linear form.
    #[inline]
    pub(super) fn value(&self, form: &Form, inner: &State, input: &[f64; DRIVES]) -> f64 {
        self.layout.value(form, inner, input)
    }

    /// Factor on a body's dry friction at its position.
    #[inline(always)]
    fn factor(&self, body: usize, y: &[f64]) -> f64 {
        self.factor_at(body, || y[self.coordinate(body)])
    }

    /// Friction factor at a coordinate that is evaluated only if needed.
    #[inline(always)]
    pub(super) fn factor_at(&self, body: usize, coordinate: impl FnOnce() -> f64) -> f64 {
        match &self.mechanism.bodies[body].along {
            Some(along) => along.value(self.mechanism.origin[body] + coordinate()),
            None => 1.0,
        }
    }

    /// The force of a spring beyond k s + c ṡ with the stiffness at the origin, taut or not: (k(q) − k) s.
    #[inline]
    pub(super) fn beyond(&self, following: &Following, y: &[f64]) -> f64 {
        let length: f64 = following.terms.iter().map(|&(place, weight)| weight * y[place]).sum();
        self.stiffer(following.spring, |body| y[self.coordinate(body)]) * length
    }

    /// Stiffness of a spring relative to the origin: k(q) − k.
    #[inline(always)]
    pub(super) fn stiffer(&self, spring: usize, coordinate: impl Fn(usize) -> f64) -> f64 {
        let spring = &self.mechanism.springs[spring];
        let stiffness = |follows: &Follows| follows.stiffness(|body| self.mechanism.origin[body] + coordinate(body));
        spring.follows.as_ref().map_or(0.0, |follows| stiffness(follows) - spring.stiffness)
    }

    /// Loads on the independent bodies by the springs that follow, −Aᵀ f, zero for slack ones, and by the phases of
    /// steppers.
    #[inline(always)]
    fn loads(&self, mode: &Mode, y: &[f64]) -> [f64; BODIES] {
        let mut loads = [0.0; BODIES];
        for following in self.following.iter().filter(|following| !mode.slack[following.spring]) {
            let force = self.beyond(following, y);
            following.arms.iter().for_each(|&(body, arm)| loads[body] -= arm * force);
        }
        self.phased.iter().for_each(|phased| loads[phased.leader] += phased.ratio * phased.torque(y));
        loads
    }

    /// All forces on a body but its friction, for a body that goes, or is about to go, forward or backward.
    pub(super) fn load(&self, body: usize, forward: bool, mode: &Mode, y: &[f64], input: &[f64; DRIVES]) -> f64 {
        let inner = self.inner(y);
        let resting = self.mechanism.resting_mode(mode, |form| self.value(form, &inner, input));
        let own = self.value(&self.mechanism.load(body, forward, &resting), &inner, input) + self.loads(mode, y)[body];
        own - self.ridden_at_rest(body, mode, y)
    }

    /// Reduction of the load on a body at rest by a ride.
    fn ridden_at_rest(&self, body: usize, mode: &Mode, y: &[f64]) -> f64 {
        let mut resting = *mode;
        self.mechanism.followers(body).for_each(|body| resting.motion[body] = Motion::Stuck);
        self.ridden(&resting, y)[body]
    }

    /// Reduction of the forces on its bodies by a ride in this mode, N or N m.
    fn ridden(&self, mode: &Mode, y: &[f64]) -> [f64; BODIES] {
        let mut ridden = [0.0; BODIES];
        let mechanism = &*self.mechanism;
        let Some(ride) = mechanism.ride else { return ridden };
        let (equations, inner) = (mechanism.equations(*mode), self.inner(y));
        let (loads, friction) = (self.loads(mode, y), self.friction_of_laws(mode, y));
        let moves = |body: usize| mode.motion[body] != Motion::Stuck;
        // No input is on these bodies.
        let free = |body: usize| match moves(body) {
            true => {
                let beyond = (loads[body] - friction[body]) / mechanism.mass(body, &equations.inertia);
                self.value(&equations.acceleration[body], &inner, &[0.0; DRIVES]) + beyond
            }
            false => 0.0,
        };
        let place = |body: usize| mechanism.origin[body] + inner.position[body];
        let at = Riding {
            cart: place(ride.cart),
            cart_speed: inner.speed[ride.cart],
            yaw: place(ride.yaw),
            yaw_speed: inner.speed[ride.yaw],
            bridge_free: free(ride.bridge),
            cart_free: free(ride.cart),
            yaw_free: free(ride.yaw),
        };
        let law = ride.law(mechanism, moves(ride.bridge), moves(ride.cart));
        Ridden::ALL.into_iter().for_each(|on| ridden[ride.body(on)] = law.force(on, &at));
        ridden
    }

    /// Its rounding error.
    pub(super) fn noise(&self, body: usize, mode: &Mode, y: &[f64], input: &[f64; DRIVES]) -> f64 {
        let own = self.mechanism.load(body, true, mode).noise(&self.layout, &self.inner(y), input);
        own + ROUNDING * self.ridden_at_rest(body, mode, y).abs()
    }

    /// Breakaway in this direction of a body at rest and all bodies joined to it, at its position: Σ ρ a(x) F_b.
    #[inline]
    pub(super) fn breakaway(&self, leader: usize, forward: bool, y: &[f64]) -> f64 {
        let own = |body: usize| {
            let part = &self.mechanism.bodies[body];
            self.mechanism.ratio(body) * (self.factor(body, y) * part.friction.breakaway(forward))
        };
        self.mechanism.followers(leader).map(own).sum()
    }

    /// The force of bent bristles on a body at rest, and on all that moves with it: Σ ρ σ₀ z.
    #[inline]
    pub(super) fn bristle_force(&self, leader: usize, y: &[f64]) -> f64 {
        let of = |curved: &Curved| match (curved.friction.law, curved.bristle) {
            (Law::LuGre { stiffness, .. }, Some(place)) => curved.ratio * (stiffness * y[place]),
            _ => 0.0,
        };
        self.curved.iter().filter(|curved| curved.leader == leader).map(of).sum()
    }

    /// Friction beyond b v ± F_c on each body that moves by itself, of all that moves with it.
    fn friction_of_laws(&self, mode: &Mode, y: &[f64]) -> [f64; BODIES] {
        let mut friction = [0.0; BODIES];
        for curved in &self.curved {
            // Power is conserved: F = ρ τ
            friction[curved.leader] += curved.ratio * self.beyond_straight(curved, mode.motion[curved.body], y);
        }
        friction
    }

    /// The same, and what friction holds of forces that are not in the linear equations while a body rests.
    fn friction(&self, mode: &Mode, y: &[f64]) -> [f64; BODIES] {
        let mut friction = self.friction_of_laws(mode, y);
        if let Some(ride) = self.mechanism.ride {
            let resting = [ride.bridge, ride.cart].into_iter().filter(|body| mode.motion[*body] == Motion::Stuck);
            resting.for_each(|body| friction[body] -= self.ridden(mode, y)[body]);
        }
        // A body at rest holds what the phases of a stepper put on it.
        for phased in self.phased.iter().filter(|phased| mode.motion[phased.leader] == Motion::Stuck) {
            friction[phased.leader] += phased.ratio * phased.torque(y);
        }
        friction
    }

    /// The difference of a body's own friction from that of the linear equations.
    #[inline(always)]
    pub(super) fn beyond_straight(&self, curved: &Curved, motion: Motion, y: &[f64]) -> f64 {
        if let (None, Some(forward)) = (&self.mechanism.bodies[curved.body].along, curved.direction(motion)) {
            return curved.beyond_coulomb(forward, [y[curved.speed]])[0];
        }
        let sliding = curved.sliding(motion, y[curved.speed], self.factor(curved.body, y), false);
        match (curved.friction.law, curved.bristle) {
            (Law::LuGre { stiffness, damping, .. }, Some(place)) if motion != Motion::Stuck => {
                // σ₀ z + σ₁ ż
                sliding.beyond + stiffness * y[place] + damping * curved.bristle_rate(&sliding, place, y)
            }
            _ => sliding.beyond,
        }
    }

    /// Rate of deflection of a body's bristles, rad/s or m/s; zero if the body is held or has none.
    pub(super) fn bristle_rate(&self, body: usize, mode: &Mode, y: &[f64]) -> f64 {
        let motion = mode.motion[body];
        let curved = self.curved.iter().find(|curved| curved.body == body && motion != Motion::Stuck);
        let Some((curved, place)) = curved.and_then(|curved| Some((curved, curved.bristle?))) else { return 0.0 };
        let sliding = curved.sliding(motion, y[curved.speed], self.factor(body, y), false);
        curved.bristle_rate(&sliding, place, y)
    }

    /// Extra values as a row shows them.
    pub(super) fn extra(&self, mode: &Mode, y: &[f64]) -> Extra {
        let mut extra = Extra::default();
        if self.adds {
            extra.friction = self.friction(mode, y);
            for following in self.following.iter().filter(|following| !mode.slack[following.spring]) {
                extra.force[following.spring] = self.beyond(following, y);
            }
            for (bristle, place) in extra.bristle.iter_mut().zip(self.bristle) {
                *bristle = place.map_or(0.0, |place| y[place]);
            }
        }
        extra
    }
}

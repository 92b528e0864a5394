//! The equations as the integrator sees them: the linear ones of a mode, and what a law or a belt adds to them.

use super::stretch::Stretch;
use crate::friction::{Friction, Law, Motion};
use crate::mechanism::{
    BODIES, Cause, DRIVES, Equations, Form, Layout, Mechanism, Mode, ROUNDING, SPRINGS, State, Switch,
};
use crate::solve::record::Extra;
use ivp::prelude::FirstOrderSystem;
use std::cell::Cell;
use std::sync::Arc;

/// Most quantities that are integrated: coordinates and speeds, currents, bristles.
pub(super) const MOST: usize = 3 * BODIES + DRIVES;

/// The integrated quantities: coordinates and speeds in the order of [`Layout`], currents that are states, rotors, then
/// bristles.
pub(super) type Vector = [f64; MOST];

/// Most conditions watched at once: two for each body, one for each gear, two for each limit and for each spring.
pub(super) const MOST_GUARDS: usize = 2 * BODIES + 5 * DRIVES + 2 * SPRINGS;

/// A spring that follows the bodies.
struct Following {
    spring: usize,
    /// Its length from the integrated quantities: places and weights.
    terms: Vec<(usize, f64)>,
    /// By how much its force acts on each body that moves by itself.
    arms: Vec<(usize, f64)>,
}

/// A body whose own friction is not that of the linear equations, be it moved by another or not.
struct Curved {
    body: usize,
    /// The body that it moves with, and its way per way of that one.
    leader: usize,
    ratio: f64,
    friction: Friction,
    /// Where its speed stands, and the deflection of its bristles, if it has them.
    speed: usize,
    bristle: Option<usize>,
}

/// A machine made ready for the integrator.
pub(super) struct Model {
    pub(super) mechanism: Arc<Mechanism>,
    pub(super) layout: Layout,
    /// Where each body's coordinate stands; its speed behind it.
    place: [usize; BODIES],
    /// Where the currents stand that are states.
    pub(super) current: [Option<usize>; DRIVES],
    /// Number of integrated quantities.
    pub(super) size: usize,
    /// Where a body's bristle deflection stands, if it has one.
    pub(super) bristle: [Option<usize>; BODIES],
    /// Whether anything is added to the linear equations at all.
    pub(super) adds: bool,
    curved: Vec<Curved>,
    following: Vec<Following>,
}

/// The additions to the linear equations.
#[derive(Clone, Copy, Default)]
struct Added {
    /// Forces and torques on each body that moves by itself: of springs that follow, and, to be taken off, friction
    /// beyond b v ± F_c of all that moves with it.
    load: [f64; BODIES],
    friction: [f64; BODIES],
    /// Rates of the bristles.
    bristle: [f64; BODIES],
}

impl Model {
    /// That of a mechanism whose ways are counted from where the run begins.
    pub(super) fn new(mechanism: Arc<Mechanism>, layout: Layout) -> Self {
        let mut size = 0;
        let mut room = |count: usize| {
            size += count;
            size - count
        };
        let (mut place, mut current, mut bristle) = ([0; BODIES], [None; DRIVES], [None; BODIES]);
        let held = mechanism.held_bodies();
        held.clone().for_each(|body| place[body] = room(2));
        for (index, drive) in mechanism.drives.iter().enumerate() {
            current[index] = drive.has_current_state().then(|| room(1));
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
        Self { mechanism, layout, place, current, size, bristle, adds, curved, following }
    }

    /// Coefficients of the integrated quantities in a form that are not zero.
    fn terms(&self, form: &Form) -> impl Iterator<Item = (usize, f64)> + use<> {
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
        row.into_iter().enumerate().filter(|(_, coefficient)| *coefficient != 0.0)
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

    /// By how much a body's dry friction is multiplied where it is.
    #[inline(always)]
    fn factor(&self, body: usize, y: &[f64]) -> f64 {
        match &self.mechanism.bodies[body].along {
            Some(along) => along.factor(self.mechanism.origin[body] + y[self.coordinate(body)]),
            None => 1.0,
        }
    }

    /// The force of a spring beyond k s + c ṡ with the stiffness at the origin, taut or not: (k(q) − k) s.
    #[inline]
    fn beyond(&self, following: &Following, y: &[f64]) -> f64 {
        let spring = &self.mechanism.springs[following.spring];
        let Some(follows) = &spring.follows else { return 0.0 };
        let stiffness = follows.stiffness(|body| self.mechanism.origin[body] + y[self.coordinate(body)]);
        let length: f64 = following.terms.iter().map(|&(place, weight)| weight * y[place]).sum();
        (stiffness - spring.stiffness) * length
    }

    /// The loads of the springs that follow on each body that moves by itself, −Aᵀ f; a slack one has none.
    #[inline(always)]
    fn loads(&self, mode: &Mode, y: &[f64]) -> [f64; BODIES] {
        let mut loads = [0.0; BODIES];
        for following in self.following.iter().filter(|following| !mode.slack[following.spring]) {
            let force = self.beyond(following, y);
            following.arms.iter().for_each(|&(body, arm)| loads[body] -= arm * force);
        }
        loads
    }

    /// All forces on a body but its friction, for a body that goes, or is about to go, forward or backward.
    pub(super) fn load(&self, body: usize, forward: bool, mode: &Mode, y: &[f64], input: &[f64; DRIVES]) -> f64 {
        let inner = self.inner(y);
        let mut settled = *mode;
        for (drive, _) in self.mechanism.drives.iter().enumerate().filter(|(_, drive)| drive.loses()) {
            let torque = self.mechanism.torque_at_rest(drive, mode);
            settled.drive[drive].torque_positive = self.value(&torque, &inner, input) >= 0.0;
        }
        self.value(&self.mechanism.load(body, forward, &settled), &inner, input) + self.loads(mode, y)[body]
    }

    /// Its rounding error.
    pub(super) fn noise(&self, body: usize, mode: &Mode, y: &[f64], input: &[f64; DRIVES]) -> f64 {
        self.mechanism.load(body, true, mode).noise(&self.layout, &self.inner(y), input)
    }

    /// The breakaway of a body at rest this way, where it is, with all that moves with it: Σ ρ a(x) F_b.
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

    /// The additions of the laws and the belt to the linear equations, and how the bristles move.
    #[inline(always)]
    fn added(&self, mode: &Mode, y: &[f64]) -> Added {
        let mut added = Added { load: self.loads(mode, y), ..Added::default() };
        for curved in &self.curved {
            let (friction, bristle) = self.beyond_straight(curved, mode.motion[curved.body], y);
            // Power is conserved: F = ρ τ
            added.friction[curved.leader] += curved.ratio * friction;
            added.bristle[curved.body] = bristle;
        }
        added
    }

    /// The difference of a body's own friction from that of the linear equations, and how fast its bristles bend.
    #[inline(always)]
    fn beyond_straight(&self, curved: &Curved, motion: Motion, y: &[f64]) -> (f64, f64) {
        let (body, friction, v) = (curved.body, &curved.friction, y[curved.speed]);
        // The speed counted in the direction of motion: where a trial step overshoots, the law goes on smoothly.
        let (forward, speed) = match motion {
            // Held, neither body nor bristles move.
            Motion::Stuck => return (0.0, 0.0),
            Motion::Forward => (true, v),
            Motion::Backward => (false, -v),
            Motion::Free => (v >= 0.0, v.abs()),
        };
        let sign = if forward { 1.0 } else { -1.0 };
        let side = friction.side(forward);
        // In the equations there is b v of this direction; of a body that is free, b v of the forward one.
        let viscous = match motion {
            Motion::Free => (side.viscous - friction.forward.viscous) * v,
            Motion::Forward | Motion::Backward | Motion::Stuck => 0.0,
        };
        match friction.law {
            // Nothing but b v.
            Law::Coulomb | Law::Stribeck { .. } if motion == Motion::Free => (0.0, 0.0),
            // In the equations there is ± F_c, too.
            Law::Coulomb | Law::Stribeck { .. } => {
                (sign * (self.factor(body, y) * friction.dry(forward, speed) - side.coulomb), 0.0)
            }
            Law::Smooth { .. } => (sign * (self.factor(body, y) * friction.dry(forward, speed)) + viscous, 0.0),
            Law::LuGre { stiffness, damping, .. } => {
                let dry = self.factor(body, y) * friction.dry(forward, speed);
                let z = curved.bristle.map_or(0.0, |place| y[place]);
                // ż = v − σ₀ |v| z / g(v)
                let rate = v - stiffness * speed * z / dry;
                // σ₀ z + σ₁ ż
                (stiffness * z + damping * rate + viscous, rate)
            }
        }
    }

    /// The same as a row shows it.
    pub(super) fn extra(&self, mode: &Mode, y: &[f64]) -> Extra {
        let mut extra = Extra::default();
        if self.adds {
            extra.friction = self.added(mode, y).friction;
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

/// Linear forms of the integrated quantities and the inputs, without what counts for nothing in them.
#[derive(Default)]
struct Rows {
    terms: Vec<(usize, f64)>,
    /// Where the terms of each end; its constant part, and its coefficients of the inputs.
    rows: Vec<(usize, f64, [f64; DRIVES])>,
}

impl Rows {
    fn push(&mut self, model: &Model, form: &Form) {
        self.terms.extend(model.terms(form));
        self.rows.push((self.terms.len(), form.constant, form.input));
    }

    /// Their values.
    #[inline(always)]
    fn values<'r>(&'r self, y: &'r [f64], input: &'r [f64; DRIVES]) -> impl Iterator<Item = f64> + 'r {
        let mut begin = 0;
        self.rows.iter().map(move |&(end, constant, on_input)| {
            let terms = &self.terms[begin..end];
            begin = end;
            let sum = terms.iter().fold(0.0, |sum, &(place, coefficient)| sum + coefficient * y[place]);
            on_input.iter().zip(input).fold(sum + constant, |sum, (coefficient, input)| sum + coefficient * input)
        })
    }
}

/// A speed that changes: where it stands, the body that leads, its way per way of that one, and what moves with both.
struct Moving {
    place: usize,
    leader: usize,
    ratio: f64,
    mass: f64,
}

/// The equations of one mode under one stretch of the inputs: ẏ = f(τ, y), τ counted from the beginning of the stretch.
pub(super) struct Field<'a> {
    model: &'a Model,
    mode: Mode,
    equations: Equations,
    /// Rates of the quantities that move, by the linear equations, and where these stand.
    rates: Rows,
    places: Vec<usize>,
    /// The conditions, by the linear equations.
    guards: Rows,
    /// Inertia that moves with each body, per unit of its leader's way.
    mass: [f64; BODIES],
    /// Bodies that are not held.
    moving: Vec<Moving>,
    pub(super) stretch: &'a Stretch,
    evaluations: Cell<u64>,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a Model, mode: &Mode, stretch: &'a Stretch) -> Self {
        let mechanism = &*model.mechanism;
        let equations = mechanism.equations(*mode);
        let (mut mass, mut rates, mut places) = ([1.0; BODIES], Rows::default(), Vec::with_capacity(model.size));
        let mut add = |place: usize, rate: &Form| {
            rates.push(model, rate);
            places.push(place);
        };
        for (body, mass) in mass.iter_mut().enumerate().take(mechanism.bodies.len()) {
            *mass = mechanism.mass(mechanism.leader(body), &equations.inertia);
            if mode.motion[body] != Motion::Stuck {
                add(model.speed(body), &equations.acceleration[body]);
            }
            let mut way = model.layout.rate(mechanism, body);
            for (speed, motion) in way.speed.iter_mut().zip(mode.motion) {
                if motion == Motion::Stuck {
                    *speed = 0.0;
                }
            }
            add(model.coordinate(body), &way);
        }
        for (place, rate) in model.current.iter().zip(&equations.current_rate) {
            place.iter().for_each(|&place| add(place, rate));
        }
        let mut guards = Rows::default();
        equations.guards.iter().for_each(|guard| guards.push(model, &guard.form));
        let moves = |&body: &usize| mode.motion[body] != Motion::Stuck;
        let moving = (0..mechanism.bodies.len()).filter(moves).map(|body| {
            let (leader, ratio) = mechanism.bodies[body].leader;
            Moving { place: model.speed(body), leader, ratio, mass: mass[body] }
        });
        let (moving, evaluations) = (moving.collect(), Cell::new(0));
        Self { model, mode: *mode, equations, rates, places, guards, mass, moving, stretch, evaluations }
    }

    pub(super) fn evaluations(&self) -> u64 {
        self.evaluations.get()
    }

    /// The inputs at τ.
    pub(super) fn input(&self, tau: f64) -> [f64; DRIVES] {
        self.stretch.input(tau)
    }

    /// The guards that are watched.
    pub(super) fn watches(&self) -> Vec<Cause> {
        self.equations.guards.iter().map(|guard| guard.cause).collect()
    }

    /// The size of the parts of a guard's value, which bounds the effect of an error of a part.
    pub(super) fn size(&self, index: usize, tau: f64, y: &[f64]) -> f64 {
        let form = &self.equations.guards[index].form;
        form.noise(&self.model.layout, &self.model.inner(y), &self.input(tau)) / ROUNDING
    }

    /// The values that must not become negative, in the order of [`Field::watches`].
    pub(super) fn guards(&self, tau: f64, y: &[f64]) -> [f64; MOST_GUARDS] {
        let model = self.model;
        let mechanism = &*model.mechanism;
        let input = self.input(tau);
        let mut values = [0.0; MOST_GUARDS];
        values.iter_mut().zip(self.guards.values(y, &input)).for_each(|(value, of)| *value = of);
        if !model.adds {
            return values;
        }
        let own = |cause: &Cause| !matches!(cause, Cause::Stop(_) | Cause::Leave(_));
        if !self.equations.guards.iter().any(|guard| own(&guard.cause)) {
            return values;
        }
        let added = model.added(&self.mode, y);
        for (value, guard) in values.iter_mut().zip(&self.equations.guards) {
            *value += match guard.cause {
                // a(x) F_b − (load + what the belt adds − what bent bristles hold)
                Cause::BreakForward(body) => {
                    let load = added.load[body] - model.bristle_force(body, y);
                    model.breakaway(body, true, y) - mechanism.friction(body).forward.breakaway - load
                }
                Cause::BreakBackward(body) => {
                    let load = added.load[body] - model.bristle_force(body, y);
                    model.breakaway(body, false, y) - mechanism.friction(body).backward.breakaway + load
                }
                Cause::GearTorque(drive) if !mechanism.drives[drive].has_rotor() => {
                    let part = &mechanism.drives[drive];
                    let sign = if self.mode.drive[drive].torque_positive { 1.0 } else { -1.0 };
                    let change = match self.mode.motion[part.pulley] {
                        Motion::Stuck => 0.0,
                        _ => {
                            let leader = mechanism.leader(part.pulley);
                            let added = added.load[leader] - added.friction[leader];
                            mechanism.ratio(part.pulley) * added / self.mass[part.pulley]
                        }
                    };
                    -sign * part.motor.rotor_inertia * part.motor.gear_ratio * change
                }
                // A tension that follows the bodies.
                Cause::Switch(Switch::Span(spring, slack)) => {
                    let own = model.following.iter().find(|following| following.spring == spring);
                    let beyond = own.map_or(0.0, |own| model.beyond(own, y));
                    if slack { beyond } else { -beyond }
                }
                // Neither laws nor spans that follow bear on these.
                Cause::Stop(_) | Cause::GearTorque(_) | Cause::Switch(_) | Cause::Leave(_) => 0.0,
            };
        }
        values
    }
}

impl FirstOrderSystem for Field<'_> {
    fn derivative(&self, tau: f64, y: &[f64], rate: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        let model = self.model;
        let input = self.input(tau);
        rate.fill(0.0);
        self.places.iter().zip(self.rates.values(y, &input)).for_each(|(place, value)| rate[*place] = value);
        if model.adds {
            let added = model.added(&self.mode, y);
            for &Moving { place, leader, ratio, mass } in &self.moving {
                // J φ̈ = what is linear + what the belt adds − what the law adds
                let change = (added.load[leader] - added.friction[leader]) / mass;
                rate[place] += ratio * change;
            }
            for (place, bristle) in model.bristle.iter().zip(added.bristle) {
                if let Some(place) = place {
                    rate[*place] = bristle;
                }
            }
        }
        if !rate.iter().sum::<f64>().is_finite() {
            // A trial step that leads nowhere: what is no number fails every test of the error, so the step is refused
            // and a shorter one tried.
            rate.fill(f64::NAN);
        }
    }
}

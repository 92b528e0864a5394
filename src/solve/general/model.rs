//! The equations as the integrator sees them: the linear ones of a mode, and what a law or a belt adds to them.

use super::stretch::Stretch;
use crate::friction::{Law, Motion};
use crate::mechanism::{
    BODIES, Cause, DRIVES, Equations, Form, Layout, Mechanism, Mode, ROUNDING, SPRINGS, State, Switch,
};
use crate::solve::record::Extra;
use ivp::prelude::FirstOrderSystem;
use std::cell::Cell;
use std::sync::Arc;

/// Most quantities that are integrated: coordinates and speeds, currents, bristles.
pub(super) const MOST: usize = 3 * BODIES + DRIVES;

/// The integrated quantities: coordinates and speeds in the order of [`Layout`], currents that are states, rotors, then bristles.
pub(super) type Vector = [f64; MOST];

/// Most conditions watched at once: two for each body, one for each gear, two for each limit and for each spring.
pub(super) const MOST_GUARDS: usize = 2 * BODIES + 5 * DRIVES + 2 * SPRINGS;

/// Room for what a linear form is made of: the integrated quantities, the inputs, and a one.
pub(super) const WIDE: usize = MOST + DRIVES + 1;

/// A spring that follows the bodies.
struct Following {
    spring: usize,
    /// Its length from the integrated quantities: places and weights.
    terms: Vec<(usize, f64)>,
    /// By how much its force acts on each body that moves by itself.
    arms: Vec<(usize, f64)>,
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
    /// Bodies whose friction is not that of the linear equations.
    curved: Vec<usize>,
    following: Vec<Following>,
}

/// What is added to the linear equations.
#[derive(Clone, Copy, Default)]
struct Added {
    /// Forces and torques on each body that moves by itself: of springs that follow, less friction beyond b v ± F_c.
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
            *place = matches!(mechanism.friction(body).law, Law::LuGre { .. }).then(|| room(1));
        }
        let adds = !mechanism.is_piecewise_linear();
        let is_curved =
            |&b: &usize| !mechanism.friction(b).is_piecewise_linear() || mechanism.bodies[b].along.is_some();
        let curved = mechanism.leaders().filter(is_curved).collect();
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

    /// Coefficients of a form on the integrated quantities, the inputs, and a one.
    fn row(&self, form: &Form) -> [f64; WIDE] {
        let mut row = [0.0; WIDE];
        let on = self.layout.on_coordinates(form);
        for body in 0..self.mechanism.bodies.len() {
            (row[self.coordinate(body)], row[self.speed(body)]) = (on.position[body], on.speed[body]);
        }
        for (place, current) in self.current.iter().zip(on.current) {
            if let Some(place) = place {
                row[*place] = current;
            }
        }
        for (drive, input) in form.input.iter().enumerate().take(self.mechanism.drives.len()) {
            row[self.size + drive] = *input;
        }
        row[self.width() - 1] = form.constant;
        row
    }

    /// How many coefficients a form has.
    fn width(&self) -> usize {
        self.size + self.mechanism.drives.len() + 1
    }

    /// The value of a row of coefficients.
    #[inline(always)]
    fn value_of(&self, row: &[f64; WIDE], y: &[f64], input: &[f64; DRIVES]) -> f64 {
        let (on_y, rest) = row.split_at(self.size);
        let sum = on_y.iter().zip(y).fold(0.0, |sum, (coefficient, value)| sum + coefficient * value);
        let drives = self.mechanism.drives.len();
        rest[..drives].iter().zip(input).fold(sum + rest[drives], |sum, (c, input)| sum + c * input)
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

    /// What the force of a spring is beyond k s + c ṡ with the stiffness at the origin, taut or not: (k(q) − k) s.
    #[inline]
    fn beyond(&self, following: &Following, y: &[f64]) -> f64 {
        let spring = &self.mechanism.springs[following.spring];
        let Some(follows) = &spring.follows else { return 0.0 };
        let stiffness = follows.stiffness(|body| self.mechanism.origin[body] + y[self.coordinate(body)]);
        let length: f64 = following.terms.iter().map(|&(place, weight)| weight * y[place]).sum();
        (stiffness - spring.stiffness) * length
    }

    /// What the springs that follow put on each body that moves by itself, −Aᵀ f; a slack one nothing.
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
        for drive in 0..self.mechanism.drives.len() {
            let torque = self.mechanism.torque_at_rest(drive, mode);
            settled.drive[drive].torque_positive = self.value(&torque, &inner, input) >= 0.0;
        }
        self.value(&self.mechanism.load(body, forward, &settled), &inner, input) + self.loads(mode, y)[body]
    }

    /// What rounding may have done to it.
    pub(super) fn noise(&self, body: usize, mode: &Mode, y: &[f64], input: &[f64; DRIVES]) -> f64 {
        self.mechanism.load(body, true, mode).noise(&self.layout, &self.inner(y), input)
    }

    /// What a body at rest holds this way, where it is.
    #[inline]
    pub(super) fn breakaway(&self, body: usize, forward: bool, y: &[f64]) -> f64 {
        self.factor(body, y) * self.mechanism.friction(body).breakaway(forward)
    }

    /// What the laws and the belt add to the linear equations, and how the bristles move.
    #[inline(always)]
    fn added(&self, mode: &Mode, y: &[f64]) -> Added {
        let mut added = Added { load: self.loads(mode, y), ..Added::default() };
        for &body in &self.curved {
            let friction = self.mechanism.friction(body);
            let v = y[self.speed(body)];
            added.friction[body] = match (mode.motion[body], friction.law) {
                (Motion::Stuck, _) => 0.0,
                // In the equations there is b v ± F_c; here what the law differs by.
                (Motion::Forward, _) => self.factor(body, y) * friction.dry(true, v) - friction.forward.coulomb,
                (Motion::Backward, _) => friction.backward.coulomb - self.factor(body, y) * friction.dry(false, -v),
                // In the equations there is b v.
                (Motion::Free, Law::Coulomb | Law::Stribeck { .. }) => 0.0,
                (Motion::Free, law) => {
                    let forward = v >= 0.0;
                    let dry = self.factor(body, y) * friction.dry(forward, v.abs());
                    let viscous = (friction.side(forward).viscous - friction.forward.viscous) * v;
                    match (law, self.bristle[body]) {
                        (Law::LuGre { stiffness, damping, .. }, Some(place)) => {
                            let z = y[place];
                            // ż = v − σ₀ |v| z / g(v)
                            added.bristle[body] = v - stiffness * v.abs() * z / dry;
                            // σ₀ z + σ₁ ż
                            stiffness * z + damping * added.bristle[body] + viscous
                        }
                        _ => dry.copysign(v) + viscous,
                    }
                }
            };
        }
        added
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

/// The equations of one mode under one stretch of the inputs: ẏ = f(τ, y), τ counted from the beginning of the stretch.
pub(super) struct Field<'a> {
    model: &'a Model,
    mode: Mode,
    equations: Equations,
    /// Rates of the quantities that move, by the linear equations: places and coefficients.
    rates: Vec<(usize, [f64; WIDE])>,
    /// The conditions, by the linear equations.
    guards: Vec<[f64; WIDE]>,
    /// Inertia that moves with each body, per unit of its leader's way.
    mass: [f64; BODIES],
    pub(super) stretch: &'a Stretch,
    evaluations: Cell<u64>,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a Model, mode: &Mode, stretch: &'a Stretch) -> Self {
        let mechanism = &*model.mechanism;
        let equations = mechanism.equations(*mode);
        let (mut mass, mut rates) = ([1.0; BODIES], Vec::with_capacity(model.size));
        for (body, mass) in mass.iter_mut().enumerate().take(mechanism.bodies.len()) {
            *mass = mechanism.mass(mechanism.leader(body), &equations.inertia);
            if mode.motion[body] != Motion::Stuck {
                rates.push((model.speed(body), model.row(&equations.acceleration[body])));
            }
            let mut way = model.layout.rate(mechanism, body);
            for (speed, motion) in way.speed.iter_mut().zip(mode.motion) {
                if motion == Motion::Stuck {
                    *speed = 0.0;
                }
            }
            rates.push((model.coordinate(body), model.row(&way)));
        }
        for (place, rate) in model.current.iter().zip(&equations.current_rate) {
            rates.extend(place.map(|place| (place, model.row(rate))));
        }
        let guards = equations.guards.iter().map(|guard| model.row(&guard.form)).collect();
        Self { model, mode: *mode, equations, rates, guards, mass, stretch, evaluations: Cell::new(0) }
    }

    pub(super) fn evaluations(&self) -> u64 {
        self.evaluations.get()
    }

    /// The inputs at τ.
    pub(super) fn input(&self, tau: f64) -> [f64; DRIVES] {
        self.stretch.input(tau)
    }

    /// What is watched.
    pub(super) fn watches(&self) -> Vec<Cause> {
        self.equations.guards.iter().map(|guard| guard.cause).collect()
    }

    /// What the parts of a guard's value come to, and so what an error of a part of it may do.
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
        for (value, row) in values.iter_mut().zip(&self.guards) {
            *value = model.value_of(row, y, &input);
        }
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
                // a(x) F_b − (load + what the belt adds)
                Cause::BreakForward(body) => {
                    model.breakaway(body, true, y) - mechanism.friction(body).forward.breakaway - added.load[body]
                }
                Cause::BreakBackward(body) => {
                    model.breakaway(body, false, y) - mechanism.friction(body).backward.breakaway + added.load[body]
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
        for (place, row) in &self.rates {
            rate[*place] = model.value_of(row, y, &input);
        }
        if model.adds {
            let mechanism = &*model.mechanism;
            let added = model.added(&self.mode, y);
            for body in (0..mechanism.bodies.len()).filter(|&body| self.mode.motion[body] != Motion::Stuck) {
                // J φ̈ = what is linear + what the belt adds − what the law adds
                let leader = mechanism.leader(body);
                let change = (added.load[leader] - added.friction[leader]) / self.mass[body];
                rate[model.speed(body)] += mechanism.ratio(body) * change;
            }
            for (place, bristle) in model.bristle.iter().zip(added.bristle) {
                if let Some(place) = place {
                    rate[*place] = bristle;
                }
            }
        }
        if !rate.iter().sum::<f64>().is_finite() {
            // A trial step that leads nowhere: what is no number fails every test of the error, so the step is refused and a
            // shorter one tried.
            rate.fill(f64::NAN);
        }
    }
}

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
        Self { mechanism, layout, place, current, size, bristle, adds }
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
    fn factor(&self, body: usize, inner: &State) -> f64 {
        match &self.mechanism.bodies[body].along {
            Some(along) => along.factor(self.mechanism.origin[body] + inner.position[body]),
            None => 1.0,
        }
    }

    /// What the springs' forces are beyond k s + c ṡ with the stiffness at the origin, taut or not: (k(q) − k) s.
    #[inline(always)]
    fn beyond(&self, inner: &State, stretch: &[f64; SPRINGS]) -> [f64; SPRINGS] {
        let mut beyond = [0.0; SPRINGS];
        for (index, spring) in self.mechanism.springs.iter().enumerate() {
            if let Some(follows) = &spring.follows {
                let stiffness = follows.stiffness(|body| self.mechanism.origin[body] + inner.position[body]);
                beyond[index] = (stiffness - spring.stiffness) * stretch[index];
            }
        }
        beyond
    }

    /// What they put on each body that moves by itself: −Aᵀ f.
    #[inline(always)]
    fn loads(&self, beyond: &[f64; SPRINGS]) -> [f64; BODIES] {
        let mut loads = [0.0; BODIES];
        for (spring, force) in self.mechanism.springs.iter().zip(beyond).filter(|(spring, _)| spring.follows.is_some())
        {
            for &(body, arm) in &spring.arms {
                loads[self.mechanism.leader(body)] -= self.mechanism.ratio(body) * arm * force;
            }
        }
        loads
    }

    /// All forces on a body but its friction, for a body that goes, or is about to go, forward or backward.
    pub(super) fn load(&self, body: usize, forward: bool, mode: &Mode, inner: &State, input: &[f64; DRIVES]) -> f64 {
        let mut settled = *mode;
        for drive in 0..self.mechanism.drives.len() {
            let torque = self.mechanism.torque_at_rest(drive, mode);
            settled.drive[drive].torque_positive = self.value(&torque, inner, input) >= 0.0;
        }
        let beyond = self.carried(mode, self.beyond(inner, &self.layout.stretches(inner)));
        self.value(&self.mechanism.load(body, forward, &settled), inner, input) + self.loads(&beyond)[body]
    }

    /// The same where a slack spring carries nothing.
    #[inline(always)]
    fn carried(&self, mode: &Mode, mut beyond: [f64; SPRINGS]) -> [f64; SPRINGS] {
        for (beyond, slack) in beyond.iter_mut().zip(mode.slack) {
            if slack {
                *beyond = 0.0;
            }
        }
        beyond
    }

    /// What rounding may have done to it.
    pub(super) fn noise(&self, body: usize, mode: &Mode, inner: &State, input: &[f64; DRIVES]) -> f64 {
        self.mechanism.load(body, true, mode).noise(&self.layout, inner, input)
    }

    /// What a body at rest holds this way, where it is.
    pub(super) fn breakaway(&self, body: usize, forward: bool, inner: &State) -> f64 {
        self.factor(body, inner) * self.mechanism.friction(body).breakaway(forward)
    }

    /// What the laws and the belt add to the linear equations, and how the bristles move.
    #[inline(always)]
    pub(super) fn extra(
        &self,
        mode: &Mode,
        inner: &State,
        stretch: &[f64; SPRINGS],
        y: &[f64],
    ) -> (Extra, [f64; BODIES]) {
        let mut rates = [0.0; BODIES];
        if !self.adds {
            return (Extra::default(), rates);
        }
        let mut extra = Extra { force: self.carried(mode, self.beyond(inner, stretch)), ..Extra::default() };
        for body in self.mechanism.leaders() {
            let friction = self.mechanism.friction(body);
            let v = inner.speed[body];
            extra.friction[body] = match (mode.motion[body], friction.law) {
                (Motion::Stuck, _) => 0.0,
                // In the equations there is b v ± F_c; here what the law differs by.
                (Motion::Forward, _) => self.factor(body, inner) * friction.dry(true, v) - friction.forward.coulomb,
                (Motion::Backward, _) => friction.backward.coulomb - self.factor(body, inner) * friction.dry(false, -v),
                // In the equations there is b v.
                (Motion::Free, Law::Coulomb | Law::Stribeck { .. }) => 0.0,
                (Motion::Free, law) => {
                    let forward = v >= 0.0;
                    let dry = self.factor(body, inner) * friction.dry(forward, v.abs());
                    let viscous = (friction.side(forward).viscous - friction.forward.viscous) * v;
                    match (law, self.bristle[body]) {
                        (Law::LuGre { stiffness, damping, .. }, Some(place)) => {
                            let z = y[place];
                            // ż = v − σ₀ |v| z / g(v)
                            rates[body] = v - stiffness * v.abs() * z / dry;
                            extra.bristle[body] = z;
                            // σ₀ z + σ₁ ż
                            stiffness * z + damping * rates[body] + viscous
                        }
                        _ => dry.copysign(v) + viscous,
                    }
                }
            };
        }
        (extra, rates)
    }
}

/// The equations of one mode under one stretch of the inputs: ẏ = f(τ, y), τ counted from the beginning of the stretch.
pub(super) struct Field<'a> {
    model: &'a Model,
    mode: Mode,
    equations: Equations,
    /// Rates of the coordinates.
    ways: [Form; BODIES],
    /// Inertia that moves with each body, per unit of its leader's way.
    mass: [f64; BODIES],
    pub(super) stretch: &'a Stretch,
    evaluations: Cell<u64>,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a Model, mode: &Mode, stretch: &'a Stretch) -> Self {
        let mechanism = &*model.mechanism;
        let equations = mechanism.equations(*mode);
        let (mut mass, mut ways) = ([1.0; BODIES], [Form::ZERO; BODIES]);
        for body in 0..mechanism.bodies.len() {
            mass[body] = mechanism.mass(mechanism.leader(body), &equations.inertia);
            ways[body] = model.layout.rate(mechanism, body);
            for (speed, motion) in ways[body].speed.iter_mut().zip(mode.motion) {
                if motion == Motion::Stuck {
                    *speed = 0.0;
                }
            }
        }
        Self { model, mode: *mode, equations, ways, mass, stretch, evaluations: Cell::new(0) }
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
        let (mechanism, inner, input) = (&*model.mechanism, model.inner(y), self.input(tau));
        let stretch = model.layout.stretches(&inner);
        let (extra, _) = model.extra(&self.mode, &inner, &stretch, y);
        let (load, beyond) = (model.loads(&extra.force), model.beyond(&inner, &stretch));
        let mut values = [0.0; MOST_GUARDS];
        for (value, guard) in values.iter_mut().zip(&self.equations.guards) {
            *value = guard.form.value_at(&stretch, &inner, &input)
                + match guard.cause {
                    Cause::Stop(_) => 0.0,
                    // a(x) F_b − (load + what the belt adds)
                    Cause::BreakForward(body) => {
                        model.breakaway(body, true, &inner) - mechanism.friction(body).forward.breakaway - load[body]
                    }
                    Cause::BreakBackward(body) => {
                        model.breakaway(body, false, &inner) - mechanism.friction(body).backward.breakaway + load[body]
                    }
                    Cause::GearTorque(drive) => {
                        let part = &mechanism.drives[drive];
                        let sign = if self.mode.drive[drive].torque_positive { 1.0 } else { -1.0 };
                        let change = match self.mode.motion[part.pulley] {
                            _ if part.has_rotor() => 0.0,
                            Motion::Stuck => 0.0,
                            _ => {
                                let leader = mechanism.leader(part.pulley);
                                let added = load[leader] - extra.friction[leader];
                                mechanism.ratio(part.pulley) * added / self.mass[part.pulley]
                            }
                        };
                        -sign * part.motor.rotor_inertia * part.motor.gear_ratio * change
                    }
                    // A tension that follows the bodies.
                    Cause::Switch(Switch::Span(spring, to)) => {
                        if to {
                            beyond[spring]
                        } else {
                            -beyond[spring]
                        }
                    }
                    // Neither laws nor spans that follow bear on these.
                    Cause::Switch(_) | Cause::Leave(_) => 0.0,
                };
        }
        values
    }
}

impl FirstOrderSystem for Field<'_> {
    fn derivative(&self, tau: f64, y: &[f64], rate: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        let model = self.model;
        let (mechanism, inner, input) = (&*model.mechanism, model.inner(y), self.input(tau));
        let stretch = model.layout.stretches(&inner);
        let (extra, bristles) = model.extra(&self.mode, &inner, &stretch, y);
        let load = model.loads(&extra.force);
        let value = |form: &Form| form.value_at(&stretch, &inner, &input);
        for body in 0..mechanism.bodies.len() {
            rate[model.speed(body)] = match self.mode.motion[body] {
                Motion::Stuck => 0.0,
                // J φ̈ = what is linear + what the belt adds − what the law adds
                _ => {
                    let leader = mechanism.leader(body);
                    let added = (load[leader] - extra.friction[leader]) / self.mass[body];
                    value(&self.equations.acceleration[body]) + mechanism.ratio(body) * added
                }
            };
            rate[model.coordinate(body)] = match model.layout.is_replaced(body) {
                true => value(&self.ways[body]),
                false => inner.speed[body],
            };
            if let Some(place) = model.bristle[body] {
                rate[place] = bristles[body];
            }
        }
        for (place, form) in model.current.iter().zip(&self.equations.current_rate) {
            if let Some(place) = place {
                rate[*place] = value(form);
            }
        }
        if !rate.iter().sum::<f64>().is_finite() {
            // A trial step that leads nowhere: what is no number fails every test of the error, so the step is refused and a
            // shorter one tried.
            rate.fill(f64::NAN);
        }
    }
}

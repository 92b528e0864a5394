//! The equations as the integrator sees them: the linear ones of a mode, and what a law or a belt adds to them.

use super::stretch::Stretch;
use crate::friction::{Law, Motion};
use crate::plant::{Body, Cause, Equations, Form, Mode, Plant, ROTOR, ROUNDING, State, place};
use crate::solve::coordinates::stretches;
use crate::solve::record::Extra;
use crate::stage::BeltMake;
use ivp::prelude::FirstOrderSystem;
use std::cell::Cell;

/// Most quantities that are integrated: positions and speeds, current, rotor, three bristles.
pub(super) const MOST: usize = place::COUNT + 3;

/// The integrated quantities: the mechanical ones in the order of [`place`], then the current, the rotor and bristles, if they are states.
pub(super) type Vector = [f64; MOST];

/// Most conditions watched at once: two for each body, the gear's torque or its flank's, voltage, current and end stops, one for each span.
pub(super) const MOST_GUARDS: usize = 18;

/// A stage made ready for the integrator.
pub(super) struct Model<'a> {
    pub(super) plant: &'a Plant,
    /// Where positions are counted from, m.
    pub(super) origin: f64,
    /// Where the current stands, if it is a state.
    pub(super) current: Option<usize>,
    /// Where the rotor's angle stands, if it is a state; its speed behind it.
    pub(super) rotor: Option<usize>,
    /// Number of integrated quantities.
    pub(super) size: usize,
    /// Where a body's bristle deflection stands, if it has one.
    pub(super) bristle: [Option<usize>; 3],
    /// The belt whose spans follow the cart.
    follows: Option<BeltMake>,
    /// Whether anything is added to the linear equations at all.
    pub(super) adds: bool,
}

impl<'a> Model<'a> {
    pub(super) fn new(plant: &'a Plant, origin: f64) -> Self {
        let mut size = place::CURRENT;
        let mut room = |there: bool, count: usize| {
            there.then(|| {
                size += count;
                size - count
            })
        };
        let current = room(plant.has_current_state(), 1);
        let rotor = room(plant.has_rotor(), 2);
        let bristle = Body::ALL.map(|body| room(matches!(plant.friction(body).law, Law::LuGre { .. }), 1));
        let belt = &plant.stage().belt;
        let adds = !plant.stage().is_piecewise_linear();
        Self { plant, origin, current, rotor, size, bristle, follows: belt.make.filter(|_| belt.follows_cart), adds }
    }

    /// The state in the solver's coordinates.
    #[inline]
    pub(super) fn inner(&self, y: &[f64]) -> State {
        let mut inner = [0.0; place::COUNT];
        for (inner, y) in inner[..place::CURRENT].iter_mut().zip(y) {
            *inner = *y;
        }
        if let Some(current) = self.current {
            inner[place::CURRENT] = y[current];
        }
        match self.rotor {
            Some(rotor) => (inner[place::ROTOR_ANGLE], inner[place::ROTOR_SPEED]) = (y[rotor], y[rotor + 1]),
            // Where it is no inertia of its own, the rotor turns with the drive pulley.
            None => inner[place::ROTOR_SPEED] = y[place::DRIVE_SPEED],
        }
        inner
    }

    /// The value of a linear form.
    #[inline]
    pub(super) fn value(&self, form: &Form, inner: &State, input: f64) -> f64 {
        form.value_at(&stretches(inner), inner, input)
    }

    /// By how much the cart's dry friction is multiplied where it is.
    #[inline(always)]
    fn factor(&self, body: Body, state: &State) -> f64 {
        match &self.plant.stage().cart.along {
            Some(along) if body == Body::Cart => along.factor(self.origin + state[place::CART_POSITION]),
            _ => 1.0,
        }
    }

    /// What the spans' forces are beyond (k d + c ḋ) with the stiffness at x = 0.
    #[inline(always)]
    fn beyond(&self, state: &State) -> [f64; 2] {
        let Some(make) = self.follows else { return [0.0; 2] };
        let stage = self.plant.stage();
        let [k1, k2, _] = stage.belt.stiffness;
        let [d1, d2, _, _, way] = stretches(state);
        let [k1x, k2x] = make.stiffness_at(self.origin + way);
        // (k_j(x) − k_j) d_j
        [(k1x - k1) * d1, (k2x - k2) * d2]
    }

    /// What they put on the three bodies.
    #[inline(always)]
    fn loads(&self, [e1, e2]: [f64; 2]) -> [f64; 3] {
        let r = self.plant.stage().pulley_radius;
        // As f₁ and f₂ in (16)-(18)
        [-r * e1, e1 - e2, r * e2]
    }

    /// All forces on a body but its friction, for a body that goes, or is about to go, forward or backward.
    pub(super) fn load(&self, body: Body, forward: bool, mode: &Mode, state: &State, input: f64) -> f64 {
        let gear_torque_positive = self.value(&self.plant.current(mode), state, input) >= 0.0;
        let mode = Mode { gear_torque_positive, ..*mode };
        self.value(&self.plant.load(body, forward, &mode), state, input) + self.loads(self.beyond(state))[body.index()]
    }

    /// What rounding may have done to it.
    pub(super) fn noise(&self, body: Body, mode: &Mode, state: &State, input: f64) -> f64 {
        self.plant.load(body, true, mode).noise(state, input)
    }

    /// What a body at rest holds this way, where it is.
    pub(super) fn breakaway(&self, body: Body, forward: bool, state: &State) -> f64 {
        self.factor(body, state) * self.plant.friction(body).breakaway(forward)
    }

    /// What the laws and the belt add to the linear equations, and how the bristles move.
    #[inline(always)]
    pub(super) fn extra(&self, motion: &[Motion; 3], state: &State, y: &[f64]) -> (Extra, [f64; 3]) {
        let mut rates = [0.0; 3];
        if !self.adds {
            return (Extra::default(), rates);
        }
        let mut extra = Extra { span: self.beyond(state), ..Extra::default() };
        for body in self.plant.leaders() {
            let index = body.index();
            let friction = self.plant.friction(body);
            let v = state[body.speed_place()];
            extra.friction[index] = match (motion[index], friction.law) {
                (Motion::Stuck, _) => 0.0,
                // In the equations there is b v ± F_c; here what the law differs by.
                (Motion::Forward, _) => self.factor(body, state) * friction.dry(true, v) - friction.forward.coulomb,
                (Motion::Backward, _) => friction.backward.coulomb - self.factor(body, state) * friction.dry(false, -v),
                // In the equations there is b v.
                (Motion::Free, Law::Coulomb | Law::Stribeck { .. }) => 0.0,
                (Motion::Free, law) => {
                    let forward = v >= 0.0;
                    let dry = self.factor(body, state) * friction.dry(forward, v.abs());
                    let viscous = (friction.side(forward).viscous - friction.forward.viscous) * v;
                    match (law, self.bristle[index]) {
                        (Law::LuGre { stiffness, damping, .. }, Some(place)) => {
                            let z = y[place];
                            // ż = v − σ₀ |v| z / g(v)
                            rates[index] = v - stiffness * v.abs() * z / dry;
                            extra.bristle[index] = z;
                            // σ₀ z + σ₁ ż
                            stiffness * z + damping * rates[index] + viscous
                        }
                        _ => dry.copysign(v) + viscous,
                    }
                }
            };
        }
        (extra, rates)
    }
}

/// The equations of one mode under one stretch of the input: ẏ = f(τ, y), τ counted from the beginning of the stretch.
pub(super) struct Field<'a> {
    model: &'a Model<'a>,
    mode: Mode,
    equations: Equations,
    /// Rates of the stretches that stand in the places of angles.
    stretch_rates: [Form; 3],
    /// Inertia that moves with each body.
    mass: [f64; 3],
    pub(super) stretch: &'a Stretch,
    evaluations: Cell<u64>,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a Model<'a>, mode: Mode, stretch: &'a Stretch) -> Self {
        let plant = model.plant;
        let equations = plant.equations(mode);
        let of = |b: Body| plant.ratio(b).powi(2) * equations.inertia[b.index()];
        let mass = Body::ALL.map(|body| plant.followers(plant.leader(body)).map(of).sum());
        let stretch_rates = plant.stretch_rates(&mode);
        Self { model, mode, equations, stretch_rates, mass, stretch, evaluations: Cell::new(0) }
    }

    pub(super) fn evaluations(&self) -> u64 {
        self.evaluations.get()
    }

    /// The input at τ.
    pub(super) fn input(&self, tau: f64) -> f64 {
        self.stretch.input(tau)
    }

    /// What is watched.
    pub(super) fn watches(&self) -> Vec<Cause> {
        self.equations.guards.iter().map(|guard| guard.cause).collect()
    }

    /// What the parts of a guard's value come to, and so what an error of a part of it may do.
    pub(super) fn size(&self, index: usize, tau: f64, y: &[f64]) -> f64 {
        let form = &self.equations.guards[index].form;
        form.noise(&self.model.inner(y), self.input(tau)) / ROUNDING
    }

    /// The values that must not become negative, in the order of [`Field::watches`].
    pub(super) fn guards(&self, tau: f64, y: &[f64]) -> [f64; MOST_GUARDS] {
        let model = self.model;
        let (plant, state, input) = (model.plant, model.inner(y), self.input(tau));
        let (extra, _) = model.extra(&self.mode.motion, &state, y);
        let load = model.loads(extra.span);
        let mut values = [0.0; MOST_GUARDS];
        let guards = &self.equations.guards;
        for (value, guard) in values.iter_mut().zip(guards) {
            *value = model.value(&guard.form, &state, input)
                + match guard.cause {
                    Cause::Stop(_) => 0.0,
                    // a(x) F_b − (load + what the belt adds)
                    Cause::BreakForward(body) => {
                        model.breakaway(body, true, &state)
                            - plant.friction(body).forward.breakaway
                            - load[body.index()]
                    }
                    Cause::BreakBackward(body) => {
                        model.breakaway(body, false, &state) - plant.friction(body).backward.breakaway
                            + load[body.index()]
                    }
                    Cause::GearTorque => {
                        let motor = &plant.stage().motor;
                        let sign = if self.mode.gear_torque_positive { 1.0 } else { -1.0 };
                        let change = match self.mode.motion[0] {
                            Motion::Stuck => 0.0,
                            _ => {
                                let leader = plant.leader(Body::DrivePulley);
                                let added = load[leader.index()] - extra.friction[leader.index()];
                                plant.ratio(Body::DrivePulley) * added / self.mass[0]
                            }
                        };
                        -sign * motor.rotor_inertia * motor.gear_ratio * change
                    }
                    // Neither laws nor spans that follow the cart bear on these.
                    Cause::Switch(_) | Cause::LeaveTravel => 0.0,
                };
        }
        values
    }
}

impl FirstOrderSystem for Field<'_> {
    fn derivative(&self, tau: f64, y: &[f64], rate: &mut [f64]) {
        self.evaluations.set(self.evaluations.get() + 1);
        let model = self.model;
        let (plant, state, input) = (model.plant, model.inner(y), self.input(tau));
        let (extra, bristles) = model.extra(&self.mode.motion, &state, y);
        let load = model.loads(extra.span);
        let value = |form: &Form| model.value(form, &state, input);
        for body in Body::ALL {
            let index = body.index();
            let speed = body.speed_place();
            rate[speed] = match self.mode.motion[index] {
                Motion::Stuck => 0.0,
                // J φ̈ = what is linear + what the belt adds − what the law adds
                _ => {
                    let leader = plant.leader(body).index();
                    let added = (load[leader] - extra.friction[leader]) / self.mass[index];
                    value(&self.equations.acceleration[index]) + plant.ratio(body) * added
                }
            };
            if let Some(place) = model.bristle[index] {
                rate[place] = bristles[index];
            }
        }
        let [d1, d2, twist] = &self.stretch_rates;
        rate[place::DRIVE_ANGLE] = value(d1);
        rate[place::CART_POSITION] = state[place::CART_SPEED];
        rate[place::IDLER_ANGLE] = value(d2);
        if let Some(current) = model.current {
            rate[current] = value(&self.equations.current_rate);
        }
        if let Some(rotor) = model.rotor {
            rate[rotor] = value(twist);
            rate[rotor + 1] = value(&self.equations.acceleration[ROTOR]);
        }
        if !rate.iter().sum::<f64>().is_finite() {
            // A trial step that leads nowhere: what is no number fails every test of the error, so the step is refused and a
            // shorter one tried.
            rate.fill(f64::NAN);
        }
    }
}

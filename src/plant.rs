//! From stage to equations of motion, eq. (1)-(4) and (16)-(18), and their power balance.
//!
//! Every force is a [`Form`]: a linear form of stretches, speeds, current and input. Friction makes the equations
//! piecewise linear; within one [`Mode`] they are linear, and [`Plant::equations`] gives them.

mod elements;
mod form;
mod mode;
mod power;

pub use form::Form;
pub(crate) use form::{POSITION, ROTOR, ROUNDING, SPEEDS, STRETCHES, arms, stretches};
pub use mode::{Cause, Contact, Guard, Limit, Mode, Part, Status, Switch};
pub use power::Power;

use crate::friction::{Friction, Motion, Side};
use crate::stage::{AmplifierMode, BeltModel, Stage, Travel};
use std::borrow::Cow;

/// Places in the state vector: φ₁, φ₁′, x, x′, φ₃, φ₃′ (eq. 6, in the paper's order), then the armature current.
pub mod place {
    /// φ₁, rad.
    pub const DRIVE_ANGLE: usize = 0;
    /// φ₁′, rad/s.
    pub const DRIVE_SPEED: usize = 1;
    /// x, m.
    pub const CART_POSITION: usize = 2;
    /// x′, m/s.
    pub const CART_SPEED: usize = 3;
    /// φ₃, rad.
    pub const IDLER_ANGLE: usize = 4;
    /// φ₃′, rad/s.
    pub const IDLER_SPEED: usize = 5;
    /// i, A; a state only where the armature has an inductance, or the current loop a bandwidth.
    pub const CURRENT: usize = 6;
    /// φ_r, rad: the rotor's angle seen from behind the gear; a state only where the gear gives way, else φ₁.
    pub const ROTOR_ANGLE: usize = 7;
    /// φ_r′, rad/s.
    pub const ROTOR_SPEED: usize = 8;
    /// Number of states.
    pub const COUNT: usize = 9;
}

/// The state of a stage, in the order of [`place`].
pub type State = [f64; place::COUNT];

/// One of the three inertias.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Body {
    /// Drive pulley, φ₁.
    DrivePulley,
    /// Cart, x.
    Cart,
    /// Idler pulley, φ₃.
    IdlerPulley,
}

impl Body {
    /// All three, in the paper's order.
    pub const ALL: [Body; 3] = [Body::DrivePulley, Body::Cart, Body::IdlerPulley];

    /// 0, 1 or 2.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Where its speed stands in the state.
    pub fn speed_place(self) -> usize {
        2 * self.index() + 1
    }

    /// Its name for people.
    pub fn name(self) -> &'static str {
        ["drive pulley", "cart", "idler pulley"][self.index()]
    }

    /// Its name in column headings and keys.
    pub fn key(self) -> &'static str {
        ["drive", "cart", "idler"][self.index()]
    }
}

/// The equations in one mode: accelerations, rate of current, and what must stay true.
#[derive(Debug, Clone)]
pub struct Equations {
    /// φ̈₁, ẍ, φ̈₃ and φ̈_r; the last is zero where the rotor is no inertia of its own.
    pub acceleration: [Form; SPEEDS],
    /// di/dt; zero where the current is no state.
    pub current_rate: Form,
    /// Inertia of each: J₁ (+ rotor through the gear), M, J₂, and that of the rotor seen from behind the gear.
    pub inertia: [f64; SPEEDS],
    /// Stiffness that stores energy in this mode: of the spans, the gear, and the end stop.
    pub stiffness: [f64; STRETCHES],
    /// Conditions under which these equations hold.
    pub guards: Vec<Guard>,
}

/// The equations of a stage in all its modes.
#[derive(Debug, Clone)]
pub struct Plant {
    stage: Stage,
    /// Stiffness and damping of the spans as the model has them.
    belt: [[f64; 3]; 2],
    /// Forces of the spans as long as they are taut: f₁ pulls the cart forward, f₂ backward, f₃ pulls drive and idler
    /// pulley together.
    span: [Form; 3],
    /// Friction laws; that of bodies that move as one stands with the one that leads.
    friction: [Friction; 3],
}

impl Plant {
    /// The equations of `stage`.
    pub fn new(stage: &Stage) -> Self {
        let r = stage.pulley_radius;
        let [mut k, mut c] = [stage.belt.stiffness, stage.belt.damping];
        if stage.belt.model == BeltModel::TwoMass {
            // Spans 2 and 3 in series, the idler pulley between them without inertia or friction of its own:
            // 1/k₂₃ = 1/k₂ + 1/k₃ and, for slow motion, c₂₃ = (c₂ k₃² + c₃ k₂²)/(k₂ + k₃)²
            let sum = k[1] + k[2];
            c[1] = (c[1] * k[2] * k[2] + c[2] * k[1] * k[1]) / (sum * sum);
            k[1] = k[1] * k[2] / sum;
        }
        let ([k1, k2, k3], [c1, c2, c3]) = (k, c);
        let (w1, v, w3) = (Form::speed(0), Form::speed(1), Form::speed(2));
        // f₁ = k₁ (r φ₁ − x) + c₁ (r φ̇₁ − ẋ)                                  after (1), (2)
        let f1 = Form::stretch(0) * k1 + (w1 * r - v) * c1;
        // f₂ = k₂ (x − r φ₃) + c₂ (ẋ − r φ̇₃)                                  after (2), (3)
        let f2 = Form::stretch(1) * k2 + (v - w3 * r) * c2;
        // f₃ = k₃ (r φ₃ − r φ₁) + c₃ (r φ̇₃ − r φ̇₁)                            after (1), (3)
        let f3 = Form::stretch(2) * k3 + (w3 * r - w1 * r) * c3;
        let span = match stage.belt.model {
            BeltModel::Elastic => [f1, f2, f3],
            BeltModel::TwoMass => [f1, f2, f2],
            BeltModel::Rigid => [Form::ZERO; 3],
        };
        let mut plant = Self { stage: stage.clone(), belt: [k, c], span, friction: [Friction::default(); 3] };
        let laws = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];
        for (body, law) in Body::ALL.into_iter().zip(laws) {
            let ratio = plant.ratio(body);
            let leader = plant.leader(body);
            plant.friction[leader.index()].add(&law, ratio);
            if leader == body {
                plant.friction[body.index()].law = law.law;
            }
        }
        plant
    }

    /// The stage.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// The same with the cart's position counted from `origin`: the ends of its travel move there, before anything is multiplied
    /// with them.
    pub(crate) fn seen_from(&self, origin: f64) -> Cow<'_, Self> {
        match self.stage.travel {
            Some(travel) if origin != 0.0 => {
                let mut plant = self.clone();
                plant.stage.travel = Some(Travel { min: travel.min - origin, max: travel.max - origin, ..travel });
                Cow::Owned(plant)
            }
            _ => Cow::Borrowed(self),
        }
    }

    /// ḋ₁ = r φ̇₁ − ẋ, ḋ₂ = ẋ − r φ̇₃ and θ̇ = φ̇_r − φ̇₁, without the speeds of what is stuck; nothing where one body carries both ends.
    pub(crate) fn stretch_rates(&self, mode: &Mode) -> [Form; 3] {
        let r = self.stage.pulley_radius;
        let speed = |body: Body| match mode.motion[body.index()] {
            Motion::Stuck => Form::ZERO,
            _ => Form::speed(body.index()),
        };
        let [drive, cart, idler] = Body::ALL.map(speed);
        let apart = |a: Body, b: Body, rate: Form| if self.leader(a) == self.leader(b) { Form::ZERO } else { rate };
        [
            apart(Body::DrivePulley, Body::Cart, drive * r - cart),
            apart(Body::Cart, Body::IdlerPulley, cart - idler * r),
            if self.has_rotor() { Form::speed(ROTOR) - drive } else { Form::ZERO },
        ]
    }

    /// The body that this one moves with: itself, unless the belt's model makes several bodies one.
    pub fn leader(&self, body: Body) -> Body {
        match (self.stage.belt.model, body) {
            (BeltModel::Elastic, _) => body,
            (BeltModel::TwoMass, Body::Cart) | (BeltModel::Rigid, _) => Body::Cart,
            (BeltModel::TwoMass, _) => Body::DrivePulley,
        }
    }

    /// The way of this body per way of its leader: 1, or 1/r for a pulley that goes with the cart.
    pub fn ratio(&self, body: Body) -> f64 {
        match self.stage.belt.model {
            BeltModel::Rigid if body != Body::Cart => 1.0 / self.stage.pulley_radius,
            _ => 1.0,
        }
    }

    /// Bodies that move by themselves.
    pub fn leaders(&self) -> impl Iterator<Item = Body> {
        Body::ALL.into_iter().filter(|&body| self.leader(body) == body)
    }

    /// Bodies that move with `leader`, itself included.
    pub fn followers(&self, leader: Body) -> impl Iterator<Item = Body> {
        Body::ALL.into_iter().filter(move |&body| self.leader(body) == leader)
    }

    /// Whether the rotor is an inertia of its own.
    pub fn has_rotor(&self) -> bool {
        self.stage.motor.gear_play.is_some()
    }

    /// Whether the armature current is a state of its own.
    pub fn has_current_state(&self) -> bool {
        match self.stage.amplifier.mode {
            AmplifierMode::Voltage => self.stage.motor.inductance > 0.0,
            AmplifierMode::Current => self.stage.amplifier.bandwidth.is_some(),
        }
    }

    /// Friction law of a body; nothing for one that another leads.
    pub fn friction(&self, body: Body) -> &Friction {
        &self.friction[body.index()]
    }

    /// Whether a body can stick or has a direction-dependent law, so that its motion has modes at all.
    pub fn has_modes(&self, body: Body) -> bool {
        let leader = self.leader(body);
        self.friction(leader).sticks() || (self.gear_loses() && leader == self.leader(Body::DrivePulley))
    }

    /// Whether the gear's efficiency is below one.
    pub fn gear_loses(&self) -> bool {
        self.stage.motor.gear_efficiency < 1.0
    }

    /// The mode in which `state` is looked at first: each body moves as its speed says, all else is in order.
    pub fn first_mode(&self, state: &State) -> Mode {
        Mode::of(Body::ALL.map(|body| match state[self.leader(body).speed_place()] {
            _ if !self.has_modes(body) => Motion::Free,
            v if v > 0.0 => Motion::Forward,
            v if v < 0.0 => Motion::Backward,
            _ => Motion::Stuck,
        }))
    }

    /// The part of the torque that the gear passes on: η if the motor drives, 1/η if it is driven.
    ///
    /// Whatever side drives loses the share 1 − η of its power, so that the gear never adds any.
    fn gear_factor(&self, forward: bool, torque_positive: bool) -> f64 {
        let eta = self.stage.motor.gear_efficiency;
        if forward == torque_positive { eta } else { 1.0 / eta }
    }

    /// All forces (N) or torques (N m) on a body, and on those that move with it, except friction, for a body that moves, or
    /// is about to move, forward or backward: the inner brackets of eq. (16)-(18).
    pub fn load(&self, body: Body, forward: bool, mode: &Mode) -> Form {
        let own = |body| self.own_load(body, forward, mode) * self.ratio(body);
        self.followers(body).map(own).fold(Form::ZERO, |sum, form| sum + form)
    }

    fn own_load(&self, body: Body, forward: bool, mode: &Mode) -> Form {
        let r = self.stage.pulley_radius;
        let [f1, f2, f3] = self.span_forces(mode);
        match body {
            // −r f₁ + r f₃ + τ_M                                                (16)
            Body::DrivePulley => self.torque_on_pulley(forward, mode) + f3 * r - f1 * r,
            // f₁ − f₂, a constant force, and that of an end stop                (17)
            Body::Cart => f1 - f2 + Form::constant(self.stage.cart.constant_force()) + self.stop_force(mode),
            // r f₂ − r f₃                                                       (18)
            Body::IdlerPulley => f2 * r - f3 * r,
        }
    }

    /// Torque of motor and gear on the drive pulley, rotor inertia apart where the gear is stiff.
    fn torque_on_pulley(&self, forward: bool, mode: &Mode) -> Form {
        if self.has_rotor() {
            return self.gear_torque(mode);
        }
        let motor = &self.stage.motor;
        let e = self.gear_factor(forward, mode.gear_torque_positive);
        // τ_M = e n K_t i                                                       (4) with a gear
        self.current(mode) * (motor.torque_constant * motor.gear_ratio * e)
    }

    /// The equations that hold in `mode`, and the conditions under which they do.
    pub fn equations(&self, mode: Mode) -> Equations {
        let stage = &self.stage;
        let motor = &stage.motor;
        let n = motor.gear_ratio;
        let mut acceleration = [Form::ZERO; SPEEDS];
        let mut inertia = [stage.drive_pulley.inertia, stage.cart.mass, stage.idler_pulley.inertia, 0.0];
        let mut guards = Vec::with_capacity(7);

        let rotor = n * n * motor.rotor_inertia;
        if self.has_rotor() {
            // n² J_r φ̈_r = n K_t i − T
            inertia[ROTOR] = rotor;
            let torque = self.current(&mode) * (n * motor.torque_constant) - self.gear_torque(&mode);
            acceleration[ROTOR] = torque * (1.0 / rotor);
        } else {
            // J₁ + e n² J_r: the rotor turns n times as fast, behind the gear.
            let forward = mode.motion[0] != Motion::Backward;
            inertia[0] += self.gear_factor(forward, mode.gear_torque_positive) * rotor;
        }

        for body in self.leaders() {
            let index = body.index();
            let speed = Form::speed(index);
            let motion = mode.motion[index];
            let law = self.friction(body);
            let load = self.load(body, motion != Motion::Backward, &mode);
            let mass: f64 = self.followers(body).map(|b| self.ratio(b).powi(2) * inertia[b.index()]).sum();
            // J φ̈ = load − F_f, with F_f = b v ± F_c                             (15)-(18)
            let sliding = |side: Side, sign: f64| {
                (load - speed * side.viscous - Form::constant(sign * side.coulomb)) * (1.0 / mass)
            };
            let own = match motion {
                Motion::Free => sliding(law.forward, 0.0),
                Motion::Forward => {
                    guards.push(Guard { form: speed, cause: Cause::Stop(body) });
                    sliding(law.forward, 1.0)
                }
                Motion::Backward => {
                    guards.push(Guard { form: -speed, cause: Cause::Stop(body) });
                    sliding(law.backward, -1.0)
                }
                Motion::Stuck => {
                    let back = self.load(body, false, &mode);
                    guards.push(Guard {
                        form: Form::constant(law.forward.breakaway) - load,
                        cause: Cause::BreakForward(body),
                    });
                    guards.push(Guard {
                        form: Form::constant(law.backward.breakaway) + back,
                        cause: Cause::BreakBackward(body),
                    });
                    Form::ZERO
                }
            };
            for follower in self.followers(body) {
                acceleration[follower.index()] = own * self.ratio(follower);
            }
        }
        if self.gear_loses() && !self.has_rotor() {
            // T = K_t i − J_r n φ̈₁, the torque that the motor hands to the gear
            let torque = self.current(&mode) * motor.torque_constant - acceleration[0] * (motor.rotor_inertia * n);
            let sign = if mode.gear_torque_positive { 1.0 } else { -1.0 };
            // First, because the loads that the others watch depend on it.
            guards.insert(0, Guard { form: torque * sign, cause: Cause::GearTorque });
        }
        self.watch_elements(&mode, &mut guards);
        let stiffness = self.stiffness_in(&mode);
        Equations { acceleration, current_rate: self.current_rate(&mode), inertia, stiffness, guards }
    }

    /// Friction force (N) or torque (N m) on a body: what its law gives while it slides, what holds it while it is stuck.
    ///
    /// `load` is all else that acts on the body: the least and the most of it, which differ only where a gear with losses
    /// holds a share of its own.
    pub fn friction_value(&self, body: Body, motion: Motion, speed: f64, load: (f64, f64)) -> f64 {
        let law = self.friction(body);
        match motion {
            // F_f = b v ± F_c                                                   (15)
            Motion::Free => law.forward.viscous * speed,
            Motion::Forward => law.forward.viscous * speed + law.forward.coulomb,
            Motion::Backward => law.backward.viscous * speed - law.backward.coulomb,
            // The gear holds what it can, friction the rest; what moves with another body leaves it to that one.
            Motion::Stuck if self.leader(body) != body => 0.0,
            Motion::Stuck => load.0.max(0.0) + load.1.min(0.0),
        }
    }

    /// The least and the most torque that motor and gear put on a stuck drive pulley at this current, N m.
    pub fn holding_torque(&self, current: f64) -> (f64, f64) {
        let motor = &self.stage.motor;
        let torque = motor.gear_ratio * motor.torque_constant * current;
        // n η K_t i if it drives, n K_t i / η if it is driven back
        let (passed, held) = (torque * motor.gear_efficiency, torque / motor.gear_efficiency);
        (passed.min(held), passed.max(held))
    }
}

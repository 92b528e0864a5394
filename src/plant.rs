//! From stage to equations of motion, eq. (1)-(4) and (16)-(18), and their power balance.
//!
//! Every force is a [`Form`]: a linear form of stretches, speeds, current and input. Friction makes the equations
//! piecewise linear; within one [`Mode`] they are linear, and [`Plant::equations`] gives them.

mod form;
mod power;

pub use form::Form;
pub(crate) use form::{ROUNDING, stretches};
pub use power::Power;

use crate::friction::{Friction, Motion, Side};
use crate::stage::{AmplifierMode, Stage};

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
    /// i, A; a state only where the armature has an inductance.
    pub const CURRENT: usize = 6;
    /// Number of states.
    pub const COUNT: usize = 7;
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

/// Which linear equations hold: what each body does, and which way the gear carries torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Mode {
    /// Motion of drive pulley, cart, idler pulley.
    pub motion: [Motion; 3],
    /// Whether the torque through the gear is positive; matters only where the gear loses power.
    pub gear_torque_positive: bool,
}

/// The equations in one mode: accelerations, rate of current, and what must stay true.
#[derive(Debug, Clone)]
pub struct Equations {
    /// φ̈₁, ẍ, φ̈₃.
    pub acceleration: [Form; 3],
    /// di/dt; zero where the current is no state.
    pub current_rate: Form,
    /// Inertia that each acceleration was divided by: J₁ (+ rotor through the gear), M, J₂.
    pub inertia: [f64; 3],
    /// Conditions under which these equations hold.
    pub guards: Vec<Guard>,
}

/// A condition of a mode: the mode holds while `form` ≥ 0.
#[derive(Debug, Clone, Copy)]
pub struct Guard {
    /// What must not become negative.
    pub form: Form,
    /// What it means when it does.
    pub cause: Cause,
}

/// Why a mode ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// A sliding body comes to zero speed.
    Stop(Body),
    /// The load on a stuck body passes its breakaway forward.
    BreakForward(Body),
    /// The load on a stuck body passes its breakaway backward.
    BreakBackward(Body),
    /// The torque through the gear changes sign.
    GearTorque,
}

/// The equations of a stage in all its modes.
#[derive(Debug, Clone)]
pub struct Plant {
    stage: Stage,
    /// Forces of the spans: f₁ pulls the cart forward, f₂ backward, f₃ pulls drive and idler pulley together.
    span: [Form; 3],
    /// Armature current.
    current: Form,
    friction: [Friction; 3],
}

impl Plant {
    /// The equations of `stage`.
    pub fn new(stage: &Stage) -> Self {
        let r = stage.pulley_radius;
        let [k1, k2, k3] = stage.belt.stiffness;
        let [c1, c2, c3] = stage.belt.damping;
        let (w1, v, w3) = (Form::speed(0), Form::speed(1), Form::speed(2));
        // f₁ = k₁ (r φ₁ − x) + c₁ (r φ̇₁ − ẋ)                                  after (1), (2)
        let f1 = Form::stretch(0) * k1 + (w1 * r - v) * c1;
        // f₂ = k₂ (x − r φ₃) + c₂ (ẋ − r φ̇₃)                                  after (2), (3)
        let f2 = Form::stretch(1) * k2 + (v - w3 * r) * c2;
        // f₃ = k₃ (r φ₃ − r φ₁) + c₃ (r φ̇₃ − r φ̇₁)                            after (1), (3)
        let f3 = Form::stretch(2) * k3 + (w3 * r - w1 * r) * c3;

        let motor = &stage.motor;
        let u = Form::input() * stage.amplifier.gain;
        let current = match stage.amplifier.mode {
            AmplifierMode::Current => u,
            AmplifierMode::Voltage if motor.inductance > 0.0 => Form::current(),
            // i = (V_in − K_e n φ̇₁) / R                                        in (4)
            AmplifierMode::Voltage => {
                (u - w1 * (motor.back_emf_constant * motor.gear_ratio)) * (1.0 / motor.resistance)
            }
        };
        let friction = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];
        Self { stage: stage.clone(), span: [f1, f2, f3], current, friction }
    }

    /// The stage.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Force of each span, N.
    pub fn span_forces(&self) -> &[Form; 3] {
        &self.span
    }

    /// Armature current, A.
    pub fn current(&self) -> &Form {
        &self.current
    }

    /// Whether the armature current is a state of its own.
    pub fn has_current_state(&self) -> bool {
        self.stage.motor.inductance > 0.0 && self.stage.amplifier.mode == AmplifierMode::Voltage
    }

    /// Friction law of a body.
    pub fn friction(&self, body: Body) -> &Friction {
        &self.friction[body.index()]
    }

    /// Whether a body can stick or has a direction-dependent law, so that its motion has modes at all.
    pub fn has_modes(&self, body: Body) -> bool {
        self.friction(body).sticks() || (body == Body::DrivePulley && self.gear_loses())
    }

    /// Whether the gear's efficiency is below one.
    pub fn gear_loses(&self) -> bool {
        self.stage.motor.gear_efficiency < 1.0
    }

    /// The part of the torque that the gear passes on: η if the motor drives, 1/η if it is driven.
    ///
    /// Whatever side drives loses the share 1 − η of its power, so that the gear never adds any.
    fn gear_factor(&self, forward: bool, torque_positive: bool) -> f64 {
        let eta = self.stage.motor.gear_efficiency;
        if forward == torque_positive { eta } else { 1.0 / eta }
    }

    /// All forces (N) or torques (N m) on a body except its friction, for a body that moves, or is about to move,
    /// forward or backward: the inner brackets of eq. (16)-(18).
    pub fn load(&self, body: Body, forward: bool, gear_torque_positive: bool) -> Form {
        let r = self.stage.pulley_radius;
        let [f1, f2, f3] = self.span;
        match body {
            // −r f₁ + r f₃ + τ_M                                                (16)
            Body::DrivePulley => self.motor_torque(self.gear_factor(forward, gear_torque_positive)) + f3 * r - f1 * r,
            // f₁ − f₂                                                           (17)
            Body::Cart => f1 - f2,
            // r f₂ − r f₃                                                       (18)
            Body::IdlerPulley => f2 * r - f3 * r,
        }
    }

    /// Motor torque at the drive pulley at constant speed, for a gear that passes on the part `e`.
    fn motor_torque(&self, e: f64) -> Form {
        let motor = &self.stage.motor;
        // τ_M = e n K_t i                                                       (4) with a gear
        self.current * (motor.torque_constant * motor.gear_ratio * e)
    }

    /// The equations that hold in `mode`, and the conditions under which they do.
    pub fn equations(&self, mode: Mode) -> Equations {
        let motor = &self.stage.motor;
        let n = motor.gear_ratio;
        let mut acceleration = [Form::ZERO; 3];
        let mut inertia = [self.stage.drive_pulley.inertia, self.stage.cart.mass, self.stage.idler_pulley.inertia];
        let mut guards = Vec::with_capacity(7);

        for body in Body::ALL {
            let index = body.index();
            let speed = Form::speed(index);
            let motion = mode.motion[index];
            let forward = motion != Motion::Backward;
            if body == Body::DrivePulley {
                // J₁ + e n² J_r: the rotor turns n times as fast, behind the gear.
                let e = self.gear_factor(forward, mode.gear_torque_positive);
                inertia[0] += e * n * n * motor.rotor_inertia;
            }
            let law = self.friction(body);
            let load = self.load(body, forward, mode.gear_torque_positive);
            // J φ̈ = load − F_f, with F_f = b v ± F_c                             (15)-(18)
            let sliding = |side: Side, sign: f64| {
                (load - speed * side.viscous - Form::constant(sign * side.coulomb)) * (1.0 / inertia[index])
            };
            match motion {
                Motion::Free => acceleration[index] = sliding(law.forward, 0.0),
                Motion::Forward => {
                    acceleration[index] = sliding(law.forward, 1.0);
                    guards.push(Guard { form: speed, cause: Cause::Stop(body) });
                }
                Motion::Backward => {
                    acceleration[index] = sliding(law.backward, -1.0);
                    guards.push(Guard { form: -speed, cause: Cause::Stop(body) });
                }
                Motion::Stuck => {
                    let back = self.load(body, false, mode.gear_torque_positive);
                    guards.push(Guard {
                        form: Form::constant(law.forward.breakaway) - load,
                        cause: Cause::BreakForward(body),
                    });
                    guards.push(Guard {
                        form: Form::constant(law.backward.breakaway) + back,
                        cause: Cause::BreakBackward(body),
                    });
                }
            }
        }
        if self.gear_loses() {
            // T = K_t i − J_r n φ̈₁, the torque that the motor hands to the gear
            let torque = self.current * motor.torque_constant - acceleration[0] * (motor.rotor_inertia * n);
            let sign = if mode.gear_torque_positive { 1.0 } else { -1.0 };
            // First, because the loads that the others watch depend on it.
            guards.insert(0, Guard { form: torque * sign, cause: Cause::GearTorque });
        }
        let current_rate = if self.has_current_state() {
            // L di/dt = V_in − R i − K_e n φ̇₁
            let drop = Form::current() * motor.resistance + Form::speed(0) * (motor.back_emf_constant * n);
            (Form::input() * self.stage.amplifier.gain - drop) * (1.0 / motor.inductance)
        } else {
            Form::ZERO
        };
        Equations { acceleration, current_rate, inertia, guards }
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
            // The gear holds what it can, friction the rest.
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

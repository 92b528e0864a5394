//! Feed-forward from the reference alone: the command for an axis of one mass, and for one whose belt stretches.

use crate::design::{FeedForward, FeedForwardModel};
use crate::signal::profile::Reference;
use crate::stage::{AmplifierMode, BeltModel, EncoderPlace, Stage};

/// The axis as one mass along the belt (Li & Rehani 1996), and its motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// M + (J₁ + n² J_r + J₂)/r², kg.
    pub mass: f64,
    /// Of that (J₁ + n² J_r)/r², what moves before the belt, kg.
    pub driving: f64,
    /// b + (B₁ + B₂)/r², N s/m, forward and backward.
    pub viscous: [f64; 2],
    /// F_c + (τ_c1 + τ_c2)/r, N, forward and backward.
    pub coulomb: [f64; 2],
    /// Constant force on the cart, N.
    pub constant: f64,
    /// n K_t/r, N/A, without the gear's loss.
    pub force_per_ampere: f64,
    efficiency: f64,
    /// n K_e/r, V s/m.
    pub brake: f64,
    resistance: f64,
    inductance: f64,
    gain: f64,
    mode: AmplifierMode,
}

impl Rigid {
    /// That of `stage`.
    pub fn of(stage: &Stage) -> Self {
        let (r, motor) = (stage.pulley_radius, &stage.motor);
        let n = motor.gear_ratio;
        let pulleys = stage.drive_pulley.inertia + n * n * motor.rotor_inertia + stage.idler_pulley.inertia;
        let [drive, cart, idler] = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];
        Self {
            mass: stage.cart.mass + pulleys / (r * r),
            driving: (stage.drive_pulley.inertia + n * n * motor.rotor_inertia) / (r * r),
            viscous: [true, false].map(|forward| {
                cart.side(forward).viscous + (drive.side(forward).viscous + idler.side(forward).viscous) / (r * r)
            }),
            coulomb: [true, false].map(|forward| {
                cart.side(forward).coulomb + (drive.side(forward).coulomb + idler.side(forward).coulomb) / r
            }),
            constant: stage.cart.constant_force(),
            force_per_ampere: n * motor.torque_constant / r,
            efficiency: motor.gear_efficiency,
            brake: n * motor.back_emf_constant / r,
            resistance: motor.resistance,
            inductance: motor.inductance,
            gain: stage.amplifier.gain,
            mode: stage.amplifier.mode,
        }
    }

    /// The command that makes the motor push with `force` (N, changing at `rate`, N/s) at `speed`, V or A.
    pub fn command(&self, force: f64, rate: f64, speed: f64) -> f64 {
        // What drives through the gear loses, what is driven holds more.
        let efficiency = if force * speed >= 0.0 { self.efficiency } else { 1.0 / self.efficiency };
        let per_ampere = self.force_per_ampere * efficiency;
        let current = force / per_ampere;
        match self.mode {
            AmplifierMode::Current => current / self.gain,
            // v = R i + L di/dt + K_e n φ̇                                        (4) with an inductance
            AmplifierMode::Voltage => {
                (self.resistance * current + self.inductance * rate / per_ampere + self.brake * speed) / self.gain
            }
        }
    }

    /// Force per command at rest, N/V or N/A.
    pub fn force_per_command(&self) -> f64 {
        1.0 / self.command(1.0, 0.0, 0.0)
    }

    /// Resistance to speed of axis and motor together, N s/m: b, and of a commanded voltage also n² K_t K_e/(R r²).
    pub fn drag(&self) -> f64 {
        self.viscous[0]
            + match self.mode {
                AmplifierMode::Current => 0.0,
                AmplifierMode::Voltage => self.force_per_ampere * self.brake / self.resistance,
            }
    }

    /// Friction of the axis at this speed, N; its viscous part and its dry part, which goes the way of `sign`.
    pub fn friction(&self, speed: f64, sign: f64) -> (f64, f64) {
        let side = usize::from(sign < 0.0);
        (self.viscous[side] * speed, self.coulomb[side] * sign)
    }
}

/// The way in which the axis goes, or is about to go: 1, −1 or 0.
pub fn direction(reference: &Reference) -> f64 {
    let sign = |value: f64| if value == 0.0 { 0.0 } else { value.signum() };
    match sign(reference.speed) {
        0.0 => sign(reference.acceleration),
        sign => sign,
    }
}

/// Feed-forward, and the reference for what the encoder sees.
#[derive(Debug, Clone)]
pub struct Compensation {
    settings: FeedForward,
    stage: Stage,
    /// The axis as one mass.
    pub rigid: Rigid,
    /// Whether the encoder sits before the belt.
    before_belt: bool,
    /// Whether it sits before the gear.
    before_gear: bool,
}

/// Pulleys that make the cart follow its reference: y₁ = r φ₁ and y₃ = r φ₃, and the force that the motor needs at the
/// belt.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Needed {
    /// Drive pulley.
    pub drive: Reference,
    /// Idler pulley, position and speed.
    pub idler: [f64; 2],
    /// N; and its rate, N/s.
    pub force: [f64; 2],
}

impl Compensation {
    /// From a model of the axis.
    pub fn new(stage: &Stage, settings: &FeedForward) -> Self {
        let at = stage.encoder.map_or(EncoderPlace::Motor, |encoder| encoder.at);
        Self {
            settings: *settings,
            stage: stage.clone(),
            rigid: Rigid::of(stage),
            before_belt: at != EncoderPlace::Cart,
            before_gear: at == EncoderPlace::Motor,
        }
    }

    /// The motion of the pulleys with which the cart follows `y`: quasi-static in the idler's own swing, exact
    /// otherwise.
    pub fn needed(&self, y: &Reference) -> Needed {
        let stage = &self.stage;
        let (r, sign) = (stage.pulley_radius, direction(y));
        let forward = sign >= 0.0;
        let &Reference { position, speed, acceleration, jerk, snap } = y;
        let [k1, k2] = match (stage.belt.make, stage.belt.follows_cart) {
            (Some(make), true) => make.stiffness_at(position),
            _ => [stage.belt.stiffness[0], stage.belt.stiffness[1]],
        };
        let k3 = stage.belt.stiffness[2];
        // L = f₁ − f₂ = M y″ + b y′ + F_c sgn y′ − F                             (17)
        let (mass, cart) = (stage.cart.mass, stage.cart.friction.side(forward));
        let load = [
            mass * acceleration + cart.viscous * speed + cart.coulomb * sign - stage.cart.constant_force(),
            mass * jerk + cart.viscous * acceleration,
            mass * snap + cart.viscous * jerk,
        ];
        // P = f₂ − f₃ = (J₂ y″/r + B₂ y′/r + τ_c2 sgn y′)/r                      (18)
        let (inertia, idler) = (stage.idler_pulley.inertia, stage.idler_pulley.friction.side(forward));
        let pull = [
            (inertia * acceleration / r + idler.viscous * speed / r + idler.coulomb * sign) / r,
            (inertia * jerk / r + idler.viscous * acceleration / r) / r,
            (inertia * snap / r + idler.viscous * jerk / r) / r,
        ];
        // With y₃ − y = (k₃ (y₁ − y) − P)/(k₂ + k₃):  y₁ − y = (L + k₂ P/(k₂ + k₃))/k,  k = k₁ + k₂ k₃/(k₂ + k₃)
        let (share, k) = (k2 / (k2 + k3), k1 + k2 * k3 / (k2 + k3));
        let stretch: [f64; 3] = std::array::from_fn(|j| match stage.belt.model {
            BeltModel::Elastic => (load[j] + share * pull[j]) / k,
            BeltModel::TwoMass => load[j] / k,
            BeltModel::Rigid => 0.0,
        });
        let behind: [f64; 2] = std::array::from_fn(|j| match stage.belt.model {
            BeltModel::Elastic => (k3 * stretch[j] - pull[j]) / (k2 + k3),
            _ => stretch[j],
        });
        let drive = Reference {
            position: position + stretch[0],
            speed: speed + stretch[1],
            acceleration: acceleration + stretch[2],
            ..*y
        };
        // τ/r = ((J₁ + n² J_r) y₁″ + B₁ y₁′)/r² + τ_c1 sgn y′/r + L + P           (16)
        let n = stage.motor.gear_ratio;
        let own = (stage.drive_pulley.inertia + n * n * stage.motor.rotor_inertia) / (r * r);
        let side = stage.drive_pulley.friction.side(forward);
        let viscous = side.viscous / (r * r);
        let force = own * drive.acceleration + viscous * drive.speed + side.coulomb * sign / r + load[0] + pull[0];
        let rate = own * jerk + viscous * drive.acceleration + load[1] + pull[1];
        Needed { drive, idler: [position + behind[0], speed + behind[1]], force: [force, rate] }
    }

    /// Where the encoder's side should be, so that the cart is where it should.
    pub fn target(&self, y: &Reference) -> Reference {
        if !(self.settings.compensate_stretch && self.before_belt) {
            return *y;
        }
        let needed = self.needed(y);
        let mut target = needed.drive;
        if let Some(play) = self.stage.motor.gear_play.filter(|_| self.before_gear) {
            // The twist of the gear: T/k_g, and half the play.
            let (r, sign) = (self.stage.pulley_radius, direction(y));
            let torque = r * needed.force[0] - self.rotor(needed.drive.acceleration);
            target.position += r * (torque / play.stiffness + 0.5 * play.backlash * sign);
        }
        target
    }

    /// Torque that the rotor itself takes at the pulley, N m.
    fn rotor(&self, acceleration: f64) -> f64 {
        let n = self.stage.motor.gear_ratio;
        n * n * self.stage.motor.rotor_inertia * acceleration / self.stage.pulley_radius
    }

    /// The command that the reference asks for, V or A.
    pub fn command(&self, y: &Reference) -> f64 {
        let (rigid, settings) = (&self.rigid, &self.settings);
        let sign = direction(y);
        let (viscous, dry) = rigid.friction(y.speed, sign);
        match settings.model {
            FeedForwardModel::None => 0.0,
            // F = M y″ + b y′ + F_c sgn y′
            FeedForwardModel::Rigid => {
                let force = settings.inertia * rigid.mass * y.acceleration + settings.friction * (viscous + dry)
                    - rigid.constant;
                let rate = settings.inertia * rigid.mass * y.jerk;
                rigid.command(force, rate, y.speed)
            }
            FeedForwardModel::Elastic => {
                let needed = self.needed(y);
                let [force, rate] = needed.force;
                let less = (1.0 - settings.friction) * (viscous + dry)
                    + (1.0 - settings.inertia) * rigid.mass * needed.drive.acceleration;
                rigid.command(force - less, rate, needed.drive.speed)
            }
        }
    }

    /// The part of friction that does not grow with speed, as a command, V or A: what a linear model does not know.
    pub fn dry(&self, y: &Reference) -> f64 {
        let (_, dry) = self.rigid.friction(0.0, direction(y));
        (dry - self.rigid.constant) / self.rigid.force_per_command()
    }
}

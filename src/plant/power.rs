//! Where the power goes.

use super::{Body, Mode, Plant, State, form::stretches, place};
use crate::stage::AmplifierMode;

/// Power at one instant, W. What comes in goes into heat or is stored: `input` = losses + `stored`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Power {
    /// Electrical power at the motor's terminals, u_a i.
    pub input: f64,
    /// Copper loss R i².
    pub copper: f64,
    /// Loss in the gear.
    pub gear: f64,
    /// Loss in the motor where torque and back-EMF constant differ: (K_e − K_t) n i φ̇₁; zero for a real motor.
    pub conversion: f64,
    /// Friction loss of drive pulley, cart, idler pulley.
    pub friction: [f64; 3],
    /// Loss in the belt's damping.
    pub belt: f64,
    /// Rate of change of kinetic, elastic and magnetic energy.
    pub stored: f64,
}

impl Power {
    /// What is left over; zero but for rounding.
    pub fn imbalance(&self) -> f64 {
        self.input
            - self.copper
            - self.gear
            - self.conversion
            - self.friction.iter().sum::<f64>()
            - self.belt
            - self.stored
    }

    /// The largest of the powers involved, to measure the imbalance against.
    pub fn scale(&self) -> f64 {
        [self.input, self.copper, self.gear, self.conversion, self.belt, self.stored]
            .iter()
            .chain(&self.friction)
            .fold(0.0, |largest: f64, power| largest.max(power.abs()))
    }
}

impl Plant {
    /// Energy stored at `state`, J: ½ J₁ φ̇₁² + ½ M ẋ² + ½ J₂ φ̇₃² + ½ J_r (n φ̇₁)² + Σ ½ k d² + ½ L i².
    pub fn energy(&self, state: &State) -> f64 {
        let stage = self.stage();
        let n = stage.motor.gear_ratio;
        let inertia = [
            stage.drive_pulley.inertia + n * n * stage.motor.rotor_inertia,
            stage.cart.mass,
            stage.idler_pulley.inertia,
        ];
        let kinetic: f64 = Body::ALL.iter().map(|b| inertia[b.index()] * state[b.speed_place()].powi(2)).sum();
        let elastic: f64 =
            stretches(stage.pulley_radius, state).iter().zip(stage.belt.stiffness).map(|(d, k)| k * d * d).sum();
        let magnetic =
            if self.has_current_state() { stage.motor.inductance * state[place::CURRENT].powi(2) } else { 0.0 };
        0.5 * (kinetic + elastic + magnetic)
    }

    /// The power balance at `state` under `input` in `mode`.
    pub fn power(&self, mode: Mode, state: &State, input: f64) -> Power {
        let stage = self.stage();
        let motor = &stage.motor;
        let n = motor.gear_ratio;
        let equations = self.equations(mode);
        let acceleration = equations.acceleration.map(|form| form.value(self, state, input));
        let speed = Body::ALL.map(|body| state[body.speed_place()]);
        let i = self.current().value(self, state, input);
        let di = equations.current_rate.value(self, state, input);
        let voltage = match stage.amplifier.mode {
            AmplifierMode::Voltage => stage.amplifier.gain * input,
            AmplifierMode::Current => motor.resistance * i + motor.back_emf_constant * n * speed[0],
        };
        // T = K_t i − J_r n φ̈₁ goes into the gear at n φ̇₁, e n T comes out at φ̇₁.
        let torque = motor.torque_constant * i - motor.rotor_inertia * n * acceleration[0];
        let e = self.gear_factor(speed[0] > 0.0, mode.gear_torque_positive);
        let r = stage.pulley_radius;
        let rate = [r * speed[0] - speed[1], speed[1] - r * speed[2], r * (speed[2] - speed[0])];
        let stretch = stretches(r, state);
        let rotor = motor.rotor_inertia * n * n;
        let kinetic = (stage.drive_pulley.inertia + rotor) * speed[0] * acceleration[0]
            + stage.cart.mass * speed[1] * acceleration[1]
            + stage.idler_pulley.inertia * speed[2] * acceleration[2];
        let elastic: f64 = (0..3).map(|j| stage.belt.stiffness[j] * stretch[j] * rate[j]).sum();
        Power {
            input: voltage * i,
            copper: motor.resistance * i * i,
            gear: (1.0 - e) * n * torque * speed[0],
            conversion: (motor.back_emf_constant - motor.torque_constant) * n * i * speed[0],
            friction: Body::ALL.map(|b| {
                speed[b.index()] * self.friction_value(b, mode.motion[b.index()], speed[b.index()], (0.0, 0.0))
            }),
            belt: (0..3).map(|j| stage.belt.damping[j] * rate[j] * rate[j]).sum(),
            stored: kinetic + elastic + motor.inductance * i * di,
        }
    }
}

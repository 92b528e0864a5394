//! Power balance.

use super::{AmplifierMode, BODIES, DRIVES, Limit, Mechanism, Mode, SPRINGS, SpringLaw, State};

/// Power balance at one instant, W: `input` + `load` = losses + `stored`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Power {
    /// Electrical power at the motors' terminals, v i.
    pub input: f64,
    /// Power of external forces on bodies: constant and piecewise linear ones.
    pub load: f64,
    /// Copper loss R i².
    pub copper: f64,
    /// Loss in the gears' efficiency.
    pub gear: f64,
    /// Loss in motors whose torque and back-EMF constant differ: (K_e − K_t) n i φ̇; zero for a real motor.
    pub conversion: f64,
    /// Friction loss of each body.
    pub friction: [f64; BODIES],
    /// Loss in each spring's damping.
    pub spring: [f64; SPRINGS],
    /// Rate of change of kinetic, elastic and magnetic energy.
    pub stored: f64,
}

impl Power {
    /// The imbalance; zero except for rounding.
    pub fn imbalance(&self) -> f64 {
        self.input + self.load
            - self.copper
            - self.gear
            - self.conversion
            - self.friction.iter().sum::<f64>()
            - self.spring.iter().sum::<f64>()
            - self.stored
    }

    /// Largest of the powers, as the scale of the imbalance.
    pub fn scale(&self) -> f64 {
        [self.input, self.load, self.copper, self.gear, self.conversion, self.stored]
            .iter()
            .chain(&self.friction)
            .chain(&self.spring)
            .fold(0.0, |largest: f64, power| largest.max(power.abs()))
    }
}

/// The strain of a spring.
#[derive(Debug, Clone, Copy, Default)]
struct Strain {
    /// Elongation that determines its force.
    way: f64,
    /// Elongation that determines its energy: zero for a slack spring that is pulled tight against its damping.
    strain: f64,
    rate: f64,
}

impl Mechanism {
    /// Inertia including that of the rotor, n² J_r.
    fn whole_inertia(&self, body: usize) -> f64 {
        let rotors = self.drives.iter().filter(|drive| !drive.has_rotor() && drive.pulley == body);
        self.bodies[body].inertia
            + rotors.map(|drive| drive.motor.gear_ratio.powi(2) * drive.motor.rotor_inertia).sum::<f64>()
    }

    /// Energy stored at `state`, J: ½ Σ J q̇² + ½ L i² and that of the springs.
    ///
    /// A spring that pushes and pulls holds ½ k s², one that only pulls t²/2k, t being its tension without damping, and
    /// nothing if slack; one that only pushes what it is pressed.
    pub fn energy(&self, state: &State) -> f64 {
        let kinetic: f64 =
            (0..self.bodies.len()).map(|body| self.whole_inertia(body) * state.speed[body].powi(2)).sum();
        let elastic: f64 =
            (0..self.springs.len()).map(|j| self.springs[j].stiffness * self.strain(j, state).strain.powi(2)).sum();
        let magnetic: f64 = (state.current.iter().enumerate())
            .filter_map(|(number, current)| Some((self.drive_of_current(number)?, current)))
            .map(|(drive, current)| self.drives[drive].motor.inductance * current.powi(2))
            .sum();
        0.5 * (kinetic + elastic + magnetic) + self.riding_energy(state)
    }

    /// Elongation of a spring, counted from the onset of its force.
    fn strain(&self, spring: usize, state: &State) -> Strain {
        let part = &self.springs[spring];
        let sum = |values: &[f64; BODIES]| part.arms.iter().map(|&(body, arm)| arm * values[body]).sum::<f64>();
        let (length, rate) = (sum(&state.position), sum(&state.speed));
        let (way, strain) = match &part.law {
            SpringLaw::TwoSided => (length, length),
            SpringLaw::Tension { pretension } => {
                let way = length + pretension / part.stiffness;
                (way, way.max(0.0))
            }
            SpringLaw::Gap { low, high } => {
                let beyond = (length - high).max(0.0) + (length - low).min(0.0);
                (beyond, beyond)
            }
            SpringLaw::Line { .. } | SpringLaw::Bounds { .. } | SpringLaw::Angle { .. } | SpringLaw::None => (0.0, 0.0),
        };
        Strain { way, strain, rate }
    }

    /// The power balance at `state` under `input` in `mode`, of a machine with brushed motors whose bridge does not
    /// yaw.
    pub fn power(&self, mode: Mode, state: &State, input: &[f64; DRIVES]) -> Power {
        let equations = self.equations(mode);
        let acceleration = equations.acceleration.map(|form| form.value(self, state, input));
        let stiffness = self.stiffness_in(&mode);
        let mut power = Power::default();
        for (body, part) in self.bodies.iter().enumerate() {
            let speed = state.speed[body];
            power.load += part.force * speed;
            power.friction[body] = speed * self.friction_value(body, mode.motion[body], speed, (0.0, 0.0));
            power.stored += self.whole_inertia(body) * speed * acceleration[body];
        }
        for (index, spring) in self.springs.iter().enumerate() {
            // Energy that a spring receives and does not store is lost in its damper, as is the energy of one that
            // separates early.
            let s = self.strain(index, state);
            let kept = spring.stiffness * s.strain;
            let force = if stiffness[index] > 0.0 { spring.stiffness * s.way + spring.damping * s.rate } else { 0.0 };
            power.stored += kept * s.rate;
            if let SpringLaw::Line { .. } = spring.law {
                power.load -= self.spring_force(index, &mode).value(self, state, input) * s.rate;
            }
            power.spring[index] = (force - kept) * s.rate;
        }
        for (index, drive) in self.drives.iter().enumerate() {
            let motor = &drive.motor;
            let n = motor.gear_ratio;
            let i = self.current(index, &mode).value(self, state, input);
            let di = equations.current_rate[self.first_current(index)].value(self, state, input);
            let shaft = state.speed[drive.shaft];
            let voltage = match (drive.amplifier.mode, mode.drive[index].current) {
                (AmplifierMode::Current | AmplifierMode::Position, _) | (_, Limit::Low | Limit::High) => {
                    motor.resistance * i + motor.inductance * di + motor.back_emf_constant * n * shaft
                }
                (AmplifierMode::Voltage, Limit::Inside) => self.voltage(index, &mode).value(self, state, input),
            };
            power.input += voltage * i;
            power.copper += motor.resistance * i * i;
            power.conversion += (motor.back_emf_constant - motor.torque_constant) * n * i * shaft;
            power.stored += motor.inductance * i * di;
            power.gear += match self.gear_spring(index) {
                None => {
                    // T = K_t i − J_r n φ̈₁ goes into the gear at n φ̇₁, e n T comes out at φ̇₁.
                    let torque = motor.torque_constant * i - motor.rotor_inertia * n * acceleration[drive.pulley];
                    let e = self.gear_factor(index, shaft > 0.0, mode.drive[index].torque_positive);
                    (1.0 - e) * n * torque * shaft
                }
                Some(spring) => {
                    // T/e goes into the gear at φ̇_r, T comes out.
                    let torque = self.spring_force(spring, &mode).value(self, state, input);
                    let positive = self.is_gear_torque_positive(index, spring, &mode);
                    (1.0 / self.gear_factor(index, shaft > 0.0, positive) - 1.0) * torque * shaft
                }
            };
        }
        power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Friction;
    use crate::mechanism::testing::{PART, body, spring};
    use crate::mechanism::{Amplifier, AmplifierMode, Body, Drive, Motor, Spring};

    /// A mass of 2 kg with friction and one of 3 kg without, between which is a damped spring.
    fn pair() -> Mechanism {
        let rough = Body { friction: Friction::symmetric(4.0, 1.0), ..body(0, 2.0) };
        let spring = Spring { damping: 5.0, ..spring(&[(0, 1.0), (1, -1.0)], 1e3) };
        Mechanism::new(vec![rough, body(1, 3.0)], vec![spring], Vec::new())
    }

    fn state(position: [f64; 2], speed: [f64; 2]) -> State {
        let mut state = State::default();
        state.position[..2].copy_from_slice(&position);
        state.speed[..2].copy_from_slice(&speed);
        state
    }

    #[test]
    fn energy_is_that_of_masses_and_spring() {
        assert_eq!(pair().energy(&State::default()), 0.0);
        // ½ 2 · 0.5² + ½ 3 · 0.2² + ½ 1000 · 0.01²
        let energy = pair().energy(&state([0.03, 0.02], [0.5, -0.2]));
        assert!((energy - (0.25 + 0.06 + 0.05)).abs() < 1e-12, "{energy}");
    }

    #[test]
    fn power_is_balanced_in_both_directions() {
        for speed in [0.5, -0.5] {
            let (pair, state) = (pair(), state([0.03, 0.02], [speed, -0.2]));
            let power = pair.power(pair.first_mode(&state), &state, &[0.0; DRIVES]);
            // b v² + F_c |v|, c ṡ²
            assert!((power.friction[0] - (4.0 * 0.25 + 0.5)).abs() < 1e-12, "{power:?}");
            assert!((power.spring[0] - 5.0 * (speed + 0.2).powi(2)).abs() < 1e-12, "{power:?}");
            assert!(power.imbalance().abs() < 1e-12, "{power:?}");
        }
    }

    /// K_e ≠ K_t: the motor's voltage takes more power than its torque gives.
    #[test]
    fn a_motor_of_two_constants_converts_power() {
        let motor = Motor { back_emf_constant: 0.07, gear_ratio: 3.0, ..Motor::brushed(0.05, 2.0) };
        let amplifier = Amplifier::ideal(AmplifierMode::Voltage, 4.0);
        let drive = Drive { label: PART, voltage: PART, current: PART, pulley: 0, shaft: 0, motor, amplifier };
        let mechanism = Mechanism::new(vec![body(0, 0.1)], Vec::new(), vec![drive]);
        let (state, mut input) = (state([0.0; 2], [8.0, 0.0]), [0.0; DRIVES]);
        input[0] = 1.5;
        let power = mechanism.power(mechanism.first_mode(&state), &state, &input);
        // i = (g u − K_e n φ̇)/R, and (K_e − K_t) n i φ̇
        let current = (4.0 * 1.5 - 0.07 * 3.0 * 8.0) / 2.0;
        assert!((power.conversion - 0.02 * 3.0 * current * 8.0).abs() < 1e-12, "{power:?}");
        assert!((power.copper - 2.0 * current * current).abs() < 1e-12, "{power:?}");
        assert!(power.imbalance().abs() < 1e-12, "{power:?}");
        assert!(power.scale() >= power.input.abs() && power.input > 0.0, "{power:?}");
    }
}

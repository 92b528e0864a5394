//! Where the power goes.

use super::form::{POSITION, TWIST, rates, stretches};
use super::{Body, Limit, Mode, Plant, ROTOR, State, place};
use crate::stage::AmplifierMode;

/// Power at one instant, W. What comes in goes into heat or is stored: `input` + `load` = losses + `stored`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Power {
    /// Electrical power at the motor's terminals, v i.
    pub input: f64,
    /// Power of the constant force on the cart.
    pub load: f64,
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
    /// Loss in the end stops.
    pub stop: f64,
    /// Rate of change of kinetic, elastic and magnetic energy.
    pub stored: f64,
}

impl Power {
    /// What is left over; zero but for rounding.
    pub fn imbalance(&self) -> f64 {
        self.input + self.load
            - self.copper
            - self.gear
            - self.conversion
            - self.friction.iter().sum::<f64>()
            - self.belt
            - self.stop
            - self.stored
    }

    /// The largest of the powers involved, to measure the imbalance against.
    pub fn scale(&self) -> f64 {
        [self.input, self.load, self.copper, self.gear, self.conversion, self.belt, self.stop, self.stored]
            .iter()
            .chain(&self.friction)
            .fold(0.0, |largest: f64, power| largest.max(power.abs()))
    }
}

impl Plant {
    /// Energy stored at `state`, J: ½ J₁ φ̇₁² + ½ M ẋ² + ½ J₂ φ̇₃² + ½ J_r (n φ̇)² + ½ L i², and what the springs hold.
    ///
    /// A span without pretension holds ½ k d², one with it t²/2k, t being its tension without damping, and nothing if slack;
    /// gear and end stops what they are pressed.
    pub fn energy(&self, state: &State) -> f64 {
        let stage = self.stage();
        let n = stage.motor.gear_ratio;
        let mut inertia = [stage.drive_pulley.inertia, stage.cart.mass, stage.idler_pulley.inertia];
        let rotor = n * n * stage.motor.rotor_inertia;
        let mut kinetic = 0.0;
        if self.has_rotor() {
            kinetic += rotor * state[place::ROTOR_SPEED].powi(2);
        } else {
            inertia[0] += rotor;
        }
        kinetic += Body::ALL.iter().map(|b| inertia[b.index()] * state[b.speed_place()].powi(2)).sum::<f64>();
        let elastic: f64 = self.springs(state).iter().map(|spring| spring.stiffness * spring.strain.powi(2)).sum();
        let magnetic =
            if self.has_current_state() { stage.motor.inductance * state[place::CURRENT].powi(2) } else { 0.0 };
        0.5 * (kinetic + elastic + magnetic)
    }

    /// What each spring is strained by at `state`, counted from where it begins to push or pull.
    fn springs(&self, state: &State) -> [Spring; 5] {
        let stage = self.stage();
        let stretch = stretches(stage.pulley_radius, state);
        let rate = rates(stage.pulley_radius, state);
        let [k, c] = self.belt();
        let mut springs = [Spring::default(); 5];
        for (j, spring) in springs.iter_mut().enumerate().take(3) {
            if self.stiffness_in(&Mode::of([crate::friction::Motion::Free; 3]))[j] == 0.0 {
                continue;
            }
            let (way, strain) = match stage.belt.pretension {
                Some(pretension) => (stretch[j] + pretension / k[j], (stretch[j] + pretension / k[j]).max(0.0)),
                None => (stretch[j], stretch[j]),
            };
            *spring = Spring { stiffness: k[j], damping: c[j], way, strain, rate: rate[j] };
        }
        let beyond = |way: f64, high: f64, low: f64| (way - high).max(0.0) + (way - low).min(0.0);
        if let Some(play) = stage.motor.gear_play {
            let strain = beyond(stretch[TWIST], 0.5 * play.backlash, -0.5 * play.backlash);
            springs[TWIST] =
                Spring { stiffness: play.stiffness, damping: play.damping, way: strain, strain, rate: rate[TWIST] };
        }
        if let Some((travel, stop)) = stage.travel.and_then(|travel| travel.stop.map(|stop| (travel, stop))) {
            let strain = beyond(stretch[POSITION], travel.max, travel.min);
            springs[POSITION] =
                Spring { stiffness: stop.stiffness, damping: stop.damping, way: strain, strain, rate: rate[POSITION] };
        }
        springs
    }

    /// The power balance at `state` under `input` in `mode`.
    pub fn power(&self, mode: Mode, state: &State, input: f64) -> Power {
        let stage = self.stage();
        let motor = &stage.motor;
        let n = motor.gear_ratio;
        let equations = self.equations(mode);
        let acceleration = equations.acceleration.map(|form| form.value(self, state, input));
        let speed = [place::DRIVE_SPEED, place::CART_SPEED, place::IDLER_SPEED, place::ROTOR_SPEED].map(|j| state[j]);
        let i = self.current(&mode).value(self, state, input);
        let di = equations.current_rate.value(self, state, input);
        let shaft = if self.has_rotor() { speed[ROTOR] } else { speed[0] };
        let voltage = match (stage.amplifier.mode, mode.current) {
            (AmplifierMode::Current, _) | (_, Limit::Low | Limit::High) => {
                motor.resistance * i + motor.inductance * di + motor.back_emf_constant * n * shaft
            }
            (AmplifierMode::Voltage, Limit::Inside) => self.voltage(&mode).value(self, state, input),
        };
        let rotor = motor.rotor_inertia * n * n;
        let mut kinetic = stage.drive_pulley.inertia * speed[0] * acceleration[0]
            + stage.cart.mass * speed[1] * acceleration[1]
            + stage.idler_pulley.inertia * speed[2] * acceleration[2];
        let springs = self.springs(state);
        let elastic: f64 = springs.iter().map(|s| s.stiffness * s.strain * s.rate).sum();
        // Whatever a spring takes up and does not keep is lost in its damper; so is all that one holds that lets go early.
        let lost = |j: usize, carries: bool| {
            let s = springs[j];
            let force = if carries { s.stiffness * s.way + s.damping * s.rate } else { 0.0 };
            (force - s.stiffness * s.strain) * s.rate
        };
        let gear = if self.has_rotor() {
            kinetic += rotor * speed[ROTOR] * acceleration[ROTOR];
            let play = motor.gear_play.is_some_and(|play| play.backlash == 0.0);
            lost(TWIST, play || mode.gear.code() != 0)
        } else {
            // T = K_t i − J_r n φ̈₁ goes into the gear at n φ̇₁, e n T comes out at φ̇₁.
            kinetic += rotor * speed[0] * acceleration[0];
            let torque = motor.torque_constant * i - motor.rotor_inertia * n * acceleration[0];
            let e = self.gear_factor(speed[0] > 0.0, mode.gear_torque_positive);
            (1.0 - e) * n * torque * speed[0]
        };
        Power {
            input: voltage * i,
            load: stage.cart.constant_force() * speed[1],
            copper: motor.resistance * i * i,
            gear,
            conversion: (motor.back_emf_constant - motor.torque_constant) * n * i * shaft,
            friction: Body::ALL.map(|b| {
                speed[b.index()] * self.friction_value(b, mode.motion[b.index()], speed[b.index()], (0.0, 0.0))
            }),
            belt: (0..3).map(|j| lost(j, !mode.slack[j])).sum(),
            stop: lost(POSITION, mode.stop.code() != 0),
            stored: kinetic + elastic + motor.inductance * i * di,
        }
    }
}

/// A spring and damper side by side.
#[derive(Debug, Clone, Copy, Default)]
struct Spring {
    stiffness: f64,
    damping: f64,
    /// What its force follows.
    way: f64,
    /// What its energy follows: nothing where a span that is not straight yet is pulled tight against its damping.
    strain: f64,
    rate: f64,
}

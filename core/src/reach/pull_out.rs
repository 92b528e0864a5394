//! The torque at which a stepper loses its field, over its speed, and the acceleration that this leaves.
//!
//! At a constant speed ω the phase currents become periodic. Where the rotor is behind the field by the electrical angle
//! δ, ψ = ε + δ, each phase gives the same mean torque, and the detents give none:
//!
//! ```text
//! T(δ) = 2 · mean over a period of −K_m i_a sin ε,   pull-out torque = max over δ of T(δ)
//! ```
//!
//! That is the torque in steady motion: a rotor that swings in its field is lost earlier.

use crate::golden;
use crate::machine::Machine;
use crate::machine::rigid::Rigid;
use crate::mechanism::Phases;
use std::f64::consts::{FRAC_PI_4, PI};

/// Steps of a period at least, and the longest one as a share of the fastest time constant.
const STEPS: f64 = 240.0;
const FINE: f64 = 0.5;

/// Angles at which the largest torque is looked for at first, and golden sections between them.
const ANGLES: usize = 24;
const SECTIONS: usize = 24;

/// Periods at most until the current repeats itself, and the share of its amplitude that it may miss by.
const PERIODS: usize = 400;
const REPEATS: f64 = 1e-7;

/// Below this number of full steps per second it is taken to be at rest.
const SLOW: f64 = 4.0;

/// Speeds between rest and the largest at which an acceleration is checked.
const SPEEDS: usize = 24;

/// A stepper and all that it moves, as one mass.
#[derive(Debug, Clone, Copy)]
pub struct PullOut {
    phases: Phases,
    rigid: Rigid,
}

impl PullOut {
    /// That of an axis with a stepper.
    pub fn of(machine: &Machine) -> Option<Self> {
        let unit = &machine.drives[0];
        Some(Self { phases: Phases::of_motor(&unit.motor, &unit.amplifier)?, rigid: Rigid::of(machine) })
    }

    /// All that moves, at the belt, kg.
    pub fn mass(&self) -> f64 {
        self.rigid.mass
    }

    /// Full steps per second at a speed of the rotor, rad/s.
    pub fn steps_per_second(&self, speed: f64) -> f64 {
        4.0 * self.phases.teeth * speed / (2.0 * PI)
    }

    /// The pull-out torque at a speed of the rotor, rad/s, N m.
    pub fn torque(&self, speed: f64) -> f64 {
        let at = |k: usize| PI * k as f64 / ANGLES as f64;
        let torques: Vec<f64> = (0..=ANGLES).map(|k| self.mean_torque(speed, at(k))).collect();
        let best = (0..=ANGLES).fold(0, |best, k| if torques[k] > torques[best] { k } else { best });
        let about = [at(best.saturating_sub(1)), at((best + 1).min(ANGLES))];
        let lead = golden::top(about, SECTIONS, |lead| self.mean_torque(speed, lead));
        self.mean_torque(speed, lead).max(torques[best]).max(0.0)
    }

    /// T(δ) at this speed, N m.
    fn mean_torque(&self, speed: f64, lead: f64) -> f64 {
        let phases = &self.phases;
        if self.steps_per_second(speed) < SLOW {
            // At rest τ = K_m (−i_a sin ε + i_b cos ε), and nothing of it changes with ε.
            let angle = -FRAC_PI_4 / phases.teeth;
            let [a, b] = phases.at_rest(angle + lead / phases.teeth);
            let free = Phases { detent_torque: 0.0, ..*phases };
            return free.torque(angle, [a, b]).0;
        }
        let period = 2.0 * PI / (phases.teeth * speed);
        let fastest = (phases.resistance / phases.inductance).max(phases.regulator.unwrap_or(0.0));
        let steps = STEPS.max((period * fastest / FINE).ceil());
        let h = period / steps;
        let rate = |time: f64, current: f64| {
            // ε is zero where time is.
            let angle = speed * time - FRAC_PI_4 / phases.teeth;
            let beyond = phases.rate(0, angle, speed, current, angle + lead / phases.teeth).value;
            beyond - phases.resistance / phases.inductance * current
        };
        let (mut current, mut torque) = (0.0, 0.0);
        for _ in 0..PERIODS {
            let before: f64 = current;
            torque = 0.0;
            for step in 0..steps as usize {
                let time = h * step as f64;
                let k1 = rate(time, current);
                let k2 = rate(time + 0.5 * h, current + 0.5 * h * k1);
                let k3 = rate(time + 0.5 * h, current + 0.5 * h * k2);
                let k4 = rate(time + h, current + h * k3);
                let next = current + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                let sine = |time: f64| (phases.teeth * speed * time).sin();
                torque -= phases.torque_constant * (current * sine(time) + next * sine(time + h)) / steps;
                current = next;
            }
            if (current - before).abs() <= REPEATS * phases.amplitude {
                break;
            }
        }
        torque
    }

    /// The largest constant acceleration, m/s², with which it goes over this way, m: half of it up and half of it down,
    /// the motor within its pull-out torque at every speed; zero where friction alone is too much.
    pub fn largest_acceleration(&self, machine: &Machine, way: f64) -> f64 {
        let r = machine.pulley_radius;
        let at_rest = (self.torque(0.0) / r - self.rigid.friction(0.0, 1.0).1) / self.rigid.mass;
        if !(at_rest > 0.0 && way > 0.0) {
            return 0.0;
        }
        let top = (at_rest * way).sqrt();
        let speeds: Vec<f64> = (0..=SPEEDS).map(|k| top * k as f64 / SPEEDS as f64).collect();
        let left = |speed: f64| {
            let (viscous, dry) = self.rigid.friction(speed, 1.0);
            (self.torque(speed / r) / r - viscous - dry - self.rigid.constant.abs()) / self.rigid.mass
        };
        let all: Vec<f64> = speeds.iter().map(|speed| left(*speed)).collect();
        // The speed v is reached with a = v²/way, if every speed up to it leaves as much.
        let mut least = f64::INFINITY;
        for (k, (speed, own)) in speeds.iter().zip(&all).enumerate() {
            let wanted = speed * speed / way;
            if least.min(*own) < wanted {
                // Between this speed and the one before, both as straight lines.
                let before = speeds[k.saturating_sub(1)];
                let (mut low, mut high) = (before, *speed);
                for _ in 0..50 {
                    let middle = 0.5 * (low + high);
                    let share = (middle - before) / (speed - before);
                    let line = all[k.saturating_sub(1)] * (1.0 - share) + own * share;
                    if least.min(line) < middle * middle / way { high = middle } else { low = middle }
                }
                return (low * low / way).max(0.0);
            }
            least = least.min(*own);
        }
        least.min(top * top / way).max(0.0)
    }
}

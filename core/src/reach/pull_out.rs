//! Pull-out torque of a stepper over speed.
//!
//! At a constant speed ω the phase currents become periodic. With the rotor behind the field by the electrical angle δ,
//! ψ = ε + δ, both phases give the same mean torque, and the detents none:
//!
//! ```text
//! T(δ) = 2 · mean over a period of −K_m i_a sin ε,   pull-out torque = max over δ of T(δ)
//! ```
//!
//! This is the torque in steady motion: an oscillating rotor loses its field earlier.
//!
//! Up to a certain speed the chopper's regulator has voltage to spare, and the currents lag by the same angle at any δ;
//! then
//!
//! ```text
//! T = T_h / √(1 + (N ω/ω_c)²)   while   (R A + K_m ω)² + (N ω L A)² ≤ V²,   A = √2 I / √(1 + (N ω/ω_c)²)
//! ```

use crate::golden;
use crate::machine::{DriveUnit, Machine};
use crate::mechanism::Phases;
use crate::number::engineering;
use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::{Arc, Mutex, PoisonError};

/// Least number of steps in a period, and the longest step as a fraction of the fastest time constant.
const STEPS: f64 = 240.0;
const FINE: f64 = 0.5;

/// Initial grid of angles in the search for the largest torque up to the largest angle, rad, and golden sections
/// between them.
///
/// With R ≪ N ω L the current lags behind the voltage by a quarter of a period, so that the torque is largest near δ =
/// π; the voltage of a regulator at its limit lags behind the field by up to another quarter.
const ANGLES: usize = 18;
const MOST_ANGLE: f64 = 1.5 * PI;
const SECTIONS: usize = 16;

/// Maximum number of half periods until the current is periodic, and its tolerance relative to the amplitude.
const HALVES: usize = 800;
const REPEATS: f64 = 1e-7;

/// Below this number of full steps per second it is taken to be at rest.
const SLOW: f64 = 4.0;

/// Number of intervals of a [`Curve`] up to the speed at which resistance equals reactance, where it bends.
const BELOW: usize = 8;

/// Number of speeds of a [`Curve`] beyond the one up to which the regulator has voltage to spare, and the largest as a
/// multiple of that.
const KEPT: usize = 16;
const FASTEST: f64 = 32.0;

/// Pull-out torque of a stepper over its speed, from a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    phases: Phases,
    /// rad/s, the first zero.
    speeds: Vec<f64>,
    /// N m
    torques: Vec<f64>,
}

/// Latest curves, since a search needs those of the same motors repeatedly.
static KNOWN: Mutex<Vec<Arc<Curve>>> = Mutex::new(Vec::new());
const REMEMBERED: usize = 64;

impl Curve {
    /// Curve of a motor with its driver; none unless it is a stepper.
    pub fn from_unit(unit: &DriveUnit) -> Option<Arc<Self>> {
        let phases = Phases::of_motor(&unit.motor, &unit.amplifier)?;
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(curve) = known.iter().find(|curve| curve.phases == phases) {
            return Some(curve.clone());
        }
        let curve = Arc::new(Self::new(phases));
        if known.len() == REMEMBERED {
            known.remove(0);
        }
        known.push(curve.clone());
        Some(curve)
    }

    fn new(phases: Phases) -> Self {
        let corner = corner(&phases);
        // Up to the corner a regulator needs no table.
        let below = if phases.regulator.is_some() { 1 } else { BELOW };
        let before = (0..below).map(|k| corner * k as f64 / below as f64);
        let beyond = (0..=KEPT).map(|k| corner * FASTEST.powf(k as f64 / KEPT as f64));
        let speeds: Vec<f64> = before.chain(beyond).collect();
        let torques = speeds.iter().map(|speed| torque(&phases, *speed)).collect();
        Self { phases, speeds, torques }
    }

    /// Torque, N m, at a speed, rad/s; zero beyond the last speed.
    pub fn torque(&self, speed: f64) -> f64 {
        let speed = speed.abs();
        if let Some(torque) = regulated(&self.phases, speed) {
            return torque;
        }
        let next = self.speeds.partition_point(|own| *own <= speed);
        let (Some(last), Some(after)) = (next.checked_sub(1), self.speeds.get(next)) else { return 0.0 };
        let share = (speed - self.speeds[last]) / (after - self.speeds[last]);
        self.torques[last] + share * (self.torques[next] - self.torques[last])
    }
}

/// A stepper, for its pull-out torque at any speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullOut {
    phases: Phases,
}

impl PullOut {
    /// The motor of the first drive of a machine with steppers.
    pub fn new(machine: &Machine) -> Option<Self> {
        let unit = &machine.drives[0];
        Some(Self { phases: Phases::of_motor(&unit.motor, &unit.amplifier)? })
    }

    /// Full steps per second at a speed of the rotor, rad/s.
    pub fn steps_per_second(&self, speed: f64) -> f64 {
        steps_per_second(&self.phases, speed)
    }

    /// The pull-out torque at a speed of the rotor, rad/s, N m.
    pub fn torque(&self, speed: f64) -> f64 {
        torque(&self.phases, speed)
    }
}

/// What the supply of a chopper lacks for the rated current at rest, in a sentence with what to do; none if it
/// suffices.
///
/// Phases at the commanded current √2 I need √2 R I. Full steps command ±I in both phases, which need R I.
pub fn short_supply(machine: &Machine) -> Option<String> {
    let unit = &machine.drives[0];
    let (stepper, phases) = (unit.motor.stepper?, Phases::of_motor(&unit.motor, &unit.amplifier)?);
    phases.regulator?;
    let is_full = stepper.microsteps == 1.0 && !stepper.interpolate;
    let (peak, words) = match is_full {
        true => (stepper.rated_current, "rated current times resistance"),
        false => (phases.amplitude, "√2 times rated current and resistance"),
    };
    let needed = phases.resistance * peak;
    let [supply, needed] = match phases.supply < needed * (1.0 - 1e-6) {
        true => [phases.supply, needed].map(|volts| engineering(volts, "V", 4)),
        false => return None,
    };
    Some(format!(
        "the supply of {supply} is below the {needed} that the rated current needs at rest, {words}: phase currents and \
         torque stay below the rated ones; raise stepper.supply, or lower rated_current and with it holding_torque"
    ))
}

/// Largest speed of the rotor of a stepper, rad/s, at which it counts as having torque; none for other motors.
pub fn fastest(unit: &DriveUnit) -> Option<f64> {
    Phases::of_motor(&unit.motor, &unit.amplifier).map(|phases| FASTEST * corner(&phases))
}

/// Speed of the rotor, rad/s, up to which the regulator has voltage to spare. A driver that sets the voltage has no
/// such speed; the speed at which resistance equals reactance is used instead.
fn corner(phases: &Phases) -> f64 {
    if phases.regulator.is_none() {
        return phases.resistance / phases.inductance / phases.teeth;
    }
    // At the speed where the back-EMF equals the supply, no voltage is left.
    let (mut low, mut high) = (0.0, phases.supply / phases.torque_constant);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if regulated(phases, middle).is_some() { low = middle } else { high = middle }
    }
    high
}

/// The pull-out torque at a speed of the rotor, rad/s, N m.
fn torque(phases: &Phases, speed: f64) -> f64 {
    if let Some(torque) = regulated(phases, speed) {
        return torque;
    }
    let at = |k: usize| MOST_ANGLE * k as f64 / ANGLES as f64;
    let half = HalfPeriod::new(phases, speed);
    // The current at one angle is a good start for the next.
    let mut current = 0.0;
    let mut torque = |lead: f64| mean_torque(phases, half.as_ref(), lead, &mut current);
    let torques: Vec<f64> = (0..=ANGLES).map(|k| torque(at(k))).collect();
    let best = (0..=ANGLES).fold(0, |best, k| if torques[k] > torques[best] { k } else { best });
    let about = [at(best.saturating_sub(1)), at((best + 1).min(ANGLES))];
    let lead = golden::top(about, SECTIONS, &mut torque);
    torque(lead).max(torques[best]).max(0.0)
}

/// Pull-out torque, N m, at a speed, rad/s, up to which the regulator of a chopper has voltage to spare; none beyond.
fn regulated(phases: &Phases, speed: f64) -> Option<f64> {
    let electrical = phases.teeth * speed.abs();
    let falls = (1.0 + (electrical / phases.regulator?).powi(2)).sqrt();
    let amplitude = phases.amplitude / falls;
    let resisting = phases.resistance * amplitude + phases.torque_constant * speed.abs();
    let voltage = resisting.hypot(electrical * phases.inductance * amplitude);
    (voltage <= phases.supply).then_some(phases.torque_constant * amplitude)
}

/// Sine and cosine of the rotor's electrical angle over half a period at a constant speed, at the ends and in the
/// middle of each step of the integration.
struct HalfPeriod {
    /// rad/s
    speed: f64,
    /// Length of a step, s.
    step: f64,
    angles: Vec<[f64; 2]>,
}

impl HalfPeriod {
    /// None at rest.
    fn new(phases: &Phases, speed: f64) -> Option<Self> {
        if steps_per_second(phases, speed) < SLOW {
            return None;
        }
        let half = PI / (phases.teeth * speed);
        let fastest = (phases.resistance / phases.inductance).max(phases.regulator.unwrap_or(0.0));
        let steps = (0.5 * STEPS).max((half * fastest / FINE).ceil());
        let angle = |k: usize| (PI * k as f64 / (2.0 * steps)).sin_cos();
        Some(Self { speed, step: half / steps, angles: (0..=2 * steps as usize).map(|k| angle(k).into()).collect() })
    }

    /// The phase current after half a period, A, and the mean torque of both phases in it, N m, with the field ahead by
    /// the electrical angle `lead`, rad.
    fn run(&self, phases: &Phases, lead: f64, mut current: f64) -> (f64, f64) {
        let (h, decay, (sin_lead, cos_lead)) = (self.step, phases.resistance / phases.inductance, lead.sin_cos());
        let rate = |k: usize, current: f64| {
            // ψ = ε + δ
            let along = self.angles[k][1] * cos_lead - self.angles[k][0] * sin_lead;
            phases.rate_at(self.angles[k], along, self.speed, current).value - decay * current
        };
        let mut sum = 0.0;
        for k in (0..self.angles.len() - 1).step_by(2) {
            let k1 = rate(k, current);
            let k2 = rate(k + 1, current + 0.5 * h * k1);
            let k3 = rate(k + 1, current + 0.5 * h * k2);
            let k4 = rate(k + 2, current + h * k3);
            let next = current + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            sum += current * self.angles[k][0] + next * self.angles[k + 2][0];
            current = next;
        }
        // 2 · mean of −K_m i sin ε, by trapezia
        (current, -phases.torque_constant * sum / (0.5 * (self.angles.len() - 1) as f64))
    }
}

/// T(δ) at this speed, N m; the phase current at the end of the last period, A, is the start of the next call.
fn mean_torque(phases: &Phases, half: Option<&HalfPeriod>, lead: f64, begin: &mut f64) -> f64 {
    let Some(half) = half else {
        // At rest τ = K_m (−i_a sin ε + i_b cos ε) does not depend on ε.
        let angle = -FRAC_PI_4 / phases.teeth;
        let [a, b] = phases.at_rest(angle + lead / phases.teeth);
        let free = Phases { detent_torque: 0.0, ..*phases };
        return free.torque(angle, [a, b]).0;
    };
    // The second half is the first with the other sign, so the current is a fixed point of c ↦ −i(T/2).
    let (mut before, mut torque): (Option<[f64; 2]>, f64) = (None, 0.0);
    for _ in 0..HALVES {
        let start = *begin;
        let (end, own) = half.run(phases, lead, start);
        (*begin, torque) = (-end, own);
        if (*begin - start).abs() <= REPEATS * phases.amplitude {
            break;
        }
        // The map is nearly linear: a secant step from two evaluations.
        if let Some([first, image]) = before.take() {
            let slope = (*begin - image) / (start - first);
            if slope.abs() < 1.0 {
                *begin = start + (*begin - start) / (1.0 - slope);
            }
        } else {
            before = Some([start, *begin]);
        }
    }
    torque
}

/// Full steps per second at a speed of the rotor, rad/s.
fn steps_per_second(phases: &Phases, speed: f64) -> f64 {
    4.0 * phases.teeth * speed / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHASES: Phases = Phases {
        teeth: 50.0,
        torque_constant: 0.16,
        detent_torque: 0.0,
        resistance: 1.4,
        inductance: 3e-3,
        supply: 24.0,
        amplitude: 2.83,
        regulator: Some(2.0 * PI * 1e4),
    };

    /// The closed form is the largest mean torque of the integrated currents.
    #[test]
    fn a_regulator_with_voltage_left_gives_the_torque_of_its_integrated_currents() {
        for speed in [5.0, 20.0, 25.0] {
            let closed = regulated(&PHASES, speed).unwrap();
            let leads = (0..200).map(|k| PI * f64::from(k) / 200.0);
            let half = HalfPeriod::new(&PHASES, speed);
            let most = leads.map(|lead| mean_torque(&PHASES, half.as_ref(), lead, &mut 0.0)).fold(0.0, f64::max);
            assert!((closed / most - 1.0).abs() < 2e-4, "{speed} rad/s: {closed} N m, integrated {most} N m");
        }
    }

    /// Only angles up to π were searched: at 32,000 steps per second the torque was 7 % too low.
    #[test]
    fn at_the_highest_speeds_the_torque_is_largest_beyond_half_a_period() {
        let speed = 32e3 / 4.0 * 2.0 * PI / PHASES.teeth;
        let leads = (0..400).map(|k| 2.0 * PI * f64::from(k) / 400.0);
        let (half, mut current) = (HalfPeriod::new(&PHASES, speed), 0.0);
        let torques = leads.map(|lead| (lead, mean_torque(&PHASES, half.as_ref(), lead, &mut current)));
        let (lead, most) = torques.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        let found = torque(&PHASES, speed);
        assert!(lead > PI && (found / most - 1.0).abs() < 1e-3, "{found} N m, {most} N m at {lead} rad");
    }

    #[test]
    fn between_its_speeds_a_curve_is_near_the_torque() {
        for phases in [PHASES, Phases { regulator: None, supply: 3.9, ..PHASES }] {
            let curve = Curve::new(phases);
            for speed in [2.0, 3.0, 4.5, 7.0, 30.0, 47.0, 80.0, 111.0, 160.0] {
                let (near, exact) = (curve.torque(speed), torque(&phases, speed));
                assert!((near - exact).abs() < 0.02 * exact, "{speed}: {near}, {exact}");
            }
        }
    }
}

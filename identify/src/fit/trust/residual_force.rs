//! Residual force: the additional force on the cart with which the model would follow the log.
//!
//! With the position error e of the cart, log minus model, the total mass M and the total viscous friction b at the
//! cart,
//!
//! ```text
//! ΔF = M ë + b ė
//! ```
//!
//! It is plotted over position, speed, force of the motor and time: the first shows friction that changes along the
//! travel, the second another law, the third a gain and the last a drift.

use super::scores::LogFit;
use crate::fit::limits::{CART_AT_REST, RESIDUAL_FORCE_NOISE, WIDTHS};
use crate::fit::search::regression::{derived, reach};
use crate::log::Quantity;
use crate::machine::{AmplifierMode, Machine};
use crate::parameter::{Sum, at_pulley, value};

/// Residual force along a log.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct ResidualForce {
    /// s.
    pub time: Vec<f64>,
    /// Position of the cart, m.
    pub position: Vec<f64>,
    /// Its speed, m/s.
    pub speed: Vec<f64>,
    /// Force of the motor on the cart, N.
    pub drive: Vec<f64>,
    /// The missing force, N.
    pub force: Vec<f64>,
}

impl ResidualForce {
    /// Adds the residual force of another log.
    pub fn join(&mut self, other: &Self) {
        let pairs = [
            (&mut self.time, &other.time),
            (&mut self.position, &other.position),
            (&mut self.speed, &other.speed),
            (&mut self.drive, &other.drive),
            (&mut self.force, &other.force),
        ];
        for (own, other) in pairs {
            own.extend_from_slice(other);
        }
    }
}

/// The force that `machine` lacks for a log of an axis; `None` without an evenly sampled position, or if the model does
/// not reach the end.
pub fn residual_force(machine: &Machine, log: &LogFit) -> Option<ResidualForce> {
    let is_known = log.complete && machine.has_torque_balance();
    let output = log.outputs.iter().find(|output| output.quantity.is_position()).filter(|_| is_known)?;
    let n = log.time.len();
    let h = (log.time.last()? - log.time.first()?) / (n.max(2) - 1) as f64;
    let is_even = log.time.iter().enumerate().all(|(k, t)| (t - log.time[0] - k as f64 * h).abs() < 0.05 * h);
    if n < 60 || !is_even || output.seen.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let r = machine.pulley_radius;
    let arm = if output.quantity == Quantity::CartPosition { 1.0 } else { r };
    let way: Vec<f64> = output.seen.iter().map(|v| arm * v).collect();
    let error: Vec<f64> = output.seen.iter().zip(&output.model).map(|(seen, model)| arm * (seen - model)).collect();
    let total = |sum: Sum| -> f64 {
        sum.parts(true).map(|row| value(machine, row.key).unwrap_or(0.0) * at_pulley(machine, row.key)).sum::<f64>()
            / (r * r)
    };
    let (motor, amplifier) = (&machine.drives[0].motor, &machine.drives[0].amplifier);
    let gear = motor.gear_ratio;
    let brake = match amplifier.mode {
        AmplifierMode::Voltage => {
            gear * gear * motor.torque_constant * motor.back_emf_constant / motor.resistance / (r * r)
        }
        AmplifierMode::Current | AmplifierMode::Position => 0.0,
    };
    let (mass, viscous) = (total(Sum::Inertia), total(Sum::Viscous) + brake);
    // Third differences of noise have √20 times its deviation.
    let mut third: Vec<f64> = error.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    let middle = third.len() / 2;
    let noise = 1.4826 * *third.select_nth_unstable_by(middle, f64::total_cmp).1 / 20f64.sqrt();
    let mut found = None;
    for width in WIDTHS {
        let Some(slopes) = derived(&error, width, h) else { break };
        let force: Vec<f64> =
            slopes.iter().map(|[speed, acceleration]| mass * acceleration + viscous * speed).collect();
        let size = (force.iter().map(|f| f * f).sum::<f64>() / force.len() as f64).sqrt();
        // Deviation of white noise behind the second derivative of a Gaussian: σ √(3/(8 √π)) / w^(5/2), per interval
        // squared
        let trembles = mass * noise * (3.0 / (8.0 * std::f64::consts::PI.sqrt())).sqrt() / width.powf(2.5) / (h * h);
        found = Some((width, force));
        if trembles < RESIDUAL_FORCE_NOISE * size {
            break;
        }
    }
    let (width, force) = found?;
    let motion = derived(&way, width, h)?;
    let margin = reach(width);
    let fastest = motion.iter().map(|[speed, _]| speed.abs()).fold(0.0, f64::max);
    let per_input = motor.gear_efficiency * gear * motor.torque_constant * amplifier.gain / r
        * if amplifier.mode == AmplifierMode::Voltage { 1.0 / motor.resistance } else { 1.0 };
    let mut all = ResidualForce::default();
    for (k, ([speed, _], force)) in motion.iter().zip(&force).enumerate() {
        let row = k + margin;
        if speed.abs() < CART_AT_REST * fastest {
            continue;
        }
        all.time.push(log.time[row]);
        all.position.push(way[row]);
        all.speed.push(*speed);
        all.drive.push(per_input * log.inputs[0][row] - brake * speed);
        all.force.push(*force);
    }
    Some(all)
}

//! Gains that a message suggests: in the unit of the case, and of a loop with room to spare.

use crate::design::placement::{first, place};
use crate::design::{Design, FeedForward, Pid, Structure};
use crate::machine::rigid::Rigid;
use crate::machine::{Machine, slowest_swing};
use std::f64::consts::PI;

/// Sample time where none is given, s, and how it is written.
const EVERY: (f64, &str) = (1e-3, "1 ms");

/// Damping ratio that gains are placed for, and the share of the slowest swing that counts: a loop with room to spare.
const DAMPING: f64 = 0.8;
const BELOW: f64 = 0.5;

/// Highest loop gain at a resonance, where delay and filter may turn the phase by any angle.
const AT_RESONANCE: f64 = 0.4;

/// Least share of the bandwidth that the slowest swing allows, for an axis that nothing damps.
const LEAST: f64 = 0.1;

/// Inertia of a held pulley, as a multiple of that of the whole axis: large enough that the relative motion of two such
/// pulleys on their belts is negligible.
const HELD: f64 = 1e12;

/// A PID controller for an axis, as a case file has it.
pub(super) fn pid(machine: &Machine, every: f64, delay: f64) -> String {
    let Pid { proportional, integral, derivative, .. } = gains(machine, every, delay);
    if machine.stepper().is_some() {
        return format!(
            "pid = {{ proportional = {}, integral = \"{} 1/s\", derivative = \"{} ms\" }}",
            two(proportional),
            two(integral),
            two(1e3 * derivative)
        );
    }
    let unit = unit(machine);
    format!(
        "pid = {{ proportional = \"{} {unit}/mm\", integral = \"{} {unit}/(mm s)\", derivative = \"{} {unit} s/m\" }}",
        two(1e-3 * proportional),
        two(1e-3 * integral),
        two(derivative)
    )
}

/// A whole controller for an axis, as keys of `[controller]`.
pub(super) fn controller(machine: &Machine) -> String {
    format!("every = \"{}\" and {}", EVERY.1, pid(machine, EVERY.0, 0.0))
}

/// The derivative of a PID controller of this axis, as a case file has it.
pub(crate) fn derivative(machine: &Machine, every: f64, delay: f64) -> String {
    let value = gains(machine, every, delay).derivative;
    match machine.stepper() {
        Some(_) => format!("derivative = \"{} ms\"", two(1e3 * value)),
        None => format!("derivative = \"{} {} s/m\"", two(value), unit(machine)),
    }
}

/// The proportional gain, as a case file has it.
pub(super) fn proportional(machine: &Machine, every: f64, delay: f64) -> String {
    let value = gains(machine, every, delay).proportional;
    match machine.stepper() {
        Some(_) => format!("proportional = {}", two(value)),
        None => format!("proportional = \"{} {}/mm\"", two(1e-3 * value), unit(machine)),
    }
}

fn unit(machine: &Machine) -> &'static str {
    machine.drives[0].amplifier.mode.unit()
}

/// Gains for a bandwidth well below the slowest mode and what sampling, delay and derivative filter allow; default
/// gains for an axis without a mode.
fn gains(machine: &Machine, every: f64, delay: f64) -> Pid {
    let ordinary = Pid {
        // The field of a stepper already holds the rotor.
        proportional: if machine.stepper().is_some() { 0.1 } else { 2000.0 },
        integral: 2e4,
        derivative: 25.0,
        filter: 200.0,
        reference_speed: 1.0,
        tracking: 0.05,
    };
    let start = Design {
        every,
        // T_f = 1/(2π f)
        delay: delay + 1.0 / (2.0 * PI * ordinary.filter),
        limit: None,
        structure: Structure::Pid(ordinary),
        feed_forward: FeedForward::NONE,
        disturbance_observer: None,
        filters: Vec::new(),
        shaper: Vec::new(),
    };
    let most = first(&start, antiresonance(machine).map(|swing| BELOW * swing));
    let hertz = match antiresonance(machine) {
        Some(_) => most.min(damped(machine).max(LEAST * most)),
        None => most,
    };
    match place(&start, machine, hertz, DAMPING) {
        Some(Design { structure: Structure::Pid(placed), .. }) => placed,
        _ => ordinary,
    }
}

/// The bandwidth up to which no resonance of the belt raises the loop gain above [`AT_RESONANCE`], Hz.
///
/// At a resonance the speed of the drive pulley per force on it is at most 1/d₁ with its own drag d₁, so the derivative
/// g K_d = 3 ζ ω₀ M − d may be at most `AT_RESONANCE` d₁.
fn damped(machine: &Machine) -> f64 {
    let rigid = Rigid::new(machine);
    let idle = rigid.viscous[0] - machine.drive_pulley.friction.side(true).viscous / machine.pulley_radius.powi(2);
    let own = rigid.drag() - idle;
    (AT_RESONANCE * own + rigid.drag()) / (3.0 * DAMPING * rigid.mass) / (2.0 * PI)
}

/// The slowest swing of cart and idler pulley with the motor held, Hz; none of a belt that does not stretch.
fn antiresonance(machine: &Machine) -> Option<f64> {
    let mut held = machine.clone();
    held.drive_pulley.inertia = HELD * Rigid::new(machine).mass * machine.pulley_radius.powi(2);
    slowest_swing(&held.mechanism()).map(|swing| swing / (2.0 * PI))
}

/// With two digits.
fn two(value: f64) -> f64 {
    if value.is_finite() { format!("{value:.1e}").parse().unwrap_or(value) } else { value }
}

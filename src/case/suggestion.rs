//! Gains that a message suggests: in the unit of the case, and of a loop with room to spare.

use crate::design::placement::{first, place};
use crate::design::{Design, FeedForward, Pid, Structure};
use crate::stage::rigid::Rigid;
use crate::stage::{AmplifierMode, Stage, slowest_swing};
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

/// Inertia of a pulley that is held, as a multiple of the whole axis'.
const HELD: f64 = 1e6;

/// A PID controller for an axis, as a case file has it.
pub(super) fn pid(stage: &Stage, every: f64, delay: f64) -> String {
    let Pid { proportional, integral, derivative, .. } = gains(stage, every, delay);
    let unit = unit(stage);
    format!(
        "pid = {{ proportional = \"{} {unit}/mm\", integral = \"{} {unit}/(mm s)\", derivative = \"{} {unit} s/m\" }}",
        two(1e-3 * proportional),
        two(1e-3 * integral),
        two(derivative)
    )
}

/// A whole controller for an axis, as keys of `[controller]`.
pub(super) fn controller(stage: &Stage) -> String {
    format!("every = \"{}\" and {}", EVERY.1, pid(stage, EVERY.0, 0.0))
}

/// The derivative of a PID controller of this axis, as a case file has it.
pub(crate) fn derivative(stage: &Stage, every: f64, delay: f64) -> String {
    format!("derivative = \"{} {} s/m\"", two(gains(stage, every, delay).derivative), unit(stage))
}

/// The proportional gain, as a case file has it.
pub(super) fn proportional(stage: &Stage, every: f64, delay: f64) -> String {
    format!("proportional = \"{} {}/mm\"", two(1e-3 * gains(stage, every, delay).proportional), unit(stage))
}

fn unit(stage: &Stage) -> &'static str {
    if stage.amplifier.mode == AmplifierMode::Current { "A" } else { "V" }
}

/// Gains placed well below the slowest swing and what sampling, delay and the derivative's filter allow; ordinary ones for
/// an axis that has none.
fn gains(stage: &Stage, every: f64, delay: f64) -> Pid {
    let ordinary = Pid {
        proportional: 2000.0,
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
    let most = first(&start, antiresonance(stage).map(|swing| BELOW * swing));
    let hertz = match antiresonance(stage) {
        Some(_) => most.min(damped(stage).max(LEAST * most)),
        None => most,
    };
    match place(&start, stage, hertz, DAMPING) {
        Some(Design { structure: Structure::Pid(placed), .. }) => placed,
        _ => ordinary,
    }
}

/// The bandwidth up to which no resonance of the belt raises the loop gain above [`AT_RESONANCE`], Hz.
///
/// At a resonance the speed of the drive pulley per force on it is at most 1/d₁ with its own drag d₁, so the derivative
/// g K_d = 3 ζ ω₀ M − d may be at most `AT_RESONANCE` d₁.
fn damped(stage: &Stage) -> f64 {
    let rigid = Rigid::of(stage);
    let idle = rigid.viscous[0] - stage.drive_pulley.friction.side(true).viscous / stage.pulley_radius.powi(2);
    let own = rigid.drag() - idle;
    (AT_RESONANCE * own + rigid.drag()) / (3.0 * DAMPING * rigid.mass) / (2.0 * PI)
}

/// The slowest swing of cart and idler pulley with the motor held, Hz; none of a belt that does not stretch.
fn antiresonance(stage: &Stage) -> Option<f64> {
    let mut held = stage.clone();
    held.drive_pulley.inertia = HELD * Rigid::of(stage).mass * stage.pulley_radius.powi(2);
    slowest_swing(&held.mechanism()).map(|swing| swing / (2.0 * PI))
}

/// With two digits.
fn two(value: f64) -> f64 {
    if value.is_finite() { format!("{value:.1e}").parse().unwrap_or(value) } else { value }
}

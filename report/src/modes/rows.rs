//! A linear analysis in words.

use nalgebra::Complex;
use std::f64::consts::PI;
use taut::linear::{Analysis, ElasticMode, Natural, RigidMode, Root, Transfer};
use taut::machine::BeltModel;
use taut::mechanism::Mechanism;
use taut::number::{engineering_typed, fixed};

/// A name without underscores.
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A root: where it is, and what that means.
pub fn pole(root: Root) -> (String, String) {
    match root {
        Root::Zero => ("0".into(), "integrator".into()),
        Root::Real(s) => (
            format!("{} 1/s", plain(s)),
            format!("{} {}", if s < 0.0 { "time constant" } else { "grows, doubling and more in" }, time(root)),
        ),
        Root::Pair { frequency, damping } => (
            format!("{} Hz ({} rad/s)", plain(frequency / (2.0 * PI)), plain(frequency)),
            format!(
                "damping {}, {} {}, damped frequency {} Hz",
                plain(shown_damping(damping)),
                if shown_damping(damping) >= 0.0 { "time constant" } else { "grows in" },
                time(root),
                plain(root.damped_hertz().unwrap_or(0.0))
            ),
        ),
    }
}

/// A damping ratio without the rounding of an undamped mode.
fn shown_damping(damping: f64) -> f64 {
    if damping.abs() < 1e-12 { 0.0 } else { damping }
}

fn time(root: Root) -> String {
    match root.time_constant() {
        t if t.is_finite() && t < 1e12 => engineering_typed(t, "s", 4),
        _ => "infinite".into(),
    }
}

/// Five digits.
fn plain(value: f64) -> String {
    engineering_typed(value, "", 5)
}

/// The gain of an output in the long run.
pub fn gain(transfer: &Transfer, unit: &str, input: &str) -> String {
    let (order, gain) = transfer.low_frequency();
    // A unit with a blank or a slash goes in front, so that it cannot be misread.
    let value = |gain: f64, unit: &str| format!("{} per {input}", engineering_typed(gain, unit, 5));
    match order {
        _ if transfer.zeros.gain == 0.0 => "the input does not reach it".into(),
        0 => format!("DC gain {}", value(gain, unit)),
        1 => format!("integrates: {}", value(gain, &rate(unit))),
        2 => format!("integrates twice: {}", value(gain, &rate(&rate(unit)))),
        n if n < 0 => "DC gain 0: it answers changes alone".into(),
        n => format!("integrates {n} times: {} per s^{n}", value(gain, unit)),
    }
}

fn rate(unit: &str) -> String {
    match unit.strip_suffix("/s") {
        Some(before) => format!("{before}/s^2"),
        None => format!("{unit}/s"),
    }
}

/// The zeros of an output in a line.
pub fn zeros(transfer: &Transfer) -> String {
    let one = |root: Root| match root {
        Root::Zero => "0".into(),
        Root::Real(s) => format!("{} 1/s", plain(s)),
        Root::Pair { frequency, damping } => {
            format!(
                "{} Hz (damping {})",
                plain(frequency / (2.0 * PI)),
                engineering_typed(shown_damping(damping), "", 3)
            )
        }
    };
    Root::from_values(&transfer.zeros.values).into_iter().map(one).collect::<Vec<_>>().join(", ")
}

/// A point of the z plane; of a pair both.
pub fn z(value: &Complex<f64>) -> String {
    match value.im {
        0.0 => engineering_typed(value.re, "", 6),
        im => format!("{} ± {}j", engineering_typed(value.re, "", 6), engineering_typed(im, "", 6)).replace('±', "+/-"),
    }
}

/// The body of a rigid mode, and how the others go with it.
pub fn rigid(mechanism: &Mechanism, modes: &Natural, mode: &RigidMode) -> (&'static str, String) {
    let others = modes.bodies.iter().zip(&mode.shape).filter(|(body, _)| **body != mode.body);
    let way = |(body, way): (&usize, &f64)| {
        let body = &mechanism.bodies[*body];
        match way {
            0.0 => format!("{} 0", body.label.name),
            way => format!("{} {} {}", body.label.name, fixed(*way, 2), body.kind.units()[0]),
        }
    };
    let body = &mechanism.bodies[mode.body];
    let ways: Vec<String> = others.map(way).collect();
    let ways = if ways.is_empty() { "all that moves".into() } else { ways.join(", ") };
    (body.label.name, format!("per {}: {ways}", body.kind.units()[0]))
}

/// Frequency without damping, damping, shape and energy of an elastic mode.
pub fn elastic(mechanism: &Mechanism, modes: &Natural, mode: &ElasticMode) -> [String; 4] {
    let damping = match mode.damped {
        Some(root @ Root::Pair { damping, .. }) => format!(
            "damping {}, time constant {}, damped frequency {} Hz",
            engineering_typed(shown_damping(damping), "", 4),
            time(root),
            plain(root.damped_hertz().unwrap_or(0.0))
        ),
        _ => "damped so much that not every mode oscillates".into(),
    };
    let name = |body: usize| mechanism.bodies[body].label.name;
    let bodies = || modes.bodies.iter().copied();
    let shape: Vec<String> =
        bodies().zip(&mode.shape).map(|(body, way)| format!("{} {}", name(body), fixed(*way, 3))).collect();
    let mut shares: Vec<(usize, f64)> = bodies().zip(mode.energy.iter().copied()).collect();
    // Alike ones stay in the order of the bodies.
    shares.sort_by(|a, b| (b.1 * 1e6).round().total_cmp(&(a.1 * 1e6).round()));
    let shares = shares.iter().filter(|(_, share)| *share >= 0.005);
    let energy: Vec<String> =
        shares.map(|(body, share)| format!("{} {} %", name(*body), fixed(100.0 * share, 0))).collect();
    [
        format!("{} Hz", plain(mode.hertz())),
        damping,
        format!("mode shape at the belt: {}", shape.join(", ")),
        format!("energy: {}", energy.join(", ")),
    ]
}

/// Sentence on the dependence of stiffness and resonances on the position.
pub fn where_it_matters(analysis: &Analysis) -> &'static str {
    let belt = &analysis.case.machine.belt;
    match analysis.case.machine.bridge.is_some() {
        _ if belt.model == BeltModel::Rigid => "a rigid belt has no spans that could change with the position",
        false if belt.following().is_some() => {
            "spans 1 and 2 follow the cart: k = A E / l with the length that is left"
        }
        true if belt.following().is_some() => {
            "the spans follow bridge and cart: k = A E / l with the length that is left"
        }
        true if analysis.case.machine.yaw.is_some() => {
            "the bridge yaws, and its inertia changes with the cart's position: --bridge and --at name a place, and with \
             the travel of both there is a map"
        }
        false if belt.make.is_some() => {
            "the same along the travel: this file's stiffness does not depend on the position \
             (belt.follows_cart = true makes spans 1 and 2 follow the cart)"
        }
        false => {
            "the same along the travel: this file gives the spans' stiffness as such \
             (belt.modulus, section, spans and follows_cart = true make them follow the cart)"
        }
        true => {
            "the same everywhere: in this file the spans' stiffness does not depend on the place \
             (belt.modulus, section, spans and follows_cart = true make the spans follow bridge and cart)"
        }
    }
}

//! A linear analysis in words.

use nalgebra::Complex;
use std::f64::consts::PI;
use taut::linear::Analysis;
use taut::linear::{Root, Transfer};
use taut::machine::BeltModel;
use taut::number::engineering_typed;

/// Of each pole or pair, the slowest first.
pub fn poles(analysis: &Analysis) -> Vec<Root> {
    Root::of(analysis.transfers.first().map_or(&[], |transfer| &transfer.poles))
}

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
    Root::of(&transfer.zeros.values).into_iter().map(one).collect::<Vec<_>>().join(", ")
}

/// A point of the z plane; of a pair both.
pub fn z(value: &Complex<f64>) -> String {
    match value.im {
        0.0 => engineering_typed(value.re, "", 6),
        im => format!("{} ± {}j", engineering_typed(value.re, "", 6), engineering_typed(im, "", 6)).replace('±', "+/-"),
    }
}

/// Whether the stiffness or the friction of the stage depends on where the cart is, in words.
pub fn along(analysis: &Analysis) -> &'static str {
    let machine = &analysis.case.machine;
    match (&analysis.travel, machine.belt.make) {
        _ if machine.belt.model == BeltModel::Rigid => "a rigid belt has no spans that could change with the position",
        (Some(_), _) => "spans 1 and 2 follow the cart: k = A E / l with the length that is left",
        (None, Some(_)) => {
            "the same along the travel: this file's stiffness does not depend on the position \
                 (belt.follows_cart = true makes spans 1 and 2 follow the cart)"
        }
        (None, None) => {
            "the same along the travel: this file gives the spans' stiffness as such \
                 (belt.modulus, section, spans and follows_cart = true make them follow the cart)"
        }
    }
}

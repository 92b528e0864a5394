//! The key figures of moves in closed loop that a sweep keeps, as tables. Those of experiments are
//! [`FIGURES`](crate::metrics::FIGURES).

use crate::control::MoveRun;
use crate::metrics;

/// A key figure, as a column has it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    /// Its name, as a column.
    pub name: String,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: String,
}

impl Figure {
    pub(super) fn of_move(measure: &Measure) -> Self {
        let &Measure { name, unit, words, .. } = measure;
        Self { name: name.to_string(), unit, words: words.to_string() }
    }

    pub(super) fn of_experiment(figure: &metrics::Figure) -> Self {
        Self { name: figure.name.clone(), unit: figure.unit, words: figure.words.clone() }
    }
}

/// A key figure of a move, and how it is had from a run.
#[derive(Debug)]
pub struct Measure {
    /// Its name, as a column.
    pub name: &'static str,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: &'static str,
    /// Its value; NaN where a run has none.
    pub of: fn(&MoveRun) -> f64,
}

const fn row(name: &'static str, unit: &'static str, words: &'static str, of: fn(&MoveRun) -> f64) -> Measure {
    Measure { name, unit, words, of }
}

/// Those of a move in closed loop, in the order of the columns.
#[rustfmt::skip]
pub const OF_MOVE: &[Measure] = &[
    row("peak_cart_error", "m", "largest cart error x − y", |m| m.figures.cart.peak.value.abs()),
    row("rms_cart_error", "m", "rms of the cart error", |m| m.figures.cart.rms),
    row("final_cart_error", "m", "cart error at the end", |m| m.figures.final_cart_error),
    row("peak_following_error", "m", "largest following error r φ₁ − y", |m| m.figures.following.peak.value.abs()),
    row("rms_following_error", "m", "rms of the following error", |m| m.figures.following.rms),
    row("settling_time", "s", "settling time after the profile", |m| m.figures.settling.unwrap_or(f64::NAN)),
    row("overshoot", "m", "overshoot of the cart", |m| m.figures.overshoot),
    row("peak_motor_current", "A", "peak motor current", |m| m.figures.current.0.value.abs()),
    row("rms_motor_current", "A", "rms motor current", |m| m.figures.current.1),
    row("peak_motor_voltage", "V", "peak motor voltage", |m| m.figures.voltage.0.value.abs()),
    row("limited_time", "s", "time at the controller's limit", |m| m.figures.limited),
    row("energy_taken", "J", "electrical energy taken in", |m| m.figures.energy.0),
    row("restlessness", "Hz", "changes of direction of the command per second", |m| m.figures.restlessness),
    row("peak_belt_force", "N", "largest force in the belt", |m| m.metrics.largest_force().1.value.abs()),
];

//! The key figures of a run that a sweep keeps, as tables.

use crate::control::MoveRun;
use crate::metrics::{Metrics, Peak};

/// One of them.
pub struct Measure<T> {
    /// Its name, as a column.
    pub name: &'static str,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: &'static str,
    /// Its value; NaN where a run has none.
    pub of: fn(&T) -> f64,
}

const fn row<T>(name: &'static str, unit: &'static str, words: &'static str, of: fn(&T) -> f64) -> Measure<T> {
    Measure { name, unit, words, of }
}

/// Those of an experiment, in the order of the columns.
#[rustfmt::skip]
pub const OF_EXPERIMENT: &[Measure<Metrics>] = &[
    row("final_drive_travel", "m", "drive travel r φ₁ at the end", |m| m.final_drive_travel),
    row("final_cart_position", "m", "cart position at the end", |m| m.final_cart_position),
    row("final_cart_speed", "m/s", "cart speed at the end", |m| m.final_cart_speed),
    row("final_drive_travel_minus_cart", "m", "drive travel minus cart at the end", |m| m.final_drive_travel - m.final_cart_position),
    row("peak_cart_speed", "m/s", "peak cart speed", |m| m.peak_cart_speed.value),
    row("peak_cart_speed_time", "s", "time of the peak cart speed", |m| m.peak_cart_speed.time),
    row("peak_drive_speed", "m/s", "peak drive speed r φ₁′", |m| m.peak_drive_speed.value),
    row("steady_speed", "m/s", "steady cart speed", |m| m.steady_speed.map_or(f64::NAN, |steady| steady.value)),
    row("peak_span1_stretch", "m", "peak stretch of span 1", |m| m.peak_stretch[0].value),
    row("peak_span2_stretch", "m", "peak stretch of span 2", |m| m.peak_stretch[1].value),
    row("peak_span3_stretch", "m", "peak stretch of span 3", |m| m.peak_stretch[2].value),
    row("peak_span1_force", "N", "peak force in span 1", |m| m.peak_force[0].value),
    row("peak_span2_force", "N", "peak force in span 2", |m| m.peak_force[1].value),
    row("peak_span3_force", "N", "peak force in span 3", |m| m.peak_force[2].value),
    row("peak_belt_force", "N", "largest force in the belt", |m| magnitude(&m.peak_force)),
    row("peak_motor_current", "A", "peak motor current", |m| m.peak_current.value),
    row("stop_time", "s", "time of the last stop", |m| m.stop_time.unwrap_or(f64::NAN)),
    row("settled", "", "at rest at the end", |m| f64::from(u8::from(m.settled))),
    row("drive_stops", "", "stops of the drive pulley", |m| m.events[0].stops as f64),
    row("drive_reversals", "", "reversals of the drive pulley", |m| m.events[0].reversals as f64),
    row("cart_stops", "", "stops of the cart", |m| m.events[1].stops as f64),
    row("cart_reversals", "", "reversals of the cart", |m| m.events[1].reversals as f64),
    row("idler_stops", "", "stops of the idler pulley", |m| m.events[2].stops as f64),
    row("idler_reversals", "", "reversals of the idler pulley", |m| m.events[2].reversals as f64),
];

/// Those of a move in closed loop, in the order of the columns.
#[rustfmt::skip]
pub const OF_MOVE: &[Measure<MoveRun>] = &[
    row("peak_cart_error", "m", "largest cart error x − y", |m| m.figures.cart.peak.value),
    row("rms_cart_error", "m", "rms of the cart error", |m| m.figures.cart.rms),
    row("final_cart_error", "m", "cart error at the end", |m| m.figures.final_cart_error),
    row("peak_following_error", "m", "largest following error r φ₁ − y", |m| m.figures.following.peak.value),
    row("rms_following_error", "m", "rms of the following error", |m| m.figures.following.rms),
    row("settling_time", "s", "settling time after the profile", |m| m.figures.settling.unwrap_or(f64::NAN)),
    row("overshoot", "m", "overshoot of the cart", |m| m.figures.overshoot),
    row("peak_motor_current", "A", "peak motor current", |m| m.figures.current.0.value),
    row("rms_motor_current", "A", "rms motor current", |m| m.figures.current.1),
    row("peak_motor_voltage", "V", "peak motor voltage", |m| m.figures.voltage.0.value),
    row("limited_time", "s", "time at the controller's limit", |m| m.figures.limited),
    row("energy_taken", "J", "electrical energy taken in", |m| m.figures.energy.0),
    row("restlessness", "Hz", "changes of direction of the command per second", |m| m.figures.restlessness),
    row("peak_belt_force", "N", "largest force in the belt", |m| magnitude(&m.metrics.peak_force)),
];

fn magnitude(peaks: &[Peak; 3]) -> f64 {
    crate::metrics::largest(peaks).1.value.abs()
}

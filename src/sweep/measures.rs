//! The key figures of a run that a sweep keeps, as tables. Peaks are magnitudes: of a motion there and back the sign of
//! the larger peak is chance, and shares of signed ones would mean nothing.

use crate::control::MoveRun;
use crate::mechanism::{Drive, Label, Mechanism};
use crate::metrics::Sought::{self, Peak, SteadySpeed, StopTime};
use crate::metrics::{GantryMetrics, Metrics};
use crate::solve::reading::{CART_SPEED, CURRENT, DRIVE_SPEED, FORCE, STRETCH};

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
    pub(super) fn of<T>(measure: &Measure<T>) -> Self {
        let &Measure { name, unit, words, .. } = measure;
        Self { name: name.to_string(), unit, words: words.to_string() }
    }
}

/// A key figure, and how it is had from a run.
#[derive(Debug)]
pub struct Measure<T> {
    /// Its name, as a column.
    pub name: &'static str,
    /// Its SI unit; empty for a pure number.
    pub unit: &'static str,
    /// Its name for people.
    pub words: &'static str,
    /// Its value; NaN where a run has none.
    pub of: fn(&T) -> f64,
    /// The part of the motion that has to be followed for it.
    pub seeks: &'static [Sought],
}

const fn row<T>(name: &'static str, unit: &'static str, words: &'static str, of: fn(&T) -> f64) -> Measure<T> {
    Measure { name, unit, words, of, seeks: &[] }
}

/// The same, for which these are sought.
const fn seeking<T>(seeks: &'static [Sought], measure: Measure<T>) -> Measure<T> {
    Measure { seeks, ..measure }
}

/// Those of an experiment, in the order of the columns.
#[rustfmt::skip]
pub const OF_EXPERIMENT: &[Measure<Metrics>] = &[
    row("final_drive_travel", "m", "drive travel r φ₁ at the end", |m| m.final_drive_travel),
    row("final_cart_position", "m", "cart position at the end", |m| m.final_cart_position),
    row("final_cart_speed", "m/s", "cart speed at the end", |m| m.final_cart_speed),
    row("final_drive_travel_minus_cart", "m", "drive travel minus cart at the end", |m| m.final_drive_travel - m.final_cart_position),
    seeking(&[Peak(CART_SPEED)], row("peak_cart_speed", "m/s", "peak cart speed", |m| m.peak_cart_speed.value.abs())),
    seeking(&[Peak(CART_SPEED)], row("peak_cart_speed_time", "s", "time of the peak cart speed", |m| m.peak_cart_speed.time)),
    seeking(&[Peak(DRIVE_SPEED)], row("peak_drive_speed", "m/s", "peak drive speed r φ₁′", |m| m.peak_drive_speed.value.abs())),
    seeking(&[SteadySpeed], row("steady_speed", "m/s", "steady cart speed", |m| m.steady_speed.map_or(f64::NAN, |steady| steady.value))),
    seeking(&[Peak(STRETCH)], row("peak_span1_stretch", "m", "peak stretch of span 1", |m| m.peak_stretch[0].value.abs())),
    seeking(&[Peak(STRETCH + 1)], row("peak_span2_stretch", "m", "peak stretch of span 2", |m| m.peak_stretch[1].value.abs())),
    seeking(&[Peak(STRETCH + 2)], row("peak_span3_stretch", "m", "peak stretch of span 3", |m| m.peak_stretch[2].value.abs())),
    seeking(&[Peak(FORCE)], row("peak_span1_force", "N", "peak force in span 1", |m| m.peak_force[0].value.abs())),
    seeking(&[Peak(FORCE + 1)], row("peak_span2_force", "N", "peak force in span 2", |m| m.peak_force[1].value.abs())),
    seeking(&[Peak(FORCE + 2)], row("peak_span3_force", "N", "peak force in span 3", |m| m.peak_force[2].value.abs())),
    seeking(&[Peak(FORCE), Peak(FORCE + 1), Peak(FORCE + 2)], row("peak_belt_force", "N", "largest force in the belt", |m| magnitude(&m.peak_force))),
    seeking(&[Peak(CURRENT)], row("peak_motor_current", "A", "peak motor current", |m| m.peak_current.value.abs())),
    seeking(&[StopTime], row("stop_time", "s", "time of the last stop", |m| m.stop_time.unwrap_or(f64::NAN))),
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
    row("peak_belt_force", "N", "largest force in the belt", |m| magnitude(&m.metrics.peak_force)),
];

/// A key figure of a gantry: of one of its loads, drives, spans or bodies, or of all of it.
#[derive(Debug, Clone)]
pub struct OfPart {
    /// The figure.
    pub figure: Figure,
    /// The place of the part among the others of its role.
    place: usize,
    of: fn(&GantryMetrics, usize) -> f64,
}

impl OfPart {
    /// Its value; NaN where a run has none.
    pub fn value(&self, metrics: &GantryMetrics) -> f64 {
        (self.of)(metrics, self.place)
    }
}

/// Those of an experiment of a gantry, in the order of the columns; what its parts are called, the mechanism says.
#[rustfmt::skip]
pub fn of_gantry(mechanism: &Mechanism) -> Vec<OfPart> {
    let loads: Vec<Label> = mechanism.roles.loads.iter().map(|load| mechanism.bodies[*load].label).collect();
    let spans: Vec<Label> = mechanism.roles.spans.iter().map(|span| mechanism.springs[*span].label).collect();
    // The drives, as their columns begin and for people.
    let key = |drive: &Drive| mechanism.bodies[drive.pulley].label.key;
    let drives: Vec<Label> = mechanism.drives.iter().map(|drive| Label { key: key(drive), name: drive.label.name }).collect();
    let bodies: Vec<Label> = mechanism.held_bodies().map(|body| mechanism.bodies[body].label).collect();
    let whole = [Label { key: "", name: "" }];
    let mut figures = Vec::new();
    // In names `*` stands for the part.
    let mut each = |parts: &[Label], name: &str, unit: &'static str, words: &str, of: fn(&GantryMetrics, usize) -> f64| {
        for (place, part) in parts.iter().enumerate() {
            let figure = Figure { name: name.replace('*', part.key), unit, words: words.replace('*', part.name) };
            figures.push(OfPart { figure, place, of });
        }
    };
    each(&loads, "final_*_position", "m", "* position at the end", |m, load| m.final_position[load]);
    each(&loads, "final_*_speed", "m/s", "* speed at the end", |m, load| m.final_speed[load]);
    each(&loads, "final_*_by_drives", "m", "* position at the end, by the drives", |m, load| m.final_by_drives[load]);
    each(&loads, "final_drives_minus_*", "m", "drives minus * at the end", |m, load| m.final_by_drives[load] - m.final_position[load]);
    each(&loads, "peak_*_speed", "m/s", "peak * speed", |m, load| m.peak_speed[load].value.abs());
    each(&loads, "peak_*_speed_time", "s", "time of the peak * speed", |m, load| m.peak_speed[load].time);
    each(&loads, "peak_drives_minus_*", "m", "largest drives minus *", |m, load| m.peak_error[load].value.abs());
    each(&drives, "peak_*_speed", "rad/s", "peak speed of the *", |m, drive| m.peak_drive_speed[drive].value.abs());
    each(&drives, "peak_*_current", "A", "peak current of the *", |m, drive| m.peak_current[drive].value.abs());
    each(&spans, "peak_*_stretch", "m", "peak stretch of the *", |m, span| m.peak_stretch[span].value.abs());
    each(&spans, "peak_*_force", "N", "peak force in the *", |m, span| m.peak_force[span].value.abs());
    each(&whole, "peak_belt_force", "N", "largest force in the belts", |m, _| magnitude(&m.peak_force));
    each(&whole, "stop_time", "s", "time of the last stop", |m, _| m.stop_time.unwrap_or(f64::NAN));
    each(&whole, "settled", "", "at rest at the end", |m, _| f64::from(u8::from(m.settled)));
    each(&bodies, "*_stops", "", "stops of the *", |m, body| m.events[body].stops as f64);
    each(&bodies, "*_reversals", "", "reversals of the *", |m, body| m.events[body].reversals as f64);
    figures
}

/// The largest of peaks, without its sign.
fn magnitude(peaks: &[crate::metrics::Peak]) -> f64 {
    crate::metrics::largest(peaks).1.value.abs()
}

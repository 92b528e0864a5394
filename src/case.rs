//! The case file: TOML in, a [`Case`] out, and every mistake told with its line.

use crate::signal::Signal;
use crate::stage::Stage;

/// Everything needed to repeat a run.
#[derive(Debug, Clone)]
pub struct Case {
    /// What the file says it is.
    pub title: String,
    /// The machine.
    pub stage: Stage,
    /// What is done with it, in the file's order.
    pub experiments: Vec<Experiment>,
    /// The text it was read from, with `--set` applied: read again, it gives the same case.
    pub text: String,
}

/// One run of the stage.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Its name, unique within the case.
    pub name: String,
    /// What is fed into the amplifier.
    pub input: Signal,
    /// End of the run, s.
    pub until: f64,
    /// Output interval, s.
    pub every: f64,
    /// Where it starts from.
    pub initial: Initial,
}

/// The state at time zero; at rest at the origin unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Initial {
    /// φ₁, rad.
    pub drive_angle: f64,
    /// φ₁′, rad/s.
    pub drive_speed: f64,
    /// x, m.
    pub cart_position: f64,
    /// x′, m/s.
    pub cart_speed: f64,
    /// φ₃, rad.
    pub idler_angle: f64,
    /// φ₃′, rad/s.
    pub idler_speed: f64,
    /// Armature current, A; matters only with an inductance.
    pub motor_current: f64,
}

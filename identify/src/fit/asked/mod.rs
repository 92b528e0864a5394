//! The comparison: logs as runs of the model, and their residuals as a function of the variables.

mod acceleration;
pub(crate) mod controller;
pub(crate) mod drifting;
pub(crate) mod problem;
mod reading;
pub(crate) mod residuals;
pub(crate) mod run;
mod runs;
mod sensitivity;
mod sensor_play;
pub(crate) mod straight;

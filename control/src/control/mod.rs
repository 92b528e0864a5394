//! Control of a machine: controllers stepped in time around the exact plant, input shapers, and spectra for their
//! choice.
//!
//! [`closed_loop`] runs a [`Design`] on each drive of a machine along a [`Profile`] for each coordinate; [`close`] does
//! so with any [`Controller`]s, including user-defined ones.
//!
//! [`Design`]: crate::design::Design
//! [`Profile`]: crate::signal::profile::Profile

mod accuracy;
mod at_samples;
pub mod belts;
pub mod compare;
mod contour;
mod criterion;
pub mod damping;
pub mod diagonals;
pub mod drives;
pub mod fed;
pub mod feedback;
mod figures;
pub mod filter;
pub mod fuzzy;
mod gauge;
mod kind;
pub(crate) mod law;
mod laws;
pub mod model;
pub mod observer;
mod outcome;
pub mod pairs;
pub mod pid;
mod polynomials;
mod quadrature;
pub mod recommendation;
mod rest;
pub mod riccati;
mod sampled;
mod sampled_path;
mod sampling;
pub mod shaper;
pub mod shaping;
pub mod sliding;
pub mod spectrum;
mod spread;
mod standard;
pub mod state_feedback;
mod stepped;
mod welch;
mod wide;

pub use accuracy::Accuracy;
pub(crate) use at_samples::{AtSamples, closed_loop_at_samples};
pub use figures::{Deviation, DriveFigures, Figures, LoadFigures};
pub use outcome::follow;
pub use outcome::{MoveRun, Rows, Setup, close, closed_loop, each, stream};
pub(crate) use outcome::{closed_loop_briefly, recorded};
pub use rest::Swing;
pub use sampled::Added;
pub(crate) use sampled::measures_cart;
pub use sampled::{Controller, Loop, Observation, Sample, reads_scale};
pub(crate) use sampled_path::SampledPath;
pub use spread::{Worst, spread, worst};
pub use standard::{Standard, Text};
pub use stepped::Stepped;
pub use welch::power_spectral_density;

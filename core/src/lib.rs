//! Machines with belts as data, and their motion computed exactly: no file, no text format, no thread.
//!
//! The base of `taut`, whose facade re-exports these modules, listed in the order of dependence; each uses only those
//! above it.
//!
//! - [`error`]: what is wrong, where, what is allowed, what to do next.
//! - [`quantity`]: `"19.4 mm"` becomes 0.0194, with the dimension checked. Everywhere else numbers are in SI units.
//! - [`trajectory`]: named columns with units.
//! - [`friction`], [`mechanism`]: bodies, springs and drives as data, and their equations of motion, mode by mode.
//! - [`machine`]: what a person has. [`parameter`]: the one table of everything a case file can say.
//! - [`signal`]: inputs, and the references of moves. [`design`]: controllers as data. [`reach`]: what references need
//!   of a machine, and its limits. [`plan`]: experiments and their logs.
//! - [`solve`]: the motion. [`measure`]: what a recorder makes of it. [`metrics`]: what it shows.
//!
//! [`machine::Machine::axis`] shows an axis made and simulated without any other crate. Hidden modules are used by the
//! other crates of taut, and change without notice.

#[doc(hidden)]
pub mod calculator;
#[doc(hidden)]
pub mod chance;
pub mod design;
pub mod error;
pub mod friction;
#[doc(hidden)]
pub mod golden;
pub mod machine;
pub mod measure;
pub mod mechanism;
pub mod metrics;
#[doc(hidden)]
pub mod number;
pub mod parameter;
pub mod plan;
#[doc(hidden)]
pub mod polyline;
pub mod quantity;
pub mod reach;
pub mod signal;
pub mod solve;
pub mod trajectory;

pub use error::{Error, Result};

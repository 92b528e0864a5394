//! The shared object inside the FMUs that `taut export fmu` writes: the functions of FMI 2.0 and 3.0, for model
//! exchange and co-simulation, over [`taut_core::solve::Simulator`] and [`taut_core::solve::Dynamics`].
//!
//! [`instance`] is a machine under way as the standard sees it, in safe Rust: its phases, its variables, its steps.
//! `fmi2` and `fmi3` are the functions that importers call, `both` those that are alike in the two: they turn pointers
//! into slices and back, and say no to what is null. Whatever panics inside a call ends there: the instance answers
//! with the standard's "fatal" then, and the importer lives on.

mod abi;
mod both;
pub mod fmi2;
pub mod fmi3;
#[cfg(all(target_os = "linux", target_env = "gnu"))]
mod hypot;
pub mod instance;
mod saved;
mod step;
mod values;

//! Parameters from logs, identifiability, and design of experiments.

// Paths below `crate` are those of the facade, so that a module has the same name in all crates.
use taut_case::*;
use taut_control::*;
use taut_core::*;

pub mod fit;

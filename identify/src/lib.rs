//! Parameters from logs, identifiability, and design of experiments.

// Paths below `crate` are those of the facade: a module is named alike wherever it lives.
use taut_case::*;
use taut_control::*;
use taut_core::*;

pub mod fit;

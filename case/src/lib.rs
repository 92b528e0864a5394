//! Text to data and back: case files, logs of recorders, and files that appear whole or not at all.

// Paths below `crate` are those of the facade: a module is named alike wherever it lives.
use taut_core::*;

pub mod case;
pub mod files;
pub mod log;

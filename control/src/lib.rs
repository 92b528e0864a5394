//! Controllers of belt axes: stepped in time, linearised, tuned, and frequency responses from logs.

// Paths below `crate` are those of the facade: a module is named alike wherever it lives.
use taut_case::*;
use taut_core::*;

pub mod control;
pub mod frf;
pub mod learning;
pub mod linear;
pub mod planning;
pub mod tune;

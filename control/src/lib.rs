//! Controllers of belt axes: stepped in time, linearised, tuned, and frequency responses from logs.

// Paths below `crate` are those of the facade, so that a module has the same name in all crates.
use taut_case::*;
use taut_core::*;

pub mod control;
pub mod frf;
pub mod learning;
pub mod linear;
pub mod planning;
pub mod tune;

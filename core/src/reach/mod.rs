//! Capability of a machine: forces, currents and voltages that a reference requires, their limits, the modes that
//! it excites, and the quickest moves.

pub mod compensation;
mod course;
pub mod feasible;
pub mod forward;
pub mod pull_out;
pub mod quickest;
pub mod resonance;

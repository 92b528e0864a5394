//! What a machine can do: the forces, currents and voltages that a reference needs, the limits of these, the modes that
//! it excites, and the quickest moves.

pub mod compensation;
pub mod feasible;
pub mod pull_out;
pub mod quickest;
pub mod resonance;

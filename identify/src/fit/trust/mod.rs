//! Reliability of a minimum: determined parameters, their accuracy, and possible errors.

pub(crate) mod belts;
pub(crate) mod causes;
pub(crate) mod combinations;
pub(crate) mod directions;
pub(crate) mod doubts;
pub(crate) mod finding;
pub(crate) mod findings;
pub(crate) mod found;
pub(crate) mod held_out;
pub(crate) mod identify;
pub(crate) mod interruption;
pub(crate) mod nearest;
pub(crate) mod other_laws;
pub(crate) mod parts;
pub(crate) mod profile;
pub(crate) mod proposals;
pub(crate) mod residual_force;
pub(crate) mod result;
pub(crate) mod scores;
pub(crate) mod sub_records;
pub(crate) mod trials;
pub(crate) mod uncertainty;
pub(crate) mod unexplained;

//! The search for the minimum: bounded least squares with kinks, from several starts.

mod bundle;
pub(crate) mod cmaes;
mod damped;
mod evolved;
pub(crate) mod least_squares;
mod linear;
pub(crate) mod point;
pub(crate) mod regression;
mod rung;
pub(crate) mod starts;
pub(crate) mod triangle;

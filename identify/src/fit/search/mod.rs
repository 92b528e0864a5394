//! Where the least is: bounded least squares past kinks, from several starts.

mod bundle;
pub(crate) mod cmaes;
pub(crate) mod least_squares;
pub(crate) mod point;
pub(crate) mod regression;
pub(crate) mod starts;
pub(crate) mod triangle;

//! A designed experiment as a person sees it.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figure;
pub use rows::{heading, inputs, limits, measured, own, promises, verified};

//! Linear analyses as a person sees them.

pub mod gantry;
mod page;
mod plots;
mod rows;

pub use page::{page, printed};
pub use plots::figures;
pub use rows::{along, gain, pole, poles, words, z, zeros};

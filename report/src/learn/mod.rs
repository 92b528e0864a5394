//! A learned signal or map as a person sees it.

pub mod map;
mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figures;
pub use rows::{head, lines, trials};

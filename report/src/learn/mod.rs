//! A learned signal as a person sees it.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figures;
pub use rows::{head, lines, trials};

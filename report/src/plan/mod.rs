//! Planned moves as a person sees them.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figures;
pub use rows::{belt, head, lines};

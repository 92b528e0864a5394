//! Overviews of machines as a person sees them.

mod page;
mod rows;

pub use page::{figures, page};
pub use rows::{rows, value};

//! Input shapers as a person sees them.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figures;
pub use rows::{mode_words, pair_words, remark, words};

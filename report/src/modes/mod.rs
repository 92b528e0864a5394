//! Linear analyses as a person sees them.

mod page;
mod pictures;
mod rows;

pub use page::{page, printed};
pub use pictures::{Pictures, pictures};
pub use rows::{elastic, gain, pole, rigid, where_it_matters, words, z, zeros};

//! Fits as a person sees them.

pub mod compare;
pub mod drift;
mod page;
mod plots;
pub mod posterior;
mod rows;
mod value;

pub use page::{page, page_with};
pub use rows::{crooked, ending, findings, outputs, past_kinks, scores, words};
pub use value::value;

use taut::fit::{Fit, Posterior, Profile};

/// A fit with its profiles and its posterior.
pub struct FitResults {
    /// The fit.
    pub fit: Fit,
    /// Profiles, where a report is written.
    pub profiles: Vec<Profile>,
    /// The posterior, where one is asked for.
    pub drawn: Option<Posterior>,
}

//! Tunings as a person sees them.

mod page;
mod plots;
mod rows;

pub use page::page;
pub use plots::figures;
pub use rows::{
    CHOICES, Row, ahead, axes, certificate, choices, family, gains, given, goal, hertz, hunt, in_drives, limiting,
    margins, moves, summary, verdict,
};

use taut::case::{Case, Tuning};
use taut::tune::Tuned;

/// A tuning and its result.
pub struct Work<'a> {
    /// The case.
    pub case: &'a Case,
    /// The limits and the cost.
    pub tuning: &'a Tuning,
    /// The gains that were found.
    pub tuned: &'a Tuned,
}

//! The terms of Taylor series.

use crate::double::Double;
use crate::machine::{BODIES, SPANS, STATES};

/// Order of the Taylor series.
pub const ORDER: usize = 32;

/// States, and the forces behind them that are no straight lines: friction of each body, each span.
pub const PLACES: usize = STATES + BODIES + SPANS;

/// The terms of series of all places.
pub type Terms = [[Double; PLACES]; ORDER + 1];

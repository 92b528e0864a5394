//! Belt-driven axes: described in a file, simulated exactly.

pub mod case;
pub mod error;
pub mod files;
pub mod friction;
pub mod log;
pub mod metrics;
pub mod number;
pub mod parameter;
pub mod plant;
pub mod quantity;
#[cfg(feature = "report")]
pub mod report;
pub mod signal;
pub mod solve;
pub mod stage;
pub mod trajectory;

pub use error::{Error, Result};

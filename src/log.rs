//! Measured files in.

use crate::error::{Error, Result};
use std::path::Path;

/// The columns called `names` of a CSV file, in that order.
pub fn read_columns(file: &Path, names: &[&str]) -> Result<Vec<Vec<f64>>> {
    Err(Error::new(format!("reading {names:?} is not there yet")).in_file(file))
}

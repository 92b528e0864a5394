//! Where the fields of a text file stand, for messages about them.

use super::lines::{Fields, Lines, open};
use crate::error::SourceLocation;
use std::path::Path;

/// The place of a field in a file.
#[derive(Debug, Clone)]
pub(super) struct Locator {
    pub separator: u8,
    /// The line that names the columns, if one does.
    pub heading: Option<usize>,
    /// The place of each wanted column in a line.
    pub wanted: Vec<usize>,
}

impl Locator {
    /// The field of the i-th wanted column in a line.
    pub fn place(&self, file: &Path, line: usize, i: usize) -> Option<SourceLocation> {
        let mut lines = Lines::new(file, open(file).ok()?);
        while lines.number < line {
            lines.advance().ok().filter(|there| *there)?;
        }
        let range = Fields::new(self.separator).extent(&lines.text, self.wanted[i]);
        Some(lines.place(range))
    }

    /// The name of the i-th wanted column.
    pub fn heading(&self, file: &Path, i: usize) -> Option<SourceLocation> {
        self.place(file, self.heading?, i)
    }
}

//! The text of a case, and places in it.

use crate::error::SourceLocation;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// The text of a case and where it came from.
pub(super) struct Source {
    pub name: PathBuf,
    pub text: String,
    /// Changes of the text by `--set`.
    pub overrides: Vec<Override>,
}

/// One `--set`, and the stretch of the text that it made.
pub(super) struct Override {
    pub argument: String,
    pub range: Range<usize>,
}

impl Source {
    pub fn new(name: &Path, text: String) -> Self {
        Self { name: name.to_path_buf(), text, overrides: Vec::new() }
    }

    pub fn place(&self, range: Range<usize>) -> SourceLocation {
        let set = self.overrides.iter().find(|o| o.range.start <= range.start && range.end <= o.range.end);
        if let Some(set) = set {
            let value = equals(&set.argument).map_or(0, |i| i + 1);
            return SourceLocation::in_text("--set", &set.argument, value..set.argument.len());
        }
        SourceLocation::in_text(&self.name, &self.text, range)
    }
}

/// Where `=` stands between key and value: the first that is not within quotes.
pub(super) fn equals(argument: &str) -> Option<usize> {
    let mut quote = None;
    argument.char_indices().find_map(|(place, c)| {
        match (quote, c) {
            (None, '"' | '\'') => quote = Some(c),
            (Some(open), _) if open == c => quote = None,
            (None, '=') => return Some(place),
            _ => {}
        }
        None
    })
}

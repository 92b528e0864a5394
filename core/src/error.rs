//! Errors: what went wrong, where, with which value, what is allowed, and what to do next.
//!
//! An [`Error`] is for something a person can correct: a wrong file, flag or argument. A computation that stops early
//! is not an error; its result contains how it ended.

use std::fmt;
use std::path::{Path, PathBuf};

/// Shorthand for results of this library.
pub type Result<T> = std::result::Result<T, Error>;

/// A mistake in an input, reported to the person who made it.
#[derive(Debug, Clone, PartialEq)]
pub struct Error {
    /// One sentence: the key, its value, and what is wrong with it.
    pub what: String,
    /// Its place in a file, if any.
    pub place: Option<SourceLocation>,
    /// Values that would be accepted.
    pub allowed: Option<String>,
    /// Advice: the next thing to do.
    pub next: Option<String>,
}

/// A place in a file, or on the command line.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SourceLocation {
    /// The file, as the user named it; or a word such as `--set`.
    pub file: PathBuf,
    /// Line, column and extent within the file, if known. All counted from 1, in characters.
    pub span: Option<Span>,
}

/// An extent within one line of a text.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Span {
    /// Line number, from 1.
    pub line: usize,
    /// Column of the first character, from 1.
    pub column: usize,
    /// Number of characters, at least 1.
    pub width: usize,
    /// The whole line, to be shown under the message.
    pub text: String,
}

impl Error {
    /// An error that says `what` is wrong.
    pub fn new(what: impl Into<String>) -> Self {
        Self { what: what.into(), place: None, allowed: None, next: None }
    }

    /// Adds the place.
    pub fn at(mut self, place: SourceLocation) -> Self {
        self.place = Some(place);
        self
    }

    /// Adds a file as the place, if no place is known yet.
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.place.get_or_insert_with(|| SourceLocation::file(file));
        self
    }

    /// Adds what is allowed.
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.allowed = Some(allowed.into());
        self
    }

    /// Adds the next step.
    pub fn next(mut self, next: impl Into<String>) -> Self {
        self.next = Some(next.into());
        self
    }
}

impl SourceLocation {
    /// A whole file.
    pub fn file(file: impl AsRef<Path>) -> Self {
        Self { file: file.as_ref().to_path_buf(), span: None }
    }

    /// The bytes `range` of `text`, the content of `file`; the extent ends with its line.
    pub fn in_text(file: impl AsRef<Path>, text: &str, range: std::ops::Range<usize>) -> Self {
        let start = text.floor_char_boundary(range.start);
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
        let end = text.floor_char_boundary(range.end).clamp(start, line_end);
        Self {
            file: file.as_ref().to_path_buf(),
            span: Some(Span {
                line: before.matches('\n').count() + 1,
                column: text[line_start..start].chars().count() + 1,
                width: text[start..end].chars().count().max(1),
                text: text[line_start..line_end].trim_end_matches('\r').to_string(),
            }),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let span = self.place.as_ref().and_then(|p| p.span.as_ref());
        if let Some(place) = &self.place {
            write!(f, "{}", place.file.display())?;
            if let Some(span) = span {
                write!(f, ":{}:{}", span.line, span.column)?;
            }
            write!(f, ": ")?;
        }
        write!(f, "{}", self.what)?;
        if let Some(span) = span {
            let number = span.line.to_string();
            let margin = " ".repeat(number.len());
            // A very long line is shown around the mistake only.
            let from = span.column.saturating_sub(60).max(1);
            let shown: String =
                span.text.chars().skip(from - 1).take(110).map(|c| if c.is_control() { ' ' } else { c }).collect();
            let width = span.width.min(110 - (span.column - from).min(109));
            write!(f, "\n  {number} | {shown}")?;
            write!(f, "\n  {margin} | {}{}", " ".repeat(span.column - from), "^".repeat(width))?;
        }
        if let Some(allowed) = &self.allowed {
            write!(f, "\n  allowed: {allowed}")?;
        }
        if let Some(next) = &self.next {
            write!(f, "\n  next: {next}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

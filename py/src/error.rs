//! Mistakes of the user as exceptions, with the text that the command line shows.

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::panic::{AssertUnwindSafe, catch_unwind};

pyo3::create_exception!(
    taut,
    Error,
    PyValueError,
    "A mistake in an input, told as the command line tells it: what, where, what is allowed, what to do next.\n\n\
     Attributes: what (the sentence alone), file, line, column, allowed, next; None where there is none."
);

pyo3::create_exception!(
    taut,
    Bug,
    PyRuntimeError,
    "A mistake in taut itself, which no input should bring about; where it happened stands on the standard error."
);

/// Does `work`. A panic in it is a mistake of ours: it becomes [`Bug`], which `except Exception` catches, after Rust
/// has told place and backtrace on the standard error.
pub fn guarded<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let told = panic.downcast_ref::<String>().map(String::as_str);
        let told = told.or(panic.downcast_ref::<&str>().copied()).unwrap_or("a panic without words");
        Bug::new_err(format!(
            "this is a bug in taut: {told}\n  next: report it with the case and the call; the standard error says where it happened"
        ))
    })
}

/// Runs a job without the interpreter's lock, as [`guarded`] does.
pub fn unlocked<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| guarded(work))
}

/// Fails as a bug does: for the test that tells how such a one comes out.
#[pyfunction]
pub fn fail_as_a_bug(py: Python<'_>, told: String) -> PyResult<()> {
    unlocked(py, || panic!("{told}"))
}

/// A message of the library in Python's terms: `--move` becomes the argument `move=`. Commands of the command line are
/// kept, and so is `--set`, a notation for changes.
fn spoken(text: &str) -> String {
    let mut spoken = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("--") {
        let (before, option) = (&rest[..at], &rest[at + 2..]);
        let end = option.find(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).unwrap_or(option.len());
        let begins_a_word = before.chars().next_back().is_none_or(|c| !c.is_alphanumeric() && c != '-');
        spoken.push_str(before);
        let is_option = option.starts_with(|c: char| c.is_ascii_lowercase()) && begins_a_word;
        match is_option && option[..end] != *"set" && !spoken.contains("taut ") {
            true => spoken.push_str(&format!("{}=", option[..end].replace('-', "_"))),
            false => spoken.push_str(&rest[at..at + 2 + end]),
        }
        rest = &option[end..];
    }
    spoken + rest
}

/// The exception for what the library says.
pub fn told(py: Python<'_>, mut error: taut::Error) -> PyErr {
    error.what = spoken(&error.what);
    error.allowed = error.allowed.map(|text| spoken(&text));
    error.next = error.next.map(|text| spoken(&text));
    if let Some(place) = &mut error.place
        && let Some(argument) =
            place.file.to_str().and_then(|name| name.strip_prefix("--")).filter(|name| *name != "set")
    {
        place.file = argument.replace('-', "_").into();
    }
    let exception = Error::new_err(error.to_string());
    match describe(exception.value(py), error) {
        Ok(()) => exception,
        Err(other) => other,
    }
}

fn describe(exception: &Bound<'_, PyAny>, error: taut::Error) -> PyResult<()> {
    let span = error.place.as_ref().and_then(|place| place.span.as_ref());
    exception.setattr("what", error.what)?;
    exception.setattr("file", error.place.as_ref().map(|place| place.file.display().to_string()))?;
    exception.setattr("line", span.map(|span| span.line))?;
    exception.setattr("column", span.map(|span| span.column))?;
    exception.setattr("allowed", error.allowed)?;
    exception.setattr("next", error.next)
}

/// Results of the library as results of Python.
pub trait IntoPython<T> {
    /// This result with a Python exception for its error.
    fn told(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> IntoPython<T> for taut::Result<T> {
    fn told(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| told(py, error))
    }
}

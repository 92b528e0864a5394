//! Mistakes of the user as exceptions, with the text that the command line shows.

use crate::spoken::{self, spoken};
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

/// The exception for what the library says.
pub fn told(py: Python<'_>, mut error: taut::Error) -> PyErr {
    error.what = spoken(&error.what);
    error.allowed = error.allowed.map(|text| spoken(&text));
    error.next = error.next.map(|text| spoken(&text));
    if let Some(place) = &mut error.place
        && let Some(name) = place.file.to_str().and_then(spoken::place)
    {
        place.file = name.into();
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

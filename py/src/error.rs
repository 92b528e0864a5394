//! Mistakes of the user as exceptions, with the text that the command line shows.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pyo3::create_exception!(
    taut,
    Error,
    PyValueError,
    "A mistake in an input, told as the command line tells it: what, where, what is allowed, what to do next.\n\n\
     Attributes: what (the sentence alone), file, line, column, allowed, next; None where there is none."
);

/// The exception for what the library says.
pub fn told(py: Python<'_>, error: taut::Error) -> PyErr {
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
pub trait Told<T> {
    /// The same with an exception for the error.
    fn told(self, py: Python<'_>) -> PyResult<T>;
}

impl<T> Told<T> for taut::Result<T> {
    fn told(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| told(py, error))
    }
}

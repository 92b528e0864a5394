//! Data as Python's own dictionaries, lists, texts and numbers.

use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde_json::Value;
use taut::case::Given;

/// The JSON that `--json` would print, as objects.
pub fn json<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Value::Null => Ok(py.None().into_bound(py)),
        Value::Bool(truth) => truth.into_bound_py_any(py),
        Value::Number(number) => match (number.as_u64(), number.as_i64()) {
            (Some(whole), _) => whole.into_bound_py_any(py),
            (None, Some(whole)) => whole.into_bound_py_any(py),
            _ => number.as_f64().into_bound_py_any(py),
        },
        Value::String(text) => text.into_bound_py_any(py),
        Value::Array(values) => {
            let list = PyList::empty(py);
            values.iter().try_for_each(|value| list.append(json(py, value)?))?;
            Ok(list.into_any())
        }
        Value::Object(entries) => {
            let dict = PyDict::new(py);
            entries.iter().try_for_each(|(key, value)| dict.set_item(key, json(py, value)?))?;
            Ok(dict.into_any())
        }
    }
}

/// A value of a case file.
pub fn given<'py>(py: Python<'py>, value: &Given) -> PyResult<Bound<'py, PyAny>> {
    match value {
        Given::Number(number) => number.into_bound_py_any(py),
        Given::Whole(number) => number.into_bound_py_any(py),
        Given::Text(text) => text.into_bound_py_any(py),
        Given::Truth(truth) => truth.into_bound_py_any(py),
        Given::List(values) => {
            let list = PyList::empty(py);
            values.iter().try_for_each(|value| list.append(given(py, value)?))?;
            Ok(list.into_any())
        }
        Given::Table(entries) => {
            let dict = PyDict::new(py);
            entries.iter().try_for_each(|(key, value)| dict.set_item(key, given(py, value)?))?;
            Ok(dict.into_any())
        }
    }
}

//! Columns of numbers as NumPy arrays: the memory that Rust has filled is handed over, never copied.

use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use taut::trajectory::{Column, Trajectory};

/// Columns by name, with their units and headings.
pub struct Columns {
    /// Name to array.
    pub arrays: Py<PyDict>,
    /// Name, unit, heading.
    pub names: Py<PyList>,
    /// Where Rust had each column: a test compares.
    pub addresses: Vec<usize>,
}

impl Columns {
    /// Hands the columns over.
    pub fn of(py: Python<'_>, trajectory: Trajectory) -> PyResult<Self> {
        let (arrays, names) = (PyDict::new(py), PyList::empty(py));
        let mut addresses = Vec::with_capacity(trajectory.columns.len());
        for column in trajectory.columns {
            names.append((&column.name, &column.unit, column.heading()))?;
            addresses.push(column.values.as_ptr() as usize);
            arrays.set_item(column.name, column.values.into_pyarray(py))?;
        }
        Ok(Self { arrays: arrays.unbind(), names: names.unbind(), addresses })
    }
}

/// The same columns as the library has them: a copy.
pub fn read(arrays: &Bound<'_, PyDict>, names: &Bound<'_, PyList>) -> PyResult<Trajectory> {
    let mut columns = Vec::with_capacity(names.len());
    for entry in names.iter() {
        let (name, unit, _): (String, String, String) = entry.extract()?;
        let values = match arrays.get_item(&name)? {
            Some(array) => array.extract::<PyReadonlyArray1<f64>>()?.as_array().to_vec(),
            None => Vec::new(),
        };
        columns.push(Column { name, unit, values });
    }
    Ok(Trajectory { columns })
}

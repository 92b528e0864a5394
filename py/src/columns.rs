//! Columns of numbers as NumPy arrays: the memory that Rust has filled is handed over, never copied, and nobody writes
//! into it.

use crate::error::IntoPython;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray1};
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
    pub fn new(py: Python<'_>, trajectory: Trajectory) -> PyResult<Self> {
        let (arrays, names) = (PyDict::new(py), PyList::empty(py));
        let mut addresses = Vec::with_capacity(trajectory.columns.len());
        for column in trajectory.columns {
            names.append((&column.name, &column.unit, column.heading()))?;
            addresses.push(column.values.as_ptr() as usize);
            // Key figures, files and other tables tell of these numbers: they stay as they were computed.
            let array = column.values.into_pyarray(py);
            array.readwrite().make_nonwriteable();
            arrays.set_item(column.name, array)?;
        }
        Ok(Self { arrays: arrays.unbind(), names: names.unbind(), addresses })
    }
}

/// Copies the columns into a trajectory of the library.
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
    if columns.iter().any(|column| column.values.len() != columns[0].values.len()) {
        return Err(taut::Error::new("the columns have not the same length: arrays of this run were exchanged"))
            .told(arrays.py());
    }
    Ok(Trajectory { columns })
}

/// Bytes of the machine's memory, where the system says.
fn memory(py: Python<'_>) -> Option<f64> {
    let system = py.import("os").ok()?;
    let of = |name: &str| system.call_method1("sysconf", (name,)).ok()?.extract::<f64>().ok();
    Some(of("SC_PHYS_PAGES")? * of("SC_PAGE_SIZE")?).filter(|bytes| *bytes > 0.0)
}

/// Refuses tables that the machine's memory cannot hold: the system would end the interpreter.
pub fn fit(py: Python<'_>, rows: f64, columns: usize, next: &str) -> PyResult<()> {
    const SMALL: f64 = 1e8;
    let bytes = 8.0 * rows * columns as f64;
    // What is not known is taken for 64 GB.
    if bytes <= SMALL || bytes <= memory(py).unwrap_or(6.4e10) {
        return Ok(());
    }
    let giga = |bytes: f64| format!("{:.3} GB", bytes / 1e9);
    let what = format!("{rows:.4e} rows of {columns} columns take {}, more than this machine's memory", giga(bytes));
    let most = giga(memory(py).unwrap_or(6.4e10));
    Err(taut::Error::new(what).allowed(format!("up to {most}")).next(next)).told(py)
}

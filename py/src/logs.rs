//! How a fit meets its logs: what was measured, and what the model says.

use numpy::IntoPyArray;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use taut::fit::LogFit;

/// Name, window, whether it was held out, whether the model reached its end, times, rows that were fitted, and of each
/// output unit, measured values and the model's.
pub fn met(py: Python<'_>, log: LogFit) -> PyResult<Py<PyDict>> {
    let (told, outputs) = (PyDict::new(py), PyDict::new(py));
    told.set_item("name", log.name)?;
    told.set_item("window", log.window)?;
    told.set_item("held_out", log.held_out)?;
    told.set_item("complete", log.complete)?;
    told.set_item("fitted_rows", log.fitted_rows)?;
    told.set_item("time", log.time.into_pyarray(py))?;
    for output in log.outputs {
        let (name, unit) = (output.quantity.name(), output.quantity.unit());
        outputs.set_item(name, (unit, output.seen.into_pyarray(py), output.model.into_pyarray(py)))?;
    }
    told.set_item("outputs", outputs)?;
    Ok(told.unbind())
}

//! A linear analysis: its data, and its matrices as arrays.

use crate::error::guarded;
use crate::value;
use nalgebra::{DMatrix, DVector};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::f64::consts::PI;
use taut::json;
use taut::linear::{Analysis, Hold, Question};

/// The question as Python asks it.
#[allow(clippy::too_many_arguments)] // each is an option of the command line
pub fn question(
    at: Option<f64>,
    speed: Option<f64>,
    stuck: &[String],
    sample_time: Option<f64>,
    hold: Option<&str>,
    delay: Option<f64>,
    from: Option<f64>,
    to: Option<f64>,
) -> PyResult<Question> {
    let bodies = ["drive", "cart", "idler"];
    if let Some(name) = stuck.iter().find(|name| !bodies.contains(&name.as_str())) {
        return Err(PyValueError::new_err(format!(
            "stuck: there is no body \"{name}\"; there are {}",
            bodies.join(", ")
        )));
    }
    let hold = match hold {
        None | Some("zero") => Hold::Zero,
        Some("first") => Hold::First,
        Some("tustin") => Hold::Tustin,
        Some(other) => return Err(PyValueError::new_err(format!("hold: \"{other}\" is none of zero, first, tustin"))),
    };
    let mut held = [false; 6];
    for (held, body) in held.iter_mut().zip(bodies) {
        *held = stuck.iter().any(|name| name == body);
    }
    Ok(Question { speed, at, held, sample_time, hold, delay: delay.unwrap_or(0.0), from, to })
}

/// Data as `--json` has it, matrices, and the frequency response: magnitude and phase of each output.
pub fn answers<'py>(py: Python<'py>, analysis: &Analysis) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("data", value::json(py, &guarded(|| json::modes(analysis))?)?)?;
    let system = &analysis.system;
    dict.set_item("continuous", matrices(py, &system.a, &system.b, &system.c, &system.d)?)?;
    if let Some(model) = &analysis.discrete {
        dict.set_item("discrete", matrices(py, &model.a, &model.b, &model.c, &model.d)?)?;
    }
    let frequency = analysis.responses.first().map_or(&[][..], |response| &response.frequency);
    let hertz: Vec<f64> = frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
    let responses = PyDict::new(py);
    for (output, response) in system.outputs.iter().zip(&analysis.responses) {
        responses
            .set_item(&output.name, (response.magnitude().into_pyarray(py), response.degrees().into_pyarray(py)))?;
    }
    dict.set_item("frequency", hertz.into_pyarray(py))?;
    dict.set_item("responses", responses)?;
    Ok(dict)
}

type Four<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

fn matrices<'py>(
    py: Python<'py>,
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    c: &DMatrix<f64>,
    d: &DVector<f64>,
) -> PyResult<Four<'py>> {
    let array = |rows: usize, columns: usize, values: Vec<f64>| -> PyResult<Bound<'py, PyAny>> {
        Ok(values.into_pyarray(py).reshape([rows, columns])?.into_any())
    };
    // NumPy goes row by row, nalgebra column by column.
    let matrix = |m: &DMatrix<f64>| array(m.nrows(), m.ncols(), m.transpose().as_slice().to_vec());
    let column = |v: &DVector<f64>| array(v.len(), 1, v.as_slice().to_vec());
    Ok((matrix(a)?, column(b)?, matrix(c)?, column(d)?))
}

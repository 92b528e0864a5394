//! A linear analysis: its data, and its matrices as arrays.

use crate::error::guarded;
use crate::value;
use nalgebra::{DMatrix, DVector};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::f64::consts::PI;
use taut::json;
use taut::linear::{Analysis, Hold, Question};

/// The question as Python asks it.
#[allow(clippy::too_many_arguments)] // each is an option of the command line
pub fn question(
    at: Option<f64>,
    bridge: Option<f64>,
    speed: Option<f64>,
    stuck: &[String],
    sample_time: Option<f64>,
    hold: Option<&str>,
    delay: Option<f64>,
    from: Option<f64>,
    to: Option<f64>,
) -> PyResult<Question> {
    let hold = match hold {
        None | Some("zero") => Hold::Zero,
        Some("first") => Hold::First,
        Some("tustin") => Hold::Tustin,
        Some(other) => return Err(PyValueError::new_err(format!("hold: \"{other}\" is none of zero, first, tustin"))),
    };
    let delay = delay.unwrap_or(0.0);
    Ok(Question { speed, at, bridge, held: stuck.to_vec(), sample_time, hold, delay, from, to })
}

/// Data as `--json` has it, matrices, and the frequency responses: of each input magnitude and phase of each output.
pub fn answers<'py>(py: Python<'py>, analysis: &Analysis) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("data", value::json(py, &guarded(|| json::modes(analysis))?)?)?;
    let system = &analysis.system;
    dict.set_item("continuous", matrices(py, &system.a, &system.b, &system.c, &system.d)?)?;
    let (sampled, responses) = (PyList::empty(py), PyDict::new(py));
    for one in &analysis.inputs {
        if let Some(model) = &one.discrete {
            let (b, d) = (column(&model.b), column(&model.d));
            sampled.append(matrices(py, &model.a, &b, &model.c, &d)?)?;
        }
        let of_input = PyDict::new(py);
        for (output, response) in one.system.outputs.iter().zip(&one.responses) {
            let told = (response.magnitude().into_pyarray(py), response.degrees().into_pyarray(py));
            of_input.set_item(&output.name, told)?;
        }
        responses.set_item(&one.system.input.name, of_input)?;
    }
    let response = analysis.inputs.first().and_then(|one| one.responses.first());
    let frequency = response.map_or(&[][..], |response| &response.frequency);
    let hertz: Vec<f64> = frequency.iter().map(|omega| omega / (2.0 * PI)).collect();
    dict.set_item("discrete", sampled)?;
    dict.set_item("frequency", hertz.into_pyarray(py))?;
    dict.set_item("responses", responses)?;
    Ok(dict)
}

type Four<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>);

fn matrices<'py>(
    py: Python<'py>,
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    c: &DMatrix<f64>,
    d: &DMatrix<f64>,
) -> PyResult<Four<'py>> {
    // NumPy goes row by row, nalgebra column by column.
    let matrix = |m: &DMatrix<f64>| -> PyResult<Bound<'py, PyAny>> {
        let values = m.transpose().as_slice().to_vec();
        Ok(values.into_pyarray(py).reshape([m.nrows(), m.ncols()])?.into_any())
    };
    Ok((matrix(a)?, matrix(b)?, matrix(c)?, matrix(d)?))
}

/// A matrix of one column.
fn column(vector: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_column_slice(vector.len(), 1, vector.as_slice())
}

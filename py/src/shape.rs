//! Input shapers from files of vibration.

use crate::error::{IntoPython, guarded, unlocked};
use crate::value;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use taut::control::recommendation::{Damping, Question, recommend};
use taut::control::shaper::{Firmware, Form};
use taut::control::spectrum::Axis;
use taut::json;
use taut::reach::resonance::Drive;

/// The options, as Python hands them over.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Options {
    together: bool,
    firmware: String,
    axis: Option<String>,
    damping: Option<f64>,
    fitted: bool,
    max_smoothing: Option<f64>,
    max_vibrations: Option<f64>,
    corner_speed: Option<f64>,
    shapers: Vec<String>,
    uncertainty: Option<f64>,
    motor: Option<String>,
    changes: Vec<String>,
    pairs: bool,
    belts: bool,
}

/// The JSON that `taut shape --json` prints of these files.
#[pyfunction]
pub fn shape<'py>(py: Python<'py>, files: Vec<PathBuf>, options: Options) -> PyResult<Bound<'py, PyAny>> {
    let one_of = |what: &str, name: &str, known: &[&str]| -> PyResult<usize> {
        known
            .iter()
            .position(|word| *word == name)
            .ok_or_else(|| PyValueError::new_err(format!("{what}: \"{name}\" is none of {}", known.join(", "))))
    };
    let within = |what: &str, value: Option<f64>, least: f64, most: f64| match value {
        Some(value) if !(least..=most).contains(&value) => {
            Err(PyValueError::new_err(format!("{what}: {value} cannot be; allowed: {least} to {most}")))
        }
        value => Ok(value),
    };
    let words = Firmware::ALL.map(Firmware::word);
    let axis = options.axis.as_deref().map(|name| one_of("axis", name, &["x", "y", "z"])).transpose()?;
    let drive = options.motor.as_deref().map(|name| one_of("motor", name, &["held", "free"])).transpose()?;
    let forms: Vec<Form> = options.shapers.iter().map(|name| Form::read(name)).collect::<taut::Result<_>>().told(py)?;
    let question = Question {
        changes: options.changes,
        together: options.together,
        firmware: Firmware::ALL[one_of("firmware", &options.firmware, &words)?],
        axis: axis.map(|place| [Axis::X, Axis::Y, Axis::Z][place]),
        damping: if options.fitted { Some(Damping::Fitted) } else { options.damping.map(Damping::Ratio) },
        max_smoothing: within("max_smoothing", options.max_smoothing, 1e-7, 0.1)?,
        max_vibrations: within("max_vibrations", options.max_vibrations, 0.001, 1.0)?,
        corner_speed: within("corner_speed", options.corner_speed, 0.0, 10.0)?,
        forms: Some(forms).filter(|forms| !forms.is_empty()),
        uncertainty: within("uncertainty", options.uncertainty, 0.0, 0.5)?,
        drive: drive.map(|place| [Drive::Held, Drive::Free][place]),
        pairs: options.pairs,
        belts: options.belts,
    };
    let found = unlocked(py, || recommend(&question, &files))?.told(py)?;
    value::json(py, &guarded(|| json::shape(&found))?)
}

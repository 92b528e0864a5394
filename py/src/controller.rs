//! A controller written in Python, called once a sample.

use crate::interrupt::Interrupt;
use pyo3::exceptions::{PyOverflowError, PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;
use taut::control::{self, Controller};

/// Measurements and references that a controller has at a sample. SI units.
#[pyclass(frozen, get_all, module = "taut")]
#[derive(Debug, Clone)]
pub struct Observation {
    /// Time of the sample, s.
    time: f64,
    /// Measured position, m along the belt: whole counts of the encoder.
    position: f64,
    /// The cart's position on a scale beside that encoder, m: whole counts; None without a scale.
    scale: Option<f64>,
    /// Measured motor current, A.
    current: f64,
    /// Where the cart should be now, m.
    reference: f64,
    /// How fast it should be, m/s.
    reference_speed: f64,
    /// How much it should accelerate, m/s^2.
    reference_acceleration: f64,
    /// Where it should be when the command acts, m.
    ahead: f64,
    /// How fast it should be then, m/s.
    ahead_speed: f64,
    /// How much it should accelerate then, m/s^2.
    ahead_acceleration: f64,
}

#[pymethods]
impl Observation {
    fn __repr__(&self) -> String {
        format!("Observation(time={}, position={}, reference={}, ...)", self.time, self.position, self.reference)
    }
}

impl From<&control::Observation> for Observation {
    fn from(seen: &control::Observation) -> Self {
        Self {
            time: seen.time,
            position: seen.position,
            scale: seen.scale,
            current: seen.current,
            reference: seen.reference.position,
            reference_speed: seen.reference.speed,
            reference_acceleration: seen.reference.acceleration,
            ahead: seen.ahead.position,
            ahead_speed: seen.ahead.speed,
            ahead_acceleration: seen.ahead.acceleration,
        }
    }
}

/// How the object is called.
enum CallForm {
    /// `step(seen)`
    Step,
    /// `controller(position, reference)`
    Call,
}

/// The controller as the library steps it. The interpreter's lock is held while it lives.
pub struct Own<'a, 'py> {
    object: Bound<'py, PyAny>,
    way: CallForm,
    interrupt: &'a Interrupt,
}

impl<'a, 'py> Own<'a, 'py> {
    /// Looks at what the object can do; what it raises goes to `interrupt`.
    pub fn new(object: &Bound<'py, PyAny>, interrupt: &'a Interrupt) -> PyResult<Self> {
        let way = match object.hasattr("step")? {
            true => CallForm::Step,
            false if object.is_callable() => CallForm::Call,
            false => {
                return Err(PyTypeError::new_err(
                    "a controller is a function of (position, reference), or an object with a method step(seen)",
                ));
            }
        };
        Ok(Self { object: object.clone(), way, interrupt })
    }

    fn command(&self, seen: &control::Observation) -> PyResult<f64> {
        let py = self.object.py();
        let command = match self.way {
            CallForm::Step => self.object.call_method1(intern!(py, "step"), (Observation::from(seen),))?,
            CallForm::Call => self.object.call1((seen.position, seen.reference.position))?,
        };
        let time = seen.time;
        match command.extract::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            Ok(value) => Err(PyValueError::new_err(format!("at {time} s the controller's command is {value}"))),
            Err(error) if error.is_instance_of::<PyOverflowError>(py) => {
                Err(PyValueError::new_err(format!("at {time} s the controller's command is beyond any number in use")))
            }
            Err(error) if error.is_instance_of::<PyTypeError>(py) => {
                let kind = command.get_type().name()?;
                Err(PyTypeError::new_err(format!("at {time} s the controller's command is no number: {kind}")))
            }
            Err(error) => Err(error),
        }
    }

    /// A method that may be there.
    fn tell(&self, name: &str, with: Option<f64>) -> PyResult<()> {
        match (self.object.getattr_opt(name)?, with) {
            (Some(method), Some(value)) => method.call1((value,)).map(|_| ()),
            (Some(method), None) => method.call0().map(|_| ()),
            (None, _) => Ok(()),
        }
    }
}

impl Controller for Own<'_, '_> {
    fn step(&mut self, seen: &control::Observation) -> f64 {
        if self.interrupt.stop() {
            return 0.0;
        }
        self.command(seen).unwrap_or_else(|exception| {
            self.interrupt.raise(exception);
            0.0
        })
    }

    fn limited(&mut self, given: f64) {
        if !self.interrupt.stop()
            && let Err(exception) = self.tell("limited", Some(given))
        {
            self.interrupt.raise(exception);
        }
    }

    fn reset(&mut self) {
        if let Err(exception) = self.tell("reset", None) {
            self.interrupt.raise(exception);
        }
    }
}

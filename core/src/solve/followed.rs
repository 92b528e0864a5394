//! Quantities recorded with a run, and the variables with respect to which they are differentiated.

use crate::mechanism::{Mechanism, Shown, State};
use crate::plan::Experiment;
use std::sync::Arc;

/// A machine with its initial state.
#[derive(Debug, Clone)]
pub struct Begun {
    /// The machine.
    pub mechanism: Arc<Mechanism>,
    /// Its state at time zero.
    pub start: State,
}

/// A variable of differentiation.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Variable {
    /// A number of the machine, or of its start. Derivatives of the equations are differences: w₀ · those of the run's
    /// own machine + w₁ · those of the first one here + w₂ · those of the second.
    Machine {
        /// The machine and its start at two other values of it.
        points: Box<[Begun; 2]>,
        /// w₀, w₁, w₂
        weights: [f64; 3],
    },
    /// Delay of all changes of the inputs. At a row on such a change, the derivative is one-sided, towards later
    /// changes.
    Delay {
        /// The drive whose input it is; `None` for all inputs.
        drive: Option<usize>,
        /// Delay per unit of the variable, s.
        unit: f64,
    },
    /// Offset of the input of a drive per unit of the variable, from the time, s, at which the input begins.
    Offset {
        /// The drive.
        drive: usize,
        /// Change of the input per unit of the variable.
        unit: f64,
        /// Its start, s.
        from: f64,
    },
}

impl Variable {
    /// A number of the machine by central differences of its equations; `machine` gets the change of the number.
    pub fn central(h: f64, machine: impl Fn(f64) -> Begun) -> Self {
        Self::Machine { points: Box::new([machine(h), machine(-h)]), weights: [0.0, 0.5 / h, -0.5 / h] }
    }
}

/// The quantity that is differentiated.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Differentiated {
    /// A column of the run: position, speed, elongation, force, current, voltage or input.
    Shown(Shown),
    /// The acceleration of a body.
    Acceleration(usize),
}

/// Derivatives of each output with respect to each variable, row by row.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Sensitivities {
    /// The outputs themselves.
    pub values: Vec<Vec<f64>>,
    /// Their derivatives, by output, then by variable.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Number of mode changes.
    pub events: u64,
}

/// Quantities and variables of differentiation.
#[derive(Clone, Copy)]
pub(super) struct Task<'t> {
    pub(super) mechanism: &'t Arc<Mechanism>,
    pub(super) experiment: &'t Experiment,
    pub(super) variables: &'t [Variable],
    pub(super) outputs: &'t [Differentiated],
}

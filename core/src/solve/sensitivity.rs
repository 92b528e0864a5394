//! Sensitivities: how the columns of a run change with parameters of the machine, its start and its input.
//!
//! Within a mode ∂z/∂p obeys the linear equations of that mode, and where the mode changes it jumps, because the change
//! comes sooner or later: see [`super::exact`]'s `sensitivity`. One run gives the derivatives by all variables, exact but
//! for rounding, where differences take two runs for each and are as good as their step.

use super::exact::{Following, in_kernel};
use super::{Bench, Solver, check};
use crate::error::Result;
use crate::mechanism::{Mechanism, Shown, State};
use crate::plan::Experiment;
use std::sync::Arc;

/// A machine, and the state it begins in.
#[derive(Debug, Clone)]
pub struct Begun {
    /// The machine.
    pub mechanism: Arc<Mechanism>,
    /// Its state at time zero.
    pub start: State,
}

/// A variable that a run is differentiated by.
#[derive(Debug, Clone)]
pub enum Variable {
    /// A number of the machine, or of its start. Derivatives of the equations by it are differences of the equations:
    /// w₀ · those of the run's own machine + w₁ · those of the first one here + w₂ · those of the second.
    Machine {
        /// The machine and its start at two other values of it.
        points: Box<[Begun; 2]>,
        /// w₀, w₁, w₂
        weights: [f64; 3],
    },
    /// All changes of the input come later by so many seconds per unit of it. Where one falls on a row, the derivative
    /// is that towards later ones.
    Delay(f64),
    /// So much is added to the input per unit of it, from the time on, s, at which the input begins.
    Offset(f64, f64),
}

impl Variable {
    /// A number of the machine by central differences of its equations, `machine` being given the distance from where
    /// it is.
    pub fn central(h: f64, machine: impl Fn(f64) -> Begun) -> Self {
        Self::Machine { points: Box::new([machine(h), machine(-h)]), weights: [0.0, 0.5 / h, -0.5 / h] }
    }
}

/// The quantity that is differentiated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Differentiated {
    /// A column of the run: of way, speed, stretch, force, current, voltage or input.
    Shown(Shown),
    /// The acceleration of a body.
    Acceleration(usize),
}

/// Derivatives of columns: of each output by each variable, row by row.
#[derive(Debug, Clone, Default)]
pub struct Sensitivities {
    /// The outputs themselves.
    pub values: Vec<Vec<f64>>,
    /// Their derivatives, by output, then by variable.
    pub columns: Vec<Vec<Vec<f64>>>,
    /// Changes of mode on the way.
    pub events: u64,
}

impl Bench {
    /// The derivatives of the outputs of an experiment on the mounted stage by `variables`, in the rows of the
    /// experiment. None where there are none that can be told exactly: the stage needs the general solver, the run
    /// does not reach its end, a variable changes which parts the machine has, or a condition is only grazed, so that it
    /// is met or not as a variable is a little more or less.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::mechanism::Shown;
    /// use taut::parameter::Free;
    /// use taut::solve::{Begun, Bench, Differentiated, Variable};
    /// use std::sync::Arc;
    ///
    /// let case = Case::from_text("axis.toml", TEMPLATE)?;
    /// let (stage, experiment) = (&case.machine, &case.experiments[0]);
    /// let mass = Free::new(stage, "cart.mass", &[], &[])?;
    /// let heavier = |by: f64| {
    ///     let mut stage = stage.clone();
    ///     mass.set(&mut stage, mass.start + by);
    ///     let mechanism = Arc::new(stage.mechanism());
    ///     Begun { start: mechanism.begun(&experiment.initial), mechanism }
    /// };
    /// let mut bench = Bench::default();
    /// bench.mount(stage)?;
    /// let speed = Differentiated::Shown(Shown::Speed(taut::machine::axis::CART, 1.0));
    /// let variable = Variable::central(1e-6, heavier);
    /// let slopes = bench.sensitivities(experiment, &[variable], &[speed])?.expect("a plain axis");
    /// // A heavier cart starts more slowly.
    /// assert!(slopes.columns[0][0][20] < 0.0);
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn sensitivities(
        &mut self,
        experiment: &Experiment,
        variables: &[Variable],
        outputs: &[Differentiated],
    ) -> Result<Option<Sensitivities>> {
        let Some((stage, mechanism)) = &self.mounted else { return Err(super::nothing_mounted()) };
        check::experiment(mechanism, experiment)?;
        if Solver::of(stage) != Solver::Exact {
            return Ok(None);
        }
        let task = Task { mechanism, experiment, variables, outputs };
        let space = task.space(mechanism);
        Ok(in_kernel(space.size(), Following { task, known: &mut self.known }))
    }
}

/// Quantities, and the variables that they are differentiated by.
#[derive(Clone, Copy)]
pub(super) struct Task<'t> {
    pub(super) mechanism: &'t Arc<Mechanism>,
    pub(super) experiment: &'t Experiment,
    pub(super) variables: &'t [Variable],
    pub(super) outputs: &'t [Differentiated],
}

impl Task<'_> {
    /// Where what stands in the solver's vector of a mechanism.
    pub(super) fn space(&self, mechanism: &Mechanism) -> super::exact::Space {
        super::exact::Space::new(mechanism, self.experiment.inputs[0].degree())
    }
}

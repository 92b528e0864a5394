//! Sensitivities: derivatives of the columns of a run with respect to parameters of the machine, its start and its
//! input.
//!
//! Within a mode ∂z/∂p obeys the linear equations of that mode, and jumps at mode changes, because their times change:
//! see [`super::exact`]'s `sensitivity`. One run gives the derivatives with respect to all variables, exact except for
//! rounding; differences would take two runs for each variable, with errors by their step.

use super::exact::{Following, in_kernel};
use super::followed::Task;
pub use super::followed::{Begun, Differentiated, Sensitivities, Variable};
use super::{Bench, Solver, check};
use crate::error::Result;
use crate::mechanism::Mechanism;
use crate::plan::Experiment;

impl Bench {
    /// Derivatives of the outputs of an experiment on the mounted stage with respect to `variables`, in the rows of the
    /// experiment. `None` if there are no exact ones: the stage needs the general solver, the run does not reach its
    /// end, a variable changes the parts of the machine, or a condition is only grazed, so that a small change of a
    /// variable decides if it is met.
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
        if Solver::for_machine(stage) != Solver::Exact {
            return Ok(None);
        }
        let task = Task { mechanism, experiment, variables, outputs };
        let space = task.space(mechanism);
        Ok(in_kernel(space.size(), Following { task, known: &mut self.known }))
    }
}

impl Task<'_> {
    /// Layout of the solver's vector for a mechanism.
    pub(super) fn space(&self, mechanism: &Mechanism) -> super::exact::Space {
        let degree = self.experiment.inputs.iter().map(|input| input.degree()).max().unwrap_or(0);
        super::exact::Space::new(mechanism, degree)
    }
}

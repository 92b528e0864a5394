//! The accuracy of a move: how far its positions may be wrong, by a second run.

use super::outcome::{MoveRun, Rows, at_rest, driven};
use super::sampled::{Controller, Loop};
use super::sampling::Sampled;
use crate::case::Experiment;
use crate::error::Result;
use crate::machine::Machine;
use crate::mechanism::Mechanism;
use crate::signal::profile::Profile;
use crate::solve::{Course, ErrorEstimate, Flow, PositionError, Solver};
use crate::trajectory::Trajectory;

/// Estimates the error of a move by comparison of some of its rows with a second run, as [`ErrorEstimate`] does for a
/// given input.
///
/// In a closed loop, errors of positions reach the commands: a stable loop damps them, an unstable one amplifies them,
/// and the count of an encoder that is read differently moves the command by a step. So the second run has the same
/// controllers, which answer to what its own perturbed numbers do.
///
/// ```
/// use taut::case::Case;
/// use taut::control::{Accuracy, Loop, Rows, Standard, each, stream};
/// use taut::solve::{Flow, Solver};
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../stages/sollmann-jouaneh/controllers/pid.toml");
/// # let text = std::fs::read_to_string(path).unwrap();
/// let case = Case::from_text("pid.toml", &text)?;
/// let (machine, design, motion) = (&case.machine, case.controller.as_ref().unwrap(), &case.moves[0]);
/// let (profiles, timing, solver) = (motion.references(design), Loop::new(design), Solver::Exact);
/// let rows = Rows { until: motion.until, every: motion.every, window: motion.window };
/// let mut own = Standard::of_drives(design, machine)?;
/// let controllers = &mut each(&mut own);
/// let mut accuracy = Accuracy::new(machine, &timing, &profiles, &rows, solver);
/// let run = stream(machine, controllers, &timing, &profiles, &rows, solver, false, &mut |block| {
///     accuracy.take(block);
///     Flow::Continue
/// })?;
/// let error = accuracy.finish(&run, controllers, &mut || Flow::Continue)?.unwrap();
/// assert!(error.is_exact() && error.way > 0.01);
/// # Ok::<(), taut::Error>(())
/// ```
pub struct Accuracy<'a> {
    machine: &'a Machine,
    mechanism: Mechanism,
    profiles: &'a [Profile],
    timing: Loop,
    solver: Solver,
    experiment: Experiment,
    estimate: ErrorEstimate,
}

impl<'a> Accuracy<'a> {
    /// For a move with these inputs of [`super::stream`].
    pub fn new(machine: &'a Machine, timing: &Loop, profiles: &'a [Profile], rows: &Rows, solver: Solver) -> Self {
        let mechanism = machine.mechanism();
        let experiment = at_rest(machine, profiles, rows.until, rows.every);
        let estimate = ErrorEstimate::of_mechanism(&mechanism, &Course::new(&mechanism, &experiment));
        Self { machine, mechanism, profiles, timing: *timing, solver, experiment, estimate }
    }

    /// Takes the next rows of the move.
    pub fn take(&mut self, block: &Trajectory) {
        self.estimate.take(block);
    }

    /// Runs the move again and compares. `None` if `flow` stops it.
    pub fn finish(
        self,
        run: &MoveRun,
        controllers: &mut [&mut dyn Controller],
        flow: &mut dyn FnMut() -> Flow,
    ) -> Result<Option<PositionError>> {
        let Self { machine, mechanism, profiles, timing, solver, experiment, estimate } = self;
        let solvers = [solver, ErrorEstimate::second(solver, !controllers.is_empty())];
        let course = Course::new(&mechanism, &experiment);
        controllers.iter_mut().for_each(|controller| controller.reset());
        let mut sampled = Sampled::new(machine, controllers, timing, profiles, false).along(machine, &experiment);
        let error = estimate.finish_driven(&mechanism, &course, solvers, (&run.outcome, flow), &mut |second| {
            driven(second, &experiment, &mut sampled, |_, _, _| Flow::Continue)
        })?;
        // With a controller, a bound that has grown beyond a thousandth of the motion shows that rounding decides events
        // (flanks that rattle, counts that are read differently), but not by how much positions then differ.
        let bound = run.rounding.filter(|bound| run.samples.0 == 0 || !bound.hides_motion());
        let bound = bound.map_or(0.0, |bound| bound.value);
        Ok(error.map(|error| PositionError { value: error.value.max(bound), ..error }))
    }

    /// Basis of the estimate for a run of this machine, in words.
    pub fn basis(machine: &Machine, run: &MoveRun) -> &'static str {
        // A stepper without a controller follows its reference by itself.
        ErrorEstimate::basis(Solver::for_machine(machine), run.samples.0 > 0)
    }
}

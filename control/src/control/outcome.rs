//! A move in closed loop, and its results.

use super::figures::Figures;
use super::gauge::{Gauge, read};
use super::rest::Swing;
use super::sampled::{Added, Controller, Loop, Sample};
use super::sampled_path::SampledPath;
use super::sampling::Sampled;
use super::standard::Standard;
use super::wide::Wide;
use crate::case::Experiment;
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::mechanism::State;
use crate::metrics::Metrics;
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{self, Detail, Flow, Observe, PositionError, Solver};
use crate::trajectory::Trajectory;

/// Result of a move.
#[derive(Debug, Clone)]
pub struct MoveRun {
    /// Its key figures.
    pub figures: Figures,
    /// The key figures of any run.
    pub metrics: Metrics,
    /// Events, ending and cost. Its error is that of [`super::Accuracy`], if that has been asked.
    pub outcome: solve::Outcome,
    /// The bound of rounding for given inputs.
    pub(super) rounding: Option<PositionError>,
    /// Number of samples of the controller, and of those changed by its limit.
    pub samples: (u64, u64),
    /// The samples, if asked for.
    pub kept: Vec<Sample>,
    /// Oscillation of each drive's command after the profile.
    pub swings: Vec<Swing>,
}

/// Inputs of a closed loop.
#[derive(Debug, Clone, Copy)]
pub struct Setup<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The machine that the controller assumes; usually the same.
    pub model: &'a Machine,
    /// The controller of each drive.
    pub design: &'a Design,
    /// The reference of each coordinate.
    pub profiles: &'a [Profile],
    /// End of the run, s.
    pub until: f64,
    /// Half the width of the window in which the cart counts as settled, m.
    pub window: f64,
    /// Solver of the equations.
    pub solver: Solver,
}

impl<'a> Setup<'a> {
    /// A controller that assumes the machine itself, on references from time zero to `until` (s), with the window of a
    /// case file.
    pub fn new(machine: &'a Machine, design: &'a Design, profiles: &'a [Profile], until: f64) -> Self {
        Self { machine, model: machine, design, profiles, until, window: 1e-4, solver: Solver::for_machine(machine) }
    }
}

/// Runs a design along a profile: a pure function at the cost of a run of the axis, so that a search can call it often.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::control::{Setup, closed_loop};
/// use taut::design::{Design, Pid, Structure};
/// use taut::signal::profile::{Leg, Limits, Profile};
///
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let path = [Profile::new(0.0, &[Leg::To(0.05, Limits::new(0.3, 5.0))])?]; // m, m/s, m/s²
/// let pid = Pid { derivative: 10.0, ..Pid::new(2000.0) }; // V s/m, V/m
/// let design = Design { limit: Some(12.0), ..Design::new(1e-3, Structure::Pid(pid)) }; // V, s
/// let run = closed_loop(&Setup::new(&case.machine, &design, &path, 0.6))?;
/// let error = run.figures.cart().error.peak.value.abs();
/// assert!(error > 1e-3 && error < 5e-3, "{error} m");
/// # Ok::<(), taut::Error>(())
/// ```
pub fn closed_loop(setup: &Setup) -> Result<MoveRun> {
    let &Setup { machine, model, design, profiles, until, window, solver } = setup;
    let shaped = design.shaped(profiles);
    let mut controllers = Standard::of_drives(design, model)?;
    close(machine, &mut each(&mut controllers), &Loop::new(design), &shaped, until, window, solver)
}

/// Controllers of a design as [`close`] and [`stream`] take them.
pub fn each(controllers: &mut [Standard]) -> Vec<&mut dyn Controller> {
    controllers.iter_mut().map(|controller| controller as &mut dyn Controller).collect()
}

/// [`closed_loop`] for a search that runs it a thousand times, with controllers and shaped profiles made once: errors
/// of the slides, settling and RMS current, equal to those of [`closed_loop`] (RMS values to rounding, the others to
/// the last bit), and the ending.
pub(crate) fn closed_loop_briefly(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    path: &SampledPath,
    (until, window): (f64, f64),
    solver: Solver,
) -> Result<(Figures, solve::Ending)> {
    timing.check(until)?;
    let profiles = path.profiles();
    let experiment = at_rest(machine, profiles, until, timing.every.min(until));
    let mut gauge = Gauge::new(machine, &experiment, profiles, window).briefly();
    let outcome =
        unrecorded((machine, &experiment), controllers, (timing, path), solver, Some(&mut gauge), |_, _, _| {
            Flow::Continue
        })?;
    Ok((gauge.finish(&outcome.events).0, outcome.ending))
}

/// Runs controllers along a path without rows; `see` gets the samples as in [`Sampled::drive`].
pub(super) fn unrecorded(
    (machine, experiment): (&Machine, &Experiment),
    controllers: &mut [&mut dyn Controller],
    (timing, path): (&Loop, &SampledPath),
    solver: Solver,
    observer: Option<&mut impl Observe>,
    see: impl FnMut(f64, &State, &[f64]) -> Flow,
) -> Result<solve::Outcome> {
    controllers.iter_mut().for_each(|controller| controller.reset());
    let sampled = Sampled::new(machine, controllers, *timing, path.profiles(), false).on(path);
    let mut sampled = sampled.along(machine, experiment);
    let sink = &mut |_: &Trajectory| Flow::Continue;
    let observer = observer.map(|observer| observer as &mut dyn Observe);
    let run = solve::Run::reading(read(machine), experiment, solver, Detail::None, observer, sink)?;
    Ok(driven(run, experiment, &mut sampled, see))
}

/// Runs controllers along their profiles until `until`, s, with a row at each sample, and returns the samples: rows and
/// samples of [`stream`], to the last bit, without its figures.
pub(crate) fn recorded(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    (timing, profiles): (&Loop, &[Profile]),
    until: f64,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Vec<Sample>> {
    timing.check(until)?;
    let experiment = at_rest(machine, profiles, until, timing.every.min(until));
    controllers.iter_mut().for_each(|controller| controller.reset());
    let mut sampled = Sampled::new(machine, controllers, *timing, profiles, true).along(machine, &experiment);
    let run = solve::Run::new(machine, &experiment, solver, Detail::Full, None, sink)?;
    driven(run, &experiment, &mut sampled, |_, _, _| Flow::Continue);
    Ok(sampled.kept.unwrap_or_default())
}

/// Runs to the end: by sampled controllers, or without them, as steppers follow their references by themselves.
pub(super) fn driven(
    mut run: solve::Run,
    experiment: &Experiment,
    sampled: &mut Sampled,
    see: impl FnMut(f64, &State, &[f64]) -> Flow,
) -> solve::Outcome {
    if sampled.is_open() {
        return run.follow(&experiment.inputs);
    }
    sampled.drive(&mut run, experiment.until, see);
    run.finish()
}

/// A run from rest at the start of the profiles; its inputs are the references of steppers, none for other motors.
pub(super) fn at_rest(machine: &Machine, profiles: &[Profile], until: f64, every: f64) -> Experiment {
    let starts: Vec<f64> = profiles.iter().map(Profile::start).collect();
    Experiment {
        name: String::new(),
        inputs: match machine.stepper() {
            Some(_) => machine.belt_shares().into_iter().map(|weights| commanded(profiles, weights)).collect(),
            None => vec![Signal::Step { value: 0.0, at: 0.0 }; machine.drives.len()],
        },
        until,
        every,
        initial: machine.without_strain(&starts, &[]),
        log: None,
    }
}

/// Commanded position of a stepper, a weighted sum of the coordinates.
fn commanded(profiles: &[Profile], weights: &[f64]) -> Signal {
    Signal::References { profiles: profiles.to_vec(), weights: weights.to_vec() }
}

/// Runs controllers, one for each drive, along profiles, one for each coordinate, from rest at their start, for `until`
/// s; a slide has settled within `window` (m) of its target.
pub fn close(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    until: f64,
    window: f64,
    solver: Solver,
) -> Result<MoveRun> {
    let rows = Rows { until, every: timing.every.min(until), window };
    run(machine, controllers, timing, profiles, &rows, solver, (Detail::None, false), &mut |_| Flow::Continue)
}

/// Output rows, and the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rows {
    /// End of the run, s.
    pub until: f64,
    /// Interval between rows, s.
    pub every: f64,
    /// Half the width of the window in which the cart counts as settled, m.
    pub window: f64,
}

/// [`close`] that passes each block of rows to `sink`, with additional columns of references and errors: `reference`
/// and `cart_error` of an axis, `bridge_reference`, `cart_reference`, `bridge_error` and `cart_error` of a gantry.
#[allow(clippy::too_many_arguments)] // each is one thing, and the functions above leave most out
pub fn stream(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    rows: &Rows,
    solver: Solver,
    keep: bool,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    let mut wide = Wide::new(machine, profiles);
    let sink = &mut |block: &Trajectory| sink(wide.widened(profiles, block));
    run(machine, controllers, timing, profiles, rows, solver, (Detail::Full, keep), sink)
}

#[allow(clippy::too_many_arguments)]
fn run(
    machine: &Machine,
    controllers: &mut [&mut dyn Controller],
    timing: &Loop,
    profiles: &[Profile],
    rows: &Rows,
    solver: Solver,
    (detail, keep): (Detail, bool),
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<MoveRun> {
    timing.check(rows.until)?;
    if !(rows.window > 0.0 && rows.window.is_finite()) {
        return Err(Error::new(format!("the cart cannot settle within {:?} m", rows.window)).allowed("above zero"));
    }
    let (loads, drives) = (machine.geometry().slides.len(), machine.drives.len());
    // Steppers need no controllers.
    let is_open = controllers.is_empty() && machine.stepper().is_some();
    if profiles.len() != loads || controllers.len() != drives && !is_open {
        let what = format!("{} controllers and {} profiles", controllers.len(), profiles.len());
        return Err(Error::new(what).allowed(format!("{drives} controllers, one for each drive, and {loads} profiles")));
    }
    let experiment = at_rest(machine, profiles, rows.until, rows.every);
    controllers.iter_mut().for_each(|controller| controller.reset());
    let mut sampled = Sampled::new(machine, controllers, *timing, profiles, keep).along(machine, &experiment);
    let mut gauge = Gauge::new(machine, &experiment, profiles, rows.window);
    let run = solve::Run::reading(read(machine), &experiment, solver, detail, Some(&mut gauge), sink)?;
    let mut outcome = driven(run, &experiment, &mut sampled, |_, _, _| Flow::Continue);
    // It holds without a controller, which answers to what rounding does.
    let rounding = outcome.error.take();
    let (mut figures, metrics) = gauge.finish(&outcome.events);
    for (drive, told) in figures.drives.iter_mut().zip(&sampled.told) {
        drive.limited = told.held_back;
        drive.restlessness = told.turns as f64 / metrics.end.max(f64::MIN_POSITIVE);
    }
    let samples = (sampled.samples, sampled.limited);
    let swings = sampled.told.iter().take(drives).map(|told| told.at_rest.swing()).collect();
    Ok(MoveRun { figures, metrics, outcome, rounding, samples, kept: sampled.kept.unwrap_or_default(), swings })
}

/// Runs the controller of a design, made for `model`, through an experiment along a shaped reference; the experiment's
/// input is ignored. Positions are read exactly, since counts would make the result jump as parameters change.
pub fn follow(
    machine: &Machine,
    model: &Machine,
    design: &Design,
    (profile, added): (&Profile, Option<&Added>),
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<solve::Outcome> {
    let mut controller = Standard::new(design, model)?;
    let (mut controllers, profiles) = ([&mut controller as &mut dyn Controller], std::slice::from_ref(profile));
    let sampled = Sampled::new(machine, &mut controllers, Loop::new(design), profiles, false);
    let mut sampled = sampled.exactly().with(added);
    let machine = Machine { encoder: None, ..machine.clone() };
    let mut run = solve::Run::new(&machine, experiment, solver, Detail::Full, None, sink)?;
    sampled.drive(&mut run, experiment.until, |_, _, _| Flow::Continue);
    Ok(run.finish())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;
    use std::path::Path;

    /// Rows and samples without figures are those with figures, to the last bit: of an axis with a delayed command, of
    /// an H-frame and of a CoreXY.
    #[test]
    fn figures_do_not_change_a_run() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../stages");
        for name in ["sollmann-jouaneh/controllers/pid-elastic.toml", "h-frame/square.toml", "core-xy/square.toml"] {
            let case = Case::read(folder.join(name)).unwrap();
            let (machine, design) = (&case.machine, case.controller.as_ref().unwrap());
            let (motion, timing) = (&case.moves[0], Loop::new(design));
            let (profiles, until, solver) = (motion.references(design), motion.until, Solver::for_machine(machine));
            let rows = Rows { until, every: design.every, window: motion.window };
            let mut own = Standard::of_drives(design, machine).unwrap();
            let (mut whole, mut alone) = (Trajectory::default(), Trajectory::default());
            let gather = |all: &mut Trajectory, block: &Trajectory| {
                if all.columns.is_empty() {
                    *all = Trajectory::with_capacity(&block.columns, 0);
                }
                all.append(block);
                Flow::Continue
            };
            let sink = &mut |block: &Trajectory| gather(&mut whole, block);
            let run = stream(machine, &mut each(&mut own), &timing, &profiles, &rows, solver, true, sink).unwrap();
            let sink = &mut |block: &Trajectory| gather(&mut alone, block);
            let samples = recorded(machine, &mut each(&mut own), (&timing, &profiles), until, solver, sink).unwrap();
            assert!(alone.columns.len() > 10, "{name}");
            for column in &alone.columns {
                let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                let (with, without) = (bits(whole.get(&column.name).unwrap()), bits(&column.values));
                assert!(with == without && with.len() > 500, "{name}: {}", column.name);
            }
            assert_eq!(
                (samples.len() as u64, samples),
                (run.samples.0 * machine.drives.len() as u64, run.kept),
                "{name}"
            );
        }
    }
}

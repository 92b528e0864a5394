//! Runs as logs.

use std::sync::Arc;
use taut::case::{Case, Move, Plan};
use taut::control::{Loop, Rows, Sample, Standard, each, stream};
use taut::error::{Error, Result};
use taut::fit::{Fit, Problem, Stop, fit_watched};
use taut::log::{Log, Output, Quantity};
use taut::machine::Machine;
use taut::plan::Experiment;
use taut::signal::{Hold, Signal};
use taut::solve::{Flow, Solver};
use taut::trajectory::Trajectory;

/// A log of these columns.
pub fn columns(name: &str, time: Vec<f64>, input: Vec<f64>, outputs: Vec<Output>) -> Arc<Log> {
    Arc::new(Log {
        name: name.into(),
        file: Default::default(),
        time,
        inputs: vec![input],
        added: None,
        hold: Hold::Zero,
        reference: None,
        outputs,
        ended: None,
    })
}

/// The values of a sensor.
pub fn output(quantity: Quantity, values: Vec<f64>) -> Output {
    Output { quantity, absolute: false, values }
}

/// A fit each step of which is a point of the problem: steps in windows, in beginnings of the logs and with held delays
/// were those of other problems, and a studio that drew them stopped.
pub fn fitted_in_steps(case: &Case, plan: &Plan, stop: Option<Stop>) -> Result<Fit> {
    let problem = Problem::new(case, plan)?;
    let mut steps = 0;
    let found = fit_watched(case, plan, stop, &mut |x, _| {
        steps += 1;
        assert!(x.len() == problem.variables() && x.iter().all(|x| x.is_finite()), "step {steps}: {x:?}");
        Flow::Continue
    });
    assert!(steps > 0 || found.is_err());
    found
}

/// The log of a run that shows these angles of the drive pulley.
pub fn logged(name: &str, run: &Trajectory, drive_angle: Vec<f64>) -> Arc<Log> {
    let column = |name: &str| run.get(name).unwrap().to_vec();
    let mut log = columns(name, column("time"), column("voltage"), vec![output(Quantity::DriveAngle, drive_angle)]);
    Arc::make_mut(&mut log).reference = run.get("reference").map(<[f64]>::to_vec);
    log
}

/// The samples of a case's controller in a move on this machine, as an experiment with a log: command, angle by the
/// encoder, and the motor's current, to each value of which `noise` is added, A.
pub fn of_loop(case: &Case, motion: &Move, machine: &Machine, mut noise: impl FnMut() -> f64) -> Result<Experiment> {
    let design = case.controller.as_ref().ok_or_else(|| Error::new("the case has no controller"))?;
    let (profiles, timing) = (motion.references(design), Loop::new(design));
    let rows = Rows { until: motion.until, every: design.every, window: motion.window };
    let mut controllers = Standard::of_drives(design, &case.machine)?;
    let mut current = Vec::new();
    let mut take = |block: &Trajectory| {
        current.extend_from_slice(block.get("motor_current").unwrap_or(&[]));
        Flow::Continue
    };
    let solver = Solver::for_machine(machine);
    let run = stream(machine, &mut each(&mut controllers), &timing, &profiles, &rows, solver, true, &mut take)?;
    let values = |of: fn(&Sample) -> f64| run.kept.iter().map(of).collect::<Vec<f64>>();
    let angles = values(|sample| sample.measured).iter().map(|x| x / machine.pulley_radius).collect();
    let currents = current.iter().take(run.kept.len()).map(|i| i + noise()).collect();
    let outputs = vec![output(Quantity::DriveAngle, angles), output(Quantity::MotorCurrent, currents)];
    let log = columns(&motion.name, values(|sample| sample.time), values(|sample| sample.given), outputs);
    let until = log.time.last().copied().unwrap_or(motion.until);
    let input = Signal::Sampled { times: log.time.clone(), values: log.inputs[0].clone(), hold: Hold::Zero };
    Ok(Experiment { log: Some(log), ..Experiment::new(&motion.name, vec![input], until, design.every) })
}

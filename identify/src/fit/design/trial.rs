//! Evaluation of one input: its start, its extremes, and the information of its log.

use super::Task;
use super::candidates::Shape;
use super::criterion::Information;
use super::driven::Driven;
use super::limits::{Reached, reach, unbounded};
use crate::case::Experiment;
use crate::chance::{hash, normal};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::{Differences, Residuals};
use crate::fit::limits::SMALLER;
use crate::log::{Log, Output, Quantity};
use crate::machine::{Channel, Machine};
use crate::mechanism::State;
use crate::signal::{Hold, Signal};
use crate::solve::{Bench, Detail, Ending, Flow};
use crate::trajectory::{Grid, Trajectory};
use nalgebra::DMatrix;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;
use std::sync::Arc;

impl Task<'_> {
    /// Start at which the motion is centred in the travel, and its extremes; `None` if the run ends early.
    pub(super) fn placed(&self, machine: &Machine, inputs: &[Signal]) -> Option<(State, Reached)> {
        let machine = unbounded(machine);
        let middle = &self.limits.middle;
        let mut places: Vec<f64> = middle.iter().map(|middle| middle.unwrap_or(0.0)).collect();
        let mut initial = machine.without_strain(&places, &[]);
        let mut reached = reach(&machine, inputs, initial, self.every, self.duration)?;
        if middle.iter().any(Option::is_some) {
            for ((place, middle), [least, most]) in places.iter_mut().zip(middle).zip(&reached.positions) {
                if let Some(middle) = middle {
                    *place = round(*place - (0.5 * (least + most) - middle));
                }
            }
            initial = machine.without_strain(&places, &[]);
            reached = reach(&machine, inputs, initial, self.every, self.duration)?;
        }
        Some((initial, reached))
    }

    /// The input with its amplitude, or a smaller one, that keeps the limits; `None` if there is none.
    pub(super) fn fitted(&self, shape: Shape, driven: &Driven, stages: &[Machine]) -> Option<(Shape, State, Reached)> {
        let mut shape = shape;
        for _ in 0..SMALLER {
            let inputs = driven.inputs(&shape);
            let (initial, reached) = self.placed(&self.case.machine, &inputs)?;
            let mut used = self.limits.used(&reached);
            for machine in stages {
                let reached = reach(&unbounded(machine), &inputs, initial, self.every, self.duration)?;
                used = used.max(self.limits.used(&reached));
            }
            // Four digits.
            if used <= 1.0 + 1e-3 {
                return Some((shape, initial, reached));
            }
            shape = shape.scaled((1.0 / used).clamp(0.2, 0.999));
        }
        None
    }

    /// The experiment with a log simulated by the model; `noise` selects the noise.
    pub(super) fn experiment(&self, name: &str, inputs: &[Signal], initial: State, noise: u64) -> Option<Experiment> {
        let time = samples(self.every, self.duration);
        let until = *time.last()?;
        let mut experiment = Experiment {
            name: name.to_string(),
            inputs: inputs.to_vec(),
            until,
            every: self.every,
            initial,
            log: None,
        };
        let mut columns: Vec<Vec<f64>> = vec![Vec::new(); self.measured.len()];
        let mut bench = Bench::default();
        bench.mount(&self.case.machine).ok()?;
        let outcome = bench.run(&experiment, Detail::Full, &mut |block| {
            for (column, channel) in columns.iter_mut().zip(&self.measured) {
                column.extend_from_slice(source(block, channel.quantity));
            }
            Flow::Continue
        });
        if !outcome.is_ok_and(|outcome| outcome.ending == Ending::Complete) {
            return None;
        }
        let outputs = self.measured.iter().zip(columns).map(|(channel, values)| {
            let own = hash(noise.to_le_bytes().into_iter().chain(channel.quantity.name().bytes()));
            let mut random = Pcg64::seed_from_u64(own);
            let values = values.into_iter().map(|value| recorded(value, channel, &mut random)).collect();
            Output { quantity: channel.quantity, absolute: false, values }
        });
        let log = Log {
            name: name.to_string(),
            file: Default::default(),
            inputs: inputs.iter().map(|input| time.iter().map(|&t| input.value(t)).collect()).collect(),
            hold: hold(inputs, &time),
            time,
            added: None,
            reference: None,
            outputs: outputs.collect(),
            ended: None,
        };
        experiment.log = Some(Arc::new(log));
        Some(experiment)
    }

    /// Standard deviation of a recorded value, including rounding.
    pub(super) fn deviation(channel: &Channel) -> f64 {
        channel.noise.hypot(channel.step.unwrap_or(0.0) / 12f64.sqrt())
    }

    /// The least-squares problem of a fit to this experiment, with its weights.
    pub(super) fn problem(&self, experiment: Experiment) -> Option<Problem<'static>> {
        let case = crate::case::Case { experiments: vec![experiment], ..self.case.clone() };
        let mut problem = Problem::new(&case, &self.plan).ok()?;
        for channel in &self.measured {
            let deviation = Self::deviation(channel);
            problem.weigh(channel.quantity, deviation, channel.step.is_some());
        }
        let deviations: Vec<_> =
            self.measured.iter().map(|channel| (channel.quantity, Self::deviation(channel))).collect();
        problem.doubt_starts(&deviations);
        Some(problem)
    }

    /// Information of a fit to a log of these inputs, by such derivatives.
    pub(super) fn information(&self, inputs: &[Signal], initial: State, how: &Differences) -> Option<Information> {
        let mut problem = self.problem(self.experiment("designed", inputs, initial, self.seed)?)?;
        let x = problem.start();
        let mut residuals = vec![0.0; problem.rows()];
        if !problem.evaluate(&x, &mut residuals) {
            return None;
        }
        let bounds = problem.bounds();
        let jacobian = problem.jacobian(&x, &residuals, &bounds, how)?;
        Information::new(problem, jacobian, x, &self.wanted)
    }

    /// The information by derivatives over steps of a standard error, which include changes in the order of sticking
    /// and sliding.
    pub(super) fn surely(&self, mut information: Information) -> Option<Information> {
        let x = information.x.clone();
        let steps: Vec<f64> = (0..x.len()).map(|j| information.step(j)).collect();
        let problem = &mut information.problem;
        let mut residuals = vec![0.0; problem.rows()];
        problem.evaluate(&x, &mut residuals);
        let bounds = problem.bounds();
        let coarse: DMatrix<f64> = problem.jacobian(&x, &residuals, &bounds, &Differences::Coarse(steps))?;
        let coarse = Information::new(information.problem.clone(), coarse, x, &self.wanted)?;
        // The one with the larger predicted error.
        let worse = |one: &Information| one.score(self.criterion);
        Some(if worse(&coarse) > worse(&information) { coarse } else { information })
    }
}

/// Rounds to a tenth of a millimetre, as written.
fn round(position: f64) -> f64 {
    (position * 1e4).round() / 1e4 + 0.0
}

/// The column of a run with that quantity.
fn source(block: &Trajectory, quantity: Quantity) -> &[f64] {
    let name = quantity.name();
    // Behind a stiff gear, the rotor moves with its pulley.
    let other = match name {
        "motor_voltage" => "voltage".into(),
        "rotor_angle" => "drive_angle".into(),
        "rotor_speed" => "drive_speed".into(),
        _ => name.replace("_rotor_", "_"),
    };
    block.get(name).or_else(|| block.get(&other)).unwrap_or(&[])
}

/// A value as recorded by a converter.
fn recorded(value: f64, channel: &Channel, random: &mut Pcg64) -> f64 {
    let noisy = if channel.noise > 0.0 { value + channel.noise * normal(random) } else { value };
    channel.step.map_or(noisy, |step| (noisy / step).round() * step)
}

/// Times of the samples of a log of this duration, s.
pub(super) fn samples(every: f64, duration: f64) -> Vec<f64> {
    let grid = Grid::new(every, duration);
    (0..=grid.intervals()).map(|k| grid.time(k)).collect()
}

/// Interpolation between the samples of inputs in a log: held if they switch, and a straight line
/// otherwise, whichever is nearer in the middle.
pub(super) fn hold(inputs: &[Signal], time: &[f64]) -> Hold {
    let mut off = [0.0; 2];
    for input in inputs {
        for pair in time.windows(2) {
            let [a, b] = [pair[0], pair[1]].map(|t| input.value(t));
            let middle = input.value(0.5 * (pair[0] + pair[1]));
            off[0] += (middle - a).abs();
            off[1] += (middle - 0.5 * (a + b)).abs();
        }
    }
    if off[1] < off[0] { Hold::Linear } else { Hold::Zero }
}

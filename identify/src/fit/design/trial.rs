//! One input looked at: where it begins, how far it goes, and what a fit of its log would know.

use super::Task;
use super::candidates::Shape;
use super::criterion::Information;
use super::limits::{Reached, reach, unbounded};
use crate::case::Experiment;
use crate::chance::{hash, normal};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::residuals::{Differences, Residuals};
use crate::fit::limits::SMALLER;
use crate::log::{Log, Output, Quantity};
use crate::machine::axis::CART;
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
    /// Where an input begins so that its way is in the middle of the travel, and how far it goes; none where the run
    /// does not get to its end.
    pub(super) fn placed(&self, machine: &Machine, input: &Signal) -> Option<(State, Reached)> {
        let machine = unbounded(machine);
        let at = |x: f64| machine.at_rest(x);
        let mut initial = at(self.limits.middle.unwrap_or(0.0));
        let mut reached = reach(&machine, input, initial, self.every, self.duration)?;
        if let Some(middle) = self.limits.middle {
            let off = 0.5 * (reached.positions[0] + reached.positions[1]) - middle;
            initial = at(round(initial.position[CART] - off));
            reached = reach(&machine, input, initial, self.every, self.duration)?;
        }
        Some((initial, reached))
    }

    /// The input with an amplitude that keeps the limits, as it is or smaller; none where that is not found.
    pub(super) fn fitted(&self, shape: Shape, stages: &[Machine]) -> Option<(Shape, State, Reached)> {
        let mut shape = shape;
        for _ in 0..SMALLER {
            let signal = shape.signal();
            let (initial, reached) = self.placed(&self.case.machine, &signal)?;
            let mut used = self.limits.used(&reached);
            for machine in stages {
                let reached = reach(&unbounded(machine), &signal, initial, self.every, self.duration)?;
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

    /// The experiment with the log that the model makes of it; `noise` is which one.
    pub(super) fn experiment(&self, name: &str, input: &Signal, initial: State, noise: u64) -> Option<Experiment> {
        let time: Vec<f64> = {
            let grid = Grid::new(self.every, self.duration);
            (0..=grid.intervals()).map(|k| grid.time(k)).collect()
        };
        let until = *time.last()?;
        let mut experiment = Experiment {
            name: name.to_string(),
            inputs: vec![input.clone()],
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
            inputs: vec![time.iter().map(|&t| input.value(t)).collect()],
            time,
            added: None,
            hold: Hold::Zero,
            reference: None,
            outputs: outputs.collect(),
            ended: None,
        };
        experiment.log = Some(Arc::new(log));
        Some(experiment)
    }

    /// The standard deviation of what is recorded, rounding in it.
    pub(super) fn deviation(channel: &Channel) -> f64 {
        channel.noise.hypot(channel.step.unwrap_or(0.0) / 12f64.sqrt())
    }

    /// The problem that a fit of this experiment is, in its weights.
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

    /// Knowledge of a fit of a log of this input, by such derivatives.
    pub(super) fn information(&self, input: &Signal, initial: State, how: &Differences) -> Option<Information> {
        let mut problem = self.problem(self.experiment("designed", input, initial, self.seed)?)?;
        let x = problem.start();
        let mut residuals = vec![0.0; problem.rows()];
        if !problem.evaluate(&x, &mut residuals) {
            return None;
        }
        let bounds = problem.bounds();
        let jacobian = problem.jacobian(&x, &residuals, &bounds, how)?;
        Information::new(problem, jacobian, x, &self.wanted)
    }

    /// The same by derivatives over steps of a standard error, as far as sticking and sliding in another order show in
    /// them.
    pub(super) fn surely(&self, mut information: Information) -> Option<Information> {
        let x = information.x.clone();
        let steps: Vec<f64> = (0..x.len()).map(|j| information.step(j)).collect();
        let problem = &mut information.problem;
        let mut residuals = vec![0.0; problem.rows()];
        problem.evaluate(&x, &mut residuals);
        let bounds = problem.bounds();
        let coarse: DMatrix<f64> = problem.jacobian(&x, &residuals, &bounds, &Differences::Coarse(steps))?;
        let coarse = Information::new(information.problem.clone(), coarse, x, &self.wanted)?;
        // The one that promises less.
        let worse = |one: &Information| one.score(self.criterion);
        Some(if worse(&coarse) > worse(&information) { coarse } else { information })
    }
}

/// To a tenth of a millimetre, as it is written.
fn round(position: f64) -> f64 {
    (position * 1e4).round() / 1e4 + 0.0
}

/// The column of a run with that quantity.
fn source(block: &Trajectory, quantity: Quantity) -> &[f64] {
    let name = quantity.name();
    let other = match name {
        "motor_voltage" => "voltage",
        "rotor_angle" => "drive_angle",
        "rotor_speed" => "drive_speed",
        _ => name,
    };
    block.get(name).or_else(|| block.get(other)).unwrap_or(&[])
}

/// A value as a converter gives it.
fn recorded(value: f64, channel: &Channel, random: &mut Pcg64) -> f64 {
    let noisy = if channel.noise > 0.0 { value + channel.noise * normal(random) } else { value };
    channel.step.map_or(noisy, |step| (noisy / step).round() * step)
}

//! The Jacobian of a fit by exact sensitivities: one run for all variables, instead of one or two for each.

use super::problem::Problem;
use super::residuals::{Bounds, Differences, Step};
use super::run::{Extra, FittedLog, Nuisance, between, heading_of, per_position};
use crate::fit::limits::EQUATION_STEP;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::mechanism::Mechanism;
use crate::signal::Signal;
use crate::solve::{Begun, Bench, Differentiated, Variable};
use nalgebra::DMatrix;
use std::sync::Arc;

impl Problem<'_> {
    /// Writes the derivatives of the residuals of run `index` to the columns of these variables, and the residuals if
    /// requested; returns false if there are no exact derivatives.
    pub(crate) fn exact_block(
        &self,
        (bench, machine): (&mut Bench, &Machine),
        index: usize,
        (x, bounds): (&[f64], &Bounds),
        columns: &[usize],
        (jacobian, residuals): (&mut DMatrix<f64>, Option<&mut [f64]>),
    ) -> bool {
        if self.runs[index].is_closed() || !machine.is_piecewise_linear() {
            return false;
        }
        // What changes the readings alone needs no run.
        let is_of_sensor = |j: &&usize| self.extra_of((index, **j)).is_some_and(|extra| extra.what.is_of_sensor());
        let (of_sensor, movers): (Vec<usize>, Vec<usize>) = columns.iter().partition(is_of_sensor);
        let variables = |is_moved: bool| {
            let all = movers.iter().map(|&j| self.variable_of((index, j), x, bounds, is_moved));
            all.collect::<Option<Vec<_>>>()
        };
        // If the start of the cart does not matter, it is the origin, so that all runs share the prepared matrices; but
        // angles then depend on the radius.
        let mut is_moved = self.runs[index].is_shifted(machine) && !self.runs[index].has_scaled_sensor();
        let Some(mut all) = variables(is_moved) else { return false };
        if is_moved && all.iter().any(|variable| changes_radius(machine, variable)) {
            is_moved = false;
            match variables(is_moved) {
                Some(own) => all = own,
                None => return false,
            }
        }
        let variables = all;
        let extras = self.extras_from(index, x, is_moved);
        let Some(mut slopes) = self.runs[index].slopes(bench, machine, &extras, &variables) else { return false };
        let run = &self.runs[index];
        let rows = run.time.len();
        if let Some(residuals) = residuals {
            let own = self.extras_of(index, x);
            let slides = 0..machine.geometry().slides.len();
            let start =
                |slide| if is_moved { run.extra(Nuisance::StartPosition(slide), &own).unwrap_or(0.0) } else { 0.0 };
            let starts: Vec<f64> = slides.map(start).collect();
            let shown = run.seen.iter().zip(&slopes).map(|(seen, (values, _))| {
                let part = |(slide, start): (usize, &f64)| start * per_position(machine, seen.quantity, slide);
                let by: f64 = starts.iter().enumerate().map(part).sum();
                values.iter().map(|value| value + by).collect()
            });
            let shown: Vec<Vec<f64>> = shown.collect();
            if !run.compare(&shown, &own, residuals) {
                return false;
            }
        }
        let own = self.extras_of(index, x);
        let columns: Vec<usize> = movers.into_iter().chain(of_sensor).collect();
        for (i, (values, slopes)) in slopes.iter_mut().enumerate() {
            slopes.resize(columns.len(), vec![0.0; rows]);
            let Some(play) = run.sensor_play(i, &own) else {
                // d(s y) = s dy + y ds
                let scale = run.sensor_scale(i, &own);
                for (slopes, j) in slopes.iter_mut().zip(&columns) {
                    match self.extra_of((index, *j)) {
                        Some(Extra { what: Nuisance::SensorScale(of), unit, .. }) if of == run.seen[i].quantity => {
                            slopes.iter_mut().zip(values.iter()).for_each(|(slope, value)| *slope = unit * value);
                        }
                        _ => slopes.iter_mut().for_each(|slope| *slope *= scale),
                    }
                }
                continue;
            };
            let by = |j: &usize| match self.extra_of((index, *j)) {
                Some(Extra { what: Nuisance::SensorPlay(of), unit, .. }) if of == run.seen[i].quantity => [unit, 0.0],
                Some(Extra { what: Nuisance::SensorStart(of), unit, .. }) if of == run.seen[i].quantity => [0.0, unit],
                _ => [0.0; 2],
            };
            *values = play.differentiate(values, slopes.iter_mut().zip(columns.iter().map(by)));
        }
        for (i, (seen, (values, slopes))) in run.seen.iter().zip(&slopes).enumerate() {
            for (&j, slopes) in columns.iter().zip(slopes) {
                let mut column = jacobian.column_mut(j);
                for k in 0..rows {
                    // d|y| = ± dy
                    let sign = if seen.absolute && values[k] < 0.0 { -1.0 } else { 1.0 };
                    column[i * rows + k] = sign * seen.weights[k] * slopes[k];
                }
            }
        }
        // Prior knowledge of the run's own variables.
        let known = run.extras.iter().filter(|extra| extra.known.is_some());
        for (at, extra) in known.enumerate() {
            let own = self.own_variables(index).into_iter().find(|(_, own)| own.what == extra.what);
            if let (Some((j, extra)), Some(deviation)) = (own, extra.known)
                && columns.contains(&j)
            {
                jacobian[(run.seen.len() * rows + at, j)] = extra.unit / deviation;
            }
        }
        true
    }

    /// The extras of a run, with its start moved to the origin or not.
    fn extras_from(&self, index: usize, x: &[f64], is_moved: bool) -> Vec<f64> {
        let mut extras = self.extras_of(index, x);
        for (extra, value) in self.runs[index].extras.iter().zip(&mut extras) {
            if is_moved && matches!(extra.what, Nuisance::StartPosition(_)) {
                *value = 0.0;
            }
        }
        extras
    }

    /// The nuisance that variable `j` of the search is for run `index`; `None` for a parameter of a machine.
    fn extra_of(&self, (index, j): (usize, usize)) -> Option<Extra> {
        match j.checked_sub(self.parameters.len())? {
            shared if j < self.globals() => Some(self.shared[shared]),
            _ => self.own_variables(index).into_iter().find(|(own, _)| *own == j).map(|(_, extra)| extra),
        }
    }

    /// The meaning of variable `j` of the search for run `index`; `None` if it is neither a parameter of a machine nor
    /// a known change of the input.
    fn variable_of(&self, (index, j): (usize, usize), x: &[f64], bounds: &Bounds, is_moved: bool) -> Option<Variable> {
        let extra = self.extra_of((index, j));
        let run = &self.runs[index];
        let begun = |to: f64| {
            let mut moved = x.to_vec();
            moved[j] = to;
            run.begun(&self.simulated(run.part, &moved), &self.extras_from(index, &moved, is_moved))
        };
        match extra.map(|extra| (extra.what, extra.unit)) {
            Some((Nuisance::Delay(drive), unit)) => Some(Variable::Delay { drive, unit }),
            Some((Nuisance::InputOffset(drive), unit)) => {
                let from = run.begins(drive, &self.extras_of(index, x))?;
                Some(Variable::Offset { drive, unit, from })
            }
            Some((
                Nuisance::Bias(_) | Nuisance::SensorPlay(_) | Nuisance::SensorScale(_) | Nuisance::SensorStart(_),
                _,
            )) => None,
            Some((Nuisance::StartPosition(_) | Nuisance::StartSpeed(_), _)) => {
                // The state is linear in it: any step is exact.
                Some(Variable::central(1.0, |by| begun(x[j] + by)))
            }
            None | Some((Nuisance::InputGain(_), _)) => {
                let steps = Differences::Coarse(x.iter().map(|x| EQUATION_STEP * x.abs().max(1.0)).collect());
                let step = Step::new(x, bounds, j, &steps);
                let second = step.second?;
                Some(Variable::Machine {
                    points: Box::new([begun(step.first), begun(second)]),
                    weights: step.weights(),
                })
            }
        }
    }

    /// The variables that move run `index` otherwise than by a shift of its outputs.
    pub(crate) fn movers(&self, index: usize, machine: &Machine, bounds: &Bounds) -> Vec<usize> {
        let run = &self.runs[index];
        let own = self.own_variables(index).into_iter().filter(|(_, extra)| !run.only_shifts(machine, extra));
        let concerns = |j: &usize| self.of.get(*j).copied().flatten().is_none_or(|part| part == run.part);
        let globals = (0..self.globals()).filter(|&j| !bounds.hold(j)).filter(concerns);
        globals.chain(own.map(|(j, _)| j)).collect()
    }
}

/// An output and its derivatives by the variables.
type Sloped = (Vec<f64>, Vec<Vec<f64>>);

impl FittedLog {
    /// True if its start only shifts its outputs.
    fn is_shifted(&self, machine: &Machine) -> bool {
        let mut starts = self.extras.iter().filter(|extra| matches!(extra.what, Nuisance::StartPosition(_)));
        starts.any(|extra| self.only_shifts(machine, extra))
    }

    /// The machine that the model's side of this run is, and where it begins.
    fn begun(&self, machine: &Machine, extras: &[f64]) -> Begun {
        let mut machine = Machine { encoder: None, ..machine.clone() };
        let initial = self.initial(&mut machine, extras);
        let mechanism = Arc::new(machine.mechanism());
        Begun { start: mechanism.begun(&initial), mechanism }
    }

    /// Each output with its derivatives by the variables at the log's times; `None` if there are no exact ones.
    fn slopes(
        &self,
        bench: &mut Bench,
        machine: &Machine,
        extras: &[f64],
        variables: &[Variable],
    ) -> Option<Vec<Sloped>> {
        let mut machine = Machine { encoder: None, ..machine.clone() };
        let experiment = self.experiment(&mut machine, extras);
        let mechanism = machine.mechanism();
        let mut outputs = Vec::new();
        for seen in &self.seen {
            outputs.push(differentiated(&machine, &mechanism, seen.quantity)?);
        }
        // Between rows positions go by speeds.
        let mut bends = vec![None; self.seen.len()];
        if !self.is_even() {
            for (bend, seen) in bends.iter_mut().zip(&self.seen) {
                if let Some(speed) = seen.quantity.speed() {
                    *bend = Some(outputs.len());
                    outputs.push(differentiated(&machine, &mechanism, speed)?);
                }
            }
        }
        bench.mount(&machine).ok()?;
        let mut found = bench.sensitivities(&experiment, variables, &outputs).ok()??;
        if self.is_even() {
            let full = found.values.iter().all(|values| values.len() == self.time.len());
            return full.then(|| found.values.into_iter().zip(found.columns).collect());
        }
        let every = experiment.every;
        let at_times = |values: &[f64], slopes: &[f64]| -> Vec<f64> {
            self.time.iter().map(|&t| between(values, slopes, t / every, every)).collect()
        };
        let mut all = Vec::new();
        for (i, bend) in bends.into_iter().enumerate() {
            let values = at_times(&found.values[i], bend.map_or(&[], |bend| &found.values[bend]));
            let columns = std::mem::take(&mut found.columns[i]);
            let slopes = columns.iter().enumerate();
            let slopes = slopes.map(|(j, own)| at_times(own, bend.map_or(&[], |bend| &found.columns[bend][j])));
            all.push((values, slopes.collect()));
        }
        Some(all)
    }

    /// Time at which an offset of the input of a drive begins, s; `None` if the input has no such time.
    fn begins(&self, drive: usize, extras: &[f64]) -> Option<f64> {
        let delay = self.delay(drive, extras);
        match &self.inputs()[drive] {
            Signal::Sampled { times, .. } => Some(times.first()? + delay.unwrap_or(0.0)),
            // It is added from the first instant on, whenever the rest comes.
            _ if delay.is_none() => Some(0.0),
            _ => None,
        }
    }
}

/// A quantity of a log as what is differentiated.
fn differentiated(machine: &Machine, mechanism: &Mechanism, quantity: Quantity) -> Option<Differentiated> {
    let shown = |name: &str| mechanism.columns.iter().find(|heading| heading.name == name);
    if quantity.is_acceleration() {
        let geometry = machine.geometry();
        let body = geometry.bodies.iter().position(|body| Some(body.label.key) == quantity.body());
        let is_elastic = shown(&format!("{}_force", geometry.spans[0].column)).is_some();
        return body.filter(|_| is_elastic).map(Differentiated::Acceleration);
    }
    let (name, other) = heading_of(quantity);
    shown(name).or_else(|| shown(other)).map(|heading| Differentiated::Shown(heading.shown))
}

/// True if a variable changes the radius of the pulleys.
fn changes_radius(machine: &Machine, variable: &Variable) -> bool {
    let pulley = machine.geometry().drives[0].pulley;
    let is_other = |begun: &Begun| begun.mechanism.bodies[pulley].kind.lever() != machine.pulley_radius;
    matches!(variable, Variable::Machine { points, .. } if points.iter().any(is_other))
}

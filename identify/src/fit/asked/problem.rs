//! All logs of a case as one least-squares problem.

use super::reading::Reading;
use super::residuals::{Bounds, Differences, Residuals};
use super::run::{Extra, FittedLog, LogOptions, MeasuredOutput, Nuisance, rounding_at_rest};
use super::straight::straightened;
use crate::case::{Case, Nuisances, Plan, Scope, matches, parameters};
use crate::error::{Error, Result};
use crate::fit::limits::{FILE_ROUNDING, KNOWN_DELAY, SENSOR_START, SLOW_BY_DIFFERENCE, STARTS_MOVING};
use crate::log::Quantity;
use crate::machine::{AmplifierMode, DriveUnit, Machine};
use crate::parameter::{self, Free};
use crate::signal::Signal;
use nalgebra::DMatrix;

/// The variables of a fit, and its logs.
#[derive(Clone)]
pub struct Problem<'a> {
    /// The machine as the case has it.
    pub machine: Machine,
    /// The free parameters of it.
    pub parameters: Vec<Free>,
    /// The part of the logs that each parameter is for, by its index in `parts`; `None` if it is for all of them.
    pub of: Vec<Option<usize>>,
    /// Names of the parts of the logs that have parameters for themselves: campaigns, or logs.
    pub parts: Vec<String>,
    /// Nuisances that all logs share.
    pub shared: Vec<Extra>,
    /// The logs that are fitted.
    pub runs: Vec<FittedLog>,
    /// Logs that are compared, not fitted.
    pub held_out: Vec<FittedLog>,
    /// Simulated runs so far.
    pub simulations: u64,
    /// Runs that the last Jacobian took differences of.
    pub differences: usize,
    /// True if residuals swing to and fro, so that a first value is as far off as any other, however smooth they are.
    pub swings: bool,
    /// True if curves of friction are simulated as straight lines.
    pub(crate) is_straight: bool,
    units: Vec<Scale>,
    /// Called between evaluations; true ends the search.
    stop: Option<Stop<'a>>,
}

/// Standard deviations by quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise(pub Vec<(Quantity, f64)>);

impl Noise {
    /// Standard deviation of a quantity; 1e-12 in its unit if there is none.
    pub fn deviation(&self, quantity: Quantity) -> f64 {
        self.0.iter().find(|(own, _)| *own == quantity).map_or(1e-12, |(_, deviation)| *deviation)
    }
}

/// Asked whether to stop: Ctrl-C, say.
pub type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Conversion of a variable of the search to the value of a free parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// p = start · eˣ
    Log(f64),
    /// p = unit · x
    Linear(f64),
}

impl Scale {
    fn value(self, x: f64) -> f64 {
        match self {
            Scale::Log(start) => start * x.exp(),
            Scale::Linear(unit) => unit * x,
        }
    }

    fn variable(self, value: f64) -> f64 {
        match self {
            Scale::Log(start) => (value / start).ln(),
            Scale::Linear(unit) => value / unit,
        }
    }

    /// dp/dx
    fn slope(self, value: f64) -> f64 {
        match self {
            Scale::Log(_) => value,
            Scale::Linear(unit) => unit,
        }
    }
}

impl<'a> Problem<'a> {
    /// The problem that `plan` poses with the logs of `case`.
    pub fn new(case: &Case, plan: &Plan) -> Result<Self> {
        case.complete()?;
        let machine = case.machine.clone();
        let (parameters, of, parts) = separated(case, plan, parameters(&machine, plan, &[])?)?;
        let mut runs = Vec::new();
        let mut held_out = Vec::new();
        for experiment in &case.experiments {
            let Some(log) = &experiment.log else { continue };
            let held = plan.held_out.iter().any(|pattern| matches(&experiment.name, pattern));
            let setting = LogOptions { window: plan.windows, fitted_until: plan.until, held_out: held };
            let part = plan.part(&experiment.name);
            for mut run in FittedLog::all(experiment, log, &setting) {
                run.part = parts.iter().position(|name| name == part).unwrap_or(0);
                run.know_drives(&machine);
                if plan.closed_loop {
                    run.close(case, log);
                }
                if held { held_out.push(run) } else { runs.push(run) }
            }
        }
        if runs.is_empty() {
            return Err(no_log(&machine));
        }
        let mut problem = Self {
            units: parameters.iter().map(|parameter| scale(&machine, parameter, &runs)).collect(),
            machine,
            parameters,
            of,
            parts,
            shared: Vec::new(),
            runs,
            held_out,
            simulations: 0,
            differences: 0,
            swings: false,
            is_straight: false,
            stop: None,
        };
        problem.add_extras(case, plan);
        problem.prepare();
        problem.weigh_first();
        Ok(problem)
    }

    /// A single run of a machine that is known.
    pub(crate) fn alone(machine: Machine, mut run: FittedLog) -> Self {
        run.part = 0;
        Self {
            machine,
            parameters: Vec::new(),
            of: Vec::new(),
            parts: Vec::new(),
            shared: Vec::new(),
            runs: vec![run],
            held_out: Vec::new(),
            simulations: 0,
            differences: 0,
            swings: false,
            is_straight: false,
            units: Vec::new(),
            stop: None,
        }
    }

    /// Ends the work early once `stop` says so.
    pub fn stopped_by(mut self, stop: Option<Stop<'a>>) -> Self {
        self.stop = stop;
        self
    }

    /// Simulates Stribeck curves as straight lines, where the machine allows it.
    pub(crate) fn straight(self, is_straight: bool) -> Self {
        Self { is_straight, ..self }
    }

    /// The question.
    pub(crate) fn stop(&self) -> Option<Stop<'a>> {
        self.stop
    }

    /// True if the search is to end.
    pub fn is_stopped(&self) -> bool {
        self.stop.is_some_and(|stop| stop())
    }

    fn add_extras(&mut self, case: &Case, plan: &Plan) {
        let &Nuisances { delay, drive_delay, input_gain, input_offset, initial_state, bias, sensor_play, sensor_scale } =
            &plan.nuisance;
        let interval = self.runs[0].interval();
        // Samples that are taken after their stamps appear as an early input, if the input is logged.
        let mut inputs = self.runs.iter().flat_map(FittedLog::inputs);
        let is_sampled = inputs.all(|input| matches!(input, Signal::Sampled { .. }));
        let (early, high) = (if is_sampled { -50.0 * interval } else { 0.0 }, 50.0 * interval);
        let late = |of| {
            let what = Nuisance::Delay(of);
            Extra { what, start: 0.0, unit: interval, low: early, high, known: None }
        };
        let mut scopes = vec![(delay, late(None))];
        scopes.extend(drive_delay.map(|drive| (Scope::Shared, late(Some(drive)))));
        for drive in 0..self.machine.drives.len() {
            let logged = self.runs.iter().flat_map(|run| &run.logged[drive]);
            let most = logged.fold(0.0, |most: f64, u| most.max(u.abs()));
            let most = if most > 0.0 { most } else { 1.0 };
            let what = Nuisance::InputGain(drive);
            scopes.push((input_gain, Extra { what, start: 1.0, unit: 1.0, low: 0.2, high: 5.0, known: None }));
            let what = Nuisance::InputOffset(drive);
            scopes.push((input_offset, Extra { what, start: 0.0, unit: most, low: -most, high: most, known: None }));
        }
        if let Some(quantity) = sensor_play {
            let seen = self.runs.iter().flat_map(|run| &run.seen).filter(|seen| seen.quantity == quantity);
            let wide = seen.map(|seen| extent(&seen.values)).fold(1e-9, f64::max);
            let (what, unit) = (Nuisance::SensorPlay(quantity), 1e-2 * wide);
            scopes.push((Scope::Shared, Extra { what, start: 0.0, unit, low: 0.0, high: wide, known: None }));
        }
        if let Some(quantity) = sensor_scale {
            let what = Nuisance::SensorScale(quantity);
            scopes.push((Scope::Shared, Extra { what, start: 0.0, unit: 0.01, low: -0.9, high: 9.0, known: None }));
        }
        self.shared = scopes.iter().filter(|(scope, _)| *scope == Scope::Shared).map(|(_, extra)| *extra).collect();
        let noise = self.noise();
        for run in self.runs.iter_mut().chain(&mut self.held_out) {
            let own = scopes.iter().filter(|(scope, _)| *scope == Scope::Each).map(|(_, extra)| *extra);
            run.extras.extend(own);
            let given = case.experiments.iter().any(|e| e.name == run.name && e.initial != Default::default());
            let machine = &self.machine;
            let slides = 0..machine.geometry().slides.len();
            let readings: Vec<_> = slides.map(|slide| Reading::new(run, machine, slide)).collect();
            for (slide, reading) in readings.iter().enumerate() {
                let start = Start { slide, reading: reading.as_ref(), noise: &noise };
                let extras = start.extras(run, machine, (initial_state, given));
                run.extras.extend(extras);
            }
            if let Some(quantity) = sensor_play.filter(|own| run.seen.iter().any(|seen| seen.quantity == *own)) {
                let start = ahead(run, quantity, &noise, initial_state);
                let known = Some(SENSOR_START);
                let what = Nuisance::SensorStart(quantity);
                run.extras.push(Extra { what, start, unit: 1.0, low: 0.0, high: 1.0, known });
            }
            for (index, seen) in run.seen.iter().enumerate() {
                let counted = readings.iter().flatten().any(|reading| reading.takes(index));
                // Where the start is that of another sensor, a count begins anywhere within a step of it.
                let is_between_counts =
                    seen.quantity.is_position() && seen.step > 0.0 && readings.iter().any(Option::is_some);
                let (unit, wide, known) = match () {
                    () if counted => continue,
                    () if bias => {
                        let wide = extent(&seen.values).max(1e-9);
                        (1e-2 * wide, wide, None)
                    }
                    () if is_between_counts => (seen.step, seen.step, Some(seen.step / 12f64.sqrt())),
                    () => continue,
                };
                run.extras.push(Extra { what: Nuisance::Bias(index), start: 0.0, unit, low: -wide, high: wide, known });
            }
            // Extras with low == high are constants, not variables; see `extras_of`.
        }
    }

    /// The noise of each quantity: its correlation from one value to the next, and the rounding of its converter.
    pub fn noise(&self) -> Noise {
        let mut noise = Vec::new();
        for quantity in self.quantities() {
            let mut sizes = Vec::new();
            let (mut step, mut wide): (f64, f64) = (0.0, 0.0);
            for seen in self.runs.iter().flat_map(|run| &run.seen).filter(|seen| seen.quantity == quantity) {
                step = step.max(seen.step);
                wide = wide.max(extent(&seen.values));
                // Third differences of noise have √20 times its deviation, those of smooth motion next to nothing.
                let third = |w: &[f64]| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs();
                sizes.extend(seen.values.windows(4).map(third).filter(|d| d.is_finite()));
            }
            let middle = sizes.len() / 2;
            let rough = if sizes.is_empty() {
                0.0
            } else {
                1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 20f64.sqrt()
            };
            noise.push((quantity, rough.max(step / 12f64.sqrt()).max(1e-6 * wide).max(1e-12)));
        }
        Noise(noise)
    }

    /// Weights before anything is fitted: one deviation for each quantity, a hundredth of how far it ranges, or what
    /// its converter rounds if that is more.
    pub(crate) fn weigh_first(&mut self) {
        for quantity in self.quantities() {
            let seen = || self.runs.iter().flat_map(|run| &run.seen).filter(|seen| seen.quantity == quantity);
            let wide = seen().map(|seen| extent(&seen.values)).fold(0.0, f64::max);
            let step = seen().map(|seen| seen.step).fold(0.0, f64::max);
            let deviation = f64::max(1e-2 * wide, step / 12f64.sqrt()).max(1e-12);
            self.weigh(quantity, deviation, false);
        }
    }

    /// Weighs all quantities by the deviations of their residuals, and doubts starts as much.
    pub fn weigh_by(&mut self, noise: &[(Quantity, f64)]) {
        for &(quantity, deviation) in noise {
            self.weigh(quantity, deviation, true);
        }
        self.doubt_starts(noise);
    }

    /// Weighs a quantity: each value with the variance σ² of the noise and of what rounding makes of m equal values in
    /// a row, which is one error and not one for each: σ² + (m − 1) Δ²/12; or of m that go to and fro at rest:
    /// `rounding_at_rest`.
    pub fn weigh(&mut self, quantity: Quantity, deviation: f64, rounding: bool) {
        for run in &mut self.runs {
            let fitted = run.fitted_rows;
            // Rounding is a part of the deviation.
            let trembles = |step: f64| (deviation * deviation - step * step / 12.0).max(0.0).sqrt();
            for seen in run.seen.iter_mut().filter(|seen| seen.quantity == quantity) {
                for k in 0..seen.values.len() {
                    let (equal, alike) = (seen.repeats[k] - 1.0, seen.alike[k] - 1.0);
                    let common = match rounding {
                        false => 0.0,
                        true if alike > 0.0 => alike * rounding_at_rest(seen.step, trembles(seen.step)),
                        true => equal * seen.step * seen.step / 12.0,
                    };
                    let counts = k < fitted && seen.values[k].is_finite();
                    seen.weights[k] = if counts { 1.0 / (deviation * deviation + common).sqrt() } else { 0.0 };
                }
            }
        }
    }

    /// Raises the prior uncertainty of starts to these deviations of the positions that show them, since a first value
    /// is as noisy as any other. The increase is limited to the factor by which correlated noise can exceed the
    /// difference of neighbouring values; a larger deviation is an error of the model.
    pub fn doubt_starts(&mut self, noise: &[(Quantity, f64)]) {
        let of = |quantity: Quantity| noise.iter().find(|(own, _)| *own == quantity).map(|(_, deviation)| *deviation);
        for run in &mut self.runs {
            for slide in 0..self.machine.geometry().slides.len() {
                let Some(reading) = Reading::new(run, &self.machine, slide) else { continue };
                let Some(deviation) = reading.deviation(run, of) else { continue };
                let what = Nuisance::StartPosition(slide);
                for extra in run.extras.iter_mut().filter(|extra| extra.what == what) {
                    let Some(known) = &mut extra.known else { continue };
                    // Its unit is what neighbouring values differ by.
                    let most = if self.swings { f64::INFINITY } else { SLOW_BY_DIFFERENCE * extra.unit };
                    *known = known.max(deviation.min(most));
                    let room = 6.0 * *known;
                    (extra.low, extra.high) = (extra.low.min(extra.start - room), extra.high.max(extra.start + room));
                }
            }
        }
    }

    /// Residuals that are rounding, with the present weights: of each quantity `FILE_ROUNDING` of how far it ranges.
    pub fn rounding(&self) -> f64 {
        let seen = self.runs.iter().flat_map(|run| &run.seen);
        let of = |seen: &MeasuredOutput| {
            FILE_ROUNDING * extent(&seen.values) * seen.weights.iter().copied().fold(0.0, f64::max)
        };
        seen.map(of).fold(0.0, f64::max)
    }

    /// The quantities that the fitted logs hold.
    pub fn quantities(&self) -> Vec<Quantity> {
        let mut all = Vec::new();
        for seen in self.runs.iter().flat_map(|run| &run.seen) {
            if !all.contains(&seen.quantity) {
                all.push(seen.quantity);
            }
        }
        all
    }

    /// Number of variables: free parameters, what is shared, and the extras of each run.
    pub fn variables(&self) -> usize {
        self.globals() + self.runs.iter().map(|run| variable_extras(run).count()).sum::<usize>()
    }

    /// Number of those that concern all runs.
    pub fn globals(&self) -> usize {
        self.parameters.len() + self.shared.len()
    }

    /// Indices of the variables that concern all runs, here and in another problem, which may share less.
    pub(crate) fn globals_in(&self, other: &Problem) -> Vec<(usize, usize)> {
        let parameters = self.parameters.len();
        let shared = self.shared.iter().enumerate().filter_map(|(k, extra)| {
            let theirs = other.shared.iter().position(|own| own.what == extra.what)?;
            Some((parameters + k, parameters + theirs))
        });
        (0..parameters).map(|j| (j, j)).chain(shared).collect()
    }

    /// Sets the variables of `x` that concern all runs to those of a point of another problem.
    pub(crate) fn take_globals(&self, x: &mut [f64], other: &Problem, theirs: &[f64]) {
        self.globals_in(other).into_iter().for_each(|(own, other)| x[own] = theirs[other]);
    }

    /// A point with all delays of inputs at these intervals between samples, within their bounds.
    pub(crate) fn delayed(&self, mut x: Vec<f64>, intervals: f64) -> Vec<f64> {
        let bounds = self.bounds();
        self.delays().iter().for_each(|&j| x[j] = intervals.clamp(bounds.low[j], bounds.high[j]));
        x
    }

    /// The delay of inputs at a point, in intervals between samples: the mean of all, zero without any.
    pub(crate) fn delay(&self, x: &[f64]) -> f64 {
        let delays = self.delays();
        delays.iter().map(|&j| x[j]).sum::<f64>() / delays.len().max(1) as f64
    }

    /// Indices of the variables that are delays.
    fn delays(&self) -> Vec<usize> {
        let own = self.runs.iter().flat_map(variable_extras);
        let extras = self.shared.iter().chain(own).zip(self.parameters.len()..);
        extras.filter(|(extra, _)| matches!(extra.what, Nuisance::Delay(_))).map(|(_, index)| index).collect()
    }

    /// Number of values that count.
    pub fn counted(&self) -> usize {
        self.runs.iter().flat_map(|run| &run.seen).flat_map(|seen| &seen.weights).filter(|w| **w > 0.0).count()
    }

    /// As how many independent values they count: those that share an error of rounding count for less.
    pub fn independent(&self) -> f64 {
        self.runs.iter().flat_map(|run| (0..run.seen.len()).map(|output| run.independent(output))).sum()
    }

    /// The start values of the case.
    pub fn start(&self) -> Vec<f64> {
        let mut x: Vec<f64> =
            self.parameters.iter().zip(&self.units).map(|(parameter, unit)| unit.variable(parameter.start)).collect();
        x.resize(self.variables(), 0.0);
        x
    }

    /// Point with the parameters of a machine, if they are within their bounds.
    pub(crate) fn point_of(&self, machine: &Machine) -> Vec<f64> {
        let mut x = self.start();
        let bounds = self.bounds();
        for (j, parameter) in self.parameters.iter().enumerate() {
            let own = parameter.value_in(machine).map(|value| self.variable(j, value));
            x[j] = own.filter(|own| own.is_finite()).map_or(x[j], |own| own.clamp(bounds.low[j], bounds.high[j]));
        }
        x
    }

    /// The box of the variables.
    pub fn bounds(&self) -> Bounds {
        let parameters = self.parameters.iter().zip(&self.units);
        let mut bounds = Bounds {
            low: parameters.clone().map(|(parameter, unit)| unit.variable(parameter.low)).collect(),
            high: parameters.map(|(parameter, unit)| unit.variable(parameter.high)).collect(),
        };
        let own = self.runs.iter().flat_map(variable_extras);
        for extra in self.shared.iter().chain(own) {
            bounds.low.push((extra.low - extra.start) / extra.unit);
            bounds.high.push((extra.high - extra.start) / extra.unit);
        }
        bounds
    }

    /// The value of parameter `j` for its variable.
    pub fn value(&self, j: usize, x: f64) -> f64 {
        self.units[j].value(x)
    }

    /// The variable of parameter `j` for its value.
    pub fn variable(&self, j: usize, value: f64) -> f64 {
        self.units[j].variable(value)
    }

    /// dp/dx of parameter `j`.
    pub fn slope(&self, j: usize, value: f64) -> f64 {
        self.units[j].slope(value)
    }

    /// The change of the variable that counts as 100 %, of a machine like `stage`: where it may be zero, its value or a
    /// typical one.
    pub fn whole(&self, machine: &Machine, j: usize, x: f64) -> f64 {
        match self.units.get(j) {
            Some(Scale::Linear(unit)) => {
                let typical = typical(machine, &self.parameters[j], &self.runs);
                // Without a typical size, the value itself, or its start.
                typical.map_or(if x == 0.0 { 1.0 } else { x.abs() }, |typical| x.abs().max(typical / unit))
            }
            Some(Scale::Log(_)) => 1.0,
            None => match self.shared[j - self.parameters.len()].what {
                // Its unit is a sample's interval; few logs determine a delay to that.
                Nuisance::Delay(_) => KNOWN_DELAY,
                _ => 1.0,
            },
        }
    }

    /// True if parameter `j` is searched for on a logarithmic scale.
    pub fn is_log(&self, j: usize) -> bool {
        matches!(self.units[j], Scale::Log(_))
    }

    /// The variables of the same machine with the values that it uses: a breakaway below Coulomb friction is raised to
    /// it.
    pub fn as_set(&self, x: &[f64]) -> Vec<f64> {
        let mut own = x.to_vec();
        for (j, (parameter, unit)) in self.parameters.iter().zip(&self.units).enumerate() {
            let asked = unit.value(x[j]);
            let machine = self.stage_of(self.of[j].unwrap_or(0), x);
            match parameter.value_in(&machine) {
                Some(set) if (set - asked).abs() > 1e-9 * set.abs() => own[j] = unit.variable(set),
                _ => {}
            }
        }
        own
    }

    /// The machine with these values; of what parts of the logs have for themselves, those of the first.
    pub fn stage_at(&self, x: &[f64]) -> Machine {
        self.stage_of(0, x)
    }

    /// The machine with the values for a part of the logs.
    pub fn stage_of(&self, part: usize, x: &[f64]) -> Machine {
        let mut machine = self.machine.clone();
        let values = self.parameters.iter().zip(&self.units).zip(x).zip(&self.of);
        let own = values.filter(|(_, of)| of.is_none_or(|of| of == part));
        parameter::set(&mut machine, own.map(|(((parameter, unit), x), _)| (parameter, unit.value(*x))));
        machine
    }

    /// Index of the part of the logs with this name.
    pub(crate) fn part(&self, name: &str) -> Option<usize> {
        self.parts.iter().position(|own| own == name)
    }

    /// The machines of all parts of the logs.
    pub(crate) fn stages(&self, x: &[f64]) -> Vec<Machine> {
        (0..self.parts.len().max(1)).map(|part| self.stage_of(part, x)).collect()
    }

    /// The machine that is simulated for a part of the logs.
    pub(crate) fn simulated(&self, part: usize, x: &[f64]) -> Machine {
        let machine = self.stage_of(part, x);
        if self.is_straight { straightened(&machine).unwrap_or(machine) } else { machine }
    }

    /// The machines that are simulated.
    pub(super) fn all_simulated(&self, x: &[f64]) -> Vec<Machine> {
        (0..self.parts.len().max(1)).map(|part| self.simulated(part, x)).collect()
    }

    /// Index of the first extra of run `index` among the variables.
    fn place(&self, index: usize) -> usize {
        self.globals() + self.runs[..index].iter().map(|run| variable_extras(run).count()).sum::<usize>()
    }

    /// The values of a run's extras, and of the shared ones, for [`FittedLog::experiment`].
    pub fn extras_of(&self, index: usize, x: &[f64]) -> Vec<f64> {
        let mut at = self.place(index);
        let own = self.runs[index].extras.iter().map(|extra| {
            if extra.low < extra.high {
                at += 1;
                extra.start + extra.unit * x[at - 1]
            } else {
                extra.start
            }
        });
        let own: Vec<f64> = own.collect();
        own.into_iter().chain(self.shared_values(x)).collect()
    }

    /// Values of what is shared.
    pub fn shared_values(&self, x: &[f64]) -> Vec<f64> {
        let first = self.parameters.len();
        self.shared.iter().enumerate().map(|(i, extra)| extra.start + extra.unit * x[first + i]).collect()
    }

    /// The names of a run's variables and the places of the variables.
    pub fn own_variables(&self, index: usize) -> Vec<(usize, Extra)> {
        let first = self.place(index);
        variable_extras(&self.runs[index]).enumerate().map(|(i, extra)| (first + i, *extra)).collect()
    }

    /// Extras of a run that only shift its outputs.
    pub(crate) fn own_shifts(&self, index: usize, machine: &Machine) -> Vec<(usize, Extra)> {
        let mut own = self.own_variables(index);
        own.retain(|(_, extra)| self.runs[index].only_shifts(machine, extra));
        own
    }

    fn prepare(&mut self) {
        let shared = self.shared.clone();
        for run in self.runs.iter_mut().chain(&mut self.held_out) {
            run.share(&shared);
        }
    }

    /// Index of the first residual of run `index`.
    pub fn first_row(&self, index: usize) -> usize {
        self.runs[..index].iter().map(FittedLog::rows).sum()
    }
}

/// The error where no log is fitted, with the columns that a log of this machine would have.
fn no_log(machine: &Machine) -> Error {
    let geometry = machine.geometry();
    let pulleys: Vec<&str> = geometry.drives.iter().map(|drive| geometry.label(drive.pulley).key).collect();
    let is_angle =
        |quantity: &&Quantity| quantity.is_position() && quantity.body().is_some_and(|body| pulleys.contains(&body));
    let inputs = geometry.drives.iter().map(|drive| drive.input);
    let angles = machine.quantities().iter().filter(is_angle).map(|quantity| quantity.name());
    let columns: String = inputs.chain(angles).map(|key| format!(", {key} = \"...\"")).collect();
    Error::new("there is no log to fit")
        .next(format!("add log = {{ file = \"...\", time = \"...\"{columns} }} to an experiment"))
}

/// Parameters, the part of the logs that each is for, and the names of the parts.
type Separated = (Vec<Free>, Vec<Option<usize>>, Vec<String>);

/// Each separate parameter once for every part of the logs, the part that each is for, and the names of the parts.
fn separated(case: &Case, plan: &Plan, all: Vec<Free>) -> Result<Separated> {
    if plan.separate.is_empty() {
        let of = vec![None; all.len()];
        return Ok((all, of, Vec::new()));
    }
    let is_held = |name: &str| plan.held_out.iter().any(|pattern| matches(name, pattern));
    let logged = || case.experiments.iter().filter(|experiment| experiment.log.is_some());
    let mut parts: Vec<String> = Vec::new();
    for experiment in logged().filter(|experiment| !is_held(&experiment.name)) {
        let part = plan.part(&experiment.name);
        if !parts.iter().any(|known| known == part) {
            parts.push(part.to_string());
        }
    }
    let unknown = |name: &str| !parts.iter().any(|known| known == plan.part(name));
    if let Some(experiment) = logged().find(|experiment| unknown(&experiment.name)) {
        return Err(Error::new(format!(
            "\"{}\" is held out, and no log is fitted that shares its separate parameters",
            experiment.name
        ))
        .next("hold out some logs of a campaign only, or leave `separate` out of [fit]"));
    }
    let (mut parameters, mut of) = (Vec::new(), Vec::new());
    for parameter in all {
        if !plan.separate.contains(&parameter.name) {
            parameters.push(parameter);
            of.push(None);
            continue;
        }
        for (place, part) in parts.iter().enumerate() {
            let mut own = parameter.clone();
            own.name = format!("{} [{part}]", parameter.name);
            if let Some((_, [low, high])) = plan.bounds.iter().find(|(name, _)| *name == own.name) {
                (own.low, own.high) = (*low, *high);
            }
            parameters.push(own);
            of.push(Some(place));
        }
    }
    Ok((parameters, of, parts))
}

/// Extras that have room to vary and belong to the run alone.
pub(crate) fn variable_extras(run: &FittedLog) -> impl Iterator<Item = &Extra> {
    run.extras.iter().filter(|extra| extra.low < extra.high)
}

/// Greatest minus least.
pub(crate) fn extent(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    if high >= low { high - low } else { 0.0 }
}

/// The share of the play of a sensor that lies ahead where a run begins: none if it begins in forward motion, all of it
/// in backward motion.
fn ahead(run: &FittedLog, quantity: Quantity, noise: &Noise, initial_state: bool) -> f64 {
    let (slope, doubt) = Reading::of_output(run, quantity).speed_at_start(run, |own| Some(noise.deviation(own)));
    match initial_state || run.window > 0 {
        true if slope > STARTS_MOVING * doubt => 0.0,
        true if slope < -STARTS_MOVING * doubt => 1.0,
        _ => 0.5,
    }
}

/// The variables of the start of a slide in a run.
struct Start<'r> {
    slide: usize,
    /// Its position by the outputs of the run, if they show it.
    reading: Option<&'r Reading>,
    noise: &'r Noise,
}

impl Start<'_> {
    /// Extras for position and speed at the start of a run: both with `initial_state`; `given` is true if the case
    /// states the start.
    fn extras(&self, run: &FittedLog, machine: &Machine, (initial_state, given): (bool, bool)) -> Vec<Extra> {
        let mut extras = Vec::new();
        let r = machine.pulley_radius;
        let values = self.reading.map(|reading| reading.values(run));
        let first = values.as_ref().and_then(|values| values.iter().copied().find(|v| v.is_finite()));
        let span = self.reading.map_or(0.0, |reading| reading.extent(run, extent));
        let fastest = run.seen.iter().find(|seen| !seen.quantity.is_position()).map_or(0.0, |seen| {
            let arm = if seen.quantity.is_speed() && seen.quantity.is_linear() { 1.0 } else { r };
            arm * extent(&seen.values)
        });
        let long = run.time.last().copied().unwrap_or(1.0);
        let fast = f64::max(span / long, fastest).max(1e-6);
        let wide = span.max(1e-6);
        // A window in the middle of a log begins in motion; the first begins as the log does.
        let windowed = run.window > 0;
        if let Some(start) = first {
            let free = initial_state || windowed;
            // Positions count from where the log begins, unless the case says where that is; its first value says that
            // no better than any other value says where the slide is.
            let noise = self
                .reading
                .and_then(|reading| reading.deviation(run, |quantity| Some(self.noise.deviation(quantity))));
            let noise = noise.unwrap_or_default();
            let (unit, room) = if free { (1e-2 * wide, wide) } else { (noise, 6.0 * noise) };
            if free || !given {
                extras.push(Extra {
                    what: Nuisance::StartPosition(self.slide),
                    start,
                    unit,
                    low: start - room,
                    high: start + room,
                    known: if free { None } else { Some(noise) },
                });
            }
        }
        if initial_state || windowed {
            let of = |quantity| Some(self.noise.deviation(quantity));
            let (slope, doubt) = self.reading.map_or((0.0, 0.0), |reading| reading.speed_at_start(run, of));
            // A log begins at rest unless it shows motion: a start at rest sticks, and a search from there does not
            // depend on the speed.
            let start = if windowed || slope.abs() > STARTS_MOVING * doubt { slope } else { 0.0 };
            let (low, high) = (start - 20.0 * fast, start + 20.0 * fast);
            let what = Nuisance::StartSpeed(self.slide);
            extras.push(Extra { what, start, unit: fast, low, high, known: None });
        }
        extras
    }
}

/// The scale on which a parameter is searched for.
fn scale(machine: &Machine, parameter: &Free, runs: &[FittedLog]) -> Scale {
    if parameter.logarithmic() && parameter.start > 0.0 {
        Scale::Log(parameter.start)
    } else if parameter.start != 0.0 {
        Scale::Linear(parameter.start.abs())
    } else {
        Scale::Linear(typical(machine, parameter, runs).unwrap_or(1.0))
    }
}

/// A typical value of a quantity that may be zero: for friction a tenth of the motor's force at the greatest input.
/// `None` if it depends on the machine alone, such as the gain of an amplifier, whose unit depends on the input.
fn typical(machine: &Machine, parameter: &Free, runs: &[FittedLog]) -> Option<f64> {
    let most = runs.iter().flat_map(|run| run.logged.iter().flatten()).fold(0.0, |most: f64, u| most.max(u.abs()));
    let torque_of = |unit: &DriveUnit| {
        let (motor, amplifier) = (&unit.motor, &unit.amplifier);
        let per_unit = match amplifier.mode {
            AmplifierMode::Voltage => motor.torque_constant / motor.resistance,
            AmplifierMode::Current | AmplifierMode::Position => motor.torque_constant,
        };
        (0.1 * per_unit * motor.gear_ratio * amplifier.gain * most).abs()
    };
    let torque = machine.drives.iter().map(torque_of).fold(0.0, f64::max);
    let r = machine.pulley_radius;
    let speed = runs
        .iter()
        .flat_map(|run| run.seen.iter().map(move |seen| (run, seen)))
        .map(|(run, seen)| {
            let along = if seen.quantity.is_linear() { 1.0 / r } else { 1.0 };
            let wide = extent(&seen.values) * along;
            if seen.quantity.is_position() { 2.0 * wide / run.time.last().copied().unwrap_or(1.0) } else { wide }
        })
        .fold(0.0, f64::max)
        .max(1e-3);
    let unit = match parameter.unit {
        "N m" => torque,
        "N" => torque / r,
        "N m s/rad" => torque / speed,
        "N s/m" => torque / (speed * r * r),
        "rad" => 0.01,
        "H" => 1e-3 * machine.drives[0].motor.resistance,
        _ if parameter.high.is_finite() && parameter.high < 1e14 => 0.1 * parameter.high.abs().max(parameter.low.abs()),
        _ => return None,
    };
    Some(if unit > 0.0 && unit.is_finite() { unit } else { 1.0 })
}

impl Residuals for Problem<'_> {
    fn rows(&self) -> usize {
        self.runs.iter().map(FittedLog::rows).sum()
    }

    fn evaluate(&mut self, x: &[f64], r: &mut [f64]) -> bool {
        self.residuals(x, r)
    }

    fn jacobian(&mut self, x: &[f64], r: &[f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        let (mut jacobian, left) = self.blocks(x, None, bounds, how)?;
        self.by_differences(&left, (x, r), bounds, how, &mut jacobian).then_some(jacobian)
    }

    fn linearised(&mut self, x: &[f64], r: &mut [f64], bounds: &Bounds, how: &Differences) -> Option<DMatrix<f64>> {
        let (mut jacobian, left) = self.blocks(x, Some(r), bounds, how)?;
        self.by_differences(&left, (x, r), bounds, how, &mut jacobian).then_some(jacobian)
    }

    fn is_exact(&self) -> bool {
        self.differences == 0
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::case::{Nuisances, TEMPLATE};
    use crate::log::{Log, Output};
    use crate::signal::Hold;
    use crate::solve::{Solver, simulate};
    use std::sync::Arc;

    /// A pulse of the template with a deviating log, its angle and position with or without an offset.
    pub(crate) fn case(is_off: bool) -> (Case, Plan) {
        logged(&["experiment.0.every=10ms", "experiment.0.until=0.5s"], is_off)
    }

    /// The same of the template with these changes.
    pub(crate) fn logged(changes: &[&str], is_off: bool) -> (Case, Plan) {
        let mut case = Case::from_text_with("axis.toml", TEMPLATE, changes).unwrap();
        case.experiments.truncate(1);
        let run = simulate(&case.machine, &case.experiments[0], Solver::Exact).unwrap().trajectory;
        let column = |name: &str| run.get(name).unwrap().to_vec();
        let noise = |k: usize, size: f64| size * (1.0 + (2.1 * k as f64).sin());
        let outputs = [(Quantity::DriveAngle, 10e-3), (Quantity::CartPosition, 1e-4)].map(|(quantity, size)| {
            let values = column(quantity.name()).iter().enumerate().map(|(k, v)| v + noise(k, size)).collect();
            Output { quantity, absolute: false, values }
        });
        case.experiments[0].log = Some(Arc::new(Log {
            name: "a".into(),
            file: Default::default(),
            time: column("time"),
            inputs: vec![column("voltage")],
            added: None,
            hold: Hold::Zero,
            reference: None,
            outputs: outputs.to_vec(),
            ended: None,
        }));
        let free = vec!["cart.friction.viscous".to_string()];
        (case, Plan { free, nuisance: Nuisances { bias: is_off, ..Nuisances::default() }, ..Plan::default() })
    }

    /// A tenth of the motor's force at the greatest input, in proportion to it.
    #[test]
    fn a_friction_that_may_be_zero_has_the_size_of_the_motors_force() {
        let (case, plan) = case(false);
        let problem = Problem::new(&case, &plan).unwrap();
        let machine = &case.machine;
        let free = Free::new(machine, "cart.friction.coulomb", &[], &[]).unwrap();
        let (motor, r) = (&machine.drives[0].motor, machine.pulley_radius);
        let most = problem.runs[0].logged[0].iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        assert!(most > 0.0);
        for share in [1.0, 1e-3 / most, 1e3] {
            let mut run = problem.runs[0].clone();
            run.logged.iter_mut().flatten().for_each(|u| *u *= share);
            let found = typical(machine, &free, &[run]).unwrap();
            let force = motor.torque_constant * motor.gear_ratio / motor.resistance / r
                * machine.drives[0].amplifier.gain.abs()
                * most
                * share;
            assert!((found / (0.1 * force) - 1.0).abs() < 1e-12, "{share}: {found} {force}");
        }
    }

    /// A first value is as far off as the others, as long as that may be noise that neighbours share. What is further
    /// off is an error of the model, unless it swings.
    #[test]
    fn a_wrong_model_does_not_make_its_start_doubtful() {
        let (case, plan) = case(false);
        for (times, swings, known) in [(0.5, false, 1.0), (3.0, false, 3.0), (100.0, false, 5.0), (100.0, true, 100.0)]
        {
            let mut problem = Problem::new(&case, &plan).unwrap();
            problem.swings = swings;
            let noise = problem.noise().deviation(Quantity::DriveAngle);
            problem.doubt_starts(&[(Quantity::DriveAngle, times * noise)]);
            let start = problem.runs[0].extras.iter().find(|extra| extra.what == Nuisance::StartPosition(0)).unwrap();
            let found = start.known.unwrap() / start.unit;
            assert!((found - known).abs() < 1e-9, "{times} {swings}: {found}");
        }
    }
}

//! A log prepared for the comparison: times, inputs and weights.

use super::acceleration::acceleration;
use crate::case::{Case, Experiment};
use crate::control::{Added, follow};
use crate::design::Design;
use crate::fit::limits::{DITHER_STEPS, EVEN_RASTER, INPUT_BEFORE_WINDOW, RASTER_POINTS};
use crate::log::{Log, Quantity};
use crate::machine::{AmplifierMode, DriveUnit, Machine};
use crate::mechanism::State;
use crate::reach::pull_out;
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{Bench, Detail, Ending, Flow, Solver};
use crate::trajectory::{Grid, Trajectory};
use std::sync::Arc;

/// A nuisance of a log: fitted along, one for each log.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Nuisance {
    /// The input of this drive acts this much later, s; `None` for all inputs.
    Delay(Option<usize>),
    /// Factor on the input of this drive.
    InputGain(usize),
    /// Added to the input of this drive.
    InputOffset(usize),
    /// Position of this slide at the start, m.
    StartPosition(usize),
    /// Speed of this slide at the start, m/s.
    StartSpeed(usize),
    /// Added to an output.
    Bias(usize),
    /// Width of the play between the machine and the sensor of this quantity, in its unit.
    SensorPlay(Quantity),
    /// Factor on the readings of this quantity, less 1.
    SensorScale(Quantity),
    /// Share of that play that lies ahead at the start.
    SensorStart(Quantity),
}

impl Nuisance {
    /// Its name in results; of a machine with several drives and slides with that of its own before it.
    pub fn name(self, machine: &Machine) -> String {
        let geometry = machine.geometry();
        let of_slide = |slide: usize, what: &str| match geometry.slides.len() {
            1 => what.to_string(),
            _ => format!("{}_{what}", geometry.label(geometry.slides[slide].body).key),
        };
        let of_drive = |drive: usize, what: &str| format!("{}_{what}", geometry.drives[drive].input);
        match self {
            Nuisance::Delay(None) => "delay".into(),
            Nuisance::Delay(Some(drive)) => of_drive(drive, "delay"),
            Nuisance::InputGain(drive) => of_drive(drive, "gain"),
            Nuisance::InputOffset(drive) => of_drive(drive, "offset"),
            Nuisance::StartPosition(slide) => of_slide(slide, "start_position"),
            Nuisance::StartSpeed(slide) => of_slide(slide, "start_speed"),
            Nuisance::Bias(_) => "bias".into(),
            Nuisance::SensorPlay(_) => "sensor_play".into(),
            Nuisance::SensorScale(_) => "sensor_scale".into(),
            Nuisance::SensorStart(_) => "sensor_start".into(),
        }
    }

    /// Its unit; empty for a bias, which has that of its output.
    pub fn unit(self, machine: &Machine) -> &'static str {
        match self {
            Nuisance::Delay(_) => "s",
            Nuisance::InputOffset(drive) => machine.drives[drive].amplifier.mode.unit(),
            Nuisance::StartPosition(_) => "m",
            Nuisance::StartSpeed(_) => "m/s",
            Nuisance::SensorPlay(quantity) => quantity.unit(),
            Nuisance::InputGain(_) | Nuisance::Bias(_) | Nuisance::SensorScale(_) | Nuisance::SensorStart(_) => "",
        }
    }

    /// True if it is where a run begins, or how fast.
    pub(crate) fn is_start(self) -> bool {
        matches!(self, Nuisance::StartPosition(_) | Nuisance::StartSpeed(_) | Nuisance::SensorStart(_))
    }

    /// True if it is of the play or the scale of a sensor, which changes readings and not the motion.
    pub(crate) fn is_of_sensor(self) -> bool {
        matches!(self, Nuisance::SensorPlay(_) | Nuisance::SensorScale(_) | Nuisance::SensorStart(_))
    }
}

/// A nuisance of a run, and how it is searched.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Extra {
    /// Which.
    pub what: Nuisance,
    /// Value at zero of its variable.
    pub start: f64,
    /// The unit of its variable.
    pub unit: f64,
    /// Least and greatest value.
    pub low: f64,
    /// The greatest.
    pub high: f64,
    /// Its prior standard deviation around `start`. A residual like any other.
    pub known: Option<f64>,
}

/// One output of a log with its weights.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct MeasuredOutput {
    /// The quantity.
    pub quantity: Quantity,
    /// True if its sign was lost.
    pub absolute: bool,
    /// The values, NaN where missing.
    pub values: Vec<f64>,
    /// 1/σ of each; zero for what does not count.
    pub weights: Vec<f64>,
    /// Step of the converter shown by the values; 0 if there is none.
    pub step: f64,
    /// Number of equal values in a row here, which share one rounding error.
    pub repeats: Vec<f64>,
    /// Number of values in a row here that alternate within two steps: at rest, with noise.
    pub alike: Vec<f64>,
}

impl MeasuredOutput {
    /// Values that do not count yet.
    fn new(quantity: Quantity, absolute: bool, values: Vec<f64>) -> Self {
        let step = step_of(&values);
        let (weights, repeats, alike) = (vec![0.0; values.len()], repeats(&values), alike(&values, step));
        Self { quantity, absolute, weights, repeats, alike, values, step }
    }
}

/// A log, or a window of one, and the model's side of it.
#[derive(Debug, Clone)]
pub struct FittedLog {
    /// The experiment's name.
    pub name: String,
    /// Which window of it, from 0; 0 where it is whole.
    pub window: usize,
    /// Times, s.
    pub time: Vec<f64>,
    /// The input of each drive at these times.
    pub logged: Vec<Vec<f64>>,
    /// The outputs.
    pub seen: Vec<MeasuredOutput>,
    /// The part of the logs that it belongs to, if parts have parameters of their own.
    pub part: usize,
    /// True if none of it is fitted.
    pub held_out: bool,
    /// From which row on nothing is fitted.
    pub fitted_rows: usize,
    /// The nuisances.
    pub extras: Vec<Extra>,
    /// The nuisances of all logs at once; their values stand behind those of `extras`.
    shared: Vec<Extra>,
    /// The closed loop, where the input is not as logged.
    closed: Option<Arc<Closed>>,
    /// What [`Self::outrun`] returns for the drives of the case, which most fits do not change.
    outrun: Option<Arc<Outrun>>,
    inputs: Vec<Signal>,
    initial: State,
    every: f64,
    until: f64,
    even: bool,
}

/// A command compared with the speeds at which the steppers of a machine have torque.
#[derive(Debug, Clone)]
struct Outrun {
    /// The drives of the machine, and its radius: nothing else counts.
    drives: Vec<DriveUnit>,
    radius: f64,
    beyond: Option<[f64; 2]>,
}

/// A controller that follows a logged reference again.
#[derive(Debug, Clone)]
struct Closed {
    design: Design,
    /// The machine that the controller assumes: that of the case, whatever is fitted.
    model: Machine,
    profile: Profile,
    added: Option<Added>,
}

/// Options for the conversion of a log to a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct LogOptions {
    /// Length of a window, s; the whole log without.
    pub window: Option<f64>,
    /// After this time nothing is fitted.
    pub fitted_until: Option<f64>,
    /// True if none of it is fitted.
    pub held_out: bool,
}

impl FittedLog {
    /// Time of its last row, s.
    pub fn length(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// The runs of an experiment's log: one, or one for each window.
    pub fn all(experiment: &Experiment, log: &Log, setting: &LogOptions) -> Vec<Self> {
        let end = log.time.last().copied().unwrap_or(0.0);
        let Some(window) = setting.window.filter(|window| *window < end) else {
            return vec![Self::new(experiment, log, 0..log.time.len(), 0, setting)];
        };
        let count = (end / window).round().max(1.0) as usize;
        let mut runs = Vec::new();
        let mut first = 0;
        for k in 0..count {
            let until = if k + 1 == count { f64::INFINITY } else { end * (k + 1) as f64 / count as f64 };
            let last = log.time.partition_point(|&t| t < until);
            if last > first + 4 {
                // The row at the seam belongs to both.
                runs.push(Self::new(experiment, log, first..(last + 1).min(log.time.len()), k, setting));
                first = last;
            }
        }
        runs
    }

    fn new(
        experiment: &Experiment,
        log: &Log,
        rows: std::ops::Range<usize>,
        window: usize,
        setting: &LogOptions,
    ) -> Self {
        let whole = rows.len() == log.time.len();
        let shift = if whole { 0.0 } else { log.time[rows.start] };
        let time: Vec<f64> = log.time[rows.clone()].iter().map(|t| t - shift).collect();
        let logged: Vec<Vec<f64>> = log.inputs.iter().map(|input| input[rows.clone()].to_vec()).collect();
        let n = time.len();
        let (first, last) = (time[0], time[n - 1]);
        let interval = (last - first) / (n - 1) as f64;
        let even = first.abs() <= EVEN_RASTER * interval
            && time.iter().enumerate().all(|(k, t)| (t - first - k as f64 * interval).abs() <= EVEN_RASTER * interval);
        let (every, until) = if even {
            (interval, interval * (n - 1) as f64)
        } else {
            let mut steps: Vec<f64> = time.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let middle = steps.len() / 2;
            let every = *steps.select_nth_unstable_by(middle, f64::total_cmp).1 / RASTER_POINTS;
            (every, every * (last / every).ceil().max(1.0))
        };
        // On the raster, where the solver need not stop twice for a sample.
        let grid = Grid::new(every, until);
        let times = if even { (0..n as u64).map(|k| grid.time(k)).collect() } else { time.clone() };
        let is_logged = |input: &Signal| matches!(input, Signal::Sampled { times: own, .. } if *own == log.time);
        let inputs = if whole && !experiment.inputs.iter().all(is_logged) {
            experiment.inputs.clone()
        } else {
            // A window that is late still has the inputs of what came before it.
            let earlier = rows.start.saturating_sub(INPUT_BEFORE_WINDOW)..rows.start;
            let before = log.time[earlier.clone()].iter().map(|t| t - shift);
            let times: Vec<f64> = before.chain(times).collect();
            let of_drive = |(input, logged): (&Vec<f64>, &Vec<f64>)| {
                let values = input[earlier.clone()].iter().chain(logged).copied().collect();
                Signal::Sampled { times: times.clone(), values, hold: log.hold }
            };
            log.inputs.iter().zip(&logged).map(of_drive).collect()
        };
        let limit = setting.fitted_until.map_or(f64::INFINITY, |until| until - shift);
        let fitted_rows = if setting.held_out { 0 } else { time.partition_point(|&t| t < limit) };
        let seen = log
            .outputs
            .iter()
            .map(|output| MeasuredOutput::new(output.quantity, output.absolute, output.values[rows.clone()].to_vec()))
            .collect();
        Self {
            name: experiment.name.clone(),
            window,
            time,
            logged,
            seen,
            part: 0,
            held_out: setting.held_out,
            fitted_rows,
            extras: Vec::new(),
            shared: Vec::new(),
            closed: None,
            outrun: None,
            inputs,
            initial: experiment.initial,
            every,
            until,
            even,
        }
    }

    /// Has the controller of an axis follow the reference of the log, instead of taking the input as logged.
    ///
    /// A loop hides in its output what it makes up for, and shows it in its command: what was logged as the input is
    /// compared, too.
    pub fn close(&mut self, case: &Case, log: &Log) {
        if let (Some(design), Some(reference)) = (&case.controller, &log.reference) {
            let profile = Profile::sampled(&log.time, reference).shaped(&design.shaper);
            let added = log.added.as_ref().map(|values| Added { times: log.time.clone(), values: values.clone() });
            let amplifier = &case.machine.drives[0].amplifier;
            let (quantity, limit, late) = match amplifier.mode {
                AmplifierMode::Voltage => (Quantity::MotorVoltage, amplifier.voltage_limit, None),
                AmplifierMode::Current | AmplifierMode::Position => {
                    (Quantity::MotorCurrent, amplifier.current_limit, amplifier.bandwidth)
                }
            };
            if late.is_none() && !self.seen.iter().any(|seen| seen.quantity == quantity) {
                let given = |input: &f64| {
                    limit.map_or(amplifier.gain * input, |limit| (amplifier.gain * input).clamp(-limit, limit))
                };
                self.seen.push(MeasuredOutput::new(quantity, false, self.logged[0].iter().map(given).collect()));
            }
            self.closed =
                Some(Arc::new(Closed { design: design.clone(), model: case.machine.clone(), profile, added }));
        }
    }

    /// Compares the command with the speeds of the steppers of the case's machine, once for all machines with these.
    pub(crate) fn know_drives(&mut self, machine: &Machine) {
        if machine.stepper().is_some() {
            let (drives, radius) = (machine.drives.clone(), machine.pulley_radius);
            self.outrun = Some(Arc::new(Outrun { drives, radius, beyond: self.outrun(machine) }));
        }
    }

    /// Says what is fitted along for all logs.
    pub fn share(&mut self, shared: &[Extra]) {
        self.shared = shared.to_vec();
    }

    /// Number of residuals: every output at every time, and what is known of extras beforehand.
    pub fn rows(&self) -> usize {
        self.seen.len() * self.time.len() + self.extras.iter().filter(|extra| extra.known.is_some()).count()
    }

    /// As how many independent values those of an output count: those that share an error of rounding count for less.
    pub fn independent(&self, output: usize) -> f64 {
        let weights = &self.seen[output].weights;
        let most = weights.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        weights.iter().map(|weight| (weight / most).powi(2)).sum()
    }

    /// Residuals of the extras of which something is known, in standard deviations.
    fn beforehand(&self, extras: &[f64]) -> impl Iterator<Item = f64> {
        let pairs = self.extras.iter().zip(extras);
        pairs.filter_map(|(extra, value)| extra.known.map(|deviation| (value - extra.start) / deviation))
    }

    /// True if an extra does no more than shift outputs.
    pub(crate) fn only_shifts(&self, machine: &Machine, extra: &Extra) -> bool {
        // True if the motion depends on where the slides are, and not only on how far they go.
        let is_placed = machine.changes_along_travel() || machine.slides().any(|slide| slide.travel.is_some());
        match extra.what {
            Nuisance::Bias(_) => true,
            Nuisance::StartPosition(_) => {
                self.seen.iter().all(|seen| !seen.absolute) && !is_placed && !self.has_scaled_sensor()
            }
            Nuisance::Delay(_)
            | Nuisance::InputGain(_)
            | Nuisance::InputOffset(_)
            | Nuisance::StartSpeed(_)
            | Nuisance::SensorPlay(_)
            | Nuisance::SensorScale(_)
            | Nuisance::SensorStart(_) => false,
        }
    }

    /// ∂r/∂x of an extra that only shifts outputs, x being its variable.
    pub fn shift(&self, machine: &Machine, extra: &Extra, out: &mut [f64]) {
        let n = self.time.len();
        for (i, seen) in self.seen.iter().enumerate() {
            let per_unit = match extra.what {
                Nuisance::Bias(index) if index == i => 1.0,
                Nuisance::StartPosition(slide) => per_position(machine, seen.quantity, slide),
                _ => 0.0,
            };
            for (out, weight) in out[i * n..(i + 1) * n].iter_mut().zip(&seen.weights) {
                *out = per_unit * extra.unit * weight;
            }
        }
        let known = self.extras.iter().filter(|extra| extra.known.is_some());
        for (out, own) in out[self.seen.len() * n..].iter_mut().zip(known) {
            *out = if own.what == extra.what { own.known.map_or(0.0, |deviation| own.unit / deviation) } else { 0.0 };
        }
    }

    /// Mean interval between its samples, s.
    pub fn interval(&self) -> f64 {
        self.time.last().unwrap_or(&0.0) / (self.time.len().max(2) - 1) as f64
    }

    /// True if a controller makes its input.
    pub fn is_closed(&self) -> bool {
        self.closed.is_some()
    }

    /// True if it is solved at its own times.
    pub fn is_even(&self) -> bool {
        self.even
    }

    /// The value of an extra among these; `None` if the run does not have it.
    pub(crate) fn extra(&self, what: Nuisance, extras: &[f64]) -> Option<f64> {
        let mut pairs = self.extras.iter().chain(&self.shared).zip(extras);
        pairs.find(|(extra, _)| extra.what == what).map(|(_, value)| *value)
    }

    /// The inputs of the drives as logged, or as the case gives them.
    pub(crate) fn inputs(&self) -> &[Signal] {
        &self.inputs
    }

    /// Initial state of the model for these values of the extras, which also set the gains of its amplifiers.
    pub(crate) fn initial(&self, machine: &mut Machine, extras: &[f64]) -> State {
        for (drive, unit) in machine.drives.iter_mut().enumerate() {
            unit.amplifier.gain *= self.extra(Nuisance::InputGain(drive), extras).unwrap_or(1.0);
        }
        let slides = machine.geometry().slides;
        // Of all slides, if an extra has one of them.
        let fitted = |what: fn(usize) -> Nuisance, given: &[f64]| -> Option<Vec<f64>> {
            let own: Vec<_> = (0..slides.len()).map(|slide| self.extra(what(slide), extras)).collect();
            let all = own.iter().zip(slides).map(|(own, slide)| own.unwrap_or(given[slide.body]));
            own.iter().any(Option::is_some).then(|| all.collect())
        };
        let mut initial = self.initial;
        if let Some(positions) = fitted(Nuisance::StartPosition, &initial.position) {
            initial.position = machine.without_strain(&positions, &[]).position;
        }
        if let Some(speeds) = fitted(Nuisance::StartSpeed, &initial.speed) {
            initial.speed = machine.without_strain(&[], &speeds).speed;
        }
        initial
    }

    /// The experiment that the model is put through, with these values of the extras.
    pub fn experiment(&self, machine: &mut Machine, extras: &[f64]) -> Experiment {
        let initial = self.initial(machine, extras);
        let inputs = (0..self.inputs.len()).map(|drive| self.fed(drive, extras)).collect();
        Experiment { inputs, initial, until: self.until, every: self.every, ..empty() }
    }

    /// Delays all inputs that were sampled by as much more, s.
    pub(crate) fn delay_inputs(&mut self, by: f64) {
        for input in &mut self.inputs {
            if let Signal::Sampled { times, .. } = input {
                times.iter_mut().for_each(|time| *time += by);
            }
        }
    }

    /// Delay of the input of a drive, s; `None` if none is fitted.
    pub(crate) fn delay(&self, drive: usize, extras: &[f64]) -> Option<f64> {
        let delays = [None, Some(drive)].map(|of| self.extra(Nuisance::Delay(of), extras));
        delays.into_iter().flatten().reduce(|common, own| common + own)
    }

    /// The input of a drive, later and with more added to it by the extras.
    fn fed(&self, drive: usize, extras: &[f64]) -> Signal {
        let delay = self.delay(drive, extras).unwrap_or(0.0);
        let offset = self.extra(Nuisance::InputOffset(drive), extras).unwrap_or(0.0);
        let mut input = match &self.inputs[drive] {
            Signal::Sampled { times, values, hold } if delay != 0.0 || offset != 0.0 => Signal::Sampled {
                times: times.iter().map(|t| t + delay).collect(),
                values: values.iter().map(|u| u + offset).collect(),
                hold: *hold,
            },
            other => other.clone(),
        };
        if !matches!(input, Signal::Sampled { .. }) {
            if delay > 0.0 {
                let nothing = solve_slot(Signal::Step { value: 0.0, at: 0.0 }, delay);
                input = Signal::sequence(vec![nothing, solve_slot(input, f64::INFINITY)]);
            }
            if offset != 0.0 {
                input = Signal::Sum(vec![input, Signal::Step { value: offset, at: 0.0 }]);
            }
        }
        input
    }

    /// Largest speed of a stepper's command, and the largest at which the stepper counts as having torque, m/s, if most
    /// of the commanded path is faster than that; none for other motors.
    ///
    /// A rotor is out of step there whatever its load, and a simulation resolves each turn of the field: a command in
    /// the wrong unit takes minutes.
    pub(crate) fn outrun(&self, machine: &Machine) -> Option<[f64; 2]> {
        let is_known = |known: &&Arc<Outrun>| known.radius == machine.pulley_radius && known.drives == machine.drives;
        if let Some(known) = self.outrun.as_ref().filter(is_known) {
            return known.beyond;
        }
        let beyond = |(unit, input): (&DriveUnit, &Signal)| {
            let most = pull_out::fastest(unit)? * machine.pulley_radius / unit.amplifier.gain.abs();
            let (mut path, mut outrun, mut peak) = (0.0, 0.0, 0.0f64);
            for step in self.time.windows(2) {
                // Jumps from one held value to the next have no speed.
                let speed = input.piece(step[0]).coefficients[1].abs();
                let length = speed * (step[1] - step[0]);
                path += length;
                outrun += if speed > most { length } else { 0.0 };
                peak = peak.max(speed);
            }
            (outrun > 0.5 * path).then_some([peak, most])
        };
        machine.drives.iter().zip(&self.inputs).find_map(beyond)
    }

    /// The model's outputs at the log's times, one column for each, before what sensors make of them; false where it
    /// does not reach the end.
    pub fn predict(
        &self,
        bench: &mut Bench,
        machine: &Machine,
        extras: &[f64],
        quantities: &[Quantity],
        out: &mut [Vec<f64>],
    ) -> bool {
        if self.outrun(machine).is_some() {
            return false;
        }
        let mut machine = machine.clone();
        let experiment = self.experiment(&mut machine, extras);
        let mut slopes: Vec<Vec<f64>> = vec![Vec::new(); quantities.len()];
        out.iter_mut().for_each(Vec::clear);
        let solver = Solver::for_machine(&machine);
        let shown = machine.clone();
        let mut take = |block: &Trajectory| {
            for (i, quantity) in quantities.iter().enumerate() {
                match quantity.is_acceleration() {
                    true => out[i].extend(acceleration(block, &shown, *quantity)),
                    false => out[i].extend_from_slice(column(block, *quantity)),
                }
                if !self.even
                    && let Some(speed) = quantity.speed()
                {
                    slopes[i].extend_from_slice(column(block, speed));
                }
            }
            Flow::Continue
        };
        let outcome = match &self.closed {
            Some(closed) => {
                let Closed { design, model, profile, added } = closed.as_ref();
                follow(&machine, model, design, (profile, added.as_ref()), &experiment, solver, &mut take)
            }
            None => {
                machine.encoder = None;
                // A rotor of its own has columns that only the whole table has, and so have all forces on a slide.
                let is_beyond = |quantity: &Quantity| quantity.is_of_rotor() || quantity.is_acceleration();
                let detail = if quantities.iter().any(is_beyond) { Detail::Full } else { Detail::Lean };
                bench.mount(&machine).and_then(|()| bench.run(&experiment, detail, &mut take))
            }
        };
        if !outcome.is_ok_and(|outcome| outcome.ending == Ending::Complete) {
            return false;
        }
        if !self.even {
            for (values, slopes) in out.iter_mut().zip(&slopes) {
                *values = self.time.iter().map(|&t| between(values, slopes, t / self.every, self.every)).collect();
            }
        }
        out.iter().all(|values| values.len() == self.time.len())
    }

    /// Weighted residuals, model minus log, with this model and these extras.
    pub fn residuals(&self, bench: &mut Bench, machine: &Machine, extras: &[f64], out: &mut [f64]) -> bool {
        let quantities: Vec<Quantity> = self.seen.iter().map(|seen| seen.quantity).collect();
        let mut columns = vec![Vec::with_capacity(self.time.len()); self.seen.len()];
        if !self.predict(bench, machine, extras, &quantities, &mut columns) {
            return false;
        }
        self.compare(&columns, extras, out)
    }

    /// Weighted residuals of what a model answered, one column for each output; false where it is too short.
    pub(crate) fn compare(&self, columns: &[Vec<f64>], extras: &[f64], out: &mut [f64]) -> bool {
        if columns.iter().any(|column| column.len() != self.time.len()) {
            return false;
        }
        let n = self.time.len();
        for (out, own) in out[self.seen.len() * n..].iter_mut().zip(self.beforehand(extras)) {
            *out = own;
        }
        for (i, (seen, column)) in self.seen.iter().zip(columns).enumerate() {
            let read = self.read(i, column, extras);
            for (k, out) in out[i * n..(i + 1) * n].iter_mut().enumerate() {
                *out = if seen.weights[k] == 0.0 { 0.0 } else { seen.weights[k] * (read[k] - seen.values[k]) };
            }
        }
        true
    }

    /// True if the readings of a sensor have a factor.
    pub(crate) fn has_scaled_sensor(&self) -> bool {
        self.extras.iter().chain(&self.shared).any(|extra| matches!(extra.what, Nuisance::SensorScale(_)))
    }

    /// The factor on the readings of output `index`.
    pub(crate) fn sensor_scale(&self, index: usize, extras: &[f64]) -> f64 {
        1.0 + self.extra(Nuisance::SensorScale(self.seen[index].quantity), extras).unwrap_or(0.0)
    }

    /// The bias of output `index`.
    pub fn bias(&self, index: usize, extras: &[f64]) -> f64 {
        let own = self.extras.iter().zip(extras).filter(|(extra, _)| extra.what == Nuisance::Bias(index));
        own.map(|(_, bias)| bias).sum()
    }
}

/// An experiment without anything.
fn empty() -> Experiment {
    Experiment {
        name: String::new(),
        inputs: vec![Signal::Step { value: 0.0, at: 0.0 }],
        until: 1.0,
        every: 1.0,
        initial: State::default(),
        log: None,
    }
}

fn solve_slot(signal: Signal, lasts: f64) -> crate::signal::Slot {
    crate::signal::Slot { signal, lasts }
}

/// The column of a run that an output is compared with.
pub(crate) fn column(block: &Trajectory, quantity: Quantity) -> &[f64] {
    let (name, other) = heading_of(quantity);
    block.get(name).or_else(|| block.get(other)).unwrap_or(&[])
}

/// The heading of the column of a quantity, and that of its replacement if it has no column.
pub(crate) fn heading_of(quantity: Quantity) -> (&'static str, &'static str) {
    let name = quantity.name();
    let other = match name {
        "motor_voltage" => "voltage",
        "rotor_angle" => "drive_angle",
        "rotor_speed" => "drive_speed",
        "left_rotor_angle" => "left_angle",
        "left_rotor_speed" => "left_speed",
        "right_rotor_angle" => "right_angle",
        "right_rotor_speed" => "right_speed",
        _ => name,
    };
    (name, other)
}

/// Derivative of a quantity with respect to the start position of a slide, per metre.
pub(crate) fn per_position(machine: &Machine, quantity: Quantity, slide: usize) -> f64 {
    machine.geometry().by_slides(quantity, machine.pulley_radius).get(slide).copied().unwrap_or(0.0)
}

/// The value at `at` rows of a raster of `h`.
pub(crate) fn between(values: &[f64], slopes: &[f64], at: f64, h: f64) -> f64 {
    let cell = (at.floor().max(0.0) as usize).min(values.len().saturating_sub(2));
    let s = at - cell as f64;
    let (a, b) = (values[cell], values[cell + 1]);
    if slopes.is_empty() {
        return a + s * (b - a);
    }
    let (va, vb) = (h * slopes[cell], h * slopes[cell + 1]);
    // Hermite's cubic.
    let (s2, s3) = (s * s, s * s * s);
    a + (3.0 * s2 - 2.0 * s3) * (b - a) + (s - 2.0 * s2 + s3) * va + (s3 - s2) * vb
}

/// The step of which all differences between neighbours are multiples; 0 if there is none.
fn step_of(values: &[f64]) -> f64 {
    let differences: Vec<f64> =
        values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|d| d.is_finite() && *d > 0.0).collect();
    let size = values.iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
    let real: Vec<f64> = differences.into_iter().filter(|d| *d > 1e-9 * size).collect();
    let Some(least) = real.iter().copied().min_by(f64::total_cmp) else { return 0.0 };
    // Numbers in files are rounded themselves.
    let whole = |d: &&f64| (*d / least - (*d / least).round()).abs() <= 0.05;
    let many = real.iter().filter(whole).count();
    if many as f64 >= 0.98 * real.len() as f64 && real.len() >= 3 { least } else { 0.0 }
}

/// For each value how many equal ones stand around it in a row.
fn repeats(values: &[f64]) -> Vec<f64> {
    values.chunk_by(|a, b| a == b).flat_map(|same| std::iter::repeat_n(same.len() as f64, same.len())).collect()
}

/// For each value how many stand around it in a row within two steps, often to and fro; 1 where they do not.
fn alike(values: &[f64], step: f64) -> Vec<f64> {
    let mut alike = vec![1.0; values.len()];
    let mut first = 0;
    while step > 0.0 && first < values.len() {
        let (mut low, mut high) = (values[first], values[first]);
        let (mut up, mut down) = (0, 0);
        let mut last = first + 1;
        while last < values.len() && values[last].is_finite() {
            let (least, most) = (low.min(values[last]), high.max(values[last]));
            if most - least > 2.5 * step {
                break;
            }
            (low, high) = (least, most);
            up += usize::from(values[last] > values[last - 1]);
            down += usize::from(values[last] < values[last - 1]);
            last += 1;
        }
        if up.min(down) >= DITHER_STEPS.max((last - first) / 100) {
            alike[first..last].fill((last - first) as f64);
        }
        first = last;
    }
    alike
}

/// Variance of what remains of rounding to this step in the mean of many values at rest, over all places of rest, where
/// they tremble by a normal deviation σ: Δ²/12 without noise, as good as nothing from σ = Δ/2 on.
///
/// The mean of a rounded value is off by Σₖ (−1)ᵏ Δ/(πk) e^(−2π²k²σ²/Δ²) sin(2πkx/Δ) (Widrow 1956); over all x that has
/// the variance Σₖ Δ²/(2π²k²) e^(−4π²k²σ²/Δ²).
pub fn rounding_at_rest(step: f64, deviation: f64) -> f64 {
    use std::f64::consts::PI;
    let term = |k: u32| {
        let k2 = f64::from(k * k);
        (-4.0 * PI * PI * k2 * (deviation / step).powi(2)).exp() / k2
    };
    if step > 0.0 { step * step / (2.0 * PI * PI) * (1..200).map(term).sum::<f64>() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::TEMPLATE;
    use crate::fit::asked::problem::tests::case;
    use crate::log::Output;
    use crate::signal::Hold;
    use crate::solve::simulate;

    #[test]
    fn steps_of_converters_are_found() {
        let counts: Vec<f64> = (0..200).map(|k| (f64::from(k) * 1.37).round() * 0.01).collect();
        assert!((step_of(&counts) - 0.01).abs() < 1e-12);
        let smooth: Vec<f64> = (0..200).map(|k| (f64::from(k) * 0.1).sin()).collect();
        assert_eq!(step_of(&smooth), 0.0);
    }

    #[test]
    fn what_trembles_at_rest_is_told_from_what_moves() {
        let values = [0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 3.0, 3.0, 5.0, 4.0, 3.0, 6.0, 7.0];
        let found = alike(&values, 1.0);
        assert_eq!((&found[..3], &found[3..11], &found[11..]), (&[1.0; 3][..], &[8.0; 8][..], &[1.0; 2][..]));
        assert!((rounding_at_rest(2.0, 0.0) / (4.0 / 12.0) - 1.0).abs() < 5e-3);
        assert!(rounding_at_rest(2.0, 2.0) < 1e-15);
    }

    /// The input of a window was nothing until the delay had passed, as if the machine had been switched on there: the
    /// model's windows left the whole run at their first rows, and a delay could not be found in them.
    #[test]
    fn a_window_that_is_late_goes_on_with_the_input_from_before_it() {
        let changes = ["belt={ model = \"rigid\" }"];
        let case = Case::from_text_with("axis.toml", TEMPLATE, &changes).unwrap();
        let mut experiment = case.experiments[1].clone();
        let rows = simulate(&case.machine, &experiment, Solver::for_machine(&case.machine)).unwrap().trajectory;
        let column = |name: &str| rows.get(name).unwrap().to_vec();
        let outputs = [Quantity::CartPosition, Quantity::CartSpeed];
        let log = Log {
            name: experiment.name.clone(),
            file: Default::default(),
            time: column("time"),
            inputs: vec![column("voltage")],
            added: None,
            hold: Hold::Zero,
            reference: None,
            outputs: outputs
                .map(|quantity| Output { quantity, absolute: false, values: column(quantity.name()) })
                .to_vec(),
            ended: None,
        };
        experiment.inputs[0] =
            Signal::Sampled { times: log.time.clone(), values: log.inputs[0].clone(), hold: log.hold };
        let predicted = |run: &mut FittedLog, known: &[(Nuisance, f64)]| {
            let extra = |what| Extra { what, start: 0.0, unit: 1.0, low: -1.0, high: 1.0, known: None };
            run.extras = known.iter().map(|(what, _)| extra(*what)).collect();
            let values: Vec<f64> = known.iter().map(|(_, value)| *value).collect();
            let mut columns = vec![Vec::new(); 2];
            assert!(run.predict(&mut Bench::default(), &case.machine, &values, &outputs, &mut columns));
            columns
        };
        let late = (Nuisance::Delay(None), 12e-3);
        let whole = predicted(&mut FittedLog::all(&experiment, &log, &LogOptions::default())[0], &[late]);
        // Windows of 40 rows: seams in every phase of the pulses, and more delay than some inputs last in a window.
        let setting = LogOptions { window: Some(0.04), ..LogOptions::default() };
        let mut first = 0;
        for mut run in FittedLog::all(&experiment, &log, &setting) {
            let begin = [(Nuisance::StartPosition(0), whole[0][first]), (Nuisance::StartSpeed(0), whole[1][first])];
            let own = predicted(&mut run, &[late, begin[0], begin[1]]);
            for (own, whole) in own.iter().zip(&whole) {
                for (k, (own, whole)) in own.iter().zip(&whole[first..]).enumerate() {
                    assert!((own - whole).abs() < 1e-9, "window {}, row {k}: {own} {whole}", run.window);
                }
            }
            first += run.time.len() - 1;
        }
        assert_eq!(first + 1, log.time.len());
    }

    #[test]
    fn cubics_go_through_cubics() {
        let (h, f) = (0.5, |t: f64| 1.0 + t - 2.0 * t * t + 0.5 * t * t * t);
        let slope = |t: f64| 1.0 - 4.0 * t + 1.5 * t * t;
        let at = |k: usize| k as f64 * h;
        let values: Vec<f64> = (0..5).map(|k| f(at(k))).collect();
        let slopes: Vec<f64> = (0..5).map(|k| slope(at(k))).collect();
        for t in [0.0, 0.2, 0.77, 1.9, 2.0] {
            assert!((between(&values, &slopes, t / h, h) - f(t)).abs() < 1e-12);
        }
    }

    /// A clock that is 0.03 % fast, in a file with microseconds or with steps of 5 µs.
    #[test]
    fn times_with_microseconds_are_even() {
        let (case, _) = case(false);
        let is_even = |digit: f64| {
            let mut log = (**case.experiments[0].log.as_ref().unwrap()).clone();
            log.time = (0..log.time.len()).map(|k| digit * (1.000_314e-3 * k as f64 / digit).round()).collect();
            FittedLog::all(&case.experiments[0], &log, &LogOptions::default())[0].is_even()
        };
        assert!(is_even(1e-6) && !is_even(5e-6));
    }
}

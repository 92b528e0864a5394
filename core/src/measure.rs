//! Logs as a recorder writes them: encoder counts, and converters with steps, noise and limits, at its own instants.
//!
//! Sample k is taken at k·T − delay + jitter and recorded with the time k·T. The run is solved on a grid of T/n:
//! - Without jitter, n ≤ 1000 is chosen so that every instant lies on the grid; then samples are exact.
//! - With jitter, or without such an n, n is 20, and samples are interpolated linearly: the error is at most (T/20)²
//!   max|ÿ| / 8 for a smooth value; near a jump they lie between both sides.
//!
//! A sample before time zero has the initial state without input.

use crate::chance::normal;
use crate::error::{Error, Result};
use crate::machine::{AmplifierMode, Channel, Encoder, EncoderPlace, Machine, Measurement, Quantity};
use crate::plan::Experiment;
use crate::signal::Signal;
use crate::solve::{self, Flow, Grid, Outcome, Solution, Solver};
use crate::trajectory::{Column, Trajectory};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::SeedableRng;

/// Finest grid tried for the instants.
const FINEST: u32 = 1000;

/// Grid for interpolated samples.
const INTERPOLATED: u32 = 20;

/// Largest shift of an instant by jitter, in intervals, so that samples keep their order.
const FARTHEST: f64 = 0.5;

/// Runs `experiment` on `machine` and records it.
///
/// The columns are time, the commanded input (`voltage` or `current`), `encoder_count` with its angle or position, and
/// the channels of the measurement.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::{measure::measure, solve::Solver, machine::Measurement};
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let log = measure(&case.machine, &Measurement::default(), &case.experiments[0], Solver::Exact)?.trajectory;
/// let headings: Vec<String> = log.columns.iter().map(|column| column.heading()).collect();
/// assert_eq!(headings, ["time_s", "voltage_V", "encoder_count", "drive_angle_rad"]);
/// # Ok::<(), taut::Error>(())
/// ```
pub fn measure(
    machine: &Machine,
    measurement: &Measurement,
    experiment: &Experiment,
    solver: Solver,
) -> Result<Solution> {
    let mut trajectory = Trajectory::default();
    let outcome = stream(machine, measurement, experiment, solver, &mut |block| {
        trajectory.append(block);
        Flow::Continue
    })?;
    Ok(Solution { trajectory, outcome })
}

/// Records a run and passes the samples to `sink` in blocks, so that memory stays bounded.
pub fn stream(
    machine: &Machine,
    measurement: &Measurement,
    experiment: &Experiment,
    solver: Solver,
    sink: &mut dyn FnMut(&Trajectory) -> Flow,
) -> Result<Outcome> {
    if machine.encoder.is_none() && measurement.channels.is_empty() {
        return Err(Error::new("nothing is recorded: there is no encoder and no other recorded quantity")
            .next("add [encoder], or [measurement] with a quantity such as motor_current = { step = \"10 mA\" }"));
    }
    // A recorder keeps its interval: the rest of the run after its last sample is not recorded.
    let grid = Grid::new(measurement.every.unwrap_or(experiment.every), experiment.until).beats();
    let raster = Raster::new(grid.interval(), measurement);
    let devices = Device::all(machine, measurement, experiment);

    // At rest before time zero: the first row without an input.
    let still =
        Experiment { inputs: vec![Signal::Step { value: 0.0, at: 0.0 }], until: grid.interval(), ..experiment.clone() };
    let still = Experiment { every: still.until, ..still };
    let mut before = Vec::new();
    solve::stream(machine, &still, solver, &mut |block| {
        if before.is_empty() {
            before = devices.iter().map(|device| device.source(block).map_or(f64::NAN, |values| values[0])).collect();
        }
        Flow::Stop
    })?;

    let points = (grid.intervals() * u64::from(raster.points) + raster.beyond).max(1);
    let every = grid.interval() / f64::from(raster.points);
    let fine = Experiment { every, until: points as f64 * every, ..experiment.clone() };
    let mut recorder = Recorder {
        grid,
        raster,
        jitter: random(measurement.seed, &experiment.name, "jitter"),
        input: &experiment.inputs[0],
        last: before.clone(),
        before,
        devices,
        seen: 0,
        sample: 0,
        instant: 0.0,
        block: Trajectory::default(),
    };
    recorder.block.columns = recorder.headings(machine);
    recorder.instant = recorder.draw();
    solve::stream(machine, &fine, solver, &mut |rows| recorder.take(rows, sink))
}

/// Grid on which the run is solved, relative to the samples.
struct Raster {
    /// Points per interval.
    points: u32,
    /// Delay in points; an integer if every instant lies on a point.
    delay: f64,
    /// Standard deviation of an instant, in points.
    jitter: f64,
    /// Points after the end of the run that a late last sample may need.
    beyond: u64,
}

impl Raster {
    fn new(interval: f64, measurement: &Measurement) -> Self {
        let delay = measurement.delay / interval;
        let whole = |points: f64| (delay * points - (delay * points).round()).abs() <= 1e-9 * (delay * points).max(1.0);
        let exact = (1..=FINEST).find(|&points| measurement.jitter == 0.0 && whole(f64::from(points)));
        let points = exact.unwrap_or(INTERPOLATED);
        let delay = delay * f64::from(points);
        Self {
            points,
            delay: if exact.is_some() { delay.round() } else { delay },
            jitter: measurement.jitter / interval * f64::from(points),
            beyond: if measurement.jitter > 0.0 { u64::from(points) } else { 0 },
        }
    }
}

/// Makes samples from the rows of the grid.
struct Recorder<'a> {
    grid: Grid,
    raster: Raster,
    jitter: Pcg64,
    input: &'a Signal,
    devices: Vec<Device>,
    /// Inputs of the devices before time zero, and the latest ones.
    before: Vec<f64>,
    last: Vec<f64>,
    /// Number of grid rows received.
    seen: u64,
    /// The next sample, and its instant in grid points.
    sample: u64,
    instant: f64,
    block: Trajectory,
}

impl Recorder<'_> {
    /// The instant of the next sample.
    fn draw(&mut self) -> f64 {
        let Raster { points, delay, jitter, .. } = self.raster;
        let farthest = FARTHEST * f64::from(points);
        let late = if jitter > 0.0 { (jitter * normal(&mut self.jitter)).clamp(-farthest, farthest) } else { 0.0 };
        (self.sample * u64::from(points)) as f64 - delay + late
    }

    fn take(&mut self, rows: &Trajectory, sink: &mut dyn FnMut(&Trajectory) -> Flow) -> Flow {
        let sources: Vec<&[f64]> = self.devices.iter().map(|device| device.source(rows).unwrap_or(&[])).collect();
        self.block.columns.iter_mut().for_each(|column| column.values.clear());
        let end = self.seen + rows.len() as u64;
        // A sample needs the points on both sides of its instant.
        while self.sample <= self.grid.intervals() && self.instant.max(0.0).ceil() < end as f64 {
            let time = self.grid.time(self.sample);
            let mut next = self.block.columns.iter_mut().map(|column| &mut column.values);
            let mut put = |value: f64| {
                if let Some(values) = next.next() {
                    values.push(value);
                }
            };
            put(time);
            put(self.input.value(time));
            for (i, device) in self.devices.iter_mut().enumerate() {
                let at = |point: f64| match point as u64 {
                    point if point < self.seen => self.last[i],
                    point => sources[i].get((point - self.seen) as usize).copied().unwrap_or(f64::NAN),
                };
                let (floor, part) = (self.instant.floor(), self.instant.fract());
                let value = match () {
                    () if self.instant < 0.0 => self.before[i],
                    () if part == 0.0 => at(floor),
                    () => at(floor) + part * (at(floor + 1.0) - at(floor)),
                };
                device.read(value, &mut put);
            }
            self.sample += 1;
            self.instant = self.draw();
        }
        for (last, source) in self.last.iter_mut().zip(&sources) {
            *last = source.last().copied().unwrap_or(*last);
        }
        self.seen = end;
        if self.block.is_empty() { Flow::Continue } else { sink(&self.block) }
    }

    /// The columns of a log, without rows.
    fn headings(&self, machine: &Machine) -> Vec<Column> {
        let (input, unit) = match machine.drives[0].amplifier.mode {
            AmplifierMode::Voltage => ("voltage", "V"),
            AmplifierMode::Current => ("current", "A"),
            AmplifierMode::Position => ("position", "m"),
        };
        let mut columns = vec![Column::new("time", "s"), Column::new(input, unit)];
        columns.extend(self.devices.iter().flat_map(Device::headings));
        columns
    }
}

/// Sensor or recorder of a quantity.
enum Device {
    /// Counts with their angle or position.
    Encoder {
        at: EncoderPlace,
        /// Counts per radian of the drive pulley, or per metre.
        counts: f64,
    },
    /// Counts of a scale beside the encoder, per metre.
    Scale { counts: f64 },
    /// An analogue-to-digital converter.
    Converter { channel: Channel, noise: Pcg64 },
}

impl Device {
    fn all(machine: &Machine, measurement: &Measurement, experiment: &Experiment) -> Vec<Self> {
        let counts = |encoder: Encoder| encoder.counts_per_unit(machine.drives[0].motor.gear_ratio);
        let encoder = machine.encoder.map(|encoder| Device::Encoder { at: encoder.at, counts: counts(encoder) });
        let scale = machine.scale.map(|scale| Device::Scale { counts: counts(scale) });
        let converter = |&channel: &Channel| {
            let noise = random(measurement.seed, &experiment.name, channel.quantity.name());
            Device::Converter { channel, noise }
        };
        encoder.into_iter().chain(scale).chain(measurement.channels.iter().map(converter)).collect()
    }

    /// The column of a run that it measures.
    fn source<'a>(&self, rows: &'a Trajectory) -> Option<&'a [f64]> {
        match self {
            // Before the gear it measures the rotor, which turns with the drive pulley unless the gear is compliant.
            Device::Encoder { at: EncoderPlace::Motor, .. } => {
                rows.get("rotor_angle").or_else(|| rows.get("drive_angle"))
            }
            Device::Encoder { at: EncoderPlace::DrivePulley, .. } => rows.get("drive_angle"),
            Device::Encoder { at: EncoderPlace::Cart, .. } | Device::Scale { .. } => rows.get("cart_position"),
            // Without a column of its own, the terminal voltage is that of the amplifier.
            Device::Converter { channel: Channel { quantity: Quantity::MotorVoltage, .. }, .. } => {
                rows.get("motor_voltage").or_else(|| rows.get("voltage"))
            }
            Device::Converter { channel, .. } => rows.get(channel.quantity.name()),
        }
    }

    fn headings(&self) -> Vec<Column> {
        match self {
            Device::Encoder { at: EncoderPlace::Cart, .. } => {
                vec![Column::new("encoder_count", ""), Column::new("cart_position", "m")]
            }
            Device::Scale { .. } => vec![Column::new("scale_count", ""), Column::new("cart_position", "m")],
            Device::Encoder { .. } => vec![Column::new("encoder_count", ""), Column::new("drive_angle", "rad")],
            Device::Converter { channel, .. } => vec![Column::new(channel.quantity.name(), channel.quantity.unit())],
        }
    }

    fn read(&mut self, value: f64, put: &mut dyn FnMut(f64)) {
        match self {
            Device::Encoder { counts, .. } | Device::Scale { counts } => {
                // The nearest count; + 0.0 turns −0 into 0.
                let count = (value * *counts).round() + 0.0;
                put(count);
                put(count / *counts);
            }
            Device::Converter { channel, noise } => {
                let noise = if channel.noise > 0.0 { channel.noise * normal(noise) } else { 0.0 };
                put(convert(value + noise, channel));
            }
        }
    }
}

/// The converter's reading of a value: the nearest step within its range.
fn convert(value: f64, channel: &Channel) -> f64 {
    let range = channel.range.unwrap_or(f64::INFINITY);
    let Some(step) = channel.step else { return value.clamp(-range, range) };
    // Full steps only: a range of 10 in steps of 3 ends at 9.
    let most = (range / step * (1.0 + 1e-12)).floor();
    let code = (value / step).round().clamp(-most, most) + 0.0;
    // For a step of 1/n, three steps are 3/n: 0.03, which 3 × 0.01 is not.
    let inverse = (1.0 / step).round();
    if inverse >= 1.0 && 1.0 / inverse == step { code / inverse } else { code * step }
}

/// The random numbers of one device in one run: others do not change when a device or an experiment is added.
fn random(seed: u64, experiment: &str, device: &str) -> Pcg64 {
    // The generator spreads it over its own seed.
    let bytes = seed.to_le_bytes().into_iter().chain(experiment.bytes()).chain([0]).chain(device.bytes());
    Pcg64::seed_from_u64(crate::chance::hash(bytes))
}

//! Closed loop: samples, counts, delay and limit between a controller and the axis.

use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::axis::CART;
use crate::machine::{Encoder, EncoderPlace, Machine};
use crate::mechanism::State;
use crate::quantity::rounded;
use crate::signal::profile::Reference;

/// Maximum number of coordinates of a machine.
pub(super) const SLIDES: usize = 2;

/// Measurements and references of a controller at a sample.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Observation<N = f64> {
    /// Time of the sample, s.
    pub time: f64,
    /// Present reference of the cart; for a drive of a gantry, of its part of the belt.
    pub reference: Reference<N>,
    /// That reference when the command acts, or at the lead of the controller.
    pub ahead: Reference<N>,
    /// Measured position, m along the belt: whole counts.
    pub position: N,
    /// Cart position by an additional scale, m: whole counts; none without a scale.
    pub scale: Option<N>,
    /// Measured motor current, A.
    pub current: N,
}

/// The controller of one drive, stepped once a sample. User-defined controllers implement this trait.
///
/// ```
/// use taut::case::{Case, TEMPLATE};
/// use taut::control::{Controller, Loop, Observation, close};
/// use taut::signal::profile::{Leg, Limits, Profile};
/// use taut::solve::Solver;
///
/// /// So many volts per metre.
/// struct Proportional(f64);
/// impl Controller for Proportional {
///     fn step(&mut self, seen: &Observation) -> f64 {
///         self.0 * (seen.reference.position - seen.position)
///     }
///     fn reset(&mut self) {}
/// }
/// let case = Case::from_text("axis.toml", TEMPLATE)?;
/// let limits = Limits { speed: 0.2, acceleration: 2.0, jerk: None, snap: None };
/// let profile = Profile::new(0.0, &[Leg::To(0.05, limits)])?;
/// let timing = Loop { every: 1e-3, delay: 0.0, limit: Some(12.0), lead: 0.0 };
/// let run = close(&case.machine, &mut [&mut Proportional(3000.0)], &timing, &[profile], 1.0, 50e-6, Solver::Exact)?;
/// assert!(run.figures.cart().error.last.abs() < 1e-3);
/// # Ok::<(), taut::Error>(())
/// ```
pub trait Controller {
    /// Command from the observation, V or A.
    fn step(&mut self, seen: &Observation) -> f64;

    /// Feed-forward command outside the loop, V or A, from the references of all slides when it acts, for a machine
    /// with several drives. Called before [`Controller::step`].
    fn forward(&mut self, _slides: &[Reference]) -> f64 {
        0.0
    }

    /// Reference of the encoder, from that of its part of the belt and those of all slides, for a machine with several
    /// drives.
    fn target(&self, along: Reference, _slides: &[Reference]) -> Reference {
        along
    }

    /// Receives the last command after the limit, without feed-forward.
    fn limited(&mut self, _given: f64) {}

    /// Resets the controller's memory.
    fn reset(&mut self);
}

/// The timing of a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loop {
    /// Sample time T, s.
    pub every: f64,
    /// Time from a sample to its command, s.
    pub delay: f64,
    /// Largest magnitude of the command, V or A.
    pub limit: Option<f64>,
    /// Lead of [`Observation::ahead`] over a sample, s.
    pub lead: f64,
}

impl Loop {
    /// A loop of this sample time, s, without delay, limit and lead.
    pub fn sampled(every: f64) -> Self {
        Self { every, delay: 0.0, limit: None, lead: 0.0 }
    }
}

/// A stored sample of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Sample {
    /// s.
    pub time: f64,
    /// The number of its drive.
    pub drive: usize,
    /// Reference of the cart, or of a gantry's drive, m along the belt.
    pub reference: f64,
    /// Measured position, m.
    pub measured: f64,
    /// Command before the limit, V or A.
    pub asked: f64,
    /// Command after it.
    pub given: f64,
}

/// A known input that is added to a controller's command, held between its times.
#[derive(Debug, Clone, PartialEq)]
pub struct Added {
    /// s, increasing.
    pub times: Vec<f64>,
    /// V or A.
    pub values: Vec<f64>,
}

impl Added {
    /// Values at this interval, s, from time zero.
    pub fn new(every: f64, values: Vec<f64>) -> Self {
        Self { times: (0..values.len()).map(|k| k as f64 * every).collect(), values }
    }

    /// The value at `time`, and the time of the next one.
    pub(crate) fn at(&self, time: f64) -> (f64, f64) {
        let next = self.times.partition_point(|t| *t <= time);
        let value = next.checked_sub(1).and_then(|k| self.values.get(k)).copied().unwrap_or(0.0);
        (value, self.times.get(next).copied().unwrap_or(f64::INFINITY))
    }
}

/// The sensors of the controller of a drive.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensors {
    encoder: Sensor,
    scale: Option<Sensor>,
}

impl Sensors {
    /// The sensor of each drive.
    pub(super) fn from_machine(machine: &Machine) -> Vec<Self> {
        let of_drive = |drive| Self { encoder: Sensor::new(machine, drive), scale: Sensor::of_scale(machine) };
        (0..machine.drives.len()).map(of_drive).collect()
    }

    pub(super) fn exactly(self) -> Self {
        let exact = |sensor: Sensor| Sensor { counts: None, ..sensor };
        Self { encoder: exact(self.encoder), scale: self.scale.map(exact) }
    }

    /// The measured position, m along the belt.
    pub(super) fn position(&self, state: &State) -> f64 {
        self.encoder.read(state)
    }

    /// Cart position by the scale, m.
    pub(super) fn scale(&self, state: &State) -> Option<f64> {
        self.scale.map(|scale| scale.read(state))
    }
}

/// Encoder as a controller reads it, m along the belt; exact for a machine without one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sensor {
    body: usize,
    /// m per unit of the measured quantity.
    length: f64,
    /// Counts per unit of that.
    counts: Option<f64>,
}

impl Sensor {
    /// The sensor of a drive.
    pub(super) fn new(machine: &Machine, drive: usize) -> Self {
        let ratio = machine.drives[drive].motor.gear_ratio;
        let counts = machine.encoder.map(|encoder: Encoder| encoder.counts_per_unit(ratio));
        let (geometry, r) = (machine.geometry(), machine.pulley_radius);
        let (body, length) = match machine.encoder.map(|encoder| encoder.at) {
            Some(EncoderPlace::Cart) => (geometry.cart(), 1.0),
            Some(EncoderPlace::DrivePulley) => (geometry.drives[drive].pulley, r),
            Some(EncoderPlace::Motor) | None => (machine.mechanism().drives[drive].shaft, r),
        };
        Self { body, length, counts }
    }

    /// The scale beside the encoder, if there is one.
    pub(super) fn of_scale(machine: &Machine) -> Option<Self> {
        let counts = machine.scale?.counts_per_unit(machine.drives[0].motor.gear_ratio);
        Some(Self { body: CART, length: 1.0, counts: Some(counts) })
    }

    pub(super) fn read(&self, state: &State) -> f64 {
        let value = state.position[self.body];
        self.length * self.counts.map_or(value, |counts| (value * counts).round() / counts)
    }

    /// One count, m; 0 where it reads exactly.
    pub(super) fn step(&self) -> f64 {
        self.counts.map_or(0.0, |counts| self.length / counts)
    }
}

/// True if the encoder of this machine is at the cart.
pub(crate) fn measures_cart(machine: &Machine) -> bool {
    machine.encoder.is_some_and(|encoder| encoder.at == EncoderPlace::Cart)
}

/// True if a controller on this machine uses the scale beside the encoder: cascades, state feedback and disturbance
/// observers do.
pub fn reads_scale(design: &Design, machine: &Machine) -> bool {
    let structure = design.structure.tunable().reads_scale();
    machine.scale.is_some() && (structure || design.disturbance_observer.is_some())
}

/// Maximum delay of a command, in samples.
const MOST_DELAY: f64 = 1000.0;

/// Maximum number of samples of a run.
const MOST_SAMPLES: f64 = 1e9;

impl Loop {
    /// Rejects an invalid timing for a run that ends at `until`, s.
    pub(super) fn check(&self, until: f64) -> Result<()> {
        let &Self { every, delay, limit, lead } = self;
        let wrong = |what: String, allowed: &str| Err(Error::new(what).allowed(allowed));
        if !(every > 0.0 && every.is_finite()) {
            return wrong(format!("a loop cannot be sampled every {every:?} s"), "above zero");
        }
        if until / every > MOST_SAMPLES {
            let samples = rounded(until / every);
            return wrong(format!("a sample every {every:?} s makes {samples} of them in {until:?} s"), "up to 1e9")
                .map_err(|error| error.next("take a longer sample time, or a shorter run"));
        }
        if !(0.0..=MOST_DELAY * every).contains(&delay) {
            return wrong(format!("a command cannot be {delay:?} s late"), "from zero to 1000 sample times");
        }
        if !limit.is_none_or(|limit| limit > 0.0 && limit.is_finite()) {
            let limit = limit.unwrap_or(f64::NAN);
            return wrong(
                format!("the limit of the command cannot be {limit:?}"),
                "above zero, in V or A; none at all",
            );
        }
        if !(lead >= 0.0 && lead.is_finite()) {
            return wrong(format!("a controller cannot look {lead:?} s ahead"), "from zero on");
        }
        Ok(())
    }

    /// The delay in whole samples, and its remainder, s.
    pub(super) fn samples_late(&self) -> (usize, f64) {
        let ratio = self.delay / self.every;
        // A delay within rounding of whole samples is one.
        let near = ratio.round();
        if (ratio - near).abs() < 1e-9 * near.max(1.0) {
            (near as usize, 0.0)
        } else {
            (ratio.floor() as usize, self.delay - ratio.floor() * self.every)
        }
    }

    /// Sample time, delay, limit and lead of a design.
    pub fn new(design: &crate::design::Design) -> Self {
        let lead = design.feed_forward.lead.unwrap_or(design.delay + 0.5 * design.every);
        Self { every: design.every, delay: design.delay, limit: design.limit, lead }
    }
}

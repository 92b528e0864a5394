//! A controller stepped from outside: the caller provides the reference, and the state of the machine at its samples.

use super::sampled::{Controller, Loop, Observation, SLIDES, Sensors};
use super::standard::Standard;
use crate::design::Design;
use crate::error::Result;
use crate::machine::Machine;
use crate::mechanism::{DRIVES, State};
use crate::signal::profile::Reference;
use crate::trajectory::Interval;
use std::collections::VecDeque;

/// The clock, delay and limit of the controllers of all drives, between two of their decisions.
#[derive(Debug, Clone)]
pub(super) struct Clocked {
    pub timing: Loop,
    clock: Interval,
    /// Sensors of each drive.
    sensors: Vec<Sensors>,
    /// Weights of the slides in the position of each drive along the belt.
    shares: Vec<&'static [f64]>,
    /// Next sample, and the next decision in it: the sample itself, or the start of a delayed command.
    k: u64,
    halfway: bool,
    /// Remainder of the delay beyond whole samples, s.
    rest: f64,
    waiting: VecDeque<Commands>,
    acting: Commands,
}

/// A command of each drive, V or A.
pub(super) type Commands = [f64; DRIVES];

/// References of all slides, at a sample and one lead later.
pub(super) type References = [[Reference; SLIDES]; 2];

/// A command at a sample.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Decision {
    /// Reference of the drive, m along the belt.
    pub reference: f64,
    /// Measured position, m along the belt.
    pub measured: f64,
    /// The command before the limit, V or A.
    pub asked: f64,
    /// After it.
    pub given: f64,
}

impl Clocked {
    pub fn new(machine: &Machine, timing: Loop) -> Self {
        let (whole, rest) = timing.samples_late();
        Self {
            timing,
            clock: Interval::of(timing.every),
            sensors: Sensors::of(machine),
            shares: machine.belt_shares(),
            k: 0,
            halfway: false,
            rest,
            waiting: std::iter::repeat_n([0.0; DRIVES], whole).collect(),
            acting: [0.0; DRIVES],
        }
    }

    /// With exact positions instead of counts.
    pub(crate) fn exactly(mut self) -> Self {
        self.sensors = self.sensors.into_iter().map(Sensors::exactly).collect();
        self
    }

    /// Time of the next decision, s.
    pub fn next(&self) -> f64 {
        self.clock.times(self.k) + if self.halfway { self.rest } else { 0.0 }
    }

    /// The present commands.
    pub(crate) fn acting(&self) -> Commands {
        self.acting
    }

    /// Starts the next commands.
    fn take_over(&mut self) {
        self.k += 1;
        self.acting = self.waiting.pop_front().unwrap_or_default();
    }

    /// Decides at [`Clocked::next`] from the state and the motors' currents, A; `references` are required at a sample.
    /// Returns the decision of each drive if that is a sample; a delayed command needs nothing.
    pub fn decide(
        &mut self,
        controllers: &mut [&mut dyn Controller],
        (state, currents): (&State, &Commands),
        references: impl FnOnce(f64) -> References,
    ) -> Option<[Decision; DRIVES]> {
        if self.halfway {
            self.halfway = false;
            self.take_over();
            return None;
        }
        let time = self.clock.times(self.k);
        let [slides, later] = references(time);
        let mut decisions = [Decision::default(); DRIVES];
        let mut given = [0.0; DRIVES];
        for (drive, controller) in controllers.iter_mut().enumerate() {
            let sensors = &self.sensors[drive];
            let [reference, ahead] = [&slides, &later].map(|slides| along(self.shares[drive], slides));
            let forward = controller.forward(&later);
            let seen = Observation {
                time,
                reference: controller.target(reference, &slides),
                ahead,
                position: sensors.position(state),
                scale: sensors.scale(state),
                current: currents[drive],
            };
            let asked = controller.step(&seen) + forward;
            // NaN and infinity count as zero.
            let asked = if asked.is_finite() { asked } else { 0.0 };
            given[drive] = self.timing.limit.map_or(asked, |limit| asked.clamp(-limit, limit));
            controller.limited(given[drive] - forward);
            let (reference, measured, given) = (reference.position, seen.position, given[drive]);
            decisions[drive] = Decision { reference, measured, asked, given };
        }
        self.waiting.push_back(given);
        match self.rest > 0.0 {
            true => self.halfway = true,
            false => self.take_over(),
        }
        Some(decisions)
    }
}

/// The reference of a drive's part of the belt, from those of the slides.
fn along(weights: &[f64], slides: &[Reference; SLIDES]) -> Reference {
    weights.iter().zip(slides).fold(Reference::default(), |sum, (weight, slide)| sum.plus(*weight, *slide))
}

/// The controller of an axis with its clock, its delay and its limit, between two of its decisions. A clone continues
/// identically.
#[derive(Debug, Clone)]
pub struct Stepped {
    controller: Standard,
    clocked: Clocked,
}

impl Stepped {
    /// The controller of `design` on `machine`, its first sample at time zero.
    pub fn new(design: &Design, machine: &Machine) -> Result<Self> {
        let timing = Loop::of(design);
        timing.check(timing.every)?;
        Ok(Self { controller: Standard::new(design, machine)?, clocked: Clocked::new(machine, timing) })
    }

    /// Time of the next decision, s.
    pub fn next(&self) -> f64 {
        self.clocked.next()
    }

    /// The command that acts now, V or A.
    pub fn command(&self) -> f64 {
        self.clocked.acting()[0]
    }

    /// Decides at [`Stepped::next`] from the state, the motor's current, A, and the reference at that time.
    ///
    /// `ahead` is the reference one lead later ([`Loop::lead`]). Without it the reference is extrapolated by its
    /// derivatives with constant snap, which is wrong where the snap of a profile jumps within the lead. The command
    /// acts until the next decision.
    pub fn decide(&mut self, state: &State, current: f64, reference: &Reference, ahead: Option<&Reference>) -> f64 {
        let ahead = ahead.copied().unwrap_or_else(|| after(reference, self.clocked.timing.lead));
        let mut currents = Commands::default();
        currents[0] = current;
        let references = [*reference, ahead].map(|reference| {
            let mut slides = [Reference::default(); SLIDES];
            slides[0] = reference;
            slides
        });
        self.clocked.decide(&mut [&mut self.controller], (state, &currents), |_| references);
        self.command()
    }
}

impl Stepped {
    /// Its complete state as plain numbers: whether a delayed command is due within the sample, pending and acting
    /// commands, the memory of its law, and the sample number.
    pub fn save(&self) -> Vec<u64> {
        let Clocked { k, halfway, waiting, acting, .. } = &self.clocked;
        let halfway = f64::from(u8::from(*halfway));
        let numbers = [halfway].into_iter().chain(waiting.iter().chain([acting]).map(|commands| commands[0]));
        numbers.chain(self.controller.memory().iter().copied()).map(f64::to_bits).chain([*k]).collect()
    }

    /// Continues bit for bit from the result of [`Stepped::save`] of a controller of the same design. Returns `None`,
    /// and changes nothing, if `saved` does not belong to one.
    pub fn restore(&mut self, saved: &[u64]) -> Option<()> {
        let (k, numbers) = saved.split_last()?;
        let (halfway, numbers) = numbers.split_first()?;
        let halfway = match f64::from_bits(*halfway) {
            0.0 => false,
            1.0 => true,
            _ => return None,
        };
        // Between a sample and the start of its command, that command waits with the others.
        let waiting = self.clocked.timing.samples_late().0 + usize::from(halfway);
        let memory = self.controller.memory_mut();
        if numbers.len() != waiting + 1 + memory.len() {
            return None;
        }
        let mut numbers = numbers.iter().map(|bits| f64::from_bits(*bits));
        let commands = |command: f64| std::array::from_fn(|drive| if drive == 0 { command } else { 0.0 });
        self.clocked.waiting = numbers.by_ref().take(waiting).map(commands).collect();
        self.clocked.acting = commands(numbers.next()?);
        memory.iter_mut().zip(numbers).for_each(|(number, saved)| *number = saved);
        (self.clocked.k, self.clocked.halfway) = (*k, halfway);
        Some(())
    }
}

/// A reference `lead` later, s, with a constant highest derivative.
fn after(reference: &Reference, lead: f64) -> Reference {
    if lead == 0.0 {
        return *reference;
    }
    let Reference { position, speed, acceleration, jerk, snap } = *reference;
    Reference {
        position: position + lead * (speed + lead * (acceleration / 2.0 + lead * (jerk / 6.0 + lead * snap / 24.0))),
        speed: speed + lead * (acceleration + lead * (jerk / 2.0 + lead * snap / 6.0)),
        acceleration: acceleration + lead * (jerk + lead * snap / 2.0),
        jerk: jerk + lead * snap,
        snap,
    }
}

//! Controllers stepped from outside: the caller provides the references, and the state of the machine at their samples.

use super::sampled::{Controller, Loop, Observation, SLIDES, Sensors};
use super::standard::Standard;
use crate::calculator::Evaluation;
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
    /// Sensors of each drive, and the weights of the slides in its position along the belt.
    sensors: Vec<Sensors>,
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
            clock: Interval::new(timing.every),
            sensors: Sensors::from_machine(machine),
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

    /// Decides at [`Clocked::next`] from the state and the motors' currents, A; `references` are required at a sample,
    /// by its number and time, s. Returns the decision of each drive if that is a sample; a delayed command needs
    /// nothing.
    pub fn decide(
        &mut self,
        controllers: &mut [&mut dyn Controller],
        (state, currents): (&State, &Commands),
        references: impl FnOnce(u64, f64) -> References,
    ) -> Option<[Decision; DRIVES]> {
        if self.halfway {
            self.halfway = false;
            self.take_over();
            return None;
        }
        let time = self.clock.times(self.k);
        let [slides, later] = references(self.k, time);
        let mut decisions = [Decision::default(); DRIVES];
        let mut given = [0.0; DRIVES];
        for (drive, controller) in controllers.iter_mut().enumerate() {
            let (sensors, shares) = (&self.sensors[drive], self.shares[drive]);
            let weighed =
                |all: &[Reference; SLIDES]| Reference::weighed(&mut Evaluation::plain(), shares.iter().copied(), all);
            let [reference, ahead] = [&slides, &later].map(weighed);
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

/// The controllers of all drives of a machine with their clock, delay and limit, between two of their decisions. A
/// clone continues identically.
#[derive(Debug, Clone)]
pub struct Stepped {
    controllers: Vec<Standard>,
    clocked: Clocked,
}

impl Stepped {
    /// The controllers of `design` on `machine`, their first sample at time zero.
    pub fn new(design: &Design, machine: &Machine) -> Result<Self> {
        let timing = Loop::new(design);
        timing.check(timing.every)?;
        Ok(Self { controllers: Standard::of_drives(design, machine)?, clocked: Clocked::new(machine, timing) })
    }

    /// Time of the next decision, s.
    pub fn next(&self) -> f64 {
        self.clocked.next()
    }

    /// The command of each drive that acts now, V or A.
    pub fn commands(&self) -> &[f64] {
        &self.clocked.acting[..self.controllers.len()]
    }

    /// Decides at [`Stepped::next`] from the state, the current of each motor, A, and the references of all slides at
    /// that time.
    ///
    /// `ahead` are the references one lead later ([`Loop::lead`]). Without them they are extrapolated by their
    /// derivatives with constant snap, which is wrong where the snap of a profile jumps within the lead. The commands
    /// act until the next decision.
    pub fn decide(&mut self, state: &State, currents: &[f64], slides: &[Reference], ahead: Option<&[Reference]>) {
        let lead = self.clocked.timing.lead;
        let mut references = [[Reference::default(); SLIDES]; 2];
        for (number, slide) in slides.iter().enumerate().take(SLIDES) {
            references[0][number] = *slide;
            references[1][number] =
                ahead.and_then(|ahead| ahead.get(number).copied()).unwrap_or_else(|| slide.after(lead));
        }
        let mut of_drives = Commands::default();
        of_drives.iter_mut().zip(currents).for_each(|(own, current)| *own = *current);
        let mut all: Vec<&mut dyn Controller> = self.controllers.iter_mut().map(|one| one as _).collect();
        self.clocked.decide(&mut all, (state, &of_drives), |_, _| references);
    }
}

impl Stepped {
    /// Its complete state as plain numbers: whether a delayed command is due within the sample, pending and acting
    /// commands, the memory of each law, and the sample number.
    pub fn save(&self) -> Vec<u64> {
        let Clocked { k, halfway, waiting, acting, .. } = &self.clocked;
        let (halfway, drives) = (f64::from(u8::from(*halfway)), self.controllers.len());
        let commands = waiting.iter().chain([acting]).flat_map(|commands| &commands[..drives]);
        let memory = self.controllers.iter().flat_map(Standard::memory);
        [halfway].iter().chain(commands).chain(memory).map(|number| number.to_bits()).chain([*k]).collect()
    }

    /// Continues bit for bit from the result of [`Stepped::save`] of controllers of the same design. Returns `None`,
    /// and changes nothing, if `saved` does not belong to them.
    pub fn restore(&mut self, saved: &[u64]) -> Option<()> {
        let (k, numbers) = saved.split_last()?;
        let (halfway, numbers) = numbers.split_first()?;
        let halfway = match f64::from_bits(*halfway) {
            0.0 => false,
            1.0 => true,
            _ => return None,
        };
        let drives = self.controllers.len();
        // Between a sample and the start of its command, that command waits with the others.
        let waiting = self.clocked.timing.samples_late().0 + usize::from(halfway);
        let memory: usize = self.controllers.iter().map(|one| one.memory().len()).sum();
        if numbers.len() != (waiting + 1) * drives + memory {
            return None;
        }
        let mut numbers = numbers.iter().map(|bits| f64::from_bits(*bits));
        let mut commands = || {
            let mut commands = Commands::default();
            commands[..drives].fill_with(|| numbers.next().unwrap_or_default());
            commands
        };
        self.clocked.waiting = (0..waiting).map(|_| commands()).collect();
        self.clocked.acting = commands();
        let memory = self.controllers.iter_mut().flat_map(Standard::memory_mut);
        memory.zip(numbers).for_each(|(number, saved)| *number = saved);
        (self.clocked.k, self.clocked.halfway) = (*k, halfway);
        Some(())
    }
}

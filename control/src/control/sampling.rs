//! Controllers around a run: samples, commands and delays, decision by decision.

use super::rest::Rest;
use super::sampled::{Added, Controller, Loop, Sample};
use super::sampled_path::{SampledPath, references};
use super::stepped::{Clocked, Commands, Decision};
use crate::case::Experiment;
use crate::machine::Machine;
use crate::mechanism::{DRIVES, State};
use crate::signal::Signal;
use crate::signal::profile::Profile;
use crate::solve::{Flow, Run};

/// Determines the inputs: samples, evaluates the controllers, limits the commands, and applies them after the delay.
pub(super) struct Sampled<'a, 'c> {
    controllers: &'a mut [&'c mut dyn Controller],
    /// Profile of each coordinate.
    profiles: &'a [Profile],
    /// Their known references.
    path: Option<&'a SampledPath>,
    clocked: Clocked,
    /// Last command of each drive.
    pub(super) told: [DriveCommands; DRIVES],
    /// End of the run, s.
    until: f64,
    /// Number of samples, and of those with a limited command.
    pub(super) samples: u64,
    pub(super) limited: u64,
    pub(super) kept: Option<Vec<Sample>>,
    /// An input added to the command of the first drive.
    added: Option<&'a Added>,
    /// References of steppers, to which the commands are added; none for other motors.
    references: &'a [Signal],
}

/// The commands of a drive.
#[derive(Debug, Clone, Copy)]
pub(super) struct DriveCommands {
    /// Duration of limited commands, s.
    pub held_back: f64,
    /// Sign changes of the increments of the acting command, and its last non-zero increment.
    pub turns: u64,
    way: f64,
    /// The command after the profile.
    pub at_rest: Rest,
}

impl DriveCommands {
    /// Initial state, for a profile that ends at `end`, s, and a run that ends at `until`.
    fn new(end: f64, until: f64) -> Self {
        Self { held_back: 0.0, turns: 0, way: 0.0, at_rest: Rest::new(end, until) }
    }
}

impl<'a, 'c> Sampled<'a, 'c> {
    pub(super) fn new(
        machine: &Machine,
        controllers: &'a mut [&'c mut dyn Controller],
        timing: Loop,
        profiles: &'a [Profile],
        keep: bool,
    ) -> Self {
        Self {
            controllers,
            profiles,
            path: None,
            clocked: Clocked::new(machine, timing),
            told: [DriveCommands::new(f64::INFINITY, f64::INFINITY); DRIVES],
            until: f64::INFINITY,
            samples: 0,
            limited: 0,
            kept: keep.then(Vec::new),
            added: None,
            references: &[],
        }
    }

    /// For a run of this experiment on this machine: its end ends the holding of commands, and controllers of steppers
    /// correct its references.
    pub(super) fn along(mut self, machine: &Machine, experiment: &'a Experiment) -> Self {
        self.until = experiment.until;
        self.told = [DriveCommands::new(self.profiles.first().map_or(0.0, Profile::end), self.until); DRIVES];
        self.references = if machine.stepper().is_some() { &experiment.inputs } else { &[] };
        self
    }

    /// With the known references of its profiles.
    pub(super) fn on(mut self, path: &'a SampledPath) -> Self {
        self.path = Some(path).filter(|path| path.is_for(&self.clocked.timing));
        self
    }

    /// With a known input added to the commands of the first drive.
    pub(super) fn with(mut self, added: Option<&'a Added>) -> Self {
        self.added = added;
        self
    }

    /// True without controllers: steppers then follow their references by themselves.
    pub(super) fn is_open(&self) -> bool {
        self.controllers.is_empty()
    }

    /// With exact positions instead of counts.
    pub(super) fn exactly(mut self) -> Self {
        self.clocked = self.clocked.exactly();
        self
    }
}

impl Sampled<'_, '_> {
    /// Drives a run to its end, `until`, s: inputs are held from one decision to the next. `see` is shown time, state
    /// and the currents of the motors, A, at each of them and at the end; it can stop the run.
    pub(super) fn drive(&mut self, run: &mut Run, until: f64, mut see: impl FnMut(f64, &State, &[f64]) -> Flow) {
        let drives = self.controllers.len();
        loop {
            let state = run.state();
            let mut currents = Commands::default();
            currents.iter_mut().take(drives).enumerate().for_each(|(drive, current)| *current = run.current(drive));
            if see(run.time(), &state, &currents[..drives]) == Flow::Stop {
                return;
            }
            let (inputs, end) = self.decide(&state, &currents);
            let is_at_end = run.time() >= until;
            if !self.hold(run, &inputs[..drives], end) || is_at_end {
                return;
            }
        }
    }

    /// Holds commands, with signals added to them, or corrections of a stepper's reference, until `end`, s; false if
    /// the run ends.
    fn hold(&self, run: &mut Run, commands: &[f64], end: f64) -> bool {
        if !self.references.is_empty() {
            return run.hold_added(self.references, commands, end);
        }
        let Some(added) = self.added else { return run.hold(commands, end) };
        loop {
            // Clocks of logs are off by up to a hundredth of a sample.
            let near = 1e-2 * self.clocked.timing.every;
            let (value, next) = added.at(run.time() + near);
            let next = if next < end - near { next } else { end };
            if !run.hold(&[commands[0] + value], next) {
                return false;
            }
            if next >= end {
                return true;
            }
        }
    }

    /// Inputs from now on and the end of their hold, s, from the state and the motors' currents, A, just before.
    fn decide(&mut self, state: &State, currents: &Commands) -> (Commands, f64) {
        let (every, lead) = (self.clocked.timing.every, self.clocked.timing.lead);
        let (time, before) = (self.clocked.next(), self.clocked.acting());
        let (profiles, path) = (self.profiles, self.path);
        let references = |k: u64, time: f64| {
            path.and_then(|path| path.references(k)).unwrap_or_else(|| references(profiles, time, lead))
        };
        if let Some(decisions) = self.clocked.decide(self.controllers, (state, currents), references) {
            self.samples += 1;
            let mut is_limited = false;
            let drives = self.controllers.len();
            for (drive, &Decision { reference, measured, asked, given }) in decisions.iter().take(drives).enumerate() {
                let told = &mut self.told[drive];
                told.at_rest.see(time, given);
                if given != asked {
                    is_limited = true;
                    told.held_back += every.min(self.until - time).max(0.0);
                }
                if let Some(kept) = &mut self.kept {
                    kept.push(Sample { time, drive, reference, measured, asked, given });
                }
            }
            self.limited += u64::from(is_limited);
        }
        let acting = self.clocked.acting();
        if time < self.until {
            for (told, (now, before)) in self.told.iter_mut().zip(acting.iter().zip(before)) {
                let change = now - before;
                told.turns += u64::from(change * told.way < 0.0);
                told.way = if change == 0.0 { told.way } else { change };
            }
        }
        (acting, self.clocked.next())
    }
}

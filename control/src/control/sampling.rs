//! A controller around a run: samples, commands and delays, decision by decision.

use super::rest::Rest;
use super::sampled::{Added, Controller, Loop, Sample};
use super::stepped::{Clocked, Decision};
use crate::machine::Machine;
use crate::mechanism::State;
use crate::signal::profile::{Profile, Reference};
use crate::solve::Run;

/// Decides the input: samples, asks the controller, limits, and hands on when the delay is over.
pub(super) struct Sampled<'a> {
    controller: &'a mut dyn Controller,
    profile: &'a Profile,
    clocked: Clocked,
    /// Samples at the limit, and for how long their commands were held, s.
    pub(super) limited: u64,
    pub(super) held_back: f64,
    /// Changes of direction of what acts, and the last change of it that was none of zero.
    pub(super) turns: u64,
    way: f64,
    /// End of the run, s.
    until: f64,
    pub(super) samples: u64,
    /// The command after the profile.
    pub(super) at_rest: Rest,
    pub(super) kept: Option<Vec<Sample>>,
    /// An input added to the command.
    added: Option<&'a Added>,
}

impl<'a> Sampled<'a> {
    pub(super) fn new(
        machine: &Machine,
        controller: &'a mut dyn Controller,
        timing: Loop,
        profile: &'a Profile,
        keep: bool,
    ) -> Self {
        Self {
            controller,
            profile,
            clocked: Clocked::new(machine, timing),
            limited: 0,
            held_back: 0.0,
            turns: 0,
            way: 0.0,
            until: f64::INFINITY,
            samples: 0,
            at_rest: Rest::new(f64::INFINITY, f64::INFINITY),
            kept: keep.then(Vec::new),
            added: None,
        }
    }
}

impl<'a> Sampled<'a> {
    /// For a run that ends there: what is held then is held no longer.
    pub(super) fn until(mut self, until: f64) -> Self {
        self.until = until;
        self.at_rest = Rest::new(self.profile.end(), until);
        self
    }

    /// With a known input added to its commands.
    pub(super) fn with(mut self, added: Option<&'a Added>) -> Self {
        self.added = added;
        self
    }

    /// With positions read exactly and not in counts.
    pub(super) fn exactly(mut self) -> Self {
        self.clocked = self.clocked.exactly();
        self
    }
}

impl Sampled<'_> {
    /// Drives a run to its end, `until`, s: the input is held from one decision to the next. `see` is shown time, state
    /// and the motor's current, A, at each of them and at the end.
    pub(super) fn drive(&mut self, run: &mut Run, until: f64, mut see: impl FnMut(f64, &State, f64)) {
        loop {
            let (state, current) = (run.state(), run.current(0));
            see(run.time(), &state, current);
            let (input, end) = self.decide(&state, current);
            let is_at_end = run.time() >= until;
            if !self.hold(run, input, end) || is_at_end {
                return;
            }
        }
    }

    /// Holds a command, with what is added to it, until `end`, s; false where the run ends.
    fn hold(&self, run: &mut Run, command: f64, end: f64) -> bool {
        let Some(added) = self.added else { return run.hold(&[command], end) };
        loop {
            // A hundredth of a sample is what clocks of logs are off by.
            let near = 1e-2 * self.clocked.timing.every;
            let (value, next) = added.at(run.time() + near);
            let next = if next < end - near { next } else { end };
            if !run.hold(&[command + value], next) {
                return false;
            }
            if next >= end {
                return true;
            }
        }
    }

    /// The input from now on and until when it is held, s, told the state and the motor's current, A, just before.
    fn decide(&mut self, state: &State, current: f64) -> (f64, f64) {
        let Loop { every, lead, .. } = self.clocked.timing;
        let (time, before) = (self.clocked.next(), self.clocked.acting());
        // A command that was delayed needs no reference.
        let [reference, ahead] = match self.clocked.is_at_sample() {
            false => [Reference::default(); 2],
            true => {
                let reference = self.profile.at(time);
                [reference, if lead == 0.0 { reference } else { self.profile.at(time + lead) }]
            }
        };
        if let Some(Decision { seen, asked, given }) =
            self.clocked.decide(self.controller, (state, current), &reference, &ahead)
        {
            self.samples += 1;
            self.at_rest.see(time, given);
            if given != asked {
                self.limited += 1;
                self.held_back += every.min(self.until - time).max(0.0);
            }
            if let Some(kept) = &mut self.kept {
                kept.push(Sample { time, reference: seen.reference.position, measured: seen.position, asked, given });
            }
        }
        let acting = self.clocked.acting();
        let change = acting - before;
        if time < self.until {
            self.turns += u64::from(change * self.way < 0.0);
            self.way = if change == 0.0 { self.way } else { change };
        }
        (acting, self.clocked.next())
    }
}

//! Time goes on: steps of co-simulation, and what an integrator asks of model exchange.

use crate::instance::{Instance, Phase, Plant, Refusable, Refusal, Status};
use taut_core::mechanism::Shown;
use taut_core::signal::profile::Reference;
use taut_core::solve::{Ending, Event};
use taut_export::fmu::Role;

/// Part of a step that a clock may be off by.
const NEAR: f64 = 1e-9;

/// Last bits by which a machine is taken past an event.
const BITS: f64 = 8.0;

/// Why time stands again.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Halt {
    /// It is where it was to go.
    Arrived,
    /// A part does something else.
    Event,
    /// The machine has ended the run.
    Over,
}

/// Changes that an event has brought about.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Settled {
    /// True if integrated quantities were put elsewhere.
    pub moved: bool,
    /// True if the machine has ended the run.
    pub over: bool,
    /// When the controller decides next, s.
    pub next: Option<f64>,
}

impl Instance {
    /// Where a step from `current` of `size` ends. Errors: a step that is none, or does not begin here.
    pub fn step_end(&self, current: f64, size: f64) -> Refusable<f64> {
        if !(current.is_finite() && size.is_finite() && size > 0.0) {
            return Err(Refusal::error(format!(
                "a step of {size} s from {current} s cannot be; allowed: finite times, and a size above zero"
            )));
        }
        if (current - self.time).abs() > NEAR * size.max(self.time.abs()) {
            return Err(Refusal::error(format!(
                "a step cannot begin at {current} s; allowed: {} s, where the last one ended",
                self.time
            )));
        }
        let end = current + size;
        if let Some(stop) = self.stop.filter(|stop| end > stop + NEAR * size.max(stop.abs())) {
            return Err(Refusal::error(format!(
                "a step cannot end at {end} s; allowed: up to the stop time, {stop} s"
            )));
        }
        if end <= self.time {
            return Err(Refusal::error(format!("a step of {size} s from {current} s does not leave it")));
        }
        Ok(end)
    }

    /// Goes on to `end`, s, or to the first event where it is to stop there.
    pub fn go(&mut self, end: f64, stops: bool) -> Refusable<Halt> {
        self.prepare()?;
        self.columns = None;
        loop {
            self.decide(end)?;
            self.refresh()?;
            let next = self.control.as_ref().map_or(f64::INFINITY, |control| self.begin + control.next());
            let until = if next < end - self.near() { next } else { end };
            match self.advance(until, stops)? {
                Halt::Arrived if until < end => {}
                halt => return Ok(halt),
            }
        }
    }

    /// By how much a sample may be off and still be at a time.
    fn near(&self) -> f64 {
        self.model.design.as_ref().map_or(0.0, |design| NEAR * design.every)
    }

    /// Lets the controller decide, if its time has come and `end` has not.
    fn decide(&mut self, end: f64) -> Refusable<()> {
        while let Some(control) = self.control.as_ref() {
            let at = self.begin + control.next();
            if at > self.time + self.near() || at >= end - self.near() {
                return Ok(());
            }
            self.sample()?;
        }
        Ok(())
    }

    /// One decision of the controller.
    fn sample(&mut self) -> Refusable<()> {
        let references = self.referred(Role::Reference);
        let ahead = self.model.lead().map(|_| self.referred(Role::Ahead));
        self.sees_ahead |= ahead.iter().flatten().any(|ahead| *ahead != Reference::default());
        let ahead = ahead.filter(|_| self.sees_ahead);
        let quantities = self.integrated()?;
        let state = match &self.plant {
            Plant::Machine(machine) => machine.state(),
            Plant::Dynamics(dynamics) => self.model.state(dynamics.mechanism(), &quantities),
            Plant::None => return Ok(()),
        };
        let currents = self.currents();
        if let Some(control) = &mut self.control {
            control.decide(&state, &currents, &references, ahead.as_deref());
        }
        (self.is_set, self.columns) = (true, None);
        Ok(())
    }

    /// The reference of each slide now.
    fn referred(&self, role: fn(usize) -> Role) -> Vec<Reference> {
        let of_slide = |slide: usize| {
            let (origin, reference) = self.reference(role, slide);
            reference.after(self.time - origin)
        };
        (0..self.model.slides()).map(of_slide).collect()
    }

    /// The current of each drive just before inputs that were set act.
    fn currents(&self) -> Vec<f64> {
        let mut values = Vec::new();
        let columns = match &self.plant {
            Plant::Machine(machine) => {
                values.resize(machine.columns().len(), 0.0);
                machine.outputs(&mut values);
                machine.columns()
            }
            Plant::Dynamics(dynamics) => {
                values.resize(dynamics.mechanism().columns.len(), 0.0);
                dynamics.outputs(&mut values);
                &dynamics.mechanism().columns
            }
            Plant::None => return values,
        };
        let of_drive = |drive: usize| {
            let column = columns.iter().position(|heading| heading.shown == Shown::Current(drive));
            column.and_then(|column| values.get(column).copied()).unwrap_or(0.0)
        };
        (0..self.model.drives()).map(of_drive).collect()
    }

    /// Moves the machine.
    fn advance(&mut self, end: f64, stops: bool) -> Refusable<Halt> {
        let until = end - self.begin;
        let Plant::Machine(machine) = &mut self.plant else {
            return Err(Refusal::error("there is no machine to move"));
        };
        let mut events: Vec<Event> = Vec::new();
        let (from, before) = (machine.time(), stops.then(|| machine.clone()));
        let mut ended = machine.advance(until, &mut events);
        // Events that inputs bring about where the step begins are known to whoever set them: no reason to stop there.
        events.retain(|event| event.time > from);
        let first = events.first().map(|event| event.time).filter(|time| *time < until);
        if let (Some(before), Some(first)) = (before, first) {
            // The event may lie some last bits behind its own time; a machine that is taken so little further does not
            // move, so that each try begins where the step does.
            let mut beyond = BITS * f64::EPSILON * first.abs();
            loop {
                let at = (first + beyond).min(until);
                **machine = (*before).clone();
                events.clear();
                ended = machine.advance(at, &mut events);
                events.retain(|event| event.time > from);
                if ended.is_err() || !events.is_empty() || at >= until {
                    break;
                }
                beyond = 2.0 * beyond + f64::MIN_POSITIVE;
            }
            if ended.is_ok() {
                self.time = self.begin + machine.time();
                return Ok(if self.time < end { Halt::Event } else { Halt::Arrived });
            }
        }
        match ended {
            Ok(()) => {
                self.time = end;
                Ok(match stops && !events.is_empty() {
                    true => Halt::Event,
                    false => Halt::Arrived,
                })
            }
            Err(Ending::LeftTravel { time }) => {
                (self.time, self.is_over) = (self.begin + time, true);
                Ok(Halt::Over)
            }
            Err(ending) => {
                self.phase = Phase::Broken;
                Err(Refusal { status: Status::Error, message: format!("the machine cannot go on: {ending}") })
            }
        }
    }

    // --- model exchange ---------------------------------------------------------------------------------------------

    /// Puts time in place.
    pub fn set_time(&mut self, time: f64) -> Refusable<()> {
        if !time.is_finite() {
            return Err(Refusal::error(format!("time cannot be {time}; allowed: any finite number")));
        }
        // Inputs are held unless they are set: what was set before goes on.
        (self.time, self.is_set, self.columns) = (time, true, None);
        Ok(())
    }

    /// Puts the integrated quantities in place.
    pub fn set_states(&mut self, values: &[f64]) -> Refusable<()> {
        if values.len() != self.quantities.len() {
            return Err(Refusal::error(format!(
                "{} continuous states cannot be; allowed: {}",
                values.len(),
                self.quantities.len()
            )));
        }
        if let Some(value) = values.iter().find(|value| !value.is_finite()) {
            return Err(Refusal::error(format!("a continuous state cannot be {value}; allowed: any finite number")));
        }
        self.quantities.copy_from_slice(values);
        (self.is_set, self.columns) = (true, None);
        Ok(())
    }

    /// The integrated quantities.
    pub fn states(&self, into: &mut [f64]) -> Refusable<()> {
        into.copy_from_slice(self.matching(&self.quantities, into.len())?);
        Ok(())
    }

    /// A unit size of each.
    pub fn nominals(&self, into: &mut [f64]) -> Refusable<()> {
        let nominals = self.model.nominals(&self.mechanism()?);
        into.copy_from_slice(self.matching(&nominals, into.len())?);
        Ok(())
    }

    fn matching<'v>(&self, values: &'v [f64], length: usize) -> Refusable<&'v [f64]> {
        match values.len() == length {
            true => Ok(values),
            false => Err(Refusal::error(format!("{length} values cannot be; allowed: {}", values.len()))),
        }
    }

    /// Their rates.
    pub fn rates(&mut self, into: &mut [f64]) -> Refusable<()> {
        let count = self.quantities.len();
        self.prepare()?;
        self.refresh()?;
        match &self.plant {
            Plant::Dynamics(dynamics) if into.len() == count => dynamics.rates(into),
            _ => return Err(Refusal::error(format!("{} values cannot be; allowed: {count}", into.len()))),
        }
        Ok(())
    }

    /// The conditions of the mode.
    pub fn residuals(&mut self, into: &mut [f64]) -> Refusable<()> {
        let count = self.model.conditions;
        self.prepare()?;
        self.refresh()?;
        match &self.plant {
            Plant::Dynamics(dynamics) if into.len() == count => dynamics.residuals(into),
            _ => return Err(Refusal::error(format!("{} values cannot be; allowed: {count}", into.len()))),
        }
        Ok(())
    }

    /// True if a condition has fallen by the end of an integrator's step.
    pub fn has_fallen(&mut self) -> Refusable<bool> {
        self.prepare()?;
        self.refresh()?;
        Ok(match &self.plant {
            Plant::Dynamics(dynamics) => dynamics.is_over(),
            Plant::None | Plant::Machine(_) => false,
        })
    }

    /// Takes up the mode that follows, and lets the controller decide if its time has come.
    pub fn settle(&mut self) -> Refusable<Settled> {
        self.prepare()?;
        if !self.exchanges() {
            return Ok(Settled::default());
        }
        self.refresh()?;
        // Samples that an importer passes over are none that could be made up for.
        if let (Some(control), Some(design)) = (&self.control, &self.model.design)
            && self.begin + control.next() + design.every < self.time
        {
            return Err(Refusal::error(format!(
                "the controller was to decide at {} s, and it is {} s; allowed: no time behind the next event time",
                self.begin + control.next(),
                self.time
            )));
        }
        let mut settled = self.change()?;
        let mut decided = false;
        while self.control.as_ref().is_some_and(|control| self.begin + control.next() <= self.time + self.near()) {
            self.sample()?;
            decided = true;
        }
        if decided {
            self.refresh()?;
            let again = self.change()?;
            settled = Settled { moved: settled.moved || again.moved, over: settled.over || again.over, next: None };
        }
        settled.next = self.control.as_ref().map(|control| self.begin + control.next());
        Ok(settled)
    }

    fn change(&mut self) -> Refusable<Settled> {
        self.columns = None;
        let Plant::Dynamics(dynamics) = &mut self.plant else { return Ok(Settled::default()) };
        match dynamics.settle(&mut Vec::new()) {
            Ok(moved) => {
                if moved {
                    dynamics.values(&mut self.quantities);
                    self.is_set = true;
                }
                Ok(Settled { moved, ..Settled::default() })
            }
            Err(Ending::LeftTravel { .. }) => {
                self.is_over = true;
                Ok(Settled { over: true, ..Settled::default() })
            }
            Err(ending) => {
                self.phase = Phase::Broken;
                Err(Refusal { status: Status::Error, message: format!("the machine cannot go on: {ending}") })
            }
        }
    }
}

//! A controller from its design: structure, feed-forward, observer and filters put together.

use super::compensation::Compensation;
use super::filter::Biquad;
use super::fuzzy::FuzzyState;
use super::memory::{Memory, all};
use super::observer::DisturbanceState;
use super::pid::{CascadeState, PidState};
use super::sampled::{Controller, Observation};
use super::sliding::SlidingState;
use super::state_feedback::StateFeedbackState;
use crate::design::{Design, Structure};
use crate::error::{Error, Result};
use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Machine};
use crate::signal::profile::Reference;

/// A controller that a [`Design`] describes, made with a model of the axis: the stage itself, or what one takes it for.
#[derive(Debug, Clone)]
pub struct Standard {
    core: Core,
    compensation: Compensation,
    observer: Option<DisturbanceState>,
    filters: Vec<Biquad>,
    /// Weights of encoder and scale in the position that the observer is given.
    weights: [f64; 2],
    /// The last command asked for, and the position for the observer and dry friction there.
    asked: f64,
    position: f64,
    dry: f64,
}

#[derive(Debug, Clone)]
enum Core {
    Pid(PidState),
    Cascade(CascadeState),
    StateFeedback(Box<StateFeedbackState>),
    SlidingMode(SlidingState),
    Fuzzy(FuzzyState),
}

impl Standard {
    /// The controller of `design` for a `model` of the axis.
    pub fn new(design: &Design, model: &Machine) -> Result<Self> {
        check(design, model)?;
        let every = design.every;
        let compensation = Compensation::new(model, &design.feed_forward);
        let rigid = compensation.rigid;
        let core = match &design.structure {
            Structure::Pid(gains) => Core::Pid(PidState::new(gains, every)),
            Structure::Cascade(gains) => Core::Cascade(CascadeState::new(gains, every)),
            Structure::StateFeedback(weights) => {
                Core::StateFeedback(Box::new(StateFeedbackState::new(weights, model, design)?))
            }
            Structure::SlidingMode(gains) => Core::SlidingMode(SlidingState::new(gains, &rigid, every)),
            Structure::Fuzzy(rules) => Core::Fuzzy(FuzzyState::new(rules, every)),
        };
        let observer = match design.disturbance_observer {
            None => None,
            Some(observer) => Some(DisturbanceState::new(observer.bandwidth, &rigid, every).ok_or_else(|| {
                Error::new("a disturbance observer cannot be made for this axis and sample time")
                    .next("take a shorter sample time, or another bandwidth")
            })?),
        };
        Ok(Self {
            core,
            compensation,
            observer,
            filters: design.filters.iter().map(|filter| Biquad::new(filter, every)).collect(),
            weights: observed(model, &rigid),
            asked: 0.0,
            position: 0.0,
            dry: 0.0,
        })
    }
}

/// Weights of encoder and scale in the position that a disturbance observer is given: the share of the mass that moves
/// with each, so that it sees the common motion, in which the belt does not swing. All of the encoder without a scale.
pub(super) fn observed(model: &Machine, rigid: &Rigid) -> [f64; 2] {
    match model.scale {
        None => [1.0, 0.0],
        Some(_) => [rigid.driving / rigid.mass, 1.0 - rigid.driving / rigid.mass],
    }
}

/// Refuses what no controller can be.
fn check(design: &Design, model: &Machine) -> Result<()> {
    let Design { every, delay, limit, .. } = *design;
    if !((1e-9..=1e9).contains(&every) && (0.0..=1000.0 * every).contains(&delay)) {
        return Err(Error::new(format!("a controller cannot be sampled every {every} s with a delay of {delay} s"))
            .allowed("a sample time above zero, and a delay of up to 1000 of them"));
    }
    if limit.is_some_and(|limit| !(limit > 0.0 && limit.is_finite())) {
        return Err(Error::new("the limit of the command is none").allowed("above zero"));
    }
    if let Structure::Cascade(cascade) = &design.structure
        && cascade.current.is_some()
        && model.drives[0].amplifier.mode == AmplifierMode::Current
    {
        return Err(Error::new("the amplifier commands the current itself: there is no current loop to close")
            .next("leave the current loop out, or set amplifier.mode = \"voltage\""));
    }
    if let Structure::Fuzzy(fuzzy) = &design.structure {
        let size = fuzzy.rules.len();
        let square = size >= 3 && size % 2 == 1 && fuzzy.rules.iter().all(|row| row.len() == size);
        if !square {
            return Err(Error::new("the rules are no square table").allowed("3, 5, 7, … rows of as many values"));
        }
    }
    let sum: f64 = design.shaper.iter().map(|[_, amplitude]| amplitude).sum();
    if !design.shaper.is_empty() && (sum - 1.0).abs() > 1e-6 {
        return Err(Error::new(format!("the shaper's amplitudes add up to {sum}")).allowed("1"));
    }
    if model.drives[0].motor.torque_constant == 0.0 || model.drives[0].amplifier.gain == 0.0 {
        return Err(Error::new("the command moves nothing: torque constant or gain is zero").allowed("above zero"));
    }
    Ok(())
}

impl Standard {
    /// Shows its memory from sample to sample to a function that takes all of it.
    pub(super) fn memory(&mut self, memory: &mut Memory) -> Option<()> {
        match &mut self.core {
            Core::Pid(core) => core.memory(memory)?,
            Core::Cascade(core) => core.memory(memory)?,
            Core::StateFeedback(core) => core.memory(memory)?,
            Core::SlidingMode(core) => core.memory(memory)?,
            Core::Fuzzy(core) => core.memory(memory)?,
        }
        self.filters.iter_mut().try_for_each(|filter| filter.memory(memory))?;
        if let Some(observer) = &mut self.observer {
            observer.memory(memory)?;
        }
        all([&mut self.asked, &mut self.position, &mut self.dry], memory)
    }
}

impl Controller for Standard {
    fn step(&mut self, seen: &Observation) -> f64 {
        let compensation = &self.compensation;
        let target = || compensation.target(&seen.reference);
        // A scale that the model has and the axis has not is none.
        let scale = seen.scale.unwrap_or(seen.position);
        let mut forward = compensation.command(&seen.ahead);
        let own = match &mut self.core {
            Core::Pid(core) => core.step(&target(), seen.position),
            Core::Cascade(core) => {
                let mut inner = 0.0;
                if core.commands_current() {
                    // As a current into the inner loop; what the voltage needs beyond it is left outside.
                    inner = forward_current(compensation, &seen.ahead, forward);
                    forward = back_emf(compensation, &seen.ahead, forward);
                }
                // With a scale the position loop is closed at the cart, which is to be where the reference is.
                match seen.scale {
                    None => core.step(&target(), [seen.position; 2], seen.current, inner),
                    Some(scale) => core.step(&seen.reference, [seen.position, scale], seen.current, inner),
                }
            }
            Core::StateFeedback(core) => core.step(&seen.reference, compensation, [seen.position, scale]),
            Core::SlidingMode(core) => core.step(&target(), seen.position),
            Core::Fuzzy(core) => core.step(&target(), seen.position),
        };
        let own = self.filters.iter_mut().fold(own, |value, filter| filter.step(value));
        let disturbance = self.observer.as_ref().map_or(0.0, DisturbanceState::disturbance);
        let [encoder, cart] = self.weights;
        self.position = if cart == 0.0 { seen.position } else { encoder * seen.position + cart * scale };
        self.dry = self.compensation.dry(&seen.ahead);
        self.asked = own + forward - disturbance;
        self.asked
    }

    fn limited(&mut self, given: f64) {
        let excess = given - self.asked;
        // What a linear model of the axis is moved by.
        let effective = given - self.dry;
        match &mut self.core {
            Core::Pid(core) => core.limited(excess),
            Core::Cascade(core) => core.limited(excess),
            Core::StateFeedback(core) => core.limited(excess, effective),
            Core::SlidingMode(core) => core.limited(excess),
            Core::Fuzzy(core) => core.limited(excess),
        }
        if let Some(observer) = &mut self.observer {
            observer.step(self.position, effective);
        }
    }

    fn reset(&mut self) {
        match &mut self.core {
            Core::Pid(core) => core.reset(),
            Core::Cascade(core) => core.reset(),
            Core::StateFeedback(core) => core.reset(),
            Core::SlidingMode(core) => core.reset(),
            Core::Fuzzy(core) => core.reset(),
        }
        self.filters.iter_mut().for_each(Biquad::reset);
        if let Some(observer) = &mut self.observer {
            observer.reset();
        }
    }
}

/// The share of the voltage fed forward that is for speed, V.
fn back_emf(compensation: &Compensation, y: &Reference, forward: f64) -> f64 {
    if forward == 0.0 { 0.0 } else { compensation.rigid.command(0.0, 0.0, y.speed) }
}

/// The rest of it, as a current, A.
fn forward_current(compensation: &Compensation, y: &Reference, forward: f64) -> f64 {
    let rest = forward - back_emf(compensation, y, forward);
    rest * compensation.rigid.force_per_command() / compensation.rigid.force_per_ampere
}

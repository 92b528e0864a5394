//! A controller from its design: structure, feed-forward, observer and filters combined.

use super::filter::Biquad;
use super::law::{Law, LawInputs};
use super::laws::AnyLaw;
use super::observer::DisturbanceObserver;
use super::sampled::{Controller, Observation};
use crate::calculator::{Calculator, Evaluation, Slot, Slots};
use crate::design::{Design, FeedForward, Structure};
use crate::error::{Error, Result};
use crate::machine::rigid::Rigid;
use crate::machine::{AmplifierMode, Machine};
use crate::reach::compensation::Compensation;
use crate::reach::forward::Forward;
use crate::signal::profile::Reference;

/// The controller of a [`Design`], made with a model of the axis: the machine itself, or an assumed one.
#[derive(Debug, Clone)]
pub struct Standard {
    text: Text,
    memory: Vec<f64>,
    /// Feed-forward for the current loop of one of several drives, A, until the next step.
    inner: Option<f64>,
}

/// One sample of such a controller, for any calculator.
#[derive(Debug, Clone)]
pub struct Text {
    pub(crate) law: AnyLaw,
    compensation: Compensation,
    /// Feed-forward of one of several drives.
    forward: Option<Forward>,
    observer: Option<DisturbanceObserver>,
    pub(crate) filters: Vec<Biquad>,
    /// Weights of encoder and scale in the position for the observer.
    weights: [f64; 2],
    /// Its memory, with the last command before limits, and the position for the observer and dry friction at that
    /// time.
    pub slots: Slots,
    asked: Slot,
    position: Slot,
    dry: Slot,
}

impl Text {
    /// Controller of a drive of `model` by `design`, with its share of a joint feed-forward if there are several
    /// drives.
    pub fn of_drive(design: &Design, model: &Machine, drive: usize) -> Result<Self> {
        Ok(Self { forward: Forward::new(design.feed_forward, model, drive), ..Self::new(design, model)? })
    }

    /// Controller of `design` for a `model` of the axis.
    pub fn new(design: &Design, model: &Machine) -> Result<Self> {
        check(design, model)?;
        let every = design.every;
        // Several drives have a joint feed-forward: `Forward`.
        let own = if model.drives.len() == 1 { design.feed_forward } else { FeedForward::NONE };
        let compensation = Compensation::new(model, &own);
        let rigid = compensation.rigid;
        let slots = &mut Slots::default();
        let law = AnyLaw::new(slots, design, model)?;
        let filters = design.filters.iter().map(|filter| Biquad::new(slots, filter, every)).collect();
        let observer = match design.disturbance_observer {
            None => None,
            Some(observer) => {
                Some(DisturbanceObserver::new(slots, observer.bandwidth, &rigid, every).ok_or_else(|| {
                    Error::new("a disturbance observer cannot be made for this axis and sample time")
                        .next("take a shorter sample time, or another bandwidth")
                })?)
            }
        };
        let [asked, position, dry] = [
            ("last_asked", "the last command asked for"),
            ("last_position", "the position there"),
            ("last_dry", "dry friction there"),
        ]
        .map(|(name, about)| slots.add(name, about));
        let weights = observed(model, &rigid);
        let (forward, slots) = (None, std::mem::take(slots));
        Ok(Self { law, compensation, forward, observer, filters, weights, slots, asked, position, dry })
    }

    /// The command before the limit.
    pub fn step<C: Calculator>(&self, c: &mut C, seen: &Observation<C::N>) -> C::N {
        self.step_with(c, seen, None)
    }

    /// Feed-forward of one of several drives from the references of all slides when the command acts: what is added to
    /// the command, V or A, and the part for the current loop, A, if the law has one.
    pub fn forward<C: Calculator>(&self, c: &mut C, slides: &[Reference<C::N>]) -> [Option<C::N>; 2] {
        match &self.forward {
            Some(forward) if self.law.commands_current() => match forward.split(c, slides) {
                Some([inner, outside]) => [Some(outside), Some(inner)],
                None => [None; 2],
            },
            Some(forward) => [forward.command(c, slides), None],
            None => [None; 2],
        }
    }

    /// The reference of the encoder of one of several drives, from that of its part of the belt and those of all
    /// slides.
    pub fn target<C: Calculator>(
        &self,
        c: &mut C,
        along: Reference<C::N>,
        slides: &[Reference<C::N>],
    ) -> Reference<C::N> {
        self.forward.as_ref().map_or(along, |forward| forward.target(c, along, slides))
    }

    /// The command before the limit, with this feed-forward for the current loop, A, from outside.
    pub fn step_with<C: Calculator>(&self, c: &mut C, seen: &Observation<C::N>, inner: Option<C::N>) -> C::N {
        let compensation = &self.compensation;
        c.remark("where the encoder should be, and what the reference asks for by itself");
        let target = compensation.target(c, &seen.reference);
        let mut added = compensation.command(c, &seen.ahead);
        let mut forward = inner;
        if let (Some(whole), true) = (added, self.law.commands_current()) {
            // A current for the inner loop; the rest of the voltage is added outside.
            let [inner, outside] = compensation.rigid.split(c, seen.ahead.speed, whole);
            (forward, added) = (Some(inner), Some(outside));
        }
        c.remark(self.law.about());
        let &Observation { reference, position, scale, current, .. } = seen;
        let own = self.law.step(c, &LawInputs { reference, target, position, scale, current, forward, compensation });
        let own = self.filters.iter().fold(own, |value, filter| filter.step(c, value));
        let mut asked = added.map_or(own, |added| own + added);
        let mut common = position;
        if let Some(observer) = &self.observer {
            asked = asked - observer.disturbance(c);
            let [encoder, cart] = self.weights;
            if let (Some(scale), true) = (scale, cart != 0.0) {
                common = position * encoder + scale * cart;
            }
        }
        let asked = c.name("asked", asked);
        let dry = compensation.dry(c, &seen.ahead);
        c.keep(self.asked, asked);
        c.keep(self.position, common);
        c.keep(self.dry, dry);
        asked
    }

    /// Receives the command after the limit.
    pub fn limited<C: Calculator>(&self, c: &mut C, given: C::N) {
        c.remark("what the limit has left");
        let excess = given - c.memory(self.asked);
        let excess = c.name("excess", excess);
        self.moved(c, excess, given);
    }

    /// Receives the change of the command by the limit, and the command that the axis gets.
    pub fn moved<C: Calculator>(&self, c: &mut C, excess: C::N, given: C::N) {
        // The command that acts in a linear model of the axis.
        let effective = given - c.memory(self.dry);
        let effective = c.name("effective", effective);
        self.law.limited(c, excess, effective);
        if let Some(observer) = &self.observer {
            let position = c.memory(self.position);
            observer.step(c, position, effective);
        }
    }

    /// Inputs of a controller at rest: the axis at its reference, zero.
    pub fn at_rest(&self, has_scale: bool) -> Observation {
        let zero = Reference::default();
        let position = self.compensation.target(&mut Evaluation::plain(), &zero).position;
        let scale = has_scale.then_some(0.0);
        Observation { time: 0.0, reference: zero, ahead: zero, position, scale, current: 0.0 }
    }
}

impl Standard {
    /// The controller of `design` for a `model` of the axis.
    pub fn new(design: &Design, model: &Machine) -> Result<Self> {
        let text = Text::new(design, model)?;
        Ok(Self::from_text(text))
    }

    fn from_text(text: Text) -> Self {
        Self { memory: vec![0.0; text.slots.count()], text, inner: None }
    }

    /// A controller for each drive of a machine; none for steppers in open loop.
    pub fn of_drives(design: &Design, model: &Machine) -> Result<Vec<Self>> {
        if design.is_open_loop() { Ok(Vec::new()) } else { Self::of_every_drive(design, model) }
    }

    /// A controller for each drive of a machine; of steppers in open loop one without feedback, to which signals can be
    /// added.
    pub fn of_every_drive(design: &Design, model: &Machine) -> Result<Vec<Self>> {
        (0..model.drives.len()).map(|drive| Text::of_drive(design, model, drive).map(Self::from_text)).collect()
    }

    /// Memory from sample to sample.
    pub(super) fn memory(&self) -> &[f64] {
        &self.memory
    }

    pub(super) fn memory_mut(&mut self) -> &mut [f64] {
        &mut self.memory
    }
}

impl Controller for Standard {
    fn step(&mut self, seen: &Observation) -> f64 {
        self.text.step_with(&mut Evaluation::on(&mut self.memory), seen, self.inner)
    }

    fn forward(&mut self, slides: &[Reference]) -> f64 {
        let [outside, inner] = self.text.forward(&mut Evaluation::plain(), slides);
        self.inner = inner;
        outside.unwrap_or(0.0)
    }

    fn target(&self, along: Reference, slides: &[Reference]) -> Reference {
        self.text.target(&mut Evaluation::plain(), along, slides)
    }

    fn limited(&mut self, given: f64) {
        self.text.limited(&mut Evaluation::on(&mut self.memory), given);
    }

    fn reset(&mut self) {
        self.memory.fill(0.0);
    }
}

/// Weights of encoder and scale in the position for a disturbance observer: the share of the mass that moves with each,
/// so that it observes the common motion without the belt's oscillation. The encoder alone without a scale.
fn observed(model: &Machine, rigid: &Rigid) -> [f64; 2] {
    match model.scale {
        None => [1.0, 0.0],
        Some(_) => [rigid.driving / rigid.mass, 1.0 - rigid.driving / rigid.mass],
    }
}

/// Rejects an invalid design.
fn check(design: &Design, model: &Machine) -> Result<()> {
    let Design { every, delay, limit, .. } = *design;
    if let Some(part) = design.needs_axis().filter(|_| model.drives.len() > 1) {
        return Err(Error::new(format!("`{part}` needs a single axis, and this machine has several drives"))
            .next("leave it out: such a machine takes pid, cascade or fuzzy, without an observer"));
    }
    if !((1e-9..=1e9).contains(&every) && (0.0..=1000.0 * every).contains(&delay)) {
        return Err(Error::new(format!("a controller cannot be sampled every {every} s with a delay of {delay} s"))
            .allowed("a sample time above zero, and a delay of up to 1000 of them"));
    }
    if limit.is_some_and(|limit| !(limit > 0.0 && limit.is_finite())) {
        return Err(Error::new("the command limit must be a positive number").allowed("above zero"));
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
            return Err(Error::new("the rule table must be square").allowed("3, 5, 7, … rows of as many values"));
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

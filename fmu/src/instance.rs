//! A machine under way as the standard sees it: which function is allowed when, and what it does.

use std::sync::Arc;
use taut_control::control::Stepped;
use taut_core::mechanism::{DRIVES, Mechanism};
use taut_core::signal::profile::Reference;
use taut_core::signal::{DEGREE, Piece, shifted};
use taut_core::solve::{Dynamics, Simulator, Solver};
use taut_export::fmu::{Model, REFERENCES, Role};

/// How a function ended, as the standard counts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Status {
    /// All is well.
    Ok = 0,
    /// It did less than was asked.
    Discard = 2,
    /// It did nothing.
    Error = 3,
    /// The instance cannot be used any more.
    Fatal = 4,
}

/// Why a function did not do what was asked.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// The answer of the function.
    pub status: Status,
    /// The mistake, and what is allowed.
    pub message: String,
}

impl Refusal {
    /// An error.
    pub fn error(message: impl Into<String>) -> Self {
        Self { status: Status::Error, message: message.into() }
    }
}

impl From<taut_core::Error> for Refusal {
    fn from(error: taut_core::Error) -> Self {
        Self::error(error.to_string())
    }
}

/// The answer of a function.
pub type Refusable<T> = Result<T, Refusal>;

/// The purpose of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// The importer integrates.
    ModelExchange,
    /// The machine does.
    CoSimulation {
        /// True if the importer handles events.
        events: bool,
        /// True if a step may end before its end.
        early: bool,
    },
}

/// Where an instance stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// It was made.
    Instantiated,
    /// Its start is being found.
    Initialization,
    /// Time stands, and parts may begin to do something else.
    Event,
    /// Model exchange between events.
    Continuous,
    /// Co-simulation between steps.
    Step,
    /// It is over.
    Terminated,
    /// It cannot go on.
    Broken,
}

impl Phase {
    /// Its name.
    fn word(self) -> &'static str {
        match self {
            Phase::Instantiated => "instantiated",
            Phase::Initialization => "initialization mode",
            Phase::Event => "event mode",
            Phase::Continuous => "continuous-time mode",
            Phase::Step => "step mode",
            Phase::Terminated => "terminated",
            Phase::Broken => "broken",
        }
    }
}

/// An input over time: a polynomial since it was set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Input {
    pub(crate) since: f64,
    pub(crate) coefficients: [f64; DEGREE + 1],
}

impl Input {
    /// True if it does not change by itself.
    fn is_held(&self) -> bool {
        self.coefficients[1..].iter().all(|c| *c == 0.0)
    }

    pub(crate) fn at(&self, time: f64) -> f64 {
        let tau = time - self.since;
        self.coefficients.iter().rev().fold(0.0, |sum, c| sum * tau + c)
    }

    /// Its derivative of this order with respect to time.
    pub(crate) fn derivative(&self, time: f64, order: usize) -> f64 {
        let tau = time - self.since;
        // k!/(k − n)!
        let falling = |k: usize| (k - order + 1..=k).map(|factor| factor as f64).product::<f64>();
        (order..=DEGREE).rev().fold(0.0, |sum, k| sum * tau + falling(k) * self.coefficients[k])
    }
}

/// The machine behind an instance.
#[derive(Clone)]
pub(crate) enum Plant {
    /// None yet, or not with the present numbers.
    None,
    /// It moves by itself.
    Machine(Box<Simulator>),
    /// It is moved.
    Dynamics(Box<Dynamics>),
}

/// An instance: all of it is its state, which a clone keeps.
#[derive(Clone)]
pub struct Instance {
    pub(crate) model: Arc<Model>,
    pub(crate) purpose: Use,
    pub(crate) phase: Phase,
    pub(crate) time: f64,
    /// Where it began, and where it must end, s.
    pub(crate) begin: f64,
    pub(crate) stop: Option<f64>,
    pub(crate) parameters: Vec<f64>,
    /// Integrated quantities: where they are to start, and of model exchange now.
    pub(crate) quantities: Vec<f64>,
    /// Where the machine started.
    pub(crate) start: Vec<f64>,
    pub(crate) inputs: Vec<Input>,
    /// Forces on bodies that the mechanism has as numbers.
    pub(crate) forces: Vec<f64>,
    pub(crate) plant: Plant,
    pub(crate) control: Option<Stepped>,
    /// True once a reference ahead of time was other than zero: whoever sets none has it extrapolated.
    pub(crate) sees_ahead: bool,
    /// True if inputs were set that the plant does not know yet; and whether the columns are those of now.
    pub(crate) is_set: bool,
    pub(crate) columns: Option<Vec<f64>>,
    /// True if the machine has ended the run.
    pub(crate) is_over: bool,
}

impl Instance {
    /// A new one.
    pub fn new(model: Arc<Model>, purpose: Use) -> Self {
        let count = model.variables.iter().filter(|variable| place(&model, variable.role).is_some()).count();
        Self {
            purpose,
            phase: Phase::Instantiated,
            time: 0.0,
            begin: 0.0,
            stop: None,
            parameters: model.defaults(),
            quantities: model.quantities.iter().map(|(_, start)| *start).collect(),
            start: vec![0.0; model.quantities.len()],
            inputs: vec![Input { since: 0.0, coefficients: [0.0; DEGREE + 1] }; count],
            forces: vec![0.0; model.loads.len()],
            plant: Plant::None,
            control: None,
            sees_ahead: false,
            is_set: true,
            columns: None,
            is_over: false,
            model,
        }
    }

    /// The machine and its variables.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Where it stands.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Time now, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// True if the machine has ended the run: its cart left its travel.
    pub fn is_over(&self) -> bool {
        self.is_over
    }

    /// As it was made.
    fn renew(&mut self) {
        *self = Self::new(Arc::clone(&self.model), self.purpose);
    }

    /// Refuses a function outside of its phases.
    pub fn allow(&self, function: &str, phases: &[Phase]) -> Refusable<()> {
        match phases.contains(&self.phase) {
            true => Ok(()),
            false => {
                let allowed: Vec<&str> = phases.iter().map(|phase| phase.word()).collect();
                Err(Refusal::error(format!(
                    "{function} cannot be called here: the instance is {}; allowed: {}",
                    self.phase.word(),
                    allowed.join(", ")
                )))
            }
        }
    }

    /// Refuses a function of the other kind.
    pub fn only(&self, function: &str, wanted: bool) -> Refusable<()> {
        match wanted {
            true => Ok(()),
            false => Err(Refusal::error(format!("{function} is not of this kind of instance"))),
        }
    }

    /// Refuses a function of model exchange in an instance that is not for it, or outside these phases.
    pub fn exchanged(&self, function: &str, phases: &[Phase]) -> Refusable<()> {
        self.only(function, self.exchanges())?;
        self.allow(function, phases)
    }

    /// True if it is for model exchange.
    pub fn exchanges(&self) -> bool {
        self.purpose == Use::ModelExchange
    }

    // --- from one phase to the next ---------------------------------------------------------------------------------

    /// Where it begins and where it must end.
    pub fn set_up(&mut self, start: f64, stop: Option<f64>) -> Refusable<()> {
        if !start.is_finite() || stop.is_some_and(|stop| stop.is_nan() || stop < start) {
            return Err(Refusal::error(format!(
                "a run from {start} s to {stop:?} s cannot be; allowed: an end behind the start"
            )));
        }
        (self.begin, self.time, self.stop) = (start, start, stop);
        self.inputs.iter_mut().for_each(|input| input.since = start);
        Ok(())
    }

    /// Its start is found from here on.
    pub fn enter_initialization(&mut self) -> Refusable<()> {
        self.phase = Phase::Initialization;
        self.columns = None;
        Ok(())
    }

    /// Its start is found.
    pub fn exit_initialization(&mut self) -> Refusable<()> {
        self.prepare()?;
        self.phase = match self.purpose {
            Use::ModelExchange | Use::CoSimulation { events: true, .. } => Phase::Event,
            Use::CoSimulation { events: false, .. } => Phase::Step,
        };
        self.columns = None;
        Ok(())
    }

    /// To another phase, from one of these.
    pub fn go_into(&mut self, function: &str, from: &[Phase], to: Phase) -> Refusable<()> {
        self.allow(function, from)?;
        (self.phase, self.columns) = (to, None);
        Ok(())
    }

    /// As it was made.
    pub fn reset(&mut self) -> Refusable<()> {
        self.renew();
        Ok(())
    }

    /// It cannot be used any more.
    pub fn break_down(&mut self) {
        self.phase = Phase::Broken;
    }

    // --- the plant --------------------------------------------------------------------------------------------------

    /// The mechanism with the present parameters and forces.
    pub(crate) fn mechanism(&self) -> Refusable<Mechanism> {
        let mut mechanism = self.model.mechanism(&self.parameters)?;
        for ((index, body), force) in self.model.loads.iter().enumerate().zip(&self.forces) {
            if self.model.force_input(index).is_none() {
                mechanism.bodies[*body].force += force;
            }
        }
        Ok(mechanism)
    }

    /// Makes the machine, where there is none with the present numbers.
    pub(crate) fn prepare(&mut self) -> Refusable<()> {
        if !matches!(self.plant, Plant::None) {
            return Ok(());
        }
        self.start.clone_from(&self.quantities);
        self.make()?;
        self.is_set = true;
        self.refresh()
    }

    /// Makes the machine in its start.
    pub(crate) fn make(&mut self) -> Refusable<()> {
        let mechanism = self.mechanism()?;
        let state = self.model.state(&mechanism, &self.start);
        let design = self.model.design.as_ref();
        self.control = design.map(|design| Stepped::new(design, &self.model.set(&self.parameters))).transpose()?;
        self.plant = match self.purpose {
            Use::ModelExchange => Plant::Dynamics(Box::new(Dynamics::new(&mechanism, &state)?)),
            Use::CoSimulation { .. } => {
                let solver = Solver::of_mechanism(&mechanism);
                Plant::Machine(Box::new(Simulator::of_mechanism(&mechanism, &state, solver, self.model.every)?))
            }
        };
        Ok(())
    }

    /// The inputs of the mechanism now, and their polynomials since when.
    pub(crate) fn pieces(&self) -> [Piece; DRIVES] {
        let held = |value: f64| {
            let mut coefficients = [0.0; DEGREE + 1];
            coefficients[0] = value;
            Piece { start: self.time - self.begin, end: f64::INFINITY, coefficients }
        };
        let mut pieces = [held(0.0); DRIVES];
        for variable in &self.model.variables {
            let Some(index) = place(&self.model, variable.role) else { continue };
            let input = &self.inputs[index];
            let drive = match variable.role {
                Role::Input(drive) => Some(drive),
                Role::Force(load) => self.model.force_input(load),
                _ => None,
            };
            if let Some(drive) = drive {
                let Input { since, coefficients } = *input;
                pieces[drive] = Piece { start: since - self.begin, end: f64::INFINITY, coefficients };
            }
        }
        for (piece, command) in pieces.iter_mut().zip(self.control.iter().flat_map(Stepped::commands)) {
            *piece = held(*command);
        }
        let machine = self.model.machine();
        if self.control.is_some() && machine.stepper().is_some() {
            // The command of a stepper corrects the reference of its part of the belt.
            for (piece, shares) in pieces.iter_mut().zip(machine.belt_shares()) {
                for (slide, share) in shares.iter().enumerate() {
                    let now = self.polynomial(slide);
                    piece.coefficients.iter_mut().zip(now).for_each(|(sum, own)| *sum += share * own);
                }
            }
        }
        pieces
    }

    /// The reference of a slide from its five inputs, and the time from which it goes on by its derivatives, s: the
    /// last one at which an input was set. A position that was set as a polynomial has its own, so that time is now.
    pub(crate) fn reference(&self, role: fn(usize) -> Role, slide: usize) -> (f64, Reference) {
        let none = Input { since: self.begin, coefficients: [0.0; DEGREE + 1] };
        let own: [Input; REFERENCES] = std::array::from_fn(|k| {
            place(&self.model, role(slide * REFERENCES + k)).map_or(none, |place| self.inputs[place])
        });
        let origin = match own[0].is_held() {
            true => own.iter().map(|input| input.since).fold(f64::NEG_INFINITY, f64::max),
            false => self.time,
        };
        let [position, speed, acceleration, jerk, snap] = own.map(|input| input.at(origin));
        (origin, Reference { position, speed, acceleration, jerk, snap })
    }

    /// The reference position of a slide as a polynomial of the time from now on.
    fn polynomial(&self, slide: usize) -> [f64; DEGREE + 1] {
        let position = &self.inputs[REFERENCES * slide];
        if !position.is_held() {
            return shifted(&position.coefficients, self.time - position.since);
        }
        let (origin, reference) = self.reference(Role::Reference, slide);
        let Reference { position, speed, acceleration, jerk, snap } = reference.after(self.time - origin);
        let mut coefficients = [0.0; DEGREE + 1];
        // x(τ) = Σ x⁽ᵏ⁾ τᵏ/k!
        coefficients[..REFERENCES].copy_from_slice(&[position, speed, acceleration / 2.0, jerk / 6.0, snap / 24.0]);
        coefficients
    }

    /// The forces that the mechanism has as numbers, now.
    fn forces_now(&self) -> Vec<f64> {
        let mut forces = self.forces.clone();
        for variable in &self.model.variables {
            if let (Role::Force(load), Some(index)) = (variable.role, place(&self.model, variable.role))
                && self.model.force_input(load).is_none()
            {
                forces[load] = self.inputs[index].at(self.time);
            }
        }
        forces
    }

    /// Tells the plant its inputs.
    pub(crate) fn refresh(&mut self) -> Refusable<()> {
        if !self.is_set {
            return Ok(());
        }
        let forces = self.forces_now();
        if forces != self.forces {
            self.forces = forces;
            self.replace()?;
        }
        let pieces = self.pieces();
        let drives = self.model.drives() + usize::from(self.model.force_input(0).is_some());
        let (time, now) = (self.time - self.begin, self.time);
        match &mut self.plant {
            Plant::None => {}
            Plant::Machine(machine) => {
                for (drive, piece) in pieces.iter().enumerate().take(drives) {
                    // The machine's clock may be a last bit behind.
                    let start = piece.start.min(machine.time());
                    machine.set_input(drive, &Piece { start, ..*piece })?;
                }
            }
            Plant::Dynamics(dynamics) => {
                let values = pieces.map(|piece| piece.value(time));
                dynamics.put(now, &self.quantities, &values);
            }
        }
        self.is_set = false;
        Ok(())
    }

    /// Goes on with the present numbers of the machine.
    pub(crate) fn replace(&mut self) -> Refusable<()> {
        let mechanism = self.mechanism()?;
        match &mut self.plant {
            Plant::None => {}
            Plant::Machine(machine) => machine.replace(&mechanism),
            Plant::Dynamics(dynamics) => dynamics.replace(&mechanism),
        }
        self.is_set = true;
        self.columns = None;
        Ok(())
    }
}

/// The place of an input among all.
pub(crate) fn place(model: &Model, role: Role) -> Option<usize> {
    let first = if model.design.is_some() { REFERENCES * model.slides() } else { model.drives() };
    match role {
        Role::Input(drive) => Some(drive),
        Role::Reference(k) => Some(k),
        Role::Force(load) => Some(first + load),
        Role::Ahead(k) => Some(first + model.loads.len() + k),
        Role::Time
        | Role::Parameter(..)
        | Role::Output(_)
        | Role::Error(_)
        | Role::Command(_)
        | Role::Quantity(_)
        | Role::Rate(_)
        | Role::Condition(_) => None,
    }
}

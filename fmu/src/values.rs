//! Variables read and set.

use crate::instance::{Instance, Phase, Plant, Refusable, Refusal, place};
use taut_core::mechanism::{DRIVES, Shown};
use taut_core::signal::DEGREE;
use taut_core::solve::{Dynamics, Quantity, Simulator};
use taut_export::fmu::{Causality, FmiType, REFERENCES, Role, Variability, Variable};

/// Phases in which values can be read.
pub(crate) const READ: [Phase; 5] =
    [Phase::Initialization, Phase::Event, Phase::Continuous, Phase::Step, Phase::Terminated];

/// Phases in which states can be kept: all but that of an instance that cannot be used any more.
pub(crate) const ALIVE: [Phase; 6] =
    [Phase::Instantiated, Phase::Initialization, Phase::Event, Phase::Continuous, Phase::Step, Phase::Terminated];

/// Phases in which values can be set.
pub(crate) const SET: [Phase; 5] =
    [Phase::Instantiated, Phase::Initialization, Phase::Event, Phase::Continuous, Phase::Step];

/// The share of a value by which derivatives look to either side: the equations of a mode are linear, or smooth.
const ASIDE: f64 = 1e-6;

impl Instance {
    fn variable(&self, reference: u32, kind: FmiType) -> Refusable<&Variable> {
        match self.model.variable(reference) {
            Some(variable) if variable.kind == kind => Ok(variable),
            Some(variable) => Err(Refusal::error(format!("{} is of another type", variable.name))),
            None => Err(Refusal::error(format!(
                "there is no variable {reference}; allowed: the value references of modelDescription.xml"
            ))),
        }
    }

    /// Real values.
    pub fn reals(&mut self, references: &[u32], into: &mut [f64]) -> Refusable<()> {
        for (into, reference) in into.iter_mut().zip(references) {
            let variable = self.variable(*reference, FmiType::Real)?;
            let (role, quantity) = (variable.role, variable.quantity);
            // Ways and speeds are not changed by inputs at once, and need none of the other columns.
            let quantity = quantity.map(|index| self.model.quantities[index].0);
            *into = match (&self.plant, quantity) {
                (Plant::Machine(machine), Some(Quantity::Position(body))) => machine.state().position[body] + 0.0,
                (Plant::Machine(machine), Some(Quantity::Speed(body))) => machine.state().speed[body] + 0.0,
                _ => self.real(role)?,
            };
        }
        Ok(())
    }

    /// Whole values.
    pub fn wholes(&mut self, references: &[u32], into: &mut [i32]) -> Refusable<()> {
        for (into, reference) in into.iter_mut().zip(references) {
            let role = self.variable(*reference, FmiType::Whole)?.role;
            *into = self.real(role)? as i32;
        }
        Ok(())
    }

    fn real(&mut self, role: Role) -> Refusable<f64> {
        Ok(match role {
            Role::Time => self.time,
            Role::Input(_) | Role::Force(_) | Role::Reference(_) | Role::Ahead(_) => {
                place(&self.model, role).map_or(0.0, |place| self.inputs[place].at(self.time))
            }
            Role::Parameter(index, _) => self.parameters[index],
            Role::Output(column) => self.columns()?.get(column).copied().unwrap_or(0.0),
            Role::Error(slide) => {
                let reference = self.inputs[REFERENCES * slide].at(self.time);
                reference - self.load_position(slide)?
            }
            Role::Command(drive) => {
                self.prepare()?;
                self.control.as_ref().map_or(0.0, |control| control.commands()[drive])
            }
            Role::Quantity(index) => self.integrated()?[index],
            Role::Rate(index) => {
                let mut rates = vec![0.0; self.model.quantities.len()];
                self.dynamics()?.rates(&mut rates);
                rates[index]
            }
            Role::Condition(index) => {
                let mut residuals = vec![0.0; self.model.conditions];
                self.dynamics()?.residuals(&mut residuals);
                residuals[index]
            }
        })
    }

    /// The position of a slide.
    fn load_position(&mut self, slide: usize) -> Refusable<f64> {
        self.prepare()?;
        let load = self.model.loads[slide];
        Ok(match &self.plant {
            Plant::Machine(machine) => machine.state().position[load],
            Plant::None | Plant::Dynamics(_) => {
                let place = self.model.quantities.iter().position(|(q, _)| *q == Quantity::Position(load));
                place.map_or(0.0, |place| self.quantities[place])
            }
        })
    }

    /// The columns of a run now.
    fn columns(&mut self) -> Refusable<&[f64]> {
        self.prepare()?;
        if self.columns.is_none() {
            let mut values = Vec::new();
            let count = |mechanism: &taut_core::mechanism::Mechanism| mechanism.columns.len();
            if self.is_set && matches!(self.plant, Plant::Machine(_)) {
                // On a copy, as other inputs may yet be set at this time.
                let machine = self.as_set()?;
                values.resize(count(machine.mechanism()), 0.0);
                machine.outputs(&mut values);
            } else {
                self.refresh()?;
                match &self.plant {
                    Plant::None => {}
                    Plant::Machine(machine) => {
                        values.resize(count(machine.mechanism()), 0.0);
                        machine.outputs(&mut values);
                    }
                    Plant::Dynamics(dynamics) => {
                        values.resize(count(dynamics.mechanism()), 0.0);
                        dynamics.outputs(&mut values);
                    }
                }
            }
            self.columns = Some(values);
        }
        Ok(self.columns.as_deref().unwrap_or_default())
    }

    /// The integrated quantities now.
    pub(crate) fn integrated(&mut self) -> Refusable<Vec<f64>> {
        self.prepare()?;
        let Plant::Machine(machine) = &self.plant else { return Ok(self.quantities.clone()) };
        let state = machine.state();
        let bristle = |body: usize| {
            let is_it =
                |heading: &taut_core::mechanism::Heading| heading.shown == taut_core::mechanism::Shown::Bristle(body);
            machine.columns().iter().position(is_it)
        };
        let places: Vec<(Quantity, Option<usize>)> = (self.model.quantities.iter())
            .map(|(quantity, _)| match *quantity {
                Quantity::Bristle(body) => (*quantity, bristle(body)),
                other => (other, None),
            })
            .collect();
        let columns = self.columns()?;
        let of = |(quantity, column): &(Quantity, Option<usize>)| match *quantity {
            Quantity::Position(body) => state.position[body],
            Quantity::Speed(body) => state.speed[body],
            Quantity::Current(number) => state.current[number],
            Quantity::Bristle(_) => column.map_or(0.0, |column| columns[column]),
        };
        Ok(places.iter().map(of).collect())
    }

    /// The equations of the machine as it stands.
    pub(crate) fn dynamics(&mut self) -> Refusable<Dynamics> {
        self.prepare()?;
        if let Plant::Dynamics(_) = self.plant {
            self.refresh()?;
        }
        if let Plant::Dynamics(dynamics) = &self.plant {
            return Ok((**dynamics).clone());
        }
        let (values, time) = (self.integrated()?, self.time - self.begin);
        let mechanism = self.mechanism()?;
        let mut dynamics = Dynamics::new(&mechanism, &self.model.state(&mechanism, &values))?;
        let inputs: [f64; DRIVES] = self.pieces().map(|piece| piece.value(time));
        dynamics.put(self.time, &values, &inputs);
        let _ = dynamics.settle(&mut Vec::new());
        Ok(dynamics)
    }

    /// Sets real values: all of them, or none.
    pub fn set_reals(&mut self, references: &[u32], values: &[f64]) -> Refusable<()> {
        let mut copy: Option<(Vec<f64>, Vec<f64>)> = None;
        let mut roles = Vec::with_capacity(references.len());
        for (reference, value) in references.iter().zip(values) {
            let variable = self.variable(*reference, FmiType::Real)?;
            if !value.is_finite() {
                return Err(Refusal::error(format!("{} cannot be {value}; allowed: any finite number", variable.name)));
            }
            self.may_set(variable)?;
            roles.push((variable.role, variable.quantity, *value));
        }
        let mut renews = false;
        for (role, quantity, value) in roles {
            match (place(&self.model, role), role, quantity) {
                (Some(place), ..) => {
                    let input = &mut self.inputs[place];
                    let mut held = [0.0; DEGREE + 1];
                    held[0] = value;
                    // One that is held at this value already goes on.
                    if input.coefficients != held {
                        (input.since, input.coefficients, self.is_set) = (self.time, held, true);
                    }
                }
                (None, Role::Parameter(index, _), _) => {
                    copy.get_or_insert_with(|| (self.parameters.clone(), self.quantities.clone()));
                    renews |= self.parameters[index] != value;
                    self.parameters[index] = value;
                }
                (None, _, Some(quantity)) => {
                    copy.get_or_insert_with(|| (self.parameters.clone(), self.quantities.clone()));
                    renews = true;
                    self.quantities[quantity] = value;
                }
                (None, _, None) => {}
            }
        }
        self.columns = None;
        if renews {
            let done = match self.phase {
                Phase::Instantiated | Phase::Initialization => {
                    self.plant = Plant::None;
                    self.mechanism().map(|_| ())
                }
                Phase::Event | Phase::Continuous | Phase::Step | Phase::Terminated | Phase::Broken => self.replace(),
            };
            if let (Err(refusal), Some((parameters, quantities))) = (done, copy) {
                (self.parameters, self.quantities) = (parameters, quantities);
                return Err(refusal);
            }
        }
        Ok(())
    }

    /// Refuses what cannot be set now.
    fn may_set(&self, variable: &Variable) -> Refusable<()> {
        let before = matches!(self.phase, Phase::Instantiated | Phase::Initialization);
        let may = match variable.role {
            Role::Input(_) | Role::Force(_) | Role::Reference(_) | Role::Ahead(_) => true,
            // Of model exchange in event mode, of co-simulation between steps too.
            Role::Parameter(_, tunable) => before || (tunable && self.phase != Phase::Continuous),
            Role::Output(_) | Role::Quantity(_) => before && variable.quantity.is_some(),
            Role::Time | Role::Error(_) | Role::Command(_) | Role::Rate(_) | Role::Condition(_) => false,
        };
        match may {
            true => Ok(()),
            false => Err(Refusal::error(format!(
                "{} cannot be set here; allowed: inputs, parameters and start values before the start, inputs and \
                 tunable parameters behind it",
                variable.name
            ))),
        }
    }

    /// Derivatives of inputs with respect to time from now on: u(t) = Σ u⁽ᵏ⁾ (t − t₀)ᵏ/k!
    pub fn set_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Refusable<()> {
        let mut set = Vec::new();
        for ((reference, order), value) in references.iter().zip(orders).zip(values) {
            let variable = self.variable(*reference, FmiType::Real)?;
            let Some(place) = place(&self.model, variable.role) else {
                return Err(Refusal::error(format!("{} is no input", variable.name)));
            };
            let order = usize::try_from(*order).ok().filter(|order| (1..=DEGREE).contains(order));
            let (Some(order), true) = (order, value.is_finite()) else {
                return Err(Refusal::error(format!(
                    "a derivative of {} cannot be this; allowed: a finite number, of order 1 to {DEGREE}",
                    variable.name
                )));
            };
            set.push((place, order, *value));
        }
        for (place, order, value) in set {
            let input = &mut self.inputs[place];
            if input.since != self.time {
                let value = input.at(self.time);
                (input.since, input.coefficients) = (self.time, [0.0; DEGREE + 1]);
                input.coefficients[0] = value;
            }
            input.coefficients[order] = value / (1..=order).map(|k| k as f64).product::<f64>();
        }
        (self.is_set, self.columns) = (true, None);
        Ok(())
    }

    /// Derivatives of outputs with respect to time, of orders 1 to [`DEGREE`]: exact, those of the present mode.
    /// Errors: what is no output that changes all the time, or a machine whose equations are curved.
    pub fn output_derivatives(&mut self, references: &[u32], orders: &[i32], into: &mut [f64]) -> Refusable<()> {
        let mut values: Vec<f64> = Vec::new();
        let machine = self.as_set()?;
        for ((into, reference), order) in into.iter_mut().zip(references).zip(orders) {
            let variable = self.variable(*reference, FmiType::Real)?;
            let order = usize::try_from(*order).ok().filter(|order| (1..=DEGREE).contains(order));
            let (Some(order), Causality::Output, Variability::Continuous) =
                (order, variable.causality(), variable.variability())
            else {
                return Err(Refusal::error(format!(
                    "there is no such derivative of {}; allowed: orders 1 to {DEGREE} of outputs that are continuous",
                    variable.name
                )));
            };
            values.resize(machine.columns().len(), 0.0);
            if machine.derivatives(order, &mut values).is_none() {
                return Err(Refusal::error(
                    "there are no derivatives of outputs: friction or stiffness of this machine is a curve",
                ));
            }
            let of = |shown: Shown| machine.columns().iter().position(|heading| heading.shown == shown);
            *into = match variable.role {
                Role::Output(column) => values[column],
                Role::Error(slide) => {
                    let load = of(Shown::Position(self.model.loads[slide], 1.0));
                    let reference = self.inputs[REFERENCES * slide].derivative(self.time, order);
                    reference - load.map_or(0.0, |column| values[column])
                }
                // The controller's command is held, and is no continuous output; nothing else is an output.
                _ => 0.0,
            };
        }
        Ok(())
    }

    /// A copy of the machine that has taken the inputs as they are set now.
    fn as_set(&self) -> Refusable<Simulator> {
        let mut copy = self.clone();
        copy.prepare()?;
        copy.refresh()?;
        match copy.plant {
            Plant::Machine(mut machine) => {
                let now = machine.time();
                // An early end is told by the step.
                let _ = machine.advance(now, &mut Vec::new());
                Ok(*machine)
            }
            Plant::None | Plant::Dynamics(_) => Err(Refusal::error("there is no machine that moves by itself")),
        }
    }

    /// The change of `unknowns` when `knowns`, inputs or integrated quantities, change as `seed` says, in the present
    /// mode: central differences, to 1e-9 of what the equations of a mode give.
    pub fn directional(&mut self, unknowns: &[u32], knowns: &[u32], seed: &[f64], into: &mut [f64]) -> Refusable<()> {
        let mut moved = Vec::new();
        for (reference, seed) in knowns.iter().zip(seed) {
            let variable = self.variable(*reference, FmiType::Real)?.clone();
            let value = self.real(variable.role)?;
            let is_known =
                place(&self.model, variable.role).is_some() || (variable.quantity.is_some() && self.exchanges());
            if !is_known || !seed.is_finite() {
                return Err(Refusal::error(format!(
                    "there is no derivative with respect to {}; allowed: inputs, and of model exchange states",
                    variable.name
                )));
            }
            moved.push((variable, value, *seed));
        }
        let most = moved.iter().fold(0.0, |most: f64, (_, _, seed)| most.max(seed.abs()));
        let roles = unknowns.iter().map(|reference| Ok(self.variable(*reference, FmiType::Real)?.role));
        let roles = roles.collect::<Refusable<Vec<Role>>>()?;
        if most == 0.0 {
            into.fill(0.0);
            return Ok(());
        }
        let size = moved.iter().fold(1.0, |size: f64, (_, value, _)| size.max(value.abs()));
        let aside = ASIDE * size / most;
        let at = |by: f64| -> Refusable<Vec<f64>> {
            let mut copy = self.clone();
            for (variable, value, seed) in &moved {
                match (place(&copy.model, variable.role), variable.quantity) {
                    (Some(place), _) => copy.inputs[place].coefficients[0] += by * seed,
                    (None, Some(quantity)) => copy.quantities[quantity] = value + by * seed,
                    (None, None) => {}
                }
            }
            (copy.is_set, copy.columns) = (true, None);
            roles.iter().map(|role| copy.real(*role)).collect()
        };
        let (low, high) = (at(-aside)?, at(aside)?);
        for ((into, low), high) in into.iter_mut().zip(low).zip(high) {
            *into = (high - low) / (2.0 * aside);
        }
        Ok(())
    }
}

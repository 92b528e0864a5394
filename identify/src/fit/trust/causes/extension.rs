//! The elements that a model may lack, one row each.

use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::Nuisance;
use crate::fit::search::starts::{Searched, is_noise};
use crate::fit::trust::doubts::Size;
use crate::friction::Friction;
use crate::log::Quantity;
use crate::machine::{AmplifierMode, Machine};
use crate::number::engineering;
use crate::solve::Bench;
use std::cell::OnceCell;

/// End of the fit without the element.
pub(super) struct Site<'s, 'a> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub found: &'s Searched<'a>,
    /// The machine with the estimates.
    pub machine: Machine,
    /// True if the fit of a machine of several coordinates ended elsewhere than within the noise, so that elements
    /// begin with the values of the case.
    pub is_anew: bool,
    fastest: OnceCell<f64>,
}

/// The machines on which an element is tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum On {
    Any,
    Axis,
    Gantry,
}

impl On {
    pub fn takes(self, machine: &Machine) -> bool {
        match self {
            On::Any => true,
            On::Axis => machine.has_one_coordinate(),
            On::Gantry => !machine.has_one_coordinate(),
        }
    }
}

/// One element.
pub(super) struct Extension {
    pub key: &'static str,
    pub on: On,
    /// True if its runs have no exact derivatives.
    pub is_curved: bool,
    /// The case and the plan with it, once for each start; empty if the case has it already.
    pub tries: fn(&Site) -> Vec<Extended>,
    /// The element in words.
    pub words: fn(&Site, &Extended, &Fitted) -> Said,
    /// A machine of the case with it as one of the case without it.
    pub without: fn(&Site, Machine) -> Machine,
}

/// A case with one additional element, at the start of its search.
#[derive(Clone)]
pub(super) struct Extended {
    pub case: Case,
    pub plan: Plan,
    pub telling: Telling,
    /// The size of the element, if its parameter is not the size itself.
    pub size: Option<Measure>,
    /// True if the sensor is assumed at the motor.
    pub at_motor: bool,
    /// Parameters that are free only when the others have been fitted, with their bounds.
    pub later: Vec<(String, [f64; 2])>,
}

/// Evidence for an element.
#[derive(Clone)]
pub(super) enum Telling {
    /// The parameter of this name, which is zero, or stiff, without the element.
    Parameter(String),
    /// A nuisance parameter that all logs share, and the start of its search, SI.
    Nuisance(Nuisance, f64),
    /// The parameters of these names, which are equal without the element.
    Apart(Vec<String>),
    /// The parameter of this name, which is that of the case without the element.
    Differs(String),
}

/// A quantity that is a multiple of a parameter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Measure {
    pub name: &'static str,
    pub unit: &'static str,
    /// Its value for a parameter of 1.
    pub per: f64,
}

/// A fit with the element.
pub(super) struct Fitted<'t> {
    /// The machine, for the first log if logs have values of their own.
    pub machine: Machine,
    /// The parameters that the fit without it does not have.
    pub sizes: &'t [Size],
    /// The size of the element, SI.
    pub value: f64,
    /// Standard deviation of the sampling times, s, if the residuals show it.
    pub scatter: Option<f64>,
}

/// A body whose Coulomb friction is free.
pub(super) struct Rubs {
    pub key: &'static str,
    /// Its torque per N at the cart.
    pub arm: f64,
    pub friction: Friction,
}

/// An element in words, with its size, and the change of the case file that adds it.
pub(super) struct Said {
    pub words: String,
    pub add: String,
}

impl Extended {
    pub fn new(case: Case, plan: Plan, telling: Telling) -> Self {
        Self { case, plan: Plan { starts: 1, ..plan }, telling, size: None, at_motor: false, later: Vec::new() }
    }
}

impl<'s, 'a> Site<'s, 'a> {
    pub fn new(case: &'s Case, plan: &'s Plan, found: &'s Searched<'a>) -> Self {
        let machine = found.problem.stage_at(&found.best.x);
        let is_anew = !machine.has_one_coordinate() && !is_noise(&found.problem, &found.best);
        Self { case, plan, found, machine, is_anew, fastest: OnceCell::new() }
    }

    /// The machine with which elements begin.
    pub fn begins(&self) -> &Machine {
        if self.is_anew { &self.case.machine } else { &self.machine }
    }

    /// The case with another machine.
    pub fn with(&self, machine: Machine) -> Case {
        Case { machine, ..self.case.clone() }
    }

    /// Standard deviation of the residuals of a quantity, or of the quantity that it represents.
    pub fn deviation(&self, quantity: Quantity) -> f64 {
        let r = self.machine.pulley_radius;
        let of = |own: Quantity| self.found.noise.iter().find(|(other, _)| *other == own).map(|(_, sigma)| *sigma);
        let stands_for = match quantity {
            Quantity::RotorAngle => of(Quantity::DriveAngle).or(of(Quantity::CartPosition).map(|sigma| sigma / r)),
            Quantity::RotorSpeed => of(Quantity::DriveSpeed).or(of(Quantity::CartSpeed).map(|sigma| sigma / r)),
            _ => None,
        };
        of(quantity).or(stands_for).unwrap_or(1e-12)
    }

    /// The standard deviation of the residuals of positions, as lengths at the cart, m; `None` if no log has one.
    pub fn position_deviation(&self) -> Option<f64> {
        let r = self.machine.pulley_radius;
        self.found.noise.iter().find_map(|(quantity, sigma)| match quantity {
            Quantity::CartPosition => Some(*sigma),
            Quantity::DriveAngle => Some(r * sigma),
            _ => None,
        })
    }

    /// Largest speed of the cart in the logs by the model, m/s.
    pub fn fastest(&self) -> f64 {
        *self.fastest.get_or_init(|| self.run_fastest())
    }

    fn run_fastest(&self) -> f64 {
        let (problem, x): (&Problem, _) = (&self.found.problem, &self.found.best.x);
        let (mut bench, mut speeds, mut most) = (Bench::default(), [Vec::new()], 0.0);
        for (index, run) in problem.runs.iter().enumerate() {
            let extras = problem.extras_of(index, x);
            if run.predict(&mut bench, &self.machine, &extras, &[Quantity::CartSpeed], &mut speeds) {
                most = speeds[0].iter().fold(most, |most: f64, v| most.max(v.abs()));
            }
        }
        most
    }

    /// J₁ + J₃ + r² M + n² J_r, total inertia at the drive pulley, kg m².
    pub fn inertia(&self) -> f64 {
        let Machine { pulley_radius: r, drive_pulley, idler_pulley, cart, drives, .. } = &self.machine;
        let motor = &drives[0].motor;
        let rotor = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia;
        drive_pulley.inertia + idler_pulley.inertia + r * r * cart.mass + rotor
    }

    /// The body whose Coulomb friction is free; `None` if there is no such body, or if it follows another law.
    pub fn rubs(&self) -> Option<Rubs> {
        let Machine { pulley_radius: r, cart, drive_pulley, idler_pulley, .. } = &self.machine;
        let bodies = [
            ("cart", 1.0, cart.friction),
            ("drive_pulley", *r, drive_pulley.friction),
            ("idler_pulley", *r, idler_pulley.friction),
        ];
        let is_free = |key: &str| self.is_free(&format!("{key}.friction.coulomb")) || self.is_free("total.coulomb");
        let own = bodies.into_iter().find(|(key, _, friction)| is_free(key) && friction.forward.coulomb > 0.0);
        own.map(|(key, arm, friction)| Rubs { key, arm, friction })
    }

    /// True if a key of the case file is free, alone or with others.
    pub fn is_free(&self, key: &str) -> bool {
        self.found.problem.parameters.iter().flat_map(|own| &own.keys).any(|(own, _)| own == key)
    }

    /// The greatest logged input, either way.
    pub fn greatest_input(&self) -> f64 {
        let inputs = self.found.problem.runs.iter().flat_map(|run| &run.logged[0]);
        inputs.fold(0.0, |most: f64, input| most.max(input.abs()))
    }

    /// The motor's force on the cart at the greatest input, N.
    pub fn force(&self) -> f64 {
        let (drive, most) = (&self.machine.drives[0], self.greatest_input());
        let motor = &drive.motor;
        // F = n K_t g u/r, or over R
        let per_unit = motor.gear_ratio * motor.torque_constant * drive.amplifier.gain / self.machine.pulley_radius;
        let resistance = if drive.amplifier.mode == AmplifierMode::Voltage { motor.resistance } else { 1.0 };
        (per_unit / resistance * most).abs()
    }
}

/// The friction of the body with this key.
pub(super) fn friction_of<'m>(machine: &'m mut Machine, key: &str) -> &'m mut Friction {
    match key {
        "cart" => &mut machine.cart.friction,
        "drive_pulley" => &mut machine.drive_pulley.friction,
        _ => &mut machine.idler_pulley.friction,
    }
}

/// A value in three digits.
pub(super) fn shown(value: f64, unit: &str) -> String {
    engineering(value, unit, 3).replace(['\u{a0}', '\u{202f}'], " ").replace('−', "-")
}

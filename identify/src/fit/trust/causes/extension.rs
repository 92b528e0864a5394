//! The elements that a model may lack, one row each.

use crate::case::{Case, Plan};
use crate::fit::asked::problem::Problem;
use crate::fit::asked::run::Nuisance;
use crate::fit::search::starts::{InWindows, Searched, end_in_windows, is_noise};
use crate::fit::trust::doubts::Size;
use crate::friction::Friction;
use crate::log::Quantity;
use crate::machine::{AmplifierMode, Machine, Slide};
use crate::number::engineering;
use crate::solve::Bench;
use std::sync::OnceLock;

/// End of the fit without the element.
pub(super) struct Site<'s, 'a> {
    pub case: &'s Case,
    pub plan: &'s Plan,
    pub found: &'s Searched<'a>,
    /// The machine with the estimates.
    pub machine: Machine,
    /// The keys of its slides.
    pub slides: Vec<&'static str>,
    /// True if the fit of a machine of several coordinates ended elsewhere than within the noise, so that elements
    /// begin with the values of the case.
    pub is_anew: bool,
    fastest: OnceLock<Vec<f64>>,
    windows: OnceLock<Option<InWindows<'a>>>,
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
    /// The parameter of the first name, which is equal to the number with the second without the element.
    Above(String, String),
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
    /// The number that it is above, SI; zero for other elements.
    pub least: f64,
    /// Standard deviation of the sampling times, s, if the residuals show it.
    pub scatter: Option<f64>,
}

/// A body whose Coulomb friction is free.
pub(super) struct Rubs {
    pub key: &'static str,
    /// The slide that it moves with.
    pub slide: &'static str,
    /// Its torque per N at that slide.
    pub arm: f64,
    pub friction: Friction,
}

/// An element in words, with its size, and the change of the case file that adds it.
#[derive(Default)]
pub(super) struct Said {
    pub words: String,
    pub add: String,
}

impl Extended {
    pub fn new(case: Case, plan: Plan, telling: Telling) -> Self {
        Self { case, plan: Plan { starts: 1, ..plan }, telling, size: None, at_motor: false, later: Vec::new() }
    }

    /// The row of the table, the side on which the sensor is, and the part of the machine, one of several, that has it.
    pub fn kind(&self, row: &Extension) -> (&'static str, bool, &str) {
        let part = match &self.telling {
            Telling::Differs(name) | Telling::Parameter(name) | Telling::Above(name, _) => name,
            Telling::Nuisance(Nuisance::SensorScale(quantity) | Nuisance::SensorPlay(quantity), _) => quantity.name(),
            Telling::Nuisance(Nuisance::Delay(Some(drive)), _) => self.case.machine.geometry().drives[*drive].key,
            Telling::Nuisance(..) | Telling::Apart(_) => "",
        };
        (row.key, self.at_motor, part)
    }
}

impl<'s, 'a> Site<'s, 'a> {
    pub fn new(case: &'s Case, plan: &'s Plan, found: &'s Searched<'a>) -> Self {
        let machine = found.problem.stage_at(&found.best.x);
        let is_anew = !machine.has_one_coordinate() && !is_noise(&found.problem, &found.best);
        let geometry = machine.geometry();
        let slides = geometry.slides.iter().map(|slide| geometry.label(slide.body).key).collect();
        Self { case, plan, found, machine, slides, is_anew, fastest: OnceLock::new(), windows: OnceLock::new() }
    }

    /// The fit without the element in short windows, in which elements of this fit begin; `None` if it fails.
    pub fn windows(&self) -> Option<&InWindows<'a>> {
        let problem = &self.found.problem;
        self.windows.get_or_init(|| end_in_windows(self.case, self.plan, problem, &problem.start())).as_ref()
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

    /// Standard deviation of the residuals of a position where elements begin.
    pub fn deviation_at_start(&self, quantity: Quantity) -> f64 {
        let windows = self.is_anew.then(|| self.windows()).flatten();
        let own = windows.and_then(|windows| windows.noise.iter().find(|(other, _)| *other == quantity));
        own.map_or_else(|| self.deviation(quantity), |(_, deviation)| *deviation)
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

    /// Largest speed of a slide in the logs by the model with which elements begin, m/s.
    pub fn fastest(&self, slide: &str) -> f64 {
        let speeds = self.fastest.get_or_init(|| self.run_fastest());
        self.slides.iter().zip(speeds).find(|(own, _)| **own == slide).map_or(0.0, |(_, speed)| *speed)
    }

    fn run_fastest(&self) -> Vec<f64> {
        let problem: &Problem = &self.found.problem;
        let x = if self.is_anew { problem.start() } else { self.found.best.x.clone() };
        let of = |slide: &&str| if *slide == "bridge" { Quantity::BridgeSpeed } else { Quantity::CartSpeed };
        let quantities: Vec<Quantity> = self.slides.iter().map(of).collect();
        let mut columns = vec![Vec::new(); quantities.len()];
        let (mut bench, mut most) = (Bench::default(), vec![0.0f64; quantities.len()]);
        for (index, run) in problem.runs.iter().enumerate() {
            let extras = problem.extras_of(index, &x);
            if run.predict(&mut bench, self.begins(), &extras, &quantities, &mut columns) {
                for (most, speeds) in most.iter_mut().zip(&columns) {
                    *most = speeds.iter().fold(*most, |most, speed| most.max(speed.abs()));
                }
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

    /// The bodies whose Coulomb friction is free: on an axis the first of them, on a gantry any of its slides.
    pub fn rubs(&self) -> Vec<Rubs> {
        let machine = self.begins();
        let Machine { pulley_radius: r, cart, drive_pulley, idler_pulley, .. } = machine;
        let rubs = |key, slide, arm, friction| Rubs { key, slide, arm, friction };
        let is_free = |key: &str| self.is_free(&format!("{key}.friction.coulomb")) || self.is_free("total.coulomb");
        let is_own = |own: &Rubs| is_free(own.key) && own.friction.forward.coulomb > 0.0;
        match &machine.bridge {
            Some(bridge) => {
                let slides = [("bridge", bridge.friction), ("cart", cart.friction)];
                slides.map(|(key, friction)| rubs(key, key, 1.0, friction)).into_iter().filter(is_own).collect()
            }
            None => {
                let bodies = [
                    rubs("cart", "cart", 1.0, cart.friction),
                    rubs("drive_pulley", "cart", *r, drive_pulley.friction),
                    rubs("idler_pulley", "cart", *r, idler_pulley.friction),
                ];
                bodies.into_iter().find(is_own).into_iter().collect()
            }
        }
    }

    /// The one of these bodies that moves with a slide.
    pub fn rubs_with(&self, slide: &str) -> Option<Rubs> {
        self.rubs().into_iter().find(|own| own.slide == slide)
    }

    /// True if a key of the case file is free, alone or with others.
    pub fn is_free(&self, key: &str) -> bool {
        self.found.problem.parameters.iter().flat_map(|own| &own.keys).any(|(own, _)| own == key)
    }

    /// The greatest logged input of a drive, either way.
    pub fn greatest_input(&self, drive: usize) -> f64 {
        let inputs = self.found.problem.runs.iter().flat_map(|run| &run.logged[drive]);
        inputs.fold(0.0, |most: f64, input| most.max(input.abs()))
    }

    /// The force of the first motor on the belt at its greatest input, N.
    pub fn force(&self) -> f64 {
        let (drive, most) = (&self.machine.drives[0], self.greatest_input(0));
        let motor = &drive.motor;
        // F = n K_t g u/r, or over R
        let per_unit = motor.gear_ratio * motor.torque_constant * drive.amplifier.gain / self.machine.pulley_radius;
        let resistance = if drive.amplifier.mode == AmplifierMode::Voltage { motor.resistance } else { 1.0 };
        (per_unit / resistance * most).abs()
    }
}

/// The slide with this key.
pub(super) fn slide_of<'m>(machine: &'m mut Machine, key: &str) -> &'m mut Slide {
    match (key, &mut machine.bridge) {
        ("bridge", Some(bridge)) => bridge,
        _ => &mut machine.cart,
    }
}

/// The friction of the body with this key.
pub(super) fn friction_of<'m>(machine: &'m mut Machine, key: &str) -> &'m mut Friction {
    match key {
        "drive_pulley" => &mut machine.drive_pulley.friction,
        "idler_pulley" => &mut machine.idler_pulley.friction,
        _ => &mut slide_of(machine, key).friction,
    }
}

/// A value in three digits.
pub(super) fn shown(value: f64, unit: &str) -> String {
    engineering(value, unit, 3).replace(['\u{a0}', '\u{202f}'], " ").replace('−', "-")
}

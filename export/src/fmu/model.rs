//! The variables of a machine: the one list that its description is written from and its shared object works by.

use super::variable::{FmiType, Role, Variable, named, plain, rate_unit, typed, typical, words};
use super::{REFERENCES, resource};
use crate::case::Case;
use crate::chance::hash;
use crate::control::Loop;
use crate::design::{Design, FeedForwardModel};
use crate::error::{Error, Result};
use crate::machine::{Machine, SimpleDrive};
use crate::mechanism::{Amplifier, AmplifierMode, Drive, Heading, Label, Mechanism, Shown, State};
use crate::parameter::{self, Free, Parameter, unit_for};
use crate::quantity::shortest;
use crate::solve::{Dynamics, Quantity, check_stage};
use crate::{controller, without_controller};

/// Where the references of each group begin: they stay when another group grows. Zero is time.
const INPUTS: u32 = 1;
const PARAMETERS: u32 = 1000;
const OUTPUTS: u32 = 2000;
const STATES: u32 = 3000;
const RATES: u32 = 4000;
const CONDITIONS: u32 = 5000;

/// A machine with its variables.
#[derive(Debug, Clone)]
pub struct Model {
    /// The title of its case.
    pub title: String,
    /// The machine as a case file.
    pub resource: String,
    /// The mark of this machine and of this list of variables.
    pub token: String,
    /// All variables, references growing.
    pub variables: Vec<Variable>,
    /// The controller inside, if it is to be.
    pub design: Option<Design>,
    /// End and interval of the experiment that it stands for, s.
    pub until: f64,
    /// s
    pub every: f64,
    /// The integrated quantities, with their values at the start.
    pub quantities: Vec<(Quantity, f64)>,
    /// How many conditions its modes have.
    pub conditions: usize,
    /// The bodies on which a force can be put.
    pub loads: Vec<usize>,
    machine: Machine,
    start: State,
    parameters: Vec<(Free, &'static Parameter)>,
}

impl Model {
    /// The machine of a case, with the controller inside if it is asked for. Errors: a controller that the case has
    /// not.
    pub fn new(case: &Case, with_controller: bool) -> Result<Self> {
        let resource = resource::resource(case)?;
        Self::of_resource(&resource, with_controller)
    }

    /// Model from the text of [`super::resource`].
    pub fn of_resource(text: &str, with_controller: bool) -> Result<Self> {
        let case = Case::from_text_with("machine.toml", text, &[])?;
        let [until, every] = resource::times(&case);
        let (machine, design) = (case.machine.clone(), case.controller.clone());
        if with_controller && design.is_none() {
            let missing = controller(&case).map(|_| ());
            missing.map_err(|error| without_controller(&case, error, "leave --part out for the machine alone"))?;
        }
        let design = design.filter(|_| with_controller);
        let mut model = Self {
            title: case.title.as_str().to_string(),
            resource: text.to_string(),
            token: String::new(),
            variables: Vec::new(),
            design,
            until,
            every,
            quantities: Vec::new(),
            conditions: 0,
            loads: Vec::new(),
            parameters: parameters(&machine)?,
            machine,
            start: State::default(),
        };
        let mechanism = model.mechanism(&model.defaults())?;
        let initial = case.first(|one| one.initial, |left| Some(left.initial));
        model.start = mechanism.begun(&initial.unwrap_or_default());
        let dynamics = Dynamics::new(&mechanism, &model.start)?;
        let mut values = vec![0.0; dynamics.quantities().len()];
        dynamics.values(&mut values);
        model.quantities = dynamics.quantities().iter().copied().zip(values).collect();
        model.conditions = dynamics.conditions();
        model.loads = mechanism.roles.loads.clone();
        model.variables = model.list(&mechanism);
        model.token = model.token();
        Ok(model)
    }

    /// The values of the parameters as the case has them, in the order of [`Role::Parameter`].
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters.iter().map(|(free, _)| free.start).collect()
    }

    /// The machine of the case.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Number of slides, each with its reference.
    pub fn slides(&self) -> usize {
        self.machine.geometry().slides.len()
    }

    /// The mechanism with these parameters, and with room for a force on the cart where a drive leaves some. Errors: a
    /// value that none of its kind can have.
    pub fn mechanism(&self, parameters: &[f64]) -> Result<Mechanism> {
        for ((free, row), value) in self.parameters.iter().zip(parameters) {
            if !row.range.contains(*value) {
                return Err(Error::new(format!("{} cannot be {value}", free.name))
                    .allowed(row.range.describe(unit_for(row.unit, self.input_unit()))));
            }
        }
        let machine = self.set(parameters);
        check_stage(&machine)?;
        let mut mechanism = machine.mechanism();
        if self.force_input(0).is_some() {
            mechanism.drives.push(push(machine.geometry().cart()));
        }
        let current = |drive: usize| Quantity::Current(mechanism.first_current(drive));
        let has = |drive: usize| self.quantities.iter().any(|(quantity, _)| *quantity == current(drive));
        let own = mechanism.drives.iter().enumerate();
        let changed = own.filter(|(drive, own)| own.has_current_state() != has(*drive)).map(|(_, own)| own).next();
        match changed.filter(|_| !self.quantities.is_empty()) {
            None => Ok(mechanism),
            Some(drive) => {
                Err(Error::new(format!("the inductance of the {} decides which states there are", drive.label.name))
                    .allowed("zero if it is zero in the case, positive if it is")
                    .next("change it in the case, and export that"))
            }
        }
    }

    /// True if it is linear between its events.
    pub fn is_piecewise_linear(&self) -> bool {
        self.mechanism(&self.defaults()).is_ok_and(|mechanism| mechanism.is_piecewise_linear())
    }

    /// Index of the load force among the inputs of the mechanism, after those of the drives. None for a gantry, whose
    /// load force belongs to a body.
    pub fn force_input(&self, load: usize) -> Option<usize> {
        (self.drives() == 1).then_some(self.drives() + load)
    }

    /// The drives of the machine itself.
    pub fn drives(&self) -> usize {
        self.machine.drives.len()
    }

    /// The state in which the machine begins, with these values of the integrated quantities.
    pub fn state(&self, mechanism: &Mechanism, values: &[f64]) -> State {
        let mut state = self.start;
        for ((quantity, _), &value) in self.quantities.iter().zip(values) {
            match *quantity {
                Quantity::Position(leader) => {
                    let way = value - self.start.position[leader];
                    for body in mechanism.followers(leader).filter(|body| *body != leader) {
                        state.position[body] = self.start.position[body] + mechanism.ratio(body) * way;
                    }
                    state.position[leader] = value;
                }
                Quantity::Speed(leader) => {
                    mechanism.followers(leader).for_each(|body| state.speed[body] = mechanism.ratio(body) * value);
                }
                Quantity::Current(number) => state.current[number] = value,
                // Bristles begin straight.
                Quantity::Bristle(_) => {}
            }
        }
        state
    }

    /// The state in which the case has the machine begin.
    pub(super) fn start(&self) -> &State {
        &self.start
    }

    /// The variable with this reference.
    pub fn variable(&self, reference: u32) -> Option<&Variable> {
        self.variables.binary_search_by_key(&reference, |variable| variable.reference).ok().map(|k| &self.variables[k])
    }

    /// A unit size of each integrated quantity, for the tolerances of integrators.
    pub fn nominals(&self, mechanism: &Mechanism) -> Vec<f64> {
        let lever = |body: usize| mechanism.bodies[body].kind.lever();
        let of = |quantity: &Quantity| match *quantity {
            Quantity::Position(body) => 0.01 / lever(body),
            Quantity::Speed(body) => 0.1 / lever(body),
            Quantity::Current(_) => 1.0,
            Quantity::Bristle(body) => 1e-5 / lever(body),
        };
        self.quantities.iter().map(|(quantity, _)| of(quantity)).collect()
    }

    /// The machine with these parameters.
    pub fn set(&self, parameters: &[f64]) -> Machine {
        let mut machine = self.machine.clone();
        let changed = self.parameters.iter().zip(parameters).filter(|((free, _), value)| free.start != **value);
        let changed: Vec<(&Free, f64)> = changed.map(|((free, _), value)| (free, *value)).collect();
        if !changed.is_empty() {
            parameter::set(&mut machine, changed);
        }
        machine
    }

    /// The unit of what the amplifiers take.
    fn input_unit(&self) -> &'static str {
        self.machine.drives[0].amplifier.mode.unit()
    }

    fn list(&self, mechanism: &Mechanism) -> Vec<Variable> {
        let mut list = vec![plain(0, "time", "Time.", "s", Role::Time)];
        list.extend(self.inputs(mechanism));
        for (index, (free, row)) in self.parameters.iter().enumerate() {
            let unit = unit_for(row.unit, self.input_unit());
            let role = Role::Parameter(index, is_tunable(&self.machine, &free.name));
            let words = match row.symbol {
                "" => row.sentence.to_string(),
                symbol => format!("{symbol}: {}", row.sentence),
            };
            let far = |end: f64| end.abs() < 1e8;
            list.push(Variable {
                shown: typed(row.example),
                start: Some(free.start),
                range: Some([row.range.low, row.range.high]).filter(|range| range.iter().any(|end| far(*end))),
                ..plain(PARAMETERS + index as u32, &free.name, &words, unit, role)
            });
        }
        list.extend(self.outputs(mechanism));
        list.extend(self.inner(mechanism, &list));
        list
    }

    /// Lead of the feed-forward inside, s, if it evaluates the reference ahead of time.
    pub fn lead(&self) -> Option<f64> {
        let design = self.design.as_ref().filter(|design| design.feed_forward.model != FeedForwardModel::None)?;
        Some(Loop::new(design).lead).filter(|lead| *lead > 0.0)
    }

    /// The prefix of the variables of each slide, none for an axis, and its name.
    fn of_slides(&self) -> impl Iterator<Item = (String, &'static str)> {
        let geometry = self.machine.geometry();
        let is_alone = geometry.slides.len() == 1;
        geometry.slides.iter().map(move |slide| {
            let label = geometry.label(slide.body);
            (if is_alone { String::new() } else { format!("{}_", label.key) }, label.name)
        })
    }

    fn inputs(&self, mechanism: &Mechanism) -> Vec<Variable> {
        let mut list = Vec::new();
        let mut add = |name: String, words: String, unit, shown: &str, role| {
            let reference = INPUTS + list.len() as u32;
            let (start, shown) = (Some(0.0), shown.to_string());
            list.push(Variable { start, shown, ..plain(reference, &name, &words, unit, role) });
        };
        const ENDINGS: [&str; REFERENCES] = ["", "_speed", "_acceleration", "_jerk", "_snap"];
        const UNITS: [(&str, &str); REFERENCES] =
            [("m", "mm"), ("m/s", "mm/s"), ("m/s^2", ""), ("m/s^3", ""), ("m/s^4", "")];
        if self.design.is_some() {
            let what = ["where it should be", "its speed", "its acceleration", "its jerk", "its snap"];
            for (slide, (prefix, name)) in self.of_slides().enumerate() {
                for (k, ((end, what), (unit, shown))) in ENDINGS.into_iter().zip(what).zip(UNITS).enumerate() {
                    let (words, role) = (format!("Reference of the {name}: {what}."), slide * REFERENCES + k);
                    add(format!("{prefix}reference{end}"), words, unit, shown, Role::Reference(role));
                }
            }
        } else {
            let geometry = self.machine.geometry();
            for (index, drive) in mechanism.drives.iter().take(self.drives()).enumerate() {
                let name = if self.drives() == 1 {
                    "command".into()
                } else {
                    format!("{}_command", geometry.drives[index].side())
                };
                let unit = drive.amplifier.mode.unit();
                add(name, format!("Input of the amplifier of the {}.", drive.label.name), unit, "", Role::Input(index));
            }
        }
        for (index, body) in self.loads.iter().enumerate() {
            let label = mechanism.bodies[*body].label;
            let words = format!("Force on the {} from outside, towards larger positions.", label.name);
            add(format!("{}_force", label.key), words, "N", "", Role::Force(index));
        }
        if let Some(lead) = self.lead() {
            let what = ["Position", "Speed", "Acceleration", "Jerk", "Snap"];
            for (slide, (prefix, name)) in self.of_slides().enumerate() {
                for (k, ((end, what), (unit, shown))) in ENDINGS.into_iter().zip(what).zip(UNITS).enumerate() {
                    let lead = shortest(lead);
                    let words =
                        format!("{what} of the reference of the {name} {lead} s ahead of time, for the feed-forward.");
                    let role = Role::Ahead(slide * REFERENCES + k);
                    add(format!("{prefix}reference_ahead{end}"), words, unit, shown, role);
                }
            }
        }
        list
    }

    fn outputs(&self, mechanism: &Mechanism) -> Vec<Variable> {
        let mut list = Vec::new();
        for (column, heading) in mechanism.columns.iter().enumerate().filter(|(_, h)| h.shown != Shown::Time) {
            let quantity = self.quantities.iter().position(|(quantity, _)| shows(heading, *quantity, mechanism));
            let kind = match heading.shown {
                Shown::Motion(_) | Shown::Contact(_) => FmiType::Whole,
                _ => FmiType::Real,
            };
            // A column may be named as an input is: the voltage of a drive without limits.
            let name = heading.name.to_string();
            list.push(Variable {
                shown: typical(heading.unit).into(),
                kind,
                start: quantity.map(|quantity| self.quantities[quantity].1),
                quantity,
                ..plain(OUTPUTS + column as u32, &name, &words(heading, mechanism), heading.unit, Role::Output(column))
            });
        }
        if let Some(design) = &self.design {
            let mut next = OUTPUTS + mechanism.columns.len() as u32;
            let mut add = |name: String, words: String, (unit, shown): (&'static str, &str), role| {
                list.push(Variable { shown: shown.into(), ..plain(next, &name, &words, unit, role) });
                next += 1;
            };
            for (slide, (prefix, name)) in self.of_slides().enumerate() {
                let words = format!("Reference minus position of the {name}.");
                add(format!("{prefix}error"), words, ("m", "mm"), Role::Error(slide));
            }
            for (drive, unit) in self.machine.drives.iter().enumerate() {
                let (name, of) = match self.machine.geometry().drives {
                    [_] => ("command".into(), String::new()),
                    all => (format!("{}_command", all[drive].side()), format!(" for the {}", all[drive].label.name)),
                };
                let words = format!("What the {} commands{of}.", design.structure.name());
                add(name, words, (unit.amplifier.mode.unit(), ""), Role::Command(drive));
            }
        }
        list
    }

    /// Variables of integrated quantities that no column shows, of their rates, and of the conditions.
    fn inner(&self, mechanism: &Mechanism, before: &[Variable]) -> Vec<Variable> {
        let mut list = Vec::new();
        for (index, (quantity, start)) in self.quantities.iter().enumerate() {
            if before.iter().any(|variable| variable.quantity == Some(index)) {
                continue;
            }
            let (name, unit) = named(*quantity, mechanism);
            let (reference, words) = (STATES + index as u32, "A quantity that is integrated.");
            let role = Role::Quantity(index);
            list.push(Variable {
                start: Some(*start),
                quantity: Some(index),
                ..plain(reference, &name, words, unit, role)
            });
        }
        for (index, (quantity, _)) in self.quantities.iter().enumerate() {
            let all = || before.iter().chain(&list);
            let of = all().find(|variable| variable.quantity == Some(index)).map(|variable| variable.name.clone());
            let name = format!("der({})", of.unwrap_or_default());
            let unit = rate_unit(named(*quantity, mechanism).1);
            list.push(plain(RATES + index as u32, &name, "Its rate.", unit, Role::Rate(index)));
        }
        for index in 0..self.conditions {
            let words = "What is left until a part does something else: to breakaway, to rest, to a limit.";
            let name = format!("condition_{}", index + 1);
            list.push(plain(CONDITIONS + index as u32, &name, words, "", Role::Condition(index)));
        }
        list
    }

    fn token(&self) -> String {
        let list = format!("{:?}{}{}", self.variables, self.resource, env!("CARGO_PKG_VERSION"));
        let halves = [hash(list.bytes()), hash(list.bytes().rev())];
        let [a, b] = halves.map(|half| format!("{half:016x}"));
        format!("{{{}-{}-{}-{}-{}}}", &a[..8], &a[8..12], &a[12..], &b[..4], &b[4..])
    }
}

/// The numbers of a machine that can be set, each by itself.
fn parameters(machine: &Machine) -> Result<Vec<(Free, &'static Parameter)>> {
    let own = parameter::own(machine);
    let keys: Vec<&str> = own.iter().map(|(key, _)| key.as_str()).collect();
    let of = |(key, row): &(String, &'static Parameter)| Ok((Free::new(machine, key, &keys, &[])?, *row));
    own.iter().map(of).collect()
}

/// True if a number can change while the machine runs: what it carries, what it rubs, what warmth and supply do. What
/// tells its geometry, or which quantities its states are, cannot.
fn is_tunable(machine: &Machine, key: &str) -> bool {
    let mut prefixes = machine.geometry().drives.iter().map(|drive| drive.key).filter(|prefix| !prefix.is_empty());
    let drive = prefixes.find_map(|prefix| key.strip_prefix(prefix));
    let key = drive.unwrap_or(key);
    let fixed = ["lugre", "stribeck", "smooth", "along"];
    let last = key.rsplit('.').next().unwrap_or_default();
    match key.split('.').next().unwrap_or_default() {
        "cart" | "bridge" | "drive_pulley" | "idler_pulley" if key.contains(".friction.") => {
            !fixed.iter().any(|part| key.contains(part))
        }
        "cart" | "bridge" => ["mass", "load", "inclination"].contains(&last),
        "motor" => ["torque_constant", "back_emf_constant", "resistance"].contains(&last),
        "belt" => key.contains(".stiffness") || key.contains(".damping"),
        "amplifier" => ["gain", "voltage_limit", "current_limit"].contains(&last),
        _ => false,
    }
}

/// A drive that is nothing but a force: u in N is its current, K_t = 1 N/A.
fn push(body: usize) -> Drive {
    let label = Label { key: "force", name: "force" };
    let motor = SimpleDrive { force: 1.0, drag: 0.0 }.motor(1.0);
    let amplifier = Amplifier::ideal(AmplifierMode::Current, 1.0);
    Drive { label, voltage: label, current: label, pulley: body, shaft: body, motor, amplifier }
}

/// True if a column is an integrated quantity as it stands.
fn shows(heading: &Heading, quantity: Quantity, mechanism: &Mechanism) -> bool {
    heading.shown
        == match quantity {
            Quantity::Position(body) => Shown::Position(body, 1.0),
            Quantity::Speed(body) => Shown::Speed(body, 1.0),
            Quantity::Current(number) => match mechanism.drive_of_current(number) {
                Some(drive) if mechanism.first_current(drive) == number => Shown::Current(drive),
                Some(drive) => Shown::SecondPhase(drive),
                None => return false,
            },
            Quantity::Bristle(body) => Shown::Bristle(body),
        }
}

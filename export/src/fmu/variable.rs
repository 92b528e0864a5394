//! A variable of a machine as the standard has it, and its words.

use crate::mechanism::{Heading, Mechanism, Shown};
use crate::solve::Quantity;

/// A variable of a machine.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Variable {
    /// Its number for importers.
    pub reference: u32,
    /// Its name: a column's, or a key of the case file.
    pub name: String,
    /// Its meaning.
    pub description: String,
    /// SI unit; empty for a pure number.
    pub unit: &'static str,
    /// The unit that it is shown in, if another.
    pub shown: String,
    /// Its part in the machine.
    pub role: Role,
    /// Real numbers, or whole ones.
    pub kind: FmiType,
    /// The value it has unless another is set; of what follows from others, none.
    pub start: Option<f64>,
    /// Least and greatest value, where there are.
    pub range: Option<[f64; 2]>,
    /// Which of the integrated quantities it is, if one.
    pub quantity: Option<usize>,
}

/// Real numbers, or whole ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FmiType {
    /// Double precision.
    Real,
    /// 32 bits.
    Whole,
}

/// The part of a variable in the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Time.
    Time,
    /// The input of a drive.
    Input(usize),
    /// A force on a body that the machine is there to move, by its place among these.
    Force(usize),
    /// Where each slide should be: position, speed, acceleration, jerk, snap.
    Reference(usize),
    /// Those references one lead of the feed-forward later.
    Ahead(usize),
    /// A number of the machine, by its place among these, and whether it may change under way.
    Parameter(usize, bool),
    /// A column of a run.
    Output(usize),
    /// Reference minus position of a slide, by its number.
    Error(usize),
    /// The command for a drive, by its number.
    Command(usize),
    /// An integrated quantity that is no column.
    Quantity(usize),
    /// The rate of an integrated quantity.
    Rate(usize),
    /// A condition of the mode.
    Condition(usize),
}

/// As the standard has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Causality {
    /// Time.
    Independent,
    /// Set from outside.
    Input,
    /// Set before it begins, or at an event.
    Parameter,
    /// For others.
    Output,
    /// For those who look inside.
    Local,
}

/// As the standard has it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Variability {
    /// It stays.
    Fixed,
    /// It may be set at an event.
    Tunable,
    /// It changes at events alone.
    Discrete,
    /// It changes all the time.
    Continuous,
}

impl Variable {
    /// As the standard has it.
    pub fn causality(&self) -> Causality {
        match self.role {
            Role::Time => Causality::Independent,
            Role::Input(_) | Role::Force(_) | Role::Reference(_) | Role::Ahead(_) => Causality::Input,
            Role::Parameter(..) => Causality::Parameter,
            Role::Output(_) | Role::Error(_) | Role::Command(_) => Causality::Output,
            Role::Quantity(_) | Role::Rate(_) | Role::Condition(_) => Causality::Local,
        }
    }

    /// As the standard has it.
    pub fn variability(&self) -> Variability {
        match (self.role, self.kind) {
            (Role::Parameter(_, true), _) => Variability::Tunable,
            (Role::Parameter(_, false), _) => Variability::Fixed,
            (Role::Command(_), _) | (_, FmiType::Whole) => Variability::Discrete,
            _ if self.is_count() => Variability::Discrete,
            _ => Variability::Continuous,
        }
    }

    /// True if it counts: it jumps, though it may be too large for a whole number of 32 bits.
    fn is_count(&self) -> bool {
        matches!(self.role, Role::Output(_)) && self.name.ends_with("_count")
    }
}

pub(super) fn plain(reference: u32, name: &str, description: &str, unit: &'static str, role: Role) -> Variable {
    Variable {
        reference,
        name: name.to_string(),
        description: description.to_string(),
        unit,
        shown: String::new(),
        role,
        kind: FmiType::Real,
        start: None,
        range: None,
        quantity: None,
    }
}

/// The name of an integrated quantity that is no column, and its unit.
pub(super) fn named(quantity: Quantity, mechanism: &Mechanism) -> (String, &'static str) {
    let body = |body: usize| (mechanism.bodies[body].label.key, mechanism.bodies[body].kind.units());
    match quantity {
        Quantity::Position(b) => (format!("{}_way", body(b).0), body(b).1[0]),
        Quantity::Speed(b) => (format!("{}_rate", body(b).0), body(b).1[1]),
        Quantity::Current(number) => {
            let drive = mechanism.drive_of_current(number).unwrap_or_default();
            (format!("{}_armature_current", mechanism.drives[drive].label.key), "A")
        }
        Quantity::Bristle(b) => (format!("{}_bristle", body(b).0), body(b).1[0]),
    }
}

/// The unit of the rate of something in this unit.
pub(super) fn rate_unit(unit: &str) -> &'static str {
    match unit {
        "rad" => "rad/s",
        "m" => "m/s",
        "rad/s" => "rad/s^2",
        "m/s" => "m/s^2",
        _ => "A/s",
    }
}

/// The unit of a typical value: `mm` of `19.4 mm`.
pub(super) fn typed(example: &str) -> String {
    example.split_once(' ').map(|(_, unit)| unit.to_string()).unwrap_or_default()
}

/// The unit in which people look at it.
pub(super) fn typical(unit: &str) -> &'static str {
    match unit {
        "m" => "mm",
        "m/s" => "mm/s",
        "rad" => "deg",
        "rad/s" => "rpm",
        "N m" => "mN m",
        _ => "",
    }
}

/// The description of a column.
pub(super) fn words(heading: &Heading, mechanism: &Mechanism) -> String {
    let body = |body: usize| mechanism.bodies[body].label.name;
    let drive = |drive: usize| mechanism.drives[drive].label.name;
    let spring = |spring: usize| mechanism.springs[spring].label.name;
    let seen = |factor: f64| if factor == 1.0 { String::new() } else { format!(", times {factor}") };
    match heading.shown {
        Shown::Time => "Time.".into(),
        Shown::Input(d) => format!("Input of the amplifier of the {}, as it takes it.", drive(d)),
        Shown::Voltage(d) => format!("Voltage at the terminals of the {}.", drive(d)),
        Shown::SecondPhase(d) => format!("Current of the second phase of the {}.", drive(d)),
        Shown::Current(d) => format!("Current of the {}.", drive(d)),
        Shown::Position(b, factor) => format!("Way of the {}{}.", body(b), seen(factor)),
        Shown::Speed(b, factor) => format!("Speed of the {}{}.", body(b), seen(factor)),
        Shown::Stretch(s) => format!("Length of the {}.", spring(s)),
        Shown::Force(s, factor) => format!("Force of the {}{}.", spring(s), seen(factor)),
        Shown::Friction(b) => format!("Friction on the {}.", body(b)),
        Shown::Motion(b) => format!("What the {} does: -1 backward, 0 stuck, 1 forward, 2 free.", body(b)),
        Shown::Bristle(b) => format!("Deflection of the bristles of the {}.", body(b)),
        Shown::Contact(s) => format!("The side of the {} that carries, or 0; of a span 1 if it is slack.", spring(s)),
        Shown::Counts(b, _) => format!("Counts of the encoder at the {}.", body(b)),
    }
}

//! Table of parameters: every number of a case file, with its symbol, unit, default, range and meaning, its location in
//! a machine, its variation, and its links to others.
//!
//! Reading, range checks, free parameters of fits and sweeps, the variation by `--spread` and `taut tune`, and
//! documentation derive from it.

mod field;
mod free;
mod machine;
mod markdown;
mod table;

pub use field::{Accessor, Field, List};
pub use free::{Free, GivenBounds, every, kinds, kinds_without, own, set, value, values};
pub use machine::Sits;
pub use markdown::{free_markdown, markdown};

use crate::design::Structure;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::quantity::{rounded, shortest};
use table::SECTIONS;

/// One number of the case file.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Its key: `cart.mass`. Without the index of an experiment: `experiment.until`.
    pub key: &'static str,
    /// Its symbol in the equations; empty without one.
    pub symbol: &'static str,
    /// Its SI unit; empty for a pure number, [`INPUT`] for the amplifier's input.
    pub unit: &'static str,
    /// The default.
    pub default: Fallback,
    /// Allowed values, in SI.
    pub range: Range,
    /// Its meaning.
    pub sentence: &'static str,
    /// Typical value in a case file.
    pub example: &'static str,
    /// Location in a machine.
    pub field: Field,
    /// Its variation with `--spread`.
    pub off: Off,
    /// Keys that it follows while it has an equal value and is not named itself, in order of precedence.
    pub follows: &'static [&'static str],
    /// The sum over the bodies that contains it.
    pub part: Option<(Sum, Arm)>,
    /// Location in a controller's structure.
    pub gain: Option<InStructure>,
}

/// Location of a number in a structure, and its role in a search.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct InStructure {
    /// Its value; none in a structure without it.
    pub get: fn(&Structure) -> Option<f64>,
    /// Sets it in a structure that has it.
    pub set: fn(&mut Structure, f64),
    /// Its role in a search for gains.
    pub tuned: Tuned,
}

/// Role of a number in a search for gains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tuned {
    /// No.
    No,
    /// As a gain.
    Gain,
    /// As a corner frequency, below half the sampling rate, if the filtered gain with this key is not zero.
    Corner(&'static str),
}

/// Variation of a parameter by `--spread` without being named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Off {
    /// Not varied: it is counted, chosen or set.
    No,
    /// Separately, and only if everything is varied: a length that positions are measured with, a setting of a driver.
    Alone,
    /// Together with all others of this name, to which it is physically linked: a motor has one constant, and pulleys
    /// are of one kind. `--vary all` varies each separately.
    With(&'static str),
}

/// A sum over the bodies, at the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sum {
    /// Viscous friction.
    Viscous,
    /// Coulomb friction.
    Coulomb,
    /// Inertia.
    Inertia,
    /// Stiffness of the spans.
    Stiffness,
}

impl Sum {
    /// All sums.
    pub const ALL: [Sum; 4] = [Sum::Viscous, Sum::Coulomb, Sum::Inertia, Sum::Stiffness];

    /// Its name in the case file.
    pub fn name(self) -> &'static str {
        match self {
            Sum::Viscous => "total.viscous",
            Sum::Coulomb => "total.coulomb",
            Sum::Inertia => "total.inertia",
            Sum::Stiffness => "total.stiffness",
        }
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Sum::Viscous => "N m s/rad",
            Sum::Coulomb => "N m",
            Sum::Inertia => "kg m^2",
            Sum::Stiffness => "N/m",
        }
    }

    /// The sum with this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|sum| sum.name() == name)
    }

    /// Its parts; for friction, of the positive or the negative direction.
    pub fn parts(self, forward: bool) -> impl Iterator<Item = &'static Parameter> {
        let is_part = move |row: &&Parameter| row.part.is_some_and(|(sum, _)| sum == self);
        all().filter(is_part).filter(move |row| row.follows.is_empty() == forward)
    }
}

/// The weight of a number in a sum at the drive pulley.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Arm {
    /// Factor 1.
    One,
    /// Referred by the pulley radius: this power of r.
    Radius(i32),
    /// Referred by the gear ratio: this power of n.
    Gear(i32),
}

impl Arm {
    /// Its value in a machine.
    pub fn length(self, stage: &Machine) -> f64 {
        let power = |base: f64, power: i32| (0..power).fold(1.0, |product, _| product * base);
        match self {
            Arm::One => 1.0,
            Arm::Radius(n) => power(stage.pulley_radius, n),
            Arm::Gear(n) => power(stage.drives[0].motor.gear_ratio, n),
        }
    }

    /// A term with it in symbols: `r² M`.
    pub fn times(self, symbol: &str) -> String {
        let power = |base: &str, power: i32| match power {
            1 => format!("{base} {symbol}"),
            _ => format!("{base}² {symbol}"),
        };
        match self {
            Arm::One => symbol.to_string(),
            Arm::Radius(n) => power("r", n),
            Arm::Gear(n) => power("n", n),
        }
    }
}

/// Unit of the amplifier's input: V in voltage mode, A in current mode; m for a stepper.
pub const INPUT: &str = "V or A";

/// Unit of a parameter for an amplifier input in `input` (V, A or m): its own, or the matching one of two, the first in
/// volts.
pub fn unit_for(unit: &'static str, input: &str) -> &'static str {
    match unit.split_once(" or ") {
        // The controller of a stepper corrects a position.
        Some((volts, _)) if input == "m" => match volts {
            "V/m" => "",
            "V/(m s)" => "1/s",
            "V s/m" => "s",
            "V/s" => "m/s",
            _ => "m",
        },
        Some((volts, amperes)) => {
            if input == "A" {
                amperes
            } else {
                volts
            }
        }
        None => unit,
    }
}

/// The default of a parameter that is not given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fallback {
    /// Required, at least if its table exists.
    Required,
    /// This value, in SI.
    Value(f64),
    /// Described in words, usually the value of another parameter.
    Words(&'static str),
}

/// Range of allowed values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// True if `low` itself is excluded.
    pub above: bool,
    /// True if `high` itself is excluded.
    pub below: bool,
    /// True for integers only.
    pub whole: bool,
}

impl Range {
    /// From `low` to `high`, both allowed.
    pub const fn new(low: f64, high: f64) -> Self {
        Self { low, high, above: false, below: false, whole: false }
    }

    /// Positive, within a numerically safe range.
    const POSITIVE: Self = Self::new(1e-15, 1e15);
    /// Zero or above.
    const NOT_NEGATIVE: Self = Self::new(0.0, 1e15);
    /// Of either sign.
    pub const ANY: Self = Self::new(-1e15, 1e15);

    /// Whole numbers from `low` to `high`.
    pub const fn whole(low: f64, high: f64) -> Self {
        Self { whole: true, ..Self::new(low, high) }
    }

    /// True if `value` lies in it.
    pub fn contains(&self, value: f64) -> bool {
        let low = if self.above { value > self.low } else { value >= self.low };
        let high = if self.below { value < self.high } else { value <= self.high };
        low && high && (!self.whole || value.fract() == 0.0)
    }

    /// True for the range of a seed.
    fn is_seed(&self) -> bool {
        self.whole && self.high == i64::MAX as f64
    }

    /// In words, with the unit: `from 0 to 1`, `above zero: from 1e-15 kg to 1e15 kg`.
    pub fn describe(&self, unit: &str) -> String {
        let with_unit = |v: f64| match unit {
            "" => rounded(v),
            _ => format!("{} {unit}", rounded(v)),
        };
        if self.is_seed() {
            return format!("a whole number from 0 to {}", i64::MAX);
        }
        let (low, high) = (with_unit(self.low), with_unit(self.high));
        let whole = if self.whole { "a whole number " } else { "" };
        match (self.above, self.below) {
            (false, false) => format!("{whole}from {low} to {high}"),
            (true, false) => format!("{whole}above {low}, up to {high}"),
            (false, true) => format!("{whole}from {low}, below {high}"),
            (true, true) => format!("{whole}above {low} and below {high}"),
        }
    }

    /// Short form for tables: `> 0`, `≥ 0`, `0 … 1`.
    fn short(&self) -> String {
        const FAR: f64 = 1e8;
        let text = match (self.low, self.high) {
            (low, high) if low <= -FAR && high >= FAR => "any".to_string(),
            (low, high) if high >= FAR && low > 0.0 && low < 1e-9 => "> 0".to_string(),
            (low, _) if self.is_seed() => format!("{} … {}", shortest(low), i64::MAX),
            (low, high) if high >= FAR => format!("≥ {}", shortest(low)),
            (low, high) => format!(
                "{}{} … {}{}",
                if self.above { "> " } else { "" },
                shortest(low),
                if self.below { "< " } else { "" },
                shortest(high)
            ),
        };
        if self.whole { format!("whole, {text}") } else { text }
    }
}

/// All parameters, in the order of the case file.
pub fn all() -> impl Iterator<Item = &'static Parameter> {
    SECTIONS.iter().flat_map(|(_, groups)| groups.iter().flat_map(|rows| rows.iter()))
}

/// The parameter with this key.
pub fn find(key: &str) -> Option<&'static Parameter> {
    all().find(|p| p.key == key)
}

/// The default of the parameter with this key, in SI; `None` if it has none that is a number.
pub fn default_of(key: &str) -> Option<f64> {
    match find(key)?.default {
        Fallback::Value(value) => Some(value),
        Fallback::Required | Fallback::Words(_) => None,
    }
}

/// The parameter of a key with list indices: `belt.stiffness.0` and `cart.friction.along.1.factor` are of
/// `belt.stiffness` and `cart.friction.along.factor`.
pub fn named(key: &str) -> Option<&'static Parameter> {
    let is_place = |part: &&str| part.bytes().all(|byte| byte.is_ascii_digit());
    if !key.split('.').any(|part| is_place(&part)) {
        return find(key);
    }
    find(&key.split('.').filter(|part| !is_place(part)).collect::<Vec<_>>().join("."))
}

/// The names that follow directly after `section` in the keys: for `cart` these are `mass` and `friction`.
pub fn names_in(section: &str) -> Vec<&'static str> {
    let mut names = Vec::new();
    for parameter in all() {
        let rest = parameter.key.strip_prefix(section).and_then(|rest| rest.strip_prefix('.'));
        if let Some(name) = rest.and_then(|rest| rest.split('.').next())
            && !names.contains(&name)
        {
            names.push(name);
        }
    }
    names
}

/// The sections of the table, each of which [`markdown`] renders.
pub fn sections() -> impl Iterator<Item = &'static str> {
    SECTIONS.iter().map(|(name, _)| *name)
}

/// The weight of a parameter at the drive pulley: r² for a mass or a viscous friction of the cart, r for its Coulomb
/// friction, n² for the rotor's inertia.
pub fn at_pulley(stage: &Machine, key: &str) -> f64 {
    named(key).and_then(|row| row.part).map_or(1.0, |(_, arm)| arm.length(stage))
}

/// Rejects a machine with a number out of its range.
pub fn check(machine: &Machine) -> Result<()> {
    for row in all() {
        let Field::Machine(accessor) = &row.field else { continue };
        let Some((list, count)) = accessor.listed(machine) else { continue };
        for index in 0..count {
            if let Some(value) = (accessor.get)(machine, index).filter(|value| !row.range.contains(*value)) {
                let name = list.key(row.key, index);
                let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
                return Err(Error::new(format!("{name} cannot be {}{unit}", rounded(value)))
                    .allowed(row.range.describe(row.unit)));
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Cascade, Pid};
    use crate::quantity;

    #[test]
    fn examples_and_defaults_lie_in_their_ranges() {
        for p in all() {
            let unit = unit_for(p.unit, "V");
            let example = quantity::read(p.example, unit).unwrap_or_else(|e| panic!("{}: {e}", p.key));
            assert!(p.range.contains(example), "{}", p.key);
            if let Fallback::Value(value) = p.default {
                assert!(p.range.contains(value), "{}", p.key);
            }
        }
    }

    #[test]
    fn constructors_of_gains_have_the_defaults_of_a_case_file() {
        let (pid, cascade) = (Pid::new(1.0), Cascade::new(1.0, 1.0));
        let rows = [
            ("pid.integral", pid.integral),
            ("pid.derivative", pid.derivative),
            ("pid.filter", pid.filter),
            ("pid.reference_speed", pid.reference_speed),
            ("pid.tracking", pid.tracking),
            ("cascade.speed_integral", cascade.speed_integral),
            ("cascade.filter", cascade.filter),
            ("cascade.reference_speed", cascade.reference_speed),
            ("cascade.tracking", cascade.tracking),
        ];
        for (key, value) in rows {
            assert_eq!(default_of(&format!("controller.{key}")), Some(value), "{key}");
        }
    }

    #[test]
    fn no_key_stands_twice() {
        for p in all() {
            assert_eq!(all().filter(|q| q.key == p.key).count(), 1, "{}", p.key);
        }
    }
}

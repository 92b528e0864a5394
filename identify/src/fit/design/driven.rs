//! Assignment of an input to drives.

use super::candidates::Shape;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::signal::Signal;

/// The drives that get an input.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// The side of a motor driven alone, a slide moved alone, or `all`; empty with one drive.
    pub name: &'static str,
    /// In words.
    words: String,
    /// Factor on the input for each drive: 1, −1, or 0 for no input.
    pub signs: Vec<f64>,
}

impl Driven {
    /// Each motor alone, each slide alone, and all motors alike, without duplicates.
    pub fn all(machine: &Machine) -> Vec<Self> {
        let geometry = machine.geometry();
        let count = geometry.drives.len();
        if count == 1 {
            return vec![Self { name: "", words: String::new(), signs: vec![1.0] }];
        }
        let one = |(k, drive): (usize, &crate::machine::DriveAt)| {
            let signs = (0..count).map(|other| f64::from(u8::from(other == k))).collect();
            Self { name: drive.side(), words: format!("on the {}", drive.label.name), signs }
        };
        let mut all: Vec<Self> = geometry.drives.iter().enumerate().map(one).collect();
        let shares = machine.belt_shares();
        for (slide, at) in geometry.slides.iter().enumerate() {
            let label = geometry.label(at.body);
            let signs = shares.iter().map(|share| share[slide]).map(|way| if way == 0.0 { 0.0 } else { way.signum() });
            all.push(Self { name: label.key, words: format!("moving the {}", label.name), signs: signs.collect() });
        }
        all.push(Self { name: "all", words: "on all drives".into(), signs: vec![1.0; count] });
        let mut each: Vec<Self> = Vec::new();
        for driven in all {
            let negative: Vec<f64> = driven.signs.iter().map(|sign| 0.0 - sign).collect();
            if !each.iter().any(|own| own.signs == driven.signs || own.signs == negative) {
                each.push(driven);
            }
        }
        each
    }

    /// The choices with these names; all if the list is empty.
    pub(super) fn named(machine: &Machine, names: &[String]) -> Result<Vec<Self>> {
        let all = Self::all(machine);
        if names.is_empty() {
            return Ok(all);
        }
        let words = all.iter().map(|one| one.name).collect::<Vec<_>>().join(", ");
        let find = |name: &String| {
            all.iter().find(|one| one.name == name && !name.is_empty()).cloned().ok_or_else(|| match all.len() {
                1 => Error::new("this machine has one drive, which is driven").next("leave --drive out"),
                _ => Error::new(format!("`{name}` is nothing that an input can go to")).allowed(words.clone()),
            })
        };
        names.iter().map(find).collect()
    }

    /// The input of each drive.
    pub fn inputs(&self, shape: &Shape) -> Vec<Signal> {
        let input = |sign: &f64| match *sign {
            0.0 => Signal::Step { value: 0.0, at: 0.0 },
            sign => shape.scaled(sign).signal(),
        };
        self.signs.iter().map(input).collect()
    }

    /// The inputs in the notation of the case file; `unit` is that of the amplifiers' inputs.
    pub(super) fn toml(&self, machine: &Machine, shape: &Shape, unit: &str) -> String {
        if self.name.is_empty() {
            return shape.toml(unit);
        }
        let driven = machine.geometry().sides().zip(&self.signs).filter(|(_, sign)| **sign != 0.0);
        let inputs: Vec<String> =
            driven.map(|(side, sign)| format!("{side} = {}", shape.scaled(*sign).toml(unit))).collect();
        format!("{{ {} }}", inputs.join(", "))
    }

    /// The input in words.
    pub fn words(&self, shape: &Shape, unit: &str) -> String {
        match self.name {
            "" => shape.words(unit),
            _ => format!("{}: {}", self.words, shape.words(unit)),
        }
    }
}

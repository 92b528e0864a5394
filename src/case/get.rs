//! What a case says under a key: the other direction of `--set`.

use super::tree::{Kind, Node, Source};
use super::{Case, set};
use crate::error::{Error, Result};
use crate::parameter::{self, Fallback, Parameter};
use crate::quantity;
use crate::stage::AmplifierMode;
use std::path::Path;
use toml_edit::Key;

/// A value of a case file.
#[derive(Debug, Clone, PartialEq)]
pub enum Given {
    /// A quantity in its SI unit, or a pure number.
    Number(f64),
    /// A whole number without unit.
    Whole(i64),
    /// A word, a name, a path.
    Text(String),
    /// Yes or no.
    Truth(bool),
    /// Several.
    List(Vec<Given>),
    /// By key, in the file's order.
    Table(Vec<(String, Given)>),
}

impl Case {
    /// What the text says under `key`, written as for `--set`: quantities in SI units. A parameter that has a default and is not in
    /// the text is that default.
    ///
    /// ```
    /// use taut::case::{Case, Given, TEMPLATE};
    /// let case = Case::from_text_with("axis.toml", TEMPLATE, &["cart.mass=500 g"])?;
    /// assert_eq!(case.value("cart.mass")?, Given::Number(0.5));
    /// assert_eq!(case.value("experiment.\"5 V pulse\".until")?, Given::Number(1.0));
    /// assert_eq!(case.value("motor.gear_efficiency")?, Given::Number(1.0));
    /// assert_eq!(case.value("experiment.0.input.for")?, Given::Number(0.25));
    /// assert!(case.value("cart.weight").is_err());
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn value(&self, key: &str) -> Result<Given> {
        let keys = Key::parse(key).ok().filter(|keys| !keys.is_empty());
        let keys =
            keys.ok_or_else(|| Error::new(format!("\"{key}\" is no key")).next("write for example cart.mass"))?;
        let steps: Vec<String> = keys.iter().map(|key| key.get().to_string()).collect();
        let tree = Source::new(Path::new(""), self.text.clone()).tree()?;
        let unit = if self.stage.amplifier.mode == AmplifierMode::Current { "A" } else { "V" };
        match set::node(&tree, &steps) {
            Some((node, section)) => Ok(given(node, &section, unit)),
            None => match parameter::find(&steps.join(".")).map(|row| &row.default) {
                Some(Fallback::Value(value)) => Ok(Given::Number(*value)),
                _ => Err(Error::new(format!("this case says nothing of `{key}`"))),
            },
        }
    }
}

/// `section` is the key as the table of parameters has it.
fn given(node: &Node, section: &str, input_unit: &'static str) -> Given {
    let row = || row(section).or_else(|| row(section.strip_prefix("experiment.")?));
    match &node.kind {
        Kind::Float(number) => Given::Number(*number),
        Kind::Integer(number) => match row() {
            Some(row) if !row.unit.is_empty() => Given::Number(*number as f64),
            _ => Given::Whole(*number),
        },
        Kind::Text(text) => {
            let value = row().and_then(|row| quantity::read(text, parameter::unit_for(row.unit, input_unit)).ok());
            value.map_or_else(|| Given::Text(text.clone()), Given::Number)
        }
        Kind::Bool(truth) => Given::Truth(*truth),
        Kind::Date => Given::Text(String::new()),
        Kind::List(nodes) | Kind::Tables(nodes) => {
            Given::List(nodes.iter().map(|node| given(node, section, input_unit)).collect())
        }
        Kind::Table(entries) => {
            let entry =
                |e: &super::tree::Entry| (e.key.clone(), given(&e.node, &format!("{section}.{}", e.key), input_unit));
            Given::Table(entries.iter().map(entry).collect())
        }
    }
}

/// The row of a key. What belongs to a kind of input, say, stands beside the kind in the file, and below it in the table.
fn row(section: &str) -> Option<&'static Parameter> {
    parameter::find(section).or_else(|| {
        let (parent, last) = section.rsplit_once('.')?;
        let beside = |row: &&Parameter| {
            let between = row.key.strip_prefix(parent).and_then(|rest| rest.strip_suffix(last));
            between.is_some_and(|between| between.matches('.').count() == 2 && between.ends_with('.'))
        };
        let mut rows = parameter::all().filter(beside);
        let first = rows.next()?;
        rows.all(|other| other.unit == first.unit).then_some(first)
    })
}

//! The value of a case under a key: the other direction of `--set`.

use super::tree::{Kind, Node, Source};
use super::{Case, GantryCase, set};
use crate::error::{Error, Result};
use crate::parameter::{self, Fallback, Parameter};
use crate::quantity;
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
    /// The value of the text under `key`, written as for `--set`: quantities in SI units. A parameter that has a
    /// default and is not in the text is that default.
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
        let place = |section: &str| section.to_string();
        value(&self.text, key, &Rows { input_unit: |_| self.stage.amplifier.mode.unit(), place: &place })
    }
}

impl GantryCase {
    /// The value of the text under `key`, as [`Case::value`] tells it.
    ///
    /// ```
    /// use taut::case::{GantryCase, Given};
    /// let case = GantryCase::read_with("stages/h-frame/h-frame.toml", &["left_drive.motor.resistance=800 mohm"])?;
    /// assert_eq!(case.value("cart.travel.max")?, Given::Number(0.25));
    /// assert_eq!(case.value("left_drive.motor.resistance")?, Given::Number(0.8));
    /// assert_eq!(case.value("experiment.0.input.left.for")?, Given::Number(0.25));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn value(&self, key: &str) -> Result<Given> {
        let unit = |section: &str| {
            let right = section.split('.').any(|step| step == "right");
            self.gantry.amplifiers[usize::from(right)].mode.unit()
        };
        value(&self.text, key, &Rows { input_unit: unit, place: &of_gantry })
    }
}

/// Where the table of parameters has what stands in this section of a gantry's file.
fn of_gantry(section: &str) -> String {
    let instead = [
        ("left_drive.", ""),
        ("right_drive.", ""),
        ("cart.", "bridge."),
        ("experiment.initial.", "gantry.initial."),
        ("experiment.input.left.", "experiment.input."),
        ("experiment.input.right.", "experiment.input."),
    ];
    let found = instead.iter().find_map(|(from, to)| Some(format!("{to}{}", section.strip_prefix(from)?)));
    found.unwrap_or_else(|| section.to_string())
}

/// How the rows of the table of parameters are found.
struct Rows<'a, U: Fn(&str) -> &'static str> {
    /// The unit of an input that stands in this section.
    input_unit: U,
    /// Where the table has what stands in this section.
    place: &'a dyn Fn(&str) -> String,
}

fn value<U: Fn(&str) -> &'static str>(text: &str, key: &str, rows: &Rows<U>) -> Result<Given> {
    let keys = Key::parse(key).ok().filter(|keys| !keys.is_empty());
    let keys = keys.ok_or_else(|| Error::new(format!("\"{key}\" is no key")).next("write for example cart.mass"))?;
    let steps: Vec<String> = keys.iter().map(|key| key.get().to_string()).collect();
    let tree = Source::new(Path::new(""), text.to_string()).tree()?;
    match set::node(&tree, &steps) {
        Some((node, section)) => Ok(given(node, &section, rows)),
        None => match parameter::find(&(rows.place)(&steps.join("."))).map(|row| &row.default) {
            Some(Fallback::Value(value)) => Ok(Given::Number(*value)),
            _ => Err(Error::new(format!("this case says nothing of `{key}`"))),
        },
    }
}

/// `section` is the key as the table of parameters has it.
fn given<U: Fn(&str) -> &'static str>(node: &Node, section: &str, rows: &Rows<U>) -> Given {
    let place = (rows.place)(section);
    let row = || row(&place).or_else(|| row(place.strip_prefix("experiment.")?));
    match &node.kind {
        Kind::Float(number) => Given::Number(*number),
        Kind::Integer(number) => match row() {
            Some(row) if !row.unit.is_empty() => Given::Number(*number as f64),
            _ => Given::Whole(*number),
        },
        Kind::Text(text) => {
            let value = row()
                .and_then(|row| quantity::read(text, parameter::unit_for(row.unit, (rows.input_unit)(section))).ok());
            value.map_or_else(|| Given::Text(text.clone()), Given::Number)
        }
        Kind::Bool(truth) => Given::Truth(*truth),
        Kind::Date => Given::Text(String::new()),
        Kind::List(nodes) | Kind::Tables(nodes) => {
            Given::List(nodes.iter().map(|node| given(node, section, rows)).collect())
        }
        Kind::Table(entries) => {
            let entry = |e: &super::tree::Entry| (e.key.clone(), given(&e.node, &format!("{section}.{}", e.key), rows));
            Given::Table(entries.iter().map(entry).collect())
        }
    }
}

/// The row of a key. What belongs to a kind of input, say, stands beside the kind in the file, and below it in the
/// table.
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

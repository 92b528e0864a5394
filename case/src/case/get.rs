//! The value of a case under a key: the other direction of `--set`.

use super::source::Source;
use super::tree::{Node, NodeValue};
use super::{Case, set};
use crate::error::{Error, Result};
use crate::machine::{DriveAt, Geometry};
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
        value(&self.text, key, &self.rows())
    }

    /// How the numbers of this case are found in the table of parameters.
    fn rows(&self) -> Rows<impl Fn(&str) -> &'static str> {
        let drives: Vec<_> = self.machine.drives.iter().map(|unit| unit.amplifier.mode.unit()).collect();
        let geometry = self.machine.geometry();
        let input_unit = move |section: &str| {
            let side = geometry.sides().position(|side| section.split('.').any(|step| step == side));
            drives[side.unwrap_or_default()]
        };
        Rows { input_unit, place: Box::new(move |section| in_table(geometry, section)) }
    }
}

/// Where the table of parameters has what stands in this section of a file.
fn in_table(geometry: &Geometry, section: &str) -> String {
    if geometry.drives.len() == 1 {
        return section.to_string();
    }
    let of_drive = |drive: &DriveAt| {
        let input = section.strip_prefix("experiment.input.").and_then(|rest| rest.strip_prefix(drive.side()));
        let input = input.and_then(|rest| Some(format!("experiment.input.{}", rest.strip_prefix('.')?)));
        input.or_else(|| section.strip_prefix(drive.key).map(str::to_string))
    };
    let instead = [("cart.", "bridge."), ("experiment.initial.", "gantry.initial.")];
    let found = instead.iter().find_map(|(from, to)| Some(format!("{to}{}", section.strip_prefix(from)?)));
    found.or_else(|| geometry.drives.iter().find_map(of_drive)).unwrap_or_else(|| section.to_string())
}

/// How the rows of the table of parameters are found.
struct Rows<U: Fn(&str) -> &'static str> {
    /// The unit of an input that stands in this section.
    input_unit: U,
    /// Where the table has what stands in this section.
    place: Box<dyn Fn(&str) -> String>,
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
            _ => Err(Error::new(format!("this case does not set `{key}`"))),
        },
    }
}

/// `section` is the key as the table of parameters has it.
fn given<U: Fn(&str) -> &'static str>(node: &Node, section: &str, rows: &Rows<U>) -> Given {
    let place = (rows.place)(section);
    let row = || row(&place).or_else(|| row(place.strip_prefix("experiment.")?));
    match &node.kind {
        NodeValue::Float(number) => Given::Number(*number),
        NodeValue::Integer(number) => match row() {
            Some(row) if !row.unit.is_empty() => Given::Number(*number as f64),
            _ => Given::Whole(*number),
        },
        NodeValue::Text(text) => {
            let value = row()
                .and_then(|row| quantity::read(text, parameter::unit_for(row.unit, (rows.input_unit)(section))).ok());
            value.map_or_else(|| Given::Text(text.clone()), Given::Number)
        }
        NodeValue::Bool(truth) => Given::Truth(*truth),
        NodeValue::Date => Given::Text(String::new()),
        NodeValue::List(nodes) | NodeValue::Tables(nodes) => {
            Given::List(nodes.iter().map(|node| given(node, section, rows)).collect())
        }
        NodeValue::Table(entries) => {
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

/// A number of a case, with its row in the table of parameters.
#[derive(Debug, Clone)]
pub struct Number {
    /// Its key, as `--set` names it.
    pub key: String,
    /// Its row.
    pub row: &'static Parameter,
    /// Its SI unit.
    pub unit: &'static str,
    /// Its value in SI.
    pub value: f64,
    /// How the text has it: none where it is a default that the text does not name, empty for a bare number.
    pub written: Option<String>,
}

impl Case {
    /// Every number of the case that the table of parameters has: those of its text in the text's order, then the
    /// machine's numbers that have a default and do not stand there.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// let numbers = Case::from_text("axis.toml", TEMPLATE)?.numbers()?;
    /// let find = |key: &str| numbers.iter().find(|number| number.key == key).unwrap();
    /// assert_eq!(find("drive_pulley.radius").value, 0.0194);
    /// assert_eq!(find("experiment.0.input.for").unit, "s");
    /// assert!(find("motor.inductance").written.is_none());
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn numbers(&self) -> Result<Vec<Number>> {
        let tree = Source::new(Path::new(""), self.text.clone()).tree()?;
        let mut numbers = Vec::new();
        collect(&tree, ("", ""), &self.rows(), &mut numbers);
        let machine = &self.machine;
        let unwritten = parameter::values(machine).into_iter().filter_map(|(key, value)| {
            let row = machine.row(&key)?;
            let has_default = matches!(row.default, Fallback::Value(_)) && value.is_finite();
            let whole = |number: &Number| key.starts_with(&format!("{}.", number.key)) || number.key == key;
            let sits = matches!(machine.sits(row), parameter::Sits::Machine(..));
            // An element of a list that is not there cannot be set by itself.
            let is_element = key.split('.').any(|part| part.bytes().all(|byte| byte.is_ascii_digit()));
            let is_new = sits && has_default && !is_element && !numbers.iter().any(whole);
            is_new.then_some(Number { row, unit: row.unit, value, written: None, key })
        });
        let unwritten: Vec<Number> = unwritten.collect();
        numbers.extend(unwritten);
        Ok(numbers)
    }
}

/// Adds the numbers below `node`, which stands under `key`; `section` is the key without places in lists.
fn collect<U: Fn(&str) -> &'static str>(
    node: &Node,
    (key, section): (&str, &str),
    rows: &Rows<U>,
    numbers: &mut Vec<Number>,
) {
    let below = |key: &str, step: &str| if key.is_empty() { step.to_string() } else { format!("{key}.{step}") };
    match &node.kind {
        NodeValue::Table(entries) => {
            // Keys in quotes name experiments and parameters of plans: they are no numbers of a machine.
            let is_bare = |key: &str| key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
            for entry in entries.iter().filter(|entry| is_bare(&entry.key)) {
                collect(&entry.node, (&below(key, &entry.key), &below(section, &entry.key)), rows, numbers);
            }
        }
        NodeValue::List(nodes) | NodeValue::Tables(nodes) => {
            for (place, node) in nodes.iter().enumerate() {
                collect(node, (&below(key, &place.to_string()), section), rows, numbers);
            }
        }
        NodeValue::Float(_) | NodeValue::Integer(_) | NodeValue::Text(_) => {
            let place = (rows.place)(section);
            let found = row(&place).or_else(|| row(place.strip_prefix("experiment.")?));
            let Some(row) = found else { return };
            let unit = parameter::unit_for(row.unit, (rows.input_unit)(section));
            let (value, written) = match &node.kind {
                NodeValue::Float(value) => (*value, String::new()),
                NodeValue::Integer(value) => (*value as f64, String::new()),
                NodeValue::Text(text) => match quantity::read(text, unit) {
                    Ok(value) => (value, text.clone()),
                    Err(_) => return,
                },
                NodeValue::Bool(_)
                | NodeValue::Date
                | NodeValue::List(_)
                | NodeValue::Tables(_)
                | NodeValue::Table(_) => return,
            };
            numbers.push(Number { key: key.to_string(), row, unit, value, written: Some(written) });
        }
        NodeValue::Bool(_) | NodeValue::Date => {}
    }
}

impl Number {
    /// The change that gives it another value, as `--set` takes it: in the unit that the text has, to six digits.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// let case = Case::from_text("axis.toml", TEMPLATE)?; // with radius = "19.4 mm"
    /// let radius = case.numbers()?.into_iter().find(|number| number.key == "drive_pulley.radius").unwrap();
    /// assert_eq!(radius.change(0.02), "drive_pulley.radius=20 mm");
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn change(&self, value: f64) -> String {
        let text = match self.written.as_deref().map(quantity::parse) {
            _ if self.row.range.whole => quantity::shortest(value.round()),
            Some(Ok(given)) if !given.unit.is_empty() => {
                let factor = quantity::conversion(&given.unit).map_or(1.0, |(_, factor)| factor);
                format!("{} {}", quantity::rounded(value / factor), given.unit)
            }
            None if !self.unit.is_empty() => format!("{} {}", quantity::rounded(value), self.unit),
            _ => quantity::rounded(value),
        };
        format!("{}={text}", self.key)
    }
}

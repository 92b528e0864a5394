//! From places in a text to meanings: fields and tables, each checked against the table of parameters.

use super::source::Source;
use super::tree::{Entry, Node, NodeValue};
use crate::error::{Error, Result, SourceLocation};
use crate::parameter::{self, Fallback, Parameter};
use crate::quantity::{self, rounded};

/// Characters of an unknown key that its error repeats.
const LONGEST_KEY: usize = 60;

/// A value on the way to its meaning.
#[derive(Clone)]
pub(super) struct Field<'a> {
    pub source: &'a Source,
    pub node: &'a Node,
    /// As `--set` would name it: `experiment.0.until`.
    pub path: String,
    /// As the table of parameters names it: `experiment.until`.
    pub section: String,
    /// Unit of what the amplifier takes.
    pub input_unit: &'static str,
}

impl<'a> Field<'a> {
    /// The whole file.
    pub fn root(source: &'a Source, node: &'a Node) -> Self {
        Self { source, node, path: String::new(), section: String::new(), input_unit: "V" }
    }

    /// This value as a member of another section of the table of parameters.
    pub fn named(mut self, section: impl Into<String>) -> Self {
        self.section = section.into();
        self
    }

    /// The last part of its path.
    pub fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or_default()
    }

    pub fn fail(&self, what: impl std::fmt::Display) -> Error {
        Error::new(format!("{}: {what}", self.path)).at(self.source.place(self.node.span.clone()))
    }

    /// The error for a word that is known and that nobody reads.
    pub fn unread(&self) -> Error {
        self.fail(format!("`{}` is known, but not read yet", self.key()))
            .next("this is a fault of taut: please report it")
    }

    /// A number in SI, checked against its row of the table of parameters.
    pub fn number(&self) -> Result<f64> {
        match parameter::find(&self.section) {
            Some(row) => self.number_of(row),
            None => Err(self.fail("no such parameter")),
        }
    }

    pub fn number_of(&self, row: &Parameter) -> Result<f64> {
        let unit = parameter::unit_for(row.unit, self.input_unit);
        let example = example_for(row, self.input_unit);
        let such_as = match self.key() {
            key if key.starts_with(|c: char| c.is_ascii_digit()) => format!("write for example {example}"),
            key => format!("write for example {key} = {example}"),
        };
        let (value, typed) = match &self.node.kind {
            NodeValue::Integer(value) => (*value as f64, None),
            NodeValue::Float(value) => (*value, None),
            NodeValue::Text(text) => {
                let value = quantity::read(text, unit).map_err(|e| {
                    let mut error = self.fail(e.what);
                    error.allowed = e.allowed;
                    let useful = e.next.filter(|next| !unit.is_empty() && next != quantity::SUCH_AS);
                    error.next(useful.unwrap_or(such_as.clone()))
                })?;
                (value, Some(text.trim()))
            }
            other => {
                let wanted = if unit.is_empty() { "a number" } else { "a number or a text with a unit" };
                return Err(self.fail(format!("expected {wanted}, found {}", other.word())).next(such_as));
            }
        };
        if !value.is_finite() {
            return Err(self
                .fail(format!("{} is not a finite number", value.to_string().to_lowercase()))
                .next(such_as));
        }
        if !row.range.contains(value) {
            let shown = typed.map_or_else(
                || if unit.is_empty() { rounded(value) } else { format!("{} {unit}", rounded(value)) },
                str::to_string,
            );
            let wrong = match row.range {
                r if value <= 0.0 && r.low >= 0.0 && (r.low > 0.0 || r.above) => "has to be above zero",
                r if value < 0.0 && r.low == 0.0 => "cannot be negative",
                r if r.whole && value.fract() != 0.0 => "has to be a whole number",
                r if value > r.high || (value == r.high && r.below) => "is too large",
                _ => "is too small",
            };
            return Err(self.fail(format!("{shown} {wrong}")).allowed(row.range.describe(unit)));
        }
        Ok(value)
    }

    /// A seed, all of whose digits count: a double would round those beyond 2⁵³.
    pub fn seed(&self) -> Result<u64> {
        let digits = match &self.node.kind {
            NodeValue::Integer(value) => Some(*value),
            NodeValue::Text(text) => text.trim().parse().ok(),
            _ => None,
        };
        match digits.and_then(|value| u64::try_from(value).ok()) {
            Some(seed) => Ok(seed),
            // 1e9, say; or the mistake is told.
            None => self.number().map(|value| value as u64),
        }
    }

    pub fn text(&self) -> Result<&'a str> {
        match &self.node.kind {
            NodeValue::Text(text) => Ok(text),
            other => Err(self.fail(format!("expected a text, found {}", other.word())).next("put the text in quotes")),
        }
    }

    /// `true` or `false`.
    pub fn truth(&self) -> Result<bool> {
        match &self.node.kind {
            NodeValue::Bool(value) => Ok(*value),
            other => Err(self
                .fail(format!("expected true or false, found {}", other.word()))
                .next("write true or false, without quotes")),
        }
    }

    /// One of a few words.
    pub fn choice<T: Copy>(&self, options: &[(&str, T)]) -> Result<T> {
        let words: Vec<&str> = options.iter().map(|(word, _)| *word).collect();
        let allowed = || words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or ");
        let NodeValue::Text(text) = &self.node.kind else {
            return Err(self.fail(format!("expected a word, found {}", self.node.kind.word())).allowed(allowed()));
        };
        options.iter().find(|(word, _)| word == text).map(|(_, value)| *value).ok_or_else(|| {
            let error = self.fail(format!("\"{text}\" is not known")).allowed(allowed());
            match nearest(text, &words) {
                Some(near) => error.next(format!("did you mean \"{near}\"?")),
                None => error,
            }
        })
    }

    pub fn list(&self) -> Result<Vec<Field<'a>>> {
        match &self.node.kind {
            NodeValue::List(nodes) | NodeValue::Tables(nodes) => Ok(nodes
                .iter()
                .enumerate()
                .map(|(i, node)| Field { node, path: format!("{}.{i}", self.path), ..self.clone() })
                .collect()),
            other => Err(self
                .fail(format!("expected a list, found {}", other.word()))
                .next("write the values in brackets, separated by commas: [1, 2, 3]")),
        }
    }

    /// A list with something in it.
    pub fn filled_list(&self) -> Result<Vec<Field<'a>>> {
        let list = self.list()?;
        if list.is_empty() {
            return Err(self.fail("the list is empty").allowed("at least one value"));
        }
        Ok(list)
    }

    /// Three numbers, one for each span of an axis.
    pub fn three(&self) -> Result<[f64; 3]> {
        let per_span = "three values: drive pulley to cart, cart to idler pulley, idler pulley to drive pulley";
        let mut values = [0.0; 3];
        values.copy_from_slice(&self.numbers(3, per_span)?);
        Ok(values)
    }

    /// So many numbers, one for each span.
    pub fn numbers(&self, count: usize, per_span: &str) -> Result<Vec<f64>> {
        let NodeValue::List(nodes) = &self.node.kind else {
            return Err(self.fail(format!("expected a list, found {}", self.node.kind.word())).allowed(per_span));
        };
        if nodes.len() != count {
            return Err(self.fail(format!("the list has {} values", nodes.len())).allowed(per_span));
        }
        self.list()?.iter().map(Field::number).collect()
    }

    pub fn is_table(&self) -> bool {
        matches!(self.node.kind, NodeValue::Table(_))
    }

    pub fn is_list(&self) -> bool {
        matches!(self.node.kind, NodeValue::List(_) | NodeValue::Tables(_))
    }

    pub fn table(&self) -> Result<Table<'a>> {
        match &self.node.kind {
            NodeValue::Table(entries) => Ok(Table { field: self.clone(), entries, base: None }),
            NodeValue::Tables(_) => Err(self
                .fail("there can be only one of these")
                .next(format!("write [{}] with single brackets", self.path))),
            other => {
                let next = match self.path.contains('.') {
                    true => "write its entries in braces: { key = value, key = value }".to_string(),
                    false => format!("write [{}] on a line of its own, and its keys below", self.path),
                };
                Err(self.fail(format!("expected a table, found {}", other.word())).next(next))
            }
        }
    }
}

/// A table on the way to its meaning.
pub(super) struct Table<'a> {
    pub field: Field<'a>,
    entries: &'a [Entry],
    /// The table that holds for keys that are not in it.
    base: Option<Box<Table<'a>>>,
}

impl<'a> Table<'a> {
    /// This table over a base table, whose values apply where this one has none.
    pub fn over(mut self, base: Option<Table<'a>>) -> Self {
        self.base = base.map(Box::new);
        self
    }

    fn child(&self, entry: &'a Entry) -> Field<'a> {
        let join = |before: &str| match before {
            "" => entry.key.clone(),
            _ => format!("{before}.{}", entry.key),
        };
        Field {
            source: self.field.source,
            node: &entry.node,
            path: join(&self.field.path),
            section: join(&self.field.section),
            input_unit: self.field.input_unit,
        }
    }

    /// The name of this table in messages.
    fn title(&self) -> String {
        match self.field.path.as_str() {
            "" => "the case file".to_string(),
            path => format!("`{path}`"),
        }
    }

    /// Every key must be a parameter of this section or one of `others`; `planned` ones are known but not there yet.
    pub fn check_keys(&self, others: &[&'static str], planned: &[&'static str]) -> Result<()> {
        let mut known =
            if self.field.section.is_empty() { Vec::new() } else { parameter::names_in(&self.field.section) };
        known.extend(others);
        for entry in self.entries {
            let place = || self.field.source.place(entry.key_span.clone());
            let key = entry.key.as_str();
            if planned.contains(&key) {
                return Err(Error::new(format!("`{}` is not supported yet", self.child(entry).path))
                    .at(place())
                    .next("leave it out for now"));
            }
            if known.contains(&key) {
                continue;
            }
            let shown: String = match key.chars().nth(LONGEST_KEY) {
                Some(_) => key.chars().take(LONGEST_KEY).chain("…".chars()).collect(),
                None => key.into(),
            };
            let error = Error::new(format!("{} has no key `{shown}`", self.title()))
                .at(place())
                .allowed(known.iter().filter(|k| !planned.contains(k)).copied().collect::<Vec<_>>().join(", "));
            // What belongs to a table of an axis need not be there for a gantry.
            let of_gantry = ["bridge", "gantry"].contains(&self.field.section.split('.').next().unwrap_or_default());
            return Err(match (nearest(key, &known), elsewhere(key).filter(|_| !of_gantry)) {
                (Some(near), _) => error.next(format!("did you mean `{near}`?")),
                (None, Some(section)) => error.next(format!("`{key}` belongs to `{section}`")),
                (None, None) => error,
            });
        }
        Ok(())
    }

    pub fn keys(&self) -> impl Iterator<Item = &'a str> {
        self.entries.iter().map(|e| e.key.as_str())
    }

    /// The first key that is none of these.
    pub fn first_beyond(&self, known: &[&str]) -> Option<Field<'a>> {
        let key = self.keys().find(|key| !known.contains(key))?;
        Some(self.optional(key).unwrap_or_else(|| self.field.clone()))
    }

    pub fn optional(&self, key: &str) -> Option<Field<'a>> {
        let own = self.entries.iter().find(|e| e.key == key).map(|e| self.child(e));
        own.or_else(|| self.base.as_ref()?.optional(key))
    }

    /// The value of `key`; `example` is what to add if it is missing.
    pub fn required(&self, key: &str, example: &str) -> Result<Field<'a>> {
        self.optional(key).ok_or_else(|| self.missing(key, example))
    }

    pub fn missing(&self, key: &str, example: &str) -> Error {
        let path = &self.field.path;
        let whole = if path.is_empty() { format!("[{key}]") } else { format!("`{path}.{key}`") };
        let place = match path.is_empty() {
            true => SourceLocation::file(&self.field.source.name),
            false => self.field.source.place(self.field.node.span.clone()),
        };
        Error::new(format!("{whole} is missing")).at(place).next(format!("add {example}"))
    }

    /// The number `key`, or its default.
    pub fn number(&self, key: &str) -> Result<f64> {
        match self.number_if_given(key)? {
            Some(value) => Ok(value),
            None => {
                let section = format!("{}.{key}", self.field.section);
                match parameter::find(&section) {
                    Some(Parameter { default: Fallback::Value(value), .. }) => Ok(*value),
                    Some(row) => Err(self.missing_number(key, row)),
                    None => Err(self.field.fail(format!("no parameter `{key}`"))),
                }
            }
        }
    }

    /// `value`, computed from what the field `from` says, if it lies in the range of the parameter `key`.
    pub fn computed(&self, key: &str, from: &Field, value: f64) -> Result<f64> {
        match parameter::find(&format!("{}.{key}", self.field.section)) {
            Some(row) if !row.range.contains(value) => Err(from
                .fail(format!("this makes {key} {} {}", rounded(value), row.unit))
                .allowed(row.range.describe(row.unit))),
            _ => Ok(value),
        }
    }

    /// The number `seed`, or its default.
    pub fn seed(&self) -> Result<u64> {
        match self.optional("seed") {
            Some(field) => field.seed(),
            None => self.number("seed").map(|value| value as u64),
        }
    }

    pub fn number_if_given(&self, key: &str) -> Result<Option<f64>> {
        self.optional(key).map(|field| field.number()).transpose()
    }

    fn missing_number(&self, key: &str, row: &Parameter) -> Error {
        let example = example_for(row, self.field.input_unit);
        self.missing(key, &format!("for example {key} = {example}  # {}", row.sentence))
    }
}

/// The example of a row in the unit of the amplifier's input, as a value in the file.
fn example_for(row: &Parameter, input_unit: &str) -> String {
    let unit = parameter::unit_for(row.unit, input_unit);
    let example = match (input_unit, unit) {
        _ if unit == row.unit => row.example.to_string(),
        ("A", _) => row.example.replace(" V", " A"),
        // Gains of a stepper's controller.
        ("m", "") => "0.5".into(),
        ("m", "1/s") => "40 1/s".into(),
        ("m", "s") => "0.2 ms".into(),
        ("m", _) => row.example.replace(" V", " mm"),
        _ => row.example.to_string(),
    };
    if unit.is_empty() { example } else { format!("\"{example}\"") }
}

/// The table that a misplaced key belongs to.
fn elsewhere(key: &str) -> Option<&'static str> {
    parameter::all()
        .filter(|p| !p.key.starts_with("input."))
        .find_map(|p| p.key.strip_suffix(key).and_then(|rest| rest.strip_suffix('.')))
}

/// The known word that a misspelt one is closest to.
pub(super) fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    const LONGEST: usize = 40;
    let plain = |w: &str| w.to_lowercase().replace(['-', ' '], "_");
    let word = plain(word);
    let length = word.chars().count();
    if length > LONGEST {
        return None;
    }
    let allowed = (length / 3).max(1);
    known
        .iter()
        .map(|k| (strsim::damerau_levenshtein(&plain(k), &word), *k))
        .filter(|(distance, k)| *distance <= allowed && *distance < k.len())
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, k)| k)
}

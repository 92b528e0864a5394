//! TOML with places: every value knows where it stands, so that every mistake can be told with its line.

use super::bounds;
use super::source::Source;
use crate::error::{Error, Result};
use std::ops::Range;
use toml_edit::{Document, Item, Value};

/// A value with its place.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub span: Range<usize>,
    pub kind: NodeValue,
}

#[derive(Debug, Clone)]
pub(super) enum NodeValue {
    Text(String),
    Integer(i64),
    Float(f64),
    Bool(bool),
    Date,
    List(Vec<Node>),
    /// From `[[header]]`s.
    Tables(Vec<Node>),
    Table(Vec<Entry>),
}

#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub key: String,
    pub key_span: Range<usize>,
    pub node: Node,
}

impl Source {
    /// The root table, or where the text is no TOML.
    pub fn tree(&self) -> Result<Node> {
        let text = self.text.as_str();
        bounds::check(self)?;
        if let Some(at) = text.find('\0') {
            return Err(Error::new("this is not a text file: it holds a zero byte")
                .at(self.place(at..at))
                .next("give the path of a case file in TOML"));
        }
        let document = Document::parse(text).map_err(|e| syntax(self, &e))?;
        Ok(Node { span: 0..0, kind: NodeValue::Table(entries(document.as_table(), 0..0)) })
    }
}

/// A TOML mistake in our words where we have better ones.
fn syntax(source: &Source, error: &toml_edit::TomlError) -> Error {
    let end = source.text.len();
    let span = error.span().unwrap_or(end..end);
    let message = error.message().lines().collect::<Vec<_>>().join("; ");
    let line = {
        let at = source.text.floor_char_boundary(span.start);
        let begin = source.text[..at].rfind('\n').map_or(0, |i| i + 1);
        source.text[begin..].lines().next().unwrap_or_default()
    };
    let header = line.trim_start().starts_with('[');
    let (what, next) = TOML_MISTAKES
        .iter()
        .find(|(theirs, ..)| message.contains(theirs))
        .map_or((format!("this is not TOML: {message}"), None), |(_, what, next)| ((*what).to_string(), Some(*next)));
    let next = next.unwrap_or(match header {
        true => "a table begins with its name in brackets, such as [cart] or [[experiment]]",
        false => A_LINE,
    });
    Error::new(what).at(source.place(span)).next(next)
}

const A_LINE: &str = "a line is key = value; a number with a unit is written in quotes, such as mass = \"0.362 kg\"";

/// Mistakes of the notation: what the reader of TOML says, and what we say instead.
const TOML_MISTAKES: &[(&str, &str, &str)] = &[
    ("recursion", "this is nested too deeply", "nest lists and tables less deeply"),
    ("duplicate key", "this key or table occurs twice", "keep one of the two"),
    ("values must be quoted", "this is neither a number nor a text in quotes", A_LINE),
    ("number overflowed", "this number is too large for a computer's number", "check its digits and its power of ten"),
    ("key with no value", "there is no `=` after this key", A_LINE),
    (
        "unclosed table",
        "the `]` is missing",
        "a table begins with its name in brackets, such as [cart] or [[experiment]]",
    ),
    ("invalid basic string", "the text is not closed: a `\"` is missing", A_LINE),
    (
        "comma between array elements",
        "the list is not closed, or a comma is missing in it",
        "a list is such as [1, 2, 3]",
    ),
    (
        "comma between key-value pairs",
        "a comma is missing",
        "a table in one line is such as { viscous = 19, coulomb = 0.2 }",
    ),
];

fn entries(table: &dyn toml_edit::TableLike, outer: Range<usize>) -> Vec<Entry> {
    table
        .iter()
        .filter(|(_, item)| !item.is_none())
        .map(|(key, item)| {
            let key_span = table.key(key).and_then(toml_edit::Key::span).unwrap_or(outer.clone());
            Entry { key: key.to_string(), node: node(item, &key_span), key_span }
        })
        .collect()
}

fn node(item: &Item, key_span: &Range<usize>) -> Node {
    match item {
        Item::None => Node { span: key_span.clone(), kind: NodeValue::Table(Vec::new()) },
        Item::Value(value) => value_node(value, key_span),
        Item::Table(table) => Node { span: key_span.clone(), kind: NodeValue::Table(entries(table, key_span.clone())) },
        Item::ArrayOfTables(tables) => {
            let one = |table: &toml_edit::Table| {
                let span = table.span().unwrap_or(key_span.clone());
                Node { kind: NodeValue::Table(entries(table, span.clone())), span }
            };
            Node { span: key_span.clone(), kind: NodeValue::Tables(tables.iter().map(one).collect()) }
        }
    }
}

fn value_node(value: &Value, outer: &Range<usize>) -> Node {
    let span = value.span().unwrap_or(outer.clone());
    let kind = match value {
        Value::String(text) => NodeValue::Text(text.value().clone()),
        Value::Integer(number) => NodeValue::Integer(*number.value()),
        Value::Float(number) => NodeValue::Float(*number.value()),
        Value::Boolean(flag) => NodeValue::Bool(*flag.value()),
        Value::Datetime(_) => NodeValue::Date,
        Value::Array(list) => NodeValue::List(list.iter().map(|v| value_node(v, &span)).collect()),
        Value::InlineTable(table) => NodeValue::Table(entries(table, span.clone())),
    };
    Node { span, kind }
}

impl NodeValue {
    /// Its kind, for messages.
    pub fn word(&self) -> &'static str {
        match self {
            NodeValue::Text(_) => "a text",
            NodeValue::Integer(_) | NodeValue::Float(_) => "a number",
            NodeValue::Bool(true) => "true",
            NodeValue::Bool(false) => "false",
            NodeValue::Date => "a date or a time of day",
            NodeValue::List(_) => "a list",
            NodeValue::Tables(_) => "a list of tables",
            NodeValue::Table(_) => "a table",
        }
    }
}

//! `--set KEY=VALUE`: changes the text of a case and leaves its comments alone.

use super::source::{Override, Source, equals};
use super::tree::{Entry, Node, NodeValue};
use crate::error::{Error, Result, SourceLocation};
use crate::parameter;
use std::path::Path;
use toml_edit::{ArrayOfTables, DocumentMut, Item, Key, Table, Value};

/// A change, as given on the command line.
struct Change<'a> {
    argument: &'a str,
    key: Vec<String>,
    value: Value,
}

/// The text with all changes applied, and where they ended up in it.
pub(super) fn apply(name: &Path, text: &str, changes: &[&str]) -> Result<Source> {
    let source = Source::new(name, text.to_string());
    if changes.is_empty() {
        return Ok(source);
    }
    source.tree()?; // tells mistakes of the file as such
    let mut document: DocumentMut = text.parse().map_err(|_| Error::new("this is not TOML").in_file(name))?;
    let changes = changes.iter().map(|argument| Change::new(argument)).collect::<Result<Vec<_>>>()?;
    for change in &changes {
        change.apply(document.as_item_mut())?;
    }
    let mut changed = Source::new(name, document.to_string());
    let tree = changed.tree()?;
    for change in &changes {
        if let Some(range) = find(&tree, &change.key) {
            changed.overrides.push(Override { argument: change.argument.to_string(), range });
        }
    }
    Ok(changed)
}

impl<'a> Change<'a> {
    fn new(argument: &'a str) -> Result<Self> {
        let usage = "write KEY=VALUE, such as --set cart.mass=\"0.5 kg\" or --set experiment.0.until=2s";
        let whole = || SourceLocation::in_text("--set", argument, 0..argument.len());
        let Some(place) = equals(argument) else {
            return Err(Error::new("there is no `=`").at(whole()).next(usage));
        };
        let (key, value) = (&argument[..place], &argument[place + 1..]);
        let keys = Key::parse(key).ok().filter(|keys| !keys.is_empty());
        let Some(keys) = keys else {
            return Err(Error::new(format!("\"{key}\" is no key")).at(whole()).next(usage));
        };
        let value = value.trim();
        // What TOML understands is TOML; the rest is a text: 0.5 kg needs no second pair of quotes.
        let value = match value.parse::<Value>() {
            Ok(parsed) => parsed,
            Err(_) if value.starts_with(['[', '{', '"', '\'']) => {
                let at = SourceLocation::in_text("--set", argument, key.len() + 1..argument.len());
                return Err(Error::new("this list, table or text is not complete")
                    .at(at)
                    .next("put texts inside it in quotes: [\"1 kN/m\", \"2 kN/m\"]"));
            }
            Err(_) => Value::from(value),
        };
        Ok(Self { argument, key: keys.iter().map(|k| k.get().to_string()).collect(), value })
    }

    fn fail(&self, what: impl Into<String>) -> Error {
        let key = equals(self.argument).unwrap_or(self.argument.len());
        Error::new(what).at(SourceLocation::in_text("--set", self.argument, 0..key))
    }

    fn apply(&self, root: &mut Item) -> Result<()> {
        let mut item = root;
        let Some((last, path)) = self.key.split_last() else { return Ok(()) };
        let mut depth = 0;
        while depth < path.len() && !item.is_array() {
            item = self.step(item, &path[depth], depth)?;
            depth += 1;
        }
        let fresh = matches!(item, Item::Table(_));
        match item {
            Item::Value(list @ Value::Array(_)) => {
                let element = self.element(list, depth)?;
                replace(element, self.value.clone());
            }
            other => {
                let Some(table) = other.as_table_like_mut() else {
                    return Err(self.fail(format!("`{last}` cannot be set: its parent is not a table")));
                };
                match table.get_mut(last) {
                    Some(Item::Value(old)) => replace(old, self.value.clone()),
                    _ => {
                        let mut value = self.value.clone();
                        if fresh {
                            value.decor_mut().clear();
                        }
                        table.insert(last, Item::Value(value));
                    }
                }
            }
        }
        Ok(())
    }

    /// The table or list element called `step`; a table that is not there yet is made.
    fn step<'i>(&self, item: &'i mut Item, step: &str, depth: usize) -> Result<&'i mut Item> {
        if let Item::ArrayOfTables(tables) = item {
            let length = tables.len();
            let Some(index) = index_of(tables, step) else { return Err(self.no_element(step, length)) };
            return item.get_mut(index).ok_or_else(|| self.no_element(step, length));
        }
        let Some(table) = item.as_table_like_mut() else {
            return Err(self.fail(format!("`{step}` cannot be reached: its parent is not a table")));
        };
        if !table.contains_key(step) {
            let new = match depth {
                0 => Item::Table(Table::new()),
                _ => Item::Value(Value::InlineTable(toml_edit::InlineTable::new())),
            };
            table.insert(step, new);
        }
        table.get_mut(step).ok_or_else(|| self.fail(format!("`{step}` cannot be made")))
    }

    /// The element of `list` that the key names, `depth` steps down: the number of an element, and of a point its part.
    fn element<'v>(&self, list: &'v mut Value, depth: usize) -> Result<&'v mut Value> {
        let mut value = list;
        for (place, step) in self.key.iter().enumerate().skip(depth) {
            value = match value {
                Value::Array(list) => {
                    let length = list.len();
                    let element = place_in_list(step, &self.key[..place]).and_then(|place| list.get_mut(place));
                    element.ok_or_else(|| self.no_element(step, length))?
                }
                Value::InlineTable(table) => {
                    if place + 1 == self.key.len() {
                        table.get_or_insert(step, self.value.clone());
                    }
                    table.get_mut(step).ok_or_else(|| {
                        self.fail(format!("`{step}` does not exist yet; set the entries before it first"))
                    })?
                }
                _ => return Err(self.fail(format!("`{step}` cannot be reached: its parent is not a table"))),
            };
        }
        Ok(value)
    }

    fn no_element(&self, step: &str, length: usize) -> Error {
        let allowed = match length {
            0 => "the list is empty".to_string(),
            n => format!("0 to {}, or the name of an experiment in quotes", n - 1),
        };
        self.fail(format!("there is no element `{step}`")).allowed(allowed)
    }
}

/// Puts `new` where `old` was, with the old one's spaces and comments.
fn replace(old: &mut Value, mut new: Value) {
    *new.decor_mut() = old.decor().clone();
    *old = new;
}

fn index_of(tables: &ArrayOfTables, step: &str) -> Option<usize> {
    match step.parse::<usize>() {
        Ok(index) => Some(index).filter(|&i| i < tables.len()),
        Err(_) => tables.iter().position(|t| t.get("name").and_then(Item::as_str) == Some(step)),
    }
}

/// A key without places in lists.
fn section(key: &[String]) -> String {
    let names = key.iter().filter(|step| step.parse::<usize>().is_err());
    names.map(String::as_str).collect::<Vec<_>>().join(".")
}

/// The place of `step` in the list that `before` leads to: its number, or in a point the place of the part that the
/// table of parameters gives this name.
fn place_in_list(step: &str, before: &[String]) -> Option<usize> {
    if let Ok(place) = step.parse() {
        return Some(place);
    }
    before.last()?.parse::<usize>().ok()?;
    parameter::names_in(&section(before)).iter().position(|name| *name == step)
}

/// Where the value of `key` stands in the changed text, its key included.
fn find(tree: &Node, key: &[String]) -> Option<std::ops::Range<usize>> {
    let mut node = tree;
    let mut range = node.span.clone();
    for (place, step) in key.iter().enumerate() {
        let (next, entry) = child(node, step, &key[..place])?;
        node = next;
        range = match entry {
            Some(entry) => entry.key_span.start..node.span.end.max(entry.key_span.end),
            None => node.span.clone(),
        };
    }
    Some(range)
}

/// The value of `key`, and the key without places in lists.
pub(super) fn node<'n>(tree: &'n Node, key: &[String]) -> Option<(&'n Node, String)> {
    let (mut node, mut section) = (tree, String::new());
    for (place, step) in key.iter().enumerate() {
        let (next, entry) = child(node, step, &key[..place])?;
        // A name leads through a table, or is that of a part of a point.
        let name = match (entry, &node.kind) {
            (Some(entry), _) => Some(entry.key.as_str()),
            (None, NodeValue::List(_)) if step.parse::<usize>().is_err() => Some(step.as_str()),
            (None, _) => None,
        };
        if let Some(name) = name {
            let dot = if section.is_empty() { "" } else { "." };
            section = format!("{section}{dot}{name}");
        }
        node = next;
    }
    Some((node, section))
}

/// The entry of a table, or the element of a list by its number or its name; `before` leads to what stands there.
fn child<'n>(node: &'n Node, step: &str, before: &[String]) -> Option<(&'n Node, Option<&'n Entry>)> {
    match &node.kind {
        NodeValue::Table(entries) => {
            let entry = entries.iter().find(|e| e.key == step)?;
            Some((&entry.node, Some(entry)))
        }
        NodeValue::List(nodes) | NodeValue::Tables(nodes) => {
            let by_name = |n: &&Node| match &n.kind {
                NodeValue::Table(entries) => entries
                    .iter()
                    .any(|e| e.key == "name" && matches!(&e.node.kind, NodeValue::Text(text) if text == step)),
                _ => false,
            };
            let node = match step.parse::<usize>() {
                Ok(index) => nodes.get(index)?,
                Err(_) => nodes.iter().find(by_name).or_else(|| nodes.get(place_in_list(step, before)?))?,
            };
            Some((node, None))
        }
        _ => None,
    }
}

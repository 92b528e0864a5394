//! The JSON Schema of each result, made from the tables in `src/json/results`: a line for each key, with its path, its
//! type and what it is.
//!
//! In a path `[]` is each element of a list, `*` each key of a map, and a key that ends in `?` may be missing. Types
//! are `text`, `number`, `whole`, `flag`, `any`, a list `[number]` and a map `{number}` of them; with `?` behind it,
//! null is there where it has no value. `FIGURES` stands for the lines of the key figures.

use super::simulation::figure_lines;
use serde_json::{Map, Value, json};

/// The results, by the word that each begins with: `"schema": "taut/WORD/1"`.
const RESULTS: &[(&str, &str, &str)] = &[
    ("check", "`taut check`", include_str!("results/check.txt")),
    ("compare", "`taut fit --compare`", include_str!("results/compare.txt")),
    ("design", "`taut design`", include_str!("results/design.txt")),
    ("drift", "`taut fit --drift`", include_str!("results/drift.txt")),
    ("error", "An error, under --json", include_str!("results/error.txt")),
    ("export", "`taut export json`: a model as data", include_str!("results/export.txt")),
    ("exported", "`taut export` to other targets", include_str!("results/exported.txt")),
    ("files", "What a folder of results holds: files.json", include_str!("results/files.txt")),
    ("fit", "`taut fit`", include_str!("results/fit.txt")),
    ("frf", "`taut frf`", include_str!("results/frf.txt")),
    ("learn", "`taut learn`", include_str!("results/learn.txt")),
    ("map", "`taut learn --map`", include_str!("results/map.txt")),
    ("modes", "`taut modes`", include_str!("results/modes.txt")),
    ("move", "`taut move`", include_str!("results/move.txt")),
    ("paper", "`taut paper`: claims.json", include_str!("results/paper.txt")),
    ("plan", "`taut plan`", include_str!("results/plan.txt")),
    ("shape", "`taut shape`", include_str!("results/shape.txt")),
    ("show", "`taut show`", include_str!("results/show.txt")),
    ("simulate", "`taut simulate`", include_str!("results/simulate.txt")),
    ("sweep", "`taut sweep`", include_str!("results/sweep.txt")),
    ("tune", "`taut tune`", include_str!("results/tune.txt")),
];

/// The schemas that there are: names and sentences, the case file first.
pub fn schemas() -> impl Iterator<Item = (&'static str, &'static str)> {
    std::iter::once(("case", "A case file")).chain(RESULTS.iter().map(|(name, words, _)| (*name, *words)))
}

/// The schema of this name, as JSON Schema draft 2020-12.
pub fn schema(name: &str) -> Option<Value> {
    if name == "case" {
        return Some(super::case_schema());
    }
    let (name, words, table) = RESULTS.iter().find(|(known, _, _)| *known == name)?;
    let mut root = Node::default();
    for line in table.lines().filter(|line| !line.trim().is_empty()) {
        let (path, rest) = line.split_once(' ').unwrap_or((line, "any"));
        if let Some(path) = path.strip_suffix("FIGURES") {
            for [end, kind, meaning] in figure_lines() {
                root.add(&format!("{path}{end}"), &kind, &meaning);
            }
            continue;
        }
        let (kind, meaning) = rest.trim_start().split_once(' ').unwrap_or((rest.trim_start(), ""));
        root.add(path, kind, meaning.trim());
    }
    let mut schema = root.schema();
    schema["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    schema["$id"] = json!(super::address(name));
    schema["title"] = json!(words);
    // A list has no word of its own.
    if root.element.is_none() {
        schema["properties"]["schema"] = json!({ "const": identity(name) });
    }
    Some(schema)
}

/// The word that a result of this name begins with.
pub fn identity(name: &str) -> String {
    format!("taut/{name}/{}", version(name))
}

/// The version of a result's schema.
pub(super) fn version(name: &str) -> u8 {
    if ["simulate", "modes"].contains(&name) { 2 } else { 1 }
}

/// A key and what is below it.
#[derive(Default)]
struct Node {
    kind: Option<String>,
    meaning: String,
    keys: Vec<(String, bool, Node)>,
    element: Option<Box<Node>>,
    value: Option<Box<Node>>,
}

impl Node {
    fn add(&mut self, path: &str, kind: &str, meaning: &str) {
        if path.is_empty() {
            (self.kind, self.meaning) = (Some(kind.to_string()), meaning.to_string());
            return;
        }
        if let Some(rest) = path.strip_prefix("[]") {
            return self.element.get_or_insert_default().add(rest.trim_start_matches('.'), kind, meaning);
        }
        let end = path.find(['.', '[']).unwrap_or(path.len());
        let (key, rest) = (&path[..end], path[end..].trim_start_matches('.'));
        if key == "*" {
            return self.value.get_or_insert_default().add(rest, kind, meaning);
        }
        let (name, optional) = key.strip_suffix('?').map_or((key, false), |name| (name, true));
        let place = match self.keys.iter().position(|(known, _, _)| known == name) {
            Some(place) => place,
            None => {
                self.keys.push((name.to_string(), optional, Node::default()));
                self.keys.len() - 1
            }
        };
        self.keys[place].2.add(rest, kind, meaning);
    }

    fn schema(&self) -> Value {
        let may_be_null = self.kind.as_ref().is_some_and(|kind| kind.ends_with('?'));
        let mut schema = match (&self.element, &self.value, &self.kind) {
            (Some(element), _, _) => json!({ "type": "array", "items": element.schema() }),
            (None, Some(value), _) => json!({ "type": "object", "additionalProperties": value.schema() }),
            (None, None, Some(kind)) if self.keys.is_empty() => of_kind(kind.trim_end_matches('?')),
            (None, None, _) => {
                let properties: Map<String, Value> =
                    self.keys.iter().map(|(name, _, node)| (name.clone(), node.schema())).collect();
                let required: Vec<&str> =
                    self.keys.iter().filter(|(_, optional, _)| !optional).map(|(name, ..)| name.as_str()).collect();
                json!({
                    "type": "object", "additionalProperties": false, "properties": properties, "required": required,
                })
            }
        };
        if may_be_null {
            schema = json!({ "anyOf": [schema, { "type": "null" }] });
        }
        if !self.meaning.is_empty() {
            schema["description"] = json!(self.meaning);
        }
        schema
    }
}

fn of_kind(kind: &str) -> Value {
    if let Some(of) = kind.strip_prefix('[').and_then(|kind| kind.strip_suffix(']')) {
        return json!({ "type": "array", "items": of_kind(of) });
    }
    if let Some(of) = kind.strip_prefix('{').and_then(|kind| kind.strip_suffix('}')) {
        return json!({ "type": "object", "additionalProperties": of_kind(of) });
    }
    match kind {
        "text" => json!({ "type": "string" }),
        "number" => json!({ "type": "number" }),
        "number?" => json!({ "type": ["number", "null"] }),
        "whole" => json!({ "type": "integer" }),
        "flag" => json!({ "type": "boolean" }),
        _ => json!({}),
    }
}

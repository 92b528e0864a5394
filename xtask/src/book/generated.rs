//! Parts of the book's reference generated from the program and the Python package.

use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// The case whose exported header stands for all.
const EXPORTED: &str = "stages/sollmann-jouaneh/controllers/pid.toml";

/// A page with its lines `<!-- generated: NAME -->` replaced.
pub fn filled(text: &str, program: &Path) -> Result<String, String> {
    let mut filled = String::new();
    for line in text.lines() {
        let name = line.strip_prefix("<!-- generated: ").and_then(|rest| rest.strip_suffix(" -->"));
        filled += &match name {
            None => line.to_string(),
            Some("schemas") => schemas(program)?,
            Some("python") => reference()?,
            Some("header") => header(program)?,
            Some(other) => return Err(format!("{other} cannot be generated; schemas, python and header can")),
        };
        filled.push('\n');
    }
    Ok(filled)
}

/// The output of a command as text.
fn text_of(command: Command) -> Result<String, String> {
    let shown = format!("{command:?}");
    String::from_utf8(crate::output(command)?).map_err(|_| format!("the output of {shown} is not text"))
}

/// The reference of the Python package.
fn reference() -> Result<String, String> {
    let mut command = Command::new("python3");
    command.arg("py/reference.py");
    text_of(command)
}

/// The output of the program.
fn taut(program: &Path, words: &[&str]) -> Result<String, String> {
    let mut command = Command::new(program);
    command.args(words);
    text_of(command)
}

/// A header as `taut export c` writes it.
fn header(program: &Path) -> Result<String, String> {
    let file = crate::host::target().join("book/axis.c");
    taut(program, &["export", "c", EXPORTED, "--out", &file.display().to_string()])?;
    Ok(format!("```c\n{}```\n", super::read(&file.with_extension("h"))?))
}

/// A table for every schema.
fn schemas(program: &Path) -> Result<String, String> {
    let mut text = String::new();
    for line in taut(program, &["schema"])?.lines().filter_map(|line| line.strip_prefix("  ")) {
        let (name, what) = line.split_once("  ").unwrap_or((line, ""));
        let schema = taut(program, &["schema", name])?;
        let schema: Value = serde_json::from_str(&schema).map_err(|error| format!("taut schema {name}: {error}"))?;
        let _ = writeln!(text, "## {name}\n\n{}\n", what.trim());
        text += "| key | type | meaning |\n|---|---|---|\n";
        rows(&schema, &schema, "", &mut text, 0);
        text.push('\n');
    }
    Ok(text)
}

/// Deeper than this a schema that contains itself is not followed.
const DEPTH: usize = 8;

/// The rows of an object's keys, and of what they hold.
fn rows(root: &Value, schema: &Value, path: &str, text: &mut String, depth: usize) {
    if depth > DEPTH {
        return;
    }
    let schema = resolved(root, schema);
    for (key, value) in schema["properties"].as_object().into_iter().flatten() {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        let meaning = [value, resolved(root, value)].map(|value| value["description"].as_str());
        let meaning = meaning.into_iter().flatten().next().unwrap_or_default().replace('|', "\\|").replace('\n', " ");
        let _ = writeln!(text, "| `{path}` | {} | {} |", kind(root, value, 0), meaning.replace('<', "&lt;"));
        rows(root, value, &path, text, depth + 1);
    }
    if schema["items"].is_object() {
        rows(root, &schema["items"], &format!("{path}[]"), text, depth + 1);
    }
    if schema["additionalProperties"].is_object() {
        rows(root, &schema["additionalProperties"], &format!("{path}.*"), text, depth + 1);
    }
    for word in ["anyOf", "oneOf", "allOf"] {
        for option in schema[word].as_array().into_iter().flatten() {
            rows(root, option, path, text, depth + 1);
        }
    }
}

/// The schema that a reference leads to, or the schema itself.
fn resolved<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let to = schema["$ref"].as_str().and_then(|path| path.strip_prefix('#'));
    to.and_then(|path| root.pointer(path)).unwrap_or(schema)
}

/// The type of a value in words.
fn kind(root: &Value, schema: &Value, depth: usize) -> String {
    let schema = resolved(root, schema);
    if depth > DEPTH {
        return "…".into();
    }
    if let Some(value) = schema.get("const") {
        return format!("`{value}`");
    }
    if let Some(values) = schema["enum"].as_array() {
        return values.iter().map(|value| format!("`{value}`")).collect::<Vec<_>>().join(", ");
    }
    for word in ["anyOf", "oneOf"] {
        if let Some(options) = schema[word].as_array() {
            let mut kinds: Vec<String> = options.iter().map(|option| kind(root, option, depth + 1)).collect();
            kinds.dedup();
            return kinds.join(" or ");
        }
    }
    let name = match &schema["type"] {
        Value::String(name) => name.clone(),
        Value::Array(names) => names.iter().filter_map(Value::as_str).collect::<Vec<_>>().join(" or "),
        _ => String::from("any"),
    };
    match name.as_str() {
        "array" if schema["items"].is_object() => format!("array of {}", kind(root, &schema["items"], depth + 1)),
        _ => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_follow_lists_maps_and_references() {
        let schema: Value = serde_json::from_str(
            r##"{"properties": {"a": {"type": "array", "items": {"$ref": "#/$defs/b"}},
                "m": {"additionalProperties": {"properties": {"x": {"type": ["number", "null"]}}}}},
                "$defs": {"b": {"type": "object", "properties": {"c": {"const": 1, "description": "one | two"}}}}}"##,
        )
        .unwrap();
        let mut text = String::new();
        rows(&schema, &schema, "", &mut text, 0);
        let wanted = "| `a` | array of object |  |\n| `a[].c` | `1` | one \\| two |\n| `m` | any |  |\n\
                      | `m.*.x` | number or null |  |\n";
        assert_eq!(text, wanted);
    }
}

//! Values of a message as they stand in a case.

use serde_json::Value;
use std::fmt::Write;

/// A value on one line of TOML; what JSON has and TOML has not, null, is left out of tables and lists.
pub fn toml(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::Bool(_) | Value::Number(_) => value.to_string(),
        Value::String(text) => quoted(text),
        Value::Array(all) => {
            let all: Vec<String> = all.iter().filter(|value| !value.is_null()).map(toml).collect();
            format!("[{}]", all.join(", "))
        }
        Value::Object(table) => {
            let pairs = table.iter().filter(|(_, value)| !value.is_null());
            let pairs: Vec<String> = pairs.map(|(key, value)| format!("{} = {}", quoted(key), toml(value))).collect();
            format!("{{ {} }}", pairs.join(", "))
        }
    }
}

/// A basic string.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_a_page_sends_stays_one_value() {
        let table =
            json!({ "file": "a\"b\\c\n.csv", "none": null, "units": { "time": "us" }, "free": ["x", null, 1.5] });
        let wanted = r#"{ "file" = "a\"b\\c\u000A.csv", "free" = ["x", 1.5], "units" = { "time" = "us" } }"#;
        assert_eq!(toml(&table), wanted);
    }
}

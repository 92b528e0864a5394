//! `taut schema`: what it says of results and case files is what the program writes and reads.

use crate::common::{read, root, taut};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn json_of(args: &[&str]) -> Value {
    let output = taut(args);
    serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{args:?}: {e}: {output:?}"))
}

/// Why `value` does not follow `schema`, as far as our schemas go: the words of JSON Schema that they use, and no
/// others.
fn faults(value: &Value, schema: &Value, root: &Value, path: &str, found: &mut Vec<String>) {
    let known = [
        "type",
        "properties",
        "required",
        "additionalProperties",
        "items",
        "anyOf",
        "enum",
        "const",
        "$ref",
        "$defs",
        "minItems",
        "maxItems",
        "title",
        "description",
        "examples",
        "$schema",
        "$id",
    ];
    let words = schema.as_object().unwrap();
    assert!(words.keys().all(|word| known.contains(&word.as_str())), "{path}: {words:?}");
    if let Some(name) = words.get("$ref") {
        let name = name.as_str().unwrap().strip_prefix("#/$defs/").unwrap();
        return faults(value, &root["$defs"][name], root, path, found);
    }
    if let Some(ways) = words.get("anyOf") {
        let fits = |way: &Value| {
            let mut own = Vec::new();
            faults(value, way, root, path, &mut own);
            own.is_empty()
        };
        if !ways.as_array().unwrap().iter().any(fits) {
            found.push(format!("{path}: none of the ways: {value}"));
        }
        return;
    }
    let of_type = |kind: &Value| match kind.as_str().unwrap() {
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{other}"),
    };
    let typed = match words.get("type") {
        None => true,
        Some(Value::Array(kinds)) => kinds.iter().any(of_type),
        Some(kind) => of_type(kind),
    };
    let listed = words.get("enum").is_none_or(|all| all.as_array().unwrap().contains(value));
    let constant = words.get("const").is_none_or(|constant| constant == value);
    if !typed || !listed || !constant {
        found.push(format!("{path}: {value} is not {schema}"));
    }
    if let (Some(items), Some(list)) = (words.get("items"), value.as_array()) {
        for (k, item) in list.iter().enumerate() {
            faults(item, items, root, &format!("{path}[{k}]"), found);
        }
    }
    if let Some(object) = value.as_object() {
        let empty = Map::new();
        let properties = words.get("properties").map_or(&empty, |all| all.as_object().unwrap());
        for (key, value) in object {
            let path = format!("{path}.{key}");
            match (properties.get(key), words.get("additionalProperties")) {
                (Some(schema), _) => faults(value, schema, root, &path, found),
                (None, Some(Value::Bool(false))) => found.push(format!("{path}: no such key")),
                (None, Some(schema @ Value::Object(_))) => faults(value, schema, root, &path, found),
                (None, _) => {}
            }
        }
        for key in words.get("required").and_then(Value::as_array).into_iter().flatten() {
            if !object.contains_key(key.as_str().unwrap()) {
                found.push(format!("{path}: {key} is missing"));
            }
        }
    }
}

/// The version of a schema.
fn version(name: &str) -> u8 {
    if ["simulate", "modes"].contains(&name) { 2 } else { 1 }
}

fn follows(name: &str, value: &Value) {
    let schema = json_of(&["schema", name]);
    let mut found = Vec::new();
    faults(value, &schema, &schema, name, &mut found);
    assert!(found.is_empty(), "{name}: {found:#?}");
    assert_eq!(schema["$id"], json!(format!("urn:taut:{name}:{}", version(name))));
}

const TABLE4: &str = "stages/sollmann-jouaneh/table4.toml";
const PID: &str = "stages/sollmann-jouaneh/controllers/pid.toml";

#[test]
fn results_follow_their_schemas() {
    let folder = tempfile::tempdir().unwrap();
    let paper = folder.path().join("paper");
    let paper = paper.to_str().unwrap();
    let results: &[(&str, &[&str])] = &[
        ("simulate", &["simulate", TABLE4]),
        ("simulate", &["simulate", TABLE4, "--set", "belt.model=two-mass", "--set", "experiment.0.until=1ms"]),
        ("simulate", &["simulate", TABLE4, "--solver", "general", "--experiment", "5 V pulse"]),
        ("simulate", &["simulate", TABLE4, "--solver", "table3"]),
        ("simulate", &["simulate", "stages/core-xy/core-xy.toml"]),
        ("simulate", &["simulate", "stages/h-frame/follows.toml"]),
        ("simulate", &["simulate", "stages/dual-belt/dual-belt.toml"]),
        ("modes", &["modes", TABLE4, "--sample-time", "1ms", "--delay", "0s"]),
        ("modes", &["modes", "stages/laser-gantry/laser-gantry.toml", "--stuck", "cart"]),
        ("modes", &["modes", "stages/core-xy/follows.toml"]),
        ("modes", &["modes", "stages/dual-belt/follows.toml"]),
        ("modes", &["modes", "stages/h-frame/h-frame.toml", "--set", "belt.damping=[0,0,0]"]),
        ("move", &["move", PID, "--spread", "20%"]),
        ("sweep", &["sweep", TABLE4, "--runs", "9", "--vary", "all=10%"]),
        ("sweep", &["sweep", TABLE4, "--runs", "4", "--vary", "cart.mass=9%", "--design", "sobol", "--indices"]),
        ("sweep", &["sweep", TABLE4, "--design", "one-at-a-time", "--vary", "cart.mass=values(0.3, 0.4)"]),
        ("sweep", &["sweep", "stages/h-frame/h-frame.toml", "--runs", "3", "--vary", "all=10%"]),
        ("fit", &["fit", "stages/sollmann-jouaneh/identification/separate.toml"]),
        ("drift", &["fit", "stages/sollmann-jouaneh/identification/linear-5v.toml", "--drift"]),
        (
            "compare",
            &[
                "fit",
                "stages/sollmann-jouaneh/identification/linear-5v.toml",
                "--compare",
                "--laws",
                "viscous,coulomb",
                "--windows",
                "whole",
            ],
        ),
        ("check", &["check", "stages/sollmann-jouaneh/identification/separate.toml"]),
        ("shape", &["shape", "stages/printer-axis/printer-axis.toml"]),
        ("show", &["show", TABLE4]),
        ("export", &["export", "json", TABLE4]),
        ("export", &["export", "json", "stages/core-xy/follows.toml"]),
        ("export", &["export", "json", TABLE4, "--set", "belt.pretension=20 N"]),
        ("exported", &["export", "c", TABLE4]),
        ("exported", &["export", "st", PID]),
        ("show", &["show", "stages/core-xy/follows.toml"]),
        ("show", &["show", "stages/dual-belt/follows.toml"]),
        ("tune", &["tune", PID, "--evaluate"]),
        (
            "tune",
            &[
                "tune",
                "stages/sollmann-jouaneh/controllers/cascade.toml",
                "--set",
                "tune={cost=\"none\",bandwidth=\"2 Hz\"}",
            ],
        ),
        ("error", &["simulate", TABLE4, "--set", "cart.mass=-1 kg"]),
        ("paper", &["paper", "--no-report", "--out", paper]),
        ("error", &["modes", "none.toml"]),
    ];
    for (name, args) in results {
        follows(name, &json_of(&[args, &["--json"][..]].concat()));
    }
    let out = folder.path().join("modes");
    let out = out.to_str().unwrap();
    assert!(taut(&["modes", TABLE4, "--no-report", "--quiet", "--out", out]).status.success());
    let files = std::fs::read(folder.path().join("modes/files.json")).unwrap();
    follows("files", &serde_json::from_slice(&files).unwrap());
}

/// A command that is run on every case file of the project, in a few words; those that take long are left to another
/// test.
const COMMANDS: [&str; 13] = [
    "show CASE",
    "show CASE --set belt.model=rigid",
    "modes CASE",
    "modes CASE --set belt.model=rigid",
    "simulate CASE",
    "simulate CASE --solver general --set experiment.0.until=1ms",
    "move CASE",
    "move CASE --set motor.resistance=1e9",
    "tune CASE --evaluate",
    "sweep CASE --runs 2 --vary all=5%",
    "frf CASE",
    "export json CASE",
    "export c CASE",
];

/// Those that search.
const SEARCHES: [&str; 9] = [
    "check CASE",
    "fit CASE",
    "fit CASE --drift",
    "fit CASE --compare --laws viscous,coulomb --windows whole",
    "design CASE --input prbs --verify 1",
    "tune CASE",
    "plan CASE",
    "shape CASE",
    "export fmu CASE",
];

/// Runs the commands on all cases, or one in so many of these calls, on all processors; each prints what follows the
/// schema that it names, be it an error. Returns how many printed a result.
fn follow_on_every_case(commands: &[&str], one_in: usize) -> usize {
    use rayon::prelude::*;
    let root = root();
    let mut files = Vec::new();
    cases(&root.join("stages"), &mut files);
    let calls: Vec<(&str, &PathBuf)> =
        commands.iter().flat_map(|command| files.iter().map(move |file| (*command, file))).step_by(one_in).collect();
    let schemas: BTreeMap<String, Value> = String::from_utf8(taut(&["schema"]).stdout)
        .unwrap()
        .lines()
        .skip(1)
        .filter_map(|line| line.split_whitespace().next())
        .map(|name| (name.to_string(), json_of(&["schema", name])))
        .collect();
    let told: Vec<(bool, Vec<String>)> = calls
        .par_iter()
        .map(|(command, file)| {
            let file = file.strip_prefix(&root).unwrap().to_str().unwrap();
            let words: Vec<&str> = command.split(' ').map(|word| if word == "CASE" { file } else { word }).collect();
            let value = json_of(&[&words[..], &["--json"]].concat());
            let name = value["schema"].as_str().and_then(|word| word.split('/').nth(1)).unwrap_or_default();
            let mut found = Vec::new();
            match schemas.get(name) {
                Some(schema) => faults(&value, schema, schema, name, &mut found),
                None => found.push(format!("no schema: {:?}", value["schema"])),
            }
            (name != "error", found.into_iter().map(|fault| format!("{}: {fault}", words.join(" "))).collect())
        })
        .collect();
    let found: Vec<&String> = told.iter().flat_map(|(_, found)| found).collect();
    assert!(found.is_empty(), "{found:#?}");
    told.iter().filter(|(is_result, _)| *is_result).count()
}

/// A rigid belt has no stiffness: `show`, `modes` and `simulate` printed null where their schemas had numbers.
#[test]
fn every_command_follows_its_schema_on_every_case() {
    assert!(follow_on_every_case(&COMMANDS, 1) > 150);
}

/// One call in 17; with `TAUT_CASES=all` every case of the project is fitted and tuned, which takes minutes.
#[test]
fn searches_follow_their_schemas() {
    let all = std::env::var("TAUT_CASES").is_ok_and(|cases| cases == "all");
    let results = follow_on_every_case(&SEARCHES, if all { 1 } else { 17 });
    assert!(results > if all { 50 } else { 3 }, "{results}");
}

/// An option that does not exist was told to people alone.
#[test]
fn wrong_options_are_json_too() {
    for words in [
        "simulate CASE --json --nope",
        "simulate --json",
        "--json",
        "simulated CASE --json",
        "simulate CASE --json --quiet",
        "simulate CASE --solver best --json",
        "sweep CASE --runs --json",
        "sweep CASE --json --threads many",
        "export cobol CASE --json",
        "export c CASE --real half --json",
        "move CASE --json --spread 300%",
        "tune CASE --json --effort",
        "modes CASE --png --json",
        "init axis.toml --json",
        "paper --json --set a=1",
        "simulate CASE CASE --json",
    ] {
        let words: Vec<&str> = words.split(' ').map(|word| if word == "CASE" { TABLE4 } else { word }).collect();
        let output = taut(&words);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {output:?}");
        let value: Value =
            serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{words:?}: {e}: {output:?}"));
        follows("error", &value);
        assert_eq!(value["status"], 2, "{words:?}");
        assert!(!value["error"]["what"].as_str().unwrap().is_empty(), "{words:?}");
        let told = String::from_utf8(output.stderr).unwrap();
        assert!(told.starts_with("error: "), "{words:?}: {told}");
    }
    // A word behind `--` is no option.
    let output = taut(&["simulate", "--nope", "--", "--json"]);
    assert!(output.status.code() == Some(2) && output.stdout.is_empty(), "{output:?}");
}

#[test]
fn every_schema_is_listed_and_an_unknown_one_is_refused() {
    let listed = String::from_utf8(taut(&["schema"]).stdout).unwrap();
    let names: Vec<&str> = listed.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 10 && names[0] == "case", "{names:?}");
    for name in names {
        assert_eq!(json_of(&["schema", name])["$id"], json!(format!("urn:taut:{name}:{}", version(name))));
    }
    let wrong = taut(&["schema", "cases"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8(wrong.stderr).unwrap().contains("there is no schema \"cases\"\n  allowed: case, "));
}

// ── The case file ──────────────────────────────────────────────────────────────────────────────

fn data(item: &toml_edit::Item) -> Value {
    match item {
        toml_edit::Item::None => Value::Null,
        toml_edit::Item::Value(value) => data_of(value),
        toml_edit::Item::Table(table) => table.iter().map(|(key, item)| (key.to_string(), data(item))).collect(),
        toml_edit::Item::ArrayOfTables(tables) => {
            tables.iter().map(|table| data(&toml_edit::Item::Table(table.clone()))).collect()
        }
    }
}

fn data_of(value: &toml_edit::Value) -> Value {
    use toml_edit::Value as Toml;
    match value {
        Toml::String(text) => json!(text.value()),
        Toml::Integer(number) => json!(number.value()),
        // TOML has numbers that JSON has not.
        Toml::Float(number) => json!(number.value()),
        Toml::Boolean(flag) => json!(flag.value()),
        Toml::Datetime(time) => json!(time.value().to_string()),
        Toml::Array(list) => list.iter().map(data_of).collect(),
        Toml::InlineTable(table) => table.iter().map(|(key, value)| (key.to_string(), data_of(value))).collect(),
    }
}

fn case(text: &str) -> Value {
    let document: toml_edit::DocumentMut = text.parse().unwrap();
    data(document.as_item())
}

fn cases(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => cases(&path, found),
            false if path.extension().is_some_and(|ending| ending == "toml") => found.push(path),
            false => {}
        }
    }
}

#[test]
fn every_case_file_of_the_project_follows_the_schema() {
    let root = root();
    let mut files = Vec::new();
    cases(&root.join("stages"), &mut files);
    assert!(files.len() > 25, "{}", files.len());
    for file in files {
        follows("case", &case(&std::fs::read_to_string(&file).unwrap()));
    }
    follows("case", &case(taut::case::TEMPLATE));
}

#[test]
fn what_is_wrong_by_its_form_does_not_follow_the_schema() {
    let schema = json_of(&["schema", "case"]);
    let text = read(TABLE4);
    let right = case(&text);
    let changes: [(&str, Value); 8] = [
        ("/cart/mas", json!(1)),
        ("/cart/mass", json!(true)),
        ("/belt/model", json!("springy")),
        ("/kind", json!("gantry")),
        ("/experiment/0/input", json!({ "stepp": "5 V" })),
        ("/experiment/0/input", json!({ "step": "5 V", "for": "1 s" })),
        ("/motor", json!("a motor")),
        ("/fit", json!({ "free": "cart.mass" })),
    ];
    for (path, value) in changes {
        let mut wrong = right.clone();
        let (parent, key) = path.rsplit_once('/').unwrap();
        wrong.pointer_mut(parent).unwrap().as_object_mut().unwrap().insert(key.into(), value);
        let mut found = Vec::new();
        faults(&wrong, &schema, &schema, "case", &mut found);
        assert!(!found.is_empty(), "{path}");
    }
}

/// The keys that a table may have, as the reader says them, are those of the schema.
#[test]
fn the_schema_has_the_keys_that_the_reader_has() {
    let schema = json_of(&["schema", "case"]);
    let tables = [
        ("motor", "/motor"),
        ("amplifier", "/amplifier"),
        ("drive_pulley", "/drive_pulley"),
        ("idler_pulley", "/idler_pulley"),
        ("belt", "/belt"),
        ("travel", "/travel"),
        ("encoder", "/encoder"),
        ("measurement", "/measurement"),
        ("experiment.0", "/experiment/items"),
        ("experiment.0.initial", ""),
        ("cart.friction", "/friction"),
        ("drive_pulley.friction", "/pulley_friction"),
        ("cart.friction.lugre", ""),
        ("controller", "/controller"),
        ("controller.pid", "/controller/properties/pid"),
        ("move.0", "/move/items"),
        ("tune", "/tune"),
        ("sweep", "/sweep"),
        ("fit", "/fit"),
    ];
    let mut compared = 0;
    for (table, path) in tables {
        let file = if ["controller", "move", "tune"].iter().any(|word| table.starts_with(word)) { PID } else { TABLE4 };
        let error = json_of(&["simulate", file, "--json", "--set", &format!("{table}.zzz=1")]);
        let told = error["error"]["allowed"].as_str().unwrap_or_else(|| panic!("{table}: {error}"));
        let read: BTreeSet<&str> = told.split(", ").collect();
        assert!(error["error"]["what"].as_str().unwrap().contains("has no key `zzz`"), "{table}: {error}");
        let place = match path {
            "" => continue,
            path if path.contains("friction") => schema.pointer(&format!("/$defs{path}")),
            path => schema.pointer(&format!("/properties{path}")),
        };
        let place = place.unwrap_or_else(|| panic!("{table}: {path}"));
        let listed: BTreeSet<&str> = place["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(read, listed, "{table}");
        compared += 1;
    }
    assert!(compared > 15);
}

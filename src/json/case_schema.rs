//! The JSON Schema of the case file, for editors: what can stand where, made from the table of parameters.
//!
//! It says what a reader refuses by its form: keys that are none, a text for a table. What depends on other values (a
//! breakaway below the Coulomb friction) only reading says.

use crate::design::FeedForwardModel;
use crate::log::PRESETS;
use crate::machine::{BELTS, MachineKind, Quantity};
use crate::parameter::{self, Fallback, Parameter};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// The schema, as JSON Schema draft 2020-12. Its `$id` is `urn:taut:case:1`: editors refuse one that is no whole URI.
pub fn case_schema() -> Value {
    let mut schema = object(&root());
    let head = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": super::address("case"),
        "title": "A case file of taut",
        "description": "A belt-driven machine in TOML, and what is done with it.",
        "$defs": { "input": input(), "friction": friction("cart.friction"), "pulley_friction": friction("drive_pulley.friction") },
    });
    if let (Value::Object(schema), Value::Object(head)) = (&mut schema, head) {
        schema.extend(head);
    }
    schema
}

type Properties = Map<String, Value>;

/// A table with these keys and no others.
fn object(properties: &Properties) -> Value {
    json!({ "type": "object", "additionalProperties": false, "properties": properties })
}

/// The same where it says something of its own.
fn described(mut schema: Value, words: &str) -> Value {
    schema["description"] = json!(words);
    schema
}

/// A number of the table of parameters: bare in SI units, or a text with its unit.
fn number(row: &Parameter) -> Value {
    let unit = if row.unit.is_empty() { "a pure number".to_string() } else { format!("in {}", row.unit) };
    let default = match row.default {
        Fallback::Required => "required".to_string(),
        Fallback::Value(value) => format!("default {}", crate::quantity::rounded(value)),
        Fallback::Words(words) => format!("default: {words}"),
    };
    let mut schema = json!({
        "type": ["number", "string"],
        "description": format!("{} ({unit}; {default})", row.sentence.trim_end_matches('.')),
    });
    if !row.example.is_empty() {
        schema["examples"] = json!([row.example]);
    }
    schema
}

/// A number in SI units or a text with its unit, which no row describes.
fn plain() -> Value {
    json!({ "type": ["number", "string"] })
}

/// The number of this name, or a list: of the spans of a belt, or the coordinates of a gantry.
fn each(key: &str) -> Value {
    any(vec![parameter::named(key).map_or_else(plain, number), list(plain())])
}

fn words<'a>(words: impl IntoIterator<Item = &'a str>) -> Value {
    json!({ "enum": words.into_iter().collect::<Vec<_>>() })
}

fn list(of: Value) -> Value {
    json!({ "type": "array", "items": of })
}

fn any(of: Vec<Value>) -> Value {
    json!({ "anyOf": of })
}

/// The keys of a section: its numbers and the tables in it, with `own` in the place of some, or beside them.
fn keys(section: &str, own: &[(&str, Value)]) -> Properties {
    let mut properties = Properties::new();
    for name in parameter::names_in(section) {
        let key = format!("{section}.{name}");
        let schema = match (own.iter().find(|(own, _)| *own == name), parameter::named(&key)) {
            (Some((_, schema)), _) => schema.clone(),
            (None, Some(row)) => number(row),
            (None, None) => object(&keys(&key, &[])),
        };
        properties.insert(name.to_string(), schema);
    }
    for (name, schema) in own {
        properties.entry(*name).or_insert_with(|| schema.clone());
    }
    properties
}

fn table(section: &str, own: &[(&str, Value)]) -> Value {
    object(&keys(section, own))
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

fn root() -> Properties {
    let text = |words: &str| described(json!({ "type": "string" }), words);
    let amplifier = || table("amplifier", &[("mode", words(["voltage", "current"]))]);
    let drive = || {
        let own = [("motor", table("motor", &[])), ("amplifier", amplifier())].map(|(k, v)| (k.to_string(), v));
        object(&own.into_iter().collect())
    };
    let tables = [
        ("title", text("What the file describes")),
        ("kind", described(words(MachineKind::ALL.map(MachineKind::word)), "Which machine it is (default: axis)")),
        ("motor", table("motor", &[])),
        ("drive", described(table("drive", &[]), "Instead of [motor]: a drive of which only the force is known")),
        ("amplifier", amplifier()),
        (
            "stepper",
            described(
                table(
                    "stepper",
                    &[("drive", words(["chopper", "voltage"])), ("interpolate", json!({ "type": "boolean" }))],
                ),
                "Instead of [motor] and [amplifier]: a stepper that follows a position",
            ),
        ),
        ("left_drive", described(drive(), "Gantry: differences at the left drive")),
        ("right_drive", described(drive(), "Gantry: differences at the right drive")),
        ("cart_drive", described(drive(), "Dual belt: differences at the cart's drive")),
        ("drive_pulley", pulley("drive_pulley")),
        ("idler_pulley", pulley("idler_pulley")),
        ("bridge", slide("bridge")),
        ("cart", cart()),
        ("belt", belt()),
        ("travel", table("travel", &[])),
        ("encoder", table("encoder", &[("at", words(["motor", "drive_pulley", "cart"]))])),
        ("scale", table("scale", &[])),
        ("measurement", table("measurement", &[])),
        ("experiment", list(experiment())),
        ("controller", controller()),
        ("move", list(motion())),
        ("fit", fit()),
        ("tune", table("tune", &[("cost", words(["squares", "peak", "bandwidth", "none"])), ("load", list(plain()))])),
        ("uncertainty", described(json!({ "type": "object" }), "Values and intervals of fitted parameters")),
        ("sweep", sweep()),
    ];
    tables.map(|(name, schema)| (name.to_string(), schema)).into_iter().collect()
}

fn pulley(section: &str) -> Value {
    let cylinder = format!("{section}.inertia");
    let inertia = match parameter::named(&cylinder) {
        Some(row) => any(vec![number(row), table(&cylinder, &[])]),
        None => plain(),
    };
    table(section, &[("inertia", inertia), ("friction", reference("pulley_friction"))])
}

/// The bridge of a gantry.
fn slide(section: &str) -> Value {
    let line = described(list(list(plain())), "Points [speed, force]");
    table(section, &[("friction", reference("friction")), ("force_by_speed", line)])
}

/// Of an axis and of a gantry, whose cart has a travel of its own.
fn cart() -> Value {
    let line = |words: &str| described(list(list(plain())), words);
    table(
        "cart",
        &[
            ("friction", reference("friction")),
            ("travel", table("travel", &[])),
            ("force_along", line("Points [position, force] along the travel")),
            ("force_by_speed", line("Points [speed, force]")),
        ],
    )
}

fn friction(section: &str) -> Value {
    let shape = ("shape", words(["gaussian", "exponential"]));
    let mut own = vec![("stribeck", table(&format!("{section}.stribeck"), &[shape]))];
    if section.starts_with("cart") {
        own.push(("along", described(list(list(plain())), "Points [position, factor] along the travel")));
    }
    table(section, &own)
}

fn belt() -> Value {
    let row = |key: &str| parameter::named(key).map_or_else(plain, number);
    table(
        "belt",
        &[
            ("stiffness", each("belt.stiffness")),
            ("damping", each("belt.damping")),
            ("spans", list(plain())),
            ("modulus", any(vec![row("belt.modulus"), list(table("belt.modulus", &[]))])),
            ("section", any(vec![row("belt.section"), table("belt.section", &[])])),
            (
                "type",
                described(words(BELTS.iter().map(|belt| belt.name)), "Type of the belt, whose numbers the program has"),
            ),
            ("model", words(["elastic", "two-mass", "rigid"])),
            ("follows_cart", json!({ "type": "boolean" })),
        ],
    )
}

/// An input: the key of one kind, and what belongs to it.
fn input() -> Value {
    let kind = |name: &str, own: &[(&str, Value)]| {
        let section = format!("input.{name}");
        let main = parameter::named(&section).map_or_else(plain, number);
        let mut properties = keys(&section, own);
        properties.entry(name).or_insert(main);
        properties.insert("lasts".into(), parameter::named("input.element.lasts").map_or_else(plain, number));
        let mut schema = object(&properties);
        schema["required"] = json!([name]);
        schema
    };
    let inputs = || list(reference("input"));
    let points = described(list(list(plain())), "Points [time, value]");
    let column = || json!({ "type": ["string", "integer"] });
    let file = [
        ("file", json!({ "type": "string" })),
        ("time", column()),
        ("column", column()),
        ("hold", words(["zero", "linear"])),
        ("unit", json!({ "type": "string" })),
    ];
    let multisine = [("frequencies", list(plain()))];
    any(vec![
        kind("step", &[]),
        kind("pulse", &[]),
        kind("ramp", &[]),
        kind("triangle", &[]),
        kind("square", &[]),
        kind("sine", &[]),
        kind("chirp", &[]),
        kind("multisine", &multisine),
        kind("prbs", &[]),
        kind("table", &[("table", points)]),
        kind("file", &file),
        kind("sum", &[("sum", inputs())]),
        kind("sequence", &[("sequence", inputs())]),
    ])
}

/// Sides of the drives of gantries, each once.
fn sides() -> BTreeSet<&'static str> {
    let gantries = MachineKind::ALL.into_iter().filter(|kind| *kind != MachineKind::Axis);
    gantries.flat_map(|kind| kind.geometry().sides()).collect()
}

fn experiment() -> Value {
    let initial = {
        let mut both = keys("experiment.initial", &[]);
        both.extend(keys("gantry.initial", &[]));
        object(&both)
    };
    let sides = sides().into_iter().map(|side| (side.to_string(), reference("input"))).collect();
    table(
        "experiment",
        &[
            ("name", json!({ "type": "string" })),
            ("input", any(vec![reference("input"), object(&sides)])),
            ("initial", initial),
            ("log", log()),
            ("campaign", json!({ "type": "string" })),
        ],
    )
}

fn log() -> Value {
    let column = || json!({ "type": ["string", "integer"] });
    let values = any(vec![plain(), list(plain())]);
    let filter = [("column", column()), ("is", values.clone()), ("is_not", values)];
    let columns = || json!({ "type": "object" });
    let mut own = vec![
        ("file", json!({ "type": "string" })),
        ("fetch", described(json!({ "type": "string" }), "Command that downloads the file if it is missing")),
        ("preset", words(PRESETS.iter().map(|preset| preset.name))),
        ("time", any(vec![column(), table("experiment.log.time", &[])])),
        ("added", column()),
        ("reference", column()),
        ("units", columns()),
        ("scale", columns()),
        ("offset", columns()),
        ("absolute", list(words(Quantity::all().map(Quantity::name)))),
        ("where", object(&filter.map(|(name, schema)| (name.to_string(), schema)).into_iter().collect())),
        ("split", column()),
        ("hold", words(["zero", "linear"])),
        ("missing_input", words(["refuse", "hold"])),
        ("separator", json!({ "type": "string" })),
        ("decimal", words([".", ","])),
    ];
    let drives = MachineKind::ALL.iter().flat_map(|kind| kind.geometry().drives);
    own.extend(drives.map(|drive| (drive.input, column())));
    own.extend(Quantity::all().map(|quantity| (quantity.name(), column())));
    table("experiment.log", &own)
}

fn controller() -> Value {
    let rule = json!({ "type": "number" });
    let feed_forward = [
        ("model", words(FeedForwardModel::ALL.map(FeedForwardModel::word))),
        ("compensate_stretch", json!({ "type": "boolean" })),
    ];
    table(
        "controller",
        &[
            ("fuzzy", table("controller.fuzzy", &[("rules", list(list(rule)))])),
            ("feed_forward", table("controller.feed_forward", &feed_forward)),
            ("filters", list(table("controller.filters", &[]))),
            ("shaper", described(list(list(plain())), "Impulses [time, amplitude], together 1")),
        ],
    )
}

fn motion() -> Value {
    let clockwise = described(json!({ "type": "boolean" }), "Sense of an arc");
    let at = table(
        "move.points",
        &[("to", each("move.points.to")), ("center", each("move.points.center")), ("clockwise", clockwise)],
    );
    let point = any(vec![plain(), list(plain()), at]);
    table(
        "move",
        &[
            ("name", json!({ "type": "string" })),
            ("from", each("move.from")),
            ("to", each("move.to")),
            ("gcode", json!({ "type": "string" })),
            ("points", list(point)),
        ],
    )
}

fn fit() -> Value {
    let names = || list(json!({ "type": "string" }));
    let pair = || json!({ "type": "array", "items": plain(), "minItems": 2, "maxItems": 2 });
    let prior = ["normal", "log_normal", "uniform"].map(|name| (name.to_string(), pair())).into_iter().collect();
    let scope = || json!({ "enum": [true, false, "shared"] });
    let flag = || json!({ "type": "boolean" });
    let nuisance = [
        ("delay", scope()),
        ("drive_delay", words(sides())),
        ("input_gain", scope()),
        ("input_offset", scope()),
        ("initial_state", flag()),
        ("bias", flag()),
        ("sensor_play", words(Quantity::all().filter(|own| own.is_position()).map(Quantity::name))),
    ];
    table(
        "fit",
        &[
            ("free", names()),
            ("tied", list(names())),
            ("lumped", names()),
            ("bounds", json!({ "type": "object", "additionalProperties": pair() })),
            ("priors", json!({ "type": "object", "additionalProperties": object(&prior) })),
            ("nuisance", object(&nuisance.map(|(name, schema)| (name.to_string(), schema)).into_iter().collect())),
            ("loss", words(["squares", "huber"])),
            ("held_out", names()),
            ("loop", words(["logged", "closed"])),
            ("separate", names()),
            ("per", words(["campaign", "log"])),
        ],
    )
}

fn sweep() -> Value {
    let pair = || json!({ "type": "array", "items": plain(), "minItems": 2, "maxItems": 2 });
    let way = [
        ("share", plain()),
        ("uniform", pair()),
        ("normal", pair()),
        ("log_normal", pair()),
        ("values", list(plain())),
        ("grid", list(plain())),
        ("factors", list(plain())),
        ("within", pair()),
    ];
    let way = object(&way.map(|(name, schema)| (name.to_string(), schema)).into_iter().collect());
    let vary =
        json!({ "type": "object", "additionalProperties": any(vec![json!({ "type": "string" }), list(plain()), way]) });
    table(
        "sweep",
        &[
            ("design", words(["random", "latin-hypercube", "sobol", "grid", "one-at-a-time"])),
            ("vary", vary),
            ("from", json!({ "type": "string" })),
            ("indices", json!({ "type": "boolean" })),
            ("figures", json!({ "type": "array", "items": { "type": "string" }, "minItems": 1 })),
            ("solver", words(["lanes", "exact"])),
        ],
    )
}

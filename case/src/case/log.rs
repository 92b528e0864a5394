//! The log of an experiment:
//! `log = { file = "pulse5.csv", time = "time_s", input = "voltage_V", drive_angle = "angle_rad" }`.

use super::files::Folder;
use super::reader::{Field, Table};
use super::tree::NodeValue;
use crate::error::{Error, Result};
use crate::log::{Clock, ColumnId, Dialect, Fed, Filter, In, Log, Mapping, PRESETS, Preset, Quantity, Source, Unit};
use crate::machine::{self, BeltModel, Machine};
use crate::parameter::Parameter;
use crate::quantity::{self, shortest};
use crate::signal::Hold;
use std::f64::consts::TAU;

/// Keys of the table beside the inputs and quantities of the machine.
const KEYS: &[&str] = &[
    "file",
    "fetch",
    "preset",
    "added",
    "reference",
    "units",
    "scale",
    "offset",
    "absolute",
    "where",
    "split",
    "hold",
    "missing_input",
    "separator",
    "decimal",
];

/// Reads the runs of a log; `driven` says that the experiment has an input of its own.
pub(super) fn logs(
    field: &Field,
    machine: &Machine,
    folder: &Folder,
    driven: bool,
) -> Result<Vec<(Option<String>, Log)>> {
    let table = field.table()?;
    let keys: Vec<&str> = KEYS.iter().copied().chain(columns_of(machine.kind)).collect();
    let is_of_another = |key: &&str| {
        !keys.contains(key) && machine::MachineKind::ALL.into_iter().flat_map(columns_of).any(|own| own == *key)
    };
    if let Some(field) = table.keys().find(is_of_another).and_then(|key| table.optional(key)) {
        let what = format!("the log of this machine ({}) has no `{}`", machine.kind.name(), field.key());
        return Err(field.fail(what).allowed(columns_of(machine.kind).collect::<Vec<_>>().join(", ")));
    }
    table.check_keys(&keys, &[])?;
    if let Some(field) = ["preset", "added", "reference"].iter().find_map(|key| table.optional(key))
        && !machine.has_one_coordinate()
    {
        return Err(field.fail("this is for the log of a single axis").next(match field.key() {
            "preset" => "name the columns of the gantry's drives: left_input, right_input, left_angle and so on",
            _ => "leave it out: fits of gantries take the inputs as they were logged",
        }));
    }
    let file = table.required("file", "file = \"...\" with the path of the log")?;
    let path = folder.name(&file)?;
    let fetch = table.optional("fetch").map(|field| field.text()).transpose()?;
    let missing = |error: Error| match &fetch {
        Some(line) if !path.exists() => error.next(format!("`{line}` fetches it")),
        _ => error,
    };
    let known: Vec<(&str, &Preset)> = PRESETS.iter().map(|preset| (preset.name, preset)).collect();
    let preset = table.optional("preset").map(|field| field.choice(&known)).transpose()?;
    let mut columns = match preset {
        Some(preset) => folder.read(&file, &path, || preset.columns_of(&path)).map_err(missing)?,
        None => Vec::new(),
    };
    // What was meant goes before what was logged, unless the table names a column itself.
    columns.retain(|(key, ..)| *key != "input" || !driven);
    let sources = Sources::new(&table, columns, machine)?;

    let inputs = inputs(field, &table, &sources, driven)?;
    let added = sources.source("added", field.input_unit)?;
    if let (Some(_), true, Some(field)) = (&added, inputs.is_empty(), table.optional("added")) {
        return Err(field
            .fail("this is added to a logged input, and the log has none")
            .next("name the column of the controller's output: input = \"...\""));
    }
    let outputs = outputs(field, &table, &sources)?;
    let time = clock(&table, &sources)?;
    let (from, to) = (table.number_if_given("from")?, table.number_if_given("to")?);
    if let (Some(from), Some(to), Some(field)) = (from, to, table.optional("to"))
        && to <= from
    {
        let (from, to) = (quantity::show(from, "s"), quantity::show(to, "s"));
        return Err(field.fail(format!("{to} does not come after `from`, {from}")));
    }
    let word = |key: &str, words: &[(&str, bool)]| table.optional(key).map_or(Ok(false), |field| field.choice(words));
    let linear = word("hold", &[("zero", false), ("linear", true)])?;
    let dialect = Dialect {
        separator: table.optional("separator").map(|field| separator(&field)).transpose()?,
        decimal_comma: word("decimal", &[(".", false), (",", true)])?,
    };
    let mapping = Mapping {
        file: path.clone(),
        time,
        inputs,
        hold_missing: word("missing_input", &[("refuse", false), ("hold", true)])?,
        absolute: absolute(&table, &outputs)?,
        outputs,
        added,
        reference: sources.source("reference", "m")?,
        hold: if linear { Hold::Linear } else { Hold::Zero },
        from,
        to,
        filter: table.optional("where").map(|field| filter(&field)).transpose()?,
        split: table.optional("split").map(|field| column(&field)).transpose()?,
        dialect,
        preset,
    };
    folder.read(&file, &path, || mapping.read()).map_err(missing)
}

/// Keys of the columns that a log of this kind of machine can name, except time: drive inputs, then quantities.
fn columns_of(kind: machine::MachineKind) -> impl Iterator<Item = &'static str> + Clone {
    let inputs = kind.geometry().drives.iter().map(|drive| drive.input);
    inputs.chain(Quantity::for_kind(kind).iter().map(|quantity| quantity.name()))
}

/// The column of each drive's input, unless the experiment has inputs of its own.
fn inputs(field: &Field, table: &Table, sources: &Sources, driven: bool) -> Result<Vec<Fed>> {
    let mut inputs = Vec::new();
    for (at, drive) in sources.machine.geometry().drives.iter().zip(&sources.machine.drives) {
        let unit = drive.amplifier.mode.unit();
        match (sources.source(at.input, unit)?, driven) {
            (None, false) => {
                let key = at.input;
                let wanted =
                    format!("{key} = \"...\" with the name of the input's column; or an input to the experiment");
                return Err(table.missing(key, &wanted));
            }
            (Some(_), true) => {
                let field = table.optional(at.input).unwrap_or_else(|| field.clone());
                return Err(field
                    .fail("the experiment has an input already")
                    .next("leave out one of them: the logged input or the experiment's own"));
            }
            (Some(source), false) => inputs.push(Fed { key: at.input, unit, source }),
            (None, true) => {}
        }
    }
    Ok(inputs)
}

/// The columns of what was measured; at least one.
fn outputs(field: &Field, table: &Table, sources: &Sources) -> Result<Vec<(Quantity, Source)>> {
    let mut outputs = Vec::new();
    for &quantity in sources.machine.quantities() {
        if quantity == Quantity::CartAcceleration
            && sources.machine.belt.model == BeltModel::Rigid
            && sources.is_named(quantity.name())
        {
            let field = table.optional(quantity.name()).unwrap_or_else(|| field.clone());
            return Err(field
                .fail("a rigid belt has no force at the cart, from which its acceleration would be computed")
                .next("write model = \"elastic\" in [belt], or leave the accelerometer out"));
        }
        if quantity.is_acceleration() && sources.machine.yaw.is_some() && sources.is_named(quantity.name()) {
            let field = table.optional(quantity.name()).unwrap_or_else(|| field.clone());
            return Err(field
                .fail("accelerations of a gantry whose bridge yaws cannot be compared yet")
                .next("leave the accelerometer out, or [bridge.yaw]"));
        }
        outputs.extend(sources.source(quantity.name(), quantity.unit())?.map(|source| (quantity, source)));
    }
    if outputs.is_empty() {
        let names: Vec<&str> = sources.machine.quantities().iter().map(|quantity| quantity.name()).collect();
        let such_as = if sources.machine.has_one_coordinate() { "drive_angle" } else { "left_angle" };
        return Err(field
            .fail("nothing measured is named")
            .allowed(names.join(", "))
            .next(format!("add for example {such_as} = \"...\" with the name of its column")));
    }
    Ok(outputs)
}

/// The columns of a log, and what makes their numbers SI.
struct Sources<'a> {
    table: &'a Table<'a>,
    units: Option<Table<'a>>,
    scale: Option<Table<'a>>,
    offset: Option<Table<'a>>,
    /// The columns that a preset knows.
    columns: Vec<(&'static str, ColumnId, In)>,
    machine: &'a Machine,
    steps_per_turn: f64,
}

impl<'a> Sources<'a> {
    fn new(table: &'a Table<'a>, known: Vec<(&'static str, ColumnId, In)>, machine: &'a Machine) -> Result<Self> {
        let part = |key: &str| table.optional(key).map(|field| field.table()).transpose();
        let steps_per_turn = table.number("steps_per_turn")?;
        if let Some(field) = table.optional("steps_per_turn")
            && !known.iter().any(|(.., of)| *of == In::MotorSteps)
        {
            let error = field.fail("no column of this log counts in steps");
            return Err(error.next("leave it out, or name the preset whose file counts in them"));
        }
        let (units, scale, offset) = (part("units")?, part("scale")?, part("offset")?);
        let sources = Self { units, scale, offset, table, columns: known, machine, steps_per_turn };
        for part in [&sources.units, &sources.scale, &sources.offset].into_iter().flatten() {
            let columns = ["time", "added", "reference"].into_iter().chain(columns_of(machine.kind));
            let named: Vec<&'static str> = columns.clone().filter(|key| sources.is_named(key)).collect();
            // A quantity without a column, rather than a word that is none.
            let other = part.keys().find(|key| !named.contains(key) && columns.clone().any(|column| column == *key));
            if let Some(field) = other.and_then(|key| part.optional(key)) {
                let error = field.fail("the log names no column for this").allowed(named.join(", "));
                return Err(error.next(format!("name its column: {} = \"...\"", field.key())));
            }
            part.check_keys(&named, &[])?;
        }
        Ok(sources)
    }

    /// True if there is a column of this, by the table or a preset.
    fn is_named(&self, key: &str) -> bool {
        self.table.optional(key).is_some() || self.columns.iter().any(|(own, ..)| *own == key)
    }

    fn source(&self, key: &str, unit: &'static str) -> Result<Option<Source>> {
        let (column, known) = match (self.table.optional(key), self.columns.iter().find(|(own, ..)| *own == key)) {
            (Some(field), _) => (column(&field)?, None),
            (None, Some((_, column, of))) => (column.clone(), self.known_unit(key, *of)),
            (None, None) => return Ok(None),
        };
        let number = |part: &Option<Table>, unit: &'static str, example: &'static str| {
            let field = part.as_ref().and_then(|part| part.optional(key));
            field.map(|field| field.number_of(&Parameter { unit, example, ..NUMBER })).transpose()
        };
        let given = self.units.as_ref().and_then(|units| units.optional(key));
        if let (None, Some(Unit::Name(known)), Some(preset)) = (&given, &known, self.table.optional("preset"))
            && quantity::read(&format!("1 {known}"), unit).is_err()
        {
            let error = preset.fail(format!("its {key} is in {known}; expected {unit}")).allowed(unit);
            return Err(error.next(match key {
                "input" => format!(
                    "correct `mode` of [amplifier], name the column of another input, or say units = {{ input = \"{unit}\" }}"
                ),
                _ => format!("say what it is: units = {{ {key} = \"{unit}\" }}"),
            }));
        }
        Ok(Some(Source {
            column,
            unit: given.map(|field| self.unit(&field, unit)).transpose()?.or(known),
            scale: number(&self.scale, "", "-1")?.unwrap_or(1.0),
            offset: number(&self.offset, unit, example(unit))?.unwrap_or(0.0),
        }))
    }

    /// The unit of a preset's column: of turns and steps of the motor, one of them behind the gear.
    fn known_unit(&self, key: &str, of: In) -> Option<Unit> {
        let turn = match key {
            "reference" => TAU * self.machine.pulley_radius,
            _ => TAU,
        } / self.machine.drives[0].motor.gear_ratio;
        match of {
            In::Own => None,
            In::Unit(name) => Some(Unit::Name(name.to_string())),
            In::MotorTurns => Some(Unit::Factor(turn)),
            In::MotorSteps => Some(Unit::Factor(turn / self.steps_per_turn)),
        }
    }

    fn unit(&self, field: &Field, unit: &str) -> Result<Unit> {
        let text = field.text()?;
        if matches!(text, "count" | "counts") {
            return self.count(field).map(Unit::Factor);
        }
        match quantity::read(&format!("1 {text}"), unit) {
            Ok(_) => Ok(Unit::Name(text.to_string())),
            Err(e) => {
                let what = format!("\"{text}\" is not a unit of this column: expected one convertible to {unit}");
                let such_as =
                    format!("write for example {} = \"{}\"", field.key(), example(unit).trim_start_matches("1 "));
                Err(field.fail(what).next(e.next.filter(|next| next.starts_with("1 ")).unwrap_or(such_as)))
            }
        }
    }

    /// The size of a count of the encoder.
    fn count(&self, field: &Field) -> Result<f64> {
        let Some(encoder) = self.machine.encoder else {
            return Err(field
                .fail("counts need an encoder, and this case has none")
                .next("add [encoder] with at and lines"));
        };
        let counted: Vec<&str> = self.machine.counted().map(Quantity::name).collect();
        if !counted.contains(&field.key()) {
            let at = counted.join(" or ");
            return Err(field
                .fail(format!("the encoder of this case counts {at}"))
                .next("name the unit of this column"));
        }
        Ok(1.0 / encoder.counts_per_unit(self.machine.drives[0].motor.gear_ratio))
    }
}

/// A factor or an offset.
const NUMBER: Parameter = Parameter::unwritten("", crate::parameter::Range::ANY, "");

/// How a value of that unit may be written.
fn example(unit: &str) -> &'static str {
    match unit {
        "s" => "1 ms",
        "V" => "1 mV",
        "A" => "1 mA",
        "rad" => "1 deg",
        "rad/s" => "1 rpm",
        "m" => "1 mm",
        "m/s^2" => "1 mm/s^2",
        _ => "1 mm/s",
    }
}

/// A column by name, or by number from 1.
fn column(field: &Field) -> Result<ColumnId> {
    match &field.node.kind {
        NodeValue::Integer(number) if *number >= 1 => Ok(ColumnId::Number(*number as usize)),
        NodeValue::Integer(number) => Err(field.fail(format!("{number} is no column")).allowed("columns count from 1")),
        NodeValue::Text(name) if name.trim().is_empty() => Err(field
            .fail("the name of the column is empty")
            .next("a column without a name goes by its number, from 1")),
        NodeValue::Text(name) => Ok(ColumnId::from(name.as_str())),
        other => Err(field
            .fail(format!("expected a column, found {}", other.word()))
            .next("write the column's name in quotes, or its number, from 1")),
    }
}

/// When the samples were taken: a column, or `{ every = "20 ms" }`.
fn clock(table: &Table, sources: &Sources) -> Result<Clock> {
    let wanted = "time = \"...\" with the name of the time's column, or time = { every = \"1 ms\" }";
    if let Some(field) = table.optional("time").filter(Field::is_table) {
        let time = field.table()?;
        time.check_keys(&[], &[])?;
        return time.number("every").map(Clock::Every);
    }
    let source = sources.source("time", "s")?;
    source.map(Clock::Column).ok_or_else(|| table.missing("time", wanted))
}

/// Which rows count: `{ column = "pwm", is = 100 }`.
fn filter(field: &Field) -> Result<Filter> {
    let table = field.clone().named("").table()?;
    table.check_keys(&["column", "is", "is_not"], &[])?;
    let column = column(&table.required("column", "column = \"...\" with the name of the column")?)?;
    let (values, keep) = match (table.optional("is"), table.optional("is_not")) {
        (Some(is), None) => (is, true),
        (None, Some(is_not)) => (is_not, false),
        (Some(_), Some(both)) => return Err(both.fail("`is` is given already").next("give the one or the other")),
        (None, None) => return Err(table.missing("is", "is = 100, or is = [100, 200], or is_not")),
    };
    let list = if values.is_list() { values.filled_list()? } else { vec![values] };
    let text = |field: &Field| match &field.node.kind {
        NodeValue::Integer(number) => Ok(number.to_string()),
        NodeValue::Float(number) if number.is_finite() => Ok(shortest(*number)),
        NodeValue::Text(text) => Ok(text.trim().to_string()),
        other => Err(field.fail(format!("expected a number or a text, found {}", other.word()))),
    };
    Ok(Filter { column, values: list.iter().map(text).collect::<Result<_>>()?, keep })
}

/// The separator of the columns.
fn separator(field: &Field) -> Result<char> {
    match &field.node.kind {
        NodeValue::Text(text) if text == "\t" => Ok('\t'),
        NodeValue::Text(text) if text == " " => Ok(' '),
        _ => field.choice(&[(",", ','), (";", ';'), ("tab", '\t'), ("space", ' ')]),
    }
}

/// The quantities whose sign was lost.
fn absolute(table: &Table, outputs: &[(Quantity, Source)]) -> Result<Vec<Quantity>> {
    let Some(field) = table.optional("absolute") else { return Ok(Vec::new()) };
    let known: Vec<(&str, Quantity)> = outputs.iter().map(|(quantity, _)| (quantity.name(), *quantity)).collect();
    field.filled_list()?.iter().map(|field| field.choice(&known)).collect()
}

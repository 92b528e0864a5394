//! From a file's columns to logs: what each column is, in which unit, and which rows belong to which run.

use super::presets::Preset;
use super::sheet::{ColumnId, Dialect, Filter, LabelledRows, Request, Sheet};
use super::words::{count, shown};
use super::{Log, Output, Quantity, formats};
use crate::error::{Error, Result};
use crate::quantity::{self, show};
use crate::signal::Hold;
use std::ops::Range;
use std::path::PathBuf;

/// Most runs of one file.
const MOST_RUNS: usize = 1000;

/// The meaning of the columns of a file.
///
/// ```no_run
/// use taut::log::{Mapping, Quantity, Source};
/// let mut mapping = Mapping::new("pulse5.csv", Source::column("time_s"));
/// mapping.fed_by(Source::column("voltage_V"));
/// mapping.outputs = vec![(Quantity::DriveAngle, Source::column("angle_deg").unit("deg"))];
/// let (_, log) = mapping.read()?.remove(0);
/// println!("{} samples in {} s", log.len(), log.time.last().unwrap());
/// # Ok::<(), taut::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Mapping {
    /// The file: CSV, Parquet or MATLAB, told by its content.
    pub file: PathBuf,
    /// When the samples were taken.
    pub time: Clock,
    /// Columns of the amplifier inputs of the drives, with their keys and units, V or A; empty, with zeros in the log,
    /// if the inputs are known otherwise.
    pub inputs: Vec<Fed>,
    /// True if an input that is missing is the one before it; otherwise it is an error.
    pub hold_missing: bool,
    /// The column of what was added to the input behind the controller.
    pub added: Option<Source>,
    /// The column of where the cart should have been.
    pub reference: Option<Source>,
    /// The columns of what was seen.
    pub outputs: Vec<(Quantity, Source)>,
    /// Quantities whose sign was lost.
    pub absolute: Vec<Quantity>,
    /// The input between its samples.
    pub hold: Hold,
    /// Where the window begins, s on the file's clock, and where time zero is; the first row without.
    pub from: Option<f64>,
    /// Where it ends.
    pub to: Option<f64>,
    /// Which rows count; all without.
    pub filter: Option<Filter>,
    /// The column that tells runs apart.
    pub split: Option<ColumnId>,
    /// How a text file is written.
    pub dialect: Dialect,
    /// The recorder that made the file, where it says more of it than its columns.
    pub preset: Option<&'static Preset>,
}

/// The column of a drive's input.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Fed {
    /// Its key in the table of a log: `input` of an axis.
    pub key: &'static str,
    /// Unit of the input, V or A.
    pub unit: &'static str,
    /// Its column.
    pub source: Source,
}

/// When samples were taken.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Clock {
    /// As a column says.
    Column(Source),
    /// At this interval, s.
    Every(f64),
}

/// A column and how its numbers become SI: value = `scale` · unit · number + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Which column.
    pub column: ColumnId,
    /// Its unit; without it the one that the file states, or SI.
    pub unit: Option<Unit>,
    /// A factor beside the unit, such as −1.
    pub scale: f64,
    /// The offset that is added in the end, SI.
    pub offset: f64,
}

/// The unit of a column.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Unit {
    /// By name: `mm`.
    Name(String),
    /// So much in SI, such as a count of an encoder.
    Factor(f64),
}

impl Source {
    /// The column of that name, in the unit that the file states, or SI.
    pub fn column(name: &str) -> Self {
        Self { column: ColumnId::from(name), unit: None, scale: 1.0, offset: 0.0 }
    }

    /// This source with its numbers in `unit`.
    pub fn unit(self, unit: &str) -> Self {
        Self { unit: Some(Unit::Name(unit.to_string())), ..self }
    }
}

/// The role of a column.
#[derive(Clone, Copy)]
enum Role {
    Time,
    Input { key: &'static str, unit: &'static str },
    Added(&'static str),
    Reference,
    Output(Quantity),
}

impl Role {
    fn key(self) -> &'static str {
        match self {
            Role::Time => "time",
            Role::Input { key, .. } => key,
            Role::Added(_) => "added",
            Role::Reference => "reference",
            Role::Output(quantity) => quantity.name(),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Role::Time => "s",
            Role::Input { unit, .. } | Role::Added(unit) => unit,
            Role::Reference => "m",
            Role::Output(quantity) => quantity.unit(),
        }
    }
}

/// A sheet, its columns in SI, and what they are.
struct Columns<'a> {
    mapping: &'a Mapping,
    sheet: Sheet,
    roles: Vec<Role>,
    values: Vec<Vec<f64>>,
}

impl Mapping {
    /// A file and its clock; inputs and outputs are still to be named.
    pub fn new(file: impl Into<PathBuf>, time: Source) -> Self {
        Self {
            file: file.into(),
            time: Clock::Column(time),
            inputs: Vec::new(),
            hold_missing: false,
            added: None,
            reference: None,
            outputs: Vec::new(),
            absolute: Vec::new(),
            hold: Hold::Zero,
            from: None,
            to: None,
            filter: None,
            split: None,
            dialect: Dialect::default(),
            preset: None,
        }
    }

    /// The column of an axis' input, V, in place of any before.
    pub fn fed_by(&mut self, source: Source) {
        self.inputs = vec![Fed { key: "input", unit: "V", source }];
    }

    /// True if the numbers in the first column have to increase from the first row to the last.
    fn is_ordered(&self) -> bool {
        let increases = matches!(&self.time, Clock::Column(time) if time.scale > 0.0);
        increases && self.filter.is_none() && self.split.is_none()
    }

    /// Reads the runs; the text tells a run of a split file from the others.
    pub fn read(&self) -> Result<Vec<(Option<String>, Log)>> {
        let mut sources: Vec<(Role, &Source)> = Vec::new();
        if let Clock::Column(source) = &self.time {
            sources.push((Role::Time, source));
        }
        let complete = sources.len();
        let role = |fed: &Fed| Role::Input { key: fed.key, unit: fed.unit };
        sources.extend(self.inputs.iter().map(|fed| (role(fed), &fed.source)));
        let unit = self.inputs.first().map_or("V", |fed| fed.unit);
        sources.extend(self.added.iter().map(|source| (Role::Added(unit), source)));
        sources.extend(self.reference.iter().map(|source| (Role::Reference, source)));
        sources.extend(self.outputs.iter().map(|(quantity, source)| (Role::Output(*quantity), source)));
        let ids: Vec<ColumnId> = sources.iter().map(|(_, source)| source.column.clone()).collect();
        let request = Request {
            columns: &ids,
            complete,
            ordered: self.is_ordered(),
            units_row: true,
            dialect: self.dialect,
            filter: self.filter.as_ref(),
            split: self.split.as_ref(),
            preset: self.preset,
        };
        let mut sheet = formats::read(&self.file, &request)?;
        let mut values = Vec::new();
        for (i, &(role, source)) in sources.iter().enumerate() {
            let factor = source.scale * factor(&sheet, i, role, source)?;
            let mut column = std::mem::take(&mut sheet.columns[i]);
            column.iter_mut().for_each(|x| *x = factor * *x + source.offset);
            values.push(column);
        }
        let roles = sources.iter().map(|(role, _)| *role).collect();
        Columns { mapping: self, sheet, roles, values }.logs()
    }
}

/// One of the i-th column's unit in SI.
fn factor(sheet: &Sheet, i: usize, role: Role, source: &Source) -> Result<f64> {
    let (key, wanted) = (role.key(), role.unit());
    let of = |unit: &str| quantity::read(&format!("1 {unit}"), wanted);
    let say = |unit: &str| format!("units = {{ {key} = \"{unit}\" }}");
    match &source.unit {
        Some(Unit::Factor(factor)) => return Ok(*factor),
        Some(Unit::Name(name)) => return of(name),
        None => {}
    }
    let name = &sheet.names[i];
    if let Some(unit) = &sheet.units[i] {
        return of(unit).map_err(|_| {
            let what = format!(
                "column {name} is in {} in the file; {key} requires a unit convertible to {wanted}",
                shown(unit)
            );
            let error = sheet.heading_error(i, what).allowed(format!("{wanted}, or a unit convertible to it"));
            error.next(match quantity::parse(&format!("1 {unit}")) {
                Ok(_) => format!("name another column, or say that this one is not in {unit}: {}", say(wanted)),
                Err(_) => format!(
                    "say in the case file what it is: {}, and scale = {{ {key} = ... }} where a factor is needed",
                    say(wanted)
                ),
            })
        });
    }
    // A name such as time_us may say the unit, or not.
    let Some(unit) = suspected(source.column.name().unwrap_or_default(), wanted) else { return Ok(1.0) };
    Err(sheet
        .heading_error(i, format!("column {name} seems to be in {unit}, by its name; the case file does not say so"))
        .next(format!("write {} in the log's table, or {} if that is what it is in", say(unit), say(wanted))))
}

/// Units, other than SI, that people put at the end of a name.
const IN_NAMES: [&str; 22] = [
    "ns", "us", "ms", "min", "mV", "kV", "mA", "uA", "um", "mm", "cm", "in", "inch", "deg", "mrad", "rev", "rpm",
    "deg/s", "mrad/s", "mm/s", "cm/s", "mm/min",
];

/// A unit other than SI at the end of a name, if it is one of the wanted dimension.
pub(super) fn suspected(name: &str, wanted: &str) -> Option<&'static str> {
    let parts: Vec<&str> = name.split('_').collect();
    let last = parts.last().copied().unwrap_or_default();
    // As in cart_speed_mm_s.
    let quotient = parts.len().checked_sub(2).map(|k| format!("{}/{last}", parts[k])).unwrap_or_default();
    let known = |text: &str| IN_NAMES.into_iter().find(|unit| *unit == text);
    known(&quotient).or_else(|| known(last)).filter(|unit| quantity::read(&format!("1 {unit}"), wanted).is_ok())
}

impl Columns<'_> {
    fn logs(&self) -> Result<Vec<(Option<String>, Log)>> {
        if self.mapping.split.is_none() {
            return Ok(vec![(None, self.log(0..self.sheet.rows.len(), None)?)]);
        }
        let runs = &self.sheet.runs;
        if runs.len() > MOST_RUNS {
            let column = self.mapping.split.as_ref().map(ColumnId::shown).unwrap_or_default();
            return Err(Error::new(format!("column {column} changes {} times", runs.len() - 1))
                .in_file(&self.sheet.file)
                .allowed(format!("up to {MOST_RUNS} runs"))
                .next("split by a column that holds one value for each run"));
        }
        let ends = runs.iter().skip(1).map(|run| run.begin).chain([self.sheet.rows.len()]);
        let mut logs: Vec<(Option<String>, Log)> = Vec::new();
        for (k, (run, end)) in runs.iter().zip(ends).enumerate() {
            let before = runs[..k].iter().filter(|other| other.label == run.label).count();
            let name = match before {
                0 => run.label.clone(),
                n => format!("{} ({})", run.label, n + 1),
            };
            let log = self.log(run.begin..end, Some(run))?;
            logs.push((Some(name.replace(|c: char| c.is_control() || matches!(c, '/' | '\\'), "-")), log));
        }
        Ok(logs)
    }

    /// The log in these rows.
    fn log(&self, rows: Range<usize>, run: Option<&LabelledRows>) -> Result<Log> {
        let mapping = self.mapping;
        let time = match &mapping.time {
            Clock::Column(_) => self.times(rows.clone())?,
            Clock::Every(every) => (0..rows.len()).map(|k| k as f64 * every).collect(),
        };
        // Runs count from their own beginnings.
        let first = time.first().copied().unwrap_or_default();
        let zero = if run.is_some() { first } else { 0.0 };
        let window = self.window(&time, zero, &rows, run)?;
        let start = mapping.from.map_or(first, |from| zero + from);
        let within = rows.start + window.start..rows.start + window.end;
        let time_from_start = self.counted_from(&time[window.clone()], start, within.start)?;
        let mut outputs = Vec::new();
        for (i, role) in self.roles.iter().enumerate() {
            let Role::Output(quantity) = *role else { continue };
            let values = self.values[i][within.clone()].to_vec();
            if values.iter().all(|x| x.is_nan()) {
                let name = &self.sheet.names[i];
                let error = self.sheet.heading_error(i, format!("column {name} has no value{}", self.in_what(run)));
                return Err(error
                    .allowed("at least one number")
                    .next("leave it out of the log's table, or check the recording"));
            }
            outputs.push(Output { quantity, absolute: mapping.absolute.contains(&quantity), values });
        }
        let mut log = Log {
            name: String::new(),
            file: mapping.file.clone(),
            time: time_from_start,
            inputs: Vec::new(),
            added: None,
            hold: mapping.hold,
            reference: None,
            outputs,
            ended: self.sheet.ended.clone().filter(|_| within.end == self.sheet.rows.len()),
        };
        if let Some(i) = self.roles.iter().position(|role| matches!(role, Role::Reference)) {
            log.reference = Some(self.inputs(i, &rows, &within)?);
        }
        if let Some(i) = self.roles.iter().position(|role| matches!(role, Role::Added(_))) {
            log.added = Some(self.inputs(i, &rows, &within)?);
        }
        let fed: Vec<usize> = (0..self.roles.len()).filter(|i| matches!(self.roles[*i], Role::Input { .. })).collect();
        for &i in &fed {
            let mut input = self.inputs(i, &rows, &within)?;
            for (input, added) in input.iter_mut().zip(log.added.iter().flatten()) {
                *input += added;
            }
            log.inputs.push(input);
        }
        if fed.is_empty() {
            log.inputs.push(vec![0.0; within.len()]);
        } else if log.time[0] > 0.0 {
            // A window that begins between two rows begins with the inputs of that moment, when nothing was seen.
            let held: Option<Vec<f64>> = fed.iter().map(|&i| self.held(i, &rows, &within)).collect();
            if let Some(held) = held {
                let before = time[window.start - 1] - start;
                let share = match mapping.hold {
                    Hold::Zero => 0.0,
                    Hold::Linear => before / (before - log.time[0]),
                };
                for (input, held) in log.inputs.iter_mut().zip(held) {
                    input.insert(0, held + share * (input[0] - held));
                }
                log.time.insert(0, 0.0);
                log.reference.iter_mut().for_each(|reference| reference.insert(0, reference[0]));
                log.added.iter_mut().for_each(|added| added.insert(0, added[0]));
                log.outputs.iter_mut().for_each(|output| output.values.insert(0, f64::NAN));
            }
        }
        Ok(log)
    }

    fn in_what(&self, run: Option<&LabelledRows>) -> String {
        let run = run.map(|run| format!(" in the run {}", shown(&run.label))).unwrap_or_default();
        let window = self.mapping.from.is_some() || self.mapping.to.is_some();
        format!("{run}{}", if window { " between `from` and `to`" } else { "" })
    }

    /// The times of these rows, which increase.
    fn times(&self, rows: Range<usize>) -> Result<Vec<f64>> {
        let time = &self.values[0];
        for row in rows.clone().skip(1) {
            let (before, t) = (time[row - 1], time[row]);
            if t > before {
                continue;
            }
            let (here, there) = (self.sheet.row(row), self.sheet.row(row - 1));
            let name = &self.sheet.names[0];
            let seconds = |t: f64| show(t, "s");
            let (what, next) = if t == before {
                let what = format!("the time {} in {here} repeats that of {there}", seconds(t));
                (what, "keep one row of each time, or say the interval: time = { every = \"1 ms\" }".to_string())
            } else {
                let what = format!(
                    "the clock {name} goes back: from {} in {there} to {} in {here}",
                    seconds(before),
                    seconds(t)
                );
                (what, self.backward(rows.start, row))
            };
            return Err(self.sheet.error(0, row, what).allowed("times that increase from row to row").next(next));
        }
        if let Some((row, factor)) = other_unit(&time[rows.clone()]) {
            let row = rows.start + row;
            let (here, there, name) = (self.sheet.row(row), self.sheet.row(row - 1), &self.sheet.names[0]);
            let [before, t] = [time[row - 1], time[row]].map(|t| show(t, "s"));
            let what = format!("the clock {name} has another unit from {here} on: {t} after {before} in {there}");
            let error = self.sheet.error(0, row, what).allowed("one unit of time in all rows");
            return Err(error.next(format!("divide the times from there on by {factor}")));
        }
        Ok(time[rows].to_vec())
    }

    /// These times, the first of them in row `first`, from `start` (s) on. A time so far off that no difference is left
    /// is told.
    fn counted_from(&self, time: &[f64], start: f64, first: usize) -> Result<Vec<f64>> {
        let shifted: Vec<f64> = time.iter().map(|t| t - start).collect();
        let lost = (1..shifted.len()).find(|&k| !(shifted[k].is_finite() && shifted[k] > shifted[k - 1]));
        let Some(k) = lost else { return Ok(shifted) };
        let (here, there) = (self.sheet.row(first + k), self.sheet.row(first + k - 1));
        let what = format!(
            "counted from the log's beginning at {}, the times {} in {there} and {} in {here} are equal after rounding",
            show(start, "s"),
            show(time[k - 1], "s"),
            show(time[k], "s")
        );
        let error = self.sheet.error(0, first + k, what);
        Err(error.allowed("a first time within 1e15 intervals of the others").next("leave out the row that is far off"))
    }

    /// Advice for a clock that goes back in this row.
    fn backward(&self, first: usize, row: usize) -> String {
        let time = &self.values[0];
        let drop = time[row - 1] - time[row];
        let step = (time[row - 1] - time[first]) / (row - first - 1).max(1) as f64;
        // A counter that overflows falls by nearly all of its range, in its own unit.
        for bits in [16, 32] {
            let range = 2f64.powi(bits);
            let factor = self.time_factor();
            if factor > 0.0 && ((drop + step) / factor - range).abs() <= 0.01 * range + 10.0 * step / factor {
                return format!("its {bits}-bit counter overflows here: add {range} to it from this row on");
            }
        }
        if time[row] <= time[first] + step {
            return match &self.mapping.split {
                Some(column) => format!(
                    "a second recording begins here, with the same value in column {}: give it another",
                    column.shown()
                ),
                None => {
                    "a second recording begins here: split the file by a column (split = \"...\"), or cut it".into()
                }
            };
        }
        "sort the rows by time, or leave out the rows where the clock was set".into()
    }

    /// One of the clock's own unit, s.
    fn time_factor(&self) -> f64 {
        let Clock::Column(source) = &self.mapping.time else { return 1.0 };
        factor(&self.sheet, 0, Role::Time, source).map_or(1.0, |factor| factor * source.scale)
    }

    /// The rows between `from` and `to`, counted within the run.
    fn window(&self, time: &[f64], zero: f64, rows: &Range<usize>, run: Option<&LabelledRows>) -> Result<Range<usize>> {
        let &Mapping { from, to, ref inputs, ref file, .. } = self.mapping;
        let fail = |what: String| Error::new(what).in_file(file);
        let (first, last) = (time.first().copied().unwrap_or_default(), time.last().copied().unwrap_or_default());
        let [first, last] = [first - zero, last - zero];
        let of = run.map(|run| format!("the run {}", shown(&run.label))).unwrap_or("the log".into());
        let extent = format!("from {} to {}", show(first, "s"), show(last, "s"));
        if let Some(from) = from.filter(|&from| from < first && !inputs.is_empty()) {
            let what =
                format!("{of} begins at {}; the input from {} on is not known", show(first, "s"), show(from, "s"));
            return Err(fail(what).allowed(extent).next("correct `from`, or leave it out"));
        }
        let begin = from.map_or(0, |from| time.partition_point(|&t| t - zero < from));
        let end = to.map_or(time.len(), |to| time.partition_point(|&t| t - zero <= to));
        match end.saturating_sub(begin) {
            n if n >= 2 => Ok(begin..end),
            n if from.is_some() || to.is_some() => {
                let what = format!(
                    "{of} has {} between `from` and `to`",
                    if n == 0 { "no row".into() } else { count(n, "row") }
                );
                Err(fail(what)
                    .allowed(format!("at least two; it goes {extent}"))
                    .next("correct `from` and `to`, which are on its own clock"))
            }
            _ => {
                let what = format!("{of} has a single row, {}", self.sheet.row(rows.start));
                let next = match run {
                    Some(_) => "split by a column that holds one value for each run",
                    None => "check that the recording was saved",
                };
                Err(fail(what).allowed("at least two").next(next))
            }
        }
    }

    /// The inputs in a window of a run.
    fn inputs(&self, i: usize, rows: &Range<usize>, window: &Range<usize>) -> Result<Vec<f64>> {
        let column = &self.values[i];
        let mut last = self.held(i, rows, window).unwrap_or(f64::NAN);
        let mut inputs = Vec::with_capacity(window.len());
        for row in window.clone() {
            let value = column[row];
            if value.is_nan() && (last.is_nan() || !self.mapping.hold_missing) {
                let name = &self.sheet.names[i];
                let missing = column[window.clone()].iter().filter(|x| x.is_nan()).count();
                let here = self.sheet.row(row);
                let what = match missing {
                    1 => format!("the input {name} has no value in {here}"),
                    n => format!("the input {name} has no value in {here}, nor in {} after it", count(n - 1, "row")),
                };
                let error = self.sheet.error(i, row, what).allowed("a value in every row, for the model needs it");
                let next = match self.mapping.hold_missing {
                    true => "nothing came before it that could hold: begin later with `from`",
                    false => {
                        "fill it in; or write missing_input = \"hold\" in the log's table if the last one held; or leave these rows out with `from` and `to`"
                    }
                };
                return Err(error.next(next));
            }
            if !value.is_nan() {
                last = value;
            }
            inputs.push(last);
        }
        Ok(inputs)
    }

    /// The last input before a window.
    fn held(&self, i: usize, rows: &Range<usize>, window: &Range<usize>) -> Option<f64> {
        let before = &self.values[i][rows.start..window.start];
        match self.mapping.hold_missing {
            true => before.iter().rev().copied().find(|x| !x.is_nan()),
            false => before.last().copied().filter(|x| !x.is_nan()),
        }
    }
}

/// The row from which on times have another unit, and the factor: they go on by F h after F (t + h).
fn other_unit(time: &[f64]) -> Option<(usize, f64)> {
    let step = |row: usize| time[row] - time[row - 1];
    let is_so = |row: usize, factor: f64| {
        let (before, after) = (factor * step(row - 1), step(row + 1));
        let due = factor * (time[row - 1] + step(row - 1));
        (0.5..2.0).contains(&(after / before)) && (time[row] - due).abs() < 2.0 * before && time[row - 1] > 0.0
    };
    let rows = 2..time.len().saturating_sub(1);
    // A step that is no longer than those before it is the common case.
    let mut jumps = rows.filter(|&row| step(row) > 100.0 * step(row - 1));
    jumps.find_map(|row| [1e3, 1e6, 1e9].into_iter().find(|&factor| is_so(row, factor)).map(|factor| (row, factor)))
}

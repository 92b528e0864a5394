//! The inputs: `{ pulse = "5 V", for = "0.25 s" }` and its kind.

use super::files::Folder;
use super::reader::{Field, Table, nearest};
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::quantity;
use crate::signal::{Hold, Signal, Slot, Tone};
use std::f64::consts::PI;

/// Every kind of input; the key of that name holds its main value.
pub(super) const KINDS: &[&str] = &[
    "step",
    "pulse",
    "ramp",
    "triangle",
    "square",
    "sine",
    "chirp",
    "multisine",
    "prbs",
    "table",
    "file",
    "sum",
    "sequence",
];

/// How deep sums and sequences may be nested.
const DEEPEST: usize = 8;

/// Most periods, or bits, of an input within one run.
const MOST_PERIODS: f64 = 1e8;

/// Most periods of a stepper's command: all of its pieces are searched for jumps as it is read.
const MOST_OF_A_COMMAND: f64 = 2e5;

/// Most sines of a multisine.
const MOST_TONES: usize = 1000;

/// The experiment that an input belongs to, as far as it matters to it.
pub(super) struct Context<'a> {
    /// Where relative paths begin.
    pub folder: &'a Folder<'a>,
    /// End of the run, s.
    pub until: f64,
    /// Most periods, or bits, within the run.
    most_periods: f64,
}

impl<'a> Context<'a> {
    /// Of an experiment of this machine that ends at `until`, s.
    pub fn new(machine: &Machine, folder: &'a Folder<'a>, until: f64) -> Self {
        let most_periods = if machine.stepper().is_some() { MOST_OF_A_COMMAND } else { MOST_PERIODS };
        Self { folder, until, most_periods }
    }
}

/// An input; `field` is its table.
pub(super) fn signal(field: &Field, context: &Context) -> Result<Signal> {
    nested(field, context, 0, false)
}

fn nested(field: &Field, context: &Context, depth: usize, in_sequence: bool) -> Result<Signal> {
    if depth > DEEPEST {
        return Err(field.fail("sums and sequences are nested too deeply").allowed(format!("{DEEPEST} levels")));
    }
    if !field.is_table() {
        let such_as = format!("an input is a table, such as {{ step = \"5 {}\" }}", field.input_unit);
        return Err(field.fail("the kind of input is missing").allowed(KINDS.join(", ")).next(such_as));
    }
    let kind = kind(&field.clone().table()?)?;
    let table = field.clone().named(format!("input.{kind}")).table()?;
    let others: &[&str] = match kind {
        "file" => &["file", "time", "column", "hold", "unit"],
        _ => &[kind],
    };
    let others: Vec<&'static str> =
        KINDS.iter().chain(&["time", "column", "hold", "unit"]).copied().filter(|k| others.contains(k)).collect();
    let turn: &[&'static str] = if in_sequence { &["lasts"] } else { &[] };
    table.check_keys(&[&others, turn].concat(), &[])?;

    let Some(main) = table.optional(kind) else { return Err(field.fail("no kind")) };
    let main = main.named(format!("input.{kind}"));
    let number = |key: &str| table.number(key);
    let periods = |frequency: f64, key: &str| few_enough(&table, key, frequency * context.until, context);
    Ok(match kind {
        "step" => Signal::Step { value: main.number()?, at: number("at")? },
        "pulse" => Signal::Pulse { value: main.number()?, duration: number("for")?, at: number("at")? },
        "ramp" => Signal::Ramp { value: main.number()?, over: number("over")?, at: number("at")? },
        "triangle" => {
            let frequency = number("frequency")?;
            periods(frequency, "frequency")?;
            Signal::Triangle { amplitude: main.number()?, frequency }
        }
        "square" => {
            let frequency = number("frequency")?;
            periods(frequency, "frequency")?;
            Signal::Square { amplitude: main.number()?, frequency, duty: number("duty")? }
        }
        "sine" => {
            let frequency = number("frequency")?;
            periods(frequency, "frequency")?;
            let (phase, offset) = (number("phase")?, number("offset")?);
            Signal::Sine { amplitude: main.number()?, frequency, phase, offset }
        }
        "chirp" => {
            let (from, to, over) = (number("from")?, number("to")?, number("over")?);
            few_enough(&table, "to", from.max(to) * over.min(context.until), context)?;
            Signal::Chirp { amplitude: main.number()?, from, to, over }
        }
        "multisine" => multisine(main.number()?, &table, context)?,
        "prbs" => {
            let bit = number("bit")?;
            few_enough(&table, "bit", context.until / bit, context)?;
            Signal::Prbs { amplitude: main.number()?, bit, seed: table.seed()? }
        }
        "table" => points(&main)?,
        "file" => sampled(&main, &table, context)?,
        "sum" => {
            let parts = main.filled_list()?;
            let parts = parts.iter().map(|part| nested(part, context, depth + 1, false));
            Signal::Sum(parts.collect::<Result<_>>()?)
        }
        "sequence" => sequence(&main, context, depth)?,
        _ => return Err(field.unread()),
    })
}

/// The one key that says which kind of input this is.
fn kind(table: &Table) -> Result<&'static str> {
    let given: Vec<&'static str> = KINDS.iter().copied().filter(|kind| table.keys().any(|key| key == *kind)).collect();
    match given[..] {
        [kind] => Ok(kind),
        [] => {
            let error = table.field.fail("the kind of input is missing").allowed(KINDS.join(", "));
            let near = table.keys().find_map(|key| nearest(key, KINDS));
            Err(match near {
                Some(near) => error.next(format!("did you mean `{near}`?")),
                None => error.next(format!("write for example {{ step = \"5 {}\" }}", table.field.input_unit)),
            })
        }
        [first, second, ..] => Err(table
            .field
            .fail(format!("this is a {first} and a {second} at once"))
            .next("to add inputs, write { sum = [{ ... }, { ... }] }; one after another, { sequence = [...] }")),
    }
}

fn few_enough(table: &Table, key: &str, periods: f64, context: &Context) -> Result<()> {
    if periods <= context.most_periods {
        return Ok(());
    }
    let field = table.optional(key).unwrap_or_else(|| table.field.clone());
    Err(field
        .fail(format!("this makes {} periods within the run", quantity::rounded(periods)))
        .allowed(format!("up to {}", quantity::rounded(context.most_periods))))
}

/// Equal sines with phases that keep the peak of their sum low.
fn multisine(amplitude: f64, table: &Table, context: &Context) -> Result<Signal> {
    let frequencies = match (table.optional("frequencies"), table.optional("tones")) {
        (Some(field), None) => {
            if let Some(other) = ["from", "to"].iter().find_map(|key| table.optional(key)) {
                return Err(other
                    .fail("the frequencies are listed already")
                    .next("give either frequencies, or from, to and tones"));
            }
            let list = field.filled_list()?;
            if list.len() > MOST_TONES {
                return Err(field
                    .fail(format!("the list has {} values", list.len()))
                    .allowed(format!("up to {MOST_TONES}")));
            }
            list.iter().map(|f| f.clone().named(&field.section).number()).collect::<Result<Vec<_>>>()?
        }
        (Some(_), Some(tones)) => {
            return Err(tones
                .fail("the frequencies are listed already")
                .next("give either frequencies, or from, to and tones"));
        }
        (None, _) => {
            let (from, to, tones) =
                (table.number_if_given("from")?, table.number_if_given("to")?, table.number_if_given("tones")?);
            let (Some(from), Some(to), Some(tones)) = (from, to, tones) else {
                return Err(table.missing("frequencies", "frequencies = [\"1 Hz\", \"3 Hz\"], or from, to and tones"));
            };
            if from >= to {
                let field = table.optional("to").unwrap_or_else(|| table.field.clone());
                return Err(field.fail("the highest frequency is not above the lowest").allowed("above from"));
            }
            (0..tones as usize).map(|i| from + (to - from) * i as f64 / (tones - 1.0)).collect()
        }
    };
    few_enough(table, "frequencies", frequencies.iter().sum::<f64>() * context.until, context)?;
    let n = frequencies.len() as f64;
    let tone = |(i, frequency): (usize, f64)| {
        // φ_k = −π k (k − 1) / N, k = 1 … N: Schroeder's phases for equal amplitudes
        let k = (i + 1) as f64;
        Tone { amplitude, frequency, phase: -PI * k * (k - 1.0) / n }
    };
    Ok(Signal::Multisine { tones: frequencies.into_iter().enumerate().map(tone).collect() })
}

fn points(field: &Field) -> Result<Signal> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for point in field.filled_list()? {
        let pair = point.list()?;
        let [time, value] = &pair[..] else {
            return Err(point
                .fail(format!("the point has {} values", pair.len()))
                .allowed("two values: [time, value]"));
        };
        let next =
            [time.clone().named("input.point.time").number()?, value.clone().named("input.point.value").number()?];
        if let Some(last) = points.last()
            && next[0] <= last[0]
        {
            return Err(time
                .fail(format!("the time {} s does not come after {} s", next[0], last[0]))
                .next("sort the points by time"));
        }
        points.push(next);
    }
    Ok(Signal::Table { points })
}

/// A column of a file.
fn sampled(main: &Field, table: &Table, context: &Context) -> Result<Signal> {
    let path = context.folder.name(main)?;
    let time = table.required("time", "time = \"...\" with the name of the time's column")?.text()?;
    let column = table.required("column", "column = \"...\" with the name of the input's column")?.text()?;
    let holds = [("zero", Hold::Zero), ("linear", Hold::Linear)];
    let hold = table.optional("hold").map_or(Ok(Hold::Zero), |field| field.choice(&holds))?;
    let unit = match table.optional("unit") {
        Some(field) => {
            let unit = field.text()?;
            let one = quantity::read(&format!("1 {unit}"), main.input_unit);
            one.map_err(|_| {
                let such_as = format!("write for example unit = \"m{}\"", main.input_unit);
                field.fail(format!("\"{unit}\" is no unit of this input")).next(such_as)
            })?
        }
        None => 1.0,
    };
    let (times, values) = context.folder.read(main, &path, || {
        let (times, values) = crate::log::read_samples(&path, time, column)?;
        if let Some(first) = times.first().filter(|&&t| t < 0.0) {
            return Err(Error::new(format!("column `{time}` begins at {first} s"))
                .in_file(&path)
                .allowed("times from 0 s on")
                .next("subtract the first time from all of them"));
        }
        Ok((times, values))
    })?;
    Ok(Signal::Sampled { times, values: values.into_iter().map(|v| v * unit).collect(), hold })
}

/// One input after another.
fn sequence(field: &Field, context: &Context, depth: usize) -> Result<Signal> {
    let elements = field.filled_list()?;
    let last = elements.len() - 1;
    let mut slots = Vec::with_capacity(elements.len() + 1);
    for (i, element) in elements.iter().enumerate() {
        let signal = nested(element, context, depth + 1, true)?;
        let lasts = element.table()?.optional("lasts").map(|f| f.named("input.element.lasts").number()).transpose()?;
        let lasts = match lasts.or_else(|| if i < last { duration(&signal) } else { None }) {
            Some(lasts) => lasts,
            None if i == last => f64::INFINITY,
            None => {
                return Err(element
                    .fail("the duration of this element of the sequence is missing")
                    .next("add for example lasts = \"1 s\""));
            }
        };
        slots.push(Slot { signal, lasts });
    }
    // An end that was asked for is an end: nothing follows.
    if slots.last().is_some_and(|slot| slot.lasts.is_finite()) {
        slots.push(Slot { signal: Signal::Step { value: 0.0, at: 0.0 }, lasts: f64::INFINITY });
    }
    Ok(Signal::sequence(slots))
}

/// How long a signal takes of itself, s, if it comes to an end.
fn duration(signal: &Signal) -> Option<f64> {
    match signal {
        Signal::Pulse { duration, at, .. } => Some(at + duration),
        Signal::Ramp { over, at, .. } => Some(at + over),
        Signal::Chirp { over, .. } => Some(*over),
        Signal::Table { points } => points.last().map(|p| p[0]).filter(|&t| t > 0.0),
        Signal::Sampled { times, .. } => times.last().copied().filter(|&t| t > 0.0),
        Signal::Sum(parts) => parts.iter().map(duration).try_fold(0.0, |longest: f64, d| Some(longest.max(d?))),
        _ => None,
    }
}

//! The case of a request, with its changes.

use crate::Context;
use crate::curves::spans;
use crate::message::Request;
use serde_json::{Value, json};
use taut::case::{Case, Files, Number};
use taut::error::{Error, Result};
use taut::parameter::{Fallback, Free};

/// The case: `text`, changed by `set`, a list of keys and values, and by `changes`, a list of `KEY=VALUE`. Experiments
/// whose files cannot be read are left out; a job that needs them refuses the case ([`Case::complete`]).
pub fn opened(request: &Request, context: &Context) -> Result<Case> {
    opened_for(request, context, Files::All)
}

/// The case of a request, with the files of these experiments only.
pub fn opened_for(request: &Request, context: &Context, files: Files) -> Result<Case> {
    let (name, text) = (context.host.name(), request.text("text")?);
    let mut changes: Vec<String> =
        request.list("changes").iter().filter_map(Value::as_str).map(str::to_string).collect();
    if !request.list("set").is_empty() {
        let numbers = Case::from_text_for(name, text, &[], Files::Nothing)?.numbers()?;
        for pair in request.list("set") {
            changes.push(change(&numbers, pair)?);
        }
    }
    let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
    Case::from_text_for(name, text, &changes, files)
}

/// The change that `[key, value]` means: the value is a number in SI, or a text with a unit.
fn change(numbers: &[Number], pair: &Value) -> Result<String> {
    let wrong = || {
        Error::new(
            "an element of `set` is a key and a value, such as [\"cart.mass\", 0.5] or [\"cart.mass\", \"500 g\"]",
        )
    };
    let key = pair[0].as_str().ok_or_else(wrong)?;
    let Some(number) = numbers.iter().find(|number| number.key == key) else {
        return Err(Error::new(format!("this case has no number `{key}`")));
    };
    match &pair[1] {
        Value::String(text) => Ok(format!("{key}={text}")),
        value => value.as_f64().map(|value| number.change(value)).ok_or_else(wrong),
    }
}

/// The span that an element of a list of the belt belongs to.
fn span(case: &Case, key: &str) -> Option<&'static str> {
    let (_, place) = key.strip_prefix("belt.")?.split_once('.')?;
    spans(case).get(place.parse::<usize>().ok()?).copied()
}

/// The numbers of a case with what the table of parameters says of them.
pub fn parameters(case: &Case, numbers: &[Number]) -> Value {
    let machine = &case.machine;
    let one = |number: &Number| {
        let Number { key, row, unit, value, written } = number;
        let default = match row.default {
            Fallback::Value(value) => json!(value),
            Fallback::Required | Fallback::Words(_) => Value::Null,
        };
        let limit = |value: f64| if value.abs() >= 1e15 { Value::Null } else { json!(value) };
        json!({
            "key": key,
            "span": span(case, key),
            "symbol": row.symbol,
            "unit": taut::number::pretty_unit(unit),
            "value": value,
            "written": written,
            "shown": taut::number::engineering(*value, unit, 6),
            "default": default,
            "low": limit(row.range.low),
            "high": limit(row.range.high),
            "whole": row.range.whole,
            // Whether a fit or a sweep can set it by itself.
            "free": !row.range.whole && Free::new(machine, key, &[key.as_str()], &[]).is_ok(),
            "allowed": row.range.describe(unit),
            "sentence": row.sentence,
            "example": taut::quantity::read(row.example, unit).ok(),
        })
    };
    Value::Array(numbers.iter().map(one).collect())
}

/// Refuses a case that has nothing to run because its files cannot be read, with the line that names the first of them.
pub fn runnable(case: &Case) -> Result<()> {
    if case.experiments.is_empty() && case.moves.is_empty() { case.complete() } else { Ok(()) }
}

/// The place in a list that a request names as `experiment`: its first where it names none.
pub fn chosen(request: &Request, count: usize) -> Result<usize> {
    let place = request.number("experiment").unwrap_or(0.0);
    if count == 0 {
        return Err(
            Error::new("this case has no experiments").next("add [[experiment]] with name, input, until, every")
        );
    }
    Ok((place.max(0.0) as usize).min(count - 1))
}

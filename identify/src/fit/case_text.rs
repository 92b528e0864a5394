//! The case file with the estimates in it.

use crate::case::{Case, Files, Given};
use crate::error::{Error, Result};
use crate::fit::trust::found::{Estimate, Fit};
use crate::machine::Machine;
use crate::parameter::{self, Field, Parameter, named, values};
use std::path::Path;

impl Fit {
    /// The text of the case with the estimates in place of what they were, and a table of how well they are known.
    /// Paths in it are those of `case`; `name` stands in messages. Read again, it is the machine of the fit: where
    /// estimates are not determined, the one of all that meet the logs alike that is nearest to that of the case.
    ///
    /// Of what campaigns have for themselves, the values of the first; [`Fit::case_text_of`] has those of the others.
    pub fn case_text(&self, case: &Case, name: &Path) -> Result<String> {
        self.text(case, name, 0)
    }

    /// Text of the case with the values of a campaign, by its index in [`Fit::parts`].
    pub fn case_text_of(&self, case: &Case, name: &Path, part: usize) -> Result<String> {
        self.text(case, name, part)
    }

    fn text(&self, case: &Case, name: &Path, part: usize) -> Result<String> {
        let machine = self.parts.get(part).map_or(&self.machine, |(_, machine)| machine);
        let is_own = |estimate: &&Estimate| estimate.part.is_none_or(|own| own == part);
        let sets = || self.estimates.iter().filter(is_own).flat_map(|estimate| &estimate.sets);
        let text = without_other_forms(&case.text, sets().map(|(key, _)| key.as_str()));
        let mut changes: Vec<String> = sets().flat_map(|(key, value)| changes_of(machine, case, key, *value)).collect();
        let read = |changes: &[String]| {
            let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
            Case::from_text_for(name, &text, &changes, Files::Nothing)
        };
        let mut fitted = read(&changes);
        if let Some(change) = fitted.as_ref().ok().and_then(|fitted| damping_share(case, &fitted.machine, machine)) {
            changes.push(change);
            fitted = read(&changes);
        }
        if fitted.as_ref().map_or(true, |fitted| differs(&fitted.machine, machine).is_some()) {
            // The other direction, or the breakaway, stands in the text and went with what was fitted.
            let is_fitted = |body: &str| sets().any(|(key, _)| key.starts_with(&format!("{body}.friction.")));
            for (key, value) in values(machine) {
                let went_along = named(&key).is_some_and(|row| !row.follows.is_empty());
                if went_along && key.split_once(".friction.").is_some_and(|(body, _)| is_fitted(body)) {
                    changes.push(format!("{key}={value}"));
                }
            }
            fitted = read(&changes);
        }
        let fitted = fitted?;
        // A file that is another machine than the fit has other errors than those that are told of it.
        if let Some((key, is, read)) = differs(machine, &fitted.machine) {
            return Err(Error::new(format!("the fit cannot be written: `{key}` would be read as {read}, and is {is}"))
                .in_file(name)
                .next("give the case file a value of its own for it, or leave it out of [fit]"));
        }
        let text = fitted.text;
        let mut document: toml_edit::DocumentMut =
            text.parse().map_err(|_| Error::new("this is not TOML").in_file(name))?;
        let mut table = toml_edit::Table::new();
        let how = format!(
            "\n# Uncertainty of the estimates: SI units, standard errors, 95 % intervals. Ending of the fit: {}.\n",
            self.ending_word()
        );
        table.decor_mut().set_prefix(how);
        for estimate in &self.estimates {
            let mut row = toml_edit::InlineTable::new();
            let mut put = |key: &str, value: f64| {
                row.insert(key, toml_edit::Value::from(value));
            };
            put("value", estimate.value);
            match (estimate.error, estimate.interval) {
                (Some(error), Some([low, high])) if error.is_finite() => {
                    put("error", error);
                    put("low", low);
                    put("high", high);
                }
                _ => {
                    if let Some([low, high]) = estimate.interval.filter(|ends| ends.iter().all(|end| end.is_finite())) {
                        put("low", low);
                        put("high", high);
                    }
                    let why = if estimate.at_bound { "at its bound" } else { "not determined" };
                    row.insert("known", toml_edit::Value::from(why));
                }
            }
            table.insert(&estimate.name, toml_edit::value(row));
        }
        for combination in self.combinations() {
            let mut row = toml_edit::InlineTable::new();
            let [low, high] = combination.interval;
            for (key, value) in
                [("value", combination.value), ("error", combination.error), ("low", low), ("high", high)]
            {
                row.insert(key, toml_edit::Value::from(value));
            }
            table.insert(&combination.name, toml_edit::value(row));
        }
        document.insert("uncertainty", toml_edit::Item::Table(table));
        Ok(document.to_string())
    }
}

/// The damping ratio or loss factor that gives the belt of `stage` its damping: it belongs to the slowest swing, which a
/// fitted mass or stiffness changes. None where the text gives neither, or `read` has that damping.
///
/// c = 2 ζ k / ω₀
fn damping_share(case: &Case, read: &Machine, machine: &Machine) -> Option<String> {
    let (is, read) = (machine.belt.damping[0], read.belt.damping[0]);
    let mut keys = ["belt.damping_ratio", "belt.loss_factor"].into_iter();
    let (key, given) = keys.find_map(|key| match case.value(key) {
        Ok(Given::Number(given)) => Some((key, given)),
        _ => None,
    })?;
    (is != read && read > 0.0).then(|| format!("{key}={}", given * is / read))
}

/// The changes of the text with which `key` is `value`.
fn changes_of(machine: &Machine, case: &Case, key: &str, value: f64) -> Vec<String> {
    let Some(row) = named(key) else { return Vec::new() };
    let own: Vec<(String, f64)> = values(machine)
        .into_iter()
        .filter(|(element, _)| named(element).is_some_and(|other| other.key == row.key))
        .collect();
    let is_element = row.key != key;
    let (listed, given) = (own.len() > 1 || is_element, matches!(case.value(row.key), Ok(Given::List(_))));
    match key.starts_with("belt.") {
        // All spans at once, or one of a list that is not there.
        true if listed && !(is_element && given) => {
            let spans: Vec<String> = own.iter().map(|(_, value)| value.to_string()).collect();
            vec![format!("{}=[{}]", row.key, spans.join(", "))]
        }
        _ if listed && !is_element => own.iter().map(|(element, value)| format!("{element}={value}")).collect(),
        _ => vec![format!("{key}={value}")],
    }
}

/// The text without what says the same as these keys in another form: teeth and pitch beside a radius that was fitted.
fn without_other_forms<'a>(text: &str, keys: impl Iterator<Item = &'a str>) -> String {
    let Ok(mut document) = text.parse::<toml_edit::DocumentMut>() else { return text.to_string() };
    let fitted: Vec<&str> = keys.filter_map(|key| Some(named(key)?.key)).collect();
    let says = |row: &Parameter, key: &str| match row.field {
        Field::PartOf(whole) => whole == key && !row.key.starts_with(&format!("{key}.")),
        Field::Form(of, _) => of == key,
        Field::Machine(_) | Field::Elsewhere => false,
    };
    let mut changed = false;
    for key in fitted {
        let same = |row: &&Parameter| says(row, key) || named(key).is_some_and(|own| says(own, row.key));
        for row in parameter::all().filter(same) {
            let Some((path, last)) = row.key.rsplit_once('.') else { continue };
            let mut steps = path.split('.');
            let table = steps.try_fold(document.as_item_mut(), |item, step| item.get_mut(step));
            if let Some(table) = table.and_then(toml_edit::Item::as_table_like_mut) {
                changed |= table.remove(last).is_some();
            }
        }
    }
    if changed { document.to_string() } else { text.to_string() }
}

/// A number that two machines do not share but for rounding in text, and what it is in each; NaN where it is not there.
fn differs(a: &Machine, b: &Machine) -> Option<(String, f64, f64)> {
    let near = |a: f64, b: f64| a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs());
    let (a, b) = (values(a), values(b));
    let of = |all: &[(String, f64)], key: &str| all.iter().find(|(own, _)| own == key).map_or(f64::NAN, |own| own.1);
    let mut keys = a.iter().chain(&b).map(|(key, _)| key);
    let key = keys.find(|key| !near(of(&a, key), of(&b, key)))?;
    Some((key.clone(), of(&a, key), of(&b, key)))
}

//! The case file with the estimates in it.

use crate::case::{Case, Files, Given};
use crate::error::{Error, Result};
use crate::fit::limits::{DIGITS_KNOWN, DIGITS_READ};
use crate::fit::trust::found::{Estimate, Fit};
use crate::machine::Machine;
use crate::parameter::{self, Field, Parameter, named, values};
use crate::quantity;
use nalgebra::DMatrix;
use std::path::Path;

impl Fit {
    /// The text of the case with the estimates and a table of their uncertainty. Paths in it are those of `case`;
    /// `name` is used in messages. Read again, it gives the machine of the fit: if estimates are not determined, the
    /// machine nearest to that of the case among all that fit the logs equally well.
    ///
    /// Parameters that differ between campaigns have the values of the first; [`Fit::case_text_of`] has those of the
    /// others.
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
        let digits = Digits::new(self);
        let own = || self.estimates.iter().zip(&digits.0).filter(|(estimate, _)| is_own(estimate));
        let sets = || own().flat_map(|(estimate, share)| estimate.sets.iter().map(move |(key, to)| (key, *to, *share)));
        let text = without_other_forms(&case.text, sets().map(|(key, ..)| key.as_str()));
        let written = text.parse().unwrap_or_default();
        let mut changes: Vec<Change> =
            sets().flat_map(|(key, to, share)| changes_of(machine, case, &written, key, (to, share))).collect();
        let read = |changes: &[Change], is_rounded: bool| {
            let changes: Vec<String> = changes.iter().map(|change| change.text(is_rounded)).collect();
            let changes: Vec<&str> = changes.iter().map(String::as_str).collect();
            Case::from_text_for(name, &text, &changes, Files::Nothing)
        };
        let is_another = |fitted: &Result<Case>| {
            fitted.as_ref().map_or(true, |fitted| differs(&fitted.machine, machine, DIGITS_READ).is_some())
        };
        let mut fitted = read(&changes, false);
        let damping = fitted.as_ref().ok().and_then(|fitted| damping_share(case, &fitted.machine, machine));
        // A damping ratio refers to mass and stiffness with all digits.
        let is_rounded = damping.is_none();
        if let Some(change) = damping {
            changes.push(change);
            fitted = read(&changes, false);
        }
        // The other direction, or the breakaway, followed a fitted number: change it where the text has it, or else
        // anyway.
        for is_anywhere in [false, true] {
            if !is_another(&fitted) {
                break;
            }
            for (key, to) in values(machine) {
                let went_along = named(&key).is_some_and(|row| !row.follows.is_empty());
                let Some((body, _)) = key.split_once(".friction.").filter(|_| went_along) else { continue };
                let fitted = sets().find(|(set, ..)| set.starts_with(&format!("{body}.friction.")));
                if let Some((_, _, share)) = fitted.filter(|_| is_anywhere || case.value(&key).is_ok()) {
                    changes.push(Change::new(&written, key, to, share));
                }
            }
            fitted = read(&changes, false);
        }
        // The stated errors are wrong for a file whose machine is not that of the fit.
        if let Some((key, is, read)) = differs(machine, &fitted?.machine, DIGITS_READ) {
            return Err(Error::new(format!("the fit cannot be written: `{key}` would be read as {read}, and is {is}"))
                .in_file(name)
                .next("give the case file a value of its own for it, or leave it out of [fit]"));
        }
        let fitted = read(&changes, is_rounded)?;
        let text = fitted.text;
        let mut document: toml_edit::DocumentMut =
            text.parse().map_err(|_| Error::new("this is not TOML").in_file(name))?;
        let mut table = toml_edit::Table::new();
        let how = format!(
            "\n# Uncertainty of the estimates: SI units, standard errors, 95 % intervals. Ending of the fit: {}.\n",
            self.ending_word()
        );
        table.decor_mut().set_prefix(how);
        for (estimate, known) in self.estimates.iter().zip(&digits.0) {
            let mut row = toml_edit::InlineTable::new();
            let error = estimate.error.unwrap_or(0.0);
            let mut put = |key: &str, value: f64| {
                let step = if key == "value" { known * value.abs() } else { DIGITS_KNOWN * error };
                row.insert(key, toml_edit::Value::from(rounded_to(value, step)));
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

/// Damping ratio or loss factor that gives the belt of `machine` its damping; it refers to the slowest mode, which a
/// fitted mass or stiffness changes. None if the text has neither, or if `read` has that damping.
///
/// c = 2 ζ k / ω₀
fn damping_share(case: &Case, read: &Machine, machine: &Machine) -> Option<Change> {
    let (is, read) = (machine.belt.damping[0], read.belt.damping[0]);
    let mut keys = ["belt.damping_ratio", "belt.loss_factor"].into_iter();
    let (key, given) = keys.find_map(|key| match case.value(key) {
        Ok(Given::Number(given)) => Some((key, given)),
        _ => None,
    })?;
    let change =
        || Change { key: key.to_string(), values: vec![(None, given * is / read)], is_list: false, share: 0.0 };
    (is != read && read > 0.0).then(change)
}

/// A change of the text of a case.
struct Change {
    key: String,
    /// Each value with its unit in the text.
    values: Vec<(Option<String>, f64)>,
    is_list: bool,
    /// Relative accuracy of a value.
    share: f64,
}

impl Change {
    fn new(document: &toml_edit::DocumentMut, key: String, value: f64, share: f64) -> Self {
        Self { values: vec![(unit_at(document, &key), value)], key, is_list: false, share }
    }

    /// In the notation of `--set`.
    fn text(&self, is_rounded: bool) -> String {
        let share = if is_rounded { self.share } else { 0.0 };
        let values: Vec<String> =
            self.values.iter().map(|(unit, value)| literal(unit.as_deref(), *value, share)).collect();
        let values = values.join(", ");
        if self.is_list { format!("{}=[{values}]", self.key) } else { format!("{}={values}", self.key) }
    }
}

/// Known digits of the estimates: a relative step for each, zero for all digits.
struct Digits(Vec<f64>);

impl Digits {
    /// A tenth of the standard error with all other parameters held, relative to the estimate: rounding to that moves
    /// the residuals by less than noise, even with correlated estimates. All digits if something is not determined,
    /// since the file then has the values of the case as far as the logs allow.
    ///
    /// σ_j/√((R⁻¹)_jj), R the correlations
    fn new(fit: &Fit) -> Self {
        let n = fit.estimates.len();
        let all = Self(vec![0.0; n]);
        let is_known = fit.estimates.iter().all(|estimate| !estimate.at_bound && estimate.error.is_some());
        if !is_known || !fit.is_complete() || fit.correlation.len() != n {
            return all;
        }
        let correlation = DMatrix::from_fn(n, n, |i, j| if i == j { 1.0 } else { fit.correlation[i][j] });
        let Some(inverse) = correlation.try_inverse() else { return all };
        let step = |(j, estimate): (usize, &Estimate)| {
            let held = estimate.error.unwrap_or(0.0) / inverse[(j, j)].sqrt();
            let share = DIGITS_KNOWN * held / estimate.value.abs();
            if share.is_finite() { share.min(DIGITS_KNOWN) } else { 0.0 }
        };
        Self(fit.estimates.iter().enumerate().map(step).collect())
    }
}

/// A number to the power of ten below this step; as it is for a step of zero.
fn rounded_to(value: f64, step: f64) -> f64 {
    let place = step.log10().floor();
    if step <= 0.0 || !place.is_finite() || !value.is_finite() {
        return value;
    }
    // The shortest decimal number with this number of places: 0.1 and not 3 · 0.1 − 0.2.
    let text = match place {
        coarse if coarse > 0.0 => {
            let unit = 10f64.powf(coarse);
            format!("{}", (value / unit).round() * unit)
        }
        fine => format!("{value:.0$}", -fine as usize),
    };
    text.parse().unwrap_or(value)
}

/// Unit of the quantity at a key, if the text has one.
fn unit_at(document: &toml_edit::DocumentMut, key: &str) -> Option<String> {
    let mut item = document.as_item();
    for step in key.split('.') {
        item = match step.parse::<usize>() {
            Ok(index) if item.is_array() => item.get(index)?,
            _ => item.get(step)?,
        };
    }
    let unit = quantity::parse(item.as_str()?).ok()?.unit;
    (!unit.is_empty()).then_some(unit)
}

/// A value in the notation of a file: in this unit, rounded to a relative accuracy.
fn literal(unit: Option<&str>, value: f64, share: f64) -> String {
    let one = unit.and_then(|unit| Some((unit, quantity::parse(&format!("1 {unit}")).ok()?.value)));
    match one.filter(|(_, factor)| *factor > 0.0) {
        Some((unit, factor)) => {
            let own = value / factor;
            format!("\"{} {unit}\"", quantity::shortest(rounded_to(own, share * own.abs())))
        }
        None => rounded_to(value, share * value.abs()).to_string(),
    }
}

/// Changes of the text that give `key` a value of a relative accuracy.
fn changes_of(
    machine: &Machine,
    case: &Case,
    document: &toml_edit::DocumentMut,
    key: &str,
    (value, share): (f64, f64),
) -> Vec<Change> {
    let Some(row) = named(key) else { return Vec::new() };
    let own: Vec<(String, f64)> = values(machine)
        .into_iter()
        .filter(|(element, _)| named(element).is_some_and(|other| other.key == row.key))
        .collect();
    let is_element = row.key != key;
    let (listed, given) = (own.len() > 1 || is_element, matches!(case.value(row.key), Ok(Given::List(_))));
    match key.starts_with("belt.") {
        // All spans at once, or an element of a missing list.
        true if listed && !(is_element && given) => {
            let unit = |k: usize| unit_at(document, &format!("{}.{k}", row.key)).or_else(|| unit_at(document, row.key));
            let values = own.iter().enumerate().map(|(k, (_, value))| (unit(k), *value)).collect();
            vec![Change { key: row.key.to_string(), values, is_list: true, share }]
        }
        _ if listed && !is_element => {
            own.into_iter().map(|(element, value)| Change::new(document, element, value, share)).collect()
        }
        _ => vec![Change::new(document, key.to_string(), value, share)],
    }
}

/// The text without other forms of these keys, such as teeth and pitch for a fitted radius.
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

/// A number that differs between two machines by more than a relative rounding of text, and its value in each; NaN if
/// missing.
fn differs(a: &Machine, b: &Machine, rounding: f64) -> Option<(String, f64, f64)> {
    let near = |a: f64, b: f64| a == b || (a - b).abs() <= rounding * a.abs().max(b.abs());
    let (a, b) = (values(a), values(b));
    let of = |all: &[(String, f64)], key: &str| all.iter().find(|(own, _)| own == key).map_or(f64::NAN, |own| own.1);
    let mut keys = a.iter().chain(&b).map(|(key, _)| key);
    let key = keys.find(|key| !near(of(&a, key), of(&b, key)))?;
    Some((key.clone(), of(&a, key), of(&b, key)))
}

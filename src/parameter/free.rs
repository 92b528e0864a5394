//! Free parameters: numbers of a machine that a fit searches for, a sweep varies or that are off, with all that goes along.

use super::field::List;
use super::{Field, Off, Parameter, Sum, all, at_pulley, named};
use crate::error::{Error, Result};
use crate::friction::Friction;
use crate::stage::Stage;

/// A number of a machine: a row of the table, and its place where that is a list.
#[derive(Debug, Clone, Copy)]
struct Number {
    row: &'static Parameter,
    index: usize,
}

impl PartialEq for Number {
    /// Two forms of one number are the same.
    fn eq(&self, other: &Self) -> bool {
        let own = |row: &Parameter| match row.field {
            Field::Form(of, _) => of,
            _ => row.key,
        };
        own(self.row) == own(other.row) && self.index == other.index
    }
}

impl Number {
    fn value(self, stage: &Stage) -> Option<f64> {
        (self.row.field.accessor()?.get)(stage, self.index)
    }
}

/// A parameter that is free to have other values, and all that goes along with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// Its key, those of what is tied joined by ` = `, the name of a sum, or of a kind.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Where it starts.
    pub start: f64,
    /// Where it may go.
    pub low: f64,
    /// The other end of it.
    pub high: f64,
    /// Keys of the case file that it sets, with their value per unit of it.
    pub keys: Vec<(String, f64)>,
    /// The numbers that it sets, with their value per unit of it.
    members: Vec<(Number, f64)>,
}

/// Bounds of a parameter that are given, by name.
pub type GivenBounds = [(String, [f64; 2])];

/// How far a parameter may go from where it starts, unless its bounds are given.
const FAR: f64 = 100.0;

impl Free {
    /// What `name` stands for: a key of the case file, several joined by ` = `, which keep their present ratio (equal, where one of
    /// them is zero), or a sum such as `total.viscous`, whose parts keep theirs. What goes along with a key is set by itself if it is
    /// among `free`, the keys of all free parameters.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::parameter::Free;
    /// let mut stage = Case::from_text("axis.toml", TEMPLATE)?.stage;
    /// let viscous = Free::new(&stage, "cart.friction.viscous", &[], &[])?;
    /// viscous.set(&mut stage, 20.0);
    /// assert_eq!((stage.cart.friction.forward.viscous, stage.cart.friction.backward.viscous), (20.0, 20.0));
    ///
    /// let error = Free::new(&stage, "cart.friction.lugre.stiffness", &[], &[]).unwrap_err();
    /// assert!(error.to_string().contains("has no value in this case"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(stage: &Stage, name: &str, free: &[&str], bounds: &GivenBounds) -> Result<Self> {
        if name.starts_with("total.") {
            return Self::sum(stage, name, free, bounds);
        }
        let keys: Vec<&str> = name.split(" = ").collect();
        let sets = keys.iter().map(|key| numbers(stage, key)).collect::<Result<Vec<_>>>()?;
        let values: Vec<f64> = sets.iter().filter_map(|(numbers, _)| numbers.first()?.value(stage)).collect();
        let first = values.first().copied().unwrap_or_default();
        let ratios: Vec<f64> = match values.contains(&0.0) {
            true => vec![1.0; values.len()],
            false => values.iter().map(|value| value / first).collect(),
        };
        let mut members = Vec::new();
        for ((key, (numbers, row)), ratio) in keys.iter().zip(&sets).zip(&ratios) {
            for &number in numbers {
                // The elements of a list keep their ratios among each other.
                let present = number.value(stage).unwrap_or(0.0);
                let listed = numbers.len() > 1 && first != 0.0 && present != 0.0;
                members.push((number, if listed { present / first } else { *ratio }));
            }
            if numbers.len() == 1 && row.key == *key {
                let is_free = |other: &str| free.contains(&other) || keys.contains(&other);
                members.extend(followers(stage, row, &is_free).map(|number| (number, *ratio)));
            }
        }
        let row = sets.first().map(|(_, row)| *row);
        let keys: Vec<(String, f64)> = keys.iter().zip(&ratios).map(|(key, ratio)| (key.to_string(), *ratio)).collect();
        let range = row.map_or((f64::NEG_INFINITY, f64::INFINITY), |row| (row.range.low, row.range.high));
        let (low, high) = limits(name, &keys, first, range, bounds)?;
        Ok(Self {
            name: name.to_string(),
            unit: row.map_or("", |row| row.unit),
            start: first,
            low,
            high,
            keys,
            members,
        })
    }

    /// A sum over all bodies, at the drive pulley; its parts keep their ratios.
    fn sum(stage: &Stage, name: &str, free: &[&str], bounds: &GivenBounds) -> Result<Self> {
        let Some(sum) = Sum::named(name) else {
            return Err(Error::new(format!("there is no group `{name}`")).allowed(Sum::ALL.map(Sum::name).join(", ")));
        };
        let mut parts: Vec<(String, Number, f64)> = Vec::new();
        for row in sum.parts(true) {
            for number in numbers(stage, row.key)?.0 {
                parts.push((element_key(row, number.index), number, number.value(stage).unwrap_or(0.0)));
            }
        }
        let total: f64 = parts.iter().map(|(key, _, value)| value * at_pulley(stage, key)).sum();
        if total <= 0.0 {
            let keys: Vec<&str> = parts.iter().map(|(key, ..)| key.as_str()).collect();
            return Err(Error::new(format!("all parts of `{name}` are zero, so their ratios are not known"))
                .next(format!("give one of {} a value, or free it by itself", keys.join(", "))));
        }
        let is_free = |key: &str| free.contains(&key) || parts.iter().any(|(own, ..)| own == key);
        let mut members = Vec::new();
        for (_, number, value) in &parts {
            members.push((*number, value / total));
            members.extend(followers(stage, number.row, &is_free).map(|number| (number, value / total)));
        }
        let (low, high) = limits(name, &[], total, (0.0, 1e15), bounds)?;
        let keys = parts.into_iter().map(|(key, _, value)| (key, value / total)).collect();
        Ok(Self { name: name.to_string(), unit: sum.unit(), start: total, low, high, keys, members })
    }

    /// Puts `value` into `stage`. Of several free parameters that is for [`set`].
    pub fn set(&self, stage: &mut Stage, value: f64) {
        set(stage, [(self, value)]);
    }

    /// Whether both set a number of the machine.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.members.iter().any(|(number, _)| other.members.iter().any(|(its, _)| its == number))
    }

    /// Whether it is searched for on a logarithmic scale: what is above zero by nature, over more than a factor of two.
    pub fn logarithmic(&self) -> bool {
        self.low > 0.0 && self.high > 2.0 * self.low
    }
}

/// Puts values of free parameters into `stage`, in whatever order.
pub fn set<'a>(stage: &mut Stage, values: impl IntoIterator<Item = (&'a Free, f64)>) {
    for (free, value) in values {
        for (number, factor) in &free.members {
            if let Some(accessor) = number.row.field.accessor() {
                (accessor.set)(stage, number.index, value * factor);
            }
        }
    }
    // At rest a body holds at least what it resists with in motion.
    let bodies = [&mut stage.drive_pulley.friction, &mut stage.cart.friction, &mut stage.idler_pulley.friction];
    for Friction { forward, backward, .. } in bodies {
        forward.breakaway = forward.breakaway.max(forward.coulomb);
        backward.breakaway = backward.breakaway.max(backward.coulomb);
    }
}

/// The present value of a parameter, of a list the first one.
pub fn value(stage: &Stage, key: &str) -> Option<f64> {
    numbers(stage, key).ok()?.0.first()?.value(stage)
}

/// All numbers of a machine by their keys, of every form.
pub fn values(stage: &Stage) -> Vec<(String, f64)> {
    let of = |row: &'static Parameter| {
        let accessor = row.field.accessor()?;
        let value = move |index| Some((element_key(row, index), (accessor.get)(stage, index)?));
        Some((0..(accessor.count)(stage)).filter_map(value))
    };
    all().filter_map(of).flatten().collect()
}

/// The keys of everything of a machine that may be off and is not zero. Directions and breakaways that have the same value count
/// once.
pub fn every(stage: &Stage) -> Vec<String> {
    let mut keys = Vec::new();
    for row in all().filter(|row| row.off != Off::No && !follows_any(stage, row)) {
        let there = present(stage, row).filter(|(_, value)| *value != 0.0);
        keys.extend(there.map(|(number, _)| element_key(row, number.index)));
    }
    // Body by body, as the paper counts them, friction last: the order in which a seed draws them.
    let rank = |key: &String| match key.split_once(".friction.") {
        None if key.starts_with("idler_pulley.") => 1,
        None if key.starts_with("cart.") => 2,
        None if key.starts_with("belt.") => 3,
        None => 0,
        Some(("drive_pulley", _)) => 4,
        Some(("cart", _)) => 5,
        Some(_) => 6,
    };
    keys.sort_by_key(rank);
    keys
}

/// What may be off of a machine, each as a factor on all numbers that are tied by nature.
pub fn kinds(stage: &Stage) -> Vec<Free> {
    let mut kinds: Vec<Free> = Vec::new();
    for row in all() {
        let Off::With(name) = row.off else { continue };
        let own = present(stage, row).filter(|(_, value)| *value != 0.0);
        let own: Vec<(Number, f64)> = own.collect();
        match kinds.iter_mut().find(|kind| kind.name == name) {
            _ if own.is_empty() => {}
            Some(kind) => kind.members.extend(own),
            None => kinds.push(Free {
                name: name.to_string(),
                unit: "",
                start: 1.0,
                low: 0.0,
                high: f64::INFINITY,
                keys: Vec::new(),
                members: own,
            }),
        }
    }
    kinds
}

/// The numbers of a row that a machine has, with their finite values.
fn present<'a>(stage: &'a Stage, row: &'static Parameter) -> impl Iterator<Item = (Number, f64)> + 'a {
    let accessor = row.field.accessor();
    let count = accessor.map_or(0, |accessor| (accessor.count)(stage));
    (0..count).filter_map(move |index| {
        let number = Number { row, index };
        Some((number, number.value(stage).filter(|value| value.is_finite())?))
    })
}

/// Whether it has the value of something that it follows.
fn follows_any(stage: &Stage, row: &'static Parameter) -> bool {
    row.follows.iter().any(|key| is_equal(stage, row, key))
}

fn is_equal(stage: &Stage, row: &'static Parameter, key: &str) -> bool {
    let own = Number { row, index: 0 }.value(stage);
    own.is_some() && own == value(stage, key)
}

/// What goes along with `row` where `is_free` are set by themselves.
fn followers<'a>(
    stage: &'a Stage,
    row: &'static Parameter,
    is_free: &'a dyn Fn(&str) -> bool,
) -> impl Iterator<Item = Number> + 'a {
    let goes_along = move |other: &&'static Parameter| {
        !other.follows.is_empty() && !is_free(other.key) && leader(stage, other, is_free) == Some(row.key)
    };
    all().filter(goes_along).map(|row| Number { row, index: 0 })
}

/// The key that a parameter goes with: its own if that is free, or what it follows, directly or by way of another one.
fn leader(stage: &Stage, row: &'static Parameter, is_free: &dyn Fn(&str) -> bool) -> Option<&'static str> {
    if is_free(row.key) {
        return Some(row.key);
    }
    let equal = || row.follows.iter().filter(|key| is_equal(stage, row, key));
    let further = || equal().find_map(|key| leader(stage, named(key)?, is_free));
    equal().find(|key| is_free(key)).copied().or_else(further)
}

/// The key of an element, as `--set` names it.
pub(super) fn element_key(row: &Parameter, index: usize) -> String {
    match row.field.accessor().map_or(List::None, |accessor| accessor.list) {
        List::None => row.key.to_string(),
        List::Numbers => format!("{}.{index}", row.key),
        List::Points => match row.key.rsplit_once('.') {
            Some((points, name)) => format!("{points}.{index}.{name}"),
            None => row.key.to_string(),
        },
    }
}

/// The numbers that a key names, and its row. Errors: a key that names none, or one that this machine has not.
fn numbers(stage: &Stage, key: &str) -> Result<(Vec<Number>, &'static Parameter)> {
    let row = named(key).ok_or_else(|| unknown(stage, key))?;
    let accessor = match &row.field {
        Field::Machine(accessor) | Field::Form(_, accessor) => accessor,
        Field::PartOf(whole) => {
            return Err(Error::new(format!("`{key}` is only a part of what `{whole}` is computed from"))
                .next(format!("name `{whole}` instead")));
        }
        Field::Elsewhere => {
            return Err(Error::new(format!("`{key}` is no number of the machine"))
                .allowed("numbers of motor, amplifier, pulleys, cart, belt, travel and encoder")
                .next("name one of them as --set does, such as cart.mass or cart.friction.viscous"));
        }
    };
    let count = (accessor.count)(stage);
    let whole = row.key == key;
    let named = |index: &usize| whole || element_key(row, *index) == key;
    let numbers: Vec<Number> = (0..count).filter(named).map(|index| Number { row, index }).collect();
    if numbers.is_empty() && count > 0 {
        // Of a number there are no elements, of a list not that many.
        return Err(match accessor.list {
            List::None => unknown(stage, key),
            _ => Error::new(format!("`{key}` is none of the {count} that there are")).allowed(format!(
                "{} to {}",
                element_key(row, 0),
                element_key(row, count - 1)
            )),
        });
    }
    let there = |number: &Number| number.value(stage).is_some_and(f64::is_finite);
    match !numbers.is_empty() && numbers.iter().all(there) {
        true => Ok((numbers, row)),
        false => Err(not_there(stage, key, row)),
    }
}

/// The least and the greatest value: as given for the name, or for any of the keys, which are so many times as large; else far from
/// the start and within the range.
fn limits(
    name: &str,
    keys: &[(String, f64)],
    start: f64,
    (least, most): (f64, f64),
    bounds: &GivenBounds,
) -> Result<(f64, f64)> {
    let factor = |bounded: &str| match keys.iter().find(|(key, _)| key == bounded) {
        Some((_, factor)) => Some(*factor),
        None => (bounded == name).then_some(1.0),
    };
    let ends = bounds.iter().filter_map(|(bounded, ends)| factor(bounded).map(|factor| ends.map(|end| end / factor)));
    let given = ends.reduce(|one, other| [one[0].max(other[0]), one[1].min(other[1])]);
    let (low, high) = match given {
        Some([low, high]) => (low, high),
        // What may be zero may become zero.
        None if start > 0.0 && least == 0.0 => (0.0, (start * FAR).min(most)),
        None if start > 0.0 && least > 0.0 => ((start / FAR).max(least), (start * FAR).min(most)),
        None => (least, most),
    };
    if !(low..=high).contains(&start) {
        return Err(Error::new(format!("{name} starts at {start}, outside its bounds"))
            .allowed(format!("from {low} to {high}"))
            .next("start it within them, or widen [fit.bounds]"));
    }
    Ok((low, high))
}

fn unknown(stage: &Stage, key: &str) -> Error {
    let error = Error::new(format!("`{key}` is no parameter of the machine"));
    let whole = all().filter(|row| row.field.accessor().is_some()).map(|row| row.key.to_string());
    let known: Vec<String> = whole.chain(values(stage).into_iter().map(|(key, _)| key)).collect();
    let distance = |name: &str| strsim::damerau_levenshtein(name, key);
    match known.iter().min_by_key(|name| distance(name)) {
        Some(near) if distance(near) * 3 <= key.len() => error.next(format!("did you mean `{near}`?")),
        _ => error.next("name a machine's number as --set does, such as cart.mass or cart.friction.viscous"),
    }
}

/// Of a parameter that this machine has not: what it has in the same table, and what to do.
fn not_there(stage: &Stage, key: &str, row: &Parameter) -> Error {
    let table = match key.split_once(".friction.") {
        Some((body, _)) => format!("{body}.friction."),
        None => format!("{}.", key.split('.').next().unwrap_or_default()),
    };
    let beside = values(stage).into_iter().map(|(key, _)| key);
    let beside: Vec<String> = beside.filter(|other| other.starts_with(&table)).collect();
    let error = Error::new(format!("`{key}` has no value in this case"));
    let error = if beside.is_empty() { error } else { error.allowed(beside.join(", ")) };
    let (parent, name) = row.key.rsplit_once('.').unwrap_or_default();
    let is_made = stage.belt.make.is_some();
    error.next(match row.field {
        Field::Form(of, _) if value(stage, of).is_some() => format!("name `{of}` instead"),
        _ if row.key == "belt.stiffness" && is_made => {
            "it follows from modulus, section and spans: name one of these".into()
        }
        _ if matches!(name, "modulus" | "section" | "spans") && !is_made => {
            "name one of these, or give modulus, section and spans instead of stiffness".into()
        }
        _ if name.starts_with("static") => "it follows from coulomb and stribeck.force: name one of these".into(),
        _ if row.key == "motor.gear_efficiency" => "a gear that gives way has none: name gear_damping".into(),
        _ if parent.ends_with(".along") => {
            "give along to start from, such as along = [[\"0 m\", 1], [\"0.1 m\", 1.5]]".into()
        }
        _ => format!("give it one to start from, such as {name} = \"{}\" in {parent}", row.example),
    })
}

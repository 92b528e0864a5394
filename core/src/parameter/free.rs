//! Free parameters: numbers of a machine that a fit estimates, a sweep varies or a family perturbs, with all that
//! depends on them.

use super::field::List;
use super::{Field, Off, Parameter, Sits, Sum, all, at_pulley};
use crate::error::{Error, Result};
use crate::friction::Friction;
use crate::machine::Machine;

/// A number of a machine: a row of the table, and its index in a list.
#[derive(Debug, Clone, Copy)]
struct Number {
    row: &'static Parameter,
    index: usize,
}

impl PartialEq for Number {
    /// Two forms of one number are equal.
    fn eq(&self, other: &Self) -> bool {
        let own = |row: &Parameter| match row.field {
            Field::Form(of, _) => of,
            _ => row.key,
        };
        own(self.row) == own(other.row) && self.index == other.index
    }
}

impl Number {
    fn value(self, machine: &Machine) -> Option<f64> {
        machine.get(self.row, self.index)
    }

    /// Its key for `--set`.
    fn key(self, machine: &Machine) -> String {
        machine.sits(self.row).key(self.row, self.index)
    }
}

/// A free parameter with everything that depends on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Free {
    /// Its key, keys of tied numbers joined by ` = `, or the name of a sum or a kind.
    pub name: String,
    /// SI unit.
    pub unit: &'static str,
    /// Start value.
    pub start: f64,
    /// Bounds.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Keys of the case file that it sets, with their factors.
    pub keys: Vec<(String, f64)>,
    /// Numbers that it sets, with their factors.
    members: Vec<(Number, f64)>,
}

/// Given bounds of parameters by name.
pub type GivenBounds = [(String, [f64; 2])];

/// Default bounds: factor from the start value.
const FAR: f64 = 100.0;

impl Free {
    /// The parameter for `name`: a key of the case file, several joined by ` = `, which keep their present ratio (equal
    /// if one of them is zero), or a sum such as `total.viscous`, whose parts keep theirs. A number that follows a key
    /// is independent if it is among `free`, the keys of all free parameters.
    ///
    /// ```
    /// use taut::case::{Case, TEMPLATE};
    /// use taut::parameter::Free;
    /// let mut stage = Case::from_text("axis.toml", TEMPLATE)?.machine;
    /// let viscous = Free::new(&stage, "cart.friction.viscous", &[], &[])?;
    /// viscous.set(&mut stage, 20.0);
    /// assert_eq!((stage.cart.friction.forward.viscous, stage.cart.friction.backward.viscous), (20.0, 20.0));
    ///
    /// let error = Free::new(&stage, "cart.friction.lugre.stiffness", &[], &[]).unwrap_err();
    /// assert!(error.to_string().contains("has no value in this case"));
    /// # Ok::<(), taut::Error>(())
    /// ```
    pub fn new(machine: &Machine, name: &str, free: &[&str], bounds: &GivenBounds) -> Result<Self> {
        if name.starts_with("total.") {
            return Self::sum(machine, name, free, bounds);
        }
        let keys: Vec<&str> = name.split(" = ").collect();
        let sets = keys.iter().map(|key| numbers(machine, key, free)).collect::<Result<Vec<_>>>()?;
        let values: Vec<f64> = sets.iter().filter_map(|(numbers, _)| numbers.first()?.value(machine)).collect();
        let first = values.first().copied().unwrap_or_default();
        let ratios: Vec<f64> = match values.contains(&0.0) {
            true => vec![1.0; values.len()],
            false => values.iter().map(|value| value / first).collect(),
        };
        let mut members = Vec::new();
        for ((key, (numbers, _)), ratio) in keys.iter().zip(&sets).zip(&ratios) {
            for &number in numbers {
                // The elements of a list keep their ratios.
                let present = number.value(machine).unwrap_or(0.0);
                let listed = numbers.len() > 1 && first != 0.0 && present != 0.0;
                members.push((number, if listed { present / first } else { *ratio }));
            }
            if let [number] = numbers[..]
                && number.key(machine) == *key
            {
                let is_free = |other: &str| free.contains(&other) || keys.contains(&other);
                members.extend(followers(machine, number, &is_free).map(|number| (number, *ratio)));
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
    fn sum(machine: &Machine, name: &str, free: &[&str], bounds: &GivenBounds) -> Result<Self> {
        if machine.bridge.is_some() {
            return Err(Error::new(format!(
                "`{name}` is a sum over the bodies of a single axis, and this is a gantry"
            ))
            .next("name a number of the gantry by its key, such as cart.mass or bridge.friction.viscous"));
        }
        let Some(sum) = Sum::named(name) else {
            return Err(Error::new(format!("there is no group `{name}`")).allowed(Sum::ALL.map(Sum::name).join(", ")));
        };
        let mut parts: Vec<(String, Number, f64)> = Vec::new();
        for row in sum.parts(true) {
            for number in numbers(machine, row.key, &[])?.0 {
                parts.push((number.key(machine), number, number.value(machine).unwrap_or(0.0)));
            }
        }
        let total: f64 = parts.iter().map(|(key, _, value)| value * at_pulley(machine, key)).sum();
        if total <= 0.0 {
            let keys: Vec<&str> = parts.iter().map(|(key, ..)| key.as_str()).collect();
            return Err(Error::new(format!("all parts of `{name}` are zero, so their ratios are not known"))
                .next(format!("give one of {} a value, or free it by itself", keys.join(", "))));
        }
        let is_free = |key: &str| free.contains(&key) || parts.iter().any(|(own, ..)| own == key);
        let mut members = Vec::new();
        for (_, number, value) in &parts {
            members.push((*number, value / total));
            members.extend(followers(machine, *number, &is_free).map(|number| (number, value / total)));
        }
        let (low, high) = limits(name, &[], total, (0.0, 1e15), bounds)?;
        let keys = parts.into_iter().map(|(key, _, value)| (key, value / total)).collect();
        Ok(Self { name: name.to_string(), unit: sum.unit(), start: total, low, high, keys, members })
    }

    /// Sets `value` in a machine. For several free parameters use [`set`].
    pub fn set(&self, machine: &mut Machine, value: f64) {
        set(machine, [(self, value)]);
    }

    /// Its value in a machine; it differs from the value set if that is impossible, as a breakaway below Coulomb
    /// friction.
    pub fn value_in(&self, machine: &Machine) -> Option<f64> {
        let (number, factor) = self.members.first()?;
        Some(number.value(machine)? / factor)
    }

    /// True if both set a number of the machine.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.members.iter().any(|(number, _)| other.members.iter().any(|(its, _)| its == number))
    }

    /// True if it is searched for on a logarithmic scale: positive by nature, with bounds more than a factor of two
    /// apart.
    pub fn logarithmic(&self) -> bool {
        self.low > 0.0 && self.high > 2.0 * self.low
    }
}

/// Sets values of free parameters in a machine, independent of their order.
pub fn set<'a>(machine: &mut Machine, values: impl IntoIterator<Item = (&'a Free, f64)>) {
    for (free, value) in values {
        for (number, factor) in &free.members {
            machine.set(number.row, number.index, value * factor);
        }
    }
    // Breakaway is at least Coulomb friction.
    for Friction { forward, backward, .. } in machine.frictions() {
        forward.breakaway = forward.breakaway.max(forward.coulomb);
        backward.breakaway = backward.breakaway.max(backward.coulomb);
    }
}

/// Present value of a parameter; for a list, of its first element.
pub fn value(machine: &Machine, key: &str) -> Option<f64> {
    numbers(machine, key, &[]).ok()?.0.first()?.value(machine)
}

/// All numbers of a machine by their keys, in every form.
pub fn values(machine: &Machine) -> Vec<(String, f64)> {
    let of = |row: &'static Parameter| {
        let sits = machine.sits(row);
        let (_, count) = sits.listed()?;
        let value = move |index| Some((sits.key(row, index), machine.get(row, index)?));
        Some((0..count).filter_map(value))
    };
    all().filter_map(of).flatten().collect()
}

/// The numbers of a machine by their keys, with their rows: each in one form, without those that follow another number
/// with an equal value.
pub fn own(machine: &Machine) -> Vec<(String, &'static Parameter)> {
    let of = |row: &'static Parameter| {
        let is_one = matches!(machine.sits(row), Sits::Machine(..));
        let numbers = present(machine, row).filter(|(number, _)| !follows_any(machine, *number));
        let numbers: Vec<Number> = numbers.map(|(number, _)| number).filter(|_| is_one).collect();
        numbers.into_iter().map(move |number| (number.key(machine), row))
    };
    all().flat_map(of).collect()
}

/// Keys of all numbers of a machine that may vary and are not zero. Equal directions and breakaways, and equal drives,
/// count once.
pub fn every(machine: &Machine) -> Vec<String> {
    let mut keys = Vec::new();
    for row in all().filter(|row| row.off != Off::No) {
        let there: Vec<(Number, f64)> = present(machine, row).filter(|(_, value)| *value != 0.0).collect();
        if are_alike_drives(machine, row) && !there.is_empty() {
            keys.push(row.key.to_string());
            continue;
        }
        let leads = there.into_iter().filter(|(number, _)| !follows_any(machine, *number));
        keys.extend(leads.map(|(number, _)| number.key(machine)));
    }
    // Body by body, in the paper's order, friction last: the order of drawing by a seed.
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

/// Numbers of a machine that may vary, each as a factor on all physically linked numbers.
pub fn kinds(machine: &Machine) -> Vec<Free> {
    let mut kinds: Vec<Free> = Vec::new();
    for row in all() {
        let Off::With(name) = row.off else { continue };
        let own = present(machine, row).filter(|(_, value)| *value != 0.0);
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

/// The same without the numbers that `others` set; a reduced kind is named by its keys.
pub fn kinds_without(machine: &Machine, others: &[&Free]) -> Vec<Free> {
    let is_set = |number: &Number| others.iter().any(|other| other.members.iter().any(|(set, _)| set == number));
    let mut kinds = kinds(machine);
    for kind in &mut kinds {
        let all = kind.members.len();
        kind.members.retain(|(number, _)| !is_set(number));
        if kind.members.len() < all {
            let keys: Vec<String> = kind.members.iter().map(|(number, _)| number.key(machine)).collect();
            kind.name = keys.join(" = ");
        }
    }
    kinds.retain(|kind| !kind.members.is_empty());
    kinds
}

/// Numbers of a row in a machine, with finite values.
fn present<'a>(machine: &'a Machine, row: &'static Parameter) -> impl Iterator<Item = (Number, f64)> + 'a {
    let count = machine.sits(row).listed().map_or(0, |(_, count)| count);
    (0..count).filter_map(move |index| {
        let number = Number { row, index };
        Some((number, number.value(machine).filter(|value| value.is_finite())?))
    })
}

/// True if all drives of a gantry have equal values of this number, which then belongs to `motor` or `amplifier`.
fn are_alike_drives(machine: &Machine, row: &'static Parameter) -> bool {
    let Some((List::Drives(_), count)) = machine.sits(row).listed() else { return false };
    let first = machine.get(row, 0);
    first.is_some() && (1..count).all(|index| machine.get(row, index) == first)
}

/// True if it equals a number that it follows.
fn follows_any(machine: &Machine, number: Number) -> bool {
    leads(machine, number).next().is_some()
}

/// Numbers of the same body that a number follows and equals, in order of precedence.
fn leads<'a>(machine: &'a Machine, number: Number) -> impl Iterator<Item = Number> + 'a {
    let Number { row, index } = number;
    let own = number.value(machine);
    let followed = row.follows.iter().filter_map(move |key| Some(Number { row: super::find(key)?, index }));
    followed.filter(move |lead| own.is_some() && own == lead.value(machine))
}

/// Numbers that follow `number`, where those that `is_free` names are independent.
fn followers<'a>(
    machine: &'a Machine,
    number: Number,
    is_free: &'a dyn Fn(&str) -> bool,
) -> impl Iterator<Item = Number> + 'a {
    let of_row = move |row: &'static Parameter| Number { row, index: number.index };
    let goes_along = move |other: &Number| {
        !other.row.follows.is_empty()
            && !is_free(&other.key(machine))
            && leader(machine, *other, is_free).is_some_and(|lead| lead.row.key == number.row.key)
    };
    all().map(of_row).filter(goes_along)
}

/// Leader of a number: itself if free, otherwise the number that it follows, directly or indirectly.
fn leader(machine: &Machine, number: Number, is_free: &dyn Fn(&str) -> bool) -> Option<Number> {
    let is_free_itself = |number: &Number| is_free(&number.key(machine));
    if is_free_itself(&number) {
        return Some(number);
    }
    let further = || leads(machine, number).find_map(|lead| leader(machine, lead, is_free));
    leads(machine, number).find(is_free_itself).or_else(further)
}

/// Numbers that a key names, without those of a drive that are in `free` separately, and its row. Errors: an unknown
/// key, or one that this machine lacks.
fn numbers(machine: &Machine, key: &str, free: &[&str]) -> Result<(Vec<Number>, &'static Parameter)> {
    let row = machine.row(key).ok_or_else(|| unknown(machine, key))?;
    let sits = machine.sits(row);
    let (list, count) = match sits {
        Sits::Machine(list, count) | Sits::Form(_, list, count) => (list, count),
        Sits::PartOf(whole) => {
            return Err(Error::new(format!("`{key}` is only a part of what `{whole}` is computed from"))
                .next(format!("name `{whole}` instead")));
        }
        Sits::Elsewhere if machine.bridge.is_some() => {
            let what = if row.field.accessor().is_some() {
                "is of a single axis, and this is a gantry"
            } else {
                "is not a number of the machine"
            };
            return Err(of_gantries(machine, Error::new(format!("`{key}` {what}"))));
        }
        Sits::Elsewhere if key == "motor.speed_constant" || key.starts_with("motor.rated.") => {
            return Err(Error::new(format!("`{key}` is a number of the data sheet, and not of the machine")).next(
                "name what follows from it: motor.torque_constant, motor.back_emf_constant or motor.resistance",
            ));
        }
        Sits::Elsewhere => {
            return Err(Error::new(format!("`{key}` is not a number of the machine"))
                .allowed("numbers of motor, amplifier, pulleys, cart, belt, travel and encoder")
                .next("name one of them by its key, such as cart.mass or cart.friction.viscous"));
        }
    };
    let whole = row.key == key && list.has_whole();
    let named = |index: &usize| whole || list.key(row.key, *index) == key;
    let mut numbers: Vec<Number> = (0..count).filter(named).map(|index| Number { row, index }).collect();
    if numbers.is_empty() && count > 0 {
        // A single number has no elements, or a list not as many.
        return Err(match list {
            List::None | List::Drives(_) | List::Slides => unknown(machine, key),
            List::Numbers | List::Points | List::SlidePoints(_) => Error::new(format!(
                "`{key}` does not exist: there are {count}"
            ))
            .allowed(format!("{} to {}", list.key(row.key, 0), list.key(row.key, count - 1))),
        });
    }
    if whole && matches!(list, List::Drives(_)) {
        numbers.retain(|number| !free.contains(&number.key(machine).as_str()));
        if let [first, rest @ ..] = &numbers[..]
            && rest.iter().any(|other| other.value(machine) != first.value(machine))
        {
            return Err(Error::new(format!("`{key}` is not the same in all drives")).next(format!(
                "name {}",
                (0..count).map(|index| format!("`{}`", list.key(key, index))).collect::<Vec<_>>().join(" or ")
            )));
        }
    }
    let there = |number: &Number| number.value(machine).is_some_and(f64::is_finite);
    match !numbers.is_empty() && numbers.iter().all(there) {
        true => Ok((numbers, row)),
        false => Err(not_there(machine, key, row)),
    }
}

/// Bounds: as given for the name or, scaled, for one of its keys; otherwise far from the start and within the range.
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
        // A parameter that may be zero can reach zero.
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

fn unknown(machine: &Machine, key: &str) -> Error {
    let error = Error::new(format!("`{key}` is not a parameter of the machine"));
    let whole = |row: &Parameter| machine.sits(row).listed().is_some_and(|(list, _)| list.has_whole());
    let whole = all().filter(|row| whole(row)).map(|row| row.key.to_string());
    let known: Vec<String> = whole.chain(values(machine).into_iter().map(|(key, _)| key)).collect();
    let distance = |name: &str| strsim::damerau_levenshtein(name, key);
    let near = known.iter().min_by_key(|name| distance(name)).filter(|near| distance(near) * 3 <= key.len());
    let error = if machine.bridge.is_some() { of_gantries(machine, error) } else { error };
    match near {
        Some(near) => error.next(format!("did you mean `{near}`?")),
        None if machine.bridge.is_some() => error,
        None => error.next("name a machine's number by its key, such as cart.mass or cart.friction.viscous"),
    }
}

/// Adds the corresponding keys of a gantry.
fn of_gantries(machine: &Machine, error: Error) -> Error {
    let keys = keys_there(machine).join(", ");
    error.allowed(keys).next("of one drive alone write for example left_drive.motor.resistance")
}

/// Keys of a machine's numbers; lists and equal drives by their common key if they have one.
fn keys_there(machine: &Machine) -> Vec<String> {
    let keys = |row: &'static Parameter| -> Vec<String> {
        let sits = machine.sits(row);
        match sits.listed() {
            Some((list, _)) if list.has_whole() && present(machine, row).next().is_some() => vec![row.key.to_string()],
            _ => present(machine, row).map(|(number, _)| number.key(machine)).collect(),
        }
    };
    all().flat_map(keys).collect()
}

/// Error for a parameter that this machine lacks, with those in the same table and the next step.
fn not_there(machine: &Machine, key: &str, row: &Parameter) -> Error {
    let table = match key.split_once(".friction.") {
        Some((body, _)) => format!("{body}.friction."),
        None => format!("{}.", key.split('.').next().unwrap_or_default()),
    };
    let beside = values(machine).into_iter().map(|(key, _)| key);
    let beside: Vec<String> = beside.filter(|other| other.starts_with(&table)).collect();
    let error = Error::new(format!("`{key}` has no value in this case"));
    let error = if beside.is_empty() { error } else { error.allowed(beside.join(", ")) };
    let (parent, name) = row.key.rsplit_once('.').unwrap_or_default();
    let has = |key: &str| super::find(key).is_some_and(|row| machine.get(row, 0).is_some());
    let (is_made, is_specific) = (has("belt.modulus"), has("belt.specific_stiffness"));
    // A gantry's cart uses the row of the bridge.
    let parent = key.rsplit_once('.').filter(|(_, last)| *last == name).map_or(parent, |(parent, _)| parent);
    let form = match machine.sits(row) {
        Sits::Form(of, list, count) => {
            let place = (0..count).find(|index| list.key(row.key, *index) == key);
            Some(list.key(of, place.unwrap_or(0))).filter(|of| value(machine, of).is_some())
        }
        Sits::Machine(..) | Sits::PartOf(_) | Sits::Elsewhere => None,
    };
    error.next(match form {
        Some(of) => format!("name `{of}` instead"),
        _ if matches!(row.key, "belt.stiffness" | "belt.modulus" | "belt.section") && is_specific => {
            "it follows from specific_stiffness and spans: name one of these".into()
        }
        _ if row.key.starts_with("motor.") && has("drive.force_per_input") => {
            "this case has a [drive] instead of [motor]: name drive.force_per_input or drive.drag".into()
        }
        _ if row.key == "belt.stiffness" && is_made => {
            "it follows from modulus, section and spans: name one of these".into()
        }
        _ if matches!(name, "modulus" | "section" | "spans") && !is_made => {
            "name one of these, or give modulus, section and spans instead of stiffness".into()
        }
        _ if name.starts_with("static") => "it follows from coulomb and stribeck.force: name one of these".into(),
        _ if row.key.starts_with("cart.friction.along.") => {
            "give along to start from, such as along = [[\"0 m\", 1], [\"0.1 m\", 1.5]]".into()
        }
        _ if row.key.starts_with("cart.force_along.") => {
            "give force_along to start from, such as force_along = [[\"0 m\", \"0 N\"], [\"0.1 m\", \"1 N\"]]".into()
        }
        _ if row.key.ends_with("force_by_speed.force") || row.key.ends_with("force_by_speed.speed") => {
            "give force_by_speed to start from, such as force_by_speed = [[\"0 m/s\", \"0 N\"], [\"0.1 m/s\", \"1 N\"]]"
                .into()
        }
        _ => format!("give it one to start from, such as {name} = \"{}\" in {parent}", row.example),
    })
}

//! The moves: to a place, through points, or as a list in the manner of G-code; of a gantry in its plane.

use super::reader::{Field, Table};
use super::suggestion;
use super::{MOST_SAMPLES, check_name, file_name};
use crate::design::Design;
use crate::error::{Error, Result};
use crate::machine::Machine;
use crate::quantity::{rounded, show};
use crate::reach::feasible::{Shortfall, shortfalls};
use crate::reach::quickest::{MovePath, Quickest, Share, Wanted, modes};
use crate::signal::arc::Arc;
use crate::signal::gcode;
use crate::signal::profile::{Leg, Limits, Passage, Profile};

/// Tolerance for rounding at the ends of an arc, m.
const ROUNDING: f64 = 1e-12;

/// A closed-loop move: references of the sliding parts, and what is evaluated.
#[derive(Debug, Clone)]
pub struct Move {
    /// Its name, unique among the moves.
    pub name: String,
    /// The reference of each coordinate: that of the cart of an axis, those of bridge and cart of a gantry.
    pub profiles: Vec<Profile>,
    /// True if its limits are those of a plan of the machine, and not numbers of the file.
    pub is_planned: bool,
    /// End of the run, s.
    pub until: f64,
    /// Interval between rows, s.
    pub every: f64,
    /// How near its target the cart counts as settled, m.
    pub window: f64,
}

impl Move {
    /// Its name as that of a file, without ending.
    pub fn file_name(&self) -> String {
        file_name(&self.name)
    }

    /// The reference of the first coordinate: the cart's of an axis.
    pub fn profile(&self) -> &Profile {
        &self.profiles[0]
    }

    /// End of the references, s.
    pub fn end(&self) -> f64 {
        Profile::last_end(&self.profiles)
    }

    /// The references, through the shaper of this controller.
    pub fn references(&self, design: &Design) -> Vec<Profile> {
        design.shaped(&self.profiles)
    }

    /// The limits that its references exceed on a machine under this controller.
    pub fn shortfalls(&self, machine: &Machine, design: &Design) -> Vec<Shortfall> {
        shortfalls(machine, design.bounds(), &self.references(design))
    }
}

pub(super) fn moves(root: &Table, machine: &Machine, design: Option<&Design>) -> Result<Vec<Move>> {
    let Some(field) = root.optional("move") else { return Ok(Vec::new()) };
    if field.is_table() {
        return Err(field
            .fail("expected a list of tables")
            .next("write [[move]] with double brackets: there can be several"));
    }
    let Some(design) = design else {
        return Err(field
            .fail("there is no controller that could follow it")
            .next(format!("add [controller] with for example {}", suggestion::controller(machine))));
    };
    let mut moves: Vec<Move> = Vec::new();
    for field in field.filled_list()? {
        let table = field.clone().named("move").table()?;
        let one = one(&table, machine, design)?;
        if let Some(other) = moves.iter().find(|other| other.file_name() == one.file_name()) {
            let name = table.required("name", "a name")?;
            return Err(name
                .fail(format!(
                    "\"{}\" and \"{}\" would both be written to {}.csv",
                    other.name,
                    one.name,
                    one.file_name()
                ))
                .next("give each move a name of its own"));
        }
        moves.push(one);
    }
    Ok(moves)
}

fn one(table: &Table, machine: &Machine, design: &Design) -> Result<Move> {
    table.check_keys(&["name", "gcode"], &[])?;
    let name = table.required("name", "for example name = \"short fast\"")?;
    check_name(&name)?;
    let from = match table.optional("from") {
        Some(field) => place(&field, machine)?,
        None => vec![0.0; machine.geometry().slides.len()],
    };
    let limits = match table.optional("plan") {
        Some(field) => planned(table, &field, &from, machine, design)?,
        None => limits(table)?,
    };
    let until = table.number("until")?;
    let every = table.number_if_given("every")?.unwrap_or(design.every.min(until));
    let at = |key: &str| table.optional(key).unwrap_or_else(|| table.field.clone());
    if every > until {
        return Err(at("every")
            .fail(format!("an interval of {every} s is longer than the run of {until} s"))
            .allowed(format!("up to {until} s")));
    }
    if until / every > MOST_SAMPLES || until / design.every > MOST_SAMPLES {
        return Err(at("until")
            .fail("this makes too many rows or samples")
            .allowed(format!("up to {}", rounded(MOST_SAMPLES)))
            .next("take a shorter run, or a longer interval"));
    }
    let profiles = profiles(table, machine, &from, &limits)?;
    let end = profiles.first().map_or(0.0, Profile::end);
    if end > until {
        return Err(at("until")
            .fail(format!("the run ends before the move, which takes {}", show(end, "s")))
            .allowed(format!("from {} on", show(end, "s"))));
    }
    for ((slide, travel), profile) in machine.travels().zip(&profiles) {
        let Some(travel) = travel else { continue };
        let legs = profile.passages().iter().flat_map(Passage::extremes);
        let places = std::iter::once(profile.start()).chain(legs);
        let is_off = |x: &f64| (x - travel.max).max(travel.min - x) > ROUNDING;
        if let Some(out) = places.into_iter().find(is_off) {
            let whose = if profiles.len() == 1 { String::new() } else { format!(" of the {}", slide.name) };
            return Err(table
                .field
                .fail(format!("it leads to {}, off the travel{whose}", show(out, "mm")))
                .allowed(format!("from {} to {}", show(travel.min, "mm"), show(travel.max, "mm"))));
        }
    }
    let (name, window) = (name.text()?.to_string(), table.number("window")?);
    Ok(Move { name, profiles, is_planned: table.optional("plan").is_some(), until, every, window })
}

/// A position of each coordinate: a number for an axis, a list for a gantry.
fn place(field: &Field, machine: &Machine) -> Result<Vec<f64>> {
    let slides = machine.geometry().slides;
    match slides.len() {
        1 => Ok(vec![field.number()?]),
        count => {
            let names: Vec<&str> = machine.travels().map(|(slide, _)| slide.name).collect();
            let wanted = format!("{count} positions: {}", names.join(", "));
            let key = field.key();
            let example = format!("write for example {key} = [\"50 mm\", \"20 mm\"]");
            field
                .numbers(count, &wanted)
                .map_err(|error| if error.next.is_none() { error.next(example) } else { error })
        }
    }
}

/// The reference of each coordinate along the legs of the table.
fn profiles(table: &Table, machine: &Machine, from: &[f64], limits: &Limits) -> Result<Vec<Profile>> {
    let legs = legs(table, machine, from, limits)?;
    Profile::of_legs(from, &legs).map_err(|error| at(&table.field, error))
}

/// An error of a reference, at the field that describes it.
fn at(field: &Field, error: Error) -> Error {
    Error { allowed: error.allowed, next: error.next, ..field.fail(error.what) }
}

/// The limits of the quickest move that the machine of the file can make, with jerk and snap time on the belt's modes
/// where the way is long enough for it.
fn planned(table: &Table, field: &Field, from: &[f64], machine: &Machine, design: &Design) -> Result<Limits> {
    if let Some(other) = ["speed", "acceleration", "jerk", "snap", "gcode"].iter().find_map(|key| table.optional(key)) {
        let next = format!(
            "leave out plan, or {}; limits of the plan belong into it: plan = {{ speed = \"0.5 m/s\" }}",
            other.key()
        );
        return Err(other.fail("the move has a plan already").next(next));
    }
    let given = field.clone().named("move.plan").table()?;
    given.check_keys(&[], &[])?;
    let wanted = Wanted {
        speed: given.number_if_given("speed")?,
        acceleration: given.number_if_given("acceleration")?,
        jerk: given.number_if_given("jerk")?,
        reserve: given.number("reserve")?,
    };
    // Where it goes does not depend on how fast.
    let any = Limits { speed: 1.0, acceleration: 1.0, jerk: None, snap: None };
    let told = |error: Error| Error { place: field.fail("").place, ..error };
    let profiles = profiles(table, machine, from, &any).map_err(told)?;
    let way = MovePath::new(&profiles).ok_or_else(|| field.fail("a move without a stroke has no plan"))?;
    let modes = modes(machine);
    let quickest = Quickest { machine, design, modes: &modes, wanted: &wanted };
    quickest.check(&way).map_err(told)?;
    for periods in [[1, 1], [1, 0], [0, 0]] {
        if let Some(limits) = quickest.limits_for(&way, periods, Share::ALL, &|_| Vec::new()).map_err(told)? {
            return Ok(limits);
        }
    }
    Err(field.fail("there is no plan: the remaining voltage and current do not accelerate the machine"))
}

fn limits(table: &Table) -> Result<Limits> {
    let needed = |key: &str, example: &str| {
        table.required(key, example)?;
        table.number(key)
    };
    let limits = Limits {
        speed: needed("speed", "speed = \"0.4 m/s\", or plan = {} for the quickest move that the machine can make")?,
        acceleration: needed("acceleration", "acceleration = \"5 m/s^2\"")?,
        jerk: table.number_if_given("jerk")?,
        snap: table.number_if_given("snap")?,
    };
    match table.optional("snap") {
        Some(field) if limits.jerk.is_none() => {
            Err(field.fail("a limit of snap needs one of jerk").next("add for example jerk = \"200 m/s^3\""))
        }
        _ => Ok(limits),
    }
}

/// The arc that leads to a point, where its `center` is given.
fn arc(table: &Table, to: &[f64], machine: &Machine) -> Result<Option<Arc>> {
    let [center, clockwise] = ["center", "clockwise"].map(|key| table.optional(key));
    let clockwise = match (clockwise, &center) {
        (None, _) => false,
        (Some(field), Some(_)) => field.truth()?,
        (Some(field), None) => {
            return Err(field
                .fail("this leg is straight")
                .next("add center = [\"20 mm\", \"0 mm\"] for an arc, or leave out clockwise"));
        }
    };
    let Some(field) = center else { return Ok(None) };
    let Ok(to) = to.try_into() else {
        return Err(field.fail("an arc needs two coordinates").next("leave out center, or describe a gantry"));
    };
    let center = place(&field, machine)?[..].try_into().map_err(|_| field.fail("expected two positions"))?;
    Ok(Some(Arc { to, center, clockwise }))
}

/// The legs: `to`, `points` or `gcode`.
fn legs(table: &Table, machine: &Machine, from: &[f64], limits: &Limits) -> Result<Vec<Leg<Vec<f64>>>> {
    let kinds = ["to", "points", "gcode"];
    let given: Vec<Field> = kinds.iter().filter_map(|key| table.optional(key)).collect();
    let field = match &given[..] {
        [field] => field,
        [] if from.len() > 1 => return Err(table.missing("to", "to = [\"50 mm\", \"20 mm\"], or points, or gcode")),
        [] => return Err(table.missing("to", "to = \"50 mm\", or points, or gcode")),
        [first, second, ..] => {
            return Err(second
                .fail(format!("the move is given by {} already", first.key()))
                .next("keep one of to, points and gcode"));
        }
    };
    match field.key() {
        "to" => Ok(vec![Leg::To(place(field, machine)?, *limits)]),
        "points" => {
            let mut legs = Vec::new();
            for point in field.filled_list()? {
                if !point.is_table() {
                    legs.push(Leg::To(place(&point.named("move.points.to"), machine)?, *limits));
                    continue;
                }
                let table = point.named("move.points").table()?;
                table.check_keys(&["clockwise"], &[])?;
                let speed = table.number_if_given("speed")?.unwrap_or(limits.speed);
                let to = match from.len() {
                    1 => vec![table.number("to")?],
                    _ => place(&table.required("to", "to = [\"50 mm\", \"20 mm\"]")?, machine)?,
                };
                let limits = Limits { speed, ..*limits };
                legs.push(match arc(&table, &to, machine)? {
                    Some(arc) => Leg::Around(arc, limits),
                    None => Leg::To(to, limits),
                });
                let wait = table.number("wait")?;
                if wait > 0.0 {
                    legs.push(Leg::Wait(wait));
                }
            }
            Ok(legs)
        }
        _ => gcode::legs(field.text()?, from, limits).map_err(|error| at(field, error)),
    }
}

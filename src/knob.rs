//! What can be turned: numbers of a stage by their keys, and groups of them that move together. A fit turns them, and a sweep.

use crate::error::{Error, Result};
use crate::friction::{Friction, Side};
use crate::parameter;
use crate::stage::Stage;

/// One number of a stage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    TorqueConstant,
    BackEmfConstant,
    Resistance,
    Inductance,
    RotorInertia,
    GearRatio,
    GearEfficiency,
    Backlash,
    GearStiffness,
    GearDamping,
    Gain,
    VoltageLimit,
    CurrentLimit,
    Bandwidth,
    Radius,
    DriveInertia,
    IdlerInertia,
    Mass,
    Load,
    Inclination,
    Stiffness(usize),
    Damping(usize),
    Modulus,
    Pretension,
    Friction(usize, bool, Term),
}

/// One number of a friction law's side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Viscous,
    Coulomb,
    Breakaway,
}

const BODIES: [&str; 3] = ["drive_pulley", "cart", "idler_pulley"];

#[rustfmt::skip]
const PLACES: &[(&str, Place)] = &[
    ("motor.torque_constant", Place::TorqueConstant),
    ("motor.back_emf_constant", Place::BackEmfConstant),
    ("motor.resistance", Place::Resistance),
    ("motor.inductance", Place::Inductance),
    ("motor.rotor_inertia", Place::RotorInertia),
    ("motor.gear_ratio", Place::GearRatio),
    ("motor.gear_efficiency", Place::GearEfficiency),
    ("motor.backlash", Place::Backlash),
    ("motor.gear_stiffness", Place::GearStiffness),
    ("motor.gear_damping", Place::GearDamping),
    ("amplifier.gain", Place::Gain),
    ("amplifier.voltage_limit", Place::VoltageLimit),
    ("amplifier.current_limit", Place::CurrentLimit),
    ("amplifier.bandwidth", Place::Bandwidth),
    ("drive_pulley.radius", Place::Radius),
    ("drive_pulley.inertia", Place::DriveInertia),
    ("idler_pulley.inertia", Place::IdlerInertia),
    ("cart.mass", Place::Mass),
    ("cart.load", Place::Load),
    ("cart.inclination", Place::Inclination),
    ("belt.stiffness.0", Place::Stiffness(0)),
    ("belt.stiffness.1", Place::Stiffness(1)),
    ("belt.stiffness.2", Place::Stiffness(2)),
    ("belt.damping.0", Place::Damping(0)),
    ("belt.damping.1", Place::Damping(1)),
    ("belt.damping.2", Place::Damping(2)),
    ("belt.pretension", Place::Pretension),
];

fn friction(stage: &mut Stage, body: usize) -> &mut Friction {
    match body {
        0 => &mut stage.drive_pulley.friction,
        1 => &mut stage.cart.friction,
        _ => &mut stage.idler_pulley.friction,
    }
}

fn side(stage: &mut Stage, body: usize, forward: bool) -> &mut Side {
    let law = friction(stage, body);
    if forward { &mut law.forward } else { &mut law.backward }
}

impl Place {
    /// Where it stands in a stage; none for parts that this one has not.
    fn slot(self, stage: &mut Stage) -> Option<&mut f64> {
        Some(match self {
            Place::TorqueConstant => &mut stage.motor.torque_constant,
            Place::BackEmfConstant => &mut stage.motor.back_emf_constant,
            Place::Resistance => &mut stage.motor.resistance,
            Place::Inductance => &mut stage.motor.inductance,
            Place::RotorInertia => &mut stage.motor.rotor_inertia,
            Place::GearRatio => &mut stage.motor.gear_ratio,
            Place::GearEfficiency => &mut stage.motor.gear_efficiency,
            Place::Backlash => &mut stage.motor.gear_play.as_mut()?.backlash,
            Place::GearStiffness => &mut stage.motor.gear_play.as_mut()?.stiffness,
            Place::GearDamping => &mut stage.motor.gear_play.as_mut()?.damping,
            Place::Gain => &mut stage.amplifier.gain,
            Place::VoltageLimit => stage.amplifier.voltage_limit.as_mut()?,
            Place::CurrentLimit => stage.amplifier.current_limit.as_mut()?,
            Place::Bandwidth => stage.amplifier.bandwidth.as_mut()?,
            Place::Radius => &mut stage.pulley_radius,
            Place::DriveInertia => &mut stage.drive_pulley.inertia,
            Place::IdlerInertia => &mut stage.idler_pulley.inertia,
            Place::Mass => &mut stage.cart.mass,
            Place::Load => &mut stage.cart.load,
            Place::Inclination => &mut stage.cart.inclination,
            Place::Stiffness(span) => &mut stage.belt.stiffness[span],
            Place::Damping(span) => &mut stage.belt.damping[span],
            Place::Modulus => &mut stage.belt.make.as_mut()?.modulus,
            Place::Pretension => stage.belt.pretension.as_mut()?,
            Place::Friction(body, forward, term) => {
                let side = side(stage, body, forward);
                match term {
                    Term::Viscous => &mut side.viscous,
                    Term::Coulomb => &mut side.coulomb,
                    Term::Breakaway => &mut side.breakaway,
                }
            }
        })
    }
}

/// The places that a key of the case file sets, the first of them its own. Friction of one direction carries the other
/// along where they are equal in `stage` and the other has no key among `keys`.
fn places(stage: &Stage, key: &str, keys: &[&str]) -> Option<Vec<Place>> {
    if let Some((_, place)) = PLACES.iter().find(|(name, _)| *name == key) {
        return Some(vec![*place]);
    }
    match key {
        "belt.stiffness" => return Some((0..3).map(Place::Stiffness).collect()),
        // Spans that follow the cart are as stiff as the modulus says, those that do not as their stiffness.
        "belt.modulus" => return Some((0..3).map(Place::Stiffness).chain([Place::Modulus]).collect()),
        "belt.damping" => return Some((0..3).map(Place::Damping).collect()),
        _ => {}
    }
    let (body, name) = key.split_once(".friction.")?;
    let body = BODIES.iter().position(|b| *b == body)?;
    let (term, forward) = match name {
        "viscous" => (Term::Viscous, true),
        "coulomb" => (Term::Coulomb, true),
        "static" => (Term::Breakaway, true),
        "viscous_backward" => (Term::Viscous, false),
        "coulomb_backward" => (Term::Coulomb, false),
        "static_backward" => (Term::Breakaway, false),
        _ => return None,
    };
    let (own, other) = (Place::Friction(body, forward, term), Place::Friction(body, !forward, term));
    let read = |place| get(stage, place);
    let follows = forward && !keys.contains(&format!("{key}_backward").as_str()) && read(own) == read(other);
    Some(if follows { vec![own, other] } else { vec![own] })
}

fn get(stage: &Stage, place: Place) -> Option<f64> {
    place.slot(&mut stage.clone()).copied()
}

/// A number that is turned, and all that turns with it.
#[derive(Debug, Clone, PartialEq)]
pub struct Knob {
    /// Its key, those of what is tied joined by ` = `, or the name of a group.
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
    /// Places it sets, with their value per unit of it.
    members: Vec<(Place, f64)>,
}

/// Bounds of a parameter that are given, by name.
pub type GivenBounds = [(String, [f64; 2])];

/// How far a parameter may go from where it starts, unless its bounds are given.
const FAR: f64 = 100.0;

impl Knob {
    /// A parameter of the case file by itself.
    pub fn free(stage: &Stage, key: &str, all: &[&str], bounds: &GivenBounds) -> Result<Self> {
        Self::tied(stage, &[key], all, bounds)
    }

    /// Several parameters in their present ratio; equal, where one of them is zero.
    pub fn tied(stage: &Stage, keys: &[&str], all: &[&str], bounds: &GivenBounds) -> Result<Self> {
        let mut values = Vec::new();
        let mut sets = Vec::new();
        for key in keys {
            let places = places(stage, key, all).ok_or_else(|| unknown(key))?;
            let value = value_of(stage, key).ok_or_else(|| not_there(key))?;
            values.push(value);
            sets.push(places);
        }
        let first = values[0];
        let ratios: Vec<f64> = if values.contains(&0.0) {
            vec![1.0; values.len()]
        } else {
            values.iter().map(|value| value / first).collect()
        };
        let mut members = Vec::new();
        for (places, ratio) in sets.iter().zip(&ratios) {
            for &place in places {
                // Spans keep their ratios among each other; both directions of friction are equal.
                let present = get(stage, place).unwrap_or(0.0);
                let factor = match place {
                    Place::Stiffness(_) | Place::Damping(_) if first != 0.0 && present != 0.0 => present / first,
                    _ => *ratio,
                };
                members.push((place, factor));
            }
        }
        let name = keys.join(" = ");
        let row = parameter_of(keys[0]);
        let keys: Vec<(String, f64)> = keys.iter().zip(&ratios).map(|(key, ratio)| (key.to_string(), *ratio)).collect();
        let range = row.map_or((f64::NEG_INFINITY, f64::INFINITY), |row| (row.range.low, row.range.high));
        let unit = row.map_or("", |row| row.unit);
        let (low, high) = limits(&name, &keys, first, range, bounds)?;
        Ok(Self { name, unit, start: first, low, high, keys, members })
    }

    /// A sum over all bodies, at the drive pulley; its parts keep their ratios.
    pub fn lumped(stage: &Stage, name: &str, bounds: &GivenBounds) -> Result<Self> {
        let Some((keys, unit)) = group(name) else {
            return Err(Error::new(format!("there is no group `{name}`")).allowed(GROUPS.join(", ")));
        };
        let mut sum = 0.0;
        let mut parts = Vec::new();
        for key in keys {
            for place in places(stage, key, &[]).unwrap_or_default() {
                parts.push((place, get(stage, place).unwrap_or(0.0)));
            }
            let value = value_of(stage, key).unwrap_or(0.0);
            sum += value * at_pulley(stage, key);
        }
        if sum <= 0.0 {
            return Err(Error::new(format!("all parts of `{name}` are zero, so their ratios are not known"))
                .next(format!("give one of {} a value, or free it by itself", keys.join(", "))));
        }
        let set = keys.iter().map(|key| (key.to_string(), value_of(stage, key).unwrap_or(0.0) / sum)).collect();
        let members = parts.into_iter().map(|(place, value)| (place, value / sum)).collect();
        let (low, high) = limits(name, &[], sum, (0.0, 1e15), bounds)?;
        Ok(Self { name: name.to_string(), unit, start: sum, low, high, keys: set, members })
    }

    /// Puts `value` into `stage`.
    pub fn set(&self, stage: &mut Stage, value: f64) {
        for &(place, factor) in &self.members {
            if let Some(slot) = place.slot(stage) {
                *slot = value * factor;
            }
        }
    }

    /// Whether both turn a number of the machine.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.members.iter().any(|(place, _)| other.members.iter().any(|(its, _)| its == place))
    }

    /// Whether it is searched for on a logarithmic scale: what is above zero by nature, over more than a factor of two.
    pub fn logarithmic(&self) -> bool {
        self.low > 0.0 && self.high > 2.0 * self.low
    }
}

/// The sums that can be lumped.
pub const GROUPS: [&str; 4] = ["total.viscous", "total.coulomb", "total.inertia", "total.stiffness"];

fn group(name: &str) -> Option<(&'static [&'static str], &'static str)> {
    Some(match name {
        "total.viscous" => {
            (&["drive_pulley.friction.viscous", "cart.friction.viscous", "idler_pulley.friction.viscous"], "N m s/rad")
        }
        "total.coulomb" => {
            (&["drive_pulley.friction.coulomb", "cart.friction.coulomb", "idler_pulley.friction.coulomb"], "N m")
        }
        "total.inertia" => {
            (&["motor.rotor_inertia", "drive_pulley.inertia", "cart.mass", "idler_pulley.inertia"], "kg m^2")
        }
        "total.stiffness" => (&["belt.stiffness.0", "belt.stiffness.1", "belt.stiffness.2"], "N/m"),
        _ => return None,
    })
}

/// What one unit of a parameter is at the drive pulley: r² for a mass or a viscous friction of the cart, r for its Coulomb
/// friction, n² for the rotor's inertia.
pub fn at_pulley(stage: &Stage, key: &str) -> f64 {
    let (r, n) = (stage.pulley_radius, stage.motor.gear_ratio);
    match key {
        "cart.mass" => r * r,
        "motor.rotor_inertia" => n * n,
        _ if key.starts_with("cart.friction.viscous") => r * r,
        _ if key.starts_with("cart.friction.") => r,
        _ => 1.0,
    }
}

/// The present value of a parameter.
pub fn value_of(stage: &Stage, key: &str) -> Option<f64> {
    match key {
        "belt.modulus" => stage.belt.make.map(|make| make.modulus),
        "belt.stiffness" => Some(stage.belt.stiffness[0]),
        _ => get(stage, *places(stage, key, &[])?.first()?),
    }
}

/// The keys of everything of a machine that is known by measurement and is not zero: all numbers of motor, pulleys, cart and belt but
/// the gear's ratio and efficiency, and the inclination. Directions and breakaways that have the same value count once.
pub fn all_keys(stage: &Stage) -> Vec<String> {
    let exact = |place: Place| {
        matches!(
            place,
            Place::GearRatio
                | Place::GearEfficiency
                | Place::Gain
                | Place::VoltageLimit
                | Place::CurrentLimit
                | Place::Inclination
        )
    };
    let made = stage.belt.make.is_some();
    let of_belt = |place: Place| matches!(place, Place::Stiffness(_));
    let there = |place: Place| get(stage, place).is_some_and(|value| value != 0.0 && value.is_finite());
    let mut keys: Vec<String> = PLACES
        .iter()
        .filter(|(_, place)| there(*place) && !exact(*place) && !(made && of_belt(*place)))
        .map(|(key, _)| key.to_string())
        .collect();
    if made {
        keys.push("belt.modulus".to_string());
    }
    for (index, body) in BODIES.iter().enumerate() {
        for (term, word) in [(Term::Viscous, "viscous"), (Term::Coulomb, "coulomb"), (Term::Breakaway, "static")] {
            let value = |forward: bool, term: Term| get(stage, Place::Friction(index, forward, term));
            let (forward, backward) = (value(true, term), value(false, term));
            let follows =
                |forward: bool| term == Term::Breakaway && value(forward, term) == value(forward, Term::Coulomb);
            if forward.is_some_and(|value| value != 0.0) && !follows(true) {
                keys.push(format!("{body}.friction.{word}"));
            }
            if backward != forward && backward.is_some_and(|value| value != 0.0) && !follows(false) {
                keys.push(format!("{body}.friction.{word}_backward"));
            }
        }
    }
    keys
}

/// The row of the table of parameters; of a list, that of the list.
pub fn parameter_of(key: &str) -> Option<&'static parameter::Parameter> {
    parameter::find(key).or_else(|| parameter::find(key.rsplit_once('.')?.0))
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

fn unknown(key: &str) -> Error {
    let known: Vec<&str> = PLACES.iter().map(|(name, _)| *name).collect();
    let error = Error::new(format!("`{key}` is no parameter that can be turned"));
    let friction: Vec<String> = BODIES
        .iter()
        .flat_map(|body| ["viscous", "coulomb", "static"].map(|term| format!("{body}.friction.{term}")))
        .collect();
    let near = known
        .iter()
        .copied()
        .chain(friction.iter().map(String::as_str))
        .min_by_key(|name| strsim::damerau_levenshtein(name, key));
    match near {
        Some(near) if strsim::damerau_levenshtein(near, key) * 3 <= key.len() => {
            error.next(format!("did you mean `{near}`?"))
        }
        _ => error.next("name a machine's number as --set does, such as cart.mass or cart.friction.viscous"),
    }
}

fn not_there(key: &str) -> Error {
    Error::new(format!("`{key}` has no value in this case")).next("give it one to start from")
}

/// Which breakaways are the Coulomb friction: these follow it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Breakaways([[bool; 2]; 3]);

impl Breakaways {
    /// As they are in `stage`, of which `keys` are turned.
    pub fn of(stage: &Stage, keys: &[&str]) -> Self {
        let laws = [stage.drive_pulley.friction, stage.cart.friction, stage.idler_pulley.friction];
        Self(std::array::from_fn(|body| {
            let law = laws[body];
            let turned = keys.iter().any(|key| key.starts_with(&format!("{}.friction.static", BODIES[body])));
            [law.forward, law.backward].map(|side| side.breakaway == side.coulomb && !turned)
        }))
    }

    /// Sets them after Coulomb friction was changed; a body holds at least what it resists with in motion.
    pub fn follow(&self, stage: &mut Stage) {
        for (body, follows) in self.0.iter().enumerate() {
            for (forward, follows) in [true, false].into_iter().zip(follows) {
                let side = side(stage, body, forward);
                side.breakaway = if *follows { side.coulomb } else { side.breakaway.max(side.coulomb) };
            }
        }
    }
}

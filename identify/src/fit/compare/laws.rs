//! Friction laws for a comparison: the case text with each law, and its free parameters.

use crate::case::{Case, Files, Plan};
use crate::error::{Error, Result};
use crate::fit::limits::{BRISTLE_BEND, MOST_BREAKAWAY, SPEED_POINTS, STRIBECK_ABOVE, STRIBECK_FALL, TRAVEL_POINTS};
use crate::friction::Friction;
use crate::machine::{DriveAt, Machine};
use std::path::Path;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Value};

/// A friction law of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrictionLaw {
    /// b v alone.
    Viscous,
    /// Viscous and Coulomb friction.
    Coulomb,
    /// Each direction with its own values.
    Asymmetric,
    /// A Stribeck curve added to the better one of the first laws.
    Stribeck,
    /// The better one of these, with a factor on dry friction that changes along the travel.
    Along,
    /// Bristles instead of a Stribeck curve.
    LuGre,
    /// The better one of the straight laws, with a force that changes along the travel and is the same in both
    /// directions.
    ForceAlong,
    /// A force that depends on speed, added to another law.
    ForceBySpeed,
}

impl FrictionLaw {
    /// All laws, the simplest first.
    pub const ALL: [Self; 8] = [
        Self::Viscous,
        Self::Coulomb,
        Self::Asymmetric,
        Self::Stribeck,
        Self::Along,
        Self::ForceAlong,
        Self::ForceBySpeed,
        Self::LuGre,
    ];

    /// Laws compared by default: LuGre takes long, and a force is not friction.
    pub const USUAL: [Self; 5] = [Self::Viscous, Self::Coulomb, Self::Asymmetric, Self::Stribeck, Self::Along];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viscous => "viscous",
            Self::Coulomb => "coulomb",
            Self::Asymmetric => "asymmetric",
            Self::Stribeck => "stribeck",
            Self::Along => "along",
            Self::LuGre => "lugre",
            Self::ForceAlong => "force-along",
            Self::ForceBySpeed => "force-by-speed",
        }
    }

    /// The law of this name.
    pub fn named(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|law| law.name() == name).ok_or_else(|| {
            Error::new(format!("there is no friction law \"{name}\" to compare"))
                .allowed(Self::ALL.map(Self::name).join(", "))
        })
    }

    /// True if it is added to one of the piecewise linear laws.
    pub(super) fn is_above(self) -> bool {
        match self {
            Self::Viscous | Self::Coulomb | Self::Asymmetric => false,
            Self::Stribeck | Self::Along | Self::LuGre | Self::ForceAlong | Self::ForceBySpeed => true,
        }
    }
}

/// The body whose friction is compared: the one with the most free parameters, or else the cart.
pub(super) fn body(machine: &Machine, plan: &Plan) -> &'static str {
    let count = |body: &str| {
        let own = plan.free.iter().chain(plan.tied.iter().flatten());
        own.filter(|key| key.starts_with(&format!("{body}.friction."))).count()
    };
    let others: &[&str] = if machine.has_one_coordinate() { &["drive_pulley"] } else { &["bridge", "drive_pulley"] };
    others.iter().fold("cart", |most, other| if count(other) > count(most) { other } else { most })
}

/// The case with this law, with direction-dependent friction if `sided`, starting from the machine `from`, and its free
/// parameters.
pub(super) fn with(
    case: &Case,
    name: &Path,
    plan: &Plan,
    law: FrictionLaw,
    sided: bool,
    from: &Machine,
) -> Result<(Case, Plan)> {
    let body = body(&case.machine, plan);
    // Forces act on a slide.
    let (friction, slide) = match body {
        "drive_pulley" => (from.drive_pulley.friction, "cart"),
        "bridge" => (from.first_slide().friction, body),
        _ => (from.cart.friction, body),
    };
    let mut document: DocumentMut = case.text.parse().map_err(|_| Error::new("this is not TOML").in_file(name))?;
    let fastest = fastest(case) / if body == slide { 1.0 } else { from.pulley_radius };
    let sided = sided || law == FrictionLaw::Asymmetric;
    let (table, keys) = table(case, law, sided, &friction, fastest, (body, slide));
    let coulomb = table.get("coulomb").and_then(Value::as_float).unwrap_or_default();
    let near = match law {
        FrictionLaw::Stribeck => Some(("stribeck.force", [0.0, (MOST_BREAKAWAY - 1.0) * coulomb])),
        // Below Coulomb friction it would change nothing.
        FrictionLaw::LuGre => Some(("static", [coulomb, MOST_BREAKAWAY * coulomb])),
        _ => None,
    };
    let mut free: Vec<String> = keys.iter().map(|key| format!("{body}.friction.{key}")).collect();
    put(&mut document, body, "friction", Value::InlineTable(table));
    let loaded = plan.free.iter().any(|key| key == "cart.load");
    let line = line(case, law, sided || loaded, slide);
    if let Some(Line { key, over, free: numbers }) = &line {
        let point = |x: &f64| Value::Array(Array::from_iter([*x, 0.0]));
        put(&mut document, slide, key, Value::Array(over.iter().map(point).collect()));
        free.extend(numbers.iter().map(|number| format!("{slide}.{key}.{number}.force")));
    }
    let is_own = |key: &str| {
        key.starts_with(&format!("{body}.friction."))
            || matches!(key, "total.viscous" | "total.coulomb")
            || line.as_ref().is_some_and(|line| key.starts_with(&format!("{slide}.{}.", line.key)))
    };
    let offset = sided && loaded;
    if offset {
        // Both directions contain it.
        put(&mut document, "cart", "load", Value::from(0.0));
    }
    let kept = plan.free.iter().filter(|key| !(is_own(key) || offset && *key == "cart.load"));
    free = kept.cloned().chain(free).collect();
    let tied: Vec<Vec<String>> = plan.tied.iter().filter(|keys| !keys.iter().any(|key| is_own(key))).cloned().collect();
    let lumped: Vec<String> = plan.lumped.iter().filter(|name| !is_own(name)).cloned().collect();
    let separate = plan.separate.iter().filter(|name| free.contains(name)).cloned().collect();
    let mut bounds: Vec<(String, [f64; 2])> =
        plan.bounds.iter().filter(|(key, _)| free.contains(key) || !is_own(key)).cloned().collect();
    let near = near.map(|(key, ends)| (format!("{body}.friction.{key}"), ends));
    // Given bounds have precedence.
    let near = near.filter(|(key, _)| !bounds.iter().any(|(given, _)| given == key));
    bounds.extend(near.clone());
    let priors = plan.priors.iter().filter(|(key, _)| free.contains(key) || !is_own(key)).cloned().collect();
    rewrite(&mut document, &free, &tied, &lumped, &is_own);
    if let Some((key, ends)) = near
        && let Some(fit) = document.get_mut("fit").and_then(Item::as_table_like_mut)
        && let Some(bounds) =
            fit.entry("bounds").or_insert(Item::Value(Value::InlineTable(InlineTable::new()))).as_table_like_mut()
    {
        bounds.entry(&key).or_insert(Item::Value(Value::Array(Array::from_iter(ends))));
    }
    // The logs are reused.
    let read = Case::from_text_for(name, &document.to_string(), &[], Files::Nothing)?;
    let own = Case { experiments: case.experiments.clone(), unread: Vec::new(), ..read };
    Ok((own, Plan { free, tied, lumped, separate, bounds, priors, ..plan.clone() }))
}

/// A piecewise linear force in addition to friction over travel or speed, initially zero.
struct Line {
    /// In the table of the slide.
    key: &'static str,
    /// m or m/s, of its points.
    over: Vec<f64>,
    /// Indices of the points with a free force.
    free: Vec<usize>,
}

/// The force of a law in addition to friction. `is_held` is true if something else has a constant part, so that one
/// point stays at zero.
fn line(case: &Case, law: FrictionLaw, is_held: bool, slide: &str) -> Option<Line> {
    match law {
        FrictionLaw::ForceAlong => {
            let free = (0..TRAVEL_POINTS).filter(|k| !(is_held && *k == TRAVEL_POINTS / 2)).collect();
            Some(Line { key: "force_along", over: over_travel(case, slide).collect(), free })
        }
        FrictionLaw::ForceBySpeed => {
            // The part proportional to speed is viscous friction, the part with its sign Coulomb friction.
            let fastest = fastest(case);
            let is_free = |k: &usize| SPEED_POINTS[*k] != 0.0 && SPEED_POINTS[*k].abs() != 1.0;
            let free = (0..SPEED_POINTS.len()).filter(is_free).collect();
            Some(Line { key: "force_by_speed", over: SPEED_POINTS.iter().map(|share| share * fastest).collect(), free })
        }
        _ => None,
    }
}

/// The table of the friction, and its free keys.
fn table(
    case: &Case,
    law: FrictionLaw,
    sided: bool,
    from: &Friction,
    fastest: f64,
    (body, slide): (&str, &str),
) -> (InlineTable, Vec<String>) {
    let mut table = InlineTable::new();
    let mut keys = Vec::new();
    let mut put = |key: &str, value: f64| {
        table.insert(key, Value::from(value));
        keys.push(key.to_string());
    };
    let (forward, backward) = (from.forward, from.backward);
    let mean = |a: f64, b: f64| if sided { a } else { 0.5 * (a + b) };
    put("viscous", mean(forward.viscous, backward.viscous));
    let coulomb = mean(forward.coulomb, backward.coulomb);
    let coulomb = if coulomb > 0.0 { coulomb } else { 0.05 * forward.viscous * fastest };
    if law != FrictionLaw::Viscous {
        put("coulomb", coulomb);
    }
    if sided {
        put("viscous_backward", backward.viscous);
        put("coulomb_backward", if backward.coulomb > 0.0 { backward.coulomb } else { coulomb });
    }
    let velocity = STRIBECK_FALL * fastest;
    match law {
        FrictionLaw::Viscous
        | FrictionLaw::Coulomb
        | FrictionLaw::Asymmetric
        | FrictionLaw::ForceAlong
        | FrictionLaw::ForceBySpeed => {}
        FrictionLaw::Stribeck => {
            let mut own = InlineTable::new();
            own.insert("force", Value::from(STRIBECK_ABOVE * coulomb));
            own.insert("velocity", Value::from(velocity));
            table.insert("stribeck", Value::InlineTable(own));
            keys.extend(["stribeck.force", "stribeck.velocity"].map(String::from));
        }
        FrictionLaw::Along => {
            let point = |x: f64| Value::Array(Array::from_iter([x, 1.0]));
            table.insert("along", Value::Array(over_travel(case, slide).map(point).collect()));
            // One of them is 1, since the factors refer to Coulomb friction.
            let others = (0..TRAVEL_POINTS).filter(|k| *k != TRAVEL_POINTS / 2);
            keys.extend(others.map(|k| format!("along.{k}.factor")));
        }
        FrictionLaw::LuGre => {
            let stiffness = coulomb / BRISTLE_BEND * if body == slide { 1.0 } else { case.machine.pulley_radius };
            let mass = match body {
                "drive_pulley" => case.machine.drive_pulley.inertia,
                "bridge" => case.machine.first_slide().mass,
                _ => case.machine.cart.mass,
            };
            let mut own = InlineTable::new();
            own.insert("stiffness", Value::from(stiffness));
            own.insert("damping", Value::from((stiffness * mass).sqrt()));
            own.insert("velocity", Value::from(velocity));
            table.insert("static", Value::from((1.0 + STRIBECK_ABOVE) * coulomb.max(backward.coulomb)));
            table.insert("lugre", Value::InlineTable(own));
            keys.extend(["static", "lugre.stiffness", "lugre.velocity"].map(String::from));
        }
    }
    (table, keys)
}

/// Sets a value in a table of the document.
fn put(document: &mut DocumentMut, table: &str, key: &str, value: Value) {
    if let Some(table) = document.get_mut(table).and_then(Item::as_table_like_mut) {
        table.remove(key);
        table.insert(key, Item::Value(value));
    }
}

/// Sets the free parameters in the table of the fit.
fn rewrite(
    document: &mut DocumentMut,
    free: &[String],
    tied: &[Vec<String>],
    lumped: &[String],
    is_own: &dyn Fn(&str) -> bool,
) {
    let Some(fit) = document.get_mut("fit").and_then(Item::as_table_like_mut) else { return };
    let list = |names: &[String]| Value::Array(names.iter().map(String::as_str).collect());
    for key in ["free", "tied", "lumped"] {
        fit.remove(key);
    }
    fit.insert("free", Item::Value(list(free)));
    if !tied.is_empty() {
        fit.insert("tied", Item::Value(Value::Array(tied.iter().map(|keys| list(keys)).collect())));
    }
    if !lumped.is_empty() {
        fit.insert("lumped", Item::Value(list(lumped)));
    }
    for key in ["bounds", "priors"] {
        let Some(table) = fit.get_mut(key).and_then(Item::as_table_like_mut) else { continue };
        let gone: Vec<String> = table
            .iter()
            .map(|(name, _)| name.to_string())
            .filter(|name| is_own(name) && !free.contains(name))
            .collect();
        gone.iter().for_each(|name| {
            table.remove(name);
        });
    }
    if let Some(names) = fit.get_mut("separate").and_then(Item::as_array_mut) {
        names.retain(|name| name.as_str().is_some_and(|name| free.iter().any(|own| own == name)));
    }
}

/// Approximate largest speed of a slide in the logs, m/s.
fn fastest(case: &Case) -> f64 {
    let r = case.machine.pulley_radius;
    let logs = case.experiments.iter().filter_map(|experiment| experiment.log.as_ref());
    let speeds = logs.flat_map(|log| {
        log.outputs.iter().map(move |output| {
            let arm = if output.quantity.is_linear() { 1.0 } else { r };
            let values = &output.values;
            if !output.quantity.is_position() {
                return arm * values.iter().filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()));
            }
            let step = (values.len() / 100).max(1);
            let pairs = (step..values.len()).step_by(step);
            let slope = pairs.map(|k| (values[k] - values[k - step]) / (log.time[k] - log.time[k - step]));
            arm * slope.filter(|v| v.is_finite()).fold(0.0, |most: f64, v| most.max(v.abs()))
        })
    });
    speeds.fold(1e-3, f64::max)
}

/// Positions along the travel of a slide in the logs, m.
fn over_travel(case: &Case, slide: &str) -> impl Iterator<Item = f64> {
    let (low, high) = travel(case, slide);
    (0..TRAVEL_POINTS).map(move |k| low + (high - low) * k as f64 / (TRAVEL_POINTS - 1) as f64)
}

/// Range of positions of a slide in the logs, m: as logged, and by the drives.
fn travel(case: &Case, slide: &str) -> (f64, f64) {
    let (machine, geometry) = (&case.machine, case.machine.geometry());
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut see = |values: &mut dyn Iterator<Item = f64>| {
        values.filter(|value| value.is_finite()).for_each(|value| (low, high) = (low.min(value), high.max(value)));
    };
    let at = geometry.slides.iter().find(|at| geometry.label(at.body).key == slide);
    for log in case.experiments.iter().filter_map(|experiment| experiment.log.as_ref()) {
        let positions = || log.outputs.iter().filter(|output| output.quantity.is_position());
        let of_body = |body: &str| positions().find(|output| output.quantity.body() == Some(body));
        if let Some(output) = of_body(slide) {
            see(&mut output.values.iter().copied());
        }
        if machine.has_one_coordinate() {
            let angles = positions().filter(|output| !output.quantity.is_linear());
            angles.for_each(|angle| see(&mut angle.values.iter().map(|value| machine.pulley_radius * value)));
            continue;
        }
        // Angles of all drives that move it.
        let drives = geometry.drives.iter().zip(at.map_or(&[][..], |at| at.by_drives));
        let moving: Vec<_> = drives.filter(|(_, weight)| **weight != 0.0).collect();
        for is_rotor in [false, true] {
            let of_drive = |(drive, weight): &(&DriveAt, &f64)| {
                let label = if is_rotor { drive.rotor } else { geometry.label(drive.pulley) };
                of_body(label.key).map(|output| (**weight, &output.values))
            };
            let Some(parts) = moving.iter().map(of_drive).collect::<Option<Vec<_>>>() else { continue };
            let rows = parts.iter().map(|(_, values)| values.len()).min().unwrap_or_default();
            let place = |row: usize| parts.iter().map(|(weight, values)| weight * values[row]).sum::<f64>();
            see(&mut (0..rows).map(|row| machine.pulley_radius * place(row)));
        }
    }
    if high > low { (low, high) } else { (-1.0, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::TEMPLATE;
    use crate::parameter::Free;

    /// On EMPS a breakaway of 11 kN with 21 N of Coulomb friction fitted three quarters of the record, which never
    /// rest, and held the fourth for ever.
    #[test]
    fn a_breakaway_stays_near_coulomb_friction() {
        let text = format!("{TEMPLATE}\n[fit]\nfree = [\"cart.friction.coulomb\"]\n");
        let case = Case::from_text("axis.toml", &text).unwrap();
        let plan = Plan { free: vec!["cart.friction.coulomb".into()], ..Plan::default() };
        let coulomb = case.machine.cart.friction.forward.coulomb;
        for (law, key, ends) in [
            (FrictionLaw::LuGre, "cart.friction.static", [1.0, 4.0]),
            (FrictionLaw::Stribeck, "cart.friction.stribeck.force", [0.0, 3.0]),
        ] {
            let (own, plan) = with(&case, "axis.toml".as_ref(), &plan, law, false, &case.machine).unwrap();
            assert_eq!(own.fit.as_ref().map(|own| own.bounds.clone()), Some(plan.bounds.clone()));
            let free = Free::new(&own.machine, key, &[], &plan.bounds).unwrap();
            assert_eq!([free.low, free.high], ends.map(|end| end * coulomb));
        }
        // Given bounds have precedence.
        let key = "cart.friction.static".to_string();
        let given = Plan { bounds: vec![(key.clone(), [0.0, 9.0 * coulomb])], ..plan };
        let (own, plan) = with(&case, "axis.toml".as_ref(), &given, FrictionLaw::LuGre, false, &case.machine).unwrap();
        assert_eq!(Free::new(&own.machine, &key, &[], &plan.bounds).unwrap().high, 9.0 * coulomb);
    }

    /// Coulomb friction bends bristles by 20 µm along the belt, at the cart as at the pulley.
    #[test]
    fn bristles_begin_as_stiff_at_the_pulley_as_at_the_cart() {
        let text = format!("{TEMPLATE}\n[fit]\nfree = [\"cart.mass\"]\n");
        let case = Case::from_text("axis.toml", &text).unwrap();
        for (body, arm) in [("cart", 1.0), ("drive_pulley", case.machine.pulley_radius)] {
            let plan = Plan { free: vec![format!("{body}.friction.coulomb")], ..Plan::default() };
            let (own, _) = with(&case, "axis.toml".as_ref(), &plan, FrictionLaw::LuGre, false, &case.machine).unwrap();
            let [coulomb, stiffness] = ["coulomb", "lugre.stiffness"]
                .map(|key| Free::new(&own.machine, &format!("{body}.friction.{key}"), &[], &[]).unwrap().start);
            let bend = arm * coulomb / stiffness;
            assert!((bend / 20e-6 - 1.0).abs() < 1e-9, "{body}: {bend}");
        }
    }

    /// Curves of friction begin to fall within speeds of which a log has many.
    #[test]
    fn a_stribeck_curve_begins_far_below_the_greatest_speed() {
        let case = Case::from_text("axis.toml", TEMPLATE).unwrap();
        let from = &case.machine.cart.friction;
        for (law, kind) in [(FrictionLaw::Stribeck, "stribeck"), (FrictionLaw::LuGre, "lugre")] {
            let (table, keys) = table(&case, law, false, from, 0.8, ("cart", "cart"));
            let velocity = table[kind].as_inline_table().unwrap()["velocity"].as_float().unwrap();
            assert!((0.01..0.1).contains(&(velocity / 0.8)), "{velocity}");
            assert!(keys.contains(&format!("{kind}.velocity")), "{keys:?}");
        }
    }
}

//! The friction of a body: viscous, Coulomb, breakaway, and the law that joins them.

use super::reader::{Field, Table};
use crate::error::Result;
use crate::friction::{Friction, Law, Shape, Side, velocity_of_decay};
use crate::polyline::{MOST_POINTS, Polyline};
use crate::quantity::show;

/// Laws other than the paper's, by their keys; at most one of them.
const LAWS: [&str; 3] = ["stribeck", "smooth", "lugre"];

/// The friction of a body; all zero where the table says nothing.
pub(super) fn friction(body: &Table) -> Result<Friction> {
    let Some(field) = body.optional("friction") else { return Ok(Friction::default()) };
    let table = field.table()?;
    table.check_keys(&[], &[])?;
    let viscous = table.number("viscous")?;
    let coulomb = table.number("coulomb")?;
    let coulomb_backward = table.number_if_given("coulomb_backward")?.unwrap_or(coulomb);
    let breakaway = table.number_if_given("static")?;
    let breakaway_backward = table.number_if_given("static_backward")?.or(breakaway);

    // At rest a body holds at least what it resists with in motion.
    let unit = if body.field.section.ends_with("pulley") { "N m" } else { "N" };
    let at_least = |key: &str, breakaway: Option<f64>, allowed: &str, coulomb: f64| match breakaway {
        Some(value) if value < coulomb => {
            let field = table.optional(key).unwrap_or_else(|| table.field.clone());
            let (value, coulomb) = (show(value, unit), show(coulomb, unit));
            Err(field
                .fail(format!("a breakaway of {value} is less than the Coulomb friction of {coulomb}"))
                .allowed(allowed))
        }
        _ => Ok(()),
    };
    at_least("static", breakaway, "at least coulomb", coulomb)?;
    let (backward, allowed) = match table.optional("static_backward") {
        Some(_) => ("static_backward", "at least coulomb_backward, which is coulomb where it is not given"),
        None => ("static", "at least coulomb_backward, unless static_backward is given"),
    };
    at_least(backward, breakaway_backward, allowed, coulomb_backward)?;

    let viscous_backward = table.number_if_given("viscous_backward")?.unwrap_or(viscous);
    let forward = Side { viscous, coulomb, breakaway: breakaway.unwrap_or(coulomb) };
    let backward = Side {
        viscous: viscous_backward,
        coulomb: coulomb_backward,
        breakaway: breakaway_backward.unwrap_or(coulomb_backward),
    };
    law(&table, Friction::sided(forward, backward))
}

/// The law that the table names; Coulomb's where it names none.
fn law(table: &Table, friction: Friction) -> Result<Friction> {
    let given: Vec<_> = LAWS.iter().filter_map(|key| table.optional(key)).collect();
    let Some(field) = given.first() else { return Ok(friction) };
    if let Some(other) = given.get(1) {
        return Err(other
            .fail(format!("the law is {} already", field.key()))
            .next("give one of stribeck, smooth and lugre"));
    }
    let law = field.table()?;
    match field.key() {
        "stribeck" => stribeck(table, &law, friction),
        "smooth" => {
            law.check_keys(&[], &[])?;
            Ok(friction.following(Law::Smooth { breakaway_velocity: law.number("breakaway_velocity")? }))
        }
        "lugre" => {
            law.check_keys(&[], &[])?;
            if friction.forward.coulomb == 0.0 || friction.backward.coulomb == 0.0 {
                return Err(field
                    .fail("without Coulomb friction the bristles have nothing to slip against")
                    .allowed("a coulomb above zero beside it"));
            }
            let (stiffness, damping) = (law.number("stiffness")?, law.number("damping")?);
            Ok(friction.following(Law::LuGre { stiffness, damping, velocity: law.number("velocity")? }))
        }
        _ => Err(field.unread()),
    }
}

/// `{ force, decay }` as in eq. (14), or `{ force, velocity, shape }`.
fn stribeck(table: &Table, law: &Table, friction: Friction) -> Result<Friction> {
    law.check_keys(&["shape"], &[])?;
    if let Some(field) = ["static", "static_backward"].iter().find_map(|key| table.optional(key)) {
        return Err(field
            .fail("the breakaway is given already: coulomb and stribeck.force together")
            .next(format!("leave {} out, or stribeck", field.key())));
    }
    let force = law.number("force")?;
    let shapes = [Shape::Gaussian, Shape::Exponential].map(|shape| (shape.word(), shape));
    let shape = law.optional("shape").map_or(Ok(Shape::Gaussian), |field| field.choice(&shapes))?;
    let velocity = match (law.optional("decay"), law.optional("velocity")) {
        (Some(_), Some(velocity)) => {
            return Err(velocity.fail("the decay is given already").next("give either decay, or velocity"));
        }
        (Some(decay), None) if shape == Shape::Exponential => {
            return Err(decay.fail("the decay of eq. (14) makes a gaussian curve").next("give velocity instead"));
        }
        (Some(decay), None) => velocity_of_decay(decay.number()?),
        (None, Some(velocity)) => velocity.number()?,
        (None, None) => {
            let example = if table.field.section.contains("pulley") { "0.5 rad/s" } else { "0.01 m/s" };
            return Err(law.missing("velocity", &format!("for example velocity = \"{example}\", or decay")));
        }
    };
    let raised = |side: Side| Side { breakaway: side.coulomb + force, ..side };
    Ok(Friction::sided(raised(friction.forward), raised(friction.backward))
        .following(Law::Stribeck { velocity, shape }))
}

/// How the cart's friction changes along its travel.
pub(super) fn along(cart: &Table) -> Result<Option<Polyline>> {
    let Some(friction) = cart.optional("friction") else { return Ok(None) };
    friction.table()?.optional("along").map(|field| line(&field, ["position", "factor"])).transpose()
}

/// A line through the points of a list, two numbers each.
pub(super) fn line(field: &Field, [over, value]: [&str; 2]) -> Result<Polyline> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    for point in field.filled_list()? {
        let pair = point.list()?;
        let [x, y] = &pair[..] else {
            return Err(point
                .fail(format!("the point has {} values", pair.len()))
                .allowed(format!("two values: [{over}, {value}]")));
        };
        let named = |key: &str| format!("{}.{key}", field.section);
        let next = [x.clone().named(named(over)).number()?, y.clone().named(named(value)).number()?];
        if points.last().is_some_and(|last| next[0] <= last[0]) {
            return Err(x.fail(format!("the {over}s do not grow")).allowed("above the one before"));
        }
        points.push(next);
    }
    if points.len() > MOST_POINTS {
        return Err(field
            .fail(format!("the line has {} points", points.len()))
            .allowed(format!("up to {MOST_POINTS}")));
    }
    Polyline::new(points).ok_or_else(|| field.fail("this is no line").allowed("at least one point"))
}

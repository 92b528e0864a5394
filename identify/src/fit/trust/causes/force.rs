//! Forces on the cart in addition to viscous and Coulomb friction.
//!
//! Drag and falling friction are lines through points, `force_by_speed`, whose forces keep their ratios: one amplitude
//! each, with exact derivatives.

use super::extension::{Extended, Fitted, Measure, Rubs, Said, Site, Telling, friction_of, shown};
use crate::fit::limits::{DRAG_POINTS, FORCE_FIRST, FORCE_MOST, STRIBECK_POINTS, STRIBECK_SHARES};
use crate::fit::trust::doubts::falling;
use crate::machine::Machine;
use crate::polyline::Polyline;

/// The case with a force of this shape over the speed, in N, on the cart, which keeps its sign; `None` if it has such a
/// line.
fn shaped(site: &Site, points: Vec<[f64; 2]>, size: Measure) -> Option<Extended> {
    let mut machine = site.machine.clone();
    let line = &mut machine.cart.forces.by_speed;
    if line.is_some() {
        return None;
    }
    let moved = (0..points.len()).filter(|&k| points[k][1] != 0.0);
    let tied: Vec<String> = moved.map(|k| format!("cart.force_by_speed.{k}.force")).collect();
    let (name, far) = (tied.join(" = "), FORCE_MOST * parameter(&points));
    *line = Some(Polyline::new(points)?);
    let mut plan = site.plan.clone();
    plan.bounds.push((name.clone(), [far.min(0.0), far.max(0.0)]));
    plan.tied.push(tied);
    Some(Extended { size: Some(size), ..Extended::new(site.with(machine), plan, Telling::Parameter(name)) })
}

/// The first force of a line that is not zero, which is its parameter.
fn parameter(points: &[[f64; 2]]) -> f64 {
    points.iter().map(|point| point[1]).find(|force| *force != 0.0).unwrap_or(1.0)
}

/// The machine without such lines.
pub(super) fn without(site: &Site, mut machine: Machine) -> Machine {
    machine.cart.forces = site.machine.cart.forces.clone();
    machine
}

/// F = −c v |v|
pub(super) fn drags(site: &Site) -> Vec<Extended> {
    let fastest = site.fastest();
    if fastest <= 0.0 {
        return Vec::new();
    }
    let c = FORCE_FIRST * site.force() / (fastest * fastest);
    let half = DRAG_POINTS as i32 / 2;
    // Beyond the last point the force is held.
    let speed = |k: i32| 1.2 * fastest * f64::from(k) / f64::from(half);
    let points: Vec<[f64; 2]> = (-half..=half).map(|k| [speed(k), -c * speed(k) * speed(k).abs()]).collect();
    let size = Measure { name: "drag", unit: "N s^2/m^2", per: c / parameter(&points) };
    shaped(site, points, size).into_iter().collect()
}

pub(super) fn drag_words(_: &Site, extended: &Extended, found: &Fitted) -> Said {
    let per = extended.size.map_or(0.0, |size| size.per);
    let c = per * found.value;
    let words = format!("a drag of {} times the square of the speed", shown(c, "N s^2/m^2"));
    let line = found.machine.cart.forces.by_speed.as_ref();
    let most = line.and_then(|line| line.points().last()).map_or(0.0, |point| point[0]);
    let point = |share: f64| {
        let v = share * most;
        format!("[\"{}\", \"{}\"]", shown(v, "m/s"), shown(-c * v * v.abs(), "N"))
    };
    let points: Vec<String> = [-1.0, -0.5, 0.0, 0.5, 1.0].map(point).to_vec();
    Said { words, add: format!("add force_by_speed = [{}] to [cart]", points.join(", ")) }
}

/// Friction that falls by A with increasing speed. The fitted Coulomb friction is that at rest, and
///
/// ```text
/// F = A (1 − e^{−(v/v_s)²}) sgn v
/// ```
///
/// is subtracted from it.
pub(super) fn falls(site: &Site) -> Vec<Extended> {
    if site.rubs().is_none() {
        return Vec::new();
    }
    let fastest = site.fastest();
    let amplitude = FORCE_FIRST * site.force();
    let of = |share: &f64| {
        let velocity = share * fastest;
        let side = STRIBECK_POINTS.map(|q| [q * velocity, amplitude * (1.0 - (-q * q).exp())]);
        let mut points: Vec<[f64; 2]> = side.iter().rev().map(|[v, force]| [-v, -force]).collect();
        points.push([0.0, 0.0]);
        points.extend(side);
        let per = points.last().map_or(1.0, |point| point[1]) / parameter(&points);
        shaped(site, points, Measure { name: "cart.friction.stribeck.force", unit: "N", per })
    };
    STRIBECK_SHARES.iter().filter_map(of).collect()
}

pub(super) fn fall_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let fall = extended.size.map_or(0.0, |size| size.per) * found.value;
    let line = found.machine.cart.forces.by_speed.as_ref();
    let last = line.and_then(|line| line.points().last()).map_or(0.0, |point| point[0]);
    let velocity = last / STRIBECK_POINTS[STRIBECK_POINTS.len() - 1];
    let whose = site.rubs().map_or("cart", |body| body.key);
    let words = falling(whose, &shown(fall, "N"), &shown(velocity, "m/s"));
    let add = format!(
        "add stribeck = {{ force = \"{}\", velocity = \"{}\" }} to cart.friction",
        shown(fall, "N"),
        shown(velocity, "m/s")
    );
    Said { words, add }
}

/// The machine with the Coulomb friction that remains at speed.
pub(super) fn without_fall(site: &Site, machine: Machine) -> Machine {
    let line = machine.cart.forces.by_speed.as_ref();
    let fall = line.and_then(|line| line.points().last()).map_or(0.0, |point| point[1]);
    let mut machine = without(site, machine);
    let Some(Rubs { key, arm, .. }) = site.rubs() else { return machine };
    let friction = friction_of(&mut machine, key);
    for side in [&mut friction.forward, &mut friction.backward] {
        side.coulomb -= arm * fall;
        side.breakaway = side.breakaway.max(side.coulomb);
    }
    machine
}

/// A constant force on the cart.
pub(super) fn loads(site: &Site) -> Vec<Extended> {
    if site.is_free("cart.load") || site.is_free("cart.friction.coulomb_backward") {
        return Vec::new();
    }
    let mut plan = site.plan.clone();
    plan.free.push("cart.load".into());
    vec![Extended::new(site.with(site.machine.clone()), plan, Telling::Parameter("cart.load".into()))]
}

pub(super) fn load_words(_: &Site, _: &Extended, found: &Fitted) -> Said {
    let load = shown(found.value, "N");
    let both = shown(2.0 * found.value.abs(), "N");
    let way = if found.value < 0.0 { "greater" } else { "less" };
    let words = format!(
        "a constant force of {load} on the cart (or Coulomb friction that is {both} {way} forward than backward)"
    );
    Said { words, add: format!("add load = \"{load}\" to [cart], and cart.load to `free`") }
}

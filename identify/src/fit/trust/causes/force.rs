//! Forces on the cart, beside viscous and Coulomb friction.
//!
//! They are lines through points, `force_by_speed` and `force_along`, whose forces keep their ratios: one amplitude
//! each, with exact derivatives.

use super::extension::{Extended, Fitted, Measure, Said, Site, Telling, shown};
use crate::fit::asked::problem::Problem;
use crate::fit::compare::laws::travel;
use crate::fit::limits::{
    BRISTLE_BEND, DRAG_POINTS, FORCE_FIRST, MOST_BREAKAWAY, RIPPLE_PHASES, RIPPLE_POINTS, STRIBECK_ABOVE,
    STRIBECK_FALL, STRIBECK_POINTS, STRIBECK_SHARES,
};
use crate::friction::Law;
use crate::log::Quantity;
use crate::machine::Machine;
use crate::polyline::{MOST_POINTS, Polyline};
use crate::solve::Bench;
use std::f64::consts::{PI, TAU};

/// A line under `[cart]`.
#[derive(Clone, Copy)]
enum Over {
    Speed,
    Travel,
}

/// The case with a force of this shape, in N, on the cart; none if it has such a line.
fn shaped(site: &Site, over: Over, points: Vec<[f64; 2]>, size: Measure) -> Option<Extended> {
    let mut machine = site.machine.clone();
    let (line, key) = match over {
        Over::Speed => (&mut machine.cart.forces.by_speed, "force_by_speed"),
        Over::Travel => (&mut machine.cart.forces.along, "force_along"),
    };
    if line.is_some() || points.len() > MOST_POINTS {
        return None;
    }
    let tied: Vec<String> =
        (0..points.len()).filter(|&k| points[k][1] != 0.0).map(|k| format!("cart.{key}.{k}.force")).collect();
    *line = Polyline::new(points);
    line.as_ref()?;
    let telling = Telling::Parameter(tied.join(" = "));
    let mut plan = site.plan.clone();
    plan.tied.push(tied);
    Some(Extended { size: Some(size), ..Extended::new(site.with(machine), plan, telling) })
}

/// The first force of a line that is not zero, which is its parameter.
fn parameter(points: &[[f64; 2]]) -> f64 {
    points.iter().map(|point| point[1]).find(|force| *force != 0.0).unwrap_or(1.0)
}

/// The greatest speed of the cart along the logs, as the model has it, m/s.
fn fastest(site: &Site) -> f64 {
    let (problem, x): (&Problem, _) = (&site.found.problem, &site.found.best.x);
    let (mut bench, mut speeds, mut most) = (Bench::default(), [Vec::new()], 0.0);
    for (index, run) in problem.runs.iter().enumerate() {
        let extras = problem.extras_of(index, x);
        if run.predict(&mut bench, &site.machine, &extras, &[Quantity::CartSpeed], &mut speeds) {
            most = speeds[0].iter().fold(most, |most: f64, v| most.max(v.abs()));
        }
    }
    most
}

/// The machine without such lines.
pub(super) fn without(site: &Site, mut machine: Machine) -> Machine {
    machine.cart.forces = site.machine.cart.forces.clone();
    machine
}

/// F = −c v |v|
pub(super) fn drags(site: &Site) -> Vec<Extended> {
    let fastest = fastest(site);
    if fastest <= 0.0 {
        return Vec::new();
    }
    let c = FORCE_FIRST * site.force() / (fastest * fastest);
    let half = DRAG_POINTS as i32 / 2;
    // Beyond the last point the force is held.
    let speed = |k: i32| 1.2 * fastest * f64::from(k) / f64::from(half);
    let points: Vec<[f64; 2]> = (-half..=half).map(|k| [speed(k), -c * speed(k) * speed(k).abs()]).collect();
    let size = Measure { name: "drag", unit: "N s^2/m^2", per: c / parameter(&points) };
    shaped(site, Over::Speed, points, size).into_iter().collect()
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

/// Friction that falls by A as the cart picks up speed. What is fitted as Coulomb friction is that at rest, and
///
/// ```text
/// F = A (1 − e^{−(v/v_s)²}) sgn v
/// ```
///
/// is taken off it.
pub(super) fn falls(site: &Site) -> Vec<Extended> {
    if body(site).is_none() {
        return Vec::new();
    }
    let fastest = fastest(site);
    let amplitude = FORCE_FIRST * site.force();
    let of = |share: &f64| {
        let velocity = share * fastest;
        let side = STRIBECK_POINTS.map(|q| [q * velocity, amplitude * (1.0 - (-q * q).exp())]);
        let mut points: Vec<[f64; 2]> = side.iter().rev().map(|[v, force]| [-v, -force]).collect();
        points.push([0.0, 0.0]);
        points.extend(side);
        let per = points.last().map_or(1.0, |point| point[1]) / parameter(&points);
        shaped(site, Over::Speed, points, Measure { name: "cart.friction.stribeck.force", unit: "N", per })
    };
    STRIBECK_SHARES.iter().filter_map(of).collect()
}

/// The body whose Coulomb friction is searched for, as its key, with what a torque of it is for each N at the cart; none
/// where no body's is, or where it follows another law.
fn body(site: &Site) -> Option<(&'static str, f64)> {
    let Machine { pulley_radius: r, cart, drive_pulley, idler_pulley, .. } = &site.machine;
    let bodies = [
        ("cart", 1.0, cart.friction),
        ("drive_pulley", *r, drive_pulley.friction),
        ("idler_pulley", *r, idler_pulley.friction),
    ];
    let is_free = |key: &str| site.is_free(&format!("{key}.friction.coulomb")) || site.is_free("total.coulomb");
    let own = bodies.into_iter().find(|(key, _, friction)| is_free(key) && friction.forward.coulomb > 0.0);
    own.map(|(key, arm, _)| (key, arm))
}

pub(super) fn fall_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let fall = extended.size.map_or(0.0, |size| size.per) * found.value;
    let line = found.machine.cart.forces.by_speed.as_ref();
    let last = line.and_then(|line| line.points().last()).map_or(0.0, |point| point[0]);
    let velocity = last / STRIBECK_POINTS[STRIBECK_POINTS.len() - 1];
    let whose = body(site).map_or("cart", |(key, _)| key);
    let (verb, size) = if fall < 0.0 { ("rises", -fall) } else { ("falls", fall) };
    let words = format!(
        "friction of the {} that {verb} by {} within some {}",
        whose.replace('_', " "),
        shown(size, "N"),
        shown(velocity, "m/s")
    );
    let add = match fall < 0.0 {
        true => "try `taut fit --compare`".to_string(),
        false => format!(
            "add stribeck = {{ force = \"{}\", velocity = \"{}\" }} to cart.friction",
            shown(fall, "N"),
            shown(velocity, "m/s")
        ),
    };
    Said { words, add }
}

/// The machine with the Coulomb friction that the line leaves at speed.
pub(super) fn without_fall(site: &Site, machine: Machine) -> Machine {
    let line = machine.cart.forces.by_speed.as_ref();
    let fall = line.and_then(|line| line.points().last()).map_or(0.0, |point| point[1]);
    let mut machine = without(site, machine);
    let Some((key, arm)) = body(site) else { return machine };
    let friction = match key {
        "cart" => &mut machine.cart.friction,
        "drive_pulley" => &mut machine.drive_pulley.friction,
        _ => &mut machine.idler_pulley.friction,
    };
    for side in [&mut friction.forward, &mut friction.backward] {
        side.coulomb -= arm * fall;
        side.breakaway = side.breakaway.max(side.coulomb);
    }
    machine
}

/// Friction of the cart by bristles, which bend before they slip.
pub(super) fn bristles(site: &Site) -> Vec<Extended> {
    let mut machine = site.machine.clone();
    let friction = &mut machine.cart.friction;
    let coulomb = f64::min(friction.forward.coulomb, friction.backward.coulomb);
    if friction.law != Law::Coulomb || coulomb <= 0.0 || !site.is_free("cart.friction.coulomb") {
        return Vec::new();
    }
    let stiffness = coulomb / BRISTLE_BEND;
    let velocity = STRIBECK_FALL * fastest(site);
    friction.law = Law::LuGre { stiffness, damping: (stiffness * machine.cart.mass).sqrt(), velocity };
    for side in [&mut friction.forward, &mut friction.backward] {
        side.breakaway = (1.0 + STRIBECK_ABOVE) * side.coulomb;
    }
    let mut plan = site.plan.clone();
    plan.free.extend(["static", "lugre.stiffness", "lugre.velocity"].map(|key| format!("cart.friction.{key}")));
    plan.bounds.push(("cart.friction.static".into(), [coulomb, MOST_BREAKAWAY * coulomb]));
    vec![Extended::new(site.with(machine), plan, Telling::Parameter("cart.friction.lugre.stiffness".into()))]
}

pub(super) fn bristle_words(_: &Site, _: &Extended, found: &Fitted) -> Said {
    let friction = found.machine.cart.friction;
    let Law::LuGre { stiffness, damping, velocity } = friction.law else {
        return Said { words: "friction by bristles".into(), add: String::new() };
    };
    let words = format!(
        "friction of the cart by bristles (LuGre) of {}, {} at rest",
        shown(stiffness, "N/m"),
        shown(friction.forward.breakaway, "N")
    );
    let add = format!(
        "add static = \"{}\", lugre = {{ stiffness = \"{}\", damping = \"{}\", velocity = \"{}\" }} to cart.friction",
        shown(friction.forward.breakaway, "N"),
        shown(stiffness, "N/m"),
        shown(damping, "N s/m"),
        shown(velocity, "m/s")
    );
    Said { words, add }
}

/// The machine with the Coulomb friction that bristles have in sliding.
pub(super) fn without_bristles(site: &Site, mut machine: Machine) -> Machine {
    let own = site.machine.cart.friction;
    let friction = &mut machine.cart.friction;
    friction.law = own.law;
    for side in [&mut friction.forward, &mut friction.backward] {
        side.breakaway = side.coulomb;
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

/// A force that comes again with each turn of the drive pulley.
pub(super) fn ripples(site: &Site) -> Vec<Extended> {
    let turn = TAU * site.machine.pulley_radius;
    let (low, high) = travel(site.case);
    let step = turn / RIPPLE_POINTS as f64;
    let count = ((high - low) / step).ceil() as usize + 3;
    if high - low < 2.0 * turn || count > MOST_POINTS {
        return Vec::new();
    }
    let amplitude = FORCE_FIRST * site.force();
    let of = |phase: usize| {
        let phase = PI * phase as f64 / RIPPLE_PHASES as f64;
        let place = |k: usize| low + (k as f64 - 1.0) * step;
        let force = |x: f64| amplitude * (TAU * x / turn + phase).cos();
        // The parameter is the first of them that is not zero.
        let points: Vec<[f64; 2]> = (0..count)
            .map(|k| [place(k), force(place(k))])
            .map(|[x, force]| [x, if force.abs() < 1e-6 * amplitude { 0.0 } else { force }])
            .collect();
        let size = Measure { name: "ripple", unit: "N", per: amplitude / parameter(&points) };
        shaped(site, Over::Travel, points, size)
    };
    (0..RIPPLE_PHASES).filter_map(of).collect()
}

pub(super) fn ripple_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let force = (extended.size.map_or(0.0, |size| size.per) * found.value).abs();
    let turn = shown(TAU * site.machine.pulley_radius, "m");
    let words =
        format!("a force of ±{} on the cart that comes again every {turn}, a turn of the pulley", shown(force, "N"));
    Said { words, add: "add force_along to [cart], with ten points in a turn".into() }
}

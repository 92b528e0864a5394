//! Forces on a slide in addition to viscous and Coulomb friction: on the cart, or on the bridge of a gantry.
//!
//! Drag and falling friction are lines through points, `force_by_speed`, whose forces keep their ratios: one amplitude
//! each, with exact derivatives.

use super::extension::{Extended, Fitted, Measure, Rubs, Said, Site, Telling, friction_of, shown, slide_of};
use crate::fit::limits::{
    BREAKAWAY_FIRST, DRAG_POINTS, FORCE_FIRST, FORCE_MOST, LEAST_BREAKAWAY, MOST_BREAKAWAY, STRIBECK_POINTS,
    STRIBECK_SHARES,
};
use crate::fit::trust::doubts::falling;
use crate::friction::Law;
use crate::machine::Machine;
use crate::polyline::Polyline;

/// The case with a force of this shape over the speed, in N, on a slide, which keeps its sign; `None` if it has such a
/// line.
fn shaped(site: &Site, slide: &str, points: Vec<[f64; 2]>, size: Measure) -> Option<Extended> {
    let mut machine = site.begins().clone();
    let line = &mut slide_of(&mut machine, slide).forces.by_speed;
    if line.is_some() {
        return None;
    }
    let moved = (0..points.len()).filter(|&k| points[k][1] != 0.0);
    let tied: Vec<String> = moved.map(|k| format!("{slide}.force_by_speed.{k}.force")).collect();
    let (name, far) = (tied.join(" = "), FORCE_MOST * parameter(&points));
    *line = Some(Polyline::new(points)?);
    let mut plan = site.plan.clone();
    plan.bounds.push((name.clone(), [far.min(0.0), far.max(0.0)]));
    plan.tied.push(tied);
    Some(Extended { size: Some(size), ..Extended::new(site.with(machine), plan, Telling::Parameter(name)) })
}

/// The slide that has the element.
fn slide(site: &Site, extended: &Extended) -> &'static str {
    let name = match &extended.telling {
        Telling::Parameter(name) | Telling::Above(name, _) => name.as_str(),
        _ => "",
    };
    site.slides.iter().copied().find(|slide| name.starts_with(slide)).unwrap_or("cart")
}

/// The slide in words: named if there are several.
fn whose(site: &Site, slide: &str) -> String {
    if site.slides.len() > 1 { format!(" on the {slide}") } else { String::new() }
}

/// The line over the speed of a slide.
fn line_of<'m>(machine: &'m mut Machine, slide: &str) -> Option<&'m Polyline> {
    slide_of(machine, slide).forces.by_speed.as_ref()
}

/// The first force of a line that is not zero, which is its parameter.
fn parameter(points: &[[f64; 2]]) -> f64 {
    points.iter().map(|point| point[1]).find(|force| *force != 0.0).unwrap_or(1.0)
}

/// The machine without such lines.
pub(super) fn without(site: &Site, mut machine: Machine) -> Machine {
    let mut own = site.machine.clone();
    for slide in &site.slides {
        slide_of(&mut machine, slide).forces = slide_of(&mut own, slide).forces.clone();
    }
    machine
}

/// F = −c v |v| on each slide
pub(super) fn drags(site: &Site) -> Vec<Extended> {
    site.slides.iter().filter_map(|slide| drag(site, slide)).collect()
}

fn drag(site: &Site, slide: &str) -> Option<Extended> {
    let fastest = Some(site.fastest(slide)).filter(|fastest| *fastest > 0.0)?;
    let c = FORCE_FIRST * site.force() / (fastest * fastest);
    let half = DRAG_POINTS as i32 / 2;
    // Beyond the last point the force is held.
    let speed = |k: i32| 1.2 * fastest * f64::from(k) / f64::from(half);
    let points: Vec<[f64; 2]> = (-half..=half).map(|k| [speed(k), -c * speed(k) * speed(k).abs()]).collect();
    let name = match (site.slides.len(), slide) {
        (1, _) => "drag",
        (_, "bridge") => "bridge.drag",
        _ => "cart.drag",
    };
    let size = Measure { name, unit: "N s^2/m^2", per: c / parameter(&points) };
    shaped(site, slide, points, size)
}

pub(super) fn drag_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let (per, slide) = (extended.size.map_or(0.0, |size| size.per), slide(site, extended));
    let c = per * found.value;
    let words = format!("a drag{} of {} times the square of the speed", whose(site, slide), shown(c, "N s^2/m^2"));
    let mut machine = found.machine.clone();
    let most = line_of(&mut machine, slide).and_then(|line| line.points().last()).map_or(0.0, |point| point[0]);
    let point = |share: f64| {
        let v = share * most;
        format!("[\"{}\", \"{}\"]", shown(v, "m/s"), shown(-c * v * v.abs(), "N"))
    };
    let points: Vec<String> = [-1.0, -0.5, 0.0, 0.5, 1.0].map(point).to_vec();
    Said { words, add: format!("add force_by_speed = [{}] to [{slide}]", points.join(", ")) }
}

/// Friction that falls by A with increasing speed. The fitted Coulomb friction is that at rest, and
///
/// ```text
/// F = A (1 − e^{−(v/v_s)²}) sgn v
/// ```
///
/// is subtracted from it.
pub(super) fn falls(site: &Site) -> Vec<Extended> {
    site.rubs().iter().flat_map(|own| falls_of(site, own.slide)).collect()
}

fn falls_of(site: &Site, slide: &'static str) -> Vec<Extended> {
    let fastest = site.fastest(slide);
    let amplitude = FORCE_FIRST * site.force();
    let of = |share: &f64| {
        let velocity = share * fastest;
        let side = STRIBECK_POINTS.map(|q| [q * velocity, amplitude * (1.0 - (-q * q).exp())]);
        let mut points: Vec<[f64; 2]> = side.iter().rev().map(|[v, force]| [-v, -force]).collect();
        points.push([0.0, 0.0]);
        points.extend(side);
        let per = points.last().map_or(1.0, |point| point[1]) / parameter(&points);
        let name = if slide == "bridge" { "bridge.friction.stribeck.force" } else { "cart.friction.stribeck.force" };
        shaped(site, slide, points, Measure { name, unit: "N", per })
    };
    STRIBECK_SHARES.iter().filter_map(of).collect()
}

pub(super) fn fall_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let slide = slide(site, extended);
    let fall = extended.size.map_or(0.0, |size| size.per) * found.value;
    let mut machine = found.machine.clone();
    let last = line_of(&mut machine, slide).and_then(|line| line.points().last()).map_or(0.0, |point| point[0]);
    let velocity = last / STRIBECK_POINTS[STRIBECK_POINTS.len() - 1];
    let whose = site.rubs_with(slide).map_or(slide, |body| body.key);
    let words = falling(whose, &shown(fall, "N"), &shown(velocity, "m/s"));
    let add = format!(
        "add stribeck = {{ force = \"{}\", velocity = \"{}\" }} to {slide}.friction",
        shown(fall, "N"),
        shown(velocity, "m/s")
    );
    Said { words, add }
}

/// The machine with the Coulomb friction that remains at speed.
pub(super) fn without_fall(site: &Site, machine: Machine) -> Machine {
    let (mut with, mut machine) = (machine.clone(), without(site, machine));
    for Rubs { key, slide, arm, .. } in site.rubs() {
        // A line of the case itself is no such fall.
        if line_of(&mut machine, slide).is_some() {
            continue;
        }
        let fall = line_of(&mut with, slide).and_then(|line| line.points().last()).map_or(0.0, |point| point[1]);
        let friction = friction_of(&mut machine, key);
        for side in [&mut friction.forward, &mut friction.backward] {
            side.coulomb -= arm * fall;
            side.breakaway = side.breakaway.max(side.coulomb);
        }
    }
    machine
}

/// A breakaway above Coulomb friction.
pub(super) fn breakaways(site: &Site) -> Vec<Extended> {
    let of = |own: &Rubs| {
        let (key, coulomb) = (format!("{}.friction.static", own.key), format!("{}.friction.coulomb", own.key));
        let side = own.friction.forward;
        if site.is_free(&key) || own.friction.law != Law::Coulomb || side.breakaway > side.coulomb {
            return None;
        }
        let mut machine = site.begins().clone();
        let friction = friction_of(&mut machine, own.key);
        for side in [&mut friction.forward, &mut friction.backward] {
            side.breakaway = BREAKAWAY_FIRST * side.coulomb;
        }
        let mut plan = site.plan.clone();
        plan.free.push(key.clone());
        plan.bounds.push((key.clone(), [LEAST_BREAKAWAY * side.coulomb, MOST_BREAKAWAY * side.coulomb]));
        Some(Extended::new(site.with(machine), plan, Telling::Above(key, coulomb)))
    };
    site.rubs().iter().filter_map(of).collect()
}

pub(super) fn breakaway_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let slide = slide(site, extended);
    let (least, most) = (shown(found.least, "N"), shown(found.least + found.value, "N"));
    let words = format!("a breakaway of the {slide} of {most}, above its Coulomb friction of {least}");
    let key = format!("{slide}.friction.static");
    Said { words, add: format!("add static = \"{most}\" to {slide}.friction, and {key} to `free`") }
}

/// The machine with the breakaway of the case.
pub(super) fn without_breakaway(site: &Site, mut machine: Machine) -> Machine {
    for Rubs { key, friction, .. } in site.rubs() {
        let own = friction_of(&mut machine, key);
        for (side, own) in [(friction.forward, &mut own.forward), (friction.backward, &mut own.backward)] {
            own.breakaway = if side.breakaway > side.coulomb { side.breakaway.max(own.coulomb) } else { own.coulomb };
        }
    }
    machine
}

/// A constant force on each slide.
pub(super) fn loads(site: &Site) -> Vec<Extended> {
    let of = |slide: &&'static str| {
        let key = format!("{slide}.load");
        if site.is_free(&key) || site.is_free(&format!("{slide}.friction.coulomb_backward")) {
            return None;
        }
        let mut plan = site.plan.clone();
        plan.free.push(key.clone());
        Some(Extended::new(site.with(site.begins().clone()), plan, Telling::Parameter(key)))
    };
    site.slides.iter().filter_map(of).collect()
}

pub(super) fn load_words(site: &Site, extended: &Extended, found: &Fitted) -> Said {
    let slide = slide(site, extended);
    let load = shown(found.value, "N");
    let both = shown(2.0 * found.value.abs(), "N");
    let way = if found.value < 0.0 { "greater" } else { "less" };
    let words = format!(
        "a constant force of {load} on the {slide} (or Coulomb friction that is {both} {way} forward than backward)"
    );
    Said { words, add: format!("add load = \"{load}\" to [{slide}], and {slide}.load to `free`") }
}

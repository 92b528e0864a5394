//! The limits of a linear model, in words.

use super::Operation;
use crate::friction::Law;
use crate::machine::{BeltModel, DriveUnit, Machine};
use crate::mechanism::{AmplifierMode, Mechanism, MotionKind, Phases};
use crate::number::engineering_typed;

/// Operating point and assumptions: a sentence for each nonlinear part of the machine.
pub(crate) fn assumptions(machine: &Machine, operation: Operation) -> Vec<String> {
    let plant = machine.mechanism();
    let held = |body: usize| operation.held[body] || operation.held[plant.leader(body)];
    let moving: Vec<usize> = leaders(&plant).filter(|body| !held(*body)).collect();
    let mut words = Vec::new();
    let stopped: Vec<&str> = plant.held_bodies().filter(|b| held(*b)).map(|b| plant.bodies[b].label.name).collect();
    if !stopped.is_empty() {
        words.push(format!("held where it is: {}", stopped.join(", ")));
    }
    words.extend(sliding(&plant, operation, &moving));
    words.extend(curves(&plant, operation, &moving));
    words.extend(forces(machine, &plant, operation, &moving));
    words.extend(drives(machine, &plant));
    words.extend(steppers(machine, &plant, operation));
    if machine.belt.pretension.is_some() {
        words.push("the spans are taken taut; forces are those beyond pretension".into());
    }
    match machine.belt.model {
        BeltModel::Elastic => {}
        BeltModel::TwoMass => words.push("the belt's model is two-mass: both pulleys are one inertia".into()),
        BeltModel::Rigid => words.push("the belt's model is rigid: it does not stretch, so it has no resonance".into()),
    }
    if machine.slides().any(|slide| slide.travel.is_some_and(|travel| travel.stop.is_some())) {
        let who = if machine.bridge.is_some() { "bridge and cart are" } else { "the cart is" };
        words.push(format!("{who} taken between the end stops"));
    }
    words.extend(differences_of_modes(machine, &plant, operation));
    words
}

/// Effects that the poles include and [`Natural`](super::Natural) modes do not.
fn differences_of_modes(machine: &Machine, plant: &Mechanism, operation: Operation) -> Vec<String> {
    let mut words = Vec::new();
    let is_curved = |body: usize| {
        let friction = &plant.bodies[body].friction;
        friction.law != Law::Coulomb || friction.forward.viscous != friction.backward.viscous
    };
    if plant.held_bodies().any(is_curved) {
        words.push(
            "the damping of the modes has only the viscous friction of forward motion; the poles have all friction"
                .into(),
        );
    }
    let is_sluggish = |unit: &DriveUnit| unit.amplifier.mode == AmplifierMode::Voltage && unit.motor.inductance != 0.0;
    if machine.drives.iter().any(is_sluggish) {
        words.push("the damping of the modes does not include motors with an inductance; the poles do".into());
    }
    if plant.drives.iter().filter_map(Phases::new).any(|phases| phases.regulator.is_none()) {
        words.push("the damping of the modes does not include the phases of the motor; the poles do".into());
    }
    if operation.speed == 0.0 && machine.stepper().is_some_and(|stepper| stepper.detent_torque > 0.0) {
        words.push(
            "the modes have the mean stiffness of the field over its detents; the poles that of a full step".into(),
        );
    }
    words
}

/// Assumptions about friction along the travel and forces on slides.
fn forces(machine: &Machine, plant: &Mechanism, operation: Operation, moving: &[usize]) -> Vec<String> {
    let mut words = Vec::new();
    let slides = machine.geometry().slides.iter().zip(machine.slides());
    let moves = |body: usize| moving.contains(&plant.leader(body));
    for ((at, slide), place) in slides.zip(operation.coordinates(machine)) {
        let whose = match machine.bridge.is_some() {
            true => format!(" of the {}", machine.geometry().label(at.body).name),
            false => String::new(),
        };
        if slide.along.is_some() && moves(at.body) {
            let place = engineering_typed(place, "m", 4);
            words.push(format!(
                "friction{whose} that changes along the travel is taken as it is at x = {place}, and not followed"
            ));
        }
        if slide.forces.along.is_some() {
            words.push(format!(
                "the force{whose} that changes along the travel is taken as it is at the place, and not followed"
            ));
        }
        if slide.forces.by_speed.is_some() && moves(at.body) {
            let speed = engineering_typed(operation.speed, "m/s", 4);
            words
                .push(format!("the force{whose} that changes with the speed is a damper as steep as it is at {speed}"));
        }
    }
    if machine.slides().any(|slide| slide.constant_force() != 0.0) {
        let who = if machine.bridge.is_some() { "bridge or cart" } else { "the cart" };
        words.push(match machine.stepper() {
            Some(_) => format!("the constant force on {who}, which makes a field softer, is left out"),
            None => format!("the constant force on {who} changes the position of the machine, not its vibration"),
        });
    }
    words
}

/// Assumptions about steppers, in one sentence for all.
fn steppers(machine: &Machine, plant: &Mechanism, operation: Operation) -> Option<String> {
    let (phases, stepper) = plant.drives.iter().find_map(|drive| Phases::new(drive).zip(drive.motor.stepper))?;
    let detent = if operation.speed == 0.0 { 4.0 * stepper.teeth() * stepper.detent_torque } else { 0.0 };
    let stiffness = engineering_typed(phases.stiffness() - detent, "N m/rad", 4);
    let whose = if machine.drives.len() > 1 { "each field" } else { "the field" };
    let place = match (operation.speed == 0.0, stepper.detent_torque > 0.0) {
        (true, _) => "at rest on a full step",
        (false, true) => "while it turns over its detents, whose mean is zero",
        (false, false) => "while it turns",
    };
    Some(format!(
        "{whose} holds its rotor like a spring of {stiffness} {place}; without load, commands small against a full step \
         and not rounded to microsteps"
    ))
}

/// Assumptions about amplifiers and gears: one sentence for all drives.
fn drives(machine: &Machine, plant: &Mechanism) -> Vec<String> {
    let mut words = Vec::new();
    let limited = |unit: &DriveUnit| {
        let has_limit = unit.amplifier.voltage_limit.is_some() || unit.amplifier.current_limit.is_some();
        has_limit && unit.motor.stepper.is_none()
    };
    let (amplifier, gear) = match machine.drives.len() {
        1 => (
            "the amplifier is taken within its limits",
            "the gear is taken as driven by the motor: it passes on the efficiency's share of the torque",
        ),
        _ => (
            "the amplifiers are taken within their limits",
            "gears are taken as driven by their motors: they pass on the efficiency's share of the torque",
        ),
    };
    if machine.drives.iter().any(limited) {
        words.push(amplifier.into());
    }
    let backlash = |unit: &DriveUnit| unit.motor.gear_play.map(|play| play.backlash).filter(|width| *width > 0.0);
    let mut widths: Vec<String> =
        machine.drives.iter().filter_map(backlash).map(|w| engineering_typed(w, "rad", 3)).collect();
    widths.dedup();
    if !widths.is_empty() {
        words.push(format!(
            "the gear is taken with its driving flank in contact; within its play of {} the motor moves nothing but its rotor",
            widths.join(" and ")
        ));
    }
    if plant.drives.iter().any(|drive| drive.loses()) {
        words.push(gear.into());
    }
    words
}

/// True if dry friction can hold a moving body of this model at rest.
pub fn sticks(machine: &Machine, operation: Operation) -> bool {
    let plant = machine.mechanism();
    leaders(&plant).any(|body| !operation.held[body] && plant.friction(body).breakaway(true) > 0.0)
}

/// Independent bodies without rotors.
fn leaders(mechanism: &Mechanism) -> impl Iterator<Item = usize> + '_ {
    mechanism.leaders().filter(|&body| !mechanism.bodies[body].is_rotor)
}

/// These bodies, and those that move with them.
fn members<'a>(plant: &'a Mechanism, leaders: &'a [usize]) -> impl Iterator<Item = usize> + 'a {
    leaders.iter().flat_map(|&leader| plant.followers(leader))
}

fn sliding(plant: &Mechanism, operation: Operation, moving: &[usize]) -> Option<String> {
    let breakaway = |body: &usize| {
        let most = plant.friction(*body).breakaway(operation.speed >= 0.0);
        let [_, _, unit] = plant.bodies[*body].kind.units();
        let name = plant.bodies[*body].label.name;
        (most > 0.0).then(|| format!("{name} up to {}", engineering_typed(most, unit, 4)))
    };
    let way = if operation.speed >= 0.0 { "forward" } else { "backward" };
    let holds: Vec<String> = moving.iter().filter_map(breakaway).collect();
    let curve = members(plant, moving).any(|body| plant.bodies[body].friction.law != Law::Coulomb);
    let pace = match operation.speed == 0.0 {
        true => "in the limit of zero speed".to_string(),
        false => format!("at {}", engineering_typed(operation.speed.abs(), "m/s", 4)),
    };
    Some(match (holds.is_empty(), operation.speed == 0.0) {
        _ if moving.is_empty() => "only the current and the rotor can move".into(),
        (true, true) => "linearised at rest: nothing sticks".into(),
        (true, false) if curve => format!("linearised while it moves {way} {pace}"),
        (true, false) => "linear without assumptions: nothing sticks".into(),
        (false, true) => format!(
            "at rest this stage sticks: dry friction holds {}, which then do not respond to inputs; linearised instead \
             while everything slides {way}, {pace}; --stuck leaves them out",
            holds.join(", ")
        ),
        (false, false) => {
            let pace = if curve { format!(" {pace}") } else { String::new() };
            format!(
                "linearised while everything slides {way}{pace}, where dry friction does not change and drops out; \
                 at rest it holds {}",
                holds.join(", ")
            )
        }
    })
}

fn curves(plant: &Mechanism, operation: Operation, moving: &[usize]) -> Vec<String> {
    let of = |body: usize| {
        let part = &plant.bodies[body];
        let friction = part.friction;
        let speed = operation.speed / part.kind.lever();
        let (name, unit) = (part.label.name, if part.kind == MotionKind::Linear { "N s/m" } else { "N m s/rad" });
        match friction.law {
            Law::Coulomb => None,
            Law::LuGre { .. } if operation.speed == 0.0 => {
                Some(format!("the bristles of the {name} hold it like a spring: one more state"))
            }
            Law::LuGre { .. } => {
                Some(format!("the bristles of the {name} are one more state, bent as in steady sliding"))
            }
            Law::Stribeck { .. } | Law::Smooth { .. } => {
                let slope = friction.slope(speed);
                let told = engineering_typed(slope, unit, 4);
                let falls = if slope < 0.0 { ": it falls with speed, which feeds oscillations" } else { "" };
                Some(format!("friction of the {name} has the slope {told} at this speed{falls}"))
            }
        }
    };
    members(plant, moving).filter_map(of).collect()
}

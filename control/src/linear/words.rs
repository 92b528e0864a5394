//! The limits of a linear model, in words.

use super::Operation;
use crate::friction::Law;
use crate::machine::axis::{BODIES, CART};
use crate::machine::{BeltModel, Machine};
use crate::mechanism::Mechanism;
use crate::number::engineering_typed;

/// The operating point and the assumptions: a sentence for each part that makes the stage more than a linear system.
pub fn assumptions(machine: &Machine, operation: Operation) -> Vec<String> {
    let plant = machine.mechanism();
    let held = |body: usize| operation.held[body] || operation.held[plant.leader(body)];
    let moving: Vec<usize> = leaders(&plant).filter(|body| !held(*body)).collect();
    let mut words = Vec::new();
    let stopped: Vec<&str> = (0..BODIES).filter(|b| held(*b)).map(|b| plant.bodies[b].label.name).collect();
    if !stopped.is_empty() {
        words.push(format!("held where it is: {}", stopped.join(", ")));
    }
    words.extend(sliding(&plant, operation, &moving));
    words.extend(curves(&plant, operation, &moving));
    if machine.cart.along.is_some() && moving.contains(&plant.leader(CART)) {
        let at = engineering_typed(operation.position, "m", 4);
        words.push(format!("friction that changes along the travel is taken as it is at x = {at}, and not followed"));
    }
    let forces = &machine.cart.forces;
    if forces.along.is_some() {
        words.push("the force that changes along the travel is taken as it is at the place, and not followed".into());
    }
    if forces.by_speed.is_some() && moving.contains(&plant.leader(CART)) {
        let at = engineering_typed(operation.speed, "m/s", 4);
        words.push(format!("the force that changes with the speed is a damper as steep as it is at {at}"));
    }
    let amplifier = &machine.drives[0].amplifier;
    if amplifier.voltage_limit.is_some() || amplifier.current_limit.is_some() {
        words.push("the amplifier is taken within its limits".into());
    }
    if let Some(play) = machine.drives[0].motor.gear_play.filter(|play| play.backlash > 0.0) {
        let width = engineering_typed(play.backlash, "rad", 3);
        words.push(format!(
            "the gear is taken with its driving flank in contact; within its play of {width} the motor moves nothing but its rotor"
        ));
    }
    if plant.drives[0].loses() {
        words
            .push("the gear is taken as driven by the motor: it passes on its efficiency's share of the torque".into());
    }
    if machine.belt.pretension.is_some() {
        words.push("the spans are taken taut; forces are those beyond pretension".into());
    }
    match machine.belt.model {
        BeltModel::Elastic => {}
        BeltModel::TwoMass => words.push("the belt's model is two-mass: both pulleys are one inertia".into()),
        BeltModel::Rigid => words.push("the belt's model is rigid: it does not stretch, so it has no resonance".into()),
    }
    if machine.cart.travel.is_some_and(|travel| travel.stop.is_some()) {
        words.push("the cart is taken between its end stops".into());
    }
    if machine.cart.constant_force() != 0.0 {
        words.push("the constant force on the cart changes where the stage is, not how it swings".into());
    }
    words
}

/// Whether dry friction can hold a body that moves in this model at rest.
pub fn sticks(machine: &Machine, operation: Operation) -> bool {
    let plant = machine.mechanism();
    leaders(&plant).any(|body| !operation.held[body] && plant.friction(body).breakaway(true) > 0.0)
}

/// Bodies that move by themselves, rotors apart.
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
        _ if moving.is_empty() => "nothing is left to move but the current and the rotor".into(),
        (true, true) => "linearised at rest: nothing sticks".into(),
        (true, false) if curve => format!("linearised while it moves {way} {pace}"),
        (true, false) => "linear as it stands: nothing sticks".into(),
        (false, true) => format!(
            "at rest this stage sticks: dry friction holds {}, and what is held answers no input; \
             linearised instead while everything slides {way}, {pace}; --stuck takes who is held out",
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
        let (name, unit) = (part.label.name, if body == CART { "N s/m" } else { "N m s/rad" });
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

//! Moved mass in each direction of the load.

use super::direction::Direction;
use super::{Group, Note, told};
use crate::machine::Machine;
use crate::number::engineering;
use std::f64::consts::PI;

/// Share of the moved mass above which a belt's own mass shows.
const HEAVY: f64 = 0.1;

pub(super) fn inertia(machine: &Machine, directions: &[Direction], notes: &mut Vec<Note>) -> Group {
    let name = if machine.bridge.is_some() { "Moved mass" } else { "Moved mass, at the cart" };
    let mut group = Group::new("inertia", name);
    for (label, slide) in machine.travels().map(|(label, _)| label).zip(machine.slides()) {
        group.add(format!("{}_mass", label.key), label.name, slide.mass, "kg");
    }
    turning(&mut group, machine, directions);
    for direction in directions {
        group.add(direction.key("total_mass"), direction.words("total"), direction.mass(), "kg");
        let share = direction.turning / direction.mass();
        group.add(direction.key("reflected_share"), "share of rotating parts", share, "");
    }
    let heaviest = directions.iter().map(Direction::mass).fold(0.0, f64::max);
    belt(&mut group, machine, heaviest, notes);
    group
}

/// Rotating inertia: part by part for one drive, per direction for several, listed once if it is equal.
fn turning(group: &mut Group, machine: &Machine, directions: &[Direction]) {
    let r = machine.pulley_radius;
    if let [unit] = &machine.drives[..] {
        group.add("drive_pulley_mass", "drive pulley", machine.drive_pulley.inertia / (r * r), "kg").how("J/r²");
        group.add("idler_pulley_mass", "idler pulley", machine.idler_pulley.inertia / (r * r), "kg").how("J/r²");
        // n² J_r / r²
        let rotor = unit.motor.rotor_inertia * (unit.motor.gear_ratio / r).powi(2);
        if rotor > 0.0 {
            group.add("rotor_mass", "rotor", rotor, "kg").how("n² J/r²");
        }
        return;
    }
    let how = "at the belt: (Σ J + n² J_r)/r²";
    if directions.iter().all(|direction| direction.movers == directions[0].movers) {
        group.add("turning_mass", "pulleys and rotors", directions[0].turning, "kg").how(how);
        return;
    }
    for direction in directions {
        let name = direction.words("pulleys and rotors");
        group.add(direction.key("turning_mass"), name, direction.turning, "kg").how(how);
    }
}

/// The mass of the belt, kg, and its share of `moved`.
fn belt(group: &mut Group, machine: &Machine, moved: f64, notes: &mut Vec<Note>) {
    let (Some(per_length), Some(make)) = (machine.belt.sheet.mass_per_length, machine.belt.make) else { return };
    // What lies around the two pulleys of an axis; of gantries it is not known.
    let around = if machine.bridge.is_some() { 0.0 } else { 2.0 * PI * machine.pulley_radius };
    let length = make.spans.iter().sum::<f64>() + around;
    let mass = per_length * length;
    let how = format!("{} long; not in the equations", told(length, "m"));
    group.add("belt_mass", "mass of the belt", mass, "kg").how(how);
    group.add("belt_mass_share", "its share of the moved mass", mass / moved, "");
    if mass > HEAVY * moved {
        let text = format!(
            "the belt weighs {}, {} % of all that moves, and is not in the equations: add about that much to cart.mass",
            told(mass, "kg"),
            engineering(100.0 * mass / moved, "", 2)
        );
        notes.push(Note { code: "heavy-belt", text });
    }
}
